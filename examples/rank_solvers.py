"""A small comparison: some solvers on random maps, ranked by what the oracle says of their paths."""

from cgla_graph import comparisons
from cgla_graph.scenarios.random_map import random_scenario

maps = [random_scenario(seed, threats=8, resolution=12) for seed in range(4)]
solvers = [comparisons.Entrant.parse(name) for name in ("fast-marching", "cgla", "eight-direction", "straight-line")]
study = comparisons.Study(maps, solvers, tolerance=0.05)
runs = list(comparisons.run_study(study, workers=0))  # in this process: small enough

for row in comparisons.standings(runs):
    low, high = row.success
    print(
        f"{row.place}. {row.solver:16} median gap {row.gap.median:7.2%}   cheapest on {row.wins} of {row.n_instances}"
        f"   a path on {row.n_paths} of {row.n_runs} ({low:.0%} to {high:.0%})"
    )
