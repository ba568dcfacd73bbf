"""
Crossings of the legs of a route with areas.

Whether a leg crosses is exact for the given numbers (`cgla_graph.model.no_fly`). Files keep places with a limited
number of digits, so a crossing that a shift by a given `rounding` would undo is reported apart and does not count. A
route along the edge of an area is therefore clean, and even the thinnest wall still counts.
"""

import math
from collections.abc import Collection, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea, Outline, Piece
from cgla_graph.airspace.flight_plans.simultaneous_areas import HeightOverlap, SimultaneousAreas
from cgla_graph.airspace.flight_plans.wide_legs import cut_corners, wide_legs

#: Legs whose crossings are listed, at most. Beyond, a leg that crosses counts, even if only by a rounding.
MOST_LISTED = 10_000
#: Corners per right angle of a circle around a waypoint.
_CORNERS = 64


@dataclass(frozen=True)
class Crossing:
    """
    A piece of a leg, or of the circle around a waypoint, inside an area.

    Attributes
    ----------
    leg
        Number of the leg, from 0; for a circle, a climb or a descent, number of the place of the route.
    area
        Number of the area.
    entry, exit
        Start and end of the piece, map units.
    along
        Distance of these from the start of the route, along the route, map units.
    inside
        Length of the piece, map units.
    is_circle
        Whether the piece is on a circle that is flown around a waypoint.
    is_upright
        Whether the aircraft climbs or descends vertically there; such a piece has no length.
    is_beside
        Whether the area is beside the straight leg, within the distance at which the aircraft may pass its waypoints.
        Entry and exit are the place on the straight leg that is nearest to the area; such a piece has no length.
    """

    leg: int
    area: int
    entry: Point
    exit: Point
    along: tuple[float, float]
    inside: float
    is_circle: bool = False
    is_upright: bool = False
    is_beside: bool = False


@dataclass(frozen=True)
class Column:
    """
    A place where the aircraft climbs or descends vertically, as where it takes off and lands.

    Attributes
    ----------
    place
        Number of the place of the route.
    area
        Number of the nearest area at the heights there.
    distance
        Its distance, map units.
    """

    place: int
    area: int
    distance: float


@dataclass(frozen=True, eq=False)
class Crossings:
    """
    All crossings of a route.

    Attributes
    ----------
    found
        The pieces inside areas, in order along the route, of the first `MOST_LISTED` legs that cross an area.
    legs
        Numbers of all legs that cross an area, shape ``(n,)``, in order.
    beside
        Numbers of the legs that may reach into an area beside them, shape ``(n,)``, in order.
    cut
        Numbers of those that do only if the corner before them is cut.
    rounded
        Numbers of the legs that cross an area by no more than a rounding, shape ``(n,)``; they do not count.
    clearances
        Least distance of each leg to an area, shape ``(n_legs,)``, map units: 0 where it crosses or touches one,
        infinite without areas. Below the required distance, areas count at the heights of the leg beside them; others
        are at least that. That of a leg that passes a waypoint at a distance is that of all that may be flown
        through.
    columns
        Places where the aircraft climbs or descends vertically, with their distances to areas at the heights there;
        empty without any heights.
    """

    found: tuple[Crossing, ...]
    legs: IntArray
    beside: IntArray
    cut: IntArray
    rounded: IntArray
    clearances: FloatArray
    columns: tuple[Column, ...] = ()


