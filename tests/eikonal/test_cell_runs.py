"""Runs of cells against plain sets of cells."""

from fractions import Fraction
from itertools import pairwise, product
from typing import TypeAlias

import numpy as np
import strategies
from hypothesis import given
from hypothesis import strategies as st
from oracles import are_in, cells

from cgla_graph._types import WholeArray
from cgla_graph.eikonal import cell_runs

#: (column, row)
Cells: TypeAlias = set[tuple[int, int]]

whole = st.integers(-6, 12)


@st.composite
def any_runs(draw: st.DrawFn) -> WholeArray:
    """Draw runs in any order; they may overlap, touch, repeat, or be none at all."""
    runs = draw(st.lists(st.tuples(whole, whole, st.integers(1, 6)), max_size=8))
    return np.array([(row, first, first + width) for row, first, width in runs], dtype=np.int64).reshape(-1, 3)


def are_merged(runs: WholeArray) -> bool:
    """Say whether runs are sorted, not empty, and apart by a cell at least."""
    listed = runs.tolist()
    apart = all(a[0] < b[0] or (a[0] == b[0] and a[2] < b[1]) for a, b in pairwise(listed))
    return apart and all(first < end for _, first, end in listed)


@given(any_runs())
@strategies.fast
def test_merged_runs_are_the_same_cells_in_order(runs: WholeArray) -> None:
    given_runs = runs.copy()
    found = cell_runs.merged(runs)
    assert cells(found) == cells(runs)
    assert are_merged(found)
    assert (runs == given_runs).all()


@given(any_runs(), st.integers(0, 4))
@strategies.fast
def test_dilation_is_that_of_sets(runs: WholeArray, reach: int) -> None:
    found = cell_runs.dilated(runs, reach)
    around = range(-reach, reach + 1)
    assert cells(found) == {(i + a, j + b) for i, j in cells(runs) for a, b in product(around, around)}
    assert are_merged(found)


lasts = st.tuples(st.integers(1, 13), st.integers(1, 13))


@given(any_runs(), lasts, lasts)
@strategies.fast
def test_refined_cells_are_those_that_touch(runs: WholeArray, last: tuple[int, int], finer: tuple[int, int]) -> None:
    runs = cell_runs.clipped(cell_runs.merged(runs), last)
    found = cell_runs.refined(runs, last, finer)

    def touch(fine: int, coarse: int, axis: int) -> bool:
        """Compare the fine cell with the coarse one, in fractions of the side that both grids are over."""
        apart = abs(Fraction(fine, finer[axis]) - Fraction(coarse, last[axis]))
        return apart <= Fraction(1, 2 * finer[axis]) + Fraction(1, 2 * last[axis])

    wanted = {
        (i, j)
        for i, j in product(range(finer[0] + 1), range(finer[1] + 1))
        if any(touch(i, a, 0) and touch(j, b, 1) for a, b in cells(runs))
    }
    assert cells(found) == wanted
    assert are_merged(found)


@given(any_runs(), st.tuples(st.integers(0, 8), st.integers(0, 8)))
@strategies.fast
def test_clipped_cells_are_inside(runs: WholeArray, last: tuple[int, int]) -> None:
    given_runs = runs.copy()
    found = cell_runs.clipped(runs, last)
    assert cells(found) == cells(runs) & cells(cell_runs.rectangle(last))
    assert (found[:, 1] < found[:, 2]).all()
    assert (runs == given_runs).all()


@given(st.tuples(st.integers(0, 8), st.integers(0, 8)))
@strategies.fast
def test_a_rectangle_has_every_cell_once(last: tuple[int, int]) -> None:
    found = cell_runs.rectangle(last)
    assert cells(found) == set(product(range(last[0] + 1), range(last[1] + 1)))
    assert are_merged(found)


@given(any_runs())
@strategies.fast
def test_cells_are_listed_row_by_row_and_gathered_again(runs: WholeArray) -> None:
    merged = cell_runs.merged(runs)
    columns, rows = cell_runs.cells_of(merged)
    listed = list(zip(rows.tolist(), columns.tolist(), strict=True))
    assert listed == sorted((row, column) for column, row in cells(runs))
    assert cell_runs.runs_of(columns, rows).tolist() == merged.tolist()


@given(st.lists(st.tuples(whole, whole), max_size=20))
@strategies.fast
def test_cells_in_any_order_and_twice_make_runs(listed: list[tuple[int, int]]) -> None:
    columns, rows = np.array([*listed, *listed[:3]], dtype=np.int64).reshape(-1, 2).T
    found = cell_runs.runs_of(columns, rows)
    assert cells(found) == set(listed)
    assert are_merged(found)


@given(any_runs(), any_runs())
@strategies.fast
def test_membership_is_that_of_sets(runs: WholeArray, others: WholeArray) -> None:
    some, every = cell_runs.merged(runs), cell_runs.merged(np.vstack([runs, others]))
    assert cell_runs.are_in(every, some).tolist() == are_in(*cell_runs.cells_of(every), some)


def test_keys_of_far_cells_do_not_overflow() -> None:
    far = 2**30
    runs = np.array([[far, far, far + 2], [far + 1, 0, 1]], dtype=np.int64)
    columns, rows = cell_runs.cells_of(cell_runs.merged(runs))
    assert cell_runs.are_in(runs, runs[1:]).tolist() == [False, False, True]
    assert cell_runs.runs_of(columns, rows).tolist() == runs.tolist()
