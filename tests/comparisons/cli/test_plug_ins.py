"""Plug-ins on the command line: a command survives their faults and reports them."""

from pathlib import Path

import plug_ins
import pytest
from command_line import Call, caller

from cgla_graph.model import isolated


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    plug_ins.install(tmp_path, monkeypatch)
    return caller(tmp_path, monkeypatch, capfd)


@pytest.mark.parametrize(
    ("solver", "status", "message"),
    [
        ("leaves", "crashed", "its process left with the exit code 0, and this one goes on; try another solver"),
        ("exits", "failed", "RuntimeError: KeyboardInterrupt"),
        ("dirties", "failed", "dirties changed its problem (k); have it work on a copy"),
    ],
)
def test_a_plan_survives_its_solver(solver: str, status: str, message: str, cgla: Call) -> None:
    answer = cgla("plan", "one-threat", "--solver", solver, "--no-certificate", "--json")
    assert answer.code == 1
    found = answer.document()
    assert (found["status"], found["message"]) == (status, message)


def test_a_plan_that_hangs_is_stopped(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """The solver hangs in compiled code and holds the lock of the interpreter."""
    monkeypatch.setattr(isolated, "LONGEST", 0.5)
    answer = cgla("plan", "one-threat", "--solver", "hangs", "--no-certificate")
    assert answer.code == 1
    assert "stopped after 0.5 s, the most without a setting `seconds`; try another solver" in answer.out


@pytest.mark.slow
def test_other_commands_survive_it_too(cgla: Call) -> None:
    assert "crashed" in cgla("pareto", "one-threat", "--solver", "leaves").out
    assert "its process left with the exit code 0" in cgla("fly", "fig4", "--solver", "leaves", "--json").out
    for words in (["plan", "one-threat", "--max-risk", "1", "--no-certificate"], ["pareto", "one-threat"]):
        answer = cgla(*words, "--solver", "raises", "--json")
        assert (answer.code, answer.err) == (1, "")
        assert answer.document()["status"] == "failed"
        assert "ValueError: not today" in answer.document()["message"]
