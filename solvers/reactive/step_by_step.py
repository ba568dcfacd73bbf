"""Planners with local information: one decision a step, until the goal is reached or no step helps."""

import math
from abc import ABC, abstractmethod
from collections import Counter
from collections.abc import Hashable, Mapping
from dataclasses import dataclass, field, replace
from typing import ClassVar, Generic, TypeVar

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.errors import CglaError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import NO_RASTERS, Move, Traits, is_blind_to
from cgla_graph.solvers.base import Count, Positive, Settings
from cgla_graph.solvers.geometry import bearing, unit_vectors

#: The paper's step: 0.4 units of a lattice of 20 points a side, over the shorter side of the map.
STEP = 0.02
#: A step longer than asked for by more than this, relative to it, is a mistake and no rounding.
ROUNDING = 1e-9


class Stuck(CglaError):  # noqa: N818 - an answer, not an error
    """A reactive planner knows no further step; the message says why."""


@dataclass(eq=False)
class Surroundings:
    """
    The map as a reactive planner sees it.

    Attributes
    ----------
    problem
        The map as far as it is known; its start is where the planner is.
    step
        How far a step goes, map units.
    evaluations
        Points at which the risk was computed.
    counts
        Further counters of a run, for `Reactive.remark`.
    """

    problem: Problem
    step: float
    evaluations: int = field(default=0)
    counts: Counter[str] = field(default_factory=Counter)

    def __post_init__(self) -> None:
        """Limit the step to twice the map's diagonal: longer ones leave the map as well, and may overflow."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        self.step = min(self.step, 2.0 * math.hypot(x_max - x_min, y_max - y_min))

    @property
    def side(self) -> float:
        """The shorter side of the map, map units, to which a planner's distances are relative (the paper's is 1)."""
        return self.problem.shorter_side

    def to_goal(self, position: Point) -> float:
        """Return the distance to the goal, map units."""
        return math.dist(position, self.problem.goal)

    def goal_heading(self, position: Point) -> float:
        """Return the direction of the goal, radians counterclockwise from east."""
        return bearing(position, self.problem.goal)

    def risk(self, points: FloatArray) -> FloatArray:
        """Return the known ``F`` at points, shape ``(..., 2)`` to ``(...)``."""
        found = self.problem.field.density(points)
        self.evaluations += found.size
        return found

    def ahead(self, position: Point, headings: FloatArray, distance: float) -> FloatArray:
        """Return the points at a distance in some directions, shape ``(n,)`` to ``(n, 2)``."""
        return np.asarray(position) + distance * unit_vectors(headings)

    def spot_ahead(self, position: Point, heading: float, distance: float) -> Point:
        """Return the point at a distance in one direction."""
        x, y = self.ahead(position, np.array([heading]), distance)[0].tolist()
        return x, y

    def risk_on_rays(self, position: Point, headings: FloatArray, distance: float, samples: int = 10) -> FloatArray:
        """
        Return the known ``F`` along rays.

        Parameters
        ----------
        position
            Where they begin, map units.
        headings
            Shape ``(n,)``, radians.
        distance
            How long they are, map units.
        samples
            Points on each, evenly spaced, the far end among them.

        Returns
        -------
        risk
            Shape ``(n, samples)``.
        """
        parts = np.arange(1, samples + 1) / samples
        return self.risk(np.asarray(position) + distance * parts[None, :, None] * unit_vectors(headings)[:, None, :])

    def is_open(self, position: Point, points: FloatArray) -> BoolArray:
        """Tell for each point, shape ``(n, 2)``, whether it can be flown to straight: inside the bounds, past areas."""
        open_ = self.problem.in_bounds(points)
        # only of those on the map: far-away threats suggest places whose coordinates may overflow
        open_[open_] = ~self.problem.model.area.crosses(position, points[open_])
        return open_


@dataclass(frozen=True)
class Memory:
    """
    Memory of a planner between steps; planners add plain numbers, points and tuples of them.

    Equal memories make equal steps, so that a mission can tell when it repeats itself.

    Attributes
    ----------
    position
        Where the planner is, map units.
    """

    position: Point


M = TypeVar("M", bound=Memory)


@dataclass(frozen=True)
class _Track(Generic[M]):
    """A planner's memory, and how long it has made no headway."""

    memory: M
    least: float
    since: int = 0


