"""The profile of a path: distance, density, accumulated risk and cost at points along it, as a table and as a plot."""

import csv
import io
import math
from collections.abc import Callable, Sequence
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
from cgla_graph.model.risk import RiskField
from cgla_graph.people.units import density_text
from cgla_graph.plots import pictures
from cgla_graph.plots.page import heading, style
from cgla_graph.plots.scene import cost_unit, unit_scale
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.timed.timed_evaluation import Timed, timed_rows
from cgla_graph.timed.timed_flight import flown
from cgla_graph.timed.timed_problem import TimedProblem

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
    times
        Of a timed path, shape ``(n,)``; its distance is that through the air, and its density counts by the time where
        its risk does. None for others.
    """

    points: FloatArray
    distance: FloatArray
    density: FloatArray
    risk: FloatArray
    cost: FloatArray
    times: FloatArray | None = None


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
    lengths = np.hypot(*np.diff(waypoints, axis=0).T)
    counts = _parts(lengths, [problem.field])
    points = waypoints[:1]
    if lengths.any():
        legs = zip(waypoints[:-1], waypoints[1:], counts, strict=True)
        points = np.concatenate([points, *(np.linspace(*leg[:2], leg[2] + 1)[1:] for leg in legs)])
    steps = np.hypot(*np.diff(points, axis=0).T)
    risks = problem.field.line_integral(points[:-1], points[1:])
    distance, risk = (np.concatenate([[0.0], np.cumsum(parts)]) for parts in (steps, risks))
    return Profile(points, distance, problem.field.density(points), risk, distance + problem.k * risk)


def timed_profile_of(problem: TimedProblem, trajectory: Timed) -> Profile:
    """
    Compute the profile of a timed path, at times that are as near as the steps of `profile_of` are.

    Parameters
    ----------
    problem
        The problem that gives risk, wind and prices.
    trajectory
        Rows ``(t, x, y)``, as `TimedProblem.evaluate` takes them.

    Raises
    ------
    ProblemError
        If the rows are malformed, or the wind is too strong for a leg.

    Examples
    --------
    >>> problem = TimedProblem((0, 0.5), (1, 0.5), speed=0.5, waiting=0.1)
    >>> profile = timed_profile_of(problem, [(0, 0, 0.5), (1, 0, 0.5), (3, 1, 0.5)])
    >>> float(profile.times[-1]), float(profile.distance[-1]), round(float(profile.cost[-1]), 9)
    (3.0, 1.0, 1.1)
    """
    rows = timed_rows(trajectory)
    fields = [problem.field, *(field for _, field in problem.fields)]
    spreads = [float(np.min(threat.spread)) for threat in problem.moving]
    counts = _parts(problem.speed * np.diff(rows[:, 0]), fields, spreads)
    fine = [rows[:1]]
    for first, last, count in zip(rows[:-1], rows[1:], counts, strict=True):
        part = np.linspace(first, last, count + 1)
        if (first[1:] != last[1:]).any():
            part = problem.fly(part[:, 1:], float(first[0]))
        fine += [part[1:-1], last[None]]
    flight = flown(problem, np.concatenate(fine))
    times, points = flight.rows[:, 0], flight.rows[:, 1:]
    waits, taken = (np.diff(points, axis=0) == 0.0).all(axis=1), np.diff(times)
    parts = (
        np.where(waits, 0.0, problem.speed * taken),
        np.where(waits, (problem.waiting or 0.0) * taken, 0.0),
        np.bincount(flight.legs, flight.risks, len(taken)),
    )
    distance, waited, risk = (np.append(0.0, np.cumsum(part)) for part in parts)
    density = [float(problem.field_at(time).density(point)) for time, point in zip(times.tolist(), points, strict=True)]
    return Profile(points, distance, np.array(density), risk, distance + waited + problem.k * risk, times)


def _parts(lengths: FloatArray, fields: Sequence[RiskField], spreads: Sequence[float] = ()) -> list[int]:
    """Return into how many parts each leg is divided."""
    length = float(lengths.sum())
    cells = [min(raster.cell_size) / CELL_STEPS for field in fields for raster in field.rasters]
    spreads = [*spreads, *(threat.spread for field in fields for threat in field.every_threat)]
    step = min([length / LEAST_STEPS, *cells, *(spread / SPREAD_STEPS for spread in spreads)])
    step = max(step, length / max(MOST_ROWS - len(lengths) - 1, LEAST_STEPS))
    return [max(1, math.ceil(one / step)) if step > 0.0 else 1 for one in lengths.tolist()]


def profile_csv(scenario: Scenario, profile: Profile, seconds: FloatArray | None = None) -> str:
    """Write a profile as CSV: times, if any, `COLUMNS`, seconds, if known, and longitude and latitude of such maps."""
    columns, table = list(COLUMNS), [profile.distance, profile.points, profile.density, profile.risk, profile.cost]
    if profile.times is not None:
        columns, table = ["time", *columns], [profile.times, *table]
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
    flown = (profile.cost - scenario.problem.k * profile.risk) * scale
    along, where, label = profile.distance * scale, f"distance along the path{unit}", "length"
    if profile.times is not None:
        along, where, label = profile.times, "time", "distance through the air, and waiting"
    density = density_text(scenario.problem.field)
    if scenario.in_time.get("risk_per") == "time":
        density = "risk per unit of time"
    name, title = heading(scenario.name, scenario.title, scenario.problem.k)
    with style():
        figure = Figure(figsize=_SIZE, layout="constrained")
        FigureCanvasAgg(figure)
        above, below = figure.subplots(2, 1, sharex=True)
        figure.suptitle(f"{name}:  {title}" if title else name, x=0.01, ha="left", fontsize=10.0, wrap=True)
        above.fill_between(along, 0.0, profile.density, color="#6445AF", alpha=0.25, linewidth=0.0)
        above.plot(along, profile.density, color="#6445AF", linewidth=0.9)
        above.set_ylabel(density)
        below.fill_between(along, 0.0, flown, color="0.85", linewidth=0.0, label=label)
        below.fill_between(
            along, flown, profile.cost * scale, color="#6445AF", alpha=0.45, linewidth=0.0, label="k * risk"
        )
        below.plot(along, profile.cost * scale, color="0.15", linewidth=1.0, label="cost")
        below.set_ylabel(f"cost so far{unit}")
        below.set_xlabel(where)
        below.legend(loc="upper left", frameon=False)
        for axes in (above, below):
            axes.set_xlim(float(along[0]), max(float(along[-1]), np.nextafter(along[0], math.inf)))
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
    path: Path, scenario: Scenario, profile: Profile, clock: Callable[[FloatArray], FloatArray] | None = None
) -> Path:
    """
    Write a profile, whole or not at all: CSV, or a plot where the name ends in .png, .svg or .pdf.

    A `clock` returns the times at points on the path, shape ``(n, 2)``; a table then has the seconds as well.

    Raises
    ------
    OutputError
        If it cannot be written.
    """
    check_profile_file(path)
    if path.suffix.lower() != ".csv":
        return pictures.save(profile_figure(scenario, profile), path)
    seconds = None if clock is None else clock(profile.points)
    write_files({path: profile_csv(scenario, profile, seconds).encode()})
    return path
