"""The cost matrix (C8 to C13, C24): Lemma 1, Theorem 1, its assumptions, and dynamic programming."""

import itertools
import math

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, KNOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, fly, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import START
from cgla_graph.comparisons.claims.paper.random_graphs import TIED, least_costs, random_graph, runs_in_circle
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.theorem_1 import SAME, are_close, eq_9, zero_diagonal
from cgla_graph.mission.records import UavFlight
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.solvers import get
from cgla_graph.solvers.exact.cgla import Cgla
from cgla_graph.solvers.exact.dijkstra import Dijkstra

#: A shorter proof of Theorem 1 than the paper's, without its gaps (E15).
PROOF = (
    "Let no weight be below 0. Claim: when a node r of Delta_k, the unsettled ones of least G, serves as p_r, its G is "
    "its least cost. If not, take a cheapest path from r to the target, and its last node u, seen from the target, "
    "before the first unsettled one, v. By induction G(u) is right and u has served, so G(v) <= A(v, u) + G(u), the "
    "cost of the path from v on. Then G(v) <= G*(r) < G(r), which contradicts the choice of r. Nodes that serve later "
    "have no lesser G, so that they change no settled value. So each round settles one more node for good, and n "
    "rounds settle all that can reach the target."
)
_ON_GRAPHS = "No part of the panel: it is a proof, asserted on random graphs, directed ones and ones of Eq. 5."
#: A map of Eq. 5 for what any map shows, and the graph on which the steps of the paper's own proof fail.
MAP, GAPS = "dynamic-programming.toml", "theorem-1-proof.json"


