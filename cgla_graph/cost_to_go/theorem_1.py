"""A check of Lemma 1 and Theorem 1 on a graph, round by round of Eq. 9, with a witness for each failure."""

import dataclasses
import itertools
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._text import counted, listed
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.errors import GraphError
from cgla_graph.model.adjacency import Node, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.graph_libraries import graph_wanted

#: Up to this many nodes, each round of Eq. 9 is made literally, on the matrix of all weights (200 MB).
MOST_STEPPED = 5_000
#: Up to this many nodes, the cost matrix is computed, whose rounds visit every node.
MOST_SETTLED = 50_000
#: The same limit where a weight is below 0: least costs then take n rounds over all nodes.
MOST_BELOW_ZERO = 1_000
#: About how many edges and nodes all searches for the triangle inequality visit together.
MOST_SEARCHED = 20_000_000
#: Relative excess of an edge over a path between its ends that counts as rounding.
_ROUNDING: Final = 1e-9
#: Greatest relative difference of two algorithms that add the same weights in another order.
SAME: Final = 1e-12
_LEMMA: Final = "Lemma 1: no value rises"
_FIRST: Final = "Theorem 1 (1): n rounds give the least costs"
_SECOND: Final = "Theorem 1 (2): settled values stay"
_THIRD: Final = "Theorem 1 (3): the source comes into Delta"
_ANSWERS: Final = {True: "yes", False: "no", None: "-"}


@dataclass(frozen=True)
class Statement:
    """
    An assumption or a part of Theorem 1, and whether it holds on a graph.

    Attributes
    ----------
    name
        What should hold.
    says
        The numbers, or why it was not checked.
    holds
        Whether it holds; None where that was not checked.
    needed
        Whether Theorem 1 assumes or states it.
    witness
        Where it fails: the two ends of an edge, or a node; empty where it holds.
    round
        The round of Eq. 9 in which it fails first, from 1; 0 where no round shows it.
    """

    name: str
    says: str
    holds: bool | None = None
    needed: bool = True
    witness: tuple[Node, ...] = ()
    round: int = 0


@dataclass(frozen=True, eq=False)
class TheoremCheck:
    """
    The checks of Theorem 1 on a graph; `print` shows a line for each statement.

    Attributes
    ----------
    target, source
        Nodes; without a source, each node counts as one.
    statements
        In the order of the paper: weights, symmetry, ways to the target, the triangle inequality, Lemma 1, and the
        theorem's parts (1) to (3).
    delta_sizes
        How many nodes were in Delta_k, round by round; empty where the rounds were not made.
    matrix
        The cost matrix that was checked, whose `delta_sets` are the sets themselves; None where none was computed.
    """

    target: Node
    source: Node | None
    statements: tuple[Statement, ...]
    delta_sizes: tuple[int, ...]
    matrix: CostMatrix | None = dataclasses.field(default=None, repr=False)

    @property
    def all_hold(self) -> bool:
        """Whether no needed statement failed; one that was not checked does not count as a failure."""
        return not any(one.needed and one.holds is False for one in self.statements)

    def __str__(self) -> str:
        """Write a line for each statement, and one for the Delta sets."""
        lines = [f"{one.name:46} {_ANSWERS[one.holds]:4} {one.says}" for one in self.statements]
        lines += [f"{'Delta sets':51} {delta_note(self.delta_sizes)}"] if self.delta_sizes else []
        return "\n".join(lines)

    def document(self) -> dict[str, Any]:
        """Return it as JSON; nodes are the texts of their labels."""
        return {
            "target": str(self.target),
            "source": None if self.source is None else str(self.source),
            "checks": [{**vars(one), "witness": list(map(str, one.witness))} for one in self.statements],
            # how many rounds had so many nodes in Delta
            "delta_sets": [{"nodes": size, "rounds": n} for size, n in sorted(Counter(self.delta_sizes).items())],
        }


