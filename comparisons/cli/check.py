"""The command `check`: a flight plan, leg by leg, against zones and maps."""

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.options import (
    AircraftOptions,
    BoundsOption,
    ClearanceOption,
    FlightTimeOptions,
    GroundRiskOptions,
    KOption,
    OutputOptions,
    PlanOptions,
    ProofFileOption,
    RasterOptions,
    VolumeOptions,
    ZoneOptions,
    option,
)

if TYPE_CHECKING:
    from cgla_graph.airspace.endurance.aircraft import Aircraft
    from cgla_graph.scenarios.scenario import Scenario


def check(
    plan_file: Annotated[
        Path,
        typer.Argument(
            metavar="PLAN", help=".plan, .waypoints, .kml, .kmz, .gpx, .geojson, or .csv, recognised by its content"
        ),
    ],
    zone_options: ZoneOptions,
    plan_options: PlanOptions,
    times: FlightTimeOptions,
    raster: RasterOptions,
    ground: GroundRiskOptions,
    failing: AircraftOptions,
    volume: VolumeOptions,
    output: OutputOptions,
    against: Annotated[
        list[str] | None,
        typer.Argument(metavar="[MAP]", help="a scenario or a raster of risk, as for plan, and files of zones"),
    ] = None,
    zones: Annotated[
        list[Path] | None,
        typer.Option(
            "--zones", "--no-fly", metavar="FILE", help="zones: ED-269, ED-318, KML, KMZ, GeoJSON; may be repeated"
        ),
    ] = None,
    risk: Annotated[Path | None, option("--risk FILE.tif", "risk on a raster: .tif, .asc, .npy")] = None,
    k: KOption = None,
    clearance: ClearanceOption = None,
    bounds: BoundsOption = None,
    tolerance: Annotated[float, option("--tolerance R", "wanted width of the bracket of the best cost")] = 0.01,
    through: Annotated[
        int, option("--through N", "legs, at most, whose bounds are proven for plans through its waypoints")
    ] = 16,
    no_certificate: Annotated[bool, option("--no-certificate", "leave out the lower bound and the gaps")] = False,
    proof: ProofFileOption = None,
) -> None:
    """
    Check any flight plan: which zones its legs cross, and how much better a plan could be.

    Prints length, risk, cost and clearance of each leg, its crossings with zones and their lengths, and a proven
    bracket of the least cost of a clean plan between the same ends; --proof writes its proof. With --speed, --power
    and --battery, says how long the flight takes, and whether the battery lasts. On a raster of people, prints the
    expected fatalities; with --max-density or --target, a plan above is not clean. With --volumes, flight geography,
    contingency volume and ground risk buffer are built around the plan. With --out, draws it (NAME-check.*). Exits
    with 1 unless the plan is clean, and its contingency volume too.
    """
    from cgla_graph.airspace.plan_check.check import check as check_plan
    from cgla_graph.comparisons.cli import check_report
    from cgla_graph.comparisons.cli import ground as on_ground
    from cgla_graph.comparisons.study.proofs import proof_of_check, read_proof

    laying = None
    if volume.are_asked_for:
        from cgla_graph.comparisons.cli.volumes import read_laying

        laying = read_laying(volume, zone_options)
    asked = None if no_certificate or tolerance == 0.0 else tolerance
    no_bound = {"--no-certificate (or --tolerance 0)": (asked is None, "without a bound, there is no proof to write")}
    proof = read_proof("--proof", proof, no_bound)
    kinds = output.pictures("png")
    settings, given, aircraft = zone_options.settings(), plan_options.settings(), _aircraft(times)
    settings.pop("terrain_altitude")
    over_ground = zone_options.ground is not None
    spec, zone_files = _maps_and_zones(plan_file, against or [], risk, zones or [], over_ground=over_ground)
    alone = {} if aircraft is None else {"altitude": None}
    of_map = {**vars(raster), **failing.settings(), **vars(ground)}
    _require_meaning(spec, zone_files, bounds, of_map, {**settings, **alone})
    changes = {"bounds": bounds, "raster": vars(raster), "aircraft": failing.settings()}
    on = None if spec is None else on_ground.priced(_opened(plan_file, spec, changes, given), ground)
    _check_proof(proof, plan_file, on, given)
    folder = output.folder()
    with console.running_solvers():
        checked = check_plan(
            plan_file,
            on,
            zones=zone_files,
            **settings,
            **given,
            k=on_ground.price_of_risk(k, ground),
            corridor=ground.corridor,
            max_density=ground.max_density,
            target=ground.target,
            clearance=clearance,
            tolerance=asked,
            through=through,
            aircraft=aircraft,
        )
    if zone_options.zones_list is not None:
        zone_options.report([checked.on], as_json=True)
    written = check_report.write_checked(folder, checked, kinds) if folder else []
    laid = None if laying is None else laying.around_plan(checked, zone_files)
    groups = [] if laid is None else laid.write(folder, kinds)
    in_file = None if proof is None else proof_of_check(proof, checked)
    files = [file for group in groups for file in group] + ([] if in_file is None else in_file.files)
    if output.as_json:
        more: dict[str, Any] = {} if laid is None else {"volumes": laid.document()}
        more |= {} if in_file is None else {"proof_file": in_file.document()}
        console.out_json({**checked.document(), **more, "files": [*map(str, (*written, *files))]})
    else:
        check_report.print_checked(checked, around_is_clean=laid is None or laid.report.is_clean)
        console.out_lines({} if laid is None else laid.lines())
        console.out_lines({} if in_file is None else in_file.lines())
        lists = [] if zone_options.zones_list is None else [zone_options.zones_list]
        console.out_files([*files, *written, *lists])
    is_missing = in_file is not None and in_file.found is None
    if is_missing or not checked.is_clean or not (laid is None or laid.report.is_clean):
        raise typer.Exit(console.MISSING)


