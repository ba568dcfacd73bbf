"""
Where the legs of a route cross areas: not only whether a waypoint is inside.

Whether a leg crosses is exact for the given numbers (`cgla_graph.model.no_fly`). A crossing that a shift by a given
`rounding` would undo is told apart, as files keep places with some digits only: a route along the edge of an area is
not refused for its last digit, and the thinnest wall stands.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry
from shapely.ops import substring

from cgla_graph._types import FloatArray, IntArray, Point
from cgla_graph.model.no_fly import NoFlyArea

#: A part of a leg: where it begins and ends.
Piece: TypeAlias = tuple[Point, Point]

#: So many legs are looked at closely; of more, those that cross count, even by a rounding only, and are not listed.
MOST_LISTED = 10_000
#: Corners of a circle around a waypoint, a right angle.
_CORNERS = 64


@dataclass(frozen=True)
class ClosedArea:
    """
    An area that no leg may cross, with its name.

    Attributes
    ----------
    name
        What messages call it.
    shape
        Polygons, map units.
    """

    name: str
    shape: BaseGeometry


@dataclass(frozen=True)
class Crossing:
    """
    A piece of a leg, or of the circle around a waypoint, inside an area.

    Attributes
    ----------
    leg
        Number of the leg, from 0; of a circle, of its waypoint.
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
    """

    leg: int
    area: int
    entry: Point
    exit: Point
    along: tuple[float, float]
    inside: float
    is_circle: bool = False


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
    route: FloatArray, areas: Sequence[ClosedArea], *, rounding: float = 0.0, radii: Sequence[float] = ()
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
    # two areas side by side leave no way between them: what counts is what is inside of all of them together
    walls = _Walls(shapely.GeometryCollection([one.shape for one in areas]))
    named = _Named(areas)
    if walls.area.is_empty:
        return Crossings((), _NONE, _NONE, np.full(len(starts), np.inf))
    crosses = np.asarray(walls.area.crosses(starts, ends))
    hit, clearances = np.nonzero(crosses)[0], np.zeros(len(starts))
    clearances[~crosses] = walls.distances(starts[~crosses], ends[~crosses])
    found: list[Crossing] = []
    crossing: list[int] = []
    for leg in hit[:MOST_LISTED].tolist():
        pieces = [one for one in walls.pieces(starts[leg], ends[leg]) if not walls.can_dodge(*one, rounding)]
        crossing += [leg] if pieces else []
        for area, piece in named.parts(pieces):
            found.append(_crossing(leg, area, piece, starts[leg], float(before[leg])))
    crossing += hit[MOST_LISTED:].tolist()
    found += named.circles(route, radii, before, rounding)
    found.sort(key=lambda one: (one.along, one.area))
    legs = np.array(crossing, dtype=np.int64)
    return Crossings(tuple(found), legs, np.setdiff1d(hit, legs), clearances)


_NONE = np.zeros(0, dtype=np.int64)


def _crossing(leg: int, area: int, piece: Piece, start: FloatArray, before: float) -> Crossing:
    (first, last), (x, y) = piece, start.tolist()
    along = tuple(before + math.hypot(place[0] - x, place[1] - y) for place in piece)
    return Crossing(leg, area, first, last, (along[0], along[1]), math.dist(first, last))


class _Named:
    """Areas one by one, to tell which of them a piece is in."""

    def __init__(self, areas: Sequence[ClosedArea]) -> None:
        self.areas = areas
        self.tree = shapely.STRtree([one.shape for one in areas])
        self.walls: dict[int, _Walls] = {}

    def near(self, shape: BaseGeometry) -> list[int]:
        """Return the areas that a shape meets."""
        return sorted(self.tree.query(shape, predicate="intersects").tolist())

    def parts(self, pieces: Sequence[Piece]) -> Iterator[tuple[int, Piece]]:
        """Yield the parts of pieces inside each area; of a piece on the border of two, all of it for both."""
        for first, last in pieces:
            piece = LineString([first, last])
            parts = []
            for number in sorted(self.tree.query(piece).tolist()):
                walls = self.walls.get(number) or self.walls.setdefault(number, _Walls(self.areas[number].shape))
                if walls.area.crosses(first, last):
                    parts += [(number, part) for part in walls.pieces(np.array(first), np.array(last))]
            yield from parts or [(number, (first, last)) for number in self.near(piece)]

    def circles(
        self, route: FloatArray, radii: Sequence[float], before: FloatArray, rounding: float
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
                inside = float(shapely.intersection(circle, shape).length)
                at, far = (float(place.x), float(place.y)), float(before[index])
                yield Crossing(index, number, at, at, (far, far), inside, is_circle=True)


def _point(place: FloatArray) -> Point:
    return float(place[0]), float(place[1])


class _Walls:
    """The outline of an area, looked up edge by edge."""

    def __init__(self, shape: BaseGeometry) -> None:
        self.area = NoFlyArea(shape)
        self.shape = self.area.geometry
        edges = self.area.edges
        lines = shapely.linestrings(edges[:, :4].reshape(-1, 2, 2))
        self.tree = shapely.STRtree(np.array(lines, dtype=object, ndmin=1))
        self.rings = [LineString(ring) for ring in shapely.get_rings(shapely.get_parts(self.shape))]

    def distances(self, starts: FloatArray, ends: FloatArray) -> FloatArray:
        """Return the distance of each leg from the outline."""
        lines = np.asarray(shapely.linestrings(np.stack([starts, ends], axis=1)), dtype=object)
        _, distance = self.tree.query_nearest(lines, all_matches=False, return_distance=True)
        return np.array(distance, dtype=np.float64)

    def pieces(self, start: FloatArray, end: FloatArray) -> list[Piece]:
        """Return the pieces of a leg that crosses the area inside of it, as beginnings and ends."""
        leg, along = LineString([start, end]), end - start
        length2 = float(along @ along)
        if length2 == 0.0:
            return [(_point(start), _point(end))]
        edges = self.tree.geometries[self.tree.query(leg, predicate="intersects")]
        cuts = shapely.get_coordinates(shapely.intersection(leg, edges))
        shares = np.clip((cuts - start) @ along / length2, 0.0, 1.0)
        shares = np.unique(np.concatenate([[0.0], shares, [1.0]]))
        middles = start + 0.5 * (shares[:-1] + shares[1:])[:, None] * along
        # (a middle is rounded, but so is nothing that decides whether the leg crosses at all)
        inside = self.area.contains(middles)
        if not inside.any():
            # thinner than the distance of two numbers
            place = start + shares[len(shares) // 2] * along
            return [(_point(place), _point(place))]
        # pieces that touch are one
        opens = np.nonzero(inside & ~np.concatenate([[False], inside[:-1]]))[0]
        closes = np.nonzero(inside & ~np.concatenate([inside[1:], [False]]))[0]
        return [
            (_point(start + shares[first] * along), _point(start + shares[last + 1] * along))
            for first, last in zip(opens.tolist(), closes.tolist(), strict=True)
        ]

    def can_dodge(self, first: Point, last: Point, rounding: float) -> bool:
        """
        Tell whether a piece inside could run along the outline instead, never farther away than a rounding.

        Of a thin wall it could not: its ends lie on two sides, and the way around is long.
        """
        if rounding <= 0.0:
            return False
        if first == last:
            return self._is_corner(first, rounding)
        middle = LineString([first, last]).interpolate(0.5, normalized=True)
        ends = [shapely.Point(first), shapely.Point(last)]
        if not len(self.tree.query(middle, predicate="dwithin", distance=rounding)):
            return False
        piece = LineString([first, last])
        # each end is on the ring that is nearest to it: on others it may be within a rounding, but across a thin wall
        away = [[float(shapely.distance(ring, end)) for ring in self.rings] for end in ends]
        one, other = (min(range(len(self.rings)), key=far.__getitem__) for far in away)
        if one != other or max(away[0][one], away[1][one]) > rounding:
            return False
        ring = self.rings[one]
        low, high = sorted(ring.project(end) for end in ends)
        between = substring(ring, low, high).coords
        around = [*substring(ring, high, ring.length).coords, *substring(ring, 0.0, low).coords]
        piece = LineString([first, last])
        ways = (shapely.points(np.array(way)) for way in (between, around))
        return any(shapely.distance(piece, way).max() <= rounding for way in ways)

    def _is_corner(self, place: Point, rounding: float) -> bool:
        """Tell whether the outline near a place is one line, which can be passed on its other side."""
        edges = self.area.edges[self.tree.query(shapely.Point(place), predicate="dwithin", distance=rounding), :4]
        # edges that share a corner nearby are one line
        lines: list[set[Point]] = []
        for edge in edges.reshape(-1, 2, 2).tolist():
            line = {(x, y) for x, y in edge if math.dist((x, y), place) <= rounding}
            joined = [other for other in lines if other & line]
            lines = [other for other in lines if not other & line] + [line.union(*joined)]
        return len(lines) == 1


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
