"""A flight plan: the places that an aircraft flies to, one after the other, straight from each to the next."""

import math
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Final, Literal, NoReturn, TypeAlias, get_args

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, place, shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import NO_NUMBERS, point_array
from cgla_graph.errors import PlanError, ProblemError

#: What an altitude is measured from: where the aircraft took off, the ground below it, the sea's mean level, WGS84.
Reference: TypeAlias = Literal["home", "ground", "sea", "ellipsoid"]
#: What an aircraft does at a waypoint besides flying to it.
Role: TypeAlias = Literal["take-off", "waypoint", "landing"]
Coordinates: TypeAlias = Literal["lonlat", "plane"]

REFERENCES: Final[tuple[Reference, ...]] = get_args(Reference)
ROLES: Final[tuple[Role, ...]] = get_args(Role)
#: A plan has at most so many waypoints, and a file that is written or read at most as many.
MOST_WAYPOINTS: Final = 250_000
#: Altitudes are between these, metres: below the Dead Sea, and where there is no air.
ALTITUDES: Final = (-1e3, 1e5)
#: No aircraft is faster (m/s), and no circle around a waypoint wider (m).
MOST_SPEED, MOST_RADIUS = 1e4, 1e6
_LONGEST_NAME: Final = 200


def fault(where: str, wrong: str, allowed: str) -> NoReturn:
    """Raise the error that says in one line where something is wrong, what, and what is allowed."""
    raise PlanError(" ".join(f"{place(where)}: {wrong}; {allowed}".split()))


@contextmanager
def located(where: str) -> Iterator[None]:
    """Say of errors inside where they are."""
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
        Metres above what `reference` says; None where the plan does not say one.
    reference
        ``"home"``: above where it took off; ``"ground"``: above the ground there; ``"sea"``: above mean sea level;
        ``"ellipsoid"``: above WGS84.
    speed
        At which it flies there, m/s; None where the plan leaves that to the aircraft.
    role
        ``"take-off"``, ``"waypoint"`` or ``"landing"``.
    loiter_radius
        Of the circle that it flies around the place, metres; 0 where it flies none.

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

    def __post_init__(self) -> None:
        """Check the numbers, and keep them as plain floats."""
        _keep_plain(self)
        if self.speed is not None:
            speed = _number("speed", self.speed, 0.0, MOST_SPEED, " m/s")
            if speed == 0.0:
                fault("speed", "it is 0", "give one above 0 m/s, or none")
            object.__setattr__(self, "speed", speed)
        radius = _number("loiter_radius", self.loiter_radius, 0.0, MOST_RADIUS, " m")
        object.__setattr__(self, "loiter_radius", radius)
        for name, value, allowed in (("reference", self.reference, REFERENCES), ("role", self.role, ROLES)):
            if value not in allowed:
                fault(name, f"it is {shown(value)}", f"choose one of {', '.join(allowed)}")


def _plain(name: object) -> str:
    """Return a name in one line of characters that any format can hold."""
    if not isinstance(name, str):
        fault("name", f"it is {shown(name)}", "give a text")
    printable = "".join(char if char.isprintable() else " " for char in name[:2000])
    return " ".join(printable.split())[:_LONGEST_NAME].strip()


def _number(name: str, value: object, least: float, most: float, unit: str = "") -> float:
    """Return a finite number within a range."""
    number = math.nan
    if isinstance(value, int | float | np.integer | np.floating) and not isinstance(value, NO_NUMBERS):
        try:
            number = float(value)
        except OverflowError:
            number = math.inf
    if not (math.isfinite(number) and least <= number <= most):
        fault(name, f"it is {shown(value)}", f"give a finite number{_range(least, most, unit)}")
    return number


def _keep_plain(one: "Waypoint | Home") -> None:
    """Check the place and the altitude, and keep them as plain floats."""
    for name in ("x", "y"):
        object.__setattr__(one, name, _number(name, getattr(one, name), -math.inf, math.inf))
    if one.altitude is not None:
        object.__setattr__(one, "altitude", _number("altitude", one.altitude, *ALTITUDES, " m"))


def _range(least: float, most: float, unit: str) -> str:
    return "" if math.isinf(most) else f" from {least:g} to {most:g}{unit}"


