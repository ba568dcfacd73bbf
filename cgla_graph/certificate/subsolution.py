"""
A proven bound of the cost from everywhere to one end of a problem, on one grid.

**Statement.** Let ``c = 1 + k F`` be the cost of a unit of length, on a map of the Earth times a lower bound of the
length of a unit of the plane on the Earth (`costs`). Let ``phi`` be continuously differentiable wherever a path may go,
with ``|grad phi| <= c`` there. Along any path from ``x`` to ``y``, ``phi`` changes by at most the integral of
``|grad phi|``, so that the path costs at least ``phi(x) - phi(y)``. Here ``phi`` is a biquadratic spline through an
approximate solution of ``|grad T| = c``, divided by the greatest bound of ``|grad phi| / c`` over all cells
(`certificate_kernels`). The proof uses that bound only, and not how ``phi`` was found.

**Around the goal** the solution has a tip that no spline follows. The inequality is not required there: a path that
first enters the block of cells around the goal at ``y`` costs at least ``phi(start) - phi(y)`` up to ``y``, and at
least ``psi(y)`` from ``y`` on (`tips`), so that ``phi(start) - max (phi - psi)`` over the rim of the block is a bound.
The front begins with ``psi`` around the block, so that the greatest difference is close to 0: where psi is too low,
only the routes that enter there lose by it.

**Around the start** a path has to leave the block of cells as well, at ``z``: up to there it costs at least ``psi(z)``,
the lower bound around the start, and from there on at least ``phi(z)``. So the least ``phi + psi`` over the rim is a
bound too. It is the better one where several ways are equally good: there the start is on a ridge of the solution, on
which the spline is too low, but the best paths leave the block beside the ridge.

**Where the spline is too steep**, mostly where fronts meet, the cost is lowered by the same factor and the equation
solved again, a few times: the loss is of second order in the spacing where paths are smooth. Where the risk of a narrow
threat or of a raster rises from almost 0 within a few cells, the solution bends upwards, and a spline is steep at the
foot of the slope. There the cost of the slope is lowered first, and not that of the foot, along which paths run.

**Around corners of areas**, blocks of cells are left out of the inequality, and charged for (`corners`; where
the cost is steep, `finer`).

**A few cells that stay too steep** need not lower the bound everywhere. Let ``|grad phi| <= c`` outside of some cells,
in which ``|grad phi| <= s c``. Follow a path to the first of these cells that it enters, B, at ``a``, and go on where
it leaves B for the last time, at ``b``: in between it costs at least ``(phi(a) - phi(b)) / s``, that is, ``phi(a) -
phi(b)`` less at most ``(1 - 1 / s)`` times the oscillation of ``phi`` over B. After ``b`` it never meets B again;
repeat this with the next cell that it enters. So a path costs at least ``phi(x) - phi(y)`` less the sum of those
charges over all such cells. (The difference of such a bound along a segment is no bound of the segment's cost.)
"""

import math
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import shapely

from cgla_graph._threads import stays_alone
from cgla_graph._types import BoolArray, FloatArray, Point, WholeArray
from cgla_graph.certificate import certificate_kernels
from cgla_graph.certificate.corners import BendingPath, CornerBlock, WholeCorners, corners_of, links_of
from cgla_graph.certificate.costs import cost_bounds, costs_to_solve_for, scale_at
from cgla_graph.certificate.finer import FineCornerBlock
from cgla_graph.certificate.tips import EndFormula, EndGrid
from cgla_graph.eikonal import cell_runs
from cgla_graph.eikonal.marching import costs_to_go, descent, straight_costs
from cgla_graph.eikonal.marching_kernels import spline_value
from cgla_graph.eikonal.mesh import HALO, MeshPart, SplineMesh, bezier_values
from cgla_graph.model.problem import Problem

