"""`cgla pareto`, and `cgla plan` within a budget: output, files, and refusals."""

import csv
import math
from pathlib import Path

import numpy as np
import pytest
from command_line import Call

import cgla_graph as cg
from cgla_graph._text import at_most
from cgla_graph.comparisons.plots.pareto import pareto_figure
from cgla_graph.comparisons.tables import fronts
from cgla_graph.plots.pictures import save
from cgla_graph.scenarios.scenario import load_scenario

SMALL = """
start = [0.1, 0.1]
goal = [0.9, 0.9]
k = 5.0
threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]
[lattice]
resolution = 6
"""
SHUT = SMALL + "[no_fly]\npolygons = [[[0.45, -0.1], [0.55, -0.1], [0.55, 1.1], [0.45, 1.1]]]\n"


SLIT = SMALL.replace("resolution = 6", "resolution = 20") + (
    "[no_fly]\npolygons = [[[0.45, -0.1], [0.55, -0.1], [0.55, 0.48], [0.45, 0.48]], "
    "[[0.45, 0.4803], [0.55, 0.4803], [0.55, 1.1], [0.45, 1.1]]]\n"
)
FILES = {
    "small.toml": SMALL,
    "slit.toml": SLIT,
    "shut.toml": SHUT.replace("[lattice]", "").replace("resolution = 6", ""),
}


# cgla pareto


def test_pareto_prints_the_front(cgla: Call) -> None:
    answer = cgla("pareto", "small.toml", "--solver", "cgla")
    assert (answer.code, answer.err) == (0, "")
    front = cg.pareto(load_scenario("small.toml").problem, solver="cgla", resolution=6)
    lines = [line for line in answer.out.splitlines() if line.startswith("│")]
    assert len(lines) == len(front)
    for line, point in zip(lines, front, strict=True):
        cells = [cell.strip() for cell in line.strip("│").split("│")]
        assert float(cells[0]) == pytest.approx(point.k_low, rel=1e-3)
        assert float(cells[2]) == pytest.approx(point.length, rel=1e-5)
        assert float(cells[4]) == pytest.approx(point.risk, rel=1e-3)
        assert (cells[6] == "*") == (point is front.knee)
    assert "proven on the lattice" in " ".join(answer.out.split())


