"""What happens to one UAV of a mission, noted down while it flies and made into its record at the end."""

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.agent import Agent
from cgla_graph.mission.metrics import measure
from cgla_graph.mission.records import Knowledge, MissionStatus, UavFlight
from cgla_graph.mission.world import World
from cgla_graph.model.risk import Threat


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

    def departed(self, position: Point, tick: int) -> None:
        """Note where and when it takes off."""
        self.trace.append(position)
        self.path.append(np.array([position]))
        self.times.append(np.array([float(tick)]))

    def flew(self, agent: Agent) -> None:
        """Note what it flew on its last tick."""
        if agent.leg is not None:
            # the first point is where it already was
            self.path.append(agent.leg.points[1:])
            self.times.append(agent.leg.times[1:] + agent.plan_since)

    def believes(self, tick: int, threats: Mapping[int, Threat], areas: Mapping[int, BaseGeometry]) -> None:
        """Note what it believes in now, if that is new."""
        last = self.knowledge[-1] if self.knowledge else None
        if last is None or last.threats != threats or last.areas != areas:
            self.knowledge.append(Knowledge(tick, threats, areas))

    def avoids(self, tick: int, obstacles: tuple[Threat, ...]) -> None:
        """Note the virtual obstacles that it plans around now, if they are new."""
        if (self.obstacles[-1][1] if self.obstacles else ()) != obstacles:
            self.obstacles.append((tick, obstacles))

    def flight(self, agent: Agent, world: World, tick: int, step: float) -> UavFlight:
        """Return the flight until a tick; `step` is what the UAV flies in a tick, map units."""
        took_off = bool(self.trace)
        ended = agent.ended if agent.is_done else tick
        departed = agent.uav.departs if took_off else ended
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
