"""The verdicts that are shipped are those of a full study, and the manual shows them."""

import json
from pathlib import Path
from typing import Any

import pytest

from cgla_graph.comparisons.claims import catalogue, summary
from cgla_graph.comparisons.claims.claim import Verdict
from cgla_graph.errors import ClaimError

PAGE = Path(__file__).resolve().parents[3] / "docs" / "claims.md"


PART = {"condition": "", "effect": "", "printed": "", "result": "r", "levels": []}


def _document(**changes: object) -> dict[str, Any]:
    claims = [
        {
            "id": f"C{n}",
            "place": "p",
            "kind": "proof",
            "sentence": "a | b",
            "verdict": "proved, refuted",
            "headline": "risk: proved if F >= 0; length: refuted",
            "result": "r",
            "more": 1,
            "parts": [
                {**PART, "statement": "risk", "verdict": "proved", "condition": "if F >= 0"},
                {**PART, "statement": "length", "verdict": "refuted", "effect": "2", "printed": "3"},
            ],
        }
        for n in range(1, 55)
    ]
    return {"maps": 200, "seed": 1, "quick": False, "claims": claims, **changes}


def test_the_manual_shows_the_verdicts_that_are_shipped() -> None:
    text = PAGE.read_text(encoding="utf-8")
    assert summary.with_table(text, summary.shipped_verdicts()) == text


def test_the_verdicts_that_are_shipped_are_those_of_the_claims_of_today() -> None:
    shipped = summary.shipped_verdicts()["claims"]
    assert [(one["id"], one["place"], one["kind"], one["sentence"]) for one in shipped] == [
        (claim.id, claim.place, claim.kind.label, claim.sentence) for claim in catalogue.claims().values()
    ]
    known = {verdict.label for verdict in Verdict} - {Verdict.MISSING.label}
    assert {part["verdict"] for one in shipped for part in one["parts"]} <= known
    assert len(summary.shipped_verdicts()["quick_seeds"]) >= 3


def test_a_sample_of_a_study_is_not_shipped() -> None:
    assert len(summary.shortened(_document())["claims"]) == 54
    lost = [{**claim, "parts": [{**PART, "statement": "", "verdict": "missing"}]} for claim in _document()["claims"]]
    for wrong in (_document(quick=True), _document(maps=199), _document(claims=[]), _document(claims=lost)):
        with pytest.raises(ClaimError, match="no full study"):
            summary.shortened(wrong)


def test_the_table_takes_the_place_of_the_last_one(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    document = summary.shortened(_document())
    assert "more" not in document["claims"][0]
    page = f"above\n{summary.BEGIN}\nold\n{summary.END}\nbelow\n"
    once = summary.with_table(page, document)
    assert summary.with_table(once, document) == once
    assert "old" not in once
    assert "| C54 | a \\| b | risk: proved if F >= 0; length: refuted | length: 2 (paper: 3) |" in once
    assert (once.startswith("above\n"), once.endswith("\nbelow\n")) == (True, True)
    with pytest.raises(ClaimError, match="once each"):
        summary.with_table("no marks", document)
    monkeypatch.setattr(summary, "__file__", str(tmp_path / "summary.py"))
    (tmp_path / "claims.json").write_text(json.dumps(_document()))
    (tmp_path / "claims.md").write_text(page)
    (tmp_path / "quick.json").write_text(json.dumps(_document(quick=True, seed=7)))
    summary.main(tmp_path / "claims.json", tmp_path / "claims.md", tmp_path / "quick.json")
    assert (tmp_path / "claims.md").read_text() == once
    assert json.loads((tmp_path / summary.FILE).read_text()) == {**document, "quick_seeds": [7]}


def test_nothing_is_shipped_that_a_quick_check_contradicts(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(summary, "__file__", str(tmp_path / "summary.py"))
    (tmp_path / "claims.json").write_text(json.dumps(_document()))
    (tmp_path / "claims.md").write_text(f"{summary.BEGIN}\n{summary.END}\n")
    other = [{**claim, "parts": [dict(part) for part in claim["parts"]]} for claim in _document()["claims"]]
    other[3]["parts"][0]["verdict"] = "undecided"
    assert not summary.contradictions(_document(), _document(claims=other))
    # levels of a factor are grouped by verdict, so the groups may differ
    grouped = [{"statement": "a", "levels": ["x", "y"], "verdict": "supported"}]
    parted = [
        {"statement": "a", "levels": [level], "verdict": verdict}
        for level, verdict in (("y", "undecided"), ("x", "supported"))
    ]
    full, quick = ({"seed": 1, "claims": [{"id": "C1", "parts": parts}]} for parts in (grouped, parted))
    assert not summary.contradictions(full, quick)
    assert summary.contradictions(quick, full) == ["C1, a y: supported with --quick --seed 1, undecided in full"]
    other[3]["parts"][0]["verdict"] = "supported"
    other[4]["parts"].pop()
    (tmp_path / "quick.json").write_text(json.dumps(_document(quick=True, claims=other)))
    with pytest.raises(ClaimError, match=r"C4, risk: supported .* proved in full; C5: says other things"):
        summary.main(tmp_path / "claims.json", tmp_path / "claims.md", tmp_path / "quick.json")
    assert not (tmp_path / summary.FILE).exists()
