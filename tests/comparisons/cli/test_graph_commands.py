"""Graphs on the command line: plans between nodes, comparisons, and the check of Theorem 1."""

import csv
import json
from pathlib import Path
from typing import Any

import networkx as nx
import numpy as np
import pytest
from command_line import Answer, Call
from scipy import sparse

import cgla_graph as cg
from cgla_graph.scenarios.graphs.graph_file import read_graph

ROADS = "source,target,weight,minutes\ndepot,bridge,2,4\nbridge,tower,0,1\ndepot,tower,5,2\ntower,hill,3,3\n"
WAY = ["depot", "bridge", "tower", "hill"]
ISLAND = "a,b,1\nc,d,1\n"
BELOW = "a,b,-1\nb,c,2\n"


FILES = {"roads.csv": ROADS, "island.csv": ISLAND, "below.csv": BELOW, "one.csv": "a,a,1\n"}


def write_all(folder: Path, graph: "nx.Graph[Any]") -> list[str]:
    """Write a graph in every format; nodes are 0, 1, … and have edges."""
    nx.write_graphml(graph, folder / "g.graphml")
    (folder / "g.json").write_text(json.dumps(nx.node_link_data(graph, edges="edges")), encoding="utf-8")
    (folder / "g.csv").write_text("".join(f"{u},{v},{w}\n" for u, v, w in graph.edges(data="weight")), encoding="utf-8")
    sparse.save_npz(folder / "g.npz", nx.to_scipy_sparse_array(graph, format="csr"))
    return ["g.graphml", "g.json", "g.csv", "g.npz"]


# plan


def test_plan_prints_a_row_for_each_solver(cgla: Call) -> None:
    answer = cgla("graph", "plan", "roads.csv", "--from", "depot", "--to", "hill", "--solver", "cgla,dijkstra")
    assert answer.code == 0
    assert "roads.csv: 4 nodes, 4 edges, undirected; from depot to hill" in answer.out
    rows = [[cell.strip() for cell in line.split("│")[1:-1]] for line in answer.out.splitlines() if "│" in line]
    assert [row[:5] for row in rows] == [
        [name, "optimal", " → ".join(WAY), "4", "5.00000000"] for name in ("cgla", "dijkstra")
    ]


def test_plan_as_json(cgla: Call) -> None:
    document = cgla("graph", "plan", "roads.csv", "--from", "depot", "--to", "hill", "--json").document()
    assert document["graph"] == {"file": "roads.csv", "nodes": 4, "edges": 4, "directed": False}
    (run,) = document["runs"]
    assert (run["solver"], run["from"], run["to"], run["status"]) == ("cgla", "depot", "hill", "optimal")
    assert (run["cost"], run["path"], run["nodes"], run["length"], run["evaluations"]) == (5.0, WAY, 4, None, 0)
    assert document["files"] == []


def test_every_format_gives_the_same_plans(cgla: Call, tmp_path: Path) -> None:
    rng = np.random.default_rng(5)
    graph = nx.gnm_random_graph(12, 30, seed=3)
    assert nx.is_connected(graph)
    for *_, data in graph.edges(data=True):
        data["weight"] = float(rng.random())
    best = nx.dijkstra_path_length(graph, 2, 7)
    way = nx.dijkstra_path(graph, 2, 7)
    names = write_all(tmp_path, graph)
    for name in names:
        document = cgla(
            "graph", "plan", name, "--from", 2, "--to", 7, "--solver", "cgla,networkx,dijkstra", "--json"
        ).document()
        assert document["graph"]["edges"] == 30
        for run in document["runs"]:
            assert run["cost"] == pytest.approx(best, rel=1e-12)
            assert run["path"] == [str(node) for node in way]


def test_another_weight_and_one_way_roads(cgla: Call) -> None:
    ends = ("--from", "hill", "--to", "depot")
    assert (
        cgla("graph", "plan", "roads.csv", *ends, "--weight", "minutes", "--json").document()["runs"][0]["cost"] == 5.0
    )
    answer = cgla("graph", "plan", "roads.csv", *ends, "--directed")
    assert answer.code == 1
    assert "cgla: no path exists on the graph" in answer.out


