"""Solvers that decide step by step, from local information."""

# solvers of others import it from here
from cgla_graph.solvers.reactive.step_by_step import Reactive

__all__ = ["Reactive"]
