"""Speed of the graph libraries on one dense matrix, handed over in the fastest way of each: ``make bench``."""

import statistics

import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from test_speed import EIGHT, UNIT

import cgla_graph as cg
from cgla_graph.solvers import registry

#: Solvers, and points a side: networkx takes no larger graph.
LIBRARIES = {"dijkstra": 50, "networkit": 50, "igraph": 50, "rustworkx": 50, "networkx": 30}
ROUNDS = 5


@pytest.mark.parametrize("side", [50, 30])
def test_cgla_against_graph_libraries(benchmark: BenchmarkFixture, side: int) -> None:
    """From corner to corner of a complete lattice whose weights are ready: to search, and to hand over and search."""
    graph = cg.GeometricGraph.complete(cg.Lattice(side, bounds=UNIT), EIGHT, k=10.0).with_weights_held()
    problem = cg.GraphProblem(graph, 0, side * side - 1)

    def times(name: str) -> tuple[float, float, float]:
        answers = [cg.solve(problem, name) for _ in range(ROUNDS)]
        searching = statistics.median(answer.seconds for answer in answers)
        return answers[0].cost, searching, searching + statistics.median(answer.build_seconds for answer in answers)

    cost, ours, _ = times("cgla")
    print(f"\n{side} x {side}, {graph.n_edges / 1e6:.1f} million edges; cgla {ours * 1e3:.1f} ms")
    for name, largest in LIBRARIES.items():
        if side > largest or registry.missing(name) is not None:
            continue
        theirs, searching, both = times(name)
        assert theirs == pytest.approx(cost, rel=1e-12)
        benchmark.extra_info[name] = (round(searching / ours, 1), round(both / ours, 1))
        print(
            f"{name:>10}: search {searching * 1e3:7.1f} ms, {searching / ours:5.1f} times as long;"
            f" with building {both * 1e3:7.1f} ms, {both / ours:5.1f} times"
        )
    benchmark.pedantic(lambda: cg.solve(problem, "cgla"), rounds=ROUNDS)
