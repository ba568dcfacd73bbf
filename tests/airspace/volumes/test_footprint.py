"""Densities averaged over the footprint of a crash: areas of discs in cells, totals, headings, and the border."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph.airspace.volumes.footprint import disc_weights
from cgla_graph.errors import ProblemError
from cgla_graph.model.ground_risk import people_of


@examples(25)
@given(st.floats(0.05, 4.0), st.floats(0.3, 3.0), st.floats(0.3, 3.0))
def test_weights_are_areas_of_a_disc_in_cells(radius: float, wide: float, high: float) -> None:
    weights = disc_weights(radius, (wide, high))
    assert weights.sum() == pytest.approx(1.0, abs=1e-12)
    disc = shapely.Point(0, 0).buffer(radius, 2000)
    up, across = weights.shape[0] // 2, weights.shape[1] // 2
    for row in range(-up, up + 1):
        for column in range(-across, across + 1):
            cell = shapely.box((column - 0.5) * wide, (row - 0.5) * high, (column + 0.5) * wide, (row + 0.5) * high)
            area = cell.intersection(disc).area / (math.pi * radius * radius)
            assert weights[row + up, column + across] == pytest.approx(area, abs=1e-6)


def test_averages_are_exact_at_centres_and_the_total_stays() -> None:
    cells = np.zeros((30, 40))
    cells[10:20, 12:25] = np.random.default_rng(2).random((10, 13)) * 1000.0
    people = cg.RasterRisk(cells, (0, 0, 400, 240), unit="people/km2")
    spread = cg.footprint_density(people, 35.0, outside=0.0)
    assert spread.cells.sum() == pytest.approx(people.cells.sum(), rel=1e-12)
    assert spread.unit == "people/km2"
    disc = shapely.Point(165.0, 124.0).buffer(35.0, 500)
    low = np.meshgrid(np.arange(40) * 10.0, np.arange(30) * 8.0)
    high = np.meshgrid(np.arange(1, 41) * 10.0, np.arange(1, 31) * 8.0)
    boxes = shapely.box(*low, *high)
    average = float((_areas(boxes, disc) * people.cells).sum())
    assert spread.cells[15, 16] == pytest.approx(average / (math.pi * 35.0**2), rel=1e-4)


def _areas(boxes: np.ndarray, disc: shapely.Polygon) -> np.ndarray:
    return np.asarray(shapely.area(shapely.intersection(boxes, disc)))


def test_what_is_beyond_the_border_is_unknown_until_it_is_said() -> None:
    people = cg.RasterRisk(np.full((11, 11), 50.0), (0, 0, 110, 110), unit="people/km2")
    spread = cg.footprint_density(people, 24.0)
    assert spread.missing.sum() == 11 * 11 - 7 * 7
    assert spread.cells.min() == pytest.approx(50.0, rel=1e-12)
    problem = cg.Problem((55, 55), (85, 60), cg.RiskField(rasters=[spread]), bounds=(0, 0, 110, 110))
    flight = cg.volumes(cg.solve(problem, "straight-line"), height=5, speed=2, dimension=0.3, pitch=45, width=2)
    assert flight.people_below(people_of(problem)).ground_risk_class.value is None
    assert cg.footprint_density(people, 24.0, outside=0.0).cells[0, 0] == pytest.approx(50.0 * _quarter(24.0), rel=1e-3)
    assert cg.footprint_density(people, 24.0, outside=50.0).cells[0, 0] == pytest.approx(50.0)
    with pytest.raises(ProblemError, match="leaves the raster around every cell"):
        cg.footprint_density(people, 80.0)


def _quarter(radius: float) -> float:
    """Return the part of a disc around the middle of the corner cell that is on the raster."""
    disc = shapely.Point(5, 5).buffer(radius, 500)
    return float(disc.intersection(shapely.box(0, 0, 110, 110)).area / disc.area)


def test_a_footprint_ahead_counts_for_the_worst_heading() -> None:
    cells = np.zeros((41, 41))
    cells[20, 20] = 900.0
    people = cg.RasterRisk(cells, (0, 0, 410, 410))
    around = cg.footprint_density(people, 15.0, outside=0.0)
    ahead = cg.footprint_density(people, 15.0, ahead=80.0, outside=0.0)
    for row in range(41):
        for column in range(41):
            place = np.array([column * 10.0 + 5.0, row * 10.0 + 5.0])
            angles = np.linspace(0.0, 2.0 * math.pi, 181)
            centres = place + 80.0 * np.column_stack([np.cos(angles), np.sin(angles)])
            inside = ((centres >= 0.0) & (centres < 410.0)).all(axis=1)
            columns, rows = (centres[inside] // 10.0).astype(int).T
            assert ahead.cells[row, column] >= around.cells[rows, columns].max(initial=0.0)
    assert ahead.cells[20, 20] == 0.0


def test_a_proof_holds_for_averaged_densities() -> None:
    """The bound is one of all paths, and averages are below the greatest density."""
    cells = np.full((20, 20), 10.0)
    cells[5:15, 9:11] = 5_000.0
    people = cg.RasterRisk(cells, (0, 0, 2000, 2000), scale=1e-4)
    spread = cg.footprint_density(people, 150.0, outside=10.0)
    assert spread.greatest < people.greatest
    problem = cg.Problem((100, 1000), (1900, 1000), cg.RiskField(rasters=[spread]), 20.0, bounds=(0, 0, 2000, 2000))
    found = cg.solve(problem, "hybrid", tolerance=0.02)
    assert found.lower_bound <= found.cost
    straight = problem.evaluate([(100, 1000), (1900, 1000)])
    assert found.lower_bound <= straight.cost
