"""Graph files: reading restores the graphs that networkx and scipy write; faults give one line."""

import csv
import io
import json
import math
import struct
import zipfile
from collections.abc import Callable, Hashable
from contextlib import suppress
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
import scipy.io
from hypothesis import assume, given
from hypothesis import strategies as st
from scipy import sparse
from strategies import few, usual

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.study.options import MapOptions
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.scenarios.graphs import graph_file
from cgla_graph.scenarios.graphs.graph_endings import is_graph_file
from cgla_graph.scenarios.graphs.graph_file import read_graph
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.testing.strategies import networks, weight_matrices

Edges = dict[tuple[str, str], float]


def edges_of(graph: GeometricGraph) -> Edges:
    """List the edges, both ways round, by the texts of their nodes."""
    entries = graph.to_csgraph().tocoo()
    names = [str(label) for label in graph.labels]
    tails, heads = (axis.tolist() for axis in entries.coords)
    return {(names[i], names[j]): w for i, j, w in zip(tails, heads, entries.data.tolist(), strict=True)}


def with_plain_labels(graph: "nx.Graph[Any]") -> "nx.Graph[Any]":
    """Name nodes by what JSON has: numbers, text and lists of them."""
    return nx.relabel_nodes(graph, {label: str(label) for label in graph if isinstance(label, frozenset)})


def sparse_of(weights: FloatArray) -> sparse.csr_array:
    """Store all edges, zeros too."""
    return GeometricGraph.from_matrix(weights).to_csgraph()


