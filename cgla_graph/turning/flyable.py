"""Paths with a least turn radius, which an aircraft can fly, and their proven gap to the optimum."""

import math
import time
from dataclasses import dataclass, field, replace
from functools import cache
from typing import Any

import numpy as np

from cgla_graph._text import figure, json_number
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import finite_number, instance, positive_number
from cgla_graph.certificate.certificate import prove
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.problem import Problem
from cgla_graph.model.small_problem import small_problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.turning.bending import IDLE, STAGES, bent, candidates, dubins
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.timing import Timing, radius_over_ground, timed

#: A curve is bent to the end if it costs at most so many times as much as the best one after the first stage.
CLOSE = 1.01
#: Least tolerance of exported polylines, in parts of the turn radius.
FINEST = 1e-6
#: Turns that are tighter by at most this ratio are as wide: radii of arcs are rounded.
_ROUNDING = 1e-9
#: Waypoints of `Flyable.path` are within this part of the turn radius of the curve.
CHORD = 1e-4


@dataclass(frozen=True, eq=False, repr=False)
class Flyable(Solution):
    """
    A path of lines and arcs that join tangentially; all numbers are those of the curve itself.

    Attributes
    ----------
    turn_radius
        No arc has a smaller radius, map units.
    curve
        Its lines and arcs; empty if no curve was found.
    start_heading, goal_heading
        The given headings, degrees clockwise from north (the y axis); None for a free one.
    path
        The curve as waypoints whose segments are within 1e-4 of the turn radius of it, shape ``(m, 2)``, map units;
        `waypoints` takes other tolerances.
    """

    turn_radius: float = field(default=math.nan, kw_only=True)
    curve: Curve = field(default_factory=Curve, kw_only=True)
    start_heading: float | None = field(default=None, kw_only=True)
    goal_heading: float | None = field(default=None, kw_only=True)

    def waypoints(self, tolerance: float | None = None) -> tuple[FloatArray, float]:
        """
        Return waypoints with straight legs for an autopilot, and the greatest distance of the legs from the curve.

        The polyline itself stays inside the bounds and outside the area, and keeps the clearance: it has chords of the
        arcs if these are feasible, else tangents, which leave more room inside turns; if neither are, the tolerance is
        halved.

        Parameters
        ----------
        tolerance
            Map units, above 0; None: a hundredth of the turn radius.

        Returns
        -------
        waypoints, tolerance
            Shape ``(m, 2)``, map units, and the tolerance that was needed.

        Raises
        ------
        ProblemError
            If there is no path, the tolerance is not above 0, or no polyline within a millionth of the turn radius is
            feasible.

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
        Return the flight time at constant airspeed in a constant wind (`cgla_graph.turning.timing.timed`).

        Examples
        --------
        >>> path = plan_flyable(Problem((0, 0), (100, 0), bounds=(0, -9, 100, 9)), np.empty((0, 2)), 1)
        >>> round(path.timed(10, wind=(-5, 0), power=360).energy, 6)
        2.0
        """
        return timed(self.curve, airspeed, wind=wind, power=power)

    def wind_note(self, airspeed: float, wind: Point) -> str:
        """
        Return why an aircraft with this turn radius in still air cannot fly the path in a wind; empty if it can.

        At a fixed bank, turns with the wind behind are wider over ground
        (`cgla_graph.turning.timing.radius_over_ground`).

        Examples
        --------
        >>> path = plan_flyable(Problem((0, 0), (900, 0), bounds=(0, -500, 900, 500)), np.empty((0, 2)), 60)
        >>> path.wind_note(18, (8, 0))
        ''
        """
        needed = self.timed(airspeed, wind=wind).still_air_radius
        if needed >= self.turn_radius * (1.0 - _ROUNDING):
            return ""
        wide = radius_over_ground(self.turn_radius, airspeed, wind)
        return (
            f"not flyable in this wind at the bank that turns at {figure(self.turn_radius, 6)} in still air: it needs "
            f"turns of {figure(needed, 4)} in still air; with a turn radius of {figure(wide, 6)}, what that bank gives "
            "with the wind behind, it is flyable"
        )

    def document(
        self, airspeed: float | None = None, *, wind: Point = (0.0, 0.0), power: float | None = None
    ) -> dict[str, Any]:
        """
        Return the pieces of the curve as JSON, and its times where there are an airspeed and a path.

        Parameters
        ----------
        airspeed, wind, power
            As of `timed`; no airspeed, no times.

        Examples
        --------
        >>> path = plan_flyable(Problem((0, 0), (100, 0), bounds=(0, -9, 100, 9)), np.empty((0, 2)), 1)
        >>> document = path.document(10, wind=(-5, 0))
        >>> document["n_arcs"], document["flight_seconds"]
        (0, 20.0)
        """
        timing = None
        if airspeed is not None and self.status.has_path:
            timing = self.timed(airspeed, wind=wind, power=power)
        return {
            "turn_radius": self.turn_radius,
            "start_heading": self.start_heading,
            "goal_heading": self.goal_heading,
            "pieces": self.curve.pieces.tolist(),
            "n_arcs": len(self.curve.arcs),
            "least_radius": json_number(self.curve.least_radius),
            "airspeed": airspeed,
            "wind": list(wind),
            "power": power,
            "flight_seconds": None if timing is None else json_number(timing.seconds),
            "wind_note": "" if timing is None or airspeed is None else self.wind_note(airspeed, wind),
            "still_air_radius": None if timing is None else json_number(timing.still_air_radius),
            "ground_speed": None if timing is None else [timing.slowest, timing.fastest],
            "energy_wh": None if timing is None else json_number(timing.energy),
        }


