"""Tables fit: at every width their numbers are whole, and what there is no room for is named."""

import os
import re
import struct
import subprocess
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path

import pytest
from command_line import Call, caller
from hypothesis import given
from hypothesis import strategies as st
from missions_small import CROSSING, flown_of
from programs import program
from rich.cells import cell_len
from rich.console import RenderableType
from strategies import few

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons import console
from cgla_graph.comparisons.missions.tables import flight_table, variants_table
from cgla_graph.comparisons.results import study_output
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.comparisons.tables.fronts import front_table
from cgla_graph.comparisons.tables.tables import comparison_table
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers.trade_off.front import Front, FrontPoint

WIDTHS = [80, 100, 120, 160]
SCENARIO = load_scenario("finland")


def runs() -> list[Run]:
    """Make up runs on a map in metres, with long names and long numbers."""
    proof = Certificate(218765.4321, 223456.789, 0.005, 781.25, 9, "the reason", 0.4)
    labels = ["informed-rrt-star:iterations=2000", "refine", "straight-line"]
    found = []
    for number, label in enumerate(labels):
        for seed in (1, 2, 3):
            cost = 223456.789 * (1.0 + 0.9 * number) + 1000.0 * seed
            answer = Solution(
                Status.FOUND if number < 2 or seed == 1 else Status.TIMED_OUT,
                cost=cost,
                length=cost - 100.0,
                risk=0.001234 + number,
                clearance=1234.5 * number,
                lower_bound=218765.4321,
                seconds=0.1234 * seed,
                build_seconds=0.0567,
                evaluations=1234567 * seed,
            )
            found.append(Run(SCENARIO, label, seed, exact=False, solution=answer, certificate=proof))
    return found


def front() -> Front:
    answers = {i: Solution(Status.FOUND, cost=3e5, length=223456.7 + i, risk=5e4 / 10**i) for i in range(-3, 6)}
    points = [FrontPoint(10.0**i, 10.0 ** (i + 1), 10.0**i, answer) for i, answer in answers.items()]
    return Front(tuple(points), Status.FOUND, 0.001, 1e6, 99)


def lines_of(text: str) -> tuple[list[str], list[list[str]]]:
    """Return the heads and the cells of the only table of a text."""
    (heads,) = ([head.strip() for head in line.strip("┃").split("┃")] for line in text.splitlines() if line[:1] == "┃")
    rows = ([cell.strip() for cell in line.strip("│").split("│")] for line in text.splitlines() if line[:1] == "│")
    return heads, list(rows)


def assert_fits(table: FittedTable, text: str, width: int) -> None:
    """Check that a printed table has whole numbers and names what it leaves out."""
    assert max(cell_len(line) for line in text.splitlines()) <= width
    heads, rows = lines_of(text)
    every = [*table.left, *table.right]
    missing = [head for head in every if head not in heads]
    assert heads == [head for head in every if head not in missing]
    assert set(missing) == set(table.spare[: len(missing)])
    assert (" ".join(text.split()).endswith(f"too narrow for: {', '.join(missing)}")) is bool(missing)
    for column, head in enumerate(heads):
        if head in table.right:
            numbers = [line for row in table.rows for line in row[every.index(head)].splitlines()]
            assert [row[column] for row in rows if row[column]] == numbers
        else:
            # folded words lose the space that they are folded at
            words = "".join(row[column] for row in rows).replace(" ", "")
            assert words == "".join(row[every.index(head)] for row in table.rows).replace(" ", "")


def shown(capfd: pytest.CaptureFixture[str], table: RenderableType) -> str:
    console.out_table(table)
    return capfd.readouterr().out


@pytest.fixture(params=["COLUMNS", "the terminal"])
def set_width(request: pytest.FixtureRequest, monkeypatch: pytest.MonkeyPatch) -> Callable[[int], None]:
    """Return what sets the width: by the environment variable, or of the terminal."""

    def by_variable(width: int) -> None:
        monkeypatch.setenv("COLUMNS", str(width))

    def by_terminal(width: int) -> None:
        monkeypatch.delenv("COLUMNS", raising=False)
        monkeypatch.setattr(os, "get_terminal_size", lambda *_: os.terminal_size((width, 24)))

    return by_variable if request.param == "COLUMNS" else by_terminal


def tables(folder: Path) -> Iterator[FittedTable]:
    yield comparison_table(SCENARIO, runs())
    yield front_table(SCENARIO, Entrant.parse("hybrid"), front())
    flights = flown_of(CROSSING, folder)
    yield from (*map(flight_table, flights), variants_table(flights))


@pytest.fixture(scope="module")
def every_table(tmp_path_factory: pytest.TempPathFactory) -> list[FittedTable]:
    return list(tables(tmp_path_factory.mktemp("flights")))


@pytest.mark.parametrize("width", WIDTHS)
def test_tables_fit(
    set_width: Callable[[int], None], width: int, every_table: list[FittedTable], capfd: pytest.CaptureFixture[str]
) -> None:
    set_width(width)
    for table in every_table:
        assert_fits(table, shown(capfd, table), width)


