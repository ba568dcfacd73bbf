"""One surface over space and time that bounds the cost of all timed paths to one end: marched, checked and charged."""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.timed import excess_kernels, march_kernels
from cgla_graph.timed.floor_kernels import node_risks, node_tolls
from cgla_graph.timed.frames import Frame, Runs, around_runs, in_layer, joined, widened
from cgla_graph.timed.march_kernels import STEEPEST, WALL, SmallArray
from cgla_graph.timed.space_time_grid import Block, Grid

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
#: Times that values are smoothed, at most.
SMOOTHEST = 4


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
    cells, nodes
        The frame of each layer around the kept cells, and that of each layer of control values, one more at both ends.
    values
        Control values in the frames of `nodes`; NaN where they are not known.
    factors
        There, what costs are multiplied by in the march, so that the surface becomes less steep.
    excess, least
        See `excess_kernels.layer_excess`, in the frames of `cells`.
    debts
        There, what a path may owe from the beginning of each layer on.
    smoothed
        How many times the values are smoothed after a march.
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
    smoothed: int = 0
    cells: list[Frame] = field(init=False)
    nodes: list[Frame] = field(init=False)
    values: list[FloatArray] = field(init=False)
    factors: list[SmallArray] = field(init=False)
    excess: list[SmallArray] = field(init=False, default_factory=list)
    least: list[SmallArray] = field(init=False, default_factory=list)
    debts: list[SmallArray] = field(init=False, default_factory=list)
    stored: Runs = field(init=False)
    active: Runs = field(init=False)

    def __post_init__(self) -> None:
        """Lay out the arrays."""
        shape = self.grid.shape
        self.active = around_runs(self.kept, HALO, shape)
        self.stored = widened(self.active, 2, shape)
        self.cells = [Frame.around(runs, 1, shape) for runs in zip(*self.kept, strict=True)]
        self.nodes = [Frame.around(runs, 0, shape) for runs in zip(*self.stored, strict=True)]
        self.values = [np.full(frame.size, math.nan) for frame in self.nodes]
        self.factors = [np.ones(frame.size, dtype=np.float32) for frame in self.nodes]

    def march(self) -> None:
        """March the values from the last layer to the first one, and smooth them."""
        grid, times = self.grid, self.grid.times
        last = grid.count + 1
        later = self._weather(last)
        self._store(last, self._horizon(later) if self.coarse is None else self._known(last, later), later)
        for n in range(grid.count, -1, -1):
            values, frame, here = self._values_for(n), self.nodes[n], self._weather(n)
            rates = np.zeros(frame.size)
            if self.coarse is not None:
                rates = (self._prolonged(n, times[n]) - values) / (times[n + 1] - times[n])
                rates[~(np.abs(rates) < WALL * 1e-6)] = 0.0
            self._advance(n, n, values, rates, (later, here))
            self._store(n, values, here)
            later = here
        for _ in range(self.smoothed):
            self.smooth()

    def _advance(self, n: int, on: int, values: FloatArray, rates: FloatArray, met: "tuple[Weather, Weather]") -> None:
        """March to layer `n` of the control values from the one after it, on the nodes of layer `on`."""
        grid, block, frame = self.grid, self.block, self.nodes[on]
        duration = float(grid.times[n + 1] - grid.times[n])
        cells = block.within(frame) if block.holds[self._layer(n)] else (0, 0, -1)
        turns = max(1, math.ceil(duration * grid.fast / (COURANT * grid.step)))
        later, here = (each.cut(frame) for each in met)
        factors = [frame.cut(self.factors[m], self.nodes[m], fill=1.0) for m in (n + 1, n)]
        runs = frame.runs(in_layer(self.active, on))
        march_kernels.advance(
            values, rates, (later.risks, here.risks), (factors[0], factors[1]), (later.winds, here.winds), runs,
            frame.of(grid.walls(n)), cells, block.off, block.prices[[n + 1, n]], grid.step, duration, turns, grid.flow,
        )  # fmt: skip

    def _weather(self, n: int) -> "Weather":
        """Return risk and wind at the nodes that are marched to a layer, and from it to the one before it."""
        before = max(n - 1, 0)
        runs = joined(in_layer(self.active, n), in_layer(self.active, before))
        frame, layer = self.nodes[n].joined(self.nodes[before]), self._layer(n)
        return Weather(frame, self._risks(layer, frame, runs), self.grid.winds(layer, frame, frame.runs(runs)))

    def _risks(self, layer: int, frame: Frame, runs: Runs) -> FloatArray:
        """Return the risk at the nodes of runs in the middle of a layer, times its weight, with tolls as such risk."""
        grid, out = self.grid, np.zeros(frame.size)
        still = frame.of(grid.still[layer].risk)
        node_risks(*grid.place(frame), *frame.runs(runs), grid.threats[layer], still, out)
        out *= grid.k
        if grid.tolls.any():
            unit = 1.0 if grid.flow[3] else 1.0 / grid.flow[0]
            node_tolls(*grid.place(frame), *frame.runs(runs), grid.tolls[layer], unit, out)
        return out

    def _layer(self, n: int) -> int:
        """Return the layer whose control values are those of number `n`; the nearest one for the first and last."""
        return min(max(n - 1, 0), self.grid.count - 1)

    def _horizon(self, weather: "Weather") -> FloatArray:
        """Return the values at the last layer: a steep cone, or the costs on a map that stands still."""
        grid, block, frame = self.grid, self.block, self.nodes[-1]
        far = np.hypot(*(grid.places(frame) - block.end).T).reshape(frame.size)
        if self.horizon is not None:
            rim = math.sqrt(2.0) * (block.cells[2] + 1) * grid.step
            gentle = float(block.prices[-1, 0] / grid.flow[0] + block.prices[-1, 1])
            return np.asarray(gentle * far + self.horizon * np.maximum(far - rim, 0.0))
        values = self._cone(max(grid.shape))
        return self._settled(np.where(values < WALL, values, far), weather)

    def _cone(self, reach: int) -> FloatArray:
        """Return the values of the last layer up to a reach around the end, as steep as they are there."""
        block, values = self.block, np.full(self.nodes[-1].size, WALL)
        around = (*block.within(self.nodes[-1])[:2], reach)
        # (with the bend of the formula, they would fall beyond the block)
        cone = block.prices[-1] * np.array([1, 1, 0, 0, 0, 1, 1, 1])
        march_kernels.around_end(values, around, block.off, self.grid.step, cone)
        return values

    def _settled(self, values: FloatArray, weather: "Weather") -> FloatArray:
        """March the values of the last layer on a map that stands still until they change no more."""
        grid, last = self.grid, self.grid.count + 1
        size = math.hypot(*grid.shape) * grid.step
        # (a wind stronger than the aircraft leaves places from where costs rise for ever)
        lasts = size / grid.fast if grid.strong else MOST_CROSSINGS * size / grid.slow
        for _ in range(math.ceil(lasts / float(grid.times[-1] - grid.times[-2]))):
            before = values.copy()
            self._advance(last - 1, last, values, np.zeros(values.shape), (weather, weather))
            # (a node or two may go to and fro for ever)
            if np.abs(values - before)[values < 0.5 * WALL].sum() < SETTLED * size * values.size:
                break
        return values

    def _values_for(self, n: int) -> FloatArray:
        """Return the values one layer later, of all nodes that the march to a layer needs."""
        values = self.values_on(n + 1, self.nodes[n])
        needed = self.nodes[n].inside(in_layer(self.stored, n))
        for time in () if self.coarse is None else self.grid.times[[n + 1, n]]:
            # (where the coarser grid ends at the one time, it may not at the other)
            unknown = needed & np.isnan(values)
            if unknown.any():
                more = self._prolonged(n, float(time))
                values[unknown] = np.where(more < WALL, more, math.nan)[unknown]
        return np.where(np.isnan(values) | self.nodes[n].of(self.grid.outside), WALL, values)

    def _prolonged(self, n: int, time: float) -> FloatArray:
        """Return the values of the coarser surface at a time, on the nodes of a layer."""
        coarse, frame = self.coarse, self.nodes[n]
        values = np.full(frame.size, WALL)
        if coarse is not None:
            times = coarse.grid.times
            m = min(max(int(np.searchsorted(times, time)) - 1, 0), len(times) - 2)
            late = min(max((time - times[m]) / (times[m + 1] - times[m]), 0.0), 1.0)
            both = coarse.nodes[m].joined(coarse.nodes[m + 1])
            layers = [coarse.values_on(each, both) for each in (m, m + 1)]
            runs = frame.runs(in_layer(self.stored, n))
            excess_kernels.prolong(
                layers[0], layers[1], late, coarse.grid.place(both), self.grid.place(frame), *runs, values
            )
        return values

    def _known(self, n: int, weather: "Weather") -> FloatArray:
        """Return the values of the last layer; those of a coarser grid have no tip at the end, which is added."""
        values = self._prolonged(n, float(self.grid.times[n]))
        if self.coarse is not None:
            reach = self.block.cells[2] + math.ceil(TIP * self.coarse.grid.step / self.grid.step)
            values = np.minimum(values, self._cone(reach))
        return values if self.horizon is not None else self._settled(values, weather)

    def _store(self, n: int, values: FloatArray, weather: "Weather") -> None:
        frame = self.nodes[n]
        risks = frame.cut(weather.risks, weather.frame, fill=0.0)
        mirrored = self.grid.mirrored(values, frame, float(self.grid.times[n]), risks)
        known = frame.inside(in_layer(self.stored, n))
        self.values[n] = np.where(known, mirrored, math.nan)

    def smooth(self) -> None:
        """
        Average the values with their neighbours in time and place.

        What is lost is convex in the slopes. Where it is small on both sides of a kink, it is small for averages of
        their slopes, if those along all axes are averaged alike; the wider the average, the more they are.
        """
        found = []
        for n, frame in enumerate(self.nodes):
            values = self.values[n].copy()
            if 0 < n < len(self.nodes) - 1:
                before, after = (self.values_on(m, frame) for m in (n - 1, n + 1))
                values = _averaged(before, values, after)
            values[1:-1] = _averaged(values[:-2], values[1:-1], values[2:])
            values[:, 1:-1] = _averaged(values[:, :-2], values[:, 1:-1], values[:, 2:])
            found.append(values)
        self.values = found

    def layers(self, n: int, frame: Frame) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Return the control values of a layer in a frame, and of those before and after it."""
        before, here, after = (self.values_on(m, frame) for m in (n, n + 1, n + 2))
        return before, here, after

    def values_on(self, n: int, frame: Frame) -> FloatArray:
        """Return the values of a layer of control values in a frame; NaN where they are not known."""
        return frame.cut(self.values[n], self.nodes[n], fill=math.nan)

    def lasting(self, n: int) -> tuple[float, float, float]:
        """Return how long a layer is, and those before and after it."""
        before, here, after = self.grid.durations[n : n + 3].tolist()
        return before, here, after

    def runs(self, n: int) -> Runs:
        """Return the kept cells of a layer in its frame."""
        return self.cells[n].runs(in_layer(self.kept, n))

    def in_block(self, n: int) -> BoolArray:
        """Mark the cells of the block in a layer, in its frame."""
        marked = self.block.marked(self.cells[n])
        return marked if self.block.holds[n] else np.zeros_like(marked)

    def check(self) -> None:
        """Bound by how much the surface is too steep on each kept cell."""
        grid = self.grid
        self.excess, self.least = ([np.zeros(frame.size, dtype=np.float32) for frame in self.cells] for _ in range(2))
        for n, frame in enumerate(self.cells):
            runs, floors = self.runs(n), grid.still[n].floors
            # where the spline need not be a bound
            skipped = grid.closed(n, frame) | self.in_block(n)
            excess_kernels.layer_excess(
                self.layers(n, frame), self.lasting(n), *runs, skipped, grid.bounds, grid.place(frame), grid.k,
                grid.threats[n], grid.tolls[n], frame.of(floors) if len(floors) else floors,
                grid.winds(n, frame, runs), grid.flow,
                self.excess[n], self.least[n],
            )  # fmt: skip

    def soften(self) -> None:
        """Lower the costs of the nodes around cells that are too steep."""
        grid = self.grid
        burdened = grid.windy and not grid.flow[3]
        found = []
        for n, frame in enumerate(self.cells):
            least = self.least[n]
            if burdened:
                # (the least cost leaves out the risk, which counts as a gradient)
                risks = self._risks(n, frame, in_layer(self.kept, n))
                least = (least + grid.flow[0] * risks).astype(np.float32)
            steep = np.ones(frame.size, dtype=np.float32)
            excess_kernels.steepness(self.excess[n], least, *self.runs(n), steep)
            found.append(steep)
        for n, frame in enumerate(self.nodes):
            steepest = [frame.cut(found[m], self.cells[m], fill=1.0) for m in grid.layers_with(n)]
            self.factors[n] /= np.maximum.reduce(steepest)

    def rim(self) -> float:
        """Bound by how much the surface exceeds the cost to the end on the rim of its block."""
        grid, block, worst = self.grid, self.block, -math.inf
        column, row, reach = block.cells
        frame = Frame(row - reach - 1, column - reach - 1, 2 * reach + 3, 2 * reach + 3)
        for n in np.nonzero(block.holds)[0].tolist():
            first = n > 0 and not block.holds[n - 1]
            worst = max(
                worst,
                excess_kernels.rim_excess(
                    self.layers(n, frame), self.lasting(n), block.within(frame), block.off, grid.step,
                    block.prices[n + 1], float(block.most[n]), block.early if first else math.inf,
                    grid.closed(n, frame), *frame.runs(in_layer(self.kept, n)),
                ),
            )  # fmt: skip
        return worst

    def charge(self, place: Point, layers: range) -> float:
        """
        Choose the scale, and charge for what is too steep then; return the bound of the cost from a place.

        It holds for all paths that are there at a time of the given layers, where the place is kept and open; infinite
        if it is nowhere, and minus infinity inside of the block, where the surface bounds nothing.
        """
        grid, rim = self.grid, self.rim()
        column, row = grid.cell_of(place)
        found = np.full(len(SCALES), math.inf)
        for n, debts in self._owed(SCALES):
            is_kept = n in layers and self.kept[0][n, row] <= column < self.kept[1][n, row]
            if is_kept and not grid.closed(n, Frame(row, column, 1, 1)).item():
                owed = debts[:, row - self.cells[n].row, column - self.cells[n].column]
                found = np.minimum(found, SCALES * self._least_at(n, place) - owed)
        found -= SCALES * max(rim, -1e300)
        best = int(np.argmax(np.nan_to_num(found, nan=-math.inf, posinf=math.inf)))
        self.scale, self.shift = float(SCALES[best]), float(SCALES[best]) * rim
        rounded = [debts[0] * (1.0 + 2.0**-22) for _, debts in self._owed(SCALES[best : best + 1])]
        self.debts = [debts.astype(np.float32) for debts in reversed(rounded)]
        inside = (
            self.block.marked(Frame(row, column, 1, 1)).item() and self.block.holds[layers.start : layers.stop].any()
        )
        return -math.inf if inside else float(found[best])

    def bound(self, place: Point, layers: range) -> float:
        """Check the surface and charge for what is too steep; return the bound of the cost from a place (`charge`)."""
        self.check()
        return self.charge(place, layers)

    def smoothest(self, place: Point, layers: range) -> float:
        """Return the bound of the surface, smoothed as often as that gains something, now and after later marches."""
        bound = self.bound(place, layers)
        while self.smoothed < SMOOTHEST:
            # (arrays are replaced, not changed)
            before = dict(vars(self))
            self.smooth()
            more = self.bound(place, layers)
            if not more > bound:
                vars(self).update(before)
                break
            bound, self.smoothed = more, self.smoothed + 1
        return bound

    def _owed(self, scales: FloatArray) -> Iterator[tuple[int, FloatArray]]:
        """Yield what paths may owe from each layer on, from the last one, shape ``(scales, rows, columns)``."""
        grid = self.grid
        after, nothing = Frame(0, 0, 0, 0), np.zeros(0, dtype=np.int64)
        later, runs = np.zeros((len(scales), 0, 0)), (nothing, nothing)
        for n in range(grid.count - 1, -1, -1):
            frame, lasts = self.cells[n], float(grid.durations[n + 1])
            reach = math.floor(grid.fast * lasts / grid.step * (1.0 + 1e-9)) + 1
            shift, debts = (after.row - frame.row, after.column - frame.column), np.empty((len(scales), *frame.size))
            here = self.runs(n)
            excess_kernels.charge(
                self.excess[n], self.least[n], *here, reach, lasts, scales, later, *runs, shift, debts
            )
            yield n, debts
            after, later, runs = frame, debts, here

    def _least_at(self, n: int, place: Point) -> float:
        """Bound the spline from below at a place, at all times of a layer."""
        grid = self.grid
        column, row = grid.cell_of(place)
        shares = []
        for axis, middle in enumerate((column, row)):
            u = (place[axis] - grid.origin[axis]) / grid.step - middle
            shares.append(np.array([0.5 * (0.5 - u) ** 2, 0.75 - u * u, 0.5 * (0.5 + u) ** 2]))
        around = np.stack(self.layers(n, Frame(row - 1, column - 1, 3, 3)))
        first, middle_value, last = np.einsum("tji,j,i->t", around, shares[1], shares[0])
        before, here, after = self.lasting(n)
        early, late = here / (before + here), here / (here + after)
        low = min(early * first + (1.0 - early) * middle_value, middle_value, (1.0 - late) * middle_value + late * last)
        return float(low - 2.0**-44 * np.abs(around).max())

    def least_values(self, n: int) -> FloatArray:
        """Bound the spline from below on the kept cells of a layer, in its frame."""
        frame = self.cells[n]
        least = np.full(frame.size, math.inf)
        excess_kernels.least_of_layer(self.layers(n, frame), self.lasting(n), *self.runs(n), least)
        return least


class Weather(NamedTuple):
    """Risk, times its weight, and wind (as `march_kernels.fall` takes them) at the nodes of a frame."""

    frame: Frame
    risks: FloatArray
    winds: FloatArray

    def cut(self, frame: Frame) -> "Weather":
        """Return them in another frame."""
        winds = frame.cut(self.winds, self.frame, fill=0.0) if self.winds.size else self.winds
        return Weather(frame, frame.cut(self.risks, self.frame, fill=0.0), winds)


def _averaged(before: FloatArray, here: FloatArray, after: FloatArray) -> FloatArray:
    """Average values with those on both sides, where all three are known and no walls."""
    known = np.maximum(np.maximum(before, after), here) < STEEPEST
    return np.where(known, 0.25 * (before + after) + 0.5 * here, here)
