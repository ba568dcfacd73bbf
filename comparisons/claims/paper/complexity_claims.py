"""Complexity, from counted operations (C20 to C23), and the time of a plan (C36)."""

import math
import time
from dataclasses import replace
from functools import partial
from typing import NamedTuple

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, KNOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.complexity import (
    CROSSED,
    FLIGHT_SIZES,
    UNITS_A_MOVE,
    pair_count,
    relaxation_count,
    rounds_until,
    segments_within,
)
from cgla_graph.comparisons.claims.panel.flights import N, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import GOALS, START
from cgla_graph.comparisons.claims.paper.printed_values import TIMES
from cgla_graph.comparisons.claims.rule import Judged, judged, panel_table
from cgla_graph.comparisons.claims.statement import Share, Shift, Statement
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.cost_to_go.repair import reweigh
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import solve

SAME = 1e-12
#: A plan whose start is settled nearly last.
STORED = "start-settles-late.toml"
#: Shares of plans that something is said of hold if it does for more than this.
MOSTLY = 0.95
_KNOWN = ("threats", "spread", "goal", "k")
#: Points a side for which formulas are held against plain counts: more than the degree of any of them.
_COUNTED = range(2, 10)
_DIFFERENCE = Shift(ratio=False)
_of_plans = partial(Statement, first={"planner": "cgla"}, factors=(*_KNOWN, "n"))
_proved = partial(Row, answer=Answer.HOLDS, basis=Basis.PROOF)


def _sized(samples: Samples, found: Judged, size: str, measure: str = "") -> Row:
    """Return a line of the page whose size is that of the values themselves, or of another measure."""
    plain = replace(found.statement, measure=measure or found.statement.measure, second=0.0, size=size)
    own = judged(samples, replace(plain, test=_DIFFERENCE))
    return replace(found.row, size=own.size, interval=own.interval)


def sample_count(n: int) -> int:
    """
    Return how many samples all weights take with one for each column, or row, that a segment crosses.

    Examples
    --------
    >>> sample_count(2), sample_count(3)
    (6, 52)
    """
    return n * (n**2 - 1) * (7 * n**2 + 2) // 30


def _samples_on(lattice: Lattice) -> int:
    """Count the samples of all pairs of a lattice."""
    steps = np.rint(np.asarray(lattice.points) / lattice.spacing).astype(np.int64)
    first, second = np.triu_indices(len(steps), 1)
    return int(np.abs(steps[first] - steps[second]).max(axis=1).sum())


@claim(
    20,
    "Section 4.2.3 (1)",
    "Computing all weights takes of the order of N^4 operations.",
    "A proof, by counts; and all kinds of maps with each K for how many weights the optimum needs, at N = 20.",
    experiments=("plans",),
    settings=KNOWN,
)
def _check_c20(evidence: Evidence) -> Finding:
    rng = evidence.rng("C20")
    for n in _COUNTED:
        problem = random_scenario(int(rng.integers(2**31))).problem
        graph = GeometricGraph.complete(paper_lattice(n), problem.field, problem.k)
        first, second = np.triu_indices(graph.n_nodes, 1)
        points = np.asarray(graph.positions)
        anew = CostModel(problem.field, problem.k).weights(points[first], points[second])
        off = np.abs(graph.weight_matrix()[first, second] - anew).max()
        require(len(first) == pair_count(n * n) == graph.n_pairs, f"N = {n} does not have N^2 (N^2 - 1) / 2 pairs")
        require(off <= SAME, f"a weight is {off:g} off its own integral")
    for n in (*_COUNTED, N):
        require(_samples_on(paper_lattice(n)) == sample_count(n), f"the samples of N = {n} are not as the formula says")
    samples = evidence.samples["plans"]
    most = partial(_of_plans, second=0.5, less=False, test=_DIFFERENCE, factors=_KNOWN, where={"n": N})
    needed = judged(samples, most("the optimum needs most weights", "weighed_share"))
    order = Row(
        "order N^4",
        Answer.DEPENDS,
        Basis.PROOF,
        "holds if an integral's time does not grow with N; fails, as N^5, with a sample each lattice unit",
        f"{pair_count(N * N):,} integrals or {sample_count(N):,} samples at N = {N}",
        "N^4",
        "N^2 (N^2 - 1) / 2 pairs have an integral each, and N (N^2 - 1) (7 N^2 + 2) / 30 samples together",
    )
    return Finding(
        (order, _sized(samples, needed, "{} % of all")),
        notes=(
            "Samples are a polynomial in N of degree 5: counts at eight N decide it. Threats are a factor, too.",
            "Bounds of the cost from both ends, which take time, too, prove that the optimum needs no other weight.",
        ),
        tables=(panel_table("Weights that the optimum needs, above half", [needed]),),
    )


