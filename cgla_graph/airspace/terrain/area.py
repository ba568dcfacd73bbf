"""The no-fly area of a flight over terrain: the cells of a raster of elevations that it is not safely above."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely

from cgla_graph._text import counted
from cgla_graph._types import Bounds, Point
from cgla_graph._validate import four_numbers, instance, items, non_negative_number, point
from cgla_graph.airspace.terrain.surface import Surface
from cgla_graph.airspace.zones.ground import GROUND_WANTED, Ground
from cgla_graph.airspace.zones.heights import Altitude, Range, height_offset
from cgla_graph.airspace.zones.shapes import AreaShape
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk_raster import cell_strips

#: Default height to stay above the ground, metres, and its source.
TERRAIN_CLEARANCE: Final = 30.0
SOURCE: Final = "default: TERRAIN_OFS_MAX of ArduPilot, by which elevations may be off"
#: What areas of terrain are called.
NAME: Final = "terrain"
_WORDS: Final = {"HOME": "above home", "AGL": "above the ground", "AMSL": "above the sea", "WGS84": "above WGS84"}


@dataclass(frozen=True, eq=False)
class TerrainArea:
    """
    Where a flight at an altitude is not above the ground by the clearance, or that is not known.

    Attributes
    ----------
    altitude
        Altitude of the flight; None if none is given: then nothing is closed, because nothing is known.
    clearance
        Least height above the ground, metres.
    is_default
        Whether the clearance is `TERRAIN_CLEARANCE` because none was given.
    lowest
        Least height of the flight above the sea, metres; None if it is above ground.
    cells, closed, unknown
        Number of cells near the map, of those whose elevation closes them, and of those that are closed as it is
        unknown.
    outside
        Whether a part of the map is outside the raster, and closed.
    shape
        The closed area, degrees; None if nothing is closed.
    ground
        The elevations.
    """

    altitude: Altitude | None
    clearance: float
    is_default: bool
    lowest: float | None = None
    cells: int = 0
    closed: int = 0
    unknown: int = 0
    outside: bool = False
    shape: AreaShape | None = None
    ground: Ground | None = None

    def summary(self) -> str:
        """Return the altitude, the clearance with its source, and the closed cells, in one line."""
        kept = f"{self.clearance:g} m above the ground ({SOURCE if self.is_default else 'as given'})"
        if self.altitude is None:
            return f"not compared, as the flight has no altitude (--altitude M gives one); it would have to stay {kept}"
        at = f"at {self.altitude.metres:g} m {_WORDS[self.altitude.reference]}"
        if self.lowest is None:
            return f"{at}, nothing is closed, as the flight follows the ground; it has to stay {kept}"
        sea = "" if self.altitude.reference == "AMSL" else f" ({self.lowest:.6g} m above the sea or more)"
        return f"{at}{sea}, {self.closed} of {counted(self.cells, 'cell')} closed, to stay {kept}"

    def notes(self) -> list[str]:
        """Return the areas that are closed because their elevation is unknown."""
        found = []
        if self.unknown:
            found.append(f"terrain: {counted(self.unknown, 'cell')} closed, as an elevation there or beside is unknown")
        if self.outside:
            found.append(
                "terrain: a part of the map is closed, as it is outside the raster of elevations; "
                "give one that covers the map (--ground), or other bounds"
            )
        return found

    def document(self) -> dict[str, Any]:
        """Return the account as JSON."""
        at = self.altitude
        return {
            "altitude": None if at is None else at.metres,
            "reference": None if at is None else at.reference,
            "lowest_above_sea": self.lowest,
            "clearance": self.clearance,
            "clearance_is_default": self.is_default,
            "cells": self.cells,
            "closed": self.closed,
            "unknown": self.unknown,
            "outside": self.outside,
            "summary": self.summary(),
            "notes": self.notes(),
        }


def clearance_of(given: float | None) -> float:
    """
    Return a clearance above the ground, or the default.

    Raises
    ------
    ProblemError
        If it is negative or no number.

    Examples
    --------
    >>> clearance_of(None), clearance_of(50)
    (30.0, 50.0)
    """
    return TERRAIN_CLEARANCE if given is None else non_negative_number("terrain_clearance", given)


def home_range(ground: Ground, homes: Sequence[Point] | None) -> Range | None:
    """
    Return the least and greatest elevation around places of take-off, metres; None if one is unknown, or there is none.

    Parameters
    ----------
    ground
        Elevations.
    homes
        Longitude and latitude of each, degrees; None if they are not known.

    Examples
    --------
    >>> home_range(Ground(np.array([[100.0, 200.0, 300.0, 400.0]]), (6.0, 49.0, 10.0, 50.0)), [(6.5, 49.5)])
    (100.0, 200.0)
    """
    found = [ground.range_in((x, y, x, y)) for x, y in homes or ()]
    known = [one for one in found if one is not None]
    if not known or len(known) < len(found):
        return None
    return min(low for low, _ in known), max(high for _, high in known)


def terrain_area(
    ground: Ground,
    altitude: "str | float | Altitude | None",
    box: Bounds,
    *,
    clearance: float | None = None,
    homes: Sequence[Point] | None = None,
    map_box: Bounds | None = None,
) -> TerrainArea:
    """
    Return the cells in a box where a flight is not, or not known to be, above the ground by a clearance.

    A cell is closed if the greatest elevation of the cell and its neighbours plus the clearance is above the least
    possible height of the flight: elevations are known only at points and the ground varies between them. A cell with
    an unknown one is closed, and so is the map outside the raster. A flight above ground follows it, so that nothing is
    closed.

    Parameters
    ----------
    ground
        Elevations.
    altitude
        Altitude of the flight: metres above ground, or as ``"450 AMSL"``, ``"80 HOME"``, ``"500 WGS84"``. None if there
        is none.
    box
        West, south, east, north, degrees; west less than east, which may be beyond 180 degrees.
    clearance
        Least height above the ground, metres; None for 30 m, by which the elevations of an autopilot may be off
        (ArduPilot's ``TERRAIN_OFS_MAX``).
    homes
        Places of take-off, degrees, for altitudes above home: the lowest counts.
    map_box
        The part of the box that is told of if it is outside the raster; None for all of it.

    Raises
    ------
    ProblemError
        If the clearance is negative, an altitude above ground is below it, or the elevation of home is not known.
    FileFormatError
        If the altitude is malformed.

    Examples
    --------
    >>> ground = Ground(np.array([[0.0, 0.0, 0.0, 300.0, 0.0, 0.0, 0.0]]), (6.0, 49.0, 13.0, 50.0))
    >>> area = terrain_area(ground, "80 AMSL", (6.0, 49.0, 13.0, 50.0))
    >>> area.shape.bounds, area.closed
    ((8.0, 49.0, 11.0, 50.0), 3)
    """
    instance("ground", ground, Ground, GROUND_WANTED)
    box, map_box = four_numbers("box", box), None if map_box is None else four_numbers("map_box", map_box)
    homes = None if homes is None else [point("a home", home) for home in items("homes", homes, "points in degrees")]
    least, is_default = clearance_of(clearance), clearance is None
    if altitude is None:
        return TerrainArea(None, least, is_default, ground=ground)
    flight = Altitude.of(altitude)
    if flight.reference == "AGL":
        _require_above(flight, least)
        return TerrainArea(flight, least, is_default, ground=ground)
    offset = height_offset(flight.reference, "AMSL", None, home_range(ground, homes))
    if offset is None:
        msg = (
            f"the altitude is {flight.metres:g} m above home, and the elevation of home is not known from the raster; "
            "give a raster that has data there (ground), or an altitude above the sea"
        )
        raise ProblemError(msg)
    lowest = flight.metres + offset[0]
    surface = Surface.near(ground, box)
    shape = _closed_cells(surface, box, lowest - least)
    inner = _within(surface, box)
    around = surface.around[inner]
    unknown = int(np.isinf(around).sum())
    low = int((around > lowest - least).sum()) - unknown
    outside = not surface.covers(map_box or box)
    return TerrainArea(flight, least, is_default, lowest, around.size, low, unknown, outside, shape, ground)


def _require_above(flight: Altitude, clearance: float) -> None:
    if flight.metres < clearance:
        msg = (
            f"the altitude is {flight.metres:g} m above ground, and the terrain clearance is {clearance:g} m; fly "
            "higher (--altitude), or lower the clearance (--terrain-clearance)"
        )
        raise ProblemError(msg)


def _within(surface: Surface, box: Bounds) -> tuple[slice, slice]:
    """Return the rows and columns of a surface that meet the inside of a box."""
    rows, columns = surface.values.shape
    first, last = (np.clip((side - surface.west) / surface.cell[0], 0, columns) for side in (box[0], box[2]))
    top, low = (np.clip((surface.north - side) / surface.cell[1], 0, rows) for side in (box[3], box[1]))
    return slice(int(np.floor(top)), int(np.ceil(low))), slice(int(np.floor(first)), int(np.ceil(last)))


def _closed_cells(surface: Surface, box: Bounds, level: float) -> AreaShape | None:
    """Return the cells in a box with an elevation above a level around, and the box outside the raster, degrees."""
    rows, columns = surface.values.shape
    x = surface.west + surface.cell[0] * np.arange(columns + 1)
    y = surface.north - surface.cell[1] * np.arange(rows, -1.0, -1.0)
    strips = cell_strips((surface.around > level)[::-1], x, y)
    whole = shapely.box(*box)
    beyond = shapely.difference(whole, shapely.box(x[0], y[0], x[-1], y[-1]))
    union = shapely.union_all([*strips, beyond])
    parts = [
        part
        for part in shapely.get_parts(shapely.intersection(union, whole)).tolist()
        if part.geom_type == "Polygon" and part.area > 0.0
    ]
    if not parts:
        return None
    return parts[0] if len(parts) == 1 else shapely.MultiPolygon(parts)
