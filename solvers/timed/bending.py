"""Bend flights through moving risk to a local optimum: waypoints, waits and departure, by cost and exact gradient."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph._validate import point_array
from cgla_graph.errors import ProblemError
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.solvers.timed.descent_kernels import Task, descend
from cgla_graph.solvers.timed.timed_kernels import Chart, flight_cost, flight_times, time_of
from cgla_graph.timed.timed_problem import TimedProblem

#: Waypoints of the first stage; later stages add one in the middle of each leg, up to `MOST` of them.
FIRST, MOST = 25, 100
#: Depths, as parts of the distance from start to goal, by which areas and discs are widened, one stage after the other.
MARGINS = (1e-2, 1e-3, 1e-4, 1e-5)
#: A stage that gains less than this part of the cost is the last; what leaving waypoints out may cost.
GAIN, SLACK = 2e-6, 1e-7
#: The first step of a descent, as a part of the distance from start to goal.
FIRST_STEP = 1e-2
#: Waits shorter than it takes to fly this part of the distance from start to goal are none.
SHORT = 1e-9
#: A step of a trace that arrives earlier by this part of its time is one that waits or circles.
IDLE = 0.05
#: A trace that takes longer by this part of its time than its even resampling keeps all of its turns.
DAWDLING = 1e-3


@dataclass(frozen=True, eq=False)
class Flying:
    """
    A flight that is bent.

    Attributes
    ----------
    points, waits
        Waypoints ``(m, 2)``, and the time spent waiting at each.
    departure
        When it departs.
    cost
        Its cost; infinite where it is not feasible.
    """

    points: FloatArray
    waits: FloatArray
    departure: float
    cost: float = math.inf

    def rows(self, chart: Chart) -> FloatArray:
        """Return the flight as rows ``(t, x, y)``, two for a waypoint at which it waits."""
        times = flight_times(chart, self.points, self.waits, self.departure)
        rows = []
        for t, wait, (x, y) in zip(times, self.waits, self.points, strict=True):
            rows.append((t, x, y))
            if wait > 0.0:
                rows.append((t + wait, x, y))
        found = np.array(rows)
        rises: BoolArray = np.append(True, np.diff(found[:, 0]) > 0.0)
        return np.ascontiguousarray(found[rises])


def along(points: ArrayLike, departure: float) -> Flying:
    """
    Return a flight along waypoints without waits.

    Examples
    --------
    >>> along([(0, 0), (1, 1)], 2.0).departure
    2.0
    """
    path = point_array("points", points)
    kept = np.append(True, (np.diff(path, axis=0) != 0.0).any(axis=1))
    return Flying(path[kept], np.zeros(int(kept.sum())), departure)


def of_trace(chart: Chart, rows: FloatArray, amplitude: float) -> Flying:
    """
    Return the flight of a trace: where it is slower than the aircraft, it waits, or flies to and fro by `amplitude`.

    Few waypoints are kept where it neither waits nor circles.
    """
    points, waits, owed = [rows[0, 1:]], [0.0], 0.0
    heading = rows[-1, 1:] - rows[0, 1:]
    side = np.array([-heading[1], heading[0]]) / np.hypot(*heading)
    for before, after in pairwise(rows):
        step = after[1:] - before[1:]
        late = after[0] - before[0] - time_of(chart, before[1], before[2], before[0], step[0], step[1], 1.0)
        if late > IDLE * (after[0] - before[0]):
            owed += late
        elif owed > 0.0:
            if chart.price < math.inf:
                waits[-1] += owed
            else:
                reach = 0.5 * owed * chart.speed
                for turn in range(trips := math.ceil(reach / amplitude)):
                    points += [points[-1] + side * reach / trips * (1.0 - 2.0 * (turn % 2)), points[-1]]
                    waits += [0.0, 0.0]
            owed = 0.0
        points.append(after[1:])
        waits.append(0.0)
    places = np.array(points)
    kept = np.append(True, (np.diff(places, axis=0) != 0.0).any(axis=1))
    held: FloatArray = np.bincount(np.cumsum(kept) - 1, waits).astype(np.float64)
    found = Flying(places[kept], held, float(rows[0, 0]))
    if len(found.points) > len(rows) or found.waits.any():
        return found
    fewer = _evenly(found, FIRST)
    times = (flight_times(chart, one.points, one.waits, one.departure)[-1] for one in (found, fewer))
    # (a flight that dawdles, as until an area opens, would come too early without its turns)
    return found if next(times) - next(times) > DAWDLING * (rows[-1, 0] - rows[0, 0]) else fewer


def _evenly(flying: Flying, count: int) -> Flying:
    """Return the flight through `count` places that are evenly far apart."""
    lengths = np.append(0.0, np.cumsum(np.hypot(*np.diff(flying.points, axis=0).T)))
    places = np.linspace(0.0, lengths[-1], count)
    points = np.column_stack([np.interp(places, lengths, flying.points[:, i]) for i in range(2)])
    points[-1] = flying.points[-1]
    return Flying(points, np.zeros(count), flying.departure)


def _halved(flying: Flying) -> Flying:
    """Return the same flight, up to rounding, with a waypoint in the middle of each leg."""
    points = np.empty((2 * len(flying.points) - 1, 2))
    points[::2], points[1::2] = flying.points, 0.5 * (flying.points[:-1] + flying.points[1:])
    waits = np.zeros(len(points))
    waits[::2] = flying.waits
    return Flying(points, waits, flying.departure, flying.cost)


class Bender:
    """Bends flights of one problem, away from more trajectories at a distance; counts evaluations of the cost."""

    def __init__(
        self, problem: TimedProblem, chart: Chart, also: Sequence[Trajectory] = (), radius: float = 0.0
    ) -> None:
        self.problem, self.chart, self.also, self.radius = problem, chart, also, radius
        self.evaluations = 0
        self.scale = math.dist(problem.start, problem.goal)
        self.kept_out = len(chart.boxes) > 0 or len(chart.discs.rows) > 0

    def rows(self, flying: Flying) -> FloatArray:
        """Return the rows of a flight, in the true wind where it changes."""
        if self.problem.constant_wind is not None:
            return flying.rows(self.chart)
        return self.problem.fly(flying.points, flying.departure)

    def judged(self, flying: Flying) -> Flying:
        """Return the flight with its cost by the oracle; infinite where it is not feasible."""
        times = flight_times(self.chart, flying.points, flying.waits, flying.departure)
        if not math.isfinite(times[-1]):
            return replace(flying, cost=math.inf)
        try:
            rows = self.rows(flying)
        except ProblemError:
            # (too strong a wind somewhere)
            return replace(flying, cost=math.inf)
        found, own = self.problem.evaluate(rows), Trajectory(rows[:, 0], rows[:, 1:])
        fits = found.feasible and all(least_distance(own, other)[0] >= self.radius for other in self.also)
        return replace(flying, cost=found.cost if fits else math.inf)

    def coarse(self, flying: Flying) -> Flying:
        """Bend a flight with few waypoints, to see which class of ways it belongs to and what that costs about."""
        few = flying if len(flying.points) >= FIRST or flying.waits.any() else self._filled(flying)
        return self._staged(few, MARGINS[:3] if self.kept_out else (0.0,))

    def fine(self, flying: Flying) -> Flying:
        """Bend a flight with more and more waypoints, then leave out those that gain nothing."""
        best = current = flying
        while 2 * len(current.points) - 1 <= MOST:
            halved = _halved(current)
            # (where areas or others are near, only the least margins gain)
            found = self._staged(halved, MARGINS[2:] if self.kept_out else (0.0,))
            gained = best.cost - found.cost
            # (halved, a leg along an outline may get inside by rounding: it is gone on from, but is no answer)
            current = found if found.cost < best.cost or not math.isfinite(best.cost) else halved
            best = min(best, found, key=lambda one: one.cost)
            if 0.0 <= gained < GAIN * best.cost:
                break
        return self._thinned(best)

    def _filled(self, flying: Flying) -> Flying:
        while 2 * len(flying.points) - 1 <= 2 * FIRST:
            flying = _halved(flying)
        return flying

    def _staged(self, flying: Flying, margins: tuple[float, ...]) -> Flying:
        best, current = self.judged(flying), flying
        for margin in margins:
            current = self._bent(current, margin * self.scale)
            found = self.judged(current)
            if found.cost < best.cost:
                best = found
        return best

    def _bent(self, flying: Flying, margin: float) -> Flying:
        """Minimize the cost, with a penalty inside areas and discs of others that are wider by `margin`."""
        chart, m = self.chart, len(flying.points)
        peak = 1.0 + chart.k
        weight = 10.0 * chart.speed * peak / margin**2 if margin > 0.0 else 0.0
        if margin == 0.0 and chart.latest < math.inf:
            weight = 100.0 * chart.speed * peak / (1e-4 * self.scale / chart.speed)
        first, last = self.problem.departures
        waits, window = chart.price < math.inf, last > first
        x_min, y_min, x_max, y_max = self.problem.bounds
        bounds = [(x_min, x_max), (y_min, y_max)] * (m - 2)
        bounds += [(0.0, math.inf)] * (m - 1) if waits else []
        bounds += [(first, last)] if window else []
        if not bounds:
            return flying
        # (the first step is as long as a unit: with small units a steep penalty does not throw it far away)
        unit = FIRST_STEP * self.scale
        low, high = np.array(bounds).T / unit
        z = [flying.points[1:-1].ravel(), flying.waits[:-1] if waits else [], [flying.departure] if window else []]
        points, waiting = flying.points.copy(), flying.waits.copy()
        task = Task(points, waiting, first, waits, window, low, high, unit, weight, margin)
        departure, evaluations = descend(chart, task, np.concatenate(z) / unit)
        self.evaluations += evaluations
        kept = np.where(waiting > SHORT * self.scale / chart.speed, waiting, 0.0)
        return Flying(points, kept, min(max(departure, first), last))

    def _thinned(self, flying: Flying) -> Flying:
        """Leave out the waypoints that gain next to nothing, if the flight stays feasible."""
        if not math.isfinite(flying.cost):
            return flying
        slopes = np.empty((len(flying.points), 3))
        kept, _ = flight_cost(self.chart, flying.points, flying.waits, flying.departure, 0.0, 0.0, slopes)
        most = kept * (1.0 + SLACK)
        points, waits = flying.points, flying.waits
        for i in range(len(points) - 2, 0, -1):
            if waits[i] > 0.0:
                continue
            fewer, left = np.delete(points, i, axis=0), np.delete(waits, i)
            if flight_cost(self.chart, fewer, left, flying.departure, 0.0, 0.0, slopes[: len(fewer)])[0] <= most:
                points, waits = fewer, left
        found = self.judged(Flying(points, waits, flying.departure))
        return found if found.cost <= flying.cost * (1.0 + 2.0 * SLACK) else flying
