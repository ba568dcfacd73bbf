"""State of UAVs in flight, and records of their flights."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.belief import Belief, View
from cgla_graph.mission.records import EXPOSED_ABOVE, Event, Knowledge, Measures, MissionStatus, UavFlight
from cgla_graph.mission.replanner import Replanner
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.motion.trajectory import Trajectory

#: Sample points, for exposure and greatest risk, of a piece no longer than the least spread of a threat.
FRACTIONS = np.linspace(0.0, 1.0, 17)[:, None]
#: Upper limit of the pieces of a segment.
MOST_PIECES = 1000


@dataclass(eq=False)
class Agent:
    """
    The state of one UAV in a simulation.

    Attributes
    ----------
    number, uav, planner
        Its number, the UAV and its planner.
    position, heading
        Its position, map units, and the direction of its last displacement: length 1, or (0, 0) before the first.
    belief
        Its knowledge of threats and areas.
    status, message, ended
        How, why and when its flight ended; `status` is None before.
    in_air
        Whether it has taken off and its flight has not ended.
    plan, plan_since
        The planned motion, on a clock that is 0 at tick `plan_since`, so that equal states make equal moves at any
        tick.
    planned_on
        The knowledge that the plan was made on; the plan stays until it changes.
    visited
        The lattice points nearest to its past positions, if plans must not use them again.
    leg
        Its motion on the last tick, on the clock of its plan; None before the first.
    near
        The numbers of the other UAVs within its safe distance.
    delay
        The last event that says why it waits for its take-off.
    """

    number: int
    uav: Uav
    planner: Replanner
    position: Point
    belief: Belief = field(default_factory=Belief)
    heading: Point = (0.0, 0.0)
    status: MissionStatus | None = None
    message: str = ""
    ended: int = 0
    in_air: bool = False
    plan: Trajectory | None = None
    plan_since: int = 0
    planned_on: tuple[Any, ...] | None = None
    visited: list[int] = field(default_factory=list)
    leg: Trajectory | None = None
    near: set[int] = field(default_factory=set)
    delay: Event | None = None
    _committed: Trajectory | None = field(default=None, repr=False)

    @property
    def name(self) -> str:
        """The UAV's name."""
        return self.uav.name

    @property
    def is_done(self) -> bool:
        """Whether its flight has ended."""
        return self.status is not None

    def end(self, status: MissionStatus, tick: int, message: str = "") -> None:
        """End the flight."""
        self.status, self.ended, self.message = status, tick, message
        self.in_air = False

    def follow(self, plan: Trajectory, tick: int) -> None:
        """Follow a plan from now on; its clock is 0 now."""
        self.plan, self.plan_since, self._committed = plan, tick, plan.shifted(tick)

    def motion(self, since: float) -> Trajectory | None:
        """Return the committed motion, on the mission's clock; None if it ends before tick `since`."""
        return self._committed if self._committed is not None and self._committed.ends >= since else None

    def move(self, tick: int) -> None:
        """Fly one tick of the plan."""
        since = tick - self.plan_since
        self.leg = flown = None if self.plan is None else self.plan.part(since, since + 1)
        if flown is None:
            return
        (x, y), (east, north) = self.position, flown.goal
        self.position = flown.goal
        length = math.dist((x, y), self.position)
        if length > 0.0:
            self.heading = (east - x) / length, (north - y) / length

    def motion_along(self, path: FloatArray) -> Trajectory:
        """Return the motion along a path, on a clock that is 0 at its beginning."""
        mission = self.planner.mission
        if mission.movement == "vertex":
            return Trajectory(np.arange(len(path), dtype=np.float64), path)
        return Trajectory.along(path, 0.0, mission.step_of(self.uav))

    def can_go_on(self, tick: int, no_fly: BaseGeometry | None, *, ticks: float = math.inf) -> bool:
        """Return whether the next `ticks` of its plan (default: all of them) exist and cross no known area."""
        since = tick - self.plan_since
        rest = None if self.plan is None else self.plan.part(since, since + ticks)
        return rest is not None and not indexed_area(no_fly).crosses(rest.points[:-1], rest.points[1:]).any()

    def excluded(self) -> frozenset[int]:
        """Return the lattice points that the next plan may not use (E17)."""
        mission = self.planner.mission
        if mission.exclude == "none":
            return frozenset()
        here = mission.lattice.nearest(self.position)
        if not self.visited or self.visited[-1] != here:
            self.visited.append(here)
        before = [node for node in self.visited if node != here]
        return frozenset(before[-1:] if mission.exclude == "last" else before)

    def has_arrived(self, tick: int, radius: float) -> bool:
        """Return whether it flew the plan to its end, or the goal is within a radius."""
        flown = self.plan is not None and tick - self.plan_since >= self.plan.ends
        at_goal = flown and self.position == self.uav.goal
        return at_goal or math.dist(self.position, self.uav.goal) <= radius

    def state(self, tick: int) -> tuple[Any, ...]:
        """Return the state that decides all further moves, relative to a tick; without journals, which only grow."""
        plan = b"" if self.plan is None else self.plan.points.tobytes() + self.plan.times.tobytes()
        place = self.number, self.position, self.heading
        return *place, plan, tick - self.plan_since, self.planned_on, tuple(self.visited), self.planner.memory


