"""Files beside a raster that say what its own does not: ``.aux.xml`` of GDAL, ``.prj``, and world files."""

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from cgla_graph._text import shown
from cgla_graph._types import Bounds
from cgla_graph.untrusted.files import fault, read_bytes, read_text
from cgla_graph.untrusted.numbers import plain_numbers
from cgla_graph.untrusted.xml_files import child_text, tag_of, xml_of

#: Endings of world files beside a GeoTIFF.
WORLD = (".tfw", ".tifw", ".tiffw", ".wld")
#: Part of a cell by which two statements of where a raster lies may differ.
PART = 0.01

ValueT = TypeVar("ValueT", bound=float | str)


@dataclass(frozen=True)
class Aux:
    """
    What a ``.aux.xml`` of GDAL says about a raster of one band; None where it says nothing.

    Attributes
    ----------
    file
        Its name for messages.
    nodata, scale, offset
        Of the band.
    wkt
        The coordinate reference system.
    transform
        x of the upper left corner, width of a cell, 0, y of that corner, 0, minus the height.
    """

    file: str = ""
    nodata: float | None = None
    scale: float | None = None
    offset: float | None = None
    wkt: str | None = None
    transform: tuple[float, ...] | None = None

    @classmethod
    def beside(cls, raster: Path) -> "Aux":
        """
        Read the one beside a raster, if there is any.

        Raises
        ------
        FileFormatError
            If it is malformed, or gives points of control instead of a transform.

        Examples
        --------
        >>> Aux.beside(Path("no such raster.tif")).nodata is None
        True
        """
        path = raster.with_name(f"{raster.name}.aux.xml")
        if not path.exists():
            return cls()
        root, name = xml_of(read_bytes(path), str(path)), str(path)
        if tag_of(root) != "PAMDataset":
            fault(name, f"its root is {shown(tag_of(root))}, not PAMDataset", "write it with GDAL, or remove it")
        if any(tag_of(one) == "GCPList" for one in root):
            fault(name, "it places the raster by points of control", f"warp it (gdalwarp {raster.name} OUT.tif)")
        bands = [one for one in root if tag_of(one) == "PAMRasterBand" and one.get("band", "1") == "1"]
        texts = {tag: next(filter(None, (child_text(one, tag) for one in bands)), "") for tag in _TAGS}
        said = {tag: _numbers(name, tag, [text], 1)[0] if text else None for tag, text in texts.items()}
        transform = child_text(root, "GeoTransform")
        return cls(
            name,
            said["NoDataValue"],
            said["Scale"],
            said["Offset"],
            child_text(root, "SRS") or None,
            _numbers(name, "GeoTransform", transform.split(","), 6) if transform else None,
        )

    def settled(self, name: str, own: ValueT | None, beside: ValueT | None) -> ValueT | None:
        """
        Return a value that the raster or this file states; if they differ, it is an error.

        Raises
        ------
        FileFormatError
            If they differ.

        Examples
        --------
        >>> Aux("a.tif.aux.xml").settled("nodata", None, 65535.0)
        65535.0
        """
        if own is None or beside is None:
            return beside if own is None else own
        same = own == beside
        if isinstance(own, float) and isinstance(beside, float):
            # (a value of 32 bits may be written with fewer digits)
            same = math.isclose(own, beside, rel_tol=1e-6) or (math.isnan(own) and math.isnan(beside))
        if not same:
            fault(self.file, f"it says {name} {shown(beside)}, the raster itself {shown(own)}", "remove the wrong one")
        return own


_TAGS = ("NoDataValue", "Scale", "Offset")


def prj_beside(raster: Path) -> str | None:
    """
    Return the definition in the ``.prj`` beside a raster; None if there is none.

    Examples
    --------
    >>> prj_beside(Path("no such raster.asc")) is None
    True
    """
    path = next((one for one in (raster.with_suffix(".prj"), raster.with_suffix(".PRJ")) if one.exists()), None)
    return None if path is None else read_text(path).strip()


def require_same_world(raster: Path, bounds: Bounds, shape: tuple[int, int]) -> None:
    """
    Check that a world file beside a GeoTIFF, if there is any, says of its place what the GeoTIFF does.

    Raises
    ------
    FileFormatError
        If it is malformed, or says something else.
    """
    path = next((one for ending in WORLD if (one := raster.with_suffix(ending)).exists()), None)
    if path is None:
        return
    width, turned, turned_too, height, x, y = _numbers(str(path), "it", read_text(path).split(), 6)
    require_same_place(str(path), (x - 0.5 * width, width, turned_too, y - 0.5 * height, turned, height), bounds, shape)


def require_same_place(file: str, transform: tuple[float, ...], bounds: Bounds, shape: tuple[int, int]) -> None:
    """
    Check that a transform places a raster of a shape, ``(rows, columns)``, at its bounds.

    Raises
    ------
    FileFormatError
        If it does not.

    Examples
    --------
    >>> require_same_place("a.tfw", (0.0, 10.0, 0.0, 20.0, 0.0, -10.0), (0.0, 0.0, 30.0, 20.0), (2, 3))
    """
    rows, columns = shape
    x, width, _, y, _, height = transform
    low, high = sorted((y, y + rows * height))
    there = (x, low, x + columns * width, high)
    off = max(abs(one - other) for one, other in zip(there, bounds, strict=True))
    if transform[2] or transform[4] or off > PART * min(abs(width), abs(height)):
        fault(file, f"it places the raster at {there}, the raster itself at {bounds}", "remove the wrong one")


def _numbers(file: str, name: str, words: list[str], count: int) -> tuple[float, ...]:
    """Return words as numbers."""
    try:
        found = plain_numbers([word.strip() for word in words])
    except ValueError as error:
        fault(file, f"{name}: {error}", "write numbers")
    if len(found) != count:
        fault(file, f"{name} has {len(found)} numbers instead of {count}", "write it once more, or remove the file")
    return tuple(found.tolist())
