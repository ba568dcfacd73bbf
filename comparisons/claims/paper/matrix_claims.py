"""The cost matrix: Lemma 1, Theorem 1, and what its assumptions are for (C8 to C16, C24)."""

import itertools
import math

import numpy as np

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Check, Claim, Finding, Kind, Table, Verdict, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.paper.path_checks import check_c14, check_c15, check_c16
from cgla_graph.comparisons.claims.paper.pivot_checks import PROOF, check_c11
from cgla_graph.comparisons.claims.paper.random_graphs import (
    SAME,
    are_close,
    eq_9,
    least_costs,
    random_graph,
    zero_diagonal,
)
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.problem import GraphProblem
from cgla_graph.solvers.exact.cgla import Cgla
from cgla_graph.solvers.exact.dijkstra import Dijkstra


def check_lemma_1(evidence: Evidence) -> Finding:
    """C8, C9, C10: G never rises, never undercuts the least cost, and is A(., p_t) after the first round."""
    rng, count = evidence.rng("C8"), evidence.instances(400, 50)
    draws = 0
    for _ in range(count):
        graph = random_graph(rng)
        n, target = graph.n_nodes, int(rng.integers(graph.n_nodes))
        pivots = [target, *rng.integers(n, size=3 * n).tolist()]
        weights = graph.weight_matrix().copy()
        np.fill_diagonal(weights, 0.0)
        least = least_costs(graph, target)
        steps = list(eq_9(weights, target, pivots))
        for before, after in itertools.pairwise(steps):
            require((after <= before).all(), "G rose")
            require((after >= least * (1.0 - SAME)).all(), "G fell below the least cost")
        require(np.array_equal(steps[1], weights[:, target]), "the first round is not A(., p_t)")
        ours = cost_matrix(graph, target, schedule="given", order=pivots)
        require(np.array_equal(ours.values, steps[-1]), "the toolkit's Eq. 9 is not the paper's")
        draws += len(pivots)
    return Finding(
        Verdict.PROVED,
        f"Asserted at each of {draws} uses of Eq. 9 with random p_r on {count} random graphs (directed, with missing "
        "edges, or geometric), where the toolkit's values are those of Eq. 9 to the letter.",
        notes=(
            (
                "Eq. 9 takes a minimum with the old value: no value rises. By induction each finite G(p_i) is the "
                "cost of some path from p_i to the target, so that it is never below the least cost, which is at "
                "least 0."
            ),
            (
                "In the first round only p_t has a finite value, 0, so that G becomes A(., p_t). (The paper's "
                "superscript at G of p_t should be 0.)"
            ),
        ),
    )


def check_c12(evidence: Evidence) -> Finding:
    """C12: the start comes into some Delta_k, and its value is final then."""
    rng, count = evidence.rng("C12"), evidence.instances(300, 40)
    saved = []
    for _ in range(count):
        graph = random_graph(rng)
        source, target = (int(node) for node in rng.integers(graph.n_nodes, size=2))
        full, early = cost_matrix(graph, target), cost_matrix(graph, target, source=source)
        require(full.value(source) == early.value(source), "the early stop has another value at the source")
        if math.isfinite(full.value(source)) and source != target:
            costs = [GraphProblem(graph, source, target).evaluate(one.path_from(source)) for one in (full, early)]
            require(costs[0] == costs[1] or math.isclose(*costs, rel_tol=SAME), "the early stop costs more")
            saved.append(1.0 - early.rounds / full.rounds)
    return Finding(
        Verdict.PROVED,
        (
            f"On {count} random graphs the stop as soon as p_s is in Delta_k gives the same value and an equally good "
            f"path; it saves {np.mean(saved):.0%} of the rounds on average."
        ),
        notes=(
            PROOF,
            (
                "A node of Delta_k has its final value before it serves: those that serve before it have the same G "
                "at least."
            ),
        ),
    )


def check_c13(_: Evidence) -> Finding:
    """C13: with negative weights G has no bottom."""
    problem = counterexamples.scenario("printed-peaks.toml").problem
    weight = float(problem.model.weights([(0.42, 0.5)], [(0.58, 0.5)])[0])
    steps = list(eq_9(np.array([[0.0, weight], [weight, 0.0]]), 0, [0, 1] * 50))
    lows = [float(values.min()) for values in steps[2:]]
    require(
        weight < 0.0 and all(after < before for before, after in itertools.pairwise(lows)), "G did not fall for ever"
    )
    return Finding(
        Verdict.PROVED,
        (
            f"Two points of the stored map are joined by a weight of {weight:.3g}: Eq. 9, used in turn, lowers G by "
            f"that each time, {lows[-1]:.4g} after 100 uses, and has no bottom."
        ),
        notes=(
            (
                "The toolkit refuses weights below 0 in graphs that a user brings, and marks solvers on improper "
                "fields as unsupported."
            ),
        ),
        counterexample="printed-peaks.toml",
    )


