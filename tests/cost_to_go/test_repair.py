"""
Incremental planning equals planning from scratch, whatever changed.

Oracles: `cost_matrix` and scipy's Dijkstra on a fresh graph that weighs every pair. Maps are of unit size, `k`
goes up to 100, and values agree to 1e-12.
"""

import math
from collections.abc import Callable, Sequence
from functools import partial
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from scipy.sparse.csgraph import dijkstra
from strategies import areas, changed, examples, fields_and_segments, models, usual

from cgla_graph._types import FloatArray, Point
from cgla_graph.cost_to_go import bound_kernels, repair_kernels
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.model_change import ModelChange
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, linked, repair, reweigh, with_node
from cgla_graph.errors import GraphError, NodeNotFoundError, ProblemError
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.testing.strategies import crowds, fields, lattices, points, seeds, threats

UNIT = (0.0, 0.0, 1.0, 1.0)
EXACT = 1e-12
PAPER = load_scenario("paper").problem.field.threats
many = examples(120)


# ---------------------------------------------------------------------------------------------- models and changes
@st.composite
def graphs(draw: st.DrawFn, model: CostModel, max_side: int = 7) -> GeometricGraph:
    """Draw complete graphs: a lattice of any kind with further nodes, or points without one."""
    if draw(st.integers(0, 5)) == 0:
        base: Lattice | FloatArray = np.random.default_rng(draw(seeds)).random((draw(st.integers(1, 12)), 2))
        extra: Sequence[Point] = ()
    else:
        base = draw(lattices(max_side=max_side, unit=True))
        extra = draw(st.lists(points, max_size=2))
    return GeometricGraph.complete(base, model.field, model.k, no_fly=model.no_fly, extra=extra)


def bits(matrix: CostMatrix) -> tuple[bytes, ...]:
    return tuple(array.tobytes() for array in (matrix.values, matrix.successors, matrix.order))


def check(matrix: CostMatrix, model: CostModel) -> None:
    """Compare values and paths with planning from scratch, twice over."""
    fresh = matrix.graph.under(model)
    weights = fresh.weight_matrix()
    for reference in (
        cost_matrix(fresh, matrix.target).values,
        dijkstra(fresh.to_csgraph(), indices=matrix.target),
    ):
        np.testing.assert_allclose(matrix.values, reference, rtol=0.0, atol=EXACT)
    costs = np.full(len(weights), np.inf)
    costs[matrix.target] = 0.0
    assert matrix.order[0] == matrix.target
    assert sorted(matrix.order.tolist()) == np.flatnonzero(np.isfinite(matrix.values)).tolist()
    for i in matrix.order[1:].tolist():
        # each after its successor: the tree has no circles
        costs[i] = weights[i, matrix.successors[i]] + costs[matrix.successors[i]]
    np.testing.assert_allclose(matrix.values, costs, rtol=0.0, atol=EXACT)
    assert (np.diff(matrix.values[matrix.order]) >= -EXACT).all()
    assert (matrix.successors[~np.isfinite(matrix.values)] == -1).all()
    assert matrix.graph.is_implicit
    assert matrix.converged
    assert not any(array.flags.writeable for array in (matrix.values, matrix.successors, matrix.order))


# ------------------------------------------------------------------------------------------------------ cost matrix
@many
@given(data=st.data())
def test_repair_is_planning_from_scratch(data: st.DataObject) -> None:
    before = data.draw(models(rastered=True))
    graph = data.draw(graphs(before))
    target = data.draw(st.integers(0, graph.n_nodes - 1))
    after = data.draw(changed(before, rastered=True))
    plan: Callable[..., CostMatrix] = data.draw(st.sampled_from([cost_matrix, lazy_cost_matrix]))
    matrix = plan(graph, target)
    was = bits(matrix)
    repaired = repair(matrix, after)
    check(repaired, after)
    assert bits(matrix) == was
    assert graph.is_implicit
    assert bits(repair(matrix, after)) == bits(repaired)


@usual
@given(data=st.data())
def test_lazy_cost_matrix_is_the_cost_matrix(data: st.DataObject) -> None:
    model = data.draw(models(rastered=True))
    graph = data.draw(graphs(model))
    check(lazy_cost_matrix(graph, data.draw(st.integers(0, graph.n_nodes - 1))), model)


