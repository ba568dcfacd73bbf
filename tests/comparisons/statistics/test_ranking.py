"""Ranks and significant differences: against scipy, brute force, and the worked example of Demsar's paper."""

import itertools
import math
from collections.abc import Collection, Sequence

import numpy as np
import pytest
import scipy.stats
from all_pairs import all_pairs
from hypothesis import given
from hypothesis import strategies as st
from strategies import costs

from cgla_graph.comparisons.statistics.ranking import (
    Ranking,
    fewest_instances,
    instance_ranks,
    least_p,
    ranking,
    significantly_different,
)

# Area under the curve of four classifiers on 14 data sets: Demsar, JMLR 7, 2006, table 6 (also in scipy's own tests).
AREAS = {
    "C4.5": (0.763, 0.599, 0.954, 0.628, 0.882, 0.936, 0.661, 0.583, 0.775, 1.000, 0.940, 0.619, 0.972, 0.957),
    "C4.5+m": (0.768, 0.591, 0.971, 0.661, 0.888, 0.931, 0.668, 0.583, 0.838, 1.000, 0.962, 0.666, 0.981, 0.978),
    "C4.5+cf": (0.771, 0.590, 0.968, 0.654, 0.886, 0.916, 0.609, 0.563, 0.866, 1.000, 0.965, 0.614, 0.9751, 0.946),
    "C4.5+m+cf": (0.798, 0.569, 0.967, 0.657, 0.898, 0.931, 0.685, 0.625, 0.875, 1.000, 0.962, 0.669, 0.975, 0.970),
}
DEMSAR = {name: [2.0 - area for area in areas] for name, areas in AREAS.items()}


@st.composite
def tables(draw: st.DrawFn, min_solvers: int = 2, min_instances: int = 2) -> dict[str, list[float]]:
    n = draw(st.integers(min_instances, 12))
    k = draw(st.integers(min_solvers, 6))
    return {f"s{i}": draw(st.lists(costs, min_size=n, max_size=n)) for i in range(k)}


def separated(k: int, n: int) -> dict[str, list[float]]:
    """Give every solver its own rank on all instances."""
    return {f"s{i}": [float(i + 1)] * n for i in range(k)}


def test_the_worked_example() -> None:
    found = ranking(DEMSAR)
    ranks = dict(zip(found.solvers, found.average_ranks, strict=True))
    expected = {"C4.5": 3.143, "C4.5+m": 2.000, "C4.5+cf": 2.893, "C4.5+m+cf": 1.964}
    assert ranks == pytest.approx(expected, abs=5e-4)
    assert found.solvers == ("C4.5+m+cf", "C4.5+m", "C4.5+cf", "C4.5")
    # the paper has 9.28 without the correction for ties; with it R, Matlab and scipy agree on this
    assert found.p == pytest.approx(0.0167215803284414)
    n, k = 14, 4
    uncorrected = 12 * n / (k * (k + 1)) * (sum(rank**2 for rank in ranks.values()) - k * (k + 1) ** 2 / 4)
    assert uncorrected == pytest.approx(9.28, abs=5e-3)
    # "the post-hoc test is not powerful enough" to tell any two apart, as the paper says of Nemenyi's; so is this one
    assert found.groups == (found.solvers,)
    assert found.apart_in_rank == ()


@given(table=tables(min_solvers=3))
def test_the_test_is_friedmans(table: dict[str, list[float]]) -> None:
    rows = list(table.values())
    # scipy subtracts nothing, it only ranks; infinity is as good as a great number
    finite = [[min(cost, 1e9) for cost in row] for row in rows]
    found = ranking(table)
    ranked = scipy.stats.rankdata(finite, axis=0)
    if (ranked == ranked[0]).all():
        assert found.p == 1.0
    else:
        assert found.p == pytest.approx(scipy.stats.friedmanchisquare(*finite).pvalue, abs=1e-9)


@given(table=tables(min_solvers=2).filter(lambda table: len(table) == 2))
def test_of_two_solvers_it_counts_wins_and_losses(table: dict[str, list[float]]) -> None:
    first, second = table.values()
    wins = sum(a < b for a, b in zip(first, second, strict=True))
    losses = sum(a > b for a, b in zip(first, second, strict=True))
    expected = (wins - losses) ** 2 / (wins + losses) if wins + losses else 0.0
    assert ranking(table).p == pytest.approx(scipy.stats.chi2.sf(expected, 1), abs=1e-9)


@given(table=tables())
def test_ranks_are_shared_and_add_up(table: dict[str, list[float]]) -> None:
    k = len(table)
    rows = np.array(list(table.values()))
    np.testing.assert_array_equal(instance_ranks(rows), scipy.stats.rankdata(rows, axis=0))
    found = ranking(table)
    assert sum(found.average_ranks) == pytest.approx(k * (k + 1) / 2)
    assert list(found.average_ranks) == sorted(found.average_ranks)


