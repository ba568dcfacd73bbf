"""Metres around a point of the Earth."""

import copy
import itertools
import math
import pickle
from collections.abc import Callable, Sequence

import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection, box_around, project_area

GEOD = pyproj.Geod(ellps="WGS84")
longitudes = st.floats(-180.0, 180.0)
origins = st.builds(LocalProjection, longitude=longitudes, latitude=st.floats(-90.0, 90.0))
azimuths = st.floats(-180.0, 180.0)


@given(origin=origins, azimuth=azimuths, distance=st.floats(0.0, 2e6))
def test_inverse_undoes_forward(origin: LocalProjection, azimuth: float, distance: float) -> None:
    longitude, latitude, _ = GEOD.fwd(origin.longitude, origin.latitude, azimuth, distance)
    back = origin.inverse(origin.forward([longitude, latitude]))
    turn = math.remainder(back[0] - longitude, 360.0)
    # A degree of longitude shrinks towards the poles, and is nothing at them.
    assert abs(turn) * math.cos(math.radians(latitude)) <= 1e-9
    assert abs(back[1] - latitude) <= 1e-9


@given(longitudes, st.floats(-90.0, 90.0), azimuths, st.floats(0.0, 1.0), st.floats(1.0, 2e6))
def test_a_box_around_a_place_contains_all_within_a_distance(
    x: float, y: float, azimuth: float, share: float, distance: float
) -> None:
    longitude, latitude, _ = GEOD.fwd(x, y, azimuth, share * distance)
    west, south, east, north = box_around((x, y), distance)
    assert south - 1e-9 <= latitude <= north + 1e-9
    assert x + math.remainder(longitude - x, 360.0) == pytest.approx(
        0.5 * (west + east), abs=0.5 * (east - west) + 1e-9
    )


@given(origin=origins, longitude=longitudes, latitude=st.floats(-90.0, 90.0))
def test_distance_from_the_origin_is_the_geodesic(origin: LocalProjection, longitude: float, latitude: float) -> None:
    geodesic = GEOD.inv(origin.longitude, origin.latitude, longitude, latitude)[2]
    assert math.hypot(*origin.forward([longitude, latitude])) == pytest.approx(geodesic, rel=0.0, abs=1e-6)


@given(origin=origins, longitude=longitudes, latitude=st.floats(-90.0, 90.0))
def test_forward_is_the_projection_of_proj(origin: LocalProjection, longitude: float, latitude: float) -> None:
    twin = pyproj.Proj(f"+proj=aeqd +lon_0={origin.longitude} +lat_0={origin.latitude} +datum=WGS84")
    metres = origin.forward([longitude, latitude])
    # PROJ takes what is within 1e-10 radians of the origin or the equator as on it: 0.6 mm, more far away.
    assume(np.hypot(*metres) < 1e7)
    np.testing.assert_allclose(metres, twin(longitude, latitude), rtol=0.0, atol=2e-3)


@given(origin=origins, azimuth=azimuths, distance=st.floats(0.0, 2.0003e7))
def test_what_inverse_gives_forward_takes(origin: LocalProjection, azimuth: float, distance: float) -> None:
    angle = math.radians(azimuth)
    lonlat = origin.inverse([distance * math.sin(angle), distance * math.cos(angle)])
    assert np.all(np.abs(lonlat) <= (180.0, 90.0))
    assert np.isfinite(origin.forward(lonlat)).all()


@pytest.mark.parametrize("latitude", [0.0, 30.0, 60.0, 85.0])
@pytest.mark.parametrize(("distance", "most", "least"), [(1e5, 4.2e-5, 4.0e-5), (3e5, 3.8e-4, 3.6e-4)])
def test_scale_error_is_as_documented(latitude: float, distance: float, most: float, least: float) -> None:
    projection = LocalProjection(25.0, latitude)
    around, turned = (angles.ravel() for angles in np.meshgrid(np.arange(0.0, 360.0, 10.0), np.arange(0, 360, 10)))
    start = np.broadcast_to(25.0, around.shape), np.broadcast_to(latitude, around.shape)
    there = GEOD.fwd(*start, around, np.full(around.shape, distance))
    step = GEOD.fwd(there[0], there[1], turned, np.full(around.shape, 100.0))
    moved = projection.forward(np.stack(step[:2], axis=-1)) - projection.forward(np.stack(there[:2], axis=-1))
    error = np.hypot(*moved.T) / 100.0 - 1.0
    assert least < error.max() < most
    assert error.min() > -1e-9


