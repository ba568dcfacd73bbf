"""Areas that end on the border of a map in degrees close it."""

import math
from pathlib import Path

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph._types import Bounds
from cgla_graph.comparisons.live.draft import LiveMap
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Status

BOXES = [(22.0, 60.0, 26.0, 62.0), (24.0, 60.0, 24.01, 60.01), (178.0, -20.0, 182.0, -16.0), (-10.0, 70.0, 30.0, 80.0)]


def _part(box: Bounds, x: float, y: float) -> tuple[float, float]:
    return box[0] + x * (box[2] - box[0]), box[1] + y * (box[3] - box[1])


@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("upright", [True, False])
def test_a_wall_to_the_border_in_degrees_closes_the_map(box: Bounds, upright: bool) -> None:
    ends = [(0.1, 0.5), (0.9, 0.5)] if upright else [(0.5, 0.1), (0.5, 0.9)]
    start, goal = (_part(box, *end) for end in ends)
    start, goal = (((x + 180.0) % 360.0 - 180.0, y) for x, y in (start, goal))
    corners = [(0.45, 0.0), (0.55, 1.0)] if upright else [(0.0, 0.45), (1.0, 0.55)]
    wall = shapely.box(*_part(box, *corners[0]), *_part(box, *corners[1]))
    for turn in (0.0, -360.0)[: 1 + (box[2] > 180.0)]:
        moved = shapely.transform(wall, lambda points, turn=turn: np.add(points, (turn, 0.0)))
        problem = Problem.in_degrees(start, goal, bounds=box, no_fly=moved)
        assert cg.solve(problem, "cgla", resolution=11).status is Status.NO_PATH
        assert not cg.solve(problem, "visibility-graph").status.has_path
    assert cg.lower_bound(problem).lower_bound == math.inf
    apart = shapely.box(*_part(box, 0.45, 0.2), *_part(box, 0.55, 0.8))
    free = Problem.in_degrees(start, goal, bounds=box, no_fly=apart)
    assert cg.solve(free, "visibility-graph").status.has_path


def test_a_scenario_in_degrees_is_closed_as_the_problem_is(tmp_path: Path) -> None:
    box = BOXES[0]
    ring = [[23.8, 60.0], [24.2, 60.0], [24.2, 62.0], [23.8, 62.0]]
    text = f"""
coordinates = "lonlat"
k = 0.0
start = [22.4, 61.0]
goal = [25.6, 61.0]
bounds = {list(box)}
[no_fly]
polygons = [{ring}]
"""
    (tmp_path / "wall.toml").write_text(text)
    problem = cg.load_scenario(tmp_path / "wall.toml").problem
    assert cg.solve(problem, "visibility-graph").status is Status.NO_PATH
    assert np.isinf(cg.lower_bound(problem).lower_bound)
    live = LiveMap.open(str(tmp_path / "wall.toml"))
    assert max(y for _, y in live.first.areas[0]) < problem.bounds[3]
    assert cg.solve(live.drawn(live.first).problem, "visibility-graph").status is Status.NO_PATH
