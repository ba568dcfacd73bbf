"""Exports: each format holds the runs of the study, and files are written whole or not at all."""

import csv
import dataclasses
import io
import json
import math
import re
import shutil
import sqlite3
import subprocess
import sys
from contextlib import closing
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples
from studies_small import by_number, found, small_study, write_study

from cgla_graph.comparisons.results.exports import RUN_COLUMNS, check_targets, export, run_rows
from cgla_graph.comparisons.study.rows import row
from cgla_graph.comparisons.study.store import FILE, Stored
from cgla_graph.comparisons.tables.latex import booktabs, latex
from cgla_graph.errors import CglaError, OutputError
from cgla_graph.model.solution import Solution, Status, TracePoint

ODD = ['a"b', "<script>", "ünï 漢字 😀", "x,y;z", "50 % & $1 #2 _x_ ^~\\{}", "[0]", "*"]
TEX = shutil.which("pdflatex")


def spoiled(scenario: str, solver: int, seed: int | None) -> Solution:
    """Let the first solver fail on the first scenario; the others have traces."""
    if (scenario, solver) == ("one", 0):
        return Solution(Status.CRASHED, message="died\nof <b>\r\n")
    answer = by_number(scenario, solver, seed)
    trace = (TracePoint(0.1, 3, math.inf), TracePoint(0.2, 5, answer.cost + 1.0), TracePoint(0.3, 9, answer.cost))
    return dataclasses.replace(answer, trace=trace, evaluations=9)


@pytest.fixture(scope="module")
def stored(tmp_path_factory: pytest.TempPathFactory) -> Stored:
    study = small_study(["one", *ODD], ["straight-line", "prm-star", *(f"prm {odd}" for odd in ODD)], title="t & u")
    return write_study(tmp_path_factory.mktemp("study"), study, spoiled)


# Rows


def test_rows_are_those_of_a_comparison_and_more(stored: Stored) -> None:
    rows = run_rows(stored.runs, stored.runs)
    for one, run in zip(rows, stored.runs, strict=True):
        assert tuple(one) == RUN_COLUMNS
        assert {key: one[key] for key in row(run)} == row(run)
        assert (one["number"], one["megabytes"], one["host"], one["exact"]) == (run.number, 1.5, "here", False)
        assert json.loads(one["settings"]) == dict(run.settings)


def test_excess_is_over_the_optimum_of_all_runs(stored: Stored) -> None:
    runs = [dataclasses.replace(run, exact=run.solver == "straight-line") for run in stored.runs]
    dearer = next(run for run in runs if run.solver == "prm-star" and run.scenario.name == ODD[0])
    (one,) = run_rows([dearer], runs)
    assert one["excess"] == pytest.approx(dearer.solution.cost / 1.1 - 1.0)
    assert run_rows([dearer], [dearer])[0]["excess"] is None


def test_csv(stored: Stored, tmp_path: Path) -> None:
    text = export(tmp_path / "a.csv", stored, stored.runs).read_bytes().decode()
    read = list(csv.DictReader(io.StringIO(text, newline="")))
    want = run_rows(stored.runs, stored.runs)
    assert read == [{key: "" if value is None else str(value) for key, value in one.items()} for one in want]


def test_json_lines(stored: Stored, tmp_path: Path) -> None:
    lines = export(tmp_path / "a.jsonl", stored, stored.runs).read_text(encoding="utf-8").split("\n")
    want = [{**one, "settings": json.loads(one["settings"])} for one in run_rows(stored.runs, stored.runs)]
    assert [json.loads(line) for line in lines if line] == want


