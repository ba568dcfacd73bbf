"""Differences of heights over landmarks against the costs of paths, and the tubes that they leave."""

from dataclasses import replace

import numpy as np
import pytest
from random_problems import places, random_map

import cgla_graph as cg
from cgla_graph import _threads
from cgla_graph.certificate import landmarks
from cgla_graph.certificate.landmarks import Ground
from cgla_graph.eikonal import cell_runs
from cgla_graph.mission.clairvoyance import least_costs_alone
from cgla_graph.mission.world import World

PAPER = cg.load_scenario("paper").problem


@pytest.mark.parametrize("number", [0, 2, 3])
def test_no_path_costs_less_than_a_difference_of_heights(number: int) -> None:
    # (fails if heights are not divided by the greatest slope)
    random = np.random.default_rng([9, number])
    problem = random_map(random) if number else PAPER
    ground = Ground.lay(problem, 96)
    assert ground is not None
    beside = landmarks.around(problem)[:2, None] + random.normal(0.0, 0.01, (2, 2, 2)) * problem.bounds[2]
    beside = beside.reshape(-1, 2)[problem.in_bounds(beside.reshape(-1, 2))]
    points = np.vstack([places(problem, 4, random), beside[~problem.area.contains(beside)]])
    pieces = ground.level.mesh.pieces_at(points)
    for start in points.tolist():
        bounds = ground.landmarks.bounds_from((start[0], start[1]))[pieces]
        for goal, bound in zip(points.tolist(), bounds.tolist(), strict=True):
            if start <= goal:
                continue
            asked = replace(problem, start=tuple(start), goal=tuple(goal))
            assert bound <= cg.solve(asked, "cgla", resolution=9, refine=True).cost * (1.0 + 1e-12)


def test_tubes_are_narrow_and_hold_the_best_path() -> None:
    ground = Ground.lay(PAPER, 96)
    assert ground is not None
    best = cg.solve(PAPER)
    whole, runs = ground.tube(PAPER, best.cost)
    last = whole.mesh.last
    cells = np.zeros((last[1] + 1, last[0] + 1), dtype=np.bool_)
    columns, rows = cell_runs.cells_of(runs)
    cells[rows, columns] = True
    along = np.vstack([best.path[:-1] + t * np.diff(best.path, axis=0) for t in np.linspace(0.0, 1.0, 20)])
    at = np.round((along - PAPER.bounds[:2]) / np.subtract(PAPER.bounds[2:], PAPER.bounds[:2]) * last).astype(int)
    assert cells[at[:, 1], at[:, 0]].all()
    assert cells.mean() < 0.3


def test_flights_of_a_swarm_are_bounded_on_one_grid() -> None:
    starts, goals = (places(PAPER, 8, np.random.default_rng([10, end])).tolist() for end in range(2))
    flights = {str(n): (tuple(a), tuple(b), PAPER.k) for n, (a, b) in enumerate(zip(starts, goals, strict=True))}
    bounds = least_costs_alone(World(PAPER.field, PAPER.bounds), flights, 0.02)
    for name, (start, goal, _) in flights.items():
        best = cg.solve(replace(PAPER, start=start, goal=goal), tolerance=None).cost
        assert best / 1.02 <= bounds[name] <= best * (1.0 + 1e-12)


def test_costs_alone_do_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    starts, goals = (places(PAPER, 10, np.random.default_rng([13, end])).tolist() for end in range(2))
    # (eight with one weight, which share a grid, and two with another)
    flights = {str(n): (tuple(starts[n]), tuple(goals[n]), 10.0 if n < 8 else 3.0) for n in range(10)}
    found = []
    for count in 1, 3:
        monkeypatch.setattr(_threads, "n_cores", lambda count=count: count)
        found.append(least_costs_alone(World(PAPER.field, PAPER.bounds), flights, 0.02))
    assert found[0] == found[1]
    assert list(found[0]) == list(flights)


def test_heights_are_flat_around_their_landmarks() -> None:
    # (paths lead through the block of a landmark, where nothing bounds the slope of its spline)
    ground = Ground.lay(PAPER, 96)
    assert ground is not None
    heights = ground.landmarks
    for at, low, high in zip(
        ground.level.mesh.pieces_at(landmarks.around(PAPER)), heights.low, heights.high, strict=True
    ):
        assert low[at] == low[np.isfinite(low)].min()
        assert high[at] - low[at] < 1e-9
