"""The oracle of timed paths, against quadrature of the risk at each moment, closed forms and changes of frame."""

import math
from itertools import pairwise

import numpy as np
import pytest
import shapely
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.integrate import quad, solve_ivp
from strategies import fast

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.motion.trajectory import Trajectory

unit = st.floats(0.0, 1.0)
place = st.tuples(unit, unit)
spread = st.floats(0.02, 0.5)
peak = st.floats(0.05, 1.0)
GATE = shapely.box(0.4, -0.5, 0.6, 1.5)


@st.composite
def moving_threats(draw: st.DrawFn) -> cg.MovingThreat:
    times = sorted(set(draw(st.lists(st.integers(0, 40), min_size=1, max_size=3))))
    track = [(0.1 * time, *draw(place)) for time in times]
    each = st.tuples(*(spread for _ in track)), st.tuples(*(peak for _ in track))
    return cg.MovingThreat(track, draw(st.one_of(spread, each[0])), draw(st.one_of(peak, each[1])))


@st.composite
def timed_paths(draw: st.DrawFn) -> FloatArray:
    """Draw a path flown at speed 0.7 that waits at one of its points, perhaps."""
    path = np.array(draw(st.lists(place, min_size=2, max_size=4)))
    rows = cg.TimedProblem((0, 0), (1, 1), speed=0.7).fly(path)
    wait = draw(st.sampled_from([0.0, 0.3]))
    if wait == 0.0:
        return rows
    at = draw(st.integers(0, len(rows) - 1))
    return np.vstack([rows[: at + 1], later(rows[at:], wait)])


def risk_by_quadrature(problem: cg.TimedProblem, rows: FloatArray) -> float:
    """Integrate ``v F`` over time, F by the definition of each threat at each moment."""

    def rate(time: float) -> float:
        x, y = (np.interp(time, rows[:, 0], rows[:, i]) for i in (1, 2))
        clear = 1.0
        for threat in (*problem.field.threats, *(one.at(time) for one in problem.moving)):
            clear *= 1.0 - threat.peak * math.exp(-((x - threat.x) ** 2 + (y - threat.y) ** 2) / 2 / threat.spread**2)
        return problem.speed * (1.0 - clear)

    inner = problem.events[(problem.events > rows[0, 0]) & (problem.events < rows[-1, 0])]
    edges = np.unique(np.concatenate([rows[:, 0], inner]))
    parts = [np.linspace(*pair, 5) for pair in pairwise(edges)]
    return math.fsum(quad(rate, *one, epsabs=1e-12, epsrel=1e-11)[0] for part in parts for one in pairwise(part))


@settings(fast, max_examples=10)
@given(st.lists(moving_threats(), max_size=4), st.lists(st.tuples(place, spread, peak), max_size=3), timed_paths())
def test_risk_is_the_integral_over_time(moving: list[cg.MovingThreat], still: list, rows: FloatArray) -> None:
    field = cg.RiskField([cg.Threat(*at, wide, high) for at, wide, high in still])
    problem = cg.TimedProblem((0, 0), (1, 1), field, moving, speed=0.7, k=3.0, waiting=0.2)
    found = problem.evaluate(rows)
    assert found.feasible
    assert found.risk == pytest.approx(risk_by_quadrature(problem, rows), abs=1e-10)
    assert found.cost == pytest.approx(found.air_distance + 0.2 * found.waiting + 3.0 * found.risk)


@fast
@given(st.lists(st.tuples(place, spread, peak), max_size=4), st.lists(place, min_size=2, max_size=5))
def test_where_nothing_moves_it_costs_what_the_problem_costs(still: list, path: list[tuple[float, float]]) -> None:
    threats = [cg.Threat(*at, wide, high) for at, wide, high in still]
    problem = cg.Problem((0, 0), (1, 1), cg.RiskField(threats), 5.0)
    standing = [cg.MovingThreat([(0, one.x, one.y)], one.spread, one.peak) for one in threats]
    for field, moving in ((problem.field, []), (None, standing)):
        timed = cg.TimedProblem((0, 0), (1, 1), field, moving, k=5.0, speed=0.3, departure=2.0)
        found, expected = timed.evaluate(timed.fly(path)), problem.evaluate(path)
        assert found.feasible
        assert timed.is_still
        assert found.cost == pytest.approx(expected.cost, rel=1e-12)
        assert (found.air_distance, found.time) == pytest.approx((expected.length, expected.length / 0.3))


