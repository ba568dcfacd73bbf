"""The networkx backend answers as networkx does, on our graphs and on networkx's own."""

import inspect
import itertools
import math
import os
import subprocess
import sys
import tracemalloc
from collections.abc import Callable, Hashable, Iterator, Mapping
from fractions import Fraction
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
import strategies as sts
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph.errors import GraphError
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.networkx_backend import functions
from cgla_graph.networkx_backend.description import FUNCTIONS
from cgla_graph.testing import strategies as drawn

Network = nx.Graph  # of any kind


@pytest.fixture(autouse=True)
def _quiet_about_the_cache() -> Iterator[None]:
    with nx.config(warnings_to_ignore={"cache"}):
        yield


@st.composite
def networks(draw: st.DrawFn) -> Network:
    """Draw graphs of every kind whose weights add up without rounding; on some edges they are missing."""
    graph = draw(drawn.networks())
    for _, _, data in graph.edges(data=True):
        if math.isinf(data["weight"]):
            del data["weight"]
        elif isinstance(data["weight"], float):
            data["weight"] = round(8.0 * data["weight"]) / 8.0
    return graph


@st.composite
def geometric_graphs(draw: st.DrawFn) -> cg.GeometricGraph:
    """Draw graphs held as a dense matrix, as a sparse one, or not at all."""
    kind = draw(st.sampled_from(["dense", "sparse", "implicit", "weighed", "eight"]))
    if kind in {"dense", "sparse"}:
        dense = cg.GeometricGraph.from_matrix(draw(drawn.whole_weights(low=0)))
        return dense if kind == "dense" else cg.GeometricGraph.from_sparse(dense.to_csgraph(), directed=dense.directed)
    lattice = draw(drawn.lattices(max_side=5, unit=True))
    field, k, area = draw(drawn.fields()), draw(drawn.risk_weights), draw(drawn.polygons(1))
    if kind == "eight":
        return cg.GeometricGraph.eight_connected(lattice, field, k, no_fly=area)
    graph = cg.GeometricGraph.complete(lattice, field, k, no_fly=area, extra=draw(sts.off_lattice_points()))
    return graph.with_weights_held() if kind == "weighed" else graph


def arguments(draw: st.DrawFn, name: str, nodes: list[Hashable]) -> dict[str, Any]:
    """Draw the arguments of a function of networkx besides its graph."""
    node = st.sampled_from([*nodes, *nodes, "nowhere"])
    drawn: dict[str, st.SearchStrategy[Any]] = {
        "source": node,
        "target": node,
        "sources": st.lists(node, max_size=3),
        "cutoff": st.none() | st.integers(-1, 12).map(lambda i: i / 4),
        "weight": st.sampled_from(["weight", "weight", None, "missing"]),
        "method": st.sampled_from(["dijkstra", "bellman-ford", "other"]),
    }
    chosen = {}
    for parameter in inspect.signature(getattr(nx, name)).parameters.values():
        needed = parameter.default is inspect.Parameter.empty
        if parameter.name in drawn and (needed or draw(st.booleans())):
            chosen[parameter.name] = draw(drawn[parameter.name])
    return chosen


def seen(answer: object, graph: Network, chosen: Mapping[str, Any]) -> object:
    """Normalise an answer so that ties are equal: of a path, only its ends and its cost count."""
    if isinstance(answer, list):
        parallel = [graph[u][v] for u, v in itertools.pairwise(answer)]
        edges = [data.values() if graph.is_multigraph() else [data] for data in parallel]
        cost = sum(min(data.get(chosen["weight"], 1) for data in some) for some in edges)
        # of several sources, any may be nearest
        return answer[0] in chosen.get("sources", ()) or answer[0], answer[-1], cost
    if isinstance(answer, Iterator):
        return seen(dict(answer), graph, chosen)
    if isinstance(answer, dict):
        return {node: seen(part, graph, chosen) for node, part in answer.items()}
    return tuple(seen(part, graph, chosen) for part in answer) if isinstance(answer, tuple) else answer


