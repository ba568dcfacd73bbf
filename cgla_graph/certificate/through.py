"""
Lower bounds of all paths through each place: what no path costs less than if it passes there.

**Statement.** Let ``T`` and ``S`` be the bounds of the cost to the goal and to the start, on one grid (`subsolution`).
A path through ``x`` is a path from the start to ``x``, and one from ``x`` to the goal. It costs at least ``S(x) +
T(x)``, if ``T(x)`` bounds **all** of its second part, and ``S(x)`` all of its first part.

**Charges.** They do, with all charges taken off. Follow a path from ``x`` to the goal. Let it meet the blocks and steep
cells ``B_1, B_2, ...`` in the order of its first entries, each after its last exit from the one before. Between them
phi falls by no more than the path costs; in ``B_i``, from the first entry to the last exit, by no more than that and
the charge of ``B_i``. So the path costs at least ``phi(x) - phi(y)`` up to the rim of the goal's block, less at most
**one** charge for each block, wherever ``x`` is. `Subsolution.values` are lower by the sum of all charges. That is why
a sum of two values bounds a whole path, while the *difference* of two values bounds nothing: of ``phi(a) - phi(b)``
along a segment the charges cancel out, although the segment may owe some. The sum owes the charges of both surfaces: a
block that a path meets before ``x`` and after ``x`` counts twice.

**Inside of blocks** a spline is no bound.

- *In a block around a corner*, a path from ``x`` to the goal leaves the block for the first time at a point ``b`` of
  its rim. Up to there it costs at least ``m |x - b|``, where ``m`` is the least cost in the block; and from there at
  least ``T(b)``, also if it comes back. So the least ``m |x - b| + T(b)`` over the rim is a bound.
- *In the block of an end*, the formula of `tips` bounds the cost to this end, and the other spline the rest. Where both
  ends have the cell in their blocks, both formulas do.
- Everywhere, no path is shorter than the two straight lines from ``x`` to the ends.

**Parts of the map.** A path that costs less than a limit passes only cells whose bound is below the limit, and these
are joined with the start. Others need no list: no path through them costs less than the limit.

**The tube.** On a grid that covers a part of the map, the sum bounds the paths inside that part. If each path that
leaves it costs at least a limit, the lesser of sum and limit is a bound for all paths.

On a map of the Earth the bounds count on the Earth, as that of `certificate` does.
"""

import math
from bisect import bisect_left
from collections.abc import Iterator
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._types import BoolArray, Bounds, FloatArray, Point, WholeArray
from cgla_graph._validate import point_array, positive_number
from cgla_graph.certificate import certificate_kernels, corner_kernels
from cgla_graph.certificate.corners import CornerBlock
from cgla_graph.certificate.costs import geodesic_error, is_provable, least_scale, needed_for, proven
from cgla_graph.certificate.subsolution import (
    MOST_ALONG,
    Block,
    Level,
    Subsolution,
    finer_grid,
    first_grid,
    with_halo,
)
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import descent
from cgla_graph.eikonal.mesh import SplineMesh, bezier_values
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, TOLERANCE
from cgla_graph.refine.refine import refine_path

#: Cells of a grid, at most, by default.
MOST_CELLS = 500_000
#: As in a proof: gains that do not pay for another round; and what is lost at an end or a corner before a finer grid is
#: laid there, as a part of the gap.
FRACTION, WORTH = 0.05, 0.05
#: Rounding of straight lines, relative to their length, and of places, relative to the greatest coordinate.
ROUNDED, PLACED = 2.0**-46, 2.0**-48


