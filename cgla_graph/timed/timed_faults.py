"""Why a timed path is not feasible, but for its speed: areas, bounds, others, departure and arrival."""

import math

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.model.clearance import ROUNDING
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.timed.timed_flight import TimedFlight
from cgla_graph.timed.timed_map import TimedMap


def _slack(timed: TimedMap) -> float:
    """Return by how much a path may miss a distance, for rounding."""
    x_min, y_min, x_max, y_max = timed.bounds
    return ROUNDING * max(x_max - x_min, y_max - y_min)


def nearest_area(timed: TimedMap, flight: TimedFlight) -> tuple[float, list[str]]:
    """Return the least distance to areas while they are closed, and why that is too near."""
    least, crossed = math.inf, list[tuple[float, str]]()
    # (the last row belongs to the slab that begins there, too)
    last = int(np.searchsorted(timed.events, flight.rows[-1, 0], side="right"))
    for number in np.unique([*flight.slabs, last]):
        slab = timed.all_slabs[number]
        if slab.no_fly is None:
            continue
        here = np.nonzero(flight.slabs == number)[0]
        starts, ends = flight.pieces[here], flight.pieces[here + 1]
        legs = flight.legs[here]
        if number == last:
            starts, ends = (np.vstack([rows, flight.rows[-1:]]) for rows in (starts, ends))
            legs = np.append(legs, len(flight.rows) - 2)
        for piece in np.nonzero(slab.area.crosses(starts[:, 1:], ends[:, 1:]))[0][:1]:
            crossed.append((starts[piece, 0], f"leg {max(legs[piece], 0)} crosses a closed area"))
        given = indexed_area(slab.no_fly)
        least = min(least, *(given.path_clearance(pair[:, 1:]) for pair in np.stack([starts, ends], axis=1)))
    if crossed:
        time, words = min(crossed)
        return least, [f"{words} after time {time:.9g}"]
    if least < timed.clearance - _slack(timed):
        return least, [f"it comes within {least:.6g} of a closed area, and the clearance is {timed.clearance:g}"]
    return least, []


def nearest_other(timed: TimedMap, flight: TimedFlight) -> tuple[float, list[str]]:
    """Return the least distance to the trajectories of others, and whether that is too near."""
    if not timed.others:
        return math.inf, []
    own = Trajectory(flight.pieces[:, 0], flight.pieces[:, 1:])
    found = [(*least_distance(own, other), number) for number, other in enumerate(timed.others)]
    least, time, number = min(found)
    if least < timed.separation - _slack(timed):
        words = f"it comes within {least:.6g} of trajectory {number} of others at time {time:.9g}"
        return least, [f"{words}, and the separation is {timed.separation:g}"]
    return least, []


def outside(timed: TimedMap, rows: FloatArray) -> list[str]:
    """Return which row leaves the bounds first."""
    beyond = np.nonzero(~timed.still.in_bounds(rows[:, 1:]))[0]
    return [f"row {i} leaves the bounds" for i in beyond[:1]]


def out_of_time(timed: TimedMap, rows: FloatArray) -> list[str]:
    """Return whether it departs or arrives at a wrong time."""
    first, last = timed.departures
    departs, arrives = rows[0, 0], rows[-1, 0]
    found = []
    if not first <= departs <= last:
        when = f"at {first:g}" if first == last else f"between {first:g} and {last:g}"
        found.append(f"it departs at {departs:.9g}, and may depart {when}")
    if timed.latest is not None and arrives > timed.latest:
        found.append(f"it arrives at {arrives:.9g}, and the latest arrival is {timed.latest:g}")
    return found
