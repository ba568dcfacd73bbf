"""
The command line, `cgla`.

Everything heavy is imported where it is used, so that ``cgla --help`` answers at once.
"""

import atexit
import dataclasses
import gc
import io
import json
import shlex
import sys
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import completion
from cgla_graph.comparisons.cli.parameters import (
    AboveOption,
    AltitudeOption,
    ArcToleranceOption,
    AtOption,
    BoundsOption,
    ClearanceOption,
    CoordinatesOption,
    CorridorOption,
    DaskOption,
    DensityOption,
    DirectedOption,
    ExportOption,
    FatalityOption,
    FormatsOption,
    FromOption,
    GoalHeadingOption,
    GoalOption,
    GraphArg,
    GroundOption,
    InterpolationOption,
    JsonOption,
    KindOption,
    KOption,
    MetreOption,
    NoCertificateOption,
    NodataOption,
    NoFlyOption,
    OneScenarioArg,
    OneScenarioOrGraphArg,
    OriginOption,
    OutOption,
    OverwriteOption,
    PowerOption,
    ProfileOption,
    RefineOption,
    ResolutionOption,
    ResumeOption,
    ScaleOption,
    ScenarioArg,
    SpeedOption,
    StartHeadingOption,
    StartOption,
    StudyArg,
    ToleranceOption,
    ToOption,
    TreatOption,
    TurnOption,
    WeightOption,
    WindOption,
    WorkersOption,
    ZonesListOption,
)

if TYPE_CHECKING:
    from cgla_graph._types import FloatArray
    from cgla_graph.comparisons.study.entrant import Entrant
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.scenarios.scenario import Scenario

DONE, MISSING, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

#: What is said where options of graphs stand beside something else.
NO_GRAPH = "no file of a graph; those end in .graphml, .csv, .mtx, .npz, or .json where that has a list of nodes"

app = typer.Typer(
    rich_markup_mode=None,
    pretty_exceptions_enable=False,
)


def _version(asked: bool) -> None:
    """Print the version and leave."""
    if asked:
        from cgla_graph import __version__

        console.out(f"cgla-graph {__version__}\n")
        raise typer.Exit


@app.callback()
def cgla(
    version: Annotated[
        bool, typer.Option("--version", callback=_version, is_eager=True, help="print the version and exit")
    ] = False,
) -> None:
    """Plan over risk maps with every solver, over one and the same cost: length + k * risk."""
    del version