def test_plan_writes_the_nodes_of_paths(cgla: Call, tmp_path: Path) -> None:
    answer = cgla(
        "graph", "plan", "roads.csv", "--from", "depot", "--to", "hill", "--solver", "cgla,dijkstra", "--out", "results"
    )
    assert answer.out.endswith("written to results: roads-cgla.csv, roads-dijkstra.csv\n")
    for name in ("cgla", "dijkstra"):
        rows = [*csv.reader((tmp_path / "results" / f"roads-{name}.csv").read_text(encoding="utf-8").splitlines())]
        assert rows == [["node"], *([node] for node in WAY)]

    graph = nx.path_graph(3)
    nx.set_edge_attributes(graph, 1.0, "weight")
    nx.set_node_attributes(graph, {0: (0.0, 0.5), 1: (1.0, 0.5), 2: (1.0, 1.5)}, "pos")
    (tmp_path / "line.json").write_text(json.dumps(nx.node_link_data(graph, edges="links")), encoding="utf-8")
    document = cgla("graph", "plan", "line.json", "--from", 0, "--to", 2, "--out", "results", "--json").document()
    assert document["runs"][0]["length"] == 2.0
    assert document["files"] == ["results/line-cgla.csv"]
    text = (tmp_path / "results" / "line-cgla.csv").read_text(encoding="utf-8")
    assert text.split() == ["node,x,y", "0,0.0,0.5", "1,1.0,0.5", "2,1.0,1.5"]


def test_start_is_goal(cgla: Call) -> None:
    (run,) = cgla("graph", "plan", "one.csv", "--from", "a", "--to", "a", "--json").document()["runs"]
    assert (run["status"], run["cost"], run["path"]) == ("optimal", 0.0, ["a"])


def test_a_long_path_is_shortened(cgla: Call, tmp_path: Path) -> None:
    (tmp_path / "long.csv").write_text("".join(f"{i},{i + 1},1\n" for i in range(30)), encoding="utf-8")
    answer = cgla("graph", "plan", "long.csv", "--from", 0, "--to", 30)
    assert "0 → 1 → 2 → … → 28 → 29 → 30 │    31 │ 30.0000000" in answer.out


ENDS = ("--from", "depot", "--to", "hill")


@pytest.mark.parametrize(
    ("words", "says"),
    [
        pytest.param(["graph", "plan", "roads.csv"], "name two of its nodes", id="none"),
        pytest.param(["graph", "plan", "roads.csv", "--to", "hill"], "name two of its nodes", id="one node"),
        pytest.param(
            ["graph", "plan", "roads.csv", "--from", "depo", "--to", "hill"], "did you mean depot?", id="typo"
        ),
        pytest.param(["graph", "plan", "roads.csv", *ENDS, "--weight", "m"], "no column 'm'", id="column"),
        pytest.param(["graph", "plan", "roads.csv", *ENDS, "--solver", "hybrid"], "not on a graph", id="plane"),
        pytest.param(["graph", "plan", "roads.csv", *ENDS, "--solver", "zz"], "unknown solver 'zz'", id="solver"),
        pytest.param(["graph", "plan", "roads.csv", *ENDS, "--solver", ""], "names no solver", id="empty"),
        pytest.param(["plan", "paper", "--solver", ""], "unknown solver ''", id="empty on a map"),
        pytest.param(["graph", "plan", "nowhere.npz", *ENDS], "there is no such file", id="no file"),
        pytest.param(["graph", "plan", "below.csv", "--from", "a", "--to", "c"], "has weight -1", id="below 0"),
        pytest.param(["graph", "plan", "roads.csv", *ENDS, "--k", "0"], "no such option: --k", id="of maps"),
        pytest.param(["plan", "roads.csv"], "cgla graph plan roads.csv --from A --to B", id="plan a graph"),
        pytest.param(["compare", "paper", "roads.csv"], "cgla graph compare roads.csv", id="compare a graph"),
        pytest.param(["graph", "plan", "paper", *ENDS], "paper: this is no file of a graph", id="a map"),
        pytest.param(["graph", "compare", "roads.csv"], "or --pairs N", id="compare without nodes"),
        pytest.param(["graph", "compare"], "no graph is named", id="compare without a graph"),
        pytest.param(
            ["graph", "compare", "roads.csv", *ENDS, "--pairs", "2"], "--pairs draws nodes", id="pairs and nodes"
        ),
        pytest.param(["graph", "compare", "one.csv", "--pairs", "2"], "a single node", id="no pairs"),
        pytest.param(["graph", "compare", "roads.csv", "--pairs", "0"], "pairs is 0", id="pairs"),
        pytest.param(["graph", "compare", "roads.csv", "--pairs", "way.csv"], "no such file", id="file of pairs"),
        pytest.param(
            ["graph", "compare", "roads.csv", *ENDS, "--solvers", "rrt-star"], "on graphs plan cgla", id="rrt"
        ),
        pytest.param(["graph", "check", "roads.csv"], "--target", id="no target"),
        pytest.param(["graph", "check", "roads.csv", "--target", "x"], "none of the 4 nodes", id="target"),
        pytest.param(
            ["graph", "check", "roads.csv", "--target", "hill", "--source", "x"], "none of the 4 nodes", id="source"
        ),
        pytest.param(["graph", "check", "paper", "--target", "x"], "no file of a graph", id="check a map"),
    ],
)
def test_wrong_input_is_one_line(words: list[str], says: str, cgla: Call) -> None:
    cgla(*words).refused(says)


