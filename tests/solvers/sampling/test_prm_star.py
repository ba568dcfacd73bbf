"""PRM*: the optimum of exactly the roadmap that its formula says, which approaches the continuous optimum."""

import math
import os
import subprocess
import sys

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from shapely.geometry.base import BaseGeometry
from strategies import few

import cgla_graph as cg
from cgla_graph._types import Bounds, Point
from cgla_graph.model.solution import Status
from cgla_graph.solvers.budget import Budget
from cgla_graph.solvers.sampling import prm_star
from cgla_graph.solvers.sampling.prm_star import PrmStar, Roadmap
from cgla_graph.testing.strategies import boxes, fields, points, polygons, seeds

FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9), cg.Threat(0.3, 0.7, 0.05)])
PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9), FIELD, k=10.0, no_fly=shapely.box(0.6, 0.2, 0.7, 0.6))
WALL = shapely.box(0.45, 0.0, 0.55, 0.8)
AROUND = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=WALL)
SHORTEST = 2 * math.dist((0.1, 0.1), (0.45, 0.8)) + 0.1


def grown(problem: cg.Problem, sizes: list[int], seed: int = 1, radius_factor: float = 1.1) -> Roadmap:
    roadmap = Roadmap(problem, seed, radius_factor)
    for size in sizes:
        roadmap.grow(Budget(iterations=10**9).start(), size)
    return roadmap


def edges(roadmap: Roadmap) -> set[tuple[int, int]]:
    return {(int(i), int(j)) for tails, heads, _ in roadmap._edges for i, j in zip(tails, heads, strict=True)}


def reference(problem: cg.Problem, positions: list[list[float]], free: float, radius_factor: float) -> "nx.Graph[int]":
    """Join and weigh, pair by pair, with the oracle and the formula of the paper (dimension 2, unit ball pi)."""
    gamma = radius_factor * 2.0 * (1.0 + 1.0 / 2.0) ** 0.5 * (free / math.pi) ** 0.5
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(len(positions)))
    for j in range(len(positions)):
        number = max(j + 1, 3)
        radius = gamma * (math.log(number) / number) ** 0.5
        for i in range(j):
            segment = problem.evaluate([positions[i], positions[j]])
            if math.dist(positions[i], positions[j]) <= radius and segment.feasible:
                graph.add_edge(i, j, weight=segment.cost)
    return graph


@given(
    field=fields(max_threats=3),
    area=polygons(),
    ends=st.tuples(points, points),
    k=st.floats(0.0, 20.0),
    seed=seeds,
    radius_factor=st.sampled_from([0.5, 1.1, 3.0]),
    n=st.integers(2, 30),
)
@few
def test_the_cost_is_the_optimum_of_the_roadmap_that_networkx_finds(
    field: cg.RiskField,
    area: BaseGeometry,
    ends: tuple[Point, Point],
    k: float,
    seed: int,
    radius_factor: float,
    n: int,
) -> None:
    area = shapely.transform(area, lambda corners: corners / 8.0)
    assume(math.dist(*ends) > 1e-9)
    assume(not any(shapely.contains_properly(area, shapely.Point(end)) for end in ends))
    problem = cg.Problem(*ends, field, k=k, no_fly=area)
    answer = PrmStar(milestones=n, seed=seed, radius_factor=radius_factor).solve(problem)
    roadmap = grown(problem, [n], seed, radius_factor)
    positions = roadmap.positions[:n].tolist()
    free = shapely.box(0, 0, 1, 1).difference(area).area
    graph = reference(problem, positions, free, radius_factor)
    assert edges(roadmap) == {(min(edge), max(edge)) for edge in graph.edges}
    if nx.has_path(graph, 0, 1):
        best = nx.dijkstra_path_length(graph, 0, 1)
        assert answer.status is Status.FOUND
        assert answer.cost == pytest.approx(best, rel=1e-9, abs=1e-12)
        assert problem.judge(answer).status is Status.FOUND
    else:
        assert (answer.status, bool(answer.message)) == (Status.NOT_FOUND, True)


@given(sizes=st.lists(st.integers(1, 300), min_size=1, max_size=6).map(sorted), seed=seeds)
@few
def test_it_does_not_matter_in_which_steps_the_roadmap_grows(sizes: list[int], seed: int) -> None:
    stepwise, at_once = grown(PROBLEM, [*sizes, 300], seed), grown(PROBLEM, [300], seed)
    assert np.array_equal(stepwise.positions[:300], at_once.positions[:300])
    assert edges(stepwise) == edges(at_once)
    assert stepwise.best_path()[1] == at_once.best_path()[1]


