"""Graphs: complete, 8-connected and the user's own, against dense references."""

import dataclasses
import itertools
import math
import pickle
import tracemalloc
from collections.abc import Callable, Hashable

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from oracles import crosses, eight_connected_edges, inclusion_exclusion, least_costs
from scipy import sparse
from scipy.sparse import csgraph
from shapely.geometry.base import BaseGeometry
from strategies import fast, off_lattice_points, usual

from cgla_graph._threads import THREADED_FROM
from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph.errors import GraphError, NodeNotFoundError, ProblemError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.testing.strategies import fields, lattices, networks, points, polygons, risk_weights, weight_matrices

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)
# Four steps a side of length 1: whole coordinates without rounding, for which shapely is exact.
BOARD = Lattice(5, bounds=(0, 0, 4, 4))
THREATS = RiskField([Threat(0.5, 0.5, spread=0.1), Threat(0.6, 0.4, spread=0.05), Threat(0.2, 0.7, spread=0.2)])


def rows(graph: GeometricGraph) -> FloatArray:
    """Ask for all weights row by row."""
    return np.array([graph.weights_from(i) for i in range(graph.n_nodes)]).reshape(graph.n_nodes, graph.n_nodes)


def columns(graph: GeometricGraph) -> FloatArray:
    """Ask for all weights column by column."""
    return np.array([graph.weights_to(i) for i in range(graph.n_nodes)]).reshape(graph.n_nodes, graph.n_nodes).T


def off_diagonal(matrix: FloatArray) -> FloatArray:
    return matrix[~np.eye(len(matrix), dtype=bool)]


