"""When a zone applies: from a date to another, on days of the week, at times of the day."""

import re
from dataclasses import dataclass
from datetime import UTC, datetime, timedelta

from cgla_graph.untrusted.files import fault
from cgla_graph.zones.entries import Entry
from cgla_graph.zones.shapes import short

DAYS = ("MON", "TUE", "WED", "THU", "FRI", "SAT", "SUN")
#: Sun and twilight, as ED-318 has them: when they are depends on the place, so that they stand for the whole day.
EVENTS = ("BMCT", "SR", "SS", "EECT")
#: Where on the Earth it is earliest and latest, against UTC: a time of day without a zone is any of these.
EARLIEST, LATEST = timedelta(hours=14), timedelta(hours=-12)
DAY, MINUTE, SECOND = timedelta(days=1), timedelta(minutes=1), timedelta(seconds=1)
TIME = re.compile(r"(\d{2}):(\d{2})(?::(\d{2})(?:[.,]\d+)?)?\s*(Z|z|[+-]\d{2}:?\d{2})?", re.ASCII)


@dataclass(frozen=True)
class Daily:
    """
    Times of a day on which a zone applies; both ends count, the last to the end of its minute or second.

    Parameters
    ----------
    days
        Of the week, Monday is 0: those on which it begins.
    start, end
        Since midnight; an end that is not after the start is on the next day.
    offsets
        What the clock is ahead of UTC, the least and the most that it may be.

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

    def includes(self, moment: datetime) -> bool:
        """Whether a moment is in it, wherever the clock may stand."""
        least, most = self.offsets
        end = self.end + (DAY if self.end <= self.start else timedelta(0))
        end += SECOND if self.end.seconds % 60 else MINUTE
        since = moment - datetime(1, 1, 1, tzinfo=UTC)
        today = since // DAY
        # a day began yesterday somewhere, and its times may go on into the next
        for day in range(max(0, today - 3), today + 3):
            # (1 January of year 1 was a Monday)
            if day % 7 in self.days and day * DAY + self.start - most <= since < day * DAY + end - least:
                return True
        return False


@dataclass(frozen=True)
class Period:
    """
    A time in which a zone applies.

    Parameters
    ----------
    start, end
        None where it has no beginning, or no end.
    schedule
        Times of day; all day where there is none.

    Examples
    --------
    >>> Period(datetime(2026, 8, 1, tzinfo=UTC), None).includes(datetime(2026, 7, 31, tzinfo=UTC))
    False
    """

    start: datetime | None
    end: datetime | None
    schedule: tuple[Daily, ...] = ()

    def includes(self, moment: datetime) -> bool:
        """Whether a moment is in it."""
        if (self.start is not None and moment < self.start) or (self.end is not None and moment > self.end):
            return False
        return not self.schedule or any(daily.includes(moment) for daily in self.schedule)


def period_of(entry: Entry) -> Period:
    """
    Read ``startDateTime``, ``endDateTime`` and ``schedule``, which both standards write alike.

    Raises
    ------
    FileFormatError
        If one of them is not what it should be.

    Examples
    --------
    >>> period_of(Entry({"startDateTime": "2026-08-01T06:00:00Z"}, "zone 'A'")).start.isoformat()
    '2026-08-01T06:00:00+00:00'
    """
    start, end = (moment_of(entry, key) if entry.has(key) else None for key in ("startDateTime", "endDateTime"))
    if start is not None and end is not None and end < start:
        entry.wrong("endDateTime", f"give a time after startDateTime, {start.isoformat()}")
    return Period(start, end, tuple(_daily(one) for one in entry.entries("schedule")))


def moment_of(entry: Entry, key: str) -> datetime:
    """
    Read a date and time with its zone (RFC 3339).

    Raises
    ------
    FileFormatError
        If it is anything else.
    """
    value = entry.values.get(key)
    moment = _moment(value) if isinstance(value, str) else None
    if moment is None:
        entry.wrong(key, "give a date and time with its zone, as 2026-08-01T06:00:00Z")
    return moment


def moment_from(text: str, where: str) -> datetime:
    """
    Read a date and time that a user gives.

    Raises
    ------
    FileFormatError
        If it is none, or has no zone.

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
    """Return a moment, UTC; nothing for a text that is none, or has no zone."""
    # midnight at the end of a day has two names
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
    days: set[int] = set()
    given = entry.values.get("day")
    words = [given] if isinstance(given, str) else entry.items("day", empty=False)
    for word in words:
        name = word.strip().upper() if isinstance(word, str) else ""
        if name not in {*DAYS, "ANY"}:
            fault(f"{entry.where}: day", f"it is {short(word)}", f"give some of {', '.join(DAYS)}, ANY")
        days |= set(range(7)) if name == "ANY" else {DAYS.index(name)}
    (start, ahead), (end, behind) = _time(entry, "start"), _time(entry, "end")
    # sun and twilight, and times without a zone, are whenever they may be
    known = not any(entry.has(f"{side}Event") for side in ("start", "end"))
    offsets = (
        (min(ahead, behind), max(ahead, behind))
        if known and ahead is not None and behind is not None
        else (LATEST, EARLIEST)
    )
    return Daily(frozenset(days), start or timedelta(0), DAY if end is None else end, offsets)


def _time(entry: Entry, side: str) -> tuple[timedelta | None, timedelta | None]:
    """Return a time of day, and what its clock is ahead of UTC; nothing where it is not said."""
    if entry.has(f"{side}Event"):
        entry.choice(f"{side}Event", EVENTS)
        return None, None
    key = f"{side}Time"
    if not entry.has(key):
        return None, None
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
    return timedelta(hours=hours, minutes=minutes, seconds=seconds), offset
