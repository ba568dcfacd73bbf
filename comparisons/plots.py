"""Pictures of a comparison: the paths on the map of risk, and how soon anytime solvers find good ones."""

import io
import math
import secrets
import statistics
import textwrap
import unicodedata
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any, TypeAlias

import matplotlib as mpl
import numpy as np
from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap
from matplotlib.figure import Figure
from matplotlib.font_manager import get_font
from matplotlib.legend import Legend
from matplotlib.lines import Line2D
from matplotlib.patches import Patch, PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.text import Text
from matplotlib.ticker import FuncFormatter, LogLocator, MaxNLocator, NullFormatter
from shapely import MultiPolygon, Polygon

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.comparisons.runner import Run
from cgla_graph.errors import OutputError
from cgla_graph.scenario import Scenario
from cgla_graph.solution import Status

Dashes: TypeAlias = tuple[float, tuple[float, ...] | None]

#: Dots per inch of PNG files.
DPI = 150

# Okabe and Ito's palette with brown and olive instead of yellow (faint on white) and vermilion (kept for infeasible
# paths). The numbers of colours, dashes and markers have no common factor: dozens of solvers differ in one or another.
_COLOURS = ("#0072B2", "#E69F00", "#56B4E9", "#000000", "#009E73", "#CC79A7", "#7A3B00", "#999933")
_DASHES: tuple[Dashes, ...] = (
    (0, None),
    (0, (3.5, 1.5)),
    (0, (1, 1)),
    (0, (5, 1.5, 1, 1.5)),
    (0, (2, 0.8)),
)
_MARKERS = ("o", "s", "^", "D", "v", "P", "X")
_INFEASIBLE_COLOUR = "#D55E00"
_INFEASIBLE_DASHES: tuple[Dashes, ...] = ((0, (6, 3)), (0, (3, 3)), (0, (9, 3, 2, 3)))

_GRID = 300  # samples of the risk field along the longer side
_LONG, _WIDE_LONG, _SHORT = 4.8, 6.5, 0.9  # inches: longer side of the map, of a wide one, least shorter side
_WIDE = 2.5  # maps wider than this times their height have everything else below them
_PAD, _GAP, _BAR = 0.1, 0.2, 0.13  # inches: border, space between parts, thickness of the colour bar
_ROW = 0.2  # inches that a row of the legend takes
_SAME_COST = 1e-6  # costs closer than this, relatively, are one
_STYLE: dict[str, Any] = {
    "axes.linewidth": 0.6,
    "font.family": "DejaVu Sans",  # comes with matplotlib: the same text everywhere
    "font.size": 8.5,
    "hatch.linewidth": 0.5,
    "svg.hashsalt": "cgla_graph",
    "text.parse_math": False,  # names are shown as they are, dollars too
}


def map_figure(scenario: Scenario, runs: Sequence[Run]) -> Figure:
    """
    Draw a map with its risk, its no-fly area and the path of every solver.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs. Of a solver's seeds the one with the least cost is drawn; solvers without a path are in the legend.

    Returns
    -------
    figure
        Axes are map units, or kilometres where the map has longitudes and latitudes.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> figure = map_figure(load_scenario("paper"), [])
    >>> [axes.get_ylabel() for axes in figure.axes]
    ['y', 'risk per unit length']
    """
    entries = _entries(runs)
    scale = _scale(scenario)
    with _style():
        figure = Figure()
        axes = figure.add_subplot()
        size = _frame_map(axes, scenario, entries)
        wide = size[0] > _WIDE * size[1]
        bar = _draw_risk(figure, axes, scenario, wide=wide)
        handles, labels = _draw_paths(axes, entries, scale)
        for handle, label in _draw_marks(axes, scenario):
            handles.append(handle)
            labels.append(label)
        title = "cost (km)" if scenario.projection is not None else "cost"
        rows = max(8, int(size[1] / _ROW) - 1)
        columns = max(1, int(size[0] / 2.1)) if wide else math.ceil(len(labels) / rows)
        legend = _legend(figure, handles, labels, title=title if entries else "", columns=columns)
        parts = [_Part.of(figure, axes, size)]
        if bar is not None:
            parts.append(_Part.of(figure, bar.ax, (min(3.0, size[0]), _BAR) if wide else (_BAR, size[1])))
        _arrange(figure, _heading(scenario), [*parts, _Part.of(figure, legend)], wide=wide)
    return figure


