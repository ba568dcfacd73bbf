"""
Plans with raster weights equal Dijkstra's algorithm on the graph of all of them.

Oracles: `fused_graph` with scipy's Dijkstra, the plain NumPy raster sum, and missions that plan from scratch.
"""

import dataclasses
import itertools
import math
from collections.abc import Callable
from functools import partial
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
import shapely
import strategies
from hypothesis import given
from hypothesis import strategies as st
from oracles import raster
from scipy.sparse.csgraph import dijkstra
from strategies import Segment, fast, few, usual

import cgla_graph as cg
from cgla_graph._types import FloatArray, Point
from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.cost_to_go.model_change import ModelChange
from cgla_graph.errors import ProblemError
from cgla_graph.fusion import raster_kernels
from cgla_graph.fusion import raster_search as raster_module
from cgla_graph.fusion.fusion import fused_graph
from cgla_graph.fusion.raster_search import RasterGuide, understated
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedArea, TimedThreat, World
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.testing import strategies as drawn

UNIT = (0.0, 0.0, 1.0, 1.0)
EXACT = 1e-12
PAPER = load_scenario("paper").problem.field
any_field = st.one_of(drawn.fields(max_threats=6), drawn.crowds(max_threats=18))


# ------------------------------------------------------------------------------------------------------------ bounds
@st.composite
def cases(draw: st.DrawFn) -> tuple[RiskField, Segment]:
    field = draw(any_field)
    start, end = draw(strategies.segments(field))
    length = math.dist(start, end)
    # a part of no more than a tenth
    return field, (start, end if length <= 5.0 else start + (end - start) * 5.0 / length)


def check_understated(field: RiskField, less: RiskField, segment: Segment, samples: int) -> None:
    exact = float(less.line_integral(*segment))
    assert exact <= raster([field.threats], *segment, samples) + 1e-10


@fast
@given(cases(), st.sampled_from([1, 2, 7, 50]), st.floats(1.0, 3.0))
def test_the_integral_of_the_understated_field_is_below_the_raster_sum(
    case: tuple[RiskField, Segment], samples: int, more: float
) -> None:
    field, segment = case
    part = math.dist(*segment) / samples
    check_understated(field, understated(field, more * part), segment, samples)


def test_a_field_that_is_not_understated_enough_would_be_seen() -> None:
    field = RiskField([Threat(0.0, 0.0, spread=0.1)])
    for at in (0.03, 0.3):
        # towards the far end the risk falls, and the raster misses where it is high
        segment = np.array([0.0, 0.0]), np.array([at, 0.0])
        with pytest.raises(AssertionError):
            check_understated(field, field, segment, 3)
    with pytest.raises(AssertionError):
        check_understated(field, understated(field, 0.02), (np.array([0.0, 0.0]), np.array([0.3, 0.0])), 3)


def test_the_understated_field_is_the_best_of_its_kind() -> None:
    threat, part = Threat(0.0, 0.0, spread=0.1), 0.03
    (less,) = understated(RiskField([threat]), part).threats
    chosen = less.peak * less.spread
    for e in np.geomspace(0.01, 10.0, 200):
        peak = math.exp(-0.5 * (1.0 + 1.0 / e) * (part / threat.spread) ** 2)
        assert peak * threat.spread / math.sqrt(1.0 + e) <= chosen * (1.0 + 1e-12)
    assert understated(RiskField([threat]), 0.0).threats == (threat,)
    assert len(understated(RiskField([threat]), 10.0)) == 0


def rough(field: RiskField, segment: Segment, samples: int) -> float:
    (x1, y1), (x2, y2) = segment
    steps = np.arange(1.0, samples + 1.0)
    return raster_kernels.rough_risk(x1, y1, x2, y2, field.table, steps, np.empty(samples))


@fast
@given(cases(), st.integers(1, 60))
def test_the_rough_sum_is_below_the_sum_and_close(case: tuple[RiskField, Segment], samples: int) -> None:
    field, segment = case
    truth = raster([field.threats], *segment, samples)
    # (the oracle rounds, too, relative to a length of up to 5)
    assert truth - 1e-5 * len(field) * math.dist(*segment) - 1e-15 <= rough(field, segment, samples) <= truth + 1e-14


