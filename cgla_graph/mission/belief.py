"""What a UAV believes: its own sightings and what others told it, apart from the truth."""

from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from typing import TypeAlias

from cgla_graph.model.risk import RiskField, Threat

#: ``("threat", number)`` or ``("area", number)``, numbered as in the `World`.
Thing: TypeAlias = tuple[str, int]


@dataclass(frozen=True)
class Report:
    """
    A sighting: that something is there, or that it is not where it was believed to be.

    Attributes
    ----------
    thing
        The things seen.
    content
        The threat as it was seen; None for an area, which has only one place.
    is_there
        Whether it was seen there, or found missing.
    tick
        When.
    origin
        The number of the UAV that saw it.
    """

    thing: Thing
    content: Threat | None
    is_there: bool
    tick: int
    origin: int
    _hash: int = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        """Hash the parts once: every UAV looks for every report among those it knows."""
        object.__setattr__(self, "_hash", hash((self.thing, self.content, self.is_there, self.tick, self.origin)))

    def __hash__(self) -> int:
        """Return the hash of the parts."""
        return self._hash


@dataclass
class Belief:
    """
    The reports of one UAV, in the order in which they reached it, and what follows from them.

    Of one thing, the newest report that it is there counts; if a later one says that just that is not so, nothing is
    believed of it.

    Attributes
    ----------
    journal
        All reports, each once.

    Examples
    --------
    >>> seen = Report(("threat", 0), Threat(0, 0, 1), is_there=True, tick=3, origin=1)
    >>> gone = Report(("threat", 0), Threat(0, 0, 1), is_there=False, tick=8, origin=2)
    >>> belief = Belief()
    >>> [(len(belief.hear([report])), len(belief.threats)) for report in (seen, seen, gone)]
    [(1, 1), (0, 1), (1, 0)]
    """

    journal: list[Report] = field(default_factory=list)
    _known: set[Report] = field(default_factory=set)
    _newest: dict[Thing, Report] = field(default_factory=dict)
    _refuted_at: dict[tuple[Thing, Threat | None], int] = field(default_factory=dict)
    _things: dict[Thing, Threat | None] = field(default_factory=dict)

    @property
    def things(self) -> Mapping[Thing, Threat | None]:
        """All that is believed in, threats before areas, in the order of the numbers."""
        return self._things

    @property
    def threats(self) -> dict[int, Threat]:
        """The threats believed in, by their number, in the order of the numbers."""
        return {number: threat for (_, number), threat in self._things.items() if threat is not None}

    @property
    def areas(self) -> frozenset[int]:
        """The numbers of the timed areas believed to be closed."""
        return frozenset(number for kind, number in self._things if kind == "area")

    @property
    def known(self) -> AbstractSet[Report]:
        """All reports that reached it."""
        return self._known

    def hear(self, reports: Iterable[Report]) -> list[Report]:
        """
        Take in reports.

        Returns
        -------
        new
            Those not known before.
        """
        new = []
        for report in reports:
            if report not in self._known:
                self._known.add(report)
                self._note(report)
                new.append(report)
        self.journal += new
        self._settle({report.thing for report in new})
        return new

    def _note(self, report: Report) -> None:
        """Keep the newest sighting of a thing, and when each of its places was last found empty."""
        thing = report.thing
        if not report.is_there:
            place = thing, report.content
            self._refuted_at[place] = max(self._refuted_at.get(place, -1), report.tick)
        elif thing not in self._newest or _is_newer(report, self._newest[thing]):
            self._newest[thing] = report

    def _settle(self, things: set[Thing]) -> None:
        """Compute the belief about some things."""
        if not things:
            return
        believed = dict(self._things)
        for thing in things:
            newest = self._newest.get(thing)
            if newest is None or self._refuted_at.get((thing, newest.content), -1) > newest.tick:
                believed.pop(thing, None)
            else:
                believed[thing] = newest.content
        self._things = {
            thing: believed[thing] for thing in sorted(believed, key=lambda one: (one[0] == "area", one[1]))
        }

    def fields_by_origin(self) -> list[RiskField]:
        """
        Return the risk field of each UAV that saw anything still believed in: the ``F^j`` of Eq. 5.

        Threats keep the place where they are believed to be now.
        """
        by_origin: dict[int, dict[int, Threat]] = {}
        for report in self.journal:
            content = report.content
            if content is not None and report.is_there and self._things.get(report.thing) == content:
                by_origin.setdefault(report.origin, {})[report.thing[1]] = content
        return [RiskField([threats[number] for number in sorted(threats)]) for _, threats in sorted(by_origin.items())]


def _is_newer(one: Report, other: Report) -> bool:
    """Order sightings by time; of two on one tick, the same one always counts, in any order of arrival."""
    if one.tick != other.tick:
        return one.tick > other.tick
    if one.origin != other.origin:
        return one.origin < other.origin
    return repr(one.content) > repr(other.content)
