"""A2D-style: below its threshold where there is such a way, around traps, and stuck with a reason."""

import math

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few

import cgla_graph as cg

U_TRAP = shapely.box(0.3, 0.3, 0.7, 0.7).difference(shapely.box(0.2, 0.35, 0.65, 0.65))


@st.composite
def islands(draw: st.DrawFn) -> cg.RiskField:
    """Draw threats that leave a way below a risk of 0.1 between any two of them, and to the border."""
    places = [(x, y) for x in (0.25, 0.5, 0.75) for y in (0.25, 0.5, 0.75)]
    chosen = draw(st.lists(st.sampled_from(places), min_size=1, max_size=9, unique=True))
    spreads = draw(st.lists(st.floats(0.01, 0.042), min_size=len(chosen), max_size=len(chosen)))
    return cg.RiskField([cg.Threat(x, y, spread=s) for (x, y), s in zip(chosen, spreads, strict=True)])


@few
@given(islands(), st.floats(0.0, 1.0), st.floats(0.0, 1.0), st.sampled_from([8, 16, 32]))
def test_where_a_way_below_the_threshold_exists_it_keeps_to_one(
    field: cg.RiskField, left: float, right: float, headings: int
) -> None:
    problem = cg.Problem((0.02, left), (0.98, right), field, k=10.0)
    answer = cg.solve(problem, "a2d-style", threshold=0.1, headings=headings)
    assert answer.status is cg.Status.FOUND
    assert field.density(answer.path).max() <= 0.1
    middles = (answer.path[1:] + answer.path[:-1]) / 2.0
    assert field.density(middles[:-1]).max() <= 0.1
    straight = math.dist(problem.start, problem.goal)
    assert straight * (1.0 - 1e-12) <= answer.length <= 8.0 * straight


def test_it_does_not_step_over_a_threat_narrower_than_a_step() -> None:
    """The risk half a step ahead counts as well as that at its end."""
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.11, 0.5, spread=0.003)]), k=10.0)
    path = cg.solve(problem, "a2d-style").path
    assert problem.field.density((path[1:] + path[:-1]) / 2.0).max() <= 0.1


def test_it_walks_out_of_a_trap_along_its_walls() -> None:
    problem = cg.Problem((0.5, 0.5), (0.9, 0.5), no_fly=U_TRAP)
    answer = cg.solve(problem, "a2d-style")
    assert answer.status is cg.Status.FOUND
    # back out of the arms, around one of them and on to the goal, and little more
    shortest = cg.solve(problem, "visibility-graph").length
    assert shortest <= answer.length <= 1.6 * shortest


def test_around_a_single_threat_it_takes_about_the_shortest_way() -> None:
    """Half around the disc where the risk is 0.1."""
    problem = cg.Problem((0.1, 0.5), (0.9, 0.48), cg.RiskField([cg.Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    answer = cg.solve(problem, "a2d-style", threshold=0.1, headings=64, step=0.005)
    radius = 0.05 * math.sqrt(2.0 * math.log(10.0))
    disc = cg.solve(problem, "visibility-graph", spreads=radius / 0.05, corners=256)
    assert disc.length * 0.99 <= answer.length <= 1.1 * disc.length
    # the side that the smaller turn leads to
    assert answer.path[:, 1].min() < 0.42


@pytest.mark.parametrize("where", ["start", "goal", "both"])
def test_the_threshold_rises_only_where_nothing_else_helps(where: str) -> None:
    """Start or goal inside a threat can only be left or reached above it; on the way it holds again."""
    ends = {"start": (0.2, 0.5), "goal": (0.8, 0.5)}
    inside = [ends[name] for name in (("start", "goal") if where == "both" else (where,))]
    threats = [cg.Threat(x, y, spread=0.05) for x, y in [*inside, (0.5, 0.5)]]
    problem = cg.Problem(ends["start"], ends["goal"], cg.RiskField(threats), k=10.0)
    answer = cg.solve(problem, "a2d-style")
    assert answer.status is cg.Status.FOUND
    away = np.array([np.hypot(*(answer.path - end).T) for end in inside]).min(axis=0) > 0.15
    assert away.any()
    assert problem.field.density(answer.path[away]).max() <= 0.1


def test_a_sealed_map_is_crossed_where_the_risk_allows() -> None:
    """A ridge from border to border: raised by and by, the threshold stays below that of the straight line."""
    ridge = [cg.Threat(0.5, y, spread=0.1, peak=0.5 if abs(y - 0.9) < 0.06 else 1.0) for y in np.arange(0, 1.05, 0.1)]
    problem = cg.Problem((0.1, 0.3), (0.9, 0.3), cg.RiskField(ridge), k=10.0)
    answer = cg.solve(problem, "a2d-style", patience=1000)
    assert answer.status is cg.Status.FOUND
    assert answer.risk > 0.0


def test_a_goal_behind_walls_is_walked_around_and_given_up() -> None:
    ring = shapely.box(0.6, 0.6, 0.9, 0.9).difference(shapely.box(0.65, 0.65, 0.85, 0.85))
    answer = cg.solve(cg.Problem((0.1, 0.1), (0.75, 0.75), no_fly=ring), "a2d-style")
    assert answer.status is cg.Status.STUCK
    assert answer.message.endswith("the path led around the obstacle before the goal, and back again")
    assert 60 < int(answer.message.split("step ")[1].split(":")[0]) < 200
