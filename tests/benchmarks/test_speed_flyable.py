"""Flyable paths against RRT* in OMPL's Dubins space, in one run: ``make bench`` prints costs and times."""

import time

import numpy as np
import pytest
from pytest_benchmark.fixture import BenchmarkFixture

import cgla_graph as cg
from cgla_graph.scenarios.scenario import load_scenario

#: RRT* has so many times as long.
TIMES = 20.0


@pytest.mark.ompl
@pytest.mark.parametrize(("name", "share"), [("paper", 0.1), ("maze", 0.1), ("thin-wall", 0.03)])
def test_flyable_against_rrt_star(benchmark: BenchmarkFixture, name: str, share: float) -> None:
    """The cost of a flyable path is one that RRT* does not reach in twenty times the time, told the headings."""
    peer = pytest.importorskip("dubins_rrt_star")
    problem = load_scenario(name).problem
    solution = cg.solve(problem)
    radius = share * problem.shorter_side
    solution.flyable(radius)
    began = time.perf_counter()
    found = solution.flyable(radius)
    mine = time.perf_counter() - began
    last = len(found.curve.pieces) - 1
    yaws = found.curve.headings(np.array([0, last]), np.array([0.0, 1.0])).tolist()
    ends = (*problem.start, yaws[0]), (*problem.goal, yaws[1])
    peer.rrt_star(problem, radius, *ends, 0.1)
    other = peer.rrt_star(problem, radius, *ends, TIMES * mine)
    print(f"\n{name}, radius {share:.0%}: {found.cost:.5g} in {mine:.2f} s; RRT* {other:.5g} in {TIMES * mine:.1f} s")
    benchmark.extra_info["cost of RRT*, relative"] = round(other / found.cost, 4)
    benchmark.pedantic(lambda: solution.flyable(radius), rounds=3)
    assert found.cost <= other