def check_theorem_1(
    graph: GeometricGraph, target: Node, source: Node | None = None, *, matrix: CostMatrix | None = None
) -> TheoremCheck:
    """
    Check the assumptions and the statements of Theorem 1 on a graph, with a witness for each failure.

    Lemma 1: no value rises in a round of Eq. 9 whose ``p_r`` is an element of Delta_k. Theorem 1: (1) n rounds give the
    least costs, compared with scipy's Dijkstra; (2) the value of a node that has served as ``p_r`` stays; (3) the
    source comes into Delta_k, where it has its least cost and the search may stop.

    Parameters
    ----------
    graph
        Any graph. Rounds are made literally for 5,000 nodes at most, 1,000 where a weight is below 0; the other
        statements are checked on larger graphs as well.
    target
        The node ``p_t`` whose costs-to-go are computed.
    source
        The node ``p_s``; without one, part (3) is checked for each node.
    matrix
        A cost matrix to the target by label setting, checked instead of the one of `cgla_graph.cost_matrix`.

    Raises
    ------
    NodeNotFoundError
        If the target or the source is not in the graph.
    GraphError
        If `graph` is no graph, has too many weights to hold, or the matrix is of another graph, target or schedule, or
        stopped early.

    Examples
    --------
    >>> graph = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels=["a", "b", "c"])
    >>> checked = check_theorem_1(graph, "c")
    >>> checked.all_hold, checked.delta_sizes
    (True, (1, 1, 1))
    >>> triangle = checked.statements[3]
    >>> triangle.holds, triangle.witness, triangle.needed
    (False, ('a', 'c'), False)
    """
    instance("graph", graph, GeometricGraph, graph_wanted, GraphError)
    at = graph.index_of(target)
    start = None if source is None else graph.index_of(source)
    if matrix is not None:
        _require_fitting(matrix, graph, at)
    edges = _Edges(graph, graph.to_csgraph())
    checks = [edges.weights(), edges.symmetry(), edges.reach(at), edges.triangles()]
    most = MOST_BELOW_ZERO if edges.has_below_zero else MOST_SETTLED
    if graph.n_nodes > most:
        why = f"not checked: {graph.n_nodes:,} nodes, more than {most:,}"
        why += " where a weight is below 0" if edges.has_below_zero else " (for all graphs: cgla claims C8 C11 C12)"
        checks += [Statement(name, why) for name in (_LEMMA, _FIRST, _SECOND, _THIRD)]
        return TheoremCheck(target, source, tuple(checks), ())
    matrix = cost_matrix(graph, target) if matrix is None else matrix
    if edges.has_below_zero:
        matrix = dataclasses.replace(matrix, converged=False)
    rounds = _rounds(matrix) if graph.n_nodes <= MOST_STEPPED else None
    checks += [_in_rounds(matrix, rounds, _LEMMA), _least(matrix, edges, rounds)]
    checks.append(_in_rounds(matrix, rounds, _SECOND))
    checks.append(_every_source(matrix, rounds) if start is None else _one_source(matrix, start, rounds))
    return TheoremCheck(target, source, tuple(checks), () if rounds is None else tuple(rounds.sizes), matrix)


def _require_fitting(matrix: CostMatrix, graph: GeometricGraph, target: int) -> None:
    """Refuse a cost matrix of another graph, target or schedule."""
    instance("matrix", matrix, CostMatrix, "cg.cost_matrix(graph, target)", GraphError)
    if matrix.graph is not graph or matrix.target != target:
        msg = "the matrix is one of another graph or target; give cg.cost_matrix(graph, target)"
        raise GraphError(msg)
    if matrix.schedule != "label-setting":
        msg = f"the matrix is by the {matrix.schedule} schedule; only label-setting has Delta sets"
        raise GraphError(msg)


