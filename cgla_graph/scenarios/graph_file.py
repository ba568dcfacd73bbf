"""Graphs in files: GraphML, node-link JSON, edge lists (CSV), Matrix Market and scipy's ``.npz``."""

import csv
import difflib
import io
import itertools
import json
import math
import re
import zipfile
import zlib
from array import array
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast
from xml.etree.ElementTree import ParseError

import networkx as nx
import numpy as np
import scipy.io
from scipy import sparse

from cgla_graph._text import cut, shown
from cgla_graph._types import FloatArray, IntArray
from cgla_graph._validate import NO_NUMBERS, number_array
from cgla_graph.errors import ScenarioError
from cgla_graph.model.adjacency import Node, compressed, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.weights import SparseWeights
from cgla_graph.scenarios.graph_endings import ENDINGS, MOST_TEXT
from cgla_graph.scenarios.text_files import read_text

#: Limits of matrices.
MOST_BYTES = 4_000_000_000
MOST_NODES = 10_000_000
#: The nearest names to an unknown one are looked for among this many labels.
_MOST_NEAR = 20_000
#: Exceptions that other libraries' readers raise for a malformed file.
_MALFORMED = (
    ArithmeticError,
    AttributeError,
    EOFError,
    LookupError,
    OSError,
    ParseError,
    RuntimeError,
    TypeError,
    ValueError,
    nx.NetworkXException,
    zipfile.BadZipFile,
    zlib.error,
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
        lightest of parallel edges counts, entries of a matrix in one place are added up, loops are left out.
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
                "must be at least 0 (Theorem 1): cgla graph check says what holds without"
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

    def node(self, text: str) -> Node:
        """
        Return the node whose label reads `text`.

        Raises
        ------
        ScenarioError
            If no node or more than one has this label.
        """
        found = [label for label in self.labels if str(label) == text]
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
        GraphML (``.graphml``), networkx's node-link JSON (``.json``), an edge list (``.csv``: columns ``source``,
        ``target`` and the weight's name, or these three in this order without a header), Matrix Market (``.mtx``, as
        coordinates) or a sparse matrix of scipy (``.npz``).
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
        msg = f"{path}: --directed is for edge lists (.csv); {ENDINGS[kind]} says itself what is directed"
        raise ScenarioError(msg)
    if weight is not None and kind in {".mtx", ".npz"}:
        msg = f"{path}: --weight names an attribute or a column; the entries of a matrix have no names"
        raise ScenarioError(msg)
    try:
        if kind == ".csv":
            return _edge_list(path, weight, directed=directed)
        if kind in {".mtx", ".npz"}:
            return _of_matrix(path, _matrix_market(path) if kind == ".mtx" else _npz(path), first=int(kind == ".mtx"))
        return _of_networkx(path, _graphml(path) if kind == ".graphml" else _node_link(path), weight or "weight")
    except ScenarioError:
        raise
    except MemoryError as error:
        msg = f"{path}: it does not fit into memory; give a smaller graph, or a machine with more"
        raise ScenarioError(msg) from error
    except _MALFORMED as error:
        why = " ".join(f"{type(error).__name__}: {error}".split())
        msg = f"{path}: cannot be read as {ENDINGS[kind]} ({why[:200]}); write it anew, as networkx or scipy does"
        raise ScenarioError(msg) from error


def _size(path: Path, most: int) -> int:
    """Return the size of a file, which must be there and not too large."""
    if not path.is_file():
        there = "this is no file" if path.exists() else "there is no such file"
        msg = f"{path}: {there}: check the name and the folder"
        raise ScenarioError(msg)
    size = path.stat().st_size
    if size > most:
        msg = f"{path}: {size / 1e6:.0f} MB are more than the {most / 1e6:.0f} that are read; give the weights as .npz"
        raise ScenarioError(msg)
    return size


def _text(path: Path, kind: str) -> str:
    _size(path, MOST_TEXT)
    return read_text(path, str(path), ENDINGS[kind])


def _graphml(path: Path) -> "nx.Graph[Any]":
    text = _text(path, ".graphml")
    if "<!DOCTYPE" in text or "<!ENTITY" in text:
        msg = f"{path}: it defines a document type or entities, which are not read; take them out"
        raise ScenarioError(msg)
    found: list[nx.Graph[Any]] = list(cast("Any", nx.readwrite.graphml.GraphMLReader)()(string=text))
    if len(found) != 1:
        msg = f"{path}: it holds {len(found)} graphs; give a file with one, in the name space of GraphML"
        raise ScenarioError(msg)
    return found[0]


