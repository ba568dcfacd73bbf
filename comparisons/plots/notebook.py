"""What notebooks show: the fields that `repr` tells as a table, and a small picture in SVG that needs no matplotlib."""

from collections.abc import Iterable, Iterator, Sequence
from html import escape
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import fields_of
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.study import Study
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Solution

#: Of the picture's longer side, in pixels.
SIZE = 320.0
#: Paths and outlines may be off by this, in pixels; where they have too many points still, by twice that, and so on.
OFF, MOST_POINTS = 0.3, 1200
#: Up to so many threats are drawn as discs; more of them, and rasters, as cells: their number along a side, and steps.
MOST_THREATS, CELLS, STEPS = 80, 40, 4
#: Runs of cells of a tube, nodes and edges of a graph, flights and rows of a table, at most.
MOST_RUNS, MOST_NODES, MOST_EDGES, MOST_FLIGHTS, MOST_ROWS = 900, 1500, 600, 20, 14
#: Colours that can be told from a white and from a black page, and from each other.
_RISK, _PATH, _TUBE = "#e0523a", "#1f8fe0", "#2aa876"
_FLIGHTS = (_PATH, "#e08a1e", "#2aa876", "#b565d9", "#c9a400", "#d6589b")


def html(thing: object) -> str:
    """
    Return a table of what a thing says of itself, and its picture beside it if it has one.

    Examples
    --------
    >>> text = html(Problem((0, 0), (1, 1), k=2.0))
    >>> "<td>k</td>" in text.replace(' style="text-align:left"', ""), "<svg" in text
    (True, True)
    """
    rows = list(fields_of(thing))
    if isinstance(thing, Solution) and thing.problem is None and not len(thing.path):
        rows.append(("", thing.status.value))
    left = ' style="text-align:left"'
    told = "".join(f"<tr><td{left}>{escape(a)}</td><td{left}>{escape(b)}</td></tr>" for a, b in rows[:MOST_ROWS])
    caption = f"<caption{left}>{escape(type(thing).__name__)}</caption>"
    table = f'<table style="color:inherit">{caption}<tbody>{told}</tbody></table>'
    return f'<div style="display:flex;flex-wrap:wrap;gap:1em;align-items:flex-start">{_picture(thing)}{table}</div>'


def _picture(thing: object) -> str:  # noqa: PLR0911 - one a kind
    """Return the picture, or nothing where nothing is known that could be drawn."""
    match thing:
        case Problem():
            return _Canvas(thing.bounds).problem(thing).svg("the map")
        case Solution(problem=Problem() as problem):
            return _Canvas(problem.bounds).problem(problem).path(thing.path).svg("the map and the path")
        case Solution(problem=GraphProblem() as graph):
            return _graph(graph, thing.path)
        case GraphProblem():
            return _graph(thing, np.empty((0, 2)))
        case Certificate(problem=Problem() as problem):
            canvas = _Canvas(problem.bounds).tube(thing, problem.bounds).problem(problem)
            if thing.path is None:
                return canvas.svg("the map and the tube")
            return canvas.path(thing.path).svg("the map, the tube and the path")
        case Flight():
            paths = [uav.path for uav in thing.uavs.values()]
            return _mission(thing.mission, paths)
        case Rules():
            return _mission(thing, [])
        case Study() if thing.scenarios:
            first: Problem = thing.scenarios[0].problem
            return _Canvas(first.bounds).problem(first).svg("the map of the first scenario")
    return ""


def _mission(rules: Rules, paths: Sequence[FloatArray]) -> str:
    world = rules.world
    canvas = _Canvas(world.bounds).risk(world.field_at(0), world.bounds).area(world.no_fly)
    for number, uav in enumerate(rules.uavs[:MOST_FLIGHTS]):
        colour = _FLIGHTS[number % len(_FLIGHTS)]
        canvas.path(paths[number] if number < len(paths) else np.empty((0, 2)), colour)
        canvas.ends(uav.start, uav.goal)
    return canvas.svg("the map and the flights")