def test_pareto_writes_its_files_and_json(cgla: Call, tmp_path: Path) -> None:
    answer = cgla("pareto", "small.toml", "--solver", "cgla", "--out", "out", "--formats", "svg,pdf", "--json")
    assert (answer.code, answer.err) == (0, "")
    found = answer.document()
    assert {path.name for path in (tmp_path / "out").iterdir()} == {
        f"small-cgla-pareto{end}" for end in (".csv", ".svg", ".pdf", "-paths.csv")
    }
    assert found["files"][:2] == ["out/small-cgla-pareto.csv", "out/small-cgla-pareto-paths.csv"]
    assert (tmp_path / "out" / "small-cgla-pareto.pdf").read_bytes().startswith(b"%PDF")
    with (tmp_path / "out" / "small-cgla-pareto.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert tuple(rows[0]) == fronts.COLUMNS
    assert (found["status"], found["scenario"], found["solver"]) == ("optimal", "small", "cgla")
    problem = load_scenario("small.toml").problem
    for row, point in zip(rows, found["points"], strict=True):
        # both have full precision, and the numbers are those of the path
        judged = problem.evaluate(point["path"])
        assert float(row["length"]) == point["length"] == judged.length
        assert float(row["risk"]) == point["risk"] == judged.risk
        assert point["cost"] == pytest.approx(point["length"] + point["k"] * point["risk"])
    assert 0 < found["knee"] < len(rows) - 1


def test_a_range_without_end_is_empty_in_csv_and_null_in_json(cgla: Call) -> None:
    free = SMALL.replace("threats = [{ x = 0.5, y = 0.5, spread = 0.1 }]", "")
    Path("free.toml").write_text(free, encoding="utf-8")
    found = cgla("pareto", "free.toml", "--solver", "cgla", "--json", "--out", "out").document()
    assert [point["k_high"] for point in found["points"]] == [None]
    assert found["knee"] is None
    line = Path("out/free-cgla-pareto.csv").read_text(encoding="utf-8").splitlines()[1]
    assert line.startswith("0.0,,0.0,")
    assert "any" in cgla("pareto", "free.toml", "--solver", "cgla").out


@pytest.mark.slow
def test_the_front_of_a_raster_is_over_all_weights(cgla: Call, tmp_path: Path) -> None:
    """So none has to be given; with a corridor, costs are those of one weight."""
    (tmp_path / "p.asc").write_text("ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 1\n1 9 1\n1 2 1\n")
    words = ("pareto", tmp_path / "p.asc", "--unit", "people/km2", "--start", "0.2,1.5", "--goal", "2.8,1.5")
    quick = ("--solver", "hybrid:points=60:candidates=1", "--json")
    found = cgla(*words, *quick).document()
    assert found == cgla(*words, *quick, "--k", 7).document()
    assert found["unit_of_risk"] == "people/km2 x m"
    assert "give --k K" in cgla(*words, "--corridor", 0.1).err
    within = cgla("plan", *words[1:], *quick, "--max-length", 3).document()
    assert within["cost"] == within["length"] == pytest.approx(3.0)


def test_pareto_with_other_ends_another_lattice_and_settings(cgla: Call) -> None:
    words = ("--start", "0.2,0.5", "--goal", "0.8,0.5", "--resolution", "9", "--json")
    found = cgla("pareto", "small.toml", "--solver", "cgla:schedule=synchronous", *words).document()
    paths = [np.array(point["path"]) for point in found["points"]]
    assert all(path[0].tolist() == [0.2, 0.5] and path[-1].tolist() == [0.8, 0.5] for path in paths)
    inner = np.concatenate([path[1:-1] for path in paths])
    assert len(inner)
    np.testing.assert_allclose(inner * 8, np.round(inner * 8), atol=1e-9)
    assert found["solver"] == "cgla:schedule=synchronous"


def test_pareto_without_a_path(cgla: Call) -> None:
    answer = cgla("pareto", "shut.toml", "--solver", "cgla", "--out", "out")
    assert answer.code == 1
    assert "no-path: no path exists on the graph" in answer.out
    assert not list(Path("out").iterdir())
    found = cgla("pareto", "shut.toml", "--solver", "cgla", "--json").document()
    assert (found["points"], found["status"], found["error"]) == ([], "no-path", None)


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["nowhere"], "nowhere"),
        (["small.toml", "--solver", "none"], "unknown solver 'none'"),
        (["small.toml", "--solver", "cgla:speed=3"], "no setting 'speed'"),
        (["small.toml", "--start", "2,2"], "outside the bounds"),
        (["small.toml", "--start", "2"], "--start is '2'"),
        (["small.toml", "--resolution", "1"], "resolution is 1"),
        ([], "missing argument"),
    ],
)
def test_pareto_refuses_wrong_input(cgla: Call, words: list[str], said: str) -> None:
    cgla("pareto", *words).refused(said)


# cgla plan --max-risk, --max-length


def test_plan_within_a_risk(cgla: Call) -> None:
    answer = cgla("plan", "small.toml", "--solver", "cgla", "--max-risk", "0.05")
    assert (answer.code, answer.err) == (0, "")
    lines = {line[:10].strip(): line[11:] for line in answer.out.splitlines()}
    plan = cg.plan_within_risk(load_scenario("small.toml").problem, 0.05, solver="cgla", resolution=6)
    assert float(lines["length"]) == pytest.approx(plan.solution.length, rel=1e-8)
    assert float(lines["risk"]) <= 0.05
    assert lines["budget"] == "risk at most 0.05"
    assert lines["status"] == "optimal: no path on the lattice within the budget is shorter"
    assert float(lines["weight"].split()[2]) == pytest.approx(plan.k, rel=1e-5)
    assert float(lines["dual bound"].split(":")[0]) == pytest.approx(plan.dual_bound, rel=1e-8)
    assert lines["gap"] == f"{100 * plan.gap:+.2f} %: duality gap"