def trace_figure(scenario: Scenario, runs: Sequence[Run]) -> Figure | None:
    """
    Draw the best cost of anytime solvers against time, beside what the other solvers found.

    Parameters
    ----------
    scenario
        The map.
    runs
        Its runs; every seed is a line. Dashed lines are the costs of exact solvers, markers the results of all solvers
        without a trace, at the time that they needed (weighing the graph included).

    Returns
    -------
    figure
        Costs far above the first ones of anytime solvers are marked at the upper edge. None if no run found a path and
        has a trace.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> trace_figure(load_scenario("paper"), []) is None
    True
    """
    scale = _scale(scenario)
    traces = [(run, trace) for run in runs if len(trace := _trace(run, scale))]
    if not traces:
        return None
    entries = _entries(runs)
    others = [run for run in runs if not run.solution.trace and run.solution.status.is_path]
    low, high = _cost_limits([trace for _, trace in traces], [run.solution.cost * scale for run in others])
    with _style():
        figure = Figure()
        axes = figure.add_subplot()
        axes.set_ylim(low, high)
        drawn = _draw_traces(axes, entries, traces) | _draw_results(axes, entries, others, scale)
        shown = [entry for entry in entries if entry.label in drawn]
        handles = [drawn[entry.label] for entry in shown]
        labels = [_cost_label(entry, scale, above=high) for entry in shown]
        for line, label in _draw_exact(axes, others, scale):
            handles.append(line)
            labels.append(label)
        unit = " (km)" if scenario.projection is not None else ""
        _frame_trace(axes, unit)
        legend = _legend(figure, handles, labels, title=f"best cost{unit}", columns=math.ceil(len(labels) / 17))
        _arrange(figure, _heading(scenario), [_Part.of(figure, axes, (4.6, 3.2)), _Part.of(figure, legend)])
    return figure


def save(figure: Figure, path: Path) -> Path:
    """
    Write a figure as PNG or SVG: the same figure gives the same bytes.

    Parameters
    ----------
    figure
        The figure.
    path
        Where to; the suffix says which. The file appears whole or not at all.

    Returns
    -------
    path
        The path.

    Raises
    ------
    OutputError
        If it cannot be drawn or written; nothing is left behind then.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     save(Figure(), Path(folder, "empty.svg")).stat().st_size > 0
    True
    """
    part = path.with_name(f".{secrets.token_hex(8)}.part")
    try:
        image = _image(figure, path.suffix.lower())
        with part.open("xb") as file:
            file.write(image)
        part.replace(path)
    except Exception as error:
        reason = getattr(error, "strerror", None) or " ".join(str(error).split()) or type(error).__name__
        msg = f"{path}: cannot be written: {reason}"
        raise OutputError(msg) from error
    finally:
        with suppress(OSError):  # mostly as it is not there
            part.unlink()
    return path


def _image(figure: Figure, suffix: str) -> bytes:
    """Draw a figure into memory, with nothing in it that differs from day to day."""
    metadata: dict[str, dict[str, Any]] = {".png": {"Software": None}, ".svg": {"Date": None}}
    if suffix not in metadata:
        msg = f"{suffix or 'no suffix'} is not a format; name the file .png or .svg"
        raise OutputError(msg)
    image = io.BytesIO()
    with _style():
        figure.savefig(image, format=suffix[1:], dpi=DPI, metadata=metadata[suffix])
    return image.getvalue()


@contextmanager
def _style() -> Iterator[None]:
    """Draw with this style, whatever the user's matplotlibrc says."""
    with mpl.rc_context():
        mpl.rcdefaults()
        settings: Any = mpl.rcParams  # some versions of matplotlib list every key as a type
        settings.update(_STYLE)
        yield


