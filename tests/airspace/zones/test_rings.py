"""Rings of zones: holes that are none, and edges of more than 180 degrees of longitude."""

from functools import reduce
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few
from zone_files import data_of, ed269, ed318, geojson, kml, kmz, layer, polygon, volume

from cgla_graph.airspace.zones import rings
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.airspace.zones.rings import area_of, directed_rings
from cgla_graph.errors import FileFormatError
from cgla_graph.scenarios.area_tables import drawn_area
from cgla_graph.testing.strategies import seeds

Ring = list[list[float]]


def box(west: float, south: float, east: float, north: float) -> Ring:
    """Return the corners of a box as they are written, also across the antimeridian."""
    return [[west, south], [east, south], [east, north], [west, north], [west, south]]


def documents(*outline: Ring) -> dict[str, Any]:
    """Return a file in each format with a note, whose zone has these rings."""
    geometry = {"type": "Polygon", "coordinates": list(outline), "layer": layer()}
    several = {**geometry, "type": "MultiPolygon", "coordinates": [list(outline)]}
    drawn = kml(f"<Placemark><name>Castle</name>{polygon(*outline)}</Placemark>")
    flat = {"type": "Polygon", "coordinates": list(outline)}
    return {
        "ED-269": ed269(volume(horizontalProjection=flat)),
        "ED-318": ed318(geometry),
        "ED-318 of parts": ed318(several),
        "KML": drawn,
        "KMZ": kmz(drawn),
    }


OUTER = box(6.0, 49.0, 7.0, 50.0)
HOLES = {
    "swapped": ([box(5.0, 48.0, 8.0, 51.0)], rings.OUTSIDE),
    "apart": ([box(9.0, 49.0, 9.5, 49.5)], rings.OUTSIDE),
    "across": ([box(6.5, 49.2, 7.5, 49.4)], rings.OUTSIDE),
    "touching from outside": ([box(7.0, 49.2, 7.5, 49.4)], rings.OUTSIDE),
    "along the outline": ([box(6.0, 49.2, 6.5, 49.4)], rings.TOUCHES),
    "the same": ([OUTER], rings.TOUCHES),
    "two that overlap": ([box(6.1, 49.1, 6.5, 49.5), box(6.4, 49.4, 6.8, 49.8)], rings.TOUCHES),
    "one in another": ([box(6.1, 49.1, 6.5, 49.5), box(6.2, 49.2, 6.3, 49.3)], rings.TOUCHES),
    "a bow": ([[[6.1, 49.1], [6.5, 49.5], [6.5, 49.1], [6.1, 49.5], [6.1, 49.1]]], rings.TOUCHES),
    "a line": ([[[6.1, 49.1], [6.5, 49.5], [6.1, 49.1], [6.1, 49.1]]], rings.EMPTY),
}


@pytest.mark.parametrize("case", HOLES)
def test_a_hole_that_is_none_opens_nothing(case: str) -> None:
    """All that any reading closes is closed in every format, and the note says why; GeoJSON has no notes: an error."""
    holes, remark = HOLES[case]
    every = shapely.union_all([shapely.make_valid(shapely.Polygon(ring)) for ring in (OUTER, *holes)])
    for kind, document in documents(OUTER, *holes).items():
        applied = zones_of(data_of(document), "mine").apply()
        (verdict,) = applied.closed
        assert verdict.area is not None
        assert verdict.area.covers(every), kind
        assert verdict.area.area == pytest.approx(every.area), kind
        assert [note.partition(": ")[2] for note in applied.account().notes()] == [remark], kind
    with pytest.raises(FileFormatError, match="is no valid area"):
        zones_of(data_of(geojson(OUTER, *holes)), "mine")


@pytest.mark.parametrize(
    "holes",
    [
        [box(6.1, 49.1, 6.5, 49.5), box(6.6, 49.1, 6.8, 49.5)],
        [[[6.0, 49.5], [6.3, 49.3], [6.3, 49.7], [6.0, 49.5]]],
        [box(6.1, 49.1, 6.3, 49.3), box(6.3, 49.3, 6.5, 49.5)],
    ],
    ids=["inside", "a corner on the outline", "a common corner"],
)
def test_holes_are_open(holes: list[Ring]) -> None:
    """A hole may touch another ring in a point; a bad hole beside it does not close it."""
    area, remark = area_of([OUTER, *holes], "a zone")
    assert (area.equals(shapely.Polygon(OUTER, holes)), remark) == (True, "")
    mixed, said = area_of([OUTER, *holes, box(9, 49, 10, 50)], "a zone")
    assert (round(mixed.area - area.area, 9), said) == (1.0, rings.OUTSIDE)


