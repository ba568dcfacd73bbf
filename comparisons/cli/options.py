"""
Options of the command line in groups, and arguments that several commands share.

The first line of a group's docstring, up to a colon, is its heading in the help.
"""

import dataclasses
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, TypeAlias

import typer

from cgla_graph.comparisons.cli import completion

if TYPE_CHECKING:
    from cgla_graph.airspace.flight_plans.plan import Reference
    from cgla_graph.airspace.plan_check.plan_map import PlanMap
    from cgla_graph.comparisons.study.options import MapOptions as MapChanges
    from cgla_graph.scenarios.scenario import Scenario

#: Values of `--above`, and the references of heights of zones; altitudes above the ellipsoid are not exported.
ABOVE: "dict[Reference, str]" = {"home": "HOME", "ground": "AGL", "sea": "AMSL"}
#: Formats of pictures.
FORMATS = ("png", "svg", "pdf")


Number: TypeAlias = float | None
Text: TypeAlias = str | None


def option(name: str, text: str, *others: str, **more: Any) -> Any:  # noqa: ANN401 - typer's
    """Declare an option: its name with a placeholder of its value (``--k K``), its help, and its other names."""
    flag, _, metavar = name.partition(" ")
    return typer.Option(flag, *others, metavar=metavar or None, help=text, **more)


def reference_of(above: str | None, *, usual: "Reference") -> "Reference":
    """
    Return the reference that ``--above`` names, or the usual one.

    Raises
    ------
    CglaError
        If there is no such reference.

    Examples
    --------
    >>> reference_of("sea", usual="home"), reference_of(None, usual="home")
    ('sea', 'home')
    """
    found = usual if above is None else next((one for one in ABOVE if one == above), None)
    if found is None:
        from cgla_graph._text import shown
        from cgla_graph.errors import CglaError

        msg = f"--above is {shown(above)}; give one of {', '.join(ABOVE)}"
        raise CglaError(msg)
    return found


MissionsArg = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=completion.scenarios_and_missions,
        help="shipped name, mission, .toml, .geojson, zones (.json, .kml, .kmz), .tif, .asc, .map, or .scen "
        "(FILE.scen:FIRST-LAST)",
    ),
]
ScenarioArg = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=completion.scenarios,
        help="shipped name, .toml, .geojson or zones (.json, .kml, .kmz; or several), .tif, .asc, .npy, .map, or "
        "FILE.scen:ROW",
    ),
]
GraphsArg = Annotated[
    list[str] | None,
    typer.Argument(metavar="GRAPH", help=".graphml, .json (node-link), .csv, .mtx or .npz; or several"),
]
GraphArg = Annotated[str, typer.Argument(metavar="GRAPH", help=".graphml, .json (node-link), .csv, .mtx or .npz")]
StudyArg = Annotated[Path, typer.Argument(metavar="DIR", help="folder of a study that compare --out wrote")]
SolverOption = Annotated[
    str, option("--solver NAME", "name, with settings as NAME:A=1:B=2", autocompletion=completion.solvers)
]
SolversOption = Annotated[
    Text,
    option("--solvers A,B", "names, with settings as NAME:A=1:B=2 (default: all)", autocompletion=completion.solvers),
]
CorridorOption = Annotated[Number, option("--corridor W", "whole width of the corridor (default: 0), map units")]
AcceptanceOption = Annotated[
    Number,
    option(
        "--acceptance-radius M",
        "distance at which waypoints without one are passed, metres (default: corners may be cut at 10, PX4's "
        "NAV_ACC_RAD, or 2, ArduPilot's WPNAV_RADIUS; unknown of a fixed wing)",
    ),
]
DimensionOption = Annotated[
    Number, option("--dimension D", "characteristic dimension: greatest distance of two ends with rotors, metres")
]
ProofFileOption = Annotated[
    Path | None, option("--proof FILE", "write the proof of the bound, for cgla verify and other checkers")
]
RefineOption = Annotated[bool, option("--refine", "refine every path in the plane before it counts")]
ClearanceOption = Annotated[Number, option("--clearance C", "least distance from no-fly areas (map units, or metres)")]
BoundsOption = Annotated[
    Text, option("--bounds W,S,E,N", "bounds of paths, instead of the map's: least x, y, greatest x, y")
]
KOption = Annotated[Number, option("--k K", "risk weight, instead of the scenario's: length + k * risk")]
AltitudeOption = Annotated[
    Number, option("--altitude M", "altitude of exported plans, and at which zones count, metres (see --above)")
]
AboveOption = Annotated[
    Text,
    option(
        "--above WHAT",
        "reference of --altitude: home, ground or sea (default: home for exported plans, ground for zones)",
    ),
]
GroundOption = Annotated[
    Path | None,
    option("--ground FILE.tif", "elevations: closes terrain, and compares heights above ground and sea of zones"),
]
TerrainClearanceOption = Annotated[
    Number, option("--terrain-clearance M", "with --ground: least height above the ground, metres (default: 30)")
]
SpeedOption = Annotated[Number, option("--speed V", "speed of the flight, metres per second (default: none)")]
OutOption = Annotated[Path | None, option("--out DIR", "write files and pictures into DIR")]
FormatsOption = Annotated[Text, option("--formats A,B", "with --out: formats of pictures, some of png,svg,pdf")]
JsonOption = Annotated[bool, option("--json", "print one JSON document on standard output, nothing else")]
PortOption = Annotated[int, option("--port N", "port of the page (default: a free one)", min=0, max=65535)]
BrowserOption = Annotated[bool, typer.Option(help="open the page in the browser")]


