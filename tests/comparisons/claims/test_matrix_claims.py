"""The claims about the cost matrix and its paths: their answers, and that broken ones end the check."""

import dataclasses
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.paper import matrix_claims, path_claims
from cgla_graph.comparisons.claims.paper.path_claims import _all_costs, _best_paths, _tied_but_unique
from cgla_graph.comparisons.claims.paper.random_graphs import least_costs
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.solvers import solve

QUICK = Evidence(Scale(quick=True))
CHECKS = {claim.id: claim.check for claim in catalogue.claims().values()}


@pytest.fixture(autouse=True)
def _few_kinds(monkeypatch: pytest.MonkeyPatch) -> None:
    """Take maps of one kind where a check goes through all kinds."""
    maps = Evidence.maps
    monkeypatch.setattr(Evidence, "maps", lambda self, each: maps(self, each)[:each])


@pytest.mark.parametrize(
    ("claim", "expected"),
    [
        ("C8", "holds holds holds"),
        ("C11", "depends fails"),
        ("C12", "holds"),
        ("C13", "holds depends"),
        ("C24", "depends depends"),
        ("C14", "depends"),
        ("C15", "holds"),
        ("C16", "fails"),
    ],
)
def test_answers(claim: str, expected: str) -> None:
    found = CHECKS[claim](QUICK)
    assert " ".join(row.answer.label for row in found.rows) == expected
    assert set(found.counterexamples) <= set(counterexamples.names())
    for row in found.rows:
        assert row.where or row.answer is not Answer.DEPENDS
        assert row.why


def test_dynamic_programming_flies_as_cgla_on_each_map_and_tick() -> None:
    # three flights on one map
    assert matrix_claims._flown_alike(QUICK) == "3 of 3"


def test_random_choices_of_pivots_need_many_times_as_many() -> None:
    size, wrong = matrix_claims._random_pivots(QUICK)
    least, _, greatest = size.removeprefix("random: ").split()[:3]
    assert 4.0 < float(least) <= float(greatest) < 40.0
    assert 0.4 < wrong < 1.0


def _changed(change: Callable[[CostMatrix], Any]) -> Callable[..., CostMatrix]:
    """Compute a cost matrix, and change it."""

    def broken(*args: Any, **kwargs: Any) -> CostMatrix:  # noqa: ANN401 - as `cost_matrix`
        matrix = cost_matrix(*args, **kwargs)
        return dataclasses.replace(matrix, **change(matrix))

    return broken


@pytest.mark.parametrize(
    ("claim", "change", "message"),
    [
        ("C8", lambda matrix: {"values": matrix.values * (1.0 + 1e-6)}, "not the paper's"),
        ("C8", lambda matrix: {"order": matrix.order[::-1]}, "Delta_0"),
        ("C11", lambda matrix: {"values": matrix.values * (1.0 - 1e-9)}, "not scipy's Dijkstra"),
        ("C11", lambda matrix: {"order": matrix.order[::-1]}, "not in Delta_k"),
        ("C11", lambda matrix: {"rounds": matrix.rounds + 1}, "settled no node"),
        ("C12", lambda matrix: {"values": matrix.values * matrix.rounds}, "another value at the source"),
        ("C13", lambda matrix: {"values": matrix.values + 1e-9 * (matrix.values > 0)}, "n rounds are not enough"),
        ("C15", lambda matrix: {"successors": np.where(matrix.successors < 0, -1, 0)}, "cycle|elsewhere"),
        ("C24", lambda matrix: {"values": matrix.values + (matrix.schedule == "synchronous")}, "differ"),
    ],
)
def test_a_broken_matrix_ends_the_check(
    claim: str, change: Callable[[CostMatrix], Any], message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    for module in (matrix_claims, path_claims):
        monkeypatch.setattr(module, "cost_matrix", _changed(change))
    monkeypatch.setattr(matrix_claims, "_flown_alike", lambda _: "")
    with pytest.raises((AssertionError, ValueError), match=message):
        CHECKS[claim](QUICK)


@pytest.mark.parametrize(
    ("claim", "name", "edge", "weight", "message"),
    [
        ("C11", "theorem-1-proof.json", (0, 2), 30, "no value falls"),
        ("C11", "theorem-1-proof.json", (1, 2), 0.5, "round 2 of the stored graph changes a value"),
        ("C11", "theorem-1-proof.json", (3, 4), 50, "reaches t"),
        ("C13", "zero-weights.json", (0, 1), 0.5, "runs in no circle"),
        ("C15", "against-the-direction.json", (0, 1), 2.5, "runs in no circle"),
    ],
)
def test_a_stored_graph_that_shows_nothing_is_noticed(
    claim: str, name: str, edge: tuple[int, int], weight: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    document = counterexamples.document

    def changed(asked: str) -> dict[str, Any]:
        read = document(asked)
        if asked == name:
            read["weights"][edge[0]][edge[1]] = read["weights"][edge[1]][edge[0]] = weight
        return read

    monkeypatch.setattr(counterexamples, "document", changed)
    with pytest.raises(AssertionError, match=message):
        CHECKS[claim](Evidence(Scale(maps=1)))


@pytest.mark.parametrize(("claim", "name"), [("C11", matrix_claims.MAP), ("C13", "printed-peaks.toml")])
def test_a_stored_map_that_shows_nothing_is_noticed(claim: str, name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """Without threats the straight line is best, so that no node is needed and no weight is below 0."""
    scenario = counterexamples.scenario

    def emptied(asked: str) -> Any:  # noqa: ANN401 - a scenario
        read = scenario(asked)
        assert asked == name
        return dataclasses.replace(read, problem=dataclasses.replace(read.problem, field=None))

    monkeypatch.setattr(counterexamples, "scenario", emptied)
    with pytest.raises(AssertionError, match=r"no value falls|G stops falling"):
        CHECKS[claim](Evidence(Scale(maps=1)))


def test_flights_that_differ_are_noticed(monkeypatch: pytest.MonkeyPatch) -> None:
    alike = matrix_claims._are_alike

    def moved(first: Any, second: Any) -> bool:  # noqa: ANN401 - flights
        return alike(first, dataclasses.replace(second, trace=second.trace + 1e-9))

    monkeypatch.setattr(matrix_claims, "_are_alike", moved)
    assert matrix_claims._flown_alike(QUICK) == "0 of 3"
    with pytest.raises(AssertionError, match="the stored flights differ"):
        CHECKS["C24"](QUICK)


@pytest.mark.parametrize(("factor", "message"), [(1.01, "below the least cost"), (-1.0, "is below 0")])
def test_a_least_cost_that_g_goes_below_is_noticed(
    factor: float, message: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(matrix_claims, "least_costs", lambda *given: least_costs(*given) * factor)
    with pytest.raises(AssertionError, match=message):
        CHECKS["C8"](QUICK)


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
