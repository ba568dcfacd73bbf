"""Conversion between networkx graphs and this backend's, and the check that a cached one is still the same graph."""

import operator
from collections.abc import Mapping
from dataclasses import dataclass
from itertools import chain, compress
from typing import Any, ClassVar

import networkx as nx
import numpy as np

from cgla_graph.errors import GraphError
from cgla_graph.model.adjacency import compressed
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import SparseWeights

#: Most edges of a graph that is converted without being asked: a networkx graph takes about a kilobyte an edge.
MAX_EDGES = 4_000_000
#: Sums of whole numbers up to here are exact in floating point.
EXACT_SUMS = 2**53
_VALUES = operator.methodcaller("values")


@dataclass(frozen=True, eq=False)
class _State:
    """
    What a conversion reads of a networkx graph, in the order of its adjacency.

    Attributes
    ----------
    objects
        The nodes, the neighbours of each, and the dictionaries of the edges.
    counts
        How many neighbours each node has, and in a multigraph how many edges lead to each.
    first
        For each dictionary, whether it comes for the first time: an undirected edge has one, which comes twice.
    weights
        The weight in each dictionary, None where it has none.
    """

    objects: list[object]
    counts: list[int]
    first: list[bool]
    weights: list[object]

    @classmethod
    def of(cls, graph: "nx.Graph[Any]", weight: str | None) -> "_State":
        """Read the state of a graph."""
        objects, counts, held = _structure(graph)
        seen: set[int] = set()
        first = [not (id(data) in seen or seen.add(id(data))) for data in held]  # type: ignore[func-returns-value]
        return cls(objects, counts, first, _weights(held, first, weight))

    def is_of(self, graph: "nx.Graph[Any]", weight: str | None) -> bool:
        """Return whether the graph still holds the same: a number does not change, but is replaced by another."""
        objects, counts, held = _structure(graph)
        if counts != self.counts or objects != self.objects:
            return False
        return all(map(operator.is_, _weights(held, self.first, weight), self.weights))


def _structure(graph: "nx.Graph[Any]") -> tuple[list[object], list[int], list[Any]]:
    """Return nodes, neighbours and dictionaries in one list, the numbers of them, and the dictionaries alone."""
    rows = [row for _, row in graph.adjacency()]
    counts = [*map(len, rows)]
    held: list[Any] = [*chain.from_iterable(map(_VALUES, rows))]
    keyed = held if graph.is_multigraph() else []
    if graph.is_multigraph():
        counts += map(len, keyed)
        held = [*chain.from_iterable(map(_VALUES, keyed))]
    return [*graph, *chain.from_iterable(rows), *keyed, *held], counts, held


def _weights(held: list[Any], first: list[bool], weight: str | None) -> list[object]:
    """Return the weight in each dictionary; where one has none, None."""
    if weight is None:
        return []
    try:
        return [*map(operator.itemgetter(weight), compress(held, first))]
    except KeyError:
        return [data.get(weight) for data in compress(held, first)]


@dataclass(frozen=True, eq=False)
class ConvertedGraph:
    """
    A networkx graph converted for this backend; networkx caches it with the original.

    Attributes
    ----------
    graph
        The same nodes and weights.
    weight
        The edge attribute that the weights were read from; None: each edge weighs 1.
    whole
        Whether all weights are whole numbers, and so all lengths.
    state
        What the graph held when it was converted (see `forget_changed`); None where that is not known.
    """

    graph: GeometricGraph
    weight: str | None
    whole: bool
    state: "_State | None" = None

    __networkx_backend__: ClassVar[str] = "cgla"

    def __getstate__(self) -> dict[str, Any]:
        """Leave out the state: copies of a graph hold other objects."""
        return {**self.__dict__, "state": None}


def convert_from_nx(
    graph: "nx.Graph[Any]", *, edge_attrs: Mapping[str, float] | None = None, **_rest: object
) -> ConvertedGraph:
    """
    Convert a networkx graph, with one edge attribute or none, for the functions below.

    Raises
    ------
    NotImplementedError
        If a weight is negative, infinite, or not an int or a float; networkx then runs its own code.
    """
    weight, default = next(iter((edge_attrs or {}).items()), (None, 1))
    labels = list(graph.nodes)
    index = {label: i for i, label in enumerate(labels)}
    edges = [(u, v, 1) for u, v in graph.edges()] if weight is None else list(graph.edges(data=weight, default=default))
    kinds = {type(value) for _, _, value in edges}
    if not all(issubclass(kind, int | float | np.integer) for kind in kinds):
        msg = f"weights of {', '.join(sorted(kind.__name__ for kind in kinds))}; cgla takes int and float"
        raise NotImplementedError(msg)
    try:
        weights = np.array([value for _, _, value in edges], dtype=np.float64)
    except OverflowError as error:
        msg = f"a weight is too large for a float ({error})"
        raise NotImplementedError(msg) from error
    with np.errstate(over="ignore"):
        total = weights.sum()
    if not (weights >= 0.0).all() or not np.isfinite(total):
        msg = "a weight, or the sum of all, is negative, infinite or NaN; cgla takes finite weights of at least 0"
        raise NotImplementedError(msg)
    whole = not any(issubclass(kind, float) for kind in kinds)
    if total >= EXACT_SUMS and any(not issubclass(kind, float) for kind in kinds):
        msg = f"whole weights add up to {total}, beyond {EXACT_SUMS}, where floats are no longer exact"
        raise NotImplementedError(msg)
    tails = np.array([index[u] for u, _, _ in edges], dtype=np.int64)
    heads = np.array([index[v] for _, v, _ in edges], dtype=np.int64)
    kept = tails != heads
    rows = compressed(tails[kept], heads[kept], weights[kept], len(labels), mirrored=not graph.is_directed())
    converted = GeometricGraph(labels, directed=graph.is_directed(), weights=SparseWeights(rows))
    # (without a cache, each call converts)
    cached = getattr(graph, "__networkx_cache__", None) is not None
    return ConvertedGraph(converted, weight, whole, _State.of(graph, weight) if cached else None)


def convert_to_nx(result: object, **_rest: object) -> object:
    """
    Convert a graph for networkx's own code; any other result is returned as it is.

    Raises
    ------
    GraphError
        If the graph is too large for networkx.
    """
    graph = result.graph if isinstance(result, ConvertedGraph) else result
    if not isinstance(graph, GeometricGraph):
        return result
    # (counting the edges of an implicit graph would compute its weights)
    n_edges = graph.n_pairs if graph.is_implicit else graph.n_edges
    if n_edges > MAX_EDGES:
        msg = f"a networkx graph of {n_edges} edges is too large ({MAX_EDGES} at most); call to_networkx() to insist"
        raise GraphError(msg)
    return graph.to_networkx()


def forget_changed(graph: "nx.Graph[Any]", weight: str | None) -> None:
    """
    Remove converted graphs from networkx's cache that are no longer the graph.

    networkx empties the cache when a method of the graph changes it, but does not see ``graph[u][v]["weight"] = 3``.
    So the nodes, the edges and the weights are compared, which takes about a tenth of the time of a conversion.

    Parameters
    ----------
    graph
        The graph of a call.
    weight
        The attribute that the call asks for; None if it counts edges.
    """
    cache = getattr(graph, "__networkx_cache__", None) or {}
    held = cache.get("backends", {}).get("cgla", {})
    # (a call that counts edges may use any of them)
    for key, converted in [*held.items()]:
        if isinstance(converted, ConvertedGraph) and weight in {None, converted.weight}:
            state = converted.state
            if state is None or not state.is_of(graph, converted.weight):
                held.pop(key, None)
