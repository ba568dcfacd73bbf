"""
No-fly areas: what crosses, what only touches, and what is refused.

Two oracles. Where all coordinates are small integers and halves, shapely's ``relate_pattern`` is exact. With
general doubles it is not (it misjudges about one of 2000 segments that touch a boundary), so there the oracle
is rational arithmetic: cut the segment at every edge, and test the middle of every piece.
"""

import itertools
import math
import pickle
from collections.abc import Callable, Sequence
from fractions import Fraction
from typing import TypeAlias

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from oracles import crosses
from shapely.geometry.base import BaseGeometry
from strategies import examples

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly import MAX_ROWS_PER_EDGE, NoFlyArea
from cgla_graph.model.no_fly_kernels import AreaArrays, expansion_sign, orientation, segment_crosses

Rational: TypeAlias = tuple[Fraction, Fraction]
RationalEdge: TypeAlias = tuple[Rational, Rational]
Case: TypeAlias = tuple[NoFlyArea, FloatArray, FloatArray]

fast = examples(120)  # the first example compiles
CELL = shapely.box(0, 0, 1, 1)


# Oracles


def side(a: Rational, b: Rational, c: Rational) -> int:
    determinant = (a[0] - c[0]) * (b[1] - c[1]) - (a[1] - c[1]) * (b[0] - c[0])
    return (determinant > 0) - (determinant < 0)


def rational(point: Sequence[float] | FloatArray) -> Rational:
    return Fraction(float(point[0])), Fraction(float(point[1]))


def rational_edges(area: NoFlyArea) -> list[RationalEdge]:
    rings = shapely.get_rings(shapely.get_parts(area.geometry))
    return [
        pair
        for ring in rings
        for pair in itertools.pairwise(rational(vertex) for vertex in shapely.get_coordinates(ring))
    ]


def rational_inside(point: Rational, edges: list[RationalEdge]) -> bool:
    inside = False
    for a, b in edges:
        turn = side(a, b, point)
        within = all(min(a[i], b[i]) <= point[i] <= max(a[i], b[i]) for i in (0, 1))
        if turn == 0 and within:
            return False
        if (a[1] > point[1]) != (b[1] > point[1]) and (turn > 0) == (b[1] > a[1]):
            inside = not inside
    return inside


def rational_crosses(start: FloatArray, end: FloatArray, edges: list[RationalEdge]) -> bool:
    p, q = rational(start), rational(end)
    if p == q:
        return rational_inside(p, edges)
    step = (q[0] - p[0], q[1] - p[1])
    cuts = {Fraction(0), Fraction(1)}
    for a, b in edges:
        edge, gap = (b[0] - a[0], b[1] - a[1]), (a[0] - p[0], a[1] - p[1])
        across = step[0] * edge[1] - step[1] * edge[0]
        if across:
            if 0 <= (gap[0] * step[1] - gap[1] * step[0]) / across <= 1:
                cuts.add((gap[0] * edge[1] - gap[1] * edge[0]) / across)
        elif gap[0] * step[1] == gap[1] * step[0]:
            length = step[0] ** 2 + step[1] ** 2
            cuts |= {((v[0] - p[0]) * step[0] + (v[1] - p[1]) * step[1]) / length for v in (a, b)}
    within = sorted(cut for cut in cuts if 0 <= cut <= 1)
    middles = [(low + high) / 2 for low, high in itertools.pairwise(within)]
    return any(rational_inside((p[0] + t * step[0], p[1] + t * step[1]), edges) for t in middles)


# Strategies


def reals(low: float, high: float) -> st.SearchStrategy[float]:
    # Tinier numbers are beyond the exact arithmetic, as the class says.
    return st.floats(low, high).map(lambda value: 0.0 if abs(value) < 1e-100 else value)


