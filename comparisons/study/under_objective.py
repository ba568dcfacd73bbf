"""Solvers side by side under uncertain risk: each under the same objectives, against one proven bound of each."""

import dataclasses
from collections.abc import Sequence
from typing import Any

from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers.solving import solve
from cgla_graph.solvers.uncertain.outlook import Objective
from cgla_graph.solvers.uncertain.under_objective import held_against


def runs_under(
    scenario: Scenario,
    entrants: Sequence[Entrant],
    objective: Objective = "expected",
    alphas: Sequence[float | None] = (None,),
    *,
    tolerance: float | None = 0.01,
) -> list[Run]:
    """
    Plan with each solver under an objective over the scenarios of a map's risk.

    Parameters
    ----------
    scenario
        The map; its field is an `UncertainField`.
    entrants
        The solvers.
    objective
        As `cgla_graph.solve` takes it.
    alphas
        For ``cvar``: one run of each solver for each of them, by which its label ends if there are several.
    tolerance
        The gap that the proofs aim at: one for each alpha, with `hybrid`; None: no proof.

    Returns
    -------
    runs
        By alpha, then in the order of the solvers; their solutions are `UncertainSolution`.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> field = cg.UncertainField([cg.RiskField([cg.Threat(0.5, y, 0.1)]) for y in (0.4, 0.6)])
    >>> problem = cg.Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0)
    >>> lattice = cg.Lattice(9, bounds=(0.1, 0.1, 0.9, 0.9))
    >>> scenario = dataclasses.replace(cg.load_scenario("paper"), problem=problem, lattice=lattice)
    >>> runs = runs_under(scenario, [Entrant.parse("hybrid"), Entrant.parse("cgla")], "worst", tolerance=0.05)
    >>> best, on_lattice = (run.solution for run in runs)
    >>> bool(best.lower_bound == on_lattice.lower_bound <= best.cost <= on_lattice.cost)
    True
    """
    runs = []
    problem: Problem = scenario.problem
    for alpha in alphas:
        ask: dict[str, Any] = {"objective": objective, "alpha": alpha}
        proof = None if tolerance is None else solve(problem, **ask, tolerance=tolerance)
        for entrant in entrants:
            if proof is not None and entrant == Entrant.parse("hybrid"):
                found: Any = proof
            else:
                how = {**entrant.settings_on(scenario), **ask, "tolerance": None}
                found = solve(problem, entrant.name, resolution=scenario.lattice, refine=entrant.refine, **how)
                found = found if proof is None else held_against(found, proof.lower_bound)
            label = entrant.label if len(alphas) == 1 else f"{entrant.label}, alpha {alpha:g}"
            runs.append(Run(scenario, label, None, exact=False, solution=dataclasses.replace(found, solver=label)))
    return runs
