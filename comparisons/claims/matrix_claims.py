"""The cost matrix: Lemma 1, Theorem 1, and what breaks without the Delta choice (C8 to C16, C24)."""

import itertools
import math
from collections.abc import Iterator
from typing import Any

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.cgla_matrix import CostMatrix, cost_matrix
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Claim, Entry, Finding, Kind, Part, Table, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.proving import improper_allowed, require
from cgla_graph.fusion import fused_graph
from cgla_graph.graph import GeometricGraph
from cgla_graph.lattice import Lattice
from cgla_graph.problem import GraphProblem
from cgla_graph.random_map import random_scenario
from cgla_graph.risk import RiskField
from cgla_graph.solvers.bridge import solve
from cgla_graph.solvers.cgla import Cgla
from cgla_graph.solvers.dijkstra import Dijkstra

#: Values of two algorithms that add the same weights in another order differ by no more than this, relative to them.
SAME = 1e-12
#: What is fairly near to a tie; random weights do not come nearer by chance.
TIED = 1e-9
#: Random draws of p_r that are made at most, in units of N^2.
MOST_DRAWS = 100
_UNIT = (0.0, 0.0, 1.0, 1.0)
#: A shorter proof of Theorem 1 than the paper's, which leaves the induction out and asserts that the new value is the
#: least of all, where it is the least of the unsettled ones (E15).
PROOF = (
    "Let all weights be positive. Claim: when a node r of Delta_k, the unsettled ones of least G, serves as p_r, "
    "its G is its least cost. If "
    "not, take a cheapest path from r to the target, and its last node u, seen from the target, before the first "
    "unsettled one, v. By "
    "induction G(u) is right and u has served, so G(v) <= A(v, u) + G(u), the cost of the path from v on. Then "
    "G(v) <= G*(r) < G(r), as "
    "weights are positive, which contradicts the choice of r. So each round settles one more node for good, and "
    "n rounds settle all that "
    "can reach the target."
)


def _random_graph(rng: np.random.Generator, most: int = 25) -> GeometricGraph:
    """Draw a graph: any positive weights, directed, some edges missing; or points in the plane under Eq. 5."""
    n = int(rng.integers(2, most))
    if rng.random() < 0.5:  # noqa: PLR2004 - half of each kind
        weights = rng.random((n, n)) + 1e-6
        weights[rng.random((n, n)) < rng.random() * 0.6] = np.inf
        return GeometricGraph.from_matrix(weights)
    return GeometricGraph.complete(rng.random((n, 2)), _random_field(rng), k=float(rng.uniform(0.0, 100.0)))


def _random_field(rng: np.random.Generator) -> RiskField:
    return random_scenario(int(rng.integers(2**31))).problem.field


def _least(graph: GeometricGraph, target: int) -> FloatArray:
    """Return G by scipy's Dijkstra."""
    weights = graph.weight_matrix().copy()
    np.fill_diagonal(weights, 0.0)
    # rows of ours lead to the target, scipy's lead away from it
    edges = csgraph.csgraph_from_dense(weights.T, null_value=np.inf)
    # the stubs of scipy know no sparse arrays here
    search: Any = csgraph.dijkstra
    found: FloatArray = search(edges, indices=target)
    return found


def _close(values: FloatArray, others: FloatArray) -> bool:
    return bool(np.allclose(values, others, rtol=SAME, atol=0.0, equal_nan=False))


def _eq9(weights: FloatArray, target: int, pivots: Iterator[int] | list[int]) -> Iterator[FloatArray]:
    """Yield G before the first and after each use of Eq. 9, to the letter."""
    values = np.full(len(weights), np.inf)
    values[target] = 0.0
    yield values.copy()
    for r in pivots:
        values = np.minimum(values, weights[:, r] + values[r])
        yield values.copy()


