"""Lazy Theta*: between the complete lattice's optimum and eight-direction's, on any map."""

import functools
import itertools
import math
from fractions import Fraction
from pathlib import Path

import numpy as np
import oracles
import pytest
import shapely
import strategies as own
from hypothesis import assume, example, given
from hypothesis import strategies as st
from map_files import SCENS, name_of

import cgla_graph as cg
from cgla_graph._types import BoolArray, Point
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers.grid.eight_direction import EightDirection
from cgla_graph.solvers.grid.lazy_theta_star import LazyThetaStar
from cgla_graph.solvers.grid.theta_kernels import neighbours, squeezes
from cgla_graph.testing import strategies as drawn

SIDE = 4.0
BOUNDS = (0.0, 0.0, SIDE, SIDE)


resolutions = st.integers(2, 12) | st.tuples(st.integers(2, 9), st.integers(2, 9))


@own.few
@given(own.lattice_problems(), resolutions)
@example(cg.Problem((0.0, 0.0), (0.0, 0.0), bounds=BOUNDS), 5)
def test_between_the_complete_lattice_and_eight_directions(
    problem: cg.Problem, resolution: int | tuple[int, int]
) -> None:
    theta = cg.solve(problem, LazyThetaStar(resolution))
    eight = cg.solve(problem, EightDirection(resolution))
    assert theta.status in {cg.Status.OPTIMAL, cg.Status.FOUND, cg.Status.NO_PATH}, theta.message
    if eight.status.has_path:
        assert theta.status.has_path
        assert theta.cost <= eight.cost * (1 + 1e-12) + 1e-12
    if theta.status.has_path:
        best = cg.solve(problem, "cgla", resolution=resolution)
        assert theta.cost >= best.cost * (1 - 1e-12) - 1e-12


@own.usual
@given(drawn.polygons(), st.data())
def test_without_risk_no_path_is_shorter_than_the_shortest_among_polygons(
    no_fly: shapely.MultiPolygon, data: st.DataObject
) -> None:
    halves = st.integers(0, 2 * int(SIDE)).map(lambda i: i / 2)
    start, goal = data.draw(st.tuples(halves, halves)), data.draw(st.tuples(halves, halves))
    assume(start != goal and not cg.NoFlyArea(no_fly).contains([start, goal]).any())
    # (on the border, areas would close it)
    bounds = (-SIDE / 4, -SIDE / 4, 1.25 * SIDE, 1.25 * SIDE)
    answer = cg.solve(cg.Problem(start, goal, bounds=bounds, no_fly=no_fly), LazyThetaStar(13))
    crosses = functools.partial(oracles.crosses, no_fly)
    best = oracles.shortest_around(start, goal, shapely.get_coordinates(no_fly), crosses)
    assert answer.cost >= best * (1 - 1e-12)
    # with a lattice point at every corner, turning at the first corner in sight is seldom far from the best
    if answer.status.has_path:
        assert answer.cost <= 1.2 * best
    if no_fly.is_empty:
        assert answer.cost == pytest.approx(math.dist(start, goal), rel=1e-12)


# Grid maps: cells, and the corners that four of them share


@st.composite
def grids(draw: st.DrawFn) -> BoolArray:
    """Draw which cells of a small map are free, shape ``(ny, nx)``."""
    shape = draw(st.integers(2, 8)), draw(st.integers(2, 8))
    rng = np.random.default_rng(draw(drawn.seeds))
    return np.asarray(rng.random(shape) >= draw(st.sampled_from([0.1, 0.3, 0.5])))


def squeezed_corners(a: tuple[int, int], b: tuple[int, int], free: BoolArray) -> list[Point]:
    """List the corners of cells that a segment between two cells' middles runs through, and that a blocked one has."""
    (x1, y1), (x2, y2) = a, b
    found = []
    for corner in range(min(x1, x2), max(x1, x2)):
        x = Fraction(2 * corner + 1, 2)
        y = y1 + (x - x1) * Fraction(y2 - y1, x2 - x1)
        if y.denominator == 2:
            low, left = math.floor(y), corner
            if not free[low : low + 2, left : left + 2].all():
                found.append((float(x), float(y)))
    return found


@own.few
@given(grids(), st.data())
def test_both_free_holds_along_every_segment(free: BoolArray, data: st.DataObject) -> None:
    ny, nx_ = free.shape
    cells = [(int(x), int(y)) for y, x in np.argwhere(free)]
    assume(cells)
    ends = data.draw(st.tuples(st.sampled_from(cells), st.sampled_from(cells)))
    blocked = [shapely.box(x, y, x + 1, y + 1) for y, x in np.argwhere(~free).tolist()]
    start, goal = ((x + 0.5, y + 0.5) for x, y in ends)
    problem = cg.Problem(start, goal, bounds=(0, 0, nx_, ny), no_fly=shapely.union_all(blocked))
    lattice = cg.Lattice((nx_, ny), bounds=problem.bounds, kind="centre")
    theta = cg.solve(problem, LazyThetaStar(lattice, "both-free"))
    eight = cg.solve(problem, EightDirection(lattice, "both-free"))
    # where cells are joined by their sides only, no straight line reaches a cell that eight directions do not
    assert theta.status.has_path == eight.status.has_path
    assert theta.cost <= eight.cost * (1 + 1e-12)
    corners = [(round(x - 0.5), round(y - 0.5)) for x, y in theta.path.tolist()]
    for a, b in itertools.pairwise(corners):
        assert squeezed_corners(a, b, free) == []


