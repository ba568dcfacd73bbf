"""The command `compare`: every solver on any maps and missions."""

import dataclasses
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    ComparisonOptions,
    JsonOption,
    MapOptions,
    MissionsArg,
    ProofOptions,
    RasterOptions,
    RefineOption,
    StudyOptions,
    UncertainOptions,
    ZoneOptions,
    map_changes,
    naming_graphs,
    option,
)

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence
    from typing import Any

    from cgla_graph.comparisons.results.study_run import Request, RunOptions
    from cgla_graph.comparisons.study.options import MapOptions as MapChanges


def compare(
    study: StudyOptions,
    proof: ProofOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    comparison: ComparisonOptions,
    uncertain: UncertainOptions,
    scenarios: MissionsArg = None,
    refine: RefineOption = False,
    proofs: Annotated[
        Path | None, option("--proofs DIR", "write a proof of each map's bound, which the report links")
    ] = None,
    example: Annotated[bool, option("--example", "print an example of a study file")] = False,
    schema: Annotated[bool, option("--schema", "print the JSON schema of study files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Compare all solvers on any maps.

    Without arguments, runs every installed solver on the paper's map. Also takes a study file (STUDY.toml). Prints
    tables: how far each path is from the best possible, and how soon randomised and anytime solvers get there. Runs
    are made in separate processes: a run that hangs, crashes or takes too much memory is a row that says so. With
    --out, each run is saved when it ends (study.jsonl), and a report (report.html), rows (JSON Lines, CSV), OMPL's
    database (study.db) and pictures are written. A mission is flown with each solver in turn; without --solvers, with
    those that need no other package and are fast enough to plan dozens of times. Of one map that changes in time,
    solvers of such maps are compared. For pairs of nodes of a graph, use cgla graph compare. Ctrl-C keeps the runs
    that are done.

    With --scenarios, the risk is uncertain: hybrid and cgla, or the given solvers, plan under one objective, in this
    process. --alpha may be a list; with --out, the paths are drawn.
    """
    if example or schema:
        from cgla_graph.comparisons.study.study_file import EXAMPLE, study_schema

        console.out(EXAMPLE) if example else console.out_json(study_schema())
        return
    changes = map_changes(maps, zones, raster, aircraft)
    if uncertain != UncertainOptions():
        alone = {**vars(study), **vars(comparison), "proofs": proofs}
        _under_objective(uncertain, scenarios or ["paper"], changes, proof, alone, refine=refine, as_json=as_json)
        return
    if scenarios is not None and len(scenarios) == 1 and _changes_in_time(scenarios[0]):
        from cgla_graph.comparisons.cli.timed import compare_timed

        groups = (study, dataclasses.replace(comparison, solvers=None, seeds=None))
        left_out = {"refine": refine, "proofs": proofs}
        raise typer.Exit(compare_timed(scenarios, changes, comparison, proof, groups, left_out, as_json=as_json))
    from cgla_graph.comparisons.results import study_run

    how = dataclasses.replace(run_options(study), proofs=proofs)
    with naming_graphs("compare", scenarios or ()):
        asked = study_run.Settings(
            specs=scenarios or (),
            maps=changes,
            refine=refine,
            tolerance=proof.tolerance,
            certify=not proof.no_certificate,
            **comparison.settings(),
        )
        request = study_run.read_request(asked, how)
    zoned = zones.report(study_run.maps_of(request.study), as_json=as_json)
    run_and_print(request, how, strict=comparison.strict, as_json=as_json, more=zoned)


def _changes_in_time(spec: str) -> bool:
    """Return whether a map is a file that changes in time."""
    from cgla_graph.scenarios.shipped import is_timed_text
    from cgla_graph.scenarios.text_files import is_file, read_text

    return (
        spec.lower().endswith(".toml") and is_file(Path(spec)) and is_timed_text(read_text(spec, spec, "a TOML file"))
    )


def _under_objective(
    uncertain: UncertainOptions,
    specs: "Sequence[str]",
    changes: "MapChanges",
    proof: ProofOptions,
    options: "dict[str, Any]",
    *,
    refine: bool,
    as_json: bool,
) -> None:
    """Compare solvers under uncertain risk, and print it."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli.budget import compare_uncertain, outlook_of, uncertain_table
    from cgla_graph.comparisons.cli.tour import check_alone
    from cgla_graph.comparisons.plots.runs import map_by_alpha
    from cgla_graph.comparisons.results.study_run import split_specs
    from cgla_graph.comparisons.study.options import number_names, open_all, read_entrants
    from cgla_graph.comparisons.study.rows import plan_document
    from cgla_graph.plots import pictures

    out, strict, solvers = (options.pop(name) for name in ("out", "strict", "solvers"))
    check_alone("--scenarios", [], options, "solvers are compared under uncertain risk without it")
    maps, _ = split_specs(specs, ["--scenarios"])
    scenarios = number_names(open_all(maps, changes))
    entrants = read_entrants(solvers or "hybrid,cgla", refine=refine, scenarios=scenarios)
    folder = None if out is None else files.make_folder(out)
    every = compare_uncertain(uncertain, scenarios, entrants, proof)
    written = [
        file
        for runs in every
        if folder is not None
        for file in pictures.save_all(map_by_alpha(runs), folder / f"{runs[0].on_map.name}-uncertain", ["png"])
    ]
    if as_json:
        found = [{**plan_document(run), "uncertain": outlook_of(run, uncertain)} for runs in every for run in runs]
        console.out_json({"runs": found, "files": [str(file) for file in written]})
    else:
        for runs in every:
            console.out_table(uncertain_table(runs))
        console.out_files(written, folder)
    if strict and not all(run.solution.status.has_path for runs in every for run in runs):
        raise typer.Exit(console.MISSING)


def run_options(study: StudyOptions) -> "RunOptions":
    """Return the options of execution and storage."""
    from cgla_graph.comparisons.results import study_run

    how = study_run.RunOptions(
        folder=study.out,
        resume=study.resume,
        overwrite=study.overwrite,
        scheduler=study.dask,
        command=shlex.join(["cgla", *sys.argv[1:]]),
    )
    return how if study.workers is None else dataclasses.replace(how, workers=study.workers)


def run_and_print(
    request: "Request", how: "RunOptions", *, strict: bool, as_json: bool, more: "Mapping[str, Any] | None" = None
) -> None:
    """Make the runs, and print what they found; in JSON with `more` keys."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.results import study_run

    if how.folder and not how.resume:
        files.make_folder(how.folder)
    done = study_run.compare_all(request, how)
    if as_json:
        in_files = {"proofs": [one.document() for one in done.proofs]} if how.proofs else {}
        console.out_json({**study_run.comparison_document(done), **in_files, **(more or {})})
    else:
        study_run.print_compared(request, done)
        for one in done.proofs:
            console.out_lines(one.lines())
        console.out_files(done.written, how.folder)
        console.out_files([file for one in done.proofs for file in one.files])
    if done.failure is not None:
        console.say(f"cgla: {done.failure}")
        raise typer.Exit(console.MISSING)
    if done.interrupted:
        raise console.InterruptedRunError(study_run.kept_note(request, how, done))
    if done.left:
        console.say(study_run.left_note(how, done))
    if (strict and not done.all_found) or any(one.found is None for one in done.proofs):
        raise typer.Exit(console.MISSING)
