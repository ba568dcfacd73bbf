"""Times of plans (C36, C47): what a clock says beside counted operations."""

import itertools
import re
import time

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import Contrast, contrast_part, contrast_table, span
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import log_shift
from cgla_graph.comparisons.claims.paper import printed_values
from cgla_graph.comparisons.claims.paper.flights import N, paper_lattice
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, learner
from cgla_graph.comparisons.claims.paper.operation_counts import integral_count, pair_count, relaxation_count
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get, solve

#: The paper's sizes of C47.
TIMED_SIZES = (15, 20, 25)
#: Plans of one kind in a row, of whose times the median counts.
REPEATS = 3


def _timed(problem: Problem, solver: Solver | str, n: int) -> tuple[float, Solution]:
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
    "Section 5.1",
    "CGLA takes 7.64 s where Q-Learning takes 26.5 s.",
    "The ratio of times of one plan on the map of Fig. 7, for several discounts.",
    Kind.SCENARIO,
    figures=("Fig. 7",),
)
def _check_c36(_: Evidence) -> Finding:
    problem = load_scenario("paper").problem
    solvers: dict[str, Solver] = {"CGLA": get("cgla"), **{name: learner(name) for name in LEARNERS}}
    for solver in solvers.values():
        solve(problem, solver, resolution=paper_lattice())
    timed = {name: _timed(problem, solver, N) for name, solver in solvers.items()}
    require(all(plan.status.has_path for _, plan in timed.values()), "one of them found no path")
    (ours, plan), *learnt = timed.values()
    counts = [_relaxations(problem), *(_updates(policy) for _, policy in learnt)]
    times = printed_values.TIMES
    rows: list[list[Entry]] = [
        ["the paper's CGLA", times.cgla, 1.0, None, None, None],
        ["the paper's Q-Learning", times.q_learning, times.ratio, None, None, None],
    ]
    for (name, (seconds, answer)), count in zip(timed.items(), counts, strict=True):
        rows.append([name, seconds, seconds / ours, answer.evaluations, count, answer.cost])
    updates = f"{min(counts[1:])} to {max(counts[1:])}"
    heads = ("planner", "seconds for one plan", "ratio to CGLA", "line integrals", "uses of Eq. 9 or 4", "cost")
    return Finding.single(
        Verdict.NOT_TESTABLE,
        f"Not comparable: neither the language nor episodes, alpha and gamma are printed. Ours: CGLA {ours:.3g} s, "
        f"Q-Learning {span([seconds for seconds, _ in learnt])} s for one plan, by discount and reward, of which "
        f"CGLA's are {plan.evaluations} line integrals and Q-Learning's {updates} updates. "
        "The ratio says how long one trains and how one integrates.",
        tables=(Table("one plan on the reconstructed map, N = 20", heads, rows, "our times are of one machine"),),
        notes=(
            (
                f"Times are medians of {REPEATS} warm plans with the weights they need, on a lattice of 20 x 20 "
                "points; they differ from run to run."
            ),
            (
                "Our Q-Learning is a planner in the style of the paper's peer, with defaults of ours, and needs the "
                "weights of eight neighbours only. gamma = 1 is outside of the paper's 0 <= gamma < 1."
            ),
        ),
        effect=f"ratio {span([seconds / ours for seconds, _ in learnt])}, by gamma and reward",
        printed=f"{times.ratio:.3g}",
    )


def _relaxations(problem: Problem) -> int:
    """Return how often CGLA uses Eq. 9 for a plan on the paper's lattice."""
    on = problem.on_lattice(paper_lattice()).with_weights_held()
    return relaxation_count(on.graph.n_nodes, cost_matrix(on.graph, on.target, source=on.source).rounds)


@claim(
    47,
    "Section 5.2.3, Fig. 11",
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
    seeds = evidence.scale.map_seeds(evidence.instances(200, 6))
    for n in TIMED_SIZES:
        solve(random_scenario(seeds[0]).problem, "cgla", resolution=paper_lattice(n))
    seconds = np.array([[_timed(random_scenario(seed).problem, "cgla", n)[0] for n in TIMED_SIZES] for seed in seeds])
    return judge_c47(seconds)


def judge_c47(seconds: FloatArray) -> Finding:
    """Decide by seconds of plans, shape ``(maps, 3)``, for N = 15, 20 and 25."""
    slower = [
        Contrast(f"N = {more} > {less}", {}, log_shift(seconds[:, i + 1], seconds[:, i]))
        for i, (less, more) in enumerate(itertools.pairwise(TIMED_SIZES))
    ]
    medians = [f"{value:.3g}" for value in np.median(seconds, axis=0)]
    ratios = [f"{one.shift.shift.median:.3g}" for one in slower]
    pairs = [pair_count(n * n) for n in TIMED_SIZES]
    counted = " and ".join(f"{more / less:.3g}" for less, more in itertools.pairwise(pairs))
    return Finding(
        (
            Part(
                "operations",
                Verdict.PROVED,
                "N^2 (N^2 - 1) / 2 integrals and uses of Eq. 9 at most, which grows with N",
            ),
            contrast_part("time of a plan", slower, condition="on our clock"),
        ),
        f"A plan takes {', '.join(medians)} s at N = {', '.join(map(str, TIMED_SIZES))} (medians of "
        f"{len(seconds)} maps): {' and '.join(ratios)} times as long with each step of N, where pairs are {counted} "
        "times as many.",
        tables=(contrast_table("time of a plan", slower),),
        notes=(f"Times are medians of {REPEATS} plans with all weights, on one machine; they differ from run to run.",),
    )