# --- what is drawn -------------------------------------------------------------------------------------------------


@dataclass(frozen=True, eq=False)
class _Entry:
    """A solver on the map: its best run, and its number, from which colour and dashes follow in every picture."""

    number: int
    label: str
    best: Run
    n_runs: int
    n_found: int

    @property
    def path(self) -> FloatArray:
        """What is drawn: a path that may be flown, or an infeasible one; a wrong one is not."""
        solution = self.best.solution
        shown = solution.status.is_path or solution.status is Status.INFEASIBLE
        return np.asarray(solution.path if shown else np.empty((0, 2)), dtype=np.float64)

    @property
    def infeasible(self) -> bool:
        return self.best.solution.status is Status.INFEASIBLE

    @property
    def colour(self) -> str:
        return _INFEASIBLE_COLOUR if self.infeasible else _COLOURS[self.number % len(_COLOURS)]

    @property
    def dashes(self) -> Dashes:
        dashes = _INFEASIBLE_DASHES if self.infeasible else _DASHES
        return dashes[self.number % len(dashes)]

    def covers(self, other: "_Entry") -> bool:
        """Whether the two paths run one over the other, so that their widths must differ."""
        both_exact = self.best.exact and other.best.exact
        return both_exact or (self.path.shape == other.path.shape and bool(np.allclose(self.path, other.path)))


def _entries(runs: Sequence[Run]) -> list[_Entry]:
    """Take each solver's best run: a path before an infeasible one before none, then the least cost."""
    groups: dict[str, list[Run]] = {}
    for run in runs:
        groups.setdefault(run.solver, []).append(run)
    return [
        _Entry(number, label, min(group, key=_rank), len(group), sum(run.solution.status.is_path for run in group))
        for number, (label, group) in enumerate(groups.items())
    ]


def _rank(run: Run) -> tuple[bool, bool, float]:
    solution = run.solution
    return not solution.status.is_path, solution.status is not Status.INFEASIBLE, solution.cost


def _trace(run: Run, scale: float) -> FloatArray:
    """Return the rows (seconds, cost) of a run that found a path, up to its end; none of them before the first path."""
    solution = run.solution
    points = [(point.seconds, point.cost * scale) for point in solution.trace if math.isfinite(point.cost)]
    if not points or not solution.status.is_path:
        return np.empty((0, 2))
    points.append((max(solution.seconds, points[-1][0]), points[-1][1]))
    return np.add(points, (solution.build_seconds, 0.0))


def _cost_limits(traces: Sequence[FloatArray], others: Sequence[float]) -> tuple[float, float]:
    """
    Choose the least and greatest cost to show: from the best to where the anytime solvers begin.

    A first cost far above the next one (or above other seeds') would press everything else flat.

    Examples
    --------
    >>> traces = [np.array([(0, 1000), (1, 2), (2, 1)])]
    >>> _cost_limits(traces, [1.5, 50])
    (0.94, 2.12)
    """
    best = min([*others, *(trace[-1, 1] for trace in traces)])
    begins = []
    for trace in traces:
        first, second = trace[0, 1] - best, trace[1, 1] - best
        begins.append(second if first > 10.0 * second > 0.0 else first)
    usual = statistics.median_low(begins)
    reach = max(begin for begin in begins if begin <= 4.0 * usual)
    near = [cost - best for cost in others if cost - best <= 1.5 * reach]
    reach = max([reach, *near]) or 0.01 * abs(best) or 1.0
    return float(best - 0.06 * reach), float(best + 1.12 * reach)


def _scale(scenario: Scenario) -> float:
    """Return how much of the unit of the axes one map unit is: metres become kilometres."""
    return 1.0 if scenario.projection is None else 1e-3


# --- text ----------------------------------------------------------------------------------------------------------


