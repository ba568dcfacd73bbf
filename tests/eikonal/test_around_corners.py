"""Paths that cut corners are led around them, in bounded time however many corners there are."""

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.eikonal import marching
from cgla_graph.eikonal.marching import around_corners
from cgla_graph.model.cost_model import CostModel


def ragged(n_corners: int) -> shapely.Polygon:
    """Return a disc with teeth."""
    angles = np.linspace(0.0, 2.0 * np.pi, n_corners, endpoint=False)
    radii = 0.25 + 0.002 * np.random.default_rng(1).random(n_corners)
    return shapely.Polygon(np.column_stack([0.5 + radii * np.cos(angles), 0.5 + radii * np.sin(angles)]))


def test_of_many_corners_those_that_stand_out_lead_around(monkeypatch: pytest.MonkeyPatch) -> None:
    """As short as around all of them: what is between teeth does not matter."""
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=ragged(1500))
    turns = np.linspace(np.pi, 0.0, 60)
    # through the tips of the teeth
    arc = np.column_stack([0.5 + 0.2515 * np.cos(turns), 0.5 + 0.2515 * np.sin(turns)])
    path = np.vstack([problem.start, arc, problem.goal])
    monkeypatch.setattr(marching, "MOST_CORNERS", 5000)
    of_all = problem.evaluate(around_corners(problem, path, 0.02))
    monkeypatch.setattr(marching, "MOST_CORNERS", 200)
    weighed, matrix = [], CostModel.matrix

    def counted(model: CostModel, points: FloatArray) -> FloatArray:
        weighed.append(len(points))
        return matrix(model, points)

    monkeypatch.setattr(CostModel, "matrix", counted)
    few = problem.evaluate(around_corners(problem, path, 0.02))
    assert of_all.feasible
    assert few.feasible
    assert few.length == pytest.approx(of_all.length, rel=1e-4)
    assert max(weighed) <= 200 + 62


def test_of_many_small_areas_the_nearest_lead_around(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(marching, "MOST_CORNERS", 50)
    places = np.linspace(0.2, 0.8, 60)
    posts = shapely.union_all([shapely.box(x, 0.49, x + 0.002, 0.51) for x in places.tolist()])
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), no_fly=posts)
    path = np.column_stack([np.linspace(0.1, 0.9, 100), np.full(100, 0.5)])
    chosen = marching._outstanding(shapely.get_coordinates(posts), path, 0.05, posts)
    assert len(chosen) == 50
    found = around_corners(problem, path, 0.05)
    assert not len(found) or problem.evaluate(found).feasible
