"""One document, shown as page, report, terminal and JSON; and the answers that are shipped."""

import copy
import json
import re
from pathlib import Path
from typing import Any

import pytest

from cgla_graph.comparisons.claims import catalogue, counterexamples, page, report, rule, summary, terminal
from cgla_graph.comparisons.claims.artefact import Artefact, Content
from cgla_graph.comparisons.claims.checking import Result, Shown
from cgla_graph.comparisons.claims.claim import Answer, Basis, Claim, Finding, Row, Table, missing
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.headlines import HEADLINES, MADE_FOR, Headline, Part, headline_table, unanswered
from cgla_graph.comparisons.claims.panel import settings
from cgla_graph.errors import ClaimError

EVIL = "<script>alert('x')</script> | *bold* \\"
RESULTS = [
    Result(
        Claim(16, "Remark 1", f"It is unique {EVIL}", "nothing", missing, (17,), figures=("Fig. 1",)),  # type: ignore[arg-type]
        Finding(
            (
                Row("risk", Answer.DEPENDS, Basis.PROOF, f"holds if {EVIL}", "0.3 (0.2 to 0.4)", "0.24", "|A - A'|"),
                Row("length", Answer.FAILS, Basis.COUNTEREXAMPLE),
            ),
            (f"a note {EVIL}",),
            (Table("squares", ("map", "square"), [(1, 79800), (EVIL, None)], note="of seeds"),),
            (counterexamples.names()[0],),
        ),
        1.0,
        {"squares": 40},
        {"squares": "1: ValueError: no square of three"},
    ),
    Result(Claim(28, "Section 5", "less risk", "all cells", missing), missing("no memory"), 0.0),  # type: ignore[arg-type]
]
SHOWN = [
    Shown(Artefact("Fig. 1", "a picture", Content), Content(EVIL, b"png", b"<svg/>")),
    Shown(Artefact("Fig. 2", "no picture", Content), None, "no ink"),
    Shown(
        Artefact("Table 1", "a table", Content),
        Content("a table", table=Table("", ("whose", "what", "why"), [("CGLA", EVIL, "another map")])),
    ),
]


