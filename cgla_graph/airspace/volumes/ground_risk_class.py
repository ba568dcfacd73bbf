"""Greatest density of people under an area, and the intrinsic ground risk class of SORA 2.5."""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import figure
from cgla_graph._validate import non_negative_number, positive_number
from cgla_graph.model.ground_risk import filled_text
from cgla_graph.model.risk_raster import RasterRisk

SORA: Final = "JARUS SORA 2.5, main body, step 2, table 2"
#: Columns of the table: greatest characteristic dimension (m) and speed (m/s).
COLUMNS: Final = ((1.0, 25.0), (3.0, 35.0), (8.0, 75.0), (20.0, 120.0), (40.0, 200.0))
#: Rows of the table: densities below this (people per km2), and the class in each column; None: not part of SORA.
ROWS: Final[tuple[tuple[float, tuple[int | None, ...]], ...]] = (
    (5.0, (2, 3, 4, 5, 6)),
    (50.0, (3, 4, 5, 6, 7)),
    (500.0, (4, 5, 6, 7, 8)),
    (5_000.0, (5, 6, 7, 8, 9)),
    (50_000.0, (6, 7, 8, 9, 10)),
    (math.inf, (7, 8, None, None, None)),
)
#: The row of a controlled ground area, in which there are no people who are not involved.
CONTROLLED: Final = (1, 1, 2, 3, 3)
#: Cells up to which each is tested at once.
_CHUNK: Final = 500_000


@dataclass(frozen=True)
class Density:
    """
    The greatest density of people under an area.

    Attributes
    ----------
    greatest
        People per km2, in the cells that the area touches and whose density is known; NaN if there are none.
    unknown
        Why it is not known that nowhere are more; empty if it is known.
    filled
        What cells without data below count as, people per km2; None if there are none.

    Examples
    --------
    >>> str(Density(412.3)), Density(412.3, "a part of it is outside of the raster").is_known
    ('412.3 people/km2', False)
    """

    greatest: float
    unknown: str = ""
    filled: float | None = None

    @property
    def is_known(self) -> bool:
        """Whether nowhere are more people than `greatest`."""
        return not self.unknown

    def __str__(self) -> str:
        """Return the density with its unit, or why it is not known."""
        known = f"{figure(self.greatest, 4)} people/km2"
        filled = filled_text(self.filled)
        if self.is_known:
            return f"{known}{f' ({filled[2:]})' if filled else ''}"
        least = "" if math.isnan(self.greatest) else f" (at least {known}{filled})"
        return f"not known: {self.unknown}{least}"

    def document(self) -> dict[str, Any]:
        """Return it as JSON: None where it is not known."""
        least = None if math.isnan(self.greatest) else self.greatest
        return {
            "people_per_km2": least if self.is_known else None,
            "at_least": least,
            "unknown": self.unknown,
            "without_data": self.filled,
        }


def density_under(area: BaseGeometry, people: RasterRisk | None, *, without_data: float | None = None) -> Density:
    """
    Return the greatest density of people under an area: that of the cells that it touches.

    Parameters
    ----------
    area
        On the map of the raster.
    people
        People per km2; None if unknown.
    without_data
        People per km2 outside of the raster, as 0 over the sea, and in cells without data; None if it is unknown
        outside, and cells without data count as the `nodata` of the raster, which says what they stand for.

    Raises
    ------
    ProblemError
        If `without_data` is negative.

    Examples
    --------
    >>> town = RasterRisk([[10.0, 500.0]], bounds=(0, 0, 2000, 1000))
    >>> print(density_under(shapely.box(100, 100, 1100, 200), town))
    500.0 people/km2
    >>> print(density_under(shapely.box(100, 100, 900, 1200), town))
    not known: a part of the area is outside of the raster of people (at least 10.00 people/km2)
    """
    fill = None if without_data is None else non_negative_number("without_data", without_data)
    if people is None:
        return Density(math.nan, "there is no layer of people")
    boxes, touched = _touched(area, people)
    missing = (people.missing[::-1] if people.origin == "upper" else people.missing) & touched
    filled = people.filled & touched
    counting = touched & ~missing
    stands = None
    if filled.any():
        stands = fill if fill is not None else people.nodata
    values = [*people.highest[counting].tolist(), *([] if stands is None else [stands])]
    outside = not shapely.box(*people.bounds).covers(area)
    if people.covers is not None and not outside:
        # (cells on the edge of the data are averaged with missing ones)
        outside = not (people.known.covers(area) and shapely.covers(people.known, boxes).all())
    if outside and fill is not None:
        return Density(max([*values, fill]), filled=stands)
    why = "a part of the area is outside of the raster of people" if outside else ""
    return Density(max(values, default=math.nan), why, stands)


