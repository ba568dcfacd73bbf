"""
Speed, as ratios measured in one run: ``make bench``. Skipped by default, as no test may depend on the clock.

Each benchmark runs ours and the reference in turn and prints how many times faster ours is (median over the rounds).
"""

import statistics
import time
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor

import networkx as nx
import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from scipy.integrate import quad
from scipy.sparse.csgraph import dijkstra

import cgla_graph as cg
from cgla_graph._threads import n_cores
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario

PAPER = load_scenario("paper").problem.field
EIGHT = cg.RiskField(PAPER.threats[:8])
UNIT = (0.0, 0.0, 1.0, 1.0)


def seconds(run: Callable[[], object], calls: int) -> float:
    """Time some calls in a row, as a loop over queries would make them; return the seconds of one."""
    began = time.perf_counter()
    for _ in range(calls):
        run()
    return (time.perf_counter() - began) / calls


def times_faster(name: str, ours: Callable[[], object], other: Callable[[], object], rounds: int = 7) -> float:
    """Run both in turn, warm, and return the ratio of their medians; short calls are repeated until 20 ms pass."""
    calls = [max(1, round(0.02 / max(seconds(run, 2), 1e-9))) for run in (ours, other)]
    times = [(seconds(ours, calls[0]), seconds(other, calls[1])) for _ in range(rounds)]
    mine, theirs = (statistics.median(column) for column in zip(*times, strict=True))
    print(f"\n{name}: {mine * 1e3:.3f} ms against {theirs * 1e3:.3f} ms, {theirs / mine:.1f} times faster")
    return theirs / mine


def report(
    benchmark: BenchmarkFixture,
    name: str,
    ours: Callable[[], object],
    other: Callable[[], object],
    rounds: int = 7,
) -> float:
    """Print and return how many times faster ours is, and enter it into the benchmark's table."""
    ratio = times_faster(name, ours, other, rounds)
    benchmark.extra_info["times faster"] = round(ratio, 1)
    benchmark.pedantic(ours, rounds=rounds)
    return ratio


def pairs(side: int) -> tuple[np.ndarray, np.ndarray]:
    """All pairs of nodes of a lattice."""
    points = cg.Lattice(side, bounds=UNIT).points
    i, j = np.triu_indices(len(points), 1)
    return points[i], points[j]


def numpy_rule(starts: np.ndarray, ends: np.ndarray, field: cg.RiskField, block: int) -> np.ndarray:
    """Integrate with 64 Gauss-Legendre points, vectorised over blocks of edges."""
    nodes, weights = np.polynomial.legendre.leggauss(64)
    nodes, weights = 0.5 * (nodes + 1.0), 0.5 * weights
    out = np.empty(len(starts))
    for first in range(0, len(starts), block):
        a, step = starts[first : first + block], (ends - starts)[first : first + block]
        x, y = (a[:, axis, None] + step[:, axis, None] * nodes for axis in range(2))
        clear = np.ones_like(x)
        for threat in field.threats:
            d2 = (x - threat.x) ** 2 + (y - threat.y) ** 2
            clear *= 1.0 - threat.peak * np.exp(-d2 / (2.0 * threat.spread**2))
        out[first : first + block] = np.hypot(*step.T) * ((1.0 - clear) @ weights)
    return out


def weigh(side: int, field: cg.RiskField = EIGHT) -> np.ndarray:
    """Weigh the complete lattice."""
    return cg.GeometricGraph.complete(cg.Lattice(side, bounds=UNIT), field, k=10.0).weight_matrix()


def test_complete_20_against_quad(benchmark: BenchmarkFixture) -> None:
    """Eq. 5 for 79 800 edges against `scipy.integrate.quad` edge by edge (a sample of 200, scaled)."""
    starts, ends = pairs(20)
    sample = np.random.default_rng(0).choice(len(starts), 200, replace=False)
    threats = [(t.x, t.y, t.spread, t.peak) for t in EIGHT.threats]

    def risk(s: float, p: np.ndarray, d: np.ndarray) -> float:
        clear = 1.0
        for x, y, spread, peak in threats:
            d2 = (p[0] + s * d[0] - x) ** 2 + (p[1] + s * d[1] - y) ** 2
            clear *= 1.0 - peak * np.exp(-d2 / (2.0 * spread**2))
        return 1.0 - clear

    def reference() -> None:
        for i in sample:
            quad(risk, 0.0, 1.0, args=(starts[i], ends[i] - starts[i]), epsabs=1e-10, limit=200)

    ratio = report(benchmark, "Eq. 5, 20 x 20, against 200 quad edges", lambda: weigh(20), reference, rounds=5)
    scaled = ratio * len(starts) / len(sample)
    print(f"scaled to all edges: {scaled:.0f} times faster")
    assert scaled >= 200


