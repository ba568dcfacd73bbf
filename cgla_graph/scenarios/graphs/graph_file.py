"""Graphs in files: GraphML, node-link JSON, edge lists (CSV), Matrix Market and scipy's ``.npz``."""

import difflib
import itertools
import warnings
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, cast
from xml.etree.ElementTree import Element, ParseError

import networkx as nx
import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from cgla_graph._text import listed, shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.errors import FileFormatError, ScenarioError
from cgla_graph.model.adjacency import Node, compressed, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import SparseWeights
from cgla_graph.scenarios.graphs.edge_list import EdgeList, fail, read_edge_list, read_weight
from cgla_graph.scenarios.graphs.graph_endings import ENDINGS, MOST_TEXT
from cgla_graph.scenarios.graphs.matrix_market import read_entries, read_head
from cgla_graph.scenarios.graphs.node_link import read_node_link
from cgla_graph.scenarios.text_files import read_text, require_file
from cgla_graph.untrusted.arrays import read_archive
from cgla_graph.untrusted.numbers import decimal

#: Limits of matrices.
MOST_BYTES = 4_000_000_000
MOST_NODES = 10_000_000
#: The nearest names to an unknown one are looked for among this many labels.
_MOST_NEAR = 20_000
#: Exceptions that networkx's reader of GraphML raises for a malformed file.
_MALFORMED = (
    *(ArithmeticError, AttributeError, LookupError, ParseError, RuntimeError, TypeError, ValueError),
    nx.NetworkXException,
)


@dataclass(frozen=True, eq=False)
class GraphFile:
    """
    A graph as its file stores it; weights may be negative, which solvers refuse.

    Attributes
    ----------
    file
        The file.
    labels
        The nodes: ids of the file; the rows of Matrix Market count from 1, those of ``.npz`` from 0.
    rows
        Shape ``(n, n)``: stored entries are edges, zeros too; an undirected edge is stored in both directions. The
        lightest of parallel edges counts, and of entries of a matrix in one place; loops are left out.
    directed
        Whether weights may differ between the two directions.
    positions
        Shape ``(n, 2)``, or None unless the file gives each node two numbers (``pos``, or ``x`` and ``y``).
    """

    file: Path
    labels: Sequence[Node]
    rows: sparse.csr_array
    directed: bool
    positions: FloatArray | None = None

    @property
    def n_edges(self) -> int:
        """Number of edges: ordered pairs in a directed graph, else unordered ones."""
        return int(self.rows.nnz) if self.directed else int(self.rows.nnz) // 2

    def graph(self, *, below_zero: bool = False) -> GeometricGraph:
        """
        Return the graph that solvers plan on.

        Parameters
        ----------
        below_zero
            Whether weights may be below 0: `cgla_graph.check_theorem_1` says which statements then still hold.

        Raises
        ------
        ScenarioError
            If a weight is below 0, unless `below_zero` allows it.
        """
        for tail, head, weight in [] if below_zero else self.below_zero()[:1]:
            msg = (
                f"{self.file}: the edge from {label_text(tail)} to {label_text(head)} has weight {weight:g}; weights "
                "must be at least 0 (Theorem 1): cgla graph check lists the statements that hold without"
            )
            raise ScenarioError(msg)
        return GeometricGraph(
            self.labels, self.positions, directed=self.directed, weights=SparseWeights(self.rows.copy())
        )

    def below_zero(self) -> list[tuple[Node, Node, float]]:
        """List the edges whose weight is below 0."""
        entries = self.rows.tocoo()
        (bad,) = np.nonzero(entries.data < 0.0)
        tails, heads = (axis[bad].tolist() for axis in entries.coords)
        weights = entries.data[bad].tolist()
        return [(self.labels[i], self.labels[j], w) for i, j, w in zip(tails, heads, weights, strict=True)]

    @cached_property
    def _by_text(self) -> dict[str, list[Node]]:
        found: dict[str, list[Node]] = {}
        for label in self.labels:
            found.setdefault(str(label), []).append(label)
        return found

    def node(self, text: str) -> Node:
        """
        Return the node whose label reads `text`.

        Raises
        ------
        ScenarioError
            If no node or more than one has this label.
        """
        found = self._by_text.get(text, [])
        if len(found) == 1:
            return found[0]
        if found:
            listed = " and ".join(map(repr, found))
            msg = f"{self.file}: {len(found)} nodes are written {shown(text)}: {listed}; give them labels that differ"
            raise ScenarioError(msg)
        every = [label_text(label) for label in self.labels[:_MOST_NEAR]]
        near = difflib.get_close_matches(text, every, n=3, cutoff=0.5)
        hint = f"did you mean {' or '.join(near)}?" if near else f"it has {', '.join(every[:3])}, …"
        msg = f"{self.file}: none of the {len(self.labels)} nodes is {shown(text)}; {hint}"
        raise ScenarioError(msg)