# ------------------------------------------------------------------------------------------------------------- plans
def check(guide: RasterGuide, start: Point, obstacles: list[Threat], goal: Point, lattice: Lattice) -> CostMatrix:
    """Compare cost and path with Dijkstra's algorithm on all weights."""
    model = guide.model
    field = model.field.with_threats(obstacles)
    extra = (goal, start)
    dense = fused_graph(
        lattice, [field], model.k, no_fly=model.no_fly, extra=extra, integral="raster", samples=guide.samples
    )
    assert dense.positions is not None
    source, target = (int(np.flatnonzero((dense.positions == at).all(axis=1))[0]) for at in extra[::-1])
    reference = float(dijkstra(dense.to_csgraph(), indices=source)[target])
    matrix, node = guide.plan(start, obstacles)
    value = matrix.value(node)
    if math.isinf(reference) or math.isinf(value):
        assert value == reference
        assert matrix.path_from(node) == []
        return matrix
    assert abs(value - reference) <= EXACT * max(1.0, model.k / 100.0)
    assert matrix.graph.positions is not None
    path = matrix.graph.positions[[matrix.graph.index_of(one) for one in matrix.path_from(node)]]
    assert path[0].tolist() == list(start)
    assert path[-1].tolist() == list(goal)
    at = [int(np.flatnonzero((dense.positions == spot).all(axis=1))[0]) for spot in path]
    weights = dense.weight_matrix()
    assert abs(sum(weights[i, j] for i, j in itertools.pairwise(at)) - value) <= EXACT * max(1.0, value)
    return matrix


@usual
@given(data=st.data())
def test_a_plan_costs_what_dijkstra_finds(data: st.DataObject) -> None:
    draw = data.draw
    lattice = draw(drawn.lattices(max_side=8, unit=True))
    on_lattice = st.sampled_from([(x, y) for x, y in lattice.points.tolist()])
    spot = st.one_of(drawn.points, on_lattice)
    goal = draw(spot)
    model = draw(strategies.models())
    guide = RasterGuide.lay(lattice, model, goal, bounds=UNIT, samples=draw(st.sampled_from([50, 50, 5, 1])))
    for _ in range(3):
        obstacles = draw(st.lists(drawn.threats(), max_size=2))
        check(guide, draw(spot), obstacles, goal, lattice)
        model = draw(strategies.changed(model))
        guide = guide.knowing(model)


@pytest.mark.slow
@few
@given(drawn.seeds, st.sampled_from([1.0, 10.0, 200.0]), strategies.areas())
def test_plans_on_the_way_cost_what_dijkstra_finds(seed: int, k: float, area: shapely.MultiPolygon) -> None:
    """What the guide learned on the way must not mislead it later."""
    rng = np.random.default_rng(seed)
    lattice = Lattice(8, bounds=UNIT, kind="upper")
    goal = (0.75, 0.75)
    known: list[Threat] = []
    guide = RasterGuide.lay(lattice, CostModel(RiskField(), k), goal, bounds=UNIT)
    for tick in range(3):
        known += [Threat(*rng.random(2), spread=rng.uniform(0.03, 0.1)) for _ in range(2)]
        guide = guide.knowing(CostModel(RiskField(known), k, area if tick > 0 else None))
        for x, y in (0.1 + 0.15 * tick + rng.uniform(0.0, 0.05, (2, 2))).tolist():
            check(guide, (x, y), [Threat(x + 0.06, y + 0.05, spread=0.02)], goal, lattice)
            check(guide, (x, y), [], goal, lattice)


def too_high(matrix: CostMatrix, _: float) -> FloatArray:
    return 1.1 * matrix.values


