"""The time and energy of a flight: of a plan, of a path, or of lines and arcs."""

import math
import os
from dataclasses import dataclass, field
from types import NoneType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, counted, figure, json_number, listed, shown
from cgla_graph._types import FloatArray, Point
from cgla_graph._validate import choice, finite_number, instance, point_array
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.airspace.endurance.stops import NO_ALTITUDE, Stops, stops_of_path, stops_of_plan
from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.airspace.flight_plans.plan import (
    ALTITUDES,
    LEAST_FLOWN,
    REFERENCES,
    FlightPlan,
    Reference,
    first_remarks,
)
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import geodesic_steps
from cgla_graph.model.solution import Solution
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.flyable import Flyable
from cgla_graph.turning.timing import ground_speeds, timed
from cgla_graph.untrusted.files import FilePath

#: Things of a kind that are listed in a sentence, at most.
_MOST_LISTED = 3
#: Energies that are above a limit by at most this ratio are within it: sums are rounded.
_ROUNDING = 1e-9


@dataclass(frozen=True, eq=False)
class FlightTime(ShortRepr):
    """
    Time and energy of a flight.

    Attributes
    ----------
    aircraft
        Speeds, power, battery and wind.
    legs
        Time of each leg, seconds, shape ``(n,)``, the longer one of the way and the climb; infinite if the wind does
        not allow it. Of lines and arcs, the time of the whole curve.
    names
        The end of each leg, for messages.
    slowest, fastest
        Least and greatest ground speed of legs, metres (map units) per second; NaN if there is none.
    climbing, circling, staying
        Time of climbs and descents apart from legs, of circles, and of stays, seconds.
    unknown
        Unknown parts, which all these numbers leave out, and the options that supply them.

    Examples
    --------
    >>> found = flight_time([(0, 0), (3600, 0)], speed=10, power=100, battery=20, altitude=60, climb_rate=3)
    >>> found.least_seconds, found.seconds, found.within_battery
    (380.0, nan, None)
    >>> found.unknown
    ('the descent of 60 m: give --descent-rate V, m/s',)
    """

    aircraft: Aircraft
    legs: FloatArray = field(repr=False)
    names: tuple[str, ...] = field(default=(), repr=False)
    slowest: float = math.nan
    fastest: float = math.nan
    climbing: float = 0.0
    circling: float = 0.0
    staying: float = 0.0
    unknown: tuple[str, ...] = ()

    @property
    def least_seconds(self) -> float:
        """The time of all that is known: the flight takes no less, seconds."""
        return float(self.legs.sum()) + self.climbing + self.circling + self.staying

    @property
    def seconds(self) -> float:
        """The time of the flight, seconds; NaN if a part of it is not known."""
        return math.nan if self.unknown else self.least_seconds

    @property
    def least_energy(self) -> float:
        """The energy of all that is known, watt-hours; NaN without a power."""
        return self.aircraft.energy(self.least_seconds)

    @property
    def energy(self) -> float:
        """The energy of the flight, watt-hours; NaN without a power, or if a part of it is not known."""
        return self.aircraft.energy(self.seconds)

    @property
    def is_possible(self) -> bool:
        """Whether the wind allows all legs and circles."""
        return math.isfinite(self.least_seconds)

    @property
    def within_battery(self) -> bool | None:
        """Whether the battery lasts and keeps its reserve; None without a battery, or if it is not known."""
        if self.aircraft.battery is None:
            return None
        if self.least_energy > self.aircraft.usable * (1.0 + _ROUNDING):
            return False
        return None if self.unknown else True

    @property
    def faults(self) -> list[str]:
        """Why the aircraft cannot fly it, or it is not known whether the battery lasts: a sentence each."""
        found = []
        if not self.is_possible:
            stuck = [name for name, time in zip(self.names, self.legs.tolist(), strict=True) if math.isinf(time)]
            where = (
                f"{counted(len(stuck), 'leg')} (to {listed(stuck, _MOST_LISTED)})" if stuck else "the aircraft to stay"
            )
            found.append(
                f"the wind of {math.hypot(*self.aircraft.wind):.4g} does not allow {where} at an airspeed of "
                f"{self.aircraft.speed:g}"
            )
        elif self.aircraft.battery is not None and self.within_battery is not True:
            found.append(self._battery_text())
        return found

    def _battery_text(self) -> str:
        """Return whether the battery lasts."""
        known = self.aircraft
        room = (
            f"{figure(known.usable, 4)} Wh may be used: a battery of {known.battery:g} Wh with {known.reserve_text()}"
        )
        least = "at least " if self.unknown else ""
        takes = f"the flight takes {least}{figure(self.least_energy, 4)} Wh, and {room}"
        if self.within_battery is None:
            return f"whether the battery lasts is not known: {takes}"
        return f"the battery {'lasts' if self.within_battery else 'does not last'}: {takes}"

    def lines(self, per_second: str = " m/s") -> dict[str, str]:
        """
        Return the lines to print, by their keys; per_second is the unit of speeds.

        Examples
        --------
        >>> flight_time([(0, 0), (3600, 0)], speed=10, wind=(2, 0), power=100, altitude=0).lines()["energy"]
        '8.333 Wh at 100 W'
        """
        known = self.aircraft
        is_level = known.battery is None and self.unknown == (NO_ALTITUDE,)
        least = "at least " if self.unknown and not is_level else ""
        said = f"{least}{time_text(self.least_seconds)}" if self.is_possible else "not possible"
        said += "" if known.speed is None else f" at an airspeed of {known.speed:g}{per_second}"
        if math.isfinite(self.fastest) and (known.speed is None or (not known.is_calm and self.is_possible)):
            same = self.slowest == self.fastest
            speeds = figure(self.slowest, 4) + ("" if same else f" to {figure(self.fastest, 4)}")
            said += f", over ground {speeds}{per_second}"
        parts = {"climbing and descending": self.climbing, "circling": self.circling, "staying": self.staying}
        extra = [f"{time_text(time)} {name}" for name, time in parts.items() if 0.0 < time < math.inf]
        said += ", in level flight" if is_level else f", of it {', '.join(extra)}" if extra else ""
        lines = {"flight": said}
        if self.unknown and not is_level:
            more = len(self.unknown) - _MOST_LISTED
            lines["not known"] = "; ".join(self.unknown[:_MOST_LISTED]) + (f"; and {more} more" if more > 0 else "")
        if not self.is_possible:
            lines["wind"] = self.faults[0]
        elif known.power is not None:
            lines["energy"] = f"{least}{figure(self.least_energy, 4)} Wh at {known.power:g} W"
        if self.is_possible and known.battery is not None:
            lines["battery"] = self._battery_text()
        return lines

    def document(self) -> dict[str, Any]:
        """Return all numbers as JSON; None for unknown ones."""
        return {
            "seconds": json_number(self.seconds),
            "least_seconds": json_number(self.least_seconds),
            "legs": [json_number(time) for time in self.legs.tolist()],
            "climbing": json_number(self.climbing),
            "circling": json_number(self.circling),
            "staying": json_number(self.staying),
            "ground_speed": [json_number(self.slowest), json_number(self.fastest)],
            "energy_wh": json_number(self.energy),
            "least_energy_wh": json_number(self.least_energy),
            "usable_wh": json_number(self.aircraft.usable),
            "within_battery": self.within_battery,
            "possible": self.is_possible,
            "unknown": list(self.unknown),
            "faults": self.faults,
            "aircraft": self.aircraft.document(),
        }


