"""The claims about paths read off the cost matrix: counts and costs by hand, and that broken answers end the check."""

import dataclasses
from typing import Any

import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import path_claims
from cgla_graph.comparisons.claims.paper.path_claims import _all_costs, _best_paths, _tied_but_unique
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.solvers import solve

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}
INF = float("inf")
#: From s by a or by b to t.
DIAMOND = [[0, 1, 2, INF], [1, 0, INF, 3], [2, INF, 0, 2], [INF, 3, 2, 0]]
STAR = [[0, 1, 5, INF], [1, 0, INF, 1], [5, INF, 0, 1], [INF, 1, 1, 0]]


def _lattice_problem(goal: tuple[float, float], threats: Any = None) -> Any:  # noqa: ANN401 - of a graph
    problem = Problem((0.25, 0.25), goal, threats, k=0.0, bounds=(0.0, 0.0, 1.0, 1.0))
    return problem.on_lattice(Lattice(8, bounds=problem.bounds, kind="upper"))


@pytest.mark.parametrize(("weights", "expected"), [(DIAMOND, 2), (STAR, 1)])
def test_best_paths_are_counted(weights: list[list[float]], expected: int) -> None:
    graph = GeometricGraph.from_matrix(weights)
    assert _best_paths(graph, 0, 3) == expected
    costs = _all_costs(graph.weight_matrix(), 0, 3)
    assert costs.count(min(costs)) == expected


def test_all_paths_of_a_complete_graph_are_listed() -> None:
    # through 0 to 3 of the three other nodes, in any order
    weights = GeometricGraph.from_matrix([[float(i != j) for j in range(5)] for i in range(5)]).weight_matrix()
    assert sorted(_all_costs(weights, 0, 4)) == [1.0] + [2.0] * 3 + [3.0] * 6 + [4.0] * 6
    assert _all_costs(weights, 2, 2) == [0.0]


def test_the_lattice_of_remark_1_has_ties_and_one_best_path() -> None:
    sizes = _tied_but_unique(_lattice_problem((0.75, 0.625)))
    # the goal, then its four neighbours one by one
    assert sizes[:5] == [1, 4, 3, 2, 1]


def test_points_on_the_straight_line_make_further_paths() -> None:
    with pytest.raises(AssertionError, match="several paths are best"):
        _tied_but_unique(_lattice_problem((0.75, 0.75)))


def test_a_lattice_without_ties_is_noticed() -> None:
    on = Problem((0.0, 0.0), (1.0, 0.3), k=0.0, bounds=(0.0, 0.0, 1.0, 0.3)).on_lattice(
        Lattice((2, 2), bounds=(0.0, 0.0, 1.0, 0.3))
    )
    with pytest.raises(AssertionError, match="has several points"):
        _tied_but_unique(on)


def test_a_lattice_costs_more_where_the_best_path_leaves_it() -> None:
    stored = counterexamples.scenario("off-the-lattice.toml")
    assert 1e-3 < path_claims._excess(stored.problem, stored.lattice) < 0.1
    straight = dataclasses.replace(stored.problem, field=None)
    assert path_claims._excess(straight, stored.lattice) == pytest.approx(0.0, abs=1e-9)


def test_a_path_that_is_not_optimal_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    def dearer(*given: Any, **settings: Any) -> Solution:  # noqa: ANN401 - as `solve`
        found = solve(*given, **settings)
        return dataclasses.replace(found, cost=found.cost * (1.0 + 1e-9))

    monkeypatch.setattr(path_claims, "solve", dearer)
    with pytest.raises(AssertionError, match="a cheaper path exists"):
        CHECKS["C14"](QUICK)


def test_a_map_on_which_the_lattice_is_best_is_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(path_claims, "_excess", lambda *_: 1e-6)
    with pytest.raises(AssertionError, match="no path that is cheaper off the lattice"):
        CHECKS["C14"](QUICK)


def test_a_g_that_eq_9_did_not_make_runs_in_circles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Read with the transposed weights, directed graphs send the walk in a circle."""
    eq_9 = path_claims.eq_9
    monkeypatch.setattr(path_claims, "eq_9", lambda weights, *given: eq_9(weights.T, *given))
    with pytest.raises(AssertionError, match="ran in a circle"):
        CHECKS["C15"](QUICK)
