"""A safety margin: solvers keep it, the oracle measures it, and bounds hold for whoever keeps it."""

import dataclasses
import math

import numpy as np
import pytest
import shapely

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.model.clearance import widened

BOX = shapely.box(0.4, 0.2, 0.6, 0.7)
TRIANGLE = shapely.Polygon([(0.4, 0.85), (0.7, 0.95), (0.5, 1.0)])
AREA = shapely.MultiPolygon([BOX, TRIANGLE])
FIELD = cg.RiskField([cg.Threat(0.45, 0.1, 0.1, 0.9)])


def problem(clearance: float, no_fly: shapely.Geometry = AREA) -> cg.Problem:
    return cg.Problem((0.1, 0.4), (0.9, 0.4), FIELD, k=3.0, no_fly=no_fly, clearance=clearance)


def arc(clearance: float) -> np.ndarray:
    """Go around the upper side of the box as closely as the clearance allows, on waypoints of true arcs."""
    angles = np.linspace(math.pi, 0.5 * math.pi, 400)
    left = np.array([0.4, 0.7]) + clearance / math.cos(angles[0] - angles[1]) * np.stack(
        [np.cos(angles), np.sin(angles)], axis=1
    )
    ends = np.array([[0.1, 0.4]]), np.array([[0.9, 0.4]])
    return np.concatenate([ends[0], left, (left * [-1, 1] + [1.0, 0.0])[::-1], ends[1]])


@pytest.mark.parametrize("solver", ["hybrid", "cgla", "visibility-graph", "prm-star", "fast-marching"])
def test_solvers_keep_it(solver: str) -> None:
    given = problem(0.05)
    found = cg.solve(given, solver)
    assert found.status.has_path
    assert 0.05 * (1.0 - 1e-9) <= found.clearance < 0.1
    assert found.clearance == pytest.approx(shapely.distance(shapely.LineString(found.path), AREA), rel=1e-12)


def test_more_of_it_never_costs_less() -> None:
    bare = cg.Problem((0.1, 0.4), (0.9, 0.4), no_fly=AREA)
    margins = (0.0, 0.02, 0.05, 0.1)
    costs = [cg.solve(dataclasses.replace(bare, clearance=margin), "visibility-graph").cost for margin in margins]
    assert costs == sorted(costs)
    assert costs[0] < costs[-1]


def test_the_oracle_measures_it() -> None:
    found = problem(0.05, BOX).evaluate(arc(0.05))
    assert found.feasible
    assert found.clearance == pytest.approx(0.05, rel=1e-5)
    closer = problem(0.0501, BOX).evaluate(arc(0.05))
    assert closer.violations == ("it comes within 0.0500003 of the no-fly area, and the clearance is 0.0501",)
    through = problem(0.05).evaluate([(0.1, 0.4), (0.9, 0.4)])
    assert (through.clearance, through.violations) == (0.0, ("segment 0 crosses the no-fly area",))


def test_a_bound_holds_for_paths_on_true_arcs() -> None:
    """They pass between the arc and the polygon around it, where no solver plans."""
    given = problem(0.05, BOX)
    path = arc(0.05)
    assert given.model.area.crosses(path[:-1], path[1:]).any()
    proof = cg.lower_bound(given, 0.02, path=path)
    assert proof.lower_bound <= proof.upper_bound == given.evaluate(path).cost


def test_a_gap_is_closed_by_it() -> None:
    wall = shapely.MultiPolygon([shapely.box(0.45, 0.0, 0.55, 0.48), shapely.box(0.45, 0.52, 0.55, 1.0)])
    assert cg.solve(problem(0.019, wall)).status.has_path
    shut = cg.solve(problem(0.021, wall))
    assert not shut.status.has_path
    assert cg.lower_bound(problem(0.021, wall)).lower_bound == math.inf


@pytest.mark.parametrize("margin", [1e-3, 0.05, 0.3])
def test_the_polygons_are_around_the_arcs_and_inside(margin: float) -> None:
    around, inside = widened(AREA, margin), widened(AREA, margin, inside=True)
    assert shapely.distance(around.boundary, AREA) >= margin * (1.0 - 1e-12)
    corners = shapely.points(shapely.get_coordinates(inside))
    assert shapely.distance(corners, AREA).max() <= margin * (1.0 + 1e-12)
    assert around.difference(inside).area < 0.003 * around.area


@pytest.mark.parametrize(
    ("changes", "wrong"),
    [
        ({"clearance": -1.0}, "clearance"),
        ({"clearance": math.nan}, "clearance"),
        ({"clearance": 0.31}, r"start \(0.1, 0.4\) is 0.3 from the no-fly area, and the clearance is 0.31"),
        ({"start": (0.5, 0.5)}, "inside the no-fly area"),
    ],
)
def test_faults(changes: dict[str, object], wrong: str) -> None:
    with pytest.raises(ProblemError, match=wrong):
        cg.Problem(**{"start": (0.1, 0.4), "goal": (0.9, 0.4), "no_fly": AREA, "clearance": 0.05, **changes})