@dataclass(frozen=True, eq=False)
class _Edges:
    """The edges of a graph, stored zeros too, and the assumptions of Theorem 1 about them."""

    graph: GeometricGraph
    rows: Any

    @property
    def has_below_zero(self) -> bool:
        return bool((self.rows.data < 0.0).any())

    def label(self, index: int) -> str:
        return label_text(self.graph.labels[index])

    def arrow(self, tail: int, head: int) -> str:
        return f"{self.label(tail)} → {self.label(head)}"

    def ends(self, *indices: int) -> tuple[Node, ...]:
        return tuple(self.graph.labels[index] for index in indices)

    def entries(self) -> tuple[FloatArray, Any, Any]:
        """Return the weight, the tail and the head of each edge, row by row."""
        entries = self.rows.tocoo()
        tails, heads = (axis.astype(np.int64) for axis in entries.coords)
        return entries.data, tails, heads

    def weights(self) -> Statement:
        name, (weights, tails, heads) = "weights at least 0", self.entries()
        both = 1 if self.graph.directed else 2
        (below,) = np.nonzero(weights < 0.0)
        if len(below):
            tail, head = int(tails[below[0]]), int(heads[below[0]])
            n_edges = len(below) // both
            more = f"; {n_edges} edges are below 0 in all" if n_edges > 1 else ""
            says = f"{self.arrow(tail, head)} has weight {weights[below[0]]:g}{more}"
            return Statement(name, says, holds=False, witness=self.ends(tail, head))
        if not len(weights):
            return Statement(name, "there is no edge", holds=True)
        n_zero = int((weights == 0.0).sum()) // both
        zero = f"; {counted(n_zero, 'edge')} of weight 0, which is as good" if n_zero else ""
        return Statement(name, f"from {weights.min():g} to {weights.max():g}{zero}", holds=True)

    def symmetry(self) -> Statement:
        name, (weights, tails, heads) = "symmetric", self.entries()
        n = self.graph.n_nodes
        pairs, back = tails * n + heads, heads * n + tails
        order = np.argsort(pairs, kind="stable")
        at = order[np.minimum(np.searchsorted(pairs, back, sorter=order), len(pairs) - 1)]
        there = pairs[at] == back
        odd = np.nonzero(~there | (weights[at] != weights))[0]
        if not len(odd):
            return Statement(name, "every edge weighs the same both ways", holds=True, needed=False)
        k = odd[0]
        tail, head = int(tails[k]), int(heads[k])
        other = f"has weight {weights[k]:g}, the other way {weights[at[k]]:g}" if there[k] else "leads one way only"
        says = f"{self.arrow(tail, head)} {other} (not needed)"
        return Statement(name, says, holds=False, needed=False, witness=self.ends(tail, head))

    def reach(self, target: int) -> Statement:
        name, n = "every node reaches the target", self.graph.n_nodes
        search: Any = csgraph.breadth_first_order
        reached = search(self.rows.T.tocsr(), target, return_predecessors=False)
        missing = np.setdiff1d(np.arange(n), reached).tolist()
        if not missing:
            return Statement(name, f"all of {counted(n, 'node')}", holds=True)
        names = listed([self.label(index) for index in missing[:4]])
        says = f"{len(missing):,} of {n:,} cannot, and keep G = infinity, as {names}"
        return Statement(name, says, holds=False, witness=self.ends(missing[0]))

    def triangles(self) -> Statement:
        """Compare edges with the cheapest paths between their ends; of a large graph, the edges of some nodes."""
        name, rows, n = "triangle inequality", self.rows, self.graph.n_nodes
        if self.has_below_zero:
            return Statement(name, "not checked: a weight is below 0", needed=False)
        count = min(n, max(20, MOST_SEARCHED // (n + int(rows.nnz))))
        nodes = range(n) if count == n else np.random.default_rng(1).choice(n, count, replace=False).tolist()
        search: Any = csgraph.dijkstra
        witness: tuple[Node, ...] = ()
        example, n_longer, n_edges = "", 0, 0
        for node in nodes:
            begin, end = rows.indptr[node], rows.indptr[node + 1]
            heads, weights = rows.indices[begin:end], rows.data[begin:end]
            least = search(rows, indices=node)[heads]
            (longer,) = np.nonzero(weights > least * (1.0 + _ROUNDING))
            n_edges, n_longer = n_edges + len(heads), n_longer + len(longer)
            if len(longer) and not example:
                k, head = longer[0], int(heads[longer[0]])
                example = f"{self.arrow(node, head)} has weight {weights[k]:g}, another way {least[k]:g}"
                witness = self.ends(node, head)
        of = "of all edges" if count == n else f"of the edges from {count:,} nodes, drawn at random"
        if not n_longer:
            return Statement(name, f"{of}, none costs more than another way", holds=True, needed=False)
        says = f"{of}, {100 * n_longer / n_edges:.3g} % cost more than another way: {example} (not needed)"
        return Statement(name, says, holds=False, needed=False, witness=witness)

    def least_costs(self, matrix: CostMatrix) -> FloatArray | None:
        """Return the least costs to the target by another algorithm; None where a cycle costs less than 0."""
        if self.has_below_zero:
            swept = cost_matrix(self.graph, self.graph.labels[matrix.target], schedule="synchronous")
            return swept.values if swept.converged else None
        search: Any = csgraph.dijkstra
        found: FloatArray = search(self.rows.T.tocsr(), indices=matrix.target)
        return found


@dataclass(frozen=True, eq=False)
class _Rounds:
    """
    The rounds of Eq. 9 with p_r from Delta_k, made literally.

    Attributes
    ----------
    values
        G after the last round.
    rose, changed
        The first round in which a value rose, and in which a settled one changed, each with the node; None if none.
    entered
        By node, the first round in which it was in Delta_k, and its value then.
    sizes
        Of Delta_k, round by round.
    """

    values: FloatArray
    rose: tuple[int, int] | None
    changed: tuple[int, int] | None
    entered: dict[int, tuple[int, float]]
    sizes: list[int]


def _rounds(matrix: CostMatrix) -> _Rounds:
    order = matrix.order.tolist()
    settled = np.zeros(matrix.graph.n_nodes, dtype=np.bool_)
    final = np.full(len(settled), np.nan)
    rose = changed = None
    entered: dict[int, tuple[int, float]] = {}
    sizes: list[int] = []
    after = np.empty(0)
    # sums of the largest weights overflow to infinity
    with np.errstate(over="ignore"):
        steps = itertools.pairwise(eq_9(zero_diagonal(matrix.graph), matrix.target, order))
        for number, (before, after) in enumerate(steps, start=1):
            rose = rose or _first(number, after > before)
            waiting = np.where(settled, np.inf, before)
            (delta,) = np.nonzero(waiting == waiting.min())
            sizes.append(len(delta))
            for node in delta.tolist():
                entered.setdefault(node, (number, float(before[node])))
            node = order[number - 1]
            settled[node], final[node] = True, before[node]
            changed = changed or _first(number, settled & (after != final))
    return _Rounds(after, rose, changed, entered, sizes)


def _first(number: int, where: Any) -> tuple[int, int] | None:  # noqa: ANN401 - an array of bools
    """Return the round and the first node of those marked, if there is one."""
    return (number, int(where.argmax())) if where.any() else None


def _in_rounds(matrix: CostMatrix, rounds: _Rounds | None, name: str) -> Statement:
    """Check Lemma 1, or part (2), on the rounds."""
    if rounds is None:
        nodes = f"{matrix.graph.n_nodes:,} nodes, more than the {MOST_STEPPED:,}"
        return Statement(name, f"not checked: {nodes} for which each round is made")
    found, verb = (rounds.rose, "does") if name == _LEMMA else (rounds.changed, "changes")
    if found is None:
        none = f"in none of {counted(matrix.rounds, 'round')}"
        says = none if name == _LEMMA else "a node that has served as p_r keeps its value"
        return Statement(name, says, holds=True)
    label = matrix.graph.labels[found[1]]
    says = f"in round {found[0]} that of {label_text(label)} {verb}"
    return Statement(name, says, holds=False, witness=(label,), round=found[0])


def _least(matrix: CostMatrix, edges: _Edges, rounds: _Rounds | None) -> Statement:
    least, other = edges.least_costs(matrix), "scipy's Dijkstra"
    if edges.has_below_zero:
        other = "Bellman and Ford"
    if least is None:
        witness = _improvable(matrix, edges)
        return Statement(
            _FIRST, "there are none: a cycle costs less than 0", holds=False, witness=witness and edges.ends(*witness)
        )
    n_reached = int(np.isfinite(least).sum())
    held = [matrix.values] if rounds is None else [matrix.values, rounds.values]
    if all(are_close(values, least) for values in held) and matrix.rounds == n_reached:
        says = f"{counted(n_reached, 'round')}, one for each node that reaches the target; G is that of {other}"
        return Statement(_FIRST, says, holds=True)
    apart, node = max((float(gaps.max()), int(gaps.argmax())) for gaps in (_gaps(values, least) for values in held))
    says = f"{matrix.rounds:,} rounds for {n_reached:,} nodes; G and {other} are up to {apart:g} apart"
    return Statement(_FIRST, says, holds=False, witness=edges.ends(node) if apart else ())


def _gaps(values: FloatArray, least: FloatArray) -> FloatArray:
    """Return the distances of values; infinity and infinity are 0 apart."""
    with np.errstate(invalid="ignore"):
        return np.where(values == least, 0.0, np.abs(values - least))


def _improvable(matrix: CostMatrix, edges: _Edges) -> tuple[int, ...]:
    """Return an edge along which Eq. 9 would lower a value after the last round."""
    weights, tails, heads = edges.entries()
    gain = matrix.values[tails] - (weights + matrix.values[heads])
    k = int(np.nan_to_num(gain, nan=-np.inf).argmax())
    return int(tails[k]), int(heads[k])


def _every_source(matrix: CostMatrix, rounds: _Rounds | None) -> Statement:
    """Check that each node that reaches the target comes into Delta_k with its least cost."""
    if rounds is None:
        return Statement(_THIRD, "not checked: name a source")
    early = [node for node, (_, value) in rounds.entered.items() if value != rounds.values[node]]
    if not early and len(rounds.entered) == matrix.rounds:
        says = "each node that reaches the target does, and has its least cost from then on"
        return Statement(_THIRD, says, holds=True)
    says = f"{len(rounds.entered):,} nodes come into Delta, {len(early):,} of them with another value than at last"
    node = early[0] if early else next((one for one in matrix.order.tolist() if one not in rounds.entered), None)
    witness = () if node is None else (matrix.graph.labels[node],)
    number = rounds.entered[early[0]][0] if early else 0
    return Statement(_THIRD, says, holds=False, witness=witness, round=number)


def _one_source(matrix: CostMatrix, node: int, rounds: _Rounds | None) -> Statement:
    """Check that the search may stop when the source is in Delta_k."""
    labels = matrix.graph.labels
    source, text = labels[node], label_text(labels[node])
    final = float(matrix.values[node] if rounds is None else rounds.values[node])
    if not np.isfinite(final):
        return Statement(_THIRD, f"{text} cannot reach the target, and never does", holds=False, witness=(source,))
    stopped = cost_matrix(matrix.graph, labels[matrix.target], source=source)
    # where the search stopped, the source is in Delta, and has not served yet
    last = stopped.rounds + 1, stopped.value(source)
    number, value = last if rounds is None else rounds.entered.get(node, (0, np.inf))
    when = f"in round {number:,} of {matrix.rounds:,}" if number else "in no round"
    if value == final == last[1] and number == last[0]:
        says = f"{text} {when}, where the search may stop: G is {final:g} then and at last"
        return Statement(_THIRD, says, holds=True)
    says = f"{text} {when} with G = {value:g}, at last {final:g}; stopped after {stopped.rounds:,}"
    return Statement(_THIRD, says, holds=False, witness=(source,), round=number)


def delta_note(sizes: Sequence[int]) -> str:
    """
    Summarise how many nodes were in Delta_k, round by round.

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


def are_close(values: FloatArray, others: FloatArray) -> bool:
    """
    Return whether values are equal up to rounding; infinity equals only infinity.

    Examples
    --------
    >>> are_close(np.array([1.0, np.inf]), np.array([1.0 + 1e-15, np.inf]))
    True
    """
    return bool(np.allclose(values, others, rtol=SAME, atol=0.0, equal_nan=False))


def eq_9(weights: FloatArray, target: int, pivots: Iterable[int]) -> Iterator[FloatArray]:
    """
    Yield G before the first and after each literal use of Eq. 9, shape ``(n,)`` each.

    Parameters
    ----------
    weights
        A, shape ``(n, n)``, as `zero_diagonal` gives it.
    target
        Index of the node ``p_t``.
    pivots
        The ``p_r``, one a round.

    Examples
    --------
    >>> [values.tolist() for values in eq_9(np.array([[0.0, 3.0], [3.0, 0.0]]), 1, [1])]
    [[inf, 0.0], [3.0, 0.0]]
    """
    values = np.full(len(weights), np.inf)
    values[target] = 0.0
    yield values.copy()
    for r in pivots:
        values = np.minimum(values, weights[:, r] + values[r])
        yield values.copy()


def zero_diagonal(graph: GeometricGraph) -> FloatArray:
    """
    Return the weights of a graph, shape ``(n, n)``, with A(p, p) = 0.

    Examples
    --------
    >>> zero_diagonal(GeometricGraph.from_matrix([[5, 1], [1, 5]])).tolist()
    [[0.0, 1.0], [1.0, 0.0]]
    """
    weights = graph.weight_matrix().copy()
    np.fill_diagonal(weights, 0.0)
    return weights
