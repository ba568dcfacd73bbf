"""Inequalities that are broken, as exact arithmetic says, are found; the judge has no code of the checker."""

import re
from decimal import Decimal, localcontext
from fractions import Fraction
from functools import cache
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import a_part_of

from cgla_graph.certificate import check_proof as checker
from tests.support.exact_slopes import PLACES, cost_above, exp_bounds, gradient, steepness
from tests.support.proof_mutants import laid_grids
from tests.support.proofs import (
    OPEN,
    Arrays,
    Described,
    archive_of,
    checked,
    fault_of,
    parts_of,
    proof_of,
    put_whole,
    whole_of,
)

#: What a message says of a cell.
NAMED = re.compile(r"on grid 1, to_goal: cell \((\d+), (\d+)\) of 128 is ([0-9.]+) times as steep as the cost, and ")


@given(st.fractions(0, 60, max_denominator=10**6))
def test_exp_is_between_its_bounds(x: Fraction) -> None:
    low, high = exp_bounds(x)
    with localcontext() as context:
        context.prec = 50
        exact = (-(Decimal(x.numerator) / Decimal(x.denominator))).exp()
        near = Decimal(10) ** -45
        assert Decimal(low.numerator) / Decimal(low.denominator) <= exact + near
        assert Decimal(high.numerator) / Decimal(high.denominator) >= exact - near
    assert 0 <= low <= high
    assert high - low < Fraction(1, 1 << 140)


@given(st.lists(st.integers(-1000, 1000), min_size=9, max_size=9), st.fractions(0, 1), st.fractions(0, 1))
def test_the_slope_is_that_of_the_spline(values: list[int], s: Fraction, t: Fraction) -> None:
    """Differences of a product of B-splines, whose weights here are those of the definition: integrals of hats."""
    rows = [values[3 * n : 3 * n + 3] for n in range(3)]

    def height(s: Fraction, t: Fraction) -> Fraction:
        across, along = ([(1 - r) ** 2 / 2, 1 - (1 - r) ** 2 / 2 - r**2 / 2, r**2 / 2] for r in (s, t))
        return sum((b * a * one for b, row in zip(along, rows, strict=True)
                    for a, one in zip(across, row, strict=True)), Fraction(0))  # fmt: skip

    by = Fraction(1, 1000)
    # (central differences of a quadratic function are exact)
    middle = (height(s + by, t) - height(s - by, t)) / (2 * by), (height(s, t + by) - height(s, t - by)) / (2 * by)
    assert gradient(rows, s, t) == middle


def test_the_cost_is_that_of_the_library() -> None:
    described, arrays = parts_of(proof_of(OPEN, 0.002))
    threats = arrays[described["problem"]["threats"]].tolist()
    for x, y in ((0.3, 0.35), (0.41, 0.22), (0.7, 0.5)):
        exact = cost_above(described["problem"], threats, Fraction(x), Fraction(y))
        assert float(exact) == pytest.approx(1.0 + OPEN.k * float(OPEN.field.density(np.array([(x, y)]))[0]), rel=1e-13)


@cache
def to_goal_alone() -> tuple[Described, Arrays, list[tuple[int, int, tuple[int, ...]]], dict[str, Any]]:
    """Return a file whose first grid has one surface, which proves what is claimed, and the cells outside of blocks."""
    described, arrays = parts_of(proof_of(OPEN, 0.002))
    first = described["grids"][0]
    del first["to_start"]
    described["grids"], surface = [first], first["to_goal"]
    grid = laid_grids(described, arrays)[surface["values"]]
    with_bound = checker.Surface(surface, archive_of(arrays).array, grid, OPEN.goal)
    described["lower"] = with_bound.bound(OPEN.start)
    assert checked(described, arrays)["lower"] == described["lower"]
    assert fault_of(described | {"lower": np.nextafter(described["lower"], 9.0)}, arrays)
    blocks = [block["cells"] for block in [*surface["blocks"], surface["end"]]]
    start = [round(one * side) for one, side in zip(OPEN.start, grid.last, strict=True)]
    cells = [
        (int(column), int(row), tuple(controls.tolist()))
        for column, row, controls in zip(grid.columns, grid.rows, grid.controls, strict=True)
        if not any(
            west - 4 <= column < east + 4 and south - 4 <= row < north + 4 for west, east, south, north in blocks
        )
        and max(abs(column - start[0]), abs(row - start[1])) > 3
        and 1 < column < grid.last[0] - 1
        and 1 < row < grid.last[1] - 1
    ]
    return described, arrays, cells, {"last": grid.last, "steepest": float(with_bound.steepness.max())}


