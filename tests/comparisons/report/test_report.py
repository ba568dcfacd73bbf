"""The report's page, without a browser: what it knows, what it says, and that it stands alone."""

import base64
import dataclasses
import itertools
import json
import math
import statistics
from collections.abc import Sequence
from html.parser import HTMLParser
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from report_studies import ODD, failing, large_study, odd_runs, small_runs, stored_of
from strategies import few

import cgla_graph as cg
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.leaderboard.profiles import instance_costs
from cgla_graph.comparisons.report.maps import (
    MOST_CORNERS,
    MOST_WAYPOINTS,
    SLACK,
    STEPS,
    map_document,
    map_key,
    path_steps,
)
from cgla_graph.comparisons.report.page import report_html, write_report
from cgla_graph.comparisons.report.parts import failure_grid, failures, rank_picture, ranking_table
from cgla_graph.comparisons.report.payload import thinned
from cgla_graph.comparisons.statistics.ranking import fewest_instances, ranking
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.comparisons.tables.leaderboard_columns import leaderboard_notes
from cgla_graph.comparisons.tables.overview import overview
from cgla_graph.errors import OutputError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario, load_scenario

UNIT = cg.Problem((0.0, 0.0), (1.0, 1.0))
FIELD = cg.RiskField([cg.Threat(0.3, 0.7, 0.1)])


class Page(HTMLParser):
    """A page taken apart: its elements, its text, and the content of its scripts."""

    def __init__(self, html: str) -> None:
        super().__init__()
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text: list[str] = []
        self.raw: dict[str, str] = {}
        self._inside = ""
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self._inside = dict(attrs).get("id") or tag if tag in {"script", "style"} else ""

    def handle_endtag(self, _tag: str) -> None:
        self._inside = ""

    def handle_data(self, data: str) -> None:
        if self._inside:
            self.raw[self._inside] = self.raw.get(self._inside, "") + data
        else:
            self.text.append(data)

    @property
    def data(self) -> dict[str, Any]:
        document = json.loads(self.raw["data"])
        assert isinstance(document, dict)
        return document


@pytest.fixture(scope="module")
def runs() -> list[Run]:
    return small_runs()


@pytest.fixture(scope="module")
def stored(runs: list[Run]) -> Stored:
    return stored_of(runs)


@pytest.fixture(scope="module")
def page(stored: Stored) -> Page:
    return Page(report_html(stored))


def study_of(costs: dict[str, Sequence[float]]) -> Stored:
    """Make up a study with one run for each cost; infinite ones timed out."""
    n = max(map(len, costs.values()))
    scenarios = [Scenario(f"map-{i}", "", UNIT, Lattice(4, bounds=UNIT.bounds)) for i in range(n)]
    runs = [
        Run(scenario, solver, None, exact=False, solution=answer(row[i]))
        for i, scenario in enumerate(scenarios)
        for solver, row in costs.items()
        if i < len(row)
    ]
    return stored_of(runs)


def answer(cost: float) -> Solution:
    if math.isinf(cost):
        return Solution(Status.TIMED_OUT, seconds=1.0, message="stopped")
    path = np.array([(0.0, 0.0), (1.0, 1.0)])
    return Solution(Status.FOUND, path=path, cost=cost, length=cost, risk=0.0, lower_bound=1.0, seconds=0.1)


# ---- the page


