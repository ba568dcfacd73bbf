"""Risk on a grid of cells: people on the ground, casualties, radar, noise, the cost of terrain."""

import hashlib
import math
import os
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from types import NoneType
from typing import TYPE_CHECKING, Any, Literal, TypeAlias, get_args

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, Bounds, FloatArray, WholeArray
from cgla_graph._validate import (
    bounds_box,
    choice,
    instance,
    non_negative_number,
    number_array,
    point_array,
    positive_number,
)
from cgla_graph.errors import ProblemError
from cgla_graph.model import risk_raster_kernels as kernels
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.failure_model import PER_KM2, FailureModel, Unit
from cgla_graph.model.rasters.crs import CoordinateSystem
from cgla_graph.model.rasters.place import Coordinates, Kind, said_if_laid
from cgla_graph.model.rasters.projection import Laid, cells_in_metres
from cgla_graph.model.rasters.reading import read_cells
from cgla_graph.model.rasters.values import MOST_CELLS, RasterValues, RowsOf, parts_of

Interpolation: TypeAlias = Literal["bilinear", "nearest"]
Origin: TypeAlias = Literal["upper", "lower"]

#: Greatest density; beyond it, sums with lengths lose all digits of the lengths.
GREATEST = 1e100
#: Half a cell, less what rounding may take.
NEARLY_HALF = 0.5 - 1e-6
#: Corners of a quarter of a circle.
ROUND = 64


