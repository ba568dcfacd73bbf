"""Arguments and options that several commands of the command line share."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons.cli import completion

ScenarioArg = Annotated[
    list[str] | None,
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=completion.scenarios_and_missions,
        help="shipped name, mission, .toml, .geojson, zones (.json, .kml, .kmz), .tif, .asc, .map, .scen "
        "(FILE.scen:FIRST-LAST), or a graph, "
        "as of plan",
    ),
]
OneScenarioArg = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=completion.scenarios,
        help="shipped name, .toml, .geojson or zones (.json, .kml, .kmz; or several), .tif, .asc, .npy, .map, or "
        "FILE.scen:ROW",
    ),
]
OneScenarioOrGraphArg = Annotated[
    list[str],
    typer.Argument(
        metavar="SCENARIO",
        autocompletion=completion.scenarios,
        help="shipped name, .toml, .geojson or zones (.json, .kml, .kmz; or several), .tif, .asc, .npy, .map, or "
        "FILE.scen:ROW; or a graph: "
        ".graphml, .json, .csv, .mtx, .npz",
    ),
]
GraphArg = Annotated[str, typer.Argument(metavar="GRAPH", help=".graphml, .json (node-link), .csv, .mtx or .npz")]
FromOption = Annotated[str | None, typer.Option("--from", metavar="A", help="of a graph: the node to start at")]
ToOption = Annotated[str | None, typer.Option("--to", metavar="B", help="of a graph: the node to get to")]
WeightOption = Annotated[
    str | None,
    typer.Option("--weight", metavar="NAME", help="of a graph: what holds the weights of its edges (default: weight)"),
]
DirectedOption = Annotated[
    bool, typer.Option("--directed", help="of a graph in a .csv: its edges lead from source to target only")
]
StudyArg = Annotated[Path, typer.Argument(metavar="DIR", help="folder of a study, as compare --out makes it")]
OutOption = Annotated[Path | None, typer.Option("--out", metavar="DIR", help="write files and pictures into DIR")]
FormatsOption = Annotated[
    str | None,
    typer.Option("--formats", metavar="A,B", help="with --out: formats of pictures, some of png,svg,pdf"),
]
ProfileOption = Annotated[
    Path | None,
    typer.Option("--profile", metavar="FILE", help="write risk and cost along the path: .csv, or .png, .svg, .pdf"),
]
ExportOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--export",
        metavar="NAME.plan",
        help="write the path to fly it: .plan, .waypoints, .kml, .gpx, .geojson, .csv; may be repeated",
    ),
]
AltitudeOption = Annotated[
    float | None,
    typer.Option(
        "--altitude", metavar="M", help="of the flight, metres (see --above): of exported plans, and which zones count"
    ),
]
AboveOption = Annotated[
    str | None,
    typer.Option(
        "--above",
        metavar="WHAT",
        help="what --altitude is above: home, ground or sea (default: home in exported plans, ground of zones)",
    ),
]
SpeedOption = Annotated[
    float | None, typer.Option("--speed", metavar="V", help="of the flight, metres a second (default: left open)")
]
TurnOption = Annotated[
    float | None,
    typer.Option("--turn-radius", metavar="R", help="make the path flyable: lines and arcs, none tighter than R"),
]
StartHeadingOption = Annotated[
    float | None,
    typer.Option("--start-heading", metavar="DEG", help="of a flyable path, degrees clockwise from north (y)"),
]
GoalHeadingOption = Annotated[float | None, typer.Option("--goal-heading", metavar="DEG", help="the same at the goal")]
ArcToleranceOption = Annotated[
    float | None,
    typer.Option("--arc-tolerance", metavar="D", help="of arcs as exported waypoints (default: R / 100)"),
]
WindOption = Annotated[
    str | None,
    typer.Option(
        "--wind", metavar="EAST,NORTH", help="where the air moves to, metres a second, for the time of flight"
    ),
]
PowerOption = Annotated[
    float | None, typer.Option("--power", metavar="W", help="what the aircraft draws, watts, for the energy of flight")
]
ResumeOption = Annotated[
    bool, typer.Option("--resume", help="go on with the study in --out; nothing that is done is made again")
]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="replace the study that is in --out")]
WorkersOption = Annotated[
    int | None,
    typer.Option("--workers", metavar="N", min=0, help="processes that make runs (default: one a core; 0: this one)"),
]
DaskOption = Annotated[
    str | None, typer.Option("--dask", metavar="SCHEDULER", help="make the runs on a Dask cluster, as tcp://HOST:8786")
]
JsonOption = Annotated[bool, typer.Option("--json", help="print one JSON document on standard output, nothing else")]
StartOption = Annotated[
    str | None, typer.Option("--start", metavar="X,Y", help="instead of the scenario's (lon,lat on such maps)")
]
GoalOption = Annotated[
    str | None, typer.Option("--goal", metavar="X,Y", help="instead of the scenario's (lon,lat on such maps)")
]
BoundsOption = Annotated[
    str | None,
    typer.Option(
        "--bounds", metavar="W,S,E,N", help="no path leaves these, instead of the map's: least x, y, greatest x, y"
    ),
]
KOption = Annotated[
    float | None, typer.Option("--k", metavar="K", help="risk weight, instead of the scenario's: length + k * risk")
]
FatalityOption = Annotated[
    float | None,
    typer.Option("--prevented-fatality", metavar="P", help="what preventing a fatality is worth; with --metre-price"),
]
MetreOption = Annotated[
    float | None,
    typer.Option("--metre-price", metavar="P", help="price of a metre flown: k is the one price over the other"),
]
DensityOption = Annotated[
    float | None, typer.Option("--max-density", metavar="D", help="of rasters: no cell under the corridor is above it")
]
CorridorOption = Annotated[
    float | None, typer.Option("--corridor", metavar="W", help="whole width of the corridor (default: 0), map units")
]
ClearanceOption = Annotated[
    float | None,
    typer.Option("--clearance", metavar="C", help="stay at least so far from no-fly areas (map units, or metres)"),
]
NoFlyOption = Annotated[
    list[Path] | None,
    typer.Option(
        "--no-fly",
        metavar="FILE",
        help="more no-fly areas, on maps in lon/lat: GeoJSON, or zones (ED-269, ED-318, KML, KMZ); may be repeated",
    ),
]
AtOption = Annotated[
    str | None,
    typer.Option("--at", metavar="TIME", help="of zones: when the flight is, as 2026-08-01T12:00+02:00 (default: all)"),
]
TreatOption = Annotated[
    list[str] | None,
    typer.Option(
        "--treat",
        metavar="KIND=closed|open",
        help="of zones: as REQ_AUTHORISATION=open (default: all closed but NO_RESTRICTION); may be repeated",
    ),
]
GroundOption = Annotated[
    Path | None,
    typer.Option("--ground", metavar="FILE.tif", help="of zones: elevations, to compare heights above ground and sea"),
]
ZonesListOption = Annotated[
    Path | None,
    typer.Option("--zones-list", metavar="FILE", help="write what became of each zone, and why: .csv or .json"),
]
KindOption = Annotated[
    str | None,
    typer.Option("--kind", metavar="KIND", help="of a raster: density, or count (of each cell, as people)"),
]
ScaleOption = Annotated[
    float | None, typer.Option("--scale", metavar="S", help="of a raster: what its densities are multiplied by")
]
NodataOption = Annotated[
    float | None, typer.Option("--nodata", metavar="V", help="of a raster: what cells without data stand for")
]
InterpolationOption = Annotated[
    str | None, typer.Option("--interpolation", metavar="HOW", help="of a raster: bilinear or nearest")
]
OriginOption = Annotated[
    str | None, typer.Option("--origin", metavar="WHERE", help="of a .npy: row 0 is the upper one (default), or lower")
]
CoordinatesOption = Annotated[
    str | None,
    typer.Option("--coordinates", metavar="WHICH", help="of a .npy or .asc: plane (default), or lonlat for degrees"),
]
ResolutionOption = Annotated[
    int | None, typer.Option("--resolution", metavar="N", help="points a side of a closed lattice")
]
RefineOption = Annotated[bool, typer.Option("--refine", help="refine every path in the plane before it counts")]
ToleranceOption = Annotated[
    float | None,
    typer.Option("--tolerance", metavar="R", help="how tight the lower bound shall be (default: 0.005; 0: no bound)"),
]
NoCertificateOption = Annotated[
    bool, typer.Option("--no-certificate", help="leave out the lower bound, and so the gaps")
]
