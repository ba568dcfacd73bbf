"""The profile of a path: exact sums, fine steps, and files that are whole."""

import csv
import dataclasses
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from typer.testing import CliRunner

from cgla_graph.comparisons import files
from cgla_graph.comparisons.cli.app import app
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status
from cgla_graph.plots.profile import COLUMNS, MOST_ROWS, profile_of, timed_profile_of, write_profile
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.testing.strategies import raster_fields
from cgla_graph.timed.moving import MovingThreat
from cgla_graph.timed.timed_map import RiskPer
from cgla_graph.timed.timed_problem import TimedProblem
from cgla_graph.timed.wind import Wind

PATH = np.array([(0.1, 0.1), (0.4, 0.7), (0.4, 0.7), (0.9, 0.9)])
FIELD = RiskField([Threat(0.5, 0.5, 0.1)], rasters=[RasterRisk([[1.0, 3.0], [0.0, 2.0]], (0, 0, 1, 1))])
PROBLEM = Problem((0.1, 0.1), (0.9, 0.9), FIELD, k=3.0)
SCENARIO = Scenario("people", "on the ground", PROBLEM, Lattice(4, bounds=PROBLEM.bounds))
PROFILE = profile_of(PROBLEM, PATH)
ON_EARTH = dataclasses.replace(PROBLEM, projection=LocalProjection(24.0, 60.0))


@given(raster_fields())
def test_it_ends_at_what_the_oracle_says(field: RiskField) -> None:
    problem = Problem((0.1, 0.1), (0.9, 0.9), field, k=2.0)
    profile, found = profile_of(problem, PATH), problem.evaluate(PATH)
    last = (profile.distance[-1], profile.risk[-1], profile.cost[-1])
    assert last == pytest.approx((found.length, found.risk, found.cost), rel=1e-9, abs=1e-9)
    assert (np.diff(profile.distance) >= 0.0).all()
    assert np.array_equal(profile.density, field.density(profile.points))


STORM = MovingThreat([(0.0, 0.2, 0.8), (2.0, 0.8, 0.2)], spread=0.1, peak=0.8)
TURNING = Wind([[[0.0, 0.2]], [[0.2, -0.1]]], [[[0.1, 0.0]], [[0.0, 0.1]]], (0, 0, 1, 1), times=[0, 1])


@pytest.mark.parametrize("wind", [None, (0.1, -0.2), TURNING])
@pytest.mark.parametrize("risk_per", ["ground", "time"])
def test_a_profile_in_time_ends_at_what_the_oracle_says(wind: Any, risk_per: RiskPer) -> None:  # noqa: ANN401
    """The density of the departure, or that of the place where the flight waits, would fail."""
    problem = TimedProblem.of(
        PROBLEM, speed=0.7, moving=[STORM], fields=[(0.8, FIELD)], wind=wind, waiting=0.3, risk_per=risk_per
    )
    first = problem.fly(PATH[:2], 0.1)
    waited = first[-1] + (0.25, 0.0, 0.0)
    rows = np.concatenate([first, [waited], problem.fly(PATH[2:], waited[0])[1:]])
    profile, found = timed_profile_of(problem, rows), problem.evaluate(rows)
    assert profile.times is not None
    last = (profile.times[-1], profile.distance[-1], profile.risk[-1], profile.cost[-1])
    assert last == pytest.approx((found.arrival, found.air_distance, found.risk, found.cost))
    assert np.abs(rows[:, 0, None] - profile.times).min(axis=1).max() < 1e-12
    assert (np.diff(profile.times) > 0.0).all()
    taken, steps = np.diff(profile.times), np.hypot(*np.diff(profile.points, axis=0).T)
    weights = taken if risk_per == "time" else np.where(steps > 0.0, steps, 0.7 * taken)
    gathered = np.cumsum(0.5 * (profile.density[1:] + profile.density[:-1]) * weights)
    np.testing.assert_allclose(gathered, profile.risk[1:], atol=0.02)


def test_a_profile_in_time_of_one_place_has_one_row() -> None:
    profile = timed_profile_of(TimedProblem((0, 0), (0, 0), speed=1.0), [(2, 0, 0)])
    assert profile.cost.tolist() == [0.0]


def test_every_waypoint_is_in_it_and_steps_are_fine() -> None:
    profile = profile_of(PROBLEM, PATH)
    assert {tuple(place) for place in PATH.tolist()} <= {tuple(place) for place in profile.points.tolist()}
    assert np.diff(profile.distance).max() <= 0.01 + 1e-12


def test_rows_stay_few_on_very_fine_cells() -> None:
    field = RiskField(rasters=[RasterRisk(np.ones((1, 200_000)), (0, 0, 1, 1))])
    profile = profile_of(Problem((0, 0), (1, 1), field), [(0, 0), (1, 1)])
    assert MOST_ROWS // 2 < len(profile.points) <= MOST_ROWS + 2


def test_a_path_of_one_point_has_one_row_and_none_is_refused() -> None:
    assert profile_of(PROBLEM, PATH[:1]).cost.tolist() == [0.0]
    with pytest.raises(ProblemError, match="at least one waypoint"):
        profile_of(PROBLEM, np.empty((0, 2)))


@pytest.mark.parametrize("ending", [".csv", ".png", ".svg", ".pdf"])
def test_the_same_path_gives_the_same_file(tmp_path: Path, ending: str) -> None:
    first, again = (write_profile(tmp_path / f"{name}{ending}", SCENARIO, PROFILE).read_bytes() for name in "ab")
    assert first == again
    assert {path.suffix for path in tmp_path.iterdir()} == {ending}


def test_the_table_has_degrees_where_the_map_has(tmp_path: Path) -> None:
    on_earth = Scenario("a", "", ON_EARTH, SCENARIO.lattice)
    text = write_profile(tmp_path / "a.csv", on_earth, PROFILE).read_text(encoding="utf-8")
    rows = list(csv.DictReader(text.splitlines()))
    assert list(rows[0]) == [*COLUMNS, "longitude", "latitude"]
    assert float(rows[-1]["cost"]) == pytest.approx(PROBLEM.evaluate(PATH).cost)


def test_paths_over_rasters_are_written_as_others_are() -> None:
    on_earth = Scenario("a", "", ON_EARTH, SCENARIO.lattice)
    found = PROBLEM.judge(Solution(Status.FOUND, path=PATH, cost=PROBLEM.evaluate(PATH).cost))
    assert len(files.path_csv(SCENARIO, found).splitlines()) == 1 + len(PATH)
    assert '"risk": ' in files.path_geojson(on_earth, found)


def test_the_command_writes_it_and_refuses_other_endings_at_once(tmp_path: Path) -> None:
    target = tmp_path / "along.csv"
    asked = ["plan", "one-threat", "--solver", "straight-line", "--no-certificate", "--profile"]
    done = CliRunner().invoke(app, [*asked, str(target)])
    assert (done.exit_code, "along.csv" in done.output) == (0, True)
    assert target.read_text(encoding="utf-8").startswith(",".join(COLUMNS))
    refused = CliRunner().invoke(app, [*asked, str(tmp_path / "along.txt")])
    assert isinstance(refused.exception, OutputError)
    assert "end it in" in str(refused.exception)
    with pytest.raises(OutputError, match="end it in"):
        write_profile(tmp_path / "a.txt", SCENARIO, PROFILE)
