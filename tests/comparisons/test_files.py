"""Files of results: no partial file has a final name, and failed writes are errors of ours."""

import csv
import io
import json
import os
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from studies_small import named

from cgla_graph.comparisons import files
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.rows import COLUMNS
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.errors import OutputError
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.geojson import read_areas
from cgla_graph.scenarios.scenario import Scenario, load_scenario
from cgla_graph.solvers.solving import solve

DEVICE = Path("/dev/full")
needs_full_device = pytest.mark.skipif(not DEVICE.exists(), reason="no /dev/full here")

words = st.text(st.characters(exclude_categories=["Cs"]), max_size=30)
lines = st.text(st.characters(exclude_categories=["Cs"], exclude_characters="\r"), max_size=30)
numbers = st.floats(allow_nan=False, allow_infinity=False) | st.none()


@pytest.fixture
def one() -> Run:
    (run,) = compare([named("one")], [Entrant.parse("cgla")], 1)
    return run


def message_of(error: pytest.ExceptionInfo[OutputError], path: Path) -> str:
    message = str(error.value)
    assert message.startswith(f"{path}: cannot be written: ")
    assert "\n" not in message
    assert "--out" in message
    assert isinstance(error.value, OSError)
    return message


# Folders and whole files


def test_a_folder_is_made_with_its_parents_and_may_be_there(tmp_path: Path) -> None:
    for _ in range(2):
        assert files.make_folder(tmp_path / "a" / "b") == tmp_path / "a" / "b"
    assert list((tmp_path / "a" / "b").iterdir()) == []


@pytest.mark.parametrize("below", ["", "sub", "sub/sub"])
def test_no_folder_below_a_regular_file(tmp_path: Path, below: str) -> None:
    (tmp_path / "file").write_text("mine")
    with pytest.raises(OutputError) as caught:
        files.make_folder(tmp_path / "file" / below)
    message_of(caught, tmp_path / "file" / below)
    assert (tmp_path / "file").read_text() == "mine"


def test_text_is_written_as_it_is(tmp_path: Path) -> None:
    file = tmp_path / "file.txt"
    for text in ("a\r\nb\n", "ünï\N{SNOWMAN}", ""):
        assert files.write_text(file, text) == file
        assert file.read_bytes() == text.encode()
    assert list(tmp_path.iterdir()) == [file]


def test_what_cannot_be_renamed_leaves_nothing(tmp_path: Path) -> None:
    (tmp_path / "file.txt" / "in").mkdir(parents=True)
    with pytest.raises(OutputError) as caught:
        files.write_text(tmp_path / "file.txt", "text")
    message_of(caught, tmp_path / "file.txt")
    assert [path.name for path in tmp_path.iterdir()] == ["file.txt"]


