"""Claims about other planners: on worlds where the answer is known, and on a few real maps."""

import dataclasses
import math
from itertools import product
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Finding, Verdict, supported
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII, adjusted, all_hold
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import introduction_claims, learning_claims, planner_claims
from cgla_graph.comparisons.claims.paper.flights import RADIUS
from cgla_graph.comparisons.claims.paper.introduction_claims import EVOLUTION, NAMED, THREATS
from cgla_graph.comparisons.claims.paper.learning_claims import TRAINING
from cgla_graph.comparisons.claims.paper.planner_claims import COMPANY, PLANNERS
from cgla_graph.model.risk import RiskField
from cgla_graph.solvers import get

CLAIMS = catalogue.claims()
MAPS = 25


# --- worlds where the answer is known -------------------------------------------------------------------------------


def planner_records(
    seed: int, ratio: float, *, arrives: float = 1.0, exposure: float = 0.0, maps: int = MAPS
) -> list[Record]:
    """
    Make up flights: all other planners have so many times CGLA's risk, length and cost.

    `arrives` is the share of their flights that do, `exposure` what they fly near risk beyond CGLA.
    """
    rng = np.random.default_rng(seed)
    records: list[Record] = []

    def made(factor: float, near: float, *, there: bool) -> dict[str, Any]:
        numbers = {name: factor * rng.lognormal(0.0, 0.3) for name in ("risk_sum", "length", "cost")}
        numbers["exposure"] = max(0.0, near + rng.normal(0.0, 0.02))
        return {"arrived": there, **(numbers if there else dict.fromkeys(numbers))}

    for number in range(maps):
        case = {"map": number, "mode": "online"}
        records += [{**case, "planner": "cgla", **cell, **made(1.0, 0.03, there=True)} for cell in CELLS]
        there = bool(rng.random() < arrives)
        records += [
            {**case, "planner": name, "integral": "own", "radius": radius, **made(ratio, 0.03 + exposure, there=there)}
            for name, radius in product(("bcv-style", "a2d-style", "q-learning"), RADII)
        ]
    return records


def direction_records(seed: int, *, directions: float, objective: float, training: float) -> list[Record]:
    """Make up risk sums with given effects."""
    rng = np.random.default_rng(seed)
    records = []
    for number in range(MAPS):
        base = rng.lognormal(0.0, 1.0)
        for directed, k, method, factor in (
            ("any", 10.0, "exact", 1.0),
            ("eight", 10.0, "exact", directions),
            ("eight", 0.0, "exact", directions * objective),
            ("eight", 10.0, "learned", directions * training),
        ):
            sums = base * factor * rng.lognormal(0.0, 0.1)
            records.append({"map": number, "directions": directed, "k": k, "method": method, "risk_sum": sums})
    return records


def company_records(seed: int, ratio: float) -> list[Record]:
    rng = np.random.default_rng(seed)
    records: list[Record] = []
    for number, uav in product(range(MAPS), "123"):
        for name in COMPANY:
            cells = CELLS if name == "cgla" else [{"integral": "own", "radius": radius} for radius in RADII]
            factor = 1.0 if name == "cgla" else ratio
            for cell in cells:
                made = {entry: factor * rng.lognormal(0.0, 0.3) for entry in ("length", "risk_sum")}
                records.append({"map": number, "planner": name, **cell, "uav": uav, "arrived": True, **made})
    return records


def test_bcv_claim_needs_both_halves() -> None:
    for arrives, exposure in product((1.0, 0.6), (0.0, 0.1)):
        records = planner_records(1, 1.0, maps=60, arrives=arrives, exposure=exposure)
        finding = CLAIMS["C33"].check(Evidence(samples={"planners": Samples(records)}))
        halves = [supported(arrives < 1.0), supported(exposure > 0.0)]
        assert [part.verdict for part in finding.parts] == halves
        assert finding.verdict is supported(all(one is Verdict.SUPPORTED for one in halves))


@pytest.mark.parametrize(
    ("ratio", "effects", "expected"),
    [
        (2.0, {"directions": 3.0, "objective": 1.5, "training": 1.0}, Verdict.SUPPORTED),
        (2.0, {"directions": 1.5, "objective": 3.0, "training": 1.0}, Verdict.NOT_SUPPORTED),
        (2.0, {"directions": 1.5, "objective": 1.0, "training": 3.0}, Verdict.NOT_SUPPORTED),
        (2.0, {"directions": 1.0, "objective": 0.5, "training": 0.5}, Verdict.NOT_SUPPORTED),
        (1.0, {"directions": 3.0, "objective": 1.5, "training": 1.0}, Verdict.NOT_SUPPORTED),
        (0.5, {"directions": 3.0, "objective": 1.5, "training": 1.0}, Verdict.NOT_SUPPORTED),
    ],
)
def test_causes_are_told_apart(ratio: float, effects: dict[str, float], expected: Verdict) -> None:
    samples = {
        "planners": Samples(planner_records(1, ratio)),
        "directions": Samples(direction_records(1, **effects)),
    }
    assert CLAIMS["C34"].check(Evidence(samples=samples)).verdict is expected


