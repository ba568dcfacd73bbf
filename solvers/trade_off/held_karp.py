"""The cheapest order of places between two ends, exactly (Held and Karp, 1962)."""

import math

import numpy as np

from cgla_graph._types import FloatArray


def cheapest_order(costs: FloatArray) -> tuple[tuple[int, ...], float]:
    """
    Return the cheapest order in which all places are visited once, by dynamic programming over their subsets.

    Parameters
    ----------
    costs
        Cost of each leg, shape ``(n + 2, n + 2)``: of ``n`` places, then of the start and the goal. Infinite if there
        is no leg.

    Returns
    -------
    order, cost
        Numbers of the places; of equally cheap orders always the same. The cost is infinite if there is none.

    Examples
    --------
    >>> places = np.array([3.0, 1.0, 2.0, 0.0, 4.0])
    >>> cheapest_order(np.abs(places[:, None] - places))
    ((1, 2, 0), 4.0)
    """
    n = len(costs) - 2
    start, goal = n, n + 1
    if n == 0:
        return (), float(costs[start, goal])
    # least[s, i]: to visit the places of the set s from the start, and to end at i
    least = np.full((1 << n, n), math.inf)
    least[1 << np.arange(n), np.arange(n)] = costs[start, :n]
    for members in range(1, 1 << n):
        inside = [index for index in range(n) if members >> index & 1]
        outside = [index for index in range(n) if not members >> index & 1]
        if outside:
            onward = (least[members, inside, None] + costs[np.ix_(inside, outside)]).min(axis=0)
            rows = members | 1 << np.array(outside)
            least[rows, outside] = np.minimum(least[rows, outside], onward)
    members = (1 << n) - 1
    ends = least[members] + costs[:n, goal]
    last = int(ends.argmin())
    total, order = float(ends[last]), [last]
    while len(order) < n:
        members ^= 1 << last
        before = np.where(members >> np.arange(n) & 1, least[members] + costs[:n, last], math.inf)
        last = int(before.argmin()) if math.isfinite(before.min()) else (members & -members).bit_length() - 1
        order.append(last)
    return tuple(reversed(order)), total
