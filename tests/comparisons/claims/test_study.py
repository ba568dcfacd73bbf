"""The study of claims: what is kept, made again and told; not the paper's claims themselves."""

import dataclasses
import json
import math
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from command_line import Call, caller

from cgla_graph.comparisons.claims import catalogue, checking, command, store
from cgla_graph.comparisons.claims.artefact import Artefact, Content, artefacts
from cgla_graph.comparisons.claims.checking import Result, Shown, check_claims, count_steps
from cgla_graph.comparisons.claims.claim import Answer, Basis, Claim, Finding, Row, Table
from cgla_graph.comparisons.claims.evidence import Evidence, Scale
from cgla_graph.comparisons.claims.experiment import Experiment, Record
from cgla_graph.comparisons.claims.panel.settings import PanelMap
from cgla_graph.comparisons.claims.store import FIGURE, FILE, FINDING, SAMPLE, Measured, Store
from cgla_graph.comparisons.claims.summary import listed_claims, listed_statements, shipped_verdicts
from cgla_graph.errors import ClaimError, OutputError, SolverUnavailableError, StudyError

QUICK = Scale(quick=True)
calls: list[int] = []


def _squares(map_: PanelMap) -> list[Record]:
    calls.append(map_.seed)
    if map_.seed % 10 == 3:
        msg = "no square of three"
        raise ValueError(msg)
    return [{"case": "a", "value": float(map_.seed) ** 2}, {"case": "b", "value": math.inf}]


def _check_squares(evidence: Evidence) -> Finding:
    values = evidence.samples["squares"].column("value", case="a")
    table = Table("squares", ("map", "square"), [(1, float(values[0])), ("∞", math.inf)], note="of seeds")
    rows = (
        Row("positive", Answer.HOLDS, Basis.PROOF),
        Row("great", Answer.OPEN, Basis.PANEL, why=f"{len(values)} maps"),
    )
    return Finding(rows, ("a note",), (table,))


def _draws(evidence: Evidence) -> Finding:
    return Finding((Row("drawn", Answer.HOLDS, Basis.SAMPLE, why=str(evidence.rng("x").integers(10**9))),))


def _fails(*_: Evidence) -> Any:  # noqa: ANN401 - it returns nothing
    msg = "it does not add up"
    raise AssertionError(msg)


CLAIMS = (
    Claim(1, "Section 1", "squares", "", _check_squares, (2,), ("squares",), ("Fig. 1",)),
    Claim(9, "Section 2", "numbers", "", _draws),
    Claim(30, "Section 3", "too much", "", _fails),
)
ARTEFACTS = (
    Artefact("Fig. 1", "a picture", lambda: Content("a caption", b"png", b"<svg/>")),
    Artefact("Fig. 2", "no picture", _fails),
)


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Put claims, experiments and artefacts of our own for the paper's."""
    for module in (command, checking):
        monkeypatch.setattr(module, "artefacts", lambda: ARTEFACTS)
    experiment = Experiment("squares", _squares, lambda panel: panel.kinds[:1], quick=5)
    monkeypatch.setattr(catalogue, "claims", lambda: {claim.id: claim for claim in CLAIMS})
    monkeypatch.setattr(catalogue, "topics", lambda: {"All": CLAIMS})
    monkeypatch.setattr(catalogue, "experiments", lambda: {"squares": experiment})
    calls.clear()


def _findings(store_: Store) -> dict[str, Finding]:
    steps = check_claims(CLAIMS, store_, workers=0)
    return {step.result.claim.id: step.result.finding for step in steps if isinstance(step.result, Result)}


@pytest.mark.usefixtures("small")
def test_each_claim_is_checked_once_on_the_maps_of_its_seed() -> None:
    with Store(None, Scale(seed=2, quick=True)) as kept:
        assert count_steps(CLAIMS, kept) == 5 + 3
        found = _findings(kept)
    assert calls == list(range(2_000_000, 2_000_005))
    assert found["C1"].answers == (Answer.HOLDS, Answer.OPEN)
    # the map that told nothing is no map of the sample
    assert found["C1"].rows[1].why == "4 maps"
    # what is not finite survives as a word in tables
    assert found["C1"].tables[0].rows == [[1, float(2_000_000**2)], ["∞", "∞"]]
    assert found["C30"].answers == (Answer.MISSING,)
    assert "it does not add up" in found["C30"].rows[0].why