@examples(15)
@given(data=st.data())
def test_ten_repairs_in_a_row(data: st.DataObject) -> None:
    model = data.draw(models(rastered=True))
    matrix = lazy_cost_matrix(data.draw(graphs(model)), 0)
    for _ in range(10):
        model = data.draw(changed(model, rastered=True))
        matrix = repair(matrix, model)
    check(matrix, model)


@pytest.mark.slow
@pytest.mark.parametrize("k", [1.0, 10.0, 100.0])
def test_the_papers_map_threat_by_threat(k: float) -> None:
    """Threats are detected one after the other, one moves, and they vanish in another order."""
    graph = GeometricGraph.complete(Lattice(14, bounds=UNIT), k=k, extra=[(0.9, 0.9)])
    matrix, first = lazy_cost_matrix(graph, 196), PAPER[0]
    steps = [list(PAPER[:n]) for n in range(1, len(PAPER) + 1)]
    steps.append([Threat(first.x - 0.1, first.y + 0.07, first.spread, first.peak), *PAPER[1:]])
    for at in (3, 0, 6, 2, 4, 0, 1, 1, 1, 0):
        steps.append(steps[-1][:at] + steps[-1][at + 1 :])
    for known in steps:
        model = CostModel(RiskField(known), k)
        matrix = repair(matrix, model)
        check(matrix, model)


@examples(15)
@given(seed=seeds, n=st.integers(14, 18), k=st.sampled_from([10.0, 100.0]))
def test_reach_grows_and_shrinks(seed: int, n: int, k: float) -> None:
    """A seventeenth threat widens the reach of all others: no weight may be taken for unchanged."""
    rng = np.random.default_rng(seed)
    crowd = [Threat(*rng.random(2).tolist(), spread=s) for s in rng.uniform(0.02, 0.08, n + 2).tolist()]
    lattice = Lattice(8, bounds=UNIT)
    matrix = lazy_cost_matrix(GeometricGraph.complete(lattice, RiskField(crowd[:n]), k), 0)
    for m in (n + 1, n + 2, n + 1, n - 1):
        model = CostModel(RiskField(crowd[:m]), k)
        matrix = repair(matrix, model)
        check(matrix, model)


@usual
@given(data=st.data(), side=st.integers(3, 9))
def test_walls_pop_up_and_vanish(data: st.DataObject, side: int) -> None:
    """No-fly areas alone, on a lattice whose nodes and lines touch their corners and edges."""
    lattice = Lattice(side, bounds=UNIT)
    matrix = lazy_cost_matrix(GeometricGraph.complete(lattice), data.draw(st.integers(0, side * side - 1)))
    for _ in range(3):
        model = CostModel(no_fly=data.draw(areas()))
        matrix = repair(matrix, model)
        check(matrix, model)
    check(repair(matrix, CostModel()), CostModel())


def test_nodes_become_unreachable_and_reachable_again() -> None:
    graph = GeometricGraph.complete(Lattice(5, bounds=UNIT))
    open_map = lazy_cost_matrix(graph, 12)
    ring = shapely.box(0.3, 0.3, 0.7, 0.7).difference(shapely.box(0.4, 0.4, 0.6, 0.6))
    closed = repair(open_map, CostModel(no_fly=ring))
    assert np.isfinite(closed.values).sum() == 1
    assert closed.path_from(0) == []
    check(closed, CostModel(no_fly=ring))
    gap = CostModel(no_fly=shapely.box(0.3, 0.3, 0.7, 0.45))
    check(repair(closed, gap), gap)
    check(repair(closed, CostModel()), CostModel())


@pytest.mark.parametrize(("i", "r", "near", "apex"), [(1, 22, True, (-0.1, 0.9)), (3, 18, False, (0.45, 0.75))])
def test_a_segment_may_be_free_where_its_parts_are_not(i: int, r: int, near: bool, apex: Point) -> None:
    """
    Such a pair is weighed, though it joins further lattice nodes.

    Lattice nodes on one line are not in line to the last bit: a node between may lie inside the triangle by rounding.
    """
    lattice = Lattice(6, bounds=UNIT)
    first, second, third, last = lattice.points[np.linspace(i, r, 4).astype(int)]
    model = CostModel(no_fly=shapely.Polygon([first if near else 0.5 * (first + last), last, apex]))
    parts = model.weights([first, first, second, third], [last, second, last, last])
    assert np.isinf(parts).tolist() == [False, near, True, True]
    for target in (i, r):
        open_map = lazy_cost_matrix(GeometricGraph.complete(lattice), target)
        check(repair(open_map, model), model)
        check(lazy_cost_matrix(open_map.graph.under(model), target), model)
    graph = open_map.graph.under(CostModel())
    np.testing.assert_array_equal(reweigh(graph, model).weight_matrix(), graph.under(model).weight_matrix())