@usual
@given(graph=networks(), attribute=st.sampled_from([None, "metres per s"]))
def test_graphml_of_networkx(
    graph: "nx.Graph[Hashable]", attribute: str | None, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("graph") / "mine.graphml"
    named = graph.copy()
    if attribute is not None:
        for *_, data in named.edges(data=True):
            data[attribute] = data.pop("weight")
    nx.write_graphml(named, path)

    read = read_graph(path, weight=attribute)

    assert [*read.labels] == [str(label) for label in graph]
    assert read.directed == graph.is_directed()
    assert edges_of(read.graph()) == edges_of(GeometricGraph.from_networkx(graph))
    assert all(str(read.node(str(label))) == str(label) for label in graph)


@usual
@given(drawn=networks(positioned=True), edges=st.sampled_from(["edges", "links"]))
def test_node_link_json_of_networkx(
    drawn: "nx.Graph[Hashable]", edges: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("graph") / "mine.json"
    graph = with_plain_labels(drawn)
    path.write_text(json.dumps(nx.node_link_data(graph, edges=edges)), encoding="utf-8")

    read = read_graph(path)
    mine = GeometricGraph.from_networkx(graph)

    assert [*read.labels] == [*graph]
    assert read.directed == graph.is_directed()
    assert edges_of(read.graph()) == edges_of(mine)
    assert np.array_equal(read.graph().positions, mine.positions)
    assert is_graph_file(str(path))


@usual
@given(drawn=networks(), header=st.booleans(), mark=st.sampled_from(",;\t"))
def test_edge_lists(
    drawn: "nx.Graph[Hashable]", header: bool, mark: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """Nodes without edges are not in a list of edges, nor those whose names are empty."""
    assume("" not in drawn)
    # with other separators than commas, names hold no more commas than separators
    graph = drawn if mark == "," else nx.relabel_nodes(drawn, {node: str(node).replace(",", "") for node in drawn})
    path = tmp_path_factory.mktemp("graph") / "mine.csv"
    text = io.StringIO()
    writer = csv.writer(text, delimiter=mark)
    lines: list[list[object]] = [[u, v, data["weight"]] for u, v, data in graph.edges(data=True)]
    assume(header or lines)
    writer.writerows([["source", "target", "weight"]] * header + lines)
    path.write_text(text.getvalue(), encoding="utf-8-sig")
    if not lines:
        with pytest.raises(ScenarioError, match="no nodes"):
            read_graph(path)
        return

    read = read_graph(path, directed=graph.is_directed())

    assert edges_of(read.graph()) == edges_of(GeometricGraph.from_networkx(graph))
    assert {*read.labels} == {str(node) for line in lines for node in line[:2]}


@usual
@given(weights=weight_matrices(), how=st.sampled_from(["csr", "csc", "coo", "mtx"]))
def test_matrices_of_scipy(weights: FloatArray, how: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    folder = tmp_path_factory.mktemp("graph")
    matrix = sparse_of(weights)
    if how == "mtx":
        path = folder / "mine.mtx"
        scipy.io.mmwrite(path, matrix, precision=17)
    else:
        path = folder / "mine.npz"
        sparse.save_npz(path, matrix.asformat(how))

    read = read_graph(path)
    graph = read.graph()

    first = int(how == "mtx")
    assert [*read.labels] == [*range(first, len(weights) + first)]
    assert read.directed == (not np.array_equal(weights, weights.T))
    assert graph.directed == read.directed
    assert np.array_equal(graph.weight_matrix(), weights)
    assert graph.index_of(read.node(str(first))) == 0


def test_stored_zeros_are_edges_and_make_a_graph_directed(tmp_path: Path) -> None:
    sparse.save_npz(tmp_path / "one.npz", sparse.csr_array(([0.0], ([0], [1])), shape=(2, 2)))

    read = read_graph(tmp_path / "one.npz")

    assert read.directed
    assert edges_of(read.graph()) == {("0", "1"): 0.0}


def test_an_edge_list_may_have_more_columns_in_any_order(tmp_path: Path) -> None:
    path = tmp_path / "more.csv"
    path.write_text("name,minutes,target,source\nmain street,2.5,b,a\n\n lane , 1 , c , b \n", encoding="utf-8")
    assert edges_of(read_graph(path, weight="minutes", directed=True).graph()) == {("a", "b"): 2.5, ("b", "c"): 1.0}


def test_graphml_may_say_once_what_edges_weigh(tmp_path: Path) -> None:
    path = tmp_path / "once.graphml"
    path.write_text(
        '<graphml xmlns="http://graphml.graphdrawing.org/xmlns"><key id="w" for="edge" attr.name="weight" '
        'attr.type="double"><default>4</default></key><graph edgedefault="directed"><node id="a"/><node id="b"/>'
        '<edge source="a" target="b"/><edge source="b" target="a"><data key="w">1</data></edge></graph></graphml>',
        encoding="utf-8",
    )
    assert edges_of(read_graph(path).graph()) == {("a", "b"): 4.0, ("b", "a"): 1.0}


@pytest.mark.parametrize("kind", ["double", "float", "int", "long", "string"])
@pytest.mark.parametrize(
    ("weight", "says"),
    [
        ("1e400", "has weight '1e400', which is too large for a number"),
        ("1_000", "'1_000', which is no number"),
        ("1,5", "'1,5', which has a comma"),
        ("", "which is no number"),
    ],
)
def test_weights_of_graphml_are_decimal_numbers(weight: str, says: str, kind: str, tmp_path: Path) -> None:
    edges = f'<edge source="a" target="b"><data key="w">{weight}</data></edge>'
    (tmp_path / "a.graphml").write_text(graphml(edges, kind), encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        read_graph(tmp_path / "a.graphml")
    assert says in str(error.value)


def test_parallel_edges_of_graphml_with_one_id(tmp_path: Path) -> None:
    """Networkx takes them for one edge, with the last weight."""
    edges = "".join(f'<edge id="e" source="a" target="b"><data key="w">{w}</data></edge>' for w in (3, 2, 4))
    (tmp_path / "a.graphml").write_text(graphml(edges, "double"), encoding="utf-8")
    assert edges_of(read_graph(tmp_path / "a.graphml").graph()) == {("a", "b"): 2.0, ("b", "a"): 2.0}


def graphml(edges: str, kind: str) -> str:
    """Write a document of two nodes; one attribute of the graph has the name of a default."""
    keys = (
        f'<key id="w" for="edge" attr.name="weight" attr.type="{kind}"/>'
        '<key id="d" for="graph" attr.name="edge_default" attr.type="string"/>'
    )
    graph = f'<graph edgedefault="undirected"><data key="d">x</data><node id="a"/><node id="b"/>{edges}</graph>'
    return f'<graphml xmlns="http://graphml.graphdrawing.org/xmlns">{keys}{graph}</graphml>'


@pytest.mark.parametrize(
    ("places", "expected"),
    [
        pytest.param([{"pos": "1.5, 2"}, {"pos": "(0 3)"}], [[1.5, 2.0], [0.0, 3.0]], id="as text"),
        pytest.param([{"x": 1, "y": "2"}, {"x": 0.0, "y": 3}], [[1.0, 2.0], [0.0, 3.0]], id="x and y"),
        pytest.param([{"x": 1, "y": 2}, {}], None, id="not all"),
        pytest.param([{"pos": [1, 2, 3]}, {"pos": [1, 2, 3]}], None, id="in space"),
        pytest.param([{"pos": "1, inf"}, {"pos": "1, 2"}], None, id="infinite"),
        pytest.param([{"pos": {"at": 1}}, {"pos": None}], None, id="something else"),
    ],
)
def test_places_of_nodes_are_taken_if_all_have_them(
    places: list[dict[str, object]], expected: list[list[float]] | None, tmp_path: Path
) -> None:
    nodes = [{"id": number, **place} for number, place in enumerate(places)]
    (tmp_path / "g.json").write_text(json.dumps({"nodes": nodes, "edges": []}), encoding="utf-8")
    positions = read_graph(tmp_path / "g.json").graph().positions
    assert (None if positions is None else positions.tolist()) == expected


def test_nodes_are_named_by_the_text_of_their_labels(tmp_path: Path) -> None:
    nodes = [{"id": 1}, {"id": "1"}, {"id": [1, "a"]}, {"id": "depot"}, {"id": "two\nlines"}]
    (tmp_path / "g.json").write_text(json.dumps({"nodes": nodes, "links": []}), encoding="utf-8")
    read = read_graph(tmp_path / "g.json")

    assert read.node("(1, 'a')") == (1, "a")
    assert read.node("two\nlines") == "two\nlines"
    with pytest.raises(ScenarioError, match="2 nodes are written '1': 1 and '1'; give them labels that differ"):
        read.node("1")
    with pytest.raises(ScenarioError, match="none of the 5 nodes is 'depo'; did you mean depot"):
        read.node("depo")
    with pytest.raises(ScenarioError, match="it has 1, 1, "):
        read.node("€")


def test_graph_files_are_recognised_by_ending_or_content(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "zones.json").write_text('{"type": "FeatureCollection", "features": []}', encoding="utf-8")
    (tmp_path / "roads.json").write_text('{"nodes": [], "edges": []}', encoding="utf-8")
    (tmp_path / "bad.json").write_text("[" * 100_000, encoding="utf-8")
    others = ["paper", "a.toml", "zones.json", "bad.json", "nowhere.json", "x" * 5000 + ".json"]
    specs = ["a.graphml", "A.NPZ", "roads.json", *others]
    assert [spec for spec in specs if is_graph_file(spec)] == specs[:3]


GRAPHML = '<graphml xmlns="http://graphml.graphdrawing.org/xmlns">BODY</graphml>'
BOMB = '<!DOCTYPE x [<!ENTITY a "aaaa"><!ENTITY b "&a;&a;&a;">]>' + GRAPHML.replace("BODY", "&b;")
ONE_EDGE = '{"nodes": [{"id": 1}, {"id": 2}], "edges": [{"source": 1, "target": 2WEIGHT}]}'
HEAD = "%%MatrixMarket matrix "
TEXTS = [
    pytest.param("a.txt", "", "no file of a graph", id="ending"),
    pytest.param("a.graphml", "<graphml>", "cannot be read as a GraphML file (ParseError", id="XML that does not end"),
    pytest.param("a.graphml", "<html/>", "0 graphs", id="other XML"),
    pytest.param("a.graphml", BOMB, "document type or entities", id="entities"),
    pytest.param("a.graphml", GRAPHML.replace("BODY", "<graph/>"), "no nodes", id="empty graph"),
    pytest.param("a.graphml", GRAPHML.replace("BODY", "<graph/><graph/>"), "2 graphs", id="two graphs"),
    pytest.param(
        "a.graphml",
        GRAPHML.replace("BODY", '<graph><node id="a"><data key="k">1</data></node></graph>'),
        "no key k",
        id="unknown key",
    ),
    pytest.param("a.json", "[1]", "no lists nodes and edges", id="a list"),
    pytest.param("a.json", '{"nodes": [{"id": {}}], "edges": []}', "id {}, which cannot be a node", id="no label"),
    pytest.param("a.json", '{"nodes": [{"id": null}], "edges": []}', "id null, which cannot be a node", id="null"),
    pytest.param("a.json", '{"nodes": [1], "edges": []}', "entry 0 of nodes is 1; give an object", id="no record"),
    pytest.param("a.json", '{"nodes": [], "edges": []}', "no nodes", id="no nodes"),
    pytest.param(
        "a.json",
        '{"nodes": [{"id": 1}, {"id": 1}], "edges": []}',
        "0 and 1 have the id 1",
        id="twice",
    ),
    pytest.param(
        "a.json",
        '{"nodes": [], "edges": [{"source": 1, "target": 2}]}',
        "edges end in 1, which",
        id="unlisted",
    ),
    pytest.param("a.json", "[" * 100_000, "nested more than 64 deep", id="deep JSON"),
    pytest.param("a.json", '{"nodes": [' + "9" * 9999, "thousands of digits", id="long number"),
    pytest.param("a.json", ONE_EDGE.replace("WEIGHT", ""), "(entry 0) has no 'weight'", id="no weight"),
    pytest.param("a.json", ONE_EDGE.replace("WEIGHT", ', "m": 1'), "it has 'm': name one (--weight)", id="another"),
    *(
        pytest.param("a.json", ONE_EDGE.replace("WEIGHT", f', "weight": {bad}'), "has weight", id=f"weight {bad}")
        for bad in ("true", '"heavy"', "[1]", "NaN", "-Infinity", "1" + "0" * 400)
    ),
    pytest.param("a.csv", "\n,,\n", "no edges", id="blank CSV"),
    pytest.param("a.csv", "source,target,weight\n", "no nodes", id="header only"),
    pytest.param("a.csv", "a,b,1\nb,c\n", "line 2 is 'b,c'", id="short line"),
    pytest.param("a.csv", "a,b,1\n,c,1\n", "line 2", id="empty name"),
    pytest.param("a.csv", "u,v,length\na,b,1\n", "the first line has weight 'length'", id="another header"),
    pytest.param(
        "a.csv", "source,target,length\na,b,1\n", "no column 'weight', but source, target, length", id="column"
    ),
    pytest.param("a.csv", "a,b,nan\n", "the first line has weight 'nan'", id="no number"),
    pytest.param("a.csv", 'a,b,"1\n', "line 1", id="open quote"),
    pytest.param("a.csv", "a" * 200_000 + ",b,1\n", "field larger", id="long field"),
    pytest.param("a.mtx", "hello\n", "Matrix Market", id="no head"),
    pytest.param("a.mtx", HEAD + "coordinate real general\n2 3 1\n1 2 1\n", "2 x 3", id="not square"),
    pytest.param("a.mtx", HEAD + "coordinate real general\n0 0 0\n", "0 x 0", id="no rows"),
    pytest.param(
        "a.mtx",
        HEAD + "coordinate real general\n2 2 1\n1 3 1\n",
        "outside of the matrix",
        id="beyond",
    ),
    pytest.param("a.mtx", HEAD + "coordinate real general\n2 2 2\n1 2 1\n", "but it has 1", id="cut off"),
    pytest.param("a.mtx", HEAD + "coordinate real general\n2 2 99999\n1 2 1\n", "promises 99999 entries", id="promise"),
    pytest.param("a.mtx", HEAD + "coordinate real general\n999999999 999999999 1\n1 2 1\n", "10,000,000", id="huge"),
    pytest.param("a.mtx", HEAD + "coordinate complex general\n2 2 1\n1 2 1 1\n", "complex", id="complex"),
    pytest.param("a.mtx", HEAD + "array real general\n2 2\n1\n2\n3\n4\n", "dense array", id="dense"),
    pytest.param("a.mtx", HEAD + "coordinate real general\n2 2 1\n1 2 nan\n", "'nan', which is no number", id="nan"),
    pytest.param("a.npz", "hello", "not a zip file", id="no zip"),
]


@pytest.mark.parametrize(("name", "text", "says"), TEXTS)
def test_malformed_files_are_refused_in_one_line(name: str, text: str, says: str, tmp_path: Path) -> None:
    path = tmp_path / name
    path.write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        read_graph(path)
    assert says in str(error.value)
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)
    assert len(str(error.value)) < 500


@pytest.mark.parametrize("name", ["a.graphml", "a.json", "a.csv", "a.mtx", "a.npz"])
def test_files_that_cannot_be_read(name: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def refused(says: str) -> None:
        with pytest.raises(ScenarioError, match=says):
            read_graph(tmp_path / name)

    refused("there is no such file")
    (tmp_path / name).mkdir()
    refused("this is no file")
    (tmp_path / name).rmdir()
    (tmp_path / name).write_bytes('<?xml version="1.0" encoding="utf-16"?><graphml/>'.encode("utf-16"))
    refused("cannot be read|Matrix Market" if name in {"a.mtx", "a.npz"} else "is not UTF-8")
    monkeypatch.setattr(graph_file, "MOST_TEXT", 3)
    monkeypatch.setattr(graph_file, "MOST_BYTES", 3)
    refused("MB are more than")


@pytest.mark.parametrize(
    ("name", "how", "says"),
    [
        ("a.graphml", {"directed": True}, "--directed is for edge lists"),
        ("a.mtx", {"weight": "m"}, "--weight names an attribute"),
        ("a.csv", {"weight": "m"}, "no header, and so no column 'm'"),
    ],
)
def test_options_that_do_not_fit(name: str, how: dict[str, Any], says: str, tmp_path: Path) -> None:
    (tmp_path / name).write_text("a,b,1\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=says):
        read_graph(tmp_path / name, **how)


def npz(path: Path, **arrays: Any) -> Path:  # noqa: ANN401 - anything that numpy saves
    np.savez(path, **arrays)
    return path


GOOD = {"format": b"csr", "shape": [2, 2], "data": [1.0], "indices": [1], "indptr": [0, 1, 1]}


@pytest.mark.parametrize(
    ("change", "says"),
    [
        pytest.param({"indices": [7]}, "index outside of 0 to 1", id="index beyond"),
        pytest.param({"indptr": [0, 9, 1]}, "no list of where rows begin", id="rows out of order"),
        pytest.param({"shape": [10**9, 10**9]}, "10,000,000", id="huge"),
        pytest.param({"shape": [1, 2], "indptr": [0, 1]}, "1 x 2", id="not square"),
        pytest.param({"format": b"sql"}, "of format 'sql'", id="unknown format"),
        pytest.param({"format": b"dia", "offsets": [0], "data": [[1.0, 1.0]]}, "of format 'dia'", id="dia"),
        pytest.param({"data": [1j]}, "it holds the type complex128", id="complex"),
        pytest.param({"data": [np.nan]}, "from 0 to 1 has weight nan", id="nan"),
        pytest.param({"data": np.array([{"code": 1}])}, "allow_pickle", id="pickled object"),
        pytest.param({"format": np.array({"code": 1})}, "allow_pickle", id="pickled format"),
    ],
)
def test_hostile_matrices(change: dict[str, Any], says: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError, match=says):
        read_graph(npz(tmp_path / "a.npz", **{**GOOD, **change}))
    assert edges_of(read_graph(npz(tmp_path / "b.npz", **GOOD)).graph()) == {("0", "1"): 1.0}


def test_other_archives(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(ScenarioError, match="does not contain a sparse"):
        read_graph(npz(tmp_path / "dense.npz", weights=np.eye(2)))
    cut = tmp_path / "cut.npz"
    sparse.save_npz(cut, sparse.eye_array(100, format="csr"))
    cut.write_bytes(cut.read_bytes()[:300])
    with pytest.raises(ScenarioError, match="cannot be read"):
        read_graph(cut)
    # an array that promises more than there is
    head = "{'descr': '<f8', 'fortran_order': False, 'shape': (1000000000000000,), }".ljust(118) + "\n"
    with zipfile.ZipFile(npz(tmp_path / "promise.npz", **{k: v for k, v in GOOD.items() if k != "data"}), "a") as parts:
        parts.writestr("data.npy", b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode())
    with pytest.raises(ScenarioError, match="it is cut off"):
        read_graph(tmp_path / "promise.npz")
    # a small file of many zeros
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as parts:
        parts.writestr("data.npy", b"0" * 100_000)
    monkeypatch.setattr(graph_file, "MOST_BYTES", 50_000)
    with pytest.raises(ScenarioError, match="unpacked"):
        read_graph(tmp_path / "bomb.npz")


@few
@given(data=st.binary(max_size=200), name=st.sampled_from(["a.graphml", "a.json", "a.csv", "a.mtx", "a.npz"]))
def test_any_bytes_are_read_or_refused(data: bytes, name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    path = tmp_path_factory.mktemp("graph") / name
    path.write_bytes(data)
    with suppress(ScenarioError):
        read_graph(path)


def test_weights_below_0_are_read_but_not_planned_with(tmp_path: Path) -> None:
    path = tmp_path / "below.csv"
    path.write_text("a,b,-1\nb,c,2\n", encoding="utf-8")
    read = read_graph(path)
    assert read.below_zero() == [("a", "b", -1.0), ("b", "a", -1.0)]
    with pytest.raises(ScenarioError, match="from a to b has weight -1; weights must be at least 0"):
        read.graph()


def test_infinite_weights_are_no_edges(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text("a,b,inf\nb,c,2\n", encoding="utf-8")
    read = read_graph(tmp_path / "a.csv")
    assert (read.n_edges, len(read.labels)) == (1, 3)
    assert math.isinf(read.graph().weight(0, 1))


@pytest.mark.parametrize("name", ["missing.json", "no/where.npy", "missing.geojson", "missing.csv", "missing.txt"])
def test_what_is_not_there_is_no_such_file(name: str) -> None:
    """Through every door that takes a name or a file."""
    calls: list[Callable[[], object]] = [
        lambda: list(open_scenarios(name)),
        lambda: load_scenario(name),
        lambda: load_mission(name),
        lambda: list(MapOptions().open(name)),
    ]
    if Path(name).suffix in {".json", ".csv"}:
        calls.append(lambda: read_graph(Path(name)))
    for call in calls:
        with pytest.raises(CglaError, match=f"{name}: there is no such file"):
            call()
