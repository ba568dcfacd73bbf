"""The command `plan`: find a path, and bound its distance from the best possible."""

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, NoReturn, cast

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    AltitudesOptions,
    BudgetOptions,
    ExportOptions,
    FlightTimeOptions,
    FlyableOptions,
    GroundRiskOptions,
    MapOptions,
    OutputOptions,
    ProofFileOption,
    ProofOptions,
    RasterOptions,
    RefineOption,
    ScenarioArg,
    SolverOption,
    TourOptions,
    UncertainOptions,
    VolumeOptions,
    ZoneOptions,
    open_map,
    option,
)

if TYPE_CHECKING:
    from cgla_graph.comparisons.cli.budget import Uncertain
    from cgla_graph.comparisons.cli.export import Export, Exported
    from cgla_graph.comparisons.cli.flight_time import Endurance
    from cgla_graph.comparisons.cli.flyable import Flying
    from cgla_graph.comparisons.cli.tour import Touring
    from cgla_graph.comparisons.cli.volumes import Laid, Laying
    from cgla_graph.comparisons.study.entrant import Entrant
    from cgla_graph.comparisons.study.proofs import ProofLine
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.scenarios.scenario import Scenario
    from cgla_graph.solvers.trade_off.plan_within import PlanWithin


def plan(
    scenario: ScenarioArg,
    maps: MapOptions,
    tour: TourOptions,
    budget: BudgetOptions,
    uncertain: UncertainOptions,
    zones: ZoneOptions,
    heights: AltitudesOptions,
    flyable: FlyableOptions,
    times: FlightTimeOptions,
    raster: RasterOptions,
    ground: GroundRiskOptions,
    aircraft: AircraftOptions,
    volume: VolumeOptions,
    export: ExportOptions,
    proof: ProofOptions,
    output: OutputOptions,
    solver: SolverOption = "hybrid",
    refine: RefineOption = False,
    proof_file: ProofFileOption = None,
    profile: Annotated[
        Path | None, option("--profile FILE", "write risk and cost along the path: .csv, or .png, .svg, .pdf")
    ] = None,
    pairs: Annotated[
        Path | None, option("--pairs FILE", "plan from each start to each goal of a CSV file, with shared work")
    ] = None,
    isochrones: Annotated[
        str | None, option("--isochrones C,…", "areas from which the goal can be reached at these costs, with --out")
    ] = None,
) -> None:
    """
    Plan one path.

    Prints its numbers, and how far it is from the best possible; with --out, writes its waypoints (CSV, and GeoJSON
    on lon/lat maps) and a picture; with --export, a plan for ground stations and viewers; with --proof, a proof that
    others can check. With --via, it visits places on the way. With --max-risk, --max-length or --max-energy, a budget
    replaces the weight k; with --max-density, no cell of a raster within half the --corridor is above it. With
    --turn-radius, the path consists of lines and arcs, bent until it costs least. With --speed, it says how long the
    flight takes, with --power its energy, with --battery whether the battery lasts.
    With --volumes, flight geography, contingency volume and ground risk buffer are laid around it, and people below
    them are counted.
    With --altitudes, it plans at each of them and takes the best. With --scenarios, the risk is uncertain, and
    --objective chooses between the expected cost, the mean of the worst costs and the worst one.
    With --pairs, it answers each line of a table: start_x,start_y,goal_x,goal_y (start_longitude,... on lon/lat maps);
    with --isochrones, it finds from where the goal can be reached at some costs, for certain and possibly.
    Of a map with threats that move, areas that close and open, or wind, it finds the best flight and departure.
    For the file of a graph, use cgla graph plan.
    """
    if pairs is not None or isochrones is not None:
        _plan_many(
            pairs,
            isochrones,
            lambda: open_map("plan", scenario, maps, zones, raster, aircraft),
            (proof, output, zones),
            (tour, budget, uncertain, heights, flyable, times, ground, volume, export),
            {"profile": profile, "refine": refine, "proof": proof_file, "solver": solver},
        )
    _check_profile(profile)
    from cgla_graph.comparisons.cli import ground as on_ground
    from cgla_graph.comparisons.cli.altitudes import at_best, read_altitudes
    from cgla_graph.comparisons.study.options import read_entrant, read_tolerance

    certify, entrant = not proof.no_certificate, read_entrant(solver, refine=refine)
    tolerance = read_tolerance(proof.tolerance, certify=certify)
    in_file = _proof_target(proof_file, flyable, budget, tour, proven=tolerance is not None)
    unsure = _unsure(
        uncertain,
        (budget, tour, flyable, heights),
        {"--max-density": ground.max_density, "--profile": profile, "--proof": proof_file},
        is_default=proof.tolerance is None,
    )
    k, planned = on_ground.weight_of(scenario, maps.k, ground, budget), bool(export.export)
    groups, ground = (
        (tour, budget, uncertain, heights, flyable, times, ground, volume, export),
        _with_corridor(ground, volume, zones, export),
    )

    def open_with(at: ZoneOptions, **changes: Any) -> "Scenario":  # noqa: ANN401 - other options of the map
        """Open the map at an altitude, with other ends or bounds."""
        changed = dataclasses.replace(maps, **changes)
        return _if_still(
            open_map("plan", scenario, changed, at, raster, aircraft, k=k, exported=planned),
            (output, proof, profile),
            groups,
            {"proof": proof_file, "solver": solver},
        )

    @cache
    def maps_at(altitude: float | None) -> "tuple[Scenario, Scenario]":
        """Open the map at an altitude, without and with the limit of density."""
        at = dataclasses.replace(zones, altitude=altitude)
        opened = _with_places(tour, lambda bounds: open_with(at, bounds=bounds), maps.bounds, scenario)
        return on_ground.asked_of(opened if unsure is None else unsure.on(opened), ground)

    solved = cache(lambda one: (_solved if unsure is None else unsure.solved)(one, entrant, tolerance))
    zones, export, best = at_best(
        read_altitudes(heights, zones, {**vars(budget), "turn_radius": flyable.turn_radius, "via": tour.via}),
        zones,
        export,
        lambda altitude: maps_at(altitude)[1],
        lambda one: solved(one).solution,
        as_json=output.as_json,
    )
    endurance = _endurance(times, export, profile, curved=flyable.turn_radius is not None)
    flying, laying = _flying(flyable, budget, endurance), _laying(volume, zones, export)
    counts = endurance is not None or laying is not None or any(zones.may_count(one, maps) for one in scenario)
    exported = _exports(export, zoned=counts)
    without_limit, opened = maps_at(zones.altitude)
    touring = _touring(tour, opened, flyable, budget, lambda start: open_with(zones, start=start, goal=start))
    for one in (exported, laying):
        if one is not None:
            one.check_map(opened)
    _check_provable(in_file, opened)
    high = bool(export.export) or endurance is not None or (laying is not None and opened.zones is None)
    zoned = {**zones.report([opened], as_json=output.as_json, exported=high), **best}
    folder, kinds = output.folder(), output.pictures("png")
    with console.running_solvers([] if tolerance is None else [opened.problem.model]):
        run, within = _planned(opened, solved, entrant, tolerance, budget, endurance, touring)
        run = run if flying is None else flying.flown(run)
        run = run if ground.max_density is None or run.solution.status.has_path else _with_proof(run)
    flight = None if endurance is None else endurance.of(run)
    people = on_ground.exposed(run, ground, bounded=budget == BudgetOptions() and touring is None)
    laid = None if laying is None else laying.around_run(run, without_limit, export, flying)
    written, plans = _written(run, folder, kinds, profile, flying, endurance, exported, laid)
    in_proof = None if in_file is None or tolerance is None else _proof_of(in_file, run, tolerance)
    written += [] if in_proof is None else [in_proof.files]
    parts: dict[str, Any] = {
        "ground": people,
        "flyable": flying,
        "tour": touring,
        "flight": flight,
        "volumes": laid,
    } | {"exported": plans, "within": within, "proof_file": in_proof, "uncertain": unsure}
    _tell(run, parts, written, zoned, as_json=output.as_json, windy=times.wind is not None)
    missed = any(one.faults for one in (flight, people, plans) if one is not None)
    missed |= in_proof is not None and in_proof.found is None
    if not run.solution.status.has_path or missed or (laid is not None and laid.report.touched):
        raise typer.Exit(console.MISSING)


