"""The map that a plan is checked on: a scenario or a raster of risk, with or without zones, or zones alone."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import non_negative_number
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.lonlat_box import bounds_of, box_around
from cgla_graph.airspace.zones.applying import Applied, Verdict
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.airspace.zones.reading import read_zones
from cgla_graph.airspace.zones.shapes import AreaShape, joined, part_near
from cgla_graph.airspace.zones.zone import NoArea
from cgla_graph.comparisons.cli.check_heights import Limits, PlanHeights
from cgla_graph.comparisons.study.options import MapOptions, is_raster, open_one
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.earth import LocalProjection, geodesic_length, project_area
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.loading import AREAS, RASTERS, holds_areas
from cgla_graph.scenarios.scenario import Scenario

#: A map that is laid around a plan holds every path at most so many times as long as the plan, and as the way between
#: its ends; the latter is less, as most plans are near to that.
LONGER, FARTHER = 1.3, 4.0
#: Where areas leave no way inside of it, it is made so many times as wide; zones are known as far.
WIDER = (1.0, 4.0, 16.0)
#: Room around everything: part of the longer side, and metres.
_MARGIN, _LEAST_ROOM = 0.02, 50.0
#: A plan that is so much longer than the way between its ends is no way from the one to the other.
_ROUND = 2.0
#: Metres of a degree of latitude, at least; and a latitude from which on all meridians may be near.
_DEGREE, _NEAR_POLE = 110_500.0, 85.0


@dataclass(frozen=True, eq=False)
class CheckMap:
    """
    A plan on a map.

    Attributes
    ----------
    scenario
        The map, with its risk, weight, bounds and clearance; its problem has no no-fly area, and begins and ends
        anywhere.
    areas
        What no leg may cross, map units.
    route
        What is flown, map units, shape ``(m, 2)``: places in a row that are the same count once.
    stops
        What each place of it is: 0 for home, else the number of the waypoint, from 1.
    has_bounds
        Whether the bounds are the map's: no leg may leave them. Else they are laid around the plan.
    at_all_heights
        Whether there are zones, and all of them count, whatever their floors and ceilings.
    heights
        The plan's own altitudes against floors and ceilings; None where these are not compared.
    """

    scenario: Scenario
    areas: tuple[ClosedArea, ...]
    route: FloatArray
    stops: tuple[int, ...]
    has_bounds: bool
    at_all_heights: bool = False
    heights: PlanHeights | None = None

    @cached_property
    def walls(self) -> tuple[ClosedArea, ...]:
        """The areas that no clean plan comes through at the heights of this one."""
        heights = self.heights
        return tuple(one for number, one in enumerate(self.areas) if heights is None or heights.holds_all(number))


@dataclass(frozen=True)
class MapRequest:
    """
    What a plan is checked against.

    Attributes
    ----------
    spec
        A scenario or a raster of risk; None for neither.
    zones
        Files of zones.
    settings
        What is said of zones, as `cgla_graph.comparisons.cli.options.ZoneOptions.settings` gives it.
    k, clearance, bounds
        Instead of the map's own; None for these.
    raster
        As of `cgla_graph.comparisons.study.options.MapOptions`.
    """

    spec: str | None = None
    zones: Sequence[Path] = ()
    settings: Mapping[str, Any] = dataclasses.field(default_factory=dict)
    k: float | None = None
    clearance: float | None = None
    bounds: str | None = None
    raster: Mapping[str, Any] = dataclasses.field(default_factory=dict)


def request_of(
    against: Sequence[str],
    zones: Sequence[Path],
    risk: Path | None,
    *,
    k: float | None,
    clearance: float | None,
    bounds: str | None,
    settings: Mapping[str, Any],
    raster: Mapping[str, Any],
) -> MapRequest:
    """
    Read what a plan is checked against: files of areas among the arguments are zones.

    Raises
    ------
    CglaError
        If there are two maps, or a number is out of range.

    Examples
    --------
    >>> more = {"k": None, "clearance": None, "bounds": None, "settings": {}, "raster": {}}
    >>> request_of(["paper", "areas.geojson"], [], None, **more).zones[0].name
    'areas.geojson'
    """
    of_areas = [spec for spec in against if spec.lower().endswith(AREAS) or holds_areas(Path(spec))]
    maps = [spec for spec in against if spec not in of_areas] + ([] if risk is None else [str(risk)])
    if len(maps) > 1:
        msg = f"a plan is checked against one map, not {', '.join(maps)}; give one scenario or raster, and any zones"
        raise CglaError(msg)
    if risk is not None and not is_raster(str(risk)):
        msg = f"--risk {risk} is no raster; those end in {', '.join(RASTERS)}"
        raise CglaError(msg)
    if not maps:
        k = None if k is None else non_negative_number("--k", k)
        clearance = None if clearance is None else non_negative_number("--clearance", clearance)
    return MapRequest(maps[0] if maps else None, [*zones, *map(Path, of_areas)], settings, k, clearance, bounds, raster)


def open_check_map(plan: FlightPlan, name: str, request: MapRequest) -> CheckMap:
    """
    Put a plan on the map that it is checked against.

    Parameters
    ----------
    plan
        The plan.
    name
        Of its file.
    request
        What it is checked against.

    Raises
    ------
    CglaError
        If anything is wrong with the map, or the plan and the map are not in the same coordinates.
    """
    if request.spec is None and not request.zones:
        msg = f"{name}: there is nothing to check it against; give --zones FILE, --risk FILE, or a scenario"
        raise CglaError(msg)
    stops, flown = _stops(plan)
    applied, ground = _applied(request)
    if request.spec is None:
        if request.bounds is not None or any(value is not None for value in request.raster.values()):
            msg = "--bounds and what is said of rasters are about a map; give one (--risk FILE, or a scenario)"
            raise CglaError(msg)
        if plan.coordinates != "lonlat":
            msg = f"{name}: it has x and y alone, and zones are in degrees; give the scenario that it is of"
            raise CglaError(msg)
        scenario = _around(plan, flown, name, request)
    else:
        scenario = _opened(flown, name, request)
    projection = scenario.projection
    route = _on_plane(plan, flown, name, scenario)
    areas = list(_own_areas(scenario))
    limits: list[Limits | None] = [None] * len(areas)
    is_own = request.settings.get("altitude") is None and any(one.altitude is not None for one in plan.waypoints)
    heights = None
    if applied is not None:
        if projection is None:
            msg = f"{request.zones[0]} is in longitude and latitude, and the map {scenario.name} is in the plane"
            raise ScenarioError(msg)
        bounds = scenario.problem.bounds
        seen = bounds if request.spec is not None else widened(bounds, WIDER[-1])
        box = _degrees_around(projection, seen, scenario.problem.clearance)
        near = applied.within(box)
        for verdict in near.verdicts:
            for area, between in _layers(verdict, box, apart=is_own):
                areas.append(ClosedArea(_label(verdict.zone), project_area(area, projection)))
                limits.append(between)
        scenario = dataclasses.replace(scenario, zones=near.account())
        heights = _heights(plan, stops, areas, limits, ground, route, projection)
    bare = dataclasses.replace(scenario.problem, no_fly=None, projection=projection)
    named = [(one.name, one.shape) for one in areas]
    scenario = dataclasses.replace(scenario, problem=bare, areas=named)
    everywhere = applied is not None and request.settings.get("altitude") is None
    return CheckMap(scenario, tuple(areas), route, stops, request.spec is not None, everywhere, heights)


def _on_plane(plan: FlightPlan, flown: FloatArray, name: str, scenario: Scenario) -> FloatArray:
    """Return what is flown in the coordinates of the map."""
    if (scenario.projection is None) is (plan.coordinates == "lonlat"):
        one, other = "in degrees", "in x and y of a plane"
        here, there = (other, one) if scenario.projection is None else (one, other)
        msg = f"{name}: the plan is {there}, and the map {scenario.name} is {here}; give one of the same coordinates"
        raise ScenarioError(msg)
    try:
        return flown if scenario.projection is None else scenario.projection.forward(flown)
    except ProblemError as error:
        msg = f"{name}: {error}"
        raise ScenarioError(msg) from error


def _heights(
    plan: FlightPlan,
    stops: Sequence[int],
    areas: Sequence[ClosedArea],
    limits: Sequence[Limits | None],
    ground: Ground | None,
    route: FloatArray,
    projection: LocalProjection,
) -> PlanHeights | None:
    """Return the plan's heights against those of areas, if any of these have some."""
    if not any(one is not None and one.bounded for one in limits):
        return None
    boxes = np.array([one.shape.bounds for one in areas])
    return PlanHeights(plan, stops, limits, ground, route, boxes, projection)


