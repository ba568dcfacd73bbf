"""What less risk costs in length: the paths that are best for some k, on the paper's map."""

import matplotlib.pyplot as plt
import numpy as np
from drawing import BLUE, ORANGE, RED, draw_map, draw_path, panels
from matplotlib.colors import to_hex

import cgla_graph as cg

problem = cg.load_scenario("paper").problem
front = cg.pareto(problem, solver="cgla", resolution=20)
left, right = panels(["paths", "the front"], width=3.8, height=3.3)
draw_map(left, problem)
points = list(front)
shades = plt.get_cmap("viridis_r")(np.linspace(0.1, 1.0, len(points)))
for point, shade in zip(points, shades, strict=True):
    draw_path(left, point.path, to_hex(shade), linewidth=0.8)
right.plot([p.length for p in points], [p.risk for p in points], ".-", color=BLUE, linewidth=0.8, markersize=4)
for k, above in ((1.0, 8), (10.0, 8), (100.0, 8)):
    at = front.at(k)
    right.plot(at.length, at.risk, "o", color=ORANGE, markersize=6)
    right.annotate(f"k = {k:g}", (at.length, at.risk), (4, above), textcoords="offset points", fontsize=8)
knee = front.knee
right.plot(knee.length, knee.risk, "s", color=RED, markersize=6, label=f"knee: k from {knee.k_low:.3g}")
right.set(xlabel="length", ylabel="risk", yscale="log")
right.legend(frameon=False, fontsize=8)
