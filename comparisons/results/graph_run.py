"""The commands `plan` and `compare` on the file of a graph: solvers between its nodes, and their answers."""

import csv
import io
import math
import statistics
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from scipy import sparse

from cgla_graph._text import counted, duration, figure, json_number, percent
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.study import options, runner
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.rows import excess_over
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.model.adjacency import Node, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution, refuted
from cgla_graph.scenarios.graph_file import GraphFile, read_graph
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import solve

#: Of longer paths, the table shows the first and the last nodes.
MOST_SHOWN = 7
#: Of the pairs of nodes that are drawn.
SEED = 1
#: The columns of files, a row a run.
COLUMNS = (
    *("solver", "from", "to", "status", "cost", "lower_bound", "claimed_bound", "length", "nodes"),
    *("seconds", "build_seconds", "evaluations", "message"),
)


@dataclass(frozen=True, eq=False)
class GraphRun:
    """
    Answers of solvers between nodes of a graph.

    Attributes
    ----------
    opened
        The file.
    problems
        The graph and two of its nodes each.
    solutions
        By the solver's label, one for each problem.
    """

    opened: GraphFile
    problems: list[GraphProblem]
    solutions: dict[str, list[Solution]]

    @property
    def all_found(self) -> bool:
        """Whether each solver found every path."""
        return all(solution.status.has_path for _, _, solution in self.single())

    def single(self) -> Iterator[tuple[str, GraphProblem, Solution]]:
        """Yield the runs one by one: the solver's label, the problem and the answer."""
        for label, answers in self.solutions.items():
            for problem, solution in zip(self.problems, answers, strict=True):
                yield label, problem, solution


def read_graph_entrants(text: str | None) -> list[Entrant]:
    """
    Read ``--solver`` or ``--solvers`` for a graph; None for all that plan on one and are installed.

    Raises
    ------
    CglaError
        If one is wrong (see `options.read_entrants`), or plans in the plane.
    """
    on_graphs = [name for name in registry.names() if registry.traits(name).domain == "graph"]
    entrants = options.read_entrants(",".join(on_graphs) if text is None else text)
    for entrant in entrants:
        if registry.traits(entrant.name).domain != "graph":
            msg = f"{entrant.name} plans in the plane, not on a graph; on graphs plan {', '.join(on_graphs)}"
            raise CglaError(msg)
    return entrants


def open_problems(
    spec: str, source: str | None, target: str | None, pairs: int | None = None, *, weight: str | None, directed: bool
) -> tuple[GraphFile, list[GraphProblem]]:
    """
    Open a graph, and find the two nodes or draw pairs of them.

    Raises
    ------
    CglaError
        If the file is wrong, or a node is not named or not there.
    """
    if pairs is not None and (source is not None or target is not None):
        msg = "--pairs draws nodes; leave it out, or --from and --to"
        raise CglaError(msg)
    if pairs is None and (source is None or target is None):
        msg = f"{spec} is a graph: name two of its nodes, --from A --to B (compare: or --pairs N)"
        raise CglaError(msg)
    opened = read_graph(Path(spec), weight=weight, directed=directed)
    graph, n = opened.graph(), len(opened.labels)
    if source is not None and target is not None:
        return opened, [GraphProblem(graph, opened.node(source), opened.node(target))]
    if n == 1:
        msg = f"{spec} has a single node; there are no pairs to draw"
        raise CglaError(msg)
    rng = np.random.default_rng(SEED)
    drawn = (rng.choice(n, 2, replace=False).tolist() for _ in range(pairs or 0))
    return opened, [GraphProblem(graph, opened.labels[i], opened.labels[j]) for i, j in drawn]


def plan_all(opened: GraphFile, problems: Sequence[GraphProblem], entrants: Sequence[Entrant]) -> GraphRun:
    """Run every solver on every problem; exceptions become answers."""
    small = GeometricGraph.from_sparse(sparse.csr_array([[0.0, 1.0], [1.0, 0.0]]), directed=opened.directed)
    for entrant in entrants:
        # compiles kernels, and imports packages, before anything is timed
        _answer(GraphProblem(small, 0, 1), entrant)
    answers = {entrant.label: [_answer(problem, entrant) for problem in problems] for entrant in entrants}
    for place in range(len(problems)):
        cheapest = min(answers, key=lambda label, at=place: answers[label][at].cost)  # type: ignore[misc]
        for given in answers.values():
            given[place] = refuted(given[place], answers[cheapest][place].cost, f"that of {cheapest}")
    return GraphRun(opened, list(problems), answers)


def _answer(problem: GraphProblem, entrant: Entrant) -> Solution:
    (seed,) = runner.seeds_of(None, entrant, [1])
    settings = entrant.settings_on(None) | ({} if seed is None else {"seed": seed})
    return runner.answer_of(entrant, lambda: solve(problem, registry.get(entrant.name, **settings)))


def graph_title(opened: GraphFile) -> str:
    """Describe a graph in a few words."""
    kind = "directed" if opened.directed else "undirected"
    return f"{opened.file.name}: {counted(len(opened.labels), 'node')}, {counted(opened.n_edges, 'edge')}, {kind}"


