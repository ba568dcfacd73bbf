"""Studies of pairs of nodes: the same path through runs, stores, reports and tables as maps take."""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, ClassVar

import networkx as nx
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import cgla_graph as cg
from cgla_graph import comparisons
from cgla_graph.comparisons import Entrant, Study, graph_pairs, metric
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.report.page import report_html
from cgla_graph.comparisons.study.documents import graph_text, scenario_document, scenario_from
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.graph_bound import certify_on_graph
from cgla_graph.comparisons.study.options import PairOptions, number_names
from cgla_graph.comparisons.study.sampling import independence_note
from cgla_graph.comparisons.study.study_file import study_from_toml
from cgla_graph.errors import CglaError, NodeNotFoundError, ScenarioError, StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario, as_any_scenario, sampling_note
from cgla_graph.testing import graphs

#: Installed with the package.
SOLVERS = ("cgla", "dijkstra", "networkx")


def roads(*, places: bool = False) -> GeometricGraph:
    graph: nx.Graph[Any] = nx.Graph()
    graph.add_weighted_edges_from(
        [("depot", "bridge", 2.0), ("bridge", "tower", 0.0), ("depot", "tower", 5.0), ("isle", "rock", 1.0)]
    )
    if places:
        for node, place in zip(graph.nodes, [(0, 0), (1, 0), (1, 1), (3, 3), (3, 4)], strict=True):
            graph.nodes[node]["pos"] = place
    return GeometricGraph.from_networkx(graph)


@dataclass(frozen=True)
class SaysNone:
    """A solver that is wrong wherever there is a path."""

    traits: ClassVar[Traits] = Traits("says-none", "finds no path anywhere", domain="graph")

    def solve(self, problem: cg.GraphProblem) -> Solution:
        """Say that there is no path."""
        del problem
        return Solution(Status.NO_PATH)


@metric(unit="edges")
def hops(path: tuple[str, ...], problem: cg.GraphProblem) -> float:
    """Count edges, as the problem on the graph has them."""
    assert problem.evaluate(path) < math.inf
    return len(path) - 1


# costs


@given(graph=graphs(), seed=st.integers(0, 9))
def test_costs_of_a_study_are_those_of_networkx(graph: GeometricGraph, seed: int) -> None:
    """On any graph, directed or not, with zero weights and without paths; labels come back as they were."""
    if graph.n_nodes == 1 or graph.has_negative_weights:
        return
    known = graph.to_networkx()
    scenarios = graph_pairs(graph, pairs=4, seed=seed)
    for run in comparisons.compare(scenarios, [Entrant(name, name) for name in SOLVERS], 1):
        problem = run.scenario.problem
        try:
            best = nx.dijkstra_path_length(known, problem.source, problem.target)
        except nx.NetworkXNoPath:
            assert run.solution.status is Status.NO_PATH
            assert run.certificate is not None
            assert run.certificate.lower_bound == math.inf
            assert run.has_answer
        else:
            assert run.solution.cost == pytest.approx(best, rel=1e-9)
            assert run.solution.lower_bound == pytest.approx(best, rel=1e-9)
            assert run.solution.nodes[0] == problem.source
            assert run.solution.nodes[-1] == problem.target


def test_the_bound_is_the_least_cost_and_one_search_serves_all_sources(monkeypatch: pytest.MonkeyPatch) -> None:
    graph, searches = roads(), []
    from scipy.sparse import csgraph  # noqa: PLC0415 - as the module looks it up

    search = csgraph.dijkstra
    monkeypatch.setattr(csgraph, "dijkstra", lambda *given, **how: searches.append(1) or search(*given, **how))
    proofs = [certify_on_graph(cg.GraphProblem(graph, source, "tower"), 0.1) for source in ("depot", "bridge", "isle")]
    assert [proof.lower_bound for proof in proofs] == [2.0, 0.0, math.inf]
    assert len(searches) == 1
    assert len({proof.seconds for proof in proofs}) == 1