def test_a_write_that_fails_keeps_the_old_file(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = files.write_text(tmp_path / "file.txt", "old")
    write = Path.write_bytes

    def half(path: Path, data: bytes) -> int:
        write(path, data[: len(data) // 2])
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(Path, "write_bytes", half)
    with pytest.raises(OutputError, match="No space left") as caught:
        files.write_text(file, "new and longer")
    message_of(caught, file)
    assert file.read_text(encoding="utf-8") == "old"
    assert list(tmp_path.iterdir()) == [file]


def test_a_name_that_is_no_utf8(tmp_path: Path) -> None:
    name = os.fsdecode(b"\xff")
    file = files.write_text(tmp_path / "file.csv", name)
    assert file.read_text(encoding="utf-8") == "\\udcff"
    files.append_text(file, name)
    assert file.read_text(encoding="utf-8") == "\\udcff" * 2


# What grows


@needs_full_device
def test_a_full_disk_is_told(tmp_path: Path) -> None:
    (tmp_path / "rows.jsonl").symlink_to(DEVICE)
    with pytest.raises(OutputError, match=r"No space left.*make room, or") as caught:
        files.append_text(tmp_path / "rows.jsonl", "a row")
    message_of(caught, tmp_path / "rows.jsonl")


def test_a_small_disk_that_fills_up(tiny_disk: Path) -> None:
    file, text = tiny_disk / "rows.jsonl", "x" * 999 + "\n"

    def fill() -> None:
        while True:
            files.append_text(file, text)

    with pytest.raises(OutputError, match="No space left"):
        fill()
    found = file.read_text(encoding="utf-8")
    assert len(found) > 10_000
    assert found == text * (len(found) // 1000), "a row was cut in two"


# JSON Lines and CSV


@given(texts=st.lists(words, max_size=4), number=numbers)
def test_json_lines_can_be_read_back(texts: list[str], number: float | None) -> None:
    rows = [{"message": text, "cost": number} for text in texts]
    written = files.json_lines(rows)
    assert [json.loads(line) for line in written.split("\n") if line] == rows
    assert written.count("\n") == len(rows)


def test_json_lines_know_no_nan() -> None:
    with pytest.raises(ValueError, match="JSON"):
        files.json_lines([{"cost": float("nan")}])


@example(texts=("a\rb", "", "c\r"), number=None)
@given(texts=st.tuples(lines, lines, lines), number=numbers)
def test_csv_can_be_read_back(texts: tuple[str, str, str], number: float | None) -> None:
    line: dict[str, Any] = dict.fromkeys(COLUMNS)
    line |= {"scenario": texts[0], "solver": texts[1], "message": texts[2], "cost": number}
    (found,) = csv.DictReader(io.StringIO(files.csv_text([line], COLUMNS), newline=""))
    assert (found["scenario"], found["solver"], found["message"]) == texts
    assert found["cost"] == ("" if number is None else repr(number))
    assert tuple(found) == COLUMNS


# Paths


def test_path_in_the_plane(one: Run) -> None:
    lines = list(csv.reader(io.StringIO(files.path_csv(one.scenario, one.solution))))
    assert lines[0] == ["x", "y"]
    np.testing.assert_array_equal(np.array(lines[1:], dtype=float), one.solution.path)
    with pytest.raises(OutputError, match="one has no longitudes"):
        files.path_geojson(one.scenario, one.solution)


def test_path_in_degrees() -> None:
    scenario = load_scenario("finland")
    solution = solve(scenario.problem, "straight-line")
    lines = list(csv.reader(io.StringIO(files.path_csv(scenario, solution))))
    assert lines[0] == ["x", "y", "longitude", "latitude"]
    table = np.array(lines[1:], dtype=float)
    np.testing.assert_array_equal(table[:, :2], solution.path)
    document = json.loads(files.path_geojson(scenario, solution))
    (feature,) = document["features"]
    assert feature["geometry"]["type"] == "LineString"
    np.testing.assert_array_equal(feature["geometry"]["coordinates"], table[:, 2:])
    assert feature["properties"]["solver"] == "straight-line"
    assert scenario.projection is not None
    np.testing.assert_allclose(scenario.projection.forward(table[:, 2:]), solution.path, atol=1e-6)


def test_a_path_of_one_point_is_valid_geojson(tmp_path: Path) -> None:
    scenario: Scenario = load_scenario("finland")
    here = Solution(Status.OPTIMAL, path=np.array([scenario.problem.start]), cost=0.0)
    document = json.loads(files.path_geojson(scenario, here))
    assert document["features"][0]["geometry"]["type"] == "Point"
    file = files.write_text(tmp_path / "path.geojson", json.dumps(document))
    with pytest.raises(ValueError, match="'Point'"):
        read_areas(file)


# Names of files


@given(names=st.lists(st.text(max_size=120), max_size=6))
def test_names_of_files_are_safe_and_different(names: list[str]) -> None:
    taken: set[str] = set()
    stems = [files.file_stem(name, taken) for name in names]
    assert len({stem.lower() for stem in stems}) == len(stems)
    for stem in stems:
        assert re.fullmatch(r"[\w.-]+", stem)
        assert not stem.startswith((".", "-"))
        assert len(stem) <= 90


@pytest.mark.parametrize(
    ("name", "stem"),
    [
        *(("paper", "paper"), ("arena:3", "arena-3"), ("../../etc/passwd", "etc-passwd")),
        *(("[bold]x[/bold]", "bold-x-bold"), ("a\nb\0c", "a-b-c"), ("Mäkiluoto 漢字", "Mäkiluoto-漢字")),
        *(("\N{SNOWMAN}", "scenario"), ("", "scenario"), ("...", "scenario")),
    ],
)
def test_file_stem(name: str, stem: str) -> None:
    assert files.file_stem(name, set()) == stem


def test_names_that_differ_in_case_only_stay_apart() -> None:
    taken: set[str] = set()
    assert [files.file_stem(name, taken) for name in ("Map", "map", "MAP")] == ["Map", "map-2", "MAP-3"]


def test_a_long_name_of_wide_characters_fits(tmp_path: Path) -> None:
    stem = files.file_stem("\N{CJK UNIFIED IDEOGRAPH-20000}" * 100, set())
    files.write_text(tmp_path / f"{stem}-cost.png", "")


@pytest.mark.parametrize("name", ["con", "NUL", "aux.txt", "com1"])
def test_names_of_devices_are_no_files(name: str) -> None:
    stem = files.file_stem(name, set())
    assert stem.partition(".")[0].upper() not in {"CON", "NUL", "AUX", "COM1"}
