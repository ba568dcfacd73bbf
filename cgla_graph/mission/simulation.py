"""
The tick loop of a mission: sense, share, plan, move.

A tick begins with what the UAVs see where they are, then they tell each other, then those plan whose knowledge has
changed, then all move. Nothing depends on the time of day or on the order of anything but the UAVs themselves.
"""

import math
import time
from typing import TYPE_CHECKING, Any

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.agent import Pilot
from cgla_graph.mission.avoidance import plan_around, stays_clear
from cgla_graph.mission.encounters import Encounters
from cgla_graph.mission.records import Event, EventKind, Flight, Knowledge, Livelock, MissionStatus
from cgla_graph.mission.replanner import Planner, Situation
from cgla_graph.mission.sensing import sightings
from cgla_graph.mission.sharing import Radio
from cgla_graph.mission.world import union_of
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.motion.trajectory import Disc, Trajectory

if TYPE_CHECKING:
    from cgla_graph.mission.mission import Mission

#: A position that rounding put inside a no-fly area is moved out by so many units.
NUDGE = 1e-9


class Simulation:
    """
    A mission under way.

    Parameters
    ----------
    mission
        What to fly.

    Attributes
    ----------
    tick
        How many ticks are done.
    events
        What has happened so far.
    livelock
        The proof that the mission never ends, if there is one.

    Examples
    --------
    >>> from cgla_graph.mission.mission import Mission
    >>> from cgla_graph.mission.uav import Uav
    >>> from cgla_graph.solvers import get
    >>> from cgla_graph.mission.world import World
    >>> uav = Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2)
    >>> simulation = Mission(World(), [uav], get("cgla")).simulate()
    >>> simulation.advance()
    >>> simulation.tick, simulation.is_over, [event.kind for event in simulation.events]
    (1, False, ['departed', 'planned'])
    """

    def __init__(self, mission: "Mission") -> None:
        self.mission = mission
        self.tick = 0
        self.events: list[Event] = []
        self.livelock: Livelock | None = None
        self._pilots = [Pilot(number, uav, Planner(mission, uav), uav.start) for number, uav in enumerate(mission.uavs)]
        self._radio = Radio(mission.shares)
        self._encounters = Encounters(
            [uav.name for uav in mission.uavs],
            [Disc(uav.goal, mission.terminal_at) for uav in mission.uavs],
            mission.collision_at,
        )
        self._states: dict[tuple[Any, ...], int] = {}
        self._areas: dict[frozenset[int], BaseGeometry | None] = {}

    @property
    def is_over(self) -> bool:
        """Whether every UAV has come to an end."""
        return all(pilot.is_done for pilot in self._pilots)

    def advance(self) -> None:
        """Fly one tick; nothing happens when the mission is over."""
        if self.is_over:
            return
        self._depart()
        if self.is_over:
            # everybody was where they wanted to be
            return
        self._notice_what_came_up()
        for pilot in self._flying():
            self._sense(pilot)
        self._share()
        self._find_livelock()
        if self.mission.update == "sequential":
            for pilot in self._flying():
                self._plan(pilot)
                if pilot.in_air:
                    pilot.move(self.tick)
        else:
            for pilot in self._flying():
                self._plan(pilot)
            for pilot in self._flying():
                pilot.move(self.tick)
        if self.is_over:
            # nobody was left to fly this tick
            return
        collided = self._meet()
        self.tick += 1
        self._end_tick(collided)

    def flight(self, *, interrupted: bool = False) -> Flight:
        """
        Return what the mission came to so far.

        Parameters
        ----------
        interrupted
            Whether it ends here although UAVs are still flying; they are then marked so.

        Returns
        -------
        flight
            The flight.
        """
        events = list(self.events)
        if interrupted:
            events += [Event(self.tick, "interrupted", pilot.name) for pilot in self._pilots if not pilot.is_done]
        return Flight(
            mission=self.mission,
            uavs={
                pilot.name: pilot.flown(self.mission.world, self.tick, self.mission.step_of(pilot.uav))
                for pilot in self._pilots
            },
            separations=tuple(self._encounters.separations.values()),
            events=tuple(events),
            ticks=self.tick,
            livelock=self.livelock,
            interrupted=interrupted,
        )

    def _flying(self) -> list[Pilot]:
        return [pilot for pilot in self._pilots if pilot.in_air]

    def _say(self, kind: EventKind, pilot: Pilot, **detail: Any) -> None:  # noqa: ANN401 - any JSON
        self.events.append(Event(self.tick, kind, pilot.name, detail))

    def _depart(self) -> None:
        world = self.mission.world
        for pilot in self._pilots:
            if pilot.is_done or pilot.in_air or pilot.uav.departs != self.tick:
                continue
            pilot.depart(self.tick)
            self._say("departed", pilot, at=list(pilot.position))
            for number, threat in world.threats_at(self.tick).items():
                if math.dist(pilot.position, (threat.x, threat.y)) <= threat.spread:
                    risk = float(world.field_at(self.tick).density(pilot.position))
                    self._say("started-in-risk", pilot, threat=number, risk=risk)
            self._arrive(pilot)

    def _notice_what_came_up(self) -> None:
        """Log threats and areas that come up around a UAV."""
        world = self.mission.world
        if self.tick not in world.changes:
            return
        threats, areas = world.threats_at(self.tick - 1), world.areas_at(self.tick - 1)
        for pilot in self._flying():
            for number, threat in world.threats_at(self.tick).items():
                apart = math.dist(pilot.position, (threat.x, threat.y))
                if threats.get(number) != threat and apart <= threat.spread:
                    self._say("appeared-on", pilot, threat=number, distance=apart)
            for number, area in world.areas_at(self.tick).items():
                if number not in areas and indexed_area(area).contains(pilot.position):
                    self._say("appeared-on", pilot, area=number)

    def _sense(self, pilot: Pilot) -> None:
        radius = math.inf if self.mission.knowledge == "all" else pilot.uav.detection_radius
        seen_from = np.array([pilot.position])
        if self.mission.movement == "vertex" and pilot.leg is not None:
            seen_from = pilot.leg.points
        seen = sightings(self.mission.world, self.tick, pilot.belief, seen_from, radius, pilot.number)
        for new in pilot.belief.hear(seen):
            kind, number = new.thing
            place = {"at": [new.content.x, new.content.y]} if new.content else {}
            self._say("detected" if new.is_there else "refuted", pilot, **{kind: number}, **place)

    def _share(self) -> None:
        taking_part = {pilot.number: pilot for pilot in self._pilots if not pilot.is_done}
        learned = self._radio.exchange(
            self.tick,
            {number: pilot.belief for number, pilot in taking_part.items()},
            [pilot.position for pilot in taking_part.values()],
        )
        for receiver, sender, reports in learned:
            for report in reports:
                kind, number = report.thing
                self._say(
                    "learned",
                    taking_part[receiver],
                    **{kind: number},
                    source=self._pilots[sender].name,
                    origin=self._pilots[report.origin].name,
                    seen=report.tick,
                    is_there=report.is_there,
                )
        for pilot in taking_part.values():
            threats, areas = dict(pilot.belief.threats), sorted(pilot.belief.areas)
            last = pilot.knowledge[-1] if pilot.knowledge else None
            if last is None or last.threats != threats or sorted(last.areas) != areas:
                closed = {number: self.mission.world.timed_area(number) for number in areas}
                pilot.knowledge.append(Knowledge(self.tick, threats, closed))

    def _plan(self, pilot: Pilot) -> None:
        """Plan again if there is a reason to."""
        obstacles = self._obstacles(pilot)
        if (pilot.obstacles[-1][1] if pilot.obstacles else ()) != obstacles:
            pilot.obstacles.append((self.tick, obstacles))
        excluded = self._excluded(pilot)
        planned_on = tuple(pilot.belief.threats.items()), pilot.belief.areas, obstacles, excluded
        on_change = self.mission.replan == "change" and not pilot.planner.by_steps
        if pilot.plan is not None and on_change and planned_on == pilot.planned_on:
            return
        situation = self._situation(pilot, obstacles, excluded)
        pilot.position, pilot.planned_on = situation.position, planned_on
        began = time.perf_counter()
        solution = pilot.planner.plan(situation)
        if self.mission.avoidance == "prioritized":
            self._commit(pilot, situation, solution)
        elif solution.status.is_path:
            self._follow(pilot, self._motion_along(pilot, solution.path))
        else:
            self._give_up(pilot, solution.message or solution.status.value, stuck=solution.status is Status.STUCK)
        pilot.seconds += time.perf_counter() - began

    def _situation(self, pilot: Pilot, obstacles: tuple[Threat, ...], excluded: frozenset[int]) -> Situation:
        known = self.mission.world.field.with_only(pilot.belief.threats.values())
        fields: tuple[RiskField, ...] = (known,)
        if self.mission.fusion != "union":
            fields = tuple(pilot.belief.fields_by_origin())
        no_fly = self._known_areas(pilot.belief.areas)
        position = self._outside(pilot.position, no_fly)
        return Situation(position, known, no_fly, obstacles, fields, excluded)

    def _motion_along(self, pilot: Pilot, path: FloatArray) -> Trajectory:
        if self.mission.movement == "vertex":
            return Trajectory(np.arange(len(path), dtype=np.float64), path)
        return Trajectory.along(path, 0.0, self.mission.step_of(pilot.uav))

    def _follow(self, pilot: Pilot, plan: Trajectory) -> None:
        pilot.follow(plan, self.tick)
        pilot.replans.append(self.tick)
        self._say("planned", pilot, waypoints=len(plan.points), length=plan.length)

    def _give_up(self, pilot: Pilot, reason: str, *, stuck: bool = False) -> None:
        self._say("stuck" if stuck else "no-path", pilot, reason=reason)
        status = MissionStatus.STUCK if stuck else MissionStatus.NO_PATH
        pilot.end(status, self.tick, f"at tick {self.tick}: {reason}")

    def _commit(self, pilot: Pilot, situation: Situation, solution: Solution) -> None:
        """
        Follow a plan only if it stays clear of what all others are going to fly.

        Whoever keeps the last plan stays clear as well: the others planned around it. So every tick begins with plans
        for all that keep all safe distances, and no new plan ever gives that up.
        """
        others = [
            (motion, max(pilot.uav.safe, other.uav.safe))
            for other in self._flying()
            if other is not pilot and (motion := other.motion(self.tick)) is not None
        ]
        plan, reason = None, solution.message or solution.status.value
        if solution.status.is_path:
            plan = self._motion_along(pilot, solution.path)
            in_time = plan.shifted(self.tick)
            if not stays_clear(in_time, others):
                problem, matrix = pilot.planner.problem(situation), pilot.planner.matrix(situation)
                step = self.mission.step_of(pilot.uav)
                found = plan_around(problem, matrix, others, self.tick, step, self.mission.unit)
                plan, reason = found.trajectory, found.message
        if plan is not None:
            self._follow(pilot, plan)
        elif self._is_open(pilot, situation):
            self._say("kept", pilot, reason=reason)
        else:
            self._give_up(pilot, f"no plan keeps the safe distances: {reason}")

    def _is_open(self, pilot: Pilot, situation: Situation) -> bool:
        """Return whether there is a plan, and the rest of it crosses no area that is known now."""
        rest = pilot.motion(self.tick)
        return rest is not None and not indexed_area(situation.no_fly).crosses(rest.points[:-1], rest.points[1:]).any()

    def _obstacles(self, pilot: Pilot) -> tuple[Threat, ...]:
        """Place the virtual obstacles, and log who is within the safe distance."""
        others = [other for other in self._flying() if other is not pilot]
        apart = {other.number: math.dist(pilot.position, other.position) for other in others}
        near = {number for number, distance in apart.items() if distance < pilot.uav.safe}
        for number in sorted(near - pilot.near):
            self._say("near", pilot, other=self._pilots[number].name, distance=apart[number])
        pilot.near = near
        rule = self.mission.obstacles
        if rule is None:
            return ()
        return rule.around(
            pilot.position,
            [(other.position, other.heading) for other in others],
            detection_radius=pilot.uav.detection_radius,
            safe_distance=pilot.uav.safe,
            unit=self.mission.unit,
        )

    def _excluded(self, pilot: Pilot) -> frozenset[int]:
        """Return the lattice points that the next plan may not use (E17)."""
        if self.mission.exclude == "none":
            return frozenset()
        here = self.mission.lattice.nearest(pilot.position)
        if not pilot.visited or pilot.visited[-1] != here:
            pilot.visited.append(here)
        before = [node for node in pilot.visited if node != here]
        return frozenset(before[-1:] if self.mission.exclude == "last" else before)

    def _known_areas(self, numbers: frozenset[int]) -> BaseGeometry | None:
        """Return the chart and the known timed areas: the same object for the same areas, which is indexed once."""
        if numbers not in self._areas:
            parts = [self.mission.world.timed_area(number) for number in sorted(numbers)]
            self._areas[numbers] = union_of(self.mission.world.no_fly, parts)
        return self._areas[numbers]

    def _outside(self, position: Point, no_fly: BaseGeometry | None) -> Point:
        """Move a position that only rounding put inside an area, or outside the bounds, back by next to nothing."""
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
        """End the mission if its whole state has been there before: then it comes back for ever."""
        pilots = self._flying()
        waiting = any(not pilot.is_done and not pilot.in_air for pilot in self._pilots)
        if not pilots or waiting or self.tick < max(self.mission.world.changes, default=0):
            return
        if self.mission.shares.loss > 0.0 and self._radio.can_teach({pilot.number: pilot.belief for pilot in pilots}):
            # whose message is lost next, the state does not say
            return
        # journals only grow: equal sizes are equal contents; what was sent meanwhile was new to nobody
        radio = (
            sum(len(pilot.belief.journal) for pilot in self._pilots),
            tuple((due - self.tick, *ends) for due, *ends, _ in self._radio.under_way),
        )
        before = self._states.setdefault((radio, *(pilot.state(self.tick) for pilot in pilots)), self.tick)
        if before == self.tick:
            return
        self.livelock = Livelock(since=before, period=self.tick - before)
        for pilot in pilots:
            self._say("livelock", pilot, since=before, period=self.livelock.period)
            message = f"the state of tick {before} came back at tick {self.tick}: period {self.livelock.period}"
            pilot.end(MissionStatus.LIVELOCK, self.tick, message)

    def _meet(self) -> dict[int, str]:
        """Measure how near the UAVs came to each other; return why it is the end for whom."""
        legs = {pilot.number: pilot.leg.shifted(pilot.plan_since) for pilot in self._flying() if pilot.leg is not None}
        collided: dict[int, str] = {}
        for (i, j), (approach, is_new) in self._encounters.measure(legs).items():
            for one, other in ((self._pilots[i], self._pilots[j]), (self._pilots[j], self._pilots[i])):
                distance = approach.distance
                if is_new:
                    self._say("collision", one, other=other.name, distance=distance, at=list(approach.where))
                if self.mission.collisions == "end":
                    reason = f"{distance:g} from {other.name} at tick {approach.time:.1f}"
                    collided.setdefault(one.number, reason)
        return collided

    def _arrive(self, pilot: Pilot) -> None:
        if pilot.has_arrived(self.tick, self.mission.arrival_radius):
            self._say("arrived", pilot, at=list(pilot.position))
            pilot.end(MissionStatus.ARRIVED, self.tick)

    def _end_tick(self, collided: dict[int, str]) -> None:
        """Note where everybody is, and who has come to an end."""
        is_last = self.tick >= self.mission.last_tick
        for pilot in self._pilots:
            if pilot.in_air:
                pilot.trace.append(pilot.position)
                if pilot.number in collided:
                    pilot.end(MissionStatus.COLLISION, self.tick, collided[pilot.number])
                else:
                    self._arrive(pilot)
            if is_last and not pilot.is_done:
                self._say("out-of-ticks", pilot)
                pilot.end(MissionStatus.OUT_OF_TICKS, self.tick, f"{self.tick} ticks are over")
