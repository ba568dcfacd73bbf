"""Scenarios named on the command line: shipped names, TOML, GeoJSON, grid maps and their rows."""

import json
import math
from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from map_files import AREAS, SCENS, name_of
from scipy.sparse import csgraph

from cgla_graph.errors import ScenarioError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.scenarios.loading import MOST_CELLS, open_scenarios
from cgla_graph.scenarios.movingai import map_beside, read_map, read_scenario_rows
from cgla_graph.scenarios.scenario import Scenario, shipped
from cgla_graph.solvers.solving import solve

LONLAT = 'coordinates = "lonlat"\nstart = [24.1, 60.1]\ngoal = [24.9, 60.9]\nk = 1.0\n'
BASE = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 1.0\n"
OPEN = "type octile\nheight 3\nwidth 4\nmap\n....\n.@@.\n....\n"
SQUARE = shapely.box(24.0, 60.0, 25.0, 60.5)


def only(spec: object, **ends: tuple[float, float]) -> Scenario:
    (scenario,) = open_scenarios(str(spec), **ends)
    return scenario


def message_of(spec: object, **ends: tuple[float, float]) -> str:
    with pytest.raises(ScenarioError) as caught:
        list(open_scenarios(str(spec), **ends))
    message = str(caught.value)
    assert "\n" not in message
    return message


def written(folder: Path, name: str, text: str) -> Path:
    file = folder / name
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def scen(tmp_path: Path) -> Path:
    """Write a map of 4 x 3 cells, and a scenario file of three rows."""
    written(tmp_path, "tiny.map", OPEN)
    lines = [f"0 tiny.map 4 3 {row}\n" for row in ("0 0 2 2 4", "0 0 3 0 3", "0 1 3 1 5.0")]
    return written(tmp_path, "tiny.map.scen", "version 1\n" + "".join(lines))


def test_a_shipped_name() -> None:
    assert [only(name).name for name in shipped()] == shipped()


def test_another_start_and_goal_of_a_scenario_file(tmp_path: Path) -> None:
    file = written(tmp_path, "mine.toml", BASE)
    assert (only(file).name, only(file).problem.k) == ("mine", 1.0)
    problem = only(file, start=(0.25, 0.5), goal=(1.0, 1.0)).problem
    assert (problem.start, problem.goal) == ((0.25, 0.5), (1.0, 1.0))
    assert (only(file, goal=(0.5, 0.5)).problem.start, only(file).problem.goal) == ((0.1, 0.1), (0.9, 0.9))


def test_another_start_in_degrees() -> None:
    scenario = only("finland", start=(25.5, 60.1))
    assert scenario.projection is not None
    np.testing.assert_allclose(scenario.projection.inverse(scenario.problem.start), (25.5, 60.1), atol=1e-9)
    np.testing.assert_allclose(scenario.projection.inverse(scenario.problem.goal), (26.95, 60.46), atol=1e-9)


def test_other_ends_and_bounds_do_not_move_random_threats(tmp_path: Path) -> None:
    drawn = "[random_threats]\ncount = 5\nseed = 1\nspread = [3000, 9000]\nclear = 20000"
    file = written(tmp_path, "mine.toml", f"{LONLAT}bounds = [24, 60, 25, 61]\n{drawn}")
    one, two = only(file), only(file, start=(24.8, 60.2), bounds=(23.5, 59.5, 25.5, 61.5))
    places = [
        scenario.projection.inverse([(threat.x, threat.y) for threat in scenario.problem.field.threats])
        for scenario in (one, two)
        if scenario.projection is not None
    ]
    np.testing.assert_allclose(*places, atol=1e-9)
    assert [threat.spread for threat in one.problem.field.threats] == [t.spread for t in two.problem.field.threats]
    assert one.projection != two.projection


