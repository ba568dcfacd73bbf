"""The restricted cost matrix: the optimum of the full one, on every map; and each of its bounds matters."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, with_raster

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.cost_to_go.cost_matrix import Schedule, cost_matrix
from cgla_graph.errors import GraphError, SolverSettingError
from cgla_graph.model.lattice import LatticeKind
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.restricted import restricted
from cgla_graph.restricted import restricted_kernels as kernels
from cgla_graph.restricted.restricted import Restricted, restricted_optimum
from cgla_graph.restricted.tube import Tube
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.exact import cgla
from cgla_graph.testing.strategies import lattices, problems, seeds


def check(on: GraphProblem) -> Restricted | None:
    """Compare with the full matrix; return what was found."""
    full = cost_matrix(on.with_weights_held().graph, on.target)
    truth = full.value(on.source)
    found = restricted_optimum(on)
    if found is None:
        return None
    if math.isinf(truth):
        assert (math.isinf(found.cost), len(found.nodes)) == (True, 0)
        return found
    assert found.cost == pytest.approx(truth, rel=1e-12, abs=1e-15)
    nodes = [on.graph.labels[index] for index in found.nodes.tolist()]
    assert (nodes[0], nodes[-1]) == (on.source, on.target)
    assert on.evaluate(nodes) == pytest.approx(truth, rel=1e-12, abs=1e-15)
    # G along the optimum, and nowhere below the truth
    values = dict(zip(found.kept.tolist(), found.values.tolist(), strict=True))
    reached = [index for index in found.order.tolist() if math.isfinite(values[index])]
    assert all(values[index] >= full.values[index] * (1.0 - 1e-12) - 1e-15 for index in reached)
    assert (np.diff([values[index] for index in reached]) >= 0.0).all()
    return found


def random_problem(seed: int) -> cg.Problem:
    rng = np.random.default_rng(seed)
    threats, areas = int(rng.integers(0, 25)), int(rng.integers(0, 4)) // 2
    k = float(rng.choice([0.0, 1.0, 10.0, 100.0, 1000.0]))
    return random_scenario(seed, k=k, threats=threats, areas=areas).problem


@pytest.mark.slow
@examples(40)
@given(seeds, st.integers(12, 32), st.sampled_from(["closed", "upper", "lower", "centre"]))
def test_it_is_the_optimum_of_the_full_matrix(seed: int, side: int, kind: LatticeKind) -> None:
    problem = random_problem(seed)
    check(problem.on_lattice(cg.Lattice(side, bounds=problem.bounds, kind=kind)))


@examples(25)
@given(problems(), lattices(max_side=20, unit=True))
def test_on_small_and_oblong_lattices_too(problem: cg.Problem, lattice: cg.Lattice) -> None:
    check(problem.on_lattice(lattice))


@pytest.mark.slow
@pytest.mark.parametrize(("seed", "side"), [(0, 40), (1, 40), (2, restricted.FINE), (3, restricted.FINE)])
@pytest.mark.parametrize("whole", [0, restricted.WHOLE])
def test_where_the_first_path_is_found_by_sums_of_the_raster(
    seed: int, side: int, whole: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The full matrices of some problems take seconds: there, coarser lattices count as fine, and rasters as large."""
    monkeypatch.setattr(restricted, "FINE", side)
    monkeypatch.setattr(restricted, "WHOLE", whole)
    check(random_problem(seed).on_lattice(side))


@pytest.mark.slow
@examples(15)
@given(seeds, st.floats(1.0, 1.3))
def test_a_bad_first_path_only_takes_longer(seed: int, worse: float) -> None:
    problem = random_problem(seed)
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(restricted, "SLACK", worse - 1.0 + 1e-12)
        check(problem.on_lattice(25))


def test_threats_that_are_not_there_make_ties() -> None:
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0))
    for side in (2, 3, 30):
        found = check(problem.on_lattice(side))
        assert found is not None
        assert found.cost == pytest.approx(math.sqrt(2.0), rel=1e-12)


def test_bounds_of_the_lattice_beyond_those_of_the_problem() -> None:
    problem = cg.Problem(
        (0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, 0.2)]), k=50.0, bounds=(0, 0.2, 1, 0.8)
    )
    check(problem.on_lattice(cg.Lattice((30, 40), bounds=(-0.5, -0.5, 1.5, 1.5))))
    check(problem.on_lattice(cg.Lattice((30, 12), bounds=(0.2, 0.3, 0.8, 0.7))))


