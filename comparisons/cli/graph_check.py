"""The command `check-graph`: Theorem 1 on the graph of a file."""

from pathlib import Path
from typing import Any

from cgla_graph.comparisons import console
from cgla_graph.comparisons.cli.graph_plan import graph_document, graph_title
from cgla_graph.cost_to_go.theorem_1 import TheoremCheck, check_theorem_1
from cgla_graph.model.adjacency import label_text
from cgla_graph.scenarios.graph_file import GraphFile, read_graph


def check_file(
    spec: str, target: str, source: str | None = None, *, weight: str | None = None, directed: bool = False
) -> tuple[GraphFile, TheoremCheck]:
    """
    Check Theorem 1 on the graph of a file, between nodes whose labels are written so.

    Raises
    ------
    ScenarioError
        If the file is malformed, or a node is not there.
    """
    opened = read_graph(Path(spec), weight=weight, directed=directed)
    ends = opened.node(target), None if source is None else opened.node(source)
    return opened, check_theorem_1(opened.graph(below_zero=True), *ends)


def print_checked(opened: GraphFile, checked: TheoremCheck) -> None:
    """Print a line for each statement."""
    ends = f"target {label_text(checked.target)}"
    ends += f", source {label_text(checked.source)}" if checked.source is not None else ""
    console.out(f"{graph_title(opened)}; {ends}\n{checked}\n")


def checked_document(opened: GraphFile, checked: TheoremCheck) -> dict[str, Any]:
    """Return the answer of `cgla_graph.check_theorem_1` as JSON, and what graph it is about."""
    return {"graph": graph_document(opened), **checked.document()}
