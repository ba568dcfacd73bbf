"""Where a raster lies: on a plane, in degrees, or in a coordinate reference system that becomes degrees."""

import shlex
import warnings
from dataclasses import dataclass
from pathlib import Path
from typing import Literal, NamedTuple, NoReturn, TypeAlias, get_args

from cgla_graph._text import place, shown
from cgla_graph._types import Bounds
from cgla_graph._validate import bounds_box
from cgla_graph.errors import ProblemError
from cgla_graph.model.rasters.crs import CoordinateSystem, RasterWarning, Scale

Kind: TypeAlias = Literal["density", "count"]
Coordinates: TypeAlias = Literal["plane", "lonlat"]

#: Degrees a cell, from which on coordinates that nothing is said about are not suspected of being degrees.
DEGREE = 1.0


@dataclass(frozen=True, eq=False)
class RasterPlace:
    """
    Where a raster lies.

    Attributes
    ----------
    file
        The file, for messages.
    bounds
        The outer edges of the outer cells, in the file's coordinates.
    coordinates
        ``plane`` or ``lonlat``: the map that the raster is laid on.
    system
        The system of the file's coordinates; None for degrees on WGS84 (``lonlat``), or a plane without a place.
    """

    file: Path
    bounds: Bounds
    coordinates: Coordinates
    system: CoordinateSystem | None

    @property
    def degrees(self) -> Bounds:
        """
        The box around the raster, west, south, east, north, degrees.

        Raises
        ------
        ProblemError
            If a part of it is no place on the Earth.
        """
        if self.system is None:
            return self.bounds
        box = self.system.degrees_around(self.bounds)
        if box is None or not self.system.is_invertible(self.bounds):
            fail(self.file, f"some of its cells are no places on the Earth in {self.system.name}", warp(self.file))
        return box


class Said(NamedTuple):
    """What a raster file says of its place: rows and columns, and bounds and system where it has them."""

    shape: tuple[int, int]
    bounds: Bounds | None = None
    wkt: str | None = None


def placed(
    file: Path, said: Said, bounds: Bounds | None, coordinates: Coordinates | None, *, is_default: bool
) -> RasterPlace:
    """Return where a raster lies, of what its file and its reader say."""
    if coordinates is not None and coordinates not in get_args(Coordinates):
        msg = f"{file}: coordinates is {shown(coordinates)}; choose one of {', '.join(get_args(Coordinates))}"
        raise ProblemError(msg)
    if said.bounds is not None and bounds is not None:
        fail(file, f"it has bounds of its own, {said.bounds}", "leave out bounds")
    if said.bounds is None and bounds is None:
        fail(
            file,
            "it does not say where it lies",
            "give bounds, the outer edges of its cells: x_min, y_min, x_max, y_max",
        )
    try:
        box = bounds_box(said.bounds or bounds)
    except ProblemError as error:
        fail(file, str(error), "correct the bounds")
    if said.wkt is not None:
        return _on_earth(file, said.wkt, box, coordinates)
    unsaid = coordinates is None or is_default
    if unsaid and coordinates != "lonlat" and _may_be_degrees(box, said.shape):
        which = 'coordinates = "lonlat" (--coordinates lonlat), or "plane" for metres'
        if said.bounds is not None:
            wrong = f"nothing says in which coordinates it is, and its bounds {box} look like degrees"
            fail(file, wrong, f"give {which}")
        if box[:2] != (0.0, 0.0):
            # (those of a drawing board begin at 0, 0, where there is only sea)
            text = f"{file.name}: bounds {box} are taken for those of a plane; if they are degrees, give {which}"
            warnings.warn(text, RasterWarning, stacklevel=4)
    kind: Coordinates = coordinates or "plane"
    if kind == "lonlat" and not (box[0] >= -180.0 and box[2] <= 360.0 and box[1] >= -90.0 and box[3] <= 90.0):  # noqa: PLR2004
        fail(file, f"its bounds {box} are no degrees", "give west, south, east, north; longitudes may go on beyond 180")
    return RasterPlace(file, box, kind, None)


def _may_be_degrees(box: Bounds, shape: tuple[int, int]) -> bool:
    """Return whether bounds and cells of a raster may well be in degrees."""
    west, south, east, north = box
    rows, columns = shape
    cell = max((east - west) / columns, (north - south) / rows)
    return west >= -180.0 and east <= 360.0 and south >= -90.0 and north <= 90.0 and cell < DEGREE  # noqa: PLR2004


def _on_earth(file: Path, wkt: str, box: Bounds, coordinates: Coordinates | None) -> RasterPlace:
    """Return where a raster lies that names its system; of its own choice, on a plane where that is true."""
    try:
        system = CoordinateSystem.of_code(wkt, box)
    except ProblemError as error:
        msg = f"{place(file)}: {error}"
        raise ProblemError(msg) from error
    if note := system.datum_note:
        warnings.warn(f"{file.name}: {note}", RasterWarning, stacklevel=4)
    if system.is_wgs84:
        if coordinates == "plane":
            wrong = "its coordinates are of longitudes and latitudes; those of a plane, in metres, are needed"
            fail(file, wrong, 'set coordinates = "lonlat"')
        west, south, east, north = box
        if not (west >= -180.0 and east <= 360.0 and south >= -90.0 and north <= 90.0):  # noqa: PLR2004
            fail(file, f"its bounds {box} are no degrees", "give it the right place")
        return RasterPlace(file, box, "lonlat", None)
    if coordinates == "lonlat":
        return RasterPlace(file, box, "lonlat", system)
    scale = Scale.over(system, box)
    if coordinates == "plane" and not scale.is_true:
        fail(file, f"its coordinates are no metres ({system.name}: {scale.text} those on the ground)", in_degrees(file))
    return RasterPlace(file, box, "plane" if scale.is_true else "lonlat", system)


def said_if_laid(at: RasterPlace) -> None:
    """Warn that a raster is laid on another plane than its own, because lengths there are not those on the Earth."""
    if at.coordinates == "lonlat" and at.system is not None:
        how = f"coordinates in {at.system.name} are {Scale.over(at.system, at.bounds).text} the metres on the ground"
        text = f"{at.file.name}: {how}; it is laid on a plane in metres of its own, and its total stays the same"
        warnings.warn(text, RasterWarning, stacklevel=3)


def in_degrees(file: Path) -> str:
    """Return the remedy for a raster on no plane."""
    return f'set coordinates = "lonlat" and give places in degrees, or {warp(file)}'


def warp(file: Path, kind: Kind | None = None, *, metres: bool = False) -> str:
    """
    Return the command that lays a raster in degrees, or in `metres`.

    Examples
    --------
    >>> warp(Path("a.tif"), "count")
    'warp it: gdalwarp -t_srs EPSG:4326 -r sum a.tif a-lonlat.tif'
    """
    how = "sum" if kind == "count" else "average"
    name = shlex.quote(file.name)
    if metres:
        return f"warp it to metres: gdalwarp -t_srs EPSG:CODE -r {how} {name} {shlex.quote(file.stem + '-metres.tif')}"
    counts = " (of counts: -r sum, which keeps their total)" if kind is None else ""
    return f"warp it: gdalwarp -t_srs EPSG:4326 -r {how} {name} {shlex.quote(file.stem + '-lonlat.tif')}{counts}"


def fail(file: Path, wrong: str, remedy: str) -> NoReturn:
    """Raise the error that a raster file has something wrong."""
    msg = f"{place(file)}: {wrong}; {remedy}"
    raise ProblemError(" ".join(msg.split()))
