"""Zones that apply at times, as areas that close and open while a flight is under way."""

from collections.abc import Iterator
from dataclasses import replace
from datetime import UTC, datetime, timedelta
from itertools import pairwise

from cgla_graph.airspace.zones.applying import Applied, zone_applies
from cgla_graph.airspace.zones.periods import DAY, MINUTE, SECOND, Daily
from cgla_graph.airspace.zones.zone import Zone
from cgla_graph.errors import FileFormatError
from cgla_graph.model.earth import LocalProjection, project_area
from cgla_graph.timed.timed_area import TimedArea

#: Moments at which it is asked whether a zone applies. What depends on the sun lasts for twice the margin of its events
#: at least, which is 5 minutes, so that none of it is missed.
STEP = 5 * MINUTE
#: The longest time that is followed: beyond it, zones count as closed.
LONGEST = timedelta(days=31)
AT_TIMES = "closed at times, while the flight is under way"


def closed_times(zone: Zone, since: datetime, until: datetime) -> list[tuple[float, float | None]]:
    """
    Return when a zone is closed, at most a second too long at clock times, and minutes at times of the sun.

    Parameters
    ----------
    zone
        The zone; without periods, it is always closed.
    since, until
        The time that is followed. Beyond it, the zone counts as closed.

    Returns
    -------
    times
        When it closes and opens, seconds after `since`; the last never opens.

    Examples
    --------
    >>> import shapely
    >>> from cgla_graph.airspace.zones.periods import Period
    >>> from cgla_graph.airspace.zones.zone import Layer
    >>> noon, layer = datetime(2026, 8, 1, 12, tzinfo=UTC), Layer(shapely.box(24, 60, 25, 61))
    >>> morning = Zone("A", "", "PROHIBITED", (layer,), (Period(None, noon),))
    >>> closed_times(morning, noon - timedelta(minutes=10), noon + timedelta(hours=1))
    [(0.0, 601.0), (4200.0, None)]
    """
    if not zone.periods:
        return [(0.0, None)]
    since, until = since.astimezone(UTC), until.astimezone(UTC)
    moments = sorted({one for one in _moments(zone, since, until) if since <= one <= until})
    closed = [zone_applies(zone, one) for one in moments]
    found: list[tuple[float, float | None]] = []
    for number, (first, last) in enumerate(pairwise(moments)):
        if closed[number] or closed[number + 1] or zone_applies(zone, first + 0.5 * (last - first)):
            begins, ends = ((one - since).total_seconds() for one in (first, last))
            if found and found[-1][1] == begins:
                begins = found.pop()[0]
            found.append((begins, ends))
    end = (until - since).total_seconds()
    begins = found.pop()[0] if found and found[-1][1] == end else end
    return [*found, (begins, None)]


def _moments(zone: Zone, since: datetime, until: datetime) -> Iterator[datetime]:
    """Yield moments between which it does not change whether a zone applies, but for times of the sun."""
    yield from (since + i * STEP for i in range((until - since) // STEP + 1))
    yield until
    for period in zone.periods:
        ends = [one for one in (period.start, period.end) if one is not None]
        midnight = since.replace(hour=0, minute=0, second=0, microsecond=0)
        for day in range(-4, (until - since) // DAY + 4):
            for daily in period.schedule:
                ends += [midnight + day * DAY + one for one in _clock_times(daily)]
        for end in ends:
            yield from (end - SECOND, end, end + SECOND)


def _clock_times(daily: Daily) -> list[timedelta]:
    """Return when a schedule may begin or end, since midnight UTC."""
    return [
        moment + day * DAY - offset + lasting
        for moment in (daily.start, daily.end)
        for day in (0, 1)
        for offset in daily.offsets
        for lasting in (timedelta(0), SECOND, MINUTE)
    ]


def timed_areas(
    applied: Applied, projection: LocalProjection, *, since: datetime, until: datetime
) -> tuple[Applied, list[TimedArea]]:
    """
    Take the zones that apply at times out of those that are closed, as areas of a `TimedProblem` in seconds.

    Parameters
    ----------
    applied
        The zones at all times: ``read_zones(…).apply(…)`` without ``at``.
    projection
        Projection from degrees to metres.
    since
        The moment of time 0, with its UTC offset.
    until
        How long the times are followed, a month at most. Beyond that, zones that apply at times count as closed.

    Returns
    -------
    applied, areas
        The zones that are closed all the time (`Applied.no_fly`), and the areas that close and open, in metres.

    Raises
    ------
    FileFormatError
        If a moment has no UTC offset, or `until` is not after `since`, or too long after it.

    Examples
    --------
    >>> import shapely
    >>> from cgla_graph.airspace.zones.applying import Zones
    >>> from cgla_graph.airspace.zones.periods import Period
    >>> from cgla_graph.airspace.zones.zone import Layer
    >>> noon, layer = datetime(2026, 8, 1, 12, tzinfo=UTC), Layer(shapely.box(24, 60, 25, 61))
    >>> zones = Zones((Zone("A", "", "PROHIBITED", (layer,), (Period(noon, None),)),))
    >>> hour = {"since": noon - timedelta(hours=1), "until": noon + timedelta(hours=2)}
    >>> always, areas = timed_areas(zones.apply(), LocalProjection(24.5, 60.5), **hour)
    >>> len(always.closed), [(area.appears, area.vanishes) for area in areas]
    (0, [(3599.0, None)])
    """
    if since.tzinfo is None or until.tzinfo is None:
        msg = f"since is {since.isoformat()}, until {until.isoformat()}; give moments with their UTC offsets"
        raise FileFormatError(msg)
    if not timedelta(0) < until - since <= LONGEST:
        msg = f"until is {until - since} after since; give more than 0, and at most {LONGEST.days} days"
        raise FileFormatError(msg)
    verdicts, areas = [], []
    for one in applied.verdicts:
        if one.area is None or not isinstance(one.zone, Zone) or not one.zone.periods:
            verdicts.append(one)
            continue
        times = closed_times(one.zone, since, until)
        if times == [(0.0, None)]:
            verdicts.append(one)
            continue
        shape = project_area(one.area, projection)
        areas += [TimedArea(shape, begins, ends) for begins, ends in times]
        verdicts.append(replace(one, state="open", reason=AT_TIMES, area=None))
    return replace(applied, verdicts=tuple(verdicts)), areas
