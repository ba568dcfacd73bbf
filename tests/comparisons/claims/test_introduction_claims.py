"""C50, remarks of the introduction: on worlds where the answer is known, and on real flights."""

import math
from collections.abc import Callable
from itertools import product
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.paper import introduction_claims as claims
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.risk import RiskField

REPLANS = (claims.AGAIN, claims.OLD)
CLAIM = catalogue.claims()["C50"]
SIMPLE, COMPLEX, PARTIAL, SUDDEN, A2D, QUICK = "on simple", "on complex maps", "partial", "MILP", "A2D", "quick"


def flights(number: int, cost: Callable[[float], float]) -> list[dict[str, Any]]:
    """Make up what happens on a map if all is as the introduction says; `cost` adds chance to a number."""
    records: list[dict[str, Any]] = []
    for count in claims.THREATS:
        one = {"map": number, "threats": count, "arrived": True}
        for name in claims.PLANNED:
            excess = cost(0.015 * count if name in claims.GEOMETRIC else 0.005)
            plan = {"cost": cost(1.0 + excess), "excess": excess, "seconds": 1.0}
            records.append({**one, "planner": name, "mode": "offline", **plan})
        lost = [(name, replan, 1.0 if name == "cgla" else 1.6) for name in claims.FLOWN for replan in REPLANS]
        lost += [(name, claims.AGAIN, 1.0 + 0.03 * count) for name in claims.A2D]
        for name, replan, factor in lost:
            records.append({**one, "planner": name, "mode": "online", "replan": replan, "cost": cost(factor)})
    for (name, replan), factor in zip(product(("cgla", "milp"), REPLANS), (1.0, 2.5, 1.3, 2.0), strict=True):
        flown = {"replan": replan, "arrived": True, "risk_sum": 1.0, "length": 1.2, "cost": cost(factor)}
        records.append({"map": number, "planner": name, "mode": "sudden", **flown})
    return records


def world(*changes: tuple[dict[str, Any], dict[str, Callable[[Any], Any]]], maps: int = 80) -> Finding:
    """
    Check C50 in a world in which everything is as the introduction says.

    In records of a change's case, some entries are others instead: functions of what there is.
    """
    rng = np.random.default_rng(1)
    records = [
        record
        for number in range(maps)
        for record in flights(number, lambda factor: factor * float(rng.lognormal(0.0, 0.05)))
    ]
    for (case, instead), record in product(changes, records):
        if case.items() <= record.items():
            record.update({name: make(record) for name, make in instead.items()})
    return CLAIM.check(Evidence(samples={"threat-count": Samples(records)}))


def by_part(finding: Finding) -> dict[str, list[Verdict]]:
    """Return the verdicts of each remark's levels."""
    found: dict[str, list[Verdict]] = {}
    for part in finding.parts:
        name = next(name for name in (SIMPLE, PARTIAL, SUDDEN, QUICK, A2D, COMPLEX) if name in part.statement)
        found.setdefault(name, []).append(part.verdict)
    return found


def test_introduction_holds_where_it_does() -> None:
    finding = world()
    assert finding.verdicts == (Verdict.SUPPORTED,)
    assert {part.condition for part in finding.parts if PARTIAL in part.statement} == {
        "on the first plan, for all of them",
        "planning again, for all of them",
    }


def test_few_maps_decide_nothing() -> None:
    finding = world(maps=5)
    assert finding.verdicts == (Verdict.UNDECIDED,)


def times(entry: str, factor: float) -> dict[str, Callable[[Any], Any]]:
    return {entry: lambda record: factor * record[entry]}


@pytest.mark.parametrize(
    ("remark", "case", "instead"),
    [
        (SIMPLE, {"planner": "voronoi", "mode": "offline", "threats": claims.FEW}, times("excess", 20.0)),
        (COMPLEX, {"planner": "visibility-graph 2", "mode": "offline", "threats": claims.MANY}, times("excess", 0.1)),
        (PARTIAL, {"planner": "voronoi", "mode": "online", "replan": claims.AGAIN}, times("cost", 0.6)),
        (PARTIAL, {"planner": "voronoi", "mode": "online", "replan": claims.OLD}, times("cost", 0.6)),
        (SUDDEN, {"planner": "milp", "mode": "sudden", "replan": claims.AGAIN}, times("cost", 0.75)),
        (SUDDEN, {"planner": "milp", "mode": "sudden", "replan": claims.OLD}, times("cost", 0.65)),
        (A2D, {"planner": next(iter(claims.A2D)), "mode": "online", "threats": claims.MANY}, times("cost", 0.6)),
        (
            QUICK,
            {"planner": claims.EVOLUTION, "mode": "offline"},
            {"seconds": lambda one: 60.0 if one["map"] % 4 == 0 else 1.0},
        ),
    ],
)
def test_each_remark_can_be_contradicted(
    remark: str, case: dict[str, Any], instead: dict[str, Callable[[Any], Any]]
) -> None:
    found = by_part(world((case, instead)))
    assert Verdict.CONTRADICTED in found.pop(remark)
    assert {verdict for verdicts in found.values() for verdict in verdicts} == {Verdict.SUPPORTED}


def test_flights_within_the_margin_are_no_failure() -> None:
    near = {"cost": lambda _: 1.05}
    found = by_part(world(*(({"planner": name, "mode": "sudden"}, near) for name in ("milp", "cgla"))))
    assert found[SUDDEN] == [Verdict.CONTRADICTED]


def test_sizes_are_ratios_without_the_margin() -> None:
    (part,) = (part for part in world().parts if SUDDEN in part.statement)
    low, high = (float(text) for text in part.effect.split(",")[0].split(" to "))
    assert low == pytest.approx(1.3, abs=0.05)
    assert high == pytest.approx(2.0 / 1.3, abs=0.05)


def test_a_sudden_threat_comes_up_on_the_way(monkeypatch: pytest.MonkeyPatch) -> None:
    seen: list[Any] = []
    real = claims.fly_alone

    def fly(*args: Any, **settings: Any) -> Any:  # noqa: ANN401 - as it comes
        flight = real(*args, **settings)
        seen.append((flight, settings.get("timed", [])))
        return flight

    monkeypatch.setattr(claims, "fly_alone", fly)
    found = {(one["planner"], one["replan"]): one for one in claims._surprised(RiskField())}
    calm, *surprised = (flight for flight, _ in seen)
    timed: TimedThreat = seen[1][1][0]
    position = calm.position_at(timed.appears)
    apart = math.dist(position, (timed.threat.x, timed.threat.y))
    assert timed.threat.spread < apart < 0.2
    assert all(flight.position_at(timed.appears) is not None for flight in surprised)
    assert all(one["arrived"] for one in found.values())
    for name in ("milp", "cgla"):
        assert found[name, claims.AGAIN]["risk"] < 0.5 * found[name, claims.OLD]["risk"]


@pytest.mark.slow
def test_real_flights_have_each_case_once() -> None:
    samples = Samples([{"map": 3, **record} for record in claims.threat_count.sample(3)])
    finding = CLAIM.check(Evidence(samples={"threat-count": samples}))
    assert finding.verdicts == (Verdict.UNDECIDED,)
    for name, count in (("voronoi", 20), ("cgla", 2)):
        excess = samples.column("excess", planner=name, mode="offline", threats=count)
        assert excess[0] > -0.01
