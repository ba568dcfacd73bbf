"""Plans within a budget: ``cgla plan --max-risk``, ``--max-length`` and ``--max-energy``."""

import math
from typing import Any

from cgla_graph._text import figure, percent, rounded_down
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.flight_time import Endurance
from cgla_graph.comparisons.cli.options import BudgetOptions
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.errors import CglaError
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.constrained import plan_within_length, plan_within_risk
from cgla_graph.solvers.trade_off.energy import plan_within_energy
from cgla_graph.solvers.trade_off.plan_within import PlanWithin


def plan_within(
    scenario: Scenario,
    entrant: Entrant,
    budget: BudgetOptions,
    tolerance: float | None = 0.01,
    endurance: Endurance | None = None,
) -> PlanWithin:
    """
    Plan within the given budget; an energy is one of the flight of `endurance`.

    Raises
    ------
    CglaError
        If several budgets are given, the budget is not a number of at least 0, the path is to be refined, or the
        aircraft of an energy is not known.
    """
    given = {f"--{name.replace('_', '-')}": value for name, value in vars(budget).items() if value is not None}
    if len(given) > 1:
        msg = f"{' and '.join(given)} are both given; limit one, and risk or length is made small"
        raise CglaError(msg)
    if entrant.refine:
        msg = f"--refine may break the budget; plan with --solver refine:base={entrant.name} instead"
        raise CglaError(msg)
    how: dict[str, Any] = {"resolution": scenario.lattice, "tolerance": tolerance}
    how["solver"] = registry.get(entrant.name, **entrant.settings_on(scenario))
    if budget.max_energy is not None:
        flown = endurance or Endurance(Aircraft())
        if flown.altitude is not None and flown.above != "home":
            msg = f"--max-energy with --above {flown.above}: the climbs are not known; give the altitude above home"
            raise CglaError(msg)
        more: dict[str, Any] = {"altitude": flown.altitude, "ground_speed": flown.ground_speed}
        return plan_within_energy(scenario.problem, budget.max_energy, flown.aircraft, **more, **how)
    plan, most = (
        (plan_within_length, budget.max_length) if budget.max_risk is None else (plan_within_risk, budget.max_risk)
    )
    return plan(scenario.problem, most or 0.0, **how)


def status_within(plan: PlanWithin) -> dict[str, str]:
    """Return the line of the status where it promises something of the paths within the budget alone; else nothing."""
    if plan.status is not Status.OPTIMAL:
        return {}
    best = "shorter" if plan.limited == "risk" else "of less risk"
    return {"status": f"optimal: no path on the lattice within the budget is {best}"}


def print_within(scenario: Scenario, plan: PlanWithin) -> None:
    """Print budget, weight, bounds and gap of a plan within a budget."""
    on_risk = plan.limited == "risk"
    metres = " m" if scenario.projection else ""
    unit, other_unit = {"risk": ("", metres), "length": (metres, ""), "energy": (" Wh", "")}[plan.limited]
    scope = "on the lattice" if plan.scope == "lattice" else "inside the bounds"
    best = "shorter" if on_risk else "of less risk"
    weight = "risk alone" if math.isinf(plan.k) else f"k = {figure(plan.k, 6)} prices the budget"
    bound = f"{rounded_down(plan.dual_bound, 9)}{other_unit}: no path {scope} within the budget is {best}"
    if plan.no_path:
        bound, weight = f"none: it is proven that no path {scope} keeps the budget", ""
    elif math.isnan(plan.dual_bound):
        bound, weight = "not known", ""
    what = "of the better bound" if plan.cut_bound > plan.dual_bound else "duality gap"
    cut = f"{rounded_down(plan.cut_bound, 9)}{other_unit}: the same, by the best k at each place"
    lines = {
        "budget": f"{plan.limited} at most {plan.budget:g}{unit}",
        "weight": weight,
        "dual bound": bound,
        "cut bound": cut if plan.cut_bound > plan.dual_bound else "",
        "gap": f"{percent(plan.gap)}: {what}" if plan.status.has_path else "",
    }
    console.out_lines(lines)
