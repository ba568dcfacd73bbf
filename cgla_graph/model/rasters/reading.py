"""Readers of raster files: GeoTIFF, ESRI ASCII grids, CSV, NumPy."""

import gzip
import math
import os
import warnings
import zlib
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from itertools import chain
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias, TypeVar

import numpy as np
from numpy.typing import NDArray

from cgla_graph._text import shown
from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import file_path
from cgla_graph.errors import FileFormatError, ProblemError
from cgla_graph.model.rasters.crs import CoordinateSystem
from cgla_graph.model.rasters.place import Coordinates, RasterPlace, Said, fail, placed
from cgla_graph.model.rasters.sidecars import Aux, prj_beside, require_same_place, require_same_world
from cgla_graph.model.rasters.values import AT_ONCE, MOST_LAID, parts_of
from cgla_graph.untrusted.arrays import ArrayHeader, archive_names, read_archive, read_elements, read_header
from cgla_graph.untrusted.numbers import plain_numbers

ReadT = TypeVar("ReadT")
CellValues: TypeAlias = NDArray[np.floating[Any]]

#: Endings of files that hold rasters.
GEOTIFF = (".tif", ".tiff")
ENDINGS = (*GEOTIFF, ".asc", ".npy", ".npz", ".csv", ".csv.gz")
#: Characters a line of text at most, and characters a cell.
LONGEST_LINE, CHARACTERS = 1 << 24, 32
#: Memory of GDAL for blocks of a file, bytes (its own default is a part of the machine's), and cells of a block at most
#: where a raster of fewer is in it.
CACHE, MOST_IN_BLOCK = 1 << 26, 20_000_000
#: Types of values that 32 bits hold to the last digit.
SHORT = frozenset(("uint8", "int8", "uint16", "int16", "float16", "float32"))


@dataclass(frozen=True, eq=False)
class RasterCells(RasterPlace):
    """
    The cells of a file.

    Attributes
    ----------
    values
        Shape ``(rows, columns)``, row 0 at the greatest y (the north); NaN where there are no data. Of 32 bits where
        the file's are no more.
    """

    values: CellValues


class _Raw(NamedTuple):
    """What a file holds: its values (None if only its place was asked for), and what it says of its place."""

    values: CellValues | None
    said: Said


def read_cells(
    path: str | os.PathLike[str],
    *,
    most: int,
    bounds: Bounds | None = None,
    coordinates: Coordinates | None = None,
    is_default: bool = False,
    origin: str = "upper",
    signed: bool = False,
) -> RasterCells:
    """
    Read the cells of a raster file, whose size is checked against `most` cells before memory is allocated.

    Negative values are refused unless the raster is `signed`. The coordinates may be a default (`is_default`): then
    those of a file that says nothing are not taken for metres if they look like degrees.

    Raises
    ------
    ProblemError
        If the file is malformed; the message names the file, the fault and the remedy.
    """
    file = file_path("the raster file", path)
    raw = _read(file, _checked_ending(file), most)
    at = placed(file, raw.said, bounds, coordinates, is_default=is_default)
    if raw.said.bounds is not None and origin != "upper":
        fail(file, f"origin is {shown(origin)}, but such files say themselves that row 0 is upper", "leave out origin")
    assert raw.values is not None  # noqa: S101 - cells were asked for
    _require_risk(file, raw.values, signed=signed)
    values = raw.values[::-1] if origin == "lower" else raw.values
    return RasterCells(at.file, at.bounds, at.coordinates, at.system, values)


def read_place(
    path: str | os.PathLike[str], *, bounds: Bounds | None = None, coordinates: Coordinates | None = None
) -> RasterPlace:
    """
    Return where a raster lies; of GeoTIFFs and ASCII grids, no cell is read.

    Raises
    ------
    ProblemError
        As `read_cells`.
    """
    file = file_path("the raster file", path)
    ending = _checked_ending(file)
    raw = _read(file, ending, None) if ending in (*GEOTIFF, ".asc") else _Raw(None, Said(_shape_of(file, ending)))
    return placed(file, raw.said, bounds, coordinates, is_default=coordinates is None)


def _shape_of(file: Path, ending: str) -> tuple[int, int]:
    """Return rows and columns of a .npy; of others, which are read with their cells, one cell."""
    if ending != ".npy":
        return 1, 1
    with file.open("rb") as stream:
        shape = _read_safely(file, lambda: read_header(stream, str(file), "iuf")).shape
    return (shape[0], shape[1]) if len(shape) == 2 and all(shape) else (1, 1)  # noqa: PLR2004 - else an error later


