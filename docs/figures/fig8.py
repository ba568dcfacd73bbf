"""The shipped mission `fig8` without virtual obstacles."""

import cgla_graph as cg

mission = next(iter(cg.load_mission("fig8").missions(cg.solvers.get).values()))
mission.fly().plot()