@fast
@given(place, place, st.tuples(st.floats(-2, 2), st.floats(-2, 2)), st.floats(0.1, 3.0))
def test_a_straight_leg_in_wind_takes_the_time_of_zermelo(
    a: tuple[float, float], b: tuple[float, float], wind: tuple[float, float], speed: float
) -> None:
    problem = cg.TimedProblem((0, 0), (1, 1), speed=speed, wind=wind)
    d, w = np.subtract(b, a), np.array(wind)
    if math.hypot(*d) < 1e-3 or abs(speed - math.hypot(*w)) < 1e-2:
        return
    root = (w @ d) ** 2 + (speed**2 - w @ w) * (d @ d)
    time = (-w @ d + math.sqrt(root)) / (speed**2 - w @ w) if root > 1e-6 else math.nan
    if math.isnan(time) and root < -1e-6:
        with pytest.raises(ProblemError, match="too strong"):
            problem.fly([a, b])
    elif time > 0.0:
        found = problem.evaluate(problem.fly([a, b]))
        assert found.feasible
        assert (found.time, found.air_distance) == pytest.approx((time, speed * time))


@fast
@given(
    st.lists(st.tuples(place, place, place, spread, peak), max_size=3),
    st.lists(place, min_size=2, max_size=4),
    st.tuples(st.floats(-0.3, 0.3), st.floats(-0.3, 0.3)),
)
def test_what_moves_as_a_whole_moves_as_in_a_wind(
    threats: list, path: list[tuple[float, float]], wind: tuple[float, float]
) -> None:
    """With risk per time, time and air distance and risk are the same in a frame that moves with the air."""
    settings_: dict = {"speed": 0.7, "k": 3.0, "risk_per": "time", "bounds": (-9, -9, 9, 9)}
    tracks = [np.column_stack([(0.0, 1.5, 20.0), one[:3]]) for one in threats]
    shapes = [one[3:] for one in threats]
    moving = [cg.MovingThreat(track, *shape) for track, shape in zip(tracks, shapes, strict=True)]
    carried = [cg.MovingThreat(blown(track, wind), *shape) for track, shape in zip(tracks, shapes, strict=True)]
    here = cg.TimedProblem((0, 0), (1, 1), None, moving, **settings_)
    there = cg.TimedProblem((0, 0), (1, 1), None, carried, wind=wind, **settings_)
    rows = here.fly(path)
    a, b = here.evaluate(rows), there.evaluate(blown(rows, wind))
    assert a.feasible
    assert b.feasible
    assert (b.air_distance, b.risk, b.cost) == pytest.approx((a.air_distance, a.risk, a.cost), abs=1e-9)


def blown(rows: FloatArray, wind: tuple[float, float]) -> FloatArray:
    return np.column_stack([rows[:, 0], rows[:, 1:] + rows[:, :1] * np.array(wind)])


def later(rows: FloatArray, by: float) -> FloatArray:
    return np.column_stack([rows[:, 0] + by, rows[:, 1:]])


def test_an_area_is_closed_from_when_it_appears_until_it_vanishes() -> None:
    area = cg.TimedArea(GATE, appears=2, vanishes=4)
    problem = cg.TimedProblem((0, 0.5), (1, 0.5), areas=[area], speed=0.1, waiting=1.0, departure=(0, 9))
    crossing = problem.fly([(0, 0.5), (1, 0.5)])
    # in the gate from 4 to 6 after departure: free from the instant when it opens
    assert problem.evaluate(crossing).feasible
    assert problem.evaluate(later(crossing, 8.0)).feasible
    early = problem.evaluate(later(crossing, -1e-6))
    assert any("crosses a closed area" in one for one in early.violations)
    # out of it at the very instant when it closes
    assert problem.evaluate([(0, 0.5, 0.5), (1, 0.6, 0.5)]).feasible
    gone = cg.TimedProblem((0, 0.5), (1, 0.5), areas=[area], speed=0.1, departure=(0, 9))
    assert gone.evaluate([(1, 0.5, 0.5), (2, 0.6, 0.5)]).feasible
    assert not gone.evaluate([(1.01, 0.5, 0.5), (2.01, 0.6, 0.5)]).feasible
    # it may end inside before the instant of closing, not at it, and begin inside at the instant of opening
    assert gone.evaluate([(0.9, 0.4, 0.5), (1.9, 0.5, 0.5)]).feasible
    assert not gone.evaluate([(1.0, 0.4, 0.5), (2.0, 0.5, 0.5)]).feasible
    assert gone.evaluate([(4.0, 0.5, 0.5), (5.0, 0.6, 0.5)]).feasible
    # along the border at any time
    assert gone.evaluate([(2.0, 0.4, 0.2), (4.0, 0.4, 0.4)]).feasible


