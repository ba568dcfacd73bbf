"""The settings of Q-Learning that the claims about it try (C34, C36, C53): a factor with levels."""

import dataclasses
from collections.abc import Callable, Mapping, Sequence
from typing import TypeVar

from cgla_graph.comparisons.claims.claim import Part, Verdict
from cgla_graph.comparisons.claims.contrasts import CellTest, judged, split
from cgla_graph.solvers.grid.q_learning import QLearning

#: Rewards at the target, map units: about twice the cost of the best way, and one that is very large (C25).
MODEST, LARGE = 3.0, 100.0
#: The learner that needs no reward: the default of the toolkit, just outside of the paper's ``0 <= gamma < 1``.
UNDISCOUNTED = "gamma = 1"
#: By name: gamma, and the reward at the target.
LEARNERS: Mapping[str, tuple[float, float]] = {
    UNDISCOUNTED: (1.0, 0.0),
    **{
        f"gamma = {gamma:g}, reward {reward:g}": (gamma, reward) for reward in (MODEST, LARGE) for gamma in (0.99, 0.95)
    },
}
Test = TypeVar("Test", bound=CellTest)


def learner(name: str, *, episodes: int | None = None) -> QLearning:
    """
    Return a learner of `LEARNERS`.

    Examples
    --------
    >>> learner("gamma = 0.95, reward 100").gamma
    0.95
    """
    gamma, reward = LEARNERS[name]
    return QLearning(gamma=gamma, target_reward=reward, episodes=episodes)


def for_learners(names: Sequence[str]) -> str:
    """
    Say for which learners something is so.

    Examples
    --------
    >>> for_learners(["gamma = 1", "gamma = 0.99, reward 3", "gamma = 0.95, reward 3"])
    'for gamma = 1; gamma = 0.99 or 0.95 with reward 3'
    """
    if len(names) == len(LEARNERS):
        return "for every gamma and reward"
    by_reward: dict[float, list[str]] = {}
    for name in names:
        gamma, reward = LEARNERS[name]
        by_reward.setdefault(reward, []).append(f"{gamma:g}")
    words = [f"gamma = {' or '.join(gammas)}{f' with reward {r:g}' if r else ''}" for r, gammas in by_reward.items()]
    return f"for {'; '.join(words)}"


def by_level(
    statement: str,
    levels: Mapping[str, Sequence[Test]],
    part: Callable[..., Part],
    *,
    condition: Callable[[Sequence[str]], str] = for_learners,
    printed: str = "",
) -> tuple[Part, ...]:
    """
    Say of a factor's levels what their tests show, in one part for all levels of the same verdict.

    Parameters
    ----------
    statement
        What is claimed of each level.
    levels
        The tests of each level, by its name.
    part
        Makes a part of tests: `contrast_part`, `rate_part` or `share_part`.
    condition
        Says which levels a verdict is for.
    printed
        How large it is in the paper.

    Examples
    --------
    >>> from cgla_graph.comparisons.claims.contrasts import judged_part
    >>> [one.ruling for one in by_level("risk", {"K = 10": [], "K = 50": []}, judged_part, condition=" and ".join)]
    ['risk: undecided K = 10 and K = 50']
    """
    groups: dict[Verdict, list[str]] = {}
    for name, tests in levels.items():
        groups.setdefault(judged(tests), []).append(name)
    # a level is judged by itself, not among those of its group
    return tuple(
        dataclasses.replace(
            part(statement, [test for name in names for test in levels[name]], printed=printed),
            verdict=verdict,
            condition=condition(names) + split([test for name in names for test in levels[name]]),
            levels=tuple(names),
        )
        for verdict, names in groups.items()
    )
