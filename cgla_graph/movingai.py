"""
Grid maps and scenarios of the Moving AI Lab.

Format: https://movingai.com/benchmarks/formats.html; Sturtevant (2012), "Benchmarks for Grid-Based
Pathfinding". The cell of column c and row r is the square [c, c + 1] x [r, r + 1] in map units; rows are
counted from the top of the file, so y grows downward.

This module is longer than most: the two files of the format only make sense together.
"""

import math
import os
import re
from dataclasses import dataclass
from pathlib import Path
from reprlib import repr as short
from typing import NoReturn

import numpy as np
import shapely
from scipy import ndimage, sparse
from scipy.sparse import csgraph
from shapely.geometry import MultiPolygon, Polygon

from cgla_graph._types import BoolArray, Bounds, FloatArray, Point
from cgla_graph.errors import ScenarioError

FREE = ".GS"
BLOCKED = "@OTW"
HEADER = ("type octile", "height <rows>", "width <columns>", "map")
COLUMNS = "bucket, map, map width, map height, start column, start row, goal column, goal row, optimal length"


@dataclass(frozen=True, eq=False)
class GridMap:
    """
    A grid of free and blocked cells.

    Parameters
    ----------
    name
        What the map is called.
    blocked
        True where a cell is blocked, shape (height, width); copied, and read-only from then on.

    Raises
    ------
    ScenarioError
        If ``blocked`` has no two axes or no cell.

    Examples
    --------
    >>> grid = GridMap("corner", np.array([[False, False], [False, True]]))
    >>> grid.bounds, grid.no_fly().area
    ((0.0, 0.0, 2.0, 2.0), 1.0)
    """

    name: str
    blocked: BoolArray

    def __post_init__(self) -> None:
        """Copy the cells, so that neither the caller's array nor the map can change the other."""
        blocked = np.array(self.blocked, dtype=np.bool_, order="C")
        if blocked.ndim != 2 or blocked.size == 0:  # noqa: PLR2004 - a grid
            allowed = "(height, width) with at least one cell"
            wrong = f"blocked has shape {blocked.shape}"
            _fail(f"map {self.name!r}", wrong, allowed, "pass one truth value a cell")
        blocked.flags.writeable = False
        object.__setattr__(self, "blocked", blocked)

    @property
    def bounds(self) -> Bounds:
        """
        Smallest x, smallest y, greatest x, greatest y (map units): 0, 0, width and height.

        Examples
        --------
        >>> GridMap("strip", np.zeros((1, 3), dtype=bool)).bounds
        (0.0, 0.0, 3.0, 1.0)
        """
        height, width = self.blocked.shape
        return 0.0, 0.0, float(width), float(height)

    def centre(self, column: int, row: int) -> Point:
        """
        Return the centre of a cell (map units).

        Parameters
        ----------
        column, row
            The cell, counted from 0.

        Raises
        ------
        ScenarioError
            If the cell is not on the map.

        Examples
        --------
        >>> GridMap("strip", np.zeros((1, 3), dtype=bool)).centre(2, 0)
        (2.5, 0.5)
        """
        _check_on_map(self, column, row, "cell", "choose a cell of the map")
        return column + 0.5, row + 0.5

    def no_fly(self) -> MultiPolygon:
        """
        Return the union of the blocked cells (map units); empty where no cell is blocked.

        Examples
        --------
        A ring of eight cells is one polygon with a hole:

        >>> ring = GridMap("ring", np.array([[1, 1, 1], [1, 0, 1], [1, 1, 1]], dtype=bool))
        >>> ring.no_fly().wkt
        'MULTIPOLYGON (((0 0, 0 3, 3 3, 3 0, 0 0), (1 1, 2 1, 2 2, 1 2, 1 1)))'
        """
        union = shapely.union_all(shapely.box(*_rectangles(self.blocked).T))
        # The union keeps a vertex wherever rectangles met; without them every later question is faster.
        union = shapely.normalize(shapely.simplify(union, 0.0))
        return MultiPolygon([part for part in shapely.get_parts(union).tolist() if isinstance(part, Polygon)])

    def far_pair(self) -> tuple[Point, Point]:
        """
        Return the centres of two far-apart free cells that a path joins (map units).

        Both lie in the largest region of free cells that share sides (the first in reading order, if several
        are as large). The first is farthest from the first cell of the region, the second is farthest from the
        first, in steps from cell to cell: exact on a tree, a good guess elsewhere, always the same.

        Raises
        ------
        ScenarioError
            If no two free cells share a side.

        Examples
        --------
        >>> GridMap("strip", np.array([[False, False, False, True, False]])).far_pair()
        ((2.5, 0.5), (0.5, 0.5))
        """
        labels, _ = ndimage.label(~self.blocked)
        sizes = np.bincount(labels.ravel())
        sizes[0] = 0
        if sizes.max() < 2:  # noqa: PLR2004 - a pair
            wrong = "no two free cells share a side, so there is no start and goal to choose"
            allowed = "a region of at least two free cells"
            _fail(f"map {self.name!r}", wrong, allowed, "give a map with more free cells")
        region = labels == np.argmax(sizes)
        first = _farthest(region, int(np.argmax(region)))
        cells = [divmod(cell, region.shape[1]) for cell in (first, _farthest(region, first))]
        here, there = (self.centre(column, row) for row, column in cells)
        return here, there


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
    Read a grid map (``.map``): free or blocked only, never what a terrain costs to cross.

    Free are ``.``, ``G`` and ``S`` (swamp); blocked are ``@``, ``O``, ``T`` and ``W``. The map is named by
    the file, without ``.map``.

    Parameters
    ----------
    path
        The file.

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
        where = f"{file}, line {len(HEADER) + min(len(rows), height) + 1}"
        wrong, remedy = ("ends too early", "restore") if len(rows) < height else ("goes on too long", "drop")
        wrong = f"the map {wrong}: it has {len(rows)} rows"
        _fail(where, wrong, f"exactly {height}", f"{remedy} rows, or correct the height")
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
        _fail(f"{file}, line 1", f"the version is {short(lines[0])}", "'version 1'", "write that line")
    numbered = [(number, line) for number, line in enumerate(lines[1:], start=2) if line]
    if not numbered:
        _fail(f"{file}, line 2", "there is no row", "at least one", "add a start and a goal")
    return [_row(line, index, f"{file}, line {number}") for index, (number, line) in enumerate(numbered)]


