"""Plans under uncertain risk: ``cgla plan --scenarios FILE --objective cvar``."""

import dataclasses
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, get_args

from cgla_graph._text import figure, rounded_down
from cgla_graph.comparisons.cli.options import UncertainOptions
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError
from cgla_graph.scenarios.risk_scenarios import read_scenarios
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.solving import solve
from cgla_graph.solvers.uncertain.outlook import Objective, UncertainSolution

#: The gap that a proof over scenarios aims at where none is given.
WANTED = 0.01
#: Costs of scenarios that are printed; all are in the JSON.
MOST_COSTS = 12


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
        field = read_scenarios(self.options.scenarios or (), scenario.problem)
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
            alpha=self.options.alpha,
            **settings,
        )
        return Run(scenario, entrant.label, None, exact=False, solution=solution)

    def document(self, run: Run) -> dict[str, Any]:
        """Return the numbers over all scenarios as JSON."""
        return _of(run).outlook(self.options.exceeds)

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
    >>> read_uncertain(UncertainOptions(scenarios=["two.toml"]), {}).options.objective
    'expected'
    """
    if not options.scenarios:
        msg = "--objective, --alpha and --exceeds are for uncertain risk; give its scenarios: --scenarios FILE"
        raise CglaError(msg)
    if options.objective not in get_args(Objective):
        msg = f"--objective is {options.objective}; give one of {', '.join(get_args(Objective))}"
        raise CglaError(msg)
    if options.alpha is not None and options.objective != "cvar":
        msg = f"--alpha is for --objective cvar, and the objective is {options.objective}; leave it out"
        raise CglaError(msg)
    wrong = [name for name, value in others.items() if value]
    if wrong:
        msg = f"{wrong[0]} does not go with --scenarios, whose risk is uncertain; leave out one of the two"
        raise CglaError(msg)
    return Uncertain(options, is_default)
