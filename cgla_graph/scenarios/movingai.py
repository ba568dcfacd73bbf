"""
Grid maps and scenarios of the Moving AI Lab.

Format: https://movingai.com/benchmarks/formats.html; Sturtevant (2012), "Benchmarks for Grid-Based
Pathfinding".
"""

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cgla_graph._text import shown
from cgla_graph.scenarios.grid_map import GridMap, check_on_map
from cgla_graph.scenarios.text_files import fail, is_file, read_text
from cgla_graph.untrusted.numbers import decimal

FREE = ".GS"
BLOCKED = "@OTW"
HEADER = ("type octile", "height <rows>", "width <columns>", "map")
COLUMNS = "bucket, map, map width, map height, start column, start row, goal column, goal row, optimal length"


@dataclass(frozen=True)
class GridRow:
    """
    One start and goal of a scenario file, with the published length of the shortest path on the grid.

    Parameters
    ----------
    index
        Which row of the file it is, counted from 0.
    bucket
        The group of rows of about the same length.
    map_name
        The map, as the file names it (often with folders that do not exist here).
    width, height
        Columns and rows of the map.
    start, goal
        Column and row of a cell, counted from 0.
    optimal_length
        Least length over the grid in cells, 8-connected: a diagonal step needs both its orthogonal
        neighbours free.

    Examples
    --------
    >>> GridRow(0, 0, "maps/dao/arena.map", 49, 49, (1, 11), (1, 12), 1.0).goal
    (1, 12)
    """

    index: int
    bucket: int
    map_name: str
    width: int
    height: int
    start: tuple[int, int]
    goal: tuple[int, int]
    optimal_length: float


def read_map(path: str | os.PathLike[str]) -> GridMap:
    r"""
    Read a grid map (``.map``); a cell is free or blocked, costs of terrain are ignored.

    Free are ``.``, ``G`` and ``S`` (swamp); blocked are ``@``, ``O``, ``T`` and ``W``. The map is named by
    the file, without ``.map``.

    Raises
    ------
    ScenarioError
        If the file is missing, unreadable or no text; if a line of the header is missing or wrong; if rows
        are missing, too short, too long or too many; if a character is unknown.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "tiny.map")
    ...     _ = file.write_text("type octile\nheight 2\nwidth 3\nmap\n..@\nGST\n")
    ...     grid = read_map(file)
    >>> grid.name, grid.blocked.astype(int).tolist()
    ('tiny', [[0, 0, 1], [0, 0, 1]])
    """
    file = repr(os.fspath(path))
    lines = _lines(path, file)
    height, width = _header(lines, file)
    rows = lines[len(HEADER) :]
    for number, row in enumerate(rows[:height], start=len(HEADER) + 1):
        _check_cells(row, width, f"{file}, line {number}")
    if len(rows) != height:
        line = len(HEADER) + min(len(rows), height) + 1
        wrong, remedy = ("ends too early", "restore") if len(rows) < height else ("goes on too long", "drop")
        wrong = f"{file}, line {line}: the map {wrong}: it has {len(rows)} rows"
        fail(wrong, f"exactly {height}", f"{remedy} rows, or correct the height")
    cells = np.array([list(row) for row in rows])
    return GridMap(Path(path).name.removesuffix(".map"), np.isin(cells, list(BLOCKED)))


def read_scenario_rows(path: str | os.PathLike[str]) -> list[GridRow]:
    r"""
    Read the rows of a scenario file (``.scen``): starts and goals on one map.

    Parameters
    ----------
    path
        The file: a line ``version 1``, then nine columns a row, between tabs or blanks.

    Raises
    ------
    ScenarioError
        If the file is missing, unreadable or no text; if the version is another; if there is no row; if a
        row has not nine columns, or one of them is no number or not allowed.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "tiny.map.scen")
    ...     _ = file.write_text("version 1\n0\ttiny.map\t3\t2\t0\t0\t1\t1\t1.41421\n")
    ...     rows = read_scenario_rows(file)
    >>> rows[0].start, rows[0].goal, rows[0].optimal_length
    ((0, 0), (1, 1), 1.41421)
    """
    file = repr(os.fspath(path))
    lines = _lines(path, file)
    if not re.fullmatch(r"version\s+1(\.0*)?", lines[0]):
        fail(f"{file}, line 1: the version is {shown(lines[0])}", "'version 1'", "write that line")
    numbered = [(number, line) for number, line in enumerate(lines[1:], start=2) if line]
    if not numbered:
        fail(f"{file}, line 2: there is no row", "at least one", "add a start and a goal")
    return [_row(line, index, f"{file}, line {number}") for index, (number, line) in enumerate(numbered)]