class Counted(NamedTuple):
    """G of the source, the rounds until it was in Delta_k, and uses of Eq. 9, with a comparison to the least each."""

    value: float
    rounds: int
    relaxations: int


def counted_label_setting(weights: FloatArray, target: int, source: int) -> Counted:
    """
    Run Eqs 9 to 12 one comparison after the other, on weights ``A``, shape ``(n, n)``; infinite where no edge is.

    Examples
    --------
    >>> counted_label_setting(np.array([[0.0, 1, 9], [1, 0, 1], [9, 1, 0]]), target=2, source=0)
    Counted(value=2.0, rounds=2, relaxations=3)
    """
    values = [math.inf] * len(weights)
    values[target] = 0.0
    unsettled = dict.fromkeys(range(len(weights)))
    rounds = relaxations = 0
    least = target
    while values[least] < values[source]:
        del unsettled[least]
        rounds += 1
        serving, least = least, source
        for node in unsettled:
            if math.isfinite(weights[node, serving]):
                values[node] = min(values[node], float(weights[node, serving]) + values[serving])
                relaxations += 1
            if values[node] < values[least]:
                least = node
    return Counted(values[source], rounds, relaxations)


def _late_start() -> tuple[int, int]:
    """Return the rounds of the stored plan until its start is in Delta_k, and its nodes."""
    scenario = counterexamples.scenario(STORED)
    on = scenario.problem.on_lattice(scenario.lattice).with_weights_held()
    rounds, nodes = cost_matrix(on.graph, on.target, source=on.source).rounds, on.graph.n_nodes
    require(rounds >= nodes - 2, f"on the stored map the start is in Delta_k after {rounds} rounds already")
    return rounds, nodes


@claim(
    21,
    "Section 4.2.3 (2)",
    "Computing G takes T N^2 ln N^2, where T is far smaller than N.",
    "T as rounds until p_s is in Delta_k and as edges of the path, planned with all known: all kinds of maps "
    "with each K, and N = 10, 20 and 25, as how far is far may depend on N. T as moves: a proof.",
    experiments=("plans",),
    settings=KNOWN,
)
def _check_c21(evidence: Evidence) -> Finding:
    rng = evidence.rng("C21")
    for _ in range(evidence.instances(30, 5)):
        lattice = paper_lattice(int(rng.integers(3, 9)))
        on = random_scenario(int(rng.integers(2**31))).problem.on_lattice(lattice).with_weights_held()
        graph, source = on.graph, on.graph.index_of(on.source)
        counted = counted_label_setting(graph.weight_matrix(), graph.index_of(on.target), source)
        matrix = cost_matrix(graph, on.target)
        require(math.isclose(counted.value, matrix.value(on.source), rel_tol=SAME), "the counts are of another cost")
        require(counted.rounds == rounds_until(matrix, source), "the start comes into Delta_k in another round")
        uses = relaxation_count(graph.n_nodes, counted.rounds)
        require(counted.relaxations == uses, "uses of Eq. 9 are not as the formula has it")
    last, nodes = _late_start()
    moves = sorted(math.dist(START, goal) / UNITS_A_MOVE for goal in GOALS.values())
    samples = evidence.samples["plans"]
    rounds = judged(samples, _of_plans("T below N, as rounds", "rounds_over_n", second=1.0, size="{} N"))
    most = partial(_of_plans, second=MOSTLY, less=False, test=Share(MOSTLY))
    edges = judged(samples, most("T below 0.5 N, as edges (bar set later)", "below_half"))
    least = f"at least {moves[0]:.3g} N"
    why = f"the straight lines of the panel take {moves[0]:.3g} N and {moves[1]:.3g} N moves of {UNITS_A_MOVE} units"
    uses_why = "T rounds use Eq. 9 T N^2 - T (T + 1) / 2 times, with a comparison each: order N^4 where T is N^2"
    return Finding(
        (
            _proved("at most T N^2 ln N^2, T as rounds", why=uses_why),
            replace(rounds.row, why=f"{rounds.why}; {last} rounds of {nodes} nodes on a stored map"),
            Row("T below N, as moves", Answer.FAILS, Basis.PROOF, size=least, why=why),
            _sized(samples, edges, "T is {} N", "edges_over_n"),
        ),
        notes=(
            "The paper writes one T for rounds, moves and edges, the straight pieces of a path.",
            f"Delta_k needs no sorting: ln N^2 could be left out. A share of plans is tested against {MOSTLY:.0%}.",
        ),
        tables=(panel_table("T of plans with all known", [rounds, edges]),),
        counterexamples=(STORED,),
    )


