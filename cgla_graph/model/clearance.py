"""
No-fly areas on a map: widened by a clearance, and joined with the outside where they meet the border of the map.

The border is no passage, as areas at the border of a map commonly go on outside. A path may run along the free border,
and it may pass between two areas that meet in a point inside the map. It may not pass between an area and the border
where they meet, be it in a point, or where the gap is below `GAP` of the map's longer side. So an area's side on the
border is closed. A path may begin and end at the two ends of such a side, unless they are at a corner of the map or
another area meets the border there. This is a rule of maps: a `NoFlyArea` alone knows no border.
"""

import math
from collections.abc import Sequence
from functools import lru_cache
from typing import Final, NamedTuple, cast

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import GeometryCollection, MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, Bounds, FloatArray, Point
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly import NoFlyArea, checked_union, edges_of, overlay_errors

#: Round corners become polygons with this many edges a right angle: 0.12 % wider than the arc, at most.
EDGES: Final = 16
#: A path may miss its clearance by this part of the map's longer side, for rounding.
ROUNDING: Final = 1e-9
#: How often the distance is halved for an area that a place is too near to; after that, the area is not widened.
HALVINGS: Final = 10
#: Narrower gaps between an area and the border are closed: a part of the map's longer side.
GAP: Final = 1e-9
#: The least gap, in units in the last place of the bounds.
ULPS: Final = 8.0
#: How deep a box over a stretch reaches into the map, beside two gaps, in such units.
DEPTH: Final = 64.0
#: Where an area meets the border, it goes on outside for this part of the map's longer side.
REACH: Final = 0.1
#: Along shorter stretches, in gaps, an outline may only cross the border.
SHORT: Final = 1e3
#: Shapely's number of polygons; those of collections are greater.
POLYGON: Final = 3
#: Areas that are found without computing them again.
RECENT: Final = 4


@lru_cache(maxsize=16)
def widened(no_fly: BaseGeometry, distance: float, *, inside: bool = False) -> BaseGeometry:
    """
    Widen areas by a distance: round corners become polygons around the true arcs, or inside them.

    With polygons around the arcs, a path outside the widened areas is at least the distance away from the areas. With
    polygons inside the arcs, a path that is at least the distance away is outside the widened areas, so that a bound
    for all paths outside holds for it.

    Parameters
    ----------
    no_fly
        The areas.
    distance
        Map units, above 0.
    inside
        Whether the polygons are inside the arcs.

    Examples
    --------
    >>> box = shapely.box(0, 0, 1, 1)
    >>> more, less = widened(box, 0.5), widened(box, 0.5, inside=True)
    >>> true = 1 + 4 * 0.5 + math.pi / 4
    >>> bool(0.99 * true < less.area < true < more.area < 1.01 * true)
    True
    """
    area = NoFlyArea(no_fly)
    if area.is_empty:
        return area.geometry
    radius = distance if inside else distance / math.cos(0.25 * math.pi / EDGES)
    # one piece an edge: a polygon as a whole would be simplified first, and be widened by a little more or less
    with overlay_errors():
        pieces = shapely.buffer(shapely.linestrings(area.edges[:, :4].reshape(-1, 2, 2)), radius, quad_segs=EDGES)
        return shapely.union_all([area.geometry, *np.asarray(pieces, dtype=object)])


def widened_clear_of(no_fly: BaseGeometry, distance: float, place: Point) -> BaseGeometry:
    """
    Widen areas as `widened` does, but none so far that it covers a given place.

    An area that would cover the place is widened by half the distance, or a quarter, …: the greatest of these that
    leaves the place outside. So a path outside is at least about half as far from the area as the place is. The
    distance is halved, and not cut to reach just up to the place, because two such areas would leave no way out.

    Parameters
    ----------
    no_fly
        The areas; those that overlap are one.
    distance
        Map units, above 0.
    place
        A point outside all areas; an area that contains it is not widened.

    Examples
    --------
    >>> near, far = shapely.box(0, 0, 1, 1), shapely.box(5, 0, 6, 1)
    >>> wide = widened_clear_of(shapely.MultiPolygon([near, far]), 0.5, (1.3, 0.5))
    >>> [round(side, 2) for side in wide.bounds]
    [-0.25, -0.5, 6.5, 1.5]
    """
    parts = shapely.get_parts(NoFlyArea(no_fly).geometry)
    return shapely.union_all([_clear_of(part, distance, place) for part in parts])