def test_a_goal_that_is_walled_in_has_no_path() -> None:
    ring = shapely.box(0.6, 0.6, 1.0, 1.0).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
    found = check(cg.Problem((0.1, 0.1), (0.8, 0.8), no_fly=ring).on_lattice(30))
    assert found is not None
    assert not len(found.nodes)


def test_a_slit_that_only_a_long_edge_passes() -> None:
    """Eight directions find no way; where the descent finds none either, all weights have to tell."""
    walls = [shapely.box(0.45, 0.0, 0.55, 0.7041), shapely.box(0.45, 0.7059, 0.55, 1.0)]
    check(cg.Problem((0.1, 0.7), (0.9, 0.71), no_fly=shapely.union_all(walls)).on_lattice(20))


def test_start_at_goal() -> None:
    on = cg.Problem((0.3, 0.3), (0.3, 0.3)).on_lattice(10)
    found = restricted_optimum(on)
    assert found is not None
    assert (found.cost, found.nodes.tolist()) == (0.0, [on.source])
    # two nodes at one place, the second before the first
    twice = cg.GeometricGraph.complete(cg.Lattice(3, bounds=(0, 0, 1, 1)), extra=[(0.5 + 1e-10, 0.5), (0.5, 0.5)])
    found = restricted_optimum(GraphProblem(twice, 9, 4))
    assert found is not None
    assert found.nodes.tolist() == [9, 4]


@pytest.mark.parametrize(
    "graph", [cg.GeometricGraph.complete([(0, 0), (1, 0)]), cg.GeometricGraph.from_matrix(np.eye(2))]
)
def test_other_graphs_are_refused(graph: cg.GeometricGraph) -> None:
    with pytest.raises(GraphError, match="only a complete lattice graph"):
        restricted_optimum(GraphProblem(graph, 0, 1))


# Each bound matters: one that is 2 % too high is found out


def differs(on: GraphProblem) -> bool:
    """Return whether the check fails."""
    try:
        check(on)
    except AssertionError:
        return True
    return False


def scaled_bounds(which: str) -> Callable[..., Any]:
    honest = Tube.bounds_at

    def bounds_at(self: Tube, points: Any, *, to_goal: bool) -> Any:  # noqa: ANN401 - as there
        least, most = honest(self, points, to_goal=to_goal)
        if which == "difference" and to_goal:
            return least, most / 1.02
        factor = 1.02 if to_goal == (which == "to the goal") else 1.0
        return factor * least, factor * most

    return bounds_at