#: Times that the equation is solved on one grid, at most, and the round from which a cost may be lowered below the
#: least cost of its cell; both are greater on rasters, whose cells are steep against each other. (Where risk jumps,
#: nodes have the smaller cost anyway.) Among threats, costs may be lowered so from the first round if no cell is
#: steeper than this.
ROUNDS, ROUNDS_ON_RASTERS, GENTLE_ABOVE = (8, 2), (16, 8), 1.5
#: Cells around those that matter, at most: around ends that are next to each other, a grid may be very fine.
MOST_HALO = 96
#: Cells around those that matter where a tube is a part of a grid that there is: pairs at 1 % take a tenth less time
#: than with 8, and hardly ever another grid.
HALO_OF_PART = 4
#: Another round is made only if its greatest possible gain is more than `LEAST_SHARE` of the gap that finer grids have
#: to close and, as the known path may be a bad one, more than `LEAST_GAIN` of the bound.
LEAST_SHARE, LEAST_GAIN = 0.1, 0.005
#: A spline that is still too steep by this factor after so many further rounds is left to finer grids: beside walls,
#: lower costs do not help where a coarse grid does not resolve the gap.
STEEP, ROUNDS_FOR_STEEP = 2.0, 2
#: Where so many rounds in a row were no better, lower costs made new fronts, which are steep elsewhere.
ROUNDS_IN_VAIN = 3
#: Cells that may stay too steep, at most, and the rounding of their charges.
MOST_CHARGED, ROUNDING = 2000, 1e-12
#: Cells along the longer side of the first grid; a further grid has up to twice as many.
FIRST_CELLS = 128
#: Cells from an end to the rim of its block on the first grid. It grows with the cube root of the refinement, which
#: balances the loss at the tip, whose bound is of third order, against the loss of the spline beside it.
FIRST_REACH = 3
#: Directions in which the loss at an end is estimated.
DIRECTIONS = 32
#: The block is wider where that pays in all directions: up to so many times, and so many cells away from areas. In
#: spacings times the cost: about how much is lost beside an end whose rim is a cell away.
MOST_WIDER, WIDER, AWAY, LOST_AT_END = 8.0, 1.4, 8, 0.6
#: A box around an end is `BOX` times as wide as its block, and has `BOX_CELLS` cells along its longer side; gains below
#: `BOX_AIM` of its bound do not pay for another round; no box is smaller than `LEAST_BOX` of the coordinates.
BOX, BOX_CELLS, BOX_AIM, LEAST_BOX = 2.5, 64, 1e-3, 2.0**-30
#: On a grid of more cells than this, both bounds end as soon as one is good enough; on smaller ones, going on is cheap.
LARGE = 250_000
#: Cells along the longer side of the finest grid: on finer ones, differences of stored numbers have few digits left.
MOST_ALONG = 2**17
#: A grid that has to fit into the cells allowed is made coarser by this factor; it is at least so many times as fine as
#: the one before.
ROOM, LEAST_TIMES = 0.99, 1.25
#: A raster is in line with the bounds of a problem within this part of a cell.
IN_LINE = 1e-6


def first_grid(problem: Problem, cells: int = FIRST_CELLS) -> tuple[int, int]:
    """
    Return the last node of the first grid: about so many cells along the longer side of the bounds.

    Examples
    --------
    >>> first_grid(Problem((0, 0), (1, 1), bounds=(0, 0, 2, 1)))
    (128, 64)
    """
    x_min, y_min, x_max, y_max = problem.bounds
    longer = max(x_max - x_min, y_max - y_min)
    columns, rows = (max(8, round(cells * side / longer)) for side in (x_max - x_min, y_max - y_min))
    return in_line(problem, (columns, rows))


def next_grid(problem: Problem, last: tuple[int, int], times: float = 2.0) -> tuple[int, int]:
    """
    Return the last node of the next grid, with about `times` as many cells along each side.

    Examples
    --------
    >>> next_grid(Problem((0, 0), (1, 1)), (128, 128))
    (256, 256)
    """
    finer = in_line(problem, (round(times * last[0]), round(times * last[1])))
    # (the lines of a raster may leave no grid in between)
    return finer if finer[0] > last[0] and finer[1] > last[1] else in_line(problem, (2 * last[0], 2 * last[1]))