@few
@given(seed=seeds, count=st.integers(1, 4))
def test_no_reading_of_holes_is_open(seed: int, count: int) -> None:
    """Compare with shapely: the difference of all rings, and the even-odd rule; valid polygons stay as they are."""
    rng = np.random.default_rng(seed)
    lows = rng.integers(0, 8, (count + 1, 2))
    sides = [shapely.box(*low, *(low + rng.integers(1, 8, 2))) for low in lows]
    sides[0] = sides[0] if rng.random() < 0.5 else shapely.box(0, 0, 16, 16)
    first, *others = sides
    area, remark = area_of([shapely.get_coordinates(one).tolist() for one in sides], "a zone")
    assert area.is_valid
    for closed in (first.difference(shapely.union_all(others)), reduce(shapely.symmetric_difference, sides)):
        assert closed.difference(area).area <= 1e-9
    assert area.difference(shapely.union_all(sides)).area <= 1e-9
    strict = shapely.Polygon(first.exterior, [one.exterior for one in others])
    assert (remark == "") == strict.is_valid
    assert not strict.is_valid or area.equals(strict)


def test_very_many_holes_that_overlap_are_read_at_once() -> None:
    corners = [box(1 + 0.001 * n, 1 + 0.001 * n, 4 + 0.001 * n, 4 + 0.001 * n) for n in range(3000)]
    area, remark = area_of([box(0, 0, 9, 9), *corners], "a zone")
    assert (area.area, remark) == (81.0, rings.TOUCHES)


COUNTRY = box(5.0, 45.0, 8.0, 48.0)


@pytest.mark.parametrize(
    "mask",
    [
        box(-180, -90, 180, 90),
        box(-179, -89, 179, 89),
        box(-178, 40, 178, 60),
        box(-100, -60, 100, 60),
        box(-90, 0, 90, 60),
        box(170, 80, -170, -80),
        [[-180, -90], [180, -90], [180, 90], [90, 90], [0, 90], [-90, 90], [-180, 90], [-180, -90]],
        [[-175, -80], [175, -80], [175, 80], [90, 80], [0, 80], [-90, 80], [-175, 80], [-175, -80]],
    ],
    ids=str,
)
def test_all_outside_of_a_country_is_closed(mask: Ring) -> None:
    """A ring around the map with a hole is closed everywhere but in the hole, in either direction."""
    for border in (mask, mask[::-1]):
        for kind, document in {**documents(border, COUNTRY), "GeoJSON": geojson(border, COUNTRY)}.items():
            (layer_of,) = zones_of(data_of(document), "mine").zones[0].layers
            assert layer_of.area.equals(shapely.Polygon(border, [COUNTRY])), kind
            assert not layer_of.area.covers(shapely.Point(6.5, 46.5)), kind


@pytest.mark.parametrize("edge", [181.0, 200.0, 340.0, 358.0])
def test_a_long_edge_without_a_hole_is_closed_both_ways(edge: float) -> None:
    """Which way it goes is not known, unless the ring is compact the shorter way; without notes, it is an error."""
    ring = box(-edge / 2, -50.0, edge / 2, 50.0)
    for border in (ring, ring[::-1]):
        for document in documents(border).values():
            applied = zones_of(data_of(document), "mine").apply()
            area = applied.closed[0].area
            assert area is not None
            assert area.bounds == (-edge / 2, -50.0, 360.0 - edge / 2, 50.0)
            assert area.area == pytest.approx(36_000.0)
            assert rings.BOTH_WAYS in applied.account().notes()[0]
        with pytest.raises(FileFormatError, match=f"spans {edge:g} degrees of longitude"):
            zones_of(data_of(geojson(border)), "mine")
        with pytest.raises(FileFormatError, match=r"no_fly\.polygons\.0.*spans"):
            drawn_area("no_fly.polygons.0", border, lonlat=True)


def test_holes_with_long_edges() -> None:
    """A compact hole goes across the antimeridian; another one is closed."""
    zone = [np.array(ring, dtype=float) for ring in (box(170, 0, -170, 20), box(179, 5, -179, 10))]
    assert directed_rings(zone, "a zone")[1][:, 0].max() == 181.0
    wide, remark = area_of([box(120, -20, -120, 20), box(150, 0, 151, 1)], "a zone")
    assert (wide.bounds, wide.area, remark) == ((120.0, -20.0, 240.0, 20.0), 4799.0, rings.SHORT_WAY)
    area, remark = area_of([box(-60, -80, 60, 80), box(-170, -70, 170, 70)], "a zone")
    assert remark == rings.UNCLEAR
    assert area.covers(shapely.box(-170, -70, 170, 70))
    mixed, remark = area_of([box(-178, 40, 178, 60), COUNTRY, box(175, 41, -175, 45)], "a zone")
    assert remark == rings.BOTH_WAYS
    assert mixed.covers(shapely.box(-178, 40, 182, 60))
