"""Shapes of zones: circles, the antimeridian, rings that cross themselves, and many corners."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.airspace.zones import shapes
from cgla_graph.airspace.zones.rings import area_of, polygon_of
from cgla_graph.airspace.zones.shapes import circle_of, joined, part_near, ring_of, with_fewer_corners
from cgla_graph.errors import FileFormatError
from cgla_graph.model.earth import LocalProjection, geodesic_lengths, project_area
from cgla_graph.testing.strategies import seeds

KEYS = ("center", "radius")


@few
@given(longitude=st.floats(-180, 180), latitude=st.floats(-80, 80), radius=st.floats(0.5, 200_000.0))
def test_a_circle_is_inside_its_polygon(longitude: float, latitude: float, radius: float) -> None:
    """Check geodesics to points along its edges, which are straight in degrees, and on a map."""
    polygon = circle_of([longitude, latitude], radius, "a zone", KEYS)
    rim = shapely.get_coordinates(shapely.segmentize(polygon, polygon.length / 2000))
    lengths = geodesic_lengths((longitude, latitude), rim)
    assert radius <= lengths.min()
    assert lengths.max() <= 1.0011 * radius
    middle = LocalProjection(longitude, latitude)
    assert shapely.distance(project_area(polygon, middle).exterior, shapely.Point(0, 0)) >= radius * (1 - 1e-6)


def test_circles_near_a_pole_have_more_corners() -> None:
    """Edges that are straight in degrees bend inwards there by more than the margin of 72 corners."""
    place, radius = (10.0, 80.0), 300_000.0
    polygon = circle_of(list(place), radius, "a zone", KEYS)
    assert len(polygon.exterior.coords) > 73
    assert geodesic_lengths(place, shapely.get_coordinates(shapely.segmentize(polygon, 0.01))).min() >= radius


@pytest.mark.parametrize(("place", "radius"), [([0.0, 89.999], 1000.0), ([0.0, 90.0], 5.0), ([0.0, 0.0], 0.0)])
def test_circles_that_are_refused(place: list[float], radius: float) -> None:
    with pytest.raises(FileFormatError, match=r"pole|radius"):
        circle_of(place, radius, "a zone", KEYS)


def test_rings_across_the_antimeridian_are_in_one_piece() -> None:
    for turn in (lambda x: x, lambda x: -x):
        ring = ring_of([[turn(x), y] for x, y in ([179, 0], [-179, 0], [-179, 1], [179, 1], [179, 0])], "a zone")
        area, _ = polygon_of(
            [ring, ring_of([[-179.5, 0.2], [-179.2, 0.2], [-179.2, 0.4], [-179.5, 0.2]], "a hole")], "a"
        )
        assert area.bounds == (179.0, 0.0, 181.0, 1.0)
        assert area.area == pytest.approx(2.0 - 0.03)
    # areas that are cut in two as in RFC 7946 are joined
    cut = [shapely.box(179, 0, 180, 1), shapely.box(-180, 0, -179, 1)]
    assert joined(cut).equals(shapely.box(179, 0, 181, 1))
    assert joined(cut[:1]).equals(cut[0])


@pytest.mark.parametrize(
    ("ring", "said"),
    [
        ([[-90, 0], [90, 0], [0, 50], [-90, 0]], "spans 180 degrees"),
        ([[0, 80], [120, 80], [-120, 80], [0, 80]], "goes around a pole"),
    ],
)
def test_ambiguous_rings_are_refused(ring: list[list[float]], said: str) -> None:
    with pytest.raises(FileFormatError, match=said):
        area_of([ring], "a zone")


@few
@given(seed=seeds)
def test_a_ring_that_crosses_itself_grows(seed: int) -> None:
    """Points that are inside by the even-odd rule stay inside."""
    ring = np.random.default_rng(seed).random((8, 2))
    ring[-1] = ring[0]
    area, remark = polygon_of([ring, ring * 0.01], "a zone")
    odd = shapely.make_valid(shapely.Polygon(ring))
    assert area.is_valid
    assert remark or shapely.Polygon(ring).is_valid
    assert shapely.difference(odd, area.buffer(1e-9)).area <= (1e-9 if remark else 1.0)


def test_all_that_a_ring_encloses_is_inside() -> None:
    """The middle of a star is inside, although it is outside by the even-odd rule."""
    angle = np.radians(144.0 * np.arange(6))
    area, remark = polygon_of([np.column_stack([np.sin(angle), np.cos(angle)])], "a zone")
    assert area.contains(shapely.Point(0, 0))
    assert "crosses itself" in remark


def test_a_ring_of_very_many_crossings_is_refused_at_once() -> None:
    ring = np.random.default_rng(1).random((20_000, 2))
    ring[-1] = ring[0]
    with pytest.raises(FileFormatError, match="crosses itself too often"):
        polygon_of([ring], "a zone")


@few
@given(seed=seeds, corners=st.integers(30, 3000), wave=st.floats(0.0, 0.3))
def test_fewer_corners_never_shrink_an_area(seed: int, corners: int, wave: float) -> None:
    rng = np.random.default_rng(seed)
    angle = np.linspace(0.0, 2.0 * math.pi, corners, endpoint=False)
    radius = 5000.0 * (1.0 + wave * np.sin(5.0 * angle) + 0.02 * rng.random(corners))
    hole = 1000.0 * (1.0 + 0.05 * rng.random(corners))
    rings = [np.column_stack([size * np.cos(angle), size * np.sin(angle)]) for size in (radius, hole)]
    area = shapely.Polygon(rings[0], [rings[1]])
    fewer, beyond = with_fewer_corners(area, 100, 200.0)
    assert fewer.is_valid
    assert fewer.contains(area)
    assert beyond <= 200.0
    assert shapely.get_num_coordinates(fewer) <= shapely.get_num_coordinates(area)
    assert shapely.distance(shapely.points(shapely.get_coordinates(fewer)), area).max() <= beyond + 1e-6
    assert with_fewer_corners(area, 10**6, 200.0) == (area, 0.0)


def test_parts_near_a_map() -> None:
    zone = shapely.box(170, 0, 190, 1)
    assert part_near(zone, (-185.0, -1.0, -175.0, 2.0)).bounds == (-185.0, 0.0, -175.0, 1.0)  # type: ignore[union-attr]
    assert part_near(zone, (165.0, -1.0, 195.0, 2.0)) is zone
    assert part_near(zone, (0.0, -1.0, 1.0, 2.0)) is None


def test_millions_of_corners_are_read_as_arrays() -> None:
    ring = [[6.0 + 1e-6 * n, 49.0] for n in range(200_000)]
    assert len(ring_of([*ring, [6.0, 50.0], ring[0]], "a zone")) == 200_002
    assert shapes.positions_of([*ring, [6.0, True]]) is None
