"""Steering by fuzzy rules with a feedback that writes new ones, shared by `fbcri-style` and `cpvs-style`."""

import math
from abc import ABC
from dataclasses import dataclass, replace
from typing import Generic, Self, TypeAlias, TypeVar

import numpy as np
import shapely

from cgla_graph._types import Point
from cgla_graph.solvers.base import Count, Positive
from cgla_graph.solvers.geometry import bearing, wrapped
from cgla_graph.solvers.reactive.fuzzy import RuleBase, Triangle, about, centroid
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: A rule that feedback has written: about which clearance, threat and aim, and which turn follows.
Written: TypeAlias = tuple[float, float, float, int]

#: Clearance from the nearest threat over the range of sight.
CLEARANCE: dict[str, Triangle] = {
    "near": (-np.inf, 0.0, 0.25),
    "mid": (0.0, 0.25, 0.5),
    "far": (0.25, 0.5, np.inf),
}
#: Where the nearest threat is, degrees left of the heading: left back, left, front, right, right back.
THREAT: dict[str, Triangle] = {
    "RB": (-np.inf, -90.0, -45.0),
    "RS": (-90.0, -45.0, 0.0),
    "F": (-45.0, 0.0, 45.0),
    "LS": (0.0, 45.0, 90.0),
    "LB": (45.0, 90.0, np.inf),
}
#: Where the aim is, degrees left of the heading: right, slightly right, front, slightly left, left.
AIM: dict[str, Triangle] = {
    "R": (-np.inf, -60.0, -30.0),
    "SR": (-60.0, -30.0, 0.0),
    "F": (-30.0, 0.0, 30.0),
    "SL": (0.0, 30.0, 60.0),
    "L": (30.0, 60.0, np.inf),
}
#: The turn, degrees to the left: big right, small right, zero, small left, big left.
TURN: dict[str, Triangle] = {
    "BR": (-90.0, -60.0, -30.0),
    "SR": (-60.0, -30.0, 0.0),
    "Z": (-30.0, 0.0, 30.0),
    "SL": (0.0, 30.0, 60.0),
    "BL": (30.0, 60.0, 90.0),
}
#: The turn for each place of the threat (row) and of the aim (column, as in `AIM`): far threats do not count; in front
#: of one, turn away to the side of the aim, left where there is none; with one at a side, do not turn there.
TABLE: dict[str, dict[str, str]] = {
    "far": dict.fromkeys(THREAT, "BR SR Z SL BL"),
    "mid": {
        "RB": "SR SR Z  SL BL",
        "RS": "Z  Z  SL SL BL",
        "F": "BR SR SL SL BL",
        "LS": "BR SR SR Z  Z",
        "LB": "BR SR Z  SL SL",
    },
    "near": {
        "RB": "Z  Z  Z  SL BL",
        "RS": "SL SL SL BL BL",
        "F": "BR BR BL BL BL",
        "LS": "BR BR SR SR SR",
        "LB": "BR SR Z  Z  Z",
    },
}
RULES: dict[tuple[str, ...], str] = {
    (clearance, threat, aim): turn
    for clearance, rows in TABLE.items()
    for threat, row in rows.items()
    for aim, turn in zip(AIM, row.split(), strict=True)
}
#: Every degree.
GRID = np.arange(-90.0, 91.0)
BASE = RuleBase.from_table([CLEARANCE, THREAT, AIM], TURN, RULES, GRID)
TURNS = np.array(list(TURN.values()))

#: How far the inputs are blurred: clearance over range of sight, degrees, degrees. More would fire rules on both sides.
BLUR = np.array([0.01, 2.0, 2.0])
#: How wide the conditions of written rules are, at either side, in the same units.
WIDTH = np.array([0.05, 10.0, 10.0])
#: The edge of a threat is its contour of this risk: two spreads around a threat of peak 1.
EDGE = math.exp(-2.0)
#: Written rules hold this far (eta), and there are at most so many; the oldest is forgotten.
WEIGHT, MOST_WRITTEN = 0.5, 30
#: Feedback corrects a turn at most so often.
CORRECTIONS = 3
#: Steps away from the aim in a row that call for feedback.
LOSING = 5

#: Virtual targets: their directions off the aim (degrees), their distance, the length of the ray that tells whether
#: the aim is blocked, and when they count as reached (all over the shorter side of the map).
FAN = np.radians([30.0, 60.0, 90.0, 120.0, 150.0])
REACH, LOOK, CLOSE = 0.2, 0.15, 0.04
#: Greatest risk on a ray that is free.
FREE = 0.2
#: Within so many steps of its target, and with no area between, a planner flies straight: its turns are too wide.
HOMING = 3
#: A virtual target that is not reached in so many times `stall` steps is given up.
GIVE_UP = 3
#: Where to look for a way around a no-fly area: off the wanted heading, small turns first.
AROUND = np.radians(np.array([i * sign for i in range(33) for sign in (1, -1)][1:-1]) * 5.625)


