"""The command `graph plan`: solvers between two nodes of the file of a graph, and their paths."""

import csv
import io
import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgla_graph._text import counted, duration, figure, json_number
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.report.graphs import shortened
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run, compare
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.graphs.graph_file import GraphFile
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario


@dataclass(frozen=True, eq=False)
class GraphRun:
    """
    Answers of solvers between two nodes of a graph.

    Attributes
    ----------
    opened, scenario
        The file, and the graph with its two nodes.
    runs
        One for each solver.
    """

    opened: GraphFile
    scenario: GraphScenario
    runs: list[Run]

    @property
    def all_found(self) -> bool:
        """Whether each solver found a path."""
        return all(run.solution.status.has_path for run in self.runs)


def plan_on_graph(opened: GraphFile, scenario: GraphScenario, entrants: Sequence[Entrant]) -> GraphRun:
    """
    Run every solver, in this process; exceptions become answers.

    Raises
    ------
    StudyError
        If a solver plans in the plane.
    """
    return GraphRun(opened, scenario, list(compare([scenario], entrants, 1, tolerance=None)))


def graph_title(opened: GraphFile) -> str:
    """Describe a graph in a few words."""
    kind = "directed" if opened.directed else "undirected"
    return f"{opened.file.name}: {counted(len(opened.labels), 'node')}, {counted(opened.n_edges, 'edge')}, {kind}"


def print_graph_run(run: GraphRun) -> None:
    """Print a table with a row for each solver: its path."""
    # where the file gives the weights, nothing is evaluated
    counts = ("evaluations",) if any(one.solution.evaluations for one in run.runs) else ()
    source, target = run.scenario.ends
    table = FittedTable(
        f"{graph_title(run.opened)}; from {source} to {target}",
        ("solver", "status", "path"),
        ("nodes", "cost", "time", "build", *counts),
        spare=(*counts, "build", "path"),
    )
    for one in run.runs:
        solution = one.solution
        has_path = solution.status.has_path
        path = (shortened(solution.nodes), f"{len(solution.nodes):,}") if has_path else ("-", "-")
        times = (duration(solution.seconds), duration(solution.build_seconds))
        row = (one.solver, solution.status.label, *path, figure(solution.cost, 9), *times)
        table.rows.append([*row, *(f"{solution.evaluations:,}" for _ in counts)])
    answers = [(one.solver, one.solution) for one in run.runs]
    table.notes = [
        *(f"{label}: {one.message or one.status.value}" for label, one in answers if not one.status.has_path),
        *(
            f"claimed by {label}, not proven: no path costs less than {figure(one.claimed_bound, 9)}"
            for label, one in answers
            if math.isfinite(one.claimed_bound)
        ),
    ]
    console.out_table(table)


def graph_run_document(run: GraphRun) -> dict[str, Any]:
    """Return the answers as JSON; nodes are the texts of their labels."""
    return {"graph": graph_document(run.opened), "runs": [_document(run.scenario, one) for one in run.runs]}


def _document(scenario: GraphScenario, run: Run) -> dict[str, Any]:
    solution = run.solution
    return {
        "solver": run.solver,
        "from": str(scenario.problem.source),
        "to": str(scenario.problem.target),
        "status": solution.status.label,
        "cost": json_number(solution.cost),
        "lower_bound": json_number(solution.lower_bound),
        "claimed_bound": json_number(solution.claimed_bound),
        "length": json_number(solution.length),
        "nodes": len(solution.nodes) if solution.status.has_path else None,
        "seconds": solution.seconds,
        "build_seconds": solution.build_seconds,
        "evaluations": solution.evaluations,
        "message": solution.message,
        "path": [str(node) for node in solution.nodes],
    }


def graph_document(opened: GraphFile) -> dict[str, Any]:
    """Describe a graph as JSON."""
    return {
        "file": str(opened.file),
        "nodes": len(opened.labels),
        "edges": opened.n_edges,
        "directed": opened.directed,
    }


def write_graph_run(folder: Path, run: GraphRun) -> list[Path]:
    """Write each path as CSV (errors as `write_text`)."""
    name, taken = run.opened.file.stem, set[str]()
    return [
        files.write_text(
            folder / f"{files.file_stem(f'{name}-{one.solver}', taken)}.csv", _path_csv(run.scenario, one.solution)
        )
        for one in run.runs
        if one.solution.status.has_path
    ]


def _path_csv(scenario: GraphScenario, solution: Solution) -> str:
    """Write a node a line, with its place where the graph has places."""
    graph = scenario.problem.graph
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    places: Sequence[Sequence[float]] = [[]] * len(solution.nodes)
    if graph.positions is not None:
        places = graph.positions[[graph.index_of(node) for node in solution.nodes]].tolist()
    writer.writerow(["node", "x", "y"] if graph.positions is not None else ["node"])
    writer.writerows([str(node), *place] for node, place in zip(solution.nodes, places, strict=True))
    return text.getvalue()
