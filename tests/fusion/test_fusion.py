"""The readings of Eq. 5: what several UAVs know together, against `quad`, plain NumPy and the laws that must hold."""

import math
from collections.abc import Callable
from typing import Any, TypeAlias, get_args

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from oracles import largest_integral, line_integral, raster, rate
from strategies import Segment, fast, few, off_lattice_points, segments, usual

from cgla_graph import _threads
from cgla_graph._threads import THREADED_FROM
from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import ProblemError
from cgla_graph.fusion import envelope_kernels
from cgla_graph.fusion.fusion import Fusion, Integral, fused_graph, fused_weights, united
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.testing.strategies import seeds, threats

FUSIONS: tuple[Fusion, ...] = get_args(Fusion)
INTEGRALS: tuple[Integral, ...] = get_args(Integral)
TOLERANCE = 1e-9

Fields: TypeAlias = list[RiskField]
#: Risk of one segment under one reading.
Risk: TypeAlias = Callable[[Fields, Segment, Fusion], float]


@st.composite
def knowledge(draw: st.DrawFn, min_fields: int = 1, max_fields: int = 4) -> Fields:
    """Draw what each UAV knows: some of the same few threats, some of them twice."""
    pool = draw(st.lists(threats(), min_size=1, max_size=6))
    some = st.lists(st.sampled_from(pool), max_size=6).map(RiskField)
    return draw(st.lists(some, min_size=min_fields, max_size=max_fields))


@st.composite
def cases(draw: st.DrawFn, min_fields: int = 1) -> tuple[Fields, Segment]:
    fields = draw(knowledge(min_fields))
    start, end = draw(segments(united(tuple(fields))))
    # of a segment of 1000 units, 1e-9 is not asked
    assume(math.dist(start, end) <= 2.0)
    return fields, (start, end)


def members(fields: Fields) -> list[tuple[Threat, ...]]:
    return [field.threats for field in fields]


def risk(fields: Fields, segment: Segment, how: Fusion, *, integral: Integral = "exact", samples: int = 50) -> float:
    start, end = segment
    # a large k keeps the length from rounding the risk away
    weight = fused_weights([start], [end], fields, 1e3, fusion=how, integral=integral, samples=samples)[0]
    return float(weight - math.dist(start, end)) / 1e3


def scattered(rng: np.random.Generator, n: int) -> RiskField:
    """Return threats as on the paper's maps."""
    return RiskField([Threat(*rng.random(2).tolist(), spread=s) for s in rng.uniform(0.025, 0.065, n).tolist()])


# The integral of the largest field against quad


def check_quad(fields: Fields, segment: Segment, of: Risk = risk) -> None:
    assert abs(of(fields, segment, "integral_max") - largest_integral(members(fields), *segment)) <= TOLERANCE


@usual
@given(cases(min_fields=2))
def test_integral_of_the_largest_equals_quad(case: tuple[Fields, Segment]) -> None:
    check_quad(*case)


@usual
@given(seeds, st.integers(2, 5), st.integers(1, 8))
def test_integral_of_the_largest_equals_quad_on_maps(seed: int, n_fields: int, n_threats: int) -> None:
    rng = np.random.default_rng(seed)
    fields = [scattered(rng, n_threats) for _ in range(n_fields)]
    start, end = rng.random((2, 2))
    check_quad(fields, (start, end))


@few
@given(seeds, st.sampled_from([1e-2, 1e-4, 1e-6, 1e-8, 1e-10, 1e-13]))
def test_fields_that_hardly_differ(seed: int, shift: float) -> None:
    # two UAVs have seen the same threats, each with a small error of its own
    rng = np.random.default_rng(seed)
    one, errors = scattered(rng, 6), shift * rng.normal(size=(6, 2))
    moved = [Threat(t.x + dx, t.y + dy, t.spread) for t, (dx, dy) in zip(one.threats, errors, strict=True)]
    start, end = rng.random((2, 2))
    check_quad([one, RiskField(moved)], (start, end))


