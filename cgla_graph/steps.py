"""The old name of `cgla_graph.model.solver`, for those who import from it."""

from cgla_graph.model.solver import Move, StepByStep

__all__ = ["Move", "StepByStep"]
