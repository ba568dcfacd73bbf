"""Legs above ground, flown straight: their heights, and the zones that they meet."""

import itertools
import json
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from zone_files import ed269, volume

import cgla_graph as cg
from cgla_graph.airspace.plan_check.result import PlanCheck
from cgla_graph.airspace.terrain.straight import straight_leg
from cgla_graph.airspace.terrain.surface import Surface
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.model.earth import LocalProjection

BOX = (24.0, 60.0, 24.08, 60.02)
PLACES = [(24.005, 60.01), (24.075, 60.01)]
CIRCLE = {"type": "Circle", "center": [24.04, 60.01], "radius": 300}


def valley(depth: float) -> Ground:
    """Return the ground of a valley between two plateaus."""
    rim = [depth, depth, 0.0, 0.0, 0.0, 0.0, depth, depth]
    return Ground(np.array([rim, rim]), BOX)


def checked(tmp_path: Path, ground: Ground | None, **limits: object) -> PlanCheck:
    file = tmp_path / "zones.json"
    file.write_text(json.dumps(ed269(volume(horizontalProjection=CIRCLE, **limits))), encoding="utf-8")
    plan = cg.FlightPlan.along(PLACES, altitude=80, reference="ground")
    return cg.check(plan, zones=file, ground=ground, terrain_clearance=None if ground is None else 0, tolerance=None)


@pytest.mark.parametrize(
    ("depth", "floor", "above", "clean"),
    [
        (300, 150, "AGL", False),  # 380 m above the valley
        (300, 390, "AGL", True),
        (0, 85, "AGL", True),
        (0, 75, "AGL", False),
        (300, 200, "AMSL", False),  # 80 m above the sea if it follows the ground
        (300, 390, "AMSL", True),
    ],
)
def test_a_leg_above_ground_counts_as_straight_as_well(
    tmp_path: Path, depth: float, floor: float, above: str, clean: bool
) -> None:
    limits = {"lowerLimit": floor, "lowerVerticalReference": above, "upperLimit": 900, "upperVerticalReference": above}
    found = checked(tmp_path, valley(depth), **limits)
    assert found.is_clean is clean, found.verdict
    if not clean and depth:
        heights, one = found.on.heights, found.crossings.found[0]
        assert heights is not None
        assert "straight between them" in heights.heights_text(one.leg, one.area, is_place=False)
        parts = heights.on_leg(one.leg, one.area)
        assert all(before[1] < after[0] for before, after in itertools.pairwise(parts))


def test_unknown_ground_below_a_straight_leg_closes_zones_and_is_said(tmp_path: Path) -> None:
    ground = Ground(np.array([[9.0, 9.0, 9.0, np.nan, np.nan, 9.0, 9.0, 9.0]]), BOX)
    found = checked(tmp_path, ground, lowerLimit=500, lowerVerticalReference="AGL", upperLimit=900)
    assert not found.is_clean
    assert "above ground that is not known" in " ".join(found.height_notes)


@given(st.lists(st.floats(0.0, 400.0), min_size=15, max_size=15), st.tuples(*[st.floats(0.001, 0.079)] * 2))
def test_the_bounds_hold_at_any_place_of_a_straight_leg(values: list[float], longitudes: tuple[float, float]) -> None:
    ground = Ground(np.array(values).reshape(3, 5), BOX)
    projection = LocalProjection(24.04, 60.01)
    lonlat = np.array([[24.0 + longitudes[0], 60.003], [24.0 + longitudes[1], 60.017]])
    ends = projection.forward(lonlat)
    line = straight_leg(ends, projection, ground)
    low, high = line.above_ground((80.0, 120.0))
    surface = Surface.near(ground, BOX)
    first, last = surface.between(lonlat) + np.array([80.0, 120.0])
    for share in np.linspace(0.0, 1.0, 41).tolist():
        here = projection.inverse(ends[0] + share * (ends[1] - ends[0]))
        height = first + share * (last - first) - float(surface.between(here[None])[0])
        piece = min(int(np.searchsorted(line.shares[:, 2], share)), len(low) - 1)
        assert low[piece] - 0.05 <= height <= high[piece] + 0.05


@pytest.mark.parametrize(("depth", "clean"), [(300, False), (9, True), (0, True)])
def test_one_altitude_does_not_decide_about_legs_high_above_a_valley(tmp_path: Path, depth: float, clean: bool) -> None:
    file = tmp_path / "zones.json"
    limits = {"lowerLimit": 150, "lowerVerticalReference": "AGL", "upperLimit": 900}
    file.write_text(json.dumps(ed269(volume(horizontalProjection=CIRCLE, **limits))), encoding="utf-8")
    plan = cg.FlightPlan.along(PLACES, altitude=80, reference="ground")
    found = cg.check(plan, zones=file, ground=valley(depth), altitude=80, terrain_clearance=0, tolerance=None)
    assert found.is_clean is clean
    assert clean or "up to 380 m above the ground" in " ".join(found.verdict)


@given(st.integers(0, 119), st.sampled_from([-300.0, 300.0]), st.floats(0.0, 400.0), st.sampled_from([0.0, 60.0, 80.0]))
def test_elevations_within_a_reach_are_between_the_least_and_the_greatest(
    place: int, height: float, reach: float, latitude: float
) -> None:
    values = np.zeros((10, 12))
    values.flat[place] = height
    ground = Ground(values, (24.0, latitude, 24.024, latitude + 0.01))
    projection = LocalProjection(24.012, latitude + 0.005)
    azimuths = np.linspace(0.0, 2.0 * np.pi, 16)[:, None]
    shares = np.linspace(0.0, 1.0, 5).reshape(-1, 1, 1)
    near = projection.inverse(shares * reach * np.concatenate([np.sin(azimuths), np.cos(azimuths)], axis=1))
    surface = Surface.along(ground, np.zeros((1, 2)), projection, reach=reach)
    least, most = surface.range_around(projection.inverse(np.zeros((1, 2))), reach)
    seen = surface.between(near[(np.abs(near - (24.012, latitude + 0.005)) < (0.012, 0.005)).all(axis=-1)])
    assert np.isfinite(seen).all()
    assert least[0] - 1e-9 <= seen.min() <= seen.max() <= most[0] + 1e-9
