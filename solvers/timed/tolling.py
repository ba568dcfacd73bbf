"""Tighten the bound of a team by tolls where its flights meet, with prices from a linear program over flights."""

import dataclasses
import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from scipy.optimize import linprog

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import ROUNDING
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.timed.space_time_proof import timed_lower_bound
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem, tolled
from cgla_graph.timed.tolls import Toll

#: Flights that keep no more than this part of the separation meet.
NEAR = 1.1
#: A toll is so short that flights through its middle pay all but this part of its integral; how many follow each other.
SPARED, ROWS = 0.06, 3
#: Where flights cross, tolls are narrower along them than across; parts of the separation that one flight has more of.
NARROW, MORE = 0.5, (-0.6, 0.0, 0.6)
#: Flights cross if the sine of the angle between them is more than this.
CROSSING = 0.1
#: Flights on both sides of the best ones, and between: multiples of the way from the flight alone to that of the team.
SIDES = (-1.5, -1.25, -1.0, -0.5, 0.25, 0.5, 0.75, 1.0, 1.25, 1.5)
#: Prices are lowered to this part, as there are flights that the linear program does not know.
LOWERED = 0.92
#: Tolls of less than this part of all are left out.
LEAST = 0.02
#: A priced proof aims at no less than this gap, and has no more cells than this.
LEAST_TOLERANCE, CELLS = 5e-4, 300_000


class Known(NamedTuple):
    """A flight that need not keep apart, and its cost."""

    motion: Trajectory
    cost: float


class Meeting(NamedTuple):
    """A toll of price 1 for some flights, by the number of the UAV."""

    tolls: dict[int, Toll]

    @property
    def most(self) -> float:
        """What all pay together, at most."""
        return next(iter(self.tolls.values())).most

    def paid(self, number: int, flight: Trajectory) -> float:
        """Return what a flight of a UAV pays."""
        return self.tolls[number].paid(flight) if number in self.tolls else 0.0


def with_tolls(team: Sequence[TimedProblem], plan: TeamPlan, tolerance: float, max_cells: int) -> TeamPlan:
    """
    Return a team with a bound that counts what it costs to keep apart, if that of flights alone is not good enough.

    All flights together pay no more than the integrals of the prices (`Toll`). So the sum of the bounds of flights that
    pay, less these, is a bound for any prices. A linear program finds prices that are best if there are no
    flights but some around those known: none gains by keeping away from all others.

    Parameters
    ----------
    team
        The problems.
    plan
        The team; its flights alone are proven.
    tolerance
        Of the whole gap.
    max_cells
        Of each proof.
    """
    if not plan.plans or plan.gap <= tolerance or any(one.constant_wind is None for one in team):
        return plan
    units = list(meetings(team, plan))
    if not units:
        return plan
    flights = [list(flights_around(*each)) for each in zip(team, plan.alone, plan.plans, strict=True)]
    costs = [[one.cost for one in known] for known in flights]
    paid = [np.array([[unit.paid(i, one.motion) for unit in units] for one in own]) for i, own in enumerate(flights)]
    prices = best_prices(costs, paid, [unit.most for unit in units])
    priced = [pays @ prices + own for own, pays in zip(costs, paid, strict=True)]
    together = float(prices @ [unit.most for unit in units])
    known = sum(float(each.min()) for each in priced)
    aim = max(known / (plan.cost / (1.0 + tolerance) + together) - 1.0, LEAST_TOLERANCE)
    bound, rest = -together, known
    for i, (problem, alone) in enumerate(zip(team, plan.alone, strict=True)):
        if bound + rest <= plan.lower_bound:
            return plan
        best = int(priced[i].argmin())
        tolls, rest = tolls_of(i, units, prices), rest - float(priced[i][best])
        if not tolls:
            bound += alone.lower_bound
            continue
        flight = flights[i][best].motion
        proof = timed_lower_bound(tolled(problem, tolls), flight, tolerance=aim, max_cells=min(max_cells, CELLS))
        bound += max(proof.lower_bound, alone.lower_bound)
    return dataclasses.replace(plan, apart=bound * (1.0 - ROUNDING))


def tolls_of(number: int, units: Sequence[Meeting], prices: FloatArray) -> tuple[Toll, ...]:
    """Return the tolls that a UAV pays."""
    return tuple(
        dataclasses.replace(unit.tolls[number], prices=price * unit.tolls[number].prices)
        for unit, price in zip(units, prices, strict=True)
        if price > 0.0 and number in unit.tolls
    )