@dataclass(frozen=True, repr=False, eq=False)
class MapOptions:
    """The map: its ends, bounds, weight and no-fly areas."""

    start: Annotated[Text, option("--start X,Y", "instead of the scenario's (lon,lat on such maps)")] = None
    goal: Annotated[Text, option("--goal X,Y", "instead of the scenario's (lon,lat on such maps)")] = None
    bounds: BoundsOption = None
    k: KOption = None
    clearance: ClearanceOption = None
    no_fly: Annotated[
        list[Path] | None,
        option(
            "--no-fly FILE",
            "more no-fly areas, on maps in lon/lat: GeoJSON, or zones (ED-269, ED-318, KML, KMZ); may be repeated",
        ),
    ] = None
    resolution: Annotated[int | None, option("--resolution N", "points per side of a closed lattice")] = None


@dataclass(frozen=True, repr=False, eq=False)
class ZoneOptions:
    """Altitude, zones and terrain."""

    altitude: AltitudeOption = None
    above: AboveOption = None
    at: Annotated[
        Text, option("--at TIME", "of zones: time of the flight, as 2026-08-01T12:00+02:00 (default: all)")
    ] = None
    treat: Annotated[
        list[str] | None,
        option(
            "--treat KIND=closed|open",
            "of zones: as REQ_AUTHORISATION=open (default: all closed except NO_RESTRICTION); may be repeated",
        ),
    ] = None
    ground: GroundOption = None
    terrain_clearance: TerrainClearanceOption = None
    lines: Annotated[
        Text,
        option("--lines closed|open", "of zones: closed to close the insides of closed lines (default: open)"),
    ] = None
    vertical_clearance: Annotated[
        Number,
        option("--vertical-clearance M", "of zones: metres by which floors and ceilings are widened (default: 0)"),
    ] = None
    zones_list: Annotated[
        Path | None,
        option("--zones-list FILE", "write the state of each zone and no-fly area, and its reason: .csv or .json"),
    ] = None

    def settings(self, *, exported: bool = False) -> dict[str, Any]:
        """
        Return the settings for `cgla_graph.scenarios.loading.open_scenarios`; None for those that are not given.

        Parameters
        ----------
        exported
            Whether the altitude is also that of an exported plan, which is above home unless `above` is given.

        Raises
        ------
        CglaError
            If one of them is malformed.

        Examples
        --------
        >>> ZoneOptions(450.0, "sea", treat=["CONDITIONAL=open"]).settings()["altitude"]
        '450 AMSL'
        """
        from cgla_graph._text import shown
        from cgla_graph.errors import CglaError

        above = ABOVE[reference_of(self.above, usual="ground")]
        if self.lines not in {None, "closed", "open"}:
            msg = f"--lines is {shown(self.lines)}; give closed, which closes the insides of closed lines, or open"
            raise CglaError(msg)
        treated = {}
        for text in self.treat or ():
            kind, equals, value = (part.strip() for part in text.partition("="))
            if not equals or value.lower() not in {"closed", "open"}:
                msg = f"--treat is {shown(text)}; give KIND=closed or KIND=open, as CONDITIONAL=open"
                raise CglaError(msg)
            treated[kind.upper()] = value.lower()
        height = None if self.altitude is None else f"{self.altitude:.12g}"
        return {
            "altitude": None if height is None else f"{height} {above}",
            "at": self.at,
            "treat": treated or None,
            "ground": None if self.ground is None else str(self.ground.absolute()),
            "lines": self.lines,
            "vertical_clearance": self.vertical_clearance,
            "terrain_clearance": self.terrain_clearance,
            "terrain_altitude": f"{height} HOME" if height and exported and self.above is None else None,
        }

    def may_count(self, spec: str, maps: MapOptions) -> bool:
        """Return whether a map may have zones, before it is opened."""
        from cgla_graph.scenarios.loading import RASTERS

        return bool(maps.no_fly or self.ground) or Path(spec).suffix.lower() not in {"", ".geojson", *RASTERS}

    def report(
        self, scenarios: "Sequence[Scenario | PlanMap]", *, as_json: bool, exported: bool = False
    ) -> dict[str, Any]:
        """
        Print the states of the zones of maps, if there are any, and write their list if it has a file.

        Parameters
        ----------
        scenarios
            The maps.
        as_json
            Whether to print nothing.
        exported
            Whether the altitude is also that of an exported plan.

        Returns
        -------
        document
            The states as JSON: under ``zones``, by the scenario's name; empty without zones. Under ``terrain``, which
        cells of elevations are closed.

        Raises
        ------
        CglaError
            If there are no zones to list, or the file cannot be written.
        """
        altitude = None if exported else self.altitude
        from cgla_graph.comparisons.tables.zone_list import print_terrain, print_zones

        # (the check of a plan has its own account of terrain, leg by leg)
        found = {one.name: area for one in scenarios if (area := getattr(one, "terrain", None)) is not None}
        terrain = print_terrain(found, as_json=as_json)
        altitude = None if terrain else altitude
        if self.zones_list is None and altitude is None and all(one.zones is None for one in scenarios):
            return terrain
        two = exported and self.above is None
        return {**print_zones(scenarios, self.zones_list, altitude=altitude, two=two, as_json=as_json), **terrain}


