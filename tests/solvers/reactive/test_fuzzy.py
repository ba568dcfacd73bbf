"""Fuzzy inference: hand-computed cases, and a slow literal composition beside the fast one."""

import itertools
import math
from collections.abc import Callable
from fractions import Fraction

import numpy as np
import pytest
import strategies as own
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._types import FloatArray
from cgla_graph.errors import SolverSettingError
from cgla_graph.solvers.reactive.fuzzy import RuleBase, Triangle, about, centroid, membership, possibility, triangles

INF = math.inf
LOW, HIGH = -6, 6


@st.composite
def whole_triangles(draw: st.DrawFn) -> Triangle:
    """Draw triangles with whole corners: vertical sides, single points and shoulders among them."""
    left, peak, right = sorted(draw(st.tuples(*[st.integers(LOW, HIGH)] * 3)))
    shoulder = draw(st.sampled_from(["", "", "left", "right", "both"]))
    return (
        -INF if shoulder in {"left", "both"} else float(left),
        float(peak),
        INF if shoulder in {"right", "both"} else float(right),
    )


def grade(x: Fraction, triangle: Triangle) -> Fraction:
    """Say how far a value belongs to a set, from the definition, without rounding."""
    left, peak, right = triangle
    foot = left if x < peak else right
    if x == peak or math.isinf(foot):
        return Fraction(1)
    if foot == peak:
        return Fraction(0)
    return max(Fraction(0), 1 - (x - Fraction(peak)) / (Fraction(foot) - Fraction(peak)))


def crossings(first: Triangle, second: Triangle) -> set[Fraction]:
    """List every place where the least of two sets may be greatest: corners, and where two sides cross."""
    corners = {Fraction(c) for c in (*first, *second) if math.isfinite(c)}
    spots = set(corners)
    for a, b in itertools.pairwise(sorted(corners | {min(corners) - 1, max(corners) + 1})):
        # between neighbouring corners both grades are straight lines; inner values, as sides may be vertical
        left, right = (2 * a + b) / 3, (a + 2 * b) / 3
        gaps = [grade(x, first) - grade(x, second) for x in (left, right)]
        if gaps[0] != gaps[1]:
            spots.add(left - gaps[0] * (right - left) / (gaps[1] - gaps[0]))
    return spots


def test_grades_of_a_triangle_and_of_shoulders() -> None:
    # (0, 2, 6): up by 1/2 a unit, down by 1/4 a unit
    assert membership([-1, 0, 0.5, 2, 3, 6, 7], [(0, 2, 6)]).tolist() == [[0, 0, 0.25, 1, 0.75, 0, 0]]
    assert membership([-99, 2, 3, 6], [(-INF, 2, 6)]).tolist() == [[1, 1, 0.75, 0]]
    assert membership([0, 1, 2, 99], [(0, 2, INF)]).tolist() == [[0, 0.5, 1, 1]]
    # a single point, and a vertical side: 1 at the peak itself
    assert membership([1, 2, 3], [(2, 2, 2), (2, 2, 4)]).tolist() == [[0, 1, 0], [0, 1, 0.5]]


def test_overlap_of_two_triangles_by_hand() -> None:
    # (0, 1, 3) falls as (3 - x) / 2, (2, 4, 5) rises as (x - 2) / 2: they meet at x = 2.5, at height 1/4
    assert possibility(np.array([0.0, 1, 3]), np.array([2.0, 4, 5])) == 0.25
    # a shoulder to the right covers everything right of its peak
    assert possibility(np.array([0.0, 1, INF]), np.array([2.0, 4, 5])) == 1.0
    # they touch at a foot only
    assert possibility(np.array([0.0, 1, 2]), np.array([2.0, 3, 4])) == 0.0