def read_graph(path: Path, *, weight: str | None = None, directed: bool = False) -> GraphFile:
    """
    Read a graph from a file.

    Parameters
    ----------
    path
        GraphML (``.graphml``), networkx's node-link JSON (``.json``), an edge list (``.csv``: columns ``source`` and
        ``target``, or ``from`` and ``to``, and the weight's name, or these three in this order without a header),
        Matrix Market (``.mtx``, as coordinates) or a sparse matrix of scipy (``.npz``). Of parallel edges the lightest
        counts.
    weight
        The attribute or column that holds the weights; ``weight`` if left out. Infinity means no edge.
    directed
        Whether the edges of an edge list are directed; other files state it themselves.

    Raises
    ------
    ScenarioError
        If the file does not exist, is malformed or too large, an edge has no weight, or an option does not fit the
        format.
    """
    kind = path.suffix.lower()
    if kind not in ENDINGS:
        msg = f"{path}: this is no file of a graph; those end in {', '.join(ENDINGS)}"
        raise ScenarioError(msg)
    if directed and kind != ".csv":
        msg = f"{path}: --directed is for edge lists (.csv); {ENDINGS[kind]} files say whether edges are directed"
        raise ScenarioError(msg)
    if weight is not None and kind in {".mtx", ".npz"}:
        msg = f"{path}: --weight names an attribute or a column; the entries of a matrix have no names"
        raise ScenarioError(msg)
    try:
        return _READERS[kind](path, weight, directed)
    except MemoryError as error:
        msg = f"{path}: it does not fit into memory; give a smaller graph, or a machine with more"
        raise ScenarioError(msg) from error
    except FileFormatError as error:
        raise ScenarioError(str(error)) from error
    except OSError as error:
        msg = f"{path}: cannot be read ({error.strerror or error}); give {ENDINGS[kind]} that you may read"
        raise ScenarioError(msg) from error


def _size(path: Path, most: int) -> int:
    """Return the size of a file, which must be there and not too large."""
    require_file(path)
    size = path.stat().st_size
    if size > most:
        msg = f"{path}: {size / 1e6:.0f} MB are more than the {most / 1e6:.0f} that are read; give the weights as .npz"
        raise ScenarioError(msg)
    return size


def _text(path: Path, kind: str) -> str:
    _size(path, MOST_TEXT)
    return read_text(path, str(path), ENDINGS[kind])


class _GraphMLReader(nx.readwrite.graphml.GraphMLReader):
    """networkx's reader, which keeps numbers as they are written, and parallel edges with one id apart."""

    def __init__(self) -> None:
        super().__init__(force_multigraph=True)
        self._ids = itertools.count()

    def construct_types(self) -> None:
        """Read numbers as text, because `float` and `int` read more than decimal numbers."""
        super().construct_types()
        self.python_type |= dict.fromkeys(("float", "double", "int", "integer", "long"), str)

    def add_edge(self, graph: Any, edge: Element, keys: object) -> None:  # noqa: ANN401 - networkx has no types
        """Add an edge under an id of its own."""
        edge.set("id", str(next(self._ids)))
        super().add_edge(graph, edge, keys)


