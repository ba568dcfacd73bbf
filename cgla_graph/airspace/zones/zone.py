"""A zone: what an authority publishes about a piece of airspace."""

import math
from dataclasses import dataclass
from datetime import datetime
from typing import Literal, TypeAlias

from cgla_graph.airspace.zones.periods import Period
from cgla_graph.airspace.zones.shapes import AreaShape

Reference: TypeAlias = Literal["AGL", "AMSL", "WGS84"]
Format: TypeAlias = Literal["ED-269", "ED-318", "KML", "GeoJSON"]

#: What is asked of those who want to fly in a zone, and whether it is closed unless it is said otherwise. Areas of KML
#: and GeoJSON do not say.
TREATMENTS = {
    "PROHIBITED": "closed",
    "REQ_AUTHORISATION": "closed",
    "CONDITIONAL": "closed",
    "USPACE": "closed",
    "UNCLASSIFIED": "closed",
    "NO_RESTRICTION": "open",
}
#: Spellings of them: ED-318 has a z where ED-269 has an s.
SPELLINGS = {"REQ_AUTHORIZATION": "REQ_AUTHORISATION"}
#: Limits from here on, in metres or feet, say that there is none.
NO_CEILING = 99_999.0
FOOT = 0.3048


@dataclass(frozen=True)
class Limit:
    """
    The floor or the ceiling of a layer.

    Parameters
    ----------
    metres
        How high it is; infinite where there is none.
    reference
        Above what: the ground (AGL), mean sea level (AMSL), or the ellipsoid (WGS84).

    Examples
    --------
    >>> str(Limit(120.0, "AGL")), str(Limit(math.inf, "AMSL"))
    ('120 m AGL', 'unlimited')
    """

    metres: float
    reference: Reference

    def __str__(self) -> str:
        """Write it with its unit."""
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
        """Write both."""
        return f"{self.lower} to {self.upper}"

    @property
    def bounded(self) -> list[tuple[Limit, float]]:
        """The floor (1) and the ceiling (-1), where there are any; nobody flies below the ground."""
        from_ground = self.lower.reference == "AGL" and self.lower.metres <= 0.0
        floor = [] if from_ground or math.isinf(self.lower.metres) else [(self.lower, 1.0)]
        return floor + ([] if math.isinf(self.upper.metres) else [(self.upper, -1.0)])


#: Where nothing is said: from the ground up.
GROUND, UNLIMITED = Limit(0.0, "AGL"), Limit(math.inf, "AGL")


@dataclass(frozen=True)
class Layer:
    """
    A part of a zone: an area between two heights.

    Parameters
    ----------
    area
        Longitude and latitude, degrees; longitudes beyond 180 where it goes across the antimeridian.
    lower, upper
        Its floor and ceiling.
    remark
        What had to be done to its outline, or nothing.

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

    @property
    def limits(self) -> Limits:
        """Its floor and ceiling."""
        return Limits(self.lower, self.upper)


@dataclass(frozen=True)
class Zone:
    """
    A zone that an authority publishes, or an area that somebody draws.

    Parameters
    ----------
    identifier
        What its authority calls it.
    name
        What people call it.
    kind
        What is asked of those who want to fly there: one of `TREATMENTS`.
    layers
        Where it is; at least one.
    periods
        When it applies; always where there is none.
    file
        Where it was read from.
    reason, conditions, message, authority
        Why it is there, what is asked in a conditional one, what pilots are told, and who may be asked.

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

    @property
    def label(self) -> str:
        """Identifier and name."""
        return f"{self.identifier} ({self.name})" if self.name not in {"", self.identifier} else self.identifier


@dataclass(frozen=True)
class NoArea:
    """
    What a file has beside zones: a point or a line of KML, which closes nothing.

    Examples
    --------
    >>> NoArea("tower", "a Point, not an area", "zones.kml").reason
    'a Point, not an area'
    """

    label: str
    reason: str
    file: str


@dataclass(frozen=True)
class Validity:
    """
    When the zones of a file are valid, as it says.

    Parameters
    ----------
    file
        The file.
    first, last
        None where it does not say.

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
        """Say that a moment is not in it, or nothing."""
        if self.first is not None and moment < self.first:
            return f"{self.file} is valid from {self.first:%Y-%m-%d %H:%M} UTC only"
        if self.last is not None and moment > self.last:
            return f"{self.file} was valid until {self.last:%Y-%m-%d %H:%M} UTC"
        return ""
