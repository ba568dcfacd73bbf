"""Tabular Q-Learning in plain Python: what the compiled loop has to give to the last bit, and has to be faster than."""

from collections.abc import Iterator

MASK = 2**64 - 1


def words(seed: int) -> Iterator[int]:
    """Yield the numbers of SplitMix64 as its authors define them."""
    state = seed
    while True:
        state = (state + 0x9E3779B97F4A7C15) & MASK
        word = ((state ^ (state >> 30)) * 0xBF58476D1CE4E5B9) & MASK
        word = ((word ^ (word >> 27)) * 0x94D049BB133111EB) & MASK
        yield word ^ (word >> 31)


def train(
    moves: list[list[tuple[int, int, float]]],
    target: int,
    starts: list[int],
    values: list[float],
    *,
    alpha: float | None,
    gamma: float,
    epsilon: tuple[float, float],
    episodes: int,
    max_steps: int,
    tolerance: float,
    quiet: int,
    seed: int,
) -> tuple[int, int, bool]:
    """
    Learn `values`, one a move, in place; return episodes, updates and whether they settled.

    ``moves[s]`` lists the moves from state ``s``: number, where it leads, what it earns.
    """
    draw = ((word >> 11) * 2.0**-53 for word in words(seed))
    visits = [0] * len(values)
    updates = calm = 0
    for episode in range(episodes):
        chance = epsilon[0] + (epsilon[1] - epsilon[0]) * (episode / max(episodes - 1, 1))
        here = starts[int(next(draw) * len(starts))]
        largest = 0.0
        for _ in range(max_steps):
            if next(draw) < chance:
                move, there, earned = moves[here][int(next(draw) * len(moves[here]))]
            else:
                move, there, earned = max(moves[here], key=lambda choice: values[choice[0]])
            after = 0.0 if there == target else gamma * max(values[number] for number, _, _ in moves[there])
            visits[move] += 1
            rate = visits[move] ** -0.7 if alpha is None else alpha
            before = values[move]
            values[move] = (1 - rate) * before + rate * (earned + after)
            largest = max(largest, abs(values[move] - before))
            updates += 1
            if there == target:
                break
            here = there
        calm = calm + 1 if largest <= tolerance else 0
        if calm == quiet:
            return episode + 1, updates, True
    return episodes, updates, False