@app.command()
def compare(
    scenarios: ScenarioArg = None,
    solvers: Annotated[
        str | None,
        typer.Option(
            "--solvers",
            metavar="A,B",
            autocompletion=completion.solvers,
            help="names, with settings as NAME:A=1:B=2 (default: all)",
        ),
    ] = None,
    seeds: Annotated[
        int | None,
        typer.Option("--seeds", metavar="N", min=1, help="runs of each solver that draws random numbers (default: 3)"),
    ] = None,
    budget: Annotated[
        str | None,
        typer.Option(
            "--budget", metavar="seconds=S,…", help="seconds, iterations or evaluations, for all solvers that take it"
        ),
    ] = None,
    limits: Annotated[
        str | None,
        typer.Option(
            "--limits", metavar="seconds=S,memory=MB", help="what kills a run (default: 600 seconds, 4096 megabytes)"
        ),
    ] = None,
    out: OutOption = None,
    resume: ResumeOption = False,
    overwrite: OverwriteOption = False,
    workers: WorkersOption = None,
    dask: DaskOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    bounds: BoundsOption = None,
    k: KOption = None,
    clearance: ClearanceOption = None,
    no_fly: NoFlyOption = None,
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    at: AtOption = None,
    treat: TreatOption = None,
    ground: GroundOption = None,
    zones_list: ZonesListOption = None,
    kind: KindOption = None,
    scale: ScaleOption = None,
    nodata: NodataOption = None,
    interpolation: InterpolationOption = None,
    origin: OriginOption = None,
    coordinates: CoordinatesOption = None,
    resolution: ResolutionOption = None,
    refine: RefineOption = False,
    tolerance: ToleranceOption = None,
    no_certificate: NoCertificateOption = False,
    pictures: Annotated[
        int | None,
        typer.Option("--pictures", metavar="N", min=0, help="draw the first N scenarios (default: 20; of a study: 0)"),
    ] = None,
    highlight: Annotated[
        str | None,
        typer.Option(
            "--highlight", metavar="A,B", help="draw these in colour, too (default: the best 5 of more than 8)"
        ),
    ] = None,
    source: FromOption = None,
    target: ToOption = None,
    pairs: Annotated[
        int | None, typer.Option("--pairs", metavar="N", min=1, help="of a graph: draw N pairs of nodes instead")
    ] = None,
    weight: WeightOption = None,
    directed: DirectedOption = False,
    strict: Annotated[bool, typer.Option("--strict", help="exit with 1 if a run has no path")] = False,
    example: Annotated[bool, typer.Option("--example", help="print a study file as a start for your own")] = False,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schema of study files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Compare all solvers on any maps.

    Without arguments: every installed solver on the paper's map. Takes a study file (STUDY.toml) as well. Prints
    tables: how far each path is from the best possible, and how soon solvers that draw random numbers or improve with
    time get there. Runs are made in processes apart: one that hangs, crashes or takes too much memory is a row that
    says so. With --out, runs are kept as they end (study.jsonl), and a report (report.html), rows (JSON Lines, CSV),
    OMPL's database (study.db) and pictures are written. A mission is flown with each solver in turn; unless --solvers
    names some, with those that need no other package and are fast enough to plan dozens of times. On the file of a
    graph, solvers plan between two of its nodes (--from, --to), or many pairs (--pairs). Ctrl-C keeps what is done.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import compare as comparison
    from cgla_graph.comparisons.cli import zone_list
    from cgla_graph.comparisons.study import options
    from cgla_graph.scenarios.graph_endings import is_graph_file

    if example or schema:
        from cgla_graph.comparisons.study.study_file import EXAMPLE, study_schema

        console.out(EXAMPLE) if example else _print_json(study_schema())
        return
    of_graph = {"--from": source, "--to": target, "--pairs": pairs, "--weight": weight, "--directed": directed}
    of_maps = options.MapOptions(
        start=start,
        goal=goal,
        bounds=bounds,
        resolution=resolution,
        k=k,
        clearance=clearance,
        no_fly=no_fly or (),
        zones=zone_list.chosen(altitude, above, at, treat, ground),
        raster=_raster(kind, scale, nodata, interpolation, origin, coordinates),
    )
    graphs = [spec for spec in scenarios or [] if is_graph_file(spec)]
    if graphs:
        of_map = {
            "any other argument": scenarios if scenarios != graphs[:1] else None,
            "--seeds": seeds,
            "--budget": budget,
            "--limits": limits,
            "--resume": resume,
            "--overwrite": overwrite,
            "--workers": workers or None,
            "--dask": dask,
            **of_maps.given,
            "--zones-list": zones_list,
            "--refine": refine,
            "--tolerance": tolerance,
            "--no-certificate": no_certificate,
            "--pictures": pictures,
            "--highlight": highlight,
        }
        _refuse(of_map, f"{graphs[0]} is a graph, on which runs are made one after the other, here")
        found = _on_graph(graphs[0], solvers, (source, target, pairs), weight, directed, out, as_json)
        if strict and not found:
            raise typer.Exit(MISSING)
        return
    _refuse(of_graph, f"{' '.join(scenarios or ['paper'])} is {NO_GRAPH}")
    how = comparison.How(
        folder=out, resume=resume, overwrite=overwrite, scheduler=dask, command=shlex.join(["cgla", *sys.argv[1:]])
    )
    if workers is not None:
        how = dataclasses.replace(how, workers=workers)
    request = comparison.read_request(
        scenarios or [],
        solvers=solvers,
        seeds=seeds,
        pictures=pictures,
        highlight=highlight,
        limits=limits,
        how=how,
        budget=budget,
        maps=of_maps,
        refine=refine,
        tolerance=tolerance,
        certify=not no_certificate,
    )
    zoned = zone_list.told(request.study.scenarios, zones_list, altitude=altitude, as_json=as_json)
    # a study to go on with has a folder
    folder = files.make_folder(out) if out and not resume else out
    done = comparison.compare_all(request, how)
    if as_json:
        _print_json({**comparison.comparison_document(done), **zoned})
    else:
        comparison.print_compared(request, done)
        _say_files(done.written, folder)
    if done.interrupted:
        raise console.InterruptedRunError(comparison.kept_note(request, how, done))
    if done.left:
        console.say(comparison.left_note(how, done))
    if strict and not done.all_found:
        raise typer.Exit(MISSING)


@app.command()
def plan(
    scenario: OneScenarioOrGraphArg,
    solver: Annotated[
        str | None,
        typer.Option(
            "--solver",
            metavar="NAME",
            autocompletion=completion.solvers,
            help="name, with settings as NAME:A=1:B=2 (default: hybrid; on a graph cgla, and several as A,B)",
        ),
    ] = None,
    source: FromOption = None,
    target: ToOption = None,
    weight: WeightOption = None,
    directed: DirectedOption = False,
    max_risk: Annotated[
        float | None, typer.Option("--max-risk", metavar="R", help="find the shortest path with at most that risk")
    ] = None,
    max_length: Annotated[
        float | None, typer.Option("--max-length", metavar="L", help="find the least risk on a path at most that long")
    ] = None,
    max_density: DensityOption = None,
    corridor: CorridorOption = None,
    out: OutOption = None,
    formats: FormatsOption = None,
    profile: ProfileOption = None,
    export: ExportOption = None,
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    speed: SpeedOption = None,
    turn_radius: TurnOption = None,
    start_heading: StartHeadingOption = None,
    goal_heading: GoalHeadingOption = None,
    arc_tolerance: ArcToleranceOption = None,
    wind: WindOption = None,
    power: PowerOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    bounds: BoundsOption = None,
    k: KOption = None,
    prevented_fatality: FatalityOption = None,
    metre_price: MetreOption = None,
    clearance: ClearanceOption = None,
    no_fly: NoFlyOption = None,
    at: AtOption = None,
    treat: TreatOption = None,
    ground: GroundOption = None,
    zones_list: ZonesListOption = None,
    kind: KindOption = None,
    scale: ScaleOption = None,
    nodata: NodataOption = None,
    interpolation: InterpolationOption = None,
    origin: OriginOption = None,
    coordinates: CoordinatesOption = None,
    resolution: ResolutionOption = None,
    refine: RefineOption = False,
    tolerance: ToleranceOption = None,
    no_certificate: NoCertificateOption = False,
    as_json: JsonOption = False,
) -> None:
    """
    Plan one path.

    Prints its numbers, and how far it is from the best possible; with --out, writes its waypoints (CSV, and GeoJSON
    on lon/lat maps) and a picture; with --export, a plan that ground stations and viewers open. With --max-risk or
    --max-length, a budget takes the place of the weight k; with --max-density, no cell of a raster within half the
    --corridor is above it. With --turn-radius, the path is one of lines and arcs, bent until it costs least. On the
    file of a graph, plans between two of its nodes, --from A --to B, with each of the solvers that --solver names.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.scenarios.graph_endings import is_graph_file

    of_graph = {"--from": source, "--to": target, "--weight": weight, "--directed": directed}
    if is_graph_file(scenario[0]):
        of_map = {
            "--max-risk": max_risk,
            "--max-length": max_length,
            "--max-density": max_density,
            "--corridor": corridor,
            "--profile": profile,
            "--export": export,
            "--altitude": altitude,
            "--above": above,
            "--speed": speed,
            "--turn-radius": turn_radius,
            "--start-heading": start_heading,
            "--goal-heading": goal_heading,
            "--arc-tolerance": arc_tolerance,
            "--wind": wind,
            "--power": power,
            "--formats": formats,
            "--start": start,
            "--goal": goal,
            "--bounds": bounds,
            "--k": k,
            "--prevented-fatality": prevented_fatality,
            "--metre-price": metre_price,
            "any other argument": scenario[1:] or None,
            "--clearance": clearance,
            "--no-fly": no_fly,
            "--at": at,
            "--treat": treat,
            "--ground": ground,
            "--zones-list": zones_list,
            "--kind": kind,
            "--scale": scale,
            "--nodata": nodata,
            "--interpolation": interpolation,
            "--origin": origin,
            "--coordinates": coordinates,
            "--resolution": resolution,
            "--refine": refine,
            "--tolerance": tolerance,
            "--no-certificate": no_certificate,
        }
        _refuse(of_map, f"{scenario[0]} is a graph, which has nodes and edges alone")
        found = _on_graph(
            scenario[0], "cgla" if solver is None else solver, (source, target, None), weight, directed, out, as_json
        )
        if not found:
            raise typer.Exit(MISSING)
        return
    _refuse(of_graph, f"{scenario[0]} is {NO_GRAPH}")
    from cgla_graph.comparisons.cli import export as exports
    from cgla_graph.comparisons.cli import flyable, one_map, output, zone_list
    from cgla_graph.comparisons.study import options, runner

    limited = max_risk is not None or max_length is not None
    flying = flyable.read_flying(
        turn_radius, (start_heading, goal_heading), arc_tolerance, wind, power, speed, limited=limited
    )
    # (of a flyable path, the speed is about its time as well)
    exported = exports.read_export(
        export,
        altitude,
        above,
        speed if export or not flying.asked else None,
        zones=zone_list.may_be(scenario[0], no_fly),
    )
    bound = options.read_tolerance(tolerance, certify=not no_certificate)
    entrant = options.read_entrant("hybrid" if solver is None else solver, refine=refine)
    opened = one_map.open_map(
        "plan",
        scenario,
        start=start,
        goal=goal,
        resolution=resolution,
        bounds=bounds,
        k=one_map.priced(k, prevented_fatality, metre_price),
        clearance=clearance,
        no_fly=no_fly,
        zones=zone_list.chosen(altitude, above, at, treat, ground),
        raster=_raster(kind, scale, nodata, interpolation, origin, coordinates),
    )
    opened = one_map.below(opened, max_density, corridor)
    exports.check_map(exported, opened)
    zoned = zone_list.told(
        [opened], zones_list, altitude=None if export else altitude, two=bool(export) and above is None, as_json=as_json
    )
    folder = files.make_folder(out) if out else None
    kinds = output.read_formats(formats, ["png"])
    _check_profile(profile)
    with console.running_solvers(opened.problem.model):
        if limited:
            from cgla_graph.comparisons.cli import pareto as trade_off

            within = trade_off.plan_of(opened, entrant, max_risk, max_length, bound)
            run = trade_off.run_of(opened, entrant, within.solution)
        else:
            run = flyable.flown(next(iter(runner.compare([opened], [entrant], 1, tolerance=bound))), flying)
        if max_density is not None:
            from cgla_graph.comparisons.cli import density

            run = density.with_proof(run)
    written = [(output.write_plan(folder, run, kinds) if folder and run.solution.status.has_path else [], folder)]
    written.append((_write_profile(profile, run, flying.clock), profile.parent if profile else None))
    written += [
        ([file], file.parent)
        for file in exports.write_export(exported, opened, run.solution, arc_tolerance=flying.tolerance)
    ]
    if as_json:
        more = {"within": trade_off.within_document(within)} if limited else {}
        names = [str(path) for paths, _ in written for path in paths]
        _print_json({**output.plan_document(run), "files": names, **more, **flyable.document(run, flying), **zoned})
    else:
        output.print_plan(run, flyable.lines(run, flying))
        if limited:
            trade_off.print_within(run.scenario, within)
        for paths, place in written:
            _say_files(paths, place)
    if not run.solution.status.has_path:
        raise typer.Exit(MISSING)


def _raster(
    kind: str | None,
    scale: float | None,
    nodata: float | None,
    interpolation: str | None,
    origin: str | None,
    coordinates: str | None,
) -> dict[str, str | float | None]:
    """Gather what is said of a raster."""
    return {
        "kind": kind,
        "scale": scale,
        "nodata": nodata,
        "interpolation": interpolation,
        "origin": origin,
        "coordinates": coordinates,
    }


def _check_profile(target: Path | None) -> None:
    """Check the file of --profile before any work is done."""
    if target is not None:
        from cgla_graph.comparisons.profile import check_profile_file

        check_profile_file(target)


def _write_profile(
    target: Path | None, run: "Run", clock: "Callable[[FloatArray], FloatArray] | None" = None
) -> list[Path]:
    """Write the profile of a path, if that was asked for and there is one."""
    if target is None or not run.solution.status.has_path:
        return []
    from cgla_graph.comparisons.profile import write_profile

    return [write_profile(target, run.scenario, run.solution.path, clock)]


def _refuse(given: Mapping[str, Any], why: str) -> None:
    """Refuse options that do not fit what a command was given."""
    from cgla_graph.errors import CglaError

    for option, value in given.items():
        if value is not None and value is not False:
            msg = f"{why}: leave out {option}"
            raise CglaError(msg)


def _on_graph(
    spec: str,
    solvers: str | None,
    ends: tuple[str | None, str | None, int | None],
    weight: str | None,
    directed: bool,
    out: Path | None,
    as_json: bool,
) -> bool:
    """Plan between two nodes of a graph, or pairs of them; say whether each solver found all paths."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import graph_plan

    entrants = graph_plan.read_graph_entrants(solvers)
    opened, problems = graph_plan.open_problems(spec, *ends, weight=weight, directed=directed)
    folder = files.make_folder(out) if out else None
    with console.running_solvers():
        run = graph_plan.plan_all(opened, problems, entrants)
    written = graph_plan.write_graph_run(folder, run) if folder else []
    if as_json:
        _print_json({**graph_plan.graph_run_document(run), "files": [str(path) for path in written]})
    else:
        graph_plan.print_graph_run(run)
        _say_files(written, folder)
    return run.all_found


@app.command(name="check-graph")
def check_graph(
    graph: GraphArg,
    target: Annotated[str, typer.Option("--target", metavar="T", help="the node whose costs-to-go are computed")],
    source: Annotated[
        str | None, typer.Option("--source", metavar="S", help="the node at which the search may stop (default: any)")
    ] = None,
    weight: WeightOption = None,
    directed: DirectedOption = False,
    strict: Annotated[
        bool, typer.Option("--strict", help="exit with 1 if something does not hold that Theorem 1 is about")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Check whether Theorem 1 holds on a graph of your own.

    Prints what it assumes (weights, ways to the target) and what it says, round by round of Eq. 9: Lemma 1, that n
    rounds give the least costs, that settled values stay, when the source comes into Delta; and the ties in Delta.
    """
    from cgla_graph.comparisons.cli import graph_check

    with console.running_solvers():
        opened, checked = graph_check.check_file(graph, target, source, weight=weight, directed=directed)
    if as_json:
        _print_json(graph_check.checked_document(opened, checked))
    else:
        graph_check.print_checked(opened, checked)
    if strict and not checked.all_hold:
        raise typer.Exit(MISSING)


@app.command()
def pareto(
    scenario: OneScenarioArg,
    solver: Annotated[
        str,
        typer.Option(
            "--solver", metavar="NAME", autocompletion=completion.solvers, help="name, with settings as NAME:A=1:B=2"
        ),
    ] = "hybrid",
    corridor: CorridorOption = None,
    out: OutOption = None,
    formats: FormatsOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    bounds: BoundsOption = None,
    k: KOption = None,
    clearance: ClearanceOption = None,
    no_fly: NoFlyOption = None,
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    at: AtOption = None,
    treat: TreatOption = None,
    ground: GroundOption = None,
    zones_list: ZonesListOption = None,
    kind: KindOption = None,
    scale: ScaleOption = None,
    nodata: NodataOption = None,
    interpolation: InterpolationOption = None,
    origin: OriginOption = None,
    coordinates: CoordinatesOption = None,
    resolution: ResolutionOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Show what less risk costs in length, and which k asks for it.

    Prints the paths that are the cheapest under some k, and the k for which each is; with --out, writes a table of
    them, their waypoints and a picture (NAME-SOLVER-pareto….*). With --solver cgla they are all that the lattice has.
    With --corridor W, shows what each limit of the density under a corridor costs instead (NAME-SOLVER-density.csv).
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import one_map, output, zone_list
    from cgla_graph.comparisons.cli import pareto as trade_off
    from cgla_graph.comparisons.study import options

    entrant = options.read_entrant(solver)
    opened = one_map.open_map(
        "pareto",
        scenario,
        start=start,
        goal=goal,
        resolution=resolution,
        bounds=bounds,
        k=k,
        clearance=clearance,
        no_fly=no_fly,
        zones=zone_list.chosen(altitude, above, at, treat, ground),
        raster=_raster(kind, scale, nodata, interpolation, origin, coordinates),
    )
    kinds = output.read_formats(formats, ["png"])
    folder = files.make_folder(out) if out else None
    zoned = zone_list.told([opened], zones_list, altitude=altitude, as_json=as_json)
    if corridor is not None:
        _density_front(opened, entrant, corridor, folder, zoned, as_json=as_json)
        return
    with console.running_solvers(opened.problem.model):
        front = trade_off.front_of(opened, entrant)
    written = trade_off.write_front(folder, opened, entrant, front, kinds) if folder and front.points else []
    if as_json:
        document = trade_off.front_document(opened, entrant, front)
        _print_json({**document, "files": [str(path) for path in written], **zoned})
    else:
        trade_off.print_front(opened, entrant, front)
        _say_files(written, folder)
    if not front.points:
        raise typer.Exit(MISSING)


def _density_front(
    opened: "Scenario",
    entrant: "Entrant",
    corridor: float,
    folder: Path | None,
    zoned: Mapping[str, Any],
    *,
    as_json: bool,
) -> None:
    """Show what each limit of the density under a corridor costs."""
    from cgla_graph.comparisons.cli import density

    with console.running_solvers():
        front = density.front_of(opened, entrant, corridor)
    written = density.write_front(folder, opened, entrant, front) if folder else []
    if as_json:
        document = density.front_document(opened, entrant, corridor, front)
        _print_json({**document, "files": [str(path) for path in written], **zoned})
    else:
        console.out_table(density.front_table(opened, entrant, corridor, front))
        _say_files(written, folder)
    if not any(point.solution.status.has_path for point in front):
        raise typer.Exit(MISSING)


@app.command()
def certify(
    scenario: OneScenarioArg,
    path: Annotated[
        Path | None,
        typer.Option("--path", metavar="FILE", help="a path, as plan --out or --export writes it (default: hybrid's)"),
    ] = None,
    tolerance: Annotated[float, typer.Option("--tolerance", metavar="R", help="gap that is good enough")] = 0.001,
    max_cells: Annotated[
        int, typer.Option("--max-cells", metavar="N", help="cells of a grid at most, about 300 bytes each")
    ] = 2_500_000,
    out: OutOption = None,
    formats: FormatsOption = None,
    start: StartOption = None,
    goal: GoalOption = None,
    bounds: BoundsOption = None,
    k: KOption = None,
    clearance: ClearanceOption = None,
    no_fly: NoFlyOption = None,
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    at: AtOption = None,
    treat: TreatOption = None,
    ground: GroundOption = None,
    zones_list: ZonesListOption = None,
    kind: KindOption = None,
    scale: ScaleOption = None,
    nodata: NodataOption = None,
    interpolation: InterpolationOption = None,
    origin: OriginOption = None,
    coordinates: CoordinatesOption = None,
    resolution: ResolutionOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Prove how far a path is from the best possible.

    Prints a bracket around the least cost that any path can have, grid by grid as it closes; with --out, writes it
    and a picture (NAME-SOLVER-certificate.*). Any planner's path can be held against it with --path.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import certify as proofs
    from cgla_graph.comparisons.cli import one_map, output, zone_list

    opened = one_map.open_map(
        "certify",
        scenario,
        start=start,
        goal=goal,
        resolution=resolution,
        bounds=bounds,
        k=k,
        clearance=clearance,
        no_fly=no_fly,
        zones=zone_list.chosen(altitude, above, at, treat, ground),
        raster=_raster(kind, scale, nodata, interpolation, origin, coordinates),
    )
    kinds = output.read_formats(formats, ["png", "svg"])
    folder = files.make_folder(out) if out else None
    zoned = zone_list.told([opened], zones_list, altitude=altitude, as_json=as_json)
    with console.running_solvers(opened.problem.model):
        run = proofs.certify(opened, path, tolerance=tolerance, max_cells=max_cells)
    written = proofs.write_certificate(folder, run, kinds) if folder else []
    if as_json:
        _print_json({**proofs.certificate_document(run), "files": [str(file) for file in written], **zoned})
    else:
        proofs.print_certificate(run)
        _say_files(written, folder)
    if not proofs.is_done(run):
        raise typer.Exit(MISSING)


@app.command()
def check(
    plan_file: Annotated[
        Path,
        typer.Argument(
            metavar="PLAN", help=".plan, .waypoints, .kml, .kmz, .gpx, .geojson, or .csv: its content says which"
        ),
    ],
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
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    at: AtOption = None,
    treat: TreatOption = None,
    ground: GroundOption = None,
    zones_list: ZonesListOption = None,
    kind: KindOption = None,
    scale: ScaleOption = None,
    nodata: NodataOption = None,
    interpolation: InterpolationOption = None,
    origin: OriginOption = None,
    coordinates: CoordinatesOption = None,
    tolerance: Annotated[
        float, typer.Option("--tolerance", metavar="R", help="how tight the bracket of the best cost shall be")
    ] = 0.01,
    through: Annotated[
        int,
        typer.Option("--through", metavar="N", help="legs that are proven at most for the bound through its waypoints"),
    ] = 16,
    no_certificate: NoCertificateOption = False,
    out: OutOption = None,
    formats: FormatsOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Check a plan of anybody: which zones its legs cross, and how much better any plan could be.

    Leg by leg: length, risk, cost, clearance, and what is crossed, where and how long; then a proven bracket of what
    the best clean plan between the same ends costs. With --out, draws it (NAME-check.*). Exits with 1 unless clean.
    """
    from cgla_graph.airspace.flight_plans.formats import read_plan
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import check as checks
    from cgla_graph.comparisons.cli import check_map, check_report, output, zone_list
    from cgla_graph.comparisons.study import options

    asked = options.read_tolerance(tolerance, certify=not no_certificate)
    kinds = output.read_formats(formats, ["png"])
    request = check_map.request_of(
        against or [],
        zones or [],
        risk,
        k=k,
        clearance=clearance,
        bounds=bounds,
        settings=zone_list.chosen(altitude, above, at, treat, ground),
        raster=_raster(kind, scale, nodata, interpolation, origin, coordinates),
    )
    plan_read = read_plan(plan_file)
    on = check_map.open_check_map(plan_read, str(plan_file), request)
    zoned = zone_list.told([on.scenario], zones_list, altitude=altitude, as_json=as_json)
    folder = files.make_folder(out) if out else None
    with console.running_solvers():
        checked = checks.check_plan(plan_read, str(plan_file), on, tolerance=asked, most_proven=through)
    written = check_report.write_checked(folder, checked, kinds) if folder else []
    if as_json:
        _print_json({**check_report.checked_document(checked), "files": [str(path) for path in written], **zoned})
    else:
        check_report.print_checked(checked)
        _say_files(written, folder)
    if not checked.is_clean:
        raise typer.Exit(MISSING)


@app.command(context_settings={"allow_interspersed_args": False})
def conform(
    planner: Annotated[
        list[str] | None,
        typer.Argument(metavar="-- COMMAND", help="a planner: reads a problem as JSON, writes a path as JSON"),
    ] = None,
    instances: Annotated[
        str | None, typer.Option("--instances", metavar="A,B", help="names or families of instances (default: all)")
    ] = None,
    timeout: Annotated[float, typer.Option("--timeout", metavar="S", help="seconds an instance may take")] = 60.0,
    memory: Annotated[
        float, typer.Option("--memory", metavar="MB", help="megabytes that each process of the planner may take")
    ] = 4096.0,
    tolerance: Annotated[
        float | None,
        typer.Option(
            "--tolerance", metavar="R", help="exit with 1 if a path costs more than this above the best known"
        ),
    ] = None,
    workers: Annotated[
        int, typer.Option("--workers", metavar="N", min=1, help="instances at a time; they share out the cores")
    ] = 1,
    out: Annotated[Path | None, typer.Option("--out", metavar="FILE.json", help="write the results to a file")] = None,
    as_list: Annotated[bool, typer.Option("--list", help="list the instances and leave")] = False,
    show: Annotated[
        str | None, typer.Option("--show", metavar="NAME", help="print the problem of an instance, as planners get it")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schemas of problems and answers")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Measure any planner, in any language, against optima that are proven to 0.5 %.

    COMMAND is run once an instance: a problem on its standard input, a path on its standard output, both JSON. Each
    path is judged by the oracle (problem.evaluate); the table says how far it is from the best possible. A planner
    that hangs, crashes, floods or lies is a row that says so. Exits with 1 unless all answers are right.
    """
    import math

    from cgla_graph._validate import non_negative_number
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import conform as suite

    if as_list or show is not None or schema:
        _show_conformance(show, schema=schema, as_json=as_json)
        return
    allowed = math.inf if tolerance is None else non_negative_number("--tolerance", tolerance)
    command, asked = planner or [], suite.picked(instances)
    if out is not None:
        files.make_folder(out.parent)
    results = suite.run_suite(command, asked, seconds=timeout, megabytes=memory, workers=workers)
    found = suite.document(command, asked, results, seconds=timeout, tolerance=allowed)
    if out is not None:
        files.write_text(out, json.dumps(found, ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    if as_json:
        _print_json(found)
    else:
        suite.print_results(results, allowed)
        if out is not None:
            _say_files([out], out.parent)
    if len(results) < len(asked):
        msg = f"{len(results)} of {len(asked)} instances are done"
        raise console.InterruptedRunError(msg)
    if not suite.passes(results, allowed):
        raise typer.Exit(MISSING)


def _show_conformance(name: str | None, *, schema: bool, as_json: bool) -> None:
    """Print the problem of an instance, or else the schemas, or else a list of all instances."""
    from cgla_graph.comparisons.cli import conform as suite

    if name is not None:
        console.out(suite.problem_text(name))
    elif schema:
        from cgla_graph.comparisons.conformance.documents import conformance_schema

        _print_json(conformance_schema())
    elif as_json:
        console.out(json.dumps(suite.listing(), ensure_ascii=False, allow_nan=False, indent=1) + "\n")
    else:
        suite.print_listing()


@app.command()
def answer(
    solver: Annotated[
        str,
        typer.Option(
            "--solver", metavar="NAME", autocompletion=completion.solvers, help="name, with settings as NAME:A=1:B=2"
        ),
    ] = "hybrid",
    resolution: Annotated[
        int, typer.Option("--resolution", metavar="N", help="points a side of a closed lattice")
    ] = 20,
    refine: RefineOption = False,
) -> None:
    """
    Answer a problem of the conformance suite with one of the solvers here: a planner for cgla conform.

    Reads the problem as JSON from standard input, and writes the path as JSON to standard output.
    """
    from cgla_graph.comparisons.cli import conform as suite

    console.out(json.dumps(suite.answer(suite.read_stdin(), solver, resolution, refine=refine), allow_nan=False) + "\n")


@app.command()
def fly(
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
        typer.Option(
            "--solver",
            metavar="NAME",
            autocompletion=completion.solvers,
            help="name, with settings as NAME:A=1:B=2 (default: the mission's)",
        ),
    ] = None,
    variant: Annotated[
        str | None, typer.Option("--variant", metavar="NAME", help="fly only this variant (default: all)")
    ] = None,
    max_ticks: Annotated[int | None, typer.Option("--max-ticks", metavar="N", min=1, help="stop after N ticks")] = None,
    clearance: ClearanceOption = None,
    value: Annotated[
        bool,
        typer.Option(help="fly again with full knowledge, and without sharing, to see what these are worth"),
    ] = True,
    animation: Annotated[bool, typer.Option(help="with --out: draw animations as well as pictures")] = True,
    out: OutOption = None,
    export: ExportOption = None,
    altitude: AltitudeOption = None,
    above: AboveOption = None,
    speed: SpeedOption = None,
    strict: Annotated[bool, typer.Option("--strict", help="exit with 1 if a UAV does not arrive")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Fly a mission of several UAVs.

    Without arguments: Fig. 8 of the paper, two UAVs that meet unless virtual obstacles keep them apart. Prints a table
    a variant; with --out, writes a log (JSON Lines), traces (CSV), pictures and animations; with --export, what each
    UAV flew as a plan (NAME-UAV.plan). Ctrl-C keeps what is flown.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import export as exports
    from cgla_graph.comparisons.missions import fly as flights

    exported = exports.read_export(export, altitude, above, speed)
    opened, specs = flights.open_mission(
        mission, solver=solver, variant=variant, max_ticks=max_ticks, clearance=clearance
    )
    for spec in specs:
        exports.check_map(exported, spec)
    folder = files.make_folder(out) if out else None
    with console.running_solvers(), console.progress(None) as tick:
        done = flights.fly_all(specs, folder, value=value, animation=animation, step=tick)
    plans = exports.write_flights(exported, done.flown)
    if as_json:
        document = flights.flights_document(opened, done)
        _print_json({**document, "files": [*document["files"], *map(str, plans)]})
    else:
        flights.print_flights(done.flown)
        _say_files(done.written, folder)
        for file in plans:
            _say_files([file], file.parent)
    if done.failure is not None:
        raise done.failure
    if done.interrupted:
        raise console.InterruptedRunError(flights.kept_note(done, len(specs), folder))
    if strict and not all(flown.flight.all_arrived for flown in done.flown):
        raise typer.Exit(MISSING)


@app.command()
def results(
    folder: StudyArg,
    scenario: Annotated[
        str | None, typer.Option("--scenario", metavar="A,B", help="only these, as random-* too")
    ] = None,
    solver: Annotated[str | None, typer.Option("--solver", metavar="A,B", help="only these")] = None,
    status: Annotated[
        str | None,
        typer.Option("--status", metavar="A,B", help="only runs that ended so, as timed-out,stuck"),
    ] = None,
    seed: Annotated[int | None, typer.Option("--seed", metavar="N", help="only runs of this seed")] = None,
    runs: Annotated[bool, typer.Option("--runs", help="list single runs")] = False,
    against: Annotated[
        Path | None, typer.Option("--against", metavar="DIR", help="say what changed since an older study")
    ] = None,
    rerun: Annotated[
        int | None, typer.Option("--rerun", metavar="NUMBER", help="make a run once more, and say what is different")
    ] = None,
    export: Annotated[
        list[Path] | None,
        typer.Option("--export", metavar="FILE", help="write .csv, .jsonl, .parquet, .tex or .db (OMPL's tables)"),
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """
    Show the results of a study.

    Who wins, by how much, how sure that is, and where each solver fails; also while the study runs.
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
        _print_json(lookup.document(found))
    else:
        lookup.print_results(found)


@app.command()
def view(
    folder: StudyArg,
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="to listen on (default: one that is free)")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="open the page in the browser")] = True,
) -> None:
    """
    Show the report of a study in a browser.

    Served on this machine only, until Ctrl-C; the page refreshes while the study runs.
    """
    from cgla_graph.comparisons.report.view import serve

    serve(folder, port=port, open_browser=browser)


@app.command()
def live(
    scenario: Annotated[
        str, typer.Argument(metavar="[SCENARIO]", help="shipped name, .toml, .geojson, .map, or FILE.scen:ROW")
    ] = "paper",
    port: Annotated[
        int, typer.Option("--port", metavar="N", min=0, max=65535, help="to listen on (default: one that is free)")
    ] = 0,
    browser: Annotated[bool, typer.Option(help="open the page in the browser")] = True,
) -> None:
    """
    Drag threats, ends and areas of a map; the path and its proof follow.

    A page on this machine only, until Ctrl-C; its address has a token that every request needs. Other solvers are
    shown side by side, and the map is saved as a scenario file.
    """
    from cgla_graph.comparisons.cli import live as page

    page.run(scenario, port=port, browser=browser)


@app.command()
def claims(
    ids: Annotated[
        list[str] | None, typer.Argument(metavar="ID", help="claims, as C28, or C17-C19 for a range (default: all)")
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="on a few maps only: minutes instead of an hour")] = False,
    maps: Annotated[
        int | None, typer.Option("--maps", metavar="N", min=1, help="random maps a cell (default: 200)")
    ] = None,
    seed: Annotated[int, typer.Option("--seed", metavar="S", min=0, help="of all that is drawn")] = 1,
    out: OutOption = None,
    resume: ResumeOption = False,
    overwrite: OverwriteOption = False,
    workers: WorkersOption = None,
    dask: DaskOption = None,
    strict: Annotated[
        bool, typer.Option("--strict", help="exit with 1 unless every claim is proved or supported")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Check the claims of the paper.

    Prints a verdict for each, of up to three claims with all the evidence. With --out, writes a report (report.html,
    report.md), the paper's figures and tables remade, the counterexamples, and all numbers (claims.json); what is
    measured is kept as it comes (claims.jsonl), so that an interrupted study can go on. Ctrl-C keeps what is done.
    """
    from cgla_graph.comparisons.claims import catalogue, command, terminal, wording
    from cgla_graph.comparisons.claims.evidence import Scale
    from cgla_graph.errors import CglaError

    if quick and maps is not None:
        msg = "--quick chooses the number of maps itself; leave out --maps, or --quick"
        raise CglaError(msg)
    if (resume or overwrite) and out is None:
        msg = f"{'--resume' if resume else '--overwrite'} needs the folder of the study (--out)"
        raise CglaError(msg)
    scale = Scale(Scale().maps if maps is None else maps, seed, quick)
    request = command.Request(catalogue.chosen(ids or []), scale, out, resume, overwrite, scheduler=dask)
    if workers is not None:
        request = dataclasses.replace(request, workers=workers)
    done = command.check_all(request)
    if as_json:
        _print_json(wording.results_document(done.results, scale))
    else:
        terminal.print_results(done.results, scale)
        _say_files(done.written, out)
    if done.interrupted:
        kept = f"; go on with --out {out} --resume" if out else ""
        msg = f"{len(done.results)} of {len(request.claims)} claims are checked{kept}"
        raise console.InterruptedRunError(msg)
    for shown in done.shown:
        if shown.failed:
            console.say(f"{shown.artefact.label} could not be made: {shown.failed}")
    if not done.is_whole or (strict and not done.all_hold):
        raise typer.Exit(MISSING)


@app.command()
def solvers(as_json: JsonOption = False) -> None:
    """
    List the solvers.

    Says what each is and promises, its settings, and what is missing where one cannot run.
    """
    from cgla_graph.solvers import listing

    lines = [listing.describe(name) for name in listing.built_in()]
    for name in listing.plug_ins():
        from cgla_graph.solvers import registry

        lines.append(registry.describe(name))
    _print_listing("solvers", list(lines[0]), lines, as_json)


@app.command()
def scenarios(
    show: Annotated[
        str | None, typer.Option("--show", metavar="NAME", help="print the file of a shipped scenario")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schema of scenario files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    List the shipped scenarios.

    With --show, prints the file of one as a start for your own; with --schema, the JSON schema of such files.
    """
    from cgla_graph.scenarios import shipped

    if schema:
        from cgla_graph.scenarios.scenario import schema as schema_of

        _print_json(schema_of())
    elif show is not None:
        console.out(shipped.shipped_scenario(show))
    else:
        _print_listing("scenarios", ["name", "title"], shipped.scenario_list(), as_json)


@app.command()
def missions(
    show: Annotated[
        str | None, typer.Option("--show", metavar="NAME", help="print the file of a shipped mission")
    ] = None,
    schema: Annotated[bool, typer.Option("--schema", help="print the JSON schema of mission files")] = False,
    as_json: JsonOption = False,
) -> None:
    """
    List the shipped missions.

    With --show, prints the file of one as a start for your own; with --schema, the JSON schema of such files.
    """
    from cgla_graph.scenarios import shipped

    if schema:
        from cgla_graph.scenarios.mission_file import mission_schema

        _print_json(mission_schema())
    elif show is not None:
        console.out(shipped.shipped_mission(show))
    else:
        lines = shipped.mission_list()
        _print_listing("missions", ["name", "title", "uavs", "variants"], lines, as_json, {"title": 30, "variants": 20})


def _print_listing(
    what: str,
    heads: Sequence[str],
    lines: Sequence[Mapping[str, Any]],
    as_json: bool,
    widest: Mapping[str, int] | None = None,
) -> None:
    """Print records: all of each as JSON, or these columns as a table, some of them no wider than that."""
    from cgla_graph.comparisons.tables.listing import listing

    if as_json:
        _print_json({what: lines})
        return
    plain = [
        {head: ", ".join(line[head]) if isinstance(line[head], list) else line[head] for head in heads}
        for line in lines
    ]
    console.out_table(listing(what, heads, plain, widest))


def _print_json(document: dict[str, Any]) -> None:
    console.out(json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n")


def _say_files(written: Iterable[Path], folder: Path | None) -> None:
    names = [path.name for path in written]
    if names:
        console.out(f"written to {folder}: {', '.join(names)}\n")


def _say_warning(message: Warning | str, *_: object, **__: object) -> None:
    """Show a warning as one line on standard error."""
    console.say(f"cgla: {' '.join(str(message).split())}")


def _leave_garbage() -> None:
    """Have nothing looked through at the end, unless OMPL is loaded: it complains of all of its own that is left."""
    if "ompl" not in sys.modules:
        gc.freeze()


def main() -> None:
    """Run the command line: wrong input is one line on standard error and exit code 2, never a traceback."""
    from cgla_graph.errors import CglaError

    # imports make objects by the hundred thousand and no garbage; `console.running_solvers` collects again
    gc.disable()
    # nor is any looked for at the end of the process, which would take longer than many a command
    atexit.unregister(_leave_garbage)
    atexit.register(_leave_garbage)
    completion.read_no_values()
    for stream in (sys.stdout, sys.stderr):
        # a terminal of few letters gets escapes instead of a failure
        if isinstance(stream, io.TextIOWrapper):
            stream.reconfigure(errors="backslashreplace")
    try:
        with warnings.catch_warnings():
            warnings.showwarning = _say_warning
            code = app(sys.argv[1:] or ["--help"], standalone_mode=False)
        # typer turns Ctrl-C into this code
        if code == INTERRUPTED:
            console.say("cgla: interrupted")
    except console.InterruptedRunError as error:
        console.say(f"cgla: interrupted: {error}")
        code = INTERRUPTED
    except CglaError as error:
        console.say(f"cgla: {' '.join(str(error).split())}")
        code = WRONG_INPUT
    except typer.TyperException as error:
        console.say(f"cgla: {' '.join(error.format_message().split())} (cgla --help shows the usage)")
        code = WRONG_INPUT
    except KeyboardInterrupt:
        console.say("cgla: interrupted")
        code = INTERRUPTED
    except console.ReaderGoneError:
        console.forget_stdout()
        code = DONE
    except OSError as error:
        console.say(f"cgla: standard output: {error.strerror or error}; choose another place for it")
        console.forget_stdout()
        code = WRONG_INPUT
    finally:
        console.end_compiling()
    # whoever called this may go on
    gc.unfreeze()
    gc.enable()
    sys.exit(code or DONE)
