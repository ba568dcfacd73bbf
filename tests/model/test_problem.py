"""Problems, and the oracle that judges every answer."""

import dataclasses
import itertools
import math
import pickle
from collections.abc import Sequence

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from oracles import crosses, least_costs, path_risk
from strategies import fast, usual

from cgla_graph._types import FloatArray, Point
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.errors import CglaError, NodeNotFoundError, ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import COST_TOLERANCE, GraphProblem, Problem
from cgla_graph.model.risk import RiskField, SmallSpreadWarning, Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.testing.strategies import crowds, fields, points, polygons, risk_weights, seeds, weight_matrices

FIELD = RiskField([Threat(0.5, 0.5, spread=0.1), Threat(0.3, 0.6, spread=0.2, peak=0.5)])
WALL = shapely.box(0.4, 0.0, 0.6, 0.8)
STRAIGHT = np.array([(0.1, 0.1), (0.9, 0.1)])
AROUND = np.array([(0.1, 0.1), (0.4, 0.8), (0.6, 0.8), (0.9, 0.1)])
PROBLEM = Problem((0.1, 0.1), (0.9, 0.1), FIELD, 10.0, no_fly=WALL)
OPEN = Problem((0.1, 0.1), (0.9, 0.1), FIELD, 10.0)
NOT_FINITE = (math.nan, math.inf, -math.inf)


# The oracle


@usual
@given(crowds(20), risk_weights, seeds, st.integers(1, 6))
def test_evaluate_adds_up_lengths_and_integrals_of_quad(field: RiskField, k: float, seed: int, n: int) -> None:
    path = np.random.default_rng(seed).random((n, 2))
    found = Problem((0, 0), (1, 1), field, k).evaluate(path)
    assert found.length == pytest.approx(math.fsum(map(math.dist, path, path[1:])), rel=1e-14)
    assert abs(found.risk - path_risk(field.threats, path)) <= 1e-10 * n
    assert found.cost == found.length + k * found.risk
    assert found.clearance == math.inf
    assert found.feasible


@usual
@given(polygons(), seeds, st.integers(2, 5))
def test_clearance_is_the_distance_of_shapely(area: shapely.MultiPolygon, seed: int, n: int) -> None:
    path = np.random.default_rng(seed).uniform(0.0, 4.0, (n, 2))
    corners = Problem((0, -1), (0, -1), bounds=(-1, -1, 5, 5), no_fly=area)
    expected = shapely.distance(shapely.LineString(path), area) if not area.is_empty else math.inf
    assert corners.evaluate(path).clearance == pytest.approx(expected, abs=1e-15)


@fast
@given(polygons(), st.lists(st.tuples(st.integers(-2, 10), st.integers(-2, 10)), min_size=2, max_size=6))
def test_violations_are_leaving_the_bounds_and_crossing_an_area(
    area: shapely.MultiPolygon, halves: list[tuple[int, int]]
) -> None:
    path = np.array(halves) / 2
    # (no area ends on the border)
    found = Problem((0, 0), (0, 0), bounds=(-0.25, -0.25, 4.25, 3.25), no_fly=area)
    outside = ((path < -0.25) | (path > (4.25, 3.25))).any(axis=1)
    crossing = crosses(area, path[:-1], path[1:])
    expected = [f"waypoint {int(outside.argmax())} leaves the bounds"] * bool(outside.any())
    expected += [f"segment {int(crossing.argmax())} crosses the no-fly area"] * bool(crossing.any())
    assert list(found.evaluate(path).violations) == expected
    assert found.evaluate(path).feasible == (not expected)


@usual
@given(fields(0, 6), risk_weights, points, points, st.floats(0.0, 1.0))
def test_a_waypoint_on_the_way_costs_nothing(field: RiskField, k: float, a: Point, b: Point, t: float) -> None:
    problem = Problem(a, b, field, k)
    middle = ((1.0 - t) * a[0] + t * b[0], (1.0 - t) * a[1] + t * b[1])
    direct, via = problem.evaluate([a, b]), problem.evaluate([a, middle, b])
    assert abs(via.cost - direct.cost) <= 1e-10 * (1.0 + k)
    assert problem.evaluate([a, a, b, b]).cost == direct.cost
    # backwards, the sum runs the other way round
    assert problem.evaluate([b, middle, a]).cost == pytest.approx(via.cost, rel=1e-14)


