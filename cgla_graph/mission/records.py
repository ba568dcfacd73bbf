"""Records of a flown mission: the flight of each UAV, separations, and events."""

import dataclasses
import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import TYPE_CHECKING, Any, Literal, NamedTuple, TypeAlias, TypeVar

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._lazy import function_above
from cgla_graph._text import ShortRepr, plain_json
from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.clairvoyance import least_costs_alone
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.model.risk import Threat
from cgla_graph.motion.trajectory import Approach

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

#: Lower bounds of UAVs are refined to this gap.
BOUND_TOLERANCE = 0.001
#: Risk above which a flight is exposed.
EXPOSED_ABOVE = 0.1

#: Measures of UAVs that a flight adds up.
_SUMMED = ("length", "risk", "risk_sum")

Entry = TypeVar("Entry", bound=tuple[Any, ...])
EventKind: TypeAlias = Literal[
    "delayed",
    "departed",
    "started-in-risk",
    "detected",
    "refuted",
    "learned",
    "appeared-on",
    "planned",
    "kept",
    "near",
    "no-path",
    "stuck",
    "collision",
    "arrived",
    "livelock",
    "out-of-ticks",
    "interrupted",
]


class MissionStatus(Enum):
    """
    How a UAV's flight ended; the value is the sentence.

    Examples
    --------
    >>> MissionStatus.OUT_OF_TICKS.label
    'out-of-ticks'
    """

    ARRIVED = "arrived at its goal"
    OUT_OF_TICKS = "did not arrive within the ticks of the mission"
    NO_PATH = "found no path to its goal"
    STUCK = "got stuck: its planner knew no further step"
    COLLISION = "came closer to another UAV than the collision distance"
    LIVELOCK = "flies in circles without end: the whole state of the mission came back"
    INTERRUPTED = "was still flying when the mission was interrupted"

    @property
    def label(self) -> str:
        """The short name for tables and files."""
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True)
class Event:
    """
    An event of a mission.

    Attributes
    ----------
    tick
        The tick of the event.
    kind
        ``delayed``: the UAV waits on the ground, because an `area` is closed over its start, an `other` UAV is within
        the safe distance of it, or no plan keeps the safe distances (`reason`); ``departed``: it took off;
        ``started-in-risk``: it took off within a spread of a threat; ``detected``: it saw an unknown threat or area;
        ``refuted``: it saw that one it believed in is missing; ``learned``: it heard of one from another UAV
        (`source`); ``planned``: it has a new plan; ``kept``: no new plan keeps the safe distances, and it keeps the
        last one; ``near``: another UAV is within the safe distance, inside terminal discs too;
        ``appeared-on``: a threat or area appeared around it; ``collision``, ``arrived``, ``no-path``, ``stuck``,
        ``livelock``, ``out-of-ticks``, ``interrupted``: its flight ended.
    uav
        The name of the UAV.
    detail
        Further names, numbers and points.

    Examples
    --------
    >>> Event(3, "detected", "a", {"threat": 7}).document()
    {'tick': 3, 'kind': 'detected', 'uav': 'a', 'threat': 7}
    """

    tick: int
    kind: EventKind
    uav: str
    detail: Mapping[str, Any] = field(default_factory=dict)

    def document(self) -> dict[str, Any]:
        """Return the event as one flat JSON object."""
        return {"tick": self.tick, "kind": self.kind, "uav": self.uav, **self.detail}

    @property
    def hindrance(self) -> str:
        """Why the UAV is ``delayed``, in a few words; empty for all other events."""
        if self.kind != "delayed":
            return ""
        if "other" in self.detail:
            return f"UAV {self.detail['other']} is {self.detail['distance']:.3g} from its start"
        return (
            f"area {self.detail['area']} is closed over its start" if "area" in self.detail else self.detail["reason"]
        )


class Knowledge(NamedTuple):
    """
    The threats and areas that a UAV believes in from a tick on.

    Attributes
    ----------
    tick
        The first tick.
    threats
        The threats, by their number in the world, where the UAV believes them to be.
    areas
        The timed no-fly areas, by their number in the world.
    """

    tick: int
    threats: Mapping[int, Threat]
    areas: Mapping[int, BaseGeometry]