@dataclass(frozen=True, eq=False)
class Through:
    """
    Proven lower bounds of all paths through each place, on the cells of one grid.

    Attributes
    ----------
    problem
        The problem.
    last
        Column and row of the last node of the grid, the upper right corner of the bounds. The cell of a node is the
        rectangle of one step around it, as far as it is inside the bounds.
    columns, rows
        The cell of each piece that is listed, shapes ``(m,)``. Where areas cut a cell, it may have several pieces.
    least
        No path through a point of the piece costs less, shape ``(m,)``, map units; on a map in degrees, on the Earth.
    limit
        No path through a cell that is not listed costs less; infinite if the whole map is listed.
    lower_bound
        No path costs less; infinite if there is no path.
    path
        The best path known, shape ``(n, 2)``; None if none is known.
    upper_bound
        Its cost; infinite if none is known.
    cells
        Cells of the grid, those of its rim included.
    """

    problem: Problem
    last: tuple[int, int]
    columns: WholeArray
    rows: WholeArray
    least: FloatArray
    limit: float
    lower_bound: float
    path: FloatArray | None
    upper_bound: float
    cells: int

    def on_cells(self) -> FloatArray:
        """
        Lay the bounds out over the map, the least of the pieces of each cell.

        Returns
        -------
        least
            Shape ``(last[1] + 1, last[0] + 1)``: `limit` where no piece is listed, at most.
        """
        found = np.full((self.last[1] + 1, self.last[0] + 1), self.limit)
        np.minimum.at(found, (self.rows, self.columns), self.least)
        return found

    @property
    def spacing(self) -> tuple[float, float]:
        """Distances of neighbouring nodes along x and y, map units."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        return (x_max - x_min) / self.last[0], (y_max - y_min) / self.last[1]


def bounds_through(
    problem: Problem,
    *,
    limit: float = math.inf,
    last: tuple[int, int] | None = None,
    path: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
    max_cells: int = MOST_CELLS,
) -> Through:
    """
    Bound the cost of all paths through each place of a map.

    Parameters
    ----------
    problem
        The problem; its no-fly area counts, and its clearance.
    limit
        Only places through which a path may cost less are of interest: grids are refined there. Infinite: everywhere.
    last
        Column and row of the last node of the grid, the last one that is laid. With an infinite limit, it is the only
        one. None: grids are refined until the gap is within the tolerance, or the next one would have too many cells.
    path
        A feasible path from start to goal, shape ``(n, 2)``. None: a refined descent of the first grid.
    tolerance
        Of the gap, ``upper_bound / lower_bound - 1``.
    max_cells
        Cells of a grid, at most, those of its rim included.

    Returns
    -------
    bounds
        On the last grid.

    Raises
    ------
    ProblemError
        If a setting is out of range, the path is not feasible, there is no bound (peaks above 1), or the grid `last`
        has too many cells.

    Examples
    --------
    >>> around = bounds_through(Problem((0.1, 0.5), (0.9, 0.5)), last=(100, 100))
    >>> around.least[(around.rows == 80) & (around.columns == 50)].round(2).tolist()
    [0.99]
    >>> round(2 * math.hypot(0.4, 0.3), 2), bool(around.on_cells().min() <= 0.8)
    (1.0, True)
    """
    positive_number("tolerance", tolerance)
    found: Through | None = None
    for grid in grids_through(problem, limit=limit, last=last, path=path, tolerance=tolerance, max_cells=max_cells):
        found = grid.through
        if last is None and found.upper_bound <= found.lower_bound * (1.0 + tolerance):
            break
    if found is None:
        msg = f"max_cells is {max_cells}, which the first grid exceeds; allow more cells, or give a coarser `last`"
        raise ProblemError(msg)
    return found


class GridThrough(NamedTuple):
    """
    A grid, its bounds to goal and start (None if no path stays on its cells), and what they say of each place.

    `pieces` are the listed pieces of its mesh, in the order of `Through.least`; `least` bounds the paths through each
    piece of the mesh that stay on its cells, shape ``(m,)``.
    """

    through: Through
    level: Level
    bounds: tuple[Subsolution, Subsolution] | None
    pieces: WholeArray
    least: FloatArray


def grids_through(
    problem: Problem,
    *,
    limit: float = math.inf,
    last: tuple[int, int] | None = None,
    path: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
    max_cells: int = MOST_CELLS,
) -> Iterator[GridThrough]:
    """
    Bound the cost of all paths through each place, on finer and finer grids; see `bounds_through`.

    Each grid covers what the one before lists. Its limit and path are the same.

    Yields
    ------
    grid
        Each one that is laid, as long as it has at most `max_cells` cells.

    Raises
    ------
    ProblemError
        As `bounds_through`.

    Examples
    --------
    >>> [grid.through.last for grid in grids_through(Problem((0.1, 0.5), (0.9, 0.5)), last=(50, 50))]
    [(50, 50)]
    >>> tubes = (one.through for one in grids_through(Problem((0.1, 0.5), (0.9, 0.5)), limit=0.81, max_cells=20_000))
    >>> [(one.last[0], len(one.least) < one.cells) for one in tubes][:2]
    [(128, True), (256, True)]
    """
    if not problem.field.is_proper:
        msg = f"no bound: {NEGATIVE_WEIGHTS}"
        raise ProblemError(msg)
    waypoints, cost = given_path(problem, path)
    closed = problem.relaxed()
    grid = last if last is not None and math.isinf(limit) else first_grid(problem)
    grid = grid if last is None else (min(grid[0], last[0]), min(grid[1], last[1]))
    runs, best = cell_runs.rectangle(grid), problem.least_length * (1.0 - 2.0**-50)
    while with_halo(problem, runs, grid) <= max_cells and max(grid) <= MOST_ALONG:
        missing = min(cost - best, best)
        along = waypoints if waypoints is not None and len(waypoints) > 1 else None
        level = Level.lay(closed, grid, runs, max(FRACTION * tolerance * best, WORTH * missing), along)
        pair = level.both(FRACTION * tolerance, charge=True, known=cost)
        if pair is None:
            # no path stays inside the cells of this grid
            none, no_cells = np.empty(0), np.empty(0, dtype=np.int32)
            bound = min(limit, cost)
            nothing = Through(problem, grid, no_cells, no_cells, none, limit, bound, waypoints, cost, len(level.bounds))
            yield GridThrough(nothing, level, None, no_cells, np.full(len(level.bounds), bound))
            return
        if waypoints is None:
            waypoints, cost = _descended(problem, level, pair[0])
        mesh = level.mesh
        least = _straight(problem, np.column_stack([mesh.columns, mesh.rows]), mesh.origin, mesh.spacing)
        if is_provable(problem):
            best = max(best, min(proven(problem, max(one.bound for one in pair)), limit, cost))
            least = np.maximum(least, proven(problem, least_through(level, *pair), surfaces=2))
        least = np.maximum(least, best)
        keep = mesh.matters & ~(least >= limit)
        keep[keep] = joined_with(problem.start, mesh, keep)
        columns, rows = mesh.columns[keep], mesh.rows[keep]
        found = problem, grid, columns, rows, least[keep], limit, best, waypoints, cost
        yield GridThrough(Through(*found, len(mesh.columns)), level, pair, np.flatnonzero(keep), least)
        if grid == last or not keep.any():
            return
        grid, runs = finer_grid(problem, grid, cell_runs.runs_of(columns, rows), 2.0, max_cells)
        if last is not None and (grid[0] > last[0] or grid[1] > last[1]):
            runs = cell_runs.refined(cell_runs.runs_of(columns, rows), mesh.last, last)
            grid = last


def joined_with(start: Point, mesh: SplineMesh, keep: BoolArray) -> BoolArray:
    """
    Tell which of the kept pieces are in cells joined with that of the start, over kept cells: shape ``(n,)``.

    A path that costs less than the limit passes kept cells only, from the start on.
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - slow to import, and few proofs need it
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - the same

    width = mesh.last[0] + 3
    keys = mesh.rows[keep].astype(np.int64) * width + mesh.columns[keep]
    cells, cell = np.unique(keys, return_inverse=True)
    column, row = np.rint((np.array(start) - mesh.origin) / mesh.spacing).astype(np.int64).tolist()
    first = int(np.searchsorted(cells, row * width + column))
    if first == len(cells) or cells[first] != row * width + column:
        # no path costs less than the limit
        return np.zeros(len(keys), dtype=np.bool_)
    pairs = []
    for step in (1, width - 1, width, width + 1):
        other = np.minimum(np.searchsorted(cells, cells + step), len(cells) - 1)
        touching = np.flatnonzero(cells[other] == cells + step)
        pairs.append((touching, other[touching]))
    one, two = (np.concatenate(side) for side in zip(*pairs, strict=True))
    _, labels = connected_components(
        coo_array((np.ones(len(one)), (one, two)), shape=(len(cells),) * 2), directed=False
    )
    return np.asarray(labels[cell] == labels[first])


