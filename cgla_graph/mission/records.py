"""What a mission came to: each UAV's flight, how near they came to each other, and who learned what from whom."""

import dataclasses
import math
from bisect import bisect_right
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from functools import cached_property
from typing import Any, Literal, TypeAlias

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.model.risk import Threat

EventKind: TypeAlias = Literal[
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
        """The short form for tables and files."""
        return self.name.lower().replace("_", "-")


@dataclass(frozen=True)
class Event:
    """
    Something that happened on a mission.

    Attributes
    ----------
    tick
        When.
    kind
        ``departed``: a UAV took off; ``started-in-risk``: it did so within a spread of a threat; ``detected``: it saw
        a threat or area that it did not know; ``refuted``: it saw that one it believed in is not there; ``learned``:
        another UAV (`source`) told it; ``planned``: it has a new plan; ``kept``: it found no better one and keeps its
        old; ``near``: another UAV is within the safe distance, terminal discs or not; ``appeared-on``: a threat or
        area came up around it; ``collision``, ``arrived``, ``no-path``, ``stuck``, ``livelock``, ``out-of-ticks``,
        ``interrupted``: its end.
    uav
        To whom.
    detail
        What else there is to say: names, numbers and points.

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


@dataclass(frozen=True, eq=False)
class Knowledge:
    """
    What a UAV believes in from a tick on.

    Attributes
    ----------
    tick
        Since when.
    threats
        The threats, by their number in the world, where the UAV believes them to be.
    areas
        The timed no-fly areas, by their number in the world.
    """

    tick: int
    threats: Mapping[int, Threat]
    areas: Mapping[int, BaseGeometry]


@dataclass(frozen=True)
class Separation:
    """
    How near two UAVs came to each other while both were in the air, outside their terminal discs.

    Attributes
    ----------
    first, second
        Their names.
    distance
        The least distance, map units, over all times and not only at ticks; infinite if there was no such time.
    time
        When, in ticks.
    where
        The point half way between the two then, map units.
    """

    first: str
    second: str
    distance: float
    time: float
    where: Point


@dataclass(frozen=True)
class Livelock:
    """
    A proof that a mission never ends: its whole state at one tick came back.

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
class UavFlight:
    """
    The flight of one UAV.

    Attributes
    ----------
    uav
        The UAV.
    status, message
        How the flight ended, and why in one line.
    took_off
        Whether it was ever in the air.
    departed, ended
        The ticks of take-off and end; of one that never took off, both are the tick of the end.
    trace
        Positions at the ticks from `departed` to `ended`, shape ``(t, 2)``, map units.
    path
        The flown polyline with its bends between ticks, shape ``(m, 2)``, map units.
    times
        When it was at each waypoint of the path, shape ``(m,)``, ticks.
    length, risk, cost
        Of the path, in the true field of the moment: ``cost = length + k * risk``. Who waits circles: it flies a step a
        tick through the risk where it is, and that counts.
    waited
        Ticks of waiting, which only ``avoidance="prioritized"`` plans.
    risk_sum
        The paper's measure: the sum of the true ``F`` over the positions of the trace.
    max_risk
        The greatest true ``F`` met (sampled 16 times a spread or a flown segment, whichever is less).
    exposure
        The length flown where the true ``F`` is above 0.1, map units (sampled likewise).
    replans
        The ticks at which it got a new plan; the first is the plan of take-off.
    plans
        ``(tick, waypoints)``: what it was going to fly from that tick on.
    knowledge
        What it believed in, each from a tick on.
    obstacles
        ``(tick, threats)``: the virtual obstacles that it planned around, each from a tick on.
    planning_seconds
        Time spent on its plans.
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
    length: float
    risk: float
    cost: float
    waited: float
    risk_sum: float
    max_risk: float
    exposure: float
    replans: tuple[int, ...]
    plans: Sequence[tuple[int, FloatArray]]
    knowledge: Sequence[Knowledge]
    obstacles: Sequence[tuple[int, tuple[Threat, ...]]]
    planning_seconds: float

    @property
    def name(self) -> str:
        """The UAV's name."""
        return self.uav.name

    def plan_at(self, tick: int) -> FloatArray:
        """Return the waypoints of the plan that it followed at a tick; empty before the first."""
        at = bisect_right(self.plans, tick, key=lambda entry: entry[0])
        return self.plans[at - 1][1] if at else np.empty((0, 2))

    def knowledge_at(self, tick: int) -> Knowledge:
        """Return what it believed in at a tick."""
        at = bisect_right(self.knowledge, tick, key=lambda entry: entry.tick)
        return self.knowledge[at - 1] if at else Knowledge(tick, {}, {})

    def obstacles_at(self, tick: int) -> tuple[Threat, ...]:
        """Return the virtual obstacles that it planned around at a tick."""
        at = bisect_right(self.obstacles, tick, key=lambda entry: entry[0])
        return self.obstacles[at - 1][1] if at else ()

    def position_at(self, tick: int) -> Point | None:
        """Return where it was at a tick; None on the ground."""
        if not self.took_off or not self.departed <= tick <= self.ended:
            return None
        x, y = self.trace[tick - self.departed].tolist()
        return x, y


@dataclass(frozen=True, eq=False)
class Flight:
    """
    What a mission came to.

    Attributes
    ----------
    mission
        The mission that was flown.
    uavs
        Each UAV's flight, by its name.
    separations
        The least separation of each pair of UAVs.
    events
        What happened, in order of time.
    ticks
        How many ticks were flown.
    livelock
        The proof that the mission never ends, if there is one.
    fly
        Flies a mission, for what would have been under other rules (`informed`, `unshared`).
    interrupted
        Whether it was stopped before its end.
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
        """The cost of all flights together, map units; infinite unless all arrived."""
        return math.fsum(flight.cost for flight in self.uavs.values()) if self.all_arrived else math.inf

    @property
    def least_separation(self) -> float:
        """The least separation of any pair, map units; infinite for a single UAV."""
        return min((pair.distance for pair in self.separations), default=math.inf)

    @cached_property
    def informed(self) -> "Flight":
        """The same mission flown by UAVs that know the world as it is from the start, and at every change."""
        if self.mission.knowledge == "all":
            return self
        return self.fly(dataclasses.replace(self.mission, knowledge="all"))

    @cached_property
    def unshared(self) -> "Flight":
        """The same mission without sharing."""
        if not self.mission.sharing.is_on:
            return self
        return self.fly(dataclasses.replace(self.mission, sharing=Sharing(is_on=False)))

    @cached_property
    def price_of_ignorance(self) -> dict[str, float]:
        """
        What not knowing cost each UAV: its cost over the cost of the same flight with full knowledge (`informed`).

        Below 1 where ignorance happened to pay, which it may do in company: the others fly other ways, too. Infinite
        where the UAV did not arrive, NaN where it does not arrive with full knowledge either.
        """
        return _ratios(self, self.informed)

    @cached_property
    def value_of_sharing(self) -> dict[str, float]:
        """
        What sharing was worth to each UAV: its cost in the same mission without sharing over its cost (`unshared`).

        Above 1 where sharing paid, infinite where the UAV arrives only with sharing, NaN where it does not arrive or
        nothing is shared.
        """
        if not self.mission.sharing.is_on:
            return dict.fromkeys(self.uavs, math.nan)
        return _ratios(self.unshared, self)


def _ratios(above: Flight, below: Flight) -> dict[str, float]:
    """Divide costs UAV by UAV; who does not arrive has infinite cost."""
    ratios = {}
    for name in above.uavs:
        costs = [
            one.cost if one.status is MissionStatus.ARRIVED else math.inf
            for one in (above.uavs[name], below.uavs[name])
        ]
        if math.isinf(costs[1]):
            ratios[name] = math.nan
        elif costs[1] == 0.0:
            ratios[name] = 1.0 if costs[0] == 0.0 else math.inf
        else:
            ratios[name] = costs[0] / costs[1]
    return ratios
