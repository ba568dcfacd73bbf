"""What Q-Learning needs, from exact value iteration (C25), and how well it learns (C53)."""

import itertools
import math
from dataclasses import replace
from itertools import product

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    MOSTLY,
    Contrast,
    Share,
    cell_name,
    finite,
    judged_part,
    share_part,
    shares,
)
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import median, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import K, paper_lattice, plan_measures
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, by_level, learner
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve
from cgla_graph.solvers.grid.q_learning import EPISODES_A_POINT
from cgla_graph.solvers.grid.value_iteration import (
    DecisionProcess,
    decision_process,
    least_target_reward,
    value_iteration,
)

#: Shares of the learner's own number of episodes, all of them last.
TRAINING = (0.01, 0.1, 1.0)
#: A learned way is as good as the best if it costs no more than this beyond it.
AS_GOOD_AS = 0.01
#: Risk weights: none, and the paper's.
WEIGHTS = (0.0, 10.0, 50.0, 200.0)
DISCOUNTS = (0.8, 0.9, 0.95, 0.99)
#: A reward is very large if it is more than so many times the cost of the best way.
VERY_LARGE = 10.0
#: Two ways to the least reward agree up to this, relative to it and to the side of the map.
SAME = 1e-6
#: Ways of at most so many moves, in points a side, are looked at; later rewards count for next to nothing.
LONGEST = 6
#: The stored map on which the reward falls with K: its discount, and by which K it does.
FALLS_AT, FALLS_OVER = 0.8, (3.0, 10.0, 20.0)
NEEDLESS, FALLING = "no-target-reward.toml", "reward-falls-with-k.toml"


@experiment("training", quick=120)
def training(seed: int) -> list[Record]:
    """Train Q-Learning for longer and longer with all of the map known, and hold it against the exact optimum."""
    problem = random_scenario(seed, k=K).problem
    best = solve(problem, "eight-direction", resolution=paper_lattice()).cost
    whole = EPISODES_A_POINT * paper_lattice().n_points
    records: list[Record] = []
    for name, share in product(LEARNERS, TRAINING):
        solver = learner(name, episodes=max(1, round(share * whole)))
        learned = plan_measures(problem, solver)
        excess = learned["cost"] / best - 1.0 if learned["arrived"] else None
        records.append({"learner": name, "share": share, **learned, "excess": excess})
    return records


@claim(
    53,
    "Section 1",
    "Q-Learning performs well when all of the map is known.",
    "P(cost of the learned way <= 1.01 times the best in eight directions) > 0.95 after all episodes",
    Kind.STATISTIC,
    experiments=("training",),
)
def _check_c53(evidence: Evidence) -> Finding:
    samples = evidence.samples["training"]
    rows: list[list[Entry]] = []
    trained: dict[str, list[Share]] = {}
    for name, share in product(LEARNERS, TRAINING):
        excess, arrived = (samples.column(what, learner=name, share=share) for what in ("excess", "arrived"))
        # who finds no way is not as good as the best
        as_good = np.where(np.isnan(arrived), math.nan, excess <= AS_GOOD_AS)
        trained[name] = shares({name: as_good})
        (found,) = trained[name]
        finds = proportion(arrived).rate
        rows.append(
            [
                name,
                share,
                found.found.n,
                *finite(finds, found.found.rate),
                *found.found.interval,
                *finite(median(excess)),
                found.p,
            ]
        )
    columns = (
        "learner",
        "share of training",
        "maps",
        "finds a way",
        "as good",
        "95 % from",
        "to",
        "median excess",
        "p",
    )
    rates = [f"{one.found.rate:.1%} ({name})" for name, (one,) in trained.items()]
    return Finding(
        by_level("", trained, share_part),
        f"Trained to the end, Q-Learning is within {AS_GOOD_AS:.0%} of the best way in eight directions on "
        f"{', '.join(rates)} of {next(iter(trained.values()))[0].found.n} maps.",
        tables=(
            Table(
                "Q-Learning against the exact optimum in eight directions, all known, K = 10",
                columns,
                rows,
                f"Rule, set before the sample was drawn: supported for a learner if, at full training, the share that "
                f"is within {AS_GOOD_AS:.0%} is shown to be above {MOSTLY:.0%} (exact binomial test), contradicted if "
                "it is shown to be below, else undecided.",
            ),
        ),
        notes=(
            (
                "gamma = 1 is just outside of the paper's 0 <= gamma < 1, and needs no reward at the target. With a "
                "discount, a reward makes short ways worth more and risks matter less (C34)."
            ),
        ),
    )


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
    rounds = math.ceil(math.log(1e-12) / math.log(gamma))
    endless[process.target] = np.inf
    for _ in range(rounds):
        endless = np.minimum.reduceat(costs + gamma * endless[heads], first)
        endless[process.target] = np.inf
    ways = np.full(process.n_states, np.inf)
    ways[process.target] = 0.0
    least = math.inf
    for n in range(LONGEST * math.isqrt(process.n_states)):
        ways = np.minimum.reduceat(costs + gamma * ways[heads], first)
        ways[process.target] = np.inf
        least = min(least, float(ways[process.source] - endless[process.source]) / gamma**n)
    return max(0.0, least)