def close(answer: object) -> object:
    """Make an answer equal to answers that differ by rounding."""
    if isinstance(answer, dict):
        return {node: close(part) for node, part in answer.items()}
    if isinstance(answer, tuple):
        return tuple(close(part) for part in answer)
    return pytest.approx(answer, rel=1e-12) if isinstance(answer, float) else answer


def outcome(graph: Network, call: Callable[[], Any], name: str, chosen: dict[str, Any]) -> object:
    """Return what a call answers, or the error that it raises."""
    default = inspect.signature(getattr(nx, name)).parameters.get("weight")
    try:
        return seen(call(), graph, {"weight": default.default if default else None, **chosen})
    except (nx.NetworkXException, ValueError) as error:
        # (networkx has other messages for its Bellman-Ford)
        return type(error), "" if chosen.get("method") == "bellman-ford" else str(error)


@pytest.mark.parametrize("name", FUNCTIONS)
@sts.few
@given(data=st.data())
def test_converted_graphs_answer_as_networkx_does(name: str, data: st.DataObject) -> None:
    graph = data.draw(networks())
    chosen = arguments(data.draw, name, list(graph))
    function = getattr(nx, name)
    ours = outcome(graph, lambda: function(graph, **chosen, backend="cgla"), name, chosen)
    assert ours == outcome(graph, lambda: function(graph, **chosen, backend="networkx"), name, chosen)


@pytest.mark.parametrize("name", FUNCTIONS)
@sts.few
@given(data=st.data())
def test_geometric_graphs_answer_as_their_networkx_graphs(name: str, data: st.DataObject) -> None:
    graph = data.draw(geometric_graphs())
    chosen = arguments(data.draw, name, list(graph.labels))
    function, same = getattr(nx, name), graph.to_networkx()
    ours = outcome(same, lambda: function(graph, **chosen), name, chosen)
    assert ours == close(outcome(same, lambda: function(same, **chosen, backend="networkx"), name, chosen))


def test_whole_weights_give_whole_lengths() -> None:
    graph = nx.cycle_graph(5)
    nx.set_edge_attributes(graph, 2, "weight")
    lengths = nx.shortest_path_length(graph, 0, weight="weight", backend="cgla")
    assert list(lengths.items()) == [(0, 0), (1, 2), (4, 2), (2, 4), (3, 4)]
    assert {type(length) for length in lengths.values()} == {int}
    graph.edges[0, 1]["weight"] = 0.5
    graph.__networkx_cache__.clear()
    assert nx.shortest_path_length(graph, 0, 2, weight="weight", backend="cgla") == 2.5


