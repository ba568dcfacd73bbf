"""Reading of files of zones in all supported formats."""

import os
from collections.abc import Sequence
from pathlib import Path

from shapely.errors import ShapelyError

from cgla_graph._validate import file_path, items
from cgla_graph.airspace.zones import ed269, ed318, geojson, kml
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.zone import Format, Layer, NoArea, Validity, Zone
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import FilePath, fault, kind_of, read_bytes
from cgla_graph.untrusted.json_files import json_of
from cgla_graph.untrusted.json_maps import refuse_esri, require_wgs84
from cgla_graph.untrusted.kml_files import kml_of

#: Files that are kept in memory, at most.
MOST_CACHED = 8
_CACHE: dict[tuple[str, int, int], Zones] = {}


def read_zones(files: FilePath | Sequence[FilePath]) -> Zones:
    """
    Read zones that authorities publish: ED-269 or ED-318 (JSON), KML or KMZ, GeoJSON.

    The format is recognised by the content of a file. No zone is dropped: invalid content is an error that names the
    zone and the key, and lines, and points of a KML file, are listed.

    Parameters
    ----------
    files
        A path, or several.

    Returns
    -------
    zones
        The zones of all files; `Zones.apply` returns which are closed at an altitude and a time.

    Raises
    ------
    FileFormatError
        If a file cannot be read, has another format, or is not valid.

    Examples
    --------
    >>> import json, tempfile
    >>> ring = [[6, 49], [7, 49], [7, 50], [6, 49]]
    >>> volume = {"uomDimensions": "M", "horizontalProjection": {"type": "Polygon", "coordinates": [ring]}}
    >>> zone = {"identifier": "A", "restriction": "PROHIBITED", "geometry": [volume]}
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     path = Path(folder, "zones.json")
    ...     _ = path.write_text(json.dumps({"features": [zone]}))
    ...     read_zones(path).zones[0].kind
    'PROHIBITED'
    """
    paths = (
        [files]
        if isinstance(files, str | os.PathLike)
        else items("files", files, "a file of zones, or a list of files", FileFormatError)
    )
    read = [_read(path) for path in paths]
    return Zones(
        tuple(zone for one in read for zone in one.zones),
        tuple(other for one in read for other in one.no_areas),
        {name: kind for one in read for name, kind in one.formats.items()},
        tuple(validity for one in read for validity in one.validities),
    )


def is_geojson(path: FilePath) -> bool:
    """
    Return whether a file is GeoJSON of areas alone: it has no altitudes and times, and no lines that may be closed.

    Raises
    ------
    FileFormatError
        As in `read_zones`.
    """
    read = read_zones(path)
    return set(read.formats.values()) == {"GeoJSON"} and not read.no_areas


def _read(path: FilePath) -> Zones:
    """Read a file, from the cache if it did not change: loading a map reads it several times."""
    file = str(file_path("a file of zones", path, FileFormatError))
    try:
        about = Path(path).stat()
        key = (os.path.abspath(file), about.st_mtime_ns, about.st_size)  # noqa: PTH100 - links stay what they are
    except (OSError, ValueError):
        return zones_of(read_bytes(file), file)
    if key not in _CACHE:
        zones = zones_of(read_bytes(file), file)
        while len(_CACHE) >= MOST_CACHED:
            _CACHE.pop(next(iter(_CACHE)))
        _CACHE[key] = zones
    return _CACHE[key]


def zones_of(data: bytes, file: str) -> Zones:
    """
    Return the zones of the bytes of a file, named `file` in errors; the errors are those of `read_zones`.

    Examples
    --------
    >>> zones_of(b'{"type": "Polygon", "coordinates": [[[6, 49], [7, 49], [7, 50], [6, 49]]]}', "mine").formats
    {'mine': 'GeoJSON'}
    """
    kind = kind_of(data)
    zones: list[Zone] = []
    others: list[NoArea] = []
    validities: list[Validity] = []
    try:
        if kind in {"zip", "xml"}:
            found: Format = "KML"
            zones, others = kml.read_root(kml_of(data, file), file)
        elif kind == "json":
            document = json_of(data, file)
            refuse_esri(document, file)
            require_wgs84(document, file)
            if ed318.is_ed318(document):
                found = "ED-318"
                zones, validities = ed318.read_document(document, file)
            elif ed269.is_ed269(document):
                found = "ED-269"
                zones = ed269.read_document(document, file)
            else:
                found = "GeoJSON"
                areas, others = geojson.features_of(document, file)
                zones = [
                    Zone(
                        area.identifier or area.name,
                        area.name if area.identifier else "",
                        "UNCLASSIFIED",
                        (Layer(area.polygon),),
                        file=file,
                        category=area.kind,
                    )
                    for area in areas
                ]
        else:
            fault(file, "it is none of the formats of zones", "give ED-269, ED-318, KML, KMZ or GeoJSON")
    except ShapelyError as error:
        fault(file, f"a geometry in it is not valid ({error})", "repair it (shapely.make_valid)")
    return Zones(tuple(zones), tuple(others), {file: found}, tuple(validities))
