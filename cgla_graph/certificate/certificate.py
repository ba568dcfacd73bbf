"""
A proven lower bound of the cost of every path, and with it the gap of a path to the optimum.

`subsolution` shows how a grid yields a bound, and proves it. This module refines the grids. Where the cost is constant
on cells, a proof over these cells comes first (`cell_proof`), and is mostly all.

**The tube.** With bounds from both ends, a path through ``x`` costs at least the sum of the two bounds at ``x``.
Cells where that sum exceeds the cost of a known path are left out of the next, finer grid: no path through them is
better.

**No-fly areas** are used: the mesh is cut open along them (`mesh`), so that ``phi`` may jump across walls.
Their outline counts as smaller than it is, by up to a few parts of a cell.

**On a map in degrees**, the bound holds on the Earth: each cell has its own scale (`costs.scale_at`). It is compared
with the path's cost on the plane, which is at least that on the Earth. No bound exceeds the path's cost under that
scale, so that the rest of the gap may be due to the distortion of the map; the message says so then.

**Rounding.** The inequality is checked for the stored numbers; a factor covers the rounding of each check and of the
evaluation of ``F`` (`rounding`).
"""

import math
import os
import time
from dataclasses import dataclass, field, replace
from functools import cache
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import ArrayLike

from cgla_graph._display import Plottable
from cgla_graph._progress import Tell, showing
from cgla_graph._text import json_number, shown
from cgla_graph._types import FloatArray, WholeArray
from cgla_graph._validate import non_negative_number, positive_number
from cgla_graph.certificate import cell_proof, corners, corridor
from cgla_graph.certificate.cell_proof import CellProof
from cgla_graph.certificate.corridor import Corridor
from cgla_graph.certificate.costs import LEAST_SCALE, is_provable, least_scale, needed_for, proven, scale_at
from cgla_graph.certificate.subsolution import (
    FIRST_CELLS,
    LEAST_TIMES,
    MOST_ALONG,
    Level,
    Subsolution,
    finer_grid,
    first_grid,
    with_halo,
)
from cgla_graph.certificate.through import given_path, kept
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import around_corners, descent
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import GAP
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Problem
from cgla_graph.model.small_problem import SMALL_PATH, small_problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, TOLERANCE, gap_between
from cgla_graph.refine.refine import refine_path
from cgla_graph.regions.arrangement import refusal
from cgla_graph.regions.paths import least_path

if TYPE_CHECKING:
    from cgla_graph.certificate.proof_file import Proven

#: How a bound was proven: by the straight line between start and goal, a spline on a grid, or points on the borders of
#: cells of constant cost; empty if it was otherwise, or nothing was.
Proof: TypeAlias = Literal["", "line", "grid", "cells"]
#: The last node of a grid, and cells of it (`cell_runs`).
Tube: TypeAlias = tuple[tuple[int, int], WholeArray]

#: Cells of a grid by default, at most: about 750 MB.
MAX_CELLS = 2_500_000
#: Cells of rasters beside which the default is as above; of that many more, each takes the place of so many of a grid.
HELD, AS_MANY = 20_000_000, 1.0 / 60.0
#: A bound is good enough for its grid when at most this part of the tolerance is left to gain.
FRACTION = 0.05
#: A finer grid is laid around an end or a corner where more than this part of the bound's deficit is lost.
WORTH = 0.05
#: How many times as fine as the last grid the next one is, at most; if it has to be more than `WORTH_LESS` times as
#: fine, it is made `MOST_TIMES` as fine.
MOST_TIMES, WORTH_LESS = 2.0, 1.75
#: The next grid aims at this part of the deficit that the tolerance allows. The deficit is expected to fall by at most
#: this power of the spacing.
AIMED_AT, MOST_ORDER = 0.85, 1.5
#: Finer grids gain at most so many times as much as the last one did.
LIKELY_GAIN = 3.0
#: Parts of a path on each of which the scale in the middle is used.
PARTS = 1024
#: Times that a proof begins again with a better path that it has found.
MOST_BETTER = 3
#: Cells along the longer side of the grid from which another path is sought, and the factor to the next such grid.
SECOND_LOOK, LOOKS_APART = 4 * FIRST_CELLS, 4
#: Relative loss that a refined path may have because its waypoints are too far apart, and its waypoints then, at most.
#: A closer proof wants a hundredth of its tolerance, but never less than `LEAST_LOSS`.
LOSS, POINTS, LEAST_LOSS = 1e-6, 512, 1e-9
#: Areas are made narrower by this part of the width of gaps that are closed, so that rounding closes no passage.
NARROWER = 1e-3