@pytest.mark.parametrize(
    ("old", "new"),
    [
        (["plan", "--from", "depot", "roads.csv", "--to=hill"], ["plan", "roads.csv", *ENDS]),
        (["check-graph", "roads.csv", "--target", "hill"], ["check", "roads.csv", "--target", "hill"]),
    ],
)
def test_old_names_of_commands_do_the_same_and_say_the_new_one(old: list[str], new: list[str], cgla: Call) -> None:
    answer = cgla(*old, "--json").document()
    assert [*answer] == [*cgla("graph", *new, "--json").document()]
    assert f"is now cgla graph {new[0]}" in cgla(*old).err


# compare


def test_compare_between_two_nodes_takes_all_solvers_for_graphs(cgla: Call) -> None:
    rows = cgla("graph", "compare", "roads.csv", *ENDS, "--workers", 0, "--json").document()["rows"]
    assert {"cgla", "dijkstra", "networkx", "networkx-astar"} <= {row["solver"] for row in rows}
    assert {(row["status"], row["cost"], row["lower_bound"]) for row in rows} == {("optimal", 5.0, 5.0)}
    assert {(row["from"], row["to"], row["nodes"]) for row in rows} == {("depot", "hill", json.dumps(WAY))}


def test_compare_over_pairs_writes_what_a_study_of_maps_writes(cgla: Call, tmp_path: Path) -> None:
    words = ("graph", "compare", "roads.csv", "--pairs", 30, "--solvers", "cgla,dijkstra", "--workers", 0)
    rows = cgla(*words, "--json").document()["rows"]
    ends = [(row["from"], row["to"]) for row in rows if row["solver"] == "cgla"]
    assert len({frozenset(pair) for pair in ends}) == len(ends) == 6  # all that 4 nodes have
    assert all(json.loads(row["nodes"])[0] == row["from"] for row in rows)

    answer = cgla(*words, "--out", "results")
    assert "6 pairs of one graph" in " ".join(answer.out.split())
    written = {file.name for file in (tmp_path / "results").iterdir()}
    assert {"study.jsonl", "report.html", "study.db", "rows.csv", "rows.jsonl", "summary.csv"} <= written
    with (tmp_path / "results" / "rows.csv").open(encoding="utf-8", newline="") as file:
        table = [*csv.DictReader(file)]
    assert [(row["from"], float(row["cost"])) for row in table] == [(row["from"], row["cost"]) for row in rows]

    again = cgla("compare", "--resume", "--out", "results", "--workers", 0, "--json").document()
    lines = (tmp_path / "results" / "rows.jsonl").read_text(encoding="utf-8").splitlines()
    assert again["rows"] == [json.loads(line) for line in lines]
    cgla("results", "results", "--export", "table.tex")
    assert "6 pairs of one graph" in (tmp_path / "table.tex").read_text(encoding="ascii")
    assert cgla("results", "results", "--rerun", 1, "--json").document()["identical"]
    cgla(*words, "--seeds", 2, "--out", "results", "--resume")
    cgla("graph", "compare", "roads.csv", *ENDS, "--weight", "minutes", "--out", "results", "--resume").refused(
        "graph differ"
    )