def _graph(problem: GraphProblem, path: FloatArray) -> str:
    """Draw nodes, edges where they are few, and the path; nothing where nodes have no positions."""
    graph = problem.graph
    places = graph.positions
    if places is None or not len(places):
        return ""
    (west, south), (east, north) = places.min(axis=0).tolist(), places.max(axis=0).tolist()
    canvas = _Canvas((west, south, east, north))
    if graph.n_pairs <= MOST_EDGES:
        for i in range(graph.n_nodes):
            row = graph.weights_from(i)
            others = np.flatnonzero(np.isfinite(row) & (np.arange(graph.n_nodes) != i))
            canvas.lines([places[[i, int(j)]] for j in others], 'stroke="currentColor" stroke-opacity=".25"')
    canvas.dots(places[:: -(-len(places) // MOST_NODES)])
    canvas.path(path)
    start, goal = (places[graph.index_of(node)] for node in (problem.source, problem.target))
    return canvas.ends(start, goal).svg("the graph")


class _Canvas:
    """An SVG that is drawn from below; y grows upwards on maps, and downwards here."""

    def __init__(self, bounds: Bounds) -> None:
        west, south, east, north = bounds
        side = max(east - west, north - south) or 1.0
        self._scale, self._corner = SIZE / side, np.array([west, north])
        self._width, self._height = (max(length * self._scale, 24.0) for length in (east - west, north - south))
        self._view = shapely.box(*bounds)
        self._parts: list[str] = []

    def problem(self, problem: Problem) -> "_Canvas":
        """Draw risk, areas and ends."""
        return self.risk(problem.field, problem.bounds).area(problem.no_fly).ends(problem.start, problem.goal)

    def risk(self, field: RiskField, bounds: Bounds) -> "_Canvas":
        """Draw threats as discs of one and two spreads, or the risk in cells."""
        if field.rasters or len(field.threats) > MOST_THREATS:
            return self._risk_cells(field, bounds)
        for threat in field.threats:
            x, y = self._pixels(np.array([[threat.x, threat.y]]))[0]
            for spreads in (2.0, 1.0):
                radius, shade = spreads * threat.spread * self._scale, 0.1 + 0.25 * min(threat.peak, 1.0)
                self._add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="{radius:.1f}" fill="{_RISK}" opacity="{shade:.2f}"/>')
        return self

    def _risk_cells(self, field: RiskField, bounds: Bounds) -> "_Canvas":
        west, south, east, north = bounds
        step = max(east - west, north - south) / CELLS
        columns, rows = (max(1, round(length / step)) for length in (east - west, north - south))
        xs = west + (np.arange(columns) + 0.5) * (east - west) / columns
        ys = south + (np.arange(rows) + 0.5) * (north - south) / rows
        density = field.density(np.stack(np.meshgrid(xs, ys), axis=-1))
        top = float(np.nanmax(density, initial=0.0))
        for level in range(1, STEPS + 1) if top > 0.0 else ():
            deep = np.nan_to_num(density) >= top * (level - 0.5) / STEPS
            self._cells(_runs(deep), ((east - west) / columns, (north - south) / rows), (west, south), _RISK, 0.2)
        return self

    def tube(self, certificate: Certificate, bounds: Bounds) -> "_Canvas":
        """Draw the cells of the finest grid that does not have too many of them."""
        fit = [grid for grid in certificate.grids if len(grid.runs) <= MOST_RUNS]
        if fit:
            west, south, east, north = bounds
            last = fit[-1].last
            steps = (east - west) / max(last[0], 1), (north - south) / max(last[1], 1)
            corner = west - 0.5 * steps[0], south - 0.5 * steps[1]
            self._cells(fit[-1].runs.tolist(), steps, corner, _TUBE, 0.45)
        return self

    def area(self, area: BaseGeometry | None) -> "_Canvas":
        """Draw polygons."""
        if area is None or area.is_empty:
            return self
        polygons = shapely.get_parts(shapely.intersection(area, self._view))
        rings = [ring for polygon in polygons if polygon.geom_type == "Polygon" for ring in _rings(polygon)]
        text = "".join(f"{self._line(points)}z" for points in self._fewer(rings))
        self._add(
            f'<path d="{text}" fill="currentColor" fill-opacity=".3" stroke="currentColor" '
            'stroke-opacity=".6" fill-rule="evenodd"/>'
        )
        return self

    def path(self, path: FloatArray, colour: str = _PATH) -> "_Canvas":
        """Draw a path."""
        if len(path) > 1:
            self.lines([path], f'stroke="{colour}" stroke-width="2.5" stroke-linejoin="round"')
        return self

    def lines(self, lines: Sequence[FloatArray], look: str) -> None:
        """Draw polylines."""
        text = "".join(self._line(points) for points in self._fewer(lines))
        self._add(f'<path d="{text}" fill="none" {look}/>')

    def dots(self, places: FloatArray) -> None:
        """Draw nodes."""
        text = "".join(f"M{x:.0f} {y:.0f}h0" for x, y in self._pixels(places))
        look = 'fill="none" stroke="currentColor" stroke-opacity=".5" stroke-width="3" stroke-linecap="round"'
        self._add(f'<path d="{text}" {look}/>')

    def ends(self, start: Any, goal: Any) -> "_Canvas":  # noqa: ANN401 - points, in any form
        """Draw the start as a ring and the goal as a diamond."""
        (x, y), (u, v) = self._pixels(np.array([start, goal], dtype=np.float64))
        look = 'fill="none" stroke="currentColor" stroke-width="2"'
        self._add(f'<circle cx="{x:.1f}" cy="{y:.1f}" r="4.5" {look}/>')
        self._add(f'<path d="M{u:.1f} {v - 6.5:.1f}l6.5 6.5-6.5 6.5-6.5-6.5z" fill="currentColor"/>')
        return self

    def svg(self, label: str) -> str:
        """Return the picture, with a frame around the map."""
        box = f'viewBox="-8 -8 {self._width + 16:.0f} {self._height + 16:.0f}" width="{self._width + 16:.0f}"'
        frame = f'<rect width="{self._width:.1f}" height="{self._height:.1f}" fill="none" stroke="currentColor" '
        return (
            f'<svg xmlns="http://www.w3.org/2000/svg" {box} style="max-width:100%;height:auto;overflow:hidden" '
            f'role="img" aria-label="{escape(label)}">{"".join(self._parts)}{frame}stroke-opacity=".4"/></svg>'
        )

    def _add(self, part: str) -> None:
        self._parts.append(part)

    def _pixels(self, points: FloatArray) -> FloatArray:
        shown: FloatArray = (np.asarray(points, dtype=np.float64) - self._corner) * (self._scale, -self._scale)
        return shown

    def _line(self, pixels: FloatArray) -> str:
        return "M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in pixels.tolist())

    def _fewer(self, lines: Iterable[FloatArray]) -> list[FloatArray]:
        """Leave out points that cannot be seen, and more where they are too many still; what is too small goes."""
        drawn = [shapely.LineString(self._pixels(line)) for line in lines if len(line) > 1]
        off = OFF
        fewer = [line.simplify(off) for line in drawn]
        while sum(len(line.coords) for line in fewer) > MOST_POINTS:
            off *= 2.0
            fewer = [line.simplify(off) for line in drawn if line.length > off]
        return [np.asarray(line.coords) for line in fewer]

    def _cells(
        self,
        runs: Iterable[Sequence[int]],
        steps: tuple[float, float],
        corner: tuple[float, float],
        colour: str,
        shade: float,
    ) -> None:
        """Draw runs of cells, ``row, first column, last column + 1`` each."""
        width, height = steps[0] * self._scale, steps[1] * self._scale
        parts = []
        for row, first, end in runs:
            (x, y) = self._pixels(np.array([[corner[0] + first * steps[0], corner[1] + (row + 1) * steps[1]]]))[0]
            parts.append(f"M{x:.1f} {y:.1f}h{(end - first) * width:.1f}v{height:.1f}h{(first - end) * width:.1f}z")
        self._add(f'<path d="{"".join(parts)}" fill="{colour}" fill-opacity="{shade}"/>')


def _rings(polygon: Any) -> Iterator[FloatArray]:  # noqa: ANN401 - shapely's
    yield np.asarray(polygon.exterior.coords)[:, :2]
    for hole in polygon.interiors:
        yield np.asarray(hole.coords)[:, :2]


def _runs(cells: Any) -> list[tuple[int, int, int]]:  # noqa: ANN401 - an array of truth values
    """Return the runs of True of each row."""
    found = []
    for row, line in enumerate(cells):
        edges = np.flatnonzero(np.diff(np.concatenate([[False], line, [False]]).astype(np.int8)))
        found += [(row, int(a), int(b)) for a, b in edges.reshape(-1, 2)]
    return found
