"""Crossings of legs with areas: exact, except for roundings of the last digit of a file."""

import itertools
import math

import numpy as np
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.crossings import ClosedArea, crossings_of
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.testing.strategies import seeds


def areas_of(*shapes: shapely.Geometry) -> list[ClosedArea]:
    return [ClosedArea(f"area {number}", shape) for number, shape in enumerate(shapes)]


def route_of(*places: tuple[float, float]) -> FloatArray:
    return np.array(places, dtype=np.float64)


@st.composite
def maps(draw: st.DrawFn) -> tuple[FloatArray, list[ClosedArea]]:
    """Draw zigzag routes over stars and boxes, some of which overlap or share edges."""
    rng = np.random.default_rng(draw(seeds))
    shapes: list[shapely.Geometry] = []
    for _ in range(int(rng.integers(1, 5))):
        x, y = rng.integers(0, 8, 2).tolist()
        if rng.random() < 0.5:
            shapes.append(shapely.box(x, y, x + int(rng.integers(1, 4)), y + int(rng.integers(1, 4))))
        else:
            angles = np.sort(rng.uniform(0.0, 2.0 * math.pi, 9))
            radii = rng.uniform(0.5, 2.5, 9)
            shape = shapely.Polygon(np.column_stack([x + radii * np.cos(angles), y + radii * np.sin(angles)]))
            shapes += [shape] if shape.is_valid else []
    route = rng.integers(0, 11, (int(rng.integers(2, 6)), 2)).astype(np.float64)
    route = route[np.concatenate([[True], (route[1:] != route[:-1]).any(axis=1)])]
    return route, areas_of(*shapes)


@usual
@given(maps())
def test_legs_cross_as_the_oracle_says_and_where_shapely_says(found: tuple[FloatArray, list[ClosedArea]]) -> None:
    route, areas = found
    assume(len(route) > 1 and areas)
    crossings = crossings_of(route, areas)
    union = NoFlyArea(shapely.GeometryCollection([one.shape for one in areas]))
    assert crossings.legs.tolist() == np.nonzero(union.crosses(route[:-1], route[1:]))[0].tolist()
    assert len(crossings.rounded) == 0
    for leg, (start, end) in enumerate(itertools.pairwise(route)):
        line = shapely.LineString([start, end])
        for number, area in enumerate(areas):
            inside = math.fsum(one.inside for one in crossings.found if (one.leg, one.area) == (leg, number))
            within = shapely.intersection(line, area.shape).length
            on_edge = shapely.intersection(line, area.shape.boundary).length
            # a piece along an edge is inside only if another area lies on the other side
            assert within - on_edge - 1e-9 <= inside <= within + 1e-9
        far = 0.0 if leg in crossings.legs else shapely.distance(line, union.geometry)
        assert math.isclose(crossings.clearances[leg], far, abs_tol=1e-9)
    before = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(route, axis=0).T))])
    for one in crossings.found:
        for place, along in zip((one.entry, one.exit), one.along, strict=True):
            assert math.isclose(along, before[one.leg] + math.dist(place, route[one.leg]), abs_tol=1e-9)
        assert math.isclose(one.inside, one.along[1] - one.along[0], abs_tol=1e-9)


def test_waypoints_outside_and_a_leg_that_crosses() -> None:
    wall = shapely.box(4.0, 0.0, 5.0, 9.0)
    found = crossings_of(route_of((0, 5), (9, 5), (9, 20)), areas_of(wall))
    assert not shapely.contains_xy(wall, [0.0, 9.0, 9.0], [5.0, 5.0, 20.0]).any()
    assert found.legs.tolist() == [0]
    (one,) = found.found
    assert (one.entry, one.exit, one.along, one.inside) == ((4.0, 5.0), (5.0, 5.0), (4.0, 5.0), 1.0)


def test_two_areas_side_by_side_leave_no_way_between_them() -> None:
    left, right = shapely.box(0, 0, 1, 1), shapely.box(1, 0, 2, 1)
    found = crossings_of(route_of((1, -1), (1, 2)), areas_of(left, right))
    assert found.legs.tolist() == [0]
    assert [(one.area, one.inside) for one in found.found] == [(0, 1.0), (1, 1.0)]


