"""Comparison of a plan's altitudes with floors and ceilings: the parts of legs on which each zone counts."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cgla_graph._text import counted
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.flight_plans.profile import Heights, Profile, profile_of
from cgla_graph.airspace.flight_plans.simultaneous_areas import WHOLE, Shares
from cgla_graph.airspace.terrain.straight import StraightLeg, straight_leg
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import ABOVE, ROUNDING, Range, height_offset, home_heights
from cgla_graph.airspace.zones.zone import Limits
from cgla_graph.model.earth import LocalProjection, box_around

_WORDS: Final = {"HOME": "above home", "AGL": "above ground", "AMSL": "above the sea", "WGS84": "above the ellipsoid"}
#: Parts into which a leg over an elevation raster is divided, at most; each spans two cells or more.
_MOST_PARTS: Final = 64
_HALF_TURN: Final = 180.0
_NO_GROUND: Final = "flown straight, it is above ground that is not known (a raster that has data there would do)"
#: Entries of the table of areas that legs of a kind may meet, at most.
_MOST_TABLE: Final = 20_000_000
#: Reasons for which notes are given, at most.
_MOST_NOTES: Final = 4


@dataclass
class PlanHeights:
    """
    Comparison of the heights of a plan with those of areas.

    Heights with the same reference are compared directly. Others are converted to heights above the sea, with the
    height of home and the least and greatest elevation of the raster around a part of a leg. Legs above ground with
    known elevations are compared twice: following the ground, and straight from waypoint to waypoint. An area whose
    limits cannot be compared counts at all heights, with a note.

    Parameters
    ----------
    plan, stops
        The plan, and its stops as in `profile_of`.
    limits
        Floor and ceiling of each area; None for an area without.
    ground
        Elevations; None if unknown.
    route, boxes
        The route, shape ``(m, 2)``, and the bounds of each area, shape ``(n, 4)``, map units.
    projection
        Projection of the map.
    vertical_clearance
        Metres by which floors and ceilings are widened.
    column
        Heights where it takes off and lands; None for those of the plan.
    """

    plan: FlightPlan
    stops: Sequence[int]
    limits: Sequence[Limits | None]
    ground: Ground | None
    route: FloatArray
    boxes: FloatArray
    projection: LocalProjection
    vertical_clearance: float = 0.0
    column: Heights | None = None
    #: Reasons why areas count at all heights, and the pairs of leg and area.
    unresolved: dict[str, list[tuple[int, int]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Compute the heights of the plan and its home."""
        own = profile_of(self.plan, self.stops)
        self.profile: Profile = own if self.column is None else own.with_ends(self.column)
        self.home = home_heights(self.plan, self.ground)
        self._seen: dict[tuple[Heights, Limits], Shares | None] = {}
        self._met: dict[Heights | None, BoolArray] = {}
        self._straight: dict[int, StraightLeg] = {}

    def _within(self, heights: Heights, limits: Limits, ground: Range | None, part: Range) -> tuple[Range | None, bool]:
        """Return the share of a part of a leg within the limits, and whether all limits could be compared."""
        (first, last), all_known = part, True
        assert heights.reference is not None  # noqa: S101 - for the type checker
        for limit, sign in limits.bounded:
            # the greatest possible height decides whether it is above a floor, the least whether it is below a ceiling
            ends = heights.high if sign > 0.0 else heights.low
            more = height_offset(ABOVE[heights.reference], limit.reference, ground, self.home)
            if math.isinf(ends[0]) and (at_ground := height_offset("AGL", limit.reference, ground, self.home)):
                ends, more = (0.0, 0.0), at_ground
            if more is None:
                all_known = False
                continue
            beyond = self.vertical_clearance + ROUNDING
            value = sign * (np.array(ends) + more[1 if sign > 0.0 else 0] - limit.metres) + beyond
            here = _nonnegative_part(float(value[0]), float(value[1]))
            if here is None or max(first, here[0]) > min(last, here[1]):
                return None, True
            first, last = max(first, here[0]), min(last, here[1])
        return (first, last), all_known

    def _shares(self, heights: Heights, area: int, ends: FloatArray, leg: int, beside: float = 0.0) -> Shares:
        """Return the parts of a leg, within a distance of an area, on which the area counts."""
        limits = self.limits[area]
        if limits is None or not limits.bounded:
            return WHOLE
        if heights.reference is None:
            self._note(heights.why, leg, area)
            return WHOLE
        key = heights, limits
        if key not in self._seen:
            found, all_known = self._within(heights, limits, None, (0.0, 1.0))
            self._seen[key] = () if found is None else (found,) if all_known else None
        shares = self._seen[key]
        if shares is not None:
            return shares
        parts: list[Range] = []
        for part, ground in self._grounds(ends, area, beside):
            found, all_known = self._within(heights, limits, ground, part)
            if found is None:
                continue
            if not all_known:
                self._note(self._why_not_compared(heights, limits), leg, area)
            parts.append(found)
        return _union(parts)

    def _grounds(self, ends: FloatArray, area: int, beside: float) -> Iterator[tuple[Range, Range | None]]:
        """Yield parts of a leg within a distance of an area, and the least and the greatest elevation around each."""
        if self.ground is None:
            yield (0.0, 1.0), None
            return
        first, last = _part_in_box(ends[0], ends[1], self.boxes[area] + beside * np.array([-1.0, -1.0, 1.0, 1.0]))
        places = self.projection.inverse(ends[0] + np.array([[first], [last]]) * (ends[1] - ends[0]))
        cells = float((np.abs(places[1] - places[0]) / self.ground.cell).max())
        number = int(min(max(math.ceil(0.5 * cells), 1), _MOST_PARTS)) if math.isfinite(cells) else 1
        shares = np.linspace(first, last, number + 1)
        # (middles are included because a straight line on the map is curved in degrees)
        at = np.sort(np.concatenate([shares, 0.5 * (shares[:-1] + shares[1:])]))
        lonlat = self.projection.inverse(ends[0] + at[:, None] * (ends[1] - ends[0]))
        for index in range(number):
            around = np.array([box_around((x, y), beside) for x, y in lonlat[2 * index : 2 * index + 3].tolist()])
            (west, south), (east, north) = around[:, :2].min(axis=0).tolist(), around[:, 2:].max(axis=0).tolist()
            yield (float(shares[index]), float(shares[index + 1])), self.ground.range_in((west, south, east, north))

    def _note(self, why: str, leg: int, area: int) -> None:
        self.unresolved.setdefault(why, []).append((leg, area))

    def _ends(self, leg: int) -> FloatArray:
        return self.route[[leg, min(leg + 1, len(self.route) - 1)]]

    # methods of `HeightOverlap`

    def on_leg(self, leg: int, area: int, beside: float = 0.0) -> Shares:
        """Return the parts of a leg, within a distance of an area, where it may be at the height of the area."""
        heights, limits = self.profile.legs[leg], self.limits[area]
        found = self._shares(heights, area, self._ends(leg), leg, beside)
        if limits is None or not limits.bounded or found == WHOLE or not self._may_be_straight(heights):
            return found
        return _union([*found, *self._straight_parts(heights, limits, area, leg)])

    def _may_be_straight(self, heights: Heights) -> bool:
        """Return whether a leg is above ground whose elevations are known, so that its straight line counts as well."""
        return heights.reference == "ground" and self.ground is not None

    def _straight_parts(self, heights: Heights, limits: Limits, area: int, leg: int) -> list[Range]:
        """Return where it is within limits if it flies straight, as an autopilot without elevations does."""
        assert self.ground is not None  # noqa: S101 - for the type checker
        if leg not in self._straight:
            places = [one for one in self.stops[leg : leg + 2] if one]
            reach = max((self.plan.waypoints[one - 1].reach for one in places), default=0.0)
            self._straight[leg] = straight_leg(self._ends(leg), self.projection, self.ground, reach)
        line = self._straight[leg]
        counts = np.ones(len(line.shares), dtype=bool)
        beyond = self.vertical_clearance + ROUNDING
        for limit, sign in limits.bounded:
            ends = heights.high if sign > 0.0 else heights.low
            more: Range | None = (0.0, 0.0)
            if limit.reference == "AGL":
                low, high = line.above_ground(ends)
            else:
                low, high = line.above_sea(ends)
                more = height_offset("AMSL", limit.reference, None, self.home)
            if more is None:
                self._note(self._why_not_compared(heights, limits), leg, area)
                continue
            flown = high + more[1] if sign > 0.0 else low + more[0]
            if not (np.isfinite(flown) | math.isinf(ends[0])).all():
                self._note(_NO_GROUND, leg, area)
            counts &= sign * (flown - limit.metres) + beyond >= 0.0
        return [(first, last) for first, _, last in line.shares[counts].tolist()]

    def at_place(self, place: int, area: int, beside: float = 0.0) -> bool:
        """Return whether it may be at the height of an area, up to a distance from a place, as it climbs or circles."""
        leg = min(place, len(self.profile.legs) - 1)
        heights = self.profile.places[place] or self.profile.legs[leg]
        return bool(self._shares(heights, area, self.route[[place, place]], leg, beside))

    def goes_upright(self, place: int) -> bool:
        """Return whether it climbs or descends vertically at a place."""
        return self.profile.places[place] is not None

    def may_meet_at(self, place: int) -> BoolArray:
        """Return the areas that it may meet at a place, without using elevations, shape ``(n_areas,)``."""
        heights = self.profile.places[place]
        if heights not in self._met:
            answers = {limits: heights is None or self._may_meet(heights, limits) for limits in set(self.limits)}
            self._met[heights] = np.array([answers[limits] for limits in self.limits], dtype=bool)
        return self._met[heights]

    def note_all_count(self, leg: int) -> None:
        """Note that all areas count on a leg, because there are too many to compare."""
        self._note("there are too many of them to compare", leg, -1)

    def kinds(self) -> tuple[IntArray, BoolArray] | None:
        """Return the kind of each leg (legs of equal heights), and the areas that legs of a kind may meet."""
        numbers: dict[Heights, int] = {}
        kind = np.array([numbers.setdefault(heights, len(numbers)) for heights in self.profile.legs])
        if len(numbers) * len(self.limits) > _MOST_TABLE:
            return None
        which = {limits: number for number, limits in enumerate(dict.fromkeys(self.limits))}
        columns = np.array([which[limits] for limits in self.limits])
        table = np.array([[self._may_meet(heights, limits) for limits in which] for heights in numbers])
        return kind, table[:, columns]

    def _may_meet(self, heights: Heights, limits: Limits | None) -> bool:
        """Return whether the heights of a leg and of an area may overlap, without using elevations."""
        if limits is None or heights.reference is None or self._may_be_straight(heights):
            return True
        return self._within(heights, limits, None, (0.0, 1.0))[0] is not None

    def contains_all(self, area: int) -> bool:
        """Return whether all heights of the plan are within the limits of an area, so that it must fly around."""
        limits = self.limits[area]
        if limits is None or not limits.bounded:
            return True
        ground = self._around(area)
        return all(self._is_inside(heights, limits, ground) for heights in dict.fromkeys(self.profile.legs))

    def _is_inside(self, heights: Heights, limits: Limits, ground: Range | None) -> bool:
        if heights.reference is None:
            return True
        for limit, sign in limits.bounded:
            more = height_offset(ABOVE[heights.reference], limit.reference, ground, self.home)
            if more is None and self.ground is None:
                continue
            ends = heights.low if sign > 0.0 else heights.high
            beyond = self.vertical_clearance
            if more is None or any(
                sign * (end + more[0 if sign > 0.0 else 1] - limit.metres) + beyond < 0.0 for end in ends
            ):
                return False
        return True

    def _around(self, area: int) -> Range | None:
        """Return the least and the greatest elevation in the bounds of an area."""
        if self.ground is None:
            return None
        x_min, y_min, x_max, y_max = self.boxes[area].tolist()
        xs, ys = np.linspace(x_min, x_max, 5), np.linspace(y_min, y_max, 5)
        rim = [(x, y) for x in xs for y in ys]
        lonlat = self.projection.inverse(rim)
        (west, south), (east, north) = lonlat.min(axis=0).tolist(), lonlat.max(axis=0).tolist()
        return self.ground.range_in((west, south, east, north)) if east - west < _HALF_TURN else None

    def _why_not_compared(self, heights: Heights, limits: Limits) -> str:
        """Return why heights of a leg and of an area cannot be compared, and the data that is missing."""
        ours = ABOVE[heights.reference] if heights.reference is not None else ""
        theirs = {limit.reference for limit, _ in limits.bounded} - {ours}
        needs = ["the height of home above the sea in the plan"] if ours == "HOME" and self.home is None else []
        if "AGL" in {ours, *theirs}:
            needs += ["--ground FILE.tif"] if self.ground is None else ["a raster of elevations that has data there"]
        others = " and ".join(_WORDS[one] for one in sorted(theirs))
        return f"heights {_WORDS[ours]} and {others} cannot be compared ({' and '.join(needs)} would do)"

    # for reports

    def heights_text(self, number: int, area: int, *, is_place: bool) -> str:
        """Return the heights of a leg, or of a place of the route, and of an area; empty for an area without limits."""
        limits = self.limits[area]
        heights = self.profile.places[number] if is_place else self.profile.legs[number]
        heights = heights or self.profile.legs[min(number, len(self.profile.legs) - 1)]
        if limits is None or not limits.bounded:
            return ""
        straight = ""
        if (
            not is_place
            and self._may_be_straight(heights)
            and not self._shares(heights, area, self._ends(number), number)
        ):
            straight = " at its ends and straight between them"
        return f"at {_range_text(heights)}{straight}, of {limits}"

    def notes(self) -> list[str]:
        """Return why areas count at all heights, and on which legs."""
        found = []
        for why, pairs in list(self.unresolved.items())[:_MOST_NOTES]:
            legs = dict.fromkeys(leg for leg, _ in pairs)
            more = f" and {len(legs) - 1} more" if len(legs) > 1 else ""
            numbers = {area for _, area in pairs}
            areas = "all areas" if -1 in numbers else counted(len(numbers), "area")
            found.append(f"leg {next(iter(legs)) + 1}{more}: {areas} on it taken as closed at all heights: {why}")
        return found