@dataclass(frozen=True, eq=False)
class Grid:
    """
    One grid of a proof.

    Attributes
    ----------
    spacing
        The greater of its two steps, map units.
    last
        Column and row of its last node, the upper right corner of the bounds; node (0, 0) is the lower left one.
    runs
        The cells of the tube: ``row, first column, last column + 1`` each, shape ``(n, 3)``. The cell of a node is the
        rectangle of one step around it.
    lower_bound, upper_bound
        The bracket after this grid, map units.
    along
        Over cells of constant cost, distances of points along the longer side of the bounds: `spacing` is that of
        points then, and `last` and `runs` are those of a coarse picture of the tube. Else 0.
    count
        How many cells of constant cost there are in the tube; else 0.
    """

    spacing: float
    last: tuple[int, int]
    runs: WholeArray
    lower_bound: float
    upper_bound: float
    along: int = 0
    count: int = 0

    @property
    def steps(self) -> int:
        """How many steps the longer side of the bounds has."""
        return self.along or max(self.last)

    @property
    def cells(self) -> int:
        """How many cells the tube has."""
        return self.count or cell_runs.count(self.runs)


@dataclass(frozen=True, eq=False)
class Certificate(Plottable):
    """
    A proven lower bound of the cost of all paths inside the bounds, and how it was proven.

    Attributes
    ----------
    lower_bound
        Proven: no path costs less, map units. On a map in degrees, no path on the Earth does. Infinite where it is
        proven that there is no path; NaN where there is no bound.
    upper_bound
        Cost of the path that the bound is compared with, map units, measured on the plane; infinite where no path is
        known.
    path
        That path: waypoints, read-only, shape ``(n, 2)``, map units. It is the given path, else the best one that the
        proof found. None where no path is known, and in a certificate that was stored by a study.
    tolerance
        The tolerance asked for.
    spacing
        Step of the finest grid, map units; 0 where the straight line was proof enough. Over cells of constant cost, the
        mean distance of points on their borders.
    cells
        Cells of the finest grid, those of its rim included; or cells of constant cost that the last points were on.
    message
        Why it ended, in one line.
    seconds
        Time that the proof took, without compiling or loading kernels.
    grids
        The grids, coarse to fine: how the bracket closed.
    proof
        What the bound was proven by: ``line``, the straight line from start to goal; ``grid``, a spline on a grid;
        ``cells``, points on the borders of cells of constant cost (rasters read as `nearest`). Empty for other proofs,
        and where nothing is proven.
    problem
        The problem; None in a copy from another process or a file.
    known
        Cost of the cheapest path that the proof met, map units; infinite where it met none. The given path may cost
        more.
    """

    lower_bound: float
    upper_bound: float
    path: FloatArray | None = field(default=None, kw_only=True)
    tolerance: float
    spacing: float
    cells: int
    message: str
    seconds: float
    grids: tuple[Grid, ...] = ()
    proof: Proof = field(default="", kw_only=True)
    problem: Problem | None = field(default=None, repr=False, kw_only=True)
    known: float = field(default=math.inf, repr=False, kw_only=True)

    def __getstate__(self) -> dict[str, Any]:
        """Leave the problem out of copies for other processes, which have it; its maps may be large."""
        return {name: value for name, value in self.__dict__.items() if name != "problem"}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Make the path read-only again, which arrays do not remember."""
        self.__dict__.update(state)
        if self.path is not None:
            self.path.flags.writeable = False

    @property
    def gap(self) -> float:
        """The greatest possible excess of that path over the optimum, ``upper_bound / lower_bound - 1``."""
        return 0.0 if self.lower_bound == self.upper_bound else gap_between(self.upper_bound, self.lower_bound)

    @property
    def reached(self) -> bool:
        """Whether the gap is within the tolerance."""
        return self.gap <= self.tolerance

    @property
    def proof_settings(self) -> dict[str, float]:
        """Settings of `cgla_graph.save_proof` for a file that is about as good as this proof."""
        # (the greater one of 0 and NaN is 0)
        return {"tolerance": self.tolerance, "known": self.known, "bound": max(0.0, self.lower_bound)}

    def save(self, file: str | os.PathLike[str]) -> "Proven":
        """
        Prove the bound of its path again, and write the proof to a file (`cgla_graph.save_proof`).

        The bound of the file is its own: it may be a little lower or higher, and the gap at most 1.3 times as wide, or
        a tenth of the tolerance.

        Parameters
        ----------
        file
            Its name; a proof that is there is replaced.

        Returns
        -------
        result
            As that of `cgla_graph.save_proof`.

        Raises
        ------
        ProblemError
            If it does not know its problem, there is no bound, or no proof was found that fits such a file.
        OutputError
            If the file cannot be written, or another file than a proof has that name.

        Examples
        --------
        >>> import tempfile
        >>> certificate = prove(Problem((0.1, 0.5), (0.9, 0.5)), tolerance=0.02)
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     found = certificate.save(f"{folder}/one.proof")
        >>> 0.78 < found["lower"] < 0.8 <= found["upper"]
        True
        """
        from cgla_graph.certificate.proof_file import save_proof  # noqa: PLC0415 - few certificates are saved

        if self.problem is None:
            msg = (
                "this certificate does not know its problem, as copies from another process or a study, and those of "
                "graphs; prove it again: cgla_graph.save_proof(problem, file, path)"
            )
            raise ProblemError(msg)
        return save_proof(self.problem, file, self.path, **self.proof_settings)

    def corridor(
        self, delta: float = 0.01, *, max_cells: int = corridor.MOST_CELLS, most_ways: int = corridor.MOST_WAYS
    ) -> Corridor:
        """
        Return polygons that contain every path within a part of the optimum, and the ways that lead through them.

        Parameters
        ----------
        delta
            Paths that cost at most ``1 + delta`` times the optimum are meant; at least 0.
        max_cells
            Cells of a grid, at most: more of them make a narrower corridor.
        most_ways
            Ways around areas and other holes of the corridor that are listed, at most: 1 to 1000.

        Returns
        -------
        corridor
            The corridor. It is all of the map where no bound or no path is known, and empty where there is no path.

        Raises
        ------
        ProblemError
            If a setting is out of range, or the certificate has no map: it is from another process, a file or a graph.

        Examples
        --------
        >>> import cgla_graph as cg
        >>> box = shapely.box(0.4, 0.4, 0.6, 0.62)
        >>> proof = cg.lower_bound(cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=box))
        >>> [f"{way.passes}: {way.cost:.3f}" for way in proof.corridor(0.05).ways.known]
        ['below 1: 0.832', 'above 1: 0.846']
        """
        if not isinstance(self.problem, Problem):
            msg = "this certificate has no map: it is from a file or of a graph; prove one with cgla_graph.lower_bound"
            raise ProblemError(msg)
        settings: dict[str, int] = {"max_cells": max_cells, "most_ways": most_ways}
        return corridor.corridor_around(self.problem, self.path, self.lower_bound, delta, **settings)

    def document(self) -> dict[str, Any]:
        """Return the proof as JSON, without path and grids; numbers that are not finite are None."""
        return {
            "lower_bound": json_number(self.lower_bound),
            "upper_bound": json_number(self.upper_bound),
            "gap": json_number(self.gap),
            "tolerance": self.tolerance,
            "reached": bool(self.reached),
            "spacing": json_number(self.spacing),
            "cells": int(self.cells),
            "proof": self.proof,
            "seconds": json_number(self.seconds),
            "message": self.message,
        }


def prove(
    problem: Problem,
    path: ArrayLike | None = None,
    *,
    tolerance: float = TOLERANCE,
    max_cells: int = MAX_CELLS,
    keeps_path: bool = True,
    in_turns: bool = False,
    tube: Tube | None = None,
) -> Certificate:
    """
    Bound the cost of every path from below, and compare a path with it; `cgla_graph.lower_bound` finds one first.

    Parameters
    ----------
    problem
        The problem; its no-fly area counts, and its clearance.
    path
        A feasible path from start to goal, shape ``(m, 2)``, that the bound is compared with. None: the refined
        steepest descent of the costs-to-go, if a grid finds one.
    tolerance
        Refine the grid until ``upper_bound / lower_bound - 1`` is at most this.
    max_cells
        Cells of a grid, at most, those of its rim included: about 300 bytes each.
    keeps_path
        Whether the bound is compared with `path` even if the proof finds a better one.
    in_turns
        Whether to bound the costs from one end, and those from the other only if a finer grid needs them: less work on
        one core, but later on several.
    tube
        The first grid, if it is known that no path outside of it costs less than the given one.

    Returns
    -------
    certificate
        The bound, proven whether or not the tolerance was reached; its message says why it ended: at the tolerance, at
        `max_cells`, or because a path is known that is so much better than the given one that no bound can come within
        the tolerance of it. For fields with peaks above 1 there is no bound: it is NaN.

    Raises
    ------
    ProblemError
        If the tolerance is not positive, `max_cells` is below 16 384, or the path is not feasible from start to goal.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> field = RiskField([Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)])
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0)
    >>> certificate = prove(problem, tolerance=0.005)
    >>> certificate.reached, certificate.lower_bound <= certificate.upper_bound
    (True, True)
    """
    check_settings(tolerance, max_cells)
    keeps_path = keeps_path and path is not None
    return _proven(problem, tolerance, path, max_cells, keeps_path=keeps_path, in_turns=in_turns, tube=tube)[0]


def check_settings(tolerance: float, max_cells: int) -> None:
    """
    Check the settings of a proof.

    Raises
    ------
    ProblemError
        If the tolerance is not positive, or `max_cells` is below 16 384.

    Examples
    --------
    >>> check_settings(0.01, MAX_CELLS)
    """
    positive_number("tolerance", tolerance)
    if non_negative_number("max_cells", max_cells) < FIRST_CELLS**2:
        msg = f"max_cells is {shown(max_cells)}; give at least {FIRST_CELLS**2}, the cells of the first grid"
        raise ProblemError(msg)


def usual_cells(problem: Problem) -> int:
    """
    Return the cells of a grid by default, at most: fewer beside large rasters, so that both fit in 2 GB.

    Examples
    --------
    >>> usual_cells(Problem((0, 0), (1, 1)))
    2500000
    """
    more = sum(math.prod(raster.shape) for raster in problem.field.rasters) - HELD
    return max(MAX_CELLS - int(max(more, 0) * AS_MANY), FIRST_CELLS**2)


def improved(
    problem: Problem, path: ArrayLike, tolerance: float, tube: Tube | None = None, whole: Level | None = None
) -> tuple[Certificate, float]:
    """
    Prove the gap of a path, and replace the path if the proof finds a better one.

    Parameters
    ----------
    problem
        The problem.
    path
        A feasible path from start to goal, shape ``(m, 2)``, map units.
    tolerance
        As `prove` takes it.
    tube
        The first grid, if it is known that no path outside of it costs less than the given one. On one core, this is
        the faster way.
    whole
        That grid over all of the map, of which the tube is a part; None: the tube is laid by itself.

    Returns
    -------
    certificate
        Its path is the best one found, and its bound is that of `prove` with this path.
    seconds
        The part of the certificate's time after which this path was known; 0 for the path that was given.

    Raises
    ------
    ProblemError
        If the path is not feasible from start to goal.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.55, 0.1)]), k=10.0)
    >>> certificate, seconds = improved(problem, [(0.1, 0.5), (0.5, 0.9), (0.9, 0.5)], 0.01)
    >>> certificate.reached, bool(certificate.path[:, 1].max() < 0.6), 0.0 < seconds < certificate.seconds
    (True, True, True)
    """
    best: ArrayLike | None = path
    known_after = spent = 0.0
    for _ in range(MOST_BETTER):
        found, after = _proven(
            problem,
            tolerance,
            best,
            usual_cells(problem),
            keeps_path=False,
            is_trial=True,
            in_turns=tube is not None,
            tube=tube,
            whole=whole,
        )
        if after == 0.0:
            return replace(found, seconds=spent + found.seconds), known_after
        best, known_after, spent = found.path, spent + after, spent + found.seconds
    found = prove(problem, best, tolerance=tolerance, max_cells=usual_cells(problem))
    return replace(found, seconds=spent + found.seconds), known_after


def _proven(
    problem: Problem,
    tolerance: float,
    path: ArrayLike | None,
    max_cells: int,
    *,
    keeps_path: bool,
    is_trial: bool = False,
    in_turns: bool = False,
    tube: Tube | None = None,
    whole: Level | None = None,
) -> tuple[Certificate, float]:
    """Bound the cost from below; return also after how many seconds the compared path was known."""
    if not problem.field.is_proper:
        none = f"no bound: {NEGATIVE_WEIGHTS}"
        return Certificate(math.nan, math.inf, tolerance, 0.0, 0, none, 0.0, problem=problem), 0.0
    with showing("proof") as tell:
        if not refusal(problem):
            cell_proof.load_kernels()
        load_kernels(MapKind.of(problem.model))
        began = time.perf_counter()
        waypoints, cost = given_path(problem, path)
        held = _KnownPath() if waypoints is None else _KnownPath.of(problem, cost, waypoints)
        search = _Search(problem, tolerance, max_cells, held, keeps_path, is_trial, in_turns, tube, whole)
        found = search.run(tell)
    known_after = search.improved_at - began if search.improved_at else 0.0
    return replace(found, seconds=time.perf_counter() - began, problem=problem), known_after


@cache
def load_kernels(kind: MapKind) -> None:
    """
    Compile or load the kernels for a kind of map, once in a process, so that no proof is charged for it.

    Examples
    --------
    >>> load_kernels(MapKind())
    """
    problem = small_problem(kind)
    last = 16, 16
    level = Level.lay(problem, last, cell_runs.rectangle(last))
    # (fronts last: another process may be compiling what marches them)
    level.load_checks()
    if kind.walls:
        corners.load_kernels()
        around_corners(problem, np.array(SMALL_PATH), 1.0)
    _refined(problem, np.array(SMALL_PATH), 0.1)
    # (one round)
    if bounds := level.both(aim=math.inf):
        kept(level, *bounds, math.inf)


class _KnownPath(NamedTuple):
    """
    A feasible path from start to goal and its cost; without a path, the cost is infinite.

    `least` is its cost under the scale of the map, which no bound exceeds; in the plane, it is the cost itself.
    """

    cost: float = math.inf
    path: FloatArray | None = None
    least: float = math.inf

    @classmethod
    def of(cls, problem: Problem, cost: float, path: FloatArray) -> "_KnownPath":
        """Copy a path, read-only, so that a certificate keeps it."""
        copied = np.array(path)
        copied.flags.writeable = False
        return cls(cost, copied, cost if problem.projection is None else min(cost, _scaled_cost(problem, copied)))


def _scaled_cost(problem: Problem, path: FloatArray) -> float:
    """Estimate the cost of a path under the scale of its map."""
    length = float(np.hypot(*np.diff(path, axis=0).T).sum())
    if length == 0.0:
        return 0.0
    points = shapely.get_coordinates(shapely.segmentize(shapely.LineString(path), length / PARTS))
    starts, ends = points[:-1], points[1:]
    costs = np.hypot(*(ends - starts).T) + problem.k * problem.field.line_integral(starts, ends)
    return float((costs * scale_at(problem, 0.5 * (starts + ends))).sum())


def _refined(problem: Problem, path: FloatArray, tolerance: float) -> _KnownPath:
    """
    Refine a path; if it is empty or not feasible, return none.

    The loss between waypoints falls with the square of their number; the tolerance of the proof sets that number.
    """
    if not len(path):
        return _KnownPath()
    loss = min(max(0.01 * tolerance, LEAST_LOSS), LOSS)
    refined = refine_path(problem, path, tolerance=loss, max_points=round(POINTS * math.sqrt(LOSS / loss))).path
    found = problem.evaluate(refined)
    return _KnownPath.of(problem, found.cost, refined) if found.feasible else _KnownPath()


def is_separated(problem: Problem) -> bool:
    """
    Return whether no path joins start and goal: they are in different parts of the map outside the areas.

    Walls may be too thin for the cells of a grid. Areas are made narrower by more than rounding, and parts that touch
    count as one. If the answer is no, there may be a path or none.

    Examples
    --------
    >>> tips = shapely.Polygon([(0.5, 0.0), (0.6, 0.5), (0.5, 1.0), (0.4, 0.5)])
    >>> is_separated(Problem((0.1, 0.5), (0.9, 0.5), no_fly=tips))
    True
    >>> is_separated(Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.affinity.scale(tips, 0.9, 0.9)))
    False
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - slow to import, and rarely needed
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - the same

    area = problem.model.area
    if area.is_empty:
        return False
    x_min, y_min, x_max, y_max = problem.bounds
    farthest = float(np.spacing(np.abs(problem.bounds).max()))
    less = max(NARROWER * GAP * max(x_max - x_min, y_max - y_min), 4.0 * farthest)
    narrow = shapely.buffer(area.geometry, -less, join_style="mitre")
    parts = shapely.get_parts(shapely.difference(shapely.box(*problem.bounds), narrow))
    ends = [shapely.STRtree(parts).query(shapely.Point(end), "dwithin", less) for end in (problem.start, problem.goal)]
    if len(parts) < 2 or not all(map(len, ends)):  # noqa: PLR2004 - two parts
        return False
    one, other = shapely.STRtree(parts).query(parts, "dwithin", less)
    near = coo_array((np.ones(len(one)), (one, other)), shape=(len(parts), len(parts)))
    _, label = connected_components(near, directed=False)
    return not set(label[ends[0]]) & set(label[ends[1]])


