"""Readers of other libraries' graphs as lists of nodes and edges, which do not import the library."""

import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from os import PathLike
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np

from cgla_graph._types import IntArray
from cgla_graph._validate import instance
from cgla_graph.errors import GraphError
from cgla_graph.model.adjacency import MISSING, Node

if TYPE_CHECKING:
    import networkx as nx


@dataclass(frozen=True, eq=False)
class GraphLists:
    """
    The nodes and edges of a graph of another library.

    Attributes
    ----------
    labels
        The nodes.
    spots
        The position of each node, or None.
    ends
        Shape ``(m, 2)``: the indices of each edge's tail and head.
    weights
        The weight of each edge, or `MISSING`.
    directed
        Whether an edge leads one way only.
    """

    labels: Sequence[Node]
    spots: list[object]
    ends: IntArray
    weights: list[object]
    directed: bool


def read_networkx(graph: "nx.Graph[Any]", weight: str | None, pos: str) -> GraphLists:
    """Read a networkx graph of any kind."""
    _library_of(graph, "networkx", "Graph")
    for name, key in (("weight", weight), ("pos", pos)):
        instance(name, key, (str, NoneType), "the name of an attribute", GraphError)
    labels = list(graph.nodes)
    index = {label: i for i, label in enumerate(labels)}
    edges = list(graph.edges(data=True))
    ends = [(index[u], index[v]) for u, v, _ in edges]
    weights: list[object] = [data.get(str(weight), MISSING) for _, _, data in edges]
    spots = [data.get(pos) for _, data in graph.nodes(data=True)]
    return GraphLists(labels, spots, _pairs(ends), weights, graph.is_directed())


def read_igraph(graph: Any, weight: str | None, pos: str) -> GraphLists:  # noqa: ANN401 - of an optional package
    """Read an igraph graph; igraph gives None where an edge or a vertex lacks an attribute."""
    _library_of(graph, "igraph", "Graph")
    labels = graph.vs["name"] if "name" in graph.vs.attributes() else range(graph.vcount())
    held = graph.es[weight] if weight in graph.es.attributes() else [None] * graph.ecount()
    spots = graph.vs[pos] if pos in graph.vs.attributes() else [None] * graph.vcount()
    weights = [MISSING if value is None else value for value in held]
    return GraphLists(labels, spots, _pairs(graph.get_edgelist()), weights, graph.is_directed())


def read_rustworkx(graph: Any, weight: str | None, pos: str) -> GraphLists:  # noqa: ANN401 - of an optional package
    """Read a rustworkx graph, whose nodes and edges hold any object: attributes by name, or the weight itself."""
    rustworkx = _library_of(graph, "rustworkx", "PyGraph", "PyDiGraph")
    labels = list(graph.node_indices())
    # nodes that were removed leave gaps between the indices
    index = {label: i for i, label in enumerate(labels)}
    edges = graph.weighted_edge_list()
    ends = _pairs([(index[u], index[v]) for u, v, _ in edges])
    weights = [
        data.get(weight, MISSING) if isinstance(data, Mapping) else MISSING if data is None else data
        for _, _, data in edges
    ]
    spots = [data.get(pos) if isinstance(data, Mapping) else None for data in graph.nodes()]
    return GraphLists(labels, spots, ends, weights, isinstance(graph, rustworkx.PyDiGraph))


def graph_wanted(value: object) -> str:
    """
    Return how to make a `GeometricGraph` from a value that was given in its place.

    Examples
    --------
    >>> import networkx as nx
    >>> graph_wanted(nx.DiGraph()), graph_wanted([[0, 1], [1, 0]])
    ('GeometricGraph.from_networkx(graph)', 'GeometricGraph.from_matrix(weights)')
    """
    library = type(value).__module__.partition(".")[0]
    if library in {"networkx", "igraph", "rustworkx"}:
        return f"GeometricGraph.from_{library}(graph)"
    if library == "scipy":
        return "GeometricGraph.from_sparse(weights)"
    for attribute, wanted in (("graph", "its graph, as problem.graph"), ("on_lattice", "problem.on_lattice().graph")):
        if hasattr(value, attribute):
            return wanted
    if isinstance(value, str | PathLike):
        return "a GeometricGraph; cgla_graph.scenarios.graphs.graph_file.read_graph(path).graph() reads one from a file"
    return "GeometricGraph.from_matrix(weights)"


def _pairs(ends: Sequence[tuple[int, int]]) -> IntArray:
    return np.array(ends, dtype=np.int64).reshape(-1, 2)


def _library_of(graph: object, library: str, *kinds: str) -> Any:  # noqa: ANN401 - a module
    """Return the library of a graph, which is imported if there is such a graph; refuse other objects."""
    module = sys.modules.get(library)
    if module is None or not isinstance(graph, tuple(getattr(module, kind) for kind in kinds)):
        article = "an" if library.startswith("i") else "a"
        msg = f"this is a {type(graph).__name__}, not {article} {library} graph; from_matrix takes matrices of weights"
        raise GraphError(msg)
    return module
