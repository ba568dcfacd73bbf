"""Promises of all solvers beside their contract: size of the map, seeds, walls, missions."""

import functools
from typing import Any

import numpy as np
import pytest
import shapely
from quick_solvers import RING, quick

import cgla_graph as cg
from cgla_graph._types import Point
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import registry

NOTHING = {Status.NO_PATH, Status.NOT_FOUND, Status.STUCK}

FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.3, 0.7, 0.05)])
GUARDED = cg.Problem((0.1, 0.1), (0.9, 0.9), FIELD, k=10.0)
names = pytest.mark.parametrize("name", registry.names())
#: They promise less, and find a way here.
FLYING = {"evolutionary", "voronoi", "milp", "q-learning", "fbcri-style", "cpvs-style"} & set(registry.names())
COMPLETE = [name for name in registry.names() if registry.traits(name).complete]
complete = pytest.mark.parametrize("name", COMPLETE)
seeded = pytest.mark.parametrize("name", [n for n in registry.names() if registry.traits(n).seeded])


def drawn(problem: cg.Problem, scale: float, shift: float) -> cg.Problem:
    """Draw a map larger, and elsewhere."""
    x_min, y_min, x_max, y_max = (scale * side + shift for side in problem.bounds)
    threats = [
        cg.Threat(scale * t.x + shift, scale * t.y + shift, scale * t.spread, t.peak) for t in problem.field.threats
    ]
    ends: Any = (tuple(scale * at + shift for at in end) for end in (problem.start, problem.goal))
    no_fly = None if problem.no_fly is None else shapely.transform(problem.no_fly, lambda xy: scale * xy + shift)
    return cg.Problem(*ends, cg.RiskField(threats), problem.k, (x_min, y_min, x_max, y_max), no_fly)


@pytest.mark.parametrize(
    ("scale", "shift", "seeds"),
    [pytest.param(1024.0, 0.0, (0, 1), marks=pytest.mark.slow), (0.25, 0.0, (1,)), (8.0, 4.0, (1,))],
)
@names
def test_a_map_drawn_larger_elsewhere_gives_the_same_path_there(
    name: str, scale: float, shift: float, seeds: tuple[int, ...]
) -> None:
    for seed in seeds:
        problem = random_scenario(seed, threats=4, areas=2 * seed).problem
        one, other = (cg.solve(p, quick(name), resolution=8) for p in (problem, drawn(problem, scale, shift)))
        assert one.status is other.status
        if one.status.has_path:
            near = {"rel": 1e-9 if shift == 0.0 else 1e-3}
            assert other.cost == pytest.approx(scale * one.cost, **near)


@seeded
def test_another_seed_gives_another_answer(name: str) -> None:
    answers = [quick(name, seed=seed).solve(GUARDED) for seed in (1, 2)]
    assert answers[0].path.tolist() != answers[1].path.tolist() or answers[0].message != answers[1].message


@pytest.mark.parametrize("ends", [((0.1, 0.1), (0.8, 0.8)), ((0.8, 0.8), (0.1, 0.1))])
@names
def test_a_start_or_goal_that_is_walled_in_is_not_left_or_reached(name: str, ends: tuple[Point, Point]) -> None:
    answer = cg.solve(cg.Problem(*ends, no_fly=RING), quick(name), resolution=12)
    assert answer.status in NOTHING or (answer.status is Status.INFEASIBLE and not registry.traits(name).no_fly)
    assert answer.message or answer.status is Status.NO_PATH
    assert not answer.status.has_path


@functools.cache
def proven_bound() -> float:
    return cg.lower_bound(GUARDED, 0.05).lower_bound


@names
def test_no_path_beats_the_certificate(name: str) -> None:
    for seed in (1, 2, 3) if registry.traits(name).seeded else (None,):
        solver = quick(name, times=2, **({} if seed is None else {"seed": seed}))
        assert cg.solve(GUARDED, solver).cost >= proven_bound() > 1.2


@complete
def test_no_wall_is_too_thin(name: str) -> None:
    wall = shapely.box(0.5, 0.1, 0.5 + 1e-9, 1.1)
    answer = cg.solve(cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=wall), quick(name, times=3), resolution=12)
    assert answer.status.has_path == registry.traits(name).no_fly
    assert not answer.status.has_path or answer.cost >= 2 * np.hypot(0.4, 0.6) * (1.0 - 1e-8)


@pytest.mark.slow
@pytest.mark.parametrize("areas", [0, 4])
@pytest.mark.parametrize("name", [*COMPLETE, *sorted(FLYING - {*COMPLETE})])
def test_missions_are_flown(name: str, areas: int) -> None:
    if not registry.traits(name).no_fly and areas:
        pytest.skip("it knows no areas")
    problem = random_scenario(1, areas=areas).problem
    world = cg.World(problem.field, problem.bounds, no_fly=problem.no_fly)
    uav = cg.Uav("a", problem.start, problem.goal, 0.2, k=10.0)
    flown = cg.Mission(world, [uav], quick(name, times=3)).fly().uavs["a"]
    assert flown.status.label == "arrived"
    # a position on the edge of an area is rounded to one side or the other
    inside = shapely.LineString(flown.path).intersection(problem.model.area.geometry)
    assert inside.difference(problem.model.area.geometry.boundary.buffer(1e-9)).is_empty
