"""Many questions to one map: counts, bounds that hold, and what is said of starts without an answer."""

import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from random_problems import RING, places, random_map
from strategies import a_part_of

import cgla_graph as cg
from cgla_graph import _threads
from cgla_graph._types import FloatArray
from cgla_graph.certificate import many
from cgla_graph.certificate.landmarks import Ground, Landmarks
from cgla_graph.errors import ProblemError
from cgla_graph.regions import bound as over_cells
from cgla_graph.solvers import grouped_questions

#: How many random maps.
NUMBER = int(os.environ.get("CGLA_MAPS", "3"))
BOX = shapely.box(0.4, 0.0, 0.45, 0.7)
PAPER = cg.load_scenario("paper").problem


def faults(problem: cg.Problem, answers: Any, proven: int) -> list[str]:  # noqa: ANN401 - cg.Answers is no public name
    """Name what is wrong with answers: against refined paths, and against the first single proofs."""
    found = []
    for number, (start, goal, one) in enumerate(zip(answers.starts, answers.goals, answers, strict=True)):
        asked = replace(problem, start=tuple(start.tolist()), goal=tuple(goal.tolist()))
        name = f"{number}: {start} to {goal}: {one.message}"
        if one.status.has_path:
            judged = asked.evaluate(one.path)
            if not judged.feasible or abs(judged.cost - one.cost) > 1e-12 * one.cost:
                found.append(f"{name}: {judged.violations}, {judged.cost}, {one.cost}")
            if (one.path[0] != start).any() or (one.path[-1] != goal).any():
                found.append(f"{name}: ends at other places")
            better = cg.solve(asked, "cgla", resolution=15, refine=True)
            if min(better.cost, one.cost) < one.lower_bound * (1.0 - 1e-12):
                found.append(f"{name}: a path costs {better.cost}, below {one.lower_bound}")
        if number < proven:
            single = cg.solve(asked, tolerance=0.1)
            if single.status.has_path != one.status.has_path:
                found.append(f"{name}: {one.status}, but {single.status}")
            elif one.status.has_path and not (
                one.lower_bound <= single.cost * (1.0 + 1e-12) and single.lower_bound <= one.cost * (1.0 + 1e-12)
            ):
                found.append(f"{name}: [{one.lower_bound}, {one.cost}], [{single.lower_bound}, {single.cost}]")
    return found


# (map 0 takes as long as seven others)
@pytest.mark.parametrize("number", [pytest.param(0, marks=pytest.mark.slow), *range(1, NUMBER)])
def test_no_path_costs_less_than_a_bound(number: int) -> None:
    random = np.random.default_rng([1, number])
    problem = random_map(random)
    base = cg.Map(problem)
    assert faults(problem, base.solve(starts=places(problem, 12, random), tolerance=0.1), 1) == []
    # (as many as share landmarks and grids)
    pairs = places(problem, 8, random), places(problem, 8, random)
    assert faults(problem, base.solve(*pairs, tolerance=0.1), 0) == []


# (map 38, a rough raster with threats, takes as long as all others)
@pytest.mark.slow
@pytest.mark.parametrize("number", a_part_of([number for number in range(51) if number != 38]))
def test_no_path_costs_less_than_a_bound_of_1000_questions(number: int) -> None:
    random = np.random.default_rng([2, number])
    problem = random_map(random)
    assert faults(problem, cg.Map(problem).solve(starts=places(problem, 20, random), tolerance=0.1), 1) == []


@pytest.mark.parametrize("kind", ["threats", "areas", "raster"])
def test_one_goal_takes_three_solves_at_most(kind: str, monkeypatch: pytest.MonkeyPatch) -> None:
    problem = PAPER
    if kind == "areas":
        problem = replace(PAPER, no_fly=shapely.union_all([BOX, shapely.Point(0.7, 0.6).buffer(0.1)]))
    if kind == "raster":
        values = np.random.default_rng(1).random((12, 12))
        field = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")])
        problem = replace(PAPER, field=field)
    counts = [0, 0]
    solved, searched = many.costs_to_go, over_cells.values_to

    def count_solved(*arguments: Any, **more: Any) -> FloatArray:  # noqa: ANN401 - as it takes them
        counts[0] += 1
        return solved(*arguments, **more)

    def count_searched(*arguments: Any) -> FloatArray:  # noqa: ANN401 - as it takes them
        counts[1] += 1
        return searched(*arguments)

    monkeypatch.setattr(many, "costs_to_go", count_solved)
    monkeypatch.setattr(over_cells, "values_to", count_searched)
    answers = cg.Map(problem).solve(starts=places(problem, 60, np.random.default_rng(2)))
    assert (answers.gaps <= 0.01).all()
    # (own proofs search over cells too)
    assert counts[0] == (0 if kind == "raster" else answers.most_solves)
    assert counts[1] >= (answers.most_solves if kind == "raster" else 0)
    assert 1 <= answers.most_solves <= 3
    assert answers.n_own <= 3


