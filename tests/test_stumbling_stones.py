"""Common mistakes in Python: each message is one short line with the remedy."""

import re
from collections.abc import Callable

import numpy as np
import pytest

import cgla_graph as cg
from cgla_graph.comparisons import Entrant, Study, compare
from cgla_graph.errors import CglaError
from cgla_graph.model import weights

PROBLEM = cg.Problem((0.1, 0.1), (0.9, 0.9))
ARRAY = np.zeros((100, 100))


@pytest.mark.parametrize(
    ("mistake", "said"),
    [
        (lambda: cg.Problem((0, 0), (1, 1), field=ARRAY), "field is an array of shape (100, 100); give a RiskField"),
        (
            lambda: cg.Problem((0, 0), (1, 1), field=[cg.Threat(0.5, 0.5, 0.1)]),
            "give a RiskField, as RiskField([Threat(",
        ),
        (lambda: cg.Problem(ARRAY, (1, 1)), "start is an array of shape (100, 100); give (x, y)"),
        (lambda: cg.solve(PROBLEM, ARRAY), "solver is an ndarray; give a name, as 'hybrid'"),
        (lambda: Study([ARRAY], ["cgla"]), "a scenario is an array of shape (100, 100); give a Scenario, a Problem"),
        (lambda: Study([PROBLEM], [3]), "an entrant is 3; give a text"),
        (lambda: cg.GeometricGraph.from_matrix(np.zeros((0, 0))), "the graph has no nodes; give one with some"),
        (
            lambda: cg.GeometricGraph.from_matrix([[0.0]]).index_of("z"),
            "node 'z' is not in the graph; it has 1 node: 0",
        ),
        (
            lambda: cg.solve(PROBLEM, "cgla", resolution=100_000),
            "100000 x 100000 points is larger than 1e+08 points; lower",
        ),
    ],
)
def test_mistakes_give_one_short_line(mistake: Callable[[], object], said: str) -> None:
    with pytest.raises(CglaError, match=re.escape(said)) as caught:
        mistake()
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 200


def test_problems_and_names_are_compared() -> None:
    study = Study([PROBLEM, "paper"], ["cgla", Entrant.parse("straight-line")])
    assert [scenario.name for scenario in study.scenarios] == ["problem-1", "paper"]
    assert next(tuple(cell) for cell in study.cells()) == ("problem-1", "cgla", None)
    runs = compare([PROBLEM], ["straight-line"], tolerance=None)
    assert [(run.scenario.name, run.solver) for run in runs] == [("problem-1", "straight-line")]


def test_a_graph_that_does_not_fit_is_refused_before_memory_runs_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(weights, "free_memory", lambda: 1e8)
    found = cg.solve(PROBLEM, "dijkstra", resolution=90)
    assert found.status is cg.Status.UNSUPPORTED
    said = "all weights of 8102 nodes, 0.525 GB, where 0.1 GB of memory are free (a lower resolution needs less)"
    assert said in found.message
