"""Study files: contents, messages for mistakes, and no cell twice."""

import json
import math
import tomllib
from collections.abc import Callable
from itertools import combinations
from pathlib import Path
from typing import Any

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.comparisons.study.entrant import Entrant, _literal, every_solver
from cgla_graph.comparisons.study.options import number_names
from cgla_graph.comparisons.study.study import SEEDS, Study
from cgla_graph.comparisons.study.study_file import (
    EXAMPLE,
    is_study_file,
    read_study,
    study_from_toml,
    study_schema,
)
from cgla_graph.comparisons.study.study_tables import _written
from cgla_graph.errors import CglaError, StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.solution import TOLERANCE
from cgla_graph.scenarios.random_map import difficulty, random_scenario
from cgla_graph.scenarios.scenario import Scenario, load_scenario, scenario_from_toml, shipped
from cgla_graph.solvers import listing

BASE = "scenarios = ['paper']\nsolvers = ['cgla']\n"
MAP = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 1.0\n"
ONE = scenario_from_toml(MAP, "one")
GRID = "type octile\nheight 3\nwidth 4\nmap\n....\n.@@.\n....\n"
ROWS = "version 1\n" + "".join(f"0\tgrid.map\t4\t3\t0\t0\t{column}\t0\t{column}.0\n" for column in (1, 2, 3))


def message_of(text: str, folder: Path | None = None) -> str:
    with pytest.raises(StudyError) as caught:
        study_from_toml(text, folder, where="some/mine.toml")
    message = str(caught.value)
    assert message.startswith("some/mine.toml: ")
    assert "\n" not in message
    assert len(message) < 1500
    assert isinstance(caught.value, ValueError)
    return message


def labels(study: Study) -> list[str]:
    return [entrant.label for entrant in study.entrants]


def names(study: Study) -> list[str]:
    return [scenario.name for scenario in study.scenarios]


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """Make a folder with a file of each kind."""
    (tmp_path / "maps").mkdir()
    (tmp_path / "maps" / "mine.toml").write_text(MAP, encoding="utf-8")
    (tmp_path / "maps" / "grid.map").write_text(GRID, encoding="utf-8")
    (tmp_path / "maps" / "grid.map.scen").write_text(ROWS, encoding="utf-8")
    area = shapely.to_geojson(shapely.box(24.4, 60.4, 24.6, 60.6))
    (tmp_path / "maps" / "area.geojson").write_text(area, encoding="utf-8")
    (tmp_path / "flight.toml").write_text(
        "detection_radius = 0.2\n[[uavs]]\nname = 'a'\nstart = [0.1, 0.1]\ngoal = [0.9, 0.9]\n", encoding="utf-8"
    )
    return tmp_path


# What a file holds


def test_the_least_file() -> None:
    study = study_from_toml("scenarios = ['paper']", where="some/mine.toml")
    assert names(study) == ["paper"]
    assert labels(study) == [entrant.label for entrant in every_solver()]
    assert (list(study.seeds), study.tolerance, study.limits) == (list(SEEDS), TOLERANCE, Limits())
    assert (study.title, study.source) == ("mine", "scenarios = ['paper']")


def test_every_key_is_heard() -> None:
    text = """
        title = "all of it"
        scenarios = ["paper", { generate = "random", seeds = [4, 2], threats = 3, areas = 1, k = 2.0, resolution = 9 }]
        solvers = ["hybrid", { name = "prm-star", label = "quick", milestones = 500 }]
        seeds = [7, 3]
        refine = true
        tolerance = 0
        resolution = 12
        [budget]
        seconds = 0.5
        [limits]
        seconds = 30
        memory = "1.5 GiB"
        """
    study = study_from_toml(text)
    assert study.title == "all of it"
    assert names(study) == ["paper", "random-3-threats-1-area-4-k2", "random-3-threats-1-area-2-k2"]
    drawn = random_scenario(4, threats=3, areas=1, k=2.0, resolution=9)
    assert (study.scenarios[1].problem, study.scenarios[1].lattice) == (drawn.problem, drawn.lattice)
    assert study.scenarios[0].lattice.shape == (12, 12)
    assert labels(study) == ["hybrid+refine", "quick+refine"]
    quick = study.entrants[1]
    assert (quick.name, quick.settings, quick.budget, quick.refine) == (
        "prm-star",
        {"milestones": 500},
        {"seconds": 0.5},
        True,
    )
    assert (list(study.seeds), study.tolerance, study.limits) == ([7, 3], None, Limits(30.0, 1536.0))
    cells = [tuple(cell) for cell in study.cells()]
    assert cells[:3] == [("paper", "hybrid+refine", None), ("paper", "quick+refine", 7), ("paper", "quick+refine", 3)]