def test_compare_takes_graphs_under_both_names(cgla: Call) -> None:
    how = ("roads.csv", "--solvers", "cgla", "--workers", 0, "--no-certificate", "--json")
    answers = [
        cgla(*words, *how).document()["rows"]
        for words in (
            ("graph", "compare", *ENDS),
            ("compare", "--from", "depot", "--to", "hill"),
            ("compare", "--source", "depot", "--target", "hill"),
        )
    ]
    assert {tuple((row["from"], row["to"], row["cost"]) for row in rows) for rows in answers} == {
        (("depot", "hill", 5.0),)
    }


def test_no_path_is_an_answer_and_not_a_failure(cgla: Call) -> None:
    words = ("graph", "compare", "island.csv", "--pairs", 6, "--solvers", "cgla,dijkstra", "--workers", 0)
    answer = cgla(*words)
    assert "each of the 12 runs found a path, or that there is none" in answer.out
    summary = cgla(*words, "--json").document()["summary"]
    assert {(one["paths"], one["success"]) for one in summary} == {(0, 1.0), (1, 1.0)}


def test_compare_exits_with_1_if_strict_and_a_path_is_missing(cgla: Call) -> None:
    how = ("--solvers", "cgla", "--workers", 0)
    words = ("graph", "compare", "island.csv", "--from", "a", "--to", "d", *how)
    assert (cgla(*words).code, cgla(*words, "--strict").code) == (0, 1)
    assert cgla("graph", "compare", "roads.csv", *ENDS, *how, "--strict").code == 0


# graph check


def verdicts(answer: Answer) -> dict[str, bool | None]:
    return {check["name"].partition(":")[0]: check["holds"] for check in answer.document()["checks"]}


def test_check_graph_prints_a_line_for_each_check(cgla: Call) -> None:
    answer = cgla("graph", "check", "roads.csv", "--target", "hill", "--source", "depot", "--strict")
    first, *lines = answer.out.splitlines()
    assert first == "roads.csv: 4 nodes, 4 edges, undirected; target hill, source depot"
    assert [line[47:51].strip() for line in lines] == ["yes", "yes", "yes", "no", "yes", "yes", "yes", "yes", ""]
    assert "depot → tower has weight 5, another way 2 (not needed)" in lines[3]
    assert answer.code == 0


@pytest.mark.parametrize(
    ("words", "failed", "open_", "code"),
    [
        pytest.param(["roads.csv", "--target", "hill"], {"triangle inequality"}, set(), 0, id="undirected"),
        pytest.param(
            ["roads.csv", "--target", "hill", "--directed"],
            {"symmetric", "triangle inequality"},
            set(),
            0,
            id="directed",
        ),
        pytest.param(["island.csv", "--target", "a"], {"every node reaches the target"}, set(), 1, id="two parts"),
        pytest.param(
            ["island.csv", "--target", "a", "--source", "c"],
            {"every node reaches the target", "Theorem 1 (3)"},
            set(),
            1,
            id="source cannot",
        ),
        pytest.param(
            ["below.csv", "--target", "c"],
            {"weights at least 0", "Theorem 1 (1)", "Theorem 1 (2)", "Theorem 1 (3)"},
            {"triangle inequality"},
            1,
            id="below 0",
        ),
        pytest.param(["one.csv", "--target", "a", "--source", "a"], set(), set(), 0, id="one node"),
    ],
)
def test_checks_that_hold_fail_or_stay_open(
    words: list[str], failed: set[str], open_: set[str], code: int, cgla: Call
) -> None:
    answer = cgla("graph", "check", *words, "--json", "--strict")
    opened = read_graph(Path(words[0]), directed="--directed" in words)
    ends = [opened.node(words[at + 1]) for at in range(len(words)) if words[at] in {"--target", "--source"}]
    in_python = cg.check_theorem_1(opened.graph(below_zero=True), *ends).document()
    assert {key: answer.document()[key] for key in in_python} == in_python
    found = verdicts(answer)
    assert {name for name, holds in found.items() if holds is False} == failed
    assert {name for name, holds in found.items() if holds is None} == open_
    assert len(found) == 8
    assert answer.code == code
    assert cgla("graph", "check", *words).code == 0