@pytest.mark.parametrize(("name", "value"), [("CHUNK", 7), ("FIRST_SEARCH", 5), ("FIRST_SEARCH", 10**6)])
def test_the_path_does_not_depend_on_the_searches_in_between(
    name: str, value: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    usual_run = PrmStar(milestones=700).solve(PROBLEM)
    monkeypatch.setattr(prm_star, name, value)
    other = PrmStar(milestones=700).solve(PROBLEM)
    assert np.array_equal(usual_run.path, other.path)
    assert (usual_run.cost, usual_run.evaluations) == (other.cost, other.evaluations)


def test_the_radius_never_rises() -> None:
    # log(i) / i does, from 1 to 3
    radii = grown(PROBLEM, [2]).radius(np.arange(1, 1000))
    assert (np.diff(radii) <= 0.0).all()
    assert radii[999 - 1] == pytest.approx(1.1 * 2 * math.sqrt(1.5 * 0.96 / math.pi * math.log(999) / 999), rel=1e-12)


def test_a_larger_roadmap_holds_the_smaller_one_and_prm_star_proper() -> None:
    small, large = grown(PROBLEM, [200]), grown(PROBLEM, [400])
    assert edges(small) < edges(large)
    # PRM* proper joins all within the last radius
    last = float(large.radius(np.array([400]))[0])
    at = large.positions[:400]
    i, j = np.triu_indices(400, 1)
    near = np.hypot(*(at[i] - at[j]).T) <= last
    passable = np.isfinite(PROBLEM.model.weights(at[i], at[j]))
    proper = set(zip(i[near & passable].tolist(), j[near & passable].tolist(), strict=True))
    assert len(proper) > 400
    assert proper < edges(large)


@pytest.mark.slow
def test_milestones_are_uniform_outside_of_the_area() -> None:
    roadmap = grown(AROUND, [8000])
    at = roadmap.positions[2:8000]
    assert not AROUND.model.area.contains(at).any()
    assert ((at >= 0.0) & (at <= 1.0)).all()
    # left of the wall, above it, right of it: shares of the free area, to 5 standard deviations
    left, right = at[:, 0] < 0.45, at[:, 0] > 0.55
    for inside, share in ((left, 0.45), (right, 0.45), (~left & ~right, 0.02)):
        chance = share / 0.92
        assert abs(inside.mean() - chance) < 5.0 * math.sqrt(chance * (1.0 - chance) / len(at))


# towards the continuous optimum


def gaps(n_milestones: list[int]) -> list[float]:
    """Return the median distance from the optimum over some seeds."""
    runs = [[cg.solve(AROUND, "prm-star", milestones=n, seed=seed).cost for seed in range(7)] for n in n_milestones]
    return [float(np.median(costs)) / SHORTEST - 1.0 for costs in runs]


def slope(n_milestones: list[int]) -> float:
    return float(np.polyfit(np.log(n_milestones), np.log(gaps(n_milestones)), 1)[0])


@pytest.mark.slow
def test_the_gap_falls_like_the_radius() -> None:
    # sqrt(log(n) / n) falls with a slope of -0.43 here; seven seeds leave some noise
    assert -0.8 < slope([250, 1000, 4000]) < -0.35


class Stuck(Roadmap):
    """Uses its first 60 samples again and again."""

    def _place(self, size: int) -> None:
        super()._place(size)
        self.positions = self.positions[np.r_[:62, np.arange(len(self.positions) - 62) % 60 + 2]]


@pytest.mark.slow
def test_a_sampler_that_gets_stuck_is_seen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(prm_star, "Roadmap", Stuck)
    assert slope([250, 1000, 4000]) > -0.2


# maps of all kinds


@given(bounds=boxes(), ends=st.tuples(points, points), seed=seeds)
@few
def test_bounds_of_any_size_and_shape(bounds: Bounds, ends: tuple[Point, Point], seed: int) -> None:
    x_min, y_min, x_max, y_max = bounds
    start, goal = ((x_min + u * (x_max - x_min), y_min + v * (y_max - y_min)) for u, v in ends)
    start, goal = ((min(x, x_max), min(y, y_max)) for x, y in (start, goal))
    assume(start != goal)
    answer = cg.solve(cg.Problem(start, goal, bounds=bounds), "prm-star", milestones=300, seed=seed)
    assert answer.status is Status.FOUND
    diagonal = math.hypot(x_max - x_min, y_max - y_min)
    assert math.dist(start, goal) * (1 - 1e-9) <= answer.cost <= math.dist(start, goal) + 0.2 * diagonal


def box_with_pocket(x: float) -> BaseGeometry:
    """Make a box around ``(x, 0.5)`` that is open in a slit towards the middle of the map."""
    outer, inner = shapely.box(x - 0.1, 0.4, x + 0.1, 0.6), shapely.box(x - 0.05, 0.45, x + 0.05, 0.55)
    slit = shapely.box(min(x, 0.5), 0.49, max(x, 0.5), 0.51)
    return outer.difference(inner).difference(slit)


def test_start_and_goal_in_pockets() -> None:
    area = shapely.union_all([box_with_pocket(0.2), box_with_pocket(0.8)])
    problem = cg.Problem((0.2, 0.54), (0.8, 0.46), no_fly=area)
    answer = cg.solve(problem, "prm-star", milestones=4000)
    assert answer.status is Status.FOUND
    assert answer.cost < 0.7


def test_a_map_without_a_free_place_ends() -> None:
    # (start and goal are on the boundary of a hole without width for samples)
    hole = shapely.Polygon([(0.2, 0.2), (0.8, 0.8), (0.2, 0.2 + 1e-12)])
    problem = cg.Problem((0.2, 0.2), (0.8, 0.8), no_fly=shapely.box(-1, -1, 2, 2) - hole)
    answer = cg.solve(problem, "prm-star", seconds=30.0, milestones=None)
    assert (answer.status, "no free place" in answer.message) == (Status.NOT_FOUND, True)
    assert answer.seconds < 10.0


# settings and seeds


WITHOUT_OMPL = """
import sys
sys.modules["ompl"] = None
import cgla_graph as cg
field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9)])
print(cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0), "prm-star", milestones=300).path.tolist())
"""


@pytest.mark.slow
def test_another_process_without_ompl_finds_the_same_path() -> None:
    done = subprocess.run(
        [sys.executable, "-c", WITHOUT_OMPL],
        capture_output=True,
        text=True,
        check=True,
        env={**os.environ, "PYTHONHASHSEED": "7"},
    )
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=0.9)])
    here = cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=10.0), "prm-star", milestones=300)
    assert done.stdout.strip() == str(here.path.tolist())
