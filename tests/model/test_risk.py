"""The risk field: density, gradient and line integral against plain NumPy and `scipy.integrate.quad`."""

import itertools
import math
import pickle
import subprocess
import sys
from collections.abc import Callable, Sequence
from fractions import Fraction
from itertools import pairwise

import numba
import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from oracles import density, inclusion_exclusion, line_integral, rate
from scipy.integrate import quad, simpson
from strategies import Segment, fast, few, fields_and_segments, usual

from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import ImproperFieldWarning, Reading, RiskField, Threat
from cgla_graph.model.risk_kernels import exp2, fma, segment_risk
from cgla_graph.testing.strategies import crowds, fields, peaks, points, seeds, spreads, threats

TOLERANCE = 1e-10
TWO = RiskField([Threat(0.5, 0.5, spread=0.1), Threat(0.5, 0.6, spread=0.2, peak=0.5)])


def integral(field: RiskField, segment: Segment) -> float:
    return float(field.line_integral(*segment))


def check_quad(field: RiskField, segment: Segment) -> None:
    assert abs(integral(field, segment) - line_integral(field.threats, *segment)) <= TOLERANCE


# The line integral against quad, in both of its code paths


@fast
@given(fields_and_segments(st.one_of(fields(1, 4), crowds())))
def test_the_integral_equals_quad(case: tuple[RiskField, Segment]) -> None:
    """In closed form for up to four threats (6 pairs, 15 terms), by quadrature for crowds."""
    check_quad(*case)


def past(spot: Point, spread: float, n: int, seed: int) -> tuple[FloatArray, FloatArray]:
    """Draw segments through a spot, past it, towards it and away from it, 0.1 to 20 spreads long."""
    rng = np.random.default_rng(seed)
    angle, length = rng.uniform(0.0, 2.0 * np.pi, n), 10.0 ** rng.uniform(-1.0, 1.3, n)
    aside = np.where(rng.random(n) < 0.4, 0.0, 6.0 * rng.random(n) ** 1.5)
    along = np.column_stack([np.cos(angle), np.sin(angle)])
    across = np.column_stack([-np.sin(angle), np.cos(angle)])
    starts = np.array(spot) + spread * (rng.uniform(-8.0, 2.0, n)[:, None] * along + aside[:, None] * across)
    return starts, starts + spread * length[:, None] * along


def fine_integral(field: RiskField, spot: Point, start: FloatArray, end: FloatArray) -> float:
    """Integrate in long double on panels far narrower than the kernels': threats on and beside one spot."""
    rows, counts = np.unique([(t.x, t.y, t.spread, t.peak) for t in field.threats], axis=0, return_counts=True)
    spread, length = rows[:, 2].max(), math.dist(start, end)
    u = (end - start) / length
    steps = np.concatenate([np.arange(-14.0, 14.1, 0.25), np.arange(-1.5, 1.51, 0.05)])
    cuts = np.unique(np.clip((np.array(spot) - start) @ u + spread * steps, 0.0, length)).astype(np.longdouble)
    nodes, weights = np.polynomial.legendre.leggauss(16)
    half = 0.5 * np.diff(cuts)[:, None]
    t = cuts[:-1, None] + half * (1.0 + nodes)
    clear = np.ones_like(t)
    for (x, y, s, peak), count in zip(rows, counts, strict=True):
        squared = (start[0] + t * u[0] - x) ** 2 + (start[1] + t * u[1] - y) ** 2
        clear *= (1.0 - peak * np.exp(-0.5 * squared / s**2)) ** count
    return float((half * weights * (1.0 - clear)).sum())


def error_in_spreads(field: RiskField, spot: Point, n: int, seed: int) -> float:
    spread = max(threat.spread for threat in field.threats)
    starts, ends = past(spot, spread, n, seed)
    truth = [fine_integral(field, spot, start, end) for start, end in zip(starts, ends, strict=True)]
    return float(np.abs(field.line_integral(starts, ends) - truth).max()) / spread


PEAKS = (1.0, 0.3, 0.05, 1e-3)


@pytest.mark.parametrize(
    ("n", "peak"),
    [
        *itertools.product((2, 20), PEAKS),
        *(pytest.param(*case, marks=pytest.mark.slow) for case in itertools.product((5, 10, 50, 100), PEAKS)),
        *((1000, peak) for peak in (1e-2, 1e-3, 1e-5, 1e-8)),
    ],
)
def test_threats_on_one_spot_are_integrated_as_exactly_as_promised(n: int, peak: float) -> None:
    field = RiskField([Threat(0.5, 0.5, spread=0.1, peak=peak)] * n)
    assert error_in_spreads(field, (0.5, 0.5), 100 if n == 1000 else 300, seed=n) <= 4e-12


