"""Incremental planning: a cost matrix, or all weights, after threats or no-fly areas came, went or moved."""

import dataclasses
from functools import lru_cache, partial

import numpy as np

from cgla_graph._threads import share_out
from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph._validate import fixed
from cgla_graph._validate import point as pair
from cgla_graph.cost_to_go import repair_kernels, reweigh_kernels
from cgla_graph.cost_to_go.bound_kernels import risk_error
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix, matrix_of
from cgla_graph.cost_to_go.model_change import ModelChange
from cgla_graph.errors import GraphError
from cgla_graph.model.adjacency import Node
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import DenseWeights, ImplicitWeights, Weights

#: A box around everything.
EVERYWHERE = np.array([[-np.inf, -np.inf, np.inf, np.inf]])


def lazy_cost_matrix(graph: GeometricGraph, target: Node) -> CostMatrix:
    """
    Compute the cost matrix of a complete graph from the few weights that matter, one at a time.

    The values equal those of `cost_matrix` up to rounding. Memory grows with the number of nodes, not of pairs. A pair
    is weighed only if a lower bound of its weight allows it to lower a value.

    Parameters
    ----------
    graph
        A complete graph under a cost model (`GeometricGraph.complete`).
    target
        The node ``p_t`` with ``G = 0``.

    Returns
    -------
    matrix
        G by label setting. Along a line of the lattice, a path may go from node to node where `cost_matrix` takes one
        long edge of the same cost. With an improper field, whose weights may be below the length, and on a graph that
        holds its weights already, this is `cost_matrix` itself.

    Raises
    ------
    NodeNotFoundError
        If the target is not in the graph.
    GraphError
        If the graph is not complete, or has no cost model.

    Examples
    --------
    >>> from cgla_graph.model.lattice import Lattice
    >>> graph = GeometricGraph.complete(Lattice(20, bounds=(0, 0, 1, 1)))
    >>> round(lazy_cost_matrix(graph, 399).value(0), 12), graph.is_implicit
    (1.414213562373, True)
    """
    _, model = _complete(graph)
    at = graph.index_of(target)
    if not (graph.is_implicit and model.field.is_proper):
        return cost_matrix(graph, target)
    values = np.full(graph.n_nodes, np.inf)
    values[at] = 0.0
    successors = np.full(graph.n_nodes, -1, dtype=np.int64)
    known = _nothing(graph.n_nodes), np.empty(0, dtype=np.int64), np.full(graph.n_nodes, np.nan)
    return _settle(graph, at, known, values, successors)


def repair(matrix: CostMatrix, model: CostModel) -> CostMatrix:
    """
    Bring a cost matrix up to date with another cost model on the same nodes.

    The result equals planning from scratch: threats may have come, gone or moved, no-fly areas may have appeared or
    vanished, and `k` may differ. It is faster the less of the old tree of paths changes: the old paths, weighed anew,
    bound the new values from above; the old values bound them from below, because ``A(i, r) >= G(i) - G(r)`` held for
    every pair. Label setting weighs only the pairs that both bounds allow. Memory grows with the number of nodes.

    Parameters
    ----------
    matrix
        G on a complete graph, of every node: label setting run to the end (`cost_matrix`, `lazy_cost_matrix` or
        `repair`). It is not changed.
    model
        The new cost model.

    Returns
    -------
    matrix
        G under `model`, on a new graph of the same nodes, its weights not computed. Where the old or the new field is
        improper (weights may be negative), it is planned from scratch.

    Raises
    ------
    GraphError
        If the graph is not complete, the matrix does not hold G of every node, or the model is no `CostModel`.

    Notes
    -----
    The values are within 1e-12 of `cost_matrix` on maps of unit size with ``k <= 100``: both add the same weights, in
    another order of summation and of threats. D* Lite (Koenig & Likhachev 2002) and LPA* repair sparse graphs in a
    similar way; on a complete graph the bounds matter more than the queue.

    Examples
    --------
    >>> from cgla_graph.model.lattice import Lattice
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> lattice = Lattice(20, bounds=(0, 0, 1, 1))
    >>> before = lazy_cost_matrix(GeometricGraph.complete(lattice, k=10.0), 399)
    >>> seen = CostModel(RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> after = repair(before, seen)
    >>> fresh = cost_matrix(GeometricGraph.complete(lattice, seen.field, seen.k), 399)
    >>> bool(abs(after.values - fresh.values).max() < 1e-12), round(after.value(0), 4)
    (True, 1.4652)
    """
    nodes, old_model = _complete(matrix.graph)
    _check_model(model)
    if matrix.schedule != "label-setting" or not (matrix.converged or not _is_proper(old_model, model)):
        msg = (
            f"this cost matrix is of schedule {matrix.schedule!r}, converged={matrix.converged}; repair needs G of "
            "every node, by label setting without a source (of a matrix with a linked node, the one before linking)"
        )
        raise GraphError(msg)
    old = matrix.graph
    graph = old.under(model)
    if not _is_proper(old_model, model):
        return cost_matrix(graph, old.labels[matrix.target])
    change = ModelChange.between(old_model, model)
    values, edges = np.empty((2, graph.n_nodes))
    successors = matrix.successors.copy()
    kernel_model = model.kernel_model()
    tree = matrix.order, matrix.values
    redrawn = len(change.redrawn) > 0
    repair_kernels.carry(
        nodes, kernel_model, *tree, successors, change.everything, change.threats, redrawn, values, edges
    )
    repair_kernels.borrow(nodes, kernel_model, *tree, change.weights_only_grow, values, edges, successors)
    before = _nothing(graph.n_nodes)
    if not change.unrelated:
        shrink = model.k / old_model.k if model.k < old_model.k else 1.0
        error = float(risk_error(old_model.field.table))
        before = matrix.values, shrink, old_model.k, change.gone, error, change.opened
    kept = (values == matrix.values)[matrix.order] & change.weights_only_grow
    return _settle(graph, matrix.target, (before, matrix.order[kept], edges), values, successors)


