"""A plan's own altitudes against the floors and ceilings of zones: on which parts of its legs each zone counts."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from cgla_graph._text import counted
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference
from cgla_graph.airspace.flight_plans.profile import Heights, Profile, profile_of
from cgla_graph.airspace.flight_plans.simultaneous_areas import WHOLE, Shares
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import Range, difference
from cgla_graph.airspace.zones.zone import Limits
from cgla_graph.model.earth import LocalProjection

#: What heights of plans are above, as those of zones are written.
_ABOVE: Final[dict[Reference, str]] = {"home": "HOME", "ground": "AGL", "sea": "AMSL", "ellipsoid": "WGS84"}
_WORDS: Final = {"HOME": "above home", "AGL": "above ground", "AMSL": "above the sea", "WGS84": "above the ellipsoid"}
#: A leg over an elevation raster is taken in so many parts at most, of two cells or more.
_MOST_PARTS: Final = 64
_HALF_TURN: Final = 180.0
#: Entries of the table of which areas legs of a kind may meet, at most.
_MOST_TABLE: Final = 20_000_000
#: What is so little beyond a floor or a ceiling is within, metres: sums of altitudes are rounded.
_ROUNDING: Final = 1e-9
#: Notes are given of so many reasons.
_MOST_NOTES: Final = 4


@dataclass
class PlanHeights:
    """
    The heights of a plan against those of areas.

    Where heights are above the same thing, they are compared as they are. Else both are turned into heights above the
    sea, as far as is known: with the height of home, and with the least and greatest elevation of the cells of a raster
    around a part of a leg. What cannot be compared counts at all heights, with a note.

    Parameters
    ----------
    plan, stops
        The plan, and what each place of its route is.
    limits
        Of each area; None where it has none.
    ground
        Elevations.
    route, boxes
        The route, shape ``(m, 2)``, and the bounds of each area, shape ``(n, 4)``, map units.
    projection
        Of the map.
    """

    plan: FlightPlan
    stops: Sequence[int]
    limits: Sequence[Limits | None]
    ground: Ground | None
    route: FloatArray
    boxes: FloatArray
    projection: LocalProjection
    #: Why areas count at all heights, and on which legs and in which areas.
    untold: dict[str, list[tuple[int, int]]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Say how high the plan and its home are."""
        self.profile: Profile = profile_of(self.plan, self.stops)
        self.home = self._home()
        self._seen: dict[tuple[Heights, Limits], Shares | None] = {}

    def _home(self) -> Range | None:
        """Return how high home is above the sea, at least and at most: as the plan says, and as the raster does."""
        plan, known = self.plan, []
        first = plan.home or plan.waypoints[0]
        # (0 m is what files of autopilots say of a height that is not known)
        if plan.home is not None and plan.home.altitude:
            known.append((plan.home.altitude, plan.home.altitude))
        at_home = plan.home is not None or plan.waypoints[0].role == "take-off"
        seen = self.ground.range_in((first.x, first.y, first.x, first.y)) if self.ground and at_home else None
        known += [] if seen is None else [seen]
        return (min(one[0] for one in known), max(one[1] for one in known)) if known else None

    def _within(self, heights: Heights, limits: Limits, ground: Range | None, part: Range) -> tuple[Range | None, bool]:
        """Return where in a part of a leg a limit lets the aircraft be inside, and whether all limits were compared."""
        (first, last), all_known = part, True
        assert heights.reference is not None  # noqa: S101 - for the type checker
        for limit, sign in limits.bounded:
            more = difference(_ABOVE[heights.reference], limit.reference, ground, self.home)
            if more is None:
                all_known = False
                continue
            # above a floor by the greatest height that may be, below a ceiling by the least
            ends = heights.high if sign > 0.0 else heights.low
            value = sign * (np.array(ends) + more[1 if sign > 0.0 else 0] - limit.metres) + _ROUNDING
            here = _at_least_nothing(float(value[0]), float(value[1]))
            if here is None or max(first, here[0]) > min(last, here[1]):
                return None, True
            first, last = max(first, here[0]), min(last, here[1])
        return (first, last), all_known

    def _shares(self, heights: Heights, area: int, ends: FloatArray, leg: int) -> Shares:
        """Return on which parts of a leg an area counts."""
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
        for part, ground in self._grounds(ends, area):
            found, all_known = self._within(heights, limits, ground, part)
            if found is None:
                continue
            if not all_known:
                self._note(self._not_compared(heights, limits), leg, area)
            joins = bool(parts) and parts[-1][1] == found[0]
            parts[-1:] = [(parts[-1][0], found[1])] if joins else [*parts[-1:], found]
        return tuple(parts)

    def _grounds(self, ends: FloatArray, area: int) -> Iterator[tuple[Range, Range | None]]:
        """Yield parts of a leg near an area, and the least and greatest elevation around each."""
        if self.ground is None:
            yield (0.0, 1.0), None
            return
        first, last = _through(ends[0], ends[1], self.boxes[area])
        places = self.projection.inverse(ends[0] + np.array([[first], [last]]) * (ends[1] - ends[0]))
        cells = float((np.abs(places[1] - places[0]) / self.ground.cell).max())
        number = int(min(max(math.ceil(0.5 * cells), 1), _MOST_PARTS)) if math.isfinite(cells) else 1
        shares = np.linspace(first, last, number + 1)
        # (the middles, too, as what is straight on the map is not in degrees)
        at = np.sort(np.concatenate([shares, 0.5 * (shares[:-1] + shares[1:])]))
        lonlat = self.projection.inverse(ends[0] + at[:, None] * (ends[1] - ends[0]))
        for index in range(number):
            here = lonlat[2 * index : 2 * index + 3]
            (west, south), (east, north) = here.min(axis=0).tolist(), here.max(axis=0).tolist()
            yield (float(shares[index]), float(shares[index + 1])), self.ground.range_in((west, south, east, north))

    def _note(self, why: str, leg: int, area: int) -> None:
        self.untold.setdefault(why, []).append((leg, area))

    def _ends(self, leg: int) -> FloatArray:
        return self.route[[leg, min(leg + 1, len(self.route) - 1)]]

    # as `HeightOverlap`

    def on_leg(self, leg: int, area: int) -> Shares:
        """Return on which parts of a leg the aircraft may be as high as an area is."""
        return self._shares(self.profile.legs[leg], area, self._ends(leg), leg)

    def at_place(self, place: int, area: int) -> bool:
        """Tell whether it may be so where it goes up, down or around a place of the route."""
        heights = self.profile.places[place]
        leg = min(place, len(self.profile.legs) - 1)
        if heights is None:
            heights = self.profile.legs[leg]
        return bool(self._shares(heights, area, self.route[[place, place]], leg))

    def goes_upright(self, place: int) -> bool:
        """Tell whether it goes up or down there."""
        return self.profile.places[place] is not None

    def note_all_count(self, leg: int) -> None:
        """Take note that on a leg there is too much to tell: all areas on it count."""
        self._note("there are too many of them to tell apart", leg, -1)

    def kinds(self) -> tuple[IntArray, BoolArray] | None:
        """Return of which kind each leg is, and which areas legs of a kind may meet somewhere."""
        numbers: dict[Heights, int] = {}
        kind = np.array([numbers.setdefault(heights, len(numbers)) for heights in self.profile.legs])
        if len(numbers) * len(self.limits) > _MOST_TABLE:
            return None
        which = {limits: number for number, limits in enumerate(dict.fromkeys(self.limits))}
        columns = np.array([which[limits] for limits in self.limits])
        table = np.array([[self._may_meet(heights, limits) for limits in which] for heights in numbers])
        return kind, table[:, columns]

    def _may_meet(self, heights: Heights, limits: Limits | None) -> bool:
        """Tell whether the heights of a leg and of an area overlap, as far as is known without the ground."""
        if limits is None or heights.reference is None:
            return True
        return self._within(heights, limits, None, (0.0, 1.0))[0] is not None

    def holds_all(self, area: int) -> bool:
        """Tell whether an area counts wherever this plan may be high: none at its heights comes through it."""
        limits = self.limits[area]
        if limits is None or not limits.bounded:
            return True
        ground = self._around(area)
        return all(self._is_inside(heights, limits, ground) for heights in dict.fromkeys(self.profile.legs))

    def _is_inside(self, heights: Heights, limits: Limits, ground: Range | None) -> bool:
        if heights.reference is None:
            return True
        for limit, sign in limits.bounded:
            more = difference(_ABOVE[heights.reference], limit.reference, ground, self.home)
            if more is None and self.ground is None:
                continue
            ends = heights.low if sign > 0.0 else heights.high
            if more is None or any(sign * (end + more[0 if sign > 0.0 else 1] - limit.metres) < 0.0 for end in ends):
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

    def _not_compared(self, heights: Heights, limits: Limits) -> str:
        """Say why heights of a leg and of an area cannot be compared, and what would help."""
        ours = _ABOVE[heights.reference] if heights.reference is not None else ""
        theirs = {limit.reference for limit, _ in limits.bounded} - {ours}
        needs = ["the height of home above the sea in the plan"] if ours == "HOME" and self.home is None else []
        if "AGL" in {ours, *theirs}:
            needs += ["--ground FILE.tif"] if self.ground is None else ["a raster of elevations that has data there"]
        others = " and ".join(_WORDS[one] for one in sorted(theirs))
        return f"heights {_WORDS[ours]} and {others} cannot be compared ({' and '.join(needs)} would do)"

    # for reports

    def words_at(self, number: int, area: int, *, is_place: bool) -> str:
        """Say how high a leg, or a place of the route, and an area are; nothing where the area has no limits."""
        limits = self.limits[area]
        heights = self.profile.places[number] if is_place else self.profile.legs[number]
        heights = heights or self.profile.legs[min(number, len(self.profile.legs) - 1)]
        if limits is None or not limits.bounded:
            return ""
        return f"at {_high(heights)}, of {limits}"

    def notes(self) -> list[str]:
        """Say why areas count at all heights, and where."""
        found = []
        for why, pairs in list(self.untold.items())[:_MOST_NOTES]:
            legs = dict.fromkeys(leg for leg, _ in pairs)
            more = f" and {len(legs) - 1} more" if len(legs) > 1 else ""
            numbers = {area for _, area in pairs}
            areas = "all areas" if -1 in numbers else counted(len(numbers), "area")
            found.append(f"leg {next(iter(legs)) + 1}{more}: {areas} on it taken as closed at all heights: {why}")
        return found


