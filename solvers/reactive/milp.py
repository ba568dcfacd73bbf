"""Receding-horizon planning by mixed-integer linear programming."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Count, Positive, Whole, reactive_traits, settings_of
from cgla_graph.solvers.geometry import around_circle
from cgla_graph.solvers.reactive.milp_map import CornerGraph, corner_graph, obstacles_of
from cgla_graph.solvers.reactive.milp_model import SHADOW, Horizon, best_plan
from cgla_graph.solvers.reactive.step_by_step import Memory, Reactive, Stuck, Surroundings

#: The length of a leg, over the shorter side of the map: three of the paper's steps.
REACH = 0.06
#: Directions from the UAV in which plans may end, at the same distance.
DIRECTIONS = 32
#: That distance, over the length of all legs: the rest is for bends.
ROOM = 0.85
#: Points of a plan that are nearer than this to each other, relative to a leg, are one.
SAME = 1e-6


@dataclass(frozen=True)
class MilpMemory(Memory):
    """
    The rest of the plan.

    Attributes
    ----------
    ahead
        The waypoints to come before the next plan, map units.
    known
        The map that the plan was made on: another one calls for another plan.
    """

    ahead: tuple[Point, ...] = ()
    known: CostModel | None = None


@dataclass(frozen=True)
class Milp(Reactive[MilpMemory]):
    """
    Plans a few legs by a mixed-integer linear program, flies the first of them, and plans again.

    **Public of the original.** Schouwenaars, De Moor, Feron and How (ECC 2001) keep a vehicle out of polygons by
    binaries, one a side, of which one at least must hold ("big M"), and bound its speed by a polygon. Bellingham,
    Richards and How (ACC 2002) plan over a receding horizon, with a cost-to-go beyond it from a visibility graph of
    the obstacles' corners. Their code, vehicle models and maps are not public: this is *in the style of* theirs, with
    a path instead of a vehicle that has momentum.

    **Our design.** A threat is an octagon around the disc outside of which it adds less than 0.1 to the cost of a unit
    of length. Going into it is not forbidden but paid for, by a convex piecewise linear function (three pieces) of the
    depth, near the Gaussian; so a threat that comes up around the UAV leaves it a plan. No-fly areas are hard:
    triangles, unless they are convex. Both ends of a leg are beyond the same side of each obstacle, so that legs cut no
    corners. A plan ends at one of a few places, which the program chooses: the best of 32 at the same distance all
    around, and two on the best way along the graph of all corners, weighed by Eq. 5, which also says what it costs to
    go on from there. HiGHS stops at a gap or a number of nodes, not at a time, so that a map gives the same path on
    every machine. Where it has no plan by then, or has more than 100 binaries, the best way on the graph of corners is
    flown instead; the message of the solution says how often.

    **Known failure modes.** Risk is rated along straight legs by their deepest point, and adds up where threats
    overlap: the path keeps farther from threats than it should. It bends at most once a leg, and sees no farther than
    its legs reach: beyond, it believes the graph of corners. Gaps narrower than 2e-5 of the map count as closed,
    and of threats that narrow only the graph of corners knows. Time rises steeply with `legs`, and with threats that
    overlap within their reach.

    `Solution.evaluations` counts the segments weighed for the graph of corners.

    Attributes
    ----------
    step, max_steps, patience
        As in `Reactive`.
    legs
        The horizon.
    reach
        How long a leg may be, map units; None: 0.06 of the shorter side of the map.
    execute
        How many legs are flown before the next plan, at most `legs`.
    places
        How many ends of the path the program has to choose from.
    gap
        The solver may stop when it knows that its plan is at most so much more expensive than the best one, over the
        shorter side of the map. (The cost of the best path on the graph of corners makes that relative, as HiGHS wants
        it.)
    nodes
        The solver stops after so many nodes of its search tree.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> answer = Milp().solve(problem)
    >>> answer.status.label, 1.35 < answer.cost < 1.5
    ('found', True)
    """

    legs: Annotated[int, Whole(1, 100)] = 3
    reach: Positive | None = None
    execute: Count = 2
    places: Count = 8
    gap: Positive = 0.01
    nodes: Count = 50

    traits: ClassVar[Traits] = reactive_traits("milp", "receding horizon by mixed-integer programming")

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        with settings_of(self.traits.name):
            Whole(1, self.legs)("execute", self.execute)

    def begin(self, around: Surroundings) -> MilpMemory:
        """Begin without a plan."""
        return MilpMemory(around.problem.start)

    def choose(self, around: Surroundings, memory: MilpMemory) -> MilpMemory:
        """Follow the plan; make one if there is none, or it was made on another map, or is closed now."""
        known, ahead = around.problem.model, memory.ahead
        if not ahead or known != memory.known or not around.is_open(memory.position, np.array(ahead[:1]))[0]:
            ahead = self._plan(around, memory.position)
        (x, y), (east, north) = memory.position, ahead[0]
        left = math.dist(memory.position, ahead[0])
        if left <= around.step:
            return MilpMemory(ahead[0], ahead[1:], known)
        part = around.step / left
        return MilpMemory((x + part * (east - x), y + part * (north - y)), ahead, known)

    def remark(self, counts: Mapping[str, int]) -> str:
        """Report how many plans are not the program's."""
        if not counts["fallbacks"]:
            return ""
        plans = f"{counts['fallbacks']} of {counts['plans']} plans follow the graph of corners"
        return f"{plans}: the program found none that can be flown, within {self.nodes} nodes and 100 binaries"

    def _plan(self, around: Surroundings, position: Point) -> tuple[Point, ...]:
        """Return the waypoints to fly before the next plan."""
        problem, here = around.problem, np.array([position])
        reach = REACH * around.side if self.reach is None else self.reach
        graph = corner_graph(problem.model, problem.bounds, problem.goal)
        onward = graph.onward(problem.model, here)[0]
        around.evaluations += len(onward)
        first = int(np.argmin(onward))
        if not math.isfinite(onward[first]):
            msg = "no way to the goal that is wider than 2e-5 of the map is known"
            raise Stuck(msg)
        route = np.vstack([here, graph.route(first)])
        gap = self.gap * around.side / (self.gap * around.side + float(onward[first]))
        around.counts["plans"] += 1
        for number, points in enumerate((self._solved(around, graph, route, reach, gap), route)):
            flown = _beginning(points, self.execute * reach, SAME * reach)
            if len(flown) > 1 and not problem.model.area.crosses(flown[:-1], flown[1:]).any():
                around.counts["fallbacks"] += number
                return tuple((float(x), float(y)) for x, y in flown[1:])
        msg = "no plan goes anywhere"
        raise Stuck(msg)

    def _solved(
        self, around: Surroundings, graph: CornerGraph, route: FloatArray, reach: float, gap: float
    ) -> FloatArray:
        """Solve the program of the next legs; return its path, shape ``(n, 2)``, map units, empty if it has none."""
        problem, unit, here = around.problem, around.side, route[0]
        leg = ROOM * reach * SHADOW
        places, costs = self._places(around, graph, route, self.legs * leg)
        # near the goal, legs that are not needed only make the search longer
        left = float(np.hypot(*np.diff(route, axis=0).T).sum())
        low, high = np.reshape(problem.bounds, (2, 2))
        horizon = Horizon(
            legs=min(self.legs, math.ceil(left / leg) + 1),
            reach=reach / unit,
            low=(low - here) / unit,
            high=(high - here) / unit,
            obstacles=[one.keep_out(here, unit) for one in obstacles_of(problem.model) if one.counts(low, high)],
            places=(places - here) / unit,
            costs_to_go=costs / unit,
        )
        plan = best_plan(horizon, gap=gap, nodes=self.nodes)
        return np.empty((0, 2)) if plan is None else np.clip(here + unit * plan.points, low, high)

    def _places(
        self, around: Surroundings, graph: CornerGraph, route: FloatArray, radius: float
    ) -> tuple[FloatArray, FloatArray]:
        """Return where a plan may end, shape ``(c, 2)``, and the cost to go from there, shape ``(c,)``, map units."""
        problem, here = around.problem, route[0]
        ahead = _beginning(route, radius, 0.0)[-1]
        if tuple(ahead) == problem.goal:
            return ahead[None], np.zeros(1)
        # around a corner with few legs, half the way may be as far as they reach
        sure = np.array([ahead, _beginning(route, 0.5 * radius, 0.0)[-1]])
        ring = np.vstack([sure, here + radius * around_circle(DIRECTIONS)])
        ring = ring[problem.in_bounds(ring) & ~problem.model.area.contains(ring)]
        costs = graph.onward(problem.model, ring).min(axis=1)
        around.evaluations += len(ring) * len(graph.places)
        rated = np.hypot(*(ring - here).T) + costs
        rated[: len(sure)] = 0.0
        best = np.argsort(rated, kind="stable")[: max(self.places, len(sure))]
        best = best[np.isfinite(costs[best])]
        return ring[best], costs[best]


def _beginning(points: FloatArray, length: float, same: float) -> FloatArray:
    """Return the first so much of a polyline, shape ``(n, 2)`` to ``(m, 2)``, without waypoints that are the same."""
    kept: list[FloatArray] = []
    for point in points:
        if not kept:
            kept.append(point)
            continue
        leg = math.dist(kept[-1], point)
        if leg >= length > 0.0:
            kept.append(kept[-1] + (length / leg) * (point - kept[-1]))
            break
        if leg > same:
            kept.append(point)
            length -= leg
    return np.array(kept)