def test_parquet(stored: Stored, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    table = parquet.read_table(export(tmp_path / "a.PARQUET", stored, stored.runs))
    assert table.to_pylist() == run_rows(stored.runs, stored.runs)
    assert str(table.schema.field("cost").type) == "double"
    assert str(table.schema.field("seed").type) == "int64"
    assert table.schema.metadata[b"title"] == b"t & u"


def test_parquet_without_a_run_has_the_columns(stored: Stored, tmp_path: Path) -> None:
    parquet = pytest.importorskip("pyarrow.parquet", reason="pyarrow is not installed")
    assert tuple(parquet.read_table(export(tmp_path / "a.parquet", stored, [])).column_names) == RUN_COLUMNS


def test_parquet_without_pyarrow(stored: Stored, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    with pytest.raises(CglaError, match=re.escape("pip install 'cgla-graph[parquet]'")):
        check_targets([tmp_path / "a.parquet"], stored.folder)


# OMPL's database


def opened(path: Path) -> closing[sqlite3.Connection]:
    return closing(sqlite3.connect(path))


def test_ompl_database_is_five_tables_in_one_file(stored: Stored, tmp_path: Path) -> None:
    file = export(tmp_path / "a.db", stored, stored.runs)
    # 1 is a rollback journal, 2 a write-ahead log
    assert file.read_bytes()[18:20] == b"\x01\x01"
    with opened(file) as copy:
        tables = copy.execute("SELECT name FROM sqlite_master WHERE name NOT LIKE 'sqlite_%' ORDER BY name").fetchall()
        assert [name for (name,) in tables] == ["enums", "experiments", "plannerConfigs", "progress", "runs"]
        assert copy.execute("PRAGMA integrity_check").fetchone() == ("ok",)
        assert copy.execute("PRAGMA foreign_key_check").fetchall() == []
        numbers = copy.execute("SELECT id FROM runs ORDER BY id").fetchall()
        assert numbers == [(number,) for number in sorted(run.number or 0 for run in stored.runs)]
        assert copy.execute("SELECT count(*) FROM progress").fetchone()[0] > len(stored.runs)
    assert [path.name for path in tmp_path.iterdir()] == ["a.db"]


def test_ompl_database_of_some_runs(stored: Stored, tmp_path: Path) -> None:
    runs = [run for run in stored.runs if (run.solver, run.seed) == ("prm-star", 2)]
    with opened(export(tmp_path / "a.db", stored, runs)) as copy:
        assert copy.execute("SELECT id FROM runs ORDER BY id").fetchall() == [
            (run.number,) for run in sorted(runs, key=lambda run: run.number or 0)
        ]
        assert copy.execute("SELECT name FROM plannerConfigs").fetchall() == [("prm-star",)]
        numbers = {number for (number,) in copy.execute("SELECT DISTINCT runid FROM progress")}
        assert numbers == {run.number for run in runs}
        assert copy.execute("PRAGMA foreign_key_check").fetchall() == []


# Refusals


@pytest.mark.parametrize("name", ["a", "a.xlsx", "a.db.txt", ".csv"])
def test_unknown_endings(stored: Stored, tmp_path: Path, name: str) -> None:
    with pytest.raises(CglaError, match=re.escape(".csv, .jsonl, .parquet, .tex, .db")):
        export(tmp_path / name, stored, stored.runs)
    assert list(tmp_path.iterdir()) == []


def test_the_study_itself_is_never_overwritten(tmp_path: Path) -> None:
    stored = write_study(tmp_path / "study", small_study(["one"], ["prm-star"]))
    before = (stored.folder / FILE).read_bytes()
    (tmp_path / "link.db").symlink_to(stored.folder / FILE)
    for target in (stored.folder / FILE, tmp_path / "study" / ".." / "study" / FILE, tmp_path / "link.db"):
        with pytest.raises(OutputError, match="study itself"):
            export(target, stored, stored.runs)
    assert (stored.folder / FILE).read_bytes() == before


def test_a_database_in_use_is_not_overwritten(stored: Stored, tmp_path: Path) -> None:
    with opened(tmp_path / "a.db") as mine:
        mine.execute("PRAGMA journal_mode = WAL")
        mine.execute("CREATE TABLE t (x)")
        with pytest.raises(OutputError, match="in use"):
            export(tmp_path / "a.db", stored, stored.runs)
    export(tmp_path / "a.db", stored, stored.runs)


@pytest.mark.parametrize("ending", ["csv", "jsonl", "parquet", "tex", "db"])
def test_a_folder_that_is_not_there(stored: Stored, tmp_path: Path, ending: str) -> None:
    if ending == "parquet":
        pytest.importorskip("pyarrow", reason="pyarrow is not installed")
    with pytest.raises(OutputError, match="--export") as caught:
        export(tmp_path / "no" / f"a.{ending}", stored, stored.runs)
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("ending", ["csv", "jsonl", "db"])
def test_a_full_disk_is_one_line_and_the_old_file_stays(stored: Stored, tiny_disk: Path, ending: str) -> None:
    target = tiny_disk / f"a.{ending}"
    target.write_text("old", encoding="utf-8")
    (tiny_disk / "big").write_bytes(b"x" * 56 * 1024)
    with pytest.raises(OutputError, match="No space left") as caught:
        export(target, stored, stored.runs)
    assert "\n" not in str(caught.value)
    assert target.read_text(encoding="utf-8") == "old"
    assert sorted(path.name for path in tiny_disk.iterdir()) == [target.name, "big"]


# LaTeX


def unescaped(source: str) -> str:
    """Take back what `latex` does, but for what stands as a number."""
    words = {"textbackslash": "\\", "textasciitilde": "~", "textasciicircum": "^"}
    words |= {"textless": "<", "textgreater": ">", "textbar": "|"}
    source = source.replace(r"{\ttfamily\char34}", '"')
    source = re.sub(r"\\texttt\{U\+([0-9A-F]+)\}", lambda found: chr(int(found[1], 16)), source)
    return re.sub(
        r"\\(text\w+)\{\}|\\([{}%&#$_])|\{\}",
        lambda found: words[found[1]] if found[1] else found[2] or "",
        source,
    )


@given(text=st.text(st.characters(codec="ascii", exclude_categories=["Cc"])))
def test_latex_loses_nothing_of_ascii(text: str) -> None:
    assert unescaped(latex(text)) == text


@given(text=st.text())
def test_latex_is_ascii_of_one_line_without_commands(text: str) -> None:
    source = latex(text)
    assert source.isascii()
    assert not re.search(r"[\x00-\x1f\x7f]", source)
    # after all that stands for a character is gone, nothing with a meaning is left
    rest = re.sub(r"\\texttt\{U\+[0-9A-F]+\}|\{\\ttfamily\\char34\}|\\text[a-z]+\{\}|\$(\\infty|-)\$", "", source)
    rest = re.sub(r"\\([`'^~=u.\"rHvc])\{(\{\\[ij]\}|[A-Za-z])\}|\{\\[A-Za-z]{1,2}\}|\\[{}%&#$_]|\{\}", "", rest)
    assert not re.search(r"[\\{}%&#$_^~]", rest)


@given(text=st.text("-'`,?!a", max_size=8))
def test_latex_makes_no_other_character_of_two(text: str) -> None:
    assert not re.search(r"--|''|``|,,|\?`|!`", latex(text))


def test_a_table_has_a_line_a_row() -> None:
    source = booktabs(["a", "b"], [["[x]", "1\n[0, 2]"], ["*", "2"]], ["a\nb % c"])
    assert source.splitlines() == [
        r"% a b \% c",
        r"\begin{tabular}{lr}",
        r"\toprule",
        r"a & b \\",
        r"\midrule",
        r"{}[x] & 1 \\",
        r" & [0, 2] \\",
        r"{}* & 2 \\",
        r"\bottomrule",
        r"\end{tabular}",
    ]


def compiled(folder: Path, *tables: str) -> str:
    """Set tables, and return what LaTeX said; it may stop at nothing."""
    pages = "\n\\par\n".join(tables)
    source = f"\\documentclass{{article}}\n\\usepackage{{booktabs}}\n\\begin{{document}}\n{pages}\n\\end{{document}}\n"
    (folder / "a.tex").write_text(source, encoding="ascii")
    assert TEX is not None
    words = [TEX, "-halt-on-error", "-interaction=nonstopmode", "-no-shell-escape", "a.tex"]
    done = subprocess.run(words, cwd=folder, capture_output=True, text=True, errors="replace", check=False)
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.mark.skipif(TEX is None, reason="no pdflatex here")
def test_the_leaderboards_compile(stored: Stored, tmp_path: Path) -> None:
    table = export(tmp_path / "leaderboard.tex", stored, stored.runs).read_text(encoding="ascii")
    assert r"50 \% \& \$1 \#2 \_x\_ \textasciicircum{}\textasciitilde{}\textbackslash{}\{\}" in table
    assert "Missing character" not in compiled(tmp_path, table)


@pytest.mark.skipif(TEX is None, reason="no pdflatex here")
@examples(3)
@given(texts=st.lists(st.text(max_size=20), min_size=30, max_size=60))
def test_any_text_compiles(texts: list[str], tmp_path_factory: pytest.TempPathFactory) -> None:
    letters = [chr(code) for code in range(1, 0x180)]
    compiled(
        tmp_path_factory.mktemp("tex"), booktabs(["a", "b"], [[text, text] for text in [*texts, *letters, *ODD]], texts)
    )


def test_a_study_without_runs(tmp_path: Path) -> None:
    stored = write_study(tmp_path, small_study(["one"], ["prm-star"]), lambda *_: found(1.0), first=0)
    for ending in ("csv", "jsonl", "tex", "db"):
        assert export(tmp_path / f"a.{ending}", stored, stored.runs).exists()
