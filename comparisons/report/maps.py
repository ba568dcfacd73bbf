"""Maps of the report: risk as a small picture, no-fly areas and paths as few whole numbers."""

import base64
import hashlib
from collections.abc import Iterator
from typing import Any, Protocol

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.people.units import density_text
from cgla_graph.plots.degrees import degree_ticks
from cgla_graph.plots.risk_samples import risk_samples, sample_edges
from cgla_graph.scenarios.scenario import Scenario

#: Samples of the risk along the longer side of a map.
RISK_SAMPLES = 96
#: The same where there are rasters, whose cells are finer than threats.
MOST_SAMPLES = 240
#: Cells along the longer side of a map whose no-fly area has too many corners for outlines.
WALL_CELLS = 240
#: Steps of a coordinate along the longer side of a map: five digits, far below a pixel.
STEPS = 99_999
#: Most waypoints of a path, and most corners of all no-fly areas of a map.
MOST_WAYPOINTS, MOST_CORNERS = 200, 4000
#: First tolerance of simplified lines, as a share of the longer side: a quarter of a pixel.
SLACK = 1.0 / 4000.0


class Bounded(Protocol):
    """A problem, or another thing with bounds in map units."""

    @property
    def bounds(self) -> Bounds:
        """The least and the greatest x and y, as of a problem."""
        ...


def map_key(scenario: Scenario) -> str:
    """Return a text that scenarios have in common exactly when their maps look the same."""
    problem = scenario.problem
    digest = hashlib.sha256(repr((problem.bounds, scenario.y_down, problem.clearance)).encode())
    digest.update(np.ascontiguousarray(problem.field.table).tobytes())
    for raster in problem.field.rasters:
        digest.update(repr((raster.bounds, raster.interpolation, raster.shape, raster.unit)).encode())
        digest.update(raster.cells.tobytes())
    digest.update(b"" if problem.no_fly is None else shapely.to_wkb(problem.no_fly))
    return digest.hexdigest()


def map_document(scenario: Scenario) -> dict[str, Any]:
    """
    Turn the map of a scenario into what the page draws.

    Returns
    -------
    document
        ``bounds`` in map units, ``y_down``, ``risk`` (None without risk), and of the no-fly area either ``no_fly``,
        rings, each a flat list of steps (see `steps_of`), or ``walls``, a raster. ``margin`` are the rings of the area
        widened by the clearance, where the problem asks for one. ``axes`` are labels in degrees, for x and for y a list
        of places and a list of texts; None for a map in a plane. ``edges`` are those of a graph (see `graph_document`).

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> sorted(map_document(load_scenario("one-threat")))
    ['axes', 'bounds', 'edges', 'margin', 'no_fly', 'risk', 'walls', 'y_down']
    """
    problem = scenario.problem
    return {
        "bounds": list(problem.bounds),
        "y_down": scenario.y_down,
        "axes": _axes(problem),
        "risk": _risk(problem),
        **_no_fly(problem),
        "margin": _margin(problem),
        "edges": [],
    }


def _axes(problem: Problem) -> list[tuple[list[float], list[str]]] | None:
    """Return the labels of the axes of a map in degrees."""
    if problem.projection is None:
        return None
    try:
        both = degree_ticks(problem.projection, problem.bounds)
    except ProblemError:
        # (a corner is farther away than any place of the Earth)
        return None
    return [([round(at, 3) for at, _ in ticks], [text for _, text in ticks]) for ticks in both]


def _risk(problem: Problem) -> dict[str, Any] | None:
    """Sample the risk, rows from the least y on, in 256 steps of colour from `low` to `top`."""
    if problem.field.is_empty:
        return None
    found = risk_samples(problem, MOST_SAMPLES if problem.field.rasters else RISK_SAMPLES)
    if not found.top > found.low:
        return None
    levels = np.clip(np.rint(found.shades * 255.0), 0, 255).astype(np.uint8)
    rows, columns = levels.shape
    shown = {"low": found.low, "top": found.top, "power": found.power, "label": density_text(problem.field)}
    return {"rows": rows, "columns": columns, **shown, "levels": _base64(levels)}


