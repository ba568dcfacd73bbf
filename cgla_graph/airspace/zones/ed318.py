"""Reader of ED-318 (EUROCAE, 2024): zones as GeoJSON with layers, and circles as points with an extent."""

from cgla_graph._text import shown
from cgla_graph.airspace.zones.ed269 import KINDS, UNITS, limit_of, with_room, zone_of
from cgla_graph.airspace.zones.entries import Entry
from cgla_graph.airspace.zones.periods import Period, moment_of, period_of
from cgla_graph.airspace.zones.rings import area_of
from cgla_graph.airspace.zones.shapes import circle_of, joined, short
from cgla_graph.airspace.zones.zone import GROUND, UNLIMITED, Layer, Validity, Zone
from cgla_graph.untrusted.files import fault

#: Keys of properties and of geometries that no other GeoJSON has.
OWN_PROPERTIES = {"zoneAuthority", "limitedApplicability", "variant", "restrictionConditions", "regulationExemption"}
OWN_MEMBERS = {"layer", "extent"}
#: Keys of zones that restrict when they apply, and keys of layers.
ZONE = ("limitedApplicability",)
LAYER = ("uom", "lower", "lowerReference", "upper", "upperReference")
#: Keys of the metadata of a file: of the standard, and of Ireland's files.
METADATA = ("metadata", "datasetMetadata")


def is_ed318(document: object) -> bool:
    """
    Return whether a document is of this standard: a feature has a key that no other GeoJSON has.

    Examples
    --------
    >>> is_ed318({"type": "Feature", "properties": {"variant": "COMMON"}, "geometry": None})
    True
    >>> is_ed318({"type": "Feature", "properties": {"name": "harbour"}, "geometry": None})
    False
    """
    if not isinstance(document, dict):
        return False
    features = document.get("features") if document.get("type") == "FeatureCollection" else [document]
    return isinstance(features, list) and any(isinstance(one, dict) and _is_own(one) for one in features)


def _is_own(feature: dict[str, object]) -> bool:
    """Return whether a feature has a key of this standard."""
    properties, geometry = feature.get("properties"), feature.get("geometry")
    if isinstance(properties, dict) and (properties.keys() & OWN_PROPERTIES or "UASZone" in properties):
        return True
    if not isinstance(geometry, dict):
        return False
    parts = geometry.get("geometries")
    inside = [part for part in parts if isinstance(part, dict)] if isinstance(parts, list) else []
    return any(part.keys() & OWN_MEMBERS for part in (geometry, *inside))


def read_document(document: object, file: str) -> tuple[list[Zone], list[Validity]]:
    """
    Return the zones of a parsed document, named `file` in errors, and the period in which it is valid.

    Raises
    ------
    FileFormatError
        If the document is not valid; the message names the zone and the key.

    Examples
    --------
    >>> point = {"type": "Point", "coordinates": [6, 49], "extent": {"subType": "Circle", "radius": 500}}
    >>> properties = {"identifier": "A", "type": "PROHIBITED", "variant": "COMMON"}
    >>> feature = {"type": "Feature", "properties": properties, "geometry": point}
    >>> zones, _ = read_document(feature, "zones.json")
    >>> zones[0].layers[0].upper.metres
    inf
    """
    whole = Entry(document, file)
    validities = [_validity(whole.entry(key), file) for key in METADATA if whole.has(key)]
    if whole.values.get("type") == "Feature":
        return [_zone(document, 0, file)], validities
    features = whole.items("features", empty=False)
    return [_zone(value, index, file) for index, value in enumerate(features)], validities


def _validity(about: Entry, file: str) -> Validity:
    """Read the period in which a file is valid."""
    about.require_spelling(("validFrom", "validTo"))
    _, first, last = (moment_of(about, key) if about.has(key) else None for key in ("issued", "validFrom", "validTo"))
    return Validity(file, first, last)


def _zone(value: object, index: int, file: str) -> Zone:
    feature = Entry(value, f"{file}: zone {index}")
    feature.choice("type", ["FEATURE"])
    about = feature.entry("properties")
    about = about.entry("UASZone") if about.has("UASZone") else about
    about.where = feature.where
    identifier = about.text("identifier")
    feature.where = about.where = f"{file}: zone {index} {shown(identifier)}"
    about.require_spelling(ZONE)
    layers = _layers(feature.entry("geometry"), Entry(feature.values["properties"], about.where))
    return zone_of(about, identifier, about.choice("type", KINDS), layers, _periods(about), file)


def _layers(geometry: Entry, about: Entry, *, nested: bool = False) -> list[Layer]:
    """Read the layers of a geometry or of a collection."""
    kind = geometry.values.get("type")
    if kind == "GeometryCollection" and not nested:
        parts = geometry.entries("geometries", empty=False)
        return [layer for part in parts for layer in _layers(part, about, nested=True)]
    # (an early draft has the layer beside the geometry)
    holder = about if about.has("verticalLayer") and not geometry.has("layer") else geometry
    key = "layer" if holder is geometry else "verticalLayer"
    lower, upper, flat = GROUND, UNLIMITED, ""
    if holder.has(key):
        layer = holder.entry(key)
        layer.require_spelling(LAYER)
        heights = [layer.values.get(side) for side in ("lower", "upper")]
        # (a height of 0 has no unit)
        unit = UNITS[layer.choice("uom", list(UNITS), None if any(heights) else "M")]
        lower = limit_of(layer, "lower", "lowerReference", unit, GROUND)
        upper = limit_of(layer, "upper", "upperReference", unit, UNLIMITED)
        lower, upper, flat = with_room(layer, lower, upper, "upper")
    where = f"{geometry.where}: coordinates"
    if kind == "Point":
        if not geometry.has("extent"):
            geometry.wrong("extent", 'a point has no area: give {"subType": "Circle", "radius": metres}')
        extent = geometry.entry("extent")
        extent.choice("subType", ["CIRCLE"])
        circle = circle_of(
            geometry.values.get("coordinates"), extent.values.get("radius"), geometry.where, ("coordinates", "radius")
        )
        return [Layer(circle, lower, upper, flat)]
    if kind == "Polygon":
        area, remark = area_of(geometry.items("coordinates", empty=False), where)
    elif kind == "MultiPolygon":
        found = []
        for index, rings in enumerate(geometry.items("coordinates", empty=False)):
            if not isinstance(rings, list) or not rings:
                fault(f"{where}[{index}]", f"it is {short(rings)}", "give a list of rings")
            found.append(area_of(rings, f"{where}[{index}]"))
        remark = next((one for _, one in found if one), "")
        area = joined([area for area, _ in found])
    else:
        geometry.wrong("type", "give one of Polygon, MultiPolygon, Point, GeometryCollection (of these)")
    return [Layer(area, lower, upper, "; ".join(filter(None, (flat, remark))))]


def _periods(about: Entry) -> tuple[Period, ...]:
    """Read when a zone applies; empty, which means always, if one period has no limits or there is none."""
    found = [period_of(one) for one in about.entries("limitedApplicability")]
    return () if Period(None, None) in found else tuple(found)
