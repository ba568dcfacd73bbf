"""The graph libraries find what scipy's Dijkstra finds, on graphs of every kind; those not installed are skipped."""

from collections.abc import Hashable

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import least_costs
from strategies import few, usual

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Status
from cgla_graph.solvers import registry
from cgla_graph.solvers.exact import library_search
from cgla_graph.testing.strategies import networks, weight_matrices, whole_weights

LIBRARIES = [
    pytest.param(name, marks=pytest.mark.skipif(registry.missing(name) is not None, reason=f"{name} is missing"))
    for name in ("networkit", "igraph", "rustworkx", "networkx")
]
libraries = pytest.mark.parametrize("name", LIBRARIES)
weights_of_any_kind = st.one_of(weight_matrices(), whole_weights(0), weight_matrices(edge=1.0))


def check(name: str, problem: GraphProblem, best: float) -> None:
    """Hold an answer to the least cost: the path is judged by `cg.solve`, which adds its weights up again."""
    answer = cg.solve(problem, name)
    if np.isinf(best):
        assert answer.status is Status.NO_PATH
        return
    assert answer.status is Status.OPTIMAL, answer.message
    assert answer.cost == pytest.approx(best, rel=1e-12, abs=0.0)
    assert (answer.nodes[0], answer.nodes[-1]) == (problem.source, problem.target)


@libraries
@usual
@given(weights_of_any_kind, st.data())
def test_costs_are_those_of_scipy(name: str, weights: FloatArray, data: st.DataObject) -> None:
    dense = GeometricGraph.from_matrix(weights)
    stored = GeometricGraph.from_sparse(dense.to_csgraph(), directed=dense.directed)
    source, target = (data.draw(st.integers(0, len(weights) - 1)) for _ in "st")
    best = float(least_costs(weights, target)[source])
    for graph in (dense, stored):
        assert cg.solve(GraphProblem(graph, source, target), "dijkstra").cost == pytest.approx(best, rel=1e-12)
        check(name, GraphProblem(graph, source, target), best)


@libraries
@few
@given(networks(), st.data())
def test_a_graph_of_any_labels_is_searched(name: str, graph: "nx.Graph[Hashable]", data: st.DataObject) -> None:
    source, target = (data.draw(st.sampled_from(list(graph.nodes))) for _ in "st")
    problem = GraphProblem(GeometricGraph.from_networkx(graph), source, target)
    best = cg.solve(problem, "cgla")
    check(name, problem, best.cost if best.status is Status.OPTIMAL else np.inf)


@libraries
@pytest.mark.parametrize("weighed", [False, True])
def test_a_lattice_with_walls_is_searched(name: str, weighed: bool) -> None:
    problem = cg.load_scenario("gap-in-wall").problem.on_lattice(9)
    best = cg.solve(problem, "dijkstra").cost
    check(name, problem.with_weights_held() if weighed else problem, best)


@libraries
def test_time_to_hand_the_graph_over_is_told_apart(name: str) -> None:
    problem = cg.load_scenario("paper").problem.on_lattice(20).with_weights_held()
    cg.solve(problem, name)
    answer = cg.solve(problem, name)
    assert answer.build_seconds > 0.0
    assert answer.seconds > 0.0


@libraries
def test_a_graph_that_does_not_fit_is_refused_unweighed(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(library_search, "MOST_BYTES", 4_000)
    monkeypatch.setattr(GeometricGraph, "n_edges", property(lambda _: pytest.fail("weighs the graph")))
    answer = cg.solve(cg.Problem((0, 0), (1, 1)).on_lattice(9), name)
    assert answer.status is Status.UNSUPPORTED
    assert "3240 edges" in answer.message
    assert answer.message.lower().startswith("3240 edges; " + name)


def test_networkit_breaks_ties_alike_each_time() -> None:
    networkit = pytest.importorskip("networkit")
    threads = networkit.getMaxNumberOfThreads()
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=10.0)
    on = problem.on_lattice(8).with_weights_held()
    assert len({cg.solve(on, "networkit").nodes for _ in range(200)}) == 1
    assert networkit.getMaxNumberOfThreads() == threads
