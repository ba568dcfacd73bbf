"""The cost matrix as it settles: the nodes after so many rounds, by their least cost to the target."""

import matplotlib.pyplot as plt
import numpy as np
from drawing import BLUE, draw_map, panels

import cgla_graph as cg

problem = cg.load_scenario("paper").problem
on = problem.on_lattice(20)
matrix = cg.cost_matrix(on.graph, on.target)
positions = np.asarray(on.graph.positions)
rounds = (1, 60, 200, len(matrix.order))
top = matrix.values.max()

for axes, number in zip(
    panels([f"after {n} round{'s' * (n > 1)}" for n in rounds], width=2.2, height=2.7), rounds, strict=True
):
    draw_map(axes, problem)
    settled = matrix.order[:number]
    axes.plot(*positions.T, ".", color="0.75", markersize=1.5, zorder=2)
    looks = {"cmap": "viridis_r", "vmin": 0, "vmax": top, "s": 9, "zorder": 3}
    dots = axes.scatter(*positions[settled].T, c=matrix.values[settled], **looks)
    if number > 1:
        for node in settled:
            ends = positions[[node, matrix.successors[node]]] if matrix.successors[node] >= 0 else None
            if ends is not None:
                axes.plot(*ends.T, color="0.4", linewidth=0.35, zorder=2.5)
axes.plot(*positions[np.array(matrix.path_from(on.source))].T, color=BLUE, linewidth=2, zorder=4)
plt.colorbar(dots, ax=axes, shrink=0.7, label="G: least cost to the target")
