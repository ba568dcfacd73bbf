"""
Isochrones: from where a place can be reached at most at a cost, for certain and possibly.

**Possibly.** One surface bounds the cost to the place from everywhere (`many`). On each piece of the grid it is lowered
by the charges that a path can meet from there if it costs less than ``C``. Where that is at least ``C``, every path
costs at least ``C``. All other pieces remain, as far as they are joined with the place: along a path, what is left of
it costs less and less, so that a path below ``C`` passes none of the others.

**For certain.** Paths down that surface are shown, with their exact costs. What is left of a path from a point ``y``
costs ``t``. A cell that no area meets is convex, so that each of its points ``x`` has a path that costs at most ``t + m
|x - y|``, with the greatest cost of a unit of length on the cell, ``m``; and the points of the next cell one that costs
at most the greatest cost on this cell and ``m`` times its side, across the side that they share. Cells that an area
meets are never certain.

Costs are the same in both directions: this is also how far one gets from the place. On a map in degrees, bounds count
on the Earth, and paths cost at least as much on the plane.
"""

import json
import math
import os
import time
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._text import counted, json_number
from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph.certificate.answers import write_text
from cgla_graph.certificate.corridor import cells_outline, outer_of
from cgla_graph.certificate.corridor_files import as_written
from cgla_graph.certificate.costs import greatest_costs
from cgla_graph.certificate.landmarks import Ground
from cgla_graph.certificate.many import MOST_SOLVES, GoalSurface
from cgla_graph.certificate.many_cells import CellSurface
from cgla_graph.certificate.through import joined_with
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.mesh import SplineMesh
from cgla_graph.model.problem import Problem

#: Paths that are shown, at most, and from how many cells before it is looked again where one is missing.
MOST_PATHS, AT_ONCE = 4000, 200
#: How far paths are led to cells beside them before others are shown.
SWEEPS = 16
#: Points of a path from which costs are told, in spacings of the grid.
STEP = 0.5
#: What may be lost at the goal before a finer grid is laid there, as a part of the least cost.
LOST_AT_END = 5e-4
#: Rounding of sums of costs, relative.
ROUNDED = 1e-12


