"""Claims about a single UAV: theorems on real samples, statistics on worlds where the answer is known."""

import dataclasses
import math
from collections.abc import Callable, Sequence
from functools import cache
from itertools import product
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few, seeds, usual

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, Contrast, adjusted, all_hold, contrast, rate_contrasts
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import printed_values, sudden_claims, weight_claims
from cgla_graph.comparisons.claims.paper.flights import fly_alone, measures, positions_at_steps, risk_sum
from cgla_graph.comparisons.claims.paper.printed_values import TABLE_1, rows_with_length, value
from cgla_graph.comparisons.claims.paper.resolution_claims import farthest_pair
from cgla_graph.comparisons.claims.paper.sudden_claims import POPUP_K
from cgla_graph.comparisons.claims.paper.weight_claims import OFFLINE_K, ONLINE_K
from cgla_graph.mission.records import UavFlight
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.random_map import random_scenario

CLAIMS = catalogue.claims()
MAPS = 25


# --- worlds where the answer is known -------------------------------------------------------------------------------


def best_of(paths: Sequence[tuple[float, float]], weights: Sequence[float]) -> list[Record]:
    """Return the cheapest of some paths (length, risk) under each weight."""
    found = [min(paths, key=lambda path, k=k: path[0] + k * path[1]) for k in weights]
    return [
        {"k": k, "length": length, "risk": risk, "cost": length + k * risk}
        for k, (length, risk) in zip(weights, found, strict=True)
    ]


def some_paths(rng: np.random.Generator) -> list[tuple[float, float]]:
    return [(1.1 + length, risk) for length, risk in rng.random((9, 2)).tolist()]


def optima(seed: int, weights: Sequence[float], maps: int = MAPS, **case: object) -> list[Record]:
    rng = np.random.default_rng(seed)
    return [{"map": i, **case, **record} for i in range(maps) for record in best_of(some_paths(rng), weights)]


def flights(
    seed: int, weights: Sequence[float], *, risk: float, length: float, maps: int = MAPS, **case: object
) -> list[Record]:
    """
    Make up flights: from each K to the next, the risk is divided and the length multiplied by so much, with noise.

    1 is a world in which K does nothing.
    """
    rng = np.random.default_rng(seed)
    records = []
    for number in range(maps):
        base = rng.lognormal(0.0, 1.0)
        for cell in CELLS:
            for step, k in enumerate(weights):
                noise = rng.lognormal(0.0, 0.3, 3)
                met = base * risk**-step
                made = {"risk_sum": met * noise[0], "max_risk": 0.1 * met * noise[1], "length": length**step * noise[2]}
                records.append({"map": number, **case, **cell, "k": k, "arrived": True, **made})
    return records


def online_world(seed: int, *, risk: float, length: float) -> Evidence:
    return Evidence(
        samples={
            "offline-k": Samples(optima(seed, OFFLINE_K)),
            "online-k": Samples(flights(seed, ONLINE_K, risk=risk, length=length)),
        }
    )


def popup_world(seed: int, *, risk: float, length: float) -> Evidence:
    known = optima(seed, POPUP_K, sudden=True, integral="known")
    return Evidence(
        samples={"pop-up": Samples([*flights(seed, POPUP_K, risk=risk, length=length, sudden=True), *known])}
    )


def lattice_world(seed: int, *, same: float) -> Evidence:
    """Make up paths that are the same on so large a share of maps."""
    rng = np.random.default_rng(seed)
    cases: list[dict[str, Any]] = [
        {"mode": "offline", "integral": "exact"},
        *({"mode": "online", **cell} for cell in CELLS),
    ]
    records = []
    for number in range(200):
        for case in cases:
            far = 0.03 if rng.random() < same else 0.4
            nested = {"nested_10": 1.3, "nested_20": 1.25, "nested_40": 1.24} if case["mode"] == "offline" else {}
            records.append({"map": number, **case, "frechet": far, "spread": 0.01 * rng.random(), **nested})
    return Evidence(samples={"resolution": Samples(records)})


