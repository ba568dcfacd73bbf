"""The hybrid solver: never worse than any lattice, the right way around, and a bound that holds."""

import dataclasses
import time
from typing import Any

import numpy as np
import oracles
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.errors import ProblemError
from cgla_graph.model.solution import TracePoint
from cgla_graph.refine.refine import refine_path
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import shipped
from cgla_graph.solvers.checks import check_solver
from cgla_graph.solvers.continuous import hybrid, hybrid_raster, hybrid_roadmap
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.testing.strategies import polygons

QUICK = Hybrid(tolerance=None)


def random_map(seed: int) -> cg.Problem:
    """Draw up to 20 threats and a risk weight from 1 to 1000."""
    rng = np.random.default_rng(seed)
    threats = [
        cg.Threat(*rng.random(2), spread=rng.uniform(0.03, 0.1), peak=rng.uniform(0.05, 1.0))
        for _ in range(rng.integers(1, 21))
    ]
    return cg.Problem((0.05, 0.05), (0.95, 0.95), cg.RiskField(threats), 10.0 ** rng.uniform(0.0, 3.0))


def visibility_optimum(problem: cg.Problem) -> float:
    """Return the shortest way without risk: over the visibility graph of all corners; infinite if there is none."""
    corners = shapely.get_coordinates(problem.model.area.geometry)
    x_min, y_min, x_max, y_max = problem.bounds
    kept = (corners >= (x_min, y_min)).all(axis=1) & (corners <= (x_max, y_max)).all(axis=1)
    return oracles.shortest_around(problem.start, problem.goal, corners[kept], problem.model.area.crosses)


# How good it is


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_on_shipped_scenarios_no_lattice_solver_is_better(name: str) -> None:
    scenario = cg.load_scenario(name)
    best = cg.solve(scenario.problem, QUICK)
    assert best.status is cg.Status.FOUND
    lattice, eight = (
        cg.solve(scenario.problem, other, resolution=scenario.lattice) for other in ("cgla", "eight-direction")
    )
    assert best.cost <= min(lattice.cost, eight.cost)
    assert best.cost <= refine_path(scenario.problem, lattice.path).cost * 1.001


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(8))
def test_on_random_maps_a_refined_complete_graph_is_hardly_better(seed: int) -> None:
    problem = random_map(seed)
    refined = cg.solve(problem, "cgla", resolution=25, refine=True)
    assert cg.solve(problem, QUICK).cost <= refined.cost * 1.001


@pytest.mark.slow
def test_it_takes_more_than_the_best_guess_of_the_lattice() -> None:
    """A coarse lattice's best path is not always the one that refines best: one candidate is too few."""
    gains = []
    for seed in range(12):
        problem = random_map(seed)
        one, many = (cg.solve(problem, Hybrid(points=100, candidates=n, tolerance=None)).cost for n in (1, 12))
        # of two candidates of one kind, either may refine a little better: it ends at gains below 1e-5
        assert many <= one * (1.0 + 1e-5)
        gains.append(one / many - 1.0)
    assert max(gains) > 1e-3


@st.composite
def walled_maps(draw: st.DrawFn) -> cg.Problem:
    """Draw boxes and triangles, straight or askew, between two corners of the map."""
    area = draw(polygons())
    if draw(st.booleans()):
        area = shapely.affinity.rotate(area, draw(st.floats(0.0, 360.0)), origin=(2.0, 2.0))
    return cg.Problem((-0.9, -0.9), (4.9, 4.9), bounds=(-1, -1, 5, 5), no_fly=area)


@given(walled_maps())
@examples(40)
def test_without_risk_it_is_the_shortest_way_around(problem: cg.Problem) -> None:
    assert cg.solve(problem, QUICK).cost == pytest.approx(visibility_optimum(problem), rel=1e-9)


@pytest.mark.parametrize("seed", range(4))
def test_in_mazes_it_finds_the_way(seed: int) -> None:
    """Walls with slits far below the lattice's spacing: only the corners know the way."""
    rng = np.random.default_rng(seed)
    walls = []
    for x in np.linspace(0.1, 0.9, 9):
        slit = rng.uniform(0.1, 0.9)
        walls += [shapely.box(x, -0.1, x + 0.02, slit), shapely.box(x, slit + 1e-4, x + 0.02, 1.1)]
    problem = cg.Problem((0.05, 0.5), (0.95, 0.5), no_fly=shapely.MultiPolygon(walls))
    found = cg.solve(problem, QUICK)
    assert found.status is cg.Status.FOUND
    assert found.cost == pytest.approx(visibility_optimum(problem), rel=1e-6)


