"""Flight plans: waypoints that an aircraft flies to in order, along straight legs."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from types import NoneType
from typing import Final, Literal, NoReturn, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, place, shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import NO_NUMBERS, instance, is_one_of, items, point_array
from cgla_graph.airspace.flight_plans.fence import Fence
from cgla_graph.errors import PlanError, ProblemError

#: Reference of an altitude: the place of take-off, the ground below, mean sea level, or the ellipsoid of WGS84.
Reference: TypeAlias = Literal["home", "ground", "sea", "ellipsoid"]
#: Action of an aircraft at a waypoint; with "touch-down" it goes down to the ground, and flies on.
Role: TypeAlias = Literal["take-off", "waypoint", "touch-down", "landing"]
Coordinates: TypeAlias = Literal["lonlat", "plane"]

REFERENCES: Final[tuple[Reference, ...]] = get_args(Reference)
ROLES: Final[tuple[Role, ...]] = get_args(Role)
#: Waypoints of a plan, and of a file that is read or written, at most.
MOST_WAYPOINTS: Final = 250_000
#: Least and greatest altitude, metres: below the shore of the Dead Sea, and at the edge of space.
ALTITUDES: Final = (-1e3, 1e5)
#: Least altitude of a flight above each reference, metres: nothing flies below the ground or the place of take-off, and
#: the lowest land, at the Dead Sea, is about 440 m below the sea.
LEAST_FLOWN: Final[dict[Reference, float]] = {"home": 0.0, "ground": 0.0, "sea": -500.0, "ellipsoid": -500.0}
#: Greatest speed (m/s), and greatest radius of a circle around a waypoint (m).
MOST_SPEED, MOST_RADIUS = 1e4, 1e6
#: Greatest number of turns of a circle, and longest stay at a waypoint (s).
MOST_TURNS, LONGEST_STAY = 1e6, 1e9
_LONGEST_NAME: Final = 200


def fault(where: str, wrong: str, allowed: str) -> NoReturn:
    """Raise a `PlanError` of one line: the place, the fault, and the allowed values."""
    raise PlanError(" ".join(f"{place(where)}: {wrong}; {allowed}".split()))


@contextmanager
def located(where: str) -> Iterator[None]:
    """Put the place in front of the messages of errors raised inside."""
    try:
        yield
    except PlanError as error:
        msg = f"{where}: {error}"
        raise PlanError(msg) from error


@dataclass(frozen=True)
class Waypoint:
    """
    A place that the aircraft flies to.

    Parameters
    ----------
    x, y
        Longitude and latitude, degrees; or x and y, map units, in a plan whose `coordinates` are ``"plane"``.
    altitude
        Metres above `reference`; None if the plan has no altitude here. Above the ground, at least 0 in flight.
    reference
        ``"home"``: above the place of take-off; ``"ground"``: above the ground below; ``"sea"``: above mean sea level;
        ``"ellipsoid"``: above WGS84.
    speed
        Speed of the leg to the waypoint, m/s; None if the plan leaves it to the aircraft.
    role
        ``"take-off"``, ``"waypoint"``, ``"touch-down"`` (down to the ground, and on) or ``"landing"``.
    loiter_radius
        Radius of the circle that is flown around the waypoint, metres; 0 for none.
    pass_radius
        The aircraft passes the waypoint at this distance or less, metres; 0 if it flies over it.
    turns
        How often the circle is flown; 0 if the plan does not say so.
    stay
        How long the aircraft stays at the waypoint, or on its circle, seconds.
    acceptance
        By the default of its autopilot, the aircraft turns to the next waypoint at this distance from the waypoint or
        less, metres: it may cut the corner. It is no part of the plan: plans that differ in it are equal.

    Raises
    ------
    PlanError
        If a number is not finite or out of range, or a word is none of these.

    Examples
    --------
    >>> Waypoint(24.94, 60.17, altitude=80.0, speed=12.0).role
    'waypoint'
    """

    x: float
    y: float
    altitude: float | None = None
    reference: Reference = "home"
    speed: float | None = None
    role: Role = "waypoint"
    loiter_radius: float = 0.0
    pass_radius: float = 0.0
    turns: float = 0.0
    stay: float = 0.0
    acceptance: float = field(default=0.0, compare=False)

    def __post_init__(self) -> None:
        """Check the numbers, and store them as plain floats."""
        _check_position(self)
        if self.speed is not None:
            speed = finite("speed", self.speed, 0.0, MOST_SPEED, " m/s")
            if speed == 0.0:
                fault("speed", "it is 0", "give one above 0 m/s, or none")
            object.__setattr__(self, "speed", speed)
        for name in ("loiter_radius", "pass_radius", "acceptance"):
            object.__setattr__(self, name, finite(name, getattr(self, name), 0.0, MOST_RADIUS, " m"))
        object.__setattr__(self, "turns", finite("turns", self.turns, 0.0, MOST_TURNS))
        object.__setattr__(self, "stay", finite("stay", self.stay, 0.0, LONGEST_STAY, " s"))
        for name, value, allowed in (("reference", self.reference, REFERENCES), ("role", self.role, ROLES)):
            if not is_one_of(value, allowed):
                fault(name, f"it is {shown(value)}", f"choose one of {', '.join(allowed)}")
        # (the ground may be lower than home)
        if self.altitude is not None and self.reference == "ground" and self.role in {"take-off", "waypoint"}:
            _check_flown(self.altitude, self.reference)

    @property
    def reach(self) -> float:
        """The distance from the waypoint within which the aircraft flies there, metres."""
        return max(self.loiter_radius, self.pass_radius)


def _check_flown(altitude: float, reference: Reference) -> None:
    """Check that the altitude of a flight is not below all ground."""
    wrong, _, allowed = below_ground(altitude, reference).partition("; ")
    if wrong:
        fault("altitude", wrong, allowed)


def finite(name: str, value: object, least: float, most: float, unit: str = "") -> float:
    """
    Return a finite number within a range, or raise `PlanError`.

    Examples
    --------
    >>> finite("speed", 12, 0.0, 100.0, " m/s")
    12.0
    """
    number = math.nan
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, NO_NUMBERS):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not (math.isfinite(number) and least <= number <= most):
        allowed = "" if math.isinf(most) else f" from {least:g} to {most:g}{unit}"
        fault(name, f"it is {shown(value)}", f"give a finite number{allowed}")
    return number


def _check_position(one: "Waypoint | Home") -> None:
    """Check the place and the altitude, and store them as plain floats."""
    for name in ("x", "y"):
        object.__setattr__(one, name, finite(name, getattr(one, name), -math.inf, math.inf))
    if one.altitude is not None:
        object.__setattr__(one, "altitude", finite("altitude", one.altitude, *ALTITUDES, " m"))


def below_ground(altitude: float, reference: Reference) -> str:
    """
    Return why an altitude is below all ground, and the least that is allowed; empty if it is not.

    Examples
    --------
    >>> below_ground(-5.0, "home"), below_ground(-400.0, "sea")
    ('it is -5 m above home, below the ground; give at least 0 m', '')
    """
    least = LEAST_FLOWN[reference]
    if not altitude < least:
        return ""
    where = "the ground" if least == 0.0 else "all land"
    the = "" if reference in {"home", "ground"} else "the "
    return f"it is {altitude:g} m above {the}{reference}, below {where}; give at least {least:g} m"


def _check_types(plan: "FlightPlan") -> None:
    """Check that the parts of a plan are waypoints and a home."""
    for one in plan.waypoints:
        instance("a waypoint", one, Waypoint, "Waypoint(x, y)", PlanError)
    instance("home", plan.home, (Home, NoneType), "Home(x, y)", PlanError)


@dataclass(frozen=True)
class Home:
    """
    The place where the aircraft starts, from which altitudes above home are measured.

    Parameters
    ----------
    x, y
        As in a `Waypoint`.
    altitude
        Metres above mean sea level; None if unknown.

    Raises
    ------
    PlanError
        If a number is not finite or out of range.

    Examples
    --------
    >>> Home(24.94, 60.17).altitude is None
    True
    """

    x: float
    y: float
    altitude: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers, and store them as plain floats."""
        _check_position(self)