def _rewards(problem: Problem, gamma: float, lattice: Lattice) -> FloatArray:
    """Return the least reward for each of `WEIGHTS`, shape ``(4,)``, by bisection and by the formula."""
    found = []
    for k in WEIGHTS:
        posed = replace(problem, k=k)
        reward = least_target_reward(posed, gamma=gamma, resolution=lattice)
        by_formula = least_reward_by_formula(decision_process(posed.on_eight_connected(lattice)), gamma)
        agree = math.isclose(reward, by_formula, rel_tol=SAME, abs_tol=SAME)
        require(agree, f"K = {k:g}, gamma = {gamma:g}: {reward} by value iteration, {by_formula} by the formula")
        require(math.isfinite(reward), "no reward is enough")
        found.append(reward)
    return np.array(found)


def _best_costs(problem: Problem, lattice: Lattice) -> FloatArray:
    """Return the cost of the best way for each of `WEIGHTS`, shape ``(4,)``: without discount no reward is needed."""
    found = []
    for k in WEIGHTS:
        on = replace(problem, k=k).on_eight_connected(lattice)
        values = value_iteration(decision_process(on)).states
        least = cost_matrix(on.graph, on.target).values
        require(np.allclose(-values, least, rtol=1e-12, atol=0.0), "value iteration is not Dijkstra's algorithm")
        reward = least_target_reward(replace(problem, k=k), gamma=1.0, resolution=lattice)
        require(reward == 0.0, f"without discount a reward of {reward:g} was needed")
        found.append(float(least[on.graph.index_of(on.source)]))
    return np.array(found)


def _stored() -> list[float]:
    """Run the stored maps again: one needs no reward; return what the other one needs, which falls as K rises."""
    scenario = counterexamples.scenario(NEEDLESS)
    for gamma in (*DISCOUNTS, 1.0):
        reward = least_target_reward(scenario.problem, gamma=gamma, resolution=scenario.lattice)
        require(reward == 0.0, f"on {NEEDLESS}, gamma = {gamma:g}, a reward of {reward:g} is needed")
    scenario = counterexamples.scenario(FALLING)
    posed = [replace(scenario.problem, k=k) for k in FALLS_OVER]
    falls = [least_target_reward(one, gamma=FALLS_AT, resolution=scenario.lattice) for one in posed]
    require(
        all(less < more for more, less in itertools.pairwise(falls)), f"on {FALLING} the reward does not fall: {falls}"
    )
    return falls


@claim(
    25,
    "Section 3.1",
    "Q-Learning needs a very large weight of the target, or it does not get there.",
    "The least reward at the target for which the exact best moves lead there is above 0, and large, for all "
    "maps, K and gamma.",
    Kind.PROPERTY,
)
def _check_c25(evidence: Evidence) -> Finding:
    falls = _stored()
    lattice = paper_lattice()
    problems = [random_scenario(seed).problem for seed in evidence.scale.map_seeds(evidence.instances(200, 12))]
    costs = np.array([_best_costs(problem, lattice) for problem in problems])
    rewards = np.array([[_rewards(problem, gamma, lattice) for gamma in DISCOUNTS] for problem in problems])
    require((rewards[:, :, 0] == 0.0).all(), "without risk a reward was needed")
    return judge_c25(rewards, costs, falls)