def _if_still(
    scenario: "Scenario",
    taken: tuple[OutputOptions, ProofOptions, Path | None],
    groups: Sequence[Any],
    options: Mapping[str, object],
) -> "Scenario":
    """Return a map; if it changes in time, plan a flight through it and end."""
    if not scenario.in_time:
        return scenario
    from cgla_graph.comparisons.cli.timed import plan_timed

    raise typer.Exit(plan_timed(scenario, *taken, groups, options))


def _proof_target(
    file: Path | None, flyable: FlyableOptions, budget: BudgetOptions, tour: TourOptions, *, proven: bool
) -> Path | None:
    """Check the file of a proof, and that a proof file can hold the path that is planned."""
    if file is None:
        return None
    from cgla_graph.comparisons.study.proofs import read_proof

    refused: dict[str, tuple[object, str]] = {
        "--turn-radius": (flyable.turn_radius, "a proof file holds a path of straight lines, and no arcs"),
        "--via": (tour.via, "no proof file holds the bound of a tour"),
        **{
            f"--{name.replace('_', '-')}": (value, "a proof file bounds length + k * risk, and knows no budget")
            for name, value in vars(budget).items()
        },
        "--no-certificate (or --tolerance 0)": (not proven, "without a bound, there is no proof to write"),
    }
    return read_proof("--proof", file, refused)