def given_path(problem: Problem, path: ArrayLike | None) -> tuple[FloatArray | None, float]:
    """
    Check the path that bounds are compared with; return it, read-only, and its cost.

    Raises
    ------
    ProblemError
        If it is malformed, not feasible, or does not join start and goal.

    Examples
    --------
    >>> given_path(Problem((0, 0), (1, 0)), [(0, 0), (1, 0)])[1]
    1.0
    """
    if path is None:
        return None, math.inf
    waypoints = np.array(point_array("path", path))
    judged = problem.evaluate(waypoints)
    if judged.violations:
        msg = (
            f"the path to hold the bound against is not feasible: {judged.violations[0]}; give a feasible one, or none"
        )
        raise ProblemError(msg)
    if tuple(waypoints[0]) != problem.start or tuple(waypoints[-1]) != problem.goal:
        msg = f"the path joins {waypoints[0].tolist()} and {waypoints[-1].tolist()}; it has to join start and goal"
        raise ProblemError(msg)
    waypoints.flags.writeable = False
    return waypoints, judged.cost


def _descended(problem: Problem, level: Level, to_goal: Subsolution) -> tuple[FloatArray | None, float]:
    """Find a path by descending the costs-to-go, and its cost; None and infinity if that leads nowhere."""
    path = descent(problem, level.mesh, to_goal.values, radius=level.reach + 1.0)
    if not len(path):
        return None, math.inf
    found = np.array(refine_path(problem, path).path)
    judged = problem.evaluate(found)
    if not judged.feasible:
        return None, math.inf
    found.flags.writeable = False
    return found, judged.cost