@dataclass(frozen=True)
class FlightPlan(ShortRepr):
    """
    The waypoints that an aircraft flies to, and its home.

    Parameters
    ----------
    waypoints
        At least one, in the order of flight; a take-off is the first, a landing the last.
    home
        Where the aircraft starts; None if the plan has no home.
    name
        Name of the plan, may be empty. Runs of blanks and unprintable characters become one space; 200 characters are
        kept.
    coordinates
        ``"lonlat"``: longitude and latitude (WGS84), degrees; ``"plane"``: x and y, map units.
    remarks
        What the reader of a file left out or interpreted: nothing of a file is left out without a remark.
    unknown
        Where the aircraft flies by the file is not known: a sentence for each leg, circle, climb or number that leaves
        it open, with what to give. Such a plan is not clean, and is not written to another file.
    fence
        The areas that the aircraft must stay inside of, and those that it must stay out of.
    vehicle, autopilot
        Numbers of MAV_TYPE and MAV_AUTOPILOT of the aircraft that the plan is for; None if it is for any.
    untimed
        Why it is not known how long the flight takes: a sentence for each stay of which the file does not say how long
        it is. Circles without turns or a stay, and touch-downs, are not named here.
    untimed_in_wind
        The same for speeds that the file gives through the air, and that are taken as over the ground.

    Raises
    ------
    PlanError
        If there is no waypoint, or more than 250 000, or a place is not on the Earth.

    Examples
    --------
    >>> plan = FlightPlan((Waypoint(24.94, 60.17), Waypoint(24.99, 60.2)), name="to the east")
    >>> plan.lonlat.tolist()
    [[24.94, 60.17], [24.99, 60.2]]
    """

    waypoints: tuple[Waypoint, ...]
    home: Home | None = None
    name: str = ""
    coordinates: Coordinates = "lonlat"
    remarks: tuple[str, ...] = field(default=(), compare=False)
    unknown: tuple[str, ...] = ()
    fence: tuple[Fence, ...] = ()
    vehicle: int | None = field(default=None, compare=False)
    autopilot: int | None = field(default=None, compare=False)
    untimed: tuple[str, ...] = ()
    untimed_in_wind: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the plan as a whole."""
        object.__setattr__(self, "waypoints", items("waypoints", self.waypoints, "a list of waypoints", PlanError))
        _check_types(self)
        if not isinstance(self.name, str):
            fault("name", f"it is {shown(self.name)}", "give a text")
        printable = "".join(char if char.isprintable() else " " for char in self.name[:2000])
        object.__setattr__(self, "name", " ".join(printable.split())[:_LONGEST_NAME].strip())
        if not self.waypoints:
            fault("the plan", "it has no waypoint", "give at least one")
        if len(self.waypoints) > MOST_WAYPOINTS:
            fault("the plan", f"it has {len(self.waypoints)} waypoints", f"give at most {MOST_WAYPOINTS}")
        if not is_one_of(self.coordinates, get_args(Coordinates)):
            fault("coordinates", f"they are {shown(self.coordinates)}", "choose lonlat or plane")
        if self.coordinates == "lonlat":
            places = np.array([(one.x, one.y) for one in self.marks])
            for index in np.nonzero((np.abs(places) > (180.0, 90.0)).any(axis=1))[0][:1].tolist():
                what = "home" if self.marks[index] is self.home else f"waypoint {index - (self.home is not None)}"
                fault(what, f"it is at {tuple(places[index].tolist())}", PLACES)
        for index, one in enumerate(self.waypoints):
            if one.role == "take-off" and index:
                fault(f"waypoint {index}", "it is a take-off", "only the first one may be")
            if one.role == "landing" and index != len(self.waypoints) - 1:
                fault(f"waypoint {index}", "it is a landing", "only the last one may be")

    @classmethod
    def along(
        cls,
        lonlat: ArrayLike,
        *,
        altitude: float | None = None,
        reference: Reference = "home",
        speed: float | None = None,
        name: str = "",
    ) -> "FlightPlan":
        """
        Make the plan of a path: take-off and home at its start, landing at its end.

        Parameters
        ----------
        lonlat
            Longitudes and latitudes, degrees, shape ``(m, 2)`` with ``m >= 1``.
        altitude
            Altitude of the flight, metres above `reference`: at least 0 above home and ground, -500 above the sea and
            the ellipsoid. The landing is at 0 m above home.
        speed
            Speed of the flight, m/s.
        name
            Name of the plan.

        Raises
        ------
        PlanError
            If a coordinate, the altitude or the speed is not finite or out of range.

        Examples
        --------
        >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.0)], altitude=80, speed=15)
        >>> [(one.role, one.x, one.altitude) for one in plan.waypoints]
        [('take-off', 24.0, 80.0), ('waypoint', 24.1, 80.0), ('landing', 24.1, 0.0)]
        """
        try:
            places = point_array("lonlat", lonlat)
        except ProblemError as error:
            raise PlanError(str(error)) from error
        if places.ndim != 2 or not len(places):  # noqa: PLR2004 - a list of points
            fault(
                "lonlat",
                f"it has the shape {places.shape}",
                "give one row per waypoint, shape (m, 2), m at least 1",
            )
        (east, north), *others = places.tolist()
        waypoints = [Waypoint(east, north, altitude, reference, role="take-off")]
        if altitude is not None:
            _check_flown(altitude, reference)
        # the last leg is flown at the altitude of the flight, and the descent is vertical
        waypoints += [Waypoint(x, y, altitude, reference, speed) for x, y in others]
        ground = None if altitude is None else 0.0
        waypoints += [Waypoint(x, y, ground, "home", speed, "landing") for x, y in places.tolist()[-1:]]
        return cls(tuple(waypoints), Home(east, north), name)

    def renamed(self, name: str) -> "FlightPlan":
        """
        Return the same plan under another name.

        Examples
        --------
        >>> FlightPlan((Waypoint(24.1, 60.0),)).renamed("mine").name
        'mine'
        """
        return replace(self, name=name)

    @cached_property
    def points(self) -> FloatArray:
        """The waypoints, shape ``(m, 2)``, degrees or map units as `coordinates` says."""
        return np.array([(one.x, one.y) for one in self.waypoints])

    @property
    def marks(self) -> "tuple[Home | Waypoint, ...]":
        """Home, if there is one, and the waypoints."""
        return self.waypoints if self.home is None else (self.home, *self.waypoints)

    @property
    def lonlat(self) -> FloatArray:
        """
        The waypoints' longitudes and latitudes, degrees, shape ``(m, 2)``.

        Raises
        ------
        PlanError
            If the plan is in a plane.
        """
        if self.coordinates != "lonlat":
            fault("the plan", "it is in a plane", "only one with longitudes and latitudes can be on the Earth")
        return self.points

    @property
    def starts_at_home(self) -> bool:
        """Whether the first waypoint is at home, or the plan has no home: there is no leg from home."""
        first = self.waypoints[0]
        return self.home is None or (self.home.x, self.home.y) == (first.x, first.y)

    @cached_property
    def flown(self) -> FloatArray:
        """
        The places that are flown to, shape ``(m, 2)``: home, unless the first waypoint is there, and the waypoints.

        Examples
        --------
        >>> FlightPlan((Waypoint(24.1, 60.0),), home=Home(24.0, 60.0)).flown.tolist()
        [[24.0, 60.0], [24.1, 60.0]]
        """
        home = self.home
        return self.points if home is None or self.starts_at_home else np.vstack([(home.x, home.y), self.points])


#: The allowed range of a place, for messages.
PLACES: Final = "longitude must be in [-180, 180] and latitude in [-90, 90], degrees"


def check_place(where: str, longitude: float, latitude: float) -> Point:
    """
    Return a place on the Earth, or raise `PlanError`.

    Examples
    --------
    >>> check_place("item 1", 24.9, 60.2)
    (24.9, 60.2)
    """
    if not (abs(longitude) <= 180.0 and abs(latitude) <= 90.0):  # noqa: PLR2004 - degrees; NaN fails
        fault(where, f"it is at longitude {longitude:g}, latitude {latitude:g}", PLACES)
    return longitude, latitude


def first_remarks(remarks: Sequence[str], most: int = 20) -> Iterator[str]:
    """
    Yield the first remarks and the number of the others, to keep the list short.

    Examples
    --------
    >>> list(first_remarks(["a", "b", "c"], most=2))
    ['a', 'b', 'and 1 more like these']
    """
    yield from remarks[:most]
    if len(remarks) > most:
        yield f"and {len(remarks) - most} more like these"


def few_read(count: int, where: str) -> None:
    """
    Check that a file has no more places than a plan can have: its waypoints and home.

    Examples
    --------
    >>> few_read(3, "mine.kml")
    """
    if count > MOST_WAYPOINTS + 1:
        fault(where, f"it has {count} places or more", f"give at most {MOST_WAYPOINTS} waypoints")


def few_written(count: int, most: int, kind: str) -> None:
    """
    Check that a plan is small enough for its file to be read again.

    Examples
    --------
    >>> few_written(3, 50_000, "KML")
    """
    if count > most:
        fault("the plan", f"it has {count} waypoints", f"{kind} is written for at most {most}: take .geojson or .csv")


def decimal(value: float) -> str:
    """
    Write a number in full, without an exponent: it reads back to the last bit.

    Examples
    --------
    >>> decimal(24.94), decimal(1e-7), decimal(80.0)
    ('24.94', '0.0000001', '80')
    """
    return np.format_float_positional(value + 0.0, trim="-")
