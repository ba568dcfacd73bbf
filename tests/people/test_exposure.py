"""What a path means for people on the ground: against integrals by hand, shapely, and random paths."""

import dataclasses
import itertools
import math
import pickle

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, few

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.people.below import DensityLimitWarning, density_limit, greatest_below, people_on
from cgla_graph.people.units import fatality_factor, risk_unit
from cgla_graph.testing import strategies as drawn

BOUNDS = (0.0, 0.0, 6000.0, 4000.0)
AIRCRAFT = {"failures_per_hour": 1e-3, "speed": 20.0, "lethal_area": 6.5, "fatality": 0.5}


def town(seed: int, **settings: object) -> cg.RasterRisk:
    """Draw a town of 6 x 4 cells of a square kilometre."""
    values = np.random.default_rng(seed).integers(0, 9000, (4, 6)).astype(float)
    return cg.RasterRisk(values, BOUNDS, **{"unit": "people/km2", **settings})  # type: ignore[arg-type]


def problem_on(*rasters: cg.RasterRisk, k: float = 0.0) -> cg.Problem:
    return cg.Problem((100, 100), (5900, 3900), cg.RiskField(rasters=rasters), k, BOUNDS)


@few
@given(seed=drawn.seeds, factor=st.floats(1e-6, 1e6), how=st.sampled_from(["bilinear", "nearest"]))
def test_fatalities_do_not_depend_on_the_scale_of_the_risk(seed: int, factor: float, how: str) -> None:
    people = town(seed, interpolation=how)
    problem = problem_on(cg.ground_risk(people, **AIRCRAFT))
    path = np.random.default_rng(seed).uniform((0, 0), (6000, 4000), (4, 2))
    found = cg.exposure(problem, path)
    # by hand: the mean density along the way, in people per m2
    samples = np.concatenate([np.linspace(a, b, 20_001)[:-1] for a, b in itertools.pairwise(path)])
    lengths = np.repeat(np.hypot(*np.diff(path, axis=0).T) / 20_000, 20_000)
    metres = float((people.density(samples) * lengths).sum()) / 1e6
    assert found.fatalities == pytest.approx(metres * 6.5 * 0.5 * 1e-3 / 3600 / 20, rel=1e-2)
    assert found.per_hour == pytest.approx(found.fatalities / (found.length / 20 / 3600))
    assert (found.unit, found.people) == ("expected fatalities", pytest.approx(people.values.sum()))
    scaled = dataclasses.replace(problem, field=cg.RiskField(rasters=[problem.field.rasters[0].scaled(factor)]))
    again = cg.exposure(scaled, path)
    assert again.fatalities == pytest.approx(found.fatalities, rel=1e-12)
    assert (again.people, again.greatest) == (found.people, found.greatest)
    assert fatality_factor(scaled.field) == pytest.approx(factor)
    assert pickle.loads(pickle.dumps(found)) == found  # noqa: S301 - our own


@few
@given(seed=drawn.seeds, corridor=st.sampled_from([0.0, 150.0, 900.0]), points=st.integers(1, 4))
def test_the_greatest_density_is_that_of_shapely(seed: int, corridor: float, points: int) -> None:
    people, rng = town(seed), np.random.default_rng(seed + 1)
    path = rng.uniform((-500, -500), (6500, 4500), (points, 2))
    line = shapely.LineString(path) if points > 1 else shapely.Point(path[0])
    wide = line.buffer(max(0.5 * corridor, 1e-3), quad_segs=64)
    cells = {
        (j, i): shapely.box(1000 * i, 1000 * j, 1000 * i + 1000, 1000 * j + 1000) for j in range(4) for i in range(6)
    }
    met = [people.cells[at] for at, cell in cells.items() if shapely.intersection(wide, cell).area > 1e-9]
    assert greatest_below(people, path, corridor=corridor) == max(met, default=0.0)