def map_beside(scen_path: str | os.PathLike[str], row: GridRow) -> Path:
    """
    Return the map file of a scenario file: one in the same folder.

    It is called as the row names it (without folders), or as the scenario file without ``.scen``.

    Parameters
    ----------
    scen_path
        The scenario file.
    row
        A row of it.

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
    found = [scen.parent / name for name in names if _is_file(scen.parent / name)]
    if not found:
        wrong = f"row {row.index} names the map {short(row.map_name)}, which is not in the same folder"
        _fail(repr(os.fspath(scen_path)), wrong, " or ".join(map(short, names)), "put the map there")
    return found[0]


def check_row(row: GridRow, grid: GridMap) -> None:
    """
    Check that a row of a scenario file fits a map.

    Parameters
    ----------
    row
        The row.
    grid
        The map.

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
    where, remedy = f"map {grid.name!r}", "choose another row, or the map that the row was made for"
    height, width = grid.blocked.shape
    if (row.width, row.height) != (width, height):
        wrong = f"row {row.index} is for a map of {row.width} columns and {row.height} rows"
        _fail(where, wrong, f"the size of this map, {width} and {height},", remedy)
    for word, (column, line) in (("start", row.start), ("goal", row.goal)):
        what = f"the {word} of row {row.index}"
        _check_on_map(grid, column, line, what, remedy)
        if grid.blocked[line, column]:
            _fail(where, f"{what} (column {column}, row {line}) is blocked", "a free cell", remedy)


def _fail(where: str, wrong: str, allowed: str, remedy: str) -> NoReturn:
    """Raise the error that says where and what is wrong, what is allowed, and what to do."""
    message = f"{where}: {wrong}; {allowed} is allowed: {remedy}"
    raise ScenarioError(" ".join(message.split()))


def _check_on_map(grid: GridMap, column: int, row: int, what: str, remedy: str) -> None:
    """Check that a cell is on a map."""
    height, width = grid.blocked.shape
    if not (0 <= column < width and 0 <= row < height):
        wrong = f"{what} (column {column}, row {row}) is not on it"
        _fail(f"map {grid.name!r}", wrong, f"column 0 to {width - 1} and row 0 to {height - 1}", remedy)


def _is_file(path: Path) -> bool:
    """Return whether a file is there; a name that no file can have is none."""
    try:
        return path.is_file()
    except (OSError, ValueError):
        return False


