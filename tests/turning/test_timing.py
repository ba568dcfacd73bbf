"""Times in the wind, against the aircraft's own motion through the air."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.integrate import quad
from strategies import arcs, usual

from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.timing import _widening, radius_over_ground, timed, times_along


@usual
@given(arc=arcs(), blows=st.floats(0.0, 0.95), bearing=st.floats(0.0, 6.3))
def test_time_is_that_of_the_ground_speed_all_along(arc: FloatArray, blows: float, bearing: float) -> None:
    """The ground speed solves ``|g u - w| = v``: what is left of it without the wind is the airspeed."""
    wind = 20.0 * blows * np.array([math.cos(bearing), math.sin(bearing)])
    straight = np.array([*arc[2:4], *(arc[2:4] + 1.0), 0.0, 0.0, 0.0, 0.0])
    curve = Curve(np.stack([arc, straight]))
    speeds = []

    def pace(distance: float) -> float:
        which, shares, _ = curve.at(np.array([distance]))
        heading = float(curve.headings(which, shares)[0])
        along = np.array([math.cos(heading), math.sin(heading)])
        _, middle, last = np.roots([1.0, -2.0 * wind @ along, wind @ wind - 400.0, 0.0])[::-1]
        speeds.append(max(middle.real, last.real))
        return 1.0 / speeds[-1]

    lengths = curve.lengths
    expected = sum(
        quad(pace, *ends, epsabs=1e-13, limit=200)[0] for ends in ((0.0, lengths[0]), (lengths[0], curve.length))
    )
    found = timed(curve, 20.0, wind=tuple(wind.tolist()), power=100.0)
    assert found.seconds == pytest.approx(expected, rel=1e-9)
    assert found.energy == pytest.approx(100.0 * expected / 3600.0, rel=1e-9)
    assert found.slowest * (1.0 - 1e-9) <= min(speeds)
    assert max(speeds) <= found.fastest * (1.0 + 1e-9)
    # and of a fine polyline, waypoint by waypoint
    along = times_along(curve.points(1e-8), 20.0, tuple(wind.tolist()))
    assert along[-1] == pytest.approx(expected, rel=1e-4)


@pytest.mark.parametrize("wind", [(3.0, 4.0), (-30.0, 0.0)])
def test_wind_as_fast_as_the_aircraft_is_refused(wind: tuple[float, float]) -> None:
    with pytest.raises(ProblemError, match=r"the wind is \d+ fast, the airspeed 5: against it"):
        timed(Curve(), 5.0, wind=wind)


@usual
@given(blows=st.floats(0.0, 0.95), bearing=st.floats(-math.pi, math.pi), heading=st.floats(-math.pi, math.pi))
def test_turns_at_a_fixed_bank_are_wider_with_the_wind_behind(blows: float, bearing: float, heading: float) -> None:
    """The curvature over ground of a circle in the air that drifts with the wind, by differences."""
    speed, radius = 18.0, 60.0
    wind = speed * blows * np.array([math.cos(bearing), math.sin(bearing)])
    velocity = speed * np.array([math.cos(heading), math.sin(heading)]) + wind
    acceleration = speed**2 / radius * np.array([-math.sin(heading), math.cos(heading)])
    ground = float(np.hypot(*velocity))
    over_ground = ground**3 / float(velocity[0] * acceleration[1] - velocity[1] * acceleration[0])
    assert _widening(ground, speed, speed * blows) * radius == pytest.approx(over_ground, rel=1e-6)
    assert over_ground <= radius_over_ground(radius, speed, tuple(wind.tolist())) * (1.0 + 1e-9)


def test_an_arc_needs_the_turn_of_its_widest_place() -> None:
    # a half turn from east over north to west, in a wind to the east: 60 m need 60 / (26 / 18)^2 m
    arc = Curve(np.array([[0.0, 0.0, 0.0, 120.0, 60.0, 0.0, 60.0, math.pi]]))
    assert timed(arc, 18.0).still_air_radius == pytest.approx(60.0)
    assert timed(arc, 18.0, wind=(8.0, 0.0)).still_air_radius == pytest.approx(60.0 / (26.0 / 18.0) ** 2)
    assert timed(Curve(), 18.0, wind=(8.0, 0.0)).still_air_radius == math.inf
