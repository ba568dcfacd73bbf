"""What is proven on the flat plane of a map in longitude and latitude, as it holds on the Earth."""

import dataclasses
import math
from collections.abc import Iterable
from typing import TYPE_CHECKING

from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.solvers.trade_off.constrained import PlanWithin


def plane_tolerance(scenario: Scenario, tolerance: float, cost: float) -> float:
    """
    Return how tight a bound on the plane has to be for a tolerance on the Earth: half of that at least.

    Parameters
    ----------
    scenario
        The map.
    tolerance
        Of the gap on the Earth, above 0.
    cost
        Of the path that the bound is held against, map units; infinite without one.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> f"{plane_tolerance(load_scenario('finland'), 0.005, 240e3):.5f}"
    '0.00490'
    """
    problem = scenario.problem
    held = cost if math.isfinite(cost) else math.dist(problem.start, problem.goal)
    bound = scenario.bound_on_earth(held)
    return tolerance if bound == held else max((1.0 + tolerance) * bound / held - 1.0, 0.5 * tolerance)


def certificate_on_earth(scenario: Scenario, proof: Certificate, tolerance: float) -> Certificate:
    """
    Turn a certificate of the plane into one that holds on the Earth (see `Scenario.bound_on_earth`).

    Parameters
    ----------
    scenario
        The map; what is proven in a plane of its own stays as it is.
    proof
        What is proven of the scenario's problem.
    tolerance
        What was asked for.

    Returns
    -------
    proof
        Its upper bounds are those of the plane, and no less than on the Earth.
    """
    if scenario.projection is None:
        return proof
    grids = tuple(
        dataclasses.replace(grid, lower_bound=scenario.bound_on_earth(grid.lower_bound)) for grid in proof.grids
    )
    bound = scenario.bound_on_earth(proof.lower_bound)
    found = dataclasses.replace(proof, lower_bound=bound, tolerance=tolerance, grids=grids)
    if not found.reached and proof.reached:
        less = at_most_percent(proof.lower_bound / bound - 1.0) if bound > 0.0 else "all of it"
        return dataclasses.replace(found, message=f"the bound allows {less} for the distortion of the flat map")
    if found.reached and bound < proof.lower_bound == proof.upper_bound:
        return dataclasses.replace(found, message="the gap is within the tolerance")
    return found


def solution_on_earth(scenario: Scenario, solution: Solution) -> Solution:
    """Turn the lower bound of a solver's own into one that holds on the Earth."""
    if scenario.projection is None:
        return solution
    return dataclasses.replace(solution, lower_bound=scenario.bound_on_earth(solution.lower_bound))


def plan_on_earth(scenario: Scenario, plan: "PlanWithin") -> "PlanWithin":
    """
    Turn what is proven of all paths in the plane that keep a budget into what holds on the Earth.

    A path there that keeps the budget costs no less, under the weight that prices it, than the bound of that cost on
    the Earth. What is proven of a lattice is about the lattice, and stays.

    Parameters
    ----------
    scenario
        The map.
    plan
        What was found; what its message says is measured on the plane, and it says so.
    """
    if scenario.projection is None or plan.scope == "lattice":
        return plan
    from cgla_graph.solvers.trade_off.pareto import ROUNDING  # noqa: PLC0415 - few plans have a budget

    problem, on_risk = scenario.problem, plan.limited == "risk"
    room = plan.budget * (1.0 + ROUNDING)
    straight = math.dist(problem.start, problem.goal)
    direct = scenario.bound_on_earth(straight)
    dual = plan.dual_bound
    if on_risk and dual <= straight:
        dual = min(dual, direct)
    elif on_risk and math.isfinite(dual):
        dual = max(direct, scenario.bound_on_earth(dual + plan.k * room) - plan.k * room)
    elif math.isfinite(plan.k) and 0.0 < dual < math.inf:
        dual = max(0.0, (scenario.bound_on_earth(plan.k * dual + room) - room) / plan.k)
    elif math.isinf(dual) and plan.status is Status.NOT_FOUND and direct <= room:
        # that even the shortest path on the plane is too long
        dual = 0.0
    solution = plan.solution
    if not plan.status.has_path and solution.message:
        solution = dataclasses.replace(solution, message=f"{solution.message}; measured on the flat map")
    return dataclasses.replace(plan, dual_bound=dual, solution=solution)


def distortion_note(scenario: Scenario, paths: Iterable[FloatArray]) -> str:
    """
    Say by how much lengths on a flat map exceed those on the Earth; empty for a map in the plane.

    Parameters
    ----------
    scenario
        The map.
    paths
        Those that are shown, map units.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> finland = load_scenario("finland")
    >>> distortion_note(finland, [np.array([finland.problem.start])])
    'lengths exceed those on the Earth by at most 0.0056 %; lower bounds allow for that'
    """
    if scenario.projection is None:
        return ""
    stretch = max((scenario.stretch(path) for path in paths), default=1.0)
    much = at_most_percent(stretch - 1.0)
    return f"lengths exceed those on the Earth by at most {much}; lower bounds allow for that"


def at_most_percent(ratio: float) -> str:
    """
    Write a small ratio as a percentage of two digits that is never below it.

    Examples
    --------
    >>> at_most_percent(0.00010001), at_most_percent(0.0), at_most_percent(0.125)
    ('0.011 %', '0 %', '13 %')
    """
    if not 0.0 < ratio < math.inf:
        return "0 %" if ratio == 0.0 else "any amount"
    unit = 10.0 ** (math.floor(math.log10(ratio)) - 1)
    return f"{100.0 * math.ceil(ratio / unit) * unit:.2g} %"
