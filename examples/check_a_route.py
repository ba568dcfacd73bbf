"""Somebody's route, held against all others: whether it is feasible, what it costs, and how much could be gained."""

import cgla_graph as cg

ROUTE = [(0.1, 0.1), (0.12, 0.5), (0.3, 0.8), (0.6, 0.95), (0.9, 0.9)]

problem = cg.load_scenario("paper").problem
theirs = problem.evaluate(ROUTE)
print(f"theirs: cost {theirs.cost:.4f}, feasible: {theirs.feasible}")

proof = cg.lower_bound(problem, tolerance=0.05, path=ROUTE)
print(f"no path costs less than {proof.lower_bound:.4f}: at most {proof.gap:.1%} above the best possible")

bent = cg.solve(problem, "refine", base=ROUTE)
print(f"bent where it is: {bent.cost:.4f}, {1 - bent.cost / theirs.cost:.1%} less; {len(bent.path)} waypoints")