def _clear_of(area: BaseGeometry, distance: float, place: Point) -> BaseGeometry:
    for halvings in range(HALVINGS + 1):
        wide = widened(area, 0.5**halvings * distance)
        if not NoFlyArea(wide).contains(place):
            return wide
    return area


def closed_area(no_fly: BaseGeometry | None, bounds: Bounds, clearance: float = 0.0) -> BaseGeometry | None:
    """
    Widen areas by a clearance, and join them with the outside where they then meet the border of the map.

    Parameters
    ----------
    no_fly
        The areas, map units.
    bounds
        ``(x_min, y_min, x_max, y_max)``, map units.
    clearance
        Least distance of paths from the areas, map units.

    Returns
    -------
    area
        The areas that no path may cross. Without clearance, areas that do not meet the border are returned as they
        are, the same object.

    Raises
    ------
    ProblemError
        As `NoFlyArea`, if areas meet the border or are widened.

    Examples
    --------
    >>> wall = closed_area(shapely.box(0.4, 0.0, 0.6, 1.0), (0, 0, 1, 1))
    >>> [round(side, 3) for side in wall.bounds]
    [0.4, -0.1, 0.6, 1.1]
    >>> apart = shapely.box(0.4, 0.1, 0.6, 0.9)
    >>> closed_area(apart, (0, 0, 1, 1)) is apart
    True
    """
    global _recent  # noqa: PLW0603 - a cache
    # (areas are found by identity: hashing thousands of polygons takes milliseconds)
    for known, *how, closed in _recent:
        if known is no_fly and how == [bounds, clearance]:
            return closed
    if no_fly is None or not isinstance(cast("object", no_fly), BaseGeometry):
        return no_fly
    wide = joined_with(widened(no_fly, clearance), stretches(no_fly, bounds, clearance)) if clearance > 0.0 else no_fly
    closed = joined_with(wide, stretches(wide, bounds))
    _recent = ((no_fly, bounds, clearance, closed), *_recent[: RECENT - 1])
    return closed


#: The areas that were asked for last, with bounds and clearance, and the answers.
_recent: tuple[tuple[BaseGeometry | None, Bounds, float, BaseGeometry | None], ...] = ()


def on_closed_border(name: str, where: object, area: str = "the no-fly area") -> str:
    """
    Return the message on a place that is refused because an area closes the border of the map there.

    Examples
    --------
    >>> on_closed_border("start", (0, 0)).partition("; ")[0]
    "start (0, 0) is where the no-fly area meets the border of the map, and the area's side there is closed"
    """
    return (
        f"{name} {where} is where {area} meets the border of the map, and the area's side there is closed; move it off "
        "that side, or widen the bounds so that paths can pass between them"
    )


def widest_gap(bounds: Bounds) -> float:
    """
    Return the width up to which a gap between an area and the border is closed, map units.

    Examples
    --------
    >>> widest_gap((0.0, 0.0, 2.0, 1.0))
    2e-09
    """
    longer = max(bounds[2] - bounds[0], bounds[3] - bounds[1])
    return max(GAP * longer, ULPS * float(np.spacing(np.abs(bounds).max())))