def _checked_ending(file: Path) -> str:
    ending = _ending(file)
    if not file.is_file():
        msg = f"{file}: there is no such file: check the name and the folder"
        raise ProblemError(msg)
    return ending


def _ending(file: Path) -> str:
    """Return the ending of a file, which gives its format."""
    name = file.name.lower()
    found = next((ending for ending in sorted(ENDINGS, key=len, reverse=True) if name.endswith(ending)), None)
    if found is None:
        fail(file, "no raster ends so", f"give a file that ends in one of {', '.join(ENDINGS)}")
    return found


def _read(file: Path, ending: str, most: int | None) -> _Raw:
    """Read any file; only the place of a GeoTIFF or an ASCII grid if `most` is None."""
    if ending in GEOTIFF:
        return _read_safely(file, lambda: _geotiff(file, most))
    if ending == ".asc":
        return _read_safely(file, lambda: _ascii_grid(file, most))
    readers = {".npy": _npy, ".npz": _npz}
    values = _read_safely(file, lambda: readers.get(ending, _csv)(file, most or 1))
    return _Raw(values, Said((values.shape[0], values.shape[1])))


def _read_safely(file: Path, read: Callable[[], ReadT]) -> ReadT:
    """Read from a file; turn errors into a `ProblemError` of one line."""
    try:
        return read()
    except FileFormatError as error:
        raise ProblemError(str(error)) from error
    except (EOFError, zlib.error, UnicodeDecodeError) as error:
        fail(file, f"it is damaged or of another kind ({_line(error)})", "write it once more")
    except (OSError, MemoryError) as error:
        fail(file, f"it cannot be read ({_line(error)})", "write it once more, or check who may read it")
    except (ValueError, TypeError, KeyError, OverflowError, NotImplementedError) as error:
        if isinstance(error, ProblemError):
            raise
        fail(file, f"it is damaged or of another kind ({_line(error)})", "write it once more")


def _geotiff(file: Path, most: int | None) -> _Raw:
    """Read a GeoTIFF of one band; only its place if `most` is None."""
    try:
        import rasterio  # noqa: PLC0415 - slow to import, and an extra
    except ImportError:
        fail(file, "GeoTIFF needs rasterio, which is not installed", "pip install 'cgla-graph[geo]'")
    # (GDAL would read the files beside it without bounds)
    aside = Aux.beside(file)
    with warnings.catch_warnings(), rasterio.Env(GDAL_PAM_ENABLED="NO", GDAL_CACHEMAX=CACHE):
        warnings.simplefilter("ignore")
        try:
            # by its full path and with one driver, so that no name opens something else
            with rasterio.open(str(file.resolve()), driver="GTiff") as opened:
                shape = (opened.height, opened.width)
                if most is not None:
                    _require_band(file, opened, most)
                own, flip = _place_of(file, opened.transform, shape, aside)
                wkt = _wkt_of(file, opened.crs, own, aside)
                if most is None:
                    return _Raw(None, Said(shape, own, wkt))
                values = _band(opened, aside)
        except rasterio.errors.RasterioError as error:
            fail(file, f"it is damaged or no GeoTIFF ({_line(error)})", "write it once more")
    return _Raw(values[::-1] if flip else values, Said(shape, own, wkt))


def _require_band(file: Path, opened: Any, most: int) -> None:  # noqa: ANN401 - rasterio has no types
    """Check that a GeoTIFF has one band of real numbers, in blocks that fit in memory."""
    _require_size(file, opened.height, opened.width, most)
    if opened.count != 1:
        fail(file, f"it has {opened.count} bands", "write the one that counts into a file of its own")
    if opened.dtypes[0].startswith("complex"):
        fail(file, f"its values are of type {opened.dtypes[0]}", "give real numbers")
    # (a block is in memory as a whole)
    if math.prod(opened.block_shapes[0]) > max(opened.height * opened.width, MOST_IN_BLOCK):
        fail(file, f"its blocks have {opened.block_shapes[0]} cells", "write it with smaller blocks")