def check_lemma_1(evidence: Evidence) -> Finding:
    """C8, C9, C10: G never rises, never undercuts the least cost, and is A(., p_t) after the first round."""
    rng, count = evidence.rng("C8"), evidence.instances(400, 50)
    draws = 0
    for _ in range(count):
        graph = _random_graph(rng)
        n, target = graph.n_nodes, int(rng.integers(graph.n_nodes))
        pivots = [target, *rng.integers(n, size=3 * n).tolist()]
        weights = graph.weight_matrix().copy()
        np.fill_diagonal(weights, 0.0)
        least = _least(graph, target)
        steps = list(_eq9(weights, target, pivots))
        for before, after in itertools.pairwise(steps):
            require((after <= before).all(), "G rose")
            require((after >= least * (1.0 - SAME)).all(), "G fell below the least cost")
        require(np.array_equal(steps[1], weights[:, target]), "the first round is not A(., p_t)")
        ours = cost_matrix(graph, target, schedule="given", order=pivots)
        require(np.array_equal(ours.values, steps[-1]), "the toolkit's Eq. 9 is not the paper's")
        draws += len(pivots)
    return Finding(
        Verdict.PROVED,
        f"Asserted at each of {draws} uses of Eq. 9 with random p_r on {count} random graphs (directed, with "
        "missing edges, or geometric), where the toolkit's "
        "values are those of Eq. 9 to the letter.",
        notes=(
            (
                "Eq. 9 takes a minimum with the old value: no value rises. By induction each finite G(p_i) is the "
                "cost of some path from p_i to the "
                "target, so that it is never below the least cost, which is at least 0."
            ),
            (
                "In the first round only p_t has a finite value, 0, so that G becomes A(., p_t). (The paper's "
                "superscript at G of p_t should be 0.)"
            ),
        ),
    )


def check_c11(evidence: Evidence) -> Finding:
    """C11: with the Delta choice G converges in finitely many steps, and settled values stay."""
    rng, count = evidence.rng("C11"), evidence.instances(300, 40)
    for _ in range(count):
        graph = _random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        matrix = cost_matrix(graph, target)
        least = _least(graph, target)
        require(_close(matrix.values, least), "label setting is not scipy's Dijkstra")
        require(matrix.rounds == int(np.isfinite(least).sum()), "a round settled no node")
        partial = list(_eq9(_with_zero_diagonal(graph), target, matrix.order.tolist()))
        for number, node in enumerate(matrix.order.tolist()):
            require(
                all(values[node] == partial[number][node] for values in partial[number:]), "a settled value changed"
            )
        require(_close(partial[-2] if len(partial) > 2 else partial[-1], least), "the last round still changed a value")  # noqa: PLR2004
    stored = counterexamples.graph("pivot-left-out.json")
    left_out = cost_matrix(stored.graph, stored.target, schedule="given", order=["t", "s"] * 50)
    require(
        left_out.value("s") > cost_matrix(stored.graph, stored.target).value("s"), "the stored graph does not need a"
    )
    table, result = _without_delta(evidence)
    return Finding(
        Verdict.PROVED,
        f"With p_r from Delta_k each round settles one node for good: {count} random graphs, equal to scipy's "
        "Dijkstra; the last of the n rounds changes nothing. "
        f"With any p_r it is another matter: {result}",
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
                "Synchronous rounds need as many as the longest of the shortest best paths has edges; sweeps over "
                "all nodes never more."
            ),
        ),
        counterexample="pivot-left-out.json",
    )


def _with_zero_diagonal(graph: GeometricGraph) -> FloatArray:
    weights = graph.weight_matrix().copy()
    np.fill_diagonal(weights, 0.0)
    return weights


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
                rng.random((n, 2)), _random_field(rng), k=float(rng.choice([10.0, 50.0, 200.0]))
            )
            least = cost_matrix(graph, 0).values
            hops = _most_hops(graph, least)
            first = cost_matrix(graph, 0, schedule="given", order=[0, *rng.integers(n, size=n).tolist()])
            wrong.append(float((first.values > least * (1.0 + TIED)).mean()))
            until = cost_matrix(graph, 0, schedule="given", order=[0, *rng.integers(n, size=MOST_DRAWS * n).tolist()])
            require(until.converged and _close(until.values, least), "random p_r did not converge to G")
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
        f"after N^2 random ones {np.mean(shares):.0%} of the nodes are still wrong, and {np.median(needed):.1f} "
        "N^2 are needed on average "
        "(medians), which is finite with probability 1 but without a bound."
    )
    return table, result


