"""A timed problem as the arrays that kernels take, and the grid of a march over it."""

import dataclasses
import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, Bounds, FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.solvers.timed.disc_kernels import Discs
from cgla_graph.solvers.timed.march_kernels import Grid
from cgla_graph.solvers.timed.timed_kernels import Chart, slab_of
from cgla_graph.timed.timed_area import union_of
from cgla_graph.timed.timed_problem import TimedProblem

#: Samples of a raster's risk along the longer side, at most.
SAMPLES = 512


def chart_of(problem: TimedProblem, until: float) -> Chart:
    """
    Return a timed problem as arrays; the last law holds on after `until`.

    In wind that changes, no flight waits.
    """
    wind = problem.wind_grid
    slabs = problem.slabs(max(until, problem.departures[0] + 1e-9))
    rows = [np.vstack([slab.threats, _still_rows(slab.field)]) for slab in slabs]
    corner, step, axes = _samples_of(problem.bounds)
    grids: list[FloatArray] = []
    of_field: dict[int, int] = {}
    for slab in slabs:
        if len(slab.field.rasters) and id(slab.field) not in of_field:
            of_field[id(slab.field)] = len(grids)
            without = slab.field.with_only(())
            grids.append(without.density(np.stack(np.meshgrid(*axes), axis=-1)))
    polygons: dict[bytes, int] = {}
    shapes: list[shapely.Polygon] = []
    closed = []
    for slab in slabs:
        here = set()
        for one in _polygons(slab.wide_area.geometry):
            if one.wkb not in polygons:
                polygons[one.wkb] = len(shapes)
                shapes.append(one)
            here.add(polygons[one.wkb])
        closed.append(here)
    rings = [(number, ring) for number, shape in enumerate(shapes) for ring in (shape.exterior, *shape.interiors)]
    corners = [shapely.get_coordinates(ring) for _, ring in rings]
    return Chart(
        edges=np.array([slabs[0].begins, *(slab.ends for slab in slabs)]),
        first=np.cumsum([0, *map(len, rows)]),
        threats=np.vstack(rows),
        grids=np.array(grids) if grids else np.zeros((1, 2, 2)),
        corner=corner,
        step=step,
        grid_of=np.array([of_field.get(id(slab.field), -1) for slab in slabs]),
        rings=np.vstack(corners) if corners else np.empty((0, 2)),
        ring_starts=np.cumsum([0, *map(len, corners)]),
        ring_area=np.array([number for number, _ in rings], dtype=np.int64),
        boxes=np.array([shape.bounds for shape in shapes]).reshape(-1, 4),
        closed=np.array([[n in here for n in range(len(shapes))] for here in closed], dtype=bool).reshape(
            len(slabs), len(shapes)
        ),
        speed=problem.speed,
        k=problem.k,
        per_time=problem.risk_per == "time",
        wind_x=wind.mean[0],
        wind_y=wind.mean[1],
        gusts=wind.gusts,
        winds=wind.arrays,
        price=math.inf if problem.waiting is None or problem.constant_wind is None else problem.waiting,
        latest=math.inf if problem.latest is None else problem.latest,
        discs=discs_of(problem),
    )


def discs_of(problem: TimedProblem, also: Sequence[Trajectory] = (), radius: float = 0.0) -> Discs:
    """Return the discs around others, and around more of another radius."""
    others = (*(problem.others if problem.separation > 0.0 else ()), *also)
    rows = [np.column_stack([other.times, other.points]) for other in others]
    radii = np.full(len(others), problem.separation)
    radii[len(others) - len(also) :] = radius
    return Discs(np.vstack(rows) if others else np.empty((0, 3)), np.cumsum([0, *map(len, rows)]), radii)


def _still_rows(field: RiskField) -> FloatArray:
    rows = np.zeros((len(field.threats), 8))
    for row, threat in zip(rows, field.threats, strict=True):
        row[[0, 1, 4, 6]] = threat.x, threat.y, threat.spread, threat.peak
    return rows


def _samples_of(bounds: Bounds) -> tuple[FloatArray, FloatArray, tuple[FloatArray, FloatArray]]:
    """Return the corner, the steps and the axes of samples over the map."""
    x_min, y_min, x_max, y_max = bounds
    fine = max(x_max - x_min, y_max - y_min) / SAMPLES
    axes = tuple(
        np.linspace(low, high, max(2, round((high - low) / fine) + 1)) for low, high in ((x_min, x_max), (y_min, y_max))
    )
    return np.array([x_min, y_min]), np.array([axis[1] - axis[0] for axis in axes]), (axes[0], axes[1])