@few
@given(st.integers(2, 100), st.floats(0.05, 1.0), st.floats(0.1, 1.0), st.sampled_from([0.0, 0.01, 0.3]), seeds)
@example(100, 1.0, 1.0, 0.01, 0)
@example(100, 0.05, 1.0, 0.0, 0)
@example(30, 0.5, 0.5, 0.0, 0)
def test_threats_almost_on_one_spot_are_integrated_as_exactly_as_promised(
    n: int, least_peak: float, least_spread: float, apart: float, seed: int
) -> None:
    rng = np.random.default_rng(seed)
    at = 0.5 + 0.1 * apart * rng.uniform(-1.0, 1.0, (n, 2))
    # most as wide as the widest: the wider, the more of the error
    spread = 0.1 * np.where(rng.random(n) < 0.3, rng.uniform(least_spread, 1.0, n), 1.0)
    rows = np.column_stack([at, spread, rng.uniform(least_peak, 1.0, n)]).tolist()
    field = RiskField([Threat(x, y, spread=s, peak=p) for x, y, s, p in rows])
    assert error_in_spreads(field, (0.5, 0.5), 15, seed) <= 4e-12


def test_threats_far_narrower_than_any_panel_add_no_noise() -> None:
    """On nodes of the narrowest panel there is, 1e-12 of the segment, the exponents of such threats are rounding."""
    along = np.array([0.0, 0.0]), np.array([1.0, 0.0])
    wide = RiskField([Threat(x, 0.0, spread=0.2) for x in (0.0, 0.1, 0.2, 0.3, 0.4)])
    at = 0.5e-12 * (1.0 + np.polynomial.legendre.leggauss(32)[0])
    narrow = [Threat(x, 0.0, spread=1e-30) for x in at.tolist()]
    assert abs(integral(wide.with_threats(narrow), along) - integral(wide, along)) <= TOLERANCE


@usual
@given(fields_and_segments(st.one_of(crowds(), fields(1, 4))), st.floats(-0.1, 1.5))
def test_risk_above_a_limit_is_told_only_as_far_as_the_limit(case: tuple[RiskField, Segment], share: float) -> None:
    field, (start, end) = case
    exact = integral(field, (start, end))
    limit = share * exact
    found = segment_risk(*start, *end, field.kernel_field(), limit)
    assert found == exact if exact <= limit else limit < found <= exact * (1.0 + 1e-12)


@pytest.mark.parametrize("spread", [0.18, 0.25, 0.5])
def test_many_products_just_below_the_cutoff_still_count(spread: float) -> None:
    field = RiskField([Threat(0.0, 0.0, spread=spread)] * 100)
    check_quad(field, (np.array([-1.0, 5.49 * spread]), np.array([1.0, 5.49 * spread])))


@fast
@given(points, spreads, peaks, points, points)
def test_single_threat_has_its_closed_form(centre: Point, spread: float, peak: float, start: Point, end: Point) -> None:
    length = math.dist(start, end)
    assume(length > 1e-6)
    ux, uy = (end[0] - start[0]) / length, (end[1] - start[1]) / length
    rx, ry = centre[0] - start[0], centre[1] - start[1]
    along, miss = rx * ux + ry * uy, rx * uy - ry * ux
    root = 1.0 / (math.sqrt(2.0) * spread)
    height = peak * math.exp(-((miss * root) ** 2))
    expected = height * spread * math.sqrt(math.pi / 2) * (math.erf((length - along) * root) + math.erf(along * root))
    found = integral(RiskField([Threat(*centre, spread=spread, peak=peak)]), (np.array(start), np.array(end)))
    assert abs(found - expected) <= 1e-12


def test_dropping_the_pairs_would_be_seen() -> None:
    pair = [Threat(0.4, 0.5, spread=0.1), Threat(0.6, 0.5, spread=0.1)]
    ends = np.array([0.0, 0.5]), np.array([1.0, 0.5])
    broken = inclusion_exclusion(pair, *ends, largest=1)
    assert broken > line_integral(pair, *ends) + 1e-2
    assert abs(inclusion_exclusion(pair, *ends) - line_integral(pair, *ends)) <= TOLERANCE


def test_the_exponential_of_the_kernels_is_as_near_as_it_says() -> None:
    x = np.concatenate([np.linspace(-1000.0, 1000.0, 20_001), np.linspace(-2.0, 2.0, 20_000)])
    found = np.array([exp2(value) for value in x.tolist()])
    assert np.abs(found / np.exp2(x) - 1.0).max() <= 2e-14
    assert 0.0 < exp2(-1e300) <= 1e-300


