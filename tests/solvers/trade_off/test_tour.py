"""Tours, against all orders of their places."""

import itertools
import json
import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few, usual

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.solvers.trade_off.held_karp import cheapest_order
from cgla_graph.solvers.trade_off.tour import MOST_PLACES, tour

FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.12, 0.9), cg.Threat(0.3, 0.6, 0.1, 0.7)])
WALL = shapely.box(0.55, 0.2, 0.6, 0.9)
PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.1), FIELD, k=5.0, no_fly=WALL)
ROOM = shapely.Polygon(
    shapely.box(0.6, 0.6, 0.9, 0.9).exterior.coords, [shapely.box(0.7, 0.7, 0.8, 0.8).exterior.coords]
)


@usual
@given(n=st.integers(0, 6), seed=st.integers(0, 10**6), open_legs=st.floats(0.0, 0.6))
def test_no_order_is_cheaper(n: int, seed: int, open_legs: float) -> None:
    """Also where legs are missing, and costs differ by direction."""
    rng = np.random.default_rng(seed)
    costs = rng.random((n + 2, n + 2)).round(2)
    costs[rng.random(costs.shape) < open_legs] = math.inf

    def cost(order: tuple[int, ...]) -> float:
        return sum(costs[leg] for leg in itertools.pairwise((n, *order, n + 1)))

    order, found = cheapest_order(costs)
    assert sorted(order) == list(range(n))
    assert found == pytest.approx(min(map(cost, itertools.permutations(range(n)))))
    assert cost(order) == pytest.approx(found)


@few
@given(seed=st.integers(0, 10**6), n=st.integers(1, 4), is_round=st.booleans())
def test_the_best_order_is_that_of_all_permutations(seed: int, n: int, is_round: bool) -> None:
    """On a lattice with an exact solver; and no order undercuts the bound."""
    rng = np.random.default_rng(seed)
    goal = PROBLEM.start if is_round else PROBLEM.goal
    problem = cg.Problem(PROBLEM.start, goal, FIELD, k=5.0, no_fly=WALL)
    places = [one for one in rng.random((20, 2)).tolist() if not shapely.Point(one).buffer(0.01).intersects(WALL)][:n]
    how = {"solver": "cgla", "resolution": 6, "tolerance": None}
    best = tour(problem, places, order="best", **how)
    every = [tour(problem, [places[one] for one in order], **how) for order in itertools.permutations(range(n))]
    assert best.cost == pytest.approx(min(found.cost for found in every))
    assert best.lower_bound <= min(found.lower_bound for found in every) * (1.0 + 1e-9)
    assert sorted(best.order) == list(range(n))
    again = tour(problem, [places[one] for one in best.order], **how)
    assert again.path.tolist() == best.path.tolist()
    for found in (best, *every):
        judged = problem.evaluate(found.path)
        assert judged.feasible
        assert (judged.cost, judged.length) == (found.cost, found.length)
        visited = {tuple(point) for point in found.path.tolist()}
        assert {tuple(place) for place in places} <= visited


def test_bounds_are_sums_of_proven_ones() -> None:
    places = [(0.2, 0.8), (0.8, 0.8)]
    found = tour(PROBLEM, places, tolerance=0.02)
    stops = [PROBLEM.start, *places, PROBLEM.goal]
    alone = [
        cg.solve(cg.Problem(one, other, FIELD, k=5.0, no_fly=WALL), tolerance=0.02)
        for one, other in (sorted(ends) for ends in itertools.pairwise(stops))
    ]
    assert found.lower_bound == pytest.approx(sum(leg.lower_bound for leg in alone), rel=1e-9)
    assert found.cost == pytest.approx(sum(leg.cost for leg in alone))
    assert all(leg.certificate is not None for leg in found.legs)
    best = tour(PROBLEM, places, order="best", tolerance=0.02)
    assert best.lower_bound <= best.cost <= found.cost
    assert best.gap < 0.03
    json.dumps(found.document(), allow_nan=False)


