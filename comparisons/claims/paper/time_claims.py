"""Times of plans (C36, C47): what a clock says beside counted operations."""

import itertools
import re
import time

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require, supported
from cgla_graph.comparisons.claims.contrasts import ALPHA, RULE
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import Shift, log_shift
from cgla_graph.comparisons.claims.paper import printed_values
from cgla_graph.comparisons.claims.paper.flights import N, paper_lattice
from cgla_graph.comparisons.claims.paper.operation_counts import integral_count, pair_count, relaxation_count
from cgla_graph.comparisons.statistics.paired import holm
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import solve

#: The paper's sizes of C47.
TIMED_SIZES = (15, 20, 25)
#: Plans of one kind in a row, of whose times the median counts.
REPEATS = 3


def _timed(problem: Problem, solver: str, n: int) -> tuple[float, Solution]:
    """Plan a few times; return the median of the seconds, weights included, and the last answer."""
    seconds = []
    for _ in range(REPEATS):
        began = time.perf_counter()
        answer = solve(problem, solver, resolution=paper_lattice(n))
        seconds.append(time.perf_counter() - began)
    return float(np.median(seconds)), answer


def _updates(answer: Solution) -> int:
    """Read from an answer of Q-Learning how often it updated a value."""
    found = re.search(r"(\d+) updates", answer.message)
    require(found, f"Q-Learning does not say how many updates it made: {answer.message!r}")
    return int(found[1]) if found else 0


@claim(
    36,
    "Section 5.2, Fig. 7",
    "CGLA takes 7.64 s where Q-Learning takes 26.5 s.",
    "The ratio of times of one plan on the map of Fig. 7.",
    Kind.SCENARIO,
    figures=("Fig. 7",),
)
def _check_c36(_: Evidence) -> Finding:
    problem = load_scenario("paper").problem
    solvers = ("cgla", "q-learning")
    for solver in solvers:
        solve(problem, solver, resolution=paper_lattice())
    (ours, plan), (learnt, policy) = (_timed(problem, solver, N) for solver in solvers)
    require(plan.status.has_path and policy.status.has_path, "one of the two found no path")
    uses = _relaxations(problem)
    updates = _updates(policy)
    times = printed_values.TIMES
    rows: list[list[Entry]] = [
        ["the paper's seconds", times.cgla, times.q_learning, times.ratio],
        ["our seconds for one plan", ours, learnt, learnt / ours],
        ["line integrals", plan.evaluations, policy.evaluations, policy.evaluations / plan.evaluations],
        ["uses of Eq. 9, or of Eq. 4", uses, updates, updates / uses],
        ["cost of the path", plan.cost, policy.cost, policy.cost / plan.cost],
    ]
    return Finding(
        Verdict.NOT_TESTABLE,
        f"Not comparable: neither the language nor episodes, alpha and gamma are printed. Ours: CGLA {ours:.3g} s "
        f"and Q-Learning {learnt:.3g} s for one plan (ratio {learnt / ours:.3g}, theirs {times.ratio:.3g}), of "
        f"which CGLA's are {plan.evaluations} line integrals and Q-Learning's {updates} updates. The ratio says "
        "how long one trains and how one integrates.",
        tables=(
            Table(
                "one plan on the reconstructed map, N = 20",
                ("", "CGLA", "Q-Learning", "ratio"),
                rows,
                "our times are of one machine",
            ),
        ),
        notes=(
            (
                f"Times are medians of {REPEATS} warm plans with the weights they need, on a lattice of 20 x 20 "
                "points; they differ from run to run."
            ),
            (
                "Our Q-Learning is a planner in the style of the paper's peer, with defaults of ours, and needs the "
                "weights of eight neighbours only."
            ),
        ),
    )


def _relaxations(problem: Problem) -> int:
    """Return how often CGLA uses Eq. 9 for a plan on the paper's lattice."""
    on = problem.on_lattice(paper_lattice()).weighed()
    return relaxation_count(on.graph.n_nodes, cost_matrix(on.graph, on.target, source=on.source).rounds)


@claim(
    47,
    "Section 5.3",
    "A greater N takes more time.",
    "Counted operations, and the time of a plan, grow from N = 15 over 20 to 25.",
    Kind.STATISTIC,
    figures=("Fig. 11",),
)
def _check_c47(evidence: Evidence) -> Finding:
    most = 200
    counts = [(pair_count(n * n), integral_count(n), relaxation_count(n * n, n * n)) for n in range(2, most)]
    for less, more in itertools.pairwise(counts):
        require(all(a < b for a, b in zip(less, more, strict=True)), f"a count does not grow: {less}, {more}")
    seeds = evidence.scale.map_seeds(evidence.instances(200, 8))
    for n in TIMED_SIZES:
        solve(random_scenario(seeds[0]).problem, "cgla", resolution=paper_lattice(n))
    seconds = np.array([[_timed(random_scenario(seed).problem, "cgla", n)[0] for n in TIMED_SIZES] for seed in seeds])
    return judge_c47(seconds)


def judge_c47(seconds: FloatArray) -> Finding:
    """Decide by seconds of plans, shape ``(maps, 3)``, for N = 15, 20 and 25."""
    shifts: list[Shift] = [log_shift(seconds[:, i + 1], seconds[:, i]) for i in range(len(TIMED_SIZES) - 1)]
    adjusted = holm([shift.p for shift in shifts])
    slower = all(p < ALPHA and shift.effect > 0.0 for p, shift in zip(adjusted, shifts, strict=True))
    rows: list[list[Entry]] = [
        [f"{more} against {less}", pair_count(more**2) / pair_count(less**2), *shift.shift, shift.effect, p]
        for (less, more), shift, p in zip(itertools.pairwise(TIMED_SIZES), shifts, adjusted, strict=True)
    ]
    ratios = [f"{one.shift.median:.3g} ({one.shift.low:.3g} to {one.shift.high:.3g})" for one in shifts]
    medians = [f"{value:.3g}" for value in np.median(seconds, axis=0)]
    return Finding(
        supported(slower),
        f"A plan takes {', '.join(medians)} s at N = {', '.join(map(str, TIMED_SIZES))} (medians of "
        f"{len(seconds)} maps): {', '.join(ratios)} times as long with each step of N.",
        (
            Part(
                "a greater N takes more integrals and uses of Eq. 9",
                Verdict.PROVED,
                "N^2 (N^2 - 1) / 2 of both at most, which grows with N",
            ),
            Part("it takes longer", supported(slower), "on the clock"),
        ),
        (Table("time of a plan", ("N", "ratio of pairs", "ratio of times", "from", "to", "effect", "p (Holm)"), rows),),
        (RULE, f"Times are medians of {REPEATS} plans with all weights, on one machine; they differ from run to run."),
    )