@pytest.mark.usefixtures("small")
def test_a_study_goes_on_where_it_was_killed(tmp_path: Path) -> None:
    with Store(tmp_path, QUICK) as kept:
        whole = _findings(kept)
    # killed in the middle of a line
    lines = (tmp_path / FILE).read_bytes().splitlines(keepends=True)
    (tmp_path / FILE).write_bytes(b"".join(lines[:4]) + lines[4][:20])
    n_samples = sum(json.loads(line)["kind"] == SAMPLE for line in lines[:4])
    calls.clear()
    with Store(tmp_path, QUICK, resume=True) as kept:
        assert _findings(kept) == whole
    assert len(calls) == 5 - n_samples > 0


@pytest.mark.usefixtures("small")
def test_findings_of_another_scale_and_samples_of_other_code_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Store(tmp_path, QUICK) as kept:
        _findings(kept)
    with Store(tmp_path, Scale(maps=4), resume=True) as kept:
        assert ((SAMPLE, "squares", 1_000_000) in kept, (FINDING, "C1") in kept) == (True, False)
    monkeypatch.setattr(store, "fingerprint", lambda *_: "other")
    with Store(tmp_path, QUICK, resume=True) as kept:
        assert (SAMPLE, "squares", 1_000_000) not in kept


def test_a_change_of_claims_keeps_what_was_measured() -> None:
    """Samples follow from the library, the solvers and their own modules of the panel, and not from the checks."""
    assert store.fingerprint(FINDING) == store.fingerprint(FIGURE)
    names = ("single-uav", "resolution")
    assert len({store.fingerprint(FINDING), *(store.fingerprint(SAMPLE, name) for name in names)}) == 1 + len(names)
    files = {path.name for path in store._panel_files("single-uav")}
    assert files == {"flights.py", "settings.py", "single_uav.py"}


@pytest.mark.usefixtures("small")
def test_a_study_that_is_there_is_neither_mixed_nor_lost(tmp_path: Path) -> None:
    with Store(tmp_path, Scale()) as kept:
        kept.add((SAMPLE, "squares", 1), Measured([{"value": math.nan}]))
        with pytest.raises(OutputError, match="another process writes this study"):
            Store(tmp_path, Scale(), resume=True)
    with pytest.raises(OutputError, match=r"holds a study already; go on with it \(--resume\)"):
        Store(tmp_path, Scale())
    with pytest.raises(ClaimError, match="exclude each other"):
        Store(tmp_path, Scale(), resume=True, overwrite=True)
    with Store(tmp_path, Scale(), resume=True) as kept:
        assert kept[SAMPLE, "squares", 1].records == [{"value": None}]
    with Store(tmp_path, Scale(), overwrite=True) as kept:
        assert (SAMPLE, "squares", 1) not in kept
    (tmp_path / FILE).write_text('{"kind": "sample"}\n')
    with pytest.raises(StudyError, match="is no file of a study"):
        Store(tmp_path, Scale(), resume=True)


@pytest.mark.usefixtures("small")
def test_figures_are_drawn_once_and_tried_again_if_they_fail(tmp_path: Path) -> None:
    for resume in (False, True):
        with Store(tmp_path, Scale(), resume=resume) as kept:
            assert count_steps([], kept, ARTEFACTS) == (1 if resume else 2)
            steps = sorted(check_claims([], kept, ARTEFACTS, workers=0), key=lambda step: step.what)
        first, second = (step.result for step in steps)
        assert isinstance(first, Shown)
        assert isinstance(second, Shown)
        assert first.content == ARTEFACTS[0].make()
        assert (second.content, second.failed) == (None, "AssertionError: it does not add up")


@pytest.mark.usefixtures("small")
def test_numbers_of_claims_lead_to_the_claim_or_say_where_they_went() -> None:
    assert [claim.id for claim in catalogue.chosen(["c30", "2"])] == ["C1", "C30"]
    assert [claim.id for claim in catalogue.chosen(["C1-C27"])] == ["C1", "C9"]
    assert len(catalogue.chosen([])) == 3
    assert catalogue.remarks(["C2", "C1", "C1-C9"]) == ["C2 is part of C1"]
    with pytest.raises(ClaimError, match="C27 is left out: "):
        catalogue.chosen(["C27"])
    for wrong in ("C55", "x", "", "C1-", "-3", "C1-C2-C3"):
        with pytest.raises(ClaimError, match="no claim"):
            catalogue.chosen([wrong])


