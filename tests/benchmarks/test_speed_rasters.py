"""Speed on rasters: ``make bench`` prints crossings a second, weights of a lattice, and gaps and times of proofs."""

import time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from scipy import ndimage

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.refine.refine import refine_path

ROWS, COLUMNS = 519, 431


def field_of(values: FloatArray, interpolation: str, scale: float = 1.0) -> cg.RiskField:
    rows, columns = values.shape
    bounds = (0.0, 0.0, float(columns), float(rows))
    return cg.RiskField(rasters=[cg.RasterRisk(values, bounds, interpolation=interpolation, scale=scale)])  # type: ignore[arg-type]


def towns(seed: int) -> FloatArray:
    """Draw a map with the tail of a population: a few crowded places, wide suburbs, much empty land."""
    noise = ndimage.gaussian_filter(np.random.default_rng(seed).standard_normal((ROWS, COLUMNS)), 12, mode="nearest")
    return np.asarray(np.exp(2.5 * noise / noise.std()))


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_crossings_a_second(benchmark: BenchmarkFixture, interpolation: str) -> None:
    field = field_of(np.random.default_rng(1).random((ROWS, COLUMNS)), interpolation)
    starts, ends = np.random.default_rng(2).uniform(0.0, COLUMNS, (2, 20_000, 2))
    field.line_integral(starts[:10], ends[:10])
    benchmark.pedantic(lambda: field.line_integral(starts, ends), rounds=5)
    crossings = float(np.abs(starts - ends).sum())
    rate = crossings / benchmark.stats.stats.min  # type: ignore[union-attr]
    print(f"\n{interpolation}: {rate / 1e6:.0f} million crossings of cells a second, on one core")
    assert rate >= 10e6


def test_all_weights_of_a_lattice(benchmark: BenchmarkFixture) -> None:
    """Eq. 5 on the complete lattice of 20 x 20 points over 519 x 431 cells."""
    problem = cg.Problem((1, 1), (400, 500), field_of(towns(1), "bilinear"), k=1.0, bounds=(0, 0, COLUMNS, ROWS))
    on = problem.on_lattice(20)
    on.with_weights_held()
    benchmark.pedantic(on.with_weights_held, rounds=5)


@pytest.mark.parametrize("interpolation", ["bilinear", "nearest"])
def test_gap_against_time(benchmark: BenchmarkFixture, interpolation: str) -> None:
    """What `hybrid` proves on towns, blocks and white noise, and how long that takes."""
    rng = np.random.default_rng(1)
    kinds = {
        "towns, 519 x 431": towns(1),
        "blocks, 200 x 200": np.kron(rng.random((20, 20)), np.ones((10, 10))),
        "white noise, 200 x 200": rng.random((200, 200)),
    }
    print(f"\n{interpolation}: gap, seconds for the path, for the proof")
    for name, values in kinds.items():
        rows, columns = values.shape
        problem = cg.Problem(
            (0.1 * columns, 0.1 * rows),
            (0.9 * columns, 0.8 * rows),
            field_of(values / np.median(values), interpolation),
            k=1.0,
            bounds=(0, 0, columns, rows),
        )
        began = time.perf_counter()
        found = cg.solve(problem, "hybrid", tolerance=0.005)
        whole = time.perf_counter() - began
        print(f"{name:24} {100.0 * found.gap:6.2f} % {whole - found.certificate_seconds:6.1f} s {whole:6.1f} s")
        benchmark.extra_info[name] = round(100.0 * found.gap, 2)
    benchmark.pedantic(lambda: problem.evaluate([problem.start, problem.goal]), rounds=3)


@pytest.mark.parametrize("interpolation", ["nearest", "bilinear"])
def test_a_route_over_cells_that_is_refined(benchmark: BenchmarkFixture, interpolation: str) -> None:
    """The route of scikit-image over a rough raster, refined, is never cheaper than the path of `hybrid`."""
    graph = pytest.importorskip("skimage.graph")
    rng = np.random.default_rng(4)
    kinds = {
        "white noise": rng.random((ROWS, COLUMNS)),
        "heavy tail": np.minimum(rng.pareto(1.3, (ROWS, COLUMNS)), 300.0),
    }
    print(f"\n{interpolation}: the route's cost over hybrid's, seconds of the route, of hybrid")
    for name, values in kinds.items():
        bounds = (0, 0, COLUMNS, ROWS)
        problem = cg.Problem((20.3, 30.4), (400.2, 480.1), field_of(values, interpolation), k=10.0, bounds=bounds)
        problem.evaluate([problem.start, problem.goal])
        began = time.process_time()
        first, last = ((int(y), int(x)) for x, y in (problem.start, problem.goal))
        nodes, _ = graph.route_through_array(1.0 + problem.k * problem.field.rasters[0].cells, first, last)
        path = np.vstack([problem.start, np.array(nodes)[:, ::-1] + 0.5, problem.goal])
        theirs = refine_path(problem, path).cost
        middle = time.process_time()
        ours = cg.solve(problem, tolerance=None).cost
        seconds = middle - began, time.process_time() - middle
        print(f"{name:12} {theirs / ours:8.4f} {seconds[0]:6.2f} s {seconds[1]:6.2f} s")
        benchmark.extra_info[name] = round(theirs / ours, 4), round(seconds[1] / seconds[0], 2)
        assert ours <= theirs
    benchmark.pedantic(lambda: cg.solve(problem, tolerance=None), rounds=1)
