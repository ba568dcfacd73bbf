"""Corners of areas: a shortest path around them bends nowhere else."""

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import FloatArray


def convex_corners(geometry: BaseGeometry, *, straight: float = 0.0) -> FloatArray:
    """
    Return the corners of polygons that a shortest path around them may bend in (Lozano-Perez and Wesley 1979).

    Parameters
    ----------
    geometry
        Polygons, with or without holes; of a hole, the corners that reach into it.
    straight
        Corners that turn in by less than this, radians, count as turning out.

    Returns
    -------
    corners
        Shape ``(c, 2)``, map units, each once, by x and then y.

    Examples
    --------
    >>> ell = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
    >>> convex_corners(ell).tolist()
    [[0.0, 0.0], [0.0, 2.0], [1.0, 2.0], [2.0, 0.0], [2.0, 1.0]]
    """
    corners = [np.empty((0, 2))]
    for ring in shapely.get_rings(shapely.get_parts(shapely.orient_polygons(geometry))):
        around = shapely.get_coordinates(ring)
        # no edge leads nowhere; a closed ring repeats its first point
        around = around[1:][(np.diff(around, axis=0) != 0.0).any(axis=1)]
        back, ahead = around - np.roll(around, 1, axis=0), np.roll(around, -1, axis=0) - around
        # the area is on the left
        turn = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
        corners.append(around[turn > -straight * np.hypot(*back.T) * np.hypot(*ahead.T)])
    return np.unique(np.vstack(corners), axis=0)