def flight_time(
    flight: FlightPlan | Solution | FilePath | ArrayLike,
    *,
    aircraft: Aircraft | None = None,
    speed: float | None = None,
    wind: Point = (0.0, 0.0),
    power: float | None = None,
    battery: float | None = None,
    reserve: float | None = None,
    climb_rate: float | None = None,
    descent_rate: float | None = None,
    altitude: float | None = None,
    above: Reference = "home",
    ground_speed: float | None = None,
) -> FlightTime:
    """
    Return time and energy of a flight, and whether the battery lasts.

    The wind is constant. Along a straight leg the aircraft heads into it so far that it stays on the leg (the wind
    triangle); on lines and arcs the times are exact (`cgla_graph.turning.timing.timed`). A leg that climbs takes the
    longer one of its way and its climb. The power is the same all along. What a plan does not say is not guessed: it is
    named, and left out of the numbers, which are least ones then.

    Parameters
    ----------
    flight
        A plan or its file; the answer of a solver, a flyable path too; or waypoints in a plane, shape ``(m, 2)``.
    aircraft
        All numbers of the aircraft, instead of those below.
    speed, wind, power, battery, reserve, climb_rate, descent_rate
        As of `cgla_graph.airspace.endurance.aircraft.Aircraft`. Where a plan commands a ground speed, the leg is flown
        at that, or at the ground speed that the airspeed gives, if that is less.
    altitude
        Metres above take-off and landing, for paths and for plans without altitudes; None if unknown.
    above
        Reference of the altitude of a path: above the ``"ground"``, climbs on the way are not known; above the
        ``"sea"``, no climb is.
    ground_speed
        Speed over the ground that is commanded on a path, as an exported plan does, metres (map units) per second; None
        for none.

    Raises
    ------
    ProblemError
        If a number is out of range, there is no path, or lines and arcs are in a wind as fast as the aircraft.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> plan = cg.FlightPlan.along([(24.0, 60.0), (24.0, 60.1)], altitude=90)
    >>> found = cg.flight_time(plan, speed=15, wind=(0, -5), power=300, battery=100, climb_rate=3, descent_rate=2)
    >>> round(found.seconds), round(found.energy, 1), found.within_battery
    (1189, 99.1, False)
    """
    instance("aircraft", aircraft, (Aircraft, NoneType), "Aircraft(speed=…)")
    choice("above", above, REFERENCES)
    numbers = (speed, wind, power, battery, reserve, climb_rate, descent_rate)
    known = Aircraft(*numbers) if aircraft is None else aircraft
    least = LEAST_FLOWN[above]
    if altitude is not None and not least <= finite_number("altitude", altitude) <= ALTITUDES[1]:
        msg = f"altitude is {altitude:g}; give metres above {above}, from {least:g} to {ALTITUDES[1]:g}"
        raise ProblemError(msg)
    given: Any = read_plan(flight) if isinstance(flight, str | os.PathLike) else flight
    if isinstance(given, FlightPlan):
        return _timed(stops_of_plan(given, altitude), known)
    if isinstance(given, Solution):
        if not given.status.has_path or not np.size(given.path):
            msg = f"there is no path to be flown: {given.message or given.status.value}"
            raise ProblemError(msg)
        curve = given.curve if isinstance(given, Flyable) and ground_speed is None else None
        steps = np.diff(given.path, axis=0) if given.projection is None else geodesic_steps(given.lonlat)
        return _timed(stops_of_path(steps, altitude, above, ground_speed), known, curve)
    points = point_array("flight", given)
    if points.ndim != 2 or not len(points):  # noqa: PLR2004 - a list of points
        msg = f"flight is {shown(given)}; give a plan, its file, a solution, or waypoints, shape (m, 2)"
        raise ProblemError(msg)
    return _timed(stops_of_path(np.diff(points, axis=0), altitude, above, ground_speed), known)


