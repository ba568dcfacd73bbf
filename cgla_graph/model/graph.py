"""
The geometric graph that every graph solver plans on: complete, 8-connected, or the user's own.

It is longer than most modules because each constructor documents in full what it takes and refuses.
"""

import operator
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import compress
from typing import TYPE_CHECKING, Any, ClassVar, get_args

import numpy as np
import scipy  # (its modules are imported when they are first used: hints that name them are in quotes)
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._text import shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import (
    instance,
    is_one_of,
    items,
    kind_of,
    number_array,
    point,
    point_array,
    truth_value,
)
from cgla_graph.errors import GraphError, NodeIndexError, NodeNotFoundError, ProblemError
from cgla_graph.model.adjacency import (
    CornerRule,
    Node,
    cell_corners,
    compressed,
    edge_weight,
    eight_neighbours,
    matrix_entries,
    node_positions,
    reject_weight,
)
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph_libraries import GraphLists, graph_wanted, read_igraph, read_networkx, read_rustworkx
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.risk import RiskField
from cgla_graph.model.weights import DenseWeights, ImplicitWeights, SparseWeights, Weights

if TYPE_CHECKING:
    import networkx as nx

#: Points of a lattice at most: a gigabyte and a half of coordinates.
MOST_POINTS = 100_000_000


