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
from cgla_graph.comparisons.claims.claim import Part, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, INTEGRALS, Contrast, contrast, holds, judged, rate_contrast
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import sudden_claims, weight_claims
from cgla_graph.comparisons.claims.paper.flights import fly_alone, measures, positions_at_steps, risk_sum
from cgla_graph.comparisons.claims.paper.sudden_claims import POPUP_K, SPREADS, SPREADS_AWAY
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


def online_world(seed: int, *, risk: float, length: float, maps: int = MAPS) -> Evidence:
    return Evidence(
        samples={
            "offline-k": Samples(optima(seed, OFFLINE_K)),
            "online-k": Samples(flights(seed, ONLINE_K, risk=risk, length=length, maps=maps)),
        }
    )


def popup_world(seed: int, *, risk: float, length: float, maps: int = MAPS) -> Evidence:
    known = optima(seed, POPUP_K, maps, integral="known")
    flown = flights(seed, POPUP_K, risk=risk, length=length, maps=maps, ahead=None)
    return Evidence(samples={"pop-up": Samples([*flown, *known])})


def evaded_world(met: Callable[[float, float], float], *, maps: int = 80, arrived: bool = True) -> Evidence:
    """Make up flights that meet so much of a threat that comes up so many spreads ahead, for some K."""
    fig6 = [{**cell, "ahead": None} for cell in CELLS]
    grid = [
        {"integral": integral, "radius": 0.2, "replan": "change", "ahead": ahead, "spread": spread}
        for integral, ahead, spread in product(INTEGRALS, SPREADS_AWAY, SPREADS)
    ]
    records = [
        {
            "map": number,
            **case,
            "k": k,
            # raster sums: a flight with exact integrals that does not arrive is against a theorem
            "arrived": arrived or case["integral"] == "exact" or number % 5 == 0,
            "met": met(case["ahead"] or 2.2, k),
        }
        for number, k, case in product(range(maps), POPUP_K, [*fig6, *grid])
    ]
    return Evidence(samples={"pop-up": Samples(records)})


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

    def fly(field: RiskField, *, k: float, **cell: Any) -> UavFlight:  # noqa: ANN401 - a cell
        key = (k, *cell.values())
        if key not in _FLOWN:
            _FLOWN[key] = real(field, k=k, **cell)
        return _FLOWN[key]

    monkeypatch.setattr(weight_claims, "fly_alone", fly)
    monkeypatch.setattr(weight_claims, "_stored_flights", cache(weight_claims._stored_flights))


_FLOWN: dict[tuple[Any, ...], UavFlight] = {}


def verdicts(parts: Sequence[Part]) -> list[Verdict]:
    return [part.verdict for part in parts]


def decided(name: str, world: Evidence) -> list[Verdict]:
    """Check a claim, and return the verdicts of the parts that the sample decides."""
    fixed = {Verdict.PROVED, Verdict.REFUTED, Verdict.NOT_TESTABLE}
    found = verdicts(CLAIMS[name].check(world).parts)
    assert [verdict for verdict in found if verdict in fixed] == FIXED[name]
    return [verdict for verdict in found if verdict not in fixed]


#: What no sample decides, in the order of the parts.
FIXED = {
    "C28": [Verdict.PROVED, Verdict.REFUTED],
    "C29": [Verdict.PROVED, Verdict.REFUTED],
    "C30": [Verdict.NOT_TESTABLE],
    "C37": [Verdict.PROVED],
}


@pytest.mark.slow
@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("name", WORLDS)
def test_tells_worlds_apart_where_k_matters_and_where_it_does_not(name: str) -> None:
    assert set(decided(name, WORLDS[name](1, risk=2.0, length=1.5))) == {Verdict.SUPPORTED}
    assert set(decided(name, WORLDS[name](1, risk=0.5, length=1.0 / 1.5))) == {Verdict.CONTRADICTED}
    nothing = [verdict for seed in range(12) for verdict in decided(name, WORLDS[name](seed, risk=1.0, length=1.0))]
    assert Verdict.SUPPORTED not in nothing
    assert nothing.count(Verdict.CONTRADICTED) <= 0.05 * len(nothing) + 2
    # too few maps for any p below 0.05
    finding = CLAIMS[name].check(WORLDS[name](1, risk=2.0, length=1.5, maps=5))
    assert Verdict.UNDECIDED in finding.verdicts
    assert any("1 more maps" in part.result for part in finding.parts)