def _most_hops(graph: GeometricGraph, least: FloatArray) -> int:
    """Return the greatest number of edges that any node's best path needs, of several best ones the fewest."""
    weights = _with_zero_diagonal(graph)
    tight = weights + least[None, :] <= least[:, None] * (1.0 + TIED)
    np.fill_diagonal(tight, val=False)
    hops = csgraph.shortest_path(csgraph.csgraph_from_dense(tight.T.astype(float)), unweighted=True, indices=0)
    return int(hops.max())


def check_c12(evidence: Evidence) -> Finding:
    """C12: the start comes into some Delta_k, and its value is final then."""
    rng, count = evidence.rng("C12"), evidence.instances(300, 40)
    saved = []
    for _ in range(count):
        graph = _random_graph(rng)
        source, target = (int(node) for node in rng.integers(graph.n_nodes, size=2))
        full, early = cost_matrix(graph, target), cost_matrix(graph, target, source=source)
        require(full.value(source) == early.value(source), "the early stop has another value at the source")
        if math.isfinite(full.value(source)) and source != target:
            costs = [GraphProblem(graph, source, target).evaluate(one.path_from(source)) for one in (full, early)]
            require(costs[0] == costs[1] or math.isclose(*costs, rel_tol=SAME), "the early stop has a dearer path")
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
    with improper_allowed():
        problem = counterexamples.scenario("printed-peaks.toml").problem
        weight = float(problem.model.weights([(0.42, 0.5)], [(0.58, 0.5)])[0])
    steps = list(_eq9(np.array([[0.0, weight], [weight, 0.0]]), 0, [0, 1] * 50))
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


def check_c14(evidence: Evidence) -> Finding:
    """C14: the path is optimal."""
    rng, count = evidence.rng("C14"), evidence.instances(150, 25)
    for _ in range(count):
        graph = _random_graph(rng, most=8)
        source, target = (int(node) for node in rng.integers(graph.n_nodes, size=2))
        answer = solve(GraphProblem(graph, source, target), Cgla())
        best = _brute_force(graph.weight_matrix(), source, target)
        require(
            math.isclose(answer.cost, best, rel_tol=SAME) or (math.isinf(best) and not answer.status.is_path),
            "a cheaper path exists",
        )
    excess = []
    for seed in evidence.scale.map_seeds(evidence.instances(60, 6)):
        problem = random_scenario(seed).problem
        lattice = solve(problem, Cgla(), resolution=Lattice(20, bounds=_UNIT, kind="upper")).cost
        excess.append(lattice / min(lattice, solve(problem, "hybrid").cost) - 1.0)
    require(_unsupported_is_missed(), "the stored graph's middle path is best for some K")
    return Finding(
        Verdict.PROVED,
        f"Of all paths on the lattice none is cheaper: equal to brute force on {count} graphs of up to 7 nodes. "
        "In the plane cheaper ones exist: the lattice of N = 20 "
        f"is {np.mean(excess):.2%} dearer on average ({max(excess):.1%} at most, {len(excess)} maps) than paths "
        "that leave it.",
        (
            Part("least J on the lattice", Verdict.PROVED, "Theorem 1, and brute force"),
            Part(
                "least J in the plane", Verdict.REFUTED, f"{np.mean(excess):.2%} above the best path known, on average"
            ),
            Part(
                "every trade of length for risk that is not dominated",
                Verdict.REFUTED,
                (
                    "a sum of both reaches corners of the convex hull only: of three paths in the stored graph the "
                    "middle one is best for no K"
                ),
            ),
        ),
        counterexample="unsupported-pair.json",
    )


