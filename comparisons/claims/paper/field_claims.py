"""The model: what F is, what weighs a segment, and what eight directions lose (C1 to C7, C26, C27)."""

import itertools
import math
from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.counterexamples import improper_field
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.paper.flights import BOUNDS, paper_lattice
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.fusion.fusion import Fusion, fused_weights
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import Reading, RiskField, Threat
from cgla_graph.solvers import solve
from cgla_graph.solvers.exact.cgla import Cgla
from cgla_graph.solvers.grid.eight_direction import EightDirection

#: The readings of Eq. 1 (E1, E2): the toolkit's own, and those that are printed or usual.
READINGS: tuple[Reading, ...] = ("membership", "literal", "sigma2", "gauss2d")
#: The toolkit's line integrals are exact to this on maps of unit size.
EXACT = 1e-9
#: What rounding may do to sums and products of a dozen numbers of size 1.
ROUNDING = 1e-14
#: How much A(p, r) and A(r, p) differ over K on the map that is stored for it, at least.
STEEP = 1e-3
#: Conditions of claims that hold, and that do not.
PROPER, PRINTED = "if no peak exceeds 1", "as Eq. 1 is printed"
IMPLIED = "The paper does not say it: it follows from its equations, or does not, and what is built on them needs it."
#: Thicknesses of walls, map units.
WALLS = (0.1, 0.01, 0.001)
#: Readings of Eq. 5 with several UAVs: all that is known together, and the worst for any of them.
FUSIONS: tuple[Fusion, ...] = ("union", "max_integral")
#: What counts as much larger, for want of a number in the paper.
DOUBLED = 2.0
#: The two K of Fig. 3, and the sigmas that are tried for it.
LOW, HIGH = 10.0, 200.0
SIGMAS = (0.05, 0.1, 0.2)
#: Up to this sigma a threat of peak 1 leaves some of the weights of Fig. 3 as they are, that is within `UNCHANGED`.
NARROW, UNCHANGED = 0.1, 1.001
#: Much larger by any measure.
MUCH = 10.0
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
    usual = Part("", Verdict.PROVED, f"0 <= F <= 1 on {2 * count} random fields", PROPER)
    readings = [
        Part(
            "" if reading == "literal" else f"{reading} reading",
            Verdict.REFUTED,
            f"F from {low:.3g} to {high:.3g}; outside [0, 1] on {share:.0%} of fields of ten threats",
            PRINTED if reading == "literal" else "for peaks above 1",
            f"outside on {share:.0%} of fields",
        )
        for reading, low, high, share in rows[1:]
    ]
    return Finding(
        (usual, readings[0]),
        f"As Eq. 1 is printed, F is no probability: between two threats of sigma = 0.05 it is {middle:.1f}. It is one "
        "if no single f exceeds 1, as in the reading that the toolkit takes (peak 1).",
        tuple(readings[1:]),
        (
            Table(
                f"F on {count} random fields of ten threats",
                ("reading of Eq. 1", "least F", "greatest F", "share outside [0, 1]"),
                rows,
                "sigma from 0.025 to 0.065, anywhere on the map",
            ),
        ),
        (
            (
                "If every f_i is in [0, 1], then so is every 1 - f_i, their product, and F. If one f exceeds 1, a "
                "field of that threat alone has F = f > 1. The printed peak 1 / (sqrt(2 pi) sigma) exceeds 1 for "
                "sigma below 0.399, of a map of side 1."
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
        (
            Part("", Verdict.PROVED, f"F rises by f_new * prod(1 - f_i) >= 0: {count} random fields, to 1e-14", PROPER),
            Part(
                "", Verdict.REFUTED, f"F falls from {alone:.2f} to {both:.2f} between two threats of the map", PRINTED
            ),
        ),
        f"With peaks of at most 1 a further threat never lowers F. As Eq. 1 is printed it can: from {alone:.2f} to "
        f"{both:.2f} between two threats of sigma = 0.05.",
        notes=(
            "F with a further threat t minus F without it is f_t * prod(1 - f_i), which has the sign of the product.",
            IMPLIED,
        ),
        counterexample="printed-peaks.toml",
    )


@claim(
    3,
    "Section 2",
    "A no-fly area is a region where the risk has a very large value.",
    "With such areas F is still a probability, all weights are positive, and no best path crosses an area.",
    Kind.PROOF,
)
def _check_c3(evidence: Evidence) -> Finding:
    stored = counterexamples.scenario("very-large-value.toml").problem
    at_one, between = (float(value) for value in stored.field.density([(0.45, 0.5), (0.5, 0.5)]))
    (weight,) = stored.model.weights([(0.46, 0.5)], [(0.54, 0.5)]).tolist()
    require(at_one < 0.0 and weight < 0.0, "the stored map does not show risk below 0")
    rng, count = evidence.rng("C3"), evidence.instances(60, 10)
    for _ in range(count):
        inside = rng.random(200) < 0.5  # noqa: PLR2004 - an area is anywhere
        outside = _proper(rng).density(rng.random((200, 2)))
        both = 1.0 - (1.0 - inside) * (1.0 - outside)
        require(((both >= 0.0) & (both <= 1.0)).all(), "F left [0, 1] with f = 1 in an area")
        require((both[inside] == 1.0).all() and np.allclose(both, np.where(inside, 1.0, outside)), "F is not 1 there")
    wall = counterexamples.scenario("no-fly-wall.toml")
    require(not solve(wall.problem, Cgla(), resolution=wall.lattice).status.has_path, "the stored map has a way around")
    across = _Valued(wall.problem.no_fly, wall.problem.k, wall.problem.start, wall.problem.goal)
    require(across.best_crosses(1e6), "the best path avoids the stored wall, around which there is no way")
    rows: list[tuple[float, float]] = []
    for width in WALLS:
        gap = _Valued(shapely.box(0.5 - width / 2.0, -0.1, 0.5 + width / 2.0, 0.85), 10.0, (0.1, 0.1), (0.9, 0.1))
        least = gap.least_value()
        require(not any(gap.best_crosses(least * times) for times in (2.0, 10.0, 1000.0)), "more F makes it crossed")
        rows.append((width, least))
    values = [value for _, value in rows]
    require(values == sorted(values), "a thinner wall needs no greater value")
    return Finding(
        (
            Part(
                "F a probability, weights positive",
                Verdict.REFUTED,
                f"two areas of value 1000 make F = {at_one:.3g}, and a weight of {weight:.3g} between them",
                "as a value f >> 1 in Eq. 2",
            ),
            Part(
                "F a probability, weights positive",
                Verdict.PROVED,
                f"f = 1 in the area makes F = 1 there and changes nothing elsewhere: {count} random fields",
                "if F itself is set, to 1",
            ),
            Part(
                "weights positive",
                Verdict.PROVED,
                "F >= 0 everywhere, so that each weight is at least the length; but F is no probability (C1)",
                "if F itself is set, to any value",
            ),
            Part(
                "no best path crosses",
                Verdict.REFUTED,
                "what has no way around it is crossed at a finite cost (no-fly-wall.toml); and the thinner a wall, the "
                "greater the value that it takes",
                "for one finite value on all maps",
            ),
            Part(
                "no best path crosses",
                Verdict.PROVED,
                "segments of a lattice that cross it do so over a least length, and a way around has a cost: beyond "
                "their ratio over K no best path crosses",
                "from some value on, on a lattice with a way around",
                f"{min(values):.3g} to {max(values):.3g} for a wall {max(WALLS):g} to {min(WALLS):g} thick, K = 10",
            ),
        ),
        f"Put through Eq. 2 a large value breaks the model: two areas of value 1000 make F = {at_one:.3g} at the "
        f"centre of one and {between:.3g} between them, and paths would seek them. F set to a large value there keeps "
        "weights positive, and crossing is dear, but never forbidden: how large a value it takes depends on the map.",
        tables=(
            Table(
                "the least value of F at which the best path goes around a wall (K = 10, N = 10)",
                ("thickness of the wall", "value of F"),
                rows,
                "the wall is 0.85 long from the lower side of the map, and the flight passes its lower end",
            ),
        ),
        notes=(
            (
                "In the plane without threats a disc of value F = v is best flown around from 1 + K v = pi / 2 on: an "
                "arc of angle 2 a then costs no more than its chord, for all a up to pi / 2. No such value "
                "does for walls of every thickness."
            ),
            (
                "The toolkit keeps no-fly areas apart: a segment that crosses one has infinite weight, and where "
                "there is no way around, it says that there is no path."
            ),
        ),
        counterexample="very-large-value.toml",
    )


class _Valued:
    """A lattice of N = 10 without threats, on which an area has a value of F."""

    def __init__(self, area: BaseGeometry | None, k: float, start: Point, goal: Point) -> None:
        lattice = paper_lattice(10)
        points = lattice.points
        tails, heads = np.triu_indices(lattice.n_points, 1)
        inside = shapely.length(
            shapely.intersection(shapely.linestrings(np.stack([points[tails], points[heads]], 1)), area)
        )
        self.source, self.target = lattice.nearest(start), lattice.nearest(goal)
        self.k = k
        self.lengths, self.inside = np.zeros((2, lattice.n_points, lattice.n_points))
        self.lengths[tails, heads] = np.hypot(*(points[heads] - points[tails]).T)
        self.inside[tails, heads] = inside
        self.lengths += self.lengths.T
        self.inside += self.inside.T

    def best_crosses(self, value: float) -> bool:
        """Tell whether the best path crosses the area at a value of F."""
        graph = GeometricGraph.from_matrix(self.lengths + self.k * value * self.inside)
        path = [graph.index_of(node) for node in cost_matrix(graph, self.target).path_from(self.source)]
        return any(self.inside[a, b] > EXACT for a, b in itertools.pairwise(path))

    def least_value(self) -> float:
        """Return the least value of F at which the best path does not cross, to a thousandth of it."""
        low, high = 1e-4, 1e6
        while high > 1.001 * low:
            middle = math.sqrt(low * high)
            low, high = (middle, high) if self.best_crosses(middle) else (low, middle)
        return high


@claim(
    4,
    "Section 3.2, Fig. 3",
    "With K = 200 the weight of a segment from (0, 0) is much larger than with K = 10, for each point.",
    "A_200 / A_10 at the 400 lattice points, by sigma and reading of Eq. 1: nowhere about 1.",
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
    stored = counterexamples.scenario("narrow-threat.toml").problem
    few, many = (CostModel(stored.field, k).weights([stored.start], [stored.goal])[0] for k in (LOW, HIGH))
    require(many <= few * (1.0 + EXACT), "the stored map does not show a segment that weighs the same")
    printed = [row for row in rows if row[0] == "literal"]
    narrow = [row for row in rows if row[0] == "membership" and row[1] <= NARROW]
    broad = [row for row in rows if row[0] == "membership" and row[1] > NARROW]
    for sigma in np.linspace(SIGMAS[0], SIGMAS[-1], 16).tolist():
        low, high = weights_from_origin("literal", sigma)
        require((high >= MUCH * low).all(), "as Eq. 1 is printed, a point weighs less than ten times as much")
        low, high = weights_from_origin("membership", min(sigma, NARROW))
        require((high < UNCHANGED * low).any(), "every point weighs more although the threat is narrow")
    (least, greatest), (low_share, high_share) = _reach(narrow, 2, 3), _reach(narrow, 4, 4)
    ratios = "{:.3g} to {:.3g} times"
    return Finding(
        (
            Part(
                "",
                Verdict.PROVED,
                "at least ten times as much at each of the 400 points; F is no probability then (C1)",
                f"as Eq. 1 is printed, for sigma of {SIGMAS[0]:g} to {SIGMAS[-1]:g}",
                f"{ratios.format(*_reach(printed, 2, 3))} as printed",
            ),
            Part(
                "",
                Verdict.REFUTED,
                "segments that pass far from the threat weigh their length, whatever K",
                f"for peak 1 and sigma up to {NARROW:g}",
                f"{ratios.format(least, greatest)} with peak 1 and sigma up to {NARROW:g}, at least doubled at "
                f"{low_share:.0%} to {high_share:.0%} of the points",
            ),
            Part(
                "",
                Verdict.NOT_TESTABLE,
                'the paper gives neither sigma nor a bound for "much larger"',
                f"for peak 1 and broader threats (sigma = {SIGMAS[-1]:g})",
                f"{ratios.format(*_reach(broad, 2, 3))} with sigma = {SIGMAS[-1]:g}",
            ),
        ),
        'It depends on sigma and on the reading of Eq. 1, and the paper gives neither sigma nor a bound for "much '
        'larger". As Eq. 1 is printed it holds, if ten times is much. With peak 1 and sigma = 0.05 three points of '
        "four are not even doubled, and some weigh the same with every K.",
        (
            Part("A_200 >= A_10 everywhere", Verdict.PROVED, "the difference is 190 times the integral", "if F >= 0"),
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
        counterexample="narrow-threat.toml",
    )


def _reach(rows: Sequence[tuple[Any, ...]], low: int, high: int) -> tuple[float, float]:
    """Return the least entry of one column and the greatest of another."""
    return min(row[low] for row in rows), max(row[high] for row in rows)


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
        (
            Part("", Verdict.PROVED, f"all pairs of {count} random maps, K from 0 to 200", PROPER),
            Part(
                "",
                Verdict.REFUTED,
                f"{np.mean(negative):.0%} of pairs are negative ({min(negative):.0%} to {max(negative):.0%} a map)",
                PRINTED,
                f"{np.mean(negative):.0%} of pairs are negative",
            ),
        ),
        "With K >= 0 and peaks up to 1, A(p, r) is at least the length, and A(p, p) = 0. As Eq. 1 is printed, weights "
        f"can be negative: {weight:.3g} for a segment of length 0.16 on the stored map, and {np.mean(negative):.0%} of "
        f"all pairs on {count} random maps of ten threats.",
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
    "A(p, r) = A(r, p), for integrals and for sums over one end of each part of a segment.",
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
    stored = counterexamples.scenario("one-sided-sum.toml").problem
    one, other = (
        float(fused_weights([a], [b], [stored.field], stored.k, integral="raster")[0])
        for a, b in ((stored.start, stored.goal), (stored.goal, stored.start))
    )
    require(abs(one - other) > STEEP * stored.k, "the stored map does not show that a raster sum has a direction")
    return Finding(
        (
            Part("", Verdict.PROVED, f"the same float both ways: {300 * count} segments", "as printed, an integral"),
            Part(
                "",
                Verdict.REFUTED,
                f"{one:.3g} there and {other:.3g} back on the stored map",
                "for sums over one end of each part",
                f"|A - A'| / K is {np.mean(mean):.2g} on average, at most {greatest:.2g}",
            ),
        ),
        f"With exact integrals A is symmetric (the same float both ways, {300 * count} random segments). A sum over "
        f"one end of each of 50 parts, as the authors' followers take it, is not: |A - A'| / K is {np.mean(mean):.2g} "
        f"on average, at most {greatest:.2g}.",
        notes=("The integral over a segment does not depend on the direction in which it is passed.", IMPLIED),
        counterexample="one-sided-sum.toml",
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
    stored = counterexamples.scenario("max-over-uavs.toml").problem
    fields = [RiskField([threat]) for threat in stored.field.threats]
    ends = np.array([stored.start, np.add(stored.start, stored.goal) / 2.0, stored.goal])
    first, second, whole = fused_weights(ends[[0, 1, 0]], ends[[1, 2, 2]], fields, stored.k, fusion="max_integral")
    require(first + second > whole + EXACT, "the stored map does not show that the maximum does not add up")
    return Finding(
        (
            Part("", Verdict.PROVED, f"{100 * count} segments, within {worst:.1g}", "for one UAV"),
            Part("", Verdict.PROVED, "it is one field", "for several UAVs, if F is of all that they know together"),
            Part(
                "",
                Verdict.REFUTED,
                f"two UAVs that know two threats each: {strict} of {100 * count} segments cost more in two parts, none "
                f"less; on the stored map the halves cost {first + second:.3g}, the whole {whole:.3g}",
                "as Eq. 5 is printed, its maximum over several UAVs",
                f"parts cost more on {strict / (100 * count):.1%} of random segments",
            ),
        ),
        f"For one UAV, and for the union of what all know, the parts of a segment add up to it (within {worst:.1g}). "
        "Eq. 5's maximum over UAVs is only subadditive: parts cost more than the whole on "
        f"{strict / (100 * count):.1%} of random segments.",
        notes=(
            (
                "An integral is additive over pieces. A maximum of integrals is not: different pieces may be the "
                "worst for different UAVs."
            ),
            (
                "So on a lattice only steps that pass no third point matter (61 % of the pairs at N = 20), for the "
                "union but not for the maximum."
            ),
            IMPLIED,
        ),
        counterexample="max-over-uavs.toml",
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
    octile_worst, lattice = float(ratio.max()), paper_lattice()
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
    return Finding.single(
        Verdict.PROVED,
        "A segment is at most as long as its path of eight directions, which is at most 1.0824 times as long (1 / "
        "cos(pi / 8)); and no path of eight directions is cheaper than the best one of all: it is "
        f"{np.mean(excess):.1%} more expensive on average, {max(excess):.1%} at most, on {count} random maps.",
        (
            Part(
                "J of all directions <= J of eight",
                Verdict.PROVED,
                "the eight moves are edges of the complete graph as well",
                effect=f"{np.mean(excess):.1%} more expensive on average, {max(excess):.1%} at most",
            ),
        ),
        notes=(
            (
                "|v| <= max + (sqrt 2 - 1) min of |dx| and |dy| <= |v| / cos(pi / 8): the triangle inequality, and "
                "the maximum of cos a + (sqrt 2 - 1) sin a at pi / 8."
            ),
            "That bound is of length, and so of cost in free space; of cost among threats, and of risk, there is none.",
        ),
        effect=f"the path of eight directions is up to {octile_worst - 1.0:.2%} longer",
    )


@claim(
    27,
    "Abstract",
    "The evaluation of risk in path planning is introduced for the first time.",
    "None: a statement about the literature.",
    Kind.PROSE,
)
def _check_c27(_: Evidence) -> Finding:
    return Finding.single(
        Verdict.NOT_TESTABLE,
        "What came first is a question to the literature. Probabilistic risk was used for planning before: Kim, Gu "
        "and Postlethwaite (2008, from work of 2006), and Bortoff (2000) trades stealth for length.",
    )