def _node_link(path: Path) -> "nx.Graph[Any]":
    data = json.loads(_text(path, ".json"))
    edges = "links" if isinstance(data, dict) and "links" in data else "edges"
    if not isinstance(data, dict) or not {"nodes", edges} <= data.keys():
        msg = f"{path}: it has no lists nodes and edges (or links); write it as networkx.node_link_data gives it"
        raise ScenarioError(msg)
    graph = nx.node_link_graph(data, edges=edges)
    if len(graph) != len(data["nodes"]):
        msg = (
            f"{path}: it lists {len(data['nodes'])} nodes, but {len(graph)} are in lists and edges; list each node "
            "once, with an id of its own, and those of all edges"
        )
        raise ScenarioError(msg)
    return graph


def _of_networkx(path: Path, graph: "nx.Graph[Any]", weight: str) -> GraphFile:
    labels = tuple(graph.nodes)
    index = {label: i for i, label in enumerate(labels)}
    tails, heads, weights = array("q"), array("q"), array("d")
    # GraphML may say once what most edges weigh
    default = graph.graph.get("edge_default", {})
    default = default if isinstance(default, dict) else {}
    for u, v, data in graph.edges(data=True):
        value = data.get(weight, default.get(weight))
        edge = f"the edge from {label_text(u)} to {label_text(v)}"
        if value is None:
            others = ", ".join(map(shown, data))
            hint = f"it has {others}: name one (--weight)" if others else "give each edge one"
            msg = f"{path}: {edge} has no {shown(weight)}; {hint}"
            raise ScenarioError(msg)
        tails.append(index[u])
        heads.append(index[v])
        weights.append(_weight(path, edge, value))
    spots = _positions(graph)
    return _graph_file(path, labels, (tails, heads, weights), directed=graph.is_directed(), positions=spots)


def _weight(path: Path, edge: str, value: object) -> float:
    """Read a weight: a number, or a number written as text."""
    try:
        number = float(cast("Any", value)) if isinstance(value, str) or not isinstance(value, NO_NUMBERS) else math.nan
    except (TypeError, ValueError, OverflowError):
        number = math.nan
    if not number > -math.inf:
        msg = f"{path}: {edge} has weight {shown(value)}; give a number, or leave the edge out"
        raise ScenarioError(msg)
    return number


def _positions(graph: "nx.Graph[Any]") -> FloatArray | None:
    """Read the positions of the nodes; None unless each has two finite numbers."""
    places = [data.get("pos", (data.get("x"), data.get("y"))) for _, data in graph.nodes(data=True)]
    try:
        pairs = [spot.strip("()[]!").replace(",", " ").split() if isinstance(spot, str) else spot for spot in places]
        found = np.array([[float(x), float(y)] for x, y in pairs])
    except (TypeError, ValueError, OverflowError):
        return None
    return found if len(found) and np.isfinite(found).all() else None


def _edge_list(path: Path, weight: str | None, *, directed: bool) -> GraphFile:
    lines = _lines(_text(path, ".csv"))
    first = next(lines, None)
    if first is None:
        msg = f"{path}: it has no edges; give lines source,target,weight"
        raise ScenarioError(msg)
    columns, names = [0, 1, 2], ["source", "target", weight or "weight"]
    if {"source", "target"} <= set(first[1]):
        for name in names:
            if name not in first[1]:
                there = cut(", ".join(first[1]))
                msg = f"{path}: it has no column {shown(name)}, but {there}; name that of weights (--weight)"
                raise ScenarioError(msg)
        columns = [first[1].index(name) for name in names]
    elif weight is not None:
        msg = f"{path}: it has no header, and so no column {shown(weight)}; begin it with source,target,{weight}"
        raise ScenarioError(msg)
    else:
        lines = itertools.chain([first], lines)
    index: dict[str, int] = {}
    tails, heads, weights = array("q"), array("q"), array("d")
    for number, cells in lines:
        if len(cells) <= max(columns) or not (cells[columns[0]] and cells[columns[1]]):
            msg = f"{path}: line {number} is {shown(','.join(cells))}; give source,target,weight in each line"
            raise ScenarioError(msg)
        tail, head, value = (cells[column] for column in columns)
        tails.append(index.setdefault(tail, len(index)))
        heads.append(index.setdefault(head, len(index)))
        weights.append(_weight(path, f"line {number}", value))
    return _graph_file(path, tuple(index), (tails, heads, weights), directed=directed)


def _lines(text: str) -> Iterator[tuple[int, list[str]]]:
    """Yield the number and the cells of each non-empty line of a CSV file, separated by commas, semicolons or tabs."""
    start = re.sub(r'"[^"]*"', "", text.lstrip().partition("\n")[0])
    reader = csv.reader(io.StringIO(text, newline=""), delimiter=max("\t;,", key=start.count), strict=True)
    try:
        for row in reader:
            cells = [cell.strip() for cell in row]
            if any(cells):
                yield reader.line_num, cells
    except csv.Error as error:
        msg = f"line {reader.line_num}: {error}"
        raise ValueError(msg) from error


