"""Verdicts of samples: at the level that they promise, in both directions, and undecided where nothing can be shown."""

from contextvars import copy_context

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph.comparisons.claims.claim import Verdict
from cgla_graph.comparisons.claims.contrasts import (
    ALPHA,
    CELLS,
    LEVEL,
    MAIN,
    QUICK_ALPHA,
    Contrast,
    beyond,
    cell_name,
    contrast_part,
    fewest_pairs,
    holds,
    judged,
    rate_contrast,
    share_part,
    shares,
    shown,
    split,
)
from cgla_graph.comparisons.claims.inference import paired_shift
from cgla_graph.comparisons.statistics.intervals import Estimate

#: Worlds of each kind that are drawn.
WORLDS = 200


def _contrasts(rng: np.random.Generator, means: list[float], maps: int = 60) -> list[Contrast]:
    """Draw one sample of differences for each mean, as flights in different cells: the same maps, so dependent."""
    common = rng.normal(size=maps)
    return [
        Contrast(
            "first > second", {"cell": n}, paired_shift(mean + common + 0.5 * rng.normal(size=maps), np.zeros(maps))
        )
        for n, mean in enumerate(means)
    ]


def _verdicts(means: list[float], seed: int) -> dict[Verdict, float]:
    rng = np.random.default_rng(seed)
    found = [judged(_contrasts(rng, means)) for _ in range(WORLDS)]
    return {verdict: found.count(verdict) / WORLDS for verdict in set(found)}


def test_the_cells_are_all_readings_and_the_main_one_is_among_them() -> None:
    assert len(CELLS) == len({cell_name(cell) for cell in CELLS}) == 12
    assert MAIN in CELLS


@pytest.mark.parametrize(
    ("means", "verdict", "least"),
    [
        ([1.0] * 6, Verdict.SUPPORTED, 0.99),
        ([-1.0] * 6, Verdict.CONTRADICTED, 0.99),
        # one cell goes the other way: it does not hold in all, and the opposite is shown
        ([1.0, 1.0, 1.0, -1.0], Verdict.CONTRADICTED, 0.99),
        # one cell is without any effect: it is not shown in all
        ([1.0, 1.0, 1.0, 0.0], Verdict.UNDECIDED, 0.9),
        ([0.0] * 6, Verdict.UNDECIDED, 0.9),
    ],
)
def test_verdicts_are_those_of_their_worlds(means: list[float], verdict: Verdict, least: float) -> None:
    assert _verdicts(means, seed=1).get(verdict, 0.0) >= least


@pytest.mark.parametrize("means", [[0.0], [0.0] * 12, [2.0] * 11 + [0.0], [-2.0, 0.0, 0.0]])
def test_what_is_not_so_in_one_cell_is_supported_in_few_samples(means: list[float]) -> None:
    """An intersection-union test keeps the level, however many cells there are and whatever the others show."""
    assert _verdicts(means, seed=2).get(Verdict.SUPPORTED, 0.0) <= ALPHA + 3.0 * (ALPHA / WORLDS) ** 0.5


@pytest.mark.parametrize("cells", [1, 12])
def test_what_has_no_opposite_anywhere_is_contradicted_in_few_samples(cells: int) -> None:
    """Without Holm's adjustment twelve cells would find an opposite far too often."""
    assert _verdicts([0.0] * cells, seed=3).get(Verdict.CONTRADICTED, 0.0) <= ALPHA + 3.0 * (ALPHA / WORLDS) ** 0.5


