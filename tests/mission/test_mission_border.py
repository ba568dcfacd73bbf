"""Missions on maps whose border an area closes."""

from typing import Any

import pytest
import shapely
from test_mission_clearance import CGLA, EAST, WAYS

from cgla_graph.errors import MissionError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import MissionStatus
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedArea, World

WALL = shapely.box(0.45, 0.0, 0.55, 1.0)
LOWER = shapely.box(0.45, 0.0, 0.55, 0.6)


@pytest.mark.parametrize(
    "way", [pytest.param(way, marks=[pytest.mark.slow] if way == "stepper" else []) for way in WAYS]
)
def test_a_wall_to_the_border_is_flown_around_by_none(way: str) -> None:
    settings: dict[str, Any] = {"solver": CGLA, "resolution": 11, **WAYS[way]}
    charted = Mission(World(no_fly=WALL), [EAST], **settings).fly()
    assert charted.uavs["a"].status in {MissionStatus.NO_PATH, MissionStatus.STUCK}
    # the upper part is first seen on the way, or comes up
    for number, upper in enumerate((shapely.box(0.45, 0.6, 0.55, 1.0), shapely.box(0.45, 0.55, 0.55, 1.0 - 1e-12))):
        timed = [TimedArea(upper, appears=2 * number)]
        found = Mission(World(no_fly=LOWER, timed=timed), [EAST], **settings).fly()
        assert found.uavs["a"].status in {MissionStatus.NO_PATH, MissionStatus.STUCK}
        assert found.uavs["a"].trace[:, 0].max() < 0.55


def test_areas_at_the_clearance_from_the_border_close_it() -> None:
    area = shapely.box(0.45, 0.1, 0.55, 0.9)
    assert (
        Mission(World(no_fly=area), [EAST], solver=CGLA, clearance=0.1).fly().uavs["a"].status is MissionStatus.NO_PATH
    )
    free = Mission(World(no_fly=area), [EAST], solver=CGLA, clearance=0.04).fly().uavs["a"]
    assert free.status is MissionStatus.ARRIVED


def test_a_uav_on_a_closed_stretch_is_refused() -> None:
    with pytest.raises(MissionError, match=r"UAV b: start \(0.5, 1.0\) is where the no-fly area meets"):
        Mission(World(no_fly=WALL), [Uav("b", (0.5, 1.0), (0.9, 0.5), 0.3)], solver=CGLA)
