"""Bounds of all paths through each place, under weights between others, against the costs of paths."""

import dataclasses
import math

import numpy as np
import pytest
from random_problems import places, random_map

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.eikonal import cell_runs
from cgla_graph.regions.arrangement import has_cells
from cgla_graph.solvers.trade_off.place_bounds import PlaceBounds

PAPER = cg.load_scenario("paper").problem


def laid(problem: cg.Problem, weights: list[float]) -> PlaceBounds:
    """Solve for the bounds under some weights."""
    bounds = PlaceBounds(problem)
    for k in weights:
        best = cg.solve(dataclasses.replace(problem, k=k), tolerance=None)
        assert bounds.lay(k, best.path, best.cost, 10**6)
    return bounds


def passed(problem: cg.Problem, bounds: PlaceBounds, path: FloatArray) -> FloatArray:
    """Return rows and columns of the cells that a path passes, away from their borders."""
    along = np.vstack([path[:-1] + t * np.diff(path, axis=0) for t in np.linspace(0.0, 1.0, 40)])
    low, high = np.reshape(problem.bounds, (2, 2))
    cells = (along - low) / (high - low) * np.array(bounds.last)
    inside = (np.abs(cells - np.round(cells)) < 0.499).all(axis=1)
    return np.round(cells[inside]).astype(int).T[::-1]


@pytest.mark.parametrize("number", [0, 5, *(pytest.param(n, marks=pytest.mark.slow) for n in (1, 2))])
def test_no_path_through_a_place_costs_less_than_its_bound(number: int) -> None:
    random = np.random.default_rng([31, number])
    problem = PAPER if number == 0 else random_map(random)
    while has_cells(problem):
        problem = random_map(random)
    bounds = laid(problem, [2.0, 30.0])
    for k in (0.0, 0.5, 2.0, 9.0, 30.0, 400.0):
        weighted, least = dataclasses.replace(problem, k=k), bounds.at(k)
        paths = [cg.solve(weighted, tolerance=None).path]
        for via in places(problem, 4, random).tolist():
            halves = [
                cg.solve(dataclasses.replace(weighted, start=a, goal=b), "cgla", resolution=9, refine=True).path
                for a, b in ((problem.start, tuple(via)), (tuple(via), problem.goal))
            ]
            paths += [np.vstack([halves[0], halves[1][1:]])] if all(map(len, halves)) else []
        for path in paths:
            cost = weighted.evaluate(path).cost
            assert (least[*passed(problem, bounds, path)] <= cost * (1.0 + 1e-12)).all()


@pytest.mark.parametrize("is_chord", [True, False])
def test_bounds_between_weights_are_chords(is_chord: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    # (the broken twin continues the chord of the last two weights)
    bounds = laid(PAPER, [2.0, 30.0])
    if not is_chord:
        beyond = bounds.known[30.0] + (bounds.known[30.0] - bounds.known[2.0]) * (200.0 - 30.0) / 28.0
        monkeypatch.setattr(bounds, "at", lambda _: beyond)
    best = cg.solve(dataclasses.replace(PAPER, k=200.0), tolerance=None)
    found = bounds.at(200.0)[*passed(PAPER, bounds, best.path)]
    assert bool((found <= best.cost).all()) is is_chord


def test_tubes_under_weights_between_are_narrow_and_hold_the_best_path() -> None:
    bounds = laid(PAPER, [5.0, 20.0])
    best = cg.solve(dataclasses.replace(PAPER, k=10.0), tolerance=None)
    cells = np.zeros((bounds.last[1] + 1, bounds.last[0] + 1), dtype=np.bool_)
    columns, rows = cell_runs.cells_of(bounds.cells(10.0, math.nextafter(best.cost, math.inf)))
    cells[rows, columns] = True
    assert cells[*passed(PAPER, bounds, best.path)].all()
    assert cells.mean() < 0.2
