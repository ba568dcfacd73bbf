"""The command `claims` on the paper's own claims, in processes of its own."""

import json
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import pytest
from command_line import Call, caller

from cgla_graph.comparisons.claims import catalogue, counterexamples
from cgla_graph.comparisons.claims.artefact import artefacts
from cgla_graph.scenarios.mission_file import is_mission_file

PROGRAM = [sys.executable, "-m", "cgla_graph.comparisons"]
#: A claim whose maps take a moment each, and how it is asked for.
SAMPLED = ["claims", "C28", "--maps", "4"]


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


def test_all_54_claims_are_there_and_what_they_name_as_well() -> None:
    claims = catalogue.claims()
    assert list(claims) == [f"C{number}" for number in range(1, 55)]
    known, labels = catalogue.experiments(), {artefact.label for artefact in artefacts()}
    for claim in claims.values():
        assert all((claim.place, claim.sentence, claim.statement)), claim.id
        assert set(claim.experiments) <= set(known), claim.id
        assert set(claim.figures) <= labels, claim.id
    shown = {name for one in artefacts() for name in one.experiments}
    assert {name for claim in claims.values() for name in claim.experiments} | shown == set(known)
    figures, tables = ([f"{kind} {n}" for n in range(1, last + 1)] for kind, last in (("Fig.", 12), ("Table", 5)))
    assert [artefact.label for artefact in artefacts() if not artefact.is_ours] == [*figures, *tables]


@pytest.mark.parametrize("name", counterexamples.names())
def test_each_counterexample_can_be_read(name: str, tmp_path: Path) -> None:
    """Maps and missions are files for `cgla plan` and `cgla fly`; graphs have a source and a target."""
    (tmp_path / name).write_text(counterexamples.text(name), encoding="utf-8")
    if name.endswith(".json"):
        document = counterexamples.document(name)
        assert document["title"]
        assert {document["source"], document["target"]} <= set(document["labels"])
    elif is_mission_file(str(tmp_path / name)):
        assert counterexamples.mission(name).title
    else:
        assert counterexamples.scenario(name).title


@pytest.mark.slow
def test_a_few_claims_are_shown_with_their_evidence(cgla: Call) -> None:
    answer = cgla("claims", "c16", "13", "--quick", "--workers", 2)
    assert answer.code == 0
    said = ("C13: not below 0: proved", "C16: refuted", "counterexample: remark-1-star.json", "again: cgla claims C16")
    for words in said:
        assert words in answer.out
    assert answer.out.index("C13") < answer.out.index("C16")


@pytest.mark.slow
def test_json_and_strict(cgla: Call) -> None:
    answer = cgla("claims", "C13-C16", "--quick", "--json", "--strict", "--workers", 0)
    document = answer.document()
    assert answer.code == 1
    found = {claim["id"]: claim["verdict"] for claim in document["claims"]}
    assert found == {f"C{n}": "proved, refuted" for n in (13, 14, 15)} | {"C16": "refuted"}
    assert [part["condition"] for part in document["claims"][2]["parts"]] == [
        "if weights are positive, and A symmetric or read in Eq. 9's direction",
        "if A is not symmetric, and read against Eq. 9's direction",
    ]
    assert document["claims"][3]["rerun"] == "cgla claims C16 --quick"
    assert cgla("claims", "C8", "--quick", "--strict", "--workers", 0).code == 0


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (("C55",), ("no claim 'C55'", "C1 to C54")),
        (("--quick", "--maps", 9), ("--maps",)),
        (("--resume",), ("--out",)),
        (("--overwrite",), ("--out",)),
        (("C13", "--maps", 0), ("--maps",)),
        (("C13", "--seed", -1), ("--seed",)),
    ],
)
def test_what_does_not_fit_is_refused(cgla: Call, words: tuple[object, ...], said: tuple[str, ...]) -> None:
    cgla("claims", *words).refused(*said)


@pytest.mark.slow
def test_the_report_and_the_figures_of_a_claim(cgla: Call, tmp_path: Path) -> None:
    answer = cgla("claims", "C26", "C16", "--quick", "--out", "out", "--workers", 0)
    assert answer.code == 0, answer.err
    out = tmp_path / "out"
    assert {path.name for path in out.iterdir()} >= {"report.html", "report.md", "claims.json", "claims.jsonl"}
    assert (out / "figures" / "fig-2.png").read_bytes().startswith(b"\x89PNG")
    assert "<svg" in (out / "figures" / "fig-2.svg").read_text(encoding="utf-8")
    stored = {path.name: path.read_text(encoding="utf-8") for path in (out / "counterexamples").iterdir()}
    assert stored == {name: counterexamples.text(name) for name in ("remark-1-diamond.json", "remark-1-star.json")}
    page = (out / "report.html").read_text(encoding="utf-8")
    # nothing is fetched
    assert "http://" not in page
    assert "https://" not in page
    cgla("claims", "C16", "--out", "out").refused("holds a study already", "--resume", "--overwrite")
    again = cgla("claims", "C26", "C16", "--quick", "--out", "out", "--resume", "--workers", 0)
    assert again.out == answer.out


def n_lines(folder: Path) -> int:
    path = folder / "claims.jsonl"
    return path.read_bytes().count(b"\n") if path.exists() else 0


@pytest.fixture
def busy(tmp_path: Path) -> Iterator[subprocess.Popen[str]]:
    """Start a study that has measured two maps and has more to do."""
    words = [*PROGRAM, *SAMPLED, "--out", str(tmp_path / "out"), "--workers", "1"]
    with subprocess.Popen(words, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True) as running:
        try:
            while running.poll() is None and n_lines(tmp_path / "out") < 2:
                time.sleep(0.02)
            yield running
        finally:
            running.kill()


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_a_study_that_is_killed_goes_on_and_finds_the_same(
    busy: subprocess.Popen[str], cgla: Call, tmp_path: Path
) -> None:
    busy.kill()
    busy.communicate(timeout=120)
    before = n_lines(tmp_path / "out")
    resumed = cgla(*SAMPLED, "--out", "out", "--resume", "--json").document()
    assert n_lines(tmp_path / "out") > before
    whole = cgla(*SAMPLED, "--json").document()
    for document in (resumed, whole):
        for claim in document["claims"]:
            claim["seconds"] = 0.0
    assert resumed == whole
    kept = [json.loads(line) for line in (tmp_path / "out" / "claims.jsonl").read_text().splitlines()]
    measured = [tuple(line["key"]) for line in kept if line["kind"] == "sample"]
    assert len(measured) == len(set(measured))


@pytest.mark.slow
@pytest.mark.skipif(os.name != "posix", reason="signals of POSIX")
def test_ctrl_c_keeps_what_is_measured(busy: subprocess.Popen[str], tmp_path: Path) -> None:
    busy.send_signal(signal.SIGINT)
    _, err = busy.communicate(timeout=120)
    assert busy.returncode == 130
    assert err.endswith(f"claims are checked; continue with --out {tmp_path / 'out'} --resume\n")
    assert n_lines(tmp_path / "out") >= 2
    assert (tmp_path / "out" / "report.md").exists()
