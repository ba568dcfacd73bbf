"""Knowledge of a UAV: its own sightings and the shared ones, separate from the truth; and its sensor."""

import math
from collections.abc import Iterable, Mapping
from collections.abc import Set as AbstractSet
from dataclasses import dataclass, field
from typing import TypeAlias

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.world import World
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
        The threat or area that was seen.
    content
        The threat as it was seen; None for an area, which has only one place.
    is_there
        True if it was seen there, False if it was found missing.
    tick
        The tick of the sighting.
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
        """Hash the parts once, as every UAV looks up every report."""
        object.__setattr__(self, "_hash", hash((self.thing, self.content, self.is_there, self.tick, self.origin)))

    def __hash__(self) -> int:
        """Return the hash of the parts."""
        return self._hash


@dataclass
class Belief:
    """
    The reports of one UAV, in the order of arrival, and the threats and areas it believes in.

    The newest sighting of a thing counts. If a later report says that the thing is not where that sighting saw it, the
    UAV does not believe in it.

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
        """The threats believed in, then the areas, each in the order of the numbers."""
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
        """The reports that reached it, as a set."""
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
        """Keep the newest sighting of a thing, and the last tick at which each of its places was found empty."""
        thing = report.thing
        if not report.is_there:
            place = thing, report.content
            self._refuted_at[place] = max(self._refuted_at.get(place, -1), report.tick)
        elif thing not in self._newest or _is_newer(report, self._newest[thing]):
            self._newest[thing] = report

    def _settle(self, things: set[Thing]) -> None:
        """Update the belief in some things."""
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
        Return the ``F^j`` of Eq. 5: for each UAV, the field of the threats that it saw and that are still believed in.

        Threats are where they are believed to be now.
        """
        by_origin: dict[int, dict[int, Threat]] = {}
        for report in self.journal:
            content = report.content
            if content is not None and report.is_there and self._things.get(report.thing) == content:
                by_origin.setdefault(report.origin, {})[report.thing[1]] = content
        return [RiskField([threats[number] for number in sorted(threats)]) for _, threats in sorted(by_origin.items())]


def _is_newer(one: Report, other: Report) -> bool:
    """Order sightings by tick, then by origin and content, so that the order of arrival does not matter."""
    if one.tick != other.tick:
        return one.tick > other.tick
    if one.origin != other.origin:
        return one.origin < other.origin
    return repr(one.content) > repr(other.content)


def sightings(
    world: World, tick: int, belief: Belief, seen_from: FloatArray, radius: float, origin: int
) -> list[Report]:
    """
    Return reports of the things that a UAV sees and did not know.

    Parameters
    ----------
    world, tick
        The truth, and the current tick.
    belief
        Its belief before.
    seen_from
        Its position, or the waypoints that it looks along, shape ``(m, 2)`` with ``m >= 1``, map units.
    radius
        Map units. It sees a threat when the centre is within the radius, an area when any part is, and likewise that
        one it believes in is missing.
    origin
        The number of the UAV.

    Returns
    -------
    reports
        Vanished things first; threats before areas, in the order of their numbers.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> world = World(RiskField([Threat(0.5, 0.5, 0.1), Threat(0.9, 0.9, 0.1)]))
    >>> [report.thing for report in sightings(world, 0, Belief(), np.array([[0.4, 0.4]]), 0.2, origin=0)]
    [('threat', 0)]
    """
    there: dict[Thing, Threat | None] = {("threat", number): at for number, at in world.threats_at(tick).items()}
    there |= {("area", number): None for number in world.areas_at(tick)}

    def is_seen(thing: Thing, content: Threat | None) -> bool:
        if content is None:
            return _from_area(seen_from, world.polygons[thing[1]]) <= radius
        return _from(seen_from, (content.x, content.y)) <= radius

    return [
        Report(thing, content, is_there=is_there, tick=tick, origin=origin)
        for is_there, things, others in ((False, belief.things, there), (True, there, belief.things))
        for thing, content in things.items()
        if (thing, content) not in others.items() and is_seen(thing, content)
    ]


def _from(seen_from: FloatArray, place: Point) -> float:
    """Return the distance from a place to a single point, or to the polyline of several."""
    return math.dist(seen_from[0], place) if len(seen_from) == 1 else _from_area(seen_from, shapely.Point(place))


def _from_area(seen_from: FloatArray, area: BaseGeometry) -> float:
    looking = shapely.LineString(seen_from) if len(seen_from) > 1 else shapely.Point(seen_from[0])
    return float(shapely.distance(looking, area))
