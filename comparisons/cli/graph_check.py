"""The command `check-graph`: whether Lemma 1 and Theorem 1 hold on a graph of the user's own, round by round."""

import itertools
import math
from collections import Counter
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import FloatArray
from cgla_graph.comparisons import console
from cgla_graph.comparisons.claims.paper.random_graphs import are_close, eq_9, zero_diagonal
from cgla_graph.comparisons.cli.graph_plan import graph_document, graph_title
from cgla_graph.comparisons.numbers import counted, listed
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.model.adjacency import Node
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.scenarios.graph_file import GraphFile, read_graph, text_of

#: Up to this many nodes, each round of Eq. 9 is made to the letter, on the matrix of all weights (200 MB).
MOST_STEPPED = 5_000
#: Up to this many, the cost matrix is computed, whose rounds look at every node.
MOST_SETTLED = 50_000
#: Edges and nodes that the triangle inequality is checked over, about, in as many searches as that allows.
MOST_SEARCHED = 20_000_000
#: An edge that is longer than a way round it by less, relative to it, is as long.
_ROUNDING = 1e-9
#: The four checks that go round by round.
_LEMMA, _FIRST, _SECOND, _THIRD = (
    "Lemma 1: no value rises",
    "Theorem 1 (1): n rounds give the least costs",
    "Theorem 1 (2): settled values stay",
    "Theorem 1 (3): the source comes into Delta",
)


@dataclass(frozen=True)
class Check:
    """
    What was checked, and what came out.

    Attributes
    ----------
    name
        What should hold.
    says
        The numbers, or why it was not checked.
    holds
        Whether it does; None where that was not checked.
    needed
        Whether Theorem 1 is about it, or assumes it.
    """

    name: str
    says: str
    holds: bool | None = field(default=None, kw_only=True)
    needed: bool = field(default=True, kw_only=True)


@dataclass(frozen=True, eq=False)
class CheckedGraph:
    """
    All checks of a graph.

    Attributes
    ----------
    opened
        The file.
    target, source
        Its nodes; no source: each node is one.
    checks
        In the order of the paper.
    delta_sizes
        How many nodes were in Delta_k, round by round; empty where the rounds were not made.
    """

    opened: GraphFile
    target: Node
    source: Node | None
    checks: list[Check]
    delta_sizes: list[int]

    @property
    def all_hold(self) -> bool:
        """Whether nothing that is needed was seen to fail."""
        return not any(check.needed and check.holds is False for check in self.checks)


def check_file(
    spec: str, target: str, source: str | None = None, *, weight: str | None = None, directed: bool = False
) -> CheckedGraph:
    """
    Check Theorem 1's assumptions and what it says on the graph of a file.

    Parameters
    ----------
    spec, weight, directed
        The file, and how to read it (see `read_graph`).
    target, source
        Labels of nodes; without a source, each node is one.

    Raises
    ------
    ScenarioError
        If the file is malformed, or a node is not there.
    """
    opened = read_graph(Path(spec), weight=weight, directed=directed)
    end = opened.node(target)
    start = None if source is None else opened.node(source)
    checks = [_weights(opened), _symmetry(opened), _reach(opened, end)]
    sizes: list[int] = []
    if opened.below_zero():
        why = "not checked: a weight is below 0, with which Eq. 9 may lower G without end"
        checks += [Check("triangle inequality", why, needed=False)]
        checks += [Check(name, why) for name in (_LEMMA, _FIRST, _SECOND, _THIRD)]
    else:
        graph = opened.graph()
        checks.append(_triangles(opened))
        checks += _theorem(graph, end, start, sizes)
    return CheckedGraph(opened, end, start, checks, sizes)


def _arrow(opened: GraphFile, tail: int, head: int) -> str:
    return f"{text_of(opened.labels[tail])} → {text_of(opened.labels[head])}"


def _weights(opened: GraphFile) -> Check:
    name, weights = "weights at least 0", opened.rows.data
    below = opened.below_zero()
    if below:
        tail, head, weight = below[0]
        n_edges = len(below) if opened.directed else len(below) // 2
        more = f"; {n_edges} edges are below 0 in all" if n_edges > 1 else ""
        return Check(name, f"{text_of(tail)} → {text_of(head)} has weight {weight:g}{more}", holds=False)
    if not len(weights):
        return Check(name, "there is no edge", holds=True)
    n_zero = int((weights == 0.0).sum()) // (1 if opened.directed else 2)
    zero = f"; {counted(n_zero, 'edge')} of weight 0, which is as good" if n_zero else ""
    return Check(name, f"from {weights.min():g} to {weights.max():g}{zero}", holds=True)