def _brute_force(weights: FloatArray, source: int, target: int) -> float:
    if source == target:
        return 0.0
    others = [node for node in range(len(weights)) if node not in {source, target}]
    return min(
        math.fsum(weights[a, b] for a, b in itertools.pairwise((source, *between, target)))
        for size in range(len(others) + 1)
        for between in itertools.permutations(others, size)
    )


def _unsupported_is_missed() -> bool:
    """Tell whether the stored graph has a path that no other dominates, and that is best for no K from 0 to 10^6."""
    read = counterexamples.document("unsupported-pair.json")
    length, risk = counterexamples.weights(read["length"]), counterexamples.weights(read["risk"])
    ways = [[0, middle, 4] for middle in (1, 2, 3)]
    pairs = [
        tuple(sum(float(part[a, b]) for a, b in itertools.pairwise(way)) for part in (length, risk)) for way in ways
    ]
    undominated = all(not (p[0] <= q[0] and p[1] <= q[1]) for p, q in itertools.permutations(pairs, 2))
    found = set()
    for k in (0.0, *np.geomspace(1e-3, 1e6, 200).tolist()):
        weights = np.where(np.isfinite(length), length + k * np.where(np.isfinite(risk), risk, 0.0), np.inf)
        found.add(solve(GraphProblem(GeometricGraph.from_matrix(weights), 0, 4), Cgla()).nodes)
    return undominated and (0, 2, 4) not in found and {(0, 1, 4), (0, 3, 4)} <= found


def check_c15(evidence: Evidence) -> Finding:
    """C15: following the least A + G never runs in a circle."""
    rng, count = evidence.rng("C15"), evidence.instances(60, 8)
    circles = {"exact": 0, "raster": 0}
    walks = 0
    for _ in range(count):
        field, k = _random_field(rng), float(rng.choice([10.0, 50.0, 200.0]))
        lattice = Lattice(10, bounds=_UNIT, kind="upper")
        pivots = [0, *rng.integers(100, size=int(rng.integers(20, 400))).tolist()]
        for integral in ("exact", "raster"):
            graph = fused_graph(lattice, [field], k, integral="exact" if integral == "exact" else "raster")
            weights = _with_zero_diagonal(graph)
            matrix = cost_matrix(graph, 0, schedule="given", order=pivots)
            circles[integral] += sum(_runs_in_circle(weights, matrix, node) for node in range(1, 100))
            _ = [matrix.path_from(node) for node in range(100)]
        walks += 99
    require(circles["exact"] == 0, "a walk along the least A + G ran in a circle")
    return Finding(
        Verdict.PROVED,
        f"Also with a G that has not converged: none of {walks} walks with exact weights ran in a circle (raster "
        "weights, which differ there and back: "
        f"{circles['raster']}); neither did the successors that the toolkit records.",
        (
            Part("symmetric A, any G that Eq. 9 made", Verdict.PROVED, f"0 of {walks} walks"),
            Part(
                "one-sided raster sums",
                Verdict.NOT_SUPPORTED if circles["raster"] else Verdict.SUPPORTED,
                f"{circles['raster']} of {walks} walks ran in a circle",
            ),
        ),
        notes=(
            (
                "Each finite G_c other than the target's was set by Eq. 9 to A_cm + G_m at that time, and G_m has "
                "not risen since (Lemma 1). So the least A_cj + G_j is "
                "at most G_c, and G_j <= G_c - A_cj < G_c: along the walk G falls, and no node comes twice."
            ),
        ),
    )


def _runs_in_circle(weights: FloatArray, matrix: CostMatrix, node: int) -> bool:
    """Walk along the least A + G over nodes that have a value; tell whether one comes twice."""
    seen: set[int] = set()
    while node != matrix.target and node not in seen and math.isfinite(matrix.values[node]):
        seen.add(node)
        offers = weights[node] + matrix.values
        offers[node] = np.inf
        node = int(np.argmin(offers))
    return node in seen


