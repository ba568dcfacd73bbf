"""Terrain on a map: the settings in tables, and the closed area on the plane of the map."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import cast

import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, Point
from cgla_graph.airspace.terrain.area import TerrainArea, terrain_area
from cgla_graph.airspace.zones.ground import read_ground
from cgla_graph.airspace.zones.shapes import AreaShape
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import EDGE_METRES, LocalProjection, project_on_map, projected_bounds
from cgla_graph.scenarios.area_tables import NoFlyTable, seen_box, simplified


@dataclass(frozen=True, eq=False)
class MapTerrain:
    """
    Terrain on a map.

    Attributes
    ----------
    area
        Which cells are closed, degrees.
    shape
        The closed area, metres; None if nothing is closed. It reaches a metre beyond its cells, as their edges bend
        when projected, and further where an outline of very many corners is simplified.
    file
        The raster of elevations.
    """

    area: TerrainArea
    shape: BaseGeometry | None
    file: str

    @classmethod
    def of(
        cls,
        table: NoFlyTable,
        folder: Path,
        projection: LocalProjection,
        box: Bounds,
        ends: Sequence[Point],
        homes: Sequence[Point] | None,
        clearance: float,
    ) -> "MapTerrain | None":
        """
        Return the terrain of a table on a map; None if the table has no raster of elevations.

        Parameters
        ----------
        table, folder
            The table, and where relative paths in it start.
        projection, box
            Projection and bounds of the map, the latter in degrees.
        ends
            Starts and goals, metres: one that is outside the cells is outside the simplified area.
        homes
            Places of take-off, degrees; None if they are not known.
        clearance
            Least distance of paths from no-fly areas, metres.

        Raises
        ------
        ProblemError
            If a setting is malformed, or makes no sense without another one.
        FileFormatError
            If the raster cannot be read.
        """
        if table.ground is None:
            if table.terrain_clearance is not None:
                msg = (
                    f"terrain_clearance is {table.terrain_clearance:g}, and there is no raster of elevations; give one "
                    "(no_fly.ground, --ground FILE.tif)"
                )
                raise ProblemError(msg)
            return None
        altitude = table.altitude if table.terrain_altitude is None else table.terrain_altitude
        if altitude is None and table.terrain_clearance is not None:
            msg = (
                f"terrain_clearance is {table.terrain_clearance:g}, and the flight has no altitude; give one "
                "(no_fly.altitude, --altitude M)"
            )
            raise ProblemError(msg)
        bounds = projected_bounds(box, projection)
        ground = read_ground(folder / table.ground)
        seen = seen_box(projection, bounds, clearance)
        area = terrain_area(ground, altitude, seen, clearance=table.terrain_clearance, homes=homes, map_box=box)
        shape = None if area.shape is None else _on_plane(area.shape, seen, projection, bounds, ends, clearance)
        return cls(area, shape, table.ground)

    def require_above(self, name: str, typed: Point, place: Point) -> None:
        """
        Check that a start, goal or place to visit is not in the closed area.

        Raises
        ------
        ProblemError
            If it is; the message repeats the values as written.
        """
        if self.shape is None or not shapely.contains_properly(self.shape, shapely.Point(place)):
            return
        at = self.area.altitude
        lowest = f"{self.area.lowest:.6g} m above the sea" if self.area.lowest is not None else ""
        high = "" if at is None else f"at {at.metres:g} m {at.reference}, {lowest}, "
        msg = (
            f"{name} {typed} is in the terrain of {Path(self.file).name}: a flight {high}is not known to be "
            f"{self.area.clearance:g} m above the ground within a cell of it; fly higher, move it, or give a raster "
            "that has data there"
        )
        raise ProblemError(msg)


def _on_plane(
    area: AreaShape, box: Bounds, projection: LocalProjection, bounds: Bounds, ends: Sequence[Point], clearance: float
) -> BaseGeometry:
    """Return a closed area on the plane of a map, a metre wider, with few corners."""
    exact = project_on_map(area, box, projection)
    wide = cast("BaseGeometry", shapely.buffer(exact, EDGE_METRES, join_style="mitre", mitre_limit=1.5))
    return simplified(wide, bounds, ends, clearance)[0] if isinstance(wide, Polygon | MultiPolygon) else exact