@given(points)
@example((0.5, 0.0))
@example((0.4, 0.0))
def test_a_path_of_one_point_costs_nothing(point: Point) -> None:
    found = PROBLEM.evaluate([point])
    assert (found.length, found.risk, found.cost) == (0.0, 0.0, 0.0)
    assert found.clearance == pytest.approx(shapely.Point(point).distance(WALL), abs=1e-15)
    # (the wall stands on the border, which it closes)
    assert found.feasible == (not WALL.union(shapely.box(0.4, -0.1, 0.6, 0.1)).contains(shapely.Point(point)))


@pytest.mark.parametrize(
    "path", [[], None, "ab", 3, (0.1, 0.1), [[1, 2], [3]], [[[0.1, 0.1]]], *([(0, 0), (0, odd)] for odd in NOT_FINITE)]
)
def test_what_is_no_path_is_refused(path: Sequence[object]) -> None:
    with pytest.raises(ProblemError, match="path"):
        PROBLEM.evaluate(path)  # type: ignore[arg-type]


# Malformed problems

SQUARE = shapely.box(0.4, 0.4, 0.6, 0.6)


ENDS = ("start", "goal")


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        *(({end: value}, f"{end}( x| y)? is .*; give") for end in ENDS for value in (
            (math.nan, 0.1), (0.1, math.inf), (-math.inf, 0.1), None, "ab", "0.1,0.1", (0.1,), (0.1, 0.1, 0.1),
            ("0.1", "0.1"), (None, 0.1), ((0.1, 0.1), 0.1), 0.1,
        )),
        *(({end: value}, f"{end} .* is outside the bounds") for end in ENDS for value in (
            (-0.1, 0.1), (0.1, 1.0 + 1e-15), (2, 2), (math.nextafter(0.0, -1.0), 0.0),
        )),
        *(({end: (0.5, 0.5)}, f"{end} .* is inside the no-fly area") for end in ENDS),
        ({"start": (math.nextafter(0.4, 1), 0.5)}, "start .* is inside the no-fly area"),
        *(({"k": value}, "k is .*") for value in (-1.0, -1e-300, math.nan, math.inf, None, "10", True, [1])),
        *(({"field": value}, "field is .*; give a RiskField") for value in ("risk", [], 0, (), Threat(0, 0, 1))),
        *(({"no_fly": value}, type(value).__name__) for value in (
            shapely.Point(0.5, 0.5), [SQUARE], "POLYGON", np.zeros((3, 2)),
        )),
        *(({"bounds": value}, "bound") for value in (
            None, "0011", (0, 0, 1), (1, 0, 0, 1), (0, 0, 0, 0), (0, 0, math.nan, 1), (0, 0, 1, "1"),
        )),
    ],
)  # fmt: skip
def test_a_malformed_problem_is_refused_by_name(changes: dict[str, object], words: str) -> None:
    parts = {"start": (0.1, 0.1), "goal": (0.9, 0.9), "field": FIELD, "k": 1.0, "no_fly": SQUARE, **changes}
    with pytest.raises(ProblemError, match=words) as caught:
        Problem(**parts)  # type: ignore[arg-type]
    assert isinstance(caught.value, CglaError)
    assert isinstance(caught.value, ValueError)


@pytest.mark.parametrize("side", [1.0, 1e5])
def test_a_spread_far_below_what_the_map_shows_is_warned_of(side: float) -> None:
    def problem(spread: float) -> Problem:
        field = RiskField([Threat(0.5 * side, 0.5 * side, spread=s) for s in (side, spread)])
        return Problem((0.0, 0.0), (side, side), field, k=1.0, bounds=(0.0, 0.0, side, side))

    with pytest.warns(SmallSpreadWarning, match=f"threat 1 has a spread of .* on a map {side:g} wide") as caught:
        problem(5e-7 * side)
    assert caught[0].filename == __file__
    assert problem(2e-5 * side).start == (0.0, 0.0)