@claim(8, "Section 4.2.1, Lemma 1", "The values of G never rise.", _ON_GRAPHS, merged=(9, 10))
def _check_c8(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C8"), evidence.instances(400, 50)
    why = f"Eq. 9 takes a minimum with the old value: {sum(_assert_eq_9(rng) for _ in range(count))} uses of it."
    return Finding(
        (
            _holds("G never rises", "for any p_r and any weights", why),
            _holds("G is at least the least cost", "if no weight is below 0", "G is the cost of a way."),
            _holds("the first round gives A(., p_t)", "if p_t serves first", "Only G(p_t) is finite."),
        ),
        notes=(
            "By induction: G(p_t) = 0 is the cost of staying, and A(p_i, p_r) + G(p_r) that of going to p_r first.",
            "The paper's superscript at the first G of p_t should be 0.",
        ),
    )


def _holds(statement: str, where: str, why: str) -> Row:
    return Row(statement, Answer.HOLDS, Basis.PROOF, where, why=why)


def _assert_eq_9(rng: np.random.Generator) -> int:
    """Assert what holds of each use of Eq. 9 with random p_r on a random graph; return how many uses there were."""
    graph = random_graph(rng)
    n, target = graph.n_nodes, int(rng.integers(graph.n_nodes))
    pivots = [target, *rng.integers(n, size=3 * n).tolist()]
    weights, least = zero_diagonal(graph), least_costs(graph, target)
    steps = list(eq_9(weights, target, pivots))
    ours = cost_matrix(graph, target, schedule="given", order=pivots)
    require(np.array_equal(ours.values, steps[-1]), "the toolkit's Eq. 9 is not the paper's")
    for values in (steps, list(eq_9(weights - rng.random(weights.shape), target, pivots))):
        require(all((after <= before).all() for before, after in itertools.pairwise(values)), "G rose")
    require((least >= 0.0).all(), "a least cost is below 0")
    require(all((values >= least * (1.0 - SAME)).all() for values in steps), "G fell below the least cost")
    matrix = cost_matrix(graph, target)
    require(matrix.order[0] == target, "p_t is not what Delta_0 consists of")
    require(np.array_equal(matrix.history()[1], weights[:, target]), "the first round is not A(., p_t)")
    *_, idle = eq_9(weights, target, [node for node in range(n) if node != target])
    require(np.isfinite(idle).sum() == 1, "a p_r of infinite G changed a value")
    return len(pivots)


@claim(
    11,
    "Section 4.2.1, Theorem 1 (1), (2)",
    "With positive weights G converges in finitely many steps, and settled values stay.",
    f"{_ON_GRAPHS} Random p_r: all kinds of maps and K, all known, N = 10.",
    settings=KNOWN,
)
def _check_c11(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C11"), evidence.instances(300, 40)
    for _ in range(count):
        graph = random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        least = least_costs(graph, target)
        # whichever of several nodes of Delta_k serves
        for seed in (None, int(rng.integers(2**31))):
            matrix = cost_matrix(graph, target, seed=seed)
            require(are_close(matrix.values, least), "label setting is not scipy's Dijkstra")
            require(matrix.rounds == int(np.isfinite(least).sum()), "a round settled no node")
            _assert_proof(matrix, least)
    _assert_gaps()
    rounds, wrong = _random_pivots(evidence)
    where = "holds with p_r from Delta_k, or random (probability 1); fails with any p_r, as Step 2 begins"
    why = (
        f"Each round out of Delta_k settles a node ({count} random graphs, equal to scipy's Dijkstra); without one "
        f"needed node others stay wrong ({MAP}). After N^2 random p_r {wrong:.0%} of the nodes are wrong."
    )
    gaps = f"Two of its steps are false on {GAPS} and on {MAP}, a map of Eq. 5; it can be repaired."
    return Finding(
        (
            Row("G converges, and settled values stay", Answer.DEPENDS, Basis.PROOF, where, rounds, why=why),
            Row("the printed proof is complete", Answer.FAILS, Basis.COUNTEREXAMPLE, why=gaps),
        ),
        notes=(
            f"A proof without gaps, of which each step is asserted in every round of {2 * count} runs: {PROOF}",
            "Printed: G falls; G of p_r is the least of all; a value that the next round leaves is settled (Eq. 13).",
            "So: G does not rise; it is the least of the unsettled ones; later p_r have no lesser G.",
            "Random p_r: those of a best path of h edges serve in its order after h N^2 draws on average.",
        ),
        counterexamples=(GAPS, MAP),
    )


def _assert_proof(matrix: CostMatrix, least: FloatArray) -> None:
    """Assert each step of `PROOF` in each round of label setting."""
    weights, history, order = zero_diagonal(matrix.graph), matrix.history(), matrix.order.tolist()
    n = len(weights)
    for number, r in enumerate(order):
        before, after = history[number], history[number + 1]
        served, unsettled = order[:number], np.ones(n, dtype=np.bool_)
        unsettled[served] = False
        require(before[r] == before[unsettled].min(), "p_r is not in Delta_k")
        require(are_close(before[r : r + 1], least[r : r + 1]), "p_r is not at its least cost")
        require(all(before[w] <= before[r] for w in served), "a later p_r has a lesser G")
        if served:
            offers = (weights[:, served] + before[served]).min(axis=1)
            require(np.array_equal(before[unsettled], offers[unsettled]), "G is not the least over those that served")
        on_path = [matrix.graph.index_of(node) for node in matrix.path_from(matrix.graph.labels[r])]
        require(set(on_path[1:]) <= set(served), "a best path leaves r for a node that has not served")
        require((after[served] == before[served]).all() and after[r] == before[r], "a settled value changed")
    require(are_close(history[-1], least), "the rounds do not end with the least costs")
    # of a graph of one node, the first round is the last
    require(are_close(history[max(1, len(order) - 1)], least), "the last round still changed a value")


def _stored_map() -> GraphProblem:
    """Lay the lattice over the stored map: A is as in Eq. 5."""
    scenario = counterexamples.scenario(MAP)
    return scenario.problem.on_lattice(scenario.lattice)


def _assert_gaps() -> None:
    """Assert what is not so in Step 2 as printed and in the printed proof, on the stored graph and the stored map."""
    stored, on = counterexamples.graph(GAPS), _stored_map()
    for problem in (stored, on):
        matrix = cost_matrix(problem.graph, problem.target)
        rounds, second = matrix.history(), int(matrix.order[1])
        require(rounds[1][second] > rounds[1][matrix.target], "the second p_r is of least G among all")
        stays = np.isfinite(rounds[1]) & (rounds[2] == rounds[1])
        falls = rounds[-1][stays] < rounds[2][stays] * (1.0 - TIED)
        require(falls.any(), "no value falls after a round that left it")
    rounds = cost_matrix(stored.graph, stored.target).history()
    require(np.array_equal(rounds[2], rounds[1]), "round 2 of the stored graph changes a value")
    require(np.isinf(rounds[-1]).any(), "every node of the stored graph reaches t")
    right = cost_matrix(on.graph, on.target)
    needed = right.path_from(on.source)[1]
    others = [on.target, *(node for node in on.graph.labels if node != needed)]
    left_out = cost_matrix(on.graph, on.target, schedule="given", order=others * on.graph.n_nodes)
    require(left_out.value(on.source) > right.value(on.source) * (1.0 + TIED), "no node of the stored map is needed")


def _random_pivots(evidence: Evidence) -> tuple[str, float]:
    """Count rounds with random p_r on maps of the panel; return their medians by K, and how much N^2 leave wrong."""
    rng, each = evidence.rng("C11 random p_r"), evidence.instances(5, 1)
    maps = evidence.maps(each)
    found = []
    for k, one in itertools.product(evidence.panel.levels("k"), maps):
        on = one.problem(k).on_lattice(paper_lattice(10))
        graph, n = on.graph.with_weights_held(), on.graph.n_nodes
        least = cost_matrix(graph, on.target).values
        drawn = cost_matrix(graph, on.target, schedule="random", seed=int(rng.integers(2**31)))
        require(drawn.converged and are_close(drawn.values, least), "random p_r did not converge to G")
        early = cost_matrix(graph, on.target, schedule="given", order=drawn.order[:n].tolist())
        found.append((drawn.rounds / n, (early.values > least * (1.0 + TIED)).mean()))
    rounds, wrong = np.reshape(found, (-1, len(maps), 2)).transpose(2, 0, 1)
    medians = np.median(rounds, axis=1)
    return f"random: {medians.min():.3g} to {medians.max():.3g} N^2 rounds", float(wrong.mean())


@claim(12, "Section 4.2.1, Theorem 1 (3)", "The start comes into some Delta_k, where the search may stop.", _ON_GRAPHS)
def _check_c12(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C12"), evidence.instances(300, 40)
    for _ in range(count):
        graph = random_graph(rng)
        source, target = (int(node) for node in rng.integers(graph.n_nodes, size=2))
        full, early = cost_matrix(graph, target), cost_matrix(graph, target, source=source)
        final = full.value(source)
        require(final == early.value(source), "the early stop has another value at the source")
        came = [number for number, delta in enumerate(full.delta_sets) if source in delta]
        require(bool(came) == math.isfinite(final), "p_s is in no Delta_k, or in one without a way")
        require(not came or full.history()[came[0]][source] == final, "p_s is in Delta_k before its value is final")
        if came and source != target:
            costs = [GraphProblem(graph, source, target).evaluate(one.path_from(source)) for one in (full, early)]
            require(math.isclose(*costs, rel_tol=SAME), "the early stop costs more")
    why = f"Each round settles a node (C11): those before p_s have no greater G. Asserted on {count} random graphs."
    return Finding((_holds("p_s comes into Delta_k, at its least cost", "if p_s can reach p_t, weights >= 0", why),))


@claim(
    13,
    "Section 4.2.1, Theorem 1 (assumption)",
    "Weights have to be positive.",
    "No part of the panel: two points of Eq. 5 with Eq. 1 as printed, and graphs with weights of 0.",
)
def _check_c13(evidence: Evidence) -> Finding:
    model = counterexamples.scenario("printed-peaks.toml").problem.model
    weight = float(model.weights([(0.42, 0.5)], [(0.58, 0.5)])[0])
    lows = [float(values.min()) for values in eq_9(np.array([[0.0, weight], [weight, 0.0]]), 0, [0, 1] * 50)][2:]
    require(weight < 0.0 and all(after < before for before, after in itertools.pairwise(lows)), "G stops falling")
    rng, count = evidence.rng("C13"), evidence.instances(200, 30)
    for _ in range(count):
        weights = zero_diagonal(random_graph(rng))
        weights[np.isfinite(weights) & (rng.random(weights.shape) < rng.random())] = 0.0
        target = int(rng.integers(len(weights)))
        matrix = cost_matrix(GeometricGraph.from_matrix(weights), target)
        *_, least = eq_9(weights, target, list(range(len(weights))) * len(weights))
        require(are_close(matrix.values, least), "with weights of 0, n rounds are not enough")
    stored = counterexamples.graph("zero-weights.json")
    converged = cost_matrix(stored.graph, stored.target)
    require(converged.residual() == 0.0, "Eq. 9 has not converged on the stored graph")
    source, edges = stored.graph.index_of(stored.source), zero_diagonal(stored.graph)
    require(runs_in_circle(edges, converged.values, source, converged.target), "the walk runs in no circle")
    require(len(converged.path_from(stored.source)) > 1, "the successors do not lead to the target")
    where = "two points, with Eq. 1 as printed"
    why = f"A weight of {weight:.3g} joins them (printed-peaks.toml): each use of Eq. 9 lowers G, settled or not."
    below = Row("weights must not be below 0", Answer.HOLDS, Basis.COUNTEREXAMPLE, where, why=why)
    where = "fails for G to converge; holds for paths read off G on general graphs (not Eq. 5)"
    why = (
        f"n rounds give G* on {count} random graphs with zeros; on zero-weights.json the way along the least A + G "
        "runs in a circle between two nodes of equal G."
    )
    zero = Row("weights must not be 0", Answer.DEPENDS, Basis.COUNTEREXAMPLE, where, why=why)
    note = "In the toolkit 0 does no harm, as it records where values come from."
    return Finding((below, zero), (note,), counterexamples=("printed-peaks.toml", "zero-weights.json"))


@claim(
    24,
    "Section 4.1",
    "Dynamic programming cannot be used directly with limited information, and is exhaustive.",
    "Cells drawn from all of the panel, plans where something new is seen and on each tick, to see whether dynamic "
    "programming flies as CGLA; a stored map for the effort.",
    settings=FLOWN,
)
def _check_c24(evidence: Evidence) -> Finding:
    missions = counterexamples.mission("dijkstra-flies.toml").missions(get)
    ours, dijkstra = (missions[name].fly().uavs["a"] for name in ("CGLA", "Dijkstra"))
    require(_are_alike(ours, dijkstra), "the stored flights differ")
    require(len(ours.plans) > 1, "nothing changed on the stored flight")
    field, goal = missions["CGLA"].world.field, ours.uav.goal
    once = (math.dist(START, goal) + ours.uav.k * float(field.line_integral(START, goal))) / ours.cost
    require(once > 1.0, "the plan made before anything is seen costs no more")
    where = "fails if it plans again, as CGLA does; holds for one plan, made before anything is seen"
    why = f"Dijkstra's algorithm flies as CGLA (dijkstra-flies.toml); one plan costs {once:.2g} times as much there."
    size = f"{_flown_alike(evidence)} flights like CGLA's"
    directly = Row("it cannot be used directly", Answer.DEPENDS, Basis.COUNTEREXAMPLE, where, size, why=why)
    where = "fails as trying all paths; holds as weighing all pairs, as CGLA does"
    why = "{} comparisons, not {:.0e} paths, and {} pairs of points ({}).".format(*_effort(evidence), MAP)
    note = "Read as Bellman's equation over the points, on the map known by then: G is its fixed point, as CGLA's is."
    return Finding(
        (directly, Row("it is exhaustive", Answer.DEPENDS, Basis.COUNTEREXAMPLE, where, why=why)),
        (note,),
        counterexamples=("dijkstra-flies.toml", MAP),
    )


def _flown_alike(evidence: Evidence) -> str:
    """Fly by dynamic programming in cells drawn from the panel, and count the flights that are CGLA's."""
    rng, each = evidence.rng("C24 flights"), evidence.instances(3, 1)
    planners = (("change", Dijkstra()), ("tick", Dijkstra()), ("change", Cgla(schedule="synchronous")))
    alike = []
    for one in evidence.maps(each):
        radius, k = (float(rng.choice(evidence.panel.levels(name))) for name in ("radius", "k"))
        for replan, solver in planners:
            flown = [
                fly({"a": START}, one.field, one.goal, by, k=k, radius=radius, replan=replan, max_ticks=MAX_TICKS)
                for by in ("cgla", solver)
            ]
            alike.append(_are_alike(*(flight.uavs["a"] for flight in flown)))
    return f"{sum(alike)} of {len(alike)}"


def _are_alike(first: UavFlight, second: UavFlight) -> bool:
    """Tell whether two flights are in the same place at each tick, up to rounding."""
    one, other = first.trace, second.trace
    return one.shape == other.shape and float(np.abs(one - other).max()) < SAME


def _effort(evidence: Evidence) -> tuple[int, float, int]:
    """Hold value iteration against CGLA; return CGLA's comparisons, the paths there are, and the pairs of points."""
    rng = evidence.rng("C24")
    for _ in range(evidence.instances(40, 6)):
        graph = random_graph(rng)
        target = int(rng.integers(graph.n_nodes))
        by_rounds = cost_matrix(graph, target, schedule="synchronous").values
        require(are_close(by_rounds, cost_matrix(graph, target).values), "value iteration and label setting differ")
        again = np.minimum(by_rounds, (zero_diagonal(graph) + by_rounds[None, :]).min(axis=1))
        require(are_close(again, by_rounds), "G is no fixed point of Bellman's equation")
    on = _stored_map()
    n, costs = on.graph.n_nodes, [on.judge(solver.solve(on)).cost for solver in (Cgla(), Dijkstra())]
    require(math.isclose(*costs, rel_tol=SAME), "Dijkstra's path has another cost")
    # ways through any of the other nodes, in any order
    paths = float(sum(math.perm(n - 2, between) for between in range(n - 1)))
    return cost_matrix(on.graph, on.target).rounds * n, paths, on.graph.n_pairs