@dataclass(frozen=True, repr=False, eq=False)
class AltitudesOptions:
    """Several altitudes, of which the best is taken."""

    altitudes: Annotated[
        Text,
        option("--altitudes A,B", "instead of --altitude: plan at each, metres, and take the best (see --above)"),
    ] = None


@dataclass(frozen=True, repr=False, eq=False)
class PlanOptions:
    """What the file of a plan leaves open."""

    return_altitude: Annotated[
        Number,
        option(
            "--return-altitude M",
            "height to which it climbs before a return to home, metres above home (default: 60, PX4's RTL_RETURN_ALT)",
        ),
    ] = None
    loiter_radius: Annotated[
        Number,
        option(
            "--loiter-radius M", "radius of circles without one in the plan, metres; 0 if it hovers (default: unknown)"
        ),
    ] = None
    home: Annotated[
        Text,
        option("--home LON,LAT", "where it takes off, or LON,LAT,METRES above the sea (default: as the plan says)"),
    ] = None
    acceptance_radius: AcceptanceOption = None

    def settings(self) -> dict[str, Any]:
        """
        Return the settings for `cgla_graph.check`; None for those that are not given.

        Raises
        ------
        CglaError
            If one of them is malformed.

        Examples
        --------
        >>> PlanOptions(home="24.9,60.2").settings()["home"]
        (24.9, 60.2)
        """
        from cgla_graph._text import shown
        from cgla_graph.errors import CglaError

        home = None
        if self.home is not None:
            try:
                home = tuple(float(part) for part in self.home.split(","))
            except ValueError as error:
                msg = f"--home is {shown(self.home)}; give LON,LAT in degrees, or LON,LAT,METRES above the sea"
                raise CglaError(msg) from error
        return {
            "return_altitude": self.return_altitude,
            "loiter_radius": self.loiter_radius,
            "home": home,
            "acceptance_radius": self.acceptance_radius,
        }