@pytest.mark.parametrize("charged", [True, False])
def test_bounds_subtract_the_charges_of_steep_cells(charged: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    # (the broken twin shows that nothing else keeps these bounds below the paths)
    if not charged:
        monkeypatch.setattr(many.GoalSurface, "_charged", without_charges(many.GoalSurface._charged))
    problem = replace(PAPER, k=1000.0)
    starts = places(problem, 6, np.random.default_rng(5))
    answers = cg.Map(problem).solve(starts=starts, tolerance=0.05)
    singles = [replace(problem, start=tuple(start)) for start in starts.tolist()]
    best = [cg.solve(one, tolerance=None).cost for one in singles]
    assert (answers.n_own == 0, bool((answers.lower_bounds <= best).all())) == (True, charged)


def without_charges(find: Any) -> Any:  # noqa: ANN401 - a method
    """Leave the charges out of a surface."""
    return lambda *arguments: replace(find(*arguments), charges=np.zeros(len(find(*arguments).charges)))


@pytest.mark.parametrize("every", [1, 8])
def test_questions_that_are_left_share_a_tube(every: int, monkeypatch: pytest.MonkeyPatch) -> None:
    # (the broken twin has a tube around the paths of a few)
    within = Ground.within

    def narrow(ground: Ground, starts: FloatArray, goal: Any, costs: FloatArray, cells: int) -> Ground:  # noqa: ANN401
        tubes.append(cells)
        return within(ground, starts[::every], goal, costs[::every], cells)

    tubes: list[int] = []
    monkeypatch.setattr(Ground, "within", narrow)
    monkeypatch.setattr(grouped_questions, "STEPS", {4: 96})
    monkeypatch.setattr(grouped_questions, "JOINT", (40_000, 160_000))
    problem = replace(PAPER, no_fly=shapely.union_all([BOX, shapely.Point(0.7, 0.6).buffer(0.1)]))
    starts = places(problem, 40, np.random.default_rng(6))
    answers = cg.Map(problem).solve(starts=starts)
    singles = [replace(problem, start=tuple(start)) for start in starts.tolist()]
    best = [cg.solve(one, tolerance=None).cost for one in singles]
    assert tubes[0] == 40_000
    assert answers.most_solves == 3
    assert bool((answers.lower_bounds <= np.array(best) * (1.0 + 1e-12)).all()) == (every == 1)
    if every == 1:
        assert (answers.gaps <= 0.01).all()
        assert answers.n_own < 16


def test_both_directions_have_the_same_answers() -> None:
    points = places(PAPER, 30, np.random.default_rng(3))
    there, back = cg.Map(PAPER).solve(starts=points), cg.Map(PAPER).solve(starts=PAPER.goal, goals=points)
    assert there.costs.tolist() == pytest.approx(back.costs.tolist(), rel=1e-12)
    assert [one.path[0].tolist() for one in back] == [list(PAPER.goal)] * 30
    assert there.lower_bounds.tolist() == back.lower_bounds.tolist()


def test_starts_without_a_way_are_proven_closed() -> None:
    problem = replace(PAPER, start=(0.1, 0.1), goal=(0.2, 0.2), no_fly=RING)
    answers = cg.Map(problem).solve(starts=[(0.8, 0.8), (0.1, 0.1), (0.75, 0.85)])
    assert [one.status.label for one in answers] == ["no-path", "found", "no-path"]
    assert answers.lower_bounds[[0, 2]].tolist() == [math.inf, math.inf]
    assert answers.missed == (0, 2)
    assert "2 without a path" in answers.message
    # a wall too thin for the cells of a grid
    thin = shapely.box(0.0, 0.5, 1.0, 0.5 + 1e-7)
    answers = cg.Map(replace(problem, no_fly=thin)).solve(starts=[(0.8, 0.8), (0.1, 0.1)])
    assert [one.status.label for one in answers] == ["no-path", "found"]


def test_pairs_over_cells_of_constant_cost_are_proven_one_by_one(monkeypatch: pytest.MonkeyPatch) -> None:
    # (a surface for each goal, over the whole map, takes longer; landmarks are of no use)
    monkeypatch.setattr(Landmarks, "lay", None)
    values = np.random.default_rng(3).random((12, 12)) * 20.0
    field = cg.RiskField(rasters=[cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest")])
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field, k=5.0)
    starts, goals = (places(problem, 8, np.random.default_rng([11, end])) for end in range(2))
    answers = cg.Map(problem).solve(starts, goals)
    assert (answers.n_own, answers.n_solves, bool((answers.gaps <= 0.01).all())) == (8, 0, True)
    assert faults(problem, answers, 2) == []


def test_answers_do_not_depend_on_the_number_of_threads(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = replace(PAPER, no_fly=BOX)
    starts, goals = (places(problem, 9, np.random.default_rng([12, end])) for end in range(2))
    found = []
    for count in 1, 3:
        monkeypatch.setattr(_threads, "n_cores", lambda count=count: count)
        answers = cg.Map(problem).solve(starts, goals)
        found.append([(one.path.tolist(), one.lower_bound, one.message) for one in answers])
    assert found[0] == found[1]
    assert answers.n_own == 9


def test_an_error_in_one_thread_is_that_of_the_call(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object, **__: object) -> None:
        raise MemoryError

    monkeypatch.setattr(Ground, "proof", fail)
    with pytest.raises(MemoryError):
        cg.Map(PAPER).solve(starts=[(0.2, 0.3), (0.4, 0.1)])


def test_questions_that_are_the_same_or_trivial() -> None:
    base = cg.Map(PAPER)
    twice = base.solve(starts=[(0.2, 0.3), (0.2, 0.3), PAPER.goal], names=["a", "b", "c"])
    assert twice.costs[0] == twice.costs[1] > twice.costs[2] == 0.0
    assert twice.gaps[2] == 0.0
    assert [row["name"] for row in twice.rows()] == ["a", "b", "c"]
    beside = base.solve(starts=[(0.9, 0.9001)])
    assert beside.n_own == 1
    assert beside.gaps[0] <= 0.01
    none = base.solve(starts=[])
    assert (len(none), none.rows(), none.n_solves) == (0, [], 0)
    alone = base.solve()
    assert alone.gaps[0] <= 0.01


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"starts": [(0.1, 0.1), (0.42, 0.5)]}, "start 2 of 2: start .* no-fly"),
        ({"goals": [(0.1, 0.1), (0.2, 0.2), (0.42, 0.5)]}, "goal 3 of 3: goal .* no-fly"),
        ({"starts": [(0.1, 0.1), (0.46, 0.5)]}, "start 2 of 2: start .* the clearance is 0.02"),
        ({"goals": [(0.1, 0.1), (0.46, 0.5)]}, "goal 2 of 2: goal .* the clearance is 0.02"),
        ({"starts": [(0.1, 1.1)]}, "start 1 of 1: .* outside the bounds"),
        ({"starts": [(0.1, 0.1)] * 2, "goals": [(0.2, 0.2)] * 3}, "2 starts and 3 goals; give"),
        ({"starts": [(0.1, 0.1)] * 2, "names": ["a"]}, "1 names and 2 questions; give"),
        ({"starts": np.zeros((2, 2, 2))}, "shape .* give points"),
        ({"tolerance": 0.0}, "tolerance"),
    ],
)
def test_a_wrong_question_is_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        cg.Map(replace(PAPER, no_fly=BOX, clearance=0.02)).solve(**arguments)


