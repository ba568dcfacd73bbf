"""Elevations of the ground above mean sea level, from a raster."""

import os
from dataclasses import dataclass

import numpy as np
import shapely

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.airspace.zones.shapes import AreaShape, part_near
from cgla_graph.errors import FileFormatError, ProblemError
from cgla_graph.model.rasters.place import fail, warp
from cgla_graph.model.rasters.reading import read_cells

#: Cells of a raster at most, and cells in the bounds of a zone up to which each is tested against its outline.
MOST_CELLS, MOST_TESTED = 20_000_000, 250_000


@dataclass(frozen=True, eq=False)
class Ground:
    """
    Elevations on a grid of cells.

    Parameters
    ----------
    values
        Metres above mean sea level, shape ``(rows, columns)``, row 0 in the north; NaN where unknown.
    bounds
        West, south, east, north of the outer edges of the outer cells, degrees.

    Examples
    --------
    >>> ground = Ground(np.array([[100.0, 200.0, 300.0, 400.0]]), (6.0, 49.0, 10.0, 50.0))
    >>> ground.range_over(shapely.box(8.2, 49.2, 8.4, 49.4))
    (200.0, 400.0)
    """

    values: FloatArray
    bounds: Bounds

    def range_over(self, area: AreaShape) -> tuple[float, float] | None:
        """
        Return the least and the greatest elevation of an area in degrees.

        The cells that the area touches and all their neighbours count, because elevations are known only at points and
        the ground varies between them.

        Returns
        -------
        range
            Metres; None if a part of the area is outside the raster, or a cell that counts is unknown.
        """
        west, _, _, north = self.bounds
        here = part_near(area, self.bounds)
        # (parts outside the raster were cut off; up to a millionth of the area may be rounding)
        if here is None or here.area < area.area * (1.0 - 1e-6):
            return None
        rows, columns = self.values.shape
        wide, high = self.cell
        x_min, y_min, x_max, y_max = here.bounds
        first, last = max(0, int((x_min - west) / wide)), min(columns - 1, int((x_max - west) / wide))
        top, low = max(0, int((north - y_max) / high)), min(rows - 1, int((north - y_min) / high))
        touched = np.ones((low - top + 1, last - first + 1), dtype=bool)
        if touched.size <= MOST_TESTED:
            left, above = west + wide * np.arange(first, last + 1), north - high * np.arange(top, low + 1)
            shapely.prepare(here)
            boxes = shapely.box(left[None, :], above[:, None] - high, left[None, :] + wide, above[:, None])
            touched = shapely.intersects(here, boxes)
        counted = np.zeros((rows + 2, columns + 2), dtype=bool)
        for down in range(3):
            for right in range(3):
                counted[top + down : low + down + 1, first + right : last + right + 1] |= touched
        seen = self.values[counted[1:-1, 1:-1]]
        return None if np.isnan(seen).any() else (float(seen.min()), float(seen.max()))

    def range_in(self, box: Bounds) -> tuple[float, float] | None:
        """
        Return the least and the greatest elevation in a box: faster than `range_over`, which tests outlines.

        Parameters
        ----------
        box
            West, south, east, north, degrees; it may have no width.

        Examples
        --------
        >>> Ground(np.array([[100.0, 200.0, 300.0, 400.0]]), (6.0, 49.0, 10.0, 50.0)).range_in((8.2, 49.2, 8.2, 49.4))
        (200.0, 400.0)
        """
        west, south, east, north = self.bounds
        wide, high = self.cell
        for turn in (0.0, 360.0, -360.0):
            if west <= box[0] + turn and box[2] + turn <= east and south <= box[1] and box[3] <= north:
                first, last = int((box[0] + turn - west) / wide), int((box[2] + turn - west) / wide)
                top, low = int((north - box[3]) / high), int((north - box[1]) / high)
                seen = self.values[max(0, top - 1) : low + 2, max(0, first - 1) : last + 2]
                return None if np.isnan(seen).any() else (float(seen.min()), float(seen.max()))
        return None

    @property
    def cell(self) -> tuple[float, float]:
        """Width and height of a cell, degrees."""
        west, south, east, north = self.bounds
        rows, columns = self.values.shape
        return (east - west) / columns, (north - south) / rows


#: What functions of elevations take.
GROUND_WANTED = "elevations, as cg.read_ground(file) reads them"


def read_ground(path: str | os.PathLike[str]) -> Ground:
    """
    Read elevations from a raster in longitude and latitude: a GeoTIFF in EPSG:4326, or ``.asc``.

    Raises
    ------
    FileFormatError
        If the file cannot be read, or is not in degrees.
    """
    try:
        cells = read_cells(path, most=MOST_CELLS, coordinates="lonlat", signed=True)
        if cells.system is not None:
            fail(
                cells.file,
                f"elevations are read in degrees on WGS84; these are in {cells.system.name}",
                warp(cells.file),
            )
    except ProblemError as error:
        raise FileFormatError(str(error)) from error
    return Ground(np.asarray(cells.values, dtype=np.float64), cells.bounds)
