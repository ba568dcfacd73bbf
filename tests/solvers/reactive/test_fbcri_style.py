"""Fuzzy steering with feedback: its rules, its feedback, its virtual targets, and promises shared with cpvs-style."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
import strategies as own
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.reactive import fuzzy_steering
from cgla_graph.solvers.reactive.cpvs_style import CpvsStyle
from cgla_graph.solvers.reactive.fbcri_style import FbcriStyle
from cgla_graph.solvers.reactive.fuzzy import about
from cgla_graph.solvers.reactive.fuzzy_steering import BASE, BLUR, MOST_WRITTEN, TABLE, TURN
from cgla_graph.solvers.reactive.step_by_step import Surroundings

BOTH = pytest.mark.parametrize(
    "solver", [FbcriStyle(), CpvsStyle(), CpvsStyle(onward=False)], ids=["fbcri", "cpvs", "cpvs-not-onward"]
)

degrees = st.floats(-180.0, 180.0)
clearances = st.floats(-2.0, 2.0)


def turn_of(clearance: float, threat: float, aim: float) -> float:
    """Return the turn by the rules alone, degrees to the left."""
    return BASE.decide(about([clearance, threat, aim], BLUR))


# --- the rules


@own.fast
@given(clearances, degrees, degrees)
def test_the_rules_cover_every_input(clearance: float, threat: float, aim: float) -> None:
    assert BASE.strengths(about([clearance, threat, aim], BLUR)).max() >= 0.5
    # rounding of a sum over the grid
    assert abs(turn_of(clearance, threat, aim)) <= 60.0 + 1e-9


def test_the_rules_are_the_same_to_the_left_and_to_the_right() -> None:
    other = {"LB": "RB", "LS": "RS", "F": "F", "RS": "LS", "RB": "LB"}
    mirrored = {"BL": "BR", "SL": "SR", "Z": "Z", "SR": "SL", "BR": "BL"}
    for clearance, rows in TABLE.items():
        for place, row in rows.items():
            back = [mirrored[turn] for turn in reversed(rows[other[place]].split())]
            here = row.split()
            if place == "F" and clearance != "far":
                # straight ahead of threat and aim, one side has to be chosen
                assert here[2] == {"mid": "SL", "near": "BL"}[clearance]
                here[2] = back[2]
            assert here == back


@own.fast
@given(st.floats(0.6, 2.0), degrees, degrees)
def test_far_from_threats_it_turns_to_the_aim(clearance: float, threat: float, aim: float) -> None:
    turn = turn_of(clearance, threat, aim)
    if abs(aim) >= 5.0:
        assert turn * aim > 0.0
    if abs(aim) >= 65.0:
        assert turn == pytest.approx(math.copysign(60.0, aim))


@own.fast
@given(st.floats(-2.0, -0.02), st.floats(48.0, 180.0), st.booleans(), degrees)
def test_near_a_threat_it_does_not_turn_towards_it(clearance: float, threat: float, left: bool, aim: float) -> None:
    # straight on is the rounding of a sum over the grid
    side = 1.0 if left else -1.0
    assert turn_of(clearance, side * threat, aim) * side <= 1e-9


def test_a_threat_straight_ahead_is_left_on_the_side_of_the_aim() -> None:
    assert turn_of(0.0, 0.0, 45.0) > 45.0
    assert turn_of(0.0, 0.0, -45.0) < -45.0
    assert turn_of(0.0, 0.0, 0.0) > 40.0


# --- the feedback


def facing(field: RiskField, **chosen: float) -> tuple[FbcriStyle, Surroundings, fuzzy_steering.FuzzyMemory]:
    """Stand at (0.5, 0.5), facing a goal in the east."""
    solver = FbcriStyle(**chosen)  # type: ignore[arg-type] # floats only
    around = Surroundings(cg.Problem((0.5, 0.5), (0.9, 0.5), field), 0.02)
    return solver, around, solver.begin(around)


def test_feedback_writes_rules_that_turn_away_from_rising_risk() -> None:
    # slightly to the left, so that the rules alone turn left, in front of it
    field = RiskField([cg.Threat(0.62, 0.51, spread=0.05)])
    solver, around, memory = facing(field)
    after = solver.choose(around, memory)
    blind = facing(field, tolerance=1e9)[0].choose(around, memory)
    assert blind.written == ()
    assert 1 <= len(after.written) <= fuzzy_steering.CORRECTIONS
    # in front of the threat the rules alone turn left; every written rule turns further to the right
    labels = [rule[3] for rule in after.written]
    assert labels == sorted(labels, reverse=True)
    assert after.heading < blind.heading
    # the inputs of the written rules are those that called for them: to the left, and near
    clearance, threat, aim, _ = after.written[0]
    assert clearance == pytest.approx((math.dist((0.5, 0.5), (0.62, 0.51)) - 0.1) / 0.2)
    assert threat == pytest.approx(math.degrees(math.atan2(0.01, 0.12)))
    assert aim == 0.0


def test_a_written_rule_holds_by_half_and_only_about_its_inputs() -> None:
    rules = fuzzy_steering._written_rules(((0.1, 20.0, -5.0, 4),))
    assert rules.strengths(about([0.1, 20.0, -5.0], BLUR)).tolist() == [0.5]
    # the condition falls to 0 within 10 degrees, the input within 2: 9 apart they agree by 1 - 9 / 12
    assert rules.strengths(about([0.1, 29.0, -5.0], BLUR)).tolist() == pytest.approx([0.25])
    assert rules.strengths(about([0.1, 32.5, -5.0], BLUR)).tolist() == [0.0]
    assert rules.decide(about([0.1, 20.0, -5.0], BLUR)) == pytest.approx(TURN["BL"][1])


def test_rules_are_written_once_and_the_oldest_are_forgotten() -> None:
    field = random_scenario(3, threats=60).problem.field
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field)
    solver = FbcriStyle(tolerance=1e-3)
    around = Surroundings(problem, 0.02)
    memory, counts = solver.begin(around), []
    seen: list[fuzzy_steering.Written] = []
    while around.to_goal(memory.position) > 0.06 and len(counts) < 60:
        memory = solver.choose(around, memory)
        counts.append(len(memory.written))
        assert len(set(memory.written)) == len(memory.written)
        seen += [rule for rule in memory.written if rule not in seen]
        assert memory.written == tuple(seen[-len(memory.written) :]) or not memory.written
    assert max(counts) == MOST_WRITTEN < len(seen)


def test_after_losing_ground_for_long_it_turns_back_to_the_aim() -> None:
    # a wall at the left, and the aim behind it: the rules alone go on along the wall
    wall = shapely.box(0.0, 0.52, 0.5, 1.0)
    problem = cg.Problem((0.45, 0.51), (0.2, 0.5), no_fly=wall)
    around = Surroundings(problem, 0.02)
    solver = FbcriStyle()
    memory = replace(solver.begin(around), heading=0.0)
    patient, losing = (solver.choose(around, replace(memory, losing=n)) for n in (0, fuzzy_steering.LOSING))
    assert patient.written == ()
    assert losing.written


# --- virtual targets


def test_a_virtual_target_is_the_first_free_place_off_the_aim() -> None:
    problem = cg.Problem((0.45, 0.5), (0.9, 0.5), no_fly=shapely.box(0.5, 0.3, 0.55, 0.7))
    around = Surroundings(problem, 0.02)
    solver = FbcriStyle(stall=1)
    memory = solver._placed(around, solver.begin(around))
    # 30 and 60 degrees off end in the wall or cross it (0.2 cos 60 = 0.1 > 0.05); 90 degrees is free, on the left
    assert memory.target == pytest.approx((0.45, 0.7))
    assert (memory.side, memory.hit) == (1, pytest.approx(0.45))
    # a planner that has turned left on the whole goes to the right
    right = solver._placed(around, replace(solver.begin(around), turned=0.1))
    assert right.target == pytest.approx((0.45, 0.3))
    # with a threat there, the next one that is free
    risky = replace(problem, field=RiskField([cg.Threat(0.45, 0.65, spread=0.03)]))
    around = Surroundings(risky, 0.02)
    angle = math.radians(120.0)
    assert solver._placed(around, solver.begin(around)).target == pytest.approx(
        (0.45 + 0.2 * math.cos(angle), 0.5 + 0.2 * math.sin(angle))
    )


def test_virtual_targets_lead_out_of_a_shallow_pocket_but_not_of_a_deep_one() -> None:
    def pocket(mouth: float) -> cg.Problem:
        inside = shapely.box(mouth, 0.35, 0.65, 0.65)
        return cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(mouth, 0.3, 0.7, 0.7).difference(inside))

    # without virtual targets it never leaves
    caught = FbcriStyle(stall=10**6).solve(pocket(0.5))
    assert caught.status is Status.STUCK
    assert "no headway in 200 steps: never nearer to the goal than 0.25" in caught.message
    answer = cg.solve(pocket(0.5), FbcriStyle())
    assert answer.status is Status.FOUND, answer.message
    assert FbcriStyle().solve(pocket(0.4)).status is Status.STUCK
    # sub-goals look further
    assert cg.solve(pocket(0.4), CpvsStyle()).status is Status.FOUND


# --- promises of both


@pytest.mark.slow
@BOTH
def test_shipped_maps_and_random_maps_are_flown(solver: FbcriStyle | CpvsStyle) -> None:
    for name in ("paper", "one-threat", "thin-wall", "gap-in-wall"):
        assert cg.solve(cg.load_scenario(name).problem, solver).status is Status.FOUND, name
    for seed in range(10):
        problem = random_scenario(seed, areas=2).problem
        answer = cg.solve(problem, solver)
        assert answer.status is Status.FOUND, (seed, answer.message)


@BOTH
def test_evaluations_count_points_of_the_field(solver: FbcriStyle | CpvsStyle, monkeypatch: pytest.MonkeyPatch) -> None:
    asked = 0
    density, integral = RiskField.density, RiskField.line_integral

    def counted(self: RiskField, points: FloatArray) -> FloatArray:
        nonlocal asked
        found = density(self, points)
        asked += found.size
        return found

    def weighed(self: RiskField, starts: FloatArray, ends: FloatArray) -> FloatArray:
        nonlocal asked
        found = integral(self, starts, ends)
        asked += found.size
        return found

    problem = random_scenario(1).problem
    monkeypatch.setattr(RiskField, "density", counted)
    monkeypatch.setattr(RiskField, "line_integral", weighed)
    answer = solver.solve(problem)
    # the last question is the oracle's, for the risk of each step
    assert answer.evaluations == asked - (len(answer.path) - 1) > 0


@pytest.mark.slow
@BOTH
def test_missions_arrive_on_what_they_sense(solver: FbcriStyle | CpvsStyle) -> None:
    missions = load_mission("fig10").missions(lambda _: solver)
    for flight in (mission.fly() for mission in missions.values()):
        assert [uav.status.label for uav in flight.uavs.values()] == ["arrived"] * 3


# --- fbcri-style alone


def test_the_risk_weight_makes_no_difference() -> None:
    problem = random_scenario(2).problem
    paths = [FbcriStyle().solve(replace(problem, k=k)).path for k in (0.0, 10.0, 200.0)]
    assert np.array_equal(paths[0], paths[1])
    assert np.array_equal(paths[0], paths[2])


def test_threats_too_weak_for_an_edge_do_not_count() -> None:
    weak = RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.1), cg.Threat(0.3, 0.35, 0.1, peak=0.05)])
    ends = (0.1, 0.1), (0.9, 0.8)
    blind = FbcriStyle(tolerance=1e9)
    assert np.array_equal(blind.solve(cg.Problem(*ends, weak)).path, blind.solve(cg.Problem(*ends)).path)


def test_it_turns_before_a_no_fly_area_is_in_the_way_of_a_step() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.Point(0.5, 0.5).buffer(0.1))
    answer = cg.solve(problem, FbcriStyle())
    assert answer.status is Status.FOUND
    turned = np.flatnonzero(answer.path[:, 1] != 0.5)[0]
    # within half the range of sight, and at least two steps ahead
    assert 0.04 < 0.4 - answer.path[turned - 1, 0] < 0.1