def test_inference_with_two_rules_and_two_inputs_by_hand() -> None:
    # "if x is low and y is low then z is small; if x is high and y is high then z is large"
    low, high, small, large = (-INF, 0, 10), (0, 10, INF), (-1, 0, 1), (1, 2, 3)
    base = RuleBase([[low, low], [high, high]], [small, large], grid=np.array([-1, -0.5, 0, 0.5, 1, 1.5, 2, 2.5, 3]))
    inputs = about([2, 5], [0, 0])
    # x = 2: low 0.8, high 0.2; y = 5: low 0.5, high 0.5; so the rules fire by min(0.8, 0.5) and min(0.2, 0.5)
    assert base.strengths(inputs).tolist() == pytest.approx([0.5, 0.2])
    # small clipped at 0.5, large at 0.2; at 1 both are 0
    conclusion = [0, 0.5, 0.5, 0.5, 0, 0.2, 0.2, 0.2, 0]
    assert base.conclude(inputs).tolist() == pytest.approx(conclusion)
    # (0.5 (-0.5 + 0 + 0.5) + 0.2 (1.5 + 2 + 2.5)) / (1.5 + 0.6) = 1.2 / 2.1
    assert base.decide(inputs) == pytest.approx(1.2 / 2.1)
    # a rule that holds by 0.3 fires no further than that
    half = RuleBase(base.conditions, base.conclusions, base.grid, weights=[0.3, 1.0])
    assert half.strengths(inputs).tolist() == pytest.approx([0.3, 0.2])


def test_a_blurred_input_by_hand() -> None:
    # "about 12, give or take 4" rises from 8 to 12; (-inf, 0, 10) falls as (10 - x) / 10: (10 - x) / 10 = (x - 8) / 4
    # at x = 60 / 7, at height 1 / 7; the crisp 12 belongs to it not at all
    base = RuleBase([[(-INF, 0, 10)]], [(0, 1, 2)], grid=[0, 1, 2])
    assert base.strengths(about([12], [4])).tolist() == pytest.approx([1 / 7])
    assert base.strengths(about([12], [0])).tolist() == [0.0]


@own.fast
@given(whole_triangles(), whole_triangles())
def test_overlap_equals_the_exact_supremum(first: Triangle, second: Triangle) -> None:
    exact = max(min(grade(x, first), grade(x, second)) for x in crossings(first, second))
    assert possibility(np.array(first), np.array(second)) == pytest.approx(float(exact), abs=1e-15)


@own.fast
@given(whole_triangles(), st.integers(4 * LOW - 4, 4 * HIGH + 4).map(lambda i: i / 4))
def test_grades_follow_the_definition(triangle: Triangle, x: float) -> None:
    assert membership([x], [triangle])[0, 0] == pytest.approx(float(grade(Fraction(x), triangle)), abs=1e-15)


def wide_triangles() -> st.SearchStrategy[Triangle]:
    """Draw triangles with sides at least 1 wide, so that a grid finds heights to half its step."""
    corners = st.tuples(st.integers(LOW, HIGH), st.integers(1, 6), st.integers(1, 6), st.booleans(), st.booleans())
    return corners.map(
        lambda c: (-INF if c[3] else float(c[0] - c[1]), float(c[0]), INF if c[4] else float(c[0] + c[2]))
    )


def literal(
    conditions: list[list[Triangle]],
    conclusions: list[Triangle],
    inputs: list[Triangle],
    xs: FloatArray,
    ys: FloatArray,
) -> list[float]:
    """Compose on a grid, letter by letter: B'(y) = sup_x min(A'(x), R(x, y)), R the union of the rules."""
    composed = []
    for y in ys:
        best = Fraction(0)
        for spot in itertools.product([Fraction(float(x)) for x in xs], repeat=len(inputs)):
            given_ = min(grade(x, one) for x, one in zip(spot, inputs, strict=True))
            if given_ <= best:
                continue
            related = max(
                min(*(grade(x, one) for x, one in zip(spot, rule, strict=True)), grade(Fraction(float(y)), conclusion))
                for rule, conclusion in zip(conditions, conclusions, strict=True)
            )
            best = max(best, min(given_, related))
        composed.append(float(best))
    return composed


def check_composition(
    conditions: list[list[Triangle]],
    conclusions: list[Triangle],
    inputs: list[Triangle],
    xs: FloatArray,
    ys: FloatArray,
) -> None:
    slow = np.array(literal(conditions, conclusions, inputs, xs, ys))
    quick = RuleBase(conditions, conclusions, ys).conclude(np.array(inputs))
    # the grid cannot exceed the supremum, and falls short of it by half a step of a side of slope 1
    assert (slow <= quick + 1e-12).all()
    assert (slow >= quick - (xs[1] - xs[0]) / 2 - 1e-12).all()


