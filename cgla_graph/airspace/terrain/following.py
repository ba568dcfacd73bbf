"""Plans that follow the ground: waypoints where they are needed, so that straight legs stay at a height above it."""

import dataclasses
import itertools
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, positive_number
from cgla_graph.airspace.flight_plans.plan import MOST_WAYPOINTS, FlightPlan, Waypoint
from cgla_graph.airspace.terrain.along import elevations_along
from cgla_graph.airspace.terrain.area import clearance_of
from cgla_graph.airspace.terrain.surface import Pieces, Surface, pieces_of
from cgla_graph.airspace.zones.ground import GROUND_WANTED, Ground
from cgla_graph.errors import PlanError, ProblemError
from cgla_graph.model.earth import DIGITS, LocalProjection

#: Default tolerance of the height above the ground, metres: a value of ours, a third of the default clearance.
TERRAIN_TOLERANCE: Final = 10.0
#: Part of the tolerance that waypoints use; the rest is for the ground between the places that are tested.
_USED, _BETWEEN = 0.8, 0.1
#: Intervals into which a piece of a leg is divided, at most.
_MOST_PARTS: Final = 1000


@dataclass(frozen=True)
class Followed:
    """
    A plan that follows the ground.

    Attributes
    ----------
    plan
        The plan.
    added
        Number of waypoints that were added.
    height
        Height of its waypoints above the ground, metres.
    tolerance, clearance
        Its legs, flown straight, are within the tolerance of the altitude that was asked for, and above the ground by
        the clearance, metres.
    """

    plan: FlightPlan
    added: int
    height: float
    tolerance: float
    clearance: float

    def summary(self) -> str:
        """Return the number of added waypoints and the heights that legs keep, in one line."""
        return (
            f"{self.added} waypoint{'s' * (self.added != 1)} added to follow the ground: straight legs stay within "
            f"{self.tolerance:g} m of the altitude, and {self.clearance:g} m above the ground"
        )


def follow_terrain(
    plan: FlightPlan, ground: Ground, *, tolerance: float | None = None, clearance: float | None = None
) -> Followed:
    """
    Add waypoints to a plan above ground, so that its legs, flown straight, stay at its altitude above the ground.

    Autopilots without elevations fly straight between waypoints whose altitude is above the ground below each. The
    ground is linear in both directions between the centres of cells, as autopilots interpolate it. From each waypoint,
    the next one is as far as the straight line between them allows.

    Parameters
    ----------
    plan
        A plan at one altitude above ground, as `FlightPlan.along` makes it with ``reference="ground"``.
    ground
        Elevations.
    tolerance
        Greatest deviation of straight legs from the altitude, metres; None for 10 m.
    clearance
        Least height of straight legs above the ground, metres; None for 30 m. Where it is above the altitude less the
        tolerance, waypoints are higher by up to half of the tolerance.

    Raises
    ------
    PlanError
        If the plan is in a plane, its waypoints are not at one altitude above ground, the elevation below a leg is not
        known, or it would have too many waypoints.
    ProblemError
        If the tolerance is not above 0, or the clearance is negative or above the altitude.

    Examples
    --------
    >>> hill = Ground(np.array([[0.0, 0.0, 0.0, 300.0, 0.0, 0.0, 0.0]]), (24.0, 60.0, 24.07, 60.01))
    >>> flat = FlightPlan.along([(24.005, 60.005), (24.065, 60.005)], altitude=80, reference="ground")
    >>> found = follow_terrain(flat, hill)
    >>> found.added, [round(one.x, 3) for one in found.plan.waypoints]
    (3, [24.005, 24.025, 24.035, 24.045, 24.065, 24.065])
    """
    instance("plan", plan, FlightPlan, "a FlightPlan, as FlightPlan.along(lonlat, altitude=80, reference='ground')")
    instance("ground", ground, Ground, GROUND_WANTED)
    most = TERRAIN_TOLERANCE if tolerance is None else positive_number("tolerance", tolerance)
    least, height = clearance_of(clearance), _height(plan)
    if height < least:
        msg = f"the altitude is {height:g} m above ground, and the terrain clearance is {least:g} m; fly higher"
        raise ProblemError(msg)
    low, high = max(height - most, least), height + most
    aim, half = (height, most) if low == height - most else (0.5 * (low + high), 0.5 * (high - low))
    route = np.array([(one.x, one.y) for one in plan.waypoints if one.role != "landing"])
    first, last = ((float(x), float(y)) for x, y in route[[0, -1]].tolist())
    projection = LocalProjection.between(first, last)
    places = projection.forward(route)
    surface = Surface.along(ground, places, projection)
    made: list[Waypoint] = [dataclasses.replace(plan.waypoints[0], altitude=aim)]
    for leg, (start, end) in enumerate(itertools.pairwise(places)):
        target = dataclasses.replace(plan.waypoints[leg + 1], altitude=aim)
        for x, y in _between(start, end, leg, projection, surface, half):
            made.append(Waypoint(x, y, aim, "ground", target.speed))
        made.append(target)
        if len(made) > MOST_WAYPOINTS:
            msg = f"the plan would have more than {MOST_WAYPOINTS} waypoints; give a greater tolerance"
            raise PlanError(msg)
    added = len(made) - len(route)
    return Followed(
        dataclasses.replace(plan, waypoints=(*made, *plan.waypoints[len(route) :])), added, aim, most, least
    )


