"""How far the optimum of a lattice is above what no path undercuts, for rising numbers of points a side."""

import matplotlib.pyplot as plt
from drawing import BLUE, GREEN, GREY, ORANGE

import cgla_graph as cg

sides = (10, 14, 20, 28, 80, 160)
figure, axes = plt.subplots(figsize=(5.2, 3.4), layout="constrained")
for name, colour in (("paper", BLUE), ("fifty-threats", ORANGE), ("trap", GREEN)):
    problem = cg.load_scenario(name).problem
    bound = cg.lower_bound(problem, 5e-4).lower_bound
    gaps = [100.0 * (cg.solve(problem, "cgla", resolution=side).cost / bound - 1.0) for side in sides]
    hybrid = 100.0 * (cg.solve(problem).cost / bound - 1.0)
    axes.loglog(sides, gaps, "o-", color=colour, label=f"{name}, cgla", markersize=4)
    axes.axhline(hybrid, color=colour, linewidth=0.9, linestyle="--")
axes.plot([], [], "--", color=GREY, linewidth=0.9, label="hybrid, in the plane")
axes.set(xlabel="points a side", ylabel="gap, per cent", xticks=sides, xticklabels=sides)
axes.minorticks_off()
axes.legend(frameon=False, fontsize=8)
