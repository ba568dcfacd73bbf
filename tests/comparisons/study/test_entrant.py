"""Entrants: how they are read, and which settings win."""

import dataclasses
import sys
import types
from typing import Any, ClassVar, get_args, get_type_hints

import pytest
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph.comparisons.study.entrant import BUDGETS, Entrant, budget_note, every_solver, parse_budget
from cgla_graph.comparisons.study.options import read_entrant, read_entrants, read_tolerance
from cgla_graph.errors import CglaError, SolverSettingError, UnknownSolverError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml
from cgla_graph.solvers import registry

TEXT = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\n"
SCENARIO = scenario_from_toml(TEXT, "one")


@dataclasses.dataclass(frozen=True)
class Anytime:
    """A solver with every limit."""

    iterations: int | None = 2000
    seconds: float | None = None
    evaluations: int | None = None
    tolerance: float | None = 0.01

    traits: ClassVar[Traits] = Traits("anytime", "a test's own", domain="plane")

    def __post_init__(self) -> None:
        """Refuse a budget that takes too long."""
        if self.iterations is not None and self.iterations > 10**9:
            msg = "anytime: iterations are too many"
            raise SolverSettingError(msg)

    def solve(self, problem: Problem) -> Solution:
        return Solution(Status.NOT_FOUND, message=f"{problem.k}")


@dataclasses.dataclass(frozen=True)
class Stubborn:
    """A solver whose limits and tolerance cannot be lifted."""

    iterations: int = 2000
    seconds: float = 1.0
    tolerance: float = 0.01

    traits: ClassVar[Traits] = Traits("stubborn", "a test's own", domain="plane")

    def solve(self, problem: Problem) -> Solution:
        return Solution(Status.NOT_FOUND, message=f"{problem.k}")


@pytest.fixture(autouse=True)
def _entered(monkeypatch: pytest.MonkeyPatch) -> None:
    """Enter both solvers into the registry."""
    shelf: Any = types.ModuleType("shelf_of_a_test")
    shelf.Anytime, shelf.Stubborn = Anytime, Stubborn
    monkeypatch.setitem(sys.modules, shelf.__name__, shelf)
    entries = {"anytime": f"{shelf.__name__}:Anytime", "stubborn": f"{shelf.__name__}:Stubborn"}
    monkeypatch.setattr(registry, "_BUILT_IN", {**registry._BUILT_IN, **entries})


def scenario(settings: str) -> Scenario:
    return scenario_from_toml(TEXT + settings, "own")


# Entrants


@pytest.mark.parametrize(
    ("text", "settings"),
    [
        ("cgla", {}),
        (" cgla ", {}),
        ("cgla:schedule=sweeps", {"schedule": "sweeps"}),
        ("cgla:schedule=sweeps:early_stop=False", {"schedule": "sweeps", "early_stop": False}),
        ("eight-direction:resolution=(3, 4)", {"resolution": (3, 4)}),
    ],
)
def test_entrants_are_read(text: str, settings: dict[str, Any]) -> None:
    entrant = Entrant.parse(text)
    assert (entrant.label, entrant.name) == (text.strip(), text.strip().split(":")[0])
    assert entrant.settings == settings


@pytest.mark.parametrize(
    ("text", "words", "kind"),
    [
        ("cgl", "did you mean cgla", UnknownSolverError),
        ("", "known solvers", UnknownSolverError),
        (":", "no setting", SolverSettingError),
        ("cgla:", "NAME:SETTING=VALUE", SolverSettingError),
        ("cgla:schedule", "NAME:SETTING=VALUE", SolverSettingError),
        ("cgla:scheduel=sweeps", "no setting 'scheduel'; it has schedule", SolverSettingError),
        ("cgla:schedule=bogus", "bogus.*label-setting", SolverSettingError),
        ("cgla:=1", "no setting ''", SolverSettingError),
        ("cgla:schedule=__import__('os').abort()", "unknown schedule", SolverSettingError),
    ],
)
def test_entrants_that_are_wrong(text: str, words: str, kind: type[CglaError]) -> None:
    with pytest.raises(kind, match=words):
        Entrant.parse(text)


@pytest.mark.parametrize(
    "value", ["0", "-1", "2.5", "abc", "True", "1e9999", "[1]", "None", "", "nan", "2**3", "[" * 99]
)
def test_iterations_that_are_no_whole_number(value: str) -> None:
    pytest.importorskip("ompl")
    with pytest.raises(SolverSettingError, match="iterations"):
        Entrant.parse(f"rrt-star:iterations={value}")


def test_all_solvers_enter() -> None:
    assert [entrant.label for entrant in every_solver()] == registry.names(installed=False)


# Which settings win


def test_the_users_settings_win_over_the_budget_and_that_over_the_scenarios() -> None:
    where = scenario("[solvers.anytime]\niterations = 1\nseconds = 1.0\nevaluations = 1\n")
    budget = {"seconds": 2.0, "evaluations": 2}
    found = Entrant.parse("anytime:seconds=3.0").with_budget(budget).settings_on(where)
    assert found == {"iterations": None, "seconds": 3.0, "evaluations": 2, "tolerance": None}
    assert Entrant.parse("anytime").settings_on(where) == {
        "iterations": 1,
        "seconds": 1.0,
        "evaluations": 1,
        "tolerance": None,
    }


