"""
Any problem through every solver: the process lives, and every status is true.

``CGLA_PROBLEMS=1000 pytest tests/test_random_problems.py`` takes more of them. A failure names its problem by a number.
"""

import math
import os
from collections.abc import Callable, Iterator
from functools import partial
from typing import Any

import numpy as np
import pytest
import quick_solvers
import shapely

import cgla_graph as cg
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import NO_RASTERS, is_blind_to
from cgla_graph.solvers import registry

#: How many problems.
NUMBER = int(os.environ.get("CGLA_PROBLEMS", "20"))
#: Small budgets: some solvers find nothing, which is to be said.
QUICK: dict[str, dict[str, Any]] = quick_solvers.QUICK | {
    "evolutionary": {"generations": 5},
    "q-learning": {"episodes": 30},
    "hybrid": {"points": 2000, "tolerance": None},
    "fast-marching": {"cells": 40},
}
RESOLUTION = 7
WALL = shapely.box(0.45, 0.1, 0.55, 0.9)
RING = shapely.box(0.6, 0.6, 0.95, 0.95).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
#: Statuses where there is no path, or none was found.
NOTHING = {Status.NO_PATH, Status.NOT_FOUND, Status.STUCK}

Rng = np.random.Generator


def anywhere(rng: Rng) -> cg.Problem:
    """Draw threats and ends around one area."""
    return cg.Problem(*ends(rng, WALL), field(rng), k=weight(rng), no_fly=WALL)


def free(rng: Rng) -> cg.Problem:
    """Leave out the area, sometimes the threats as well."""
    return cg.Problem(*ends(rng), field(rng, most=2), k=weight(rng))


def close(rng: Rng) -> cg.Problem:
    """Put start and goal very close together."""
    start, far = ends(rng, WALL)
    apart = 10.0 ** rng.uniform(-12.0, -2.0)
    goal = tuple(a + apart * (b - a) for a, b in zip(start, far, strict=True))
    return cg.Problem(start, goal, field(rng), k=weight(rng), no_fly=[None, WALL][outside(goal, WALL)])  # type: ignore[arg-type]


def crowded(rng: Rng) -> cg.Problem:
    """Pile many threats up."""
    at = rng.random((3, 2))
    threats = [
        cg.Threat(*at[rng.integers(3)].tolist(), spread=10.0 ** rng.uniform(-2.0, -0.5), peak=rng.choice([1.0, 0.3]))
        for _ in range(int(rng.integers(10, 40)))
    ]
    return cg.Problem(*ends(rng, WALL), cg.RiskField(threats), k=weight(rng), no_fly=WALL)


