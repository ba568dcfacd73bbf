"""The old name of `cgla_graph.model.solver`, for those who import from it."""

from cgla_graph.model.solver import Move as Move
from cgla_graph.model.solver import StepByStep as StepByStep
