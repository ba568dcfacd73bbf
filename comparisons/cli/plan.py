"""The command `plan`: one path, and how far it is from the best possible."""

import dataclasses
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    BudgetOptions,
    ExportOptions,
    FlyableOptions,
    GroundRiskOptions,
    MapOptions,
    OutputOptions,
    ProofOptions,
    RasterOptions,
    RefineOption,
    ScenarioArg,
    SolverOption,
    ZoneOptions,
    open_map,
)

if TYPE_CHECKING:
    from cgla_graph._types import FloatArray
    from cgla_graph.comparisons.study.runner import Run
    from cgla_graph.scenarios.scenario import Scenario


def plan(
    scenario: ScenarioArg,
    output: OutputOptions,
    export: ExportOptions,
    flyable: FlyableOptions,
    budget: BudgetOptions,
    ground: GroundRiskOptions,
    proof: ProofOptions,
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    solver: SolverOption = "hybrid",
    refine: RefineOption = False,
    profile: Annotated[
        Path | None,
        typer.Option("--profile", metavar="FILE", help="write risk and cost along the path: .csv, or .png, .svg, .pdf"),
    ] = None,
) -> None:
    """
    Plan one path.

    Prints its numbers, and how far it is from the best possible; with --out, writes its waypoints (CSV, and GeoJSON
    on lon/lat maps) and a picture; with --export, a plan that ground stations and viewers open. With --max-risk or
    --max-length, a budget takes the place of the weight k; with --max-density, no cell of a raster within half the
    --corridor is above it. With --turn-radius, the path is one of lines and arcs, bent until it costs least.
    On the file of a graph: cgla graph plan.
    """
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.cli import export as exports
    from cgla_graph.comparisons.cli import flyable as flights
    from cgla_graph.comparisons.cli import output as outputs
    from cgla_graph.comparisons.study import options, runner
    from cgla_graph.comparisons.tables import zone_list

    limited = budget.max_risk is not None or budget.max_length is not None
    flying = flights.read_flying(
        flyable.turn_radius,
        (flyable.start_heading, flyable.goal_heading),
        flyable.arc_tolerance,
        flyable.wind,
        flyable.power,
        flyable.speed,
        limited=limited,
    )
    # (of a flyable path, the speed is about its time as well)
    exported = exports.read_export(
        export.export,
        export.altitude,
        export.above,
        export.speed if export.export or not flying.asked else None,
        zones=zone_list.may_have_zones(scenario[0], maps.no_fly),
    )
    bound = options.read_tolerance(proof.tolerance, certify=not proof.no_certificate)
    entrant = options.read_entrant(solver, refine=refine)
    opened = open_map("plan", scenario, maps, zones, raster, k=_price_of_risk(maps.k, ground))
    opened = _below_density(opened, ground)
    exports.check_map(exported, opened)
    zoned = zone_list.print_zones(
        [opened],
        zones.zones_list,
        altitude=None if export.export else zones.altitude,
        two=bool(export.export) and zones.above is None,
        as_json=output.as_json,
    )
    folder = files.make_folder(output.out) if output.out else None
    kinds = outputs.read_formats(output.formats, ["png"])
    _check_profile(profile)
    with console.running_solvers(opened.problem.model):
        if limited:
            from cgla_graph.comparisons.cli import pareto as trade_off

            within = trade_off.plan_of(opened, entrant, budget.max_risk, budget.max_length, bound)
            run = trade_off.run_of(opened, entrant, within.solution)
        else:
            run = flights.flown(next(iter(runner.compare([opened], [entrant], 1, tolerance=bound))), flying)
        if ground.max_density is not None:
            from cgla_graph.comparisons.cli import density

            run = density.with_proof(run)
    written = [outputs.write_plan(folder, run, kinds) if folder and run.solution.status.has_path else []]
    written.append(_write_profile(profile, run, flying.clock))
    exported_to = exports.write_export(exported, opened, run.solution, arc_tolerance=flying.tolerance)
    written += [[file] for file in exported_to]
    if output.as_json:
        more = {"within": trade_off.within_document(within)} if limited else {}
        names = [str(path) for paths in written for path in paths]
        document = {**outputs.plan_document(run), "files": names, **more, **flights.document(run, flying), **zoned}
        console.out_json(document)
    else:
        outputs.print_plan(run, flights.lines(run, flying))
        if limited:
            trade_off.print_within(run.scenario, within)
        for paths in written:
            console.out_files(paths)
    if not run.solution.status.has_path:
        raise typer.Exit(console.MISSING)


def _price_of_risk(k: float | None, ground: GroundRiskOptions) -> float | None:
    """
    Return the risk weight that is given, or the one that two prices make.

    Examples
    --------
    >>> _price_of_risk(None, GroundRiskOptions(2e6, 0.01)), _price_of_risk(5.0, GroundRiskOptions())
    (200000000.0, 5.0)

    Raises
    ------
    CglaError
        If both are given, or only one of the prices, or a price is not above 0.
    """
    from cgla_graph.errors import CglaError

    if ground.prevented_fatality is None and ground.metre_price is None:
        return k
    if k is not None:
        msg = "--k and prices are both given; give one of them"
        raise CglaError(msg)
    if ground.prevented_fatality is None or ground.metre_price is None:
        msg = "--prevented-fatality and --metre-price go together: k is the one over the other; give both"
        raise CglaError(msg)
    from cgla_graph.model.ground_risk import risk_weight

    return risk_weight(prevented_fatality=ground.prevented_fatality, metre=ground.metre_price)


def _below_density(scenario: "Scenario", ground: GroundRiskOptions) -> "Scenario":
    """
    Return the scenario without the cells above a density, and all that is too near to them.

    Raises
    ------
    CglaError
        If there is a corridor without a density, or the scenario has no raster, or no path stays below.
    """
    if ground.max_density is None:
        if ground.corridor is not None:
            from cgla_graph.errors import CglaError

            msg = f"--corridor {ground.corridor:g} without --max-density; say how dense it may get under the corridor"
            raise CglaError(msg)
        return scenario
    from cgla_graph.solvers.trade_off.density import below_density

    problem = below_density(scenario.problem, ground.max_density, corridor=ground.corridor or 0.0)
    return dataclasses.replace(scenario, problem=problem)


def _check_profile(target: Path | None) -> None:
    """Check the file of --profile before any work is done."""
    if target is not None:
        from cgla_graph.comparisons.profile import check_profile_file

        check_profile_file(target)


def _write_profile(target: Path | None, run: "Run", clock: "Callable[[FloatArray], FloatArray] | None") -> list[Path]:
    """Write the profile of a path, if that was asked for and there is one."""
    if target is None or not run.solution.status.has_path:
        return []
    from cgla_graph.comparisons.profile import write_profile

    return [write_profile(target, run.scenario, run.solution.path, clock)]
