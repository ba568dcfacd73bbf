"""Graphs of igraph and rustworkx are taken over as the same graph of networkx is."""

import math
import re
from collections.abc import Callable, Hashable
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy import sparse
from strategies import usual

import cgla_graph as cg
from cgla_graph.errors import GraphError, ProblemError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.risk import RiskField
from cgla_graph.testing.strategies import fields, networks, risk_weights

TakeOver = Callable[..., GeometricGraph]


def as_igraph(graph: "nx.Graph[Hashable]") -> Any:  # noqa: ANN401 - of an optional package
    igraph = pytest.importorskip("igraph")
    index = {label: i for i, label in enumerate(graph)}
    made = igraph.Graph(
        n=len(graph), edges=[(index[u], index[v]) for u, v in graph.edges()], directed=graph.is_directed()
    )
    made.vs["name"] = list(graph)
    of_nodes, of_edges = [data for _, data in graph.nodes(data=True)], [data for *_, data in graph.edges(data=True)]
    for owner, holds in ((made.vs, of_nodes), (made.es, of_edges)):
        for name in {name for data in holds for name in data}:
            owner[name] = [data.get(name) for data in holds]
    return made


def as_rustworkx(graph: "nx.Graph[Hashable]") -> Any:  # noqa: ANN401 - of an optional package
    rustworkx = pytest.importorskip("rustworkx")
    made = rustworkx.PyDiGraph() if graph.is_directed() else rustworkx.PyGraph()
    index = {label: made.add_node({"label": label, **data}) for label, data in graph.nodes(data=True)}
    made.add_edges_from([(index[u], index[v], dict(data)) for u, v, data in graph.edges(data=True)])
    return made


def from_igraph(graph: "nx.Graph[Hashable]", **options: Any) -> GeometricGraph:  # noqa: ANN401 - whatever options
    return GeometricGraph.from_igraph(as_igraph(graph), **options)


def from_rustworkx(graph: "nx.Graph[Hashable]", **options: Any) -> GeometricGraph:  # noqa: ANN401 - whatever options
    return GeometricGraph.from_rustworkx(as_rustworkx(graph), labels=list(graph), **options)


libraries = pytest.mark.parametrize("take_over", [from_igraph, from_rustworkx])


def same(found: GeometricGraph, expected: GeometricGraph) -> None:
    assert list(found.labels) == list(expected.labels)
    assert found.directed == expected.directed
    assert found.n_edges == expected.n_edges
    np.testing.assert_array_equal(found.weight_matrix(), expected.weight_matrix())
    np.testing.assert_array_equal(found.positions, expected.positions)  # type: ignore[arg-type]


@libraries
@usual
@given(st.one_of(networks(), networks(positioned=True)))
def test_a_graph_is_the_same_whatever_library_holds_it(take_over: TakeOver, graph: "nx.Graph[Hashable]") -> None:
    same(take_over(graph), GeometricGraph.from_networkx(graph))


@libraries
@usual
@given(networks(positioned=True), fields(0, 2), risk_weights)
def test_weight_none_weighs_the_edges_by_eq5(
    take_over: TakeOver, graph: "nx.Graph[Hashable]", field: RiskField, k: float
) -> None:
    area = shapely.box(0.4, 0.4, 0.6, 0.6)
    options: dict[str, Any] = {"weight": None, "field": field, "k": k, "no_fly": area}
    same(take_over(graph, **options), GeometricGraph.from_networkx(graph, **options))


@libraries
def test_other_attribute_names_serve(take_over: TakeOver) -> None:
    graph = nx.DiGraph()
    graph.add_node("a", at=(0, 0))
    graph.add_node("b", at=(3, 4))
    graph.add_edge("a", "b", cost=np.float32(2))
    same(take_over(graph, weight="cost", pos="at"), GeometricGraph.from_networkx(graph, weight="cost", pos="at"))