@pytest.mark.parametrize("excess", [0.0, 1e-3, -1e-3, 1e-6, -1e-6, 1e-9, -1e-9, 1e-12])
def test_fields_that_touch(excess: float) -> None:
    # a narrow bump under a wide one of nearly the same height: the fields touch, or cross twice close together
    fields = [RiskField([Threat(0.5, 0.5, 0.1, peak=0.8)]), RiskField([Threat(0.5, 0.5, 0.05, peak=0.8 + excess)])]
    for segment in [((0.0, 0.5), (1.0, 0.5)), ((0.1, 0.3), (0.83, 0.66))]:
        check_quad(fields, (np.array(segment[0]), np.array(segment[1])))


def test_fields_that_cross_many_times() -> None:
    combs = [RiskField([Threat(x, 0.5, spread=0.01) for x in np.arange(a, 0.5, 0.12)]) for a in (0.04, 0.08)]
    check_quad(combs, (np.array([0.0, 0.49]), np.array([0.5, 0.51])))


@usual
@given(seeds)
def test_legendre_series_equal_those_of_numpy(seed: int) -> None:
    rng = np.random.default_rng(seed)
    series, slope = rng.normal(size=envelope_kernels.N_NODES), np.empty(envelope_kernels.N_NODES)
    envelope_kernels._differentiate(series, slope)
    np.testing.assert_allclose(slope, [*np.polynomial.legendre.legder(series), 0.0], rtol=0.0, atol=1e-11)
    x = rng.uniform(-1.0, 1.0)
    assert abs(envelope_kernels._polynomial(series, x) - np.polynomial.legendre.legval(x, series)) <= 1e-12


@pytest.mark.parametrize(
    "broken",
    [
        lambda fields, segment, _: risk(fields, segment, "max_integral"),
        lambda fields, segment, _: risk(fields, segment, "union"),
        lambda fields, segment, _: risk(fields, segment, "integral_max", integral="raster", samples=5000),
    ],
    ids=["max_integral", "union", "raster"],
)
def test_another_integral_would_be_seen(broken: Risk) -> None:
    fields = [RiskField([Threat(0.4, 0.5, spread=0.1)]), RiskField([Threat(0.6, 0.5, spread=0.1)])]
    segment = np.array([0.0, 0.5]), np.array([0.5, 0.5])
    check_quad(fields, segment)
    with pytest.raises(AssertionError):
        check_quad([RiskField(fields[0].threats), fields[1]], (segment[0], np.array([0.9, 0.5])), broken)


# Laws of the four readings


@usual
@given(cases())
def test_max_integral_and_union_equal_quad(case: tuple[Fields, Segment]) -> None:
    """The largest of the fields' integrals, and that of one field of all threats."""
    fields, segment = case
    known = members(fields)
    largest = max(line_integral(threats, *segment) for threats in known)
    assert abs(risk(fields, segment, "max_integral") - largest) <= TOLERANCE
    every = {threat for threats in known for threat in threats}
    most = [threat for threat in every for _ in range(max(threats.count(threat) for threats in known))]
    assert abs(risk(fields, segment, "union") - line_integral(most, *segment)) <= TOLERANCE


@usual
@given(cases())
def test_of_one_field_all_readings_are_equal(case: tuple[Fields, Segment]) -> None:
    fields, (start, end) = case
    exact = CostModel(fields[0], 7.0).weights([start], [end])
    rastered = fused_weights([start], [end], fields[:1], 7.0, integral="raster")
    for how in FUSIONS:
        assert fused_weights([start], [end], fields[:1], 7.0, fusion=how) == exact
        assert fused_weights([start], [end], fields[:1], 7.0, fusion=how, integral="raster") == rastered


