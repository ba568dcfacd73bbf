"""How tests call the command line: in a folder of their own, in this process."""

import gc
import json
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, TypeAlias

import pytest
import typer.main

from cgla_graph.comparisons.cli.app import main
from cgla_graph.comparisons.console import COMPILING

#: Commands and options are read off the functions once, not for every call.
_command = cache(typer.main.get_command)


def without_compiling(messages: str) -> str:
    """Leave out the line on compiling: which kernels are compiled already depends on the tests before."""
    return messages.replace(f"{COMPILING}\n", "")


class Answer(NamedTuple):
    """How a call of the command line ended, and what it wrote."""

    code: int
    out: str
    err: str

    def document(self) -> Any:  # noqa: ANN401 - any JSON
        """Read standard output as one strict JSON document, with nothing around it."""
        assert self.out.startswith("{")
        return json.loads(self.out, parse_constant=lambda text: pytest.fail(f"{text} is no JSON"))

    def refused(self, *words: str) -> None:
        """Check that the input was refused: one line on standard error that says what is wrong."""
        assert (self.code, self.out) == (2, ""), self.err
        assert self.err.startswith("cgla: ")
        assert self.err.count("\n") == 1
        assert self.err.endswith("\n")
        assert not [word for word in words if word.lower() not in self.err.lower()], self.err


Call: TypeAlias = Callable[..., Answer]


def caller(folder: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    """
    Return what calls the command line in a folder, with a wide terminal.

    Comparisons are made in this process, where a test's own solvers are known, unless the call says otherwise.
    """
    monkeypatch.chdir(folder)
    monkeypatch.setenv("COLUMNS", "200")
    monkeypatch.setattr(typer.main, "get_command", _command)
    # the command line keeps its process's garbage collector from what is there for good: here the tests have done that
    for name in ("freeze", "unfreeze"):
        monkeypatch.setattr(gc, name, lambda: None)

    def call(*words: object) -> Answer:
        here = ["--workers", 0] if words[:1] == ("compare",) and "--workers" not in words else []
        monkeypatch.setattr(sys, "argv", ["cgla", *map(str, [*words, *here])])
        with pytest.raises(SystemExit) as left:
            main()
        captured = capfd.readouterr()
        assert "Traceback" not in captured.err
        assert isinstance(left.value.code, int)
        # (which of the tests comes first, and has kernels compiled, nobody knows)
        return Answer(left.value.code, captured.out, without_compiling(captured.err))

    return call


@pytest.fixture
def cgla(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> Call:
    """Call the command line in this process, in a folder with the `FILES` of the test module."""
    for name, text in getattr(request.module, "FILES", {}).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return caller(tmp_path, monkeypatch, capfd)
