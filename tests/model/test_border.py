"""The border of the map is no passage: areas that meet it close it, for the oracle and for every solver."""

import dataclasses
import math

import numpy as np
import oracles
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry.base import BaseGeometry
from strategies import few

from cgla_graph._types import Bounds, Point
from cgla_graph.certificate.certificate import is_separated
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import closed_area
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Status
from cgla_graph.solvers import solve
from cgla_graph.solvers.solving import lower_bound

ENDS = (0.1, 0.5), (0.9, 0.5)
OVER, UNDER = ([(0.1, 0.5), (0.1, y), (0.9, y), (0.9, 0.5)] for y in (1.0, 0.0))
CLOSING = {
    "wall": shapely.box(0.45, 0.0, 0.55, 1.0),
    "wall beyond": shapely.box(0.45, -0.1, 0.55, 1.1),
    "gaps": shapely.box(0.45, 1e-12, 0.55, 1.0 - 1e-12),
    "gaps of rounding": shapely.box(0.45, -1e-16, 0.55, 1.0 - 1e-16),
    "tips": shapely.Polygon([(0.5, 0.0), (0.6, 0.5), (0.5, 1.0), (0.4, 0.5)]),
    "tips that end short": shapely.Polygon([(0.5, 5e-10), (0.6, 0.5), (0.5, 1.0 - 5e-10), (0.4, 0.5)]),
    "upright tips": shapely.Polygon([(0.5, 0.0), (0.6, 0.5), (0.5, 1.0)]),
    "sharp tip": shapely.Polygon([(0.5, 0.0), (0.5001, 0.0), (0.5, 1.0)]),
    "slanted": shapely.Polygon([(0.2, 0.0), (0.3, 0.0), (0.8, 1.0), (0.7, 1.0)]),
    "with a hole": shapely.box(0.3, 0.0, 0.7, 1.0) - shapely.box(0.4, 0.2, 0.6, 1.0),
    "two halves": shapely.GeometryCollection([shapely.box(0.4, 0.0, 0.6, 0.5), shapely.box(0.5, 0.5, 0.7, 1.0)]),
    "a chain": shapely.union_all([shapely.box(0.3 + x, 0.0, 0.4 + x, 1.0) for x in (0.0, 0.1, 0.2)]),
    "collection": shapely.GeometryCollection([shapely.MultiPolygon([shapely.box(0.45, 0.0, 0.55, 1.0)])]),
}
FREE = {
    "apart": shapely.box(0.45, 0.1, 0.55, 0.9),
    "gaps of 2e-9": shapely.box(0.45, 2e-9, 0.55, 1.0 - 2e-9),
    "two that meet in a point": shapely.GeometryCollection(
        [shapely.box(0.3, -1.0, 0.5, 0.5), shapely.box(0.5, 0.5, 0.7, 2.0)]
    ),
}


@pytest.mark.parametrize("area", CLOSING.values(), ids=CLOSING)
@pytest.mark.parametrize(
    "place",
    [(1.0, 1.0, 0.0, 0.0), (3.0, 0.5, 0.0, 0.0), (1.0, 1.0, 1e6, 5e6), (1e5, 2e5, -4e5, 6e6)],
    ids=["unit", "wide", "far from the origin", "large"],
)
def test_an_area_that_meets_the_border_closes_it(
    area: BaseGeometry, place: Bounds, monkeypatch: pytest.MonkeyPatch
) -> None:
    # (the next test proves it, once)
    monkeypatch.setattr("cgla_graph.certificate.verdict.is_proven_closed", lambda _: False)
    width, height, east, north = place

    def there(points: object) -> np.ndarray:
        return np.asarray(points) * (width, height) + (east, north)

    if east and area in (CLOSING["sharp tip"], CLOSING["tips that end short"], CLOSING["gaps"]):
        pytest.skip("coordinates there are coarser")
    bounds = (east, north, east + width, north + height)
    start, goal = (tuple(there(end).tolist()) for end in ENDS)
    problem = Problem(start, goal, bounds=bounds, no_fly=shapely.transform(area, there))
    for along in (OVER, UNDER):
        assert problem.evaluate(there(along)).violations == ("segment 1 crosses the no-fly area",)
    assert solve(problem, "cgla", resolution=11).status is Status.NO_PATH
    assert not solve(problem, "visibility-graph").status.has_path
    # the closed area is closed
    assert closed_area(problem.model.no_fly, problem.bounds) is problem.model.no_fly


