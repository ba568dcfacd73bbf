"""Maps that only geometry can love: far from the origin, far longer than wide, with specks and threats out of sight."""

import math

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.solvers.reactive.milp_map import obstacles_of
from cgla_graph.solvers.reactive.milp_model import MOST_CHOICES, Horizon, best_plan

# specks are warned of
pytestmark = pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.SmallSpreadWarning")
REACTIVE = ["bcv-style", "a2d-style", "fbcri-style", "cpvs-style", "potential-field", "bendy-ruler", "milp"]
PLANNERS = [*REACTIVE, "voronoi", "visibility-graph", "evolutionary", "q-learning"]
THREATS = [cg.Threat(0.5, 0.45, 0.1), cg.Threat(0.3, 0.6, 0.07, 0.5), cg.Threat(0.7, 0.4, 0.05, 0.9)]
#: Farther than geometry can hold, and two specks.
NOWHERE = [
    cg.Threat(1e200, 0.0, 1.0),
    cg.Threat(-1e9, 0.0, 0.1),
    cg.Threat(0.5, 0.62, 1e-8),
    cg.Threat(0.4, 0.7, 1e-60),
]


def moved(threats: list[cg.Threat], east: float, north: float) -> cg.RiskField:
    """Return threats elsewhere."""
    return cg.RiskField([cg.Threat(t.x + east, t.y + north, t.spread, t.peak) for t in threats])


@pytest.mark.parametrize("name", REACTIVE)
def test_far_from_the_origin_rounding_is_no_longer_step(name: str) -> None:
    """A map of the size of a room in the coordinates of a country: a step of 2 cm, given to a tenth of a nanometre."""
    here = cg.Problem((0.1, 0.1), (0.9, 0.9), moved(THREATS, 0.0, 0.0), k=10.0)
    east, north = 1e6, -7e6
    start, goal, bounds = (east + 0.1, north + 0.1), (east + 0.9, north + 0.9), (east, north, east + 1, north + 1)
    there = cg.Problem(start, goal, moved(THREATS, east, north), k=10.0, bounds=bounds)
    answer = cg.solve(there, name)
    assert answer.status is cg.Status.FOUND, answer.message
    assert np.hypot(*np.diff(answer.path, axis=0).T).max() <= 0.02 * (1.0 + 1e-9)
    assert answer.cost == pytest.approx(cg.solve(here, name).cost, rel=0.02)


@pytest.mark.parametrize("name", REACTIVE)
def test_a_mission_far_from_the_origin_is_flown(name: str) -> None:
    east, north = 1e6, -7e6
    world = World(moved(THREATS[:1], east, north), bounds=(east, north, east + 1, north + 1))
    uav = Uav("a", (east + 0.1, north + 0.1), (east + 0.9, north + 0.9), detection_radius=0.2)
    flown = Mission(world, [uav], cg.solvers.get(name), resolution=8).fly().uavs["a"]
    assert flown.status.label == "arrived", flown.message


@pytest.mark.slow
@pytest.mark.parametrize("name", PLANNERS)
def test_threats_that_are_nowhere_on_the_map_change_nothing_to_speak_of(name: str) -> None:
    start, goal, wall = (0.1, 0.1), (0.9, 0.9), shapely.box(0.2, 0.3, 0.35, 0.4)
    plain, crowded = (
        cg.solve(cg.Problem(start, goal, cg.RiskField(threats), k=10.0, no_fly=wall), name)
        for threats in (THREATS, [*THREATS, *NOWHERE])
    )
    assert plain.status is crowded.status is cg.Status.FOUND, crowded.message
    # the corners of specks are places to pass, and so the graphs of corners differ
    assert crowded.cost == pytest.approx(plain.cost, rel=0.25)


@pytest.mark.parametrize("name", REACTIVE)
def test_a_step_beyond_all_bounds_is_one_off_the_map(name: str) -> None:
    area = shapely.box(0.4, 0.3, 0.6, 0.7)
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), moved(THREATS, 0.0, 0.0), k=10.0, no_fly=area)
    long, longer = (cg.solve(problem, name, step=step) for step in (10.0, 1e300))
    assert (longer.status, longer.path.tolist()) == (long.status, long.path.tolist())
    straight = cg.Problem((0.1, 0.1), (0.9, 0.1), k=10.0, no_fly=area)
    assert cg.solve(straight, name, step=1e300).path.tolist() == [[0.1, 0.1], [0.9, 0.1]]


def test_a_map_far_longer_than_wide_takes_no_longer_to_look_along() -> None:
    problem = cg.Problem((0.5, 1.0), (0.5, 9999.0), cg.RiskField([cg.Threat(0.5, 5e3, 0.2)]), bounds=(0, 0, 1, 1e4))
    answer = cg.solve(problem, "cpvs-style", max_steps=3)
    assert answer.status is cg.Status.STUCK
    assert answer.evaluations < 20_000


def test_a_program_with_too_many_choices_is_not_tried() -> None:
    def horizon(count: int) -> Horizon:
        rows = [cg.Threat(1e-4 * i, 0.0, 0.2) for i in range(count)]
        model = cg.Problem((0, 0), (1, 1), cg.RiskField(rows), k=10.0).model
        low, high, origin = np.array([-0.5, -0.5]), np.array([0.5, 0.5]), np.zeros(2)
        obstacles = [obstacle.keep_out(origin, 1.0) for obstacle in obstacles_of(model)]
        places: FloatArray = np.array([[0.1, 0.0]])
        return Horizon(2, 0.06, low, high, obstacles, places, np.zeros(1))

    assert best_plan(horizon(1), gap=0.1, nodes=10) is not None
    assert best_plan(horizon(MOST_CHOICES), gap=0.1, nodes=10) is None


def test_where_the_program_is_too_large_the_graph_of_corners_leads_on() -> None:
    rng = np.random.default_rng(0)
    threats = [cg.Threat(*rng.random(2).tolist(), spread=float(rng.uniform(0.05, 0.3))) for _ in range(40)]
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(threats), k=10.0)
    answer = cg.solve(problem, "milp")
    assert answer.status is cg.Status.FOUND, answer.message
    assert math.isfinite(answer.cost)


def test_a_speck_far_away_does_not_hold_an_elastic_chain() -> None:
    """Its tiny spread would limit the steps of all masses, wherever they are."""
    start, goal = (0.1, 0.1), (0.9, 0.9)
    alone, with_speck = (
        cg.solve(cg.Problem(start, goal, cg.RiskField(threats), k=10.0), "voronoi", joined=1)
        for threats in (THREATS, [*THREATS, cg.Threat(900.0, 900.0, 1e-9)])
    )
    assert with_speck.path.tolist() == alone.path.tolist()
