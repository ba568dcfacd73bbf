"""
Grid maps of free and blocked cells, and the no-fly area of the blocked ones.

The cell of column c and row r is the square [c, c + 1] x [r, r + 1] in map units. Grid maps count rows from the top
of the file, so y grows downward.
"""

from dataclasses import dataclass

import numpy as np
import scipy
import shapely
from shapely.geometry import MultiPolygon, Polygon

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, Bounds, FloatArray, Point
from cgla_graph._validate import unmasked
from cgla_graph.scenarios.text_files import fail


@dataclass(frozen=True, eq=False)
class GridMap:
    """
    A grid of free and blocked cells.

    Parameters
    ----------
    name
        The name of the map.
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
        blocked = np.array(unmasked("blocked", self.blocked), dtype=np.bool_, order="C")
        if blocked.ndim != 2 or blocked.size == 0:  # noqa: PLR2004 - a grid
            wrong = f"map {shown(self.name)}: blocked has shape {blocked.shape}"
            fail(wrong, "(height, width) with at least one cell", "pass one truth value a cell")
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
        check_on_map(self, column, row, "cell", "choose a cell of the map")
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
        labels, _ = scipy.ndimage.label(~self.blocked)
        sizes = np.bincount(labels.ravel())
        sizes[0] = 0
        if sizes.max() < 2:  # noqa: PLR2004 - a pair
            wrong = f"map {shown(self.name)}: no two free cells share a side, so there is no start and goal to choose"
            fail(wrong, "a region of at least two free cells", "give a map with more free cells")
        region = labels == np.argmax(sizes)
        first = _farthest(region, int(np.argmax(region)))
        cells = [divmod(cell, region.shape[1]) for cell in (first, _farthest(region, first))]
        here, there = (self.centre(column, row) for row, column in cells)
        return here, there


def check_on_map(grid: GridMap, column: int, row: int, what: str, remedy: str) -> None:
    """Check that a cell is on a map."""
    height, width = grid.blocked.shape
    if not (0 <= column < width and 0 <= row < height):
        wrong = f"map {shown(grid.name)}: {what} (column {column}, row {row}) is not on it"
        fail(wrong, f"column 0 to {width - 1} and row 0 to {height - 1}", remedy)


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
    """Return the cell of a region that is the most steps from a cell, the first of several (indices, reading order)."""
    nodes = np.arange(region.size).reshape(region.shape)
    across, down = region[:, :-1] & region[:, 1:], region[:-1] & region[1:]
    tails = np.concatenate([nodes[:, :-1][across], nodes[:-1][down]])
    heads = np.concatenate([nodes[:, 1:][across], nodes[1:][down]])
    sides = scipy.sparse.csr_array((np.ones(tails.size), (tails, heads)), shape=(region.size, region.size))
    steps = scipy.sparse.csgraph.dijkstra(sides, directed=False, indices=[cell], unweighted=True)
    return int(np.argmax(np.where(np.isfinite(steps), steps, -1.0)))
