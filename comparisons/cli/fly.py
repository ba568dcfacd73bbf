"""The command `fly`: fly a mission of several UAVs."""

from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import completion
from cgla_graph.comparisons.cli.options import (
    ClearanceOption,
    ExportOptions,
    GroundOption,
    JsonOption,
    OutOption,
    TerrainClearanceOption,
    option,
)


def fly(
    export: ExportOptions,
    mission: Annotated[
        str,
        typer.Argument(
            metavar="[MISSION]",
            autocompletion=completion.missions,
            help="shipped name, or .toml (cgla missions lists them)",
        ),
    ] = "fig8",
    solver: Annotated[
        str | None,
        option(
            "--solver NAME",
            "name, with settings as NAME:A=1:B=2 (default: the mission's)",
            autocompletion=completion.solvers,
        ),
    ] = None,
    variant: Annotated[str | None, option("--variant NAME", "fly only this variant (default: all)")] = None,
    max_ticks: Annotated[int | None, option("--max-ticks N", "stop after N ticks", min=1)] = None,
    clearance: ClearanceOption = None,
    ground: GroundOption = None,
    terrain_clearance: TerrainClearanceOption = None,
    value: Annotated[
        bool,
        typer.Option(
            help="fly again with full knowledge, and without sharing, to measure their value; bound the costs"
        ),
    ] = True,
    animation: Annotated[bool, typer.Option(help="with --out: also draw animations")] = True,
    out: OutOption = None,
    strict: Annotated[bool, option("--strict", "exit with 1 if a UAV does not arrive")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Fly a mission of several UAVs.

    Without arguments, flies Fig. 8 of the paper: two UAVs that meet unless virtual obstacles keep them apart. Prints a
    table per variant; with --out, writes a log (JSON Lines), traces (CSV), pictures and animations; with --export,
    writes the path of each UAV as a plan (NAME-UAV.plan). Ctrl-C keeps the flights that ended.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli.export import read_export
    from cgla_graph.comparisons.missions import fly as flights
    from cgla_graph.comparisons.tables.zone_list import print_terrain, print_zones

    exported = None if export == ExportOptions() else read_export(export, zones=ground is not None)
    terrain = {
        "ground": None if ground is None else str(ground),
        "terrain_clearance": terrain_clearance,
        "terrain_altitude": export.terrain_altitude(),
    }
    opened, specs = flights.open_mission(
        mission,
        solver=solver,
        variant=variant,
        max_ticks=max_ticks,
        clearance=clearance,
        terrain={name: value for name, value in terrain.items() if value is not None},
    )
    if exported is not None:
        exported.check_altitude(opened.zones)
        for spec in specs:
            exported.check_map(spec)
    folder = files.make_folder(out) if out else None
    zoned = print_zones([opened], None, altitude=None, as_json=as_json)
    with console.running_solvers(), console.progress(None) as tick:
        done = flights.fly_all(specs, folder, value=value, animation=animation, step=tick)
    plans = None if exported is None else exported.write_flights(done.flown, opened)
    written = [] if plans is None else plans.files
    if as_json:
        document = flights.flights_document(opened, done)
        zoned = {**zoned, **({} if plans is None else {"exported": plans.document()})}
        console.out_json({**document, "files": [*document["files"], *map(str, written)], **zoned})
    else:
        if opened.terrain is not None:
            print_terrain({opened.name: opened.terrain})
        flights.print_flights(done.flown)
        console.out_files(done.written)
        console.out_lines({} if plans is None else plans.lines())
        for file in written:
            console.out_files([file])
    if done.failure is not None:
        raise done.failure
    if done.interrupted:
        raise console.InterruptedRunError(flights.kept_note(done, len(specs), folder))
    if (plans is not None and plans.faults) or (strict and not all(flown.flight.all_arrived for flown in done.flown)):
        raise typer.Exit(console.MISSING)
