"""
Functions of the networkx backend, under networkx's own names: for a `GeometricGraph`, or with ``backend="cgla"``.

A `GeometricGraph` answers as ``graph.to_networkx()`` would: its edges have one attribute, ``weight``; under any other
name each edge weighs 1. A search settles node after node (the paper's Delta sets, Eqs 10-12) and reads one row of
weights at a time, so that an implicit graph is never held in memory. Sparse graphs go to scipy, single paths of large
complete lattice graphs to `cgla_graph.restricted`.
"""

import inspect
import itertools
from collections.abc import Collection, Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import networkx as nx
import numpy as np
from scipy import sparse
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.errors import NodeNotFoundError
from cgla_graph.model import graph_kernels
from cgla_graph.model.adjacency import Node
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.weights import SparseWeights, reject_overflow
from cgla_graph.networkx_backend.conversion import (
    ConvertedGraph,
    convert_from_nx,  # noqa: F401 - networkx looks for it here
    convert_to_nx,  # noqa: F401 - the same
    forget_changed,
)
from cgla_graph.restricted.restricted import can_restrict, restricted_optimum

#: Nodes from which on a search for one path of a complete lattice graph is restricted to the nodes that can be on it.
LARGE = 1000
NOT_FOUND = "Node {} not found in graph"


Graph: TypeAlias = GeometricGraph | ConvertedGraph
Length: TypeAlias = float
Lengths: TypeAlias = dict[Node, Length]
Path: TypeAlias = list[Node]
Paths: TypeAlias = dict[Node, Path]


@cache
def _weight_place(name: str) -> tuple[int, object]:
    """Return the position and the default of a function's argument ``weight``; -1 and None if it has none."""
    parameters = inspect.signature(globals()[name]).parameters
    if "weight" not in parameters:
        return -1, None
    return [*parameters].index("weight"), parameters["weight"].default