def test_answers_on_the_earth(tmp_path: Path) -> None:
    field = cg.RiskField([cg.Threat(0.0, 0.0, spread=500.0)])
    problem = cg.Problem.in_degrees(start=(24.9, 60.1), goal=(25.1, 60.2), bounds=(24.8, 60.0, 25.2, 60.3), k=20.0)
    problem = replace(problem, field=field)
    lonlat = np.array([(24.95, 60.12), (25.05, 60.18)])
    answers = cg.Map(problem).solve(starts=problem.projection.forward(lonlat))
    assert faults(problem, answers, 2) == []
    assert (answers.gaps <= 0.01).all()
    assert [row["start_longitude"] for row in answers.rows()] == pytest.approx([24.95, 25.05])
    assert answers.to_geojson(tmp_path / "paths.geojson").read_text().count("LineString") == 2
    assert len(answers.to_csv(tmp_path / "paths.csv").read_text().splitlines()) == 3


def test_with_clearance_and_with_peaks_above_1() -> None:
    problem = replace(PAPER, no_fly=BOX, clearance=0.03)
    points = places(problem, 8, np.random.default_rng(4))
    answers = cg.Map(problem).solve(starts=points)
    assert faults(problem, answers, 2) == []
    assert min(one.clearance for one in answers) >= 0.03 - 1e-9
    with pytest.warns(UserWarning, match="peak"):
        improper = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=3.0)], improper=True)
    known = cg.Map(replace(PAPER, field=improper)).solve(starts=points[:2])
    assert np.isnan(known.lower_bounds).all()
    assert known.n_own == 2
