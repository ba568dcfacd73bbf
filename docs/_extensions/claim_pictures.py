"""Effects of claims with their intervals, read from the shipped verdicts, against what the tests hold them to."""

import re
import textwrap
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import matplotlib.pyplot as plt
from drawing import BLUE, GREEN, GREY, ORANGE
from matplotlib.axes import Axes
from matplotlib.ticker import NullFormatter, ScalarFormatter

from cgla_graph.comparisons.claims import summary

COLOURS = {"supported": BLUE, "contradicted": ORANGE, "undecided": GREY}
#: Letters of a row's label on a line; sizes that differ by more than this are shown on a logarithmic axis.
LETTERS, WIDE = 62, 6.0

_NUMBER = r"(\d+(?:\.\d+)?)(?: ?%)?"
#: ``1.92 to 2.33, 95 % within 1.75 to 2.56``, ``53% (43% to 62%)``, ``0.01 to 0.13 (95 % within 0.0012 to 0.18)``.
_SIZE = re.compile(
    rf"{_NUMBER}(?: to {_NUMBER})?(?: less| more)?(?:, 95 % (?:within )?| \((?:95 % within )?){_NUMBER} to {_NUMBER}"
)
#: ``5 more than 3``, ``more without than with``: of two rates, which is which.
_COMPARED = re.compile(r"(.*)more (.*?) ?than (.+)")


@dataclass(frozen=True)
class Row:
    """An effect: what it is of, its verdict, from where to where it and its interval go, and the paper's own sizes."""

    label: str
    verdict: str
    effect: tuple[float, float]
    interval: tuple[float, float]
    printed: tuple[float, ...] = ()


@dataclass(frozen=True)
class Panel:
    """Rows over one axis, and what the tests hold them against."""

    axis: str
    bar: tuple[float, ...]
    rows: tuple[Row, ...]


def rows_of(part: Mapping[str, Any]) -> list[Row]:
    """
    Read the sizes of a part; none where no interval stands with them.

    >>> part = {"statement": "less risk", "condition": "", "verdict": "supported", "printed": "3.83 and 4.58"}
    >>> effect = "K = 10 over 50: 1.9 to 2.3, 95 % within 1.7 to 2.6; K = 50: 1, 95 % 0.9 to 2"
    >>> for row in rows_of({**part, "effect": effect}):
    ...     print(row.label, row.effect, row.interval, row.printed)
    less risk, K = 10 over 50 (1.9, 2.3) (1.7, 2.6) (3.83,)
    less risk, K = 50 (1.0, 1.0) (0.9, 2.0) (4.58,)
    """
    sizes = [(piece, found) for piece in re.split(r"; | against ", part["effect"]) if (found := _SIZE.search(piece))]
    printed = tuple(float(number) for number in re.findall(r"\b\d+(?:\.\d+)?\b", part["printed"]))
    said = " ".join(filter(None, [part["statement"], part["condition"]]))
    compared = _COMPARED.fullmatch(part["statement"]) if " against " in part["effect"] else None
    rows = []
    for at, (piece, found) in enumerate(sizes):
        first, last, low, high = found.groups()
        what = piece[: found.start()].partition(": ")[0].strip() if ": " in piece[: found.start()] else ""
        if compared:
            what = (compared[1] or compared[2], compared[3])[at % 2].strip()
        own = printed[at : at + 1] if len(sizes) == len(printed) else printed
        label = ", ".join(filter(None, [said, what]))
        rows.append(Row(label, part["verdict"], (float(first), float(last or first)), (float(low), float(high)), own))
    return rows


def panels_of(document: Mapping[str, Any], axes: Mapping[str, Sequence[Mapping[str, Any]]]) -> dict[str, list[Panel]]:
    """
    Lay all rows out over the axes that are told of.

    Raises
    ------
    ValueError
        If a size has no axis or several, or an axis no size.
    """
    found: dict[str, list[Panel]] = {}
    for claim in document["claims"]:
        wanted = axes.get(claim["id"], [])
        taken: list[list[Row]] = [[] for _ in wanted]
        for part in claim["parts"]:
            if not (rows := rows_of(part)):
                continue
            said = f"{part['statement']} {part['condition']}"
            fit = [at for at, axis in enumerate(wanted) if axis.get("of", "") in said]
            if len(fit) != 1:
                msg = f"{claim['id']}, {said.strip() or 'its sentence'}: {len(fit)} axes are told; tell one"
                raise ValueError(msg)
            taken[fit[0]] += rows
        if not all(taken):
            msg = f"{claim['id']}: an axis has no size on it; take it away"
            raise ValueError(msg)
        if wanted:
            each = zip(wanted, taken, strict=True)
            found[claim["id"]] = [Panel(axis["axis"], tuple(axis.get("bar", ())), tuple(rows)) for axis, rows in each]
    if unknown := set(axes) - set(found):
        msg = f"there are no claims {', '.join(sorted(unknown))}"
        raise ValueError(msg)
    return found


