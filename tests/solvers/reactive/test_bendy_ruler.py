"""The bendy ruler: margins as shapely measures them, detours as long as tangents make them, dead ends that it says."""

import math
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few, plane_problems, points, scaled, usual

import cgla_graph as cg
from cgla_graph.errors import SolverSettingError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers.reactive.bendy_ruler import BendyMemory, BendyRuler, _Obstacles
from cgla_graph.solvers.reactive.step_by_step import Surroundings

CELL = shapely.box(0.29, 0.49, 0.31, 0.51).difference(shapely.box(0.295, 0.495, 0.305, 0.505))
RING = shapely.box(0.6, 0.6, 1.0, 1.0).difference(shapely.box(0.7, 0.7, 0.9, 0.9))


def radius(threat: cg.Threat, threshold: float) -> float:
    return threat.spread * math.sqrt(2.0 * math.log(threat.peak / threshold))


@usual
@given(plane_problems(), st.lists(points, min_size=1, max_size=4), st.floats(0.01, 0.5))
def test_margins_are_distances_to_discs_and_areas(
    problem: cg.Problem, spots: list[tuple[float, float]], most: float
) -> None:
    starts = np.tile(problem.start, (len(spots), 1))
    found = _Obstacles(Surroundings(problem, 0.02), BendyRuler(threshold=0.2))._clearance(starts, np.array(spots), most)
    for spot, margin in zip(spots, found.tolist(), strict=True):
        line = shapely.LineString([problem.start, spot])
        if problem.model.area.crosses([problem.start], [spot])[0]:
            assert margin == -math.inf
            continue
        discs = [
            line.distance(shapely.Point(threat.x, threat.y)) - radius(threat, 0.2)
            for threat in problem.field.threats
            if threat.peak > 0.2
        ]
        area = [] if problem.model.area.is_empty else [line.distance(problem.model.area.geometry)]
        assert margin == pytest.approx(min([most, *discs, *area]), abs=1e-9)


@pytest.mark.slow
@usual
@given(plane_problems())
def test_its_steps_may_be_flown(problem: cg.Problem) -> None:
    answer = cg.solve(problem, "bendy-ruler", max_steps=300)
    assert answer.status in {cg.Status.OPTIMAL, cg.Status.FOUND, cg.Status.STUCK}, answer.message
    if answer.status is cg.Status.FOUND:
        assert tuple(answer.path[0]) == problem.start
        assert tuple(answer.path[-1]) == problem.goal
        assert np.hypot(*np.diff(answer.path, axis=0)[:-1].T) == pytest.approx(0.02, rel=1e-9)


def test_where_nothing_is_in_the_way_it_flies_straight() -> None:
    answer = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.8)), "bendy-ruler")
    assert answer.length == pytest.approx(math.hypot(0.8, 0.7), rel=1e-12)


@usual
@given(st.floats(0.02, 0.1), st.floats(0.3, 1.0), st.floats(-0.9, 0.9))
def test_around_one_disc_it_keeps_out_and_is_little_longer_than_the_tangents(
    spread: float, peak: float, beside: float
) -> None:
    """Two tangents and an arc of the disc are the least; those around the disc and its margin are almost reached."""
    disc = radius(cg.Threat(0, 0, spread, peak), 0.2)
    threat = cg.Threat(0.5, 0.5 + beside * disc, spread, peak)
    answer = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([threat]), k=10.0), BendyRuler(threshold=0.2))
    assert answer.status is cg.Status.FOUND, answer.message
    line = shapely.LineString(answer.path)
    assert line.distance(shapely.Point(threat.x, threat.y)) >= disc * (1.0 - 1e-9)

    def detour(around: float) -> float:
        away, aside = math.hypot(0.4, threat.y - 0.5), math.atan2(abs(threat.y - 0.5), 0.4)
        arc = math.pi - 2.0 * aside - 2.0 * math.acos(around / away)
        return 2.0 * math.sqrt(away**2 - around**2) + max(arc, 0.0) * around

    assert answer.length >= detour(disc) * (1.0 - 1e-9)
    assert answer.length <= detour(disc + 0.02) * 1.12