@pytest.mark.parametrize("resolution", [1, 0, -1, 2.5, "20", None, True, (2, 1)])
def test_a_resolution_below_2_is_refused(resolution: int) -> None:
    for lay in (PROBLEM.on_lattice, PROBLEM.on_eight_connected):
        with pytest.raises(ProblemError, match=r"resolution is .*at least 2"):
            lay(resolution)


def test_start_and_goal_may_lie_on_any_boundary() -> None:
    problem = Problem((0, 0), (0.6, 0.5), no_fly=SQUARE)
    assert problem.evaluate([(0, 0), (0.6, 0.5)]).feasible is False
    assert Problem((0.4, 0.4), (0.6, 0.6), no_fly=SQUARE).start == (0.4, 0.4)


@usual
@given(points, risk_weights, st.integers(2, 5), st.booleans())
def test_start_may_be_goal(point: Point, k: float, n: int, eight: bool) -> None:
    problem = Problem(point, point, FIELD, k)
    assert problem.evaluate([point]).cost == 0.0
    on_graph = problem.on_eight_connected(n) if eight else problem.on_lattice(n)
    assert on_graph.source == on_graph.target
    matrix = cost_matrix(on_graph.graph, on_graph.target, source=on_graph.source)
    assert matrix.path_from(on_graph.source) == [on_graph.source]
    nodes = (on_graph.source,)
    assert on_graph.judge(Solution(Status.OPTIMAL, nodes=nodes, cost=0.0)).status is Status.OPTIMAL
    assert problem.judge(Solution(Status.OPTIMAL, path=np.array([point]), cost=0.0)).status is Status.OPTIMAL


def test_numbers_become_plain_floats() -> None:
    problem = Problem(
        np.array([0, 1]),  # type: ignore[arg-type]
        [np.float32(0.5), 1],  # type: ignore[arg-type]
        None,  # type: ignore[arg-type]
        np.int64(3),
        (0, 0, 1, np.float64(2)),
    )
    assert (problem.start, problem.goal, problem.k) == ((0.0, 1.0), (0.5, 1.0), 3.0)
    assert problem.bounds == (0.0, 0.0, 1.0, 2.0)
    numbers = [*problem.start, *problem.goal, problem.k, *problem.bounds]
    assert {type(number) for number in numbers} == {float}
    assert problem.field == RiskField()


def test_equal_parts_make_equal_problems() -> None:
    assert Problem((0, 0), (1, 1), FIELD, 2, no_fly=SQUARE) == Problem(
        (0.0, 0.0), (1.0, 1.0), FIELD, 2.0, no_fly=SQUARE
    )
    assert dataclasses.replace(PROBLEM, k=0.0).evaluate(AROUND).cost == PROBLEM.evaluate(AROUND).length
    with pytest.raises(ProblemError, match="k is -1"):
        dataclasses.replace(PROBLEM, k=-1.0)


def test_a_problem_can_be_pickled() -> None:
    expected = PROBLEM.evaluate(AROUND)
    copy = pickle.loads(pickle.dumps(PROBLEM))  # noqa: S301 - our own bytes
    assert copy == PROBLEM
    assert copy.evaluate(AROUND) == expected


# Judging an answer in the plane


def answer(problem: Problem, path: FloatArray, **changes: object) -> Solution:
    """Answer honestly, but for the changes."""
    honest = Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)
    return dataclasses.replace(honest, **changes)  # type: ignore[arg-type]


def test_an_honest_answer_stands() -> None:
    found, expected = PROBLEM.judge(answer(PROBLEM, AROUND)), PROBLEM.evaluate(AROUND)
    assert (found.status, found.message) == (Status.FOUND, "")
    assert (found.cost, found.length, found.risk) == (expected.cost, expected.length, expected.risk)
    assert found.clearance == expected.clearance == 0.0
    assert (found.path == AROUND).all()


