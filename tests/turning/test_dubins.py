"""Dubins' curves in closed form, against OMPL's and against where they shall end."""

import math
from typing import TypeAlias

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.model.problem import Problem
from cgla_graph.testing.strategies import points, seeds
from cgla_graph.turning import dubins_kernels
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.curve_kernels import N_COLUMNS
from cgla_graph.turning.flyable import plan_flyable

Pose: TypeAlias = tuple[float, float, float]

angles = st.floats(-math.pi, math.pi)
poses = st.tuples(points, angles).map(lambda pose: (*pose[0], pose[1]))


@usual
@given(start=poses, goal=poses, radius=st.sampled_from([0.01, 0.1, 0.5, 2.0]))
def test_words_lead_to_the_goal(start: Pose, goal: Pose, radius: float) -> None:
    n_words = 0
    for word in range(dubins_kernels.N_WORDS):
        rows = np.zeros((3, N_COLUMNS))
        n = dubins_kernels.word_pieces(start, goal, radius, word, rows)
        if n < 1:
            continue
        n_words += 1
        curve = Curve(rows[:n])
        parts = dubins_kernels.word_parts(start, goal, radius, word)
        assert curve.length == pytest.approx(radius * sum(parts), abs=1e-9)
        _, _, ends = curve.at(np.array([0.0, curve.length]))
        assert np.allclose(ends, [start[:2], goal[:2]], atol=1e-9)
        headings = curve.headings(np.array([0, n - 1]), np.array([0.0, 1.0])) - (start[2], goal[2])
        assert np.abs(np.sin(0.5 * headings)).max() < 1e-6
        # what the last piece was moved by, to end at the goal itself
        inner = curve.headings(np.arange(1, n), np.zeros(n - 1)) - curve.headings(np.arange(n - 1), np.ones(n - 1))
        assert np.abs(np.sin(0.5 * inner)).max(initial=0.0) < 1e-6
    # the words of two arcs of one side and a line are always there
    assert n_words >= 2 or start[:2] == goal[:2]


@pytest.mark.ompl
@usual
@given(start=poses, goal=poses, radius=st.sampled_from([0.01, 0.1, 0.5, 2.0]))
def test_the_shortest_word_is_that_of_ompl(start: Pose, goal: Pose, radius: float) -> None:
    ob = pytest.importorskip("ompl.base")
    space = ob.DubinsStateSpace(radius)
    bounds = ob.RealVectorBounds(2)
    bounds.setLow(-10.0)
    bounds.setHigh(10.0)
    space.setBounds(bounds)
    states = [space.allocState(), space.allocState()]
    for state, pose in zip(states, (start, goal), strict=True):
        state.setX(pose[0])
        state.setY(pose[1])
        state.setYaw(pose[2])
    expected = space.distance(*states)
    del states, space
    assert dubins_kernels.shortest(start, goal, radius)[1] == pytest.approx(expected, rel=1e-9, abs=1e-9)


@usual
@given(seed=seeds)
def test_on_an_empty_map_a_flyable_path_is_the_shortest_word(seed: int) -> None:
    """Headings are degrees clockwise from north."""
    rng = np.random.default_rng(seed)
    start, goal = rng.uniform(3.0, 7.0, (2, 2)).tolist()
    headings = rng.uniform(-360.0, 360.0, 2)
    radius = 10.0 ** rng.uniform(-2.0, -0.3)
    problem = Problem(start, goal, bounds=(0, 0, 10, 10))
    found = plan_flyable(problem, np.array([start, goal]), radius, start_heading=headings[0], goal_heading=headings[1])
    east = np.radians(90.0 - headings)
    shortest = dubins_kernels.shortest((*start, east[0]), (*goal, east[1]), radius)[1]
    assert found.cost == pytest.approx(shortest, rel=1e-9)
    assert found.lower_bound <= found.cost
    assert found.curve.least_radius == radius