@pytest.mark.usefixtures("once")
@pytest.mark.parametrize("name", ["C29", "C37"])
@pytest.mark.parametrize(
    ("effect", "found"),
    [
        ({"risk": 2.5, "length": 1.0}, [Verdict.SUPPORTED, Verdict.UNDECIDED]),
        ({"risk": 1.0, "length": 2.0}, [Verdict.UNDECIDED, Verdict.SUPPORTED]),
        ({"risk": 2.5, "length": 0.5}, [Verdict.SUPPORTED, Verdict.CONTRADICTED]),
    ],
)
def test_risk_and_length_are_told_apart(name: str, effect: dict[str, float], found: list[Verdict]) -> None:
    assert decided(name, WORLDS[name](3, **effect)) == found


@pytest.mark.usefixtures("once")
def test_one_cell_that_fails_is_enough() -> None:
    world = online_world(1, risk=2.0, length=1.5)
    records = [dict(record) for record in world.samples["online-k"].records]
    for record in records:
        if (record["integral"], record["radius"], record["replan"]) == ("raster", 0.22, "tick"):
            record["risk_sum"] = 1.0
    broken = dataclasses.replace(world, samples={**world.samples, "online-k": Samples(records)})
    for name, cells in (("C28", "22 of 24 cells"), ("C29", "11 of 12 cells")):
        finding = CLAIMS[name].check(broken)
        assert finding.parts[1].verdict is Verdict.UNDECIDED
        assert cells in finding.parts[1].result


@pytest.mark.slow
@pytest.mark.usefixtures("once")
def test_effects_stand_beside_the_papers_own() -> None:
    online, popup = online_world(1, risk=2.0, length=1.5), popup_world(1, risk=2.0, length=1.5)
    printed = {name: [part.printed for part in CLAIMS[name].check(online).parts] for name in ("C28", "C29", "C30")}
    assert printed == {"C28": ["", "3.83 and 4.58", ""], "C29": ["", "17.5", "1.12", ""], "C30": ["", ""]}
    _, risk, length = CLAIMS["C37"].check(popup).parts
    assert (risk.printed, length.printed) == ("22.6 % less", "4.8 % more")
    # half the risk, and half as much length again
    assert (int(risk.effect.split()[0][0]), "% more, 95 %" in length.effect) in {(4, True), (5, True)}


@pytest.mark.slow
@pytest.mark.usefixtures("once")
def test_a_map_that_was_selected_is_no_evidence(monkeypatch: pytest.MonkeyPatch) -> None:
    world = online_world(1, risk=1.0, length=1.0)
    assert verdicts(CLAIMS["C30"].check(world).beside) == [Verdict.PROVED]
    monkeypatch.setattr(weight_claims, "NEAR", 0.0)
    finding = CLAIMS["C30"].check(world)
    assert finding.parts[0].verdict is Verdict.NOT_TESTABLE
    assert verdicts(finding.beside) == [Verdict.UNDECIDED]


@pytest.mark.parametrize(
    ("met", "found"),
    [
        (lambda _ahead, _k: 0.05, [Verdict.SUPPORTED] * 3),
        (lambda _ahead, _k: 0.7, [Verdict.CONTRADICTED] * 3),
        # a great K keeps away, a small one does not
        (lambda _ahead, k: 0.05 if k == 100.0 else 0.3, [Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.SUPPORTED]),
        # from two spreads on only
        (lambda ahead, _k: 0.7 if ahead < 2.0 else 0.05, [Verdict.CONTRADICTED, Verdict.SUPPORTED, Verdict.SUPPORTED]),
        # what is met of a threat one spread away is by definition
        (lambda ahead, _k: 0.7 if ahead < 1.5 else 0.05, [Verdict.SUPPORTED] * 3),
    ],
)
def test_sudden_threats_are_evaded_or_not(met: Callable[[float, float], float], found: list[Verdict]) -> None:
    finding = CLAIMS["C38"].check(evaded_world(met))
    assert verdicts(finding.parts) == [Verdict.REFUTED, *found, Verdict.PROVED]


def test_few_maps_do_not_show_that_threats_are_evaded() -> None:
    finding = CLAIMS["C38"].check(evaded_world(lambda _ahead, _k: 0.05, maps=9))
    assert verdicts(finding.parts[1:4]) == [Verdict.UNDECIDED] * 3
    assert "50 more maps" in finding.parts[1].result


