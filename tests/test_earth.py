"""Bounds of maps in longitude and latitude hold on the Earth."""

import math
from pathlib import Path

import numpy as np
import pyproj
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from map_files import AREAS, name_of
from strategies import few

from cgla_graph.certificate import Certificate, Grid, lower_bound
from cgla_graph.comparisons import earth, runner
from cgla_graph.comparisons.certify import certify
from cgla_graph.comparisons.contender import Contender
from cgla_graph.inputs import open_scenarios
from cgla_graph.scenario import Scenario, load_scenario, scenario_from_toml
from cgla_graph.solution import Solution, Status

GEOD = pyproj.Geod(ellps="WGS84")
HELSINKI, TAMPERE = (24.94, 60.17), (23.76, 61.50)


@pytest.mark.parametrize("file", [file for file in AREAS if "controlled" not in file.name], ids=name_of)
def test_helsinki_to_tampere(file: Path) -> None:
    (scenario,) = open_scenarios(str(file), start=HELSINKI, goal=TAMPERE)
    geodesic = GEOD.inv(*HELSINKI, *TAMPERE)[2]
    assert geodesic == pytest.approx(161_490.120, abs=1e-3)
    (run,) = runner.compare([scenario], [Contender.parse("straight-line")], tolerance=0.005)
    proof = certify(scenario, tolerance=0.001).certificate
    assert run.certificate is not None
    assert proof is not None
    for bound in (run.solution.lower_bound, run.certificate.lower_bound, proof.lower_bound):
        assert geodesic - 1e-5 <= bound <= geodesic
    assert run.solution.cost == pytest.approx(geodesic, abs=1e-5)


@few
@given(
    start=st.tuples(st.floats(-180.0, 180.0), st.floats(-85.0, 85.0)),
    azimuth=st.floats(-180.0, 180.0),
    distance=st.floats(1.0, 5e5),
    margin=st.floats(0.1, 4.0),
)
def test_no_bound_exceeds_the_geodesic(
    start: tuple[float, float], azimuth: float, distance: float, margin: float
) -> None:
    """Where the straight line may be flown: near the poles, across the antimeridian, anywhere."""
    goal = GEOD.fwd(*start, azimuth, distance)[:2]
    middle = 0.5 * math.remainder(goal[0] - start[0], 360.0)
    half = abs(middle) + margin
    west, east = (math.remainder(start[0] + middle + side, 360.0) for side in (-half, half))
    south, north = min(start[1], goal[1]) - margin, max(start[1], goal[1]) + margin
    ends = f"start = {list(start)}\ngoal = {list(goal)}\nk = 1\n"
    text = f"{ends}coordinates = 'lonlat'\nbounds = {[west, south, east, north]}"
    scenario = scenario_from_toml(text, "mine")
    problem = scenario.problem
    bound = lower_bound(problem, 0.01, path=[problem.start, problem.goal]).lower_bound
    assert scenario.bound_on_earth(bound) <= GEOD.inv(*start, *goal)[2]
    assert scenario.bound_on_earth(bound) == pytest.approx(distance, rel=1e-9, abs=1e-5)


def around_a_wall() -> Scenario:
    """Build a map of 1,600 km where every path makes a detour of hundreds of kilometres."""
    wall = "[[27.0, 55.0], [27.1, 55.0], [27.1, 66.0], [27.0, 66.0]]"
    return scenario_from_toml(
        "coordinates = 'lonlat'\nbounds = [10, 50, 44, 66.5]\nstart = [20, 60]\ngoal = [34, 60]\nk = 0\n"
        f"[no_fly]\npolygons = [{wall}]",
        "wall",
    )


def test_a_bound_holds_for_the_shortest_way_around_a_wall() -> None:
    scenario = around_a_wall()
    # the two corners that a taut line on the Earth touches
    on_earth = GEOD.line_length([20.0, 27.0, 27.1, 34.0], [60.0, 55.0, 55.0, 60.0])
    other = GEOD.line_length([20.0, 27.0, 27.1, 34.0], [60.0, 66.0, 66.0, 60.0])
    (run,) = runner.compare([scenario], [Contender.parse("hybrid")], tolerance=0.02)
    assert run.certificate is not None
    bound = run.certificate.lower_bound
    assert 0.97 * min(on_earth, other) < bound <= min(on_earth, other)
    assert run.certificate.tolerance == 0.02
    assert run.solution.lower_bound <= min(on_earth, other)


