"""A2D-style: towards the goal below a threshold of risk, and along the boundary of the areas above it."""

import math
from dataclasses import dataclass, replace
from typing import Annotated, ClassVar

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Between, Whole, reactive_traits
from cgla_graph.solvers.geometry import wrapped
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: How much the threshold rises where nothing else helps, and its greatest value (with rasters, that of their risk).
RAISED, GREATEST = 1.5, 1.0
#: The last waypoints, which are avoided where possible, and the distance kept from them, in steps.
RECENT, TOO_NEAR = 10, 0.5
#: A boundary is left only where the goal is so many steps nearer than it was at the beginning of the walk.
NEARER = 0.5
#: A walk is around once it was this many steps away from where it began, and is this close to it again.
AWAY, BACK = 4.0, 2.0
#: Points of a step whose risk is looked at, its end among them.
SAMPLES = 2


@dataclass(frozen=True)
class Walk:
    """
    A walk along the boundary of the obstacle.

    Attributes
    ----------
    side
        1: the way turns left, and the obstacle stays on the right; -1: the other way round.
    start
        Where it began, map units.
    distance
        How far the goal was from there, map units.
    away
        Whether it was already `AWAY` steps from its start.
    """

    side: int
    start: Point
    distance: float
    away: bool = False


@dataclass(frozen=True)
class Trail(Memory):
    """
    Memory of the planner.

    Attributes
    ----------
    heading
        Of the last step, radians.
    threshold
        The risk that is allowed now, per unit length.
    resume
        A raised threshold stays until the goal is nearer than this, map units.
    recent
        The last waypoints, the newest last.
    walk
        The boundary that is being followed, if one is.
    """

    heading: float
    threshold: float
    resume: float = math.inf
    recent: tuple[Point, ...] = ()
    walk: Walk | None = None


