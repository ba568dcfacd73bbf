"""
Bound flights that keep apart from given trajectories: by tolls on the discs around them.

A flight that keeps apart pays nothing of a price inside of a disc whose radius is the separation. So what flights that
pay cost at least is a bound for those that keep apart, however high the prices are.
"""

from collections.abc import Iterator
from dataclasses import replace

import numpy as np

from cgla_graph.model.clearance import ROUNDING
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.solvers.timed.tolling import LEAST_TOLERANCE, best_prices, flights_around, kept_apart
from cgla_graph.timed.space_time_proof import TimedCertificate, timed_lower_bound
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem, tolled
from cgla_graph.timed.tolls import Toll

#: Prices rise and fall in this part of the time that a toll lasts.
RAMP = 0.05
#: Prices are those of the linear program times this: it does not know all flights.
RAISED = 1.5
#: A proof with tolls has no more cells than this.
CELLS = 1_000_000


def with_others(
    problem: TimedProblem, plan: TimedPlan, alone: TimedPlan, proof: TimedCertificate, max_cells: int
) -> TimedCertificate:
    """
    Return a better bound for flights that keep apart from others, if there is one.

    Parameters
    ----------
    problem
        The problem, not in changing wind.
    plan, alone
        The best flights known: around others, and without them.
    proof
        For flights without others, held against `plan`.
    max_cells
        Of the proof.
    """
    tolls = list(_tolls(problem, alone.motion))
    if proof.reached or not tolls:
        return proof
    free = replace(problem, others=())
    flights = list(flights_around(free, alone, plan))
    costs = np.array([one.cost for one in flights])
    paid = np.array([[toll.paid(one.motion) for toll in tolls] for one in flights])
    # (of equal bounds, that of the lowest prices)
    prices = RAISED * best_prices([costs.tolist()], [paid], [1e-3 * toll.most for toll in tolls])
    priced = costs + paid @ prices
    best = int(priced.argmin())
    paying = tolled(free, (replace(toll, prices=p * toll.prices) for p, toll in zip(prices, tolls, strict=True) if p))
    aim = max((1.0 + proof.tolerance) * float(priced[best]) / plan.cost - 1.0, LEAST_TOLERANCE)
    found = timed_lower_bound(paying, flights[best].motion, tolerance=aim, max_cells=min(max_cells, CELLS))
    bound = found.lower_bound * (1.0 - ROUNDING)
    if bound <= proof.lower_bound:
        return replace(proof, message=f"{proof.message}; tolls around others prove no more")
    numbers = replace(proof, lower_bound=bound, proof=found.proof, grids=found.grids)
    return replace(numbers, message=f"with tolls: {found.message}", seconds=proof.seconds + found.seconds)


def _tolls(problem: TimedProblem, alone: Trajectory) -> Iterator[Toll]:
    """Yield tolls of price 1 on the discs around those others that a flight alone comes too near, while both fly."""
    apart = kept_apart(problem.separation, [problem])
    for other in problem.others:
        part = other.part(alone.begins, alone.ends)
        if part is None or not least_distance(alone, other)[0] < apart or not part.begins < part.ends:
            continue
        ramp = RAMP * (part.ends - part.begins)
        times = np.union1d(part.times, [part.begins + ramp, part.ends - ramp])
        prices = np.clip(np.minimum(times - part.begins, part.ends - times) / ramp, 0.0, 1.0)
        yield Toll(Trajectory(times, part.positions(times)), prices, (apart**-2, 0.0, apart**-2))