def test_layers_on_different_cells_add_up() -> None:
    fine, coarse = town(1), cg.RasterRisk([[700.0]], BOUNDS, unit="people/km2")
    found = cg.exposure(problem_on(fine, coarse), [(100, 100), (900, 100)])
    assert found.greatest == greatest_below(fine, np.array([(100, 100), (900, 100)])) + 700.0
    with pytest.raises(ProblemError, match="lie on different cells"):
        cg.below_density(problem_on(fine, coarse), 5000.0)
    # tiles beside one another do not
    tiles = [cg.RasterRisk([[5.0 + x]], (3000 * x, 0, 3000 + 3000 * x, 4000), unit="people/km2") for x in (0, 1)]
    assert cg.exposure(problem_on(*tiles), [(100, 100), (5900, 100)]).greatest == 6.0
    assert density_limit(problem_on(*tiles), 5.5).greatest == 6.0


def test_a_path_along_an_edge_is_below_no_cell() -> None:
    """As for limits: what touches is below."""
    wall = cg.RasterRisk([[1.0, 9.0]], (0, 0, 2, 1))
    assert greatest_below(wall, np.array([(1.0, 0.1), (1.0, 0.9)])) == 0.0
    assert greatest_below(wall, np.array([(0.5, 0.1), (0.5, 0.9)]), corridor=1.0) == 1.0


@given(seed=drawn.seeds, low=st.floats(-2000, 5000), width=st.floats(100, 9000))
@few
def test_people_on_a_part_of_the_map(seed: int, low: float, width: float) -> None:
    people = town(seed)
    fine = np.repeat(np.repeat(people.cells, 100, axis=0), 100, axis=1) / 1e4
    x = np.arange(600) * 10.0 + 5.0
    inside = (x > low) & (x < low + width)
    assert people_on(people, (low, -9e3, low + width, 9e3)) == pytest.approx(
        fine[:, inside].sum(), abs=2 * 20 * 9000 * 0.01 * 4
    )


@pytest.mark.slow
@given(seed=drawn.seeds, k=st.sampled_from([1e7, 1e9, 1e11]), target=st.sampled_from([1e-7, 1e-6, 1e-5]))
@examples(6)
def test_what_is_proven_of_other_paths_holds(seed: int, k: float, target: float) -> None:
    problem = problem_on(cg.ground_risk(town(seed), **AIRCRAFT), k=k)
    best = cg.solve(problem, tolerance=0.02)
    found = cg.exposure(problem, best.path, target=target, lower_bound=best.lower_bound)
    others = [
        cg.solve(dataclasses.replace(problem, k=weight), tolerance=None).path for weight in (1e6, 1e8, 1e10, 1e12)
    ]
    rng = np.random.default_rng(seed)
    others += [np.array([problem.start, *rng.uniform((0, 0), (6000, 4000), (2, 2)), problem.goal]) for _ in range(20)]
    for path in others:
        other = cg.exposure(problem, path, target=target)
        if other.length <= found.length:
            assert other.fatalities >= found.least_fatalities
        if other.meets_target:
            assert other.length >= found.least_length
    assert found.least_fatalities <= found.fatalities


def test_a_bracket_beside_a_small_risk_term() -> None:
    """The risk term may be small beside the length: its own bracket is what is known of the risk."""
    problem = problem_on(cg.ground_risk(town(3), **AIRCRAFT), k=1e9)
    best = cg.solve(problem, tolerance=0.005)
    found = cg.exposure(problem, best.path, lower_bound=best.lower_bound)
    assert 0.0 < found.least_fatalities <= found.fatalities
    assert found.least_fatalities == pytest.approx((best.lower_bound - best.length) / 1e9, rel=1e-6)
    # of a risk with another factor, it is still in fatalities
    scaled = cg.RiskField(rasters=[problem.field.rasters[0].scaled(4.0)])
    again = cg.exposure(dataclasses.replace(problem, field=scaled, k=0.25e9), best.path, lower_bound=best.lower_bound)
    assert again.least_fatalities == pytest.approx(found.least_fatalities)
    # and of a mixture it is not known
    mixed = dataclasses.replace(problem, field=cg.RiskField([cg.Threat(9, 9, 50.0)], rasters=problem.field.rasters))
    assert cg.exposure(mixed, best.path, lower_bound=best.lower_bound).least_fatalities == 0.0


