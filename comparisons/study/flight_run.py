"""Flights of a comparison: one solver's flight of one variant of a mission, as numbers, names and tracks."""

import base64
import dataclasses
import hashlib
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import shapely
from PIL import Image
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, Point
from cgla_graph.comparisons.study.documents import Document, decode, dumps, encode
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.plots.risk_samples import risk_samples
from cgla_graph.scenarios.mission_file import MissionFile

#: The picture of a mission's rasters: samples along the longer side, colour, and opacity at the greatest risk.
_SHADE_SAMPLES, _VIOLET, _OPAQUE = 120, (122, 79, 208), 220.0
#: The columns of `flights.jsonl` and `flights.csv`, one row a flight.
COLUMNS = (
    *("mission", "variant", "solver", "seed", "status", "arrived", "uavs", "cost", "length", "risk", "risk_sum"),
    *("least_separation", "ticks", "replans", "planning_seconds", "message"),
)


class Track(NamedTuple):
    """
    The track of a UAV and the end of its flight.

    Attributes
    ----------
    uav, status, message
        The UAV's name, the label of its status, and its message.
    path
        The corners of its track.
    """

    uav: str
    status: str
    message: str
    path: Sequence[Sequence[float]]


@dataclass(frozen=True, eq=False)
class FlightRun:
    """
    One solver's flight of one variant of a mission.

    Attributes
    ----------
    mission, variant
        Their names.
    solver
        The entrant's label.
    seed
        Of a seeded solver; else None.
    n_uavs
        Number of UAVs.
    status
        ``arrived`` if all did, else the status of the first UAV that did not; ``unavailable`` or ``failed`` without a
        flight.
    message
        The reason, if not all arrived.
    numbers
        The results by the names of `COLUMNS`; None for NaN and infinity, and empty without a flight.
    tracks
        Tracks of the UAVs; empty without a flight.
    """

    mission: str
    variant: str
    solver: str
    seed: int | None
    n_uavs: int
    status: str
    message: str = ""
    numbers: Mapping[str, float | None] = field(default_factory=dict)
    tracks: Sequence[Track] = ()

    @property
    def all_arrived(self) -> bool:
        """Whether every UAV reached its goal."""
        return self.status == "arrived"

    def row(self) -> dict[str, Any]:
        """Return one value for each of `COLUMNS`; numbers that do not exist are None."""
        names = {"mission": self.mission, "variant": self.variant, "solver": self.solver, "seed": self.seed}
        how = {"status": self.status, "uavs": self.n_uavs, "message": self.message}
        return {**dict.fromkeys(COLUMNS), **names, **how, **self.numbers}

    def document(self) -> Document:
        """Return everything except the names, as JSON."""
        return {
            "status": self.status,
            "message": self.message,
            "uavs": self.n_uavs,
            "numbers": encode(self.numbers),
            "tracks": [encode([*track]) for track in self.tracks],
        }


def flight_from(key: Sequence[Any], document: Document) -> FlightRun:
    """Build the flight of a document and its names; a malformed one raises any error."""
    mission, variant, solver, seed = key
    return FlightRun(
        mission,
        variant,
        solver,
        seed,
        int(document["uavs"]),
        str(document["status"]),
        str(document["message"]),
        dict(decode(document["numbers"])),
        [Track(*decode(track)) for track in document["tracks"]],
    )