@dataclass(frozen=True, repr=False, eq=False)
class RasterOptions:
    """Values of a raster."""

    kind: Annotated[Text, option("--kind KIND", "of a raster: density, or count (people of each cell)")] = None
    unit: Annotated[
        Text, option("--unit UNIT", "of densities: people/km2 or people/m2; or fatalities/m (default: not known)")
    ] = None
    scale: Annotated[Number, option("--scale S", "of a raster: factor of its risk; it does not change people")] = None
    nodata: Annotated[Number, option("--nodata V", "of a raster: value of cells without data")] = None
    interpolation: Annotated[Text, option("--interpolation HOW", "of a raster: bilinear or nearest")] = None
    origin: Annotated[Text, option("--origin WHERE", "of a .npy: row 0 is the upper one (default), or lower")] = None
    coordinates: Annotated[
        Text, option("--coordinates WHICH", "of a raster that names none: plane or lonlat (degrees)")
    ] = None


@dataclass(frozen=True, repr=False, eq=False)
class AircraftOptions:
    """Failures of the aircraft above people."""

    failures_per_hour: Annotated[
        Number, option("--failures-per-hour F", "crashes per flight hour: risk is in expected fatalities (no default)")
    ] = None
    lethal_area: Annotated[
        Number, option("--lethal-area A", "where it hits people, square metres (or --dimension)")
    ] = None
    dimension: DimensionOption = None
    fatality_rate: Annotated[
        Number, option("--fatality-rate P", "probability that a person who is hit dies (default: 1, the worst case)")
    ] = None
    speed: SpeedOption = None

    def settings(self) -> dict[str, float]:
        """
        Return what `cgla_graph.flown_over` takes; empty if there is no such aircraft.

        Examples
        --------
        >>> AircraftOptions(speed=20.0).settings(), AircraftOptions(1e-3, dimension=1.0, speed=20.0).settings()
        ({}, {'failures_per_hour': 0.001, 'dimension': 1.0, 'speed': 20.0})
        """
        given = {name: value for name, value in vars(self).items() if value is not None}
        if "fatality_rate" in given:
            given["fatality"] = given.pop("fatality_rate")
        return {} if set(given) <= {"speed", "dimension"} else given


@dataclass(frozen=True, repr=False, eq=False)
class GroundRiskOptions:
    """People below: prices, greatest density, target."""

    prevented_fatality: Annotated[
        Number, option("--prevented-fatality P", "value of preventing a fatality; with --metre-price")
    ] = None
    metre_price: Annotated[
        Number, option("--metre-price P", "price of a metre flown: k is the ratio of both prices")
    ] = None
    max_density: Annotated[
        Number,
        option("--max-density D", "no cell under the corridor is above it: people/km2, else the raster's own unit"),
    ] = None
    corridor: CorridorOption = None
    target: Annotated[
        Number, option("--target T", "expected fatalities per flight hour, at most, as 1e-6: is it met?")
    ] = None


@dataclass(frozen=True, repr=False, eq=False)
class ProofOptions:
    """The proven lower bound."""

    tolerance: Annotated[
        Number, option("--tolerance R", "wanted gap of the lower bound (default: 0.005; 0: no bound)")
    ] = None
    no_certificate: Annotated[bool, option("--no-certificate", "leave out the lower bound and the gaps")] = False


@dataclass(frozen=True, repr=False)
class BudgetOptions:
    """A budget instead of the risk weight."""

    max_risk: Annotated[Number, option("--max-risk R", "find the shortest path with at most that risk")] = None
    max_length: Annotated[Number, option("--max-length L", "find the least risk on a path at most that long")] = None
    max_energy: Annotated[
        Number, option("--max-energy WH", "find the least risk on a flight of at most that energy, watt-hours")
    ] = None


@dataclass(frozen=True, repr=False)
class UncertainOptions:
    """Uncertain risk: several scenarios of it."""

    risk_scenarios: Annotated[
        list[Path] | None,
        option("--scenarios FILE", "TOML file of [[scenarios]] of the risk, or a [sample] of it; may be repeated"),
    ] = None
    objective: Annotated[
        str, option("--objective NAME", "expected (default), cvar: the mean of the worst costs, or worst: the greatest")
    ] = "expected"
    alpha: Annotated[
        Text, option("--alpha A", "of cvar: the worst 1 - A of all cases count, from 0 to 1 (default: 0.9, or 90%)")
    ] = None
    exceeds: Annotated[Number, option("--exceeds C", "also tell the probability of a cost above C")] = None