@dataclass(frozen=True, eq=False, init=False)
class RasterRisk:
    """
    Risk per unit length on a grid of cells, and the people behind it, if they are known.

    Outside its bounds a raster has no risk; the edges belong to the raster. With a `unit`, the values are people, and
    with `failures` as well, the risk is that of the people: expected fatalities per metre. No factor changes the
    people: `scale` is one of the risk alone.

    Parameters
    ----------
    values
        Shape ``(rows, columns)``, at least 0. NaN, or a masked value, stands for cells without data.
    bounds
        ``(x_min, y_min, x_max, y_max)``: the outer edges of the outer cells, map units.
    interpolation
        ``bilinear``: the values hold at the cells' centres, with bilinear interpolation between them, and constant
        across the outer half cells. ``nearest``: each value holds on its whole cell; on the edge of two cells, the
        smaller one.
    origin
        Where row 0 is: ``upper``, at ``y_max`` (as in pictures and GeoTIFF), or ``lower``, at ``y_min``.
    scale
        Factor of the risk per unit length, above 0.
    nodata
        Value of cells that are NaN, before scaling. None: NaN is refused.
    unit
        Of values that are people, on a map in metres: ``people/km2`` or ``people/m2``; or ``fatalities/m`` for expected
        fatalities per metre. None: the values have a unit of their own.
    failures
        The aircraft that fails above the people (`ground_risk`); it needs the `unit`.
    system
        The coordinate reference system of the bounds, if they are on its plane: that of a file. A problem on it without
        a `projection` is on that plane.
    covers
        The area with values, and half a cell more, if it differs from the bounds; None for all of the bounds.
        Beyond it, values are unknown; cells without data inside it have the value `nodata`.
    peaks
        Shape of `values`: of a raster laid on another grid, the greatest value that each cell meets, where its own is
        an average. Limits of the density hold for these. None: the values.

    Raises
    ------
    ProblemError
        If a value is negative or infinite, or NaN without `nodata`, if all are NaN, if the shape is not that of a
        raster or has more than 120 million cells, or a setting is malformed, or there are failures but no unit.

    Examples
    --------
    >>> people = RasterRisk([[0, 0, 0], [0, 6, 2]], bounds=(0, 0, 3, 2))
    >>> people.density([(1.5, 0.5), (2.0, 0.5), (1.5, 1.0), (9, 9)])
    array([6., 4., 3., 0.])
    >>> RasterRisk([[0, 0, 0], [0, 6, 2]], bounds=(0, 0, 3, 2), interpolation="nearest").density((1.9, 0.9))
    array(6.)
    >>> town = RasterRisk([[0.002]], bounds=(0, 0, 9, 9), unit="people/m2")
    >>> town.people.greatest, town.scaled(5.0).people == town.people
    (2000.0, True)
    """

    if TYPE_CHECKING:
        _held: RasterValues
        _multiple: float
    else:
        # (a field and a property, so that `dataclasses.replace` takes it)
        values: FloatArray
    bounds: Bounds
    interpolation: Interpolation
    origin: Origin
    scale: float
    nodata: float | None
    unit: Unit | None
    failures: FailureModel | None
    system: CoordinateSystem | None
    covers: BaseGeometry | None
    peaks: FloatArray | None

    def __init__(
        self,
        values: ArrayLike | RowsOf,
        bounds: Bounds,
        *,
        interpolation: Interpolation = "bilinear",
        origin: Origin = "upper",
        scale: float = 1.0,
        nodata: float | None = None,
        unit: Unit | None = None,
        failures: FailureModel | None = None,
        system: CoordinateSystem | None = None,
        covers: BaseGeometry | None = None,
        peaks: ArrayLike | None = None,
    ) -> None:
        """Check everything, and keep a copy of the values."""
        for name, chosen, allowed in (
            ("interpolation", interpolation, get_args(Interpolation)),
            ("origin", origin, get_args(Origin)),
            *([] if unit is None else [("unit", unit, get_args(Unit))]),
        ):
            choice(f"raster {name}", chosen, allowed)
        if failures is not None:
            instance("failures", failures, FailureModel, "a FailureModel, or None")
            if unit not in PER_KM2:
                msg = "the raster has a model of failures, and no unit of people; give unit='people/km2'"
                raise ProblemError(msg)
        instance("system", system, (CoordinateSystem, NoneType), "a CoordinateSystem, or None")
        instance("covers", covers, (BaseGeometry, NoneType), "an area of shapely, or None")
        empty = None if nodata is None else non_negative_number("raster nodata", nodata)
        held = RasterValues.of(
            values,
            framed=interpolation == "bilinear",
            is_upper=origin == "upper",
            nodata=empty,
            remedy="give its value with nodata=…" if nodata is None else None,
        )
        self._take(
            held,
            1.0,
            bounds=bounds_box(bounds),
            interpolation=interpolation,
            origin=origin,
            scale=positive_number("raster scale", scale),
            nodata=empty,
            unit=unit,
            failures=failures,
            system=system,
            covers=covers,
        )
        object.__setattr__(self, "peaks", None if peaks is None else _checked_peaks(peaks, self.values))

    def _take(self, held: RasterValues, multiple: float, **settings: Any) -> None:  # noqa: ANN401 - of settings
        """Keep checked settings, and values times a multiple."""
        for name, one in settings.items():
            object.__setattr__(self, name, one)
        if multiple != 1.0 and self.factor != 1.0:
            # (so that a cell is its value times the factor, to the last bit)
            held, multiple = held.times(multiple), 1.0
        object.__setattr__(self, "_held", held)
        object.__setattr__(self, "_multiple", multiple)
        if not (self.greatest <= GREATEST and held.greatest <= GREATEST**3):
            msg = f"the raster's greatest risk is {self.greatest:g} per unit length; it must be at most {GREATEST:g}"
            raise ProblemError(msg)

    @classmethod
    def from_file(
        cls,
        path: str | os.PathLike[str],
        *,
        bounds: Bounds | None = None,
        kind: Kind = "density",
        interpolation: Interpolation = "bilinear",
        origin: Origin = "upper",
        scale: float = 1.0,
        nodata: float | None = None,
        unit: Unit | None = None,
        coordinates: Coordinates | None = None,
        projection: LocalProjection | None = None,
    ) -> "RasterRisk":
        r"""
        Read a raster: GeoTIFF (``pip install 'cgla-graph[geo]'``), ``.asc``, ``.csv``, ``.csv.gz``, ``.npy``, ``.npz``.

        Longitudes and latitudes become metres, and the sum of density times area stays the same.

        Parameters
        ----------
        path
            The file.
        bounds
            The outer edges of the outer cells, unless the file gives them (GeoTIFF and ``.asc`` do).
        kind
            ``density``: values are per unit of length or area. ``count``: each value is the number of people of its
            cell; it is divided by the cell's area, in map units squared (of a plane, these count as metres).
        interpolation, origin
            As in `RasterRisk`.
        scale
            Factor of the risk, above 0. It does not change the people.
        nodata
            Value of cells without data, in the file's own units, before scaling. None: they are refused.
        unit
            As in `RasterRisk`; None: a unit of their own, or people if they are counts.
        coordinates
            ``plane`` or ``lonlat`` (degrees); None takes those that a GeoTIFF declares, else a plane.
        projection
            Projection of longitudes and latitudes to metres; None for one around the middle of the raster.

        Raises
        ------
        ProblemError
            If the file cannot be read, is malformed, too large (120 million cells, 20 million if they are laid on a
            plane, or of a text without their number) or holds no risk; the message names the file, the fault and the
            remedy.

        Examples
        --------
        >>> import tempfile
        >>> from pathlib import Path
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Path(folder, "people.csv")
        ...     _ = file.write_text("0,8\n4,0\n")
        ...     people = RasterRisk.from_file(file, bounds=(0, 0, 4, 4), kind="count")
        >>> people.cells.tolist()
        [[1.0, 0.0], [0.0, 2.0]]
        """
        if coordinates is None and projection is not None:
            coordinates = "lonlat"
        cells = read_cells(path, most=MOST_CELLS, bounds=bounds, coordinates=coordinates, origin=origin)
        if coordinates is None:
            said_if_laid(cells)
        laid = cells_in_metres(cells, kind=kind, nodata=nodata, projection=projection)
        try:
            system = cells.system if cells.coordinates == "plane" else None
            settings: dict[str, Any] = {"interpolation": interpolation, "scale": scale, "system": system}
            return laid_out(laid, kind, nodata, unit=unit, **settings)
        except ProblemError as error:
            msg = f"{path}: {error}"
            raise ProblemError(msg) from error

    def __repr__(self) -> str:
        """Return size, interpolation, greatest risk and bounds in one line."""
        cells = " x ".join(map(str, self.shape))
        return f"RasterRisk({cells} cells, {self.interpolation}, up to {self.greatest:.4g}, bounds={self.bounds})"

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickle the arguments: the read-only cells are made again."""
        return partial(RasterRisk, **self.settings, peaks=self.peaks), (self.values, self.bounds)

    @property
    def settings(self) -> dict[str, Any]:
        """The arguments other than values, peaks and bounds."""
        names = ("interpolation", "origin", "scale", "nodata", "unit", "failures", "system", "covers")
        return {name: getattr(self, name) for name in names}

    def __eq__(self, other: object) -> bool:
        """Whether both are the same risk, to the last bit, of the same people."""
        return isinstance(other, RasterRisk) and self._digest == other._digest

    def __hash__(self) -> int:
        """Agree with equality."""
        return hash(self._digest)

    @cached_property
    def _digest(self) -> bytes:
        """Digest of the risk, for equality."""
        known = self.unit if self.unit not in PER_KM2 else self.factor / PER_KM2[self.unit]
        told = (self.bounds, self.interpolation, self.shape, known, self.failures)
        digest = hashlib.sha256(repr(told).encode())
        for part in parts_of(self.shape):
            digest.update(self.cells_at(part).tobytes())
        if self.peaks is not None:
            digest.update(self.highest.tobytes())
        return digest.digest()

    @property
    def shape(self) -> tuple[int, int]:
        """Rows and columns."""
        rows, columns = self._held.cells.shape
        return rows, columns

    @property
    def values(self) -> FloatArray:
        """The values as they were given, shape ``(rows, columns)``; NaN without data; read-only."""
        held = self._held
        values = held.cells if self._multiple == 1.0 else held.cells * self._multiple
        if held.missing is not None:
            values = np.where(held.missing, np.nan, values)
        values.flags.writeable = False
        return values[::-1] if self.origin == "upper" else values

    @property
    def cells(self) -> FloatArray:
        """Risk per unit length of each cell, shape ``(rows, columns)``, row 0 at ``y_min``; read-only."""
        cells = self.cells_at(slice(None))
        cells.flags.writeable = False
        return cells

    def cells_at(self, where: slice | tuple[WholeArray, ...]) -> FloatArray:
        """Return some rows of the `cells`, or those in some rows and columns, without a copy of all."""
        factor = self._multiple * self.factor
        cells: FloatArray = self._held.cells[where]
        return cells if factor == 1.0 else cells * factor

    @property
    def highest(self) -> FloatArray:
        """The greatest risk per unit length that each cell meets (`peaks`), in the shape of `cells`; read-only."""
        return self.highest_at(slice(None))

    def highest_at(self, where: slice | tuple[WholeArray, ...]) -> FloatArray:
        """Return some of the `highest`, as `cells_at` those of `cells`."""
        if self.peaks is None:
            return self.cells_at(where)
        highest: FloatArray = self._highest[where]
        return highest

    @cached_property
    def _highest(self) -> FloatArray:
        """The `peaks` as risk per unit length, row 0 at ``y_min``; read-only."""
        peaks = self.values if self.peaks is None else self.peaks
        filled = np.where(self.missing, 0.0 if self.nodata is None else self.nodata, peaks) * self.factor
        highest: FloatArray = np.ascontiguousarray(filled[::-1] if self.origin == "upper" else filled)
        highest.flags.writeable = False
        return highest

    @property
    def factor(self) -> float:
        """Factor from values to risk per unit length: the scale, times that of the model of failures."""
        if self.unit is None or self.failures is None:
            return self.scale
        return self.scale * self.failures.per_metre(self.unit)

    @cached_property
    def people(self) -> "RasterRisk | None":
        """The people behind the risk, people per km2, for any scale; None if the values are no people."""
        if self.unit not in PER_KM2:
            return None
        per_km2 = PER_KM2[self.unit]
        if per_km2 == self.factor == 1.0:
            return self
        return self.times(per_km2, scale=1.0, unit="people/km2", failures=None)

    def times(self, factor: float, **changes: Any) -> "RasterRisk":  # noqa: ANN401 - of settings
        """
        Return a raster whose values are multiplied by a factor, with other `settings`.

        Examples
        --------
        >>> RasterRisk([[2.0]], bounds=(0, 0, 1, 1)).times(3.0, unit="people/km2").values.tolist()
        [[6.0]]
        """
        nodata = None if self.nodata is None else self.nodata * factor
        peaks = None if self.peaks is None else self.peaks * factor
        settings = {**self.settings, "nodata": nodata, **changes}
        if not (factor > 0.0 and changes.keys() <= {"scale", "unit", "failures"}):
            return RasterRisk(self.values * factor, self.bounds, **{"peaks": peaks, **settings})
        # (of the same cells, and so in the same memory)
        made = object.__new__(RasterRisk)
        object.__setattr__(made, "peaks", peaks)
        made._take(self._held, self._multiple * factor, bounds=self.bounds, **settings)
        return made

    @property
    def missing(self) -> BoolArray:
        """Which of the values are NaN, shape ``(rows, columns)``, as they were given; read-only."""
        gone = self._held.missing
        if gone is None:
            return np.broadcast_to(np.False_, self.shape)
        return gone[::-1] if self.origin == "upper" else gone

    @cached_property
    def known(self) -> BaseGeometry:
        """The area with values: `covers` without the half cell more, or the bounds."""
        if self.covers is None:
            return shapely.box(*self.bounds)
        return self.covers.buffer(-NEARLY_HALF * min(self.cell_size), join_style="mitre")

    @cached_property
    def filled(self) -> BoolArray:
        """Which cells have no data and count as `nodata`, in the shape of `cells`: none beyond `known`."""
        if self._held.missing is None or self.covers is None:
            return self.missing[::-1] if self.origin == "upper" else self.missing
        gone = self._held.missing.copy()
        (width, height), (rows, columns) = self.cell_size, np.nonzero(gone)
        gone[rows, columns] = shapely.contains_xy(
            self.known, self.bounds[0] + (columns + 0.5) * width, self.bounds[1] + (rows + 0.5) * height
        )
        return gone

    @property
    def cell_size(self) -> tuple[float, float]:
        """Width and height of a cell, map units."""
        x_min, y_min, x_max, y_max = self.bounds
        rows, columns = self.shape
        return (x_max - x_min) / columns, (y_max - y_min) / rows

    @property
    def greatest(self) -> float:
        """The greatest risk per unit length."""
        return self._held.greatest * self._multiple * self.factor

    def density(self, points: ArrayLike) -> FloatArray:
        """
        Evaluate the risk per unit length at points, shape ``(..., 2)``, map units.

        Raises
        ------
        ProblemError
            If `points` is not an array of finite pairs.
        """
        where = point_array("points", points)
        out = np.zeros(where.shape[:-1])
        kernels.add_densities(where.reshape(-1, 2), raster_array([self]), out.reshape(-1))
        return out

    def area_above(
        self, level: float, *, buffer: float = 0.0, beyond: tuple[int, int, int, int] = (0, 0, 0, 0)
    ) -> BaseGeometry:
        """
        Return the area of the cells whose own risk is above a level, widened.

        Parameters
        ----------
        level
            Risk per unit length, at least 0; for a limit in people per km2, take the area of `people`.
        buffer
            By how much the cells are widened, map units, at least 0: half the width of a corridor that has to stay
            clear of them. Round corners are polygons around the circle, at most 1/13000 too wide.
        beyond
            How many times the outer cells are repeated, beyond the least x, least y, greatest x and greatest y.

        Returns
        -------
        area
            Whole cells, with either interpolation; empty if there are none.

        Raises
        ------
        ProblemError
            If a number is negative.

        Examples
        --------
        >>> people = RasterRisk([[0, 0, 0], [0, 6, 2]], bounds=(0, 0, 3, 2))
        >>> people.area_above(3.0).bounds, round(people.area_above(3.0, buffer=0.5).area, 3)
        ((1.0, 0.0, 2.0, 1.0), 3.786)
        >>> people.area_above(6.0).is_empty
        True
        """
        level, reach = non_negative_number("level", level), non_negative_number("buffer", buffer)
        above = np.concatenate([self.highest_at(part) > level for part in parts_of(self.shape)])
        x, y = (
            _edges(self.bounds[axis], self.bounds[axis + 2], self.shape[1 - axis], beyond[axis], beyond[axis + 2])
            for axis in (0, 1)
        )
        if any(beyond):
            above = np.pad(above, ((beyond[1], beyond[3]), (beyond[0], beyond[2])), mode="edge")
        area = shapely.union_all(cell_strips(above, x, y))
        # a polygon around the circle, not inside it
        reach /= math.cos(math.pi / (4.0 * ROUND))
        # (a buffer far below the rounding of the coordinates comes back empty)
        return area.union(area.buffer(reach, quad_segs=ROUND)) if reach > 0.0 else area

    def scaled(self, factor: float) -> "RasterRisk":
        """
        Return a raster whose risk is multiplied by a factor; the people stay the same.

        Raises
        ------
        ProblemError
            If the factor is not above 0, or too great.

        Examples
        --------
        >>> RasterRisk([[2.0]], bounds=(0, 0, 1, 1)).scaled(3.0).greatest
        6.0
        """
        return self.times(1.0, scale=self.scale * positive_number("factor", factor))

    def flown_over_by(self, model: FailureModel) -> "RasterRisk":
        """
        Return the risk of an aircraft that fails above the people of this raster: expected fatalities per metre.

        Raises
        ------
        ProblemError
            If the values have no unit, or there is a factor besides their unit: a scale, or another model.

        Examples
        --------
        >>> town = RasterRisk([[1000.0]], bounds=(0, 0, 1000, 1000), unit="people/km2")
        >>> f"{town.flown_over_by(FailureModel(1e-3, speed=20, lethal_area=6.5)).greatest:.3g} per metre"
        '9.03e-11 per metre'
        """
        wrong = ""
        if self.unit not in PER_KM2:
            known = f"its values have {'no unit' if self.unit is None else f'the unit {self.unit}'}"
            wrong = (
                f"{known}; if they are people, say so: {', '.join(PER_KM2)} (unit), or kind count for people of cells"
            )
        elif self.failures is not None:
            wrong = f"it is the risk of {self.failures} already; give its people, as raster.people"
        elif self.scale != 1.0:
            wrong = (
                f"it has a scale of {self.scale:g}, a second factor beside the model of failures; leave out the scale "
                "(the people are raster.people)"
            )
        if wrong:
            msg = f"a raster cannot become the risk of failures: {wrong}"
            raise ProblemError(msg)
        return self.times(1.0, failures=model)

    def header(self, offset: int) -> list[float]:
        """Return the header for kernels (`risk_raster_kernels`); the values begin at `offset`."""
        x_min, y_min, x_max, y_max = self.bounds
        rows, columns = self.shape
        width, height = self.cell_size
        bilinear = self.interpolation == "bilinear"
        half, more = (0.5, 1) if bilinear else (0.0, 0)
        # coordinates are rounded by some ulps
        near_x, near_y = (
            2.0**-49 * (max(abs(low), abs(high)) / size + count)
            for low, high, size, count in ((x_min, x_max, width, columns), (y_min, y_max, height, rows))
        )
        in_row = columns + 2 * more
        return [
            x_min - half * width, y_min - half * height, width, height, columns + more, rows + more, offset, in_row,
            float(bilinear), half, near_x, near_y, self._multiple * self.factor,
        ]  # fmt: skip

    def array(self) -> FloatArray:
        """Return the array that kernels take of this raster alone; read-only."""
        return self._held.with_header(self.header(kernels.HEADER))


def laid_out(
    laid: Laid,
    kind: Kind,
    nodata: float | None,
    *,
    unit: Unit | None = None,
    **settings: Any,  # noqa: ANN401 - of RasterRisk
) -> RasterRisk:
    """
    Make a raster of cells of a file in metres; counts are people.

    Parameters
    ----------
    laid
        As `cgla_graph.model.rasters.projection.cells_in_metres` returns them.
    kind, nodata, unit
        As in `RasterRisk.from_file`.
    **settings
        Other settings of `RasterRisk`.

    Raises
    ------
    ProblemError
        If counts have another unit, or as `RasterRisk` raises it.

    Examples
    --------
    >>> raster = laid_out(Laid(np.array([[0.5]]), (0, 0, 10, 10)), "count", None)
    >>> raster.unit, float(raster.people.cells[0, 0])
    ('people/m2', 500000.0)
    """
    if kind == "count":
        if unit is not None:
            msg = f"unit is {shown(unit)}, but the values are counts: people of whole cells; leave out one of the two"
            raise ProblemError(msg)
        unit = "people/m2"
    # (on the file's own cells, these were refused)
    if (
        nodata is None
        and isinstance(laid.values, np.ndarray)
        and laid.peaks is not None
        and np.isnan(laid.values).any()
    ):
        # (all of these are outside of the file)
        nodata = 0.0
    settings |= {"nodata": nodata, "unit": unit, "covers": laid.outline, "peaks": laid.peaks}
    return RasterRisk(laid.values, laid.bounds, **settings)


def raster_array(rasters: Sequence[RasterRisk]) -> FloatArray:
    """
    Return rasters, at least one, as the read-only array that kernels take.

    Examples
    --------
    >>> raster_array([RasterRisk([[1.0, 2.0]], bounds=(0, 0, 2, 1), interpolation="nearest")])[13:].tolist()
    [1.0, 2.0]
    """
    if len(rasters) == 1:
        return rasters[0].array()
    heads: list[float] = []
    parts: list[FloatArray] = []
    offset = kernels.HEADER * len(rasters)
    for raster in rasters:
        heads += raster.header(offset)
        parts.append(raster.array()[kernels.HEADER :])
        offset += len(parts[-1])
    array = np.concatenate([np.array(heads), *parts])
    array.flags.writeable = False
    return array


def _edges(low: float, high: float, count: int, before: int, after: int) -> FloatArray:
    """Return the edges of so many cells, and of more before and after them."""
    size = (high - low) / count
    first, last, count = low - before * size, high + after * size, count + before + after
    edges: FloatArray = first + np.arange(count + 1.0) * ((last - first) / count)
    return edges


def _checked_peaks(peaks: ArrayLike, values: FloatArray) -> FloatArray:
    """Check the peaks of a raster, which are at least its values, and return a read-only copy."""
    given = number_array("the raster's peaks", peaks, masked=np.nan).copy()
    if given.shape != values.shape or not np.array_equal(np.isnan(given), np.isnan(values)) or (given < values).any():
        msg = "the raster's peaks are not at least its values, cell by cell; correct them, or leave them out"
        raise ProblemError(msg)
    given.flags.writeable = False
    return given


def cell_strips(chosen: BoolArray, x: FloatArray, y: FloatArray) -> list[BaseGeometry]:
    """
    Return the chosen cells between lines at `x` and `y`, adjacent cells of a row as one rectangle.

    Examples
    --------
    >>> [strip.bounds for strip in cell_strips(np.array([[True, True, False]]), np.arange(4.0), np.arange(2.0))]
    [(0.0, 0.0, 2.0, 1.0)]
    """
    strips: list[BaseGeometry] = []
    for row in np.flatnonzero(chosen.any(axis=1)).tolist():
        edges = np.flatnonzero(np.diff(chosen[row], prepend=False, append=False)).reshape(-1, 2).tolist()
        strips += [shapely.box(x[first], y[row], x[last], y[row + 1]) for first, last in edges]
    return strips
