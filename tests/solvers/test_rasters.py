"""Risk on rasters through every solver: it is seen, or said not to be."""

import pickle
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import cgla_graph as cg
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import NO_RASTERS, StepByStep
from cgla_graph.solvers import registry

#: Small budgets, and lattices fine enough to see a block.
QUICK: dict[str, dict[str, Any]] = {
    "hybrid": {"tolerance": 0.1},
    "rrt-star": {"iterations": 600},
    "informed-rrt-star": {"iterations": 600},
    "sorrt-star": {"iterations": 600},
    "bit-star": {"iterations": 4000},
    "fmt-star": {"samples": 500},
    "bfmt-star": {"samples": 500},
    "prm-star": {"milestones": 500},
    "ompl-prm-star": {"milestones": 500},
}
#: Those that promise no good path: one is blind to all risk, the others go by rules of their own.
NO_PROMISE = {"straight-line", "potential-field", "a2d-style"}
SEEING = [name for name in registry.names() if registry.traits(name).rasters]
BLIND = [name for name in registry.names(installed=False) if not registry.traits(name).rasters]


def block(interpolation: Any, *threats: cg.Threat, scale: float = 1.0) -> cg.Problem:  # noqa: ANN401 - a word
    """Put a risky block between start and goal, on a map as wide as said."""
    values = np.zeros((15, 15))
    values[5:10, 5:10] = 4.0 / scale
    raster = cg.RasterRisk(values, (0, 0, scale, scale), interpolation=interpolation)
    moved = [cg.Threat(scale * t.x, scale * t.y, scale * t.spread, t.peak / scale) for t in threats]
    ends = (0.1 * scale, 0.55 * scale), (0.9 * scale, 0.52 * scale)
    return cg.Problem(*ends, cg.RiskField(moved, rasters=[raster]), k=10.0, bounds=(0, 0, scale, scale))


def of(name: str, problem: cg.Problem) -> Solution:
    return cg.solve(problem, name, resolution=20, **QUICK.get(name, {}))


@pytest.mark.parametrize("name", SEEING)
@pytest.mark.parametrize(
    ("interpolation", "threats"),
    [
        ("nearest", ()),
        pytest.param("bilinear", (), marks=pytest.mark.slow),
        pytest.param("nearest", (cg.Threat(0.5, 0.8, 0.05),), marks=pytest.mark.slow),
        pytest.param("bilinear", (cg.Threat(0.5, 0.8, 0.05),), marks=pytest.mark.slow),
    ],
)
def test_a_block_is_seen(name: str, interpolation: str, threats: tuple[cg.Threat, ...]) -> None:
    problem = block(interpolation, *threats)
    answer = of(name, problem)
    straight = problem.evaluate([problem.start, problem.goal]).cost
    assert straight > 10.0
    if name in NO_PROMISE:
        assert answer.status in {Status.FOUND, Status.STUCK}
        return
    assert answer.status in {Status.OPTIMAL, Status.FOUND}, answer.message
    assert answer.cost == pytest.approx(problem.evaluate(answer.path).cost, rel=1e-12)
    # around the block there is no risk, but what a lattice's edges cut off its corners
    assert answer.cost < 0.25 * straight
    # the way around the block's corners, if it is interpolated, can be no shorter than this
    assert answer.cost > 0.8


@pytest.mark.parametrize("name", BLIND)
def test_who_goes_by_threats_says_so(name: str) -> None:
    for problem in (block("bilinear"), block("nearest", cg.Threat(0.5, 0.8, 0.05))):
        answer = of(name, problem)
        assert (answer.status, answer.message, answer.solver) == (Status.UNSUPPORTED, NO_RASTERS, name)
        assert np.isinf(answer.cost)
        # nor does it as the base of another
        refined = cg.solve(problem, "refine", base=name)
        assert (refined.status, refined.message) == (Status.UNSUPPORTED, NO_RASTERS)
        for plan in (cg.pareto(problem, solver=name), cg.plan_within_length(problem, 1.5, solver=name)):
            assert (plan.status, plan.message) == (Status.UNSUPPORTED, NO_RASTERS)
    assert cg.solve(cg.Problem((0, 0), (1, 1)), name).status is Status.FOUND