def test_plan_within_a_length_as_json(cgla: Call) -> None:
    found = cgla("plan", "small.toml", "--solver", "cgla", "--max-length", "1.3", "--json", "--out", "out").document()
    assert (found["status"], found["solver"]) == ("optimal", "cgla")
    assert found["length"] <= 1.3
    within = found["within"]
    assert (within["limited"], within["budget"], within["scope"]) == ("length", 1.3, "lattice")
    assert within["dual_bound"] <= found["risk"]
    assert within["duality_gap"] == pytest.approx(found["risk"] / within["dual_bound"] - 1.0)
    # the cost is the one under the scenario's own weight
    assert found["cost"] == pytest.approx(found["length"] + 5.0 * found["risk"])
    assert found["files"] == ["out/small-cgla.csv", "out/small-cgla.png"]


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--max-risk", "1e-9"], "no path on the lattice has a risk of at most 1e-09: the least is"),
        (["--max-length", "1"], "no path on the lattice is at most 1 long: the shortest is 1.13137085"),
    ],
)
def test_a_budget_that_cannot_be_kept(cgla: Call, words: list[str], said: str) -> None:
    answer = cgla("plan", "small.toml", "--solver", "cgla", *words)
    assert (answer.code, answer.err) == (1, "")
    assert said in answer.out
    assert "no path on the lattice keeps the budget" in answer.out
    found = cgla("plan", "small.toml", "--solver", "cgla", *words, "--json").document()
    assert (found["within"]["dual_bound"], found["within"]["duality_gap"], found["path"]) == (None, None, [])


@pytest.mark.parametrize("words", [["--max-risk", "1"], pytest.param(["--max-length", "5"], marks=pytest.mark.slow)])
def test_what_a_grid_does_not_see_is_not_said_to_be_none(cgla: Call, words: list[str]) -> None:
    plan = "plan", "slit.toml", "--solver", "eight-direction", "--tolerance", "0.5", *words
    answer = cgla(*plan)
    assert (answer.code, answer.err) == (1, "")
    said = " ".join(answer.out.split())
    assert "keeps the budget" not in said
    assert "there is one within the budget, of length" in said
    found = cgla(*plan, "--json").document()
    assert (found["status"], found["within"]["no_path"]) == ("not-found", False)
    within = {"--max-risk": cg.plan_within_risk, "--max-length": cg.plan_within_length}[words[0]]
    best = within(load_scenario("slit.toml").problem, float(words[1]), tolerance=0.5).solution
    assert 0.0 <= found["within"]["dual_bound"] <= (best.length if "--max-risk" in words else best.risk)


def test_a_proof_that_no_path_keeps_a_budget_is_called_one(cgla: Call) -> None:
    plan = "plan", "shut.toml", "--solver", "eight-direction", "--max-risk", "1"
    said = " ".join(cgla(*plan).out.split())
    assert "it is proven that no path inside the bounds keeps the budget" in said
    assert cgla(*plan, "--json").document()["within"]["no_path"] is True


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--max-risk", "-1"], "max_risk is -1"),
        (["--max-risk", "nan"], "max_risk is nan"),
        (["--max-length", "inf"], "max_length is inf"),
        (["--max-risk", "little"], "Invalid value for '--max-risk'"),
        (["--max-risk", "1", "--max-length", "1"], "limit one"),
        (["--max-risk", "1", "--refine"], "--refine may break the budget"),
    ],
)
def test_wrong_budgets(cgla: Call, words: list[str], said: str) -> None:
    cgla("plan", "small.toml", "--solver", "cgla", *words).refused(said)


@pytest.mark.parametrize("budgets", [",", "", "0.1,,0.3", "0.1;0.3"])
def test_budgets_are_never_dropped(cgla: Call, budgets: str) -> None:
    cgla("pareto", "small.toml", "--proven", "--budgets", budgets).refused("--budgets is", "give numbers")


# The picture


