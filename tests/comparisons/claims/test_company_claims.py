"""C44: flights of three UAVs, and their statements."""

import math
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Answer, Finding
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel import company as panel
from cgla_graph.comparisons.claims.panel.flights import setup_name
from cgla_graph.comparisons.claims.panel.settings import BASE_KINDS, STARTS, PanelMap, seeds_of
from cgla_graph.comparisons.claims.paper import sharing_claims
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.solvers import get

#: A map on which sub-goals of CPVS-style depend on K.
BASE = PanelMap(seeds_of(BASE_KINDS[1], 77, 1)[0])


@pytest.fixture(scope="module")
def samples() -> Samples:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(panel, "FACTORS", {"radius": (0.1,), "k": (10.0, 200.0)})
        patch.setattr(panel, "RULES", {"start": "snapped"})
        patch.setattr(panel, "CONSTANTS", panel.CONSTANTS[2:3] + panel.CONSTANTS[-1:])
        return Samples(panel.company.sample(BASE))


def test_each_case_is_there_once_with_both_sides_of_varied_ones(samples: Samples) -> None:
    names = ("planner", "k", "varied", "uav")
    assert len(samples.records) == len(samples.cases(*names))
    varied = {record["varied"] for record in samples.records} - {""}
    assert varied == {"start snapped", "fbcri-style, tolerance 0.001", "cpvs-style, onward False"}
    for setting in varied:
        assert len({record["planner"] for record in samples.where(varied=setting)}) >= 2


@pytest.mark.parametrize(
    ("planner", "settings", "rules", "varied"),
    [
        ("cgla", {}, {}, ""),
        ("cgla", {}, {"start": "snapped"}, "start snapped"),
        ("fbcri-style", {"tolerance": 0.001}, {}, "fbcri-style, tolerance 0.001"),
        ("cpvs-style", {}, {}, ""),
        ("cpvs-style", {"onward": False}, {}, "cpvs-style, onward False"),
    ],
)
def test_records_are_those_of_a_mission_made_by_hand(
    samples: Samples, planner: str, settings: dict[str, Any], rules: dict[str, Any], varied: str
) -> None:
    near = [one for one in BASE.field.threats if min(math.dist((one.x, one.y), start) for start in STARTS) < 0.12]
    field = panel.without_those_at_starts(BASE.field)
    assert {*field.threats} == {*BASE.field.threats} - {*near}
    uavs = [Uav(f"UAV {i + 1}", STARTS[i], (0.9, 0.9), 0.1, step=0.02, k=200.0) for i in range(3)]
    lattice = Lattice(20, bounds=(0.0, 0.0, 1.0, 1.0), kind="upper")
    flight = Mission(
        World(field, bounds=(0.0, 0.0, 1.0, 1.0)),
        uavs,
        get(planner, **settings),
        resolution=lattice,
        arrival_radius=0.025,
        collisions="record",
        **rules,
    ).fly()
    for name, one in flight.uavs.items():
        path = np.asarray(one.path)
        (record,) = samples.where(planner=planner, k=200.0, varied=varied, uav=name)
        ends = np.linspace(path[:-1], path[1:], 41)
        steps = np.hypot(*np.diff(path, axis=0).T)
        risk = float((field.density(0.5 * (ends[:-1] + ends[1:])).mean(axis=0) * steps).sum())
        assert record["length"] == pytest.approx(steps.sum())
        assert record["risk"] == pytest.approx(risk, rel=1e-3, abs=1e-9)
        assert record["cost"] == pytest.approx(record["length"] + 200.0 * record["risk"])


def made_up(cgla: float, maps: int = 20) -> Finding:
    """Check C44 where CGLA's numbers are so many times those of the others."""
    rng = np.random.default_rng(1)
    records: list[dict[str, Any]] = []
    for number in range(maps):
        for uav in panel.UAVS:
            for planner in map(setup_name, panel.COMPANY):
                factor = (cgla if planner == "cgla" else 1.0) * float(rng.uniform(0.99, 1.01))
                case = {"map": number, "uav": uav, "planner": planner, "varied": ""}
                records.append({**case, "length": factor, "risk": factor, "cost": factor})
    return catalogue.claims()["C44"].check(Evidence(samples={"company": Samples(records)}))


@pytest.mark.parametrize(("cgla", "answer"), [(0.8, Answer.HOLDS), (1.2, Answer.FAILS)])
def test_statements_are_about_cgla(cgla: float, answer: Answer) -> None:
    finding = made_up(cgla)
    assert finding.answers == (answer,)
    assert len(finding.rows) == 5
    assert made_up(cgla, maps=4).answers == (Answer.OPEN,)


def test_printed_ratios_are_the_paper_s() -> None:
    printed = {one.text: one.printed for one in sharing_claims.STATEMENTS}
    assert printed["shorter than CPVS-style"] == "0.989, 0.671, 0.628"
    assert printed["less risk than FBCRI-style"] == "0.0593, 0.183, 0.0898"
    assert printed["less cost than CPVS-style"] == ""