def test_fused_multiply_and_add_rounds_once() -> None:
    # else the processor would decide what a segment weighs
    @numba.njit
    def fused(x: float, y: float, z: float) -> float:
        return fma(x, y, z)

    rows = np.random.default_rng(0).uniform(-1.0, 1.0, (200, 3))
    rows[:100, 2] = -rows[:100, 0] * rows[:100, 1]
    exact = [float(Fraction(x) * Fraction(y) + Fraction(z)) for x, y, z in rows.tolist()]
    assert [fused(x, y, z) for x, y, z in rows.tolist()] == exact
    assert all(exact[:100])


# Laws of the line integral


@fast
@given(fields_and_segments(crowds()))
def test_both_directions_give_the_same_float(case: tuple[RiskField, Segment]) -> None:
    field, (start, end) = case
    assert integral(field, (start, end)) == integral(field, (end, start))


@usual
@given(crowds(), points)
def test_segment_without_length_has_no_risk(field: RiskField, point: Point) -> None:
    assert field.line_integral(point, point) == 0.0


@fast
@given(fields_and_segments(crowds()))
def test_integral_is_at_most_the_length(case: tuple[RiskField, Segment]) -> None:
    field, segment = case
    assert 0.0 <= integral(field, segment) <= math.dist(*segment) + TOLERANCE


@usual
@given(fields_and_segments(crowds(30)), st.integers(-6, 6), st.floats(1.0, 10.0))
def test_scaling_the_map_scales_the_integral(case: tuple[RiskField, Segment], power: int, factor: float) -> None:
    field, (start, end) = case
    s = factor * 10.0**power
    scaled = RiskField([Threat(s * t.x, s * t.y, spread=s * t.spread, peak=t.peak) for t in field.threats])
    expected = s * integral(field, (start, end))
    assert integral(scaled, (s * start, s * end)) == pytest.approx(expected, rel=1e-9, abs=s * 1e-11)


@fast
@given(fields_and_segments(crowds(30)), threats(), st.lists(points, min_size=1, max_size=20))
def test_one_more_threat_never_lowers_the_risk(
    case: tuple[RiskField, Segment], more: Threat, where: list[Point]
) -> None:
    field, segment = case
    higher = field.with_threats([more])
    assert (higher.density(where) >= field.density(where)).all()
    assert integral(higher, segment) >= integral(field, segment) - TOLERANCE


# Density and gradient


@fast
@given(crowds(), st.lists(points, max_size=20))
def test_density_is_eq2_and_a_probability(field: RiskField, where: list[Point]) -> None:
    at = np.array(where).reshape(-1, 2)
    found = field.density(at)
    assert ((found >= 0.0) & (found <= 1.0)).all()
    np.testing.assert_allclose(found, density(field.threats, at), rtol=0.0, atol=1e-13)


def test_many_points_at_once_have_the_same_density_to_the_last_bit() -> None:
    """Threats that no point of a block feels are left out: what they would change is rounded away."""
    rows = np.random.default_rng(1).uniform(1e-3, 1.0, (60, 3)) * (4.0, 4.0, 0.1)
    field = RiskField([Threat(x, y, spread, 1.0) for x, y, spread in rows])
    at = np.stack(np.meshgrid(np.linspace(0.0, 4.0, 90), np.linspace(0.0, 4.0, 30)), axis=-1).reshape(-1, 2)
    found = field.density(at)
    assert np.array_equal(found, [field.density(point) for point in at])
    np.testing.assert_allclose(found, density(field.threats, at), rtol=0.0, atol=1e-14)


def difference_error(
    field: RiskField, gradient: Callable[[FloatArray], FloatArray], at: FloatArray, step: float
) -> float:
    """Return the greatest difference between a gradient and central differences of the density."""
    moves = step * np.eye(2)
    slopes = [(field.density(at + move) - field.density(at - move)) / (2.0 * step) for move in moves]
    return float(np.abs(np.stack(slopes, axis=-1) - gradient(at)).max())


@few
@given(st.integers(0, 2**32 - 1), st.integers(1, 12), st.floats(0.02, 0.3))
def test_central_differences_converge_to_the_gradient_with_order_2(seed: int, n: int, spread: float) -> None:
    rng = np.random.default_rng(seed)
    where = 0.5 + 2.0 * spread * rng.uniform(-1.0, 1.0, (n, 2))
    field = RiskField([Threat(x, y, spread=spread, peak=p) for (x, y), p in zip(where, rng.random(n), strict=True)])
    at = 0.5 + 4.0 * spread * rng.uniform(-1.0, 1.0, (200, 2))
    steps = [spread * 0.02 / 2**i for i in range(4)]
    assert 1.9 <= rate([difference_error(field, field.gradient, at, step) for step in steps]) <= 2.1


