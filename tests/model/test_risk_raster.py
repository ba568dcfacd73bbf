"""Risk on rasters against scipy, itself cut finer, and what a broken integral would say."""

import copy
import dataclasses
import math
import pickle
import tracemalloc
from collections.abc import Callable
from typing import Any, Literal

import numpy as np
import oracles
import pytest
import shapely
import strategies
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model import risk_raster_kernels as kernels
from cgla_graph.model.isolated import unchanged
from cgla_graph.model.rasters import values as values_module
from cgla_graph.model.rasters.values import MOST_CELLS
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.testing import strategies as drawn

CHECKED = RasterRisk([[0, 0, 0], [0, 6, 2]], bounds=(0, 0, 3, 2))
LEFT_LOW = RasterRisk([[1, 2], [4, 8]], bounds=(0, 0, 2, 2), interpolation="nearest")


def random_points(seed: int, count: int, low: float = -0.5, high: float = 1.5) -> FloatArray:
    return np.random.default_rng(seed).uniform(low, high, (count, 2))


def integral(raster: RasterRisk, start: Any, end: Any) -> float:  # noqa: ANN401 - pairs of numbers
    return float(cg.RiskField(rasters=[raster]).line_integral(start, end))


# Density and gradient


@given(drawn.rasters(), drawn.seeds)
@strategies.usual
def test_the_density_is_scipys(raster: RasterRisk, seed: int) -> None:
    points = random_points(seed, 50)
    assert raster.density(points) == pytest.approx(oracles.raster_density(raster, points), rel=1e-12, abs=1e-300)


@given(drawn.raster_fields(), drawn.seeds)
@strategies.usual
def test_rasters_are_added_to_threats(field: cg.RiskField, seed: int) -> None:
    points = random_points(seed, 30)
    wanted = oracles.density(field.threats, points)
    wanted = wanted + sum(oracles.raster_density(raster, points) for raster in field.rasters)
    assert field.density(points) == pytest.approx(wanted, rel=1e-12, abs=1e-12)


@given(drawn.raster_fields(), drawn.seeds)
@strategies.usual
def test_the_gradient_is_that_of_the_density(field: cg.RiskField, seed: int) -> None:
    points, step = random_points(seed, 30), 1e-7
    found = field.gradient(points)
    for axis in range(2):
        aside = np.zeros(2)
        aside[axis] = step
        slope = (field.density(points + aside) - field.density(points - aside)) / (2.0 * step)
        # but for points next to a line, where the difference sees a kink or a jump
        same = np.isclose(field.gradient(points + aside), field.gradient(points - aside), rtol=1e-3, atol=1e-3).all(
            axis=1
        )
        smooth = same & (np.abs(field.density(points + aside) - field.density(points - aside)) < 1e-3)
        assert found[smooth, axis] == pytest.approx(slope[smooth], rel=1e-4, abs=1e-4)


def test_on_the_edge_of_two_cells_the_lesser_value_counts() -> None:
    assert LEFT_LOW.density([(1.0, 0.5), (0.5, 1.0), (1.0, 1.0)]).tolist() == [4.0, 1.0, 1.0]
    # along the edge as well, and the raster's own edges belong to it
    assert integral(LEFT_LOW, (1, 0), (1, 1)) == 4.0
    assert integral(LEFT_LOW, (1, 0), (1, 2)) == 5.0
    assert integral(LEFT_LOW, (2, 0), (2, 2)) == 10.0
    assert integral(LEFT_LOW, (2.001, 0), (2.001, 2)) == 0.0


@pytest.mark.parametrize("x", [0.1, 0.3, 0.7, 1.1, 123456.7])
def test_edges_are_met_though_rounding_puts_them_off(x: float) -> None:
    """Multiples of a tenth are no floats; the edge between two cells is found all the same."""
    raster = RasterRisk([[5, 1]], bounds=(x - 0.1, 0, x + 0.1, 1), interpolation="nearest")
    assert raster.density((x, 0.5)) == 1.0
    assert integral(raster, (x, 0.2), (x, 0.8)) == pytest.approx(0.6, rel=1e-12)


# Line integrals


