"""Output of the command `compare`: tables of each scenario, and files."""

from collections.abc import Collection, Sequence
from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.leaderboard.performance import PERFORMANCE_COLUMNS, performances
from cgla_graph.comparisons.results.ompl_database import ompl_database
from cgla_graph.comparisons.study.entrant import Entrant, budget_note
from cgla_graph.comparisons.study.flight_run import COLUMNS as FLIGHT_COLUMNS
from cgla_graph.comparisons.study.rows import by_scenario, compared, rows_of, trace_row
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import OMPL_FILE, Stored
from cgla_graph.comparisons.tables.tables import comparison_table, performance_table
from cgla_graph.model.earth import distortion_note


def print_comparison(runs: Sequence[Run], entrants: Sequence[Entrant]) -> None:
    """Print the tables of each scenario: how good, and how soon where there is more than one answer to that."""
    note = budget_note(entrants)
    for group in by_scenario(runs):
        scenario = group[0].scenario
        flat = distortion_note(scenario.projection, [run.solution.path for run in group])
        console.out_table(comparison_table(scenario, group, notes=[line for line in (flat, note) if line]))
        if any(run.seed is not None or run.solution.trace for run in group):
            console.out_table(performance_table(performances(group)))


def write_study(stored: Stored) -> list[Path]:
    """
    Write the files of a study beside its runs: the report; rows (JSON Lines, CSV), what they amount to, the
    traces that there are and OMPL's database of runs on maps; and rows of flights.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """  # noqa: D205 - a list is no one line
    from cgla_graph.comparisons.report.page import write_report  # noqa: PLC0415 - loads plotly

    folder, runs = stored.folder, stored.runs
    written = [write_report(stored, folder / "report.html")]
    if stored.scenarios:
        table = rows_of(runs)
        found = [one.document() for group in by_scenario(runs) for one in performances(group)]
        written += [
            files.write_bytes(folder / OMPL_FILE, ompl_database(stored, runs)),
            *_write_rows(folder, "rows", table, [column.key for column in compared(runs)]),
            files.write_text(folder / "summary.csv", files.csv_text(found, PERFORMANCE_COLUMNS)),
        ]
        traces = [trace_row(run) for run in runs if run.solution.trace]
        if traces:
            written.append(files.write_text(folder / "traces.jsonl", files.json_lines(traces)))
    if stored.missions:
        written += _write_rows(folder, "flights", [flight.row() for flight in stored.flights], FLIGHT_COLUMNS)
    return written


def _write_rows(folder: Path, name: str, table: Sequence[dict[str, Any]], columns: Sequence[str]) -> list[Path]:
    return [
        files.write_text(folder / f"{name}.jsonl", files.json_lines(table)),
        files.write_text(folder / f"{name}.csv", files.csv_text(table, columns)),
    ]


def write_all_pictures(folder: Path, runs: Sequence[Run], most: int, named: Collection[str] = ()) -> list[Path]:
    """Write the pictures of at most so many scenarios; named solvers are in colour (errors as `write_study`)."""
    taken: set[str] = set()
    groups = by_scenario(runs)
    written: list[Path] = []
    for group in groups[:most]:
        written += _write_pictures(folder / files.file_stem(group[0].scenario.name, taken), group, named)
    if 0 < most < len(groups):
        console.say(f"pictures of the first {most} of {len(groups)} scenarios; --pictures N draws more")
    return written


def _write_pictures(stem: Path, runs: Sequence[Run], named: Collection[str]) -> list[Path]:
    from cgla_graph.comparisons.plots.cost import trace_figure  # noqa: PLC0415 - matplotlib only where it draws
    from cgla_graph.comparisons.plots.runs import picture_of_runs  # noqa: PLC0415 - the same
    from cgla_graph.plots import pictures  # noqa: PLC0415 - the same

    drawn = picture_of_runs(runs, named)
    written: list[Path] = []
    # (without positions of the nodes, there is no picture)
    if drawn is not None:
        written += [stem.with_name(stem.name + suffix) for suffix in (".png", ".svg")]
        for file in written:
            pictures.save(drawn, file)
    trace = trace_figure(runs, named)
    if trace is not None:
        written.append(stem.with_name(stem.name + "-cost.png"))
        pictures.save(trace, written[-1])
    return written
