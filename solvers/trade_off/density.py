"""Paths whose corridor stays below a density, as SORA limits it, and the cost of each limit."""

import dataclasses
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

import numpy as np
import shapely

from cgla_graph._progress import waiting
from cgla_graph._text import ShortRepr, json_number
from cgla_graph._types import Point
from cgla_graph._validate import instance, non_negative_number, number_array, whole_number
from cgla_graph.certificate.verdict import is_proven_closed
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import degrees_of
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.people.below import DensityLimitWarning, density_limit, limited_layers
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.reweighing import solve_or_fail


class SealedError(ProblemError):
    """Start or goal is closed by a limit of the density, so that no path stays below it."""


def below_density(problem: Problem, level: float, *, corridor: float = 0.0) -> Problem:
    """
    Close all cells of the rasters above a level, and the points within half the corridor's width of them.

    A path of the new problem has a corridor in which no cell is above the level. Its certificate bounds all such
    paths; where that says that there is none, none has one (but for corridors wider by less than 1/13000, see
    `RasterRisk.area_above`).

    Parameters
    ----------
    problem
        With rasters.
    level
        At least 0: people per km2 where people are known (`RasterRisk.people`), for any scale of their risk; else
        in the raster's own unit.
    corridor
        Whole width, map units, at least 0.

    Returns
    -------
    problem
        The same with more no-fly areas.

    Raises
    ------
    ProblemError
        If there is no raster, the problem has a clearance, a number is negative, or start or goal are closed, so that
        there is no such path; or if a raster without a unit has a scale, so that the unit of the level is not known.

    Warns
    -----
    DensityLimitWarning
        If the level limits nothing, or is far off every value.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> town = RasterRisk([[0, 0, 0], [0, 9, 0], [0, 0, 0]], bounds=(0, 0, 3, 3))
    >>> problem = Problem((0.5, 1.5), (2.5, 1.5), RiskField(rasters=[town]), bounds=(0, 0, 3, 3))
    >>> from cgla_graph.solvers.solving import solve
    >>> around = solve(below_density(problem, 5.0, corridor=0.4), "hybrid", tolerance=None)
    >>> round(around.length, 3)
    2.785
    """
    instance("problem", problem, Problem, problem_wanted)
    layers, unit = limited_layers(problem)
    if problem.clearance > 0.0:
        msg = f"a limit of density has a corridor of its own; leave out the clearance of {problem.clearance:g}"
        raise ProblemError(msg)
    level = non_negative_number("level", level)
    width = non_negative_number("corridor", corridor)
    limit = density_limit(problem, level)
    closed = [layer.area_above(level, buffer=0.5 * width, beyond=_beyond(layer, problem)) for layer in layers]
    for name in ("start", "goal"):
        here = shapely.Point(getattr(problem, name))
        if any(shapely.contains_properly(area, here) for area in closed):
            msg = (
                f"{name} {_place(problem, getattr(problem, name))} has a density above {level:g} {unit} within "
                f"{0.5 * width:g}: no path stays below; raise the level, or narrow the corridor"
            )
            raise SealedError("; ".join([msg, *limit.notes]))
    limit.warn()
    parts = [problem.no_fly, *closed] if problem.no_fly is not None else closed
    return dataclasses.replace(problem, no_fly=shapely.union_all(parts))


def _place(problem: Problem, place: Point) -> str:
    """Return a place for messages, in degrees where the map is in degrees."""
    return (
        f"{place}"
        if problem.projection is None
        else f"{tuple(degrees_of(np.array([place]), problem.projection)[0].tolist())}"
    )


def _beyond(raster: RasterRisk, problem: Problem) -> tuple[int, int, int, int]:
    """Return on which sides outer cells count beyond a raster that ends there: paths may follow the rim."""
    west, south = (int(raster.bounds[axis] <= problem.bounds[axis]) for axis in (0, 1))
    east, north = (int(raster.bounds[axis] >= problem.bounds[axis]) for axis in (2, 3))
    return west, south, east, north


