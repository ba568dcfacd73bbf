"""The values of a raster, checked and copied a few rows at a time into the one array that kernels take."""

import math
import threading
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, cast

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph._validate import number_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk_raster_kernels import HEADER

#: Cells of one raster, at most: 960 MB. Fewer where the values are laid on another grid, which takes five times that
#: for each cell, or read from numbers in a text with no size in front.
MOST_CELLS, MOST_LAID = 120_000_000, 20_000_000
#: Cells that are checked and copied at a time.
AT_ONCE = 1 << 20
#: Only one raster writes its header in front of values that several have.
_WRITING = threading.Lock()


class RowsOf(NamedTuple):
    """Values that are computed as their rows are asked for, so that they are in memory once."""

    shape: tuple[int, int]
    rows: Callable[[slice], FloatArray]


@dataclass(frozen=True, eq=False)
class RasterValues:
    """
    The values of a raster in one array, which rasters that differ by a factor have in common.

    Attributes
    ----------
    cells
        Shape ``(rows, columns)``, row 0 at the least y: a read-only view of `array`. Those without data have the value
        that was given for them.
    missing
        Those without data, in the shape of `cells`; None if there are none.
    greatest
        The greatest value.
    """

    cells: FloatArray
    missing: BoolArray | None
    greatest: float

    @classmethod
    def of(
        cls, values: ArrayLike | RowsOf, *, framed: bool, is_upper: bool, nodata: float | None, remedy: str | None
    ) -> "RasterValues":
        """
        Check values, and copy them.

        Parameters
        ----------
        values
            Shape ``(rows, columns)``, at least 0; NaN, or masked, stands for cells without data.
        framed
            Whether a frame around the cells repeats the outermost ones, as for bilinear interpolation.
        is_upper
            Whether row 0 is at the greatest y.
        nodata
            Value of cells without data.
        remedy
            What to do about cells without data, where they are refused; else None.

        Raises
        ------
        ProblemError
            If there are no values, too many, or one is negative, infinite, or without data.

        Examples
        --------
        >>> held = RasterValues.of([[1, 2], [3, np.nan]], framed=True, is_upper=True, nodata=5.0, remedy=None)
        >>> held.cells.tolist(), held.greatest, len(held.array) - HEADER
        ([[3.0, 5.0], [1.0, 2.0]], 5.0, 16)
        """
        given = _numbers(values)
        rows, columns = _checked_shape(given.shape)
        more = 1 if framed else 0
        array = np.empty(HEADER + (rows + 2 * more) * (columns + 2 * more))
        array[:HEADER] = math.nan
        lines = array[HEADER:].reshape(rows + 2 * more, columns + 2 * more)
        cells = lines[more : more + rows, more : more + columns]
        missing, found = _copied(given, cells[::-1] if is_upper else cells)
        found.require_risk(given.shape, remedy)
        greatest = found.greatest
        if missing is not None:
            missing = missing[::-1] if is_upper else missing
            filled = 0.0 if nodata is None else nodata
            greatest = max(greatest, filled)
            for part in parts_of(cells.shape):
                cells[part][missing[part]] = filled
            missing.flags.writeable = False
        if framed:
            lines[:, 0], lines[:, -1] = lines[:, 1], lines[:, -2]
            lines[0], lines[-1] = lines[1], lines[-2]
        cells.flags.writeable = False
        return cls(cells, missing, greatest)

    @property
    def array(self) -> FloatArray:
        """Room for a header, NaN until there is one, and the lines that kernels read, shape ``(n,)``."""
        return cast("FloatArray", self.cells.base)

    def times(self, factor: float) -> "RasterValues":
        """Return a copy whose values are multiplied by a factor."""
        array, (rows, columns) = self.array * factor, self.cells.shape
        array[:HEADER] = math.nan
        more = 0 if len(array) - HEADER == rows * columns else 1
        lines = array[HEADER:].reshape(rows + 2 * more, columns + 2 * more)
        cells = lines[more : more + rows, more : more + columns]
        cells.flags.writeable = False
        return replace(self, cells=cells, greatest=self.greatest * factor)

    def with_header(self, header: list[float]) -> FloatArray:
        """Return the read-only array that kernels take: a copy if another raster has put its header there."""
        head = np.array(header)
        with _WRITING:
            if math.isnan(self.array[0]):
                self.array[:HEADER] = head
            array = self.array.view()
        if not np.array_equal(array[:HEADER], head):
            array = np.concatenate([head, array[HEADER:]])
        array.flags.writeable = False
        return array


