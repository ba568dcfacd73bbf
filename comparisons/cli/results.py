"""The commands `results`, `view` and `live`: results of a study, and pages on this machine."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import JsonOption, PageOptions, StudyArg, option


def results(
    folder: StudyArg,
    scenario: Annotated[str | None, option("--scenario A,B", "only these; random-* works as well")] = None,
    solver: Annotated[str | None, option("--solver A,B", "only these")] = None,
    status: Annotated[str | None, option("--status A,B", "only runs with these, as timed-out,stuck")] = None,
    seed: Annotated[int | None, option("--seed N", "only runs of this seed")] = None,
    runs: Annotated[bool, option("--runs", "list single runs")] = False,
    against: Annotated[Path | None, option("--against DIR", "compare with an older study")] = None,
    rerun: Annotated[int | None, option("--rerun NUMBER", "repeat a run, and compare")] = None,
    export: Annotated[
        list[Path] | None, option("--export FILE", "write .csv, .jsonl, .parquet, .tex or .db (OMPL's tables)")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """
    Show the results of a study.

    Shows which solver wins, by how much, with which confidence, and where each solver fails; also while the study
    runs.
    """
    from cgla_graph.comparisons.results import lookup

    with console.running_solvers():
        found = lookup.look_up(
            folder,
            scenario=scenario,
            solver=solver,
            status=status,
            seed=seed,
            runs=runs,
            against=against,
            rerun=rerun,
            export=export or (),
        )
    if as_json:
        console.out_json(lookup.document(found))
    else:
        lookup.print_results(found)


def view(folder: StudyArg, page: PageOptions) -> None:
    """
    Show the report of a study in a browser.

    Served on this machine only, until Ctrl-C; the page refreshes while the study runs.
    """
    from cgla_graph.comparisons.report.view import serve

    serve(folder, port=page.port, open_browser=page.browser)


def live(
    page: PageOptions,
    scenario: Annotated[
        str, typer.Argument(metavar="[SCENARIO]", help="shipped name, .toml, .geojson, .map, or FILE.scen:ROW")
    ] = "paper",
) -> None:
    """
    Drag threats, ends and areas of a map; the path and its proof follow.

    A page on this machine only, until Ctrl-C; its address has a token that every request needs. Other solvers are
    shown side by side, and the map is saved as a scenario file.
    """
    from cgla_graph.comparisons.live.server import serve

    serve(scenario, port=page.port, open_browser=page.browser)