def test_a_gradient_without_the_other_factors_does_not_converge() -> None:
    field = RiskField([Threat(0.4, 0.5, spread=0.1, peak=0.9), Threat(0.6, 0.5, spread=0.1, peak=0.9)])
    at = np.random.default_rng(0).random((200, 2))

    def wrong(where: FloatArray) -> FloatArray:
        return np.asarray(sum(RiskField([threat]).gradient(where) for threat in field.threats))

    assert rate([difference_error(field, wrong, at, 0.002 / 2**i) for i in range(4)]) < 0.1


@usual
@given(points, spreads, peaks)
def test_gradient_is_nought_at_the_centre_of_a_lone_threat(centre: Point, spread: float, peak: float) -> None:
    gradient = RiskField([Threat(*centre, spread=spread, peak=peak)]).gradient(centre)
    assert gradient.tolist() == [0.0, 0.0]
    assert not np.signbit(gradient).any()


@fast
@given(crowds(), st.floats(1e-6, 2.0))
def test_contours_are_where_each_threats_own_risk_falls_to_the_level(field: RiskField, level: float) -> None:
    assert field.centres.tolist() == [[threat.x, threat.y] for threat in field.threats]
    for threat, radius in zip(field.threats, field.contour_radii(level).tolist(), strict=True):
        rim = RiskField([threat]).density((threat.x + radius, threat.y))
        assert rim == pytest.approx(min(level, threat.peak), rel=1e-6)


# Shapes and arrays


@pytest.mark.parametrize("shape", [(), (0,), (1,), (3,), (2, 3), (2, 0, 3), (2, 1, 3)])
def test_answers_have_the_shape_of_the_points(shape: tuple[int, ...]) -> None:
    at = np.random.default_rng(0).random((*shape, 2))
    flat = at.reshape(-1, 2)
    for ask, more in ((TWO.density, ()), (TWO.gradient, (2,))):
        assert ask(at).shape == shape + more
        assert (ask(at).ravel() == ask(flat).ravel()).all()


NO_SHAPE: tuple[int, ...] = ()


@pytest.mark.parametrize(
    ("first", "second", "both"),
    [
        *((shape, NO_SHAPE, shape) for shape in (NO_SHAPE, (3,), (0,), (2, 0, 3))), ((), (3,), (3,)),
        ((3, 1), (4,), (3, 4)), ((2, 1), (1, 2), (2, 2)),
    ],
)  # fmt: skip
def test_ends_broadcast(first: tuple[int, ...], second: tuple[int, ...], both: tuple[int, ...]) -> None:
    rng = np.random.default_rng(0)
    starts, ends = rng.random((*first, 2)), rng.random((*second, 2))
    found = TWO.line_integral(starts, ends)
    assert found.shape == both
    wide = (np.broadcast_to(a, (*both, 2)).reshape(-1, 2) for a in (starts, ends))
    assert found.ravel().tolist() == [integral(TWO, segment) for segment in zip(*wide, strict=True)]


def test_a_field_of_nothing_has_no_risk() -> None:
    field = RiskField()
    assert field.line_integral([[0, 0]], [[1, 1]]).tolist() == [0.0]
    assert field.density((0, 0)) == 0.0
    assert np.abs(field.gradient((1, 0))).max() == 0.0
    assert len(field) == 0


# What can matter: weak threats, and great risk weights


def summed(threats: Sequence[Threat], points: FloatArray) -> FloatArray:
    """Evaluate ``F`` without a difference from 1."""
    risk = np.zeros(len(points))
    for one in threats:
        squared = (points[:, 0] - one.x) ** 2 + (points[:, 1] - one.y) ** 2
        risk += one.peak * np.exp(-0.5 * squared / one.spread**2) * (1.0 - risk)
    return risk


def scipy_integral(threats: Sequence[Threat], start: FloatArray, end: FloatArray) -> float:
    def risk(share: float) -> float:
        return float(summed(threats, (start + share * (end - start))[None])[0])

    scale = max(threat.peak for threat in threats)
    places = np.linspace(0.0, 1.0, 21)
    parts = [quad(lambda s: risk(s) / scale, low, high, epsabs=0.0, epsrel=1e-11)[0] for low, high in pairwise(places)]
    return scale * math.dist(start, end) * math.fsum(parts)


