"""Written plans open in MAVSDK, which has a reader of QGroundControl's files in C++."""

import math
import socket
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
from plan_files import mine
from pymavlink.dialects.v20 import ardupilotmega

from cgla_graph.airspace.flight_plans.formats import write_plan
from cgla_graph.airspace.flight_plans.mission_items import items_of

pytest.importorskip("mavsdk", reason="there is no wheel of MAVSDK for this platform")
pytestmark = pytest.mark.slow


@pytest.fixture
def reader() -> Iterator[Any]:
    """Return a reader of missions; it needs an aircraft, of which we send only the heartbeat."""
    from mavsdk import mavsdk  # noqa: PLC0415 - a library of 24 MB
    from mavsdk.component_type import ComponentType  # noqa: PLC0415 - the same
    from mavsdk.plugins.mission_raw.mission_raw import MissionRaw  # noqa: PLC0415 - the same

    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    done = threading.Event()

    def beat() -> None:
        link = ardupilotmega.MAVLink(None, 1, 1)
        with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as out:
            while not done.wait(0.1):
                out.sendto(ardupilotmega.MAVLink_heartbeat_message(2, 12, 0, 0, 3, 3).pack(link), ("127.0.0.1", port))

    sdk = mavsdk.Mavsdk(mavsdk.Configuration.create_with_component_type(ComponentType.GROUND_STATION))
    heart = threading.Thread(target=beat)
    try:
        sdk.add_any_connection(f"udpin://127.0.0.1:{port}")
        heart.start()
        system = sdk.first_autopilot(20.0)
        assert system is not None
        yield MissionRaw(system)
    finally:
        done.set()
        heart.join()
        sdk.destroy()


def test_mavsdk_reads_written_plans(reader: Any, tmp_path: Path) -> None:  # noqa: ANN401 - of a library without types
    plan = mine()
    written = items_of(plan, "mine.plan")
    ours = reader.import_qgroundcontrol_mission(str(write_plan(plan, tmp_path / "mine.plan")))
    home, *theirs = reader.import_mission_planner_mission(
        str(write_plan(plan, tmp_path / "mine.waypoints"))
    ).mission_items
    assert (home.x, home.y, home.z) == (601_700_000, 249_400_000, 14.25)
    for items, heading in ((ours.mission_items, math.nan), (theirs, 0.0)):
        assert len(items) == len(written)
        for number, (one, item) in enumerate(zip(items, written, strict=True)):
            numbers = [heading if math.isnan(value) else value for value in item.numbers[:4]]
            assert (one.frame, one.command, one.autocontinue) == (item.frame, item.command, 1)
            assert [one.param1, one.param2, one.param3, one.param4] == pytest.approx(numbers, nan_ok=True)
            assert (one.x, one.y) == (round(item.numbers[4] * 1e7), round(item.numbers[5] * 1e7)), number
            assert one.z == item.numbers[6]
    assert not ours.geofence_items
    assert not ours.rally_items