def check_weights(graph: GeometricGraph, expected: FloatArray) -> None:
    """Ask for all weights in every way, and for the number of edges."""
    for found in (rows(graph), columns(graph), graph.weight_matrix(), graph.weight_matrix_to().T):
        assert (found == expected).all()
    pairs = int(np.isfinite(off_diagonal(expected)).sum())
    assert graph.n_edges == (pairs if graph.directed else pairs // 2)


def where(graph: GeometricGraph) -> FloatArray:
    assert graph.positions is not None
    return graph.positions


def lengths(graph: GeometricGraph) -> FloatArray:
    at = where(graph)
    return np.asarray(np.hypot(*(at[:, None] - at).transpose(2, 0, 1)))


# The complete graph


@usual
@given(lattices(), fields(0, 4), risk_weights, off_lattice_points())
def test_rows_computed_when_asked_equal_the_dense_matrix(
    lattice: Lattice, field: RiskField, k: float, extra: list[Point]
) -> None:
    """To the last bit, and symmetric; no weight is below the length."""
    implicit = GeometricGraph.complete(lattice, field, k, extra=extra)
    dense = implicit.with_weights_held()
    matrix = dense.weight_matrix()
    assert (implicit.is_implicit, dense.is_implicit) == (True, False)
    for found in (implicit.weight_matrix(), *(ask(graph) for ask in (rows, columns) for graph in (implicit, dense))):
        assert (found == matrix).all()
    assert (matrix == matrix.T).all()
    assert not np.diag(matrix).any()
    assert (matrix >= lengths(dense) - 1e-12 * max(abs(bound) for bound in lattice.bounds)).all()
    assert dense.weight_matrix_to() is matrix
    assert dense.with_weights_held() is dense
    with pytest.warns(DeprecationWarning, match="with_weights_held"):
        assert dense.weighed() is dense
    for graph in (implicit, dense):
        assert [graph.weight(i, j) for i, j in np.ndindex(matrix.shape)] == matrix.ravel().tolist()


@usual
@given(lattices(unit=True, max_side=4), fields(0, 3), risk_weights)
def test_complete_weights_are_eq5(lattice: Lattice, field: RiskField, k: float) -> None:
    graph = GeometricGraph.complete(lattice, field, k)
    at = where(graph)
    expected = np.array([[math.dist(p, q) + k * inclusion_exclusion(field.threats, p, q) for q in at] for p in at])
    np.testing.assert_allclose(graph.weight_matrix(), expected, rtol=0.0, atol=1e-10 * (1.0 + k))


@usual
@given(st.lists(points, min_size=1, max_size=8))
def test_without_risk_weights_are_euclidean(at: list[Point]) -> None:
    graph = GeometricGraph.complete(at, THREATS, k=0.0)
    matrix = graph.weight_matrix()
    np.testing.assert_allclose(matrix, lengths(graph), rtol=1e-15)
    assert (matrix[:, None, :] <= (matrix[:, :, None] + matrix[None, :, :]) * (1.0 + 1e-15)).all()


@fast
@given(polygons(), fields(0, 2), st.floats(0.0, 5.0))
def test_edges_that_cross_a_no_fly_polygon_are_not_there(
    area: shapely.MultiPolygon, field: RiskField, k: float
) -> None:
    graph = GeometricGraph.complete(BOARD, field, k, no_fly=area)
    at = where(graph)
    starts, ends = (np.array(side) for side in zip(*itertools.product(at, at), strict=True))
    crossing = crosses(area, starts, ends).reshape(len(at), len(at))
    free = GeometricGraph.complete(BOARD, field, k).weight_matrix()
    expected = np.where(crossing & ~np.eye(len(at), dtype=bool), np.inf, free)
    assert (rows(graph) == expected).all()
    assert (graph.weight_matrix() == expected).all()
    eight, near = (
        GeometricGraph.eight_connected(BOARD, field, k, no_fly=given).weight_matrix() for given in (area, None)
    )
    assert (eight == np.where(np.isinf(near), np.inf, expected)).all()


@usual
@given(st.sampled_from([3, 4, 6, 7]), st.lists(st.integers(0, 48), min_size=3, max_size=3, unique=True))
@example(7, [24, 22, 37])
def test_areas_with_corners_on_rounded_nodes_take_the_same_edges_away(n: int, corners: list[int]) -> None:
    """Nodes 7, 24 and 41 of a lattice of 7 points are in line, but not as doubles; a corner may lie on 24."""
    lattice = Lattice(n, bounds=UNIT)
    area = shapely.Polygon(lattice.points[np.array(corners) % n**2])
    assume(area.is_valid)
    graph = GeometricGraph.complete(lattice, no_fly=area)
    expected = off_diagonal(NoFlyArea(area).crosses(lattice.points[:, None], lattice.points))
    assert (off_diagonal(np.isinf(rows(graph))) == expected).all()
    assert (off_diagonal(np.isinf(graph.weight_matrix())) == expected).all()


def test_threads_weigh_like_one_thread() -> None:
    side = math.isqrt(THREADED_FROM) + 1
    graph = GeometricGraph.complete(Lattice(side, bounds=UNIT), THREATS, k=10.0, extra=[(0.123, 0.456)])
    assert graph.n_nodes > THREADED_FROM
    by_rows = rows(graph)
    assert (graph.weight_matrix() == by_rows).all()


@pytest.mark.parametrize("raster", [False, True])
def test_listed_segments_weigh_what_pairs_do(*, raster: bool) -> None:
    """To the last bit, on all cores and on one, and infinity where they cross."""
    rng = np.random.default_rng(5)
    at = rng.random((12 * THREADED_FROM, 2))
    rasters = [RasterRisk([[0.1, 0.2], [0.4, 0.3]], bounds=(0.0, 0.0, 1.0, 1.0))] if raster else []
    field = RiskField(THREATS.threats, rasters=rasters)
    model = CostModel(field, 10.0, shapely.box(0.4, 0.4, 0.6, 0.5))
    found = model.weights(at, at[::-1])
    pairs = [model.pair(np.array(pair), 0, 1) for pair in zip(at, at[::-1], strict=True)]
    assert 0 < np.isinf(found).sum() < len(found)
    np.testing.assert_array_equal(found, pairs)
    np.testing.assert_array_equal(found[:9], model.weights(at[:9], at[::-1][:9]))


@usual
@given(lattices(unit=True), off_lattice_points(6))
def test_extra_points_become_nodes_once(lattice: Lattice, extra: list[Point]) -> None:
    graph = GeometricGraph.complete(lattice, extra=extra)
    at = [tuple(point) for point in where(graph).tolist()]
    for point in extra:
        assert at.count(point) == 1
    assert set(at[lattice.n_points :]) <= set(extra)
    assert len(set(at)) == len(at)
    np.testing.assert_allclose(at[: lattice.n_points], lattice.points, rtol=0.0, atol=1e-9)
    off = {point for point in extra if lattice.index_of(point) is None}
    assert off <= set(at[lattice.n_points :])


def test_points_without_a_lattice_are_taken_as_they_are() -> None:
    at = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]])
    graph = GeometricGraph.complete(at, extra=[(2.0, 0.0)])
    assert graph.weight_matrix()[0].tolist() == [0.0, 1.0, 1.0, 2.0]
    assert graph.weight_matrix()[1, 2] == 0.0
    assert graph.lattice is None
    assert where(graph) is not at
    assert GeometricGraph.complete(np.empty((0, 2))).weight_matrix().shape == (0, 0)