def test_maps_in_metres() -> None:
    """The same agreement on a map of 20 km, relative to its size."""
    rng = np.random.default_rng(7)
    size = 20_000.0
    known = [Threat(*(size * rng.random(2)).tolist(), spread=s * size) for s in rng.uniform(0.03, 0.06, 6).tolist()]
    graph = GeometricGraph.complete(Lattice(10, bounds=(0.0, 0.0, size, size)), RiskField(known[:3]), 10.0)
    matrix = lazy_cost_matrix(graph, 99)
    for members in (known[:5], known[1:], known[:2]):
        model = CostModel(RiskField(members), 10.0)
        matrix = repair(matrix, model)
        fresh = cost_matrix(graph.under(model), 99)
        np.testing.assert_allclose(matrix.values, fresh.values, rtol=0.0, atol=EXACT * size)


def test_what_changed() -> None:
    a, b, c = PAPER[:3]
    wall, other = shapely.box(0.2, 0.2, 0.4, 0.4), shapely.box(0.6, 0.6, 0.8, 0.8)
    same = ModelChange.between(CostModel(RiskField([a, b]), 1.0, wall), CostModel(RiskField([b, a]), 1.0, wall))
    assert not len(same.threats)
    assert not len(same.redrawn)
    assert same.weights_only_grow
    assert not same.everything
    twice = ModelChange.between(CostModel(RiskField([a, b])), CostModel(RiskField([a, c, a, c, a])))
    assert sorted(twice.came[:, 0].tolist()) == sorted([a.x, a.x, c.x, c.x])
    assert twice.gone[:, 0].tolist() == [b.x]
    assert not twice.weights_only_grow
    both = CostModel(no_fly=shapely.MultiPolygon([wall, other]))
    came, went = ModelChange.between(CostModel(no_fly=wall), both), ModelChange.between(both, CostModel(no_fly=wall))
    assert not len(came.opened)
    assert came.redrawn.tolist() == went.redrawn.tolist() == went.opened.tolist() == [list(other.bounds)]
    grown = ModelChange.between(CostModel(no_fly=wall), CostModel(no_fly=shapely.box(0.1, 0.1, 0.5, 0.5)))
    assert not len(grown.opened)
    assert len(grown.redrawn) == 2
    more = CostModel(RiskField([a] * 17), 1.0)
    assert ModelChange.between(CostModel(RiskField([a] * 16), 1.0), more).everything
    assert ModelChange.between(more, CostModel(RiskField([a] * 16), 1.0)).unrelated
    assert ModelChange.between(CostModel(k=2.0), CostModel(k=1.0)).everything
    assert not ModelChange.between(CostModel(k=2.0), CostModel(k=1.0)).weights_only_grow


def test_what_the_change_does_not_reach_keeps_its_bits() -> None:
    graph = GeometricGraph.complete(Lattice(12, bounds=UNIT), RiskField(PAPER[:3]), 10.0)
    matrix = lazy_cost_matrix(graph, 0)
    far = CostModel(RiskField([*PAPER[:3], Threat(5.0, 5.0, spread=0.05)]), 10.0)
    repaired = repair(matrix, far)
    assert repaired.values.tobytes() == matrix.values.tobytes()
    assert repaired.successors.tobytes() == matrix.successors.tobytes()


