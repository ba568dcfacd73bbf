"""Rasters on the plane of a map: densities of counts, and the projection of any coordinates to metres."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple, TypeAlias, get_args

import numpy as np
import shapely
from numpy.typing import NDArray

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, Bounds, FloatArray
from cgla_graph._validate import non_negative_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection, wrapped
from cgla_graph.model.rasters.crs import CoordinateSystem, scales
from cgla_graph.model.rasters.place import Kind, fail, warp
from cgla_graph.model.rasters.reading import RasterCells
from cgla_graph.model.rasters.values import MOST_LAID, RowsOf, parts_of

#: Metres from the origin of a projection; beyond this it distorts areas by more than a percent.
FARTHEST = 1_500_000.0
#: Nodes a side of the grid between which projections are interpolated, by splines of degree 5.
NODES = 33
#: Sub-points that are projected at a time, and at most where each is projected by itself.
CHUNK, MOST_SINGLE = 2_000_000, 20_000_000
#: Cells that are cut askew, by more than this angle in radians, are laid on a grid up to this many times as fine.
ASKEW, FINER = 0.02, 4.0
#: Part of a cell by which an interpolated place may be off.
PART = 0.02
#: Where the corners of a cell are looked at, in parts of its sides: a cell that it meets by less is not told from one
#: that it touches.
CORNERS = np.array([0.05, 0.95])

Places: TypeAlias = Callable[[FloatArray, FloatArray], tuple[FloatArray, FloatArray]]


class Laid(NamedTuple):
    """
    A raster on the plane of a map.

    Attributes
    ----------
    values
        Densities, row 0 in the north, perhaps of 32 bits or not computed yet where they stay on the file's cells; NaN
        without data, and where none of a raster that lies askew is.
    bounds
        The outer edges of the outer cells, map units.
    outline
        What the file covers, if that is less than the bounds; else None.
    peaks
        On a new grid, the greatest density of the file's cells that each cell meets, NaN as in `values`; else None.
    """

    values: NDArray[np.floating[Any]] | RowsOf
    bounds: Bounds
    outline: shapely.Polygon | None = None
    peaks: FloatArray | None = None


def cells_in_metres(
    cells: RasterCells, *, kind: Kind, nodata: float | None, projection: LocalProjection | None
) -> Laid:
    """
    Turn the cells of a file into densities on a plane: counts are divided by areas, degrees become metres.

    On a new grid, the sum of density times area stays the same up to rounding; for a raster of counts, it is the total
    count. Cells without data that stand for 0 stay without data; new cells do that cover only such cells.

    Parameters
    ----------
    cells
        As `read_cells` gives them.
    kind
        ``count`` (of each cell) or ``density``.
    nodata
        Value of cells without data (NaN), in the file's own units; None refuses them.
    projection
        Projection of a map in degrees; None for one around the middle of the raster.

    Returns
    -------
    laid
        The raster on the plane.

    Raises
    ------
    ProblemError
        If `kind` is unknown, there are cells without data but no `nodata`, or the raster is too wide for a plane, or
        has more than 20 million cells that become others.
    """
    file = cells.file
    if kind not in get_args(Kind):
        msg = f"{file}: kind is {shown(kind)}; choose one of {', '.join(get_args(Kind))}"
        raise ProblemError(msg)
    if nodata is None:
        _require_data(cells)
    fill = 0.0 if nodata is None else non_negative_number("nodata", nodata)
    if cells.coordinates == "plane":
        if projection is not None:
            fail(file, "a projection is for longitudes and latitudes, and this raster is on a plane", "leave it out")
        if kind == "density":
            return Laid(cells.values, cells.bounds)
        shape, areas = cells.values.shape, areas_of_rows(cells.bounds, cells.values.shape, cells.system)

        def densities(part: slice) -> FloatArray:
            rows = slice(shape[0] - part.stop, shape[0] - part.start)
            found = _filled(cells.values[part], fill) / areas(rows)[::-1]
            return np.asarray(found, dtype=np.float64)

        return Laid(RowsOf((shape[0], shape[1]), densities), cells.bounds)
    if cells.values.size > MOST_LAID:
        size = f"it has {' x '.join(map(str, cells.values.shape))} cells, more than {MOST_LAID} that can be laid on"
        fail(file, f"{size} a plane in metres", f"cut out the part that matters, or {warp(file, kind, metres=True)}")
    if projection is None:
        west, south, east, north = cells.degrees
        middle = wrapped(np.array([0.5 * (west + east)]))
        projection = LocalProjection(float(middle[0]), 0.5 * (south + north))
    filled = _filled(cells.values, fill)
    laid = _Source(RasterCells(file, cells.bounds, cells.coordinates, cells.system, filled), projection, kind)
    return laid.projected(MOST_LAID)


def _require_data(cells: RasterCells) -> None:
    """Refuse cells without data."""
    count, first = 0, (0, 0)
    for part in parts_of(cells.values.shape):
        missing = np.isnan(cells.values[part])
        if not missing.any():
            continue
        if not count:
            row, column = np.argwhere(missing)[0].tolist()
            first = part.start + row, column
        count += int(missing.sum())
    if count:
        wrong = f"{count} of its cells have no data, the first in row {first[0]}, column {first[1]}"
        fail(cells.file, wrong, "give their value with nodata, as nodata = 0 (--nodata 0)")


def _filled(values: "NDArray[np.floating[Any]]", fill: float) -> FloatArray:
    """Return values as numbers of 64 bits, with one instead of NaN if it is above 0."""
    exact = np.asarray(values, dtype=np.float64)
    return np.where(np.isnan(exact), fill, exact) if fill > 0.0 else exact


def areas_of_rows(
    bounds: Bounds, shape: tuple[int, ...], system: CoordinateSystem | None
) -> Callable[[slice], FloatArray]:
    """
    Return the function from some rows of a raster on a plane, row 0 in the south, to the areas of their cells.

    They are those on the ground where the raster's system says that; without one, all are the same.

    Examples
    --------
    >>> areas_of_rows((0.0, 0.0, 20.0, 30.0), (3, 2), None)(slice(0, 3))
    array([[100.]])
    """
    from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - slow to import

    x_min, y_min, x_max, y_max = bounds
    rows, columns = shape
    width, height = (x_max - x_min) / columns, (y_max - y_min) / rows
    area: float = width * height
    if system is None:
        one = np.array([[area]])
        return lambda _: one
    x, y = np.linspace(x_min, x_max, NODES), np.linspace(y_min, y_max, NODES)
    nodes = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    ratios = RectBivariateSpline(x, y, scales(system, nodes).prod(axis=1).reshape(NODES, NODES))
    across, up = x_min + width * (np.arange(columns) + 0.5), y_min + height * (np.arange(rows) + 0.5)
    return lambda part: np.asarray(area / np.asarray(ratios(across, up[part]), dtype=np.float64).T)


@dataclass(frozen=True, eq=False)
class _Source:
    """The cells of a file in coordinates of the Earth, which are laid on a grid in metres."""

    cells: RasterCells
    projection: LocalProjection
    kind: Kind

    @cached_property
    def nodes(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """The nodes over the raster: x and y in its own coordinates, and metres, shape ``(NODES, NODES, 2)``."""
        x_min, y_min, x_max, y_max = self.cells.bounds
        xs, ys = np.linspace(x_min, x_max, NODES), np.linspace(y_min, y_max, NODES)
        degrees = self._lonlat(np.stack(np.meshgrid(xs, ys, indexing="ij"), axis=-1).reshape(-1, 2))
        return xs, ys, self.projection.forward(degrees).reshape(NODES, NODES, 2)

    def _lonlat(self, points: FloatArray) -> FloatArray:
        system = self.cells.system
        if system is None:
            return np.column_stack([wrapped(points[:, 0]), points[:, 1]])
        return system.lonlat(points)

    def projected(self, most: int) -> Laid:
        """Lay a grid in metres over the raster; each of its cells is the mean over sub-points."""
        file = self.cells.file
        west, _, east, _ = self.cells.degrees
        metres = self.nodes[2]
        far = float(np.hypot(metres[..., 0], metres[..., 1]).max())
        if far > FARTHEST or east - west > 180.0:  # noqa: PLR2004 - half of the Earth
            limit = f"and a plane is right to {FARTHEST / 1e3:.0f} km"
            wrong = f"it goes on to {far / 1e3:.0f} km from the middle of the map, {limit}"
            cut = warp(file, self.kind).replace("EPSG:4326", "EPSG:4326 -te WEST SOUTH EAST NORTH")
            fail(file, wrong, f"cut out the part that matters, or {cut}")
        densities, total = self._densities()
        # the edges of the raster bend
        outline = np.concatenate([metres[0], metres[-1], metres[:, 0], metres[:, -1]])
        (x_min, y_min), (x_max, y_max) = outline.min(axis=0).tolist(), outline.max(axis=0).tolist()
        wide, high = self._cell()
        across, up = max(1, round((x_max - x_min) / wide)), max(1, round((y_max - y_min) / high))
        if across * up > most:
            shrink = math.sqrt(across * up / most)
            across, up = max(1, int(across / shrink)), max(1, int(up / shrink))
        box = (x_min, y_min, x_max, y_max)
        laid, peaks = self._sampled(densities, box, (up, across))
        found = float(np.nansum(laid)) * (x_max - x_min) / across * ((y_max - y_min) / up)
        if total > 0.0 and found <= 0.0:
            fail(file, "its cells are too narrow to be seen on a grid of metres", "cut out the part that matters")
        laid *= total / found if found > 0.0 else 1.0
        around = np.concatenate([metres[:, 0], metres[-1, 1:], metres[-2::-1, -1], metres[0, -2:0:-1]])
        # (chords of a bent edge cut a little off)
        return Laid(laid, box, shapely.Polygon(around).buffer(0.5 * min(wide, high)), np.fmax(laid, peaks))

    def _cell(self) -> tuple[float, float]:
        """Return width and height of the cells on the plane: the file's, or smaller ones where these lie askew."""
        rows, columns = self.cells.values.shape
        metres, half = self.nodes[2], NODES // 2
        # half a line across and half a line up, from the middle of the raster
        across = 2.0 * (metres[half, half] - metres[0, half]) / columns
        up = 2.0 * (metres[half, half] - metres[half, 0]) / rows
        if self.cells.system is None:
            return float(np.hypot(*across)), float(np.hypot(*up))
        # the chords of the parallelogram, along x and along y
        area = abs(float(across[0] * up[1] - across[1] * up[0]))
        chords = area / float(max(abs(across[1]), abs(up[1]))), area / float(max(abs(across[0]), abs(up[0])))
        slant = max(abs(across[1]) / np.hypot(*across), abs(up[0]) / np.hypot(*up))
        finer = min(max(math.sqrt(CHUNK / (rows * columns)), 1.0), FINER) if slant > ASKEW else 1.0
        return chords[0] / finer, chords[1] / finer

    def _densities(self) -> tuple[FloatArray, float]:
        """Return the density of each cell on the plane of the projection, and the sum of density times area."""
        from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - slow to import

        values = self.cells.values
        x_min, y_min, x_max, y_max = self.cells.bounds
        rows, columns = values.shape
        xs, ys, metres = self.nodes
        east_of, north_of = (RectBivariateSpline(xs, ys, metres[..., axis], kx=5, ky=5) for axis in (0, 1))
        across, up = np.linspace(x_min, x_max, columns + 1), np.linspace(y_max, y_min, rows + 1)
        densities, total = np.empty((rows, columns)), 0.0
        band = max(1, CHUNK // (columns + 1))
        for first in range(0, rows, band):
            last = min(first + band, rows)
            # splines want rising coordinates
            edges = up[first : last + 1][::-1]
            areas = _quadrangles(east_of(across, edges)[:, ::-1].T, north_of(across, edges)[:, ::-1].T)
            part = values[first:last]
            densities[first:last] = part / areas if self.kind == "count" else part
            total += float(np.nansum(part if self.kind == "count" else part * areas))
        return densities, total

    def _sampled(self, densities: FloatArray, box: Bounds, shape: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
        """
        Return mean and greatest value over sub-points of each cell, row 0 in the north; outside the source they are 0.

        NaN counts as 0; a cell over NaN alone is NaN, and so is one of a raster that lies askew outside of it. A cell
        of the source that is as wide as one on the plane meets this one at one of its corners, so that no cell is
        missed among the greatest.
        """
        left, low, right, high = box
        up, across = shape
        places, is_fast = self._places(box)
        fine = 4 if across * up <= CHUNK // 2 else 2
        if not is_fast:
            fine = min(fine, int(math.sqrt(MOST_SINGLE / (across * up))))
            if fine < 1:
                size = " x ".join(map(str, densities.shape))
                wrong = f"on its {size} cells, {getattr(self.cells.system, 'name', '')} bends too much"
                fail(self.cells.file, wrong, warp(self.cells.file, self.kind))
        wide, tall = (right - left) / across, (high - low) / up
        laid, peaks = np.empty(shape), np.empty(shape)
        band = max(1, CHUNK // (across * fine * fine))

        def blocks_of(first: int, last: int, parts: FloatArray) -> tuple[FloatArray, BoolArray]:
            """Return the values at points of each cell, and which are inside, shape ``(rows, n, columns, n)``."""
            x = left + wide * (np.arange(across)[:, None] + parts).ravel()
            y = high - tall * (np.arange(first, last)[:, None] + parts).ravel()
            blocks, inside = self._at(densities, *places(x, y))
            size = (last - first, len(parts), across, len(parts))
            return blocks.reshape(size), inside.reshape(size)

        for first in range(0, up, band):
            last = min(first + band, up)
            blocks, inside = blocks_of(first, last, (np.arange(fine) + 0.5) / fine)
            gone = np.isnan(blocks)
            filled = np.where(gone, 0.0, blocks)
            laid[first:last] = filled.mean(axis=(1, 3))
            corners = np.nan_to_num(blocks_of(first, last, CORNERS)[0])
            peaks[first:last] = np.maximum(filled.max(axis=(1, 3)), corners.max(axis=(1, 3)))
            if self.cells.system is not None:
                gone |= ~inside
            for found in (laid, peaks):
                found[first:last][gone.all(axis=(1, 3))] = np.nan
        return laid, peaks

    def _at(self, densities: FloatArray, x: FloatArray, y: FloatArray) -> tuple[FloatArray, BoolArray]:
        """Return the values at places in the coordinates of the file, 0 outside, and which are inside."""
        x_min, y_min, x_max, y_max = self.cells.bounds
        rows, columns = densities.shape
        beyond = x - x_min if self.cells.system is not None else (x - x_min) % 360.0
        with np.errstate(invalid="ignore"):
            column = np.floor(beyond * (columns / (x_max - x_min)))
            row = np.floor((y_max - y) * (rows / (y_max - y_min)))
            inside = (column >= 0) & (column < columns) & (row >= 0) & (row < rows)
        at = np.where(inside, row, 0).astype(np.int64), np.where(inside, column, 0).astype(np.int64)
        return np.where(inside, densities[at], 0.0), np.asarray(inside)

    def _places(self, box: Bounds) -> tuple[Places, bool]:
        """Return the function from rows and columns of metres to coordinates of the file, and whether it is fast."""
        from scipy.interpolate import RectBivariateSpline  # noqa: PLC0415 - slow to import

        system, projection = self.cells.system, self.projection
        left, low, right, high = box
        xs, ys = np.linspace(left, right, NODES), np.linspace(low, high, NODES)

        def degrees(x: FloatArray, y: FloatArray) -> FloatArray:
            return projection.inverse(np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1))

        def splines(parts: FloatArray) -> list[RectBivariateSpline]:
            return [RectBivariateSpline(xs, ys, parts[..., axis], kx=5, ky=5) for axis in range(parts.shape[-1])]

        if system is None:
            # directions from the middle of the Earth are smooth, even at poles and across the antimeridian
            places = np.radians(degrees(xs, ys))
            lon, lat = places[..., 0] - math.radians(projection.longitude), places[..., 1]
            axes = splines(np.stack([np.cos(lat) * np.cos(lon), np.cos(lat) * np.sin(lon), np.sin(lat)], axis=-1))

            def by_direction(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
                a, b, c = (spline(x, y[::-1])[:, ::-1].T for spline in axes)
                longitudes = np.degrees(np.arctan2(b, a)) + projection.longitude
                return longitudes, np.degrees(np.arctan2(c, np.hypot(a, b)))

            return by_direction, True

        def exact(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
            found = system.points(degrees(x, y).reshape(-1, 2)).reshape(len(x), len(y), 2)
            return found[..., 0].T, found[..., 1].T

        nodes = np.stack(exact(xs, ys), axis=-1).swapaxes(0, 1)
        if not np.isfinite(nodes).all():
            return exact, False
        pair = splines(nodes)

        def by_spline(x: FloatArray, y: FloatArray) -> tuple[FloatArray, FloatArray]:
            return pair[0](x, y[::-1])[:, ::-1].T, pair[1](x, y[::-1])[:, ::-1].T

        between = 0.5 * (xs[1:] + xs[:-1]), (0.5 * (ys[1:] + ys[:-1]))[::-1]
        x_min, y_min, x_max, y_max = self.cells.bounds
        rows, columns = self.cells.values.shape
        allowed = PART * (x_max - x_min) / columns, PART * (y_max - y_min) / rows
        off = [float(np.abs(a - b).max()) for a, b in zip(by_spline(*between), exact(*between), strict=True)]
        is_right = all(one <= most for one, most in zip(off, allowed, strict=True))
        return (by_spline, True) if is_right else (exact, False)


def _quadrangles(x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the areas between the corners of a grid: half the cross product of the diagonals."""
    one_x, one_y = x[1:, 1:] - x[:-1, :-1], y[1:, 1:] - y[:-1, :-1]
    two_x, two_y = x[1:, :-1] - x[:-1, 1:], y[1:, :-1] - y[:-1, 1:]
    areas: FloatArray = 0.5 * np.abs(one_x * two_y - one_y * two_x)
    return areas
