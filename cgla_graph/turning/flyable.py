"""Paths that an aircraft can fly: no turn is tighter than a radius, and how far that is from the best is proven."""

import math
import time
from dataclasses import dataclass, field, replace
from functools import cache

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import finite_number, positive_number
from cgla_graph.certificate.certificate import prove
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.model.small_problem import MapKind, small_problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.turning.bending import IDLE, STAGES, bent, candidates, dubins
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.timing import Timing, timed

#: Curves that are bent to the end cost at most so many times as much as the best one after the first stage.
CLOSE = 1.01
#: Polylines that are exported are no closer to the curve than this part of the turn radius.
FINEST = 1e-6
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
        As given, degrees clockwise from north (the y axis); None where it was left open.
    path
        The curve as waypoints whose segments are within 1e-4 of the turn radius of it, shape ``(m, 2)``, map units;
        `waypoints` has other tolerances.
    """

    turn_radius: float = field(default=math.nan, kw_only=True)
    curve: Curve = field(default_factory=Curve, kw_only=True)
    start_heading: float | None = field(default=None, kw_only=True)
    goal_heading: float | None = field(default=None, kw_only=True)

    def waypoints(self, tolerance: float | None = None) -> tuple[FloatArray, float]:
        """
        Return waypoints that an autopilot flies straight between, and how far from the curve that may be at most.

        The polyline itself stays inside the bounds and outside of the area, and keeps the clearance: chords of arcs are
        taken if they do, else tangents, which leave more room inside of turns; and where neither do, they are made
        finer.

        Parameters
        ----------
        tolerance
            Map units, above 0; None: a hundredth of the turn radius.

        Returns
        -------
        waypoints, tolerance
            Shape ``(m, 2)``, map units, and the tolerance that it took.

        Raises
        ------
        ProblemError
            If there is no path, the tolerance is not above 0, or no polyline within a millionth of the turn radius may
            be flown.

        Examples
        --------
        >>> import shapely
        >>> problem = Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.box(0.4, -0.1, 0.6, 0.5))
        >>> found = plan_flyable(problem, np.empty((0, 2)), 0.1)
        >>> waypoints, tolerance = found.waypoints()
        >>> tolerance, problem.evaluate(waypoints).feasible
        (0.001, True)
        """
        if not self.status.has_path:
            msg = f"there is no path to make waypoints of: {self.status.value}"
            raise ProblemError(msg)
        within = 0.01 * self.turn_radius if tolerance is None else positive_number("tolerance", tolerance)
        if not len(self.curve.pieces):
            return self.path, within
        while True:
            for points in (self.curve.points(within), self.curve.points_around(within)):
                if self.problem is None or self.problem.evaluate(points).feasible:
                    return points, within
            within *= 0.5
            if within < FINEST * self.turn_radius:
                msg = (
                    f"no polyline within {within:.3g} of the curve stays outside of the no-fly area and inside the "
                    "bounds; plan with a clearance"
                )
                raise ProblemError(msg)

    def timed(self, airspeed: float, *, wind: Point = (0.0, 0.0), power: float | None = None) -> Timing:
        """
        Return how long it takes at constant airspeed in a constant wind (`cgla_graph.turning.timing.timed`).

        Examples
        --------
        >>> path = plan_flyable(Problem((0, 0), (100, 0), bounds=(0, -9, 100, 9)), np.empty((0, 2)), 1)
        >>> round(path.timed(10, wind=(-5, 0), power=360).energy, 6)
        2.0
        """
        return timed(self.curve, airspeed, wind=wind, power=power)


def flyable(
    solution: Solution, turn_radius: float, *, start_heading: float | None = None, goal_heading: float | None = None
) -> Flyable:
    """
    Plan a path of lines and arcs that turns no tighter than a radius, beginning from the path of a solution.

    It is tangent everywhere, inside the bounds, outside of the no-fly area and as far from it as the clearance, and
    bent until it costs least. As the `lower_bound` of the solution holds for every path, it holds for this one: its
    gap is proven.

    Parameters
    ----------
    solution
        The answer of a solver to a `Problem`; where it has no path, the search begins without one.
    turn_radius
        Map units (metres on a map in longitude and latitude), above 0.
    start_heading, goal_heading
        Where it leads at its ends, degrees clockwise from north (the y axis); None: anywhere.

    Returns
    -------
    flyable
        A solution whose numbers are those of its lines and arcs. If none was found, its status is ``NOT_FOUND``, and
        its message says how far the search came: that is no proof that there is none.

    Raises
    ------
    ProblemError
        If the radius is not positive, a heading is not finite, risk has peaks above 1, or the solution is of a graph
        or has lost its problem.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> import shapely
    >>> problem = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.box(0.4, -0.1, 0.6, 0.5))
    >>> found = cg.flyable(cg.solve(problem), turn_radius=0.1)
    >>> found.status.label, bool(found.lower_bound <= found.cost <= 1.2 * found.lower_bound)
    ('found', True)
    """
    problem = solution.problem
    if not isinstance(problem, Problem):
        what = "has lost its problem on the way from another process" if problem is None else "is one on a graph"
        msg = f"this solution {what}; solve the Problem itself: cgla_graph.flyable(cgla_graph.solve(problem), …)"
        raise ProblemError(msg)
    path = solution.path if solution.status.has_path else np.empty((0, 2))
    return plan_flyable(
        problem,
        path,
        turn_radius,
        start_heading=start_heading,
        goal_heading=goal_heading,
        bound=solution.lower_bound,
    )


def plan_flyable(
    problem: Problem,
    path: FloatArray,
    turn_radius: float,
    *,
    start_heading: float | None = None,
    goal_heading: float | None = None,
    bound: float = math.nan,
    certify: bool = True,
) -> Flyable:
    """
    Plan a path that turns no tighter than a radius.

    Parameters
    ----------
    problem
        The problem; its bounds, its no-fly area and its clearance hold for the curve itself.
    path
        A polyline to begin with, shape ``(m, 2)``, map units; it may be empty.
    turn_radius
        Map units, above 0.
    start_heading, goal_heading
        Where the path leads at its ends, degrees clockwise from north (the y axis); None: anywhere.
    bound
        A proven lower bound of the cost of every path.
    certify
        Whether one is proven where `bound` is NaN.

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
    >>> found = plan_flyable(problem, np.empty((0, 2)), 0.1)
    >>> found.status.label, found.curve.least_radius, bool(0.0 < found.gap < 0.2)
    ('found', 0.1, True)
    """
    radius = positive_number("turn_radius", turn_radius)
    first, last = _direction("start_heading", start_heading), _direction("goal_heading", goal_heading)
    if not problem.field.is_proper:
        msg = "the risk has peaks above 1, so that weights may be negative; curves are bent where none is"
        raise ProblemError(msg)
    load_kernels(MapKind.of(problem.model))
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
    answer = replace(blank, status=Status.FOUND, curve=found, path=np.array([problem.start]))
    waypoints = answer.waypoints(CHORD * radius)[0]
    if certify and math.isnan(bound):
        bound = prove(problem, waypoints).lower_bound
    return replace(
        answer,
        path=waypoints,
        cost=judged.cost,
        length=judged.length,
        risk=judged.risk,
        clearance=judged.clearance,
        lower_bound=bound,
        seconds=seconds,
        certificate_seconds=time.perf_counter() - began,
    )


@cache
def load_kernels(kind: MapKind) -> None:
    """
    Have the kernels compiled, or loaded, once in a process: the time of a path is that of finding it.

    Examples
    --------
    >>> load_kernels(MapKind())
    """
    # (walls have kernels of their own, but hardly any)
    problem = small_problem(kind._replace(walls=True))
    for headings in ((None, None), ((1.0, 0.0), (1.0, 0.0))):
        _found(problem, np.array([problem.start, (0.5, 0.9), problem.goal]), 0.05, *headings)


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
        # (of curves that cost as good as the same, the last one has fewer arcs)
        for bend in (curve, *finer):
            judged = bend.evaluate(problem)
            if judged.feasible and judged.cost < (1.0 + 2.0 * IDLE) * cost:
                found, cost = bend, judged.cost
    return found, why


def _judged(problem: Problem, curve: Curve) -> Evaluation:
    """Judge a curve; one without pieces is the start, which is the goal."""
    return curve.evaluate(problem) if len(curve.pieces) else problem.evaluate([problem.start])


def _direction(name: str, heading: float | None) -> Point | None:
    """Return the unit vector of a heading in degrees clockwise from north."""
    if heading is None:
        return None
    angle = math.radians(finite_number(name, heading))
    return math.sin(angle), math.cos(angle)