@dataclass(eq=False)
class Recorder:
    """
    The record of one UAV so far.

    Attributes
    ----------
    trace, path, times, plans, knowledge, obstacles, planning_seconds
        As in `UavFlight`; path and times in pieces, one a tick.
    """

    trace: list[Point] = field(default_factory=list)
    path: list[FloatArray] = field(default_factory=list)
    times: list[FloatArray] = field(default_factory=list)
    plans: list[tuple[int, FloatArray]] = field(default_factory=list)
    knowledge: list[Knowledge] = field(default_factory=list)
    obstacles: list[tuple[int, tuple[Threat, ...]]] = field(default_factory=list)
    planning_seconds: float = 0.0
    _view: View | None = None

    def departed(self, position: Point, tick: int) -> None:
        """Record the position and the tick of take-off."""
        self.trace.append(position)
        self.path.append(np.array([position]))
        self.times.append(np.array([float(tick)]))

    def stayed(self) -> None:
        """Take the take-off on this tick back."""
        self.trace, self.path, self.times = [], [], []

    def flew(self, agent: Agent) -> None:
        """Record the motion on the last tick."""
        if agent.leg is not None:
            # the first point is recorded already
            self.path.append(agent.leg.points[1:])
            self.times.append(agent.leg.times[1:] + agent.plan_since)

    def believes(self, tick: int, view: View, polygons: Mapping[int, BaseGeometry]) -> None:
        """Record the threats and areas it believes in, if they have changed."""
        if self._view is None or (view is not self._view and view.items != self._view.items):
            self.knowledge.append(Knowledge(tick, view.threats, {one: polygons[one] for one in sorted(view.areas)}))
        self._view = view

    def avoids(self, tick: int, obstacles: tuple[Threat, ...]) -> None:
        """Record the virtual obstacles that it plans around, if they have changed."""
        if (self.obstacles[-1][1] if self.obstacles else ()) != obstacles:
            self.obstacles.append((tick, obstacles))

    def flight(self, agent: Agent, world: World, tick: int, step: float) -> UavFlight:
        """Return the flight until a tick; `step` is the length flown in a tick, map units."""
        took_off = bool(self.trace)
        ended = agent.ended if agent.is_done else tick
        departed = int(self.times[0][0]) if took_off else ended
        trace = np.array(self.trace or [agent.position])
        path, times = trace[:1], np.array([float(departed)])
        if took_off:
            path, times = np.vstack(self.path), np.concatenate(self.times)
            # of waypoints that rounding puts at one time, the last one stays
            later = np.append(np.diff(times) > 0.0, True)
            path, times = path[later], times[later]
        met = measure(world, path, times, trace if took_off else trace[:0], departed, step=step)
        still = (np.diff(path, axis=0) == 0.0).all(axis=1)
        return UavFlight(
            **vars(met),
            uav=agent.uav,
            status=agent.status or MissionStatus.INTERRUPTED,
            message=agent.message,
            took_off=took_off,
            departed=departed,
            ended=ended,
            trace=trace,
            path=path,
            times=times,
            waited=float(np.diff(times)[still].sum()),
            plans=tuple(self.plans),
            knowledge=tuple(self.knowledge),
            obstacles=tuple(self.obstacles),
            planning_seconds=self.planning_seconds,
            remark=agent.planner.remark,
        )