def crossings_of(
    route: FloatArray,
    areas: Sequence[ClosedArea],
    *,
    rounding: float = 0.0,
    radii: Sequence[float] = (),
    reaches: Sequence[float] = (),
    cuts: Sequence[float] = (),
    heights: HeightOverlap | None = None,
    required: float = 0.0,
) -> Crossings:
    """
    Find where the legs of a route cross areas.

    Parameters
    ----------
    route
        Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units; a route of one point has one leg of length 0.
    areas
        The areas; a leg may touch but not cross them.
    rounding
        Crossings that a shift by this would undo do not count, map units.
    radii
        Radii of the circles that are flown around the waypoints, map units, 0 for none; empty if there is no circle.
    reaches
        Distances within which the waypoints are passed, map units, at least the radii; empty if all are flown over.
    cuts
        Distances from the waypoints at which corners may be cut, map units; empty if none is. Clearances are those of
        corners that are not cut.
    heights
        The parts of the legs at the height of each area, where alone the area counts; None if areas count everywhere.
    required
        Distance to be kept from areas, map units: within it, distances are those from areas at the heights there.

    Examples
    --------
    >>> wall = ClosedArea("wall", shapely.box(4, 0, 5, 9))
    >>> found = crossings_of(np.array([(0.0, 0.0), (0.0, 5.0), (9.0, 5.0)]), [wall])
    >>> [(one.leg, one.entry, one.exit, one.along, one.inside) for one in found.found]
    [(1, (4.0, 5.0), (5.0, 5.0), (9.0, 10.0), 1.0)]
    >>> found.clearances.tolist()
    [4.0, 0.0]
    """
    starts, ends = (route, route) if len(route) == 1 else (route[:-1], route[1:])
    before = np.concatenate([[0.0], np.cumsum(np.hypot(*(ends - starts).T))])
    # there is no passage between two areas that touch, so legs are tested against the union of all areas
    outline = Outline(shapely.GeometryCollection([one.shape for one in areas]))
    lookup = _AreaLookup(areas)
    if outline.area.is_empty:
        return Crossings((), _NONE, _NONE, _NONE, _NONE, np.full(len(starts), np.inf))
    crosses = np.asarray(outline.area.crosses(starts, ends))
    clearances = np.zeros(len(starts))
    clearances[~crosses] = outline.distances(starts[~crosses], ends[~crosses])
    simultaneous = SimultaneousAreas(areas, outline, heights)
    crosses = simultaneous.may_cross(crosses)
    hit = np.nonzero(crosses)[0]
    found: list[Crossing] = []
    crossing, rounded = hit[MOST_LISTED:].tolist(), []
    for leg in hit[:MOST_LISTED].tolist():
        inside: list[tuple[int, Piece]] = []
        is_inside = is_dodged = False
        for part in simultaneous.parts(leg, starts[leg], ends[leg]):
            pieces = (
                part.outline.pieces(part.start, part.end) if part.outline.area.crosses(part.start, part.end) else []
            )
            kept = part.outline.without_roundings(pieces, rounding)
            inside += lookup.parts(kept, part.areas)
            is_inside |= bool(kept)
            is_dodged |= len(kept) < len(pieces)
        found += [_crossing(leg, area, piece, starts[leg], float(before[leg])) for area, piece in _joined(inside)]
        crossing += [leg] if is_inside else []
        rounded += [leg] if is_dodged and not is_inside else []
    legs = np.sort(np.array(crossing, dtype=np.int64))
    clean = np.setdiff1d(np.arange(len(starts)), legs)
    simultaneous.widen_clearances(starts, ends, clean, crosses, clearances, required)
    found += _uprights(route, before, simultaneous, found, rounding)
    found += lookup.circles(route, radii, before, rounding, heights)
    beside = []
    seen = {(one.leg, one.area) for one in found if not (one.is_circle or one.is_upright)}
    for wide in wide_legs(route, areas, reaches, radii, rounding=rounding, heights=heights, required=required):
        leg = wide.leg
        clearances[leg] = min(wide.clearance, clearances[leg]) if heights is None else wide.clearance
        new = [area for area in wide.areas if (leg, area) not in seen]
        found += [_beside(leg, area, areas[area].shape, starts[leg], ends[leg], float(before[leg])) for area in new]
        beside += [leg] if new else []
    cut = []
    for leg, met in cut_corners(route, areas, cuts, reaches, rounding=rounding, heights=heights):
        new = [area for area in met if (leg, area) not in seen and leg not in beside]
        found += [_beside(leg, area, areas[area].shape, starts[leg], ends[leg], float(before[leg])) for area in new]
        cut += [leg] if new else []
    found.sort(key=lambda one: (one.along, one.area))
    wide_or_cut = np.array(sorted([*beside, *cut]), dtype=np.int64)
    numbers = np.array(cut, dtype=np.int64), np.array(rounded, dtype=np.int64)
    columns = tuple(Column(*one) for one in simultaneous.nearest_at_places(route, required))
    return Crossings(tuple(found), legs, wide_or_cut, *numbers, clearances, columns)


