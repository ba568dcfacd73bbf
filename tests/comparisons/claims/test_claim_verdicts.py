"""Verdicts: few instances bring those of the full study, and stored missions that show nothing bring none."""

import dataclasses
import json
import re

import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.claim import Claim, Kind, Verdict, finding_document
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
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


@pytest.mark.parametrize("claim", CLAIMS)
def test_verdicts_are_those_of_the_full_study_and_the_same_each_time(claim: Claim) -> None:
    few = Evidence(Scale(maps=8))
    finding = claim.check(few)
    assert finding.headline == SHIPPED[claim.id]["headline"]
    assert not finding.counterexample or finding.counterexample in counterexamples.names()
    assert Verdict.REFUTED not in finding.verdicts or finding.counterexample
    named = re.findall(r"[\w-]+\.(?:json|toml)", json.dumps(finding_document(finding)))
    assert set(named) <= set(counterexamples.names())
    if claim.kind in {Kind.PROOF, Kind.PROPERTY} and claim.id not in SLOW:
        assert claim.check(few) == finding


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
    found = catalogue.claims()[claim]
    with pytest.raises(AssertionError, match=r"no longer|are the same"):
        found.check(Evidence(Scale(maps=2), dict.fromkeys(found.experiments, Samples([]))))