@pytest.mark.slow
@pytest.mark.parametrize(
    "which",
    [
        "to the goal",
        "from the start",
        "difference",
        "raster",
        "margin",
        "margin on rasters",
        "primitive",
        "simpson",
        "tiles",
    ],
)
def test_a_bound_that_is_too_high_is_caught(which: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """
    Sums of values at nodes ("margin") are no bound: between them, a raster of risk may be lower.

    Tiles are left out wrongly where some nodes of the tube are missing.
    """
    # what is left out must not be the optimum that is known already
    monkeypatch.setattr(restricted, "SLACK", 0.001 if which == "from the start" else 0.03)
    if which in {"to the goal", "from the start", "difference"}:
        monkeypatch.setattr(Tube, "bounds_at", scaled_bounds(which))
    elif which == "tiles":
        count = restricted.Squares.sums
        some = lambda squares, _=None: count(squares, squares.columns % 16 < 12)  # noqa: E731 - short
        monkeypatch.setattr(restricted.Squares, "sums", some)
    elif which == "primitive":
        steps = kernels.coprime_steps
        monkeypatch.setattr(kernels, "coprime_steps", lambda *n: steps(*n) & (np.arange(n[0]) < 4)[:, None])
    else:
        honest = kernels.cost_rasters

        def cost_rasters(*arguments: Any) -> None:  # noqa: ANN401 - as there
            honest(*arguments)
            *_, plain, low, _ = arguments
            low[:] = 1.02 * (low if which == "raster" else plain)

        monkeypatch.setattr(kernels, "cost_rasters", cost_rasters)
    problems = map(random_problem, range(60))
    if which == "margin on rasters":
        problems = (with_raster(problem, seed) for seed, problem in enumerate(problems))
    assert any(differs(problem.on_lattice(24)) for problem in problems)


def excesses(problem: cg.Problem, side: int, *, exact: bool) -> FloatArray:
    """By how much Simpson's rule exceeds the weights of edges, as parts of them; `exact`: with the greatest error."""
    on = problem.on_lattice(side)
    search = restricted._Search(on)
    squares = restricted.Squares.of(np.ones((2 * side - 1, 2 * side - 1), dtype=np.bool_))
    _, low, _ = search._cost_rasters(squares)
    fourth = search._fourth_derivatives(squares) * exact
    found = []
    for i, j in np.random.default_rng(side).integers(0, side**2, (80, 2)).tolist():
        (x, y), (a, b) = (2 * (i % side), 2 * (i // side)), (2 * (j % side - i % side), 2 * (j // side - i // side))
        if (a, b) != (0, 0):
            length = math.dist(on.graph.positions[i], on.graph.positions[j])
            bound = kernels.simpson_sum(low, fourth, squares.blocks, squares.width, x, y, a, b, length, rough=False)
            found.append(bound / on.graph.weight(i, j) - 1.0)
    return np.array(found)


@examples(15)
@given(seeds, st.integers(20, 90))
def test_simpsons_rule_is_a_bound_with_its_greatest_error(seed: int, side: int) -> None:
    open_map = dataclasses.replace(random_problem(seed), no_fly=None)
    assert excesses(open_map, side, exact=True).max() <= 1e-12


def test_simpsons_rule_is_none_without_it() -> None:
    problems = (dataclasses.replace(random_problem(seed), no_fly=None) for seed in range(10))
    assert max(excesses(problem, 60, exact=False).max() for problem in problems) > 1e-3


# On rasters


@pytest.mark.slow
@examples(8)
@given(seeds, st.integers(12, 30))
def test_on_rasters_it_is_the_optimum_of_the_full_matrix(seed: int, side: int) -> None:
    check(with_raster(random_problem(seed), seed).on_lattice(side))


# In the solver


def test_cgla_takes_lattices_of_any_size(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_problem(7)
    full = cg.solve(problem, "cgla", resolution=30)
    monkeypatch.setattr(cgla, "FULL_UP_TO", 100)
    monkeypatch.setattr("cgla_graph.solvers.solving.FULL_UP_TO", 100)
    answer = cg.solve(problem, "cgla", resolution=30)
    assert (answer.status, answer.cost) == (cg.Status.OPTIMAL, pytest.approx(full.cost, rel=1e-12))
    assert "of 902 nodes kept" in answer.message
    assert answer.evaluations < full.evaluations // 20


def test_solvers_that_need_all_weights_say_what_that_would_take() -> None:
    answer = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9)), "dijkstra", resolution=200)
    assert answer.status is cg.Status.UNSUPPORTED
    assert "all weights of 40002 nodes, 12.8 GB" in answer.message


def test_what_cannot_be_bounded_is_not_weighed_by_the_billion(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cgla, "FULL_UP_TO", 100)
    monkeypatch.setattr("cgla_graph.model.weights.MOST_HELD", 100)
    monkeypatch.setattr("cgla_graph.solvers.solving.FULL_UP_TO", 100)
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1)])
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=1e15)
    answer = cg.solve(problem, "cgla", resolution=20)
    assert answer.status is cg.Status.UNSUPPORTED
    assert "k too great, or gaps too narrow" in answer.message
    for settings in ({"early_stop": False}, {"schedule": "synchronous", "early_stop": False}):
        answer = cg.solve(problem, "cgla", resolution=20, **settings)
        assert answer.status is cg.Status.UNSUPPORTED
        assert answer.message.startswith("it needs all weights of 402 nodes, 0.00129 GB")


@pytest.mark.parametrize("schedule", ["label-setting", "synchronous", "random"])
def test_a_cost_matrix_that_would_take_hours_is_refused(schedule: Schedule) -> None:
    on = cg.Problem((0.1, 0.1), (0.9, 0.9)).on_lattice(400)
    with pytest.raises(GraphError, match=r"all weights of 160002 nodes, 205 GB, .* cg.solve\(problem, 'cgla'\)"):
        cost_matrix(on.graph, on.target, schedule=schedule, seed=1 if schedule == "random" else None)
    with pytest.raises(GraphError, match="160002 nodes"):
        on.with_weights_held()