@given(drawn.rasters(), drawn.seeds)
@examples(60)
def test_integrals_are_those_of_scipy_on_each_piece(raster: RasterRisk, seed: int) -> None:
    start, end = random_points(seed, 2)
    found = integral(raster, start, end)
    assert found == pytest.approx(oracles.raster_integral(raster, start, end), rel=1e-12, abs=1e-13)
    assert found == integral(raster, end, start)


@given(drawn.raster_fields(), drawn.seeds)
@strategies.usual
def test_integrals_of_rasters_are_added_to_those_of_threats(field: cg.RiskField, seed: int) -> None:
    start, end = random_points(seed, 2)
    wanted = oracles.line_integral(field.threats, start, end)
    wanted += sum(oracles.raster_integral(raster, start, end) for raster in field.rasters)
    assert field.line_integral(start, end) == pytest.approx(wanted, rel=1e-10, abs=1e-10)


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_lines_through_many_cells_are_exact(interpolation: Any) -> None:  # noqa: ANN401 - one of two words
    values = np.random.default_rng(5).random((300, 200))
    raster = RasterRisk(values, (500_000.0, 6_700_000.0, 512_000.0, 6_718_000.0), interpolation=interpolation)
    start, end = np.array([500_100.0, 6_700_321.0]), np.array([511_877.0, 6_717_432.0])
    cuts = oracles.raster_cuts(raster, start, end)
    middles, length = 0.5 * (cuts[1:] + cuts[:-1]), math.dist(start, end)
    ends = [oracles.raster_density(raster, start + (end - start) * part[:, None]) for part in (cuts, middles)]
    pieces = (ends[0][:-1] + 4.0 * ends[1] + ends[0][1:]) / 6.0 if interpolation == "bilinear" else ends[1]
    wanted = float((pieces * np.diff(cuts)).sum()) * length
    # places near 6.7e6 are known to 1e-9
    assert integral(raster, start, end) == pytest.approx(wanted, rel=1e-9)


def test_sampling_would_be_seen() -> None:
    raster = RasterRisk(np.eye(7), (0, 0, 1, 1), interpolation="nearest")
    start, end = np.array([0.03, 0.0]), np.array([0.91, 1.0])
    wanted = oracles.raster_integral(raster, start, end)
    assert integral(raster, start, end) == pytest.approx(wanted, rel=1e-12)
    parts = np.linspace(0.0, 1.0, 1001)
    sampled = np.trapezoid(raster.density(start + parts[:, None] * (end - start)), parts) * math.dist(start, end)
    assert sampled != pytest.approx(wanted, rel=1e-5)


@given(drawn.rasters(), drawn.seeds)
@strategies.usual
def test_moments_are_derivatives_of_the_integral(raster: RasterRisk, seed: int) -> None:
    start, end = random_points(seed, 2)
    length = math.dist(start, end)
    along = (end - start) / length
    across, arrays = np.array([-along[1], along[0]]), cg.RiskField(rasters=[raster]).raster_array
    risk, slope, lever = kernels.raster_moments(*start, *along, length, arrays)
    assert risk == pytest.approx(kernels.raster_risk(*start, *end, arrays), rel=1e-10, abs=1e-13)

    def moved(first: float, second: float) -> float:
        return float(kernels.raster_risk(*(start + first * across), *(end + second * across), arrays))

    for found, part in ((lever, 0.0), (slope, 1.0)):
        rough, fine = ((moved(part * h, h) - moved(-part * h, -h)) / (2.0 * h) for h in (1e-6, 1e-7))
        # but for kinks, as where an end is next to a line
        if math.isclose(rough, fine, rel_tol=1e-4, abs_tol=1e-4):
            assert found == pytest.approx(fine, rel=1e-3, abs=1e-3)


# Bounds on rectangles