def check_c24(evidence: Evidence) -> Finding:
    """C24: dynamic programming cannot be used directly."""
    rng, count = evidence.rng("C24"), evidence.instances(40, 6)
    scenario = counterexamples.scenario("dynamic-programming.toml")
    on = scenario.problem.on_lattice(scenario.lattice)
    answers: dict[str, float] = {
        "CGLA, label setting": on.judge(Cgla().solve(on)).cost,
        "CGLA, synchronous (value iteration)": cost_matrix(on.graph, on.target, schedule="synchronous").value(
            on.source
        ),
        "scipy's Dijkstra": on.judge(Dijkstra().solve(on)).cost,
    }
    require(max(answers.values()) <= min(answers.values()) * (1.0 + SAME), f"they differ: {answers}")
    for _ in range(count):
        graph = random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        by_rounds = cost_matrix(graph, target, schedule="synchronous").values
        require(are_close(by_rounds, cost_matrix(graph, target).values), "value iteration and label setting differ")
        with np.errstate(invalid="ignore"):
            again = np.minimum(by_rounds, (zero_diagonal(graph) + by_rounds[None, :]).min(axis=1))
        require(are_close(again, by_rounds), "G is no fixed point of Bellman's equation")
    return Finding(
        Verdict.REFUTED,
        f"Eq. 9 is dynamic programming: its fixed point is Bellman's equation. On the stored map and {count} random "
        "graphs, Dijkstra's algorithm (1959), value iteration and CGLA give the same values; label setting is "
        "Dijkstra's array version and looks at each pair once, like any other on a complete graph.",
        tables=(Table("the least cost on the stored map", ("method", "cost"), list(answers.items())),),
        notes=("Nothing is exhaustive about it: n rounds of n comparisons.",),
        counterexample="dynamic-programming.toml",
    )


def _claim(number: int, place: str, sentence: str, statement: str, kind: Kind, check: Check) -> Claim:
    return Claim(f"C{number}", place, sentence, statement, kind, check)


CLAIMS = (
    _claim(
        8,
        "Section 4.2.1, Lemma 1",
        "The values of G never rise.",
        "G^(k+1) <= G^k for any p_r and any weights.",
        Kind.PROOF,
        check_lemma_1,
    ),
    _claim(
        9,
        "Section 4.2.1 (implied)",
        "G bounds the least cost from above.",
        "G^k >= G* >= 0 at all k.",
        Kind.PROOF,
        check_lemma_1,
    ),
    _claim(
        10,
        "Section 4.2.1, Theorem 1",
        "The first round makes G the weights to the target.",
        "G^1 = A(., p_t).",
        Kind.PROOF,
        check_lemma_1,
    ),
    _claim(
        11,
        "Section 4.2.1, Theorem 1 (1), (2)",
        "With positive weights G converges in finitely many steps, and values that are settled stay.",
        "n rounds with p_r from Delta_k give G* on any graph of positive weights; what other choices of p_r need.",
        Kind.PROOF,
        check_c11,
    ),
    _claim(
        12,
        "Section 4.2.1, Theorem 1 (3)",
        "The start comes into some Delta_k, where the search may stop.",
        "G(p_s) at the first k with p_s in Delta_k is G*(p_s), and so is the cost of the path.",
        Kind.PROOF,
        check_c12,
    ),
    _claim(
        13,
        "Section 4.2.1, Theorem 1 (assumption)",
        "Weights have to be positive.",
        "With a weight below 0, Eq. 9 lowers G for ever.",
        Kind.PROOF,
        check_c13,
    ),
    _claim(
        14,
        "Abstract, Section 4.2.1",
        "The path found is optimal.",
        "No path on the lattice has a lower J; nor in the plane; nor is any trade of length for risk missed.",
        Kind.PROOF,
        check_c14,
    ),
    _claim(
        15,
        "Section 4.2.1, Step 3",
        "Reading the path off G leads to the target.",
        "Going to the node of least A + G, from any node, never passes one twice, whether G has converged or not.",
        Kind.PROPERTY,
        check_c15,
    ),
    _claim(
        16,
        "Section 4.2.1, Remark 1",
        "The best path is not unique if and only if some Delta_k has more than one point.",
        "Several best paths <=> |Delta_k| > 1 for some k.",
        Kind.PROOF,
        check_c16,
    ),
    _claim(
        24,
        "Section 4.1",
        "Dynamic programming cannot be used directly, and is exhaustive.",
        "Eq. 9, value iteration and Dijkstra's algorithm have different fixed points or costs.",
        Kind.PROOF,
        check_c24,
    ),
)