@fast
@given(fields(0, 3), risk_weights, st.lists(points, max_size=4), st.floats(0.0, 1.0))
def test_a_lie_about_the_cost_is_seen(field: RiskField, k: float, middle: list[Point], share: float) -> None:
    problem = Problem((0, 0), (1, 1), field, k)
    honest = answer(problem, np.array([problem.start, *middle, problem.goal]))
    for factor in (1.0 + 2.0 * COST_TOLERANCE, 1.0 - 2.0 * COST_TOLERANCE, share / 2.0, 2.0 + share, -1.0):
        found = problem.judge(dataclasses.replace(honest, cost=honest.cost * factor))
        assert found.status is Status.FAILED
        assert found.cost == honest.cost
        assert "oracle" in found.message
    rounded = dataclasses.replace(honest, cost=honest.cost * (1.0 + 0.5 * share * COST_TOLERANCE))
    assert problem.judge(rounded).status is Status.FOUND


@pytest.mark.parametrize("cost", [math.nan, -math.inf, 0.0])
def test_a_cost_that_is_no_cost_is_a_lie(cost: float) -> None:
    found = OPEN.judge(answer(OPEN, STRAIGHT, cost=cost))
    assert found.status is Status.FAILED
    assert found.cost == OPEN.evaluate(STRAIGHT).cost


@pytest.mark.parametrize(
    "path",
    [
        [(0.1, 0.2), (0.9, 0.1)], [(0.1, 0.1), (0.9, 0.1 + 1e-16 * 8)], [(0.9, 0.1), (0.1, 0.1)], [(0.1, 0.1)],
        [(0.1, 0.1, 0.0), (0.9, 0.1, 0.0)], [0.1, 0.1], [(0.1,), (0.9,)], np.empty((0, 2)), None,
        [(math.nan, math.nan)] * 2,
        *([(0.1, 0.1), odd, (0.9, 0.1)] for odd in ((math.nan, 0.1), (math.inf, 0.1), (0.5,), ("a", "b"))),
    ],
)  # fmt: skip
def test_a_path_that_does_not_join_start_and_goal_fails(path: FloatArray) -> None:
    """No number of the solver's is kept."""
    try:
        cost = OPEN.evaluate(path).cost  # an honest one, where there is one
    except ProblemError:
        cost = 0.8
    found = OPEN.judge(Solution(Status.FOUND, path=path, cost=cost, length=0.001, risk=0.0))
    assert found.status is Status.FAILED
    assert found.message
    assert (found.cost, found.length, found.risk) == (math.inf, math.inf, math.inf)


@pytest.mark.parametrize(
    ("path", "words"),
    [
        (STRAIGHT, "segment 0 crosses the no-fly area"),
        ([(0.1, 0.1), (0.1, 1.1), (0.9, 1.1), (0.9, 0.1)], "waypoint 1 leaves the bounds"),
        ([(0.1, 0.1), (0.5, -0.01), (0.9, 0.1)], "waypoint 1 leaves the bounds; segment 0 crosses the no-fly area"),
        ([(0.1, 0.1), (0.4, 0.8), (0.6, math.nextafter(0.8, 0)), (0.9, 0.1)], "segment 1 crosses the no-fly area"),
    ],
)
def test_a_path_where_none_may_fly_is_infeasible(path: FloatArray, words: str) -> None:
    found = PROBLEM.judge(answer(PROBLEM, np.array(path), status=Status.OPTIMAL))
    assert found.status is Status.INFEASIBLE
    assert found.message == words
    assert found.cost == PROBLEM.evaluate(path).cost


def test_a_path_beyond_all_bounds_is_an_answer_not_an_exception() -> None:
    path = np.array([(0.1, 0.1), (1e200, 0.1), (0.9, 0.1)])
    assert not OPEN.judge(Solution(Status.FOUND, path=path, cost=1.0)).status.has_path


@pytest.mark.parametrize("status", [status for status in Status if not status.has_path])
def test_without_a_path_every_number_is_infinite(status: Status) -> None:
    claim = Solution(status, path=STRAIGHT, nodes=(0, 1), cost=1.0, length=1.0, risk=1.0, message="why")
    chain = GraphProblem(GeometricGraph.from_matrix([[0, 1], [1, 0]]), 0, 1)
    for found in (OPEN.judge(claim), chain.judge(claim)):
        assert (found.status, found.message) == (status, "why")
        assert (found.cost, found.length, found.risk) == (math.inf, math.inf, math.inf)