def judge_c25(rewards: FloatArray, costs: FloatArray, falls: list[float]) -> Finding:
    """
    Say how large the least rewards at the target are.

    `rewards` has the shape ``(maps, discounts, weights)``, and `costs`, of the best ways, ``(maps, weights)``, both map
    units; `falls` are those of the stored map for `FALLS_OVER`.
    """
    relative = rewards / costs[:, None, :]
    rows: list[list[Entry]] = []
    needed: dict[str, list[Share]] = {}
    large: list[Contrast] = []
    for d, w in itertools.product(range(len(DISCOUNTS)), range(1, len(WEIGHTS))):
        found, sizes = rewards[:, d, w], relative[:, d, w]
        case = {"gamma": f"gamma = {DISCOUNTS[d]:g}", "k": WEIGHTS[w]}
        (share,) = shares({cell_name(case): np.where(found > 0.0, 1.0, 0.0)})
        needed.setdefault(f"{DISCOUNTS[d]:g}", []).append(share)
        shift = paired_shift(sizes, np.full_like(sizes, VERY_LARGE))
        large.append(Contrast(f"reward / cost > {VERY_LARGE:g}", case, shift))
        numbers = [float(size) for size in (np.median(found), found.max(), sizes.max())]
        rows.append([DISCOUNTS[d], WEIGHTS[w], *share.row[2:], share.p, *numbers, shift.p])
    ratios = relative[:, :, 1:]
    rises = np.diff(rewards, axis=2) >= -SAME
    some = proportion((rewards[:, :, 1:] > 0.0).ravel())
    heads = (
        "gamma",
        "K",
        "need one",
        "95 % from",
        "to",
        "p",
        "median reward",
        "greatest",
        "greatest / cost of the best way",
        f"p, against {VERY_LARGE:g} times",
    )
    medians = np.median(ratios, axis=0)
    return Finding(
        (
            Part(
                "a target weight is needed",
                Verdict.PROVED,
                "the least one that is enough is R* = max(0, min over n of (D_n - W) / gamma^(n - 1)), equal to "
                "bisection over exact value iteration in every case",
                "if an endless way costs less than any to the target",
            ),
            Part("a target weight is needed", Verdict.REFUTED, f"{NEEDLESS}: none is, for any gamma", "as printed"),
            Part(
                "a target weight is needed",
                Verdict.REFUTED,
                "an endless way costs infinitely much; values are minus Dijkstra's costs",
                "for gamma = 1",
            ),
            *by_level(
                "a target weight is needed as a rule",
                needed,
                share_part,
                condition=lambda names: f"for gamma = {', '.join(names)}",
            ),
            replace(
                judged_part("it is very large", large),
                effect=f"median {medians.min():.2g} to {medians.max():.2g} times the cost of the best way, at most "
                f"{ratios.max():.3g}",
            ),
        ),
        f"With gamma < 1 a reward is needed in {some.rate:.0%} of {some.n} cases (K = 10, 50, 200; gamma = 0.8 to "
        f"0.99; {len(rewards)} maps), and then it is finite and no more than {ratios.max():.3g} times the cost of "
        "the best way. None is needed without discount, nor without risk, nor on the stored map for any gamma "
        "tried.",
        (
            Part(
                "some finite reward is enough",
                Verdict.PROVED,
                "R* is finite",
                "if there is a way to the target",
            ),
            Part(
                "a greater K needs no smaller reward",
                Verdict.REFUTED,
                f"{FALLING}: {', '.join(f'{value:.3g}' for value in falls)} for K = "
                f"{', '.join(f'{k:g}' for k in FALLS_OVER)} (gamma = {FALLS_AT:g}); on random maps it rose, or "
                f"stayed, in {int(rises.sum())} of {rises.size} steps of K",
            ),
        ),
        (Table("the least reward at the target, N = 20, map units", heads, rows),),
        (
            (
                f"Rules, set before these maps were drawn: needed as a rule if the share of maps that need one is "
                f"shown to be above {MOSTLY:.0%} (exact binomial test) for every K; very large if the reward is shown "
                f"to be above {VERY_LARGE:g} times the cost of the best way (Wilcoxon) for every K and gamma. "
                "Contradicted if the opposite is shown for some, Holm over them; else undecided."
            ),
            (
                "D_n: least discounted cost of a way of n moves to the target; W: of one that never ends and never "
                "comes there."
            ),
            (
                "Without risk, moves along the axes cost h each, h (1 - gamma^n) / (1 - gamma) in all, and that is "
                "less than h / (1 - gamma), the cheapest way that never ends."
            ),
            (
                "Rewards for moves are minus their cost, -(length + K risk). What a learner needs after finitely "
                "many episodes is another matter. A very large reward is not needed, and does harm: with a discount "
                "it makes the fewest moves best, whatever their risk (C34)."
            ),
        ),
        counterexample=NEEDLESS,
    )
