"""Files of flights: the log as JSON Lines, traces as CSV, flown paths as GeoJSON, and all in one JSON document."""

import dataclasses
import json
from collections.abc import Iterator, Mapping
from typing import Any

import shapely

from cgla_graph._text import plain_json
from cgla_graph.comparisons.files import csv_text
from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
from cgla_graph.errors import OutputError
from cgla_graph.mission.records import Flight, UavFlight
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.earth import degrees_of
from cgla_graph.scenarios.geojson import line_feature_collection
from cgla_graph.timed.timed_area import TimedArea

#: The columns of traces; on lon/lat maps, longitude and latitude follow.
TRACE_COLUMNS = ("uav", "tick", "x", "y", "risk", "known_threats", "known_areas")
#: Fields of each UAV in the first line of a log.
_UAV_KEYS = ("name", "start", "goal", "detection_radius", "safe_distance", "k", "departs")


def _plain(document: Mapping[str, Any]) -> dict[str, Any]:
    found: dict[str, Any] = plain_json(document)
    return found


def header_document(spec: MissionSpec) -> dict[str, Any]:
    """Return the first line of a log: the mission, its rules, its UAVs and the truth."""
    mission = spec.mission
    uavs = [{**{key: getattr(uav, key) for key in _UAV_KEYS}, "step": mission.step_of(uav)} for uav in mission.uavs]
    header = {
        "type": "mission",
        "mission": spec.name,
        "variant": spec.variant,
        "title": spec.title,
        "solver": spec.solver,
        "bounds": mission.world.bounds,
        "settings": mission.document(),
        "uavs": uavs,
        **_world_document(mission.world),
    }
    return _plain(header)


def _world_document(world: World) -> dict[str, Any]:
    """Return threats and timed areas, numbered as in events, and the number of charted areas."""
    threats = [{"number": n, **dataclasses.asdict(threat)} for n, threat in enumerate(world.field.threats)]
    areas = []
    for number, item in enumerate(world.timed):
        life = {"appears": item.appears, "vanishes": item.vanishes}
        if isinstance(item, TimedThreat):
            numbered = {"number": len(world.field) + number, **dataclasses.asdict(item.threat)}
            threats.append({**numbered, **life, "moves": item.moves})
        elif isinstance(item, TimedArea):
            areas.append({"number": number, **life, "geometry": shapely.geometry.mapping(item.polygon)})
    # without values: those of a raster would drown the log
    rasters = [
        {
            "number": number,
            "rows": raster.shape[0],
            "columns": raster.shape[1],
            **{key: getattr(raster, key) for key in ("bounds", "interpolation", "greatest")},
            **({} if raster.unit is None else {"unit": raster.unit}),
            **({} if raster.failures is None else {"failures": dataclasses.asdict(raster.failures)}),
        }
        for number, raster in enumerate(world.field.rasters)
    ]
    charted = 0 if world.no_fly is None else len(shapely.get_parts(world.no_fly))
    found: dict[str, Any] = {"threats": threats, "areas": areas, "charted_areas": charted}
    return {**found, "rasters": rasters} if rasters else found


def log_lines(spec: MissionSpec, flight: Flight, first: int = 0, end: int | None = None) -> Iterator[dict[str, Any]]:
    """
    Yield the lines of a log, tick by tick: what happened, then where each UAV in the air is.

    Parameters
    ----------
    spec
        The mission.
    flight
        The flight, or its part so far.
    first, end
        The first tick, and the one after the last; None: to the end.

    Yields
    ------
    line
        ``{"type": "event", …}``, or ``{"type": "uav", …}`` with position, the true risk there, the numbers of what it
        knows, and its plan if it is new.
    """
    end = flight.ticks + 1 if end is None else end
    happened: dict[int, list[dict[str, Any]]] = {}
    for event in flight.events:
        happened.setdefault(event.tick, []).append(event.document())
    for tick in range(first, end):
        yield from ({"type": "event", **plain_json(event)} for event in happened.get(tick, ()))
        for uav in flight.uavs.values():
            if tick in _ticks_in_air(uav):
                yield _uav_line(spec, uav, tick)