def test_other_bounds(tmp_path: Path) -> None:
    assert only("paper", bounds=(-1.0, 0.0, 2.0, 1.5), start=(-0.5, 0.2)).problem.bounds == (-1.0, 0.0, 2.0, 1.5)
    wide = only("finland", bounds=(20.0, 59.0, 29.0, 62.0), goal=(28.5, 61.5)).problem
    assert wide.bounds[2] - wide.bounds[0] > 480e3
    assert "outside the bounds" in message_of("paper", bounds=(0.2, 0.0, 1.0, 1.0))
    assert "bounds" in message_of("paper", bounds=(0.2, 0.0, 0.1, 1.0))
    assert "bounds" in message_of("finland", bounds=(0.2, 0.0, 1.0))
    file = written(tmp_path, "tiny.map", OPEN)
    assert "leave out others" in message_of(file, bounds=(0.0, 0.0, 4.0, 3.0))


@pytest.mark.parametrize(
    ("name", "ends"),
    [("paper", {"start": (2.0, 0.0)}), ("paper", {"goal": (math.nan, 0.0)}), ("finland", {"start": (500.0, 0.0)})],
)
def test_ends_that_are_not_allowed(name: str, ends: dict[str, tuple[float, float]]) -> None:
    message = message_of(name, **ends)
    assert message.startswith(f"{name}: ")
    assert next(iter(ends)) in message


# GeoJSON


def test_areas_are_crossed_from_corner_to_corner_or_between_given_ends(tmp_path: Path) -> None:
    file = written(tmp_path, "areas.json", shapely.to_geojson(SQUARE))
    given: dict[str, tuple[float, float]] = {"start": (23.0, 60.2), "goal": (26.0, 60.7)}
    for ends, expected in ((given, [(23.0, 60.2), (26.0, 60.7)]), ({}, [(23.95, 59.975), (25.05, 60.525)])):
        scenario = only(file, **ends)
        assert scenario.projection is not None
        back = scenario.projection.inverse([scenario.problem.start, scenario.problem.goal])
        np.testing.assert_allclose(back, expected, atol=1e-9)
    assert (scenario.name, scenario.y_down, scenario.problem.k) == ("areas", False, 0.0)
    assert scenario.problem.no_fly is not None
    assert scenario.projection is not None
    assert scenario.problem.no_fly.contains(shapely.Point(scenario.projection.forward((24.5, 60.25))))
    columns, rows = scenario.lattice.shape
    assert 700 <= columns * rows <= 1100
    dx, dy = scenario.lattice.spacing
    assert dx == pytest.approx(dy, rel=0.1)


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ({"goal": (60.4, 24.9)}, ["goal (60.4, 24.9)", "longitude first? (24.9, 60.4) is on the map"]),
        ({"start": (-24.94, 60.17)}, ["start (-24.94, 60.17)", "2,651 km from the map", "--bounds"]),
        ({"goal": (22.0, 60.2)}, ["goal (22.0, 60.2)", "108 km from the map", "--bounds"]),
        ({"start": (35.7, 139.7)}, ["start (35.7, 139.7) is no place on the Earth", "longitude first"]),
    ],
    ids=str,
)
def test_ends_far_from_the_areas_are_refused(
    tmp_path: Path, ends: dict[str, tuple[float, float]], words: list[str]
) -> None:
    message = message_of(written(tmp_path, "areas.geojson", shapely.to_geojson(SQUARE)), **ends)
    assert not [word for word in words if word not in message], message


def test_a_wider_map_is_asked_for(tmp_path: Path) -> None:
    file = written(tmp_path, "areas.geojson", shapely.to_geojson(SQUARE))
    problem = only(file, start=(20.0, 60.2), goal=(26.0, 60.7), bounds=(19.0, 59.0, 27.0, 61.0)).problem
    assert problem.bounds[2] - problem.bounds[0] > 440e3
    assert "outside the bounds" in message_of(file, start=(18.0, 60.2), bounds=(19.0, 59.0, 27.0, 61.0))


