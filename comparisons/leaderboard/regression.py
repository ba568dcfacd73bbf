"""Regression: the same runs of two versions, side by side."""

import math
from collections.abc import Hashable, Iterable, Sequence
from dataclasses import dataclass, replace
from enum import Enum
from typing import NamedTuple

from cgla_graph.comparisons.statistics.intervals import SAME_COST, path_cost
from cgla_graph.comparisons.statistics.paired import Paired, compare_costs, holm
from cgla_graph.comparisons.study.documents import graph_text
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario

#: An adjusted p-value below this is a difference.
SIGNIFICANT = 0.05


class Verdict(Enum):
    """
    The verdict on two versions of a solver; the value is the sentence.

    Examples
    --------
    >>> Verdict.SAME.value
    'no difference is shown'
    """

    IDENTICAL = "every run costs the same as before"
    BETTER = "its paths are cheaper than before"
    WORSE = "its paths are more expensive than before"
    SAME = "no difference is shown"


class RunKey(NamedTuple):
    """The key that pairs runs: names of scenario and solver, and the seed."""

    scenario: str
    solver: str
    seed: int | None


@dataclass(frozen=True)
class Change:
    """
    One solver, new against old.

    Pairs of seeds count as independent. So the p-values test whether anything changed on these scenarios.
    Statements about other scenarios need many scenarios, not only many seeds.

    Attributes
    ----------
    solver
        Label.
    cost
        Cost of new over old, pair by pair (`Paired`, with the old version as reference): wins are runs that became
        cheaper; runs without a path have infinite cost.
    seconds
        The same for the time, building the graph included, infinite without a path. Times of different or busy machines
        differ without any change of the solver.
    verdict
        On the costs: different if the adjusted p-value is below `SIGNIFICANT`.
    settings_differ
        Whether some pair ran with different settings.
    """

    solver: str
    cost: Paired
    seconds: Paired
    verdict: Verdict
    settings_differ: bool

    @property
    def n(self) -> int:
        """Number of pairs."""
        return self.cost.n


@dataclass(frozen=True)
class Regression:
    """
    The pairs of runs of two lists, and the runs without a pair.

    Attributes
    ----------
    changes
        One for each solver with pairs, in the order of the new runs; p-values of costs and of times are each
        adjusted to all solvers.
    only_old, only_new
        Runs that only one list has.
    changed_scenarios
        Names of scenarios in both lists whose problems differ; their runs are not paired.
    """

    changes: tuple[Change, ...]
    only_old: tuple[RunKey, ...]
    only_new: tuple[RunKey, ...]
    changed_scenarios: tuple[str, ...]


def same_task(scenario: AnyScenario) -> Hashable:
    """
    Return the key by which runs are comparable: problem and lattice of a map; graph and nodes of a pair.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> same_task(load_scenario("paper")) == same_task(load_scenario("paper"))
    True
    """
    if isinstance(scenario, GraphScenario):
        return graph_text(scenario.problem.graph), scenario.problem.source, scenario.problem.target
    return scenario.problem, scenario.lattice


def regression(old: Iterable[Run], new: Iterable[Run]) -> Regression:
    """
    Compare two versions run by run: each with the one of the same scenario, solver and seed.

    Returns
    -------
    regression
        The changes, and the runs without a pair.

    Raises
    ------
    ValueError
        If a list has two runs of the same scenario, solver and seed.

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> old, new = (compare([load_scenario("paper")], [Entrant.parse("cgla")], tolerance=None) for _ in range(2))
    >>> [(change.solver, change.n, change.verdict.name) for change in regression(old, new).changes]
    [('cgla', 1, 'IDENTICAL')]
    """
    before, after = _by_key(old, "old"), _by_key(new, "new")
    pairs: dict[str, list[tuple[Run, Run]]] = {}
    same: dict[tuple[int, int], bool] = {}
    changed: dict[str, None] = {}
    for name, run in after.items():
        if name not in before:
            continue
        was = before[name]
        scenarios = id(was.scenario), id(run.scenario)
        if scenarios not in same:
            same[scenarios] = was.scenario is run.scenario or same_task(was.scenario) == same_task(run.scenario)
        if same[scenarios]:
            pairs.setdefault(run.solver, []).append((was, run))
        else:
            changed[run.scenario.name] = None
    found = [_change(solver, group) for solver, group in pairs.items()]
    return Regression(
        changes=tuple(_adjusted(found)),
        only_old=tuple(name for name in before if name not in after),
        only_new=tuple(name for name in after if name not in before),
        changed_scenarios=tuple(changed),
    )


def _by_key(runs: Iterable[Run], which: str) -> dict[RunKey, Run]:
    found: dict[RunKey, Run] = {}
    for run in runs:
        name = RunKey(run.scenario.name, run.solver, run.seed)
        if name in found:
            seed = "without a seed" if name.seed is None else f"with seed {name.seed}"
            msg = (
                f"the {which} runs have two of {name.solver!r} on {name.scenario!r} {seed}; "
                "give each scenario a name of its own, and each run once"
            )
            raise ValueError(msg)
        found[name] = run
    return found


def _change(solver: str, pairs: Sequence[tuple[Run, Run]]) -> Change:
    before, after = ([path_cost(run.solution) for run in runs] for runs in zip(*pairs, strict=True))
    cost = compare_costs(solver, after, "old", before)
    seconds_before, seconds_after = ([_seconds(run) for run in runs] for runs in zip(*pairs, strict=True))
    identical = all(math.isclose(a, b, rel_tol=SAME_COST) for a, b in zip(before, after, strict=True))
    return Change(
        solver=solver,
        cost=cost,
        seconds=compare_costs(solver, seconds_after, "old", seconds_before),
        verdict=Verdict.IDENTICAL if identical else Verdict.SAME,
        settings_differ=any(dict(was.settings) != dict(run.settings) for was, run in pairs),
    )


def _seconds(run: Run) -> float:
    return run.solution.total_seconds if run.solution.status.has_path else math.inf


def _adjusted(found: Sequence[Change]) -> list[Change]:
    """Adjust the p-values to all solvers, and judge by them."""
    costs = holm([change.cost.p for change in found])
    times = holm([change.seconds.p for change in found])
    return [
        replace(
            change,
            cost=replace(change.cost, p_holm=p_cost),
            seconds=replace(change.seconds, p_holm=p_seconds),
            verdict=_verdict(change, p_cost),
        )
        for change, p_cost, p_seconds in zip(found, costs, times, strict=True)
    ]


def _verdict(change: Change, p: float) -> Verdict:
    if change.verdict is Verdict.IDENTICAL or p >= SIGNIFICANT:
        return change.verdict
    return Verdict.BETTER if change.cost.effect < 0.0 else Verdict.WORSE