@dataclass(frozen=True, repr=False)
class TourOptions:
    """Places to visit."""

    via: Annotated[
        list[str] | None, option("--via X,Y", "visit this place on the way (lon,lat on such maps); may be repeated")
    ] = None
    order: Annotated[
        Text, option("--order HOW", "of the places: given (default), or best, the cheapest order of at most 12")
    ] = None


@dataclass(frozen=True, repr=False, eq=False)
class FlyableOptions:
    """Flyable paths of lines and arcs."""

    turn_radius: Annotated[
        Number, option("--turn-radius R", "make the path flyable: lines and arcs, none tighter than R")
    ] = None
    start_heading: Annotated[
        Number, option("--start-heading DEG", "of a flyable path, degrees clockwise from north (y)")
    ] = None
    goal_heading: Annotated[Number, option("--goal-heading DEG", "the same at the goal")] = None
    arc_tolerance: Annotated[
        Number, option("--arc-tolerance D", "distance of exported waypoints from arcs, at most (default: R / 100)")
    ] = None


@dataclass(frozen=True, repr=False)
class FlightTimeOptions:
    """Time, energy and battery."""

    speed: SpeedOption = None
    wind: Annotated[
        Text, option("--wind EAST,NORTH", "velocity of the air, metres per second, for the time of flight")
    ] = None
    power: Annotated[Number, option("--power W", "power of the aircraft, watts, for the energy of flight")] = None
    battery: Annotated[
        Text, option("--battery WH", "energy of the battery, watt-hours (ampere-hours times volts): says if it lasts")
    ] = None
    reserve: Annotated[Text, option("--reserve P%", "part of the battery that is left at the end (default: 20%)")] = (
        None
    )
    climb_rate: Annotated[
        Number, option("--climb-rate V", "vertical speed of climbs, metres per second (default: climbs are left out)")
    ] = None
    descent_rate: Annotated[Number, option("--descent-rate V", "the same of descents")] = None


@dataclass(frozen=True, repr=False)
class ExportOptions:
    """Flight plans to write."""

    export: Annotated[
        list[Path] | None,
        option(
            "--export NAME.plan",
            "write the path to fly it: .plan, .waypoints, .kml, .gpx, .geojson, .csv; may be repeated",
        ),
    ] = None
    altitude: AltitudeOption = None
    above: AboveOption = None
    speed: SpeedOption = None
    vehicle: Annotated[
        Text,
        option(
            "--vehicle KIND",
            "of exported plans: multirotor, helicopter, fixed-wing or vtol (default: multirotor, and fixed-wing with "
            "--turn-radius): how it takes off and lands",
        ),
    ] = None
    autopilot: Annotated[
        Text, option("--autopilot NAME", "of exported plans: any, ardupilot or px4 (default: any)")
    ] = None
    terrain_tolerance: Annotated[
        Number,
        option(
            "--terrain-tolerance M",
            "of exported plans above ground, with --ground: greatest deviation of straight legs from the altitude "
            "(default: 10)",
        ),
    ] = None

    @property
    def reference(self) -> "Reference":
        """The reference of the altitude of exported plans."""
        return reference_of(self.above, usual="home")

    def terrain_altitude(self) -> str | None:
        """
        Return the altitude of the exported plan as that of a flight above terrain; None if none is given.

        Examples
        --------
        >>> ExportOptions(altitude=80.0).terrain_altitude()
        '80 HOME'
        """
        return None if self.altitude is None else f"{self.altitude:.12g} {ABOVE[self.reference]}"


