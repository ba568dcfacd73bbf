"""The doors to standard output and standard error: no text of others steers the terminal."""

import io
import json
import sys
import unicodedata
from collections.abc import Callable

import pytest
from hypothesis import example, given
from hypothesis import strategies as st
from rich.text import Text

from cgla_graph import _progress
from cgla_graph._text import MOST_OF_MESSAGE, printable, remark
from cgla_graph.comparisons import console
from cgla_graph.comparisons.console import listing
from cgla_graph.comparisons.tables.fitted_table import FittedTable

#: Texts with what steers terminals: colours, titles, the bell, NUL, C1 controls, directions, tags, lone surrogates.
HOSTILE = "\x1b[31mred\x1b]0;title\x07 \x00\x9b2J \u202edetrever\u2069 \ud800 \U000e0041 [bold]markup[/] :smile:"
texts = st.text(st.characters(categories=["Cc", "Cf", "Cs", "Lu", "Zl", "Zp", "Zs", "Po"]), max_size=20)
hostile = pytest.mark.parametrize("text", [HOSTILE, HOSTILE + "\n" + HOSTILE])


def steers(text: str) -> set[str]:
    """Return the characters of a text that a terminal may act on."""
    # (joiners between letters, and Arabic signs above numbers, are seen)
    kinds = {"Cc", "Zl", "Zp", "Cs"}
    odd = {one for one in text if unicodedata.category(one) in kinds or unicodedata.bidirectional(one) in BIDI}
    return odd - {"\n", "\t"}


BIDI = {"LRE", "RLE", "LRO", "RLO", "PDF", "LRI", "RLI", "FSI", "PDI"}


@given(texts)
@example(HOSTILE)
def test_printable_text_steers_nothing_and_is_stable(text: str) -> None:
    shown = printable(text)
    assert not steers(shown)
    assert printable(shown) == shown
    assert len(shown) >= len(text)
    shown.encode()


@given(texts, st.integers(0, 3000))
@example(HOSTILE, 100_000)
def test_a_remark_is_one_short_line(text: str, times: int) -> None:
    said = remark(text * times)
    assert len(said) <= MOST_OF_MESSAGE
    assert len(said.splitlines()) <= 1
    assert not steers(said)


def written(door: Callable[[], object]) -> str:
    """Return what a door writes to standard output and standard error."""
    with pytest.MonkeyPatch.context() as patch:
        stream = io.StringIO()
        patch.setattr(sys, "stdout", stream)
        patch.setattr(sys, "stderr", stream)
        door()
    return stream.getvalue()


@hostile
@pytest.mark.parametrize(
    "door",
    [
        console.out,
        console.say,
        lambda text: console.out_lines({"remark": text}),
        lambda text: console.out_json({"key": text, text: "value"}),
        lambda text: console.out_table(FittedTable(text, (text,), (), rows=[[text]], notes=[text])),
        lambda text: console.out_table(listing("t", ["name"], [{"name": text}])),
        lambda text: console.out_table(Text(text)),
    ],
    ids=["out", "say", "out_lines", "out_json", "FittedTable", "listing", "out_table"],
)
def test_no_door_lets_text_steer_the_terminal(door: Callable[[str], object], text: str) -> None:
    found = written(lambda: door(text))
    assert not steers(found)
    assert "red" in found
    assert "[bold]markup" in found.replace("\n", "")


@hostile
def test_lines_and_progress_of_hostile_names_stay_one_line(text: str) -> None:
    assert len(written(lambda: console.out_lines({"remark": text})).splitlines()) == 1
    line = _progress._Line(text, 1, 0, 0.0)
    line.tell(text)
    assert not steers(line.text())
    assert "\n" not in line.text()


@given(texts)
@example(HOSTILE)
def test_json_reads_the_same(text: str) -> None:
    shown = console.json_text({"text": text, "key " + text: [text]})
    assert not steers(shown)
    assert json.loads(shown) == {"text": text, "key " + text: [text]}
