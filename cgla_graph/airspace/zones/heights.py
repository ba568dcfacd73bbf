"""Heights above ground, sea and ellipsoid, and whether a flight is in a layer of a zone: yes, no or unknown."""

import re
from dataclasses import dataclass
from typing import Final, Literal, TypeAlias

from cgla_graph._types import Bounds
from cgla_graph._validate import finite_number, non_negative_number
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Reference, below_ground
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.shapes import short
from cgla_graph.airspace.zones.zone import Layer
from cgla_graph.errors import FileFormatError, ProblemError

Range: TypeAlias = tuple[float, float]

#: References of heights of flights, as plans write them.
REFERENCES: Final[dict[str, Reference]] = {"AGL": "ground", "AMSL": "sea", "WGS84": "ellipsoid", "HOME": "home"}
#: The same, the other way round.
ABOVE: Final[dict[Reference, str]] = {plans: zones for zones, plans in REFERENCES.items()}
#: Greatest altitude, metres: the edge of space.
MOST_ALTITUDE: Final = 1e5
#: Heights beyond a floor or ceiling by at most this count as within, metres, because sums of altitudes are rounded.
ROUNDING: Final = 1e-9
#: Bounds of the height of the WGS84 ellipsoid above mean sea level, metres: EGM96 is between -86 and 107.
GEOID = (-87.0, 108.0)
ALTITUDE = re.compile(r"([+-]?\d+(?:\.\d*)?(?:e[+-]?\d+)?)\s*(?:m\s*)?(AGL|AMSL|WGS84|HOME)?", re.IGNORECASE | re.ASCII)
UNREAD: Final = "give metres above ground, as 100, or above the sea, as '450 AMSL'"


@dataclass(frozen=True)
class Altitude:
    """
    Altitude of a flight.

    Parameters
    ----------
    metres
        Metres above the reference: at least 0 above the ground and home, and -500 above the sea and the ellipsoid, as
        there is land down to -440 m; at most 100 000.
    reference
        The ground (AGL), mean sea level (AMSL), the ellipsoid (WGS84), or the start of the flight (HOME), which cannot
        be compared with limits of zones.

    Raises
    ------
    FileFormatError
        If the altitude is no number, or out of range, or there is no such reference.

    Examples
    --------
    >>> Altitude.of("450 AMSL"), Altitude.of(100)
    (Altitude(metres=450.0, reference='AMSL'), Altitude(metres=100.0, reference='AGL'))
    >>> str(Altitude.of("-400 AMSL"))
    '-400 m AMSL'
    """

    metres: float
    reference: Literal["AGL", "AMSL", "WGS84", "HOME"] = "AGL"

    def __post_init__(self) -> None:
        """Check the altitude."""
        if self.reference not in REFERENCES:
            msg = f"the reference of the altitude is {short(self.reference)}; give one of {', '.join(REFERENCES)}"
            raise FileFormatError(msg)
        try:
            wrong = "" if abs(finite_number("altitude", self.metres)) <= MOST_ALTITUDE else UNREAD
        except ProblemError:
            wrong = UNREAD
        if wrong:
            msg = f"altitude is {short(self.metres)}; {wrong}"
            raise FileFormatError(msg)
        if wrong := below_ground(self.metres, REFERENCES[self.reference]):
            msg = f"altitude {wrong.removeprefix('it ')}"
            raise FileFormatError(msg)

    def __str__(self) -> str:
        """Return the altitude with unit and reference."""
        return f"{self.metres:.6g} m {self.reference}"

    @classmethod
    def of(cls, value: "str | float | Altitude") -> "Altitude":
        """
        Read metres above the ground, or a number of metres followed by its reference.

        Raises
        ------
        FileFormatError
            If it is neither, or out of range.
        """
        if isinstance(value, Altitude):
            return value
        match = None if isinstance(value, bool) else ALTITUDE.fullmatch(str(value).strip())
        if match is None or not abs(float(match[1])) <= MOST_ALTITUDE:
            msg = f"altitude is {short(value)}; {UNREAD}"
            raise FileFormatError(msg)
        return cls(float(match[1]), (match[2] or "AGL").upper())  # type: ignore[arg-type]


