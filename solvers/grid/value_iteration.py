"""Exact value iteration: the limit of Q-Learning's values, and the reward at the goal that they need."""

import math
from dataclasses import dataclass, replace
from typing import Literal, TypeAlias

import numpy as np

from cgla_graph._text import shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import non_negative_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS
from cgla_graph.solvers.base import Between
from cgla_graph.solvers.grid import q_learning_kernels as kernels

Reward: TypeAlias = Literal["risk_aware", "node", "goal_only"]

#: `least_target_reward` is found up to this, relative to it and to the shorter side of the map.
REWARD_TOLERANCE = 1e-9
#: By how much a target reward that is too small is raised.
RAISE = 16.0


@dataclass(frozen=True, eq=False)
class DecisionProcess:
    """
    A deterministic decision process: the moves along a graph's edges, their rewards, and the target.

    The states are the graph's nodes, by index. The moves from state ``s`` are those numbered ``first[s]`` to
    ``first[s + 1] - 1``, by rising index of where they lead.

    Attributes
    ----------
    on
        The graph, the state to start from and the target.
    first
        Shape ``(n + 1,)``.
    heads
        Where each move leads, shape ``(m,)``.
    rewards
        What each move earns, shape ``(m,)``, without the target's reward.
    target_reward
        What a move into the target earns on top, at least 0.

    Examples
    --------
    >>> on = Problem(start=(0, 0), goal=(1, 0.5)).on_eight_connected(3)
    >>> process = decision_process(on)
    >>> process.n_moves, process.rewards[:3].round(3).tolist()
    (40, [-0.5, -0.5, -0.707])
    """

    on: GraphProblem
    first: IntArray
    heads: IntArray
    rewards: FloatArray
    target_reward: float = 0.0

    @property
    def n_states(self) -> int:
        """Number of states."""
        return len(self.first) - 1

    @property
    def n_moves(self) -> int:
        """Number of moves."""
        return len(self.heads)

    @property
    def source(self) -> int:
        """The state to start from."""
        return self.on.graph.index_of(self.on.source)

    @property
    def target(self) -> int:
        """The state in which episodes end."""
        return self.on.graph.index_of(self.on.target)

    @property
    def earned(self) -> FloatArray:
        """Rewards of the moves with the target's, shape ``(m,)``."""
        return self.rewards + np.where(self.heads == self.target, self.target_reward, 0.0)


def decision_process(on: GraphProblem, *, reward: Reward = "risk_aware", target_reward: float = 0.0) -> DecisionProcess:
    """
    Make the edges of a lattice the moves of a decision process.

    Parameters
    ----------
    on
        A problem laid on a lattice (`Problem.on_eight_connected`).
    reward
        What a move earns. ``risk_aware``: minus its cost, ``-(length + k * risk)``. ``node``: minus its length and
        minus `k` times the risk field's value where it leads, ``-length - k * F(s')``. ``goal_only``: nothing.
    target_reward
        What a move into the target earns on top, map units, at least 0.

    Returns
    -------
    process
        Its states are the nodes of the graph.

    Raises
    ------
    ProblemError
        If a move earns more than 0, as in an improper risk field, where endless circles may be best;
        or if the target's reward is below 0 or not finite.
    """
    target_reward = non_negative_number("target_reward", target_reward)
    edges = on.graph.to_csgraph()
    first, heads = edges.indptr.astype(np.int64), edges.indices.astype(np.int64)
    rewards = -np.asarray(edges.data, dtype=np.float64)
    if reward == "node":
        rewards = _by_node(on, first, heads)
    elif reward == "goal_only":
        rewards = np.zeros(len(heads))
    if (rewards > 0.0).any():
        msg = f"a move earns {rewards.max():g}, above 0: {NEGATIVE_WEIGHTS}"
        raise ProblemError(msg)
    return DecisionProcess(on, first, heads, rewards, target_reward)


def _by_node(on: GraphProblem, first: IntArray, heads: IntArray) -> FloatArray:
    positions, model = np.asarray(on.graph.positions), on.graph.model
    tails = np.repeat(np.arange(len(first) - 1), np.diff(first))
    rewards: FloatArray = -np.hypot(*(positions[heads] - positions[tails]).T)
    return rewards if model is None else rewards - model.k * model.field.density(positions)[heads]


@dataclass(frozen=True, eq=False)
class Values:
    """
    The solution of a decision process: the value of each state and of each move.

    Attributes
    ----------
    states
        V*, shape ``(n,)``; 0 at the target. Minus infinity where, without discount, the target cannot be reached, and
        where there is no move.
    moves
        Q*, shape ``(m,)``.
    rounds
        How often all states were backed up.
    """

    states: FloatArray
    moves: FloatArray
    rounds: int


