"""The path of least risk within an energy: in still air a budget of length, in wind between two of them."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np

from cgla_graph._validate import instance, non_negative_number, positive_number
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.airspace.endurance.flight_time import flight_time
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers.trade_off.constrained import plan_within_length
from cgla_graph.solvers.trade_off.front import ROUNDING
from cgla_graph.solvers.trade_off.plan_within import PlanWithin
from cgla_graph.solvers.trade_off.reweighing import Reweighed

#: Budgets of length that are tried, from the one within which every path keeps the energy in a constant wind, or the
#: length of the shortest path.
_TRIED = 7


def plan_within_energy(
    problem: Problem,
    max_energy: float,
    aircraft: Aircraft,
    *,
    altitude: float | None = None,
    ground_speed: float | None = None,
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = 0.01,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> PlanWithin:
    r"""
    Find the path of least risk whose flight takes at most `max_energy`, and bound the risk of all such paths.

    At a constant power ``P`` the energy ``E`` is a time ``T = E / P``, from which climb and descent are taken first. In
    still air the time is a length, ``v T``: the answer is that of `plan_within_length`. In a constant wind ``w`` a path
    from A to B with the steps ``d`` takes, by the wind triangle,

    ``T = (sum sqrt(v^2 |d|^2 - (w x d)^2) - w . (B - A)) / (v^2 - |w|^2)``,

    where the root is between ``sqrt(v^2 - |w|^2) |d|`` and ``v |d|``. No path within the energy is thus longer than
    ``L = (T (v^2 - |w|^2) + w . (B - A)) / sqrt(v^2 - |w|^2)``: the bound is that of all paths so long, and holds for
    those within the energy. On a map in degrees, where north is not the same direction everywhere, ``L = (v + |w|) T``,
    the way at the greatest ground speed. The path itself keeps the energy exactly (`cgla_graph.flight_time`).

    Parameters
    ----------
    problem
        The map; its own `k` only enters the reported cost.
    max_energy
        The budget, watt-hours, at least 0.
    aircraft
        Its speed and power, the wind, and its climb rates if there is an altitude.
    altitude
        Metres above both ends; None for the level flight alone.
    ground_speed
        Speed over the ground that is commanded, as an exported plan does; None for none.
    solver, resolution, tolerance, **settings
        As of `plan_within_length`.

    Returns
    -------
    plan
        As of `plan_within_length`, limited by energy.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If a number is malformed, the aircraft lacks a number that the energy needs, or the wind is as fast as it.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> drone = Aircraft(speed=0.1, power=3600.0)
    >>> plan = plan_within_energy(problem, 11.0, drone, solver="cgla", resolution=9)
    >>> same = plan_within_length(problem, 1.1, solver="cgla", resolution=9)
    >>> plan.limited, plan.dual_bound == same.dual_bound, plan.solution.length == same.solution.length
    ('energy', True, True)
    """
    instance("problem", problem, Problem, problem_wanted)
    instance("aircraft", aircraft, Aircraft, "Aircraft(speed=…, power=…)")
    budget = non_negative_number("max_energy", max_energy)
    seconds, speed, blows = _seconds(budget, aircraft, altitude)
    how: dict[str, Any] = {"solver": solver, "resolution": resolution, **settings}
    drift = float(np.dot(aircraft.wind, np.subtract(problem.goal, problem.start)))
    room = speed**2 - blows**2
    most = (seconds * room + drift) / math.sqrt(room)
    if problem.projection is not None and blows > 0.0:
        most = (speed + blows) * seconds
    if ground_speed is not None:
        most = min(most, positive_number("ground_speed", ground_speed) * seconds)
    if seconds < 0.0 or most < 0.0:
        message = "the climb and the descent alone take more" if seconds < 0.0 else "none is so short in this wind"
        solution = Solution(Status.NO_PATH, message=f"no flight takes at most {budget:g} Wh: {message}")
        return PlanWithin(problem.judge(solution), "energy", budget, 0.0, math.inf, "plane", 0)
    flown = dataclasses.replace(aircraft, battery=None, reserve=None)

    def keeps(plan: PlanWithin) -> bool:
        if not plan.status.has_path:
            return False
        timed = flight_time(plan.solution, aircraft=flown, altitude=altitude, ground_speed=ground_speed)
        return timed.least_energy <= budget * (1.0 + 2.0 * ROUNDING)

    plan = plan_within_length(problem, most, tolerance=tolerance, **how)
    low = max(0.0, (seconds * room + drift) / speed)
    best = plan if keeps(plan) or not plan.status.has_path else _between(problem, low, most, keeps, how)
    if best is None:
        message = f"no path within {budget:g} Wh was found; whether there is one in this wind is not known"
        solution = Solution(Status.NOT_FOUND, message=message, projection=problem.projection, problem=problem)
    else:
        solution = best.solution
        implied = f"no flight within {budget:g} Wh is longer than {most:.9g}"
        message = f"{implied}: {solution.message}" if solution.message else implied
        # (in wind, the best of the lattice within the length is not the best within the energy)
        status = Status.FOUND if solution.status is Status.OPTIMAL and blows > 0.0 else solution.status
        solution = dataclasses.replace(solution, status=status, message=message)
    return dataclasses.replace(plan, solution=solution, limited="energy", budget=budget)


def _between(
    problem: Problem, low: float, high: float, keeps: Callable[[PlanWithin], bool], how: dict[str, Any]
) -> PlanWithin | None:
    """Return the plan of least risk that keeps the energy, of some within lengths between two; None without one."""
    best = None
    shortest = Reweighed(problem, **how).at(0.0)
    low = max(low, shortest.length) if shortest.status.has_path else low
    for index in range(_TRIED):
        length = low if index == 0 else 0.5 * (low + high)
        found = plan_within_length(problem, length, tolerance=None, **how)
        fits = keeps(found)
        if fits and (best is None or found.solution.risk < best.solution.risk):
            best = found
        if index > 0:
            # (up where it is too short for any path)
            low, high = (length, high) if fits or not found.status.has_path else (low, length)
    return best


def _seconds(budget: float, aircraft: Aircraft, altitude: float | None) -> tuple[float, float, float]:
    """Return the time on the way that an energy allows, the airspeed, and the speed of the wind."""
    if aircraft.speed is None or aircraft.power is None:
        msg = "an energy needs the airspeed and the power of the aircraft; give both (--speed V, --power W)"
        raise ProblemError(msg)
    blows = math.hypot(*aircraft.wind)
    if blows >= aircraft.speed:
        msg = (
            f"the wind is {blows:.6g} fast, the airspeed {aircraft.speed:g}: no length follows from an energy; give a "
            "greater airspeed, or wait for less wind"
        )
        raise ProblemError(msg)
    seconds = 3600.0 * budget / aircraft.power
    if altitude:
        upright = flight_time(np.zeros((1, 2)), aircraft=aircraft, altitude=altitude)
        if upright.unknown:
            msg = f"the energy of the climb is not known: {'; '.join(upright.unknown)}"
            raise ProblemError(msg)
        seconds -= upright.climbing
    return seconds, aircraft.speed, blows
