"""Ground risk by hand, and by a simulation of aircraft that fail."""

import math
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg
from cgla_graph.comparisons.study.documents import scenario_document, scenario_from
from cgla_graph.errors import ProblemError
from cgla_graph.model.failure_model import PER_KM2
from cgla_graph.scenarios.scenario import as_scenario

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


@few
@given(unit=st.sampled_from(sorted(PER_KM2)), factor=st.floats(1e-9, 1e9), flown=st.booleans())
def test_no_factor_gets_between_people_and_risk(unit: str, factor: float, *, flown: bool) -> None:
    """The people stay the same under any scale, in pickles, in studies and in equality."""
    values = np.array([[0.0, 3.0], [np.nan, 0.5]])
    town = cg.RasterRisk(values, (0, 0, 2000, 2000), nodata=2.0, unit=unit)  # type: ignore[arg-type]
    wanted = np.where(np.isnan(values), 2.0, values)[::-1] * PER_KM2[unit]  # type: ignore[index]
    risk = town.flown_over_by(cg.FailureModel(1e-3, 20.0, 6.5)) if flown else town
    scaled = risk.scaled(factor)
    problem = cg.Problem((1, 1), (2, 2), cg.RiskField(rasters=[scaled]), bounds=(0, 0, 2000, 2000))
    again = scenario_from(scenario_document(as_scenario(problem, "town"))).problem.field.rasters[0]
    for one in (risk, scaled, pickle.loads(pickle.dumps(scaled)), again):  # noqa: S301 - our own
        assert one.people is not None
        assert one.people.cells == pytest.approx(wanted, rel=1e-15)
        assert one.people.unit == "people/km2"
        assert one.failures == risk.failures
    assert again == scaled
    assert scaled.cells == pytest.approx(risk.cells * factor, rel=1e-14)
    # the same cells of other people, or of an unknown unit, are another raster
    assert cg.RasterRisk(scaled.cells, scaled.bounds, origin="lower") != scaled


def test_a_scenario_file_keeps_people_and_model(tmp_path: Path) -> None:
    risk = cg.ground_risk(TOWN, unit="people/km2", failures_per_hour=1e-3, speed=20.0, lethal_area=6.5, fatality=0.5)
    rasters = [risk, TOWN, cg.RasterRisk(TOWN.values, TOWN.bounds, unit="people/m2", scale=3.0)]
    problem = cg.Problem((1, 1), (2, 2), cg.RiskField(rasters=rasters), 5.0, TOWN.bounds)
    again = cg.load_scenario(cg.write_scenario(problem, tmp_path / "town.toml")).problem
    assert again == problem
    assert again.field.rasters[0].failures == risk.failures
    assert again.field.rasters[2].people == rasters[2].people


def test_counts_are_people(tmp_path: Path) -> None:
    np.save(tmp_path / "a.npy", [[4.0, 0.0]])
    counts = cg.RasterRisk.from_file(tmp_path / "a.npy", bounds=(0, 0, 200, 100), kind="count", scale=1e-7)
    assert counts.people is not None
    assert counts.people.greatest == pytest.approx(400.0)
    problem = cg.Problem((1, 1), (2, 2), cg.RiskField(rasters=[counts, TOWN]), bounds=(0, 0, 2000, 2000))
    assert cg.people_of(problem) == counts.people
    other = cg.RasterRisk([[1.0]], (0, 0, 2000, 2000), unit="people/km2")
    with pytest.raises(ProblemError, match="lie on different cells"):
        cg.people_of(cg.Problem((1, 1), (2, 2), cg.RiskField(rasters=[counts, other]), bounds=(0, 0, 2000, 2000)))


PARTS = {"failures_per_hour": 1e-3, "speed": 20.0, "lethal_area": 6.5}
KNOWN = cg.RasterRisk([[1.0]], (0, 0, 1000, 1000), unit="people/km2")
WRONG: list[tuple[Callable[[], object], str]] = [
    (lambda: cg.ground_risk(TOWN, unit="people", **PARTS), "unknown unit 'people' of people; choose one of people/km2"),  # type: ignore[arg-type]
    (lambda: cg.ground_risk(TOWN, unit="people/m2", **PARTS, fatality=1.5), "fatality is 1.5"),
    (lambda: cg.ground_risk(TOWN, unit="people/m2", **{**PARTS, "speed": 0.0}), "speed is 0"),
    (lambda: cg.ground_risk(TOWN, **PARTS), "its values have no unit"),
    (lambda: cg.ground_risk(KNOWN, unit="people/m2", **PARTS), "unit is 'people/m2', but the raster has people/km2"),
    (lambda: cg.ground_risk(KNOWN.scaled(2.0), **PARTS), "a scale of 2, a second factor"),
    (lambda: cg.ground_risk(cg.ground_risk(KNOWN, **PARTS), **PARTS), "already; give its people"),
    (lambda: cg.RasterRisk([[1.0]], (0, 0, 1, 1), unit="people"), "raster unit is 'people'"),  # type: ignore[arg-type]
    (lambda: cg.RasterRisk([[1.0]], (0, 0, 1, 1), failures=cg.FailureModel(1, 1, 1)), "no unit of people"),
    (lambda: cg.FailureModel.of_aircraft(failures_per_hour=1, speed=1), "lethal_area and dimension are missing"),
    (lambda: cg.FailureModel.of_aircraft(failures_per_hour=1, speed=1, dimension=41), "goes up to 40 m"),
    (lambda: cg.risk_weight(prevented_fatality=1.0, metre=0.0), "metre is 0"),
    (lambda: cg.risk_weight(prevented_fatality=-1.0, metre=1.0), "prevented_fatality is -1"),
]


@pytest.mark.parametrize(("make", "message"), WRONG)
def test_what_makes_no_risk_is_refused(make: Callable[[], object], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        make()


def test_a_sum_of_layers_knows_what_both_know() -> None:
    """Of people by day and by night, on the same cells: neither data nor the area that is known get more."""
    gap, half = np.array([[np.nan, np.nan, 4.0, 2.0]]), shapely.box(-500, -500, 2600, 1500)
    other = np.array([[np.nan, 3.0, np.nan, 2.0]])
    for turn in (1, -1):
        given = [(gap, 1.0, half, gap), (other, 5.0, None, other + 10.0)][::turn]
        layers = [
            cg.RasterRisk(values, (0, 0, 4000, 1000), unit="people/km2", nodata=nodata, covers=covers, peaks=peaks)
            for values, nodata, covers, peaks in given
        ]
        problem = cg.Problem((100, 500), (3900, 500), cg.RiskField(rasters=layers), bounds=(0, 0, 4000, 1000))
        both = cg.people_of(problem)
        assert both is not None
        assert both.cells.tolist() == [[6.0, 4.0, 9.0, 4.0]]
        assert both.highest.tolist() == [[6.0, 14.0, 9.0, 14.0]]
        assert both.filled.tolist() == [[True, False, False, False]]
        found = cg.exposure(problem, [(100, 500), (3900, 500)], max_density=20)
        assert (found.filled, found.outside > 0.0, found.meets_limit) == (5.0, True, None)
