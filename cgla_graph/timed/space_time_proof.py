r"""
A proven lower bound of the cost of all timed paths: among moving threats, timed areas, and in wind.

**Statement.** Let ``v`` be the airspeed, ``w`` the wind, and ``c`` the cost of a unit of time in flight: ``v + k r``
with the risk ``r`` of a unit of time. Let ``W(x, y, t)`` be continuous, and piecewise smooth, with ``- W_t - w . grad
W + v |grad W| <= c`` wherever and whenever a path may be. Along a path, ``W`` falls by ``- W_t - g . grad W`` in a
unit of time, where ``g = w + v e`` is the velocity over the ground with some heading ``e``, and so by no more than
the cost grows. A path costs at least ``W`` at its departure less ``W`` at its arrival.

Here ``W`` is a quadratic spline in the place and the time through the values of a march backwards in time
(`march_kernels`). The proof does not use where the values come from: `excess_kernels` bounds on each whole cell by
how much the inequality fails. The left side is convex in the slopes, so values may be averaged with their neighbours:
at a kink, as along flights that wait for an area to open, the spline of averages is far less steep (`Surface.smooth`).

**Risk by the ground distance** is ``r = |g| F``, and depends on the heading. For each ``|u| <= 1``, ``|g| >= u . g``,
so that ``- W_t - w . (grad W + k F u) + v |grad W + k F u| <= v`` is enough (`march_kernels.burden`). In still air
this is the inequality with ``c = v (1 + k F)``.

**Wind that changes** is a linear wind ``w`` on each cell plus a rest of at most ``d``: ``- W_t - w . p + (v + d) |p| <=
c`` is enough, where ``p`` is the slope with its burden (`wind_kernels.wind_within`, `excess_kernels`). No path gets
away from the mean wind faster than the airspeed and the greatest gust together.

**Waiting** in one place adds ``- W_t <= p + k r``, for its price `p` and the risk of a unit of time as in flight in
still air. Without it, the inequality says nothing of waiting; but circles are paths, and cost as any flight.

**Tolls** (`tolls`) are added to ``c``: linear floors on each cell, as of the risk.

**Arrival.** ``W`` has a tip at the goal that no spline follows. The inequality is not required in a block of cells
around it, at all times: a path that first enters the block at ``y`` costs at least ``psi(y)`` from there
(`space_time_grid.Block`), and ``W`` is lowered by its greatest excess over ``psi`` on the rim.

**Horizon.** A path that costs less than a known cost ``U`` arrives before the last departure plus ``U / min(v, p)``.
So the inequality is not required later, and ``W`` is free at the horizon. The bound is the lesser of ``U`` and that
of ``W``. A latest arrival is a horizon too.

**Departure in a window.** The bound is the least of ``W(start, t)`` over it, by its Bernstein values.

**Areas** that close and open: ``W`` is not continuous across the outline of an area, and falls where one opens; no
path is inside at that time. The inequality is not required on cells that are inside for the whole of a layer, and
layers end at events. Cells that an outline cuts are as free as others, which lowers the bound by about a cell.

**What stays too steep is charged for.** Where the inequality fails by ``E`` on a cell, a path loses at most ``E`` in
a unit of time there. The greatest sum of those losses over all ways through the cells, layer after layer, is the
debt: from cell to cell at no more than the greatest ground speed (`excess_kernels.charge`). With ``a W`` for a scale
``a <= 1``, the excess is at most ``a E - (1 - a) c``, as the left side is convex and at most 0 for ``W = 0``; the
best of a few scales is taken.

**The tube.** Backwards in time, with the wind reversed, the same surface bounds the cost from the start, over all
departures (`Grid.reversed`). Both together, less their debts, bound all paths through a place at a time. Only cells
where this is below ``U`` are kept, and finer grids cover these: a path that leaves them costs at least ``U``.
"""

import math
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace

import numpy as np

from cgla_graph._progress import Tell, showing
from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, positive_number, whole_number
from cgla_graph.certificate.certificate import prove
from cgla_graph.errors import ProblemError
from cgla_graph.model.solution import gap_between
from cgla_graph.timed import excess_kernels
from cgla_graph.timed.frames import Frame, Runs
from cgla_graph.timed.march_kernels import travel_time
from cgla_graph.timed.space_time_grid import Block, Grid, flow_of
from cgla_graph.timed.surface import HALO, Surface
from cgla_graph.timed.timed_evaluation import Timed, timed_rows
from cgla_graph.timed.timed_problem import TimedProblem

