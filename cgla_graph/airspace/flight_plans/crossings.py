"""
Where the legs of a route cross areas: not only whether a waypoint is inside.

Whether a leg crosses is exact for the given numbers (`cgla_graph.model.no_fly`). A crossing that a shift by a given
`rounding` would undo is told apart, as files keep places with some digits only: a route along the edge of an area is
not refused for its last digit, and the thinnest wall stands.
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
from cgla_graph.airspace.flight_plans.simultaneous_areas import InHeight, SimultaneousAreas

#: So many legs are looked at closely; of more, those that cross count, even by a rounding only, and are not listed.
MOST_LISTED = 10_000
#: Corners of a circle around a waypoint, a right angle.
_CORNERS = 64


@dataclass(frozen=True)
class Crossing:
    """
    A piece of a leg, or of the circle around a waypoint, inside an area.

    Attributes
    ----------
    leg
        Number of the leg, from 0; of a circle, and where it goes up or down, of the place of the route.
    area
        Number of the area.
    entry, exit
        Where the piece begins and ends, map units.
    along
        How far these are from the start of the route along it, map units.
    inside
        Length of the piece, map units.
    is_circle
        Whether it is the circle that is flown around a waypoint.
    is_upright
        Whether it is where the aircraft goes up or down above a place; such a piece has no length.
    """

    leg: int
    area: int
    entry: Point
    exit: Point
    along: tuple[float, float]
    inside: float
    is_circle: bool = False
    is_upright: bool = False


@dataclass(frozen=True, eq=False)
class Crossings:
    """
    What a route crosses.

    Attributes
    ----------
    found
        Piece by piece, along the route, of the first `MOST_LISTED` legs that cross something.
    legs
        Which legs cross an area, shape ``(n,)``, in order; all of them.
    rounded
        Which legs cross one by no more than a rounding, shape ``(n,)``; they do not count.
    clearances
        Of each leg the least distance to an area, shape ``(n_legs,)``, map units: 0 where it crosses or touches one,
        infinite without areas.
    """

    found: tuple[Crossing, ...]
    legs: IntArray
    rounded: IntArray
    clearances: FloatArray


def crossings_of(
    route: FloatArray,
    areas: Sequence[ClosedArea],
    *,
    rounding: float = 0.0,
    radii: Sequence[float] = (),
    heights: InHeight | None = None,
) -> Crossings:
    """
    Find where the legs of a route cross areas.

    Parameters
    ----------
    route
        Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units; the route of one point has one leg, of no length.
    areas
        What it may not cross; touching is allowed.
    rounding
        Crossings that a shift by this would undo do not count, map units.
    radii
        Of the circles that are flown around the waypoints, map units, 0 for none; nothing for none at all.
    heights
        On which parts of the legs each area counts, as only these are at its height; None for all of them.

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
    # two areas side by side leave no way between them: what counts is what is inside the union of all of them
    outline = Outline(shapely.GeometryCollection([one.shape for one in areas]))
    named = _Named(areas)
    if outline.area.is_empty:
        return Crossings((), _NONE, _NONE, np.full(len(starts), np.inf))
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
            inside += named.parts(kept, part.areas)
            is_inside |= bool(kept)
            is_dodged |= len(kept) < len(pieces)
        found += [_crossing(leg, area, piece, starts[leg], float(before[leg])) for area, piece in _joined(inside)]
        crossing += [leg] if is_inside else []
        rounded += [leg] if is_dodged and not is_inside else []
    legs = np.sort(np.array(crossing, dtype=np.int64))
    simultaneous.widen_clearances(starts, ends, np.setdiff1d(np.arange(len(starts)), legs), crosses, clearances)
    found += _uprights(route, before, simultaneous, found, rounding)
    found += named.circles(route, radii, before, rounding, heights)
    found.sort(key=lambda one: (one.along, one.area))
    return Crossings(tuple(found), legs, np.array(rounded, dtype=np.int64), clearances)


_NONE = np.zeros(0, dtype=np.int64)


def _crossing(leg: int, area: int, piece: Piece, start: FloatArray, before: float) -> Crossing:
    (first, last), (x, y) = piece, start.tolist()
    along = tuple(before + math.hypot(place[0] - x, place[1] - y) for place in piece)
    return Crossing(leg, area, first, last, (along[0], along[1]), math.dist(first, last))


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
    """Return where the aircraft goes up or down inside an area, unless a leg is inside of it there."""
    seen = {(one.area, place) for one in found for place in (one.entry, one.exit)}
    crossings = []
    for index, areas in simultaneous.uprights(route, rounding):
        at, far = (float(route[index, 0]), float(route[index, 1])), float(before[index])
        crossings += [
            Crossing(index, area, at, at, (far, far), 0.0, is_upright=True) for area in areas if (area, at) not in seen
        ]
    return crossings


class _Named:
    """Areas one by one, to tell which of them a piece is in."""

    def __init__(self, areas: Sequence[ClosedArea]) -> None:
        self.areas = areas
        self.tree = shapely.STRtree([one.shape for one in areas])
        self.outlines: dict[int, Outline] = {}

    def near(self, shape: BaseGeometry) -> list[int]:
        """Return the areas that a shape meets."""
        return sorted(self.tree.query(shape, predicate="intersects").tolist())

    def parts(self, pieces: Sequence[Piece], among: Collection[int] | None) -> Iterator[tuple[int, Piece]]:
        """Yield the parts of pieces inside each area; of a piece on the border of two, all of it for both."""
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
        heights: InHeight | None,
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
                if heights is not None and not heights.at_place(index, number):
                    continue
                inside = float(shapely.intersection(circle, shape).length)
                at, far = (float(place.x), float(place.y)), float(before[index])
                yield Crossing(index, number, at, at, (far, far), inside, is_circle=True)


def geodesic_gaps(ends: FloatArray, samples: Sequence[FloatArray]) -> FloatArray:
    """
    Return how far each leg is from points that it would pass on another way, map units.

    Parameters
    ----------
    ends
        Starts and ends of legs, shape ``(n, 2, 2)``.
    samples
        Points of the other way, shape ``(n, 2)`` each.

    Examples
    --------
    >>> geodesic_gaps(np.array([[(0.0, 0.0), (2.0, 0.0)]]), [np.array([(1.0, 0.25)])]).tolist()
    [0.25]
    """
    lines = shapely.linestrings(ends)
    return np.asarray(np.max([shapely.distance(lines, shapely.points(one)) for one in samples], axis=0))
