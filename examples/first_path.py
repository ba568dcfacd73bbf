"""A first path: threats, a no-fly area, the best path past them, and the proof of how good it is."""

import shapely

import cgla_graph as cg

field = cg.RiskField([cg.Threat(x=4, y=4, spread=1.0, peak=0.8), cg.Threat(x=7, y=3, spread=0.8)])
problem = cg.Problem(
    start=(1, 1), goal=(9, 8), field=field, k=20, bounds=(0, 0, 10, 10), no_fly=shapely.box(6, 5, 7, 7)
)

best = cg.solve(problem)
straight = problem.evaluate([problem.start, problem.goal])
print(f"best      cost {best.cost:7.3f}   length {best.length:7.3f}   risk {best.risk:.4f}")
print(f"straight  cost {straight.cost:7.3f}   length {straight.length:7.3f}   risk {straight.risk:.4f}")
print(f"          {straight.violations[0]}")
print(f"no path costs less than {best.lower_bound:.3f}: the best is within {best.gap:.2%} of what is possible")
