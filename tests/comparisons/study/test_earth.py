"""Bounds of maps in longitude and latitude hold on the Earth."""

import math
import warnings
from pathlib import Path
from typing import Any, Literal

import numpy as np
import pyproj
import pytest
import shapely
from command_line import Call, caller
from hypothesis import given
from hypothesis import strategies as st
from map_files import AREAS, name_of
from strategies import few

from cgla_graph.certificate.certificate import Certificate, Grid
from cgla_graph.comparisons.cli.certify import certify
from cgla_graph.comparisons.study import earth, runner
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import Scenario, load_scenario, scenario_from_toml
from cgla_graph.solvers.solving import lower_bound
from cgla_graph.solvers.trade_off.constrained import PlanWithin

GEOD = pyproj.Geod(ellps="WGS84")
HELSINKI, TAMPERE = (24.94, 60.17), (23.76, 61.50)


@pytest.mark.parametrize("file", [file for file in AREAS if "controlled" not in file.name], ids=name_of)
def test_helsinki_to_tampere(file: Path) -> None:
    (scenario,) = open_scenarios(str(file), start=HELSINKI, goal=TAMPERE)
    geodesic = GEOD.inv(*HELSINKI, *TAMPERE)[2]
    assert geodesic == pytest.approx(161_490.120, abs=1e-3)
    (run,) = runner.compare([scenario], [Entrant.parse("straight-line")], tolerance=0.005)
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
    (run,) = runner.compare([scenario], [Entrant.parse("hybrid")], tolerance=0.02)
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


# The command line


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


@pytest.fixture
def areas(cgla: Call) -> Path:
    """Write two areas, 1,200 km apart, into the working folder of the command."""
    file = Path("areas.geojson")
    shapes = shapely.MultiPolygon([shapely.box(20.0, 59.5, 20.5, 60.0), shapely.box(31.0, 69.0, 31.5, 69.5)])
    file.write_text(shapely.to_geojson(shapes), encoding="utf-8")
    return file


def test_a_plan_shows_the_bound_on_the_earth_and_the_distortion(cgla: Call, areas: Path) -> None:
    words = ("plan", str(areas), "--start", "24.94,60.17", "--goal", "23.76,61.50", "--solver", "straight-line")
    lines = cgla(*words).out.splitlines()
    assert "bound      161490.119 m" in lines
    assert "flat map   lengths exceed those on the Earth by at most 0.0027 %; lower bounds allow for that" in lines
    document = cgla(*words, "--json").document()
    assert document["lower_bound"] <= 161_490.1205
    assert document["certificate"]["lower_bound"] <= 161_490.1205
    assert document["stretch"] == pytest.approx(1.0 + 2.7e-5, rel=1e-6)


@pytest.mark.parametrize("command", ["plan", "certify", "pareto", "compare"])
@pytest.mark.parametrize(
    ("ends", "said"),
    [
        (("--start", "60.17,24.94", "--goal", "61.50,23.76"), "start (60.17, 24.94) is 4,3"),
        (("--start=-24.94,60.17",), "start (-24.94, 60.17) is 2,4"),
    ],
)
def test_ends_off_the_map_are_one_line_and_exit_2(
    cgla: Call, areas: Path, command: str, ends: tuple[str, ...], said: str
) -> None:
    answer = cgla(command, str(areas), *ends)
    answer.refused(said)
    assert ("longitude first? (24.94, 60.17) is on the map" in answer.err) == ("60.17,24.94" in ends)


def test_a_wider_map_is_asked_for_with_bounds(cgla: Call, areas: Path) -> None:
    words = ("plan", str(areas), "--start=-24.94,60.17", "--goal", "24.94,60.17", "--solver", "straight-line")
    assert cgla(*words, "--bounds=-26,50,33,75", "--no-certificate").code == 0
    wrong = cgla(*words, "--bounds", "1,2,3")
    assert (wrong.code, "--bounds is '1,2,3'; give four numbers" in wrong.err) == (2, True)
    mission = cgla("compare", "fig4", "--bounds", "0,0,1,1")
    assert (mission.code, "--bounds is for maps" in mission.err) == (2, True)


def test_a_table_says_what_the_flat_map_does(cgla: Call) -> None:
    words = ("compare", "finland", "--solvers", "straight-line", "--no-certificate")
    assert "lengths exceed those on the Earth by at most 0.0056 %" in cgla(*words).out
    pareto = cgla("pareto", "finland", "--solver", "cgla", "--resolution", "5").out
    assert "lengths exceed those on the Earth by at most" in " ".join(pareto.split())


def test_a_warning_is_one_line(cgla: Call) -> None:
    Path("small.toml").write_text(
        "start = [24.1, 60.1]\ngoal = [24.9, 60.9]\nk = 1\ncoordinates = 'lonlat'\nbounds = [24, 60, 25, 61]\n"
        "threats = [{ x = 24.5, y = 60.5, spread = 0.05 }]",
        encoding="utf-8",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        answer = cgla("plan", "small.toml", "--solver", "straight-line", "--no-certificate")
    assert answer.code == 0
    assert "cgla: threat 0 has a spread of 0.05 on a map" in answer.err
    assert "warnings.warn" not in answer.err


# Budgets


def within(scenario: Scenario, limited: Literal["risk", "length"], budget: float, **fields: Any) -> PlanWithin:  # noqa: ANN401 - any field
    """Make a plan within a budget of a path on the Earth."""
    straight = np.array([scenario.problem.start, scenario.problem.goal])
    found = Solution(Status.FOUND, path=straight, length=240e3, risk=100.0)
    plan = {"solution": found, "k": 5.0, "scope": "plane", "n_solves": 1, **fields}
    return PlanWithin(limited=limited, budget=budget, **plan)


def test_what_is_proven_within_a_budget_holds_on_the_earth() -> None:
    finland = load_scenario("finland")
    straight = math.dist(finland.problem.start, finland.problem.goal)
    on_risk = within(finland, "risk", 100.0, dual_bound=239e3)
    expected = finland.bound_on_earth(239e3 + 5.0 * 100.0) - 5.0 * 100.0
    assert earth.plan_on_earth(finland, on_risk).dual_bound == pytest.approx(expected, rel=1e-9)
    direct = earth.plan_on_earth(finland, within(finland, "risk", 100.0, dual_bound=straight)).dual_bound
    assert straight - 1e-5 <= direct < straight
    on_length = within(finland, "length", 240e3, dual_bound=90.0)
    expected = (finland.bound_on_earth(5.0 * 90.0 + 240e3) - 240e3) / 5.0
    assert earth.plan_on_earth(finland, on_length).dual_bound == pytest.approx(expected, rel=1e-6)
    assert earth.plan_on_earth(finland, within(finland, "length", 240e3, dual_bound=1e-3)).dual_bound == 0.0
    lattice = within(finland, "risk", 100.0, dual_bound=239e3, scope="lattice")
    assert earth.plan_on_earth(finland, lattice) is lattice


def test_that_no_path_is_short_enough_is_said_of_the_earth_only_where_it_is_known() -> None:
    finland = load_scenario("finland")
    none = Solution(Status.NOT_FOUND, message="none is shorter than 234000 (proven)")
    for budget, bound in ((200e3, math.inf), (233.99e3, 0.0)):
        plan = within(finland, "length", budget, dual_bound=math.inf, solution=none, k=0.0)
        found = earth.plan_on_earth(finland, plan)
        assert found.dual_bound == bound
        assert found.message.endswith("; measured on the flat map")