def test_a_map_in_the_plane_is_left_alone() -> None:
    paper = load_scenario("paper")
    proof = Certificate(1.0, 2.0, 0.1, 0.5, 4, "why", 0.1)
    solution = Solution(Status.FOUND, lower_bound=1.25)
    assert earth.certificate_on_earth(paper, proof, 0.1) is proof
    assert earth.solution_on_earth(paper, solution) is solution
    assert earth.plane_tolerance(paper, 0.01, 3.0) == 0.01
    assert paper.bound_on_earth(1.25) == 1.25
    assert paper.stretch(np.array([[5.0, 5.0]])) == 1.0
    assert earth.distortion_note(paper, []) == ""


def test_a_certificate_says_why_it_misses_its_tolerance_on_the_earth() -> None:
    finland = load_scenario("finland")
    proof = Certificate(240e3, 240e3, 1e-5, 0.0, 0, "no path is better", 0.1)
    tight = earth.certificate_on_earth(finland, proof, 1e-5)
    assert not tight.reached
    assert tight.message == "the bound allows 0.011 % for the distortion of the flat map"
    wide = earth.certificate_on_earth(finland, proof, 1e-2)
    assert (wide.reached, wide.message, wide.tolerance) == (True, "the gap is within the tolerance", 1e-2)
    assert wide.lower_bound < 240e3 == wide.upper_bound


def test_every_grid_of_a_certificate_is_on_the_earth() -> None:
    finland = load_scenario("finland")
    runs = np.zeros((0, 3), dtype=np.int64)
    grids = tuple(Grid(1e3, (8, 8), runs, bound, 243e3) for bound in (0.0, 236e3, 240e3))
    proof = Certificate(240e3, 243e3, 0.01, 1e3, 4, "why", 0.1, grids)
    found = earth.certificate_on_earth(finland, proof, 0.01)
    assert [grid.lower_bound for grid in found.grids] == [finland.bound_on_earth(one.lower_bound) for one in grids]
    assert found.grids[-1].lower_bound == found.lower_bound


@pytest.mark.parametrize("bound", [math.inf, math.nan])
def test_that_there_is_no_path_or_no_bound_stays_so(bound: float) -> None:
    proof = Certificate(bound, math.inf, 0.01, 0.0, 4, "why", 0.1)
    found = earth.certificate_on_earth(load_scenario("finland"), proof, 0.01)
    assert found.lower_bound == pytest.approx(bound, nan_ok=True)
    assert found.message == "why"


@given(ratio=st.floats(1e-12, 1.0))
def test_a_percentage_is_never_below_its_ratio(ratio: float) -> None:
    number, sign = earth.at_most_percent(ratio).split()
    assert sign == "%"
    assert ratio * (1.0 - 1e-12) <= float(number) / 100.0 <= ratio * 1.11


def test_risk_on_the_earth_is_bounded_too() -> None:
    """A path's cost with threats measured by geodesics is no less than the bound of its cost on the plane."""
    threats = "threats = [{ x = 27.0, y = 60.5, spread = 90000 }, { x = 24.0, y = 59.0, spread = 50000 }]"
    scenario = scenario_from_toml(
        "coordinates = 'lonlat'\nbounds = [10, 50, 44, 66.5]\nstart = [20, 60]\ngoal = [34, 60]\nk = 5\n" + threats, "m"
    )
    problem, projection = scenario.problem, scenario.projection
    assert projection is not None
    rng = np.random.default_rng(1)
    for _ in range(20):
        path = np.array([problem.start, *rng.uniform(-4e5, 4e5, (2, 2)).tolist(), problem.goal])
        line = shapely.segmentize(shapely.LineString(path), 1000.0)
        x, y = projection.inverse(shapely.get_coordinates(line)).T
        steps = np.array(GEOD.line_lengths(x, y))
        middles = 0.5 * (x[1:] + x[:-1]), 0.5 * (y[1:] + y[:-1])
        safe = np.ones(len(steps))
        for lon, lat, spread in ((27.0, 60.5, 9e4), (24.0, 59.0, 5e4)):
            away = np.array(GEOD.inv(*middles, np.full(len(steps), lon), np.full(len(steps), lat))[2])
            safe *= 1.0 - np.exp(-0.5 * (away / spread) ** 2)
        on_earth = float((steps * (1.0 + problem.k * (1.0 - safe))).sum())
        assert scenario.bound_on_earth(problem.evaluate(path).cost) <= on_earth * (1.0 + 1e-6)
