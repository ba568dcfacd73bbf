"""Densities averaged over the footprint of a crash: a raster convolved with a disc."""

import math

import numpy as np
import shapely
from numpy.typing import NDArray

from cgla_graph._text import figure
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, non_negative_number, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.risk_raster import RasterRisk

#: Cells across a footprint, at most.
MOST_ACROSS = 2_001


def footprint_density(
    people: RasterRisk, radius: float, *, ahead: float = 0.0, outside: float | None = None
) -> RasterRisk:
    """
    Average a raster over the disc in which an aircraft may come down around each place.

    A footprint that depends neither on heading nor on wind makes another raster, so that everything holds for it that
    holds for rasters: integrals are exact, and lower bounds are proven. A footprint ahead of the aircraft depends on
    its heading; then each cell has the greatest average over all headings.

    Parameters
    ----------
    people
        The raster; each value counts for its whole cell, and those without data as their `nodata`.
    radius
        Radius of the disc, map units, above 0.
    ahead
        Distance of its centre from the aircraft, map units, at least 0.
    outside
        Value outside of the raster, in its own unit, at least 0. None: unknown, and cells whose footprint leaves the
        raster have no data; where a number is needed, they count as the greatest value of the raster.

    Returns
    -------
    density
        On the same cells, with the same unit, scale and model of failures; the average at the centre of each is exact.
        Without a distance ahead, the sum over all cells stays the same but for what crosses the border of the raster.

    Raises
    ------
    ProblemError
        If a number is out of range, the footprint is more than 2000 cells wide, or leaves the raster everywhere.

    Examples
    --------
    >>> one = RasterRisk([[0.0] * 5, [0.0] * 5, [0.0, 0.0, 314.0, 0.0, 0.0], [0.0] * 5, [0.0] * 5], bounds=(0, 0, 5, 5))
    >>> spread = footprint_density(one, 1.5, outside=0.0)
    >>> round(float(spread.cells.sum()), 6), round(float(spread.cells[2, 2]), 2)
    (314.0, 44.42)
    """
    instance("people", people, RasterRisk, "a RasterRisk of people")
    radius, ahead = positive_number("radius", radius), non_negative_number("ahead", ahead)
    fill = None if outside is None else non_negative_number("outside", outside)
    weights = disc_weights(radius, people.cell_size)
    base = 0.0 if fill is None else fill
    upright = people.values[::-1] if people.origin == "upper" else people.values
    values = np.where(np.isnan(upright), 0.0 if people.nodata is None else people.nodata, upright)
    # (cells beyond the known area)
    values = np.where(np.isnan(upright) & ~people.filled, base, values)
    most = float(values.max())
    # (rounding must not go beyond the values)
    found = np.clip(_convolved(values - base, weights) + base, min(float(values.min()), base), max(most, base))
    reach = weights.shape
    if ahead > 0.0:
        ring = _ring(ahead, people.cell_size)
        found = _greatest_over(np.pad(found, [(one // 2, one // 2) for one in ring.shape], constant_values=base), ring)
        reach = (reach[0] + ring.shape[0] - 1, reach[1] + ring.shape[1] - 1)
    settings = {**people.settings, "origin": "lower", "nodata": None if fill is not None else most, "covers": None}
    if fill is not None:
        return RasterRisk(found, people.bounds, **settings)
    up, across = reach[0] // 2, reach[1] // 2
    rows, columns = found.shape
    if rows <= 2 * up or columns <= 2 * across:
        msg = (
            f"the footprint of {figure(radius + ahead, 4)} leaves the raster around every cell; give outside, the "
            "density there, or a larger raster"
        )
        raise ProblemError(msg)
    known = np.full(found.shape, np.nan)
    known[up : rows - up, across : columns - across] = found[up : rows - up, across : columns - across]
    (width, height), (x_min, y_min, x_max, y_max) = people.cell_size, people.bounds
    box = shapely.box(x_min + across * width, y_min + up * height, x_max - across * width, y_max - up * height)
    inner = box if people.covers is None else shapely.intersection(box, people.known.buffer(-(radius + ahead)))
    covers = inner.buffer(0.5 * min(width, height), join_style="mitre")
    return RasterRisk(known, people.bounds, **{**settings, "covers": covers})


def disc_weights(radius: float, cell: tuple[float, float]) -> FloatArray:
    """
    Return the part of a disc around the centre of a cell that lies in each cell, shape ``(rows, columns)``, both odd.

    Parameters
    ----------
    radius
        Radius of the disc.
    cell
        Width and height of a cell.

    Raises
    ------
    ProblemError
        If it is more than 2000 cells wide.

    Examples
    --------
    >>> weights = disc_weights(1.0, (1.0, 1.0))
    >>> weights.shape, round(float(weights.sum()), 12), round(float(weights[1, 1] * math.pi), 6)
    ((3, 3), 1.0, 1.0)
    """
    sides = []
    for size in cell:
        half = math.ceil(radius / size - 0.5)
        if 2 * half + 1 > MOST_ACROSS:
            msg = f"the footprint is {2 * half + 1} cells wide, more than {MOST_ACROSS}; join cells to larger ones"
            raise ProblemError(msg)
        sides.append((np.arange(2 * max(half, 0) + 2) - max(half, 0) - 0.5) * size)
    corners = _disc_below(radius, *np.meshgrid(*sides))
    areas = np.diff(np.diff(corners, axis=0), axis=1) / (math.pi * radius * radius)
    return np.asarray(np.clip(areas, 0.0, None))


def _disc_below(radius: float, x: FloatArray, y: FloatArray) -> FloatArray:
    """Return the area of the disc around the origin that is left of `x` and below `y`."""
    x, y = np.clip(x, -radius, radius), np.clip(y, -radius, radius)

    def half(u: FloatArray) -> FloatArray:
        # area between the x axis and the circle, left of u
        u = np.clip(u, -radius, radius)
        root = np.sqrt(np.clip(radius * radius - u * u, 0.0, None))
        return np.asarray(0.5 * (u * root + radius * radius * (np.arcsin(u / radius) + 0.5 * math.pi)))

    end = np.sqrt(np.clip(radius * radius - y * y, 0.0, None))
    inner = np.clip(x, -end, end)
    middle = y * (inner + end) + half(inner) - half(-end)
    # where the circle is below y, all of the disc counts
    sides = 2.0 * (half(np.minimum(x, -end)) + np.where(x > end, half(x) - half(end), 0.0))
    return np.asarray(middle + np.where(y > 0.0, sides, 0.0))


def _convolved(cells: FloatArray, weights: FloatArray) -> FloatArray:
    """Return the convolution on the same cells; outside of them is 0."""
    from scipy.signal import oaconvolve  # noqa: PLC0415 - slow to import

    return np.asarray(oaconvolve(cells, weights, mode="same") if weights.size > 1 else cells * weights)


def _ring(distance: float, cell: tuple[float, float]) -> NDArray[np.bool_]:
    """Return the cells in which a place at a distance from some point of the middle cell may be."""
    diagonal = math.hypot(*cell)
    sides = [np.arange(-half, half + 1) * size for size in cell for half in [math.ceil((distance + diagonal) / size)]]
    x, y = np.meshgrid(*sides)
    return np.asarray(np.abs(np.hypot(x, y) - distance) <= diagonal)


def _greatest_over(cells: FloatArray, ring: NDArray[np.bool_]) -> FloatArray:
    """Return the greatest value over a ring around each cell; the cells have a frame of half its size."""
    from scipy.ndimage import maximum_filter  # noqa: PLC0415 - slow to import

    up, across = ring.shape[0] // 2, ring.shape[1] // 2
    return np.asarray(maximum_filter(cells, footprint=ring, mode="nearest")[up:-up, across:-across])
