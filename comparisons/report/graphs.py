"""Graphs of the report: edges as whole numbers where nodes have positions, and paths as the labels of their nodes."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cgla_graph._types import Bounds
from cgla_graph.comparisons.report.maps import steps_of
from cgla_graph.model.adjacency import Node, label_text
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.plots.graph import drawn_edges

#: Of longer paths, the first and the last nodes are written.
MOST_SHOWN = 7
#: Room around the nodes of a graph, as a share of the longer side.
_ROOM = 0.03


@dataclass(frozen=True)
class Frame:
    """Bounds of a picture, map units."""

    bounds: Bounds


def frame_of(graph: GeometricGraph) -> Frame | None:
    """
    Return the bounds of the nodes, with some room; None if they have no positions.

    Examples
    --------
    >>> frame_of(GeometricGraph.from_matrix([[0, 1], [1, 0]])) is None
    True
    """
    if graph.positions is None:
        return None
    low, high = graph.positions.min(axis=0), graph.positions.max(axis=0)
    room = _ROOM * (float((high - low).max()) or 1.0)
    (x_min, y_min), (x_max, y_max) = (low - room).tolist(), (high + room).tolist()
    return Frame((x_min, y_min, x_max, y_max))


def graph_document(graph: GeometricGraph) -> dict[str, Any]:
    """
    Turn a graph into what the page draws: a map (see `map_document`) without risk, whose ``bounds`` may be None.

    Examples
    --------
    >>> graph_document(GeometricGraph.from_matrix([[0, 1], [1, 0]]))["bounds"] is None
    True
    """
    frame = frame_of(graph)
    edges = [] if frame is None else steps_of(np.reshape(drawn_edges(graph), (-1, 2)), frame)
    empty: dict[str, Any] = {"y_down": False, "axes": None, "risk": None, "no_fly": [], "walls": None, "margin": []}
    return {"bounds": None if frame is None else list(frame.bounds), "edges": edges, **empty}


def shortened(nodes: Sequence[Node]) -> str:
    """
    Write a path, the middle of a long one left out.

    Examples
    --------
    >>> shortened("ab"), shortened(range(9))
    ('a → b', '0 → 1 → 2 → … → 6 → 7 → 8')
    """
    words = [label_text(node) for node in nodes]
    return " → ".join(words if len(words) <= MOST_SHOWN else [*words[:3], "…", *words[-3:]])