def _union(parts: Sequence[Range]) -> Shares:
    """Return the union of parts of a leg."""
    found: list[Range] = []
    for first, last in sorted(parts):
        if found and first <= found[-1][1]:
            found[-1] = (found[-1][0], max(last, found[-1][1]))
        else:
            found.append((first, last))
    return tuple(found)


def _nonnegative_part(first: float, last: float) -> Range | None:
    """Return the part from 0 to 1 on which a linear function with given ends is not below 0; exact at the ends."""
    if first >= 0.0 and last >= 0.0:
        return 0.0, 1.0
    if first < 0.0 and last < 0.0:
        return None
    share = first / (first - last) if math.isfinite(first) and math.isfinite(last) else 0.5
    # (widened by more than the rounding errors)
    return (0.0, min(share + 1e-12, 1.0)) if first >= 0.0 else (max(share - 1e-12, 0.0), 1.0)


def _part_in_box(start: FloatArray, end: FloatArray, box: FloatArray) -> Range:
    """Return the part of a leg that is in a box, or all of it."""
    first, last = 0.0, 1.0
    for axis in (0, 1):
        low, high, step = box[axis] - start[axis], box[axis + 2] - start[axis], end[axis] - start[axis]
        if step != 0.0:
            one, other = sorted((float(low / step), float(high / step)))
            first, last = max(first, one), min(last, other)
    return (max(first - 1e-9, 0.0), min(last + 1e-9, 1.0)) if first <= last else (0.0, 1.0)


def _range_text(heights: Heights) -> str:
    """Write the range of heights of a leg."""
    if heights.reference is None:
        return "unknown heights"
    above = _WORDS[ABOVE[heights.reference]]
    low, high = heights.lowest, heights.highest
    if low == high:
        return f"{high:.6g} m {above}"
    return f"{high:.6g} m {above} or less" if math.isinf(low) else f"{low:.6g} to {high:.6g} m {above}"