def parts_of(shape: tuple[int, ...]) -> Iterator[slice]:
    """
    Yield the rows of an array, so many at a time that their cells fit into the caches of a processor.

    Examples
    --------
    >>> [(part.start, part.stop) for part in parts_of((5, 500_000))]
    [(0, 2), (2, 4), (4, 5)]
    """
    rows, columns = shape
    step = max(1, AT_ONCE // max(columns, 1))
    for first in range(0, rows, step):
        yield slice(first, min(first + step, rows))


class _Found(NamedTuple):
    """What values are, as far as they were looked at: counts, and the first of each kind."""

    greatest: float = 0.0
    n_missing: int = 0
    first_missing: tuple[int, int] = (0, 0)
    n_wrong: int = 0
    first_wrong: tuple[int, int, float] = (0, 0, 0.0)

    def after(self, row: int, values: FloatArray, missing: BoolArray) -> "_Found":
        """Return what is found with more rows, from a row on."""
        n_missing, n_wrong = self.n_missing, self.n_wrong
        first_missing, first_wrong = self.first_missing, self.first_wrong
        if missing.any():
            if not n_missing:
                y, x = np.argwhere(missing)[0].tolist()
                first_missing = row + y, x
            n_missing += int(missing.sum())
        # (NaN is neither less nor greater)
        least, most = float(np.fmin.reduce(values, axis=None)), float(np.fmax.reduce(values, axis=None))
        if least < 0.0 or most == math.inf:
            wrong = (values < 0.0) | np.isinf(values)
            if not n_wrong:
                y, x = np.argwhere(wrong)[0].tolist()
                first_wrong = row + y, x, float(values[y, x])
            n_wrong += int(wrong.sum())
        greatest = max(self.greatest, most)
        return _Found(greatest, n_missing, first_missing, n_wrong, first_wrong)

    def require_risk(self, shape: tuple[int, ...], remedy: str | None) -> None:
        """Raise the error of values that are no raster's."""
        if self.n_missing == math.prod(shape):
            msg = "the raster holds no data: all of its values are NaN or nodata"
            raise ProblemError(msg)
        if remedy is not None and self.n_missing:
            row, column = self.first_missing
            msg = (
                f"{self.n_missing} cells of the raster have no data, the first in row {row}, column {column}; {remedy}"
            )
            raise ProblemError(msg)
        if self.n_wrong:
            row, column, value = self.first_wrong
            msg = (
                f"{self.n_wrong} values of the raster are no risk, the first is {value:g} in row {row}, column "
                f"{column}; give finite values of at least 0, and NaN where there are no data"
            )
            raise ProblemError(msg)


def _copied(given: "NDArray[Any] | RowsOf", to: FloatArray) -> tuple[BoolArray | None, _Found]:
    """Copy values; return which are missing, None if none is, and what they are."""
    missing, found = None, _Found()
    for part in parts_of(given.shape):
        values = given.rows(part) if isinstance(given, RowsOf) else given[part]
        to[part] = values
        gone = np.isnan(to[part])
        found = found.after(part.start, to[part], gone)
        if found.n_missing:
            missing = np.zeros(given.shape, dtype=np.bool_) if missing is None else missing
            missing[part] = gone
    return missing, found


def _numbers(values: ArrayLike | RowsOf) -> "NDArray[Any] | RowsOf":
    """Return values as an array of numbers of any kind; masked ones are NaN."""
    if isinstance(values, RowsOf) or (type(values) is np.ndarray and values.dtype.str[1:] in _PLAIN):
        return values
    if getattr(values, "dtype", None) == np.bool_:
        # (cells of one kind of land are a risk of 1)
        values = cast("BoolArray", values).astype(np.float64)
    return number_array("the raster's values", cast("ArrayLike", values), masked=np.nan)


#: Types of numbers that NumPy converts as they are copied.
_PLAIN = frozenset(("f4", "f8", "u1", "u2", "u4", "i1", "i2", "i4"))


def _checked_shape(shape: tuple[int, ...]) -> tuple[int, int]:
    if len(shape) != 2 or not math.prod(shape):  # noqa: PLR2004 - rows and columns
        msg = f"the raster's values have shape {shape}; give them in shape (rows, columns)"
        raise ProblemError(msg)
    if math.prod(shape) > MOST_CELLS:
        msg = (
            f"the raster has {shape[0]} x {shape[1]} cells, more than {MOST_CELLS}; "
            "cut out the part that matters, or join cells to larger ones"
        )
        raise ProblemError(msg)
    return shape[0], shape[1]