@pytest.mark.parametrize("n", [2, 3, 7])
def test_a_complete_graph_counts_its_edges(n: int) -> None:
    graph = GeometricGraph.complete(Lattice(n, bounds=UNIT))
    assert graph.n_edges == graph.n_pairs == n**2 * (n**2 - 1) // 2
    fewer = GeometricGraph.complete(Lattice(n, bounds=UNIT), no_fly=shapely.box(0.1, 0.1, 0.9, 0.9))
    assert fewer.n_edges < graph.n_edges
    assert fewer.n_pairs == graph.n_pairs


# The 8-connected graph


@usual
@given(lattices(unit=True), fields(0, 4), risk_weights, off_lattice_points())
def test_eight_connected_edges_are_edges_of_the_complete_graph(
    lattice: Lattice, field: RiskField, k: float, extra: list[Point]
) -> None:
    eight = GeometricGraph.eight_connected(lattice, field, k, extra=extra)
    complete = GeometricGraph.complete(lattice, field, k, extra=extra)
    matrix = eight.weight_matrix()
    kept = np.isfinite(matrix)
    assert (matrix == matrix.T).all()
    assert (where(eight) == where(complete)).all()
    assert (matrix[kept] == rows(complete)[kept]).all()
    assert (rows(eight) == matrix).all()
    assert (columns(eight) == matrix).all()


@usual
@given(lattices(unit=True))
def test_eight_connected_joins_the_eight_neighbours(lattice: Lattice) -> None:
    nx_, ny = lattice.shape
    graph = GeometricGraph.eight_connected(lattice)
    found = set(map(frozenset, np.argwhere(np.isfinite(graph.weight_matrix())).tolist()))
    expected = eight_connected_edges(np.ones((ny, nx_), dtype=bool), both_free=False)
    assert {edge for edge in found if len(edge) == 2} == expected
    assert graph.n_edges == graph.n_pairs == len(expected)


@fast
@given(st.integers(0, 2**16 - 1), st.sampled_from(["touch", "both-free"]))
@example(blocked=0b0000_0010_0100_0000, rule="touch")
def test_corner_rules_are_those_of_a_grid_map(blocked: int, rule: CornerRule) -> None:
    free = np.array([not blocked >> i & 1 for i in range(16)]).reshape(4, 4)
    area = shapely.union_all([shapely.box(x, y, x + 1, y + 1) for y, x in np.argwhere(~free).tolist()])
    cells = Lattice(4, bounds=(0, 0, 4, 4), kind="centre")
    graph = GeometricGraph.eight_connected(cells, no_fly=area, corner_rule=rule)
    found = {frozenset(pair) for pair in np.argwhere(np.isfinite(graph.weight_matrix())).tolist()}
    expected = eight_connected_edges(free, both_free=rule == "both-free")
    assert {edge for edge in found if len(edge) == 2} == expected


