"""Solvers: one algorithm a file, a registry of names, and `solve`, which has the oracle judge every answer."""

from cgla_graph.model.solver import GraphSolver, PlaneSolver, Solver, Traits
from cgla_graph.solvers.registry import get, missing, names, traits
from cgla_graph.solvers.solving import solve

__all__ = ["GraphSolver", "PlaneSolver", "Solver", "Traits", "get", "missing", "names", "solve", "traits"]
