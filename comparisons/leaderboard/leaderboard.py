"""The leaderboard: ranks of solvers, effects with their confidence, and where each solver fails."""

import math
import re
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cgla_graph._validate import number_array
from cgla_graph.comparisons.leaderboard.profiles import (
    able,
    finite_bound,
    instance_costs,
    instance_times,
    shared_scenarios,
)
from cgla_graph.comparisons.statistics.distributions import average_ranks
from cgla_graph.comparisons.statistics.intervals import Estimate, Interval, estimate, success_interval
from cgla_graph.comparisons.statistics.paired import Paired, against, same_cost
from cgla_graph.comparisons.statistics.ranking import ranking
from cgla_graph.comparisons.study.metric import Measure
from cgla_graph.comparisons.study.rows import by_solver, excess_over, median_run
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Status

#: Numbers in a message, which a pattern replaces.
_NUMBER, _ANY = re.compile(r"\d[\d.e+-]*"), "#"


@dataclass(frozen=True, eq=False)
class FailureGroup:
    """
    Runs of one solver that failed in the same way, with messages that differ by numbers only.

    Attributes
    ----------
    solver
        Label.
    status
        Their status.
    runs
        At least one, in order.
    """

    solver: str
    status: Status
    runs: tuple[Run, ...]

    @property
    def message(self) -> str:
        """The message of the first run, in one line."""
        return " ".join(str(self.runs[0].solution.message).split())

    @property
    def scenarios(self) -> list[str]:
        """Names, each once, in order."""
        return list(dict.fromkeys(run.scenario.name for run in self.runs))


def failed(runs: Iterable[Run]) -> list[Run]:
    """
    List the runs without a feasible path, except those that say so where it is proven that there is none.

    Examples
    --------
    >>> failed([])
    []
    """
    return [run for run in runs if not run.has_answer]


def failure_groups(runs: Iterable[Run]) -> list[FailureGroup]:
    """
    Group the failed runs by solver, status and message, in the order of their first runs.

    Examples
    --------
    >>> failure_groups([])
    []
    """
    groups: dict[tuple[str, Status, str], list[Run]] = {}
    for run in failed(runs):
        pattern = _NUMBER.sub(_ANY, str(run.solution.message))
        groups.setdefault((run.solver, run.solution.status, pattern), []).append(run)
    return [FailureGroup(solver, status, tuple(group)) for (solver, status, _), group in groups.items()]


#: A path this close to the lower bound, in percent, counts as near the optimum.
NEAR_PERCENT = 5
_UNKNOWN = Estimate(math.nan, math.nan, math.nan)


@dataclass(frozen=True)
class MetricStanding:
    """
    One solver by a metric, over the scenarios that every solver has run.

    Attributes
    ----------
    measure
        Name, unit and direction of the metric; its value is NaN.
    estimate
        Median over the scenarios, each by the solver's median run.
    average_rank
        Mean of its rank by the metric; without a value it ranks last. NaN where no solver has a value.
    n_missing
        Number of the solver's paths, on all scenarios, without a value of the metric.
    """

    measure: Measure
    estimate: Estimate
    average_rank: float
    n_missing: int = 0


@dataclass(frozen=True)
class LeaderboardRow:
    """
    One solver among the others, over all scenarios.

    A scenario counts once, by the median of its seeds, and only if every solver has run it (see `instance_costs`);
    `n_runs`, `n_paths`, `n_answers`, `success`, `failures` and `failed_on` count all runs.

    Attributes
    ----------
    solver
        Label.
    place
        From 1; solvers of equal average rank share a place.
    average_rank
        Mean over the scenarios of its rank among the solvers; NaN if no scenario has been run by all.
    n_instances, wins
        Numbers of scenarios that count, and of those on which its path is the cheapest or ties for it.
    gap
        Median over the scenarios of its excess over the lower bound; infinite without a path, NaN if no scenario has a
        finite bound.
    n_runs, n_paths
        Number of runs, and of those with a path.
    n_answers, success
        Number of runs with a path, or that say rightly that there is none (`Run.has_answer`), and the 95 % interval of
        that rate by Clopper and Pearson, which assumes independent runs.
    seconds_to_near
        Median over the scenarios of the time until its cost was within `NEAR_PERCENT` of the lower bound; infinite if
        never, NaN as `gap`.
    versus_best
        Its costs against those of the solver ranked first, with p-values adjusted because the same costs chose that
        solver (see `against`); None for that solver, or without scenarios.
    failures
        Number of failed runs (see `failed`) by status, the most frequent first.
    failed_on
        Names of the scenarios on which runs failed, and the number of failures, in order.
    metrics
        Its standing by each metric.
    """

    solver: str
    place: int
    average_rank: float
    n_instances: int
    wins: int
    gap: Estimate
    n_runs: int
    n_paths: int
    n_answers: int
    success: Interval
    seconds_to_near: Estimate
    versus_best: Paired | None
    failures: Mapping[Status, int]
    failed_on: Mapping[str, int]
    metrics: Sequence[MetricStanding] = ()