@dataclass(frozen=True, kw_only=True)
class Separation(Approach):
    """
    The least separation of two UAVs while both were in the air, outside their terminal discs.

    Attributes
    ----------
    first, second
        Their names. (The distance is infinite if they were never in the air together.)
    """

    first: str
    second: str

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {"uavs": [self.first, self.second], "distance": self.distance, "tick": self.time, "where": self.where}


@dataclass(frozen=True)
class Livelock:
    """
    A proof that a mission never ends: its whole state at one tick repeats.

    Attributes
    ----------
    since
        The tick of the first of the two equal states.
    period
        Ticks between them.
    """

    since: int
    period: int


@dataclass(frozen=True, eq=False)
class Measures:
    """
    Measures of a flown polyline in the true world of each tick.

    Attributes
    ----------
    length, risk
        Length, map units, and risk. A UAV that waits circles: it flies a step a tick, and its length and risk count.
    risk_sum
        The paper's measure: the sum of the true ``F`` over the positions at whole ticks.
    max_risk
        The greatest true ``F`` met (sampled 16 times per spread or per flown segment, the shorter of the two).
    exposure
        The length flown where the true ``F`` is above 0.1, map units (sampled likewise).
    """

    length: float
    risk: float
    risk_sum: float
    max_risk: float
    exposure: float


@dataclass(frozen=True, eq=False)
class UavFlight(ShortRepr, Measures):
    """
    The flight of one UAV, with its `Measures`.

    Attributes
    ----------
    uav
        The UAV.
    status, message
        How the flight ended, and why, in one line.
    took_off
        Whether it took off.
    departed, ended
        The ticks of take-off, which may be later than `Uav.departs`, and of the end; both are the tick of the end if it
        never took off.
    trace
        Positions at the ticks from `departed` to `ended`, shape ``(t, 2)``, map units.
    path
        The flown polyline with its bends between ticks, shape ``(m, 2)``, map units.
    times
        The time at each waypoint of the path, shape ``(m,)``, ticks.
    waited
        Ticks of waiting, which only ``avoidance="prioritized"`` plans.
    plans
        ``(tick, waypoints)``: the plan from that tick on; the first is the plan of take-off.
    knowledge
        The threats and areas that it believed in, each from a tick on.
    obstacles
        ``(tick, threats)``: the virtual obstacles that it planned around, each from a tick on.
    planning_seconds
        Time spent on its plans.
    remark
        A remark of its planner on the flight; may be empty.
    """

    uav: Uav
    status: MissionStatus
    message: str
    took_off: bool
    departed: int
    ended: int
    trace: FloatArray
    path: FloatArray
    times: FloatArray
    waited: float
    plans: Sequence[tuple[int, FloatArray]]
    knowledge: Sequence[Knowledge]
    obstacles: Sequence[tuple[int, tuple[Threat, ...]]]
    planning_seconds: float
    remark: str = ""

    @property
    def name(self) -> str:
        """The UAV's name."""
        return self.uav.name

    @property
    def delayed(self) -> int:
        """Ticks that it waited on the ground after `Uav.departs`, until its start was free."""
        return max(self.departed - self.uav.departs, 0)

    @property
    def cost(self) -> float:
        """The cost of the path, map units: length + k * risk."""
        return self.length + self.uav.k * self.risk

    @property
    def replans(self) -> tuple[int, ...]:
        """The ticks of new plans; the first is that of take-off."""
        return tuple(tick for tick, _ in self.plans)

    def plan_at(self, tick: int) -> FloatArray:
        """Return the waypoints of the plan that it followed at a tick; empty before the first."""
        return _last(self.plans, tick, (tick, np.empty((0, 2))))[1]

    def knowledge_at(self, tick: int) -> Knowledge:
        """Return the threats and areas that it believed in at a tick."""
        return _last(self.knowledge, tick, Knowledge(tick, {}, {}))

    def obstacles_at(self, tick: int) -> tuple[Threat, ...]:
        """Return the virtual obstacles that it planned around at a tick."""
        return _last(self.obstacles, tick, (tick, ()))[1]

    def summary(self) -> dict[str, Any]:
        """Return what its flight came to as JSON."""
        known = self.knowledge_at(self.ended)
        keys = ("name", "message", "remark", "took_off", "departed", "delayed", "ended", "length", "risk", "cost")
        more = ("waited", "risk_sum", "max_risk", "exposure", "replans", "planning_seconds")
        numbers = {key: getattr(self, key) for key in (*keys, *more)}
        believed = {"known_threats": list(known.threats), "known_areas": list(known.areas)}
        found: dict[str, Any] = plain_json({**numbers, "status": self.status.label, **believed})
        return found

    def document(self) -> dict[str, Any]:
        """Return all of its flight as JSON."""
        known = [{"tick": one.tick, "threats": list(one.threats), "areas": list(one.areas)} for one in self.knowledge]
        plans = [{"tick": tick, "waypoints": waypoints} for tick, waypoints in self.plans]
        paths = {"trace": self.trace, "path": self.path, "times": self.times}
        return {**self.summary(), **plain_json({**paths, "knowledge": known, "plans": plans})}

    def position_at(self, tick: int) -> Point | None:
        """Return its position at a tick; None on the ground."""
        if not self.took_off or not self.departed <= tick <= self.ended:
            return None
        x, y = self.trace[tick - self.departed].tolist()
        return x, y


