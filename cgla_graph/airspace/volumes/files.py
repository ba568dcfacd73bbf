"""Files of volumes: KML for viewers and authorities, GeoJSON for everything else."""

import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final
from xml.sax.saxutils import escape

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._files import write_files
from cgla_graph._text import place
from cgla_graph._validate import file_path
from cgla_graph.airspace.flight_plans.plan import decimal
from cgla_graph.airspace.volumes.outlines import cut_at_antimeridian
from cgla_graph.errors import OutputError
from cgla_graph.untrusted.files import FilePath

#: Endings of files of volumes.
ENDINGS: Final = (".kml", ".geojson")
#: Colours of flight geography, contingency volume and ground risk buffer: alpha, blue, green, red in KML.
_COLOURS: Final = ("00a000", "f0b000", "d02020")
_ABOVE: Final = "ground"


@dataclass(frozen=True)
class VolumeArea:
    """
    One of the volumes, as it is written.

    Attributes
    ----------
    name
        Its name.
    area
        Degrees; longitudes may go on beyond 180.
    top
        Greatest height above ground, metres; 0 on the ground.
    words
        Its dimensions in words.
    """

    name: str
    area: BaseGeometry
    top: float
    words: str

    @property
    def polygons(self) -> list[Polygon]:
        """Its polygons with longitudes from -180 to 180, outer rings counterclockwise."""
        parts = cut_at_antimeridian(self.area)  # type: ignore[arg-type]
        return [shapely.orient_polygons(part) for part in parts]


def check_ending(path: FilePath) -> Path:
    """
    Return the path of a file of volumes, if its ending is known.

    Raises
    ------
    OutputError
        If it is not.

    Examples
    --------
    >>> check_ending("mine.kml").name
    'mine.kml'
    """
    target = Path(file_path("path", path, OutputError))
    if target.suffix.lower() not in ENDINGS:
        msg = f"{place(target)}: volumes have no such format; give a file that ends in {' or '.join(ENDINGS)}"
        raise OutputError(msg)
    return target


def write_areas(name: str, notes: Sequence[str], areas: Sequence[VolumeArea], path: FilePath) -> Path:
    """
    Write volumes as KML or GeoJSON, by the ending of the file.

    Raises
    ------
    OutputError
        If the ending is another one, there are no areas in degrees, or the file cannot be written.
    """
    target = check_ending(path)
    if not areas:
        msg = f"{place(target)}: volumes of a map in the plane have no longitudes and latitudes; document() has x and y"
        raise OutputError(msg)
    text = kml_text(name, notes, areas) if target.suffix.lower() == ".kml" else geojson_text(name, notes, areas)
    write_files({target: text.encode()})
    return target


def geojson_text(name: str, notes: Sequence[str], areas: Sequence[VolumeArea]) -> str:
    """
    Return volumes as GeoJSON (RFC 7946): a feature each, with heights above ground as properties.

    Examples
    --------
    >>> area = VolumeArea("flight geography", shapely.box(24, 60, 25, 61), 80.0, "")
    >>> json.loads(geojson_text("mine", [], [area]))["features"][0]["properties"]["upper"]
    80.0
    """
    features = [
        {
            "type": "Feature",
            "properties": {
                "name": one.name,
                "flight": name,
                "dimensions": one.words,
                "lower": 0.0,
                "upper": one.top,
                "reference": _ABOVE,
                "unit": "m",
                "contains": [inner.name for inner in areas[:index]],
            },
            "geometry": shapely.MultiPolygon(one.polygons).__geo_interface__
            if len(one.polygons) > 1
            else one.polygons[0].__geo_interface__,
        }
        for index, one in enumerate(areas)
    ]
    document: dict[str, Any] = {"type": "FeatureCollection", "name": name, "notes": list(notes), "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n"


def kml_text(name: str, notes: Sequence[str], areas: Sequence[VolumeArea]) -> str:
    """
    Return volumes as KML 2.2: a placemark each, as high as it is above ground.

    Examples
    --------
    >>> area = VolumeArea("flight geography", shapely.box(24, 60, 25, 61), 80.0, "")
    >>> "25,60,80 25,61,80" in kml_text("mine", [], [area])
    True
    """
    head = ['<?xml version="1.0" encoding="UTF-8"?>', '<kml xmlns="http://www.opengis.net/kml/2.2">', "<Document>"]
    head += [f"<name>{escape(name)}</name>", f"<description>{escape(chr(10).join(notes))}</description>"]
    for number, colour in enumerate(_COLOURS):
        turned = colour[4:] + colour[2:4] + colour[:2]
        lines = f"<LineStyle><color>ff{turned}</color><width>2</width></LineStyle>"
        head.append(f'<Style id="v{number}">{lines}<PolyStyle><color>50{turned}</color></PolyStyle></Style>')
    # the widest first, so that it is below the others
    body = [line for number in reversed(range(len(areas))) for line in _placemark(areas[number], number)]
    return "\n".join([*head, *body, "</Document>", "</kml>"]) + "\n"


def _placemark(one: VolumeArea, number: int) -> Iterator[str]:
    yield f"<Placemark><name>{escape(one.name)}</name><description>{escape(one.words)}</description>"
    yield f"<styleUrl>#v{number}</styleUrl><ExtendedData>"
    for key, value in (("lower", "0"), ("upper", decimal(one.top)), ("reference", _ABOVE), ("unit", "m")):
        yield f'<Data name="{key}"><value>{value}</value></Data>'
    yield "</ExtendedData><MultiGeometry>"
    for polygon in one.polygons:
        mode = "<extrude>1</extrude><altitudeMode>relativeToGround</altitudeMode>" if one.top > 0.0 else ""
        rings = [("outerBoundaryIs", polygon.exterior), *(("innerBoundaryIs", ring) for ring in polygon.interiors)]
        yield f"<Polygon>{mode}" if mode else "<Polygon><tessellate>1</tessellate>"
        for kind, ring in rings:
            high = f",{decimal(one.top)}" if one.top > 0.0 else ""
            corners = " ".join(f"{decimal(x)},{decimal(y)}{high}" for x, y in ring.coords)
            yield f"<{kind}><LinearRing><coordinates>{corners}</coordinates></LinearRing></{kind}>"
        yield "</Polygon>"
    yield "</MultiGeometry></Placemark>"
