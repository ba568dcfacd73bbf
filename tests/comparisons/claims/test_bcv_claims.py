"""Claims about BCV: on worlds where the answer is known, and on the shipped maps; and the figure of ours."""

from collections.abc import Mapping
from itertools import product
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from matplotlib.figure import Figure

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.artefact import Picture, artefacts
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.figures import bcv_figure
from cgla_graph.comparisons.claims.paper import bcv_claims, printed_claims
from cgla_graph.comparisons.claims.paper.bcv_claims import CLOSE, RIM, STUCK_ON, trapped_flights
from cgla_graph.comparisons.claims.paper.flights import RADIUS, K, fly_from
from cgla_graph.comparisons.claims.paper.planner_claims import (
    AVERSE,
    BCV,
    LENGTH_ONLY,
    NEAR,
    OWN,
    flown_by,
    lengths_near,
    near_name,
)
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get

CLAIMS = catalogue.claims()
MAPS = 40
SUPPORTED, CONTRADICTED, UNDECIDED = Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED


def world(
    seed: int = 1,
    *,
    maps: int = MAPS,
    risk: float = 1.0,
    length: float = 1.0,
    near: float = 0.0,
    arrives: float = 1.0,
    averse: dict[str, float] | None = None,
) -> Samples:
    """
    Make up flights: BCV's risk and length over CGLA's, how much farther it flies near risk, how often it arrives.

    Parameters
    ----------
    averse
        What is otherwise for BCV with a risk aversion.
    """
    random = np.random.default_rng(seed)
    usual = {"risk": risk, "length": length, "near": near, "arrives": arrives}
    ways = {LENGTH_ONLY: usual, AVERSE: usual | (averse or {})}
    records: list[Record] = []

    def flown(case: dict[str, Any], way: dict[str, float], *, there: bool) -> Record:
        numbers = {
            "risk_sum": way["risk"] * random.lognormal(0.0, 0.3),
            "length": way["length"] * random.lognormal(0.0, 0.02),
            **{near_name(level): 0.2 + way["near"] + random.normal(0.0, 0.02) for level in NEAR},
        }
        return {**case, "arrived": there, **(numbers if there else dict.fromkeys(numbers))}

    cgla = {"risk": 1.0, "length": 1.0, "near": 0.0}
    for number in range(maps):
        case = {"map": number, "mode": "online"}
        records += [flown({**case, **flown_by("cgla", cell)}, cgla, there=True) for cell in CELLS]
        for name, way in ways.items():
            there = bool(random.random() < way["arrives"])
            records += [
                flown({**case, "planner": name, "integral": OWN, "replan": OWN, "radius": radius}, way, there=there)
                for radius in RADII
            ]
    return Samples(records)


@pytest.fixture
def _trapped(monkeypatch: pytest.MonkeyPatch) -> None:
    """Pretend that the flights on the shipped maps ended as they do."""
    flights = {
        (name, planner, radius): SimpleNamespace(
            status=MissionStatus.ARRIVED if planner == "cgla" else MissionStatus.STUCK,
            ended=100,
            departed=0,
            length=2.0,
            risk_sum=1.0,
        )
        for name, planner, radius in product((bcv_claims.POCKET, STUCK_ON), ("cgla", *BCV), RADII)
    }
    monkeypatch.setattr(bcv_claims, "trapped_flights", lambda: flights)


def c33(samples: Samples, crowded: Samples | None = None) -> Finding:
    given = {"planners": samples, "crowded-maps": samples if crowded is None else crowded}
    return CLAIMS["C33"].check(Evidence(samples=given))


@pytest.mark.usefixtures("_trapped")
@pytest.mark.parametrize(
    ("found", "stuck", "close"),
    [
        (world(arrives=0.5, near=0.1), [SUPPORTED, SUPPORTED], [SUPPORTED, SUPPORTED]),
        (world(near=0.1, averse={"near": 0.0}), [UNDECIDED, UNDECIDED], [SUPPORTED, UNDECIDED]),
        (world(averse={"arrives": 0.5, "near": -0.1}), [UNDECIDED, SUPPORTED], [UNDECIDED, CONTRADICTED]),
        (world(maps=4, arrives=0.5, near=0.1), [UNDECIDED, UNDECIDED], [UNDECIDED, UNDECIDED]),
    ],
)
def test_minima_and_risk_are_told_apart_for_both_objectives(
    found: Samples, stuck: list[Verdict], close: list[Verdict]
) -> None:
    finding = c33(found)
    shown = [part.verdict for part in finding.parts]
    assert shown[0] is Verdict.PROVED
    assert (shown[1:3], shown[4:6]) == (stuck, close)
    # in a crowd, and at the rim, it has to be so for both
    for verdict, both in ((shown[3], stuck), (shown[6], close)):
        assert (verdict is SUPPORTED) == (both == [SUPPORTED, SUPPORTED])
        assert (verdict is CONTRADICTED) == (CONTRADICTED in both)
    assert [part.condition for part in finding.parts[4:6]] == list(BCV.values())


@pytest.mark.usefixtures("_trapped")
def test_a_crowd_is_another_sample() -> None:
    verdicts = [part.verdict for part in c33(world(), world(arrives=0.5)).parts]
    assert verdicts[:4] == [Verdict.PROVED, UNDECIDED, UNDECIDED, SUPPORTED]


@pytest.mark.usefixtures("_trapped")
@pytest.mark.parametrize(("planner", "status"), [("cgla", MissionStatus.STUCK), (AVERSE, MissionStatus.ARRIVED)])
def test_who_gets_through_is_no_evidence_of_minima(planner: str, status: MissionStatus) -> None:
    bcv_claims.trapped_flights()[STUCK_ON, planner, RADII[1]].status = status  # type: ignore[misc]
    with pytest.raises(AssertionError, match=STUCK_ON):
        c33(world())


