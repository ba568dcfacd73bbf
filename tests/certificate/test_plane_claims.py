"""No claim of a deterministic solver about all paths is refuted by a path, on random problems."""

import math

import plane_claims
import pytest
import strategies
from plane_claims import faults, faults_of_plan, faults_of_solution, tried

import cgla_graph as cg
from cgla_graph.solvers import registry
from cgla_graph.solvers.trade_off.plan_within import PlanWithin

NAMES = [name for name in plane_claims.QUICK if not registry.missing(name)]
#: Problems of each solver: 1,000 in all, as `make check` runs them.
NUMBER = math.ceil(1000 * strategies.TIMES / len(NAMES))

pytestmark = pytest.mark.filterwarnings("ignore::cgla_graph.model.risk.SmallSpreadWarning")


@pytest.fixture(autouse=True)
def _quick(monkeypatch: pytest.MonkeyPatch) -> None:
    plane_claims.make_quick(monkeypatch)


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("numbers", [range(1), pytest.param(range(1, NUMBER), marks=pytest.mark.slow)], ids=str)
def test_no_path_refutes_what_is_said_of_the_plane(name: str, numbers: range) -> None:
    for number in numbers:
        there, limited = number * len(NAMES) + NAMES.index(name), "risk" if number % 2 else "length"
        assert faults(there, name, limited, **plane_claims.QUICK[name]) == []


def test_what_is_false_is_seen() -> None:
    problem, known, _ = tried(9)
    best = min((one.path for one in known), key=lambda path: path.length)
    for bound in (math.inf, 1.01 * best.length):
        answer = cg.Solution(cg.Status.NOT_FOUND, lower_bound=bound)
        plan = PlanWithin(answer, "risk", 1.01 * best.risk, 0.0, bound, "plane", 1)
        assert list(faults_of_plan(problem, plan, known))
        assert list(faults_of_solution(problem, cg.Solution(cg.Status.NOT_FOUND, lower_bound=1e9), known))
    closed = cg.Solution(cg.Status.NO_PATH, message="the no-fly areas seal the way")
    assert list(faults_of_plan(problem, PlanWithin(closed, "risk", 0.0, 0.0, 0.0, "plane", 1), known))
    assert list(faults_of_solution(problem, closed, known))