def on_the_edge(rng: Rng) -> cg.Problem:
    """Put start and goal on boundaries: of the area, of the map, in corners."""
    places = [(0.45, 0.5), (0.55, 0.5), (0.45, 0.1), (0.55, 0.9), (0.5, 0.1), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    first, second = rng.choice(len(places), 2, replace=False)
    return cg.Problem(places[first], places[second], field(rng), k=weight(rng), no_fly=WALL)


def walled_in(rng: Rng) -> cg.Problem:
    """Put the goal where no path leads."""
    start = ends(rng, shapely.box(0.6, 0.6, 0.95, 0.95))[0]
    return cg.Problem(start, (0.8, 0.8), field(rng), k=weight(rng), no_fly=RING)


def many_areas(rng: Rng) -> cg.Problem:
    """Draw boxes and triangles that touch and overlap, and gaps in between."""
    corners = rng.integers(0, 11, (int(rng.integers(2, 8)), 3, 2)) / 10.0
    shapes = [shapely.MultiPoint(three).convex_hull for three in corners]
    area = shapely.union_all([shape for shape in shapes if shape.area > 0.0] or [WALL])
    try:
        return cg.Problem(*ends(rng, area), field(rng), k=weight(rng), no_fly=area)
    except LookupError:
        return anywhere(rng)


def far_away(rng: Rng) -> cg.Problem:
    """Scale the unit square and move it far from the origin."""
    size, east, north = 10.0 ** rng.uniform(-3.0, 6.0), *rng.uniform(-1e6, 1e6, 2).tolist()
    at = partial(np.add, (east, north))
    start, goal = (tuple(at(np.multiply(size, end)).tolist()) for end in ends(rng, WALL))
    threats = [
        cg.Threat(east + size * t.x, north + size * t.y, spread=size * t.spread, peak=t.peak)
        for t in field(rng).threats
    ]
    area = shapely.transform(WALL, lambda corners: at(size * corners))
    bounds = (east, north, east + size, north + size)
    return cg.Problem(start, goal, cg.RiskField(threats), k=weight(rng), no_fly=area, bounds=bounds)  # type: ignore[arg-type]


def over_a_raster(rng: Rng) -> cg.Problem:
    """Put threats and an area on a raster of any coarseness, whose cells differ a millionfold."""
    shape = rng.integers(1, [3, 60][int(rng.integers(2))], 2)
    values = 10.0 ** rng.uniform(-4.0, 2.0, shape) * (rng.random(shape) < rng.choice([0.3, 1.0]))
    low, high = rng.uniform(-0.3, 0.3, 2), rng.uniform(0.5, 1.3, 2)
    bounds = (0.0, 0.0, 1.0, 1.0) if rng.random() < 0.5 else (*low.tolist(), *high.tolist())
    raster = cg.RasterRisk(values, bounds, interpolation=["nearest", "bilinear"][int(rng.integers(2))])  # type: ignore[arg-type]
    with_raster = cg.RiskField(field(rng, most=2).threats, rasters=[raster])
    return cg.Problem(*ends(rng, WALL), with_raster, k=weight(rng), no_fly=[None, WALL][int(rng.integers(2))])


KINDS: list[Callable[[Rng], cg.Problem]] = [
    *(anywhere, free, close, crowded, on_the_edge, walled_in, many_areas, far_away, over_a_raster)
]


def outside(point: tuple[float, ...], area: shapely.Geometry) -> bool:
    return not shapely.contains_xy(area, *point)


def ends(rng: Rng, area: shapely.Geometry | None = None) -> tuple[tuple[float, float], tuple[float, float]]:
    """Draw two places outside of an area."""
    places = [
        tuple(place)
        for place in rng.random((200, 2)).tolist()
        if area is None or not shapely.intersects_xy(area, *place)
    ]
    if len(places) < 2:
        msg = "hardly a free place"
        raise LookupError(msg)
    return places[0], places[1]


def field(rng: Rng, most: int = 4) -> cg.RiskField:
    """Draw none to a few threats."""
    rows = rng.random((int(rng.integers(0, most + 1)), 4)).tolist()
    return cg.RiskField([cg.Threat(x, y, spread=10.0 ** (-2.2 + 1.9 * s), peak=max(0.01, p)) for x, y, s, p in rows])


def weight(rng: Rng) -> float:
    """Draw a risk weight: none, usual, enormous."""
    return float(rng.choice([0.0, 1.0, rng.uniform(0.0, 50.0), 10.0 ** rng.uniform(-3.0, 4.0), 1e4]))


def problem_of(number: int) -> cg.Problem:
    """Make the problem of a number."""
    return KINDS[number % len(KINDS)](np.random.default_rng(number))


def answers(number: int) -> Iterator[tuple[str, Solution]]:
    """Solve a problem with every solver."""
    problem = problem_of(number)
    for name in registry.names():
        settings = dict(QUICK.get(name, {}))
        if registry.traits(name).seeded:
            settings["seed"] = 1 + number % 99
        yield name, cg.solve(problem, name, resolution=RESOLUTION, **settings)


def faults(problem: cg.Problem, found: dict[str, Solution]) -> Iterator[str]:
    """Name the faults of the answers to one problem."""
    reached = [name for name, answer in found.items() if answer.status.has_path]
    bound = max((answer.lower_bound for answer in found.values() if answer.lower_bound > 0.0), default=0.0)
    for name, answer in found.items():
        if answer.solver != name:
            yield f"{name}: calls itself {answer.solver}"
        if answer.status.has_path:
            yield from (f"{name}: {fault}" for fault in faults_of_path(problem, answer, bound))
        elif not is_blind_to(problem, registry.traits(name)):
            yield from (f"{name}: {fault}" for fault in faults_without_path(name, answer))
        if is_blind_to(problem, registry.traits(name)) and answer.message != NO_RASTERS:
            yield f"{name}: {answer.status.label}, though it sees no rasters"
        if name == "visibility-graph" and answer.status is Status.NO_PATH and reached:
            yield f"{name}: says that there is no path, and {', '.join(reached)} found one"
    exact = [answer for name, answer in found.items() if registry.traits(name).exact]
    if len({answer.status for answer in exact}) > 1:
        yield f"exact solvers disagree: {', '.join(answer.status.label for answer in exact)}"
    optima = [answer.cost for answer in exact if answer.status.has_path]
    if optima and not max(optima) <= min(optima) * (1.0 + 1e-9):
        yield f"optima of one lattice differ: {sorted(optima)}"


def faults_without_path(name: str, answer: Solution) -> Iterator[str]:
    """Name the faults of an answer that has no path."""
    status = answer.status
    if not (status in NOTHING or (status is Status.INFEASIBLE and not registry.traits(name).no_fly)):
        yield f"{status.label}: {answer.message}"
    if status in {Status.NOT_FOUND, Status.STUCK} and not answer.message:
        yield f"does not say why it is {status.label}"
    if status in NOTHING and not math.isinf(answer.cost):
        yield f"a cost of {answer.cost} without a path"


def faults_of_path(problem: cg.Problem, answer: Solution, bound: float) -> Iterator[str]:
    """Name the faults of a path."""
    judged = problem.evaluate(answer.path)
    if judged.violations:
        yield f"{answer.status.label}, but {'; '.join(judged.violations)}"
    ends_of_path = tuple(answer.path[0].tolist()), tuple(answer.path[-1].tolist())
    if ends_of_path != (problem.start, problem.goal):
        yield f"joins {ends_of_path}, not {problem.start} and {problem.goal}"
    if not math.isclose(judged.cost, answer.cost, rel_tol=1e-9, abs_tol=1e-12):
        yield f"says a cost of {answer.cost}, which is {judged.cost}"
    if not answer.cost >= bound * (1.0 - 1e-9):
        yield f"costs {answer.cost}, but nothing should cost less than {bound}"
    costs = [moment.cost for moment in answer.trace]
    if costs != sorted(costs, reverse=True) or (costs and not math.isclose(costs[-1], answer.cost, rel_tol=1e-6)):
        yield f"its trace {costs} does not fall to {answer.cost}"


@pytest.mark.slow
@pytest.mark.parametrize("number", range(NUMBER))
@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.SmallSpreadWarning")
def test_every_status_is_true(number: int) -> None:
    assert list(faults(problem_of(number), dict(answers(number)))) == []


def test_what_is_false_is_seen() -> None:
    problem = problem_of(KINDS.index(walled_in))
    path = np.array([problem.start, problem.goal])
    lie = Solution(Status.FOUND, path=path, cost=1.0, solver="cgla")
    said = list(faults(problem, {"cgla": lie, "dijkstra": Solution(Status.CRASHED, solver="dijkstra")}))
    assert [fault.split(":")[0] for fault in said] == ["cgla", "cgla", "dijkstra", "exact solvers disagree"]