WORLDS: dict[str, Callable[..., Evidence]] = {
    "C28": online_world,
    "C29": online_world,
    "C30": online_world,
    "C37": popup_world,
}


@pytest.fixture
def once(monkeypatch: pytest.MonkeyPatch) -> None:
    """Fly what does not depend on the sample only once for all worlds."""
    real = weight_claims.fly_alone
    flown: dict[tuple[float, str, float], UavFlight] = _FLOWN

    def fly(field: RiskField, *, k: float, integral: str, radius: float) -> UavFlight:
        key = (k, integral, radius)
        if key not in flown:
            flown[key] = real(field, k=k, integral=integral, radius=radius)
        return flown[key]

    monkeypatch.setattr(weight_claims, "fly_alone", fly)
    monkeypatch.setattr(weight_claims, "_stored_flights", cache(weight_claims._stored_flights))


_FLOWN: dict[tuple[float, str, float], UavFlight] = {}


@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("name", WORLDS)
def test_tells_worlds_apart_where_k_matters_and_where_it_does_not(name: str) -> None:
    def verdict(seed: int, **effect: float) -> Verdict:
        return CLAIMS[name].check(WORLDS[name](seed, **effect)).verdict

    assert verdict(1, risk=2.0, length=1.5) is Verdict.SUPPORTED
    assert verdict(1, risk=0.5, length=1.0 / 1.5) is Verdict.NOT_SUPPORTED
    supported = [verdict(seed, risk=1.0, length=1.0) is Verdict.SUPPORTED for seed in range(12)]
    assert not any(supported)


@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("name", ["C29", "C37"])
@pytest.mark.parametrize("effect", [{"risk": 2.5, "length": 1.0}, {"risk": 1.0, "length": 2.0}])
def test_half_of_a_claim_is_not_all_of_it(name: str, effect: dict[str, float]) -> None:
    finding = CLAIMS[name].check(WORLDS[name](3, **effect))
    assert finding.verdict is Verdict.NOT_SUPPORTED
    assert sorted(part.verdict.label for part in finding.parts) == ["not supported", "proved", "supported"]


@pytest.mark.usefixtures("once")
def test_one_cell_that_fails_is_enough() -> None:
    world = online_world(1, risk=2.0, length=1.5)
    records = [dict(record) for record in world.samples["online-k"].records]
    for record in records:
        if (record["integral"], record["radius"]) == ("raster", 0.22):
            record["risk_sum"] = 1.0
    broken = dataclasses.replace(world, samples={**world.samples, "online-k": Samples(records)})
    for name in ("C28", "C29"):
        finding = CLAIMS[name].check(broken)
        assert finding.verdict is Verdict.NOT_SUPPORTED
        assert any("of 12 cells" in part.result or "5 of 6 cells" in part.result for part in finding.parts)


def test_lattice_claim_tells_worlds_apart() -> None:
    assert CLAIMS["C46"].check(lattice_world(1, same=1.0)).verdict is Verdict.SUPPORTED
    assert CLAIMS["C46"].check(lattice_world(1, same=0.8)).verdict is Verdict.NOT_SUPPORTED
    halves = [dict(record) for record in lattice_world(1, same=1.0).samples["resolution"].records]
    for record in halves:
        if record["mode"] == "online" and record["radius"] == CELLS[-1]["radius"]:
            record["frechet"] = 0.4
    half = CLAIMS["C46"].check(Evidence(samples={"resolution": Samples(halves)}))
    assert half.verdict is Verdict.NOT_SUPPORTED
    assert [part.verdict.label for part in half.parts] == ["supported", "not supported", "proved", "supported"]
    # at the border itself, a share above it is not shown
    border = [CLAIMS["C46"].check(lattice_world(seed, same=0.95)).verdict for seed in range(6)]
    assert set(border) == {Verdict.NOT_SUPPORTED}