@pytest.mark.parametrize("width", WIDTHS)
def test_a_comparison_fits(set_width: Callable[[int], None], width: int, capfd: pytest.CaptureFixture[str]) -> None:
    set_width(width)
    study_output.print_comparison(runs(), [])
    text = capfd.readouterr().out
    assert "how soon" in text
    assert "…" not in text
    assert max(cell_len(line) for line in text.splitlines()) <= width
    # the median run of each: its cost, gap and time
    for cell in ("225457", "+3.06 %", "247 ms", "found 1/3"):
        assert f" {cell} │" in text or f"│ {cell} " in text


def test_the_less_important_columns_go_first(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    table, before = comparison_table(SCENARIO, runs()), 0
    for width in range(40, 200, 5):
        monkeypatch.setenv("COLUMNS", str(width))
        heads, _ = lines_of(shown(capfd, table))
        assert {"solver", "status", "cost"} <= set(heads)
        assert len(heads) >= before
        before = len(heads)
    assert before == 12


@pytest.mark.parametrize("columns", ["", "wide", "0", "-5"])
def test_without_a_terminal_and_without_a_number_the_page_is_wide(
    columns: str, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setenv("COLUMNS", columns)
    text = shown(capfd, front_table(SCENARIO, Entrant.parse("hybrid"), front()))
    assert "too narrow" not in text
    assert max(cell_len(line) for line in text.splitlines()) <= 160


def test_a_dumb_terminal_is_as_wide_as_it_says(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    for key, value in {"TERM": "dumb", "FORCE_COLOR": "1", "COLUMNS": "160"}.items():
        monkeypatch.setenv(key, value)
    assert max(cell_len(line) for line in shown(capfd, comparison_table(SCENARIO, runs())).splitlines()) > 100


@few
@given(
    width=st.integers(1, 90),
    numbers=st.lists(st.floats(1e-6, 1e12).map(lambda value: f"{value:.6g}"), min_size=1, max_size=9),
)
def test_where_nothing_helps_numbers_run_over(width: int, numbers: Sequence[str]) -> None:
    heads = [f"n{index}" for index in range(len(numbers))]
    table = FittedTable("t", ("name",), heads, heads[1:], rows=[["a long name with words", *numbers]])
    with pytest.MonkeyPatch.context() as patch:
        patch.setenv("COLUMNS", str(width))
        written: list[str] = []
        patch.setattr(console, "_write", written.append)
        console.out_table(table)
    _, rows = lines_of("".join(written))
    assert rows[0][1] == numbers[0]
    assert "…" not in "".join(written)


@pytest.fixture
def call(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize(
    "words",
    [
        ("compare", "one-threat", "--solvers", "straight-line,eight-direction", "--tolerance", 0.1),
        ("compare", "one-threat", "paper", "--solvers", "straight-line,eight-direction", "--no-certificate"),
        ("plan", "one-threat", "--solver", "straight-line", "--no-certificate"),
        ("pareto", "one-threat", "--solver", "eight-direction", "--resolution", 5),
        ("certify", "one-threat", "--tolerance", 0.1, "--resolution", 5),
        ("solvers",),
        ("scenarios",),
        ("missions",),
    ],
    ids=lambda words: " ".join(map(str, words[:2])),
)
def test_commands_cut_nothing(
    call: Call, monkeypatch: pytest.MonkeyPatch, words: tuple[object, ...], width: int
) -> None:
    monkeypatch.setenv("COLUMNS", str(width))
    answer = call(*words)
    assert answer.code == 0, answer.err
    assert "…" not in answer.out
    ruled = [line for line in answer.out.splitlines() if line[:1] in "┏┃┡│└"]
    assert all(cell_len(line) <= width for line in ruled)


def test_names_in_listings_can_be_copied(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", "80")
    text = call("solvers").out
    for name in ("informed-rrt-star", "visibility-graph", "eight-direction"):
        assert f"│ {name} " in text


@pytest.mark.slow
@pytest.mark.skipif(sys.platform == "win32", reason="there are no such terminals")
@pytest.mark.parametrize("width", [80, 120])
def test_a_real_terminal(width: int, tmp_path: Path) -> None:
    import fcntl  # noqa: PLC0415 - not on Windows
    import termios  # noqa: PLC0415 - the same

    first, second = os.openpty()
    fcntl.ioctl(second, termios.TIOCSWINSZ, struct.pack("HHHH", 24, width, 0, 0))
    words = ["compare", "one-threat", "--solvers", "straight-line,informed-rrt-star:iterations=20", "--workers", "0"]
    command = [sys.executable, "-m", "cgla_graph.comparisons", *words]
    plain = {key: value for key, value in os.environ.items() if key not in {"COLUMNS", "FORCE_COLOR", "NO_COLOR"}}
    with program(command, cwd=tmp_path, stdout=second, stderr=subprocess.DEVNULL, env=plain) as process:
        os.close(second)
        text = re.sub(r"\x1b\[[0-9;]*m", "", _read_all(first))
    assert process.returncode == 0
    ruled = [cell_len(line) for line in text.splitlines() if line[:1] in "┏┃┡│└"]
    assert width - 25 < max(ruled) <= width
    assert "…" not in text
    assert "too narrow for: " in text


def _read_all(terminal_end: int) -> str:
    """Read a terminal until its writers have closed it."""
    with os.fdopen(terminal_end, "rb", buffering=0) as file:
        parts = []
        # a terminal without writers raises an error instead of ending
        with suppress(OSError):
            while part := file.read(65536):
                parts.append(part)
    return b"".join(parts).decode()
