"""Pairs of nodes on one graph as scenarios: named ones, those of a file, and pairs that are drawn."""

import csv
import dataclasses
import itertools
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._text import counted, shown
from cgla_graph._validate import instance, truth_value, whole_number
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.adjacency import Node, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.scenarios.graphs.graph_endings import is_graph_file
from cgla_graph.scenarios.scenario import Scenario, as_scenario
from cgla_graph.scenarios.text_files import read_text

if TYPE_CHECKING:
    from cgla_graph.scenarios.graphs.graph_file import GraphFile

#: The seed of pairs that are drawn.
SEED = 1
#: The largest seed.
LARGEST_SEED = 2**63 - 1
#: Most pairs that are drawn; more are a mistake.
MOST_PAIRS = 1_000_000
#: Words for the two columns of a file of pairs, in a header.
_HEADS = {("source", "target"), ("from", "to")}


@dataclass(frozen=True, eq=False)
class GraphScenario(Plottable):
    """
    A path to plan on a graph, with a name: one pair of its nodes.

    Attributes
    ----------
    name, title
        A short name for tables and files, and a title of one line.
    problem
        The graph and the two nodes.
    settings
        Settings of solvers, by the solver's name.
    notes
        Where the graph comes from.
    graph_name
        Name of the graph, which the scenarios of its pairs share; that of the scenario if left out.

    Examples
    --------
    >>> roads = GeometricGraph.from_matrix([[0, 2], [2, 0]], labels=["depot", "hill"])
    >>> GraphScenario("roads", GraphProblem(roads, "depot", "hill")).full_title
    'roads'
    """

    name: str
    problem: GraphProblem
    title: str = ""
    settings: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    notes: str = ""
    graph_name: str = ""

    def __post_init__(self) -> None:
        """Check the problem, and name the graph."""
        instance("problem", self.problem, GraphProblem, "a GraphProblem, as GraphProblem(graph, source, target)")
        if not self.graph_name:
            object.__setattr__(self, "graph_name", self.name)

    @property
    def full_title(self) -> str:
        """Name and title in one line."""
        return f"{self.name}: {self.title}" if self.title else self.name

    @property
    def projection(self) -> None:
        """None: the nodes of a graph have no longitudes and latitudes that this package knows."""
        return

    @property
    def ends(self) -> tuple[str, str]:
        """The labels of source and target, as text."""
        return label_text(self.problem.source), label_text(self.problem.target)


#: A scenario in the plane or on a graph.
AnyScenario: TypeAlias = Scenario | GraphScenario


def as_any_scenario(given: object, name: str) -> AnyScenario:
    """
    Return a scenario unchanged, wrap a problem under a name, or load a scenario by name or path.

    Raises
    ------
    ScenarioError
        If `given` is of another type, cannot be loaded, or names the file of a graph without two nodes.

    Examples
    --------
    >>> roads = GeometricGraph.from_matrix([[0, 2], [2, 0]], labels=["depot", "hill"])
    >>> as_any_scenario(GraphProblem(roads, "depot", "hill"), "mine").name
    'mine'
    """
    if isinstance(given, GraphScenario):
        return given
    if isinstance(given, GraphProblem):
        return GraphScenario(name, given)
    if isinstance(given, str | Path) and is_graph_file(str(given)):
        msg = f"{given} is a graph: graph_pairs({str(given)!r}, pairs=100) makes scenarios of pairs of its nodes"
        raise ScenarioError(msg)
    if isinstance(given, GeometricGraph):
        msg = "a scenario is a graph; give two of its nodes too: GraphProblem(graph, source, target)"
        raise ScenarioError(msg)
    return as_scenario(given, name)


