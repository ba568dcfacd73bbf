"""Why a slope bound is one for every path: the height that is left and the cost still to be paid, along two paths."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, draw_map, draw_path, panels
from scipy.interpolate import RegularGridInterpolator

import cgla_graph as cg
from cgla_graph.certificate.subsolution import Level, first_grid
from cgla_graph.eikonal import cell_runs
from cgla_graph.plots.profile import profile_of

problem = cg.load_scenario("paper").problem
best = cg.solve(problem)
level = Level.lay(problem, first_grid(problem), cell_runs.rectangle(first_grid(problem)))
to_goal, _ = level.both(1e-4)

# the surface: control values of the spline at the nodes, as a grid
mesh = level.mesh
columns, rows = mesh.node_columns.max() + 1, mesh.node_rows.max() + 1
height = np.full((columns + 1, rows + 1), np.nan)
height[mesh.node_columns, mesh.node_rows] = to_goal.values[: mesh.n_nodes]
x = mesh.origin[0] + mesh.spacing[0] * np.arange(columns)
y = mesh.origin[1] + mesh.spacing[1] * np.arange(rows)
surface = RegularGridInterpolator((x, y), height[:columns, :rows], bounds_error=False)

left, right = panels(["the surface, as contours", "along both paths"], width=3.8, height=3.3)
draw_map(left, problem)
left.contour(x, y, height[:columns, :rows].T, levels=16, colors="0.35", linewidths=0.5, zorder=3)
straight = np.array([problem.start, problem.goal])
for path, colour, name in ((best.path, BLUE, "the best path"), (straight, ORANGE, "the straight line")):
    draw_path(left, path, colour)
    profile = profile_of(problem, path)
    part = profile.distance / profile.distance[-1]
    right.plot(part, profile.cost[-1] - profile.cost, color=colour, label=f"still to pay: {name}")
    right.plot(part, surface(profile.points), "--", color=colour, linewidth=1.2, label="height of the surface")
right.axhline(to_goal.bound, color=GREY, linewidth=0.7, linestyle=":")
right.text(0.02, to_goal.bound + 0.05, "the bound", fontsize=8, color=GREY)
right.set(xlabel="part of the path", ylim=(0, None))
right.legend(frameon=False, fontsize=8)