def _layers(verdict: Verdict, box: Bounds, *, apart: bool) -> list[tuple[AreaShape, Limits | None]]:
    """Return what is closed of a zone near a map; if floors and ceilings matter, apart by these."""
    if verdict.area is None or isinstance(verdict.zone, NoArea):
        return []
    if not apart:
        return [(verdict.area, None)]
    groups: dict[Limits, list[AreaShape]] = {}
    for layer in verdict.zone.layers:
        groups.setdefault(Limits(layer.lower, layer.upper), []).append(layer.area)
    if len(groups) == 1:
        return [(verdict.area, next(iter(groups)))]
    parts = [(part_near(joined(shapes), box), limits) for limits, shapes in groups.items()]
    return [(area, limits) for area, limits in parts if area is not None]


def _stops(plan: FlightPlan) -> tuple[tuple[int, ...], FloatArray]:
    """Return the places that are flown to, each once in a row, and what they are."""
    flown = plan.flown
    first = 1 if len(flown) == len(plan.waypoints) else 0
    moved = np.concatenate([[True], (flown[1:] != flown[:-1]).any(axis=1)])
    return tuple((np.nonzero(moved)[0] + first).tolist()), flown[moved]


def _applied(request: MapRequest) -> tuple[Applied | None, Ground | None]:
    """Say which zones are closed, and how high the ground is."""
    said = {key: value for key, value in request.settings.items() if value is not None}
    if not request.zones:
        if said:
            msg = f"--{next(iter(said))} is about zones; give their files (--zones FILE)"
            raise CglaError(msg)
        return None, None
    path = said.pop("ground", None)
    ground = None if path is None else read_ground(path)
    return read_zones(list(request.zones)).apply(**said, ground=ground), ground


