"""CGLA's cost matrix: the least cost from every node to a target (Eq. 9), by each of the paper's schedules."""

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, TypeAlias, get_args

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._text import shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import instance, is_one_of, whole_number
from cgla_graph.errors import GraphError, ProblemError
from cgla_graph.model import graph_kernels
from cgla_graph.model.adjacency import Node
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.graph_libraries import graph_wanted
from cgla_graph.model.weights import beyond_holding, reject_overflow

Schedule: TypeAlias = Literal["label-setting", "synchronous", "random", "given"]
#: Label setting over the nodes that may be on one optimum, as `restricted_optimum` does on lattices of any size.
RESTRICTED: Literal["restricted"] = "restricted"
#: Values that a `repr` shows, at most.
MOST_SHOWN = 4


@dataclass(frozen=True, eq=False)
class CostMatrix(Plottable):
    """
    The paper's G: the least cost from each node to the target, and the way there.

    Arrays, `target` and `delta_sets` hold indices of nodes: a node's place in ``graph.labels``, which
    ``graph.index_of(label)`` returns. `value`, `path_from`, `next_of`, `target_label` and `delta_labels` speak labels.

    Attributes
    ----------
    graph
        The graph it was computed on.
    target
        Index of the target.
    schedule
        How ``p_r`` was chosen in Eq. 9; ``restricted``: from the Delta sets of what can be part of one optimum.
    values
        Shape ``(n,)``, map units: G, infinity where the target was not reached (yet). Restricted: infinity also for
        nodes that are not on the optimum.
    successors
        Shape ``(n,)``: index of the next node on the way to the target, -1 where there is none.
    order
        The ``p_r`` of each round (label setting: the order of settling; random: as drawn; given: as given;
        synchronous: empty, as every node serves in every round).
    rounds
        Rounds run: one settled node each in label setting; one ``p_r`` each at random or in a given order, which ends
        as soon as no further round can change a value; in the synchronous schedule, the rounds that changed a value.
    converged
        True: no further round can change a value. False: that is not known (`residual` computes it).
        After an early stop it is False, yet every value of `order` and of the source is final (Theorem 1).

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> matrix = cost_matrix(chain, target=2)
    >>> matrix.values.tolist(), matrix.path_from(0)
    ([2.0, 1.0, 0.0], [0, 1, 2])

    With labels:

    >>> roads = GeometricGraph.from_matrix([[0, 2, 5], [2, 0, 1], [5, 1, 0]], labels=["depot", "bridge", "tower"])
    >>> cost_matrix(roads, "tower")
    CostMatrix(target='tower', values={'depot': 3, 'bridge': 1, 'tower': 0}, schedule='label-setting', rounds=3,
    converged=True)
    """

    graph: GeometricGraph
    target: int
    schedule: Schedule | Literal["restricted"]
    values: FloatArray
    successors: IntArray
    order: IntArray
    rounds: int
    converged: bool

    def shown_fields(self) -> Iterator[tuple[str, str]]:
        """Show labels: the target, and the values of the first nodes."""
        pairs = zip(self.graph.labels[:MOST_SHOWN], self.values[:MOST_SHOWN].tolist(), strict=True)
        few = ", ".join(f"{shown(label)}: {value:.6g}" for label, value in pairs)
        yield "target", shown(self.target_label)
        yield "values", f"{{{few}{', …' * (self.graph.n_nodes > MOST_SHOWN)}}}"
        yield "schedule", repr(self.schedule)
        yield "rounds", str(self.rounds)
        yield "converged", str(self.converged)

    @property
    def target_label(self) -> Node:
        """The target, by its label."""
        return self.graph.labels[self.target]

    def next_of(self, node: Node) -> Node | None:
        """
        Return the next node on the way to the target, or None: of the target, and where there is no way.

        Raises
        ------
        NodeNotFoundError
            If the graph has no such node.

        Examples
        --------
        >>> roads = GeometricGraph.from_matrix([[0, 2, 5], [2, 0, 1], [5, 1, 0]], labels=["depot", "bridge", "tower"])
        >>> matrix = cost_matrix(roads, "tower")
        >>> matrix.next_of("depot"), matrix.next_of("tower")
        ('bridge', None)
        """
        after = int(self.successors[self.graph.index_of(node)])
        return None if after < 0 else self.graph.labels[after]

    @property
    def delta_labels(self) -> list[list[Node]]:
        """
        The sets Delta_k of `delta_sets`, by labels.

        Raises
        ------
        GraphError
            As of `delta_sets`.

        Examples
        --------
        >>> roads = GeometricGraph.from_matrix([[0, 2, 2], [2, 0, 1], [2, 1, 0]], labels=["depot", "bridge", "tower"])
        >>> cost_matrix(roads, "depot").delta_labels
        [['depot'], ['bridge', 'tower'], ['tower']]
        """
        return [[self.graph.labels[index] for index in delta.tolist()] for delta in self.delta_sets]

    def value(self, node: Node) -> float:
        """Return G of one node, map units; infinity if the target cannot be reached from it."""
        return float(self.values[self.graph.index_of(node)])

    def path_from(self, node: Node) -> list[Node]:
        """
        Return the nodes from `node` to the target along the successors; empty if there is no way.

        Raises
        ------
        NodeNotFoundError
            If the graph has no such node.
        GraphError
            If the successors form a cycle, which only negative weights cause.
        """
        index = self.graph.index_of(node)
        if not np.isfinite(self.values[index]):
            return []
        path = [index]
        while path[-1] != self.target:
            path.append(int(self.successors[path[-1]]))
            if len(path) > self.graph.n_nodes:
                msg = f"the successors of node {shown(node)} form a cycle: the graph has negative weights"
                raise GraphError(msg)
        return [self.graph.labels[i] for i in path]

    @cached_property
    def delta_sets(self) -> list[IntArray]:
        """
        The sets Delta_k of Eqs 10-12 that label setting chose from: per round, the unsettled nodes of least value.

        The sets hold indices; `delta_labels` are the same by labels. Computed by running the rounds again; for a
        restricted matrix from the values, as a value is final once it is among the least.

        Raises
        ------
        GraphError
            For another schedule, which has no such sets.

        Examples
        --------
        >>> star = GeometricGraph.from_matrix([[0, 1, 1], [1, 0, 9], [1, 9, 0]])
        >>> [delta.tolist() for delta in cost_matrix(star, target=0).delta_sets]
        [[0], [1, 2], [2]]
        """
        if self.schedule == RESTRICTED:
            served = self.values[self.order]
            return [
                np.sort(self.order[number:][served[number:] == least]) for number, least in enumerate(served.tolist())
            ]
        if self.schedule != "label-setting":
            msg = f"the {self.schedule} schedule has no Delta sets; use schedule='label-setting'"
            raise GraphError(msg)
        values, successors = _start(self.graph.n_nodes, self.target)
        settled = np.zeros(len(values), dtype=np.bool_)
        sets = []
        for node in self.order.tolist():
            open_values = np.where(settled, np.inf, values)
            sets.append(np.nonzero(open_values == open_values.min())[0])
            graph_kernels.settle(self.graph.weights_to(node), node, values, successors, settled)
        return sets

    def history(self) -> FloatArray:
        """
        Return G after each round, shape ``(rounds + 1, n)``, map units; the first row is G before the first round.

        Computed by running the rounds again.

        Raises
        ------
        GraphError
            For a restricted matrix, whose rounds leave out nodes that cannot be on the optimum.

        Examples
        --------
        >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
        >>> cost_matrix(chain, target=2).history().tolist()
        [[inf, inf, 0.0], [9.0, 1.0, 0.0], [2.0, 1.0, 0.0], [2.0, 1.0, 0.0]]
        """
        if self.schedule == RESTRICTED:
            msg = "a restricted cost matrix has no history: its rounds leave out irrelevant nodes; compute all of G"
            raise GraphError(msg)
        values, successors = _start(self.graph.n_nodes, self.target)
        settled, changed = np.zeros((2, len(values)), dtype=np.bool_)
        rounds = [values.copy()]
        for number in range(self.rounds):
            if self.schedule == "synchronous":
                for node in np.nonzero(np.isfinite(rounds[-1]))[0].tolist():
                    before = float(rounds[-1][node])
                    graph_kernels.relax(self.graph.weights_to(node), node, before, values, successors, changed)
            elif self.schedule == "label-setting":
                node = int(self.order[number])
                graph_kernels.settle(self.graph.weights_to(node), node, values, successors, settled)
            elif np.isfinite(values[node := int(self.order[number])]):
                graph_kernels.relax(self.graph.weights_to(node), node, values[node], values, successors, changed)
            rounds.append(values.copy())
        return np.array(rounds)

    def residual(self) -> float:
        """
        Compute the most by which one more round of Eq. 9, with any ``p_r``, would lower a value, map units.

        It is 0 at a fixed point of Eq. 9. It is not the error of the values: later rounds may lower them further.
        Where an edge leads from an unreached node to a reached one, it is infinite.

        Examples
        --------
        >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
        >>> [cost_matrix(chain, 2, schedule="given", order=order).residual() for order in ([2], [2, 1])]
        [7.0, 0.0]
        """
        improved = self.values.copy()
        for node in np.nonzero(np.isfinite(self.values))[0].tolist():
            np.minimum(improved, self.graph.weights_to(node) + self.values[node], out=improved)
        finite = np.isfinite(improved)
        change = self.values[finite] - improved[finite]
        return float(change.max(initial=0.0))


