"""Maps of zones: in scenario files, alone, and beside other maps; zones on the map are closed, none is lost."""

import json
from pathlib import Path

import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import few
from zone_files import circle, data_of, ed269, ed318, geojson, kml, kmz, volume

from cgla_graph.airspace.zones.shapes import circle_of
from cgla_graph.errors import MissionError, ScenarioError
from cgla_graph.model.earth import geodesic_length, project_area
from cgla_graph.scenarios.area_tables import NoFlyTable, simplified, with_files
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import mission_from_toml
from cgla_graph.scenarios.scenario import Scenario, load_scenario
from cgla_graph.solvers.solving import solve

START, GOAL = (5.9, 49.1), (6.3, 49.1)


def written(path: Path, document: object) -> Path:
    path.write_bytes(data_of(document))
    return path


def only(spec: Path, **how: object) -> Scenario:
    (scenario,) = open_scenarios(str(spec), **{"start": START, "goal": GOAL, **how})  # type: ignore[arg-type]
    return scenario


def toml(folder: Path, *lines: str) -> Path:
    path = folder / "mine.toml"
    top = f'coordinates = "lonlat"\nstart = {list(START)}\ngoal = {list(GOAL)}\nk = 1\n[no_fly]\n'
    path.write_text(top + "\n".join(lines), encoding="utf-8")
    return path


@pytest.mark.parametrize("name", ["zones.json", "zones.kml", "zones.txt", "zones"])
def test_a_file_of_zones_is_a_map_under_any_name(tmp_path: Path, name: str) -> None:
    for document in (ed269(), ed318(), kmz(kml())):
        scenario = only(written(tmp_path / name, document))
        assert scenario.zones is not None
        assert scenario.zones.count("closed") in {1, 2}
        assert solve(scenario.problem, "visibility-graph").status.has_path
        # two of the kinds of files are on one line, too
        more = only(tmp_path / name, no_fly=[written(tmp_path / "more.geojson", geojson())])
        assert more.zones is not None
        assert more.zones.count("closed") == scenario.zones.count("closed") + 1
        assert [name for name, _ in more.areas][-1] == "Castle"


def test_a_map_of_zones_is_about_the_journey(tmp_path: Path) -> None:
    """Zones up to twice the straight distance are on the map; the account lists the others as left out."""
    far = ed269(volume(horizontalProjection={"type": "Circle", "center": [20, 60], "radius": 5000}))
    scenario = only(written(tmp_path / "far.json", {"features": [*ed269()["features"], *far["features"]]}))
    assert scenario.zones is not None
    assert scenario.zones.summary() == "2 zones: 1 closed (1 PROHIBITED), 1 left out (1 outside the map)"
    length = geodesic_length(START, GOAL)
    x_min, y_min, x_max, y_max = scenario.problem.bounds
    assert max(-x_min, -y_min, x_max, y_max) < 2.0 * length
    ellipse = shapely.Point(0, 0).buffer(1.0)
    shape = shapely.transform(ellipse, lambda points: points * (length, 0.75**0.5 * length))
    assert shapely.box(x_min, y_min, x_max, y_max).contains(shape)
    with pytest.raises(ScenarioError, match="inside the no-fly area 'A-1"):
        only(tmp_path / "far.json", start=(6.01, 49.1))


def test_without_ends_a_map_is_around_the_closed_zones(tmp_path: Path) -> None:
    path = written(tmp_path / "zones.json", ed269())
    (scenario,) = open_scenarios(str(path))
    assert scenario.problem.no_fly is not None
    with pytest.raises(ScenarioError, match="none of its 1 zones is closed; give --start and --goal"):
        next(open_scenarios(str(path), zones={"treat": {"PROHIBITED": "open"}}))


def test_scenario_files_name_zones(tmp_path: Path) -> None:
    august = [{"permanent": "NO", "startDateTime": "2026-08-01T00:00Z"}]
    document = ed269(volume(lowerLimit=50, upperLimit=300, upperVerticalReference="AMSL"), applicability=august)
    written(tmp_path / "zones.json", document)
    at = "at = 2026-08-02T12:00:00+02:00"
    for lines, summary in {
        (): "1 zone: 1 closed (1 PROHIBITED)",
        ("altitude = 49",): "1 zone: 1 open (1 not at this altitude)",
        ('altitude = "301 AMSL"',): "1 zone: 1 open (1 not at this altitude)",
        ("altitude = 60", at): "1 zone: 1 closed (1 PROHIBITED)",
        ('at = "2026-07-31T12:00Z"',): "1 zone: 1 open (1 not at this time)",
        ('treat = { PROHIBITED = "open" }',): "1 zone: 1 open (1 PROHIBITED)",
    }.items():
        scenario = load_scenario(toml(tmp_path, 'zones = ["zones.json"]', *lines))
        assert scenario.zones is not None
        assert scenario.zones.summary() == summary
        assert (scenario.problem.no_fly is None) is ("closed" not in summary)
    # the command line comes before the file
    changed = only(toml(tmp_path, 'zones = ["zones.json"]', "altitude = 49"), zones={"altitude": "60 AGL"})
    assert changed.zones is not None
    assert changed.zones.count("closed") == 1