@pytest.mark.slow
@pytest.mark.parametrize(("large", "step"), [(0, 13), (1000, 1)], ids=["restricted", "led by the straight line"])
def test_a_search_for_one_target_finds_the_optimum(large: int, step: int, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(functions, "LARGE", large)
    field = cg.RiskField([cg.Threat(x=0.4, y=0.5, spread=0.08), cg.Threat(x=0.6, y=0.4, spread=0.05)])
    graph = cg.GeometricGraph.complete(cg.Lattice(9, bounds=(0, 0, 1, 1)), field, k=10.0)
    least = cg.cost_matrix(graph, 80)
    for source in range(0, 80, step):
        length, path = nx.bidirectional_dijkstra(graph, source, 80)
        assert length == pytest.approx(least.value(source), rel=1e-12)
        assert length == sum(graph.weight(u, v) for u, v in itertools.pairwise(path))
        for sources in ([0, source], [source, 0]):
            # the corner is often beyond the cutoff
            found, _ = nx.multi_source_dijkstra(graph, sources, 80, cutoff=length * (1.0 + 1e-12))
            assert found == pytest.approx(min(length, least.value(0)), rel=1e-12)
        with pytest.raises(nx.NetworkXNoPath):
            nx.single_source_dijkstra(graph, source, 80, cutoff=length * (1.0 - 1e-6))


@pytest.mark.parametrize(
    "make", [cg.GeometricGraph.from_matrix, lambda m: cg.GeometricGraph.from_matrix(m).to_networkx()]
)
def test_a_cutoff_below_0_leaves_the_source_alone(make: Callable[[list[list[float]]], Any]) -> None:
    graph = make([[0, 0], [0, 0]])
    assert nx.single_source_dijkstra(graph, 0, cutoff=-1, backend="cgla") == ({0: 0}, {0: [0]})
    assert nx.single_source_dijkstra(graph, 0, cutoff=0, backend="cgla")[0] == {0: 0, 1: 0}


def test_a_large_complete_graph_is_never_held_in_memory() -> None:
    field = cg.RiskField([cg.Threat(x=0.5, y=0.5, spread=0.02)])

    def run(size: int) -> tuple[list[int], list[int], dict[int, float], cg.GeometricGraph]:
        graph = cg.GeometricGraph.complete(cg.Lattice(size, bounds=(0, 0, 1, 1)), field, k=1.0)
        last = size * size - 1
        path = nx.shortest_path(graph, 0, last, weight="weight")
        near = nx.single_source_dijkstra_path_length(graph, 0, cutoff=0.03, weight="weight")
        return path, nx.shortest_path(graph, 0, last), near, graph

    run(100)  # modules imported and kernels compiled here do not count
    tracemalloc.start()
    try:
        path, hops, near, graph = run(100)
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert peak < 20e6  # the matrix takes 800 MB
    assert (path[0], path[-1], hops) == (0, 9999, [0, 9999])
    assert set(near) == {0, 1, 2, 100, 101, 102, 200, 201, 202}
    weights = [graph.weight(u, v) for u, v in itertools.pairwise(path)]
    assert math.sqrt(2.0) * 0.99 < sum(weights) < graph.weight(0, 9999)


@pytest.mark.parametrize(
    "weight", [-1, math.inf, -math.inf, math.nan, Fraction(1, 3), "2", None, np.float32(0.1), 2**53, 10**400, 1.7e308]
)
def test_weights_that_floats_cannot_add_up_are_left_to_networkx(weight: object) -> None:
    graph = nx.DiGraph([(0, 1), (1, 2)])
    nx.set_edge_attributes(graph, weight, "weight")
    with pytest.raises(NotImplementedError):
        nx.dijkstra_path(graph, 0, 2, backend="cgla")


def test_calls_that_cannot_run_are_run_by_networkx() -> None:
    graph = nx.path_graph(4)
    with nx.config(backend_priority=["cgla"]):
        assert nx.dijkstra_path_length(graph, 0, 3, weight=lambda *_: 5) == 15
        nx.set_edge_attributes(graph, Fraction(1, 3), "weight")
        assert nx.dijkstra_path_length(graph, 0, 3) == Fraction(1)
        nx.set_edge_attributes(graph, -1, "weight")
        assert nx.shortest_path_length(nx.DiGraph(graph.edges), 0, 3, weight="weight", method="bellman-ford") == 3
    with pytest.raises(NotImplementedError, match="for the given arguments"):
        nx.dijkstra_path_length(graph, 0, 3, weight=lambda *_: 5, backend="cgla")


def test_an_improper_field_is_declined() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(x=0.5, y=0.5, spread=0.1, peak=3.0)], improper=True)
    graph = cg.GeometricGraph.complete(cg.Lattice(4, bounds=(0, 0, 1, 1)), field, k=1.0)
    with pytest.raises(NotImplementedError):
        nx.shortest_path(graph, 0, 15, weight="weight")


def test_a_graph_is_converted_once_and_again_when_it_changes() -> None:
    graph = nx.path_graph(4)
    with nx.config(backend_priority=["cgla"]):
        nx.shortest_path(graph, 0, 3)
        assert "backends" not in graph.__networkx_cache__
        assert nx.dijkstra_path_length(graph, 0, 3) == 3
        (converted,) = graph.__networkx_cache__["backends"]["cgla"].values()
        assert nx.dijkstra_path(graph, 3, 0) == [3, 2, 1, 0]
        assert [*graph.__networkx_cache__["backends"]["cgla"].values()] == [converted]
        graph.add_edge(0, 3)
        assert nx.dijkstra_path_length(graph, 0, 3) == 1


