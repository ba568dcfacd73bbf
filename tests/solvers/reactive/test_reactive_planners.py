"""Promises of all step-by-step planners: short steps that may be flown, or a reason; on a map of any size."""

import math
from collections.abc import Mapping
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, scaled

import cgla_graph as cg
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario, shipped
from cgla_graph.solvers import get
from cgla_graph.testing.strategies import problems

#: Planners and settings that make them quick to give up.
PLANNERS: Mapping[str, tuple[str, dict[str, Any]]] = {
    "a2d-style": ("a2d-style", {"max_steps": 400}),
    "bcv-style": ("bcv-style", {"max_steps": 400}),
    "bcv-style, length alone": ("bcv-style", {"risk_aversion": 0.0, "max_steps": 400}),
    "bendy-ruler": ("bendy-ruler", {"max_steps": 200}),
    "cpvs-style": ("cpvs-style", {"patience": 50}),
    "cpvs-style, not onward": ("cpvs-style", {"patience": 50, "onward": False}),
    "fbcri-style": ("fbcri-style", {"patience": 50}),
    "milp": ("milp", {"patience": 50}),
    "potential-field": ("potential-field", {}),
}
#: The milp asks a solver for each plan: examples of it take seconds.
QUICK = [name for name in PLANNERS if name != "milp"]
every = pytest.mark.parametrize("planner", PLANNERS)
quick = pytest.mark.parametrize("planner", QUICK)


def made(planner: str, **more: Any) -> Any:  # noqa: ANN401 - any planner
    name, settings = PLANNERS[planner]
    return get(name, **settings | more)


@quick
@examples(25)
@given(problem=problems())
def test_paths_have_short_steps_and_stand_up_to_the_oracle(planner: str, problem: cg.Problem) -> None:
    answer = cg.solve(problem, made(planner))
    assert answer.status in {Status.OPTIMAL, Status.FOUND, Status.STUCK}, answer.message
    if answer.status is Status.STUCK:
        assert answer.message.startswith("at (")
        assert "step" in answer.message
        return
    assert (tuple(answer.path[0]), tuple(answer.path[-1])) == (problem.start, problem.goal)
    assert (np.hypot(*np.diff(answer.path, axis=0).T) <= 0.02 * (1.0 + 1e-9)).all()


@quick
@examples(8)
@given(problem=problems(max_threats=3), power=st.integers(-10, 20))
def test_a_map_of_another_size_has_the_same_path(planner: str, problem: cg.Problem, power: int) -> None:
    """Powers of two scale without rounding, so that nothing may differ at all."""
    scale, solver = 2.0**power, made(planner)
    one, other = (solver.solve(it) for it in (problem, scaled(problem, scale)))
    assert one.status is other.status
    assert np.array_equal(scale * one.path, other.path)


@quick
@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_end_in_a_path_or_a_reason(planner: str, name: str) -> None:
    answer = cg.solve(load_scenario(name).problem, made(planner))
    assert answer.status.has_path or (answer.status is Status.STUCK and answer.message.startswith("at ("))


@pytest.mark.parametrize(
    ("planner", "reason"),
    [
        ("a2d-style", "no-fly areas and bounds leave none of 16 headings"),
        ("bcv-style", "every heading is closed by a no-fly area or the bounds"),
        ("bendy-ruler", "every bearing is closed by a no-fly area or the bounds"),
        ("cpvs-style", "boxed in: no step of 0.02 is open in any direction"),
        ("cpvs-style, not onward", "boxed in: no step of 0.02 is open in any direction"),
        ("fbcri-style", "boxed in: no step of 0.02 is open in any direction"),
        ("milp", "no way to the goal that is wider than 2e-5 of the map is known"),
        ("potential-field", "the forces cancel"),
    ],
)
def test_in_a_cell_smaller_than_a_step_it_is_stuck_at_once(planner: str, reason: str) -> None:
    cell = shapely.box(0.29, 0.49, 0.31, 0.51).difference(shapely.box(0.295, 0.495, 0.305, 0.505))
    answer = made(planner).solve(cg.Problem((0.3, 0.5), (0.9, 0.5), no_fly=cell))
    assert answer.status is Status.STUCK
    assert answer.message.startswith(f"at (0.3, 0.5), step 0: {reason}")


@pytest.mark.parametrize("planner", ["bcv-style", "bendy-ruler", "potential-field"])
def test_where_nothing_is_in_the_way_it_flies_straight(planner: str) -> None:
    path = made(planner).solve(cg.Problem((0.1, 0.1), (0.9, 0.8))).path
    assert np.hypot(*np.diff(path, axis=0).T).sum() == pytest.approx(math.hypot(0.8, 0.7), rel=1e-12)
    assert len(path) == math.ceil(math.hypot(0.8, 0.7) / 0.02) + 1


@pytest.mark.parametrize("planner", ["bcv-style", "bendy-ruler"])
def test_in_a_pocket_deeper_than_it_looks_it_gets_stuck(planner: str) -> None:
    """C33: a local minimum of the behaviours is a status."""
    pocket = shapely.box(0.2, 0.2, 0.8, 0.8).difference(shapely.box(0.0, 0.25, 0.75, 0.75))
    answer = made(planner, max_steps=1500).solve(cg.Problem((0.25, 0.5), (0.95, 0.5), no_fly=pocket))
    assert answer.status is Status.STUCK
    assert "no headway" in answer.message


@every
def test_peaks_above_1_are_flown_as_they_are(planner: str) -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.45, 0.4, 0.05, peak=8.0), cg.Threat(0.5, 0.6, 0.05, peak=8.0)], improper=True)
    answer = made(planner).solve(cg.Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0))
    assert answer.status in {Status.FOUND, Status.STUCK}


@quick
@pytest.mark.parametrize("seed", range(2))
def test_a_mission_that_knows_everything_flies_the_planned_path(planner: str, seed: int) -> None:
    problem = random_scenario(seed, areas=seed % 2).problem
    planned = cg.solve(problem, made(planner))
    world = World(problem.field, problem.bounds, no_fly=problem.no_fly)
    uav = Uav("a", problem.start, problem.goal, 0.2, k=10.0, step=0.02)
    flown = Mission(world, [uav], made(planner), knowledge="all").fly().uavs["a"]
    assert flown.status.label == ("arrived" if planned.status.has_path else "stuck")
    if planned.status.has_path:
        # the last step may end before its time
        np.testing.assert_allclose(flown.path, planned.path, rtol=0.0, atol=1e-9)