def cost_matrix(
    graph: GeometricGraph,
    target: Node,
    *,
    source: Node | None = None,
    schedule: Schedule = "label-setting",
    order: Iterable[Node] | None = None,
    seed: int | None = None,
) -> CostMatrix:
    """
    Compute CGLA's cost matrix by Eq. 9: ``G(p_i) <- min(G(p_i), A(p_i, p_r) + G(p_r))``.

    Parameters
    ----------
    graph
        Weights ``A``. Positive ones converge as Theorem 1 says; zero weights do as well.
    target
        The node ``p_t`` with ``G = 0``.
    source
        The node ``p_s``: stop as soon as it is in Delta_k (Step 2). Label setting only.
    schedule
        How ``p_r`` is chosen. ``label-setting``: each round an element of Delta_k, the unsettled nodes of least
        value (Eqs 10-12): Dijkstra's algorithm without a heap. ``synchronous``: each round all r at once, from the
        values of the round before: Bellman-Ford. ``random``: a node drawn at random each round, until no node can
        change a value. ``given``: the nodes of `order`.
    order
        The ``p_r`` for the given schedule, one a round; nodes may repeat.
    seed
        Seed of the random schedule, which needs one. In label setting, it draws among several elements of Delta_k;
        None: the one of lowest index.

    Returns
    -------
    matrix
        Values, successors and the rounds that led to them.

    Raises
    ------
    NodeNotFoundError
        If target, source or a node of the order is not in the graph.
    GraphError
        If the schedule is unknown, source, order or seed do not fit it, an implicit complete graph has so many nodes
        that computing all its weights takes hours (`cgla_graph.model.weights.MOST_HELD`), or the weights along a least
        path add up to more than the largest float.

    Examples
    --------
    Label setting, synchronous rounds and any order that is long enough agree.

    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    >>> [cost_matrix(chain, 2, schedule=how).rounds for how in ("label-setting", "synchronous")]
    [3, 2]
    >>> cost_matrix(chain, 2, schedule="given", order=[2, 1]).values.tolist()
    [2.0, 1.0, 0.0]
    """
    _check(graph, source, schedule, order, seed)
    rng = None if seed is None else np.random.default_rng(_seed(seed))
    at = graph.index_of(target)
    start = -1 if source is None else graph.index_of(source)
    if schedule == "label-setting":
        matrix = _label_setting(graph, at, start, rng)
    elif schedule == "synchronous":
        matrix = _synchronous(graph, at)
    elif rng is not None:
        matrix = _given(graph, at, "random", iter(lambda: int(rng.integers(graph.n_nodes)), -1))
    else:
        matrix = _given(graph, at, "given", [graph.index_of(node) for node in (() if order is None else order)])
    # an early stop is followed by no further sums
    stopped = start >= 0 and np.isfinite(matrix.values[start])
    if matrix.converged or (schedule == "label-setting" and not stopped):
        reject_overflow(matrix.values, graph.weights_to)
    return matrix