def test_ends_beyond_the_antimeridian_widen_a_map_across_it(tmp_path: Path) -> None:
    areas = shapely.MultiPolygon([shapely.box(179.5, -17.0, 180.0, -16.0), shapely.box(-180.0, -17.0, -179.5, -16.0)])
    file = written(tmp_path, "areas.geojson", shapely.to_geojson(areas))
    assert np.diff(only(file).problem.bounds[::2])[0] < 200e3
    problem = only(file, start=(179.0, -16.5), goal=(-179.0, -16.5)).problem
    assert problem.bounds[2] - problem.bounds[0] == pytest.approx(2 * 106.7e3, rel=0.01)


@given(
    west=st.floats(-170.0, 165.0),
    south=st.floats(-80.0, 75.0),
    width=st.floats(0.01, 5.0),
    height=st.floats(0.01, 5.0),
)
def test_areas_anywhere_have_their_ends_inside_the_bounds(
    tmp_path_factory: pytest.TempPathFactory, west: float, south: float, width: float, height: float
) -> None:
    area = shapely.box(west, south, west + width, south + height)
    file = written(tmp_path_factory.mktemp("areas"), "areas.geojson", shapely.to_geojson(area))
    problem = only(file).problem
    assert problem.no_fly is not None
    assert problem.no_fly.is_valid or all(part.is_valid for part in problem.no_fly.geoms)  # type: ignore[attr-defined]
    assert shapely.box(*problem.bounds).covers(problem.no_fly)
    assert problem.start[0] < problem.goal[0]
    assert problem.start[1] < problem.goal[1]


@pytest.mark.parametrize("file", AREAS, ids=name_of)
def test_real_areas_can_be_crossed(file: Path) -> None:
    scenario = only(file)
    answer = solve(scenario.problem, "cgla", resolution=scenario.lattice)
    assert answer.status.label == "optimal"
    assert scenario.problem.evaluate(answer.path).feasible


# Grid maps


def test_a_map_alone(tmp_path: Path) -> None:
    scenario = only(written(tmp_path, "tiny.map", OPEN))
    assert (scenario.name, scenario.y_down) == ("tiny", True)
    assert scenario.problem.bounds == (0.0, 0.0, 4.0, 3.0)
    assert scenario.lattice == Lattice((4, 3), bounds=(0, 0, 4, 3), kind="centre")
    assert solve(scenario.problem, "cgla", resolution=scenario.lattice).status.has_path


def test_a_map_with_ends_of_the_users_own(tmp_path: Path) -> None:
    file = written(tmp_path, "tiny.map", OPEN)
    problem = only(file, start=(0.25, 0.75)).problem
    assert problem.start == (0.25, 0.75)
    assert problem.goal == only(file).problem.goal
    assert "no-fly" in message_of(file, goal=(1.5, 1.5))
    assert "bounds" in message_of(file, goal=(1.5, 7.5))


def test_rows_of_a_map(scen: Path) -> None:
    names = ["tiny:0", "tiny:1", "tiny:2"]
    for rows, expected in (("", names), (":0-2", names), (":1-2", names[1:]), (":1-1", names[1:2])):
        assert [one.name for one in open_scenarios(f"{scen}{rows}")] == expected
    assert only(f"{scen}:2").problem.start == (0.5, 1.5)
    assert "row 2 of tiny.map.scen" in only(f"{scen}:2").title
    moved = only(f"{scen}:0", start=(3.5, 2.5)).problem
    assert (moved.start, moved.goal) == ((3.5, 2.5), only(f"{scen}:0").problem.goal)


@pytest.mark.parametrize("row", [0, 1, 2])
def test_rows_have_their_published_length(scen: Path, row: int) -> None:
    scenario = only(f"{scen}:{row}")
    answer = solve(scenario.problem, "eight-direction", **scenario.settings["eight-direction"])
    assert answer.status.label == "optimal"
    # no step cuts a corner of the wall
    assert answer.cost == pytest.approx([4.0, 3.0, 5.0][row])
    assert f"{[4, 3, 5][row]}" in scenario.title


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        (":3", "no row 3; it has rows 0 to 2"),
        (":0-3", "no row 3; it has rows 0 to 2"),
        (":0-99999999999999999999", "no row 99999999999999999999"),
        pytest.param(f":{'9' * 5000}", "names no row", id="digits"),
        *((rows, "FIRST-LAST") for rows in (":", ":-1", ":1-", ": 0", ":0:1")),
        (":2-1", "the last row 1 is before the first 2; write FIRST-LAST"),
    ],
)
def test_rows_out_of_range(scen: Path, rows: str, words: str) -> None:
    message = message_of(f"{scen}{rows}")
    assert words in message
    assert str(scen) in message


