"""Doors of proof files: `--proof`, `--write`, `cgla verify`, `certificate.save`, and what they refuse before work."""

import copy
import math
from functools import cache
from importlib import resources
from pathlib import Path
from tempfile import TemporaryDirectory

import pytest
from command_line import Call, caller

import cgla_graph as cg
from cgla_graph.certificate.proof_file import problem_digest
from cgla_graph.certificate.proof_target import ON_EARTH
from cgla_graph.comparisons.conformance import proof_files
from cgla_graph.comparisons.conformance.proof_files import FOLDER
from cgla_graph.comparisons.conformance.suite import chosen, suite
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.proofs import linked_proofs
from cgla_graph.errors import OutputError, ProblemError
from cgla_graph.scenarios.scenario import load_scenario

MAP = """
start = [0.2, 0.5]
goal = [0.8, 0.5]
bounds = [0, 0, 1, 1]
k = 1
[[threats]]
x = 0.5
y = 0.55
spread = 0.1
peak = 0.5
"""
IN_DEGREES = """
coordinates = "lonlat"
start = [24.9, 60.2]
goal = [24.8, 60.1]
bounds = [24.7, 60.0, 25.0, 60.3]
k = 0
"""
PROBLEM = cg.Problem((0.2, 0.5), (0.8, 0.5), cg.RiskField([cg.Threat(0.5, 0.55, 0.1, 0.5)]), k=1.0)
#: Gaps that the first grids reach.
COARSE = ("--tolerance", "0.1")


@cache
def coarse_proof() -> bytes:
    """Return a proof of the map, on the first grid."""
    with TemporaryDirectory() as folder:
        cg.save_proof(PROBLEM, Path(folder) / "one.proof", tolerance=0.5)
        return (Path(folder) / "one.proof").read_bytes()


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    (tmp_path / "one.toml").write_text(MAP, encoding="utf-8")
    (tmp_path / "degrees.toml").write_text(IN_DEGREES, encoding="utf-8")
    return caller(tmp_path, monkeypatch, capfd)


# what is written


@pytest.mark.parametrize("door", [("certify", "one.toml", "--write"), ("plan", "one.toml", "--proof")])
def test_a_command_writes_the_proof_of_its_path(door: tuple[str, ...], call: Call) -> None:
    answer = call(*door, "one.proof", *COARSE, "--json").document()
    proof = answer["proof_file"]
    assert proof["verified"]
    assert proof["lower_bound"] <= answer["cost"] <= proof["upper_bound"] <= answer["cost"] * (1.0 + 1e-5)
    found = cg.verify_proof("one.proof", PROBLEM)
    assert [found["lower"], found["upper"]] == [proof["lower_bound"], proof["upper_bound"]]


def test_the_proof_of_a_checked_plan_holds_the_plan(call: Call) -> None:
    Path("mine.csv").write_text("x,y\n0.2,0.5\n0.5,0.4\n0.8,0.5\n", encoding="utf-8")
    answer = call("check", "mine.csv", "one.toml", "--proof", "mine.proof", *COARSE, "--json").document()
    proof = answer["proof_file"]
    assert proof["lower_bound"] <= answer["best"]["upper_bound"] <= answer["cost"] <= proof["upper_bound"]
    assert proof["upper_bound"] <= answer["cost"] * (1.0 + 1e-5)
    assert call("verify", "mine.proof", "--map", "one.toml").code == 0


@pytest.mark.slow
def test_a_plan_that_is_not_clean_is_not_in_the_proof(call: Call) -> None:
    Path("walled.toml").write_text(f"{MAP}\n[no_fly]\npolygons = [[[0.45, 0.4], [0.55, 0.4], [0.55, 0.9]]]\n")
    Path("mine.csv").write_text("x,y\n0.2,0.5\n0.8,0.5\n", encoding="utf-8")
    answer = call("check", "mine.csv", "walled.toml", "--proof", "mine.proof", "--tolerance", "0.2", "--json")
    proof = answer.document()["proof_file"]
    assert (answer.code, proof["upper_bound"]) == (1, None)
    assert "without the plan" in proof["note"]
    assert 0.6 < proof["lower_bound"] == cg.verify_proof("mine.proof")["lower"]


