"""Solvers: one algorithm a file, a registry of names, and `solve`, which has the oracle judge every answer."""

from cgla_graph.solvers.base import GraphSolver, PlaneSolver, Solver, Traits
from cgla_graph.solvers.bridge import solve
from cgla_graph.solvers.registry import get, missing, names, traits

__all__ = ["GraphSolver", "PlaneSolver", "Solver", "Traits", "get", "missing", "names", "solve", "traits"]
