"""The commands `graph plan`, `graph compare` and `graph check`, which read the file of a graph."""

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import completion
from cgla_graph.comparisons.cli.options import GraphArg, GraphOptions, JsonOption, OutOption, SolversOption, option

if TYPE_CHECKING:
    from cgla_graph.comparisons.results.graph_run import GraphRun

FromOption = Annotated[str | None, option("--from A", "the node to start at")]
ToOption = Annotated[str | None, option("--to B", "the node to get to")]


def plan(
    graph: GraphArg,
    options: GraphOptions,
    source: FromOption = None,
    target: ToOption = None,
    solver: Annotated[
        str, option("--solver A,B", "one or more, with settings as NAME:A=1:B=2", autocompletion=completion.solvers)
    ] = "cgla",
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Plan between two nodes of a graph.

    Prints the path that each solver finds; with --out, writes its nodes as CSV. Exits with 1 if there is no path.
    """
    run = _planned(graph, options, solver, source, target)
    _answer(run, out, as_json=as_json)
    if not run.all_found:
        raise typer.Exit(console.MISSING)


def compare(
    graph: GraphArg,
    options: GraphOptions,
    source: FromOption = None,
    target: ToOption = None,
    pairs: Annotated[int | None, option("--pairs N", "draw N pairs of nodes instead", min=1)] = None,
    solvers: SolversOption = None,
    strict: Annotated[bool, option("--strict", "exit with 1 if a run has no path")] = False,
    out: OutOption = None,
    as_json: JsonOption = False,
) -> None:
    """
    Compare solvers between two nodes of a graph, or many pairs of them.

    Runs are made one after the other, in this process. With --out, writes each path, or for several pairs one row per
    run.
    """
    run = _planned(graph, options, solvers, source, target, pairs)
    _answer(run, out, as_json=as_json)
    if strict and not run.all_found:
        raise typer.Exit(console.MISSING)


def _planned(
    graph: str,
    options: GraphOptions,
    solvers: str | None,
    source: str | None,
    target: str | None,
    pairs: int | None = None,
) -> "GraphRun":
    """Open a graph, and run solvers on it."""
    from cgla_graph.comparisons.results import graph_run

    entrants = graph_run.read_graph_entrants(solvers)
    opened, problems = graph_run.open_problems(
        graph, source, target, pairs, weight=options.weight, directed=options.directed
    )
    with console.running_solvers():
        return graph_run.plan_all(opened, problems, entrants)


def _answer(run: "GraphRun", out: Path | None, *, as_json: bool) -> None:
    """Write and print the paths."""
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.results import graph_run

    written = graph_run.write_graph_run(files.make_folder(out), run) if out else []
    if as_json:
        console.out_json({**graph_run.graph_run_document(run), "files": [*map(str, written)]})
    else:
        graph_run.print_graph_run(run)
        console.out_files(written)


def check(
    graph: GraphArg,
    options: GraphOptions,
    target: Annotated[str, option("--target T", "the node whose costs-to-go are computed")],
    source: Annotated[str | None, option("--source S", "the node at which the search may stop (default: any)")] = None,
    strict: Annotated[
        bool, option("--strict", "exit with 1 if an assumption or statement of Theorem 1 does not hold")
    ] = False,
    as_json: JsonOption = False,
) -> None:
    """
    Check whether Theorem 1 holds on a graph of your own.

    Prints its assumptions (weights, paths to the target) and its statements, round by round of Eq. 9: Lemma 1, that n
    rounds give the least costs, that settled values stay, when the source enters Delta; and the ties in Delta.
    """
    from cgla_graph.comparisons.results.graph_run import graph_document, graph_title
    from cgla_graph.cost_to_go.theorem_1 import check_theorem_1
    from cgla_graph.model.adjacency import label_text
    from cgla_graph.scenarios.graph_file import read_graph

    with console.running_solvers():
        opened = read_graph(Path(graph), weight=options.weight, directed=options.directed)
        ends = opened.node(target), None if source is None else opened.node(source)
        checked = check_theorem_1(opened.graph(below_zero=True), *ends)
    if as_json:
        console.out_json({"graph": graph_document(opened), **checked.document()})
    else:
        said = "" if checked.source is None else f", source {label_text(checked.source)}"
        console.out(f"{graph_title(opened)}; target {label_text(checked.target)}{said}\n{checked}\n")
    if strict and not checked.all_hold:
        raise typer.Exit(console.MISSING)