@pytest.mark.parametrize("name", ["mine.toml", "areas.geojson", "tiny.map"])
def test_only_a_scen_file_has_rows(tmp_path: Path, name: str) -> None:
    assert "only a .scen file has rows" in message_of(f"{tmp_path / name}:1")


def test_a_truncated_map(tmp_path: Path) -> None:
    for cut in (5, 9, 15, 25, 35, 45):
        assert "line" in message_of(written(tmp_path, f"cut{cut}.map", OPEN[:-cut]))


def test_a_row_on_a_blocked_cell(tmp_path: Path) -> None:
    written(tmp_path, "tiny.map", OPEN)
    file = written(tmp_path, "tiny.map.scen", "version 1\n0\ttiny.map\t4\t3\t1\t1\t0\t0\t1.5\n")
    assert "row 0 (column 1, row 1) is blocked" in message_of(file)


def test_a_map_that_was_written_anew(tmp_path: Path) -> None:
    assert only(written(tmp_path, "tiny.map", OPEN)).problem.bounds == (0.0, 0.0, 4.0, 3.0)
    anew = "type octile\nheight 2\nwidth 5\nmap\n.....\n.....\n"
    assert only(written(tmp_path, "tiny.map", anew)).problem.bounds == (0.0, 0.0, 5.0, 2.0)


def test_a_large_map_gets_a_smaller_lattice(tmp_path: Path) -> None:
    side = math.isqrt(MOST_CELLS) + 1
    file = written(tmp_path, "wide.map", f"type octile\nheight {side}\nwidth {side}\nmap\n" + f"{'.' * side}\n" * side)
    scenario = only(file)
    assert scenario.lattice.shape == (50, 50)
    assert scenario.settings["eight-direction"]["resolution"].shape == (side, side)


@pytest.mark.parametrize(("height", "width"), [(1, 4), (4, 1)])
def test_a_map_of_one_row(tmp_path: Path, height: int, width: int) -> None:
    text = f"type octile\nheight {height}\nwidth {width}\nmap\n" + f"{'.' * width}\n" * height
    scenario = only(written(tmp_path, "line.map", text))
    answer = solve(scenario.problem, "eight-direction", **scenario.settings["eight-direction"])
    assert answer.cost == pytest.approx(3.0)


@pytest.mark.parametrize("ending", ["toml", "geojson", "json", "map", "scen"])
def test_files_that_cannot_be_read(tmp_path: Path, ending: str) -> None:
    (tmp_path / f"folder.{ending}").mkdir()
    (tmp_path / f"junk.{ending}").write_bytes(bytes(range(256)) * 4)
    (tmp_path / f"null.{ending}").write_bytes(bytes(64))
    (tmp_path / f"empty.{ending}").touch()
    for name in ("folder", "junk", "null", "empty", "missing"):
        file = tmp_path / f"{name}.{ending}"
        assert str(file) in message_of(file)


# The published lengths