def _weight(name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> object:
    """Return the weight that a call asks for."""
    place, default = _weight_place(name)
    return kwargs.get("weight", args[place] if 0 <= place < len(args) else default)


def can_run(name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> bool | str:
    """
    Return True if the function can answer this call, else the reason.

    networkx asks before it looks for a converted graph, so that one of other weights is forgotten here.
    """
    weight = _weight(name, args, kwargs)
    if not isinstance(weight, str | None):
        return "cgla takes weights by the name of their attribute"
    graph = args[0] if args else kwargs["G"]
    if isinstance(graph, GeometricGraph):
        if graph.model is not None and not graph.model.field.is_proper:
            return "weights of an improper risk field may be negative"
    else:
        forget_changed(graph, weight)
    return True


def should_run(name: str, args: Sequence[Any], kwargs: Mapping[str, Any]) -> bool | str:
    """Return True if converting a networkx graph is likely to save time, else the reason."""
    return _weight(name, args, kwargs) is not None or "networkx counts edges without a conversion"


@dataclass(frozen=True, eq=False)
class _Tree:
    """The shortest paths from (or towards) the roots of one search."""

    graph: GeometricGraph
    #: Infinity where a node is not reached, or lies beyond the cutoff.
    values: FloatArray
    #: The neighbour on the path to the root, below 0 at a root.
    before: IntArray
    towards: bool
    whole: bool

    def index(self, target: Hashable, complaint: str) -> int:
        """Return the index of a node, or raise `networkx.NetworkXNoPath` with the complaint."""
        at = _find(self.graph, target)
        if at is None or not np.isfinite(self.values[at]):
            raise nx.NetworkXNoPath(complaint)
        return at

    def length(self, index: int) -> Length:
        value = float(self.values[index])
        return int(value) if self.whole else value

    def path(self, index: int) -> Path:
        way = [index]
        while (following := int(self.before[way[-1]])) >= 0:
            way.append(following)
        return [self.graph.labels[i] for i in (way if self.towards else reversed(way))]

    def lengths(self) -> Lengths:
        order = self._reached()
        values = self.values[order]
        lengths: list[Length] = (values.astype(np.int64) if self.whole else values).tolist()
        return {self.graph.labels[i]: length for i, length in zip(order.tolist(), lengths, strict=True)}

    def paths(self) -> Paths:
        """Return the path of each reached node; it extends the path of the neighbour."""
        labels, before = self.graph.labels, self.before.tolist()
        found: dict[int, Path] = {}
        for index in self._reached().tolist():
            new: list[int] = []
            at = index
            while at >= 0 and at not in found:
                new.append(at)
                at = before[at]
            path = found.get(at, [])
            for step in reversed(new):
                path = [labels[step], *path] if self.towards else [*path, labels[step]]
                found[step] = path
        return {labels[i]: path for i, path in found.items()}

    def _reached(self) -> IntArray:
        """Return the reached nodes, the nearest first."""
        return np.argsort(self.values, kind="stable")[: int(np.isfinite(self.values).sum())]


def _plain(G: Graph) -> GeometricGraph:
    return G.graph if isinstance(G, ConvertedGraph) else G


def _find(graph: GeometricGraph, node: Hashable) -> int | None:
    try:
        return graph.index_of(node)
    except NodeNotFoundError:
        return None


def _index(graph: GeometricGraph, node: Hashable, complaint: str) -> int:
    at = _find(graph, node)
    if at is None:
        raise nx.NodeNotFound(complaint.format(node))
    return at


def _search(
    G: Graph,
    sources: Collection[Hashable],
    weight: str | None,
    *,
    goal: Hashable = None,
    cutoff: float | None = None,
    towards: bool = False,
    complaint: str = NOT_FOUND,
) -> _Tree:
    """Find the shortest paths from the sources, or `towards` one; with a `goal`, only its path need be right."""
    graph = _plain(G)
    roots = np.array([_index(graph, source, complaint) for source in sources], dtype=np.int64)
    count_edges = weight is None or weight != (G.weight if isinstance(G, ConvertedGraph) else "weight")
    limit = np.inf if cutoff is None else float(cutoff)
    end = None if goal is None else _find(graph, goal)
    if isinstance(graph.weights, SparseWeights):
        rows = graph.weights.rows
        search: Any = csgraph.dijkstra
        values, before, _ = search(
            sparse.csr_array(rows.T) if towards and graph.directed else rows,
            indices=np.unique(roots),
            return_predecessors=True,
            unweighted=count_edges,
            limit=max(limit, 0.0),
            min_only=True,
        )
    else:
        found = None if end is None or count_edges else _restricted(graph, roots, end)
        values, before = found or _settle(graph, roots, end, limit, towards=towards, count_edges=count_edges)
    if not count_edges and limit == np.inf and (end is None or not np.isfinite(values[end])):
        reject_overflow(values, graph.weights_to if towards else graph.weights_from)
    beyond = values > limit
    beyond[roots] = False
    values[beyond] = np.inf
    return _Tree(graph, values, before, towards, count_edges or (isinstance(G, ConvertedGraph) and G.whole))


def _restricted(graph: GeometricGraph, roots: IntArray, goal: int) -> tuple[FloatArray, IntArray] | None:
    """Find one path of a large complete lattice graph from few of its weights; None if that is not possible."""
    if graph.n_nodes < LARGE or len(roots) > 1 or goal in roots or not can_restrict(graph):
        return None
    found = restricted_optimum(GraphProblem(graph, graph.labels[roots[0]], graph.labels[goal]))
    if found is None:
        return None
    values = np.full(graph.n_nodes, np.inf)
    before = np.full(graph.n_nodes, -1, dtype=np.int64)
    before[found.nodes[1:]] = found.nodes[:-1]
    values[roots] = 0.0
    if len(found.nodes):
        values[goal] = _cost(graph, found.nodes.tolist())
    return values, before


def _cost(graph: GeometricGraph, way: list[int]) -> float:
    """Add up the weights along a path, given by indices."""
    return sum(graph.weight(u, v) for u, v in itertools.pairwise(way))


def _settle(
    graph: GeometricGraph, roots: IntArray, goal: int | None, limit: float, *, towards: bool, count_edges: bool
) -> tuple[FloatArray, IntArray]:
    """
    Settle node after node, as `cgla_graph.cost_to_go.cost_matrix` does, but from several roots and up to a limit.

    By Eq. 5 no segment costs less than its length, so that the straight line to a single goal is a lower bound for A*;
    each value then includes the lower bound.
    """
    line = graph.weights_to if towards else graph.weights_from
    spots = None if goal is None or graph.model is None or count_edges else graph.positions
    ahead = np.zeros(graph.n_nodes) if spots is None else np.hypot(*(spots - spots[goal]).T)
    values = np.full(graph.n_nodes, np.inf)
    values[roots] = ahead[roots]
    before = np.full(graph.n_nodes, -1, dtype=np.int64)
    settled = np.zeros(graph.n_nodes, dtype=np.bool_)
    node = int(roots[np.argmin(ahead[roots])])
    # a little beyond the limit, as reduced costs are rounded
    while (
        node >= 0 and values[node] <= limit * (1.0 + 1e-9) and not (goal is not None and values[node] == values[goal])
    ):
        row = line(node)
        if count_edges:
            row = np.where(np.isfinite(row), 1.0, np.inf)
        elif spots is not None:
            row = np.maximum(row + (ahead - ahead[node]), 0.0)
        node = graph_kernels.settle(row, node, values, before, settled)
    if goal is not None and spots is not None and np.isfinite(values[goal]):
        # add the weights again: potentials added and subtracted leave rounding
        way = [goal]
        while before[way[-1]] >= 0:
            way.append(int(before[way[-1]]))
        values[goal] = _cost(graph, way[::-1])
    return values, before


def multi_source_dijkstra(
    G: Graph,
    sources: Collection[Hashable],
    target: Hashable = None,
    cutoff: float | None = None,
    weight: str | None = "weight",
) -> tuple[Lengths, Paths] | tuple[Length, Path]:
    """Return lengths and paths from the nearest source, to all nodes or to the target."""
    _reject_no_sources(sources)
    tree = _search(G, sources, weight, goal=target, cutoff=cutoff)
    if target is None:
        return tree.lengths(), tree.paths()
    at = tree.index(target, f"No path to {target}.")
    return tree.length(at), tree.path(at)


def multi_source_dijkstra_path(
    G: Graph, sources: Collection[Hashable], cutoff: float | None = None, weight: str | None = "weight"
) -> Paths:
    """Return a path to each node from the nearest source."""
    _reject_no_sources(sources)
    return _search(G, sources, weight, cutoff=cutoff).paths()


def multi_source_dijkstra_path_length(
    G: Graph, sources: Collection[Hashable], cutoff: float | None = None, weight: str | None = "weight"
) -> Lengths:
    """Return the length to each node from the nearest source."""
    _reject_no_sources(sources)
    return _search(G, sources, weight, cutoff=cutoff).lengths()


def _reject_no_sources(sources: Collection[Hashable]) -> None:
    if not sources:
        msg = "sources must not be empty"
        raise ValueError(msg)


def single_source_dijkstra(
    G: Graph,
    source: Hashable,
    target: Hashable = None,
    cutoff: float | None = None,
    weight: str | None = "weight",
) -> tuple[Lengths, Paths] | tuple[Length, Path]:
    """Return lengths and paths from the source, to all nodes or to the target."""
    return multi_source_dijkstra(G, [source], target, cutoff, weight)


def single_source_dijkstra_path(
    G: Graph, source: Hashable, cutoff: float | None = None, weight: str | None = "weight"
) -> Paths:
    """Return a path from the source to each node."""
    return multi_source_dijkstra_path(G, [source], cutoff, weight)


def single_source_dijkstra_path_length(
    G: Graph, source: Hashable, cutoff: float | None = None, weight: str | None = "weight"
) -> Lengths:
    """Return the length from the source to each node."""
    return multi_source_dijkstra_path_length(G, [source], cutoff, weight)


def dijkstra_path(G: Graph, source: Hashable, target: Hashable, weight: str | None = "weight") -> Path:
    """Return a shortest path."""
    tree = _search(G, [source], weight, goal=target)
    return tree.path(tree.index(target, f"No path to {target}."))


def dijkstra_path_length(G: Graph, source: Hashable, target: Hashable, weight: str | None = "weight") -> Length:
    """Return the length of a shortest path."""
    tree = _search(G, [source], weight, goal=target)
    return tree.length(tree.index(target, f"Node {target} not reachable from {source}"))


def bidirectional_dijkstra(
    G: Graph, source: Hashable, target: Hashable, weight: str | None = "weight"
) -> tuple[Length, Path]:
    """Return the length of a shortest path, and the path; the search runs in one direction."""
    complaint = "Source {} is not in G"
    _index(_plain(G), source, complaint)
    _index(_plain(G), target, "Target {} is not in G")
    tree = _search(G, [source], weight, goal=target, complaint=complaint)
    at = tree.index(target, f"No path between {source} and {target}.")
    return tree.length(at), tree.path(at)


def all_pairs_dijkstra(
    G: Graph, cutoff: float | None = None, weight: str | None = "weight"
) -> Iterator[tuple[Node, tuple[Lengths, Paths]]]:
    """Yield each node with the lengths and paths from it."""
    for node in _plain(G).labels:
        tree = _search(G, [node], weight, cutoff=cutoff)
        yield node, (tree.lengths(), tree.paths())


def all_pairs_dijkstra_path(
    G: Graph, cutoff: float | None = None, weight: str | None = "weight"
) -> Iterator[tuple[Node, Paths]]:
    """Yield each node with the paths from it."""
    for node in _plain(G).labels:
        yield node, _search(G, [node], weight, cutoff=cutoff).paths()


def all_pairs_dijkstra_path_length(
    G: Graph, cutoff: float | None = None, weight: str | None = "weight"
) -> Iterator[tuple[Node, Lengths]]:
    """Yield each node with the lengths from it."""
    for node in _plain(G).labels:
        yield node, _search(G, [node], weight, cutoff=cutoff).lengths()


def bidirectional_shortest_path(G: Graph, source: Hashable, target: Hashable) -> Path:
    """Return a path of fewest edges; the search runs in one direction."""
    return bidirectional_dijkstra(G, source, target, weight=None)[1]


def has_path(G: Graph, source: Hashable, target: Hashable) -> bool:
    """Return whether there is a path."""
    try:
        bidirectional_shortest_path(G, source, target)
    except nx.NetworkXNoPath:
        return False
    return True


def single_source_shortest_path(G: Graph, source: Hashable, cutoff: float | None = None) -> Paths:
    """Return a path of fewest edges from the source to each node."""
    return _search(G, [source], None, cutoff=_rounded(cutoff), complaint="Source {} not in G").paths()


def single_source_shortest_path_length(G: Graph, source: Hashable, cutoff: float | None = None) -> Lengths:
    """Return the number of edges from the source to each node."""
    return _search(G, [source], None, cutoff=_rounded(cutoff), complaint="Source {} is not in G").lengths()


def single_target_shortest_path(G: Graph, target: Hashable, cutoff: float | None = None) -> Paths:
    """Return a path of fewest edges from each node to the target."""
    return _search(G, [target], None, cutoff=_rounded(cutoff), towards=True, complaint="Target {} not in G").paths()


def single_target_shortest_path_length(G: Graph, target: Hashable, cutoff: float | None = None) -> Lengths:
    """Return the number of edges from each node to the target."""
    complaint = "Target {} is not in G"
    return _search(G, [target], None, cutoff=_rounded(cutoff), towards=True, complaint=complaint).lengths()


def _rounded(cutoff: float | None) -> float | None:
    """Round a cutoff up, as networkx counts the level that it falls into."""
    return None if cutoff is None else float(np.ceil(cutoff))


def all_pairs_shortest_path(G: Graph, cutoff: float | None = None) -> Iterator[tuple[Node, Paths]]:
    """Yield each node with the paths of fewest edges from it."""
    return all_pairs_dijkstra_path(G, _rounded(cutoff), None)


def all_pairs_shortest_path_length(G: Graph, cutoff: float | None = None) -> Iterator[tuple[Node, Lengths]]:
    """Yield each node with the numbers of edges from it."""
    return all_pairs_dijkstra_path_length(G, _rounded(cutoff), None)


def shortest_path(
    G: Graph,
    source: Hashable = None,
    target: Hashable = None,
    weight: str | None = None,
    method: str = "dijkstra",
) -> Path | Paths | Iterator[tuple[Node, Paths]]:
    """Return a shortest path, or those from the source, to the target or of all pairs."""
    _reject_method(method)
    if source is not None and target is not None:
        return bidirectional_dijkstra(G, source, target, weight)[1]
    if source is None and target is None:
        return all_pairs_dijkstra_path(G, weight=weight)
    complaint = "Source {} not in G" if weight is None else NOT_FOUND
    root = target if source is None else source
    return _search(G, [root], weight, towards=source is None, complaint=complaint).paths()


def shortest_path_length(
    G: Graph,
    source: Hashable = None,
    target: Hashable = None,
    weight: str | None = None,
    method: str = "dijkstra",
) -> Length | Lengths | Iterator[tuple[Node, Lengths]]:
    """Return the length of a shortest path, or of those from the source, to the target or of all pairs."""
    _reject_method(method)
    if source is not None and target is not None:
        if weight is None:
            return bidirectional_dijkstra(G, source, target, weight)[0]
        return dijkstra_path_length(G, source, target, weight)
    if source is None and target is None:
        return all_pairs_dijkstra_path_length(G, weight=weight)
    complaint = "Source {} is not in G" if weight is None else NOT_FOUND
    root = target if source is None else source
    return _search(G, [root], weight, towards=source is None, complaint=complaint).lengths()


def _reject_method(method: str) -> None:
    """Refuse unknown methods; with weights of at least 0, Bellman-Ford and Dijkstra give the same lengths."""
    if method not in {"dijkstra", "bellman-ford"}:
        msg = f"method not supported: {method}"
        raise ValueError(msg)
