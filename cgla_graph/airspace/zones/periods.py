"""Periods in which a zone applies: from a date to another, on days of the week, at times of the day."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.airspace.zones.entries import Entry
from cgla_graph.airspace.zones.shapes import short
from cgla_graph.airspace.zones.sun import EARLIEST, EVENTS, LATEST, Event, Sun
from cgla_graph.untrusted.files import fault

DAYS = ("MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN")
#: Keys of a period and of its schedule.
PERIOD = ("permanent", "startDateTime", "endDateTime", "schedule")
SCHEDULE = ("day", "startTime", "endTime", "startEvent", "endEvent")
DAY, MINUTE, SECOND = timedelta(days=1), timedelta(minutes=1), timedelta(seconds=1)
TIME = re.compile(r"(\d{2}):(\d{2})(?::(\d{2})(?:[.,]\d+)?)?\s*(Z|z|[+-]\d{2}:?\d{2})?", re.ASCII)


_BEGINNING, _NOON = datetime(1, 1, 1, tzinfo=UTC), datetime(2000, 1, 1, 12, tzinfo=UTC)


@dataclass(frozen=True)
class Daily:
    """
    Times of a day at which a zone applies; both ends count, the last to the end of its minute or second.

    Parameters
    ----------
    days
        Days of the week on which it begins, Monday is 0.
    start, end
        Time since midnight; an end that is not after the start is on the next day.
    offsets
        Least and greatest possible offset of the clock from UTC.
    rise, fall
        Events of the sun at which it begins and ends instead; the end is the first such event after the start.

    Examples
    --------
    >>> night = Daily(frozenset({4}), timedelta(hours=22), timedelta(hours=6), (timedelta(0), timedelta(0)))
    >>> [night.includes(datetime(2026, 8, day, 5, tzinfo=UTC)) for day in (7, 8)]  # Friday, Saturday
    [False, True]
    """

    days: frozenset[int]
    start: timedelta
    end: timedelta
    offsets: tuple[timedelta, timedelta]
    rise: Event | None = None
    fall: Event | None = None

    def includes(self, moment: datetime, sun: Sun | None = None) -> bool:
        """Return whether a moment is in it for any possible offset; without a sun, events may be at any time."""
        with_sun = self.rise is not None or self.fall is not None
        if with_sun and sun is not None:
            return self._includes_with(sun)
        start, end, (least, most) = self.start, self.end, self.offsets
        if with_sun:
            # it begins on one of the days, and ends on the next day at the latest
            start, end, least, most = timedelta(0), 2 * DAY, LATEST, EARLIEST
        elif end <= start:
            end += DAY
        end += _to_the_end_of(self.end)
        since = moment - _BEGINNING
        today = since // DAY
        # the date differs by a day around the Earth, and a period may end on the next day
        for day in range(max(0, today - 4), today + 3):
            # (1 January of year 1 was a Monday)
            if day % 7 in self.days and day * DAY + start - most <= since < day * DAY + end - least:
                return True
        return False

    def _includes_with(self, sun: Sun) -> bool:
        """Return whether the sun's moment is in it: between the earliest possible start and the latest possible end."""
        offsets = sun.clocks if self.rise is not None and self.fall is not None else self.offsets
        least, most = (offset / DAY for offset in offsets)
        # the sun counts days from noon of 1 January 2000 UTC; the shift makes it days since Monday, 1 January 1
        shift = (_NOON - _BEGINNING) / DAY
        if self.rise is not None:
            times = sun.times(self.rise)
            early, late = times.early, times.late
            first, last = np.floor(early + shift + least), np.floor(late + shift + most)
            on_day = [
                any(d % 7 in self.days for d in range(int(a), int(b) + 1)) for a, b in zip(first, last, strict=True)
            ]
        else:
            days = np.floor(sun.now + shift) + np.arange(-4, 4)
            on_day = [int(day) % 7 in self.days for day in days]
            early, late = (days - shift + self.start / DAY - offset for offset in (most, least))
        ends = self._ends_after(late, sun)
        # (1e-9 days, a tenth of a millisecond, for rounding)
        return bool((np.array(on_day) & (early - 1e-9 <= sun.now) & (sun.now <= ends + 1e-9)).any())

    def _ends_after(self, starts: FloatArray, sun: Sun) -> FloatArray:
        """Return the latest possible end after each start, days."""
        if self.fall is None:
            minute = _to_the_end_of(self.end) / DAY
            least, most = self.offsets
            if least != most:
                return starts + 1.0 + minute
            end = (self.end - least - timedelta(hours=12)) / DAY
            return end + np.floor(starts - end) + 1.0 + minute
        times = sun.times(self.fall)
        if self.rise is None:
            # the first event that is certainly after the start
            after = np.searchsorted(times.early, starts, side="right")
            return np.append(times.late, np.inf)[after]
        # the order of two events in a day is known
        same_day = EVENTS.index(self.fall) > EVENTS.index(self.rise)
        return times.late if same_day else np.append(times.late[1:], np.inf)


