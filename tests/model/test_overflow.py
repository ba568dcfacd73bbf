"""Weights at the edges of what floats hold: negative zero, and sums beyond the largest float."""

import math
from pathlib import Path

import networkx as nx
import numpy as np
import pytest
import scipy.sparse
from command_line import Call
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph.errors import GraphError
from cgla_graph.scenarios.graphs.graph_file import read_graph

SAYS = r"the weights along a path add up to more than 1.8e\+308, the largest float; divide all weights by one number"
ON_GRAPHS = [name for name in cg.solvers.names() if cg.solvers.traits(name).exact]
NO = math.inf
HUGE = cg.GeometricGraph.from_matrix([[0, 1e308, NO], [1e308, 0, 1e308], [NO, 1e308, 0]], labels="abc")
SPARSE = cg.GeometricGraph.from_sparse(HUGE.to_csgraph(), labels="abc")


@pytest.mark.parametrize("graph", [HUGE, SPARSE])
def test_every_door_refuses_sums_beyond_floats_in_the_same_words(graph: cg.GeometricGraph) -> None:
    problem = cg.GraphProblem(graph, "a", "c")
    for name in ON_GRAPHS:
        with pytest.raises(GraphError, match=SAYS):
            cg.solve(problem, name)
    for call in (
        lambda: cg.cost_matrix(graph, "c"),
        lambda: cg.cost_matrix(graph, "c", schedule="synchronous"),
        lambda: cg.cost_matrix(graph, "c", schedule="random", seed=1),
        lambda: cg.cost_matrix(graph, "c", schedule="given", order="cbab"),
        lambda: cg.cost_matrix(graph, "c", source="a"),
        lambda: cg.check_theorem_1(graph, "c"),
        lambda: problem.evaluate("abc"),
        lambda: nx.dijkstra_path(graph, "a", "c"),
        lambda: nx.single_source_dijkstra_path_length(graph, "c"),
    ):
        with pytest.raises(GraphError, match=SAYS):
            call()


def test_a_search_that_needs_no_such_sum_is_answered() -> None:
    """Many write a huge weight where there is no edge."""
    most = np.finfo(float).max
    graph = cg.GeometricGraph.from_matrix([[0, 1, most], [1, 0, 2], [most, 2, 0]])
    assert cg.cost_matrix(graph, 2).values.tolist() == [3.0, 2.0, 0.0]
    for name in ON_GRAPHS:
        assert cg.solve(cg.GraphProblem(graph, 0, 2), name).cost == 3.0
        assert cg.solve(cg.GraphProblem(HUGE, "a", "b"), name).cost == 1e308
    assert cg.cost_matrix(HUGE, "c", source="b").value("b") == 1e308
    apart = cg.GeometricGraph.from_matrix([[0, most, NO], [most, 0, NO], [NO, NO, 0]])
    assert cg.cost_matrix(apart, 0).values.tolist() == [0.0, most, NO]
    for name in ON_GRAPHS:
        assert cg.solve(cg.GraphProblem(apart, 0, 2), name).status is cg.Status.NO_PATH


@given(
    st.lists(st.sampled_from([0.0, 1.0, 1e292, 4e307, 8.9e307, 1e308, 1.7e308]), min_size=1, max_size=6),
    st.sampled_from(["label-setting", "synchronous"]),
)
def test_a_chain_has_its_exact_cost_or_is_refused(chain: list[float], schedule: str) -> None:
    n = len(chain) + 1
    matrix = np.full((n, n), NO)
    matrix[range(n - 1), range(1, n)] = chain
    graph = cg.GeometricGraph.from_matrix(matrix)
    if sum(map(int, chain)) > int(np.finfo(float).max):
        with pytest.raises(GraphError, match=SAYS):
            cg.cost_matrix(graph, n - 1, schedule=schedule)  # type: ignore[arg-type]
    else:
        found = cg.cost_matrix(graph, n - 1, schedule=schedule)  # type: ignore[arg-type]
        assert math.isclose(found.value(0), math.fsum(chain), rel_tol=1e-15)


@pytest.mark.parametrize("name", ["rustworkx", "networkx", "cgla"])
def test_smallest_floats_are_weights(name: str) -> None:
    tiny = 5e-324
    graph = cg.GeometricGraph.from_matrix([[0, tiny, 1], [tiny, 0, tiny], [1, tiny, 0]])
    assert cg.solve(cg.GraphProblem(graph, 0, 2), name).cost == 2 * tiny


def _zeros() -> list[cg.GeometricGraph]:
    """Make the same three edges at each door; one weighs ``-math.log(1.0)``."""
    zero = -math.log(1.0)
    assert math.copysign(1.0, zero) == -1.0
    weights = {(0, 1): zero, (1, 2): 1.0, (0, 2): 4.0}
    matrix = np.full((3, 3), np.inf)
    graph: nx.DiGraph[int] = nx.DiGraph()
    for (tail, head), weight in weights.items():
        matrix[tail, head] = weight
        graph.add_edge(tail, head, weight=weight)
    entries = [*weights.values(), 0.0], ([0, 1, 0, 0], [1, 2, 2, 1])
    return [
        cg.GeometricGraph.from_matrix(matrix),
        cg.GeometricGraph.from_matrix(matrix.astype(np.float32)),
        cg.GeometricGraph.from_networkx(graph),
        cg.GeometricGraph.from_sparse(scipy.sparse.coo_array(entries, shape=(3, 3))),
    ]


@pytest.mark.parametrize("graph", _zeros())
def test_negative_zero_is_a_weight_of_zero(graph: cg.GeometricGraph) -> None:
    for one in (graph, cg.GeometricGraph.from_networkx(graph.to_networkx())):
        assert not np.signbit(one.weight_matrix()).any()
        for name in ON_GRAPHS:
            found = cg.solve(cg.GraphProblem(one, 0, 2), name)
            assert (found.nodes, found.cost) == ((0, 1, 2), 1.0)
            assert math.copysign(1.0, cg.solve(cg.GraphProblem(one, 0, 1), name).cost) == 1.0


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("a.csv", "source,target,weight\n0,1,-0.0\n1,2,1\n"),
        ("a.json", '{"nodes":[{"id":0},{"id":1},{"id":2}],"links":[{"source":0,"target":1,"weight":-0.0},EDGE]}'),
        ("a.mtx", "%%MatrixMarket matrix coordinate real symmetric\n3 3 2\n2 1 -0.0\n3 2 1\n"),
    ],
)  # fmt: skip
def test_negative_zero_in_a_file_is_a_weight_of_zero(tmp_path: Path, name: str, text: str) -> None:
    file = tmp_path / name
    file.write_text(text.replace("EDGE", '{"source":1,"target":2,"weight":1}'))
    graph = read_graph(file).graph()
    first, _, last = graph.labels
    for solver in ON_GRAPHS:
        assert cg.solve(cg.GraphProblem(graph, first, last), solver).cost == 1.0


def test_the_command_line_refuses_sums_beyond_floats(cgla: Call) -> None:
    Path("a.csv").write_text("a,b,1e308\nb,c,1e308\n")
    said = "the weights along a path add up to more than 1.8e+308, the largest float; divide all weights"
    cgla("graph", "check", "a.csv", "--target", "c").refused(said)
    answer = cgla("graph", "plan", "a.csv", "--from", "a", "--to", "c", "--json")
    (found,) = answer.document()["runs"]
    assert (answer.code, found["status"]) == (1, "failed")
    assert said in found["message"]