def _straight(problem: Problem, cells: WholeArray, origin: Point, spacing: tuple[float, float]) -> FloatArray:
    """
    Bound the length of all paths through cells by straight lines from the ends.

    The sum of the two distances is convex: it is nowhere below its tangent in the middle of a cell.
    """
    middles = cells * np.array(spacing) + origin
    length, slopes = np.zeros(len(cells)), np.zeros((len(cells), 2))
    for end in (problem.start, problem.goal):
        away = middles - end
        far = np.hypot(*away.T)
        length += far
        slopes += away / np.maximum(far, 1e-300)[:, None]
    least = length - 0.5 * np.abs(slopes) @ spacing
    off = PLACED * float(np.abs(problem.bounds).max()) * 4.0
    return np.asarray(least_scale(problem) * (least * (1.0 - ROUNDED) - off)) - 2.0 * geodesic_error(problem)


def straight_through(problem: Problem, last: tuple[int, int]) -> FloatArray:
    """
    Bound the length of all paths through the cells of a grid by straight lines, shape ``(rows, columns)``.

    Examples
    --------
    >>> found = straight_through(Problem((0.1, 0.5), (0.9, 0.5)), (100, 100))
    >>> found[80, 50].round(2).item(), found[50, 50].round(2).item()
    (0.99, 0.8)
    """
    x_min, y_min, x_max, y_max = problem.bounds
    rows, columns = np.indices((last[1] + 1, last[0] + 1))
    spacing = (x_max - x_min) / last[0], (y_max - y_min) / last[1]
    cells = np.column_stack([columns.ravel(), rows.ravel()])
    return _straight(problem, cells, (x_min, y_min), spacing).reshape(rows.shape)


def least_through(level: Level, to_goal: Subsolution, to_start: Subsolution) -> FloatArray:
    """
    Bound the cost of all paths through each piece of a grid, that stay on its cells, without rounding.

    Returns
    -------
    least
        Shape ``(m,)``, map units; minus infinity where nothing is known. Pieces that do not matter have no bound.

    Examples
    --------
    >>> level = Level.lay(Problem((0.1, 0.5), (0.9, 0.5)), (64, 64), cell_runs.rectangle((64, 64)))
    >>> least = least_through(level, *level.both(0.01))
    >>> bool(0.79 < least[level.mesh.matters].min() <= 0.8 * (1.0 + 1e-9))
    True
    """
    mesh = level.mesh
    least = np.empty(len(mesh.columns))
    certificate_kernels.least_sums(to_goal.values, to_start.values, mesh.controls, least)
    blocks = {id(one): one for one in (*to_goal.corners, *to_start.corners)}.values()
    for corner in blocks:
        # (where one end is not reached and nothing is known of the other, nothing is known)
        with np.errstate(invalid="ignore"):
            least[corner.pieces] = sum(
                in_corner(level, corner, one.values) if corner in one.corners else _lowest(level, one, corner.pieces)
                for one in (to_goal, to_start)
            )
    for block, other in ((level.start_block, to_goal), (level.goal_block, to_start)):
        pieces = np.flatnonzero(mesh.matters & block.holds)
        least[pieces] = _in_block(level, block, other, pieces)
    both = np.flatnonzero(mesh.matters & level.start_block.holds & level.goal_block.holds)
    least[both] = sum(_to_end(level, block, both) for block in (level.start_block, level.goal_block))
    return np.where(np.isnan(least), -math.inf, least)