def never_falls(*_: object) -> ModelChange:
    return dataclasses.replace(ModelChange.between(CostModel(), CostModel()), weights_only_grow=True)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "broken"),
    [
        ("understated", lambda risk, _: risk.with_threats(risk.threats)),
        ("_lowered", too_high),
        ("_lowered", lambda matrix, _: matrix.values + 0.05 * (matrix.values > 0.0)),
        ("ModelChange", SimpleNamespace(between=never_falls)),
        ("CostModel", lambda *model, no_fly=None: CostModel(*model, no_fly=no_fly if model else None)),
    ],
    ids=["risk overstated", "bound too high", "bound a little too high", "learned for good", "walls forgotten"],
)
def test_a_broken_guide_would_be_seen(name: str, broken: object, monkeypatch: pytest.MonkeyPatch) -> None:
    lattice, goal = Lattice(9, bounds=UNIT), (0.9, 0.9)
    walls = shapely.MultiPolygon([shapely.box(0.4, 0.3, 0.6, 0.9)])

    def plan() -> None:
        for seed in range(12):
            rng = np.random.default_rng(seed)
            known = [Threat(*rng.random(2), spread=rng.uniform(0.03, 0.12)) for _ in range(8)]
            guide = RasterGuide.lay(lattice, CostModel(RiskField(known), 20.0, walls), goal, samples=4)
            check(guide, (0.05, 0.1), [Threat(0.3, 0.3, spread=0.05)], goal, lattice)
            check(guide, (0.1, 0.1), [], goal, lattice)
            check(guide.knowing(CostModel(RiskField(known[:2]), 20.0, walls)), (0.1, 0.1), [], goal, lattice)

    plan()
    monkeypatch.setattr(raster_module, name, broken)
    with pytest.raises(AssertionError):
        plan()


def test_few_pairs_are_weighed(monkeypatch: pytest.MonkeyPatch) -> None:
    """On the paper's map, some two thousand of the 160 000 weights decide at worst."""
    counts, search = [], raster_kernels.find_path

    def counted(*arguments: Any) -> tuple[int, int]:  # noqa: ANN401 - whatever the kernel takes
        counts.append(search(*arguments))
        return counts[-1]

    monkeypatch.setattr(raster_kernels, "find_path", counted)
    lattice = Lattice(20, bounds=UNIT, kind="upper")
    guide = RasterGuide.lay(lattice, CostModel(RiskField(), 10.0), (0.9, 0.9))
    for n_known in range(len(PAPER) + 1):
        guide = guide.knowing(CostModel(RiskField(PAPER.threats[:n_known]), 10.0))
        guide.plan((0.1, 0.1))
    assert max(weighed for _, weighed in counts) < 4000
    # what it has learned bounds the next search
    guide.plan((0.1, 0.1))
    assert counts[-1][1] == 0


def test_plans_are_repeatable_and_leave_the_guide_before_as_it_was() -> None:
    lattice = Lattice(10, bounds=UNIT)
    model = CostModel(PAPER, 10.0)

    def fly() -> list[bytes]:
        guide = RasterGuide.lay(lattice, CostModel(RiskField(PAPER.threats[:3]), 10.0), (0.9, 0.9))
        before = guide.matrix.values.tobytes()
        plans = [guide.plan((0.1, 0.1))[0], guide.knowing(model).plan((0.15, 0.1))[0], guide.plan((0.2, 0.1))[0]]
        assert guide.matrix.values.tobytes() == before
        return [plan.values.tobytes() for plan in plans]

    assert fly() == fly()
    guide = RasterGuide.lay(lattice, model, (0.9, 0.9))
    assert guide.knowing(CostModel(RiskField(PAPER.threats), 10.0)) is guide


def test_the_start_may_be_the_goal_and_there_may_be_no_way() -> None:
    lattice = Lattice(5, bounds=UNIT)
    guide = RasterGuide.lay(lattice, CostModel(PAPER, 10.0, shapely.box(0.4, -1.0, 0.6, 2.0)), (0.9, 0.9))
    matrix, node = guide.plan((0.9, 0.9))
    assert matrix.path_from(node) == [node]
    assert matrix.value(node) == 0.0
    matrix, node = guide.plan((0.1, 0.1), [Threat(0.2, 0.2, 0.1)])
    assert matrix.path_from(node) == []
    assert matrix.value(node) == math.inf