def _graphml(path: Path, weight: str | None, _directed: bool) -> GraphFile:
    text = _text(path, ".graphml")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        fail(path, "it defines a document type or entities, which are not read", "take them out")
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            found: list[nx.Graph[Any]] = list(_GraphMLReader()(string=text))
    except _MALFORMED as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        wrong = f"cannot be read as {ENDINGS['.graphml']} ({why[:200]})"
        fail(path, wrong, "write it anew, as networkx or scipy does")
    if len(found) != 1:
        fail(path, f"it holds {len(found)} graphs", "give a file with one, in the name space of GraphML")
    (graph,), name = found, weight or "weight"
    edges = EdgeList(path, {label: i for i, label in enumerate(graph.nodes)})
    # GraphML may say once what most edges weigh
    defaults = graph.graph["edge_default"]
    default = defaults.get(name) if isinstance(defaults, dict) else None
    for u, v, data in graph.edges(data=True):
        value, edge = data.get(name, default), f"the edge from {label_text(u)} to {label_text(v)}"
        if value is None:
            hint = f"it has {listed([*map(shown, data)])}: name one (--weight)" if data else "give each edge one"
            fail(path, f"{edge} has no {shown(name)}", hint)
        edges.add(edges.labels[u], edges.labels[v], read_weight(path, edge, value))
    spots = _positions(data for _, data in graph.nodes(data=True))
    return _labelled(edges, directed=graph.is_directed(), positions=spots)


def _node_link(path: Path, weight: str | None, _directed: bool) -> GraphFile:
    edges, directed, nodes = read_node_link(path, _text(path, ".json"), weight or "weight")
    return _labelled(edges, directed=directed, positions=_positions(nodes))


def _positions(nodes: "Iterable[Mapping[str, object]]") -> FloatArray | None:
    """Read the positions of the nodes; None unless each has two finite numbers."""
    places = [cast("Any", data.get("pos", (data.get("x"), data.get("y")))) for data in nodes]
    try:
        pairs = [spot.strip("()[]!").replace(",", " ").split() if isinstance(spot, str) else spot for spot in places]
        found = np.array([[_coordinate(x), _coordinate(y)] for x, y in pairs])
    except (TypeError, ValueError, OverflowError):
        return None
    return found if len(found) and np.isfinite(found).all() else None


def _coordinate(value: object) -> float:
    return decimal(value.strip()) if isinstance(value, str) else float(cast("Any", value))


def _edge_list(path: Path, weight: str | None, directed: bool) -> GraphFile:
    return _labelled(read_edge_list(path, _text(path, ".csv"), weight), directed=directed)


def _matrix_market(path: Path, _weight: str | None, _directed: bool) -> GraphFile:
    size = _size(path, MOST_BYTES)
    with path.open("rb") as stream:
        head = read_head(path, stream, size)
        _check_shape(path, head.shape)
        entries = read_entries(path, stream, head)
    labels = range(1, head.shape[0] + 1)
    found = (entries.tails, entries.heads, entries.weights)
    return _graph_file(path, labels, found, directed=False if head.symmetric else None)