def _no_fly(problem: Problem) -> dict[str, Any]:
    """Draw the no-fly area by its outlines; one of too many corners by a raster of the share of each cell it covers."""
    if problem.no_fly is None:
        return {"no_fly": [], "walls": None}
    area = shapely.intersection(problem.area_as_given.geometry, shapely.box(*problem.bounds))
    outlines = _outlines(area, problem)
    return {"no_fly": outlines or [], "walls": _walls(area, problem) if outlines is None else None}


def _margin(problem: Problem) -> list[list[int]]:
    """Draw how far paths stay from the no-fly area, by outlines; nothing where those have too many corners."""
    if problem.clearance <= 0.0 or problem.area.is_empty:
        return []
    area = shapely.intersection(problem.model.area.geometry, shapely.box(*problem.bounds))
    return _outlines(area, problem) or []


def _outlines(area: BaseGeometry, problem: Problem) -> list[list[int]] | None:
    """Return the rings of an area, simplified, as steps; None where they have too many corners."""
    simple = shapely.simplify(area, SLACK * _side(problem))
    if shapely.get_num_coordinates(simple) > MOST_CORNERS:
        return None
    return [steps_of(shapely.get_coordinates(ring), problem) for ring in _rings(simple)]


def _rings(area: BaseGeometry) -> Iterator[BaseGeometry]:
    for part in shapely.get_parts(area):
        if part.geom_type == "Polygon" and not part.is_empty:
            yield from (part.exterior, *part.interiors)


def _walls(area: BaseGeometry, problem: Problem) -> dict[str, Any]:
    """Say how much of each cell may not be flown, in quarters, rows from the least y on: of 4 points, those inside."""
    x, y = (np.repeat(0.5 * (edges[1:] + edges[:-1]), 2) for edges in sample_edges(problem, WALL_CELLS))
    step = _side(problem) / WALL_CELLS / 4.0
    x, y = (centres + np.tile([-step, step], len(centres) // 2) for centres in (x, y))
    shapely.prepare(area)
    inside = shapely.contains_xy(area, *np.meshgrid(x, y))
    quarters = inside.reshape(len(y) // 2, 2, len(x) // 2, 2).sum(axis=(1, 3), dtype=np.uint8)
    return {"rows": len(y) // 2, "columns": len(x) // 2, "quarters": _base64(quarters)}


def _base64(levels: NDArray[np.uint8]) -> str:
    return base64.b64encode(levels.tobytes()).decode()


def path_steps(path: FloatArray, problem: Bounded) -> list[int]:
    """
    Return a path as steps, with as few waypoints as a picture needs (`MOST_WAYPOINTS` at most); its ends stay.

    Examples
    --------
    >>> straight = np.array([(0.0, 0.0), (0.25, 0.25), (1.0, 1.0)])
    >>> path_steps(straight, Problem((0, 0), (1, 1)))
    [0, 0, 99999, 99999]
    """
    steps = steps_of(path, problem)
    if len(path) < 2:  # noqa: PLR2004 - a path that ends where it starts
        return steps
    # whole steps first: GEOS does not like waypoints that are closer together than rounding
    line = shapely.LineString(np.reshape(steps, (-1, 2)))
    coordinates = shapely.get_coordinates(_simplified(line, SLACK * STEPS))
    return coordinates.astype(np.int64).ravel().tolist()


def _simplified(path: BaseGeometry, slack: float) -> BaseGeometry:
    """Simplify by Douglas and Peucker, ever more until there are few enough waypoints."""
    simple = shapely.simplify(path, slack)
    while shapely.get_num_coordinates(simple) > MOST_WAYPOINTS:
        slack *= 2.0
        simple = shapely.simplify(path, slack)
    return simple


def steps_of(points: FloatArray, problem: Bounded) -> list[int]:
    """Return points, shape ``(m, 2)``, as x, y, x, y, …: steps of the longer side / `STEPS` from the lower left."""
    x_min, y_min, _, _ = problem.bounds
    return np.rint((np.asarray(points) - (x_min, y_min)) * (STEPS / _side(problem))).astype(np.int64).ravel().tolist()


def _side(problem: Bounded) -> float:
    x_min, y_min, x_max, y_max = problem.bounds
    return max(x_max - x_min, y_max - y_min)