def meets(
    layer: Layer,
    flight: Altitude | None,
    ground: Ground | None,
    *,
    vertical_clearance: float = 0.0,
    from_ground: bool = False,
    near: Bounds | None = None,
) -> bool | None:
    """
    Return whether a flight is in a layer somewhere; None if unknown.

    Parameters
    ----------
    layer
        Layer of a zone.
    flight
        Altitude of the flight; None for all heights.
    ground
        Elevations to compare heights above ground with heights above the sea.
    vertical_clearance
        Metres by which floor and ceiling are widened.
    from_ground
        Whether the aircraft is anywhere between the ground and its altitude, as where it takes off or lands.
    near
        West, south, east, north of a box around the place of the flight, degrees; None: anywhere in the layer.

    Examples
    --------
    >>> import shapely
    >>> from cgla_graph.airspace.zones.zone import Limit
    >>> layer = Layer(shapely.box(6, 49, 7, 50), upper=Limit(450.0, "AMSL"))
    >>> [meets(layer, Altitude.of(flight), None) for flight in ("400 AMSL", "500 AMSL", "100 AGL")]
    [True, False, None]
    >>> low = Layer(shapely.box(6, 49, 7, 50), upper=Limit(50.0, "AGL"))
    >>> [meets(low, Altitude.of(80), None, from_ground=column) for column in (False, True)]
    [False, True]
    """
    if flight is None:
        return True
    answers: list[bool | None] = []
    seen: list[Range | None] = []
    for limit, sign in layer.limits.bounded:
        # (a column is below a ceiling that is not below the ground)
        at_ground = from_ground and sign < 0.0
        metres, reference = (0.0, "AGL") if at_ground else (flight.metres, flight.reference)
        if limit.reference != reference and not seen:
            around = None
            if ground is not None:
                around = ground.range_over(layer.area) if near is None else ground.range_in(near)
            seen.append(around)
        more = height_offset(reference, limit.reference, seen[0] if seen else None)
        # the greatest possible height decides whether it is above a floor, the least whether it is below a ceiling
        end = None if more is None else more[1 if sign > 0.0 else 0]
        answers.append(None if end is None else sign * (metres + end - limit.metres) + vertical_clearance >= -ROUNDING)
    return False if False in answers else None if None in answers else True


def vertical_clearance_of(value: object) -> float:
    """
    Return a vertical clearance as a float, metres.

    Raises
    ------
    FileFormatError
        If it is no number of at least 0.

    Examples
    --------
    >>> vertical_clearance_of(30)
    30.0
    """
    try:
        return non_negative_number("vertical_clearance", value)
    except ProblemError as error:
        msg = f"{error}; give metres by which floors and ceilings of zones are widened"
        raise FileFormatError(msg) from error


def home_heights(plan: FlightPlan, ground: Ground | None) -> Range | None:
    """
    Return the least and greatest height of home above the sea, by the plan and by the raster; None if it is not known.

    A plan without home begins there if its first waypoint is a take-off.

    Examples
    --------
    >>> import numpy as np
    >>> ground = Ground(np.array([[100.0, 200.0, 300.0, 400.0]]), (6.0, 49.0, 10.0, 50.0))
    >>> plan = FlightPlan.along([(6.5, 49.5), (8.5, 49.5)], altitude=80)
    >>> home_heights(plan, ground), home_heights(plan, None)
    ((100.0, 200.0), None)
    """
    first = plan.home or plan.waypoints[0]
    known = []
    # (files for autopilots write 0 m for an unknown height)
    if plan.home is not None and plan.home.altitude:
        known.append((plan.home.altitude, plan.home.altitude))
    if ground is not None and (plan.home is not None or plan.waypoints[0].role == "take-off"):
        seen = ground.range_in((first.x, first.y, first.x, first.y))
        known += [] if seen is None else [seen]
    return (min(low for low, _ in known), max(high for _, high in known)) if known else None


def height_offset(reference: str, other: str, ground: Range | None, home: Range | None = None) -> Range | None:
    """
    Return the offset from heights above one reference to heights above another, least and greatest; None if unknown.

    Parameters
    ----------
    reference, other
        ``AGL``, ``AMSL``, ``WGS84`` or ``HOME``.
    ground, home
        Least and greatest height of the ground and of home above the sea, metres; None if unknown.

    Examples
    --------
    >>> height_offset("AGL", "AMSL", (300.0, 350.0)), height_offset("AGL", "AMSL", None)
    ((300.0, 350.0), None)
    """
    if reference == other:
        return 0.0, 0.0
    above_sea = {"AMSL": (0.0, 0.0), "WGS84": (-GEOID[1], -GEOID[0]), "HOME": home, "AGL": ground}
    ours, theirs = above_sea[reference], above_sea[other]
    return None if ours is None or theirs is None else (ours[0] - theirs[1], ours[1] - theirs[0])
