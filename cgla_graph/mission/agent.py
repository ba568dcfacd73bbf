"""One UAV under way: where it is, what it believes, what it is going to fly, and what it has flown."""

import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.belief import Belief
from cgla_graph.mission.metrics import measure
from cgla_graph.mission.records import Knowledge, MissionStatus, UavFlight
from cgla_graph.mission.replanner import Replanner
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.risk import Threat
from cgla_graph.motion.trajectory import Trajectory


@dataclass(eq=False)
class Agent:
    """
    The state of one UAV in a simulation, and its record.

    Attributes
    ----------
    number, uav, planner
        Which UAV it is, and what plans for it.
    position, heading
        Where it is, map units, and the direction of its last displacement: length 1, or (0, 0) before the first.
    belief
        What it knows.
    status, message, ended
        Its end, once there is one.
    in_air
        Whether it has taken off and not come to its end.
    plan, plan_since
        What it is going to fly, on a clock that is 0 at tick `plan_since`: so equal states make equal moves, whenever.
    planned_on
        What the plan was made on; as long as that stays, so does the plan.
    visited
        The lattice points nearest to where it was, if plans must not use them again.
    leg
        What it flew on its last tick, on the clock of its plan; None before the first.
    near
        The numbers of the others within its safe distance.
    trace, path, times, replans, plans, knowledge, obstacles, seconds
        The record, as in `UavFlight`.
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
    trace: list[Point] = field(default_factory=list)
    path: list[FloatArray] = field(default_factory=list)
    times: list[FloatArray] = field(default_factory=list)
    replans: list[int] = field(default_factory=list)
    plans: list[tuple[int, FloatArray]] = field(default_factory=list)
    knowledge: list[Knowledge] = field(default_factory=list)
    obstacles: list[tuple[int, tuple[Threat, ...]]] = field(default_factory=list)
    seconds: float = 0.0

    @property
    def name(self) -> str:
        """The UAV's name."""
        return self.uav.name

    @property
    def is_done(self) -> bool:
        """Whether it has come to its end."""
        return self.status is not None

    def depart(self, tick: int) -> None:
        """Take off."""
        self.in_air = True
        self.trace.append(self.position)
        self.path.append(np.array([self.position]))
        self.times.append(np.array([float(tick)]))

    def end(self, status: MissionStatus, tick: int, message: str = "") -> None:
        """Leave the mission."""
        self.status, self.ended, self.message = status, tick, message
        self.in_air = False

    def follow(self, plan: Trajectory, tick: int) -> None:
        """Take a plan that begins at time 0 of its own clock, now."""
        self.plan, self.plan_since = plan, tick
        self.plans.append((tick, plan.points))

    def motion(self, since: float) -> Trajectory | None:
        """Return what the plan says from a tick on, on the mission's clock; None if nothing."""
        rest = None if self.plan is None else self.plan.part(since - self.plan_since, math.inf)
        return None if rest is None else rest.shifted(self.plan_since)

    def move(self, tick: int) -> None:
        """Fly one tick of the plan."""
        since = tick - self.plan_since
        self.leg = flown = None if self.plan is None else self.plan.part(since, since + 1)
        if flown is None:
            return
        (x, y), (east, north) = self.position, flown.goal
        self.position = flown.goal
        # the first point is where it already was
        self.path.append(flown.points[1:])
        self.times.append(flown.times[1:] + self.plan_since)
        length = math.dist((x, y), self.position)
        if length > 0.0:
            self.heading = (east - x) / length, (north - y) / length

    def has_arrived(self, tick: int, radius: float) -> bool:
        """Return whether the plan is flown to its end, or the goal is within a radius."""
        flown = self.plan is not None and tick - self.plan_since >= self.plan.ends
        at_goal = flown and self.position == self.uav.goal
        return at_goal or math.dist(self.position, self.uav.goal) <= radius

    def state(self, tick: int) -> tuple[Any, ...]:
        """Return all that decides what it does from a tick on, whenever that is; journals apart, which only grow."""
        plan = b"" if self.plan is None else self.plan.points.tobytes() + self.plan.times.tobytes()
        place = self.number, self.position, self.heading
        return *place, plan, tick - self.plan_since, self.planned_on, tuple(self.visited), self.planner.memory

    def flown(self, world: World, tick: int, step: float) -> UavFlight:
        """Return the flight so far; `step` is what it flies in a tick, map units."""
        took_off = bool(self.trace)
        ended = self.ended if self.is_done else tick
        departed = self.uav.departs if took_off else ended
        trace = np.array(self.trace or [self.position])
        path, times = trace[:1], np.array([float(departed)])
        if took_off:
            path, times = np.vstack(self.path), np.concatenate(self.times)
            # of waypoints that rounding puts at one time, the last one stays
            later = np.append(np.diff(times) > 0.0, True)
            path, times = path[later], times[later]
        found = measure(world, path, times, trace if took_off else trace[:0], departed, step=step)
        still = (np.diff(path, axis=0) == 0.0).all(axis=1)
        return UavFlight(
            uav=self.uav,
            status=self.status or MissionStatus.INTERRUPTED,
            message=self.message,
            took_off=took_off,
            departed=departed,
            ended=ended,
            trace=trace,
            path=path,
            times=times,
            length=found.length,
            risk=found.risk,
            cost=found.length + self.uav.k * found.risk,
            waited=float(np.diff(times)[still].sum()),
            risk_sum=found.risk_sum,
            max_risk=found.max_risk,
            exposure=found.exposure,
            replans=tuple(self.replans),
            plans=tuple(self.plans),
            knowledge=tuple(self.knowledge),
            obstacles=tuple(self.obstacles),
            planning_seconds=self.seconds,
        )
