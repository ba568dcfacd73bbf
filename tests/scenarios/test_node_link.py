"""Node-link JSON: what versions of networkx and other programs write, and what is refused."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import damaged, few, usual

from cgla_graph.errors import ScenarioError
from cgla_graph.scenarios.graphs.graph_file import GraphFile, read_graph

Edges = dict[tuple[str, str], float]
NODES = [{"id": "a"}, {"id": "b"}, {"id": "c"}]
EDGES = [{"source": "a", "target": "b", "weight": 2.5}, {"source": "b", "target": "c", "weight": 1}]
BOTH_WAYS = {("a", "b"): 2.5, ("b", "a"): 2.5, ("b", "c"): 1.0, ("c", "b"): 1.0}


def write(folder: Path, **parts: Any) -> Path:  # noqa: ANN401 - any JSON
    """Write a document of three nodes, with other parts than usual."""
    document = {"directed": False, "multigraph": False, "graph": {}, "nodes": NODES, "edges": EDGES} | parts
    path = folder / "a.json"
    path.write_text(json.dumps({key: value for key, value in document.items() if value != "-"}), encoding="utf-8")
    return path


def edges_of(read: GraphFile) -> Edges:
    """Return the edges, both ways round."""
    entries = read.rows.tocoo()
    tails, heads = (axis.tolist() for axis in entries.coords)
    names = [str(label) for label in read.labels]
    return {(names[u], names[v]): w for u, v, w in zip(tails, heads, entries.data.tolist(), strict=True)}


@pytest.mark.parametrize(
    "parts",
    [
        pytest.param({"graph": []}, id="networkx 1: a list"),
        pytest.param({"graph": [["name", "roads"], ["node_default", {}]]}, id="networkx 1: pairs"),
        pytest.param({"graph": None}, id="null"),
        pytest.param({"graph": "-"}, id="no graph"),
        pytest.param({"graph": "roads"}, id="text"),
        pytest.param({"graph": {"edge_default": None}}, id="no defaults"),
        pytest.param({"links": []}, id="links that are empty"),
        pytest.param({"links": None}, id="links that are null"),
        pytest.param({"links": EDGES, "edges": []}, id="edges that are empty"),
        pytest.param({"links": EDGES, "edges": "-"}, id="links alone"),
        pytest.param({"links": EDGES}, id="both, the same"),
        pytest.param({"directed": "false"}, id="false as text"),
        pytest.param({"directed": "False"}, id="False as text"),
        pytest.param({"directed": None}, id="directed is null"),
        pytest.param({"directed": "-"}, id="nothing said"),
        pytest.param({"multigraph": "false"}, id="multigraph as text"),
        pytest.param(
            {"graph": [], "edges": [{**edge, "source": i, "target": i + 1} for i, edge in enumerate(EDGES)]},
            id="networkx 1: ends are places",
        ),
    ],
)
def test_one_graph_in_many_forms(parts: dict[str, Any], tmp_path: Path) -> None:
    read = read_graph(write(tmp_path, **parts))
    assert not read.directed
    assert edges_of(read) == BOTH_WAYS


@pytest.mark.parametrize("directed", [True, "true", "True"])
def test_directed_graphs(directed: object, tmp_path: Path) -> None:
    read = read_graph(write(tmp_path, directed=directed))
    assert read.directed
    assert edges_of(read) == {("a", "b"): 2.5, ("b", "c"): 1.0}


ONE = '{"nodes": [{"id": "a"}, {"id": "b"}], "edges": [{"source": "a", "target": "b", "weight": WEIGHT}]}'


def edge(weight: str) -> str:
    """Write a document with one edge of this weight."""
    return (
        f'{{"nodes": [{{"id": "a"}}, {{"id": "b"}}], "edges": [{{"source": "a", "target": "b", "weight": {weight}}}]}}'
    )


@pytest.mark.parametrize(
    ("weight", "says"),
    [
        ("null", "the edge from a to b has weight null; give a number, or leave the edge out"),
        ("true", "has weight true"),
        ('"1,5"', 'has weight "1,5", which has a comma'),
        ('"1_000"', "which is no number"),
        ('"1e400"', 'has weight "1e400", which is too large'),
        ("1e400", "1e400 is too large for a number"),
        ("-1E+999", "-1E+999 is too large for a number"),
        ("1" + "0" * 400, "is too large for a number"),
        ("[1]", "has weight [1]"),
        ("-Infinity", "has weight -Infinity"),
    ],
)
def test_weights_are_quoted_as_they_stand(weight: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(edge(weight), encoding="utf-8")
    with pytest.raises(ScenarioError) as error:
        read_graph(tmp_path / "a.json")
    assert says in str(error.value)
    assert "--weight" not in str(error.value)


@pytest.mark.parametrize(
    ("parts", "says"),
    [
        ({"directed": "no"}, 'its directed is "no"; write true or false'),
        ({"directed": 2}, "its directed is 2"),
        ({"links": EDGES[:1]}, "both edges and links, and they differ"),
        ({"edges": None}, "no lists nodes and edges (or links)"),
        ({"edges": {}}, "no lists nodes and edges (or links)"),
        ({"nodes": {"a": {}}}, "no lists nodes and edges (or links)"),
        ({"nodes": [*NODES, {"id": "a"}]}, 'nodes 0 and 3 have the id "a"'),
        ({"nodes": NODES[:2]}, 'edges end in "c", which is no id of its 2 nodes'),
        ({"nodes": [{"id": ["x", None]}, *NODES]}, "id null, which cannot be a node"),
        ({"edges": [["a", "b", 1]]}, 'entry 0 of edges is ["a", "b", 1]; give an object with source and target'),
        ({"edges": [{"source": "a", "weight": 1}]}, "give an object with source and target"),
        ({"edges": [{"source": "a", "target": {}, "weight": 1}]}, "entry 0 of edges has the end {}"),
        ({"edges": [{"source": 0, "target": 1, "weight": 1}]}, "edges end in 0, which is no id"),
        (
            {
                "graph": [],
                "nodes": [{"id": 1}, {"id": 0}],
                "edges": [{"source": 0, "target": 0, "weight": 1}],
            },
            "counts nodes",
        ),
    ],
)
def test_faults(parts: dict[str, Any], says: str, tmp_path: Path) -> None:
    with pytest.raises(ScenarioError) as error:
        read_graph(write(tmp_path, **parts))
    assert says in str(error.value)


def test_a_key_that_stands_twice_is_refused(tmp_path: Path) -> None:
    (tmp_path / "a.json").write_text(edge('1, "weight": 2'), encoding="utf-8")
    with pytest.raises(ScenarioError, match="the key 'weight' stands twice"):
        read_graph(tmp_path / "a.json")


@usual
@given(
    ends=st.lists(st.tuples(*[st.sampled_from("abc")] * 2, st.integers(0, 9)), max_size=8),
    directed=st.booleans(),
    multigraph=st.booleans(),
)
def test_of_parallel_edges_the_lightest_counts(
    ends: list[tuple[str, str, int]], directed: bool, multigraph: bool, tmp_path_factory: pytest.TempPathFactory
) -> None:
    """In a file that says that there are none, too."""
    edges = [{"source": u, "target": v, "weight": w, "key": 0} for u, v, w in ends]
    path = write(tmp_path_factory.mktemp("links"), edges=edges, directed=directed, multigraph=multigraph)
    expected: Edges = {}
    for u, v, weight in ends:
        for pair in ((u, v), (v, u))[: 2 - directed]:
            if u != v:
                expected[pair] = min(weight, expected.get(pair, weight))
    assert edges_of(read_graph(path)) == expected


SEED = json.dumps({"directed": False, "graph": {}, "nodes": NODES, "links": EDGES})


@few
@given(text=damaged(SEED, '{}[]:,"0159.eE+-ntf \0abx'))
def test_changed_characters_give_the_strict_reading_or_an_error(
    text: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    path = tmp_path_factory.mktemp("links") / "a.json"
    path.write_text(text, encoding="utf-8")
    try:
        read = read_graph(path)
    except ScenarioError:
        return
    document = json.loads(text)
    expected: Edges = {}
    for link in document.get("links") or document.get("edges") or []:
        u, v, weight = str(link["source"]), str(link["target"]), float(link["weight"])
        for pair in ((u, v), (v, u))[: 2 - read.directed]:
            if u != v:
                expected[pair] = min(weight, expected.get(pair, weight))
    assert edges_of(read) == expected
    assert read.directed == (document.get("directed") is True)
