"""Lattices: where their points lie, and which of them lies where."""

import math
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from oracles import lattice_points
from strategies import fast

from cgla_graph._types import Bounds, Point
from cgla_graph.errors import ProblemError
from cgla_graph.model.lattice import SNAP, Lattice
from cgla_graph.testing.strategies import boxes, coordinates, lattices

UNIT = (0.0, 0.0, 1.0, 1.0)


def size_of(bounds: Bounds) -> float:
    return max(abs(value) for value in bounds)


@fast
@given(lattices())
def test_points_lie_where_the_kind_says(lattice: Lattice) -> None:
    """Row by row from below, and never beyond the bounds."""
    expected = lattice_points(lattice.shape, lattice.bounds, lattice.kind)
    np.testing.assert_allclose(lattice.points, expected, rtol=0.0, atol=4e-16 * size_of(lattice.bounds))
    assert lattice.points.shape == (lattice.n_points, 2)
    assert lattice.n_points == math.prod(lattice.shape)
    assert (lattice.points >= lattice.bounds[:2]).all()
    assert (lattice.points <= lattice.bounds[2:]).all()


@fast
@given(boxes(), st.integers(2, 60), st.integers(2, 60))
def test_a_closed_lattice_ends_at_the_very_border(bounds: Bounds, nx: int, ny: int) -> None:
    points = Lattice((nx, ny), bounds=bounds).points
    assert tuple(points[0]) == bounds[:2]
    assert tuple(points[-1]) == bounds[2:]
    upper = Lattice((nx, ny), bounds=bounds, kind="upper").points
    assert tuple(upper[-1]) == bounds[2:]
    assert tuple(Lattice((nx, ny), bounds=bounds, kind="lower").points[0]) == bounds[:2]


@fast
@given(lattices())
def test_neighbours_are_one_spacing_apart(lattice: Lattice) -> None:
    nx, ny = lattice.shape
    grid = lattice.points.reshape(ny, nx, 2)
    slack = 1e-15 * size_of(lattice.bounds)
    np.testing.assert_allclose(np.diff(grid[:, :, 0], axis=1), lattice.spacing[0], rtol=1e-9, atol=slack)
    np.testing.assert_allclose(np.diff(grid[:, :, 1], axis=0), lattice.spacing[1], rtol=1e-9, atol=slack)


@fast
@given(lattices(), st.data())
def test_every_point_has_its_own_index(lattice: Lattice, data: st.DataObject) -> None:
    index = data.draw(st.integers(0, lattice.n_points - 1))
    x, y = lattice.points[index].tolist()
    assert lattice.index_of((x, y)) == index
    assert lattice.nearest((x, y)) == index


@fast
@given(lattices(unit=True), st.data(), st.floats(-1.0, 1.0), st.floats(-1.0, 1.0))
def test_a_point_very_near_a_node_is_that_node(lattice: Lattice, data: st.DataObject, dx: float, dy: float) -> None:
    index = data.draw(st.integers(0, lattice.n_points - 1))
    x, y = lattice.points[index].tolist()
    step_x, step_y = lattice.spacing
    near = (x + 0.999 * SNAP * dx * step_x, y + 0.999 * SNAP * dy * step_y)
    assert lattice.index_of(near) == index
    assert lattice.index_of((x + 1.001 * SNAP * step_x, near[1])) is None
    assert lattice.index_of((near[0], y - 1.001 * SNAP * step_y)) is None


@fast
@given(lattices(unit=True), coordinates, coordinates)
def test_nearest_is_the_nearest(lattice: Lattice, x: float, y: float) -> None:
    distances = [math.dist((x, y), point) for point in lattice.points]
    assert math.isclose(distances[lattice.nearest((x, y))], min(distances), abs_tol=1e-15)


def test_the_paper_names_points_of_the_upper_kind() -> None:
    # N = 20: start (0.1, 0.1), target (0.9, 0.9), threat (0.6, 0.5)
    paper = Lattice(20, bounds=UNIT, kind="upper")
    named: list[Point] = [(0.1, 0.1), (0.9, 0.9), (0.6, 0.5), (0.1, 0.25)]
    for point in named:
        index = paper.index_of(point)
        assert index is not None
        assert math.dist(paper.points[index], point) <= 2e-16
    assert all(Lattice(20, bounds=UNIT).index_of(point) is None for point in named)


def test_equal_settings_make_equal_lattices() -> None:
    one = Lattice(5, bounds=UNIT)
    assert one == Lattice((5, 5), bounds=UNIT)
    assert one == Lattice(cast("tuple[int, int]", [5, np.int64(5)]), bounds=UNIT)
    assert hash(one) == hash(Lattice((5, 5), bounds=UNIT))
    assert one != Lattice(5, bounds=UNIT, kind="upper")


def test_points_are_read_only() -> None:
    lattice = Lattice(3, bounds=UNIT)
    with pytest.raises(ValueError, match="read-only"):
        lattice.points[0, 0] = 7.0
    assert lattice.points is lattice.points


NO_RESOLUTIONS = (1, 0, -3, True, 2.0, 20.5, math.nan, "20", None, (3,), (3, 1), (3, 4, 5), (3, 2.0), (), {3})
NO_BOUNDS = ((0, 0, 0, 1), (0, 1, 1, 1), (1, 0, 0, 1), (0, 0, 1), "0011", None)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        *(({"resolution": odd}, "resolution is .*at least 2") for odd in NO_RESOLUTIONS),
        *(
            ({"kind": odd}, "unknown lattice kind .*closed, upper, lower, centre")
            for odd in ("open", "", None, 3, ["closed"], "Closed")
        ),
        *(({"bounds": odd}, "bounds") for odd in NO_BOUNDS),
    ],
)
def test_malformed_settings_are_refused(change: dict[str, Any], words: str) -> None:
    with pytest.raises(ProblemError, match=words):
        Lattice(**{"resolution": 3, "bounds": UNIT, **change})
