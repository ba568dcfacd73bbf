"""Scenario files: content, shipped scenarios, and error messages."""

import json
import math
import tomllib
from pathlib import Path

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph.errors import MissionError, ScenarioError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.risk import RiskField, SmallSpreadWarning, Threat
from cgla_graph.scenarios import scenario as module
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import mission_from_toml
from cgla_graph.scenarios.scenario import load_scenario, scenario_from_toml, schema, shipped
from cgla_graph.scenarios.shipped import shipped_scenario
from cgla_graph.solvers.solving import solve

ENDS = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\n"
BASE = f"{ENDS}k = 1.0\n"
LONLAT = (
    'coordinates = "lonlat"\nbounds = [24.0, 60.0, 25.0, 61.0]\nstart = [24.1, 60.1]\ngoal = [24.9, 60.9]\nk = 1.0\n'
)
AREA = "[no_fly]\npolygons = [[[24.4, 60.4], [24.6, 60.4], [24.6, 60.6], [24.4, 60.6]]]\n"
NO_BOUNDS = LONLAT.replace("bounds = [24.0, 60.0, 25.0, 61.0]\n", "")
SQUARE = "[[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]"

unit = st.floats(0.0, 1.0)
points = st.tuples(unit, unit)


def message_of(text: str) -> str:
    with pytest.raises(ScenarioError) as caught:
        scenario_from_toml(text, "mine", where="some/mine.toml")
    message = str(caught.value)
    assert message.startswith("some/mine.toml: ")
    assert "\n" not in message
    assert isinstance(caught.value, ValueError)
    return message


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_load_and_fit_the_schema(name: str) -> None:
    scenario = load_scenario(name)
    assert scenario.name == name
    assert scenario.title
    table = tomllib.loads(shipped_scenario(name))
    module.ScenarioTable.model_validate(table)
    assert set(table) <= set(schema()["properties"])
    assert set(schema()["required"]) <= set(table)


@pytest.mark.parametrize("name", shipped())
def test_shipped_scenarios_can_be_solved(name: str) -> None:
    scenario = load_scenario(name)
    solution = solve(scenario.problem, "cgla", resolution=scenario.lattice)
    assert solution.status.label == "optimal"
    straight = scenario.problem.evaluate([scenario.problem.start, scenario.problem.goal])
    assert solution.cost < straight.cost or straight.violations, "a map on which the straight line wins shows nothing"


def test_schema_is_plain_json_and_refuses_unknown_keys() -> None:
    document = schema()
    assert json.loads(json.dumps(document)) == document
    assert document["additionalProperties"] is False
    assert all(table["additionalProperties"] is False for table in document["$defs"].values())
    assert document["required"] == ["k"]
    # one path, or a team
    assert [one["required"] for one in document["anyOf"]] == [["start", "goal"], ["uavs"]]


def test_paper_is_the_paper() -> None:
    scenario = load_scenario("paper")
    problem = scenario.problem
    assert (problem.start, problem.goal, problem.k) == ((0.1, 0.1), (0.9, 0.9), 10.0)
    assert scenario.lattice.shape == (20, 20)
    assert scenario.lattice.kind == "upper"
    assert len(problem.field.threats) == 10
    assert scenario.lattice.index_of(problem.start) is not None


@given(
    start=points,
    goal=points,
    k=st.floats(0.0, 1e6),
    threats=st.lists(st.tuples(unit, unit, st.floats(1e-3, 10.0), st.floats(1e-6, 1.0)), max_size=5),
    title=st.text(st.characters(exclude_categories=["Cs", "Cc"])),
    resolution=st.integers(2, 50),
)
def test_what_is_written_is_what_is_read(
    start: tuple[float, float],
    goal: tuple[float, float],
    k: float,
    threats: list[tuple[float, float, float, float]],
    title: str,
    resolution: int,
) -> None:
    lines = [f"{{ x = {x!r}, y = {y!r}, spread = {spread!r}, peak = {peak!r} }}" for x, y, spread, peak in threats]
    # a JSON text is a TOML text, but for code points above U+FFFF when escaped
    text = (
        f"title = {json.dumps(title, ensure_ascii=False)}\nstart = {list(start)}\ngoal = {list(goal)}\nk = {k!r}\n"
        f"threats = [{', '.join(lines)}]\n[lattice]\nresolution = {resolution}\n"
    )
    scenario = scenario_from_toml(text, "mine")
    problem = scenario.problem
    assert (problem.start, problem.goal, problem.k, problem.bounds) == (start, goal, k, (0.0, 0.0, 1.0, 1.0))
    assert problem.field == RiskField([Threat(x, y, spread=spread, peak=peak) for x, y, spread, peak in threats])
    assert (scenario.title, scenario.lattice.shape) == (title, (resolution, resolution))
    assert scenario_from_toml(text, "mine").problem == problem