@own.few
@given(st.data(), st.integers(1, 3))
def test_one_input_is_composed_as_the_literal_rule_says(data: st.DataObject, rules: int) -> None:
    conditions = [[data.draw(wide_triangles())] for _ in range(rules)]
    conclusions = [data.draw(whole_triangles()) for _ in range(rules)]
    inputs = [data.draw(wide_triangles())]
    xs, ys = np.arange(3 * LOW, 3 * HIGH, 0.25), np.arange(LOW, HIGH + 1.0, 2.0)
    check_composition(conditions, conclusions, inputs, xs, ys)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_two_inputs_are_composed_as_the_literal_rule_says(seed: int) -> None:
    rng = np.random.default_rng(seed)

    def draw() -> Triangle:
        peak, left, right = rng.integers(-3, 4), *rng.integers(1, 4, 2)
        return float(peak - left), float(peak), float(peak + right)

    conditions, conclusions, inputs = [[draw(), draw()] for _ in range(3)], [draw() for _ in range(3)], [draw(), draw()]
    check_composition(conditions, conclusions, inputs, np.arange(-6.0, 6.25, 0.25), np.arange(-4.0, 5.0, 2.0))


@own.usual
@given(st.lists(st.tuples(whole_triangles(), whole_triangles()), min_size=2, max_size=5), whole_triangles())
def test_a_union_of_rules_concludes_the_greater(rules: list[tuple[Triangle, Triangle]], given_: Triangle) -> None:
    grid = np.arange(LOW, HIGH + 1.0)
    inputs = np.array([given_])

    def base(some: list[tuple[Triangle, Triangle]]) -> RuleBase:
        return RuleBase([[condition] for condition, _ in some], [conclusion for _, conclusion in some], grid)

    parts = np.maximum(base(rules[:1]).conclude(inputs), base(rules[1:]).conclude(inputs))
    assert base(rules).conclude(inputs).tolist() == parts.tolist()


def test_centroids_by_hand() -> None:
    # a triangle over -1, 0, 1, 2, 3 with its peak at 1, and the same cut at the left
    grid = np.array([-1.0, 0, 1, 2, 3])
    assert centroid(grid, np.array([0, 0.5, 1, 0.5, 0])) == 1.0
    assert centroid(grid, np.array([0, 0, 1, 0.5, 0])) == pytest.approx(2 / 1.5)


def test_no_rule_no_conclusion() -> None:
    base = RuleBase([[(0, 1, 2)]], [(0, 1, 2)], grid=[0, 1, 2])
    assert base.conclude(about([5], [1])).tolist() == [0, 0, 0]
    with pytest.raises(SolverSettingError, match="no rule fires"):
        base.decide(about([5], [1]))
    empty = RuleBase(np.empty((0, 1, 3)), np.empty((0, 3)), grid=[0, 1])
    assert empty.conclude(about([0], [0])).tolist() == [0, 0]


ONE = (0.0, 1.0, 2.0)
SETS = {"low": ONE}


@pytest.mark.parametrize(
    ("build", "words"),
    [
        (lambda: triangles([ONE, (2, 1, 3)]), r"\[2.0, 1.0, 3.0\] is no triangle"),
        (lambda: triangles((0, math.nan, 1)), "no triangle"),
        (lambda: triangles((-INF, -INF, 0)), "no triangle"),
        (lambda: triangles((math.nan, 0, 1)), "no triangle"),
        (lambda: triangles([1, 2]), "shape"),
        (lambda: about([1], [-1]), "no triangle"),
        (lambda: RuleBase([[ONE]], [ONE, ONE], grid=[0]), "rule base"),
        (lambda: RuleBase([[ONE]], [ONE], grid=[0], weights=[2.0]), "weights"),
        (lambda: RuleBase([[ONE]], [ONE], grid=[0], weights=[math.nan]), "weights"),
        (lambda: RuleBase([[ONE]], [ONE], grid=[0], weights=[0.5, 0.5]), "weights"),
        (lambda: RuleBase.from_table([SETS], SETS, {("high",): "low"}, [0]), "'high'"),
        (lambda: RuleBase.from_table([SETS], SETS, {("low", "low"): "low"}, [0]), "2 conditions"),
    ],
)
def test_malformed_sets_and_rules_are_refused(build: Callable[[], object], words: str) -> None:
    with pytest.raises(SolverSettingError, match=words):
        build()
