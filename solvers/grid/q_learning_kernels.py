"""
Compiled loops of tabular Q-Learning and of value iteration, over the moves of a graph.

The moves from state ``s`` are numbered ``first[s]`` to ``first[s + 1] - 1``; move ``m`` leads to ``heads[m]`` and
earns ``rewards[m]``. The target ends an episode: nothing is earned after it, so its value is 0 and its own moves are
never made.
"""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray, IntArray

#: SplitMix64 (Steele, Lea, Flood, OOPSLA 2014): one 64-bit word of state, the same numbers on every machine.
GOLDEN = np.uint64(0x9E3779B97F4A7C15)
FIRST_FACTOR = np.uint64(0xBF58476D1CE4E5B9)
SECOND_FACTOR = np.uint64(0x94D049BB133111EB)
#: A float has 53 bits: from the upper bits of a word to the numbers in [0, 1).
STEP = 2.0**-53


@kernel
def mixed(state: np.uint64) -> np.uint64:
    """Turn a state of SplitMix64 into its 64 random bits."""
    word = (state ^ (state >> np.uint64(30))) * FIRST_FACTOR
    word = (word ^ (word >> np.uint64(27))) * SECOND_FACTOR
    return word ^ (word >> np.uint64(31))


@kernel
def uniform(state: np.uint64) -> float:
    """Turn a state of SplitMix64 into a number, evenly from [0, 1)."""
    return float(mixed(state) >> np.uint64(11)) * STEP


@kernel
def best_move(first: IntArray, values: FloatArray, state: int) -> int:
    """Return the move of greatest value from a state, the first of equals; -1 where there is none."""
    best, top = -1, -math.inf
    for move in range(first[state], first[state + 1]):
        if values[move] > top:
            best, top = move, values[move]
    return best


@kernel
def train(
    first: IntArray,
    heads: IntArray,
    rewards: FloatArray,
    target: int,
    starts: IntArray,
    alpha: float,
    gamma: float,
    epsilon: float,
    last_epsilon: float,
    episodes: int,
    max_steps: int,
    tolerance: float,
    quiet: int,
    seed: int,
    values: FloatArray,
    visits: IntArray,
) -> tuple[int, int, bool]:
    """
    Learn the values of moves by Eq. 4 with its textbook left side, Q(s_t, a_t) (Watkins, Dayan 1992).

    Each episode begins at a random one of `starts`, makes the best move or, with a chance that falls from `epsilon` to
    `last_epsilon` in equal steps, a random one, and ends at the target or after `max_steps` moves. Training ends after
    `episodes`, or once `quiet` episodes in a row changed no value by more than `tolerance`.

    `alpha` is the learning rate; 0 stands for ``1 / n**0.7``, where ``n`` counts how often the move was made.
    `values` and `visits`, shape ``(m,)``, are updated in place.

    Returns
    -------
    episodes, updates, settled
        How many of each there were, and whether the values had settled.
    """
    state = np.uint64(seed)
    updates, calm = 0, 0
    for episode in range(episodes):
        chance = epsilon + (last_epsilon - epsilon) * (episode / max(episodes - 1, 1))
        state += GOLDEN
        here = starts[int(uniform(state) * len(starts))]
        greedy = best_move(first, values, here)
        largest = 0.0
        for _ in range(max_steps):
            move = greedy
            state += GOLDEN
            if uniform(state) < chance:
                state += GOLDEN
                move = first[here] + int(uniform(state) * (first[here + 1] - first[here]))
            there = heads[move]
            gained = rewards[move]
            if there != target:
                # also the move that comes next, unless it explores: no move leads back to its own state
                greedy = best_move(first, values, there)
                gained += gamma * values[greedy]
            visits[move] += 1
            rate = alpha if alpha > 0.0 else visits[move] ** -0.7
            before = values[move]
            values[move] = (1.0 - rate) * before + rate * gained
            largest = max(largest, abs(values[move] - before))
            updates += 1
            if there == target:
                break
            here = there
        calm = calm + 1 if largest <= tolerance else 0
        if calm == quiet:
            return episode + 1, updates, True
    return episodes, updates, False


@kernel
def iterate(
    first: IntArray,
    heads: IntArray,
    rewards: FloatArray,
    target: int,
    gamma: float,
    states: FloatArray,
    out: FloatArray,
) -> int:
    """
    Back up the values of all states at once, ``V(s) <- max(r + gamma V(s'))``, until not one bit changes.

    `states`, shape ``(n,)``, holds lower bounds and becomes the values; `out`, shape ``(m,)``, takes those of the
    moves. Values only rise, as rounding keeps the order of numbers, and are bounded, so there is an end.

    Returns
    -------
    rounds
        How many there were; the last one changed nothing.
    """
    rounds, changed = 0, True
    while changed:
        rounds += 1
        for move in range(len(heads)):
            after = 0.0 if heads[move] == target else states[heads[move]]
            out[move] = rewards[move] + gamma * after if after > -math.inf else -math.inf
        changed = False
        for state in range(len(states)):
            for move in range(first[state], first[state + 1]):
                if state != target and out[move] > states[state]:
                    states[state] = out[move]
                    changed = True
    return rounds