@pytest.mark.parametrize("peak", [1e-5, 1e-12, 1e-20, 1e-60])
@pytest.mark.parametrize("n", [1, 2, 40])
def test_weak_threats_are_as_exact_as_strong_ones(peak: float, n: int) -> None:
    """In closed form and by quadrature: relative to the strongest."""
    rng = np.random.default_rng(n)
    spots = [(0.5, 0.5), *rng.random((n - 1, 2)).tolist()]
    field = RiskField([Threat(x, y, 0.1, peak * (1.0 - i / 100)) for i, (x, y) in enumerate(spots)])
    for start, end in (((0.05, 0.5), (0.95, 0.5)), ((0.3, 0.4), (0.31, 0.45)), ((0.9, 0.9), (0.2, 0.3))):
        truth = scipy_integral(field.threats, np.array(start), np.array(end))
        assert integral(field, (start, end)) == pytest.approx(truth, rel=1e-9, abs=0.0)
    points = rng.random((50, 2))
    assert field.density(points) == pytest.approx(summed(field.threats, points), rel=1e-12, abs=1e-16 * peak)


@pytest.mark.parametrize("n", [1, 30])
def test_under_a_great_weight_the_tail_of_a_strong_threat_counts(n: int) -> None:
    """Also beyond the end of a segment that leads straight to the threat, and beside a much stronger one."""
    k = 1e12
    rng = np.random.default_rng(1)
    strong = [Threat(0.5, 0.5, 0.05, 0.9), *(Threat(*rng.random(2), 0.05, 0.8) for _ in range(n - 1))]
    weak = Threat(0.05, 0.95, 0.02, 1e-12)
    field = Problem((0.0, 0.0), (1.0, 1.0), RiskField([*strong, weak]), k=k).field
    for start, end in (((0.0, 0.5), (0.1, 0.5)), ((0.0, 0.1), (1.0, 0.1)), ((0.0, 0.95), (0.1, 0.95))):
        truth = scipy_integral(field.threats, np.array(start), np.array(end))
        length = math.dist(start, end)
        assert k * integral(field, (start, end)) == pytest.approx(k * truth, rel=1e-9, abs=1e-9 * length)


def test_thousands_of_threats_that_add_up() -> None:
    rng = np.random.default_rng(3)
    threats = [Threat(x, y, 0.1, 1e-15) for x, y in rng.random((2000, 2))]
    field = RiskField(threats)
    points = np.column_stack([np.linspace(0.1, 0.9, 2001), np.full(2001, 0.5)])
    assert integral(field, ((0.1, 0.5), (0.9, 0.5))) == pytest.approx(
        simpson(summed(threats, points), points[:, 0]), rel=1e-9, abs=0.0
    )


@given(k=st.floats(1.0, 1e3), weaker=st.integers(3, 30))
@few
def test_weak_threats_under_a_great_weight_cost_as_strong_ones_under_a_small_one(k: float, weaker: int) -> None:
    """But for what overlaps: so of one threat, whose product with itself is not there."""
    scale = 10.0**weaker
    plain, great = (
        Problem((0.05, 0.5), (0.95, 0.5), RiskField([Threat(0.5, 0.45, 0.1, 0.9 / s)]), k=k * s) for s in (1.0, scale)
    )
    path = [plain.start, (0.3, 0.2), (0.7, 0.1), plain.goal]
    assert great.evaluate(path).cost == pytest.approx(plain.evaluate(path).cost, rel=1e-12)


def test_fields_for_a_weight_are_equal_and_travel() -> None:
    field = RiskField([Threat(0.5, 0.5, 0.1)])
    great = field.for_weight(1e12)
    assert (field.for_weight(1e3) is field, great == field, great.unit, field.unit) == (True, True, 1e-9, 1.0)
    assert pickle.loads(pickle.dumps(great)).unit == great.unit  # noqa: S301 - from the line itself
    assert great.for_weight(1.0).unit == 1.0


def test_nothing_passed_in_is_changed() -> None:
    threat_list = [Threat(0.5, 0.5, spread=0.1)]
    field = RiskField(threat_list)
    more = field.with_threats([Threat(0.1, 0.1, spread=0.1)])
    ends = np.random.default_rng(0).random((2, 5, 2))
    before = ends.copy()
    ends.flags.writeable = False
    for ask in (field.density, field.gradient):
        ask(ends)
    field.line_integral(*ends)
    field.line_integral(np.asfortranarray(ends[0]), ends[1, ::-1])
    assert (ends == before).all()
    assert (len(threat_list), len(field), len(more)) == (1, 1, 2)
    assert more.threats[0] is field.threats[0]
    with pytest.raises(ValueError, match="read-only"):
        field.table[0, 0] = 1.0