def stretches(
    no_fly: BaseGeometry, bounds: Bounds, clearance: float = 0.0, reach: float | None = None
) -> list[Polygon]:
    """
    Return where areas close the border of the map: boxes around those stretches, from just inside the map to outside.

    Parameters
    ----------
    no_fly
        The areas, map units.
    bounds
        ``(x_min, y_min, x_max, y_max)``, map units.
    clearance
        The areas close stretches at this distance, map units: a passage there has no width either.
    reach
        How far the boxes reach outside, map units; None for a tenth of the map's longer side.

    Raises
    ------
    ProblemError
        As `NoFlyArea`, if areas meet the border.

    Examples
    --------
    >>> tip = shapely.Polygon([(0.4, 0.5), (0.6, 0.5), (0.5, 1.0)])
    >>> [bool(shapely.contains_properly(box, shapely.Point(0.5, 1.0))) for box in stretches(tip, (0, 0, 1, 1))]
    [True]
    >>> stretches(tip, (0, 0, 2, 2))
    []
    """
    gap = widest_gap(bounds)
    reach = REACH * max(bounds[2] - bounds[0], bounds[3] - bounds[1]) if reach is None else reach
    lines = [(side, at) for side, to in enumerate(bounds) for at in sorted({to - clearance, to + clearance})]
    corners = shapely.get_coordinates(no_fly)
    if not any((np.abs(corners[:, side % 2] - at) < gap).any() for side, at in lines):
        return []
    polygons = _polygons(no_fly)
    boxes = shapely.bounds(polygons)
    near = np.any([(boxes[:, n % 2] <= at + gap) & (boxes[:, n % 2 + 2] >= at - gap) for n, at in lines], axis=0)
    try:
        whole = checked_union(_gathered(polygons[near], no_fly))
    except ProblemError:
        # the same error is raised for the whole area, with the number of the part
        return []
    edges = edges_of(whole)[:, :4].reshape(-1, 2, 2)
    found = []
    for number, at in lines:
        along = 1 - number % 2
        side = _Side(number, at, gap, (bounds[along], bounds[along + 2]))
        across, places = side.near(edges)
        if clearance > 0.0:
            found += side.boxes(side.within(across, places), bounds[number], reach)
            continue
        flat = side.is_flat(across, places)
        sides = _merged(np.sort(places[flat], axis=1))
        found += side.prolonged(sides, across[~flat], places[~flat], reach)
        # areas outside that touch the border
        outer = (across == 0.0).all(axis=1) & ~flat
        found += side.boxes(side.within(across[outer], places[outer]), at, reach)
        found += side.tips(across, places, reach)
        is_done = (across == 0.0) & (_holds(sides, places) | (across[:, ::-1] * -side.outward > 0.0))
        rest = ((np.abs(across) < gap) & ~is_done).any(axis=1) & ~flat
        found += side.boxes(side.open(side.within(across[rest], places[rest]), whole), at, reach)
    return found


