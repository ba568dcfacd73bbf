"""Paths that an aircraft can fly: no turn is tighter than a radius, and how far that is from the best is proven."""

import math
import time
from dataclasses import dataclass, field, replace

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import finite_number, positive_number
from cgla_graph.certificate.certificate import lower_bound
from cgla_graph.errors import ProblemError
from cgla_graph.flyable.bending import STAGES, bent, candidates, dubins
from cgla_graph.flyable.curve import Curve
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.solution import Solution, Status

#: Curves that are bent to the end cost at most so many times as much as the best one after the first stage.
CLOSE = 1.01
#: Waypoints of `Flyable.path` are within this part of the turn radius of the curve.
CHORD = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Flyable(Solution):
    """
    A path of lines and arcs that are tangent everywhere; all numbers are those of the curve itself.

    Attributes
    ----------
    turn_radius
        No arc has a smaller radius, map units.
    curve
        Its lines and arcs; without any if none was found.
    start_heading, goal_heading
        What was asked for, degrees clockwise from north (the y axis); None where it was left open.
    path
        The curve as waypoints whose segments are within 1e-4 of the turn radius of it, shape ``(m, 2)``, map units;
        `Curve.points` has other tolerances.
    """

    turn_radius: float = field(default=math.nan, kw_only=True)
    curve: Curve = field(default_factory=Curve, kw_only=True)
    start_heading: float | None = field(default=None, kw_only=True)
    goal_heading: float | None = field(default=None, kw_only=True)


def flyable(
    problem: Problem,
    path: FloatArray,
    turn_radius: float,
    *,
    start_heading: float | None = None,
    goal_heading: float | None = None,
    bound: float = math.nan,
) -> Flyable:
    """
    Plan a path that turns no tighter than a radius.

    Parameters
    ----------
    problem
        What is planned; its bounds, its no-fly area and its clearance hold for the curve itself.
    path
        A polyline to begin with, shape ``(m, 2)``, map units; it may be empty.
    turn_radius
        Map units, above 0.
    start_heading, goal_heading
        Where the path leads at its ends, degrees clockwise from north (the y axis); None: anywhere.
    bound
        A proven lower bound of the cost of every path; where it is NaN, one is proven.

    Returns
    -------
    flyable
        Of all curves that were found, the one of least cost. If none was, the status is ``NOT_FOUND``, and the message
        says how far they came: that is no proof that there is none.

    Raises
    ------
    ProblemError
        If the radius is not positive, a heading is not finite, or risk has peaks above 1.

    Examples
    --------
    >>> import shapely
    >>> problem = Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.box(0.4, -0.1, 0.6, 0.5))
    >>> found = flyable(problem, np.empty((0, 2)), 0.1)
    >>> found.status.label, found.curve.least_radius, bool(0.0 < found.gap < 0.2)
    ('found', 0.1, True)
    """
    radius = positive_number("turn_radius", turn_radius)
    first, last = _direction("start_heading", start_heading), _direction("goal_heading", goal_heading)
    if not problem.field.is_proper:
        msg = "the risk has peaks above 1, so that weights may be negative; curves are bent where none is"
        raise ProblemError(msg)
    began = time.perf_counter()
    blank = Flyable(
        Status.NOT_FOUND,
        solver="flyable",
        turn_radius=radius,
        start_heading=start_heading,
        goal_heading=goal_heading,
        projection=problem.projection,
        problem=problem,
    )
    found, why = _found(problem, path, radius, first, last)
    seconds = time.perf_counter() - began
    if found is None:
        return replace(blank, seconds=seconds, message=why)
    judged = _judged(problem, found)
    began = time.perf_counter()
    if math.isnan(bound):
        bound = lower_bound(problem).lower_bound
    return replace(
        blank,
        status=Status.FOUND,
        curve=found,
        path=found.points(CHORD * radius) if len(found.pieces) else np.array([problem.start]),
        cost=judged.cost,
        length=judged.length,
        risk=judged.risk,
        clearance=judged.clearance,
        lower_bound=bound,
        seconds=seconds,
        certificate_seconds=time.perf_counter() - began,
    )


def _found(
    problem: Problem, path: FloatArray, radius: float, first: Point | None, last: Point | None
) -> tuple[Curve | None, str]:
    """Return the best curve that was found, or None and why there is none."""
    if problem.start == problem.goal and (first is None or last is None or first == last):
        return Curve(), ""
    found: Curve | None = None
    cost = math.inf
    if first is not None and last is not None:
        found, is_best = dubins(problem, radius, first, last)
        if is_best:
            return found, ""
        cost = math.inf if found is None else found.evaluate(problem).cost
    roughly = []
    why = ""
    for candidate, reason in candidates(problem, path, radius, first, last):
        if candidate is None:
            why = reason
        else:
            roughly.append(bent(problem, candidate, radius, first, last, stages=1))
    least = min((value for _, _, value in roughly), default=math.inf)
    for points, curve, value in roughly:
        finer = [bent(problem, points, radius, first, last, stages=STAGES)[1]] if value <= CLOSE * least else []
        for bend in (curve, *finer):
            judged = bend.evaluate(problem)
            if judged.feasible and judged.cost < cost:
                found, cost = bend, judged.cost
    return found, why


def flyable_from(
    solution: Solution, turn_radius: float, *, start_heading: float | None = None, goal_heading: float | None = None
) -> Flyable:
    """
    Plan a flyable path from the answer of a solver, and keep its bound (see `Solution.flyable`).

    Raises
    ------
    ProblemError
        As `flyable`, or if the solution is of a graph, or has no problem.

    Examples
    --------
    >>> problem = Problem((0, 0), (1, 1))
    >>> flyable_from(Solution(Status.NO_PATH, problem=problem), 0.1).status.label
    'found'
    """
    problem = solution.problem
    if not isinstance(problem, Problem):
        what = "has lost its problem on the way from another process" if problem is None else "is one on a graph"
        msg = f"this solution {what}; solve the Problem itself: cgla_graph.solve(problem).flyable(…)"
        raise ProblemError(msg)
    path = solution.path if solution.status.has_path else np.empty((0, 2))
    headings = {"start_heading": start_heading, "goal_heading": goal_heading}
    return flyable(problem, path, turn_radius, **headings, bound=solution.lower_bound)


def _judged(problem: Problem, curve: Curve) -> Evaluation:
    """Judge a curve; one without pieces is the start, which is the goal."""
    return curve.evaluate(problem) if len(curve.pieces) else problem.evaluate([problem.start])


def _direction(name: str, heading: float | None) -> Point | None:
    """Return the unit vector of a heading in degrees clockwise from north."""
    if heading is None:
        return None
    angle = math.radians(finite_number(name, heading))
    return math.sin(angle), math.cos(angle)
