"""Knowledge of a UAV: its own sightings and the shared ones, separate from the truth; and its sensor."""

import math
from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.mission.world import Thing, World
from cgla_graph.model.risk import RiskField, Threat

#: The columns of `Log.table`.
THING, PLACE, TICK, RANK, IS_THERE = range(5)
#: Factor of a distance that allows for the rounding of its square.
ROUNDED = 1.0 + 1e-9


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


class View:
    """
    What a UAV believes in: one object for all UAVs of a team that believe in the same.

    Attributes
    ----------
    things
        The threats, then the areas, each in the order of their numbers.
    items
        The same as a tuple, to be compared.
    threats
        The threats, by their number.
    areas
        The numbers of the timed areas believed to be closed.

    Examples
    --------
    >>> view = View({("threat", 3): Threat(0, 0, 1), ("area", 1): None})
    >>> list(view.threats), view.areas
    ([3], frozenset({1}))
    """

    def __init__(self, things: Mapping[Thing, Threat | None]) -> None:
        self.things = things
        self.items = tuple(things.items())
        self.threats = {number: threat for (_, number), threat in things.items() if threat is not None}
        self.areas = frozenset(number for kind, number in things if kind == "area")
        self._compared: tuple[Mapping[Thing, Threat | None], Unseen, Unseen] | None = None

    def against(self, there: Mapping[Thing, Threat | None]) -> "tuple[Unseen, Unseen]":
        """Return what it believes in that is not there, and what is there that it does not believe in."""
        if self._compared is None or self._compared[0] is not there:
            sides = (self.things, there.items()), (there, self.things.items())
            gone, unknown = (
                Unseen([(thing, content) for thing, content in mine.items() if (thing, content) not in theirs])
                for mine, theirs in sides
            )
            self._compared = there, gone, unknown
        return self._compared[1:]


class Unseen:
    """Things of which a UAV may see whether they are there; the places of the threats are kept as arrays."""

    def __init__(self, things: list[tuple[Thing, Threat | None]]) -> None:
        self.things = things
        self._threats = [i for i, (_, content) in enumerate(things) if content is not None]
        self._areas = [i for i, (_, content) in enumerate(things) if content is None]
        places = [(content.x, content.y) for _, content in things if content is not None]
        self._places = np.array(places, dtype=np.float64).reshape(-1, 2)

    def within(self, seen_from: FloatArray, radius: float, polygons: Mapping[int, BaseGeometry]) -> list[int]:
        """Return which of the things are within a radius of a point, or of a polyline of several, rising."""
        if len(seen_from) > 1:
            apart = shapely.distance(shapely.LineString(seen_from), shapely.points(self._places))
            near = [self._threats[i] for i in np.flatnonzero(apart <= radius).tolist()]
        else:
            # (squares leave out most; the rim is measured to the last bit)
            apart2 = ((self._places - seen_from[0]) ** 2).sum(axis=1)
            near = [
                self._threats[i]
                for i in np.flatnonzero(apart2 <= (radius * ROUNDED) ** 2).tolist()
                if math.dist(seen_from[0], self._places[i]) <= radius
            ]
        if self._areas:
            looking = shapely.LineString(seen_from) if len(seen_from) > 1 else shapely.Point(seen_from[0])
            apart = shapely.distance(looking, [polygons[self.things[i][0][1]] for i in self._areas])
            near += [self._areas[i] for i in np.flatnonzero(apart <= radius).tolist()]
        return sorted(near)


class Log:
    """
    The reports of a team, each once and with a number, and which of its UAVs know which.

    Attributes
    ----------
    reports
        All reports, by their number.
    known
        Whether a UAV knows a report, shape (UAVs, room for reports).

    Examples
    --------
    >>> log = Log()
    >>> seen = Report(("threat", 0), Threat(0, 0, 1), is_there=True, tick=3, origin=1)
    >>> log.number(seen), log.number(seen), log.reports == [seen]
    (0, 0, True)
    """

    def __init__(self) -> None:
        self.reports: list[Report] = []
        self.known = np.zeros((0, 64), dtype=np.bool_)
        self.things: dict[Thing, int] = {}
        self.places: dict[tuple[Thing, Threat | None], int] = {}
        self._numbers: dict[Report, int] = {}
        self._columns: list[tuple[int, int, int, int, bool]] = []
        self._table = np.empty((0, 5), dtype=np.int64)
        self._views: dict[bytes, View] = {}
        self.nothing = View({})

    def join(self) -> int:
        """Return the row of a UAV that joins the team."""
        self.known = np.pad(self.known, ((0, 1), (0, 0)))
        return len(self.known) - 1

    def number(self, report: Report) -> int:
        """Return the number of a report, which may be new."""
        number = self._numbers.setdefault(report, len(self.reports))
        if number == len(self.reports):
            self.reports.append(report)
            thing = self.things.setdefault(report.thing, len(self.things))
            place = self.places.setdefault((report.thing, report.content), len(self.places))
            self._columns.append((thing, place, report.tick, -report.origin, report.is_there))
            if number == self.known.shape[1]:
                self.known = np.pad(self.known, ((0, 0), (0, number)))
        return number

    def table(self) -> IntArray:
        """
        Return thing, place, tick, rank and whether it is there of all reports, shape ``(n, 5)``.

        Ranks order sightings by tick, then by origin and content, so that the order of arrival does not matter.
        """
        if len(self._table) < len(self.reports):
            self._table = np.array(self._columns, dtype=np.int64)
            words = [repr(content) for _, content in self.places]
            order = {word: i for i, word in enumerate(sorted(set(words)))}
            content = np.array([order[word] for word in words])[self._table[:, PLACE]]
            by_age = np.lexsort((content, self._table[:, RANK], self._table[:, TICK]))
            self._table[by_age, RANK] = np.arange(len(by_age))
        return self._table

    def view(self, places: IntArray) -> View:
        """Return the view that believes in some of `places`, in the order of the things; -1: not in that thing."""
        key = places.tobytes()
        if key not in self._views:
            contents = list(self.places)
            believed = [contents[place] for place in places.tolist() if place >= 0]
            believed.sort(key=lambda one: (one[0][0] == "area", one[0][1]))
            self._views[key] = View(dict(believed))
        return self._views[key]


