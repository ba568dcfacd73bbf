"""Closed areas and zones that a contingency volume touches."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from datetime import datetime
from typing import Final

from shapely.geometry.base import BaseGeometry

from cgla_graph.airspace.plan_check.plan_map import NamedMap, own_areas
from cgla_graph.airspace.volumes.volumes import Volumes
from cgla_graph.airspace.zones.applying import Lines, Verdict, Zones
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.heights import height_offset
from cgla_graph.airspace.zones.shapes import AreaShape, part_near
from cgla_graph.airspace.zones.zone import Layer
from cgla_graph.model.earth import project_area

#: Margin of the box in which zones are looked at, degrees.
_MARGIN: Final = 0.01


@dataclass(frozen=True)
class Touched:
    """
    A closed area that the contingency volume touches.

    Attributes
    ----------
    name
        Its name.
    reason
        Why it counts, if that is not plain: its heights could not be compared.
    """

    name: str
    reason: str = ""

    def __str__(self) -> str:
        """Return its name, and the reason if there is one."""
        return f"{self.name} ({self.reason})" if self.reason else self.name


def touched_areas(
    volumes: Volumes,
    on: NamedMap | None = None,
    zones: Zones | None = None,
    *,
    at: str | datetime | None = None,
    treat: Mapping[str, str] | None = None,
    lines: Lines = "open",
    ground: Ground | None = None,
) -> list[Touched]:
    """
    Return the closed areas that the contingency volume touches: it reaches from the ground up to its top.

    Parameters
    ----------
    volumes
        The volumes.
    on
        A map whose no-fly areas count; on the map of the volumes.
    zones
        Zones of files; those count that are closed at any height from the ground to the top of the contingency volume.
    at, treat, lines
        As in `Zones.apply`.
    ground
        Elevations, to compare heights above ground with heights above the sea. A zone whose heights cannot be compared
        counts.

    Examples
    --------
    >>> from cgla_graph.airspace.volumes.volumes import volumes
    >>> import shapely
    >>> from cgla_graph.airspace.zones.zone import Limit, Zone
    >>> over = Layer(shapely.box(24.05, 59, 24.06, 61), lower=Limit(70.0, "AGL"))
    >>> flight = volumes([(24.0, 60.0), (24.1, 60.0)], height=60, speed=15, dimension=0.8, pitch=30)
    >>> [str(one) for one in touched_areas(flight, zones=Zones((Zone("A", "", "PROHIBITED", (over,)),)))]
    ['A']
    """
    volume = volumes.shapes[1]
    found = [Touched(one.name) for one in ([] if on is None else own_areas(on)) if one.shape.intersects(volume)]
    if zones is not None and volumes.projection is not None:
        applied = zones.apply(at=at, treat=treat, lines=lines)
        found += [one for verdict in applied.closed for one in _touched(verdict, volumes, volume, ground)]
    named: dict[str, Touched] = {}
    for one in found:
        named.setdefault(one.name, one)
    return list(named.values())


def _touched(verdict: Verdict, volumes: Volumes, volume: BaseGeometry, ground: Ground | None) -> Iterator[Touched]:
    """Yield a zone once if one of its layers is touched."""
    projection, zone = volumes.projection, verdict.zone
    if projection is None:
        return
    west, south, east, north = volumes.contingency.bounds
    box = west - _MARGIN, south - _MARGIN, east + _MARGIN, north + _MARGIN
    reason = None
    for layer in zone.layers:
        near = part_near(layer.area, box)
        if near is None or not project_area(near, projection).intersects(volume):
            continue
        above = _is_above(layer, volumes.dimensions.contingency_top, ground, near)
        if above is False:
            reason = ""
            break
        if above is None:
            reason = "its floor cannot be compared with heights above ground"
    if reason is not None:
        yield Touched(zone.label, reason)


def _is_above(layer: Layer, top: float, ground: Ground | None, area: AreaShape) -> bool | None:
    """Return whether a layer begins above a height above ground; None if unknown."""
    floor = layer.lower
    if floor.metres <= 0.0 and floor.reference == "AGL":
        return False
    below = None if ground is None or floor.reference == "AGL" else ground.range_over(area)
    more = height_offset("AGL", floor.reference, below)
    return None if more is None else floor.metres > top + more[1]
