"""Repair: a threat pops up, and only the nodes whose best paths meet it get new values."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, RED, draw_map, draw_path, panels

import cgla_graph as cg
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, repair

problem = cg.load_scenario("paper").problem
lattice = cg.Lattice(30, bounds=problem.bounds)
target = lattice.nearest(problem.goal)
source = lattice.nearest(problem.start)
before = lazy_cost_matrix(cg.GeometricGraph.complete(lattice, problem.field, problem.k), target)
new = cg.Threat(0.28, 0.72, 0.04)
after = repair(before, cg.CostModel(problem.field.with_threats([new]), problem.k))
positions = np.asarray(before.graph.positions)
changed = after.values > before.values + 1e-12
share = changed.mean()

left, right = panels(["before", f"after: {share:.0%} of the values rose"], width=3.6, height=3.5)
later = cg.Problem(problem.start, problem.goal, after.graph.model.field, problem.k, problem.bounds)
for axes, what, matrix in ((left, problem, before), (right, later, after)):
    draw_map(axes, what)
    draw_path(axes, positions[np.array(matrix.path_from(source))], BLUE)
left.plot(*positions.T, ".", color=GREY, markersize=1.5, zorder=3)
right.plot(*positions[~changed].T, ".", color=GREY, markersize=1.5, zorder=3)
right.plot(*positions[changed].T, ".", color=ORANGE, markersize=4, zorder=3)
draw_path(right, positions[np.array(before.path_from(source))], RED, linestyle=":")