def test_whole_numbers_are_numbers_and_sigma_reads_eq1() -> None:
    problem = scenario_from_toml("start = [1, 0]\ngoal = [1, 0]\nk = 3", "mine").problem
    assert (problem.start, problem.goal, problem.k) == ((1.0, 0.0), (1.0, 0.0), 3.0)
    field = scenario_from_toml(f"{BASE}threats = [{{ x = 0.5, y = 0.5, sigma = 0.2 }}]", "mine").problem.field
    assert field == RiskField([Threat.from_eq1(0.5, 0.5, 0.2)])


@pytest.mark.parametrize(
    ("text", "words"),
    [
        (ENDS.replace("0.1, 0.1", "2.0, 0.1") + "k = 1", ["start", "(2.0, 0.1)", "outside the bounds", "move it"]),
        (f"{BASE}[no_fly]\npolygons = [[[0.8, 0.8], [1, 0.8], [1, 1], [0.8, 1]]]", ["goal", "no-fly", "move it"]),
        (f"{ENDS}k = 1979-05-27", ["k:", "number"]),
        (f"{BASE}threats = [{{ x = 0.5, y = 0.5, spread = 0.1, peak = 2 }}]", ["threat 0", "peak 2", "improper"]),
        (f"{BASE}threats = [{{ x = 0.5, y = 0.5 }}]", ["spread", "sigma"]),
        (f"{BASE}threats = [{{ x = 0.5, y = 0.5, spread = 0.1, sigma = 0.1 }}]", ["spread", "sigma"]),
        (f"{BASE}threats = [{{ x = 0.5, spread = 0.1 }}]", ["threats.0.y", "needed"]),
        (f"{BASE}zzz = []", ["zzz", "unknown key", "known keys", "start"]),
        (
            f"{BASE}[no_fly]\npolygons = [[[0.4, 0.4], [0.6, 0.6], [0.6, 0.4], [0.4, 0.6]]]",
            ["polygons.0", "intersection"],
        ),
        (f'{BASE}[no_fly]\ngeojson = ["x.geojson"]', ["no_fly.geojson", "x.geojson", "lonlat"]),
        (f"{BASE}bounds = [0, 0, 0, 1]", ["bounds", "empty", "x_min < x_max"]),
        (f"{BASE}[random_threats]\ncount = 2\nseed = 1\nspread = [0.1, 0.2]\nclear = 9", ["no room", "lower clear"]),
        ("start = [0.1, 0.1]\ngoal = [0.9, 0.9]", ["k", "needed", "add it"]),
        ("", ["start", "needed", "start, goal, k"]),
        ("k = 1\nk = 2", ["not TOML", "overwrite"]),
        pytest.param(f"{BASE}title = {'[' * 5000}{']' * 5000}", ["not TOML"], id="deep"),
        pytest.param(f"{ENDS}k = 1{'0' * 5000}", ["not TOML"], id="digits"),
        (LONLAT.replace("[24.0, 60.0, 25.0, 61.0]", "[24.0, 61.0, 25.0, 60.0]"), ["bounds"]),
        # a point outside is named in its own units
        (LONLAT.replace("24.1", "26.5"), ["26.5"]),
        (LONLAT.replace("60.9]", "160.9]"), ["goal", "160.9"]),
        (f'{LONLAT}[no_fly]\ngeojson = ["none.geojson"]', ["none.geojson", "no such file"]),
        (NO_BOUNDS, ["nothing to lay bounds around", "add bounds"]),
        (NO_BOUNDS.replace("24.1, 60.1", "60.5, 24.5") + AREA, ["start (60.5, 24.5)", "longitude first? (24.5, 60.5)"]),
        (NO_BOUNDS.replace("24.9, 60.9", "14.9, 60.9") + AREA, ["goal (14.9, 60.9) is 518 km from the map", "bounds"]),
        (LONLAT.replace("24.1, 60.1", "60.1, 24.1"), ["start (60.1, 24.1)", "outside", "longitude first? (24.1"]),
        *(
            (f"{top}threats = [{{ x = 60.5, y = 24.5, spread = 5000 }}]\n{area}", ["threats.0 (60.5, 24.5)", "first?"])
            for top, area in ((LONLAT, ""), (NO_BOUNDS, AREA))
        ),
    ],
)
def test_mistakes_are_named(text: str, words: list[str]) -> None:
    message = message_of(text)
    assert not [word for word in words if word not in message], message