def _symmetry(opened: GraphFile) -> Check:
    name = "symmetric"
    entries = opened.rows.tocoo()
    tails, heads = (axis.astype(np.int64) for axis in entries.coords)
    # rows are in order, and so are these numbers of pairs
    pairs, back = tails * len(opened.labels) + heads, heads * len(opened.labels) + tails
    at = np.minimum(np.searchsorted(pairs, back), len(pairs) - 1)
    there, weights = pairs[at] == back, entries.data
    odd = np.nonzero(~there | (weights[at] != weights))[0]
    if not len(odd):
        return Check(name, "every edge weighs the same both ways", holds=True, needed=False)
    k = odd[0]
    other = f"has weight {weights[k]:g}, the other way {weights[at[k]]:g}" if there[k] else "leads one way only"
    says = f"{_arrow(opened, int(tails[k]), int(heads[k]))} {other} (not needed)"
    return Check(name, says, holds=False, needed=False)


def _reach(opened: GraphFile, target: Node) -> Check:
    name, labels = "every node reaches the target", opened.labels
    search: Any = csgraph.breadth_first_order
    reached = search(opened.rows.T.tocsr(), labels.index(target), return_predecessors=False)
    missing = np.setdiff1d(np.arange(len(labels)), reached)
    if not len(missing):
        return Check(name, f"all of {counted(len(labels), 'node')}", holds=True)
    names = listed([text_of(labels[i]) for i in missing[:4].tolist()])
    return Check(name, f"{len(missing):,} of {len(labels):,} cannot, and keep G = infinity, as {names}", holds=False)


