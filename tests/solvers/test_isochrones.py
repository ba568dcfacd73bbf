"""Isochrones: no path is cheaper than the outer areas say, and one is as cheap as the inner areas say."""

import json
import math
import os
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from matplotlib.figure import Figure
from random_problems import Rng, places, random_map
from strategies import a_part_of

import cgla_graph as cg
from cgla_graph.errors import OutputError, ProblemError

#: How many random maps.
NUMBER = int(os.environ.get("CGLA_MAPS", "3"))
PAPER = cg.load_scenario("paper").problem


def faults(problem: cg.Problem, found: Any, random: Rng, count: int) -> list[str]:  # noqa: ANN401 - cg.Isochrones is no public name
    """Name what is wrong with areas, against paths and bounds: at random places, and along the rims of the areas."""
    wrong = []
    for cost, inner, outer in zip(found.costs, found.certain, found.possible, strict=True):
        # (nothing is within anything else)
        if not (inner.is_empty or inner.within(outer)):
            wrong.append(f"{cost}: the certain area is not inside the possible one")
        rims = [shape.boundary for shape in (inner, outer) if not shape.is_empty]
        along = shapely.line_interpolate_point(shapely.union_all(rims), random.random(count), normalized=True)
        points = np.vstack([places(problem, count, random), shapely.get_coordinates(along)])
        points = np.clip(points, *np.reshape(problem.bounds, (2, 2)))
        points = points[~problem.area.contains(points)]
        answers = cg.Map(problem).solve(starts=points, goals=found.goal, tolerance=0.2)
        for place, answer in zip(points, answers, strict=True):
            if shapely.intersects_xy(inner, *place) and not answer.lower_bound <= cost:
                wrong.append(f"{cost}: {place} is certain, but no path costs less than {answer.lower_bound}")
            if shapely.intersects_xy(outer, *place):
                continue
            asked = replace(problem, start=tuple(place.tolist()), goal=found.goal)
            better = min(answer.cost, cg.solve(asked, "cgla", resolution=12, refine=True).cost)
            if better < cost * (1.0 - 1e-9):
                wrong.append(f"{cost}: {place} is impossible, but a path costs {better}")
    return wrong


# (some have faults with a third of the greatest cost of each cell, and with bounds that are a tenth higher)
@pytest.mark.parametrize(
    "number", [2, *(pytest.param(number, marks=pytest.mark.slow) for number in range(NUMBER) if number != 2)]
)
def test_areas_hold_on_random_maps(number: int) -> None:
    random = np.random.default_rng([5, number])
    problem = random_map(random)
    far = cg.solve(problem, "hybrid").cost
    far = far if math.isfinite(far) else 1.0
    found = cg.Map(problem).isochrones([0.3 * far, 0.8 * far], steps=48)
    assert faults(problem, found, random, 3) == []


@pytest.mark.slow
@pytest.mark.parametrize("number", a_part_of(range(100, 140)))
def test_areas_hold_on_more_random_maps(number: int) -> None:
    random = np.random.default_rng([5, number])
    problem = random_map(random)
    far = cg.solve(problem, "hybrid").cost
    far = far if math.isfinite(far) else 1.0
    found = cg.Map(problem).isochrones([0.3 * far, 0.8 * far], steps=[32, 64, 128][number % 3])
    assert faults(problem, found, random, 10) == []


def test_discs_without_risk_and_areas_that_are_close() -> None:
    found = cg.Map(cg.Problem((0.5, 0.5), (0.5, 0.5), bounds=(0, 0, 1, 1))).isochrones([0.4, 0.2], steps=128)
    assert found.costs == (0.2, 0.4)
    for cost, inner, outer in zip(found.costs, found.certain, found.possible, strict=True):
        disc = shapely.Point(0.5, 0.5).buffer(cost, quad_segs=64)
        assert disc.buffer(-0.02).within(inner)
        assert outer.within(disc.buffer(0.02))
    paper = cg.Map(PAPER).isochrones([0.8], (0.2, 0.3), steps=128)
    (row,) = paper.rows()
    assert 0.9 < row["certain_area"] / row["possible_area"] < 1.0


def test_nothing_is_reached_behind_a_closed_wall() -> None:
    wall = shapely.box(0.0, 0.5, 1.0, 0.6)
    problem = cg.Problem((0.5, 0.2), (0.5, 0.2), no_fly=wall, bounds=(0, 0, 1, 1))
    found = cg.Map(problem).isochrones(3.0, steps=64)
    assert found.possible[0].area == pytest.approx(0.5, rel=1e-6)
    assert found.certain[0].area == pytest.approx(0.5, rel=0.05)


def test_on_the_earth_with_files_and_a_picture(tmp_path: Path) -> None:
    problem = cg.Problem.in_degrees(start=(24.9, 60.1), goal=(25.1, 60.2), bounds=(24.8, 60.0, 25.2, 60.3), k=20.0)
    found = cg.Map(problem).isochrones([5000.0, 9000.0], steps=64)
    document = json.loads(found.to_geojson(tmp_path / "near.geojson").read_text(encoding="utf-8"))
    kinds = [(one["properties"]["kind"], one["properties"]["cost"]) for one in document["features"]]
    assert kinds == [("possible", 9000.0), ("certain", 9000.0), ("possible", 5000.0), ("certain", 5000.0)]
    assert shapely.geometry.shape(document["features"][3]["geometry"]).covers(shapely.Point(25.1, 60.2))
    with pytest.raises(OutputError, match=r"\.geojson"):
        found.to_geojson(tmp_path / "near.kml")
    legend = cg.plot(found, Figure().add_subplot()).get_legend()
    assert [text.get_text() for text in legend.get_texts()][:2] == ["certainly within 9 km", "possibly within 9 km"]


def test_answers_have_a_picture() -> None:
    ring = shapely.box(0.6, 0.6, 0.95, 0.95).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
    problem = cg.Problem((0.1, 0.1), (0.2, 0.2), no_fly=ring, bounds=(0, 0, 1, 1))
    answers = cg.Map(problem).solve(starts=[(0.8, 0.8), (0.1, 0.1)])
    legend = answers.plot(ax=Figure().add_subplot()).get_legend()
    said = [text.get_text() for text in legend.get_texts()]
    assert said == ["1 path", "start", "goal", "proven: there is no path", "no-fly area"]


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"costs": [1.0, -1.0]}, "costs is -1; it must be above 0"),
        ({"costs": []}, "costs are empty; give one"),
        ({"costs": math.inf}, "costs .* finite"),
        ({"costs": 1.0, "goal": (0.1, 1.1)}, "goal 1 of 1: .* outside the bounds"),
        ({"costs": 1.0, "goal": [(0.1, 0.1), (0.2, 0.2)]}, "give one point"),
        ({"costs": 1.0, "steps": 8}, "steps is 8; give a whole number from 16"),
    ],
)
def test_a_wrong_question_is_named(arguments: dict[str, Any], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        cg.Map(PAPER).isochrones(**arguments)