def test_cells_that_touch_at_a_corner_leave_a_way_through_it() -> None:
    cells = shapely.MultiPolygon([shapely.box(0, 0, 0.5, 0.5), shapely.box(0.5, 0.5, 1, 1)])
    problem = cg.Problem((0.1, 0.9), (0.9, 0.1), no_fly=cells)
    found = cg.solve(problem, QUICK)
    assert found.cost == pytest.approx(np.hypot(0.8, 0.8), rel=1e-12)


@pytest.mark.slow
def test_a_map_of_a_thousand_corners(tmp_path: Any) -> None:  # noqa: ANN401 - pytest's
    """A grid map of 128 x 128 cells with a fifth of 4 x 4 blocks taken: about the mark of eight-direction's path."""
    rng = np.random.default_rng(0)
    blocked = np.kron(rng.random((32, 32)) < 0.2, np.ones((4, 4), dtype=bool))
    rows = ["".join("@" if cell else "." for cell in row) for row in blocked]
    file = tmp_path / "blocks.map"
    file.write_text("\n".join(["type octile", "height 128", "width 128", "map", *rows]) + "\n")
    (scenario,) = open_scenarios(str(file))
    found = cg.solve(scenario.problem, QUICK)
    assert found.status is cg.Status.FOUND
    assert found.cost <= cg.solve(scenario.problem, "eight-direction", **scenario.settings["eight-direction"]).cost
    assert found.cost <= visibility_optimum(scenario.problem) * 1.001


# The parts


def test_the_roadmap_weighs_every_direction_once() -> None:
    problem = random_map(1)
    roadmap = hybrid_roadmap.lay(problem, 100, 3)
    assert roadmap.positions[:2].tolist() == [list(problem.start), list(problem.goal)]
    heads = roadmap.heads
    tails = np.repeat(np.arange(len(roadmap.positions)), np.diff(roadmap.starts))
    exact = problem.model.weights(roadmap.positions[tails], roadmap.positions[heads])
    assert roadmap.costs == pytest.approx(exact, rel=1e-12)
    assert len(set(zip(tails.tolist(), heads.tolist(), strict=True))) == len(heads) == 2 * roadmap.evaluations
    middle = 2 + 5 * 10 + 5
    steps = np.rint((roadmap.positions[heads[tails == middle]] - roadmap.positions[middle]) * 9).astype(int)
    directions = {(int(x), int(y)) for x, y in steps if max(abs(x), abs(y)) <= 3}
    coprime = {(x, y) for x in range(-3, 4) for y in range(-3, 4) if np.gcd(x, y) == 1}
    assert directions == coprime
    assert len(coprime) == 32


def test_candidates_pass_the_threat_on_both_sides() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.505, 0.1)]), k=20.0)
    search = hybrid._Search(problem, QUICK)
    guesses = search._candidates(hybrid_roadmap.lay(problem, 400, 3))
    above = [bool(np.interp(0.5, *guess.T) > 0.505) for guess in guesses]
    assert above[0] is False
    assert True in above


# What it promises


def test_no_grid_is_larger_than_it_may_be(monkeypatch: pytest.MonkeyPatch) -> None:
    grids: list[tuple[int, int]] = []

    def none(_: cg.Problem, last: tuple[int, int]) -> Any:  # noqa: ANN401 - never returns
        grids.append(last)
        raise ZeroDivisionError

    monkeypatch.setattr(hybrid, "marched", none)
    for problem in (random_map(1), cg.load_scenario("fifty-threats").problem):
        with pytest.raises(ZeroDivisionError):
            Hybrid(points=10**6).solve(problem)
    assert max(columns * rows for columns, rows in grids) <= 1.01 * hybrid_raster.MOST_NODES


def test_it_is_the_default() -> None:
    problem = random_map(2)
    assert cg.solve(problem, tolerance=None).solver == "hybrid"
    chain = cg.GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]])
    assert cg.solve(cg.GraphProblem(chain, 0, 2)).solver == "cgla"


@pytest.mark.slow
def test_the_certificate_is_reported_and_not_timed(monkeypatch: pytest.MonkeyPatch) -> None:
    asked, late, clock = [], [0.0], time.perf_counter

    def slow(problem: cg.Problem, path: FloatArray, tolerance: float) -> tuple[Certificate, float]:
        asked.append((tolerance, problem.evaluate(path).cost))
        late.append(1000.0)
        return Certificate(1.2, asked[-1][1], tolerance, 0.1, 1, "made up", 1000.0), 0.0

    monkeypatch.setattr(time, "perf_counter", lambda: clock() + sum(late))
    monkeypatch.setattr(hybrid, "improved", slow)
    problem = random_map(3)
    found = cg.solve(problem, "hybrid", tolerance=0.05)
    # (kernels are warmed up on a small map before)
    assert asked[-1] == (0.05, found.cost)
    assert found.lower_bound == 1.2
    assert found.certificate_seconds == 1000.0
    assert found.seconds < 900.0
    assert np.isnan(cg.solve(problem, QUICK).lower_bound)


