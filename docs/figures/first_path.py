"""Paths for three values of k."""

import matplotlib.pyplot as plt
from drawing import BLUE, GREEN, ORANGE, draw_map, draw_path

import cgla_graph as cg

field = cg.RiskField([cg.Threat(x=4, y=4, spread=1.0, peak=0.8), cg.Threat(x=7, y=3, spread=0.8)])
figure, axes = plt.subplots(figsize=(4.6, 4.2))
for k, colour in ((1, ORANGE), (5, GREEN), (20, BLUE)):
    problem = cg.Problem(start=(1, 1), goal=(9, 8), field=field, k=k, bounds=(0, 0, 10, 10))
    best = cg.solve(problem)
    if k == 1:
        draw_map(axes, problem)
    draw_path(axes, best.path, colour, label=f"k = {k}: length {best.length:.1f}, risk {best.risk:.2f}")
axes.legend(frameon=False, fontsize=8, loc="upper left")
