"""A safety margin around no-fly areas: what is nearer to them than a distance is closed as well."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph.model.no_fly import NoFlyArea

#: Round corners become polygons with this many edges a right angle: 0.12 % wider than the arc, at most.
EDGES: Final = 16
#: A path may be nearer than asked for by this part of the map's longer side: rounding.
ROUNDING: Final = 1e-9


@lru_cache(maxsize=16)
def widened(no_fly: BaseGeometry, distance: float, *, inside: bool = False) -> BaseGeometry:
    """
    Widen areas by a distance: round corners become polygons around the true arcs, or inside of them.

    What keeps out of the areas that are widened around the arcs is at least so far from them. What is at least so far
    from them keeps out of those that are widened inside of the arcs: what is proven of all paths there holds for it.

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
