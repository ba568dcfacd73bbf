"""One surface over space and time that bounds the cost of all timed paths to one end: marched, checked and charged."""

import math
from collections import deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import minimum_filter

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph.timed import excess_kernels, march_kernels
from cgla_graph.timed.floor_kernels import node_risks
from cgla_graph.timed.march_kernels import WALL
from cgla_graph.timed.space_time_grid import Block, Grid

#: The first and the last column (exclusive) of each row of each layer, both of shape ``(layers, rows)``.
Runs: TypeAlias = tuple[IntArray, IntArray]
#: Scales that are tried: what is still too steep then is charged for.
SCALES = 1.0 / np.array([1.0, 1.0005, 1.001, 1.002, 1.005, 1.01, 1.02, 1.05, 1.1, 1.2, 1.5, 2.0])
#: Nodes around the kept cells that are marched too.
HALO = 5
#: Steps of a coarser grid around an end where its values are too high.
TIP = 4.0
#: A step of time in the march, as a part of the time that the aircraft takes to the next node.
COURANT = 0.5
#: The costs at the horizon are marched until they change by less than this part of the map on the mean, or so many
#: times the map is crossed.
SETTLED, MOST_CROSSINGS = 1e-6, 4.0


@dataclass(eq=False)
class Surface:
    """
    A surface that falls to an end, on the kept cells of a grid; it bounds nothing before it is checked.

    Attributes
    ----------
    grid
        The grid, in the direction of time in which paths lead to the end.
    block
        The block around the end.
    kept
        The cells that count.
    horizon
        Slope of the values at the last layer, cost per map unit; None: those of a map that stands still from then on.
    coarse
        A surface on a coarser grid that holds the nodes around; None on the first grid.
    values
        Control values, shape ``(layers + 2, rows, columns)``, of the nodes of `stored`.
    factors
        What costs are multiplied by in the march, so that the surface becomes less steep.
    excess, least
        See `excess_kernels.layer_excess`, shape ``(layers, rows, columns)``.
    debts
        What a path may owe from the beginning of each layer on.
    scale, shift
        A path costs at least the scale times the value, less the shift and the debt.
    """

    grid: Grid
    block: Block
    kept: Runs
    horizon: float | None = None
    coarse: "Surface | None" = None
    scale: float = 1.0
    shift: float = 0.0
    values: FloatArray = field(init=False)
    factors: NDArray[np.float32] = field(init=False)
    excess: NDArray[np.float32] = field(init=False)
    least: NDArray[np.float32] = field(init=False)
    debts: NDArray[np.float32] = field(init=False)
    stored: Runs = field(init=False)
    active: Runs = field(init=False)

    def __post_init__(self) -> None:
        """Lay out the arrays."""
        grid = self.grid
        size = (grid.count, *grid.shape)
        # (memory that is not touched takes no room)
        self.values = np.empty((grid.count + 2, *grid.shape))
        self.factors = np.ones((grid.count + 2, *grid.shape), dtype=np.float32)
        self.excess, self.least = np.zeros(size, dtype=np.float32), np.zeros(size, dtype=np.float32)
        self.debts = np.zeros((grid.count + 1, *grid.shape), dtype=np.float32)
        self.active = around_runs(self.kept, HALO, grid.shape)
        self.stored = widened(self.active, 2, grid.shape)

    @property
    def place(self) -> tuple[float, float, float]:
        """Place of the first node and the step."""
        return (*self.grid.origin, self.grid.step)

    def skipped(self, n: int) -> BoolArray:
        """Return the cells of a layer where the spline need not be a bound."""
        closed = self.grid.closed(n)
        return closed | self.block.cells_of(self.grid) if self.block.holds[n] else closed

    def march(self) -> None:
        """March the values from the last layer to the first one."""
        grid, times = self.grid, self.grid.times
        last = grid.count + 1
        risks = [np.zeros(grid.shape), np.zeros(grid.shape)]
        winds = [self._winds(last)]
        current = self._known(last, self._horizon() if self.coarse is None else None)
        self._store(last, current)
        self._risks(last, risks[0])
        for n in range(grid.count, -1, -1):
            begin, end = self.active[0][n], self.active[1][n]
            values = self._values_for(n)
            rates = np.zeros(grid.shape)
            if self.coarse is not None:
                goal = self._prolonged(n)
                rates = (goal - values) / (times[n + 1] - times[n])
                rates[~(np.abs(rates) < WALL * 1e-6)] = 0.0
            self._risks(n, risks[1])
            winds = [winds[-1], self._winds(n)]
            self._advance(n, values, rates, risks, winds, (begin, end))
            self._store(n, values)
            risks.reverse()

    def _advance(
        self,
        n: int,
        values: FloatArray,
        rates: FloatArray,
        risks: list[FloatArray],
        winds: list[FloatArray],
        runs: Runs,
    ) -> None:
        grid, block = self.grid, self.block
        duration = float(grid.times[n + 1] - grid.times[n])
        cells = block.cells if block.holds[self._layer(n)] else (0, 0, -1)
        turns = max(1, math.ceil(duration * grid.fast / (COURANT * grid.step)))
        factors = self.factors[n + 1], self.factors[n]
        prices = block.prices[[n + 1, n]]
        march_kernels.advance(
            values, rates, (risks[0], risks[1]), factors, (winds[0], winds[1]), runs, self._walls(n), cells,
            block.off, prices, grid.step, duration, turns, grid.flow,
        )  # fmt: skip

    def _walls(self, n: int) -> BoolArray:
        """Return the nodes that no spline of a cell has that is checked."""
        still = self.grid.still
        layers = [still[m] for m in range(max(n - 2, 0), min(n + 1, self.grid.count))]
        closed = layers[0].closed
        if any(each is not layers[0] for each in layers):
            closed = np.logical_and.reduce([each.closed for each in layers])
        return np.asarray(minimum_filter(closed, 3, mode="nearest"))

    def _risks(self, n: int, out: FloatArray) -> None:
        grid, layer = self.grid, self._layer(n)
        node_risks(*grid.origin, grid.step, *self._met(n), grid.threats[layer], grid.still[layer].risk, out)
        out *= grid.k

    def _winds(self, n: int) -> FloatArray:
        return self.grid.winds(self._layer(n), *self._met(n))

    def _layer(self, n: int) -> int:
        """Return the layer whose control values are those of number `n`; the nearest one for the first and last."""
        return min(max(n - 1, 0), self.grid.count - 1)

    def _met(self, n: int) -> Runs:
        """Return the nodes that are marched to a layer, and from it to the one before it."""
        before = max(n - 1, 0)
        return joined((self.active[0][n], self.active[1][n]), (self.active[0][before], self.active[1][before]))

    def _horizon(self) -> FloatArray:
        """Return the values at the last layer: a steep cone, or the costs on a map that stands still."""
        grid, block = self.grid, self.block
        away = grid.places - block.end
        far = np.hypot(*away.T).reshape(grid.shape)
        if self.horizon is not None:
            rim = math.sqrt(2.0) * (block.cells[2] + 1) * grid.step
            gentle = float(block.prices[-1, 0] / grid.flow[0] + block.prices[-1, 1])
            return np.asarray(gentle * far + self.horizon * np.maximum(far - rim, 0.0))
        values = np.full(grid.shape, WALL)
        cone = block.prices[-1] * np.array([1, 1, 0, 0, 0, 1, 1, 1])
        everywhere = (*block.cells[:2], max(grid.shape))
        march_kernels.around_end(values, everywhere, block.off, grid.step, cone)
        return self._settled(np.where(values < WALL, values, far))

    def _settled(self, values: FloatArray) -> FloatArray:
        """March the values of the last layer on a map that stands still until they change no more."""
        grid = self.grid
        n = grid.count + 1
        risks = [np.zeros(grid.shape), np.zeros(grid.shape)]
        self._risks(n, risks[0])
        risks[1][:] = risks[0]
        winds = 2 * [self._winds(n)]
        runs = self.active[0][n - 1], self.active[1][n - 1]
        size = math.hypot(*grid.shape) * grid.step
        for _ in range(math.ceil(MOST_CROSSINGS * size / grid.slow / float(grid.times[-1] - grid.times[-2]))):
            before = values.copy()
            self._advance(n - 1, values, np.zeros(grid.shape), risks, winds, runs)
            # (a node or two may go to and fro for ever)
            if np.abs(values - before)[values < 0.5 * WALL].sum() < SETTLED * size * values.size:
                break
        return values

    def _values_for(self, n: int) -> FloatArray:
        """Return the values one layer later, of all nodes that the march to a layer needs."""
        later = self.values[n + 1]
        begin, end = self.stored[0][n], self.stored[1][n]
        known_begin, known_end = self.stored[0][n + 1], self.stored[1][n + 1]
        values = np.full(self.grid.shape, WALL)
        if self.coarse is not None and ((begin < known_begin) | (end > known_end)).any():
            self._prolong(float(self.grid.times[n + 1]), begin, end, values)
            # (where the coarser grid ends)
            values = np.where(values < WALL, values, self._prolonged(n))
        copy_runs(later, known_begin, known_end, values)
        return values

    def _prolonged(self, n: int) -> FloatArray:
        values = np.full(self.grid.shape, WALL)
        self._prolong(float(self.grid.times[n]), self.stored[0][n], self.stored[1][n], values)
        return values

    def _prolong(self, time: float, begin: IntArray, end: IntArray, out: FloatArray) -> None:
        coarse = self.coarse
        if coarse is not None:
            excess_kernels.prolong(
                coarse.values, *coarse.stored, coarse.grid.times, coarse.place, time, self.place, begin, end, out
            )

    def _known(self, n: int, given: FloatArray | None) -> FloatArray:
        """Return the values of the last layer; those of a coarser grid have no tip at the end, which is added."""
        if given is not None or self.coarse is None:
            return self._prolonged(n) if given is None else given
        values, block = self._prolonged(n), self.block
        column, row, reach = block.cells
        by = min(reach + math.ceil(TIP * self.coarse.grid.step / self.grid.step), column, row)
        around = slice(row - by, row + by + 1), slice(column - by, column + by + 1)
        tip = np.full(self.grid.shape, WALL)
        if row + by < self.grid.shape[0] and column + by < self.grid.shape[1]:
            march_kernels.around_end(tip, (column, row, by), block.off, self.grid.step, block.prices[-1])
        values[around] = np.minimum(values, tip)[around]
        return values if self.horizon is not None else self._settled(values)

    def _store(self, n: int, values: FloatArray) -> None:
        copy_runs(values, self.stored[0][n], self.stored[1][n], self.values[n])

    def layers(self, n: int) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the control values of a layer, and of those before and after it."""
        return self.values[n], self.values[n + 1], self.values[n + 2]

    def lasting(self, n: int) -> tuple[float, float, float]:
        """Return how long a layer is, and those before and after it."""
        before, here, after = self.grid.durations[n : n + 3].tolist()
        return before, here, after

    def check(self) -> None:
        """Bound by how much the surface is too steep on each kept cell."""
        grid = self.grid
        for n in range(grid.count):
            runs = self.kept[0][n], self.kept[1][n]
            excess_kernels.layer_excess(
                self.layers(n), self.lasting(n), *runs, self.skipped(n), grid.origin, grid.step, grid.k,
                grid.threats[n], grid.still[n].floors, grid.winds(n, *runs), grid.flow, self.excess[n], self.least[n],
            )  # fmt: skip

    def soften(self) -> None:
        """Lower the costs of the nodes around cells that are too steep."""
        grid = self.grid
        found: deque[FloatArray] = deque(maxlen=3)
        burdened = grid.windy and not grid.flow[3]
        for n in range(grid.count + 2):
            steep = np.ones(grid.shape)
            if n < grid.count:
                runs = self.kept[0][n], self.kept[1][n]
                least = self.least[n]
                if burdened:
                    # (the least cost leaves out the risk, which counts as a gradient)
                    risk = np.zeros(grid.shape)
                    self._risks(n + 1, risk)
                    least = (least + grid.flow[0] * risk).astype(np.float32)
                excess_kernels.steepness(self.excess[n], least, *runs, steep)
            found.append(steep)
            # the control values of layer n are those of the cells of the layers n - 2 to n
            self.factors[n] /= np.maximum.reduce(list(found))

    def rim(self) -> float:
        """Bound by how much the surface exceeds the cost to the end on the rim of its block."""
        grid, block, worst = self.grid, self.block, -math.inf
        for n in np.nonzero(block.holds)[0].tolist():
            first = n > 0 and not block.holds[n - 1]
            worst = max(
                worst,
                excess_kernels.rim_excess(
                    self.layers(n), self.lasting(n), block.cells, block.off, grid.step,
                    block.prices[n + 1], float(block.most[n]), block.early if first else math.inf,
                    grid.closed(n), self.kept[0][n], self.kept[1][n],
                ),
            )  # fmt: skip
        return worst

    def charge(self, place: Point, layers: range) -> float:
        """
        Choose the scale, and charge for what is too steep then; return the bound of the cost from a place.

        It holds for all paths that are there at a time of the given layers, where the place is kept; infinite if it is
        nowhere, and minus infinity inside of the block, where the surface bounds nothing.
        """
        grid, rim = self.grid, self.rim()
        column, row = grid.cell_of(place)
        found = np.full(len(SCALES), math.inf)
        for n, debts in self._owed(SCALES):
            if n in layers and self.kept[0][n, row] <= column < self.kept[1][n, row]:
                low = self._least_at(n, place)
                found = np.minimum(found, SCALES * low - debts[:, row, column])
        found -= SCALES * max(rim, -1e300)
        best = int(np.argmax(np.nan_to_num(found, nan=-math.inf, posinf=math.inf)))
        self.scale, self.shift = float(SCALES[best]), float(SCALES[best]) * rim
        for n, debts in self._owed(SCALES[best : best + 1]):
            self.debts[n] = debts[0] * (1.0 + 2.0**-22)
        inside = self.block.cells_of(grid)[row, column] and self.block.holds[layers.start : layers.stop].any()
        return -math.inf if inside else float(found[best])

    def _owed(self, scales: FloatArray) -> Iterator[tuple[int, FloatArray]]:
        """Yield what paths may owe from each layer on, from the last one, shape ``(scales, rows, columns)``."""
        grid = self.grid
        debts = np.zeros((len(scales), *grid.shape))
        for n in range(grid.count - 1, -1, -1):
            lasts = float(grid.durations[n + 1])
            reach = math.floor(grid.fast * lasts / grid.step * (1.0 + 1e-9)) + 1
            runs = self.kept[0][n], self.kept[1][n]
            excess_kernels.charge(self.excess[n], self.least[n], *runs, reach, lasts, scales, debts)
            yield n, debts

    def _least_at(self, n: int, place: Point) -> float:
        """Bound the spline from below at a place, at all times of a layer."""
        grid = self.grid
        column, row = grid.cell_of(place)
        shares = []
        for axis, middle in enumerate((column, row)):
            u = (place[axis] - grid.origin[axis]) / grid.step - middle
            shares.append(np.array([0.5 * (0.5 - u) ** 2, 0.75 - u * u, 0.5 * (0.5 + u) ** 2]))
        around = self.values[n : n + 3, row - 1 : row + 2, column - 1 : column + 2]
        first, middle_value, last = np.einsum("tji,j,i->t", around, shares[1], shares[0])
        before, here, after = self.lasting(n)
        early, late = here / (before + here), here / (here + after)
        low = min(early * first + (1.0 - early) * middle_value, middle_value, (1.0 - late) * middle_value + late * last)
        return float(low - 2.0**-44 * np.abs(around).max())

    def least_values(self, n: int) -> FloatArray:
        """Bound the spline from below on the kept cells of a layer."""
        least = np.full(self.grid.shape, math.inf)
        excess_kernels.least_of_layer(self.layers(n), self.lasting(n), self.kept[0][n], self.kept[1][n], least)
        return least


def copy_runs(given: FloatArray, begin: IntArray, end: IntArray, out: FloatArray) -> None:
    """Copy the columns of each row from `begin` to `end`."""
    columns = np.arange(given.shape[1])
    inside = (columns >= begin[:, None]) & (columns < end[:, None])
    out[inside] = given[inside]


def widened(runs: Runs, by: int, shape: tuple[int, int]) -> Runs:
    """Widen runs of each layer along rows and columns, within the grid."""
    columns = shape[1]
    begin, end = (np.asarray(each) for each in runs)
    empty = begin >= end
    low, high = np.where(empty, columns, begin - by), np.where(empty, 0, end + by)
    lows, highs = low.copy(), high.copy()
    for off in range(1, by + 1):
        for one, other in ((slice(off, None), slice(None, -off)), (slice(None, -off), slice(off, None))):
            lows[:, one] = np.minimum(lows[:, one], low[:, other])
            highs[:, one] = np.maximum(highs[:, one], high[:, other])
    lows, highs = np.maximum(lows, 0), np.minimum(highs, columns)
    return np.where(lows < highs, lows, 0), np.where(lows < highs, highs, 0)


def joined(one: Runs, other: Runs) -> Runs:
    """Return the least runs that hold both, in the same rows."""
    first, second = one[0] >= one[1], other[0] >= other[1]
    begin = np.where(first, other[0], np.where(second, one[0], np.minimum(one[0], other[0])))
    return begin, np.where(first, other[1], np.where(second, one[1], np.maximum(one[1], other[1])))


def around_runs(kept: Runs, by: int, shape: tuple[int, int]) -> Runs:
    """Return the nodes that are marched: around the cells of the layer, and of the layers before and after it."""
    begin, end = (np.pad(np.asarray(each), ((1, 1), (0, 0))) for each in kept)
    joint = begin, end
    for shift in (-1, 1):
        moved = np.roll(begin, shift, axis=0), np.roll(end, shift, axis=0)
        joint = joined(joint, moved)
    low, high = widened(joint, by, shape)
    # (two nodes beside each are needed for its derivatives)
    low, high = np.maximum(low, 2), np.minimum(high, shape[1] - 2)
    low[:, :2], high[:, :2], low[:, -2:], high[:, -2:] = 0, 0, 0, 0
    return np.where(low < high, low, 0), np.where(low < high, high, 0)
