"""The study of claims: what is kept, what is made again, what is told; not the claims themselves."""

import dataclasses
import json
import math
from pathlib import Path
from types import MappingProxyType

import pytest

from cgla_graph.comparisons.claims import catalogue, checking, command
from cgla_graph.comparisons.claims.artefact import Artefact, Comparison, Picture, TableRow
from cgla_graph.comparisons.claims.checking import Result, Shown, check_claims, count_steps
from cgla_graph.comparisons.claims.claim import (
    Claim,
    Finding,
    Kind,
    Part,
    Table,
    Verdict,
    finding_document,
    finding_from,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Experiment, Record
from cgla_graph.comparisons.claims.report import report_html, report_markdown, sections
from cgla_graph.comparisons.claims.store import FIGURE, FILE, FINDING, SAMPLE, Measured, Store
from cgla_graph.comparisons.claims.wording import counted, rerun, results_document
from cgla_graph.errors import ClaimError, OutputError, SolverUnavailableError, StudyError

EVIL = "<script>alert('x')</script> | *bold* \\"


def _squares(seed: int) -> list[Record]:
    calls.append(seed)
    if seed % 10 == 3:
        msg = "no square of three"
        raise ValueError(msg)
    return [{"case": "a", "value": float(seed) ** 2}, {"case": "b", "value": math.inf}]


def _check_squares(evidence: Evidence) -> Finding:
    values = evidence.samples["squares"].column("value", case="a")
    table = Table("squares", ("map", "square"), [(1, float(values[0])), (EVIL, None)], note="of seeds")
    parts = (
        Part("positive", Verdict.PROVED, "all of them", condition=f"if seeds are numbers {EVIL}"),
        Part("great", Verdict.SUPPORTED, "most of them", effect="4", printed="3"),
    )
    beside = (Part("even", Verdict.CONTRADICTED, "half of them"),)
    return Finding(parts, f"{len(values)} squares {EVIL}", beside, (table,), ("a note",))


def _check_nothing(evidence: Evidence) -> Finding:
    return Finding.single(Verdict.PROVED, f"drew {evidence.rng('x').integers(10**9)}")


def _check_badly(_: Evidence) -> Finding:
    msg = "it does not add up"
    raise AssertionError(msg)


calls: list[int] = []
CLAIMS = (
    Claim(
        "C1", "Section 1", f"squares {EVIL}", "x * x >= 0", Kind.STATISTIC, _check_squares, ("squares",), ("Fig. 1",)
    ),
    Claim("C9", "Section 2", "nothing", "true", Kind.PROOF, _check_nothing),
    Claim("C30", "Section 3", "too much", "false", Kind.PROPERTY, _check_badly),
)


def _picture() -> Picture:
    return Picture(f"a caption {EVIL}", b"png", b"<svg/>")


def _table() -> Comparison:
    return Comparison("a table", [TableRow("CGLA", EVIL, 1.5, None, 2.5, comparable=False, why="another map")])


def _squares_table(evidence: Evidence) -> Comparison:
    values = evidence.samples["squares"].column("value", case="a")
    tables = (Table("ours", ("map", EVIL), tuple((n, float(v)) for n, v in enumerate(values)), note="of seeds"),)
    return Comparison(f"{len(values)} squares", tables=tables)


def _no_picture() -> Picture:
    msg = "no ink"
    raise ValueError(msg)


ARTEFACTS = (
    Artefact("Fig. 1", "a picture", _picture),
    Artefact("Fig. 2", "no picture", _no_picture),
    Artefact("Table 1", "a table", _table),
)


@pytest.fixture(autouse=True)
def small_catalogue(monkeypatch: pytest.MonkeyPatch) -> None:
    """Claims, experiments and artefacts of our own instead of the paper's."""
    for module in (command, checking):
        monkeypatch.setattr(module, "artefacts", lambda: ARTEFACTS)
    experiment = Experiment("squares", _squares, quick=5)
    monkeypatch.setattr(catalogue, "claims", lambda: MappingProxyType({claim.id: claim for claim in CLAIMS}))
    monkeypatch.setattr(catalogue, "experiments", lambda: {"squares": experiment})
    calls.clear()


def _results(store: Store, scale: Scale) -> dict[str, Finding]:
    steps = check_claims(CLAIMS, store, workers=0)
    return {step.result.claim.id: step.result.finding for step in steps if isinstance(step.result, Result)}


def test_each_claim_is_checked_once_on_the_maps_of_its_seed() -> None:
    scale = Scale(maps=200, seed=2, quick=True)
    with Store(None, scale) as store:
        assert count_steps(CLAIMS, store) == 5 + 3
        found = _results(store, scale)
    assert calls == list(range(2_000_000, 2_000_005))
    assert {name: finding.verdicts for name, finding in found.items()} == {
        "C1": (Verdict.PROVED, Verdict.SUPPORTED),
        "C9": (Verdict.PROVED,),
        "C30": (Verdict.MISSING,),
    }
    assert "it does not add up" in found["C30"].result
    # the map that told nothing is no map of the sample
    assert found["C1"].result.startswith("4 squares")


def test_what_is_asked_for_decides_how_many_maps() -> None:
    experiment = Experiment("x", _squares, quick=5, share=0.5)
    assert experiment.maps(200, quick=False) == 100
    assert experiment.maps(200, quick=True) == 5
    assert experiment.maps(3, quick=True) == 3
    assert experiment.maps(1, quick=False) == 1


def test_random_numbers_depend_on_seed_and_purpose_only() -> None:
    drawn = {(seed, purpose): Evidence(Scale(seed=seed)).rng(purpose).random() for seed in (1, 2) for purpose in "ab"}
    assert len(set(drawn.values())) == 4
    assert Evidence(Scale(seed=2, maps=7)).rng("b").random() == drawn[2, "b"]


def test_samples_are_columns_over_the_same_maps() -> None:
    samples = Samples([{"map": 5, "k": 1, "v": True}, {"map": 2, "k": 1, "v": 3}, {"map": 2, "k": 2, "v": None}])
    assert samples.maps == [2, 5]
    assert samples.column("v", k=1).tolist() == [3.0, 1.0]
    assert [math.isnan(value) for value in samples.column("v", k=2)] == [True, True]
    with pytest.raises(ValueError, match="several records of map 2"):
        samples.column("v")


def test_a_study_goes_on_where_it_was_killed(tmp_path: Path) -> None:
    scale = Scale(quick=True)
    with Store(tmp_path, scale) as store:
        whole = _results(store, scale)
    lines = (tmp_path / FILE).read_bytes().splitlines(keepends=True)
    # killed after two samples and a finding, in the middle of a line
    (tmp_path / FILE).write_bytes(b"".join(lines[:4]) + lines[4][:20])
    kept = [json.loads(line)["kind"] for line in lines[:4]]
    calls.clear()
    with Store(tmp_path, scale, resume=True) as store:
        assert len(store.keys(SAMPLE)) == kept.count("sample")
        again = _results(store, scale)
    assert again == whole
    assert len(calls) == 5 - kept.count("sample")
    assert (tmp_path / FILE).read_bytes().count(b"\n") >= len(lines) - 1


def test_findings_of_another_scale_and_samples_of_other_code_do_not_count(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    with Store(tmp_path, Scale(quick=True)) as store:
        _results(store, Scale(quick=True))
    with Store(tmp_path, Scale(maps=4), resume=True) as store:
        assert len(store.keys(SAMPLE)) == 5
        assert not store.keys(FINDING)
    monkeypatch.setattr("cgla_graph.comparisons.claims.store.fingerprint", lambda: "other")
    with Store(tmp_path, Scale(quick=True), resume=True) as store:
        assert not store.keys(SAMPLE)
        assert not store.keys(FINDING)


def test_a_study_that_is_there_is_neither_mixed_nor_lost(tmp_path: Path) -> None:
    with Store(tmp_path, Scale()) as store:
        store.add((SAMPLE, "squares", 1), Measured([{"value": math.nan}]))
        with pytest.raises(OutputError, match="another process writes this study"):
            Store(tmp_path, Scale(), resume=True)
    with pytest.raises(OutputError, match=r"holds a study already; go on with it \(--resume\)"):
        Store(tmp_path, Scale())
    with pytest.raises(ClaimError, match="exclude each other"):
        Store(tmp_path, Scale(), resume=True, overwrite=True)
    with Store(tmp_path, Scale(), resume=True) as store:
        assert store[SAMPLE, "squares", 1].records == [{"value": None}]
    with Store(tmp_path, Scale(), overwrite=True) as store:
        assert not store.keys(SAMPLE)


def test_a_file_that_is_no_study_is_refused(tmp_path: Path) -> None:
    (tmp_path / FILE).write_text('{"kind": "sample"}\n')
    with pytest.raises(StudyError, match="is no file of a study"):
        Store(tmp_path, Scale(), resume=True)


def test_findings_survive_json() -> None:
    finding = _check_squares(Evidence(samples={"squares": Samples([{"map": 1, "case": "a", "value": math.inf}])}))
    document = json.loads(json.dumps(finding_document(finding), allow_nan=False))
    again = finding_from(document)
    assert again.tables[0].rows[0] == (1, "∞")
    assert (again.parts, again.beside) == (finding.parts, finding.beside)
    assert finding_from(finding_document(again)) == again


def test_the_reports_show_every_claim_and_run_nothing_of_it(tmp_path: Path) -> None:
    request = command.Request(CLAIMS, Scale(quick=True), tmp_path, workers=0)
    done = command.check_all(request)
    assert [result.claim.id for result in done.results] == ["C1", "C9", "C30"]
    assert not done.is_whole
    assert {path.name for path in done.written} >= {"report.html", "report.md", "claims.json"}
    page, text = (tmp_path / "report.html").read_text(), (tmp_path / "report.md").read_text()
    assert "<script>" not in page
    assert page.count("&lt;script&gt;") >= 6
    assert "<summary>evidence: 1 table, 1 note</summary>" in page
    for shown in (page, text):
        assert all(claim.id in shown for claim in CLAIMS)
        assert "cgla claims C30 --quick" in shown
        assert "1: ValueError: no square of three" in shown
        assert "a picture" in shown
        assert "It could not be made: ValueError: no ink" in shown
        assert "another map" in shown
        # a condition stands beside its verdict in the table and at the claim, an effect beside the paper's
        assert shown.count("if seeds are numbers") >= 3
        assert "4 (paper: 3)" in shown
        assert "contradicted" in shown
    # a bar in a cell ends no cell
    rows = [line for line in text.splitlines() if line.startswith("| C")]
    assert [len(line.replace("\\|", "").split("|")) for line in rows] == [6, 6, 6, 9]
    assert {path.name for path in (tmp_path / "figures").iterdir()} == {"fig-1.png", "fig-1.svg"}
    document = json.loads((tmp_path / "claims.json").read_text())
    assert document == json.loads(json.dumps(results_document(done.results, request.scale)))
    assert [claim["verdict"] for claim in document["claims"]] == ["proved, supported", "proved", "missing"]
    assert document["claims"][0]["parts"][1]["printed"] == "3"
    assert counted(done.results) == "3 claims, which say 4 things: 2 proved, 1 supported, 1 missing"


def test_figures_are_drawn_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def shown(*, resume: bool) -> list[object]:
        with Store(tmp_path, Scale(), resume=resume) as store:
            made = list(check_claims([], store, ARTEFACTS, workers=0))
            assert len(store.keys(FIGURE)) == 2
        return [step.result.content for step in sorted(made, key=lambda step: step.what)]

    first = shown(resume=False)
    # what failed is tried again
    monkeypatch.setattr(checking, "artefacts", lambda: ARTEFACTS[1:2])
    assert shown(resume=True) == first == [_picture(), None, _table()]


def test_a_table_of_an_experiment_waits_for_its_samples(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    wanted = Artefact("Table A1", "squares", _squares_table, ("squares",))
    monkeypatch.setattr(checking, "artefacts", lambda: (wanted,))
    contents = []
    for scale, maps in ((Scale(quick=True), 5), (Scale(maps=3), 3), (Scale(maps=3), 3)):
        calls.clear()
        with Store(tmp_path, scale, resume=True) as store:
            steps = list(check_claims([], store, [wanted], workers=0))
        (shown,) = [step.result for step in steps if isinstance(step.result, Shown)]
        contents.append(shown.content)
        # what is made is made again at another scale only, of the samples that are there
        assert len(calls) == (5 if scale.quick else 0)
        assert len(steps) == 1 + len(calls)
        # the map that tells nothing is none of the sample
        assert shown.content is not None
        assert shown.content.caption == f"{min(maps, 4)} squares"
        text, page = report_markdown([], [shown], scale), report_html([], [shown], scale)
        assert "ours:" in text
        assert "of seeds" in text
        assert "<script>" not in page
        assert "&lt;script&gt;" in page
    assert contents[1] == contents[2]


def test_claims_are_parted_by_what_they_are_about() -> None:
    with Store(None, Scale(quick=True)) as store:
        results = [step.result for step in check_claims(CLAIMS, store, workers=0) if isinstance(step.result, Result)]
    results.sort(key=lambda result: result.claim.number)
    parted = sections(results)
    assert [title for title, _ in parted] == ["Model", "Algorithm", "One UAV"]
    assert report_html(results, [], Scale()).count("<article") == 3
    assert report_markdown(results, [], Scale()).count("### C") == 3


@pytest.mark.parametrize(
    ("scale", "words"),
    [
        (Scale(), "cgla claims C28"),
        (Scale(maps=500, seed=7), "cgla claims C28 --maps 500 --seed 7"),
        (Scale(quick=True), "cgla claims C28 --quick"),
    ],
)
def test_each_claim_says_how_to_check_it_again(scale: Scale, words: str) -> None:
    assert rerun("C28", scale) == words


def test_ids_are_numbers_and_ranges() -> None:
    assert [claim.id for claim in catalogue.chosen(["c30", "1"])] == ["C1", "C30"]
    assert [claim.id for claim in catalogue.chosen(["C1-C9"])] == ["C1", "C9"]
    assert len(catalogue.chosen([])) == 3
    for wrong in ("C55", "x", "", "C1-", "-3", "C1-C2-C3"):
        with pytest.raises(ClaimError, match="no claim"):
            catalogue.chosen([wrong])


def test_some_claims_get_their_own_figures_only(tmp_path: Path) -> None:
    assert [one.label for one in command.Request(CLAIMS[:1], folder=tmp_path).artefacts] == ["Fig. 1"]
    assert not command.Request(CLAIMS[1:2], folder=tmp_path).artefacts
    assert not command.Request(CLAIMS).artefacts


@pytest.mark.parametrize("error", [FileNotFoundError, ModuleNotFoundError])
def test_what_the_environment_stops_is_made_the_next_time(
    error: type[Exception], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """The other checks are made, and the report is written."""
    file = tmp_path / "file"

    def lacks(_: Evidence) -> Finding:
        if not file.exists():
            raise error
        return Finding.single(Verdict.PROVED, "it is there")

    claims = (Claim("C1", "Section 1", "a file", "there", Kind.PROOF, lacks), CLAIMS[1])
    monkeypatch.setattr(catalogue, "claims", lambda: MappingProxyType({claim.id: claim for claim in claims}))
    request = command.Request(claims, Scale(quick=True), tmp_path / "out", workers=0)
    done = command.check_all(request)
    assert [result.claim.id for result in done.results] == ["C9"]
    assert (done.failure is not None, done.is_whole, bool(done.written)) == (True, False, True)
    file.touch()
    again = command.check_all(dataclasses.replace(request, resume=True))
    assert [result.finding.headline for result in again.results] == ["proved", "proved"]
    assert again.failure is None


def test_a_claim_whose_solver_is_not_installed_is_missing() -> None:
    """It is no broken environment."""

    def lacks(_: Evidence) -> Finding:
        msg = "needs numpyy"
        raise SolverUnavailableError(msg)

    with pytest.MonkeyPatch.context() as patch, Store(None, Scale(quick=True)) as store:
        claim = Claim("C1", "Section 1", "a solver", "there", Kind.PROOF, lacks)
        patch.setattr(catalogue, "claims", lambda: {"C1": claim})
        (step,) = check_claims([claim], store, workers=0)
    assert isinstance(step.result, Result)
    assert step.result.finding.verdicts == (Verdict.MISSING,)
    assert "needs numpyy" in step.result.finding.result
