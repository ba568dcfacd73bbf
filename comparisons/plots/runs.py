"""Pictures of runs: which run of each solver is drawn, and how it is labelled."""

from collections.abc import Collection, Sequence

from matplotlib.figure import Figure

from cgla_graph.comparisons.study.mission_run import MissionRun
from cgla_graph.comparisons.study.rows import by_solver, median_run, scenario_bound, seeds_note, summaries
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.certificate import proof_of
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution
from cgla_graph.plots.certificate import certificate_figure
from cgla_graph.plots.flight import LabelledFlight
from cgla_graph.plots.graph import graph_figure
from cgla_graph.plots.looks import LabelledPath, labelled_paths
from cgla_graph.plots.map import map_figure
from cgla_graph.plots.scene import TitledProblem
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario


def paths_of(runs: Sequence[Run], named: Collection[str] = ()) -> list[LabelledPath]:
    """
    Label the median run of each solver (see `median_run`), the best first, as in the table (see `summaries`).

    Parameters
    ----------
    runs
        The runs of one scenario, in any order.
    named
        Labels of solvers that stand out in any case (see `labelled_paths`).

    Examples
    --------
    >>> from cgla_graph.comparisons.study.entrant import Entrant
    >>> from cgla_graph.comparisons.study.runner import compare
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Entrant.parse("straight-line"), Entrant.parse("cgla")])
    >>> [(path.label, path.colour) for path in paths_of(list(runs))]
    [('cgla', '#E69F00'), ('straight-line', '#0072B2')]
    """
    groups = by_solver(runs)
    found = {label: sum(run.solution.status.has_path for run in group) for label, group in groups.items()}
    return labelled_paths(
        {label: median_run(group).solution for label, group in groups.items()},
        [summary.solver for summary in summaries(runs)],
        named,
        {label: seeds_note(len(group), found[label]) for label, group in groups.items()},
    )


def weight_of_risk(problem: Problem | GraphProblem) -> float | None:
    """Return k; None on a graph whose weights were given."""
    if isinstance(problem, Problem):
        return problem.k
    return None if problem.graph.model is None else problem.graph.model.k


def map_of_runs(runs: Sequence[Run], named: Collection[str] = ()) -> Figure:
    """Draw the map of one scenario with the path of every solver."""
    return map_figure(TitledProblem.of(runs[0].on_map), paths_of(runs, named), scenario_bound(runs))


def map_by_alpha(runs: Sequence[Run]) -> Figure:
    """Draw the cheapest path for each alpha of CVaR; of a single one, the path of every solver."""
    answers = [(getattr(run.solution, "alpha", 0.0), run.solution) for run in runs]
    best: dict[str, Solution] = {}
    for alpha, one in sorted(answers, key=lambda pair: (pair[0], not pair[1].status.has_path, pair[1].cost)):
        best.setdefault(f"alpha {alpha:g}", one)
    if len(best) == 1:
        return map_of_runs(runs)
    return map_figure(TitledProblem.of(runs[0].on_map), labelled_paths(best, list(best), best))


def picture_of_runs(runs: Sequence[Run], named: Collection[str] = ()) -> Figure | None:
    """Draw the map, or the graph, of one scenario with the path of every solver; None without positions of nodes."""
    scenario = runs[0].scenario
    if isinstance(scenario, GraphScenario):
        if scenario.problem.graph.positions is None:
            return None
        return graph_figure(scenario.name, scenario.title, scenario.problem, paths_of(runs, named))
    return map_of_runs(runs, named)


def certificate_of_run(run: Run) -> Figure:
    """Draw the certificate of a run, and its path; without a solver, the bound alone."""
    paths = paths_of([run]) if run.solver else []
    return certificate_figure(TitledProblem.of(run.on_map), proof_of(run), paths)


def labelled_flight(run: MissionRun) -> LabelledFlight:
    """Label a flight by its mission and variant."""
    return LabelledFlight(run.flight, run.name, run.variant, run.title, run.projection)
