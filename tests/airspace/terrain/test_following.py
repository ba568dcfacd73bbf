"""Plans that follow the ground: straight legs stay within the tolerance, and the check of the plan is clean."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.ndimage import gaussian_filter
from strategies import few, seeds
from test_terrain import BOX, SHAPE, between, line

from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.formats import WRITTEN, plan_of_bytes, text_of_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.plan_check.check import check
from cgla_graph.airspace.terrain.following import follow_terrain
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.errors import CglaError, PlanError, ProblemError


def made(seed: int, smooth: float) -> Ground:
    """Return random ground: every cell on its own, or smooth hills of some hundred metres."""
    values = np.random.default_rng(seed).uniform(0.0, 300.0, SHAPE)
    return Ground(values if smooth == 0.0 else 3.0 * gaussian_filter(values, smooth, mode="nearest"), BOX)


def above(plan: FlightPlan, ground: Ground) -> FloatArray:
    """Return heights above the ground along straight legs, by fine samples."""
    found = []
    for leg in range(len(plan.waypoints) - 2):
        level = between(ground, line(plan, leg))
        ends = level[[0, -1]] + [plan.waypoints[leg].altitude, plan.waypoints[leg + 1].altitude]
        found.append(np.linspace(*ends, len(level)) - level)
    return np.concatenate(found)


@few
@given(
    seeds,
    st.sampled_from([0.0, 1.0, 3.0]),
    st.floats(30.0, 150.0),
    st.sampled_from([2.0, 10.0, 40.0]),
    st.sampled_from([0.0, 30.0]),
)
def test_straight_legs_stay_within_the_tolerance_and_above_the_clearance(
    seed: int, smooth: float, height: float, tolerance: float, clearance: float
) -> None:
    ground = made(seed, smooth)
    ends = np.random.default_rng(seed).uniform((24.001, 60.001), (24.059, 60.019), (3, 2))
    flat = FlightPlan.along(ends, altitude=height, reference="ground", speed=9.0)

    found = follow_terrain(flat, ground, tolerance=tolerance, clearance=clearance)

    heights = above(found.plan, ground)
    assert heights.min() >= max(height - tolerance, clearance) - 1e-6
    assert heights.max() <= height + tolerance + 1e-6
    checked = check(found.plan, ground=ground, terrain_clearance=clearance, tolerance=None)
    assert checked.is_clean
    assert found.added == len(found.plan.waypoints) - len(flat.waypoints)
    kept = [one for one in found.plan.waypoints if any((one.x, one.y) == (x, y) for x, y in ends.tolist())]
    assert len(kept) == len(flat.waypoints)
    assert {one.speed for one in found.plan.waypoints[1:]} == {9.0}


@pytest.mark.parametrize("kind", WRITTEN)
def test_a_plan_that_follows_the_ground_is_clean_in_every_format(kind: str) -> None:
    ground = made(5, 2.0)
    flat = FlightPlan.along([(24.002, 60.002), (24.058, 60.018)], altitude=80, reference="ground")
    found = follow_terrain(flat, ground).plan

    text = text_of_plan(found, f"mine{kind}")
    read = plan_of_bytes(text.encode(), f"mine{kind}")

    assert len(found.waypoints) > len(flat.waypoints)
    assert read.waypoints == found.waypoints
    assert check(read, ground=ground, tolerance=None).is_clean
    assert not check(flat, ground=ground, tolerance=None).is_clean


def test_flat_ground_needs_no_waypoints() -> None:
    ground = Ground(np.full(SHAPE, 100.0), BOX)
    flat = FlightPlan.along([(24.002, 60.002), (24.03, 60.01), (24.058, 60.018)], altitude=80, reference="ground")

    assert follow_terrain(flat, ground).plan == flat


def test_a_plan_near_the_clearance_is_raised_by_half_the_tolerance() -> None:
    ground = Ground(np.full(SHAPE, 100.0), BOX)
    flat = FlightPlan.along([(24.002, 60.002), (24.058, 60.018)], altitude=30, reference="ground")

    found = follow_terrain(flat, ground, tolerance=10, clearance=30)

    assert found.height == 35.0
    assert {one.altitude for one in found.plan.waypoints} == {35.0, 0.0}


def test_what_cannot_be_followed_is_refused() -> None:
    ground = Ground(np.full(SHAPE, 100.0), BOX)
    unknown = Ground(np.where(np.arange(SHAPE[1]) == 15, np.nan, np.full(SHAPE, 100.0)), BOX)
    ends = [(24.002, 60.002), (24.058, 60.018)]
    flat = FlightPlan.along(ends, altitude=80, reference="ground")
    for plan, over, settings, kind, words in (
        (flat, unknown, {}, PlanError, "its elevation at 24.*60.* is not known; give elevations"),
        (FlightPlan.along([*ends, (24.2, 60.01)], altitude=80, reference="ground"), ground, {}, PlanError, "on leg 2"),
        (FlightPlan.along(ends, altitude=80), ground, {}, PlanError, "only plans at one altitude above ground"),
        (FlightPlan.along(ends), ground, {}, PlanError, "only plans at one altitude above ground"),
        (flat, ground, {"clearance": 90.0}, ProblemError, "the terrain clearance is 90 m; fly higher"),
        (flat, ground, {"tolerance": 0.0}, CglaError, "tolerance"),
    ):
        with pytest.raises(kind, match=words):
            follow_terrain(plan, over, **settings)
