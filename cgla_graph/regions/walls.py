"""
Which places on the border of a cell a no-fly area separates from each other inside of the cell.

A path inside of a cell stays in one part of what the area leaves of it. Values need not keep to a length between
intervals of the border of which no part meets both (`bound`). Parts are enlarged: areas count as narrower by `within`,
parts as near to each other are one part, and so is an interval as near to a part.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.regions.arrangement import Arrangement

#: Areas are made narrower by this part of the greatest coordinate at least: more than the rounding of overlays.
LEAST = 1e-11
#: Corners are those of at most 150 degrees: the sum of the directions of their sides is longer than this.
SHARP = 0.5


@dataclass(frozen=True, eq=False)
class Walls:
    """
    The free parts of cells that an area cuts.

    Attributes
    ----------
    places
        Row and column of each cell, shape ``(n, 2)``.
    parts
        The free parts of each.
    within
        How near parts and intervals count as one, map units.
    """

    places: IntArray
    parts: Sequence[Sequence[BaseGeometry]]
    within: float

    @classmethod
    def of(cls, cells: Arrangement, cut: BoolArray, area: NoFlyArea, apart: float) -> "Walls":
        """
        Find the free parts of some cells.

        Parameters
        ----------
        cells
            All cells.
        cut
            Those in which the outline of the area may be, shape ``(rows, columns)``.
        area
            The no-fly area.
        apart
            How far rounding may move places, map units.

        Examples
        --------
        >>> lines = np.arange(2.0)
        >>> cells = Arrangement.laid(lines, lines, np.ones((1, 1)))
        >>> wall = NoFlyArea(shapely.box(0.4, -1.0, 0.6, 2.0))
        >>> [len(parts) for parts in Walls.of(cells, np.ones((1, 1), dtype=np.bool_), wall, 1e-9).parts]
        [2]
        """
        places = np.argwhere(cut & np.isfinite(cells.costs))
        row, column = places.T
        boxes = shapely.box(cells.x[column], cells.y[row], cells.x[column + 1], cells.y[row + 1])
        reach = max(map(abs, (*area.geometry.bounds, *cells.x[[0, -1]].tolist(), *cells.y[[0, -1]].tolist())))
        within = 2.0 * apart + LEAST * reach
        narrow = shapely.buffer(area.geometry, -within, join_style="mitre")
        # (pieces of the area beside the cell are few)
        pieces = shapely.get_parts(narrow)
        one, piece = shapely.STRtree(pieces).query(boxes, "intersects") if len(pieces) else np.empty((2, 0), np.int64)
        free: list[NDArray[np.object_]] = [np.array([box]) for box in boxes]
        for number, other in zip(one.tolist(), pieces[piece].tolist(), strict=True):
            free[number] = shapely.get_parts(shapely.difference(free[number], other))
        return cls(places, [_joined(parts, within) for parts in free], within)

    def separated(self, number: int, points: FloatArray, intervals: IntArray) -> BoolArray | None:
        """
        Tell which points on the border of a cell are separated inside of it; None if none are.

        Parameters
        ----------
        number
            Of the cell.
        points
            All points on its border, shape ``(n, 2)``, map units.
        intervals
            Those between them, rows ``(first point, last point, ...)``.

        Returns
        -------
        separated
            True where no part meets an interval of one point and an interval of the other, shape ``(n, n)``.
        """
        ends = intervals[:, :2]
        lines = shapely.linestrings(points[ends])
        meets = np.zeros((len(self.parts[number]), len(ends)), dtype=np.bool_)
        for part, row in zip(self.parts[number], meets, strict=True):
            row[:] = shapely.dwithin(lines, part, self.within)
        if meets.all(axis=-1).any():
            return None
        # (a point meets what its intervals meet)
        near = np.zeros((len(meets), len(points)), dtype=np.bool_)
        for column in ends.T:
            np.logical_or.at(near.T, column, meets.T)
        return np.asarray(~(near[:, :, None] & near[:, None, :]).any(axis=0))


def tips(area: NoFlyArea, depth: float, near: BaseGeometry, most: int) -> FloatArray:
    """
    Return places just inside of the corners of an area around which paths bend, those nearest to some line first.

    With lines of cells through them, no cell has free places on both sides of a corner, but for `depth`.

    Parameters
    ----------
    area
        The no-fly area.
    depth
        How far inside they are, map units.
    near
        The line.
    most
        How many there are, at most.

    Returns
    -------
    places
        Shape ``(n, 2)``, map units.

    Examples
    --------
    >>> box = NoFlyArea(shapely.box(0.0, 0.0, 1.0, 1.0))
    >>> tips(box, 0.1, shapely.Point(2.0, 2.0), 1).round(3).tolist()
    [[0.929, 0.929]]
    """
    at, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(area.geometry)), return_index=True)
    found = [np.empty((0, 2))]
    for number in np.unique(ring):
        corners = at[ring == number][:-1]
        ways = [np.roll(corners, by, axis=0) - corners for by in (1, -1)]
        sizes = [np.hypot(*way.T)[:, None] for way in ways]
        bisector = sum(way / size for way, size in zip(ways, sizes, strict=True))
        sharp = np.hypot(*bisector.T)[:, None]
        step = np.minimum(depth, 0.25 * np.minimum(*sizes)) / np.where(sharp > SHARP, sharp, math.inf)
        found.append((corners + step * bisector)[sharp[:, 0] > SHARP])
    inside = np.concatenate(found)
    inside = inside[area.contains(inside)]
    nearest = np.argsort(shapely.distance(shapely.points(inside), near), kind="stable")[:most]
    return np.asarray(inside[nearest])


def _joined(parts: NDArray[np.object_], within: float) -> list[BaseGeometry]:
    """Join parts that nearly meet, and drop what is empty."""
    groups: list[BaseGeometry] = []
    for part in parts.tolist():
        if shapely.is_empty(part):
            continue
        near = [bool(shapely.dwithin(part, other, within)) for other in groups]
        joined = [part, *(other for other, is_near in zip(groups, near, strict=True) if is_near)]
        groups = [other for other, is_near in zip(groups, near, strict=True) if not is_near]
        groups.append(shapely.geometrycollections(joined) if len(joined) > 1 else part)
    for group in groups:
        shapely.prepare(group)
    return groups