@pytest.mark.parametrize(
    ("lines", "said"),
    [
        (['zones = ["none.json"]'], "none.json: there is no such file"),
        (['zones = ["zones.json"]', 'altitude = "high"'], "altitude is 'high'"),
        (['zones = ["zones.json"]', "at = 2026-08-02T12:00:00"], "with its zone"),
        (['zones = ["zones.json"]', 'treat = { PROHIBITED = "maybe" }'], "no_fly.treat.PROHIBITED"),
        (['zones = ["zones.json"]', 'treat = { ALL = "open" }'], "treat has 'ALL'"),
        (['zones = ["zones.json"]', 'ground = "none.tif"'], "none.tif: there is no such file"),
        (['zones = ["wrong.json"]'], "wrong.json: zone 0 'A-1': restriction"),
    ],
)
def test_malformed_zones_are_refused(tmp_path: Path, lines: list[str], said: str) -> None:
    written(tmp_path / "zones.json", ed269())
    written(tmp_path / "wrong.json", ed269(restriction="MAYBE"))
    with pytest.raises(ScenarioError, match=said.replace(".", r"\.")) as caught:
        load_scenario(toml(tmp_path, *lines))
    assert "\n" not in str(caught.value)


def test_zones_need_a_map_in_degrees(tmp_path: Path) -> None:
    written(tmp_path / "zones.json", ed269())
    text = 'start = [0, 0]\ngoal = [1, 1]\nk = 1\n[no_fly]\nzones = ["zones.json"]'
    (tmp_path / "plane.toml").write_text(text, encoding="utf-8")
    with pytest.raises(ScenarioError, match='set coordinates = "lonlat"'):
        load_scenario(tmp_path / "plane.toml")


def test_files_beside_maps(tmp_path: Path) -> None:
    """GeoJSON stays what it was; with zones beside it, it is accounted for, too."""
    areas, zones = written(tmp_path / "a.geojson", geojson()), written(tmp_path / "z.json", ed269())
    plain = with_files(NoFlyTable(geojson=["own.geojson"]), [areas], {"altitude": 100})
    assert (plain.geojson, plain.zones) == (["own.geojson", str(areas)], [])
    both = with_files(NoFlyTable(geojson=["own.geojson"]), [zones], {"altitude": 100})
    assert (both.geojson, both.zones, both.altitude) == ([], ["own.geojson", str(zones)], 100)


@few
@given(
    longitude=st.sampled_from([6.0, 179.9, -179.95, 0.0]),
    latitude=st.sampled_from([0.0, 60.0, -75.0]),
    places=st.lists(st.tuples(st.floats(-4, 4), st.floats(-2, 2), st.floats(100, 40_000)), min_size=1, max_size=6),
)
def test_zones_on_the_map_are_closed(
    tmp_path_factory: pytest.TempPathFactory,
    longitude: float,
    latitude: float,
    places: list[tuple[float, float, float]],
) -> None:
    """Cut off outside of it, at any turn of longitude: against the circles themselves, projected whole."""

    def east(by: float) -> float:
        return (longitude + by + 180.0) % 360.0 - 180.0

    circles = [([east(dx), latitude + dy], radius) for dx, dy, radius in places]
    document = ed318({"type": "GeometryCollection", "geometries": [circle(x, y, radius) for (x, y), radius in circles]})
    path = written(tmp_path_factory.getbasetemp() / "circles.json", document)
    how = {"start": (east(-0.5), latitude), "goal": (east(0.5), latitude)}
    try:
        (scenario,) = open_scenarios(str(path), **how)  # type: ignore[arg-type]
    except ScenarioError as error:
        assert "inside the no-fly area" in str(error)  # noqa: PT017 - an end may be in a circle
        return
    projection = scenario.projection
    assert projection is not None
    box = shapely.box(*scenario.problem.bounds)
    whole = shapely.union_all([project_area(circle_of(*one, "", ("", "")), projection) for one in circles])
    no_fly = scenario.problem.no_fly
    seen = shapely.Polygon() if no_fly is None else shapely.union_all(shapely.get_parts(no_fly))
    difference = shapely.symmetric_difference(whole, seen).intersection(box)
    # (within a metre of edges that bend)
    assert difference.area <= 2.0 * (whole.length + 1.0)
    json.dumps(scenario.zones.document() if scenario.zones else {}, allow_nan=False)


LOW = ed269(volume(upperLimit=50))
MISSION = """
coordinates = "lonlat"
bounds = [5.8, 48.9, 6.5, 49.3]
detection_radius = 9000
step = 900
[no_fly]
zones = ["zones.json"]
altitude = 80
"""


