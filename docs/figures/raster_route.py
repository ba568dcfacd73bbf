"""The route over the raster, and the density below it."""

import numpy as np
from drawing import BLUE, GREY, draw_map, draw_path, panels

import cgla_graph as cg
from cgla_graph.plots.profile import profile_of

cells = [
    [0, 0, 10, 0, 0, 0],
    [0, 60, 400, 150, 0, 0],
    [0, 90, 900, 700, 40, 0],
    [0, 0, 300, 250, 0, 0],
    [0, 0, 0, 20, 0, 0],
]
people = cg.RasterRisk(cells, bounds=(0, 0, 3000, 2500), scale=1 / 500**2)
problem = cg.Problem((200, 1250), (2800, 1250), cg.RiskField(rasters=[people]), k=2000, bounds=people.bounds)
best = cg.solve(problem)
straight = np.array([problem.start, problem.goal])

left, right = panels(["the route", "people per square kilometre below it"], width=3.8, height=3.0)
draw_map(left, problem)
for path, colour, name in ((straight, GREY, "straight"), (best.path, BLUE, "best")):
    draw_path(left, path, colour)
    profile = profile_of(problem, path)
    right.plot(profile.distance, profile.density * 1e6, color=colour, label=f"{name}: cost {profile.cost[-1]:,.0f} m")
right.set(xlabel="metres flown", ylim=(0, None))
right.legend(frameon=False, fontsize=8)