def test_few_pairs_are_weighed(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the paper's map, some hundred weights decide; from scratch there are 79 800."""
    weighed: list[int] = []
    kernel = repair_kernels.settle_lazily

    def counting(*args: object) -> tuple[int, int]:
        settled, n_weighed = kernel(*args)  # type: ignore[arg-type]
        weighed.append(n_weighed)
        return settled, n_weighed

    monkeypatch.setattr(repair_kernels, "settle_lazily", counting)
    graph = GeometricGraph.complete(Lattice(20, bounds=UNIT), RiskField(PAPER[:9]), 10.0)
    matrix = lazy_cost_matrix(graph, 399)
    repair(matrix, CostModel(RiskField(PAPER), 10.0))
    assert weighed[0] < 3000
    assert weighed[1] < 500


# ----------------------------------------------------------------------------------------------------------- bounds
# two threats that the segment passes where they are all but too faint to count
FAINT_PAIR = RiskField([Threat(0.5, 0.5, spread=spread, peak=1.0) for spread in (0.18, 0.034)])
FAR_BY = 0.5 + 0.18 * math.sqrt(1.0000001 * bound_kernels.FAINT)


@many
@example((FAINT_PAIR, (np.array([-1.0, FAR_BY]), np.array([2.0, FAR_BY]))), 0)
@given(st.one_of(fields_and_segments(fields(max_threats=6)), fields_and_segments(crowds(max_threats=20))), seeds)
def test_bounds_of_the_risk_are_bounds(case: tuple[RiskField, tuple[FloatArray, FloatArray]], seed: int) -> None:
    """From below by single threats, from above what some of them add."""
    field, (start, end) = case
    rng = np.random.default_rng(seed)
    table = field.table
    risk = float(field.line_integral(start, end))
    ends = (*start.tolist(), *end.tolist())
    error = bound_kernels.risk_error(table)
    near = np.empty((len(field) + 1, 3))
    hint = int(rng.integers(max(len(field), 1)))
    if len(field):
        bound, strongest = bound_kernels.least_risk(*ends, table, near, math.inf, hint)
        assert bound <= risk + error
        alone = max(float(RiskField([t]).line_integral(start, end)) for t in field.threats)
        # threats below exp(-FAINT / 2) all along the segment are passed over: of a whole line, so much
        faint = math.exp(-0.5 * bound_kernels.FAINT) * math.sqrt(2.0 * math.pi)
        assert bound >= alone - 1.001 * faint * max(t.spread for t in field.threats) - error
        assert 0 <= strongest < len(field)
        if bound > 0.0:
            enough, _ = bound_kernels.least_risk(*ends, table, near, 0.5 * bound, hint)
            assert 0.5 * bound <= enough <= risk + error
    kept = rng.random(len(field)) < 0.5
    rest = RiskField([t for t, keep in zip(field.threats, kept.tolist(), strict=True) if keep])
    gone = bound_kernels.gone_risk(*ends, np.ascontiguousarray(table[~kept]))
    assert risk - float(rest.line_integral(start, end)) <= gone + 2.0 * error


@usual
@given(field=fields(1, 6), more=st.lists(threats(), min_size=1, max_size=6), seed=seeds)
def test_risk_out_of_reach_of_a_change_keeps_its_bits(field: RiskField, more: list[Threat], seed: int) -> None:
    starts, ends = np.random.default_rng(seed).random((2, 300, 2))
    wider = field.with_threats(more)
    table = wider.table[len(field) :]
    far = [not bound_kernels.in_reach(*a, *b, table) for a, b in zip(starts.tolist(), ends.tolist(), strict=True)]
    np.testing.assert_array_equal(
        field.line_integral(starts[far], ends[far]), wider.line_integral(starts[far], ends[far])
    )


# ---------------------------------------------------------------------------------------------------- linked nodes
@usual
@given(data=st.data())
def test_linked_is_a_graph_with_one_more_node(data: st.DataObject) -> None:
    model = data.draw(models(rastered=True))
    graph = data.draw(graphs(model))
    target = data.draw(st.integers(0, graph.n_nodes - 1))
    matrix = lazy_cost_matrix(graph, target)
    spot = data.draw(points)
    was = bits(matrix)
    joined, node = linked(matrix, spot)
    assert bits(matrix) == was
    assert joined.graph.positions is not None
    assert tuple(joined.graph.positions[joined.graph.index_of(node)]) == spot
    fresh = cost_matrix(joined.graph.under(model), target, source=node)
    assert joined.value(node) == pytest.approx(fresh.value(node), rel=0.0, abs=EXACT)
    weights = joined.graph.under(model)
    path = joined.path_from(node)
    assert bool(path) == bool(np.isfinite(joined.value(node)))
    if path:
        indices = [weights.index_of(step) for step in path]
        cost = sum(float(weights.weights_from(i)[j]) for i, j in pairwise(indices))
        assert cost == pytest.approx(joined.value(node), rel=0.0, abs=EXACT)
    np.testing.assert_array_equal(joined.values[: graph.n_nodes], matrix.values)


@usual
@given(field=crowds(max_threats=30), k=st.sampled_from([10.0, 100.0]), wall=areas(), seed=seeds)
def test_linked_takes_the_best_of_all_nodes(field: RiskField, k: float, wall: shapely.MultiPolygon, seed: int) -> None:
    """Where many threats overlap, the bounds are loose, and the first node by its bound is not the best."""
    matrix = lazy_cost_matrix(GeometricGraph.complete(Lattice(6, bounds=UNIT), field, k, no_fly=wall), 35)
    for spot in np.random.default_rng(seed).random((20, 2)).tolist():
        joined, node = linked(matrix, tuple(spot))
        offers = joined.graph.weights_from(36)[:36] + matrix.values
        assert joined.value(node) == offers.min()


def test_linking_a_node_that_is_there() -> None:
    matrix = lazy_cost_matrix(GeometricGraph.complete(Lattice(4, bounds=UNIT)), 0)
    assert matrix.graph.positions is not None
    joined, node = linked(matrix, tuple(matrix.graph.positions[7].tolist()))
    assert joined is matrix
    assert node == 7


def test_linked_values_are_those_of_an_early_stop() -> None:
    """What is below the new node's value is final, and nothing else is claimed."""
    matrix = lazy_cost_matrix(GeometricGraph.complete(Lattice(6, bounds=UNIT), RiskField(PAPER[:4]), 10.0), 35)
    joined, node = linked(matrix, (0.31, 0.44))
    assert not joined.converged
    final = joined.order
    fresh = cost_matrix(joined.graph.under(CostModel(RiskField(PAPER[:4]), 10.0)), 35)
    np.testing.assert_allclose(joined.values[final], fresh.values[final], rtol=0.0, atol=EXACT)
    assert joined.values[final].max() < joined.value(node) <= np.delete(joined.values, final).min()


# ----------------------------------------------------------------------------------------------------- all weights
@many
@given(data=st.data())
def test_reweigh_is_weighing_from_scratch(data: st.DataObject) -> None:
    before = data.draw(models(rastered=True))
    graph = data.draw(graphs(before))
    weights = graph.weight_matrix()
    was = weights.tobytes()
    after = data.draw(changed(before, rastered=True))
    result = reweigh(graph, after)
    fresh = graph.under(after).weight_matrix()
    np.testing.assert_allclose(result.weight_matrix(), fresh, rtol=0.0, atol=EXACT)
    assert not result.is_implicit
    assert not result.weight_matrix().flags.writeable
    assert result.model is after
    assert graph.weight_matrix().tobytes() == was
    assert graph.model is not None
    assert graph.model.k == before.k


def test_reweigh_where_all_threats_reach_further() -> None:
    """A seventeenth threat, far away, changes the last digits of weights everywhere."""
    rng = np.random.default_rng(3)
    crowd = [Threat(*rng.random(2).tolist(), spread=s) for s in rng.uniform(0.03, 0.06, 16).tolist()]
    graph = GeometricGraph.complete(Lattice(9, bounds=UNIT), RiskField(crowd), 100.0)
    after = CostModel(RiskField([*crowd, Threat(9.0, 9.0, spread=0.05)]), 100.0)
    fresh = graph.under(after).weight_matrix()
    assert (graph.weight_matrix() != fresh).any()
    np.testing.assert_array_equal(reweigh(graph, after).weight_matrix(), fresh)


def test_reweigh_on_threads_gives_the_same_floats() -> None:
    """Above 200 nodes all cores share the work; threats that come last leave every other float alone."""
    lattice = Lattice(16, bounds=UNIT)
    wall = shapely.box(0.2, 0.3, 0.4, 0.6)
    graph = GeometricGraph.complete(lattice, RiskField(PAPER[:5]), 10.0, extra=[(0.91, 0.93)])
    after = CostModel(RiskField(PAPER[:7]), 10.0, wall)
    fresh = graph.under(after).weight_matrix()
    np.testing.assert_array_equal(reweigh(graph, after).weight_matrix(), fresh)
    back = reweigh(graph.under(after), CostModel(RiskField(PAPER[:5]), 10.0))
    np.testing.assert_array_equal(back.weight_matrix(), graph.weight_matrix())


@usual
@given(data=st.data())
def test_with_node_is_a_graph_with_one_more_node(data: st.DataObject) -> None:
    model = data.draw(models(rastered=True))
    graph = data.draw(graphs(model))
    stored = data.draw(st.booleans())
    if stored:
        graph = graph.with_weights_held()
    n = graph.n_nodes
    spot = data.draw(points)
    assert graph.positions is not None
    assume(not (graph.positions == spot).all(axis=1).any())
    result, node = with_node(graph, spot)
    assert graph.n_nodes == n
    assert result.n_nodes == n + 1
    assert result.is_implicit != stored
    fresh = result.under(model)
    np.testing.assert_array_equal(result.weight_matrix(), fresh.weight_matrix())
    assert with_node(result, spot) == (result, node)


# -------------------------------------------------------------------------------------------------- what is refused
def test_what_cannot_be_repaired_is_refused() -> None:
    lattice, here = Lattice(4, bounds=UNIT), (0.5, 0.123)
    graph = GeometricGraph.complete(lattice, k=1.0)
    matrix = lazy_cost_matrix(graph, 0)
    early, rounds = cost_matrix(graph, 0, source=5), cost_matrix(graph, 0, schedule="synchronous")
    joined, _ = linked(matrix, (0.21, 0.4))
    attempts: list[tuple[str, Callable[[], object]]] = [
        *(("label setting", partial(repair, one, CostModel())) for one in (early, rounds, joined)),
        *(("not all", partial(linked, one, here)) for one in (early, joined)),
        ("Lattice", lambda: lazy_cost_matrix(lattice, 0)),  # type: ignore[arg-type]
        ("99", lambda: lazy_cost_matrix(graph, 99)),
        ("CostModel", lambda: repair(matrix, RiskField())),  # type: ignore[arg-type]
        ("CostModel", lambda: reweigh(graph, RiskField())),  # type: ignore[arg-type]
        ("point", lambda: linked(matrix, (math.nan, 0.0))),
    ]
    sparse = GeometricGraph.eight_connected(lattice)
    given_weights = GeometricGraph.from_matrix([[0.0, 1.0], [1.0, 0.0]])
    for other, what in ((sparse, "sparse"), (given_weights, "without a cost model")):
        attempts += [
            (what, partial(lazy_cost_matrix, other, 0)),
            (what, partial(repair, cost_matrix(other, 0), CostModel())),
            (what, partial(reweigh, other, CostModel())),
            (what, partial(linked, cost_matrix(other, 0), here)),
            (what, partial(with_node, other, here)),
        ]
    for what, attempt in attempts:
        with pytest.raises((GraphError, NodeNotFoundError, ProblemError), match=what):
            attempt()


def test_improper_fields_are_planned_from_scratch() -> None:
    """Weights may be negative there: no length bounds them, and label setting promises nothing."""
    with pytest.warns(ImproperFieldWarning):
        improper = RiskField([Threat(0.5, 0.5, 0.1, peak=3.0), Threat(0.55, 0.5, 0.1, peak=3.0)], improper=True)
    lattice = Lattice(5, bounds=UNIT)
    proper = lazy_cost_matrix(GeometricGraph.complete(lattice, k=2.0), 3)
    odd = GeometricGraph.complete(lattice, improper, 2.0)
    fresh = cost_matrix(odd.under(CostModel(improper, 2.0)), 3)
    for matrix in (lazy_cost_matrix(odd, 3), repair(proper, CostModel(improper, 2.0))):
        assert bits(matrix) == bits(fresh)
    back = repair(fresh, CostModel(k=2.0))
    np.testing.assert_allclose(back.values, proper.values, rtol=0.0, atol=EXACT)
    joined, node = linked(fresh, (0.33, 0.41))
    offers = joined.graph.weights_from(25)[:25] + fresh.values
    assert joined.value(node) == offers.min()
    np.testing.assert_array_equal(
        reweigh(odd.under(CostModel(k=2.0)), CostModel(improper, 2.0)).weight_matrix(), odd.weight_matrix()
    )
