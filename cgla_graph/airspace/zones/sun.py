"""
Earliest and latest times of sunrise, sunset and civil twilight over an area.

The position of the sun is that of Meeus, "Astronomical Algorithms", in the short form of NOAA's solar calculator,
accurate to 0.01 degrees in the centuries around 2000.
"""

import math
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from functools import lru_cache
from typing import Final, Literal, TypeAlias, get_args

import numpy as np

from cgla_graph._types import Bounds, FloatArray

#: Beginning of morning civil twilight, sunrise, sunset, end of evening civil twilight: in the order of a day.
Event: TypeAlias = Literal["BMCT", "SR", "SS", "EECT"]
EVENTS: Final[tuple[Event, ...]] = get_args(Event)
#: Height of the sun's centre at each event, degrees: its rim at the horizon with mean refraction, and civil twilight.
HEIGHTS: Final[dict[Event, float]] = {"BMCT": -6.0, "SR": -5.0 / 6.0, "SS": -5.0 / 6.0, "EECT": -6.0}
#: Margins of time and of the sun's height (degrees): refraction differs from day to day, and tables are rounded to
#: minutes.
MARGIN, SLACK = timedelta(minutes=5), 0.25
#: Bounds of legal time minus solar time, hours: it is ahead in Mendoza, Xinjiang and Galicia, and behind in few places.
#: Beyond this longitude, near the date line, any legal time is possible.
_BEHIND, _AHEAD, _DATE_LINE = -1.5, 3.5, 140.0
#: Greatest and least offset of a legal time from UTC.
EARLIEST, LATEST = timedelta(hours=14), timedelta(hours=-12)
_NOON: Final = datetime(2000, 1, 1, 12, tzinfo=UTC)
_DAY: Final = timedelta(days=1)
#: Days around a moment for which events are computed.
_DAYS: Final = 3
#: Areas are widened to whole multiples of this, degrees (less than half a minute), so that many zones share a sun.
_GRID: Final = 0.1
_STEPS: Final = 6


@dataclass(frozen=True)
class Times:
    """
    Times of an event, day by day.

    Attributes
    ----------
    early, late
        Earliest and latest time over the area including the margin, days since noon of 1 January 2000 UTC, shape
        ``(n,)``.
    """

    early: FloatArray
    late: FloatArray


@dataclass
class Sun:
    """
    The sun over an area, on the days around a moment.

    On a day without an event, its time is the limit of the days before: in polar day, the sun rises at one midnight and
    sets at the next; in polar night, it does both at noon.

    Parameters
    ----------
    box
        West, south, east, north, degrees; longitudes may be beyond 180.
    moment
        Moment with its UTC offset.

    Examples
    --------
    >>> sun = Sun((6.1, 49.6, 6.2, 49.7), datetime(2026, 8, 2, 12, tzinfo=UTC))
    >>> days = sun.times("SR").early[sun.today], sun.times("SS").late[sun.today]
    >>> [f"{sun.moment_of(day):%H:%M}" for day in days]
    ['04:00', '19:22']
    """

    box: Bounds
    moment: datetime
    _times: dict[Event, Times] = field(default_factory=dict)

    @property
    def now(self) -> float:
        """The moment, days since noon of 1 January 2000."""
        return (self.moment - _NOON) / _DAY

    @property
    def today(self) -> int:
        """Index of the day of the moment, in solar time."""
        return _DAYS

    @staticmethod
    def moment_of(days: float) -> datetime:
        """Return the moment that is some days after noon of 1 January 2000."""
        return _NOON + days * _DAY

    @property
    def clocks(self) -> tuple[timedelta, timedelta]:
        """Least and greatest offset of clocks in the area from UTC: of legal times, and of UTC itself."""
        west, _, east, _ = self.box
        middle = (0.5 * (west + east) + 180.0) % 360.0 - 180.0
        half = 0.5 * (east - west)
        if abs(middle) + half > _DATE_LINE:
            return LATEST, EARLIEST
        least, most = (middle - half) / 15.0 + _BEHIND, (middle + half) / 15.0 + _AHEAD
        return timedelta(hours=min(0.0, least)), timedelta(hours=max(0.0, most))

    def times(self, event: Event) -> Times:
        """Return the times of an event on the days around the moment."""
        if event not in self._times:
            west, south, east, north = self.box
            noon = round(self.now + 0.5 * (west + east) / 360.0) + np.arange(-_DAYS, _DAYS + 1)
            # events are earlier in the east at every latitude; between two latitudes, times are between, up to seconds
            latitudes = np.clip(np.linspace(south, north, 3 if north - south < 1.0 else 9), -90.0, 90.0)
            heights = HEIGHTS[event] + np.array([-SLACK, 0.0, SLACK])
            grid = np.meshgrid(noon, [west, east], latitudes, heights, indexing="ij")
            found = _crossings(*grid, rises=event in {"BMCT", "SR"}).reshape(len(noon), -1)
            margin = MARGIN / _DAY
            self._times[event] = Times(found.min(axis=1) - margin, found.max(axis=1) + margin)
        return self._times[event]