@pytest.mark.parametrize("area", [area for name, area in CLOSING.items() if name != "sharp tip"])
def test_it_is_proven_that_no_path_passes(area: BaseGeometry) -> None:
    problem = Problem(*ENDS, no_fly=area)
    assert is_separated(problem)
    assert lower_bound(problem).lower_bound == math.inf


@pytest.mark.parametrize("area", FREE.values(), ids=FREE)
def test_nothing_is_proven_where_paths_pass(area: BaseGeometry) -> None:
    assert not is_separated(Problem(*ENDS, no_fly=area))


@pytest.mark.parametrize("area", FREE.values(), ids=FREE)
def test_other_areas_stay_as_they_are(area: BaseGeometry) -> None:
    problem = Problem(*ENDS, no_fly=area)
    assert problem.model.no_fly is area
    assert problem.area is problem.model.area
    assert solve(problem, "visibility-graph").status.has_path


def test_the_free_border_and_the_areas_given_stay() -> None:
    wall = shapely.box(0.45, 0.0, 0.55, 0.8)
    problem = Problem(*ENDS, no_fly=wall)
    assert problem.evaluate(OVER).feasible
    assert problem.evaluate(OVER).clearance == pytest.approx(0.2)
    assert problem.no_fly is wall
    assert problem.area_as_given.geometry.equals(wall)
    assert problem == Problem(*ENDS, no_fly=shapely.box(0.45, 0.0, 0.55, 0.8))
    # along the wall, to the border and back
    assert problem.evaluate([(0.1, 0.5), (0.45, 0.5), (0.45, 0.0), (0.1, 0.5)]).feasible


#: A map inside of [0, 4] x [0, 4], so that areas end on its border, go beyond it, and touch it from outside.
INNER: Bounds = (1.0, 1.0, 3.0, 3.0)
GRID = np.array([(x / 2, y / 2) for x in range(2, 7) for y in range(2, 7)])
TOUCHING = [
    [shapely.box(1.5, 1, 2, 2), shapely.Polygon([(2, 1), (3, 2), (2.5, 3)])],
    [shapely.box(1.5, 0, 2, 2), shapely.Polygon([(2, 1), (3, 2), (2.5, 3)])],
    [shapely.box(1, 1.5, 2, 2), shapely.box(1, 2.5, 2, 3), shapely.Polygon([(1, 2), (1.5, 2.5), (2, 2.5)])],
    [shapely.Polygon([(1, 1), (1.5, 1), (1.5, 1.5)]), shapely.Polygon([(1, 1), (1, 1.5), (1.5, 2)])],
]


@st.composite
def touching_areas(draw: st.DrawFn) -> list[shapely.Polygon]:
    """Draw boxes and triangles with corners on halves, which may touch but not overlap."""
    halves = st.integers(0, 8).map(lambda i: i / 2)
    areas: list[shapely.Polygon] = []
    for a, b, c in draw(st.lists(st.tuples(*[st.tuples(halves, halves)] * 3), min_size=2, max_size=5)):
        area = shapely.Polygon([a, b, c]) if draw(st.booleans()) else shapely.box(*a, *b)
        if area.is_valid and area.area > 0.0 and all((area & other).area == 0.0 for other in areas):
            areas.append(area)
    return areas


def ways_at(whole: BaseGeometry, place: Point) -> int:
    """Count the ways from a place on the border into the map that areas leave free, by the parts of a small disc."""
    here = shapely.Point(place)
    free = shapely.get_parts((here.buffer(0.02) & shapely.box(*INNER)) - whole)
    return int(((shapely.area(free) > 1e-7) & (shapely.distance(free, here) < 1e-9)).sum())


@few
@given(touching_areas(), st.lists(st.sampled_from(GRID.tolist()), min_size=5, max_size=9))
def test_no_path_passes_between_the_border_and_any_of_some_areas(
    areas: list[shapely.Polygon], places: list[list[float]]
) -> None:
    _check_touching(areas, np.array(places))


@pytest.mark.parametrize("areas", TOUCHING)
@pytest.mark.parametrize("side", range(4))
def test_no_path_passes_between_two_areas_that_meet_on_the_border(areas: list[shapely.Polygon], side: int) -> None:
    _check_touching([shapely.affinity.rotate(area, 90 * side, origin=(2, 2)) for area in areas], GRID)