def _at_least_nothing(first: float, last: float) -> Range | None:
    """Return where a number that changes evenly from one value to another is not below 0; exact at the ends."""
    if first >= 0.0 and last >= 0.0:
        return 0.0, 1.0
    if first < 0.0 and last < 0.0:
        return None
    share = first / (first - last) if math.isfinite(first) and math.isfinite(last) else 0.5
    # a few roundings to the safe side
    share = share + 1e-12 if first >= 0.0 else share - 1e-12
    share = min(max(share, 0.0), 1.0)
    return (0.0, share) if first >= 0.0 else (share, 1.0)


def _through(start: FloatArray, end: FloatArray, box: FloatArray) -> Range:
    """Return the part of a leg that is in a box, or all of it."""
    first, last = 0.0, 1.0
    for axis in (0, 1):
        low, high, step = box[axis] - start[axis], box[axis + 2] - start[axis], end[axis] - start[axis]
        if step != 0.0:
            one, other = sorted((float(low / step), float(high / step)))
            first, last = max(first, one), min(last, other)
    return (max(first - 1e-9, 0.0), min(last + 1e-9, 1.0)) if first <= last else (0.0, 1.0)


def _high(heights: Heights) -> str:
    """Say how high a leg is."""
    if heights.reference is None:
        return "heights that are not known"
    above = _WORDS[_ABOVE[heights.reference]]
    low, high = heights.lowest, heights.highest
    if low == high:
        return f"{high:.6g} m {above}"
    return f"{high:.6g} m {above} or less" if math.isinf(low) else f"{low:.6g} to {high:.6g} m {above}"
