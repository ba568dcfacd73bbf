"""What a detected threat changes: which weights, and how many (C23)."""

import math

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Entry, Finding, Part, Table, Verdict, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.paper.flights import paper_lattice
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.cost_to_go.repair import reweigh
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.random_map import random_scenario

#: Values that differ by less are the same but for rounding, map units.
SAME = 1e-12
#: How far a threat counts as crossed, in spreads.
CROSSED = 4.0


def segments_within(lattice: Lattice, threat: Threat, radius: float) -> FloatArray:
    """
    Tell for each pair of lattice points whether its segment comes that near to a threat's centre.

    Returns
    -------
    within
        Shape ``(pairs,)``, 0 or 1, in the order of ``numpy.triu_indices``.

    Examples
    --------
    >>> segments_within(Lattice(2, bounds=(0, 0, 1, 1)), Threat(0.5, 0.0, spread=0.1), 0.1).tolist()
    [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]
    """
    points = np.asarray(lattice.points) - (threat.x, threat.y)
    first, second = np.triu_indices(len(points), 1)
    start, along = points[first], points[second] - points[first]
    nearest = np.clip(-(start * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    apart = np.hypot(*(start + nearest[:, None] * along).T)
    within: FloatArray = (apart <= radius).astype(np.float64)
    return within


def check_c23(evidence: Evidence) -> Finding:
    """C23: when a threat is detected, only the edges that it crosses need a new weight."""
    rng, lattice = evidence.rng("C23"), paper_lattice()
    first, second = np.triu_indices(lattice.n_points, 1)
    crossed, changed, beyond, touched = [], [], [], []
    for _ in range(evidence.instances(60, 6)):
        problem = random_scenario(int(rng.integers(2**31))).problem
        seen, known = problem.field.threats[-1], problem.field.threats[:-1]
        before = GeometricGraph.complete(lattice, RiskField(known), problem.k)
        after = CostModel(problem.field, problem.k)
        updated = reweigh(before, after)
        fresh = GeometricGraph.complete(lattice, problem.field, problem.k)
        old, new = before.weight_matrix()[first, second], fresh.weight_matrix()[first, second]
        require(np.array_equal(updated.weight_matrix()[first, second], new), "an update is not the matrix from scratch")
        reach = math.sqrt(float(problem.field.table[list(problem.field.threats).index(seen), 2]))
        outside = segments_within(lattice, seen, reach * (1.0 + SAME)) == 0.0
        require(np.array_equal(old[outside], new[outside]), "a weight out of the threat's reach changed")
        near = segments_within(lattice, seen, CROSSED * seen.spread)
        crossed.append(float(near.mean()))
        changed.append(float((np.abs(new - old) > SAME).mean()))
        beyond.append(float(np.abs(new - old)[near == 0.0].max(initial=0.0)))
        target = int(rng.integers(lattice.n_points))
        values = [cost_matrix(graph, target).values for graph in (before, updated)]
        touched.append(float((np.abs(values[1] - values[0]) > SAME).mean()))
    reaches = reach / seen.spread
    places = {"the centre": (0.5, 0.5), "near the border": (0.5, 0.05), "near a corner": (0.05, 0.05)}
    rows: list[list[Entry]] = [
        [
            place,
            *(
                float(segments_within(lattice, Threat(*at, spread), CROSSED * spread).mean())
                for spread in (0.025, 0.05, 0.065)
            ),
        ]
        for place, at in places.items()
    ]
    found = {
        name: bootstrapped(shares, seed=evidence.scale.seed)
        for name, shares in (("near", crossed), ("all", changed), ("G", touched))
    }
    few = found["all"].high < 0.5  # noqa: PLR2004 - the rule below
    return Finding(
        Verdict.PROVED,
        (
            f"Weights out of a threat's reach stay as they are, to the last bit, on all {len(crossed)} random maps, "
            "and updating the others gives the matrix from scratch. They are not few: one of ten threats crosses "
            f"{found['near'].median:.0%} of all edges (4 spreads), and changes {found['all'].median:.0%} of all "
            f"weights by more than 1e-12 and {found['G'].median:.0%} of the values of G."
        ),
        (
            Part(
                "an edge that is not crossed keeps its weight",
                Verdict.PROVED,
                (
                    f"if crossed means within reach, {reaches:.3g} spreads here; beyond 4 spreads weights still "
                    f"change by up to {max(beyond):.2g}"
                ),
            ),
            Part(
                "fewer than half of the edges change",
                Verdict.SUPPORTED if few else Verdict.NOT_SUPPORTED,
                (
                    f"{found['all'].median:.0%} on the median map ({found['all'].low:.0%} to "
                    f"{found['all'].high:.0%}), {min(changed):.0%} to {max(changed):.0%}"
                ),
            ),
        ),
        (
            Table(
                "share of all edges within 4 spreads of a threat, N = 20",
                ("threat", "spread 0.025", "spread 0.05", "spread 0.065"),
                rows,
            ),
        ),
        (
            (
                "A threat's factor in Eq. 2 is 1 where its risk is 0, so that an integral over a segment that it "
                "does not reach stays the same. A Gaussian has no edge: reach is where its risk falls below what "
                "rounding drops."
            ),
            (
                "Rule for the share, set before: supported if the 95 % interval of the median over maps lies below "
                "one half."
            ),
        ),
    )
