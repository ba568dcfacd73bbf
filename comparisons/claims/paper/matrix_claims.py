"""The cost matrix: Lemma 1, Theorem 1, and what its assumptions are for (C8 to C16, C24)."""

import itertools
import math

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.paper.random_graphs import (
    SAME,
    are_close,
    eq_9,
    least_costs,
    random_field,
    random_graph,
    zero_diagonal,
)
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.solvers.exact.cgla import Cgla
from cgla_graph.solvers.exact.dijkstra import Dijkstra

#: What is fairly near to a tie; random weights do not come nearer by chance.
TIED = 1e-9
#: Random draws of p_r that are made at most, in units of N^2.
MOST_DRAWS = 100
#: A shorter proof of Theorem 1 than the paper's, which leaves the induction out and asserts that the new value is the
#: least of all, where it is the least of the unsettled ones (E15).
PROOF = (
    "Let all weights be positive. Claim: when a node r of Delta_k, the unsettled ones of least G, serves as p_r, its "
    "G is its least cost. If not, take a cheapest path from r to the target, and its last node u, seen from the "
    "target, before the first unsettled one, v. By induction G(u) is right and u has served, so G(v) <= A(v, u) + "
    "G(u), the cost of the path from v on. Then G(v) <= G*(r) < G(r), as weights are positive, which contradicts the "
    "choice of r. So each round settles one more node for good, and n rounds settle all that can reach the target."
)


def _check_lemma_1(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C8"), evidence.instances(400, 50)
    draws = 0
    for _ in range(count):
        graph = random_graph(rng)
        n, target = graph.n_nodes, int(rng.integers(graph.n_nodes))
        pivots = [target, *rng.integers(n, size=3 * n).tolist()]
        weights = zero_diagonal(graph)
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


_c8 = claim(
    8,
    "Section 4.2.1, Lemma 1",
    "The values of G never rise.",
    "G^(k+1) <= G^k for any p_r and any weights.",
    Kind.PROOF,
)(_check_lemma_1)
_c9 = claim(
    9, "Section 4.2.1 (implied)", "G bounds the least cost from above.", "G^k >= G* >= 0 at all k.", Kind.PROOF
)(_check_lemma_1)
_c10 = claim(
    10, "Section 4.2.1, Theorem 1", "The first round makes G the weights to the target.", "G^1 = A(., p_t).", Kind.PROOF
)(_check_lemma_1)


@claim(
    12,
    "Section 4.2.1, Theorem 1 (3)",
    "The start comes into some Delta_k, where the search may stop.",
    "G(p_s) at the first k with p_s in Delta_k is G*(p_s), and so is the cost of the path.",
    Kind.PROOF,
)
def _check_c12(evidence: Evidence) -> Finding:
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
        f"On {count} random graphs the stop as soon as p_s is in Delta_k gives the same value and an equally good "
        f"path; it saves {np.mean(saved):.0%} of the rounds on average.",
        notes=(
            PROOF,
            (
                "A node of Delta_k has its final value before it serves: those that serve before it have the same G "
                "at least."
            ),
        ),
    )


@claim(
    13,
    "Section 4.2.1, Theorem 1 (assumption)",
    "Weights have to be positive.",
    "With a weight below 0, Eq. 9 lowers G for ever.",
    Kind.PROOF,
)
def _check_c13(_: Evidence) -> Finding:
    problem = counterexamples.scenario("printed-peaks.toml").problem
    weight = float(problem.model.weights([(0.42, 0.5)], [(0.58, 0.5)])[0])
    steps = list(eq_9(np.array([[0.0, weight], [weight, 0.0]]), 0, [0, 1] * 50))
    lows = [float(values.min()) for values in steps[2:]]
    require(
        weight < 0.0 and all(after < before for before, after in itertools.pairwise(lows)), "G did not fall for ever"
    )
    return Finding(
        Verdict.PROVED,
        f"Two points of the stored map are joined by a weight of {weight:.3g}: Eq. 9, used in turn, lowers G by "
        f"that each time, {lows[-1]:.4g} after 100 uses, and has no bottom.",
        notes=(
            (
                "The toolkit refuses weights below 0 in graphs that a user brings, and marks solvers on improper "
                "fields as unsupported."
            ),
        ),
        counterexample="printed-peaks.toml",
    )