def _height(plan: FlightPlan) -> float:
    """Return the one altitude of a plan above ground, or raise `PlanError`."""
    if plan.coordinates != "lonlat":
        msg = "the plan is in a plane, and elevations are in longitude and latitude; give a plan on the Earth"
        raise PlanError(msg)
    flown = [one for one in plan.waypoints if one.role != "landing"]
    heights = {(one.altitude, one.reference) for one in flown}
    altitude, reference = next(iter(heights), (None, ""))
    if len(heights) != 1 or reference != "ground" or altitude is None or any(one.reach > 0.0 for one in flown):
        msg = "only plans at one altitude above ground follow it; make one with FlightPlan.along(…, reference='ground')"
        raise PlanError(msg)
    return altitude


def _between(
    start: FloatArray, end: FloatArray, leg: int, projection: LocalProjection, surface: Surface, half: float
) -> list[tuple[float, float]]:
    """Return the places of waypoints to add to a leg, degrees."""
    found = list(pieces_of(start[None], end[None], projection, surface.cell))
    if any(isinstance(one, int) for one in found):
        msg = f"leg {leg + 1} is too long for cells so small; give elevations of larger cells"
        raise PlanError(msg)
    marks, levels = _marks([one for one in found if isinstance(one, Pieces)], surface, _BETWEEN * half)
    unknown = np.isnan(levels)
    if unknown.any():
        x, y = projection.inverse(start + marks[unknown][0] * (end - start)).tolist()
        msg = (
            f"the plan cannot follow the ground on leg {leg + 1}: its elevation at {x:.6f},{y:.6f} is not known; give "
            "elevations that have data there (ground), or fly above home or the sea"
        )
        raise PlanError(msg)
    shares = np.array([marks[index] for index in _chosen(marks, levels, _USED * half)])
    lonlat = np.round(projection.inverse(start + shares.reshape(-1, 1) * (end - start)), DIGITS)
    return [(float(x), float(y)) for x, y in lonlat.tolist()]


def _marks(pieces: list[Pieces], surface: Surface, sag: float) -> tuple[FloatArray, FloatArray]:
    """Return shares of a leg between which the ground is straight within `sag`, and its elevations there."""
    found = [elevations_along(one, surface) for one in pieces]
    shares, below = (np.concatenate([one[part] for one in found]) for part in (0, 1))
    bend = np.abs(below[:, 1] - 0.5 * (below[:, 0] + below[:, 2]))
    parts = np.ceil(np.sqrt(np.nan_to_num(bend) / sag)).clip(1, _MOST_PARTS).astype(np.int64)
    rows = np.repeat(np.arange(len(shares)), parts)
    number = np.arange(len(rows)) - np.repeat(np.cumsum(parts) - parts, parts)
    at = number / parts[rows]
    first, middle, last = below[rows].T
    level = first + at * (4.0 * middle - 3.0 * first - last) + at**2 * 2.0 * (first + last - 2.0 * middle)
    marks = shares[rows, 0] + at * (shares[rows, 2] - shares[rows, 0])
    return np.append(marks, 1.0), np.append(level, below[-1, 2])


def _chosen(marks: FloatArray, levels: FloatArray, within: float) -> list[int]:
    """Return the inner marks to stop at: each is as far from the one before as a straight line between them allows."""
    at, height, end = marks.tolist(), levels.tolist(), len(marks) - 1
    chosen, here = [], 0
    while here < end:
        low, high, last = -math.inf, math.inf, here + 1
        for index in range(here + 1, end + 1):
            ahead, rise = at[index] - at[here], height[index] - height[here]
            if ahead <= 0.0:
                last = max(last, index)
                continue
            if low <= rise / ahead <= high:
                last = index
            low, high = max(low, (rise - within) / ahead), min(high, (rise + within) / ahead)
            if low > high:
                break
        here = last
        if here < end:
            chosen.append(here)
    return chosen