def broken(seed: int) -> tuple[Described, Arrays, tuple[int, int], Fraction]:
    """Raise or lower one control value until a cell is too steep by exact arithmetic, and hardly more than that."""
    described, arrays, cells, known = to_goal_alone()
    draw = np.random.default_rng(seed)
    _, _, numbers = cells[int(draw.integers(len(cells)))]
    surface, problem = described["grids"][0]["to_goal"], described["problem"]
    threats = arrays[problem["threats"]].tolist()
    values = whole_of(surface, arrays)
    at, sign = numbers[int(draw.integers(9))], int(draw.choice([-1, 1]))
    # steeper than all other cells, by more than the width of the enclosures
    aim = max(known["steepest"], 1.0) * (1.0 + 10.0 ** draw.uniform(-8.0, -3.0))
    around = [one for one in cells if at in one[2]]

    def reached(by: int) -> tuple[float, int]:
        """Return about how steep the steepest of the cells around the control value is, and which it is."""
        changed = values.copy()
        changed[at] += sign * by
        controls = changed[np.array([one[2] for one in around])].reshape(-1, 3, 3)
        return max((rough(known["last"], one, nine, surface["exponent"]), n)
                   for n, (one, nine) in enumerate(zip(around, controls, strict=True)))  # fmt: skip

    high = 1
    while reached(high)[0] <= aim:
        high *= 2
    low = high // 2
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if reached(middle)[0] > aim else (middle, high)
    cell = around[reached(high)[1]]
    values[at] += sign * high
    exact = steepness(
        problem, threats, known["last"], cell[:2], values[list(cell[2])].reshape(3, 3).tolist(), surface["exponent"]
    )
    arrays = dict(arrays)
    put_whole(surface, arrays, values)
    return described, arrays, cell[:2], exact


def rough(last: list[int], cell: tuple[int, int, tuple[int, ...]], controls: Any, exponent: int) -> float:  # noqa: ANN401 - an array
    """Return the greatest ratio of slope and cost at a few places of a cell, in floats."""
    place = np.linspace(0.0, 1.0, PLACES)
    weights = np.array([(1.0 - place) ** 2 / 2.0, 0.5 + place * (1.0 - place), place**2 / 2.0])
    slopes = np.array([place - 1.0, 1.0 - 2.0 * place, place])
    heights = np.ldexp(controls.astype(float), -exponent)
    along, across = (last[0] * slopes.T @ heights.T @ weights).T, (last[1] * weights.T @ heights.T @ slopes).T
    x, y = ((cell[axis] - 0.5 + place) / last[axis] for axis in range(2))
    points = np.stack(np.meshgrid(x, y), axis=-1)
    return float((np.hypot(along, across) / (1.0 + OPEN.k * OPEN.field.density(points))).max())


@pytest.mark.parametrize("seed", range(6))
def test_an_inequality_that_is_broken_is_named(seed: int) -> None:
    described, arrays, (column, row), exact = broken(seed)
    assert exact > 1
    fault = fault_of(described, arrays)
    found = NAMED.search(fault)
    assert found is not None, fault
    # (in one of the cells around the control value, the slope is the greatest)
    assert max(abs(int(found[1]) - column), abs(int(found[2]) - row)) <= 2
    assert float(found[3]) ** 2 >= float(exact) * (1.0 - 1e-9)


@pytest.mark.slow
def test_many_inequalities_that_are_broken_are_named() -> None:
    for seed in a_part_of(range(6, 206)):
        test_an_inequality_that_is_broken_is_named(seed)
