"""
The mesh of a spline: a plain grid where there is no area, and cut open along walls but never across a way.

The property that the certificate rests on: whatever the control values, the spline is continuous along every segment
that does not cross the area.
"""

import itertools
import math
from types import SimpleNamespace

import networkx as nx
import numpy as np
import oracles
import pytest
import shapely
import strategies
from hypothesis import assume, example, given
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry.base import BaseGeometry
from strategies import examples

from cgla_graph._types import BoolArray, Bounds, FloatArray, IntArray, Point, WholeArray
from cgla_graph.eikonal import cell_runs, mesh_kernels
from cgla_graph.eikonal.marching import costs_to_go
from cgla_graph.eikonal.mesh import HALO, NO_CELL, SplineMesh, corners, width_at_rim
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem
from cgla_graph.testing import strategies as drawn

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)
Last = tuple[int, int]

lasts = st.tuples(st.integers(1, 12), st.integers(1, 12))


def full(bounds: Bounds, last: Last, area: BaseGeometry | None, ends: list[Point]) -> SplineMesh:
    return SplineMesh.build(bounds, last, cell_runs.rectangle(last), NoFlyArea(area), ends)


def places(mesh: SplineMesh) -> list[Point]:
    return list(zip(mesh.node_columns.tolist(), mesh.node_rows.tolist(), strict=True))


# A grid


@st.composite
def some_cells(draw: st.DrawFn) -> tuple[Last, WholeArray]:
    """Draw a grid and some of its cells, at least one."""
    last = draw(lasts)
    rng = np.random.default_rng(draw(drawn.seeds))
    chosen = rng.random((last[1] + 1, last[0] + 1)) < draw(st.sampled_from([0.02, 0.3, 1.0]))
    chosen[rng.integers(last[1] + 1), rng.integers(last[0] + 1)] = True
    rows, columns = np.nonzero(chosen)
    return last, cell_runs.runs_of(columns, rows)


@given(some_cells())
@strategies.usual
def test_cells_that_touch_share_the_nodes_between_them(cells: tuple[Last, WholeArray]) -> None:
    last, runs = cells
    mesh = SplineMesh.build((2.0, -1.0, 4.0, 5.0), last, runs, NoFlyArea(None), [(2.0, -1.0)])
    wanted = cell_runs.cells_of(cell_runs.clipped(cell_runs.dilated(runs, HALO), last))
    assert mesh.columns.tolist() == wanted[0].tolist()
    assert mesh.rows.tolist() == wanted[1].tolist()
    assert mesh.matters.tolist() == oracles.are_in(*wanted, runs)
    at = places(mesh)
    cell_list = list(zip(mesh.columns.tolist(), mesh.rows.tolist(), strict=True))
    controls = {
        cell: dict(zip(around(cell), row, strict=True))
        for cell, row in zip(cell_list, mesh.controls.tolist(), strict=True)
    }
    used = set()
    for cell, slots in controls.items():
        assert [at[q] for q in slots.values()] == list(slots)
        used |= set(slots.values())
        for other in around(cell):
            shared = controls.get(other, {})
            assert all(slots[place] == shared[place] for place in slots.keys() & shared.keys())
    assert used == set(range(mesh.n_nodes))
    assert mesh.ends == (cell_list.index((0, 0)) if (0, 0) in controls else -1,)


def around(cell: tuple[int, int]) -> list[tuple[int, int]]:
    return [(cell[0] + a, cell[1] + b) for b in (-1, 0, 1) for a in (-1, 0, 1)]


@given(lasts)
@strategies.few
def test_without_an_area_the_mesh_is_a_grid(last: Last) -> None:
    mesh = full((2.0, -1.0, 4.0, 5.0), last, None, [])
    nodes = [(i, j) for j in range(-1, last[1] + 2) for i in range(-1, last[0] + 2)]
    at = places(mesh)
    assert sorted(at) == sorted(nodes)
    number = {place: n for n, place in enumerate(at)}
    for (i, j), beside in zip(at, mesh.neighbours.tolist(), strict=False):
        wanted = [(i - 1, j), (i + 1, j), (i, j - 1), (i, j + 1)]
        assert beside == [number.get(place, mesh.n_nodes) for place in wanted]
    assert mesh.neighbours[-1].tolist() == [mesh.n_nodes] * 4
    np.testing.assert_allclose(mesh.node_points, np.array(at) * mesh.spacing + np.array(mesh.origin))
    assert mesh.outside.tolist() == [not (0 <= i <= last[0] and 0 <= j <= last[1]) for i, j in at]


