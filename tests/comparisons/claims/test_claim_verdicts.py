"""The checks that measure nothing on random maps: few instances of each bring the verdict of the full study."""

import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Claim, Kind, Verdict
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.summary import shipped_verdicts

SHIPPED = {claim["id"]: claim["verdict"] for claim in shipped_verdicts()["claims"]}
#: Those that take seconds, or a clock.
SLOW = {"C14", "C20", "C21", "C22", "C23", "C25", "C36", "C54"}
CLAIMS = [
    pytest.param(claim, id=claim.id, marks=[pytest.mark.slow] if claim.id in SLOW else [])
    for claim in catalogue.claims().values()
    # what hangs on a clock is judged by itself
    if not claim.experiments and claim.id != "C47"
]


@pytest.mark.parametrize("claim", CLAIMS)
def test_verdicts_are_those_of_the_full_study_and_the_same_each_time(claim: Claim) -> None:
    few = Evidence(Scale(maps=8))
    finding = claim.check(few)
    assert finding.verdict.label == SHIPPED[claim.id]
    assert not finding.counterexample or finding.counterexample in counterexamples.names()
    assert finding.verdict is not Verdict.REFUTED or finding.counterexample
    if claim.kind in {Kind.PROOF, Kind.PROPERTY} and claim.id not in SLOW:
        assert claim.check(few) == finding
