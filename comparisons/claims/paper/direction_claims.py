"""Eight directions: what they cost in length, risk and cost (C26), and plans found, turns and operations (C55)."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from cgla_graph.comparisons.claims.claim import FLOWN, KNOWN, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.complexity import PASSAGES, pair_count
from cgla_graph.comparisons.claims.panel.flights import N, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import FACTORS
from cgla_graph.comparisons.claims.paper.complexity_claims import SAME, counted_label_setting
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Rate, Shift, Statement
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.scenarios.random_map import random_scenario

#: From so many points a side on, weights and operations are fewer for certain.
FEWER_FROM = 5
#: Plans on one and the same lattice, over one and the same cost.
_eight = partial(Statement, first={"planner": "eight-direction"}, second={"planner": "cgla"}, less=False)
_more = partial(_eight, size="{} % more")
_KNOWN = ("threats", "spread", "goal", "k")
#: The words for a mode, and the factors of the panel that there are in it.
_MODES = {"known": (", all known", _KNOWN), "flown": (" in flight", tuple(FACTORS))}
#: What C26 says.
DIRECTIONS = [
    _more(f"{measure}: greater{words}", measure, factors=factors, where={"mode": mode})
    for measure in ("length", "cost", "risk")
    for mode, (words, factors) in _MODES.items()
]


@claim(
    26,
    "Section 3.1, Fig. 2",
    "A path of eight directions is longer than it has to be, and more so than one over straight segments.",
    "All cells, CGLA and the optimum in eight directions on the lattice of N = 20, planned with all known and flown: "
    "the comparison is about directions alone, as both minimise the same cost.",
    experiments=("single-uav",),
    figures=("Fig. 2",),
    settings=FLOWN,
)
def _check_c26(evidence: Evidence) -> Finding:
    found = [judged(evidence.samples["single-uav"], one) for one in DIRECTIONS]
    return Finding(
        tuple(one.row for one in found),
        notes=("Every path of eight directions is one over any segments, so that CGLA's optimum never costs more.",),
        tables=(panel_table("Eight directions over CGLA (ratios)", found),),
    )


def neighbour_count(n: int) -> int:
    """
    Return how many pairs of neighbours in eight directions a lattice of n x n points has.

    Examples
    --------
    >>> neighbour_count(2), neighbour_count(20)
    (6, 1482)
    """
    return 4 * n * n - 6 * n + 2


@claim(
    55,
    "Section 3.1",
    "Eight directions substantially affect whether a path can be flown, and the complexity of finding one.",
    "Complexity: a proof. Turns: plans with all known on all kinds of maps, with each K, at N = 10, 20 and 25. Plans "
    "found, which do not depend on threats: both goals, areas 0.075 apart and walls with one passage, at the same N; "
    "varied: the rule for corners of areas, and the lattice.",
    experiments=("plans", "passages"),
    settings=KNOWN,
)
def _check_c55(evidence: Evidence) -> Finding:
    _fewer_operations(evidence)
    sharper = partial(_eight, test=Shift(ratio=False), factors=(*_KNOWN, "n"), size="by {} degrees")
    turned = judged(evidence.samples["plans"], sharper("its sharpest turn is sharper", "sharpest"))
    found_less = partial(_eight, less=True, test=Rate(), factors=("goal", "passage", "n"))
    size = f"{{first}} % against {{second}} %, through {PASSAGES[0]:g}"
    fewer = found_less("fewer plans are found", "found", size=size)
    found, narrowest = (
        judged(evidence.samples["passages"], one)
        for one in (fewer, replace(fewer, where={"passage": f"passage {PASSAGES[0]:g}"}))
    )
    operations = Row(
        "fewer weights and operations",
        Answer.HOLDS,
        Basis.PROOF,
        f"N at least {FEWER_FROM}",
        f"{neighbour_count(N):,} against {pair_count(N * N):,} weights at N = {N}",
        why="4 N^2 - 6 N + 2 pairs of neighbours against N^2 (N^2 - 1) / 2 pairs, and Eq. 9 uses none twice",
    )
    return Finding(
        (replace(found.row, size=narrowest.size, interval=narrowest.interval), turned.row, operations),
        notes=(
            "Edges in eight directions are edges of the complete graph: plans found can only be fewer.",
            "A lattice unit is 1 / N wide; a passage of a unit or more is no obstacle.",
        ),
        tables=(
            panel_table("Plans found past no-fly areas (rates, eight directions less any)", [found]),
            panel_table("Turns of plans in eight directions, less those in any (degrees)", [turned]),
        ),
    )


def _fewer_operations(evidence: Evidence) -> None:
    """Count edges, and uses of Eq. 9, on lattices in eight directions."""
    rng = evidence.rng("C55")
    for n in range(2, 3 + evidence.instances(10, 5)):
        problem = random_scenario(int(rng.integers(2**31))).problem
        lattice = paper_lattice(n)
        places = np.asarray(lattice.points)[rng.choice(n * n, 2, replace=False)]
        start, goal = ((float(x), float(y)) for x, y in places)
        on = replace(problem, start=start, goal=goal).on_eight_connected(lattice)
        edges = on.graph.n_pairs
        require(edges == neighbour_count(n), f"N = {n} has {edges} pairs of neighbours")
        target, source = (on.graph.index_of(end) for end in (on.target, on.source))
        counted = counted_label_setting(on.graph.weight_matrix(), target, source)
        best = cost_matrix(on.graph, on.target).value(on.source)
        require(math.isclose(counted.value, best, rel_tol=SAME), "the counts are of another cost")
        require(counted.relaxations <= edges, f"Eq. 9 is used {counted.relaxations} times on {edges} edges")
    # from there on by induction: the right side grows faster
    fewer = all(2 * neighbour_count(n) < pair_count(n * n) for n in range(FEWER_FROM, 1000))
    require(fewer, "weights and uses of Eq. 9 are not fewer")
