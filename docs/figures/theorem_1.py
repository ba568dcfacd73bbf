"""The graph on which two steps of the printed proof of Theorem 1 fail, and G after each of its rounds."""

import numpy as np
from drawing import BLUE, GREEN, GREY, ORANGE, RED, panels

import cgla_graph as cg
from cgla_graph.comparisons.claims import counterexamples

stored = counterexamples.graph("theorem-1-proof.json")
matrix = cg.cost_matrix(stored.graph, stored.target)
names = list(stored.graph.labels)
places = {"s": (0, 0), "a": (1, 1), "b": (1, -1), "t": (2.2, 0), "u": (3.2, 0)}

left, right = panels(["the graph", "G after each round"], width=3.8, height=3.0)
weights = stored.graph.weight_matrix()
for i, one in enumerate(names):
    for j, other in enumerate(names):
        if i < j and np.isfinite(weights[i, j]):
            ends = np.array([places[one], places[other]], dtype=float)
            left.plot(*ends.T, color="0.6", linewidth=1.2, zorder=1)
            left.text(*(0.42 * ends[0] + 0.58 * ends[1]), f"{weights[i, j]:g}", fontsize=9, backgroundcolor="white")
for name, place in places.items():
    left.plot(*place, "o", color="white", markeredgecolor="black", markersize=18, zorder=3)
    left.text(*place, name, ha="center", va="center", fontsize=10, zorder=4)
left.set(xlim=(-0.4, 3.5), ylim=(-1.4, 1.4), xticks=[], yticks=[], aspect="equal")
left.set_axis_off()

history = np.array(matrix.history())
for name, colour in zip("satb", (RED, ORANGE, GREY, BLUE), strict=True):
    values = history[:, names.index(name)]
    shown = np.where(np.isfinite(values), values, np.nan)
    right.plot(np.arange(len(values)), shown, "o-", color=colour, label=f"G({name})")
for number, node in enumerate(matrix.order):
    right.text(number + 1, -1.3, f"p_r = {names[node]}", ha="center", fontsize=8, color=GREEN)
right.set(xlabel="round", xlim=(-0.2, 4.5), ylim=(-2, 10), xticks=range(len(history)))
right.legend(frameon=False, fontsize=8)
