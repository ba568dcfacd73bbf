"""Other solvers of timed problems: exact on their graphs, judged by the oracle, and never better than a proof."""

import math

import networkx as nx
import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph.errors import CglaError
from cgla_graph.solvers.timed.joining import bends, joined_costs, leg_costs

STORM = cg.MovingThreat([(0, 0.3, 0.9), (0.7, 0.5, 0.4), (1.5, 0.8, 0.6)], spread=[0.1, 0.2, 0.1], peak=0.8)
GATE = cg.TimedArea(shapely.box(0.45, 0.0, 0.55, 0.9), appears=0.0, vanishes=0.6)
PEERS = ("space-time-lattice", "space-time-rrt-star", "replanning")
CHANGES = ({}, {"wind": (0.2, -0.1)}, {"waiting": 0.4}, {"risk_per": "time", "departure": (0.0, 0.5)})


def problem(**changes: object) -> cg.TimedProblem:
    given = {"moving": [STORM], "areas": [GATE], "speed": 1.0, "k": 3.0, **changes}
    return cg.TimedProblem((0.1, 0.5), (0.9, 0.5), **given)  # type: ignore[arg-type]


@settings(max_examples=12, deadline=None)
@given(st.integers(0, 999), st.sampled_from(CHANGES))
def test_legs_cost_what_the_oracle_says(seed: int, changes: dict[str, object]) -> None:
    """Legs that ignore events, areas or the risk of their own time differ from the oracle."""
    timed = problem(**changes)
    rng = np.random.default_rng(seed)
    firsts, lasts = (np.column_stack([rng.uniform(0, 1, 8), rng.uniform(0, 1, (8, 2))]) for _ in range(2))
    lasts[:, 0] = firsts[:, 0] + rng.uniform(0.01, 1.2, 8)
    half = bends(timed, firsts, lasts)
    costs = joined_costs(timed, firsts, lasts)
    for first, middle, last, cost in zip(firsts, half, lasts, costs, strict=True):
        if not np.isfinite(middle).all():
            air = last[1:] - first[1:] - np.array(timed.constant_wind) * (last[0] - first[0])
            assert math.hypot(*air) > last[0] - first[0]
            assert cost == math.inf
            continue
        seen = timed.evaluate([first, middle, last])
        wrong = [words for words in seen.violations if "departs" not in words]
        assert (cost == math.inf) == bool(wrong), wrong
        assert wrong or cost == pytest.approx(seen.cost, rel=1e-9)


@pytest.mark.parametrize("changes", CHANGES)
def test_the_lattice_is_exact_on_its_graph(changes: dict[str, object]) -> None:
    """A search that leaves out loops, or that leaves out later departures, costs more here."""
    timed, ticks, size = problem(**changes), 4, 4
    found = cg.solve(timed, "space-time-lattice", tolerance=None, resolution=size, ticks=ticks, reach=math.inf)
    tick = float(timed.fly([timed.start, timed.goal])[-1, 0]) / ticks
    grid = np.linspace(0.0, 1.0, size)
    places = [timed.start, *((x, y) for y in grid for x in grid)]
    graph = nx.DiGraph()
    layers = math.ceil(found.cost / tick) + 1
    first, last = timed.departures
    wind = np.array(timed.constant_wind)
    for layer in range(layers):
        begins = first + layer * tick
        if begins <= last + 1e-9:
            graph.add_edge("from", (0, layer), weight=0.0)
        for i, place in enumerate(places):
            lasts, to = [], []
            for j, other in enumerate(places):
                n = next(
                    n for n in range(1, 200) if math.dist(other, place + n * tick * wind) <= n * tick * (1.0 + 1e-11)
                )
                lasts.append([begins + n * tick, *other])
                to.append((j, layer + n))
            firsts = np.tile([begins, *place], (len(lasts), 1))
            for there, cost in zip(to, joined_costs(timed, firsts, np.array(lasts)), strict=True):
                if cost < math.inf:
                    graph.add_edge((i, layer), there, weight=cost)
            goal = timed.fly([place, timed.goal], begins)
            straight = leg_costs(timed, goal[:1], goal[1:])[0]
            if straight < math.inf:
                graph.add_edge((i, layer), "to", weight=straight)
    assert found.cost == pytest.approx(nx.dijkstra_path_length(graph, "from", "to"), rel=1e-9)


@pytest.mark.parametrize("changes", [CHANGES[1], pytest.param(CHANGES[2], marks=pytest.mark.slow)])
def test_no_peer_is_better_than_ours(changes: dict[str, object]) -> None:
    timed = problem(**changes)
    few: dict[str, dict[str, int]] = {
        "space-time": {"nodes": 20_000},
        "space-time-lattice": {"resolution": 10, "ticks": 30},
        "space-time-rrt-star": {"samples": 300},
        "replanning": {"resolution": 12},
    }
    ours, *peers = (cg.solve(timed, name, tolerance=None, **few.get(name, {})) for name in ("space-time", *PEERS))
    assert all(plan.status.has_path for plan in (ours, *peers[:2]))
    assert all(plan.cost >= ours.cost * (1.0 - 1e-6) for plan in peers)
    again = cg.solve(timed, PEERS[1], tolerance=None, samples=300)
    np.testing.assert_array_equal(again.trajectory, peers[1].trajectory)


def test_time_until_a_gate_opens_is_passed_cheaply() -> None:
    """Planned without the lattice's flight as a first one, this costs 1.69: the march does not dawdle well."""
    storm = cg.MovingThreat([(0, 0.2, 0.8), (3, 0.8, 0.0)], spread=0.08, peak=0.9)
    gate = cg.TimedArea(shapely.box(0.45, 0, 0.5, 0.9), appears=0, vanishes=1.5)
    timed = cg.TimedProblem((0.1, 0.1), (0.9, 0.1), moving=[storm], areas=[gate], speed=0.5, k=10)
    assert cg.solve(timed, tolerance=None, nodes=20_000).cost < 1.28


@pytest.mark.parametrize("name", PEERS)
def test_where_peers_find_nothing_they_say_so(name: str) -> None:
    closed = problem(areas=[cg.TimedArea(shapely.box(0.0, 0.4, 0.2, 0.6), appears=0.0)])
    few: dict[str, int] = {"samples": 100} if "rrt" in name else {}
    assert not cg.solve(closed, name, tolerance=None, **few).status.has_path
    late = cg.solve(problem(latest=0.5), name, tolerance=None, **few)
    assert late.cost == math.inf
    at_once = cg.TimedProblem((0.2, 0.2), (0.2, 0.2), speed=1.0)
    assert cg.solve(at_once, name, tolerance=None).cost == 0.0
    with pytest.raises(CglaError, match=r"resolution|samples"):
        cg.solve(closed, name, tolerance=None, **{"samples" if "rrt" in name else "resolution": 0})