def test_a_rounding_along_an_edge_is_no_crossing_and_the_thinnest_wall_is_one() -> None:
    box = areas_of(shapely.box(0.0, 0.0, 1000.0, 1000.0))
    # around the corner, too near by 4 mm; along the edge, by 5 mm
    corner = route_of((-500.0, 500.006), (500.0, -499.994))
    edge = route_of((-100.0, 0.0), (0.0, 0.005), (1000.0, 0.005), (1500.0, 0.0))
    for route in (corner, edge):
        exact, rounded = (crossings_of(route, box, rounding=much) for much in (0.0, 0.01))
        assert len(exact.legs) > 0
        assert (len(rounded.legs), rounded.found, len(rounded.rounded)) == (0, (), len(exact.legs))
    deeper = route_of((-100.0, 0.0), (0.0, 0.02), (1000.0, 0.02), (1500.0, 0.0))
    assert crossings_of(deeper, box, rounding=0.01).legs.tolist() == [1]
    # a wall that is thinner than the rounding, and cannot be dodged
    thin = areas_of(shapely.box(0.0, -10.0, 0.001, 10.0))
    assert crossings_of(route_of((-5, 0), (5, 0)), thin, rounding=0.01).legs.tolist() == [0]
    # a wall as thin as the spacing of floating-point numbers
    thinnest = areas_of(shapely.box(1.0, -10.0, math.nextafter(1.0, 2.0), 10.0))
    assert crossings_of(route_of((-5, 0.3), (5, 0.7)), thinnest, rounding=0.01).legs.tolist() == [0]
    # a hole of the area is not its outside
    ring = shapely.Polygon([(-9, -9), (9, -9), (9, 9), (-9, 9)], [[(-8.999, -8.999), (8.999, -8.999), (0, 8.999)]])
    assert crossings_of(route_of((0, 0), (0, -20)), areas_of(ring), rounding=0.01).legs.tolist() == [0]


def test_circles_around_waypoints_are_flown() -> None:
    box = areas_of(shapely.box(0, 0, 10, 10))
    route = route_of((-30, 5), (-3, 5), (-3, 50))
    found = crossings_of(route, box, radii=[0.0, 5.0, 0.0])
    assert found.legs.tolist() == []
    (one,) = found.found
    assert (one.is_circle, one.leg, one.area) == (True, 1, 0)
    # the chord at 3 of a circle of 5 spans twice the angle whose cosine is 3 / 5
    assert math.isclose(one.inside, 2 * math.acos(0.6) * 5, rel_tol=1e-3)
    assert crossings_of(route, box, radii=[0.0, 3.0, 0.0]).found == ()


def test_a_plan_of_one_place_and_a_map_without_areas() -> None:
    box = areas_of(shapely.box(0, 0, 1, 1))
    assert crossings_of(route_of((0.5, 0.5)), box).legs.tolist() == [0]
    assert crossings_of(route_of((2, 1)), box).clearances.tolist() == [1.0]
    assert crossings_of(route_of((0, 0), (1, 1)), []).clearances.tolist() == [math.inf]


def test_many_roundings_are_none_and_hide_nothing() -> None:
    """Along a comb whose teeth are 1 mm long; then through a wall behind it, and a thin one after that."""
    tips = [(x + side, y) for x in range(60) for side, y in ((0.2, 0.0), (0.3, 0.001), (0.7, 0.001), (0.8, 0.0))]
    comb = shapely.Polygon([(0.0, -50.0), (0.0, 0.0), *tips, (60.0, 0.0), (60.0, -50.0)])
    walls = areas_of(comb, shapely.box(70, -1, 72, 1), shapely.box(80, -9, 80.001, 9))
    level = 0.0005
    along = crossings_of(route_of((-5, level), (65, level)), walls, rounding=0.01)
    assert (along.legs.tolist(), along.rounded.tolist(), along.found) == ([], [0], ())
    through = crossings_of(route_of((-5, level), (90, level)), walls, rounding=0.01)
    assert through.legs.tolist() == [0]
    assert {1, 2} <= {one.area for one in through.found}
