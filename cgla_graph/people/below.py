"""People below a path: how many live on the map, and the greatest density that a corridor meets."""

import math
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely

from cgla_graph._types import BoolArray, Bounds, FloatArray
from cgla_graph._validate import instance
from cgla_graph.errors import ProblemError
from cgla_graph.model.failure_model import SQUARE_KILOMETRE
from cgla_graph.model.ground_risk import people_layers, people_of
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.rasters.projection import areas_of_rows
from cgla_graph.model.rasters.values import parts_of
from cgla_graph.model.risk_raster import RasterRisk

#: Cells whose distance from a path is measured at a time, the densest first.
CHUNK = 4096
#: Pieces of a path, at most, around each of which cells are sought.
MOST_PIECES = 20_000
#: Cells are made smaller by this part of their size and of their coordinates: a path along an edge is in no cell.
INSIDE = 1e-9
#: A limit this many times as great as the greatest density is one in another unit.
FAR_OFF = 1000.0


class DensityLimitWarning(UserWarning):
    """A limit of the density limits nothing, or is far off every value of its layer."""


@dataclass(frozen=True)
class DensityLimit:
    """
    A limit of the density below, and the values that it is held against.

    Attributes
    ----------
    level
        No cell under the corridor is above it.
    unit
        The unit of the limit, and of the values.
    least, greatest
        Least value above 0, and greatest value, of a cell on the map.
    """

    level: float
    unit: str
    least: float
    greatest: float

    @property
    def notes(self) -> list[str]:
        """Notes if it limits nothing, or is far off every value."""
        limit = f"the limit of {self.level:g} {self.unit}"
        if self.level >= self.greatest:
            far = ": is it in another unit?" if self.level > FAR_OFF * self.greatest else ""
            return [f"{limit} limits nothing, as no cell of the map is above {self.greatest:.4g}{far}"]
        if self.level * FAR_OFF < self.least or self.level * FAR_OFF**2 < self.greatest:
            values = f"the cells of the map that are not empty have {self.least:.4g} to {self.greatest:.4g}"
            return [f"{limit} is far below all densities, as {values}: is it in another unit?"]
        return []

    def warn(self) -> None:
        """Give the notes as warnings."""
        for note in self.notes:
            warnings.warn(note, DensityLimitWarning, stacklevel=3)


def density_limit(problem: Problem, level: float) -> DensityLimit:
    """
    Return a limit of the density with its unit: people per km2 where people are known, else the raster's own unit.

    Raises
    ------
    ProblemError
        As `limited_layers`.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> town = RasterRisk([[0.002]], (0, 0, 9, 9), unit="people/m2", scale=4.5e-7)
    >>> problem = Problem((1, 1), (2, 2), RiskField(rasters=[town]), bounds=(0, 0, 9, 9))
    >>> density_limit(problem, 0.0005).notes[0]
    'the limit of 0.0005 people/km2 is far below all densities, as the cells of the map that are not empty have 2000 to
    2000: is it in another unit?'
    """
    layers, unit = limited_layers(problem)
    least, greatest = math.inf, 0.0
    for layer in layers:
        up, across = _shares(layer, problem.bounds)
        for part in parts_of(layer.shape):
            values = layer.highest_at(part)[np.outer(up[part], across) > 0.0]
            above = values[values > 0.0]
            least, greatest = float(above.min(initial=least)), float(above.max(initial=greatest))
    return DensityLimit(level, unit, least, greatest)


def limited_layers(problem: Problem) -> tuple[list[RasterRisk], str]:
    """
    Return the layers whose density a limit is about, and its unit.

    These are the people, people per km2, if they are known, for any scale of their risk; else all rasters.

    Raises
    ------
    ProblemError
        If there is no raster, the field is uncertain, layers of people overlap on different cells, or a raster without
        a unit has a scale, so that it is not known whether a limit is one of its values or of its risk.
    """
    instance("problem", problem, Problem, problem_wanted)
    rasters = problem.field.rasters
    if not rasters:
        msg = "the problem has no raster whose density could be limited; give RiskField(threats, rasters=[…])"
        raise ProblemError(msg)
    if problem.field.is_mixture:
        msg = "the field is uncertain, and a limit of its mean density is none; give problem.field.scenarios[0]"
        raise ProblemError(msg)
    layers, unit = held_against(problem)
    if unit == "people/km2":
        if overlap(layers):
            people_of(problem)
        return layers, unit
    scaled = next((raster.scale for raster in rasters if raster.scale != 1.0), None)
    if scaled is not None:
        msg = (
            f"a limit of density on a raster with a scale of {scaled:g} and no people: it is not known whether the "
            "limit is in the unit of the values or of the risk; give the unit of the values (unit people/km2 or "
            "people/m2, or kind count for people of cells: then the limit is in people per km2, for any scale), "
            "or leave out the scale"
        )
        raise ProblemError(msg)
    return layers, unit


def overlap(layers: Sequence[RasterRisk]) -> bool:
    """
    Return whether layers on different cells lie on one another, so that their densities add up.

    Examples
    --------
    >>> overlap([RasterRisk([[1.0]], (0, 0, 2, 2)), RasterRisk([[1.0]], (2, 0, 4, 2))])
    False
    """
    boxes = [shapely.box(*layer.bounds) for layer in layers]
    return sum(box.area for box in boxes) > shapely.union_all(boxes).area * (1.0 + INSIDE)


