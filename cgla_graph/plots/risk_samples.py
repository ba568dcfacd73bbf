"""Samples of the risk of a map, for plots and the report, which miss no narrow cell."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cgla_graph._types import FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster import RasterRisk

#: If the greatest risk of a raster is so many times the median of its positive cells, equal steps of colour hide these.
HEAVY = 15.0
#: Exponent of such a risk, relative to the greatest, that gives its colour.
POWER = 1.0 / 3.0


@dataclass(frozen=True, eq=False)
class RiskSamples:
    """
    Samples of the risk over the bounds.

    Attributes
    ----------
    density
        Shape ``(rows, columns)``, row 0 at the least y. For cells finer than a sample, the greatest in the sample.
    low, top
        Least (0 unless it is negative) and greatest risk per unit length, centres of threats included.
    power
        Exponent of a risk relative to `top` that gives its colour: 1, or `POWER` if few cells are far riskier than all
        others.
    """

    density: FloatArray
    low: float
    top: float
    power: float

    @property
    def shades(self) -> FloatArray:
        """Strength of each sample's colour, from 0 to 1, measured from `low`."""
        return np.asarray(((self.density - self.low) / (self.top - self.low)).clip(0.0, 1.0) ** self.power)


def risk_samples(problem: Problem, most: int) -> RiskSamples:
    """
    Sample the risk of a problem.

    Parameters
    ----------
    problem
        The problem whose bounds are sampled.
    most
        Samples along the longer side.

    Examples
    --------
    One cell of a thousand is riskier than all others by far; three samples a side still show it.

    >>> from cgla_graph.model.risk import RiskField
    >>> people = np.ones((30, 30))
    >>> people[17, 4] = 1000.0
    >>> raster = RasterRisk(people, (0, 0, 1, 1), origin="lower", interpolation="nearest")
    >>> samples = risk_samples(Problem((0, 0), (1, 1), RiskField(rasters=[raster])), 3)
    >>> samples.density[:, 0].tolist(), samples.power == POWER
    ([1.0, 1000.0, 1.0], True)
    """
    field, (x_min, y_min, x_max, y_max) = problem.field, problem.bounds
    xs, ys = sample_edges(problem, most)
    x, y = 0.5 * (xs[1:] + xs[:-1]), 0.5 * (ys[1:] + ys[:-1])
    places = np.stack(np.meshgrid(x, y), axis=-1)
    # (one field without rasters, and each raster alone: the greatest cell of one lies on the others' densities)
    density = field.with_rasters(()).density(places) if field.every_threat else np.zeros(1)
    density = np.broadcast_to(density, places.shape[:-1]).copy()
    on_rasters = np.zeros(density.shape)
    for raster in field.rasters:
        on_rasters += np.maximum(raster.density(places), greatest_cells(raster, raster.cells_at, xs, ys))
    density += on_rasters
    centres = [(t.x, t.y) for t in field.every_threat if x_min <= t.x <= x_max and y_min <= t.y <= y_max]
    peaks = field.density(centres) if centres else np.zeros(1)
    low, top = min(0.0, float(density.min())), max(float(density.max()), float(peaks.max()))
    risky = on_rasters[on_rasters > 0.0]
    is_heavy = low == 0.0 and risky.size > 0 and float(risky.max()) > HEAVY * float(np.median(risky))
    return RiskSamples(density, low, top, POWER if is_heavy else 1.0)


def sample_edges(problem: Problem, most: int) -> tuple[FloatArray, FloatArray]:
    """
    Return the x and the y of the edges of samples, about square, `most` along the longer side.

    Examples
    --------
    >>> [len(edges) for edges in sample_edges(Problem((0, 0), (1, 1), bounds=(0, 0, 2, 1)), 8)]
    [9, 5]
    """
    x_min, y_min, x_max, y_max = problem.bounds
    step = max(x_max - x_min, y_max - y_min) / most
    x, y = (
        np.linspace(low, high, max(2, round((high - low) / step)) + 1) for low, high in ((x_min, x_max), (y_min, y_max))
    )
    return x, y


def greatest_cells(
    raster: RasterRisk, cells: Callable[[slice], NDArray[Any]], xs: FloatArray, ys: FloatArray
) -> FloatArray:
    """
    Return the greatest cell in each sample, 0 where there is none.

    A cell belongs to the sample that contains its centre. Where cells are wider than samples, a sample may have none:
    there the density in its middle is enough.

    Parameters
    ----------
    raster
        The raster that gives the places of the cells.
    cells
        The function from rows, row 0 at the least y, to numbers of at least 0, shape ``(rows, columns)``.
    xs, ys
        Edges of the samples, rising.

    Examples
    --------
    >>> raster = RasterRisk([[1, 2, 3, 4]], (0, 0, 4, 1))
    >>> edges = np.array([0.0, 2.0, 4.0, 6.0])
    >>> greatest_cells(raster, raster.cells_at, edges, np.array([0.0, 1.0])).tolist()
    [[2.0, 4.0, 0.0]]
    """
    x_min, y_min, _, _ = raster.bounds
    width, height = raster.cell_size
    rows = _first_cells(ys, y_min, height, raster.shape[0])
    columns = _first_cells(xs, x_min, width, raster.shape[1])
    pairs = np.stack([columns[:-1], columns[1:]], axis=1).ravel()
    found = np.zeros((len(ys) - 1, len(xs) - 1))
    # (a large raster has no second copy of its cells; one zero more, as `reduceat` needs every end inside the array)
    for row, (first, last) in enumerate(pairwise(rows.tolist())):
        if first < last:
            greatest = np.append(cells(slice(first, last)).max(axis=0), 0.0)
            found[row] = np.maximum.reduceat(greatest, pairs)[::2]
    found[:, columns[1:] == columns[:-1]] = 0.0
    return found


def _first_cells(edges: FloatArray, low: float, size: float, count: int) -> np.ndarray[tuple[int], np.dtype[np.intp]]:
    """Return the first cell whose centre is at or after each edge."""
    return np.clip(np.ceil((edges - low) / size - 0.5), 0, count).astype(np.intp)
