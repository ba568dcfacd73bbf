"""Solvers that decide step by step, from local information."""

# where those who write a solver of this kind have imported it from
from cgla_graph.solvers.reactive.step_by_step import Reactive

__all__ = ["Reactive"]