def _check(
    graph: GeometricGraph, source: Node | None, schedule: Schedule, order: Iterable[Node] | None, seed: int | None
) -> None:
    """Refuse arguments of `cost_matrix` that do not fit each other."""
    instance("graph", graph, GeometricGraph, graph_wanted, GraphError)
    if not is_one_of(schedule, get_args(Schedule)):
        msg = f"unknown schedule {shown(schedule)}; choose one of {', '.join(get_args(Schedule))}"
        raise GraphError(msg)
    if (order is not None) != (schedule == "given"):
        msg = f"schedule {shown(schedule)} with order={'…' if order is not None else None}; an order goes with 'given'"
        raise GraphError(msg)
    if source is not None and schedule != "label-setting":
        msg = f"schedule {schedule!r} cannot stop early at source {shown(source)}; only label-setting has Delta sets"
        raise GraphError(msg)
    if (seed is None and schedule == "random") or (seed is not None and schedule in {"synchronous", "given"}):
        msg = (
            f"schedule {schedule!r} with seed={shown(seed)}; 'random' needs a seed, 'label-setting' takes one for ties"
        )
        raise GraphError(msg)
    if schedule == "random" and graph.has_negative_weights:
        msg = "the graph has weights below 0, with which random rounds may never end; choose another schedule"
        raise GraphError(msg)
    if graph.is_implicit and (too_much := beyond_holding(graph.n_nodes)):
        msg = f"that needs {too_much}; cg.solve(problem, 'cgla') weighs only edges that can be part of the optimum"
        raise GraphError(msg)


