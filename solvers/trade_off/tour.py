"""A path that visits several places, in order or in the best order, with a bound of all such paths."""

import dataclasses
import itertools
import math
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._progress import showing
from cgla_graph._text import counted, json_number, listed
from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph._validate import choice, instance, number_array, point_array
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.solution import TOLERANCE, Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import proven
from cgla_graph.solvers.trade_off.held_karp import cheapest_order
from cgla_graph.solvers.trade_off.reweighing import solve_or_fail

#: Order of the places: as given, or the cheapest one.
Order: TypeAlias = Literal["given", "best"]
ORDERS: tuple[Order, ...] = get_args(Order)
#: Places of which the best order is found, at most: time and memory double with each.
MOST_PLACES = 12
#: Sums of bounds are lowered by this ratio, for their rounding.
_ROUNDING = 1e-12


@dataclass(frozen=True, eq=False, repr=False)
class Tour(Solution):
    """
    A path that visits places between start and goal; its numbers are those of the whole path.

    Attributes
    ----------
    lower_bound
        In the given order, the sum of the proven bounds of the legs. In the best order, the least such sum over all
        orders: no path that visits the places, in any order, costs less.
    places
        The places as given, shape ``(n, 2)``, map units.
    order
        Numbers of the places in the order in which they are visited, from 0. Of equal places, and of those at the end
        of a leg, the first one counts, and the others follow it.
    rule
        ``"given"`` or ``"best"``.
    legs
        The solutions of the legs, in order of flight, each with its bound and certificate; those of length 0 are left
        out.
    n_solved
        Legs that were planned and proven to find the best order.
    """

    places: FloatArray = field(default_factory=lambda: np.empty((0, 2)), kw_only=True)
    order: tuple[int, ...] = field(default=(), kw_only=True)
    rule: Order = field(default="given", kw_only=True)
    legs: tuple[Solution, ...] = field(default=(), kw_only=True)
    n_solved: int = field(default=0, kw_only=True)

    def document(self) -> dict[str, Any]:
        """Return order and legs as JSON; numbers that are not finite are None."""
        names = ("length", "risk", "cost", "clearance", "lower_bound", "gap")
        return {
            "rule": self.rule,
            "places": self.places.tolist(),
            "order": list(self.order),
            "legs": [
                {
                    "start": list(leg.path[0].tolist()) if leg.status.has_path else None,
                    "goal": list(leg.path[-1].tolist()) if leg.status.has_path else None,
                    "status": leg.status.label,
                    **{name: json_number(float(getattr(leg, name))) for name in names},
                }
                for leg in self.legs
            ],
            "legs_solved": self.n_solved,
        }


