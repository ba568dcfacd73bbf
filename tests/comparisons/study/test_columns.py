"""The columns of a run: one entry makes one in every file, on the terminal and in the report."""

import csv
import dataclasses
import json
import re
from pathlib import Path

import pytest
from new_column import write_study_with_it
from report_studies import small_runs, stored_of
from rich.console import Console

from cgla_graph.comparisons.results.exports import RUN_COLUMNS
from cgla_graph.comparisons.results.tables import runs_table
from cgla_graph.comparisons.study.rows import COLUMNS, row, shown


@pytest.fixture(scope="module")
def written(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Return a folder of files with one more column."""
    folder = tmp_path_factory.mktemp("written")
    write_study_with_it(folder)
    return folder


def records(file: Path) -> list[dict[str, str]]:
    with file.open(encoding="utf-8", newline="") as lines:
        return list(csv.DictReader(lines))


@pytest.mark.slow
@pytest.mark.parametrize(("name", "columns"), [("rows.csv", COLUMNS), ("export.csv", RUN_COLUMNS)])
def test_a_new_column_is_in_files(written: Path, name: str, columns: tuple[str, ...]) -> None:
    found = records(written / name)
    place = columns.index("clearance")
    assert tuple(found[0]) == (*columns[:place], "half_cost", *columns[place:])
    assert [one["half_cost"] for one in found[:2]] == [str(float(one["cost"]) / 2.0) for one in found[:2]]
    assert found[2]["half_cost"] == ""


@pytest.mark.slow
def test_a_new_column_is_in_json_lines(written: Path) -> None:
    found = [json.loads(line) for line in (written / "export.jsonl").read_text(encoding="utf-8").splitlines()]
    assert [one["half_cost"] for one in found] == [one["cost"] and one["cost"] / 2.0 for one in found]


@pytest.mark.slow
def test_a_new_column_is_on_the_terminal(written: Path) -> None:
    text = (written / "runs.txt").read_text(encoding="utf-8")
    lines = [[cell.strip() for cell in re.split("[┃│]", line)] for line in text.splitlines() if line[:1] in {"┃", "│"}]
    table = [dict(zip(lines[0], line, strict=True)) for line in lines[1:]]
    assert lines[0].index("half") == lines[0].index("clearance") - 1
    for one in table[:2]:
        assert float(one["half"]) == pytest.approx(float(one["cost"]) / 2.0, rel=1e-5)
    assert table[2]["half"] == "-"


@pytest.mark.slow
def test_a_new_column_is_in_what_the_page_knows(written: Path) -> None:
    html = (written / "report.html").read_text(encoding="utf-8")
    match = re.search(r'<script[^>]*id="data"[^>]*>(.*?)</script>', html, flags=re.DOTALL)
    assert match is not None
    data = json.loads(match[1])
    assert {"key": "half_cost", "head": "half", "kind": "number", "format": "figure", "digits": 6} in data["columns"]
    costs, halves = data["rows"]["cost"], data["rows"]["half_cost"]
    assert halves[:2] == pytest.approx([cost / 2.0 for cost in costs[:2]], rel=1e-4)
    assert halves[2] is None


def test_keys_and_heads_are_said_once() -> None:
    heads = [column.head for column in shown([])]
    assert len(set(RUN_COLUMNS)) == len(RUN_COLUMNS)
    assert len(set(heads)) == len(heads)


@pytest.mark.slow
def test_a_seed_may_be_greater_than_any_float() -> None:
    (run,) = stored_of([dataclasses.replace(small_runs()[0], seed=10**400)]).runs
    assert row(run)["seed"] == 10**400
    console = Console(width=1000)
    with console.capture() as captured:
        console.print(runs_table([run]))
    assert str(10**400) in captured.get()


@pytest.mark.slow
def test_a_narrow_terminal_leaves_out_the_sparest_first() -> None:
    console = Console(width=110)
    with console.capture() as captured:
        console.print(runs_table(stored_of(small_runs()).runs))
    (left_out,) = re.findall(r"too narrow for: (.*)", captured.get())
    sparest = sorted((one for one in shown([]) if one.spare), key=lambda one: one.spare or 0)
    missing = {head.strip() for head in left_out.split(",")}
    assert missing == {column.head for column in sparest[: len(missing)]}
