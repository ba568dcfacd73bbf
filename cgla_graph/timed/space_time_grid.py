"""A grid over a map and a time: layers between events, nodes, cells that paths may enter, and blocks around ends."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from typing import TYPE_CHECKING

import numpy as np
import shapely
from scipy.ndimage import minimum_filter

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster_kernels import Rasters, add_densities, raster_floor
from cgla_graph.timed.floor_kernels import VX, VY, end_formula, least_near, raster_floors
from cgla_graph.timed.frames import Frame, Runs
from cgla_graph.timed.march_kernels import STEEPEST, Flow
from cgla_graph.timed.wind import Wind
from cgla_graph.timed.wind_kernels import wind_within, winds_within

if TYPE_CHECKING:
    from cgla_graph.timed.slabs import Slab
    from cgla_graph.timed.timed_problem import TimedProblem

#: Nodes beyond the bounds on each side, which are walls.
PAD = 4
#: Cells along the longer side are so many, or fewer by this part, if nodes then are nearer to the far border.
FEWER = 0.08
#: Cells from an end to the rim of its block; what a spline close to a tip loses beyond the first, in steps of flight.
REACHES, TIP_LOSS = (1, 2, 4, 8, 16), 0.5
#: Discs around an end on which the risk has a floor, as parts of the distance of the rim.
DISCS = (2.0, 1.5)
#: In wind, at most.
WIDEST = 4.0
#: Areas are made narrower by this part of the map, so that no cell is closed by rounding.
NARROWER = 1e-7
#: A node is a wall if all cells in a square of so many a side around it are closed. Along walls, which are in steps,
#: fronts are irregular: cells at the outline are some way off, and those inside need no bound.
WALLED = 5
#: By how much the polygon of a widened area is wider than the clearance, as a part of it: at most.
ARCS = 3e-3
#: How many times longer than the way from the rim takes, a path may take without paying for its time instead: first,
#: and more until that is enough, so many times.
SLOWER, LONGER, WHILES = 1.5, 1.6, 6


def flow_of(problem: "TimedProblem") -> Flow:
    """Return how it is flown, as kernels take it; of wind that changes, in its mean."""
    price = math.inf if problem.waiting is None else problem.waiting
    fields = problem.field, *(field for _, field in problem.fields)
    is_free = problem.k == 0.0 or not (problem.moving or any(not field.is_empty for field in fields))
    # (without risk, it does not matter how it counts, and by time is quicker)
    return problem.speed, *problem.wind_grid.mean, is_free or problem.risk_per == "time", price


@dataclass(frozen=True, eq=False)
class Still:
    """
    What does not change for a while: rasters on the nodes and cells of a grid, and closed cells.

    Attributes
    ----------
    risk
        Of rasters at the nodes, shape ``(rows, columns)``.
    floors
        Of rasters on the cells, shape ``(rows, columns, 5)``, or ``(0, 0, 5)``.
    closed
        Cells that no path enters: outside the bounds, or inside an area.
    depth
        How far all of a cell is inside the areas, and from both ends, map units: 0 where it is not.
    rasters
        As kernels take them.
    """

    risk: FloatArray
    floors: FloatArray
    closed: BoolArray
    depth: FloatArray
    rasters: Rasters

    @cached_property
    def deepest(self) -> float:
        """The greatest depth."""
        return float(self.depth.max())


@dataclass(frozen=True, eq=False)
class Grid:
    """
    A grid in space and time, in one direction of time.

    Layer ``n`` lasts from ``knots[n]`` to ``knots[n + 1]``; no event is inside of one. Backwards in time, times change
    their sign, and so do velocities and the wind: what leads from the start is then what leads to the goal.

    Attributes
    ----------
    origin, step
        Place of the first node, and the distance of neighbours, map units.
    shape
        Rows and columns of nodes. The cell of a node is the square of one step around it.
    bounds
        Of the map.
    knots
        Shape ``(n + 1,)``.
    threats
        In the middle of each layer, shape ``(n, m, 8)``.
    still
        What stands still in each layer.
    flow
        Speed, wind, kind of risk and price of waiting.
    k
        Risk weight.
    ends
        Where paths come from, not before the first knot, and where they have to be at the last one.
    events
        Times at which something changes, rising.
    wind
        The wind, if it changes; that of `flow` is its mean.
    tolls
        In the middle of each layer, shape ``(n, m, 9)``.
    """

    origin: Point
    step: float
    shape: tuple[int, int]
    bounds: tuple[float, float, float, float]
    knots: FloatArray
    threats: FloatArray
    still: Sequence[Still]
    flow: Flow
    k: float
    ends: tuple[Point, Point]
    events: FloatArray
    wind: Wind | None = None
    tolls: FloatArray = field(default_factory=lambda: np.zeros((0, 0, 9)))

    @classmethod
    def lay(cls, problem: "TimedProblem", until: float, cells: int, ratio: float) -> "Grid":
        """
        Lay a grid of about so many cells along the longer side, and layers that last about `ratio` cells of flight.

        There are nodes on the border, as the best paths may lead along it.

        Examples
        --------
        >>> from cgla_graph.timed.timed_problem import TimedProblem
        >>> grid = Grid.lay(TimedProblem((0.1, 0.1), (0.9, 0.9), speed=2.0), 1.0, cells=20, ratio=1.0)
        >>> grid.shape, len(grid.knots)
        ((29, 29), 41)
        """
        x_min, y_min, x_max, y_max = problem.bounds
        sides = x_max - x_min, y_max - y_min
        share = min(sides) / max(sides)
        fewer = range(cells, math.floor((1.0 - FEWER) * cells), -1)
        step = max(sides) / min(fewer, key=lambda count: round(abs(count * share - round(count * share)), 2))
        columns, rows = (round(side / step) + 1 + 2 * PAD for side in sides)
        origin = x_min - PAD * step, y_min - PAD * step
        slabs = problem.slabs(until)
        knots, layers = _layers(slabs, ratio * step / problem.speed)
        shape = rows, columns
        ends, events = (problem.start, problem.goal), np.array([slab.begins for slab in slabs[1:]])
        made = cls(
            origin,
            step,
            shape,
            problem.bounds,
            knots,
            np.empty((0, 0, 8)),
            (),
            flow_of(problem),
            problem.k,
            ends,
            events,
            problem.wind_grid if problem.constant_wind is None else None,
        )
        kept: dict[tuple[int, int], Still] = {}
        still = []
        for slab in slabs:
            key = id(slab.field), id(slab.no_fly)
            if key not in kept:
                kept[key] = made._still(slab)
            still.append(kept[key])
        most = max(len(slab.threats) + len(slab.field.threats) for slab in slabs)
        threats = np.zeros((len(layers), most, 8))
        threats[:, :, 4] = 1.0
        tolls = np.zeros((len(layers), len(problem.tolls), 9))
        for n, number in enumerate(layers):
            slab = slabs[number]
            standing = [(one.x, one.y, 0.0, 0.0, one.spread, 0.0, one.peak, 0.0) for one in slab.field.threats]
            now = np.vstack([slab.threats_at(float(made.middles[n])), np.array(standing).reshape(-1, 8)])
            threats[n, : len(now)] = now
            tolls[n] = slab.tolls_at(float(made.middles[n]))
        return replace(made, threats=threats, tolls=tolls, still=[still[n] for n in layers])

    def _still(self, slab: "Slab") -> Still:
        """Lay out what stands still in a slab."""
        risk, floors = np.zeros(self.shape), np.zeros((0, 0, 5))
        field: RiskField = slab.field
        if field.raster_array is not None:
            places = np.clip(self.places(self.whole), *np.reshape(self.bounds, (2, 2)))
            found = np.zeros(len(places))
            add_densities(places, field.raster_array, found)
            risk, floors = found.reshape(self.shape), np.zeros((*self.shape, 5))
            raster_floors(*self.origin, self.step, self.bounds, field.raster_array, floors)
        return Still(risk, floors, *self._inside(slab), field.raster_array)

    def _inside(self, slab: "Slab") -> tuple[BoolArray, FloatArray]:
        """Return the closed cells, and how deep cells are inside of areas."""
        x, y = self.places(self.whole).T
        half = 0.5 * self.step
        x_min, y_min, x_max, y_max = self.bounds
        closed = (x + half < x_min) | (x - half > x_max) | (y + half < y_min) | (y - half > y_max)
        area, depth = slab.wide_area.geometry, np.zeros(len(x))
        if not area.is_empty:
            # (the arcs of a clearance are polygons around it)
            by = NARROWER * max(x_max - x_min, y_max - y_min) + ARCS * slab.clearance
            narrow = shapely.buffer(area, -by, join_style="mitre")
            shapely.prepare(narrow)
            # (a little wider than a cell, which is closed only if all of it is inside)
            boxes = shapely.box(x - half, y - half, x + half, y + half)
            inside = shapely.contains_properly(narrow, boxes)
            places = np.column_stack([x[inside], y[inside]])
            # (a path may end, or begin, inside of an area that is open for a while)
            far = [np.hypot(*(places - end).T) for end in self.ends]
            least = np.minimum.reduce([shapely.distance(narrow.boundary, shapely.points(places)), *far])
            depth[inside] = np.maximum(least * (1.0 - 1e-9) - math.sqrt(0.5) * self.step, 0.0)
            closed |= inside
        return np.asarray(closed.reshape(self.shape)), depth.reshape(self.shape)

    @property
    def whole(self) -> Frame:
        """The frame of all nodes."""
        return Frame(0, 0, *self.shape)

    def place(self, frame: Frame) -> tuple[float, float, float]:
        """Return the place of the first node of a frame, and the step."""
        return self.origin[0] + frame.column * self.step, self.origin[1] + frame.row * self.step, self.step

    def places(self, frame: Frame) -> FloatArray:
        """Return the places of the nodes of a frame, row by row, shape ``(rows * columns, 2)``."""
        x = self.origin[0] + (frame.column + np.arange(frame.columns)) * self.step
        y = self.origin[1] + (frame.row + np.arange(frame.rows)) * self.step
        return np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)

    @cached_property
    def middles(self) -> FloatArray:
        """Middles of the layers, shape ``(n,)``."""
        return np.asarray(0.5 * (self.knots[1:] + self.knots[:-1]))

    @cached_property
    def times(self) -> FloatArray:
        """Times of the control values: the middles of layers, with one more at both ends, shape ``(n + 2,)``."""
        lasts = np.diff(self.knots)
        return np.concatenate([[self.middles[0] - lasts[0]], self.middles, [self.middles[-1] + lasts[-1]]])

    @cached_property
    def durations(self) -> FloatArray:
        """How long layers last, those at both ends twice, shape ``(n + 2,)``."""
        lasts = np.diff(self.knots)
        return np.concatenate([lasts[:1], lasts, lasts[-1:]])

    @cached_property
    def drift(self) -> float:
        """The greatest speed over the ground, beside the mean wind."""
        return self.flow[0] + (0.0 if self.wind is None else self.wind.gusts)

    @property
    def fast(self) -> float:
        """The greatest speed over the ground."""
        return self.drift + math.hypot(*self.flow[1:3])

    @property
    def slow(self) -> float:
        """Ground speed against the wind; a tenth of the airspeed, where that is more."""
        return max(2.0 * self.flow[0] - self.fast, 0.1 * self.flow[0])

    @property
    def strong(self) -> bool:
        """Whether the air may be faster than the aircraft."""
        return self.fast > 2.0 * self.flow[0]

    @property
    def windy(self) -> bool:
        """Whether the air moves."""
        return self.wind is not None or self.flow[1:3] != (0.0, 0.0)

    def winds(self, n: int, frame: Frame, runs: Runs) -> FloatArray:
        """Return the wind on the cells of a layer in a frame, as `march_kernels.fall` takes it."""
        if self.wind is None:
            return np.zeros((0, 0, 9))
        if len(self.wind.times) == 1:
            return frame.of(self._steady_winds)
        out = np.zeros((*frame.size, 9))
        winds_within(*runs, self.place(frame), (float(self.knots[n]), float(self.knots[n + 1])), self.wind.arrays, out)
        return out

    @cached_property
    def _steady_winds(self) -> FloatArray:
        """The wind on all cells, if it is the same at all times."""
        out, rows = np.zeros((*self.shape, 9)), np.zeros(self.shape[0], dtype=np.int64)
        if self.wind is not None:
            winds_within(rows, rows + self.shape[1], self.place(self.whole), (0.0, 1.0), self.wind.arrays, out)
        return out

    @property
    def count(self) -> int:
        """How many layers there are."""
        return len(self.knots) - 1

    def reversed(self) -> "Grid":
        """Return the grid backwards in time."""
        threats, tolls = self.threats[::-1].copy(), self.tolls[::-1].copy()
        threats[:, :, [2, 3, 5, 7]] *= -1.0
        tolls[:, :, [2, 3, 8]] *= -1.0
        v, wx, wy, per_time, price = self.flow
        flow = v, -wx, -wy, per_time, price
        wind = None if self.wind is None else self.wind.reversed
        return replace(
            self,
            knots=-self.knots[::-1],
            threats=threats,
            tolls=tolls,
            still=tuple(reversed(self.still)),
            flow=flow,
            ends=(self.ends[1], self.ends[0]),
            events=-self.events[::-1],
            wind=wind,
        )

    def cell_of(self, place: Point) -> tuple[int, int]:
        """Return column and row of the cell around a place."""
        column, row = (round((place[axis] - self.origin[axis]) / self.step) for axis in range(2))
        return column, row

    def closed(self, n: int, frame: Frame) -> BoolArray:
        """Return the cells of a layer in a frame that no path enters on its way between the ends."""
        if (n, frame) not in self._closed_in:
            since, left = float(self.knots[n + 1] - self.knots[0]), float(self.knots[-1] - self.knots[n])
            early = self._out_of_reach(self.ends[0], since, 1.0, frame)
            late = self._out_of_reach(self.ends[1], left, -1.0, frame)
            self._closed_in[n, frame] = frame.of(self.still[n].closed | self.caught(n)) | early | late
        return self._closed_in[n, frame]

    def caught(self, n: int) -> BoolArray:
        """
        Mark the cells of a layer so deep in an area that will close, or was closed, that no path gets out or in.

        The time is too short: to get out before it closes, or in since it has opened.
        """
        found = np.zeros(self.shape, dtype=np.bool_)
        for first, after, still in self._standing:
            lasts = float(max(self.knots[first] - self.knots[n], self.knots[n + 1] - self.knots[after]))
            far = self.fast * lasts * (1.0 + 1e-9)
            if still is not self.still[n] and far < still.deepest:
                found |= still.depth > far
        return found

    @cached_property
    def _standing(self) -> list[tuple[int, int, Still]]:
        """What stands still, with its first layer and the one after its last."""
        firsts = [n for n in range(self.count) if n == 0 or self.still[n] is not self.still[n - 1]]
        return [(n, after, self.still[n]) for n, after in pairwise([*firsts, self.count])]

    @cached_property
    def _closed_in(self) -> dict[tuple[int, Frame], BoolArray]:
        """The closed cells that were asked for."""
        return {}

    def _out_of_reach(self, end: Point, lasts: float, sign: float, frame: Frame) -> BoolArray:
        """
        Return the cells from which no path comes from (1), or leads to (-1), an end within a time, in a frame.

        A wind that is stronger than the aircraft leaves out no cell.
        """
        _, wx, wy, _, _ = self.flow
        v = self.drift
        if math.hypot(wx, wy) > v or not math.isfinite(lasts):
            return np.zeros(frame.size, dtype=np.bool_)
        away = self.places(frame) - end - sign * lasts * np.array([wx, wy])
        near = np.hypot(*away.T) - math.sqrt(0.5) * self.step
        return np.asarray(near > v * lasts + 1e-9 * (v * lasts + self.step)).reshape(frame.size)

    def layers_with(self, n: int) -> range:
        """Return the layers whose splines have the control values of number `n`."""
        return range(max(n - 2, 0), min(n + 1, self.count))

    def walls(self, n: int) -> BoolArray:
        """Return the nodes that are walls, of a layer of control values: no spline of an open cell has them."""
        if n not in self._walls_of:
            layers = self.layers_with(n)
            caught = [self.caught(m) for m in layers]
            key = tuple(dict.fromkeys(id(self.still[m]) for m in layers)) if not np.any(caught) else (n,)
            if key not in self._walls_among:
                closed = [self.still[m].closed | more for m, more in zip(layers, caught, strict=True)]
                beside = minimum_filter(np.logical_and.reduce(closed), WALLED, mode="nearest")
                self._walls_among[key] = np.asarray(beside) | self.outside
            self._walls_of[n] = self._walls_among[key]
        return self._walls_of[n]

    @cached_property
    def outside(self) -> BoolArray:
        """The nodes outside the bounds; those at the border count as inside."""
        inside = [(source == np.arange(len(source))) for source in self._mirrors]
        return np.asarray(~(inside[0][:, None] & inside[1]))

    @cached_property
    def _mirrors(self) -> tuple[IntArray, IntArray]:
        """For each row, and each column, the one of which it is the mirror image at the border; itself, if inside."""
        found = []
        for count in self.shape:
            at, last = np.arange(count), count - 1 - PAD
            found.append(np.where(at < PAD, 2 * PAD - at, np.where(at > last, 2 * last - at, at)))
        return found[0], found[1]

    def mirrored(self, values: FloatArray, frame: Frame, time: float, risks: FloatArray) -> FloatArray:
        """
        Return values at a time with those beyond the border set to the ones as far inside of it, tilted in wind.

        Paths along the border stay inside. There, a surface is least steep that falls across it as the nose points,
        into the wind; without wind, it is level. `risks` are those at the nodes, times their weight.
        """
        rows, columns = (
            np.clip(source[begin : begin + count] - begin, 0, count - 1)
            for source, begin, count in zip(self._mirrors, frame[:2], frame.size, strict=True)
        )
        out = np.asarray(values[np.ix_(rows, columns)])
        for axis in range(2) if self.windy else ():
            number = frame[axis] + np.arange(frame.size[axis])
            for border, sign in ((PAD, -1), (self.shape[axis] - 1 - PAD, 1)):
                beyond = sign * (number - border) > 0
                edge = frame._replace(row=border, rows=1) if axis == 0 else frame._replace(column=border, columns=1)
                if not beyond.any() or border not in number or 1 in frame.size:
                    continue
                line, risk = (edge.cut(each, frame, fill=0.0).ravel() for each in (out, risks))
                tilt = self._tilt(line, risk, sign * self._wind_on(edge, time)[:, 1 - axis])
                away = 2.0 * self.step * sign * (number[beyond] - border)
                # (a view)
                np.moveaxis(out, axis, 0)[beyond] += away[:, None] * tilt
        return out

    def _tilt(self, line: FloatArray, risk: FloatArray, wind: FloatArray) -> FloatArray:
        """Return how a surface rises across the border, outwards, from values along it; level at walls."""
        v, _, _, per_time, _ = self.flow
        slope = np.abs(np.gradient(np.where(line < STEEPEST, line, math.nan), self.step))
        slope = np.nan_to_num(slope if per_time else np.maximum(slope - risk, 0.0))
        return np.where(np.abs(wind) < v, slope * wind / np.sqrt(np.maximum(v * v - wind * wind, 0.1 * v * v)), 0.0)

    def _wind_on(self, frame: Frame, time: float) -> FloatArray:
        """Return the wind at the nodes of a frame, row by row, shape ``(rows * columns, 2)``."""
        if self.wind is not None:
            return self.wind.at(self.places(frame), time)
        return np.tile(self.flow[1:3], (frame.rows * frame.columns, 1))

    @cached_property
    def _walls_among(self) -> dict[tuple[int, ...], BoolArray]:
        """The walls among what stands still, and is caught, alike."""
        return {}

    @cached_property
    def _walls_of(self) -> dict[int, BoolArray]:
        """The walls that were asked for, by number of the control values."""
        return {}


@dataclass(frozen=True, eq=False)
class Block:
    """
    The block of cells around an end, inside of which a spline is no bound, and the cost to the end from its rim.

    Attributes
    ----------
    end
        The end.
    cells
        Column and row of its middle, and its reach.
    off
        From the middle to the end, map units.
    prices
        In each layer, a path from the rim costs at least so much (`march_kernels.near_end`), shape ``(n + 2, 8)``;
    most
        or this, if it is less, shape ``(n,)``.
    holds
        The layers where it is there, shape ``(n,)``.
    early
        What a path pays at least that enters at the beginning of the first of them, unless that is the first of all.
    """

    end: Point
    cells: tuple[int, int, int]
    off: Point
    prices: FloatArray
    most: FloatArray
    holds: BoolArray
    early: float = math.inf

    @classmethod
    def around(cls, grid: Grid, end: Point, kept: Runs, since: float = -math.inf) -> "Block":
        """
        Find the block around an end, where paths may be from a time on; it is best for the layers that keep the end.

        Up to twice the distance of the rim, the risk has a floor for a while. A path that stays there and arrives in
        that while pays for it. A path that takes longer pays for the time, and one that leaves the disc for the way
        out, and from its last entry on, the same cost as any other path from there.
        """
        # (a layer more does no harm)
        holds = grid.knots[1:] >= since - 1e-9 * float(grid.durations.min())
        slow = min(grid.flow[0], grid.flow[4])
        first = int(np.argmax(holds))
        early = slow * max(since - float(grid.knots[first]), 0.0) * (1.0 - 1e-9) if first else math.inf
        column, row = grid.cell_of(end)
        other = grid.cell_of(grid.ends[0])
        room = min(column, row, grid.shape[1] - 1 - column, grid.shape[0] - 1 - row) - 2
        room = min(room, max(abs(other[0] - column), abs(other[1] - row)) - 2)
        tried = [cls._within(grid, end, reach, holds, early) for reach in REACHES if reach <= max(room, 1)]
        here = holds & (kept[0][:, row] <= column) & (column < kept[1][:, row])
        met = [n for n in np.nonzero(here)[0].tolist() if not grid.closed(n, Frame(row, column, 1, 1)).item()]
        truth = tried[0].on_rim(grid)[met] / tried[0].rim(grid)

        def lost(block: Block) -> float:
            rim, tip = block.rim(grid), TIP_LOSS * grid.flow[0] * grid.step / block.cells[2] ** 2
            known = np.minimum(block.on_rim(grid), block.most)[met]
            return float(np.max(truth * rim - known, initial=0.0)) + tip

        return min(tried, key=lost)

    @classmethod
    def _within(cls, grid: Grid, end: Point, reach: int, holds: BoolArray, early: float) -> "Block":
        """Find the block of a reach."""
        column, row = grid.cell_of(end)
        off = end[0] - grid.origin[0] - column * grid.step, end[1] - grid.origin[1] - row * grid.step
        prices, most = np.tile([*np.zeros(5), *grid.flow[:3]], (grid.count + 2, 1)), np.zeros(grid.count)
        made = cls(end, (column, row, reach), off, prices, most, holds, early)
        for n in np.nonzero(holds)[0].tolist():
            prices[n + 1], most[n] = _price_at(grid, n, end, made.rim(grid))
        prices[0], prices[-1] = prices[1], prices[-2]
        return made

    def rim(self, grid: Grid) -> float:
        """Return the greatest distance of its rim, map units."""
        return math.sqrt(2.0) * (self.cells[2] + 1.0) * grid.step * (1.0 + 1e-9)

    def on_rim(self, grid: Grid) -> FloatArray:
        """Return the greatest value of the formula on the rim, about, in each layer."""
        return _at_most(self.prices[1:-1], self.rim(grid), grid)

    def within(self, frame: Frame) -> tuple[int, int, int]:
        """Return column and row of its middle in a frame, and its reach."""
        column, row, reach = self.cells
        return column - frame.column, row - frame.row, reach

    def marked(self, frame: Frame) -> BoolArray:
        """Mark its cells in a frame, shape ``(rows, columns)``."""
        column, row, reach = self.within(frame)
        rows, columns = (
            np.abs(np.arange(count) - middle) <= reach for count, middle in zip(frame.size, (row, column), strict=True)
        )
        return np.asarray(rows[:, None] & columns)


def _at_most(formulas: FloatArray, rim: float, grid: Grid) -> FloatArray:
    """Return the greatest values of formulas, shape ``(..., 8)``, on a rim, about: against the wind."""
    time, length, gx, gy, bend, v, wx, wy = np.moveaxis(formulas, -1, 0)
    slow = np.maximum(v - np.hypot(wx, wy), 0.1 * grid.flow[0])
    return np.asarray(rim * (time / slow + length + 0.5 * rim * np.hypot(gx, gy) - bend * rim**2 / 3.0))


def _price_at(grid: Grid, n: int, end: Point, rim: float) -> tuple[FloatArray, float]:
    """Bound the cost of ways to an end from up to `rim` that begin within a layer: formula, and greatest value."""
    v = grid.flow[0]
    best, most, high, lasts = np.array([*np.zeros(5), *grid.flow[:3]]), 0.0, -math.inf, SLOWER * rim / v
    for _ in range(WHILES):
        begins, until = float(grid.knots[n]), float(grid.knots[n + 1]) + lasts
        middle, half = 0.5 * (begins + until), 0.5 * (until - begins) * (1.0 + 1e-9)
        turns = (grid.events > begins) & (grid.events < until)
        if grid.windy or turns.any():
            # (so wide that leaving costs as much as the way against the wind)
            wide = min(max(0.5 * (1.0 + grid.fast / grid.slow), DISCS[0]), WIDEST)
            discs = (wide,) if grid.wind is None else (wide, *DISCS)
            found = [_least_price(grid, n, end, (rim, disc * rim, lasts)) for disc in discs]
        else:
            threats = grid.threats[n].copy()
            threats[:, [0, 1, 4, 6]] += (middle - grid.middles[n]) * threats[:, [2, 3, 5, 7]]
            found = [_formula_on(grid, n, end, (rim, disc * rim, half, lasts), threats) for disc in DISCS]
        level, value, formula = max(
            ((float(_at_most(formula, rim, grid)), value, formula) for formula, value in found),
            key=lambda one: min(one[0], one[1]),
        )
        if min(level, value) > high:
            best, most, high = formula, value, min(level, value)
        if value >= level:
            break
        lasts *= LONGER
    return best, most


def _formula_on(
    grid: Grid, n: int, end: Point, sizes: tuple[float, float, float, float], threats: FloatArray
) -> tuple[FloatArray, float]:
    """Return a formula, and what a path pays at least that does not pay as it says."""
    v, _, _, per_time, price = grid.flow
    (rim, disc, half, lasts), found = sizes, np.empty(5)
    raster = _raster_floor(grid.still[n], grid, end, disc)
    leaving = end_formula(*end, rim, disc, half, grid.k / v if per_time else grid.k, threats, raster, found)
    formula = np.array([0.0, *found[:4], *grid.flow[:3]])
    return formula, min(min(v * found[4], price) * lasts, leaving) * (1.0 - 1e-9)


def _least_price(grid: Grid, n: int, end: Point, sizes: tuple[float, float, float]) -> tuple[FloatArray, float]:
    """Bound as `_formula_on`, by the least risk near the end in each layer, and in wind."""
    v, wx, wy, per_time, price = grid.flow
    rim, wide, lasts = sizes
    last = int(np.searchsorted(grid.knots, float(grid.knots[n + 1]) + lasts * (1.0 + 1e-9)))
    risks: list[float] = []
    for m in range(n, max(min(last, grid.count), n + 1)):
        part = 0.5 * float(grid.durations[m + 1]) * (1.0 + 1e-9)
        risk = least_near(*end, wide, part, grid.threats[m])
        risks.append(grid.k * (risk + _raster_floor(grid.still[m], grid, end, wide)[4]))
    least = min(risks)
    formula = np.array([v + least if per_time else v, 0.0 if per_time else least, 0.0, 0.0, 0.0, v, wx, wy])
    if grid.wind is not None:
        # (within that disc and time, nothing is faster over the ground)
        low, high = (end[0] - wide, end[1] - wide), (end[0] + wide, end[1] + wide)
        times = float(grid.knots[n]), float(grid.knots[n + 1]) + lasts * (1.0 + 1e-9)
        near = np.empty(9)
        wind_within(low, high, times, grid.wind.arrays, near)
        formula[5:] = v + near[2] + np.hypot(near[3::2], near[4::2]).sum() * (1.0 + 1e-9), near[0], near[1]
    leaves = rim * (formula[0] / grid.fast + formula[1]) + 2.0 * (wide - rim) * v / grid.fast
    return formula, min(min(v, price) * lasts, leaves) * (1.0 - 1e-9)


def _raster_floor(still: Still, grid: Grid, end: Point, reach: float) -> FloatArray:
    """Bound rasters from below on a disc: value and slopes at its middle, drop, and least."""
    found = np.zeros(5)
    if still.rasters is not None:
        x_min, y_min, x_max, y_max = grid.bounds
        low = max(end[0] - reach, x_min), max(end[1] - reach, y_min)
        high = min(end[0] + reach, x_max), min(end[1] + reach, y_max)
        found[:] = raster_floor(low, high, *end, still.rasters)
    return found


def _layers(slabs: "Sequence[Slab]", lasts: float) -> tuple[FloatArray, IntArray]:
    """Divide slabs into layers that last about so long each; return their knots, and the slab of each."""
    knots, numbers = [slabs[0].begins], []
    for number, slab in enumerate(slabs):
        count = max(1, math.ceil((slab.ends - slab.begins) / lasts - 1e-9))
        knots += np.linspace(slab.begins, slab.ends, count + 1)[1:].tolist()
        numbers += count * [number]
    return np.array(knots), np.array(numbers)


def fastest(threats: FloatArray) -> float:
    """
    Return the greatest speed of any threat, shape ``(n, m, 8)``; 0 without any.

    Examples
    --------
    >>> fastest(np.array([[[0.0, 0.0, 3.0, 4.0, 1.0, 0.0, 1.0, 0.0]]]))
    5.0
    """
    return float(np.hypot(threats[..., VX], threats[..., VY]).max(initial=0.0))