@st.composite
def segments(
    draw: st.DrawFn, area: NoFlyArea, plain: st.SearchStrategy[float], parts: tuple[float, ...] = (0.5, 0.25)
) -> Case:
    """Draw segments that often end on vertices and edges, run along edges and pass through vertices."""
    corners = shapely.get_coordinates(area.geometry)
    assume(len(corners))
    vertex = st.sampled_from(list(corners))
    on_edge = st.tuples(st.integers(0, len(corners) - 2), st.sampled_from(parts)).map(
        lambda pick: corners[pick[0]] + pick[1] * (corners[pick[0] + 1] - corners[pick[0]])
    )
    anywhere = st.tuples(plain, plain).map(np.array)
    in_line = st.tuples(st.sampled_from(corners[:, 0].tolist()), st.sampled_from(corners[:, 1].tolist()))
    point = st.one_of(vertex, on_edge, in_line.map(np.array), anywhere)
    starts = np.array(draw(st.lists(point, min_size=8, max_size=8)))
    ends = np.array(draw(st.lists(point, min_size=8, max_size=8)))
    if draw(st.booleans()):
        ends = 2 * ends - starts
    return area, starts, ends


@st.composite
def star_cases(draw: st.DrawFn) -> Case:
    radii = np.array(draw(st.lists(reals(0.2, 3.0), min_size=3, max_size=9)))
    angles = 2 * math.pi * np.arange(len(radii)) / len(radii)
    centre = [draw(reals(-1, 1)), draw(reals(-1, 1))]
    polygon = shapely.Polygon(centre + radii[:, None] * np.column_stack([np.cos(angles), np.sin(angles)]))
    assume(polygon.is_valid)
    return draw(segments(NoFlyArea(polygon), reals(-4, 4), (0.5, 0.3)))


@st.composite
def triangle_cases(draw: st.DrawFn) -> Case:
    corner = st.tuples(reals(-3, 3), reals(-3, 3))
    corners = draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=3))
    triangles = [shapely.Polygon(triple) for triple in corners]
    joined = shapely.union_all([triangle for triangle in triangles if triangle.is_valid])
    assume(joined.is_valid and not joined.is_empty)
    return draw(segments(NoFlyArea(joined), reals(-4, 4), (0.5, 0.3)))


@st.composite
def lattice_polygon_cases(draw: st.DrawFn) -> Case:
    whole = st.integers(0, 5)
    corners = [(0, 0), (draw(st.integers(1, 5)), 0), (draw(whole), draw(st.integers(1, 5)))]
    for corner in draw(st.lists(st.tuples(whole, whole), max_size=6)):
        bent = [[*corners[:i], corner, *corners[i:]] for i in range(len(corners))]
        corners = next((ring for ring in bent if shapely.Polygon(ring).is_valid), corners)
    return draw(segments(NoFlyArea(shapely.Polygon(corners)), st.integers(-2, 12).map(lambda n: n / 2)))


@st.composite
def touching_ring_cases(draw: st.DrawFn) -> Case:
    """Draw lattice triangles as holes or as parts, whose corners often touch edges of other rings."""
    corner = st.tuples(st.integers(0, 6), st.integers(0, 6))
    as_holes = draw(st.booleans())
    rings: list[tuple[Point, Point, Point]] = []
    shape: BaseGeometry = shapely.Polygon()
    for ring in draw(st.lists(st.tuples(corner, corner, corner), min_size=1, max_size=6)):
        more = [*rings, ring]
        bigger: BaseGeometry = (
            shapely.Polygon([(0, 0), (6, 0), (6, 6), (0, 6)], more)
            if as_holes
            else shapely.MultiPolygon([shapely.Polygon(one) for one in more])
        )
        if bigger.is_valid:
            rings, shape = more, bigger
    assume(rings)
    return draw(segments(NoFlyArea(shape), st.integers(-2, 14).map(lambda n: n / 2)))