@pytest.mark.parametrize(
    ("settings_", "rows", "words"),
    [
        ({}, [(0, 0, 0), (1, 0.2, 0)], "leg 0 takes 1, and at airspeed 0.1 it takes 2"),
        ({}, [(0, 0, 0), (2, 0.2, 0), (3, 0.2, 0)], "leg 1 waits, and waiting has no price"),
        ({"waiting": 1.0, "wind": (0.2, 0)}, [(0, 0, 0), (3, 0, 0)], "faster than the airspeed"),
        ({"wind": (0.2, 0)}, [(0, 0.5, 0), (3, 0, 0)], "the wind is too strong"),
        ({}, [(0, 0.1, 0), (2, -0.1, 0)], "row 1 leaves the bounds"),
        ({}, [(1, 0, 0), (3, 0.2, 0)], "it departs at 1, and may depart at 0"),
        ({"departure": (2, 3)}, [(1, 0, 0), (3, 0.2, 0)], "may depart between 2 and 3"),
        ({"latest": 1.5}, [(0, 0, 0), (2, 0.2, 0)], "the latest arrival is 1.5"),
        ({"clearance": 0.05}, [(0, 0.2, 0.37), (2, 0.2, 0.57)], "within 0.03 of a closed area"),
    ],
)
def test_what_is_not_feasible_is_said(settings_: dict, rows: list, words: str) -> None:
    problem = cg.TimedProblem((0, 0), (1, 0), no_fly=shapely.box(0.1, 0.6, 0.3, 0.8), speed=0.1, **settings_)
    found = problem.evaluate(rows)
    assert not found.feasible
    assert words in "; ".join(found.violations)


def test_fields_replace_each_other_by_the_hour() -> None:
    hours = [cg.RiskField(rasters=[cg.RasterRisk([[0.1 * hour]], (0, 0, 1, 1))]) for hour in range(3)]
    problem = cg.TimedProblem((0, 0), (1, 0), hours[0], fields=[(1, hours[1]), (3, hours[2])], speed=0.1, waiting=1.0)
    found = problem.evaluate([(0, 0.1, 0.5), (2, 0.3, 0.5), (4, 0.3, 0.5)])
    assert found.risk == pytest.approx(0.1 * (0.1 + 0.1 + 0.2))
    assert [slab.field for slab in problem.slabs(5)] == hours
    per_time = cg.TimedProblem((0, 0), (1, 0), hours[1], speed=0.1, risk_per="time", waiting=1.0)
    assert per_time.evaluate([(0, 0.1, 0.5), (2, 0.3, 0.5), (4, 0.3, 0.5)]).risk == pytest.approx(0.4)


def test_a_threat_stands_still_before_its_track_begins() -> None:
    """Its place was not a number then: planner and proof left it out."""
    storm = cg.MovingThreat([(1, 0.5, 0.5), (2, 0.5, 0.1)], spread=0.1)
    problem = cg.TimedProblem((0.1, 0.5), (0.9, 0.5), moving=[storm], k=5.0, speed=0.8)
    first = problem.slabs(3.0)[0]
    assert first.ends == 1.0
    assert first.threats.tolist() == first.threats_at(0.5).tolist() == [[0.5, 0.5, 0.0, 0.0, 0.1, 0.0, 1.0, 0.0]]


@st.composite
def winds(draw: st.DrawFn) -> cg.Wind:
    shape = draw(st.sampled_from([(1, 2, 3), (3, 2, 2), (2, 1, 4)]))
    numbers = st.lists(st.floats(-0.4, 0.4), min_size=math.prod(shape), max_size=math.prod(shape))
    u, v = (np.reshape(draw(numbers), shape) for _ in range(2))
    return cg.Wind(u, v, (0.1, 0, 0.9, 1), times=np.array([0.3, 0.9, 2.5])[: shape[0]])


