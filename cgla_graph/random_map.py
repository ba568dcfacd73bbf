"""The old name of `cgla_graph.scenarios.random_map`, for those who import from it."""

from cgla_graph.scenarios.random_map import random_scenario as random_scenario
