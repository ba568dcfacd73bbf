"""The old name of `cgla_graph.scenarios.random_map`, for those who import from it."""

from cgla_graph.scenarios.random_map import difficulty, random_scenario, random_scenarios

__all__ = ["difficulty", "random_scenario", "random_scenarios"]