def _timed(stops: Stops, known: Aircraft, curve: Curve | None = None) -> FlightTime:
    """Return the time of a flight by its stops, or of a curve with the climbs of its stops."""
    unknown: list[str] = []
    moves = np.hypot(*stops.steps.T) > 0.0
    if curve is not None and known.speed is not None and len(curve.pieces):
        timing = timed(curve, known.speed, wind=known.wind)
        legs, names = [timing.seconds], ["the goal"]
        slowest, fastest = timing.slowest, timing.fastest
        in_place = 0.0
    else:
        every, slowest, fastest = _legs(stops, known, unknown)
        # (a climb in one place is no leg)
        legs, in_place = every[moves].tolist(), float(every[~moves].sum())
        names = [name for name, does in zip(stops.names, moves.tolist(), strict=True) if does]
    unknown += () if known.is_calm else stops.unknown_in_wind
    climbs = {up: _heights(stops, up=up) for up in (True, False)}
    for up, word in ((True, "climb"), (False, "descent")):
        if sum(climbs[up]) > 0.0 and math.isnan(known.rate(up=up)):
            unknown.append(f"the {word} of {sum(climbs[up]):.6g} m: give --{word}-rate V, m/s")
    climbing = sum(_climb(climbs[up][0] if up else -climbs[up][0], known) for up in climbs)
    circling = sum(_circle(*circle, known, unknown) for circle in stops.circles)
    hangs = stops.staying > 0.0 or climbs[True][0] + climbs[False][0] + np.abs(stops.climbs[~moves]).sum() > 0.0
    # (a wind as fast as the aircraft blows it away)
    is_blown = known.speed is not None and math.hypot(*known.wind) >= known.speed
    return FlightTime(
        known,
        np.array(legs),
        tuple(names),
        slowest,
        fastest,
        climbing + in_place,
        circling,
        math.inf if hangs and is_blown else stops.staying,
        tuple(first_remarks([*unknown, *dict.fromkeys(stops.unknown)])),
    )