@given(latitude=st.floats(-90.0, 90.0), azimuth=azimuths, distance=st.floats(1.0, 1.9e7), share=st.floats(0.0, 1.0))
def test_stretch_bounds_the_scale_in_every_direction(
    latitude: float, azimuth: float, distance: float, share: float
) -> None:
    projection = LocalProjection(25.0, latitude)
    longitude, north, _ = GEOD.fwd(25.0, latitude, azimuth, share * distance)
    assume(abs(north) < 89.999)
    factors = pyproj.Proj(f"+proj=aeqd +lon_0=25 +lat_0={latitude!r} +datum=WGS84").get_factors(longitude, north)
    # PROJ differentiates numerically
    assert factors.tissot_semiminor >= 1.0 - 1e-6
    assert factors.tissot_semimajor <= projection.stretch(distance) * (1.0 + 1e-6)


def test_stretch_is_no_more_than_needed_at_the_equator() -> None:
    # there the curvature is the one that the bound takes for all places; north and south are across
    projection = LocalProjection(0.0, 0.0)
    (one, two) = projection.forward([GEOD.fwd(5.0, 0.0, azimuth, 50.0)[:2] for azimuth in (0.0, 180.0)])
    distance = GEOD.inv(0.0, 0.0, 5.0, 0.0)[2]
    assert math.dist(one, two) / 100.0 == pytest.approx(projection.stretch(distance), rel=1e-6)


def test_far_away_there_is_no_bound_of_the_stretch() -> None:
    projection = LocalProjection(25.0, 60.0)
    assert projection.stretch(1.99e7) > 100.0
    assert projection.stretch(2e7) == math.inf
    for bound in (0.0, math.inf, math.nan):
        found = projection.bound_on_earth(bound, (0.0, 0.0), (1e5, 0.0), (-2e5, -2e5, 2e5, 2e5))
        assert found == pytest.approx(bound, nan_ok=True)


@given(
    start=st.tuples(longitudes, st.floats(-90.0, 90.0)),
    azimuth=azimuths,
    distance=st.floats(0.0, 3e6),
    middle=st.lists(st.tuples(st.floats(-1.0, 1.0), st.floats(-1.0, 1.0)), max_size=3),
)
def test_a_bound_on_the_earth_holds_for_lines_on_the_earth(
    start: tuple[float, float], azimuth: float, distance: float, middle: list[tuple[float, float]]
) -> None:
    """The bound of a path's own length on the plane is none above its length on the Earth."""
    goal = GEOD.fwd(*start, azimuth, distance)[:2]
    projection = LocalProjection.between(start, goal)
    ends = projection.forward([start, goal])
    path = np.vstack([ends[0], distance * np.reshape(middle, (-1, 2)), ends[1]])
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    side = float(np.abs(path).max()) + 1.0
    bound = projection.bound_on_earth(length, tuple(ends[0]), tuple(ends[1]), (-side, -side, side, side))
    on_earth = GEOD.line_length(*projection.inverse(finely(path)).T)
    # the vertices between which geodesics are laid cut off bends
    assert bound <= on_earth * (1.0 + 1e-5)
    assert on_earth <= length * (1.0 + 1e-9) + 1e-6
    if not middle:
        assert bound <= GEOD.inv(*start, *goal)[2]
        assert bound == pytest.approx(distance, rel=1e-9, abs=2e-6)


def finely(path: FloatArray) -> FloatArray:
    """Lay 200 points on each side of a path."""
    share = np.linspace(0.0, 1.0, 200)[:, None]
    return np.vstack([(1.0 - share) * one + share * two for one, two in itertools.pairwise(path)])


@given(start=st.tuples(longitudes, st.floats(-90.0, 90.0)), azimuth=azimuths, distance=st.floats(0.0, 1e7))
def test_between_is_halfway(start: tuple[float, float], azimuth: float, distance: float) -> None:
    goal = GEOD.fwd(*start, azimuth, distance)[:2]
    one, two = LocalProjection.between(start, goal).forward([start, goal])
    assert math.hypot(*one) == pytest.approx(0.5 * distance, abs=1e-6)
    np.testing.assert_allclose(one, -two, atol=1e-6 + 1e-9 * distance)