def held_against(problem: Problem) -> tuple[list[RasterRisk], str]:
    """
    Return the layers of the greatest density below a path, and its unit: people, or else the rasters with their scale.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> noise = RasterRisk([[2.0]], (0, 0, 9, 9), scale=3.0)
    >>> held_against(Problem((1, 1), (2, 2), RiskField(rasters=[noise]), bounds=(0, 0, 9, 9)))[1]
    "(3 x the raster's own unit)"
    """
    if layers := people_layers(problem):
        return layers, "people/km2"
    rasters = problem.field.rasters
    unit = "fatalities/m" if {raster.unit for raster in rasters} == {"fatalities/m"} else "the raster's own unit"
    scales = {raster.scale for raster in rasters}
    scale = "" if scales <= {1.0} else f"{scales.pop():g} x " if len(scales) == 1 else "scaled, "
    return list(rasters), f"({scale}{unit})"


def people_on(layer: RasterRisk, bounds: Bounds) -> float:
    """
    Return the people within bounds, map units, which are metres, of a layer in people per km2.

    On the plane of a coordinate reference system, areas are those on the ground.

    Examples
    --------
    >>> people_on(RasterRisk([[100.0, 0.0]], (0, 0, 2000, 1000), unit="people/km2"), (500, 0, 2000, 1000))
    50.0
    """
    areas, (up, across) = areas_of_rows(layer.bounds, layer.shape, layer.system), _shares(layer, bounds)
    people = 0.0
    for part in parts_of(layer.shape):
        people += float((layer.cells_at(part) * np.outer(up[part], across) * areas(part)).sum())
    return people / SQUARE_KILOMETRE


def _shares(layer: RasterRisk, bounds: Bounds) -> tuple[FloatArray, FloatArray]:
    """Return the shares of rows and of columns within bounds; that of a cell is the product."""
    across, up = (
        np.clip(np.minimum(edges[1:], high) - np.maximum(edges[:-1], low), 0.0, None) / np.diff(edges)
        for edges, low, high in (
            (np.linspace(layer.bounds[axis], layer.bounds[axis + 2], count + 1), bounds[axis], bounds[axis + 2])
            for axis, count in enumerate(reversed(layer.shape))
        )
    )
    return up, across


def greatest_below(layer: RasterRisk, path: FloatArray, *, corridor: float = 0.0) -> float:
    """
    Return the greatest value of a cell that the corridor of a path meets; 0 if it meets none.

    A path along the edge of a cell, or a corridor that touches it, does not meet it, as for limits of the density.

    Parameters
    ----------
    layer
        The cells.
    path
        Waypoints, shape ``(m, 2)``, map units.
    corridor
        Whole width, map units.

    Examples
    --------
    >>> town = RasterRisk([[1, 5, 2]], (0, 0, 3, 1))
    >>> road = np.array([(0.5, 0.5), (0.9, 0.5)])
    >>> greatest_below(town, road), greatest_below(town, road, corridor=0.4)
    (1.0, 5.0)
    """
    reach = 0.5 * corridor
    rows, columns = np.nonzero(_near(layer, path, reach))
    values = layer.highest_at((rows, columns))
    rows, columns, values = rows[values > 0.0], columns[values > 0.0], values[values > 0.0]
    order = np.argsort(-values, kind="stable")
    x_min, y_min, _, _ = layer.bounds
    width, height = layer.cell_size
    less = INSIDE * max(width, height, *map(abs, layer.bounds))
    line = shapely.LineString(path) if len(np.unique(path, axis=0)) > 1 else shapely.Point(path[0])
    shapely.prepare(line)
    for first in range(0, len(order), CHUNK):
        part = order[first : first + CHUNK]
        x, y = x_min + columns[part] * width, y_min + rows[part] * height
        cells = shapely.box(x + less, y + less, x + width - less, y + height - less)
        met = shapely.dwithin(line, cells, reach * (1.0 - INSIDE))
        if met.any():
            return float(values[part][met].max())
    return 0.0


def _near(layer: RasterRisk, path: FloatArray, reach: float) -> BoolArray:
    """Return the cells in the boxes around short pieces of a path, widened by a distance, shape ``(rows, columns)``."""
    (width, height), (rows, columns) = layer.cell_size, layer.shape
    origin, sizes = np.array(layer.bounds[:2]), np.array([width, height])
    line = shapely.LineString(path if len(path) > 1 else np.repeat(path, 2, axis=0))
    step = max(4.0 * max(width, height), reach, line.length / MOST_PIECES)
    # (GEOS divides no line without a length)
    points = shapely.get_coordinates(shapely.segmentize(line, step) if line.length > 0.0 else line)
    low, high = np.minimum(points[:-1], points[1:]) - reach, np.maximum(points[:-1], points[1:]) + reach
    last = np.array([columns, rows])
    first = np.clip(np.floor((low - origin) / sizes) - 1, 0, last).astype(np.int64)
    end = np.clip(np.floor((high - origin) / sizes) + 2, 0, last).astype(np.int64)
    near = np.zeros((rows, columns), dtype=np.bool_)
    for (x, y), (x_end, y_end) in zip(first.tolist(), end.tolist(), strict=True):
        near[y:y_end, x:x_end] = True
    return near


def length_outside(layers: list[RasterRisk], path: FloatArray, *, rim: float = 0.0) -> float:
    """
    Return the length of a path farther outside all layers than a rim, where no people are known, map units.

    Examples
    --------
    >>> length_outside([RasterRisk([[1.0]], (0, 0, 3, 3))], np.array([(2.0, 1.0), (5.0, 1.0)]))
    2.0
    """
    known = [shapely.box(*layer.bounds) if layer.covers is None else layer.covers for layer in layers]
    boxes = shapely.union_all([area.buffer(rim, join_style="mitre") for area in known])
    line = shapely.LineString(path if len(path) > 1 else np.repeat(path, 2, axis=0))
    return float(shapely.difference(line, boxes).length)