def _matrix_market(path: Path) -> Any:  # noqa: ANN401 - a sparse matrix of scipy
    size = _size(path, MOST_BYTES)
    rows, columns, entries, form, kind, _ = scipy.io.mminfo(str(path))
    _check_shape(path, (rows, columns))
    if form != "coordinate":
        msg = (
            f"{path}: it is a dense array, where a zero may be an edge of weight 0 or none; write the edges as "
            "coordinates, as scipy.io.mmwrite does with a sparse matrix"
        )
        raise ScenarioError(msg)
    # the shortest entry is "1 1" and the end of the line
    if 4 * entries > size + 1:
        msg = f"{path}: its head promises {entries} entries, more than {size} bytes hold; write it anew"
        raise ScenarioError(msg)
    if kind == "complex":
        msg = f"{path}: its entries are complex numbers; give real ones"
        raise ScenarioError(msg)
    return scipy.io.mmread(str(path))


def _npz(path: Path) -> Any:  # noqa: ANN401 - a sparse matrix of scipy
    _size(path, MOST_BYTES)
    with zipfile.ZipFile(path) as parts:
        size = sum(part.file_size for part in parts.infolist())
    if size > MOST_BYTES:
        msg = f"{path}: unpacked it has {size / 1e6:.0f} MB, more than the {MOST_BYTES / 1e6:.0f} that are read"
        raise ScenarioError(msg)
    # this never reads pickled objects, in old versions of scipy and numpy either
    found = cast("Any", sparse.load_npz(path))
    _check_shape(path, found.shape)
    if found.format not in {"csr", "csc", "coo"}:
        msg = f"{path}: it is a matrix of format {found.format}; save it as csr, csc or coo"
        raise ScenarioError(msg)
    if found.format != "coo":
        # the indices are not checked yet
        found.check_format(full_check=True)
    return found


def _check_shape(path: Path, shape: Sequence[int]) -> None:
    if len(shape) != 2 or shape[0] != shape[1] or not 0 < shape[0] <= MOST_NODES:  # noqa: PLR2004 - a matrix
        sizes = " x ".join(map(str, shape))
        msg = f"{path}: the matrix is {sizes}; give a square one of 1 to {MOST_NODES:,} rows"
        raise ScenarioError(msg)


def _of_matrix(path: Path, matrix: Any, first: int) -> GraphFile:  # noqa: ANN401 - a sparse matrix of scipy
    given = sparse.csr_array(matrix)
    rows = sparse.csr_array((number_array("its entries", given.data), given.indices, given.indptr), shape=given.shape)
    rows.sum_duplicates()
    entries = rows.tocoo()
    n = rows.shape[0]
    labels = range(n) if first == 0 else tuple(range(first, n + first))
    tails, heads = entries.coords
    for bad in np.nonzero(~(entries.data > -np.inf))[0][:1].tolist():
        tail, head = tails[bad] + first, heads[bad] + first
        _weight(path, f"the edge from {tail} to {head}", float(entries.data[bad]))
    return _graph_file(path, labels, (tails, heads, entries.data), directed=not _is_symmetric(entries))


def _is_symmetric(entries: sparse.coo_array) -> bool:
    """Return whether a matrix and its transpose store the same entries, zeros included."""
    tails, heads = entries.coords
    one, other = np.lexsort((heads, tails)), np.lexsort((tails, heads))
    return bool(
        np.array_equal(tails[one], heads[other])
        and np.array_equal(heads[one], tails[other])
        and np.array_equal(entries.data[one], entries.data[other])
    )


def _graph_file(
    path: Path,
    labels: Sequence[Node],
    edges: tuple[Any, Any, Any],
    *,
    directed: bool,
    positions: FloatArray | None = None,
) -> GraphFile:
    """Store the edges: no loops, and the lightest of parallel edges."""
    if not labels:
        msg = f"{path}: it has no nodes; give a graph with some"
        raise ScenarioError(msg)
    tails, heads = (np.array(axis, dtype=np.int64) for axis in edges[:2])
    weights = np.array(edges[2], dtype=np.float64)
    kept: IntArray = np.nonzero(tails != heads)[0]
    if positions is not None:
        positions.flags.writeable = False
    rows = compressed(tails[kept], heads[kept], weights[kept], len(labels), mirrored=not directed)
    return GraphFile(path, labels, rows, directed, positions)
