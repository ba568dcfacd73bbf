"""The check of C46: its measurements against a recomputation, and answers where they are known."""

import itertools
from typing import Any

import numpy as np
import pytest

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel import resolution as measured
from cgla_graph.comparisons.claims.panel.resolution import SIZES, K, Way, compared, farthest_pair
from cgla_graph.comparisons.claims.panel.settings import FACTORS, KINDS, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import resolution_claims
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get, solve

STRAIGHT = np.array([[0.0, 0.0], [1.0, 0.0]])
BOUNDS = (0.0, 0.0, 1.0, 1.0)


def farthest(one: FloatArray, other: FloatArray) -> float:
    """Recompute the discrete Fréchet distance of two paths, by its definition, on points 0.005 apart or less."""
    fine = []
    for path in (one, other):
        pieces = [np.linspace(a, b, 2 + int(np.hypot(*(b - a)) / 0.005)) for a, b in itertools.pairwise(path)]
        fine.append(np.vstack(pieces))
    apart = np.hypot(*(fine[0][:, None] - fine[1][None]).transpose(2, 0, 1))
    reach = np.full(tuple(np.add(apart.shape, 1)), np.inf)
    reach[0, 0] = 0.0
    for i, j in np.ndindex(*apart.shape):
        reach[i + 1, j + 1] = max(apart[i, j], min(reach[i, j], reach[i, j + 1], reach[i + 1, j]))
    return float(reach[-1, -1])


@pytest.mark.slow
def test_a_map_has_each_case_once_with_what_is_recomputed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(measured.FACTORS, "k", (10.0,))  # type: ignore[arg-type]
    map_ = PanelMap(7_000_000)
    records = measured.resolution.sample(map_)
    cases = [tuple(record.get(name) for name in ("mode", "radius", "k", "varied")) for record in records]
    # the kind is that of a base cell: three rules and one other K besides the radii
    assert len(set(cases)) == len(cases) == len(measured.KNOWN_K) + len(FACTORS["radius"]) + 3 + 1

    lattices = [Lattice(n, bounds=BOUNDS, kind="upper") for n in SIZES]
    plans = [solve(map_.problem(K), "dijkstra", resolution=lattice) for lattice in lattices]
    (known,) = (one for one in records if (one["mode"], one["k"]) == ("known", K))
    costs = [map_.problem(K).evaluate(plan.path).cost for plan in plans]
    assert known["cost_ratio"] == pytest.approx(max(costs) / min(costs), abs=1e-9)

    uav = Uav("a", (0.1, 0.1), map_.goal, 0.2, step=0.02, k=K)
    flights = [
        Mission(
            World(map_.field, bounds=BOUNDS), [uav], get("cgla"), resolution=of, arrival_radius=0.025, replan="tick"
        )
        for of in lattices
    ]
    flown = [mission.fly().uavs["a"] for mission in flights]
    (found,) = (one for one in records if one.get("varied") == "replan tick")
    apart = max(farthest(flown[a].path, flown[b].path) for a, b in ((0, 1), (0, 2), (1, 2)))
    assert found["distance"] == pytest.approx(apart, abs=0.01)
    assert found["same"] == (found["distance"] <= measured.SAME_WITHIN)
    costs = [one.length + K * one.risk for one in flown]
    assert found["cost_ratio"] == pytest.approx(max(costs) / min(costs), abs=1e-9)


def test_paths_apart_are_as_far_as_they_are() -> None:
    around = np.array([[0.0, 0.0], [0.5, 0.3], [1.0, 0.0]])
    assert farthest_pair([STRAIGHT, STRAIGHT]) == 0.0
    assert farthest_pair([STRAIGHT, around, STRAIGHT]) == pytest.approx(farthest(STRAIGHT, around), abs=0.01)
    # where the waypoints are does not matter
    assert farthest_pair([STRAIGHT, np.array([[0.0, 0.0], [0.123, 0.0], [1.0, 0.0]])]) < 0.011


def test_flights_of_which_some_arrive_are_not_the_same_and_none_says_nothing() -> None:
    arrived, lost = Way(arrived=True, path=STRAIGHT, cost=1.0), Way(arrived=False, path=STRAIGHT, cost=0.5)
    assert compared([arrived, arrived])["same"] is True
    assert compared([arrived, lost]) == {"distance": None, "same": False, "cost_ratio": None}
    assert compared([lost, lost])["same"] is None


def world(*, apart: float) -> list[dict[str, Any]]:
    """Make up paths that are the same but at a radius of 0.1, where they are `apart`."""
    modes = [{"mode": "known", "k": k} for k in measured.KNOWN_K]
    modes += [{"mode": "flown", "k": K, "radius": radius, "varied": ""} for radius in FACTORS["radius"]]
    records = []
    for seed in (seed for kind in KINDS for seed in seeds_of(kind, 5, 40)):
        for mode in modes:
            distance = apart if mode.get("radius") == FACTORS["radius"][0] else 0.03
            of = {"distance": distance, "same": distance <= measured.SAME_WITHIN, "cost_ratio": 1.0 + distance}
            records.append({**PanelMap(seed).levels, **mode, **of})
    return records


def judged(records: list[dict[str, Any]]) -> Finding:
    return resolution_claims._check_c46.check(Evidence(samples={"resolution": Samples(records)}))


def test_paths_that_are_nearly_the_same_are_told_from_others() -> None:
    assert judged(world(apart=0.03)).answers == (Answer.HOLDS,)
    finding = judged(world(apart=0.25))
    known, flown = finding.rows
    assert known.answer is Answer.HOLDS
    assert flown.answer is Answer.DEPENDS
    shown = {row[1]: row[-2] for row in finding.tables[0].rows}
    assert (shown["OR 0.1"], shown["OR 0.4"]) == ("the opposite", "yes")
    assert judged(world(apart=0.03)[:70]).answers == (Answer.OPEN,)