@few
@given(st.floats(0.1, 10.0), st.floats(0.1, 10.0), st.floats(0.1, 10.0))
def test_factorial_finds_the_effects_that_were_put_in(directions: float, objective: float, training: float) -> None:
    records = direction_records(1, directions=directions, objective=objective, training=training)
    effects = planner_claims.factorial(Samples(records))
    expected = {"directions": directions, "objective": objective, "training": training}
    for name, values in effects.items():
        assert np.median(values) == pytest.approx(math.log(expected[name]), abs=0.15)


def test_factorial_leaves_out_maps_without_a_way() -> None:
    records = [dict(record) for record in direction_records(1, directions=2.0, objective=2.0, training=2.0)]
    records[3]["risk_sum"] = None
    assert {len(values) for values in planner_claims.factorial(Samples(records)).values()} == {MAPS - 1}


@pytest.mark.parametrize(
    ("ratio", "expected"), [(2.0, Verdict.SUPPORTED), (1.0, Verdict.NOT_SUPPORTED), (0.5, Verdict.NOT_SUPPORTED)]
)
def test_company_claim_tells_worlds_apart(ratio: float, expected: Verdict) -> None:
    finding = CLAIMS["C44"].check(Evidence(samples={"three-uavs": Samples(company_records(1, ratio))}))
    assert finding.verdict is expected
    assert len(finding.tables[0].rows) == 9


def test_company_claim_fails_with_one_uav() -> None:
    records = [dict(record) for record in company_records(1, 2.0)]
    for record in records:
        if (record["planner"], record["uav"]) == ("cpvs-style", "2"):
            record["length"] = 1e-3
    finding = CLAIMS["C44"].check(Evidence(samples={"three-uavs": Samples(records)}))
    assert finding.verdict is Verdict.NOT_SUPPORTED
    assert [part.verdict for part in finding.parts].count(Verdict.SUPPORTED) == 2


@pytest.mark.slow
def test_worlds_without_effect_show_none() -> None:
    shown = 0
    for seed in range(20):
        found = adjusted(planner_claims.company_contrasts(Samples(company_records(seed, 1.0))))
        shown += any(one.holds for one in found)
        assert not all_hold(found)
    assert shown <= 3


@pytest.mark.parametrize("ratio", [0.5, 1.0, 2.0])
def test_what_the_paper_does_not_show_stays_untestable(ratio: float) -> None:
    evidence = Evidence(samples={"planners": Samples(planner_records(1, ratio))})
    quoted, missing = (CLAIMS[name].check(evidence) for name in ("C32", "C52"))
    assert quoted.verdict is missing.verdict is Verdict.NOT_TESTABLE
    assert ("in 6 of 6 cells" in missing.result) is (ratio == 2.0)
    assert (quoted.parts[1].verdict is Verdict.SUPPORTED) is (ratio == 2.0)


@pytest.mark.parametrize(
    ("excess", "arrived", "expected"),
    [
        (0.0, 1.0, Verdict.SUPPORTED),
        (0.05, 1.0, Verdict.NOT_SUPPORTED),
        (0.0, 0.9, Verdict.NOT_SUPPORTED),
    ],
)
def test_training_claim_tells_worlds_apart(excess: float, arrived: float, expected: Verdict) -> None:
    rng = np.random.default_rng(1)
    records = []
    for number, share in product(range(200), TRAINING):
        there = bool(rng.random() < arrived)
        far = excess if share == TRAINING[-1] else 0.1
        records.append({"map": number, "share": share, "arrived": there, "excess": far if there else None})
    finding = CLAIMS["C53"].check(Evidence(samples={"training": Samples(records)}))
    assert finding.verdict is expected


# --- the introduction -----------------------------------------------------------------------------------------------


def introduction(case: dict[str, Any] | None = None, **instead: Any) -> Finding:  # noqa: ANN401 - of a record
    """
    Check C50 in a world in which everything is as the introduction says.

    In records of the case, some entries are others instead: functions of what there is.
    """
    rng = np.random.default_rng(1)
    records: list[dict[str, Any]] = []
    for number in range(200):
        for count, name in product(THREATS, NAMED):
            one = {"map": number, "threats": count, "planner": name}
            geometric = name in introduction_claims.GEOMETRIC
            excess = (0.01 * count if geometric else 0.005) * rng.lognormal(0.0, 0.2)
            records.append({**one, "mode": "offline", "arrived": True, "excess": excess, "seconds": 1.0})
            fails = (geometric and number % 2) or (name == "a2d-style" and count == THREATS[-1] and number % 3)
            records.append({**one, "mode": "online", "arrived": not fails})
        records += [
            {"map": number, "planner": name, "mode": "sudden", "arrived": name == "cgla" or number % 2 == 0}
            for name in ("cgla", "milp")
        ]
    for record in records:
        if case is not None and case.items() <= record.items():
            record.update({name: make(record) for name, make in instead.items()})
    ten = {"planner": EVOLUTION, "threats": 10, "mode": "offline"}
    alone = [record for record in records if ten.items() <= record.items()]
    return CLAIMS["C50"].check(Evidence(samples={"threat-count": Samples(records), "planners": Samples(alone)}))