@claim(
    24,
    "Section 4.1",
    "Dynamic programming cannot be used directly, and is exhaustive.",
    "Eq. 9, value iteration and Dijkstra's algorithm have different fixed points or costs.",
    Kind.PROOF,
)
def _check_c24(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C24"), evidence.instances(40, 6)
    scenario = counterexamples.scenario("dynamic-programming.toml")
    on = scenario.problem.on_lattice(scenario.lattice)
    together = cost_matrix(on.graph, on.target, schedule="synchronous")
    answers = {
        "CGLA, label setting": on.judge(Cgla().solve(on)).cost,
        "CGLA, synchronous (value iteration)": together.value(on.source),
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


@claim(
    11,
    "Section 4.2.1, Theorem 1 (1), (2)",
    "With positive weights G converges in finitely many steps, and values that are settled stay.",
    "n rounds with p_r from Delta_k give G* on any graph of positive weights; what other choices of p_r need.",
    Kind.PROOF,
)
def _check_c11(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C11"), evidence.instances(300, 40)
    for _ in range(count):
        graph = random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        matrix = cost_matrix(graph, target)
        least = least_costs(graph, target)
        require(are_close(matrix.values, least), "label setting is not scipy's Dijkstra")
        require(matrix.rounds == int(np.isfinite(least).sum()), "a round settled no node")
        partial = list(eq_9(zero_diagonal(graph), target, matrix.order.tolist()))
        for number, node in enumerate(matrix.order.tolist()):
            require(
                all(values[node] == partial[number][node] for values in partial[number:]), "a settled value changed"
            )
        # of a graph of one node, the first round is the last
        require(are_close(partial[max(1, len(partial) - 2)], least), "the last round still changed a value")
    stored = counterexamples.graph("pivot-left-out.json")
    left_out = cost_matrix(stored.graph, stored.target, schedule="given", order=["t", "s"] * 50)
    require(
        left_out.value("s") > cost_matrix(stored.graph, stored.target).value("s"), "the stored graph does not need a"
    )
    table, result = _without_delta(evidence)
    return Finding(
        Verdict.PROVED,
        f"With p_r from Delta_k each round settles one node for good: {count} random graphs, equal to scipy's "
        f"Dijkstra; the last of the n rounds changes nothing. With any p_r it is another matter: {result}",
        (
            Part(
                "p_r from Delta_k, positive weights",
                Verdict.PROVED,
                f"{count} random graphs; n rounds, of which the last is idle",
            ),
            Part(
                "any p_r, as Step 2 says at first",
                Verdict.REFUTED,
                "if a node that is needed never serves, its neighbours stay wrong for ever (stored graph)",
            ),
        ),
        (table,),
        (
            PROOF,
            (
                "Synchronous rounds need as many as the longest of the shortest best paths has edges; sweeps over all "
                "nodes never more."
            ),
        ),
        counterexample="pivot-left-out.json",
    )


def _without_delta(evidence: Evidence) -> tuple[Table, str]:
    """Count what other choices of p_r need, on points in the plane under Eq. 5 (in general position: no ties)."""
    rng, each = evidence.rng("C11 pivots"), evidence.instances(40, 6)
    rows: list[list[Entry]] = []
    shares, needed = [], []
    for side in (8, 10, 12, 15):
        n = side * side
        wrong, draws, sweeps, rounds = [], [], [], []
        for _ in range(each):
            graph = GeometricGraph.complete(
                rng.random((n, 2)), random_field(rng), k=float(rng.choice([10.0, 50.0, 200.0]))
            )
            least = cost_matrix(graph, 0).values
            hops = _most_hops(graph, least)
            first = cost_matrix(graph, 0, schedule="given", order=[0, *rng.integers(n, size=n).tolist()])
            wrong.append(float((first.values > least * (1.0 + TIED)).mean()))
            until = cost_matrix(graph, 0, schedule="given", order=[0, *rng.integers(n, size=MOST_DRAWS * n).tolist()])
            require(until.converged and are_close(until.values, least), "random p_r did not converge to G")
            draws.append(until.rounds / n)
            swept = cost_matrix(graph, 0, schedule="given", order=[0, *(hops + 1) * list(range(n))])
            require(swept.converged, f"{hops + 1} sweeps do not do, but best paths have at most {hops} edges")
            sweeps.append(math.ceil((swept.rounds - 1) / n))
            together = cost_matrix(graph, 0, schedule="synchronous")
            require(
                together.rounds == hops, f"{together.rounds} synchronous rounds, but best paths have up to {hops} edges"
            )
            rounds.append(together.rounds)
        shares += wrong
        needed += draws
        middle = bootstrapped(draws, seed=evidence.scale.seed)
        rows.append([side, *(float(value) for value in (np.mean(wrong), *middle, np.mean(sweeps), np.mean(rounds)))])
    wrong_after = "share of nodes wrong after N^2 random p_r"
    table = Table(
        f"without the Delta choice: N^2 nodes, ten threats, {each} maps each",
        ("N", wrong_after, "random p_r needed / N^2", "from", "to", "sweeps", "synchronous rounds"),
        rows,
        "medians with 95 % BCa intervals; sweeps and rounds: means",
    )
    result = (
        f"after N^2 random ones {np.mean(shares):.0%} of the nodes are still wrong, and {np.median(needed):.1f} N^2 "
        "are needed on average (medians), which is finite with probability 1 but without a bound."
    )
    return table, result


def _most_hops(graph: GeometricGraph, least: FloatArray) -> int:
    """Return the greatest number of edges that any node's best path needs, of several best ones the fewest."""
    weights = zero_diagonal(graph)
    tight = weights + least[None, :] <= least[:, None] * (1.0 + TIED)
    np.fill_diagonal(tight, val=False)
    hops = csgraph.shortest_path(csgraph.csgraph_from_dense(tight.T.astype(float)), unweighted=True, indices=0)
    return int(hops.max())