def test_a_lower_bound_above_the_cost_is_a_lie() -> None:
    honest = answer(OPEN, STRAIGHT)
    found = OPEN.judge(dataclasses.replace(honest, lower_bound=2.0 * honest.cost))
    assert found.status is Status.FAILED
    assert not found.gap < 0.0
    assert OPEN.judge(dataclasses.replace(honest, lower_bound=honest.cost)).status is Status.FOUND


def test_judging_twice_is_judging_once() -> None:
    once = PROBLEM.judge(answer(PROBLEM, AROUND))
    twice = PROBLEM.judge(once)
    assert {**twice.__dict__, "path": None} == {**once.__dict__, "path": None, "lower_bound": twice.lower_bound}
    crossing = PROBLEM.judge(PROBLEM.judge(answer(PROBLEM, STRAIGHT)))
    assert (crossing.status, crossing.cost) == (Status.INFEASIBLE, math.inf)


# Judging an answer on a graph


@fast
@given(weight_matrices(elements=st.sampled_from([0.0, 0.5, 2.0])), st.lists(st.integers(0, 8), min_size=1, max_size=6))
def test_evaluate_on_a_graph_re_adds_the_weights(weights: FloatArray, steps: list[int]) -> None:
    nodes = [step % len(weights) for step in steps]
    problem = GraphProblem(GeometricGraph.from_matrix(weights), nodes[0], nodes[-1])
    expected = math.fsum(weights[i, j] for i, j in itertools.pairwise(nodes))
    assert problem.evaluate(nodes) == expected
    found = problem.judge(Solution(Status.FOUND, nodes=nodes, cost=expected))
    assert found.status is (Status.FOUND if math.isfinite(expected) else Status.INFEASIBLE)
    assert math.isnan(found.length)
    assert math.isnan(found.risk)
    lie = problem.judge(Solution(Status.FOUND, nodes=nodes, cost=expected + 0.1))
    assert lie.status is (Status.FAILED if math.isfinite(expected) else Status.INFEASIBLE)
    assert lie.cost == expected


@usual
@given(fields(0, 4), risk_weights, points, points, st.integers(2, 5), st.booleans())
def test_the_optimum_of_a_lattice_stands_in_both_courts(
    field: RiskField, k: float, start: Point, goal: Point, n: int, eight: bool
) -> None:
    assume(max(abs(start[0] - goal[0]), abs(start[1] - goal[1])) > 1e-8)
    problem = Problem(start, goal, field, k)
    on_graph = problem.on_eight_connected(n) if eight else problem.on_lattice(n)
    weights = on_graph.graph.weight_matrix()
    matrix = cost_matrix(on_graph.graph, on_graph.target, source=on_graph.source)
    source, target = (on_graph.graph.index_of(node) for node in (on_graph.source, on_graph.target))
    assert matrix.values[source] == pytest.approx(least_costs(weights, target)[source], rel=1e-12)
    nodes = tuple(matrix.path_from(on_graph.source))
    found = on_graph.judge(Solution(Status.OPTIMAL, nodes=nodes, cost=matrix.value(on_graph.source)))
    assert (found.status, found.nodes) == (Status.OPTIMAL, nodes)
    assert found.length + k * found.risk == pytest.approx(found.cost, rel=1e-9)
    again = problem.judge(found)
    assert again.status is Status.OPTIMAL
    assert (again.length, again.risk) == pytest.approx((found.length, found.risk), rel=1e-9)


def test_a_path_past_a_lattice_corner_stands_in_both_courts() -> None:
    hill = shapely.Polygon([(0.5, 0.5), (1 / 6, 0.5), (2 / 6, 5 / 6)])
    lattice = Lattice(7, bounds=(0, 0, 1, 1))
    start, goal = (tuple(lattice.points[i].tolist()) for i in (7, 41))
    problem = Problem(start, goal, no_fly=hill)
    on_graph = problem.on_lattice(7).with_weights_held()
    matrix = cost_matrix(on_graph.graph, on_graph.target, source=on_graph.source)
    nodes = tuple(matrix.path_from(on_graph.source))
    found = on_graph.judge(Solution(Status.OPTIMAL, nodes=nodes, cost=matrix.value(on_graph.source)))
    assert problem.judge(found).status is Status.OPTIMAL


