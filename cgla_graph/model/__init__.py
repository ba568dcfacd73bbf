"""The model: risk, no-fly areas, graphs, problems, solutions, and the contract of solvers."""
