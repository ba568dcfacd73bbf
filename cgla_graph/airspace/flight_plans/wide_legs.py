"""
Legs between waypoints that the aircraft does not fly over but passes at a distance, circles, or cuts the corner of.

Such a leg begins and ends anywhere within a distance of its waypoints: it is inside the convex hull of two discs. What
is in the hull may be flown through. A corner that is cut is left on its inner side only.
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
from cgla_graph.airspace.flight_plans.simultaneous_areas import HeightOverlap, NearAreas

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
    required: float = 0.0,
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
    required
        Distance to be kept, map units: areas within it are compared with elevations.

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
    tree = shapely.STRtree(shapes)
    trees = _Trees(shapes, tree, heights)
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
            met = tuple(
                number for number in near if heights is None or len(heights.on_leg(leg, number, float(widest[leg])))
            )
        yield WideLeg(leg, met, trees.distance(leg, hull, required, float(widest[leg])))


def cut_corners(
    route: FloatArray,
    areas: Sequence[ClosedArea],
    cuts: Sequence[float],
    reaches: Sequence[float] = (),
    *,
    rounding: float = 0.0,
    heights: HeightOverlap | None = None,
) -> Iterator[tuple[int, tuple[int, ...]]]:
    """
    Yield the legs that may reach into an area because the corner before them is cut, and the numbers of these areas.

    The aircraft flies straight to a waypoint until it is within some distance of it, and from there straight, or along
    the leg, to the next one. So it is in the convex hull of the waypoint, the next one, and the places where it may
    have come within that distance.

    Parameters
    ----------
    route, areas, rounding, heights
        As in `wide_legs`.
    cuts
        The distance from each waypoint at which the corner may be cut, map units; empty if none is.
    reaches
        As in `wide_legs`: legs to and from these are reported there.

    Examples
    --------
    >>> corner = ClosedArea("inside of the corner", shapely.box(-9.0, 0.0, -0.0, 9.0))
    >>> route = np.array([(-9.0, -1.0), (1.0, -1.0), (1.0, 9.0)])
    >>> [list(cut_corners(route, [corner], [0.0, cut, 0.0])) for cut in (1.0, 3.0)]
    [[], [(1, (0,))]]
    """
    numbers = [number for number in range(1, min(len(cuts), len(route) - 1)) if cuts[number] > 0.0]
    if not numbers or not areas:
        return
    shapes = np.array([one.shape for one in areas], dtype=object)
    tree = shapely.STRtree(shapes)
    lines = shapely.linestrings(np.stack([route[numbers], route[[number + 1 for number in numbers]]], axis=1))
    radii = 1.01 * np.array([cuts[number] for number in numbers])
    close = set(tree.query(lines, predicate="dwithin", distance=radii)[0].tolist())
    for number in (numbers[index] for index in sorted(close)):
        hull = _cut(route, number, cuts, reaches)
        near = [area for area in sorted(tree.query(hull).tolist()) if _overlap(hull, shapes[area])]
        inner = shapely.buffer(hull, -rounding) if near and rounding > 0.0 else hull
        near = [area for area in near if _overlap(inner, shapes[area])]
        met = tuple(area for area in near if heights is None or len(heights.on_leg(number, area, cuts[number])))
        if met:
            yield number, met


def _cut(route: FloatArray, number: int, cuts: Sequence[float], reaches: Sequence[float]) -> BaseGeometry:
    """Return a polygon around all places that are flown through from a corner that is cut to the next waypoint."""
    here, cut = route[number], cuts[number]
    came = here - route[number - 1]
    length = float(np.hypot(*came))
    before = max(cuts[number - 1], reaches[number - 1] if len(reaches) else 0.0)
    if length <= 2.0 * max(cut, before) or (len(reaches) and reaches[number - 1] > 0.0):
        # it may come from any side
        around = shapely.get_coordinates(_disc(here, cut))
    else:
        # it comes along a line that may have left the corner before at up to that distance, on one side of it
        turn = math.asin(before / length) if before > 0.0 else 0.0
        x, y = (route[number - 1] - route[max(number - 2, 0)]).tolist()
        side = float(x * came[1] - y * came[0])
        back = math.atan2(-came[1], -came[0])
        turns = [0.0, math.copysign(turn, -side)] if abs(side) > 1e-3 * length * cut else [-turn, turn]
        middle = 0.5 * (turns[0] + turns[1])
        far = cut / math.cos(0.5 * (turns[1] - turns[0]))
        corners = [(back + one, cut) for one in turns] + [(back + middle, far)]
        around = np.array([here + radius * np.array([math.cos(one), math.sin(one)]) for one, radius in corners])
    return shapely.convex_hull(shapely.MultiPoint(np.vstack([around, here, route[number + 1]])))


class _Trees:
    """Areas that may count on a leg, looked up by their distance."""

    def __init__(self, shapes: np.ndarray[Any, Any], tree: shapely.STRtree, heights: HeightOverlap | None) -> None:
        self.shapes = shapes
        self.kinds = None if heights is None else heights.kinds()
        self.near = None if heights is None else NearAreas(shapes, tree, heights)
        self.trees: dict[int, shapely.STRtree] = {}

    def distance(self, leg: int, shape: BaseGeometry, required: float = 0.0, reach: float = 0.0) -> float:
        """Return the distance of a shape from the areas that count on a leg, within what is required at its heights."""
        kind = 0 if self.kinds is None else int(self.kinds[0][leg])
        if kind not in self.trees:
            counts = slice(None) if self.kinds is None else self.kinds[1][kind]
            self.trees[kind] = shapely.STRtree(self.shapes[counts])
        nearest, distances = self.trees[kind].query_nearest(shape, return_distance=True, all_matches=False)
        away = float(distances[0]) if len(nearest) else math.inf
        if away >= required or self.near is None or self.kinds is None:
            return away
        return self.near.distance(leg, shape, self.kinds[1][kind], required, reach)


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