def _check_provable(file: Path | None, scenario: "Scenario") -> None:
    """Check that there is a proof of a map, if one is to be written."""
    if file is not None:
        from cgla_graph.comparisons.study.proofs import check_provable

        problem = scenario.problem
        check_provable("--proof", file, problem.field, problem.start, problem.goal)


def _proof_of(file: Path, run: "Run", tolerance: float) -> "ProofLine":
    """Write the proof of a path."""
    from cgla_graph.comparisons.study.proofs import proof_of_run

    return proof_of_run(file, run, tolerance)


def _plan_many(
    pairs: Path | None,
    isochrones: str | None,
    opened: "Callable[[], Scenario]",
    taken: tuple[ProofOptions, OutputOptions, ZoneOptions],
    groups: Sequence[Any],
    options: Mapping[str, Any],
) -> NoReturn:
    """Answer the questions of a file, or find isochrones, and end; `groups` and `options` are those not taken."""
    from cgla_graph.comparisons.cli.tour import check_alone, plan_isochrones, plan_pairs

    if pairs is None and isochrones is not None:
        check_alone("--isochrones", groups, options)
        raise typer.Exit(plan_isochrones(opened(), isochrones, *taken))
    check_alone("--pairs", groups, {**options, "isochrones": isochrones})
    raise typer.Exit(plan_pairs(opened(), cast("Path", pairs), *taken))


def _planned(
    scenario: "Scenario",
    solved: "Callable[[Scenario], Run]",
    entrant: "Entrant",
    tolerance: float | None,
    budget: BudgetOptions,
    endurance: "Endurance | None",
    touring: "Touring | None",
) -> "tuple[Run, PlanWithin | None]":
    """Find a path, a tour, or a path within a budget."""
    if touring is not None:
        return touring.planned(scenario, entrant, tolerance), None
    if budget == BudgetOptions():
        return solved(scenario), None
    from cgla_graph.comparisons.cli.budget import plan_within
    from cgla_graph.comparisons.study.runner import Run

    within = plan_within(scenario, entrant, budget, tolerance, endurance)
    return Run(scenario, entrant.label, None, exact=False, solution=within.solution), within


def _tell(
    run: "Run",
    parts: Mapping[str, Any],
    written: Sequence[Sequence[Path]],
    zoned: Mapping[str, Any],
    *,
    as_json: bool,
    windy: bool,
) -> None:
    """Print a path, its parts and its files; as JSON, also the states of zones."""
    lines, more = _of_options(run, parts, windy=windy)
    files = [file for group in written for file in group]
    if not as_json:
        _print(run, lines, parts["within"])
        console.out_files(files)
        return
    from cgla_graph.comparisons.study.rows import plan_document

    console.out_json({**plan_document(run), "files": [str(file) for file in files], **more, **zoned})


def _of_options(run: "Run", parts: Mapping[str, Any], *, windy: bool) -> tuple[dict[str, str], dict[str, Any]]:
    """Return the printed lines and the JSON of what a path may have besides its numbers: those that are not None."""
    lines: dict[str, str] = {}
    more: dict[str, Any] = {}
    for name, part in parts.items():
        if part is None:
            continue
        # (settings tell of a run)
        of_run = (run,) if name in {"flyable", "tour", "uncertain"} else ()
        more[name] = part.document(*of_run)
        if name == "within":
            from cgla_graph.comparisons.cli.budget import status_within

            lines |= status_within(part)
        elif name == "ground":
            lines |= part.lines(windy=windy)
        elif name == "flight":
            lines |= part.lines(" m/s" if run.on_map.projection else " a second")
        else:
            lines |= part.lines(*of_run)
    return lines, more


