"""What the command `check` computes: a plan leg by leg, what it crosses, and how much better one could be."""

import dataclasses
import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph._validate import positive_number
from cgla_graph.airspace.flight_plans.crossings import Crossing, Crossings, crossings_of, geodesic_gaps
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.certificate.certificate import MAX_CELLS, Certificate
from cgla_graph.comparisons.cli.check_bracket import Through, bracket, shut_ends, through
from cgla_graph.comparisons.cli.check_map import CheckMap
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import ROUNDING
from cgla_graph.model.earth import geodesic_between

#: Crossings that a shift by this would undo do not count, metres: autopilots keep places to 1e-7 degrees.
ROUNDED = 0.01
#: The bracket of the best possible cost is at most so wide, unless told otherwise.
TOLERANCE = 0.01
#: Legs for which a bound is proven, at most, unless told otherwise; the others count with their straight lines.
MOST_PROVEN = 16
#: Where legs are held against geodesics: at these shares of their lengths.
_SHARES = (0.25, 0.5, 0.75)


@dataclass(frozen=True, eq=False)
class Checked:
    """
    A plan that was checked.

    Attributes
    ----------
    file
        Its name.
    plan, on
        The plan, and the map that it is on.
    lengths, risks
        Of each leg, shape ``(n,)``; lengths in map units.
    crossings
        What it crosses.
    gaps
        How far each leg is from the geodesic between its ends, metres, at most; 0 on a map in the plane.
    proof
        The proven bracket of the least cost that a clean plan between the same ends may have; None without one.
    no_proof
        Why there is none.
    through
        A bound of the cost of every clean plan through the same waypoints; None without one.
    """

    file: str
    plan: FlightPlan
    on: CheckMap
    lengths: FloatArray
    risks: FloatArray
    crossings: Crossings
    gaps: FloatArray
    proof: Certificate | None = None
    no_proof: str = ""
    through: Through | None = None

    @property
    def k(self) -> float:
        """The risk weight."""
        return self.on.scenario.problem.k

    @property
    def length(self) -> float:
        """Of the whole plan, map units."""
        return float(self.lengths.sum())

    @property
    def risk(self) -> float:
        """Of the whole plan."""
        return float(self.risks.sum())

    @property
    def cost(self) -> float:
        """``length + k * risk``."""
        return self.length + self.k * self.risk

    @cached_property
    def outside(self) -> BoolArray:
        """Which legs leave the map, shape ``(n,)``."""
        problem, route = self.on.scenario.problem, self.on.route
        away = ~problem.in_bounds(route) & self.on.has_bounds
        return np.asarray(away if len(route) == 1 else away[:-1] | away[1:])

    @cached_property
    def near(self) -> BoolArray:
        """Which legs come nearer to an area than the clearance that is asked for, shape ``(n,)``."""
        return np.asarray(self.crossings.clearances < self.on.scenario.problem.clearance - rounding_on(self.on))

    @cached_property
    def crossing(self) -> BoolArray:
        """Which legs cross an area, shape ``(n,)``."""
        found = np.zeros(len(self.lengths), dtype=bool)
        found[self.crossings.legs] = True
        return found

    @property
    def circles(self) -> list[Crossing]:
        """The circles around waypoints that reach into an area."""
        return [one for one in self.crossings.found if one.is_circle]

    @property
    def uprights(self) -> list[Crossing]:
        """Where it goes up or down inside an area, above one place."""
        return [one for one in self.crossings.found if one.is_upright]

    @property
    def faulty(self) -> BoolArray:
        """Which legs are not clean, shape ``(n,)``."""
        return np.asarray(self.crossing | self.outside | self.near)

    @property
    def most_to_gain(self) -> float:
        """How much more it costs than the proven bound, as a ratio; infinite where nothing is proven."""
        bound = 0.0 if self.proof is None else self.proof.lower_bound
        return max(self.cost / bound - 1.0, 0.0) if bound > 0.0 else math.inf

    @property
    def most_through(self) -> float:
        """The same for plans through its waypoints."""
        bound = 0.0 if self.through is None else self.through.lower_bound
        return max(self.cost / bound - 1.0, 0.0) if bound > 0.0 else math.inf

    @property
    def is_straight(self) -> bool:
        """Whether every leg is clean, flown as it is drawn."""
        return not (self.faulty.any() or self.circles or self.uprights)

    @property
    def is_clean(self) -> bool:
        """Whether nothing is wrong with the plan, and nothing in it is flown otherwise than it was checked."""
        return self.is_straight and not self.plan.curves