def tour(
    problem: Problem,
    places: ArrayLike,
    *,
    order: Order = "given",
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = TOLERANCE,
    refine: bool = False,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> Tour:
    """
    Plan a path from start to goal that visits places, in the given or in the best order.

    Each leg is planned by the solver and proven. The bound of the given order is the sum of the bounds of its legs;
    that of the best order the least such sum over all orders, found exactly by dynamic programming (Held and Karp,
    1962). Legs that cannot be part of a cheapest order, even at the length of the straight line, are neither planned
    nor proven. If start and goal are the same, it is a round trip.

    Parameters
    ----------
    problem
        The map, with start and goal.
    places
        Shape ``(n, 2)``, map units (on a map in degrees ``problem.projection.forward(lonlat)``); n is 12 at most for
        the best order. A place equal to the one before is visited with it, and in the best order one equal to any
        other, or to an end.
    order
        ``"given"`` or ``"best"``.
    solver
        A name or a solver; None: `hybrid`.
    resolution
        As of `cgla_graph.solve`.
    tolerance
        Wanted gap of each leg's bound; None for the bound of straight lines alone.
    refine, **settings
        As of `cgla_graph.solve`.

    Returns
    -------
    tour
        Judged by the oracle. If a leg has no path, its status and message say which one, and the bound is infinite if
        that is proven.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If a place is malformed, outside the bounds, inside the no-fly area or too near to it, there are too many, or
        the risk has peaks above 1.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> problem = cg.Problem((0.1, 0.1), (0.1, 0.1))
    >>> corners = [(0.9, 0.9), (0.9, 0.1), (0.1, 0.9)]
    >>> in_order, best = cg.tour(problem, corners), cg.tour(problem, corners, order="best")
    >>> [round(found.length, 3) for found in (in_order, best)], best.order, best.gap < 1e-9
    ([3.863, 3.2], (2, 0, 1), True)
    """
    instance("problem", problem, Problem, problem_wanted)
    choice("order", order, ORDERS)
    if not problem.field.is_proper:
        msg = "the risk has peaks above 1, so the cost of a leg may be negative; give peaks of at most 1"
        raise ProblemError(msg)
    points = number_array("places", places)
    points = point_array("places", points) if points.size else np.empty((0, 2))
    if points.ndim != 2:  # noqa: PLR2004 - a list of points
        msg = f"places has the shape {points.shape}; give one row per place, shape (n, 2)"
        raise ProblemError(msg)
    for number, place in enumerate(points.tolist(), start=1):
        _check_place(problem, (place[0], place[1]), number)
    if solver is None:
        # it proves its own path
        solver, settings = "hybrid", {"tolerance": tolerance, **settings}
    legs = _Legs(problem, registry.ready(solver, settings), resolution, tolerance, refine=refine)
    began = time.perf_counter()
    with showing("planning a tour"):
        found = _in_order(legs, points) if order == "given" else _in_best_order(legs, points)
    return dataclasses.replace(found, seconds=time.perf_counter() - began - found.certificate_seconds)


def _check_place(problem: Problem, place: Point, number: int) -> None:
    """Refuse a place where no path may be, as a start would be refused."""
    try:
        dataclasses.replace(problem, start=place, goal=place)
    except ProblemError as error:
        msg = f"place {number} {str(error).removeprefix('start ')}"
        raise ProblemError(msg) from error


class _Legs:
    """Legs between pairs of places, each planned and proven once: costs are the same in both directions."""

    def __init__(
        self,
        problem: Problem,
        solver: Solver,
        resolution: int | tuple[int, int] | Lattice,
        tolerance: float | None,
        *,
        refine: bool,
    ) -> None:
        self.problem, self.solver, self.tolerance = problem, solver, tolerance
        self.how: dict[str, Any] = {"resolution": resolution, "refine": refine}
        self.solved: dict[tuple[Point, Point], Solution] = {}

    def least(self, start: Point, goal: Point) -> float:
        """Return a bound without a proof: the straight line."""
        return dataclasses.replace(self.problem, start=start, goal=goal).least_length

    def between(self, start: Point, goal: Point) -> Solution:
        """Return the leg from one place to another."""
        ends = (start, goal) if start <= goal else (goal, start)
        if ends not in self.solved:
            problem = dataclasses.replace(self.problem, start=ends[0], goal=ends[1])
            found = solve_or_fail(problem, self.solver, **self.how)
            if self.tolerance is not None:
                found = proven(problem, found, self.tolerance)
            least = problem.least_length * (1.0 - _ROUNDING)
            if not found.lower_bound >= least:
                found = dataclasses.replace(found, lower_bound=least)
            self.solved[ends] = found
        leg = self.solved[ends]
        return leg if ends == (start, goal) else dataclasses.replace(leg, path=leg.path[::-1], nodes=leg.nodes[::-1])


def _in_order(legs: _Legs, places: FloatArray) -> Tour:
    """Plan the legs between places in the given order."""
    problem = legs.problem
    stops = [problem.start, *((x, y) for x, y in places.tolist()), problem.goal]
    names = ["the start", *(f"place {number + 1}" for number in range(len(places))), "the goal"]
    flown = _flown(legs, stops, names)
    bound = math.fsum(leg.lower_bound for leg in flown.values()) * (1.0 - _ROUNDING)
    return _joined(legs, places, tuple(range(len(places))), flown, bound, "given")


def _flown(legs: _Legs, stops: Sequence[Point], names: Sequence[str]) -> dict[str, Solution]:
    """Return the legs between stops in order, by the names of their ends; those of length 0 are left out."""
    ways = zip(itertools.pairwise(stops), itertools.pairwise(names), strict=True)
    return {" and ".join(ends): legs.between(*way) for way, ends in ways if way[0] != way[1]}


def _in_best_order(legs: _Legs, places: FloatArray) -> Tour:
    """Plan the legs of the cheapest order, and bound all orders."""
    stops, member = _different(legs.problem, places)
    n = len(stops) - 2
    if n > MOST_PLACES:
        msg = f"there are {n} places, and the best order is found of {MOST_PLACES} at most; give them in order"
        raise ProblemError(msg)
    least = np.array([[legs.least(one, other) for other in stops] for one in stops])
    costs, bounds = least.copy(), least * (1.0 - _ROUNDING)
    known = np.eye(n + 2, dtype=bool)
    while True:
        # legs that are not planned yet cost no less: a cheapest order of planned ones is cheapest of all
        (order, _), (_, bound) = found = cheapest_order(costs), cheapest_order(bounds)
        ways = [(n, *one, n + 1) for one, _ in found]
        wanting = [pair for way in ways for pair in itertools.pairwise(way) if not known[pair]]
        if not wanting:
            break
        for one, other in dict.fromkeys(wanting):
            leg = legs.between(stops[one], stops[other])
            for pair in ((one, other), (other, one)):
                known[pair] = True
                costs[pair] = leg.cost if leg.status.has_path else math.inf
                bounds[pair] = leg.lower_bound
    numbers = [np.nonzero(member == stop)[0].tolist() for stop in (-1, *order, -2)]
    names = ["the start", *(f"place {number[0] + 1}" for number in numbers[1:-1]), "the goal"]
    flown = _flown(legs, [stops[one] for one in ways[0]], names)
    return _joined(legs, places, tuple(itertools.chain(*numbers)), flown, bound * (1.0 - _ROUNDING), "best")


def _different(problem: Problem, places: FloatArray) -> tuple[list[Point], IntArray]:
    """Return the different places and both ends, and each place's number there: -1 at the start, -2 at the goal."""
    ends = {problem.goal: -2, problem.start: -1}
    numbers: dict[Point, int] = {}
    member = [
        ends[place] if place in ends else numbers.setdefault(place, len(numbers))
        for place in ((x, y) for x, y in places.tolist())
    ]
    return [*numbers, problem.start, problem.goal], np.array(member, dtype=np.int64)


def _joined(
    legs: _Legs, places: FloatArray, order: tuple[int, ...], flown: Mapping[str, Solution], bound: float, rule: Order
) -> Tour:
    """Join legs to one path, and have the oracle judge it."""
    problem, solver = legs.problem, legs.solver.traits.name
    failed = next((ends for ends, leg in flown.items() if not leg.status.has_path), None)
    proofs = [leg.certificate for leg in legs.solved.values() if isinstance(leg.certificate, Certificate)]
    numbers: dict[str, Any] = {
        "solver": solver,
        "build_seconds": 0.0,
        "certificate_seconds": math.fsum(leg.certificate_seconds for leg in legs.solved.values()),
        "evaluations": sum(leg.evaluations for leg in legs.solved.values()),
    }
    if failed is None:
        path = np.vstack([np.array([problem.start]), *(leg.path[1:] for leg in flown.values())])
        judged = problem.judge(Solution(Status.FOUND, path=path, **numbers))
        message = judged.message or _doubled(problem, places, rule)
    else:
        leg = flown[failed]
        message = f"no path was found between {failed}: {leg.message or leg.status.value}"
        status = Status.NO_PATH if math.isinf(bound) else Status.NOT_FOUND
        judged = problem.judge(Solution(status, message=message, **numbers))
    unreached = sum(not proof.reached for proof in proofs)
    if unreached:
        message = "; ".join(filter(None, [message, f"{counted(unreached, 'leg')} not proven as tightly as asked for"]))
    known = {one.name: getattr(judged, one.name) for one in dataclasses.fields(Solution)}
    known |= {"message": message, "lower_bound": bound}
    more: dict[str, Any] = {"places": places, "order": order, "rule": rule, "legs": tuple(flown.values())}
    return Tour(**known, **more, n_solved=len(legs.solved))


def _doubled(problem: Problem, places: FloatArray, rule: Order) -> str:
    """Return which places are visited together with another one."""
    seen: list[Point] = [problem.start]
    found = []
    for number, place in enumerate(((x, y) for x, y in places.tolist()), start=1):
        if place == seen[-1] or (rule == "best" and place in {*seen, problem.goal}):
            found.append(str(number))
        seen.append(place)
    if rule == "given" and len(places) and seen[-1] == problem.goal and str(len(places)) not in found:
        found.append(str(len(places)))
    return f"visited together with an end or another place: place {listed(found, 5)}" if found else ""