@pytest.mark.parametrize(("worst", "arrived", "holds"), [(0.3, True, True), (0.7, True, False), (None, False, False)])
def test_sudden_threats_are_evaded_or_not(worst: float | None, *, arrived: bool, holds: bool) -> None:
    """Who does not arrive has not evaded."""
    records = [
        {
            "map": i,
            "k": k,
            **cell,
            "sudden": True,
            "arrived": arrived or i % 5 == 0,
            "max_risk": worst if i % 5 else 0.1,
        }
        for i, cell, k in product(range(200), CELLS, POPUP_K)
    ]
    finding = CLAIMS["C38"].check(Evidence(samples={"pop-up": Samples(records)}))
    assert finding.verdict is Verdict.REFUTED
    assert (finding.parts[1].verdict is Verdict.SUPPORTED) is holds


@pytest.mark.parametrize(("spread", "holds"), [(0.02, True), (0.05, False), (0.08, False)])
def test_costs_on_several_lattices_are_equivalent_or_not(spread: float, *, holds: bool) -> None:
    records = [
        {**record, "spread": spread * float(np.random.default_rng(int(record["map"])).uniform(0.5, 1.5))}
        for record in lattice_world(1, same=1.0).samples["resolution"].records
    ]
    part = CLAIMS["C46"].check(Evidence(samples={"resolution": Samples(records)})).parts[3]
    assert (part.verdict is Verdict.SUPPORTED) is holds


# --- cells ----------------------------------------------------------------------------------------------------------


def test_few_tables_without_effect_show_one() -> None:
    def contrasts(seed: int) -> list[Contrast]:
        samples = Samples(flights(seed, ONLINE_K[:2], risk=1.0, length=1.0, maps=12))
        return [contrast(samples, "", "length", {"k": 10.0}, {"k": 50.0}, cell) for cell in CELLS]

    tables = [contrasts(seed) for seed in range(120)]
    shown = sum(any(one.holds for one in adjusted(table)) for table in tables)
    without_holm = sum(any(one.holds for one in table) for table in tables)
    assert shown <= 10 < without_holm


@usual
@given(st.lists(st.floats(0.01, 100.0), min_size=6, max_size=30), st.floats(1.001, 100.0))
def test_contrast_is_the_ratio_where_all_maps_have_it(values: list[float], ratio: float) -> None:
    records = [
        {"map": i, "k": k, "risk": value * (ratio if k == 1 else 1.0)} for i, value in enumerate(values) for k in (1, 2)
    ]
    there = contrast(Samples(records), "", "risk", {"k": 1}, {"k": 2}, {})
    back = contrast(Samples(records), "", "risk", {"k": 2}, {"k": 1}, {})
    assert there.shift.shift.median == pytest.approx(ratio)
    assert there.holds
    assert not back.holds


def test_nothing_holds_of_nothing() -> None:
    assert not all_hold([])
    empty = contrast(Samples([]), "", "risk", {"k": 1}, {"k": 2}, {})
    assert empty.shift.n == 0
    assert not all_hold([empty])
    assert not rate_contrasts([("", {}, np.array([np.nan]), np.array([1.0]))])[0].holds


def test_rates_differ_only_where_that_is_no_chance() -> None:
    few, many = np.arange(20) < 2, np.arange(20) < 5
    (slightly,) = rate_contrasts([("", {}, many.astype(float), few.astype(float))])
    (clearly,) = rate_contrasts([("", {}, np.ones(20), few.astype(float))])
    (wrongly,) = rate_contrasts([("", {}, few.astype(float), np.ones(20))])
    assert slightly.first > slightly.second
    assert (slightly.holds, clearly.holds, wrongly.holds) == (False, True, False)


def test_zero_risk_is_not_left_out() -> None:
    records = [{"map": i, "k": k, "risk": 0.0 if k == 2 else 0.1 + i} for i in range(8) for k in (1, 2)]
    assert contrast(Samples(records), "", "risk", {"k": 1}, {"k": 2}, {}).shift.n == 8


# --- theorems -------------------------------------------------------------------------------------------------------


@usual
@given(seeds)
def test_exchange_argument_holds_for_whatever_paths_there_are(seed: int) -> None:
    rng = np.random.default_rng(seed)
    records = [{"map": i, **record} for i in range(3) for record in best_of(some_paths(rng), OFFLINE_K)]
    assert "3 maps" in weight_claims.exchange_holds(Samples(records), OFFLINE_K)


