"""Where a coarse grid sees one way only, a wide search finds none that is better."""

import math
from collections.abc import Callable

import numpy as np
import pytest
import scipy.ndimage
from hypothesis import given
from strategies import examples
from test_hybrid import QUICK, random_map

import cgla_graph as cg
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers.continuous import hybrid, hybrid_valley
from cgla_graph.testing import strategies as drawn

#: How much worse the one way may be than that of a wide search.
WORSE = 4e-5


def steep_ends(seed: int) -> cg.Problem:
    """Draw twenty threats, with both ends on the slope of one, and a risk weight from 10 to 1000."""
    rng = np.random.default_rng(seed)
    threats = [cg.Threat(*rng.random(2), rng.uniform(0.03, 0.1), rng.uniform(0.3, 1.0)) for _ in range(20)]
    ends = (tuple(np.clip(rng.normal((t.x, t.y), 0.7 * t.spread), 0.0, 1.0).tolist()) for t in threats[:2])
    return cg.Problem(*ends, cg.RiskField(threats), 10.0 ** rng.uniform(1.0, 3.0))


def excess(problem: cg.Problem) -> float | None:
    """Return how much more the one way costs than the best of a wide search, relative to it; None if none is it."""
    answer = QUICK.solve(problem)
    if "no other way" not in answer.message:
        return None
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(hybrid, "holds_one_way", lambda *_: False)
        return answer.cost / QUICK.solve(problem).cost - 1.0


@pytest.mark.slow
@pytest.mark.parametrize("drawn", [random_map, steep_ends])
@given(seed=drawn.seeds)
@examples(25)
def test_where_there_is_one_way_no_other_is_better(drawn: Callable[[int], cg.Problem], seed: int) -> None:
    assert (excess(drawn(seed)) or 0.0) <= WORSE


def test_there_often_is_one_way() -> None:
    answers = [QUICK.solve(random_scenario(seed).problem) for seed in range(1, 21)]
    assert sum("no other way" in answer.message for answer in answers) >= 12


def test_ways_that_a_band_would_tell_apart_are_missed_without_bands(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(hybrid_valley, "MOST_WRONG", 0.01)
    assert excess(random_map(12)) is None
    monkeypatch.setattr(hybrid_valley, "BANDS", (math.inf,))
    assert (excess(random_map(12)) or 0.0) > 0.005


@pytest.mark.parametrize("seed", [23, 55])
def test_a_grid_that_is_wrong_about_the_best_way_says_nothing(seed: int, monkeypatch: pytest.MonkeyPatch) -> None:
    assert excess(steep_ends(seed)) is None
    monkeypatch.setattr(hybrid_valley, "MOST_WRONG", math.inf)
    assert (excess(steep_ends(seed)) or 0.0) > 0.005


@given(seed=drawn.seeds)
@examples(50)
def test_parts_less_holes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    cells = rng.random(rng.integers(1, 12, 2)) < rng.random()
    _, parts = scipy.ndimage.label(cells, np.ones((3, 3)))
    _, gaps = scipy.ndimage.label(np.pad(~cells, 1, constant_values=True))
    assert hybrid_valley._euler(cells) == parts - (gaps - 1)
