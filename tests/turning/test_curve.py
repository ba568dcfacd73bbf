"""Arcs: their risk, what they cross, and what they come near to, against quadrature and dense samples."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from strategies import arcs, areas, few, usual

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.testing.strategies import crowds, fields, rasters
from cgla_graph.turning import curve_kernels
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.curve_kernels import CX, CY, RADIUS, TURN, X0, Y0


def points_at(arc: FloatArray, shares: FloatArray | float) -> FloatArray:
    """Points of an arc by shares of its turn, without the kernels."""
    angles = math.atan2(arc[Y0] - arc[CY], arc[X0] - arc[CX]) + shares * arc[TURN]
    return arc[[CX, CY]] + arc[RADIUS] * np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def sampled(arc: FloatArray, n: int) -> FloatArray:
    return points_at(arc, np.linspace(0.0, 1.0, n))


@few
@given(field=st.one_of(fields(), crowds(max_threats=20)), arc=arcs())
def test_risk_along_an_arc_is_that_of_quadrature(field: RiskField, arc: FloatArray) -> None:
    length = abs(arc[TURN]) * arc[RADIUS]
    breaks = np.linspace(0.0, 1.0, 1 + math.ceil(length / 0.02))
    parts = [
        quad(lambda share: float(field.density(points_at(arc, share))), a, b, epsabs=1e-14, epsrel=1e-13)[0]
        for a, b in pairwise(breaks)
    ]
    found = curve_kernels.piece_risk(arc, field.kernel_field())
    assert found == pytest.approx(length * math.fsum(parts), abs=1e-10, rel=1e-12)


@few
@given(raster=rasters(), arc=arcs())
def test_risk_of_rasters_along_an_arc_is_that_of_quadrature(raster: RasterRisk, arc: FloatArray) -> None:
    """By midpoints, thousands of them: the error at each jump is at most a step."""
    field, length = RiskField(rasters=[raster]), arc[RADIUS] * abs(arc[TURN])
    values = field.density(points_at(arc, (np.arange(40_000) + 0.5) / 40_000))
    jumps = np.abs(np.diff(values))
    error = length * (jumps[jumps > 0.0].sum() + 1e-6 * values.max()) / 40_000
    found = curve_kernels.piece_risk(arc, field.kernel_field())
    assert abs(found - length * values.mean()) <= error + 1e-12


@usual
@given(geometry=areas(), arc=arcs())
def test_arcs_cross_where_dense_samples_do(geometry: shapely.MultiPolygon, arc: FloatArray) -> None:
    area = NoFlyArea(geometry)
    points = shapely.points(sampled(arc, 4000))
    depth = np.where(shapely.within(points, geometry), shapely.distance(points, geometry.boundary), 0.0)
    crosses = curve_kernels.arc_crosses(arc, area.kernel_arrays)
    assert crosses or depth.max(initial=0.0) < 1e-9
    # chords of so many samples are within this of the arc
    sagitta = arc[RADIUS] * (1.0 - math.cos(0.5 * arc[TURN] / 3999))
    near = shapely.distance(shapely.LineString(sampled(arc, 4000)), geometry) if not geometry.is_empty else math.inf
    assert not crosses or near <= sagitta + 1e-12


@usual
@given(geometry=areas(), arc=arcs())
def test_clearance_of_a_curve_is_that_of_dense_samples(geometry: shapely.MultiPolygon, arc: FloatArray) -> None:
    problem = Problem((5.0, 5.0), (5.0, 6.0), bounds=(-20, -20, 20, 20), no_fly=None if geometry.is_empty else geometry)
    found = Curve(arc[None]).evaluate(problem)
    if found.feasible and not geometry.is_empty:
        sagitta = arc[RADIUS] * (1.0 - math.cos(0.5 * arc[TURN] / 3999))
        near = float(shapely.distance(shapely.LineString(sampled(arc, 4000)), geometry))
        assert found.clearance == pytest.approx(near, abs=sagitta + 1e-12)


@usual
@given(arc=arcs(), share=st.floats(0.0, 1.0), away=st.floats(1e-6, 2.0))
def test_an_arc_is_nearest_to_a_slanted_edge_where_it_is_parallel(arc: FloatArray, share: float, away: float) -> None:
    """The edge is outside of the circle, so that no other point of the arc is as near."""
    angle = math.atan2(arc[Y0] - arc[CY], arc[X0] - arc[CX]) + share * arc[TURN]
    out = np.array([math.cos(angle), math.sin(angle)])
    across = np.array([-out[1], out[0]])
    middle = arc[[CX, CY]] + (arc[RADIUS] + away) * out
    wedge = shapely.Polygon([middle - 9.0 * across, middle + 9.0 * across, middle + 3.0 * out])
    problem = Problem((90.0, 90.0), (91.0, 90.0), bounds=(-99, -99, 99, 99), no_fly=wedge)
    assert Curve(arc[None]).evaluate(problem).clearance == pytest.approx(away, abs=1e-9)


@usual
@given(arc=arcs(), tolerance=st.sampled_from([1e-1, 1e-3, 1e-5]))
def test_waypoints_of_an_arc_are_within_the_tolerance(arc: FloatArray, tolerance: float) -> None:
    waypoints = Curve(arc[None]).points(tolerance)
    middles = 0.5 * (waypoints[1:] + waypoints[:-1])
    assert np.abs(np.hypot(*(waypoints - arc[[CX, CY]]).T) - arc[RADIUS]).max() < 1e-12
    assert (arc[RADIUS] - np.hypot(*(middles - arc[[CX, CY]]).T)).max() <= tolerance * (1.0 + 1e-9)
    with pytest.raises(ProblemError, match="tolerance is 0; it must be above 0"):
        Curve(arc[None]).points(0.0)


@usual
@given(arc=arcs())
def test_the_box_of_an_arc_is_the_least(arc: FloatArray) -> None:
    points = sampled(arc, 4000)
    low_x, low_y, high_x, high_y = curve_kernels.arc_box(arc)
    expected = [*points.min(axis=0), *points.max(axis=0)]
    step = arc[RADIUS] * (arc[TURN] / 3999) ** 2
    assert np.allclose([low_x, low_y, high_x, high_y], expected, atol=step + 1e-12, rtol=0.0)
    assert low_x <= expected[0] + 1e-12
    assert high_y >= expected[3] - 1e-12
