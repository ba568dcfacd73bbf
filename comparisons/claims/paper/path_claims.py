"""Paths read off the cost matrix (C14 to C16): optimal, without circles, not always alone."""

import itertools
import math

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import KNOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import paper_lattice
from cgla_graph.comparisons.claims.panel.settings import FACTORS, GOALS, START
from cgla_graph.comparisons.claims.paper.random_graphs import TIED, least_costs, random_graph, runs_in_circle
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.cost_to_go.theorem_1 import SAME, eq_9, zero_diagonal
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.solvers import solve
from cgla_graph.solvers.exact.cgla import Cgla


@claim(
    14,
    "Abstract, Section 4.2.1",
    "The path found is optimal.",
    "All paths of small random graphs; for the size all kinds of maps and K, all known, against paths of the plane.",
    settings=KNOWN,
)
def _check_c14(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C14"), evidence.instances(150, 25)
    for _ in range(count):
        graph = random_graph(rng, most=8)
        source, target = (int(node) for node in rng.integers(graph.n_nodes, size=2))
        answer = solve(GraphProblem(graph, source, target), Cgla())
        best = min(_all_costs(graph.weight_matrix(), source, target))
        found = math.isclose(answer.cost, best, rel_tol=SAME) or (math.isinf(best) and not answer.status.has_path)
        require(found, "a cheaper path exists")
    stored = counterexamples.scenario("off-the-lattice.toml")
    bent = _excess(stored.problem, stored.lattice)
    # far more than solvers are inexact
    require(round(bent, 3) > 0.0, "the stored map shows no path that is cheaper off the lattice")
    where = "holds on the lattice, by what is known; fails in the plane"
    why = f"equal to the best of all paths on {count} graphs; a path between the points is {bent:.2%} cheaper."
    return Finding(
        (Row("no path has a lower J", Answer.DEPENDS, Basis.PROOF, where, _in_the_plane(evidence), why=why),),
        (
            "Theorem 1 (C11) proves it. The paper does not say among which paths, nor by what: these are readings.",
            "A flight with limited information is not optimal in hindsight: each plan is, of what is known by then.",
            "The lattice leaves out a margin of a cell at two borders, where paths of the plane may go.",
        ),
        counterexamples=("off-the-lattice.toml",),
    )


def _excess(problem: Problem, lattice: Lattice) -> float:
    """Return by how much the best path on a lattice costs more than the best one known in the plane."""
    on = solve(problem, Cgla(), resolution=lattice).cost
    return on / min(on, solve(problem, "hybrid").cost) - 1.0


def _in_the_plane(evidence: Evidence) -> str:
    """Return medians of the excess by K, over all kinds of maps: a kind has too few for one of its own."""
    maps, ks = evidence.maps(evidence.instances(10, 1)), evidence.panel.levels("k")
    medians = [np.median([_excess(one.problem(k), paper_lattice()) for one in maps]) for k in ks]
    return f"N = 20: {min(medians):.2%} to {max(medians):.2%} more (medians by K)".replace("%", " %")


def _all_costs(weights: FloatArray, source: int, target: int) -> list[float]:
    """List the costs of all paths of a small graph that pass no node twice."""
    if source == target:
        return [0.0]
    others = [node for node in range(len(weights)) if node not in {source, target}]
    return [
        math.fsum(weights[a, b] for a, b in itertools.pairwise((source, *between, target)))
        for size in range(len(others) + 1)
        for between in itertools.permutations(others, size)
    ]


@claim(
    15,
    "Section 4.2, Step 3",
    "Reading the path off G leads to the target.",
    "No part of the panel: a proof, asserted on random graphs, with a G that has not converged.",
)
def _check_c15(evidence: Evidence) -> Finding:
    rng, walks = evidence.rng("C15"), 0
    for _ in range(evidence.instances(600, 100)):
        graph = random_graph(rng)
        n, target = graph.n_nodes, int(rng.integers(graph.n_nodes))
        pivots = [target, *rng.integers(n, size=int(rng.integers(4 * n))).tolist()]
        weights = zero_diagonal(graph)
        *_, values = eq_9(weights, target, pivots)
        require(not _in_circles(weights, values, target), "a walk along the least A + G ran in a circle")
        matrix = cost_matrix(graph, target, schedule="given", order=pivots)
        reached = np.flatnonzero(np.isfinite(matrix.values)).tolist()
        require(all(matrix.path_from(node)[-1] == target for node in reached), "the successors lead elsewhere")
        walks += len(reached)
    stored = counterexamples.graph("against-the-direction.json")
    weights, target = zero_diagonal(stored.graph), stored.graph.index_of(stored.target)
    *_, values = eq_9(weights.T, target, [*range(len(weights))] * len(weights))
    require(_in_circles(weights, values, target), "the walk on the stored graph runs in no circle")
    where = "if weights are positive and A is read as Eq. 9 reads it; G need not converge"
    why = f"Along the walk G falls, so that no node comes twice: {walks} walks on random graphs ran in no circle."
    note = (
        "Each finite G_c other than the target's was set by Eq. 9 to A_cm + G_m, and G_m has not risen since: "
        "the least A_cj + G_j is at most G_c, and G_j <= G_c - A_cj < G_c. Read the other way, one-sided weights of a "
        "general graph send the walk in a circle: against-the-direction.json."
    )
    row = Row("the walk along least A + G arrives", Answer.HOLDS, Basis.PROOF, where, why=why)
    return Finding((row,), (note,), counterexamples=("against-the-direction.json",))


def _in_circles(weights: FloatArray, values: FloatArray, target: int) -> int:
    """Walk along the least A + G from all nodes of finite G; count the walks that run in a circle."""
    return sum(runs_in_circle(weights, values, node, target) for node in range(len(values)))


@claim(
    16,
    "Section 4.2.2, Remark 1",
    "The best path is not unique if some Delta_k has more than one point before p_s is reached.",
    "No part of the panel: one lattice of Eq. 5 decides it. All segments between points are edges, as in the paper.",
)
def _check_c16(_: Evidence) -> Finding:
    stored = counterexamples.scenario("remark-1-lattice.toml")
    sizes = _tied_but_unique(stored.problem.on_lattice(stored.lattice))
    require(sizes[1] == 4, "the points nearest to the goal are not four")  # noqa: PLR2004 - the neighbours of a point
    # the first plan of a flight, before a threat is seen
    unseen = Problem(START, GOALS["aside"], RiskField(), k=FACTORS["k"][0], bounds=stored.problem.bounds)
    _tied_but_unique(unseen.on_lattice(paper_lattice()))
    why = "On remark-1-lattice.toml Delta_1 has 4 points, yet only the straight line is best, whichever serves first."
    where = "lattices of Eq. 5, with K = 0 or no threat known"
    note = f"So it is on the paper's lattice in the first plan to {GOALS['aside']}, before a threat is seen."
    row = Row("a tie in Delta_k means several best paths", Answer.FAILS, Basis.COUNTEREXAMPLE, where, why=why)
    return Finding((row,), (note,), counterexamples=("remark-1-lattice.toml",))


def _tied_but_unique(problem: GraphProblem) -> list[int]:
    """Assert that Delta sets before the source's have several points and one path is best; return their sizes."""
    graph, source = problem.graph, problem.graph.index_of(problem.source)
    sets = cost_matrix(graph, problem.target).delta_sets
    sizes = [len(delta) for delta in itertools.takewhile(lambda delta: source not in delta, sets)]
    require(max(sizes) > 1, "no Delta set before the source's has several points")
    require(_best_paths(graph, source, graph.index_of(problem.target)) == 1, "several paths are best")
    for seed in range(5):
        path = cost_matrix(graph, problem.target, seed=seed).path_from(problem.source)
        require(path == [problem.source, problem.target], "the choice within a Delta set makes another path")
    return sizes


def _best_paths(graph: GeometricGraph, source: int, target: int) -> int:
    """Count the best paths by scipy's least costs: those along edges on which the costs to go fall by the weight."""
    weights, least = zero_diagonal(graph), least_costs(graph, target)
    np.fill_diagonal(weights, np.inf)
    ways = np.zeros(len(least), dtype=np.int64)
    ways[target] = 1
    for node in np.argsort(least).tolist():
        if node != target:
            ways[node] = ways[weights[node] + least <= least[node] * (1.0 + TIED)].sum()
    return int(ways[source])
