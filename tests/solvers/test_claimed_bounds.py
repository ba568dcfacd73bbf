"""Bounds that are proven, and bounds that solvers claim: who proves which one, and of which paths."""

import dataclasses
import json
import math
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import ClassVar

import numpy as np
import plug_ins
import pytest
from command_line import Call, caller

import cgla_graph as cg
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.conformance.report import answer as conform_answer
from cgla_graph.comparisons.leaderboard.performance import performances
from cgla_graph.comparisons.results.rerun import rerun
from cgla_graph.comparisons.study.documents import encode, run_document, run_from
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.rows import rows_of, scenario_bound
from cgla_graph.comparisons.study.runner import compare
from cgla_graph.comparisons.study.store import StudyStore, load
from cgla_graph.comparisons.study.study import Study
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.scenarios.scenario import as_scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import proven

FIELD = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, 0.9)])
PROBLEM = cg.Problem((0.1, 0.5), (0.9, 0.5), FIELD, k=20.0)
STRAIGHT = np.array([PROBLEM.start, PROBLEM.goal])
COST = PROBLEM.evaluate(STRAIGHT).cost


@cache
def best() -> Solution:
    """Return the best path, which costs 1.1 or so; the straight one costs 5.3."""
    return cg.solve(PROBLEM, "hybrid", tolerance=None)


@dataclass(frozen=True)
class Claims:
    """Goes some way and claims a bound."""

    bound: object = math.nan
    path: tuple[tuple[float, float], ...] = (PROBLEM.start, PROBLEM.goal)
    field: str = "lower_bound"
    status: Status = Status.FOUND
    traits: ClassVar[Traits] = Traits("claims", "claims", domain="plane", proves=True)

    def solve(self, problem: cg.Problem) -> Solution:
        path = np.array(self.path)
        given = Solution(self.status, path=path, cost=problem.evaluate(path).cost)
        return dataclasses.replace(given, **{self.field: self.bound})


@dataclass(frozen=True)
class ClaimsOnGraph:
    """Takes the direct edge and claims that nothing is better."""

    bound: float
    nodes: tuple[int, ...] = (0, 1, 2)
    traits: ClassVar[Traits] = Traits("claims-graph", "claims", domain="graph", exact=True, proves=True)

    def solve(self, problem: cg.GraphProblem) -> Solution:
        return Solution(Status.OPTIMAL, nodes=self.nodes, cost=problem.evaluate(self.nodes), lower_bound=self.bound)


def certificate(bound: float) -> Certificate:
    return Certificate(bound, bound, 0.1, 0.1, 1, "mine", 0.0, problem=PROBLEM)


# One call


@pytest.mark.parametrize("field", ["lower_bound", "claimed_bound"])
@pytest.mark.parametrize("isolated", [False, True])
def test_the_bound_of_a_plug_in_is_a_claim(field: str, *, isolated: bool) -> None:
    found = cg.solve(PROBLEM, Claims(1.0, field=field), isolated=isolated)
    assert (found.status, found.claimed_bound) == (Status.FOUND, 1.0)
    assert math.isnan(found.lower_bound)
    assert math.isnan(found.gap)


def test_a_claim_of_its_own_cost_is_no_proof() -> None:
    found = cg.solve(PROBLEM, Claims(COST))
    assert (found.status, found.claimed_bound) == (Status.FOUND, COST)
    assert math.isnan(found.gap)


def test_a_certificate_of_a_plug_in_is_not_believed() -> None:
    found = cg.solve(PROBLEM, Claims(certificate(COST), field="certificate"))
    assert found.certificate is None
    assert math.isnan(found.gap)


@pytest.mark.parametrize("bound", [math.nan, math.inf, -math.inf, "dear", None])
def test_what_is_no_finite_number_is_no_claim(bound: object) -> None:
    found = cg.solve(PROBLEM, Claims(bound))
    assert found.status is Status.FOUND
    assert math.isnan(found.claimed_bound)


@pytest.mark.parametrize("status", [one for one in Status if not one.has_path])
def test_a_claim_without_a_path_is_not_kept(status: Status) -> None:
    found = cg.solve(PROBLEM, Claims(1.0, status=status))
    assert found.status is status
    assert math.isnan(found.lower_bound)
    assert math.isnan(found.claimed_bound)


