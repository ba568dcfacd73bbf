"""The commands `graph plan`, `graph compare` and `graph check`, which read the file of a graph."""

from pathlib import Path
from typing import Annotated

import typer

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli import completion
from cgla_graph.comparisons.cli.compare import run_and_print, run_options
from cgla_graph.comparisons.cli.options import (
    ComparisonOptions,
    GraphArg,
    GraphOptions,
    GraphsArg,
    JsonOption,
    OutOption,
    ProofOptions,
    StudyOptions,
    option,
)

FromOption = Annotated[str | None, option("--from A", "the node to start at", "--source")]
ToOption = Annotated[str | None, option("--to B", "the node to get to", "--target")]


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
    from cgla_graph.comparisons import files
    from cgla_graph.comparisons.results import graph_run
    from cgla_graph.comparisons.study.options import read_entrants
    from cgla_graph.scenarios.graphs.graph_file import read_graph
    from cgla_graph.scenarios.graphs.graph_scenario import graph_pairs

    entrants = read_entrants(solver)
    opened = read_graph(Path(graph), weight=options.weight, directed=options.directed)
    (scenario,) = graph_pairs(opened, source=source, target=target)
    with console.running_solvers():
        run = graph_run.plan_on_graph(opened, scenario, entrants)
    written = graph_run.write_graph_run(files.make_folder(out), run) if out else []
    if as_json:
        console.out_json({**graph_run.graph_run_document(run), "files": [*map(str, written)]})
    else:
        graph_run.print_graph_run(run)
        console.out_files(written)
    if not run.all_found:
        raise typer.Exit(console.MISSING)


def compare(
    study: StudyOptions,
    proof: ProofOptions,
    comparison: ComparisonOptions,
    options: GraphOptions,
    graphs: GraphsArg = None,
    source: FromOption = None,
    target: ToOption = None,
    pairs: Annotated[
        str | None, option("--pairs N", "draw N pairs of nodes (with --from or --to: at that end), or read FILE.csv")
    ] = None,
    as_json: JsonOption = False,
) -> None:
    """
    Compare solvers between two nodes of a graph, or many pairs of them.

    Does what cgla compare does on maps: each run in a process of its own, within limits, kept and resumed, with a
    report, intervals and exports; several files are one study. The lower bound is the least cost, proven by a search
    backwards from each target, which is no solver's time. Each run plans its own pair alone.
    """
    from cgla_graph.comparisons.results import study_run
    from cgla_graph.comparisons.study.options import PairOptions

    how = run_options(study)
    asked = study_run.Settings(
        specs=graphs or (),
        tolerance=proof.tolerance,
        certify=not proof.no_certificate,
        graphs=PairOptions(source, target, pairs, options.weight, options.directed),
        **comparison.settings(),
    )
    request = study_run.read_request(asked, how)
    run_and_print(request, how, strict=comparison.strict, as_json=as_json)


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
    from cgla_graph.scenarios.graphs.graph_file import read_graph

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