def _check_touching(areas: list[shapely.Polygon], places: np.ndarray) -> None:
    """Compare which segments are closed with shapely's answers, and with those for some of the areas."""
    first, second = np.repeat(places, len(places), axis=0), np.tile(places, (len(places), 1))

    def is_closed(some: list[shapely.Polygon]) -> np.ndarray:
        closed = closed_area(shapely.GeometryCollection(some), INNER)
        return NoFlyArea(closed).crosses(first, second)

    found = is_closed(areas)
    whole = shapely.union_all(areas)
    lines = oracles.lines_between(first, second)
    inside = oracles.crosses(whole, first, second)
    meets = shapely.intersects(lines, whole & shapely.MultiLineString(oracles.sides_of(INNER)))
    assert not (found & ~inside & ~meets).any()
    corners = {corner for area in areas for corner in area.exterior.coords}
    tips = [corner for corner in corners if shapely.box(*INNER).touches(shapely.Point(corner))]
    passing = shapely.intersects(lines, shapely.MultiPoint([tip for tip in tips if ways_at(whole, tip) > 1]))
    assert found[inside | passing].all()
    for number in range(len(areas)):
        alone = is_closed([areas[number]])
        # (at its end on a stretch that the other ones close, a tip is a way in)
        ends = [tip for tip in tips if ways_at(whole, tip) <= 1]
        assert not (alone & ~found & ~shapely.intersects(lines, shapely.MultiPoint(ends))).any()


def test_places_on_edges_of_areas_that_meet_the_border_are_free() -> None:
    for corners, place in (
        ([(1, 4), (2, 4), (3.5, 2.5)], (3, 3)),
        ([(1, 4), (2, 4), (3.5, 2.5)], (2, 4)),
        ([(0, 0.5), (3, 2.5), (2, 1.5)], (1.5, 1.5)),
    ):
        problem = Problem(place, (0, 0), bounds=(0, 0, 4, 4), no_fly=shapely.Polygon(corners))
        assert problem.evaluate([place, place]).feasible


@few
@given(st.integers(1, 26), st.integers(1, 26), st.integers(1, 27), st.integers(2, 27), st.sampled_from([7, 10]))
def test_the_ends_of_a_closed_stretch_and_the_edges_from_there_are_free(
    one: int, other: int, x: int, y: int, parts: int
) -> None:
    """They are where they were given, to the last bit: their corners are not moved."""
    assume(one != other and y < 4 * parts)
    wall = shapely.Polygon([(one / parts, 0), (other / parts, 0), (x / parts, y / parts)])
    tip = (x / parts, y / parts)
    for end in ((one / parts, 0.0), (other / parts, 0.0)):
        assert Problem(end, tip, bounds=(0, 0, 4, 4), no_fly=wall).evaluate([end, tip]).feasible


@pytest.mark.parametrize("name", ["start", "goal"])
@pytest.mark.parametrize("x", [0.46, 0.5, 0.54])
def test_an_end_on_a_closed_stretch_is_refused(name: str, x: float) -> None:
    ends = {"start": ENDS[0], "goal": ENDS[1], name: (x, 1.0)}
    for area in (CLOSING["wall"], CLOSING["gaps"]):
        words = rf"{name} \({x}, 1.0\) is where the no-fly area meets the border .* is closed; move"
        with pytest.raises(ProblemError, match=words):
            Problem(**ends, no_fly=area)


def test_ends_at_corners_that_areas_hold_are_refused() -> None:
    for area in (shapely.box(0, 0.9, 0.1, 1), shapely.Polygon([(0, 1), (0.1, 1), (0.1, 0.9)])):
        with pytest.raises(ProblemError, match=r"start \(0.0, 1.0\) is where the no-fly area meets the border"):
            Problem((0, 1), (0.5, 0.5), no_fly=area)


def test_an_area_outside_closes_the_stretch_that_it_touches() -> None:
    problem = Problem(*ENDS, no_fly=shapely.box(0.4, 1.0, 0.6, 1.2))
    assert not problem.evaluate(OVER).feasible
    assert problem.evaluate(UNDER).feasible
    frame = Problem(*ENDS, no_fly=shapely.box(-1, -1, 2, 2) - shapely.box(0, 0, 1, 1))
    assert not frame.evaluate(OVER).feasible
    assert frame.evaluate(ENDS).feasible