def test_a_claim_that_there_is_no_path_is_refuted() -> None:
    study = Study(graph_pairs(roads(), pairs=[("depot", "tower"), ("depot", "isle")]), [SaysNone()])
    there, none = run_study(study, workers=0)
    assert there.solution.status is Status.FAILED
    assert "there is one that costs 2" in there.solution.message
    assert none.has_answer


# pairs


@given(n=st.integers(2, 7), count=st.integers(1, 50), seed=st.integers(0, 99), directed=st.booleans())
def test_drawn_pairs_differ_and_are_the_same_each_time(n: int, count: int, seed: int, directed: bool) -> None:
    known = nx.complete_graph(n, nx.DiGraph() if directed else nx.Graph())
    nx.set_edge_attributes(known, 1.0, "weight")
    graph = GeometricGraph.from_networkx(known)
    drawn, again = (graph_pairs(graph, pairs=count, seed=seed) for _ in range(2))
    ends = [(one.problem.source, one.problem.target) for one in drawn]
    assert ends == [(one.problem.source, one.problem.target) for one in again]
    different = set(ends) if graph.directed else {frozenset(pair) for pair in ends}
    total = n * (n - 1) // (1 if graph.directed else 2)
    assert len(different) == len(ends) == min(count, total)
    assert all(one != other for one, other in ends)
    assert len({id(one.problem.graph) for one in drawn}) == 1


def test_pairs_at_one_end_and_from_a_file(tmp_path: Path) -> None:
    (tmp_path / "pairs.csv").write_text("from,to\ndepot, tower\nrock,isle\n", encoding="utf-8")
    listed = graph_pairs(roads(), pairs=tmp_path / "pairs.csv", name="roads")
    assert [one.name for one in listed] == ["roads: depot to tower", "roads: rock to isle"]
    to_tower = graph_pairs(roads(), target="tower", pairs=np.int64(99))
    assert {one.problem.source for one in to_tower} == {"depot", "bridge", "isle", "rock"}
    assert {one.problem.target for one in to_tower} == {"tower"}


@pytest.mark.parametrize(
    ("how", "says"),
    [
        ({}, "name two of its nodes"),
        ({"source": "depot"}, "name two of its nodes"),
        ({"pairs": 0}, "from 1 to"),
        ({"pairs": True}, "from 1 to"),
        ({"pairs": []}, "a list of pairs"),
        ({"pairs": [("a",)]}, "a list of pairs"),
        ({"pairs": 3.5}, "a list of pairs"),
        ({"source": "depot", "target": "tower", "pairs": 3}, "draws nodes"),
        ({"source": "depot", "pairs": [("depot", "tower")]}, "leave it out"),
        ({"weight": "minutes", "pairs": 3}, "for files"),
        ({"weight": 3, "pairs": 3}, "weight is 3"),
        ({"directed": "yes", "pairs": 3}, "directed is 'yes'; give True or False"),
        ({"seed": -1, "pairs": 3}, "seed is -1; give a whole number from 0"),
        ({"seed": "x", "pairs": 3}, "seed is 'x'"),
    ],
)
def test_wrong_pairs_say_the_remedy(how: dict[str, Any], says: str) -> None:
    with pytest.raises(CglaError, match=says):
        graph_pairs(roads(), **how)


@pytest.mark.parametrize("pairs", ["1e9", "a,b", "1.5", "", "9" * 30, "\u0663"])
def test_pairs_that_are_no_number_and_no_file_say_both(pairs: str, tmp_path: Path) -> None:
    (tmp_path / "roads.csv").write_text("source,target,weight\na,b,1\n", encoding="utf-8")
    with pytest.raises(ScenarioError, match=r"pairs is .*; give a number from 1 to 1,000,000, or a CSV file"):
        PairOptions(pairs=pairs).open([str(tmp_path / "roads.csv")])


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ("source,target\n\ndepot,tower\ndepot,shire\n", r"pairs.csv, line 4: .*'shire'"),
        ("\ufeffdepot,tower\n , \ndepot\n", r"pairs.csv, line 3: 'depot' is not a pair"),
        ("depot," + "x" * 200_000, r"pairs.csv, line 1: field larger"),
    ],
)
def test_wrong_rows_of_a_file_of_pairs_are_named(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "pairs.csv").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match=says):
        graph_pairs(roads(), pairs=tmp_path / "pairs.csv")


