"""Compiled kernel that brings a matrix of weights up to date where a change of the cost model reaches it."""

import math

from cgla_graph._kernel import kernel
from cgla_graph._types import FloatArray
from cgla_graph.cost_to_go.bound_kernels import in_boxes, in_reach
from cgla_graph.cost_to_go.repair_kernels import Nodes
from cgla_graph.model.graph_kernels import Model, pair_cost, stride
from cgla_graph.model.no_fly_kernels import segment_crosses


@kernel
def reweigh_share(
    nodes: Nodes,
    model: Model,
    everything: bool,
    changed: FloatArray,
    redrawn: FloatArray,
    first: int,
    step: int,
    old: FloatArray,
    primitive: bool,
    out: FloatArray,
) -> None:
    """
    Weigh pairs again where something changed, else copy: for the rows `first`, ``first + step``, …, both triangles.

    `changed` are the threats that came or went, `redrawn` the boxes where the no-fly area did. `primitive` chooses the
    pairs that join no third lattice node, which come first, or the others, which are the sums of those.
    """
    positions, width, height, coprime = nodes
    n = positions.shape[0]
    n_lattice = width * height
    k, field, area = model
    for i in range(first, n, step):
        x1, y1 = positions[i, 0], positions[i, 1]
        if primitive:
            out[i, i] = 0.0
        # the column and row of j
        column, row = (i % width, i // width) if i < n_lattice else (0, 0)
        first_column, first_row = column, row
        for j in range(i + 1, n):
            column += 1
            if column == width:
                column, row = 0, row + 1
            across, up = abs(column - first_column), row - first_row
            if (j >= n_lattice or coprime[across, up]) != primitive:
                continue
            x2, y2 = positions[j, 0], positions[j, 1]
            weight = old[i, j]
            hidden = weight == math.inf
            if redrawn.shape[0] and in_boxes(x1, y1, x2, y2, redrawn):
                hidden = segment_crosses(x1, y1, x2, y2, area)
            if hidden:
                weight = math.inf
            elif everything or weight == math.inf or in_reach(x1, y1, x2, y2, changed):
                weight = 0.0
                if not primitive:
                    # added up from the far end, as `pair_cost` does it
                    part = (j - i) // stride(i, j, width, height)
                    for end in range(j, i, -part):
                        weight = out[end - part, end] + weight
                if primitive or weight == math.inf:
                    weight = pair_cost(positions, width, height, i, j, k, field)
            out[i, j] = weight
            out[j, i] = weight
