"""Compiled kernels that bend a rounded polyline downhill: L-BFGS on the barrier, which no step may leave."""

import math

import numpy as np

from cgla_graph._kernel import kernel
from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.graph_kernels import Model
from cgla_graph.turning.fillet_kernels import barrier

#: Steps that are remembered.
MEMORY = 16


@kernel
def _project(gradient: FloatArray, held: FloatArray) -> None:
    """Project the gradient at the first and the last waypoint onto a given heading."""
    n = gradient.shape[0]
    for end in range(2):
        i, heading = 1 + end * (n - 3), held[end]
        if heading[0] != 0.0 or heading[1] != 0.0:
            along = gradient[i, 0] * heading[0] + gradient[i, 1] * heading[1]
            gradient[i, 0] = along * heading[0]
            gradient[i, 1] = along * heading[1]


@kernel
def descend(
    points: FloatArray,
    radius: float,
    model: Model,
    bounds: Bounds,
    reaches: tuple[float, float, float, float],
    mu: float,
    held: FloatArray,
    iterations: int,
    tolerance: float,
) -> tuple[float, int]:
    """
    Lower the barrier from `points`, shape ``(n, 2)``, in place; return it, and how often it was evaluated.

    Where a heading is `held`, the waypoint at that end moves along it alone. Limited-memory BFGS (Nocedal, Math. Comp.
    35, 1980) with steps that are shortened until the barrier falls enough. It ends after a round of `MEMORY` steps that
    gained less than `tolerance`, relative to the barrier.
    """
    n = points.shape[0]
    gradient, other = np.empty((n, 2)), np.empty((n, 2))
    steps, changes = np.empty((MEMORY, n, 2)), np.empty((MEMORY, n, 2))
    weights, shares = np.empty(MEMORY), np.empty(MEMORY)
    kept, newest = 0, 0
    value = barrier(points, radius, model, bounds, reaches, mu, held, gradient)
    looks = 1
    if value == math.inf:
        return value, looks
    _project(gradient, held)
    before = value
    for iteration in range(iterations):
        if iteration % MEMORY == MEMORY - 1:
            if before - value <= tolerance * abs(value):
                break
            before = value
        direction = -gradient
        for j in range(kept):
            i = (newest - j) % MEMORY
            shares[i] = (steps[i] * direction).sum() / weights[i]
            direction -= shares[i] * changes[i]
        if kept > 0:
            direction *= weights[newest] / (changes[newest] * changes[newest]).sum()
        for j in range(kept - 1, -1, -1):
            i = (newest - j) % MEMORY
            direction += (shares[i] - (changes[i] * direction).sum() / weights[i]) * steps[i]
        # (what steps remember of rounding would turn the headings)
        _project(direction, held)
        slope = (direction * gradient).sum()
        if not slope < 0.0:
            if kept == 0:
                break
            kept = 0
            continue
        longest = 0.0
        for i in range(n):
            longest = max(longest, math.hypot(direction[i, 0], direction[i, 1]))
        # a first step has no scale of its own, and none goes farther than the barrier reaches
        step = min(1.0, reaches[0] / longest)
        if kept == 0:
            step = min(step, 0.1 * reaches[0] / longest)
        candidate = math.inf
        moved = points
        for _ in range(40):
            moved = points + step * direction
            candidate = barrier(moved, radius, model, bounds, reaches, mu, held, other)
            looks += 1
            if candidate <= value + 1e-4 * step * slope:
                break
            candidate = math.inf
            step *= 0.4
        if candidate == math.inf:
            if kept == 0:
                break
            kept = 0
            continue
        _project(other, held)
        taken, change = moved - points, other - gradient
        weight = (taken * change).sum()
        # (only where the derivative rises along the step is there a curvature to learn)
        if weight > 1e-12 * math.sqrt((taken**2).sum() * (change**2).sum()):
            newest = (newest + 1) % MEMORY
            steps[newest], changes[newest], weights[newest] = taken, change, weight
            kept = min(kept + 1, MEMORY)
        points[:] = moved
        gradient[:] = other
        value = candidate
    return value, looks