def test_the_resolution_of_a_study_is_that_of_its_random_maps() -> None:
    study = study_from_toml("scenarios = [{ generate = 'random', seeds = 1 }]\nresolution = 7\nsolvers = ['cgla']")
    assert study.scenarios[0].lattice == random_scenario(1, resolution=7).lattice


def test_files_are_found_from_the_folder_of_the_study(folder: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (folder / "elsewhere").mkdir()
    monkeypatch.chdir(folder / "elsewhere")
    file = folder / "maps" / "study.TOML"
    specs = ["mine.toml", "../maps/area.geojson", "grid.map", "grid.map.scen:1", "grid.map.scen:0-2", "maze"]
    text = f"scenarios = {json.dumps([*specs, str(folder / 'maps' / 'mine.toml')])}\nsolvers = ['cgla']"
    file.write_text(text, encoding="utf-8")
    study = read_study(file)
    assert names(study) == ["mine", "area", "grid", "grid:1", "grid:0", "grid:1-2", "grid:2", "maze", "mine-2"]
    assert study.title == "study"
    assert study.source == text


def test_a_file_as_windows_writes_it(folder: Path) -> None:
    file = folder / "windows.toml"
    file.write_bytes(b"\xef\xbb\xbf" + BASE.replace("\n", "\r\n").encode())
    assert names(read_study(file)) == ["paper"]


@pytest.mark.parametrize(
    ("memory", "megabytes"),
    [
        *(("512", 512.0), ("0.5", 0.5), ("'4 GiB'", 4096.0), ("'4GiB'", 4096.0), ("' 4 gib '", 4096.0)),
        *(("'512 MiB'", 512.0), ("'1 GB'", 1e9 / 2**20), ("'500 MB'", 5e8 / 2**20), ("'2048 KiB'", 2.0)),
        ("'0.5 TiB'", 524288.0),
    ],
)
def test_memory_is_read(memory: str, megabytes: float) -> None:
    assert study_from_toml(f"{BASE}[limits]\nmemory = {memory}").limits == Limits(600.0, megabytes)


def test_the_example_is_a_study_with_each_of_its_keys() -> None:
    study = study_from_toml(EXAMPLE)
    document = tomllib.loads(EXAMPLE)
    assert set(study_schema()["properties"]) - set(document) == {"metrics", "refine", "resolution"}
    assert "# refine = true" in EXAMPLE
    assert "# resolution = " in EXAMPLE
    assert len(study.scenarios) == 10
    assert not [one for one, other in combinations(study.scenarios, 2) if one.problem == other.problem]
    cells = list(study.cells())
    assert len(cells) == len(set(cells))
    for scenario in study.scenarios:
        if "to" in scenario.name:
            low, high = scenario.name.rpartition("-")[2].split("to")
            assert float(low) <= difficulty(scenario) < float(high)


def test_the_example_names_every_key_of_random_maps() -> None:
    keys = set(study_schema()["$defs"]["RandomTable"]["properties"])
    assert not [key for key in keys if key not in EXAMPLE]


def test_schema_is_plain_json_and_refuses_unknown_keys() -> None:
    document = study_schema()
    assert json.loads(json.dumps(document)) == document
    tables = {"": document, **document["$defs"]}
    open_tables = {name for name, table in tables.items() if table["additionalProperties"] is not False}
    assert open_tables == {"SolverTable"}


# Solvers as tables


@given(data=st.data())
@usual
def test_a_table_is_the_text_that_says_the_same(data: st.DataObject) -> None:
    text = data.draw(
        st.sampled_from(
            [
                "cgla:schedule=synchronous",
                "cgla:schedule=synchronous:early_stop=False",
                "eight-direction:resolution=(3, 4)",
                "eight-direction:resolution=7:corner_rule=both-free",
                "refine:base=cgla:tolerance=0.001",
                "fast-marching",
            ]
        )
    )
    parsed = Entrant.parse(text)
    values = {key: list(value) if isinstance(value, tuple) else value for key, value in parsed.settings.items()}
    keys = data.draw(st.permutations(list(values)))
    table = ", ".join([f'name = "{parsed.name}"', *(f"{key} = {json.dumps(values[key])}" for key in keys)])
    (entrant,) = study_from_toml(f"scenarios = ['paper']\nsolvers = [{{ {table} }}]").entrants
    assert (entrant.name, entrant.settings) == (parsed.name, parsed.settings)
    assert Entrant.parse(entrant.label) == entrant
    assert entrant.label == ":".join([parsed.name, *(part for key in keys for part in [text_of(text, key)])])


def text_of(text: str, key: str) -> str:
    return next(part for part in text.split(":") if part.startswith(f"{key}="))


@pytest.mark.parametrize("value", ["5", "None", "(1, 2)", "'x'", "5a", "plain words", "", "1_0", "[" * 300])
def test_a_text_stays_a_text_in_the_label(value: str) -> None:
    assert _literal(_written(value)) == value


def test_solvers_that_are_not_installed_enter(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(listing, "_is_installed", lambda *_: False)
    study = study_from_toml("scenarios = ['paper']\nsolvers = ['bit-star', { name = 'rrt-star', seed = 3 }]")
    assert [tuple(cell) for cell in study.cells()] == [("paper", "bit-star", None), ("paper", "rrt-star:seed=3", None)]


# Random maps


def test_random_maps_by_seeds() -> None:
    study = study_from_toml("scenarios = [{ generate = 'random', seeds = 3 }]\nsolvers = ['cgla']")
    assert [scenario.problem for scenario in study.scenarios] == [random_scenario(i).problem for i in (1, 2, 3)]


def test_random_maps_by_difficulty() -> None:
    table = "{ generate = 'random', buckets = [1.0, 2.0, inf], each = 2, areas = 2, resolution = 6 }"
    study = study_from_toml(f"scenarios = [{table}]\nsolvers = ['cgla']")
    ratios = [difficulty(scenario) for scenario in study.scenarios]
    assert [1.0 <= ratio < 2.0 for ratio in ratios] == [True, True, False, False]
    # the same maps by the same seeds, wherever they are tried
    listed = table.replace("each", "seeds = [40, 30, 20, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1], each")
    other = study_from_toml(f"scenarios = [{listed}]\nsolvers = ['cgla']")
    for scenario in (*study.scenarios, *other.scenarios):
        seed = int(scenario.name.split("-")[-2])
        assert scenario.problem == random_scenario(seed, areas=2, resolution=6).problem


def test_random_maps_of_other_settings_have_other_names() -> None:
    tables = ["k = 1.0", "k = 50.0", "areas = 1", "clear = 0.2", "threats = 3"]
    entries = ", ".join(f"{{ generate = 'random', seeds = 2, {table} }}" for table in tables)
    study = study_from_toml(f"scenarios = [{{ generate = 'random', seeds = 2 }}, {entries}]\nsolvers = ['cgla']")
    assert names(study)[:6] == [
        "random-10-threats-1",
        "random-10-threats-2",
        "random-10-threats-1-k1",
        "random-10-threats-2-k1",
        "random-10-threats-1-k50",
        "random-10-threats-2-k50",
    ]
    assert len(set(names(study))) == 12


# No run twice


@given(data=st.data())
@usual
def test_no_run_is_asked_for_twice(data: st.DataObject) -> None:
    drawn = [
        *("'paper'", "'maze'", "{ generate = 'random', seeds = 2 }"),
        *(
            "{ generate = 'random', seeds = [2, 5], areas = 1 }",
            "{ generate = 'random', buckets = [1, 1.5, 9], resolution = 4 }",
        ),
    ]
    named = ["'cgla'", "'prm-star'", "'prm-star:seed=2'", "{ name = 'prm-star', label = 'mine' }", "{ name = 'cgla' }"]
    scenarios = data.draw(st.lists(st.sampled_from(drawn), min_size=1, max_size=4))
    solvers = data.draw(st.lists(st.sampled_from(named), min_size=1, max_size=4))
    seeds = data.draw(st.one_of(st.integers(1, 4), st.lists(st.integers(1, 9), min_size=1, max_size=3)))
    refine = data.draw(st.booleans())
    text = (
        f"scenarios = [{', '.join(scenarios)}]\nsolvers = [{', '.join(solvers)}]\nseeds = {seeds}\n"
        f"refine = {str(refine).lower()}\n"
    )
    try:
        study = study_from_toml(text)
    except StudyError as error:
        same = [entry.replace("{ name = 'cgla' }", "'cgla'") for entry in solvers]
        twice = len(set(same)) < len(same) or (isinstance(seeds, list) and len(set(seeds)) < len(seeds))
        assert twice, error  # noqa: PT017 - an error is right or wrong
        return
    cells = list(study.cells())
    assert len(cells) == len(set(cells))
    assert cells == list(study_from_toml(text).cells())
    assert len(set(names(study))) == len(study.scenarios)
    assert len(set(labels(study))) == len(study.entrants)


@given(given_names=st.lists(st.sampled_from(["a", "a-2", "a-2-2", "a-3", "b"]), max_size=9))
def test_names_are_told_apart(given_names: list[str]) -> None:
    scenarios = [Scenario(name, "", ONE.problem, ONE.lattice) for name in given_names]
    numbered = [scenario.name for scenario in number_names(scenarios)]
    assert len(set(numbered)) == len(numbered)
    for name, new in zip(given_names, numbered, strict=True):
        assert new == name or new.startswith(f"{name}-")
    if len(set(given_names)) == len(given_names):
        assert numbered == given_names


# Mistakes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", ["scenarios", "needed", "cgla compare --example"]),
        ("scenarios = [5]", ["scenarios.0", "text", "5"]),
        ("scenarios = [['paper']]", ["scenarios.0", "text"]),
        ("scenarios = ['papr']", ["scenarios.0", "unknown scenario 'papr'", "did you mean paper"]),
        ("scenarios = ['paper', 'none.toml']", ["scenarios.1", "none.toml", "no such file"]),
        ("scenarios = ['x.scen:a']", ["scenarios.0", "'a' names no row", "FIRST-LAST"]),
        ("scenarios = ['paper:3']", ["scenarios.0", "paper:3"]),
        ("scenarios = ['fig8']", ["scenarios.0", "'fig8' is a mission", "cgla compare fig8 flies it"]),
        ("scenarios = [{ generate = 'maze' }]", ["scenarios.0.generate", "'random'", "'maze'"]),
        ("scenarios = [{ generate = 'random' }]", ["scenarios.0", "give seeds = N"]),
        ("scenarios = [{ generate = 'random', seeds = 3, each = 2 }]", ["scenarios.0", "buckets ="]),
        ("scenarios = [{ generate = 'random', seeds = [1, 2, 1] }]", ["scenarios.0.seeds", "1 is given twice"]),
        ("scenarios = [{ generate = 'random', seeds = 'all' }]", ["scenarios.0.seeds", "whole number", "'all'"]),
        ("scenarios = [{ generate = 'random', seed = 3 }]", ["scenarios.0.seed", "unknown key", "mean seeds"]),
        ("scenarios = [{ generate = 'random', seeds = 1, zzz = 3 }]", ["scenarios.0.zzz", "known keys", "area_radius"]),
        ("scenarios = [{ generate = 'random', seeds = 1, threats = -1 }]", ["scenarios.0", "threats is -1"]),
        ("scenarios = [{ generate = 'random', seeds = 1, areas = 90 }]", ["scenarios.0", "no room for area"]),
        ("scenarios = [{ generate = 'random', seeds = 1, spread = [2, 1] }]", ["scenarios.0.spread", "[2, 1]"]),
        ("scenarios = [{ generate = 'random', seeds = 1, peak = [1, 2] }]", ["scenarios.0", "peak", "at most 1"]),
        ("scenarios = [{ generate = 'random', seeds = 1, start = [2, 1] }]", ["scenarios.0", "start", "outside"]),
        ("scenarios = [{ generate = 'random', buckets = [2, 1] }]", ["scenarios.0", "buckets", "rise"]),
        ("scenarios = [{ generate = 'random', buckets = [1, nan] }]", ["scenarios.0", "nan"]),
        (
            "scenarios = [{ generate = 'random', buckets = [80, 90], seeds = 3, resolution = 3 }]",
            ["scenarios.0", "3 random maps did not fill", "80 to 90 has 0"],
        ),
        (f"{BASE}solver = ['cgla']", ["solver", "unknown key", "mean solvers"]),
        (
            "scenarios = ['paper']\nsolvers = ['cgla', 'cgl']",
            ["solvers.1", "unknown solver 'cgl'", "did you mean cgla"],
        ),
        ("scenarios = ['paper']\nsolvers = ['cgla:a=1']", ["solvers.0", "no setting 'a'", "schedule"]),
        ("scenarios = ['paper']\nsolvers = [{ name = 'cgla', scheduel = 1 }]", ["solvers.0", "no setting 'scheduel'"]),
        (
            "scenarios = ['paper']\nsolvers = [{ name = 'cgla', schedule = 1979-05-27 }]",
            ["solvers.0.schedule", "give a number, a text"],
        ),
        ("scenarios = ['paper']\nsolvers = [{ name = 'cgla', label = 'a\\nb' }]".replace("'", '"'), ["one line"]),
        (
            "scenarios = ['paper']\nsolvers = ['cgla', 'cgla']",
            ["solvers.1", "'cgla'", "solvers.0 too", "label of its own"],
        ),
        ("scenarios = ['paper']\nsolvers = ['hybrid', { name = 'cgla', label = 'hybrid' }]", ["solvers.1", "'hybrid'"]),
        (f"{BASE}seeds = [1, 1]", ["seeds", "1 is given twice"]),
        (f"{BASE}seeds = '1-5'", ["seeds", "whole number", "'1-5'"]),
        (f"{BASE}budget = {{ minutes = 1 }}", ["budget.minutes", "unknown key", "seconds"]),
        (f"{BASE}tolerance = nan", ["tolerance", "nan"]),
        (f"{BASE}limits = {{ memory = '4' }}", ["limits.memory", "500 MB", "'4'"]),
        (f"{BASE}limits = {{ memory = '4 Gigs' }}", ["limits.memory", "4 GiB"]),
        (f"{BASE}limits = {{ memory = '-4 GiB' }}", ["limits.memory", "'-4 GiB'"]),
        (f"{BASE}limits = {{ memory = '0 GiB' }}", ["limits.memory", "greater than 0"]),
        (f"{BASE}limits = {{ memory = '٤ GiB' }}", ["limits.memory", "4 GiB"]),
        (f"{BASE}limits = {{ memory = '9{'9' * 400} TB' }}", ["limits.memory"]),
        (f"{BASE}limits = {{ megabytes = 5 }}", ["limits.megabytes", "unknown key", "memory"]),
        (f'{BASE}title = "two\\nlines"', ["title", "one line"]),
        ("scenarios = [", ["not TOML"]),
        ("\0", ["not TOML"]),
        (f"scenarios = {'[' * 3000}", ["not TOML"]),
    ],
)
def test_mistakes_are_named(text: str, words: list[str]) -> None:
    message = message_of(text)
    assert not [word for word in words if word not in message], message


