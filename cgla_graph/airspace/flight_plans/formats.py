"""Reading and writing of plans in all supported formats."""

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final
from xml.etree.ElementTree import Element

from cgla_graph._files import write_files
from cgla_graph._text import place, shown
from cgla_graph._validate import file_path, instance
from cgla_graph.airspace.flight_plans import csv_file, geojson, gpx, kml, qgroundcontrol, waypoints
from cgla_graph.airspace.flight_plans.given import Given
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Waypoint, fault, few_read
from cgla_graph.airspace.flight_plans.tagged_waypoints import assemble_plan, place_of
from cgla_graph.errors import OutputError, PlanError
from cgla_graph.untrusted.files import FilePath, kind_of, read_bytes, text_of
from cgla_graph.untrusted.json_files import json_of
from cgla_graph.untrusted.json_maps import refuse_esri, require_wgs84
from cgla_graph.untrusted.kml_files import unzipped
from cgla_graph.untrusted.xml_files import tag_of, xml_of

#: Writers by the ending of the file: formats for autopilots, which can fail, and formats for viewers.
_AUTOPILOT: Final = {".plan": qgroundcontrol.write, ".waypoints": waypoints.write}
_VIEWER: Final = {".kml": kml.write, ".gpx": gpx.write, ".geojson": geojson.write, ".csv": csv_file.write}
#: The only ending of files that hold a fence.
_FENCED: Final = ".plan"
#: Endings of files that plans are written to.
WRITTEN: Final = (*_AUTOPILOT, *_VIEWER)
#: Keys of paths in JSON files, in degrees and in map units.
_PATHS: Final = ("path_lonlat", "path")
#: The formats that are read, for messages.
_READ: Final = "plans are QGroundControl's .plan, QGC WPL .waypoints, KML, KMZ, GPX, GeoJSON, or CSV with named columns"


def read_plan(
    path: FilePath,
    *,
    return_altitude: float | None = None,
    loiter_radius: float | None = None,
    home: tuple[float, ...] | None = None,
    acceptance_radius: float | None = None,
) -> FlightPlan:
    r"""
    Read a flight plan; the format is recognised by the content, not by the name.

    Parameters
    ----------
    path
        A QGroundControl plan (``.plan``), waypoints (``.waypoints``, QGC WPL 110), KML or KMZ, GPX, GeoJSON, CSV, or a
        JSON file with a path as `Solution.save` writes it.
    return_altitude, loiter_radius, home, acceptance_radius
        What the file of an autopilot leaves open (`cgla_graph.airspace.flight_plans.given.Given`): the height of the
        return to home, metres above home (None: 60 m, the default of PX4); the radius of circles without one, metres
        (0: it hovers); longitude and latitude of home, degrees; the distance at which waypoints without one are passed,
        metres (None: corners may be cut by the default of the autopilot).

    Returns
    -------
    plan
        The plan, with a remark for everything in the file that is not flown. `FlightPlan.unknown` says where the file
        leaves open where the aircraft flies.

    Raises
    ------
    FileFormatError
        If the file cannot be read, is too large, malformed or of another format, or contains a flight instruction that
        is not supported. (`PlanError` is one.)

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = Path(folder, "plan.csv")
    ...     _ = file.write_text("longitude,latitude\n24.9,60.2\n25.0,60.2\n")
    ...     read_plan(file).lonlat.tolist()
    [[24.9, 60.2], [25.0, 60.2]]
    """
    given = Given(return_altitude, loiter_radius, home, acceptance_radius)
    return plan_of_bytes(read_bytes(path), os.fspath(path), given)


def plan_of_bytes(data: bytes, where: str, given: Given | None = None) -> FlightPlan:
    r"""
    Return the plan of the bytes of a file, which errors call `where`; the errors are those of `read_plan`.

    Examples
    --------
    >>> plan_of_bytes(b"x,y\n0,0\n1,1\n", "path.csv").coordinates
    'plane'
    """
    kind = kind_of(data)
    if kind == "zip":
        return _of_xml(xml_of(unzipped(data, where), where), where)
    if kind == "xml":
        return _of_xml(xml_of(data, where), where)
    if kind == "json":
        document = json_of(data, where)
        if not isinstance(document, dict):
            fault(where, "it is no JSON object", _READ)
        return _of_json(document, where, given)
    text = text_of(data, where)
    if text.startswith(waypoints.SIGNATURE):
        return waypoints.read_text(text, where, given)
    return csv_file.read_text(text, where)