# Fields of the user's own


@pytest.mark.parametrize("mixed_in", [False, True])
@pytest.mark.parametrize("name", ["density", "gradient", "line_integral", "table", "kernel_field", "is_proper"])
def test_a_field_that_computes_the_risk_in_another_way_is_refused(name: str, mixed_in: bool) -> None:
    constant: dict[str, object] = {name: lambda *_: np.ones(1)}
    bases = (type("Constant", (), constant), RiskField) if mixed_in else (RiskField,)
    own = type("Storm", bases, {} if mixed_in else constant)
    with pytest.raises(ProblemError, match=f"Storm overrides {name}, which solvers and the oracle would ignore"):
        own([Threat(0.5, 0.5, 0.1)])


def test_a_field_with_more_methods_is_fine() -> None:
    class Named(RiskField):
        @property
        def name(self) -> str:
            return f"{len(self)} threats"

    assert Named([Threat(0.5, 0.5, 0.1)]).name == "1 threats"
    assert Named([Threat(0.5, 0.5, 0.1)]).density((0.5, 0.5)) == 1.0


# Improper fields: the readings of Eq. 1


def literal_pair(gap: float = 0.05) -> RiskField:
    """Build two threats by Eq. 1 as it is printed: both peak at 8."""
    members = [Threat.from_eq1(0.5 + x, 0.5, 0.05, reading="literal") for x in (0.0, gap)]
    with pytest.warns(ImproperFieldWarning, match="2 of 2 threats peak above 1"):
        return RiskField(members, improper=True)


def test_two_overlapping_threats_of_eq1_as_printed_make_a_negative_risk() -> None:
    field = literal_pair()
    assert field.improper
    assert field.density((0.525, 0.5)) < 0.0
    assert field.line_integral((0.4, 0.5), (0.6, 0.5)) < 0.0


@few
@example(n=2, sigma=0.05, reading="literal", ends=((0.0, 0.5), (1.0, 0.5)))
@given(
    n=st.integers(1, 12),
    sigma=st.floats(0.02, 0.3),
    reading=st.sampled_from(["literal", "sigma2", "gauss2d"]),
    ends=st.tuples(points, points),
)
def test_improper_integral_equals_quad(n: int, sigma: float, reading: Reading, ends: tuple[Point, Point]) -> None:
    rng = np.random.default_rng(n)
    members = [Threat.from_eq1(*rng.uniform(0.3, 0.7, 2).tolist(), sigma, reading=reading) for _ in range(n)]
    assume(any(threat.peak > 1.0 for threat in members))
    with pytest.warns(ImproperFieldWarning):
        field = RiskField(members, improper=True)
    start, end = np.array(ends[0]), np.array(ends[1])
    along = start + np.linspace(0.0, 1.0, 500)[:, None] * (end - start)
    # F has no bound here; float can only be exact relative to its size
    scale = max(1.0, float(np.abs(density(members, along)).max()))
    assert abs(integral(field, (start, end)) - line_integral(members, start, end)) <= TOLERANCE * scale


def test_an_improper_field_without_high_peaks_is_a_proper_one() -> None:
    field = RiskField([Threat(0.0, 0.0, spread=1.0)], improper=True)
    assert field.is_proper
    plain = RiskField([Threat(0.0, 0.0, spread=1.0)])
    assert field.line_integral((-1, 0), (1, 0.5)) == plain.line_integral((-1, 0), (1, 0.5))


# --- places that are not known exactly ---


@usual
@given(member=threats(), share=st.floats(0.0, 3.0), where=points)
def test_a_blurred_threat_is_the_mean_over_its_places(member: Threat, share: float, where: Point) -> None:
    # Gauss-Hermite nodes of an error of this size along both axes: the mean of a smooth density, in closed form
    nodes, weights = np.polynomial.hermite_e.hermegauss(120)
    error = share * member.spread
    means = [
        (weights / weights.sum()) @ np.exp(-0.5 * ((there - centre - error * nodes) / member.spread) ** 2)
        for there, centre in zip(where, (member.x, member.y), strict=True)
    ]
    found = RiskField([member.blurred(error)]).density(where)
    assert float(found) == pytest.approx(member.peak * math.prod(means), rel=1e-6, abs=1e-9)