#: Cells along the longer side of the first grid, and how many times finer the next one is, at most and at least.
FIRST_CELLS, MOST_TIMES, LEAST_TIMES = 48, 2.0, 1.2
#: The gap that a proof aims at by default.
TOLERANCE = 0.01
#: Cells of a grid, and nodes of the frames around them, at most, by default and ever; places of all frames, at most.
MOST_CELLS, MOST_NODES, MOST_PLACES = 4_000_000, 30_000_000, 1_000_000
#: In wind, a cell whose risk counts by the ground distance takes as long as so many others.
HEAVY = 8
#: Grids that may prove nothing in a wind that is stronger than the aircraft.
IN_VAIN = 3
#: Nodes of the frames, at most, for each cell.
FRAMES = 50
#: Marches of a surface, at most; another one is made only if the last one gained this part of the gap.
ROUNDS, LEAST_GAIN = 10, 0.03
#: How steep the surface from the start begins, in least costs of a map unit.
STEEP = 4.0
#: Cells of flight that a layer lasts, for threats of at least so many parts of the speed.
LASTS = ((0.2, 1.0), (0.1, 1.5), (0.0, 2.0))
#: Rounding of a bound and of costs of the oracle, relative to them.
ROUNDING = 1e-9


@dataclass(frozen=True)
class TimedGrid(ShortRepr):
    """
    One grid of a proof in space and time.

    Attributes
    ----------
    spacing
        Its step, map units.
    layers
        How many layers of time it has.
    cells
        How many cells of space and time were checked.
    lower_bound
        What was proven by then.
    """

    spacing: float
    layers: int
    cells: int
    lower_bound: float


@dataclass(frozen=True, eq=False)
class TimedCertificate(ShortRepr):
    """
    A proven lower bound of the cost of all feasible timed paths, and how it was proven.

    Attributes
    ----------
    lower_bound
        Proven: no feasible path costs less, in the unit of `TimedEvaluation.cost`. Infinite where it is proven that
        there is no path.
    upper_bound
        Cost of the path that the bound is compared with; infinite where none is known.
    tolerance
        The tolerance asked for.
    message
        Why it ended, in one line.
    proof
        What the bound was proven by: ``line``, the way from start to goal in the wind and without risk; ``still``,
        the proof for a map that does not change; ``space-time``, a spline in space and time.
    grids
        The grids in space and time, coarse to fine.
    seconds
        Time that the proof took.
    """

    lower_bound: float
    upper_bound: float
    tolerance: float
    message: str
    proof: str
    grids: tuple[TimedGrid, ...] = ()
    seconds: float = 0.0

    @property
    def gap(self) -> float:
        """``upper_bound / lower_bound - 1``; infinite where no path is known, NaN where there is none."""
        return gap_between(self.upper_bound, self.lower_bound)

    @property
    def reached(self) -> bool:
        """Whether the gap is within the tolerance."""
        return self.upper_bound <= self.lower_bound * (1.0 + self.tolerance)


def timed_lower_bound(
    problem: TimedProblem, known: Timed | None = None, *, tolerance: float = TOLERANCE, max_cells: int = MOST_CELLS
) -> TimedCertificate:
    """
    Bound the cost of every timed path from below.

    Parameters
    ----------
    problem
        The problem.
    known
        A feasible path from start to goal, rows ``(t, x, y)`` or a `Trajectory`: the better it is, the fewer cells have
        to be looked at. None: the straight flight at the first departure, if it is feasible.
    tolerance
        Refine until ``upper_bound / lower_bound - 1`` is at most this.
    max_cells
        Cells of space and time on a grid, at most; a million takes about 15 s on two cores. In wind with risk by the
        ground distance, an eighth of them, which take as long.

    Returns
    -------
    certificate
        The bound, proven whether or not the tolerance was reached. Without any known path and without a latest arrival,
        it is that of the way in the wind without risk.

    Raises
    ------
    ProblemError
        If a setting is out of range, or the path is not feasible from start to goal.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> problem = cg.TimedProblem((0, 0), (1, 0), speed=5, wind=(3, 0))
    >>> proof = timed_lower_bound(problem)
    >>> round(proof.lower_bound, 6), proof.reached
    (0.625, True)
    """
    began = time.perf_counter()
    instance("problem", problem, TimedProblem, "TimedProblem(start, goal, field, speed=…)")
    check_settings(tolerance, max_cells)
    rows, cost = _known(problem, known)
    with showing("proof in space and time") as tell:
        found = _by_line(problem, cost, tolerance)
        if not found.reached and not math.isinf(found.lower_bound):
            if problem.is_still and problem.constant_wind == (0.0, 0.0):
                found = _when_still(problem, rows, found)
            elif cost < math.inf or problem.latest is not None:
                found = _Search(problem, found, max_cells).run(tell)
    return replace(found, seconds=time.perf_counter() - began)


