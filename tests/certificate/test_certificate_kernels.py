"""The steps of the proof, one by one: dense samples, plain formulas, and the rate at which they get sharp."""

import math
from typing import Any

import numpy as np
import oracles
import pytest
import shapely
import strategies
from hypothesis import given
from hypothesis import strategies as st
from levels import SEVERAL, plain_level, whole, without_strips
from shapely.geometry.base import BaseGeometry
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import Bounds, FloatArray, IntArray, WholeArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.subsolution import Level
from cgla_graph.eikonal import cell_runs, mesh_kernels
from cgla_graph.eikonal import mesh as mesh_module
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.testing import strategies as drawn

SIDES = np.array([(1.0, 0.0), (-1.0, 0.0), (0.0, 1.0), (0.0, -1.0)])


# The cost on a cell


def cost_bounds(
    columns: WholeArray,
    rows: WholeArray,
    origin: tuple[float, float],
    spacing: tuple[float, float],
    k: float,
    field: cg.RiskField,
    bounds: Bounds = (-1e9, -1e9, 1e9, 1e9),
) -> FloatArray:
    parts = certificate_kernels.QUARTERS if field.rasters else 1
    found = np.empty((len(columns), parts, 5))
    certificate_kernels.cost_bounds(columns, rows, origin, spacing, k, field.table, found)
    if field.raster_array is not None:
        certificate_kernels.add_rasters(columns, rows, origin, spacing, bounds, k, field.raster_array, found)
    return found


def cell_points(rng: np.random.Generator, count: int) -> FloatArray:
    """Draw points of a cell, its corners and middle first, in spacings from its middle."""
    corner = np.array([(a, b) for a in (-0.5, 0.0, 0.5) for b in (-0.5, 0.0, 0.5)])
    return np.vstack([corner, rng.uniform(-0.5, 0.5, (count, 2))])


@given(st.one_of(drawn.fields(), drawn.crowds(30)), drawn.risk_weights, drawn.seeds)
@strategies.usual
def test_the_cost_on_a_cell_is_above_its_bound(field: cg.RiskField, k: float, seed: int) -> None:
    rng = np.random.default_rng(seed)
    spacing = (10.0 ** rng.uniform(-4.0, -0.3), 10.0 ** rng.uniform(-4.0, -0.3))
    around = rng.choice([(t.x, t.y) for t in field.threats]) if len(field) else np.zeros(2)
    origin = around + rng.normal(size=2) * rng.choice([0.0, 0.01, 0.3])
    columns, rows = np.array([0, 3, -2], dtype=np.int32), np.array([0, 1, 1], dtype=np.int32)
    bounds = cost_bounds(columns, rows, (origin[0], origin[1]), spacing, k, field)[:, 0]
    middles = origin + np.column_stack([columns, rows]) * spacing
    away = cell_points(rng, 60) * spacing
    for middle, (cost, slope_x, slope_y, drop, least_of_all) in zip(middles, bounds, strict=True):
        density = oracles.density(field.threats, middle + away)
        here = 1.0 + k * oracles.density(field.threats, middle[None])[0]
        # threats beyond their reach are left out
        assert here - 1e-9 * (1.0 + k) <= cost <= here + 1e-12 * (1.0 + k)
        least = cost + away @ (slope_x, slope_y) - drop
        assert (1.0 + k * density >= np.maximum(least, least_of_all) - 1e-12 * (1.0 + k)).all()
        assert drop >= 0.0
        assert 1.0 <= least_of_all <= here + 1e-12 * (1.0 + k)


def test_bounds_of_cells_do_not_depend_on_how_they_are_shared_out() -> None:
    """Which threats are near is asked for cells in a row; they may be cut anywhere, for any number of cores."""
    rng = np.random.default_rng(3)
    field = cg.RiskField([cg.Threat(x, y, 0.01 + 0.1 * s, 0.9) for x, y, s in rng.random((200, 3))])
    columns, rows = (a.ravel().astype(np.int32) for a in np.meshgrid(np.arange(40), np.arange(40)))
    whole = cost_bounds(columns, rows, (0.0, 0.0), (0.025, 0.025), 10.0, field)
    for cut in (1, 777):
        parts = [
            cost_bounds(columns[a:b], rows[a:b], (0.0, 0.0), (0.025, 0.025), 10.0, field)
            for a, b in ((0, cut), (cut, None))
        ]
        assert np.array_equal(np.vstack(parts), whole)


