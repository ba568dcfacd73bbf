"""Reader of ED-269 (EUROCAE, 2020): zones as JSON, each with its volumes under `geometry`."""

import math
from collections.abc import Sequence

from cgla_graph._text import shown
from cgla_graph.airspace.zones.entries import Entry
from cgla_graph.airspace.zones.periods import Period, period_of
from cgla_graph.airspace.zones.rings import area_of
from cgla_graph.airspace.zones.shapes import circle_of
from cgla_graph.airspace.zones.zone import FOOT, GROUND, NO_CEILING, SPELLINGS, UNLIMITED, Layer, Limit, Zone
from cgla_graph.untrusted.files import fault

KINDS = ("PROHIBITED", "REQ_AUTHORISATION", "CONDITIONAL", "NO_RESTRICTION", "USPACE", *SPELLINGS)
#: Keys of zones that restrict when and where they apply, and keys of volumes.
ZONE = ("applicability",)
VOLUME = (
    "uomDimensions",
    "lowerLimit",
    "lowerVerticalReference",
    "upperLimit",
    "upperVerticalReference",
    "horizontalProjection",
)
UNITS = {"M": 1.0, "FT": FOOT}
#: References of heights, as files write them.
REFERENCES = {"AGL": "AGL", "SFC": "AGL", "AMSL": "AMSL", "MSL": "AMSL", "WGS84": "WGS84", "W84": "WGS84"}


def is_ed269(document: object) -> bool:
    """
    Return whether a document is of this standard.

    Examples
    --------
    >>> is_ed269({"title": "zones", "features": []}), is_ed269({"type": "FeatureCollection", "features": []})
    (True, False)
    """
    if not isinstance(document, dict):
        return isinstance(document, list) and bool(document)
    features = document.get("features")
    volumes = isinstance(features, list) and any(
        isinstance(one, dict) and isinstance(one.get("geometry"), list) for one in features
    )
    return volumes or ("features" in document and not isinstance(document.get("type"), str))


def read_document(document: object, file: str) -> list[Zone]:
    """
    Return the zones of a parsed document, named `file` in errors.

    Raises
    ------
    FileFormatError
        If the document is not valid; the message names the zone and the key.

    Examples
    --------
    >>> ring = [[6, 49], [7, 49], [7, 50], [6, 49]]
    >>> volume = {"uomDimensions": "M", "horizontalProjection": {"type": "Polygon", "coordinates": [ring]}}
    >>> zone = {"identifier": "A", "restriction": "PROHIBITED", "geometry": [volume]}
    >>> read_document({"features": [zone]}, "zones.json")[0].label
    'A'
    """
    listed = document if isinstance(document, list) else Entry(document, file).items("features", empty=False)
    return [_zone(value, index, file) for index, value in enumerate(listed)]


def _zone(value: object, index: int, file: str) -> Zone:
    entry = Entry(value, f"{file}: zone {index}")
    identifier = entry.text("identifier")
    entry.where = f"{file}: zone {index} {shown(identifier)}"
    entry.require_spelling(ZONE)
    layers = [_layer(volume) for volume in entry.entries("geometry", empty=False)]
    return zone_of(entry, identifier, entry.choice("restriction", KINDS), layers, _periods(entry), file)


def zone_of(
    entry: Entry, identifier: str, kind: str, layers: Sequence[Layer], periods: tuple[Period, ...], file: str
) -> Zone:
    """Make a zone, with the data that both standards have under the same keys."""
    conditions = entry.values.get("restrictionConditions")
    return Zone(
        identifier=identifier,
        name=entry.wording("name"),
        kind=SPELLINGS.get(kind, kind),
        layers=tuple(layers),
        periods=periods,
        file=file,
        reason=reasons_of(entry),
        conditions="; ".join(map(str, conditions)) if isinstance(conditions, list) else str(conditions or ""),
        message=entry.wording("message"),
        authority=authorities_of(entry),
    )