def reweigh(graph: GeometricGraph, model: CostModel) -> GeometricGraph:
    """
    Bring the stored weights of a complete graph up to date with another cost model, for solvers that need all weights.

    Only pairs whose segment is within reach of a threat or near a no-fly polygon that came, went or moved are weighed
    again, on all cores; the rest is copied. If `k` changed, all pairs are weighed.

    Parameters
    ----------
    graph
        A complete graph under a cost model; its weights are computed first if they are not stored yet.
    model
        The new cost model.

    Returns
    -------
    graph
        A new one with its weights stored, the floats of `GeometricGraph.weight_matrix` up to the order of the threats.

    Raises
    ------
    GraphError
        If the graph is not complete, or the model is no `CostModel`.

    Examples
    --------
    >>> from cgla_graph.model.lattice import Lattice
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> lattice = Lattice(20, bounds=(0, 0, 1, 1))
    >>> seen = CostModel(RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> after = reweigh(GeometricGraph.complete(lattice, k=10.0), seen)
    >>> bool((after.weight_matrix() == seen.matrix(lattice.points, lattice.shape)).all())
    True
    """
    nodes, old_model = _complete(graph)
    _check_model(model)
    old = graph.weight_matrix()
    change = ModelChange.between(old_model, model)
    everything = change.everything or not _is_proper(old_model, model)
    changed, redrawn = change.threats, change.redrawn
    out = np.empty_like(old)

    def weigh(first: int, step: int, *, primitive: bool) -> None:
        reweigh_kernels.reweigh_share(
            nodes, model.kernel_model(), everything, changed, redrawn, first, step, old, primitive, out
        )

    # the other pairs are sums of primitive ones, in rows of any share
    share_out(partial(weigh, primitive=True), graph.n_nodes)
    share_out(partial(weigh, primitive=False), graph.n_nodes)
    return dataclasses.replace(graph, model=model, weights=DenseWeights(out))


def linked(matrix: CostMatrix, point: Point) -> tuple[CostMatrix, Node]:
    """
    Join one more node to a cost matrix: ``G(p) = min_j A(p, j) + G(j)``, for a UAV between the lattice points.

    The result is that of label setting with source `point` on the graph with the node: its value and the path from it
    are final, and so are all smaller values. The other values do not count paths through the new node.

    Parameters
    ----------
    matrix
        G of every node of a complete graph. It is not changed.
    point
        ``(x, y)``, map units, anywhere. If it is exactly a node's position, nothing is added.

    Returns
    -------
    matrix
        The values with the new node's as the last, on a graph that has the node.
    node
        The node at `point`.

    Raises
    ------
    GraphError
        If the graph is not complete, or the matrix does not hold G of every node.
    ProblemError
        If the point is not two finite numbers.

    Examples
    --------
    >>> from cgla_graph.model.lattice import Lattice
    >>> matrix = lazy_cost_matrix(GeometricGraph.complete(Lattice(3, bounds=(0, 0, 1, 1))), 8)
    >>> joined, node = linked(matrix, (0.7, 0.6))
    >>> round(joined.value(node), 12), joined.path_from(node)
    (0.5, [9, 8])
    """
    _, model = _complete(matrix.graph)
    if len(matrix.order) != int(np.isfinite(matrix.values).sum()):
        msg = f"this cost matrix settled {len(matrix.order)} nodes, not all; compute it without a source"
        raise GraphError(msg)
    graph, node = with_node(matrix.graph.under(model), point)
    index = graph.index_of(node)
    if graph.n_nodes == matrix.graph.n_nodes:
        return matrix, node
    nodes, _ = _complete(graph)
    if model.field.is_proper:
        value, successor = repair_kernels.link(nodes, matrix.values, model.kernel_model())
    else:
        offers = graph.weights_from(index)[:index] + matrix.values
        successor = int(offers.argmin())
        value = float(offers[successor])
    successors = np.append(matrix.successors, successor if value < np.inf else -1)
    settled = matrix.order[matrix.values[matrix.order] < value]
    values = np.append(matrix.values, value)
    order = settled, len(settled)
    return matrix_of(graph, matrix.target, "label-setting", values, successors, *order, converged=False), node


