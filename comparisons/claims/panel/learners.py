"""
The table of Q-Learning: what it needs at the target, what it learns with all known, and how it flies.

Discount and reward at the target are not printed: both are factors. The paper has ``0 <= gamma < 1``; ``gamma = 1``,
the default of the toolkit, is outside of that, and needs no reward.
"""

import math
from collections.abc import Iterator, Mapping, Sequence
from itertools import product
from typing import Any

from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import Flights, N, paper_lattice, setup
from cgla_graph.comparisons.claims.panel.settings import Case, PanelMap
from cgla_graph.solvers import solve
from cgla_graph.solvers.grid.value_iteration import least_target_reward

#: Discounts of the paper's range for which the least reward at the target is found, and that learn with all known; with
#: much smaller ones the discount of a long way vanishes among roundings.
GAMMAS = (0.5, 0.8, 0.9, 0.95, 0.99)
#: Discounts that fly: with the others too few learners leave the start.
FLOWN_GAMMAS = (0.95, 0.99)
#: Just outside of the paper's range; all ways earn the same reward at the target, so that none is given.
UNDISCOUNTED = 1.0
#: Rewards at the target, map units: about twice the cost of a way past ten threats at K = 10, and a large one.
REWARDS = (3.0, 100.0)
#: The least reward for which the exact best moves lead to the target, with a margin.
LEAST, MARGIN = "least reward", 1.1
#: How Q-Learning learns, varied one at a time: a slow rate, and a tenth of the episodes.
LEARNING: Mapping[str, Mapping[str, Any]] = {
    "alpha 0.1": {"alpha": 0.1},
    "800 episodes": {"episodes": 800},
}
#: The lattice, varied where all is known: points a side.
RESOLUTIONS = (10, 30)
#: The risk weight, the paper's for a single UAV, with which plans are also made on every tick: these flights take long.
TICK_K = 10.0
#: A learned way is as good as the best if it costs no more than this beyond it.
AS_GOOD_AS = 0.01


def discount_name(gamma: float) -> str:
    """
    Return how records name a discount.

    Examples
    --------
    >>> discount_name(0.95)
    'gamma 0.95'
    """
    return f"gamma {gamma:g}"


def reward_name(reward: float) -> str:
    """Return how records name a reward at the target."""
    return f"reward {reward:g}"


def flying_learners() -> list[tuple[float, float]]:
    """
    List the discounts and rewards that fly.

    Examples
    --------
    >>> flying_learners()
    [(1.0, 0.0), (0.95, 3.0), (0.95, 100.0), (0.99, 3.0), (0.99, 100.0)]
    """
    return [(UNDISCOUNTED, 0.0), *((gamma, reward) for gamma in FLOWN_GAMMAS for reward in REWARDS)]


@experiment("learners", share=0.4)
def learners(map_: PanelMap) -> list[Record]:
    """Find what Q-Learning needs, train it with all known, fly it in all cells, and vary how it learns."""
    flights = Flights(map_)
    ks, radii = map_.panel.levels("k"), map_.panel.levels("radius")
    needed = {k: list(_needed(flights, k)) for k in ks}
    records: list[Record] = [record for k in ks for record in (*needed[k], *_learned(flights, k, needed[k]))]
    for of, radius in product(flying_learners(), radii):
        records += [_flown(flights, *of, {"radius": radius, "k": k}) for k in ks]
    for base, k in product(map_.bases, ks):
        cell = {"radius": base["radius"], "k": k}
        records += [record for n in RESOLUTIONS for record in _needed(flights, k, n, f"N = {n}")]
        for varied, settings in LEARNING.items():
            records += _learned(flights, k, needed[k], varied, settings)
            records += [_flown(flights, *of, cell, varied, settings) for of in flying_learners()]
        if k == TICK_K:
            # without discount, plans that begin on the way are the rest of those before
            discounted = [of for of in flying_learners() if of[0] < UNDISCOUNTED]
            records += [_flown(flights, *of, cell, "replan tick", replan="tick") for of in discounted]
    return [{**map_.levels, "planner": "q-learning", **record} for record in records]


def _needed(flights: Flights, k: float, n: int = N, varied: str = "") -> Iterator[Record]:
    """Find the least reward at the target for which the exact best moves lead there, and hold it against a cost."""
    problem, lattice = flights.map.problem(k), paper_lattice(n)
    cost = solve(problem, "eight-direction", resolution=lattice).cost
    for gamma in (*GAMMAS, UNDISCOUNTED):
        least = least_target_reward(problem, gamma=gamma, resolution=lattice)
        reward = least if math.isfinite(least) else None
        yield {
            "mode": "needed",
            "gamma": discount_name(gamma),
            "k": k,
            "varied": varied,
            "least": reward,
            "is_needed": least > 0.0,
            "cost": cost,
            "ratio": None if reward is None else reward / cost,
        }


def _learned(
    flights: Flights, k: float, needed: Sequence[Record], varied: str = "", settings: Case | None = None
) -> Iterator[Record]:
    """Hold what is learned with all known against the exact optimum in eight directions."""
    least = {one["gamma"]: MARGIN * (one["least"] or 0.0) for one in needed}
    discounted = [
        (gamma, name, reward)
        for gamma in GAMMAS
        for name, reward in ((LEAST, least[discount_name(gamma)]), *((reward_name(one), one) for one in REWARDS))
    ]
    for gamma, name, reward in (*discounted, (UNDISCOUNTED, reward_name(0.0), 0.0)):
        found = flights.planned(setup("q-learning", gamma=gamma, target_reward=reward, **(settings or {})), k)
        excess = found["cost"] / needed[0]["cost"] - 1.0 if found["arrived"] else None
        yield {
            "mode": "known",
            "gamma": discount_name(gamma),
            "reward": name,
            "k": k,
            "varied": varied,
            "arrived": found["arrived"],
            "excess": excess,
            "as_good": excess is not None and excess <= AS_GOOD_AS,
        }


def _flown(
    flights: Flights,
    gamma: float,
    reward: float,
    cell: Case,
    varied: str = "",
    settings: Case | None = None,
    **rules: Any,  # noqa: ANN401 - of the mission
) -> Record:
    of = setup("q-learning", gamma=gamma, target_reward=reward, **(settings or {}))
    names = {"gamma": discount_name(gamma), "reward": reward_name(reward)}
    return {"mode": "flown", **names, **cell, "varied": varied, **flights.flown(of, **cell, **rules)}
