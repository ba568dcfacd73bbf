"""
Legs between waypoints that the aircraft does not fly over but passes at a distance, or circles.

Such a leg begins and ends anywhere within a distance of its waypoints: it is inside the convex hull of two discs. What
is in the hull may be flown through.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.simultaneous_areas import HeightOverlap

#: Corners per right angle of a disc around a waypoint.
CORNERS: Final = 32
#: Legs up to which the clearance of each is exact; of more, that of a leg far from all areas is a lower bound.
MOST_EXACT: Final = 2_000


@dataclass(frozen=True)
class WideLeg:
    """
    A leg that may be flown at a distance from its straight line.

    Attributes
    ----------
    leg
        Its number, from 0.
    areas
        Numbers of the areas into which it may reach.
    clearance
        Least distance of an area that counts from all that may be flown through, map units, or a lower bound of it;
        infinite without areas.
    """

    leg: int
    areas: tuple[int, ...]
    clearance: float


def wide_legs(
    route: FloatArray,
    areas: Sequence[ClosedArea],
    reaches: Sequence[float],
    circles: Sequence[float],
    *,
    rounding: float = 0.0,
    heights: HeightOverlap | None = None,
) -> Iterator[WideLeg]:
    """
    Yield the legs that may be flown at a distance from their straight lines.

    Parameters
    ----------
    route
        Waypoints, shape ``(m, 2)``, map units; a route of one point has one leg of length 0.
    areas
        The areas.
    reaches
        For each waypoint, the distance within which it is passed, map units; empty if all are flown over.
    circles
        Radii of the circles around waypoints, which are reported by themselves; empty if there is none.
    rounding
        What a shift by this would undo does not count, map units.
    heights
        The parts of legs at the height of each area, where alone the area counts; None if areas count everywhere.

    Examples
    --------
    >>> wall = ClosedArea("wall", shapely.box(0.0, 3.0, 9.0, 5.0))
    >>> found = wide_legs(np.array([(0.0, 0.0), (9.0, 0.0)]), [wall], [0.0, 4.0], [])
    >>> [(one.leg, one.areas, one.clearance) for one in found]
    [(0, (0,), 0.0)]
    """
    if not any(reaches) or not areas:
        return
    shapes = np.array([one.shape for one in areas], dtype=object)
    tree, trees = shapely.STRtree(shapes), _Trees(shapes, heights)
    starts = np.arange(max(len(route) - 1, 1))
    ends = np.minimum(starts + 1, len(route) - 1)
    widest = np.maximum(np.array(reaches)[starts], np.array(reaches)[ends])
    wide = np.nonzero(widest > 0.0)[0]
    lines = shapely.linestrings(np.stack([route[starts[wide]], route[ends[wide]]], axis=1))
    beyond = 1.0 / math.cos(0.25 * math.pi / CORNERS)
    close = set(wide[tree.query(lines, predicate="dwithin", distance=widest[wide] * beyond)[0]].tolist())
    for leg, line in zip(wide.tolist(), list(np.asarray(lines, dtype=object)), strict=True):
        if leg not in close and len(wide) > MOST_EXACT:
            # (at least that far)
            yield WideLeg(leg, (), max(trees.distance(leg, line) - float(widest[leg]), 0.0))
            continue
        pair = int(starts[leg]), int(ends[leg])
        hull = _hull(route, pair, reaches)
        met: tuple[int, ...] = ()
        if leg in close:
            discs = [_disc(route[end], circles[end]) for end in pair if circles and circles[end]]
            beside = shapely.difference(hull, shapely.union_all(discs)) if discs else hull
            near = [number for number in sorted(tree.query(beside).tolist()) if _overlap(beside, shapes[number])]
            inner = shapely.buffer(beside, -rounding) if near and rounding > 0.0 else beside
            near = [number for number in near if _overlap(inner, shapes[number])]
            met = tuple(number for number in near if heights is None or len(heights.on_leg(leg, number)))
        yield WideLeg(leg, met, trees.distance(leg, hull))


class _Trees:
    """Areas that may count on a leg, looked up by their distance."""

    def __init__(self, shapes: np.ndarray[Any, Any], heights: HeightOverlap | None) -> None:
        self.shapes = shapes
        self.kinds = None if heights is None else heights.kinds()
        self.trees: dict[int, shapely.STRtree] = {}

    def distance(self, leg: int, shape: BaseGeometry) -> float:
        """Return the distance of a shape from the areas that may count on a leg."""
        kind = 0 if self.kinds is None else int(self.kinds[0][leg])
        if kind not in self.trees:
            counts = slice(None) if self.kinds is None else self.kinds[1][kind]
            self.trees[kind] = shapely.STRtree(self.shapes[counts])
        nearest, distances = self.trees[kind].query_nearest(shape, return_distance=True, all_matches=False)
        return float(distances[0]) if len(nearest) else math.inf


def _hull(route: FloatArray, ends: tuple[int, int], reaches: Sequence[float]) -> BaseGeometry:
    """Return a polygon around all places that are flown through between two waypoints."""
    discs = [_disc(route[end], reaches[end]) for end in ends if reaches[end]]
    places = [shapely.Point(route[end]) for end in ends]
    return shapely.convex_hull(shapely.GeometryCollection([*discs, *places]))


def _disc(place: FloatArray, radius: float) -> BaseGeometry:
    """Return a polygon around a disc."""
    return shapely.Point(place).buffer(radius / math.cos(0.25 * math.pi / CORNERS), CORNERS)


def _overlap(one: BaseGeometry, other: BaseGeometry) -> bool:
    """Return whether two areas have more in common than their borders."""
    return bool(shapely.intersects(one, other) and not shapely.touches(one, other))
