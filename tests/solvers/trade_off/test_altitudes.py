"""The best of several altitudes, and the bound over all of them."""

import itertools
import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples, seeds

import cgla_graph as cg
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.problem import Problem


@examples(3)
@given(seeds, st.integers(1, 4))
def test_the_best_is_the_cheapest_and_the_bound_that_of_every_altitude(seed: int, number: int) -> None:
    random = np.random.default_rng(seed)
    altitudes = np.unique(random.uniform(0.0, 100.0, number)).tolist()
    ceilings = random.uniform(0.0, 100.0, 5)
    blocks = [shapely.box(x, y, x + 0.25, y + 0.3) for x, y in random.uniform(0.1, 0.6, (5, 2))]

    def open_at(metres: float) -> Problem:
        closed = [block for block, ceiling in zip(blocks, ceilings, strict=True) if metres <= ceiling]
        return Problem((0.0, 0.0), (1.0, 1.0), no_fly=shapely.GeometryCollection(closed))

    found = cg.best_altitude(open_at, altitudes, tolerance=0.2)

    alone = [cg.solve(open_at(metres), "hybrid", tolerance=0.2) for metres in altitudes]
    assert [one.solution.cost for one in found.paths] == [one.cost for one in alone]
    assert found.best is not None
    assert found.best.solution.cost == min(one.cost for one in alone)
    assert found.lower_bound == min(one.solution.lower_bound for one in found.paths) <= found.best.solution.cost
    assert found.gap == pytest.approx(found.best.solution.cost / found.lower_bound - 1.0)
    # fewer blocks are closed higher up
    costs = [one.solution.cost for one in found.paths]
    assert all(later <= before * 1.2 for before, later in itertools.pairwise(costs))


def blocked(metres: float) -> Problem:
    """Return a map on which start is closed below 50 m, and the way is below 80 m."""
    if metres < 50.0:
        msg = "start is closed"
        raise ScenarioError(msg)
    wall = shapely.box(0.4, 0.0, 0.6, 1.0) if metres < 80.0 else None
    return Problem((0.0, 0.0), (1.0, 1.0), no_fly=wall)


def test_altitudes_without_a_path_are_told() -> None:
    found = cg.best_altitude(blocked, [20, 60, 90, 90, 100])

    assert [one.altitude for one in found.paths] == [20.0, 60.0, 90.0, 100.0]
    assert [one.solution.status.has_path for one in found.paths] == [False, False, True, True]
    assert found.paths[0].solution.message == "start is closed"
    assert [math.isinf(one.solution.lower_bound) for one in found.paths] == [True, True, False, False]
    # of equal paths, the first
    assert found.best is found.paths[2]
    assert found.document()["best"] == 90.0
    assert [row["bound"] for row in found.rows()][:2] == ["no path", "no path"]


def test_no_path_at_any_altitude_is_proven() -> None:
    found = cg.best_altitude(blocked, [20, 60])

    assert found.best is None
    assert math.isinf(found.lower_bound)
    assert math.isinf(found.gap)
    assert found.document() == {**found.document(), "best": None, "no_path": True, "lower_bound": None}


def test_a_missing_bound_makes_the_common_one_unknown() -> None:
    found = cg.best_altitude(blocked, [60, 90], solver="visibility-graph", tolerance=None)

    assert math.isnan(found.lower_bound)
    assert found.document()["lower_bound"] is None


@pytest.mark.parametrize("altitudes", [[], [math.nan], [80.0, math.inf], list(range(101))])
def test_senseless_altitudes_are_refused(altitudes: list[float]) -> None:
    with pytest.raises(ProblemError, match="altitudes"):
        cg.best_altitude(blocked, altitudes)


def test_a_map_that_opens_nowhere_is_an_error() -> None:
    with pytest.raises(CglaError, match="start is closed"):
        cg.best_altitude(blocked, [10, 20])