@pytest.mark.slow
def test_the_page_asks_for_nothing_but_itself(page: Page) -> None:
    for tag, attributes in page.elements:
        assert tag not in {"iframe", "object", "embed", "base", "form"} or attributes.get("id") == "filters"
        for name in ("src", "href", "action", "srcset", "data"):
            assert (attributes.get(name) or "#").startswith(("#", "data:")), (tag, attributes)
    assert "url(" not in page.raw["style"]
    assert "@import" not in page.raw["style"]
    (policy,) = [a["content"] for _, a in page.elements if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy is not None
    assert policy.startswith("default-src 'none'")
    assert "connect-src 'none'" in policy
    assert "http" not in policy


@pytest.mark.slow
def test_a_live_page_may_ask_its_own_server(stored: Stored) -> None:
    live = Page(report_html(stored, live=True))
    (policy,) = [a["content"] for _, a in live.elements if a.get("http-equiv") == "Content-Security-Policy"]
    assert policy is not None
    assert "connect-src 'self'" in policy
    assert live.data["live"] is True


@pytest.mark.slow
def test_parts_that_are_swapped_have_ids_of_their_own(page: Page) -> None:
    parts = [attributes.get("id") for _, attributes in page.elements if "data-live" in attributes]
    assert len(parts) >= 4
    assert all(parts)
    ids = [attributes["id"] for _, attributes in page.elements if "id" in attributes]
    assert len(ids) == len(set(ids))


@pytest.mark.slow
def test_the_same_study_gives_the_same_page(stored: Stored) -> None:
    assert report_html(stored) == report_html(stored)


def test_every_run_is_in_the_table(stored: Stored, page: Page) -> None:
    rows = page.data["rows"]
    for i, run in enumerate(stored.runs):
        assert rows["number"][i] == run.number
        assert page.data["names"][rows["scenario"][i]] == run.scenario.name
        assert page.data["solvers"][rows["solver"][i]] == run.solver
        assert page.data["statuses"][rows["status"][i]]["label"] == run.solution.status.label
        assert rows["words"]["message"][rows["message"][i]] == run.solution.message
        cost = run.solution.cost
        assert rows["cost"][i] == (pytest.approx(cost, rel=1e-7) if math.isfinite(cost) else None)
    assert {len(column) for name, column in rows.items() if name != "words"} == {len(stored.runs)}


def test_medians_on_the_map_are_those_of_the_runs(stored: Stored, page: Page) -> None:
    for scenario in page.data["scenarios"]:
        for cell in scenario["cells"]:
            label = page.data["solvers"][cell["solver"]]
            group = [run for run in stored.runs if (run.scenario.name, run.solver) == (scenario["name"], label)]
            costs = [run.solution.cost if run.solution.status.has_path else math.inf for run in group]
            median = statistics.median_low(costs)
            assert cell["cost"][0] == (pytest.approx(median, rel=1e-7) if median < math.inf else None)
            assert (cell["runs"], cell["paths"]) == (len(group), sum(cost < math.inf for cost in costs))
            if median < math.inf:
                drawn = next(run for run in group if run.number == cell["number"])
                assert drawn.solution.cost == median
                ends = np.array(cell["path"]).reshape(-1, 2)[[0, -1]]
                assert ends.ravel().tolist() == scenario["ends"]


def test_an_infeasible_path_is_drawn_and_named(page: Page) -> None:
    maze = next(scenario for scenario in page.data["scenarios"] if scenario["name"] == "maze")
    (cell,) = [cell for cell in maze["cells"] if page.data["solvers"][cell["solver"]] == "straight-line"]
    assert cell["status"] == "infeasible"
    assert len(cell["path"]) >= 4
    assert page.data["maps"][maze["map"]]["y_down"] is True


def test_what_does_not_exist_is_no_number(page: Page) -> None:
    # JSON knows no NaN and no infinity; json.loads would take them
    assert not {"NaN", "Infinity"} & set(page.raw["data"].replace("-", " ").replace(",", " ").replace(":", " ").split())
    json.loads(page.raw["data"], parse_constant=pytest.fail)


def test_odd_names_are_text(tmp_path: Path) -> None:
    stored = dataclasses.replace(stored_of(odd_runs(), title=f"title {ODD}"), folder=Path(f"folder {ODD}"))
    html = report_html(stored)
    odd = Page(html)
    tags = [tag for tag, _ in odd.elements]
    assert "img" not in tags
    assert tags.count("script") == 3
    assert odd.data["names"] == [f"scenario {ODD}"]
    assert odd.data["solvers"][1] == f"solver {ODD}"
    assert odd.data["rows"]["words"]["message"][1] == f"message {ODD}"
    assert f"solver {ODD}" in "".join(odd.text).replace("\r\n", "\n")
    assert "{{7*7}}" in html
    assert not any(name.startswith("on") for _, attributes in odd.elements for name in attributes)
    # lone surrogates, which odd file names have, are escaped in visible text
    written = write_report(stored, tmp_path / "report.html").read_text(encoding="utf-8")
    assert written == html
    assert r"\udcff failing" in "".join(odd.text)
    assert odd.data["solvers"][2] == rf"\udcff failing {ODD}"


def test_a_folder_that_is_not_there(stored: Stored, tmp_path: Path) -> None:
    with pytest.raises(OutputError, match="cannot be written"):
        write_report(stored, tmp_path / "nowhere" / "report.html")


def test_the_command_that_runs_a_row_again_is_quoted(page: Page) -> None:
    assert page.data["rerun"] == "cgla results 'results/my study' --rerun"
    assert "cgla results 'results/my study' --rerun NUMBER" in "".join(page.text)


def test_an_unfinished_study_says_so(runs: list[Run]) -> None:
    half = stored_of(runs[: len(runs) // 2], n_cells=len(runs))
    unfinished = Page(report_html(half))
    (bar,) = [attributes for tag, attributes in unfinished.elements if tag == "progress"]
    assert (bar["value"], bar["max"]) == (str(len(half.runs)), str(len(runs)))
    assert f"{len(half.runs)} of {len(runs)} runs so far" in "".join(unfinished.text)
    assert unfinished.data["complete"] is False


def test_a_study_without_runs(runs: list[Run]) -> None:
    nothing = dataclasses.replace(stored_of(runs), runs=[])
    empty = Page(report_html(nothing))
    assert "No run is done yet." in "".join(empty.text)
    assert empty.data["scenarios"] == empty.data["order"] == []


def test_of_many_solvers_those_of_the_paper_and_the_best_are_shown_first(runs: list[Run]) -> None:
    labels = [*(f"solver-{i}" for i in range(12)), "mine", "cgla", "bcv-style", "rrt-star:iterations=50"]
    found = [
        Run(
            runs[0].scenario,
            label,
            None,
            exact=False,
            solution=Solution(Status.FOUND, np.array([(0, 0), (1, 1)]), cost=1.0 + i),
        )
        for i, label in enumerate(labels)
    ]
    found[12] = dataclasses.replace(found[12], solution=dataclasses.replace(found[12].solution, solver="dijkstra"))
    data = Page(report_html(stored_of(found))).data
    assert [data["solvers"][place] for place in data["first"]] == ["solver-0", *labels[12:]]
    assert Page(report_html(stored_of(found[:8]))).data["first"] == list(range(8))


def test_scenarios_of_one_map_share_it(runs: list[Run]) -> None:
    run = runs[0]
    problem = dataclasses.replace(run.scenario.problem, k=3.0)
    other = dataclasses.replace(run.scenario, name="other", problem=problem)
    data = Page(report_html(stored_of([run, dataclasses.replace(run, scenario=other)]))).data
    assert [scenario["map"] for scenario in data["scenarios"]] == [0, 0]
    assert len(data["maps"]) == 1


# ---- step functions


step_rows = st.lists(st.tuples(*[st.one_of(st.floats(-1e3, 1e3), st.just(math.inf))] * 2), min_size=1, max_size=80).map(
    lambda values: np.column_stack([np.arange(len(values)), np.array(values)])
)


@given(step_rows, st.integers(2, 100))
def test_thinned_rows_are_some_of_the_rows_with_both_ends(rows: np.ndarray, most: int) -> None:
    kept = thinned(rows, most)
    assert len(kept) <= max(most, 2)
    assert kept[0].tolist() == rows[0].tolist()
    assert kept[-1].tolist() == rows[-1].tolist()
    places = kept[:, 0].astype(int)
    assert (np.diff(places) > 0).all()
    assert kept.tolist() == rows[places].tolist()


@given(step_rows)
def test_thinning_hides_nothing_that_can_be_seen(rows: np.ndarray) -> None:
    kept = thinned(rows, most=len(rows) + 1)
    shown = kept[np.searchsorted(kept[:, 0], rows[:, 0], side="right") - 1, 1:]
    finite = rows[:, 1:][np.isfinite(rows[:, 1:])]
    spread = float(np.ptp(finite)) if len(finite) else 0.0
    same = np.isclose(rows[:, 1:], shown, rtol=0.0, atol=1e-4 * spread + 1e-12)
    assert same.all()


# ---- maps


@given(st.lists(st.tuples(st.floats(0, 1), st.floats(0, 1)), min_size=2, max_size=60))
def test_a_path_keeps_its_ends_and_its_shape(points: list[tuple[float, float]]) -> None:
    steps = np.array(path_steps(np.array(points), UNIT)).reshape(-1, 2) / STEPS
    assert len(steps) <= MOST_WAYPOINTS
    assert np.abs(steps[[0, -1]] - np.array(points)[[0, -1]]).max() <= 0.5 / STEPS + 1e-12
    assert shapely.LineString(points).hausdorff_distance(shapely.LineString(steps)) <= SLACK + 2.0 / STEPS


def test_a_long_path_is_simplified() -> None:
    along = np.linspace(0.0, 1.0, 20_000)
    path = np.stack([along, 0.5 + 0.4 * np.sin(60.0 * along)], axis=1)
    steps = np.array(path_steps(path, UNIT)).reshape(-1, 2) / STEPS
    assert len(steps) <= MOST_WAYPOINTS
    assert shapely.LineString(path).hausdorff_distance(shapely.LineString(steps)) < 0.02


def test_the_shading_is_the_risk() -> None:
    problem = cg.Problem((0.0, 0.0), (2.0, 1.0), FIELD, k=1.0, bounds=(0.0, 0.0, 2.0, 1.0))
    risk = map_document(Scenario("a", "", problem, Lattice(4, bounds=problem.bounds)))["risk"]
    levels = np.frombuffer(base64.b64decode(risk["levels"]), dtype=np.uint8).reshape(risk["rows"], risk["columns"])
    assert (risk["rows"], risk["columns"]) == (48, 96)
    x, y = (np.arange(96) + 0.5) / 48.0, (np.arange(48) + 0.5) / 48.0
    exact = FIELD.density(np.stack(np.meshgrid(x, y), axis=-1))
    shown = risk["low"] + levels / 255.0 * (risk["top"] - risk["low"])
    assert np.abs(shown - exact).max() <= 0.5 / 255.0 * (risk["top"] - risk["low"]) + 1e-12
    assert risk["top"] == pytest.approx(1.0)


def test_a_raster_alone_is_shaded_and_its_hottest_cell_is_seen() -> None:
    values = np.ones((700, 700))
    values[600, 50] = 500.0
    cooler = values.copy()
    cooler[600, 50] = 400.0
    scenarios = [
        Scenario(
            "a", "", dataclasses.replace(UNIT, field=cg.RiskField(rasters=[raster])), Lattice(4, bounds=UNIT.bounds)
        )
        for raster in (RasterRisk(one, UNIT.bounds, interpolation="nearest") for one in (values, cooler))
    ]
    risk = map_document(scenarios[0])["risk"]
    levels = np.frombuffer(base64.b64decode(risk["levels"]), dtype=np.uint8)
    assert (risk["top"], risk["power"]) == (500.0, 1.0 / 3.0)
    assert (levels.max(), np.median(levels)) == (255, round(255.0 * (1.0 / 500.0) ** (1.0 / 3.0)))
    assert map_key(scenarios[0]) != map_key(scenarios[1])


def test_a_map_without_risk_has_no_shading() -> None:
    assert map_document(load_scenario("maze"))["risk"] is None


def test_a_hole_in_a_no_fly_area_stays_open() -> None:
    ring = shapely.Point(0.5, 0.5).buffer(0.3).difference(shapely.Point(0.5, 0.5).buffer(0.2))
    problem = dataclasses.replace(UNIT, no_fly=ring)
    rings = map_document(Scenario("a", "", problem, Lattice(4, bounds=UNIT.bounds)))["no_fly"]
    outer, inner = (shapely.Polygon(np.array(flat).reshape(-1, 2) / STEPS) for flat in rings)
    assert outer.difference(inner).area == pytest.approx(ring.area, rel=0.01)


def test_a_no_fly_area_of_many_corners_becomes_a_raster() -> None:
    x, y = np.meshgrid(np.linspace(0.04, 0.98, 25), np.linspace(0.02, 0.48, 25))
    dots = shapely.union_all(shapely.buffer(shapely.points(x.ravel(), y.ravel()), 0.008, quad_segs=2))
    problem = dataclasses.replace(UNIT, bounds=(0.0, 0.0, 1.0, 2.0), no_fly=dots)
    assert shapely.get_num_coordinates(dots) > MOST_CORNERS
    document = map_document(Scenario("a", "", problem, Lattice(4, bounds=problem.bounds)))
    walls = document["walls"]
    quarters = np.frombuffer(base64.b64decode(walls["quarters"]), dtype=np.uint8).reshape(
        walls["rows"], walls["columns"]
    )
    assert document["no_fly"] == []
    assert quarters.shape == (240, 120)
    assert quarters.max() <= 4
    assert quarters.sum() / quarters.size / 4.0 == pytest.approx(dots.area / 2.0, rel=0.1)
    # the area is where it is: rows from the least y on
    assert quarters[120:].sum() == 0
    assert quarters[:, :2].sum() == 0


# ---- words


def test_the_summary_answers_the_four_questions() -> None:
    stored = study_of({"bad": [3.0] * 11 + [math.inf], "good": [1.0] * 12, "near": [1.1] * 12})
    said = overview(leaderboard_of(stored.runs), 12)
    assert said.headline.startswith(
        "good ranks first of 3 solvers on 12 scenarios; the next one, near, typically costs"
    )
    assert "10 % more" in said.headline
    who, much, sure, where = said.answers
    assert who.figure == "good"
    assert "on 12 of 12" in who.words
    assert much.figure == "+10.00 %"
    assert "near" in much.words
    assert sure.figure == "2 of 2 are more expensive beyond chance"
    assert "p < 0.05" in sure.words
    assert "strong evidence" in said.headline
    assert where.figure == "1 of 36 runs have no path"
    assert "bad in 1 of 12 (on map-11)" in where.words
    assert not said.caution


def test_a_draw_and_few_scenarios_are_called_so() -> None:
    stored = study_of({"a": [1.0, 2.0], "b": [1.0, 2.0]})
    said = overview(leaderboard_of(stored.runs), 2)
    assert said.headline == "a and b share the first place of 2 solvers on 2 scenarios."
    assert said.answers[2].figure == "too few scenarios to say"
    assert "it takes 6 scenarios or more" in said.answers[2].words


@few
@given(
    k=st.integers(2, 5),
    n=st.integers(1, 14),
    spread=st.sampled_from([0.0, 0.02, 0.3, 2.0]),
    random=st.randoms(use_true_random=False),
)
def test_words_and_p_values_agree(k: int, n: int, spread: float, random: Any) -> None:  # noqa: ANN401 - random.Random
    costs = {f"s{i}": [1.0 + spread * i + round(random.random(), 1) for _ in range(n)] for i in range(k)}
    runs = study_of(costs).runs
    found, ranks = leaderboard_of(runs), ranking(instance_costs(runs))
    sure = next(answer for answer in overview(found, n).answers if answer.question == "How confident?")
    told = [one for one in found[1:] if one.versus_best is not None and one.versus_best.p_holm < 0.05]
    texts = [ranking_table(found, ranks)["note"], *leaderboard_notes(found), sure.words]
    fewest = fewest_instances(k)
    if n < fewest:
        assert not told
        assert "beyond chance" not in sure.figure
        needed = [text for text in texts if f"it takes {fewest} scenarios or more" in text]
        assert len(needed) == 3
        assert "Friedman" not in texts[0]
    else:
        dearer = [one for one in told if one.versus_best is not None and one.versus_best.effect > 0.0]
        assert sure.figure == f"{len(dearer)} of {k - 1} are more expensive beyond chance"
        assert not any("it takes" in text for text in texts)
    # nor does the picture of ranks say anything else
    joined = [set(group) for group in ranks.groups if found[0].solver in group]
    level = [{found[0].solver, one.solver} for one in found[1:] if one not in told]
    alone = [set(pair) for pair in ranks.apart_in_rank]
    assert n < 2 or all(any(pair <= group for group in [*joined, *alone]) for pair in level)
    assert not any({found[0].solver, one.solver} <= group for one in told for group in [*joined, *alone])


def test_a_scenario_that_not_all_have_run_is_told() -> None:
    stored = study_of({"a": [1.0, 2.0, 3.0], "b": [2.0, 3.0]})
    said = overview(leaderboard_of(stored.runs), 3)
    assert "1 scenario not run by all solvers yet" in said.caution
    only = study_of({"a": [1.0], "b": []})
    assert "only solver" in overview(leaderboard_of(only.runs), 1).headline


def test_nobody_finds_a_path() -> None:
    stored = study_of({"a": [math.inf] * 7, "b": [math.inf] * 7})
    html = report_html(stored)
    assert "14 of 14 runs have no path" in html
    data = Page(html).data
    assert all(cell["path"] == [] and cell["curve"] is None for s in data["scenarios"] for cell in s["cells"])


def test_a_tie_of_failures_and_paths_has_no_nan_in_words() -> None:
    stored = study_of({"a": [1.0] * 7, "b": [math.inf] * 7, "c": [1.0] * 3 + [math.inf] * 4})
    text = "".join(Page(report_html(stored)).text)
    assert "nan" not in text.lower().split()
    assert "∞" in text


def test_the_ranking_table_never_leaves_failures_out() -> None:
    stored = study_of({"a": [1.0] * 7, "b": [0.5] * 3 + [math.inf] * 4})
    table = ranking_table(leaderboard_of(stored.runs), ranking(instance_costs(stored.runs)))
    b = next(row for row in table["rows"] if row["solver"] == "b")
    cells = dict(zip((column.head for column in table["columns"]), b["cells"], strict=True))
    assert cells["gap"].value == "never"
    assert cells["success"].value == "3/7"
    assert cells["failed"].value == "4"
    assert b["failures"] == "4 timed-out"


def test_failures_are_grouped_by_reason() -> None:
    run = study_of({"a": [1.0]}).runs[0]
    runs = [failing(run, Status.TIMED_OUT, f"stopped after {i}.5 s") for i in range(3)]
    runs += [failing(run, Status.CRASHED, "signal 11"), run]
    found = failures(runs)
    assert [(group["count"], group["status"]) for group in found["groups"]] == [("3", "timed-out"), ("1", "crashed")]
    assert found["headline"] == "4 of 5 runs found no path that may be flown."


def test_the_grid_shows_the_share_of_failures() -> None:
    stored = study_of({"a": [1.0, 1.0, 1.0], "b": [1.0, math.inf, 1.0]})
    grid = failure_grid(leaderboard_of(stored.runs), stored.runs)
    assert grid is not None
    assert [column["name"] for column in grid["columns"]] == ["map-1"]
    assert [(row["name"], [cell["share"] for cell in row["cells"]]) for row in grid["rows"]] == [("b", [1.0])]
    assert failure_grid(leaderboard_of(stored.runs[:2]), stored.runs[:2]) is None


@given(st.integers(2, 12), st.integers(1, 9), st.randoms(use_true_random=False))
def test_the_picture_of_ranks_is_in_its_frame(k: int, n: int, random: Any) -> None:  # noqa: ANN401 - random.Random
    ranks = ranking({f"solver-{i}": [random.random() for _ in range(n)] for i in range(k)})
    picture = rank_picture(ranks)
    assert picture is not None
    assert [label["solver"] for label in picture["labels"]] == list(ranks.solvers)
    assert len({(label["text_x"], label["text_y"]) for label in picture["labels"]}) == k
    assert len(picture["groups"]) == len(ranks.groups)
    for one, other in itertools.combinations(picture["groups"], 2):
        assert one["y"] != other["y"] or one["x2"] < other["x1"] + 8 or other["x2"] < one["x1"] + 8
    for label, rank in zip(picture["labels"], ranks.average_ranks, strict=True):
        left, right = picture["axis"]["x1"], picture["axis"]["x2"]
        assert label["x"] == pytest.approx(left + (rank - 1) / (k - 1) * (right - left), abs=0.1)
        assert 0 <= label["text_y"] <= picture["height"]
    for solver in ranks.solvers:
        assert solver in picture["description"]


def test_the_report_grows_slower_than_its_runs() -> None:
    small, large = (len(report_html(large_study(4, 4, seeds, 60))) for seeds in (6, 12))
    # curves and maps do not grow with the seeds; a row of the table takes less than 150 bytes
    assert large - small < 4 * 4 * 6 * 150
