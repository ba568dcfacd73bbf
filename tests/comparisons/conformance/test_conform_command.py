"""`cgla conform`: every planner gets a row and leaves nothing behind, and exit codes tell the verdict."""

import json
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest
from awkward_calls import alive, until
from command_line import Call, caller

from cgla_graph import comparisons
from cgla_graph.comparisons.conformance.run import results_of
from cgla_graph.comparisons.conformance.suite import chosen
from cgla_graph.comparisons.conformance.verdict import Verdict
from cgla_graph.errors import CglaError
from cgla_graph.isolation.limits import Limits

EXAMPLES = Path(__file__).resolve().parents[3] / "examples" / "conformance"
#: A planner that does to each instance something else.
AWKWARD = """
import json, os, signal, subprocess, sys, time
folder = sys.argv[1]
kept = sys.stdin.buffer
deed = None
if len(sys.argv) > 2:
    deed = sys.argv[2]
def say(path):
    print(json.dumps({"path": path}), flush=True)
def child(**how):
    code = "import time; time.sleep(600)"
    process = subprocess.Popen([sys.executable, "-c", code], **how)
    with open(f"{folder}/pids", "a") as file:
        file.write(f"{process.pid}\\n")
deeds = {
    "hang": lambda: time.sleep(600),
    "deaf": lambda: (signal.signal(signal.SIGTERM, signal.SIG_IGN), signal.alarm(0), time.sleep(600)),
    "closed": lambda: (os.close(1), os.close(2), time.sleep(600)),
    "crash": lambda: sys.exit("first\\nno memory for that"),
    "segfault": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "flood": lambda: [sys.stdout.write("x" * 2**20) for _ in range(10**6)],
    "mutter": lambda: ([sys.stderr.write("x" * 2**16 + "\\n") for _ in range(64)], say(None)),
    "unread": lambda: say(None),
    "fork": lambda: (child(), say(None)),
    "session": lambda: (child(start_new_session=True), say(None)),
    "lost": lambda: (child(start_new_session=True), time.sleep(600)),
    "eat": lambda: say([bytearray(2**30) and None]),
    "nothing": lambda: None,
}
deeds[deed]()
"""


@pytest.fixture
def awkward(tmp_path: Path) -> Path:
    file = tmp_path / "awkward.py"
    file.write_text(AWKWARD, encoding="utf-8")
    return file


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


@pytest.mark.skipif(sys.platform != "linux", reason="looks at processes as Linux has them")
@pytest.mark.parametrize(
    ("deed", "verdict", "message"),
    [
        ("hang", Verdict.TIMED_OUT, "stopped after 0.4 s"),
        ("deaf", Verdict.TIMED_OUT, "stopped after 0.4 s"),
        ("closed", Verdict.TIMED_OUT, "stopped after 0.4 s"),
        ("crash", Verdict.CRASHED, "it left with the exit code 1: no memory for that"),
        ("segfault", Verdict.CRASHED, "it died of SIGSEGV"),
        ("flood", Verdict.MALFORMED, "it wrote more than 4 MB to standard output"),
        ("mutter", Verdict.MISSED, "it found no path, but there is one"),
        ("unread", Verdict.MISSED, "it found no path, but there is one"),
        ("fork", Verdict.MISSED, "it found no path, but there is one"),
        ("session", Verdict.MISSED, "it found no path, but there is one"),
        pytest.param("lost", Verdict.TIMED_OUT, "stopped after 4 s", marks=pytest.mark.slow),
        ("eat", Verdict.CRASHED, "it left with the exit code 1: MemoryError"),
        ("nothing", Verdict.MALFORMED, "it wrote nothing"),
    ],
)
def test_whatever_a_planner_does_is_a_row(
    awkward: Path, tmp_path: Path, deed: str, verdict: Verdict, message: str
) -> None:
    # one that leaves something behind needs time for it
    limits = Limits((4.0 if deed == "lost" else 0.4) if verdict is Verdict.TIMED_OUT else 60.0, 512.0)
    command = [sys.executable, str(awkward), str(tmp_path), deed]
    (found,) = results_of(command, chosen(["raster-hills"]), limits)

    assert (found.verdict, found.message) == (verdict, message)
    pids = tmp_path / "pids"
    if deed in {"fork", "session", "lost"}:
        (pid,) = map(int, pids.read_text(encoding="ascii").split())
        assert until(lambda: not alive(pid), 3.0)


def test_a_planner_in_plain_python(call: Call) -> None:
    answer = call(
        "conform", "--instances", "open-one,walls-along,infeasible-wall", "--out", "results/here.json", "--",
        sys.executable, EXAMPLES / "astar.py",
    )  # fmt: skip
    assert answer.code == 0, answer.out
    assert "3 of 3 answers right" in answer.out
    document = json.loads(Path("results/here.json").read_text(encoding="utf-8"))
    assert document["passed"]
    for row in document["results"][:2]:
        assert row["lower_bound"] <= row["cost"] <= 1.08 * row["upper_bound"]
    assert document["results"][2]["verdict"] == "no-path"


@pytest.mark.skipif(shutil.which("g++") is None, reason="there is no compiler")
@pytest.mark.slow
def test_a_planner_in_plain_cpp(call: Call, tmp_path: Path) -> None:
    subprocess.run(["g++", "-O2", "-std=c++17", "-o", tmp_path / "planner", EXAMPLES / "dijkstra.cpp"], check=True)  # noqa: S607 - wherever it is
    answer = call("conform", "--instances", "crowd,raster,infeasible,lonlat", "--json", "--", tmp_path / "planner")
    assert answer.code == 0, answer.err
    for row in answer.document()["results"]:
        assert row["verdict"] == ("no-path" if row["family"] == "infeasible" else "feasible"), row
        assert row["excess"] is None or row["excess"] < 0.05, row