@dataclass(frozen=True)
class FuzzyMemory(Memory):
    """
    Memory of a fuzzy planner.

    Attributes
    ----------
    heading
        Where it flies, radians counterclockwise from east.
    aim
        Where it wants to get, map units: the goal, or a sub-goal.
    least
        How near to the aim it has been, map units.
    stalled
        Steps since then, or since the last virtual target.
    losing
        Steps in a row that led away from the aim.
    turned
        All turns together, radians to the left.
    target
        The virtual target, map units.
    side
        On which side of the aim virtual targets are: 1 left, -1 right, 0 not decided.
    hit
        The distance to the aim at which a side was last decided, map units.
    written
        The rules that feedback has written.
    """

    heading: float
    aim: Point
    least: float
    stalled: int = 0
    losing: int = 0
    turned: float = 0.0
    target: Point | None = None
    side: int = 0
    hit: float = math.inf
    written: tuple[Written, ...] = ()

    @classmethod
    def at_start(cls, around: Surroundings) -> Self:
        """Return the memory at the start: facing the goal."""
        start = around.problem.start
        return cls(start, heading=around.goal_heading(start), aim=around.problem.goal, least=around.to_goal(start))


F = TypeVar("F", bound=FuzzyMemory)


@dataclass(frozen=True)
class FuzzySteering(Reactive[F], ABC, Generic[F]):
    """
    Base of planners that steer by fuzzy rules from an aim to a step.

    Attributes
    ----------
    sight
        The range that clearances are relative to, over the shorter side of the map; the paper's OR.
    tolerance
        How much the risk may rise in a step before feedback sets in (tau).
    stall
        Steps without coming nearer to the aim before a virtual target is placed.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.
    """

    sight: Positive = 0.2
    tolerance: Positive = 0.02
    stall: Count = 20

    def steer(self, around: Surroundings, memory: F, aim: Point) -> F:
        """
        Fly one step towards an aim.

        Raises
        ------
        Stuck
            If every direction is closed.
        """
        memory = self._watch(around, memory, aim)
        here, target = memory.position, memory.target or aim
        left = math.dist(here, target)
        towards = bearing(here, target)
        if left <= HOMING * around.step and around.is_open(here, np.array([target]))[0]:
            turn, written = wrapped(towards - memory.heading), memory.written
        else:
            turn, written = self._infer(around, memory, target)
        heading = _passable(around, here, memory.heading + turn, min(left, around.step))
        position = around.spot_ahead(here, heading, min(left, around.step))
        return replace(
            memory,
            position=position,
            heading=heading,
            losing=memory.losing + 1 if math.dist(position, target) > left else 0,
            turned=memory.turned + wrapped(heading - memory.heading),
            written=written,
        )

    def _infer(self, around: Surroundings, memory: F, target: Point) -> tuple[float, tuple[Written, ...]]:
        """Infer the turn, radians, simulate its step, and write rules against its faults."""
        here, written = memory.position, memory.written
        clearance, place = self._nearest(around, here, target)
        threat = math.degrees(wrapped(place - memory.heading))
        goal = math.degrees(wrapped(bearing(here, target) - memory.heading))
        inputs = about([clearance / (self.sight * around.side), threat, goal], BLUR)
        by_base = BASE.conclude(inputs)
        turn, label = 0.0, 0
        for correction in range(CORRECTIONS + 1):
            conclusion = np.maximum(by_base, _written_rules(written).conclude(inputs)) if written else by_base
            turn = centroid(GRID, conclusion)
            if correction == CORRECTIONS:
                break
            fault = self._fault(around, memory, target, turn)
            if not fault:
                break
            if correction == 0:
                label = int(np.abs(TURNS[:, 1] - turn).argmin())
            sought = goal if fault == "loses" else -threat or goal
            label = min(max(label + (1 if sought >= 0.0 else -1), 0), len(TURNS) - 1)
            rule = (*inputs[:, 1].tolist(), label)
            if rule in written:
                continue
            written = (*written, rule)[-MOST_WRITTEN:]
        return math.radians(turn), written

    def _fault(self, around: Surroundings, memory: F, target: Point, turn: float) -> str:
        """Name the fault of a turn, degrees: it ``rises`` into risk or ``loses`` the target; empty if none."""
        here = memory.position
        ahead = around.spot_ahead(here, memory.heading + math.radians(turn), around.step)
        before, after = around.risk(np.array([here, ahead])).tolist()
        if after - before > self.tolerance:
            return "rises"
        is_away = math.dist(ahead, target) > math.dist(here, target)
        return "loses" if is_away and memory.losing >= LOSING else ""

    def _nearest(self, around: Surroundings, here: Point, target: Point) -> tuple[float, float]:
        """Return the clearance from the nearest edge of a threat or an area, map units, and its direction."""
        clearance, direction = math.inf, 0.0
        field = around.problem.field
        centres, edges = field.centres, field.contour_radii(EDGE)
        # a threat that is nowhere as risky as an edge has none, and one around the target has to be entered
        counted = (edges > 0.0) & (np.hypot(*(centres - target).T) > edges)
        centres, edges = centres[counted], edges[counted]
        if len(centres):
            gaps = np.hypot(*(centres - here).T) - edges
            nearest = int(gaps.argmin())
            clearance, direction = float(gaps[nearest]), bearing(here, centres[nearest].tolist())
        area = around.problem.model.area
        if not area.is_empty:
            line = shapely.get_coordinates(shapely.shortest_line(shapely.Point(here), area.geometry))
            gap = math.dist(*line)
            if gap < clearance:
                clearance, direction = gap, bearing(here, line[1].tolist())
        # beyond sight is far, wherever it is
        return min(clearance, 2.0 * self.sight * around.side), direction

    def _watch(self, around: Surroundings, memory: F, aim: Point) -> F:
        """Keep count of headway, and place or drop the virtual target."""
        left = math.dist(memory.position, aim)
        if aim != memory.aim:
            return replace(memory, aim=aim, least=left, stalled=0, losing=0, target=None, side=0)
        if memory.target is not None:
            return self._chase(around, replace(memory, stalled=memory.stalled + 1), memory.target)
        if left < memory.least:
            return replace(memory, least=left, stalled=0, side=0 if left < memory.hit else memory.side)
        memory = replace(memory, stalled=memory.stalled + 1)
        return self._placed(around, memory) if memory.stalled >= self.stall else memory

    def _chase(self, around: Surroundings, memory: F, target: Point) -> F:
        """Drop the virtual target where the aim is free, or it is reached or out of reach; else keep it."""
        left = math.dist(memory.position, memory.aim)
        memory = replace(memory, least=min(left, memory.least))
        is_clear = _is_clear(around, memory.position, memory.aim)
        if is_clear and left < memory.hit:
            return replace(memory, target=None, side=0, stalled=0)
        if math.dist(memory.position, target) <= max(CLOSE * around.side, 2.0 * around.step):
            memory = replace(memory, target=None, stalled=0)
            return memory if is_clear else self._placed(around, memory)
        if memory.stalled >= GIVE_UP * self.stall:
            return self._placed(around, replace(memory, side=-memory.side))
        return memory

    def _placed(self, around: Surroundings, memory: F) -> F:
        """Place a virtual target beside the obstacle; None without a free place for one."""
        here = memory.position
        hit = memory.hit if memory.side else memory.least
        first = memory.side or (-1 if memory.turned > 0.0 else 1)
        towards = bearing(here, memory.aim)
        for side in (first, -first):
            headings = towards + side * FAN
            places = around.ahead(here, headings, REACH * around.side)
            risks = around.risk_on_rays(here, headings, REACH * around.side).max(axis=1)
            free = np.flatnonzero((risks < FREE) & around.is_open(here, places))
            if len(free):
                x, y = places[free[0]].tolist()
                return replace(memory, target=(x, y), side=side, hit=hit, stalled=0)
        return replace(memory, target=None, stalled=0, side=0)


