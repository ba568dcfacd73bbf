"""Voronoi: the diagram's edges against definitions and shapely, and a chain whose rest is a locally best path."""

import math
from typing import Any

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, given
from hypothesis import strategies as st
from strategies import few, usual

import cgla_graph as cg
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.refine.refine import refine_path
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers.geometric import elastic
from cgla_graph.solvers.geometric.elastic import relaxed
from cgla_graph.solvers.geometric.voronoi import VoronoiRoadmap, _sites, voronoi_edges
from cgla_graph.testing.strategies import boxes, fields, points, polygons, seeds

# The diagram


def on_border(middles: FloatArray, bounds: Bounds) -> np.ndarray[Any, np.dtype[np.bool_]]:
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    slack = 1e-7 * float(np.hypot(*(high - low)))
    return np.asarray((np.minimum(middles - low, high - middles) < slack).any(axis=1))


def drawn_sites(seed: int, count: int, bounds: Bounds) -> FloatArray:
    """Draw sites, some of them outside the bounds, some twice."""
    low, high = np.array(bounds[:2]), np.array(bounds[2:])
    sites = low + (high - low) * np.random.default_rng(seed).uniform(-0.3, 1.3, (count, 2))
    return np.vstack([sites, sites[: count // 3]])


#: Without numbers of the size 1e-308, on which the reference of the next test breaks, not the planner.
plain_boxes = boxes().map(lambda bounds: tuple(round(number, 9) for number in bounds))


@usual
@given(seeds, st.integers(1, 30), plain_boxes)
def test_edges_are_as_far_from_two_sites_and_none_is_nearer(seed: int, count: int, bounds: Bounds) -> None:
    """And there are as many of them, in length, as between the cells that shapely cuts; the border is one ring."""
    sites = drawn_sites(seed, count, bounds)
    vertices, edges = voronoi_edges(sites, bounds)
    starts, ends = vertices[edges[:, 0]], vertices[edges[:, 1]]
    diagonal = math.dist(bounds[:2], bounds[2:])
    lengths, border = np.hypot(*(ends - starts).T), on_border((starts + ends) / 2.0, bounds)
    for part in (0.2, 0.5, 0.9):
        between = starts[~border] + part * (ends - starts)[~border]
        far = np.sort(np.hypot(*(between[:, None] - np.unique(sites, axis=0)).transpose(2, 0, 1)), axis=1)
        if len(far):
            np.testing.assert_allclose(far[:, 0], far[:, 1], atol=1e-6 * diagonal)
    perimeter = 2.0 * (bounds[2] - bounds[0] + bounds[3] - bounds[1])
    assert lengths[border].sum() == pytest.approx(perimeter, rel=1e-6)
    box = shapely.box(*bounds)
    cells = shapely.voronoi_polygons(shapely.MultiPoint(sites), extend_to=box.buffer(20 * diagonal))
    cut = sum(shapely.intersection(shapely.get_parts(cells), box).tolist()[i].length for i in range(len(cells.geoms)))
    assert lengths[~border].sum() == pytest.approx((cut - perimeter) / 2.0, abs=1e-5 * diagonal)
    assert nx.is_connected(nx.Graph(edges.tolist()))


@usual
@given(points, points, st.floats(0.02, 0.1), st.floats(0.0, 20.0))
def test_between_two_threats_the_way_is_their_bisector(one: Point, other: Point, spread: float, k: float) -> None:
    """Of threats of any spreads; the rest of the unrefined path is on the border, or joins start and goal."""
    assume(math.dist(one, other) > 0.05)
    field = cg.RiskField([cg.Threat(*one, spread=spread), cg.Threat(*other, spread=2 * spread)])
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), field, k=k)
    answer = cg.solve(problem, "voronoi", masses=0)
    assert answer.status is cg.Status.FOUND
    middles = (answer.path[1:] + answer.path[:-1]) / 2.0
    inner = ~on_border(middles, problem.bounds)[1:-1]
    for place in middles[1:-1][inner]:
        assert math.dist(place, one) == pytest.approx(math.dist(place, other), abs=1e-7)


@few
@given(fields(min_threats=1), polygons(), points, points, st.integers(1, 5))
def test_it_is_the_cheapest_way_along_the_diagram(
    field: cg.RiskField, area: shapely.MultiPolygon, start: Point, goal: Point, joined: int
) -> None:
    """So says networkx, of the same edges; with joins at the first of them only."""
    no_fly = shapely.transform(area, lambda xy: xy / 8.0 + 0.25)
    assume(start != goal and not any(no_fly.contains(shapely.Point(end)) for end in (start, goal)))
    problem = cg.Problem(start, goal, field, k=10.0, no_fly=no_fly)
    solver = VoronoiRoadmap(joined=joined, masses=0, spacing=0.05)
    answer = solver.solve(problem)
    assert answer.status in {cg.Status.FOUND, cg.Status.NOT_FOUND}
    boundary = shapely.get_coordinates(shapely.segmentize(no_fly.boundary, 0.05))
    sites = np.vstack([[(t.x, t.y) for t in field.threats], boundary])
    vertices, edges = voronoi_edges(sites, problem.bounds)
    graph: nx.Graph[Any] = nx.Graph()
    graph.add_nodes_from(["start", "goal"])
    weights = problem.model.weights(vertices[edges[:, 0]], vertices[edges[:, 1]])
    graph.add_weighted_edges_from((a, b, w) for (a, b), w in zip(edges.tolist(), weights, strict=True) if w < math.inf)
    for name, end in (("start", start), ("goal", goal)):
        costs = problem.model.weights(np.broadcast_to(end, vertices.shape), vertices)
        seen = [i for i in np.argsort(np.hypot(*(vertices - end).T), kind="stable") if costs[i] < math.inf]
        graph.add_weighted_edges_from((name, i, costs[i]) for i in seen[:joined])
    if nx.has_path(graph, "start", "goal"):
        best = nx.shortest_path_length(graph, "start", "goal", weight="weight")
        assert answer.cost == pytest.approx(best, rel=1e-6)


def test_a_gap_that_is_too_narrow_for_the_sampling_is_found_when_it_is_halved() -> None:
    """The corner in the upper part has no counterpart, so that coarse edges lead across the walls."""
    upper = shapely.Polygon([(0.45, 0.502), (0.463, 0.502), (0.55, 0.502), (0.55, 1.1), (0.45, 1.1)])
    wall = shapely.MultiPolygon([shapely.box(0.45, -0.1, 0.55, 0.5), upper])
    problem = cg.Problem((0.1, 0.2), (0.9, 0.3), no_fly=wall)
    coarse = VoronoiRoadmap(spacing=0.02, masses=0)
    assert not len(coarse._search(problem, _sites(problem, 0.02))[0])
    assert coarse.solve(problem).status is cg.Status.FOUND
    blind = cg.solve(problem, "voronoi", spacing=0.9)
    assert blind.status is cg.Status.NOT_FOUND
    assert blind.message == "no way along the diagram, the no-fly areas sampled every 0.1125"


def test_with_nothing_around_the_path_is_straight() -> None:
    problem = cg.Problem((0.1, 0.2), (0.9, 0.4), k=3.0)
    assert cg.solve(problem, "voronoi").path.tolist() == [[0.1, 0.2], [0.9, 0.4]]


# The chain


def cost_bound(problem: cg.Problem, chain: FloatArray) -> float:
    """Return log(A B) / 2, whose least value belongs to the least cost."""
    links = np.diff(chain, axis=0)
    squares = (1.0 + problem.k * problem.field.density(chain)) ** 2
    mean = (squares[1:] + squares[:-1]).sum() / 2.0 / len(links)
    return 0.5 * math.log(len(links) * (links**2).sum() * mean)


@usual
@given(fields(max_threats=4), st.floats(0.0, 50.0), seeds)
def test_the_forces_are_those_of_the_least_cost(field: cg.RiskField, k: float, seed: int) -> None:
    """Against central differences; and no more than the stiffness says do they change."""
    points = np.random.default_rng(seed).random((7, 2))
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), field, k)
    force, stiffness, tension = elastic._Chain(problem, points)._forces()
    step = 1e-5 * min([1.0, *(threat.spread for threat in field.threats)])
    wanted = np.empty_like(force)
    for i, axis in np.ndindex(force.shape):
        ahead, back = points.copy(), points.copy()
        ahead[i + 1, axis] += step
        back[i + 1, axis] -= step
        wanted[i, axis] = -(cost_bound(problem, ahead) - cost_bound(problem, back)) / (2.0 * step)
    scale = max(1.0, float(np.abs(force).max()))
    np.testing.assert_allclose(force, tension**2 * wanted, atol=1e-4 * scale)
    assert (stiffness >= 4.0 * 6).all()