def kept(level: Level, to_goal: Subsolution, to_start: Subsolution, cost: float) -> WholeArray:
    """
    Return the runs of the cells of a grid on which a path may cost less than some cost.

    Cells around ends are kept: on the next grid, fronts begin there.

    Examples
    --------
    >>> level = Level.lay(Problem((0.1, 0.5), (0.9, 0.5)), (64, 64), cell_runs.rectangle((64, 64)))
    >>> runs = kept(level, *level.both(0.01), 0.81)
    >>> bool(cell_runs.count(runs) < 0.25 * len(level.mesh.columns))
    True
    """
    mesh = level.mesh
    limit = needed_for(level.problem, cost, surfaces=2)
    keep = ~(least_through(level, to_goal, to_start) >= limit)
    for block in (level.start_block, level.goal_block):
        apart = np.maximum(np.abs(mesh.columns - block.centre[0]), np.abs(mesh.rows - block.centre[1]))
        keep |= apart <= level.reach
    keep &= mesh.matters
    return cell_runs.runs_of(mesh.columns[keep], mesh.rows[keep])


def costs_to_end(level: Level, one: Subsolution, block: Block) -> FloatArray:
    """
    Bound the cost from each piece of a grid to one end from below, on paths that stay on its cells, without rounding.

    Returns
    -------
    least
        Shape ``(m,)``, map units; minus infinity where nothing is known.

    Examples
    --------
    >>> level = Level.lay(Problem((0.1, 0.5), (0.9, 0.5)), (64, 64), cell_runs.rectangle((64, 64)))
    >>> to_goal, _ = level.both(0.01)
    >>> bool(0.75 < costs_to_end(level, to_goal, level.goal_block)[level.mesh.ends[0]] < 0.8)
    True
    """
    least = _lowest(level, one, np.arange(len(level.mesh.columns)))
    for corner in one.corners:
        least[corner.pieces] = in_corner(level, corner, one.values)
    pieces = np.flatnonzero(block.holds)
    least[pieces] = _to_end(level, block, pieces)
    return np.where(np.isnan(least), -math.inf, least)


def _lowest(level: Level, one: Subsolution, pieces: WholeArray) -> FloatArray:
    """Bound a spline from below on pieces."""
    least = np.empty(len(pieces))
    certificate_kernels.least_sums(one.values, np.zeros_like(one.values), level.mesh.controls[pieces], least)
    return least


def in_corner(level: Level, corner: CornerBlock, values: FloatArray) -> FloatArray:
    """
    Bound the cost to an end from the pieces of a block around a corner: across its rim.

    Parameters
    ----------
    level
        The grid.
    corner
        The block.
    values
        Control values of a spline that bounds the cost to the end on its rim.

    Returns
    -------
    least
        In the order of its pieces, map units.
    """
    mesh = level.mesh
    curves = np.empty((len(corner.rim), 3))
    corner_kernels.curves(corner.places, corner.rim, mesh.controls, values, curves)
    at_rim = np.where(np.isnan(curves), -math.inf, curves).min(axis=1, initial=math.inf)
    middles = np.column_stack([mesh.columns[corner.rim], mesh.rows[corner.rim]])
    ends = np.tile(middles, 2) + corner.places
    low, high = np.minimum(ends[:, :2], ends[:, 2:]), np.maximum(ends[:, :2], ends[:, 2:])
    cells = np.column_stack([mesh.columns[corner.pieces], mesh.rows[corner.pieces]])[:, None, :]
    apart = np.maximum(np.maximum(low - (cells + 0.5), (cells - 0.5) - high), 0.0)
    away = np.hypot(apart[..., 0] * mesh.spacing[0], apart[..., 1] * mesh.spacing[1])
    cost = float(level.bounds[corner.pieces][:, :, certificate_kernels.LEAST].min())
    return np.asarray((at_rim + max(cost, 0.0) * away).min(axis=1, initial=math.inf))


