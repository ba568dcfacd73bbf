"""Small missions for tests of what is made of flights: two crossing UAVs, and the same in degrees."""

from pathlib import Path

from cgla_graph.comparisons.missions.fly import StopRequest, fly_one, open_mission
from cgla_graph.comparisons.study.mission_run import MissionRun

#: Two UAVs that cross, told apart by sharing; a threat that comes and moves, an area that comes and goes.
CROSSING = """
title = "two cross"
k = 5.0
detection_radius = 0.3
safe_distance = 0.15
step = 0.05
threats = [{ x = 0.5, y = 0.45, spread = 0.08 }, { x = 0.1, y = 0.5, spread = 0.05 }]
uavs = [
    { name = "a", start = [0.1, 0.1], goal = [0.9, 0.9] },
    { name = "b", start = [0.1, 0.9], goal = [0.9, 0.1] },
]
timed_threats = [{ x = 0.7, y = 0.7, spread = 0.05, appears = 3, vanishes = 30, moves = [[8, 0.75, 0.7]] }]
timed_areas = [{ polygon = [[0.3, 0.6], [0.4, 0.6], [0.4, 0.7], [0.3, 0.7]], appears = 2, vanishes = 40 }]

[no_fly]
polygons = [[[0.45, 0.0], [0.55, 0.0], [0.55, 0.2], [0.45, 0.2]]]

[lattice]
resolution = 8

[fly]
collisions = "record"
virtual_obstacle = { stepnum = 1, spread = 0.03 }

[[variants]]
name = "alone"
sharing = "none"

[[variants]]
name = "told"
sharing = "global"
"""
#: One UAV and no threat, in longitude and latitude.
DEGREES = """
title = "one way north"
coordinates = "lonlat"
bounds = [24.0, 60.0, 24.4, 60.2]
detection_radius = 2000.0
step = 1000.0
uavs = [{ name = "solo", start = [24.05, 60.02], goal = [24.35, 60.18] }]
[lattice]
resolution = 5
"""


def flown_of(text: str, folder: Path, *, name: str = "small", **options: object) -> list[MissionRun]:
    """Fly every variant of a mission written down in a folder."""
    path = folder / f"{name}.toml"
    path.write_text(text, encoding="utf-8")
    _, specs = open_mission(str(path), **options)
    return [fly_one(spec, None, StopRequest()) for spec in specs]