@pytest.mark.parametrize("name", BLIND)
def test_step_by_step_it_says_so_too(name: str) -> None:
    solver = registry.get(name)
    if isinstance(solver, StepByStep):
        problem = block("nearest")
        move = solver.move(problem, None, 0.02)
        assert (move.stuck, move.path.tolist()) == (NO_RASTERS, [list(problem.start)])


def test_in_missions_it_is_stuck_at_once() -> None:
    problem = block("bilinear")
    uav = cg.Uav("A", problem.start, problem.goal, detection_radius=0.2, k=10.0)
    flight = cg.Mission(cg.World(problem.field), [uav], cg.solvers.get("bendy-ruler")).fly()
    assert NO_RASTERS in flight.uavs["A"].message


def test_the_manual_names_them() -> None:
    text = (Path(__file__).parents[2] / "docs" / "solvers.md").read_text("utf-8")
    sentence = re.search(r"\*\*Risk on rasters\*\*: all solvers support it except (.*?), which", text, re.DOTALL)
    assert sentence
    assert sorted(re.findall(r"`([\w-]+)`", sentence[1])) == sorted(BLIND)
    for name in registry.names(installed=False):
        assert ("no rasters" in registry.describe(name)["promises"]) == (name in BLIND)


def test_a_threshold_of_risk_rises_as_far_as_the_raster_does() -> None:
    """A ridge from border to border, far above what threats can be: it has to be crossed."""
    values = np.zeros((10, 10))
    values[:, 4:6] = 7.0
    ridge = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 1, 1))])
    answer = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), ridge, k=1.0), "a2d-style")
    assert answer.status is Status.FOUND, answer.message


@pytest.mark.slow
@pytest.mark.ompl
def test_bit_star_ends_where_its_bounds_are_the_costs_of_huge_risk() -> None:
    """Its bounds keep away from the costs by more than their rounding, which grows with the greatest risk."""
    pytest.importorskip("ompl")
    for scale in (1e-6, 1.0, 1e6):
        problem = block("nearest", scale=scale)
        answer = of("bit-star", problem)
        assert answer.status is Status.FOUND
        assert answer.cost < 1.3 * scale


def test_a_field_with_a_large_raster_is_sent_at_little_cost() -> None:
    values = np.random.default_rng(1).random((1000, 1000))
    field = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 1, 1))])
    field.density((0.5, 0.5))
    sent = pickle.dumps(field, pickle.HIGHEST_PROTOCOL)
    assert len(sent) < 2.1 * values.nbytes
    assert pickle.loads(sent) == field  # noqa: S301 - our own


# Trade-offs


@pytest.mark.slow
@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_every_trade_off_sees_the_raster(interpolation: str) -> None:
    problem = block(interpolation)
    front = list(cg.pareto(problem, solver="cgla", resolution=15))
    assert len(front) > 1
    assert front[0].risk > front[-1].risk
    assert front[0].length < front[-1].length
    assert front[-1].risk < 0.2 * front[0].risk
    middle = 0.5 * (front[0].risk + front[-1].risk)
    plan = cg.plan_within_risk(problem, middle, solver="cgla", resolution=15)
    assert plan.solution.risk <= middle
    assert plan.solution.risk == pytest.approx(problem.evaluate(plan.solution.path).risk, rel=1e-9, abs=1e-12)
    longest = 0.5 * (front[0].length + front[-1].length)
    plan = cg.plan_within_length(problem, longest, solver="cgla", resolution=15)
    assert plan.solution.length <= longest
    assert plan.solution.risk < front[0].risk
    hybrid = cg.plan_within_risk(problem, middle)
    assert hybrid.solution.risk <= middle
    assert hybrid.solution.length < front[-1].length
