"""Scenario files whose map changes in time: their keys, in map units, and what refuses them."""

from datetime import UTC, datetime, timedelta
from pathlib import Path

import numpy as np
import pytest
import shapely
from zone_files import data_of, ed269, volume

import cgla_graph as cg
from cgla_graph.comparisons.study.options import open_one
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.scenarios.scenario import scenario_from_toml

PLANE = """
start = [0.1, 0.5]
goal = [0.9, 0.5]
k = 5.0
clearance = 0.01
"""
IN_TIME = """
speed = 0.5
departure = [0, 2]
wind = [0.1, 0.0]
waiting = 0.4
latest = 9
risk_per = "time"
[[threats]]
x = 0.2
y = 0.2
spread = 0.1
[[moving]]
track = [[0, 0.2, 0.5], [2, 0.8, 0.5]]
spread = 0.1
peak = [0.9, 0.5]
[[timed_areas]]
polygon = [[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]
appears = 1
vanishes = 2.5
[[hours]]
since = 3
threats = [{x = 0.5, y = 0.5, spread = 0.1}]
"""
OTHERS = """
[[others]]
track = [[0, 0.1, 0.9], [3, 0.9, 0.9]]
"""


def test_every_key_reaches_the_problem() -> None:
    scenario = scenario_from_toml(f"separation = 0.05\n{PLANE}{IN_TIME}{OTHERS}", "mine")
    timed = scenario.timed
    assert timed is not None
    assert timed.still == scenario.problem
    assert (timed.speed, timed.departure, timed.wind, timed.waiting, timed.latest, timed.risk_per) == (
        *(0.5, (0.0, 2.0), (0.1, 0.0), 0.4, 9.0),
        "time",
    )
    assert timed.moving == (cg.MovingThreat([(0, 0.2, 0.5), (2, 0.8, 0.5)], 0.1, (0.9, 0.5)),)
    assert (timed.areas[0].appears, timed.areas[0].vanishes) == (1, 2.5)
    assert timed.areas[0].polygon.equals(shapely.box(0.4, 0.4, 0.6, 0.6))
    assert timed.fields == ((3.0, cg.RiskField([cg.Threat(0.5, 0.5, 0.1)])),)
    assert timed.events.tolist() == [0.0, 1.0, 2.0, 2.5, 3.0]
    ((times, points),) = ((one.times, one.points) for one in timed.others)
    assert (timed.separation, times.tolist(), points.tolist()) == (0.05, [0, 3], [[0.1, 0.9], [0.9, 0.9]])
    assert scenario_from_toml(PLANE, "mine").timed is None


def test_rasters_follow_each_other_by_the_hour(tmp_path: Path) -> None:
    for hour in range(2):
        np.save(tmp_path / f"{hour}.npy", np.full((2, 2), 0.1 + hour))
    raster = 'rasters = [{{file = "{}.npy", bounds = [0, 0, 1, 1]}}]\n'
    hours = f"speed = 1\n{raster.format(0)}[[hours]]\nsince = 2\n{raster.format(1)}"
    timed = scenario_from_toml(PLANE + hours, "mine", folder=tmp_path).timed
    assert timed is not None
    assert [float(timed.field_at(time).density((0.5, 0.5))) for time in (1.9, 2.0)] == pytest.approx([0.1, 1.1])


