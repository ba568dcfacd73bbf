"""Facts about a flight that files of autopilots leave to the aircraft, as a user gives them."""

from dataclasses import dataclass
from typing import Final, cast

from cgla_graph._text import shown
from cgla_graph._validate import NO_NUMBERS
from cgla_graph.airspace.flight_plans.plan import MOST_RADIUS, Home, check_place, fault, finite

#: Heights to which autopilots climb before they return home, metres above home, and their sources. (ArduPilot's
#: copters climb to 15 m, which is below that of PX4.)
RETURN_ALTITUDE: Final = (60.0, "PX4's default (RTL_RETURN_ALT)")
PLANE_ALTITUDE: Final = (100.0, "ArduPilot's default of planes (RTL_ALTITUDE)")
#: Distances from a waypoint at which autopilots turn to the next one where the file leaves it open, metres, and their
#: sources, by MAV_AUTOPILOT (3 is ArduPilot, 12 is PX4). (PX4 says of its own that it is not that of a fixed wing.)
ACCEPTANCE: Final = {
    3: (2.0, "ArduPilot's default of multirotors (WPNAV_RADIUS)"),
    12: (10.0, "PX4's default (NAV_ACC_RAD)"),
}
#: How to give a home, for messages.
GIVE_HOME: Final = "set it in the ground station, or give --home LON,LAT"


@dataclass(frozen=True)
class Given:
    """
    Facts about a flight that the file of a plan may leave open.

    Parameters
    ----------
    return_altitude
        Height to which the aircraft climbs before it returns home, metres above home; None for 60 m, the default of PX4
        (its parameter ``RTL_RETURN_ALT``), or 100 m for a plane with ArduPilot.
    loiter_radius
        Radius of circles that the file leaves to the aircraft, metres; 0 if it hovers there; None if unknown.
    home
        Longitude and latitude of the take-off, degrees, or these and metres above the sea; None for that of the file.
    acceptance_radius
        Distance from a waypoint at which the aircraft may turn to the next one where the file leaves it to the
        autopilot, metres; 0 if it flies over it. None for the default of multirotors of the file's autopilot, else that
        of PX4, 10 m (its parameter ``NAV_ACC_RAD``); unknown for a fixed wing and a VTOL.

    Raises
    ------
    PlanError
        If a number is not finite or out of range.

    Examples
    --------
    >>> Given(return_altitude=40).climbs_to()
    (40.0, '40 m above home, as given')
    >>> Given().climbs_to()[1]
    "60 m above home, PX4's default (RTL_RETURN_ALT); --return-altitude M gives another"
    """

    return_altitude: float | None = None
    loiter_radius: float | None = None
    home: tuple[float, ...] | None = None
    acceptance_radius: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers, and store them as plain floats."""
        for name, most in (
            ("return_altitude", 1e5),
            ("loiter_radius", MOST_RADIUS),
            ("acceptance_radius", MOST_RADIUS),
        ):
            value = getattr(self, name)
            if value is not None:
                object.__setattr__(self, name, finite(name, value, 0.0, most, " m"))
        if self.home is not None:
            home = _numbers(self.home)
            check_place("home", home[0], home[1])
            Home(*home)
            object.__setattr__(self, "home", home)

    def climbs_to(self, *, is_ardupilot_plane: bool = False) -> tuple[float, str]:
        """Return the height of the return, metres above home, and its source."""
        if self.return_altitude is not None:
            return self.return_altitude, f"{self.return_altitude:g} m above home, as given"
        height, source = PLANE_ALTITUDE if is_ardupilot_plane else RETURN_ALTITUDE
        return height, f"{height:g} m above home, {source}; --return-altitude M gives another"

    @staticmethod
    def turns_at(autopilot: object) -> tuple[float, str]:
        """Return how far from a waypoint a multirotor may turn by its autopilot's default, metres, and the source."""
        radius, source = ACCEPTANCE[autopilot if type(autopilot) is int and autopilot in ACCEPTANCE else 12]
        return radius, f"{radius:g} m, {source}; --acceptance-radius M gives another"

    def home_of(self, home: Home | None) -> Home | None:
        """Return the given home, else that of the file."""
        return home if self.home is None else Home(*self.home)


def _numbers(home: object) -> tuple[float, ...]:
    parts = list(cast("list[object]", home)) if isinstance(home, tuple | list) else []
    numbers = [part for part in parts if isinstance(part, int | float) and not isinstance(part, NO_NUMBERS)]
    if len(numbers) != len(parts) or len(parts) not in {2, 3}:
        fault("home", f"it is {shown(home)}", "give longitude and latitude, degrees, and if known metres above the sea")
    return tuple(finite("home", number, -1e6, 1e6) for number in numbers)