@dataclass(frozen=True, eq=False)
class GeometricGraph(Plottable):
    """
    Nodes, and a weight for each ordered pair of them: all that a graph solver gets.

    Made by `complete`, `eight_connected`, `from_matrix`, `from_sparse`, `from_networkx`, `from_igraph` or
    `from_rustworkx`. The weights are held as a dense matrix, as a sparse one, or computed on request (a complete graph
    until `with_weights_held`); all three give the same answers. Infinity means that there is no edge; zero is a weight
    like any other.

    Attributes
    ----------
    labels
        The nodes, in the order of their indices: 0, 1, … unless the user's graph names them.
    weights
        The weights, dense, sparse or computed on request.
    positions
        Shape ``(n, 2)``, map units, read-only; None if the nodes have none.
    directed
        Whether weights may differ between the two directions.
    model
        The cost of a segment, where the weights come from Eq. 5; else None.
    lattice
        The lattice whose points are the first nodes, or None.

    Examples
    --------
    >>> square = GeometricGraph.complete(Lattice(2, bounds=(0, 0, 1, 1)), RiskField(), k=10.0)
    >>> square.weights_from(0).round(3).tolist()
    [0.0, 1.0, 1.0, 1.414]
    """

    labels: Sequence[Node]
    positions: FloatArray | None = None
    directed: bool = False
    model: CostModel | None = None
    lattice: Lattice | None = None
    weights: Weights = field(kw_only=True, repr=False)

    #: networkx dispatches calls with such a graph to `cgla_graph.networkx_backend`.
    __networkx_backend__: ClassVar[str] = "cgla"

    @classmethod
    def complete(
        cls,
        points: "Lattice | ArrayLike",
        field: RiskField | None = None,
        k: float = 0.0,
        *,
        no_fly: BaseGeometry | None = None,
        extra: Sequence[Point] = (),
    ) -> "GeometricGraph":
        """
        Join every pair of points by its straight segment, weighted by Eq. 5.

        Weights are computed on request; `with_weights_held` computes all of them.

        Parameters
        ----------
        points
            A lattice, or any points, shape ``(n, 2)``, map units.
        field, k, no_fly
            The risk field, the risk weight (at least 0) and the polygons that take away every edge that crosses
            them.
        extra
            Further points that become nodes after those of `points`, such as a start off the lattice. A point that
            lies on a lattice point is that node.

        Returns
        -------
        graph
            Its labels are 0, 1, ….

        Raises
        ------
        ProblemError
            If points, field, k or area are malformed.
        """
        lattice = points if isinstance(points, Lattice) else None
        if lattice is not None and lattice.n_points > MOST_POINTS:
            sides = " x ".join(map(str, lattice.shape))
            msg = f"a lattice of {sides} points is larger than {MOST_POINTS:.0e} points; lower the resolution"
            raise GraphError(msg)
        base = lattice.points if lattice else point_array("points", points)  # type: ignore[arg-type]
        if base.ndim != 2:  # noqa: PLR2004 - a list of points
            msg = f"points have shape {base.shape}; give shape (n, 2)"
            raise ProblemError(msg)
        positions = _with_extra(base, lattice, extra)
        model = CostModel(RiskField() if field is None else field, k, no_fly)
        weights = ImplicitWeights(model, positions, lattice.shape if lattice else (0, 0))
        return cls(range(len(positions)), positions, model=model, lattice=lattice, weights=weights)

    @classmethod
    def eight_connected(
        cls,
        lattice: Lattice,
        field: RiskField | None = None,
        k: float = 0.0,
        *,
        no_fly: BaseGeometry | None = None,
        extra: Sequence[Point] = (),
        corner_rule: CornerRule = "touch",
    ) -> "GeometricGraph":
        """
        Join every lattice point to its eight neighbours, weighted by Eq. 5.

        Parameters
        ----------
        lattice
            The points.
        field, k, no_fly
            As in `complete`.
        extra
            Further nodes; each is joined to the corners of the lattice cell around it, and to other extra points in
            the same cell.
        corner_rule
            ``touch``: a diagonal step may touch a corner of the no-fly area (as any segment may). ``both-free``: it
            also needs both lattice points beside it outside the area, the rule of grid benchmarks; it does not
            concern the edges of extra nodes.

        Returns
        -------
        graph
            A sparse graph; its labels are 0, 1, ….

        Raises
        ------
        ProblemError
            If lattice, field, k or area are malformed or the rule is unknown.

        Examples
        --------
        >>> GeometricGraph.eight_connected(Lattice(20, bounds=(0, 0, 1, 1))).n_edges
        1482
        """
        if not is_one_of(corner_rule, get_args(CornerRule)):
            msg = f"unknown corner rule {shown(corner_rule)}; choose touch or both-free"
            raise ProblemError(msg)
        instance("lattice", lattice, Lattice, "a Lattice")
        model = CostModel(RiskField() if field is None else field, k, no_fly)
        positions = _with_extra(lattice.points, lattice, extra)
        tails, heads = eight_neighbours(lattice, model, corner_rule)
        if len(positions) > lattice.n_points:
            more = cell_corners(lattice, positions)
            tails, heads = np.concatenate([tails, more[0]]), np.concatenate([heads, more[1]])
        weights = model.weights(positions[tails], positions[heads])
        matrix = compressed(tails, heads, weights, len(positions), mirrored=True)
        return cls(range(len(positions)), positions, model=model, lattice=lattice, weights=SparseWeights(matrix))

    @classmethod
    def from_networkx(
        cls,
        graph: "nx.Graph[Any]",
        *,
        weight: str | None = "weight",
        pos: str = "pos",
        field: RiskField | None = None,
        k: float = 0.0,
        no_fly: BaseGeometry | None = None,
    ) -> "GeometricGraph":
        """
        Convert a networkx graph: any node labels, directed or not; of parallel edges the lightest counts.

        Parameters
        ----------
        graph
            A networkx graph; it is not changed. Self-loops are left out: no least-cost path uses them.
        weight
            The edge attribute that holds the weight, at least 0. None: weigh the edges' straight segments by Eq. 5
            with `field` and `k`, which needs positions.
        pos
            The node attribute that holds ``(x, y)``, map units. Positions are taken if every node has one.
        field, k
            Risk field and risk weight for ``weight=None``.
        no_fly
            Polygons that take away every edge whose straight segment crosses them; needs positions.

        Returns
        -------
        graph
            A sparse graph with the same labels.

        Raises
        ------
        GraphError
            If an edge lacks its weight, or a weight is negative or not a number; if positions are needed and a
            node has none.
        ProblemError
            If positions, field or k are malformed.

        Examples
        --------
        >>> import networkx as nx
        >>> ring = nx.cycle_graph(["a", "b", "c"])
        >>> nx.set_edge_attributes(ring, 2.0, "weight")
        >>> GeometricGraph.from_networkx(ring).weights_from(0).tolist()
        [0.0, 2.0, 2.0]
        """
        return cls._from_lists(read_networkx(graph, weight, pos), weight, pos, field, k, no_fly)

    @classmethod
    def from_igraph(
        cls,
        graph: Any,  # noqa: ANN401 - of an optional package
        *,
        weight: str | None = "weight",
        pos: str = "pos",
        labels: Sequence[Node] | None = None,
        field: RiskField | None = None,
        k: float = 0.0,
        no_fly: BaseGeometry | None = None,
    ) -> "GeometricGraph":
        """
        Convert an igraph graph, directed or not; of parallel edges the lightest counts.

        Parameters
        ----------
        graph
            An `igraph.Graph`; it is not changed.
        weight, pos
            As in `from_networkx`: the edges' attribute, and the vertices'.
        labels
            A node for each vertex, all different. If left out, the vertices' attribute ``name`` where igraph has one,
            else 0, 1, ….
        field, k, no_fly
            As in `from_networkx`, for Eq. 5.

        Returns
        -------
        graph
            A sparse graph.

        Raises
        ------
        GraphError
            As in `from_networkx`, and if labels or names do not fit.
        ProblemError
            If positions, field or k are malformed.

        Examples
        --------
        >>> import igraph
        >>> ring = igraph.Graph.Ring(3)
        >>> ring.vs["name"], ring.es["weight"] = ["a", "b", "c"], [2.0, 2.0, 2.0]
        >>> GeometricGraph.from_igraph(ring).weights_from(0).tolist()
        [0.0, 2.0, 2.0]
        """
        return cls._from_lists(read_igraph(graph, weight, pos), weight, pos, field, k, no_fly, labels)

    @classmethod
    def from_rustworkx(
        cls,
        graph: Any,  # noqa: ANN401 - of an optional package
        *,
        weight: str | None = "weight",
        pos: str = "pos",
        labels: Sequence[Node] | None = None,
        field: RiskField | None = None,
        k: float = 0.0,
        no_fly: BaseGeometry | None = None,
    ) -> "GeometricGraph":
        """
        Convert a rustworkx graph, directed or not; of parallel edges the lightest counts.

        Parameters
        ----------
        graph
            A `rustworkx.PyGraph` or `rustworkx.PyDiGraph`; it is not changed.
        weight
            The key of the weight in what an edge holds; an edge that holds no mapping holds its weight. None: as in
            `from_networkx`.
        pos
            The key of ``(x, y)`` in what a node holds.
        labels
            A node for each of ``graph.node_indices()``, all different, as in ``labels=graph.nodes()``; those indices
            if left out.
        field, k, no_fly
            As in `from_networkx`.

        Returns
        -------
        graph
            A sparse graph.

        Raises
        ------
        GraphError
            As in `from_networkx`, and if the labels do not fit.
        ProblemError
            If positions, field or k are malformed.

        Examples
        --------
        >>> import rustworkx
        >>> ring = rustworkx.generators.cycle_graph(weights=["a", "b", "c"])
        >>> for edge in ring.edge_indices():
        ...     ring.update_edge_by_index(edge, 2.0)
        >>> GeometricGraph.from_rustworkx(ring, labels=ring.nodes()).weights_from(0).tolist()
        [0.0, 2.0, 2.0]
        """
        return cls._from_lists(read_rustworkx(graph, weight, pos), weight, pos, field, k, no_fly, labels)

    @classmethod
    def _from_lists(
        cls,
        given: GraphLists,
        weight: str | None,
        pos: str,
        field: RiskField | None,
        k: float,
        no_fly: BaseGeometry | None,
        labels: Sequence[Node] | None = None,
    ) -> "GeometricGraph":
        """Weigh the edges that another library's graph holds."""
        names = _labels(given.labels if labels is None else labels, len(given.labels))
        spots = node_positions(names, given.spots, pos, needed=weight is None or no_fly is not None)
        positions = _positions(spots, len(names))
        kept = given.ends[:, 0] != given.ends[:, 1]
        tails, heads = given.ends[kept].T
        model = None
        if weight is None and positions is not None:
            model = CostModel(RiskField() if field is None else field, k, no_fly)
            weights = model.weights(positions[tails], positions[heads])
        else:
            held = compress(given.weights, kept.tolist())
            ends = zip(tails.tolist(), heads.tolist(), held, strict=True)
            weights = np.array([edge_weight(names[u], names[v], w, str(weight)) for u, v, w in ends], dtype=np.float64)
            if no_fly is not None and positions is not None:
                weights[NoFlyArea(no_fly).crosses(positions[tails], positions[heads])] = np.inf
        matrix = compressed(tails, heads, weights, len(names), mirrored=not given.directed)
        return cls(names, positions, directed=given.directed, model=model, weights=SparseWeights(matrix))

    @classmethod
    def from_matrix(
        cls, matrix: ArrayLike, *, labels: Sequence[Node] | None = None, positions: ArrayLike | None = None
    ) -> "GeometricGraph":
        """
        Convert a dense matrix of weights; entry ``[i, j]`` is the weight from ``i`` to ``j``.

        Parameters
        ----------
        matrix
            Shape ``(n, n)``, each at least 0. Infinity, or a masked weight, means no edge; **zero is a weight of
            zero** unless it is masked. The diagonal is ignored. A copy is taken.
        labels
            ``n`` different nodes; 0, 1, … if left out.
        positions
            Shape ``(n, 2)``, map units.

        Returns
        -------
        graph
            Directed unless the matrix is symmetric.

        Raises
        ------
        GraphError
            If the matrix is not square, holds a negative weight or a NaN, or labels or positions do not fit.
        ProblemError
            If the positions are no array of numbers.

        Examples
        --------
        >>> GeometricGraph.from_matrix([[0, 0], [np.inf, 0]], labels="ab").weights_from(0).tolist()
        [0.0, 0.0]
        """
        _refuse_other_kinds(matrix, "from_matrix")
        try:
            # the sum is a copy, and has 0.0 where a weight is -0.0
            weights = number_array("the weight matrix", matrix, masked=np.inf) + 0.0
        except ProblemError as error:
            raise GraphError(str(error)) from error
        if weights.ndim != 2 or weights.shape[0] != weights.shape[1]:  # noqa: PLR2004 - a matrix
            msg = f"the weight matrix has shape {weights.shape}; give a square one"
            raise GraphError(msg)
        np.fill_diagonal(weights, 0.0)
        tails, heads = np.nonzero(~(weights >= 0.0))
        names = _labels(labels, len(weights))
        if len(tails):
            reject_weight(names[tails[0]], names[heads[0]], float(weights[tails[0], heads[0]]))
        where = _positions(positions, len(weights))
        return cls(names, where, directed=not np.array_equal(weights, weights.T), weights=DenseWeights(weights))

    @classmethod
    def from_sparse(
        cls,
        matrix: Any,  # noqa: ANN401 - scipy has no common base of its sparse arrays and matrices
        *,
        directed: bool = True,
        labels: Sequence[Node] | None = None,
        positions: ArrayLike | None = None,
    ) -> "GeometricGraph":
        """
        Convert a scipy sparse matrix of weights; entry ``[i, j]`` is the weight from ``i`` to ``j``.

        Parameters
        ----------
        matrix
            Shape ``(n, n)``. **Stored entries are edges, stored zeros too**; all others, and masked ones, are no edges.
            Entries in one place are parallel edges, of which the lightest counts (scipy adds them up: call its
            ``sum_duplicates`` before, if you mean that). The diagonal is ignored.
        directed
            False: each stored entry is an edge in both directions, the lightest where both are stored.
        labels, positions
            As in `from_matrix`.

        Returns
        -------
        graph
            A sparse graph.

        Raises
        ------
        GraphError
            If the matrix is not square, holds a negative weight or a NaN, or labels or positions do not fit.

        Examples
        --------
        >>> chain = scipy.sparse.csr_array(([0.0, 2.0], ([0, 1], [1, 2])), shape=(3, 3))
        >>> GeometricGraph.from_sparse(chain).weights_from(0).tolist()
        [0.0, 0.0, inf]
        """
        truth_value("directed", directed, GraphError)
        _refuse_other_kinds(matrix, "from_sparse")
        try:
            tails, heads, data, shape = matrix_entries(_without_masks(matrix))
            weights = number_array("stored weights", data)
        except (TypeError, ValueError) as error:
            msg = f"the sparse weight matrix is {type(matrix).__name__} ({error}); give a square scipy sparse matrix"
            raise GraphError(msg) from error
        if len(shape) != 2 or shape[0] != shape[1]:  # noqa: PLR2004 - a matrix
            msg = f"the sparse weight matrix has shape {shape}; give a square one"
            raise GraphError(msg)
        names = _labels(labels, shape[0])
        for bad in np.nonzero(~(weights >= 0.0) & (tails != heads))[0][:1]:
            reject_weight(names[tails[bad]], names[heads[bad]], float(weights[bad]))
        kept = tails != heads
        stored = compressed(tails[kept], heads[kept], weights[kept], len(names), mirrored=not directed)
        return cls(names, _positions(positions, len(names)), directed=directed, weights=SparseWeights(stored))

    #: `from_sparse`, named after its library as the other constructors are.
    from_scipy = from_sparse

    def is_directed(self) -> bool:
        """Return `directed`, for networkx."""
        return self.directed

    def is_multigraph(self) -> bool:
        """Return False, for networkx."""
        return False

    @property
    def n_nodes(self) -> int:
        """Number of nodes."""
        return len(self.labels)

    @property
    def is_implicit(self) -> bool:
        """Whether weights are computed on request (see `with_weights_held`)."""
        return isinstance(self.weights, ImplicitWeights)

    @property
    def is_sparse(self) -> bool:
        """Whether the weights are held as a sparse matrix."""
        return isinstance(self.weights, SparseWeights)

    @property
    def lattice_shape(self) -> tuple[int, int]:
        """Points of the lattice along x and along y; ``(0, 0)`` without one."""
        return self.lattice.shape if self.lattice else (0, 0)

    @property
    def n_edges(self) -> int:
        """Number of edges: ordered pairs in a directed graph, else unordered ones; weighs an implicit graph."""
        return self.weights.n_edges if self.directed else self.weights.n_edges // 2

    @property
    def n_pairs(self) -> int:
        """
        Number of pairs that are weighed by Eq. 5; 0 where the weights were given.

        Of a complete graph all pairs count, also those that a no-fly area takes away or that are added up along a line
        of the lattice; of an 8-connected graph, the edges.
        """
        if self.model is None:
            return 0
        return self.n_edges if self.is_sparse else self.n_nodes * (self.n_nodes - 1) // 2

    @property
    def greatest_weight(self) -> float:
        """The greatest weight of an edge; 0 where the weights were not given, but are of Eq. 5."""
        if self.model is not None:
            return 0.0
        weights = self.weights.rows.data if isinstance(self.weights, SparseWeights) else self.weights.matrix()
        return float(weights[np.isfinite(weights)].max(initial=0.0))

    @property
    def has_proper_field(self) -> bool:
        """Whether no weight can be below 0: weights were given and checked, or no threat peaks above 1."""
        return self.model is None or self.model.field.is_proper

    @property
    def has_negative_weights(self) -> bool:
        """Whether a weight is below 0, against the assumption of Theorem 1; only with an improper risk field."""
        if self.has_proper_field:
            return False
        weights = self.weights.rows.data if isinstance(self.weights, SparseWeights) else self.weights.matrix()
        return bool((weights < 0.0).any())

    def with_weights_held(self) -> "GeometricGraph":
        """
        Return the graph with all its weights held in memory, ``8 n ** 2`` bytes; this graph if it holds them already.

        Examples
        --------
        >>> graph = GeometricGraph.complete(Lattice(20, bounds=(0, 0, 1, 1)))
        >>> graph.is_implicit, graph.with_weights_held().is_implicit
        (True, False)
        """
        return replace(self, weights=self.weights.held()) if isinstance(self.weights, ImplicitWeights) else self

    def weighed(self) -> "GeometricGraph":
        """Call `with_weights_held`; a deprecated alias."""
        warnings.warn("weighed() is now with_weights_held()", DeprecationWarning, stacklevel=2)
        return self.with_weights_held()

    def under(self, model: CostModel) -> "GeometricGraph":
        """
        Return the complete graph of the same nodes under another cost model, with weights computed on request.

        Raises
        ------
        GraphError
            If the nodes have no positions.
        """
        instance("model", model, CostModel, "a CostModel, as problem.model")
        if self.positions is None:
            msg = "this graph has no positions, so that no segment can be weighed; build it with positions"
            raise GraphError(msg)
        weights = ImplicitWeights(model, self.positions, self.lattice_shape)
        return GeometricGraph(self.labels, self.positions, model=model, lattice=self.lattice, weights=weights)

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore a pickled graph; pickling forgets that arrays are read-only."""
        if state["positions"] is not None:
            state["positions"].flags.writeable = False
        self.__dict__.update(state)

    @cached_property
    def _indices(self) -> Mapping[Node, int]:
        return {label: i for i, label in enumerate(self.labels)}

    def index_of(self, node: Node) -> int:
        """
        Return the index of a node.

        Raises
        ------
        NodeNotFoundError
            If the graph has no such node.
        """
        # consecutive numbers need no table
        if isinstance(self.labels, range) and isinstance(node, int) and node in self.labels:
            return self.labels.index(node)
        try:
            return self._indices[node]
        except (KeyError, TypeError):
            first = [*map(shown, self.labels[:3]), *(["…"] if self.n_nodes > 3 else [])]  # noqa: PLR2004 - a few
            count = f"{self.n_nodes} node{'s' * (self.n_nodes != 1)}"
            msg = f"node {shown(node)} is not in the graph; it has {count}: {', '.join(first)}"
            raise NodeNotFoundError(msg) from None

    def node_at(self, place: Point) -> Node | None:
        """
        Return the first node whose position is exactly `place`, or None where there is none.

        Examples
        --------
        >>> graph = GeometricGraph.complete([(0, 0), (3, 0)])
        >>> graph.node_at((3, 0)), graph.node_at((1, 0))
        (1, None)
        """
        if self.positions is None:
            return None
        (found,) = np.nonzero((self.positions == point("place", place)).all(axis=1))
        return self.labels[int(found[0])] if len(found) else None

    def weight(self, tail: int, head: int) -> float:
        """
        Return the weight of the edge between two nodes, given by their indices; infinity where there is none.

        Raises
        ------
        NodeIndexError
            If there is no such index.

        Examples
        --------
        >>> GeometricGraph.complete([(0, 0), (3, 0), (3, 4)]).weight(0, 2)
        5.0
        """
        return self.weights.entry(self._checked(tail), self._checked(head))

    def weights_from(self, index: int) -> FloatArray:
        """
        Return the weights of the edges from one node to all, shape ``(n,)``; infinity where there is no edge.

        Parameters
        ----------
        index
            The node's index (see `index_of`).

        Returns
        -------
        weights
            A view that must not be written to, or a new array.

        Raises
        ------
        NodeIndexError
            If there is no such index; negative ones do not count from the end.
        """
        return self.weights.row(self._checked(index))

    def weights_to(self, index: int) -> FloatArray:
        """Return the weights of the edges from all nodes to one, shape ``(n,)``: the column of Eq. 9's ``p_r``."""
        return self.weights.column(self._checked(index)) if self.directed else self.weights_from(index)

    def weight_matrix(self) -> FloatArray:
        """
        Return all weights as a dense matrix; an implicit graph computes them in each call (see `with_weights_held`).

        Returns
        -------
        matrix
            Shape ``(n, n)``, read-only: ``[i, j]`` weighs the edge from ``i`` to ``j``, infinity where there is
            none, 0 on the diagonal.
        """
        return self.weights.matrix()

    def weight_matrix_to(self) -> FloatArray:
        """Return the dense matrix whose row ``r`` holds the weights **to** ``r``, shape ``(n, n)``."""
        return self.weights.matrix_to() if self.directed else self.weights.matrix()

    def to_csgraph(self) -> "scipy.sparse.csr_array":
        """
        Return the weights for `scipy.sparse.csgraph`: a sparse matrix whose stored zeros are edges.

        `scipy.sparse.csgraph` reads a zero of a **dense** matrix as "no edge"; stored zeros it keeps.

        Examples
        --------
        >>> GeometricGraph.from_matrix([[0, 0], [5, 0]]).to_csgraph().nnz
        2
        """
        return self.weights.csgraph()

    def to_networkx(self) -> "nx.Graph[Any]":
        """
        Return a networkx graph (a `DiGraph` if directed) with edge attribute ``weight`` and node attribute ``pos``.

        Examples
        --------
        >>> GeometricGraph.from_matrix([[0, 3], [3, 0]], labels="ab").to_networkx().edges["a", "b"]["weight"]
        3.0
        """
        import networkx as nx  # noqa: PLC0415 - slow to import, and rarely needed

        graph: nx.Graph[Any] = nx.DiGraph() if self.directed else nx.Graph()
        graph.add_nodes_from(self.labels)
        if self.positions is not None:
            spots = {label: (x, y) for label, (x, y) in zip(self.labels, self.positions.tolist(), strict=True)}
            nx.set_node_attributes(graph, spots, "pos")
        entries = self.to_csgraph().tocoo()
        labels = self.labels
        graph.add_weighted_edges_from(
            (labels[i], labels[j], weight)
            for i, j, weight in zip(*(axis.tolist() for axis in entries.coords), entries.data.tolist(), strict=True)
            if self.directed or i < j
        )
        return graph

    def _checked(self, index: int) -> int:
        try:
            at = operator.index(index)
        except TypeError:
            at = -1
        if not 0 <= at < self.n_nodes:
            msg = (
                f"node index {shown(index)} is not in 0 to {self.n_nodes - 1}; graph.index_of(node) gives the index of "
                "a node"
            )
            raise NodeIndexError(msg)
        return at