def leaderboard_of(runs: Sequence[Run]) -> list[LeaderboardRow]:
    """
    Rank the solvers of a comparison, best first.

    Solvers of equal average rank are ordered by the median gap, then by the time to get near the bound.

    Parameters
    ----------
    runs
        Of any scenarios and solvers, finished or not. Solvers that could not run, as without a package, have no row.

    Returns
    -------
    leaderboard
        One row a solver; empty without runs.

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = list(compare([load_scenario("paper")], [Entrant.parse(name) for name in ("straight-line", "cgla")]))
    >>> [(one.solver, one.average_rank, one.wins) for one in leaderboard_of(runs)]
    [('cgla', 1.0, 1), ('straight-line', 2.0, 0)]
    """
    runs = able(runs)
    by_label = by_solver(runs)
    costs = instance_costs(runs)
    ranks = ranking(costs)
    wins = _wins(costs)
    gaps = _gaps(runs)
    times = {solver: _estimate(values) for solver, values in instance_times(runs, NEAR_PERCENT).items()}
    metrics = _by_metric(runs)
    rank_of = dict(zip(ranks.solvers, ranks.average_ranks, strict=True))

    def merit(solver: str) -> tuple[float, float, float]:
        # an unknown value makes the median unknown
        rank, gap, seconds = rank_of[solver], gaps[solver].median, times[solver].median
        return _or_zero(rank), _or_zero(gap), _or_zero(seconds)

    order = sorted(by_label, key=merit)
    versus = {one.solver: one for one in against(costs, order[0])} if order else {}
    places = [1 + sum(merit(other)[0] < merit(solver)[0] for other in order) for solver in order]
    return [
        LeaderboardRow(
            solver=solver,
            place=place,
            average_rank=rank_of[solver],
            n_instances=ranks.n_instances,
            wins=wins[solver],
            gap=gaps[solver],
            n_runs=len(by_label[solver]),
            n_paths=sum(run.solution.status.has_path for run in by_label[solver]),
            n_answers=(n_answers := sum(run.has_answer for run in by_label[solver])),
            success=success_interval(n_answers, len(by_label[solver])),
            seconds_to_near=times[solver],
            versus_best=versus.get(solver),
            failures=dict(Counter(run.solution.status for run in failed(by_label[solver])).most_common()),
            failed_on=dict(Counter(run.scenario.name for run in failed(by_label[solver]))),
            metrics=metrics[solver],
        )
        for solver, place in zip(order, places, strict=True)
    ]


def _by_metric(runs: Sequence[Run]) -> dict[str, list[MetricStanding]]:
    """Return each solver's standing by each metric, of its median run on each scenario that counts."""
    known = {one.name: one._replace(value=math.nan) for run in runs for one in run.measures}
    groups = shared_scenarios(runs)
    found: dict[str, list[MetricStanding]] = {run.solver: [] for run in runs}
    for name, said in known.items():
        values = {
            solver: [median_run(group[solver]).measure(name) for group in groups if solver in group] for solver in found
        }
        table = np.array(list(values.values())) * (1.0 if said.better == "less" else -1.0)
        ranks = average_ranks(np.where(np.isnan(table), np.inf, table))
        for own, rank, solver in zip(values.values(), ranks, values, strict=True):
            finite = [one for one in own if not math.isnan(one)]
            average = float(rank.mean()) if len(rank) and not np.isnan(table).all() else math.nan
            paths = [run for run in runs if run.solver == solver and run.solution.status.has_path]
            missing = sum(math.isnan(run.measure(name)) for run in paths)
            found[solver].append(MetricStanding(said, _estimate(finite), average, missing))
    return found


def _wins(costs: Mapping[str, Sequence[float]]) -> dict[str, int]:
    """Count the scenarios on which a solver's path is the cheapest; without any path there is no winner."""
    table = {solver: number_array("costs", values) for solver, values in costs.items()}
    best = np.min(list(table.values()), axis=0) if table else np.empty(0)
    return {solver: int((same_cost(values, best) & np.isfinite(values)).sum()) for solver, values in table.items()}


def _gaps(runs: Sequence[Run]) -> dict[str, Estimate]:
    """Return the median over the scenarios of the gap of the median cost."""
    bounds = [finite_bound(group) for group in shared_scenarios(runs)]
    return {
        solver: _estimate([excess_over(cost, bound) for cost, bound in zip(costs, bounds, strict=True) if bound >= 0.0])
        for solver, costs in instance_costs(runs).items()
    }


def _estimate(values: Sequence[float]) -> Estimate:
    return estimate(values) if values else _UNKNOWN


def _or_zero(value: float) -> float:
    """Return a number to sort by, without differences from rounding."""
    return 0.0 if math.isnan(value) else round(value, 9)