@pytest.mark.parametrize("name", ["risk", "length", "cost"])
def test_paths_that_are_not_optimal_are_found_out(name: str) -> None:
    records = [dict(record) for record in optima(5, OFFLINE_K, maps=3)]
    worst = records[len(OFFLINE_K) + 3]
    worst[name] = worst[name] * (0.5 if name == "cost" else 3.0)
    with pytest.raises(AssertionError, match="an optimum is none"):
        weight_claims.exchange_holds(Samples(records), OFFLINE_K)
    worst[name] = None
    with pytest.raises(AssertionError):
        weight_claims.exchange_holds(Samples(records), OFFLINE_K)


def test_a_least_cost_that_is_not_concave_is_found_out() -> None:
    records = [{"map": 0, "k": k, "risk": 0.1, "length": 1.1, "cost": 1.1 + 1e-6 * k * k} for k in OFFLINE_K]
    with pytest.raises(AssertionError, match="not concave"):
        weight_claims.exchange_holds(Samples(records), OFFLINE_K)


def test_nested_lattices_that_cost_more_are_found_out() -> None:
    world = lattice_world(1, same=1.0)
    records = [dict(record) for record in world.samples["resolution"].records]
    records[0]["nested_40"] = 1.26
    with pytest.raises(AssertionError, match="costs more"):
        CLAIMS["C46"].check(Evidence(samples={"resolution": Samples(records)}))


@few
@given(st.floats(0.01, 0.2), st.floats(0.05, 1.0), st.integers(1, 6), seeds)
def test_no_way_out_of_a_threat_beats_half_a_crossing(spread: float, distance: float, bends: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    angle = rng.uniform(0.0, 2.0 * math.pi)
    end = distance * np.array([math.cos(angle), math.sin(angle)])
    path = np.vstack([[0.0, 0.0], rng.uniform(-0.5, 0.5, (bends, 2)), end])
    field = RiskField([Threat(0.0, 0.0, spread=spread)])
    least = sudden_claims.half_crossing(spread, distance)
    assert field.line_integral(path[:-1], path[1:]).sum() >= least * (1.0 - 1e-9)
    straight = field.line_integral(path[:1], path[-1:]).sum()
    assert straight == pytest.approx(least, rel=1e-9)


# --- counterexamples ------------------------------------------------------------------------------------------------


def test_risk_rises_with_k_on_the_stored_map() -> None:
    low, high = weight_claims._stored_flights()
    assert (high.risk > 1.02 * low.risk, high.length > 2.0 * low.length) == (True, True)


def test_a_threat_beside_the_uav_is_no_counterexample(monkeypatch: pytest.MonkeyPatch) -> None:
    found = counterexamples.mission("threat-on-top.toml")
    (timed,) = found.world.timed
    moved = dataclasses.replace(timed, threat=dataclasses.replace(timed.threat, y=0.8))
    world = dataclasses.replace(found.world, timed=[moved])
    monkeypatch.setattr(counterexamples, "mission", lambda _: dataclasses.replace(found, world=world))
    with pytest.raises(AssertionError, match="no longer"):
        CLAIMS["C38"].check(Evidence(samples={"pop-up": Samples([])}))


# --- the paper's tables ---------------------------------------------------------------------------------------------


def test_arithmetic_of_printed_lengths() -> None:
    finding = CLAIMS["C31"].check(Evidence())
    assert finding.verdict is Verdict.NOT_TESTABLE
    assert [part.verdict for part in finding.parts] == [Verdict.REFUTED, Verdict.PROVED]
    scales = [row.greatest_scale for row in rows_with_length()]
    assert scales == sorted(scales, key=lambda scale: scale or 0.0)
    assert len(scales) == 19
    assert sum((scale or 0.0) < 200.0 for scale in scales) == 6
    assert value("Table 1", "BCV").length == 256.0
    with pytest.raises(KeyError, match="no row"):
        value("Table 1", "Dijkstra")


def test_a_table_without_the_contradiction_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    tame = tuple(
        dataclasses.replace(row, length=300.0) if row.method == "CGLA, K = 200" else row
        for row in printed_values.TABLES
    )
    monkeypatch.setattr(printed_values, "TABLES", tame)
    with pytest.raises(AssertionError, match="not as they are printed"):
        CLAIMS["C31"].check(Evidence())


def test_only_cglas_risks_are_the_authors_own() -> None:
    assert [row.method for row in TABLE_1 if row.own_risk] == ["CGLA, K = 10", "CGLA, K = 50", "CGLA, K = 200"]


# --- measurements ---------------------------------------------------------------------------------------------------


@few
@given(st.lists(st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), min_size=2, max_size=6, unique=True))
def test_positions_lie_on_the_path_a_step_apart(points: list[tuple[float, float]]) -> None:
    path = np.array(points)
    line = shapely.LineString(path)
    found = positions_at_steps(path)
    assert found[0].tolist() == path[0].tolist()
    assert found[-1] == pytest.approx(path[-1])
    along = [step * 0.02 for step in range(len(found) - 1)]
    expected = [line.interpolate(distance).coords[0] for distance in along]
    assert np.abs(found[:-1] - expected).max() < 1e-9
    assert len(found) == pytest.approx(math.ceil(line.length / 0.02 - 1e-9) + 1)