def _with_extra(base: FloatArray, lattice: Lattice | None, extra: Sequence[Point]) -> FloatArray:
    """Append the extra points; one on a lattice point (within 1e-9 of a step) replaces its coordinates."""
    positions = base.copy()
    added: list[Point] = []
    snapped: dict[int, Point] = {}
    for entry in items("extra", extra, "a list of points (x, y)"):
        spot = point("an extra point", entry)
        at = lattice.index_of(spot) if lattice else None
        # of two points on one lattice point, the second becomes a node of its own
        if at is not None and snapped.setdefault(at, spot) == spot:
            positions[at] = spot
        elif spot not in added:
            added.append(spot)
    if added:
        positions = np.vstack([positions, np.array(added)])
    positions.flags.writeable = False
    return positions


def _refuse_other_kinds(matrix: object, constructor: str) -> None:
    """Name the constructor for the graph of another library, or a sparse matrix, that was given for a matrix."""
    wanted = graph_wanted(matrix)
    if wanted.startswith("GeometricGraph.from_") and not wanted.startswith(f"GeometricGraph.{constructor}("):
        if constructor == "from_sparse" and wanted.startswith("GeometricGraph.from_matrix"):
            return
        msg = f"the weight matrix is {kind_of(matrix)}; give {wanted}"
        raise GraphError(msg)