@pytest.mark.usefixtures("small")
def test_ctrl_c_keeps_what_is_there_and_writes_the_report(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def stopped(*_: object, **__: object) -> Iterator[object]:
        yield from check_claims(CLAIMS[1:2], Store(None, QUICK), workers=0)
        raise KeyboardInterrupt

    monkeypatch.setattr(command, "check_claims", stopped)
    done = command.check_all(command.Request(CLAIMS, QUICK, tmp_path, workers=0))
    assert (done.interrupted, done.is_whole, len(done.results)) == (True, False, 1)
    assert "### C9" in (tmp_path / "report.md").read_text()


@pytest.mark.usefixtures("small")
def test_what_the_environment_stops_is_made_the_next_time(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """The other checks are made, and the report is written; a solver that is not installed leaves its claim missing."""
    errors: list[Exception] = [FileNotFoundError(), SolverUnavailableError("needs numpyy")]

    def lacks(evidence: Evidence) -> Finding:
        if errors:
            raise errors.pop(0)
        return _draws(evidence)

    claims = (Claim(1, "Section 1", "a file", "", lacks), CLAIMS[1])
    monkeypatch.setattr(catalogue, "claims", lambda: {claim.id: claim for claim in claims})
    request = command.Request(claims, QUICK, tmp_path / "out", workers=0)
    done = command.check_all(request)
    assert [result.claim.id for result in done.results] == ["C9"]
    assert (done.failure is not None, done.is_whole, bool(done.written)) == (True, False, True)
    lost, again = (command.check_all(dataclasses.replace(request, resume=True)) for _ in range(2))
    assert "needs numpyy" in lost.results[0].finding.rows[0].why
    assert (lost.is_whole, lost.all_hold, again.all_hold) == (False, False, True)


# ---- the paper's claims, by the command ----


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


def test_no_number_is_lost_and_all_that_claims_name_is_there() -> None:
    claims, known = catalogue.claims(), catalogue.experiments()
    told = [number for claim in claims.values() for number in (claim.number, *claim.merged)] + list(catalogue.LEFT_OUT)
    assert sorted(told) == list(range(1, max(told) + 1))
    for claim in claims.values():
        assert all((claim.place, claim.sentence, claim.reads)), claim.id
        assert set(claim.experiments) <= set(known), claim.id
        assert set(claim.figures) <= {artefact.label for artefact in artefacts()}, claim.id
    read = {name for one in (*claims.values(), *artefacts()) for name in one.experiments}
    assert read == set(known)


@pytest.mark.parametrize(
    ("words", "said"),
    [(("C57",), "no claim 'C57'"), (("--quick", "--maps", 9), "--maps"), (("--resume",), "--out")],
)
def test_what_does_not_fit_is_refused(cgla: Call, words: tuple[object, ...], said: str) -> None:
    cgla("claims", *words).refused(said)


def test_topics_are_names_of_their_claims() -> None:
    assert "C26" in [claim.id for claim in catalogue.chosen(["eight-directions"])]
    both = catalogue.chosen(["bcv", "C1"])
    assert both[0].id == "C1"
    assert {claim.id for claim in both} == {"C1", *(claim.id for claim in catalogue.topics()["BCV"])}
    assert catalogue.remarks(["bcv", "C2"]) == ["C2 is part of C1"]
    with pytest.raises(ClaimError, match="did you mean eight-directions"):
        catalogue.chosen(["nine-directions"])
    with pytest.raises(ClaimError, match="topics: eight-directions, bcv, risk-weight-k"):
        catalogue.chosen(["xyzzy"])
    named = listed_statements(["bcv"])
    assert {one["claim"] for one in named} == {claim.id for claim in catalogue.topics()["BCV"]}
    assert len(listed_statements([])) == sum(len(one["rows"]) for one in shipped_verdicts()["claims"])
    listed = listed_claims()
    assert {one["claim"] for one in listed} == set(catalogue.claims())
    assert {one["topic"] for one in listed} == {catalogue.topic_name(title) for title in catalogue.topics()}