def with_node(graph: GeometricGraph, point: Point) -> tuple[GeometricGraph, Node]:
    """
    Return a complete graph with one more node at `point`, and that node; stored weights get one more row.

    Parameters
    ----------
    graph
        A complete graph under a cost model. It is not changed.
    point
        ``(x, y)``, map units. If it is exactly a node's position, nothing is added.

    Returns
    -------
    graph
        The last of its nodes is the new one.
    node
        The node at `point`.

    Raises
    ------
    GraphError
        If the graph is not complete.
    ProblemError
        If the point is not two finite numbers.

    Examples
    --------
    >>> graph, node = with_node(GeometricGraph.complete([(0, 0), (3, 0)]), (3, 4))
    >>> node, graph.weights_from(node).tolist()
    (2, [5.0, 4.0, 0.0])
    """
    (positions, *_), model = _complete(graph)
    spot = pair("the point", point)
    if (node := graph.node_at(spot)) is not None:
        return graph, node
    n = graph.n_nodes
    positions = np.vstack([positions, spot])
    positions.flags.writeable = False
    weights: Weights = ImplicitWeights(model, positions, graph.lattice_shape)
    if not graph.is_implicit:
        stored = np.empty((n + 1, n + 1))
        stored[:n, :n] = graph.weight_matrix()
        stored[n] = stored[:, n] = weights.row(n)
        weights = DenseWeights(stored)
    return GeometricGraph(range(n + 1), positions, model=model, lattice=graph.lattice, weights=weights), n


def _nothing(n_nodes: int) -> repair_kernels.Before:
    """Return the state of a matrix without a predecessor."""
    # read-only, as the values of a cost matrix are
    return fixed(np.zeros(n_nodes)), 1.0, 0.0, np.empty((0, 7)), 0.0, EVERYWHERE


def _settle(
    graph: GeometricGraph,
    target: int,
    known: tuple[repair_kernels.Before, IntArray, FloatArray],
    values: FloatArray,
    successors: IntArray,
) -> CostMatrix:
    """Run label setting from upper bounds, in place; `known` is what the kernel calls before, final and edges."""
    nodes, model = _complete(graph)
    order = np.empty(graph.n_nodes, dtype=np.int64)
    settled, _ = repair_kernels.settle_lazily(nodes, model.kernel_model(), *known, values, successors, order)
    successors[~np.isfinite(values)] = -1
    settled_nodes = order[:settled]
    return matrix_of(graph, target, "label-setting", values, successors, settled_nodes, settled, converged=True)


def _complete(graph: GeometricGraph) -> tuple[repair_kernels.Nodes, CostModel]:
    """Return the nodes for the kernels and the model of a complete graph; refuse any other graph."""
    if not isinstance(graph, GeometricGraph):
        msg = f"graph is a {type(graph).__name__}; give a GeometricGraph, such as GeometricGraph.complete(lattice)"
        raise GraphError(msg)
    if graph.is_sparse or graph.model is None or graph.positions is None:
        what = "sparse" if graph.is_sparse else "without a cost model" if graph.model is None else "without positions"
        msg = f"this graph is {what}; incremental planning needs a complete graph: GeometricGraph.complete(lattice, …)"
        raise GraphError(msg)
    shape = graph.lattice_shape
    return (graph.positions, *shape, _coprime(*shape)), graph.model


def _check_model(model: CostModel) -> None:
    if not isinstance(model, CostModel):
        msg = f"model is a {type(model).__name__}; give a CostModel(field, k, no_fly)"
        raise GraphError(msg)


def _is_proper(*models: CostModel) -> bool:
    return all(model.field.is_proper for model in models)


@lru_cache(maxsize=8)
def _coprime(width: int, height: int) -> BoolArray:
    table: BoolArray = np.gcd.outer(np.arange(width), np.arange(height)) == 1
    table.flags.writeable = False
    return table
