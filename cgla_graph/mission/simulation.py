"""
The tick loop of a mission: sense, share, plan, move.

On each tick, the UAVs first sense from their positions, then share, then those whose knowledge has changed plan, then
all move. The flight depends on the mission alone, not on the clock.
"""

import math
import time
from collections.abc import Callable
from typing import Any

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._progress import showing
from cgla_graph._text import listed
from cgla_graph._types import Point
from cgla_graph.mission.agent import Agent, Recorder
from cgla_graph.mission.avoidance import plan_around, stays_clear
from cgla_graph.mission.belief import ROUNDED, Belief, sightings
from cgla_graph.mission.encounters import Encounters
from cgla_graph.mission.event_log import EventLog, Learned
from cgla_graph.mission.records import Event, EventKind, Flight, Livelock, MissionStatus
from cgla_graph.mission.replanner import Replanner, Situation
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.sharing import Radio
from cgla_graph.model.clearance import closed_area, widened_clear_of
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.motion.trajectory_kernels import Disc
from cgla_graph.timed.timed_area import union_of

#: How far a position that rounding put inside a no-fly area is moved out, units.
NUDGE = 1e-9


class Simulation:
    """
    A mission in flight.

    Parameters
    ----------
    mission
        The mission to fly.

    Attributes
    ----------
    tick
        The number of ticks flown.
    events
        The events so far.
    livelock
        The proof that the mission never ends, if there is one.

    Examples
    --------
    >>> from cgla_graph.mission.uav import Uav
    >>> from cgla_graph.mission.world import World
    >>> from cgla_graph.solvers import get
    >>> uav = Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2)
    >>> from cgla_graph.mission.mission import Mission
    >>> simulation = Mission(World(), [uav], get("cgla")).simulate()
    >>> simulation.advance()
    >>> simulation.tick, simulation.is_over, [event.kind for event in simulation.events]
    (1, False, ['departed', 'planned'])
    """

    def __init__(self, mission: Rules) -> None:
        self.mission = mission
        self.tick = 0
        self.events = EventLog()
        self.livelock: Livelock | None = None
        self._radio = Radio(mission.sharing)
        self._agents = [
            Agent(number, uav, Replanner(mission, uav), uav.start, Belief(self._radio.log))
            for number, uav in enumerate(mission.uavs)
        ]
        self._names = [uav.name for uav in mission.uavs]
        self._safest = max(uav.safe_distance for uav in mission.uavs)
        # positions, as those in the air have them; NaN before take-off
        self._spots = np.full((len(mission.uavs), 2), math.nan)
        self._recorders = [Recorder() for _ in mission.uavs]
        self._encounters = Encounters(
            [uav.name for uav in mission.uavs],
            [Disc(uav.goal, mission.terminal_radius) for uav in mission.uavs],
            mission.collision_distance,
        )
        # states so far with their ticks, indexed by position first: comparing full states is slow
        self._states: dict[tuple[Point, ...], list[tuple[tuple[Any, ...], int]]] = {}
        self._areas: dict[frozenset[int], BaseGeometry | None] = {}
        self._closed: dict[tuple[frozenset[int], float], BaseGeometry | None] = {}

    @property
    def is_over(self) -> bool:
        """Whether the flights of all UAVs have ended."""
        return all(agent.is_done for agent in self._agents)

    @property
    def n_done(self) -> int:
        """The number of UAVs whose flights have ended."""
        return sum(agent.is_done for agent in self._agents)

    def advance(self) -> None:
        """Fly one tick; nothing happens when the mission is over."""
        if self.is_over:
            return
        self._depart()
        if self.is_over:
            # every UAV started at its goal
            return
        self._notice_what_came_up()
        for agent in self._flying():
            self._sense(agent)
        self._share()
        self._find_livelock()
        if self.mission.update == "sequential":
            for agent in self._flying():
                self._plan(agent)
                if agent.in_air:
                    self._move(agent)
        else:
            for agent in self._flying():
                self._plan(agent)
            for agent in self._flying():
                self._move(agent)
        if self.is_over:
            # no UAV is left in the air on this tick
            return
        collided = self._meet()
        self.tick += 1
        self._end_tick(collided)

    def flight(self, *, interrupted: bool = False) -> Flight:
        """Return the flight so far; if it is `interrupted`, UAVs in the air get that status."""
        events = self.events.copy()
        for agent in self._agents:
            if interrupted and not agent.is_done:
                events.append(Event(self.tick, "interrupted", agent.name))
        return Flight(
            mission=self.mission,
            uavs={
                agent.name: recorder.flight(agent, self.mission.world, self.tick, self.mission.step_of(agent.uav))
                for agent, recorder in zip(self._agents, self._recorders, strict=True)
            },
            separations=self._encounters.separations,
            events=events,
            ticks=self.tick,
            fly=fly,
            livelock=self.livelock,
            interrupted=interrupted,
        )

    def _flying(self) -> list[Agent]:
        return [agent for agent in self._agents if agent.in_air]

    def _near(self, agent: Agent, distance: float) -> list[Agent]:
        """Return the other UAVs in the air within a distance, in their order, and those that are hardly farther."""
        apart2 = ((self._spots - agent.position) ** 2).sum(axis=1)
        near = [self._agents[number] for number in np.flatnonzero(apart2 <= (distance * ROUNDED) ** 2).tolist()]
        return [other for other in near if other.in_air and other is not agent]

    def _say(self, kind: EventKind, agent: Agent, **detail: Any) -> None:  # noqa: ANN401 - any JSON
        self.events.append(Event(self.tick, kind, agent.name, detail))

    def _depart(self) -> None:
        world = self.mission.world
        for agent in self._agents:
            if agent.is_done or agent.in_air or agent.uav.departs > self.tick:
                continue
            if hindrance := self._hindrance(agent):
                self._hold_back(agent, **hindrance)
                continue
            agent.in_air = True
            self._spots[agent.number] = agent.position
            self._recorders[agent.number].departed(agent.position, self.tick)
            self._say("departed", agent, at=list(agent.position))
            for number, threat in world.threats_at(self.tick).items():
                if math.dist(agent.position, (threat.x, threat.y)) <= threat.spread:
                    risk = float(world.field_at(self.tick).density(agent.position))
                    self._say("started-in-risk", agent, threat=number, risk=risk)
            self._arrive(agent)

    def _hindrance(self, agent: Agent) -> dict[str, Any]:
        """Return what keeps a UAV from taking off: an area over its start, or the nearest UAV that is too near."""
        for number, area in self.mission.world.areas_at(self.tick).items():
            if indexed_area(closed_area(area, self.mission.world.bounds)).contains(agent.position):
                return {"area": number}
        near = [
            (distance, other.name)
            for other in self._near(agent, max(agent.uav.safe_distance, self._safest))
            if (distance := math.dist(agent.position, other.position))
            < max(agent.uav.safe_distance, other.uav.safe_distance)
        ]
        return {"other": min(near)[1], "distance": min(near)[0]} if near else {}

    def _hold_back(self, agent: Agent, **why: Any) -> None:  # noqa: ANN401 - any JSON
        """Let a UAV wait on the ground, and log it when the hindrance is another one than on the tick before."""
        before, agent.delay = agent.delay, Event(self.tick, "delayed", agent.name, why)
        if before is None or {**before.detail, "distance": 0.0} != {**why, "distance": 0.0}:
            self.events.append(agent.delay)

    def _stay_on_ground(self, agent: Agent, reason: str) -> None:
        """Take a take-off on this tick back, as no plan from it keeps the safe distances."""
        agent.in_air, agent.near = False, set()
        self._recorders[agent.number].stayed()
        self.events = self.events.without(self.tick, agent.name, ("departed", "started-in-risk"))
        self._hold_back(agent, reason=reason)

    def _notice_what_came_up(self) -> None:
        """Log threats and areas that appear around a UAV."""
        world = self.mission.world
        if self.tick not in world.changes:
            return
        threats, areas = world.threats_at(self.tick - 1), world.areas_at(self.tick - 1)
        for agent in self._flying():
            for number, threat in world.threats_at(self.tick).items():
                apart = math.dist(agent.position, (threat.x, threat.y))
                if threats.get(number) != threat and apart <= threat.spread:
                    self._say("appeared-on", agent, threat=number, distance=apart)
            for number, area in world.areas_at(self.tick).items():
                closed = closed_area(area, world.bounds)
                if number not in areas and indexed_area(closed).contains(agent.position):
                    self._say("appeared-on", agent, area=number)

    def _sense(self, agent: Agent) -> None:
        radius = math.inf if self.mission.knowledge == "all" else agent.uav.detection_radius
        seen_from = np.array([agent.position])
        if self.mission.movement == "vertex" and agent.leg is not None:
            seen_from = agent.leg.points
        seen = sightings(self.mission.world, self.tick, agent.belief, seen_from, radius, agent.number)
        for new in agent.belief.hear(seen):
            kind, number = new.thing
            place = {"at": [new.content.x, new.content.y]} if new.content else {}
            self._say("detected" if new.is_there else "refuted", agent, **{kind: number}, **place)

    def _share(self) -> None:
        taking_part = {agent.number: agent for agent in self._agents if not agent.is_done}
        learned = self._radio.exchange(
            self.tick,
            {number: agent.belief for number, agent in taking_part.items()},
            [agent.position for agent in taking_part.values()],
        )
        for receiver, sender, reports in learned:
            names = self._names[receiver], self._names[sender]
            self.events.append(Learned(self.tick, *names, reports, self._names))
        for agent in taking_part.values():
            self._recorders[agent.number].believes(self.tick, agent.belief.view, self.mission.world.polygons)

    def _plan(self, agent: Agent) -> None:
        """Plan if the rules of replanning ask for it."""
        obstacles = self._obstacles(agent)
        self._recorders[agent.number].avoids(self.tick, obstacles)
        excluded = agent.excluded()
        planned_on = agent.belief.view.items, obstacles, excluded
        if agent.plan is not None and self.mission.replan == "never":
            if not agent.can_go_on(self.tick, self._closed_areas(agent.belief.areas), ticks=1):
                self._give_up(agent, "a no-fly area is in the way of the plan that it keeps to")
            return
        on_change = self.mission.replan == "change" and agent.planner.stepper is None
        if agent.plan is not None and on_change and planned_on == agent.planned_on:
            return
        situation = self._situation(agent, obstacles, excluded)
        agent.position, agent.planned_on = situation.position, planned_on
        self._spots[agent.number] = agent.position
        began = time.perf_counter()
        solution = agent.planner.plan(situation)
        if self.mission.avoidance == "prioritized":
            self._commit(agent, situation, solution)
        elif solution.status.has_path:
            self._follow(agent, agent.motion_along(solution.path))
        else:
            self._give_up(agent, solution.message or solution.status.value, stuck=solution.status is Status.STUCK)
        self._recorders[agent.number].planning_seconds += time.perf_counter() - began

    def _situation(self, agent: Agent, obstacles: tuple[Threat, ...], excluded: frozenset[int]) -> Situation:
        known = self.mission.world.field.with_only(agent.belief.threats.values())
        fields: tuple[RiskField, ...] = (known,)
        if self.mission.fusion != "union":
            fields = tuple(agent.belief.fields_by_origin())
        position, no_fly = self._kept_out_of(agent)
        return Situation(position, known, no_fly, obstacles, fields, excluded)

    def _move(self, agent: Agent) -> None:
        agent.move(self.tick)
        self._spots[agent.number] = agent.position
        self._recorders[agent.number].flew(agent)

    def _follow(self, agent: Agent, plan: Trajectory) -> None:
        agent.follow(plan, self.tick)
        self._recorders[agent.number].plans.append((self.tick, plan.points))
        self._say("planned", agent, waypoints=len(plan.points), length=plan.length)

    def _give_up(self, agent: Agent, reason: str, *, stuck: bool = False) -> None:
        self._say("stuck" if stuck else "no-path", agent, reason=reason)
        status = MissionStatus.STUCK if stuck else MissionStatus.NO_PATH
        agent.end(status, self.tick, f"at tick {self.tick}: {reason}")

    def _commit(self, agent: Agent, situation: Situation, solution: Solution) -> None:
        """
        Follow a plan only if it stays clear of the committed motions of all others.

        A UAV that keeps its last plan stays clear as well, as the others planned around it. So the plans at the
        beginning of every tick keep all safe distances.
        """
        committed = {
            other: motion
            for other in self._flying()
            if other is not agent and (motion := other.motion(self.tick)) is not None
        }
        others = [
            (motion, max(agent.uav.safe_distance, other.uav.safe_distance)) for other, motion in committed.items()
        ]
        plan, reason = None, solution.message or solution.status.value
        if solution.status.has_path:
            plan = agent.motion_along(solution.path)
            in_time = plan.shifted(self.tick)
            if not stays_clear(in_time, others):
                problem, matrix = agent.planner.problem(situation), agent.planner.matrix(situation)
                step = self.mission.step_of(agent.uav)
                names = [f"UAV {other.name}" for other in committed]
                found = plan_around(problem, matrix, others, self.tick, step, self.mission.unit, names)
                plan, reason = found.trajectory, found.message
        if plan is not None:
            self._follow(agent, plan)
        elif agent.can_go_on(self.tick, self._closed_areas(agent.belief.areas)):
            self._say("kept", agent, reason=reason)
        elif agent.plan is None and others and solution.status.has_path:
            near = listed([other.name for other in committed])
            self._stay_on_ground(agent, f"no plan keeps the safe distance from {near}: {reason}")
        else:
            self._give_up(agent, f"no plan keeps the safe distances: {reason}")

    def _obstacles(self, agent: Agent) -> tuple[Threat, ...]:
        """Return the virtual obstacles, and log UAVs that come within the safe distance."""
        apart = {
            other.number: distance
            for other in self._near(agent, agent.uav.safe_distance)
            if (distance := math.dist(agent.position, other.position)) < agent.uav.safe_distance
        }
        near = set(apart)
        for number in sorted(near - agent.near):
            self._say("near", agent, other=self._agents[number].name, distance=apart[number])
        agent.near = near
        rule = self.mission.virtual_obstacle
        if rule is None:
            return ()
        return rule.around(
            agent.position,
            [(other.position, other.heading) for other in self._near(agent, agent.uav.detection_radius)],
            detection_radius=agent.uav.detection_radius,
            safe_distance=agent.uav.safe_distance,
            unit=self.mission.unit,
        )

    def _known_areas(self, numbers: frozenset[int]) -> BaseGeometry | None:
        """Return the chart and the known timed areas; equal numbers give the same object, which is indexed once."""
        if numbers not in self._areas:
            world = self.mission.world
            self._areas[numbers] = union_of(world.no_fly, [world.polygons[number] for number in sorted(numbers)])
        return self._areas[numbers]

    def _kept_out_of(self, agent: Agent) -> tuple[Point, BaseGeometry | None]:
        """Return the position from which a UAV plans, and the areas it knows, widened by the clearance."""
        numbers, clearance = agent.belief.areas, self.mission.clearance
        closed = self._closed_areas(numbers, clearance)
        position = self._outside(agent.position, closed)
        if closed is not None and clearance > 0.0 and indexed_area(closed).contains(position):
            # an area appeared, or was first seen, nearer than the clearance
            known = self._known_areas(numbers)
            assert known is not None  # noqa: S101 - something is closed
            closed = closed_area(widened_clear_of(known, clearance, position), self.mission.world.bounds)
            position = self._outside(position, closed)
        return position, closed

    def _closed_areas(self, numbers: frozenset[int], clearance: float = 0.0) -> BaseGeometry | None:
        """Return the known areas, widened by a clearance, and joined with the outside of the map where they meet it."""
        if (numbers, clearance) not in self._closed:
            self._closed[numbers, clearance] = closed_area(
                self._known_areas(numbers), self.mission.world.bounds, clearance
            )
        return self._closed[numbers, clearance]

    def _outside(self, position: Point, no_fly: BaseGeometry | None) -> Point:
        """Move a position that rounding put inside an area or outside the bounds back by the rounding."""
        x_min, y_min, x_max, y_max = self.mission.world.bounds
        x, y = min(max(position[0], x_min), x_max), min(max(position[1], y_min), y_max)
        if no_fly is None or not (area := indexed_area(no_fly)).contains((x, y)):
            return x, y
        nudge = NUDGE * self.mission.unit
        for turn in range(8):
            angle = 0.25 * math.pi * turn
            moved = x + nudge * math.cos(angle), y + nudge * math.sin(angle)
            if not area.contains(moved):
                return moved
        return x, y

    def _find_livelock(self) -> None:
        """End the mission if its whole state repeats, as it would loop."""
        agents = self._flying()
        ground = tuple(agent for agent in self._agents if not agent.is_done and not agent.in_air)
        waiting = any(agent.uav.departs > self.tick for agent in ground)
        if not agents or waiting or self.tick < max(self.mission.world.changes, default=0):
            return
        if self.mission.sharing.loss > 0.0 and self._radio.can_teach({agent.number: agent.belief for agent in agents}):
            # the state does not include the next losses
            return
        # journals only grow: equal sizes mean equal contents, and messages in flight carry nothing new
        radio = (
            sum(len(agent.belief.numbers) for agent in self._agents),
            self._radio.state(self.tick),
        )
        state = (radio, *(agent.number for agent in ground), *(agent.state(self.tick) for agent in agents))
        there = self._states.setdefault(tuple(agent.position for agent in agents), [])
        before = next((tick for earlier, tick in there if earlier == state), None)
        if before is None:
            there.append((state, self.tick))
            return
        self.livelock = Livelock(since=before, period=self.tick - before)
        for agent in agents:
            self._say("livelock", agent, since=before, period=self.livelock.period)
            message = f"the state of tick {before} came back at tick {self.tick}: period {self.livelock.period}"
            agent.end(MissionStatus.LIVELOCK, self.tick, message)

    def _meet(self) -> dict[int, str]:
        """Measure the separations on this tick; return the reason of each flight that ends by a collision."""
        legs = {agent.number: agent.leg.shifted(agent.plan_since) for agent in self._flying() if agent.leg is not None}
        collided: dict[int, str] = {}
        for (i, j), (approach, is_new) in self._encounters.measure(legs).items():
            for one, other in ((self._agents[i], self._agents[j]), (self._agents[j], self._agents[i])):
                distance = approach.distance
                if is_new:
                    self._say("collision", one, other=other.name, distance=distance, at=list(approach.where))
                if self.mission.collisions == "end":
                    reason = f"{distance:g} from {other.name} at tick {approach.time:.1f}"
                    collided.setdefault(one.number, reason)
        return collided

    def _arrive(self, agent: Agent) -> None:
        if agent.has_arrived(self.tick, self.mission.arrival_radius):
            self._say("arrived", agent, at=list(agent.position))
            agent.end(MissionStatus.ARRIVED, self.tick)

    def _end_tick(self, collided: dict[int, str]) -> None:
        """Record the positions, and end the flights that arrived, collided or ran out of ticks."""
        is_last = self.tick >= self.mission.max_ticks
        for agent in self._agents:
            if agent.in_air:
                self._recorders[agent.number].trace.append(agent.position)
                if agent.number in collided:
                    agent.end(MissionStatus.COLLISION, self.tick, collided[agent.number])
                else:
                    self._arrive(agent)
            if is_last and not agent.is_done:
                self._say("out-of-ticks", agent)
                late = "" if agent.delay is None or agent.in_air else f"; it never took off: {agent.delay.hindrance}"
                agent.end(MissionStatus.OUT_OF_TICKS, self.tick, f"{self.tick} ticks are over{late}")


def fly(mission: Rules, watch: Callable[[int], None] | None = None) -> Flight:
    """Fly a mission to its end; `watch` is called after each tick, with its number."""
    with showing("flight", total=len(mission.uavs)) as tell:
        simulation = Simulation(mission)
        while not simulation.is_over:
            before = simulation.tick
            simulation.advance()
            tell(f"tick {simulation.tick}", simulation.n_done)
            if watch is not None and simulation.tick > before:
                watch(simulation.tick)
        return simulation.flight()
