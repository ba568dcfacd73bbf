"""Paired comparisons: against scipy, the enumeration of all signs, closed testing, and published examples."""

import itertools
import math
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
import pytest
import scipy.stats
from all_pairs import all_pairs
from hypothesis import given
from hypothesis import strategies as st
from strategies import costs, usual

from cgla_graph.comparisons.statistics.paired import (
    SignedRank,
    against,
    compare_costs,
    cost_table,
    holm,
    log_ratios,
    mcnemar,
    same_cost,
    signed_rank,
)
from cgla_graph.comparisons.statistics.ranking import ranking

whole = st.integers(-4, 4).map(float)
probabilities = st.floats(0.0, 1.0)

# Area under the curve of C4.5 and of C4.5 with tuned m on 14 data sets: Demsar, JMLR 7, 2006, table 2.
PLAIN = (0.763, 0.599, 0.954, 0.628, 0.882, 0.936, 0.661, 0.583, 0.775, 1.000, 0.940, 0.619, 0.972, 0.957)
TUNED = (0.768, 0.591, 0.971, 0.661, 0.888, 0.931, 0.668, 0.583, 0.838, 1.000, 0.962, 0.666, 0.981, 0.978)


@st.composite
def tables(draw: st.DrawFn, min_solvers: int = 2) -> dict[str, list[float]]:
    n = draw(st.integers(1, 10))
    k = draw(st.integers(min_solvers, 5))
    return {f"s{i}": draw(st.lists(costs, min_size=n, max_size=n)) for i in range(k)}


# Holm


def by_closed_testing(p_values: Sequence[float]) -> list[float]:
    """Adjust as the definition of closed testing says: the greatest Bonferroni p-value of any set with the test."""
    n = len(p_values)
    sets = [chosen for size in range(1, n + 1) for chosen in itertools.combinations(range(n), size)]
    bonferroni = {chosen: min(1.0, len(chosen) * min(p_values[i] for i in chosen)) for chosen in sets}
    return [max(p for chosen, p in bonferroni.items() if i in chosen) for i in range(n)]


@given(p_values=st.lists(probabilities | st.sampled_from([0.0, 0.01, 0.02, 1.0]), max_size=7))
def test_holm_is_closed_testing_by_bonferroni(p_values: list[float]) -> None:
    assert holm(p_values) == pytest.approx(by_closed_testing(p_values), rel=1e-12)


# Wilcoxon's signed ranks


def by_enumeration(differences: Sequence[float]) -> SignedRank:
    """Count the sign patterns that are as extreme, given the ties and zeros."""
    ranks = scipy.stats.rankdata(np.abs(differences))
    excess = sum(rank * np.sign(value) for rank, value in zip(ranks, differences, strict=True))
    moving = [rank for rank, value in zip(ranks, differences, strict=True) if value]
    sums = [
        sum(s * rank for s, rank in zip(signs, moving, strict=True))
        for signs in itertools.product([1, -1], repeat=len(moving))
    ]
    p = 1.0 if excess == 0 else sum(abs(total) >= abs(excess) for total in sums) / len(sums)
    return SignedRank(p, excess / ranks.sum())


@given(
    differences=st.lists(whole | st.floats(-1.0, 1.0) | st.sampled_from([math.inf, -math.inf]), min_size=1, max_size=10)
)
def test_the_test_is_that_of_all_sign_patterns(differences: list[float]) -> None:
    assert signed_rank(differences) == pytest.approx(by_enumeration(differences), rel=1e-9)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(1, 50))
def test_without_ties_it_is_that_of_scipy(seed: int, n: int) -> None:
    sample = np.random.default_rng(seed).normal(0.2, 1.0, n)
    assert signed_rank(sample.tolist()).p == pytest.approx(float(scipy.stats.wilcoxon(sample).pvalue), rel=1e-9)


@given(seed=st.integers(0, 2**32 - 1), n=st.integers(51, 200), levels=st.sampled_from([3, 30, 3000]))
def test_of_many_it_is_the_approximation_of_scipy(seed: int, n: int, levels: int) -> None:
    rng = np.random.default_rng(seed)
    sample = rng.integers(1, levels, n, endpoint=True) * rng.choice([-1.0, 1.0, 1.0], n)
    expected = scipy.stats.wilcoxon(sample, zero_method="zsplit", method="asymptotic").pvalue
    assert signed_rank(sample.tolist()).p == pytest.approx(float(expected), rel=1e-9)


def test_with_ties_and_zeros_it_is_the_permutation_of_scipy() -> None:
    sample = [0.0, 0.0, 1.0, 1.0, 2.0, -1.0, 3.0, 4.0, 4.0, -2.0]
    method = scipy.stats.PermutationMethod(n_resamples=2**12)
    expected = scipy.stats.wilcoxon(sample, zero_method="zsplit", method=method).pvalue
    assert signed_rank(sample).p == pytest.approx(float(expected), rel=1e-12)