CHAIN = GraphProblem(
    GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels="abc", positions=[(0, 0), (3, 4), (3, 5)]),
    "a",
    "c",
)


@pytest.mark.parametrize(
    ("nodes", "said"),
    [*((nodes, "'a' and 'c'") for nodes in ((), "a", "cba", "bc", "ab")), (("a", "x", "c"), "'x'")],
)
def test_nodes_that_do_not_join_source_and_target_fail(nodes: Sequence[str], said: str) -> None:
    found = CHAIN.judge(Solution(Status.FOUND, nodes=nodes, cost=2.0))
    assert found.status is Status.FAILED
    assert said in found.message


def test_a_graph_with_positions_says_the_length() -> None:
    found = CHAIN.judge(Solution(Status.FOUND, nodes="abc", cost=2.0))
    assert (found.cost, found.length, found.path.tolist()) == (2.0, 6.0, [[0, 0], [3, 4], [3, 5]])
    assert math.isnan(found.risk)


def test_nodes_of_a_graph_problem_must_be_there() -> None:
    for ends in (("a", "x"), ("x", "a"), (0, "a"), (None, "a")):
        with pytest.raises(NodeNotFoundError, match="not in the graph"):
            GraphProblem(CHAIN.graph, *ends)
    assert GraphProblem(CHAIN.graph, "b", "b").evaluate("b") == 0.0


# Nothing passed in is changed


def test_nothing_passed_in_is_changed() -> None:
    path, area = AROUND.copy(), shapely.MultiPolygon([WALL])
    start = np.array([0.1, 0.1])
    shape, before = area.wkb, path.copy()
    path.flags.writeable = False
    problem = Problem(start, (0.9, 0.1), FIELD, 10.0, no_fly=area)  # type: ignore[arg-type]
    claim = Solution(Status.FOUND, path=path, cost=1.0)
    fields_before = dict(claim.__dict__)
    problem.judge(claim)
    problem.evaluate(path)
    problem.on_lattice(3).with_weights_held()
    problem.on_eight_connected(3)
    start[:] = 7.0
    assert problem.start == (0.1, 0.1)
    assert (path == before).all()
    assert area.wkb == shape
    assert claim.__dict__ == fields_before
    assert claim.path is path


def test_a_lattice_of_other_bounds_is_taken_as_it_is() -> None:
    on_graph = OPEN.on_lattice(Lattice(3, bounds=(0.2, 0.2, 0.8, 0.8), kind="centre"))
    assert on_graph.graph.n_nodes == 11
    assert on_graph.source != on_graph.target


def test_errors_of_a_map_in_degrees_are_in_degrees() -> None:
    """Start, goal and bounds are given back in longitude and latitude, distances in metres."""
    middle = LocalProjection(25.0, 60.0)
    wall = shapely.box(-100.0, -100.0, 100.0, 100.0)
    place = {"bounds": (-5000.0, -5000.0, 5000.0, 5000.0), "projection": middle}
    with pytest.raises(ProblemError, match=r"^start \(25, 60\) is inside the no-fly area; move"):
        Problem((0.0, 0.0), (1000.0, 0.0), no_fly=wall, **place)
    with pytest.raises(ProblemError, match=r"^goal \(25\.003\d+, 60\) is 100 m from the no-fly area, .* is 150 m \(at"):
        Problem((1000.0, 0.0), (200.0, 0.0), no_fly=wall, clearance=150.0, **place)
    with pytest.raises(ProblemError, match=r"start \(25\.107\d+, [56]\d.*\) is outside the bounds \(24\.9\d+, 59\."):
        Problem((6000.0, 0.0), (200.0, 0.0), **place)
    with pytest.raises(ProblemError, match=r"start \(30000000\.0, 0\.0\) \(metres\) is outside"):
        Problem((3e7, 0.0), (200.0, 0.0), **place)