@given(table=tables(), data=st.data())
def test_only_the_order_on_each_instance_counts(table: dict[str, list[float]], data: st.DataObject) -> None:
    n = len(table["s0"])
    powers = data.draw(st.lists(st.sampled_from([0.5, 1.0, 2.0]), min_size=n, max_size=n))
    order = data.draw(st.permutations(range(n)))
    moved = {name: [7.0 * row[i] ** powers[i] for i in order] for name, row in table.items()}
    found, again = ranking(table), ranking(moved)
    assert (again.solvers, again.p) == (found.solvers, found.p)
    assert again.average_ranks == found.average_ranks


@given(table=tables(), data=st.data())
def test_the_order_of_solvers_does_not_matter(table: dict[str, list[float]], data: st.DataObject) -> None:
    names = data.draw(st.permutations(list(table)))
    found, moved = ranking(table), ranking({name: table[name] for name in names})
    assert moved.average_ranks == pytest.approx(found.average_ranks)
    assert dict(zip(moved.solvers, moved.average_ranks, strict=True)) == pytest.approx(
        dict(zip(found.solvers, found.average_ranks, strict=True))
    )
    assert moved.p == pytest.approx(found.p)


def test_costs_that_differ_by_rounding_share_their_rank() -> None:
    ranks = instance_ranks(np.array([[1.0, -1.0], [1.0 + 5e-10, -1.0 - 5e-10], [1.1, math.inf]]))
    assert ranks.tolist() == [[1.5, 1.5], [1.5, 1.5], [3.0, 3.0]]


def pairs_of(names: Sequence[str]) -> set[frozenset[str]]:
    return {frozenset(pair) for pair in itertools.combinations(names, 2)}


def greatest_runs(found: Ranking, apart: Collection[frozenset[str]]) -> set[tuple[str, ...]]:
    """List the greatest runs of two or more without a significant difference between members, by trying all."""
    k = len(found.solvers)
    runs = [found.solvers[first:end] for first in range(k) for end in range(first + 2, k + 1)]
    fine = [run for run in runs if not pairs_of(run) & set(apart)]
    return {one for one in fine if not any(set(one) < set(other) for other in fine)}


@given(seed=st.integers(0, 2**32 - 1), k=st.integers(2, 7), n=st.integers(2, 60))
def test_groups_and_other_pairs_are_those_without_significance(seed: int, k: int, n: int) -> None:
    rng = np.random.default_rng(seed)
    table = {f"s{i}": (1.0 + rng.random(n) + 0.15 * i).tolist() for i in range(k)}
    found, apart = ranking(table), significantly_different(table)
    assert set(found.groups) == greatest_runs(found, apart)
    assert len(found.groups) == len(set(found.groups))
    joined = set().union(*map(pairs_of, found.groups))
    alone = {frozenset(pair) for pair in found.apart_in_rank}
    assert not joined & alone
    assert joined | alone == pairs_of(found.solvers) - apart
    # significant pairs are those of the table of all pairs
    assert apart == {frozenset((one.solver, one.reference)) for one in all_pairs(table) if one.p_holm < 0.05}


@pytest.mark.parametrize("k", [2, 3, 5, 12, 20])
def test_the_fewest_instances_that_can_tell(k: int) -> None:
    fewest = fewest_instances(k)
    names = tuple(separated(k, 1))
    assert ranking(separated(k, fewest)).groups != (names,)
    assert ranking(separated(k, fewest - 1)).groups == (names,)
    for n in (fewest - 1, fewest):
        assert min(one.p_holm for one in all_pairs(separated(k, n))) == pytest.approx(least_p(n, k))


def test_failures_count_as_last_and_alike() -> None:
    found = ranking({"a": [1.0] * 4, "b": [math.inf] * 4, "c": [math.inf, math.inf, 9.0, 9.0]})
    assert dict(zip(found.solvers, found.average_ranks, strict=True)) == {"a": 1.0, "b": 2.75, "c": 2.25}
    found = ranking({"a": [math.inf] * 9, "b": [math.inf] * 9})
    assert (found.average_ranks, found.p, found.groups) == ((1.5, 1.5), 1.0, (("a", "b"),))


@pytest.mark.parametrize("table", [{}, {"a": []}, {"a": [], "b": []}, {"a": [1.0, 2.0]}, {"a": [1.0], "b": [2.0]}])
def test_too_little_to_say_anything(table: dict[str, Sequence[float]]) -> None:
    found = ranking(table)
    assert (found.p, found.groups, found.apart_in_rank) == (None, (), ())
    assert found.solvers == tuple(table)
    assert all(math.isnan(rank) for rank in found.average_ranks) == (found.n_instances == 0)