def _to_the_end_of(end: timedelta) -> timedelta:
    """Return how long an end lasts: a second if it has seconds, else a minute."""
    return SECOND if end.seconds % 60 else MINUTE


@dataclass(frozen=True)
class Period:
    """
    A period in which a zone applies.

    Parameters
    ----------
    start, end
        Start and end; None if it has none.
    schedule
        Times of day; empty for all day.

    Examples
    --------
    >>> Period(datetime(2026, 8, 1, tzinfo=UTC), None).includes(datetime(2026, 7, 31, tzinfo=UTC))
    False
    """

    start: datetime | None
    end: datetime | None
    schedule: tuple[Daily, ...] = ()

    def includes(self, moment: datetime, sun: Sun | None = None) -> bool:
        """Return whether a moment is in it; without a sun, events of the sun may be at any time."""
        if (self.start is not None and moment < self.start) or (self.end is not None and moment > self.end):
            return False
        return not self.schedule or any(daily.includes(moment, sun) for daily in self.schedule)


def period_of(entry: Entry) -> Period:
    """
    Read ``startDateTime``, ``endDateTime`` and ``schedule``, which both standards have.

    Raises
    ------
    FileFormatError
        If one of them is not valid.

    Examples
    --------
    >>> period_of(Entry({"startDateTime": "2026-08-01T06:00:00Z"}, "zone 'A'")).start.isoformat()
    '2026-08-01T06:00:00+00:00'
    """
    entry.require_spelling(PERIOD, 0.75)
    start, end = (moment_of(entry, key) if entry.has(key) else None for key in ("startDateTime", "endDateTime"))
    if start is not None and end is not None and end < start:
        entry.wrong("endDateTime", f"give a time after startDateTime, {start.isoformat()}")
    return Period(start, end, tuple(_daily(one) for one in entry.entries("schedule")))


def moment_of(entry: Entry, key: str) -> datetime:
    """
    Read a date and time with its UTC offset (RFC 3339).

    Raises
    ------
    FileFormatError
        If it is not valid or has no offset.
    """
    value = entry.values.get(key)
    moment = _moment(value) if isinstance(value, str) else None
    if moment is None:
        entry.wrong(key, "give a date and time with its zone, as 2026-08-01T06:00:00Z")
    return moment


def moment_from(text: str, where: str) -> datetime:
    """
    Read a date and time with its UTC offset that a user gives.

    Raises
    ------
    FileFormatError
        If it is not valid or has no offset.

    Examples
    --------
    >>> moment_from("2026-08-01T12:00+02:00", "--at").isoformat()
    '2026-08-01T10:00:00+00:00'
    """
    moment = _moment(text)
    if moment is None:
        fault(where, f"it is {short(text)}", "give a date and time with its zone, as 2026-08-01T06:00:00Z or …+02:00")
    return moment