#: Values that are refused, by key: of a study, and of its random maps.
WRONG = {
    "scenarios": ["[]", "'paper'", "['none.map']", "['']", '["a\\u0000.toml"]', "[{ seeds = 3 }]"],
    "solvers": ["[]", "'cgla'", "['cgla,dijkstra']", "[{ label = 'x' }]", "[{ name = 'cgl' }]"],
    "seeds": ["0", "true", "[]"],
    "budget": ["5", "{ seconds = 0 }", "{ iterations = 1.5 }", "{ evaluations = -5 }"],
    "limits": ["{ seconds = 0 }", "{ seconds = 1e300 }", "{ memory = 0 }", "{ memory = true }"],
    "resolution": ["1", "10000000", "[3, 4]"],
    "refine": ["1"],
    "tolerance": ["-0.1"],
    "title": ["5"],
}
WRONG_MAPS = {
    "seeds": ["0", "10000000", "[]", "[1.5]", "[-1]"],
    "k": ["-1", "inf"],
    "resolution": ["1"],
    "buckets": ["[1.5]", "[0.5, 2]"],
}


@pytest.mark.parametrize(
    ("of_map", "key", "wrong"),
    [(keys is WRONG_MAPS, key, one) for keys in (WRONG, WRONG_MAPS) for key, values in keys.items() for one in values],
)
def test_values_that_are_not_allowed_are_refused(of_map: bool, key: str, wrong: str) -> None:
    if of_map:
        seeds = "" if key == "seeds" else "seeds = 1, "
        assert f"scenarios.0.{key}" in message_of(f"scenarios = [{{ generate = 'random', {seeds}{key} = {wrong} }}]")
    else:
        given = "" if key == "scenarios" else "scenarios = ['paper']\n"
        assert key in message_of(f"{given}{key} = {wrong}")