_PLANNING = {"on every move": "every move", "when something is seen": "on change"}


@claim(
    22,
    "Section 4.2.3, Eq. 14",
    "A flight of T moves takes T N^4 + T^2 N^2 ln N^2, roughly between N^4 and N^5.",
    f"Operations of whole flights at N = {', '.join(map(str, FLIGHT_SIZES))}, an exponent for each map: threats, "
    "spreads, detection radii and K, both goals together, as each map flies in a third of the cells. Varied: steps "
    "of 0.02 at each N, and not of 0.4 lattice units. T is the number of moves; the bounds are 4 and 5 to the letter.",
    experiments=("flight-operations",),
    settings=FLOWN,
)
def _check_c22(evidence: Evidence) -> Finding:
    require(all(n * math.log(n**2) <= n**2 for n in range(1, 1001)), "with T = N the second term is the larger one")
    squared = all(n**2 * math.log(n**2) > n**2 for n in range(2, 1001))
    require(squared, "with T = N^2 the second term is the smaller one")
    samples = evidence.samples["flight-operations"]
    # an exponent is between 4 and 5 if it is less than a half from 4.5
    of = partial(Statement, measure="off_middle", second=0.5, test=_DIFFERENCE, printed="4 to 5")
    found = [
        judged(
            samples,
            of(
                f"between N^4 and N^5, planning {words}", first={"planning": when}, factors=(*_KNOWN[:2], "radius", "k")
            ),
        )
        for words, when in _PLANNING.items()
    ]
    why = "moves times the work of a plan, T (N^4 + T N^2 ln N^2), multiplied out"
    return Finding(
        (
            _proved("T N^4 + T^2 N^2 ln N^2", where="T plans of T rounds each", why=why),
            *(_sized(samples, one, "exponent {}", "exponent") for one in found),
        ),
        notes=(
            "The first term decides if T ln N^2 <= N^2, as for T = N; with T = N^2 (C21), Eq. 14 is N^6 ln N^2.",
            "Operations: an integral for each pair, and uses of Eq. 9 until p_s is in Delta_k, on what was known then.",
            "Moves of 0.4 lattice units (E16) add one to the exponent, and so do samples in each lattice unit (C20).",
        ),
        tables=(panel_table("Distance of exponents from 4.5, below 0.5", found),),
    )


