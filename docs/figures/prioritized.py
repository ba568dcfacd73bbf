"""Two UAVs change places: planned each alone they meet, prioritized their distance never falls below the safe one."""

import matplotlib.pyplot as plt
import numpy as np
from drawing import BLUE, GREY, ORANGE, RED

import cgla_graph as cg

variants = cg.load_mission("swap").missions(cg.solvers.get)
names = ("each alone", "prioritized")
figure, every = plt.subplot_mosaic([[names[0], "right"], [names[1], "right"]], figsize=(7.6, 3.2), layout="constrained")
right = every["right"]
right.set_title("their distance", fontsize=9.5)
for name, colour in zip(names, (RED, BLUE), strict=True):
    axes = every[name]
    axes.set_title(name, fontsize=9.5)
    flight = variants[name].fly()
    both = list(flight.uavs.values())
    for uav, shade in zip(both, (BLUE, ORANGE), strict=True):
        axes.plot(*uav.path.T, color=shade, linewidth=1.6)
        axes.plot(*uav.trace[:: max(1, len(uav.trace) // 12)].T, ".", color=shade, markersize=5)
    axes.set(xlim=(0, 1), ylim=(0.35, 0.75), aspect="equal", xticks=[], yticks=[])
    moments = np.linspace(0.0, min(uav.times[-1] for uav in both), 600)
    places = [np.column_stack([np.interp(moments, uav.times, uav.path[:, axis]) for axis in (0, 1)]) for uav in both]
    right.plot(moments, np.linalg.norm(places[0] - places[1], axis=1), color=colour, label=name)
safe = both[0].uav.safe_distance
right.axhline(safe, color=GREY, linewidth=0.8, linestyle=":")
right.text(0, safe + 0.015, "safe distance", fontsize=8, color=GREY)
right.set(xlabel="tick", ylim=(0, None))
right.legend(frameon=False, fontsize=8)