def test_a_better_path_that_the_proof_finds_is_the_answer(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = random_map(3)
    best = cg.solve(problem, "hybrid", tolerance=None)
    detour = np.array([problem.start, (0.99, 0.01), problem.goal])
    cost = problem.evaluate(detour).cost
    worse = dataclasses.replace(best, path=detour, cost=cost, trace=(TracePoint(0.0, 1, cost),))
    monkeypatch.setattr(hybrid._Search, "run", lambda _: worse)
    found = cg.solve(problem, "hybrid", tolerance=0.01)
    assert found.cost == pytest.approx(best.cost, rel=1e-3)
    assert found.message.endswith("; the proof found a better path")
    assert found.gap <= 0.01
    # the proof counts up to there, and not after
    assert [moment.cost for moment in found.trace] == [cost, found.cost]
    assert 0.0 < found.trace[-1].seconds <= found.seconds
    assert found.certificate_seconds > 0.0


def test_the_trace_falls_to_the_cost_and_ends_within_the_time() -> None:
    found = cg.solve(random_map(5), QUICK)
    costs = [moment.cost for moment in found.trace]
    assert len(costs) >= 3
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] == pytest.approx(found.cost, rel=1e-12)
    assert found.trace[-1].seconds <= found.seconds
    assert found.trace[-1].evaluations <= found.evaluations


@pytest.mark.slow
def test_odd_maps() -> None:
    """Long and thin, far from the origin, huge, with ends on the border: the contract's checks hold at any setting."""
    check_solver(Hybrid(points=30, radius=1, candidates=1, tolerance=None))
    thin = cg.Problem((0.0, 0.0), (1e5, 10.0), cg.RiskField([cg.Threat(5e4, 5.0, 3.0)]), 1.0, bounds=(0, 0, 1e5, 10.0))
    found = cg.solve(thin, QUICK)
    assert found.cost == pytest.approx(refine_path(thin, found.path).cost, rel=1e-4)
    assert found.cost <= cg.solve(thin, "straight-line").cost


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_corridors_a_cell_wide_are_found(interpolation: Any) -> None:  # noqa: ANN401 - one of two words
    """A way that winds between walls, on a raster whose cells the roadmap's lattice misses."""
    side, rows = 90, range(1, 89, 8)
    values = np.full((side, side), 1000.0)
    way: list[tuple[float, float]] = []
    for number, row in enumerate(rows):
        values[row, 1 : side - 1] = 0.0
        ends = [1, side - 2] if number % 2 == 0 else [side - 2, 1]
        way += [(column + 0.5, row + 0.5) for column in ends]
        if number + 1 < len(rows):
            values[row : row + 8, ends[1]] = 0.0
    box = (0.0, 0.0, float(side), float(side))
    field = cg.RiskField(rasters=[cg.RasterRisk(values, box, origin="lower", interpolation=interpolation)])
    problem = cg.Problem(way[0], way[-1], field, k=1.0, bounds=box)
    along = problem.evaluate(way)
    assert along.risk == 0.0
    found = cg.solve(problem, "hybrid", tolerance=None)
    assert found.cost <= along.cost
    assert found.length > 0.9 * along.length


@pytest.mark.parametrize("side", [1e-70, 3e-66, 1e69, 1e70])
def test_maps_of_the_least_and_the_greatest_size_are_solved(side: float) -> None:
    """Beyond them, which is refused, squares of steps would vanish or overflow in the marching of fronts."""
    field = cg.RiskField([cg.Threat(0.5 * side, 0.5 * side, min(max(0.2 * side, 1e-70), 1e70))])
    wall = shapely.box(0.2 * side, 0.2 * side, 0.4 * side, 0.3 * side)
    problem = cg.Problem((0, 0), (side, side), field, k=10.0, bounds=(0, 0, side, side), no_fly=wall)
    answer = Hybrid().solve(problem)
    assert answer.status is cg.Status.FOUND
    assert answer.gap < 0.02
    wider = side * 1e70 if side > 1.0 else side * 1e-70
    with pytest.raises(ProblemError, match="bounds have sides"):
        cg.Problem((0, 0), (0, 0), bounds=(0, 0, side, wider))
