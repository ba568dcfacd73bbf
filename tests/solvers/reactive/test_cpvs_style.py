"""Sub-goals: their choice, their coming and going, and their effect on paths (see also test_fbcri_style)."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
import strategies as own
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.reactive import cpvs_style
from cgla_graph.solvers.reactive.cpvs_style import BLOCKED, HYSTERESIS, CpvsStyle, SubgoalMemory
from cgla_graph.solvers.reactive.fbcri_style import FbcriStyle
from cgla_graph.solvers.reactive.step_by_step import Surroundings
from cgla_graph.testing import strategies as drawn

WALL = shapely.box(0.49, 0.2, 0.51, 1.0)


def reference(problem: cg.Problem, here: Point, aim: Point, *, onward: bool = False) -> tuple[float, Point] | None:
    """Try every sub-goal in turn, from the words of the docstring; threats alone, of peak 1, on the unit square."""
    length = math.dist(here, aim)
    left = -(aim[1] - here[1]) / length, (aim[0] - here[0]) / length
    line = shapely.LineString([here, aim])
    threats = problem.field.threats
    places = []
    for t in threats:
        places += [
            (t.x + sign * (3 * t.spread + 0.03) * left[0], t.y + sign * (3 * t.spread + 0.03) * left[1])
            for sign in (1, -1)
        ]
    blocking = {t for t in threats if shapely.Point(t.x, t.y).distance(line) < 2 * t.spread}
    for a, b in itertools.combinations(threats, 2):
        apart = math.dist((a.x, a.y), (b.x, b.y))
        if apart > 2 * (a.spread + b.spread) and blocking & {a, b}:
            # the middle between the two rims
            rims = [2 * a.spread / apart, 1 - 2 * b.spread / apart]
            share = sum(rims) / 2
            places.append((a.x + share * (b.x - a.x), a.y + share * (b.y - a.y)))
    best = None
    for q in places:
        if not (0 <= q[0] <= 1 and 0 <= q[1] <= 1) or math.dist(here, q) <= 0.05:
            continue
        if problem.field.density(q) > BLOCKED:
            continue
        cost = problem.evaluate([here, q]).cost + math.dist(q, aim)
        if onward:
            cost += problem.k * problem.evaluate([q, aim]).risk
        if best is None or cost < best[0]:
            best = cost, q
    return best


@own.fast
@given(drawn.seeds, st.integers(0, 8), drawn.points, drawn.points, drawn.risk_weights, st.booleans())
def test_the_sub_goal_is_the_best_of_all(
    seed: int, threats: int, here: Point, aim: Point, k: float, onward: bool
) -> None:
    if math.dist(here, aim) < 1e-3:
        return
    field = random_scenario(seed, threats=threats).problem.field
    problem = cg.Problem(here, aim, field, k)
    found = CpvsStyle(onward=onward)._subgoal(Surroundings(problem, 0.02), here, aim, ())
    best = reference(problem, here, aim, onward=onward)
    if best is None or found is None:
        assert found is best
        return
    cost = problem.evaluate([here, found]).cost + math.dist(found, aim)
    if onward:
        cost += k * problem.evaluate([found, aim]).risk
    assert cost == pytest.approx(best[0], rel=1e-9)


def test_a_wall_is_passed_off_its_corners() -> None:
    problem = cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=WALL)
    solver = CpvsStyle()
    around = Surroundings(problem, 0.02)
    first = solver._subgoal(around, problem.start, problem.goal, ())
    # 0.03 outside the corners at the bottom; the second is behind the wall
    assert first == pytest.approx((0.46, 0.17))
    assert solver._subgoal(around, (0.46, 0.17), problem.goal, ()) == pytest.approx((0.54, 0.17))
    # a place is tried once, and there is no other in sight
    assert solver._subgoal(around, problem.start, problem.goal, ((0.46, 0.17),)) is None
    shortest = 2.0 * math.dist((0.1, 0.7), (0.49, 0.2)) + 0.02
    answer = cg.solve(problem, solver)
    assert answer.status is Status.FOUND
    assert shortest <= answer.length <= 1.1 * shortest


def test_a_gap_between_two_threats_is_flown_through_its_middle() -> None:
    # rims at 0.48 and 0.52 of a line across the way; beside one threat is the other, or a longer way
    field = RiskField([cg.Threat(0.5, 0.32, spread=0.08), cg.Threat(0.5, 0.68, spread=0.08)])
    problem = cg.Problem((0.1, 0.35), (0.9, 0.35), field, k=1.0)
    found = CpvsStyle()._subgoal(Surroundings(problem, 0.02), problem.start, problem.goal, ())
    assert found == pytest.approx((0.5, 0.5))


def follow(problem: cg.Problem, steps: int = 400) -> list[SubgoalMemory]:
    """Fly, and keep every memory."""
    solver, around = CpvsStyle(), Surroundings(problem, 0.02)
    memories = [solver.begin(around)]
    while len(memories) < steps and around.to_goal(memories[-1].position) > around.step:
        memories.append(solver.choose(around, memories[-1]))
    return memories


@pytest.mark.parametrize("seed", [3, 13, 44])
def test_sub_goals_do_not_come_and_go(seed: int) -> None:
    memories = follow(random_scenario(seed, areas=3).problem)
    changes = [i for i, (a, b) in enumerate(itertools.pairwise(memories)) if a.queue != b.queue]
    pushes = [i for i in changes if len(memories[i + 1].queue) > len(memories[i].queue)]
    assert pushes
    for push in pushes:
        before = [i for i in changes if i < push]
        assert not before or push - before[-1] >= HYSTERESIS
        # a new one is the next one, and the others wait
        assert memories[push + 1].queue[1:] == memories[push].queue
        assert memories[push + 1].queue[0] in memories[push + 1].tried


def test_the_queue_is_left_where_what_comes_after_is_clear() -> None:
    problem = cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=WALL)
    around = Surroundings(problem, 0.02)
    queue = (0.46, 0.17), (0.54, 0.17)
    assert cpvs_style._kept(around, (0.2, 0.6), queue, 0) == queue
    # the second is in sight
    assert cpvs_style._kept(around, (0.4, 0.1), queue, 0) == queue[1:]
    # reached
    assert cpvs_style._kept(around, (0.46, 0.21), queue, 0) == queue[1:]
    # the goal is in sight
    assert cpvs_style._kept(around, (0.6, 0.3), queue, 0) == ()
    # out of patience
    assert cpvs_style._kept(around, (0.2, 0.6), queue, cpvs_style.GIVE_UP) == queue[1:]
    # a threat has come up on it
    risky = replace(problem, field=RiskField([cg.Threat(0.46, 0.17, spread=0.03)]))
    assert cpvs_style._kept(Surroundings(risky, 0.02), (0.2, 0.6), queue, 0) == queue[1:]


@own.few
@given(drawn.seeds)
def test_without_anything_in_the_way_it_is_fbcri(seed: int) -> None:
    # no threat of these, nor four of them together, makes a way blocked
    field = random_scenario(seed, threats=4, peak=(0.05, 0.08)).problem.field
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0)
    assert np.array_equal(CpvsStyle().solve(problem).path, FbcriStyle().solve(problem).path)


def test_a_risky_goal_is_no_reason_for_detours() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), RiskField([cg.Threat(0.9, 0.5, spread=0.05)]), k=10.0)
    assert cpvs_style._is_clear(Surroundings(problem, 0.02), problem.start, problem.goal)
    assert not cpvs_style._is_clear(Surroundings(replace(problem, goal=(0.97, 0.9)), 0.02), (0.83, 0.1), (0.97, 0.9))
    assert cg.solve(problem, CpvsStyle()).status is Status.FOUND


@pytest.mark.slow
def test_the_default_is_the_better_choice_of_sub_goals() -> None:
    found = {
        onward: [cg.solve(random_scenario(seed).problem, CpvsStyle(onward=onward)) for seed in range(12)]
        for onward in (False, True)
    }
    for measure in ("cost", "risk", "length"):
        blind, default = (np.mean([getattr(one, measure) for one in found[onward]]) for onward in (False, True))
        assert default < blind, measure
    assert CpvsStyle().onward


def test_sub_goals_lower_the_risk_of_fbcri_on_average() -> None:
    risks = {
        kind: [cg.solve(random_scenario(seed).problem, kind()).risk for seed in range(12)]
        for kind in (FbcriStyle, CpvsStyle)
    }
    assert np.mean(risks[CpvsStyle]) < np.mean(risks[FbcriStyle])
