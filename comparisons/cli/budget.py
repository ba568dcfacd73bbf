"""Plans within a budget (``cgla plan --max-risk``) and under uncertain risk (``--scenarios``)."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, get_args

from cgla_graph._text import figure, percent, rounded_down
from cgla_graph._validate import finite_number
from cgla_graph.airspace.endurance.aircraft import Aircraft
from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.certify import share_of
from cgla_graph.comparisons.cli.flight_time import Endurance
from cgla_graph.comparisons.cli.options import BudgetOptions, ProofOptions, UncertainOptions
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.options import read_tolerance
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.under_objective import runs_under
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.risk_scenarios import read_scenarios
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import solve
from cgla_graph.solvers.trade_off.constrained import plan_within_length, plan_within_risk
from cgla_graph.solvers.trade_off.energy import plan_within_energy
from cgla_graph.solvers.trade_off.plan_within import PlanWithin
from cgla_graph.solvers.uncertain.outlook import Objective, UncertainSolution

#: The gap that a proof over scenarios aims at where none is given.
WANTED = 0.01
#: Costs of scenarios that are printed; all are in the JSON.
MOST_COSTS = 12


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


@dataclass(frozen=True)
class Uncertain:
    """
    The options of uncertain risk.

    Attributes
    ----------
    options
        As they were given.
    is_default
        Whether no tolerance was given, so that the proof aims at `WANTED`.
    """

    options: UncertainOptions
    is_default: bool = True

    def on(self, scenario: Scenario) -> Scenario:
        """Return a map with its scenarios of risk."""
        field = read_scenarios(self.options.risk_scenarios or (), scenario.problem)
        return dataclasses.replace(scenario, problem=dataclasses.replace(scenario.problem, field=field))

    def solved(self, scenario: Scenario, entrant: Entrant, tolerance: float | None) -> Run:
        """Find a path under the objective, and prove it, by `cgla_graph.solve`."""
        settings = entrant.settings_on(scenario)
        settings["tolerance"] = WANTED if self.is_default and tolerance is not None else tolerance
        objective: Any = self.options.objective
        solution = solve(
            scenario.problem,
            entrant.name,
            resolution=scenario.lattice,
            refine=entrant.refine,
            objective=objective,
            alpha=None if self.options.alpha is None else share_of(self.options.alpha, "--alpha"),
            **settings,
        )
        return Run(scenario, entrant.label, None, exact=False, solution=solution)

    def document(self, run: Run) -> dict[str, Any]:
        """Return the numbers over all scenarios as JSON."""
        return outlook_of(run, self.options)

    def lines(self, run: Run) -> dict[str, str]:
        """Return the printed lines over all scenarios."""
        solution, unit = _of(run), " m" if run.on_map.projection else ""
        told, n = solution.outlook(self.options.exceeds), len(solution.probabilities)
        named = {
            "expected": "expected cost",
            "worst": "cost in the worst scenario",
            "cvar": f"mean cost of the worst {_part(1.0 - solution.alpha)} of cases (CVaR, alpha {solution.alpha:g})",
        }
        lines = {"objective": f"{named[solution.objective]}, over {n} scenarios; cost, bound and gap are its"}
        if not solution.status.has_path:
            return lines
        costs = [figure(cost, 6) for cost in solution.costs[:MOST_COSTS].tolist()]
        lines |= {
            "expected cost": figure(solution.expected_cost, 9) + unit,
            "worst cost": figure(solution.worst_cost, 9) + unit,
            "in scenarios": ", ".join(costs) + (", … (all: --json)" if n > MOST_COSTS else "") + unit,
        }
        if solution.weighted_bound < solution.lower_bound:
            known = rounded_down(solution.weighted_bound, 9)
            lines["duality gap"] = (
                f"{_part(solution.duality_gap)}: weighted sums prove {known}{unit}, the rest is proven by places"
            )
        elif solution.duality_gap > 0.0:
            lines["duality gap"] = f"about {_part(solution.duality_gap)}, which weighted sums cannot close"
        if self.options.exceeds is not None:
            chance = _part(solution.chance_above(self.options.exceeds))
            lines["exceeds"] = f"{self.options.exceeds:g}{unit} with probability {chance}"
        held = told.get("held_out")
        if held:
            low, high = held["interval"]
            high_text = "no upper limit" if high is None else f"{figure(high, 6)}"
            lines["held out"] = (
                f"{figure(held['cost'], 6)}{unit} in {held['samples']} other samples, {figure(low, 6)} to {high_text} "
                "at 95 % (bootstrap); the bound is of the planned samples"
            )
            if "chance_above" in held:
                chance, least, most = map(_part, held["chance_above"])
                lines["exceeds"] += f"; in other samples {chance}, {least} to {most}"
        return lines


def compare_uncertain(
    options: UncertainOptions, scenarios: Sequence[Scenario], entrants: Sequence[Entrant], proof: ProofOptions
) -> list[list[Run]]:
    """
    Compare solvers under uncertain risk, on each map, by `cgla_graph.comparisons.study.under_objective.runs_under`.

    Raises
    ------
    CglaError
        If scenarios are missing, or an option is malformed or does not go with them.
    """
    texts = [None] if options.alpha is None else options.alpha.split(",")
    asked = [read_uncertain(dataclasses.replace(options, alpha=text), {}) for text in texts]
    alphas = [None if text is None else share_of(text, "--alpha") for text in texts]
    tolerance = read_tolerance(proof.tolerance, certify=not proof.no_certificate, default=WANTED)
    objective: Any = options.objective
    on = [asked[0].on(scenario) for scenario in scenarios]
    with console.running_solvers([one.problem.model for one in on]):
        return [runs_under(one, entrants, objective, alphas, tolerance=tolerance) for one in on]


def outlook_of(run: Run, options: UncertainOptions) -> dict[str, Any]:
    """Return the numbers of a run over all scenarios as JSON."""
    return _of(run).outlook(options.exceeds)


def uncertain_table(runs: Sequence[Run]) -> FittedTable:
    """
    Show the answers of solvers under uncertain risk, a line each.

    Examples
    --------
    >>> import numpy as np
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> solution = UncertainSolution(Status.FOUND, cost=2.0, lower_bound=1.9, costs=np.array([1.0, 2.0]))
    >>> solution = dataclasses.replace(solution, probabilities=(0.5, 0.5), objective="worst", alpha=1.0)
    >>> run = Run(load_scenario("paper"), "mine", None, exact=False, solution=solution)
    >>> uncertain_table([run]).rows
    [['mine', '2.00000', '+5.27 %', '1.50000', '2.00000', '0.00']]
    """
    rows: list[Sequence[str]] = []
    for run in runs:
        one = _of(run)
        numbers = [one.cost, one.expected_cost, one.worst_cost]
        cost, *others = [figure(number, 6) for number in numbers] if one.status.has_path else [one.status.label, "", ""]
        rows.append([run.solver, cost, percent(one.gap), *others, f"{one.total_seconds:.2f}"])
    first = _of(runs[0])
    what = f"{first.objective} cost over {len(first.probabilities)} scenarios"
    note = "gap: of the cost to a bound that no path undercuts, the same for all solvers"
    heads = ("cost", "gap", "expected", "worst", "seconds")
    return FittedTable(f"{runs[0].on_map.full_title}: {what}", ("solver",), heads, ("seconds",), [note], rows)


def _part(share: float) -> str:
    """Return a part of a whole in percent."""
    return f"{100.0 * share:.3g} %"


def _of(run: Run) -> UncertainSolution:
    solution = run.solution
    if not isinstance(solution, UncertainSolution):
        msg = "the answer has no scenarios"
        raise CglaError(msg)
    return solution


def read_uncertain(options: UncertainOptions, others: Mapping[str, object], *, is_default: bool = True) -> Uncertain:
    """
    Check the options of uncertain risk.

    Parameters
    ----------
    options
        At least one is given.
    others
        Options that do not go with them, by name, with their values; None or False where one is not given.

    is_default
        Whether no tolerance was given.

    Raises
    ------
    CglaError
        If scenarios are missing, the objective is none, or another option does not go with them.

    Examples
    --------
    >>> read_uncertain(UncertainOptions(risk_scenarios=["two.toml"]), {}).options.objective
    'expected'
    """
    if not options.risk_scenarios:
        msg = "--objective, --alpha and --exceeds are for uncertain risk; give its scenarios: --scenarios FILE"
        raise CglaError(msg)
    if options.objective not in get_args(Objective):
        msg = f"--objective is {options.objective}; give one of {', '.join(get_args(Objective))}"
        raise CglaError(msg)
    if options.alpha is not None and options.objective != "cvar":
        msg = f"--alpha is for --objective cvar, and the objective is {options.objective}; leave it out"
        raise CglaError(msg)
    if options.alpha is not None:
        share_of(options.alpha, "--alpha")
    if options.exceeds is not None:
        finite_number("--exceeds", options.exceeds)
    wrong = [name for name, value in others.items() if value]
    if wrong:
        msg = f"{wrong[0]} does not go with --scenarios, whose risk is uncertain; leave out one of the two"
        raise CglaError(msg)
    return Uncertain(options, is_default)