def test_an_unknown_node_is_named() -> None:
    with pytest.raises(NodeNotFoundError, match="'shire' is not in the graph"):
        graph_pairs(roads(), pairs=[("depot", "shire")])


# which solvers


@pytest.mark.parametrize("solver", ["rrt-star", "hybrid", "prm-star"])
def test_solvers_of_the_plane_are_refused_by_name(solver: str) -> None:
    problem = cg.GraphProblem(roads(), "depot", "tower")
    for make in (
        lambda: Study([problem], [solver]),
        lambda: list(comparisons.compare([problem], [solver])),
        lambda: Study([problem, "paper"], ["cgla", solver]),
    ):
        with pytest.raises(StudyError, match=f"{solver} plans in the plane.* on graphs plan cgla, dijkstra"):
            make()


def test_refinement_is_refused() -> None:
    with pytest.raises(StudyError, match="keeps to its edges"):
        Study([cg.GraphProblem(roads(), "depot", "tower")], [Entrant.parse("cgla").refined()])


# what is kept


MADE: dict[str, Callable[[], GeometricGraph]] = {
    "sparse": roads,
    "dense": lambda: GeometricGraph.from_matrix([[0, 0, np.inf], [3, 0, 1], [1, 1, 0]], labels=[(1, "a"), 2, "b"]),
    "lattice": lambda: GeometricGraph.eight_connected(
        Lattice(4, bounds=(0, 0, 1, 1)), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=3.0
    ),
    "implicit": lambda: GeometricGraph.complete(
        Lattice(3, bounds=(0, 0, 1, 1)), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=3.0
    ),
}


@pytest.mark.parametrize("kind", MADE)
def test_graphs_are_kept_to_the_last_bit(kind: str) -> None:
    graph = MADE[kind]()
    scenario = graph_pairs(graph, pairs=1)[0]
    again = scenario_from(json.loads(json.dumps(scenario_document(scenario))))
    assert isinstance(again, GraphScenario)
    kept = again.problem.graph
    assert list(kept.labels) == list(graph.labels)
    assert (kept.directed, kept.is_sparse, kept.is_implicit) == (graph.directed, graph.is_sparse, graph.is_implicit)
    assert np.array_equal(kept.weight_matrix(), graph.weight_matrix())
    assert (kept.positions is None) == (graph.positions is None)
    assert (again.problem.source, again.problem.target) == (scenario.problem.source, scenario.problem.target)
    assert graph_text(kept) == graph_text(graph)
    one, other = (cg.solve(problem, "dijkstra") for problem in (scenario.problem, again.problem))
    assert (one.cost, one.nodes, one.evaluations) == (other.cost, other.nodes, other.evaluations)
    assert one.risk == other.risk or math.isnan(one.risk)


def test_a_study_of_graphs_is_written_read_and_resumed(tmp_path: Path) -> None:
    """Report, pictures where nodes have positions, labels, metrics; then more pairs in the same folder."""
    pairs = [("depot", "tower"), ("bridge", "isle")]
    how: dict[str, Any] = {"workers": 0, "pictures": 9}
    study = Study(graph_pairs(roads(places=True), pairs=pairs, name="roads"), SOLVERS[:2], metrics=[hops])
    stored = comparisons.write_study(study, tmp_path, **how)
    assert [(run.solver, run.solution.nodes, run.measure("hops")) for run in stored.runs[:2]] == [
        (solver, ("depot", "bridge", "tower"), 2.0) for solver in SOLVERS[:2]
    ]
    assert [run.solution.status for run in stored.runs[2:]] == [Status.NO_PATH] * 2
    assert (tmp_path / "roads-depot-to-tower.png").exists()
    data = _page_data(report_html(stored))
    assert data["maps"][0]["bounds"] is not None
    assert len(data["maps"]) == 1
    assert {cell["nodes"] for one in data["scenarios"] for cell in one["cells"]} == {"depot → bridge → tower", ""}

    more = Study(
        graph_pairs(roads(places=True), pairs=[*pairs, ("rock", "isle")], name="roads"), SOLVERS[:2], metrics=[hops]
    )
    again = comparisons.write_study(more, tmp_path, resume=True, **how)
    assert [run.number for run in again.runs] == [1, 2, 3, 4, 5, 6]
    assert len({id(one.problem.graph) for one in again.scenarios}) == 1
    assert {one.n_answers for one in leaderboard_of(again.runs)} == {3}


