"""Motion in space and time: the closest approach is exact over all times, not only at sampled ones."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import oracles
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.motion.trajectory import Trajectory, closest_approach
from cgla_graph.motion.trajectory_kernels import Disc
from cgla_graph.testing.strategies import seeds


@st.composite
def trajectories(draw: st.DrawFn, max_size: int = 6) -> Trajectory:
    """Draw motions with waits, at half numbers (where they meet and touch exactly) or anywhere."""
    m = draw(st.integers(1, max_size))
    rng = np.random.default_rng(draw(seeds))
    if draw(st.booleans()):
        times = np.sort(rng.choice(12, m, replace=False)) / 2.0
        points = rng.integers(0, 7, (m, 2)) / 2.0
    else:
        times = np.cumsum(rng.uniform(0.01, 2.0, m))
        points = 3.0 * rng.random((m, 2))
    for i in np.nonzero(rng.random(m - 1) < 0.3)[0]:
        points[i + 1] = points[i]
    return Trajectory(times, points)


def sampled(trajectory: Trajectory, times: FloatArray) -> FloatArray:
    return np.stack([np.interp(times, trajectory.times, trajectory.points[:, i]) for i in range(2)], axis=1)


def sampled_gaps(a: Trajectory, b: Trajectory, times: FloatArray) -> FloatArray:
    return np.asarray(np.hypot(*(sampled(a, times) - sampled(b, times)).T))


def fastest(*several: Trajectory) -> float:
    """Return the sum of the greatest speeds."""
    return sum(
        float((np.hypot(*np.diff(each.points, axis=0).T) / np.diff(each.times)).max(initial=0.0)) for each in several
    )


# One trajectory


@fast
@given(trajectories(), st.floats(0.0, 1.0), st.floats(0.0, 1.0))
def test_places_and_parts_agree_with_interpolation(motion: Trajectory, first: float, last: float) -> None:
    low, high = sorted(min(motion.begins + part * (motion.ends - motion.begins), motion.ends) for part in (first, last))
    inner = [t for t in motion.times if low < t < high]
    times = np.unique([low, *inner, high])

    part = motion.part(low, high)

    assert part is not None
    assert part.times == pytest.approx(times)
    assert part.points == pytest.approx(sampled(motion, times))
    assert motion.at(low) == pytest.approx(tuple(sampled(motion, np.array([low]))[0]))
    assert motion.at(motion.begins) == motion.start
    assert motion.at(motion.ends) == motion.goal


@fast
@given(seeds, st.integers(1, 6), st.floats(0.01, 10.0), st.floats(-100.0, 100.0))
def test_a_flight_along_a_path_has_constant_speed(seed: int, n: int, step: float, start_time: float) -> None:
    rng = np.random.default_rng(seed)
    path = rng.random((n, 2))[np.sort(rng.integers(0, n, 2 * n))]

    flight = Trajectory.along(path, start_time, step)

    assert (flight.start, flight.goal) == (tuple(path[0]), tuple(path[-1]))
    assert flight.begins == start_time
    assert np.hypot(*np.diff(flight.points, axis=0).T) == pytest.approx(step * np.diff(flight.times))
    assert flight.length == pytest.approx(np.hypot(*np.diff(path, axis=0).T).sum())
    assert flight.ends == pytest.approx(start_time + flight.length / step)
    assert not flight.waits


def test_a_way_too_short_to_take_time_still_ends_where_it_ends() -> None:
    flight = Trajectory.along([(0, 0), (1e-30, 0), (1, 0), (1, 1e-30)], start_time=1, step=1)
    assert flight.times.tolist() == [1.0, 2.0]
    assert flight.points.tolist() == [[0.0, 0.0], [1.0, 1e-30]]


def test_waits_are_where_points_repeat() -> None:
    motion = Trajectory([0, 1, 3, 4, 6], [(0, 0), (1, 0), (1, 0), (2, 0), (2, 0)])
    assert motion.waits == [((1.0, 0.0), 2.0), ((2.0, 0.0), 2.0)]
    assert motion.length == 2.0


def test_nothing_can_be_changed_afterwards() -> None:
    times, points = np.array([0.0, 1.0]), np.zeros((2, 2))
    motion = Trajectory(times, points)
    times[0] = points[0, 0] = 9.0
    assert (motion.begins, motion.start) == (0.0, (0.0, 0.0))
    with pytest.raises(ValueError, match="read-only"):
        motion.points[0, 0] = 1.0


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Trajectory([], np.empty((0, 2))), r"give shapes \(m,\) and \(m, 2\)"),
        (lambda: Trajectory([0, 1], [(0, 0)]), "shapes"),
        (lambda: Trajectory([0, 0], [(0, 0), (1, 0)]), r"times\[1\] is 0"),
        (lambda: Trajectory([0, np.inf], [(0, 0), (1, 0)]), r"times\[1\] is inf"),
        (lambda: Trajectory([0, 1], [(0, 0), (np.nan, 0)]), "finite"),
        (lambda: Trajectory.along([], 0, 1), "path"),
        (lambda: Trajectory.along([(0, 0)], 0, 0), "step is 0"),
        (lambda: Trajectory.along([(0, 0)], math.nan, 1), "start_time"),
        (lambda: Trajectory([0, 1], [(0, 0), (0, 0)]).at(1.5), "give one from 0 to 1"),
    ],
)
def test_what_is_malformed_is_refused(make: Callable[[], Any], message: str) -> None:
    with pytest.raises(ProblemError, match=message):
        make()


# Two trajectories


@fast
@given(trajectories(), trajectories())
def test_closest_approach_is_the_least_distance_of_all_moments(a: Trajectory, b: Trajectory) -> None:
    found = closest_approach(a, b)
    expected = oracles.least_gap((a.times, a.points), (b.times, b.points))

    if found is None:
        assert expected == math.inf
        return
    assert found.distance == pytest.approx(expected, abs=1e-12)
    assert math.dist(a.at(found.time), b.at(found.time)) == pytest.approx(found.distance, abs=1e-12)
    assert found.where == pytest.approx(tuple(np.mean([a.at(found.time), b.at(found.time)], axis=0)))
    times = np.linspace(max(a.begins, b.begins), min(a.ends, b.ends), 2001)
    gaps = sampled_gaps(a, b, times)
    between = (times[1] - times[0]) * fastest(a, b)
    assert gaps.min() - between <= found.distance + 1e-12 <= gaps.min() + 2e-12


@fast
@given(trajectories(), trajectories(), st.integers(-3, 3))
def test_closest_approach_is_symmetric_and_the_same_backwards_and_later(a: Trajectory, b: Trajectory, by: int) -> None:
    def backwards(motion: Trajectory) -> Trajectory:
        return Trajectory(-motion.times[::-1], motion.points[::-1])

    pairs = [(a, b), (b, a), (backwards(a), backwards(b)), (a.shifted(by), b.shifted(by))]
    distances = [math.inf if (found := closest_approach(*pair)) is None else found.distance for pair in pairs]
    assert distances[1:] == pytest.approx([distances[0]] * 3, abs=1e-9)


ALONG = Trajectory([0, 4], [(0, 0), (4, 0)])


@pytest.mark.parametrize(
    ("other", "distance", "time"),
    [
        # at right angles: 3 - t and t - 1 apart, least at 2
        (Trajectory([0, 4], [(3, -1), (3, 3)]), math.sqrt(2), 2.0),
        # side by side: always as near, first when both are there
        (Trajectory([1, 5], [(1, 2), (5, 2)]), 2.0, 1.0),
        # one arrives where the other begins, at the same moment
        (Trajectory([4, 6], [(4, 0), (4, 2)]), 0.0, 4.0),
        # for a moment only
        (Trajectory([3], [(3, 1)]), 1.0, 3.0),
    ],
)
def test_closest_approach_in_closed_form(other: Trajectory, distance: float, time: float) -> None:
    found = closest_approach(ALONG, other)
    assert found is not None
    assert (found.distance, found.time) == pytest.approx((distance, time))


# Terminal discs


@fast
@given(trajectories(), trajectories(), st.floats(0.0, 3.0), st.floats(0.0, 3.0))
def test_times_when_both_are_in_their_discs_do_not_count(
    a: Trajectory, b: Trajectory, radius_a: float, radius_b: float
) -> None:
    discs = Disc(a.goal, radius_a), Disc(b.goal, radius_b)
    found = closest_approach(a, b, outside=discs)
    anywhere = closest_approach(a, b)
    if anywhere is None:
        assert found is None
        return
    times = np.linspace(max(a.begins, b.begins), min(a.ends, b.ends), 2001)
    # how deep both are in their discs
    depth = np.min(
        [
            disc.radius - np.hypot(*(sampled(each, times) - disc.centre).T)
            for each, disc in zip((a, b), discs, strict=True)
        ],
        axis=0,
    )
    gaps = sampled_gaps(a, b, times)
    if found is None:
        assert (depth > -1e-9).all()
        return
    assert found.distance >= anywhere.distance - 1e-12
    assert (gaps[depth < -1e-9] >= found.distance - 1e-9).all()
    assert math.dist(a.at(found.time), b.at(found.time)) == pytest.approx(found.distance, abs=1e-9)
    inside = [
        disc.radius - math.dist(each.at(found.time), disc.centre) for each, disc in zip((a, b), discs, strict=True)
    ]
    assert min(inside) < 1e-6


def test_two_may_gather_at_their_goal_but_nobody_else_may_pass() -> None:
    a, b = Trajectory([0, 10], [(0, 0), (10, 0)]), Trajectory([0, 10], [(10, 10), (10, 0)])
    passing = Trajectory([0, 20], [(0, 0.5), (20, 0.5)])
    around = Disc((10.0, 0.0), 2.0)

    gathered = closest_approach(a, b, outside=(around, around))
    passed = closest_approach(a, passing, outside=(around, Disc((20.0, 0.5), 2.0)))

    assert gathered is not None
    assert (gathered.distance, gathered.time) == pytest.approx((2.0 * math.sqrt(2.0), 8.0))
    assert passed is not None
    assert passed.distance == 0.5


def test_no_time_counts_where_both_are_always_in_their_discs() -> None:
    a, b = Trajectory([0, 1, 2], [(0, 0), (1, 0), (0, 0)]), Trajectory([0, 2], [(0, 1), (1, 1)])
    assert closest_approach(a, b, outside=(Disc(a.goal, 1.0), Disc(b.goal, 1.0))) is None