@dataclass(frozen=True)
class ComparedMission:
    """
    The record of a mission in a study.

    Attributes
    ----------
    name, title
        As in its file; missions of the same name are numbered.
    variants
        Number of UAVs in each variant.
    unit
        The unit of lengths, ``m`` or ``map units``.
    bounds, threats, areas
        The map at the start: threats as ``x``, ``y`` and ``spread``, and the outlines of no-fly areas.
    where
        Its source: a shipped name, or a file.
    digest
        Distinguishes it from another mission of that name.
    shade
        A picture of the risk at the start, a PNG in base64; empty without rasters.
    """

    name: str
    title: str
    variants: Mapping[str, int]
    unit: str
    bounds: Bounds
    threats: Sequence[tuple[float, float, float]]
    areas: Sequence[Sequence[Point]]
    where: str
    digest: str
    shade: str = ""

    @classmethod
    def of(cls, mission: MissionFile) -> "ComparedMission":
        """Make the record of a mission."""
        world = mission.world
        areas = shapely.get_parts([] if world.no_fly is None else world.no_fly)
        outlines = [shapely.get_coordinates(area.exterior).tolist() for area in areas if area.geom_type == "Polygon"]
        path = Path(mission.where)
        return cls(
            mission.name,
            mission.title,
            {name: len(variant.uavs) for name, variant in mission.variants.items()},
            "m" if mission.projection else "map units",
            world.bounds,
            [(threat.x, threat.y, threat.spread) for threat in world.field_at(0).threats],
            [[(x, y) for x, y in outline] for outline in outlines],
            str(path.absolute()) if path.suffix.lower() == ".toml" else mission.where,
            mission_digest(mission),
            _shade(world.field_at(0), world.bounds),
        )

    def document(self) -> Document:
        """Return it as JSON."""
        return {one.name: encode(getattr(self, one.name)) for one in dataclasses.fields(self)}

    @classmethod
    def from_document(cls, document: Document) -> "ComparedMission":
        """Read it; a malformed one raises any error."""
        # documents of versions without rasters have no shade
        given = {"shade": "", **document}
        return cls(**{one.name: decode(given[one.name]) for one in dataclasses.fields(cls)})


def _shade(field: RiskField, bounds: Bounds) -> str:
    """Draw the risk of a field with rasters: opacity grows with risk."""
    if not field.rasters:
        return ""
    x_min, y_min, x_max, y_max = bounds
    risk = risk_samples(Problem((x_min, y_min), (x_max, y_max), field, bounds=bounds), _SHADE_SAMPLES)
    if not risk.top > risk.low:
        return ""
    pixels = np.empty((*risk.shades.shape, 4), dtype=np.uint8)
    pixels[..., :3] = _VIOLET
    pixels[..., 3] = np.rint(_OPAQUE * risk.shades)[::-1]
    image = io.BytesIO()
    Image.fromarray(pixels).save(image, format="png")
    return base64.b64encode(image.getvalue()).decode("ascii")


def mission_digest(mission: MissionFile) -> str:
    """
    Return a digest of a mission, without its texts.

    Examples
    --------
    >>> from cgla_graph.scenarios.mission_file import load_mission
    >>> mission_digest(load_mission("fig4")) == mission_digest(load_mission("fig4"))
    True
    """
    parts = [mission.world, mission.lattice, mission.variants, mission.projection]
    return hashlib.sha256(dumps([_described(part) for part in parts]).encode()).hexdigest()[:16]


def _described(value: Any) -> Any:  # noqa: ANN401 - any part of a mission
    """Write any part of a mission as JSON for a digest."""
    if isinstance(value, BaseGeometry):
        return shapely.to_wkb(value, hex=True)
    if isinstance(value, RiskField):
        return {"RiskField": _described(_field_parts(value))}
    if dataclasses.is_dataclass(value):
        fields = {one.name: getattr(value, one.name) for one in dataclasses.fields(value)}
        return {type(value).__name__: _described(fields)}
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, Mapping):
        return {str(key): _described(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_described(item) for item in value]
    return encode(value if not isinstance(value, float) or math.isfinite(value) else float(value))


def _field_parts(field: RiskField) -> dict[str, Any]:
    """Return the parts of a risk field that decide equality."""
    # without rasters, digests stay those of earlier versions
    parts: dict[str, Any] = {"threats": field.threats, "improper": field.improper}
    if field.rasters:
        parts["rasters"] = [
            # a digest of the cells: all values as text would be tens of megabytes
            [
                raster.bounds,
                raster.interpolation,
                raster.shape,
                hashlib.sha256(np.ascontiguousarray(raster.cells, dtype="<f8").tobytes()).hexdigest(),
                *([] if raster.unit is None else [raster.unit, raster.failures]),
            ]
            for raster in field.rasters
        ]
    return parts