def graph_pairs(
    graph: "str | Path | GeometricGraph | GraphFile",
    *,
    source: Node | None = None,
    target: Node | None = None,
    pairs: "int | np.integer[Any] | str | Path | Sequence[tuple[Node, Node]] | None" = None,
    seed: int = SEED,
    weight: str | None = None,
    directed: bool = False,
    name: str = "",
) -> list[GraphScenario]:
    """
    Make a scenario of each of some pairs of nodes of one graph.

    Parameters
    ----------
    graph
        A graph, or the path of its file, read or not (see `cgla_graph.scenarios.graphs.graph_file.read_graph`).
    source, target
        The two nodes. With `pairs`, one of them may be given: every pair begins or ends there. Nodes of a file are
        named by the text of their labels.
    pairs
        How many pairs to draw, without repetition, each as likely as any other; if the graph has fewer, all of them.
        Or the pairs themselves, or the path of a CSV file with two columns of nodes (a header ``source,target`` or
        ``from,to`` is skipped). In an undirected graph a pair is drawn once, in one of its two directions.
    seed
        Of the pairs that are drawn.
    weight, directed
        Of a file, as `read_graph` takes them.
    name
        Name of the graph; that of its file if left out.

    Returns
    -------
    scenarios
        On one and the same graph object, in the order of the pairs, named after graph and nodes.

    Raises
    ------
    ScenarioError
        If a file is wrong, the nodes are not named, or a node is not in the file.
    NodeNotFoundError
        If a node is not in a graph that was given as such.
    ProblemError
        If the seed is no whole number from 0.

    Examples
    --------
    >>> roads = GeometricGraph.from_matrix([[0, 2, 9], [2, 0, 1], [9, 1, 0]], labels=["depot", "bridge", "tower"])
    >>> [one.name for one in graph_pairs(roads, source="depot", pairs=2, name="roads")]
    ['roads: depot to bridge', 'roads: depot to tower']
    """
    truth_value("directed", directed, ScenarioError)
    seed = whole_number("seed", seed, at_least=0, at_most=LARGEST_SEED)
    instance("weight", weight, (str, type(None)), "the name of an attribute or a column, as 'minutes'", ScenarioError)
    pairs = int(pairs) if isinstance(pairs, np.integer) else pairs
    opened = _opened(graph, weight, directed=directed)
    stem = name or ("graph" if isinstance(opened, GeometricGraph) else opened.file.stem)
    made = opened if isinstance(opened, GeometricGraph) else opened.graph()
    where = stem if isinstance(opened, GeometricGraph) else str(opened.file)
    ends = [None if given is None else _node(opened, given) for given in (source, target)]
    found = list(_chosen(opened, made, (ends[0], ends[1]), pairs, seed, where))
    names = _numbered(f"{stem}: {label_text(one)} to {label_text(other)}" for one, other in found)
    title = f"{counted(made.n_nodes, 'node')}, {'directed' if made.directed else 'undirected'}"
    return [
        GraphScenario(
            name_of_pair,
            GraphProblem(made, one, other),
            title,
            notes=where,
            graph_name=stem,
        )
        for name_of_pair, (one, other) in zip(names, found, strict=True)
    ]


def _numbered(names: Iterable[str]) -> list[str]:
    """Add numbers to names that come again: of a pair that is given twice, or of labels with the same text."""
    counts: dict[str, int] = {}
    found: list[str] = []
    for name in names:
        counts[name] = counts.get(name, 0) + 1
        found.append(name if counts[name] == 1 else f"{name}-{counts[name]}")
    return found


def _opened(graph: object, weight: str | None, *, directed: bool) -> "GraphFile | GeometricGraph":
    if isinstance(graph, GeometricGraph):
        if weight is not None or directed:
            msg = f"{'weight' if weight is not None else 'directed'} is for files of graphs; a graph knows its weights"
            raise ScenarioError(msg)
        return graph
    from cgla_graph.scenarios.graphs.graph_file import GraphFile, read_graph  # noqa: PLC0415 - loads networkx

    if isinstance(graph, GraphFile):
        return graph
    if not isinstance(graph, str | Path):
        msg = f"the graph is {shown(graph)}; give a GeometricGraph, or the path of a file"
        raise ScenarioError(msg)
    return read_graph(Path(graph), weight=weight, directed=directed)


def _node(opened: "GraphFile | GeometricGraph", given: Node) -> Node:
    """Return a node: of a file by the text of its label or the label itself, of a graph by its label."""
    # (labels of a file are texts or numbers)
    return opened.labels[opened.index_of(given)] if isinstance(opened, GeometricGraph) else opened.node(str(given))


def _chosen(
    opened: "GraphFile | GeometricGraph",
    graph: GeometricGraph,
    ends: tuple[Node | None, Node | None],
    pairs: int | str | Path | Sequence[tuple[Node, Node]] | None,
    seed: int,
    where: str,
) -> Iterator[tuple[Node, Node]]:
    """Yield the pairs that are asked for."""
    source, target = ends
    named = [word for word, end in zip(("--from", "--to"), ends, strict=True) if end is not None]
    if pairs is None:
        if source is None or target is None:
            msg = f"{where} is a graph: name two of its nodes, --from A --to B (source, target), or --pairs N (pairs)"
            raise ScenarioError(msg)
        yield source, target
    elif isinstance(pairs, bool) or (isinstance(pairs, int) and not 1 <= pairs <= MOST_PAIRS):
        msg = f"pairs is {shown(pairs)}; give a number from 1 to {MOST_PAIRS:,}, a list of pairs, or a file of them"
        raise ScenarioError(msg)
    elif isinstance(pairs, int):
        if source is not None and target is not None:
            msg = "--pairs draws nodes; leave it out, or one of --from and --to"
            raise ScenarioError(msg)
        if graph.n_nodes == 1:
            msg = f"{where} has a single node; there are no pairs to draw"
            raise ScenarioError(msg)
        fixed = [None if end is None else graph.index_of(end) for end in ends]
        for i, j in _drawn(graph, (fixed[0], fixed[1]), pairs, seed):
            yield graph.labels[i], graph.labels[j]
    else:
        if named:
            msg = f"{named[0]} beside pairs that name both nodes; leave it out"
            raise ScenarioError(msg)
        yield from _listed(opened, pairs)


