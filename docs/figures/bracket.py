"""The tube and the bracket: grid after grid, less of the map is left, and less between the two bounds."""

import matplotlib.pyplot as plt
import numpy as np
import shapely
from drawing import BLUE, RED, draw_map, draw_path, panels
from matplotlib.patches import PathPatch

import cgla_graph as cg
from cgla_graph.plots.scene import outline

problem = cg.load_scenario("fifty-threats").problem
best = cg.solve(problem)
proof = cg.lower_bound(problem, 1e-3, path=best.path)


def tube(grid: cg.certificate.certificate.Grid) -> shapely.Geometry:
    """Return the cells of a grid as one geometry."""
    low, high = np.reshape(problem.bounds, (2, 2))
    steps = (high - low) / np.array(grid.last)
    rows, first, end = grid.runs.T
    corner, far = [low[0] + (first - 0.5) * steps[0], low[1] + (rows - 0.5) * steps[1]], (end - 0.5, rows + 0.5)
    boxes = shapely.box(*corner, low[0] + far[0] * steps[0], low[1] + far[1] * steps[1])
    return shapely.intersection(shapely.union_all(boxes), shapely.box(*problem.bounds))


left, right = panels([f"the tubes of {len(proof.grids)} grids", "the bracket"], width=3.8, height=3.4)
draw_map(left, problem)
for number, grid in enumerate(proof.grids[1:]):
    colour = plt.get_cmap("YlOrBr")(0.35 + 0.45 * number / max(1, len(proof.grids) - 2))
    left.add_patch(PathPatch(outline(tube(grid), 1.0), facecolor=(*colour[:3], 0.35), edgecolor=colour, zorder=3))
draw_path(left, best.path)

cells = [max(grid.last) for grid in proof.grids]
right.plot(cells, [grid.upper_bound for grid in proof.grids], "o-", color=BLUE, label="a path costs this")
right.plot(cells, [grid.lower_bound for grid in proof.grids], "s-", color=RED, label="no path costs less")
ends = [[grid.lower_bound for grid in proof.grids], [grid.upper_bound for grid in proof.grids]]
right.fill_between(cells, *ends, color="0.9")
right.set_xscale("log", base=2)
right.set(xlabel="cells along a side", xticks=cells, xticklabels=cells)
for grid, at in zip(proof.grids, cells, strict=True):
    gap = grid.upper_bound / grid.lower_bound - 1.0
    right.annotate(f"{gap:.2%}", (at, grid.lower_bound), (0, -14), textcoords="offset points", fontsize=8, ha="center")
right.margins(x=0.12, y=0.2)
right.legend(frameon=False, fontsize=8, loc="lower right")