def _written_rules(written: tuple[Written, ...]) -> RuleBase:
    """Return the rules that feedback has written: about these inputs, this turn, by half."""
    rows = np.array(written)
    conditions = np.stack([rows[:, :3] - WIDTH, rows[:, :3], rows[:, :3] + WIDTH], axis=-1)
    return RuleBase(conditions, TURNS[rows[:, 3].astype(np.int64)], GRID, np.full(len(rows), WEIGHT))


def _is_clear(around: Surroundings, here: Point, aim: Point) -> bool:
    """Tell whether the first part of the straight way to an aim is free of areas and of much risk."""
    distance = min(LOOK * around.side, math.dist(here, aim))
    heading = np.array([bearing(here, aim)])
    if not around.is_open(here, around.ahead(here, heading, distance))[0]:
        return False
    return bool(around.risk_on_rays(here, heading, distance).max() < FREE)


def _passable(around: Surroundings, here: Point, wanted: float, distance: float) -> float:
    """Return the heading nearest to the wanted one in which a step may be flown."""
    if around.is_open(here, around.ahead(here, np.array([wanted]), distance))[0]:
        return wrapped(wanted)
    headings = wanted + AROUND
    open_ = np.flatnonzero(around.is_open(here, around.ahead(here, headings, distance)))
    if not len(open_):
        msg = f"boxed in: no step of {distance:.6g} is open in any direction"
        raise Stuck(msg)
    return wrapped(float(headings[open_[0]]))