def test_risk_sum_of_a_path_is_that_of_its_flight() -> None:
    field = RiskField([Threat(0.5, 0.45, 0.06)])
    flight = fly_alone(field, k=0.0, start=(0.1, 0.5), goal=(0.9, 0.5))
    assert flight.trace[-1][0] == pytest.approx(0.88)
    assert flight.risk_sum == pytest.approx(risk_sum(field, flight.path))


def test_an_unfinished_flight_has_no_length() -> None:
    flight = fly_alone(RiskField(), k=1.0)
    assert measures(flight)["length"] == pytest.approx(flight.length)
    stuck = dataclasses.replace(flight, status=type(flight.status).STUCK)
    found = measures(stuck)
    assert (found["arrived"], found["length"], found["risk_sum"], found["status"]) == (False, None, None, "stuck")


def test_paths_apart_are_as_far_as_they_are() -> None:
    straight = np.array([[0.0, 0.0], [1.0, 0.0]])
    around = np.array([[0.0, 0.0], [0.5, 0.3], [1.0, 0.0]])
    assert farthest_pair([straight, straight]) == 0.0
    assert farthest_pair([straight, around, straight]) == pytest.approx(0.3, abs=0.01)
    # where the waypoints are does not matter
    assert farthest_pair([straight, np.array([[0.0, 0.0], [0.123, 0.0], [1.0, 0.0]])]) < 0.011


@cache
def measured(name: str) -> list[Record]:
    return list(catalogue.experiments()[name].sample(7))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["online-k", "offline-k", "pop-up", "resolution"])
def test_samples_have_each_case_once(name: str) -> None:
    records = measured(name)
    cases = [tuple(record.get(entry) for entry in ("mode", "integral", "radius", "k", "sudden")) for record in records]
    assert len(set(cases)) == len(cases)
    assert all(isinstance(value, str | int | float | bool | None) for record in records for value in record.values())


def test_samples_are_the_same_each_time() -> None:
    assert weight_claims.offline_k.sample(7) == measured("offline-k")
    flight = fly_alone(random_scenario(7).problem.field, k=ONLINE_K[0], **CELLS[0])
    assert measures(flight).items() <= measured("online-k")[0].items()


def test_real_samples_obey_the_theorems() -> None:
    known = Samples([{"map": seed, **record} for seed in range(3) for record in weight_claims.offline_k.sample(seed)])
    weight_claims.exchange_holds(known, OFFLINE_K)
    risks = np.column_stack([known.column("risk", k=k) for k in OFFLINE_K])
    assert (risks[:, 0] > risks[:, -1]).all()
    sizes = Samples([{"map": 7, **record} for record in measured("resolution")])
    finding: Finding = CLAIMS["C46"].check(Evidence(samples={"resolution": sizes}))
    assert finding.parts[2].verdict is Verdict.PROVED
