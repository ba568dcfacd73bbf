"""
A column more: what a study shows where the table of columns has another entry.

Run as a program with a folder: it adds the entry to the source before anything else is imported, and writes
``rows.csv``, ``export.csv``, ``export.jsonl``, ``runs.txt`` (the terminal's table) and ``report.html`` there.
"""

# ruff: noqa: PLC0415 - the entry comes before all that reads it

import dataclasses
import subprocess
import sys
from importlib.util import find_spec, module_from_spec
from pathlib import Path

ENTRY = 'RunColumn("half_cost", "number", lambda run, _: run.solution.cost / 2.0, "half", "figure", 6),\n    '
BEFORE = 'RunColumn("clearance"'


def write_study_with_it(folder: Path) -> None:
    """Run this program."""
    subprocess.run([sys.executable, __file__, str(folder)], check=True)


def _add_entry() -> None:
    spec = find_spec("cgla_graph.comparisons.study.rows")
    assert spec is not None
    assert spec.origin is not None
    source = Path(spec.origin).read_text(encoding="utf-8")
    assert source.count(BEFORE) == 1
    module = sys.modules[spec.name] = module_from_spec(spec)
    exec(compile(source.replace(BEFORE, ENTRY + BEFORE), spec.origin, "exec"), module.__dict__)  # noqa: S102 - our own


def _write(folder: Path) -> None:
    from report_studies import stored_of
    from rich.console import Console

    from cgla_graph.comparisons.files import csv_text
    from cgla_graph.comparisons.report.page import write_report
    from cgla_graph.comparisons.results.exports import export
    from cgla_graph.comparisons.results.tables import runs_table
    from cgla_graph.comparisons.study.entrant import Entrant
    from cgla_graph.comparisons.study.rows import COLUMNS, rows_of
    from cgla_graph.comparisons.study.runner import compare
    from cgla_graph.model.solution import Solution, Status
    from cgla_graph.scenarios.scenario import load_scenario

    entrants = [Entrant.parse(name) for name in ("straight-line", "cgla")]
    runs = list(compare([load_scenario("one-threat")], entrants, tolerance=None))
    lost = dataclasses.replace(runs[0], solver="lost", solution=Solution(Status.NOT_FOUND))
    stored = stored_of([*runs, lost])
    (folder / "rows.csv").write_text(csv_text(rows_of(stored.runs), COLUMNS), encoding="utf-8")
    for ending in ("csv", "jsonl"):
        export(folder / f"export.{ending}", stored, stored.runs)
    with (folder / "runs.txt").open("w", encoding="utf-8") as file:
        Console(file=file, width=200).print(runs_table(stored.runs))
    write_report(stored, folder / "report.html")


if __name__ == "__main__":
    _add_entry()
    _write(Path(sys.argv[1]))