def test_zeros_beyond_what_is_exact_do_not_hide_a_difference() -> None:
    # ten differences that all point the same way are as clear among 90 ties as among 30
    few, many = ([0.0] * n + [float(i) for i in range(1, 11)] for n in (30, 90))
    assert signed_rank(few).p == signed_rank(many).p == 2.0**-9


def test_published_examples() -> None:
    # Demsar, section 3.1.3: the rank sums are 93 and 12 of 105, with the two zeros split
    differences = np.round(np.subtract(TUNED, PLAIN), 6).tolist()
    assert signed_rank(differences).effect == pytest.approx((93 - 12) / 105)
    # Hollander and Wolfe's depression data, as in the manual of R: one-sided p 0.01953
    before = (1.83, 0.50, 1.62, 2.48, 1.68, 1.88, 1.55, 3.06, 1.30)
    after = (0.878, 0.647, 0.598, 2.05, 1.06, 1.29, 1.06, 3.14, 1.29)
    assert signed_rank(np.subtract(before, after).tolist()).p == pytest.approx(2 * 0.01953, abs=1e-5)


def test_nothing_but_zeros_is_no_difference() -> None:
    assert signed_rank([0.0]) == signed_rank([0.0] * 99) == SignedRank(1.0, 0.0)


# Counts


@given(counts=st.tuples(st.integers(0, 40), st.integers(0, 40)))
def test_counts_are_binomial(counts: tuple[int, int]) -> None:
    n = sum(counts)
    tail = sum(math.comb(n, i) for i in range(min(counts) + 1)) / 2**n
    assert mcnemar(*counts) == mcnemar(*counts[::-1]) == pytest.approx(min(1.0, 2.0 * tail), rel=1e-9)


@pytest.mark.parametrize(
    ("test", "arguments", "words"),
    [
        *((holm, ([0.5, p],), "from 0 to 1") for p in (-0.1, 1.1, math.nan)),
        *((signed_rank, (wrong,), "at least one number and no NaN") for wrong in ([], [math.nan])),
        (mcnemar, (3, -1), "counts from 0"),
    ],
)
def test_malformed_numbers_are_refused(test: Callable[..., object], arguments: tuple[Any, ...], words: str) -> None:
    with pytest.raises(ValueError, match=words):
        test(*arguments)


# Tables


def test_a_comparison_by_hand() -> None:
    table = {
        "new": [1.0, 2.0, 3.0, math.inf, math.inf, 5.0, 7.0],
        "old": [2.0, 2.0 * (1 + 1e-12), 1.5, math.inf, 4.0, math.inf, 14.0],
    }
    (one,) = against(table, "old")
    assert (one.solver, one.reference, one.n) == ("new", "old", 7)
    assert (one.wins, one.losses, one.ties) == (3, 2, 2)
    assert (one.only_solver, one.only_reference, one.p_success) == (1, 1, 1.0)
    logs = [-math.log(2.0), 0.0, math.log(2.0), 0.0, math.inf, -math.inf, -math.log(2.0)]
    expected = by_enumeration(np.round(logs, 9).tolist())
    assert (one.p, one.effect) == pytest.approx(expected)
    assert one.p_holm == one.p


@usual
@given(table=tables())
def test_all_pairs_turn_around_with_the_order(table: dict[str, list[float]]) -> None:
    there = all_pairs(table)
    back = {(one.reference, one.solver): one for one in all_pairs(dict(reversed(table.items())))}
    assert len(there) == len(table) * (len(table) - 1) // 2 == len(back)
    for one in there:
        other = back[one.solver, one.reference]
        assert (one.wins, one.losses, one.ties) == (other.losses, other.wins, other.ties)
        assert one.wins + one.losses + one.ties == one.n
        assert (one.only_solver, one.only_reference) == (other.only_reference, other.only_solver)
        assert (one.effect, one.p, one.p_holm) == pytest.approx((-other.effect, other.p, other.p_holm))
        turned = [1.0 / end if end else math.inf for end in (other.ratio.median, other.ratio.high, other.ratio.low)]
        assert one.ratio == pytest.approx(turned, rel=1e-9)


@usual
@given(table=tables(), data=st.data())
def test_units_and_order_of_instances_do_not_matter(table: dict[str, list[float]], data: st.DataObject) -> None:
    n = len(table["s0"])
    units = data.draw(st.lists(st.sampled_from([0.5, 4.0, 1024.0]), min_size=n, max_size=n))
    order = data.draw(st.permutations(range(n)))
    scaled = {name: [units[i] * row[i] for i in order] for name, row in table.items()}
    for one, other in zip(all_pairs(table), all_pairs(scaled), strict=True):
        assert (other.p, other.effect, *other.ratio) == pytest.approx((one.p, one.effect, *one.ratio), rel=1e-9)


