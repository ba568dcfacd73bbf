"""Many questions to one map: paths and proofs from many starts, to many goals, that share their work."""

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._progress import showing
from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import instance, number_array, point_array, positive_number, whole_number
from cgla_graph.certificate.answers import Answers
from cgla_graph.certificate.certificate import load_kernels, usual_cells
from cgla_graph.certificate.isochrones import Isochrones, isochrones_to
from cgla_graph.certificate.landmarks import Ground
from cgla_graph.certificate.many_cells import CellSurface
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.solution import NEGATIVE_WEIGHTS
from cgla_graph.solvers.grouped_questions import TOLERANCE, Questions

#: Cells along the longer side of the grid for isochrones, by default: on maps with cells of constant cost, where places
#: take longer, and on others.
ISOCHRONE_STEPS = {True: 128, False: 256}


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
        times at most. Paths go down that surface; where many of them keep a gap above the tolerance, they share finer
        surfaces in a tube around all that may be better; those above it are refined. What is still above it then, or
        begins so near to the goal that the surface says nothing, gets a proof of its own. So do
        questions that share an end with at most two others; bounds of the map leave a narrow tube to each of them,
        where the cost is not constant on cells. These proofs run side by side, on up to four cores.

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
            work = Questions(self.problem, self.ground, asked[:, :2], asked[:, 2:], tolerance, tell)
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
        >>> import math
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
        wrong = np.flatnonzero(~self.problem.in_bounds(points) | self.problem.model.area.contains(points))
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