def measure(
    world: World, path: FloatArray, times: FloatArray, trace: FloatArray, departed: int, *, step: float
) -> Measures:
    """
    Measure a flight, each piece in the field of its tick.

    Parameters
    ----------
    world
        The truth.
    path, times
        Waypoints, shape ``(m, 2)``, map units, and their times, shape ``(m,)``, ticks. Every whole tick of the flight
        is among them. Between two equal points the UAV waits.
    trace, departed
        Positions at whole ticks, shape ``(t, 2)``, the first at tick `departed`.
    step
        Length flown in a tick of waiting, map units: a waiting UAV circles.

    Returns
    -------
    measures
        Length, risk and the rest.

    Examples
    --------
    >>> path = np.array([[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]])
    >>> measure(World(), path, np.array([0.0, 1.0, 2.0]), path, 0, step=0.5).length
    1.0
    """
    starts, ends = path[:-1], path[1:]
    straight = np.hypot(*(ends - starts).T)
    # circles are small: their risk is that of their centre
    circled = np.where(straight == 0.0, step * np.diff(times), 0.0)
    # at a bend, rounding may leave a time just below the whole tick that it stands for
    phases = np.searchsorted(world.changes, np.floor(times[:-1] + 1e-9), side="right")
    risk, exposure, worst = [0.0], [0.0], [0.0]
    for phase in np.unique(phases).tolist():
        field_then = world.field_at(0 if phase == 0 else world.changes[phase - 1])
        if field_then.is_empty:
            continue
        here = phases == phase
        first, last = starts[here], ends[here]
        at_start = field_then.density(first)
        risk += [float(field_then.line_integral(first, last).sum()), float((circled[here] * at_start).sum())]
        begins, finishes, lengths = _fine_pieces(first, last, field_then)
        samples = field_then.density(begins[:, None] * (1.0 - FRACTIONS) + finishes[:, None] * FRACTIONS)
        worst.append(float(samples.max()))
        exposure += [
            float((_share_above(samples, EXPOSED_ABOVE) * lengths).sum()),
            float(circled[here][at_start > EXPOSED_ABOVE].sum()),
        ]
    at_ticks = [float(world.field_at(departed + i).density(spot)) for i, spot in enumerate(trace)]
    return Measures(
        length=float(straight.sum() + circled.sum()),
        risk=math.fsum(risk),
        risk_sum=math.fsum(at_ticks),
        max_risk=max([*worst, *at_ticks], default=0.0),
        exposure=math.fsum(exposure),
    )


def _fine_pieces(
    starts: FloatArray, ends: FloatArray, field_then: RiskField
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Cut segments at the points next to threats, and finely enough for all; return starts, ends and lengths."""
    lengths = np.hypot(*(ends - starts).T)
    finest = field_then.finest
    pieces_begin, pieces_end = [], []
    for start, end, length in zip(starts, ends, lengths.tolist(), strict=True):
        cuts = np.linspace(0.0, 1.0, 2 + int(min(length / finest, MOST_PIECES)))
        if len(cuts) > 2:  # noqa: PLR2004 - a short segment needs no foot points
            centres = field_then.centres
            feet = (centres - start) @ (end - start) / length**2
            cuts = np.unique(np.concatenate([cuts, feet[(feet > 0.0) & (feet < 1.0)]]))
        at = start * (1.0 - cuts[:, None]) + end * cuts[:, None]
        pieces_begin.append(at[:-1])
        pieces_end.append(at[1:])
    begins, finishes = np.vstack(pieces_begin), np.vstack(pieces_end)
    return begins, finishes, np.hypot(*(finishes - begins).T)


def _share_above(samples: FloatArray, level: float) -> FloatArray:
    """Return the share of each row of samples, linear in between, that is above a level, shape ``(n,)``."""
    low, high = np.minimum(samples[:, :-1], samples[:, 1:]), np.maximum(samples[:, :-1], samples[:, 1:])
    rise = high - low
    parts = np.where(rise > 0.0, (high - level) / np.where(rise > 0.0, rise, 1.0), high > level)
    return np.asarray(np.clip(parts, 0.0, 1.0).mean(axis=1))
