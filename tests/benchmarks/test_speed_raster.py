"""Speed of plans with raster weights, as ratios measured in one run: ``make bench``; see `test_speed`."""

import dataclasses
import statistics

import pytest
from pytest_benchmark.fixture import BenchmarkFixture
from test_speed import PAPER, UNIT
from test_speed_missions import planning_seconds

import cgla_graph as cg
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get


@pytest.mark.parametrize("virtual_obstacle", [None, True], ids=["alone", "with virtual obstacles"])
def test_raster_replans(benchmark: BenchmarkFixture, virtual_obstacle: bool | None) -> None:
    """Plans with raster weights on the paper's map, each searched for, against all weights and label setting."""
    uavs = [cg.Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2, k=20.0), cg.Uav("b", (0.1, 0.25), (0.9, 0.9), 0.2, k=20.0)]
    mission = cg.Mission(
        cg.World(PAPER, bounds=UNIT),
        uavs,
        get("cgla"),
        resolution=Lattice(20, bounds=UNIT, kind="upper"),
        integral="raster",
        virtual_obstacle=virtual_obstacle,
        collisions="record",
        arrival_radius=0.025,
    )
    scratch = dataclasses.replace(mission, incremental=False, max_ticks=15)
    # (what is loaded for the first flight is not charged to either)
    mission.fly()
    scratch.fly()
    ours, theirs = (
        statistics.median(planning_seconds(flight) for flight in flights)
        for flights in zip(*((mission.fly(), scratch.fly()) for _ in range(5)), strict=True)
    )
    ratio = theirs / ours
    print(f"\nraster replans: {ours * 1e3:.1f} ms, {ratio:.0f} times faster than from scratch")
    benchmark.extra_info["times faster a replan"] = round(ratio, 1)
    benchmark.pedantic(mission.fly, rounds=3)
    assert ratio >= 5