def _listed(
    opened: "GraphFile | GeometricGraph", pairs: str | Path | Sequence[tuple[Node, Node]]
) -> Iterator[tuple[Node, Node]]:
    """Yield the pairs of a list or a file; an unknown node of a file is named with its line."""
    if not isinstance(pairs, str | Path):
        for one, other in _checked(pairs):
            yield _node(opened, one), _node(opened, other)
        return
    for number, row in _read_pairs(pairs):
        try:
            yield _node(opened, row[0]), _node(opened, row[1])
        except CglaError as error:
            msg = f"{pairs}, line {number}: {error}"
            raise ScenarioError(msg) from error


def _checked(pairs: object) -> list[tuple[Any, Any]]:
    """Return a list of pairs."""
    try:
        listed = [tuple(pair) for pair in pairs]  # type: ignore[attr-defined]
    except TypeError:
        listed = [()]
    if not listed or any(len(pair) != 2 for pair in listed):  # noqa: PLR2004 - a pair
        msg = f"pairs is {shown(pairs)}; give a number, a list of pairs (source, target), or the path of a file of them"
        raise ScenarioError(msg)
    return [(pair[0], pair[1]) for pair in listed]


def _read_pairs(given: str | Path) -> list[tuple[int, tuple[str, str]]]:
    """Read the line numbers and pairs of a CSV file of two columns; further ones are not read."""
    if not Path(given).is_file() and Path(given).suffix.lower() != ".csv":
        msg = (
            f"pairs is {shown(str(given))}; give a number from 1 to {MOST_PAIRS:,}, or a CSV file that exists, with a "
            f"line for each pair: source,target"
        )
        raise ScenarioError(msg)
    reader = csv.reader(read_text(given, str(given), "a file of pairs").splitlines())
    try:
        rows = [(reader.line_num, [cell.strip() for cell in row]) for row in reader]
    except csv.Error as error:
        msg = f"{given}, line {reader.line_num}: {error}; give a line for each pair: source,target"
        raise ScenarioError(msg) from error
    rows = [(number, row) for number, row in rows if any(row)]  # blank lines, and those of commas alone
    if rows and tuple(cell.lower() for cell in rows[0][1][:2]) in _HEADS:
        rows = rows[1:]
    if not rows:
        msg = f"{given}: it has no pairs; give a line for each: source,target"
        raise ScenarioError(msg)
    for number, row in rows:
        if len(row) < 2 or not all(row[:2]):  # noqa: PLR2004 - a pair
            msg = f"{given}, line {number}: {shown(','.join(row))} is not a pair; give two nodes: source,target"
            raise ScenarioError(msg)
    return [(number, (row[0], row[1])) for number, row in rows]


def _drawn(graph: GeometricGraph, fixed: tuple[int | None, int | None], count: int, seed: int) -> list[tuple[int, int]]:
    """Draw pairs of different nodes without repetition."""
    n, rng = graph.n_nodes, np.random.default_rng(seed)
    source, target = fixed
    if source is not None or target is not None:
        end = source if target is None else target
        others = [node for node in range(n) if node != end]
        picked = rng.choice(len(others), min(count, len(others)), replace=False).tolist()
        chosen = [others[place] for place in picked]
        return [(one, end) if source is None else (end, one) for one in chosen if end is not None]
    total = n * (n - 1) // (1 if graph.directed else 2)
    if 2 * count >= total:
        ways = itertools.permutations if graph.directed else itertools.combinations
        every = list(ways(range(n), 2))
        found = [every[place] for place in rng.permutation(len(every))[:count].tolist()]
    else:
        taken: dict[tuple[int, int], None] = {}
        while len(taken) < count:
            one, other = rng.integers(n, size=2).tolist()
            if one != other:
                taken.setdefault((one, other) if graph.directed else (min(one, other), max(one, other)))
        found = list(taken)
    if graph.directed:
        return found
    turned = rng.integers(2, size=len(found)).tolist()
    return [(j, i) if turn else (i, j) for (i, j), turn in zip(found, turned, strict=True)]


def sampling_note(scenarios: Sequence[AnyScenario]) -> str:
    """
    Say what is independent among scenarios that are pairs of nodes of one graph, or of a few; else an empty text.

    Pairs of one graph share it. What is said of them holds for other pairs that are drawn in the same way from the
    same graphs, not for other graphs.

    Examples
    --------
    >>> sampling_note([as_scenario("paper", "paper")])
    ''
    """
    counts: dict[int, int] = {}
    for one in scenarios:
        if isinstance(one, GraphScenario):
            counts[id(one.problem.graph)] = counts.get(id(one.problem.graph), 0) + 1
    if max(counts.values(), default=0) < 2:  # noqa: PLR2004 - one pair of each graph
        return ""
    pairs, graphs = sum(counts.values()), len(counts)
    where = "one graph" if graphs == 1 else counted(graphs, "graph")
    these = "this graph, not for other graphs" if graphs == 1 else "these graphs, not for other ones"
    return (
        f"a scenario is a pair of nodes: {pairs:,} pairs of {where}. Pairs share their graph, so that intervals and "
        f"p-values hold for other pairs drawn alike from {these}"
    )


def with_name(scenario: AnyScenario, name: str) -> AnyScenario:
    """Return a scenario under another name."""
    return dataclasses.replace(scenario, name=name)
