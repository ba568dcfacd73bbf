"""Volumes of a flight held against people, zones and areas: what an operator hands in."""

import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime
from typing import Any

from cgla_graph._text import ShortRepr, counted, listed
from cgla_graph.airspace.plan_check.plan_map import NamedMap, PlainMap
from cgla_graph.airspace.volumes.held_against import Touched, touched_areas
from cgla_graph.airspace.volumes.volumes import PeopleBelow, Volumes
from cgla_graph.airspace.zones.applying import Lines, Zones
from cgla_graph.airspace.zones.ground import Ground, read_ground
from cgla_graph.airspace.zones.reading import read_zones
from cgla_graph.model.ground_risk import people_of
from cgla_graph.model.problem import Problem
from cgla_graph.untrusted.files import FilePath


@dataclass(frozen=True, eq=False)
class VolumeReport(ShortRepr):
    """
    Volumes, the people below them, and the closed areas that they touch.

    Attributes
    ----------
    volumes
        The volumes.
    people
        Densities of people, and the intrinsic ground risk class.
    touched
        Closed areas that the contingency volume touches.
    unknown
        Why it is not known that it touches no others: one sentence each.
    """

    volumes: Volumes
    people: PeopleBelow
    touched: tuple[Touched, ...] = ()
    unknown: tuple[str, ...] = field(default=())

    @property
    def is_clean(self) -> bool:
        """Whether it is known that the contingency volume touches no closed area."""
        return not (self.touched or self.unknown)

    @property
    def verdict(self) -> list[str]:
        """One line if the contingency volume is clean, else one line for each kind of fault."""
        if self.is_clean:
            return ["clean: the contingency volume touches no closed area"]
        found = []
        if self.touched:
            names = listed(list(map(str, self.touched)), 5)
            found.append(f"the contingency volume touches {counted(len(self.touched), 'closed area')}: {names}")
        return [*(f"not clean: {words}" for words in found), *(f"not known: {words}" for words in self.unknown)]

    def lines(self) -> dict[str, str]:
        """Return the report in words."""
        below = self.people
        return {
            "volumes": "; ".join(f"{name}: {words}" for name, words in self.volumes.lines_of_text().items()),
            "below them": f"operational volume {below.operational}; ground risk buffer {below.buffer}",
            "iGRC": str(below.ground_risk_class),
            "airspace": "; ".join(self.verdict),
        }

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {
            **self.volumes.document(),
            "people": self.people.document(),
            "clean": self.is_clean,
            "verdict": self.verdict,
            "touched": [dict(vars(one)) for one in self.touched],
        }


def volume_report(
    volumes: Volumes,
    on: Problem | NamedMap | None = None,
    *,
    zones: Zones | FilePath | Sequence[FilePath] = (),
    at: str | datetime | None = None,
    treat: Mapping[str, str] | None = None,
    lines: Lines | None = None,
    ground: Ground | FilePath | None = None,
    without_data: float | None = None,
    controlled: bool = False,
) -> VolumeReport:
    """
    Hold volumes against the people and the no-fly areas of a map, and against zones.

    Parameters
    ----------
    volumes
        The volumes.
    on
        Their map, with its layer of people (`cgla_graph.people_of`) and its no-fly areas; None if there is none.
    zones
        The result of `cgla_graph.read_zones`, or files that it reads.
    at, treat, lines
        As in `Zones.apply`.
    ground
        Elevations, or the file of a raster of them, to compare heights above ground with heights above the sea.
    without_data, controlled
        As in `Volumes.people_below`.

    Returns
    -------
    report
        Densities, class and verdict. Unknown parts are never clean, and have no class.

    Raises
    ------
    CglaError
        If a file or a setting is malformed.

    Examples
    --------
    >>> import shapely
    >>> from cgla_graph.airspace.volumes.volumes import volumes
    >>> from cgla_graph.solvers.solving import solve
    >>> tower = Problem((0, 0), (900, 0), bounds=(-500, -500, 1500, 500), no_fly=shapely.box(400, 30, 500, 99))
    >>> flight = volumes(solve(tower, "straight-line"), height=60, speed=15, dimension=0.8, pitch=30)
    >>> volume_report(flight, tower).verdict
    ['not clean: the contingency volume touches 1 closed area: no-fly area 0']
    """
    source = PlainMap("map", "", on) if isinstance(on, Problem) else on
    read = zones if isinstance(zones, Zones) else read_zones(zones) if zones else None
    elevations = read_ground(ground) if isinstance(ground, str | os.PathLike) else ground
    touched = touched_areas(volumes, source, read, at=at, treat=treat, lines=lines or "open", ground=elevations)
    people = None if source is None else people_of(source.problem)
    below = volumes.people_below(people, without_data=without_data, controlled=controlled)
    return VolumeReport(volumes, below, tuple(touched), tuple(_unknown(volumes, source, read)))


def _unknown(volumes: Volumes, on: NamedMap | None, zones: Zones | None) -> list[str]:
    """Return why it is not known that the contingency volume touches no other areas."""
    has_areas = on is not None and on.problem.no_fly is not None
    if not has_areas and zones is None:
        return ["no zones or no-fly areas to hold the contingency volume against; give zones (--no-fly FILE)"]
    if on is None or zones is not None or not has_areas:
        return []
    x_min, y_min, x_max, y_max = volumes.shapes[1].bounds
    west, south, east, north = on.problem.bounds
    inside = west <= x_min and south <= y_min and x_max <= east and y_max <= north
    return [] if inside else ["the contingency volume leaves the map, and areas beyond it are not known"]