def test_a_claim_beside_an_infeasible_path_is_not_kept() -> None:
    found = cg.solve(PROBLEM, Claims(0.5, path=(PROBLEM.start, (0.5, 5.0), PROBLEM.goal)))
    assert found.status is Status.INFEASIBLE
    assert math.isnan(found.claimed_bound)


def test_its_own_path_or_the_straight_one_refutes_a_claim() -> None:
    found = cg.solve(PROBLEM, Claims(COST * 1.001))
    assert (found.status, math.isnan(found.claimed_bound)) == (Status.FAILED, True)
    assert f"{COST * 1.001:.9g}" in found.message
    assert f"its own costs {COST:.9g}" in found.message
    free = dataclasses.replace(PROBLEM, k=0.0)
    found = cg.solve(free, Claims(0.9, path=(PROBLEM.start, (0.5, 0.9), PROBLEM.goal)))
    assert found.status is Status.FAILED
    assert "less than 0.9, the straight line costs 0.8" in found.message


def test_a_refined_path_refutes_a_claim() -> None:
    around = Claims(1.17, path=(PROBLEM.start, (0.5, 0.9), PROBLEM.goal))
    assert cg.solve(PROBLEM, around).claimed_bound == 1.17
    found = cg.solve(PROBLEM, around, refine=True)
    assert found.status is Status.FAILED
    assert "no path costs less than 1.17" in found.message


def test_a_proof_beside_a_claim() -> None:
    honest = proven(PROBLEM, cg.solve(PROBLEM, Claims(1.0)), 0.05)
    assert honest.claimed_bound == 1.0
    assert 1.0 < honest.lower_bound == honest.certificate.lower_bound <= best().cost
    liar = proven(PROBLEM, cg.solve(PROBLEM, Claims(COST)), 0.05)
    assert liar.status is Status.FAILED
    assert f"less than {COST:.9g}, that of hybrid costs {best().cost:.9g}" in liar.message


def test_judging_takes_bounds_for_claims_but_for_proven_ones() -> None:
    given = Solution(Status.FOUND, path=STRAIGHT, cost=COST, lower_bound=1.0)
    assert (PROBLEM.judge(given).claimed_bound, math.isnan(PROBLEM.judge(given).gap)) == (1.0, True)
    best = cg.solve(PROBLEM, tolerance=0.05)
    again = PROBLEM.judge(best)
    assert (again.lower_bound, again.certificate) == (best.lower_bound, best.certificate)
    # the bound of another problem says nothing
    other = dataclasses.replace(PROBLEM, k=1.0).judge(dataclasses.replace(best, cost=1.0))
    assert math.isnan(other.lower_bound)


# Solvers of this package


def test_solvers_of_this_package_prove_bounds_of_the_plane() -> None:
    best = cg.solve(PROBLEM, tolerance=0.05)
    assert best.lower_bound == best.certificate.lower_bound <= best.cost
    isolated = cg.solve(PROBLEM, tolerance=0.05, isolated=True)
    assert (isolated.lower_bound, math.isnan(isolated.claimed_bound)) == (best.lower_bound, True)
    refined = cg.solve(PROBLEM, tolerance=0.05, refine=True)
    assert (refined.lower_bound, refined.status) == (best.lower_bound, Status.FOUND)
    straight = cg.solve(PROBLEM, "straight-line")
    assert straight.lower_bound == pytest.approx(0.8, rel=1e-11)


@pytest.mark.parametrize("name", ["cgla", "dijkstra", "eight-direction", "lazy-theta-star", "q-learning"])
def test_an_optimum_of_a_lattice_is_no_bound_of_the_plane(name: str) -> None:
    found = cg.solve(PROBLEM, name, resolution=6)
    assert math.isnan(found.lower_bound)
    assert math.isnan(found.claimed_bound)


EXACT = [name for name in registry.names() if registry.is_built_in(name) and registry.traits(name).exact]