@dataclass(frozen=True)
class Home:
    """
    Where the aircraft starts from, and what altitudes above home count from.

    Parameters
    ----------
    x, y
        As of a `Waypoint`.
    altitude
        Metres above mean sea level; None where it is not known.

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
        """Check the numbers, and keep them as plain floats."""
        _keep_plain(self)


@dataclass(frozen=True)
class FlightPlan(ShortRepr):
    """
    What an aircraft shall fly.

    Parameters
    ----------
    waypoints
        At least one, in the order of flight; the take-off, if there is one, is the first, and the landing the last.
    home
        Where it starts from; None where the plan does not say.
    name
        What it is called; may be empty. Of blanks and what cannot be printed one blank is left, and 200 characters are
        kept.
    coordinates
        ``"lonlat"``: longitude and latitude (WGS84), degrees; ``"plane"``: x and y, map units.
    remarks
        What a file says besides, and what was made of it: no part of the plan is left out without one.
    curves
        Where the aircraft does not fly straight from waypoint to waypoint, one sentence each; empty if it always does.

    Raises
    ------
    PlanError
        If there is no waypoint, or more than 250 000, or a place is none on the Earth.

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
    curves: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the plan as a whole."""
        object.__setattr__(self, "waypoints", tuple(self.waypoints))
        object.__setattr__(self, "name", _plain(self.name))
        if not self.waypoints:
            fault("the plan", "it has no waypoint", "give at least one")
        if len(self.waypoints) > MOST_WAYPOINTS:
            fault("the plan", f"it has {len(self.waypoints)} waypoints", f"give at most {MOST_WAYPOINTS}")
        if self.coordinates not in get_args(Coordinates):
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
        Make the plan that flies a path: take-off and home at its start, landing at its end.

        Parameters
        ----------
        lonlat
            Longitudes and latitudes, degrees, shape ``(m, 2)`` with ``m >= 1``.
        altitude
            At which it is flown, metres above what `reference` says; the landing is at 0 m above home.
        speed
            At which it is flown, m/s.
        name
            What it is called.

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
            fault("lonlat", f"it has the shape {places.shape}", "give a row a waypoint, shape (m, 2) with m at least 1")
        (east, north), *others = places.tolist()
        waypoints = [Waypoint(east, north, altitude, reference, role="take-off")]
        # the last leg is flown at its altitude, and the descent is upright
        waypoints += [Waypoint(x, y, altitude, reference, speed) for x, y in others]
        ground = None if altitude is None else 0.0
        waypoints += [Waypoint(x, y, ground, "home", speed, "landing") for x, y in others[-1:]]
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
        """Home, if it is known, and the waypoints."""
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
        """Whether there is no leg from home to the first waypoint, or no home that is known."""
        first = self.waypoints[0]
        return self.home is None or (self.home.x, self.home.y) == (first.x, first.y)

    @cached_property
    def flown(self) -> FloatArray:
        """
        All that is flown, shape ``(m, 2)``: the way from home to the first waypoint, if it is not there, and the plan.

        Examples
        --------
        >>> FlightPlan((Waypoint(24.1, 60.0),), home=Home(24.0, 60.0)).flown.tolist()
        [[24.0, 60.0], [24.1, 60.0]]
        """
        home = self.home
        return self.points if home is None or self.starts_at_home else np.vstack([(home.x, home.y), self.points])


#: What is said where a place is out of range.
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


def numbered(remarks: Sequence[str], most: int = 20) -> Iterator[str]:
    """
    Yield remarks, of many the first and how many more there are: a file of a million faults has a short answer.

    Examples
    --------
    >>> list(numbered(["a", "b", "c"], most=2))
    ['a', 'b', 'and 1 more like these']
    """
    yield from remarks[:most]
    if len(remarks) > most:
        yield f"and {len(remarks) - most} more like these"


def few_read(count: int, where: str) -> None:
    """
    Check that a file that is read has no more places than a plan: its waypoints, and home.

    Examples
    --------
    >>> few_read(3, "mine.kml")
    """
    if count > MOST_WAYPOINTS + 1:
        fault(where, f"it has {count} places or more", f"give at most {MOST_WAYPOINTS} waypoints")


def few_written(count: int, most: int, kind: str) -> None:
    """
    Check that a file that is written is small enough to be read again.

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
