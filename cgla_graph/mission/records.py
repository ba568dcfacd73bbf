"""What a mission came to: each UAV's flight, how near they came to each other, and who learned what from whom."""

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
from cgla_graph._text import ShortRepr
from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.model.risk import Threat
from cgla_graph.motion.trajectory import Approach

if TYPE_CHECKING:
    from matplotlib.animation import FuncAnimation
    from matplotlib.axes import Axes

#: A flight is exposed where the risk is above this.
EXPOSED_ABOVE = 0.1

Entry = TypeVar("Entry", bound=tuple[Any, ...])
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


class Knowledge(NamedTuple):
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


@dataclass(frozen=True, kw_only=True)
class Separation(Approach):
    """
    How near two UAVs came to each other while both were in the air, outside their terminal discs.

    Attributes
    ----------
    first, second
        Their names. (The distance is infinite if there was no such time.)
    """

    first: str
    second: str


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
class Measures:
    """
    What a flown polyline met in the true world of each moment.

    Attributes
    ----------
    length, risk
        Map units. Who waits circles: it flies a step a tick through the risk where it is, and that counts.
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
    The flight of one UAV, and what it met on its way (see `Measures`).

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
    waited
        Ticks of waiting, which only ``avoidance="prioritized"`` plans.
    plans
        ``(tick, waypoints)``: what it was going to fly from that tick on; the first is the plan of take-off.
    knowledge
        What it believed in, each from a tick on.
    obstacles
        ``(tick, threats)``: the virtual obstacles that it planned around, each from a tick on.
    planning_seconds
        Time spent on its plans.
    remark
        What its planner says of the flight; empty if nothing.
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
    def cost(self) -> float:
        """The cost of the path, map units: length + k * risk."""
        return self.length + self.uav.k * self.risk

    @property
    def replans(self) -> tuple[int, ...]:
        """The ticks at which it got a new plan; the first is the plan of take-off."""
        return tuple(tick for tick, _ in self.plans)

    def plan_at(self, tick: int) -> FloatArray:
        """Return the waypoints of the plan that it followed at a tick; empty before the first."""
        return _last(self.plans, tick, (tick, np.empty((0, 2))))[1]

    def knowledge_at(self, tick: int) -> Knowledge:
        """Return what it believed in at a tick."""
        return _last(self.knowledge, tick, Knowledge(tick, {}, {}))

    def obstacles_at(self, tick: int) -> tuple[Threat, ...]:
        """Return the virtual obstacles that it planned around at a tick."""
        return _last(self.obstacles, tick, (tick, ()))[1]

    def position_at(self, tick: int) -> Point | None:
        """Return where it was at a tick; None on the ground."""
        if not self.took_off or not self.departed <= tick <= self.ended:
            return None
        x, y = self.trace[tick - self.departed].tolist()
        return x, y


@dataclass(frozen=True, eq=False)
class Flight(Plottable):
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
        Flies a mission, for what would have been under other rules.
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

    @property
    def closest(self) -> Separation | None:
        """The pair of least separation; None where no two UAVs were in the air together."""
        pair = min(self.separations, key=lambda pair: pair.distance, default=None)
        return pair if pair is not None and pair.distance < math.inf else None

    def animate(self, *, ax: "Axes | None" = None) -> "FuncAnimation":
        """
        Draw it as a film, as `cgla_graph.animate` does.

        Parameters
        ----------
        ax
            Matplotlib axes that show the film; None makes a figure of its size.

        Returns
        -------
        animation
            Notebooks show it. ``animation.save("flight.gif")`` (or ``.mp4``, where ffmpeg is installed) writes what
            `cgla fly` writes.
        """
        animation: FuncAnimation = function_above("animate")(self, ax=ax)
        return animation

    def fly_informed(self) -> "Flight":
        """Fly the mission with UAVs that know the world as it is from the start, and at every change."""
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

        Infinite where it arrives only in the other, NaN where it does not arrive there either.
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
        What not knowing cost each UAV: ``costs_over(fly_informed())``. The first time, this flies the mission again.

        Below 1 where ignorance happened to pay, which it may do in company: the others fly other ways, too. Infinite
        where the UAV did not arrive, NaN where it does not arrive with full knowledge either.
        """
        return self.costs_over(self.fly_informed())

    @cached_property
    def value_of_sharing(self) -> dict[str, float]:
        """
        What sharing was worth to each UAV: ``fly_unshared().costs_over(self)``. The first time, this flies it again.

        Above 1 where sharing paid, infinite where the UAV arrives only with sharing, NaN where it does not arrive or
        nothing is shared.
        """
        if not self.mission.sharing.is_on:
            return dict.fromkeys(self.uavs, math.nan)
        return self.fly_unshared().costs_over(self)


def _last(entries: Sequence[Entry], tick: int, before: Entry) -> Entry:
    """Return the last entry up to a tick; `before`, if there is none yet."""
    at = bisect_right(entries, tick, key=lambda entry: entry[0])
    return entries[at - 1] if at else before