def map_beside(scen_path: str | os.PathLike[str], row: GridRow) -> Path:
    """
    Return the map file of a scenario file: one in the same folder.

    It is called as the row names it (without folders), or as the scenario file without ``.scen``.

    Raises
    ------
    ScenarioError
        If there is no such file.

    Examples
    --------
    >>> import tempfile
    >>> row = GridRow(0, 0, "maps/dao/tiny.map", 3, 2, (0, 0), (1, 0), 1.0)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     Path(folder, "tiny.map").touch()
    ...     map_beside(Path(folder, "rows.scen"), row).name
    'tiny.map'
    """
    scen = Path(scen_path)
    own = scen.name.removesuffix(".scen")
    # Old files were written on Windows, with its separator.
    names = [re.split(r"[/\\]", row.map_name)[-1], own if own.endswith(".map") else f"{own}.map"]
    found = [scen.parent / name for name in names if is_file(scen.parent / name)]
    if not found:
        wrong = f"row {row.index} names the map {shown(row.map_name)}, which is not in the same folder"
        fail(f"{shown(os.fspath(scen_path))}: {wrong}", " or ".join(map(shown, names)), "put the map there")
    return found[0]


def check_row(row: GridRow, grid: GridMap) -> None:
    """
    Check that a row of a scenario file fits a map.

    Raises
    ------
    ScenarioError
        If the row is for a map of another size, or its start or goal is off the map or blocked.

    Examples
    --------
    >>> grid = GridMap("tiny", np.array([[False, False, True]]))
    >>> check_row(GridRow(0, 0, "tiny.map", 3, 1, (0, 0), (1, 0), 1.0), grid)
    >>> check_row(GridRow(0, 0, "tiny.map", 3, 1, (0, 0), (2, 0), 2.0), grid)
    Traceback (most recent call last):
    ...
    cgla_graph.errors.ScenarioError: map 'tiny': the goal of row 0 (column 2, row 0) is blocked; a free cell
    is allowed: choose another row, or the map that the row was made for
    """
    where, remedy = f"map {shown(grid.name)}", "choose another row, or the map that the row was made for"
    height, width = grid.blocked.shape
    if (row.width, row.height) != (width, height):
        wrong = f"row {row.index} is for a map of {row.width} columns and {row.height} rows"
        fail(f"{where}: {wrong}", f"the size of this map, {width} and {height},", remedy)
    for word, (column, line) in (("start", row.start), ("goal", row.goal)):
        what = f"the {word} of row {row.index}"
        check_on_map(grid, column, line, what, remedy)
        if grid.blocked[line, column]:
            fail(f"{where}: {what} (column {column}, row {line}) is blocked", "a free cell", remedy)


def _lines(path: str | os.PathLike[str], file: str) -> list[str]:
    """Return the lines of a text file without blanks at their ends; blank lines at the end are dropped."""
    return [line.rstrip() for line in read_text(path, file, "a file of the Moving AI Lab").rstrip().split("\n")]


def _header(lines: list[str], file: str) -> tuple[int, int]:
    """Return height and width after checking the four lines of a map's header."""
    patterns = (r"type\s+octile", r"height\s+([0-9]{1,9})", r"width\s+([0-9]{1,9})", r"map")
    found: list[int] = []
    for number, (pattern, allowed) in enumerate(zip(patterns, HEADER, strict=True), start=1):
        line = lines[number - 1] if number <= len(lines) else ""
        match = re.fullmatch(pattern, line)
        numbers = [int(text) for text in match.groups()] if match else [0]
        if 0 in numbers:
            remedy = f"write the lines {', '.join(HEADER)}, with numbers of at least 1"
            fail(f"{file}, line {number}: the header has {shown(line)}", repr(allowed), remedy)
        found.extend(numbers)
    height, width = found
    return height, width


def _check_cells(row: str, width: int, where: str) -> None:
    """Check one row of a map."""
    unknown = re.search(f"[^{FREE}{BLOCKED}]", row)
    if unknown:
        wrong = f"{where}, column {unknown.start() + 1}: {unknown.group()!a} is no cell"
        allowed = f"one of {', '.join(FREE)} (free) and {', '.join(BLOCKED)} (blocked)"
        fail(wrong, allowed, "replace it by one of these")
    if len(row) != width:
        fail(f"{where}: the row has {len(row)} cells", f"exactly {width}", "correct the row, or the width")


def _row(line: str, index: int, where: str) -> GridRow:
    """Return one row of a scenario file."""
    columns = COLUMNS.split(", ")
    # A name may hold blanks where tabs divide the columns.
    fields = line.split("\t") if line.count("\t") == len(columns) - 1 else line.split()
    if len(fields) != len(columns):
        wrong = f"{where}: the row has {len(fields)} columns"
        fail(wrong, f"exactly {len(columns)}", f"write {COLUMNS}, with tabs between them")
    numbers = [_count(fields[at], f"{where}, column {at + 1}", columns[at]) for at in (0, 2, 3, 4, 5, 6, 7)]
    bucket, width, height, *cells = numbers
    try:
        length = decimal(fields[8].strip())
    except ValueError:
        length = math.nan
    if not 0.0 <= length < math.inf:
        wrong = f"{where}, column 9: the optimal length is {shown(fields[8])}"
        fail(wrong, "a finite number of at least 0", "correct that column")
    start, goal = (cells[0], cells[1]), (cells[2], cells[3])
    return GridRow(index, bucket, fields[1].strip(), width, height, start, goal, length)


def _count(text: str, where: str, what: str) -> int:
    """Return a whole number of at least 0."""
    if not re.fullmatch(r"[0-9]{1,9}", text.strip()):
        fail(f"{where}: the {what} is {shown(text)}", "a whole number of at least 0", "correct that column")
    return int(text)
