"""Readers of raster files (GeoTIFF, ESRI ASCII grids, CSV, NumPy), and their projection from degrees to metres."""

import gzip
import math
import os
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, Literal, NoReturn, TypeAlias, TypeVar, get_args

import numpy as np
from numpy.typing import NDArray

from cgla_graph._text import place, shown
from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import bounds_box, file_path, non_negative_number
from cgla_graph.errors import FileFormatError, ProblemError
from cgla_graph.model.earth import LocalProjection, wrapped
from cgla_graph.untrusted.arrays import ArrayHeader, archive_names, read_archive, read_elements, read_header
from cgla_graph.untrusted.json_maps import WGS84
from cgla_graph.untrusted.numbers import plain_numbers

Kind: TypeAlias = Literal["density", "count"]
Coordinates: TypeAlias = Literal["plane", "lonlat"]
ReadT = TypeVar("ReadT")

#: Endings of files that hold rasters.
GEOTIFF = (".tif", ".tiff")
ENDINGS = (*GEOTIFF, ".asc", ".npy", ".npz", ".csv", ".csv.gz")
#: Characters a line of text at most, and characters a cell.
LONGEST_LINE, CHARACTERS = 1 << 24, 32
#: Metres from the origin of a projection; beyond this it distorts areas by more than a percent.
FARTHEST = 1_500_000.0
#: Nodes a side of the grid between which projections are interpolated, by splines of degree 5.
NODES = 33
#: Sub-points that are projected at a time.
CHUNK = 2_000_000


@dataclass(frozen=True, eq=False)
class RasterCells:
    """
    The cells of a file.

    Attributes
    ----------
    values
        Shape ``(rows, columns)``, row 0 at the greatest y (the north); NaN where there are no data.
    bounds
        The outer edges of the outer cells, in the file's coordinates.
    coordinates
        ``plane`` or ``lonlat``, degrees.
    """

    values: FloatArray
    bounds: Bounds
    coordinates: Coordinates


def read_cells(
    path: str | os.PathLike[str],
    *,
    most: int,
    bounds: Bounds | None = None,
    coordinates: Coordinates | None = None,
    origin: str = "upper",
    signed: bool = False,
) -> RasterCells:
    """
    Read the cells of a raster file, whose size is checked against `most` cells before memory is allocated.

    Negative values are refused unless the raster is `signed`.

    Raises
    ------
    ProblemError
        If the file is malformed; the message names the file, the fault and the remedy.
    """
    file = file_path("the raster file", path)
    ending = _ending(file)
    if not file.is_file():
        msg = f"{file}: there is no such file: check the name and the folder"
        raise ProblemError(msg)
    if coordinates is not None and coordinates not in get_args(Coordinates):
        msg = f"{file}: coordinates is {shown(coordinates)}; choose one of {', '.join(get_args(Coordinates))}"
        raise ProblemError(msg)
    said, own, about = _read(file, ending, most)
    if own is not None and bounds is not None:
        _fail(file, f"it has bounds of its own, {own}", "leave out bounds")
    if own is None and bounds is None:
        _fail(
            file,
            "it does not say where it lies",
            "give bounds, the outer edges of its cells: x_min, y_min, x_max, y_max",
        )
    if own is not None and origin != "upper":
        _fail(file, f"origin is {shown(origin)}, but such files say themselves that row 0 is upper", "leave out origin")
    if about is not None and coordinates is not None and about != coordinates:
        kinds = {"plane": "a plane, in metres", "lonlat": "longitudes and latitudes"}
        remedy = (
            'set coordinates = "lonlat"' if about == "lonlat" else "warp it to EPSG:4326 (gdalwarp -t_srs EPSG:4326)"
        )
        _fail(file, f"its coordinates are of {kinds[about]}; those of {kinds[coordinates]} are needed", remedy)
    kind: Coordinates = about or coordinates or "plane"
    try:
        box = bounds_box(own or bounds)
    except ProblemError as error:
        _fail(file, str(error), "correct the bounds")
    if kind == "lonlat" and not (box[0] >= -180.0 and box[2] <= 360.0 and box[1] >= -90.0 and box[3] <= 90.0):  # noqa: PLR2004
        _fail(
            file, f"its bounds {box} are no degrees", "give west, south, east, north; longitudes may go on beyond 180"
        )
    _require_risk(file, said, signed=signed)
    return RasterCells(said[::-1] if origin == "lower" else said, box, kind)


