"""Columns of take-off and landing: from the ground to the altitude of a flight, through layers of zones below it."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._types import Point
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import Altitude, meets
from cgla_graph.airspace.zones.zone import Layer, Zone
from cgla_graph.model.earth import LocalProjection

#: Kinds of zones that their authority may open to a flight.
_ON_REQUEST = ("REQ_AUTHORISATION", "CONDITIONAL", "USPACE")
#: Distance within which a place counts as on a border, metres: autopilots round places to 1e-7 degrees.
ON_BORDER = 0.01
#: Width of seams between areas that are closed, metres: projected borders differ by roundings.
_SEAM = 1e-6


@dataclass(frozen=True, eq=False)
class LowLayer:
    """
    A closed layer between the ground and the altitude of a flight: it counts only where the flight takes off or lands.

    Attributes
    ----------
    zone, layer
        The zone, and its layer.
    shape
        Area of the layer, map units.
    """

    zone: Zone
    layer: Layer
    shape: BaseGeometry


@dataclass(frozen=True, eq=False)
class Columns:
    """
    Layers below the altitude of a flight, and whether its take-offs and landings go through them.

    Parameters
    ----------
    low
        The layers.
    flight
        The altitude.
    projection
        Projection of the map.
    ground
        Elevations; None if unknown.
    vertical_clearance
        Metres by which floors and ceilings are widened.

    Examples
    --------
    >>> from cgla_graph.airspace.zones.zone import Limit
    >>> zone = Zone("A", "", "PROHIBITED", (Layer(shapely.box(24, 60, 25, 61), upper=Limit(50.0, "AGL")),))
    >>> low = LowLayer(zone, zone.layers[0], shapely.box(-900, -900, 900, 900))
    >>> columns = Columns((low,), Altitude(80.0), LocalProjection(24.5, 60.5))
    >>> [[distance for _, distance in columns.met(place, 200.0)] for place in ((0, 0), (0, 1000), (0, 1200))]
    [[0.0], [100.0], []]
    """

    low: Sequence[LowLayer]
    flight: Altitude
    projection: LocalProjection
    ground: Ground | None = None
    vertical_clearance: float = 0.0

    def met(
        self, place: Point, clearance: float = 0.0, *, closed: BaseGeometry | None = None
    ) -> list[tuple[LowLayer, float]]:
        """
        Return the layers through which a flight takes off or lands at a place, with their distances.

        A place on the border of a layer, to a centimetre, is outside, unless layers and areas around it leave no way.

        Parameters
        ----------
        place
            Map units.
        clearance
            Horizontal distance to be kept, metres.
        closed
            Area that is closed at the altitude of the flight, map units.
        """
        here = shapely.Point(place)
        shapes = np.array([one.shape for one in self.low], dtype=object)
        away = np.asarray(shapely.distance(shapes, here))
        near = [
            number
            for number in np.nonzero(away <= max(clearance, ON_BORDER))[0].tolist()
            if self._meets(self.low[number].layer, place, clearance) is not False
        ]
        touched = [number for number in near if away[number] <= ON_BORDER]
        inside = [number for number in touched if _is_inside(shapes[number], here)]
        if touched and not inside:
            # (several areas that share a border leave no way between them)
            around = [] if closed is None or shapely.distance(closed, here) > ON_BORDER else [closed]
            joined = shapely.union_all(shapely.buffer([*shapes[touched], *around], _SEAM))
            inside = touched if _is_inside(joined, here) else []
        return [
            (self.low[number], float(away[number]))
            for number in near
            if number in inside or away[number] < clearance - ON_BORDER
        ]

    def fault(
        self,
        name: str,
        place: Point,
        clearance: float = 0.0,
        *,
        written: Point | None = None,
        closed: BaseGeometry | None = None,
    ) -> str:
        """
        Return why a flight cannot take off or land at a place, and the remedy; empty if it can.

        Parameters
        ----------
        name
            Name of the place; a start ends in "start".
        place, clearance, closed
            As in `met`.
        written
            The place as the user wrote it; None for its longitude and latitude.
        """
        found = self.met(place, clearance, closed=closed)
        if not found:
            return ""
        one, away = min(found, key=lambda pair: pair[1])
        way = "take-off" if name.endswith("start") else "landing"
        file = f" of {Path(one.zone.file).name}" if one.zone.file else ""
        layer = f"the no-fly area {shown(one.zone.label)}{file}, {one.layer.limits}"
        if self.vertical_clearance > 0.0:
            layer += f", with a vertical clearance of {self.vertical_clearance:g} m"
        if self._meets(one.layer, place, clearance) is None:
            layer += ", which counts as heights cannot be compared without the ground's elevation (--ground FILE.tif)"
        if written is None:
            x, y = self.projection.inverse(np.array(place, dtype=np.float64)).round(7).tolist()
            written = x, y
        where = f"{name} {tuple(written)}: {way} between the ground and {self.flight}"
        kind = one.zone.kind
        open_it = f", or with its authority's permission treat {kind} as open (--treat {kind}=open)"
        asks = open_it if kind in _ON_REQUEST else ""
        if away == 0.0:
            return f"{where} goes through {layer}; move it to its boundary or outside{asks}"
        wrong = f"{where} is {away:.6g} m from {layer}, and the clearance is {clearance:g} m"
        return f"{wrong}; move it, or lower the clearance{asks}"

    def _meets(self, layer: Layer, place: Point, clearance: float) -> bool | None:
        """Return whether a column at a place, or within the clearance around it, goes through a layer."""
        corners = np.array(place) + clearance * np.array(
            [(-1.0, -1.0), (-1.0, 1.0), (0.0, 0.0), (1.0, -1.0), (1.0, 1.0)]
        )
        degrees = self.projection.inverse(corners)
        degrees[:, 0] += 360.0 * np.round((degrees[2, 0] - degrees[:, 0]) / 360.0)
        (west, south), (east, north) = degrees.min(axis=0).tolist(), degrees.max(axis=0).tolist()
        near = west, south, east, north
        return meets(
            layer, self.flight, self.ground, vertical_clearance=self.vertical_clearance, from_ground=True, near=near
        )


def _is_inside(area: BaseGeometry, place: shapely.Point) -> bool:
    """Return whether a place is inside an area, by more than a rounding."""
    return bool(shapely.contains_properly(area, place) and shapely.distance(area.boundary, place) > ON_BORDER)
