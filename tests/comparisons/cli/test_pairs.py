"""`cgla plan --pairs`: many questions of a file."""

import csv
from pathlib import Path

import pytest
from command_line import Call

import cgla_graph as cg

HEADS = "name,start_x,start_y,goal_x,goal_y"
TABLE = f"{HEADS}\nhome,0.1,0.1,0.9,0.9\nback,0.8,0.2,0.1,0.1\n"


def test_the_answer_is_that_of_python(cgla: Call, tmp_path: Path) -> None:
    Path("pairs.csv").write_text(TABLE, encoding="utf-8")
    found = cgla("plan", "paper", "--pairs", "pairs.csv", "--out", "out", "--json")
    assert found.code == 0
    problem = cg.load_scenario("paper").problem
    asked = cg.read_pairs("pairs.csv", problem)
    answers = cg.Map(problem).solve(asked.starts, asked.goals, names=asked.names)
    document = found.document()
    assert [one["cost"] for one in document["answers"]] == answers.costs.tolist()
    assert document["answers"][0]["path"] == answers.paths[0].tolist()
    rows = list(csv.DictReader((tmp_path / "out" / "paper-pairs.csv").read_text(encoding="utf-8").splitlines()))
    assert [row["name"] for row in rows] == ["home", "back"]
    assert float(rows[1]["lower_bound"]) == answers[1].lower_bound
    shown = cgla("plan", "paper", "--pairs", "pairs.csv").out
    assert "home" in shown
    assert answers.message[:20] in shown


def test_one_end_may_be_left_out(cgla: Call) -> None:
    Path("goals.csv").write_text("goal_x,goal_y\n0.3,0.3\n", encoding="utf-8")
    (one,) = cgla("plan", "paper", "--pairs", "goals.csv", "--json").document()["answers"]
    assert (one["start_x"], one["goal_x"]) == (0.1, 0.3)


def test_degrees(cgla: Call, tmp_path: Path) -> None:
    area = '{"type": "Polygon", "coordinates": [[[24.8,60.1],[25.1,60.1],[25.1,60.2],[24.8,60.2],[24.8,60.1]]]}'
    Path("areas.geojson").write_text(area, encoding="utf-8")
    table = "start_longitude,start_latitude\n24.75,60.12\n24.7,60.18\n"
    Path("starts.csv").write_text(table, encoding="utf-8")
    ends = ("--start", "24.7,60.12", "--goal", "25.2,60.15", "--pairs", "starts.csv")
    document = cgla("plan", "areas.geojson", *ends, "--out", "out", "--json").document()
    assert [one["start_longitude"] for one in document["answers"]] == pytest.approx([24.75, 24.7])
    assert [one["path"][-1] for one in document["answers"]] == [pytest.approx([25.2, 60.15])] * 2
    assert (tmp_path / "out" / "areas-pairs.geojson").exists()


@pytest.mark.parametrize(
    ("text", "words", "said"),
    [
        ("", (), ("it is empty", "start_x,start_y,goal_x,goal_y")),
        ("a,b\n1,2\n", (), ("the first line says 'a,b'", "start_x")),
        ("start_x\n1\n", (), ("no column start_y", "give both")),
        (f"{HEADS}\na,0.1,here,0.2,0.2\n", (), ("line 2", "a place is two finite numbers")),
        (f"{HEADS}\na,0.1,0.1,0.2,1.2\n", (), ("goal 1 of 1", "outside the bounds")),
        ("start_x,start_y,start_x\n0.1,0.1,0.3\n", (), ("the column start_x 2 times", "leave one")),
        ("start_x,start_y,goalx,goaly\n0.1,0.1,0.3,0.3\n", (), ("'goalx' is no column of a place", "goal_x")),
        (f"{HEADS}\na,0,1,0,1,0,2,0,2\n", (), ("line 2 has 9 cells", "5 columns", "with a point")),
        (TABLE, ("--scenarios", "two.toml"), ("--pairs with --scenarios",)),
        (TABLE, ("--via", "0.2,0.2"), ("--pairs with --via",)),
        (TABLE, ("--max-risk", "1"), ("--pairs with --max-risk",)),
        (TABLE, ("--solver", "cgla"), ("--pairs with --solver", "leave one out")),
        (TABLE, ("--tolerance", "0"), ("--pairs proves each path",)),
        (TABLE, ("--turn-radius", "0.1"), ("--pairs with --turn-radius",)),
    ],
)
def test_nonsense_is_refused(cgla: Call, text: str, words: tuple[str, ...], said: tuple[str, ...]) -> None:
    Path("pairs.csv").write_text(text, encoding="utf-8")
    cgla("plan", "paper", "--pairs", "pairs.csv", *words).refused(*said)