def _solved(scenario: "Scenario", entrant: "Entrant", tolerance: float | None) -> "Run":
    """Find a path by `cgla_graph.solve`, and its bound by `cgla_graph.lower_bound`."""
    from cgla_graph.comparisons.study.runner import Run, no_certificate, reason, status_by
    from cgla_graph.model.solution import Solution, Status
    from cgla_graph.solvers import registry
    from cgla_graph.solvers.solving import bounded, proven, solve

    missing, problem = registry.missing(entrant.name), scenario.problem
    settings = {} if missing else entrant.settings_on(scenario)
    if settings.get("tolerance", ...) is None and not entrant.refine:
        # this solver proves its own path
        settings["tolerance"] = tolerance
    seed = settings.setdefault("seed", 1) if not missing and registry.traits(entrant.name).seeded else None
    try:
        if missing:
            solution = Solution(Status.UNAVAILABLE, solver=entrant.name, message=missing)
        else:
            chosen = registry.get(entrant.name, **settings)
            solution = solve(problem, chosen, resolution=scenario.lattice, refine=entrant.refine)
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a solver may raise anything
        solution = Solution(status_by(error), solver=entrant.name, message=reason(error))
    if tolerance is not None:
        try:
            solution = proven(problem, solution, tolerance)
        except Exception as error:  # noqa: BLE001 - the path is an answer without a proof
            solution = bounded(solution, no_certificate(tolerance, reason(error), 0.0))
    settings.pop("seed", None)
    names = (scenario, entrant.label, seed, entrant.is_exact)
    return Run(*names, solution=solution, certificate=solution.certificate, settings=settings)


def _endurance(
    times: FlightTimeOptions, export: ExportOptions, profile: Path | None, *, curved: bool
) -> "Endurance | None":
    """Read the options of the time of flight; None without any."""
    if times == FlightTimeOptions():
        return None
    from cgla_graph.comparisons.cli.flight_time import read_endurance

    return read_endurance(times, export, profile, curved=curved)


def _flying(flyable: FlyableOptions, budget: BudgetOptions, endurance: "Endurance | None") -> "Flying | None":
    """Read the options of flyable paths; None without any."""
    if all(value is None for value in vars(flyable).values()):
        return None
    from cgla_graph.comparisons.cli.flyable import read_flying

    aircraft = None if endurance is None else endurance.aircraft
    return read_flying(flyable, limited=budget != BudgetOptions(), aircraft=aircraft)


def _unsure(
    uncertain: UncertainOptions, groups: Sequence[object], others: Mapping[str, object], *, is_default: bool
) -> "Uncertain | None":
    """Read the options of uncertain risk; None without any."""
    if uncertain == UncertainOptions():
        return None
    from cgla_graph.comparisons.cli.budget import read_uncertain

    named = {f"--{name.replace('_', '-')}": one for group in groups for name, one in vars(group).items()}
    return read_uncertain(uncertain, {**named, **others}, is_default=is_default)


def _with_corridor(
    ground: GroundRiskOptions, volume: VolumeOptions, zones: ZoneOptions, export: ExportOptions
) -> GroundRiskOptions:
    """Return the options of ground risk, with the corridor of the volumes if it is asked for."""
    if not volume.corridor_of_volumes:
        return ground
    from cgla_graph.comparisons.cli.volumes import with_corridor

    return with_corridor(ground, volume, zones, export)


def _laying(volume: VolumeOptions, zones: ZoneOptions, export: ExportOptions) -> "Laying | None":
    """Read the options of volumes around the path; None without any."""
    if not volume.are_asked_for:
        return None
    from cgla_graph.comparisons.cli.volumes import read_laying

    return read_laying(volume, zones, export)


def _with_places(
    tour: TourOptions, opened: "Callable[[str | None], Scenario]", bounds: str | None, specs: Sequence[str]
) -> "Scenario":
    """Open a map; without bounds, places to visit widen those of a map of areas."""
    found = opened(bounds)
    if not tour.via or bounds is not None:
        return found
    from cgla_graph.comparisons.cli.tour import bounds_around

    wide = bounds_around(tour, found, specs)
    return found if wide is None else opened(wide)


def _touring(
    tour: TourOptions,
    opened: "Scenario",
    flyable: FlyableOptions,
    budget: BudgetOptions,
    open_from: "Callable[[str], Scenario]",
) -> "Touring | None":
    """Read the places to visit; None without any."""
    if tour == TourOptions():
        return None
    from cgla_graph.comparisons.cli.tour import read_touring

    return read_touring(tour, opened, flyable, budget, open_from)


def _exports(export: ExportOptions, *, zoned: bool) -> "Export | None":
    """Read the options of flight plans to write; None without any."""
    if not export.export:
        # without a plan to write, the speed only counts for times
        export = dataclasses.replace(export, speed=None)
    if export == ExportOptions():
        return None
    from cgla_graph.comparisons.cli.export import read_export

    return read_export(export, zones=zoned)