@given(drawn.raster_fields(max_threats=0), drawn.seeds)
@examples(150)
def test_no_density_on_a_rectangle_is_below_its_floor_or_outside_its_range(field: cg.RiskField, seed: int) -> None:
    rng = np.random.default_rng(seed)
    low = rng.uniform(-0.4, 1.2, 2)
    high = low + 10.0 ** rng.uniform(-3.0, 0.0, 2)
    if rng.random() < 0.3:
        # in line with the raster
        x_min, y_min, _, _ = field.rasters[0].bounds
        size = np.array(field.rasters[0].cell_size)
        low = np.array([x_min, y_min]) + size * rng.integers(0, 4, 2) / 2
        high = low + 0.5 * size
    middle = rng.uniform(low, high)
    arrays = field.raster_array
    value, slope_x, slope_y, drop, least = kernels.raster_floor(tuple(low), tuple(high), *middle, arrays)
    corners = np.array([(x, y) for x in (low[0], middle[0], high[0]) for y in (low[1], middle[1], high[1])])
    points = np.vstack([rng.uniform(low, high, (200, 2)), corners])
    density = field.density(points)
    assert density.min() >= least * (1.0 - 1e-12)
    linear = value + (points - middle) @ (slope_x, slope_y) - drop
    assert (density >= linear - 1e-12 * (1.0 + value + drop)).all()
    smallest, greatest = kernels.raster_range(tuple(low), tuple(high), arrays)
    assert smallest * (1.0 - 1e-12) <= density.min()
    assert density.max() <= greatest * (1.0 + 1e-12)


def test_the_drop_of_an_aligned_rectangle_falls_with_its_area() -> None:
    """Inside one patch a bilinear function is above its tangent but for its mixed term."""
    raster = RasterRisk(np.random.default_rng(3).random((4, 4)), (0, 0, 4, 4))
    arrays = cg.RiskField(rasters=[raster]).raster_array
    drops = []
    for size in (0.4, 0.2, 0.1, 0.05):
        low, high = (0.6, 0.7), (0.6 + size, 0.7 + size)
        drops.append(kernels.raster_floor(low, high, 0.6 + 0.5 * size, 0.7 + 0.5 * size, arrays)[3])
    assert 1.9 < oracles.rate(drops) < 2.1


# The model


@pytest.mark.parametrize("origin", ["upper", "lower"])
def test_row_0_is_where_the_origin_says(origin: Any) -> None:  # noqa: ANN401 - one of two words
    raster = RasterRisk([[1, 1], [3, 3]], (0, 0, 2, 2), interpolation="nearest", origin=origin)
    assert raster.density((1, 0.5)) == (3.0 if origin == "upper" else 1.0)
    assert raster.cells.tolist() == ([[3, 3], [1, 1]] if origin == "upper" else [[1, 1], [3, 3]])


def test_what_is_missing_is_what_the_user_says() -> None:
    values = [[1.0, math.nan], [2.0, 4.0]]
    with pytest.raises(
        ProblemError, match=r"1 cells .* no data, the first in row 0, column 1; give its value with nodata="
    ):
        RasterRisk(values, (0, 0, 1, 1))
    raster = RasterRisk(values, (0, 0, 1, 1), nodata=7.0, scale=10.0, interpolation="nearest")
    assert raster.density((0.9, 0.9)) == 70.0
    assert raster.missing.tolist() == [[False, True], [False, False]]