def finer_grid(
    problem: Problem, last: tuple[int, int], kept: WholeArray, times: float, max_cells: int
) -> tuple[tuple[int, int], WholeArray]:
    """
    Lay a grid `times` as fine over the kept cells; a coarser one if it would have too many cells.

    Returns
    -------
    last, runs
        Its last node, and its cells (`cell_runs`); they may still be too many.

    Examples
    --------
    >>> problem = Problem((0, 0), (1, 1))
    >>> finer_grid(problem, (128, 128), cell_runs.rectangle((128, 128)), 2.0, 40_000)[0]
    (197, 197)
    """
    finer = next_grid(problem, last, times)
    runs = cell_runs.refined(kept, last, finer)
    fits = ROOM * times * math.sqrt(max_cells / max(with_halo(problem, runs, finer), 1))
    return finer_grid(problem, last, kept, fits, max_cells) if LEAST_TIMES <= fits < ROOM * times else (finer, runs)


def with_halo(problem: Problem, runs: WholeArray, last: tuple[int, int]) -> int:
    """
    Count some cells and those around them that a mesh has as well.

    Examples
    --------
    >>> with_halo(Problem((0, 0), (1, 1)), np.array([[64, 64, 65]]), (128, 128))
    289
    """
    return cell_runs.count(cell_runs.clipped(cell_runs.dilated(runs, halo(problem, last)), last))


def in_line(problem: Problem, last: tuple[int, int]) -> tuple[int, int]:
    """
    Align a grid with a raster over the bounds: a whole number of cells for each cell of the raster.

    Then the lines of the raster, where the cost has kinks or jumps, are borders of quarters of cells.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> field = RiskField(rasters=[RasterRisk(np.zeros((5, 7)), bounds=(0, 0, 1, 1))])
    >>> in_line(Problem((0, 0), (1, 1), field), (128, 128))
    (126, 130)
    """
    lined = list(last)
    x_min, y_min, x_max, y_max = problem.bounds
    for raster in problem.field.rasters[:1]:
        for axis, (low, high) in enumerate(((x_min, x_max), (y_min, y_max))):
            size, begin = raster.cell_size[axis], raster.bounds[axis]
            count = (high - low) / size
            whole = round(count)
            # (rounding of the bounds, relative to a cell)
            if whole >= 1 and abs(count - whole) < IN_LINE and abs((low - begin) / size % 1.0 - 0.5) > 0.5 - IN_LINE:
                times = round(last[axis] / whole)
                lined[axis] = times * whole if times >= 1 else last[axis]
    return lined[0], lined[1]


