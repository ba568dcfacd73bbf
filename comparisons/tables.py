"""Tables for the terminal."""

import math
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

from rich.table import Table
from rich.text import Text

from cgla_graph.comparisons.rows import Summary, summaries
from cgla_graph.comparisons.runner import Run
from cgla_graph.scenario import Scenario

#: Numbers from here on are written with an exponent.
MOST_DIGITS = 1e12


def comparison_table(scenario: Scenario, runs: Sequence[Run]) -> Table:
    """Show one scenario: a line a solver, cheapest first. Names appear as they are: no markup, no emoji codes."""
    unit = "m" if scenario.projection else "map units"
    title = f"{scenario.full_title} (k = {scenario.problem.k:g}, lengths in {unit})"
    table = Table(title=Text(title), title_justify="left", title_style="bold", caption_justify="left")
    table.add_column("solver", no_wrap=True)
    table.add_column("status", no_wrap=True)
    heads = ("cost", "excess", "length", "risk", "clearance", "time", "build", "evaluations", "seed spread")
    for head in heads:
        table.add_column(head, justify="right", no_wrap=True)
    remarks = []
    for summary in summaries(runs):
        table.add_row(*(Text(cell) for cell in _cells(summary)))
        if summary.message and not _is_quiet(summary):
            remarks.append(f"{summary.solver}: {summary.message}")
    notes = [
        "excess: over the best exact optimum on the lattice; time: to solve; build: to weigh and hand over the graph",
        "evaluations: pairs of points whose cost was asked for",
        "of several seeds: the median run, and in seed spread how much dearer the dearest is than the cheapest",
    ]
    table.caption = Text("\n".join(notes + remarks))
    return table


def _is_quiet(summary: Summary) -> bool:
    """Say whether an answer needs no remark."""
    return summary.status in {"optimal", "found"}


def _cells(summary: Summary) -> list[str]:
    return [
        summary.solver,
        summary.status,
        figure(summary.cost, 6),
        percent(summary.excess),
        figure(summary.length, 6),
        figure(summary.risk, 4),
        figure(summary.clearance, 3),
        duration(summary.seconds),
        duration(summary.build_seconds) if summary.build_seconds else "-",
        f"{summary.evaluations:,.0f}",
        percent(summary.spread) if not math.isnan(summary.spread) else "-",
    ]


def figure(value: float, digits: int) -> str:
    """
    Write a number with some significant digits, all of those before the point; a dash where there is none.

    Examples
    --------
    >>> figure(1.50547714, 6), figure(4805.02, 3), figure(float("inf"), 6)
    ('1.50548', '4805', '-')
    """
    if not math.isfinite(value):
        return "-"
    text = f"{value:#.{digits}g}".rstrip(".")
    return f"{value:.0f}" if "e+" in text and abs(value) < MOST_DIGITS else text


def percent(value: float) -> str:
    """
    Write a ratio as a percentage; a dash where there is none.

    Examples
    --------
    >>> percent(0.0404), percent(-1e-16)
    ('+4.04 %', '+0.00 %')
    """
    return f"{100.0 * value + 0.0:+.2f} %".replace("-0.00", "+0.00") if math.isfinite(value) else "-"


def duration(seconds: float) -> str:
    """
    Write a time in a unit that suits it.

    Examples
    --------
    >>> duration(0.000123), duration(2.5)
    ('0.123 ms', '2.50 s')
    """
    milliseconds = f"{1e3 * seconds:.3g}"
    return f"{seconds:.2f} s" if "e+" in milliseconds or seconds >= 1.0 else f"{milliseconds} ms"


def listing(title: str, heads: Sequence[str], lines: Iterable[Mapping[str, Any]]) -> Table:
    """Show records as a plain table, one column for each head."""
    table = Table(title=title, title_justify="left", title_style="bold")
    for head in heads:
        table.add_column(head, overflow="fold")
    for line in lines:
        table.add_row(*(Text(str(line[head])) for head in heads))
    return table