def check_settings(tolerance: float | None, max_cells: int) -> None:
    """
    Refuse settings of a proof that are out of range, before anything is planned for it; a tolerance of None: no proof.

    Examples
    --------
    >>> check_settings(None, 0)
    Traceback (most recent call last):
        ...
    cgla_graph.errors.ProblemError: max_cells is 0; give a whole number from 1 to 30000000
    """
    if tolerance is not None:
        positive_number("tolerance", tolerance)
    whole_number("max_cells", max_cells, at_least=1, at_most=MOST_NODES)


def _known(problem: TimedProblem, known: Timed | None) -> tuple[FloatArray | None, float]:
    """Return the rows of the known path and its cost: None and infinity without any."""
    if known is None:
        try:
            rows = problem.fly([problem.start, problem.goal])
        except ProblemError:
            return None, math.inf
        found = problem.evaluate(rows)
        return (rows, found.cost) if found.feasible else (None, math.inf)
    rows = timed_rows(known)
    found = problem.evaluate(rows)
    if not found.feasible:
        msg = f"the path to hold the bound against is not feasible: {found.violations[0]}; give a feasible one, or none"
        raise ProblemError(msg)
    if tuple(rows[0, 1:]) != problem.start or tuple(rows[-1, 1:]) != problem.goal:
        msg = f"the path joins {rows[0, 1:].tolist()} and {rows[-1, 1:].tolist()}; it has to join start and goal"
        raise ProblemError(msg)
    return rows, found.cost


def _by_line(problem: TimedProblem, cost: float, tolerance: float) -> TimedCertificate:
    """Bound the cost by the least time from start to goal in the wind (Zermelo 1931), without risk."""
    dx, dy = problem.goal[0] - problem.start[0], problem.goal[1] - problem.start[1]
    speed, u, v, _, _ = flow_of(problem)
    # (in wind that changes, nothing is faster over ground; and a little faster, so that rounding prevents no path)
    least = travel_time(dx, dy, (speed + problem.wind_grid.gusts) * (1.0 + ROUNDING), u, v)
    bound = min(problem.speed * least, cost) * (1.0 - ROUNDING)
    message = "the way in the wind without risk is a bound; no path is known" if math.isinf(cost) else ""
    if math.isinf(bound):
        return TimedCertificate(bound, cost, tolerance, "there is no path: the wind is too strong", "line")
    found = TimedCertificate(bound, cost, tolerance, message, "line")
    return replace(found, message="the way without risk costs as much") if found.reached else found


def _when_still(problem: TimedProblem, rows: FloatArray | None, line: TimedCertificate) -> TimedCertificate:
    """Bound the cost on a map that does not change, where waiting and later departures gain nothing."""
    k = problem.k / problem.speed if problem.risk_per == "time" else problem.k
    field = problem.field_at(problem.departures[0])
    still = replace(problem.still, field=field, k=k, projection=None)
    path = None if rows is None else rows[np.append(True, (np.diff(rows[:, 1:], axis=0) != 0.0).any(axis=1)), 1:]
    found = prove(still, path, tolerance=line.tolerance)
    bound = found.lower_bound * (1.0 - ROUNDING)
    if not bound > line.lower_bound:
        return line
    return replace(line, lower_bound=bound, message=f"nothing changes in time: {found.message}", proof="still")