def _polygons(geometry: BaseGeometry | None) -> list[shapely.Polygon]:
    if geometry is None:
        return []
    return [one for one in shapely.get_parts(shapely.get_parts(geometry)) if isinstance(one, shapely.Polygon)]


def grid_for(problem: TimedProblem, chart: Chart, most: float, nodes: int) -> Grid:
    """
    Lay a grid over all flights that cost at most `most`.

    Parameters
    ----------
    problem, chart
        The problem, and the same as arrays.
    most
        Cost of a flight, map units.
    nodes
        Nodes in space and time, about.

    Returns
    -------
    grid
        Layers lie at all events and, in still slabs, as far apart in time as it takes to fly from node to node.
    """
    first, last = problem.departures
    lasts = most / min(chart.speed, chart.price)
    ends = min(last + lasts, chart.latest)
    x_min, y_min, x_max, y_max = _box(problem, chart, ends - first)
    fastest = chart.speed + chart.gusts + math.hypot(chart.wind_x, chart.wind_y)
    volume = (x_max - x_min) * (y_max - y_min) * (ends - first) * fastest
    h = max((volume / nodes) ** (1.0 / 3.0), max(x_max - x_min, y_max - y_min) / 400)
    h = min(h, math.dist(problem.start, problem.goal) / 8.0)
    nx, ny = (max(4, math.ceil(length / h) + 1) for length in (x_max - x_min, y_max - y_min))
    within = {last, *chart.edges[1:-1].tolist()}
    cuts = [first, *sorted(edge for edge in within if first < edge < ends), ends]
    times = [np.array([first])]
    for begins, stops in pairwise(cuts):
        times.append(np.linspace(begins, stops, max(1, math.ceil((stops - begins) * fastest / h)) + 1)[1:])
    layers = np.concatenate(times)
    slabs = np.array([slab_of(chart.edges, 0.5 * (a + b)) for a, b in pairwise(layers)])
    return Grid(x_min, y_min, h, nx, ny, layers, slabs, _blocked(problem, chart, (x_min, y_min, h), (nx, ny)))


def _box(problem: TimedProblem, chart: Chart, time: float) -> Bounds:
    """Return the box of the places from which both ends are within reach, inside the bounds."""
    (ax, ay), (bx, by) = problem.start, problem.goal
    x_min, y_min, x_max, y_max = problem.bounds
    reach = time * (chart.speed + chart.gusts + math.hypot(chart.wind_x, chart.wind_y))
    # an ellipse about the two ends, with the long axis `reach`
    across = math.sqrt(max(reach**2 - math.dist(problem.start, problem.goal) ** 2, 0.0))
    half = [0.5 * math.hypot(across, abs(b - a)) for a, b in ((ax, bx), (ay, by))]
    middle = 0.5 * (ax + bx), 0.5 * (ay + by)
    low = max(x_min, middle[0] - half[0]), max(y_min, middle[1] - half[1])
    high = min(x_max, middle[0] + half[0]), min(y_max, middle[1] + half[1])
    return low[0], low[1], high[0], high[1]


def _blocked(
    problem: TimedProblem, chart: Chart, corner: tuple[float, float, float], shape: tuple[int, int]
) -> BoolArray:
    """Return which nodes are closed in each slab: their cells meet an area, or they are inside where an end is near."""
    (x, y, h), (nx, ny) = corner, shape
    px, py = np.meshgrid(x + h * np.arange(nx), y + h * np.arange(ny))
    half = 0.5 * h * (1.0 - 1e-9)
    cells = shapely.box(px - half, py - half, px + half, py + half)
    points = shapely.points(px, py)
    near = np.zeros((ny, nx), dtype=bool)
    for end in (problem.start, problem.goal):
        near |= np.hypot(px - end[0], py - end[1]) < 2.0 * h
    of_area = np.zeros((chart.boxes.shape[0], ny, nx), dtype=bool)
    for number in range(len(of_area)):
        rings = [
            chart.rings[chart.ring_starts[i] : chart.ring_starts[i + 1]]
            for i in np.nonzero(chart.ring_area == number)[0]
        ]
        polygon = shapely.Polygon(rings[0], rings[1:])
        shapely.prepare(polygon)
        of_area[number] = np.where(near, shapely.contains_properly(polygon, points), shapely.intersects(polygon, cells))
    blocked = np.zeros((len(chart.edges) - 1, ny, nx), dtype=bool)
    for s, numbers in enumerate(chart.closed):
        blocked[s] = of_area[numbers].any(axis=0)
    return blocked


def always_closed(problem: TimedProblem) -> Problem:
    """Return the problem in the plane in which all areas stay closed and moving threats are left out."""
    areas = [area.polygon for area in problem.areas]
    return dataclasses.replace(problem.still, no_fly=union_of(problem.no_fly, areas))