@lru_cache(maxsize=20_000)
def sun_over(west: int, south: int, east: int, north: int, moment: datetime) -> Sun:
    """
    Return the sun over an area whose bounds are whole multiples of a tenth of a degree.

    Examples
    --------
    >>> sun_over(61, 496, 62, 497, datetime(2026, 8, 2, 12, tzinfo=UTC)).box
    (6.1, 49.6, 6.2, 49.7)
    """
    return Sun((_GRID * west, _GRID * south, _GRID * east, _GRID * north), moment)


def round_outwards(box: Bounds) -> tuple[int, int, int, int]:
    """
    Return bounds rounded outwards to whole multiples of a tenth of a degree.

    Examples
    --------
    >>> round_outwards((6.12, 49.61, 6.18, 49.69))
    (61, 496, 62, 497)
    """
    west, south, east, north = (side / _GRID for side in box)
    return math.floor(west), math.floor(south), math.ceil(east), math.ceil(north)


def _crossings(
    noon: FloatArray, longitude: FloatArray, latitude: FloatArray, height: FloatArray, *, rises: bool
) -> FloatArray:
    """Return when the sun passes a height, rising or setting; see `Sun` for days on which it does not."""
    mean_noon = noon - longitude / 360.0
    sine, cosine = np.sin(np.radians(latitude)), np.maximum(np.cos(np.radians(latitude)), 1e-12)
    found = mean_noon
    # (declination and equation of time depend on the time found: the iteration converges to seconds)
    for _ in range(_STEPS):
        declination, ahead = _position(found)
        ratio = (np.sin(np.radians(height)) - sine * np.sin(declination)) / (cosine * np.cos(declination))
        away = np.arccos(np.clip(ratio, -1.0, 1.0)) / (2.0 * math.pi)
        found = mean_noon - ahead + (-away if rises else away)
    return found


def _position(days: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the sun's declination, rad, and the equation of time, days."""
    century = days / 36525.0
    longitude = np.radians(280.46646 + century * (36000.76983 + 0.0003032 * century))
    anomaly = np.radians(357.52911 + century * (35999.05029 - 0.0001537 * century))
    eccentricity = 0.016708634 - century * (0.000042037 + 0.0000001267 * century)
    centre = (
        np.sin(anomaly) * (1.914602 - century * (0.004817 + 0.000014 * century))
        + np.sin(2.0 * anomaly) * (0.019993 - 0.000101 * century)
        + np.sin(3.0 * anomaly) * 0.000289
    )
    node = np.radians(125.04 - 1934.136 * century)
    apparent = longitude + np.radians(centre - 0.00569 - 0.00478 * np.sin(node))
    tilt = np.radians(23.4392911 - 0.0130042 * century + 0.00256 * np.cos(node))
    y = np.tan(0.5 * tilt) ** 2
    ahead = (
        y * np.sin(2.0 * longitude)
        - 2.0 * eccentricity * np.sin(anomaly)
        + 4.0 * eccentricity * y * np.sin(anomaly) * np.cos(2.0 * longitude)
        - 0.5 * y * y * np.sin(4.0 * longitude)
        - 1.25 * eccentricity**2 * np.sin(2.0 * anomaly)
    )
    return np.arcsin(np.sin(tilt) * np.sin(apparent)), ahead / (2.0 * math.pi)