@dataclass(frozen=True)
class Reactive(Settings, ABC, Generic[M]):
    """
    Base of reactive planners: the loop around their decisions, and the limits after which they are stuck.

    A planner implements `begin` and `choose`. Its step is checked: it may not be longer than allowed, leave the
    bounds or cross a no-fly area. A goal within a step, in plain sight, is reached.

    Attributes
    ----------
    step
        How far a step goes, map units; None: 0.02 of the shorter side of the map (0.4 of the paper's units). In a
        mission it is the UAV's.
    max_steps
        Stuck after so many steps.
    patience
        Stuck after so many steps without coming nearer to the goal than ever before.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.
    """

    step: Positive | None = None
    max_steps: Count = 1500
    patience: Count = 200

    traits: ClassVar[Traits]

    @abstractmethod
    def begin(self, around: Surroundings) -> M:
        """Return the memory of a planner at the start of the problem, before its first step."""

    @abstractmethod
    def choose(self, around: Surroundings, memory: M) -> M:
        """
        Decide one step: return the new memory, with the new position, at most a step away.

        Raises
        ------
        Stuck
            If there is none; the message says why.
        """

    def remark(self, counts: Mapping[str, int]) -> str:  # noqa: ARG002 - for planners that count
        """Describe a run in one line from its counters; empty if there is nothing to say."""
        return ""

    def move(self, problem: Problem, memory: Hashable | None, step: float) -> Move:
        """Decide one step (see `cgla_graph.model.solver.StepByStep`)."""
        if is_blind_to(problem, self.traits):
            return Move(np.array([problem.start]), memory, NO_RASTERS)
        around = Surroundings(problem, step)
        track = memory if isinstance(memory, _Track) else self._first(around)
        # a mission may have moved the UAV by rounding
        track = replace(track, memory=replace(track.memory, position=problem.start))
        try:
            after = self._next(around, track)
        except Stuck as stuck:
            return Move(np.array([problem.start]), track, str(stuck), counts=around.counts)
        return Move(np.array([problem.start, after.memory.position]), after, counts=around.counts)

    def solve(self, problem: Problem) -> Solution:
        """Go step by step from start to goal."""
        step = STEP * Surroundings(problem, 1.0).side if self.step is None else self.step
        around = Surroundings(problem, step)
        track = self._first(around)
        path = [problem.start]
        try:
            while path[-1] != problem.goal:
                if len(path) > self.max_steps:
                    msg = f"not there after {self.max_steps} steps"
                    raise Stuck(msg)  # noqa: TRY301 - one way to end
                track = self._next(around, track)
                path.append(track.memory.position)
        except Stuck as stuck:
            x, y = path[-1]
            words = (f"at ({x:.6g}, {y:.6g}), step {len(path) - 1}: {stuck}", self.remark(around.counts))
            message = "; ".join(filter(None, words))
            return Solution(Status.STUCK, evaluations=around.evaluations, message=message)
        points = np.array(path)
        cost = problem.evaluate(points).cost
        message = self.remark(around.counts)
        return Solution(Status.FOUND, path=points, cost=cost, evaluations=around.evaluations, message=message)

    def _first(self, around: Surroundings) -> _Track[M]:
        return _Track(self.begin(around), around.to_goal(around.problem.start))

    def _next(self, around: Surroundings, track: _Track[M]) -> _Track[M]:
        """Make one step, the last one straight to the goal."""
        if track.since >= self.patience:
            msg = f"no headway in {self.patience} steps: never nearer to the goal than {track.least:.6g}"
            raise Stuck(msg)
        here = track.memory.position
        if around.to_goal(here) <= around.step and around.is_open(here, np.array([around.problem.goal]))[0]:
            memory = replace(track.memory, position=around.problem.goal)
        else:
            memory = self.choose(around, track.memory)
            memory = replace(memory, position=_rounded_back(here, memory.position, around.step))
        length = math.dist(here, memory.position)
        if length > around.step * (1.0 + ROUNDING):
            msg = f"its step is {length:g} long, longer than {around.step:g}"
            raise Stuck(msg)
        if not around.is_open(here, np.array([memory.position]))[0]:
            msg = "its step would cross a no-fly area or leave the bounds"
            raise Stuck(msg)
        left = around.to_goal(memory.position)
        return _Track(memory, left) if left < track.least else _Track(memory, track.least, track.since + 1)


def _rounded_back(here: Point, there: Point, step: float) -> Point:
    """Shorten a step that rounding made too long, far from the origin, where coordinates are coarse."""
    for _ in range(2):
        if math.dist(here, there) <= step * (1.0 + ROUNDING):
            break
        there = math.nextafter(there[0], here[0]), math.nextafter(there[1], here[1])
    return there