def check_c16(_: Evidence) -> Finding:
    """C16: the best path is not unique if and only if some Delta_k has several nodes (Remark 1)."""
    star, diamond = (counterexamples.graph(f"remark-1-{name}.json") for name in ("star", "diamond"))
    sizes = {name: _delta_sizes(problem) for name, problem in (("star", star), ("diamond", diamond))}
    ways = {name: _best_paths(problem) for name, problem in (("star", star), ("diamond", diamond))}
    require(max(sizes["star"]) > 1 and ways["star"] == 1, "the star has no Delta set of two, or two best paths")
    require(max(sizes["diamond"]) == 1 and ways["diamond"] == 2, "the diamond has a Delta set of two, or one best path")  # noqa: PLR2004
    return Finding(
        Verdict.REFUTED,
        (
            "Both ways, by graphs of four nodes: one has two nodes in a Delta set and a single best path, the other "
            "has one node in each Delta set and two best paths."
        ),
        tables=(
            Table(
                "the two stored graphs",
                ("graph", "sizes of the Delta sets", "best paths"),
                [(name, ", ".join(map(str, sizes[name])), ways[name]) for name in sizes],
            ),
        ),
        notes=(
            (
                "remark-1-star.json is the other one. Delta_k compares costs to the target of different nodes, best "
                "paths are about one node."
            ),
        ),
        counterexample="remark-1-diamond.json",
    )


def _delta_sizes(problem: GraphProblem) -> list[int]:
    deltas: list[IntArray] = cost_matrix(problem.graph, problem.target).delta_sets
    return [len(delta) for delta in deltas]


def _best_paths(problem: GraphProblem) -> int:
    """Count the best paths of a small graph by trying all."""
    graph = problem.graph
    source, target = graph.index_of(problem.source), graph.index_of(problem.target)
    others = [node for node in range(graph.n_nodes) if node not in {source, target}]
    weights = graph.weight_matrix()
    costs = [
        float(sum(weights[a, b] for a, b in itertools.pairwise((source, *between, target))))
        for size in range(len(others) + 1)
        for between in itertools.permutations(others, size)
    ]
    return sum(math.isclose(cost, min(costs)) for cost in costs)


def check_c24(evidence: Evidence) -> Finding:
    """C24: dynamic programming cannot be used directly."""
    rng, count = evidence.rng("C24"), evidence.instances(40, 6)
    scenario = counterexamples.scenario("dynamic-programming.toml")
    on = scenario.problem.on_lattice(scenario.lattice)
    answers: dict[str, Any] = {
        "CGLA, label setting": on.judge(Cgla().solve(on)).cost,
        "CGLA, synchronous (value iteration)": cost_matrix(on.graph, on.target, schedule="synchronous").value(
            on.source
        ),
        "scipy's Dijkstra": on.judge(Dijkstra().solve(on)).cost,
    }
    require(max(answers.values()) <= min(answers.values()) * (1.0 + SAME), f"they differ: {answers}")
    for _ in range(count):
        graph = _random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        by_rounds = cost_matrix(graph, target, schedule="synchronous").values
        require(_close(by_rounds, cost_matrix(graph, target).values), "value iteration and label setting differ")
        with np.errstate(invalid="ignore"):
            again = np.minimum(by_rounds, (_with_zero_diagonal(graph) + by_rounds[None, :]).min(axis=1))
        require(_close(again, by_rounds), "G is no fixed point of Bellman's equation")
    return Finding(
        Verdict.REFUTED,
        f"Eq. 9 is dynamic programming: its fixed point is Bellman's equation. On the stored map and {count} "
        "random graphs, Dijkstra's algorithm (1959), value iteration "
        "and CGLA give the same values; label setting is Dijkstra's array version and looks at each pair once, "
        "like any other on a complete graph.",
        tables=(Table("the least cost on the stored map", ("method", "cost"), list(answers.items())),),
        notes=("Nothing is exhaustive about it: n rounds of n comparisons.",),
        counterexample="dynamic-programming.toml",
    )


def _claim(number: int, place: str, sentence: str, statement: str, kind: Kind, check: Any) -> Claim:  # noqa: ANN401 - a check
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
