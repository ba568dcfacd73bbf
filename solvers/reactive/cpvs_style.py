"""Fuzzy steering from sub-goal to sub-goal, through the gaps between threats: in the style of CPVS."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
import shapely

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import reactive_traits
from cgla_graph.solvers.reactive.fuzzy_steering import EDGE, FuzzyMemory, FuzzySteering
from cgla_graph.solvers.reactive.step_by_step import Surroundings

#: A straight way with more risk than this anywhere is blocked.
BLOCKED = 0.3
#: Sub-goals are so far outside a threat's contour of three spreads, or outside a no-fly area (over the shorter side of
#: the map), and count as reached from so near.
OUTER = math.exp(-4.5)
MARGIN, NEAR = 0.03, 0.05
#: Steps between the last change of the queue and the next sub-goal: without them, sub-goals come and go.
HYSTERESIS = 10
#: A sub-goal that is not reached in so many steps is given up.
GIVE_UP = 150
#: Sub-goals in the queue, at most.
MOST_SUBGOALS = 5
#: Distance between samples of the risk on a line, over the shorter side of the map.
SPACING = 0.01
#: Samples on a line, at most: on maps many times as long as wide they are further apart.
MOST_SAMPLES = 2000


@dataclass(frozen=True)
class SubgoalMemory(FuzzyMemory):
    """
    Memory of the planner, beside that of the steering.

    Attributes
    ----------
    queue
        Sub-goals, the next one first, map units.
    since
        Steps since the queue last changed.
    tried
        The sub-goals set since the goal was last nearer than ever before, map units.
    nearest
        How near that was, map units.
    """

    queue: tuple[Point, ...] = ()
    since: int = HYSTERESIS
    tried: tuple[Point, ...] = ()
    nearest: float = math.inf


@dataclass(frozen=True)
class CpvsStyle(FuzzySteering[SubgoalMemory]):
    """
    Fuzzy steering from sub-goal to sub-goal, in the style of CPVS (cooperative planning by virtual sub-goals).

    Of the original (Zhao, Zheng, Liu, Cai and Lin, 2011), only the summary in the paper on CGLA is public:
    virtual sub-goals are embedded in the feedback-based compositional rule of inference, and the planning is
    cooperative. This is **not** the original.

    Steering is that of `FbcriStyle`; the sub-goals are our design. Where the straight way to the goal, or to the next
    sub-goal, meets a risk above 0.3 or a no-fly area, the best of these places is the next sub-goal: one beside each
    threat, 0.03 of the side outside its contour of three spreads; the middle of each gap between a threat in the way
    and another one; a place off each corner of a no-fly area. Best is the least ``|pq| + |qg| + k * risk(p to q to g)``
    from here `p` over `q` to where it wants to get `g`, among those that can be flown to straight and are not risky
    themselves. A sub-goal is dropped within 0.05 of the side of it, where the straight way to the next one or the goal
    clears, where it turns out risky, or after 150 steps; ten steps pass before another one is set.

    Cooperation comes from the mission: UAVs that share threats plan on all known threats, and others are threats
    where it has virtual obstacles. The original's UAVs may also agree on their sub-goals; a solver of a mission cannot
    ask for the plans of others, so that two UAVs may choose the same gap.

    Known failures: a choice of the nearest gap that leads nowhere, as nothing looks beyond the next sub-goal; an area
    none of whose corners is in sight, where only the virtual targets of FBCRI help; sub-goals that come and go as more
    threats become known. `Solution.evaluations` counts points of ``F``, and one for each line to a sub-goal weighed.

    Source: Zhang, Mao, Liu and Liu, Automatica 50(3), 2014, Section 5.2; for the steering see `FbcriStyle`.

    Attributes
    ----------
    step, max_steps, patience
        As in `Reactive`.
    sight, tolerance, stall
        As in `FuzzySteering`.
    onward
        Whether the risk of the straight way onward from a sub-goal counts in its choice, as well as that of the way
        to it. Nothing public says which; without it, on 60 random maps, paths have 1.5 times the risk, are 6 % longer
        and take as long to plan.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> wall = shapely.box(0.49, 0.2, 0.51, 1.0)
    >>> problem = Problem((0.1, 0.7), (0.9, 0.7), no_fly=wall)
    >>> solution = CpvsStyle().solve(problem)
    >>> solution.status.label, bool(problem.evaluate(solution.path).length < 1.4)
    ('found', True)
    """

    onward: bool = True

    traits: ClassVar[Traits] = reactive_traits("cpvs-style", "fuzzy rules from sub-goal to sub-goal (not the original)")

    def begin(self, around: Surroundings) -> SubgoalMemory:
        """Face the goal."""
        return SubgoalMemory.at_start(around)

    def choose(self, around: Surroundings, memory: SubgoalMemory) -> SubgoalMemory:
        """Bring the queue of sub-goals up to date, and steer to the first."""
        queue, since, tried = memory.queue, memory.since + 1, memory.tried
        left = around.to_goal(memory.position)
        if left < memory.nearest:
            tried = ()
        kept = _kept(around, memory.position, queue, since)
        if kept != queue:
            queue, since = kept, 0
        aim = queue[0] if queue else around.problem.goal
        if since >= HYSTERESIS and len(queue) < MOST_SUBGOALS and not _is_clear(around, memory.position, aim):
            found = self._subgoal(around, memory.position, aim, tried)
            if found is not None:
                queue, since, aim, tried = (found, *queue), 0, found, (*tried, found)
        nearest = min(left, memory.nearest)
        # a longer wait makes no other steps, so that equal states are recognised
        since = min(since, GIVE_UP)
        return self.steer(around, replace(memory, queue=queue, since=since, tried=tried, nearest=nearest), aim)

    def _subgoal(self, around: Surroundings, here: Point, aim: Point, tried: tuple[Point, ...]) -> Point | None:
        """Return the best next sub-goal; None if no place qualifies."""
        places = np.vstack([_beside_threats(around, here, aim), _off_corners(around)])
        if not len(places):
            return None
        taken = np.array([here, *tried])
        apart = np.hypot(*(places[:, None, :] - taken).transpose(2, 0, 1)).min(axis=1)
        far = apart > max(NEAR * around.side, 2.0 * around.step)
        places = places[far & around.is_open(here, places)]
        places = places[around.risk(places) <= BLOCKED]
        if not len(places):
            return None
        around.evaluations += len(places)
        problem = around.problem
        lengths = np.hypot(*(places - here).T) + np.hypot(*(places - aim).T)
        risks = problem.field.line_integral(np.asarray(here), places)
        if self.onward:
            around.evaluations += len(places)
            risks += problem.field.line_integral(places, np.asarray(aim))
        costs = lengths + problem.k * risks
        x, y = places[int(costs.argmin())].tolist()
        return x, y


def _kept(around: Surroundings, here: Point, queue: tuple[Point, ...], since: int) -> tuple[Point, ...]:
    """Return the queue without the sub-goals that are reached, no longer needed, risky or out of reach."""
    if queue and since >= GIVE_UP:
        queue = queue[1:]
    for later in range(len(queue), 0, -1):
        after = queue[later] if later < len(queue) else around.problem.goal
        if _is_clear(around, here, after):
            return queue[later:]
    while queue:
        near = math.dist(here, queue[0]) <= max(NEAR * around.side, 2.0 * around.step)
        if not near and around.risk(np.array(queue[:1]))[0] <= BLOCKED:
            break
        queue = queue[1:]
    return queue


def _is_clear(around: Surroundings, here: Point, there: Point) -> bool:
    """Tell whether the straight way is free of areas and of much risk."""
    if not around.is_open(here, np.array([there]))[0]:
        return False
    samples = min(2 + math.ceil(math.dist(here, there) / (SPACING * around.side)), MOST_SAMPLES)
    parts = np.linspace(0.0, 1.0, samples)[:, None]
    risks = around.risk((1.0 - parts) * here + parts * there)
    # risk at an end cannot be flown around
    return bool(risks.max() <= max(BLOCKED, risks[0], risks[-1]))


def _beside_threats(around: Surroundings, here: Point, aim: Point) -> FloatArray:
    """Return the places left and right of threats, and in the gaps beside those in the way, shape ``(n, 2)``."""
    field = around.problem.field
    outer, inner = field.contour_radii(OUTER), field.contour_radii(EDGE)
    felt = outer > 0.0
    centres, outer, inner = field.centres[felt], outer[felt], inner[felt]
    offset = (outer + MARGIN * around.side)[:, None] * _normal(here, aim)
    return np.vstack(
        [centres + offset, centres - offset, _gaps(centres, inner, _in_the_way(centres, inner, here, aim))]
    )


def _gaps(centres: FloatArray, edges: FloatArray, in_the_way: BoolArray) -> FloatArray:
    """Return the middles of the gaps between the edges of two threats, one of them in the way, shape ``(n, 2)``."""
    first, second = np.nonzero(np.triu(in_the_way[:, None] | in_the_way[None, :], 1))
    between = centres[second] - centres[first]
    distance = np.hypot(*between.T)
    is_gap = distance > edges[first] + edges[second]
    first, second, between, distance = first[is_gap], second[is_gap], between[is_gap], distance[is_gap]
    middle = 0.5 * (distance + edges[first] - edges[second])
    middles: FloatArray = centres[first] + (middle / distance)[:, None] * between
    return middles


def _in_the_way(centres: FloatArray, edges: FloatArray, here: Point, aim: Point) -> BoolArray:
    """Tell which discs the segment from here to the aim meets."""
    way = np.subtract(aim, here)
    along = np.clip((centres - here) @ way / (way @ way), 0.0, 1.0)
    met: BoolArray = np.hypot(*(np.asarray(here) + along[:, None] * way - centres).T) < edges
    return met


def _normal(here: Point, aim: Point) -> FloatArray:
    """Return the direction to the left of the way to an aim."""
    east, north = np.subtract(aim, here)
    normal: FloatArray = np.array([-north, east]) / math.hypot(east, north)
    return normal


def _off_corners(around: Surroundings) -> FloatArray:
    """Return places off the corners of the no-fly areas, shape ``(n, 2)``."""
    area = around.problem.model.area
    if area.is_empty:
        return np.empty((0, 2))
    corners: FloatArray = shapely.get_coordinates(
        area.geometry.buffer(MARGIN * around.side, join_style="mitre", mitre_limit=2.0)
    )
    return corners
