"""Heights of the legs of a plan above the ground, on the safe side of unknown values."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import chain
from typing import Any, Final

import numpy as np

from cgla_graph._text import json_number, listed
from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint
from cgla_graph.airspace.flight_plans.profile import NOT_SAID, Heights, profile_of
from cgla_graph.airspace.terrain.along import cut_at_edges, elevations_along, leg_by_leg
from cgla_graph.airspace.terrain.area import SOURCE, clearance_of
from cgla_graph.airspace.terrain.surface import ROUNDED, Pieces, Surface, pieces_of
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import ABOVE, Altitude, Range, height_offset, home_heights
from cgla_graph.model.earth import LocalProjection

#: Heights below the clearance by at most this count as kept, metres, because sums of altitudes are rounded.
_ROUNDING: Final = 1e-6
#: A climb in a straight line from the ground may be near it within so many cells of where it begins.
_CELLS_OF_CLIMB: Final = 2.0
_NO_HOME: Final = (
    "the height of home above the sea is not known: give a raster that has data there (ground), or a plan that says it"
)
_NO_GROUND: Final = "no elevation is known there: give a raster that has data there (ground)"
_TOO_LONG: Final = "it is too long for cells so small: give a raster of larger cells"


@dataclass(frozen=True, eq=False)
class LegsAboveGround:
    """
    The least height of each leg above the ground.

    Attributes
    ----------
    clearance
        Least height above the ground that is asked for, metres.
    is_default
        Whether none was given.
    least
        A lower bound of the height of each leg above the ground, metres, shape ``(n,)``; infinite where nothing is
        known, negative where it may be below the ground.
    places
        Where that is, degrees, shape ``(n, 2)``.
    reasons
        Why the height of a leg, or of a part of it, is not known; empty if it is known.
    """

    clearance: float
    is_default: bool
    least: FloatArray
    places: FloatArray
    reasons: tuple[str, ...]

    @property
    def low(self) -> BoolArray:
        """Which legs are not above the ground by the clearance, shape ``(n,)``."""
        return np.asarray(self.least < self.clearance - _ROUNDING)

    @property
    def unknown(self) -> list[str]:
        """Why heights above the ground are not known: one sentence for each reason, with the legs."""
        legs: dict[str, list[str]] = {}
        for number, why in enumerate(self.reasons, start=1):
            if why:
                legs.setdefault(why, []).append(str(number))
        return [
            f"the height of leg {listed(numbers)} above the ground is not known: {why}" for why, numbers in legs.items()
        ]

    def summary(self) -> str:
        """Return the least height above the ground, its position and the required height, in one line."""
        asked = f"required: at least {self.clearance:g} m ({SOURCE if self.is_default else 'as given'})"
        known = np.isfinite(self.least)
        if not known.any():
            return f"not known, {asked}"
        leg = int(np.argmin(np.where(known, self.least, np.inf)))
        x, y = self.places[leg].tolist()
        return f"nowhere less than {_metres(self.least[leg])} m, on leg {leg + 1} at {x:.6f},{y:.6f}, {asked}"

    def height_text(self, leg: int) -> str:
        """Return the least height of a leg, counted from 0, in metres, rounded down."""
        height = float(self.least[leg])
        return _metres(height) if math.isfinite(height) else "unknown"

    def document(self, leg: int | None = None) -> dict[str, Any]:
        """Return the account of all legs, or of one, counted from 0, as JSON."""
        if leg is None:
            return {
                "clearance": self.clearance,
                "clearance_is_default": self.is_default,
                "least": json_number(float(self.least.min())),
                "low": (np.nonzero(self.low)[0] + 1).tolist(),
                "unknown": self.unknown,
                "summary": self.summary(),
            }
        return {"above_ground": json_number(float(self.least[leg])), "above_ground_unknown": self.reasons[leg]}


def _metres(height: float) -> str:
    """Write a height in metres, rounded down to a decimetre."""
    return f"{math.floor(10.0 * height + 1e-4) / 10.0:g}"


@dataclass(frozen=True)
class _Flown:
    """Heights of a leg: reference, least heights at its ends, the reach beside it, and its ends on the ground."""

    reference: str
    ends: Range
    reach: float = 0.0
    grounded: tuple[bool, bool] = (False, False)


def legs_above_ground(
    plan: FlightPlan,
    stops: Sequence[int],
    route: FloatArray,
    projection: LocalProjection,
    ground: Ground,
    *,
    clearance: float | None = None,
    altitude: Altitude | None = None,
) -> LegsAboveGround:
    """
    Return how high the legs of a plan are above the ground.

    Heights above sea, home or ellipsoid are held against the greatest elevation of the cells below and their
    neighbours. A flight above ground may follow it, or fly straight between its waypoints: both count, with elevations
    that are linear between the centres of cells, as autopilots take them. On a leg from home or to a landing, the
    aircraft is at the altitude of the other end, or on the straight line from the ground to it, which must not meet the
    ground but within two cells of where it begins.

    Parameters
    ----------
    plan
        The plan.
    stops
        Place by place of the route: 0 for home, else the number of the first waypoint there, from 1.
    route
        Places that are flown to, map units, shape ``(m, 2)``.
    projection
        Projection of the map.
    ground
        Elevations.
    clearance
        Least height above the ground, metres; None for the default.
    altitude
        Altitude of legs for which the plan has none.

    Raises
    ------
    ProblemError
        If the clearance is negative.
    """
    starts, ends = (route, route) if len(route) == 1 else (route[:-1], route[1:])
    flown, reasons = _flown(plan, stops, altitude)
    beside = [one.reach for one in flown if one is not None] + [one.acceptance for one in plan.waypoints]
    surface = Surface.along(ground, route, projection, reach=max(beside, default=0.0))
    solver = _Solver(surface, projection, starts, ends, home_heights(plan, ground))
    cuts = np.array([max((one.acceptance for one in group), default=0.0) for group in _groups(plan, stops)])
    upright = _upright(plan, stops, projection.inverse(route), surface, solver.home)
    least, places = np.full(len(starts), np.inf), projection.inverse(starts)
    for leg, height, place, why in chain(solver.heights(flown), solver.corners(flown, cuts), upright):
        if height < least[leg]:
            least[leg], places[leg] = height, place
        reasons[leg] = reasons[leg] or why
    return LegsAboveGround(clearance_of(clearance), clearance is None, least, places, tuple(reasons))


def _groups(plan: FlightPlan, stops: Sequence[int]) -> list[Sequence[Waypoint]]:
    """Return the waypoints at each place of the route; none at home."""
    last = [*stops[1:], len(plan.waypoints) + 1]
    return [plan.waypoints[max(stop, 1) - 1 : end - 1] for stop, end in zip(stops, last, strict=True)]


def _flown(plan: FlightPlan, stops: Sequence[int], altitude: Altitude | None) -> tuple[list[_Flown | None], list[str]]:
    """Return the heights of each leg, None if they are not known, and why."""
    groups, legs = _groups(plan, stops), profile_of(plan, stops).legs
    found: list[_Flown | None] = []
    reasons = []
    for number, heights in enumerate(legs):
        before, after = groups[number], groups[min(number + 1, len(groups) - 1)]
        reach = max((one.reach for one in (*before, *after)), default=0.0)
        why = ""
        if heights.reference is not None:
            grounded = (
                math.isinf(heights.lowest) and (not before or before[-1].role in {"touch-down", "landing"}),
                math.isinf(heights.lowest) and after[0].role in {"touch-down", "landing"},
            )
            low = heights.high if math.isinf(heights.lowest) else heights.low
            found.append(_Flown(ABOVE[heights.reference], low, reach, grounded))
        elif altitude is not None and heights.why == NOT_SAID:
            reference = "HELD" if altitude.reference == "AGL" else altitude.reference
            found.append(_Flown(reference, (altitude.metres, altitude.metres), reach))
        else:
            found.append(None)
            remedy = "give its altitude (altitude)" if heights.why == NOT_SAID else "give it one reference in the plan"
            why = f"{heights.why}: {remedy}"
        reasons.append(why)
    return found, reasons


def _upright(
    plan: FlightPlan, stops: Sequence[int], route: FloatArray, surface: Surface, home: Range | None
) -> Iterator[tuple[int, float, FloatArray, str]]:
    """Yield the leg before a place, and the least height there, where a plan goes up or down, as `_Solver.heights`."""
    groups = _groups(plan, stops)
    for number, heights in enumerate(profile_of(plan, stops).places):
        low: Heights | None = heights
        if low is None or low.reference is None or not math.isfinite(low.lowest) or len(groups[number]) < 2:  # noqa: PLR2004 - goes up or down
            continue
        leg = max(number - 1, 0)
        place = route[min(leg + 1, len(route) - 1)]
        if low.reference == "ground":
            yield leg, low.lowest, place, ""
            continue
        offset = height_offset(ABOVE[low.reference], "AMSL", None, home)
        here = route[[number]]
        below = float(surface.highest(surface.position(here), surface.rounding(here[:, 1]))[0])
        if offset is not None and math.isfinite(below):
            yield leg, low.lowest + offset[0] - below, place, ""


@dataclass(frozen=True, eq=False)
class _Solver:
    """Heights of legs above a surface."""

    surface: Surface
    projection: LocalProjection
    starts: FloatArray
    ends: FloatArray
    home: Range | None

    def heights(self, flown: Sequence[_Flown | None]) -> Iterator[tuple[int, float, FloatArray, str]]:
        """Yield legs, the least height of each above the ground, where it is, and why a part of it is not known."""
        lines = [None if one is None else self._above_sea(leg, one) for leg, one in enumerate(flown)]
        for leg, one in enumerate(flown):
            if one is not None and one.reference in {"AGL", "HELD"}:
                # (if it follows the ground)
                yield leg, min(one.ends), self.projection.inverse(self.starts[leg]), ""
            if one is not None and lines[leg] is None and one.reference != "HELD":
                yield leg, math.inf, self.starts[leg], _NO_HOME if one.reference == "HOME" else _NO_GROUND
        for found in pieces_of(self.starts, self.ends, self.projection, self.surface.cell):
            if isinstance(found, int):
                if flown[found] is not None:
                    yield found, math.inf, self.starts[found], _TOO_LONG
                continue
            for leg, part in leg_by_leg(found):
                one, line = flown[leg], lines[leg]
                if one is not None and line is not None:
                    yield leg, *self._of_leg(part, one, line)

    def corners(self, flown: Sequence[_Flown | None], cuts: FloatArray) -> Iterator[tuple[int, float, FloatArray, str]]:
        """
        Yield legs whose first corner may be cut, and the least height above the ground there, as `heights` does.

        The aircraft leaves the leg before within a distance of the waypoint, and flies straight to the next one, at
        the lesser altitude of the two places. The ground is linear between the centres of cells.
        """
        legs, lines, begins = [], [], []
        for leg in np.nonzero(cuts[1:-1] > 0.0)[0].tolist():
            before, after = flown[leg], flown[leg + 1]
            if before is None or after is None or any((*before.grounded, *after.grounded)):
                continue
            one, other = self._above_sea(leg, before), self._above_sea(leg + 1, after)
            came, goes = self.ends[leg] - self.starts[leg], self.ends[leg + 1] - self.starts[leg + 1]
            length, ahead = math.hypot(*came), math.hypot(*goes)
            if one is None or other is None or length == 0.0 or ahead == 0.0:
                continue
            share = min(cuts[leg + 1] / length, 1.0)
            aside = share * abs(float(came[0] * goes[1] - came[1] * goes[0])) / ahead
            if aside > ROUNDED:
                first = one[1] - share * (one[1] - one[0])
                legs.append(leg + 1)
                lines.append((min(first, one[1], other[0]), other[1]))
                begins.append(self.ends[leg] - share * came)
        if not legs:
            return
        cut = replace(self, starts=np.array(begins), ends=self.ends[legs])
        for found in pieces_of(cut.starts, cut.ends, self.projection, self.surface.cell):
            if isinstance(found, int):
                continue
            for leg, part in leg_by_leg(found):
                heights, places = cut.between(part, lines[leg])
                least = int(np.argmin(heights))
                yield legs[leg], float(heights[least]), places[least], "" if np.isfinite(heights).all() else _NO_GROUND

    def _above_sea(self, leg: int, one: _Flown) -> Range | None:
        """Return the least heights of the ends of a leg above the sea; None if they are not known, or it is held."""
        if one.reference == "HELD":
            return None
        if one.reference == "AGL":
            lonlat = self.projection.inverse(np.array([self.starts[leg], self.ends[leg]]))
            below = self.surface.range_around(lonlat, one.reach)[0] if one.reach > 0.0 else self.surface.between(lonlat)
            first, last = (below + one.ends).tolist()
            return (first, last) if math.isfinite(first) and math.isfinite(last) else None
        offset = height_offset(one.reference, "AMSL", None, self.home)
        return None if offset is None else (one.ends[0] + offset[0], one.ends[1] + offset[0])

    def _of_leg(self, part: Pieces, one: _Flown, line: Range) -> tuple[float, FloatArray, str]:
        """Return the least height of a part of a leg above the ground, where it is, and why it is not known."""
        exact = one.reference == "AGL" and one.reach == 0.0
        heights, places = self.between(part, line) if exact else self._around(part, line, one.reach)
        if any(one.grounded) and not all(one.grounded):
            more, where = self._climb(part, one, line)
            heights, places = np.concatenate([heights, more]), np.concatenate([places, where])
        known = np.isfinite(heights)
        if not known.any():
            return math.inf, places[0], _NO_GROUND
        least = int(np.argmin(np.where(known, heights, np.inf)))
        return float(heights[least]), places[least], "" if known.all() else _NO_GROUND

    def _around(self, part: Pieces, line: Range, reach: float = 0.0) -> tuple[FloatArray, FloatArray]:
        """Return heights above the greatest elevations of the cells around, piece by piece, and their places."""
        shares, lonlat = cut_at_edges(part, self.surface)
        middle = 0.5 * (lonlat[:, 0] + lonlat[:, 1])
        rounding = self.surface.rounding(middle[:, 1])
        below = self.surface.highest(self.surface.position(middle), rounding, self.surface.cells(reach, part.lonlat))
        high = line[0] + shares * (line[1] - line[0])
        return high.min(axis=1) - below, lonlat[np.arange(len(lonlat)), np.argmin(high, axis=1)]

    def _climb(self, part: Pieces, one: _Flown, line: Range) -> tuple[FloatArray, FloatArray]:
        """Return heights of the straight line from the ground, plus the clearance that it need not keep."""
        leg, at = int(part.leg[0]), int(one.grounded[1])
        foot = self.projection.inverse((self.starts, self.ends)[at][leg])[None]
        low = float(self.surface.range_around(foot, 0.0)[0][0])
        low = low if math.isfinite(low) else math.nan
        ends = (low, line[1]) if at == 0 else (line[0], low)
        heights, places = self._around(part, ends, one.reach)
        far = np.abs(self.surface.position(places) - self.surface.position(foot)).max(axis=1) > _CELLS_OF_CLIMB
        # (a climb that meets the ground is below it; one that does not is no leg at that height)
        counts = far & ~(heights >= 0.0)
        return heights[counts], places[counts]

    def between(self, part: Pieces, line: Range) -> tuple[FloatArray, FloatArray]:
        """Return the least heights above elevations linear between the centres of cells, piece by piece."""
        nodes, below = elevations_along(part, self.surface)
        high = line[0] + nodes * (line[1] - line[0])
        first, middle, last = (high - below).T
        # the height is quadratic on each piece
        bend = 2.0 * (first + last - 2.0 * middle)
        with np.errstate(all="ignore"):
            share = np.where(bend > 0.0, 0.5 * (3.0 * first + last - 4.0 * middle) / bend, 0.0)
        share = np.clip(share, 0.0, 1.0)
        turn = first + share * (4.0 * middle - 3.0 * first - last) + share**2 * bend
        heights = np.minimum(np.minimum(first, last), np.where(bend > 0.0, turn, np.inf))
        heights = np.where(np.isnan(first + middle + last), np.inf, heights)
        at = np.where(heights == first, 0.0, np.where(heights == last, 1.0, share))
        leg = int(part.leg[0])
        shares = nodes[:, 0] + at * (nodes[:, 2] - nodes[:, 0])
        along = self.starts[leg] + shares[:, None] * (self.ends[leg] - self.starts[leg])
        return heights, self.projection.inverse(along)