def in_degrees(path: str | os.PathLike[str]) -> bool:
    """
    Return whether a raster file declares coordinates in degrees, which only a GeoTIFF can. No cell is read.

    Raises
    ------
    ProblemError
        As `read_cells`.
    """
    file = Path(path)
    if _ending(file) not in GEOTIFF or not file.is_file():
        return False
    return _read_safely(file, lambda: _geotiff(file, None)[2]) == "lonlat"


def cells_in_metres(
    path: str | os.PathLike[str],
    cells: RasterCells,
    *,
    kind: Kind,
    nodata: float | None,
    projection: LocalProjection | None,
    most: int,
) -> RasterCells:
    """
    Turn the cells of a file into densities on a plane: counts are divided by areas, degrees become metres.

    The sum of density times area stays the same up to rounding; for a raster of counts, it is the total count. Cells
    without data that stand for 0 stay without data; of a raster in degrees, new cells that cover only such cells.

    Parameters
    ----------
    path
        The file, for error messages.
    cells
        As `read_cells` gives them.
    kind
        ``count`` (of each cell) or ``density``.
    nodata
        Value of cells without data (NaN), in the file's own units; None refuses them.
    projection
        Projection of degrees; None for one around the middle of the raster.
    most
        Cells at most.

    Raises
    ------
    ProblemError
        If `kind` is unknown, there are cells without data but no `nodata`, or the raster is too wide for a plane.
    """
    file = Path(path)
    if kind not in get_args(Kind):
        msg = f"{file}: kind is {shown(kind)}; choose one of {', '.join(get_args(Kind))}"
        raise ProblemError(msg)
    missing = np.isnan(cells.values)
    if nodata is None and missing.any():
        row, column = np.argwhere(missing)[0].tolist()
        wrong = f"{int(missing.sum())} of its cells have no data, the first in row {row}, column {column}"
        _fail(file, wrong, "say what they stand for with nodata, as nodata = 0 (--nodata 0)")
    fill = 0.0 if nodata is None else non_negative_number("nodata", nodata)
    filled = np.where(missing, fill, cells.values) if fill > 0.0 else cells.values
    if cells.coordinates == "plane":
        if projection is not None:
            _fail(file, "a projection is for longitudes and latitudes, and this raster is on a plane", "leave it out")
        if kind == "density":
            return cells
        x_min, y_min, x_max, y_max = cells.bounds
        rows, columns = cells.values.shape
        area = (x_max - x_min) / columns * ((y_max - y_min) / rows)
        return RasterCells(filled / area, cells.bounds, "plane")
    west, south, east, north = cells.bounds
    if projection is None:
        middle = wrapped(np.array([0.5 * (west + east)]))
        projection = LocalProjection(float(middle[0]), 0.5 * (south + north))
    return _projected(file, RasterCells(filled, cells.bounds, "lonlat"), kind, projection, most)


