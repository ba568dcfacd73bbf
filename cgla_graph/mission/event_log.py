"""The events of a mission in order; what a message brings is kept whole, and its events are made when they are read."""

from bisect import bisect_right
from collections.abc import Iterable, Iterator, Sequence
from typing import NamedTuple, overload

from cgla_graph.mission.belief import Report
from cgla_graph.mission.records import Event


class Learned(NamedTuple):
    """
    The reports of a message that are new to its receiver: an event each.

    Attributes
    ----------
    tick
        The tick of arrival.
    receiver, sender
        The names of two UAVs.
    reports
        The reports.
    names
        The names of all UAVs, by their number.
    """

    tick: int
    receiver: str
    sender: str
    reports: Sequence[Report]
    names: Sequence[str]

    def event(self, i: int) -> Event:
        """Return the event of report `i`."""
        report = self.reports[i]
        kind, number = report.thing
        origin = self.names[report.origin]
        detail = {kind: number, "source": self.sender, "origin": origin, "seen": report.tick}
        return Event(self.tick, "learned", self.receiver, {**detail, "is_there": report.is_there})


class EventLog(Sequence[Event]):
    """
    The events of a mission, in order.

    Five hundred UAVs tell each other five million things on their first tick. So it holds messages, not their events.

    Parameters
    ----------
    entries
        Events, and messages that bring one or more.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> told = [Report(("threat", i), Threat(i, 0, 1), is_there=True, tick=0, origin=1) for i in range(3)]
    >>> log = EventLog([Event(0, "departed", "a"), Learned(2, "a", "b", told, ["a", "b"])])
    >>> len(log), log[1].detail["threat"], log[-1].detail["origin"], [event.kind for event in log[:2]]
    (4, 0, 'b', ['departed', 'learned'])
    """

    def __init__(self, entries: Iterable[Event | Learned] = ()) -> None:
        self._entries: list[Event | Learned] = []
        self._ends: list[int] = []
        for entry in entries:
            self.append(entry)

    def append(self, entry: Event | Learned) -> None:
        """Add an event, or a message."""
        n_events = len(entry.reports) if isinstance(entry, Learned) else 1
        self._entries.append(entry)
        self._ends.append(len(self) + n_events)

    def copy(self) -> "EventLog":
        """Return a log that does not grow with this one."""
        other = EventLog()
        other._entries, other._ends = self._entries.copy(), self._ends.copy()
        return other

    def without(self, tick: int, uav: str, kinds: Iterable[str]) -> "EventLog":
        """Return the log without events of some kinds of one UAV on a tick."""
        undone = [(tick, uav, kind) for kind in kinds]
        return EventLog(
            entry
            for entry in self._entries
            if isinstance(entry, Learned) or (entry.tick, entry.uav, entry.kind) not in undone
        )

    def __len__(self) -> int:
        """Return the number of events."""
        return self._ends[-1] if self._ends else 0

    @overload
    def __getitem__(self, index: int) -> Event: ...

    @overload
    def __getitem__(self, index: slice) -> tuple[Event, ...]: ...

    def __getitem__(self, index: int | slice) -> Event | tuple[Event, ...]:
        """Return one event, or some as a tuple."""
        where = range(len(self))[index]
        if isinstance(where, range):
            return tuple(self[i] for i in where)
        at = bisect_right(self._ends, where)
        entry = self._entries[at]
        return entry.event(where - self._ends[at]) if isinstance(entry, Learned) else entry

    def __iter__(self) -> Iterator[Event]:
        """Go through the events in order."""
        for entry in self._entries:
            if isinstance(entry, Learned):
                yield from map(entry.event, range(len(entry.reports)))
            else:
                yield entry

    def __eq__(self, other: object) -> bool:
        """Return whether another sequence holds equal events in the same order."""
        if isinstance(other, EventLog) and other._entries == self._entries:
            return True
        return isinstance(other, Sequence) and len(self) == len(other) and all(map(Event.__eq__, self, other))

    __hash__ = None  # type: ignore[assignment] # it grows
