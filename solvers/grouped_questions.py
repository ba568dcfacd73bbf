"""Answers to many questions to one map, group by group: those with a common end share a surface."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from cgla_graph._progress import Tell
from cgla_graph._threads import side_by_side
from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph.certificate.certificate import MAX_CELLS, WORTH, is_separated, load_kernels, usual_cells
from cgla_graph.certificate.landmarks import COARSE, MANY, Ground, refined
from cgla_graph.certificate.many import MOST_SOLVES, GoalSurface
from cgla_graph.certificate.many_cells import CellSurface
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import trivial_solution
from cgla_graph.solvers.solving import solve

#: The gap that is asked for by default.
TOLERANCE = 0.01
#: Cells along the longer side of the grid for a gap of 1 %, by how many questions have their goal in common, at least;
#: for other gaps, the number goes with the root of the gap. Where fewer have, each is proven by itself.
STEPS = {24: 512, 6: 384, 4: 256}
#: Where so many questions are left, at least, they have a tube in common, on a grid with so many cells, and then more.
LEFT, JOINT = 16, (400_000, 1_200_000)
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


@dataclass(eq=False)
class Questions:
    """
    Different questions to one map, and how many surfaces and proofs their answers took.

    Attributes
    ----------
    problem
        The map.
    ground
        Returns its grid with so many cells along the longer side; None where no grid proves anything.
    starts, goals
        Shape ``(n, 2)`` each, map units.
    tolerance
        The gap that is asked for.
    tell
        Gets lines of progress.
    n_solves, most_solves, n_own
        Surfaces solved over the whole map, those for one goal at most, and proofs of single questions.
    """

    problem: Problem
    ground: Callable[[int], Ground | None]
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
        load_kernels(MapKind.of(self.problem.model))
        by_goal, by_start = (np.unique(points, axis=0, return_inverse=True) for points in (self.goals, self.starts))
        backwards = len(by_start[0]) < len(by_goal[0])
        ends, group = by_start if backwards else by_goal
        found: list[tuple[int, _Found, int]] = []
        for number, end in enumerate(ends.tolist()):
            members = np.flatnonzero((np.reshape(group, -1) == number) & ~same)
            if not len(members):
                continue
            of_group = self._group((end[0], end[1]), (self.goals if backwards else self.starts)[members])
            found += [(member, of_group, at) for at, member in enumerate(members.tolist())]
            self.n_own += len(of_group.open(self.tolerance))
            self.tell(f"{number + 1} of {len(ends)} goals")
        if self.n_own:
            # (each of several threads would lay it)
            self.ground(COARSE)
        # (a single proof uses all cores by itself)
        run = side_by_side if self.n_own > 1 else map
        answers = run(lambda one: self._answer(*one, backwards=backwards), found)
        for done, ((member, _, _), answer) in enumerate(zip(found, answers, strict=True)):
            solutions[member] = answer
            self.tell(f"{done + 1} of {len(found)} questions")
        return [one for one in solutions if one is not None]

    @property
    def _in_tube(self) -> bool:
        """Whether there are enough questions that landmarks pay for them."""
        return len(self.starts) >= MANY

    def _problem(self, number: int) -> Problem:
        start, goal = (tuple(points[number].tolist()) for points in (self.starts, self.goals))
        return replace(self.problem, start=start, goal=goal)

    def _answer(self, number: int, found: _Found, at: int, *, backwards: bool) -> Solution:
        """Turn a path and a bound into an answer, with a proof of its own where the gap is too wide."""
        problem, judged, bound = self._problem(number), found.judged[at], float(found.bounds[at])
        mine = Solution(Status.FAILED, solver=NAME, problem=problem, projection=problem.projection)
        if found.apart[at]:
            return replace(mine, status=Status.NO_PATH, lower_bound=math.inf, message="proven: there is no path")
        path, note = found.paths[at][::-1] if backwards else found.paths[at], ""
        if judged is None or not judged.cost <= bound * (1.0 + self.tolerance):
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
        ground = self.ground(COARSE)
        proof = None if ground is None else ground.proof(problem, self.tolerance, path, in_tube=self._in_tube)
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
            found.offer(number, self.problem, path)
        while True:
            self._bound(surface, others, found, found.open(self.tolerance))
            if not len(found.open(self.tolerance)) or not more or surface.n_solves == MOST_SOLVES:
                break
            more = surface.solve()
        self.n_solves += surface.n_solves
        self.most_solves = max(self.most_solves, surface.n_solves)
        few, many = JOINT
        self._bound_in_tube(surface, others, found, few)
        for number in found.open(self.tolerance).tolist():
            found.offer(number, self.problem, refined(self.problem, found.paths[number], self.tolerance))
        # (with better paths, fewer charges are met)
        self._bound(surface, others, found, found.open(self.tolerance))
        self._bound_in_tube(surface, others, found, many)
        return found

    def _bound_in_tube(self, whole: GoalSurface | CellSurface, others: FloatArray, found: _Found, cells: int) -> None:
        """If many questions are left, bound their paths on a finer grid, in one tube around all that may be better."""
        left = found.open(self.tolerance)
        left = left[np.isfinite(found.costs[left])]
        if len(left) < LEFT or isinstance(whole, CellSurface) or (coarse := self.ground(COARSE)) is None:
            return
        most = min(round(cells * TOLERANCE / self.tolerance), usual_cells(self.problem))
        surface = self._on(coarse.within(others[left], whole.goal, found.costs[left], most), whole.goal, others[left])
        while surface.solve() and surface.n_solves < MOST_SOLVES:
            pass
        self._bound(surface, others, found, left)

    def _bound(self, surface: GoalSurface | CellSurface, others: FloatArray, found: _Found, asked: IntArray) -> None:
        if len(asked):
            bounds = surface.bounds(others[asked], found.costs[asked])
            found.bounds[asked] = np.maximum(found.bounds[asked], bounds)

    def _surface(self, end: Point, others: FloatArray) -> GoalSurface | CellSurface | None:
        """Prepare a surface of costs-to-go; None where none proves anything."""
        problem = self.problem
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
        ground = self.ground(steps)
        return None if ground is None else self._on(ground, end, others)

    def _on(self, ground: Ground, end: Point, others: FloatArray) -> GoalSurface:
        away = np.hypot(*(others - end).T)
        farthest = tuple(others[int(np.argmax(away))].tolist())
        return GoalSurface.towards(ground, end, farthest, WORTH * self.tolerance * float(np.median(away)))