@pytest.mark.parametrize("name", EXACT)
def test_an_exact_solver_proves_the_optimum_of_its_graph(name: str) -> None:
    graph = cg.GeometricGraph.from_matrix([[0, 2, 9], [2, 0, 3], [9, 3, 0]])
    found = cg.solve(cg.GraphProblem(graph, 0, 2), name)
    assert (found.lower_bound, found.gap) == (5.0, 0.0)
    nowhere = cg.GeometricGraph.from_matrix([[0, 2, math.inf], [2, 0, math.inf], [math.inf, math.inf, 0]])
    assert math.isnan(cg.solve(cg.GraphProblem(nowhere, 0, 2), name).lower_bound)


def test_the_optimum_of_a_plug_in_on_a_graph_is_a_claim() -> None:
    graph = cg.GeometricGraph.from_matrix([[0, 2, 4], [2, 0, 3], [4, 3, 0]])
    problem = cg.GraphProblem(graph, 0, 2)
    assert math.isnan(cg.solve(problem, ClaimsOnGraph(3.0)).lower_bound)
    assert cg.solve(problem, ClaimsOnGraph(3.0)).claimed_bound == 3.0
    found = cg.solve(problem, ClaimsOnGraph(5.0))
    assert found.status is Status.FAILED
    assert "less than 5, the edge from source to target costs 4" in found.message
    # a bound of a lattice's paths is no claim about the plane
    on = PROBLEM.on_lattice(3)
    ends = ClaimsOnGraph(1.0, nodes=(on.source, on.target))
    assert math.isnan(cg.solve(PROBLEM, ends, on=on).claimed_bound)


def test_the_claim_behind_a_refined_path_is_one() -> None:
    found = cg.solve(PROBLEM, "refine", base=Claims(1.0))
    assert (found.status, found.claimed_bound, math.isnan(found.lower_bound)) == (Status.FOUND, 1.0, True)
    liar = cg.solve(PROBLEM, "refine", base=Claims(COST))
    assert (liar.status, f"less than {COST:.9g}, its own costs" in liar.message) == (Status.FAILED, True)


# Studies


