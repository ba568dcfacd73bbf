"""The map of the first tutorial, its best path, and the straight line."""

import cgla_graph as cg

field = cg.RiskField([cg.Threat(x=4, y=4, spread=1.0, peak=0.8), cg.Threat(x=7, y=3, spread=0.8)])
problem = cg.Problem(start=(1, 1), goal=(9, 8), field=field, k=20, bounds=(0, 0, 10, 10))
problem.plot(cg.solve(problem), cg.solve(problem, "straight-line"))