class _Side(NamedTuple):
    """
    A line along one side of the map, and the gap up to which areas meet it.

    Attributes
    ----------
    number
        Of the side: left, lower, right, upper.
    at
        Where the line is, map units.
    gap
        Map units.
    limits
        Where the side begins and ends, map units.
    """

    number: int
    at: float
    gap: float
    limits: tuple[float, float]

    @property
    def outward(self) -> float:
        return 1.0 if self.number >= 2 else -1.0  # noqa: PLR2004 - right and upper side

    def near(self, edges: FloatArray) -> tuple[FloatArray, FloatArray]:
        """Return the edges with an end within the gap: distances from the line and places along it, ``(n, 2)`` each."""
        axis, (low, high) = self.number % 2, self.limits
        across, places = edges[:, :, axis] - self.at, edges[:, :, 1 - axis]
        near = (np.abs(across) < self.gap).any(axis=1)
        near &= (places.max(axis=1) >= low - self.gap) & (places.min(axis=1) <= high + self.gap)
        return across[near], places[near]

    def is_flat(self, across: FloatArray, places: FloatArray) -> BoolArray:
        """Return which edges lie on the line and border an area inside the map."""
        # the area is on the left of an edge
        to_inside = np.sign(places[:, 1] - places[:, 0]) * (1.0 if self.number % 2 else -1.0) == -self.outward
        return np.asarray((across == 0.0).all(axis=1) & to_inside)

    def tips(self, across: FloatArray, places: FloatArray, reach: float) -> list[Polygon]:
        """
        Close the places on the line where areas leave more than one way into the map free.

        A path that goes from one to another there would pass between an area and the border. At the end of a stretch
        that an area closes, one way is left, unless another area meets the border there too.
        """
        edge, tip = np.nonzero((across == 0.0) & (across[:, ::-1] * -self.outward > 0.0))
        place, steps = places[edge, tip], np.column_stack([places[edge, 1 - tip], across[edge, 1 - tip]])
        steps[:, 0] -= place
        ahead = steps[:, 0] / np.abs(steps[:, 1])
        (low, high), corner = self.limits, np.zeros(len(place))
        corner[place == low], corner[place == high] = 1.0, -1.0
        kept = (place >= low) & (place <= high) & (corner * ahead >= 0.0)
        # whether the area is on the edge's side of lesser places (it is on the left of an edge)
        is_before = (tip == 0) == (self.number in {1, 2})
        # of edges that rounding makes equal, the first counts as free before it, so that the place is closed
        order = np.lexsort([~is_before, -ahead, place])
        order = order[kept[order]]
        tips = np.split(order, np.flatnonzero(np.diff(place[order])) + 1) if len(order) else []
        return [
            self._star(float(place[some[0]]), steps[some], reach)
            for some in tips
            # of the edges, areas and ways free take turns; an area beside the border has only one edge here
            if len(some) > (not is_before[some[0]]) + is_before[some[-1]]
        ]

    def _star(self, place: float, steps: FloatArray, reach: float) -> Polygon:
        """Lay a polygon over a place on the line, with corners on the edges from there, which thus stay in place."""
        depth = self._depth(self.at)
        # (where coordinates have few digits, these corners are exact)
        shares = 0.5 ** np.maximum(np.floor(np.log2(np.abs(steps[:, 1]) / depth)), 0.0)
        inner = (shares[:, None] * steps).tolist()
        low, high = place <= self.limits[0], place >= self.limits[1]
        left, right = -(reach if low else self.gap), reach if high else self.gap
        if inner[0][0] * depth < right * abs(inner[0][1]):
            inner.insert(0, [right, -self.outward * depth])
        if inner[-1][0] * depth > left * abs(inner[-1][1]):
            inner.append([left, -self.outward * depth])
        ring = [[right, self.outward * reach], *inner, [left, self.outward * reach]]
        corners = np.add(ring, (place, self.at))
        return Polygon(corners if self.number % 2 else corners[:, ::-1])

    def within(self, across: FloatArray, places: FloatArray) -> FloatArray:
        """Return the stretches along which edges are within the gap, at least two gaps wide, shape ``(m, 2)``."""
        gap, (low, high) = self.gap, self.limits
        # each end is moved along its edge until it is within the gap
        into = np.clip(across, -gap, gap) - across
        with np.errstate(all="ignore"):
            share = np.where(into == 0.0, 0.0, into / (across[:, ::-1] - across))
        ends = np.sort(places + share * (places[:, ::-1] - places), axis=1)
        ends = _merged(np.clip(ends[(ends[:, 1] >= low - gap) & (ends[:, 0] <= high + gap)], low, high))
        narrow = ends[:, 1] - ends[:, 0] < 2.0 * gap
        ends[narrow] = 0.5 * ends[narrow].sum(axis=1, keepdims=True) + (-gap, gap)
        return ends

    def open(self, ends: FloatArray, whole: MultiPolygon | Polygon) -> FloatArray:
        """Keep the stretches that the area itself leaves open, so that no outline just crosses the line there."""
        if not len(ends):
            return ends
        shapely.prepare(whole)
        # a short one is looked at on both sides, a long one at both ends: if it ends beyond the line, by less than the
        # gap, the area covers both
        is_short = ends[:, 1] - ends[:, 0] < SHORT * self.gap
        beyond = np.where(is_short, self.gap, -self.gap)
        places = np.concatenate([ends[:, 0] - beyond, ends[:, 1] + beyond])
        line = np.full(len(places), self.at)
        points = np.column_stack([line, places] if self.number % 2 == 0 else [places, line])
        first, last = shapely.contains_properly(whole, shapely.points(points)).reshape(2, -1)
        return ends[~np.where(is_short, first | last, first != last)]

    def prolonged(self, ends: FloatArray, across: FloatArray, places: FloatArray, reach: float) -> list[Polygon]:
        """Prolong the area outwards from where it lies on the line, in the directions of its edges beside."""
        found = []
        for begin, end in ends.tolist():
            outer = [begin, end]
            for which, place in enumerate((begin, end)):
                edge, tip = np.nonzero((across == 0.0) & (places == place))
                inward = -self.outward * across[edge, 1 - tip]
                slopes = np.clip((place - places[edge, 1 - tip])[inward > 0.0] / inward[inward > 0.0], -1.0, 1.0)
                if len(slopes):
                    # (other edges there are those of other areas)
                    outer[which] += reach * float(slopes.max() if which else slopes.min())
            middle = 0.5 * (begin + end)
            outer = [min(outer[0], middle), max(outer[1], middle)]
            found += [
                self._across((begin, end), (outer[0], outer[1]), (self.at, self.at + self.outward * reach), reach)
            ]
        return found

    def boxes(self, ends: FloatArray, border: float, reach: float) -> list[Polygon]:
        """Lay boxes over stretches of the border, from some gaps inside the map to outside."""
        inner = border - self.outward * self._depth(border)
        found = []
        for begin, end in ends.tolist():
            found.append(self._across((begin, end), (begin, end), (inner, border + self.outward * reach), reach))
        return found

    def _depth(self, border: float) -> float:
        """Return how deep polygons that close a place reach into the map, map units."""
        # (so deep that tips are wider there than coordinates are apart)
        # (and, at a distance, that polygons inside round corners reach the box)
        spacing = float(np.spacing(abs(border) + abs(self.limits[1])))
        return 2.0 * self.gap + 0.01 * abs(border - self.at) + DEPTH * spacing

    def _across(
        self, near: tuple[float, float], far: tuple[float, float], levels: tuple[float, float], more: float
    ) -> Polygon:
        """Return a polygon with two sides along the line; if it ends at a corner of the map, it goes on beyond that."""
        low, high = near[0] <= self.limits[0] + self.gap, near[1] >= self.limits[1] - self.gap
        first, last = self.limits[0] - more, self.limits[1] + more
        ring = [
            (first if low else near[0], levels[0]),
            (last if high else near[1], levels[0]),
            (last if high else far[1], levels[1]),
            (first if low else far[0], levels[1]),
        ]
        return Polygon(ring if self.number % 2 else [(across, along) for along, across in ring])