def test_what_is_near_on_the_map_has_near_numbers() -> None:
    """Row by row, half of all neighbours would be 203 numbers away, and fronts would wait for memory."""
    mesh = full(UNIT, (200, 200), None, [])
    beside = mesh.neighbours[:-1].astype(np.int64)
    apart = np.abs(beside - np.arange(mesh.n_nodes)[:, None])[beside < mesh.n_nodes]
    assert (apart < 64).mean() > 0.8


# Walls


def test_both_sides_of_a_thin_wall_have_nodes_of_their_own() -> None:
    wall = shapely.box(0.503, 0.3, 0.504, 0.7)
    mesh = full(UNIT, (20, 20), wall, [(0.45, 0.5), (0.55, 0.5), (0.1, 0.5)])
    west, east, far = mesh.ends
    assert not set(mesh.controls[west].tolist()) & set(mesh.controls[east].tolist())
    at = places(mesh)
    count = {place: at.count(place) for place in set(at)}
    assert all(count[i, 10] == 2 for i in (9, 10, 11))
    assert all(count[i, j] == 1 for i in range(-1, 22) for j in (0, 3, 17, 20))
    assert all(count[i, 10] == 1 for i in (0, 5, 7, 13, 20))
    assert mesh.columns[far] == 2


def test_the_inside_of_an_area_is_left_out() -> None:
    mesh = full(UNIT, (40, 40), shapely.box(0.3, 0.3, 0.7, 0.7), [])
    cells = set(zip(mesh.columns.tolist(), mesh.rows.tolist(), strict=True))
    assert (20, 20) not in cells
    assert (13, 20) not in cells
    assert (12, 20) in cells


def test_a_wall_across_the_map_parts_it() -> None:
    mesh = full(UNIT, (16, 16), shapely.box(0.5, -1.0, 0.501, 2.0), [(0.2, 0.5), (0.8, 0.5)])
    graph: nx.Graph[int] = nx.Graph()
    for controls in mesh.controls.tolist():
        nx.add_path(graph, controls)
    west, east = (int(mesh.controls[piece, 0]) for piece in mesh.ends)
    assert not nx.has_path(graph, west, east)


def test_corners_are_those_inside_the_bounds() -> None:
    area = NoFlyArea(shapely.MultiPolygon([shapely.box(0.5, 0.5, 2.0, 0.75), shapely.box(0.25, 0.25, 0.5, 0.5)]))
    assert corners(area, UNIT).tolist() == [[0.25, 0.25], [0.25, 0.5], [0.5, 0.25], [0.5, 0.5], [0.5, 0.75]]


