"""What a UAV believes: its own sightings and what others told it, apart from the truth."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from cgla_graph.risk import RiskField, Threat


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

    Of one thing, the newest report that it is there counts, unless a newer one says that just that is not so.

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
        for thing in {report.thing for report in new}:
            self._settle(thing)
        return new

    def _settle(self, thing: tuple[str, int]) -> None:
        """Work out what is believed of one thing."""
        about = [report for report in self.journal if report.thing == thing]
        kind, number = thing
        believed = max(
            (report for report in about if report.is_there and not _refuted(report, about)),
            # of two sightings on one tick, of different places, always the same one, whoever was heard first
            key=lambda report: (report.tick, -report.origin, repr(report.content)),
            default=None,
        )
        if kind == "area":
            (self._areas.add if believed else self._areas.discard)(number)
        elif believed is None or believed.content is None:
            self._threats.pop(number, None)
        else:
            self._threats[number] = believed.content
            self._threats = dict(sorted(self._threats.items()))

    def fields_by_origin(self, *, improper: bool = False) -> list[RiskField]:
        """
        Return the risk field of each UAV that saw anything still believed in: the ``F^j`` of Eq. 5.

        Threats keep the place where they are believed to be now.
        """
        by_origin: dict[int, dict[int, Threat]] = {}
        for report in self.journal:
            kind, number = report.thing
            if kind == "threat" and report.is_there and self._threats.get(number) == report.content:
                by_origin.setdefault(report.origin, {})[number] = self._threats[number]
        return [
            RiskField([threats[number] for number in sorted(threats)], improper=improper)
            for _, threats in sorted(by_origin.items())
        ]


def _refuted(sighting: Report, about: Iterable[Report]) -> bool:
    """Return whether a later report says that what was sighted is not there."""
    return any(
        not other.is_there and other.content == sighting.content and other.tick > sighting.tick for other in about
    )
