"""The map on which a plan is checked: a given map with or without zones, or a map around the plan with zones only."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.plan import FlightPlan
from cgla_graph.airspace.plan_check.one_altitude import at_one_altitude, column_of
from cgla_graph.airspace.plan_check.own_fence import fence_area
from cgla_graph.airspace.plan_check.plan_heights import PlanHeights
from cgla_graph.airspace.zones.account import ZoneAccount
from cgla_graph.airspace.zones.applying import Applied, Verdict
from cgla_graph.airspace.zones.columns import Columns
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import Altitude
from cgla_graph.airspace.zones.shapes import AreaShape, joined, part_near
from cgla_graph.airspace.zones.zone import Limits, NoArea
from cgla_graph.errors import ProblemError, ScenarioError
from cgla_graph.model.clearance import ROUNDING, joined_with, stretches
from cgla_graph.model.earth import LocalProjection, box_around, geodesic_length, project_area, wrapped
from cgla_graph.model.problem import Problem

#: A map around a plan contains every path between its ends that is at most so many times as long as the plan, or as
#: the distance of the ends if that is less.
LONGER, FARTHER = 1.3, 4.0
#: Factors by which this map is widened until the bound holds for all paths; zones are read as far.
WIDER = (1.0, 4.0, 16.0)
#: Crossings that a shift by this would undo do not count, metres, because autopilots round places to 1e-7 degrees.
ROUNDED = 0.01
#: Margin of a map around a plan: part of the longer side, and at least so many metres.
_MARGIN, _LEAST_ROOM = 0.02, 50.0
#: A plan is a round trip if it is so many times as long as the distance of its ends.
_ROUND = 2.0


class NamedMap(Protocol):
    """A map with names, such as a `cgla_graph.Scenario`: its problem, and areas that have a name."""

    @property
    def name(self) -> str:
        """A short name."""

    @property
    def title(self) -> str:
        """A title of one line."""

    @property
    def problem(self) -> Problem:
        """Risk, weight, bounds, no-fly areas and clearance."""

    @property
    def areas(self) -> Sequence[tuple[str, BaseGeometry]]:
        """Names and shapes of the named no-fly areas, map units."""


@dataclass(frozen=True)
class PlainMap:
    """
    A problem with a name.

    Attributes
    ----------
    name, title, problem, areas
        As in `NamedMap`.
    """

    name: str
    title: str
    problem: Problem
    areas: Sequence[tuple[str, BaseGeometry]] = ()


@dataclass(frozen=True, eq=False)
class PlanMap:
    """
    A plan on a map.

    Attributes
    ----------
    source
        The map as given, or made around the plan.
    problem
        Its risk, weight, bounds, projection and clearance, without no-fly areas; its start and goal are not used.
    areas
        Areas that no leg may cross, map units.
    route
        The places that are flown to, map units, shape ``(m, 2)``; equal neighbours count once.
    stops
        For each place of the route, 0 for home, else the number of the first waypoint there, from 1.
    has_bounds
        Whether the bounds are those of the given map, which no leg may leave.
    zones
        Record of every zone; None without files of zones.
    at_all_heights
        Whether zones were not applied at one altitude: they count at all heights, unless `heights` compares them.
    heights
        Comparison of the heights of the flight with floors and ceilings; None if they are not compared.
    flight
        The one altitude at which zones were applied, instead of the plan's own; None without one.
    vertical_clearance
        Metres by which floors and ceilings of zones are widened.
    unknown
        Why it is not known from this check whether the plan is clean, if so: one sentence each.
    """

    source: NamedMap
    problem: Problem
    areas: tuple[ClosedArea, ...]
    route: FloatArray
    stops: tuple[int, ...]
    has_bounds: bool
    zones: ZoneAccount | None = None
    at_all_heights: bool = False
    heights: PlanHeights | None = None
    flight: Altitude | None = None
    vertical_clearance: float = 0.0
    unknown: tuple[str, ...] = ()

    @property
    def has_own_heights(self) -> bool:
        """Whether the plan's own altitudes are compared with floors and ceilings."""
        return self.heights is not None and self.flight is None

    @property
    def account(self) -> ZoneAccount | None:
        """The records of the zones of the given map and of those beside it; None if there are no files of zones."""
        own: ZoneAccount | None = getattr(self.source, "zones", None)
        if own is None or self.zones is None:
            return self.zones or own
        records, remarks = (*own.records, *self.zones.records), (*own.remarks, *self.zones.remarks)
        return dataclasses.replace(self.zones, records=records, remarks=tuple(dict.fromkeys(remarks)))

    @property
    def rule(self) -> str:
        """Where zones count, and from what a clearance is measured; empty without zones."""
        if not self.has_own_heights:
            account = self.zones or getattr(self.source, "zones", None)
            return "" if account is None else account.rule
        return (
            "horizontal, from areas closed at the heights of the plan, and from the ground up at take-off and "
            f"landing; vertical clearance {self.vertical_clearance:g} m"
        )

    @cached_property
    def closed(self) -> tuple[ClosedArea, ...]:
        """The areas, joined with the outside where they close the border of the map."""
        if not self.has_bounds:
            return self.areas
        return tuple(
            dataclasses.replace(one, shape=joined_with(one.shape, stretches(one.shape, self.limits)))
            for one in self.areas
        )

    @cached_property
    def walls(self) -> tuple[ClosedArea, ...]:
        """The closed areas that every clean plan at the heights of this one must fly around."""
        heights = self.heights
        return tuple(one for number, one in enumerate(self.closed) if heights is None or heights.contains_all(number))

    @property
    def name(self) -> str:
        """The short name of the map."""
        return self.source.name

    @property
    def full_title(self) -> str:
        """Name and title of the map in one line."""
        return f"{self.name}: {self.source.title}" if self.source.title else self.name

    @property
    def limits(self) -> Bounds:
        """The bounds that no path may leave: those of the given map, else infinite."""
        return self.problem.bounds if self.has_bounds else (-math.inf, -math.inf, math.inf, math.inf)

    @property
    def rounding(self) -> float:
        """Crossings that a shift by this would undo do not count, map units."""
        x_min, y_min, x_max, y_max = self.problem.bounds
        return ROUNDED if self.problem.projection is not None else ROUNDING * max(x_max - x_min, y_max - y_min)

    def stop(self, place: int) -> str:
        """Return the number of the waypoint at a place of the route, or "home"."""
        return str(self.stops[place] or "home")

    def radii(self, of_waypoints: Sequence[float]) -> FloatArray:
        """Return a radius around each place of the route, shape ``(m,)``: the largest of the waypoints in one place."""
        places = np.searchsorted(self.stops, np.arange(1, len(of_waypoints) + 1), side="right") - 1
        radii = np.zeros(len(self.route))
        np.maximum.at(radii, places, of_waypoints)
        return radii