def _projected(file: Path, cells: RasterCells, kind: Kind, projection: LocalProjection, most: int) -> RasterCells:
    """Lay a grid in metres over a raster in degrees; each of its cells is the mean over sub-points."""
    from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - slow to import

    west, south, east, north = cells.bounds
    rows, columns = cells.values.shape
    # west and north come first
    lons, lats = np.linspace(west, east, NODES), np.linspace(south, north, NODES)
    grid = np.stack(np.meshgrid(lons, lats, indexing="ij"), axis=-1)
    metres = projection.forward(np.stack([wrapped(grid[..., 0]), grid[..., 1]], axis=-1))
    far = float(np.hypot(metres[..., 0], metres[..., 1]).max())
    if far > FARTHEST or east - west > 180.0:  # noqa: PLR2004 - half of the Earth
        limit = f"and a plane is right to {FARTHEST / 1e3:.0f} km"
        wrong = f"it goes on to {far / 1e3:.0f} km from the middle of the map, {limit}"
        _fail(file, wrong, "cut out the part that matters (gdalwarp -te WEST SOUTH EAST NORTH)")
    east_of, north_of = (RectBivariateSpline(lons, lats, metres[..., axis], kx=5, ky=5) for axis in (0, 1))
    lon_edges, lat_edges = np.linspace(west, east, columns + 1), np.linspace(north, south, rows + 1)
    densities, total = np.empty((rows, columns)), 0.0
    band = max(1, CHUNK // (columns + 1))
    for first in range(0, rows, band):
        last = min(first + band, rows)
        # splines want rising coordinates
        edges = lat_edges[first : last + 1][::-1]
        x, y = east_of(lon_edges, edges)[:, ::-1].T, north_of(lon_edges, edges)[:, ::-1].T
        areas = _quadrangles(x, y)
        part = cells.values[first:last]
        densities[first:last] = part / areas if kind == "count" else part
        total += float(np.nansum(part if kind == "count" else part * areas))
    # the edges of the raster bend
    outline = np.concatenate([metres[0], metres[-1], metres[:, 0], metres[:, -1]])
    (x_min, y_min), (x_max, y_max) = outline.min(axis=0).tolist(), outline.max(axis=0).tolist()
    # half a parallel and half a meridian, from the middle of the raster
    middle = metres[NODES // 2, NODES // 2]
    wide = 2.0 * math.dist(metres[0, NODES // 2], middle) / columns
    high = 2.0 * math.dist(metres[NODES // 2, 0], middle) / rows
    across, up = max(1, round((x_max - x_min) / wide)), max(1, round((y_max - y_min) / high))
    if across * up > most:
        shrink = math.sqrt(across * up / most)
        across, up = max(1, int(across / shrink)), max(1, int(up / shrink))
    fine = 4 if across * up <= CHUNK // 2 else 2
    laid = _sampled(densities, cells.bounds, projection, (x_min, y_min, x_max, y_max), (up, across), fine)
    found = float(np.nansum(laid)) * (x_max - x_min) / across * ((y_max - y_min) / up)
    if total > 0.0 and found <= 0.0:
        _fail(file, "its cells are too narrow to be seen on a grid of metres", "cut out the part that matters")
    laid *= total / found if found > 0.0 else 1.0
    return RasterCells(laid, (x_min, y_min, x_max, y_max), "plane")


def _sampled(
    densities: FloatArray, source: Bounds, projection: LocalProjection, box: Bounds, shape: tuple[int, int], fine: int
) -> FloatArray:
    """
    Return the mean over `fine` x `fine` sub-points of each cell, row 0 in the north; outside the source it is 0.

    NaN counts as 0; a cell over NaN alone is NaN.
    """
    from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - slow to import

    west, south, east, north = source
    rows, columns = densities.shape
    x_min, y_min, x_max, y_max = box
    up, across = shape
    xs, ys = np.linspace(x_min, x_max, NODES), np.linspace(y_min, y_max, NODES)
    places = np.radians(projection.inverse(np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1)))
    # directions from the middle of the Earth are smooth, even at poles and across the antimeridian
    lon, lat = places[..., 0] - math.radians(projection.longitude), places[..., 1]
    parts = (np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat))
    ahead, aside, above = (RectBivariateSpline(xs, ys, part, kx=5, ky=5) for part in parts)
    sub_x = x_min + (np.arange(across * fine) + 0.5) * ((x_max - x_min) / (across * fine))
    sub_y = y_max - (np.arange(up * fine) + 0.5) * ((y_max - y_min) / (up * fine))
    laid = np.empty(shape)
    band = max(1, CHUNK // (across * fine * fine))
    for first in range(0, up, band):
        last = min(first + band, up)
        line = sub_y[first * fine : last * fine][::-1]
        a, b, c = (spline(sub_x, line)[:, ::-1].T for spline in (ahead, aside, above))
        longitudes = np.degrees(np.arctan2(b, a)) + projection.longitude
        latitudes = np.degrees(np.arctan2(c, np.hypot(a, b)))
        column = np.floor(((longitudes - west) % 360.0) * (columns / (east - west))).astype(np.int64)
        row = np.floor((north - latitudes) * (rows / (north - south))).astype(np.int64)
        inside = (column < columns) & (row >= 0) & (row < rows)
        seen = np.where(inside, densities[np.clip(row, 0, rows - 1), np.minimum(column, columns - 1)], 0.0)
        blocks = seen.reshape(last - first, fine, across, fine)
        gone = np.isnan(blocks)
        laid[first:last] = np.where(gone, 0.0, blocks).mean(axis=(1, 3))
        laid[first:last][gone.all(axis=(1, 3))] = np.nan
    return laid


def _quadrangles(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the areas between the corners of a grid: half the cross product of the diagonals."""
    one_x, one_y = x[1:, 1:] - x[:-1, :-1], y[1:, 1:] - y[:-1, :-1]
    two_x, two_y = x[1:, :-1] - x[:-1, 1:], y[1:, :-1] - y[:-1, 1:]
    areas: FloatArray = 0.5 * np.abs(one_x * two_y - one_y * two_x)
    return areas


def _ending(file: Path) -> str:
    """Return the ending of a file, which gives its format."""
    name = file.name.lower()
    found = next((ending for ending in sorted(ENDINGS, key=len, reverse=True) if name.endswith(ending)), None)
    if found is None:
        _fail(file, "no raster ends so", f"give a file that ends in one of {', '.join(ENDINGS)}")
    return found


def _read(file: Path, ending: str, most: int) -> tuple[FloatArray, Bounds | None, Coordinates | None]:
    """Read any file: its values, and its own bounds and kind of coordinates if it declares them."""
    if ending in GEOTIFF:
        return _read_safely(file, lambda: _geotiff(file, most))
    if ending == ".asc":
        return _read_safely(file, lambda: _ascii_grid(file, most))
    readers = {".npy": _npy, ".npz": _npz}
    return _read_safely(file, lambda: readers.get(ending, _csv)(file, most)), None, None


def _read_safely(file: Path, read: Callable[[], ReadT]) -> ReadT:
    """Read from a file; turn errors into a `ProblemError` of one line."""
    try:
        return read()
    except FileFormatError as error:
        raise ProblemError(str(error)) from error
    except (EOFError, zlib.error, UnicodeDecodeError) as error:
        _fail(file, f"it is damaged or of another kind ({_line(error)})", "write it once more")
    except (OSError, MemoryError) as error:
        _fail(file, f"it cannot be read ({_line(error)})", "write it once more, or check who may read it")
    except (ValueError, TypeError, KeyError, OverflowError, NotImplementedError) as error:
        if isinstance(error, ProblemError):
            raise
        _fail(file, f"it is damaged or of another kind ({_line(error)})", "write it once more")


def _geotiff(file: Path, most: int | None) -> tuple[FloatArray, Bounds | None, Coordinates | None]:
    """Read a GeoTIFF of one band; only its header if `most` is None."""
    import warnings  # noqa: PLC0415 - of rasterio alone

    try:
        import rasterio  # noqa: PLC0415 - slow to import, and an extra
    except ImportError:
        _fail(file, "GeoTIFF needs rasterio, which is not installed", "pip install 'cgla-graph[geo]'")
    with warnings.catch_warnings(), rasterio.Env(GDAL_PAM_ENABLED="NO"):
        warnings.simplefilter("ignore")
        try:
            # by its full path and with one driver, so that no name opens something else
            with rasterio.open(str(file.resolve()), driver="GTiff") as opened:
                if most is None:
                    return np.empty((0, 0)), None, None if opened.crs is None else _about(file, opened.crs)
                _require_size(file, opened.height, opened.width, most)
                if opened.count != 1:
                    _fail(file, f"it has {opened.count} bands", "write the one that counts into a file of its own")
                if opened.dtypes[0].startswith("complex"):
                    _fail(file, f"its values are of type {opened.dtypes[0]}", "give real numbers")
                if math.prod(opened.block_shapes[0]) > 4 * most:
                    _fail(file, f"its blocks have {opened.block_shapes[0]} cells", "write it with smaller blocks")
                own, flip = _place_of(file, opened.transform, opened.height, opened.width)
                about = None if opened.crs is None else _about(file, opened.crs)
                read = opened.read(1, masked=True)
                values = np.ma.filled(read.astype(np.float64), np.nan) * opened.scales[0] + opened.offsets[0]
        except rasterio.errors.RasterioError as error:
            _fail(file, f"it is damaged or no GeoTIFF ({_line(error)})", "write it once more")
    return values[::-1] if flip else values, own, about


def _place_of(file: Path, transform: Any, rows: int, columns: int) -> tuple[Bounds | None, bool]:  # noqa: ANN401 - affine has no types
    """Return the bounds of a GeoTIFF, and whether its rows begin in the south."""
    if transform.is_identity:
        return None, False
    if transform.b or transform.d or transform.a <= 0.0 or not transform.e:
        _fail(file, "it is rotated or mirrored", "warp it to rows that run east (gdalwarp)")
    x, y = transform.c, transform.f
    low, high = sorted((y, y + rows * transform.e))
    return (x, low, x + columns * transform.a, high), transform.e > 0.0


def _about(file: Path, crs: Any) -> Coordinates:  # noqa: ANN401 - rasterio has no types
    """Return the kind of coordinates of a GeoTIFF; refuse those that are not supported."""
    code = crs.to_epsg()
    name = f"EPSG:{code}" if code else crs.to_string()[:60]
    remedy = "warp it to EPSG:4326 (gdalwarp -t_srs EPSG:4326)"
    if crs.is_geographic:
        if code not in WGS84 and crs.to_string() != "OGC:CRS84":
            _fail(file, f"its degrees are those of {name}, not of WGS84", remedy)
        return "lonlat"
    if code == 3857:  # noqa: PLR2004 - Web Mercator
        _fail(file, "its metres are those of Web Mercator (EPSG:3857), which are no metres on the ground", remedy)
    if not crs.is_projected or crs.linear_units_factor[1] != 1.0:
        unit = crs.linear_units_factor[0] if crs.is_projected else "unknown"
        _fail(file, f"its coordinates ({name}) are in the unit {unit}; metres and degrees are allowed", remedy)
    return "plane"


def _ascii_grid(file: Path, most: int) -> tuple[FloatArray, Bounds, None]:
    """Read an ESRI ASCII grid."""
    lines = _lines(file, most)
    header, rest = _ascii_header(file, lines)
    for name in ("ncols", "nrows"):
        if not (header.get(name, 0.0) >= 1.0 and header[name].is_integer()):
            _fail(file, f"its header says {name} {header.get(name)}", "give a whole number of at least 1")
    rows, columns = int(header["nrows"]), int(header["ncols"])
    _require_size(file, rows, columns, most)
    (x_min, x_max), (y_min, y_max) = _ascii_side(file, header, "x", columns), _ascii_side(file, header, "y", rows)
    values, filled = np.empty(rows * columns), 0
    for line in chain((rest,), lines):
        words = line.split()
        if filled + len(words) > len(values):
            _fail(file, f"it has more than {rows} x {columns} values", "correct ncols and nrows")
        values[filled : filled + len(words)] = _parsed(file, words, f"value {filled}")
        filled += len(words)
    if filled < len(values):
        _fail(file, f"it has {filled} values instead of {rows} x {columns}", "write it once more")
    values[values == header.get("nodata_value", math.nan)] = np.nan
    return values.reshape(rows, columns), (x_min, y_min, x_max, y_max), None


def _ascii_header(file: Path, lines: Iterator[str]) -> tuple[dict[str, float], str]:
    """Return the header of an ESRI ASCII grid, its names in lower case, and the first line after it."""
    header: dict[str, float] = {}
    for line in lines:
        words = line.split()
        if not words:
            continue
        if not words[0][0].isalpha() or words[0].lower() in {"nan", "inf"}:
            return header, line
        if len(words) != 2:  # noqa: PLR2004 - name and number
            _fail(file, f"its header has the line {shown(line.strip())}", "write a name and a number")
        header[words[0].lower()] = float(_parsed(file, words[1:], f"its header: {words[0]}")[0])
    return header, ""


def _ascii_side(file: Path, header: dict[str, float], axis: str, cells: int) -> tuple[float, float]:
    """Return where an ESRI ASCII grid begins and ends along x or y."""
    size = header.get(f"d{axis}", header.get("cellsize", math.nan))
    if not 0.0 < size < math.inf:
        _fail(file, f"its header says cellsize {size:g}", "give a number above 0")
    low = header.get(f"{axis}llcorner", header.get(f"{axis}llcenter", math.nan) - 0.5 * size)
    if not math.isfinite(low):
        _fail(file, f"its header has no {axis}llcorner or {axis}llcenter", "add it")
    return low, low + cells * size


def _csv(file: Path, most: int) -> FloatArray:
    """Read rows of numbers with commas, semicolons or tabs between them; an empty one is NaN."""
    parts: list[FloatArray] = []
    cells = 0
    for number, line in enumerate(_lines(file, most)):
        if not line.strip():
            continue
        mark = next((mark for mark in (";", "\t", ",") if mark in line), ",")
        words = [word.strip() or "nan" for word in line.split(mark)]
        parts.append(_parsed(file, words, f"row {number}"))
        cells += len(words)
        if len(words) != len(parts[0]):
            _fail(file, f"row {number} has {len(words)} numbers, the first row {len(parts[0])}", "make them equal")
        if cells > most:
            _require_size(file, len(parts), len(words), most)
    if not parts:
        _fail(file, "it is empty", "write a row of numbers a line")
    return np.array(parts)


def _lines(file: Path, most: int) -> Iterator[str]:
    """Yield the lines of a text, gzipped or not; refuse more or longer lines than `most` cells need."""
    opener: Any = gzip.open if file.name.lower().endswith(".gz") else open
    read = 0
    with opener(file, "rt", encoding="utf-8-sig") as text:
        while line := text.readline(LONGEST_LINE):
            read += len(line)
            if len(line) >= LONGEST_LINE or read > CHARACTERS * most:
                _fail(file, f"it is longer than {most} numbers", "cut out the part that matters")
            yield line


def _parsed(file: Path, words: list[str], where: str) -> FloatArray:
    """Return words as numbers."""
    try:
        return plain_numbers(words)
    except ValueError as error:
        wrong, _, remedy = str(error).partition("; ")
        _fail(file, f"{where}, {wrong}", remedy)


def _npy(file: Path, most: int) -> FloatArray:
    """Read an array of NumPy, whose header is checked first; never a pickle."""
    with file.open("rb") as stream:
        header = read_header(stream, str(file), "iuf")
        _check_header(file, header, most)
        return read_elements(stream, header, str(file)).astype(np.float64, order="C")


def _npz(file: Path, most: int) -> FloatArray:
    """Read the only array of an archive, or the one named values."""
    names = archive_names(file)
    chosen = "values" if "values" in names else names[0] if len(names) == 1 else None
    if chosen is None:
        _fail(file, f"it holds {len(names)} arrays", "save one alone, or call it values")
    read = read_archive(file, [chosen], kinds="iuf", check=lambda header: _check_header(file, header, most))
    return read[chosen].astype(np.float64, order="C")


def _check_header(file: Path, header: ArrayHeader, most: int) -> None:
    if len(header.shape) != 2:  # noqa: PLR2004 - rows and columns
        _fail(file, f"its array has shape {header.shape}", "give shape (rows, columns)")
    _require_size(file, *header.shape, most)


def _require_size(file: Path, rows: int, columns: int, most: int) -> None:
    if rows < 1 or columns < 1:
        _fail(file, f"it has {rows} x {columns} cells", "give at least one")
    if rows * columns > most:
        wrong = f"it has {rows} x {columns} cells, more than {most}"
        _fail(file, wrong, "cut out the part that matters, or join cells to larger ones")


def _require_risk(file: Path, values: NDArray[np.float64], *, signed: bool) -> None:
    """Check that there are data, all finite and, unless `signed`, at least 0."""
    if np.isnan(values).all():
        _fail(file, "it holds no data: all of its values are NaN or nodata", "give a raster with data")
    wrong = ((values < 0.0) & (not signed)) | np.isinf(values)
    if wrong.any():
        row, column = np.argwhere(wrong)[0].tolist()
        first = f"the first is {values[row, column]:g} in row {row}, column {column}"
        said = f"{int(wrong.sum())} of its values are no risk, {first}"
        _fail(file, said, "give finite values of at least 0, and mark those without data as nodata in the file")


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__


def _fail(file: Path, wrong: str, remedy: str) -> NoReturn:
    msg = f"{place(file)}: {wrong}; {remedy}"
    raise ProblemError(" ".join(msg.split()))