@dataclass(frozen=True, repr=False)
class VolumeOptions:
    """Volumes around a flight: flight geography, contingency volume and ground risk buffer."""

    volumes: Annotated[
        list[Path] | None,
        option("--volumes NAME.kml", "write the volumes around the flight: .kml or .geojson; may be repeated"),
    ] = None
    dimension: DimensionOption = None
    max_speed: Annotated[
        Number, option("--max-speed V", "of volumes: greatest speed over ground, m/s (default: --speed)")
    ] = None
    pitch: Annotated[Number, option("--pitch DEG", "of volumes: greatest pitch of a multirotor, which stops")] = None
    roll: Annotated[Number, option("--roll DEG", "of volumes: greatest roll of a fixed wing, which turns back")] = None
    geography_width: Annotated[
        Number,
        option(
            "--geography-width W",
            "of volumes: whole width of the flight geography, metres (default: 3 dimensions, or 32 if that is more)",
        ),
    ] = None
    contingency_width: Annotated[
        Number, option("--contingency-width W", "of volumes: instead of --pitch or --roll, on each side, metres")
    ] = None
    contingency_height: Annotated[
        Number, option("--contingency-height H", "of volumes: the same, above the flight geography, metres")
    ] = None
    buffer: Annotated[
        Text,
        option("--buffer KIND", "of volumes: ground risk buffer 1:1 (default), ballistic, glide, parachute"),
    ] = None
    glide_ratio: Annotated[Number, option("--glide-ratio R", "of --buffer glide: metres ahead for each down")] = None
    parachute_time: Annotated[
        Number, option("--parachute-time S", "of --buffer parachute: seconds until it is open")
    ] = None
    parachute_rate: Annotated[Number, option("--parachute-rate V", "of --buffer parachute: m/s down")] = None
    max_wind: Annotated[
        Number, option("--max-wind V", "of --buffer parachute: greatest permitted wind, m/s, at least 3")
    ] = None
    gnss_error: Annotated[Number, option("--gnss-error M", "of volumes: of satellite positions (default: 3)")] = None
    position_error: Annotated[
        Number, option("--position-error M", "of volumes: of holding the position (default: 3)")
    ] = None
    map_error: Annotated[Number, option("--map-error M", "of volumes: of the map (default: 1)")] = None
    height_error: Annotated[
        Number, option("--height-error M", "of volumes: of the height (default: 4, by satellites; 1 if barometric)")
    ] = None
    reaction_time: Annotated[Number, option("--reaction-time S", "of volumes: seconds (default: 1)")] = None
    flight_height: Annotated[
        Number,
        option("--flight-height M", "of volumes: greatest height above ground (default: by altitude and --ground)"),
    ] = None
    people_without_data: Annotated[
        Number,
        option("--people-without-data D", "people/km2 beyond their raster, and instead of --nodata (default: unknown)"),
    ] = None
    controlled_ground: Annotated[
        bool, option("--controlled-ground", "all ground under the volumes is controlled: no uninvolved people")
    ] = False
    corridor_of_volumes: Annotated[
        bool, option("--corridor-of-volumes", "with --max-density: the corridor is as wide as the volumes")
    ] = False
    fence: Annotated[
        Text,
        option("--fence WHICH", "of exported .plan: stay in the geography (default, with volumes), contingency, none"),
    ] = None
    speed: SpeedOption = None
    acceptance_radius: AcceptanceOption = None

    @property
    def are_asked_for(self) -> bool:
        """Whether any option but those of other groups is given."""
        own = dataclasses.replace(self, speed=None, dimension=None, acceptance_radius=None)
        return own != VolumeOptions()


@dataclass(frozen=True, repr=False, eq=False)
class GraphOptions:
    """The file of the graph."""

    weight: Annotated[Text, option("--weight NAME", "column or attribute of weights (default: weight)")] = None
    directed: Annotated[bool, option("--directed", "of a .csv: its edges lead from source to target only")] = False


@dataclass(frozen=True, repr=False, eq=False)
class StudyOptions:
    """The study: its folder and its processes."""

    out: OutOption = None
    resume: Annotated[bool, option("--resume", "continue the study in --out; finished runs are kept")] = False
    overwrite: Annotated[bool, option("--overwrite", "replace the study in --out")] = False
    workers: Annotated[
        int | None, option("--workers N", "processes of runs (default: one per core; 0: this process)", min=0)
    ] = None
    dask: Annotated[Text, option("--dask SCHEDULER", "make the runs on a Dask cluster, as tcp://HOST:8786")] = None


@dataclass(frozen=True, repr=False, eq=False)
class ComparisonOptions:
    """The comparison: its solvers, seeds, limits and pictures."""

    solvers: SolversOption = None
    seeds: Annotated[int | None, option("--seeds N", "runs of each randomised solver (default: 3)", min=1)] = None
    budget: Annotated[
        Text, option("--budget seconds=S,…", "seconds, iterations or evaluations, for all solvers that accept it")
    ] = None
    limits: Annotated[
        Text, option("--limits seconds=S,memory=MB", "limits of a run (default: 600 seconds, 4096 megabytes)")
    ] = None
    pictures: Annotated[
        int | None, option("--pictures N", "draw the first N scenarios (default: 20; for a study file: 0)", min=0)
    ] = None
    highlight: Annotated[
        Text, option("--highlight A,B", "draw these in colour, besides the best and those of the paper")
    ] = None
    metrics: Annotated[
        list[str] | None,
        option("--metrics FILE.py", "numbers of paths of your own: functions marked by @metric; may be repeated"),
    ] = None
    strict: Annotated[bool, option("--strict", "exit with 1 if a run has no path")] = False

    def settings(self) -> dict[str, Any]:
        """Return them as `cgla_graph.comparisons.results.study_run.Settings` takes them."""
        given = {one.name: getattr(self, one.name) for one in dataclasses.fields(self) if one.name != "strict"}
        return {**given, "metrics": self.metrics or ()}