def path(weights: dict[tuple[str, str], object], **positions: object) -> "nx.Graph[Hashable]":
    graph = nx.path_graph(["a", "b", "c"])
    nx.set_edge_attributes(graph, weights, "weight")
    nx.set_node_attributes(graph, positions, "pos")
    return graph


@libraries
@pytest.mark.parametrize(
    ("graph", "weight", "words"),
    [
        *((graph, None, "the graph has no nodes") for graph in (nx.Graph(), nx.MultiDiGraph())),
        *(
            (path({("a", "b"): odd}), "weight", f"'a' - 'b' has weight {re.escape(repr(odd))}.*at least 0")
            for odd in (-math.inf, math.nan, "heavy", (1,), -1e-300)
        ),
        (path({}), "weight", "'a' - 'b' has no attribute 'weight'.*weight=None"),
        (path({("a", "b"): 1.0}), "weight", "'b' - 'c' has no attribute 'weight'"),
        (path({}, a=(0, 0)), None, "node 'b' has no attribute 'pos'"),
        (path({}, a=(0, 0), b=(math.nan, 0), c=(1, 1)), None, "position"),
    ],
)
def test_malformed_graphs_are_refused(
    take_over: TakeOver, graph: "nx.Graph[Hashable]", weight: str | None, words: str
) -> None:
    with pytest.raises((GraphError, ProblemError), match=words):
        take_over(graph, weight=weight)


def test_vertices_of_igraph_without_names_are_numbered() -> None:
    igraph = pytest.importorskip("igraph")
    graph = igraph.Graph.Full(3)
    graph.es["weight"] = 1.0
    assert list(GeometricGraph.from_igraph(graph).labels) == [0, 1, 2]
    graph.vs["name"] = ["a", "b", "b"]
    with pytest.raises(GraphError, match="3 labels, 2 of them different"):
        GeometricGraph.from_igraph(graph)
    assert list(GeometricGraph.from_igraph(graph, labels="xyz").labels) == ["x", "y", "z"]


def test_nodes_of_rustworkx_keep_their_indices_when_others_are_removed() -> None:
    rustworkx = pytest.importorskip("rustworkx")
    graph = rustworkx.PyDiGraph()
    graph.add_nodes_from(["depot", "gone", "bridge", "tower"])
    # an edge may hold its weight alone
    graph.add_edges_from([(0, 2, 2.0), (2, 3, 0), (0, 3, 5.0), (1, 3, -1.0)])
    graph.remove_node(1)
    solution = cg.solve(cg.GraphProblem(GeometricGraph.from_rustworkx(graph), 0, 3), "cgla")
    assert (solution.nodes, solution.cost) == ((0, 2, 3), 2.0)
    assert list(GeometricGraph.from_rustworkx(graph, labels=graph.nodes()).labels) == ["depot", "bridge", "tower"]
    with pytest.raises(GraphError, match="2 labels"):
        GeometricGraph.from_rustworkx(graph, labels="ab")
    graph.add_edge(3, 0, None)
    with pytest.raises(GraphError, match="3 - 0 has no attribute 'weight'"):
        GeometricGraph.from_rustworkx(graph)


@pytest.mark.parametrize("take_over", [GeometricGraph.from_igraph, GeometricGraph.from_rustworkx])
@pytest.mark.parametrize("graph", [nx.path_graph(2), np.ones((2, 2)), None])
def test_what_is_no_graph_of_the_library_is_refused(take_over: TakeOver, graph: object) -> None:
    with pytest.raises(GraphError, match=r"this is a \w+, not an? (igraph|rustworkx) graph"):
        take_over(graph)


def test_from_scipy_is_from_sparse() -> None:
    entries = sparse.csr_array(([0.0, 2.0], ([0, 1], [1, 2])), shape=(3, 3))
    same(
        GeometricGraph.from_scipy(entries, directed=False, labels="abc"),
        GeometricGraph.from_sparse(entries, directed=False, labels="abc"),
    )