@pytest.mark.slow
@few
@given(fields(max_threats=4), polygons(), st.floats(0.0, 50.0), seeds)
def test_a_relaxed_path_is_feasible_and_never_more_expensive(
    field: cg.RiskField, area: shapely.MultiPolygon, k: float, seed: int
) -> None:
    no_fly = shapely.transform(area, lambda xy: xy / 8.0 + 0.25)
    # along the border no area is in the way
    start, *corners, goal = [(0.05, 0.5), (0.05, 0.05), (0.95, 0.05), (0.95, 0.5)]
    path = np.array([start, *np.random.default_rng(seed).permutation(corners[:1]), *corners[1:], goal])
    problem = cg.Problem(start, goal, field, k, no_fly=no_fly)
    found = relaxed(problem, path, masses=20)
    before, after = problem.evaluate(path), problem.evaluate(found.path)
    assert after.feasible
    assert after.cost <= before.cost
    assert (tuple(found.path[0]), tuple(found.path[-1])) == (start, goal)
    if no_fly.is_empty and not field.threats:
        assert after.cost <= 0.9 + 1e-3


def test_at_rest_the_path_is_locally_best_up_to_its_fineness() -> None:
    """The gain left for refinement falls with the square of the links' length."""
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField([cg.Threat(0.5, 0.55, spread=0.12)]), k=10.0)
    counts, excess = np.array([10, 20, 40, 80]), []
    for masses in counts.tolist():
        rest = relaxed(problem, [(0.1, 0.1), (0.9, 0.1), (0.9, 0.9)], masses=masses)
        assert rest.at_rest
        best = refine_path(problem, rest.path, tolerance=0.0).cost
        excess.append(problem.evaluate(rest.path).cost / best - 1.0)
    assert np.polyfit(np.log(counts), np.log(excess), 1)[0] == pytest.approx(-2.0, abs=0.3)
    assert excess[-1] < 5e-4


