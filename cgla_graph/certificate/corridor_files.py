"""Files of a corridor: GeoJSON and KML with its polygons and paths, CSV with its ways."""

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path
from typing import Any, Final
from xml.sax.saxutils import escape

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._files import write_files
from cgla_graph._text import json_number, place
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path
from cgla_graph.certificate.corridor import Corridor
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import degrees_of
from cgla_graph.model.problem import Problem

#: Endings of files of corridors.
ENDINGS: Final = (".geojson", ".kml", ".csv")
#: Columns of the table of ways.
COLUMNS: Final = ("way", "known", "passes", "cost", "lower_bound", "excess", "waypoints")
#: Colours of the corridor, of what is certain, and of ways: alpha, blue, green, red in KML.
_COLOURS: Final = {"corridor": "4000a5ff", "certain": "6000a03c", "way": "ffb04020"}


def save_corridor(corridor: Corridor, path: str | Path, name: str = "corridor") -> Path:
    """
    Write a corridor, as its ending says.

    GeoJSON holds the corridor, the cells that are certain, and the path of each way; coordinates are longitude and
    latitude, or map units on a map in the plane, which the member ``coordinates`` says. KML holds the same; it needs
    longitudes and latitudes. CSV holds a row for each way.

    Parameters
    ----------
    corridor
        The corridor.
    path
        The file: ``.geojson``, ``.kml`` or ``.csv``.
    name
        Name of the map in the file.

    Raises
    ------
    OutputError
        If the ending is another one, the map has no longitudes and latitudes (KML), or the file cannot be written.

    Examples
    --------
    >>> import tempfile
    >>> import cgla_graph as cg
    >>> found = cg.lower_bound(cg.Problem((0.1, 0.5), (0.9, 0.5))).corridor(0.02)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     file = save_corridor(found, Path(folder) / "mine.geojson")
    ...     [feature["properties"]["name"] for feature in json.loads(file.read_text())["features"]]
    ['corridor', 'certain', 'way 1']
    """
    target = Path(file_path("path", path, OutputError))
    ending = target.suffix.lower()
    if ending not in ENDINGS:
        msg = f"{place(target)}: corridors have no such format; give a file that ends in {', '.join(ENDINGS)}"
        raise OutputError(msg)
    if ending == ".kml" and corridor.problem.projection is None:
        msg = f"{place(target)}: KML needs longitudes and latitudes, and this map has none; give a .geojson"
        raise OutputError(msg)
    if ending == ".csv":
        text = ways_csv(corridor)
    else:
        text = kml_text(corridor, name) if ending == ".kml" else geojson_text(corridor, name)
    write_files({target: text.encode()})
    return target


def way_rows(corridor: Corridor) -> Iterator[dict[str, Any]]:
    """Yield a row for each way, with `COLUMNS`; numbers that do not exist are None."""
    for number, way in enumerate((*corridor.ways.known, *corridor.ways.undecided), 1):
        yield {
            "way": number,
            "known": "yes" if way.cost <= corridor.limit else "open",
            "passes": way.passes,
            "cost": json_number(way.cost),
            "lower_bound": json_number(way.lower_bound),
            "excess": json_number(way.cost / corridor.upper_bound - 1.0),
            "waypoints": 0 if way.path is None else len(way.path),
        }


def ways_csv(corridor: Corridor) -> str:
    """Return the table of ways."""
    text = io.StringIO()
    writer = csv.DictWriter(text, COLUMNS, lineterminator="\n")
    writer.writeheader()
    writer.writerows({key: "" if one is None else one for key, one in row.items()} for row in way_rows(corridor))
    return text.getvalue()


def geojson_text(corridor: Corridor, name: str) -> str:
    """Return the corridor as GeoJSON."""
    features = [
        {"type": "Feature", "properties": properties, "geometry": shapely.geometry.mapping(shape)}
        for properties, shape in _features(corridor)
    ]
    units = "map units" if corridor.problem.projection is None else "longitude, latitude"
    document = {"type": "FeatureCollection", "name": name, "coordinates": units, "features": features}
    return json.dumps(document, ensure_ascii=False, allow_nan=False) + "\n"


