"""The commands `certify` and `pareto`: what is proven of a map, and of weights of risk."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    CorridorOption,
    MapOptions,
    OutputOptions,
    RasterOptions,
    ScenarioArg,
    SolverOption,
    ZoneOptions,
    open_map,
)


def certify(
    scenario: ScenarioArg,
    output: OutputOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    path: Annotated[
        Path | None,
        typer.Option("--path", metavar="FILE", help="a path, as plan --out or --export writes it (default: hybrid's)"),
    ] = None,
    tolerance: Annotated[float, typer.Option("--tolerance", metavar="R", help="gap that is good enough")] = 0.001,
    max_cells: Annotated[
        int, typer.Option("--max-cells", metavar="N", help="cells of a grid at most, about 300 bytes each")
    ] = 2_500_000,
) -> None:
    """
    Prove how far a path is from the best possible.

    Prints a bracket around the least cost that any path can have, grid by grid as it closes; with --out, writes it
    and a picture (NAME-SOLVER-certificate.*). Any planner's path can be held against it with --path.
    """
    from cgla_graph.comparisons.cli import certify as proofs

    opened = open_map("certify", scenario, maps, zones, raster)
    kinds = output.pictures("png", "svg")
    folder = output.folder()
    zoned = zones.report([opened], as_json=output.as_json)
    with console.running_solvers(opened.problem.model):
        run = proofs.certify(opened, path, tolerance=tolerance, max_cells=max_cells)
    written = proofs.write_certificate(folder, run, kinds) if folder else []
    if output.as_json:
        console.out_json({**proofs.certificate_document(run), "files": [*map(str, written)], **zoned})
    else:
        proofs.print_certificate(run)
        console.out_files(written)
    if not proofs.is_done(run):
        raise typer.Exit(console.MISSING)


def pareto(
    scenario: ScenarioArg,
    output: OutputOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    solver: SolverOption = "hybrid",
    corridor: CorridorOption = None,
) -> None:
    """
    Show what less risk costs in length, and which k asks for it.

    Prints the paths that are the cheapest under some k, and the k for which each is; with --out, writes a table of
    them, their waypoints and a picture (NAME-SOLVER-pareto….*). With --solver cgla they are all that the lattice has.
    With --corridor W, shows what each limit of the density under a corridor costs instead (NAME-SOLVER-density.csv).
    """
    from cgla_graph.comparisons.cli import density
    from cgla_graph.comparisons.cli import pareto as trade_off
    from cgla_graph.comparisons.study.options import read_entrant

    entrant = read_entrant(solver)
    opened = open_map("pareto", scenario, maps, zones, raster)
    kinds = output.pictures("png")
    folder = output.folder()
    zoned = zones.report([opened], as_json=output.as_json)
    if corridor is None:
        with console.running_solvers(opened.problem.model):
            front = trade_off.front_of(opened, entrant)
        written = trade_off.write_front(folder, opened, entrant, front, kinds) if folder and front.points else []
        document = trade_off.front_document(opened, entrant, front)
        found = bool(front.points)
    else:
        with console.running_solvers():
            limits = density.front_of(opened, entrant, corridor)
        written = density.write_front(folder, opened, entrant, limits) if folder else []
        document = density.front_document(opened, entrant, corridor, limits)
        found = any(point.solution.status.has_path for point in limits)
    if output.as_json:
        console.out_json({**document, "files": [*map(str, written)], **zoned})
    elif corridor is None:
        trade_off.print_front(opened, entrant, front)
    else:
        console.out_table(density.front_table(opened, entrant, corridor, limits))
    if not output.as_json:
        console.out_files(written)
    if not found:
        raise typer.Exit(console.MISSING)