def test_a_chain_around_a_wall_comes_near_the_shortest_way() -> None:
    problem = cg.Problem((0.1, 0.7), (0.9, 0.7), no_fly=shapely.box(0.45, 0.2, 0.55, 1.1))
    answer = cg.solve(problem, "voronoi")
    shortest = 2.0 * math.hypot(0.35, 0.5) + 0.1
    assert shortest <= answer.cost <= 1.02 * shortest


# The solver


@few
@given(fields(max_threats=12), points, points, st.floats(0.0, 100.0))
def test_without_areas_there_is_always_a_path_and_the_chain_helps(
    field: cg.RiskField, start: Point, goal: Point, k: float
) -> None:
    assume(start != goal)
    problem = cg.Problem(start, goal, field, k)
    answer, unrefined = (cg.solve(problem, "voronoi", masses=masses) for masses in (20, 0))
    assert answer.status is unrefined.status is cg.Status.FOUND
    assert math.dist(start, goal) * (1 - 1e-12) <= answer.cost <= unrefined.cost


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_on_the_shipped_maps_it_finds_a_way(name: str) -> None:
    problem = load_scenario(name).problem
    answer = cg.solve(problem, "voronoi")
    assert answer.status is cg.Status.FOUND
    assert answer.cost <= 1.2 * cg.solve(problem, "fast-marching").cost