@dataclass(frozen=True)
class A2dStyle(Reactive[Trail]):
    """
    Four rules that keep waypoints "almost" below a threshold of risk, in the style of Kim, Gu and Postlethwaite.

    **Public.** Kim, Gu and Postlethwaite (Automatica 44, 2008, 696-712), by their abstract: two deterministic,
    rule-based algorithms, the second of which uses where the threats in range are and how strong, and more memory; it
    converges to the target, with waypoints almost below a risk threshold. That the CGLA paper's "A2D" is its version
    for dynamic threats is a guess.

    **Our design.** Neither rules nor code are public: this is in the style of the original, not the original.
    (1) Step towards the goal if the risk on that step is at most `threshold`. (2) Else follow the boundary of the area
    above it: of the `headings`, first the one nearest to the goal's direction, which also locks the side; then the
    first that is free, turning away from the obstacle; waypoints just visited are avoided where possible. (3) Leave
    the boundary where the goal is nearer than it was at its beginning and the step towards it is free, as the "bug"
    planners do (Lumelsky and Stepanov 1987). (4) Where every heading exceeds the threshold, take the least risky one
    and raise the threshold by half; after a whole way around, raise it until the step towards the goal is free. The
    threshold falls back once the risk is below it again and the goal is nearer. Threats are those that are known,
    which in a mission are those in range (and shared).

    **Known failures.** Long walks along boundaries, on the worse side as often as on the better one; risk above the
    threshold where it was raised; dense risk uses up its patience. The cost, and so `Problem.k`, plays no part.

    `Solution.evaluations` counts the points at which the risk was computed.

    Attributes
    ----------
    step, max_steps, patience
        As of `Reactive`.
    threshold
        The risk per unit length that is allowed, above 0, at most 1.
    headings
        Directions that are looked at, evenly around, 4 to 360.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, spread=0.1)]), k=10.0)
    >>> path = A2dStyle(threshold=0.1).solve(problem).path
    >>> bool(problem.field.density(path).max() <= 0.1)
    True
    """

    threshold: Annotated[float, Between(0.0, GREATEST, above=True)] = 0.1
    headings: Annotated[int, Whole(4, 360)] = 16

    traits: ClassVar[Traits] = reactive_traits(
        "a2d-style", "rules below a threshold of risk (in the style of Kim, Gu, Postlethwaite)", rasters=True
    )

    def begin(self, around: Surroundings) -> Trail:
        """Face the goal."""
        start = around.problem.start
        return Trail(start, around.goal_heading(start), self.threshold)

    def choose(self, around: Surroundings, memory: Trail) -> Trail:
        """Apply the rules."""
        trail = self._settled(around, memory)
        here, walk = trail.position, trail.walk
        to_goal, goal_heading = around.to_goal(here), around.goal_heading(here)
        free_to_goal = self._free(around, trail, np.array([goal_heading]))[0]
        if walk is not None and free_to_goal and to_goal < walk.distance - NEARER * around.step:
            walk = None
        if walk is None:
            if free_to_goal:
                return self._stepped(around, replace(trail, walk=None), goal_heading)
            return self._first_along(around, trail)
        gone = math.dist(here, walk.start)
        if walk.away and gone <= BACK * around.step:
            return self._around(around, trail)
        walk = replace(walk, away=walk.away or gone > AWAY * around.step)
        return self._along(around, replace(trail, walk=walk))

    def _settled(self, around: Surroundings, trail: Trail) -> Trail:
        """Reset the threshold once the planner has passed the risk that it was raised for."""
        if trail.threshold == self.threshold or around.to_goal(trail.position) >= trail.resume:
            return trail
        if around.risk(np.array(trail.position)) > self.threshold:
            return trail
        return replace(trail, threshold=self.threshold, resume=math.inf)

    def _free(self, around: Surroundings, trail: Trail, headings: FloatArray) -> BoolArray:
        """Tell which steps stay below the threshold, inside the bounds and out of no-fly areas, shape ``(n,)``."""
        risk = around.risk_on_rays(trail.position, headings, around.step, samples=SAMPLES).max(axis=1)
        ends = around.ahead(trail.position, headings, around.step)
        free: BoolArray = (risk <= trail.threshold) & around.is_open(trail.position, ends)
        return free

    def _turns(self) -> FloatArray:
        """Return the directions that are looked at, relative to the first, radians."""
        return np.asarray(2.0 * math.pi * np.arange(self.headings) / self.headings, dtype=np.float64)

    def _first_along(self, around: Surroundings, trail: Trail) -> Trail:
        """Begin to follow a boundary: the free heading nearest to the goal's decides on the side."""
        here = trail.position
        turns = self._turns()[1 : self.headings // 2 + 1]
        goal = around.goal_heading(here)
        left, right = (self._passable(around, trail, goal + side * turns) for side in (1, -1))
        side = 1 if np.argmax([*left, True]) <= np.argmax([*right, True]) else -1
        return self._along(around, replace(trail, heading=goal, walk=Walk(side, here, around.to_goal(here))))

    def _along(self, around: Surroundings, trail: Trail) -> Trail:
        """Follow the boundary: turn towards the obstacle as far as the way is passable, or away until it is."""
        side = 1 if trail.walk is None else trail.walk.side
        headings = trail.heading + side * self._turns()
        passable = self._passable(around, trail, headings)
        if not passable.any():
            return self._least_risky(around, trail, headings)
        turn = int(passable.argmax())
        if turn == 0:
            # where the boundary ends, a quarter of a circle a step leads around the tip
            while turn > -(self.headings // 4) and passable[turn - 1]:
                turn -= 1
        return self._stepped(around, trail, float(headings[turn]))

    def _passable(self, around: Surroundings, trail: Trail, headings: FloatArray) -> BoolArray:
        """Tell which steps are free, without those back to recent waypoints, if others are free."""
        free = self._free(around, trail, headings)
        fresh = free & ~self._was_there(around, trail, headings)
        return fresh if bool(fresh.any()) else free

    def _was_there(self, around: Surroundings, trail: Trail, headings: FloatArray) -> BoolArray:
        """Tell which steps end close to a recent waypoint."""
        if not trail.recent:
            return np.zeros(len(headings), dtype=np.bool_)
        ends = around.ahead(trail.position, headings, around.step)
        apart = np.hypot(*(ends[:, None, :] - np.array(trail.recent)).transpose(2, 0, 1))
        return np.asarray((apart < TOO_NEAR * around.step).any(axis=1), dtype=np.bool_)

    def _least_risky(self, around: Surroundings, trail: Trail, headings: FloatArray) -> Trail:
        """Step where the risk is least, and allow more of it."""
        ends = around.ahead(trail.position, headings, around.step)
        open_ = around.is_open(trail.position, ends)
        if not open_.any():
            msg = f"no-fly areas and bounds leave none of {self.headings} headings"
            raise Stuck(msg)
        fresh = open_ & ~self._was_there(around, trail, headings)
        risk = np.where(fresh if fresh.any() else open_, around.risk(ends), math.inf)
        raised = min(_greatest(around), RAISED * trail.threshold)
        # the boundary that was followed is none at another threshold
        trail = replace(trail, threshold=raised, resume=self._resume(around, trail), walk=None)
        return self._stepped(around, trail, float(headings[risk.argmin()]))

    def _around(self, around: Surroundings, trail: Trail) -> Trail:
        """Raise the threshold as far as the step towards the goal needs: the goal cannot be reached below it."""
        heading = around.goal_heading(trail.position)
        threshold = trail.threshold
        greatest = _greatest(around)
        while threshold < greatest:
            threshold = min(greatest, RAISED * threshold)
            raised = replace(trail, threshold=threshold, resume=self._resume(around, trail), walk=None)
            if self._free(around, raised, np.array([heading]))[0]:
                return self._stepped(around, raised, heading)
        msg = "the path led around the obstacle before the goal, and back again"
        raise Stuck(msg)

    def _resume(self, around: Surroundings, trail: Trail) -> float:
        """Return the distance from the goal at which the threshold may fall back: a few steps nearer than here."""
        return around.to_goal(trail.position) - AWAY * around.step

    def _stepped(self, around: Surroundings, trail: Trail, heading: float) -> Trail:
        """Make a step."""
        position = around.spot_ahead(trail.position, heading, around.step)
        recent = (*trail.recent, trail.position)[-RECENT:]
        return replace(trail, position=position, heading=wrapped(heading), recent=recent)


def _greatest(around: Surroundings) -> float:
    """Return an upper bound of the risk."""
    return GREATEST + sum(raster.greatest for raster in around.problem.field.rasters)
