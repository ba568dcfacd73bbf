"""Join states in space-time, rows ``(t, x, y)``, by flights of one bend: for solvers that fix places and times."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.model.solution import Status
from cgla_graph.solvers.timed.found_flight import FoundFlight, arrived
from cgla_graph.timed.timed_flight import gathered
from cgla_graph.timed.timed_problem import TimedProblem
from cgla_graph.timed.wind import ground_speeds

#: The part of a time by which flights may be late, for rounding.
ROUNDING = 1e-11


def flight_times(problem: TimedProblem, firsts: FloatArray, lasts: FloatArray) -> FloatArray:
    """
    Return how long straight flights between places take; infinite against a wind that is too strong.

    Examples
    --------
    >>> east = TimedProblem((0, 0), (1, 0), speed=1.0, wind=(1.0, 0.0))
    >>> flight_times(east, np.array([[0.0, 0.0], [1.0, 0.0]]), np.array([[1.0, 0.0], [0.0, 0.0]])).tolist()
    [0.5, inf]
    """
    steps = lasts - firsts
    lengths = np.hypot(*steps.T)
    with np.errstate(divide="ignore", invalid="ignore"):
        times = lengths / ground_speeds(steps, problem.constant_wind or (0.0, 0.0), problem.speed)
    return np.where(lengths == 0.0, 0.0, np.where(times > 0.0, times, math.inf))


def bends(problem: TimedProblem, firsts: FloatArray, lasts: FloatArray) -> FloatArray:
    """
    Return the rows half way at which flights between states turn so that they take just as long; NaN without a flight.

    Through the air, both halves are equally long, and the bend is on the side of the middle of the map.

    Examples
    --------
    >>> problem = TimedProblem((0, 0), (1, 0), speed=1.0)
    >>> bends(problem, np.array([[0.0, 0.0, 0.0]]), np.array([[1.25, 1.0, 0.0]])).tolist()
    [[0.625, 0.5, 0.375]]
    """
    wind = np.array(problem.constant_wind or (0.0, 0.0))
    taken = lasts[:, :1] - firsts[:, :1]
    through_air = lasts[:, 1:] - firsts[:, 1:] - taken * wind
    far, room = np.hypot(*through_air.T)[:, None], problem.speed * taken
    middle = 0.5 * (firsts[:, 1:] + lasts[:, 1:])
    x_min, y_min, x_max, y_max = problem.bounds
    inwards = np.array([0.5 * (x_min + x_max), 0.5 * (y_min + y_max)]) - middle
    across = np.column_stack([-through_air[:, 1], through_air[:, 0]])
    across *= np.where((across * inwards).sum(axis=1) < 0.0, -1.0, 1.0)[:, None]
    there_and_back = np.where((inwards != 0.0).any(axis=1, keepdims=True), inwards, (1.0, 0.0))
    across = np.where(far > 0.0, across, there_and_back)
    across /= np.hypot(*across.T)[:, None]
    reach = 0.5 * np.sqrt(np.maximum(room**2 - far**2, 0.0))
    places = np.where(far <= room * (1.0 + ROUNDING), middle + reach * across, np.nan)
    return np.column_stack([firsts[:, 0] + 0.5 * taken[:, 0], places])


def hovers(problem: TimedProblem) -> bool:
    """Return whether it is possible to wait, and costs no more than flying to and fro."""
    windy = math.hypot(*(problem.constant_wind or (0.0, 0.0)))
    return problem.waiting is not None and problem.waiting <= problem.speed and windy <= problem.speed


def leg_costs(problem: TimedProblem, firsts: FloatArray, lasts: FloatArray) -> FloatArray:
    """
    Return what straight legs between states cost, by the oracle: infinite where one is NaN, closed or out of bounds.

    Legs between equal places are waited, others flown at full airspeed.
    """
    known = problem.still.in_bounds(np.nan_to_num(lasts[:, 1:], nan=math.inf)) & np.isfinite(firsts).all(axis=1)
    waits = (firsts[:, 1:] == lasts[:, 1:]).all(axis=1)
    taken = lasts[:, 0] - firsts[:, 0]
    price = problem.waiting if problem.waiting is not None and hovers(problem) else math.inf
    costs = np.where(waits & (taken > 0.0), price, problem.speed) * taken
    costs[~known | ~(taken >= 0.0)] = math.inf
    for number, slab in enumerate(problem.all_slabs):
        begins = np.maximum(firsts[:, 0], slab.begins)
        ends = np.minimum(lasts[:, 0], slab.ends)
        here = np.nonzero((ends > begins) & np.isfinite(costs))[0]
        if not len(here):
            continue
        rows = []
        for times in (begins[here, None], ends[here, None]):
            part = (times - firsts[here, :1]) / taken[here, None]
            rows.append(np.hstack([times, firsts[here, 1:] + part * (lasts[here, 1:] - firsts[here, 1:])]))
        if slab.no_fly is not None:
            crossed = slab.wide_area.crosses(rows[0][:, 1:], rows[1][:, 1:])
            costs[here[crossed]] = math.inf
            here, rows = here[~crossed], [each[~crossed] for each in rows]
        costs[here] += problem.k * gathered(problem, rows[0], rows[1], waits[here], np.full(len(here), number))
    return costs


def joined_costs(problem: TimedProblem, firsts: FloatArray, lasts: FloatArray) -> FloatArray:
    """Return what flights of one bend between states cost, or waits; infinite where there are none."""
    half = bends(problem, firsts, lasts)
    if hovers(problem):
        waits = (firsts[:, 1:] == lasts[:, 1:]).all(axis=1)
        half[waits, 1:] = firsts[waits, 1:]
    return leg_costs(problem, firsts, half) + leg_costs(problem, half, lasts)


def joined_rows(problem: TimedProblem, states: Sequence[FloatArray]) -> FloatArray:
    """Return the rows of a flight through states with its bends; equal places that follow each other are waits."""
    rows = [states[0]]
    for first, last in pairwise(states):
        far = problem.speed * (last[0] - first[0])
        (half,) = bends(problem, first[None], last[None])
        straight = np.hypot(*(half[1:] - 0.5 * (first[1:] + last[1:]))) <= 1e-6 * far
        waits = hovers(problem) and bool((first[1:] == last[1:]).all())
        rows += [last] if straight or waits else [half, last]
    return np.array(rows)


def at_once(problem: TimedProblem) -> FoundFlight | None:
    """Return the answer where nothing is to be searched, or in wind that changes, or with others to keep away from."""
    if problem.start == problem.goal:
        return arrived(problem)
    if problem.constant_wind is None:
        return FoundFlight(Status.UNSUPPORTED, message="it plans in wind that does not change")
    if problem.others and problem.separation > 0.0:
        return FoundFlight(Status.UNSUPPORTED, message="it plans without others")
    return None
