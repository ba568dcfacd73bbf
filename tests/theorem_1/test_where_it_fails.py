"""Where Theorem 1 fails, and why: with weights below 0, which improper fields give, too."""

import numpy as np
import pytest
from theorem_cases import sweeps, unchecked

from cgla_graph._types import Bounds
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.errors import GraphError
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import ImproperFieldWarning, RiskField, Threat

UNIT: Bounds = (0.0, 0.0, 1.0, 1.0)


def test_negative_weights_freeze_wrong_values() -> None:
    # Node 1 is settled at 1; the way over node 2 would cost 2 - 5.
    weights = np.array([[0, 9, 9], [1, 0, -5], [2, 9, 0]], dtype=float)
    graph = unchecked(weights)
    assert cost_matrix(graph, 0).value(1) == 1.0
    assert cost_matrix(graph, 0).residual() > 0.0
    synchronous = cost_matrix(graph, 0, schedule="synchronous")
    assert synchronous.value(1) == -3.0
    assert synchronous.converged


def test_negative_weights_run_in_a_circle() -> None:
    # C13: each round makes the pair cheaper, without end.
    weights = np.array([[0, 9, 9], [1, 0, -2], [9, -2, 0]], dtype=float)
    graph = unchecked(weights)
    synchronous = cost_matrix(graph, 0, schedule="synchronous")
    assert not synchronous.converged
    assert synchronous.residual() > 0.0
    with pytest.raises(GraphError, match=r"cycle.*negative weights"):
        synchronous.path_from(1)
    few, many = sweeps(graph, 0, 5), sweeps(graph, 0, 50)
    assert many.value(1) < few.value(1) < 0.0


def test_eq1_as_printed_breaks_theorem_1() -> None:
    # C5: two overlapping threats that peak above 1 make weights negative.
    near = [Threat.from_eq1(x, 0.5, 0.05, reading="literal") for x in (0.5, 0.55)]
    with pytest.warns(ImproperFieldWarning):
        field = RiskField(near, improper=True)
    graph = GeometricGraph.complete(Lattice(5, bounds=UNIT), field, k=10.0)
    assert graph.weight_matrix().min() < 0.0
    settled = cost_matrix(graph, 0)
    assert settled.residual() > 0.0
    assert not settled.converged
    assert not cost_matrix(graph, 0, schedule="synchronous").converged
