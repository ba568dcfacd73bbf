"""Heights of a plan along its legs: between two waypoints, the altitude changes linearly."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference, Role, Waypoint

#: Roles of waypoints at which the aircraft is on the ground.
_ON_GROUND: Final[set[Role]] = {"touch-down", "landing"}
#: Why the heights of a leg are not known.
NOT_SAID = "the plan has no altitude there"
MIXED = "its altitudes are above different things"


@dataclass(frozen=True)
class Heights:
    """
    Heights of the aircraft on a leg, or above one place.

    Parameters
    ----------
    reference
        Reference of the heights; None if they are unknown.
    low, high
        The least and the greatest possible height at the start and at the end, metres, linear in between; minus
        infinity if the aircraft may be on the ground.
    why
        Why the heights are unknown.

    Examples
    --------
    >>> climb = Heights("home", (50.0, 100.0), (50.0, 100.0))
    >>> climb.at(0.5), climb.lowest, climb.highest
    ((75.0, 75.0), 50.0, 100.0)
    """

    reference: Reference | None
    low: tuple[float, float] = (-math.inf, -math.inf)
    high: tuple[float, float] = (math.inf, math.inf)
    why: str = ""

    @property
    def lowest(self) -> float:
        """The least height."""
        return min(self.low)

    @property
    def highest(self) -> float:
        """The greatest height."""
        return max(self.high)

    def at(self, share: float) -> tuple[float, float]:
        """Return the least and the greatest height at a share of the leg, from 0 to 1."""
        return _between(self.low, share), _between(self.high, share)


def _between(ends: tuple[float, float], share: float) -> float:
    # (equal ends may be infinite)
    return ends[0] if ends[0] == ends[1] else (1.0 - share) * ends[0] + share * ends[1]


@dataclass(frozen=True)
class Profile:
    """
    Heights of a plan.

    Parameters
    ----------
    legs
        Heights on each leg.
    places
        Heights above or around each place of the route where the aircraft climbs, descends or circles; None elsewhere.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80)
    >>> profile = profile_of(plan, (1, 2))
    >>> profile.legs[0].at(0.5), [(one.lowest, one.highest) for one in profile.places]
    ((80.0, 80.0), [(-inf, 80.0), (-inf, 80.0)])
    """

    legs: tuple[Heights, ...]
    places: tuple[Heights | None, ...]

    def with_ends(self, column: Heights) -> "Profile":
        """
        Return the profile with other heights at the first and the last place.

        Examples
        --------
        >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80)
        >>> high = profile_of(plan, (1, 2)).with_ends(Heights("home", (0.0, 0.0), (120.0, 120.0)))
        >>> high.places[0].highest, high.legs[0].highest
        (120.0, 80.0)
        """
        if len(self.places) == 1:
            return Profile((column,), self.places)
        return Profile(self.legs, (column, *self.places[1:-1], column))


def profile_of(plan: FlightPlan, stops: Sequence[int]) -> Profile:
    """
    Return the heights of a plan.

    An aircraft takes off at the first place and lands at the last one, also if the plan does not say so: there, it is
    anywhere between the ground and the altitude of its waypoint. Some aircraft climb vertically, others along the leg.
    A leg from home, or to or from a landing or the ground, may therefore be anywhere between as well. On a leg to or
    from a waypoint that is passed at a distance, on one to a circle, and near such waypoints, the aircraft may have the
    altitude of either end.

    Parameters
    ----------
    plan
        The plan.
    stops
        Place by place of the route (equal neighbours count once): 0 for home, else the number of the first waypoint
        there, from 1.
    """
    last = [*stops[1:], len(plan.waypoints) + 1]
    groups = [plan.waypoints[max(stop, 1) - 1 : end - 1] for stop, end in zip(stops, last, strict=True)]
    # (a plan may begin or end with a waypoint on the ground)
    ends = {0: groups[0][-1:], len(groups) - 1: groups[-1][:1]}
    grounded = {number for number, waypoints in ends.items() if all(map(_is_low, waypoints))}
    legs = [
        _leg(before[-1] if before else None, after[0], from_ground=not grounded.isdisjoint({number, number + 1}))
        for number, (before, after) in enumerate(itertools.pairwise(groups))
    ]
    places: list[Heights | None] = []
    for number, group in enumerate(groups):
        came = groups[number - 1][-1] if number and groups[number - 1] else None
        goes = groups[number + 1][0] if number + 1 < len(groups) else None
        places.append(_upright(group, came, goes, from_ground=number in {0, len(groups) - 1}))
    if len(groups) == 1:
        alone = places[0] or _span([groups[0][0]])
        legs, places = [alone], [None]
    return Profile(tuple(legs), tuple(places))


def _is_low(one: Waypoint) -> bool:
    """Return whether a waypoint is not above the ground or home."""
    return one.altitude is not None and one.altitude <= 0.0 and one.reference in {"home", "ground"}


def _leg(start: Waypoint | None, end: Waypoint, *, from_ground: bool = False) -> Heights:
    """Return the heights of a leg from a waypoint, or from home on the ground, to another waypoint."""
    if start is None:
        return _span([end], from_ground=True)
    if from_ground or end.role in _ON_GROUND or start.role in _ON_GROUND:
        return _span([start, end], from_ground=True)
    if end.loiter_radius > 0.0 or start.pass_radius > 0.0 or end.pass_radius > 0.0:
        return _span([start, end])
    if start.altitude is None or end.altitude is None:
        return Heights(None, why=NOT_SAID)
    if start.reference != end.reference:
        return Heights(None, why=MIXED)
    return Heights(start.reference, (start.altitude, end.altitude), (start.altitude, end.altitude))


def _upright(
    group: Sequence[Waypoint], came: Waypoint | None, goes: Waypoint | None, *, from_ground: bool
) -> Heights | None:
    """Return the heights above or around one place, given its waypoints; None if there is only one height."""
    grounded = from_ground or any(one.role != "waypoint" for one in group)
    if not group or (len(group) == 1 and not grounded and group[0].reach == 0.0):
        return None
    lands = any(one.role in _ON_GROUND for one in group)
    before = [came] if came is not None and (lands or any(one.reach > 0.0 for one in group)) else []
    after = [goes] if goes is not None and any(one.pass_radius > 0.0 for one in group) else []
    return _span([*before, *group, *after], from_ground=grounded)


def _span(waypoints: Sequence[Waypoint], *, from_ground: bool = False) -> Heights:
    """Return the range of heights between those of waypoints, or from the ground up."""
    # a landing is on the ground for any reference of its altitude
    known = [one for one in waypoints if one.role not in _ON_GROUND] or list(waypoints)
    landings = [one for one in waypoints if one.role in _ON_GROUND and one not in known]
    if any(one.altitude is None for one in known):
        return Heights(None, why=NOT_SAID)
    references = {one.reference for one in known}
    if len(references) > 1:
        return Heights(None, why=MIXED)
    reference = known[0].reference
    altitudes = [one.altitude for one in known if one.altitude is not None]
    for one in landings:
        if one.altitude is None or _is_low(one):
            continue
        if one.reference != reference:
            return Heights(None, why=MIXED)
        altitudes.append(one.altitude)
    low, high = -math.inf if from_ground else min(altitudes), max(altitudes)
    return Heights(reference, (low, low), (high, high))
