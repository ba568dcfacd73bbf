"""Pictures of many questions to one map: the paths of all answers, and isochrones."""

from collections.abc import Iterator

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure
from matplotlib.patches import PathPatch

from cgla_graph._text import counted
from cgla_graph.certificate.answers import Answers
from cgla_graph.certificate.isochrones import Isochrones
from cgla_graph.model.solution import Status
from cgla_graph.plots.looks import COLOURS
from cgla_graph.plots.map import BaseMap
from cgla_graph.plots.page import Key, add_inner_legend, heading, style
from cgla_graph.plots.scene import Look, TitledProblem, draw_mark, line_key, outline, patch_key, unit_scale

_OPACITY = 0.12
_MARKS = {"o": 4.0, "*": 8.0, "x": 6.0}


def answers_figure(shown: TitledProblem, answers: Answers | Isochrones, *, figure: Figure | None = None) -> Figure:
    """
    Draw the paths of many questions, or isochrones, over their map, whose axes are the first of the figure.

    Examples
    --------
    >>> import cgla_graph as cg
    >>> base = cg.Map(cg.Problem((0.1, 0.1), (0.9, 0.1)))
    >>> shown = answers_figure(TitledProblem(base.problem), base.isochrones([0.3], steps=32))
    >>> [text.get_text() for text in shown.legends[0].get_texts()]
    ['certainly within 0.3', 'possibly within 0.3', 'from here']
    """
    with style():
        base = BaseMap.of(shown, places=[np.reshape(shown.problem.bounds, (2, 2))], figure=figure)
        keys = list(_draw(base, answers))
        above = ":  ".join(filter(None, heading(shown.name, shown.title, shown.problem.k)))
        base.arrange((above, answers.message), [*base.parts, base.add_legend(keys)])
    return base.figure


def draw_answers(axes: Axes, shown: TitledProblem, answers: Answers | Isochrones) -> None:
    """Draw the same on axes of the user's, with the legend inside."""
    with style():
        base = BaseMap.on(axes, shown, places=[np.reshape(shown.problem.bounds, (2, 2))])
        rows = list(_draw(base, answers))
        add_inner_legend(axes, rows, least=len(rows))


def _draw(base: BaseMap, answers: Answers | Isochrones) -> Iterator[Key]:
    """Draw what was found; yield the rows of the legend."""
    yield from _draw_paths(base, answers) if isinstance(answers, Answers) else _draw_isochrones(base, answers)
    yield from base.draw_areas()


def _draw_paths(base: BaseMap, answers: Answers) -> Iterator[Key]:
    """Draw the paths of all answers, with their ends."""
    axes, scale = base.axes, unit_scale(answers.problem)
    found = [one.path * scale for one in answers if one.status.has_path]
    if found:
        lines = LineCollection(
            found, colors=COLOURS[0], linewidths=1.0, alpha=max(0.25, len(found) ** -0.2), zorder=3.5
        )
        axes.add_collection(lines)
        yield line_key(color=COLOURS[0], linewidth=1.4), f"{counted(len(found), 'path')}"
    for ends, marker, name in ((answers.starts, "o", "start"), (answers.goals, "*", "goal")):
        places = np.unique(ends, axis=0) * scale
        marks = [
            draw_mark(axes, place, marker, _MARKS[marker], zorder=5.0) for place in np.unique(places, axis=0) * scale
        ]
        yield from ((mark, name) for mark in marks[:1])
    closed = [answers.starts[n] * scale for n, one in enumerate(answers) if one.status is Status.NO_PATH]
    marks = [draw_mark(axes, place, "x", _MARKS["x"], color=COLOURS[1], zorder=5.1) for place in closed]
    yield from ((mark, "proven: there is no path") for mark in marks[:1])


def _draw_isochrones(base: BaseMap, found: Isochrones) -> Iterator[Key]:
    """Draw the certain area of each cost, and the outline of the possible one."""
    axes, scale = base.axes, unit_scale(found.problem)
    unit = " km" if found.problem.projection else ""
    colours = colormaps["viridis"](np.linspace(0.0, 0.9, len(found.costs)))
    for number in reversed(range(len(found.costs))):
        colour, said = tuple(colours[number]), f"{found.costs[number] * scale:.5g}{unit}"
        filled: Look = {"facecolor": (*colour[:3], _OPACITY), "edgecolor": colour}
        dashed: Look = {"facecolor": "none", "edgecolor": colour, "linestyle": (0, (4, 2))}
        for shape, look, word in (
            (found.certain[number], filled, "certainly"),
            (found.possible[number], dashed, "possibly"),
        ):
            if not shape.is_empty:
                axes.add_patch(PathPatch(outline(shape, scale), linewidth=1.0, zorder=2.5, **look))
                yield patch_key(linewidth=1.0, **look), f"{word} within {said}"
    place = np.array(found.goal) * scale
    yield draw_mark(axes, place, "*", 12.0, markeredgecolor="black", clip_on=False, zorder=5.0), "from here"