def test_the_best_known_cost_counts_for_a_bad_path(tmp_path: Path) -> None:
    certificate = cg.lower_bound(PROBLEM, 0.1, path=[(0.2, 0.5), (0.2, 0.9), (0.8, 0.5)])
    assert certificate.known < 0.7 * certificate.upper_bound
    found = certificate.save(tmp_path / "one.proof")
    assert certificate.known / 1.1 <= found["lower"] <= certificate.known
    assert certificate.upper_bound <= found["upper"]
    # (a tube of the bad path's cost has more pieces)
    assert (tmp_path / "one.proof").stat().st_size < 250_000


def test_a_certificate_without_its_problem_says_the_remedy(tmp_path: Path) -> None:
    bare = copy.copy(cg.lower_bound(PROBLEM, 0.05))
    assert bare.problem is None
    with pytest.raises(ProblemError, match=r"does not know its problem.*cgla_graph.save_proof\(problem, file, path\)"):
        bare.save(tmp_path / "one.proof")


def test_a_map_in_degrees_says_what_is_not_checked(call: Call) -> None:
    answer = call("plan", "degrees.toml", "--proof", "one.proof", *COARSE)
    (line,) = [line for line in answer.out.splitlines() if line.startswith("in file")]
    assert "no path costs less than" in line
    assert "the bound without a file: " in line
    assert ON_EARTH in line
    assert "written to .: one.proof" in answer.out
    assert cg.verify_proof("one.proof")["note"] == ON_EARTH
    verified = call("verify", "one.proof", "--map", "degrees.toml")
    assert (verified.code, verified.out.count("\n")) == (0, 1)
    assert ON_EARTH in verified.out
    assert " m; its path costs at most " in verified.out


