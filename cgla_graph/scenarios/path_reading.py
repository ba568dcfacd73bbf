"""Readers of a problem's paths: waypoints in CSV files, and flight plans."""

import csv
import io
import math
import os
from pathlib import Path

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path, instance
from cgla_graph.airspace.flight_plans.csv_columns import SHAPES
from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.errors import ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.scenarios.text_files import read_text, scenario_errors
from cgla_graph.untrusted.numbers import decimal

#: Start and goal in a file may be off by this, relative to the longer side of the map, as rounded coordinates are.
END_TOLERANCE = 1e-6
#: Endings of flight plans in other formats than CSV.
PLANS = (".plan", ".waypoints", ".kml", ".kmz", ".gpx", ".geojson", ".json")


def read_path(file: str | os.PathLike[str], problem: Problem) -> FloatArray:
    """
    Read the waypoints of a path of a problem: CSV, or a flight plan in another format.

    Parameters
    ----------
    file
        CSV with the columns ``x`` and ``y``, map units; or on a lon/lat map without these, ``longitude`` and
        ``latitude``, degrees. Other columns are ignored. Or a flight plan in another format, on a lon/lat map.
    problem
        The problem that the path belongs to.

    Returns
    -------
    path
        Shape ``(m, 2)``, map units. Ends within rounding (`END_TOLERANCE`) of start and goal are moved onto them.

    Raises
    ------
    ScenarioError
        If the file does not exist, lacks a column, holds anything but numbers, or does not join start and goal.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> read_path("mine.csv", cg.Problem((0.1, 0.1), (0.9, 0.1)))
    Traceback (most recent call last):
        ...
    cgla_graph.errors.ScenarioError: mine.csv: there is no such file: check the name and the folder
    """
    file = file_path("file", file, ScenarioError)
    instance("problem", problem, Problem, problem_wanted, ScenarioError)
    name = str(file)
    if file.suffix.lower() in PLANS:
        return _joined(_of_plan(file, problem), problem, name)
    heads, lines = table_in(file, name, "a CSV file of waypoints", "a file such as cgla plan --out writes")
    wanted = _columns(heads, problem.projection, name)
    if problem.projection is not None and any(part in head for head in heads for part in SHAPES):
        _require_straight(read_plan(file), name)
    places = [
        numbers_in(line, [heads.index(column) for column in wanted], f"{name}: line {n}", "a waypoint")
        for n, line in lines
    ]
    if not places:
        msg = f"{name}: there are no waypoints below the line {','.join(heads)}; give start, goal and points between"
        raise ScenarioError(msg)
    path = np.array(places)
    if wanted[0] != "x" and problem.projection is not None:
        with scenario_errors(name):
            path = problem.projection.forward(path)
    return _joined(path, problem, name)


def _of_plan(file: Path, problem: Problem) -> FloatArray:
    """Read the waypoints of a flight plan, map units."""
    plan = read_plan(file)
    if (problem.projection is None) is (plan.coordinates == "lonlat"):
        kinds = "x and y", "longitude and latitude"
        here, there = kinds if problem.projection is None else reversed(kinds)
        msg = f"{file}: the plan is in {there}, and the map in {here}; give one of the same coordinates"
        raise ScenarioError(msg)
    _require_straight(plan, str(file))
    points = plan.points if problem.projection is None else problem.projection.forward(plan.points)
    # a landing repeats the end of the last leg
    kept = np.concatenate([[True], (points[1:] != points[:-1]).any(axis=1)])
    return np.asarray(points[kept])


def _require_straight(plan: FlightPlan, name: str) -> None:
    """Check that a plan says everywhere that it is flown straight from waypoint to waypoint."""
    wide = [str(number) for number, one in enumerate(plan.waypoints, start=1) if one.reach > 0.0]
    why = plan.unknown[0] if plan.unknown else f"it circles or passes waypoint {wide[0]} at a distance" if wide else ""
    if why:
        msg = f"{name}: the plan is not flown straight from waypoint to waypoint ({why}); cgla check reads such plans"
        raise ScenarioError(msg)


def _columns(heads: list[str], projection: LocalProjection | None, name: str) -> tuple[str, str]:
    """Choose the two columns that hold the points."""
    pairs = [("x", "y")] if projection is None else [("x", "y"), ("longitude", "latitude")]
    for pair in pairs:
        if set(pair) <= set(heads):
            return pair
    got = f"the first line says {shown(','.join(heads))}" if heads else "it is empty"
    allowed = " or ".join(",".join(pair) for pair in pairs)
    msg = f"{name}: {got}; the first line has to name the columns {allowed}, as cgla plan --out writes them"
    raise ScenarioError(msg)


def table_in(file: Path, name: str, what: str, wanted: str) -> tuple[list[str], list[tuple[int, list[str]]]]:
    """
    Read a CSV file.

    Parameters
    ----------
    file
        The file.
    name, what
        It and its contents, for messages.
    wanted
        What to give instead of a file that is no CSV.

    Returns
    -------
    heads, lines
        The cells of the first line, in small letters, none if the file is empty; and the others with their numbers.

    Raises
    ------
    ScenarioError
        If the file cannot be read, or is no CSV.

    Examples
    --------
    >>> table_in(Path("bases.csv"), "bases.csv", "a CSV file", "a table")
    Traceback (most recent call last):
    cgla_graph.errors.ScenarioError: bases.csv: there is no such file: check the name and the folder
    """
    # a reader of CSV splits the lines itself
    reader = csv.reader(io.StringIO(read_text(file, name, what), newline=""), strict=True)
    try:
        lines = [(reader.line_num, line) for line in reader if line]
    except csv.Error as error:
        msg = f"{name}: line {reader.line_num} is no CSV ({error}); give {wanted}"
        raise ScenarioError(msg) from error
    return [head.strip().lower() for head in lines[0][1]] if lines else [], lines[1:]


def numbers_in(line: list[str], places: list[int], where: str, what: str) -> list[float]:
    """
    Read the numbers of some columns of a line.

    Parameters
    ----------
    line
        Its cells.
    places
        Numbers of the columns, from 0.
    where, what
        The line and what the numbers are, for the message of an error.

    Raises
    ------
    ScenarioError
        If one is no finite number.

    Examples
    --------
    >>> numbers_in(["a", "0.5", "1"], [1, 2], "line 2", "a place")
    [0.5, 1.0]
    """
    cells = [line[place].strip() if place < len(line) else "" for place in places]
    try:
        numbers = [decimal(cell) for cell in cells]
    except ValueError:
        numbers = [math.nan]
    if not all(map(math.isfinite, numbers)):
        msg = f"{where} holds {shown(','.join(cells))}; {what} is two finite numbers"
        raise ScenarioError(msg)
    return numbers


def _joined(path: FloatArray, problem: Problem, name: str) -> FloatArray:
    """Move the ends of a path onto start and goal, which they may miss by rounding only."""
    x_min, y_min, x_max, y_max = problem.bounds
    allowed = END_TOLERANCE * max(x_max - x_min, y_max - y_min)
    joined = path.copy()
    for what, index, end in (("starts", 0, problem.start), ("ends", -1, problem.goal)):
        if math.dist(path[index], end) > allowed:
            at = "({:.9g}, {:.9g})"
            msg = (
                f"{name}: the path {what} at {at.format(*path[index])} instead of {at.format(*end)}; give a path of "
                "this scenario, or move its ends with --start and --goal"
            )
            raise ScenarioError(msg)
        joined[index] = end
    return joined