def meetings(team: Sequence[TimedProblem], plan: TeamPlan) -> Iterator[Meeting]:
    """Yield tolls where two flights meet, those alone or those of the team: in the middle between them."""
    apart = kept_apart(plan.separation, team)
    if apart <= 0.0:
        return
    for motions in (plan.trajectories, [one.motion for one in plan.alone]):
        for i, j in itertools.combinations(range(len(team)), 2):
            a, b = motions[i], motions[j]
            distance, time = least_distance(a, b)
            if distance > NEAR * plan.separation:
                continue
            (va, vb), half = _velocities(a, b, time), 0.5 * (min(a.ends, b.ends) - max(a.begins, b.begins))
            for forms in _forms(va, vb, apart):
                relative = 0.5 * (va - vb)
                spared = sum(float(relative @ form @ relative) for form in forms)
                lasts = min(math.sqrt(6.0 * SPARED / max(spared, 1e-300)), half)
                for number in range(-(ROWS // 2), ROWS // 2 + 1):
                    times = time + lasts * (number + np.array([-1.0, 0.0, 1.0]))
                    at_a, at_b = a.positions(times), b.positions(times)
                    if not times[0] < times[1] < times[2] or np.hypot(*(at_a - at_b)[1]) > NEAR * plan.separation:
                        continue
                    centre, prices = Trajectory(times, 0.5 * (at_a + at_b)), np.array([0.0, 1.0, 0.0])
                    first, second = (Toll(centre, prices, (form[0, 0], form[0, 1], form[1, 1])) for form in forms)
                    yield Meeting({i: first, j: second})
                    if np.array_equal(*forms) and len(team) > 2:  # noqa: PLR2004 - a pair has been yielded
                        yield Meeting(dict.fromkeys(range(len(team)), first))


def kept_apart(separation: float, team: Sequence[TimedProblem]) -> float:
    """Return how far flights really keep apart, as the oracle allows for rounding."""
    sides = [max(one.bounds[2] - one.bounds[0], one.bounds[3] - one.bounds[1]) for one in team]
    return (separation - 2.0 * ROUNDING * max(sides)) * (1.0 - 1e-12)


def _forms(va: FloatArray, vb: FloatArray, apart: float) -> Iterator[tuple[FloatArray, FloatArray]]:
    """
    Yield pairs of quadratic forms whose inverses sum up to the squared separation times the identity.

    Flights get out of the way of tolls to their sides. Where they cross, each has a wide toll across its own way.
    """
    across = [np.array([-v[1], v[0]]) / max(float(np.hypot(*v)), 1e-300) for v in (va, vb)]
    turn = np.outer(across[0], across[0]) - np.outer(across[1], across[1])
    kinds = [(0.0, more) for more in MORE] + [(NARROW, 0.0)] * bool(np.abs(turn).max() > CROSSING)
    for narrow, more in kinds:
        parts = (np.eye(2) + sign * (more * np.eye(2) + narrow * turn) for sign in (1.0, -1.0))
        first, second = (np.linalg.inv(0.5 * apart**2 * part) for part in parts)
        yield np.asarray(first), np.asarray(second)


def _velocities(a: Trajectory, b: Trajectory, time: float) -> tuple[FloatArray, FloatArray]:
    """Return the velocities of two flights around a time."""
    first, last = max(a.begins, b.begins), min(a.ends, b.ends)
    soon = np.clip(time + 1e-3 * (last - first) * np.array([-1.0, 1.0]), first, last)
    va, vb = (np.diff(one.positions(soon), axis=0)[0] / max(soon[1] - soon[0], 1e-300) for one in (a, b))
    return va, vb


def flights_around(problem: TimedProblem, alone: TimedPlan, own: TimedPlan) -> Iterator[Known]:
    """Yield feasible flights that need not keep apart: alone, between that and the one that does, and beyond."""
    yield Known(alone.motion, alone.cost)
    if len(alone.trajectory) == 1:
        return
    paths = [one.positions(np.linspace(one.begins, one.ends, 100)) for one in (alone.motion, own.motion)]
    for side in SIDES:
        path = paths[0] + side * (paths[1] - paths[0])
        path[[0, -1]] = problem.start, problem.goal
        departure = alone.departure + side * (own.departure - alone.departure)
        departure = min(max(departure, problem.departures[0]), problem.departures[1])
        try:
            rows = problem.fly(path, departure)
        except ProblemError:
            continue
        seen = problem.evaluate(rows)
        if seen.feasible:
            yield Known(Trajectory(rows[:, 0], rows[:, 1:]), seen.cost)
    yield Known(own.motion, own.cost)


def best_prices(costs: Sequence[Sequence[float]], paid: Sequence[FloatArray], most: Sequence[float]) -> FloatArray:
    """Return the prices of the best bound if each UAV has these flights alone: a linear program."""
    count, rows = len(costs), []
    for i, pays in enumerate(paid):
        rows.append(np.column_stack([np.tile(np.eye(count)[i], (len(pays), 1)), -pays]))
    limits = np.concatenate(costs)
    answer: Any = linprog([*-np.ones(count), *most], np.vstack(rows), limits)
    if answer.x is None:
        return np.zeros(len(most))
    prices = np.asarray(answer.x[count:]) * LOWERED
    return np.where(prices * most < LEAST * (prices @ most), 0.0, prices)