def _holds(sides: FloatArray, places: FloatArray) -> BoolArray:
    """Return whether places are on one of some disjoint, sorted intervals."""
    if not len(sides):
        return np.zeros(places.shape, dtype=bool)
    number = np.maximum(np.searchsorted(sides[:, 0], places, side="right") - 1, 0)
    return np.asarray((places >= sides[number, 0]) & (places <= sides[number, 1]))


def _merged(ends: FloatArray) -> FloatArray:
    """Join intervals that overlap or touch."""
    if not len(ends):
        return ends
    ends = ends[np.argsort(ends[:, 0], kind="stable")]
    reach = np.maximum.accumulate(ends[:, 1])
    opens = np.append(True, ends[1:, 0] > reach[:-1])
    return np.column_stack([ends[opens, 0], reach[np.append(opens[1:], True)]])


def joined_with(no_fly: BaseGeometry, boxes: list[Polygon]) -> BaseGeometry:
    """
    Join areas with boxes; areas that meet none stay as they are, to the last bit.

    Examples
    --------
    >>> joined_with(shapely.box(0, 0, 1, 1), [shapely.box(0, 1, 1, 2)]).area
    2.0
    """
    if not boxes:
        return no_fly
    parts = _polygons(no_fly)
    beside = np.zeros(len(parts), dtype=bool)
    beside[shapely.STRtree(parts).query(np.asarray(boxes, dtype=object), predicate="intersects")[1]] = True
    try:
        before = checked_union(_gathered(parts[beside], no_fly))
    except ProblemError:
        # (as in `stretches`)
        return no_fly
    with overlay_errors():
        united = shapely.union(before, shapely.union_all(boxes))
    rest = parts[~beside]
    whole = _gathered([*rest, *shapely.get_parts(united)], no_fly)
    may_overlap = isinstance(whole, MultiPolygon) and bool(shapely.intersects(united, rest).any())
    if not may_overlap or whole.is_valid:
        return whole
    if not shapely.is_valid(rest).all():
        # (as in `stretches`)
        return no_fly
    with overlay_errors():
        return shapely.union_all(shapely.get_parts(whole))


def _gathered(polygons: Sequence[Polygon] | NDArray[np.object_], like: BaseGeometry) -> BaseGeometry:
    """Gather polygons: if those of `like` may overlap, in a collection, else in a multipolygon."""
    parts = list(polygons)
    # (other geometries are refused with the whole area)
    is_flat = not isinstance(like, GeometryCollection) and all(isinstance(part, Polygon) for part in parts)
    return MultiPolygon(parts) if is_flat else GeometryCollection(parts)


def _polygons(geometry: BaseGeometry) -> NDArray[np.object_]:
    """Return the polygons of a geometry, flat."""
    parts = shapely.get_parts(shapely.force_2d(geometry))
    while (shapely.get_num_geometries(parts) > 1).any() or shapely.get_type_id(parts).max(initial=0) > POLYGON:
        parts = shapely.get_parts(parts)
    return np.asarray(parts, dtype=object)