def _triangles(opened: GraphFile) -> Check:
    """Compare edges with the least-cost ways between their ends: a few nodes' edges where all would take too long."""
    name, rows = "triangle inequality", opened.rows
    n = len(opened.labels)
    count = min(n, max(20, MOST_SEARCHED // (n + int(rows.nnz))))
    nodes = range(n) if count == n else np.random.default_rng(1).choice(n, count, replace=False).tolist()
    search: Any = csgraph.dijkstra
    example, n_longer, n_edges = "", 0, 0
    for node in nodes:
        begin, end = rows.indptr[node], rows.indptr[node + 1]
        heads, weights = rows.indices[begin:end], rows.data[begin:end]
        least = search(rows, indices=node)[heads]
        (longer,) = np.nonzero(weights > least * (1.0 + _ROUNDING))
        n_edges, n_longer = n_edges + len(heads), n_longer + len(longer)
        if len(longer) and not example:
            k = longer[0]
            example = f"{_arrow(opened, node, int(heads[k]))} has weight {weights[k]:g}, another way {least[k]:g}"
    of = "of all edges" if count == n else f"of the edges from {count:,} nodes, drawn at random"
    if not n_longer:
        return Check(name, f"{of}, none costs more than another way", holds=True, needed=False)
    says = f"{of}, {100 * n_longer / n_edges:.3g} % cost more than another way: {example} (not needed)"
    return Check(name, says, holds=False, needed=False)


def _theorem(graph: GeometricGraph, target: Node, source: Node | None, sizes: list[int]) -> list[Check]:
    """Check Lemma 1 and Theorem 1 as far as the size of the graph allows; `sizes` gets those of the Delta sets."""
    n = graph.n_nodes
    if n > MOST_SETTLED:
        why = f"not checked: {n:,} nodes, more than {MOST_SETTLED:,} (for all graphs: cgla claims C8 C11 C12)"
        return [Check(name, why) for name in (_LEMMA, _FIRST, _SECOND, _THIRD)]
    matrix = cost_matrix(graph, target)
    search: Any = csgraph.dijkstra
    least: FloatArray = search(graph.to_csgraph().T.tocsr(), indices=matrix.target)
    if n > MOST_STEPPED:
        why = f"not checked: {n:,} nodes, more than the {MOST_STEPPED:,} on which each round is made to the letter"
        return [Check(_LEMMA, why), _least(matrix, least), Check(_SECOND, why), _early(matrix, source)]
    rounds = _rounds(matrix)
    sizes += rounds.sizes
    rose = f"in round {rounds.rose} one does" if rounds.rose else f"in none of {counted(matrix.rounds, 'round')}"
    changed = (
        f"in round {rounds.changed} one changes" if rounds.changed else "a node that has served as p_r keeps its value"
    )
    lemma = Check(_LEMMA, rose, holds=not rounds.rose)
    settled = Check(_SECOND, changed, holds=not rounds.changed)
    return [lemma, _least(matrix, least, rounds.values), settled, _early(matrix, source, rounds)]


@dataclass(frozen=True, eq=False)
class _Rounds:
    """
    Eq. 9 with p_r from Delta_k, to the letter.

    Attributes
    ----------
    values
        G after the last round.
    rose, changed
        The first round in which a value rose, and in which a settled one changed; 0 for none.
    entered
        By node, the round in which it was in Delta_k first, and its value then.
    sizes
        Of Delta_k, round by round.
    """

    values: FloatArray
    rose: int
    changed: int
    entered: dict[int, tuple[int, float]]
    sizes: list[int]


def _rounds(matrix: CostMatrix) -> _Rounds:
    order = matrix.order.tolist()
    settled = np.zeros(matrix.graph.n_nodes, dtype=np.bool_)
    final = np.full(len(settled), np.nan)
    rose = changed = 0
    entered: dict[int, tuple[int, float]] = {}
    sizes: list[int] = []
    after = np.empty(0)
    # sums of weights as large as numbers can be are infinite
    with np.errstate(over="ignore"):
        steps = itertools.pairwise(eq_9(zero_diagonal(matrix.graph), matrix.target, order))
        for number, (before, after) in enumerate(steps, start=1):
            rose = rose or number * bool((after > before).any())
            waiting = np.where(settled, np.inf, before)
            (delta,) = np.nonzero(waiting == waiting.min())
            sizes.append(len(delta))
            for node in delta.tolist():
                entered.setdefault(node, (number, float(before[node])))
            node = order[number - 1]
            settled[node], final[node] = True, before[node]
            changed = changed or number * bool((after[settled] != final[settled]).any())
    return _Rounds(after, rose, changed, entered, sizes)


def _least(matrix: CostMatrix, least: FloatArray, values: FloatArray | None = None) -> Check:
    n_reached = int(np.isfinite(least).sum())
    same = are_close(matrix.values, least) and (values is None or are_close(values, least))
    if same and matrix.rounds == n_reached:
        says = (
            f"{counted(n_reached, 'round')}, one for each node that reaches the target; G is that of scipy's Dijkstra"
        )
        return Check(_FIRST, says, holds=True)
    finite = np.isfinite(least) & np.isfinite(matrix.values)
    apart = float(np.abs(matrix.values - least)[finite].max(initial=0.0))
    says = f"{matrix.rounds:,} rounds for {n_reached:,} nodes; G and scipy's Dijkstra are up to {apart:g} apart"
    return Check(_FIRST, says, holds=False)


def _early(matrix: CostMatrix, source: Node | None, rounds: _Rounds | None = None) -> Check:
    """Check that the search may stop when the source, or each node for itself, is in Delta_k."""
    if source is None:
        if rounds is None:
            return Check(_THIRD, "not checked: name a source (--source)")
        early = [node for node, (_, value) in rounds.entered.items() if value != rounds.values[node]]
        if early or len(rounds.entered) != matrix.rounds:
            says = (
                f"{len(rounds.entered):,} nodes come into Delta, {len(early):,} of them with another value than at last"
            )
            return Check(_THIRD, says, holds=False)
        says = "each node that reaches the target does, and has its least cost from then on"
        return Check(_THIRD, says, holds=True)
    node = matrix.graph.index_of(source)
    final = matrix.value(source)
    if not math.isfinite(final):
        return Check(_THIRD, f"{text_of(source)} cannot reach the target, and never does", holds=False)
    stopped = cost_matrix(matrix.graph, matrix.graph.labels[matrix.target], source=source)
    # where the search stopped, the source is in Delta, and has not served yet
    number, value = rounds.entered.get(node, (0, math.inf)) if rounds else (stopped.rounds + 1, stopped.value(source))
    holds = value == final == stopped.value(source) and number == stopped.rounds + 1
    when = f"in round {number:,} of {matrix.rounds:,}" if number else "in no round"
    says = f"{text_of(source)} {when}, where the search may stop: G is {final:g} then and at last"
    if not holds:
        says = f"{text_of(source)} {when} with G = {value:g}, at last {final:g}; stopped after {stopped.rounds:,}"
    return Check(_THIRD, says, holds=holds)


def delta_note(sizes: list[int]) -> str:
    """
    Say how many nodes were in Delta_k, round by round.

    Examples
    --------
    >>> delta_note([1, 2, 1])
    'ties in 1 of 3 rounds; at most 2 nodes, in round 2'
    """
    n_ties = sum(size > 1 for size in sizes)
    if not n_ties:
        return f"{counted(len(sizes), 'round')} of one node each: no ties"
    most = max(sizes)
    first = sizes.index(most) + 1
    return f"ties in {n_ties:,} of {counted(len(sizes), 'round')}; at most {most:,} nodes, in round {first:,}"


def print_checked(checked: CheckedGraph) -> None:
    """Print a line for each check."""
    ends = f"target {text_of(checked.target)}"
    ends += f", source {text_of(checked.source)}" if checked.source is not None else ""
    console.out(f"{graph_title(checked.opened)}; {ends}\n")
    words = {True: "yes", False: "no", None: "-"}
    for check in checked.checks:
        console.out(f"{check.name:46} {words[check.holds]:4} {check.says}\n")
    if checked.delta_sizes:
        console.out(f"{'Delta sets':51} {delta_note(checked.delta_sizes)}\n")


def checked_document(checked: CheckedGraph) -> dict[str, Any]:
    """Return the checks as JSON; nodes are the texts of their labels."""
    return {
        "graph": graph_document(checked.opened),
        "target": str(checked.target),
        "source": None if checked.source is None else str(checked.source),
        "checks": [
            {"name": check.name, "holds": check.holds, "says": check.says, "needed": check.needed}
            for check in checked.checks
        ],
        # how many rounds had so many nodes in Delta
        "delta_sets": [{"nodes": size, "rounds": n} for size, n in sorted(Counter(checked.delta_sizes).items())],
    }