def _label(zone: object) -> str:
    return str(getattr(zone, "label", "a zone"))


def _opened(flown: FloatArray, name: str, request: MapRequest) -> Scenario:
    """Open the scenario, or the raster of risk with the plan's own ends."""
    spec = request.spec or ""
    ends: dict[str, Any] = {}
    k = request.k
    if is_raster(spec):
        # risk that nobody has weighed is told, and is no part of the cost
        k = 0.0 if k is None else k
        ends = {end: ",".join(map(repr, flown[at].tolist())) for end, at in (("start", 0), ("goal", -1))}
    try:
        changes = MapOptions(k=k, clearance=request.clearance, bounds=request.bounds, raster=request.raster, **ends)
        return open_one("check", spec, changes)
    except ScenarioError as error:
        if not ends:
            raise
        msg = f"{name}: {error}"
        raise ScenarioError(msg) from error


def _own_areas(scenario: Scenario) -> list[ClosedArea]:
    """Return the no-fly areas of a scenario, with their names where they have some."""
    no_fly = scenario.problem.no_fly
    parts = [] if no_fly is None else list(getattr(no_fly, "geoms", [no_fly]))
    names = {shape.wkb: name for name, shape in scenario.areas}
    return [ClosedArea(names.get(part.wkb, f"no-fly area {number}"), part) for number, part in enumerate(parts)]


