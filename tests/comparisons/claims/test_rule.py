"""The rule of statements about flights, on samples of which the truth is known."""

import math
import re
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from cgla_graph.comparisons.claims.claim import Answer
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.rule import ALPHA, RULE, Judged, judged, panel_table, part_name
from cgla_graph.comparisons.claims.statement import Method, Rate, Share, Shift, Statement, Within

RADII, THREATS = (0.1, 0.2, 0.4), (10, 30)
LESS = Statement("less risk", "risk", {"k": 50.0}, {"k": 10.0}, factors=("threats", "radius"))
#: An effect on the logarithm of the risk of K = 50, by the number of threats and the radius.
Effect = Callable[[int, float], float]


def drawn(
    effect: Effect, *, maps: int = 40, seed: int = 1, noise: float = 1.0, lost: float = 0.0
) -> list[dict[str, Any]]:
    """Draw records in which K = 50 has the risk of K = 10 times the exponential of an effect and of noise."""
    rng = np.random.default_rng(seed)
    records = []
    for threats, number in product(THREATS, range(maps)):
        for radius in RADII:
            base, more = rng.uniform(0.5, 2.0), math.exp(effect(threats, radius) + noise * rng.normal())
            case = {"map": 1000 * threats + number, "threats": threats, "radius": radius}
            gone = rng.random() < lost
            records += [{**case, "k": 10.0, "risk": base}, {**case, "k": 50.0, "risk": None if gone else base * more}]
    return records


def found(effect: Effect, **settings: Any) -> Judged:  # noqa: ANN401 - as of `drawn`
    """Judge the statement that K = 50 has less risk on drawn records."""
    return judged(Samples(drawn(effect, **settings)), LESS)


FEW = "too few maps to say"
CASES: list[tuple[Effect, dict[str, Any], Answer, str]] = [
    (lambda *_: -1.0, {}, Answer.HOLDS, "^$"),
    (lambda *_: 1.0, {}, Answer.FAILS, "^$"),
    (lambda *_: 0.0, {}, Answer.OPEN, "^$"),
    # it turns round
    (lambda *of: 1.5 if of == (30, 0.1) else -1.0, {}, Answer.DEPENDS, "^holds.*fails at 30 threats, OR 0.1"),
    # at some levels
    (lambda _, radius: 0.0 if radius == 0.4 else -1.5, {}, Answer.DEPENDS, "^holds, but open at OR 0.4$"),
    (lambda _, radius: 0.0 if radius == 0.4 else 1.5, {}, Answer.DEPENDS, "^fails, but open at OR 0.4$"),
    (
        lambda *of: 2.0 * (of == (10, 0.1)),
        {},
        Answer.DEPENDS,
        "^holds nowhere; fails at 10 threats; at OR 0.1; open at",
    ),
    # what a quick study says has to be true of the full one
    (lambda *_: -3.0, {"maps": 5, "noise": 0.1}, Answer.OPEN, FEW),
    (lambda *_: 3.0, {"maps": 5, "noise": 0.1}, Answer.OPEN, FEW),
    # flights that do not arrive are no good case
    (lambda *_: -2.0, {"lost": 0.8}, Answer.DEPENDS, "too few flights arrive"),
]


@pytest.mark.parametrize(("effect", "settings", "answer", "where"), CASES)
def test_the_rule_finds_what_is_true_of_a_sample_and_says_where(
    effect: Effect, settings: dict[str, Any], answer: Answer, where: str
) -> None:
    one = found(effect, **settings)
    assert one.answer is answer
    assert re.search(where, one.where)


def test_a_single_small_p_value_among_many_parts_shows_nothing() -> None:
    """Holm's adjustment: without it, about every second null sample of 11 parts would depend on something."""
    answers = [found(lambda *_: 0.0, seed=seed).answer for seed in range(100)]
    wrong = sum(answer is not Answer.OPEN for answer in answers)
    assert stats.binomtest(wrong, len(answers), ALPHA, alternative="greater").pvalue > 1e-3
    smallest = [min(sign.p for sign in found(lambda *_: 0.0, seed=seed).tests.values()) for seed in range(50)]
    assert sum(p < ALPHA for p in smallest) > 10


def test_a_map_counts_once_where_cells_are_pooled() -> None:
    """Cells that repeat each other add no evidence."""
    rng = np.random.default_rng(3)
    risks = [(rng.uniform(1, 2), rng.uniform(1, 2)) for _ in range(30)]
    records = [
        {"map": number, "threats": 10, "radius": radius, "k": k, "risk": risk}
        for number, pair in enumerate(risks)
        for radius in RADII
        for k, risk in zip((10.0, 50.0), pair, strict=True)
    ]
    one = judged(Samples(records), LESS)
    assert {sign.n for sign in one.tests.values()} == {30}
    assert len({round(sign.p, 12) for sign in one.tests.values()}) == 1