def halo(problem: Problem, last: tuple[int, int]) -> int:
    """
    Return by how many cells the mesh of a grid is wider than the cells that matter.

    Along the rim of a mesh, differences lack a neighbour. Their error travels with the front as waves, whose gradient
    does not fall with the spacing, and which spread sideways by about a hundredth of the grid's side (measured: 8 cells
    are enough up to 1024, 24 are too few on 4096; with too few, finer grids yield worse bounds). On rasters, whose
    cells are steep against each other, waves are not the greatest loss.

    Examples
    --------
    >>> halo(Problem((0, 0), (1, 1)), (512, 512)), halo(Problem((0, 0), (1, 1)), (4096, 4096))
    (8, 40)
    """
    return HALO if problem.field.rasters else min(max(HALO, max(last) // 100), MOST_HALO)


@dataclass(frozen=True, eq=False)
class Subsolution:
    """
    A spline that is nowhere steeper than the cost: a proven bound from every checked cell to one end.

    Attributes
    ----------
    bound
        The bound at the other end.
    values
        Control values of the spline, shape ``(n + 1,)``.
    corners
        Blocks in which they bound nothing.
    """

    bound: float
    values: FloatArray
    corners: Sequence[CornerBlock] = ()

    def lowered(self, by: float) -> "Subsolution":
        """Return the spline lowered everywhere."""
        return Subsolution(self.bound - by, self.values - by, self.corners)


@dataclass(frozen=True, eq=False)
class Level:
    """One grid: its mesh, and the cost on its cells."""

    problem: Problem
    mesh: SplineMesh
    bounds: FloatArray
    costs: FloatArray
    reach: int
    worth: float
    path: FloatArray | None
    widest: float
    #: Blocks of the grid of which this one is a part.
    of_whole: tuple[WholeCorners, MeshPart] | None = None

    @classmethod
    def lay(
        cls,
        problem: Problem,
        last: tuple[int, int],
        runs: WholeArray,
        worth: float = math.inf,
        path: FloatArray | None = None,
        widest: float = MOST_WIDER,
    ) -> "Level":
        """
        Build the mesh of some cells and bound the cost on each.

        Where more than `worth` is lost at an end, or at a corner of the path, a finer grid is laid around it.
        Blocks around ends are up to `widest` times as wide as usual.
        """
        ends = problem.start, problem.goal
        mesh = SplineMesh.build(problem.bounds, last, runs, problem.model.area, ends, halo(problem, last))
        reach = round(FIRST_REACH * (max(last) / FIRST_CELLS) ** (1 / 3))
        bounds = cost_bounds(problem, mesh)
        return cls(problem, mesh, bounds, costs_to_solve_for(problem, mesh, bounds), reach, worth, path, widest)

    def part(self, problem: Problem, runs: WholeArray, worth: float, path: FloatArray | None) -> "Level":
        """Return the grid of some of its cells, for other ends and another path on the same map."""
        part = self.mesh.part(runs, (problem.start, problem.goal), HALO_OF_PART)
        bounds, costs = self.bounds.take(part.pieces, axis=0), self.costs[part.nodes]
        of_whole = self.whole_corners, part
        return Level(problem, part.mesh, bounds, costs, self.reach, worth, path, MOST_WIDER, of_whole)

    @cached_property
    def whole_corners(self) -> WholeCorners:
        """Blocks around corners of this grid that its parts have in common."""
        return WholeCorners(self.problem, self.mesh)

    def load_checks(self) -> None:
        """Compile or load the kernels that check a spline and descend it."""
        times = np.zeros(self.mesh.n_nodes)
        steep, checked = np.empty(len(self.mesh.columns)), self._checked(self.goal_block, ())
        certificate_kernels.steepness(times, self.mesh.kernel_mesh, self.mesh.outlines, checked, self.bounds, steep)
        certificate_kernels.soften(steep, self.mesh.controls, np.zeros(len(steep)), self.costs.copy())
        self._shifted(times, self.problem.start, self.mesh.ends[0], self.goal_block)
        descent(self.problem, self.mesh, np.append(times, math.inf), radius=1.0)

    def both(
        self,
        aim: float,
        *,
        charge: bool = False,
        known: float = math.inf,
        wanted: float = math.inf,
        turns: bool = False,
    ) -> tuple[Subsolution, Subsolution] | None:
        """
        Bound the cost to the goal and to the start, at the same time; None if no way leads from one to the other.

        In `turns`, one after the other: where the first one is good enough, it stands for both, as no tube is needed.
        """
        if charge:
            # before threads start: a cached property has one lock for all grids, and a block has a grid of its own
            _ = self.corners
        turns = turns or stays_alone()
        race = _Race() if len(self.mesh.columns) > LARGE and not turns else None

        def bound(*, to_goal: bool) -> Subsolution | None:
            found = self.bound(to_goal=to_goal, aim=aim, charge=charge, known=known, wanted=wanted, race=race)
            return found and replace(found, bound=max(found.bound, self._across_rim(found, to_goal=to_goal)))

        if turns:
            first = bound(to_goal=True)
            second = first if first is None or first.bound >= wanted else bound(to_goal=False)
            return None if first is None or second is None else (first, second)
        # kernels let other threads run
        with ThreadPoolExecutor(1) as thread:
            other = thread.submit(bound, to_goal=False)
            to_goal, to_start = bound(to_goal=True), other.result()
        if to_goal is None or to_start is None:
            return None
        if race is not None and race.rounds:
            most = race.best(to_goal.bound, to_start.bound)
            to_goal, to_start = (replace(one, bound=min(one.bound, most)) for one in (to_goal, to_start))
        return to_goal, to_start

    def bound(
        self,
        *,
        to_goal: bool,
        aim: float,
        charge: bool = False,
        known: float = math.inf,
        wanted: float = math.inf,
        race: "_Race | None" = None,
    ) -> Subsolution | None:
        """
        Bound the cost from everywhere to one end: solve, check, lower the cost where it is too steep, and again.

        Parameters
        ----------
        to_goal
            Which end.
        aim
            Gains below this part of the bound do not pay for another round.
        charge
            Whether a few cells may stay too steep, for which the bound is lowered everywhere. Then differences of its
            values bound nothing.
        known
            Cost of a known path. As no round raises the costs-to-go, the part of the gap above them is left to finer
            grids: gains far below that part do not pay for another round.
        wanted
            A bound that is good enough.
        race
            With the bound to the other end: once one of them is good enough, both may end.

        Returns
        -------
        field
            The best found; None if no way leads from one end to the other, over the cells of this grid.
        """
        mesh, problem = self.mesh, self.problem
        source, other = (problem.goal, problem.start) if to_goal else (problem.start, problem.goal)
        piece, source_piece = mesh.ends if to_goal else mesh.ends[::-1]
        block = self.goal_block if to_goal else self.start_block
        corners = self.corners if charge else ()
        checked, links = self._checked(block, corners), links_of(mesh, corners)
        costs = self.costs.copy()
        rasters = problem.field.rasters
        rounds, gentle_rounds = ROUNDS_ON_RASTERS if rasters else ROUNDS
        gentle = all(one.interpolation == "bilinear" for one in rasters)
        floors = self.bounds[:, :, certificate_kernels.LEAST].min(axis=1) * gentle
        steep = np.empty(len(mesh.columns))
        # as far as the nodes around the block, at its corners too
        radius = (block.reach + 1.5) * math.hypot(*mesh.spacing)
        near = np.hypot(*(mesh.node_points - source).T) <= radius
        best: Subsolution | None = None
        reached, number, best_round = -math.inf, 0, 0
        while number < rounds:
            times = costs_to_go(
                problem,
                mesh,
                source,
                source_piece,
                costs,
                radius=radius,
                start_factor=float((costs[near] / self.costs[near]).min()),
                first=lambda points: np.where(block.is_around(self, points), block.costs(points), math.inf),
                links=links,
            )
            if piece < 0 or np.isinf(times[mesh.controls[piece]]).all():
                return None
            charges = [corner.charge(times, mesh) for corner in corners]
            kept = [corner for corner, one in zip(corners, charges, strict=True) if one < math.inf]
            if len(kept) < len(corners):
                # where a block does not pay for its charge, the spline has to be a bound again
                corners = kept
                checked, links = self._checked(block, corners), links_of(mesh, corners)
                continue
            steepest = certificate_kernels.steepness(
                times, mesh.kernel_mesh, mesh.outlines, checked, self.bounds, steep
            )
            found = self._shifted(times / max(steepest, 1.0), other, piece, block).lowered(sum(charges))
            gained, reached = found.bound - reached, max(reached, found.bound)
            if charge and 1.0 + aim < steepest < math.inf and not block.holds[piece]:
                scale, lost = self._charged(times, steep, steepest, found.bound)
                eased = self._shifted(times / scale, other, piece, block).lowered(lost + sum(charges))
                found = max(found, eased, key=lambda one: one.bound)
            if best is None or found.bound > best.bound:
                best, best_round = replace(found, corners=corners), number
            possible = self._shifted(times, other, piece, block).bound - sum(charges)
            left = min(LEAST_SHARE * (known - possible), LEAST_GAIN * possible) if known < math.inf else 0.0
            good = best.bound >= wanted
            lost = race is not None and race.is_lost(number, to_goal, good)
            too_steep = number >= ROUNDS_FOR_STEEP and steepest > STEEP and known < math.inf
            hopeless = (too_steep or number >= best_round + ROUNDS_IN_VAIN) and not rasters
            stalled = 0.0 <= gained < aim * reached
            done = good or lost or possible - best.bound <= left or steepest < 1.0 + aim
            if done or hopeless or (stalled and not gentle):
                break
            if stalled or number == gentle_rounds or (number == 0 and steepest <= GENTLE_ABOVE and not rasters):
                gentle = False
                floors[:] = 0.0
            certificate_kernels.soften(steep, mesh.controls, floors, costs)
            number += 1
        return best

    def _checked(self, block: "Block", corners: Sequence[CornerBlock]) -> BoolArray:
        """Return on which pieces the spline has to be a bound, shape ``(m,)``."""
        checked = self.mesh.matters & ~block.holds
        for corner in corners:
            checked[corner.pieces] = False
        return checked

    def _charged(self, times: FloatArray, steep: FloatArray, steepest: float, bound: float) -> tuple[float, float]:
        """Choose the factor by which a spline is divided as a whole; return it and the charge for the steeper cells."""
        above = np.flatnonzero(steep > 1.0)
        worst = above[np.argsort(steep[above])[::-1]][:MOST_CHARGED]
        values = bezier_values(times, self.mesh.controls[worst])
        spans = (values.max(axis=(1, 2)) - values.min(axis=(1, 2))) * (1.0 + ROUNDING)
        # with each scale, the cells before it stay too steep; with 1, all of them
        scales = steep[worst] if len(above) > MOST_CHARGED else np.append(steep[worst], 1.0)
        return least_loss(scales, spans, bound * steepest)

    def _shifted(self, values: FloatArray, other: Point, piece: int, block: "Block") -> Subsolution:
        """Shift a spline that is nowhere too steep so that it bounds the cost to the source itself."""
        mesh = self.mesh
        excess = block.excess(self, values)
        shifted = values - excess if math.isfinite(excess) else np.full_like(values, -math.inf)
        if block.holds[piece]:
            return Subsolution(block.least(other), shifted)
        x, y = ((other[axis] - mesh.origin[axis]) / mesh.spacing[axis] for axis in range(2))
        at = spline_value(mesh.controls[piece], x - int(mesh.columns[piece]), y - int(mesh.rows[piece]), shifted)
        return Subsolution(float(at), shifted)

    def _across_rim(self, found: Subsolution, *, to_goal: bool) -> float:
        """Bound the cost of a path by that up to the rim of the block that it begins in, and from there on."""
        begins, ends = (self.start_block, self.goal_block)[:: 1 if to_goal else -1]
        if (begins.holds & ends.holds).any():
            return -math.inf
        # (where a spline is infinite on a part of an edge, it says nothing)
        across = -begins.excess(self, np.where(np.isfinite(found.values), -found.values, math.inf))
        return across if across < math.inf else -math.inf

    @cached_property
    def corners(self) -> Sequence[CornerBlock]:
        """The blocks around corners of areas."""
        if self.problem.model.area.is_empty:
            return ()
        taken = [(*block.centre, block.reach) for block in (self.start_block, self.goal_block)]
        bent = None if self.path is None else BendingPath(shapely.LineString(self.path), self.worth)
        found, steep = corners_of(self.problem, self.mesh, self.reach, taken, bent, self.of_whole)
        looked = (FineCornerBlock.around(self.problem, self.mesh, one) for one in steep)
        return [*found, *(one for one in looked if one is not None)]

    @cached_property
    def start_block(self) -> "Block":
        """The block around the start."""
        return Block.around(self, self.problem.start)

    @cached_property
    def goal_block(self) -> "Block":
        """The block around the goal."""
        return Block.around(self, self.problem.goal)


def least_loss(scales: FloatArray, spans: FloatArray, height: float) -> tuple[float, float]:
    """
    Choose what a spline is divided by so that its bound is greatest: the cells before that one are charged for.

    Parameters
    ----------
    scales
        Slopes over costs, from the steepest cell on, shape ``(n,)``.
    spans
        By how much the spline changes on these cells, shape ``(n,)``, or all but the last.
    height
        The bound of the spline as it is.

    Returns
    -------
    scale, charge
        The divisor, and by how much the divided spline has to be lowered.

    Examples
    --------
    >>> least_loss(np.array([2.0, 1.0]), np.array([0.5]), height=10.0)
    (1.0, 0.25)
    """
    charges = (1.0 - scales / scales[0]) * np.concatenate([[0.0], np.cumsum(spans)])[: len(scales)]
    chosen = int(np.argmax((height - charges) / scales))
    return float(scales[chosen]), float(charges[chosen] / scales[chosen])


@dataclass
class _Race:
    """
    The race of two bounds, to the goal and to the start: the one that is good enough after fewer rounds wins.

    The other one may then end. How many rounds it has made by then depends on the machine, so no result uses it.
    """

    #: The round in which the bound to the goal (True), or that to the start (False), was good enough.
    rounds: dict[bool, int] = field(default_factory=dict)

    def is_lost(self, number: int, to_goal: bool, good: bool) -> bool:
        """Note whether a bound is good enough in a round; return whether the other one was good enough by then."""
        if good:
            self.rounds[to_goal] = number
        return self.rounds.get(not to_goal, math.inf) <= number

    def best(self, to_goal: float, to_start: float) -> float:
        """Return the bound that was good enough first, or the better one if both were."""
        first = min(self.rounds.values())
        return max(bound for one, bound in ((True, to_goal), (False, to_start)) if self.rounds.get(one) == first)


@dataclass(frozen=True, eq=False)
class Block:
    """
    The block of cells around an end, inside which the spline need not be a bound.

    Attributes
    ----------
    end
        The end.
    centre
        Column and row of its middle.
    reach
        Cells from its middle to its rim.
    holds
        Whether each piece of the mesh is in it, shape ``(m,)``.
    formula
        Lower bound of the cost to the end from its rim.
    end_grid
        The same from a finer grid, if one was laid; None otherwise.
    """

    end: Point
    centre: tuple[int, int]
    reach: int
    holds: BoolArray
    formula: EndFormula
    end_grid: EndGrid | None

    @classmethod
    def around(cls, level: Level, end: Point) -> "Block":
        """Find the block around an end."""
        mesh = level.mesh
        column, row = (round((end[axis] - mesh.origin[axis]) / mesh.spacing[axis]) for axis in range(2))
        distance = np.maximum(np.abs(mesh.columns - column), np.abs(mesh.rows - row))
        # the rim is half a cell further than its cells, and the end up to half a cell off its own
        step = math.hypot(*mesh.spacing)
        reach, formula, loss = _reach(level, end, step)
        finer = _end_grid(level, end, (reach + 1) * step) if loss > level.worth else None
        return cls(end, (column, row), reach, distance <= reach, formula, finer)

    def is_around(self, level: Level, points: FloatArray) -> BoolArray:
        """Return which points, shape ``(n, 2)``, are at most half a cell outside: shape ``(n,)``."""
        cells = np.abs((points - level.mesh.origin) / level.mesh.spacing - self.centre)
        return np.asarray((cells <= self.reach + 1.0 + IN_LINE).all(axis=1))

    def costs(self, points: FloatArray) -> FloatArray:
        """Bound the cost to the end from points up to its rim, shape ``(n, 2)``: shape ``(n,)``, map units."""
        return self.end_grid.costs(points) if self.end_grid else self.formula.costs(points - self.end)

    def least(self, point: Point) -> float:
        """Bound the cost to the end from a point inside."""
        least = self.formula.least_cost * math.dist(self.end, point)
        grid = self.end_grid
        if grid and any(abs(a - b) > blind for a, b, blind in zip(point, self.end, grid.blind, strict=True)):
            least = max(least, float(grid.costs(np.array([point]))[0]))
        return least

    def excess(self, level: Level, values: FloatArray) -> float:
        """Bound by how much a spline is above the cost to the end, anywhere on the rim."""
        mesh, reach = level.mesh, self.reach
        if self.end_grid:
            box = self.end_grid.kernel_box
            return certificate_kernels.box_excess(values, mesh.kernel_mesh, mesh.matters, self.centre, reach, box)
        return certificate_kernels.rim_excess(
            values, mesh.kernel_mesh, mesh.matters, self.end, self.centre, reach, self.formula.numbers
        )


def _reach(level: Level, end: Point, step: float) -> tuple[int, EndFormula, float]:
    """Choose how far a block reaches, in cells of such a diagonal; return it, the formula there, and its loss."""
    problem = level.problem
    area, room = problem.model.area, math.dist(problem.start, problem.goal) / 3.0
    if not area.is_empty:
        room = min(room, float(shapely.distance(area.geometry, shapely.Point(end))))
    most = max(min(level.widest * level.reach, room / step - AWAY), level.reach)
    best: tuple[int, EndFormula, float] | None = None
    least, wide = math.inf, float(level.reach)
    while best is None or wide <= most:
        reach, wide = round(wide), WIDER * wide
        formula = EndFormula.at(problem, end, (reach + 1) * step)
        loss, most_lost = _losses_at_end(problem, end, formula, (reach + 1) * step)
        total = most_lost + LOST_AT_END * min(level.mesh.spacing) * formula.least_cost / reach
        if best is None or total < least:
            best, least = (reach, formula, loss), total
    return best


def _losses_at_end(problem: Problem, end: Point, formula: EndFormula, rim: float) -> tuple[float, float]:
    """Estimate what a bound loses to a formula: where a straight line to the end costs least, and in any direction."""
    turn = np.linspace(0.0, 2.0 * math.pi, DIRECTIONS, endpoint=False)
    points = np.clip(end + rim * np.column_stack([np.cos(turn), np.sin(turn)]), *np.reshape(problem.bounds, (2, 2)))
    away = points - end
    # (an end on the rim of the map is its own neighbour)
    apart = np.hypot(*away.T) >= 0.5 * rim
    costs = straight_costs(problem, points[apart], end) * scale_at(problem, points[apart])
    lost = costs - formula.costs(away[apart])
    return float(lost[np.argmin(costs)]), float(lost.max())


def _end_grid(level: Level, end: Point, rim: float) -> EndGrid | None:
    """Bound the cost to an end on a finer grid without areas over a box around it; None if the box is too small."""
    problem = level.problem
    x_min, y_min, x_max, y_max = problem.bounds
    half = BOX * rim
    box = max(end[0] - half, x_min), max(end[1] - half, y_min), min(end[0] + half, x_max), min(end[1] + half, y_max)
    if half < LEAST_BOX * max(map(abs, problem.bounds)):
        return None
    sides = box[2] - box[0], box[3] - box[1]
    last = round(BOX_CELLS * sides[0] / max(sides)), round(BOX_CELLS * sides[1] / max(sides))
    if min(last) < BOX_CELLS // 4:
        return None
    # from the farthest corner of the box: a bound that is good there is good everywhere
    corner = max(((x, y) for x in box[::2] for y in box[1::2]), key=lambda point: math.dist(point, end))
    inside = replace(problem, start=corner, goal=end, bounds=box, no_fly=None, clearance=0.0)
    inner = Level.lay(inside, last, cell_runs.rectangle(last), level.worth)
    found = inner.bound(to_goal=True, aim=BOX_AIM, charge=True)
    if found is None or not np.isfinite(found.values[:-1]).all():
        return None
    leaves = box[0] > x_min, box[1] > y_min, box[2] < x_max, box[3] < y_max
    return EndGrid.of(inner.mesh, found.values, inner.goal_block.reach, leaves)