def test_who_does_not_arrive_has_not_evaded() -> None:
    lost = evaded_world(lambda _ahead, _k: 0.05, arrived=False)
    finding = CLAIMS["C38"].check(lost)
    assert verdicts(finding.parts[1:4]) == [Verdict.CONTRADICTED] * 3
    assert verdicts(finding.beside) == [Verdict.CONTRADICTED]
    stuck = [{**record, "arrived": record["map"] > 0} for record in lost.samples["pop-up"].records]
    with pytest.raises(AssertionError, match="did not arrive"):
        CLAIMS["C38"].check(Evidence(samples={"pop-up": Samples(stuck)}))


def test_threats_come_up_as_far_ahead_as_they_should() -> None:
    at = (0.512, 0.416)
    threat = sudden_claims._straight_ahead(at, 2.0, 0.05)
    assert math.dist(at, (threat.x, threat.y)) == pytest.approx(0.1)
    # on the line from where the UAV was before
    assert math.dist(sudden_claims.POPUP_START, (threat.x, threat.y)) == pytest.approx(0.12)


# --- cells ----------------------------------------------------------------------------------------------------------


def test_few_tables_without_effect_show_one() -> None:
    def contrasts(seed: int) -> list[Contrast]:
        samples = Samples(flights(seed, ONLINE_K[:2], risk=1.0, length=1.0, maps=12))
        return [contrast(samples, "", "length", {"k": 10.0}, {"k": 50.0}, cell) for cell in CELLS]

    tables = [contrasts(seed) for seed in range(120)]
    shown = sum(judged(table) is not Verdict.UNDECIDED for table in tables)
    in_some_cell = sum(any(holds(one) for one in table) for table in tables)
    assert shown <= 10 < in_some_cell


@usual
@given(st.lists(st.floats(0.01, 100.0), min_size=6, max_size=30), st.floats(1.001, 100.0))
def test_contrast_is_the_ratio_where_all_maps_have_it(values: list[float], ratio: float) -> None:
    records = [
        {"map": i, "k": k, "risk": value * (ratio if k == 1 else 1.0)} for i, value in enumerate(values) for k in (1, 2)
    ]
    there = contrast(Samples(records), "", "risk", {"k": 1}, {"k": 2}, {})
    back = contrast(Samples(records), "", "risk", {"k": 2}, {"k": 1}, {})
    assert there.shift.shift.median == pytest.approx(ratio)
    assert holds(there)
    assert not holds(back)


def test_nothing_holds_of_nothing() -> None:
    assert judged([]) is Verdict.UNDECIDED
    empty = contrast(Samples([]), "", "risk", {"k": 1}, {"k": 2}, {})
    assert empty.shift.n == 0
    assert judged([empty]) is Verdict.UNDECIDED
    assert not holds(rate_contrast("", {}, np.array([np.nan]), np.array([1.0])))


def test_rates_differ_only_where_that_is_no_chance() -> None:
    few, many = np.arange(20) < 2, np.arange(20) < 5
    slightly = rate_contrast("", {}, many.astype(float), few.astype(float))
    clearly = rate_contrast("", {}, np.ones(20), few.astype(float))
    wrongly = rate_contrast("", {}, few.astype(float), np.ones(20))
    assert slightly.first > slightly.second
    assert (holds(slightly), holds(clearly), holds(wrongly)) == (False, True, False)


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


#: What names a case in some experiment.
_CASE = ("mode", "integral", "radius", "replan", "k", "ahead", "spread")


@cache
def measured(name: str) -> list[Record]:
    return list(catalogue.experiments()[name].sample(7))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["online-k", "offline-k", "pop-up"])
def test_samples_have_each_case_once(name: str) -> None:
    records = measured(name)
    cases = [tuple(record.get(entry) for entry in _CASE) for record in records]
    assert len(set(cases)) == len(cases)
    assert all(isinstance(value, str | int | float | bool | None) for record in records for value in record.values())


def test_samples_are_the_same_each_time(monkeypatch: pytest.MonkeyPatch) -> None:
    # (cells are flown one by one, whichever they are)
    monkeypatch.setattr(weight_claims, "CELLS", CELLS[:1])
    assert weight_claims.offline_k.sample(7) == measured("offline-k")
    flight = fly_alone(random_scenario(7).problem.field, k=ONLINE_K[0], **CELLS[0])
    assert measures(flight).items() <= weight_claims.online_k.sample(7)[0].items()


def test_real_samples_obey_the_theorems() -> None:
    known = Samples([{"map": seed, **record} for seed in range(3) for record in weight_claims.offline_k.sample(seed)])
    weight_claims.exchange_holds(known, OFFLINE_K)
    risks = np.column_stack([known.column("risk", k=k) for k in OFFLINE_K])
    assert (risks[:, 0] > risks[:, -1]).all()