def test_a_threat_below_the_threshold_is_no_obstacle() -> None:
    for peak, detours in ((0.19, False), (0.9, True)):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.05, peak=peak)])
        answer = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), field), BendyRuler(threshold=0.2))
        assert (answer.length > 0.81) == detours


def test_a_wider_margin_stays_further_away() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.box(0.45, 0.4, 0.55, 0.6))
    kept = [cg.solve(problem, BendyRuler(margin_max=margin)).clearance for margin in (0.01, 0.03, 0.06)]
    assert kept == sorted(kept)
    assert (np.array(kept) >= np.array([0.01, 0.03, 0.06]) * 0.5).all()


def test_a_goal_within_a_disc_is_reached() -> None:
    """A probe that ends at the goal needs no more margin than the goal has."""
    field = cg.RiskField([cg.Threat(0.88, 0.5, 0.05)])
    answer = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.45), field), "bendy-ruler")
    assert answer.status is cg.Status.FOUND, answer.message


def test_out_of_a_disc_it_takes_the_shortest_way_that_leads_on() -> None:
    """Discs are no walls: from inside, it goes where the margin is widest."""
    field = cg.RiskField([cg.Threat(0.5, 0.52, 0.05)])
    answer = cg.solve(cg.Problem((0.5, 0.5), (0.9, 0.5), field), "bendy-ruler")
    assert answer.status is cg.Status.FOUND
    assert answer.path[:, 1].max() < 0.52


def test_the_second_stage_passes_over_a_dead_end() -> None:
    """Straight on, the first probe fits into the pocket, but nothing goes on from its end."""
    pocket = shapely.union_all(
        [shapely.box(0.3, y, 0.52, y + 0.01) for y in (0.44, 0.55)] + [shapely.box(0.5, 0.44, 0.52, 0.56)]
    )
    around = Surroundings(cg.Problem((0.3, 0.5), (0.9, 0.5), no_fly=pocket), 0.02)
    obstacles = _Obstacles(around, BendyRuler())
    ends, _, good = obstacles.probe(np.array([[0.3, 0.5]]), np.zeros(1), 0.15)
    assert good.all()
    _, _, goes_on = obstacles.probe(ends[0], np.radians([0.0, 45.0, -45.0]), 0.15)
    assert not goes_on.any()
    after = BendyRuler().choose(around, BendyMemory((0.3, 0.5)))
    assert after.bearing is not None
    assert abs(after.bearing) > 0.5


def test_it_resists_a_sharp_turn_unless_the_margin_pays() -> None:
    """A wall ahead: the way along it is left or right, and the last bearing decides unless its margin is poor."""
    wall = shapely.box(0.5, 0.2, 0.52, 0.8)
    around = Surroundings(cg.Problem((0.46, 0.5), (0.9, 0.5), no_fly=wall), 0.02)
    free = BendyRuler(continue_angle=180)
    towards = free.choose(around, BendyMemory((0.46, 0.5), bearing=math.radians(100))).bearing
    assert towards is not None
    away = math.radians(179)
    resisting, obedient = BendyRuler(continue_angle=45), free
    assert resisting.choose(around, BendyMemory((0.46, 0.5), bearing=away)).bearing == pytest.approx(away)
    assert obedient.choose(around, BendyMemory((0.46, 0.5), bearing=away)).bearing == pytest.approx(towards)
    # straight into the wall: no margin at all, nothing to continue
    assert resisting.choose(around, BendyMemory((0.46, 0.5), bearing=0.0)).bearing == pytest.approx(towards)
    # the clear way to the goal is never resisted
    clear = Surroundings(cg.Problem((0.6, 0.5), (0.9, 0.5), no_fly=wall), 0.02)
    assert resisting.choose(clear, BendyMemory((0.6, 0.5), bearing=away)).bearing == pytest.approx(0.0)


def test_it_keeps_to_the_side_of_its_last_bearing() -> None:
    wall = shapely.box(0.5, 0.2, 0.52, 0.8)
    around = Surroundings(cg.Problem((0.46, 0.5), (0.9, 0.5), no_fly=wall), 0.02)
    for last in (0.1, -0.1):
        bearing = BendyRuler().choose(around, BendyMemory((0.46, 0.5), bearing=last)).bearing
        assert bearing is not None
        assert bearing * last > 0.0


