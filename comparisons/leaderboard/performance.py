"""Performance of one solver on one scenario over its seeds: success rate, times to targets, cost."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from cgla_graph._text import json_number
from cgla_graph.comparisons.statistics.intervals import (
    Estimate,
    Interval,
    estimate,
    path_cost,
    success_interval,
    to_target,
)
from cgla_graph.comparisons.study.rows import by_solver, scenario_bound
from cgla_graph.comparisons.study.runner import Run

#: Targets besides the first path: gaps over the scenario's lower bound, in percent.
TARGET_PERCENTS = (10, 5, 1)
TARGETS = ("first", *(f"{percent}_percent" for percent in TARGET_PERCENTS))
_ENDS = ("", "_low", "_high")
#: The columns of files, in order.
PERFORMANCE_COLUMNS = (
    *("scenario", "solver", "runs", "paths", "success", "success_low", "success_high", "lower_bound"),
    *(f"cost{end}" for end in _ENDS),
    *(f"seconds_to_{target}{end}" for target in TARGETS for end in _ENDS),
    *(f"evaluations_to_{target}{end}" for target in TARGETS for end in _ENDS),
)


@dataclass(frozen=True)
class Performance:
    """
    One solver's runs on one scenario.

    Attributes
    ----------
    scenario, solver
        Name and label.
    n_runs, n_paths
        Number of runs, and of those that found a feasible path.
    n_answers, success
        Number of runs with a path, or that say rightly that there is none (`Run.has_answer`), and the 95 % interval of
        that rate.
    lower_bound
        That of the scenario, to which gaps are relative; NaN without one.
    cost
        Median cost; a run without a path has infinite cost.
    seconds, evaluations
        Medians of the effort to reach each of `TARGETS`, the time to build the graph included; infinite if never
        reached, NaN without a lower bound.
    """

    scenario: str
    solver: str
    n_runs: int
    n_paths: int
    n_answers: int
    success: Interval
    lower_bound: float
    cost: Estimate
    seconds: tuple[Estimate, ...]
    evaluations: tuple[Estimate, ...]

    def document(self) -> dict[str, Any]:
        """
        Return a flat row for files: one value for each of `PERFORMANCE_COLUMNS`, None for NaN and infinity.

        Of a median, None is "never" (or "unknown" without a lower bound); of the ends of an interval it is "no end".
        """
        values = [
            self.scenario,
            self.solver,
            self.n_runs,
            self.n_paths,
            self.n_answers / self.n_runs,
            *self.success,
            json_number(self.lower_bound),
        ]
        for one in (self.cost, *self.seconds, *self.evaluations):
            values += [json_number(end) for end in one]
        return dict(zip(PERFORMANCE_COLUMNS, values, strict=True))


def performances(runs: Sequence[Run]) -> list[Performance]:
    """
    Measure the solvers of one scenario, in the order of their first runs.

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Entrant.parse("straight-line")], tolerance=None)
    >>> [(one.solver, one.n_paths, round(one.cost.median, 3)) for one in performances(list(runs))]
    [('straight-line', 1, 3.921)]
    """
    bound = scenario_bound(runs)
    return [_performance(group, bound) for group in by_solver(runs).values()]


def _performance(runs: Sequence[Run], bound: float) -> Performance:
    solutions = [run.solution for run in runs]
    n_answers = sum(run.has_answer for run in runs)
    targets = [math.inf, *((1.0 + percent / 100.0) * bound for percent in TARGET_PERCENTS)]
    hits = [[to_target(solution, target) for solution in solutions] for target in targets]
    return Performance(
        scenario=runs[0].scenario.name,
        solver=runs[0].solver,
        n_runs=len(runs),
        n_paths=sum(solution.status.has_path for solution in solutions),
        n_answers=n_answers,
        success=success_interval(n_answers, len(runs)),
        lower_bound=bound,
        cost=estimate([path_cost(solution) for solution in solutions]),
        seconds=tuple(estimate([hit.seconds for hit in group]) for group in hits),
        evaluations=tuple(estimate([hit.evaluations for hit in group]) for group in hits),
    )