def test_a_solver_of_ours_takes_part(call: Call, monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    """In this process: what `cgla answer` reads is what `--show` prints."""
    problem = tmp_path / "problem.json"
    for name, refine in (("narrow-slit", ["--refine"]), ("infeasible-wall", [])):
        problem.write_text(call("conform", "--show", name).out, encoding="utf-8")
        with problem.open(encoding="utf-8") as file:
            monkeypatch.setattr(sys, "stdin", file)
            said = call("answer", "--solver", "visibility-graph", *refine)
        assert said.code == 0, said.err
        path = json.loads(said.out)["path"]
        (one,) = chosen([name])
        assert (path is None) is not one.has_path
        if path is not None:
            assert one.problem.build().evaluate(path).cost == pytest.approx(one.upper_bound, rel=1e-9)


def test_exit_codes_and_lists(call: Call, awkward: Path) -> None:
    silent = ("--", sys.executable, awkward, ".", "unread")
    missed = call("conform", "--instances", "open-straight,infeasible-wall", *silent)
    assert missed.code == 1
    assert "open-straight: it found no path, but there is one\n" in missed.out
    assert "1 of 2 answers right; 1 missed" in missed.out
    assert call("conform", "--instances", "infeasible-wall", *silent).code == 0
    assert len(json.loads(call("conform", "--list", "--json").out)) == 40
    assert call("conform", "--schema").document()["version"] == 1
    call("conform", "--instances", "narow", "--", "true").refused("no instance 'narow'", "did you mean narrow")
    call("conform", "--", "no-such-planner").refused("no-such-planner", "no such program")
    call("conform").refused("there is no planner", "cgla conform -- COMMAND")
    call("conform", "--timeout", "0", "--", "true").refused("--timeout", "0")


@pytest.mark.slow
def test_from_python_it_is_one_call(tmp_path: Path) -> None:
    """Results come in the order of the request; invalid requests fail before anything starts."""
    planner = tmp_path / "planner.py"
    planner.write_text("import json, sys, time\ntime.sleep(json.load(sys.stdin)['name'] == 'open-one')\n", "utf-8")
    (own,) = chosen(["open-straight"])
    found = comparisons.conform([sys.executable, planner], ["open-one", own, "open-straight"], workers=2)
    assert [one.instance.name for one in found] == ["open-one", "open-straight"]
    assert {one.verdict for one in found} == {Verdict.MALFORMED}
    assert repr(found[1]).startswith("Result(instance=Instance('open-straight'), verdict=malformed, ")
    for wrong, said in (
        ({"command": "true -v"}, "its arguments are texts of their own"),
        ({"command": [["true"] * 1000]}, "a planner is"),
        ({"instances": "narow"}, "did you mean narrow"),
        ({"timeout": 0}, "timeout is 0"),
        ({"memory": "much"}, "memory is 'much'"),
        ({"workers": 0}, "workers is 0"),
    ):
        with pytest.raises(CglaError, match=re.escape(said)) as caught:
            comparisons.conform(**{"command": "true", **wrong})
        assert len(str(caught.value)) < 300


def test_a_tolerance_refuses_paths_that_cost_too_much(call: Call) -> None:
    planner = ("--", sys.executable, EXAMPLES / "astar.py")
    answer = call("conform", "--instances", "walls-along", "--tolerance", "0.01", *planner)
    assert answer.code == 1
    assert "more than 1 % over the best path known: walls-along" in answer.out
    assert call("conform", "--instances", "walls-along", "--tolerance", "0.1", *planner).code == 0


def test_a_contradiction_is_loud(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """A bound that is false on purpose."""
    from cgla_graph.comparisons.conformance import report as command  # noqa: PLC0415 - to be patched

    (one,) = chosen(["open-straight"])
    false = one.model_copy(update={"lower_bound": 2.0, "upper_bound": 2.0})
    monkeypatch.setattr(command, "chosen", lambda _: [false])
    planner = ("--", sys.executable, "-c", "print('{\"path\": [[0.05, 0.5], [0.95, 0.5]]}')")
    answer = call("conform", *planner)
    assert answer.code == 1
    assert "IMPOSSIBLE" in answer.err
    assert "please report it" in answer.err


def test_what_is_done_is_kept_when_it_is_interrupted(call: Call, tmp_path: Path) -> None:
    """The first instance is answered; the second interrupts who asks."""
    planner = tmp_path / "planner.py"
    planner.write_text(
        "import json, os, signal, sys, time\n"
        "if json.load(sys.stdin)['name'] == 'infeasible-ring':\n"
        f"    os.kill({os.getpid()}, signal.SIGINT)\n    time.sleep(60)\n"
        "print('{\"path\": null}')\n",
        encoding="utf-8",
    )
    answer = call(
        "conform", "--instances", "infeasible-wall,infeasible-ring", "--out", "here.json", "--", sys.executable, planner
    )
    assert answer.code == 130
    assert "1 of 2 instances are done" in answer.err
    document = json.loads(Path("here.json").read_text(encoding="utf-8"))
    assert (document["asked"], document["right"], document["passed"]) == (2, 1, False)