def simulated(field: list[Threat], error: float, ends: Segment, n: int) -> tuple[float, float]:
    """Return the mean risk of a segment over places drawn at random, and the standard error of that mean."""
    rng = np.random.default_rng(7)
    risks = []
    for _ in range(n):
        shifts = rng.normal(0.0, error, (len(field), 2))
        drawn = [
            Threat(one.x + dx, one.y + dy, one.spread, one.peak)
            for one, (dx, dy) in zip(field, shifts.tolist(), strict=True)
        ]
        risks.append(float(RiskField(drawn).line_integral(*ends)))
    return float(np.mean(risks)), float(np.std(risks) / math.sqrt(n))


def test_expected_risk_of_independent_places_is_that_of_blurred_threats() -> None:
    field = [Threat(0.4, 0.5, 0.1, 0.9), Threat(0.5, 0.55, 0.08), Threat(0.65, 0.45, 0.12, 0.7)]
    error, ends = 0.07, ((0.1, 0.45), (0.9, 0.55))
    mean, off = simulated(field, error, ends, 4000)
    exact = float(RiskField([one.blurred(error) for one in field]).line_integral(*ends))
    assert abs(exact - mean) < 4.0 * off
    # taking the places as given is wrong by many times that, and so is a threat as high as before
    wider = RiskField([Threat(one.x, one.y, one.blurred(error).spread, one.peak) for one in field])
    for wrong in (RiskField(field), wider):
        assert abs(float(wrong.line_integral(*ends)) - mean) > 20.0 * off


def test_uncertainty_of_0_changes_nothing_and_no_size_ends_in_nonsense() -> None:
    member = Threat(0.5, 0.5, 0.1, 0.9)
    assert member.blurred(0.0) == member
    for wrong, words in (
        (-0.1, "uncertainty is -0.1"),
        (math.nan, "uncertainty"),
        (1e40, "leave it out"),
        (1e80, "it out"),
    ):
        with pytest.raises(ProblemError, match=words):
            member.blurred(wrong)