@usual
@given(cases(), st.sampled_from(INTEGRALS), st.data())
def test_what_others_know_already_changes_nothing(
    case: tuple[Fields, Segment], integral: Integral, data: st.DataObject
) -> None:
    fields, segment = case
    twin = data.draw(st.sampled_from(fields))
    kept = data.draw(st.lists(st.booleans(), min_size=len(twin), max_size=len(twin)))
    part = RiskField([threat for threat, keep in zip(twin.threats, kept, strict=True) if keep])
    more = data.draw(st.permutations([*fields, twin, part]))
    for how in FUSIONS:
        few, many = (risk(known, segment, how, integral=integral) for known in (fields, more))
        assert abs(few - many) <= TOLERANCE


def test_max_integral_does_not_add_up() -> None:
    # claim C7 fails for Eq. 5 to the letter: half of each of two threats is worth one, both halves are worth two
    fields = [RiskField([Threat(x, 0.5, spread=0.05)]) for x in (0.25, 0.75)]
    start, middle, end = (np.array([x, 0.5]) for x in (0.0, 0.5, 1.0))
    direct = risk(fields, (start, end), "max_integral")
    parts = risk(fields, (start, middle), "max_integral") + risk(fields, (middle, end), "max_integral")
    assert direct == pytest.approx(0.05 * math.sqrt(2.0 * math.pi), rel=1e-5)
    assert parts == pytest.approx(2.0 * direct, rel=1e-5)


@usual
@given(cases(), st.sampled_from([1e-3, 1e3]))
def test_readings_scale_with_the_map(case: tuple[Fields, Segment], scale: float) -> None:
    fields, (start, end) = case
    scaled = [
        RiskField([Threat(scale * t.x, scale * t.y, scale * t.spread, t.peak) for t in known])
        for known in members(fields)
    ]
    for how in FUSIONS:
        found = risk(scaled, (scale * start, scale * end), how)
        assert abs(found / scale - risk(fields, (start, end), how)) <= 2.0 * TOLERANCE


# The riskiest field


@usual
@given(knowledge(), seeds)
def test_riskiest_is_the_field_of_the_largest_total(fields: Fields, seed: int) -> None:
    starts, ends = np.random.default_rng(seed).random((2, 30, 2))
    totals = [float(field.line_integral(starts, ends).sum()) for field in fields]
    found = fused_weights(starts, ends, fields, 5.0, fusion="riskiest")
    best = [field for field, total in zip(fields, totals, strict=True) if total >= max(totals) - 1e-12]
    assert any(np.array_equal(found, CostModel(field, 5.0).weights(starts, ends)) for field in best)


def test_of_equal_totals_the_first_counts() -> None:
    fields = [RiskField([Threat(0.5, y, spread=0.1)]) for y in (0.25, 0.75)]
    starts, ends = np.array([[0.0, 0.25], [0.0, 0.75]]), np.array([[1.0, 0.25], [1.0, 0.75]])
    low, high = fused_weights(starts, ends, fields, 1.0, fusion="riskiest")
    assert low > high
    low, high = fused_weights(starts, ends, fields[::-1], 1.0, fusion="riskiest")
    assert low < high


def test_what_crosses_does_not_count_for_the_total() -> None:
    fields = [RiskField([Threat(0.5, 0.25, spread=0.1)]), RiskField([Threat(0.5, 0.75, spread=0.05)])]
    starts, ends = np.array([[0.0, 0.25], [0.0, 0.75]]), np.array([[1.0, 0.25], [1.0, 0.75]])
    wall = shapely.box(0.4, 0.2, 0.6, 0.3)
    free = fused_weights(starts, ends, fields, 1.0, fusion="riskiest")
    walled = fused_weights(starts, ends, fields, 1.0, wall, fusion="riskiest")
    assert free[0] > 1.1
    assert free[1] < 1.1
    assert walled[0] == np.inf
    assert walled[1] > 1.1


# The raster integral


def check_raster(fields: Fields, segment: Segment, samples: int, of: Callable[..., float] = risk) -> None:
    there = of(fields, segment, "integral_max", integral="raster", samples=samples)
    assert abs(there - raster(members(fields), *segment, samples)) <= TOLERANCE


