"""Steering by fuzzy rules, with a feedback that writes new ones: in the style of FBCRI."""

import math
from abc import ABC
from dataclasses import dataclass, replace
from typing import ClassVar, Generic, TypeAlias, TypeVar

import numpy as np
import shapely

from cgla_graph._types import FloatArray, Point
from cgla_graph.solvers.base import Traits, positive_setting, whole_setting
from cgla_graph.solvers.fuzzy import RuleBase, Triangle, about, centroid
from cgla_graph.solvers.reactive import Memory, Reactive, Stuck, Surroundings

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
LOG_EDGE = -2.0
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
#: So near to what it flies to, in steps, a planner that sees no area between goes straight: its turns are too wide.
HOMING = 3
#: A virtual target that is not reached in so many times `stall` steps is given up.
GIVE_UP = 3
#: Where to look for a way around a no-fly area: off the wanted heading, small turns first.
AROUND = np.radians(np.array([i * sign for i in range(33) for sign in (1, -1)][1:-1]) * 5.625)


@dataclass(frozen=True)
class FuzzyMemory(Memory):
    """
    What a fuzzy planner remembers.

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


F = TypeVar("F", bound=FuzzyMemory)


@dataclass(frozen=True)
class FuzzySteering(Reactive[F], ABC, Generic[F]):
    """
    What planners that steer by fuzzy rules share: from an aim to a step.

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

    sight: float = 0.2
    tolerance: float = 0.02
    stall: int = 20

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        for name in ("sight", "tolerance"):
            object.__setattr__(self, name, positive_setting(self.traits.name, name, getattr(self, name)))
        whole_setting(self.traits.name, "stall", self.stall, at_least=1)

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
        bearing = _bearing(here, target)
        if left <= HOMING * around.step and around.is_open(here, np.array([target]))[0]:
            turn, written = _wrapped(bearing - memory.heading), memory.written
        else:
            turn, written = self._infer(around, memory, target)
        heading = _passable(around, here, memory.heading + turn, min(left, around.step))
        position = _at(around, here, heading, min(left, around.step))
        return replace(
            memory,
            position=position,
            heading=heading,
            losing=memory.losing + 1 if math.dist(position, target) > left else 0,
            turned=memory.turned + _wrapped(heading - memory.heading),
            written=written,
        )

    def _infer(self, around: Surroundings, memory: F, target: Point) -> tuple[float, tuple[Written, ...]]:
        """Infer the turn, radians, simulate its step, and write rules against what is wrong with it."""
        here, written = memory.position, memory.written
        clearance, place = self._nearest(around, here, target)
        threat = math.degrees(_wrapped(place - memory.heading))
        goal = math.degrees(_wrapped(_bearing(here, target) - memory.heading))
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
        """Say what is wrong with a turn, degrees: it ``rises`` into risk or ``loses`` the target; empty if nothing."""
        here = memory.position
        ahead = _at(around, here, memory.heading + math.radians(turn), around.step)
        before, after = around.risk(np.array([here, ahead])).tolist()
        if after - before > self.tolerance:
            return "rises"
        is_away = math.dist(ahead, target) > math.dist(here, target)
        return "loses" if is_away and memory.losing >= LOSING else ""

    def _nearest(self, around: Surroundings, here: Point, target: Point) -> tuple[float, float]:
        """Return clearance from the nearest edge of a threat or an area, map units, and the direction of it."""
        clearance, direction = math.inf, 0.0
        table = around.problem.field.table
        edges = edge(table, LOG_EDGE)
        # a threat that is nowhere as risky as an edge has none, and one around the target has to be entered
        counted = (edges > 0.0) & (np.hypot(table[:, 0] - target[0], table[:, 1] - target[1]) > edges)
        table, edges = table[counted], edges[counted]
        if len(table):
            gaps = np.hypot(table[:, 0] - here[0], table[:, 1] - here[1]) - edges
            nearest = int(gaps.argmin())
            clearance, direction = float(gaps[nearest]), _bearing(here, table[nearest, :2].tolist())
        area = around.problem.model.area
        if not area.is_empty:
            line = shapely.get_coordinates(shapely.shortest_line(shapely.Point(here), area.geometry))
            gap = math.dist(*line)
            if gap < clearance:
                clearance, direction = gap, _bearing(here, line[1].tolist())
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
        """Place a virtual target beside what is in the way; without a free place for one, there is none."""
        here = memory.position
        hit = memory.hit if memory.side else memory.least
        first = memory.side or (-1 if memory.turned > 0.0 else 1)
        towards = _bearing(here, memory.aim)
        for side in (first, -first):
            headings = towards + side * FAN
            places = around.ahead(here, headings, REACH * around.side)
            risks = around.risk_on_rays(here, headings, REACH * around.side).max(axis=1)
            free = np.flatnonzero((risks < FREE) & around.is_open(here, places))
            if len(free):
                x, y = places[free[0]].tolist()
                return replace(memory, target=(x, y), side=side, hit=hit, stalled=0)
        return replace(memory, target=None, stalled=0, side=0)


