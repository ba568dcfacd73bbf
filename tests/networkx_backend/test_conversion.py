"""networkx's cache of converted graphs: every change of a graph is seen, however it is made."""

import copy
import pickle
from collections.abc import Callable, Hashable, Iterator
from typing import Any

import networkx as nx
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.networkx_backend.conversion import ConvertedGraph
from cgla_graph.networkx_backend.functions import can_run
from cgla_graph.testing.strategies import networks

KINDS = [nx.Graph, nx.DiGraph, nx.MultiGraph, nx.MultiDiGraph]


@pytest.fixture(autouse=True)
def _muted() -> Iterator[None]:
    """Mute networkx's warning, as the manual does."""
    with nx.config(warnings_to_ignore={"cache"}):
        yield


def roads(kind: "type[nx.Graph[Any]]") -> "nx.Graph[Any]":
    """Return a way of 3 over b, and one of 5 past it."""
    graph = kind()
    graph.add_weighted_edges_from([("a", "b", 1), ("b", "c", 2), ("a", "c", 5), ("c", "d", 1)])
    return graph


def held(graph: "nx.Graph[Any]") -> list[ConvertedGraph]:
    """List the converted graphs that networkx keeps."""
    return [*graph.__networkx_cache__.get("backends", {}).get("cgla", {}).values()]  # type: ignore[attr-defined]


def data_of(graph: "nx.Graph[Any]", u: str, v: str) -> dict[str, Any]:
    """Return the dictionary of an edge."""
    found: dict[str, Any] = graph[u][v][0] if graph.is_multigraph() else graph[u][v]
    return found


def in_a_loop(graph: "nx.Graph[Any]") -> None:
    """Change every weight, as networkx's own examples do."""
    for u, v, data in graph.edges(data=True):
        data["weight"] = 3 if {u, v} == {"a", "c"} else 9


def deep(graph: "nx.Graph[Any]") -> None:
    """Change the dictionaries of the adjacency."""
    rows = dict(graph.adjacency())
    del rows["b"]["c"]
    if not graph.is_directed():
        del rows["c"]["b"]


CHANGES: dict[str, Callable[["nx.Graph[Any]"], object]] = {
    "item": lambda graph: data_of(graph, "a", "b").__setitem__("weight", 100),
    "update": lambda graph: data_of(graph, "b", "c").update(weight=7.5),
    "loop": in_a_loop,
    "no weight": lambda graph: data_of(graph, "a", "c").pop("weight"),
    "clear": lambda graph: data_of(graph, "a", "c").clear(),
    "zero": lambda graph: data_of(graph, "a", "c").__setitem__("weight", 0),
    "float": lambda graph: data_of(graph, "a", "b").__setitem__("weight", 1.0),
    "adjacency": deep,
    "add_edge": lambda graph: graph.add_edge("a", "c", weight=1),
    "remove_edge": lambda graph: graph.remove_edge("a", "b"),
    "remove_node": lambda graph: graph.remove_node("b"),
    "add_node": lambda graph: graph.add_edge("a", "z", weight=1) or graph.add_edge("z", "c", weight=1),
    "attributes": lambda graph: nx.set_edge_attributes(graph, 4, "weight"),
}


def answers(graph: "nx.Graph[Any]", backend: str) -> list[object]:
    """Ask for paths and lengths by weight, and by another attribute."""
    return [
        nx.single_source_dijkstra_path_length(graph, "a", backend=backend),
        nx.dijkstra_path_length(graph, "a", "c", backend=backend),
        nx.single_source_dijkstra_path_length(graph, "a", weight="toll", backend=backend),
        nx.shortest_path_length(graph, "a", "c", backend=backend),
    ]


@pytest.mark.parametrize("change", CHANGES.values(), ids=CHANGES)
@pytest.mark.parametrize("kind", KINDS)
def test_every_change_is_seen(kind: "type[nx.Graph[Any]]", change: Callable[["nx.Graph[Any]"], object]) -> None:
    graph = roads(kind)
    answers(graph, "cgla")
    change(graph)
    found = answers(graph, "cgla")
    assert found == answers(graph, "networkx")
    assert answers(graph, "cgla") == found


def test_a_change_of_one_parallel_edge_is_seen() -> None:
    graph = nx.MultiGraph()
    graph.add_edge("a", "b", key="x", weight=2)
    graph.add_edge("a", "b", key="y", weight=3)
    for key, weight, expected in (("x", 9, 3), ("y", 1, 1), ("y", 20, 9)):
        nx.dijkstra_path_length(graph, "a", "b", backend="cgla")
        graph["a"]["b"][key]["weight"] = weight
        assert nx.dijkstra_path_length(graph, "a", "b", backend="cgla") == expected


