"""Options ``--speed``, ``--power`` and ``--battery``: time and energy of a flight."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from cgla_graph._text import shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import finite_number
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.airspace.endurance.flight_time import FlightTime, flight_time
from cgla_graph.airspace.flight_plans.plan import Reference
from cgla_graph.comparisons.cli.options import ExportOptions, FlightTimeOptions
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.timing import timed, times_along


def read_aircraft(options: FlightTimeOptions) -> Aircraft | None:
    """
    Return the aircraft that options describe; None without any.

    Raises
    ------
    CglaError
        If an option is malformed, out of range, or needs another one.

    Examples
    --------
    >>> read_aircraft(FlightTimeOptions(20.0, "-3,4", 300.0, "90Wh", "30 %")).usable
    63.0
    """
    if options == FlightTimeOptions():
        return None
    wind, reserve = _wind(options.wind), _reserve(options.reserve)
    if options.wind is not None and options.speed is None:
        msg = "--wind needs the airspeed: also give --speed V"
        raise CglaError(msg)
    try:
        return Aircraft(
            options.speed,
            wind,
            options.power,
            _battery(options.battery),
            reserve,
            options.climb_rate,
            options.descent_rate,
        )
    except ProblemError as error:
        name, rest = str(error).split(" ", 1)
        msg = f"--{name.replace('_', '-')} {rest}"
        raise CglaError(msg) from error


def _battery(text: str | None) -> float | None:
    """Return watt-hours."""
    if text is None:
        return None
    number = text.strip().lower().removesuffix("wh").strip()
    try:
        return finite_number("--battery", float(number))
    except ValueError as error:
        allowed = "give watt-hours: ampere-hours times volts (5000 mAh at 14.8 V are 74)"
        msg = f"--battery is {shown(text)}; {allowed}"
        raise CglaError(msg) from error


def _reserve(text: str | None) -> float | None:
    """Return the part of the battery that is left, as ``20%`` or ``0.2`` say."""
    if text is None:
        return None
    number = text.strip()
    try:
        share = finite_number("--reserve", float(number.removesuffix("%")))
    except ValueError as error:
        msg = f"--reserve is {shown(text)}; give the part of the battery that is left: 20% or 0.2"
        raise CglaError(msg) from error
    return share / 100.0 if number.endswith("%") else share


def _wind(text: str | None) -> Point:
    if text is None:
        return 0.0, 0.0
    try:
        east, north = (finite_number("--wind", float(part)) for part in text.split(","))
    except ValueError as error:
        msg = f"--wind is {shown(text)}; give two numbers, EAST,NORTH: velocity of the air, metres per second"
        raise CglaError(msg) from error
    return east, north


@dataclass(frozen=True)
class Endurance:
    """
    Settings of the time and energy of a planned path.

    Attributes
    ----------
    aircraft
        Speeds, power, battery and wind.
    altitude, above
        Of the flight, metres; None if unknown.
    is_exported
        Whether a plan is written, which commands the speed over the ground.
    """

    aircraft: Aircraft
    altitude: float | None = None
    above: Reference = "home"
    is_exported: bool = False

    @property
    def ground_speed(self) -> float | None:
        """Speed over the ground that an exported plan commands, if that is another than the airspeed."""
        return self.aircraft.speed if self.is_exported and not self.aircraft.is_calm else None

    @property
    def clock(self) -> Callable[[FloatArray], FloatArray]:
        """Function from points on the path, shape ``(n, 2)``, to times, seconds."""
        return partial(times_along, airspeed=self.aircraft.speed or math.nan, wind=self.aircraft.wind)

    def of(self, run: Run) -> FlightTime | None:
        """Return the time of the flight; None without a path."""
        if not run.solution.status.has_path:
            return None
        return flight_time(
            run.solution,
            aircraft=self.aircraft,
            altitude=self.altitude,
            above=self.above,
            ground_speed=self.ground_speed,
        )


def read_endurance(
    options: FlightTimeOptions, export: ExportOptions, profile: Path | None, *, curved: bool = False
) -> Endurance | None:
    """
    Read the options of the time of a planned path, before any work is done; None without any.

    Parameters
    ----------
    options, export
        The options; the altitude is that of the exported plan.
    profile
        A table with times, which has to be finite.
    curved
        Whether the path has turns, which need a wind slower than the aircraft.

    Raises
    ------
    CglaError
        If an option is malformed, out of range, or needs another one.

    Examples
    --------
    >>> read_endurance(FlightTimeOptions(20.0), ExportOptions(altitude=80.0), None).altitude
    80.0
    """
    aircraft = read_aircraft(options)
    if aircraft is None:
        return None
    if aircraft.speed is None:
        given = next(name for name, value in vars(options).items() if value is not None)
        msg = f"--{given.replace('_', '-')} needs the airspeed: also give --speed V"
        raise CglaError(msg)
    if curved or profile is not None:
        # refuses a wind as fast as the aircraft
        timed(Curve(), aircraft.speed, wind=aircraft.wind)
    if export.altitude is None and (aircraft.climb_rate or aircraft.descent_rate):
        given = "--climb-rate" if aircraft.climb_rate else "--descent-rate"
        msg = f"{given} needs the height that is climbed; also give --altitude M"
        raise CglaError(msg)
    return Endurance(aircraft, export.altitude, export.reference, is_exported=bool(export.export))