@pytest.mark.slow
def test_the_bracket_holds_on_the_earth() -> None:
    """On the Earth the bound is lower, as lengths there are at most those on the map."""
    around = cg.Problem.in_degrees((24.0, 60.0), (34.0, 62.0), bounds=(22, 57, 36, 65)).projection
    assert around is not None
    values = np.random.default_rng(5).integers(0, 900, (8, 12)).astype(float)
    people = cg.RasterRisk(values, (-6e5, -5e5, 6e5, 5e5), unit="people/km2")
    risk = cg.ground_risk(people, **AIRCRAFT)
    problem = cg.Problem.in_degrees(
        (24.0, 60.0), (34.0, 62.0), bounds=(22, 57, 36, 65), rasters=[risk], k=3e9, projection=around
    )
    best = cg.solve(problem, tolerance=0.005)
    found = cg.exposure(problem, best, target=1e-6)
    assert found.fatalities == best.risk
    assert found.least_fatalities > 0.0
    assert found.stretch > 1.0
    # the same path, with lengths and risks as short as they may be on the Earth
    least = best.risk / problem.stretch(best.path)
    assert found.least_fatalities <= least
    for k in (1e8, 1e9, 1e10):
        other = cg.solve(dataclasses.replace(problem, k=k), tolerance=None)
        if other.length / problem.stretch(other.path) <= best.length:
            assert other.risk >= found.least_fatalities


def test_a_curve_has_its_own_numbers() -> None:
    problem = problem_on(cg.ground_risk(town(3), **AIRCRAFT), k=1e9)
    curve = cg.flyable(cg.solve(problem, "dijkstra", resolution=4), turn_radius=300.0)
    found = cg.exposure(problem, curve)
    assert (found.length, found.fatalities) == (curve.length, curve.risk)


def test_a_target_is_met_missed_or_not_known() -> None:
    problem = problem_on(cg.ground_risk(town(3), **AIRCRAFT))
    path = [(100, 100), (5900, 3900)]
    rate = cg.exposure(problem, path).per_hour
    assert cg.exposure(problem, path, target=rate * 1.001).meets_target
    missed = cg.exposure(problem, path, target=rate * 0.999)
    assert missed.meets_target is False
    assert missed.faults == [f"{rate:#.4g} expected fatalities per flight hour, above the target of {rate * 0.999:g}"]
    # outside the raster, no people are known
    outside = cg.exposure(problem, [(100, 100), (7000, 100)], target=1.0, max_density=1e6)
    assert (outside.meets_target, outside.meets_limit, outside.outside) == (None, None, pytest.approx(1000.0))
    assert "no people are known" in outside.faults[0]


@pytest.mark.parametrize(("unit", "per_km2"), [("people/km2", 1.0), ("people/m2", 1e6)])
@pytest.mark.parametrize("scale", [1.0, 4.514e-7])
def test_a_limit_is_in_people_per_km2(unit: str, per_km2: float, scale: float) -> None:
    values = np.array([[50.0, 400.0, 50.0], [50.0, 3000.0, 900.0], [50.0, 800.0, 50.0]]) / per_km2
    raster = cg.RasterRisk(values, (0, 0, 6000, 6000), unit=unit, scale=scale)  # type: ignore[arg-type]
    problem = cg.Problem((500, 5500), (5500, 500), cg.RiskField(rasters=[raster]), bounds=raster.bounds)
    limited = cg.below_density(problem, 800.0, corridor=200.0)
    assert limited.no_fly is not None
    assert shapely.contains_xy(limited.no_fly, 3000.0, 3000.0)
    assert not shapely.contains_xy(limited.no_fly, 3000.0, 5000.0)
    assert not shapely.contains_xy(limited.no_fly, 3000.0, 1000.0)
    assert [point.level for point in cg.density_front(problem, levels=[400.0, 800.0], tolerance=None)] == [400.0, 800.0]
    with pytest.warns(DensityLimitWarning, match="limits nothing, as no cell of the map is above 3000"):
        cg.below_density(problem, 3000.0)
    with pytest.warns(DensityLimitWarning, match="is it in another unit"):
        cg.below_density(problem, 3e7)
    with pytest.raises(ProblemError, match=r"has a density above 0.0005 people/km2 .* far below all densities"):
        cg.below_density(problem, 0.0005)


