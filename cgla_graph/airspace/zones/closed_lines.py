"""Lines of files of zones: what a closed one encloses, and how points and lines are listed."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import shapely
from shapely.geometry import Polygon

from cgla_graph.airspace.zones.rings import polygon_of
from cgla_graph.airspace.zones.shapes import ring_of
from cgla_graph.airspace.zones.zone import Layer, NoArea
from cgla_graph.errors import FileFormatError

#: Distance of the ends of a closed line, degrees, at most.
SAME = 1e-6
HULL = "a closed line crosses itself too often: its convex hull is closed"


def enclosed(positions: list[Any], where: str, *, is_ring: bool = False) -> Layer | None:
    """
    Return what a line encloses; None if its ends differ, or it encloses nothing.

    Parameters
    ----------
    positions
        Lists of longitude and latitude, degrees, and possibly heights.
    where
        Name of the line in errors.
    is_ring
        Whether the line goes back to its first position in any case.

    Examples
    --------
    >>> enclosed([[6, 49], [7, 49], [7, 50], [6, 49]], "a line").area.area
    0.5
    >>> enclosed([[6, 49], [7, 49], [7, 50]], "a line")
    """
    try:
        if not is_ring:
            apart = np.abs(np.subtract(positions[-1][:2], positions[0][:2]))
            if min(apart[0], abs(360.0 - apart[0])) > SAME or apart[1] > SAME:
                return None
            positions = [*positions[:-1], positions[0]]
        ring = ring_of(positions, where, closed=False)
    except FileFormatError:
        # (lines of other kinds may have any coordinates: they close nothing)
        return None
    try:
        area, remark = polygon_of([ring], where)
    except FileFormatError:
        hull = shapely.convex_hull(shapely.LineString(ring))
        return Layer(hull, remark=HULL) if isinstance(hull, Polygon) else None
    return Layer(area, remark=remark)


def no_areas(label: str, lines: Iterable[tuple[str, Layer | None]], file: str, message: str = "") -> list[NoArea]:
    """
    Return what the points and lines of one feature are, and what closed ones enclose.

    Parameters
    ----------
    label, file, message
        As in a `NoArea`.
    lines
        Kind of each, and what it encloses.

    Examples
    --------
    >>> [one.reason for one in no_areas("road", [("LineString", None), ("LineString", None)], "zones.kml")]
    ['a LineString, not an area']
    """
    found: dict[str, list[Layer]] = {}
    for kind, layer in lines:
        reason = f"a {kind}, not an area" if layer is None else f"a closed {kind}, not an area"
        found.setdefault(reason, []).extend([] if layer is None else [layer])
    return [NoArea(label, reason, file, tuple(layers), message) for reason, layers in found.items()]