def in_words(name: str, panels: Sequence[Panel]) -> str:
    """Say what a picture shows, for who does not see it; nothing where there is none."""
    said = []
    for panel in panels:
        rows = [
            f"{row.label or 'the claim'}, {row.verdict}: {_span(row.effect)}, 95 % within {_span(row.interval)}"
            for row in panel.rows
        ]
        held = f", held against {' and '.join(f'{bar:g}' for bar in panel.bar)}" if panel.bar else ""
        said.append(f"{panel.axis}{held}: {'; '.join(rows)}")
    return f"Effects of {name} with their intervals. {'. '.join(said)}." if said else ""


def _span(ends: tuple[float, float]) -> str:
    return f"{ends[0]:g}" if ends[0] == ends[1] else f"{ends[0]:g} to {ends[1]:g}"


def draw(panels: Mapping[str, Sequence[Panel]], folder: Path, axes_file: Path) -> None:
    """Draw what is older than what it is made of."""
    sources = (axes_file, Path(__file__), Path(summary.__file__).with_name(summary.FILE))
    changed = max(source.stat().st_mtime for source in sources)
    for name, every in panels.items():
        path = folder / f"{name}.png"
        if not path.is_file() or path.stat().st_mtime < changed:
            _draw(every, path)


def _draw(panels: Sequence[Panel], path: Path) -> None:
    lines = [sum(_lines(row) for row in panel.rows) for panel in panels]
    heights = [0.75 + 0.19 * count + 0.1 * len(panel.rows) for panel, count in zip(panels, lines, strict=True)]
    figure, axes = plt.subplots(
        len(panels), 1, figsize=(7.6, sum(heights)), height_ratios=heights, squeeze=False, layout="constrained"
    )
    for one, panel in zip(axes[:, 0], panels, strict=True):
        _draw_panel(one, panel)
    figure.savefig(path, dpi=120)
    plt.close(figure)


def _lines(row: Row) -> int:
    return max(2, len(_wrapped(row)))


def _wrapped(row: Row) -> list[str]:
    return [*textwrap.wrap(row.label, LETTERS), row.verdict]


def _draw_panel(axes: Axes, panel: Panel) -> None:
    places, below = [], 0.0
    for row in panel.rows:
        places.append(below + 0.5 * _lines(row))
        below += _lines(row) + 0.5
    for bar in panel.bar:
        axes.axvline(bar, color="black", linewidth=1.0, linestyle="--", zorder=1)
    for row, place in zip(panel.rows, places, strict=True):
        colour = COLOURS.get(row.verdict, GREEN)
        axes.plot(row.interval, (place, place), color=colour, linewidth=1.4, marker="|", markersize=7, zorder=2)
        axes.plot(row.effect, (place, place), color=colour, linewidth=5.0, marker="o", markersize=6, zorder=3)
        axes.plot(row.printed, [place] * len(row.printed), "x", color="black", markersize=7, zorder=4)
    sizes = [size for row in panel.rows for size in (*row.effect, *row.interval, *row.printed)]
    if min(sizes) > 0.0 and max(sizes) > WIDE * min(sizes):
        axes.set_xscale("log")
        axes.xaxis.set_major_formatter(ScalarFormatter())
        axes.xaxis.set_minor_formatter(ScalarFormatter() if max(sizes) < 30.0 * min(sizes) else NullFormatter())
        axes.tick_params(axis="x", which="minor", labelsize=7)
    axes.set_yticks(places, ["\n".join(_wrapped(row)) for row in panel.rows], fontsize=8)
    for label, row in zip(axes.get_yticklabels(), panel.rows, strict=True):
        label.set_color("black" if row.verdict in COLOURS else GREEN)
    axes.set_ylim(below - 0.25, -0.25)
    axes.set_xlabel(panel.axis, fontsize=8.5)
    axes.tick_params(axis="x", labelsize=8)
    axes.margins(x=0.06)
    for side in ("top", "right", "left"):
        axes.spines[side].set_visible(False)
    axes.tick_params(axis="y", length=0)
    axes.grid(axis="x", color="0.9", linewidth=0.6)
    axes.set_axisbelow(True)