@usual
@given(lattices(unit=True), off_lattice_points(6))
def test_extra_points_reach_the_corners_of_their_cell(lattice: Lattice, extra: list[Point]) -> None:
    graph = GeometricGraph.eight_connected(lattice, extra=extra)
    matrix, at, n = graph.weight_matrix(), where(graph), lattice.n_points
    step = np.array(lattice.spacing)
    for i in range(n, graph.n_nodes):
        neighbours = np.nonzero(np.isfinite(matrix[i, :n]))[0]
        assert len(neighbours) == 4
        corners = at[neighbours]
        assert (np.ptp(corners, axis=0) <= 1.001 * step).all()
        nearest = np.abs(lattice.points - at[i]).max(axis=1).min()
        # a point beyond the outermost nodes is joined to the nearest cell
        assert np.abs(corners - at[i]).max(axis=1).min() <= nearest + 0.5 * step.max() + 1e-9
        inside = ((at[i] >= lattice.points[0]) & (at[i] <= lattice.points[-1])).all()
        if inside:
            assert (corners.min(axis=0) <= at[i] + 1e-9).all()
            assert (corners.max(axis=0) >= at[i] - 1e-9).all()
    for i, j in itertools.combinations(range(n, graph.n_nodes), 2):
        mates = set(np.nonzero(np.isfinite(matrix[i, :n]))[0]) == set(np.nonzero(np.isfinite(matrix[j, :n]))[0])
        assert bool(np.isfinite(matrix[i, j])) == mates


@usual
@given(start=points, goal=points, n=st.integers(2, 6), eight=st.booleans())
@example(start=(0.5, 0.5), goal=(0.5 + 1e-12, 0.5), n=3, eight=False)
@example(start=(0.5, 0.5), goal=(0.5 + 1e-12, 0.5), n=3, eight=True)
def test_start_and_goal_are_nodes(start: Point, goal: Point, n: int, eight: bool) -> None:
    problem = Problem(start, goal)
    on_graph = problem.on_eight_connected(n) if eight else problem.on_lattice(n)
    at = where(on_graph.graph)
    assert tuple(at[on_graph.graph.index_of(on_graph.source)]) == start
    assert tuple(at[on_graph.graph.index_of(on_graph.target)]) == goal


# The user's own graph: networkx


def lightest(graph: "nx.Graph[Hashable]", u: Hashable, v: Hashable) -> float:
    """Find the weight from u to v by looking at every edge."""
    found = [
        data["weight"]
        for a, b, data in graph.edges(data=True)
        if (a, b) == (u, v) or (not graph.is_directed() and (b, a) == (u, v))
    ]
    return 0.0 if u == v else min(found, default=math.inf)


@fast
@given(networks())
def test_a_networkx_graph_is_taken_over_edge_by_edge(graph: "nx.Graph[Hashable]") -> None:
    before = nx.to_dict_of_dicts(graph.copy())
    mine = GeometricGraph.from_networkx(graph)
    assert (list(mine.labels), mine.directed, mine.positions) == (list(graph.nodes), graph.is_directed(), None)
    check_weights(mine, np.array([[lightest(graph, u, v) for v in graph] for u in graph]))
    assert mine.n_pairs == 0
    assert [mine.index_of(label) for label in graph] == list(range(len(graph)))
    assert nx.to_dict_of_dicts(graph) == before


@usual
@given(networks(positioned=True))
def test_networkx_round_trip(graph: "nx.Graph[Hashable]") -> None:
    mine = GeometricGraph.from_networkx(graph)
    back = mine.to_networkx()
    assert type(back) is (nx.DiGraph if graph.is_directed() else nx.Graph)
    assert list(back.nodes) == list(graph.nodes)
    assert dict(back.nodes(data="pos")) == dict(graph.nodes(data="pos"))
    again = GeometricGraph.from_networkx(back)
    assert (again.weight_matrix() == mine.weight_matrix()).all()
    assert (where(again) == where(mine)).all()
    assert again.labels == mine.labels


@usual
@given(networks(positioned=True), fields(0, 3), risk_weights)
def test_weight_none_weighs_the_edges_by_eq5(graph: "nx.Graph[Hashable]", field: RiskField, k: float) -> None:
    mine = GeometricGraph.from_networkx(graph, weight=None, field=field, k=k)
    complete = rows(GeometricGraph.complete([graph.nodes[v]["pos"] for v in graph], field, k))
    joined = nx.to_numpy_array(graph, weight=None) > 0
    expected = np.where(joined | np.eye(len(joined), dtype=bool), complete, np.inf)
    assert (rows(mine) == expected).all()
    assert mine.n_pairs == mine.n_edges


