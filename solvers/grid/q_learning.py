"""Tabular Q-Learning over the eight moves of a lattice, in the style of the paper's peer."""

import time
from dataclasses import dataclass
from typing import Annotated, ClassVar, TypeAlias, cast

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import finite_number
from cgla_graph.errors import SolverSettingError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Between, Count, NonNegative, Resolution, Seed, Settings
from cgla_graph.solvers.grid import q_learning_kernels as kernels
from cgla_graph.solvers.grid.value_iteration import DecisionProcess, Reward, decision_process, greedy

NAME = "q-learning"
#: Episodes for each point of the lattice, and moves for each point of its longer side.
EPISODES_A_POINT = 20
STEPS_A_POINT = 4
#: At least so many episodes in a row must change next to nothing before training ends early.
QUIET_EPISODES = 100


Chance: TypeAlias = Annotated[float, Between(0.0, 1.0)]


@dataclass(frozen=True)
class QLearning(Settings):
    r"""
    Q-Learning (Watkins 1989; Watkins, Dayan 1992) over moves to the eight neighbours of a lattice point.

    **Published.** The CGLA paper compares with the Q-Learning planner of Zhang, Mao, Liu, Liu (2013) and prints
    its update (Eq. 4) with a misprint on the left side: it has to be :math:`Q(s_t, a_t)`. Its states are the points of
    a lattice, its moves go in eight directions; its rewards, rates and number of episodes are not public.

    **Ours.** All the rest: this is a planner in the style of that one, not the original, and its numbers are
    not those of the paper's tables. The states and moves are those of `eight-direction` on the same lattice, whose
    optimum is the best that can be learnt. Each episode begins at a random state that can be reached from the start,
    makes the best move or now and then a random one, and after each move sets

    .. math:: Q(s, a) \leftarrow (1 - \alpha) Q(s, a) + \alpha (r + \gamma \max_{a'} Q(s', a')),

    with nothing after the goal. The path follows the best moves from the start. The defaults make it a good learner on
    a known map: costs are not discounted, so that the best moves are those of least cost; without chance there is
    no noise to average out, so that ``alpha = 1`` learns fastest; values begin below the value of any move, so that a
    value above that is the cost of a way once made, and best moves never circle among such values; and moves are
    random at first, since from such values the learner meets better ways only by chance.

    **How it fails.** The best moves may run in a circle: then the answer is ``STUCK``, and says where. That happens
    after too few episodes; with ``gamma < 1`` and too small a ``target_reward`` (`least_target_reward` computes the
    least), as an endless circle in a cheap place is then worth more than the goal; and with optimistic first values
    if the start is close beside a lattice point, because to and fro between the two they fall by little. (Elsewhere
    they learn as well, with an `epsilon` of 0.3: untried moves look good.) A small ``alpha`` needs more than the usual
    episodes. A discount weighs later costs less: it prefers later risk to present risk, and cheap first moves. With
    ``reward="node"``, risk between lattice points goes unseen, and the length of a move does not weigh it. Everything
    is learnt anew for each problem, and each move made some fifty times, where `dijkstra` looks at each once.

    `Solution.evaluations` counts the segments of the lattice, each weighed once; with ``reward="node"`` its points as
    well.

    Attributes
    ----------
    reward
        What a move from ``s`` to ``s'`` earns. ``risk_aware``: minus its cost, ``-(length + k * risk)``. ``node``:
        ``-length - k * F(s')``. ``goal_only``: nothing; then the best path has the fewest moves.
    target_reward
        What the move into the goal earns on top, map units, at least 0.
    gamma
        The discount, from 0 to 1. The paper allows [0, 1); 1, the default, needs no reward at the goal.
    alpha
        The learning rate, above 0 and at most 1; None: ``1 / n ** 0.7``, where ``n`` counts how often the move was
        made. That averages over noise, of which there is none here, and forgets wrong first values slowly.
    initial_value
        Of all moves, map units; None: below the value of any move: as many of the most expensive moves as there are
        points, or such moves without end, if these cost less. Values that no move can beat (`target_reward` or more, as
        0 where there is none) are called optimistic.
    epsilon, last_epsilon
        The chance of a random move, in the first and in the last episode; it changes by equal steps.
    episodes
        At most so many; None: 20 for each point of the lattice.
    max_steps
        Moves until an episode is broken off; None: 4 for each point of the lattice's longer side.
    tolerance
        Training ends early when as many episodes in a row as the lattice has points, and at least 100, change no value
        by more than this times the shorter side of the bounds (with ``goal_only``, times ``target_reward``); 0: when
        they change none at all. After fewer of them, a move that matters may not have been made again.
    seed
        Of the random numbers (SplitMix64, the same on every machine).
    resolution
        Points a side of a closed lattice, or a `Lattice`; None: that of `solve`, else 20.
    corner_rule
        As for `eight-direction`.

    Raises
    ------
    SolverSettingError
        If a setting is out of range, or ``goal_only`` has no reward at the goal.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0), (1, 1), RiskField([Threat(1, 1, spread=0.2)]), k=10)
    >>> answer = QLearning().solve(problem)
    >>> round(answer.cost, 3), answer.message
    (3.921, 'settled after 2287 of 8000 episodes, 155625 updates')
    >>> QLearning(gamma=0.9).solve(problem).message.split(";")[0]
    'the greedy policy runs in a circle of 2 moves from (0, 0)'
    """

    reward: Reward = "risk_aware"
    target_reward: NonNegative = 0.0
    gamma: Chance = 1.0
    alpha: Annotated[float, Between(0.0, 1.0, above=True)] | None = 1.0
    initial_value: Annotated[float, finite_number] | None = None
    epsilon: Chance = 1.0
    last_epsilon: Chance = 0.01
    episodes: Count | None = None
    max_steps: Count | None = None
    tolerance: NonNegative = 1e-3
    seed: Seed = 1
    resolution: Resolution | None = None
    corner_rule: CornerRule = "touch"

    traits: ClassVar[Traits] = Traits(
        NAME,
        "tabular Q-Learning over eight directions",
        domain="plane",
        seeded=True,
        complete=False,
        needs_positive=True,
    )

    def __post_init__(self) -> None:
        """Check the settings."""
        super().__post_init__()
        if self.reward == "goal_only" and self.target_reward == 0.0:
            msg = f"{NAME}: reward goal_only earns nothing on the way; give a target_reward above 0"
            raise SolverSettingError(msg)

    def solve(self, problem: Problem) -> Solution:
        """Lay the lattice, which is reported as time to build, train on it, and follow the best moves."""
        began = time.perf_counter()
        on = problem.on_eight_connected(self.resolution or 20, corner_rule=self.corner_rule)
        process = decision_process(on, reward=self.reward, target_reward=self.target_reward)
        states = _within_reach(process)
        asked = on.graph.n_pairs + (process.n_states if self.reward == "node" else 0)
        built = time.perf_counter() - began
        if process.target not in states:
            return Solution(Status.NO_PATH, build_seconds=built, evaluations=asked)
        values, trained = self._train(process, states, problem)
        rollout = greedy(process, values)
        positions = np.asarray(on.graph.positions)
        path = positions[list(rollout.states)]
        if rollout.circle:
            x, y = positions[rollout.circle_from]
            message = f"the greedy policy runs in a circle of {rollout.circle} moves from ({x:g}, {y:g}); {trained}"
            return Solution(Status.STUCK, build_seconds=built, evaluations=asked, message=message)
        return Solution(
            Status.FOUND,
            path=path,
            nodes=rollout.states,
            cost=problem.evaluate(path).cost,
            build_seconds=built,
            evaluations=asked,
            message=trained,
        )

    def _train(self, process: DecisionProcess, states: IntArray, problem: Problem) -> tuple[FloatArray, str]:
        """Return the values of the moves, shape ``(m,)``, and the training in words."""
        lattice = cast("Lattice", process.on.graph.lattice)
        episodes = EPISODES_A_POINT * lattice.n_points if self.episodes is None else self.episodes
        max_steps = STEPS_A_POINT * max(lattice.shape) if self.max_steps is None else self.max_steps
        unit = self.target_reward if self.reward == "goal_only" else problem.shorter_side
        values = np.full(process.n_moves, self._first_value(process))
        done, updates, settled = kernels.train(
            process.first,
            process.heads,
            process.earned,
            process.target,
            states[states != process.target],
            0.0 if self.alpha is None else float(self.alpha),
            float(self.gamma),
            float(self.epsilon),
            float(self.last_epsilon),
            episodes if len(states) > 1 else 0,
            max_steps,
            float(self.tolerance * unit),
            max(lattice.n_points, QUIET_EPISODES),
            self.seed,
            values,
            np.zeros(process.n_moves, dtype=np.int64),
        )
        count = f"settled after {done} of {episodes} episodes" if settled else f"{done} episodes"
        return values, f"{count}, {updates} updates"

    def _first_value(self, process: DecisionProcess) -> float:
        """Return the first values: at most the value of any way to the target that passes no state twice."""
        if self.initial_value is not None:
            return float(self.initial_value)
        worst = float(process.rewards.min(initial=0.0))
        return worst * min(process.n_states, 1.0 / (1.0 - self.gamma) if self.gamma < 1.0 else np.inf)


def _within_reach(process: DecisionProcess) -> IntArray:
    """Return the states that can be reached from the source; moves go both ways."""
    labels = csgraph.connected_components(process.on.graph.to_csgraph(), directed=False)[1]
    return np.flatnonzero(labels == labels[process.source])
