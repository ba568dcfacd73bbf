"""What a UAV believes: its own sightings and what others told it, apart from the truth."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from cgla_graph.model.risk import RiskField, Threat


@dataclass(frozen=True)
class Report:
    """
    A sighting: that something is there, or that it is not where it was believed to be.

    Attributes
    ----------
    thing
        What: ``("threat", number)`` or ``("area", number)``, numbered as in the `World`.
    content
        The threat as it was seen; None for an area, which has only one place.
    is_there
        Whether it was seen there, or found missing.
    tick
        When.
    origin
        The number of the UAV that saw it.
    """

    thing: tuple[str, int]
    content: Threat | None
    is_there: bool
    tick: int
    origin: int


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
    _newest: dict[tuple[str, int], Report] = field(default_factory=dict)
    _refuted_at: dict[tuple[tuple[str, int], Threat | None], int] = field(default_factory=dict)
    _threats: dict[int, Threat] = field(default_factory=dict)
    _areas: set[int] = field(default_factory=set)

    @property
    def threats(self) -> Mapping[int, Threat]:
        """The threats believed in, by their number, in the order of the numbers."""
        return self._threats

    @property
    def areas(self) -> frozenset[int]:
        """The numbers of the timed areas believed to be closed."""
        return frozenset(self._areas)

    def hear(self, reports: Iterable[Report]) -> list[Report]:
        """
        Take in reports.

        Returns
        -------
        new
            Those not known before.
        """
        new = [report for report in dict.fromkeys(reports) if report not in self._known]
        self._known.update(new)
        self.journal += new
        for report in new:
            self._note(report)
        for thing in dict.fromkeys(report.thing for report in new):
            self._settle(thing)
        return new

    def _note(self, report: Report) -> None:
        """Keep the newest sighting of a thing, and when each of its places was last found empty."""
        thing = report.thing
        if not report.is_there:
            place = thing, report.content
            self._refuted_at[place] = max(self._refuted_at.get(place, -1), report.tick)
        elif thing not in self._newest or _order(report) > _order(self._newest[thing]):
            self._newest[thing] = report

    def _settle(self, thing: tuple[str, int]) -> None:
        """Work out what is believed of one thing."""
        kind, number = thing
        newest = self._newest.get(thing)
        is_there = newest is not None and self._refuted_at.get((thing, newest.content), -1) <= newest.tick
        if kind == "area":
            (self._areas.add if is_there else self._areas.discard)(number)
        elif newest is None or newest.content is None or not is_there:
            self._threats.pop(number, None)
        elif number in self._threats:
            self._threats[number] = newest.content
        else:
            self._threats[number] = newest.content
            self._threats = dict(sorted(self._threats.items()))

    def fields_by_origin(self) -> list[RiskField]:
        """
        Return the risk field of each UAV that saw anything still believed in: the ``F^j`` of Eq. 5.

        Threats keep the place where they are believed to be now.
        """
        by_origin: dict[int, dict[int, Threat]] = {}
        for report in self.journal:
            kind, number = report.thing
            if kind == "threat" and report.is_there and self._threats.get(number) == report.content:
                by_origin.setdefault(report.origin, {})[number] = self._threats[number]
        return [RiskField([threats[number] for number in sorted(threats)]) for _, threats in sorted(by_origin.items())]


def _order(report: Report) -> tuple[int, int, str]:
    """Order sightings by time; of two on one tick, always the same one counts, whoever was heard first."""
    return report.tick, -report.origin, repr(report.content)