def _written(
    run: "Run",
    folder: Path | None,
    kinds: Sequence[str],
    profile: Path | None,
    flying: "Flying | None",
    endurance: "Endurance | None",
    exported: "Export | None",
    laid: "Laid | None",
) -> "tuple[list[list[Path]], Exported | None]":
    """Write all files, if there is a path; return them in groups, one per folder or file, and the exported plan."""
    if not run.solution.status.has_path:
        return [], None
    written, plans = [], None
    if folder is not None:
        written.append(_write(folder, run, kinds))
    if profile is not None:
        from cgla_graph.plots.profile import profile_of, write_profile

        clock = None if endurance is None else endurance.clock
        along = profile_of(run.on_map.problem, run.solution.path)
        written.append([write_profile(profile, run.on_map, along, clock)])
    if exported is not None:
        tolerance = None if flying is None else flying.tolerance
        fence = () if laid is None else laid.fence()
        plans = exported.write(run.on_map, run.solution, arc_tolerance=tolerance, fence=fence)
        written += [[file] for file in plans.files]
    if laid is not None:
        written += laid.write(folder, kinds)
    return written, plans


def _write(folder: Path, run: "Run", formats: Sequence[str]) -> list[Path]:
    """Write the waypoints of a path, GeoJSON on lon/lat maps, and a picture."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.plots.runs import map_of_runs
    from cgla_graph.plots import pictures

    stem = files.stem_of(folder, run.on_map, run.solver)
    written = [files.write_text(stem.with_name(f"{stem.name}.csv"), files.path_csv(run.on_map, run.solution))]
    if run.on_map.projection is not None:
        geojson = files.path_geojson(run.on_map, run.solution)
        written.append(files.write_text(stem.with_name(f"{stem.name}.geojson"), geojson))
    return [*written, *pictures.save_all(map_of_runs([run]), stem, formats)]


def _print(run: "Run", more: Mapping[str, str], within: "PlanWithin | None") -> None:
    """Print the numbers of a path, one per line, `more` lines, which may replace others, and those of a budget."""
    from cgla_graph._text import duration, figure, percent, rounded_down
    from cgla_graph.comparisons.study.rows import bound_note, claims_note
    from cgla_graph.model.earth import distortion_note
    from cgla_graph.people.units import risk_text

    scenario, solution = run.on_map, run.solution
    unit = " m" if scenario.projection else ""
    note = bound_note([run], unit)
    no_fly = scenario.problem.no_fly
    clearance = figure(solution.clearance, 6) + unit if math.isfinite(solution.clearance) else "-"
    if no_fly is None or no_fly.is_empty:
        # (a limit of density may close nothing)
        clearance = "no no-fly area"
    if scenario.problem.clearance > 0.0:
        clearance += f", required: at least {scenario.problem.clearance:g}{unit}"
    clearance += "" if scenario.zones is None else f" ({scenario.zones.rule})"
    lines = {
        "scenario": scenario.full_title,
        "solver": run.solver,
        "status": f"{solution.status.label}: {solution.status.value}",
        "cost": figure(solution.cost, 9) + unit,
        "bound": rounded_down(solution.lower_bound, 9) + unit if math.isfinite(solution.lower_bound) else "",
        "gap": f"{percent(solution.gap)}: {note}" if note and solution.status.has_path else "",
        "claim": claims_note([run], unit),
        "length": figure(solution.length, 9) + unit,
        "risk": risk_text(solution.risk, scenario.problem.field, 6),
        "k": f"{scenario.problem.k:g}",
        "clearance": clearance,
        "flat map": distortion_note(scenario.projection, [solution.path]) if unit and solution.status.has_path else "",
        **more,
        "waypoints": str(len(solution.path)),
        "time": f"{duration(solution.seconds)}, and {duration(solution.build_seconds)} to build the weights",
        "remark": solution.message,
    }
    console.out_lines(lines)
    if within is not None:
        from cgla_graph.comparisons.cli.budget import print_within

        print_within(scenario, within)


def _with_proof(run: "Run") -> "Run":
    """Return a run that found no path below a density, marked as proven if there is a proof that no path exists."""
    from cgla_graph.certificate.verdict import is_proven_closed
    from cgla_graph.model.solution import Status

    if not is_proven_closed(run.on_map.problem):
        return run
    message = "proven: no path stays below the density, not even one that touches the cells above it"
    return dataclasses.replace(run, solution=dataclasses.replace(run.solution, status=Status.NO_PATH, message=message))


def _check_profile(target: Path | None) -> None:
    """Check the file of --profile before any work is done."""
    if target is not None:
        from cgla_graph.plots.profile import check_profile_file

        check_profile_file(target)
