"""Bounds of maps in degrees, and starts and goals on them."""

import math
from collections.abc import Callable

import numpy as np
import pyproj
import pytest
from hypothesis import assume, given
from hypothesis import strategies as st

from cgla_graph._types import Bounds, Point
from cgla_graph.errors import ProblemError
from cgla_graph.scenarios.lonlat_box import (
    NEAR,
    bounds_of,
    box_around,
    box_of,
    contains,
    distance_to,
    require_inside,
    require_unswapped,
    widened,
)

GEOD = pyproj.Geod(ellps="WGS84")
FINLAND = (19.8, 59.0, 32.2, 69.6)
places = st.tuples(st.floats(-180.0, 180.0), st.floats(-90.0, 90.0))


@st.composite
def boxes(draw: st.DrawFn) -> Bounds:
    """Draw boxes on either side of the antimeridian and across it."""
    west, south = draw(st.floats(-180.0, 180.0)), draw(st.floats(-89.0, 80.0))
    east = west + draw(st.floats(0.01, 20.0))
    north = min(south + draw(st.floats(0.01, 20.0)), 90.0)
    return box_of((west, south, east - 360.0 if east > 180.0 else east, north))


def message_of(check: object, *given: object) -> str:
    with pytest.raises(ProblemError) as caught:
        check(*given)  # type: ignore[operator]
    message = str(caught.value)
    assert "\n" not in message
    return message


@given(box=boxes())
def test_bounds_and_boxes_are_each_others_inverse(box: Bounds) -> None:
    assert box_of(bounds_of(box)) == pytest.approx(box, abs=1e-9)


@given(points=st.lists(places, min_size=1, max_size=6))
def test_a_box_around_points_holds_them(points: list[Point]) -> None:
    box = box_around(np.array(points))
    assert all(contains(box, point) for point in points)
    assert box[2] - box[0] <= 360.0


@given(box=boxes(), place=places)
def test_distance_is_nought_inside_alone(box: Bounds, place: Point) -> None:
    assert contains(box, place) == (distance_to(box, place) < 1e-3)


@given(box=boxes(), far=st.floats(1e4, 5e5))
def test_distance_is_that_of_a_geodesic(box: Bounds, far: float) -> None:
    west, south, _, _ = bounds_of(box)
    longitude, latitude, _ = GEOD.fwd(west, south, 180.0, far)
    assume(abs(math.remainder(longitude - west, 360.0)) < 1.0)
    assert distance_to(box, (longitude, latitude)) == pytest.approx(far, rel=1e-9)


@given(box=boxes(), azimuth=st.floats(-180.0, 180.0), far=st.floats(0.0, 0.99 * NEAR))
def test_ends_that_are_near_widen_a_box(box: Bounds, azimuth: float, far: float) -> None:
    corner = bounds_of(box)[:2]
    longitude, latitude, _ = GEOD.fwd(*corner, azimuth, far)
    place = (longitude, latitude)
    assume(distance_to(box, place) < NEAR)
    assume(contains(box, place) or not contains(box, place[::-1]))
    wide = widened(box, [("start", place)])
    assert contains(wide, place)
    assert all(contains(wide, point) for point in (bounds_of(box)[:2], bounds_of(box)[2:]))
    assert -180.0 <= wide[0] <= 180.0
    assert wide[2] - wide[0] <= 360.0


@pytest.mark.parametrize(
    ("check", "words"),
    [
        (lambda: widened(FINLAND, [("start", (60.17, 24.94))]), ["start (60.17, 24.94)", "4,369 km", "(24.94, 60.17)"]),
        (lambda: require_inside("start", (60.17, 24.94), FINLAND), ["start (60.17, 24.94)", "4,369 km"]),
        # the map is as far east as it is north, so that the two places are 57 km apart
        (lambda: widened((40.0, 40.5, 41.0, 41.5), [("start", (41.1, 40.4))]), ["(40.4, 41.1)"]),
        (lambda: require_inside("start", (35.68, 139.69), (138.0, 35.0, 141.0, 37.0)), ["(139.69, 35.68)"]),
        (lambda: require_unswapped("threats.0", (60.2, 25.0), FINLAND, 50e3), ["threats.0 (60.2, 25.0)"]),
    ],
)
def test_swapped_coordinates_are_recognised(check: Callable[[], object], words: list[str]) -> None:
    message = message_of(check)
    assert not [word for word in [*words, "longitude first? ", "is on the map"] if word not in message], message


def test_the_longitude_is_not_asked_for_where_that_would_not_help() -> None:
    message = message_of(widened, FINLAND, [("goal", (-24.94, 60.17))])
    assert "goal (-24.94, 60.17) is 2,436 km from the map" in message
    assert "longitude first" not in message
    assert "--bounds" in message


@pytest.mark.parametrize("place", [(35.68, 139.69), (math.nan, 60.0), (500.0, 0.0)])
def test_coordinates_off_the_earth_are_refused(place: Point) -> None:
    for check in (lambda: widened(FINLAND, [("goal", place)]), lambda: require_inside("goal", place, FINLAND)):
        message = message_of(check)
        assert f"goal {place} is no place on the Earth" in message
        assert "longitude first" in message


def test_a_threat_that_reaches_the_map_or_is_off_it_either_way_round_passes() -> None:
    require_unswapped("threats.0", (60.2, 25.0), FINLAND, 5e6)
    require_unswapped("threats.0", (10.0, 60.0), FINLAND, 1.0)


@pytest.mark.parametrize(
    ("bounds", "words"),
    [
        ((24.0, 61.0, 25.0, 60.0), "empty"),
        ((24.0, 60.0, 24.0, 61.0), "empty"),
        ((24.0, 60.0, 25.0, 161.0), "(25.0, 161.0) is no place on the Earth"),
        ((24.0, 60.0, 25.0), "bounds"),
    ],
)
def test_malformed_bounds_are_refused(bounds: Bounds, words: str) -> None:
    assert words in message_of(box_of, bounds)