def test_a_setting_of_a_scenario_is_checked(folder: Path) -> None:
    (folder / "wrong.toml").write_text(f"{MAP}[solvers.cgla]\nscheduel = 1", encoding="utf-8")
    assert "scenarios.0: wrong: solvers.cgla:" in message_of("scenarios = ['wrong.toml']", folder)


def test_missions_are_flown_by_another_word(folder: Path) -> None:
    message = message_of("scenarios = ['maps/mine.toml', 'flight.toml']", folder)
    assert "scenarios.1: 'flight.toml' is a mission" in message
    assert f"cgla compare {folder / 'flight.toml'} flies it" in message


def test_rows_that_are_not_there(folder: Path) -> None:
    assert "there is no row 3; it has rows 0 to 2" in message_of("scenarios = ['maps/grid.map.scen:1-3']", folder)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("seeds = [99999999999999, 1]", ["seeds, for solvers.1", "prm-star", "seed"]),
        ("seeds = [1, 99999999999999]", ["seeds, for solvers.1", "99999999999999"]),
        ("budget = { evaluations = 99999999999999999999 }", ["budget"]),
    ],
)
def test_what_a_solver_does_not_allow_is_found_before_any_run(text: str, words: list[str]) -> None:
    message = message_of(f"scenarios = ['paper']\nsolvers = ['cgla', 'prm-star']\n{text}")
    assert not [word for word in words if word not in message], message


