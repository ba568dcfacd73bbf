"""Speed of the restricted cost matrix by the size of the lattice: ``make bench`` prints what is kept and weighed."""

import resource
import statistics
import time

import pytest
from pytest_benchmark.fixture import BenchmarkFixture

from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.cost_model import MapKind
from cgla_graph.restricted.restricted import load_kernels, restricted_optimum
from cgla_graph.scenarios.scenario import load_scenario


@pytest.mark.parametrize("name", ["paper", "fifty-threats", "finland"])
def test_restricted_by_size(benchmark: BenchmarkFixture, name: str) -> None:
    """Seconds, kept nodes and weighed edges for N = 50 to 800, each the median of three runs; what doubling N costs."""
    problem = load_scenario(name).problem
    load_kernels(MapKind())
    before = None
    print(f"\n{name}: N, edges, seconds, times as long as for N / 2, nodes kept, edges weighed")
    for side in (50, 100, 200, 400, 800):
        times = []
        for _ in range(3):
            began = time.perf_counter()
            on = problem.on_lattice(side)
            found = restricted_optimum(on)
            times.append(time.perf_counter() - began)
        assert found is not None
        mine = statistics.median(times)
        grown = "" if before is None else f"{mine / before:.1f}"
        weighed = found.counts["integrated"]
        print(f"{side:5} {on.graph.n_pairs:.1e} {mine:8.2f} s {grown:>5} {len(found.kept):7} {weighed:8}")
        before = mine
    print(f"greatest resident memory of all so far: {resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024:.0f} MB")
    benchmark.extra_info["seconds at 800"] = round(mine, 2)
    benchmark.pedantic(lambda: restricted_optimum(problem.on_lattice(100)), rounds=3)


def test_restricted_against_all_weights(benchmark: BenchmarkFixture) -> None:
    """The full matrix and label setting against the restricted one, on 60 x 60 points of the paper's map."""
    problem = load_scenario("paper").problem
    load_kernels(MapKind())
    on = problem.on_lattice(60)
    began = time.perf_counter()
    full = on.with_weights_held().graph
    truth = cost_matrix(full, on.target, source=on.source).value(on.source)
    whole = time.perf_counter() - began
    began = time.perf_counter()
    found = restricted_optimum(on)
    mine = time.perf_counter() - began
    assert found is not None
    assert found.cost == pytest.approx(truth, rel=1e-12)
    print(f"\n60 x 60: {mine:.2f} s against {whole:.2f} s with all weights, {whole / mine:.0f} times faster")
    benchmark.extra_info["times faster"] = round(whole / mine, 1)
    benchmark.pedantic(lambda: restricted_optimum(on), rounds=3)
    assert whole / mine >= 5