@dataclass(frozen=True, eq=False)
class DensityPoint(ShortRepr):
    """
    The best path found under one limit.

    Attributes
    ----------
    level
        No cell in the corridor is above it.
    solution
        The path, or why there is none.
    no_path
        Whether it is proven that there is none.
    """

    level: float
    solution: Solution
    no_path: bool

    def document(self) -> dict[str, Any]:
        """Return it as JSON; numbers that are not finite are None."""
        found = self.solution
        numbers = {key: json_number(getattr(found, key)) for key in ("cost", "length", "risk", "gap")}
        words = {"max_density": self.level, "status": found.status.label, "no_path": self.no_path}
        return {**words, **numbers, "path": found.path.tolist()}


def density_front(
    problem: Problem,
    *,
    corridor: float = 0.0,
    levels: Sequence[float] | int = 8,
    solver: str | Solver = "hybrid",
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> list[DensityPoint]:
    """
    Find the cost of each limit of the density under the corridor.

    Parameters
    ----------
    problem
        With rasters.
    corridor
        Whole width, map units, at least 0.
    levels
        The limits, as in `below_density`; or how many, at least 2, spread over the densities of cells by their ranks,
        from the least limit for which a path is known up to where the limit plays no part.
    solver, **settings
        As `cgla_graph.solve` takes them.

    Returns
    -------
    front
        A point for each limit, in rising order; costs do not rise. For a number of levels, the first point is the
        greatest limit tried for which no path was found, proven or not, if there is one.

    Raises
    ------
    ProblemError
        If there is no raster, or a number is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> wall = RasterRisk([[0, 4, 0], [0, 2, 0], [0, 8, 0]], bounds=(0, 0, 3, 3))
    >>> problem = Problem((0.5, 0.5), (2.5, 0.5), RiskField(rasters=[wall]), k=0.0, bounds=(0, 0, 3, 3))
    >>> front = density_front(problem, levels=[1, 2, 8], tolerance=None)
    >>> [(point.level, point.no_path, round(point.solution.cost, 2)) for point in front]
    [(1.0, True, inf), (2.0, False, 2.41), (8.0, False, 2.0)]
    """
    point = partial(_point, problem, corridor, solver, settings)
    instance("problem", problem, Problem, problem_wanted)
    if isinstance(levels, int):
        count = whole_number("levels", levels, at_least=2, at_most=1000)
        return list(waiting("front of cost against density", _spread(problem, count, point)))
    chosen = np.unique(number_array("levels", levels)).tolist()
    return list(waiting("front of cost against density", map(point, chosen), len(chosen)))


def _point(
    problem: Problem, corridor: float, solver: str | Solver, settings: dict[str, Any], level: float
) -> DensityPoint:
    try:
        with warnings.catch_warnings():
            # (a front ends where the limit plays no part)
            warnings.simplefilter("ignore", DensityLimitWarning)
            limited = below_density(problem, level, corridor=corridor)
    except SealedError as error:
        return DensityPoint(level, Solution(Status.NO_PATH, message=str(error)), no_path=True)
    found = solve_or_fail(limited, registry.ready(solver, settings))
    return DensityPoint(level, found, no_path=not found.status.has_path and is_proven_closed(limited))


def _spread(problem: Problem, count: int, point: Callable[[float], DensityPoint]) -> Iterator[DensityPoint]:
    """Find the least limit with a path by halving, then points up to where there is no limit."""
    layers, _ = limited_layers(problem)
    every = np.unique(np.concatenate([layer.highest.ravel() for layer in layers]))
    known = {len(every) - 1: point(float(every[-1]))}
    low, high = -1, len(every) - 1
    while high - low > 1 and known[high].solution.status.has_path:
        middle = (low + high) // 2
        known[middle] = point(float(every[middle]))
        low, high = (low, middle) if known[middle].solution.status.has_path else (middle, high)
    for index in np.unique(np.linspace(high, len(every) - 1, count).astype(int)).tolist():
        if index not in known:
            known[index] = point(float(every[index]))
    yield from (known[index] for index in sorted(known) if index >= low)