def test_a_report_of_a_graph_without_positions_has_paths_in_words(tmp_path: Path) -> None:
    study = Study([cg.GraphProblem(roads(), "depot", "tower")], ["cgla"])
    stored = comparisons.write_study(study, tmp_path, workers=0)
    assert not [*tmp_path.glob("*.png")]
    data = _page_data(report_html(stored))
    assert data["maps"][0]["bounds"] is None
    assert data["scenarios"][0]["k"] is None
    assert data["scenarios"][0]["cells"][0]["nodes"] == "depot → bridge → tower"


def _page_data(page: str) -> dict[str, Any]:
    text = page.split('<script type="application/json" id="data">')[1].split("</script>", maxsplit=1)[0]
    data: dict[str, Any] = json.loads(text)
    return data


@pytest.mark.slow
def test_workers_give_the_same_answers_as_this_process() -> None:
    study = Study(graph_pairs(roads(), pairs=5), [*SOLVERS, SaysNone()])
    order = [tuple(cell) for cell in study.cells()]
    found = []
    for workers in (0, 2):
        runs = {(run.scenario.name, run.solver, run.seed): run.solution for run in run_study(study, workers=workers)}
        found.append([(runs[cell].status, runs[cell].cost, runs[cell].nodes) for cell in order])
    assert found[0] == found[1]


OWN = """
import os
import time
from dataclasses import dataclass
from typing import ClassVar

from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits


@dataclass(frozen=True)
class Awkward:
    traits: ClassVar[Traits] = Traits("awkward", "hangs, crashes or answers", domain="graph")
    mode: str = "answers"

    def solve(self, problem):
        if self.mode == "hangs":
            time.sleep(60)
        if self.mode == "crashes":
            os._exit(3)
        return Solution(Status.FOUND, nodes=(problem.source, problem.target))
"""


@pytest.mark.slow
def test_own_solvers_from_files_hang_and_crash_alone(tmp_path: Path) -> None:
    (tmp_path / "own.py").write_text(OWN, encoding="utf-8")
    names = [f"{tmp_path}/own.py:Awkward:mode={mode}" for mode in ("hangs", "crashes", "answers")]
    study = Study(
        graph_pairs(roads(), pairs=[("depot", "tower")]), [*names, "cgla"], limits=Limits(2.0), metrics=[hops]
    )
    stored = comparisons.write_study(study, tmp_path / "results", workers=2, pictures=0)
    assert [(run.solution.status.label, run.solution.cost) for run in stored.runs] == [
        *(("timed-out", math.inf), ("crashed", math.inf), ("found", 5.0), ("optimal", 2.0))
    ]
    assert [run.measure("hops") for run in stored.runs[2:]] == [1.0, 2.0]
    assert stored.runs[2].solution.gap == pytest.approx(1.5)


def test_pairs_that_come_twice_have_names_of_their_own() -> None:
    pairs = graph_pairs(roads(), pairs=[("depot", "tower")] * 2, name="roads")
    assert [one.name for one in pairs] == ["roads: depot to tower", "roads: depot to tower-2"]


# study files


FILE = "source,target,weight\na,b,1\nb,c,2\n"