def shortened(nodes: Sequence[Node]) -> str:
    """
    Write a path, the middle of a long one left out.

    Examples
    --------
    >>> shortened("ab"), shortened(range(9))
    ('a → b', '0 → 1 → 2 → … → 6 → 7 → 8')
    """
    words = [label_text(node) for node in nodes]
    return " → ".join(words if len(words) <= MOST_SHOWN else [*words[:3], "…", *words[-3:]])


def print_graph_run(run: GraphRun) -> None:
    """Print a table with a row for each solver: its path between one pair of nodes, or totals over several pairs."""
    # where the file gives the weights, nothing is evaluated
    counts = ("evaluations",) if any(solution.evaluations for _, _, solution in run.single()) else ()
    table = _one_pair(run, counts) if len(run.problems) == 1 else _many_pairs(run, counts)
    console.out_table(table)


def _one_pair(run: GraphRun, counts: Sequence[str]) -> FittedTable:
    (problem,) = run.problems
    table = FittedTable(
        f"{graph_title(run.opened)}; from {label_text(problem.source)} to {label_text(problem.target)}",
        ("solver", "status", "path"),
        ("nodes", "cost", "time", "build", *counts),
        spare=(*counts, "build", "path"),
    )
    for label, _, solution in run.single():
        has_path = solution.status.has_path
        path = (shortened(solution.nodes), f"{len(solution.nodes):,}") if has_path else ("-", "-")
        times = (duration(solution.seconds), duration(solution.build_seconds))
        row = (label, solution.status.label, *path, figure(solution.cost, 9), *times)
        table.rows.append([*row, *(f"{solution.evaluations:,}" for _ in counts)])
    table.notes = [
        *(f"{label}: {one.message or one.status.value}" for label, _, one in run.single() if not one.status.has_path),
        *(
            f"claimed by {label}, not proven: no path costs less than {figure(one.claimed_bound, 9)}"
            for label, _, one in run.single()
            if math.isfinite(one.claimed_bound)
        ),
    ]
    return table


def _many_pairs(run: GraphRun, counts: Sequence[str]) -> FittedTable:
    table = FittedTable(
        f"{graph_title(run.opened)}; {len(run.problems):,} pairs of nodes",
        ("solver",),
        ("paths", "excess", "time", "build", *counts),
        spare=(*counts, "build"),
        notes=["excess: at most, above the cheapest path of a pair; times: medians"],
    )
    least = [min(answers, key=lambda one: one.cost).cost for answers in zip(*run.solutions.values(), strict=True)]
    for label, answers in run.solutions.items():
        found = [(one.cost, best) for one, best in zip(answers, least, strict=True) if one.status.has_path]
        excess = max((excess_over(cost, best) for cost, best in found), default=math.nan)
        times = [
            statistics.median(times) for times in zip(*((a.seconds, a.build_seconds) for a in answers), strict=True)
        ]
        row = (label, f"{len(found):,}", percent(excess), *map(duration, times))
        table.rows.append([*row, *(f"{sum(one.evaluations for one in answers):,}" for _ in counts)])
    return table


def graph_run_document(run: GraphRun) -> dict[str, Any]:
    """Return the answers as JSON; nodes are the texts of their labels."""
    return {
        "graph": graph_document(run.opened),
        "runs": [
            {**row, "path": [str(node) for node in solution.nodes]}
            for row, (_, _, solution) in zip(_rows(run), run.single(), strict=True)
        ],
    }


def _rows(run: GraphRun) -> list[dict[str, Any]]:
    """Return a row for each run; its keys are `COLUMNS`."""
    return [
        {
            "solver": label,
            "from": str(problem.source),
            "to": str(problem.target),
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
        }
        for label, problem, solution in run.single()
    ]


def graph_document(opened: GraphFile) -> dict[str, Any]:
    """Describe a graph as JSON."""
    return {
        "file": str(opened.file),
        "nodes": len(opened.labels),
        "edges": opened.n_edges,
        "directed": opened.directed,
    }


def write_graph_run(folder: Path, run: GraphRun) -> list[Path]:
    """Write each path between two nodes, or of several pairs a row for each run, as CSV (errors as `write_text`)."""
    name, taken = run.opened.file.stem, set[str]()
    if len(run.problems) != 1:
        path = folder / f"{files.file_stem(f'{name}-rows', taken)}.csv"
        return [files.write_text(path, files.csv_text(_rows(run), COLUMNS))]
    return [
        files.write_text(
            folder / f"{files.file_stem(f'{name}-{label}', taken)}.csv", _path_csv(problem.graph, solution)
        )
        for label, problem, solution in run.single()
        if solution.status.has_path
    ]


def _path_csv(graph: GeometricGraph, solution: Solution) -> str:
    """Write a node a line, with its place where the graph has places."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    places: Sequence[Sequence[float]] = [[]] * len(solution.nodes)
    if graph.positions is not None:
        places = graph.positions[[graph.index_of(node) for node in solution.nodes]].tolist()
    writer.writerow(["node", "x", "y"] if graph.positions is not None else ["node"])
    writer.writerows([str(node), *place] for node, place in zip(solution.nodes, places, strict=True))
    return text.getvalue()