def test_a_self_loop_changes_nothing() -> None:
    graph = nx.Graph()
    graph.add_weighted_edges_from([("a", "a", 5.0), ("a", "b", 1.0)])
    assert GeometricGraph.from_networkx(graph).weight_matrix().tolist() == [[0.0, 1.0], [1.0, 0.0]]
    bad = nx.Graph([("a", "a", {"weight": -1.0})])
    assert GeometricGraph.from_networkx(bad).n_edges == 0


def test_other_attribute_names_serve() -> None:
    graph = nx.DiGraph()
    graph.add_node("a", at=(0, 0))
    graph.add_node("b", at=(3, 4))
    graph.add_edge("a", "b", cost=np.float32(2))
    mine = GeometricGraph.from_networkx(graph, weight="cost", pos="at")
    assert mine.weights_from(0).tolist() == [0.0, 2.0]
    assert where(mine).tolist() == [[0.0, 0.0], [3.0, 4.0]]


def test_positions_are_taken_if_every_node_has_one() -> None:
    graph = nx.path_graph(2)
    graph.nodes[0]["pos"] = (0, 0)
    nx.set_edge_attributes(graph, 1.0, "weight")
    assert GeometricGraph.from_networkx(graph).positions is None


@pytest.mark.parametrize("weight", [-math.inf, math.nan, "heavy", None, (1,), -1e-300])
@pytest.mark.parametrize("kind", [nx.Graph, nx.MultiDiGraph])
def test_a_bad_weight_of_networkx_is_named(weight: object, kind: type) -> None:
    graph = kind()
    graph.add_edge("here", ("there", 1), weight=weight)
    with pytest.raises(GraphError, match=r"'here'.*\('there', 1\).*at least 0") as caught:
        GeometricGraph.from_networkx(graph)
    assert repr(weight) in str(caught.value)


# The user's own graph: matrices


@fast
@given(weight_matrices(elements=st.sampled_from([0.0, 0.0, 1.0, 2.5])))
def test_a_dense_matrix_is_taken_over_entry_by_entry(weights: FloatArray) -> None:
    given_weights = weights.copy()
    np.fill_diagonal(given_weights, np.nan)  # the diagonal is ignored
    before = given_weights.copy()
    graph = GeometricGraph.from_matrix(given_weights)
    check_weights(graph, weights)
    assert graph.directed == (weights != weights.T).any()
    np.testing.assert_array_equal(given_weights, before)
    assert not np.shares_memory(given_weights, graph.weight_matrix())


@fast
@given(weight_matrices(elements=st.sampled_from([0.0, 0.0, 1.0, 2.5])), st.sampled_from(["csr", "csc", "coo", "lil"]))
def test_a_sparse_matrix_is_taken_over_with_its_zeros(weights: FloatArray, form: str) -> None:
    kept = np.isfinite(weights)
    matrix = sparse.coo_array((weights[kept], np.nonzero(kept)), shape=weights.shape)
    if form != "lil":  # a list of lists does not store zeros
        matrix = matrix.asformat(form)
        check_weights(GeometricGraph.from_sparse(matrix), weights)
        assert matrix.nnz == kept.sum()
    both = GeometricGraph.from_sparse(matrix, directed=False)
    assert not both.directed
    check_weights(both, np.minimum(weights, weights.T))