def test_a_limit_without_a_unit_is_said_or_refused() -> None:
    noise = cg.RasterRisk([[1.0, 5.0]], (0, 0, 2, 1))
    problem = cg.Problem((0.5, 0.5), (0.6, 0.5), cg.RiskField(rasters=[noise]), bounds=noise.bounds)
    assert density_limit(problem, 2.0).unit == "(the raster's own unit)"
    scaled = dataclasses.replace(problem, field=cg.RiskField(rasters=[noise.scaled(1e-6)]))
    for refused in (lambda: cg.below_density(scaled, 2.0), lambda: cg.exposure(scaled, [(0.5, 0.5)], max_density=2.0)):
        with pytest.raises(ProblemError, match="a limit of density on a raster with a scale of 1e-06"):
            refused()
    # without a limit, what is below is still shown
    assert cg.exposure(scaled, [(0.5, 0.5)]).density_unit == "(1e-06 x the raster's own unit)"


def test_prices_need_fatalities() -> None:
    prices = {"prevented_fatality": 2e6, "metre": 0.01}
    risk = cg.ground_risk(town(1), **AIRCRAFT)
    direct = cg.RasterRisk([[1e-9]], BOUNDS, unit="fatalities/m")
    for raster in (risk, direct):
        assert cg.at_prices(problem_on(raster), **prices).k == 2e8
    noise = cg.RasterRisk([[1.0]], BOUNDS)
    for rasters in ([town(1)], [noise], [risk.scaled(2.0)], [risk, noise], [direct.scaled(3.0)], []):
        with pytest.raises(ProblemError, match="needs expected fatalities"):
            cg.at_prices(problem_on(*rasters), **prices)
    with pytest.raises(ProblemError, match="needs the aircraft that fails"):
        cg.exposure(problem_on(town(1)), [(1, 1)], target=1e-6)


def test_an_aircraft_needs_people() -> None:
    aircraft = {"failures_per_hour": 1e-3, "speed": 20.0, "dimension": 1.0}
    flown = cg.flown_over(problem_on(town(1)), **aircraft)
    assert flown.field.rasters[0].failures == cg.FailureModel(1e-3, 20.0, 6.5)
    for wrong, message in (
        (problem_on(), "no raster of people"),
        (problem_on(cg.RasterRisk([[1.0]], BOUNDS)), "its values have no unit"),
        (problem_on(town(1).scaled(2.0)), "a scale of 2, a second factor"),
        (flown, "already"),
    ):
        with pytest.raises(ProblemError, match=message):
            cg.flown_over(wrong, **aircraft)
    for name in ("failures_per_hour", "speed"):
        with pytest.raises(ProblemError, match=f"{name} of the aircraft is missing"):
            cg.flown_over(problem_on(town(1)), **{**aircraft, name: None})


def test_units_of_risk_are_named() -> None:
    people, risk = town(1), cg.ground_risk(town(1), **AIRCRAFT)
    assert risk_unit(cg.RiskField(rasters=[people])) == "people/km2 x m"
    assert risk_unit(cg.RiskField(rasters=[risk])) == "expected fatalities"
    assert risk_unit(cg.RiskField(rasters=[risk.scaled(2.0)])) == "2 x expected fatalities"
    assert math.isnan(fatality_factor(cg.RiskField(rasters=[people, risk])))


def test_cells_without_data_are_said_in_any_unit() -> None:
    values = np.array([[1.0, np.nan]])
    for unit, text in ((None, "count as 6"), ("people/km2", "count as 3"), ("people/m2", "count as 3e+06")):
        noise = cg.RasterRisk(values, (0, 0, 6000, 4000), nodata=3.0, scale=2.0, unit=unit)
        found = cg.exposure(problem_on(noise), [(100, 100), (5900, 100)])
        assert any(text in line for line in found.lines().values()), found.lines()