def put_on_map(
    plan: FlightPlan,
    name: str,
    on: NamedMap | None,
    zones: Applied | None,
    changes: Mapping[str, Any],
    *,
    ground: Ground | None = None,
) -> PlanMap:
    """
    Put a plan on the map on which it is checked.

    Parameters
    ----------
    plan, name
        The plan, and its name in messages.
    on
        The map; None to make one around the plan.
    zones
        The zones and their states; None without zones.
    changes
        ``k`` and ``clearance`` instead of the map's own, if given.
    ground
        Elevations; None if unknown.

    Raises
    ------
    ScenarioError
        If plan, map and zones are not in the same coordinates.
    """
    stops, flown = _stops(plan)
    if on is None and plan.coordinates != "lonlat":
        msg = f"{name}: it has only x and y, but zones are in degrees; give the scenario of the plan"
        raise ScenarioError(msg)
    chosen = _around(plan, flown, name) if on is None else on
    problem = dataclasses.replace(chosen.problem, no_fly=None, **changes)
    projection = problem.projection
    route = _on_plane(plan, flown, name, chosen)
    areas = own_areas(chosen)
    around = widened(problem.bounds, 2.0 * WIDER[-1])
    fences = [] if projection is None else [fence_area(one, projection, around) for one in plan.fence]
    areas += [one for one in fences if one is not None]
    limits: list[Limits | None] = [None] * len(areas)
    columns: Columns | None = getattr(chosen, "columns", None)
    low = [] if columns is None else list(columns.low)
    has_altitudes = any(one.altitude is not None for one in plan.waypoints)
    flight = None if columns is None or (zones is not None and has_altitudes) else columns.flight
    vertical = 0.0 if columns is None else columns.vertical_clearance
    account = heights = None
    if zones is not None:
        if projection is None:
            msg = f"zones are in longitude and latitude, and the map {chosen.name} is in the plane; leave them out"
            raise ScenarioError(msg)
        seen = problem.bounds if on is not None else widened(problem.bounds, WIDER[-1])
        box = _degrees_around(projection, seen, problem.clearance)
        near = zones.within(box)
        for verdict in near.verdicts:
            for area, between in _layers(verdict, box, apart=zones.altitude is None and has_altitudes):
                areas.append(ClosedArea(str(getattr(verdict.zone, "label", "a zone")), project_area(area, projection)))
                limits.append(between)
        account, more = near.account(), near.columns(projection)
        low += [] if more is None else more.low
        flight, vertical = zones.altitude or flight, max(vertical, zones.vertical_clearance)
    areas += [ClosedArea(one.zone.label, one.shape) for one in low]
    limits += [one.layer.limits for one in low]
    if projection is not None and any(one is not None and one.bounded for one in limits):
        level, column = (plan, None) if flight is None else (at_one_altitude(plan, flight), column_of(flight))
        known = ground if columns is None or ground is not None else columns.ground
        boxes = np.array([one.shape.bounds for one in areas])
        heights = PlanHeights(level, stops, limits, known, route, boxes, projection, vertical, column)
    at_all_heights = zones is not None and zones.altitude is None
    return PlanMap(
        chosen,
        problem,
        tuple(areas),
        route,
        stops,
        on is not None,
        account,
        at_all_heights,
        heights,
        flight,
        vertical,
    )