def flyable(
    solution: Solution, turn_radius: float, *, start_heading: float | None = None, goal_heading: float | None = None
) -> Flyable:
    """
    Plan a path of lines and arcs with a least turn radius, beginning from the path of a solution.

    The pieces join tangentially, stay inside the bounds and outside the no-fly area, keep the clearance, and are bent
    until they cost least. The `lower_bound` of the solution holds for every path, so that the gap of this one is
    proven.

    Parameters
    ----------
    solution
        The answer of a solver to a `Problem`; if it has no path, the search begins without one.
    turn_radius
        Map units (metres on a map in longitude and latitude), above 0.
    start_heading, goal_heading
        Headings at the ends, degrees clockwise from north (the y axis); None: free.

    Returns
    -------
    flyable
        A solution whose numbers are those of its lines and arcs. If no curve was found, its status is ``NOT_FOUND``,
        and its message says how far the search came; that does not prove that there is none.

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
    instance("solution", solution, Solution, "a solution, as solve(problem)")
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
    Plan a path with a least turn radius.

    Parameters
    ----------
    problem
        The problem; its bounds, its no-fly area and its clearance hold for the curve itself.
    path
        A polyline to begin with, shape ``(m, 2)``, map units; it may be empty.
    turn_radius
        Map units, above 0.
    start_heading, goal_heading
        Headings at the ends, degrees clockwise from north (the y axis); None: free.
    bound
        A proven lower bound of the cost of every path.
    certify
        Whether to prove a bound if `bound` is NaN.

    Returns
    -------
    flyable
        The cheapest curve found. If none was, the status is ``NOT_FOUND``, and the message says how far the search
        came; that does not prove that there is none.

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
    # a curve without pieces is the start, which is the goal
    judged = found.evaluate(problem) if len(found.pieces) else problem.evaluate([problem.start])
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
    Compile or load the kernels, once in a process, so that no path is charged for it.

    Examples
    --------
    >>> load_kernels(MapKind())
    """
    # (always with walls, which need few further kernels)
    problem = small_problem(kind._replace(walls=True))
    for headings in ((None, None), ((1.0, 0.0), (1.0, 0.0))):
        _found(problem, np.array([problem.start, (0.5, 0.9), problem.goal]), 0.05, *headings)


def _found(
    problem: Problem, path: FloatArray, radius: float, first: Point | None, last: Point | None
) -> tuple[Curve | None, str]:
    """Return the best curve found, or None and why there is none."""
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
        # (of curves that cost almost the same, the last one has fewer arcs)
        for bend in (curve, *finer):
            judged = bend.evaluate(problem)
            if judged.feasible and judged.cost < (1.0 + 2.0 * IDLE) * cost:
                found, cost = bend, judged.cost
    return found, why


def _direction(name: str, heading: float | None) -> Point | None:
    """Return the unit vector of a heading in degrees clockwise from north."""
    if heading is None:
        return None
    angle = math.radians(finite_number(name, heading))
    return math.sin(angle), math.cos(angle)
