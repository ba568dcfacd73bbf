"""A mission: two UAVs cross each other's way while a storm comes up, and keep their distance at every moment."""

import cgla_graph as cg

storm = cg.TimedThreat(cg.Threat(x=0.7, y=0.4, spread=0.06), appears=5)
world = cg.World(cg.RiskField([cg.Threat(x=0.45, y=0.55, spread=0.07)]), bounds=(0, 0, 1, 1), timed=[storm])
uavs = [
    cg.Uav("red", start=(0.1, 0.1), goal=(0.9, 0.8), detection_radius=0.25, safe_distance=0.1, k=20),
    cg.Uav("blue", start=(0.1, 0.7), goal=(0.9, 0.2), detection_radius=0.25, safe_distance=0.1, k=20),
]
mission = cg.Mission(world, uavs, cg.solvers.get("dijkstra"), resolution=12, avoidance="prioritized")
flight = mission.fly()

for name, one in flight.uavs.items():
    print(f"{name:5} {one.status.label}: length {one.length:.3f}, risk {one.risk:.4f}, plans at ticks {one.replans}")
closest = flight.separations[0]
print(f"closest {closest.distance:.3f} at tick {closest.time:.1f}; asked for {uavs[0].safe_distance}")
