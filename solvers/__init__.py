"""Solvers: one algorithm a file, a registry of names, and `solve`, which has the oracle judge every answer."""

import importlib
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cgla_graph.model.solver import GraphSolver as GraphSolver
    from cgla_graph.model.solver import PlaneSolver as PlaneSolver
    from cgla_graph.model.solver import Solver as Solver
    from cgla_graph.model.solver import Traits as Traits
    from cgla_graph.solvers.registry import get as get
    from cgla_graph.solvers.registry import missing as missing
    from cgla_graph.solvers.registry import names as names
    from cgla_graph.solvers.registry import traits as traits
    from cgla_graph.solvers.solving import solve as solve

_HOMES = {
    "GraphSolver": "model.solver",
    "PlaneSolver": "model.solver",
    "Solver": "model.solver",
    "Traits": "model.solver",
    "get": "solvers.registry",
    "missing": "solvers.registry",
    "names": "solvers.registry",
    "solve": "solvers.solving",
    "traits": "solvers.registry",
}
__all__ = ["GraphSolver", "PlaneSolver", "Solver", "Traits", "get", "missing", "names", "solve", "traits"]


def __getattr__(name: str) -> Any:  # noqa: ANN401 - any of the names above
    """Import a name when it is first used: to list solvers, none of this is needed."""
    if name in _HOMES:
        value = getattr(importlib.import_module(f"cgla_graph.{_HOMES[name]}"), name)
        globals()[name] = value
        return value
    msg = f"module 'cgla_graph.solvers' has no attribute {name!r}"
    raise AttributeError(msg)


def __dir__() -> list[str]:
    """List the names, imported or not."""
    return sorted({*__all__, *globals()})