@few
@given(plane_problems(max_threats=3), st.integers(-10, 20))
def test_the_path_scales_with_the_map(problem: cg.Problem, power: int) -> None:
    """Powers of two scale without rounding, so that nothing may differ at all."""
    scale = 2.0**power
    one, other = (BendyRuler(max_steps=200).solve(it) for it in (problem, scaled(problem, scale)))
    assert one.status is other.status
    assert np.array_equal(scale * one.path, other.path)


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_end_in_a_path_or_a_reason(name: str) -> None:
    answer = cg.solve(load_scenario(name).problem, "bendy-ruler", patience=50)
    assert answer.status.has_path or (answer.status is cg.Status.STUCK and "no headway in 50 steps" in answer.message)


def test_before_a_goal_that_is_walled_in_it_gets_stuck_for_want_of_headway() -> None:
    answer = BendyRuler(patience=60).solve(cg.Problem((0.1, 0.1), (0.8, 0.8), no_fly=RING))
    assert answer.status is cg.Status.STUCK
    assert "no headway in 60 steps: never nearer to the goal than" in answer.message


def test_in_a_dead_end_deeper_than_its_lookahead_it_swings_to_and_fro() -> None:
    pocket = shapely.box(0.2, 0.2, 0.8, 0.8).difference(shapely.box(0.0, 0.25, 0.75, 0.75))
    answer = BendyRuler(patience=100).solve(cg.Problem((0.25, 0.5), (0.95, 0.5), no_fly=pocket))
    assert answer.status is cg.Status.STUCK
    assert "no headway" in answer.message


def test_walled_in_it_says_that_every_bearing_is_closed() -> None:
    answer = BendyRuler().solve(cg.Problem((0.3, 0.5), (0.9, 0.5), no_fly=CELL))
    assert answer.status is cg.Status.STUCK
    assert answer.message == "at (0.3, 0.5), step 0: every bearing is closed by a no-fly area or the bounds"


def test_peaks_above_1_are_flown_as_they_are() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.45, 0.4, 0.05, peak=8.0), cg.Threat(0.5, 0.6, 0.05, peak=8.0)], improper=True)
    answer = BendyRuler().solve(cg.Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0))
    assert answer.status in {cg.Status.FOUND, cg.Status.STUCK}


@pytest.mark.parametrize(
    ("settings", "fault"),
    [
        ({"lookahead": 0}, "lookahead is 0; it must be above 0"),
        ({"margin_max": -0.01}, "margin_max is -0.01; it must be at least 0"),
        ({"continue_ratio": 0.9}, "continue_ratio is 0.9; give at least 1"),
        ({"continue_angle": 0}, "continue_angle is 0; it must be above 0"),
        ({"threshold": math.nan}, "threshold is nan; give a finite number"),
        ({"step": -1}, "step is -1"),
        ({"patience": 0}, "patience is 0"),
    ],
)
def test_settings_out_of_range_are_refused(settings: dict[str, Any], fault: str) -> None:
    with pytest.raises(SolverSettingError, match=f"bendy-ruler: {fault}"):
        BendyRuler(**settings)


@pytest.mark.parametrize("seed", range(4))
def test_a_mission_with_full_knowledge_flies_the_planned_path(seed: int) -> None:
    problem = random_scenario(seed, areas=seed % 2).problem
    answer = cg.solve(problem, "bendy-ruler")
    world = World(problem.field, problem.bounds, no_fly=problem.no_fly)
    uav = Uav("a", problem.start, problem.goal, 0.2, k=10, step=0.02)
    flight = Mission(world, [uav], solver=BendyRuler(), knowledge="all").fly().uavs["a"]
    assert flight.status.label == ("arrived" if answer.status.has_path else "stuck")
    if answer.status.has_path:
        assert flight.length == pytest.approx(answer.length, abs=0.03)
        assert flight.risk == pytest.approx(answer.risk, abs=1e-3)