@given(st.integers(1, 12))
def test_too_few_maps_decide_nothing_and_say_how_many_more_it_takes(maps: int) -> None:
    contrast = Contrast("all", {}, paired_shift(np.arange(1.0, maps + 1.0), np.zeros(maps)))
    rate = rate_contrast("all", {}, np.ones(maps), np.zeros(maps))
    (share,) = shares({"all": np.ones(maps)})
    for test in (contrast, rate):
        assert holds(test) == (maps >= fewest_pairs())
        assert test.missing == max(0, fewest_pairs() - maps)
    assert judged([share]) is Verdict.UNDECIDED
    # 0.95^59 is below 0.05, 0.95^58 is not
    assert share.missing == 59 - maps
    assert f"{59 - maps} more maps" in shown([share])
    assert share_part("all", [share]).verdict is Verdict.UNDECIDED


@given(st.integers(0, 200))
def test_shares_are_supported_above_contradicted_below_and_undecided_between(count: int) -> None:
    happened = (np.arange(200) < count).astype(float)
    (share,) = shares({"case": happened})
    verdict = judged([share])
    inside = share.found.interval.low <= share.least <= share.found.interval.high
    if verdict is Verdict.SUPPORTED:
        assert share.found.rate > share.least
    elif verdict is Verdict.CONTRADICTED:
        assert share.found.rate < share.least
    else:
        # one-sided tests decide at least what the two-sided interval does
        assert inside


def test_mirrored_samples_have_mirrored_verdicts() -> None:
    mirrored = {Verdict.SUPPORTED: Verdict.CONTRADICTED, Verdict.UNDECIDED: Verdict.UNDECIDED}
    rng = np.random.default_rng(4)
    for _ in range(50):
        values = rng.normal(0.3, 1.0, size=30)
        there, back = (Contrast("", {}, paired_shift(sign * values, np.zeros(30))) for sign in (1.0, -1.0))
        if judged([there]) in mirrored:
            assert judged([back]) is mirrored[judged([there])]


def test_a_part_says_in_how_many_cells_and_how_much() -> None:
    part = contrast_part("risk", _contrasts(np.random.default_rng(5), [1.0, 1.0, -1.0]), printed="0.24")
    assert part.verdict is Verdict.CONTRADICTED
    assert "in 2 of 3 cells, the opposite in 1" in part.result
    assert "95 % within" in part.effect
    assert part.sizes.endswith("(paper: 0.24)")


@pytest.mark.parametrize(
    ("interval", "verdict"),
    [((1.1, 1.2), Verdict.SUPPORTED), ((0.9, 1.1), Verdict.UNDECIDED), ((0.8, 0.9), Verdict.CONTRADICTED)],
)
def test_intervals_decide_by_where_they_lie(interval: tuple[float, float], verdict: Verdict) -> None:
    assert beyond(Estimate(sum(interval) / 2.0, *interval), 1.0) is verdict


def test_where_a_typical_pair_does_not_differ_nothing_is_shown() -> None:
    """Most differences are 0, the others all go one way: the test is significant, the effect is none."""
    shift = paired_shift(np.concatenate([np.zeros(80), np.full(20, 0.5)]), np.zeros(100))
    contrast = Contrast("", {}, shift)
    assert shift.p < ALPHA
    assert (shift.shift.median, contrast.direction, judged([contrast])) == (0.0, 0, Verdict.UNDECIDED)


def test_cells_that_disagree_are_part_of_the_condition() -> None:
    part = contrast_part("risk", _contrasts(np.random.default_rng(5), [1.0, 1.0, -1.0]), condition="on maps")
    assert part.ruling == "risk: contradicted on maps (in 1 of 3 cells; 2 show it)"
    assert not split(_contrasts(np.random.default_rng(5), [-1.0, -1.0]))


def test_quick_checks_err_less_often() -> None:
    few = [Contrast("", {}, paired_shift(np.arange(1.0, 8.0), np.zeros(7)))]
    assert judged(few) is Verdict.SUPPORTED
    context = copy_context()
    context.run(LEVEL.set, QUICK_ALPHA)
    assert context.run(judged, few) is Verdict.UNDECIDED
    assert context.run(shown, few) == "in 0 of 1 cell, which 1 more maps could show at the earliest"
    assert judged(few) is Verdict.SUPPORTED