def _moment(text: str) -> datetime | None:
    """Return a moment in UTC; None for a text that is not valid or has no UTC offset."""
    # midnight at the end of a day may be written as 24:00
    late = re.fullmatch(r"(.{10}.)24:00(:00(?:\.0+)?)?(.*)", text.strip())
    try:
        moment = datetime.fromisoformat(f"{late[1]}00:00{late[2] or ''}{late[3]}" if late else text.strip())
        if moment.tzinfo is None:
            return None
        return moment.astimezone(UTC) + (DAY if late else timedelta(0))
    except (ValueError, OverflowError):
        return None


def _daily(entry: Entry) -> Daily:
    """Read a ``schedule``'s days and times."""
    entry.require_spelling(SCHEDULE, 0.75)
    for side in ("start", "end"):
        others = [key for key in entry.values if key not in SCHEDULE]
        if others and not (entry.has(f"{side}Time") or entry.has(f"{side}Event")):
            # it may be said in other words, and may be on another day
            wrong = f"there is no such key, and no {side}Time"
            fault(f"{entry.where}: {short(others[0])}", wrong, f"write {side}Time, or leave it out")
    days: set[int] = set()
    given = entry.values.get("day")
    words = [given] if isinstance(given, str) else entry.items("day", empty=False)
    for word in words:
        name = word.strip().upper() if isinstance(word, str) else ""
        if name not in {*DAYS, "ANY"}:
            fault(f"{entry.where}: day", f"it is {short(word)}", f"give some of {', '.join(DAYS)}, ANY")
        days |= set(range(7)) if name == "ANY" else {DAYS.index(name)}
    (rise, start, ahead), (fall, end, behind) = _time(entry, "start"), _time(entry, "end")
    # a time without a UTC offset may have any offset; for two events, the offset is that of the place
    clocks = [clock for clock, event in ((ahead, rise), (behind, fall)) if event is None]
    known = [clock for clock in clocks if clock is not None]
    offsets = (min(known), max(known)) if known and len(known) == len(clocks) else (LATEST, EARLIEST)
    if (rise is not None and start is not None) or (fall is not None and end is not None):
        # a time and an event for the same end contradict each other: assume the longest period
        return Daily(frozenset(days), timedelta(0), 2 * DAY, (LATEST, EARLIEST))
    return Daily(frozenset(days), start or timedelta(0), DAY if end is None else end, offsets, rise, fall)


def _time(entry: Entry, side: str) -> tuple[Event | None, timedelta | None, timedelta | None]:
    """Return the event, the time of day and its UTC offset at the start or end; None for each that is missing."""
    event: Event | None = None
    if entry.has(f"{side}Event"):
        word = entry.choice(f"{side}Event", EVENTS)
        event = next(one for one in EVENTS if one == word)
    key = f"{side}Time"
    if not entry.has(key):
        return event, None, None
    value = entry.values[key]
    match = TIME.fullmatch(value.strip()) if isinstance(value, str) else None
    if match is None:
        entry.wrong(key, "give a time of day with its zone, as 06:00Z or 06:00:00+02:00")
    hours, minutes, seconds = (int(part or 0) for part in match.groups()[:3])
    if not (hours < 24 and minutes < 60 and seconds <= 60) and (hours, minutes, seconds) != (24, 0, 0):  # noqa: PLR2004
        entry.wrong(key, "give a time of day from 00:00 to 24:00")
    zone = match[4]
    offset = None
    if zone is not None:
        sign = -1 if zone[0] == "-" else 1
        ahead = timedelta(0) if zone in "Zz" else timedelta(hours=int(zone[1:3]), minutes=int(zone[-2:]))
        if ahead > DAY:
            entry.wrong(key, "give a zone from -12:00 to +14:00")
        offset = sign * ahead
    return event, timedelta(hours=hours, minutes=minutes, seconds=seconds), offset