@cache
def _glyphs() -> frozenset[int]:
    """Return the characters that the font can draw."""
    font = get_font(str(Path(mpl.get_data_path(), "fonts", "ttf", "DejaVuSans.ttf")))
    return frozenset(int(code) for code in font.get_charmap())


def _plain(text: str, most: int) -> str:
    r"""
    Make one short line of any text; what the font lacks becomes a replacement character, the middle gives way first.

    Examples
    --------
    >>> _plain("of\n$x$ \N{ROBOT FACE}", 40), _plain("rrt-star:iterations=2000", 15)
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


def _number(value: float) -> str:
    """
    Write a cost with five significant digits.

    Examples
    --------
    >>> _number(1.50361), _number(1355742.7), _number(63)
    ('1.5036', '1355700', '63.000')
    """
    if 1e5 <= abs(value) < 1e9:  # noqa: PLR2004 - where %g would write an exponent, and digits still read better
        return f"{float(f'{value:.5g}'):.0f}"
    return f"{value:#.5g}".rstrip(".")


def _cost_label(entry: _Entry, scale: float, *, above: float = math.inf) -> str:
    """Say what a solver found, in one line of the legend, and whether it is off the scale."""
    solution = entry.best.solution
    found = _number(solution.cost * scale) if solution.status.is_path else solution.status.label
    seeds = ""
    if entry.n_runs > 1 and entry.n_found:
        seeds = f" (best of {entry.n_runs})"
        if entry.n_found < entry.n_runs:
            seeds = f" ({entry.n_found} of {entry.n_runs} found)"
    off = ", above" if above < solution.cost * scale < math.inf else ""
    return f"{_plain(entry.label, 36)}: {found}{seeds}{off}"


def _heading(scenario: Scenario) -> tuple[str, str]:
    """Return name and risk weight, and the title."""
    return f"{_plain(scenario.name, 48)},  k = {scenario.problem.k:g}", _plain(scenario.title, 160)


def _degrees(value: float, letters: str) -> str:
    """
    Write a longitude or latitude.

    Examples
    --------
    >>> _degrees(24.95, "EW"), _degrees(-60.1234, "NS")
    ('24.95° E', '60.123° S')
    """
    return f"{round(abs(value), 3):g}° {letters[value < 0.0]}"


# --- the map -------------------------------------------------------------------------------------------------------


def _frame_map(axes: Axes, scenario: Scenario, entries: Sequence[_Entry]) -> tuple[float, float]:
    """Set limits and labels; return the width and height of the map, inches."""
    (x_min, y_min, x_max, y_max), inches = _view(scenario, entries)
    axes.set_xlim(x_min, x_max)
    axes.set_ylim(*((y_max, y_min) if scenario.y_down else (y_min, y_max)))
    axes.set_aspect("equal")
    axes.set_facecolor("0.92")  # outside the bounds, where a path leaves them or the map is very thin
    size = (x_max - x_min) * inches, (y_max - y_min) * inches
    axes.xaxis.set_major_locator(MaxNLocator(max(1, int(1.3 * size[0])), steps=[1, 2, 5, 10], min_n_ticks=1))
    axes.yaxis.set_major_locator(MaxNLocator(max(2, int(1.3 * size[1])), steps=[1, 2, 5, 10]))
    x_label, y_label = ("x (cells)", "y (cells)") if scenario.y_down else ("x", "y")
    if scenario.projection is not None:
        x_label = f"km east of {_degrees(scenario.projection.longitude, 'EW')}"
        y_label = f"km north of {_degrees(scenario.projection.latitude, 'NS')}"
    axes.set_xlabel(x_label)
    axes.set_ylabel(y_label)
    return size


def _view(scenario: Scenario, entries: Sequence[_Entry]) -> tuple[Bounds, float]:
    """
    Choose what part of the plane is shown, and the inches of one unit.

    It is the bounds, and some room where an infeasible path leaves them; a thin map gets room on both sides.
    """
    scale = _scale(scenario)
    low, high = np.reshape(scenario.problem.bounds, (2, 2)) * scale
    room = 0.1 * (high - low).max()
    for entry in entries:
        if entry.infeasible and len(entry.path):
            low = np.minimum(low, np.maximum(entry.path.min(axis=0) * scale, low - room))
            high = np.maximum(high, np.minimum(entry.path.max(axis=0) * scale, high + room))
    width, height = high - low
    inches = (_WIDE_LONG if width > _WIDE * height else _LONG) / max(width, height)
    lacking = np.maximum(_SHORT / inches - (high - low), 0.0)
    low, high = low - 0.5 * lacking, high + 0.5 * lacking
    return (float(low[0]), float(low[1]), float(high[0]), float(high[1])), float(inches)


@cache
def _risk_colours() -> Colormap:
    """
    Return colours from white to violet in equal steps of CIELAB.

    So equal differences of risk look equal, also in grey and to the colour-blind, and the violet leaves the hues of
    the paths alone. Negative risk (of improper fields) is grey-blue.
    """
    lab = np.linspace((100.0, 0.0, 0.0), (38.0, 38.0, -52.0), 256)
    f_y = (lab[:, 0] + 16.0) / 116.0
    f = np.stack([f_y + lab[:, 1] / 500.0, f_y, f_y - lab[:, 2] / 200.0], axis=1)
    xyz = np.where(f > 6.0 / 29.0, f**3, 3.0 * (6.0 / 29.0) ** 2 * (f - 4.0 / 29.0)) * (0.95047, 1.0, 1.08883)
    to_rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    linear = np.clip(xyz @ np.transpose(to_rgb), 0.0, 1.0)
    rgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)  # noqa: PLR2004 - sRGB
    return ListedColormap(np.clip(rgb, 0.0, 1.0), name="risk").with_extremes(under="#9DB4C0")


def _draw_risk(figure: Figure, axes: Axes, scenario: Scenario, *, wide: bool) -> Colorbar | None:
    """Draw the risk field over the bounds, and its colour bar; no bar where there is no risk."""
    x_min, y_min, x_max, y_max = scenario.problem.bounds
    scale = _scale(scenario)
    corner, width, height = (x_min * scale, y_min * scale), (x_max - x_min) * scale, (y_max - y_min) * scale
    axes.add_patch(Rectangle(corner, width, height, facecolor="white", zorder=0))
    axes.add_patch(Rectangle(corner, width, height, facecolor="none", edgecolor="0.2", linewidth=0.8, zorder=2.5))
    density, top = _density(scenario)
    if not top > 0.0:
        return None
    image = axes.imshow(
        density,
        cmap=_risk_colours(),
        vmin=0.0,
        vmax=top,
        origin="lower",
        extent=(corner[0], corner[0] + width, corner[1], corner[1] + height),
        interpolation="bilinear",
        aspect="equal",
        zorder=1,
    )
    bar = figure.colorbar(
        image,
        cax=figure.add_axes((0.0, 0.0, 0.1, 0.1)),
        orientation="horizontal" if wide else "vertical",
        extend="min" if density.min() < -1e-9 else "neither",  # noqa: PLR2004 - more than rounding
        ticks=MaxNLocator(5, steps=[1, 2, 5, 10]),
    )
    bar.set_label("risk per unit length", labelpad=2.0 if wide else 8.0)
    return bar


def _density(scenario: Scenario) -> tuple[FloatArray, float]:
    """Sample the risk field over the bounds, shape ``(rows, columns)``; its greatest value with centres seen."""
    field, (x_min, y_min, x_max, y_max) = scenario.problem.field, scenario.problem.bounds
    step = max(x_max - x_min, y_max - y_min) / _GRID
    x, y = (
        low + (np.arange(n) + 0.5) * (high - low) / n
        for low, high, n in ((lo, hi, max(2, round((hi - lo) / step))) for lo, hi in ((x_min, x_max), (y_min, y_max)))
    )
    density = field.density(np.stack(np.meshgrid(x, y), axis=-1))
    centres = [(t.x, t.y) for t in field.threats if x_min <= t.x <= x_max and y_min <= t.y <= y_max]
    peaks = field.density(centres) if centres else np.zeros(1)
    return density, float(max(density.max(), peaks.max()))


def _draw_paths(axes: Axes, entries: Sequence[_Entry], scale: float) -> tuple[list[Artist], list[str]]:
    """Draw one path for each solver; return handles and labels of the legend, in the order of the entries."""
    # exact solvers go below: their paths are wide, so that each shows beside the next
    order = sorted(entries, key=lambda entry: (entry.infeasible, not entry.best.exact, entry.number))
    drawn = [entry for entry in order if len(entry.path)]
    above = [sum(entry.covers(other) for other in drawn[i + 1 :]) for i, entry in enumerate(drawn)]
    step = min(1.3, 8.0 / max([1, *above]))
    handles: dict[int, Artist] = {entry.number: Line2D([], [], linestyle="none") for entry in entries}
    for depth, (entry, below) in enumerate(zip(drawn, above, strict=True)):
        width = (1.0 if entry.infeasible else 1.4) + step * below
        on_another = any(other.covers(entry) for other in drawn[:depth])
        halo = [patheffects.withStroke(linewidth=width + 1.4, foreground="white", alpha=0.85)]
        (line,) = axes.plot(
            *(entry.path.T * scale),
            color=entry.colour,
            linestyle=entry.dashes,
            linewidth=width,
            # a path of one point, or of equal points, has no line to see
            marker="o" if (entry.path == entry.path[0]).all() else "none",
            markersize=15.0 + 3.0 * width,
            clip_on=entry.infeasible,
            solid_joinstyle="round",
            dash_capstyle="butt",
            zorder=3.0 + 0.01 * depth,
            path_effects=[] if on_another else halo,
        )
        handles[entry.number] = line
    return [handles[entry.number] for entry in entries], [_cost_label(entry, scale) for entry in entries]


def _draw_marks(axes: Axes, scenario: Scenario) -> Iterator[tuple[Artist, str]]:
    """Draw start, goal and no-fly area; yield handles and labels of the legend."""
    problem, scale = scenario.problem, _scale(scenario)
    around = 15.0 if problem.start == problem.goal else 8.0
    for name, end, marker, size in (("start", problem.start, "o", around), ("goal", problem.goal, "*", 12.0)):
        (mark,) = axes.plot(
            end[0] * scale,
            end[1] * scale,
            linestyle="none",
            marker=marker,
            markersize=size,
            markerfacecolor="white",
            markeredgecolor="black",
            clip_on=False,
            zorder=5,
        )
        yield mark, name
    if problem.model.area.is_empty:
        return
    outline = _outline(problem.model.area.geometry, scale)
    x_min, y_min, x_max, y_max = np.multiply(problem.bounds, scale).tolist()
    inside = Rectangle((x_min, y_min), x_max - x_min, y_max - y_min, transform=axes.transData)
    # two patches, as the hatch of one has the colour of its edge
    styles: tuple[dict[str, Any], ...] = (
        {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "////", "linewidth": 0.0},
        {"facecolor": "none", "edgecolor": "0.25", "linewidth": 0.7},
    )
    for style in styles:
        axes.add_patch(PathPatch(outline, **style, zorder=2)).set_clip_path(inside)
    yield Patch(**styles[0] | {"edgecolor": "0.25", "linewidth": 0.7}), "no-fly area"


def _outline(area: Polygon | MultiPolygon, scale: float) -> Outline:
    """Return the rings of polygons; holes run the other way round than shells, so that they stay empty."""
    polygons = [area] if isinstance(area, Polygon) else area.geoms
    rings = [ring for polygon in polygons for ring in (polygon.exterior, *polygon.interiors)]
    return Outline.make_compound_path(*(Outline(np.asarray(ring.coords) * scale, closed=True) for ring in rings))


# --- cost over time ------------------------------------------------------------------------------------------------


def _draw_traces(axes: Axes, entries: Sequence[_Entry], traces: Sequence[tuple[Run, FloatArray]]) -> dict[str, Artist]:
    """Draw a line for each seed; return a handle for each solver."""
    by_label = {entry.label: entry for entry in entries}
    # a logarithmic axis has no 0
    earliest = min((t for _, trace in traces for t in trace[:, 0].tolist() if t > 0.0), default=1e-3)
    drawn: dict[str, Artist] = {}
    solvers = list(dict.fromkeys(run.solver for run, _ in traces))
    for run, trace in traces:
        entry = by_label[run.solver]
        (line,) = axes.step(
            np.maximum(trace[:, 0], earliest),
            trace[:, 1],
            where="post",
            color=entry.colour,
            linestyle=_DASHES[solvers.index(run.solver) % len(_DASHES)],
            linewidth=1.1,
            zorder=3,
        )
        drawn[run.solver] = line
    return drawn


def _draw_results(axes: Axes, entries: Sequence[_Entry], runs: Sequence[Run], scale: float) -> dict[str, Artist]:
    """Draw a marker for each result without a trace, on the upper edge where it is above; return handles."""
    by_label = {entry.label: entry for entry in entries}
    drawn: dict[str, Artist] = {}
    for run in runs:
        entry, solution = by_label[run.solver], run.solution
        (mark,) = axes.plot(
            max(solution.seconds + solution.build_seconds, 1e-6),
            min(solution.cost * scale, axes.get_ylim()[1]),
            linestyle="none",
            color=entry.colour,
            marker=_MARKERS[entry.number % len(_MARKERS)],
            # equal costs in equal times: the first stands out behind the last
            markersize=max(6.0, 9.0 - 0.7 * entry.number),
            markeredgecolor="white",
            markeredgewidth=0.6,
            clip_on=False,
            zorder=4,
        )
        drawn[run.solver] = mark
    return drawn


def _draw_exact(axes: Axes, runs: Sequence[Run], scale: float) -> Iterator[tuple[Artist, str]]:
    """Draw a line for each cost of exact solvers (they mostly agree); yield handles and labels of the legend."""
    costs: list[float] = []
    for run in runs:
        cost = run.solution.cost * scale
        if run.exact and not any(math.isclose(cost, other, rel_tol=_SAME_COST) for other in costs):
            costs.append(cost)
    for cost in costs:
        if cost <= axes.get_ylim()[1]:
            yield (
                axes.axhline(cost, color="0.35", linestyle=(0, (5, 3)), linewidth=0.8, zorder=2),
                f"exact: {_number(cost)}",
            )


def _frame_trace(axes: Axes, unit: str) -> None:
    """Set up the axes: logarithmic seconds, in plain digits."""
    axes.set_xscale("log")
    axes.margins(x=0.04)
    axes.set_xlabel("time (s), weighing the graph included")
    axes.set_ylabel(f"best cost so far{unit}")
    first, last = axes.get_xlim()
    few = last < 30.0 * first  # less than two powers of ten would leave one label or none
    axes.xaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if few else (1.0,)))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda seconds, _: f"{seconds:g}"))
    axes.xaxis.set_minor_formatter(NullFormatter())
    axes.grid(color="0.9", linewidth=0.5)
    axes.set_axisbelow(True)
    axes.spines[["top", "right"]].set_visible(False)


# --- the page ------------------------------------------------------------------------------------------------------


def _legend(figure: Figure, handles: Sequence[Artist], labels: Sequence[str], *, title: str, columns: int) -> Legend:
    """Make a legend of the figure; `_arrange` finds its place."""
    legend = figure.legend(
        handles,
        [" "] * len(labels),
        title=title,
        ncols=columns,
        loc="upper left",
        alignment="left",
        frameon=False,
        borderaxespad=0.0,
        borderpad=0.0,
        handlelength=3.2,
        labelspacing=0.55,
    )
    # not given at once, as matplotlib leaves out labels that begin with an underscore
    for text, label in zip(legend.get_texts(), labels, strict=True):
        text.set_text(label)
    for handle in legend.legend_handles:
        if isinstance(handle, Line2D):
            handle.set_markersize(min(handle.get_markersize(), 10.0))  # no marker reaches into the next row
    return legend


@dataclass(frozen=True, eq=False)
class _Part:
    """
    A part of a page, measured; all in inches.

    Attributes
    ----------
    artist
        Axes, a legend or a text.
    size
        Width and height: of axes without their labels.
    left, right, top, bottom
        How far labels stand out.
    """

    artist: Axes | Legend | Text
    size: tuple[float, float]
    left: float = 0.0
    right: float = 0.0
    top: float = 0.0
    bottom: float = 0.0

    @classmethod
    def of(cls, figure: Figure, artist: Axes | Legend | Text, size: tuple[float, float] = (1.0, 1.0)) -> "_Part":
        """Measure a legend or text, or axes that shall have a size."""
        canvas: Any = FigureCanvasAgg(figure)  # matplotlib does not say all of its types
        renderer = canvas.get_renderer()
        if not isinstance(artist, Axes):
            extent = artist.get_window_extent(renderer)
            return cls(artist, (extent.width / figure.dpi, extent.height / figure.dpi))
        figure.set_size_inches(12.0, 12.0)
        artist.set_position((0.25, 0.25, size[0] / 12.0, size[1] / 12.0))
        inner, outer = artist.get_window_extent(renderer), artist.get_tightbbox(renderer) or artist.bbox
        sides = (inner.x0 - outer.x0, outer.x1 - inner.x1, outer.y1 - inner.y1, inner.y0 - outer.y0)
        return cls(artist, size, *(max(side / figure.dpi, 0.0) for side in sides))

    def put(self, figure: Figure, x: float, y: float) -> None:
        """Put the upper left corner `x` from the left and `y` from the top of the page."""
        width, height = figure.get_size_inches().tolist()
        place = (x / width, 1.0 - y / height)
        if isinstance(self.artist, Axes):
            size = (self.size[0] / width, self.size[1] / height)
            self.artist.set_position((place[0], place[1] - size[1], *size))
        elif isinstance(self.artist, Text):
            self.artist.set_position(place)
        else:
            self.artist.set_bbox_to_anchor(place, transform=figure.transFigure)


def _arrange(figure: Figure, heading: tuple[str, str], parts: Sequence[_Part], *, wide: bool = False) -> None:
    """
    Put parts side by side (one below the other where `wide`) under the heading; the figure becomes as large as that.

    No layout engine of matplotlib keeps the scale of a map, legends outside and thin maps all together.
    """
    left = x = _PAD + parts[0].left
    y, right, bottom = parts[0].top, 0.0, 0.0
    places = []
    for part in parts:
        places.append((x, y))
        right, bottom = max(right, x + part.size[0] + part.right), max(bottom, y + part.size[1] + part.bottom)
        x, y = (x, bottom + _GAP) if wide else (right + _GAP, y)
    head = [_Part.of(figure, text) for text in _heading_texts(figure, heading, right - left)]
    down = _PAD
    head_places = []
    for part in head:
        head_places.append((left, down))
        right, down = max(right, left + part.size[0]), down + part.size[1] + 0.05
    figure.set_size_inches(right + _PAD, down + bottom + _PAD)
    for part, place in zip(head, head_places, strict=True):
        part.put(figure, *place)
    for part, (x, y) in zip(parts, places, strict=True):
        part.put(figure, x, down + y)


def _heading_texts(figure: Figure, heading: tuple[str, str], width: float) -> Iterator[Text]:
    """Write name and title, the title in lines of about `width` inches."""
    name, title = heading
    yield figure.text(0.0, 1.0, name, fontsize=11.0, verticalalignment="top")
    if title:
        text = figure.text(0.0, 1.0, title, verticalalignment="top", linespacing=1.3)
        share = width / _Part.of(figure, text).size[0]
        text.set_text("\n".join(textwrap.wrap(title, max(24, int(share * len(title))))))
        yield text