def test_page_report_terminal_and_json_say_the_same(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    # wide enough that no answer is broken into two lines
    monkeypatch.setenv("COLUMNS", "160")
    topics = {"On top": [RESULTS[1].claim], "Below": [RESULTS[0].claim]}
    monkeypatch.setattr(catalogue, "topics", lambda: topics)
    monkeypatch.setattr(catalogue, "TOPICS", {"a": "On top", "b": "Below"})
    scale = Scale(quick=True)
    written = report.write_report(tmp_path, RESULTS, SHOWN, scale)
    assert {path.name for path in written} == {path.name for path in tmp_path.iterdir()}
    assert {path.name for path in tmp_path.glob("*/*")} == {"fig-1.png", "fig-1.svg", counterexamples.names()[0]}
    document = json.loads((tmp_path / "claims.json").read_text())
    assert document == json.loads(json.dumps(page.results_document(RESULTS, scale)))
    terminal.print_document(page.results_document(RESULTS, scale))
    html, text = (tmp_path / "report.html").read_text(), (tmp_path / "report.md").read_text()
    in_terminal = " ".join(capfd.readouterr().out.split())
    for shown in (html, text, in_terminal):
        for words in (
            *("2 sentences of the paper in 3 statements: fails 1, depends 1, missing 1", "0.3 (0.2 to 0.4)"),
            *("cgla claims C16 --quick", "1: ValueError: no square of three", "79,800", rule.RULE),
        ):
            assert words in shown
    for shown in (html, text):
        assert shown.index("On top") < shown.index("Below")
        assert "It could not be made: no ink" in shown
        assert "another map" in shown
    # of many claims, the terminal shows the answers
    monkeypatch.setattr(terminal, "FEW", 1)
    terminal.print_document(page.results_document(RESULTS, scale))
    short = capfd.readouterr().out
    assert all((words in short) == (words != "a note") for words in ("C16, C17", "depends (proof)", "a note"))
    # nothing of it runs, and nothing is fetched
    assert not re.search(r"<script|https?://", html)
    assert html.count("&lt;script&gt;") == text.count("\\<script>") >= 5
    assert '<span class="verdict fails">fails</span> (counterexample)</td>' in html
    assert 'src="data:image/png;base64,' in html
    # each claim has one place, to which its answers lead, and its evidence is folded
    assert (html.count('id="C16"'), html.count('href="#C16"'), html.count("<details>")) == (1, 1, 1)
    # a bar in a cell ends no cell
    rows = [line.replace("\\\\", "").replace("\\|", "") for line in text.splitlines() if line.startswith("|")]
    assert [row.count("|") for row in rows if "holds if" in row] == [7, 7]


def _document(**changes: object) -> dict[str, Any]:
    """Fabricate a full study of all claims, in which all holds."""
    results = []
    for claim in catalogue.claims().values():
        asked = dict.fromkeys(part.statement for one in HEADLINES for part in one.parts if part.claim == claim.id)
        rows = [Row(text, Answer.HOLDS, Basis.PANEL, "", "x 0.9 (0.8 to 1)") for text in asked]
        results.append(Result(claim, Finding((*rows, Row("and more", Answer.OPEN, Basis.PANEL))), 0.0))
    # (as a file has it)
    return {**json.loads(json.dumps(page.results_document(results, Scale(seed=2)))), **changes}


def test_the_page_prints_the_panel_and_the_rule_that_judge() -> None:
    text = "\n\n".join(page.page(_document()))
    panel = text.partition("## Panel and rule")[2]
    assert rule.RULE in panel
    assert f"{len(settings.cells())} cells; {settings.MAPS} maps of each kind, seeds 2000000 to 2070039." in panel
    for levels in settings.FACTORS.values():
        assert all(re.search(rf"\b{level:g}\b" if isinstance(level, float) else str(level), panel) for level in levels)
    for words in ("integral raster", "avoid_spreads 2, 4, 5", "line integral", "`-style`", "Outside of these ranges"):
        assert words in panel
    assert all(f"C{number} (" in panel for number in catalogue.LEFT_OUT)
    assert re.findall("^### (.*)$", text, re.MULTILINE) == list(catalogue.topics())
    for claim in catalogue.claims().values():
        assert f"|**{claim.id}**" in text
        assert f"({claim.place.replace('Section ', '§')})" in text


def test_the_first_page_has_ten_questions_at_most_and_its_numbers_from_rows() -> None:
    first = headline_table(_document())
    assert 1 <= len(first.rows) == len(HEADLINES) <= 10
    assert {row[1] for row in first.rows} == {"yes"}
    assert all("x 0.9 (0.8 to 1)" in str(row[2]) for row in first.rows)
    assert all("direction" in MADE_FOR[0].question and "BCV" in one.question for one in MADE_FOR[1:])
    rows = [
        {"statement": "less", "answer": "depends", "where": "fails at OR 0.1", "size": "0.5 (0.4 to 2) of its"},
        {"statement": "shorter", "answer": "fails", "where": "", "size": "1 (0.9 to 1.1) of its"},
        {"statement": "cheaper", "answer": "fails", "where": "", "size": ""},
    ]
    parts = (Part("risk", "C1", "less"), Part("length", "C1", "shorter"), Part("cost", "C1", "cheaper"))
    document = {"claims": [{"id": "C1", "rows": rows}]}
    ((_, *said),) = headline_table(document, [Headline("Better?", parts)]).rows
    assert said[0] == "risk: depends (fails at OR 0.1); length, cost: no"
    assert said[1] == "risk 0.5 (0.4 to 2); length 1 (0.9 to 1.1) of its"
    # what is not answered in full is left out
    assert not headline_table(document, [Headline("Better?", (*parts, Part("", "C2", "less")))]).rows


def test_a_part_of_a_study_is_not_shipped() -> None:
    full = _document()
    assert set(summary.shortened(full)["claims"][0]) == {*summary.ENTRIES, "rows"}
    for wrong in (_document(quick=True), _document(maps=39), _document(claims=full["claims"][1:])):
        with pytest.raises(ClaimError, match="no full study"):
            summary.shortened(wrong)
    unanswered, lost = copy.deepcopy(full), copy.deepcopy(full)
    next(claim for claim in unanswered["claims"] if claim["id"] == "C26")["rows"].pop(0)
    lost["claims"][0]["rows"][-1]["answer"] = "missing"
    for wrong in (unanswered, lost):
        with pytest.raises(ClaimError, match="there is no answer to C"):
            summary.shortened(wrong)


def test_make_claims_writes_what_is_shipped_and_the_pages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(summary, "__file__", str(tmp_path / "summary.py"))
    full, quick = _document(), _document(quick=True, seed=7)
    for row in (row for claim in quick["claims"] for row in claim["rows"]):
        row["answer"] = "open"
    paths = [tmp_path / name for name in ("claims.json", "claims.md", "README.md", "quick.json")]
    texts = [f"above\n{mark}\nold\n{summary.END}\nbelow\n" for mark in (summary.BEGIN, summary.SHORT)]
    for path, text in zip(paths, (json.dumps(full), *texts, json.dumps(quick)), strict=True):
        path.write_text(text)
    summary.main(*paths)
    shipped = json.loads((tmp_path / summary.FILE).read_text())
    assert shipped["quick_seeds"] == [7]
    for path, first in ((paths[1], "## Ten answers"), (paths[2], "- ")):
        text = path.read_text()
        assert summary.with_answers(text, shipped) == text
        assert text.startswith("above\n")
        assert text.endswith(f"{summary.END}\nbelow\n")
        assert first in text
        assert "old" not in text.splitlines()
        assert all(one.question in text for one in MADE_FOR)
    with pytest.raises(ClaimError, match="once each"):
        summary.with_answers("no marks", shipped)
    # a quick study that says more than the full one
    quick["claims"][1]["rows"][-1]["answer"] = "holds"
    paths[3].write_text(json.dumps(quick))
    (tmp_path / summary.FILE).unlink()
    with pytest.raises(ClaimError, match="and more: holds with --quick --seed 7, open in full"):
        summary.main(*paths)
    assert not (tmp_path / summary.FILE).exists()
    # or something else
    quick["claims"][1]["rows"][-1]["statement"] = "another thing"
    assert len(summary.contradictions(full, quick)) == 2


def test_what_is_shipped_is_of_the_claims_of_today() -> None:
    shipped = summary.shipped_verdicts()
    known = {(claim.id, claim.place, claim.sentence) for claim in catalogue.claims().values()}
    assert {(one["id"], one["place"], one["sentence"]) for one in shipped["claims"]} == known
    assert not unanswered(shipped)
    for claim in shipped["claims"]:
        said = [row["statement"] for row in claim["rows"]]
        assert len(said) == len(set(said)), f"{claim['id']} says one thing twice"
        assert {row["answer"] for row in claim["rows"]} <= {one.label for one in Answer} - {Answer.MISSING.label}