@fast
@given(
    edges=st.lists(st.tuples(*[st.integers(0, 3)] * 2, st.sampled_from([0.0, 1.0, 2.5, math.inf])), max_size=12),
    kind=st.sampled_from(["coo", "csr", "csc", "csr_matrix", "bsr"]),
    directed=st.booleans(),
)
def test_of_entries_in_one_place_the_lightest_counts(
    edges: list[tuple[int, int, float]], kind: str, directed: bool
) -> None:
    """As of parallel edges from a list of them; scipy would add them up."""
    expected = np.full((4, 4), math.inf)
    for u, v, weight in edges:
        expected[u, v] = min(expected[u, v], weight)
        if not directed:
            expected[v, u] = min(expected[v, u], weight)
    np.fill_diagonal(expected, 0.0)
    tails, heads = (np.array([edge[axis] for edge in edges], dtype=np.int32) for axis in (0, 1))
    weights = np.array([edge[2] for edge in edges], dtype=np.float64)
    if kind == "coo":
        matrix = sparse.coo_array((weights, (tails, heads)), shape=(4, 4))
    else:
        major, minor = (heads, tails) if kind == "csc" else (tails, heads)
        order = np.argsort(major, kind="stable")
        starts = np.searchsorted(major[order], np.arange(5))
        values = weights[order].reshape(-1, 1, 1) if kind == "bsr" else weights[order]
        make = {
            "csr": sparse.csr_array,
            "csc": sparse.csc_array,
            "csr_matrix": sparse.csr_matrix,
            "bsr": sparse.bsr_array,
        }
        matrix = make[kind]((values, minor[order], starts), shape=(4, 4))
    before = matrix.nnz
    check_weights(GeometricGraph.from_sparse(matrix, directed=directed), expected)
    assert matrix.nnz == before


@pytest.mark.parametrize("index", [77, 2, -1])
@pytest.mark.parametrize("kind", ["csr", "csc", "coo"])
def test_entries_outside_of_a_sparse_matrix_are_refused(index: int, kind: str) -> None:
    """An index may be changed after scipy has checked it."""
    matrix = sparse.coo_array(([2.0, 3.0], ([0, 1], [1, 0])), shape=(2, 2)).asformat(kind)
    (matrix.coords[1] if kind == "coo" else matrix.indices)[0] = index
    with pytest.raises(GraphError, match="give a square scipy sparse matrix"):
        GeometricGraph.from_sparse(matrix)


def test_infinity_and_diagonal_of_a_sparse_matrix_are_no_edges() -> None:
    entries = sparse.coo_array(([math.inf, -7.0, math.nan, 2.0], ([0, 0, 1, 1], [1, 0, 1, 0])), shape=(2, 2))
    graph = GeometricGraph.from_sparse(entries)
    assert graph.weight_matrix().tolist() == [[0.0, math.inf], [2.0, 0.0]]
    assert graph.n_edges == 1


@usual
@given(weight_matrices(elements=st.sampled_from([0.0, 1.0, 3.0])), st.integers(0, 8))
def test_zero_weights_survive_csgraph_and_networkx_and_scipy_agrees(weights: FloatArray, source: int) -> None:
    source %= len(weights)
    graph = GeometricGraph.from_matrix(weights, labels=[f"n{i}" for i in range(len(weights))])
    entries = graph.to_csgraph()
    found = csgraph.dijkstra(entries, indices=source)
    assert (found == least_costs(np.ascontiguousarray(weights.T), source)).all()
    assert entries.nnz == np.isfinite(off_diagonal(weights)).sum()
    check_weights(GeometricGraph.from_sparse(entries, directed=graph.directed), weights)
    again = GeometricGraph.from_networkx(graph.to_networkx())
    check_weights(again, weights)
    assert (tuple(again.labels), again.directed) == (graph.labels, graph.directed)


TINY = Lattice(2, bounds=UNIT)
ZEROS = np.zeros((2, 2))


def pair(**positions: object) -> GeometricGraph:
    """Take over a networkx graph of two nodes, weighed by its positions."""
    graph = nx.path_graph(["a", "b"])
    nx.set_node_attributes(graph, positions, "pos")
    return GeometricGraph.from_networkx(graph, weight=None)


