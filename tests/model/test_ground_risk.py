"""Ground risk by hand, and by a simulation of aircraft that fail."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg
from cgla_graph.errors import ProblemError

TOWN = cg.RasterRisk([[0.0, 1000.0], [200.0, 5000.0]], bounds=(0, 0, 2000, 2000))


@few
@given(st.floats(1e-6, 1.0), st.floats(1.0, 50.0), st.floats(0.1, 650.0), st.floats(0.01, 1.0))
def test_it_is_the_product_of_its_parts(rate: float, speed: float, area: float, fatality: float) -> None:
    settings = {"failures_per_hour": rate, "speed": speed, "lethal_area": area, "fatality": fatality}
    risk = cg.ground_risk(TOWN, unit="people/km2", **settings)
    wanted = TOWN.cells / 1e6 * area * fatality * rate / 3600.0 / speed
    assert risk.cells == pytest.approx(wanted, rel=1e-12)
    assert risk.bounds == TOWN.bounds
    per_metre = TOWN.scaled(1e-6)
    assert cg.ground_risk(per_metre, unit="people/m2", **settings).cells == pytest.approx(wanted, rel=1e-12)


@pytest.mark.slow
def test_a_simulation_of_failing_aircraft_kills_as_many() -> None:
    """People at random places; an aircraft fails at a random place of its way; who is within the lethal circle dies."""
    rng = np.random.default_rng(3)
    n_people, area, runs = 40_000, 6.5e3, 4000
    places = rng.uniform(0.0, 1000.0, (n_people, 2))
    crashes = np.column_stack([rng.uniform(100.0, 900.0, runs), np.full(runs, 500.0)])
    hit = sum(int((np.hypot(*(places - crash).T) < math.sqrt(area / math.pi)).sum()) for crash in crashes)
    people = cg.RasterRisk([[n_people]], bounds=(0, 0, 1000, 1000))
    risk = cg.ground_risk(people, unit="people/km2", failures_per_hour=0.36, speed=10.0, lethal_area=area)
    deaths = float(cg.RiskField(rasters=[risk]).line_integral((100, 500), (900, 500)))
    # 800 m are flown in 80 s
    failures = 0.36 * 80.0 / 3600.0
    assert deaths == pytest.approx(failures * hit / runs, rel=0.02)


def test_the_weight_turns_a_cost_into_a_price() -> None:
    risk = cg.ground_risk(TOWN, unit="people/km2", failures_per_hour=1e-3, speed=20.0, lethal_area=65.0)
    k = cg.risk_weight(prevented_fatality=2e6, metre=0.01)
    problem = cg.Problem((100, 100), (1900, 1900), cg.RiskField(rasters=[risk]), k, bounds=TOWN.bounds)
    path = problem.evaluate([problem.start, problem.goal])
    assert 0.01 * path.cost == pytest.approx(0.01 * path.length + 2e6 * path.risk)


PARTS = {"failures_per_hour": 1e-3, "speed": 20.0, "lethal_area": 6.5}
WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: cg.ground_risk(TOWN, unit="people", **PARTS), "unknown unit 'people' of people; choose one of people/km2"),  # type: ignore[arg-type]
    (lambda: cg.ground_risk(TOWN, unit="people/m2", **PARTS, fatality=1.5), "fatality is 1.5"),
    (lambda: cg.ground_risk(TOWN, unit="people/m2", **{**PARTS, "speed": 0.0}), "speed is 0"),
    (lambda: cg.risk_weight(prevented_fatality=1.0, metre=0.0), "metre is 0"),
    (lambda: cg.risk_weight(prevented_fatality=-1.0, metre=1.0), "prevented_fatality is -1"),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_what_makes_no_risk_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        make()
