"""Many questions to one map: paths and proofs from many starts, to many goals, that share their work."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._progress import Tell, showing
from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph._validate import instance, number_array, point_array, positive_number, whole_number
from cgla_graph.certificate.answers import Answers
from cgla_graph.certificate.certificate import (
    MAX_CELLS,
    WORTH,
    is_separated,
    load_kernels,
    usual_cells,
)
from cgla_graph.certificate.isochrones import Isochrones, isochrones_to
from cgla_graph.certificate.landmarks import COARSE, MANY, Ground, refined
from cgla_graph.certificate.many import MOST_SOLVES, GoalSurface
from cgla_graph.certificate.many_cells import CellSurface
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Evaluation, Problem, problem_wanted
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.model.solver import trivial_solution
from cgla_graph.solvers.solving import solve

#: The gap that is asked for by default.
TOLERANCE = 0.01
#: Cells along the longer side of the grid for a gap of 1 %, by how many questions have their goal in common, at least;
#: for other gaps, the number goes with the root of the gap. Where fewer have, each is proven by itself.
STEPS = {24: 512, 6: 384, 4: 256}
#: Those for isochrones by default: on maps with cells of constant cost, where places take longer, and on others.
ISOCHRONE_STEPS = {True: 128, False: 256}
#: Name of the solver in answers.
NAME = "map"


@dataclass(eq=False)
class _Found:
    """Paths, their costs, and bounds of questions with a common end: lists and arrays of one entry for each."""

    paths: list[FloatArray]
    judged: list[Evaluation | None]
    costs: FloatArray
    bounds: FloatArray
    apart: BoolArray

    def offer(self, number: int, problem: Problem, path: FloatArray) -> None:
        """Take a path that is feasible and better than the known one."""
        if len(path):
            judged = problem.evaluate(path)
            if judged.feasible and judged.cost < self.costs[number]:
                self.paths[number], self.judged[number], self.costs[number] = path, judged, judged.cost

    def open(self, tolerance: float) -> IntArray:
        """List the questions whose gap is above the tolerance."""
        return np.flatnonzero(~self.apart & ~(self.costs <= self.bounds * (1.0 + tolerance)))


@dataclass(frozen=True, eq=False)
class Map(ShortRepr):
    """
    A map that answers many questions: what they have in common is computed once.

    Attributes
    ----------
    problem
        The map: its start and goal are those of questions without one.

    Raises
    ------
    ProblemError
        If it is no problem.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = cg.RiskField([cg.Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)])
    >>> base = cg.Map(cg.Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0))
    >>> answers = base.solve(starts=[(0.1, 0.1), (0.1, 0.5), (0.5, 0.1)])
    >>> bool((answers.gaps <= 0.01).all()), answers.most_solves <= 3
    (True, True)
    """

    problem: Problem
    _grounds: dict[int, Ground | None] = field(default_factory=dict, repr=False, init=False)

    def __post_init__(self) -> None:
        """Check the problem."""
        instance("problem", self.problem, Problem, problem_wanted)

    def solve(
        self,
        starts: ArrayLike | None = None,
        goals: ArrayLike | None = None,
        *,
        names: Sequence[str] | None = None,
        tolerance: float = TOLERANCE,
    ) -> Answers:
        """
        Find a path for each question, and prove how good it is.

        Many starts with one goal (or many goals with one start) share one surface of costs-to-go, which is solved three
        times at most. Paths go down that surface; those whose gap is above the tolerance are refined; what is still
        above it then, or begins so near to the goal that the surface says nothing, gets a proof of its own. So do
        questions that share an end with at most two others; bounds of the map leave a narrow tube to each of them, where
        the cost is not constant on cells.

        Parameters
        ----------
        starts
            Where paths begin, shape ``(n, 2)``, or one point, map units (on a map in degrees
            ``problem.projection.forward(lonlat)``). None: the start of the problem.
        goals
            Where they end. None: the goal of the problem. With n starts and n goals, they are pairs; a single point
            belongs to all of the others.
        names
            A name for each question, for tables; None: its number from 1.
        tolerance
            The gap that is asked for.

        Returns
        -------
        answers
            In the order of the questions, each with path, cost, lower bound and gap. Where there is no path, the status
            says so, with an infinite bound.

        Raises
        ------
        ProblemError
            If points are malformed, outside the bounds, or in the no-fly area or too near to it (the message says which
            one), there are other numbers of starts, goals and names, or the tolerance is not positive.

        Examples
        --------
        >>> import cgla_graph as cg
        >>> pairs = cg.Map(cg.Problem((0, 0), (1, 1))).solve(starts=[(0, 0), (0, 1)], goals=[(1, 0), (0, 0)])
        >>> pairs.costs.tolist(), pairs.gaps.tolist()
        ([1.0, 1.0], [0.0, 0.0])
        """
        positive_number("tolerance", tolerance)
        begins, ends = self._questions(starts, goals)
        named = _named(names, len(begins))
        began = time.perf_counter()
        asked, which = np.unique(np.hstack([begins, ends]), axis=0, return_inverse=True)
        with showing("many questions") as tell:
            work = _Work(self, asked[:, :2], asked[:, 2:], tolerance, tell)
            every = work.answers()
        solutions = tuple(every[number] for number in np.reshape(which, -1).tolist())
        counts = work.n_solves, work.most_solves, work.n_own
        seconds = time.perf_counter() - began
        return Answers(solutions, named, begins, ends, tolerance, *counts, seconds, self.problem)

    def isochrones(
        self, costs: ArrayLike, goal: Sequence[float] | None = None, *, steps: int | None = None
    ) -> Isochrones:
        """
        Find from where a place can be reached at most at some costs: for certain, and possibly.

        Costs are the same in both directions, so that it is also how far one gets from there.

        Parameters
        ----------
        costs
            One cost or several, positive, map units.
        goal
            The place, shape ``(2,)``, map units. None: the goal of the problem.
        steps
            Cells of a grid along the longer side of the map, 16 to 2048: with more, the areas are closer to each other.
            None: 256, or 128 on rasters read as `nearest`.

        Returns
        -------
        isochrones
            Two areas for each cost, in ascending order. From each point of the one, a path is known that costs at most
            that. No path from outside of the other costs less.

        Raises
        ------
        ProblemError
            If a cost is not positive and finite, the place is outside the bounds or in the no-fly area, a setting is
            out of range, or no grid proves anything on this map (peaks above 1, weights beyond the arithmetic).

        Examples
        --------
        >>> import cgla_graph as cg
        >>> found = cg.Map(cg.Problem((0.5, 0.5), (0.5, 0.5))).isochrones([0.2, 0.4])
        >>> [bool(row["certain_area"] <= math.pi * row["cost"] ** 2 <= row["possible_area"]) for row in found.rows()]
        [True, True]
        """
        wanted = np.unique(number_array("costs", costs)).tolist()
        for cost in wanted:
            positive_number("costs", cost)
        if not wanted:
            msg = "costs are empty; give one cost or several, map units"
            raise ProblemError(msg)
        place = np.array([self.problem.goal]) if goal is None else _points("goal", goal)
        if len(place) != 1:
            msg = f"goal is {shown(goal)}; give one point, shape (2,)"
            raise ProblemError(msg)
        self._check("goal", place, self.problem.start)
        end = (float(place[0, 0]), float(place[0, 1]))
        cells = CellSurface.towards(self.problem, end, usual_cells(self.problem))
        cells = None if cells is None or cells.proof.loose else cells
        steps = ISOCHRONE_STEPS[cells is not None] if steps is None else steps
        ground = self.ground(whole_number("steps", steps, at_least=16, at_most=2048))
        if ground is None:
            why = "k is too great for the arithmetic, or the map reaches too far around the Earth"
            why = why if self.problem.field.is_proper else NEGATIVE_WEIGHTS
            msg = f"no isochrones: no grid proves anything here, as {why}"
            raise ProblemError(msg)
        load_kernels(MapKind.of(self.problem.model))
        with showing("isochrones"):
            return isochrones_to(ground, end, wanted, cells)

    def ground(self, steps: int) -> Ground | None:
        """Return the grid of so many steps, which all surfaces share; None where no grid proves anything."""
        if steps not in self._grounds:
            self._grounds[steps] = Ground.lay(self.problem, steps)
        return self._grounds[steps]

    def _questions(self, starts: ArrayLike | None, goals: ArrayLike | None) -> tuple[FloatArray, FloatArray]:
        """Return starts and goals, shape ``(n, 2)`` each, checked."""
        given = [
            np.array([default]) if points is None else _points(name, points)
            for name, points, default in (
                ("starts", starts, self.problem.start),
                ("goals", goals, self.problem.goal),
            )
        ]
        for name, points, other in (("start", given[0], self.problem.goal), ("goal", given[1], self.problem.start)):
            self._check(name, points, other)
        counts = [len(points) for points in given]
        if counts[0] != counts[1] and 1 not in counts:
            msg = f"there are {counts[0]} starts and {counts[1]} goals; give as many of both, or one of either"
            raise ProblemError(msg)
        most = 0 if 0 in counts else max(counts)
        begins, ends = (np.broadcast_to(points[:most] if most == 0 else points, (most, 2)) for points in given)
        return np.array(begins), np.array(ends)

    def _check(self, name: str, points: FloatArray, other: Point) -> None:
        """Check that all points are where a path may be; the error names the first that is not."""
        if not len(points):
            return
        wrong = np.flatnonzero(~self.problem.in_bounds(points) | self.problem.area.contains(points))
        if len(wrong):
            number = int(wrong[0])
            at = (float(points[number, 0]), float(points[number, 1]))
            start, goal = (at, other) if name == "start" else (other, at)
            try:
                replace(self.problem, start=start, goal=goal)
            except ProblemError as error:
                msg = f"{name} {number + 1} of {len(points)}: {error}"
                raise ProblemError(msg) from error


def _points(name: str, value: ArrayLike) -> FloatArray:
    """Return points, shape ``(n, 2)``: one, several, or none."""
    array = number_array(name, value)
    points = point_array(name, array) if array.size else np.empty((0, 2))
    if points.ndim not in {1, 2}:
        msg = f"{name} have shape {points.shape}; give points, shape (n, 2)"
        raise ProblemError(msg)
    return points.reshape(-1, 2)


def _named(names: Sequence[str] | None, count: int) -> tuple[str, ...]:
    if names is None:
        return tuple(str(number) for number in range(1, count + 1))
    if isinstance(names, str) or not hasattr(names, "__len__") or not all(isinstance(name, str) for name in names):
        msg = f"names is {shown(names)}; give a list of texts, one for each question"
        raise ProblemError(msg)
    if len(names) != count:
        msg = f"there are {len(names)} names and {count} questions; give one for each"
        raise ProblemError(msg)
    return tuple(names)


@dataclass(eq=False)
class _Work:
    """The answers to different questions: starts and goals, shape ``(n, 2)`` each."""

    map: Map
    starts: FloatArray
    goals: FloatArray
    tolerance: float
    tell: Tell
    n_solves: int = 0
    most_solves: int = 0
    n_own: int = 0

    def answers(self) -> list[Solution]:
        """Answer group by group: questions with a common goal, or with a common start if that makes fewer groups."""
        solutions: list[Solution | None] = [None] * len(self.starts)
        same = (self.starts == self.goals).all(axis=1)
        for number in np.flatnonzero(same).tolist():
            solutions[number] = trivial_solution(self._problem(number), NAME)
        if same.all():
            return [one for one in solutions if one is not None]
        load_kernels(MapKind.of(self.map.problem.model))
        by_goal, by_start = (np.unique(points, axis=0, return_inverse=True) for points in (self.goals, self.starts))
        backwards = len(by_start[0]) < len(by_goal[0])
        ends, group = by_start if backwards else by_goal
        for number, end in enumerate(ends.tolist()):
            members = np.flatnonzero((np.reshape(group, -1) == number) & ~same)
            if not len(members):
                continue
            others = (self.goals if backwards else self.starts)[members]
            found = self._group((end[0], end[1]), others)
            for at, member in enumerate(members.tolist()):
                solutions[member] = self._answer(member, found, at, backwards=backwards)
            self.tell(f"{number + 1} of {len(ends)} goals")
        return [one for one in solutions if one is not None]

    def _problem(self, number: int) -> Problem:
        start, goal = (tuple(points[number].tolist()) for points in (self.starts, self.goals))
        return replace(self.map.problem, start=start, goal=goal)

    def _answer(self, number: int, found: _Found, at: int, *, backwards: bool) -> Solution:
        """Turn a path and a bound into an answer, with a proof of its own where the gap is too wide."""
        problem, judged, bound = self._problem(number), found.judged[at], float(found.bounds[at])
        mine = Solution(Status.FAILED, solver=NAME, problem=problem, projection=problem.projection)
        if found.apart[at]:
            return replace(mine, status=Status.NO_PATH, lower_bound=math.inf, message="proven: there is no path")
        path, note = found.paths[at][::-1] if backwards else found.paths[at], ""
        if judged is None or not judged.cost <= bound * (1.0 + self.tolerance):
            self.n_own += 1
            own, note = self._own(problem, path), "a proof of its own"
            # (NaN where nothing is proven)
            bound = max(own.lower_bound, bound) if own.lower_bound > 0.0 else bound or math.nan
            if judged is None or own.cost < judged.cost:
                return replace(own, lower_bound=bound, message=f"{note}: {own.message}")
        return replace(
            mine,
            status=Status.FOUND,
            path=path,
            cost=judged.cost,
            length=judged.length,
            risk=judged.risk,
            clearance=judged.clearance,
            lower_bound=min(bound, judged.cost),
            message=note,
        )

    def _own(self, problem: Problem, path: FloatArray) -> Solution:
        """Prove an answer by itself: on the grid of the map, from the given path if there is one, or as any problem."""
        ground = self.map.ground(COARSE)
        in_tube = len(self.starts) >= MANY
        proof = None if ground is None else ground.proof(problem, self.tolerance, path, in_tube=in_tube)
        if proof is None and is_separated(problem.relaxed()):
            return Solution(Status.NO_PATH, lower_bound=math.inf, message="there is no path", problem=problem)
        if proof is None or not proof.reached or proof.path is None:
            return solve(problem, "hybrid", tolerance=self.tolerance)
        found = Solution(Status.FOUND, path=proof.path, cost=proof.upper_bound, solver=NAME, certificate=proof)
        return problem.judge(replace(found, lower_bound=proof.lower_bound))

    def _group(self, end: Point, others: FloatArray) -> _Found:
        """Find paths and bounds between one point and others, with one surface."""
        count = len(others)
        numbers = np.full(count, math.inf), np.zeros(count), np.zeros(count, dtype=np.bool_)
        found = _Found([np.empty((0, 2))] * count, [None] * count, *numbers)
        surface = self._surface(end, others)
        if surface is None:
            return found
        more = surface.solve()
        silent, found.apart = surface.states(others)
        asked = np.flatnonzero(~silent & ~found.apart)
        for number, path in zip(asked.tolist(), surface.paths(others[asked]), strict=True):
            found.offer(number, self.map.problem, path)
        while True:
            self._bound(surface, others, found, found.open(self.tolerance))
            if not len(found.open(self.tolerance)) or not more or surface.n_solves == MOST_SOLVES:
                break
            more = surface.solve()
        for number in found.open(self.tolerance).tolist():
            found.offer(number, self.map.problem, refined(self.map.problem, found.paths[number], self.tolerance))
        # (with better paths, fewer charges are met)
        self._bound(surface, others, found, found.open(self.tolerance))
        self.n_solves += surface.n_solves
        self.most_solves = max(self.most_solves, surface.n_solves)
        return found

    def _bound(self, surface: GoalSurface | CellSurface, others: FloatArray, found: _Found, asked: IntArray) -> None:
        if len(asked):
            bounds = surface.bounds(others[asked], found.costs[asked])
            found.bounds[asked] = np.maximum(found.bounds[asked], bounds)

    def _surface(self, end: Point, others: FloatArray) -> GoalSurface | CellSurface | None:
        """Prepare a surface of costs-to-go; None where none proves anything."""
        problem = self.map.problem
        if not problem.field.is_proper:
            return None
        fewest = next((steps for count, steps in STEPS.items() if len(others) >= count), None)
        if fewest is None:
            return None
        cells = CellSurface.towards(problem, end, usual_cells(problem))
        if cells is not None and not cells.proof.loose:
            return cells
        most = int(math.sqrt(min(usual_cells(problem), MAX_CELLS)))
        steps = min(max(round(fewest * math.sqrt(TOLERANCE / self.tolerance)), 128), most)
        ground = self.map.ground(steps)
        if ground is None:
            return None
        away = np.hypot(*(others - end).T)
        farthest = tuple(others[int(np.argmax(away))].tolist())
        return GoalSurface.towards(ground, end, farthest, WORTH * self.tolerance * float(np.median(away)))