def _start(n_nodes: int, target: int) -> tuple[FloatArray, IntArray]:
    values = np.full(n_nodes, np.inf)
    values[target] = 0.0
    return values, np.full(n_nodes, -1, dtype=np.int64)


def _seed(seed: int) -> int:
    """Check a seed."""
    try:
        return whole_number("seed", seed, at_least=0, at_most=2**63 - 1)
    except ProblemError as error:
        raise GraphError(str(error)) from error


def _label_setting(
    graph: GeometricGraph, target: int, source: int, rng: np.random.Generator | None = None
) -> CostMatrix:
    values, successors = _start(graph.n_nodes, target)
    order = np.empty(graph.n_nodes, dtype=np.int64)
    if graph.is_sparse or graph.is_implicit or rng is not None:
        settled = np.zeros(graph.n_nodes, dtype=np.bool_)
        node, rounds = target, 0
        while node >= 0 and not (source >= 0 and values[node] == values[source]):
            order[rounds] = node
            rounds += 1
            node = graph_kernels.settle(graph.weights_to(node), node, values, successors, settled)
            if rng is not None and node >= 0:
                node = int(rng.choice(np.nonzero(~settled & (values == values[node]))[0]))
    else:
        weights = graph.weight_matrix_to()
        rounds = graph_kernels.label_setting(weights, target, source, values, successors, order)
    # An early stop leaves nodes unsettled that have a value; weights below 0 could improve settled ones.
    settled_all = rounds == int(np.isfinite(values).sum()) and not graph.has_negative_weights
    return matrix_of(graph, target, "label-setting", values, successors, order[:rounds], rounds, converged=settled_all)


def _synchronous(graph: GeometricGraph, target: int) -> CostMatrix:
    values, successors = _start(graph.n_nodes, target)
    active = np.zeros(graph.n_nodes, dtype=np.bool_)
    active[target] = True
    rounds = 0
    # With weights of at least 0, n - 1 rounds are enough; negative ones might never converge.
    while active.any() and rounds < graph.n_nodes:
        before = values.copy()
        changed = np.zeros_like(active)
        # a p_r whose value did not change since it last served cannot change another value
        for node in np.nonzero(active)[0].tolist():
            graph_kernels.relax(graph.weights_to(node), node, before[node], values, successors, changed)
        rounds += bool(changed.any())
        active = changed
    empty = np.empty(0, dtype=np.int64)
    done = not active.any()
    return matrix_of(graph, target, "synchronous", values, successors, empty, rounds, converged=done)


def _given(graph: GeometricGraph, target: int, schedule: Schedule, order: Iterable[int]) -> CostMatrix:
    values, successors = _start(graph.n_nodes, target)
    pending = np.zeros(graph.n_nodes, dtype=np.bool_)
    pending[target] = True
    served: list[int] = []
    # the order may be long: it is read only while a p_r may change a value
    for node in order:
        served.append(node)
        # only a p_r whose value changed since it last served can change another value
        if pending[node]:
            pending[node] = False
            graph_kernels.relax(graph.weights_to(node), node, values[node], values, successors, pending)
            if not pending.any():
                break
    used = np.array(served, dtype=np.int64)
    return matrix_of(graph, target, schedule, values, successors, used, len(used), converged=not pending.any())


def matrix_of(
    graph: GeometricGraph,
    target: int,
    schedule: Schedule,
    values: FloatArray,
    successors: IntArray,
    order: IntArray,
    rounds: int,
    *,
    converged: bool,
) -> CostMatrix:
    """Return a cost matrix whose arrays are read-only."""
    for array in (values, successors, order):
        array.flags.writeable = False
    return CostMatrix(graph, target, schedule, values, successors, order, rounds, converged)