@usual
@given(cases(), st.integers(1, 60))
def test_raster_equals_numpy(case: tuple[Fields, Segment], samples: int) -> None:
    fields, segment = case
    check_raster(fields, segment, samples)
    check_raster(fields, segment[::-1], samples)
    sums = [raster([known], *segment, samples) for known in members(fields)]
    settings: dict[str, Any] = {"integral": "raster", "samples": samples}
    assert abs(risk(fields, segment, "max_integral", **settings) - max(sums)) <= TOLERANCE
    assert abs(risk(fields, segment, "riskiest", **settings) - max(sums)) <= TOLERANCE
    union = raster([united(tuple(fields)).threats], *segment, samples)
    assert abs(risk(fields, segment, "union", **settings) - union) <= TOLERANCE


def test_the_near_ends_would_be_seen() -> None:
    fields, segment = [RiskField([Threat(0.3, 0.5, spread=0.1)])], (np.array([0.3, 0.5]), np.array([0.9, 0.5]))
    check_raster(fields, segment, 50)
    with pytest.raises(AssertionError):
        check_raster(fields, segment, 50, lambda known, where, *how, **more: risk(known, where[::-1], *how, **more))


@pytest.mark.parametrize("how", FUSIONS)
def test_raster_converges_with_first_order(how: Fusion) -> None:
    fields = [RiskField([Threat(0.3, 0.45, spread=0.1)]), RiskField([Threat(0.55, 0.5, spread=0.12)])]
    segment = np.array([0.1, 0.5]), np.array([0.6, 0.4])
    exact = risk(fields, segment, how)
    errors = [
        abs(risk(fields, segment, how, integral="raster", samples=samples) - exact)
        for samples in (100, 200, 400, 800, 1600)
    ]
    assert rate(errors) == pytest.approx(1.0, abs=0.02)


# Graphs


def all_pairs(
    positions: FloatArray, fields: Fields, no_fly: shapely.Polygon | None, settings: dict[str, Any]
) -> FloatArray:
    """Weigh all pairs of nodes with `fused_weights`."""
    n = len(positions)
    starts, ends = np.repeat(positions, n, axis=0), np.tile(positions, (n, 1))
    weights = fused_weights(starts, ends, fields, 10.0, no_fly, **settings).reshape(n, n)
    np.fill_diagonal(weights, 0.0)
    return weights


@usual
@given(
    how=st.sampled_from(FUSIONS),
    integral=st.sampled_from(INTEGRALS),
    fields=knowledge(),
    extra=off_lattice_points(),
    walled=st.booleans(),
)
def test_graph_has_the_weights_of_its_segments(
    how: Fusion, integral: Integral, fields: Fields, extra: list[Point], *, walled: bool
) -> None:
    no_fly = shapely.box(0.3, 0.2, 0.6, 0.7) if walled else None
    lattice = Lattice((4, 3), bounds=(0, 0, 1, 1))
    settings: dict[str, Any] = {"fusion": how, "integral": integral, "samples": 7}
    graph = fused_graph(lattice, fields, 10.0, no_fly, extra=extra, **settings)
    plain = GeometricGraph.complete(lattice, RiskField(), no_fly=no_fly, extra=extra)
    assert graph.positions is not None
    assert plain.positions is not None
    np.testing.assert_array_equal(graph.positions, plain.positions)
    assert graph.lattice == lattice
    found = graph.weight_matrix()
    np.testing.assert_array_equal(np.isinf(found), np.isinf(plain.weight_matrix()))
    np.testing.assert_array_equal(np.diag(found), 0.0)
    assert (found >= plain.weight_matrix() - 1e-12).all()
    # of fields with nearly the same total, rounding may choose another
    may_be = [[field] for field in fields] if how == "riskiest" else [fields]
    expected = [all_pairs(graph.positions, one, no_fly, settings) for one in may_be]
    assert any(np.allclose(found, matrix, rtol=0.0, atol=1e-8) for matrix in expected)
    assert graph.directed == (not np.array_equal(found, found.T))
    assert integral == "raster" or not graph.directed