REFUSED = """
    k = -1.0 | k = nan | k = inf | k = "1" | k = true | title = 5 | treats = [] | coordinates = "mars"
    bounds = [0, 0, 1]
    threats = 5 | threats = [{ x = 0, y = 0, spread = -0.1 }] | threats = [{ x = 0, y = 0, spread = nan }]
    threats = [{ x = 0, y = 0, spread = 0.1, peak = 0 }] | threats = [{ x = 0, y = 0, spred = 0.1 }]
    lattice.resolution = 5.0 | lattice.resolution = [5, 5, 5] | lattice.kind = "hexagonal" | lattice.resolutions = 5
    no_fly.polygon = [] | no_fly.polygons = [[[0, 0], [1, 1]]] | no_fly.polygons = [[[0, inf], [1, 1], [0, 1]]]
    random_threats.count = 0 | random_threats.seed = -1 | random_threats.spreads = [0, 1]
    random_threats.spread = [0.2, 0.1]
    random_threats.spread = [0.0, 0.0] | solvers.cgla = 5
"""


@pytest.mark.parametrize("line", [line.strip() for line in REFUSED.replace("|", "\n").strip().splitlines()])
def test_values_and_keys_that_are_refused_are_named(line: str) -> None:
    rest = ENDS if line.startswith("k ") else BASE
    assert line.partition(" ")[0] in message_of(f"{line}\n{rest}")


def test_all_mistakes_are_named_the_own_typos_first() -> None:
    text = "start = [nan, 1]\ngoal = [2, '2']\nkk = 10\nthread = 3\nbounds = [0, 0, 3]\nzzz = 1"
    said = message_of(text).partition(": ")[2]
    assert said.startswith("kk: unknown key; did you mean k? thread: unknown key; did you mean threats?")
    assert "bounds: give at least 4, not 3 (it is [0, 0, 3]); start.0: give a finite number (it is nan);" in said
    assert said.endswith("and 1 more fault; cgla scenarios --schema lists allowed values")
    assert "needed" not in said


def test_bounds_across_the_antimeridian() -> None:
    text = LONLAT.replace("[24.0, 60.0, 25.0, 61.0]", "[179.0, 60.0, -179.0, 61.0]")
    problem = scenario_from_toml(text.replace("[24.1,", "[179.1,").replace("[24.9,", "[-179.1,"), "mine").problem
    width, height = np.diff(np.reshape(problem.bounds, (2, 2)), axis=0)[0]
    assert width == pytest.approx(111.7e3, rel=0.02)
    assert height == pytest.approx(111.4e3, rel=0.02)

    assert len(message_of(f"{BASE}title = [{'1.5, ' * 10_000}]")) < 1000


def test_start_on_the_border_in_degrees() -> None:
    text = LONLAT.replace("25.0, 61.0", "24.15, 61.0").replace("24.9", "24.1")
    scenario_from_toml(text.replace("24.1, 60.1", "24.075, 60.0"), "mine")


