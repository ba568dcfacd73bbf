"""A ruler that bends around obstacles: probes in all directions, each with one bend towards the goal."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Between, NonNegative, Positive, reactive_traits
from cgla_graph.solvers.geometry import unit_vectors, wrapped
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: Directions of the first stage, off the goal, radians: every 5 degrees, the least first, left before right.
SPREAD = np.radians([0, *(side * 5 * n for n in range(1, 36) for side in (1, -1)), 180])
#: Directions of the second stage, off the goal, radians.
BENDS = np.radians([0.0, 45.0, -45.0])


@dataclass(frozen=True)
class BendyMemory(Memory):
    """
    Memory of the planner.

    Attributes
    ----------
    bearing
        Where it went last, radians; None before the first step.
    """

    bearing: float | None = None


@dataclass(frozen=True)
class BendyRuler(Reactive[BendyMemory]):
    """
    Probes straight lines around itself, and takes the one nearest to the goal's direction that keeps its margin.

    Public: ArduPilot's documentation ("Object Avoidance with Bendy Ruler", ardupilot.org, its list of parameters) and
    its developers' account of the two steps ("GSoC 2020: Improvements to Object Avoidance", discuss.ardupilot.org): the
    vehicle probes in many directions around itself for one that is open enough and still leads towards the
    destination. A probe has a lookahead (OA_BR_LOOKAHEAD), a margin that it has to keep from obstacles (OA_MARGIN_MAX),
    and a second stage from its end towards the destination. A bearing that turns by more than an angle
    (OA_BR_CONT_ANGLE) is resisted unless its margin is better by some ratio than that of the bearing before
    (OA_BR_CONT_RATIO). This follows that description, not ArduPilot's code, and flies in the plane only.

    Our design: the obstacles are no-fly areas, and a disc for each known threat, inside of which its own risk exceeds
    `threshold`; discs are not walls, so that a vehicle that finds itself in one gets out of it. The bounds are walls
    without a margin. Bearings are tried every 5 degrees, the nearest to the goal's first, and of the two sides first
    that of the last bearing. A bearing is good where its probe keeps the margin over the lookahead, and from there one
    of three bends, towards the goal or 45 degrees off, keeps it again. Where none is good, that with the widest margin
    is taken. Margins count up to the lookahead; probes end at the goal, and one that reaches it needs no more margin
    than the goal itself has. It weighs no risk: it ignores ``k`` and all risk below the threshold.

    Known failures: no memory but the last bearing, so that it swings to and fro in dead ends deeper than its
    lookahead; a goal in a closed ring of discs; risk that only adds up over several threats, none of them above the
    threshold; paths along the very rim of a disc.

    `Solution.evaluations` counts the segments probed.

    Attributes
    ----------
    step, max_steps, patience
        As of all reactive planners (`Reactive`).
    lookahead
        How long a probe is, in shorter sides of the map.
    margin_max
        How far from obstacles a good probe stays, in shorter sides of the map; 0 lets it touch them.
    continue_ratio
        So many times as wide as that of the last bearing must be the margin of one that turns too far; at least 1.
    continue_angle
        Beyond this, degrees, a turn away from the last bearing is too far; 180 and more: none is.
    threshold
        The risk of a threat at the rim of its disc; threats with lower peaks are no obstacles.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> answer = BendyRuler(threshold=0.1).solve(problem)
    >>> bool(problem.field.density(answer.path).max() < 0.1)
    True
    """

    lookahead: Positive = 0.15
    margin_max: NonNegative = 0.02
    continue_ratio: Annotated[float, Between(1.0, math.inf)] = 1.5
    continue_angle: Positive = 75.0
    threshold: Positive = 0.2

    traits: ClassVar[Traits] = reactive_traits(
        "bendy-ruler", "probes around itself that keep a margin (ArduPilot's public description)"
    )

    def begin(self, around: Surroundings) -> BendyMemory:
        """Start without a bearing."""
        return BendyMemory(around.problem.start)

    def choose(self, around: Surroundings, memory: BendyMemory) -> BendyMemory:
        """Probe, resist a sharp turn that pays too little, and go."""
        to_goal = around.goal_heading(memory.position)
        off = 0.0 if memory.bearing is None else wrapped(memory.bearing - to_goal)
        # the last bearing is probed at the end of the list, in case it is kept
        offsets = np.append(SPREAD if off >= 0.0 else -SPREAD, off)
        best, margins, is_good = self._best(around, memory.position, offsets)
        sharp = abs(wrapped(offsets[best] - off)) > math.radians(self.continue_angle)
        straight_there = best == 0 and is_good
        if memory.bearing is not None and sharp and not straight_there:
            best = best if margins[best] >= self.continue_ratio * margins[-1] else -1
        bearing = wrapped(to_goal + float(offsets[best]))
        return BendyMemory(around.spot_ahead(memory.position, bearing, around.step), bearing=bearing)

    def _best(self, around: Surroundings, here: Point, offsets: FloatArray) -> tuple[int, FloatArray, bool]:
        """
        Return the best direction but the last one of the list, the margins of all, and whether the best one is good.

        Raises
        ------
        Stuck
            If all are closed even for one step.
        """
        obstacles = _Obstacles(around, self)
        next_spots = around.ahead(here, around.goal_heading(here) + offsets, around.step)
        can_step = around.is_open(here, next_spots)
        for reach in (max(self.lookahead * around.side, around.step), around.step):
            ends, margins, good = (found[0] for found in obstacles.probe(np.array([here]), offsets, reach))
            margins[~can_step] = -math.inf
            candidates = np.nonzero((good & can_step)[:-1])[0]
            if len(candidates):
                _, _, goes_on = obstacles.probe(ends[candidates], BENDS, reach)
                both = candidates[goes_on.any(axis=1)]
                if len(both):
                    return int(both[0]), margins, True
            widest = int(np.argmax(margins[:-1]))
            if margins[widest] > -math.inf:
                return widest, margins, False
        msg = "every bearing is closed by a no-fly area or the bounds"
        raise Stuck(msg)


class _Obstacles:
    """The discs and areas around one place, and how far probes stay from them."""

    def __init__(self, around: Surroundings, ruler: BendyRuler) -> None:
        self._around = around
        self._goal = np.asarray(around.problem.goal)
        field = around.problem.field
        radii = field.contour_radii(ruler.threshold)
        self._discs = np.column_stack([field.centres, radii])[radii > 0.0]
        self._needed = ruler.margin_max * around.side
        of_goal = self._clearance(self._goal[None], self._goal[None], self._needed)
        self._needed_at_goal = min(self._needed, float(of_goal[0]))

    def probe(self, starts: FloatArray, offsets: FloatArray, reach: float) -> tuple[FloatArray, FloatArray, BoolArray]:
        """
        Probe directions off the goal's, from several places.

        Parameters
        ----------
        starts
            Shape ``(n, 2)``, map units.
        offsets
            Shape ``(m,)``, radians.
        reach
            How long probes are, map units; those near the goal are as long as it is far, but not below a step.

        Returns
        -------
        ends, margins, good
            Where the probes end, shape ``(n, m, 2)``; how far they stay from obstacles, shape ``(n, m)``, map units, at
            most the reach, negative in discs, minus infinity where one is closed; and whether that is enough.
        """
        to_goal = self._goal - starts
        distance = np.hypot(*to_goal.T)[:, None]
        headings = np.arctan2(to_goal[:, 1], to_goal[:, 0])[:, None] + offsets
        lengths = np.clip(distance, self._around.step, reach)[..., None]
        ends = starts[:, None] + lengths * unit_vectors(headings)
        arrives = (offsets == 0.0) & (distance <= reach)
        ends[arrives] = self._goal
        flat = np.repeat(starts, len(offsets), axis=0), ends.reshape(-1, 2)
        margins = self._clearance(*flat, reach).reshape(arrives.shape)
        return ends, margins, margins >= np.where(arrives, self._needed_at_goal, self._needed)

    def _clearance(self, starts: FloatArray, ends: FloatArray, most: float) -> FloatArray:
        """Return how far segments stay from obstacles, shape ``(n, 2)`` each to ``(n,)``, map units."""
        self._around.evaluations += len(starts)
        least = np.full(len(starts), most)
        if len(self._discs):
            centres, radii = self._discs[:, :2], self._discs[:, 2]
            along = (ends - starts)[:, None]
            square = np.maximum((along**2).sum(axis=-1), np.finfo(float).tiny)
            part = np.clip(((centres - starts[:, None]) * along).sum(axis=-1) / square, 0.0, 1.0)
            miss = starts[:, None] + part[..., None] * along - centres
            least = np.minimum(least, (np.hypot(miss[..., 0], miss[..., 1]) - radii).min(axis=1))
        problem = self._around.problem
        area = problem.model.area
        if not area.is_empty:
            lines = shapely.linestrings(np.stack([starts, ends], axis=1))
            least = np.minimum(least, shapely.distance(lines, area.geometry))
        return np.where(problem.in_bounds(ends) & ~area.crosses(starts, ends), least, -np.inf)