class _Search:
    """The refinement of grids in space and time until the bound is good enough."""

    def __init__(self, problem: TimedProblem, line: TimedCertificate, max_cells: int) -> None:
        self.problem, self.line, self.max_cells = problem, line, max_cells
        if problem.constant_wind != (0.0, 0.0) and not flow_of(problem)[3]:
            self.max_cells = max(max_cells // HEAVY, 1)
        self.known, self.best = line.upper_bound, line.lower_bound
        self.grids: list[TimedGrid] = []
        slow = min(problem.speed, math.inf if problem.waiting is None else problem.waiting)
        since, last = problem.departures
        ends = last + self.known / slow * (1.0 + ROUNDING)
        self.until = ends if problem.latest is None else min(ends, problem.latest)
        # (a latest arrival at the departure itself leaves no time)
        self.is_empty = not self.until > since
        self.lasts = _lasting(problem, self.until) if not self.is_empty else 1.0

    def run(self, tell: Tell) -> TimedCertificate:
        """Refine."""
        if self.is_empty:
            return replace(self.line, message="there is no time for a path to be proven about")
        cells, message = float(FIRST_CELLS), ""
        grid = Grid.lay(self.problem, self.until, round(cells), self.lasts)
        kept = everything(grid)
        to_goal: Surface | None = None
        to_start: Surface | None = None
        while True:
            back = grid.reversed()
            to_goal = Surface(grid, Block.around(grid, self.problem.goal, kept), kept, coarse=to_goal)
            turned = kept[0][::-1], kept[1][::-1]
            block = Block.around(back, self.problem.start, turned, -self.problem.departures[1])
            to_start = Surface(back, block, turned, horizon=STEEP, coarse=to_start)
            self._bound(grid, to_goal, to_start)
            count = int((kept[1] - kept[0]).sum())
            self.grids.append(TimedGrid(grid.step, grid.count, count, self.best))
            tell(f"gap {100.0 * (self.known / self.best - 1.0):.2g} % after {len(self.grids)} grids")
            if self.known <= self.best * (1.0 + self.line.tolerance):
                message = "the gap is within the tolerance"
                break
            if grid.strong and len(self.grids) >= IN_VAIN and self.best <= self.line.lower_bound:
                message = "the wind is stronger than the aircraft, and grids prove no more than the way without risk"
                break
            kept = narrowed(to_goal, to_start, self.known * (1.0 + ROUNDING))
            if not (kept[0] < kept[1]).any():
                self.best, message = self.known * (1.0 - ROUNDING), "no path is better"
                break
            times = self._times(kept, grid)
            if times < LEAST_TIMES:
                message = f"the next grid would need more than {self.max_cells} cells, or too many nodes"
                break
            cells *= times
            finer = Grid.lay(self.problem, self.until, round(cells), self.lasts)
            kept, grid = refined(kept, grid, finer), finer
            to_goal.coarse, to_start.coarse = None, None
        bound = min(self.best, self.known * (1.0 - ROUNDING))
        proof = "space-time" if bound > self.line.lower_bound else self.line.proof
        return replace(self.line, lower_bound=bound, message=message, proof=proof, grids=tuple(self.grids))

    def _times(self, kept: Runs, grid: Grid) -> float:
        """Choose how many times finer the next grid is."""
        frames = [Frame.around(runs, HALO + 2, grid.shape) for runs in zip(*kept, strict=True)]
        nodes = sum(frame.rows * frame.columns for frame in frames)
        count, most = int((kept[1] - kept[0]).sum()), min(MOST_NODES, FRAMES * self.max_cells)
        plane = math.sqrt(MOST_PLACES / (grid.shape[0] * grid.shape[1]))
        return float(min(MOST_TIMES, (self.max_cells / count) ** (1 / 3), (most / nodes) ** (1 / 3), plane))

    def _bound(self, grid: Grid, to_goal: Surface, to_start: Surface) -> None:
        """Solve, check and soften both surfaces, and take the better one's bound at its far end."""
        window = range(int((grid.knots[:-1] <= self.problem.departures[1]).sum()))
        anywhere = range(grid.count)
        # kernels let other threads run
        with ThreadPoolExecutor(1) as thread:
            other = thread.submit(self._rounds, to_start, self.problem.goal, anywhere)
            bound = max(self._rounds(to_goal, self.problem.start, window), other.result())
        self.best = max(self.best, min(bound, self.known) * (1.0 - ROUNDING))

    def _rounds(self, surface: Surface, place: tuple[float, float], layers: range) -> float:
        bounds = [-math.inf, -math.inf]
        for number in range(ROUNDS):
            surface.march()
            # (on the first grid, threats are hardly wider than what is averaged)
            first = number == 0 and surface.coarse is not None
            bound = surface.smoothest(place, layers) if first else surface.bound(place, layers)
            bounds.append(max(bounds[-1], bound))
            # (two marches may pass before costs are low enough; a bound of minus infinity gains nothing)
            if number > 1 and not bounds[-1] - bounds[-3] >= LEAST_GAIN * (self.known - bounds[-1]):
                break
            if number < ROUNDS - 1:
                surface.soften()
        return bounds[-1]


def _lasting(problem: TimedProblem, until: float) -> float:
    """Choose how many cells of flight a layer lasts: the slower the threats, the more; tolls are soon over."""
    if problem.tolls:
        return LASTS[0][1]
    fastest = 0.0
    for slab in problem.slabs(until):
        if len(slab.threats):
            speeds = np.hypot(slab.threats[:, 2], slab.threats[:, 3]) + np.abs(slab.threats[:, 5])
            fastest = max(fastest, float(speeds.max()))
    return next(lasts for least, lasts in LASTS if fastest >= least * problem.speed)


def everything(grid: Grid) -> Runs:
    """Return all cells but those of the rim."""
    rows, columns = grid.shape
    begin, end = np.ones((grid.count, rows), dtype=np.int64), np.full((grid.count, rows), columns - 1)
    begin[:, [0, -1]], end[:, [0, -1]] = 0, 0
    return begin, end


def narrowed(to_goal: Surface, to_start: Surface, limit: float) -> Runs:
    """Return the cells on which a path may cost less than a limit: the first to the last one of each row."""
    grid = to_goal.grid
    first = np.zeros((grid.count, grid.shape[0]), dtype=np.int64)
    last = first.copy()
    for n, frame in enumerate(to_goal.cells):
        back = grid.count - 1 - n
        least, debts, blocks = [], [], []
        for surface, layer in ((to_goal, n), (to_start, back)):
            least.append(surface.least_values(layer))
            debts.append(surface.debts[layer])
            blocks.append(surface.in_block(layer))
        low, high = np.zeros(frame.rows, dtype=np.int64), np.zeros(frame.rows, dtype=np.int64)
        excess_kernels.keep(
            (least[0], least[1]), (debts[0], debts[1]), (blocks[0], blocks[1]), grid.closed(n, frame),
            *to_goal.runs(n), (to_goal.scale, to_start.scale), (to_goal.shift, to_start.shift), limit, low, high,
        )  # fmt: skip
        rows = slice(frame.row, frame.row + frame.rows)
        first[n, rows], last[n, rows] = low + frame.column, high + frame.column
    return np.where(first < last, first, 0), np.where(first < last, last, 0)


def refined(kept: Runs, old: Grid, new: Grid) -> Runs:
    """Return the cells of a finer grid that touch kept ones."""
    rows, columns = new.shape
    begin, end = np.zeros((new.count, rows), dtype=np.int64), np.zeros((new.count, rows), dtype=np.int64)
    empty = kept[0] >= kept[1]
    low = np.where(empty, math.inf, old.origin[0] + (kept[0] - 0.5) * old.step)
    high = np.where(empty, -math.inf, old.origin[0] + (kept[1] - 0.5) * old.step)
    # (both ways, places and times are rounded)
    near = 1e-9 * new.step
    y = new.origin[1] + np.arange(rows) * new.step
    from_row = np.floor((y - 0.5 * new.step - near - old.origin[1]) / old.step + 0.5).astype(np.int64)
    to_row = np.floor((y + 0.5 * new.step + near - old.origin[1]) / old.step + 0.5).astype(np.int64)
    soon = 1e-9 * float(old.durations.min())
    for n in range(new.count):
        first = max(int(np.searchsorted(old.knots, new.knots[n] - soon, side="right")) - 1, 0)
        after = min(int(np.searchsorted(old.knots, new.knots[n + 1] + soon, side="left")), old.count)
        lows, highs = low[first:after].min(axis=0), high[first:after].max(axis=0)
        for j in range(rows):
            part = slice(max(from_row[j], 0), max(to_row[j] + 1, 0))
            left, right = lows[part].min(initial=math.inf), highs[part].max(initial=-math.inf)
            if left < right:
                begin[n, j] = max(math.floor((left - near - new.origin[0]) / new.step + 0.5), 1)
                end[n, j] = min(math.ceil((right + near - new.origin[0]) / new.step + 0.5), columns - 1)
    begin[:, [0, -1]], end[:, [0, -1]] = 0, 0
    return np.where(begin < end, begin, 0), np.where(begin < end, end, 0)
