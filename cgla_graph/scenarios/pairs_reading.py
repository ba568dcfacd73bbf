"""Reader of tables of starts and goals: many questions to one map."""

import os
from typing import NamedTuple

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path, instance
from cgla_graph.errors import ScenarioError
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.scenarios.path_reading import numbers_in, table_in
from cgla_graph.scenarios.text_files import scenario_errors

#: The axes of a table, in the plane and in degrees.
AXES = (("x", "y"), ("longitude", "latitude"))
ENDS = ("start", "goal")


class Pairs(NamedTuple):
    """
    Questions to a map, as `cgla_graph.Map.solve` takes them.

    Attributes
    ----------
    starts, goals
        Shape ``(n, 2)``, map units.
    names
        Their names; None without a column of names.
    """

    starts: FloatArray
    goals: FloatArray
    names: list[str] | None


def read_pairs(file: str | os.PathLike[str], problem: Problem) -> Pairs:
    """
    Read starts and goals from a CSV file.

    Parameters
    ----------
    file
        Columns ``start_x``, ``start_y``, ``goal_x``, ``goal_y``, map units; on a lon/lat map ``start_longitude``,
        ``start_latitude``, ``goal_longitude``, ``goal_latitude``, degrees, or those. Both columns of the starts may be
        left out, or both of the goals: then it is that of the problem. A column ``name`` is optional; others are
        ignored.
    problem
        The problem of the map.

    Returns
    -------
    pairs
        One for each line, in order.

    Raises
    ------
    ScenarioError
        If the file does not exist, lacks a column or has one twice, has another column whose name begins with ``start``
        or ``goal``, there is no line below the first one, a line has more cells than that, or a coordinate is no finite
        number; the message says in which line.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> read_pairs("bases.csv", cg.Problem((0.1, 0.1), (0.9, 0.1)))
    Traceback (most recent call last):
        ...
    cgla_graph.errors.ScenarioError: bases.csv: there is no such file: check the name and the folder
    """
    file = file_path("file", file, ScenarioError)
    instance("problem", problem, Problem, problem_wanted, ScenarioError)
    name = str(file)
    heads, lines = table_in(file, name, "a CSV file of starts and goals", "a table of starts and goals")
    _check_columns(heads, lines, name)
    found = [_ends(end, heads, lines, problem, name) for end in ENDS]
    if all(one is None for one in found):
        got = f"the first line says {shown(','.join(heads))}" if heads else "it is empty"
        axes = AXES[:1] if problem.projection is None else AXES
        allowed = " or ".join(",".join(f"{end}_{axis}" for end in ENDS for axis in pair) for pair in axes)
        msg = f"{name}: {got}; the first line has to name the columns {allowed}, or those of one end"
        raise ScenarioError(msg)
    if not lines:
        msg = f"{name}: there is no line below the first one, and so no question; give a line for each"
        raise ScenarioError(msg)
    ends = (problem.start, problem.goal)
    starts, goals = (
        np.tile(end, (len(lines), 1)).reshape(-1, 2) if one is None else one
        for one, end in zip(found, ends, strict=True)
    )
    column = heads.index("name") if "name" in heads else None
    names = None if column is None else [line[column].strip() if column < len(line) else "" for _, line in lines]
    return Pairs(starts, goals, names)


def _check_columns(heads: list[str], lines: list[tuple[int, list[str]]], name: str) -> None:
    """Check that no place is left out or doubtful because of a column that is misspelt, or comes twice."""
    known = [f"{end}_{axis}" for end in ENDS for axes in AXES for axis in axes]
    for head in heads:
        if heads.count(head) > 1 and head in {*known, "name"}:
            msg = f"{name}: the first line has the column {head} {heads.count(head)} times; leave one"
            raise ScenarioError(msg)
        if head.startswith(ENDS) and head not in known:
            msg = f"{name}: {shown(head)} is no column of a place; rename it, columns of places are {', '.join(known)}"
            raise ScenarioError(msg)
    for number, line in lines:
        if len(line) > len(heads) and any(cell.strip() for cell in line[len(heads) :]):
            msg = (
                f"{name}: line {number} has {len(line)} cells, and the first line names {len(heads)} columns; write "
                "numbers with a point, and names with a comma in quotation marks"
            )
            raise ScenarioError(msg)


def _ends(
    end: str, heads: list[str], lines: list[tuple[int, list[str]]], problem: Problem, name: str
) -> FloatArray | None:
    """Read the starts or the goals, map units; None if there are no columns for them."""
    projection = problem.projection
    for axes in AXES[: 1 if projection is None else 2]:
        columns = [f"{end}_{axis}" for axis in axes]
        known = [column for column in columns if column in heads]
        if not known:
            continue
        if len(known) == 1:
            lacking = next(column for column in columns if column not in heads)
            msg = f"{name}: there is a column {known[0]}, but no column {lacking}; give both, or neither"
            raise ScenarioError(msg)
        numbers = [
            numbers_in(line, [heads.index(column) for column in columns], f"{name}: line {number}", "a place")
            for number, line in lines
        ]
        places = np.array(numbers, dtype=np.float64).reshape(-1, 2)
        if axes[0] == "x" or projection is None or not len(places):
            return places
        with scenario_errors(name):
            return projection.forward(places)
    return None
