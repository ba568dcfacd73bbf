"""The flight of the tutorial's mission: where the two were, and how far apart."""

import numpy as np
from drawing import BLUE, GREY, ORANGE, draw_map, panels

import cgla_graph as cg

world = cg.World(
    cg.RiskField([cg.Threat(0.5, 0.55, 0.08)]),
    bounds=(0, 0, 1, 1),
    timed=[cg.TimedThreat(cg.Threat(0.75, 0.3, 0.06), appears=5)],
)
ends = {"a": ((0.1, 0.1), (0.9, 0.8)), "b": ((0.1, 0.6), (0.9, 0.4))}
uavs = [
    cg.Uav(name, start, goal, detection_radius=0.25, safe_distance=0.1, k=20) for name, (start, goal) in ends.items()
]
mission = cg.Mission(world, uavs, cg.solvers.get("dijkstra"), resolution=12, avoidance="prioritized")
flight = mission.fly()

left, right = panels(["the flight", "distance of the two"], width=3.6, height=3.4)
for uav, colour in zip(flight.uavs.values(), (BLUE, ORANGE), strict=True):
    draw_map(left, cg.Problem(uav.uav.start, uav.uav.goal, world.field_at(10), 20, world.bounds))
    left.plot(*uav.path.T, color=colour, zorder=4, label=f"{uav.name}: {len(uav.replans)} plans")
    left.plot(*uav.trace[::5].T, ".", color=colour, zorder=4)
left.legend(frameon=False, fontsize=8, loc="upper left")
both = list(flight.uavs.values())
moments = np.linspace(0.0, min(uav.times[-1] for uav in both), 500)
tracks = [np.column_stack([np.interp(moments, uav.times, uav.path[:, axis]) for axis in (0, 1)]) for uav in both]
right.plot(moments, np.linalg.norm(tracks[0] - tracks[1], axis=1), color=BLUE)
right.axhline(0.1, color=GREY, linewidth=0.8, linestyle=":")
right.text(0, 0.11, "safe distance", fontsize=8, color=GREY)
right.set(xlabel="tick", ylim=(0, None))