@pytest.mark.parametrize(
    ("words", "make"),
    [
        ("the graph has no nodes", lambda: GeometricGraph.from_networkx(nx.MultiDiGraph(), weight=None)),
        ("the graph has no nodes", lambda: GeometricGraph.from_networkx(nx.Graph())),
        ("'a' - 'b' has no attribute 'weight'.*weight=None", lambda: GeometricGraph.from_networkx(nx.path_graph("ab"))),
        ("node 'b' has no attribute 'pos'", lambda: pair(a=(0, 0))),
        *(("position", lambda odd=odd: pair(a=(0, 0), b=odd)) for odd in ((math.nan, 0), (0, 0, 1), "ab")),
        *(("not a networkx graph", lambda odd=odd: GeometricGraph.from_networkx(odd)) for odd in ({"a": 1}, None)),
        (r"\(2, 3\)", lambda: GeometricGraph.from_matrix(np.zeros((2, 3)))),
        (r"\(4,\)", lambda: GeometricGraph.from_matrix(np.zeros(4))),
        *(("matrix", lambda odd=odd: GeometricGraph.from_matrix(odd)) for odd in (None, "ab", [[0, 1], [2]])),
        *(
            (
                "'b' - 'a' has weight .*at least 0",
                lambda odd=odd: GeometricGraph.from_matrix([[0, 1], [odd, 0]], labels="ab"),
            )
            for odd in (math.nan, -math.inf, -1e-300)
        ),
        ("1 - 0 has weight -1", lambda: GeometricGraph.from_sparse(sparse.coo_array([[0.0, 1.0], [-1.0, 0.0]]))),
        (r"\(2, 3\)", lambda: GeometricGraph.from_sparse(sparse.csr_array((2, 3)))),
        (r"\(4,\)", lambda: GeometricGraph.from_sparse(sparse.coo_array(np.ones(4)))),
        ("matrix", lambda: GeometricGraph.from_sparse(None)),
        ("1 labels, 1 of them different", lambda: GeometricGraph.from_matrix(ZEROS, labels="a")),
        ("2 labels, 1 of them different", lambda: GeometricGraph.from_matrix(ZEROS, labels="aa")),
        ("a label is None", lambda: GeometricGraph.from_matrix(ZEROS, labels=[None, 1])),
        ("label", lambda: GeometricGraph.from_matrix(ZEROS, labels=[[1], [2]])),
        (r"\(1, 2\) for 2 nodes", lambda: GeometricGraph.from_matrix(ZEROS, positions=[(0, 0)])),
        ("no positions", lambda: GeometricGraph.from_matrix(ZEROS).under(CostModel())),
        (r"points have shape \(2,\)", lambda: GeometricGraph.complete([1.0, 2.0])),
        (r"points have shape \(2, 3, 2\)", lambda: GeometricGraph.complete(np.zeros((2, 3, 2)))),
        ("points holds", lambda: GeometricGraph.complete([[1.0, math.nan]])),
        ("k is -1", lambda: GeometricGraph.complete(TINY, k=-1.0)),
        ("k is nan", lambda: GeometricGraph.complete(TINY, k=math.nan)),
        *(("field is", lambda odd=odd: GeometricGraph.complete(TINY, odd)) for odd in ("risk", [], 0)),
        ("Point", lambda: GeometricGraph.complete(TINY, no_fly=shapely.Point(0, 0))),
        *(
            ("extra", lambda odd=odd: GeometricGraph.complete(TINY, extra=[odd]))
            for odd in ((math.nan, 0.0), (0.0, 0.5, 1.0), "ab")
        ),
        ("extra", lambda: GeometricGraph.eight_connected(TINY, extra=[(math.nan, 0.5)])),
        ("round.*touch or both-free", lambda: GeometricGraph.eight_connected(TINY, corner_rule="round")),  # type: ignore[arg-type]
        ("lattice", lambda: GeometricGraph.eight_connected(np.zeros((4, 2)))),  # type: ignore[arg-type]
        ("starts|ends", lambda: CostModel().weights(np.zeros((3, 2)), np.ones((2, 2)))),
        ("starts|ends", lambda: CostModel().weights((0.0, 0.0), (1.0, 1.0))),
    ],
)
def test_malformed_graphs_are_refused(words: str, make: Callable[[], object]) -> None:
    with pytest.raises((GraphError, ProblemError), match=words):
        make()


def test_extra_points_may_be_an_array() -> None:
    extra = np.array([[0.1, 0.2], [0.3, 0.4]])
    graph = GeometricGraph.complete(TINY, extra=extra)  # type: ignore[arg-type]
    assert where(graph)[4:].tolist() == extra.tolist()


@pytest.mark.parametrize("index", [4, -1])
def test_an_index_beyond_the_nodes_is_refused(index: int) -> None:
    dense = GeometricGraph.from_matrix(np.ones((4, 4)))
    for graph in (dense, GeometricGraph.eight_connected(TINY), GeometricGraph.complete(TINY)):
        for weights in (graph.weights_from, graph.weights_to):
            with pytest.raises(IndexError, match="not in 0 to 3"):
                weights(index)