def _touched(
    area: BaseGeometry, raster: RasterRisk
) -> tuple[np.ndarray[Any, np.dtype[np.object_]], np.ndarray[Any, np.dtype[np.bool_]]]:
    """Return the cells that an area touches, and their mask, shape ``(rows, columns)``, row 0 at ``y_min``."""
    rows, columns = raster.shape
    touched = np.zeros((rows, columns), dtype=bool)
    none = np.empty(0, dtype=object)
    if area.is_empty:
        return none, touched
    (wide, high), (x_min, y_min, _, _) = raster.cell_size, raster.bounds
    low_x, low_y, high_x, high_y = area.bounds
    # (an area that ends on the line between two cells touches both)
    first, last = max(0, math.ceil((low_x - x_min) / wide) - 1), min(columns - 1, math.floor((high_x - x_min) / wide))
    low, top = max(0, math.ceil((low_y - y_min) / high) - 1), min(rows - 1, math.floor((high_y - y_min) / high))
    if last < first or top < low:
        return none, touched
    shapely.prepare(area)
    found = [none]
    left = x_min + wide * np.arange(first, last + 1)
    band = max(1, _CHUNK // len(left))
    for row in range(low, top + 1, band):
        below = y_min + high * np.arange(row, min(row + band, top + 1))
        boxes = shapely.box(left[None, :], below[:, None], left[None, :] + wide, below[:, None] + high)
        meets = shapely.intersects(area, boxes)
        touched[row : row + len(below), first : last + 1] = meets
        found.append(boxes[meets])
    return np.concatenate(found), touched


@dataclass(frozen=True)
class GroundRiskClass:
    """
    The intrinsic ground risk class.

    Attributes
    ----------
    value
        The class; None if it is not known, or not part of SORA.
    reason
        How it follows from the table, or why there is none.
    at_least
        The class of the known part, where a part is unknown.

    Examples
    --------
    >>> print(intrinsic_class(Density(412.0), dimension=0.8, speed=20))
    4: fewer than 500 people/km2, up to 1 m and 25 m/s (JARUS SORA 2.5, main body, step 2, table 2)
    """

    value: int | None
    reason: str
    at_least: int | None = None

    def __str__(self) -> str:
        """Return the class with its reason and source."""
        if self.value is not None:
            return f"{self.value}: {self.reason} ({SORA})"
        least = "" if self.at_least is None else f"; at least {self.at_least}"
        return f"none: {self.reason}{least} ({SORA})"

    def document(self) -> dict[str, Any]:
        """Return it as JSON."""
        return {**vars(self), "source": SORA}


def intrinsic_class(density: Density, *, dimension: float, speed: float, controlled: bool = False) -> GroundRiskClass:
    """
    Return the intrinsic ground risk class of SORA 2.5.

    Parameters
    ----------
    density
        Greatest density in the operational volume and the ground risk buffer.
    dimension, speed
        Characteristic dimension, metres, and greatest speed, m/s, of the aircraft, above 0: the first column of the
        table counts in which both fit.
    controlled
        Whether all of it is a controlled ground area.

    Raises
    ------
    ProblemError
        If dimension or speed is not above 0.

    Examples
    --------
    >>> intrinsic_class(Density(500.0), dimension=0.8, speed=30).value
    6
    >>> intrinsic_class(Density(3.0, "2 cells below it have no data"), dimension=0.8, speed=20).value is None
    True
    """
    wide, fast = positive_number("dimension", dimension), positive_number("speed", speed)
    column = next((one for one, most in enumerate(COLUMNS) if wide <= most[0] and fast <= most[1]), None)
    if column is None:
        return GroundRiskClass(None, f"the table ends at {COLUMNS[-1][0]:g} m and {COLUMNS[-1][1]:g} m/s")
    size = f"up to {COLUMNS[column][0]:g} m and {COLUMNS[column][1]:g} m/s"
    if controlled:
        return GroundRiskClass(CONTROLLED[column], f"controlled ground area, as given, {size}")
    least = None
    words = ""
    if not math.isnan(density.greatest):
        most, row = next(one for one in ROWS if density.greatest < one[0])
        least = row[column]
        words = f"fewer than {most:,.0f} people/km2" if math.isfinite(most) else "50,000 people/km2 or more"
    if not density.is_known:
        return GroundRiskClass(None, f"the density is not known: {density.unknown}", least)
    if least is None:
        return GroundRiskClass(None, f"{words} and an aircraft {size} are not part of SORA")
    return GroundRiskClass(least, f"{words}, {size}")
