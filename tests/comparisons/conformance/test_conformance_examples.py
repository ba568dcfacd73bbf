"""What the manual says of problems is what the oracle does: a reader of ours that knows nothing of it agrees."""

import json
import runpy
from pathlib import Path

import numpy as np
import pytest

from cgla_graph.comparisons.conformance.suite import Instance, suite

ASTAR = runpy.run_path(str(Path(__file__).resolve().parents[3] / "examples" / "conformance" / "astar.py"))


def read(one: Instance) -> object:
    return ASTAR["Map"](json.loads(one.problem.model_dump_json()))


@pytest.mark.parametrize("one", suite(), ids=lambda one: one.name)
def test_the_example_and_the_oracle_mean_the_same_risk_and_the_same_areas(one: Instance) -> None:
    problem, where = one.problem.build(), read(one)
    low, high = np.reshape(problem.bounds, (2, 2))
    draw = np.random.default_rng(7)
    points = low + (high - low) * draw.random((60, 2))
    # nodes of rasters and of mazes are no such points
    assert [where.risk(x, y) for x, y in points.tolist()] == pytest.approx(problem.field.density(points), abs=1e-12)  # type: ignore[attr-defined]
    ends = np.clip(points + 0.1 * (high - low) * draw.normal(size=(60, 2)), low, high)
    crosses = [where.crosses(*a, *b) for a, b in zip(points.tolist(), ends.tolist(), strict=True)]  # type: ignore[attr-defined]
    assert crosses == problem.model.area.crosses(points, ends).tolist()


def test_the_example_finds_its_way_at_little_more_than_the_best_cost() -> None:
    """Where nothing is in the way, and where a wall is."""
    for name, most in (("open-straight", 1.0), ("walls-corner", 1.08)):
        (one,) = (one for one in suite() if one.name == name)
        path = ASTAR["plan"](json.loads(one.problem.model_dump_json()))
        found = one.problem.build().evaluate(path)
        assert found.feasible
        assert found.cost <= most * (one.upper_bound or 0.0) * (1.0 + 1e-12)