def test_fields_with_peaks_above_1_are_weighed_as_a_whole_where_that_can_be_afforded(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=1.5)], improper=True)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=1.0)
    full = cg.solve(problem, "cgla", resolution=30)
    for module in ("solvers.solving", "solvers.exact.cgla"):
        monkeypatch.setattr(f"cgla_graph.{module}.FULL_UP_TO", 100)
    answer = cg.solve(problem, "cgla", resolution=30)
    assert (answer.status, answer.cost, answer.nodes) == (cg.Status.OPTIMAL, full.cost, full.nodes)
    assert answer.evaluations == full.evaluations
    assert answer.message.endswith("all pairs were weighed, since peaks above 1 allow no bounds")
    refused = cg.solve(problem, "cgla", resolution=400)
    assert refused.status is cg.Status.UNSUPPORTED
    assert "all weights of 160002 nodes, 205 GB" in refused.message


@examples(8)
@given(seeds, st.integers(12, 30))
def test_as_a_cost_matrix_it_has_values_ways_and_delta_sets_of_what_was_kept(seed: int, side: int) -> None:
    on = random_problem(seed).on_lattice(side)
    found, full = restricted_optimum(on), cost_matrix(on.with_weights_held().graph, on.target, source=on.source)
    if found is None:
        return
    matrix = found.matrix(on)
    assert matrix.value(on.source) == pytest.approx(full.value(on.source), rel=1e-12)
    assert matrix.path_from(on.source) == [on.graph.labels[index] for index in found.nodes.tolist()]
    for node, delta in zip(matrix.order.tolist(), matrix.delta_sets, strict=True):
        assert node in delta
        assert set(matrix.values[delta]) == {matrix.values[node]}
    # of those that served in both, no value is below that of the full matrix
    both = np.intersect1d(matrix.order, full.order)
    assert (matrix.values[both] >= full.values[both] * (1.0 - 1e-12)).all()
    with pytest.raises(GraphError, match="no history"):
        matrix.history()


@examples(8)
@given(seeds, st.integers(12, 30), st.sampled_from([1e-9, 1e-3, 5e-3, 0.02]))
def test_whenever_the_time_is_up_the_optimum_lies_between_the_bound_and_the_path(
    seed: int, side: int, seconds: float
) -> None:
    on = random_problem(seed).on_lattice(side)
    truth = cost_matrix(on.with_weights_held().graph, on.target).value(on.source)
    found = restricted_optimum(on, seconds=seconds)
    if found is None:
        return
    if found.is_optimum:
        assert found.cost == pytest.approx(truth, rel=1e-12, abs=1e-15)
    else:
        assert found.bound <= truth * (1.0 + 1e-12) <= found.cost * (1.0 + 3e-12)
        assert found.bound > 0.0
    assert math.isinf(found.cost) == (not len(found.nodes))


def test_a_time_limit_ends_with_the_best_path_and_its_gap_and_no_claim(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(cgla, "FULL_UP_TO", 500)
    monkeypatch.setattr("cgla_graph.solvers.solving.FULL_UP_TO", 500)
    problem = random_scenario(3).problem
    best = cg.solve(problem, "cgla", resolution=40)
    answer = cg.solve(problem.on_lattice(40), cgla.Cgla(time_limit=1e-9))
    assert (best.status, answer.status) == (cg.Status.OPTIMAL, cg.Status.FOUND)
    assert 0.0 < answer.lower_bound <= best.cost <= answer.cost
    gap = answer.cost / answer.lower_bound - 1.0
    assert answer.message == f"stopped at the time limit, on a path at most {gap:.2g} above the optimum"
    # of the plane, which has more paths than the lattice, nothing is proven
    in_plane = cg.solve(problem, cgla.Cgla(time_limit=1e-9), resolution=40)
    assert (in_plane.message, math.isnan(in_plane.lower_bound)) == (answer.message, True)
    for wrong in (0, -1.0, math.nan, "1"):
        with pytest.raises(SolverSettingError, match="time_limit"):
            cgla.Cgla(time_limit=wrong)  # type: ignore[arg-type] # what users do