_NONE = np.zeros(0, dtype=np.int64)


def _crossing(leg: int, area: int, piece: Piece, start: FloatArray, before: float) -> Crossing:
    (first, last), (x, y) = piece, start.tolist()
    along = tuple(before + math.hypot(place[0] - x, place[1] - y) for place in piece)
    return Crossing(leg, area, first, last, (along[0], along[1]), math.dist(first, last))


def _beside(leg: int, area: int, shape: BaseGeometry, start: FloatArray, end: FloatArray, before: float) -> Crossing:
    line = LineString([start, end])
    share = line.project(shapely.Point(shapely.shortest_line(line, shape).coords[0]))
    at = line.interpolate(share)
    place, far = (float(at.x), float(at.y)), before + share
    return Crossing(leg, area, place, place, (far, far), 0.0, is_beside=True)


def _joined(inside: list[tuple[int, Piece]]) -> list[tuple[int, Piece]]:
    """Join pieces of a leg in one area, in order, of which one begins where another ends."""
    found: list[tuple[int, Piece]] = []
    last: dict[int, int] = {}
    for area, piece in inside:
        at = last.get(area)
        if at is not None and found[at][1][1] == piece[0]:
            found[at] = area, (found[at][1][0], piece[1])
        else:
            last[area] = len(found)
            found.append((area, piece))
    return found


def _uprights(
    route: FloatArray, before: FloatArray, simultaneous: SimultaneousAreas, found: Sequence[Crossing], rounding: float
) -> list[Crossing]:
    """Return vertical climbs and descents inside areas, except where a leg inside the same area begins or ends."""
    seen = {(one.area, place) for one in found for place in (one.entry, one.exit)}
    crossings = []
    for index, areas in simultaneous.uprights(route, rounding):
        at, far = (float(route[index, 0]), float(route[index, 1])), float(before[index])
        crossings += [
            Crossing(index, area, at, at, (far, far), 0.0, is_upright=True) for area in areas if (area, at) not in seen
        ]
    return crossings


class _AreaLookup:
    """Lookup of the areas that contain a piece."""

    def __init__(self, areas: Sequence[ClosedArea]) -> None:
        self.areas = areas
        self.tree = shapely.STRtree([one.shape for one in areas])
        self.outlines: dict[int, Outline] = {}

    def near(self, shape: BaseGeometry) -> list[int]:
        """Return the numbers of the areas that a shape meets."""
        return sorted(self.tree.query(shape, predicate="intersects").tolist())

    def parts(self, pieces: Sequence[Piece], among: Collection[int] | None) -> Iterator[tuple[int, Piece]]:
        """Yield the parts of pieces inside each area; a piece on the border of two areas counts whole for both."""
        for first, last in pieces:
            piece = LineString([first, last])
            parts = []
            near = self.tree.query(piece).tolist()
            for number in sorted(near if among is None else set(near) & set(among)):
                outline = self.outlines.get(number) or self.outlines.setdefault(
                    number, Outline(self.areas[number].shape)
                )
                if outline.area.crosses(first, last):
                    parts += [(number, part) for part in outline.pieces(np.array(first), np.array(last))]
            if not parts:
                on_border = self.near(piece) if among is None else sorted(among)
                parts = [(number, (first, last)) for number in on_border]
            yield from parts

    def circles(
        self,
        route: FloatArray,
        radii: Sequence[float],
        before: FloatArray,
        rounding: float,
        heights: HeightOverlap | None,
    ) -> Iterator[Crossing]:
        """Yield the circles around waypoints that reach into an area."""
        for index, radius in enumerate(radii):
            if radius <= 0.0:
                continue
            place = shapely.Point(route[index])
            circle = place.buffer(radius, _CORNERS).exterior
            for number in self.near(place.buffer(1.01 * radius)):
                shape = self.areas[number].shape
                if shapely.distance(place, shape) >= radius - rounding:
                    continue
                if heights is not None and not heights.at_place(index, number, radius):
                    continue
                inside = float(shapely.intersection(circle, shape).length)
                at, far = (float(place.x), float(place.y)), float(before[index])
                yield Crossing(index, number, at, at, (far, far), inside, is_circle=True)