# what is refused before any work


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("plan", "one.toml", "--turn-radius", "0.01"), "no arcs; leave out --turn-radius or --proof"),
        (("plan", "one.toml", "--via", "0.5,0.9"), "leave out --via or --proof"),
        (("plan", "one.toml", "--max-risk", "1"), "knows no budget; leave out --max-risk"),
        (("plan", "one.toml", "--max-length", "3"), "knows no budget; leave out --max-length"),
        (("plan", "one.toml", "--no-certificate"), "there is no proof to write"),
        (("plan", "one.toml", "--tolerance", "0"), "there is no proof to write"),
        (("plan", "one.toml", "--goal", "0.2,0.5"), "start and goal are one place"),
        (("certify", "one.toml", "--goal", "0.2,0.5"), "start and goal are one place"),
        (("check", "round.csv", "one.toml"), "start and goal are one place"),
        (("check", "round.csv", "one.toml", "--no-certificate"), "there is no proof to write"),
        (("plan", "fig8"), "fig8"),
        (("fly", "fig8"), "no such option"),
        (("pareto", "one.toml"), "no such option"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_what_has_no_file_is_refused_before_any_work(
    words: tuple[str, ...], why: str, call: Call, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("round.csv").write_text("x,y\n0.2,0.5\n0.8,0.5\n0.2,0.5\n", encoding="utf-8")
    assert runner.solve  # (imported before the name is replaced)
    monkeypatch.setattr("cgla_graph.solvers.solving.solve", lambda *_, **__: pytest.fail("work"))
    call(*words, "--proof", "one.proof").refused(why)
    assert not Path("one.proof").exists()


@pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.ImproperFieldWarning")
def test_fields_with_peaks_above_1_are_refused(call: Call) -> None:
    Path("high.toml").write_text(f"improper = true\n{MAP.replace('peak = 0.5', 'peak = 1.5')}", encoding="utf-8")
    Path("mine.csv").write_text("x,y\n0.2,0.5\n0.8,0.5\n", encoding="utf-8")
    for words in (("plan",), ("certify",), ("check", "mine.csv")):
        answer = call(*words, "high.toml", "--proof", "one.proof")
        assert (answer.code, answer.out) == (2, "")
        assert "--proof one.proof: there is no proof for a field with peaks above 1" in answer.err.replace(
            "--write", "--proof"
        )
    assert not Path("one.proof").exists()


@pytest.mark.parametrize("door", [("certify", "one.toml", "--write"), ("plan", "one.toml", "--proof")])
def test_other_files_are_not_replaced(door: tuple[str, ...], call: Call) -> None:
    Path("folder").mkdir()
    for taken in ("one.toml", "folder"):
        call(*door, taken).refused(taken, "is there already, and is no proof file")
    assert Path("one.toml").read_text(encoding="utf-8") == MAP
    call(*door, "one.toml/one.proof").refused("one.toml")


def test_files_are_checked_before_the_proof(tmp_path: Path) -> None:
    mine, empty = tmp_path / "mine.txt", tmp_path / "empty"
    mine.write_text("mine", encoding="utf-8")
    empty.touch()
    with pytest.raises(OutputError, match="is no proof file"):
        cg.save_proof(PROBLEM, mine)
    with pytest.raises(OutputError, match="there is no folder"):
        cg.save_proof(PROBLEM, tmp_path / "none" / "one.proof")
    assert mine.read_text(encoding="utf-8") == "mine"
    assert cg.save_proof(PROBLEM, empty, tolerance=0.5)["upper"] == math.inf
    before = empty.read_bytes()
    with pytest.raises(ProblemError, match="not feasible"):
        cg.save_proof(PROBLEM, empty, [(0.2, 0.5), (3.0, 3.0), (0.8, 0.5)])
    assert empty.read_bytes() == before
    assert sorted(one.name for one in tmp_path.iterdir()) == ["empty", "mine.txt"]


# comparisons


def test_a_report_links_the_proofs_of_its_brackets(call: Call) -> None:
    words = ("compare", "one.toml", "--solvers", "straight-line", "--pictures", "0", "--tolerance", "0.5")
    answer = call(*words, "--proofs", "proofs", "--out", "study", "--json")
    (proof,) = answer.document()["proofs"]
    assert proof["file"] == str(Path("proofs/one.proof"))
    assert cg.verify_proof("proofs/one.proof", PROBLEM)["lower"] == proof["lower_bound"]
    page = Path("study/report.html").read_text(encoding="utf-8")
    assert '"href":"../proofs/one.proof","command":"cgla verify proofs/one.proof"' in page
    Path("proofs/one.proof").rename("proofs/other.proof")
    assert linked_proofs(Path("study"), [load_scenario("one.toml")]) == {}
    Path("proofs/other.proof").rename("proofs/one.proof")
    assert set(linked_proofs(Path("study"), [load_scenario("one.toml")])) == {"one"}
    Path("one.toml").write_text(MAP.replace("k = 1", "k = 2"), encoding="utf-8")
    assert linked_proofs(Path("study"), [load_scenario("one.toml")]) == {}


@pytest.mark.parametrize(
    ("words", "why"),
    [
        (("one.toml", "--no-certificate"), "leave out --no-certificate or --proofs"),
        (("fig8",), "only maps have proof files, and fig8 is none"),
        (("one.toml", "fig8"), "only maps have proof files"),
        (("one.toml", "--goal", "0.2,0.5"), "start and goal are one place"),
    ],
    ids=lambda value: "-".join(value) if isinstance(value, tuple) else "",
)
def test_comparisons_without_proof_files_are_refused(words: tuple[str, ...], why: str, call: Call) -> None:
    call("compare", *words, "--solvers", "straight-line", "--proofs", "proofs").refused(why)


def test_other_files_are_kept_in_a_folder_of_proofs(call: Call) -> None:
    Path("one.proof").write_text("mine", encoding="utf-8")
    call("compare", "one.toml", "--solvers", "straight-line", "--proofs", ".").refused("one.proof", "is no proof file")
    assert Path("one.proof").read_text(encoding="utf-8") == "mine"


# the conformance suite


def test_the_suite_verifies_its_proofs(call: Call) -> None:
    answer = call("conform", "verify", "--instances", "open-straight,infeasible-wall,maze-large")
    assert answer.code == 0
    assert [line.split()[:2] for line in answer.out.splitlines()] == [
        ["verified", "open-straight:"], ["no", "file"], ["verified", "infeasible-wall:"],
    ]  # fmt: skip
    assert "cgla conform prove FOLDER --instances maze-large" in answer.out
    Path("mine").mkdir()
    Path("mine/open-straight.proof").write_bytes(coarse_proof())
    answer = call("conform", "verify", "mine", "--instances", "open-straight", "--json")
    assert answer.code == 1
    (proof,) = answer.document()["proofs"]
    assert "another problem" in proof["fault"]
    call("conform", "verify", "none").refused("no such folder")
    call("conform", "prove").refused("write cgla conform prove FOLDER")
    call("conform", "verify", "mine", "more").refused("write cgla conform verify [FOLDER]")


def test_the_suite_proves_an_instance_again(call: Call) -> None:
    answer = call("conform", "prove", "mine", "--instances", "open-straight")
    assert (answer.code, answer.out.split()[0]) == (0, "written")
    assert call("conform", "verify", "mine", "--instances", "open-straight").code == 0


def test_records_name_the_files_that_are_stored() -> None:
    stored = {
        one.name.removesuffix(".proof"): one
        for one in resources.files(proof_files.__package__).joinpath(FOLDER).iterdir()
    }
    known = proof_files.records()
    assert set(stored) == {name for name, one in known.items() if one.is_stored}
    assert set(known) <= {one.name for one in suite()}
    for name, file in stored.items():
        assert len(file.read_bytes()) == known[name].bytes
    for one in chosen(["open", "lonlat", "infeasible"]):
        assert known[one.name].problem == problem_digest(one.problem.build())
    assert sum(len(file.read_bytes()) for file in stored.values()) < 800_000


@pytest.mark.slow
def test_every_stored_proof_of_the_suite_is_true() -> None:
    for one in proof_files.verify_suite():
        assert not one.fault
        known = proof_files.records().get(one.file.name)
        if one.found is not None and known is not None:
            assert one.found["lower"] == (math.inf if known.lower_bound is None else known.lower_bound)


# verify


def test_verify_prints_a_line_for_each_file(call: Call) -> None:
    Path("one.proof").write_bytes(coarse_proof())
    Path("cut.proof").write_bytes(Path("one.proof").read_bytes()[:-40])
    answer = call("verify", "one.proof", "cut.proof", "none.proof", "one.toml", "one.proof")
    assert answer.code == 1
    lines = answer.out.splitlines()
    assert [line.split()[0] for line in lines] == ["verified", "refused", "refused", "refused", "verified"]
    assert [name in line for name, line in zip(("one.proof", "cut.proof", "none.proof"), lines, strict=False)]
    document = call("verify", "one.proof", "cut.proof", "--json").document()
    assert [one["verified"] for one in document["proofs"]] == [True, False]
    assert call("verify", "one.proof").code == 0


def test_verify_on_another_map(call: Call) -> None:
    Path("one.proof").write_bytes(coarse_proof())
    assert call("verify", "one.proof", "--map", "one.toml").code == 0
    other = call("verify", "one.proof", "--map", "one.toml", "--k", "1.01")
    assert (other.code, other.out.count("\n")) == (1, 1)
    assert "another problem" in other.out
    call("verify", "one.proof", "--map", "none.toml").refused("none.toml")
    call("verify", "one.proof", "--k", "1.01").refused("--k", "--map MAP")