def _ticks_in_air(uav: UavFlight) -> range:
    return range(uav.departed, uav.departed + len(uav.trace) if uav.took_off else uav.departed)


def _uav_line(spec: MissionSpec, uav: UavFlight, tick: int) -> dict[str, Any]:
    spot, knowledge = uav.trace[tick - uav.departed], uav.knowledge_at(tick)
    line = {"type": "uav", "tick": tick, "uav": uav.name, "x": spot[0], "y": spot[1]}
    if spec.projection is not None:
        line["longitude"], line["latitude"] = spec.projection.inverse(spot).tolist()
    line["risk"] = spec.mission.world.field_at(tick).density(spot)
    line["threats"], line["areas"] = list(knowledge.threats), list(knowledge.areas)
    plans = [waypoints for since, waypoints in uav.plans if since == tick]
    if plans:
        line["plan"] = plans[-1]
    return _plain(line)


def whole_log(flown: MissionRun) -> Iterator[dict[str, Any]]:
    """
    Yield all lines of a log: the header, every tick, and the summary.

    Nothing in it depends on how fast the machine is: the same mission gives the same lines.
    """
    yield header_document(flown)
    yield from log_lines(flown, flown.flight)
    summary = summary_document(flown)
    for uav in summary["uavs"]:
        del uav["planning_seconds"]
    del summary["seconds"]
    yield {"type": "summary", **summary}


def trace_csv(flown: MissionRun) -> str:
    """Write where each UAV was at each tick as CSV."""
    columns = TRACE_COLUMNS if flown.projection is None else (*TRACE_COLUMNS, "longitude", "latitude")
    lines = [_uav_line(flown, uav, tick) for uav in flown.flight.uavs.values() for tick in _ticks_in_air(uav)]
    counts = [{"known_threats": len(line["threats"]), "known_areas": len(line["areas"])} for line in lines]
    rows = [{column: (line | count)[column] for column in columns} for line, count in zip(lines, counts, strict=True)]
    return csv_text(rows, columns)


def flight_geojson(flown: MissionRun) -> str:
    """
    Write the flown paths of a mission on a lon/lat map as GeoJSON, a feature a UAV.

    Raises
    ------
    OutputError
        If the map has no longitudes and latitudes.
    """
    if flown.projection is None:
        msg = f"{flown.name} has no longitudes and latitudes; only its CSV can be written"
        raise OutputError(msg)
    features: list[Any] = []
    for uav in flown.flight.uavs.values():
        names = {"mission": flown.name, "variant": flown.variant, "uav": uav.name, "status": uav.status.label}
        properties = names | {key: getattr(uav, key) for key in ("length", "risk", "cost")}
        collection: dict[str, Any] = line_feature_collection(degrees_of(uav.path, flown.projection), properties)
        features += collection["features"]
    document = {"type": "FeatureCollection", "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False, indent=1) + "\n"


def summary_document(flown: MissionRun) -> dict[str, Any]:
    """Return what a flight came to, as JSON: that of `Flight.summary`, and what the mission is called."""
    return _named(flown, flown.flight.summary())


def flight_document(flown: MissionRun) -> dict[str, Any]:
    """Return everything about a flight, as JSON: `Flight.document`, and what the mission is called."""
    document = _named(flown, flown.flight.document())
    if flown.projection is not None:
        for uav in document["uavs"]:
            uav["path_lonlat"] = flown.projection.inverse(uav["path"]).tolist()
    return document


def _named(flown: MissionRun, document: dict[str, Any]) -> dict[str, Any]:
    """Add names, the seconds and, where they were measured, the value of knowledge and of sharing."""
    worth = {"price_of_ignorance": flown.ignorance, "value_of_sharing": flown.sharing, "lower_bound": flown.bounds}
    for uav in document["uavs"]:
        uav.update(_plain({name: ratios[uav["name"]] for name, ratios in worth.items() if ratios is not None}))
    names = {"mission": flown.name, "variant": flown.variant, "title": flown.title, "solver": flown.solver}
    gap = {} if flown.bounds is None else _plain({"gap": flown.flight.gap})
    return {**names, **document, **gap, "seconds": flown.seconds}