def _npz(path: Path, _weight: str | None, _directed: bool) -> GraphFile:
    _size(path, MOST_BYTES)
    words = read_archive(path, ("format", "shape"), most=MOST_BYTES, kinds="biufSU")
    form = words["format"].item() if words.get("format", np.zeros(2)).size == 1 else b""
    form = form.decode("latin-1") if isinstance(form, bytes) else str(form)
    if "format" not in words or "shape" not in words:
        fail(path, "it does not contain a sparse matrix", "write it with scipy.sparse.save_npz")
    if form not in {"csr", "csc", "coo"}:
        fail(path, f"it is a matrix of format {shown(form)}", "save it as csr, csc or coo")
    shape = _whole(path, "shape", words["shape"]).ravel().tolist()
    _check_shape(path, shape)
    parts = read_archive(path, ("data", "indices", "indptr", "row", "col", "coords"))
    if "coords" in parts and parts["coords"].shape[:1] == (2,):
        parts["row"], parts["col"] = parts["coords"]
    needed = ("row", "col", "data") if form == "coo" else ("indptr", "indices", "data")
    if missing := [name for name in needed if name not in parts]:
        fail(path, f"it has no array {listed(missing)}", "write it with scipy.sparse.save_npz")
    one, other = (_whole(path, name, parts[name]) for name in needed[:2])
    weights = np.asarray(parts["data"], dtype=np.float64)
    if form != "coo":
        one, other, weights = _expanded(path, one, other, weights, shape[0])
    tails, heads = (other, one) if form == "csc" else (one, other)
    if not tails.shape == heads.shape == weights.shape == (weights.size,):
        fail(path, "its arrays differ in length", "write it with scipy.sparse.save_npz")
    for axis in (tails, heads):
        if len(axis) and not 0 <= axis.min() <= axis.max() < shape[0]:
            fail(path, f"it has an index outside of 0 to {shape[0] - 1}", "write it with scipy.sparse.save_npz")
    for bad in np.nonzero(~(weights > -np.inf))[0][:1].tolist():
        read_weight(path, f"the edge from {tails[bad]} to {heads[bad]}", float(weights[bad]))
    return _graph_file(path, range(shape[0]), (tails, heads, weights), directed=None)


def _whole(path: Path, name: str, given: NDArray[Any]) -> IntArray:
    """Return an array of indices."""
    if given.dtype.kind not in "iu":
        fail(path, f"its array {name} is of type {given.dtype}", "give whole numbers, as scipy.sparse.save_npz does")
    return given.astype(np.int64)


def _expanded(
    path: Path, starts: IntArray, indices: IntArray, weights: FloatArray, n: int
) -> tuple[IntArray, IntArray, FloatArray]:
    """Return the row of each entry of a compressed matrix, with its column and weight."""
    counts = np.diff(starts)
    if starts.shape != (n + 1,) or starts[0] != 0 or (counts < 0).any() or starts[-1] > len(indices):
        fail(path, "its array indptr is no list of where rows begin", "write it with scipy.sparse.save_npz")
    return np.repeat(np.arange(n), counts), indices[: starts[-1]], weights[: starts[-1]]


def _check_shape(path: Path, shape: Sequence[int]) -> None:
    if len(shape) != 2 or shape[0] != shape[1] or not 0 < shape[0] <= MOST_NODES:  # noqa: PLR2004 - a matrix
        sizes = " x ".join(map(str, shape))
        fail(path, f"the matrix is {sizes}", f"give a square one of 1 to {MOST_NODES:,} rows")


def _labelled(edges: EdgeList, *, directed: bool, positions: FloatArray | None = None) -> GraphFile:
    found = (edges.tails, edges.heads, edges.weights)
    return _graph_file(edges.path, tuple(edges.labels), found, directed=directed, positions=positions)


def _graph_file(
    path: Path,
    labels: Sequence[Node],
    edges: tuple[Any, Any, Any],
    *,
    directed: bool | None,
    positions: FloatArray | None = None,
) -> GraphFile:
    """Store the edges without loops; where `directed` is None, they are undirected if the matrix is symmetric."""
    if not labels:
        fail(path, "it has no nodes", "give a graph with some")
    tails, heads = (np.array(axis, dtype=np.int64) for axis in edges[:2])
    weights = np.array(edges[2], dtype=np.float64)
    kept: IntArray = np.nonzero(tails != heads)[0]
    if positions is not None:
        positions.flags.writeable = False
    rows = compressed(tails[kept], heads[kept], weights[kept], len(labels), mirrored=directed is False)
    if directed is None:
        other = sparse.csr_array(rows.T)
        pairs = ((rows.indptr, other.indptr), (rows.indices, other.indices), (rows.data, other.data))
        directed = not all(np.array_equal(one, two) for one, two in pairs)
    return GraphFile(path, labels, rows, directed, positions)


_READERS = {
    ".graphml": _graphml,
    ".json": _node_link,
    ".csv": _edge_list,
    ".mtx": _matrix_market,
    ".npz": _npz,
}