@settings(fast, max_examples=3)
@given(winds(), st.lists(moving_threats(), max_size=2), st.lists(place, min_size=2, max_size=3), st.booleans())
def test_wind_on_a_grid_carries_as_the_differential_equation_says(
    wind: cg.Wind, moving: list[cg.MovingThreat], path: list[tuple[float, float]], per_time: bool
) -> None:
    raster = cg.RasterRisk([[0.1, 0.3], [0.0, 0.2]], (0, 0, 1, 1), interpolation="bilinear")
    field = cg.RiskField([cg.Threat(0.5, 0.4, 0.1, 0.7)], rasters=[raster])
    measure = "time" if per_time else "ground"
    problem = cg.TimedProblem((0, 0), (1, 1), field, moving, speed=0.7, k=3.0, wind=wind, risk_per=measure)
    rows = problem.fly(path)
    found = problem.evaluate(rows)
    assert found.feasible
    assert found.air_distance == pytest.approx(0.7 * (rows[-1, 0] - rows[0, 0]))
    risk = 0.0
    for first, last in pairwise(rows):
        length = math.dist(first[1:], last[1:])
        along = (last[1:] - first[1:]) / length

        def slope(s: float, state: FloatArray, first: FloatArray = first, along: FloatArray = along) -> list[float]:
            at = first[1:] + s * along
            u, v = wind.at(at, state[0])
            ground = u * along[0] + v * along[1] + math.sqrt(0.49 - (u * along[1] - v * along[0]) ** 2)
            density = float(problem.field_at(state[0]).density(at))
            return [1.0 / ground, density / ground if per_time else density]

        end = solve_ivp(slope, (0.0, length), [first[0], 0.0], "DOP853", rtol=1e-11, atol=1e-13, max_step=0.05).y[:, -1]
        assert end[0] == pytest.approx(last[0], rel=1e-7)
        risk += end[1]
    assert found.risk == pytest.approx(risk, rel=1e-5, abs=1e-8)


@settings(fast, max_examples=8)
@given(st.lists(moving_threats(), max_size=3), timed_paths(), st.sampled_from(["ground", "time"]))
def test_a_grid_of_one_wind_is_that_wind(moving: list[cg.MovingThreat], rows: FloatArray, measure: str) -> None:
    """The kernels of changing wind give the same as those of constant wind, wherever the wind hardly changes."""
    still: dict = {"speed": 0.7, "k": 3.0, "waiting": 0.3, "risk_per": measure}
    field = cg.RiskField([cg.Threat(0.5, 0.4, 0.1, 0.7)])
    one = cg.TimedProblem((0, 0), (1, 1), field, moving, **still).evaluate(rows)
    nearly = cg.Wind([[[0.0, 1e-15]], [[0.0, 0.0]]], np.zeros((2, 1, 2)), (0, 0, 1, 1), times=[0.5, 1.5])
    two = cg.TimedProblem((0, 0), (1, 1), field, moving, wind=nearly, **still).evaluate(rows)
    assert two.feasible
    assert (two.arrival, two.air_distance, two.risk, two.cost, two.waiting) == pytest.approx(
        (one.arrival, one.air_distance, one.risk, one.cost, one.waiting), rel=1e-9, abs=1e-10
    )


def test_a_leg_that_the_wind_does_not_allow_is_said() -> None:
    storm = cg.Wind([[0.0, -2.0]], [[0.0, 0.0]], (0, 0, 1, 1))
    problem = cg.TimedProblem((0, 0), (1, 0), speed=1.0, wind=storm, waiting=1.0)
    with pytest.raises(ProblemError, match="leg 0 cannot be flown"):
        problem.fly([(0, 0), (1, 0)])
    found = problem.evaluate([(0, 0, 0), (1, 1, 0)])
    assert "leg 0 cannot be flown: the wind is too strong for airspeed 1" in found.violations
    assert math.isnan(found.cost)
    assert problem.evaluate([(0, 0.4, 0), (1, 0.4, 0)]).feasible
    assert "which is faster" in problem.evaluate([(0, 0.6, 0), (1, 0.6, 0)]).violations[0]


@pytest.mark.parametrize("wind", [None, cg.Wind([[0.0, 1e-9]], [[0.0, 0.0]], (0, 0, 1, 1))])
def test_others_are_kept_away_from(wind: cg.Wind | None) -> None:
    other = Trajectory([0.0, 1.0], [(0.5, 0.0), (0.5, 1.0)])
    problem = cg.TimedProblem(
        (0, 0.5), (1, 0.5), speed=1.0, others=[other], separation=0.1, departure=(0, 1), wind=wind
    )
    met = problem.evaluate(problem.fly([(0, 0.5), (1, 0.5)]))
    assert met.separation == pytest.approx(0.0, abs=1e-6)
    assert "of trajectory 0 of others at time 0.5" in met.violations[0]
    later_on = problem.evaluate(problem.fly([(0, 0.5), (1, 0.5)], departure=0.2))
    assert later_on.feasible
    # (0.2 behind, both at speed 1, at right angles)
    assert later_on.separation == pytest.approx(0.2 * math.sqrt(0.5), abs=1e-6)