@pytest.mark.parametrize("shape", [(2,), (0, 2), (5, 2), (2, 3, 2)])
def test_shape_is_kept_and_input_unchanged(shape: tuple[int, ...]) -> None:
    lonlat = np.random.default_rng(0).uniform(-5.0, 5.0, size=shape)
    before = lonlat.copy()
    projection = LocalProjection(0.0, 0.0)
    metres = projection.forward(lonlat)
    assert metres.shape == shape
    assert metres.dtype == np.float64
    np.testing.assert_allclose(projection.inverse(metres), lonlat, rtol=0.0, atol=1e-9)
    np.testing.assert_array_equal(lonlat, before)


def test_centred_on_the_middle() -> None:
    assert LocalProjection.centred_on((-180.0, -90.0, 180.0, 90.0)) == LocalProjection(0.0, 0.0)
    assert LocalProjection.centred_on((170.0, 0.0, -160.0, 2.0)) == LocalProjection(-175.0, 1.0)


def test_an_area_is_projected_with_its_straight_edges() -> None:
    square = shapely.box(24.0, 59.5, 26.0, 60.5)
    before = square.wkt
    projection = LocalProjection.centred_on(square.bounds)
    projected = project_area(square, projection)
    assert square.wkt == before
    # of an edge of 110 km, the middle would be off by 400 m if only its ends were projected
    edges = projection.forward(shapely.get_coordinates(shapely.segmentize(square, 1e-3)))
    assert shapely.distance(shapely.points(edges), projected.exterior).max() < 1.0
    outline = shapely.segmentize(square, 1e-3)
    assert projected.area == pytest.approx(abs(GEOD.geometry_area_perimeter(outline)[0]), rel=1e-4)
    assert project_area(shapely.MultiPolygon(), projection).is_empty


def test_a_used_projection_can_be_copied_pickled_and_compared() -> None:
    projection = LocalProjection(longitude=np.float64(25.0), latitude=60)
    metres = projection.forward([26.0, 61.0])
    assert repr(projection) == "LocalProjection(longitude=25.0, latitude=60.0)"
    for twin in (pickle.loads(pickle.dumps(projection)), copy.deepcopy(projection)):  # noqa: S301 - our own bytes
        assert twin == projection
        assert hash(twin) == hash(projection)
        np.testing.assert_array_equal(twin.forward([26.0, 61.0]), metres)


AT_ORIGIN = LocalProjection(0.0, 0.0)


@pytest.mark.parametrize(
    ("ask", "given", "words"),
    [
        (LocalProjection, (180.1, 0.0), "origin holds [180.1, 0.0] at index 0; longitude must be in [-180, 180]"),
        (LocalProjection, (0.0, math.inf), "finite"),
        (LocalProjection, ("east", 0.0), "not an array of numbers"),
        (LocalProjection, ([1.0, 2.0], [3.0, 4.0]), "shape (2, 2)"),
        (AT_ORIGIN.forward, [[[0.0, 0.0], [0.0, 90.5]]], "lonlat holds [0.0, 90.5] at index (1,); longitude must be"),
        (AT_ORIGIN.forward, [[[[0.0, 0.0], [math.nan, 0.0]]]], "finite"),
        (AT_ORIGIN.forward, [[1.0, 2.0, 3.0]], "lonlat has shape (3,)"),
        (AT_ORIGIN.forward, [[[1.0, 2.0], [3.0]]], "not an array of numbers"),
        (AT_ORIGIN.inverse, [[[0.0, 0.0], [3e7, 0.0]]], "metres holds [30000000.0, 0.0]; no place on the Earth"),
        (AT_ORIGIN.inverse, [[math.inf, 0.0]], "finite"),
        (LocalProjection.centred_on, [(0.0, 5.0, 1.0, 4.0)], "south 5.0 greater than north 4.0"),
        (LocalProjection.centred_on, [(0.0, 0.0, 181.0, 1.0)], "bounds holds [181.0, 1.0] at index (1,)"),
        (LocalProjection.centred_on, [(0.0, 0.0, 1.0)], "got 3 numbers: pass four"),
        (LocalProjection.centred_on, [(0.0, math.nan, 1.0, 1.0)], "finite"),
        (LocalProjection.centred_on, [("a", "b", "c", "d")], "not an array of numbers"),
    ],
)
def test_what_is_malformed_is_refused(ask: Callable[..., object], given: Sequence[object], words: str) -> None:
    with pytest.raises(ProblemError) as caught:
        ask(*given)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)