def test_corners_of_the_map_are_closed() -> None:
    cap = shapely.Polygon([(1.0, 1.0), (0.7, 0.8), (0.8, 0.7)])
    problem = Problem((0.8, 0.99), (0.99, 0.8), no_fly=cap)
    assert not problem.evaluate([(0.8, 0.99), (1.0, 1.0), (0.99, 0.8)]).feasible
    assert not problem.evaluate([(0.8, 0.99), (0.8, 1.0), (1.0, 1.0), (1.0, 0.8), (0.99, 0.8)]).feasible


@pytest.mark.parametrize("clearance", [0.1, 0.05])
@pytest.mark.parametrize("short", [0.0, 1e-12, -1e-12, 5e-10])
def test_areas_at_the_clearance_from_the_border_close_it(clearance: float, short: float) -> None:
    for area in (
        shapely.box(0.45, clearance + short, 0.55, 1.0 - clearance - short),
        shapely.Polygon([(0.5, clearance + short), (0.6, 0.5), (0.5, 1.0 - clearance - short), (0.4, 0.5)]),
    ):
        problem = Problem(*ENDS, no_fly=area, clearance=clearance)
        for along in (OVER, UNDER):
            assert not problem.evaluate(along).feasible
            assert problem.relaxed().evaluate(along).violations == ("segment 1 crosses the no-fly area",)
        assert solve(problem, "cgla", resolution=11).status is Status.NO_PATH
        assert is_separated(problem.relaxed())
    free = Problem(*ENDS, no_fly=shapely.box(0.45, 0.2, 0.55, 0.8), clearance=0.1)
    assert free.evaluate(OVER).feasible
    assert free.relaxed().evaluate(OVER).feasible


def test_invalid_areas_at_the_border_are_refused_as_anywhere() -> None:
    bow = shapely.Polygon([(0.4, 0.0), (0.6, 1.0), (0.6, 0.0), (0.4, 1.0)])
    for area in (bow, shapely.GeometryCollection([shapely.box(0.1, 0.7, 0.2, 0.8), bow])):
        with pytest.raises(ProblemError, match="is invalid: Self-intersection"):
            Problem(*ENDS, no_fly=area)
    with pytest.raises(ProblemError, match="overlap or share edges"):
        Problem(*ENDS, no_fly=shapely.MultiPolygon([shapely.box(0.3, 0, 0.5, 1), shapely.box(0.4, 0, 0.6, 1)]))


def _walls(side: int, at: float, width: float, length: float, slant: float) -> list[shapely.Polygon]:
    """Draw a wall from a side of the unit square inwards; the second goes on beyond, by 10 % of the square."""
    turned = [
        lambda x, y: (x, y),
        lambda x, y: (x, 1.0 - y),
        lambda x, y: (y, x),
        lambda x, y: (1.0 - y, x),
    ][side]
    ends = [(0.0, length), (-0.1, length + 0.1 * (length == 1.0))]
    return [
        shapely.Polygon([turned(at + more + slant * y, y) for y, more in ((a, 0), (a, width), (b, width), (b, 0))])
        for a, b in ends
    ]


@few
@given(
    st.integers(0, 3),
    st.floats(0.2, 0.7),
    st.floats(0.01, 0.1),
    st.one_of(st.just(1.0), st.floats(0.5, 0.9)),
    st.one_of(st.just(0.0), st.floats(-0.1, 0.1)),
    st.sampled_from(["cgla", "eight-direction", "visibility-graph", "bendy-ruler", "lazy-theta-star"]),
)
def test_a_wall_to_the_border_is_the_wall_that_goes_on_beyond(
    side: int, at: float, width: float, length: float, slant: float, solver: str
) -> None:
    field = RiskField([Threat(0.5, 0.5, spread=0.1)])
    ends = np.array([(0.05, 0.3), (0.95, 0.4)])[:, :: -1 if side > 1 else 1].tolist()
    first, second = (
        Problem(tuple(ends[0]), tuple(ends[1]), field, 3.0, no_fly=wall)
        for wall in _walls(side, at, width, length, slant)
    )
    here, beyond = (solve(problem, solver, resolution=12) for problem in (first, second))
    assert here.status is beyond.status
    assert here.status is not Status.INFEASIBLE
    assert here.cost == pytest.approx(beyond.cost, rel=1e-9)
    assert dataclasses.replace(first, k=1.0).model.no_fly is first.model.no_fly
