"""The planner in the style of BCV: the votes of the behaviours, the places of virtual goals, and dead ends."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import usual

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.reactive.bcv_style import BcvMemory, BcvStyle, _votes, _with_target
from cgla_graph.solvers.reactive.step_by_step import Surroundings
from cgla_graph.testing.strategies import problems


def seen_by(problem: cg.Problem) -> tuple[Surroundings, BcvMemory]:
    around = Surroundings(problem, 0.02)
    return around, BcvStyle().begin(around)


def score(problem: cg.Problem, here: Point, heading: float, before: float, target: Point, aversion: float) -> float:
    """Score one heading, term by term, from the words of the docstring (on a unit square)."""
    total = math.cos(heading - math.atan2(target[1] - here[1], target[0] - here[0])) + 0.2 * math.cos(heading - before)
    for threat in problem.field.threats:
        reach = 3.0 * threat.spread + 0.04
        distance = math.dist(here, (threat.x, threat.y))
        if 0.0 < distance < reach:
            away = math.atan2(here[1] - threat.y, here[0] - threat.x)
            total += ((reach - distance) / reach) ** 2 * math.cos(heading - away)
    look = max(min(0.1, math.dist(here, target)), 0.02)
    ray = [
        (here[0] + look * i / 10 * math.cos(heading), here[1] + look * i / 10 * math.sin(heading)) for i in range(1, 11)
    ]
    return total - aversion * float(problem.field.density(ray).mean())


@usual
@given(problems(areas=False), st.integers(-40, 40), st.floats(-3.0, 3.0), st.sampled_from([0.0, 5.0]))
def test_it_takes_the_heading_with_the_best_score(
    problem: cg.Problem, turns: int, first: float, aversion: float
) -> None:
    here = problem.start
    assume(min(here) > 0.03 and max(here) < 0.97 and math.dist(here, problem.goal) > 0.001)
    around = Surroundings(problem, 0.02)
    memory = BcvMemory(here, first=first, turns=turns)
    target = _with_target(around, memory).virtual or problem.goal
    after = BcvStyle(risk_aversion=aversion).choose(around, memory)
    scores = {
        k: score(problem, here, memory.heading + k * math.pi / 16, memory.heading, target, aversion)
        for k in range(-8, 9)
    }
    assert scores[after.turns - turns] == pytest.approx(max(scores.values()), abs=1e-9)
    step = 0.02 * math.cos(after.heading), 0.02 * math.sin(after.heading)
    assert np.subtract(after.position, here) == pytest.approx(step, abs=1e-12)


def test_behaviours_weigh_as_the_specification_says() -> None:
    """Half-way into a threat's reach of 0.1, avoiding counts for a quarter; at its centre, it knows no direction."""
    field = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.02)])
    around, memory = seen_by(cg.Problem((0.45, 0.5), (0.9, 0.5), field))
    east, west = _votes(around, memory, np.array([0.0, math.pi]), 3.0)
    assert (east, west) == pytest.approx((1.0 + 0.2 - 0.25, -1.0 - 0.2 + 0.25))
    around, memory = seen_by(cg.Problem((0.5, 0.5), (0.9, 0.5), field))
    assert _votes(around, memory, np.array([0.0]), 3.0)[0] == pytest.approx(1.2)


@usual
@given(problems())
def test_its_steps_may_be_flown_and_turn_on_a_grid_of_headings(problem: cg.Problem) -> None:
    answer = cg.solve(problem, "bcv-style", max_steps=400)
    assert answer.status in {cg.Status.OPTIMAL, cg.Status.FOUND, cg.Status.STUCK}, answer.message
    if answer.status is cg.Status.FOUND:
        steps = np.diff(answer.path, axis=0)[:-1]
        assert np.hypot(*steps.T) == pytest.approx(0.02, rel=1e-9)
        first = math.atan2(*np.subtract(problem.goal, problem.start)[::-1])
        turns = (np.arctan2(steps[:, 1], steps[:, 0]) - first) / (math.pi / 16)
        assert turns == pytest.approx(np.round(turns), abs=1e-6)