def _layer(entry: Entry) -> Layer:
    """Read a volume."""
    entry.require_spelling(VOLUME)
    finite = entry.has("lowerLimit") or entry.has("upperLimit")
    unit = UNITS[entry.choice("uomDimensions", list(UNITS), None if finite else "M")]
    lower = limit_of(entry, "lowerLimit", "lowerVerticalReference", unit, GROUND)
    upper = limit_of(entry, "upperLimit", "upperVerticalReference", unit, UNLIMITED)
    lower, upper, flat = with_room(entry, lower, upper, "upperLimit")
    shape = entry.entry("horizontalProjection")
    if shape.choice("type", ["POLYGON", "CIRCLE"]) == "CIRCLE":
        # (the standard leaves open whether the unit of heights applies to the radius; metres give the larger circle)
        circle = circle_of(shape.values.get("center"), shape.values.get("radius"), shape.where, ("center", "radius"))
        return Layer(circle, lower, upper, flat)
    area, remark = area_of(shape.items("coordinates", empty=False), f"{shape.where}: coordinates")
    return Layer(area, lower, upper, "; ".join(filter(None, (flat, remark))))


def _periods(entry: Entry) -> tuple[Period, ...]:
    """Read when a zone applies; empty, which means always, if one period has no limits or there is none."""
    found = []
    for one in entry.entries("applicability"):
        permanent = one.choice("permanent", ["YES", "NO"], "NO")
        period = period_of(one)
        if permanent == "YES" or period == Period(None, None):
            return ()
        found.append(period)
    return tuple(found)


def limit_of(entry: Entry, key: str, reference: str, unit: float, missing: Limit) -> Limit:
    """
    Read a floor or a ceiling; return `missing` if there is none.

    Raises
    ------
    FileFormatError
        If it is not a number, or has no valid reference.

    Examples
    --------
    >>> entry = Entry({"upper": 400, "reference": "AGL"}, "zone 'A'")
    >>> limit_of(entry, "upper", "reference", FOOT, UNLIMITED)
    Limit(metres=121.92, reference='AGL')
    """
    if not entry.has(key):
        return missing
    value = entry.number(key)
    above = REFERENCES[entry.choice(reference, list(REFERENCES))]
    if value >= NO_CEILING and missing is UNLIMITED:
        value = math.inf
    return Limit(round(value * unit, 9), above)  # type: ignore[arg-type]


def with_room(entry: Entry, lower: Limit, upper: Limit, key: str) -> tuple[Limit, Limit, str]:
    """
    Return a floor and a ceiling between which there is room, and a remark, which may be empty.

    A ceiling that equals the floor does not say how high the zone is: it has neither.

    Raises
    ------
    FileFormatError
        If a floor is above its ceiling, and they have the same reference.

    Examples
    --------
    >>> entry = Entry({}, "zone 'A'")
    >>> with_room(entry, GROUND, Limit(0.0, "AGL"), "upper")[1:]
    (Limit(metres=inf, reference='AGL'), 'its floor and its ceiling are both 0 m AGL: it is closed at all heights')
    """
    if lower.reference != upper.reference or lower.metres < upper.metres:
        return lower, upper, ""
    if lower.metres > upper.metres:
        fault(f"{entry.where}: {key}", f"the ceiling, {upper}, is below the floor, {lower}", "correct either")
    return GROUND, UNLIMITED, f"its floor and its ceiling are both {upper}: it is closed at all heights"


def reasons_of(entry: Entry) -> str:
    """Return the reasons for a zone: words of the standard and free text."""
    value = entry.values.get("reason", entry.values.get("reasons"))
    words = value if isinstance(value, list) else [value]
    other = entry.wording("otherReasonInfo")
    return ", ".join([*(str(word) for word in words if word), *([other] if other else [])])


def authorities_of(entry: Entry) -> str:
    """Return the authorities of a zone with their contact data."""
    found = []
    for one in entry.entries("zoneAuthority"):
        parts = [one.wording(key) for key in ("name", "service", "email", "phone", "siteURL")]
        found.append(", ".join(dict.fromkeys(part for part in parts if part)))
    return "; ".join(dict.fromkeys(part for part in found if part))
