"""The model: what F is, what weighs a segment, and what eight directions lose (C1 to C7, C26, C27)."""

import math
from itertools import product

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.counterexamples import improper_field
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.paper.flights import BOUNDS, paper_lattice
from cgla_graph.fusion.fusion import Fusion, fused_weights
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import Reading, RiskField, Threat
from cgla_graph.solvers.exact.cgla import Cgla
from cgla_graph.solvers.grid.eight_direction import EightDirection

#: The readings of Eq. 1 (E1, E2): the toolkit's own, and those that are printed or usual.
READINGS: tuple[Reading, ...] = ("membership", "literal", "sigma2", "gauss2d")
#: The toolkit's line integrals are exact to this on maps of unit size.
EXACT = 1e-9
#: What rounding may do to sums and products of a dozen numbers of size 1.
ROUNDING = 1e-14
#: Readings of Eq. 5 with several UAVs: all that is known together, and the worst for any of them.
FUSIONS: tuple[Fusion, ...] = ("union", "max_integral")
#: What counts as much larger, for want of a number in the paper.
DOUBLED = 2.0
#: The two K of Fig. 3, and the sigmas that are tried for it.
LOW, HIGH = 10.0, 200.0
SIGMAS = (0.05, 0.1, 0.2)
#: How many times longer than the straight line a path of eight directions is at most in free space.
OCTILE = 1.0 / math.cos(math.pi / 8.0)


def _draw(rng: np.random.Generator, count: int, reading: Reading = "membership") -> list[Threat]:
    """Draw threats as the harness has them (E4): sigma from 0.025 to 0.065, anywhere."""
    rows = zip(rng.random((count, 2)).tolist(), rng.uniform(0.025, 0.065, count).tolist(), strict=True)
    return [Threat.from_eq1(x, y, sigma, reading=reading) for (x, y), sigma in rows]


def _proper(rng: np.random.Generator) -> RiskField:
    """Draw a field of 1 to 12 threats with peaks up to 1."""
    drawn = _draw(rng, int(rng.integers(1, 13)))
    return RiskField(
        Threat(t.x, t.y, t.spread, peak) for t, peak in zip(drawn, rng.uniform(0.05, 1.0, len(drawn)), strict=True)
    )


def _extremes(threats: list[Threat], rng: np.random.Generator) -> tuple[float, float]:
    """Return the least and the greatest F seen: on a grid, at the centres and half way between them."""
    grid = Lattice(41, bounds=BOUNDS).points
    centres = np.array([(t.x, t.y) for t in threats])
    between = (centres[:, None] + centres[None]).reshape(-1, 2) / 2.0
    found = improper_field(threats).density(np.vstack([grid, centres, between, rng.random((200, 2))]))
    return float(found.min()), float(found.max())