@dataclass(frozen=True, eq=False)
class Flight(Plottable):
    """
    A flown mission.

    Attributes
    ----------
    mission
        The mission.
    uavs
        Each UAV's flight, by its name.
    separations
        The least separation of each pair of UAVs.
    events
        The events, in order of time: a sequence that makes those of messages when it is read.
    ticks
        The number of ticks flown.
    livelock
        The proof that the mission never ends, if there is one.
    fly
        The function that flies a mission, for flights under other rules.
    interrupted
        Whether the mission was stopped before its end.
    """

    mission: Rules
    uavs: Mapping[str, UavFlight]
    separations: Sequence[Separation]
    events: Sequence[Event]
    ticks: int
    fly: Callable[[Rules], "Flight"] = field(repr=False)
    livelock: Livelock | None = None
    interrupted: bool = False

    @property
    def all_arrived(self) -> bool:
        """Whether every UAV reached its goal."""
        return all(flight.status is MissionStatus.ARRIVED for flight in self.uavs.values())

    @property
    def cost(self) -> float:
        """The sum of the costs of all flights, map units; infinite unless all arrived."""
        return math.fsum(flight.cost for flight in self.uavs.values()) if self.all_arrived else math.inf

    @property
    def least_separation(self) -> float:
        """The least separation of any pair, map units; infinite for a single UAV."""
        return min((pair.distance for pair in self.separations), default=math.inf)

    @property
    def closest(self) -> Separation | None:
        """The pair of least separation; None where no two UAVs were in the air together."""
        pair = min(self.separations, key=lambda pair: pair.distance, default=None)
        return pair if pair is not None and pair.distance < math.inf else None

    @property
    def totals(self) -> dict[str, float]:
        """Sums over all UAVs: cost (infinite unless all arrived), length, risk and risk sum."""
        sums = {name: math.fsum(getattr(uav, name) for uav in self.uavs.values()) for name in _SUMMED}
        return {"cost": self.cost, **sums}

    def summary(self) -> dict[str, Any]:
        """Return the results of the flight as JSON; missing numbers are None."""
        numbers = {
            "ticks": self.ticks,
            "arrived": sum(uav.status is MissionStatus.ARRIVED for uav in self.uavs.values()),
            "all_arrived": self.all_arrived,
            "interrupted": self.interrupted,
            "livelock": self.livelock,
            **self.totals,
            "least_separation": None if self.closest is None else self.closest.document(),
        }
        return {**plain_json(numbers), "uavs": [uav.summary() for uav in self.uavs.values()]}

    def document(self) -> dict[str, Any]:
        """
        Return the flight as JSON: its results, its rules, traces, plans, separations and events.

        Examples
        --------
        >>> from cgla_graph.mission.mission import Mission
        >>> from cgla_graph.mission.world import World
        >>> from cgla_graph.solvers import get
        >>> flight = Mission(World(), [Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2)], get("cgla")).fly()
        >>> document = flight.document()
        >>> document["all_arrived"], [uav["name"] for uav in document["uavs"]], document["settings"]["fusion"]
        (True, ['a'], 'union')
        """
        return {
            **self.summary(),
            "settings": self.mission.document(),
            "uavs": [uav.document() for uav in self.uavs.values()],
            "separations": plain_json([pair.document() for pair in self.separations]),
            "events": plain_json([event.document() for event in self.events]),
        }

    def animate(self, *, ax: "Axes | None" = None) -> "FuncAnimation":
        """
        Animate the flight, as `cgla_graph.animate` does.

        Parameters
        ----------
        ax
            Matplotlib axes of the animation; None makes a figure.

        Returns
        -------
        animation
            Notebooks show it. ``animation.save("flight.gif")`` (or ``.mp4``, where ffmpeg is installed) writes what
            `cgla fly` writes.
        """
        animation: FuncAnimation = function_above("animate")(self, ax=ax)
        return animation

    def fly_informed(self) -> "Flight":
        """Fly the mission with UAVs that always know the true world."""
        if self.mission.knowledge == "all":
            return self
        return self.fly(dataclasses.replace(self.mission, knowledge="all"))

    def fly_unshared(self) -> "Flight":
        """Fly the mission without sharing."""
        if not self.mission.sharing.is_on:
            return self
        return self.fly(dataclasses.replace(self.mission, sharing=Sharing(is_on=False)))

    def costs_over(self, other: "Flight") -> dict[str, float]:
        """
        Return the cost of each UAV over its cost in another flight of the same UAVs.

        It is infinite if the UAV arrives only in the other flight, NaN if it does not arrive there.
        """
        ratios = {}
        for name in self.uavs:
            cost, divisor = (
                uav.cost if uav.status is MissionStatus.ARRIVED else math.inf
                for uav in (self.uavs[name], other.uavs[name])
            )
            if divisor == 0.0:
                ratios[name] = 1.0 if cost == 0.0 else math.inf
            else:
                ratios[name] = math.nan if math.isinf(divisor) else cost / divisor
        return ratios

    @cached_property
    def price_of_ignorance(self) -> dict[str, float]:
        """
        The cost of each UAV over its cost with full knowledge: ``costs_over(fly_informed())``.

        The first access flies the mission again. The value may be below 1 with several UAVs, as the others fly other
        paths too. It is infinite if the UAV did not arrive, NaN if it does not arrive with full knowledge either.
        """
        return self.costs_over(self.fly_informed())

    @cached_property
    def lower_bounds(self) -> dict[str, float]:
        """
        What each UAV pays at least between the ends of its flight, if it knows all and is alone: proven, map units.

        Only risk that is there at every tick counts, and areas of the chart. If a UAV did not arrive, the ends are its
        start and goal. With peaks above 1 nothing is proven: NaN.
        """
        ends = {
            name: one.path[[0, -1]].tolist() if one.status is MissionStatus.ARRIVED else (one.uav.start, one.uav.goal)
            for name, one in self.uavs.items()
        }
        flights = {name: (tuple(a), tuple(b), self.uavs[name].uav.k) for name, (a, b) in ends.items()}
        return least_costs_alone(self.mission.world, flights, BOUND_TOLERANCE)

    @cached_property
    def gap(self) -> float:
        """
        How much the team could save at most: its cost over the sum of `lower_bounds`, less 1.

        It is infinite unless all arrived, and NaN where nothing is proven.
        """
        least = math.fsum(self.lower_bounds.values())
        if self.cost == least:
            return 0.0
        return self.cost / least - 1.0 if least != 0.0 else math.inf

    @cached_property
    def value_of_sharing(self) -> dict[str, float]:
        """
        The cost of each UAV without sharing over its cost with it: ``fly_unshared().costs_over(self)``.

        The first access flies the mission again. The value is above 1 if sharing lowers the cost, infinite if the UAV
        arrives only with sharing, NaN if it does not arrive or nothing is shared.
        """
        if not self.mission.sharing.is_on:
            return dict.fromkeys(self.uavs, math.nan)
        return self.fly_unshared().costs_over(self)


def _last(entries: Sequence[Entry], tick: int, before: Entry) -> Entry:
    """Return the last entry up to a tick; `before`, if there is none yet."""
    at = bisect_right(entries, tick, key=lambda entry: entry[0])
    return entries[at - 1] if at else before