@usual
@given(table=tables())
def test_p_values_against_one_solver_are_those_of_all_pairs(table: dict[str, list[float]]) -> None:
    of_all = {frozenset((one.solver, one.reference)): one for one in all_pairs(table)}
    for one in against(table, "s0"):
        assert one.p_holm == pytest.approx(of_all[frozenset((one.solver, "s0"))].p_holm)


@given(table=tables(min_solvers=1))
def test_no_solver_differs_from_itself(table: dict[str, list[float]]) -> None:
    (one,) = against({"twin": table["s0"], "s0": table["s0"]}, "s0")
    assert (one.ties, one.p, one.effect, one.ratio.median, one.p_success) == (one.n, 1.0, 0.0, 1.0, 1.0)


@usual
@given(table=tables(), place=st.integers(0, 9))
def test_a_failure_never_helps(table: dict[str, list[float]], place: int) -> None:
    before = against(table, "s1")[0]
    row = table["s0"]
    failed = [math.inf if i == place % len(row) else cost for i, cost in enumerate(row)]
    after = against({**table, "s0": failed}, "s1")[0]
    assert after.ratio.median >= before.ratio.median
    assert after.wins <= before.wins
    assert after.effect >= before.effect


@pytest.mark.slow
def test_a_winner_by_chance_is_not_said_to_be_better() -> None:
    rng = np.random.default_rng(11)
    wrong = []
    for _ in range(150):
        table = {str(i): np.exp(0.1 * rng.normal(size=24)).tolist() for i in range(8)}
        found = against(table, ranking(table).solvers[0])
        # adjusted for all pairs, and for those of the table alone
        wrong.append((min(one.p_holm for one in found) < 0.05, min(holm([one.p for one in found])) < 0.05))
    careful, careless = np.mean(wrong, axis=0)
    assert careful <= 0.05 + 3 * math.sqrt(0.05 * 0.95 / 150)
    assert careless > 0.1


def test_a_real_difference_is_shown_and_measured() -> None:
    rng = np.random.default_rng(5)
    base = rng.uniform(1.0, 9.0, 40)
    table = {"a": (base * np.exp(0.05 * rng.normal(size=40))).tolist(), "b": (1.1 * base).tolist()}
    (one,) = against(table, "b")
    assert one.p_holm < 1e-4
    assert one.ratio.low < 1.0 / 1.1 < one.ratio.high < 1.0


def test_failures_alone_make_a_difference() -> None:
    (one,) = against({"a": [1.0] * 10, "b": [math.inf] * 10}, "a")
    assert one.ratio == (math.inf, math.inf, math.inf)
    assert (one.p, one.p_success, one.effect) == (2.0**-9, 2.0**-9, 1.0)


def test_one_instance_shows_nothing() -> None:
    (one,) = against({"a": [1.0], "b": [2.0]}, "a")
    assert (one.p, *one.ratio) == pytest.approx((1.0, 2.0, 0.0, math.inf))


def test_no_instances_and_lone_solvers() -> None:
    assert against({"a": [], "b": []}, "a") == against({"a": [1.0]}, "a") == []


def test_costs_without_a_ratio_keep_their_order() -> None:
    logs = log_ratios(np.array([0.0, 0.0, 1.0, -2.0, -1.0]), np.array([0.0, 1.0, 0.0, -1.0, math.inf]))
    np.testing.assert_array_equal(logs, [0.0, -math.inf, math.inf, -math.inf, -math.inf])


def test_ratios_too_great_for_a_number() -> None:
    (one,) = against({"a": [1e300] * 6, "b": [1e-300] * 6}, "b")
    assert one.ratio.median == math.inf
    assert one.wins == 0


def test_equal_up_to_rounding() -> None:
    equal = same_cost(np.array([1.0, -1.0, math.inf, 0.0]), np.array([1 + 9e-10, -1 - 9e-10, math.inf, 0.0]))
    assert equal.all()
    assert not same_cost(np.array([1.0, 1.0, 0.0, 1.0]), np.array([1 + 2e-9, math.inf, 1e-300, -1.0])).any()


@pytest.mark.parametrize(
    ("table", "words"),
    [
        ({"a": [1.0, math.nan]}, r"cost 1 of 'a' is nan; a run without a path costs math.inf"),
        ({"a": [-math.inf]}, "cost 0 of 'a' is -inf"),
        ({"a": [1.0], "b": [1.0, 2.0]}, r"\{'a': 1, 'b': 2\}; give one for each instance"),
    ],
)
def test_tables_of_nonsense(table: dict[str, list[float]], words: str) -> None:
    for use in (cost_table, lambda wrong: against(wrong, "a"), ranking):
        with pytest.raises(ValueError, match=words):
            use(table)


def test_a_reference_that_is_not_there() -> None:
    with pytest.raises(ValueError, match="'c' is not among the solvers"):
        against({"a": [1.0]}, "c")
    with pytest.raises(ValueError, match="for each instance"):
        compare_costs("a", [1.0], "b", [1.0, 2.0])
    with pytest.raises(ValueError, match="for each instance"):
        compare_costs("a", [], "b", [])
