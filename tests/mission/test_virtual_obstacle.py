"""The two-zone rule of Section 5.2.1."""

import math
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast

from cgla_graph.errors import MissionError
from cgla_graph.mission.virtual_obstacle import Placement, VirtualObstacle, Zones

SIGHT = {"detection_radius": 0.2, "safe_distance": 0.1, "unit": 0.05}


@fast
@given(
    st.integers(0, 6),
    st.floats(0.0, 0.3),
    st.floats(0.0, 2.0 * math.pi),
    st.floats(0.0, 2.0 * math.pi),
    st.sampled_from(["replace", "add"]),
    st.sampled_from(["two", "near"]),
)
def test_obstacles_stand_where_the_rule_says(
    stepnum: int, distance: float, bearing: float, course: float, placement: Placement, zones: Zones
) -> None:
    rule = VirtualObstacle(stepnum=stepnum, placement=placement, zones=zones)
    place = distance * math.cos(bearing), distance * math.sin(bearing)
    heading = math.cos(course), math.sin(course)
    apart = math.hypot(*place)
    ahead = place[0] + stepnum * 0.02 * heading[0], place[1] + stepnum * 0.02 * heading[1]
    expected = []
    if apart < 0.1:
        expected = [place, ahead] if placement == "add" else [ahead]
    elif apart <= 0.2 and zones == "two":
        expected = [place]
    found = rule.around((0.0, 0.0), [(place, heading)], **SIGHT)
    assert [(threat.x, threat.y) for threat in found] == [pytest.approx(spot) for spot in expected]
    assert all((threat.spread, threat.peak) == (pytest.approx(0.02), 1.0) for threat in found)


def test_a_uav_that_has_not_moved_yet_has_no_ahead() -> None:
    (obstacle,) = VirtualObstacle(stepnum=5).around((0, 0), [((0.05, 0), (0.0, 0.0))], **SIGHT)
    assert (obstacle.x, obstacle.y) == (0.05, 0.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"stepnum": 1.0}, "stepnum is 1.0"),
        ({"spread": 0.0}, "spread is 0"),
        ({"peak": 1.5}, "peak is 1.5"),
        ({"placement": "behind"}, "choose replace or add"),
        ({"zones": "three"}, "choose two or near"),
    ],
)
def test_malformed_rules_are_refused_by_name(settings: dict[str, Any], words: str) -> None:
    with pytest.raises(MissionError) as caught:
        VirtualObstacle(**settings)
    assert words in str(caught.value)