def test_other_functions_of_networkx_take_a_geometric_graph_if_they_may_convert_it() -> None:
    graph = cg.GeometricGraph.complete(cg.Lattice(4, bounds=(0, 0, 1, 1)))
    with pytest.raises(NotImplementedError):
        nx.number_connected_components(graph)
    with nx.config(fallback_to_nx=True):
        assert nx.number_connected_components(graph) == 1
        with pytest.raises(GraphError, match="49995000 edges"):
            nx.number_connected_components(cg.GeometricGraph.complete(cg.Lattice(100, bounds=(0, 0, 1, 1))))
        with pytest.raises(nx.NetworkXNotImplemented):
            nx.number_connected_components(cg.GeometricGraph.from_matrix([[0, 1], [2, 0]]))


def test_the_description_lists_all_functions() -> None:
    own = {name for name, thing in vars(functions).items() if getattr(thing, "__module__", "") == functions.__name__}
    machinery = {"ConvertedGraph", "can_run", "should_run", "convert_from_nx", "convert_to_nx"}
    assert {name for name in own if not name.startswith("_")} - machinery == set(FUNCTIONS)
    for name in FUNCTIONS:
        theirs = inspect.signature(getattr(nx, name).orig_func).parameters.values()
        ours = inspect.signature(getattr(functions, name)).parameters.values()
        assert [(p.name, p.kind, p.default) for p in ours] == [(p.name, p.kind, p.default) for p in theirs]
        assert "cgla : Shortest paths" in getattr(nx, name).__doc__


def test_networkx_finds_the_backend_without_importing_the_toolkit() -> None:
    script = "import networkx, sys; print('cgla' in networkx.config.backends, {'numpy', 'numba'} & {*sys.modules})"
    done = subprocess.run([sys.executable, "-W", "error", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout.split() == ["True", "set()"]


#: Faults that a pytest plugin puts into the backend; networkx's tests find them.
MUTANTS = {
    "sound": "",
    "lengths": "f._Tree.length = lambda tree, index: float(tree.values[index]) + 1",
    "paths": "path = f._Tree.path; f._Tree.path = lambda tree, index: path(tree, index)[::-1]",
    "direction": "search = f._search; f._search = lambda *a, towards=False, **k: search(*a, **k)",
    "cutoff": "search = f._search; f._search = lambda *a, cutoff=None, **k: search(*a, **k)",
    "parallel edges": "f.convert_from_nx.__globals__['compressed'] = lambda t, h, w, n, mirrored: "
    "compressed(t, h, -w, n, mirrored=mirrored) * -1",
}


@pytest.mark.slow
@pytest.mark.parametrize("mutant", MUTANTS)
def test_networkx_own_tests(mutant: str, tmp_path: Path) -> None:
    """They pass on the backend, and not on one that is broken."""
    lines = [
        "import cgla_graph.networkx_backend.functions as f",
        "compressed = f.convert_from_nx.__globals__['compressed']",
        MUTANTS[mutant],
    ]
    (tmp_path / "mutant.py").write_text("\n".join(lines), encoding="utf-8")
    command = [sys.executable, "-m", "pytest", "--quiet", "-p", "no:cacheprovider", "-p", "mutant", "--pyargs"]
    backend = {"NETWORKX_TEST_BACKEND": "cgla", "NETWORKX_FALLBACK_TO_NX": "True", "PYTHONPATH": str(tmp_path)}
    done = subprocess.run(
        # (the first failure suffices)
        [*command, "--exitfirst", "networkx.algorithms.shortest_paths"],
        capture_output=True,
        text=True,
        check=False,
        cwd=tmp_path,
        env={**os.environ, **backend},
    )
    assert done.returncode == (mutant != "sound"), done.stdout + done.stderr