def cells(mask: int, size: int = 6) -> NoFlyArea:
    chosen = [n for n in range(size * size) if mask >> n & 1]
    boxes = [shapely.box(n % size, n // size, n % size + 1, n // size + 1) for n in chosen]
    return NoFlyArea(shapely.union_all(boxes))


@st.composite
def cell_cases(draw: st.DrawFn) -> Case:
    area = cells(draw(st.integers(1, 2**36 - 1)))
    return draw(segments(area, st.integers(-1, 14).map(lambda n: n / 2)))


def check(case: Case) -> None:
    area, starts, ends = case
    found = area.crosses(starts, ends)
    edges = rational_edges(area)
    expected = [rational_crosses(start, end, edges) for start, end in zip(starts, ends, strict=True)]
    assert found.tolist() == expected
    assert area.crosses(ends, starts).tolist() == expected


# The predicate


@fast
@given(st.one_of(star_cases(), triangle_cases(), cell_cases()))
def test_it_matches_rational_arithmetic(case: Case) -> None:
    check(case)


def test_several_holes_that_touch_one_edge() -> None:
    left = np.array([[(0, 2), (1, 1.5), (1, 2.5)], [(0, 4), (1, 3.5), (1, 4.5)]])
    # Two corners on each of the four sides.
    holes = [*left, *(6 - left), *left[..., ::-1], *(6 - left[..., ::-1])]
    area = NoFlyArea(shapely.Polygon([(0, 0), (6, 0), (6, 6), (0, 6)], holes))
    points = np.stack(np.meshgrid(np.arange(13) / 2, np.arange(13) / 2), axis=-1).reshape(-1, 2)
    assert (
        area.crosses(points[:, None], points) == crosses(area.geometry, *np.broadcast_arrays(points[:, None], points))
    ).all()


@pytest.mark.parametrize(
    "cases", [lattice_polygon_cases(), pytest.param(touching_ring_cases(), marks=pytest.mark.slow), cell_cases()]
)
@examples(200)
@given(st.data())
def test_it_matches_shapely(cases: st.SearchStrategy[Case], data: st.DataObject) -> None:
    area, starts, ends = data.draw(cases)
    expected = crosses(area.geometry, starts, ends)
    assert (area.crosses(starts, ends) == expected).all()
    assert (area.crosses(ends, starts) == expected).all()
    inside = shapely.contains(area.geometry, shapely.points(starts))
    assert (area.contains(starts) == inside).all()
    assert (area.crosses(starts, starts) == inside).all()


@fast
@given(cell_cases(), st.tuples(st.integers(-1000, 1000), st.integers(-1000, 1000)))
def test_moving_everything_changes_nothing(case: Case, shift: tuple[int, int]) -> None:
    area, starts, ends = case
    moved = NoFlyArea(shapely.transform(area.geometry, lambda points: points + shift))
    assert (moved.crosses(starts + shift, ends + shift) == area.crosses(starts, ends)).all()


RING = CELL.buffer(1, join_style="mitre").difference(CELL)  # a hole from (0, 0) to (1, 1)
NOTCHED = shapely.Polygon([(0, 0), (4, 0), (4, 4), (0, 4)], [[(0, 2), (2, 1), (2, 3)]])  # a hole that touches
# A hole whose corner touches the other's edge.
TWO_HOLES = shapely.Polygon(
    [(0, 0), (4, 0), (4, 4), (0, 4)], [[(1, 1), (2, 1), (2, 2), (1, 2)], [(2, 1.5), (3, 1), (3, 2)]]
)
DIAGONAL = shapely.MultiPolygon([CELL, shapely.box(1, 1, 2, 2)])
TRIPLE = shapely.MultiPolygon([shapely.Polygon([(0, 0), a, b]) for a, b in [
    ((4, 0), (3, 1)), ((1, 3), (0, 4)), ((-4, 0), (0, -4)),
]])  # fmt: skip


@pytest.mark.parametrize(
    ("geometry", "free", "crossing"),
    [
        # along edges, through and up to corners, away from an edge, far away
        (CELL, "-1 0 2 0, 0 0 1 0, .25 0 .75 0, -1 1 1 -1, -1 -1 0 0, 0 .5 -1 .5, 5 5 6 6",
         # inwards through a corner, from corner to corner and edge to edge, inside, outwards
         "-1 -1 .5 .5, 0 0 1 1, 0 .5 .5 0, .2 .2 .3 .3, .5 .5 5 5"),
        # in the hole and along it
        (RING, "0 0 1 1, .5 .5 .5 1, 0 0 0 1", ".5 .5 .5 1.5, 0 -1 0 2"),
        # through the point where the hole touches, and past it
        (NOTCHED, "-1 2 2 2, 0 0 0 4", "-1 2 2.5 2"),
        # between two cells, and along both
        (DIAGONAL, "0 2 2 0, 0 1 2 1, .5 1.5 1 1", "0 0 2 2"),
        # from hole to hole, through the point where they touch
        (TWO_HOLES, "1 1.5 3 1.5", "1 1.5 3 1.75, 2 .5 2 3"),
        (TRIPLE, "0 0 2 2, 0 0 -2 2, 2 -2 -2 2, -2 6 1 -3", "0 0 -1 -1, .5 1.75 -.5 -1.75"),
    ],
)  # fmt: skip
def test_known_cases(geometry: BaseGeometry, free: str, crossing: str) -> None:
    area = NoFlyArea(geometry)
    for segments_, expected in ((free, False), (crossing, True)):
        ends = np.array([segment.split() for segment in segments_.split(",")], dtype=float)
        assert (area.crosses(ends[:, :2], ends[:, 2:]) == expected).all()
        assert (area.crosses(ends[:, 2:], ends[:, :2]) == expected).all()


@pytest.mark.parametrize("width", [0.005, 1e-12, math.ulp(0.5)])
def test_a_thin_wall_is_never_jumped(width: float) -> None:
    # Tests of points along the segment, or of its middle, miss such a wall.
    wall = NoFlyArea(shapely.box(0.5, 0, 0.5 + width, 1))
    rng = np.random.default_rng(0)
    starts, ends = rng.random((2, 5000, 2))
    starts[:, 0] *= 0.5
    ends[:, 0] = 1 - ends[:, 0] * (0.5 - width) * (1 - 1e-9)
    assert wall.crosses(starts, ends).all()
    assert not wall.crosses(starts[:-1], starts[1:]).any()


def test_a_sliver_between_neighbouring_doubles_is_seen() -> None:
    # No double lies inside this triangle: only exact signs can tell.
    sliver = NoFlyArea(shapely.Polygon([(0, 0), (1, 1), (1, math.nextafter(1, 2))]))
    assert sliver.crosses([0.25, 0.75], [0.75, 0.25])
    assert not sliver.crosses([0.25, 0.25], [0.75, 0.75])


# The orientation


@st.composite
def nearly_in_line(draw: st.DrawFn) -> tuple[float, ...]:
    a, b = [(draw(reals(-1e3, 1e3)), draw(reals(-1e3, 1e3))) for _ in range(2)]
    t = draw(st.floats(-2, 2))
    c = [a[i] + t * (b[i] - a[i]) for i in (0, 1)]
    c = [c[i] + draw(st.integers(-3, 3)) * math.ulp(c[i]) if abs(c[i]) > 1e-100 else 0.0 for i in (0, 1)]
    return *a, *b, *c


@examples(500)
@example((0.5, 0.5, 12.0, 12.0, 24.0, 24.0))
@example((0.1, 0.1, 0.3, 0.3, 0.7, 0.7))
@example((1e120, 1e120, -1e120, -1e120, 1e-120, 1e-120))
@example((1e-120, 1e-120, 1e-119, 1e-119, 2e-120, 2e-120))
@given(nearly_in_line())
def test_orientation_is_exact(values: tuple[float, ...]) -> None:
    a, b, c = (rational(values[i : i + 2]) for i in (0, 2, 4))
    assert orientation(*values) == side(a, b, c)
    assert expansion_sign(*values) == side(a, b, c)


def test_orientation_is_exact_around_a_point() -> None:
    # Shewchuk's grid: plain floats give a wild pattern here.
    ulp = 2.0**-53
    grid = range(-16, 17)
    for i, j in itertools.product(grid, grid):
        assert orientation(12.0, 12.0, 24.0, 24.0, 0.5 + i * ulp * 2, 0.5 + j * ulp * 2) == (j > i) - (j < i)


# The index


@pytest.mark.parametrize("density", [0.02, 0.3, 0.7])
@pytest.mark.parametrize(("scale", "shift"), [(1.0, 0), (-0.5, 2**20)])
def test_many_slabs_give_the_same_answers(density: float, scale: float, shift: int) -> None:
    rng = np.random.default_rng(1)
    i, j = (rng.random((40, 40)) < density).nonzero()
    cells_ = shapely.union_all(shapely.box(i, j, i + 1, j + 1))
    area = NoFlyArea(shapely.transform(cells_, lambda points: scale * points + shift))
    assert len(area.kernel_arrays[1]) > 10
    starts = scale * rng.integers(-4, 84, (1500, 2)) / 2 + shift
    steps = rng.integers(-40, 41, (1500, 2)) / rng.choice([2, 8, 32], (1500, 1))
    ends = starts + scale * steps
    expected = crosses(area.geometry, starts, ends)
    assert expected.any()
    assert not expected.all()
    assert (area.crosses(starts, ends) == expected).all()
    assert (area.contains(starts) == shapely.contains(area.geometry, shapely.points(starts))).all()


def test_tall_edges_keep_the_index_small() -> None:
    n = 2000
    comb = np.column_stack([np.arange(2 * n) / 2, np.tile([0.0, 1.0, 1.0, 0.0], n // 2)])
    area = NoFlyArea(shapely.Polygon([*comb, (n, -1), (0, -1)]))
    _, slab_starts, rows = area.kernel_arrays
    assert len(rows) <= MAX_ROWS_PER_EDGE * 2.1 * n
    assert len(slab_starts) > 2
    x = np.arange(1, n - 2, 2.0)
    gap = np.column_stack([x + 0.75, np.full(len(x), 0.25)])
    assert not area.crosses(gap, gap + np.array([0, 2])).any()
    assert area.crosses(gap, gap + np.array([1, 0])).all()


def test_a_kernel_can_call_the_predicate() -> None:
    @kernel
    def count(points: FloatArray, area: AreaArrays) -> int:
        total = 0
        for p in points:
            for q in points:
                total += segment_crosses(p[0], p[1], q[0], q[1], area)
        return total

    points = np.array([[-1.0, 0.5], [2.0, 0.5], [2.0, 3.0]])
    assert count(points, NoFlyArea(CELL).kernel_arrays) == 2
    assert count(points, NoFlyArea(None).kernel_arrays) == 0


# The class


def test_shapes_broadcast() -> None:
    area = NoFlyArea(CELL)
    points = np.array([[-1.0, 0.5], [2.0, 0.5], [2.0, 3.0]])
    crossing = area.crosses(points[:, None], points)
    assert crossing.shape == (3, 3)
    assert (crossing == crossing.T).all()
    assert area.crosses(points[0], points).shape == (3,)
    assert area.crosses([0, 0], [1, 1]).shape == ()
    assert area.crosses(np.empty((0, 2)), [1, 1]).shape == (0,)
    assert area.contains(points[None, :, None]).shape == (1, 3, 1)


@pytest.mark.parametrize(
    "geometry", [None, shapely.Polygon(), shapely.GeometryCollection(), shapely.MultiPolygon(), shapely.Point()]
)
def test_an_empty_area_stops_nobody(geometry: BaseGeometry | None) -> None:
    area = NoFlyArea(geometry)
    assert area.is_empty
    assert area.geometry.is_empty
    assert not area.crosses([[0, 0], [0, 0]], [[1, 1], [0, 0]]).any()
    assert not area.contains([0, 0])
    assert area.path_clearance([[0, 0], [1, 1]]) == math.inf
    other = NoFlyArea(CELL).kernel_arrays
    assert [array.dtype for array in area.kernel_arrays] == [array.dtype for array in other]


def test_the_geometry_is_the_flat_oriented_union() -> None:
    clockwise = shapely.Polygon([(0, 0, 7), (0, 1, 7), (0, 1, 7), (1, 1, 7), (1, 0, 7)])
    parts = [clockwise, shapely.MultiPolygon([shapely.box(0.5, 0, 2, 1), shapely.box(5, 5, 6, 6)])]
    area = NoFlyArea(shapely.GeometryCollection(parts))
    assert not area.is_empty
    assert not area.geometry.has_z
    assert area.geometry.area == 3
    assert all(part.exterior.is_ccw for part in shapely.get_parts(area.geometry))
    assert [ring.is_ccw for ring in shapely.get_rings(NoFlyArea(RING).geometry)] == [True, False]
    assert area.crosses([0.7, 0.5], [0.9, 0.5])  # no edge of the overlap is left
    assert NoFlyArea(clockwise).contains([0.5, 0.5])


def test_an_area_does_not_change_and_changes_nothing() -> None:
    area = NoFlyArea(DIAGONAL)
    before = DIAGONAL.wkb
    points = np.array([[0.0, 2.0], [2.0, 0.0]])
    points.setflags(write=False)
    area.crosses(points, points[::-1])
    area.contains(points)
    area.path_clearance(points)
    assert DIAGONAL.wkb == before
    for array in (area.edges, *area.kernel_arrays):
        with pytest.raises(ValueError, match="read-only"):
            array[...] = 0
    with pytest.raises(AttributeError):
        area.geometry = CELL  # type: ignore[misc]


@pytest.mark.parametrize("width", [1e-2, 1e-4, 1e-7])
@pytest.mark.parametrize("scale", [1e-30, 1.0, 1e30])
@pytest.mark.parametrize("degrees", [0.0, 28.0, 117.0])
def test_the_thinnest_wall_is_found_where_it_is_part_of_more(width: float, scale: float, degrees: float) -> None:
    wall, block = shapely.box(-0.4, -0.5 * width, 0.6, 0.5 * width), shapely.box(0.5, -0.3, 0.9, 0.3)
    across = shapely.affinity.rotate(wall, 60.0, origin=(0.0, 0.0))
    for geometry in (wall, wall.union(block), wall.union(across), shapely.box(-1, -1, 1, 1).difference(block)):
        turned = shapely.affinity.rotate(geometry, degrees, origin=(0.0, 0.0))
        found = NoFlyArea(shapely.affinity.scale(turned, scale, scale, origin=(0.0, 0.0))).thinnest
        expected = 0.1 if geometry.area > 1.0 else width
        assert found == pytest.approx(scale * expected, rel=0.02, abs=1e-9 * width * scale)


@given(st.integers(3, 200), st.floats(0.5, 1.0), st.integers(0, 10**6))
@fast
def test_what_is_as_wide_as_it_is_long_has_no_thin_part(n: int, least: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angles = (np.arange(n) + rng.uniform(0.0, 0.5)) * 2.0 * math.pi / n
    radii = rng.uniform(least, 1.0, n) if n > 8 else np.ones(n)
    polygon = shapely.Polygon(np.column_stack([radii * np.cos(angles), radii * np.sin(angles)]))
    area = NoFlyArea(polygon)
    assert area.thinnest <= 2.0 * polygon.area / polygon.length
    if n < 20:
        assert area.thinnest > 0.1
    assert NoFlyArea(None).thinnest == math.inf


def test_pickling() -> None:
    area = NoFlyArea(NOTCHED)
    copy = pickle.loads(pickle.dumps(area))  # noqa: S301 (our own bytes)
    assert copy.geometry.wkb == area.geometry.wkb
    for mine, theirs in zip((area.edges, *area.kernel_arrays), (copy.edges, *copy.kernel_arrays), strict=True):
        assert (mine == theirs).all()
        assert not theirs.flags.writeable
    assert repr(copy) == "NoFlyArea(1 polygons, 8 edges)"


@pytest.mark.parametrize(
    ("path", "clearance"),
    [
        ([[3, 0]], 2),
        ([[3, 0], [3, 5], [4, 5]], 2),
        ([[3, 0], [3, 0]], 2),
        ([[1, 1], [2, 2]], 0),
        ([[-1, 0.5], [2, 0.5]], 0),
        ([[0.5, 0.5]], 0),
        ([[4, 5], [4, 8]], 5),
    ],
)
def test_path_clearance(path: list[list[float]], clearance: float) -> None:
    assert NoFlyArea(CELL).path_clearance(path) == pytest.approx(clearance, abs=1e-15)


@pytest.mark.parametrize(
    ("geometry", "touching"),
    [(CELL, []), (RING, []), (NOTCHED, [[0, 2]]), (TWO_HOLES, [[2, 1.5]]), (shapely.Polygon(), [])],
)
def test_convex_corners_are_those_of_the_hull_and_those_between_rings_that_touch(
    geometry: BaseGeometry, touching: list[list[float]]
) -> None:
    outer = np.unique(shapely.get_coordinates(geometry.convex_hull), axis=0).tolist()
    assert NoFlyArea(geometry).convex_corners().tolist() == sorted([*outer, *touching])


# Refusals

BOW_TIE = shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)])


@pytest.mark.parametrize(
    ("geometry", "words"),
    [
        (shapely.Point(0, 0), "Point.*buffer"),
        (shapely.LineString([(0, 0), (1, 1)]), "LineString.*buffer"),
        (shapely.GeometryCollection([CELL, shapely.Point(0, 0)]), r"part \[1\].*Point.*buffer"),
        (BOW_TIE, "Self-intersection.*make_valid"),
        (shapely.MultiPolygon([shapely.box(4, 4, 5, 5), BOW_TIE]), r"part \[1\].*Self-intersection"),
        (
            shapely.GeometryCollection([CELL, shapely.GeometryCollection([CELL, BOW_TIE])]),
            r"part \[1\]\[1\].*Self-intersection",
        ),
        (shapely.MultiPolygon([CELL, shapely.box(0.5, 0, 2, 1)]), "overlap.*union_all"),
        (shapely.MultiPolygon([CELL, shapely.box(1, 0, 2, 1)]), "share edges.*union_all"),
        (shapely.box(0, 0, 1, math.inf), "inf.*finite"),
        (shapely.box(0, 0, 1, 1e121), r"1e\+121.*at most 1e\+120"),
        ([CELL], "list.*GeometryCollection"),
    ],
    ids=str,
)
def test_other_geometry_is_refused(geometry: BaseGeometry, words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        NoFlyArea(geometry)


@pytest.mark.parametrize(
    ("ask", "words"),
    [
        (lambda area: area.crosses([1, 2, 3], [1, 2]), r"starts.*\(3,\)"),
        (lambda area: area.crosses([1, 2], 5), r"ends.*\(\)"),
        (lambda area: area.crosses([1, 2], [math.nan, 0]), "ends.*nan.*finite"),
        (lambda area: area.crosses(np.zeros((2, 2)), np.zeros((3, 2))), r"\(2, 2\).*\(3, 2\).*broadcast"),
        (lambda area: area.contains([[1, 2], [3]]), "points.*shape"),
        (lambda area: area.contains([-math.inf, 0]), "points.*-inf"),
        (lambda area: area.contains([1e300, 0]), r"points.*1e\+300.*1e\+120"),
        (lambda area: area.path_clearance([1, 2]), r"path.*\(2,\).*\(m, 2\)"),
        (lambda area: area.path_clearance(np.empty((0, 2))), r"path.*\(0, 2\).*at least one"),
    ],
)
def test_malformed_points_are_refused(ask: Callable[[NoFlyArea], object], words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        ask(NoFlyArea(CELL))