@dataclass(frozen=True, eq=False)
class Isochrones(Plottable):
    """
    Areas from which a place can be reached at most at some costs.

    Attributes
    ----------
    goal
        The place.
    costs
        The costs, in ascending order, map units.
    certain
        For each cost: from every point of this area, a path is known that costs at most that.
    possible
        For each cost: no path from outside of this area costs less than that. It contains `certain`.
    n_solves
        How many times a surface of costs-to-go was solved.
    n_paths
        How many paths were shown.
    seconds
        Time that it took.
    problem
        The map.
    """

    goal: Point
    costs: tuple[float, ...]
    certain: tuple[BaseGeometry, ...]
    possible: tuple[BaseGeometry, ...]
    n_solves: int
    n_paths: int
    seconds: float
    problem: Problem = field(repr=False)

    @property
    def message(self) -> str:
        """How the areas were found, in one line."""
        solved, shown = counted(self.n_solves, "time"), counted(self.n_paths, "path")
        return f"costs-to-go solved {solved}, {shown} shown"

    def rows(self) -> list[dict[str, float]]:
        """
        Return the cost and the two areas of each isochrone, map units and their squares.

        Examples
        --------
        >>> import cgla_graph as cg
        >>> found = cg.Map(cg.Problem((0.1, 0.1), (0.9, 0.9))).isochrones([0.5])
        >>> [round(row["certain_area"] / row["possible_area"], 1) for row in found.rows()]
        [0.9]
        """
        return [
            {"cost": cost, "certain_area": float(inner.area), "possible_area": float(outer.area)}
            for cost, inner, outer in zip(self.costs, self.certain, self.possible, strict=True)
        ]

    def document(self) -> dict[str, Any]:
        """Return the numbers as JSON, without polygons."""
        numbers = [{name: json_number(value) for name, value in row.items()} for row in self.rows()]
        return {"goal": list(self.goal), "isochrones": numbers, "message": self.message, "seconds": self.seconds}

    def to_geojson(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the areas as GeoJSON: ``possible`` and ``certain`` for each cost.

        Coordinates are longitude and latitude, or map units on a map in the plane, which the member ``coordinates``
        says.

        Parameters
        ----------
        file
            The file; it ends in ``.geojson``.

        Returns
        -------
        file
            The path of the file.

        Raises
        ------
        OutputError
            If the ending is another one, or the file cannot be written.
        """
        features = []
        # (the widest first, as viewers draw later ones above)
        for row, *shapes in reversed(list(zip(self.rows(), self.possible, self.certain, strict=True))):
            for name, shape in zip(("possible", "certain"), shapes, strict=True):
                if not shape.is_empty:
                    told = {"name": f"{name} within {row['cost']:g}", "kind": name, "cost": row["cost"]}
                    geometry = shapely.geometry.mapping(shapely.orient_polygons(as_written(self.problem, shape)))
                    features.append({"type": "Feature", "properties": told, "geometry": geometry})
        units = "map units" if self.problem.projection is None else "longitude, latitude"
        document = {"type": "FeatureCollection", "coordinates": units, "features": features}
        return write_text(file, ".geojson", json.dumps(document, allow_nan=False) + "\n")


def isochrones_to(ground: Ground, goal: Point, costs: Sequence[float], cells: CellSurface | None) -> Isochrones:
    """
    Find the areas from which a place can be reached at most at some costs.

    Parameters
    ----------
    ground
        The grid; its cells are those of the areas.
    goal
        The place, where a path may be.
    costs
        In ascending order, positive, map units.
    cells
        The surface over cells of constant cost, where the map has one.
    """
    began = time.perf_counter()
    surface = GoalSurface.towards(ground, goal, ground.problem.start, LOST_AT_END * costs[0])
    while surface.solve() and surface.n_solves < MOST_SOLVES:
        pass
    if cells is not None:
        cells.solve()
    work = _Tiles.of(surface, cells)
    n_paths = work.show(costs)
    certain, possible = [], []
    for cost in costs:
        rows, columns = np.nonzero(work.most <= cost)
        certain.append(cells_outline(work.problem.bounds, work.last, cell_runs.runs_of(columns, rows)))
        possible.append(outer_of(work.problem, work.last, cell_runs.runs_of(*work.possible(cost))))
    seconds, n_solves = time.perf_counter() - began, surface.n_solves + (0 if cells is None else cells.n_solves)
    return Isochrones(goal, tuple(costs), tuple(certain), tuple(possible), n_solves, n_paths, seconds, work.problem)


@dataclass(eq=False)
class _Tiles:
    """
    The cells of the grid of a surface, with bounds of the cost to its goal.

    Attributes
    ----------
    surface, cells
        The surfaces.
    heights
        What the first surface is on each piece, at least, shape ``(m,)``.
    free
        Whether a cell meets no area, shape ``(rows, columns)``.
    greatest
        The greatest cost of a unit of length on it, at most.
    most
        From all of its points, there is a path that costs at most this; infinite where none is known.
    """

    surface: GoalSurface
    cells: CellSurface | None
    heights: FloatArray
    free: BoolArray
    greatest: FloatArray
    most: FloatArray

    @classmethod
    def of(cls, surface: GoalSurface, cells: CellSurface | None) -> "_Tiles":
        """Bound the costs on each cell, without any path."""
        mesh, problem = surface.level.mesh, surface.ground.problem
        rows, columns = np.mgrid[0 : mesh.last[1] + 1, 0 : mesh.last[0] + 1]
        middles = _middles(mesh, problem, columns.ravel(), rows.ravel())
        half = 0.5 * mesh.spacing[0], 0.5 * mesh.spacing[1]
        free, greatest = np.ones(len(middles), dtype=np.bool_), np.full(len(middles), math.inf)
        if not problem.model.area.is_empty:
            walls = problem.model.area.geometry
            shapely.prepare(walls)
            free[:] = ~shapely.intersects(walls, shapely.box(*(middles - half).T, *(middles + half).T))
        greatest[free] = greatest_costs(problem, middles[free], half)
        shape = columns.shape
        most = np.full(shape, math.inf)
        return cls(surface, cells, surface.heights(), free.reshape(shape), greatest.reshape(shape), most)

    @property
    def problem(self) -> Problem:
        """The problem whose paths are judged."""
        return self.surface.ground.problem

    @property
    def last(self) -> tuple[int, int]:
        """Column and row of the last cell."""
        return self.surface.level.mesh.last

    def show(self, costs: Sequence[float]) -> int:
        """Show paths wherever that makes a cell certain for one of the costs, from afar first; return how many."""
        mesh = self.surface.level.mesh
        self._pass(np.array([self.surface.goal]))
        # (about the cost of a path from its middle, and of the way there from its corners)
        expected = np.full(self.most.shape, math.inf)
        middles = self.surface.solved[0].values[mesh.controls[mesh.matters, 4]]
        np.minimum.at(expected, (mesh.rows[mesh.matters], mesh.columns[mesh.matters]), middles)
        expected += np.where(self.free, 0.5 * math.hypot(*mesh.spacing) * self.greatest, math.inf)
        asked = np.isfinite(expected)
        n_paths = 0
        while n_paths < MOST_PATHS:
            self._spread(SWEEPS)
            wanted = np.zeros(asked.shape, dtype=np.bool_)
            for cost in costs:
                wanted |= asked & (expected <= cost) & (self.most > cost)
            rows, columns = np.nonzero(wanted)
            if not len(rows):
                break
            order = np.argsort(-expected[rows, columns], kind="stable")[:AT_ONCE]
            rows, columns = rows[order], columns[order]
            asked[rows, columns] = False
            for path in (self.cells or self.surface).paths(_middles(mesh, self.problem, columns, rows)):
                self._pass(path)
            n_paths += len(rows)
        self._spread(max(self.last))
        return n_paths

    def _pass(self, path: FloatArray) -> None:
        """Take the costs along a path that is feasible."""
        mesh = self.surface.level.mesh
        if not len(path):
            return
        tail, points = np.zeros(1), path
        if len(path) > 1:
            points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), STEP * min(mesh.spacing)))
            weights = self.problem.model.weights(points[:-1], points[1:])
            tail = np.append(np.cumsum(weights[::-1])[::-1], 0.0) * (1.0 + ROUNDED)
            if not self.problem.evaluate(path).feasible:
                return
        at = (points - np.array(mesh.origin)) / np.array(mesh.spacing)
        columns, rows = np.clip(np.rint(at).astype(np.int64), 0, mesh.last).T
        far = (np.abs(at - np.column_stack([columns, rows])) + (0.5 + ROUNDED)) * mesh.spacing
        # (infinite where an area meets the cell)
        np.minimum.at(self.most, (rows, columns), tail + self.greatest[rows, columns] * np.hypot(*far.T))

    def _spread(self, times: int) -> None:
        """Lead paths to the cells beside those that have one, and so on, so many times at most."""
        steps = [self.greatest * side * (1.0 + ROUNDED) for side in self.surface.level.mesh.spacing]
        for _ in range(times):
            before = self.most.copy()
            for here, there, step in (
                (np.s_[:, 1:], np.s_[:, :-1], steps[0]),
                (np.s_[:, :-1], np.s_[:, 1:], steps[0]),
                (np.s_[1:], np.s_[:-1], steps[1]),
                (np.s_[:-1], np.s_[1:], steps[1]),
            ):
                np.minimum(self.most[here], self.most[there] + step[here], out=self.most[here])
            if (before == self.most).all():
                return

    def possible(self, cost: float) -> tuple[WholeArray, WholeArray]:
        """Return column and row of the cells from which a path may cost less."""
        mesh, surface = self.surface.level.mesh, self.surface
        keep = mesh.matters & surface.may_cost_less(self.heights, cost)
        if self.cells is not None:
            (some,) = np.nonzero(keep)
            some = some[self.free[mesh.rows[some], mesh.columns[some]]]
            some = some[self.most[mesh.rows[some], mesh.columns[some]] > cost]
            columns, rows = mesh.columns[some], mesh.rows[some]
            bounds = self.cells.bounds(_middles(mesh, self.problem, columns, rows), np.full(len(some), math.inf))
            # (the bound of another place on the cell is lower by the cost of the way there, at most)
            way = self.greatest[rows, columns] * math.hypot(*mesh.spacing) * (0.5 + ROUNDED)
            keep[some] = ~(bounds - way >= cost)
        keep[keep] = joined_with(surface.goal, mesh, keep)
        return mesh.columns[keep], mesh.rows[keep]


def _middles(mesh: SplineMesh, problem: Problem, columns: WholeArray, rows: WholeArray) -> FloatArray:
    """Return the middles of cells, shape ``(n, 2)``, map units."""
    places = np.array(mesh.origin) + np.column_stack([columns, rows]) * np.array(mesh.spacing)
    return np.asarray(np.clip(places, *np.reshape(problem.bounds, (2, 2))))
