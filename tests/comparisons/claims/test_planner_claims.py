"""Claims about other planners: on worlds where the answer is known, and on a few real maps."""

import dataclasses
from itertools import product

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import planner_claims
from cgla_graph.comparisons.claims.paper.direction_claims import CGLA
from cgla_graph.comparisons.claims.paper.introduction_claims import EVOLUTION
from cgla_graph.comparisons.claims.paper.learners import LEARNERS
from cgla_graph.comparisons.claims.paper.planner_claims import COMPANY, PLANNERS, flown_by, flown_cells, solver_of

CLAIMS = catalogue.claims()
MAPS = 25


# --- worlds where the answer is known -------------------------------------------------------------------------------


def company_records(seed: int, *, length: float = 1.0, risk: float = 1.0, maps: int = MAPS) -> list[Record]:
    """Make up flights of three UAVs: what the others' length and risk are of CGLA's."""
    rng = np.random.default_rng(seed)
    records: list[Record] = []
    for number, uav in product(range(maps), "123"):
        for name, cell in flown_cells(COMPANY):
            ratios = {"length": length, "risk_sum": risk, "cost": length}
            made = {
                entry: (1.0 if name == "cgla" else ratio) * rng.lognormal(0.0, 0.3) for entry, ratio in ratios.items()
            }
            records.append({"map": number, **flown_by(name, cell), "uav": uav, "arrived": True, **made})
    return records


def learner_world(*, risk: float, cost: float = 1.5) -> Samples:
    """Make up single flights: what Q-Learning's risk and cost are of CGLA's, whatever its settings."""
    rng = np.random.default_rng(1)
    records: list[Record] = []
    for number in range(MAPS):
        cases = [{"planner": CGLA, **cell} for cell in CELLS]
        cases += [{"planner": name, "radius": radius} for name in LEARNERS for radius in RADII]
        for case in cases:
            ratios = (1.0, 1.0) if case["planner"] == CGLA else (risk, cost)
            made = dict(zip(("risk_sum", "cost"), (ratio * rng.lognormal(0.0, 0.2) for ratio in ratios), strict=True))
            records.append({"map": number, **case, "arrived": True, **made})
    return Samples(records)


def c44(records: list[Record]) -> Finding:
    return CLAIMS["C44"].check(Evidence(samples={"three-uavs": Samples(records)}))


@pytest.mark.parametrize(
    ("length", "risk", "expected"),
    [
        (2.0, 2.0, [Verdict.SUPPORTED] * 3),
        (1.0, 2.0, [Verdict.UNDECIDED, Verdict.UNDECIDED, Verdict.SUPPORTED]),
        (0.5, 2.0, [Verdict.CONTRADICTED, Verdict.CONTRADICTED, Verdict.SUPPORTED]),
        (1.0, 0.5, [Verdict.UNDECIDED, Verdict.UNDECIDED, Verdict.CONTRADICTED]),
    ],
)
def test_company_claim_tells_worlds_apart(length: float, risk: float, expected: list[Verdict]) -> None:
    finding = c44(company_records(1, length=length, risk=risk))
    assert [part.verdict for part in finding.parts] == expected
    assert len(finding.tables[0].rows) == 12
    # what is said is of CGLA: the inverse
    assert float(finding.parts[0].effect.split()[0]) == pytest.approx(1.0 / length, rel=0.3)
    assert [part.printed for part in finding.parts] == [
        "0.954, 0.643, 0.592",
        "0.989, 0.671, 0.628",
        "0.0593, 0.183, 0.0898",
    ]


def test_company_claim_of_few_maps_is_undecided() -> None:
    finding = c44(company_records(1, length=2.0, risk=2.0, maps=4))
    assert finding.verdicts == (Verdict.UNDECIDED,)
    assert "which 2 more maps could show" in finding.result


def test_company_claim_fails_with_one_uav() -> None:
    records = [dict(record) for record in company_records(1, length=2.0, risk=2.0)]
    for record in records:
        if (record["planner"], record["uav"]) == ("cpvs-style", "2"):
            record["length"] = 1e-3
    expected = [Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.SUPPORTED]
    assert [part.verdict for part in c44(records).parts] == expected


@pytest.mark.slow
def test_worlds_without_effect_show_none() -> None:
    contradicted = 0
    for seed in range(10):
        found = [part.verdict for part in c44(company_records(seed)).parts]
        assert Verdict.SUPPORTED not in found
        contradicted += Verdict.CONTRADICTED in found
    # that some cell shows the opposite is adjusted for their number
    assert contradicted <= 2


@pytest.mark.parametrize("risk", [0.5, 1.0, 2.0])
def test_what_the_paper_does_not_show_stays_untestable(risk: float) -> None:
    finding = CLAIMS["C52"].check(Evidence(samples={"q-learning-gamma": learner_world(risk=risk)}))
    assert finding.headline == "not testable"
    cost, risky = finding.beside
    assert cost.verdict is Verdict.SUPPORTED
    assert (risky.verdict is Verdict.SUPPORTED) is (risk == 2.0)
    assert (risky.verdict is Verdict.CONTRADICTED) is (risk == 0.5)


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
    assert all((record["F > 0.1"] is not None) == record["arrived"] for record in online)
    # one map shows nothing
    verdicts = CLAIMS["C32"].check(Evidence(samples={"planners": samples})).verdicts
    assert verdicts == (Verdict.UNDECIDED, Verdict.NOT_TESTABLE)


@pytest.mark.slow
def test_three_uavs_fly_from_the_papers_starts_outside_of_threats() -> None:
    records = planner_claims.three_uavs.sample(5)
    assert len(records) == 3 * (len(CELLS) + 2 * len(RADII))
    cgla = [record for record in records if record["planner"] == "cgla"]
    assert all(record["arrived"] for record in cgla)
    least = dict(zip("123", (1.1314, 0.8746, 0.7040), strict=True))
    # who arrives within the radius of the goal has flown a little less
    assert all(record["length"] >= least[record["uav"]] - 0.03 for record in cgla)


def test_names_are_those_of_solvers() -> None:
    for name in {"cgla", *PLANNERS, EVOLUTION, *COMPANY}:
        assert dataclasses.is_dataclass(solver_of(name))
