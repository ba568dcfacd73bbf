"""Outlines of areas: the pieces of a leg inside an area, and which of them are rounding errors."""

import math
from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray, Point
from cgla_graph.model.no_fly import NoFlyArea

#: A part of a leg: where it begins and ends.
Piece: TypeAlias = tuple[Point, Point]

#: Of a leg with more pieces than this, of which some lie deep inside, only so many are tested for being roundings.
MOST_TESTED = 20


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
    is_outside
        Whether it is all around an area in which a plan must stay: pictures show its border only.
    """

    name: str
    shape: BaseGeometry
    is_outside: bool = False


def point_of(place: FloatArray) -> Point:
    """
    Return a place as two numbers.

    Examples
    --------
    >>> point_of(np.array([1.0, 2.0]))
    (1.0, 2.0)
    """
    return float(place[0]), float(place[1])


class Outline:
    """
    The outline of an area, looked up edge by edge.

    Parameters
    ----------
    shape
        Polygons, map units, as `cgla_graph.model.no_fly.NoFlyArea` takes them.

    Examples
    --------
    >>> Outline(shapely.box(4, 0, 5, 9)).pieces(np.array([0.0, 5.0]), np.array([9.0, 5.0]))
    [((4.0, 5.0), (5.0, 5.0))]
    """

    def __init__(self, shape: BaseGeometry) -> None:
        self.area = NoFlyArea(shape)
        self.shape = self.area.geometry
        edges = self.area.edges
        lines = shapely.linestrings(edges[:, :4].reshape(-1, 2, 2))
        self.tree = shapely.STRtree(np.array(lines, dtype=object, ndmin=1))
        self.rings = [LineString(ring) for ring in shapely.get_rings(shapely.get_parts(self.shape))]
        self.corners = [shapely.get_coordinates(ring) for ring in self.rings]
        steps = [np.hypot(*np.diff(corners, axis=0).T) for corners in self.corners]
        #: Distance of each corner from the start of its ring, along the ring.
        self.arc_lengths = [np.concatenate([[0.0], np.cumsum(step)]) for step in steps]

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
            return [(point_of(start), point_of(end))]
        edges = self.tree.geometries[self.tree.query(leg, predicate="intersects")]
        cuts = shapely.get_coordinates(shapely.intersection(leg, edges))
        shares = np.clip((cuts - start) @ along / length2, 0.0, 1.0)
        shares = np.unique(np.concatenate([[0.0], shares, [1.0]]))
        middles = start + 0.5 * (shares[:-1] + shares[1:])[:, None] * along
        # (rounded middles decide only which pieces are inside; whether the leg crosses is decided exactly elsewhere)
        inside = self.area.contains(middles)
        if not inside.any():
            # the area is thinner here than the spacing of floating-point numbers
            place = start + shares[len(shares) // 2] * along
            return [(point_of(place), point_of(place))]
        # pieces that touch are one
        opens = np.nonzero(inside & ~np.concatenate([[False], inside[:-1]]))[0]
        closes = np.nonzero(inside & ~np.concatenate([inside[1:], [False]]))[0]
        return [
            (point_of(start + shares[first] * along), point_of(start + shares[last + 1] * along))
            for first, last in zip(opens.tolist(), closes.tolist(), strict=True)
        ]

    def without_roundings(self, pieces: list[Piece], rounding: float) -> list[Piece]:
        """
        Return the pieces of a leg that a shift by a rounding would not undo.

        If a leg has more than `MOST_TESTED` pieces and some lie deep inside, it crosses in any case: then only
        `MOST_TESTED` of the other pieces are tested.
        """
        if rounding <= 0.0:
            return pieces
        tested = set(range(len(pieces)))
        if len(pieces) > MOST_TESTED:
            middles = shapely.points(np.array(pieces).mean(axis=1))
            beside = set(self.tree.query(middles, predicate="dwithin", distance=rounding)[0].tolist())
            if len(beside) < len(pieces):
                tested = set(sorted(beside)[:MOST_TESTED])
        return [one for number, one in enumerate(pieces) if number not in tested or not self.can_dodge(*one, rounding)]

    def can_dodge(self, first: Point, last: Point, rounding: float) -> bool:
        """
        Return whether the outline between the ends of a piece stays within a rounding (above 0) of the piece.

        Across a thin wall it does not: the ends lie on two sides, and the outline between them is long.
        """
        if first == last:
            return self._is_single_line(first, rounding)
        middle = LineString([first, last]).interpolate(0.5, normalized=True)
        ends = [shapely.Point(first), shapely.Point(last)]
        if not len(self.tree.query(middle, predicate="dwithin", distance=rounding)):
            return False
        # each end belongs to its nearest ring; another ring within a rounding may be the other side of a thin wall
        away = [[float(shapely.distance(ring, end)) for ring in self.rings] for end in ends]
        one, other = (min(range(len(self.rings)), key=far.__getitem__) for far in away)
        if one != other or max(away[0][one], away[1][one]) > rounding:
            return False
        ring = self.rings[one]
        low, high = sorted(ring.project(end) for end in ends)
        # the ring joins the two ends in two ways; test the corners on each
        between = (self.arc_lengths[one] > low) & (self.arc_lengths[one] < high)
        corners = self.corners[one]
        return any(_are_near(corners[way], first, last, rounding) for way in (between, ~between))

    def _is_single_line(self, place: Point, rounding: float) -> bool:
        """Return whether the outline near a place is one line, so that a leg can pass on its other side."""
        edges = self.area.edges[self.tree.query(shapely.Point(place), predicate="dwithin", distance=rounding), :4]
        # edges that share a corner nearby are one line
        lines: list[set[Point]] = []
        for edge in edges.reshape(-1, 2, 2).tolist():
            line = {(x, y) for x, y in edge if math.dist((x, y), place) <= rounding}
            joined = [other for other in lines if other & line]
            lines = [other for other in lines if not other & line] + [line.union(*joined)]
        return len(lines) == 1


def _are_near(points: FloatArray, first: Point, last: Point, distance: float) -> bool:
    """Return whether all points are within a distance of a segment."""
    along = np.subtract(last, first)
    shares = np.clip((points - first) @ along / float(along @ along), 0.0, 1.0)
    return bool((np.hypot(*(points - first - shares[:, None] * along).T) <= distance).all())
