"""Zones: pieces of airspace with floor, ceiling, kind and times, as authorities publish them."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Literal, TypeAlias

from cgla_graph.airspace.zones.periods import Period
from cgla_graph.airspace.zones.shapes import AreaShape
from cgla_graph.model.earth import require_area

Reference: TypeAlias = Literal["AGL", "AMSL", "WGS84"]
Format: TypeAlias = Literal["ED-269", "ED-318", "KML", "GeoJSON"]

#: Kinds of zones by the requirement for flights, and whether they are closed by default. Areas of KML and GeoJSON have
#: no kind and are UNCLASSIFIED.
TREATMENTS = {
    "PROHIBITED": "closed",
    "REQ_AUTHORISATION": "closed",
    "CONDITIONAL": "closed",
    "USPACE": "closed",
    "UNCLASSIFIED": "closed",
    "NO_RESTRICTION": "open",
}
#: Other spellings of kinds: ED-318 writes a z.
SPELLINGS = {"REQ_AUTHORIZATION": "REQ_AUTHORISATION"}
#: Ceilings from here on, in metres or feet, mean that there is none.
NO_CEILING = 99_999.0
FOOT = 0.3048


@dataclass(frozen=True)
class Limit:
    """
    The floor or the ceiling of a layer.

    Parameters
    ----------
    metres
        Metres above the reference; infinite if there is no limit.
    reference
        The ground (AGL), mean sea level (AMSL), or the ellipsoid (WGS84).

    Examples
    --------
    >>> str(Limit(120.0, "AGL")), str(Limit(math.inf, "AMSL"))
    ('120 m AGL', 'unlimited')
    """

    metres: float
    reference: Reference

    def __str__(self) -> str:
        """Return the limit with unit and reference."""
        return f"{self.metres:.6g} m {self.reference}" if math.isfinite(self.metres) else "unlimited"


@dataclass(frozen=True)
class Limits:
    """
    The floor and the ceiling of an area.

    Examples
    --------
    >>> str(Limits(Limit(0.0, "AGL"), Limit(120.0, "AGL"))), Limits(Limit(0.0, "AGL"), Limit(math.inf, "AGL")).bounded
    ('0 m AGL to 120 m AGL', [])
    """

    lower: Limit
    upper: Limit

    def __str__(self) -> str:
        """Return floor and ceiling."""
        return f"{self.lower} to {self.upper}"

    @property
    def bounded(self) -> list[tuple[Limit, float]]:
        """The floor with sign 1 and the ceiling with sign -1, if they exclude any height above the ground."""
        from_ground = self.lower.reference == "AGL" and self.lower.metres <= 0.0
        floor = [] if from_ground or math.isinf(self.lower.metres) else [(self.lower, 1.0)]
        return floor + ([] if math.isinf(self.upper.metres) else [(self.upper, -1.0)])


#: Default limits: from the ground up.
GROUND, UNLIMITED = Limit(0.0, "AGL"), Limit(math.inf, "AGL")


@dataclass(frozen=True)
class Layer:
    """
    A part of a zone: an area between two heights.

    Parameters
    ----------
    area
        Longitude and latitude, degrees; longitudes beyond 180 if it crosses the antimeridian.
    lower, upper
        Its floor and ceiling.
    remark
        Remark on a repair of its outline; may be empty.

    Raises
    ------
    ProblemError
        If a coordinate of the area is out of range, or it is no valid polygon.

    Examples
    --------
    >>> import shapely
    >>> Layer(shapely.box(24, 60, 25, 61)).upper
    Limit(metres=inf, reference='AGL')
    """

    area: AreaShape
    lower: Limit = GROUND
    upper: Limit = UNLIMITED
    remark: str = ""

    def __post_init__(self) -> None:
        """Check the area."""
        require_area(self.area)

    @property
    def limits(self) -> Limits:
        """Its floor and ceiling."""
        return Limits(self.lower, self.upper)


@dataclass(frozen=True)
class Zone:
    """
    A zone that an authority publishes, or an area of KML or GeoJSON.

    Parameters
    ----------
    identifier
        Identifier of its authority.
    name
        Its name, may be empty.
    kind
        Requirement for flights: one of `TREATMENTS`.
    layers
        Its layers, at least one.
    periods
        Periods in which it applies; empty for always.
    file
        The file from which it was read.
    reason, conditions, message, authority
        Reason, conditions of a conditional zone, message for pilots, and contact of the authority.
    category
        Kind in the words of a file whose kinds are not those of `TREATMENTS`; may be empty.

    Examples
    --------
    >>> import shapely
    >>> Zone("LU-P-001", "Findel", "PROHIBITED", (Layer(shapely.box(6, 49, 7, 50)),)).label
    'LU-P-001 (Findel)'
    """

    identifier: str
    name: str
    kind: str
    layers: tuple[Layer, ...]
    periods: tuple[Period, ...] = ()
    file: str = ""
    reason: str = ""
    conditions: str = ""
    message: str = ""
    authority: str = ""
    category: str = ""

    @property
    def label(self) -> str:
        """Its identifier, and its name if it differs."""
        return label_of(self.identifier, self.name)


def label_of(identifier: str, name: str) -> str:
    """
    Return the identifier of a zone, and its name if it differs.

    Examples
    --------
    >>> label_of("LU-P-001", "Findel"), label_of("Findel", "Findel")
    ('LU-P-001 (Findel)', 'Findel')
    """
    return f"{identifier} ({name})" if name not in {"", identifier} else identifier


@dataclass(frozen=True)
class NoArea:
    """
    A point, line or picture of KML, or a line of GeoJSON, which closes no area by itself.

    Parameters
    ----------
    label, reason, file
        Its name, what it is, and its file.
    layers
        What closed lines enclose; empty for other lines, points and pictures.
    message
        Description of its placemark, may be empty.

    Examples
    --------
    >>> NoArea("tower", "a Point, not an area", "zones.kml").reason
    'a Point, not an area'
    """

    label: str
    reason: str
    file: str
    layers: tuple[Layer, ...] = ()
    message: str = ""

    @property
    def closed(self) -> Zone:
        """The zone of what its lines enclose."""
        return Zone(self.label, "", "UNCLASSIFIED", self.layers, file=self.file, message=self.message)


@dataclass(frozen=True)
class Validity:
    """
    Period in which the zones of a file are valid.

    Parameters
    ----------
    file
        The file.
    first, last
        First and last moment; None if the file has none.

    Examples
    --------
    >>> from datetime import UTC
    >>> Validity("zones.json", datetime(2026, 8, 4, tzinfo=UTC), None).remark(datetime(2026, 8, 1, tzinfo=UTC))
    'zones.json is valid from 2026-08-04 00:00 UTC only'
    """

    file: str
    first: datetime | None
    last: datetime | None

    def remark(self, moment: datetime) -> str:
        """Return a remark if a moment is outside the period, else empty."""
        if self.first is not None and moment < self.first:
            return f"{self.file} is valid from {self.first:%Y-%m-%d %H:%M} UTC only"
        if self.last is not None and moment > self.last:
            return f"{self.file} was valid until {self.last:%Y-%m-%d %H:%M} UTC"
        return ""
