"""Theorem 1: what the Delta choice of p_r is good for (C11)."""

import math

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Part, Table, Verdict, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.paper.random_graphs import (
    are_close,
    eq_9,
    least_costs,
    random_field,
    random_graph,
    zero_diagonal,
)
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph

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


def check_c11(evidence: Evidence) -> Finding:
    """C11: with the Delta choice G converges in finitely many steps, and settled values stay."""
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
        median = bootstrapped(draws, seed=evidence.scale.seed)
        shares += wrong
        needed += draws
        rows.append(
            [
                side,
                float(np.mean(wrong)),
                median.median,
                median.low,
                median.high,
                float(np.mean(sweeps)),
                float(np.mean(rounds)),
            ]
        )
    heads = (
        "N",
        "share of nodes wrong after N^2 random p_r",
        "random p_r needed / N^2",
        "from",
        "to",
        "sweeps",
        "synchronous rounds",
    )
    table = Table(
        f"without the Delta choice: N^2 nodes, ten threats, {each} maps each",
        heads,
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