@pytest.mark.slow
def test_bcv_gets_stuck_on_the_shipped_maps_with_more_patience_as_well() -> None:
    ended = {key: flight.status for key, flight in trapped_flights().items()}
    assert {status for (_, planner, _), status in ended.items() if planner == "cgla"} == {MissionStatus.ARRIVED}
    assert {ended[STUCK_ON, name, radius] for name in BCV for radius in RADII} == {MissionStatus.STUCK}
    problem = load_scenario(STUCK_ON).problem
    patient = get("bcv-style", patience=2000, max_steps=6000)
    starts = {"a": problem.start}
    flight = fly_from(starts, problem.field, k=K, solver=patient, goal=problem.goal, max_ticks=6000).uavs["a"]
    assert flight.status is MissionStatus.STUCK
    assert flight.ended > 2000


def c32(samples: Samples) -> list[Verdict]:
    finding = CLAIMS["C32"].check(Evidence(samples={"planners": samples}))
    first, *rest = (part.verdict for part in finding.parts)
    assert first is Verdict.NOT_TESTABLE
    return rest


@pytest.mark.parametrize(
    ("found", "shorter", "similar", "less"),
    [
        (world(risk=4.0, length=1.05), [SUPPORTED] * 2, SUPPORTED, [SUPPORTED] * 2),
        (world(risk=4.0, length=0.95, averse={"risk": 1.0}), [CONTRADICTED] * 2, SUPPORTED, [SUPPORTED, UNDECIDED]),
        (world(risk=0.5, length=1.3), [SUPPORTED] * 2, CONTRADICTED, [CONTRADICTED] * 2),
        (world(length=1.1, averse={"length": 1.0}), [SUPPORTED, UNDECIDED], UNDECIDED, [UNDECIDED] * 2),
        (world(maps=4, risk=4.0, length=1.05), [UNDECIDED] * 2, UNDECIDED, [UNDECIDED] * 2),
    ],
)
def test_length_and_risk_against_bcv_are_told_apart(
    found: Samples, shorter: list[Verdict], similar: Verdict, less: list[Verdict]
) -> None:
    verdicts = c32(found)
    assert (verdicts[:2], verdicts[2], verdicts[3:]) == (shorter, similar, less)


def test_sizes_are_cglas_over_bcvs() -> None:
    parts = CLAIMS["C32"].check(Evidence(samples={"planners": world(maps=100, risk=4.0, length=0.95)})).parts
    length, _, _, risk, _ = parts[1:]
    assert float(length.effect.split()[0]) == pytest.approx(1.05, abs=0.02)
    assert float(risk.effect.split()[0]) == pytest.approx(0.25, abs=0.04)
    assert (length.printed.partition(",")[0], risk.printed.partition(",")[0]) == ("0.949", "0.239")


def test_similar_is_within_the_margin_either_way() -> None:
    cell = CELLS[0]
    for length, direction in ((1.0, 1), (1.05, 1), (0.95, 1), (1.3, -1), (0.7, -1)):
        found = printed_claims.similarity(world(length=length), AVERSE, cell)
        assert (found.direction, found.p < 0.05) == (direction, True)
    # just at the margin, nothing is shown
    assert printed_claims.similarity(world(length=1.0 / 1.1), AVERSE, cell).p > 0.01


def test_lengths_near_risk_are_those_of_circles() -> None:
    field = RiskField([Threat(0.5, 0.5, 0.05)])
    flight = fly_from({"a": (0.1, 0.5)}, field, k=0.0, goal=(0.9, 0.5)).uavs["a"]
    for level, length in zip(NEAR, lengths_near(field, flight).values(), strict=True):
        assert length == pytest.approx(2.0 * 0.05 * np.sqrt(-2.0 * np.log(level)), abs=0.002)
    assert lengths_near(field, flight)[near_name(CLOSE)] == pytest.approx(flight.exposure, abs=0.002)
    assert RIM < CLOSE


@pytest.mark.slow
def test_crowded_maps_are_flown_in_every_cell() -> None:
    samples = Samples([{"map": 5, **record} for record in bcv_claims.crowded_maps.sample(5)])
    for name in BCV:
        found = bcv_claims.stuck_more_often(samples, name)
        assert [(one.case, one.n) for one in found] == [(cell, 1) for cell in CELLS]


@pytest.fixture(scope="module")
def shown() -> Mapping[tuple[str, str, float], UavFlight]:
    """Fly on the shipped maps with the one detection radius that the figure shows."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(bcv_claims, "RADII", (RADIUS,))
        return trapped_flights.__wrapped__()


@pytest.mark.slow
@pytest.mark.parametrize("maps", [3, 30])
def test_the_figure_has_both_objectives_and_the_printed_ratios(
    maps: int, shown: Mapping[tuple[str, str, float], UavFlight], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(bcv_figure, "trapped_flights", lambda: shown)
    figures: list[Figure] = []

    def kept(figure: Figure, caption: str) -> Picture:
        figures.append(figure)
        return Picture(caption, b"", b"")

    monkeypatch.setattr(bcv_figure, "picture", kept)
    (ours,) = (one for one in artefacts() if one.label == "Fig. A2")
    made = ours.made_from(Evidence(samples={"planners": world(maps=maps, risk=4.0)}))
    assert isinstance(made, Picture)
    assert "not the original" in made.caption
    labels = [axes.get_xlabel() for axes in figures[0].axes]
    assert [label for label in labels if "BCV" in label] == [
        f"{what} of BCV-style / CGLA" for what in ("length", "risk sum")
    ]