def _without_masks(matrix: Any) -> Any:  # noqa: ANN401 - sparse, or anything that scipy makes sparse
    """Return a matrix for scipy, which ignores masks: masked weights are no edges."""
    if isinstance(matrix, np.ma.MaskedArray):
        # in a dense matrix, scipy reads a zero as no edge
        return np.ma.filled(matrix, 0)
    if isinstance(getattr(matrix, "data", None), np.ma.MaskedArray):
        stored, matrix = number_array("stored weights", matrix.data, masked=np.inf), matrix.copy()
        matrix.data = stored
    return matrix


def _labels(labels: Sequence[Node] | None, n_nodes: int) -> Sequence[Node]:
    if not n_nodes:
        msg = "the graph has no nodes; give one with some"
        raise GraphError(msg)
    if labels is None:
        return range(n_nodes)
    names = items("labels", labels, "a list of nodes", GraphError)
    try:
        hash(names)
    except TypeError as error:
        msg = f"a label cannot be a node: {error}; give hashable labels"
        raise GraphError(msg) from error
    if any(name is None for name in names):
        msg = "a label is None, which cannot be a node, as in networkx; give another label"
        raise GraphError(msg)
    if len(names) != n_nodes or len(set(names)) != n_nodes:
        msg = f"{len(names)} labels, {len(set(names))} of them different, for {n_nodes} nodes; give one for each node"
        raise GraphError(msg)
    return names


def _positions(positions: ArrayLike | None, n_nodes: int) -> FloatArray | None:
    if positions is None:
        return None
    where = point_array("positions", positions).copy()
    if where.shape != (n_nodes, 2):
        msg = f"positions have shape {where.shape} for {n_nodes} nodes; give shape ({n_nodes}, 2)"
        raise GraphError(msg)
    where.flags.writeable = False
    return where