def _check_proof(file: Path | None, plan_file: Path, on: "Scenario | None", given: Mapping[str, Any]) -> None:
    """Check that a proof file can hold the bracket of a plan, before it is proven."""
    if file is None:
        return
    from cgla_graph.airspace.flight_plans.formats import read_plan
    from cgla_graph.comparisons.study.proofs import check_provable
    from cgla_graph.model.risk import RiskField

    flown = read_plan(plan_file, **given).flown
    field = RiskField() if on is None else on.problem.field
    check_provable("--proof", file, field, flown[0].tolist(), flown[-1].tolist())


def _aircraft(times: FlightTimeOptions) -> "Aircraft | None":
    """Return the aircraft that options describe; None without any."""
    if times == FlightTimeOptions():
        return None
    from cgla_graph.comparisons.cli.flight_time import read_aircraft

    return read_aircraft(times)


def _maps_and_zones(
    plan_file: Path, against: Sequence[str], risk: Path | None, zones: Sequence[Path], *, over_ground: bool
) -> tuple[str | None, list[Path]]:
    """Return the map, if there is one, and the files of zones, which include all files of areas."""
    from cgla_graph.airspace.flight_plans.formats import read_plan
    from cgla_graph.comparisons.study.options import is_raster
    from cgla_graph.errors import CglaError
    from cgla_graph.scenarios.loading import AREAS, RASTERS, holds_areas

    of_areas = [spec for spec in against if spec.lower().endswith(AREAS) or holds_areas(Path(spec))]
    maps = [spec for spec in against if spec not in of_areas] + ([] if risk is None else [str(risk)])
    found = [*zones, *map(Path, of_areas)]
    if len(maps) > 1:
        msg = f"a plan is checked against one map, not {', '.join(maps)}; give one scenario or raster, and any zones"
        raise CglaError(msg)
    if risk is not None and not is_raster(str(risk)):
        msg = f"--risk {risk} is not a raster; rasters end in {', '.join(RASTERS)}"
        raise CglaError(msg)
    if not (maps or found or over_ground or read_plan(plan_file).fence):
        kinds = "--zones FILE, --risk FILE, --ground FILE, or a scenario"
        msg = f"{plan_file}: there is nothing to check it against; give {kinds}"
        raise CglaError(msg)
    return (maps[0] if maps else None), found


def _require_meaning(
    spec: str | None,
    zones: Sequence[Path],
    bounds: str | None,
    of_map: Mapping[str, object],
    settings: Mapping[str, object],
) -> None:
    """Refuse options of maps without a map, and of zones without zones."""
    from cgla_graph.errors import CglaError
    from cgla_graph.scenarios.area_tables import OF_TERRAIN

    if spec is None and (bounds is not None or any(value is not None for value in of_map.values())):
        msg = "--bounds and options of rasters and people need a map; give one (--risk FILE, or a scenario)"
        raise CglaError(msg)
    for name, value in settings.items():
        if value is not None and not zones and not (name in OF_TERRAIN and settings["ground"] is not None):
            needs = "a raster of elevations (--ground FILE)" if name == "terrain_clearance" else "zones (--zones FILE)"
            msg = f"--{name.replace('_', '-')} needs {needs}"
            raise CglaError(msg)


def _opened(plan_file: Path, spec: str, changes: Mapping[str, Any], given: Mapping[str, Any]) -> "Scenario":
    """Open a scenario, or a raster of risk between the ends of the plan."""
    from cgla_graph.airspace.flight_plans.formats import read_plan
    from cgla_graph.comparisons.study.options import MapOptions, is_raster, open_one
    from cgla_graph.errors import ScenarioError

    if not is_raster(spec):
        return open_one("check", spec, MapOptions(**changes))
    # without a weight, risk is shown but does not count as cost
    flown = read_plan(plan_file, **given).flown
    start, goal = (",".join(map(repr, flown[at].tolist())) for at in (0, -1))
    try:
        return open_one("check", spec, MapOptions(start, goal, k=0.0, **changes))
    except ScenarioError as error:
        msg = f"{plan_file}: {error}"
        raise ScenarioError(msg) from error