def rounding_on(on: CheckMap) -> float:
    """Return how much of a crossing is rounding only, map units."""
    x_min, y_min, x_max, y_max = on.scenario.problem.bounds
    return ROUNDED if on.scenario.projection is not None else ROUNDING * max(x_max - x_min, y_max - y_min)


def check_plan(
    plan: FlightPlan,
    file: str,
    on: CheckMap,
    *,
    tolerance: float | None = TOLERANCE,
    max_cells: int = MAX_CELLS,
    most_proven: int = MOST_PROVEN,
) -> Checked:
    """
    Check a plan, and prove how much better one could be.

    Parameters
    ----------
    plan, file
        The plan, and what its file is called.
    on
        The map that it is on.
    tolerance
        How wide the proven bracket of the least cost may be, as a ratio; None for no proof.
    max_cells
        As of `cgla_graph.lower_bound`.
    most_proven
        For so many legs at most, a bound is proven of plans through the waypoints.

    Raises
    ------
    CglaError
        If a setting is out of range.
    """
    if tolerance is not None:
        positive_number("--tolerance", tolerance)
    route, problem = on.route, on.scenario.problem
    starts, ends = (route, route) if len(route) == 1 else (route[:-1], route[1:])
    checked = Checked(
        file,
        plan,
        on,
        lengths=np.hypot(*(ends - starts).T),
        risks=np.asarray(problem.field.line_integral(starts, ends)),
        crossings=crossings_of(route, on.areas, rounding=rounding_on(on), radii=_radii(plan, on), heights=on.heights),
        gaps=_gaps(on, starts, ends),
    )
    if tolerance is None:
        return checked
    if most_proven < 0:
        msg = f"--through is {most_proven}; give how many legs are proven at most, 0 or more"
        raise ProblemError(msg)
    costs = checked.lengths + problem.k * checked.risks
    found = through(on, costs, checked.faulty, tolerance, most_proven) if len(route) > 2 else None  # noqa: PLR2004 - one leg
    checked = dataclasses.replace(checked, through=found)
    if (route[0] == route[-1]).all():
        return dataclasses.replace(checked, no_proof="it ends where it begins: the best way there is to stay")
    shut = shut_ends(on)
    if shut:
        return dataclasses.replace(checked, no_proof=shut)
    try:
        return dataclasses.replace(checked, proof=bracket(on, tolerance, max_cells))
    except ProblemError as error:
        return dataclasses.replace(checked, no_proof=str(error))


def _radii(plan: FlightPlan, on: CheckMap) -> list[float]:
    """Return the circles flown around each place of the route; of waypoints in one place, the widest."""
    radii = [0.0] * len(on.route)
    at = 0
    for number, one in enumerate(plan.waypoints, start=1):
        while at + 1 < len(on.stops) and on.stops[at + 1] <= number:
            at += 1
        radii[at] = max(radii[at], one.loiter_radius)
    return radii


def _gaps(on: CheckMap, starts: FloatArray, ends: FloatArray) -> FloatArray:
    """Return how far legs are from geodesics."""
    projection = on.scenario.projection
    if projection is None:
        return np.zeros(len(starts))
    first, last = projection.inverse(starts), projection.inverse(ends)
    samples = [projection.forward(geodesic_between(first, last, share)) for share in _SHARES]
    return geodesic_gaps(np.stack([starts, ends], axis=1), samples)
