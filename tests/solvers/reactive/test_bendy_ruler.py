"""The bendy ruler: margins as shapely measures them, detours as long as tangents make them, dead ends that it says."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

import cgla_graph as cg
from cgla_graph.solvers.reactive.bendy_ruler import BendyMemory, BendyRuler, _Obstacles
from cgla_graph.solvers.reactive.step_by_step import Surroundings
from cgla_graph.testing.strategies import points, problems


def radius(threat: cg.Threat, threshold: float) -> float:
    return threat.spread * math.sqrt(2.0 * math.log(threat.peak / threshold))


@usual
@given(problems(), st.lists(points, min_size=1, max_size=4), st.floats(0.01, 0.5))
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