@claim(
    1,
    "Section 2, Eq. 2",
    "The combined risk F of all threats is a probability.",
    "For all threats and points, 0 <= F <= 1, in each reading of Eq. 1.",
    Kind.PROPERTY,
    figures=("Fig. 1",),
)
def _check_c1(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C1"), evidence.instances(300, 40)
    rows: list[list[Entry]] = []
    for reading in READINGS:
        least, greatest, outside = 0.0, 0.0, 0
        for _ in range(count):
            low, high = _extremes(_draw(rng, 10, reading), rng)
            outside += low < 0.0 or high > 1.0
            least, greatest = min(least, low), max(greatest, high)
        rows.append([reading, least, greatest, outside / count])
    require(rows[0][3] == 0.0, "F left [0, 1] although no peak is above 1")
    for _ in range(count):
        field = _proper(rng)
        values = field.density(rng.random((500, 2)))
        require((values >= 0.0).all() and (values <= 1.0).all(), "F left [0, 1] although no peak is above 1")
    stored = counterexamples.scenario("printed-peaks.toml").problem
    middle = float(stored.field.density((0.5, 0.5)))
    require(middle < 0.0, "the stored map does not show F below 0")
    parts = [Part("membership reading, peak at most 1", Verdict.PROVED, f"0 <= F <= 1 on {2 * count} random fields")]
    parts += [
        Part(
            f"Eq. 1 as {reading}",
            Verdict.REFUTED,
            f"F from {low:.3g} to {high:.3g}; outside [0, 1] on {share:.0%} of fields",
        )
        for reading, low, high, share in rows[1:]
    ]
    return Finding(
        Verdict.REFUTED,
        f"As Eq. 1 is printed, F is no probability: between two threats of sigma = 0.05 it is {middle:.1f}. It is one "
        "if and only if no single f exceeds 1, as in the reading that the toolkit takes (peak 1).",
        tuple(parts),
        (
            Table(
                f"F on {count} random fields of ten threats",
                ("reading of Eq. 1", "least F", "greatest F", "share outside [0, 1]"),
                rows,
            ),
        ),
        (
            (
                "If every f_i is in [0, 1], then so is every 1 - f_i, their product, and F. If one f exceeds 1, a "
                "field of that threat alone has F = f > 1. The printed peak 1 / (sqrt(2 pi) sigma) exceeds 1 for "
                "sigma below 0.399."
            ),
        ),
        counterexample="printed-peaks.toml",
    )


@claim(
    2,
    "Section 2, Eq. 2 (implied)",
    "More threats are never less risk.",
    "F with a further threat is at least F without it, everywhere.",
    Kind.PROPERTY,
)
def _check_c2(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C2"), evidence.instances(500, 60)
    for _ in range(count):
        field, extra, points = _proper(rng), _draw(rng, 1), rng.random((200, 2))
        rise = field.with_threats(extra).density(points) - field.density(points)
        require((rise >= -ROUNDING).all(), "another threat lowered F although no peak is above 1")
        clear = 1.0 - field.density(points)
        exact = RiskField(extra).density(points) * clear
        require(np.abs(rise - exact).max() < ROUNDING, "the rise of F is not f_new * prod(1 - f_i)")
    stored = counterexamples.scenario("printed-peaks.toml").problem.field
    one = improper_field(list(stored.threats[:1]))
    alone, both = float(one.density((0.5, 0.5))), float(stored.density((0.5, 0.5)))
    require(both < alone, "the stored map does not show that a second threat lowers F")
    return Finding(
        Verdict.REFUTED,
        f"As Eq. 1 is printed, a second threat can lower F: from {alone:.2f} to {both:.2f} between two threats of "
        "sigma = 0.05. With peaks of at most 1 it never does.",
        (
            Part(
                "peaks at most 1",
                Verdict.PROVED,
                f"F rises by f_new * prod(1 - f_i) >= 0: {count} random fields, to 1e-14",
            ),
            Part("Eq. 1 as printed", Verdict.REFUTED, f"F falls from {alone:.2f} to {both:.2f}"),
        ),
        notes=(
            "F with a further threat t minus F without it is f_t * prod(1 - f_i), which has the sign of the product.",
        ),
        counterexample="printed-peaks.toml",
    )


@claim(
    3,
    "Section 2",
    "A no-fly area is a region where the risk has a very large value.",
    "F stays a probability, and weights positive, when areas are values far above 1.",
    Kind.PROOF,
)
def _check_c3(_: Evidence) -> Finding:
    stored = counterexamples.scenario("very-large-value.toml").problem
    at_one, between = (float(value) for value in stored.field.density([(0.45, 0.5), (0.5, 0.5)]))
    (weight,) = stored.model.weights([(0.46, 0.5)], [(0.54, 0.5)]).tolist()
    require(at_one < 0.0 and weight < 0.0, "the stored map does not show risk below 0")
    return Finding(
        Verdict.REFUTED,
        f"Two areas of value 1000 near each other make F = {at_one:.3g} at the centre of one and {between:.3g} between "
        f"them, and a segment of length 0.08 between them weighs {weight:.3g}: a path would seek them. A single one "
        "leaves [0, 1] as well.",
        notes=(
            (
                "It contradicts C1: Eq. 2 is a probability only of values up to 1. The toolkit keeps no-fly areas "
                "apart: a segment that crosses one has infinite weight."
            ),
        ),
        counterexample="very-large-value.toml",
    )


@claim(
    4,
    "Section 3.2, Fig. 3",
    "With K = 200 the weight of a segment from (0, 0) is much larger than with K = 10, for each point.",
    "1 <= A_200 / A_10 <= 20; the share of lattice points at which it is at least 2.",
    Kind.SCENARIO,
    figures=("Fig. 3",),
)
def _check_c4(_: Evidence) -> Finding:
    rows: list[tuple[str, float, float, float, float]] = []
    readings: tuple[Reading, ...] = ("membership", "sigma2", "literal")
    for reading, sigma in product(readings, SIGMAS):
        low, high = weights_from_origin(reading, sigma)
        ratio = high / low
        require((high >= low).all() and (ratio <= 20.0 * (1.0 + EXACT)).all(), "A_200 / A_10 is outside [1, 20]")
        rows.append((reading, sigma, float(ratio.min()), float(ratio.max()), share_doubled(reading, sigma)))
    shares = [row[-1] for row in rows]
    return Finding(
        Verdict.NOT_TESTABLE,
        f'The paper gives neither sigma nor a bound for "much larger". At least doubled are {min(shares):.0%} to '
        f"{max(shares):.0%} of the lattice points, depending on sigma and the reading of Eq. 1.",
        (
            Part("A_200 >= A_10 everywhere", Verdict.PROVED, "the difference is 190 times the integral of F >= 0"),
            Part("A_200 <= 20 A_10", Verdict.PROVED, "20 A_10 - A_200 is 19 times the length"),
        ),
        (
            Table(
                "A_200 / A_10 from (0, 0) to the 400 points of the lattice, one threat at (0.5, 0.5)",
                ("reading of Eq. 1", "sigma", "least", "greatest", "share at least doubled"),
                rows,
                "points whose straight line passes far from the threat weigh their length, whatever K",
            ),
        ),
    )


def weights_from_origin(reading: Reading, sigma: float) -> tuple[FloatArray, FloatArray]:
    """
    Weigh the segments from (0, 0) to the 400 lattice points with both K of Fig. 3, one threat at (0.5, 0.5).

    Returns
    -------
    low, high
        Shape ``(400,)`` each, map units.
    """
    points = paper_lattice().points
    field = improper_field([Threat.from_eq1(0.5, 0.5, sigma, reading=reading)])
    low, high = (CostModel(field, k).weights(np.zeros_like(points), points) for k in (LOW, HIGH))
    return low, high


def share_doubled(reading: Reading, sigma: float) -> float:
    """
    Return the share of lattice points that weigh at least twice as much with the greater K.

    Examples
    --------
    >>> share_doubled("membership", 0.05) < share_doubled("membership", 0.2)
    True
    """
    low, high = weights_from_origin(reading, sigma)
    return float((high >= DOUBLED * low).mean())


@claim(
    5,
    "Section 4.2.1, Theorem 1",
    "The weight of any two different points is positive.",
    "A(p, r) > 0 for p != r, and A(p, p) = 0.",
    Kind.PROPERTY,
)
def _check_c5(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C5"), evidence.instances(60, 8)
    lattice = paper_lattice(10)
    for _ in range(count):
        weights = CostModel(_proper(rng), float(rng.uniform(0.0, 200.0))).matrix(lattice.points, lattice.shape)
        others = ~np.eye(lattice.n_points, dtype=bool)
        require((weights[others] > 0.0).all() and (np.diag(weights) == 0.0).all(), "a weight is not positive")
    negative = []
    for _ in range(count):
        field = improper_field(_draw(rng, 10, "literal"))
        weights = CostModel(field, 10.0).matrix(lattice.points, lattice.shape)
        negative.append(float((weights < 0.0).sum() / (lattice.n_points * (lattice.n_points - 1))))
    stored = counterexamples.scenario("printed-peaks.toml").problem
    (weight,) = stored.model.weights([(0.42, 0.5)], [(0.58, 0.5)]).tolist()
    require(weight < 0.0, "the stored map does not show a weight below 0")
    return Finding(
        Verdict.REFUTED,
        f"As Eq. 1 is printed, weights can be negative: {weight:.3g} for a segment of length 0.16 on the stored map, "
        f"and {np.mean(negative):.0%} of all pairs on {count} random maps of ten threats. With K >= 0 and peaks up to "
        "1, A(p, r) is at least the length, and A(p, p) = 0.",
        (
            Part("K >= 0, peaks at most 1, p != r", Verdict.PROVED, f"all pairs of {count} random maps"),
            Part(
                "Eq. 1 as printed",
                Verdict.REFUTED,
                f"{np.mean(negative):.0%} of pairs are negative ({min(negative):.0%} to {max(negative):.0%})",
            ),
        ),
        notes=(
            (
                "A = length + K * integral of F, where F >= 0: at least the length, which is positive between "
                "different points."
            ),
        ),
        counterexample="printed-peaks.toml",
    )


@claim(
    6,
    "Section 3.2 (implied)",
    "A segment weighs the same in both directions.",
    "A(p, r) = A(r, p), for exact integrals and for raster sums.",
    Kind.PROPERTY,
)
def _check_c6(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C6"), evidence.instances(100, 12)
    worst, mean, greatest = 0.0, [], 0.0
    for _ in range(count):
        field, k = _proper(rng), float(rng.uniform(0.0, 200.0))
        starts, ends = rng.random((300, 2)), rng.random((300, 2))
        there, back = CostModel(field, k).weights(starts, ends), CostModel(field, k).weights(ends, starts)
        worst = max(worst, float(np.abs(there - back).max()))
        raster = [fused_weights(a, b, [field], 1.0, integral="raster") for a, b in ((starts, ends), (ends, starts))]
        difference = np.abs(raster[0] - raster[1])
        mean.append(float(difference.mean()))
        greatest = max(greatest, float(difference.max()))
    require(worst == 0.0, f"exact weights differ by {worst} there and back")
    return Finding(
        Verdict.PROVED,
        f"With exact integrals A is symmetric (the same float both ways, {300 * count} random segments). A sum over "
        f"one end of each of 50 parts, as the authors' followers take it, is not: |A - A'| / K is {np.mean(mean):.2g} "
        f"on average, at most {greatest:.2g}.",
        (
            Part("exact line integral", Verdict.PROVED, f"{300 * count} segments, difference 0"),
            Part(
                "raster sum of 50 right ends",
                Verdict.REFUTED,
                f"differs by K * {np.mean(mean):.2g} on average, K * {greatest:.2g} at most",
            ),
        ),
        notes=("The integral over a segment does not depend on the direction in which it is passed.",),
    )


@claim(
    7,
    "Section 3.2, Eq. 5 (implied)",
    "The weights of the parts of a segment add up to that of the segment.",
    "A(p, r) = A(p, q) + A(q, r) for q between p and r; for the union of threats and for Eq. 5's maximum over UAVs.",
    Kind.PROPERTY,
)
def _check_c7(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C7"), evidence.instances(200, 30)
    worst, least, strict = 0.0, 0.0, 0
    for _ in range(count):
        mine, other = RiskField(_draw(rng, 2)), RiskField(_draw(rng, 2))
        starts, ends, at = rng.random((100, 2)), rng.random((100, 2)), rng.random((100, 1))
        middles = starts + at * (ends - starts)
        parts = ((starts, middles), (middles, ends))
        union, maximum = (
            sum(fused_weights(a, b, [mine, other], 10.0, fusion=fusion) for a, b in parts)
            - fused_weights(starts, ends, [mine, other], 10.0, fusion=fusion)
            for fusion in FUSIONS
        )
        worst = max(worst, float(np.abs(union).max()))
        least = min(least, float(maximum.min()))
        strict += int((maximum > EXACT).sum())
    require(worst < EXACT, f"the parts of a segment miss its weight by {worst}")
    require(least > -EXACT, "two parts are cheaper than the whole, which the maximum of integrals does not allow")
    require(strict > 0, "no segment shows that the maximum of integrals does not add up")
    return Finding(
        Verdict.PROVED,
        f"For one UAV, and for the union of what all know, the parts of a segment add up to it (within {worst:.1g}). "
        "Eq. 5's maximum over UAVs is only subadditive: parts cost more than the whole on "
        f"{strict / (100 * count):.1%} of random segments.",
        (
            Part("one UAV, or the union of the threats", Verdict.PROVED, f"{100 * count} segments, within {worst:.1g}"),
            Part(
                "Eq. 5's max over UAVs of the integral",
                Verdict.REFUTED,
                f"two UAVs that know two threats each: {strict} of {100 * count} segments cost more in two parts, "
                "none less",
            ),
        ),
        notes=(
            (
                "An integral is additive over pieces. A maximum of integrals is not: different pieces may be the "
                "worst for different UAVs."
            ),
            (
                "So on a lattice only steps that pass no third point matter (61 % of the pairs at N = 20), for the "
                "union but not for the maximum."
            ),
        ),
    )


@claim(
    26,
    "Section 3.1, Fig. 2",
    "A straight segment is no longer than a path of eight directions between the same points.",
    "|v| <= octile(v) <= |v| / cos(pi / 8), and J of all directions <= J of eight.",
    Kind.PROPERTY,
    figures=("Fig. 2",),
)
def _check_c26(evidence: Evidence) -> Finding:
    rng, count = evidence.rng("C26"), evidence.instances(60, 10)
    vectors = rng.normal(size=(100_000, 2))
    dx, dy = np.abs(vectors).T
    octile = np.maximum(dx, dy) + (math.sqrt(2.0) - 1.0) * np.minimum(dx, dy)
    ratio = octile / np.hypot(dx, dy)
    require(((ratio >= 1.0 - 1e-12) & (ratio <= OCTILE * (1.0 + 1e-12))).all(), "the octile distance is out of bounds")
    lattice = paper_lattice()
    excess = []
    for _ in range(count):
        problem = Problem(
            (0.1, 0.1), (0.9, 0.9), RiskField(_draw(rng, 10)), k=float(rng.choice([0.0, 10.0, 50.0, 200.0]))
        )
        on = problem.on_lattice(lattice)
        free = on.judge(Cgla().solve(on)).cost
        eight = problem.judge(EightDirection(lattice).solve(problem)).cost
        require(eight >= free * (1.0 - 1e-12), "eight directions are cheaper than all")
        excess.append(eight / free - 1.0)
    return Finding(
        Verdict.PROVED,
        "A segment is at most as long as its path of eight directions, which is at most 1.0824 times as long (1 / "
        "cos(pi / 8)); and no path of eight directions is cheaper than the best one of all: it is "
        f"{np.mean(excess):.1%} more expensive on average, {max(excess):.1%} at most, on {count} random maps.",
        notes=(
            (
                "|v| <= max + (sqrt 2 - 1) min of |dx| and |dy| <= |v| / cos(pi / 8): the triangle inequality, and "
                "the maximum of cos a + (sqrt 2 - 1) sin a at pi / 8."
            ),
            "The eight moves are edges of the complete graph as well, so that its optimum cannot be more expensive.",
        ),
    )


@claim(
    27,
    "Abstract",
    "The evaluation of risk in path planning is introduced for the first time.",
    "None: a statement about the literature.",
    Kind.PROSE,
)
def _check_c27(_: Evidence) -> Finding:
    return Finding(
        Verdict.NOT_TESTABLE,
        "What came first is a question to the literature. Probabilistic risk was used for planning before: Kim, Gu "
        "and Postlethwaite (2008, from work of 2006), and Bortoff (2000) trades stealth for length.",
    )