def test_changes_back_and_forth_and_of_other_attributes() -> None:
    graph = roads(nx.Graph)
    nx.set_edge_attributes(graph, 1, "toll")
    for weight in ("weight", "toll", "weight"):
        for value, expected in ((50, 5), (1, 3)):
            graph["a"]["b"]["weight"] = value
            length = nx.dijkstra_path_length(graph, "a", "c", weight=weight, backend="cgla")
            assert length == (expected if weight == "weight" else 1)


def test_a_graph_that_did_not_change_is_converted_once() -> None:
    graph = roads(nx.Graph)
    nx.dijkstra_path(graph, "a", "c", backend="cgla")
    (first,) = held(graph)
    # names of nodes, other attributes and other weights of the edges do not count
    graph["a"]["b"]["lanes"] = 2
    graph.nodes["a"]["height"] = 7
    nx.dijkstra_path(graph, "b", "d", backend="cgla")
    assert held(graph) == [first]


@pytest.mark.parametrize("copied", [copy.deepcopy, lambda graph: pickle.loads(pickle.dumps(graph)), nx.Graph.copy])  # noqa: S301 - ours
def test_copies_of_a_graph_have_weights_of_their_own(copied: Callable[["nx.Graph[Any]"], "nx.Graph[Any]"]) -> None:
    graph = roads(nx.Graph)
    nx.dijkstra_path(graph, "a", "c", backend="cgla")
    other = copied(graph)
    other["a"]["b"]["weight"] = 100
    for one, expected in ((graph, 3), (other, 5), (graph, 3)):
        assert nx.dijkstra_path_length(one, "a", "c", backend="cgla") == expected


@pytest.mark.parametrize(
    "view",
    [
        lambda graph: graph.subgraph("abc"),
        lambda graph: nx.subgraph_view(graph, filter_node=lambda node: node != "d"),
        lambda graph: graph.to_directed(as_view=True),
        nx.freeze,
        lambda graph: nx.restricted_view(graph, ["d"], []),
    ],
)
def test_views_show_changes_of_their_graph(view: Callable[["nx.Graph[Any]"], "nx.Graph[Any]"]) -> None:
    graph = roads(nx.Graph)
    seen = view(graph)
    assert nx.dijkstra_path_length(seen, "a", "c", backend="cgla") == 3
    graph["a"]["b"]["weight"] = 100
    assert nx.dijkstra_path_length(seen, "a", "c", backend="cgla") == 5


def test_weights_that_cannot_be_converted_any_more_go_to_networkx() -> None:
    graph = roads(nx.Graph)
    with nx.config(backend_priority=["cgla"]):
        assert nx.dijkstra_path(graph, "a", "c") == ["a", "b", "c"]
        graph["a"]["b"]["weight"] = float("inf")
        assert nx.dijkstra_path(graph, "a", "c") == ["a", "c"]


@usual
@given(graph=networks(), number=st.integers(0, 20), weight=st.sampled_from([0, 1, 2.5, 100]))
def test_any_weight_of_any_graph(graph: "nx.Graph[Hashable]", number: int, weight: float) -> None:
    source = next(iter(graph))
    for _ in range(2):
        # (networkx's own code answers where weights are infinite)
        with nx.config(backend_priority=["cgla"]):
            found = nx.single_source_dijkstra_path_length(graph, source)
        assert found == pytest.approx(nx.single_source_dijkstra_path_length(graph, source, backend="networkx"))
        if edges := [data for *_, data in graph.edges(data=True)]:
            edges[number % len(edges)]["weight"] = weight


def test_arguments_are_found_by_position_and_by_name() -> None:
    graph = roads(nx.Graph)

    def by_length(u: object, v: object, data: object) -> float:
        return 1.0

    for args, kwargs in (
        ((graph, "a", "c", by_length), {}),
        ((graph, "a", "c"), {"weight": by_length}),
        ((), {"G": graph, "source": "a", "target": "c", "weight": by_length}),
    ):
        assert isinstance(can_run("dijkstra_path", args, kwargs), str)
    assert can_run("dijkstra_path", (), {"G": graph, "source": "a", "target": "c"}) is True
    assert can_run("has_path", (graph, "a", "c"), {}) is True
