"""The blocks of the README and of the manual run, each by itself, and print what the page says."""

from pathlib import Path
from typing import Any

import pytest
from command_line import caller
from pages import BLOCKS, PAGES, Block, agrees, calls, put_files


def chosen(language: str) -> list[Any]:
    """Give the blocks of one language to a test: those that are slow, and all of the manual, with the marker."""
    return [
        pytest.param(block, id=block.place, marks=[pytest.mark.slow] if is_slow(block) else [])
        for block in BLOCKS
        if block.language == language and block.note("not run") is None
    ]


def is_slow(block: Block) -> bool:
    """Tell whether a block is left to `make check`: those of the entrance are not, but for some."""
    return block.note("slow") is not None or block.page != PAGES[0]


@pytest.mark.parametrize("block", chosen("python"))
def test_python_runs_by_itself_and_prints_what_the_page_says(
    block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    put_files(block.page, tmp_path)
    monkeypatch.chdir(tmp_path)
    exec(compile(block.text, block.place, "exec"), {"__name__": "reader"})  # noqa: S102 - our own text

    printed = capsys.readouterr().out
    assert agrees(block.output or "", printed), printed


@pytest.mark.parametrize("block", chosen("sh"))
def test_commands_run_by_themselves_and_print_what_the_page_says(
    block: Block, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """In a folder that holds the files of the page, and at the width that outputs of the manual have."""
    put_files(block.page, tmp_path)
    call = caller(tmp_path, monkeypatch, capfd)
    monkeypatch.setenv("COLUMNS", "100")
    printed = ""
    for words in calls(block):
        if words[0] != "cgla":
            continue
        target = words[words.index(">") + 1] if ">" in words else None
        answer = call(*words[1 : words.index(">") if ">" in words else None])
        assert answer.code == 0, answer.err
        printed += answer.out
        if target is not None:
            (tmp_path / target).write_text(answer.out, encoding="utf-8")

    assert block.output is None or agrees(block.output, printed), printed
