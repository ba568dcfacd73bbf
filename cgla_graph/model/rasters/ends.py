"""Ends and bounds over a raster, in the raster's own coordinates or in longitude and latitude."""

import warnings
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
import shapely

from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.errors import ScenarioError
from cgla_graph.model.rasters.crs import CoordinateSystem, RasterWarning


@dataclass(frozen=True)
class MapEnds:
    """
    The ends of a path and the bounds of its map.

    Attributes
    ----------
    start, goal
        Both ends.
    bounds
        No path leaves these; None for those of the map.
    """

    start: Point
    goal: Point
    bounds: Bounds | None = None

    def read(self, system: CoordinateSystem, own: Bounds, *, in_degrees: bool, name: str) -> "MapEnds":
        """
        Return them in the coordinates of the map; a reading in degrees on a map in other coordinates is said.

        Numbers are longitudes and latitudes if they lie outside of the raster in its own coordinates, and inside of it
        in degrees.

        Parameters
        ----------
        system
            The system of the raster.
        own
            The bounds of the raster, or of its map, in that system.
        in_degrees
            Whether they are returned in degrees, or in that system.
        name
            Name of the raster, for messages.

        Raises
        ------
        ScenarioError
            If both readings are possible.

        Examples
        --------
        >>> utm = CoordinateSystem.of_code("EPSG:32635")
        >>> ends = MapEnds((480e3, 6.66e6), (520e3, 6.66e6))
        >>> found = ends.read(utm, (460e3, 6.63e6, 540e3, 6.67e6), in_degrees=True, name="people.tif")
        >>> [round(side, 3) for side in (*found.start, *found.goal)]
        [26.641, 60.077, 27.359, 60.077]
        """
        degrees = system.degrees_around(own)
        places = [self.start, self.goal]
        is_own = all(_inside(place, own) for place in places)
        is_lonlat = degrees is not None and all(_inside(place, degrees, turns=True) for place in places)
        if is_own and is_lonlat:
            msg = (
                f"{name}: start {self.start} and goal {self.goal} are inside of the raster in {system.name} and in "
                "longitude and latitude; warp it to one of them (gdalwarp -t_srs)"
            )
            raise ScenarioError(msg)
        if not is_lonlat:
            if not is_own and degrees is not None and all(abs(x) <= 360.0 and abs(y) <= 90.0 for x, y in places):  # noqa: PLR2004
                box = tuple(round(side, 4) for side in degrees)
                msg = (
                    f"{name}: start {self.start} or goal {self.goal} is outside of the raster, which lies at {own} in "
                    f"{system.name} and at {box} in longitude and latitude; give both in one of them"
                )
                raise ScenarioError(msg)
            return self._converted(system.lonlat, to_degrees=True) if in_degrees else self
        if self.bounds is not None and not _is_degrees(self.bounds):
            msg = f"{name}: the ends are in degrees, and the bounds {self.bounds} are not; give both in degrees"
            raise ScenarioError(msg)
        if in_degrees:
            return self
        text = f"{name}: start and goal are read as longitude and latitude, as they are outside of it in {system.name}"
        warnings.warn(text, RasterWarning, stacklevel=3)
        return self._converted(system.points, to_degrees=False)

    def _converted(self, convert: Callable[[FloatArray], FloatArray], *, to_degrees: bool) -> "MapEnds":
        """Return them in other coordinates; bounds become the box around theirs."""
        (x, y), (u, v) = convert(np.array([self.start, self.goal])).tolist()
        box = None
        if self.bounds is not None:
            rim = shapely.get_coordinates(shapely.box(*self.bounds).exterior.segmentize(_length(self.bounds) / 100.0))
            moved = convert(rim)
            if to_degrees:
                moved[:, 0] += 360.0 * np.round((x - moved[:, 0]) / 360.0)
            (west, south), (east, north) = moved.min(axis=0).tolist(), moved.max(axis=0).tolist()
            box = (west, south, east, north)
        return MapEnds((x, y), (u, v), box)


def _length(bounds: Bounds) -> float:
    return max(bounds[2] - bounds[0], bounds[3] - bounds[1])


def _is_degrees(bounds: Bounds) -> bool:
    return all(abs(x) <= 360.0 for x in bounds[::2]) and all(abs(y) <= 90.0 for y in bounds[1::2])  # noqa: PLR2004


def _inside(place: Point, box: Bounds, *, turns: bool = False) -> bool:
    """Return whether a box contains a place; with `turns`, at any turn of its longitude."""
    x_min, y_min, x_max, y_max = box
    x, y = place
    around = (x, x + 360.0, x - 360.0) if turns else (x,)
    return y_min <= y <= y_max and any(x_min <= one <= x_max for one in around)