def _legs(stops: Stops, known: Aircraft, unknown: list[str]) -> tuple[FloatArray, float, float]:
    """Return the time of each straight step, and the least and the greatest ground speed."""
    lengths, speeds = np.hypot(*stops.steps.T), stops.commanded
    if known.speed is not None:
        speeds = np.minimum(speeds, ground_speeds(stops.steps, known.speed, known.wind))
    moves, said = lengths > 0.0, np.isfinite(speeds)
    if wanting := int((moves & ~said).sum()):
        unknown.append(f"the speed of {counted(wanting, 'leg')}: give --speed V, m/s")
    with np.errstate(divide="ignore"):
        level = np.divide(lengths, speeds, out=np.zeros_like(lengths), where=moves & said)
    seen = speeds[moves & said]
    ends = (float(seen.min()), float(seen.max())) if len(seen) else (math.nan, math.nan)
    rates = np.where(stops.climbs > 0.0, known.rate(up=True), known.rate(up=False))
    return np.maximum(level, np.nan_to_num(np.abs(stops.climbs) / rates, nan=0.0)), *ends


def _heights(stops: Stops, *, up: bool) -> tuple[float, float]:
    """Return the metres that are climbed or descended apart from steps, and on steps."""
    sign = 1.0 if up else -1.0
    return stops.upright[0 if up else 1], float(np.maximum(sign * stops.climbs, 0.0).sum())


def _climb(change: float, known: Aircraft) -> float:
    """Return the time of a change of height, 0 if it is not known."""
    rate = known.rate(up=change > 0.0)
    return 0.0 if change == 0.0 or math.isnan(rate) else abs(change) / rate


def _circle(radius: float, turns: float, commanded: float, known: Aircraft, unknown: list[str]) -> float:
    """Return the time of a circle, 0 if it is not known."""
    around = 2.0 * math.pi * radius
    if known.speed is None:
        if math.isinf(commanded):
            unknown.append("the speed on a circle: give --speed V, m/s")
            return 0.0
        return turns * around / commanded
    if math.hypot(*known.wind) >= known.speed:
        return math.inf
    circle = Curve(np.array([[0.0, 0.0, 0.0, 0.0, radius, 0.0, radius, 2.0 * math.pi]]))
    once = timed(circle, known.speed, wind=known.wind).seconds
    return turns * max(once, around / commanded)


def time_text(seconds: float) -> str:
    """
    Write a time of flight.

    Examples
    --------
    >>> time_text(8.25), time_text(657.4), time_text(3599.9), time_text(7325.0)
    ('8.2 s', '10 min 57 s', '1 h 0 min', '2 h 2 min')
    """
    if seconds < 99.5:  # noqa: PLR2004 - two digits and a part
        return f"{seconds:.1f} s"
    minutes, rest = divmod(round(seconds), 60)
    if minutes < 60:  # noqa: PLR2004 - minutes in an hour
        return f"{minutes} min {rest} s"
    return f"{minutes // 60} h {minutes % 60} min"
