"""Exact at scale: the nodes that can be part of the optimum, and what becomes of the pairs between them."""

import numpy as np
from drawing import BLUE, ORANGE, draw_map, draw_path, panels

import cgla_graph as cg
from cgla_graph.restricted.restricted import restricted_optimum

N = 100
problem = cg.load_scenario("paper").problem
on = problem.on_lattice(N)
found = restricted_optimum(on)
positions = np.asarray(on.graph.positions)
every = on.graph.n_nodes * (on.graph.n_nodes - 1) // 2

left, right = panels([f"nodes kept: {len(found.kept):,} of {on.graph.n_nodes:,}", "pairs left"], width=3.8, height=3.4)
draw_map(left, problem)
left.plot(*positions[found.kept].T, ".", color=ORANGE, markersize=2.2, zorder=3)
draw_path(left, positions[np.array(found.nodes)], BLUE)

steps = {
    "of the complete graph": every,
    "of kept nodes, looked at": found.counts["pairs"],
    "near enough": found.counts["near"],
    "no third node between": found.counts["primitive"],
    "past the middle's bound": found.counts["middle"],
    "past the raster's bound": found.counts["raster"],
    "integrated": found.counts["integrated"],
}
right.barh(range(len(steps)), list(steps.values()), color=BLUE, log=True)
for at, count in enumerate(steps.values()):
    right.text(count * 1.3, at, f"{count:,}", va="center", fontsize=8)
right.set(yticks=range(len(steps)), yticklabels=list(steps), xlim=(1, every * 300))
right.tick_params(labelsize=8)
right.invert_yaxis()