def test_study_files_take_graphs_patterns_and_generators(tmp_path: Path) -> None:
    for name in ("one", "two"):
        (tmp_path / f"{name}.csv").write_text(FILE, encoding="utf-8")
    (tmp_path / "rings.py").write_text(
        "import cgla_graph as cg\n\n\ndef pair(seed):\n"
        "    return cg.GraphProblem(cg.GeometricGraph.from_matrix([[0, seed], [seed, 0]], labels='ab'), 'a', 'b')\n",
        encoding="utf-8",
    )
    study = study_from_toml(
        'scenarios = [{ graph = "*.csv", source = "a", target = "c" }, { graph = "one.csv", pairs = [["b", "c"]] },\n'
        '{ graph = "one.csv", pairs = 2, target = "a", directed = true }, { generate = "./rings.py:pair", seeds = 2 }]',
        tmp_path,
    )
    assert [one.name for one in study.scenarios] == [
        *("one: a to c", "two: a to c", "one: b to c", "one: b to a", "one: c to a", "pair-1", "pair-2")
    ]
    assert {"cgla", "dijkstra"} <= {one.name for one in study.entrants}
    assert "rrt-star" not in {one.name for one in study.entrants}
    costs = [run.solution.cost for run in run_study(study, workers=0) if run.solver == "cgla"]
    assert costs == [3.0, 3.0, 2.0, math.inf, math.inf, 1.0, 2.0]


@pytest.mark.parametrize(
    ("text", "says"),
    [
        ('scenarios = ["one.csv"]', "name pairs of its nodes"),
        ('scenarios = [{ graph = "one.csv" }]', "name two of its nodes"),
        ('scenarios = [{ graph = "x*.csv", pairs = 2 }]', "no file matches"),
        ('scenarios = [{ graph = "one.csv", pairs = [["a"]] }]', "scenarios.0"),
        ('scenarios = [{ graph = "one.csv", pairs = 2 }]\nsolvers = ["rrt-star"]', "on graphs plan cgla"),
        ('scenarios = [{ graph = "one.csv", pairs = 2 }]\nrefine = true', "keeps to its edges"),
    ],
)
def test_wrong_graphs_in_study_files_are_refused(text: str, says: str, tmp_path: Path) -> None:
    (tmp_path / "one.csv").write_text(FILE, encoding="utf-8")
    with pytest.raises(StudyError, match=says):
        study_from_toml(text, tmp_path)


# what may be said


def test_pairs_of_one_graph_share_it_and_the_note_says_so() -> None:
    pairs = graph_pairs(roads(), pairs=4)
    assert "4 pairs of one graph" in sampling_note(pairs)
    assert "5 pairs of 2 graphs" in sampling_note([*pairs, *graph_pairs(roads(), pairs=1)])
    assert sampling_note([pairs[0], graph_pairs(roads(), pairs=1)[0]]) == ""


def test_repeated_scenarios_are_counted_in_the_note() -> None:
    def note(*scenarios: object) -> str:
        return independence_note(
            Study(number_names([as_any_scenario(one, "mine") for one in scenarios]), ["cgla"]).scenarios
        )

    pair, other = graph_pairs(roads(), pairs=2, name="roads")
    again, _ = graph_pairs(roads(), pairs=2, name="roads")
    assert "1 of 3 are the same as an earlier one (such as roads: " in note(pair, other, again)
    assert "repeated scenarios: 2 of 3" in note(pair, pair, pair)
    assert "repeat" not in note(pair, other)
    heavier = GeometricGraph.from_matrix(3 * roads().weight_matrix(), labels=roads().labels)
    assert "repeat" not in note(pair, GraphScenario(pair.name, cg.GraphProblem(heavier, *pair.ends)))
    assert "1 of 3 are the same as an earlier one (such as one-threat-2)" in note("one-threat", "trap", "one-threat")
    problem = cg.load_scenario("one-threat").problem
    assert "repeated scenarios: 1 of 2" in independence_note(Study([problem, problem], ["cgla"]).scenarios)
