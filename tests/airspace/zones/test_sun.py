"""Sunrise and twilight: compared with an ephemeris, and never less strict."""

import math
from datetime import UTC, datetime, timedelta

import ephem
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual
from zone_files import circle, data_of, ed318

from cgla_graph.airspace.zones.periods import Daily
from cgla_graph.airspace.zones.reading import zones_of
from cgla_graph.airspace.zones.sun import EARLIEST, LATEST, MARGIN, Event, Sun

moments = st.datetimes(datetime(1990, 1, 1), datetime(2060, 1, 1)).map(lambda one: one.replace(tzinfo=UTC))  # noqa: DTZ001
longitudes, latitudes = st.floats(-180.0, 180.0), st.one_of(st.floats(-90.0, 90.0), st.floats(-68.0, 68.0))
#: Height of the sun's centre, degrees: its rim at the horizon with 34' of refraction, and civil twilight.
HEIGHTS: dict[Event, float] = {"BMCT": -6.0, "SR": -50.0 / 60.0, "SS": -50.0 / 60.0, "EECT": -6.0}
PAIRS: list[tuple[Event, Event]] = [("SR", "SS"), ("BMCT", "EECT"), ("SS", "SR"), ("EECT", "BMCT")]


def observer(longitude: float, latitude: float, moment: datetime) -> ephem.Observer:
    found = ephem.Observer()
    found.lon, found.lat, found.pressure = math.radians(longitude), math.radians(latitude), 0.0
    found.date = moment.replace(tzinfo=None)
    return found


@usual
@given(moment=moments, longitude=longitudes, latitude=st.floats(-65.0, 65.0), event=st.sampled_from(sorted(HEIGHTS)))
def test_events_are_those_of_an_ephemeris(moment: datetime, longitude: float, latitude: float, event: Event) -> None:
    """Times agree within the margin on both sides; the slack for refraction adds a few minutes."""
    sun = Sun((longitude, latitude, longitude, latitude), moment)
    times = sun.times(event)
    early, late = (sun.moment_of(float(one[sun.today])) for one in (times.early, times.late))
    there = observer(longitude, latitude, early)
    there.horizon = str(HEIGHTS[event])
    find = there.next_rising if event in {"BMCT", "SR"} else there.next_setting
    try:
        theirs = find(ephem.Sun(), use_center=True).datetime().replace(tzinfo=UTC)
    except (ephem.AlwaysUpError, ephem.NeverUpError):
        return
    assert early + MARGIN - timedelta(seconds=30) < theirs < late - MARGIN + timedelta(seconds=30)
    if abs(latitude) < 55.0:
        assert late - early < 2 * MARGIN + timedelta(minutes=9)


@usual
@given(moment=moments, longitude=longitudes, latitude=latitudes, pair=st.sampled_from(PAIRS))
def test_a_zone_of_the_day_is_closed_while_the_sun_is_up(
    moment: datetime, longitude: float, latitude: float, pair: tuple[Event, Event]
) -> None:
    """A zone of the night is closed while the sun is down; both also hold at the poles."""
    altitude = math.degrees(ephem.Sun(observer(longitude, latitude, moment)).alt)
    daily = Daily(frozenset(range(7)), timedelta(0), timedelta(0), (LATEST, EARLIEST), *pair)
    includes = daily.includes(moment, Sun((longitude, latitude, longitude, latitude), moment))
    by_day = pair[0] in {"SR", "BMCT"}
    above = altitude - HEIGHTS[pair[0]] if by_day else HEIGHTS[pair[0]] - altitude
    if above > 0.0:
        assert includes
    # (with the margin, a day in polar night has 5 minutes of sun around noon)
    if above < -1.7 and abs(latitude) < 60.0:
        assert not includes
    # without a place, the events may be at any time of the day
    assert daily.includes(moment)


@pytest.mark.parametrize(("month", "by_day", "by_night"), [(6, True, False), (12, False, True)])
def test_polar_day_has_no_night_and_polar_night_no_day(month: int, by_day: bool, by_night: bool) -> None:
    """In Tromsø, at nine in the morning and in the evening."""
    for first, last, closed in (("SR", "SS", by_day), ("SS", "SR", by_night)):
        period = {"schedule": [{"day": ["ANY"], "startEvent": first, "endEvent": last}]}
        (zone,) = zones_of(data_of(ed318(circle(18.9, 69.6, 900), limitedApplicability=[period])), "mine")
        for hour in (8, 20):
            at = datetime(2026, month, 21, hour, tzinfo=UTC)
            assert zone.periods[0].includes(at, Sun(zone.layers[0].area.bounds, at)) is closed


def test_days_are_those_of_clocks_there() -> None:
    """Sunrise of a Saturday is on no Sunday in Luxembourg; near the date line, it may be."""
    period = {"schedule": [{"day": ["SAT"], "startEvent": "SR", "endEvent": "SS"}]}
    for longitude, other_days in ((6.1, {False}), (179.0, {True})):
        (zone,) = zones_of(data_of(ed318(circle(longitude, 49.6, 900), limitedApplicability=[period])), "mine")
        sun_at_noon = timedelta(hours=12 - longitude / 15.0)
        days = [datetime(2026, 8, day, tzinfo=UTC) + sun_at_noon for day in (1, 2)]
        closed = [zone.periods[0].includes(at, Sun(zone.layers[0].area.bounds, at)) for at in days]
        assert closed[0]
        assert {closed[1]} == other_days