def _lines(path: str | os.PathLike[str], file: str) -> list[str]:
    """Return the lines of a text file without blanks at their ends; blank lines at the end are dropped."""
    try:
        text = Path(path).read_text(encoding="utf-8-sig")
    except FileNotFoundError:
        _fail(file, "there is no such file", "a file that exists", "check the name and the folder")
    except OSError as error:
        _fail(file, f"cannot be read ({error.strerror})", "a text file", "give one that you may read")
    except UnicodeDecodeError as error:
        _fail(file, f"byte {error.start} is no text", "UTF-8 text", "give a file of the Moving AI Lab")
    except ValueError as error:
        _fail(file, f"no file has such a name ({error})", "a file that exists", "check the name")
    return [line.rstrip() for line in text.rstrip().split("\n")]


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
            _fail(f"{file}, line {number}", f"the header has {short(line)}", repr(allowed), remedy)
        found.extend(numbers)
    height, width = found
    return height, width


def _check_cells(row: str, width: int, where: str) -> None:
    """Check one row of a map."""
    unknown = re.search(f"[^{FREE}{BLOCKED}]", row)
    if unknown:
        where = f"{where}, column {unknown.start() + 1}"
        allowed = f"one of {', '.join(FREE)} (free) and {', '.join(BLOCKED)} (blocked)"
        _fail(where, f"{unknown.group()!a} is no cell", allowed, "replace it by one of these")
    if len(row) != width:
        _fail(where, f"the row has {len(row)} cells", f"exactly {width}", "correct the row, or the width")


def _row(line: str, index: int, where: str) -> GridRow:
    """Return one row of a scenario file."""
    columns = COLUMNS.split(", ")
    # A name may hold blanks where tabs divide the columns.
    fields = line.split("\t") if line.count("\t") == len(columns) - 1 else line.split()
    if len(fields) != len(columns):
        wrong = f"the row has {len(fields)} columns"
        _fail(where, wrong, f"exactly {len(columns)}", f"write {COLUMNS}, with tabs between them")
    numbers = [_count(fields[at], f"{where}, column {at + 1}", columns[at]) for at in (0, 2, 3, 4, 5, 6, 7)]
    bucket, width, height, *cells = numbers
    try:
        length = float(fields[8])
    except ValueError:
        length = math.nan
    if not 0.0 <= length < math.inf:
        wrong, allowed = f"the optimal length is {short(fields[8])}", "a finite number of at least 0"
        _fail(f"{where}, column 9", wrong, allowed, "correct that column")
    start, goal = (cells[0], cells[1]), (cells[2], cells[3])
    return GridRow(index, bucket, fields[1].strip(), width, height, start, goal, length)


def _count(text: str, where: str, what: str) -> int:
    """Return a whole number of at least 0."""
    if not re.fullmatch(r"[0-9]{1,9}", text.strip()):
        _fail(where, f"the {what} is {short(text)}", "a whole number of at least 0", "correct that column")
    return int(text)


def _rectangles(blocked: BoolArray) -> FloatArray:
    """Return rectangles that tile the blocked cells, shape (n, 4): least x and y, greatest x and y."""
    edges = np.diff(np.pad(blocked, ((0, 0), (1, 1))).astype(np.int8), axis=1)
    rows, begins = np.nonzero(edges == 1)
    _, ends = np.nonzero(edges == -1)
    order = np.lexsort((rows, ends, begins))
    runs = np.stack([begins, rows, ends], axis=-1)[order]
    # A run goes on from the row above when it begins and ends in the same columns.
    goes_on = (np.diff(runs, axis=0) == (0, 1, 0)).all(axis=-1)
    top = runs[np.concatenate([[True], ~goes_on])[: len(runs)]]
    bottom = runs[np.concatenate([~goes_on, [True]])[: len(runs)]]
    return np.column_stack([top, bottom[:, 1] + 1]).astype(np.float64)


def _farthest(region: BoolArray, cell: int) -> int:
    """Return the first cell of a region that is most steps from a cell (indices in reading order)."""
    nodes = np.arange(region.size).reshape(region.shape)
    across, down = region[:, :-1] & region[:, 1:], region[:-1] & region[1:]
    tails = np.concatenate([nodes[:, :-1][across], nodes[:-1][down]])
    heads = np.concatenate([nodes[:, 1:][across], nodes[1:][down]])
    sides = sparse.csr_array((np.ones(tails.size), (tails, heads)), shape=(region.size, region.size))
    steps = csgraph.dijkstra(sides, directed=False, indices=[cell], unweighted=True)
    return int(np.argmax(np.where(np.isfinite(steps), steps, -1.0)))