NO_RASTERS: list[tuple[Callable[[], object], str]] = [
    (lambda: RasterRisk([[-1.0]], (0, 0, 1, 1)), r"1 values of the raster are no risk, the first is -1 in row 0"),
    (lambda: RasterRisk([[math.inf]], (0, 0, 1, 1)), "the first is inf"),
    (lambda: RasterRisk([[math.nan]], (0, 0, 1, 1), nodata=0), "holds no data"),
    (lambda: RasterRisk([1.0, 2.0], (0, 0, 1, 1)), r"shape \(2,\)"),
    (lambda: RasterRisk(np.empty((0, 3)), (0, 0, 1, 1)), r"shape \(0, 3\)"),
    (lambda: RasterRisk([["a"]], (0, 0, 1, 1)), "not an array of numbers"),
    (lambda: RasterRisk([[1.0]], (0, 0, 0, 1)), "bounds"),
    (lambda: RasterRisk([[1.0]], (0, 0, 1, 1), scale=0.0), "raster scale is 0"),
    (lambda: RasterRisk([[1e60]], (0, 0, 1, 1), scale=1e60), "at most 1e.100"),
    (lambda: RasterRisk([[1.0]], (0, 0, 1, 1), nodata=-1.0), "raster nodata is -1"),
    (lambda: RasterRisk([[1.0]], (0, 0, 1, 1), interpolation="cubic"), "'cubic'; choose one of bilinear, nearest"),  # type: ignore[arg-type]
    (lambda: RasterRisk([[1.0]], (0, 0, 1, 1), origin="left"), "'left'; choose one of upper, lower"),  # type: ignore[arg-type]
    (lambda: cg.RiskField(rasters=[3]), "raster 0 is int, not a RasterRisk"),  # type: ignore[list-item]
    (lambda: cg.RiskField(rasters=5), "rasters are 5; give a list of RasterRisk"),  # type: ignore[arg-type]
    (
        lambda: RasterRisk(np.broadcast_to(0.0, (10_000, MOST_CELLS // 10_000 + 1)), (0, 0, 1, 1)),
        "10000 x 12001 cells, more than 120000000",
    ),
    (lambda: CHECKED.area_above(-1.0), "level is -1"),
    (lambda: CHECKED.area_above(1.0, buffer=-1.0), "buffer is -1"),
]


@pytest.mark.parametrize(("make", "message"), NO_RASTERS)
def test_what_is_no_raster_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        make()


def test_nothing_that_was_passed_in_is_changed_or_shared() -> None:
    values = np.ones((2, 2))
    raster = RasterRisk(values, (0, 0, 1, 1))
    values[:] = 5.0
    assert raster.greatest == 1.0
    for array in (raster.values, raster.cells, cg.RiskField(rasters=[raster]).raster_array):
        assert not array.flags.writeable


def test_a_factor_shares_the_memory_of_the_cells() -> None:
    town = RasterRisk(np.ones((40, 50)), (0, 0, 5000, 4000), unit="people/m2")
    flown = town.flown_over_by(cg.FailureModel(1e-3, speed=20, lethal_area=6.5))
    array = cg.RiskField(rasters=[flown]).raster_array
    for other in (town.cells, flown.values, flown.scaled(3.0).values, cg.RiskField(rasters=[flown]).raster_array):
        assert np.shares_memory(array, other)
    # (kernels take a copy of rasters with another factor, as the header is part of the array)
    assert town.density((2500, 2000)) == 1.0
    assert flown.density((2500, 2000)) == pytest.approx(flown.greatest, rel=1e-15)
    assert flown.people is not None
    assert flown.people.density((2500, 2000)) == 1e6
    assert flown.people == town.people


@given(drawn.rasters(), st.sampled_from([1e-6, 0.3, 7.0]), drawn.seeds)
@strategies.usual
def test_a_factor_multiplies_all_that_kernels_say(raster: RasterRisk, factor: float, seed: int) -> None:
    made = RasterRisk(raster.cells * factor, raster.bounds, interpolation=raster.interpolation, origin="lower")
    shared = RasterRisk(raster.cells, raster.bounds, interpolation=raster.interpolation, origin="lower").scaled(factor)
    one, other = (cg.RiskField(rasters=[each]) for each in (made, shared))
    assert made == shared
    points = random_points(seed, 20)
    for say in ("density", "gradient"):
        assert getattr(other, say)(points) == pytest.approx(getattr(one, say)(points), rel=1e-12, abs=1e-12 * factor)
    starts, ends = points[:10], points[10:]
    assert other.line_integral(starts, ends) == pytest.approx(one.line_integral(starts, ends), rel=1e-12)
    for a, b in zip(starts, ends, strict=True):
        low, high = tuple(np.minimum(a, b).tolist()), tuple(np.maximum(a, b).tolist())
        u, size = (b - a) / np.hypot(*(b - a)), float(np.hypot(*(b - a)))
        found = [
            (
                *kernels.raster_range(low, high, each.raster_array),
                *kernels.raster_floor(low, high, *(0.5 * (a + b)).tolist(), each.raster_array),
                *kernels.raster_moments(*a.tolist(), *u.tolist(), size, each.raster_array),
            )
            for each in (one, other)
        ]
        assert found[1] == pytest.approx(found[0], rel=1e-9, abs=1e-9 * factor)


def test_to_evaluate_is_no_change_of_a_problem() -> None:
    # (the header of kernels is written into the array of the cells when they are first asked for)
    raster = RasterRisk([[1, 2], [3, 4]], (0, 0, 1, 1), scale=2.0)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(rasters=[raster]))
    with unchanged(problem, "mine"):
        problem.evaluate([(0.1, 0.1), (0.9, 0.9)])
        raster.density((0.5, 0.5))


def test_a_raster_is_replaced_as_a_dataclass() -> None:
    raster = RasterRisk([[1, np.nan], [3, 4]], (0, 0, 1, 1), nodata=7.0)
    assert dataclasses.replace(raster, nodata=5.0).values.tolist()[0][0] == 1.0
    assert dataclasses.replace(raster, nodata=5.0).cells.tolist() == [[3, 4], [1, 5]]


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_a_large_raster_is_in_memory_once(
    interpolation: Literal["bilinear", "nearest"], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(values_module, "AT_ONCE", 20_000)

    def exposed(values: FloatArray) -> RasterRisk:
        raster = RasterRisk(values, (0, 0, 2000, 1000), interpolation=interpolation, unit="people/km2")
        flown = raster.flown_over_by(cg.FailureModel(1e-3, speed=20, lethal_area=6.5))
        problem = cg.Problem((1, 1), (1900, 900), cg.RiskField(rasters=[flown]), bounds=flown.bounds)
        cg.exposure(problem, [(1, 1), (1900, 900)], corridor=10.0, max_density=2.0)
        assert hash(flown)
        return flown

    # (so that kernels are loaded)
    exposed(np.ones((2, 2)))
    values = np.ones((1000, 2000))
    tracemalloc.start()
    try:
        kept = exposed(values)
        assert kept.shape == values.shape
        assert tracemalloc.get_traced_memory()[1] < 8 * values.size * 1.5
        assert tracemalloc.get_traced_memory()[0] < 8 * values.size * 1.2
    finally:
        tracemalloc.stop()


def test_rasters_are_equal_if_they_are_the_same_risk() -> None:
    here = RasterRisk([[1, 2], [3, 4]], (0, 0, 1, 1))
    flipped = RasterRisk([[6, 8], [2, 4]], (0, 0, 1, 1), origin="lower", scale=0.5)
    assert (here == flipped, hash(here) == hash(flipped)) == (True, True)
    others = [
        RasterRisk([[1, 2], [3, 4]], (0, 0, 1, 2)),
        RasterRisk([[1, 2], [3, 4]], (0, 0, 1, 1), interpolation="nearest"),
        RasterRisk([[1, 2], [3, 5]], (0, 0, 1, 1)),
        RasterRisk([[1, 2, 3, 4]], (0, 0, 1, 1)),
    ]
    assert here not in others
    assert repr(here) == "RasterRisk(2 x 2 cells, bilinear, up to 4, bounds=(0.0, 0.0, 1.0, 1.0))"


@given(drawn.raster_fields())
@strategies.few
def test_fields_with_rasters_survive_copies_and_pickles(field: cg.RiskField) -> None:
    for other in (pickle.loads(pickle.dumps(field)), copy.deepcopy(field)):  # noqa: S301 - our own
        assert other == field
        assert other.line_integral((0, 0), (1, 1)) == field.line_integral((0, 0), (1, 1))
        assert not any(array.flags.writeable for raster in other.rasters for array in (raster.values, raster.cells))
    assert field.with_threats([]).rasters == field.with_only([]).rasters == field.rasters
    assert not field.is_empty
    assert field.is_proper


def test_a_pickle_holds_the_values_once() -> None:
    raster = RasterRisk(np.ones((100, 100)), (0, 0, 1, 1))
    assert raster.greatest == 1.0
    assert len(pickle.dumps(raster)) < 1.1 * raster.values.nbytes


@given(drawn.rasters(), st.floats(0.0, 2.0), st.floats(0.0, 0.3), drawn.seeds)
@strategies.usual
def test_a_corridor_outside_the_area_meets_no_cell_above_the_level(
    raster: RasterRisk, level: float, half_width: float, seed: int
) -> None:
    area = raster.area_above(level, buffer=half_width)
    shapely.prepare(area)
    x_min, y_min, _, _ = raster.bounds
    width, height = raster.cell_size
    risky = [
        shapely.box(x_min + i * width, y_min + j * height, x_min + (i + 1) * width, y_min + (j + 1) * height)
        for (j, i), value in np.ndenumerate(raster.cells)
        if value > level
    ]
    for x, y in random_points(seed, 20).tolist():
        place = shapely.Point(x, y)
        apart = min((box.distance(place) for box in risky), default=math.inf)
        if apart < half_width:
            assert shapely.covers(area, place)
        if apart > half_width * 1.0001:
            assert not shapely.covers(area, place)