@dataclass(frozen=True, repr=False, eq=False)
class OutputOptions:
    """Output."""

    out: OutOption = None
    formats: FormatsOption = None
    as_json: JsonOption = False

    def folder(self) -> Path | None:
        """Make the folder, if one is given (errors as of `cgla_graph.comparisons.files.make_folder`)."""
        from cgla_graph.comparisons import files

        return None if self.out is None else files.make_folder(self.out)

    def pictures(self, *usual: str) -> list[str]:
        """
        Return the given formats of pictures, or the usual ones.

        Raises
        ------
        CglaError
            If a format is not one of `FORMATS`.

        Examples
        --------
        >>> OutputOptions(formats="svg, .PDF").pictures("png"), OutputOptions().pictures("png")
        (['svg', 'pdf'], ['png'])
        """
        from cgla_graph._text import shown
        from cgla_graph.errors import CglaError

        if self.formats is None:
            return list(usual)
        found = list(dict.fromkeys(part.strip().lower().removeprefix(".") for part in self.formats.split(",")))
        for part in found:
            if part not in FORMATS:
                msg = f"--formats has {shown(part)}; give some of {','.join(FORMATS)}"
                raise CglaError(msg)
        return found


@dataclass(frozen=True, repr=False, eq=False)
class PageOptions:
    """The page."""

    port: PortOption = 0
    browser: BrowserOption = True


def open_map(
    command: str,
    spec: Sequence[str],
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions | None = None,
    *,
    k: float | None = None,
    exported: bool = False,
) -> "Scenario":
    """
    Open the only map of a command; several files of areas or zones form one map.

    Parameters
    ----------
    command, spec
        Name of the command, and the map.
    maps, zones, raster, aircraft
        Changes to the map.
    k
        The risk weight; None for that of `maps`.
    exported
        Whether the path becomes a plan.

    Raises
    ------
    CglaError
        If the map or a change is not valid.
    """
    from cgla_graph.comparisons.study.options import open_one

    with naming_graphs(command, spec):
        changed = dataclasses.replace(maps, k=maps.k if k is None else k)
        return open_one(command, spec, map_changes(changed, zones, raster, aircraft, exported=exported))


def map_changes(
    maps: MapOptions,
    zones: ZoneOptions,
    raster: RasterOptions,
    aircraft: AircraftOptions | None = None,
    *,
    exported: bool = False,
) -> "MapChanges":
    """
    Gather the changes to a map, whose path becomes a plan if `exported`.

    Raises
    ------
    CglaError
        If one of them is malformed.
    """
    from cgla_graph.comparisons.study.options import MapOptions as MapChanges

    changes = {**vars(maps), "no_fly": maps.no_fly or ()}
    flown, of_zones = {} if aircraft is None else aircraft.settings(), zones.settings(exported=exported)
    return MapChanges(**changes, zones=of_zones, raster=dict(vars(raster)), aircraft=flown)


@contextmanager
def naming_graphs(command: str, specs: Sequence[str]) -> Iterator[None]:
    """
    Name the command for graphs in the error, if maps cannot be read because one of them is the file of a graph.

    Raises
    ------
    CglaError
        The error of the body, or an error that names the command.
    """
    from cgla_graph.errors import CglaError

    try:
        yield
    except CglaError as error:
        from cgla_graph.scenarios.graphs.graph_endings import is_graph_file
        from cgla_graph.scenarios.text_files import is_file

        for spec in specs:
            if is_file(Path(spec)) and is_graph_file(spec):
                how = f"cgla graph {command} {spec} --from A --to B{', or --pairs N' * (command == 'compare')}"
                msg = f"{spec} is a graph; plan between two of its nodes: {how}"
                raise CglaError(msg) from error
        raise