def test_varied_settings_have_to_show_it_too_but_not_those_of_another_planner() -> None:
    records = drawn(lambda *_: -1.0)
    null = [{**one, "varied": "integral raster"} for one in drawn(lambda *_: 0.0, seed=2) if one["radius"] == RADII[0]]
    one = judged(Samples(records + null), LESS)
    assert (one.answer, one.where) == (Answer.DEPENDS, "holds, but open at integral raster")
    others = [{**one, "varied": "a2d-style, threshold 0.01"} for one in records if one["k"] == 50.0]
    assert judged(Samples(records + others), LESS).answer is Answer.HOLDS
    with pytest.raises(ValueError, match="several records of map"):
        judged(Samples([*records, records[0]]), LESS)


def test_the_printed_rule_is_the_one_that_judges() -> None:
    assert f"{ALPHA:g}" in RULE
    table = panel_table("levels", [found(lambda *_: -1.0)])
    assert [row[1] for row in table.rows] == ["10 threats", "30 threats", "OR 0.1", "OR 0.2", "OR 0.4"]


SCORES = st.lists(st.floats(-1.0, 1.0).filter(lambda x: abs(x) > 1e-3), min_size=1, max_size=60)


@given(SCORES)
def test_shifts_are_tested_as_scipy_does(scores: list[float]) -> None:
    if len({abs(one) for one in scores}) < len(scores):
        return
    sign = Shift().tested(np.array(scores))
    method = "exact" if len(scores) <= 50 else "approx"
    assert sign.p == pytest.approx(stats.wilcoxon(scores, method=method, correction=False).pvalue, rel=0.05)


@given(st.lists(st.booleans(), min_size=1, max_size=80), st.floats(0.05, 0.95))
def test_shares_are_tested_as_scipy_does(happened: list[bool], bar: float) -> None:
    sign = Share(bar).tested(np.array(happened, dtype=np.float64))
    sides = [stats.binomtest(sum(happened), len(happened), bar, alternative=one).pvalue for one in ("greater", "less")]
    rate = sum(happened) / len(happened)
    assert sign.p == (1.0 if rate == bar else pytest.approx(sides[0] if rate > bar else sides[1]))
    assert sign.direction == np.sign(rate - bar)


@given(st.lists(st.sampled_from([-1.0, 0.0, 1.0]), min_size=1, max_size=60))
def test_rates_are_tested_by_sign(scores: list[float]) -> None:
    more, less = scores.count(1.0), scores.count(-1.0)
    expected = stats.binomtest(more, more + less).pvalue if more + less else 1.0
    assert Rate().tested(np.array(scores)).p == pytest.approx(expected)


@pytest.mark.parametrize(("shift", "expected"), [(0.0, 1), (0.08, 1), (0.5, -1), (-0.5, -1)])
def test_what_is_within_a_margin_is_told_from_what_is_beyond(shift: float, expected: int) -> None:
    scores = shift + 0.02 * np.random.default_rng(1).normal(size=40)
    sign = Within(0.1).tested(scores)
    assert sign.direction == expected
    assert sign.p < ALPHA


@pytest.mark.parametrize("method", [Shift(), Shift(ratio=False), Rate(), Share(0.5), Within(0.1)])
def test_nothing_shows_nothing(method: Method) -> None:
    sign = method.tested(np.empty(0))
    assert (sign.p, sign.direction, sign.n) == (1.0, 0, 0)


def test_sizes_are_written_as_the_statement_says() -> None:
    records = [
        {"map": number, "radius": radius, "k": k, "risk": {10.0: 2.0, 50.0: 1.5 if radius == RADII[0] else 1.0}[k]}
        for number in range(20)
        for radius in RADII
        for k in (10.0, 50.0)
    ]
    sizes = {"{} % less": "50 (25 to 50) % less", "{} % more": "-50 (-50 to -25)", "x {}": "x 0.5 (0.5 to 0.75)"}
    for size, words in sizes.items():
        one = Statement("less", "risk", {"k": 50.0}, {"k": 10.0}, factors=("radius",), size=size)
        assert judged(Samples(records), one).size.startswith(words)
    assert part_name((("threats", 30), ("k", 10.0), ("varied", ""))) == "30 threats, K = 10"