@given(text=st.text())
def test_any_text_is_read_or_refused(text: str) -> None:
    with pytest.raises(StudyError):
        study_from_toml(text)


leaf: st.SearchStrategy[Any] = st.one_of(
    st.booleans(), st.integers(-3, 3), st.floats(-2.0, 2.0), st.sampled_from(["paper", "cgla", "random", "", "4 GiB"])
)
keys = st.sampled_from(
    ["generate", "seeds", "buckets", "each", "name", "label", "seconds", "memory", "iterations", "k", "schedule"]
)
value = st.recursive(
    leaf, lambda inner: st.lists(inner, max_size=3) | st.dictionaries(keys, inner, max_size=3), max_leaves=5
)


@given(document=st.dictionaries(st.sampled_from(sorted(study_schema()["properties"])), value, max_size=4))
def test_any_values_are_read_or_refused(document: dict[str, Any]) -> None:
    text = "".join(f"{key} = {toml(part)}\n" for key, part in ({"scenarios": ["paper"]} | document).items())
    try:
        study = study_from_toml(text)
    except StudyError as error:
        assert str(error).startswith("study.toml: ")  # noqa: PT017 - each error names the file
        assert "\n" not in str(error)  # noqa: PT017 - and is one line
        return
    assert list(study.cells())


