"""The aircraft of a flight time: speeds, power and battery."""

import math
from dataclasses import dataclass, fields
from typing import Any

from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import Point
from cgla_graph._validate import finite_number, point, positive_number
from cgla_graph.airspace.flight_plans.plan import MOST_SPEED
from cgla_graph.errors import ProblemError

#: Default part of a battery that is left at the landing, as usual among drone pilots.
RESERVE = 0.2
#: Greatest power (W) and energy of a battery (Wh): those of a large airliner.
MOST_POWER, MOST_ENERGY = 1e9, 1e9


@dataclass(frozen=True)
class Aircraft(ShortRepr):
    """
    Speeds, power and battery of an aircraft, and the wind that it flies in.

    Parameters
    ----------
    speed
        Speed through the air, metres (map units) per second; None if only the plan's own speeds are known.
    wind
        Velocity of the air to the east and north (along x and y), metres (map units) per second.
    power
        Power all along the flight, watts; None for no energy.
    battery
        Energy of the full battery, watt-hours (ampere-hours times volts); None for no limit.
    reserve
        Part of the battery that must be left at the end, at least 0 and below 1; None for 0.2.
    climb_rate, descent_rate
        Vertical speeds, metres per second; None if unknown: then climbs or descents are left out, and it is said.

    Raises
    ------
    ProblemError
        If a number is out of range, or one is given without another that it needs.

    Examples
    --------
    >>> drone = Aircraft(12.0, power=300.0, battery=90.0)
    >>> drone.usable, drone.share_left
    (72.0, 0.2)
    """

    speed: float | None = None
    wind: Point = (0.0, 0.0)
    power: float | None = None
    battery: float | None = None
    reserve: float | None = None
    climb_rate: float | None = None
    descent_rate: float | None = None

    def __post_init__(self) -> None:
        """Check the numbers, and store them as plain floats."""
        object.__setattr__(self, "wind", point("wind", self.wind))
        if self.wind != (0.0, 0.0) and self.speed is None:
            msg = f"wind is {self.wind}, and there is no speed; give the airspeed (--speed V)"
            raise ProblemError(msg)
        most = {"speed": MOST_SPEED, "power": MOST_POWER, "battery": MOST_ENERGY}
        units = {"power": " W", "battery": " Wh"}
        for name in ("speed", "power", "battery", "climb_rate", "descent_rate"):
            value = getattr(self, name)
            if value is None:
                continue
            number = positive_number(name, value)
            if number > most.get(name, MOST_SPEED):
                unit = units.get(name, " m/s")
                msg = f"{name} is {number:g}; give {most.get(name, MOST_SPEED):g}{unit} at most"
                raise ProblemError(msg)
            object.__setattr__(self, name, number)
        if self.reserve is not None and self.battery is None:
            msg = f"reserve is {shown(self.reserve)}, and there is no battery; give its energy (--battery WH)"
            raise ProblemError(msg)
        if self.battery is not None:
            if self.power is None:
                msg = f"battery is {self.battery:g} Wh without a power; give that of the aircraft (--power W)"
                raise ProblemError(msg)
            if self.reserve is not None:
                object.__setattr__(self, "reserve", _share(self.reserve))

    @property
    def usable(self) -> float:
        """Energy that the flight may use, watt-hours; infinite without a battery."""
        return math.inf if self.battery is None else self.battery * (1.0 - self.share_left)

    @property
    def share_left(self) -> float:
        """Part of the battery that must be left at the end."""
        return RESERVE if self.reserve is None else self.reserve

    @property
    def is_calm(self) -> bool:
        """Whether there is no wind."""
        return self.wind == (0.0, 0.0)

    def rate(self, *, up: bool) -> float:
        """Return the vertical speed upwards or downwards, metres per second; NaN if unknown."""
        rate = self.climb_rate if up else self.descent_rate
        return math.nan if rate is None else rate

    @property
    def fastest(self) -> float:
        """Greatest ground speed in any direction, metres (map units) per second; NaN without a speed."""
        return math.nan if self.speed is None else self.speed + math.hypot(*self.wind)

    def energy(self, seconds: float) -> float:
        """
        Return the energy that a time of flight takes, watt-hours; NaN without a power.

        Examples
        --------
        >>> Aircraft(power=360.0).energy(10.0)
        1.0
        """
        return math.nan if self.power is None else self.power * seconds / 3600.0

    def reserve_text(self) -> str:
        """
        Write the reserve, and whether it is the default.

        Examples
        --------
        >>> Aircraft(power=1.0, battery=90.0).reserve_text()
        'a reserve of 20 % (default; --reserve gives another)'
        """
        source = " (default; --reserve gives another)" if self.reserve is None else ""
        return f"a reserve of {100.0 * self.share_left:.6g} %{source}"

    def document(self) -> dict[str, Any]:
        """Return the aircraft as JSON."""
        known = {one.name: getattr(self, one.name) for one in fields(self)}
        return {**known, "wind": list(self.wind), "reserve": None if self.battery is None else self.share_left}


def _share(value: object) -> float:
    share = finite_number("reserve", value)
    if not 0.0 <= share < 1.0:
        msg = f"reserve is {share:g}; give the part of the battery that is left, from 0 to below 1: 0.2 for 20 %"
        raise ProblemError(msg)
    return share
