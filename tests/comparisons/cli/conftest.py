"""Fixture of the command line, shared by its tests."""

from pathlib import Path

import pytest
from command_line import Call, caller


@pytest.fixture
def cgla(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str], request: pytest.FixtureRequest
) -> Call:
    """Call the command line in this process, in a folder with the `FILES` of the test module."""
    for name, text in getattr(request.module, "FILES", {}).items():
        (tmp_path / name).write_text(text, encoding="utf-8")
    return caller(tmp_path, monkeypatch, capfd)