@pytest.mark.parametrize(
    ("block", "target"), [(79_800, 10), (2000, None)], ids=["whole arrays", "blocks that fit the cache"]
)
def test_complete_20_against_numpy(benchmark: BenchmarkFixture, block: int, target: int | None) -> None:
    """Eq. 5 for the same edges by a vectorised 64-point rule, as one writes it and as one tunes it."""
    starts, ends = pairs(20)
    ratio = report(
        benchmark,
        f"Eq. 5, 20 x 20, against NumPy in blocks of {block}",
        lambda: weigh(20),
        lambda: numpy_rule(starts, ends, EIGHT, block),
    )
    assert target is None or ratio >= target


def a_tenth_on_threads(field: cg.RiskField) -> Callable[[], object]:
    """Prepare the tuned NumPy rule for every tenth pair of 50 x 50, on as many threads as ours."""
    starts, ends = (points[::10] for points in pairs(50))
    step = n_cores()

    def run() -> None:
        with ThreadPoolExecutor(step) as pool:
            list(pool.map(lambda i: numpy_rule(starts[i::step], ends[i::step], field, 2000), range(step)))

    return run


@pytest.mark.parametrize(
    ("field", "target"),
    [(EIGHT, None), (random_scenario(0, threats=30).problem.field, 10)],
    ids=["8 threats", "30 threats"],
)
def test_complete_50(benchmark: BenchmarkFixture, field: cg.RiskField, target: int | None) -> None:
    """Eq. 5 for the complete 50 x 50 lattice against the tuned NumPy rule (a tenth of it, scaled)."""
    name = f"Eq. 5, 50 x 50, {len(field.threats)} threats, against a tenth of it by NumPy"
    ratio = report(benchmark, name, lambda: weigh(50, field), a_tenth_on_threads(field), rounds=3)
    print(f"scaled to all edges: {10.0 * ratio:.1f} times faster")
    assert target is None or 10.0 * ratio >= target


def test_cgla_against_scipy(benchmark: BenchmarkFixture) -> None:
    """Label setting against scipy's Dijkstra on the same dense matrix."""
    graph = cg.GeometricGraph.complete(cg.Lattice(50, bounds=UNIT), EIGHT, k=10.0).with_weights_held()
    matrix = graph.weight_matrix()
    ratio = report(
        benchmark,
        "cost matrix, 50 x 50, against scipy on the dense matrix",
        lambda: cg.cost_matrix(graph, 2499),
        lambda: dijkstra(matrix, indices=2499),
    )
    assert ratio >= 5
    csr = graph.to_csgraph()
    times_faster(
        "the same, against scipy on a ready sparse matrix",
        lambda: cg.cost_matrix(graph, 2499),
        lambda: dijkstra(csr, indices=2499),
    )


def test_cgla_against_networkx(benchmark: BenchmarkFixture) -> None:
    """Label setting against networkx's Dijkstra, graph given."""
    graph = cg.GeometricGraph.complete(cg.Lattice(20, bounds=UNIT), EIGHT, k=10.0).with_weights_held()
    other = graph.to_networkx()
    ratio = report(
        benchmark,
        "cost matrix, 20 x 20, against networkx",
        lambda: cg.cost_matrix(graph, 399),
        lambda: nx.single_source_dijkstra(other, 399),
    )
    assert ratio >= 100


def test_thousand_segments(benchmark: BenchmarkFixture) -> None:
    """One thousand segments in one call, on the paper's ten threats, against the tuned NumPy rule."""
    starts, ends = np.random.default_rng(1).random((2, 1000, 2))
    model = cg.CostModel(PAPER, 10.0)
    report(
        benchmark,
        "1000 segments, against NumPy",
        lambda: model.weights(starts, ends),
        lambda: numpy_rule(starts, ends, PAPER, 1000),
        rounds=30,
    )