def toml(value: Any) -> str:  # noqa: ANN401 - any drawn value
    """Write a value as TOML."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{key} = {toml(part)}" for key, part in value.items()) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(toml(part) for part in value) + "]"
    if isinstance(value, float) and not math.isfinite(value):
        return str(value)
    return json.dumps(value)


# Files


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (lambda _: None, "no such file"),
        (Path.mkdir, "cannot be read"),
        (lambda file: file.write_bytes(bytes(range(256))), "UTF-8"),
    ],
)
def test_files_that_cannot_be_read(tmp_path: Path, make: Callable[[Path], object], words: str) -> None:
    file = tmp_path / "mine.toml"
    make(file)
    with pytest.raises(StudyError, match=words) as caught:
        read_study(file)
    assert str(caught.value).startswith(str(file))
    assert not is_study_file(file)


@pytest.mark.parametrize(
    ("text", "is_study"),
    [
        *((text, True) for text in ("scenarios = ['paper']", "scenarios = 5", "seeds = 5\nsolvers = ['cgla']")),
        ("scenarios = ['paper']\nk = 5", True),
        *((text, False) for text in (MAP, f"{MAP}resolution = 5", f"{MAP}[solvers.cgla]", "title = 'x'", "")),
        *((text, False) for text in ("scenarios = [", f"a = {'[' * 3000}")),
    ],
)
def test_a_study_is_known_by_its_keys(tmp_path: Path, text: str, is_study: bool) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(text, encoding="utf-8")
    assert is_study_file(file) is is_study
    assert is_study_file(str(file)) is is_study
    assert not is_study_file(str(file).removesuffix(".toml"))


def test_no_shipped_file_is_a_study(folder: Path) -> None:
    assert not [name for name in ("", ".", "fig8", *shipped()) if is_study_file(name)]
    assert not is_study_file(folder / "flight.toml")
    assert not is_study_file(folder / "maps" / "grid.map.scen")


def test_a_study_is_no_scenario(tmp_path: Path) -> None:
    file = tmp_path / "mine.toml"
    file.write_text(EXAMPLE, encoding="utf-8")
    assert is_study_file(file)
    with pytest.raises(CglaError, match=r"unknown key|needed"):
        load_scenario(file)
    assert "scenarios.0" in message_of("scenarios = ['mine.toml']", tmp_path)
