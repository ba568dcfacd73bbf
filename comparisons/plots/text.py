"""Text of pictures: names, costs and headings, each in one line that the font can draw."""

import unicodedata
from functools import cache
from pathlib import Path

import matplotlib as mpl
from matplotlib.font_manager import get_font

from cgla_graph.comparisons.numbers import counted
from cgla_graph.comparisons.plots.looks import Entry
from cgla_graph.comparisons.study.median_run import seeds_note
from cgla_graph.scenarios.scenario import Scenario


def heading(scenario: Scenario) -> tuple[str, str]:
    """
    Return name and risk weight, and the title.

    Parameters
    ----------
    scenario
        The map.

    Returns
    -------
    name, title
        One line each; the title may be empty.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> heading(load_scenario("one-threat"))[0]
    'one-threat,  k = 10'
    """
    return f"{plain(scenario.name, 48)},  k = {scenario.problem.k:g}", plain(scenario.title, 160)


def cost_label(entry: Entry, scale: float) -> str:
    """
    Say what a solver found, in one line of the legend.

    Parameters
    ----------
    entry
        The solver.
    scale
        What costs are multiplied with.

    Returns
    -------
    text
        Its label, the cost of the run that is shown or why there is none, and which of its seeds that is.
    """
    solution = entry.shown.solution
    found = cost_text(solution.cost * scale) if solution.status.has_path else solution.status.label
    return f"{plain(entry.label, 36)}: {found}{seeds_note(entry.n_runs, entry.n_found)}"


def others_label(number: int, what: str = "") -> str:
    """
    Count solvers that share a line of the legend.

    Parameters
    ----------
    number
        How many they are.
    what
        What they have in common; may be empty.

    Examples
    --------
    >>> others_label(24), others_label(1, "without a path")
    ('24 others', '1 other, without a path')
    """
    return f"{counted(number, 'other')}{what and f', {what}'}"


def cost_text(value: float) -> str:
    """
    Write a cost with five significant digits.

    Parameters
    ----------
    value
        The cost, in the unit that is shown.

    Returns
    -------
    text
        Without an exponent below 10⁹, as digits still read better there; trailing zeros stay.

    Examples
    --------
    >>> cost_text(1.50361), cost_text(1355742.7), cost_text(63)
    ('1.5036', '1355700', '63.000')
    """
    if 1e5 <= abs(value) < 1e9:  # noqa: PLR2004 - where %g would write an exponent, and digits still read better
        return f"{float(f'{value:.5g}'):.0f}"
    return f"{value:#.5g}".rstrip(".")


def plain(text: str, most: int) -> str:
    r"""
    Make one short line of any text; what the font lacks becomes a replacement character, the middle gives way first.

    Parameters
    ----------
    text
        Anything: names come from files of others.
    most
        Characters that the line may have.

    Returns
    -------
    line
        At most that long, without line breaks or control characters.

    Examples
    --------
    >>> plain("of\n$x$ \N{ROBOT FACE}", 40), plain("rrt-star:iterations=2000", 15)
    ('of $x$ �', 'rrt-sta…ns=2000')
    """
    visible = []
    for char in text[: 50 * most]:
        kind = unicodedata.category(char)
        if char.isspace() or kind == "Cc":
            visible.append(" ")
        elif kind not in {"Cf", "Me", "Mn"} or ord(char) in _glyphs():
            visible.append(char if ord(char) in _glyphs() else "\N{REPLACEMENT CHARACTER}")
    line = " ".join("".join(visible).split())
    head = most // 2
    return line if len(line) <= most else f"{line[:head]}…{line[len(line) - (most - head - 1) :]}"


@cache
def _glyphs() -> frozenset[int]:
    """Return the characters that the font can draw."""
    font = get_font(str(Path(mpl.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")))
    return frozenset(int(code) for code in font.get_charmap())
