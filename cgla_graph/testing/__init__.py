"""
Tests of your own: strategies of hypothesis, Theorem 1 as an assertion, the contract of solvers as tests of pytest.

``pip install 'cgla-graph[testing]'``. No profile of hypothesis is changed.
"""

from cgla_graph.solvers.checks import check_solver
from cgla_graph.testing.solver_contract import parametrize_with_checks
from cgla_graph.testing.strategies import (
    crowds,
    fields,
    graph_problems,
    graphs,
    lattices,
    networks,
    polygons,
    problems,
    raster_fields,
    rasters,
    threats,
    weight_matrices,
    whole_weights,
)
from cgla_graph.testing.theorem_1 import assert_theorem_1

__all__ = [
    "assert_theorem_1",
    "check_solver",
    "crowds",
    "fields",
    "graph_problems",
    "graphs",
    "lattices",
    "networks",
    "parametrize_with_checks",
    "polygons",
    "problems",
    "raster_fields",
    "rasters",
    "threats",
    "weight_matrices",
    "whole_weights",
]