@few
@given(knowledge(), off_lattice_points())
def test_union_is_the_complete_graph(fields: Fields, extra: list[Point]) -> None:
    lattice = Lattice(4, bounds=(0, 0, 1, 1))
    graph = fused_graph(lattice, fields, 10.0, extra=extra)
    assert graph.is_implicit
    assert graph.model == CostModel(united(tuple(fields)), 10.0)
    complete = GeometricGraph.complete(lattice, united(tuple(fields)), 10.0, extra=extra)
    np.testing.assert_array_equal(graph.weight_matrix(), complete.weight_matrix())


@pytest.mark.parametrize("how", FUSIONS)
def test_points_of_any_kind_make_a_graph(how: Fusion) -> None:
    places = np.random.default_rng(1).random((5, 2))
    fields = [RiskField([Threat(x, 0.5, spread=0.2)]) for x in (0.3, 0.7)]
    graph = fused_graph(places, fields, 10.0, fusion=how)
    assert graph.lattice is None
    np.testing.assert_array_equal(graph.weight_matrix(), all_pairs(places, fields, None, {"fusion": how}))


@pytest.mark.slow
@pytest.mark.parametrize("how", FUSIONS)
@pytest.mark.parametrize("integral", INTEGRALS)
def test_threads_change_nothing(how: Fusion, integral: Integral, monkeypatch: pytest.MonkeyPatch) -> None:
    rng = np.random.default_rng(2)
    fields = [scattered(rng, 4) for _ in range(3)]
    lattice = Lattice(15, bounds=(0, 0, 1, 1))
    starts, ends = rng.random((2, THREADED_FROM + 1, 2))
    settings: dict[str, Any] = {"fusion": how, "integral": integral, "samples": 5}
    assert lattice.n_points > THREADED_FROM
    monkeypatch.setattr(_threads, "n_cores", lambda: 3)
    threaded = fused_graph(lattice, fields, 10.0, **settings), fused_weights(starts, ends, fields, 10.0, **settings)
    monkeypatch.setattr(_threads, "n_cores", lambda: 1)
    alone = fused_graph(lattice, fields, 10.0, **settings), fused_weights(starts, ends, fields, 10.0, **settings)
    np.testing.assert_array_equal(threaded[0].weight_matrix(), alone[0].weight_matrix())
    np.testing.assert_array_equal(threaded[1], alone[1])


# What is given


@pytest.mark.parametrize("integral", INTEGRALS)
@pytest.mark.parametrize("how", FUSIONS)
def test_no_fields_and_no_weight_are_no_risk(how: Fusion, integral: Integral) -> None:
    lattice = Lattice(3, bounds=(0, 0, 1, 1))
    lengths = GeometricGraph.complete(lattice).weight_matrix()
    known = [RiskField([Threat(0.5, 0.5, spread=0.1)]), RiskField()]
    for fields, k in (([], 10.0), ([RiskField()], 10.0), ([RiskField(), RiskField()], 10.0), (known, 0.0)):
        graph = fused_graph(lattice, fields, k, fusion=how, integral=integral)
        np.testing.assert_array_equal(graph.weight_matrix(), lengths)
    assert fused_weights(np.empty((0, 2)), np.empty((0, 2)), known, 10.0, fusion=how, integral=integral).shape == (0,)


@few
@given(st.sampled_from(FUSIONS), st.sampled_from(INTEGRALS), cases())
def test_inputs_stay_as_they_are(how: Fusion, integral: Integral, case: tuple[Fields, Segment]) -> None:
    fields, segment = case
    places, tables = np.array(segment), [field.table.copy() for field in fields]
    fused_weights(places[:1], places[1:], fields, 10.0, fusion=how, integral=integral)
    fused_graph(places, fields, 10.0, fusion=how, integral=integral)
    np.testing.assert_array_equal(places, segment)
    for field, table in zip(fields, tables, strict=True):
        np.testing.assert_array_equal(field.table, table)