def _of_xml(root: Element, where: str) -> FlightPlan:
    kind = tag_of(root)
    if kind == "kml":
        return kml.read_tree(root, where)
    if kind == "gpx":
        return gpx.read_tree(root, where)
    msg = f"{where}: its root is <{kind[:60]}>; {_READ}"
    raise PlanError(msg)


def _of_json(document: Mapping[str, Any], where: str, given: Given | None) -> FlightPlan:
    refuse_esri(document, where)
    require_wgs84(document, where)
    if "fileType" in document or "mission" in document:
        return qgroundcontrol.read_document(document, where, given)
    if isinstance(document.get("type"), str):
        return geojson.read_document(document, where)
    for key in _PATHS:
        if key in document:
            return _of_path(document[key], f"{where}: {key}", in_plane=key == "path")
    msg = f"{where}: its keys are {shown(list(document))}; {_READ}"
    raise PlanError(msg)


def _of_path(rows: object, where: str, *, in_plane: bool) -> FlightPlan:
    """Return the plan of a path as ``Solution.save`` writes it to ``.json``, and ``cgla plan --json`` prints it."""
    if not isinstance(rows, list):
        fault(where, f"it is {shown(rows)}", "give a list of pairs of numbers")
    few_read(len(rows), where)
    for index, row in enumerate(rows):
        if not isinstance(row, list) or len(row) != 2 or any(isinstance(value, str) for value in row):  # noqa: PLR2004
            fault(f"{where}, {index}", f"it is {shown(row)}", "a waypoint is two numbers")
    found = (Waypoint(*place_of(row, f"{where}, {index}", in_plane=in_plane)) for index, row in enumerate(rows))
    return assemble_plan(found, "", (), where, coordinates="plane" if in_plane else "lonlat")


def text_of_plan(plan: FlightPlan, where: str) -> str:
    """
    Return the text of the file `where` that a plan is written to, in the format that its ending says.

    Raises
    ------
    PlanError
        If the format cannot hold the plan.
    OutputError
        If no format has this ending.

    Examples
    --------
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80)
    >>> text_of_plan(plan, "mine.waypoints").splitlines()[0]
    'QGC WPL 110'
    """
    kind = Path(where).suffix.lower()
    if kind != ".csv" and plan.coordinates != "lonlat":
        fault(where, "the plan has no longitudes and latitudes", "only .csv can hold one in a plane")
    if plan.unknown:
        wrong = f"the plan does not say everywhere where it flies ({plan.unknown[0]})"
        fault(where, wrong, "another file would not say so: only plans that are known are written")
    if plan.fence and kind != _FENCED:
        fault(where, f"the plan has a fence, which {kind} cannot hold", f"take {_FENCED}, or leave the fence out")
    if kind in _AUTOPILOT:
        return _AUTOPILOT[kind](plan, where)
    if kind in _VIEWER:
        return _VIEWER[kind](plan)
    msg = f"{place(where)}: plans are not written in this format; give a file that ends in {', '.join(WRITTEN)}"
    raise OutputError(msg)


def write_plan(plan: FlightPlan, path: FilePath) -> Path:
    """
    Write a flight plan; the file is replaced as a whole or not at all.

    Numbers are written in full, so that `read_plan` returns the same plan to the last bit, with two exceptions:
    ``.plan`` and ``.waypoints`` write 0 m for a home of unknown height, and ``.waypoints`` and ``.csv`` have no names.

    Parameters
    ----------
    plan
        The plan.
    path
        The file; its ending, ``.plan``, ``.waypoints``, ``.kml``, ``.gpx``, ``.geojson`` or ``.csv``, selects the
        format.

    Returns
    -------
    path
        The file.

    Raises
    ------
    PlanError
        If it is not known everywhere where the plan flies (`FlightPlan.unknown`), or the format cannot hold it: only
        ``.csv`` holds a plan in a plane, and autopilots need altitudes.
    OutputError
        If no format has this ending, or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> plan = FlightPlan.along([(24.0, 60.0), (24.1, 60.1)], altitude=80)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     read_plan(write_plan(plan, f"{folder}/mine.kml")) == plan
    True
    """
    target = file_path("path", path, OutputError)
    instance("plan", plan, FlightPlan, "a FlightPlan, as FlightPlan.along(solution.lonlat, altitude=80)", PlanError)
    text = text_of_plan(plan, str(target))
    write_files({target: text.encode("utf-8")})
    return target