def value_iteration(process: DecisionProcess, *, gamma: float = 1.0) -> Values:
    """
    Solve a decision process to the last bit: Bellman's equation, backed up until nothing changes.

    ``Q*(s, a) = r + gamma max_a' Q*(s', a')``, with nothing after the target. With ``gamma = 1`` values begin at minus
    infinity, are those of the best way to the target, and are found in as many rounds as the longest of these ways has
    moves; with costs as rewards they are minus the costs of Dijkstra's algorithm. With ``gamma < 1`` they begin at
    ``min(r) / (1 - gamma)``, a lower bound of all values; an endless circle may be worth more than the target; and it
    takes about ``36 / (1 - gamma)`` rounds.

    Parameters
    ----------
    process
        Rewards at most 0, but for the target's.
    gamma
        The discount, from 0 to 1.

    Returns
    -------
    values
        The fixpoint, exact up to the rounding of its sums.

    Raises
    ------
    ProblemError
        If gamma is not from 0 to 1.

    Examples
    --------
    >>> on = Problem(start=(0, 0), goal=(1, 0.5)).on_eight_connected(3)
    >>> values = value_iteration(decision_process(on))
    >>> round(float(-values.states[0]), 4)
    1.2071
    """
    gamma = Between(0.0, 1.0)("gamma", gamma)
    earned, target = process.earned, process.target
    lowest = -math.inf
    if gamma < 1.0:
        lowest = float(process.rewards.min(initial=0.0)) / (1.0 - gamma)
    states = np.full(process.n_states, lowest)
    states[np.diff(process.first) == 0] = -math.inf
    states[target] = 0.0
    moves = np.full(process.n_moves, -math.inf)
    rounds = kernels.iterate(process.first, process.heads, earned, target, gamma, states, moves)
    return Values(states, moves, rounds)


@dataclass(frozen=True)
class Rollout:
    """
    Where the best moves lead from the source.

    Attributes
    ----------
    states
        The states passed, by index, each once; the last one is the target, unless there is a circle.
    circle
        How many moves the circle has that is never left; 0: the target was reached, or there was no move.

    Examples
    --------
    >>> Rollout((4, 3, 7), circle=2).circle_from
    3
    """

    states: tuple[int, ...]
    circle: int = 0

    @property
    def circle_from(self) -> int:
        """The first state of the circle, or the last state."""
        return self.states[-max(self.circle, 1)]


def greedy(process: DecisionProcess, moves: FloatArray) -> Rollout:
    """
    Follow the move of greatest value, the first of equals, until the target or a state passed before.

    Parameters
    ----------
    process
        The decision process.
    moves
        The values of its moves, shape ``(m,)``.

    Returns
    -------
    rollout
        The way, and whether it ends in a circle.

    Examples
    --------
    >>> on = Problem(start=(0, 0), goal=(1, 0.5)).on_eight_connected(3)
    >>> process = decision_process(on)
    >>> greedy(process, value_iteration(process).moves)
    Rollout(states=(0, 1, 5), circle=0)
    """
    here, target = process.source, process.target
    # in the order in which they were passed
    passed = {here: 0}
    while here != target:
        move = kernels.best_move(process.first, moves, here)
        if move < 0:
            break
        here = int(process.heads[move])
        if here in passed:
            return Rollout(tuple(passed), circle=len(passed) - passed[here])
        passed[here] = len(passed)
    return Rollout(tuple(passed))


def least_target_reward(
    problem: Problem,
    *,
    gamma: float,
    reward: Literal["risk_aware", "node"] = "risk_aware",
    resolution: int | tuple[int, int] | Lattice = 20,
    corner_rule: CornerRule = "touch",
) -> float:
    """
    Find the least reward at the target for which the best moves lead there from the start (claim C25).

    With a discount, an endless circle through cheap places costs no more than ``cost of a move / (1 - gamma)``, and may
    be worth more than the way to the target; a reward there outweighs it, if it is large enough. The value of a way of
    ``n`` moves grows with the reward by ``gamma ** (n - 1)``, and no circle's value depends on it, so there is one
    such reward, found by bisection over exact value iteration. Without discount (``gamma = 1``) every circle costs
    infinitely much, and no reward is needed.

    Parameters
    ----------
    problem
        The problem; its risk field must be proper.
    gamma
        The discount, from 0 to 1.
    reward, resolution, corner_rule
        As in `decision_process` and `Problem.on_eight_connected`.

    Returns
    -------
    reward
        Map units: the best moves lead to the target for it, and do not for one smaller by `REWARD_TOLERANCE`. 0 where
        none is needed; infinite where none is enough: there is no path, or ``gamma ** (n - 1)`` vanishes.

    Raises
    ------
    ProblemError
        If gamma is not from 0 to 1, a move earns more than 0, or the reward is ``goal_only``, for which anything above
        0 is enough.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0), (1, 1), RiskField([Threat(1, 1, spread=0.2)]), k=10)
    >>> [round(least_target_reward(problem, gamma=gamma), 3) for gamma in (0.9, 0.95, 1.0)]
    [2.784, 1.877, 0.0]
    """
    if reward not in {"risk_aware", "node"}:
        remedy = "choose risk_aware or node (with goal_only, any target_reward above 0 is enough)"
        msg = f"reward is {shown(reward)}; {remedy}"
        raise ProblemError(msg)
    side = problem.shorter_side
    process = decision_process(problem.on_eight_connected(resolution, corner_rule=corner_rule), reward=reward)

    def is_enough(target_reward: float) -> bool:
        rewarded = replace(process, target_reward=target_reward)
        values = value_iteration(rewarded, gamma=gamma)
        return greedy(rewarded, values.moves).states[-1] == process.target

    if is_enough(0.0):
        return 0.0
    too_small, enough = 0.0, side
    while not is_enough(enough):
        too_small, enough = enough, RAISE * enough
        if math.isinf(enough):
            return math.inf
    while enough - too_small > REWARD_TOLERANCE * max(enough, side):
        middle = 0.5 * (too_small + enough)
        if is_enough(middle):
            enough = middle
        else:
            too_small = middle
    return enough