@fast
@given(knowledge())
@example([RiskField(), RiskField()])
def test_united_field_has_each_threat_as_often_as_any_uav(fields: Fields) -> None:
    union = united(tuple(fields))
    for threat in {*union.threats, *(t for known in members(fields) for t in known)}:
        assert union.threats.count(threat) == max(known.count(threat) for known in members(fields))


def test_united_field_is_the_one_that_has_all() -> None:
    a, b = Threat(0.2, 0.5, spread=0.1), Threat(0.8, 0.5, spread=0.1)
    whole = RiskField([b, a, b])
    assert united((RiskField([a]), whole, RiskField([b, b]))) is whole


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"fusion": "sum"}, "unknown fusion 'sum'; choose one of union, max_integral, integral_max, riskiest"),
        ({"integral": "simpson"}, "unknown integral 'simpson'; choose one of exact, raster"),
        *(({"samples": odd}, f"samples is {odd}") for odd in (0, 2.5, True)),
        ({"k": -1.0}, "k is -1"),
        ({"fields": RiskField()}, "give a list with the RiskField of each UAV"),
        ({"fields": [RiskField(), 3]}, "field 1 is 3"),
        ({"no_fly": "wall"}, "a no-fly area is a shapely geometry, not str"),
        *(({"fields": "improper", "fusion": how}, "field 1 has a peak above 1") for how in FUSIONS),
    ],
)
def test_malformed_settings_are_refused(change: dict[str, Any], said: str) -> None:
    with pytest.warns(ImproperFieldWarning):
        improper = RiskField([Threat(0.5, 0.5, spread=0.1, peak=2.0)], improper=True)
    settings = {"fields": [RiskField()], "k": 1.0, **change}
    settings["fields"] = [RiskField(), improper] if change.get("fields") == "improper" else settings["fields"]
    with pytest.raises(ProblemError, match=said):
        fused_weights([(0.0, 0.0)], [(1.0, 1.0)], **settings)
    with pytest.raises(ProblemError, match=said):
        fused_graph([(0.0, 0.0), (1.0, 1.0)], **settings)


@pytest.mark.parametrize(
    ("ask", "places", "said"),
    [
        (fused_weights, ([(0, 0)], [(1, 1), (2, 2)]), r"starts have shape \(1, 2\), ends \(2, 2\)"),
        (fused_weights, ([(0, np.nan)], [(1, 1)]), "finite"),
        (fused_graph, ([0.0, 1.0],), "shape"),
    ],
)
def test_malformed_points_are_refused(ask: Callable[..., object], places: tuple[Any, ...], said: str) -> None:
    with pytest.raises(ProblemError, match=said):
        ask(*places, [RiskField()], fusion="integral_max")


@pytest.mark.parametrize("integral", ["exact", "raster"])
@pytest.mark.parametrize("fusion", ["union", "max_integral", "integral_max", "riskiest"])
def test_weak_threats_are_fused_as_strong_ones_are(fusion: Fusion, integral: Integral) -> None:
    """Of threats too weak for their overlap to count, a million times weaker ones cost the same."""

    def weights(scale: float) -> FloatArray:
        one = RiskField([Threat(0.3, 0.5, 0.1, 0.9 * scale), Threat(0.7, 0.4, 0.2, 0.5 * scale)])
        two = RiskField([Threat(0.5, 0.5, 0.1, 0.7 * scale)])
        lattice = Lattice(5, bounds=(0, 0, 1, 1))
        return fused_graph(lattice, [one, two], 1.0 / scale, fusion=fusion, integral=integral).weight_matrix()

    assert weights(1e-18) == pytest.approx(weights(1e-12), rel=1e-9)