def test_a_blocked_goal_makes_a_virtual_one_at_the_least_free_angle() -> None:
    """Past a wall of 0.2 to either side, 0.08 ahead, no ray of 0.2 goes at less than 66 degrees."""
    problem = cg.Problem((0.4, 0.5), (0.9, 0.5), no_fly=shapely.box(0.48, 0.3, 0.52, 0.7))
    around, memory = seen_by(problem)
    after = _with_target(around, memory)
    angle = math.radians(90)
    assert after.virtual == pytest.approx((0.4 + 0.2 * math.cos(angle), 0.5 + 0.2 * math.sin(angle)))
    assert after.hit == pytest.approx(0.5)
    shorter = cg.Problem((0.4, 0.5), (0.9, 0.5), no_fly=shapely.box(0.5, 0.45, 0.52, 0.55))
    angle = math.radians(30)
    assert _with_target(*seen_by(shorter)).virtual == pytest.approx(
        (0.4 + 0.2 * math.cos(angle), 0.5 + 0.2 * math.sin(angle))
    )


def test_of_two_sides_it_takes_the_one_that_needs_less_turning_in_total() -> None:
    problem = cg.Problem((0.4, 0.5), (0.9, 0.5), no_fly=shapely.box(0.5, 0.45, 0.52, 0.55))
    around, memory = seen_by(problem)
    circle = 2.0 * math.pi
    for first, side in ((0.0, 1.0), (0.2, 1.0), (-0.2, -1.0), (circle - 0.2, 1.0), (0.2 - circle, -1.0)):
        # headed for the goal now, but on another heading at the start, the last two by way of a full circle
        turned = replace(memory, first=first, turns=-round(first / (math.pi / 16)))
        virtual = _with_target(around, turned).virtual
        assert virtual is not None
        assert math.copysign(1.0, virtual[1] - 0.5) == side, first


def test_risk_above_a_half_blocks_the_goal_and_less_does_not() -> None:
    for peak, blocked in ((0.49, False), (0.51, True)):
        # on a sample of the ray: 0.15 * 6 / 10 ahead
        field = cg.RiskField([cg.Threat(0.49, 0.5, spread=0.02, peak=peak)])
        assert (_with_target(*seen_by(cg.Problem((0.4, 0.5), (0.9, 0.5), field))).virtual is not None) == blocked


def test_it_gives_a_virtual_goal_up_once_it_is_near_or_the_goal_in_sight() -> None:
    around, memory = seen_by(cg.Problem((0.4, 0.5), (0.9, 0.5)))
    far = replace(memory, virtual=(0.4, 0.7), hit=0.45)
    assert _with_target(around, far).virtual == (0.4, 0.7)  # in sight, but no nearer than where it left its course
    assert _with_target(around, replace(far, hit=0.55)).virtual is None
    assert _with_target(around, replace(far, virtual=(0.4, 0.539))).virtual is None
    assert _with_target(around, replace(far, virtual=(0.4, 0.541))).virtual is not None


def test_after_steps_that_bring_too_little_it_puts_a_virtual_goal() -> None:
    around, memory = seen_by(cg.Problem((0.4, 0.5), (0.9, 0.5)))
    for gained, stalled in ((0.199, True), (0.201, False)):
        steps = tuple(np.linspace(0.5 + gained, 0.5, 21).tolist())
        assert (_with_target(around, replace(memory, left=steps)).virtual is not None) == stalled
        assert _with_target(around, replace(memory, left=steps[:-1])).virtual is None


@pytest.mark.slow
def test_aversion_to_risk_lowers_the_risk() -> None:
    """Over maps on which both arrive; without it the behaviours alone already avoid the centres of threats."""
    averse, blind = BcvStyle(), BcvStyle(risk_aversion=0)
    pairs = []
    for seed in range(20):
        problem = random_scenario(seed).problem
        answers = cg.solve(problem, averse), cg.solve(problem, blind)
        if all(answer.status.has_path for answer in answers):
            pairs.append([answer.risk for answer in answers])
    assert len(pairs) >= 10
    assert np.median(np.divide(*np.transpose(pairs))) < 0.9


def test_in_a_dead_end_it_turns_around_on_the_spot() -> None:
    """The corridor is so narrow that no turn of a right angle is open for a step."""
    corridor = shapely.box(0.05, 0.49, 0.5, 0.51).difference(shapely.box(0.0, 0.497, 0.3, 0.503))
    around = Surroundings(cg.Problem((0.29, 0.5), (0.9, 0.5), no_fly=corridor), 0.02)
    after = BcvStyle().choose(around, BcvMemory((0.29, 0.5), first=0.0))
    assert after.turns == 16
    assert after.position == pytest.approx((0.27, 0.5))