def _to_end(level: Level, block: Block, pieces: WholeArray) -> FloatArray:
    """Bound the cost to an end from pieces of its block, by its distance."""
    mesh = level.mesh
    away = np.hypot(*(mesh.node_points[mesh.controls[pieces, 4]] - block.end).T) - 0.5 * math.hypot(*mesh.spacing)
    return np.asarray(block.formula.least_cost * np.maximum(away, 0.0))


def _in_block(level: Level, block: Block, other: Subsolution, pieces: WholeArray) -> FloatArray:
    """
    Bound the cost of all paths through pieces of the block of an end: by its formula, and the spline to the other end.

    The formula is above its tangent in the middle of a cell, less what its second derivatives can take away
    (`certificate_kernels.rim_excess`), so that the sum of tangent and spline is bounded by its control values.
    """
    mesh, (cost, gx, gy, beta) = level.mesh, block.formula.numbers.tolist()
    spline = bezier_values(other.values, mesh.controls[pieces])
    least = spline.min(axis=(1, 2)) + _to_end(level, block, pieces)
    dx, dy = (mesh.node_points[mesh.controls[pieces, 4]] - block.end).T
    r, half = np.hypot(dx, dy), 0.5 * math.hypot(*mesh.spacing)
    far = r > ROUNDED * half
    safe, along = np.where(far, r, 1.0), gx * dx + gy * dy
    radial = (cost + 0.5 * along) / safe - beta * safe
    slope_x, slope_y = (radial * d + 0.5 * safe * g for d, g in ((dx, gx), (dy, gy)))
    step = np.array([-0.5, 0.0, 0.5])
    rises = slope_x * mesh.spacing[0], slope_y * mesh.spacing[1]
    plane = rises[1][:, None, None] * step[:, None] + rises[0][:, None, None] * step
    height = cost * r + 0.5 * r * along - beta * r**3 / 3.0
    bend = 1.5 * math.hypot(gx, gy) + 3.0 * beta * (r + half)
    by_tangent = (spline + plane).min(axis=(1, 2)) + height - 0.5 * bend * half**2
    return np.asarray(np.where(far, np.fmax(least, by_tangent), least))


def bottleneck(least: FloatArray, bounds: Bounds, start: Point, goal: Point) -> float:
    """
    Turn bounds of all paths through each cell into one of all paths: each has to pass somewhere.

    A path leads over cells each of which touches the next, perhaps in a corner. If every path through a cell costs at
    least its number, then the path costs at least the greatest number among these.

    Parameters
    ----------
    least
        Bound of every path through each cell of a grid, as `Through.on_cells` gives it, shape ``(rows, columns)``.
    bounds
        Of the map: the middles of the first and the last cell are its corners.
    start, goal
        The ends.

    Returns
    -------
    bound
        The least, over all chains of touching cells from start to goal, of the greatest number on the chain.

    Raises
    ------
    ProblemError
        If an end is outside the bounds.

    Examples
    --------
    >>> wall = np.array([[0.0, 5.0, 0.0], [0.0, 3.0, 0.0], [0.0, 4.0, 0.0]])
    >>> bottleneck(wall, (0, 0, 2, 2), (0, 0), (2, 0))
    3.0
    """
    from scipy import ndimage  # noqa: PLC0415 - slow to import, and few proofs need it

    rows, columns = least.shape
    low, size = np.array(bounds[:2]), np.subtract(bounds[2:], bounds[:2])
    ends = []
    for end in (start, goal):
        column, row = np.rint((np.array(end) - low) / size * (columns - 1, rows - 1)).astype(int).tolist()
        if not (0 <= column < columns and 0 <= row < rows):
            msg = f"{end} is outside the bounds {bounds}; give an end inside"
            raise ProblemError(msg)
        ends.append((row, column))
    values = np.unique(least)

    def joined(value: float) -> bool:
        pieces, _ = ndimage.label(least <= value, np.ones((3, 3)))
        one, other = (int(pieces[end]) for end in ends)
        return one == other != 0

    # (with the greatest number, all cells are in one piece)
    return float(values[bisect_left(values[:-1], x=True, key=joined)])