def test_what_cannot_be_is_refused() -> None:
    with pytest.warns(ImproperFieldWarning):
        improper = RiskField([Threat(0.5, 0.5, 0.1, peak=2.0)], improper=True)
    lay, goal, model = partial(RasterGuide.lay, Lattice(5, bounds=UNIT)), (0.9, 0.9), CostModel(PAPER, 1.0)
    attempts: list[tuple[str, Callable[[], object]]] = [
        ("peak above 1", lambda: understated(improper, 0.1)),
        ("part", lambda: understated(PAPER, -1.0)),
        ("peak above 1", lambda: lay(CostModel(improper, 1.0), goal)),
        ("samples", lambda: lay(model, goal, samples=0)),
        ("wider bounds", lambda: lay(model, goal).plan((-0.5, 0.1))),
        ("peak", lambda: lay(model, goal).plan((0.1, 0.1), [Threat(0.5, 0.5, 0.1, peak=2.0)])),
    ]
    for said, attempt in attempts:
        with pytest.raises(ProblemError, match=said):
            attempt()


# ----------------------------------------------------------------------------------------------------------- flights
def check_flights(mission: cg.Mission) -> None:
    flight, scratch = mission.fly(), dataclasses.replace(mission, incremental=False).fly()
    for name, one in flight.uavs.items():
        other = scratch.uavs[name]
        assert (one.status, one.replans, one.ended) == (other.status, other.replans, other.ended)
        assert abs(one.length - other.length) <= EXACT
        assert abs(one.risk - other.risk) <= EXACT
        np.testing.assert_allclose(one.trace, other.trace, rtol=0.0, atol=1e-9)


@pytest.mark.slow
@few
@given(
    drawn.seeds,
    st.sampled_from([2.0, 10.0, 200.0]),
    st.sampled_from(
        [{}, {"virtual_obstacle": True}, {"virtual_obstacle": True, "sharing": "none"}, {"start": "snapped"}]
    ),
)
def test_flights_are_those_planned_from_scratch(seed: int, k: float, settings: dict[str, Any]) -> None:
    rng = np.random.default_rng(seed)
    spots = rng.random((6, 2)).tolist()
    seen = [Threat(x, y, spread=rng.uniform(0.02, 0.1)) for x, y in spots[:4]]
    late = [Threat(x, y, spread=0.05) for x, y in spots[4:]]
    timed = [TimedThreat(late[0], appears=3), TimedThreat(late[1], appears=1, vanishes=8)]
    square = TimedArea(shapely.box(0.45, 0.3, 0.52, 0.41), appears=2, vanishes=12)
    uavs = [Uav("a", (0.1, 0.12), (0.9, 0.87), 0.3, k=k), Uav("b", (0.13, 0.85), (0.88, 0.1), 0.3, k=k)]
    world = World(RiskField(seen), timed=[*timed, square])
    settings = {**settings, "resolution": 8, "integral": "raster", "collisions": "record", "max_ticks": 60}
    check_flights(cg.Mission(world, uavs, cg.solvers.get("cgla"), **settings))


def test_flights_do_not_weigh_every_pair(monkeypatch: pytest.MonkeyPatch) -> None:
    """And where another solver, fusion or excluded points need all weights, they do."""

    def refuse(*_: object, **__: object) -> None:
        msg = "every pair"
        raise ProblemError(msg)

    monkeypatch.setattr("cgla_graph.mission.replanner.fused_graph", refuse)
    mission = cg.Mission(
        World(PAPER), [Uav("a", (0.1, 0.1), (0.9, 0.9), 0.2)], cg.solvers.get("cgla"), resolution=6, integral="raster"
    )
    assert mission.fly().all_arrived
    others: list[dict[str, Any]] = [
        {"solver": cg.solvers.get("dijkstra")},
        {"fusion": "max_integral"},
        {"exclude": "last"},
        {"incremental": False},
    ]
    for settings in others:
        flight = dataclasses.replace(mission, **settings).fly()
        assert any("every pair" in str(event.document()) for event in flight.events)