def _band(opened: Any, aside: Aux) -> CellValues:  # noqa: ANN401 - rasterio has no types
    """Return the values of the only band, from the file and the files beside it, read some rows of blocks at a time."""
    # (1 and 0 are what a file has that says nothing)
    scale = aside.settled("scale", None if opened.scales[0] == 1.0 else float(opened.scales[0]), aside.scale)
    offset = aside.settled("offset", None if opened.offsets[0] == 0.0 else float(opened.offsets[0]), aside.offset)
    own = None if opened.nodata is None else float(opened.nodata)
    nodata = aside.settled("nodata", own, aside.nodata)
    kind, high = opened.dtypes[0], opened.block_shapes[0][0]
    times, more = 1.0 if scale is None else scale, 0.0 if offset is None else offset
    is_short = kind in SHORT and times == 1.0 and more == 0.0
    values = np.empty((opened.height, opened.width), dtype=np.float32 if is_short else np.float64)
    step = high * max(1, AT_ONCE // (high * opened.width))
    for first in range(0, opened.height, step):
        window = ((first, min(first + step, opened.height)), (0, opened.width))
        read = np.ma.filled(opened.read(1, window=window, masked=True).astype(np.float64), np.nan)
        if own is None and nodata is not None:
            read[read == float(np.float32(nodata) if kind == "float32" else nodata)] = np.nan
        values[slice(*window[0])] = read * times + more
    return values


def _place_of(file: Path, transform: Any, shape: tuple[int, int], aside: Aux) -> tuple[Bounds | None, bool]:  # noqa: ANN401 - affine has no types
    """Return the bounds of a GeoTIFF, and whether its rows begin in the south."""
    given = aside.transform
    if transform.is_identity and given is None:
        return None, False
    if transform.is_identity and given is not None:
        x, a, b, y, d, e = given
    else:
        a, b, x, d, e, y = tuple(transform)[:6]
    if b or d or a <= 0.0 or not e:
        fail(file, "it is rotated or mirrored", "warp it to rows that run east (gdalwarp)")
    low, high = sorted((y, y + shape[0] * e))
    bounds = (x, low, x + shape[1] * a, high)
    if given is not None:
        require_same_place(aside.file, given, bounds, shape)
    require_same_world(file, bounds, shape)
    return bounds, e > 0.0


def _wkt_of(file: Path, crs: Any, bounds: Bounds | None, aside: Aux) -> str | None:  # noqa: ANN401 - rasterio has no types
    """Return the definition of the system of a GeoTIFF, in the file or beside it."""
    own = None if crs is None else str(crs.to_wkt(version="WKT2_2019"))
    if own is None:
        return aside.wkt or prj_beside(file)
    if aside.wkt is not None and bounds is not None:
        first, second = (CoordinateSystem.of_code(one, bounds) for one in (own, aside.wkt))
        if not first.is_same(second, bounds):
            aside.settled("SRS", own, aside.wkt)
    return own


def _ascii_grid(file: Path, most: int | None) -> _Raw:
    """Read an ESRI ASCII grid; only its place if `most` is None."""
    lines = _lines(file, most or LONGEST_LINE)
    header, rest = _ascii_header(file, lines)
    for name in ("ncols", "nrows"):
        if not (header.get(name, 0.0) >= 1.0 and header[name].is_integer()):
            fail(file, f"its header says {name} {header.get(name)}", "give a whole number of at least 1")
    rows, columns = int(header["nrows"]), int(header["ncols"])
    (x_min, x_max), (y_min, y_max) = _ascii_side(file, header, "x", columns), _ascii_side(file, header, "y", rows)
    aside = Aux.beside(file)
    said = Said((rows, columns), (x_min, y_min, x_max, y_max), aside.wkt or prj_beside(file))
    if most is None:
        return _Raw(None, said)
    _require_size(file, rows, columns, most)
    values, filled = np.empty(rows * columns), 0
    for line in chain((rest,), lines):
        words = line.split()
        if filled + len(words) > len(values):
            fail(file, f"it has more than {rows} x {columns} values", "correct ncols and nrows")
        values[filled : filled + len(words)] = _parsed(file, words, f"value {filled}")
        filled += len(words)
    if filled < len(values):
        fail(file, f"it has {filled} values instead of {rows} x {columns}", "write it once more")
    nodata = aside.settled("nodata", header.get("nodata_value"), aside.nodata)
    values[values == (math.nan if nodata is None else nodata)] = np.nan
    values *= 1.0 if aside.scale is None else aside.scale
    values += aside.offset or 0.0
    return _Raw(values.reshape(rows, columns), said)


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
            fail(file, f"its header has the line {shown(line.strip())}", "write a name and a number")
        header[words[0].lower()] = float(_parsed(file, words[1:], f"its header: {words[0]}")[0])
    return header, ""


def _ascii_side(file: Path, header: dict[str, float], axis: str, cells: int) -> tuple[float, float]:
    """Return where an ESRI ASCII grid begins and ends along x or y."""
    size = header.get(f"d{axis}", header.get("cellsize", math.nan))
    if not 0.0 < size < math.inf:
        fail(file, f"its header says cellsize {size:g}", "give a number above 0")
    low = header.get(f"{axis}llcorner", header.get(f"{axis}llcenter", math.nan) - 0.5 * size)
    if not math.isfinite(low):
        fail(file, f"its header has no {axis}llcorner or {axis}llcenter", "add it")
    return low, low + cells * size


def _csv(file: Path, most: int) -> FloatArray:
    """Read rows of numbers with commas, semicolons or tabs between them; an empty one is NaN."""
    parts: list[FloatArray] = []
    cells = 0
    # (of which no line says how many there are)
    most = min(most, MOST_LAID)
    for number, line in enumerate(_lines(file, most)):
        if not line.strip():
            continue
        mark = next((mark for mark in (";", "\t", ",") if mark in line), ",")
        words = [word.strip() or "nan" for word in line.split(mark)]
        parts.append(_parsed(file, words, f"row {number}"))
        cells += len(words)
        if len(words) != len(parts[0]):
            fail(file, f"row {number} has {len(words)} numbers, the first row {len(parts[0])}", "make them equal")
        if cells > most:
            _require_size(file, len(parts), len(words), most)
    if not parts:
        fail(file, "it is empty", "write a row of numbers a line")
    return np.array(parts)


def _lines(file: Path, most: int) -> Iterator[str]:
    """Yield the lines of a text, gzipped or not; refuse more or longer lines than `most` cells need."""
    opener: Any = gzip.open if file.name.lower().endswith(".gz") else open
    read = 0
    with opener(file, "rt", encoding="utf-8-sig") as text:
        while line := text.readline(LONGEST_LINE):
            read += len(line)
            if len(line) >= LONGEST_LINE or read > CHARACTERS * most:
                fail(file, f"it is longer than {most} numbers", "cut out the part that matters")
            yield line


def _parsed(file: Path, words: list[str], where: str) -> FloatArray:
    """Return words as numbers."""
    try:
        return plain_numbers(words)
    except ValueError as error:
        wrong, _, remedy = str(error).partition("; ")
        fail(file, f"{where}, {wrong}", remedy)


def _npy(file: Path, most: int) -> CellValues:
    """Read an array of NumPy, whose header is checked first; never a pickle."""
    with file.open("rb") as stream:
        header = read_header(stream, str(file), "iuf")
        _check_header(file, header, most)
        read = read_elements(stream, header, str(file))
    return np.ascontiguousarray(read, dtype=np.float32 if read.dtype.name in SHORT else np.float64)


def _npz(file: Path, most: int) -> FloatArray:
    """Read the only array of an archive, or the one named values."""
    names = archive_names(file)
    chosen = "values" if "values" in names else names[0] if len(names) == 1 else None
    if chosen is None:
        fail(file, f"it holds {len(names)} arrays", "save one alone, or call it values")
    read = read_archive(file, [chosen], kinds="iuf", check=lambda header: _check_header(file, header, most))
    return read[chosen].astype(np.float64, order="C")


def _check_header(file: Path, header: ArrayHeader, most: int) -> None:
    if len(header.shape) != 2:  # noqa: PLR2004 - rows and columns
        fail(file, f"its array has shape {header.shape}", "give shape (rows, columns)")
    _require_size(file, *header.shape, most)


def _require_size(file: Path, rows: int, columns: int, most: int) -> None:
    if rows < 1 or columns < 1:
        fail(file, f"it has {rows} x {columns} cells", "give at least one")
    if rows * columns > most:
        wrong = f"it has {rows} x {columns} cells, more than {most}"
        fail(file, wrong, "cut out the part that matters, or join cells to larger ones")


def _require_risk(file: Path, values: CellValues, *, signed: bool) -> None:
    """Check that there are data, all finite and, unless `signed`, at least 0."""
    missing = wrong_ones = 0
    first = ""
    for part in parts_of(values.shape):
        some = values[part]
        missing += int(np.isnan(some).sum())
        wrong = ((some < 0.0) & (not signed)) | np.isinf(some)
        if wrong.any() and not wrong_ones:
            row, column = np.argwhere(wrong)[0].tolist()
            first = f"the first is {some[row, column]:g} in row {part.start + row}, column {column}"
        wrong_ones += int(wrong.sum())
    if missing == values.size:
        fail(file, "it holds no data: all of its values are NaN or nodata", "give a raster with data")
    if wrong_ones:
        said = f"{wrong_ones} of its values are no risk, {first}"
        fail(file, said, "give finite values of at least 0, and mark those without data as nodata in the file")


def _line(error: BaseException) -> str:
    return " ".join(str(error).split())[:120] or type(error).__name__
