"""The command `compare`: every solver on any maps and missions."""

import dataclasses
import shlex
import sys
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    JsonOption,
    MapOptions,
    MissionsArg,
    ProofOptions,
    RasterOptions,
    RefineOption,
    SolversOption,
    StudyOptions,
    ZoneOptions,
    map_changes,
    naming_graphs,
    option,
)


def compare(
    study: StudyOptions,
    proof: ProofOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions,
    scenarios: MissionsArg = None,
    solvers: SolversOption = None,
    seeds: Annotated[int | None, option("--seeds N", "runs of each randomised solver (default: 3)", min=1)] = None,
    budget: Annotated[
        str | None, option("--budget seconds=S,…", "seconds, iterations or evaluations, for all solvers that accept it")
    ] = None,
    limits: Annotated[
        str | None, option("--limits seconds=S,memory=MB", "limits of a run (default: 600 seconds, 4096 megabytes)")
    ] = None,
    refine: RefineOption = False,
    pictures: Annotated[
        int | None, option("--pictures N", "draw the first N scenarios (default: 20; for a study file: 0)", min=0)
    ] = None,
    highlight: Annotated[
        str | None, option("--highlight A,B", "draw these in colour, besides the best and those of the paper")
    ] = None,
    metrics: Annotated[
        list[str] | None,
        option("--metrics FILE.py", "numbers of paths of your own: functions marked by @metric; may be repeated"),
    ] = None,
    strict: Annotated[bool, option("--strict", "exit with 1 if a run has no path")] = False,
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
    those that need no other package and are fast enough to plan dozens of times. For the file of a graph, use cgla
    graph compare. Ctrl-C keeps the runs that are done.
    """
    if example or schema:
        from cgla_graph.comparisons.study.study_file import EXAMPLE, study_schema

        console.out(EXAMPLE) if example else console.out_json(study_schema())
        return
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.results import study_run

    how = study_run.RunOptions(
        folder=study.out,
        resume=study.resume,
        overwrite=study.overwrite,
        scheduler=study.dask,
        command=shlex.join(["cgla", *sys.argv[1:]]),
    )
    if study.workers is not None:
        how = dataclasses.replace(how, workers=study.workers)
    with naming_graphs("compare", scenarios or ()):
        asked = study_run.Settings(
            specs=scenarios or (),
            solvers=solvers,
            seeds=seeds,
            budget=budget,
            limits=limits,
            maps=map_changes(maps, zones, raster, aircraft),
            refine=refine,
            tolerance=proof.tolerance,
            certify=not proof.no_certificate,
            pictures=pictures,
            highlight=highlight,
            metrics=metrics or (),
        )
        request = study_run.read_request(asked, how)
    zoned = zones.report(request.study.scenarios, as_json=as_json)
    if study.out and not study.resume:
        files.make_folder(study.out)
    done = study_run.compare_all(request, how)
    if as_json:
        console.out_json({**study_run.comparison_document(done), **zoned})
    else:
        study_run.print_compared(request, done)
        console.out_files(done.written, study.out)
    if done.failure is not None:
        console.say(f"cgla: {done.failure}")
        raise typer.Exit(console.MISSING)
    if done.interrupted:
        raise console.InterruptedRunError(study_run.kept_note(request, how, done))
    if done.left:
        console.say(study_run.left_note(how, done))
    if strict and not done.all_found:
        raise typer.Exit(console.MISSING)