@pytest.mark.parametrize("node", [4, -1, "a", None, (0,), [0], {}, 0.5])
def test_a_node_that_is_not_there_is_named(node: Hashable) -> None:
    with pytest.raises(NodeNotFoundError, match="4 nodes: 0, 1, 2") as caught:
        GeometricGraph.complete(TINY).index_of(node)
    assert repr(node) in str(caught.value)
    assert isinstance(caught.value, KeyError)


# Immutability


def test_nothing_passed_in_is_changed() -> None:
    at, area, extra = np.random.default_rng(0).random((5, 2)), shapely.box(0.4, 0.4, 0.6, 0.6), [(0.1, 0.2)]
    entries = sparse.csr_array(np.array([[0.0, 1.0], [2.0, 0.0]]))
    before = at.copy(), area.wkb, entries.toarray()
    at.flags.writeable = False
    for graph in (
        GeometricGraph.complete(at, THREATS, 10.0, no_fly=area, extra=extra),
        GeometricGraph.eight_connected(TINY, THREATS, 10.0, no_fly=area, extra=extra),
    ):
        graph.weight_matrix()
        graph.to_networkx()
        assert not where(graph).flags.writeable
    graph = GeometricGraph.from_sparse(entries, positions=at[:2])
    graph.to_csgraph()
    assert not np.shares_memory(where(graph), at)
    assert (at == before[0]).all()
    assert (area.wkb, extra) == (before[1], [(0.1, 0.2)])
    assert (entries.toarray() == before[2]).all()
    assert (TINY.points == Lattice(2, bounds=UNIT).points).all()


@pytest.mark.parametrize(
    "graph",
    [
        GeometricGraph.complete(TINY),
        GeometricGraph.complete(TINY).with_weights_held(),
        GeometricGraph.from_matrix([[0.0, 1.0], [2.0, 0.0]]),
        GeometricGraph.eight_connected(TINY),
    ],
)
def test_the_dense_matrix_is_read_only_and_asking_changes_nothing(graph: GeometricGraph) -> None:
    before = {one.name: getattr(graph, one.name) for one in dataclasses.fields(graph)}
    weights = graph.weight_matrix().copy()
    for made in (graph, pickle.loads(pickle.dumps(graph))):  # noqa: S301 - what was just written
        assert not made.weight_matrix().flags.writeable
        assert not made.weight_matrix_to().flags.writeable
        assert made.positions is None or not made.positions.flags.writeable
        # a copy
        made.to_csgraph().data[:] = -1.0
        assert (columns(made) == weights).all()
        _ = made.n_edges, made.has_negative_weights, made.index_of(0)
    assert all(getattr(graph, name) is value for name, value in before.items())


@pytest.mark.parametrize("area", [None, shapely.box(0.4, 0.4, 0.6, 0.6)], ids=["open", "with an area"])
def test_the_dense_matrix_needs_no_second_one(area: BaseGeometry | None) -> None:
    graph = GeometricGraph.complete(Lattice(30, bounds=UNIT), THREATS, k=10.0, no_fly=area)
    graph.weights_from(0)
    tracemalloc.start()
    try:
        matrix = graph.weight_matrix()
        _, peak = tracemalloc.get_traced_memory()
    finally:
        tracemalloc.stop()
    assert matrix.nbytes <= peak <= 1.1 * matrix.nbytes


@pytest.mark.parametrize("weight", [None, "weight"])
def test_a_no_fly_area_takes_edges_of_a_networkx_graph_away(weight: str | None) -> None:
    graph = nx.Graph()
    for name, spot in {"a": (0, 0), "b": (2, 0), "c": (1, 2)}.items():
        graph.add_node(name, pos=spot)
    graph.add_weighted_edges_from([("a", "b", 5.0), ("b", "c", 5.0), ("a", "c", 5.0)])
    ours = GeometricGraph.from_networkx(graph, weight=weight, no_fly=shapely.box(0.9, -0.5, 1.1, 0.5))
    assert ours.n_edges == 2
    assert np.isinf(ours.weights_from(0)[1])