@pytest.fixture
def installed(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    plug_ins.install(tmp_path, monkeypatch)
    return tmp_path


def entrants(*texts: str) -> list[Entrant]:
    return [Entrant.parse(text) for text in texts]


@pytest.mark.usefixtures("installed")
@pytest.mark.parametrize("tolerance", [None, 0.05])
def test_a_study_measures_nobody_by_a_claim(tolerance: float | None) -> None:
    texts = ("claims:note=x1.0", f"claims:note=x{COST}", "hybrid", "straight-line")
    runs = list(compare([PROBLEM], entrants(*texts), tolerance=tolerance))
    solutions = {run.solver: run.solution for run in runs}
    honest, liar = (solutions[text] for text in texts[:2])
    assert honest.claimed_bound == 1.0
    assert liar.status is Status.FAILED
    assert f"less than {COST:.9g}, that of" in liar.message
    assert f"costs {best().cost:.9g}" in liar.message
    bound = scenario_bound(runs)
    assert bound == pytest.approx(0.8) if tolerance is None else 1.0 < bound <= best().cost
    (straight,) = [one for one in performances(runs) if one.solver == "straight-line"]
    assert all(math.isinf(seconds.median) for seconds in straight.seconds[1:])
    rows = {row["solver"]: row for row in rows_of(runs)}
    assert rows[texts[0]]["claimed_bound"] == 1.0
    assert rows[texts[1]]["claimed_bound"] is None


@pytest.mark.usefixtures("installed")
def test_a_stored_study_holds_claims_against_all_paths(tmp_path: Path) -> None:
    honest, liar = "claims:note=x1.0", f"claims:note=x{COST}"
    scenario = as_scenario(PROBLEM, "mine")
    study = Study([scenario], entrants(liar, honest), tolerance=None)
    folder = tmp_path / "study"
    with StudyStore.create(folder, study) as store:
        first = list(run_study(study, store=store, workers=0))
    assert [run.solution.claimed_bound for run in load(folder).runs] == [COST, 1.0]
    assert {run.solution.status for run in first} == {Status.FOUND}
    more = dataclasses.replace(study, entrants=entrants(liar, honest, "hybrid"))
    with StudyStore.resume(folder, more) as store:
        list(run_study(store.study, store=store, workers=0))
    stored = load(folder)
    assert [run.solution.status for run in stored.runs] == [Status.FAILED, Status.FOUND, Status.FOUND]
    assert f"that of hybrid costs {best().cost:.9g}" in stored.runs[0].solution.message
    again = rerun(stored, stored.runs[0].number or 0)
    assert again.is_identical, again.verdict()


@pytest.mark.parametrize("proof", [None, 1.05])
def test_what_an_earlier_version_stored_of_a_plug_in_is_a_claim(proof: float | None) -> None:
    """It kept the greater of the claim and the bound of the certificate as one number."""
    scenario, held = as_scenario(PROBLEM, "mine"), None if proof is None else certificate(proof)
    answer = Solution(Status.FOUND, path=STRAIGHT, cost=COST, length=0.8, risk=1.0, clearance=math.inf)
    (run,) = compare([scenario], entrants("straight-line"), tolerance=None)
    for stored, claim in ((COST, COST), (math.inf, math.nan), (1.05, math.nan if proof else 1.05)):
        old = dataclasses.replace(run, solution=dataclasses.replace(answer, lower_bound=stored))
        document = {key: value for key, value in run_document(old).items() if key != "claimed_bound"}
        entrant = Entrant("mine", "mine")
        loaded = run_from(document, scenario, entrant, None, held, 1)
        numbers = loaded.solution.lower_bound, loaded.solution.claimed_bound
        assert numbers == pytest.approx((math.nan if proof is None else proof, claim), nan_ok=True)
        again = run_from(run_document(loaded), scenario, entrant, None, held, 1)
        assert (again.solution.lower_bound, again.solution.claimed_bound) == pytest.approx(numbers, nan_ok=True)
        ours = run_from(document, scenario, Entrant("straight-line", "straight-line"), None, held, 1)
        assert (encode(ours.solution.lower_bound), ours.solution.status) == (encode(stored), Status.FOUND)


# The command line


@pytest.fixture
def cgla(installed: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(installed, monkeypatch, capfd)


@pytest.mark.slow
def test_commands_say_who_claims_a_bound(cgla: Call, tmp_path: Path) -> None:
    found = cgla("plan", "one-threat", "--solver", "claims:note=x1.0", "--no-certificate")
    assert "claimed by claims:note=x1.0, not proven: no path costs less than 1.00000" in " ".join(found.out.split())
    assert "gap" not in found.out
    document = cgla("plan", "one-threat", "--solver", "claims:note=x1.0", "--json").document()
    assert (document["claimed_bound"], document["status"]) == (1.0, "found")
    assert document["lower_bound"] > 1.0
    straight = cgla("plan", "one-threat", "--solver", "straight-line", "--json").document()["cost"]
    liar = cgla("plan", "one-threat", "--solver", f"claims:note=x{straight}", "--json")
    assert (liar.code, liar.document()["status"]) == (1, "failed")
    compared = cgla("compare", "one-threat", "--solvers", f"claims:note=x{straight},hybrid,claims:note=x1", "--json")
    rows = {row["solver"]: row for row in compared.document()["rows"]}
    assert [rows[name]["claimed_bound"] for name in sorted(rows)] == [1.0, None, None]
    assert rows[f"claims:note=x{straight}"]["status"] == "failed"
    table = cgla("compare", "one-threat", "--solvers", "claims:note=x1", "--out", str(tmp_path / "study")).out
    assert "claimed by claims:note=x1, not proven: no path costs less than 1.00000" in " ".join(table.split())
    assert "claimed by claims:note=x1, not proven" in (tmp_path / "study" / "report.html").read_text(encoding="utf-8")


@pytest.mark.usefixtures("installed")
def test_a_plug_in_that_answers_the_suite_says_what_it_claims() -> None:
    text = json.dumps(
        {
            "version": 1,
            "name": "a",
            "start": [0.1, 0.5],
            "goal": [0.9, 0.5],
            "bounds": [0, 0, 1, 1],
            "k": 1.0,
            "threats": [],
        }
    )
    assert "lower_bound" not in conform_answer(text, "cgla", 5)
    assert conform_answer(text, "claims:note=x0.5", 5)["lower_bound"] == 0.5
