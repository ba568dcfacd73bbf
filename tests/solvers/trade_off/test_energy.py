"""Paths within an energy: kept exactly, and never below the bound of all that keep it."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg
from cgla_graph.errors import ProblemError

FIELD = cg.RiskField([cg.Threat(500, 500, 90, 0.9), cg.Threat(600, 420, 60, 0.5)])
PROBLEM = cg.Problem((100, 500), (900, 500), FIELD, bounds=(0, 0, 1000, 1000))
#: Energies at 1 W are times in hours.
DRONE = {"speed": 10.0, "power": 3600.0}


@few
@given(blows=st.floats(0.0, 9.0), bearing=st.floats(-3.2, 3.2), more=st.floats(1.0, 1.6))
def test_no_path_of_a_lattice_within_the_energy_has_less_risk(blows: float, bearing: float, more: float) -> None:
    """All paths with at most two waypoints between the ends, and more length than that, by brute force."""
    wind = (blows * math.cos(bearing), blows * math.sin(bearing))
    drone = cg.Aircraft(**DRONE, wind=wind)
    least = cg.flight_time([PROBLEM.start, PROBLEM.goal], aircraft=drone).least_energy
    plan = cg.plan_within_energy(PROBLEM, more * least, drone, solver="cgla", resolution=5)
    nodes = np.array([(x, y) for x in np.linspace(0, 1000, 5) for y in np.linspace(0, 1000, 5)])
    found = [[PROBLEM.start, PROBLEM.goal]]
    found += [[PROBLEM.start, tuple(one), PROBLEM.goal] for one in nodes.tolist()]
    found += [[PROBLEM.start, tuple(one), tuple(two), PROBLEM.goal] for one in nodes.tolist() for two in nodes.tolist()]
    kept = [
        PROBLEM.evaluate(path).risk
        for path in found
        if cg.flight_time(path, aircraft=drone).least_energy <= more * least
    ]
    assert plan.dual_bound <= min(kept) * (1.0 + 1e-9)
    energy = cg.flight_time(plan.solution, aircraft=drone).least_energy
    assert energy <= more * least * (1.0 + 1e-8)
    assert plan.solution.risk >= plan.dual_bound * (1.0 - 1e-9)
    # the straight line is the shortest path, and keeps the energy in any wind
    assert plan.status.has_path


def test_in_still_air_it_is_the_budget_of_length() -> None:
    plan = cg.plan_within_energy(PROBLEM, 95.0, cg.Aircraft(**DRONE), solver="cgla")
    same = cg.plan_within_length(PROBLEM, 950.0, solver="cgla")
    assert plan.solution.path.tolist() == same.solution.path.tolist()
    assert (plan.dual_bound, plan.k) == (same.dual_bound, same.k)
    assert (plan.document()["limited"], plan.document()["budget"]) == ("energy", 95.0)


def test_climbs_come_off_the_budget() -> None:
    drone = cg.Aircraft(**DRONE, climb_rate=4, descent_rate=2)
    plan = cg.plan_within_energy(PROBLEM, 110.0, drone, altitude=20, solver="cgla")
    same = cg.plan_within_length(PROBLEM, 950.0, solver="cgla")
    assert plan.solution.path.tolist() == same.solution.path.tolist()
    assert cg.flight_time(plan.solution, aircraft=drone, altitude=20).energy <= 110.0 * (1 + 1e-9)
    none = cg.plan_within_energy(PROBLEM, 14.0, drone, altitude=20)
    assert (none.status.label, none.no_path, none.solution.message) == (
        "no-path", True, "no flight takes at most 14 Wh: the climb and the descent alone take more",
    )  # fmt: skip
    assert cg.plan_within_energy(PROBLEM, 70.0, drone).no_path


@pytest.mark.parametrize(
    ("drone", "more", "said"),
    [
        ({"power": 3600.0}, {}, "--speed V"),
        ({"speed": 10.0}, {}, "--power W"),
        ({**DRONE, "wind": (6, 8)}, {}, "the wind is 10 fast"),
        (DRONE, {"altitude": 80}, "--climb-rate"),
        (DRONE, {"max_energy": -1.0}, "max_energy is -1"),
        (DRONE, {"max_energy": math.nan}, "max_energy is nan"),
    ],
)
def test_nonsense_is_refused(drone: dict[str, object], more: dict[str, float], said: str) -> None:
    with pytest.raises(ProblemError, match=said):
        cg.plan_within_energy(PROBLEM, **{"max_energy": 90.0, **more}, aircraft=cg.Aircraft(**drone))
