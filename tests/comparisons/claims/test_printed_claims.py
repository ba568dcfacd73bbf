"""What the paper's Table 1 prints: arithmetic, and the worlds in which our own flights agree or do not."""

import dataclasses
from collections.abc import Callable

import numpy as np
import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS, RADII
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import printed_values
from cgla_graph.comparisons.claims.paper.direction_claims import CGLA
from cgla_graph.comparisons.claims.paper.learners import LARGE, LEARNERS
from cgla_graph.comparisons.claims.paper.printed_claims import SETTINGS
from cgla_graph.comparisons.claims.paper.printed_values import TABLE_1, rows_with_length, value

CLAIMS = catalogue.claims()
SUPPORTED, CONTRADICTED, UNDECIDED = Verdict.SUPPORTED, Verdict.CONTRADICTED, Verdict.UNDECIDED
#: What Q-Learning's length and risk are of CGLA's, by its reward at the target.
Ratios = Callable[[float], tuple[float, float]]


def test_arithmetic_of_printed_lengths() -> None:
    finding = CLAIMS["C31"].check(Evidence())
    assert finding.headline == "not testable"
    assert [part.ruling.partition(": ")[2] for part in finding.beside] == [
        "refuted",
        "proved if a side of the map is at most 164.4 units",
    ]
    scales = [row.greatest_scale for row in rows_with_length()]
    assert scales == sorted(scales)
    assert len(scales) == 19
    assert sum(scale < 200.0 for scale in scales) == 6
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


def c35(ratios: Ratios, maps: int = 30) -> Finding:
    """Check C35 on flights that are made up."""
    random = np.random.default_rng(1)
    records: list[Record] = []
    for number in range(maps):
        cases = [(1.0, 1.0, {"planner": CGLA, **cell}) for cell in CELLS]
        for name, (_, reward) in LEARNERS.items():
            cases += [(*ratios(reward), {"planner": name, "radius": radius}) for radius in RADII]
        for length, risk, case in cases:
            made = (length * random.lognormal(0.0, 0.02), risk * random.lognormal(0.0, 0.2), random.lognormal(0.0, 0.1))
            named = dict(zip(("length", "risk_sum", "cost"), made, strict=True))
            records.append({"map": number, **case, "arrived": True, **named})
    return CLAIMS["C35"].check(Evidence(samples={"q-learning-gamma": Samples(records)}))


@pytest.mark.parametrize(
    ("ratios", "maps", "length", "risk"),
    [
        (lambda _: (1.1, 4.0), 30, [SUPPORTED] * 3, [SUPPORTED] * 3),
        (lambda _: (0.9, 0.25), 30, [CONTRADICTED] * 3, [CONTRADICTED] * 3),
        (lambda _: (1.0, 1.0), 30, [UNDECIDED] * 3, [UNDECIDED] * 3),
        (lambda _: (1.1, 4.0), 5, [UNDECIDED] * 3, [UNDECIDED] * 3),
        # blind to risk with a large reward
        (
            lambda reward: (0.9, 9.0) if reward == LARGE else (1.1, 1.0),
            30,
            [SUPPORTED, SUPPORTED, CONTRADICTED],
            [UNDECIDED, UNDECIDED, SUPPORTED],
        ),
    ],
)
def test_superior_is_length_and_risk_for_each_setting(
    ratios: Ratios, maps: int, length: list[Verdict], risk: list[Verdict]
) -> None:
    finding = c35(ratios, maps)
    verdicts = [part.verdict for part in finding.parts]
    assert verdicts == [Verdict.REFUTED, *length, Verdict.NOT_TESTABLE, *risk]
    assert [part.condition for part in finding.parts[1:4]] == [f"on average {setting}" for setting in SETTINGS]
    assert (finding.parts[0].printed, finding.parts[4].printed.partition(",")[0]) == ("1.19", "0.0875")


def test_all_settings_are_spoken_of() -> None:
    assert sorted(name for names in SETTINGS.values() for name in names) == sorted(LEARNERS)


def test_a_map_on_which_cgla_is_shorter_is_no_counterexample(monkeypatch: pytest.MonkeyPatch) -> None:
    found = counterexamples.mission("longer-than-q-learning.toml")
    empty = dataclasses.replace(found, world=dataclasses.replace(found.world, field=type(found.world.field)()))
    monkeypatch.setattr(counterexamples, "mission", lambda _: empty)
    with pytest.raises(AssertionError, match="no longer"):
        c35(lambda _: (1.1, 4.0))