def test_introduction_holds_where_it_does() -> None:
    finding = introduction()
    assert finding.verdict is Verdict.SUPPORTED
    assert {part.verdict for part in finding.parts} == {Verdict.SUPPORTED}


def always(_: dict[str, Any]) -> bool:
    return True


@pytest.mark.slow
@pytest.mark.parametrize(
    ("part", "case", "instead"),
    [
        (0, {"planner": "voronoi", "mode": "offline"}, {"excess": lambda one: 0.2 * one["excess"]}),
        (0, {"planner": "visibility-graph", "mode": "offline"}, {"excess": lambda _: 0.2}),
        (1, {"planner": "voronoi", "mode": "online"}, {"arrived": always}),
        (1, {"planner": "visibility-graph", "mode": "online"}, {"arrived": always}),
        (2, {"mode": "sudden"}, {"arrived": always}),
        (3, {"planner": "a2d-style", "mode": "online"}, {"arrived": always}),
        (4, {"planner": EVOLUTION, "mode": "offline"}, {"seconds": lambda one: 60.0 if one["map"] % 8 == 0 else 1.0}),
    ],
)
def test_each_remark_of_the_introduction_can_fail(part: int, case: dict[str, Any], instead: dict[str, Any]) -> None:
    finding = introduction(case, **instead)
    assert finding.verdict is Verdict.NOT_SUPPORTED
    failed = [number for number, one in enumerate(finding.parts) if one.verdict is Verdict.NOT_SUPPORTED]
    assert failed == [part]


# --- real maps ------------------------------------------------------------------------------------------------------


@pytest.mark.slow
def test_planners_are_measured_in_every_cell() -> None:
    records = planner_claims.planners.sample(7)
    samples = Samples([{"map": 7, **record} for record in records])
    assert {case["planner"] for case in samples.cases("planner")} == {"cgla", *PLANNERS, EVOLUTION}
    for planner in PLANNERS:
        assert [one.case for one in planner_claims.versus_cgla(samples, planner, "cost")] == list(CELLS)
        assert samples.column("arrived", mode="offline", planner=planner).shape == (1,)
    offline = {record["planner"]: record for record in records if record["mode"] == "offline"}
    # nobody in eight directions undercuts the complete graph of the same lattice
    assert offline["q-learning"]["cost"] >= offline["cgla"]["cost"] * (1.0 - 1e-12)
    online = [record for record in records if record["mode"] == "online"]
    assert all((record["length"] is not None) == record["arrived"] for record in online)
    findings = [CLAIMS[name].check(Evidence(samples={"planners": samples})) for name in ("C33", "C52")]
    assert [one.verdict for one in findings] == [Verdict.NOT_SUPPORTED, Verdict.NOT_TESTABLE]


def test_directions_and_training_obey_what_is_known() -> None:
    for seed in range(3):
        found = {(one["directions"], one["k"], one["method"]): one for one in planner_claims.directions.sample(seed)}
        assert found["any", 10.0, "exact"]["cost"] <= found["eight", 10.0, "exact"]["cost"] * (1.0 + 1e-12)
        assert found["eight", 10.0, "exact"]["cost"] <= found["eight", 10.0, "learned"]["cost"] * (1.0 + 1e-12)
        assert found["any", 0.0, "exact"]["length"] == pytest.approx(0.8 * math.sqrt(2.0))
        assert found["any", 10.0, "exact"]["risk"] <= found["any", 0.0, "exact"]["risk"]
        excess = [one["excess"] for one in learning_claims.training.sample(seed)]
        assert all(one is None or one >= -1e-12 for one in excess)


def test_three_uavs_fly_from_the_papers_starts_outside_of_threats() -> None:
    records = planner_claims.three_uavs.sample(5)
    assert len(records) == 3 * (len(CELLS) + 2 * len(RADII))
    cgla = [record for record in records if record["planner"] == "cgla"]
    assert all(record["arrived"] for record in cgla)
    least = dict(zip("123", (1.1314, 0.8746, 0.7040), strict=True))
    # who arrives within the radius of the goal has flown a little less
    assert all(record["length"] >= least[record["uav"]] - 0.03 for record in cgla)


def test_a_sudden_threat_appears_in_sight(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []
    real = introduction_claims.fly_alone

    def fly(*args: Any, **settings: Any) -> Any:  # noqa: ANN401 - as it comes
        flight = real(*args, **settings)
        seen.append((flight, settings["timed"][0]))
        return flight

    monkeypatch.setattr(introduction_claims, "fly_alone", fly)
    field = RiskField()
    found = introduction_claims._surprised(field, "cgla")
    ((flight, timed),) = seen
    position = flight.position_at(timed.appears)
    apart = math.dist(position, (timed.threat.x, timed.threat.y))
    assert apart < RADIUS
    assert apart > 2.0 * timed.threat.spread
    assert found["arrived"]
    assert found["length"] > 0.8 * math.sqrt(2.0)


def test_names_are_those_of_solvers() -> None:
    for name in {"cgla", *PLANNERS, *NAMED, *COMPANY}:
        assert dataclasses.is_dataclass(get(name))