@own.fast
@given(grids(), st.data())
def test_a_segment_squeezes_where_the_corners_say_so(free: BoolArray, data: st.DataObject) -> None:
    """The compiled predicate looks at the two cells beside; those before and behind are on the segment."""
    ny, nx_ = free.shape
    i, j = (data.draw(st.integers(0, nx_ * ny - 1)) for _ in range(2))
    a, b = (i % nx_, i // nx_), (j % nx_, j // nx_)
    line = shapely.LineString([(a[0] + 0.5, a[1] + 0.5), (b[0] + 0.5, b[1] + 0.5)])
    on_line = [
        shapely.relate_pattern(line, shapely.box(x, y, x + 1, y + 1), "T********")
        for x in range(nx_)
        for y in range(ny)
    ]
    open_line = free.copy()
    open_line[np.array(on_line).reshape(nx_, ny).T] = True
    expected = i != j and bool(squeezed_corners(a, b, open_line))
    assert squeezes(i, j, nx_, free.ravel()) == squeezes(j, i, nx_, free.ravel()) == expected


@pytest.mark.parametrize("scen", [scen for scen in SCENS if "Berlin" not in scen.name], ids=name_of)
def test_grid_maps_are_planned_on_their_own_cells(scen: Path) -> None:
    """Never longer than the published octile optimum, and by no more than eight directions can lose shorter."""
    shorter = 0
    for scenario in itertools.islice(open_scenarios(str(scen)), 0, None, 6):
        optimum = float(scenario.title.split()[-1])
        answer = cg.solve(scenario.problem, "lazy-theta-star", **scenario.settings["lazy-theta-star"])
        assert answer.status is cg.Status.FOUND
        # the files round their optima to some digits
        assert optimum * math.cos(math.pi / 8) - 1e-5 <= answer.cost <= optimum + 1e-5
        shorter += answer.cost < optimum - 1e-3
    assert shorter > 5


# One by one


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios(name: str) -> None:
    """Within a hundredth of the complete lattice's optimum, the nodes are the path, and few pairs are weighed."""
    scenario = load_scenario(name)
    answer = cg.solve(scenario.problem, "lazy-theta-star", resolution=scenario.lattice)
    best = cg.solve(scenario.problem, "cgla", resolution=scenario.lattice)
    assert best.cost * (1 - 1e-12) <= answer.cost <= 1.01 * best.cost
    positions = scenario.problem.on_lattice(scenario.lattice).graph.positions
    assert positions is not None
    np.testing.assert_array_equal(positions[list(answer.nodes)], answer.path)
    assert 0 < answer.evaluations < best.evaluations / 10


def test_risk_may_make_the_way_round_cheaper_than_the_line_in_sight() -> None:
    """The grandparent is in sight, but a straight line to it costs more: parents must not be skipped."""
    field = cg.RiskField([cg.Threat(0.5, 0.5, spread=0.1)])
    problem = cg.Problem((0.0, 0.5), (1.0, 0.5), field, k=20.0)
    line = problem.evaluate([problem.start, problem.goal]).cost
    answer = cg.solve(problem, LazyThetaStar(11))
    assert answer.cost < 0.5 * line
    assert len(answer.path) > 2


def test_a_useless_turn_is_taken_out() -> None:
    """The search sees parents' parents only; the last pass sees the whole path."""
    scenario = load_scenario("finland")
    answer = cg.solve(scenario.problem, "lazy-theta-star", resolution=scenario.lattice)
    for left_out in range(1, len(answer.path) - 1):
        shortcut = scenario.problem.evaluate(np.delete(answer.path, left_out, axis=0))
        assert not shortcut.feasible or shortcut.cost >= answer.cost * (1 - 1e-12)


def test_points_beyond_the_bounds_are_not_visited() -> None:
    """A lattice may be larger than the map: eight directions go astray there, this search does not."""
    wall = shapely.box(0.45, -1.0, 0.55, 0.9)
    problem = cg.Problem((0.1, 0.0), (0.9, 0.0), no_fly=wall, bounds=(0.0, 0.0, 1.0, 1.0))
    lattice = cg.Lattice(21, bounds=(0.0, -1.5, 1.0, 1.0))
    answer = cg.solve(problem, LazyThetaStar(lattice))
    assert answer.status is cg.Status.FOUND
    assert answer.path[:, 1].max() >= 0.9


def test_both_ends_in_one_cell() -> None:
    problem = cg.Problem((0.51, 0.52), (0.57, 0.58))
    answer = cg.solve(problem, LazyThetaStar(3))
    assert len(answer.path) == 2


def test_what_a_node_is_joined_to() -> None:
    links = np.array([[0, 6], [1, 6], [3, 6], [4, 6]])
    out = np.empty(12, dtype=np.int64)
    sets = [set(out[: neighbours(node, 3, 2, links, out)].tolist()) for node in (0, 4, 6)]
    assert sets == [{1, 3, 4, 6}, {0, 1, 2, 3, 5, 6}, {0, 1, 3, 4}]