@given(drawn.polygons(), st.tuples(st.integers(2, 9), st.integers(2, 9)))
@examples(30)
def test_boxes_and_strips_are_those_of_free_parts(area: BaseGeometry, last: Last) -> None:
    mesh = SplineMesh.build((0.0, 0.0, 4.0, 4.0), last, cell_runs.rectangle(last), NoFlyArea(area), [])
    parts, boxes, first_strip, strips = mesh.outlines
    assert parts == mesh.parts
    assert ((first_strip >= 0) == mesh.is_cut).all()
    for p, first in enumerate(first_strip.tolist()):
        half = parts // 2
        inside = np.ones((parts, parts), dtype=bool) & mesh.free_parts(p)
        inside[:, : half * (mesh.columns[p] == 0)] = False
        inside[: half * (mesh.rows[p] == 0)] = False
        inside[:, parts - half * (mesh.columns[p] == last[0]) :] = False
        inside[parts - half * (mesh.rows[p] == last[1]) :] = False
        assert boxes[p].tolist() == box_of(inside)
        if first < 0:
            continue
        rows = np.arange(parts)[:, None]
        for strip in range(mesh_kernels.STRIPS):
            low, high = (turn * parts // mesh_kernels.STRIPS for turn in (strip, strip + 1))
            here = inside & (rows >= low) & (rows < high)
            left, bottom, right, top = strips[first + strip].tolist()
            assert (left >= right or bottom >= top) if not here.any() else [left, bottom, right, top] == box_of(here)


def box_of(cells: BoolArray) -> list[int]:
    rows, columns = np.nonzero(cells)
    return [columns.min(), rows.min(), columns.max() + 1, rows.max() + 1]


@given(drawn.polygons(), st.tuples(st.integers(2, 9), st.integers(2, 9)), drawn.seeds)
@examples(30)
def test_pieces_are_found_where_points_are(area: BaseGeometry, last: Last, seed: int) -> None:
    points = np.random.default_rng(seed).uniform(0.0, 4.0, (20, 2))
    ends = [(float(x), float(y)) for x, y in points]
    mesh = SplineMesh.build((0.0, 0.0, 4.0, 4.0), last, cell_runs.rectangle(last), NoFlyArea(area), ends)
    found = mesh.pieces_at(points)
    assert np.where(found < 0, -1, found).tolist() == list(mesh.ends)
    assert (mesh.pieces_at(points + 100.0) == NO_CELL).all()


# Continuity


@given(drawn.polygons(), some_cells(), st.integers(0, 3), drawn.seeds)
@examples(40)
def test_a_part_has_the_pieces_nodes_and_joints_of_the_whole(
    area: BaseGeometry, cells: tuple[Last, WholeArray], halo: int, seed: int
) -> None:
    last, runs = cells
    end, bounds, no_fly = [(1.2, 1.6)], (0.0, 0.0, 4.0, 4.0), NoFlyArea(area)
    # (as many sub-cells in a cell)
    whole = SplineMesh.build(bounds, last, cell_runs.rectangle(last), no_fly, [], most_sub_cells=1)
    built = SplineMesh.build(bounds, last, runs, no_fly, end, halo, most_sub_cells=1)
    part, pieces, nodes, joints = whole.part(runs, end, halo)
    assert set(zip(part.columns.tolist(), part.rows.tolist(), part.matters.tolist(), strict=True)) == set(
        zip(built.columns.tolist(), built.rows.tolist(), built.matters.tolist(), strict=True)
    )
    # so that its splines are those of the whole, wherever a path may go
    assert (nodes[part.controls] == whole.controls[pieces]).all()
    with_none = np.append(nodes, whole.n_nodes)
    linked = whole.neighbours[with_none]
    assert (with_none[part.neighbours] == np.where(np.isin(linked, nodes), linked, whole.n_nodes)).all()
    for mine, theirs in zip(part.joints[1:3], whole.joints[1:3], strict=True):
        assert (nodes[mine] == theirs[joints]).all()
    first, one, *_ = part.joints
    assert all(first[node] == np.flatnonzero(one == node)[0] for node in one.tolist())
    points = np.vstack([np.random.default_rng(seed).uniform(0.0, 4.0, (50, 2)), end])
    found, expected = part.pieces_at(points), whole.pieces_at(points)
    held = np.isin(expected, pieces)
    assert (pieces[found[held]] == expected[held]).all()
    assert (found[~held] < 0).all()
    assert part.ends[0] == max(found[-1], NO_CELL)
    assert all((part.free_parts(n) == whole.free_parts(p)).all() for n, p in enumerate(pieces.tolist()))


def fractions_of(start: FloatArray, end: FloatArray, mesh: SplineMesh) -> FloatArray:
    """Return where a segment meets the sides of cells, as fractions of it, from 0 to 1."""
    low, high = (((point - np.array(mesh.origin)) / mesh.spacing).tolist() for point in (start, end))
    cuts = {0.0, 1.0}
    for axis in (0, 1):
        step = high[axis] - low[axis]
        first, last = sorted((low[axis], high[axis]))
        if step != 0.0:
            sides = range(math.floor(first - 0.5), math.ceil(last + 0.5))
            cuts |= {cut for side in sides if 0.0 < (cut := (side + 0.5 - low[axis]) / step) < 1.0}
    return np.array(sorted(cuts))


def spline(mesh: SplineMesh, pieces: IntArray, points: FloatArray, values: FloatArray) -> FloatArray:
    known = mesh.controls[pieces], mesh.columns[pieces], mesh.rows[pieces]
    return oracles.spline(known, mesh.origin, mesh.spacing, points, values)


def check_continuous(bounds: Bounds, last: Last, area: NoFlyArea, segments: FloatArray, seed: int) -> int:
    """Walk free segments, shape ``(n, 2, 2)``, and compare the spline on both sides of every step; return the steps."""
    shape = SplineMesh.build(bounds, last, cell_runs.rectangle(last), area, [])
    steps = []
    for start, end in segments:
        cuts = fractions_of(start, end, shape)
        # three points between two sides of cells: the way in between is in one cell
        inner = [a + (b - a) * share for a, b in itertools.pairwise(cuts) for share in (0.03, 0.5, 0.97)]
        joints = [(a + b) / 2.0 for a, b in itertools.pairwise(inner)]
        joints[2::3] = cuts[1:-1].tolist()
        steps.append([start + np.array(part)[:, None] * (end - start) for part in (inner, joints)])
    asked = [(float(x), float(y)) for points, _ in steps for x, y in points]
    mesh = SplineMesh.build(bounds, last, cell_runs.rectangle(last), area, asked)
    values = np.random.default_rng(seed).standard_normal(mesh.n_nodes)
    pieces = np.array(mesh.ends)
    assert (pieces >= 0).all(), "a free point has no piece"
    at = 0
    for points, joints in steps:
        mine = pieces[at : at + len(points)]
        at += len(points)
        before, after = (spline(mesh, some, joints, values) for some in (mine[:-1], mine[1:]))
        np.testing.assert_allclose(after, before, atol=1e-9, err_msg="the spline jumps")
    return sum(len(joints) for _, joints in steps)


def free_only(area: NoFlyArea, segments: FloatArray) -> FloatArray:
    return segments[~area.crosses(segments[:, 0], segments[:, 1])]


@st.composite
def exact_maps(draw: st.DrawFn) -> tuple[NoFlyArea, FloatArray]:
    """Draw polygons and free segments with coordinates that are halves: they touch in corners and along edges."""
    area = NoFlyArea(draw(drawn.polygons()))
    halves = np.arange(0.0, 4.25, 0.25)
    rng = np.random.default_rng(draw(drawn.seeds))
    return area, free_only(area, rng.choice(halves, (60, 2, 2)))[:15]


@pytest.mark.slow
@given(exact_maps(), st.sampled_from([(7, 5), (8, 8), (16, 16), (9, 30), (2, 3)]), drawn.seeds)
@examples(30)
@example(
    (NoFlyArea(shapely.box(1, 1, 3, 3)), np.array([[[1.0, 0.0], [1.0, 4.0]], [[0.0, 3.0], [4.0, 3.0]]])), (8, 8), 0
)
@example(
    (
        NoFlyArea(shapely.MultiPolygon([shapely.box(1, 1, 2, 2), shapely.box(2, 2, 3, 3)])),
        np.array([[[1.0, 3.0], [3.0, 1.0]], [[2.0, 2.0], [2.5, 1.5]]]),
    ),
    (4, 4),
    0,
)
def test_splines_are_continuous_where_polygons_touch(
    drawn: tuple[NoFlyArea, FloatArray], last: Last, seed: int
) -> None:
    area, segments = drawn
    assume(len(segments))
    check_continuous((0.0, 0.0, 4.0, 4.0), last, area, segments, seed)


def tilted(rng: np.random.Generator) -> NoFlyArea:
    """Draw thin walls and boxes at any angle, some of which overlap."""
    parts = []
    for _ in range(rng.integers(1, 6)):
        length, width = rng.uniform(0.1, 1.0), 10.0 ** rng.uniform(-7.0, -0.7)
        wall = shapely.box(-length / 2.0, -width / 2.0, length / 2.0, width / 2.0)
        turned = affinity.rotate(wall, rng.choice([0.0, 90.0, rng.uniform(0.0, 180.0)]), origin=(0.0, 0.0))
        parts.append(affinity.translate(turned, *rng.uniform(-0.1, 1.1, 2)))
    return NoFlyArea(shapely.union_all(parts))


@pytest.mark.slow
@given(drawn.seeds, st.sampled_from([(7, 9), (16, 16), (40, 25), (128, 3)]), st.sampled_from([1.0, 1e-6, 1e5]))
@examples(30)
def test_splines_are_continuous_past_walls_of_any_width(seed: int, last: Last, scale: float) -> None:
    rng = np.random.default_rng(seed)
    area = tilted(rng)
    offset = rng.choice([0.0, 1.0, 1e6]) * rng.uniform(-1.0, 1.0, 2)
    area = NoFlyArea(shapely.transform(area.geometry, lambda points: (points + offset) * scale))
    bounds = (*(offset * scale).tolist(), *((offset + 1.0) * scale).tolist())
    corner = corners(area, bounds)
    ends = np.vstack([rng.uniform(bounds[:2], bounds[2:], (40, 2)), corner, corner])
    # lines of sight between corners run along edges and through corners
    segments = rng.choice(ends, (60, 2))
    segments = free_only(area, segments[(segments[:, 0] != segments[:, 1]).any(axis=1)])[:12]
    assume(len(segments))
    assert check_continuous(bounds, last, area, segments, seed) > 0


def test_a_mesh_that_is_cut_too_far_is_caught(monkeypatch: pytest.MonkeyPatch) -> None:
    area, segment = NoFlyArea(shapely.box(0.3, 0.3, 0.7, 0.7)), np.array([[[0.05, 0.35], [0.45, 0.95]]])
    assert check_continuous(UNIT, (16, 16), area, segment, 0) > 10
    kernels = SimpleNamespace(**{**vars(mesh_kernels), "join_cut_pieces": lambda *_: None})
    monkeypatch.setattr("cgla_graph.eikonal.mesh.mesh_kernels", kernels)
    with pytest.raises(AssertionError, match="jumps"):
        check_continuous(UNIT, (16, 16), area, segment, 0)


def test_more_pieces_than_can_be_told_apart_count_as_one() -> None:
    """A cell with hundreds of pockets, all of them closed: still every free point has a piece."""
    axis = np.linspace(0.47, 0.53, 24)
    pockets = [shapely.box(x, y, x + 0.0012, y + 0.0012) for x in axis for y in axis]
    area = NoFlyArea(shapely.box(0.3, 0.3, 0.7, 0.7).difference(shapely.union_all(pockets)))
    inside = [(float(x) + 6e-4, float(y) + 6e-4) for x in axis for y in axis]
    mesh = full(UNIT, (8, 8), area.geometry, inside)
    assert min(mesh.ends) >= 0
    kinds = np.ones((1, 64, 64), dtype=np.int8)
    kinds[0, ::2, ::2] = 0
    labels = np.empty(kinds.shape, dtype=np.int16)
    assert mesh_kernels.label_pieces(kinds, labels).tolist() == [mesh_kernels.MOST_PIECES]
    assert labels.max() == mesh_kernels.MOST_PIECES - 1
    assert ((labels >= 0) == (kinds == 0)).all()


@pytest.mark.parametrize("width", [1e-3, 1e-4, 3e-5, 2e-5])
@pytest.mark.parametrize("more", [None, shapely.box(0.4, 0.0, 0.5, 0.1)])
def test_fronts_do_not_leak_through_thin_walls(width: float, more: BaseGeometry | None) -> None:
    """Sub-cells as wide as a wall would join its sides: thin walls get more of them, as parts of something wide too."""
    assert over_the_wall(width, more) > 1.05


def test_with_the_usual_sub_cells_thin_walls_leak(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cgla_graph.eikonal.mesh.LEAKS", 0.0)
    assert over_the_wall(3e-5) < 0.41


#: A wall of 4 % of the side, that tapers to 3e-5 where it meets the rim of the map, and ends beyond it.
TAPERED = shapely.Polygon([(0.48, 0.7), (0.52, 0.7), (0.5, -0.7 * 3e-5 / (0.04 - 3e-5))])


def test_fronts_do_not_leak_through_walls_that_taper_off_at_the_rim(monkeypatch: pytest.MonkeyPatch) -> None:
    assert round_the(TAPERED) > 1.05
    # what walls are like elsewhere is not enough to know
    monkeypatch.setattr("cgla_graph.eikonal.mesh.width_at_rim", lambda *_: math.inf)
    assert round_the(TAPERED) < 0.57


@given(drawn.polygons(), st.tuples(*[st.floats(0.0, 2.0)] * 2, *[st.floats(2.1, 4.0)] * 2))
@examples(100)
@example(TAPERED, UNIT)
def test_the_width_at_the_rim_is_no_more_than_what_the_rim_crosses(area: BaseGeometry, bounds: Bounds) -> None:
    sides = [shapely.LineString(side) for side in itertools.pairwise(shapely.box(*bounds).exterior.coords)]
    assume(not shapely.touches(area, sides).any())
    crossed = shapely.length(shapely.get_parts(shapely.intersection(area, sides)))
    least = crossed[crossed > 1e-9].min(initial=math.inf)
    found = width_at_rim(NoFlyArea(area).edges, bounds)
    assert found <= least * (1.0 + 1e-9)
    assert math.isfinite(found) == math.isfinite(least)


@pytest.mark.parametrize("degrees", [90.0, 70.0, 20.0, -20.0])
def test_the_width_at_the_rim_is_across_the_wall(degrees: float) -> None:
    wall = affinity.rotate(shapely.box(-5.0, 0.4, 5.0, 0.45), degrees, origin=(0.5, 0.0))
    assert width_at_rim(NoFlyArea(wall).edges, UNIT) == pytest.approx(0.05)


def test_the_sides_of_a_tip_are_told_apart_from_the_second_cell_on(monkeypatch: pytest.MonkeyPatch) -> None:
    assert together_behind(math.radians(2.0)) <= 1.5
    monkeypatch.setattr("cgla_graph.eikonal.mesh.MORE_AT_TIPS", 0)
    assert together_behind(math.radians(2.0)) > 3.0


def together_behind(angle: float) -> float:
    """Return up to how many cells behind the tip of a wedge both sides are in one piece, on a grid of 2,048 cells."""
    last, tip, turn = 2048, np.array([0.3, 0.3]), math.radians(17.0)
    ahead, aside = np.array([math.cos(turn), math.sin(turn)]), np.array([-math.sin(turn), math.cos(turn)])
    back, wide = tip + 0.5 * ahead, 0.5 * math.tan(0.5 * angle) * aside
    area = NoFlyArea(shapely.Polygon([tip, back - wide, back + wide]))
    runs = cell_runs.runs_of(*(a.ravel() for a in np.meshgrid(range(610, 640), range(610, 640))))
    mesh = SplineMesh.build(UNIT, (last, last), runs, area, [])
    behind = np.linspace(0.0, 10.0, 201)[:, None]
    sides = [tip + (behind * ahead + sign * (math.tan(0.5 * angle) * behind + 1e-3) * aside) / last for sign in (-1, 1)]
    one, other = (mesh.pieces_at(points) for points in sides)
    assert (one >= 0).all()
    return float(behind[one == other].max())


def over_the_wall(width: float, more: BaseGeometry | None = None) -> float:
    """March over a thin wall."""
    wall = shapely.box(0.5, -1.0, 0.5 + width, 0.7)
    return round_the(wall if more is None else wall.union(more))


def round_the(wall: BaseGeometry) -> float:
    """March from one side of a wall to the other, on a map of side 1; the way over it is 1.077 long."""
    area = NoFlyArea(wall)
    problem = Problem((0.3, 0.2), (0.7, 0.2), no_fly=area.geometry)
    ends = problem.start, problem.goal
    mesh = SplineMesh.build(problem.bounds, (256, 256), cell_runs.rectangle((256, 256)), area, ends)
    times = costs_to_go(problem, mesh, problem.goal, mesh.ends[1], np.ones(mesh.n_nodes), radius=0.02)
    return float(times[mesh.controls[mesh.ends[0], 4]])