@dataclass(frozen=True)
class FbcriStyle(FuzzySteering[FuzzyMemory]):
    """
    Fuzzy steering with feedback, in the style of FBCRI.

    Of the original (Zheng, Wu, Liu and Cai, Applied Soft Computing 11, 2011, 1241-1255) the abstract is public: a
    feedback is embedded in the compositional rule of inference, and one of the uses is path planning of UAVs in real
    time. The paper on CGLA adds that new rules are generated and put into the rule base, that a virtual obstacle or
    target prevents non-convergence, and that the first rules are selected by hand. Neither its rules nor its code are
    public: this is **not** the original.

    The sets, the 75 rules and the feedback are our design. Clearance from the nearest threat (from its contour of two
    spreads), the direction of that threat and the direction of the aim are blurred into fuzzy sets; the turn, at most
    60 degrees, is the centroid of their composition with the rules. The step is simulated: where risk rises by more
    than `tolerance`, a rule is written that turns one label further away from the threat, and after five steps away
    from the aim, one label back towards it; it holds for about these inputs, by half, and the inference is made again,
    at most three times. Thirty written rules are remembered. After `stall` steps without headway, a virtual target 0.2
    of the side away, the first free one 30 to 150 degrees off the aim, is flown to instead, and others on the same
    side after it, until the aim is free and nearer than where it began.

    A no-fly area counts as a threat where it is nearest; a step that would cross it is turned aside by as little as
    possible. A threat around the target does not count: it has to be entered. Other UAVs of a mission are threats like
    any others, where the mission has virtual obstacles.

    Known failures: only the nearest threat counts, so that rules give way to one threat and into another where threats
    are dense; a pocket deeper than the 0.2 to a virtual target is not left; virtual targets may lead around in circles;
    nothing weighs length against risk, whatever ``k`` is, and nothing is optimal. `Solution.evaluations` counts points
    of ``F``.

    Source: the abstract; Zhang, Mao, Liu and Liu, Automatica 50(3), 2014, Section 5.2; virtual targets as in the
    behaviour-based planners of the same group.

    Attributes
    ----------
    step, max_steps, patience
        As in `Reactive`.
    sight, tolerance, stall
        As in `FuzzySteering`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.problem import Problem
    >>> from cgla_graph.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, spread=0.1)]), k=10.0)
    >>> risk = problem.evaluate(FbcriStyle().solve(problem).path).risk
    >>> risk < 0.5 * problem.evaluate([problem.start, problem.goal]).risk
    True
    """

    traits: ClassVar[Traits] = Traits(
        "fbcri-style", "fuzzy rules with feedback, step by step (not the original)", domain="plane", complete=False
    )

    def begin(self, around: Surroundings) -> FuzzyMemory:
        """Face the goal."""
        problem = around.problem
        return FuzzyMemory(
            problem.start,
            heading=around.goal_heading(problem.start),
            aim=problem.goal,
            least=around.to_goal(problem.start),
        )

    def choose(self, around: Surroundings, memory: FuzzyMemory) -> FuzzyMemory:
        """Steer to the goal."""
        return self.steer(around, memory, around.problem.goal)


def edge(table: FloatArray, log_level: float) -> FloatArray:
    """
    Return the radius of each threat's contour of a risk.

    Parameters
    ----------
    table
        `RiskField.table`, shape ``(m, 7)``.
    log_level
        Logarithm of the risk.

    Returns
    -------
    radii
        Shape ``(m,)``, map units; 0 for threats that are nowhere as risky.

    Examples
    --------
    >>> from cgla_graph.risk import RiskField, Threat
    >>> edge(RiskField([Threat(0, 0, spread=3), Threat(0, 0, spread=3, peak=0.1)]).table, -2.0).tolist()
    [6.0, 0.0]
    """
    radii: FloatArray = table[:, 6] * np.sqrt(np.maximum(2.0 * (table[:, 4] - log_level), 0.0))
    return radii


def _written_rules(written: tuple[Written, ...]) -> RuleBase:
    """Return the rules that feedback has written: about these inputs, this turn, by half."""
    rows = np.array(written)
    conditions = np.stack([rows[:, :3] - WIDTH, rows[:, :3], rows[:, :3] + WIDTH], axis=-1)
    return RuleBase(conditions, TURNS[rows[:, 3].astype(np.int64)], GRID, np.full(len(rows), WEIGHT))


def _is_clear(around: Surroundings, here: Point, aim: Point) -> bool:
    """Tell whether the first part of the straight way to an aim is free of areas and of much risk."""
    distance = min(LOOK * around.side, math.dist(here, aim))
    heading = np.array([_bearing(here, aim)])
    if not around.is_open(here, around.ahead(here, heading, distance))[0]:
        return False
    return bool(around.risk_on_rays(here, heading, distance).max() < FREE)


def _passable(around: Surroundings, here: Point, wanted: float, distance: float) -> float:
    """Return the heading nearest to the wanted one in which a step may be flown."""
    if around.is_open(here, around.ahead(here, np.array([wanted]), distance))[0]:
        return _wrapped(wanted)
    headings = wanted + AROUND
    open_ = np.flatnonzero(around.is_open(here, around.ahead(here, headings, distance)))
    if not len(open_):
        msg = f"boxed in: no step of {distance:.6g} is open in any direction"
        raise Stuck(msg)
    return _wrapped(float(headings[open_[0]]))


def _at(around: Surroundings, here: Point, heading: float, distance: float) -> Point:
    x, y = around.ahead(here, np.array([heading]), distance)[0].tolist()
    return x, y


def _bearing(here: Point, there: Point) -> float:
    """Return the direction of a place, radians counterclockwise from east."""
    return math.atan2(there[1] - here[1], there[0] - here[0])


def _wrapped(angle: float) -> float:
    """Return an angle between -pi and pi."""
    return math.remainder(angle, 2.0 * math.pi)