def test_on_a_map_in_degrees_tracks_are_degrees_and_the_rest_is_metres() -> None:
    text = """
    coordinates = "lonlat"
    bounds = [24.0, 60.0, 25.0, 61.0]
    start = [24.1, 60.5]
    goal = [24.9, 60.5]
    k = 1.0
    speed = 20.0
    moving = [{track = [[0, 24.1, 60.5], [600, 24.9, 60.5]], spread = 900.0}]
    timed_areas = [{polygon = [[24.4, 60.4], [24.6, 60.4], [24.6, 60.6], [24.4, 60.6]], appears = 60}]
    wind = {u = [[[1.0, 2.0]]], v = [[[0.0, 0.0]]]}
    """
    timed = scenario_from_toml(text, "mine").timed
    assert timed is not None
    (storm,) = timed.moving
    assert storm.track[0][1:] == pytest.approx(timed.start)
    assert storm.track[1][1:] == pytest.approx(timed.goal)
    assert 2.0e8 < timed.areas[0].polygon.area < 2.6e8
    assert timed.wind_at([timed.bounds[:2], timed.bounds[2:]], 0.0).tolist() == [[1.0, 0.0], [2.0, 0.0]]


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("wind = [1, 0]", "wind is there, but no speed"),
        ("moving = [{track = [[0, 0, 0]], spread = 0.1}]", "moving is there, but no speed"),
        ("speed = 0", "speed"),
        (
            "speed = 1\nmoving = [{track = [[1, 0, 0], [0, 0, 0]], spread = 0.1}]",
            "moving.0: track goes from time 1 to 0",
        ),
        ("speed = 1\nmoving = [{track = [[0, 0]], spread = 0.1}]", "moving.0.track.0"),
        ("speed = 1\ntimed_areas = [{appears = 1}]", "timed_areas.0: an area needs either polygon or geojson"),
        ("speed = 1\nwind = {u = [[[1]]], v = [[[1, 2]]]}", "wind: u has shape"),
        ("speed = 1\nwind = {u = [[[1]]], v = 'x'}", "mine.toml: wind.v: give a list (it is 'x'); cgla"),
        (
            "speed = 1\nwind = {u = [[[1]]], v = [[[1]]], tim = 0}",
            "mine.toml: wind.tim: unknown key; did you mean times?",
        ),
        ("speed = 1\nwind = [1]", "mine.toml: wind: give at least 2, not 1 (it is [1]); cgla"),
        (
            "speed = 1\nmoving = [{track = [[0, 0, 0]], spread = ['a']}]",
            "mine.toml: moving.0.spread.0: give a number (it is 'a'); cgla",
        ),
        ("speed = 1\ndeparture = [2, 1]", "its window ends before it begins"),
        ("speed = 1\nhours = [{since = 2}, {since = 1}]", "field 1 of fields begins at 1, not after 2"),
        ("speed = 1\nlatest = -1", "latest arrival is -1"),
    ],
)
def test_malformed_keys_are_refused_by_name(text: str, words: str) -> None:
    with pytest.raises(ScenarioError) as caught:
        scenario_from_toml(f"{PLANE}{text}\n", "mine", where="mine.toml")
    assert str(caught.value).startswith("mine.toml: ")
    assert words in str(caught.value)


def test_a_map_that_changes_is_not_planned_as_if_it_stood_still(tmp_path: Path) -> None:
    file = tmp_path / "storm.toml"
    file.write_text(PLANE + IN_TIME)
    scenario = cg.load_scenario(file)
    refusals = (
        lambda: open_one("certify", str(file)),
        lambda: cg.comparisons.Study([scenario], ["cgla"]),
        lambda: cg.write_scenario(scenario, tmp_path / "again.toml"),
    )
    for refused in refusals:
        with pytest.raises(CglaError, match="changes in time"):
            refused()


def test_zones_close_and_open_while_the_flight_is_under_way(tmp_path: Path) -> None:
    """At each moment, the areas that are closed are those that the zones of that moment close."""
    morning = {"permanent": "NO", "startDateTime": "2026-08-03T06:00:00Z", "endDateTime": "2026-08-03T08:30:00Z"}
    noons = {"permanent": "NO", "schedule": [{"day": ["MON"], "startTime": "11:00Z", "endTime": "12:00Z"}]}
    features = []
    for number, (identifier, period) in enumerate([("M", morning), ("N", noons), ("P", {"permanent": "YES"})]):
        x = 24.2 + 0.2 * number
        ring = shapely.get_coordinates(shapely.box(x - 0.05, 60.4, x + 0.05, 60.6)).tolist()
        shape = volume(horizontalProjection={"type": "Polygon", "coordinates": [ring]})
        features += ed269(shape, identifier=identifier, applicability=[period])["features"]
    file = tmp_path / "zones.json"
    file.write_bytes(data_of({"title": "zones", "features": features}))
    text = f"""
    coordinates = "lonlat"
    bounds = [24.0, 60.0, 25.0, 61.0]
    start = [24.1, 60.9]
    goal = [24.9, 60.9]
    k = 0.0
    speed = 20.0
    departure = [0, 36000]
    no_fly = {{zones = ["{file.name}"], at = "2026-08-03T06:00:00Z"}}
    """
    scenario = scenario_from_toml(text, "mine", folder=tmp_path)
    timed = scenario.timed
    assert timed is not None
    assert timed.still.no_fly is not None
    read = cg.read_zones(file)
    since = datetime(2026, 8, 3, 6, tzinfo=UTC)
    for second in (0, 60, 8000, 9000, 9002, 17_990, 18_000, 20_000, 21_650, 21_670, 40_000):
        closed = {one.zone.identifier for one in read.apply(at=since + timedelta(seconds=second)).closed}
        here = timed.slab_at(second).no_fly
        assert here is not None
        found = {
            name
            for name, x in (("M", 24.2), ("N", 24.4), ("P", 24.6))
            if shapely.contains_xy(here, *timed.projection.forward((x, 60.5)))  # type: ignore[union-attr]
        }
        assert found == closed, second