def test_where_a_bend_is_beyond_the_greatest_number_the_cost_is_bounded_by_a_constant_alone() -> None:
    cell, size = np.zeros(1, dtype=np.int32), 1e70
    bounds = cost_bounds(cell, cell, (0.0, 0.0), (size, size), 10.0, cg.RiskField([cg.Threat(0.0, 0.0, 1.0 / size)]))
    assert bounds[0, 0].tolist() == [11.0, 0.0, 0.0, math.inf, 1.0]


@pytest.mark.parametrize(("n", "loss"), [(100, 0.2), (300, 0.05), (1000, 1e-5)])
def test_where_threats_overlap_the_bound_of_the_cost_is_sharp(n: int, loss: float) -> None:
    """
    The more factors of ``prod(1 - f_i)`` are small, the less each threat counts: where no way is clear, any grid does.

    (Without that, nine tenths of the cost are lost among 300 threats, and on nine cells of ten more than 70 % of it
    among 100.)
    """
    rng = np.random.default_rng(1)
    field = cg.RiskField([cg.Threat(x, y, 0.05) for x, y in rng.random((n, 2))])
    columns, rows = (a.ravel().astype(np.int32) for a in np.meshgrid(np.arange(16, 48), np.arange(16, 48)))
    spacing = 1.0 / 64.0
    bounds = cost_bounds(columns, rows, (0.0, 0.0), (spacing, spacing), 10.0, field)[:, 0]
    cost, slope_x, slope_y, drop, least = bounds.T
    found = np.maximum(cost - 0.5 * spacing * (np.abs(slope_x) + np.abs(slope_y)) - drop, least)
    offsets = np.linspace(-0.5, 0.5, 7)
    around = np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
    there = (np.column_stack([columns, rows])[:, None] + around) * spacing
    sampled = (1.0 + 10.0 * field.density(there)).min(axis=1)
    assert np.quantile(1.0 - found / sampled, 0.9) <= loss


@pytest.mark.parametrize("away", [0.0, 1.0, 4.0, 6.0])
@pytest.mark.parametrize("size", [0.01, 1.0, 3.0])
def test_beside_one_threat_the_cost_falls_below_its_tangent_by_no_more_than_where_it_bends_down(
    away: float, size: float
) -> None:
    """However steep it is there: along the slope it bends up, across it down by ``f / s^2``."""
    threat, k = cg.Threat(0.0, 0.0, 0.01, 0.9), 100.0
    cell, spacing = np.zeros(1, dtype=np.int32), (size * threat.spread, size * threat.spread)
    middle = 0.6 * away * threat.spread, 0.8 * away * threat.spread
    bounds = cost_bounds(cell, cell, middle, spacing, k, cg.RiskField([threat]))
    bend = k * 0.9 * math.exp(-0.5 * away**2) / threat.spread**2
    assert bounds[0, 0, certificate_kernels.DROP] == pytest.approx(0.25 * spacing[0] ** 2 * bend, rel=1e-9)


