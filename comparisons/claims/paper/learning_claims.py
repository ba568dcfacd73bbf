"""Q-Learning: the reward that it needs at the target (C25), and how well it learns with all known (C53)."""

import math
from collections.abc import Sequence
from dataclasses import replace
from functools import partial
from itertools import pairwise

import numpy as np

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import KNOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.flights import paper_lattice
from cgla_graph.comparisons.claims.panel.learners import AS_GOOD_AS, GAMMAS, UNDISCOUNTED, discount_name
from cgla_graph.comparisons.claims.panel.settings import PanelMap
from cgla_graph.comparisons.claims.rule import Judged, judged, panel_table
from cgla_graph.comparisons.claims.statement import Share, Statement
from cgla_graph.solvers.grid.value_iteration import DecisionProcess, decision_process, least_target_reward

#: Something happens as a rule if it does on more than this share of maps.
MOSTLY = 0.95
#: A reward is very large if it is more than so many times the cost of the best way.
VERY_LARGE = 10.0
#: Two ways to the least reward agree up to this, relative to it and to the side of the map.
SAME = 1e-4
#: Ways of at most so many moves, in points a side, are looked at; later rewards count for next to nothing.
LONGEST = 6
#: Differences of discounted costs are known up to this, relative to them: it keeps ways out whose end is rounded away.
ROUNDING = 1e-15
#: Discounted costs are summed until the discount is below this.
VANISHES = 1e-17
#: The stored map on which the reward falls with K: its discount, and by which K it does.
FALLS_AT, FALLS_OVER = 0.8, (3.0, 10.0, 20.0)
NEEDLESS, FALLING = "no-target-reward.toml", "reward-falls-with-k.toml"
_KNOWN = ("threats", "spread", "goal", "k")
#: How records name the discount that is outside of the paper's range.
_UNDISCOUNTED = discount_name(UNDISCOUNTED)


def least_reward_by_formula(process: DecisionProcess, gamma: float) -> float:
    r"""
    Return the least reward at the target for which the best moves lead there, without trying any.

    .. math:: R^* = \max(0, \min_n \frac{D_n - W}{\gamma^{n-1}})

    with the least discounted cost :math:`D_n` of a way of n moves to the target, and :math:`W` of a way that never ends
    and never comes there: a reward R makes a way of n moves worth :math:`\gamma^{n-1} R - D_n`.

    The process has no reward at the target, and a move in each state; the discount is above 0 and below 1. Infinite if
    no way of at most `LONGEST` moves for each point a side leads to the target.
    """
    costs, first, heads = -process.rewards, process.first[:-1], process.heads
    endless = np.zeros(process.n_states)
    endless[process.target] = np.inf
    for _ in range(math.ceil(math.log(VANISHES) / math.log(gamma))):
        endless = np.minimum.reduceat(costs + gamma * endless[heads], first)
        endless[process.target] = np.inf
    ways = np.full(process.n_states, np.inf)
    ways[process.target] = 0.0
    worth, least = float(endless[process.source]), math.inf
    for n in range(LONGEST * math.isqrt(process.n_states)):
        ways = np.minimum.reduceat(costs + gamma * ways[heads], first)
        ways[process.target] = np.inf
        least = min(least, (float(ways[process.source]) - worth + ROUNDING * worth) / gamma**n)
    return max(0.0, least)


def require_formula(records: Sequence[Record], maps: Sequence[PanelMap]) -> int:
    """Assert that rewards of some maps are those of the formula, or 0 without discount or risk; return how many."""
    count = 0
    for one in maps:
        for gamma in GAMMAS:
            riskless = least_target_reward(one.problem(0.0), gamma=gamma, resolution=paper_lattice())
            require(riskless == 0.0, f"map {one.seed}, gamma = {gamma:g}: without risk {riskless:g} is needed")
        for record in records:
            if record["map"] != one.seed or record["varied"]:
                continue
            gamma, found = float(record["gamma"].split()[1]), record["least"]
            process = decision_process(one.problem(record["k"]).on_eight_connected(paper_lattice()))
            reward = 0.0 if gamma == UNDISCOUNTED else least_reward_by_formula(process, gamma)
            agree = math.isclose(found, reward, rel_tol=SAME, abs_tol=SAME)
            require(agree, f"map {one.seed}, {record['gamma']}: {found} by value iteration, {reward} by the formula")
            count += 1
    return count


