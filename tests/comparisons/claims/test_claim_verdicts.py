"""Verdicts: few instances bring those of the full study, and stored missions that show nothing bring none."""

import dataclasses
import json
import re
from functools import cache

import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Claim, Finding, Kind, Verdict, finding_document
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.paper import matrix_claims
from cgla_graph.comparisons.claims.summary import shipped_verdicts

SHIPPED = {claim["id"]: claim for claim in shipped_verdicts()["claims"]}
#: Those that take seconds, or a clock.
SLOW = {"C14", "C20", "C21", "C22", "C23", "C25", "C36"}
CLAIMS = [
    pytest.param(claim, id=claim.id, marks=[pytest.mark.slow] if claim.id in SLOW else [])
    for claim in catalogue.claims().values()
    # what hangs on a clock, or on a sample of its own that 8 maps are too few for, is judged by itself
    if not claim.experiments and claim.id not in {"C21", "C23", "C25", "C47"}
]


FEW = Evidence(Scale(maps=8))


@cache
def found(claim: str) -> Finding:
    """Return what few instances say of a claim."""
    return catalogue.claims()[claim].check(FEW)


@pytest.mark.slow
@pytest.mark.parametrize("claim", CLAIMS)
def test_verdicts_are_those_of_the_full_study_and_the_same_each_time(claim: Claim) -> None:
    finding = found(claim.id)
    assert finding.headline == SHIPPED[claim.id]["headline"]
    assert not finding.counterexample or finding.counterexample in counterexamples.names()
    assert Verdict.REFUTED not in finding.verdicts or finding.counterexample
    named = re.findall(r"[\w-]+\.(?:json|toml)", json.dumps(finding_document(finding)))
    assert set(named) <= set(counterexamples.names())
    if claim.kind in {Kind.PROOF, Kind.PROPERTY} and claim.id not in SLOW:
        assert claim.check(FEW) == finding


POSITIVE = "p_s can reach p_t and no weight is below 0"


@pytest.mark.parametrize(
    ("claim", "headline"),
    [
        ("C8", "proved for any p_r and any weights"),
        ("C9", "proved if no weight is below 0"),
        ("C10", "proved if p_t serves first, as it does out of Delta_0"),
        (
            "C11",
            (
                "converges, settled values stay: proved if p_r is from Delta_k; "
                "converges: proved with probability 1, if p_r is random; "
                "converges: refuted for any p_r, as Step 2 begins; the printed proof: refuted as printed"
            ),
        ),
        ("C12", f"proved if {POSITIVE}"),
        (
            "C13",
            (
                "not below 0: proved for G to converge; not 0 either: refuted for G to converge; "
                "not 0 either: proved for paths to be read off G alone"
            ),
        ),
        (
            "C15",
            (
                "proved if weights are positive, and A symmetric or read in Eq. 9's direction; "
                "refuted if A is not symmetric, and read against Eq. 9's direction"
            ),
        ),
        ("C16", "refuted"),
        pytest.param(
            "C24",
            (
                "cannot be used directly: refuted with limited information, planning again as CGLA does; "
                "exhaustive: refuted as trying all paths; "
                "exhaustive: proved as weighing all pairs, which CGLA does as well"
            ),
            marks=pytest.mark.slow,
        ),
    ],
)
def test_what_holds_under_a_condition_is_said_with_it(claim: str, headline: str) -> None:
    assert "; ".join(found(claim).rulings) == headline


def test_the_gaps_of_the_printed_proof_are_in_the_report() -> None:
    finding = found("C11")
    assert finding.tables[0].title.startswith("the printed proof")
    assert len(finding.tables[0].rows) == 4
    assert matrix_claims.PROOF in finding.notes[0]


@pytest.mark.parametrize(
    ("claim", "name"),
    [
        ("C17", "c19-livelock.toml"),
        ("C18", "c18-exclusion.toml"),
        ("C19", "c19-livelock.toml"),
        ("C28", "risk-rises-with-k.toml"),
        ("C35", "longer-than-q-learning.toml"),
        ("C41", "c41-obstacles-collide.toml"),
        ("C42", "c42-sharing-hurts.toml"),
    ],
)
def test_without_its_counterexample_a_claim_has_no_verdict(
    claim: str, name: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Variants that are all as the first one differ in nothing."""
    file = counterexamples.mission(name)
    alike = dataclasses.replace(file, variants=dict.fromkeys(file.variants, next(iter(file.variants.values()))))
    monkeypatch.setattr(counterexamples, "mission", lambda _: alike)
    checked = catalogue.claims()[claim]
    with pytest.raises(AssertionError, match=r"no longer|are the same"):
        checked.check(Evidence(Scale(maps=2), dict.fromkeys(checked.experiments, Samples([]))))