@claim(
    23,
    "Section 4.2.3, Remark 3",
    "When something is detected, only the edges that it crosses need a new weight: far fewer than all.",
    "The first half: a proof. The second: the last threat of each map comes up where the others are known, on all "
    "kinds of maps, with each K, at N = 20; varied: N = 10. Far fewer is read as fewer than half.",
    experiments=("new-threat",),
    settings=KNOWN,
)
def _check_c23(evidence: Evidence) -> Finding:
    reaches, further = _unreached_weights_stay(evidence)
    half = partial(Statement, first={}, second=0.5, test=_DIFFERENCE, factors=_KNOWN)
    texts = {"changed": "fewer than half change", "crossed": f"fewer than half are within {CROSSED:g} spreads"}
    samples = evidence.samples["new-threat"]
    found = [judged(samples, half(text, measure)) for measure, text in texts.items()]
    where = f"within reach is {reaches:.3g} spreads"
    why = f"to the last bit; beyond {CROSSED:g} spreads weights still change, by up to {further:.1g}"
    return Finding(
        (
            _proved("an edge out of reach keeps its weight", where=where, why=why),
            *(_sized(samples, one, "{} %") for one in found),
        ),
        notes=(
            "A threat's factor in Eq. 2 is 1 where its risk is 0: integrals over segments out of its reach stay.",
            "A Gaussian has no edge: reach is where rounding drops its risk, and any change above rounding counts.",
        ),
        tables=(panel_table("Shares of weights that a new threat changes, below a half", found),),
    )


def _unreached_weights_stay(evidence: Evidence) -> tuple[float, float]:
    """Assert that only weights within reach of a new threat change; return the least reach, and what changes beyond."""
    rng, reaches, further = evidence.rng("C23"), [], 0.0
    for _ in range(evidence.instances(40, 6)):
        lattice = paper_lattice(int(rng.integers(6, 15)))
        first, second = np.triu_indices(lattice.n_points, 1)
        problem = random_scenario(int(rng.integers(2**31)), threats=int(rng.choice([10, 30]))).problem
        seen, known = problem.field.threats[-1], problem.field.threats[:-1]
        before = GeometricGraph.complete(lattice, RiskField(known), problem.k)
        updated = reweigh(before, CostModel(problem.field, problem.k)).weight_matrix()[first, second]
        fresh = GeometricGraph.complete(lattice, problem.field, problem.k).weight_matrix()[first, second]
        old = before.weight_matrix()[first, second]
        require(np.array_equal(updated, fresh), "an update is not the matrix from scratch")
        reach = math.sqrt(float(problem.field.table[list(problem.field.threats).index(seen), 2]))
        outside = ~segments_within(lattice, seen, reach * (1.0 + SAME))
        require(np.array_equal(old[outside], fresh[outside]), "a weight out of the threat's reach changed")
        reaches.append(reach / seen.spread)
        beyond = ~segments_within(lattice, seen, CROSSED * seen.spread)
        further = max(further, float(np.abs(fresh - old)[beyond].max(initial=0.0)))
    return min(reaches), further


#: Plans of a kind, of whose times the least counts: others were disturbed.
REPEATS = 5


def _timed(solver: str) -> tuple[float, Solution]:
    """Plan on the map of Fig. 7, weights included: CPU seconds, once all is compiled, and the answer."""
    problem, seconds = load_scenario("paper").problem, []
    for _ in range(REPEATS + 1):
        began = time.process_time()
        answer = solve(problem, solver, resolution=paper_lattice())
        seconds.append(time.process_time() - began)
    require(answer.status.has_path, f"{solver} found no path")
    return min(seconds[1:]), answer


@claim(
    36,
    "Section 5.1",
    "CGLA is much more efficient than Q-Learning: 7.64 s against 26.5 s.",
    "One plan of each on the reconstructed map of Fig. 7, N = 20, with defaults: CPU times are of one machine, so that "
    "no part of the panel is read, and one digit of the ratio is said.",
    figures=("Fig. 7",),
)
def _check_c36(_: Evidence) -> Finding:
    (ours, plan), (learnt, policy) = _timed("cgla"), _timed("q-learning")
    way = "the other way round" if learnt < ours else "in the same direction"
    row = Row(
        "CGLA takes less time than Q-Learning",
        Answer.NOT_REPRODUCED,
        Basis.SAMPLE,
        "our programs; the paper prints neither language nor settings",
        f"Q-Learning / CGLA: {learnt / ours:.1g}",
        f"{TIMES.q_learning / TIMES.cgla:.3g}",
        f"{way}: CGLA computes {plan.evaluations:,} weights for its plan, Q-Learning {policy.evaluations:,}",
    )
    return Finding((row,), notes=("Our Q-Learning is in the style of the paper's peer, whose program is not public.",))