@pytest.mark.parametrize("table", ["[solvers.cglaa]\nx = 1", "[solvers.cgla]\nscheduel = 1"])
def test_settings_of_solvers_are_checked(
    tmp_path: Path, table: str, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    from cgla_graph.comparisons.cli.app import main  # noqa: PLC0415 - only here

    file = tmp_path / "mine.toml"
    file.write_text(f"{BASE}[lattice]\nresolution = 3\n{table}", encoding="utf-8")
    monkeypatch.setattr("sys.argv", ["cgla", "compare", str(file), "--solvers", "cgla"])
    with pytest.raises(SystemExit) as left:
        main()
    assert (left.value.code, "cgla" in capsys.readouterr().err) == (2, True)


def test_random_threats_are_the_same_every_time_and_keep_clear() -> None:
    text = f"{BASE}[random_threats]\ncount = 40\nseed = 7\nspread = [0.01, 0.05]\npeak = [0.2, 0.9]\nclear = 0.2"
    problem = scenario_from_toml(text, "mine").problem
    assert scenario_from_toml(text, "mine").problem == problem
    assert scenario_from_toml(text.replace("seed = 7", "seed = 8"), "mine").problem != problem
    threats = problem.field.threats
    assert len(threats) == 40
    assert all(0.01 <= threat.spread <= 0.05 and 0.2 <= threat.peak <= 0.9 for threat in threats)
    assert all(0.0 <= threat.x <= 1.0 and 0.0 <= threat.y <= 1.0 for threat in threats)
    ends = (problem.start, problem.goal)
    assert min(math.dist((threat.x, threat.y), end) for threat in threats for end in ends) >= 0.2


def test_random_threats_join_those_written() -> None:
    text = f"{BASE}threats = [{{ x = 0.5, y = 0.5, spread = 0.1 }}]\n"
    more = "[random_threats]\ncount = 3\nseed = 1\nspread = [0.1, 0.1]"
    threats = scenario_from_toml(text + more, "mine").problem.field.threats
    assert len(threats) == 4
    assert threats[0] == Threat(0.5, 0.5, spread=0.1)


def test_rings_may_be_closed_or_not() -> None:
    shut = SQUARE[:-1] + ", [0.4, 0.4]]"
    areas = [scenario_from_toml(f"{BASE}[no_fly]\npolygons = [{ring}]", "m").problem.no_fly for ring in (SQUARE, shut)]
    assert areas[0] is not None
    assert areas[0].equals(areas[1])
    assert areas[0].area == pytest.approx(0.04)


def test_degrees_become_metres() -> None:
    text = f"{LONLAT}threats = [{{ x = 24.5, y = 60.5, spread = 5000 }}]\n"
    scenario = scenario_from_toml(text, "mine")
    assert isinstance(scenario.projection, LocalProjection)
    start, goal = (np.array(end) for end in (scenario.problem.start, scenario.problem.goal))
    np.testing.assert_allclose(start, -goal, atol=1e-6, err_msg="the projection is centred between the ends")
    back = scenario.projection.inverse([scenario.problem.start, scenario.problem.goal])
    np.testing.assert_allclose(back, [(24.1, 60.1), (24.9, 60.9)], atol=1e-9)
    (threat,) = scenario.problem.field.threats
    np.testing.assert_allclose(scenario.projection.inverse((threat.x, threat.y)), (24.5, 60.5), atol=1e-9)
    assert threat.spread == 5000.0
    width, height = np.diff(np.reshape(scenario.problem.bounds, (2, 2)), axis=0)[0]
    assert width == pytest.approx(55.8e3, rel=0.01)
    assert height == pytest.approx(111.4e3, rel=0.01)


def test_bounds_in_degrees_are_laid_around_areas(tmp_path: Path) -> None:
    area = shapely.box(24.0, 60.0, 25.0, 61.0)
    (tmp_path / "areas.geojson").write_text(shapely.to_geojson(area), encoding="utf-8")
    (tmp_path / "mine.toml").write_text(
        NO_BOUNDS.replace("[24.1, 60.1]", "[23.9, 59.8]") + '[no_fly]\ngeojson = ["areas.geojson"]\n', encoding="utf-8"
    )
    with pytest.raises(ScenarioError, match=r"goal .* is inside the no-fly area"):
        load_scenario(tmp_path / "mine.toml")
    ends = {"start": (23.9, 59.8), "goal": (25.5, 60.9)}
    mine = load_scenario(tmp_path / "mine.toml", **ends)
    (bare,) = open_scenarios(str(tmp_path / "areas.geojson"), **ends)
    assert mine.problem.bounds == bare.problem.bounds
    assert (mine.problem.start, mine.problem.goal, mine.projection) == (
        bare.problem.start,
        bare.problem.goal,
        bare.projection,
    )


def test_bounds_in_degrees_are_laid_around_threats() -> None:
    text = f"{NO_BOUNDS}threats = [{{ x = 24.5, y = 60.5, spread = 9000 }}]\n"
    x_min, y_min, x_max, y_max = scenario_from_toml(text, "mine").problem.bounds
    # from one end to the other along x, and beyond the threat's three spreads nowhere, as the ends are farther away
    assert x_max - x_min == pytest.approx(2 * 3 * 1.05 * 9000, rel=0.1)
    assert y_max - y_min == pytest.approx(89.1e3, rel=0.02)


def test_a_mission_without_bounds_has_them_around_its_areas_too() -> None:
    uav = "[[uavs]]\nname = 'a'\nstart = [24.1, 60.5]\ngoal = [24.9, 60.5]\n"
    text = f"detection_radius = 9000\ncoordinates = 'lonlat'\n{AREA}{uav}"
    x_min, _, x_max, _ = mission_from_toml(text, "mine").world.bounds
    assert x_max - x_min == pytest.approx(44e3, rel=0.01)
    with pytest.raises(MissionError, match="longitude first"):
        mission_from_toml(text.replace("24.1, 60.5", "60.5, 24.5"), "mine")


def test_small_spreads_are_warned_of() -> None:
    with pytest.warns(SmallSpreadWarning, match=r"threat 0 has a spread of 0\.05 on a map .* wide"):
        scenario_from_toml(f"{LONLAT}threats = [{{ x = 24.5, y = 60.5, spread = 0.05 }}]", "mine")


def test_geojson_is_found_beside_the_scenario(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    area = shapely.box(24.4, 60.4, 24.6, 60.6)
    (tmp_path / "areas").mkdir()
    (tmp_path / "areas" / "one.geojson").write_text(shapely.to_geojson(area), encoding="utf-8")
    file = tmp_path / "mine.toml"
    file.write_text(f'{LONLAT}[no_fly]\ngeojson = ["areas/one.geojson"]', encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    scenario = load_scenario(file)
    assert scenario.problem.no_fly is not None
    assert scenario.projection is not None
    assert scenario.problem.no_fly.covers(shapely.Point(scenario.projection.forward((24.5, 60.5))))
    assert scenario.problem.no_fly.area == pytest.approx(11.05e3 * 22.28e3, rel=0.01)


def test_a_file_may_have_any_name(tmp_path: Path) -> None:
    names = "ünïcode 漢字", "with blanks", "[bold]x[bold]", "quo\"te'", "line\nbreak", "-dash", ".dot", "MINE"
    for name in names:
        file = tmp_path / (f"{name}.TOML" if name.isupper() else f"{name}.toml")
        file.write_text(BASE, encoding="utf-8")
        assert load_scenario(file).name == name
        assert load_scenario(str(file)).name == name
    with pytest.raises(ScenarioError, match="name"):
        load_scenario("a\0b.toml")


def test_unknown_names_offer_the_nearest() -> None:
    for name, near in (("papr", "paper"), ("fifty-treats", "fifty-threats"), ("mazes", "maze")):
        with pytest.raises(ScenarioError, match=f"{name}.*did you mean.*{near}.*[.]toml"):
            load_scenario(name)
    for name in ("", ".", "/", "..", "../paper", "a\0b", "\N{SNOWMAN}"):
        with pytest.raises(ScenarioError, match="unknown scenario"):
            load_scenario(name)


def test_shipped_come_in_order_without_doubles() -> None:
    names = shipped()
    assert names[0] == "paper"
    assert names[1:] == sorted(set(names) - {"paper"})


@pytest.mark.parametrize("spread", ["1e-320", "1e300"])
def test_spreads_at_the_ends_of_the_numbers(spread: str) -> None:
    text = f"{BASE}threats = [{{ x = 0.5, y = 0.5, spread = {spread} }}]"
    try:
        problem = scenario_from_toml(text, "mine").problem
    except ScenarioError:
        return
    assert math.isfinite(problem.evaluate([problem.start, problem.goal]).cost)


def test_a_mission_is_refused_as_a_scenario(tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match="fig8 is a mission, not a scenario; cgla fly fig8 flies it"):
        load_scenario("fig8")
    (tmp_path / "mine.toml").write_text("detection_radius = 1\n[[uavs]]\nname = 'a'", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"it has UAVs; cgla fly .*mine.toml flies it"):
        load_scenario(tmp_path / "mine.toml")
