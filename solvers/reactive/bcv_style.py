"""Behaviours that vote for a heading, and virtual goals to lead them out of traps (in the style of Wu et al. 2011)."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import NonNegative, reactive_traits
from cgla_graph.solvers.geometry import bearing, wrapped
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: One turn of the heading, radians, and how many of them a step allows to either side.
TURN = math.pi / 16
MOST_TURNS = 8
#: Weights of the behaviours; that of avoiding threats rises from 0 to 1.
SEEK, KEEP = 1.0, 0.2
#: A threat repels within some spreads and so much more, in shorter sides of the map.
AVOID_MARGIN = 0.04
#: How far ahead a heading is judged, in shorter sides of the map.
LOOK = 0.1
#: The goal is blocked where risk rises above BLOCKED within so far; a way is free where it stays below FREE.
SIGHT, BLOCKED, FREE = 0.15, 0.5, 0.2
#: Stalled: so many steps came nearer to the target by less than this part of their length.
STALL_STEPS, STALL_PART = 20, 0.5
#: Where virtual goals are put and count as reached, in shorter sides of the map, and at which angles off the goal.
VIRTUAL, REACHED = 0.2, 0.04
ANGLES = tuple(math.radians(degrees) for degrees in (30, 60, 90, 120, 150))


@dataclass(frozen=True)
class BcvMemory(Memory):
    """
    Memory of the planner.

    Attributes
    ----------
    first
        The heading at the start, radians.
    turns
        How far it has turned since, in steps of pi / 16, to the left; full circles count.
    virtual
        The virtual goal that it heads for, if there is one.
    hit
        How far from the goal it was when it left its course for a virtual goal, map units.
    left
        How far from its target it was after each of the last steps towards it, map units.
    """

    first: float
    turns: int = 0
    virtual: Point | None = None
    hit: float = math.inf
    left: tuple[float, ...] = ()

    @property
    def heading(self) -> float:
        """Where it is headed, radians."""
        return self.first + self.turns * TURN


@dataclass(frozen=True)
class BcvStyle(Reactive[BcvMemory]):
    """
    Lets behaviours vote for a heading at each step, and heads for a virtual goal where they would get stuck.

    Public: of Wu, Zheng and Cai's real-time planner (2011), "coordination of global and local behaviours" and the
    virtual goal are known by name, and that it "suffers from local minima"; the text and its code are not public.
    This is not the original, but a planner in its style.

    Our design: three behaviours prefer headings. To the target, with weight 1; away from each known threat within
    ``avoid_spreads * spread + 0.04``, with a weight that rises from 0 at that distance to 1 at its centre, squared;
    straight on, with 0.2. Of the headings that a turn of at most a right angle reaches, in steps of pi / 16, the
    one with the greatest sum of weighted cosines wins, less `risk_aversion` times the mean ``F`` over the next 0.1,
    or as far as the target is. Headings that a no-fly area closes there, or that leave the bounds with the next
    step, do not take part. Where none is left, areas beyond the next step are ignored, and then the limit of the
    turn.

    Where the goal is blocked (``F`` above 0.5, or an area in the way, over the next 0.15), or 20 steps brought less
    than half of what they could, a virtual goal is put 0.2 away: at the least of 30, 60, … 150 degrees off the goal on
    whose ray ``F`` stays below 0.2, on the side that takes less turning in total since the start. It is given up once
    it is 0.04 near, or once the goal is in free sight again and nearer than where the course was left. All distances
    are in shorter sides of the map. It weighs risk by `risk_aversion`, not by ``k``.

    Known failures: it circles in U-shaped traps deeper than its virtual goals reach, it skirts the rims of threats,
    which keeps it exposed for long, and it chooses its side from local information alone.

    `Solution.evaluations` counts the points at which ``F`` was computed.

    Attributes
    ----------
    step, max_steps, patience
        As of all reactive planners (`Reactive`).
    risk_aversion
        What a heading loses for each unit of mean ``F`` ahead; 0 judges by the behaviours alone.
    avoid_spreads
        Within how many spreads, and 0.04 more, a threat repels.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> answer = BcvStyle().solve(problem)
    >>> bool(problem.field.density(answer.path).max() < 0.1)
    True
    """

    risk_aversion: NonNegative = 5.0
    avoid_spreads: NonNegative = 3.0

    traits: ClassVar[Traits] = reactive_traits(
        "bcv-style", "behaviours and virtual goals, in the style of Wu et al. 2011"
    )

    def begin(self, around: Surroundings) -> BcvMemory:
        """Head for the goal."""
        start = around.problem.start
        return BcvMemory(start, first=around.goal_heading(start))

    def choose(self, around: Surroundings, memory: BcvMemory) -> BcvMemory:
        """Look after the virtual goal, let the behaviours vote, and go."""
        memory = _with_target(around, memory)
        turns = self._best_turn(around, memory)
        after = replace(memory, turns=memory.turns + turns)
        position = around.spot_ahead(memory.position, after.heading, around.step)
        left = (*memory.left, math.dist(position, _target(around, memory)))
        return replace(after, position=position, left=left[-STALL_STEPS - 1 :])

    def _best_turn(self, around: Surroundings, memory: BcvMemory) -> int:
        """Return the turn with the highest score, in steps of pi / 16; the smaller one of two as good, then left."""
        to_target = math.dist(memory.position, _target(around, memory))
        look = max(min(LOOK * around.side, to_target), around.step)
        ahead = np.array(sorted(range(-MOST_TURNS, MOST_TURNS + 1), key=lambda k: (abs(k), -k)))
        behind = np.array([k for n in range(MOST_TURNS + 1, 17) for k in (n, -n)][:-1])
        for tried, distance in ((ahead, look), (ahead, around.step), (behind, around.step)):
            turns = tried[_open(around, memory, tried, distance)]
            if len(turns):
                headings = _headings(memory, turns)
                scores = _votes(around, memory, headings, self.avoid_spreads)
                if self.risk_aversion > 0.0:
                    scores -= self.risk_aversion * around.risk_on_rays(memory.position, headings, look).mean(axis=1)
                return int(turns[np.argmax(scores)])
        msg = "every heading is closed by a no-fly area or the bounds"
        raise Stuck(msg)


def _target(around: Surroundings, memory: BcvMemory) -> Point:
    return around.problem.goal if memory.virtual is None else memory.virtual


def _headings(memory: BcvMemory, turns: IntArray) -> FloatArray:
    headings: FloatArray = memory.first + (memory.turns + turns).astype(np.float64) * TURN
    return headings


def _open(around: Surroundings, memory: BcvMemory, turns: IntArray, distance: float) -> BoolArray:
    """Tell which turns no area closes so far ahead, nor the bounds one step ahead, shape ``(n,)`` each."""
    headings = _headings(memory, turns)
    ends = around.ahead(memory.position, headings, distance)
    starts = np.broadcast_to(memory.position, ends.shape)
    one_step = around.is_open(memory.position, around.ahead(memory.position, headings, around.step))
    return one_step & ~around.problem.model.area.crosses(starts, ends)


def _votes(around: Surroundings, memory: BcvMemory, headings: FloatArray, avoid_spreads: float) -> FloatArray:
    """Add up the votes of the behaviours for headings, shape ``(n,)`` each."""
    here = memory.position
    votes: FloatArray = SEEK * np.cos(headings - bearing(here, _target(around, memory)))
    votes += KEEP * np.cos(headings - memory.heading)
    for threat in around.problem.field.threats:
        reach = avoid_spreads * threat.spread + AVOID_MARGIN * around.side
        centre = (threat.x, threat.y)
        distance = math.dist(here, centre)
        if 0.0 < distance < reach:
            away = bearing(centre, here)
            votes += (1.0 - distance / reach) ** 2 * np.cos(headings - away)
    return votes


def _with_target(around: Surroundings, memory: BcvMemory) -> BcvMemory:
    """Drop a virtual goal that is reached or no longer needed, and place one where the planner is blocked or stalls."""
    here, to_goal = memory.position, around.to_goal(memory.position)
    (highest,), (open_,) = _sight(
        around, here, np.array([around.goal_heading(here)]), min(SIGHT * around.side, to_goal)
    )
    if memory.virtual is not None:
        in_sight = open_ and highest < FREE and to_goal < memory.hit
        if in_sight or math.dist(here, memory.virtual) <= REACHED * around.side:
            memory = replace(memory, virtual=None, left=())
    blocked = not open_ or highest > BLOCKED
    if _stalls(around, memory) or (memory.virtual is None and blocked):
        virtual = _virtual_goal(around, memory)
        hit = to_goal if memory.virtual is None else memory.hit
        # without a place for one the behaviours go on alone, for as long again
        return replace(memory, virtual=virtual, hit=hit if virtual else math.inf, left=())
    return memory


def _stalls(around: Surroundings, memory: BcvMemory) -> bool:
    """Tell whether the last steps brought too little towards the target."""
    if len(memory.left) <= STALL_STEPS:
        return False
    return memory.left[0] - memory.left[-1] < STALL_PART * STALL_STEPS * around.step


def _sight(around: Surroundings, here: Point, headings: FloatArray, distance: float) -> tuple[FloatArray, BoolArray]:
    """Return the greatest known ``F`` on rays, and whether they are open, shape ``(n,)`` each."""
    highest: FloatArray = around.risk_on_rays(here, headings, distance).max(axis=1)
    return highest, around.is_open(here, around.ahead(here, headings, distance))


def _virtual_goal(around: Surroundings, memory: BcvMemory) -> Point | None:
    """Find the free place at the least angle off the goal; of two, the one that takes less turning since the start."""
    goal_heading = around.goal_heading(memory.position)
    off = np.array([sign * angle for angle in ANGLES for sign in (1.0, -1.0)])
    headings = goal_heading + off
    highest, open_ = _sight(around, memory.position, headings, VIRTUAL * around.side)
    turned = memory.turns * TURN
    found = [
        (abs(angle), abs(turned + wrapped(heading - memory.heading)), -angle, number)
        for number, (angle, heading) in enumerate(zip(off.tolist(), headings.tolist(), strict=True))
        if open_[number] and highest[number] < FREE
    ]
    if not found:
        return None
    *_, number = min(found)
    return around.spot_ahead(memory.position, float(headings[number]), VIRTUAL * around.side)