def test_the_bound_of_the_cost_is_of_second_order() -> None:
    slack = []
    for n in (32, 64, 128, 256):
        cell = np.array([n // 4], dtype=np.int32)
        bounds = cost_bounds(cell, cell, (0.0, 0.0), (1.0 / n, 1.0 / n), 10.0, SEVERAL)
        slack.append(float(bounds[0, 0, certificate_kernels.DROP]))
    assert 1.9 < oracles.rate(slack) < 2.5


def steepnesses(level: Level, values: FloatArray) -> FloatArray:
    mesh, found = level.mesh, np.empty(len(level.mesh.columns))
    every = np.ones(len(found), dtype=bool)
    greatest = certificate_kernels.steepness(values, mesh.kernel_mesh, mesh.outlines, every, level.bounds, found)
    assert greatest == found.max()
    return found


def slopes_of(
    level: Level, pieces: IntArray | slice, points: FloatArray, values: FloatArray, hair: float
) -> list[FloatArray]:
    """Differentiate a spline at points of pieces: central differences of a quadratic are exact."""
    mesh = level.mesh
    known = mesh.controls[pieces], mesh.columns[pieces], mesh.rows[pieces]
    steps = [oracles.spline(known, mesh.origin, mesh.spacing, points + step, values) for step in hair * SIDES]
    return [(steps[0] - steps[1]) / (2.0 * hair), (steps[2] - steps[3]) / (2.0 * hair)]


def sampled_steepness(level: Level, values: FloatArray, rng: np.random.Generator) -> FloatArray:
    """Sample ``|grad phi| / c`` on each cell, the half inside of those on the rim; the greatest of each."""
    mesh, hair = level.mesh, 1e-4
    worst = np.zeros(len(mesh.columns))
    for shift in cell_points(rng, 30) * (1.0 - 2.0 * hair):
        u = np.column_stack([mesh.columns, mesh.rows]) + shift
        u = np.clip(u, hair, np.array(mesh.last) - hair)
        slopes = slopes_of(level, slice(None), mesh.origin + u * mesh.spacing, values, hair * min(mesh.spacing))
        cost = 1.0 + level.problem.k * oracles.density(level.problem.field.threats, mesh.origin + u * mesh.spacing)
        worst = np.maximum(worst, np.hypot(*slopes) / cost)
    return worst


@given(drawn.fields(), drawn.risk_weights, st.integers(1, 9), st.integers(1, 9), drawn.seeds)
@examples(40)
def test_a_spline_is_nowhere_steeper_than_its_bound(
    field: cg.RiskField, k: float, columns: int, rows: int, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    level = plain_level(field, k, (columns, rows), (0.0, 0.0, 1.0, rng.uniform(0.2, 3.0)))
    at = level.mesh.node_points
    values = np.append(at @ rng.normal(size=2) + rng.choice([0.0, 0.1]) * rng.normal(size=len(at)), math.inf)
    found, sampled = steepnesses(level, values), sampled_steepness(level, values, rng)
    assert (sampled <= found * (1.0 + 1e-7) + 1e-7).all()
    # and for a linear function and no risk, no more than that
    slope = rng.normal(size=2)
    plain = plain_level(cg.RiskField(), 0.0, (columns, rows))
    found = steepnesses(plain, np.append(plain.mesh.node_points @ slope, math.inf))
    np.testing.assert_allclose(found, math.hypot(*slope), rtol=1e-9)


def check_beside_walls(area: BaseGeometry, field: cg.RiskField, seed: int) -> int:
    """Compare gradients at free points, most of them beside walls, with the bounds of their pieces; return how many."""
    rng = np.random.default_rng(seed)
    last, bounds = (int(rng.integers(4, 13)), int(rng.integers(4, 13))), (0.0, 0.0, 4.0, 4.0)
    outline = shapely.get_coordinates(shapely.segmentize(area, 0.1))
    beside = outline[rng.integers(len(outline), size=60)] + rng.normal(size=(60, 2)) * 10.0 ** rng.uniform(-4, -1)
    points = np.vstack([beside, rng.uniform(0.0, 4.0, (10, 2))])
    points = points[(points > 1e-3).all(axis=1) & (points < 4.0 - 1e-3).all(axis=1)]
    points = points[~cg.NoFlyArea(area).contains(points)]
    ends = [(float(x), float(y)) for x, y in points]
    problem = cg.Problem(ends[0], ends[-1], field, 10.0, bounds, no_fly=area)
    level = whole(problem, last)
    # the same mesh, with the pieces of these points
    pieces = np.array(SplineMesh.build(bounds, last, cell_runs.rectangle(last), problem.model.area, ends).ends)
    mesh = level.mesh
    away = mesh.node_points - rng.uniform(-1.0, 5.0, 2)
    # (where it is less steep than the cost, no bound of less than a piece's box is looked for)
    values = np.append(9.0 * np.hypot(*away.T) + rng.choice([0.0, 3.0]) * rng.normal(size=len(away)), math.inf)
    slopes = slopes_of(level, pieces, points, values, 1e-5)
    cost = 1.0 + 10.0 * oracles.density(field.threats, points)
    assert (np.hypot(*slopes) / cost <= steepnesses(level, values)[pieces] * (1.0 + 1e-7) + 1e-7).all()
    return len(points)


@pytest.mark.slow
@given(drawn.polygons(), drawn.fields(), drawn.seeds)
@examples(24)
def test_beside_walls_a_spline_is_nowhere_steeper_than_its_bound(
    area: BaseGeometry, field: cg.RiskField, seed: int
) -> None:
    if not area.is_empty and shapely.box(0, 0, 4, 4).difference(area).area > 1.0:
        assert check_beside_walls(area, field, seed) > 2


#: A triangle, none of whose sides is along the grid.
SLANTED = shapely.Polygon([(0.3, 0.2), (3.1, 1.1), (1.7, 3.3)])


@pytest.mark.parametrize("of_strips", [False, True])
def test_a_bound_for_less_than_a_piece_is_caught(monkeypatch: pytest.MonkeyPatch, *, of_strips: bool) -> None:
    def check_some() -> None:
        for seed in range(6):
            check_beside_walls(SLANTED, SEVERAL, seed)

    check_some()
    outlines = mesh_module.outlines_of

    def left_halves(*given: Any) -> mesh_kernels.Outlines:  # noqa: ANN401 - as they come
        parts, boxes, first_strip, strips = outlines(*given)
        halved = strips if of_strips else boxes
        halved[:, 2] = (halved[:, 0] + halved[:, 2] + 1) // 2
        return parts, boxes, first_strip, strips

    monkeypatch.setattr(mesh_module, "outlines_of", left_halves)
    with pytest.raises(AssertionError):
        check_some()


def test_where_it_costs_less_inside_a_wall_the_bound_beside_it_is_what_ways_cost(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Along the side of a triangle in risk, the excess of the bound is a small part of how much the cost changes."""
    field = cg.RiskField([cg.Threat(0.4, 2.5, 0.5)])
    problem = cg.Problem((0.1, 0.1), (3.9, 3.9), field, 10.0, (0.0, 0.0, 4.0, 4.0), no_fly=SLANTED)

    def excess() -> float:
        level = whole(problem, 64)
        mesh = level.mesh
        beside = mesh.is_cut & (mesh.columns > 10) & (mesh.columns < 20) & (mesh.rows > 20)
        # level across the wall, and along it as steep as the cost on it
        side = shapely.LineString(SLANTED.exterior.coords[2:4])
        along = shapely.line_locate_point(side, shapely.points(mesh.node_points))
        places = np.linspace(0.0, side.length, 4001)
        costs = 1.0 + 10.0 * field.density(shapely.get_coordinates(shapely.line_interpolate_point(side, places)))
        heights = np.append(0.0, np.cumsum(0.5 * (costs[1:] + costs[:-1]) * np.diff(places)))
        values = np.append(np.interp(along, places, heights), math.inf)
        return float(np.median(steepnesses(level, values)[beside])) - 1.0

    with_strips, outlines = excess(), mesh_module.outlines_of
    monkeypatch.setattr(mesh_module, "outlines_of", lambda *given: without_strips(*outlines(*given)))
    assert 0.0 < with_strips < excess() / 3.0


def test_the_bound_of_the_steepness_is_of_second_order() -> None:
    rng = np.random.default_rng(1)
    excess = []
    for n in (24, 48, 96):
        level = plain_level(SEVERAL, 5.0, (n, n))
        away = level.mesh.node_points - (-0.3, -0.2)
        values = np.append(np.hypot(*away.T) + np.sin(3.0 * away[:, 0]), math.inf)
        found, sampled = steepnesses(level, values), sampled_steepness(level, values, rng)
        excess.append(float((found / sampled - 1.0).mean()))
    assert 1.8 < oracles.rate(excess) < 2.6


def test_what_no_way_leads_to_is_not_steep_but_what_is_half_known_is() -> None:
    level = plain_level(cg.RiskField(), 0.0, (8, 8))
    values = np.full(level.mesh.n_nodes + 1, math.inf)
    assert (steepnesses(level, values) == 0.0).all()
    values[level.mesh.controls[40]] = 1.0
    found = steepnesses(level, values)
    assert found[40] == 0.0
    assert found[41] == math.inf


@given(drawn.seeds)
@strategies.usual
def test_costs_are_lowered_where_a_spline_is_steep_and_stay_above_zero(seed: int) -> None:
    rng = np.random.default_rng(seed)
    n, n_nodes = int(rng.integers(1, 20)), 30
    steep, floors = 10.0 ** rng.uniform(-2.0, 300.0, n), np.where(rng.random(n) < 0.3, rng.random(n), 0.0)
    controls = rng.integers(n_nodes, size=(n, 9)).astype(np.int32)
    before = 10.0 ** rng.uniform(-50.0, 50.0, n_nodes)
    costs = before.copy()
    certificate_kernels.soften(steep, controls, floors, costs)
    assert (costs > 0.0).all()
    assert (costs <= before).all()
    above = steep > 1.0
    others = np.setdiff1d(np.arange(n_nodes), controls[above])
    assert (costs[others] == before[others]).all()
    allowed = np.maximum(before[controls] / steep[:, None], np.maximum(floors, 1e-100)[:, None])
    assert (costs[controls] <= allowed)[above].all()
