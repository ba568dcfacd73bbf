"""Safety margins around no-fly areas: areas widened by a distance."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Point
from cgla_graph.model.no_fly import NoFlyArea, overlay_errors

#: Round corners become polygons with this many edges a right angle: 0.12 % wider than the arc, at most.
EDGES: Final = 16
#: A path may miss its clearance by this part of the map's longer side, for rounding.
ROUNDING: Final = 1e-9
#: How often the distance is halved for an area that a place is too near to; after that, the area is not widened.
HALVINGS: Final = 10


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
