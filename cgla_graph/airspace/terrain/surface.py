"""The ground below a box and along legs: greatest elevations around cells, and elevations between their centres."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Final

import numpy as np

from cgla_graph._types import BoolArray, Bounds, FloatArray, IntArray
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.model.earth import LEAST_DEGREE, LocalProjection, wrapped

#: A point this near to the edge of a cell may be in the cell beside it, metres: autopilots round places that much.
ROUNDED: Final = 0.01
#: Pieces of a leg per cell, and their greatest length, metres: so short, a piece is straight in degrees.
_PER_CELL, _LONGEST = 4.4, 200.0
#: Points of a leg at which its way in degrees is measured first.
_COARSE: Final = 9
#: Pieces that are held at a time; a leg of more pieces is not divided.
MOST_PIECES: Final = 400_000
#: Degrees beyond the sampled places of a route.
_MARGIN: Final = 1e-6
_FULL_TURN: Final = 360.0


@dataclass(frozen=True, eq=False)
class Surface:
    """
    The part of a raster of elevations near a box.

    Parameters
    ----------
    values
        Metres above the sea, shape ``(rows, columns)``, row 0 in the north; NaN where unknown.
    west, north
        Outer edges of the first column and row, degrees.
    cell
        Width and height of a cell, degrees.

    Examples
    --------
    >>> ground = Ground(np.array([[0.0, 9.0, 0.0, 0.0]]), (6.0, 49.0, 10.0, 50.0))
    >>> surface = Surface.near(ground, (6.0, 49.0, 10.0, 50.0))
    >>> surface.around.tolist(), surface.between(np.array([[7.0, 49.5]])).tolist()
    ([[9.0, 9.0, 9.0, 0.0]], [4.5])
    """

    values: FloatArray
    west: float
    north: float
    cell: tuple[float, float]

    @classmethod
    def near(cls, ground: Ground, box: Bounds) -> "Surface":
        """
        Cut a raster to a box and two cells around it; a raster all around the Earth goes on beyond its edges.

        Parameters
        ----------
        ground
            The raster.
        box
            West, south, east, north, degrees; longitudes may go on beyond 180 degrees.
        """
        west, _, east, north = ground.bounds
        wide, high = ground.cell
        rows, columns = ground.values.shape
        # the turn at which raster and box are nearest to each other
        shift = _FULL_TURN * round((0.5 * (box[0] + box[2]) - 0.5 * (west + east)) / _FULL_TURN)
        top = max(0, math.floor((north - box[3]) / high) - 2)
        low = min(rows, math.ceil((north - box[1]) / high) + 2)
        first = math.floor((box[0] - shift - west) / wide) - 2
        last = math.ceil((box[2] - shift - west) / wide) + 2
        if abs(east - west - _FULL_TURN) > 1e-6 * wide:
            first, last = max(0, first), min(columns, last)
        chosen = np.arange(first, max(first, last)) % columns
        return cls(ground.values[top:low][:, chosen], west + shift + first * wide, north - top * high, ground.cell)

    @classmethod
    def along(
        cls,
        ground: Ground,
        route: FloatArray,
        projection: LocalProjection,
        *,
        reach: float = 0.0,
        margin: float = _MARGIN,
    ) -> "Surface":
        """
        Cut a raster to the surroundings of the legs of a route.

        Parameters
        ----------
        ground
            The raster.
        route
            Map units, shape ``(m, 2)``.
        projection
            Projection of the map.
        reach
            Distance from the legs that counts as well, metres.
        margin
            Degrees around the box of legs, reach and two cells.
        """
        starts, ends = (route, route) if len(route) == 1 else (route[:-1], route[1:])
        rim = projection.inverse(starts + np.linspace(0.0, 1.0, 33)[:, None, None] * (ends - starts))
        aside = reach / (LEAST_DEGREE * _shrunk(rim))
        return cls.near(ground, box_of_places(rim, margin + 2.0 * max(ground.cell) + aside))

    @cached_property
    def around(self) -> FloatArray:
        """
        The greatest elevation of each cell and its neighbours, as `Ground.range_over` counts them.

        Infinite where one of them is unknown. Shape ``(rows, columns)``, metres.
        """
        known = np.pad(np.where(np.isnan(self.values), np.inf, self.values), 1, constant_values=-np.inf)
        rows, columns = self.values.shape
        return np.asarray(np.max([known[r : r + rows, c : c + columns] for r in range(3) for c in range(3)], axis=0))

    @cached_property
    def _flipped(self) -> "Surface":
        return replace(self, values=-self.values)

    @property
    def bounds(self) -> Bounds:
        """West, south, east, north, degrees; longitudes may go on beyond 180 degrees."""
        rows, columns = self.values.shape
        return self.west, self.north - rows * self.cell[1], self.west + columns * self.cell[0], self.north

    def covers(self, box: Bounds) -> bool:
        """Return whether a box is in the surface, within a rounding."""
        west, south, east, north = self.bounds
        over = max(west - box[0], south - box[1], box[2] - east, box[3] - north)
        return over <= 1e-6 * min(self.cell)

    def position(self, lonlat: FloatArray) -> FloatArray:
        """Return places in columns and rows from the north-west corner, shape ``(..., 2)``."""
        middle = self.west + 0.5 * self.values.shape[1] * self.cell[0]
        longitude = lonlat[..., 0] + _FULL_TURN * np.round((middle - lonlat[..., 0]) / _FULL_TURN)
        return np.stack([(longitude - self.west) / self.cell[0], (self.north - lonlat[..., 1]) / self.cell[1]], axis=-1)

    def rounding(self, latitude: FloatArray) -> FloatArray:
        """Return `ROUNDED` in columns and rows, shape ``(..., 2)``; at most a tenth of a cell."""
        wide = ROUNDED / (LEAST_DEGREE * np.maximum(np.cos(np.radians(latitude)), 1e-3) * self.cell[0])
        high = np.full(np.shape(latitude), ROUNDED / (LEAST_DEGREE * self.cell[1]))
        return np.asarray(np.minimum(np.stack([wide, high], axis=-1), 0.1))

    def highest(self, position: FloatArray, rounding: FloatArray, reach: tuple[int, int] = (0, 0)) -> FloatArray:
        """
        Return the greatest elevation around places: of the cells that a rounding may put a place in, the least counts.

        Each of these cells counts all cells whose elevations matter at the place, so the least is on the safe side.

        Parameters
        ----------
        position, rounding
            In columns and rows, shape ``(..., 2)``.
        reach
            Columns and rows on each side that count as well.

        Returns
        -------
        elevation
            Metres above the sea, shape ``(...)``; infinite where unknown.
        """
        rows, columns = self.values.shape
        found = np.full(position.shape[:-1], np.inf)
        if not rows * columns:
            return found
        around = self.around
        if reach != (0, 0):
            from scipy.ndimage import maximum_filter  # noqa: PLC0415 - slow to import, and rarely needed

            around = maximum_filter(around, size=(2 * reach[1] + 1, 2 * reach[0] + 1), mode="nearest")
        for across in (-1.0, 1.0):
            for down in (-1.0, 1.0):
                at = np.floor(position + rounding * (across, down)).astype(np.int64)
                inside = (at >= 0).all(axis=-1) & (at[..., 0] < columns) & (at[..., 1] < rows)
                here = around[np.where(inside, at[..., 1], 0), np.where(inside, at[..., 0], 0)]
                found = np.minimum(found, np.where(inside, here, np.inf))
        return found

    def range_around(self, lonlat: FloatArray, reach: float) -> tuple[FloatArray, FloatArray]:
        """
        Return the least and the greatest elevation around places, as `highest` finds it; infinite where unknown.

        Parameters
        ----------
        lonlat
            Degrees, shape ``(..., 2)``.
        reach
            Distance that counts as well, metres.
        """
        where = self.position(lonlat), self.rounding(lonlat[..., 1]), self.cells(reach, lonlat)
        return -self._flipped.highest(*where), self.highest(*where)

    def cells(self, reach: float, lonlat: FloatArray) -> tuple[int, int]:
        """Return a distance from places, metres, in columns and rows, rounded up."""
        if reach <= 0.0:
            return 0, 0
        wide, high = self.cell
        polar = _shrunk(lonlat, reach / LEAST_DEGREE)
        return math.ceil(reach / (LEAST_DEGREE * polar * wide)), math.ceil(reach / (LEAST_DEGREE * high))

    def between(self, lonlat: FloatArray) -> FloatArray:
        """
        Return elevations linear in both directions between the centres of cells, as autopilots interpolate them.

        Parameters
        ----------
        lonlat
            Degrees, shape ``(..., 2)``.

        Returns
        -------
        elevation
            Metres above the sea, shape ``(...)``; NaN where a cell that counts is unknown, and outside the raster.
        """
        return self.between_at(self.position(lonlat), self.rounding(lonlat[..., 1]))

    def between_at(self, position: FloatArray, rounding: FloatArray) -> FloatArray:
        """Return elevations as `between`, of places in columns and rows."""
        rows, columns = self.values.shape
        if not rows * columns:
            return np.full(position.shape[:-1], np.nan)
        beyond = np.maximum(-position, position - (columns, rows))
        inside: BoolArray = np.asarray((beyond <= rounding).all(axis=-1))
        at = np.where(inside[..., None], position - 0.5, 0.0)
        first = np.floor(at)
        share = at - first
        c0, r0 = (first[..., axis].astype(np.int64) for axis in (0, 1))
        c1, r1 = np.clip(c0 + 1, 0, columns - 1), np.clip(r0 + 1, 0, rows - 1)
        c0, r0 = np.clip(c0, 0, columns - 1), np.clip(r0, 0, rows - 1)
        upper = self.values[r0, c0] * (1.0 - share[..., 0]) + self.values[r0, c1] * share[..., 0]
        lower = self.values[r1, c0] * (1.0 - share[..., 0]) + self.values[r1, c1] * share[..., 0]
        return np.asarray(np.where(inside, upper * (1.0 - share[..., 1]) + lower * share[..., 1], np.nan))


@dataclass(frozen=True, eq=False)
class Pieces:
    """
    Short pieces of legs.

    Attributes
    ----------
    leg
        Number of the leg of each, from 0, in order, shape ``(m,)``.
    shares
        Shares of the leg where it begins and ends, shape ``(m, 2)``.
    lonlat
        Its ends, degrees, shape ``(m, 2, 2)``: end, coordinate.
    """

    leg: IntArray
    shares: FloatArray
    lonlat: FloatArray


def pieces_of(
    starts: FloatArray, ends: FloatArray, projection: LocalProjection, cell: tuple[float, float]
) -> Iterator[Pieces | int]:
    """
    Divide legs into pieces of less than half a cell, straight in degrees; yield the number of a leg that has too many.

    Parameters
    ----------
    starts, ends
        Ends of the legs, map units, shape ``(n, 2)`` each.
    projection
        Projection of the map.
    cell
        Width and height of a cell, degrees.
    """
    counts = _counts(starts, ends, projection, cell)
    first = 0
    while first < len(counts):
        if counts[first] > MOST_PIECES:
            yield first
            first += 1
            continue
        sums = np.cumsum(counts[first:])
        last = first + max(1, int(np.searchsorted(sums, MOST_PIECES, side="right")))
        legs = np.repeat(np.arange(first, last), counts[first:last])
        number = np.arange(len(legs)) - np.repeat(sums[: last - first] - counts[first:last], counts[first:last])
        shares = np.stack([number, number + 1], axis=1) / counts[legs][:, None]
        places = starts[legs][:, None] + shares[..., None] * (ends - starts)[legs][:, None]
        lonlat = projection.inverse(places)
        # (across the antimeridian, longitudes go on)
        lonlat[:, 1, 0] = lonlat[:, 0, 0] + wrapped(lonlat[:, 1, 0] - lonlat[:, 0, 0])
        yield Pieces(legs, shares, lonlat)
        first = last


def _counts(starts: FloatArray, ends: FloatArray, projection: LocalProjection, cell: tuple[float, float]) -> IntArray:
    """Return the number of pieces of each leg."""
    shares = np.linspace(0.0, 1.0, _COARSE)[:, None, None]
    lonlat = projection.inverse(starts + shares * (ends - starts))
    steps = np.abs(np.diff(lonlat, axis=0))
    steps[..., 0] = np.abs(wrapped(steps[..., 0]))
    cells = (steps / cell).max(axis=(0, 2)) * (_COARSE - 1)
    counts = np.ceil(np.maximum(_PER_CELL * cells, np.hypot(*(ends - starts).T) / _LONGEST))
    return np.asarray(np.maximum(counts, 1.0), dtype=np.int64)


def _shrunk(lonlat: FloatArray, more: float = 0.0) -> float:
    """Return a degree of longitude as a part of one of latitude, where it is least, `more` degrees beyond places."""
    return max(math.cos(math.radians(min(89.0, float(np.abs(lonlat[..., 1]).max()) + more))), 0.02)


def box_of_places(lonlat: FloatArray, margin: float) -> Bounds:
    """
    Return a box around places, widened by a margin, degrees; it may go on beyond 180 degrees.

    Examples
    --------
    >>> box_of_places(np.array([[179.5, 0.0], [-179.5, 1.0]]), 0.5)
    (179.0, -0.5, 181.0, 1.5)
    """
    places = lonlat.reshape(-1, 2)
    longitudes = places[0, 0] + wrapped(places[:, 0] - places[0, 0])
    west, east = float(longitudes.min()), float(longitudes.max())
    return west - margin, float(places[:, 1].min()) - margin, east + margin, float(places[:, 1].max()) + margin
