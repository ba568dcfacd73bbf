"""Safety margins around no-fly areas: points nearer than a distance are closed as well."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Point
from cgla_graph.model.no_fly import NoFlyArea

#: Round corners become polygons with this many edges a right angle: 0.12 % wider than the arc, at most.
EDGES: Final = 16
#: A path may be nearer than asked for by this part of the map's longer side: rounding.
ROUNDING: Final = 1e-9
#: How often the distance is halved for an area that a place is too near to; after that, its outline counts.
HALVINGS: Final = 10


@lru_cache(maxsize=16)
def widened(no_fly: BaseGeometry, distance: float, *, inside: bool = False) -> BaseGeometry:
    """
    Widen areas by a distance: round corners become polygons around the true arcs, or inside of them.

    A path outside of areas widened around the arcs is at least so far from them. A path that far away is outside of
    areas widened inside of the arcs: a bound for all paths there holds for it.

    Parameters
    ----------
    no_fly
        The areas.
    distance
        Map units, above 0.
    inside
        Which of the two.

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
    pieces = shapely.buffer(shapely.linestrings(area.edges[:, :4].reshape(-1, 2, 2)), radius, quad_segs=EDGES)
    return shapely.union_all([area.geometry, *np.asarray(pieces, dtype=object)])


def widened_clear_of(no_fly: BaseGeometry, distance: float, place: Point) -> BaseGeometry:
    """
    Widen areas as `widened` does, but none so far that it covers a place that is already too near to one.

    An area that would cover it is widened by half the distance, or a quarter, …: by the most of these that leaves the
    place outside. So what keeps out of it is at least about half as far from the area as the place is. By halves, and
    not up to the place itself: between two areas that both reach up to it, there would be no way out.

    Parameters
    ----------
    no_fly
        The areas; those that overlap are one.
    distance
        Map units, above 0.
    place
        Outside of all areas; around one that is inside of an area, that area stays as it is.

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