@pytest.mark.slow
@pytest.mark.parametrize("file", SCENS, ids=name_of)
def test_every_published_length(file: Path) -> None:
    """Eight directions with the corner rule reach the published optimum of every row."""
    rows = read_scenario_rows(file)
    grid = read_map(map_beside(file, rows[0]))
    height, width = grid.blocked.shape
    lattice = Lattice((width, height), bounds=grid.bounds, kind="centre")
    graph = GeometricGraph.eight_connected(lattice, no_fly=grid.no_fly(), corner_rule="both-free")
    cells = {row.index: [column + line * width for column, line in (row.start, row.goal)] for row in rows}
    assert lattice.points[cells[0][0]].tolist() == list(grid.centre(*rows[0].start))
    by_end = defaultdict(list)
    for row in rows:
        by_end[cells[row.index][1]].append(row)
    matrix = graph.to_csgraph()
    found = {}
    for goal, group in by_end.items():
        # no farther than the published lengths: the greatest part of the time
        limit = max(row.optimal_length for row in group) * 1.001 + 0.001
        costs = csgraph.dijkstra(matrix, indices=goal, limit=limit)
        found |= {row.index: costs[cells[row.index][0]] for row in group}
    published = [row.optimal_length for row in rows]
    np.testing.assert_allclose([found[row.index] for row in rows], published, rtol=1e-4, atol=1e-6)


@pytest.mark.slow
@pytest.mark.parametrize("file", SCENS, ids=name_of)
def test_published_lengths_from_file_to_solver(file: Path) -> None:
    rows = read_scenario_rows(file)
    for index in range(0, len(rows), 50):
        scenario = only(f"{file}:{index}")
        answer = solve(scenario.problem, "eight-direction", **scenario.settings["eight-direction"])
        expected = pytest.approx(rows[index].optimal_length, rel=1e-4, abs=1e-6)
        assert (answer.status.has_path, answer.cost) == (True, expected)


@pytest.mark.parametrize("coordinates", ["plane", "lonlat"])
def test_an_end_where_an_area_closes_the_border_is_refused_for_that(coordinates: str, tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    ring = "[[24, 60], [24.5, 60], [24.5, 60.5], [24, 60.5]]"
    text = f'k = 1.0\ncoordinates = "{coordinates}"\ngoal = [24.8, 60.9]\nbounds = [24, 60, 25, 61]\n'
    areas = f"[no_fly]\npolygons = [{ring}]\n"
    for start in ([24, 60], [24.2, 60], [24, 60.3]):
        file.write_text(f"start = {start}\n{text}{areas}")
        said = r"start \(.*\) is where the no-fly area 'no_fly.polygons.0' meets the border of the map, .* is closed"
        with pytest.raises(ScenarioError, match=said):
            list(open_scenarios(str(file)))
    file.write_text(f"start = [24.2, 60.2]\n{text}{areas}")
    with pytest.raises(ScenarioError, match=r"is inside the no-fly area 'no_fly\.polygons\.0'; move"):
        list(open_scenarios(str(file)))
    # the free end of a closed side, and wider bounds
    for start, wider in (([24.5, 60], text), ([24, 60], text.replace("[24, 60, 25", "[23, 59, 25"))):
        file.write_text(f"start = {start}\n{wider}{areas}")
        (scenario,) = open_scenarios(str(file))
        assert solve(scenario.problem, "visibility-graph").status.has_path


@pytest.mark.parametrize(
    ("start", "clearance", "said"),
    [
        ((24.95, 60.15), None, r"start \(24.95, 60.15\) is inside the no-fly area 'harbour'"),
        (
            (24.79, 60.15),
            3000.0,
            r"start \(24.79, 60.15\) is 555.472 m from the no-fly area 'harbour' of areas.geojson, and the clearance",
        ),
        ((60.15, 24.7), None, r"longitude first\? \(24.7, 60.15\) is 4.7 km from the map"),
    ],
)
def test_faults_of_ends_say_what_was_typed(
    start: tuple[float, float], clearance: float | None, said: str, tmp_path: Path
) -> None:
    ring = [[24.80, 60.10], [25.10, 60.10], [25.10, 60.20], [24.80, 60.20], [24.80, 60.10]]
    area = {"type": "Polygon", "coordinates": [ring]}
    feature = {"type": "Feature", "properties": {"Title": "harbour"}, "geometry": area}
    (tmp_path / "areas.geojson").write_text(json.dumps(feature))
    with pytest.raises(ScenarioError, match=said):
        list(open_scenarios(str(tmp_path / "areas.geojson"), start=start, goal=(25.2, 60.15), clearance=clearance))
