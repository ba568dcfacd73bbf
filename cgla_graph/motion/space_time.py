"""Planning in space and time: a trajectory of one UAV that keeps its distance from committed trajectories."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import TypeAlias, cast

import numpy as np

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph._validate import finite_number, fixed, non_negative_number, positive_number
from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import COST_TOLERANCE, Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS
from cgla_graph.motion import space_time_kernels
from cgla_graph.motion.space_time_kernels import (
    ARRIVED,
    COST,
    EXHAUSTED,
    NODE,
    PARENT,
    SAME_TIME,
    TIME,
    Limits,
    Map,
    Motions,
)
from cgla_graph.motion.trajectory import Trajectory, least_distance

#: Trajectories, and the distance to keep from each, map units.
Others: TypeAlias = Sequence[tuple[Trajectory, float]]

#: Excess of plans over the separation, relative to it, so that no later check finds less by rounding.
MARGIN = 1e-9
#: Upper bound of the rounding of a position or time, relative to the greatest.
ROUNDING = 32.0 * np.finfo(np.float64).eps
#: Two costs closer than this, relative to them, are equal.
SAME_COST = 1e-12
#: Arrivals at a node closer in time than this count as one, which keeps a search small; ticks. At 0, the search is
#: exact.
WINDOW = 0.25
#: States whose moves are tried before a search gives up.
MOST_EXPANSIONS = 20_000


class SpaceTimeStatus(Enum):
    """How planning in space and time ended; the value is the sentence."""

    OPTIMAL = "the plan costs least of all over the moves considered"
    FOUND = "a plan was found"
    NO_PLAN = "no plan over the moves considered keeps the separation and arrives in time"
    NOT_FOUND = "no plan was found; one may exist"
    TOO_CLOSE = "the start is already closer to another than the separation"
    NO_PATH = "no path exists on the graph, even without the others"


@dataclass(frozen=True)
class SpaceTimePlan:
    """
    The result of planning in space and time.

    Attributes
    ----------
    status
        How the search ended.
    trajectory
        From the start, at the start time, to the goal; None without a plan.
    cost
        Cost of the path, by `Problem.evaluate`, plus that of waiting; map units, infinite without a plan.
    lower_bound
        No plan over the moves considered costs less; map units. Infinite: there is provably none.
    expansions
        States whose moves were tried; 0 if the path without others was free.
    message
        Details, in one line.
    """

    status: SpaceTimeStatus
    trajectory: Trajectory | None = None
    cost: float = math.inf
    lower_bound: float = 0.0
    expansions: int = 0
    message: str = ""


def plan_in_space_time(
    problem: Problem,
    matrix: CostMatrix,
    others: Others,
    *,
    start_time: float,
    step: float,
    latest: float,
    names: Sequence[str] = (),
) -> SpaceTimePlan:
    r"""
    Plan a flight that keeps its distance from other trajectories, at every moment and not only at whole ticks.

    The moves considered: fly straight along an edge at constant speed, or wait at a node for a tick. A UAV that waits
    circles there, which costs :math:`s\,(1 + k F(p))` a tick for a step ``s``, as flying would; the separation holds
    for the centre of the circle. The start is a node too. At the goal, the UAV is removed.

    The search is A* over pairs of node and time of arrival: prioritized planning (Erdmann and Lozano-Perez 1987; Silver
    2005) for one UAV. ``f = g + G(node)`` with the cost matrix ``G`` is exact without the others, so that the path
    without others is the answer if it is free. If several UAVs plan one after the other, each around the committed
    trajectories of all others, every pair keeps its separation.

    A plan keeps the separations. `lower_bound` holds for all plans over the moves considered; the status is ``OPTIMAL``
    if the plan reaches it, and ``NO_PLAN`` if the search proved that there is none. Arrivals at a node less than
    `WINDOW` apart count as one; the first free arrival that is left out gives the bound.

    Parameters
    ----------
    problem
        Start, goal, and the oracle of the plan.
    matrix
        The cost matrix towards the goal, on a graph of the same field, k and no-fly area, such as that of
        ``problem.on_lattice(20)``. The start need not be one of its nodes.
    others
        Committed trajectories, and the distance to keep from each: at least 0, map units.
    start_time
        Start of the flight, ticks.
    step
        Map units flown in a tick, above 0.
    latest
        Latest end of the flight, ticks.
    names
        What messages call the others; default: ``trajectory 0``, ``trajectory 1``, ….

    Returns
    -------
    plan
        Status, trajectory, cost and a bound.

    Raises
    ------
    ProblemError
        If a setting is malformed, the matrix does not belong to the problem, or the risk field has peaks above 1, where
        waiting might earn.

    Examples
    --------
    Two fly towards each other on one line. The second one evades the first and arrives later than alone.

    >>> from cgla_graph.cost_to_go.cost_matrix import cost_matrix
    >>> problem = Problem(start=(1, 0.5), goal=(0, 0.5))
    >>> graph = problem.on_lattice(11)
    >>> first = Trajectory.along([(0, 0.5), (1, 0.5)], start_time=0, step=0.05)
    >>> matrix = cost_matrix(graph.graph, graph.target)
    >>> plan = plan_in_space_time(problem, matrix, [(first, 0.1)], start_time=0, step=0.05, latest=100)
    >>> round(plan.cost, 3), least_distance(plan.trajectory, first)[0] >= 0.1
    (1.077, True)
    """
    _check(problem, matrix)
    limits = Limits(
        finite_number("start_time", start_time),
        finite_number("latest", latest),
        positive_number("step", step),
        WINDOW,
        MOST_EXPANSIONS,
    )
    area, alone = _map(problem, matrix, limits.step)
    crowd, crowded = _crowd(problem.start, others, limits, float(np.abs(area.positions).max()), names)
    if crowded:
        return SpaceTimePlan(SpaceTimeStatus.TOO_CLOSE, lower_bound=math.inf, message=crowded)
    least = float(area.to_goal[area.start])
    if not math.isfinite(least):
        message = f"no path on the graph leads from {problem.start} to {problem.goal} around the no-fly area"
        return SpaceTimePlan(SpaceTimeStatus.NO_PATH, lower_bound=math.inf, message=message)
    flight = Trajectory.along(area.positions[alone], limits.start_time, limits.step)
    if (
        area.usable[alone].all()
        and flight.ends <= limits.latest + SAME_TIME
        # copies, because the search calls the same kernel with arrays of its own, which are not read-only
        and not space_time_kernels.too_near(flight.times.copy(), flight.points.copy(), crowd)
    ):
        return _judged(problem, flight, limits.step, least, least, "the way without the others is free")
    outcome, state, n_expansions, bound, moments, states = space_time_kernels.search(area, limits, crowd)
    if outcome == ARRIVED:
        flight, claimed = _flight(area, state, moments, states), float(moments[state, COST])
        message = f"{claimed / least - 1.0:.2%} more expensive than without the others" if least > 0.0 else ""
        return replace(_judged(problem, flight, limits.step, claimed, bound, message), expansions=n_expansions)
    status, message = SpaceTimeStatus.NOT_FOUND, f"gave up after {n_expansions} expansions"
    if outcome == EXHAUSTED:
        message = f"nothing is left to try, but arrivals less than {WINDOW:g} ticks apart counted as one"
        if math.isinf(bound):
            status, message = SpaceTimeStatus.NO_PLAN, f"tried all that arrives by tick {limits.latest:g}"
    return SpaceTimePlan(status, lower_bound=bound, expansions=n_expansions, message=message)


def _check(problem: Problem, matrix: CostMatrix) -> None:
    """Refuse a matrix of another problem, and a field that breaks the search."""
    graph, remedy = matrix.graph, "compute it on a graph of the problem, such as problem.on_lattice(20).graph"
    if not problem.field.is_proper:
        msg = f"the risk field has peaks above 1: {NEGATIVE_WEIGHTS}; lower them"
        raise ProblemError(msg)
    if graph.positions is None or graph.model != problem.model:
        msg = f"the cost matrix is of another field, k or no-fly area than the problem; {remedy}"
        raise ProblemError(msg)
    if tuple(graph.positions[matrix.target].tolist()) != problem.goal:
        msg = f"the cost matrix leads to {graph.positions[matrix.target].tolist()}, not to {problem.goal}; {remedy}"
        raise ProblemError(msg)


def _map(problem: Problem, matrix: CostMatrix, step: float) -> tuple[Map, IntArray]:
    """Return the nodes of the search, the start among them, and the indices of the path without others."""
    graph, to_goal, model = matrix.graph, matrix.values, problem.model
    positions = cast("FloatArray", graph.positions)
    width, height = graph.lattice_shape
    if (at_start := graph.node_at(problem.start)) is not None:
        start = first = graph.index_of(at_start)
        alone = []
    else:
        start = len(positions)
        positions = np.vstack([positions, problem.start])
        through = model.row(positions, start, (width, height))[:-1] + to_goal
        to_goal = np.append(to_goal, through.min())
        first = int(through.argmin())
        alone = [start]
    alone += [graph.index_of(label) for label in matrix.path_from(graph.labels[first])]
    x_min, y_min, x_max, y_max = problem.bounds
    usable = np.asarray(((positions >= (x_min, y_min)) & (positions <= (x_max, y_max))).all(axis=1))
    weights = np.empty((0, 0)) if graph.is_implicit else graph.weight_matrix()
    waiting = step * (1.0 + problem.k * problem.field.density(positions))
    where = (fixed(positions), fixed(usable), fixed(weights), width, height)
    costs = (model.kernel_model(), fixed(to_goal), fixed(waiting))
    return Map(*where, *costs, start, matrix.target), np.array(alone, dtype=np.int64)


def _crowd(start: Point, others: Others, limits: Limits, farthest: float, names: Sequence[str]) -> tuple[Motions, str]:
    """
    Join the other trajectories, and return a message if one of them is too close to the start.

    The distance to keep is a little more than the separation, but no more than the distance at the start, so that a UAV
    that starts at just its separation may fly.
    """
    here = Trajectory(np.array([limits.start_time]), np.array([start]))
    keep = np.empty(len(others))
    for number, (other, given) in enumerate(others):
        name = names[number] if number < len(names) else f"trajectory {number}"
        separation = non_negative_number(f"the separation from {name}", given)
        reach = max(farthest, float(np.abs(other.points).max()))
        reach += limits.step * max(abs(limits.start_time), abs(limits.latest))
        # a separation of 0 lets both be in one place
        keep[number] = separation * (1.0 + MARGIN) + ROUNDING * reach if separation > 0.0 else 0.0
        now, _ = least_distance(here, other)
        if now < separation:
            message = f"at tick {limits.start_time:g} {name} is {now:.9g} away, not {separation:g}"
            return _joined([], keep[:0]), message
        keep[number] = min(keep[number], now)
    return _joined([other for other, _ in others], keep), ""


def _joined(trajectories: list[Trajectory], keep: FloatArray) -> Motions:
    """Join the arrays of several trajectories."""
    first = np.concatenate([[0], np.cumsum([len(each.times) for each in trajectories], dtype=np.int64)])
    times = np.concatenate([np.empty(0), *(each.times for each in trajectories)])
    points = np.concatenate([np.empty((0, 2)), *(each.points for each in trajectories)])
    return first.astype(np.int64), times, points, keep


def _flight(area: Map, state: int, moments: FloatArray, states: IntArray) -> Trajectory:
    """Follow the states back from the goal; several ticks of waiting in a row become one piece."""
    chain = []
    while state >= 0:
        chain.append(state)
        state = int(states[state, PARENT])
    chain.reverse()
    nodes = states[chain, NODE]
    kept = np.ones(len(nodes), dtype=np.bool_)
    kept[1:-1] = (nodes[1:-1] != nodes[:-2]) | (nodes[1:-1] != nodes[2:])
    return Trajectory(moments[chain, TIME][kept], area.positions[nodes[kept]])


def _judged(
    problem: Problem, flight: Trajectory, step: float, claimed: float, bound: float, message: str
) -> SpaceTimePlan:
    """Return the plan with the cost of the oracle."""
    moves = np.append(True, (np.diff(flight.points, axis=0) != 0.0).any(axis=1))
    judged = problem.evaluate(flight.points[moves])
    circled = (ticks * float(1.0 + problem.k * problem.field.density(place)) for place, ticks in flight.waits)
    cost = judged.cost + step * math.fsum(circled)
    if judged.violations or abs(cost - claimed) > COST_TOLERANCE * cost + 1e-12:
        wrong = "; ".join(judged.violations) or f"a flight costs {cost:.9g} by the problem, {claimed:.9g} by the matrix"
        msg = f"the weights of the cost matrix are not those of the problem: {wrong}"
        raise ProblemError(msg)
    proven = bound >= claimed * (1.0 - SAME_COST)
    status = SpaceTimeStatus.OPTIMAL if proven else SpaceTimeStatus.FOUND
    return SpaceTimePlan(status, flight, cost, min(bound, cost), message=message)