def _around(plan: FlightPlan, flown: FloatArray, name: str, request: MapRequest) -> Scenario:
    """Lay a map around a plan, so wide that better plans do not leave it."""
    middle = LocalProjection.centred_on(bounds_of(box_around(flown)))
    length = float(np.hypot(*np.diff(middle.forward(flown), axis=0).T).sum())
    start, goal = ((float(x), float(y)) for x, y in (flown[0], flown[-1]))
    is_round = length > _ROUND * geodesic_length(start, goal)
    projection = middle if is_round else LocalProjection.between(start, goal)
    route = projection.forward(flown)
    first, last = (float(route[0, 0]), float(route[0, 1])), (float(route[-1, 0]), float(route[-1, 1]))
    bounds = wide_bounds(route, length)
    problem = Problem(
        first, last, k=request.k or 0.0, bounds=bounds, clearance=request.clearance or 0.0, projection=projection
    )
    stem = Path(name).stem
    title = plan.name if plan.name != stem else ""
    return Scenario(stem, title, problem, Lattice(20, bounds=bounds))


def wide_bounds(route: FloatArray, length: float) -> Bounds:
    """
    Return a box around a route, and around every path between its ends that is not much longer.

    Paths of a length ``a`` between two points stay in an ellipse around these, whose longer axis is ``a``.

    Parameters
    ----------
    route
        Map units, shape ``(m, 2)``.
    length
        Its length.

    Examples
    --------
    >>> tuple(round(side, 1) for side in wide_bounds(np.array([(0.0, 0.0), (1000.0, 0.0)]), 1000.0))
    (-200.0, -465.3, 1200.0, 465.3)
    """
    (x, y), (east, north) = route[0].tolist(), route[-1].tolist()
    apart = math.hypot(east - x, north - y)
    axis = max(min(LONGER * length, FARTHER * apart), 1.05 * apart)
    other = math.sqrt(max(axis * axis - apart * apart, 0.0))
    cos, sin = ((east - x) / apart, (north - y) / apart) if apart > 0.0 else (1.0, 0.0)
    half = np.array([0.5 * math.hypot(axis * cos, other * sin), 0.5 * math.hypot(axis * sin, other * cos)])
    middle = 0.5 * (route[0] + route[-1])
    low = np.minimum(route.min(axis=0), middle - half)
    high = np.maximum(route.max(axis=0), middle + half)
    room = max(_MARGIN * float((high - low).max()), _LEAST_ROOM)
    return (float(low[0] - room), float(low[1] - room), float(high[0] + room), float(high[1] + room))


def widened(bounds: Bounds, factor: float) -> Bounds:
    """
    Return a box that is so many times as wide, around the same middle.

    Examples
    --------
    >>> widened((0.0, 0.0, 2.0, 4.0), 2.0)
    (-1.0, -2.0, 3.0, 6.0)
    """
    x_min, y_min, x_max, y_max = bounds
    more_x, more_y = 0.5 * (factor - 1.0) * (x_max - x_min), 0.5 * (factor - 1.0) * (y_max - y_min)
    return x_min - more_x, y_min - more_y, x_max + more_x, y_max + more_y


def least_outside(start: FloatArray, goal: FloatArray, bounds: Bounds) -> float:
    """
    Return the length of the shortest path between two points inside of bounds that leaves these, map units.

    Examples
    --------
    >>> least_outside(np.array([0.0, 0.0]), np.array([3.0, 0.0]), (-1.0, -2.0, 9.0, 9.0))
    5.0
    """
    x_min, y_min, x_max, y_max = bounds
    mirrored = [
        (2.0 * x_min - goal[0], goal[1]),
        (2.0 * x_max - goal[0], goal[1]),
        (goal[0], 2.0 * y_min - goal[1]),
        (goal[0], 2.0 * y_max - goal[1]),
    ]
    return min(math.hypot(x - start[0], y - start[1]) for x, y in mirrored)


def _degrees_around(projection: LocalProjection, bounds: Bounds, margin: float) -> Bounds:
    """Return a box in degrees around all that is within bounds on the plane."""
    x_min, y_min, x_max, y_max = bounds
    reach = math.hypot(max(-x_min, x_max), max(-y_min, y_max)) * (1.0 + _MARGIN) + margin
    high = reach / _DEGREE
    south, north = projection.latitude - high, projection.latitude + high
    if max(-south, north) >= _NEAR_POLE:
        return projection.longitude - 180.0, -90.0, projection.longitude + 180.0, 90.0
    wide = min(180.0, high / math.cos(math.radians(max(-south, north))))
    return projection.longitude - wide, south, projection.longitude + wide, north
