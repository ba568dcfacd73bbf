"""Cells of constant cost: as many as fit in memory, laid a few rows at a time where there are more."""

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from strategies import examples

import cgla_graph as cg
from cgla_graph.model.rasters import values as values_module
from cgla_graph.regions import arrangement
from cgla_graph.regions.arrangement import Arrangement

FEW = arrays(np.float64, st.tuples(st.integers(2, 14), st.integers(2, 14)), elements=st.sampled_from([0.0, 1.0, 2.5]))


def problem_on(values: np.ndarray, others: tuple[np.ndarray, ...], bounds: tuple[float, ...]) -> cg.Problem:
    rows, columns = values.shape
    first = cg.RasterRisk(values, (0, 0, columns, rows), interpolation="nearest", scale=0.7)
    more = [cg.RasterRisk(one, (1.3, 0.2, columns, rows + 2), interpolation="nearest") for one in others]
    x_min, y_min, x_max, y_max = bounds
    ends = ((x_min, y_min), (x_max, y_max))
    return cg.Problem(*ends, cg.RiskField(rasters=[first, *more]), k=3.0, bounds=(x_min, y_min, x_max, y_max))


def in_parts(problem: cg.Problem, most: int, **how: Any) -> Arrangement:  # noqa: ANN401 - settings
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(arrangement, "MOST_CELLS", most)
        patch.setattr(values_module, "AT_ONCE", 20)
        return Arrangement.of(problem, **how)


def lines_of(problem: cg.Problem, *, for_bound: bool) -> list[np.ndarray]:
    return [arrangement._lines(problem, axis, 1, 0.0 if for_bound else arrangement.BESIDE) for axis in (0, 1)]


@given(FEW, st.lists(FEW, max_size=1), st.integers(1, 4), st.booleans())
@examples(60)
def test_equal_cells_are_joined_a_few_rows_at_a_time(
    values: np.ndarray, others: list[np.ndarray], times: int, for_bound: bool
) -> None:
    values = np.kron(values, np.ones((times, times)))
    rows, columns = values.shape
    problem = problem_on(values, () if for_bound else tuple(others), (-0.5, 0.25, columns, rows + 1.0))
    whole = Arrangement.of(problem, for_bound=for_bound)
    # (rows of equal cells are counted before columns are joined)
    most = len(whole.costs) * (len(lines_of(problem, for_bound=for_bound)[0]) - 1)
    found = in_parts(problem, most, for_bound=for_bound)
    assert found.block == 1
    for name in ("x", "y", "costs", "widths", "heights", "shape_of"):
        assert np.array_equal(getattr(found, name), getattr(whole, name))


@given(FEW, st.lists(FEW, max_size=1), st.integers(2, 8))
@examples(60)
def test_blocks_have_the_mean_cost_and_nothing_is_proven_over_them(
    values: np.ndarray, others: list[np.ndarray], most: int
) -> None:
    values = values + 9.0 * np.arange(values.size).reshape(values.shape)
    rows, columns = values.shape
    problem = problem_on(values, tuple(others), (-0.5, 0.25, columns, rows + 1.0))
    found, (x, y) = in_parts(problem, most), lines_of(problem, for_bound=False)
    assert found.block > 1
    assert found.costs.size <= (math.sqrt(most) + 1.0) ** 2
    costs = arrangement._costs(problem, x, y) * np.diff(y)[:, None] * np.diff(x)
    row, column = np.searchsorted(found.y[:-1], y[:-1], "right") - 1, np.searchsorted(found.x[:-1], x[:-1], "right") - 1
    sums = np.zeros(found.costs.shape)
    np.add.at(sums, (np.repeat(row, len(column)), np.tile(column, len(row))), costs.ravel())
    assert found.costs == pytest.approx(sums / (np.diff(found.y)[:, None] * np.diff(found.x)), rel=1e-9)
    assert in_parts(problem, most, for_bound=True).costs.tolist() == [[1.0]]


@pytest.mark.slow
def test_no_proof_over_blocks(monkeypatch: pytest.MonkeyPatch) -> None:
    values = np.arange(100.0).reshape(10, 10)
    problem = problem_on(values, (), (0.0, 0.0, 10.0, 10.0))
    monkeypatch.setattr(arrangement, "MOST_CELLS", 50)
    best = cg.solve(problem)
    assert best.status.has_path
    assert best.lower_bound <= best.cost