@pytest.mark.slow
def test_the_picture_shows_every_path_twice(tmp_path: Path) -> None:
    scenario = load_scenario("finland")
    front = cg.pareto(scenario.problem, solver="lazy-theta-star", resolution=scenario.lattice, max_points=6)
    figure = pareto_figure(scenario, front)
    by_label = {axes.get_ylabel(): axes for axes in figure.axes}
    plot, bar = by_label["length (km)"], by_label["best from k = … on"]
    dots = [line for line in plot.lines if line.get_marker() == "o" and line.get_markersize() < 10]
    spots = [(float(line.get_xdata()[0]), float(line.get_ydata()[0])) for line in dots]  # type: ignore[index]
    np.testing.assert_allclose(spots, [(point.risk, point.length / 1000) for point in front])
    # meridians and parallels are grey
    lines = [line for line in figure.axes[0].lines if not isinstance(line.get_color(), str)]
    drawn = [line for line in lines if len(np.asarray(line.get_xdata())) > 1]
    # a path has the colour of its point, and no two that lie far apart on the front have the same
    assert [line.get_color() for line in drawn] == [dot.get_color() for dot in dots]
    assert dots[0].get_color() != dots[-1].get_color()
    weights = [point.k_low for point in front if point.k_low > 0.0]
    assert bar.get_ylim() == pytest.approx((min(weights), max(weights)))
    assert save(figure, tmp_path / "front.png").stat().st_size > 10_000


@pytest.mark.parametrize("n_points", [0, 1, 2])
def test_pictures_of_few_paths(n_points: int, tmp_path: Path) -> None:
    scenario = load_scenario("one-threat")
    front = cg.pareto(scenario.problem, solver="lazy-theta-star", max_points=2)
    few = cg.pareto(scenario.problem, solver="straight-line") if n_points == 1 else front
    points = few.points[:n_points]
    figure = pareto_figure(scenario, type(front)(points, few.status, k_max=few.k_max))
    assert len(figure.axes) == (2 if n_points == 0 else 3)
    save(figure, tmp_path / "few.png")
    assert math.isfinite(figure.get_size_inches()[0])


@pytest.mark.slow
def test_pareto_with_a_proof(cgla: Call, tmp_path: Path) -> None:
    words = ("pareto", "small.toml", "--proven", "--k-max", "1")
    front = cg.pareto(load_scenario("small.toml").problem, solver="hybrid", proven=True, k_max=1.0)
    shown = " ".join(cgla(*words, "--out", "out", "--budgets", "0.05").out.split())
    assert f"for every k from 0 to 1.000, the cheapest one costs at most {at_most(front.gap)} more than" in shown
    assert "the shortest within a budget (lengths in map units)" in shown
    found = cgla(*words, "--json").document()
    assert found["proven"] == front.document()["proven"]
    with (tmp_path / "out" / "small-hybrid-pareto.csv").open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["lower_bound"]) for row in rows] == [front.lower_bound(point.k) for point in front]
    assert max(float(row["gap"]) for row in rows) == pytest.approx(front.gap)
    with (tmp_path / "out" / "small-hybrid-pareto-budgets.csv").open(encoding="utf-8") as file:
        (within,) = csv.DictReader(file)
    assert float(within["budget"]) == 0.05
    assert float(within["lower_bound"]) <= float(within["length"])
    cgla("pareto", "small.toml", "--proven", "--budgets", "few").refused("give numbers")
    cgla("pareto", "small.toml", "--budgets", "0.1").refused("proven=True")
    cgla("pareto", "small.toml", "--proven", "--k-max", "0").refused("k_max is 0")
    cgla("pareto", "small.toml", "--proven", "--corridor", "1").refused("leave out --proven")


@pytest.mark.slow
def test_the_picture_of_a_proven_front_shows_what_no_path_reaches() -> None:
    scenario = load_scenario("one-threat")
    front = cg.pareto(scenario.problem, proven=True, k_max=5.0, tolerance=0.02, budgets=[0.05])
    figure = pareto_figure(scenario, front)
    labels = [axes.get_ylabel() for axes in figure.axes]
    assert "gap at most, %" in labels
    shown = figure.axes[labels.index("length")]
    legend = shown.get_legend()
    assert legend is not None
    texts = [text.get_text() for text in legend.get_texts()]
    assert any("no path (proven" in text for text in texts)
    assert any("within a budget" in text for text in texts)
    (line,) = [one for one in figure.axes[labels.index("gap at most, %")].lines if len(one.get_xdata()) > 100]  # type: ignore[arg-type]
    assert max(line.get_ydata()) <= 100.0 * front.gap * (1.0 + 1e-9)  # type: ignore[arg-type, operator]