@usual
@given(st.floats(0.01, 5.0), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_readings_of_eq1_are_the_formulas_of_the_paper(sigma: float, x: float, y: float) -> None:
    d2 = x * x + y * y
    printed = 1.0 / (math.sqrt(2.0 * math.pi) * sigma)
    formulas: dict[Reading, float] = {
        "membership": math.exp(-d2 / (2.0 * sigma**2)),
        "literal": printed * math.exp(-d2 / (2.0 * sigma)),
        "sigma2": printed * math.exp(-d2 / (2.0 * sigma**2)),
        "gauss2d": math.exp(-d2 / (2.0 * sigma**2)) / (2.0 * math.pi * sigma**2),
    }
    for reading, expected in formulas.items():
        threat = Threat.from_eq1(0.0, 0.0, sigma, reading=reading)
        found = threat.peak * math.exp(-d2 / (2.0 * threat.spread**2))
        assert found == pytest.approx(expected, rel=1e-12, abs=1e-300)
    assert Threat.from_eq1(0.0, 0.0, sigma) == Threat.from_eq1(0.0, 0.0, sigma, reading="membership")


# Extremes


HANG = """
import sys
from cgla_graph.model.risk import RiskField, Threat
field = lambda spread: RiskField([Threat(0.5, 0.5, spread=spread)] * 8)
field(0.1).line_integral((0, 0.5), (1, 0.5))
print("compiled", file=sys.stderr, flush=True)
print(field(1e-17).line_integral((0, 0.5), (1, 0.5)))
"""


def test_spreads_below_an_ulp_of_the_map_do_not_hang() -> None:
    child = subprocess.Popen([sys.executable, "-c", HANG], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
    try:
        assert child.stderr is not None
        assert child.stderr.readline() == "compiled\n"
        risk, _ = child.communicate(timeout=60.0)
        assert abs(float(risk)) <= TOLERANCE
    finally:
        child.kill()
        child.communicate(timeout=60.0)


@pytest.mark.parametrize("spread", [1e-200, 1e200])
def test_extreme_spreads_are_refused_or_right(spread: float) -> None:
    try:
        field = RiskField([Threat(0.0, 0.0, spread=spread, peak=0.5)] * 2)
    except ProblemError:
        return
    assert field.density((0.0, 0.0)) == pytest.approx(0.75)
    assert integral(field, (np.zeros(2), np.ones(2))) == pytest.approx(0.75 * math.sqrt(2.0) * (spread > 1.0))


# Refusals


NO_NUMBERS = (math.nan, -math.inf, "1", None, True, (1.0, 2.0), 10**400, 1j)


@pytest.mark.parametrize(
    ("name", "value"),
    [*itertools.product(["x", "y", "spread", "peak"], NO_NUMBERS), *itertools.product(["spread", "peak"], (0.0, -1.0))],
)
def test_a_threat_names_the_number_that_is_wrong(name: str, value: object) -> None:
    numbers: dict[str, object] = {"x": 0.5, "y": 0.5, "spread": 0.1, "peak": 1.0, name: value}
    with pytest.raises(ProblemError, match=f"threat {name} is"):
        Threat(**numbers)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda: RiskField([(0.5, 0.5, 0.1, 1.0)]), "threat 0 is .*not a Threat"),
        (lambda: RiskField("ab"), "threat 0 is 'a', not a Threat"),
        (lambda: RiskField().with_threats([None]), "threat 0 is None"),
        (lambda: Threat.from_eq1(0.0, 0.0, 0.1, reading="printed"), "printed.*membership, literal"),
        (lambda: Threat.from_eq1(0.0, 0.0, -0.1), "sigma is -0.1"),
        (lambda: RiskField(Threat(0.5, 0.5, spread=0.1)), "give a list of Threat"),
        (lambda: RiskField(None), "threats are None; give a list of Threat"),
        (lambda: RiskField().with_threats(3), "give a list of Threat"),
        *((lambda odd=odd: Threat.from_eq1(0.0, 0.0, 1.0, reading=odd), "unknown reading") for odd in ([], None, 1)),
        *((lambda odd=odd: RiskField().contour_radii(odd), "level is") for odd in (0.0, -1.0, math.nan, "high")),
        (lambda: Threat.from_eq1(0.0, 0.0, 1e-200, reading="gauss2d"), "sigma"),
        (lambda: RiskField([Threat(0, 0, 1), Threat(0, 0, 1, math.nextafter(1, 2))]), r"threat 1 has peak .* \(0, 1\]"),
        (lambda: RiskField().line_integral(np.ones((2, 2)), np.ones((3, 2))), r"\(2, 2\).*\(3, 2\).*broadcast"),
    ],
)
def test_malformed_fields_are_refused(make: Callable[[], object], words: str) -> None:
    with pytest.raises(ProblemError, match=words) as caught:
        make()
    assert isinstance(caught.value, CglaError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("bad", [None, "ab", 5.0, [1, 2, 3], [[1, 2], [3]], [math.nan, 0], [0, math.inf], [[0], [1]]])
def test_malformed_points_are_refused(bad: ArrayLike) -> None:
    field = RiskField()
    for ask in (field.density, field.gradient):
        with pytest.raises(ProblemError, match="points"):
            ask(bad)
    with pytest.raises(ProblemError, match="starts"):
        field.line_integral(bad, (0, 0))
    with pytest.raises(ProblemError, match="ends"):
        field.line_integral((0, 0), bad)


def test_an_improper_field_stays_improper_until_it_needs_to_be() -> None:
    field = RiskField(improper=True)
    assert field.is_proper
    with pytest.warns(ImproperFieldWarning):
        higher = field.with_threats([Threat(0.0, 0.0, spread=1.0, peak=2.0)])
    assert (higher.improper, higher.is_proper) == (True, False)


def test_a_pickled_field_is_the_same_and_read_only() -> None:
    field = RiskField([Threat(0.1, 0.2, spread=0.3, peak=0.4)])
    again = pickle.loads(pickle.dumps(field))  # noqa: S301 - our own bytes
    assert again == field
    assert not again.table.flags.writeable


def test_narrow_threats_count_twice_as_they_should() -> None:
    # products of precisions are fourth powers: they must not overflow before spreads are refused
    one, two = (RiskField([Threat(0.0, 0.0, spread=1e-69)] * n) for n in (1, 2))
    ends = np.array([-1e-68, 0.0]), np.array([1e-68, 0.0])
    expected = (2.0 - math.sqrt(0.5)) * one.line_integral(*ends)
    assert two.line_integral(*ends) == pytest.approx(expected, rel=1e-9)
    with pytest.raises(ProblemError, match="threat spread"):
        Threat(0.0, 0.0, spread=1e-71)


@pytest.mark.parametrize("size", [1e-3, 1e3, 1e6])
def test_accuracy_is_relative_to_the_size_of_the_map(size: float) -> None:
    field = RiskField([Threat(0.3 * size, 0.4 * size, spread=s * size) for s in (0.01, 0.05, 0.1, 0.2, 0.4, 0.5)])
    ends = np.array([0.0, 0.0]), np.array([size, size])
    assert abs(integral(field, ends) - line_integral(field.threats, *ends)) <= size * TOLERANCE
