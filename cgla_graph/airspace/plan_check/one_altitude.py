"""One altitude at which zones are held against a plan, instead of the plan's own altitudes."""

from copy import copy
from dataclasses import replace
from typing import Final

from cgla_graph.airspace.flight_plans.plan import LEAST_FLOWN, FlightPlan, Reference, Waypoint
from cgla_graph.airspace.flight_plans.profile import Heights
from cgla_graph.airspace.zones.heights import REFERENCES, Altitude

#: References of a plan's altitudes that are compared with the altitude of the check, by the reference of the latter.
_SAME: Final[dict[str, tuple[Reference, ...]]] = {
    "AGL": ("ground", "home"),
    "HOME": ("home",),
    "AMSL": ("sea",),
    "WGS84": ("ellipsoid",),
}
#: Remedy if the altitude is that of a scenario.
OF_THE_MAP: Final = "check it against the files of zones (--zones FILE), as the map's own zones are for that altitude"


def height_of(plan: FlightPlan, waypoint: Waypoint, flight: Altitude) -> float | None:
    """
    Return the altitude of a waypoint above the reference of another altitude, metres; None if it cannot be compared.

    Heights above home count as heights above the ground.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80)
    >>> [height_of(plan, plan.waypoints[0], Altitude.of(text)) for text in ("100 AGL", "100 AMSL")]
    [80.0, None]
    """
    height, home = waypoint.altitude, None if plan.home is None else plan.home.altitude
    if height is not None and waypoint.reference == "home" and flight.reference == "AMSL" and home:
        return height + home
    return height if waypoint.reference in _SAME[flight.reference] else None


def flies_higher(plan: FlightPlan, flight: Altitude, remedy: str) -> str:
    """
    Return why zones at one altitude do not decide about a plan: it says that it flies higher. Empty if it does not.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80)
    >>> flies_higher(plan, Altitude(100.0), ""), flies_higher(plan, Altitude(50.0), "give 80")
    ('', 'it goes up to 80 m above home, and zones were held against 50 m AGL alone: give 80')
    """
    heights = [(height_of(plan, one, flight), one) for one in plan.waypoints]
    known = [(height, one) for height, one in heights if height is not None and height > flight.metres]
    if not known:
        return ""
    highest = max(known, key=lambda pair: pair[0])[1]
    above = f"{highest.altitude:g} m above {highest.reference}"
    return f"it goes up to {above}, and zones were held against {flight.metres:g} m {flight.reference} alone: {remedy}"


def at_one_altitude(plan: FlightPlan, flight: Altitude) -> FlightPlan:
    """
    Return a plan at one altitude; a waypoint that is known to be lower keeps its height.

    Examples
    --------
    >>> plan = FlightPlan((Waypoint(24.0, 60.0), Waypoint(24.1, 60.0, 30.0), Waypoint(24.2, 60.0, 500.0, "sea")))
    >>> [(one.altitude, one.reference) for one in at_one_altitude(plan, Altitude(80.0)).waypoints]
    [(80.0, 'ground'), (30.0, 'ground'), (80.0, 'ground')]
    """
    reference = REFERENCES[flight.reference]

    def changed(one: Waypoint) -> Waypoint:
        height = height_of(plan, one, flight)
        metres = flight.metres if height is None else min(max(height, LEAST_FLOWN[reference]), flight.metres)
        # (not checked again: there may be 250 000)
        level = copy(one)
        object.__setattr__(level, "altitude", metres)
        object.__setattr__(level, "reference", reference)
        return level

    return replace(plan, waypoints=tuple(map(changed, plan.waypoints)))


def column_of(flight: Altitude) -> Heights:
    """
    Return the heights where a flight at one altitude takes off and lands: from the ground up.

    Examples
    --------
    >>> column_of(Altitude.of("450 AMSL")).highest
    450.0
    """
    return Heights(REFERENCES[flight.reference], high=(flight.metres, flight.metres))