def test_a_flight_takes_off_and_lands_outside_of_zones_below_it(tmp_path: Path) -> None:
    """At the start and the goal, zones count from the ground to the altitude of the flight: by any way to a map."""
    path = written(tmp_path / "zones.json", LOW)
    inside, at = (6.02, 49.1), {"altitude": 80}
    for ends, way in ({"start": inside}, "take-off"), ({"goal": inside}, "landing"):
        ((name, _),) = ends.items()
        said = rf"{name} \(6\.02, 49\.1\): {way} between the ground and 80 m AGL goes through .*'A-1 \(Castle\)'"
        for spec in (path, toml(tmp_path, 'zones = ["zones.json"]')):
            with pytest.raises(ScenarioError, match=rf"{said} of zones\.json, 0 m AGL to 50 m AGL; move it"):
                only(spec, zones=at, **ends)
            # above the ceiling by less than the vertical clearance, it is closed at the altitude of the flight
            with pytest.raises(ScenarioError, match="inside the no-fly area"):
                only(spec, zones={**at, "vertical_clearance": 30}, **ends)
            assert only(spec, zones={**at, "treat": {"PROHIBITED": "open"}}, **ends).zones is not None
        near = {**ends, name: (5.99, 49.1)}
        assert only(path, zones=at, clearance=700, **near).columns is not None
        with pytest.raises(ScenarioError, match=r"is 73\d\.\d+ m from .*, and the clearance is 800 m"):
            only(path, zones=at, clearance=800, **near)
    # the flight crosses it, and the account says where zones count
    over = only(path, zones=at)
    assert over.problem.no_fly is None or over.problem.no_fly.is_empty
    assert over.zones is not None
    assert over.zones.rule == (
        "horizontal, from zones closed at 80 m AGL, and from the ground up to it at take-off and landing; "
        "vertical clearance 0 m"
    )
    wide = toml(tmp_path, 'zones = ["zones.json"]', "altitude = 80", "vertical_clearance = 30")
    assert only(wide).zones.document()["vertical_clearance"] == 30.0  # type: ignore[union-attr]
    with pytest.raises(ScenarioError, match="vertical_clearance"):
        only(toml(tmp_path, 'zones = ["zones.json"]', "vertical_clearance = -1"))
    with pytest.raises(ScenarioError, match="altitude is -5 m above ground"):
        only(path, zones={"altitude": -5})
    with pytest.raises(ScenarioError, match="zones have no setting 'hight'; give some of altitude, at"):
        only(path, zones={"hight": 80})
    # the ends of a map without any are outside
    low = written(tmp_path / "two.json", {"features": [*LOW["features"], *ed269(volume(lowerLimit=60))["features"]]})
    (scenario,) = open_scenarios(str(low), zones=at)
    assert scenario.columns is not None
    assert len(scenario.columns.low) == 1


def test_uavs_take_off_and_land_outside_of_zones_below_them(tmp_path: Path) -> None:
    written(tmp_path / "zones.json", LOW)
    uav = '[[uavs]]\nname = "a"\nstart = [{}, 49.1]\ngoal = [6.4, 49.1]\n'
    random = "[random_uavs]\ncount = 40\nseed = 1\napart = 0\n"
    with pytest.raises(MissionError, match=r"UAV a: start \(6\.02, 49\.1\): take-off between the ground and 80 m AGL"):
        mission_from_toml(MISSION + uav.format(6.02), "mine", folder=tmp_path)
    near = MISSION + uav.format(5.99)
    assert mission_from_toml(near, "mine", folder=tmp_path, clearance=700).variants
    with pytest.raises(MissionError, match="the clearance is 800 m"):
        mission_from_toml(near, "mine", folder=tmp_path, clearance=800)
    high, low = (
        mission_from_toml(MISSION.replace("80", str(altitude)) + random, "mine", folder=tmp_path)
        for altitude in (80, 40)
    )
    castle = project_area(shapely.box(6.0, 49.0, 6.2, 49.2), high.projection)  # type: ignore[arg-type]
    hole = project_area(shapely.Polygon([(6.05, 49.05), (6.15, 49.05), (6.15, 49.15)]), high.projection)  # type: ignore[arg-type]
    for mission in (high, low):
        ends = [end for one in mission.variants[""].uavs for end in (one.start, one.goal)]
        assert not any(castle.difference(hole).contains(shapely.Point(end)) for end in ends)


# (it fails where an end is not looked at)
@pytest.mark.parametrize("ends", [[], [(0.0, 1000.0 + 1e-9)]])
def test_areas_get_few_corners_unless_that_closes_an_end(ends: list[tuple[float, float]]) -> None:
    area = shapely.Point(0.0, 0.0).buffer(1000.0, quad_segs=5000)
    found, beyond = simplified(area, (-1e5, -1e5, 1e5, 1e5), ends, 0.0)
    assert (found is area, beyond == 0.0) == (bool(ends), bool(ends))