def kml_text(corridor: Corridor, name: str) -> str:
    """Return the corridor of a map in degrees as KML 2.2."""
    lines = ['<?xml version="1.0" encoding="UTF-8"?>', '<kml xmlns="http://www.opengis.net/kml/2.2">', "<Document>"]
    lines += [f"<name>{escape(name)}</name>", f"<description>{escape(corridor.message)}</description>"]
    for style, colour in _COLOURS.items():
        line = f"<LineStyle><color>ff{colour[2:]}</color><width>2</width></LineStyle>"
        lines.append(f'<Style id="{style}">{line}<PolyStyle><color>{colour}</color></PolyStyle></Style>')
    for properties, shape in _features(corridor):
        told = ", ".join(f"{key}: {one}" for key, one in properties.items() if key != "name" and one is not None)
        style = str(properties["name"]).split(" ", maxsplit=1)[0]
        lines.append(
            f"<Placemark><name>{escape(str(properties['name']))}</name><description>{escape(told)}</description>"
        )
        lines.append(f"<styleUrl>#{style}</styleUrl><MultiGeometry>")
        lines += [_kml_of(part) for part in shapely.get_parts(shape)]
        lines.append("</MultiGeometry></Placemark>")
    return "\n".join([*lines, "</Document>", "</kml>"]) + "\n"


def _kml_of(part: BaseGeometry) -> str:
    """Return a polygon or a line as KML."""

    def coordinates(ring: BaseGeometry) -> str:
        return " ".join(f"{x:.10g},{y:.10g}" for x, y in shapely.get_coordinates(ring).tolist())

    if part.geom_type == "LineString":
        return f"<LineString><tessellate>1</tessellate><coordinates>{coordinates(part)}</coordinates></LineString>"
    rings = [
        f"<{kind}><LinearRing><coordinates>{coordinates(ring)}</coordinates></LinearRing></{kind}>"
        for kind, ring in zip(
            ["outerBoundaryIs", *["innerBoundaryIs"] * shapely.get_num_interior_rings(part)],
            shapely.get_rings(part),
            strict=True,
        )
    ]
    return f"<Polygon><tessellate>1</tessellate>{''.join(rings)}</Polygon>"


def _features(corridor: Corridor) -> Iterator[tuple[dict[str, Any], BaseGeometry]]:
    """Yield the shapes of a corridor in the coordinates of files, with their properties; empty ones are left out."""
    numbers = {key: one for key, one in corridor.document().items() if not isinstance(one, list)}
    for name, shape, more in (("corridor", corridor.outer, numbers), ("certain", corridor.inner, {})):
        if not shape.is_empty:
            yield {"name": name, **more}, shapely.orient_polygons(as_written(corridor.problem, shape))
    for number, way in enumerate((*corridor.ways.known, *corridor.ways.undecided), 1):
        if way.path is not None and len(way.path) > 1:
            inside = way.cost <= corridor.limit
            told = {"name": f"way {number}", "within_delta_of_the_known_path": inside, **way.document()}
            yield told, as_written(corridor.problem, shapely.LineString(way.path))


def as_written(problem: Problem, shape: BaseGeometry) -> BaseGeometry:
    """
    Return a shape in degrees, with sides that are straight on the map, or in map units.

    Examples
    --------
    >>> as_written(Problem((0, 0), (1, 1)), shapely.Point(0.5, 0.5)).wkt
    'POINT (0.5 0.5)'
    """
    projection = problem.projection
    if projection is None:
        return shape

    def degrees(points: FloatArray) -> FloatArray:
        return np.asarray(degrees_of(points, projection))

    return shapely.transform(shape, degrees)