def test_equal_places_and_ends_are_visited_once() -> None:
    twice = [PROBLEM.start, (0.2, 0.8), (0.2, 0.8), PROBLEM.goal]
    once = tour(PROBLEM, [(0.2, 0.8)], solver="cgla", tolerance=None)
    for order in ("given", "best"):
        found = tour(PROBLEM, twice, order=order, solver="cgla", tolerance=None)
        assert (found.cost, found.order, len(found.legs)) == (once.cost, (0, 1, 2, 3), 2)
        assert found.message == "visited together with an end or another place: place 1, 3 and 4"
    # in order, a place may be visited again
    there_and_back = [(0.2, 0.8), (0.1, 0.5), (0.2, 0.8)]
    quick = {"solver": "cgla", "tolerance": None}
    assert tour(PROBLEM, there_and_back, **quick).cost > tour(PROBLEM, there_and_back, order="best", **quick).cost


def test_no_places_are_a_path_and_none_at_all_is_none() -> None:
    alone = cg.solve(PROBLEM)
    for order in ("given", "best"):
        found = tour(PROBLEM, [], order=order)
        assert (found.cost, found.path.tolist()) == (alone.cost, alone.path.tolist())
        stay = tour(cg.Problem((0.1, 0.1), (0.1, 0.1)), [(0.1, 0.1)], order=order)
        assert (stay.cost, stay.lower_bound, stay.gap, len(stay.path), stay.status.label) == (0.0, 0.0, 0.0, 1, "found")


def test_a_place_that_cannot_be_reached_is_named() -> None:
    """The bound is infinite only if that is proven."""
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=ROOM)
    for order in ("given", "best"):
        found = tour(problem, [(0.3, 0.3), (0.75, 0.75)], order=order)
        assert (found.status.label, found.lower_bound, len(found.path)) == ("no-path", math.inf, 0)
        assert "and place 2: " in found.message or "place 2 and " in found.message
        loose = tour(problem, [(0.3, 0.3), (0.75, 0.75)], order=order, tolerance=None)
        assert loose.status.label == "not-found"
        assert math.isfinite(loose.lower_bound)


@pytest.mark.parametrize(
    ("places", "more", "said"),
    [
        ([(0.57, 0.5)], {}, r"place 1 \(0.57, 0.5\) is inside the no-fly area"),
        ([(0.2, 0.2), (1.5, 0.5)], {}, r"place 2 \(1.5, 0.5\) is outside the bounds"),
        ([(0.2, math.nan)], {}, "coordinates must be finite"),
        ([0.2, 0.3], {}, r"places has the shape \(2,\)"),
        ([(0.2, 0.3)], {"order": "worst"}, "order is 'worst'; choose one of given, best"),
        (np.random.default_rng(1).random((MOST_PLACES + 1, 2)) * 0.3, {"order": "best"}, "there are 13 places"),
    ],
)
def test_nonsense_is_refused(places: object, more: dict[str, str], said: str) -> None:
    with pytest.raises(ProblemError, match=said):
        tour(PROBLEM, places, **more)


@pytest.mark.filterwarnings("ignore:1 of 1 threats peak above 1")
def test_legs_that_cost_less_than_nothing_are_refused() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, 2.0)], improper=True)
    with pytest.raises(ProblemError, match="peaks above 1"):
        tour(cg.Problem((0.1, 0.1), (0.9, 0.9), field), [])


def test_thirteen_places_are_visited_in_the_given_order() -> None:
    places = np.random.default_rng(1).random((MOST_PLACES + 1, 2)) * 0.3
    found = tour(PROBLEM, places, solver="straight-line", tolerance=None)
    assert found.order == tuple(range(13))
    assert len(found.path) == 15


def test_a_tour_on_the_earth() -> None:
    problem = cg.Problem.in_degrees((24.0, 60.0), (24.0, 60.0), bounds=(23.9, 59.9, 24.4, 60.3))
    assert problem.projection is not None
    places = problem.projection.forward([(24.3, 60.0), (24.1, 60.2), (24.3, 60.2)])
    found = tour(problem, places, order="best")
    assert 0.0 <= found.gap < 1e-4
    assert found.order in {(0, 2, 1), (1, 2, 0)}
    plan = cg.FlightPlan.along(found.lonlat, altitude=80)
    assert (plan.waypoints[-1].role, plan.waypoints[-1].x) == ("landing", 24.0)
