"""The commands `certify`, `pareto` and `check`: what is proven of a map, of weights and of a flight plan."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    BoundsOption,
    ClearanceOption,
    CorridorOption,
    KOption,
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


def check(
    plan_file: Annotated[
        Path,
        typer.Argument(
            metavar="PLAN", help=".plan, .waypoints, .kml, .kmz, .gpx, .geojson, or .csv: its content says which"
        ),
    ],
    output: OutputOptions,
    zone_options: ZoneOptions,
    raster: RasterOptions,
    against: Annotated[
        list[str] | None,
        typer.Argument(metavar="[MAP]", help="a scenario or a raster of risk, as of plan, and files of zones"),
    ] = None,
    zones: Annotated[
        list[Path] | None,
        typer.Option(
            "--zones", "--no-fly", metavar="FILE", help="zones: ED-269, ED-318, KML, KMZ, GeoJSON; may be repeated"
        ),
    ] = None,
    risk: Annotated[
        Path | None, typer.Option("--risk", metavar="FILE.tif", help="risk on a raster: .tif, .asc, .npy")
    ] = None,
    k: KOption = None,
    clearance: ClearanceOption = None,
    bounds: BoundsOption = None,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="R", help="how tight the bracket of the best cost shall be")
    ] = 0.01,
    through: Annotated[
        int,
        typer.Option("--through", metavar="N", help="legs that are proven at most for the bound through its waypoints"),
    ] = 16,
    no_certificate: Annotated[
        bool, typer.Option("--no-certificate", help="leave out the lower bound, and so the gaps")
    ] = False,
) -> None:
    """
    Check a plan of anybody: which zones its legs cross, and how much better any plan could be.

    Leg by leg: length, risk, cost, clearance, and what is crossed, where and how long; then a proven bracket of what
    the best clean plan between the same ends costs. With --out, draws it (NAME-check.*). Exits with 1 unless clean.
    """
    from cgla_graph.airspace.flight_plans.formats import read_plan
    from cgla_graph.comparisons.cli import check as checks
    from cgla_graph.comparisons.cli import check_map, check_report
    from cgla_graph.comparisons.study.options import read_tolerance

    asked = read_tolerance(tolerance, certify=not no_certificate)
    kinds = output.pictures("png")
    request = check_map.request_of(
        against or [],
        zones or [],
        risk,
        k=k,
        clearance=clearance,
        bounds=bounds,
        settings=zone_options.settings(),
        raster=dict(vars(raster)),
    )
    plan_read = read_plan(plan_file)
    on = check_map.open_check_map(plan_read, str(plan_file), request)
    zoned = zone_options.report([on.scenario], as_json=output.as_json)
    folder = output.folder()
    with console.running_solvers():
        checked = checks.check_plan(plan_read, str(plan_file), on, tolerance=asked, most_proven=through)
    written = check_report.write_checked(folder, checked, kinds) if folder else []
    if output.as_json:
        console.out_json({**check_report.checked_document(checked), "files": [*map(str, written)], **zoned})
    else:
        check_report.print_checked(checked)
        console.out_files(written)
    if not checked.is_clean:
        raise typer.Exit(console.MISSING)
