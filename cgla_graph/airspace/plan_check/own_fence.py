"""The fence of a plan as areas that no leg may cross: exclusions, and the outside of inclusions."""

from typing import Final

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea
from cgla_graph.airspace.flight_plans.fence import Fence, FenceShape
from cgla_graph.airspace.zones.shapes import circle_of, ring_of
from cgla_graph.errors import PlanError
from cgla_graph.model.earth import LocalProjection, project_area

#: Polygons around circles reach beyond them by less than this ratio.
_BEYOND: Final = 1.002


def fence_area(fence: Fence, projection: LocalProjection, reach: Bounds) -> ClosedArea | None:
    """
    Return the area that one rule of a fence closes on a map; None if it closes nothing there.

    Parameters
    ----------
    fence
        The rule.
    projection
        Projection of the map.
    reach
        Bounds within which the outside of an inclusion is needed, map units.

    Raises
    ------
    PlanError
        If an outline of the fence crosses itself, or is not valid on the Earth.

    Examples
    --------
    >>> inside = Fence("inclusion 1", True, (FenceShape(((24.0, 60.0),), 500.0),))
    >>> area = fence_area(inside, LocalProjection(24.0, 60.0), (-2000.0, -2000.0, 2000.0, 2000.0))
    >>> round((16e6 - area.shape.area) / 500.0**2, 2)
    3.13
    """
    shapes = shapely.union_all([_shape(one, fence, projection) for one in fence.shapes])
    if not fence.inclusion:
        return ClosedArea(fence.name, shapes)
    outside = shapely.difference(shapely.box(*reach), shapes)
    return None if outside.is_empty else ClosedArea(f"the outside of {fence.name}", outside, is_outside=True)


def _shape(shape: FenceShape, fence: Fence, projection: LocalProjection) -> BaseGeometry:
    """Return a shape on the map, a circle as a polygon: inside of it for an inclusion, around it for an exclusion."""
    if shape.is_circle:
        radius = shape.radius / _BEYOND if fence.inclusion else shape.radius
        return project_area(circle_of(list(shape.corners[0]), radius, fence.name, ("center", "radius")), projection)
    area = shapely.Polygon(ring_of([list(corner) for corner in shape.corners], fence.name, closed=False))
    if not area.is_valid or area.area == 0.0:
        remedy = "draw an outline that encloses an area and does not cross itself"
        msg = f"{fence.name}: {shapely.is_valid_reason(area)}; {remedy}"
        raise PlanError(msg)
    return project_area(area, projection)