@dataclass
class _Search:
    """The refinement of a grid until the bound is good enough."""

    problem: Problem
    tolerance: float
    max_cells: int
    #: The path that the bound is compared with; a better one replaces it, unless `keeps_path`.
    held: _KnownPath
    keeps_path: bool
    #: Whether the search ends as soon as the path is replaced.
    is_trial: bool = False
    #: Whether on grids but the first one, costs to the start are bounded only if those to the goal prove too little;
    #: in a tube, on the first one too.
    in_turns: bool = False
    #: The first grid, outside of which no path costs less than the known one; None: the usual one, on the whole map.
    tube: Tube | None = None
    #: That grid on the whole map, if it is laid already.
    whole: Level | None = None
    known: _KnownPath = field(default_factory=_KnownPath)
    #: When a better path was found, s; 0 before.
    improved_at: float = 0.0
    best: float = 0.0
    cells: int = 0
    grids: list[Grid] = field(default_factory=list)
    #: What proved the bound so far, and the rounds over cells of constant cost.
    proof: Proof = "line"
    rounds: list[Grid] = field(default_factory=list)

    def run(self, tell: Tell) -> Certificate:
        """Refine until the tolerance or a limit is reached."""
        problem = self.problem
        # a path that keeps its clearance up to rounding is feasible too
        closed = problem.relaxed()
        self.known = self.held
        # (the factor covers the rounding of that length)
        self.best = problem.least_length * (1.0 - 2.0**-50)
        if outcome := self._settled() or self._over_cells(closed, tell):
            return self._end(outcome)
        last = first_grid(problem)
        last, runs = self.tube or (last, cell_runs.rectangle(last))
        before, look = -math.inf, SECOND_LOOK
        while True:
            missing = min(self.known.least - self.best, self.best)
            worth = max(FRACTION * self.tolerance * self.best, WORTH * missing)
            level = self._level(closed, last, runs, worth)
            self.cells = len(level.mesh.columns)
            self.grids.append(Grid(max(level.mesh.spacing), last, runs, self.best, self.held.cost))
            wanted = needed_for(problem, self._wanted())
            turns = self.in_turns and (self.tube is not None or len(self.grids) > 1)
            aim = FRACTION * self.tolerance
            bounds = level.both(aim, charge=True, known=self.known.least, wanted=wanted, turns=turns)
            if bounds is None:
                # the cells left out of the grid are more expensive than a known path
                self._prove(self.known.least, "grid")
                return self._end(self._outcome())
            here = max(one.bound for one in bounds)
            # no bound exceeds the cost of a known path
            self._prove(min(proven(problem, here), self.known.least), "grid")
            if self.proof == "cells" and here + LIKELY_GAIN * (here - before) < self.best:
                return self._end("more points on cells gain little, and finer grids less")
            if math.isinf(self.known.least) and len(self.grids) == 1 and is_separated(closed):
                self._prove(math.inf, "grid")
            self.grids[-1] = replace(self.grids[-1], lower_bound=self.best)
            if outcome := self._outcome():
                return self._end(outcome)
            tell(f"gap {self._gap()} after {len(self.grids)} grids, {100.0 * self.tolerance:.2g} % asked")
            # a fine grid shows better than the lattice on which side of an obstacle to pass
            if self._looks_stuck(here, here - before) or max(last) >= look:
                self.improve(level, bounds[0])
            if max(last) >= look:
                look *= LOOKS_APART
            self.grids[-1] = replace(self.grids[-1], upper_bound=self.held.cost)
            runs = kept(level, *bounds, self.known.least)
            last, runs = finer_grid(problem, last, runs, self._times(before, here), self.max_cells)
            needed = with_halo(problem, runs, last)
            before = here
            if outcome := self._outcome() or self._limit(last, needed):
                return self._end(outcome)

    def _level(self, closed: Problem, last: tuple[int, int], runs: WholeArray, worth: float) -> Level:
        """Lay a grid; the first one may be a part of a grid that there is."""
        if self.whole is not None and not self.grids:
            return self.whole.part(closed, runs, worth, self.known.path)
        return Level.lay(closed, last, runs, worth, self.known.path)

    def _prove(self, bound: float, by: Proof) -> None:
        """Take a bound if it is better."""
        if bound > self.best:
            self.best, self.proof = bound, by

    def _gap(self) -> str:
        return f"{100.0 * (self.held.cost / (self.best or math.nan) - 1.0):.2g} %"

    def _over_cells(self, closed: Problem, tell: Tell) -> str:
        """
        Prove over cells of constant cost, if there are any.

        Returns the outcome; empty if a spline is to go on: among areas, whose outlines cut cells.
        """
        straight = np.array([self.problem.start, self.problem.goal])
        proof = CellProof.begin(closed, self.max_cells, straight if self.known.path is None else self.known.path)
        if proof is None:
            return ""
        has_looked, before = self.known.path is None, math.inf
        if has_looked:
            self._offer(_refined(self.problem, least_path(self.problem).path, self.tolerance))
        while True:
            last, runs = proof.runs()
            along = round(max(np.ptp(proof.cells.x), np.ptp(proof.cells.y)) / proof.spacing)
            self.cells = int(proof.is_open.sum())
            found, keep = proof.bounds(self.known.least, self._wanted() * (1.0 + 2.0**-50))
            self._prove(found, "cells")
            cost = self.held.cost
            self.rounds.append(Grid(proof.spacing, last, runs, self.best, cost, along, self.cells))
            if outcome := self._outcome():
                return outcome
            tell(f"gap {self._gap()} over {self.cells} cells, {100.0 * self.tolerance:.2g} % asked")
            missing = self.known.least / (self.best or math.nan) - 1.0
            if not has_looked and not missing < cell_proof.USUAL_GAP * proof.m**-cell_proof.ORDER:
                has_looked = True
                self._offer(_refined(self.problem, least_path(self.problem).path, self.tolerance))
                found_better = "a better path was found" if self.is_trial and self.improved_at else ""
                if outcome := self._outcome() or found_better:
                    return outcome
            missing = self.known.least / (self.best or math.nan) - 1.0
            if keep is None or not missing < (1.0 - cell_proof.WORTH) * before:
                return "" if proof.loose or keep is None else "more points on cells gain little"
            keep(self.known.least)
            before = missing
            if limit := proof.finer(missing / self.tolerance):
                return "" if proof.loose else limit

    def _settled(self) -> str:
        """Return why no grid is laid: the straight line is enough, or no grid proves more; empty if one is laid."""
        if outcome := self._outcome():
            is_close = self.held.cost <= self.best * (1.0 + self.tolerance)
            return "the straight line is no longer than the tolerance allows" if is_close else outcome
        if least_scale(self.problem) < LEAST_SCALE:
            return "the map reaches so far around the Earth that only the geodesic is a bound"
        if not is_provable(self.problem):
            return f"k = {self.problem.k:g} is too great for the arithmetic: only the straight line is a bound"
        return ""

    def _wanted(self) -> float:
        """Return the least bound that is good enough."""
        wanted = self.held.cost / (1.0 + self.tolerance)
        return min(wanted, self.known.least / (1.0 + self._slack)) if self.on_earth else wanted

    def _outcome(self) -> str:
        """Return the outcome in words; empty if it is not known yet."""
        if math.isinf(self.best):
            return "there is no path"
        held, known, reached = self.held.cost, self.known.cost, self.best * (1.0 + self.tolerance)
        if held <= reached:
            return "the gap is within the tolerance" if self.best < held else "no path is better"
        if self.known.least > self.best * (1.0 + self._slack):
            return ""
        # no bound exceeds the cost of any path
        if known * (1.0 + self.tolerance) < held:
            less = 100.0 * (1.0 - known / held)
            return f"no bound comes within the tolerance: a path is known that costs {less:.2g} % less"
        if self.on_earth:
            much = 100.0 * (known / self.known.least - 1.0)
            return f"the bound allows {much:.2g} % for the distortion of the flat map"
        return ""

    @property
    def on_earth(self) -> bool:
        """Whether the scale of the map changes from place to place."""
        return self.problem.projection is not None

    @property
    def _slack(self) -> float:
        """
        How close a bound has to come to the cost of the known path under the scale of the map, as a ratio.

        In the plane it is the tolerance; else the part of it that the distortion leaves, but at least half of it.
        """
        if not self.on_earth or not 0.0 < self.known.least < math.inf:
            return self.tolerance
        return max((1.0 + self.tolerance) * self.known.least / self.known.cost - 1.0, 0.5 * self.tolerance)

    def _limit(self, last: tuple[int, int], needed: int) -> str:
        """Return why there is no finer grid; empty if there is one."""
        if self.is_trial and self.improved_at:
            return "a better path was found"
        if needed > self.max_cells:
            return f"the next grid would need {needed} cells, of {self.max_cells} allowed"
        return "a finer grid is too fine for the arithmetic" if max(last) > MOST_ALONG else ""

    def _times(self, before: float, here: float) -> float:
        """
        Choose how many times as fine the next grid is: twice, or less if the tolerance needs less.

        The deficit of a bound falls like a power of the spacing, which the bounds of the last two grids give.
        """
        missed, missing = self.known.least - before, self.known.least - here
        if not 0.0 < missing < missed < math.inf:
            return MOST_TIMES
        # (the bound before the first is infinite: there are two grids)
        coarser, last = (max(grid.last) for grid in self.grids[-2:])
        order = min(math.log(missed / missing) / math.log(last / coarser), MOST_ORDER)
        allowed = AIMED_AT * self._slack * self.known.least / (1.0 + self._slack)
        # (as logarithms: where a bound hardly changes, the power overflows a float)
        excess = math.log(missing / allowed)
        if excess > order * math.log(WORTH_LESS):
            return MOST_TIMES
        return max(math.exp(excess / order), LEAST_TIMES) if excess > 0.0 else LEAST_TIMES

    def _looks_stuck(self, bound: float, gained: float) -> bool:
        """
        Guess whether finer grids alone will not reach the tolerance, so that a better path has to be found.

        Each grid at least about halves the deficit of the bound, so that the deficit is about the last gain; up to
        three times that gain is allowed.
        """
        return self.known.least > (bound + LIKELY_GAIN * max(gained, 0.0)) * (1.0 + self._slack)

    def improve(self, level: Level, to_goal: Subsolution) -> None:
        """Search for a better path by descending the costs-to-go."""
        path = descent(self.problem, level.mesh, to_goal.values, radius=level.reach + 1.0)
        self._offer(_refined(self.problem, path, self.tolerance))

    def _offer(self, found: _KnownPath) -> None:
        """Take a path that is better than the known one, or than the one that the bound is compared with."""
        if found.least < self.known.least:
            self.known = found
        if not self.keeps_path and found.cost < self.held.cost:
            self.held, self.improved_at = found, time.perf_counter()

    def _end(self, message: str) -> Certificate:
        grids, cells, proof = self.grids, self.cells, self.proof
        if self.rounds and (proof == "cells" or not grids):
            grids, cells = self.rounds, self.rounds[-1].count
            message += "; proven over cells of constant cost" if proof == "cells" else ""
        spacing = grids[-1].spacing if grids else 0.0
        bracket = self.best, self.held.cost, self.tolerance
        shown, path = proof if self.best > 0.0 else "", self.held.path
        found = Certificate(*bracket, spacing, cells, message, 0.0, tuple(grids), path=path, proof=shown)
        return replace(found, known=self.known.cost)