def _on_plane(plan: FlightPlan, flown: FloatArray, name: str, on: NamedMap) -> FloatArray:
    """Return the places that are flown to in the coordinates of the map."""
    projection = on.problem.projection
    if (projection is None) is (plan.coordinates == "lonlat"):
        one, other = "in degrees", "in x and y of a plane"
        here, there = (other, one) if projection is None else (one, other)
        msg = f"{name}: the plan is {there}, and the map {on.name} is {here}; give both in the same coordinates"
        raise ScenarioError(msg)
    try:
        return flown if projection is None else projection.forward(flown)
    except ProblemError as error:
        msg = f"{name}: {error}"
        raise ScenarioError(msg) from error


def _layers(verdict: Verdict, box: Bounds, *, apart: bool) -> list[tuple[AreaShape, Limits | None]]:
    """Return the closed area of a zone near a map, without limits; if `apart`, one area per pair of limits."""
    if verdict.area is None or isinstance(verdict.zone, NoArea):
        return []
    if not apart:
        return [(verdict.area, None)]
    groups: dict[Limits, list[AreaShape]] = {}
    for layer in verdict.zone.layers:
        groups.setdefault(layer.limits, []).append(layer.area)
    if len(groups) == 1:
        return [(verdict.area, next(iter(groups)))]
    parts = [(part_near(joined(shapes), box), limits) for limits, shapes in groups.items()]
    return [(area, limits) for area, limits in parts if area is not None]


def _stops(plan: FlightPlan) -> tuple[tuple[int, ...], FloatArray]:
    """Return the stops of a plan and their places, without equal neighbours."""
    flown = plan.flown
    first = 1 if len(flown) == len(plan.waypoints) else 0
    moved = np.concatenate([[True], (flown[1:] != flown[:-1]).any(axis=1)])
    return tuple((np.nonzero(moved)[0] + first).tolist()), flown[moved]


def own_areas(on: NamedMap) -> list[ClosedArea]:
    """
    Return the no-fly areas of a map, with their names if they have one.

    Examples
    --------
    >>> import shapely
    >>> own_areas(PlainMap("map", "", Problem((0, 0), (1, 1), no_fly=shapely.box(0.4, 0.4, 0.6, 0.6))))[0].name
    'no-fly area 0'
    """
    no_fly = on.problem.no_fly
    parts = [] if no_fly is None else list(getattr(no_fly, "geoms", [no_fly]))
    names = {shape.wkb: name for name, shape in on.areas}
    return [ClosedArea(names.get(part.wkb, f"no-fly area {number}"), part) for number, part in enumerate(parts)]


def _around(plan: FlightPlan, flown: FloatArray, name: str) -> PlainMap:
    """Make a map around a plan, so wide that better plans do not leave it."""
    from_first = np.column_stack([wrapped(flown[:, 0] - flown[0, 0]), flown[:, 1] - flown[0, 1]])
    east, north = flown[0] + 0.5 * (from_first.min(axis=0) + from_first.max(axis=0))
    middle = LocalProjection(float(wrapped(east)), float(north))
    length = float(np.hypot(*np.diff(middle.forward(flown), axis=0).T).sum())
    start, goal = ((float(x), float(y)) for x, y in (flown[0], flown[-1]))
    is_round = length > _ROUND * geodesic_length(start, goal)
    projection = middle if is_round else LocalProjection.between(start, goal)
    route = projection.forward(flown)
    first, last = (float(route[0, 0]), float(route[0, 1])), (float(route[-1, 0]), float(route[-1, 1]))
    bounds = wide_bounds(route, length)
    problem = Problem(first, last, bounds=bounds, projection=projection)
    stem = Path(name).stem
    return PlainMap(stem, plan.name if plan.name != stem else "", problem)


def wide_bounds(route: FloatArray, length: float) -> Bounds:
    """
    Return a box around a route and around every path between its ends that is not much longer.

    Paths of length ``a`` between two points stay in the ellipse with these foci and the major axis ``a``.

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
    Return a box with the same centre that is `factor` times as wide and high.

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
    Return the length of the shortest path between two points inside bounds that leaves the bounds, map units.

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
    """Return a box in degrees that contains the bounds on the plane and a margin."""
    x_min, y_min, x_max, y_max = bounds
    # (the origin of a plane of other coordinates is not (0, 0))
    x, y = projection.forward((projection.longitude, projection.latitude)).tolist()
    reach = math.hypot(max(x - x_min, x_max - x), max(y - y_min, y_max - y)) * (1.0 + _MARGIN) + margin
    return box_around((projection.longitude, projection.latitude), reach)