def stored_rewards() -> list[float]:
    """Assert that one stored map needs no reward, and that those of the other one, returned, fall as K rises."""
    scenario = counterexamples.scenario(NEEDLESS)
    for gamma in (*GAMMAS, UNDISCOUNTED):
        reward = least_target_reward(scenario.problem, gamma=gamma, resolution=scenario.lattice)
        require(reward == 0.0, f"on {NEEDLESS}, gamma = {gamma:g}, a reward of {reward:g} is needed")
    scenario = counterexamples.scenario(FALLING)
    posed = [replace(scenario.problem, k=k) for k in FALLS_OVER]
    falls = [least_target_reward(one, gamma=FALLS_AT, resolution=scenario.lattice) for one in posed]
    require(all(less < more for more, less in pairwise(falls)), f"on {FALLING} the reward does not fall: {falls}")
    return falls


def _discounted(samples: Samples, mode: str) -> Samples:
    """Keep the records of the paper's discounts."""
    return Samples([one for one in samples.where(mode=mode) if one["gamma"] != _UNDISCOUNTED])


def needed_rewards(samples: Samples) -> Judged:
    """Judge whether the reward that is needed at the target is very large."""
    text = f"it is very large: over {VERY_LARGE:g} best ways"
    large = Statement(text, "ratio", {}, VERY_LARGE, less=False, factors=("gamma", *_KNOWN))
    return judged(_discounted(samples, "needed"), large)


@claim(
    25,
    "Section 3.1",
    "Q-Learning needs a very large weight of the target, or it does not get there.",
    f"All kinds of maps and K, for gamma = {', '.join(f'{gamma:g}' for gamma in GAMMAS)}: the least reward at the "
    "target for which the exact best moves lead there, so that training plays no part; varied: the lattice.",
    experiments=("learners",),
    settings=KNOWN,
)
def _check_c25(evidence: Evidence) -> Finding:
    samples = evidence.samples["learners"]
    falls = stored_rewards()
    count = require_formula(samples.where(mode="needed"), evidence.maps(evidence.instances(3, 1)))
    found = needed_rewards(samples)
    why = f"none is on the stored map (gamma = {GAMMAS[0]:g} to 1), nor without risk, nor for gamma = 1"
    always = Row("a target reward is always needed", Answer.FAILS, Basis.COUNTEREXAMPLE, why=why)
    rewards, ks = (", ".join(f"{one:.3g}" for one in of) for of in (falls, FALLS_OVER))
    return Finding(
        (always, found.row),
        notes=(
            (
                "Proof: a reward R at the target makes a way of n moves worth gamma^(n - 1) R - D_n, where D_n is the "
                "least discounted cost of such a way. A way that never comes there is worth -W at best. So the least "
                "reward is R* = max(0, min over n of (D_n - W) / gamma^(n - 1)), finite if there is a way; it grows as "
                f"gamma falls. Asserted on {count} rewards that bisection over value iteration found."
            ),
            "Without risk, moves of h cost h (1 - gamma^n) / (1 - gamma): less than any way that never ends.",
            f"A greater K may need a smaller reward: {rewards} for K = {ks} on a stored map (gamma = {FALLS_AT:g}).",
        ),
        tables=(panel_table("The least reward at the target, over the cost of the best way", [found]),),
        counterexamples=(NEEDLESS, FALLING),
    )


def learned_well(samples: Samples) -> list[Judged]:
    """Judge whether learned ways are as good as the best, for the paper's discounts and without discount."""
    text = f"within {AS_GOOD_AS:.0%} of the best on > {MOSTLY:.0%}"
    often = partial(Statement, measure="as_good", first={}, second=MOSTLY, less=False, test=Share(MOSTLY))
    of_maps = partial(often, size="on {} % of maps")
    ours = Samples(samples.where(mode="known", gamma=_UNDISCOUNTED))
    return [
        judged(_discounted(samples, "known"), of_maps(text, factors=("gamma", "reward", *_KNOWN))),
        judged(ours, of_maps(f"{text} (gamma = 1: not the paper's)", factors=_KNOWN)),
    ]


@claim(
    53,
    "Section 1",
    "Q-Learning performs well when all of the map is known.",
    f"All kinds of maps and K, all known, trained with gamma = {', '.join(f'{gamma:g}' for gamma in GAMMAS)} and three "
    "rewards at the target (the least that is needed and 10 %, 3, 100), against the optimum in the same eight "
    "directions; varied: rate and length of training. gamma = 1 is outside of the paper's range and stands apart.",
    experiments=("learners",),
    settings=KNOWN,
)
def _check_c53(evidence: Evidence) -> Finding:
    found = learned_well(evidence.samples["learners"])
    return Finding(
        tuple(one.row for one in found),
        notes=("With a discount, a large reward makes few moves the best (C34): another optimum is learned.",),
        tables=(panel_table(f"Share of maps on which Q-Learning is within {AS_GOOD_AS:.0%}", found),),
    )