class Belief:
    """
    The reports of one UAV, in the order of arrival, and the threats and areas it believes in.

    The newest sighting of a thing counts. If a later report says that the thing is not where that sighting saw it, the
    UAV does not believe in it.

    Parameters
    ----------
    log
        The reports of its team; None: a team of its own.

    Attributes
    ----------
    numbers
        The numbers of its reports in the log, in the order of arrival.

    Examples
    --------
    >>> seen = Report(("threat", 0), Threat(0, 0, 1), is_there=True, tick=3, origin=1)
    >>> gone = Report(("threat", 0), Threat(0, 0, 1), is_there=False, tick=8, origin=2)
    >>> belief = Belief()
    >>> [(len(belief.hear([report])), len(belief.threats)) for report in (seen, seen, gone)]
    [(1, 1), (0, 1), (1, 0)]
    """

    def __init__(self, log: Log | None = None) -> None:
        self.log = Log() if log is None else log
        self.row = self.log.join()
        self.numbers: list[int] = []
        self._n_settled = 0
        # by the number of a thing, its newest sighting; by that of a place, the last tick at which it was found empty
        self._newest = np.empty(0, dtype=np.int64)
        self._refuted_at = np.empty(0, dtype=np.int64)
        self._view = self.log.nothing

    @property
    def journal(self) -> list[Report]:
        """All its reports, each once."""
        return [self.log.reports[number] for number in self.numbers]

    @property
    def view(self) -> View:
        """What it believes in; the same object until that changes."""
        if self._n_settled < len(self.numbers):
            self._settle(np.array(self.numbers[self._n_settled :]))
            self._n_settled = len(self.numbers)
        return self._view

    @property
    def things(self) -> Mapping[Thing, Threat | None]:
        """The threats believed in, then the areas, each in the order of the numbers."""
        return self.view.things

    @property
    def threats(self) -> Mapping[int, Threat]:
        """The threats believed in, by their number, in the order of the numbers."""
        return self.view.threats

    @property
    def areas(self) -> frozenset[int]:
        """The numbers of the timed areas believed to be closed."""
        return self.view.areas

    def hear(self, reports: Iterable[Report]) -> list[Report]:
        """
        Take in reports.

        Returns
        -------
        new
            Those not known before.
        """
        numbers = dict.fromkeys(self.log.number(report) for report in reports)
        known = self.log.known[self.row]
        new = [number for number in numbers if not known[number]]
        known[new] = True
        self.numbers += new
        return [self.log.reports[number] for number in new]

    def join(self, log: Log) -> None:
        """Join the team of another log, with all reports."""
        if self.log is not log:
            reports = self.journal
            self.__init__(log)  # type: ignore[misc] # the same UAV in another team
            self.hear(reports)

    def _settle(self, new: IntArray) -> None:
        """Update the newest sightings, the places found empty, and the belief."""
        table = self.log.table()
        newest, refuted_at = (
            _longer(self._newest, len(self.log.things)),
            _longer(self._refuted_at, len(self.log.places)),
        )
        missing = table[new][table[new, IS_THERE] == 0]
        np.maximum.at(refuted_at, missing[:, PLACE], missing[:, TICK])
        # of several assignments to one thing, the last one stays: that of the greatest rank
        seen = np.concatenate([newest[newest >= 0], new[table[new, IS_THERE] == 1]])
        seen = seen[table[seen, RANK].argsort()]
        newest[table[seen, THING]] = seen
        self._newest, self._refuted_at = newest, refuted_at
        last = table[newest]
        believed = (newest >= 0) & (refuted_at[last[:, PLACE]] <= last[:, TICK])
        self._view = self.log.view(np.where(believed, last[:, PLACE], -1))

    def fields_by_origin(self) -> list[RiskField]:
        """
        Return the ``F^j`` of Eq. 5: for each UAV, the field of the threats that it saw and that are still believed in.

        Threats are where they are believed to be now.
        """
        by_origin: dict[int, dict[int, Threat]] = {}
        things = self.things
        for report in self.journal:
            content = report.content
            if content is not None and report.is_there and things.get(report.thing) == content:
                by_origin.setdefault(report.origin, {})[report.thing[1]] = content
        return [RiskField([threats[number] for number in sorted(threats)]) for _, threats in sorted(by_origin.items())]


def _longer(array: IntArray, length: int) -> IntArray:
    """Return an array with -1 behind its end."""
    return np.concatenate([array, np.full(length - len(array), -1)])


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
    gone, unknown = belief.view.against(world.things_at(tick))
    return [
        Report(*side.things[i], is_there=is_there, tick=tick, origin=origin)
        for is_there, side in ((False, gone), (True, unknown))
        if side.things
        for i in side.within(seen_from, radius, world.polygons)
    ]
