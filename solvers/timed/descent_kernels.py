"""
Compiled descent of flights: L-BFGS within bounds.

SciPy's costs more than the flights themselves: its small matrices go to a BLAS library, whose threads wait for each
other where cores are shared.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.solvers.timed.timed_kernels import Chart, flight_cost

#: Steps that are remembered, steps and evaluations at most, and trials of a step.
PAIRS: Final = 20
STEPS: Final = 150
EVALUATIONS: Final = 200
TRIALS: Final = 20
#: A step that gains less than this part of the cost is the last, and a slope below this is none.
FTOL: Final = 1e-9
GTOL: Final = 1e-9
#: Weak Wolfe conditions.
ENOUGH: Final = 1e-4
FLATTER: Final = 0.9


class Task(NamedTuple):
    """
    What is bent, and how: fields as of `flight_cost`.

    Attributes
    ----------
    points, waits, departure
        The flight. `points` and `waits` are overwritten.
    may_wait, may_choose
        Whether waits and the departure are free.
    low, high
        Bounds of all that is free, in units: places, waits, departure.
    unit
        The length of the first step.
    weight, margin
        Of penalties.
    """

    points: FloatArray
    waits: FloatArray
    departure: float
    may_wait: bool
    may_choose: bool
    low: FloatArray
    high: FloatArray
    unit: float
    weight: float
    margin: float


@kernel
def _lay(task: Task, z: FloatArray) -> float:
    """Write the free numbers into the flight, and return its departure."""
    m, n = task.points.shape[0], 0
    for i in range(1, m - 1):
        for j in range(2):
            task.points[i, j] = z[n] * task.unit
            n += 1
    if task.may_wait:
        for i in range(m - 1):
            task.waits[i] = z[n] * task.unit
            n += 1
    return float(z[n] * task.unit) if task.may_choose else task.departure


@kernel
def _cost(chart: Chart, task: Task, z: FloatArray, slopes: FloatArray, slope: FloatArray) -> float:
    """Return the cost of a flight, and its slope by the free numbers."""
    departure = _lay(task, z)
    total, late = flight_cost(chart, task.points, task.waits, departure, task.weight, task.margin, slopes)
    m, n = task.points.shape[0], 0
    for i in range(1, m - 1):
        for j in range(2):
            slope[n] = slopes[i, j] * task.unit
            n += 1
    if task.may_wait:
        for i in range(m - 1):
            slope[n] = slopes[i, 2] * task.unit
            n += 1
    if task.may_choose:
        slope[n] = late * task.unit
    return total


@kernel
def _direction(g: FloatArray, free: FloatArray, steps: FloatArray, turns: FloatArray, made: int, d: FloatArray) -> None:
    """Fill `d` with the direction of L-BFGS among the free numbers (two loops over remembered steps)."""
    known = min(made, steps.shape[0])
    factors, inverse = np.zeros(known), np.zeros(known)
    d[:] = -g * free
    for back in range(known):
        at = (made - 1 - back) % steps.shape[0]
        inverse[back] = np.sum(steps[at] * turns[at] * free)
        if inverse[back] > 0.0:
            factors[back] = np.sum(steps[at] * d) / inverse[back]
            d -= factors[back] * turns[at] * free
    if known > 0 and inverse[0] > 0.0:
        at = (made - 1) % steps.shape[0]
        d *= inverse[0] / max(np.sum(turns[at] * turns[at] * free), 1e-300)
    for back in range(known - 1, -1, -1):
        if inverse[back] > 0.0:
            at = (made - 1 - back) % steps.shape[0]
            d += (factors[back] - np.sum(turns[at] * d) / inverse[back]) * steps[at] * free


@kernel
def descend(chart: Chart, task: Task, z: FloatArray) -> tuple[float, int]:
    """
    Bend a flight downhill from the free numbers `z`, in units; return its departure, and the evaluations made.

    The flight is left in `task`.
    """
    n = z.shape[0]
    slopes = np.empty((task.points.shape[0], 3))
    g, new, d, free = np.empty(n), np.empty(n), np.empty(n), np.empty(n)
    steps, turns = np.empty((PAIRS, n)), np.empty((PAIRS, n))
    z = np.minimum(np.maximum(z, task.low), task.high)
    f = _cost(chart, task, z, slopes, g)
    evaluations, made = 1, 0
    for _ in range(STEPS):
        for i in range(n):
            free[i] = 0.0 if (z[i] <= task.low[i] and g[i] > 0.0) or (z[i] >= task.high[i] and g[i] < 0.0) else 1.0
        if not np.max(np.abs(g * free)) > GTOL or not f < math.inf:
            break
        _direction(g, free, steps, turns, made, d)
        downhill = np.sum(g * d)
        if not downhill < 0.0:
            made = 0
            d[:] = -g * free
            downhill = np.sum(g * d)
        t = min(1.0, 1.0 / math.sqrt(np.sum(d * d))) if made == 0 else 1.0
        low, high, found, far = 0.0, math.inf, f, z
        for _ in range(TRIALS):
            trial = np.minimum(np.maximum(z + t * d, task.low), task.high)
            value = _cost(chart, task, trial, slopes, new)
            evaluations += 1
            if not value <= f + ENOUGH * np.sum(g * (trial - z)):
                high = t
            else:
                found, far = value, trial
                if np.sum(new * d) >= FLATTER * downhill or evaluations >= EVALUATIONS:
                    break
                low = t
            t = 0.5 * (low + high) if high < math.inf else 2.0 * t
        if not found < f:
            break
        value = _cost(chart, task, far, slopes, new)
        steps[made % PAIRS] = far - z
        turns[made % PAIRS] = new - g
        if np.sum(steps[made % PAIRS] * turns[made % PAIRS]) > 0.0:
            made += 1
        gain = f - found
        z, f = far, found
        g[:] = new
        if gain <= FTOL * max(abs(f), 1.0) or evaluations >= EVALUATIONS:
            break
    return _lay(task, z), evaluations
