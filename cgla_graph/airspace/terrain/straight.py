"""Legs at altitudes above ground, flown straight from waypoint to waypoint: their heights above ground and sea."""

import itertools
import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.terrain.along import elevations_along
from cgla_graph.airspace.terrain.surface import Surface, pieces_of
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.model.earth import LocalProjection

#: Degrees around a leg whose elevations may count for its curve on the map.
_MARGIN: Final = 0.01


@dataclass(frozen=True, eq=False)
class StraightLeg:
    """
    A straight line between two places on the ground, in pieces; an aircraft flies at its altitudes above that.

    Attributes
    ----------
    shares
        Shares of the leg where each piece begins, is half over, and ends, shape ``(n, 3)``.
    low, high
        Bounds of the height of the line above the ground, metres, as control points of a parabola a piece, shape
        ``(n, 3)``; infinite where the ground is not known.
    sea_low, sea_high
        Bounds of the height of the ends above the sea, metres; infinite where not known.

    Examples
    --------
    >>> ground = Ground(np.array([[300.0, 0.0, 0.0, 300.0]]), (24.0, 60.0, 24.04, 60.01))
    >>> projection = LocalProjection(24.02, 60.005)
    >>> ends = projection.forward(np.array([[24.005, 60.005], [24.035, 60.005]]))
    >>> valley = straight_leg(ends, projection, ground)
    >>> round(valley.above_ground((80.0, 80.0))[1].max())
    380
    """

    shares: FloatArray
    low: FloatArray
    high: FloatArray
    sea_low: tuple[float, float]
    sea_high: tuple[float, float]

    def above_ground(self, altitudes: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest height above the ground on each piece, at altitudes of the ends."""
        flown = _line(altitudes, self.shares)
        return (self.low + flown).min(axis=1), (self.high + flown).max(axis=1)

    def above_sea(self, altitudes: tuple[float, float]) -> tuple[FloatArray, FloatArray]:
        """Return the least and the greatest height above the sea on each piece, at altitudes of the ends."""
        flown = _line(altitudes, self.shares)
        low, high = _line(self.sea_low, self.shares) + flown, _line(self.sea_high, self.shares) + flown
        return low.min(axis=1), high.max(axis=1)


def straight_leg(ends: FloatArray, projection: LocalProjection, ground: Ground, reach: float = 0.0) -> StraightLeg:
    """
    Return the straight line between two places on the ground.

    The ground is linear in both directions between the centres of cells, as autopilots interpolate it.

    Parameters
    ----------
    ends
        Map units, shape ``(2, 2)``.
    projection
        Projection of the map.
    ground
        Elevations.
    reach
        Distance from the line at which the aircraft may be, metres: then the cells around count.
    """
    surface = Surface.along(ground, ends, projection, reach=reach, margin=_MARGIN)
    sea_low = sea_high = surface.between(projection.inverse(ends))
    if reach > 0.0:
        sea_low, sea_high = surface.range_around(projection.inverse(ends), reach)
    low_ends, high_ends = (np.nan_to_num(sea_low, nan=-np.inf), np.nan_to_num(sea_high, nan=np.inf))
    shares, low, high = [np.zeros((0, 3))], [np.zeros((0, 3))], [np.zeros((0, 3))]
    for found in pieces_of(ends[:1], ends[1:], projection, surface.cell):
        if isinstance(found, int):
            return _unknown()
        nodes, below = elevations_along(found, surface)
        under = over = np.column_stack(
            [below[:, 0], 2.0 * below[:, 1] - 0.5 * (below[:, 0] + below[:, 2]), below[:, 2]]
        )
        if reach > 0.0:
            middle = projection.inverse(ends[0] + nodes[:, 1:2] * (ends[1] - ends[0]))
            under, over = (np.repeat(one[:, None], 3, axis=1) for one in surface.range_around(middle, reach))
        shares.append(nodes)
        low.append(np.nan_to_num(_line(tuple(low_ends), nodes) - over, nan=-np.inf))
        high.append(np.nan_to_num(_line(tuple(high_ends), nodes) - under, nan=np.inf))
    (first_low, last_low), (first_high, last_high) = low_ends.tolist(), high_ends.tolist()
    pieces = np.concatenate(shares), np.concatenate(low), np.concatenate(high)
    return StraightLeg(*pieces, (first_low, last_low), (first_high, last_high))


def straight_above_ground(plan: FlightPlan, ground: Ground, projection: LocalProjection) -> float:
    """
    Return the greatest height above the ground of legs above ground that are flown straight, metres: 0 without any.

    An autopilot without elevations flies straight from waypoint to waypoint, high above a valley. Infinite where the
    ground is not known.

    Examples
    --------
    >>> ground = Ground(np.array([[300.0, 0.0, 0.0, 300.0]]), (24.0, 60.0, 24.04, 60.01))
    >>> plan = FlightPlan.along([(24.005, 60.005), (24.035, 60.005)], altitude=80, reference="ground")
    >>> round(straight_above_ground(plan, ground, LocalProjection(24.02, 60.005)))
    380
    """
    # (from home at the altitude of the first waypoint, to a landing at that of the one before)
    first = plan.waypoints[0]
    home = [] if plan.home is None else [replace(first, x=plan.home.x, y=plan.home.y, role="waypoint")]
    highest = 0.0
    for one, after in itertools.pairwise([*home, *plan.waypoints]):
        end = one if after.role == "landing" else after
        ends = np.array([(one.x, one.y), (after.x, after.y)])
        if {one.reference, end.reference} != {"ground"} or (ends[0] == ends[1]).all():
            continue
        line = straight_leg(projection.forward(ends), projection, ground, max(one.reach, after.reach))
        heights = float(one.altitude or 0.0), float(end.altitude or 0.0)
        highest = max(highest, float(line.above_ground(heights)[1].max()))
    return highest


def _unknown() -> StraightLeg:
    """Return a leg of which nothing is known."""
    wide = np.full((1, 3), np.inf)
    return StraightLeg(np.array([[0.0, 0.5, 1.0]]), -wide, wide, (-math.inf, -math.inf), (math.inf, math.inf))


def _line(ends: tuple[float, ...], shares: FloatArray) -> FloatArray:
    """Return a linear function with given ends, which may be infinite."""
    if not all(map(math.isfinite, ends)):
        return np.full(shares.shape, next(one for one in ends if not math.isfinite(one)))
    return ends[0] + shares * (ends[1] - ends[0])
