"""The profile of a path: distance, density, accumulated risk and cost at points along it, as a table and as a plot."""

import csv
import io
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from numpy.typing import ArrayLike

from cgla_graph._files import write_files
from cgla_graph._types import FloatArray
from cgla_graph._validate import point_array
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.people.units import density_text
from cgla_graph.plots import pictures
from cgla_graph.plots.page import heading, style
from cgla_graph.plots.scene import cost_unit, unit_scale
from cgla_graph.scenarios.scenario import Scenario

#: Most rows, apart from waypoints, which are always included.
MOST_ROWS = 20_000
#: Steps in the finest cell of a raster, and in the narrowest spread of a threat.
CELL_STEPS, SPREAD_STEPS = 2, 10
#: Steps along the path, at least.
LEAST_STEPS = 200
COLUMNS = ("distance", "x", "y", "density", "risk", "cost")
_SIZE = (7.0, 4.6)  # inches


@dataclass(frozen=True, eq=False)
class Profile:
    """
    Density, risk and cost of a path, point by point.

    Attributes
    ----------
    points
        Shape ``(n, 2)``, map units: every waypoint, and points between them.
    distance
        Distance so far, shape ``(n,)``, map units.
    density
        Risk per unit length at the point.
    risk, cost
        Sums so far; the last ones are those of the path.
    """

    points: FloatArray
    distance: FloatArray
    density: FloatArray
    risk: FloatArray
    cost: FloatArray


def profile_of(problem: Problem, path: ArrayLike) -> Profile:
    """
    Compute the profile of a path.

    Steps are at most half the finest cell of a raster or a tenth of the narrowest spread, or longer if that makes more
    than `MOST_ROWS`. Accumulated risk is exact for any steps (`RiskField.line_integral`).

    Parameters
    ----------
    problem
        The problem that gives risk and risk weight.
    path
        Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units.

    Raises
    ------
    ProblemError
        If the path is empty or not made of finite pairs.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> people = RasterRisk([[1.0, 3.0]], (0, 0, 1, 1), interpolation="nearest")
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField(rasters=[people]), k=10.0)
    >>> profile = profile_of(problem, [(0, 0.5), (1, 0.5)])
    >>> float(profile.distance[-1]), round(float(profile.risk[-1]), 9), round(float(profile.cost[-1]), 9)
    (1.0, 2.0, 21.0)
    """
    waypoints = point_array("path", path)
    if waypoints.ndim != 2 or len(waypoints) == 0:  # noqa: PLR2004 - a list of points
        msg = f"path has shape {waypoints.shape}; give at least one waypoint, shape (m, 2)"
        raise ProblemError(msg)
    points = _points(problem, waypoints)
    steps = np.hypot(*np.diff(points, axis=0).T)
    risks = problem.field.line_integral(points[:-1], points[1:])
    distance, risk = (np.concatenate([[0.0], np.cumsum(parts)]) for parts in (steps, risks))
    return Profile(points, distance, problem.field.density(points), risk, distance + problem.k * risk)


def _points(problem: Problem, waypoints: FloatArray) -> FloatArray:
    """Return the waypoints and points between them."""
    lengths = np.hypot(*np.diff(waypoints, axis=0).T)
    length = float(lengths.sum())
    if not length > 0.0:
        return waypoints
    field = problem.field
    cells = [min(raster.cell_size) / CELL_STEPS for raster in field.rasters]
    step = min([length / LEAST_STEPS, *cells, *(threat.spread / SPREAD_STEPS for threat in field.every_threat)])
    step = max(step, length / max(MOST_ROWS - len(waypoints), LEAST_STEPS))
    parts = [waypoints[:1]]
    for start, end, long in zip(waypoints[:-1], waypoints[1:], lengths.tolist(), strict=True):
        shares = np.linspace(0.0, 1.0, max(1, math.ceil(long / step)) + 1)[1:, None]
        part = start + shares * (end - start)
        part[-1] = end
        parts.append(part)
    return np.concatenate(parts)


def profile_csv(scenario: Scenario, profile: Profile, seconds: FloatArray | None = None) -> str:
    """Write a profile as CSV: `COLUMNS`, seconds if known, and longitude and latitude where the map has them."""
    columns, table = list(COLUMNS), [profile.distance, profile.points, profile.density, profile.risk, profile.cost]
    if seconds is not None:
        columns.append("seconds")
        table.append(seconds)
    if scenario.projection is not None:
        columns += ["longitude", "latitude"]
        table.append(scenario.projection.inverse(profile.points))
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows([columns, *np.column_stack(table).tolist()])
    return text.getvalue()


def profile_figure(scenario: Scenario, profile: Profile) -> Figure:
    """
    Draw a profile: the risk per unit length, and below it the cost so far, split into length and weighted risk.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> scenario = load_scenario("one-threat")
    >>> problem = scenario.problem
    >>> figure = profile_figure(scenario, profile_of(problem, [problem.start, problem.goal]))
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['risk per unit length', 'cost so far']
    """
    scale, unit = unit_scale(scenario.problem), cost_unit(scenario.problem)
    along = profile.distance * scale
    name, title = heading(scenario.name, scenario.title, scenario.problem.k)
    with style():
        figure = Figure(figsize=_SIZE, layout="constrained")
        FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1, sharex=True)
        figure.suptitle(f"{name}:  {title}" if title else name, x=0.01, ha="left", fontsize=10.0, wrap=True)
        above.fill_between(along, 0.0, profile.density, color="#6445AF", alpha=0.25, linewidth=0.0)
        above.plot(along, profile.density, color="#6445AF", linewidth=0.9)
        above.set_ylabel(density_text(scenario.problem.field))
        below.fill_between(along, 0.0, along, color="0.85", linewidth=0.0, label="length")
        below.fill_between(
            along, along, profile.cost * scale, color="#6445AF", alpha=0.45, linewidth=0.0, label="k * risk"
        )
        below.plot(along, profile.cost * scale, color="0.15", linewidth=1.0, label="cost")
        below.set_ylabel(f"cost so far{unit}")
        below.set_xlabel(f"distance along the path{unit}")
        below.legend(loc="upper left", frameon=False)
        for axes in (above, below):
            axes.set_xlim(0.0, max(float(along[-1]), math.ulp(1.0)))
            axes.set_ylim(bottom=min(0.0, float(profile.density.min())) if axes is above else None)
            axes.grid(color="0.9", linewidth=0.5)
            axes.set_axisbelow(True)
            axes.spines[["top", "right"]].set_visible(False)
    return figure


def check_profile_file(path: Path) -> None:
    """
    Check the file of ``--profile`` before any work is done.

    Raises
    ------
    OutputError
        If its ending is not known.
    """
    if path.suffix.lower() not in {".csv", ".png", ".svg", ".pdf"}:
        msg = f"--profile {path}: cannot tell the format; end it in .csv, .png, .svg or .pdf"
        raise OutputError(msg)


def write_profile(
    path: Path, scenario: Scenario, waypoints: FloatArray, clock: Callable[[FloatArray], FloatArray] | None = None
) -> Path:
    """
    Write the profile of a path, whole or not at all: CSV, or a plot where the name ends in .png, .svg or .pdf.

    A `clock` returns the times at points on the path, shape ``(n, 2)``; a table then has the seconds as well.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    check_profile_file(path)
    profile = profile_of(scenario.problem, waypoints)
    if path.suffix.lower() != ".csv":
        return pictures.save(profile_figure(scenario, profile), path)
    seconds = None if clock is None else clock(profile.points)
    write_files({path: profile_csv(scenario, profile, seconds).encode()})
    return path
