"""`cgla_graph.testing`: strategies that draw all kinds, Theorem 1 as an assertion, the contract as tests of pytest."""

import dataclasses
import subprocess
import sys
from collections.abc import Callable
from typing import Any, TypeVar

import numpy as np
import pytest
from hypothesis import Phase, given, settings
from hypothesis import find as smallest
from hypothesis.strategies import SearchStrategy
from scipy import sparse
from strategies import usual

import cgla_graph as cg
from cgla_graph import testing
from cgla_graph.cost_to_go.cost_matrix import cost_matrix
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.solver import Solver
from cgla_graph.model.weights import SparseWeights
from cgla_graph.solvers.checks import SolverCheck

T = TypeVar("T")


def find(strategy: SearchStrategy[T], wanted: Callable[[T], object]) -> T:
    """Return the first example with a property, which need not be the smallest."""
    return smallest(
        strategy, lambda one: bool(wanted(one)), settings=settings(max_examples=5000, phases=[Phase.generate])
    )


CHAIN = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels="abc")


@usual
@given(testing.graph_problems())
def test_theorem_1_holds_on_graphs_of_all_kinds(problem: cg.GraphProblem) -> None:
    checked = testing.assert_theorem_1(problem.graph, problem.target, problem.source)
    assert checked.matrix is not None
    assert checked.matrix.path_from(problem.source)[-1:] in ([problem.target], [])


@pytest.mark.parametrize(
    "kind",
    [
        lambda graph: graph.is_sparse and graph.directed,
        lambda graph: graph.is_implicit,
        lambda graph: graph.lattice is not None and graph.is_sparse,
        lambda graph: isinstance(graph.labels[0], str),
        lambda graph: isinstance(graph.labels[0], frozenset),
        lambda graph: graph.n_nodes == 1,
        lambda graph: not np.isfinite(graph.weights_from(0)).all(),
        lambda graph: (graph.to_csgraph().data == 0.0).any(),
    ],
    ids=["one-way", "implicit", "eight", "texts", "sets", "single", "missing", "zero"],
)
def test_graphs_of_each_kind_are_drawn(kind: Callable[[GeometricGraph], bool]) -> None:
    assert kind(find(testing.graphs(), kind))


def test_problems_and_fields_are_drawn_with_all_that_they_may_have() -> None:
    assert find(testing.problems(), lambda problem: problem.no_fly is not None and problem.field.threats).k >= 0.0
    assert find(testing.raster_fields(), lambda field: field.threats and field.rasters)
    assert find(testing.problems(areas=False), bool).no_fly is None


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        ({"order": [2, 0, 1]}, r"Theorem 1 \(2\).*, at 'a', in round 3"),
        ({"values": [2.0, 1.5, 0.0]}, r"Theorem 1 \(1\).*, at 'b'"),
        ({"order": [2, 1], "rounds": 2}, r"Theorem 1 \(1\)"),
    ],
)
def test_a_wrong_cost_matrix_fails_with_its_witness(changes: dict[str, Any], says: str) -> None:
    wrong = {key: np.array(value) if isinstance(value, list) else value for key, value in changes.items()}
    with pytest.raises(AssertionError, match=says):
        testing.assert_theorem_1(CHAIN, "c", matrix=dataclasses.replace(cost_matrix(CHAIN, "c"), **wrong))


def test_a_weight_below_0_fails_and_a_node_that_is_cut_off_does_not() -> None:
    rows = sparse.csr_array(np.array([[0.0, -1.0], [0.0, 0.0]]))
    with pytest.raises(AssertionError, match="weights at least 0, at 'a', 't'"):
        testing.assert_theorem_1(GeometricGraph("at", directed=True, weights=SparseWeights(rows)), "t")
    apart = GeometricGraph.from_matrix([[0, 1, np.inf], [1, 0, np.inf], [np.inf, np.inf, 0]], labels="abc")
    for source in (None, "a", "c"):
        assert testing.assert_theorem_1(apart, "b", source).target == "b"


def test_what_is_not_checked_fails(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("cgla_graph.cost_to_go.theorem_1.MOST_SETTLED", 2)
    with pytest.raises(AssertionError, match=r"Lemma 1.*not checked: 3 nodes"):
        testing.assert_theorem_1(CHAIN, "c")


@testing.parametrize_with_checks(["cgla", "straight-line"])
def test_the_contract_is_one_test_for_each_check(solver: Solver, check: SolverCheck) -> None:
    check(solver)


def test_the_checks_have_names_and_fail_alone() -> None:
    class Liar(type(cg.solvers.get("dijkstra"))):  # type: ignore[misc]
        def solve(self, problem: cg.GraphProblem) -> cg.Solution:
            found = super().solve(problem)
            return cg.Solution(cg.Status.NO_PATH) if problem.graph.directed and problem.target == 2 else found

    @testing.parametrize_with_checks([Liar()])
    def contract(solver: Solver, check: SolverCheck) -> None:
        check(solver)

    (mark,) = contract.pytestmark  # type: ignore[attr-defined]
    failed = []
    for case in mark.args[1]:
        try:
            contract(*case.values)
        except AssertionError:
            failed.append(case.id)
    assert failed == ["dijkstra-on one-way edges"]


def test_importing_it_changes_no_profile_and_needs_hypothesis() -> None:
    lines = (
        "import sys\nsys.modules['hypothesis'] = None\n"
        "try:\n    import cgla_graph.testing\nexcept ImportError as error:\n    print(error)\n"
        "del sys.modules['hypothesis']\n"
        "from hypothesis import settings\nbefore = settings().max_examples, settings().deadline\n"
        "import cgla_graph.testing\nassert (settings().max_examples, settings().deadline) == before\n"
    )
    found = subprocess.run([sys.executable, "-c", lines], capture_output=True, text=True, check=True)
    assert "pip install 'cgla-graph[testing]'" in found.stdout.splitlines()[-1]