def test_limits_that_cannot_be_lifted_stay() -> None:
    assert Entrant.parse("stubborn").with_budget({"seconds": 2.0}).settings_on(SCENARIO) == {"seconds": 2.0}


def test_a_budget_that_a_solver_does_not_know_changes_nothing() -> None:
    assert Entrant.parse("cgla").with_budget({"seconds": 2.0}).settings_on(SCENARIO) == {}
    assert Entrant.parse("stubborn").with_budget({"evaluations": 2}).settings_on(SCENARIO) == {}


@given(
    budget=st.dictionaries(st.sampled_from(BUDGETS), st.integers(1, 9), min_size=1),
    own=st.dictionaries(st.sampled_from(BUDGETS), st.integers(11, 19)),
)
def test_the_given_budget_rules(budget: dict[str, float], own: dict[str, int]) -> None:
    text = ":".join(["anytime", *(f"{key}={value}" for key, value in own.items())])
    entrant = Entrant.parse(text).with_budget(budget)
    found = registry.get("anytime", **entrant.settings_on(SCENARIO))
    for key in BUDGETS:
        assert getattr(found, key) == own.get(key, budget.get(key))
    assert entrant.takes_budget() == bool(set(budget) - set(own))


@pytest.mark.parametrize(
    ("text", "settings", "tolerance"),
    [
        ("anytime", "", None),
        ("anytime:tolerance=0.2", "", 0.2),
        ("anytime", "[solvers.anytime]\ntolerance = 0.3\n", 0.3),
        ("stubborn", "", 0.01),
    ],
)
def test_no_solver_certifies_what_the_comparison_has_certified(text: str, settings: str, tolerance: object) -> None:
    entrant = Entrant.parse(text)
    found: Any = registry.get(entrant.name, **entrant.settings_on(scenario(settings)))
    assert found.tolerance == tolerance


def test_built_in_solvers_with_limits_let_the_budget_rule() -> None:
    takers = set()
    for entrant in every_solver():
        given = entrant.with_budget({"seconds": 0.5})
        if entrant.is_available and given.takes_budget():
            solver: Any = registry.get(entrant.name, **given.settings_on(SCENARIO))
            assert solver.seconds == 0.5
            kind = registry.solver_class(entrant.name)
            hints = get_type_hints(kind)
            for other in {"iterations", "evaluations", "milestones"} & set(registry.setting_names(kind)):
                assert (getattr(solver, other) is None) == (type(None) in get_args(hints[other]))
            takers.add(entrant.name)
    assert takers >= {"anytime", "stubborn"}


def test_a_budget_is_said_with_who_takes_it() -> None:
    entered = [
        Entrant.parse(text).with_budget({"seconds": 0.5}) for text in ("cgla", "anytime", "stubborn:seconds=1.0")
    ]
    assert budget_note(entered) == "budget: seconds=0.5, taken by anytime"
    assert budget_note([Entrant.parse("anytime")]) == budget_note([]) == ""


# Budgets and options as text


@pytest.mark.parametrize(
    ("text", "budget"),
    [
        ("seconds=0.5", {"seconds": 0.5}),
        (" iterations = 1000 , seconds=2", {"iterations": 1000, "seconds": 2.0}),
        ("evaluations=1e5", {"evaluations": 100000}),
    ],
)
def test_budgets_are_read(text: str, budget: dict[str, float]) -> None:
    found = parse_budget(text)
    assert found == budget
    assert [type(value) for value in found.values()] == [type(value) for value in budget.values()]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("", "no budget; give seconds=…, iterations=…, evaluations=…"),
        ("seconds", "'seconds' is no budget"),
        ("minutes=1", "'minutes=1' is no budget"),
        ("seconds=1,", "'' is no budget"),
        ("seconds=1,seconds=2", "set twice"),
        ("seconds=0", "seconds is '0'; give a number above 0"),
        ("seconds=nan", "'nan'"),
        ("seconds=one", "'one'"),
        ("iterations=2.5", "give a whole number above 0"),
        ("evaluations=inf", "'inf'"),
    ],
)
def test_budgets_that_are_wrong(text: str, words: str) -> None:
    with pytest.raises(SolverSettingError, match=words):
        parse_budget(text)


def test_a_budget_that_a_solver_refuses_is_told_before_any_work() -> None:
    with pytest.raises(SolverSettingError, match="too many"):
        read_entrants("anytime", budget="iterations=1e12")


def test_refined_entrants_say_so() -> None:
    assert [one.label for one in read_entrants("cgla:schedule=sweeps,dijkstra", refine=True)] == [
        "cgla:schedule=sweeps+refine",
        "dijkstra+refine",
    ]
    assert (read_entrant("cgla", refine=True).label, read_entrant("cgla").label) == ("cgla+refine", "cgla")


@pytest.mark.parametrize("tolerance", [-1.0, -1e-9, float("nan"), float("inf")])
def test_tolerances_that_are_wrong(tolerance: float) -> None:
    for certify in (True, False):
        with pytest.raises(CglaError, match="--tolerance is"):
            read_tolerance(tolerance, certify=certify)
