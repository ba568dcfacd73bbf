"""Files of planned paths: CSV, GeoJSON and JSON, chosen by the file's ending."""

import csv
import io
import json
import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cgla_graph._files import write_files
from cgla_graph._text import json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import file_path, unmasked
from cgla_graph.errors import OutputError
from cgla_graph.model.earth import LocalProjection, degrees_of

ENDINGS = (".csv", ".geojson", ".json")


def csv_of(path: FloatArray, projection: LocalProjection | None) -> str:
    """
    Return waypoints as CSV: x and y in map units, and longitude and latitude on a map in degrees.

    Examples
    --------
    >>> import numpy as np
    >>> csv_of(np.array([[0.0, 0.5]]), None).split()
    ['x,y', '0.0,0.5']
    """
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    if projection is None:
        writer.writerow(["x", "y"])
        writer.writerows(path.tolist())
    else:
        writer.writerow(["x", "y", "longitude", "latitude"])
        degrees = degrees_of(path, projection).tolist()
        writer.writerows([*place, *lonlat] for place, lonlat in zip(path.tolist(), degrees, strict=True))
    return text.getvalue()


def save_path(
    file: str | os.PathLike[str], path: FloatArray, projection: LocalProjection | None, numbers: Mapping[str, Any]
) -> Path:
    """
    Write a path and its numbers to a file, whole or not at all.

    Parameters
    ----------
    file
        A file that ends in one of `ENDINGS`; GeoJSON needs a map in degrees.
    path
        Waypoints, shape ``(m, 2)``, map units.
    projection
        The projection of a map in degrees; None in the plane.
    numbers
        Values written beside the waypoints; numbers that are not finite become null.

    Raises
    ------
    OutputError
        If there is no path, the ending is another one, or the file cannot be written.
    """
    target = file_path("file", file, OutputError)
    kind = target.suffix.lower()
    if kind not in ENDINGS:
        msg = f"{target}: no path is written so; give a file that ends in {', '.join(ENDINGS)}"
        raise OutputError(msg)
    if not len(unmasked("path", path)):
        msg = f"{target}: there is no path to write: {numbers.get('status', 'none was found')}"
        raise OutputError(msg)
    if kind == ".geojson" and projection is None:
        msg = f"{target}: the path has no longitudes and latitudes, only x and y; save it as .csv or .json"
        raise OutputError(msg)
    written = {key: json_number(value) if isinstance(value, float) else value for key, value in numbers.items()}
    degrees = None if projection is None else degrees_of(path, projection).tolist()
    if kind == ".csv":
        text = csv_of(path, projection)
    elif kind == ".json":
        lonlat = {} if degrees is None else {"path_lonlat": degrees}
        text = json.dumps({**written, "path": path.tolist(), **lonlat}, allow_nan=False, indent=1) + "\n"
    else:
        line = {"type": "LineString", "coordinates": degrees if len(path) > 1 else degrees * 2}  # type: ignore[operator]
        feature = {"type": "Feature", "properties": written, "geometry": line}
        text = json.dumps({"type": "FeatureCollection", "features": [feature]}, allow_nan=False, indent=1) + "\n"
    write_files({target: text.encode("utf-8")})
    return target
