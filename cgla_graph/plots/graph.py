"""The picture of a graph whose nodes have positions: nodes, edges where they are few, and paths."""

from collections.abc import Sequence
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.figure import Figure

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.problem import GraphProblem
from cgla_graph.plots.looks import LabelledPath, others_label
from cgla_graph.plots.page import Key, Part, add_legend, arrange, heading, style
from cgla_graph.plots.scene import draw_mark, line_key

#: Most edges of a graph that are drawn; more would cover the whole map.
MOST_EDGES = 2000
#: Most nodes of a graph that are drawn; of more, every second, third, …, which the picture says.
MOST_NODES = 100_000
#: Inches: longer side of the picture, and its least shorter side.
_LONG, _SHORT = 4.8, 1.2
_PEN, _STEP, _THIN = 1.4, 0.9, 0.8  # points: the best path, how much wider a worse one below it is, and grey ones


def drawn_nodes(graph: GeometricGraph) -> BoolArray:
    """Mark the nodes that are drawn: all, or every second, third, …."""
    drawn = np.zeros(graph.n_nodes, dtype=np.bool_)
    drawn[:: -(-graph.n_nodes // MOST_NODES)] = True
    return drawn


def drawn_edges(graph: GeometricGraph) -> FloatArray:
    """
    Return the edges that are drawn, shape ``(m, 2, 2)``, map units: all, or none where there are too many.

    Examples
    --------
    >>> drawn_edges(GeometricGraph.from_matrix([[0, 1], [1, 0]], positions=[(0, 0), (1, 0)])).tolist()
    [[[0.0, 0.0], [1.0, 0.0]]]
    """
    if graph.positions is None or (graph.is_implicit and graph.n_pairs > MOST_EDGES) or graph.n_edges > MOST_EDGES:
        return np.empty((0, 2, 2))
    tails, heads = graph.to_csgraph().tocoo().coords
    kept = tails != heads if graph.directed else tails < heads
    return np.stack([graph.positions[tails[kept]], graph.positions[heads[kept]]], axis=1)


def draw_graph(graph: GeometricGraph, axes: Axes, *, edges: bool = True) -> None:
    """
    Draw nodes, and edges if they are few.

    Raises
    ------
    ProblemError
        If the nodes have no positions.
    """
    if graph.positions is None:
        msg = "the nodes of this graph have no positions, so that there is nothing to draw; build it with pos="
        raise ProblemError(msg)
    if edges:
        axes.add_collection(LineCollection(list(drawn_edges(graph)), colors="0.85", linewidths=0.6, zorder=1.0))
    drawn = graph.positions[drawn_nodes(graph)]
    # (points squared: dots of many nodes would cover the map)
    size = min(6.0, max(0.3, 6000.0 / len(drawn)))
    axes.scatter(drawn[:, 0], drawn[:, 1], s=size, color="0.6", zorder=2.0)
    if len(drawn) < graph.n_nodes:
        axes.set_title(f"{len(drawn):,} of {graph.n_nodes:,} nodes are drawn", fontsize=9.0, loc="left")
    axes.set(aspect="equal", xlabel="x", ylabel="y")


def draw_node(axes: Axes, graph: GeometricGraph, node: int, label: str, marker: str) -> None:
    """Draw a node, by its index, with a marker of its own."""
    place = np.asarray(graph.positions)[node]
    draw_mark(axes, place, marker, 9.0, markeredgecolor="black", label=label, zorder=4.0)


def graph_figure(name: str, title: str, problem: GraphProblem, paths: Sequence[LabelledPath]) -> Figure:
    """
    Draw a graph with labelled paths between two of its nodes.

    Parameters
    ----------
    name, title
        Texts above it.
    problem
        A graph whose nodes have positions, and two of them.
    paths
        The best first, which is on top and thinnest, so that equal paths are all seen.

    Raises
    ------
    ProblemError
        If the nodes have no positions.

    Examples
    --------
    >>> roads = GeometricGraph.from_matrix([[0, 1], [1, 0]], labels="ab", positions=[(0, 0), (1, 0)])
    >>> graph_figure("roads", "", GraphProblem(roads, "a", "b"), []).axes[0].get_xlabel()
    'x'
    """
    graph = problem.graph
    with style():
        page = Figure()
        axes = page.add_subplot()
        draw_graph(graph, axes)
        keys: list[Key] = []
        for place, one in enumerate(paths):
            wide = _PEN + _STEP * place if one.stands_out else _THIN
            look: dict[str, Any] = {"color": one.colour, "linestyle": one.dashes, "linewidth": wide}
            if len(one.path):
                axes.plot(*one.path.T, zorder=3.5 - 0.01 * place, **look)
            if one.stands_out:
                keys.append((line_key(**look | {"linewidth": 2.0}), one.row(1.0)))
        if others := sum(not one.stands_out for one in paths):
            keys.append((line_key(color="0.62", linewidth=_THIN), others_label(others)))
        for node, word, marker in ((problem.source, "start", "o"), (problem.target, "goal", "*")):
            draw_node(axes, graph, graph.index_of(node), word, marker)
            look = {"marker": marker, "linestyle": "none", "markersize": 9.0, "markerfacecolor": "white"}
            keys.append((line_key(**look, markeredgecolor="black"), word))
        legend = add_legend(page, keys, title="cost" if paths else "", columns=1 + len(keys) // 20)
        low, high = np.asarray(graph.positions).min(axis=0), np.asarray(graph.positions).max(axis=0)
        width, height = np.maximum(high - low, 1e-3 * max(*(high - low), 1e-9))
        scale = _LONG / max(width, height)
        size = (max(float(width * scale), _SHORT), max(float(height * scale), _SHORT))
        axes.set_aspect("equal", adjustable="datalim")
        weight = None if graph.model is None else graph.model.k
        arrange(page, heading(name, title, weight), [[Part.of(page, axes, size), Part.of(page, legend)]])
    return page
