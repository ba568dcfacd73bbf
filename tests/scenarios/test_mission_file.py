"""Mission files: content, shipped missions, and error messages."""

import dataclasses
import inspect
import json
import math
import tomllib
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any, get_args

import numpy as np
import pytest
import shapely
from command_line import Call, caller
from hypothesis import given
from hypothesis import strategies as st
from zone_files import data_of, ed269, volume

from cgla_graph.errors import MissionError, UnknownSolverError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import TimedArea, TimedThreat
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.mission_file import (
    MissionFile,
    is_mission_file,
    load_mission,
    mission_from_toml,
    mission_schema,
    shipped_missions,
)
from cgla_graph.scenarios.mission_tables import FlySettings, MissionTable, VariantTable
from cgla_graph.scenarios.scenario import ScenarioTable, load_scenario, shipped
from cgla_graph.scenarios.shipped import shipped_mission
from cgla_graph.solvers import get

UAV = 'uavs = [{ name = "a", start = [0.1, 0.1], goal = [0.9, 0.9] }]\n'
BASE = f"detection_radius = 0.2\n{UAV}"
LONLAT = (
    'coordinates = "lonlat"\nbounds = [24.0, 60.0, 25.0, 61.0]\ndetection_radius = 20000.0\n'
    'uavs = [{ name = "a", start = [24.1, 60.1], goal = [24.9, 60.9] }]\n'
)
RANDOM = "detection_radius = 0.2\n[random_uavs]\ncount = 12\nseed = 3\nleast_length = 0.4\nclear = 0.2\n"
PAPER_GOAL = (0.9, 0.9)

unit = st.floats(0.0, 1.0)
points = st.tuples(unit, unit)
positive = st.floats(1e-3, 10.0)


def missions_of(text: str) -> dict[str, Mission]:
    return mission_from_toml(text, "mine").missions(get)


def mission_of(text: str) -> Mission:
    (mission,) = missions_of(text).values()
    return mission


def message_of(text: str) -> str:
    with pytest.raises(MissionError) as caught:
        mission_from_toml(text, "mine", where="some/mine.toml").missions(get)
    message = str(caught.value)
    assert message.startswith("some/mine.toml: ")
    assert "\n" not in message
    assert isinstance(caught.value, ValueError)
    return message


def ends(file: MissionFile) -> set[tuple[Any, ...]]:
    return {(uav.start, uav.goal) for variant in file.variants.values() for uav in variant.uavs}


# shipped missions


@pytest.mark.parametrize("name", shipped_missions())
def test_shipped_missions_build_and_fit_the_schema(name: str) -> None:
    file = load_mission(name)
    assert (file.name, bool(file.title), bool(file.notes)) == (name, True, True)
    missions = file.missions(get)
    assert missions.keys() == file.variants.keys()
    assert all(mission.world is file.world for mission in missions.values())
    text = shipped_mission(name)
    table = tomllib.loads(text)
    MissionTable.model_validate(table)
    assert set(table) <= set(mission_schema()["properties"])
    assert (name in shipped(), is_mission_file(name)) == (False, True), "a name is a mission's or a scenario's"
    # the comment separates the paper's choices from ours, and names the selection of the paper's map
    comment = " ".join(line.removeprefix("# ") for line in text.splitlines() if line.startswith("#"))
    assert "ours" in comment.lower()
    assert "paper" in comment.lower()
    assert table.get("scenario") != "paper" or "selected" in comment


@pytest.mark.parametrize("name", [name for name in shipped_missions() if name.startswith("fig")])
def test_figures_have_the_papers_lattice_and_step(name: str) -> None:
    for mission in load_mission(name).missions(get).values():
        assert mission.lattice == Lattice(20, bounds=(0, 0, 1, 1), kind="upper")
        assert [mission.step_of(uav) for uav in mission.uavs] == pytest.approx([0.02] * len(mission.uavs))
        assert {uav.safe_distance / uav.detection_radius > 0.1 for uav in mission.uavs} == {True}


@pytest.mark.parametrize(
    ("name", "expected"),
    [
        ("fig5", {"starts": [(0.1, 0.1)], "k": [10.0, 50.0, 200.0]}),
        ("fig6", {"k": [10.0, 100.0]}),
        ("fig7", {"stepnum": [0, 3, 5]}),
        ("fig8", {"starts": [(0.1, 0.1), (0.1, 0.25)], "stepnum": [None, 3], "collisions": ["record", "record"]}),
        ("fig9", {"sharing": [False, True]}),
        ("fig10", {"starts": [(0.1, 0.1), (0.15, 0.45), (0.225, 0.7)], "k": [10.0]}),
        ("fig12-five", {"threats": 5, "uavs": [2]}),
        ("fig12-seven", {"threats": 7, "uavs": [2]}),
        ("swarm", {"threats": 60, "uavs": [20], "lattice": (20, 20)}),
    ],
)
def test_shipped_missions_are_the_papers(name: str, expected: dict[str, Any]) -> None:
    file = load_mission(name)
    missions = list(file.missions(get).values())
    rules = [mission.virtual_obstacle for mission in missions]
    facts = {
        "starts": [uav.start for uav in missions[0].uavs],
        "k": [weight for mission in missions for weight in {uav.k for uav in mission.uavs}],
        "stepnum": [None if rule is None else rule.stepnum for rule in rules],
        "collisions": [mission.collisions for mission in missions],
        "sharing": [mission.sharing.is_on for mission in missions],
        "threats": len(file.world.field),
        "uavs": [len(mission.uavs) for mission in missions],
        "lattice": file.lattice.shape,
    }
    assert {key: facts[key] for key in expected} == expected
    assert {rule.zones for rule in rules if rule} <= {"two"}
    if "starts" in expected or name == "fig6":
        assert {goal for _, goal in ends(file)} == {PAPER_GOAL}
        assert {start for start, _ in ends(file)} == {uav.start for uav in missions[0].uavs}


def test_threats_of_the_figures_are_the_papers() -> None:
    assert load_mission("fig5").world.field == load_scenario("paper").problem.field
    (popup,) = load_mission("fig6").world.timed
    assert isinstance(popup, TimedThreat)
    assert (popup.threat.x, popup.threat.y, popup.appears > 0) == (0.6, 0.5, True)
    assert {(0.6, 0.7), (0.7, 0.8)} <= {(threat.x, threat.y) for threat in load_mission("fig9").world.field.threats}
    five, seven = (load_mission(f"fig12-{number}").world.field.threats for number in ("five", "seven"))
    assert seven[:5] == five


def test_the_area_of_finland_pops_up_in_metres() -> None:
    file = load_mission("finland-popup")
    (area,) = file.world.timed
    assert isinstance(area, TimedArea)
    assert area.appears > 0
    assert file.projection is not None
    west, south, east, north = area.polygon.bounds
    assert 1e3 < east - west < 1e5
    assert 1e3 < north - south < 1e5


def test_figures_come_first_and_in_order() -> None:
    names = shipped_missions()
    figures = [name for name in names if name.startswith("fig")]
    assert figures == ["fig4", "fig5", "fig6", "fig7", "fig8", "fig9", "fig10", "fig12-five", "fig12-seven"]
    assert names[: len(figures)] == figures


# flights of the shipped missions


@cache
def flights_of(name: str) -> dict[str, Flight]:
    return {variant: mission.fly() for variant, mission in load_mission(name).missions(get).items()}


@pytest.mark.slow
@pytest.mark.parametrize("name", shipped_missions())
def test_shipped_missions_fly_to_their_end(name: str) -> None:
    for variant, flight in flights_of(name).items():
        # one of them is there to show how a mission can fail
        locked = (name, variant) == ("swap", "virtual obstacles")
        assert {uav.status.label for uav in flight.uavs.values()} == {"livelock" if locked else "arrived"}
        assert (flight.livelock is not None) == locked
        if flight.mission.avoidance == "prioritized":
            assert flight.least_separation >= max(uav.safe_distance for uav in flight.mission.uavs)


def test_swap_shows_a_livelock_of_period_two() -> None:
    livelock = flights_of("swap")["virtual obstacles"].livelock
    assert livelock is not None
    assert livelock.period == 2


def test_fig4_shows_what_sharing_tells_who_has_just_taken_off() -> None:
    learned = {
        variant: [(event.tick, event.uav, event.detail["source"]) for event in flight.events if event.kind == "learned"]
        for variant, flight in flights_of("fig4").items()
    }
    assert learned["with sharing"][0] == (0, "left", "right")
    assert learned["without sharing"] == []


def test_fig5_shows_the_order_of_risks_and_the_passage_of_little_k() -> None:
    flights = [flight.uavs["a"] for flight in flights_of("fig5").values()]
    assert flights[0].risk_sum > flights[1].risk_sum > flights[2].risk_sum
    assert flights[0].length < flights[2].length < flights[1].length, "as in Table 1"
    for region in [(0.5, 0.5), (0.8, 0.8)]:
        nearest = [float(np.hypot(*(flight.trace - region).T).min()) for flight in flights]
        assert nearest[0] < 0.05
        assert min(nearest[1:]) > 0.1


def test_fig6_shows_that_much_k_escapes_farther_and_safer() -> None:
    little, much = (flight.uavs["a"] for flight in flights_of("fig6").values())
    assert little.length < much.length
    assert little.risk > much.risk
    for flight in flights_of("fig6").values():
        seen = [(event.tick, event.detail["threat"]) for event in flight.events if event.kind == "detected"]
        assert (1, len(flight.mission.world.field)) in seen, "the sudden threat is seen as soon as it is there"


@pytest.mark.slow
def test_fig7_shows_that_three_steps_ahead_are_best() -> None:
    distances = [flight.least_separation for flight in flights_of("fig7").values()]
    collision = next(iter(flights_of("fig7").values())).mission.collision_distance
    assert [distance < collision for distance in distances] == [True, False, True]


def test_fig8_shows_a_near_miss_and_its_cure() -> None:
    without, having = flights_of("fig8").values()
    (pair,) = without.separations
    assert pair.distance == pytest.approx(0.01, abs=0.005)
    assert pair.where == pytest.approx((0.55, 0.71), abs=0.02)
    assert math.dist(pair.where, (0.5, 0.7)) < 0.06, "the paper: near (0.5, 0.7)"
    assert having.least_separation > 3.0 * having.mission.collision_distance
    assert "collision" in {event.kind for event in without.events}
    assert "collision" not in {event.kind for event in having.events}


def test_fig9_shows_that_sharing_pays() -> None:
    without, sharing = flights_of("fig9").values()
    assert sharing.uavs["a"].length < 0.95 * without.uavs["a"].length
    assert sharing.uavs["a"].risk < 0.5 * without.uavs["a"].risk
    assert sharing.uavs["b"].length == pytest.approx(without.uavs["b"].length)
    wall = [load_mission("fig9").world.field.threats.index(Threat(x, y, 0.05)) for x, y in [(0.6, 0.7), (0.7, 0.8)]]
    learned = {event.detail["threat"] for event in sharing.events if (event.kind, event.uav) == ("learned", "a")}
    assert learned.issuperset(wall)


def test_finland_shows_an_area_that_one_detects_and_both_avoid() -> None:
    (flight,) = flights_of("finland-popup").values()
    (area,) = flight.mission.world.timed
    assert isinstance(area, TimedArea)
    about = [(event.kind, event.uav) for event in flight.events if event.detail.get("area") == 0]
    assert about == [("detected", "westbound"), ("learned", "eastbound")]
    for uav in flight.uavs.values():
        assert not shapely.LineString(uav.path).intersects(area.polygon.buffer(-1.0))
    without = dataclasses.replace(flight.mission, world=dataclasses.replace(flight.mission.world, timed=())).fly()
    assert all(shapely.LineString(uav.path).intersects(area.polygon) for uav in without.uavs.values())


# content of a file


@given(
    starts=st.lists(points, min_size=1, max_size=4, unique=True),
    goal=points,
    radius=positive,
    k=st.floats(0.0, 1e6),
    threats=st.lists(st.tuples(unit, unit, positive, st.floats(1e-6, 1.0)), max_size=4),
    appears=st.integers(0, 1000),
)
def test_what_is_written_is_what_is_read(
    starts: list[tuple[float, float]],
    goal: tuple[float, float],
    radius: float,
    k: float,
    threats: list[tuple[float, float, float, float]],
    appears: int,
) -> None:
    lines = [f"{{ x = {x!r}, y = {y!r}, spread = {spread!r}, peak = {peak!r} }}" for x, y, spread, peak in threats]
    timed = [line.replace(" }", f", appears = {appears} }}") for line in lines]
    uavs = [f'{{ name = "{i}", start = {list(start)}, goal = {list(goal)} }}' for i, start in enumerate(starts)]
    text = (
        f"detection_radius = {radius!r}\nk = {k!r}\nthreats = [{', '.join(lines)}]\n"
        f"timed_threats = [{', '.join(timed)}]\nuavs = [{', '.join(uavs)}]\n"
    )
    file = mission_from_toml(text, "mine")
    field = RiskField([Threat(x, y, spread=spread, peak=peak) for x, y, spread, peak in threats])
    assert file.world.field == field
    assert file.world.timed == tuple(TimedThreat(threat, appears=appears) for threat in field.threats)
    expected = [Uav(str(i), start, goal, detection_radius=radius, k=k) for i, start in enumerate(starts)]
    assert list(file.variants[""].uavs) == expected


def test_every_setting_of_a_mission_can_be_written_and_arrives() -> None:
    values: dict[str, Any] = {
        "sharing": "none",
        "virtual_obstacle": True,
        "avoidance": "none",
        "fusion": "max_integral",
        "integral": "raster",
        "knowledge": "all",
        "replan": "tick",
        "exclude": "all",
        "movement": "vertex",
        "start": "snapped",
        "update": "sequential",
        "arrival_radius": 0.01,
        "collision_distance": 0.02,
        "collisions": "record",
        "terminal_radius": 0.03,
        "max_ticks": 77,
        "incremental": False,
        "clearance": 0.015,
    }
    assert values.keys() | {"solver"} == FlySettings.model_fields.keys()
    lines = [f"{name} = {json.dumps(value)}" for name, value in values.items()]
    mission = mission_of(f'{BASE}[fly]\nsolver = "dijkstra"\n' + "\n".join(lines))
    kept = values | {"sharing": Sharing(is_on=False), "virtual_obstacle": VirtualObstacle()}
    assert {name: getattr(mission, name) for name in values} == kept
    assert mission.solver == get("dijkstra")


def test_settings_of_the_file_are_the_missions_with_its_defaults() -> None:
    smallest = mission_of(BASE)
    assert smallest.uavs == (Uav("a", (0.1, 0.1), PAPER_GOAL, 0.2),)
    assert (smallest.solver, smallest.virtual_obstacle, smallest.lattice.shape) == (get("cgla"), None, (20, 20))
    parameters = inspect.signature(Mission).parameters
    assert list(parameters) == [field.name for field in dataclasses.fields(Mission)]
    assert FlySettings.model_fields.keys() == parameters.keys() - {"world", "uavs", "resolution"}
    for name, info in FlySettings.model_fields.items():
        default = parameters[name].default
        if name not in {"solver", "virtual_obstacle"}:
            assert info.default == default, name
        if isinstance(default, str):
            written = {word for part in (info.annotation, *get_args(info.annotation)) for word in _words(part)}
            assert default in written, name


def _words(annotation: Any) -> Iterator[str]:  # noqa: ANN401 - any type form
    for part in get_args(annotation):
        if isinstance(part, str):
            yield part
        else:
            yield from _words(part)


def test_tables_of_sharing_and_virtual_obstacles() -> None:
    mission = mission_of(
        f"{BASE}[fly]\nsharing = {{ radius = 0.3, delay = 2, loss = 0.25, seed = 7 }}\n"
        'virtual_obstacle = { stepnum = 5, spread = 0.03, peak = 0.5, placement = "add", zones = "near" }'
    )
    assert mission.sharing == Sharing(radius=0.3, delay=2, loss=0.25, seed=7)
    assert mission.virtual_obstacle == VirtualObstacle(5, spread=0.03, peak=0.5, placement="add", zones="near")
    part = mission_of(f"{BASE}[fly]\nsharing = {{}}\nvirtual_obstacle = {{ stepnum = 0 }}")
    assert (part.sharing, part.virtual_obstacle) == (Sharing(), VirtualObstacle(stepnum=0))


def test_uavs_take_what_they_do_not_set_from_the_top() -> None:
    text = (
        "detection_radius = 0.3\nk = 4\nstep = 0.01\nsafe_distance = 0.05\n"
        '[[uavs]]\nname = "a"\nstart = [0, 0]\ngoal = [1, 1]\n'
        '[[uavs]]\nname = "b"\nstart = [1, 0]\ngoal = [0, 1]\n'
        "detection_radius = 0.4\nk = 5\nstep = 0.02\nsafe_distance = 0.06\ndeparts = 9\n"
    )
    assert mission_of(text).uavs == (
        Uav("a", (0, 0), (1, 1), 0.3, step=0.01, k=4, safe_distance=0.05),
        Uav("b", (1, 0), (0, 1), 0.4, step=0.02, k=5, safe_distance=0.06, departs=9),
    )


def test_a_scenario_brings_the_map_and_its_k() -> None:
    scenario = load_scenario("fifty-threats")
    file = mission_from_toml(f'scenario = "fifty-threats"\n{BASE}', "mine")
    assert file.world.field == scenario.problem.field
    assert (file.world.bounds, file.lattice) == (scenario.problem.bounds, scenario.lattice)
    assert file.variants[""].uavs[0].k == scenario.problem.k
    other = mission_from_toml(f'scenario = "fifty-threats"\nk = 3\n{BASE}[lattice]\nresolution = 7', "mine")
    assert (other.variants[""].uavs[0].k, other.lattice.shape) == (3.0, (7, 7))


def test_a_clearance_is_of_the_mission_of_a_variant_or_of_the_scenario(tmp_path: Path) -> None:
    ring = "[[0.4, 0.4], [0.6, 0.4], [0.5, 0.6]]"
    scenario = f"start = [0, 0]\ngoal = [1, 1]\nk = 1\nclearance = 0.03\nno_fly.polygons = [{ring}]"
    (tmp_path / "map.toml").write_text(scenario, encoding="utf-8")
    given = f'scenario = "map.toml"\n{BASE}'
    variants = "[[variants]]\nname = 'as it is'\n[[variants]]\nname = 'near'\nclearance = 0.0\n"
    for text, kept in (
        (f"{BASE}{variants}", [0.0, 0.0]),
        (f"{given}{variants}", [0.03, 0.0]),
        (f"{given}[fly]\nclearance = 0.02\n{variants}", [0.02, 0.0]),
    ):
        file = mission_from_toml(text, "mine", folder=tmp_path)
        assert [mission.clearance for mission in file.missions(get).values()] == kept
        other = mission_from_toml(text, "mine", folder=tmp_path, clearance=0.01)
        assert [mission.clearance for mission in other.missions(get).values()] == [0.01, 0.01]
    with pytest.raises(MissionError, match="clearance is -1; it must be at least 0"):
        load_mission("fig8", clearance=-1.0)


@pytest.mark.parametrize("brought", [False, True])
def test_in_degrees_a_clearance_is_metres_and_counts_zones_beyond_the_map(tmp_path: Path, brought: bool) -> None:
    """A zone is 5 km north of the map, and 16 km from the goal."""
    zone = {"type": "Circle", "center": [24.9, 61.05], "radius": 1000}
    (tmp_path / "zones.json").write_bytes(data_of(ed269(volume(horizontalProjection=zone))))
    text = f'{LONLAT}[no_fly]\nzones = ["zones.json"]\n'
    if brought:
        top = 'coordinates = "lonlat"\nbounds = [24.0, 60.0, 25.0, 61.0]\nk = 1\n'
        ends = 'start = [24.1, 60.1]\ngoal = [24.9, 60.5]\n[no_fly]\nzones = ["zones.json"]\n'
        (tmp_path / "map.toml").write_text(top + ends, encoding="utf-8")
        text = 'scenario = "map.toml"\n' + "\n".join(LONLAT.splitlines()[2:])
    file = mission_from_toml(text, "mine", folder=tmp_path, clearance=10_000.0)
    assert file.missions(get)[""].clearance == 10_000.0
    with pytest.raises(MissionError, match=r"UAV a: goal .* from the no-fly area, and the clearance is 20000"):
        mission_from_toml(text, "mine", folder=tmp_path, clearance=20_000.0).missions(get)


def test_a_scenario_may_be_a_file_beside_the_mission(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "maps").mkdir()
    scenario = "start = [1, 1]\ngoal = [3, 3]\nk = 6\nbounds = [0, 0, 4, 4]\nthreats = [{ x = 2, y = 2, spread = 0.5 }]"
    (tmp_path / "maps" / "my.toml").write_text(scenario, encoding="utf-8")
    (tmp_path / "mine.toml").write_text(f'scenario = "maps/my.toml"\n{BASE}', encoding="utf-8")
    (tmp_path / "elsewhere").mkdir()
    monkeypatch.chdir(tmp_path / "elsewhere")
    file = load_mission(tmp_path / "mine.toml")
    assert (file.name, file.world.bounds, file.variants[""].uavs[0].k) == ("mine", (0, 0, 4, 4), 6.0)


def test_no_fly_areas_timed_areas_and_threats_that_move() -> None:
    ring = "[[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]"
    text = (
        f"{BASE}timed_threats = [{{ x = 0.5, y = 0.5, spread = 0.1, moves = [[4, 0.6, 0.5], [8, 1, 1]] }}]\n"
        f"timed_areas = [{{ polygon = {ring}, appears = 3, vanishes = 9 }}]\n[no_fly]\npolygons = [{ring}]"
    )
    world = mission_from_toml(text, "mine").world
    threat, timed = world.timed
    assert threat == TimedThreat(Threat(0.5, 0.5, spread=0.1), moves=[(4, 0.6, 0.5), (8, 1.0, 1.0)])
    assert isinstance(timed, TimedArea)
    assert (timed.appears, timed.vanishes) == (3, 9)
    assert timed.polygon.area == pytest.approx(0.04)
    assert world.no_fly is not None
    assert world.no_fly.area == pytest.approx(0.04)


# degrees


def test_degrees_become_metres(tmp_path: Path) -> None:
    (tmp_path / "area.geojson").write_text(shapely.to_geojson(shapely.box(24.4, 60.4, 24.6, 60.6)), encoding="utf-8")
    text = (
        f"{LONLAT}timed_threats = [{{ x = 24.2, y = 60.2, spread = 500, moves = [[5, 24.3, 60.3]] }}]\n"
        'timed_areas = [{ geojson = "area.geojson", appears = 2 }]\n'
    )
    file = mission_from_toml(text, "mine", folder=tmp_path)
    projection = file.projection
    assert isinstance(projection, LocalProjection)
    uav = file.variants[""].uavs[0]
    np.testing.assert_allclose(projection.inverse([uav.start, uav.goal]), [(24.1, 60.1), (24.9, 60.9)], atol=1e-9)
    assert (uav.detection_radius, uav.safe_distance) == (20000.0, 10000.0)
    threat, area = file.world.timed
    assert isinstance(threat, TimedThreat)
    assert isinstance(area, TimedArea)
    places = [(threat.threat.x, threat.threat.y), threat.moves[0][1:]]
    np.testing.assert_allclose(projection.inverse(places), [(24.2, 60.2), (24.3, 60.3)], atol=1e-9)
    assert threat.threat.spread == 500.0
    assert area.polygon.area == pytest.approx(11.05e3 * 22.28e3, rel=0.01)
    (mission,) = file.missions(get).values()
    assert mission.unit == pytest.approx(55.8e3 / 20, rel=0.02)


# random UAVs


def test_random_uavs_are_the_same_every_time_and_keep_their_distances() -> None:
    places = "[[threats]]\nx = 0.5\ny = 0.5\nspread = 0.05\n[[timed_threats]]\nx = 0.2\ny = 0.8\nspread = 0.05\n"
    text = RANDOM + places
    file = mission_from_toml(text, "mine")
    uavs = file.variants[""].uavs
    assert mission_from_toml(text, "mine").variants[""].uavs == uavs
    assert mission_from_toml(text.replace("seed = 3", "seed = 4"), "mine").variants[""].uavs != uavs
    assert [uav.name for uav in uavs[:2]] == ["u01", "u02"]
    assert len(uavs) == 12
    for number, uav in enumerate(uavs):
        assert math.dist(uav.start, uav.goal) >= 0.4
        assert min(math.dist(end, at) for end in (uav.start, uav.goal) for at in [(0.5, 0.5), (0.2, 0.8)]) >= 0.2
        for other in uavs[:number]:
            assert math.dist(uav.start, other.start) >= 0.1
            assert math.dist(uav.goal, other.goal) >= 0.1
    file.missions(get)


@given(seed=st.integers(0, 2**32), apart=st.floats(0.0, 0.2), count=st.integers(1, 8))
def test_random_uavs_keep_apart_from_those_written_and_outside_areas(seed: int, apart: float, count: int) -> None:
    ring = "[[0.0, 0.5], [1.0, 0.5], [1.0, 1.0], [0.0, 1.0]]"
    text = (
        f"detection_radius = 0.02\nuavs = [{{ name = 'a', start = [0.1, 0.1], goal = [0.4, 0.1] }}]\n"
        f"timed_areas = [{{ polygon = {ring}, appears = 5 }}]\n"
        f"[random_uavs]\ncount = {count}\nseed = {seed}\napart = {apart!r}\n"
    )
    first, *drawn = mission_from_toml(text, "mine").variants[""].uavs
    assert len(drawn) == count
    for uav in drawn:
        assert max(uav.start[1], uav.goal[1]) < 0.5
        assert math.dist(uav.start, first.start) >= apart
        assert math.dist(uav.goal, first.goal) >= apart


@given(seed=st.integers(0, 2**32), clearance=st.floats(0.0, 0.2))
def test_random_uavs_keep_the_greatest_clearance(seed: int, clearance: float) -> None:
    text = (
        "detection_radius = 0.02\nno_fly.polygons = [[[0.4, 0.4], [0.6, 0.4], [0.6, 0.6], [0.4, 0.6]]]\n"
        f"random_uavs = {{ count = 5, seed = {seed} }}\n"
        f"[[variants]]\nname = 'near'\n[[variants]]\nname = 'far'\nclearance = {clearance!r}"
    )
    file = mission_from_toml(text, "mine")
    assert [mission.clearance for mission in file.missions(get).values()] == [0.0, clearance]
    assert file.variants["near"].uavs == file.variants["far"].uavs
    # one that no variant has counts for nothing
    plain, _, _ = text.partition("[[variants]]")
    without, overridden = (mission_from_toml(one, "mine", clearance=0.0) for one in (plain, text))
    assert without.variants[""].uavs == overridden.variants["far"].uavs


def test_random_threats_keep_clear_of_every_uav() -> None:
    text = (
        "detection_radius = 0.2\nuavs = [{ name = 'a', start = [0.2, 0.2], goal = [0.8, 0.8] },"
        "{ name = 'b', start = [0.8, 0.2], goal = [0.2, 0.8] }]\n"
        "[random_threats]\ncount = 50\nseed = 1\nspread = [0.01, 0.02]\nclear = 0.25\n"
    )
    corners = [(0.2, 0.2), (0.8, 0.8), (0.8, 0.2), (0.2, 0.8)]
    threats = mission_from_toml(text, "mine").world.field.threats
    assert min(math.dist((threat.x, threat.y), corner) for threat in threats for corner in corners) >= 0.25


# variants


def test_variants_override_the_file_and_its_uavs() -> None:
    text = (
        "k = 7\ndetection_radius = 0.2\n"
        'uavs = [{ name = "a", start = [0.1, 0.1], goal = [0.9, 0.9], k = 8, step = 0.03 }]\n'
        '[fly]\nsharing = "none"\nmax_ticks = 50\nvirtual_obstacle = { stepnum = 2, spread = 0.5 }\n'
        '[[variants]]\nname = "as it is"\n'
        '[[variants]]\nname = "other"\nk = 9\ndetection_radius = 0.4\nsharing = "global"\nvirtual_obstacle = true\n'
        '[[variants]]\nname = "slow"\nstep = 0.01\nsafe_distance = 0.05\nsolver = "straight-line"\n'
    )
    plain, other, slow = missions_of(text).values()
    assert plain.uavs == (Uav("a", (0.1, 0.1), PAPER_GOAL, 0.2, step=0.03, k=8),)
    assert (plain.sharing.is_on, plain.max_ticks, plain.virtual_obstacle) == (False, 50, VirtualObstacle(2, spread=0.5))
    assert other.uavs == (Uav("a", (0.1, 0.1), PAPER_GOAL, 0.4, step=0.03, k=9),), "SD follows OR"
    assert (other.sharing, other.max_ticks, other.virtual_obstacle) == (Sharing(), 50, VirtualObstacle())
    assert slow.uavs == (Uav("a", (0.1, 0.1), PAPER_GOAL, 0.2, step=0.01, k=8, safe_distance=0.05),)
    assert (plain.solver, slow.solver) == (get("cgla"), get("straight-line"))


def test_a_solver_given_replaces_those_of_the_file() -> None:
    asked = []

    def build(text: str) -> Any:  # noqa: ANN401 - any solver
        asked.append(text)
        return get("dijkstra")

    file = mission_from_toml(f'{BASE}[fly]\nsolver = "cgla:schedule=synchronous"', "mine")
    file.missions(build)
    file.missions(build, solver="hybrid:seed=4")
    assert asked == ["cgla:schedule=synchronous", "hybrid:seed=4"]
    with pytest.raises(UnknownSolverError):
        file.missions(get, solver="cglaa")


# mistakes


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("detection_radius = 0.2", ["at least one UAV", "[[uavs]]", "[random_uavs]"]),
        (UAV, ["UAV a", "detection_radius", "needed", "top of the file"]),
        (BASE.replace('name = "a", ', ""), ["uavs.0.name", "needed", "cgla missions --schema"]),
        (BASE.replace("goal", "gaol"), ["uavs.0.gaol", "did you mean goal?"]),
        (BASE.replace('"a"', '" "'), ["name", "give a text"]),
        (BASE.replace("0.2", "0.0"), ["detection_radius", "0.0", "greater than 0"]),
        (f"safe_distance = 0.2\n{BASE}", ["UAV a", "safe_distance", "0.2", "not below"]),
        (BASE.replace('"a"', '"a", departs = 1.5'), ["uavs.0.departs", "1.5", "whole number"]),
        (BASE.replace("0.1, 0.1", "1.1, 0.1"), ["UAV a", "start", "outside the bounds"]),
        (LONLAT.replace("24.9, 60.9", "26.5, 60.9"), ["uavs.0.goal", "26.5", "bounds", "move it"]),
        (BASE.replace("]\n", ', { name = "a", start = [0.5, 0.1], goal = [0.9, 0.9] }]\n'), ["two UAVs", "'a'"]),
        (f'scenario = "papre"\n{BASE}', ["scenario", "papre", "did you mean paper"]),
        (f'scenario = "none.toml"\n{BASE}', ["scenario", "none.toml", "no such file"]),
        (f'scenario = "some.map"\n{BASE}', ["scenario", "some.map", "shipped", ".toml"]),
        (f'scenario = "paper"\nbounds = [0, 0, 1, 1]\n{BASE}', ["bounds", "brings the map", "leave out"]),
        (f"{BASE}threats = [{{ x = 0.5, y = 0.5 }}]", ["spread", "sigma"]),
        (f"{BASE}timed_threats = [{{ x = 0.5, y = 0.5 }}]", ["timed_threats.0", "spread", "sigma"]),
        (f"{BASE}timed_threats = [{{ x = 0, y = 0, spread = 1, moves = [[3.5, 0, 0]] }}]", ["timed_threats.0", "3.5"]),
        (f"{BASE}timed_threats = [{{ x = 0, y = 0, spread = 1, peak = 2 }}]", ["timed_threats.0", "peak 2"]),
        (f"{BASE}timed_areas = [{{ appears = 3 }}]", ["timed_areas.0", "polygon", "geojson"]),
        (f"{BASE}timed_areas = [{{ polygon = [[0, 0], [1, 1], [1, 0], [0, 1]] }}]", ["timed_areas.0", "intersection"]),
        (f'{BASE}timed_areas = [{{ geojson = "x.geojson" }}]', ["timed_areas.0", "x.geojson", "lonlat"]),
        (f'{LONLAT}timed_areas = [{{ geojson = "x.geojson" }}]', ["timed_areas.0", "x.geojson", "no such file"]),
        (f"{RANDOM}apart = 1.4", ["random_uavs", "no room for UAV 2 of 12", "lower"]),
        (f"{BASE}[fly]\nsharing = 'some'", ["fly.sharing:", "some", "none", "global", "--schema"]),
        (f"{BASE}[fly]\nvirtual_obstacle = 3", ["fly.virtual_obstacle:", "3", "true or false"]),
        (f"{BASE}[fly]\nclearance = -0.1", ["fly.clearance", "-0.1", "at least 0"]),
        (f"{BASE}[fly]\nsolver = 'cglaa'", ["solver", "cglaa", "did you mean cgla"]),
        (f"{BASE}[[variants]]\nname = 'x'\n[[variants]]\nname = 'x'", ["variants.1.name", "two variants", "'x'"]),
        (f"{BASE}[[variants]]\nname = 'x'\nsafe_distance = 0.3", ["variant 'x'", "UAV a", "safe_distance"]),
        (f"{BASE}[[variants]]\nname = 'x'\nsolver = 'zzz'", ["variant 'x'", "solver", "zzz"]),
        (f'{BASE}[[variants]]\nname = "x\\ny"', ["variants.0.name", "one line", "x\\ny"]),
        (BASE.replace('"a"', '"\\u001b[31m"'), ["uavs.0.name", "one line", "x1b"]),
        (f'title = """two\nlines"""\n{BASE}', ["title", "one line"]),
        (f"fly = [1]\n{BASE}", ["fly: give a table", "[1]", "--schema"]),
        (f'scenario = ""\n{BASE}', ["scenario is ''", "shipped scenario"]),
        (LONLAT.replace("24.0, 60.0, 25.0", "24.0, 60.0, 24.0"), ["bounds", "empty", "west != east"]),
        ("uavs = [", ["not TOML"]),
    ],
)
def test_mistakes_are_named(text: str, words: list[str]) -> None:
    message = message_of(text)
    assert not [word for word in words if word not in message], message


REFUSED = """
    k = -1 | step = -1 | treats = [] | random_uavs.prefix = "u\\t"
    fly.sharing.loss = 1.0 | fly.sharing.delay = -1 | fly.sharing.radios = 3.0 | fly.sharig = "none"
    fly.avoidance = "best"
    fly.virtual_obstacle.stepnum = -1 | fly.virtual_obstacle.stepnums = 1 | fly.max_ticks = 0
    fly.clearance = inf | fly.clearance = "far" | fly.clearence = 1
    random_uavs.count = 0 | random_uavs.sed = 3
    timed_threats = [{ x = 0, y = 0, spread = 1, apears = 3 }]
    timed_threats = [{ x = 0, y = 0, spread = 1, appears = -3 }]
    timed_areas = [{ polygon = [[0, 0], [1, 1]] }] | variants = [{ k = 1 }] | variants = [{ name = "x", stepnum = 3 }]
"""


@pytest.mark.parametrize("line", [line.strip() for line in REFUSED.replace("|", "\n").strip().splitlines()])
def test_values_and_keys_that_are_refused_are_named(line: str) -> None:
    assert message_of(f"{line}\n{BASE}").startswith(f"some/mine.toml: {line.partition(' ')[0]}")


@pytest.mark.parametrize(
    "name", ["\U0001f468\u200d\u2708\ufe0f", "<b>&amp;", "a\u00a0b", "../x", "$x^2$", "[red]:rocket:", "日本"]
)
def test_any_name_of_one_line_will_do(name: str) -> None:
    text = BASE.replace('"a"', f'"{name}"')
    file = mission_from_toml(f'title = "{name}"\n{text}[[variants]]\nname = "{name}"', "mine")
    assert (file.title, file.full_title) == (name, f"mine: {name}")
    assert {key: [uav.name for uav in one.uavs] for key, one in file.variants.items()} == {name: [name]}


def test_a_fault_of_the_scenario_names_its_file(tmp_path: Path) -> None:
    (tmp_path / "map.toml").write_text("start = [0, 0]\ngoal = [1, 1]\nk = 1\ntreats = []", encoding="utf-8")
    (tmp_path / "mine.toml").write_text(f'scenario = "map.toml"\n{BASE}', encoding="utf-8")
    with pytest.raises(MissionError, match=r"mine\.toml: scenario: .*map\.toml: treats: unknown key; did you mean"):
        load_mission(tmp_path / "mine.toml")
    (tmp_path / "map.toml").write_text(
        "start = [0, 0]\ngoal = [1, 1]\nk = 1\nthreats = [{ x = 0, y = 0, spread = 1, peak = 2 }]", encoding="utf-8"
    )
    with pytest.raises(MissionError, match=r"mine\.toml: scenario 'map\.toml': threat 0"):
        load_mission(tmp_path / "mine.toml")


@pytest.mark.parametrize(
    ("name", "message"),
    [
        *((name, r"^unknown mission .*\.toml") for name in ("fgi8", "zzz", "", "paper")),
        ("paper", "it is a scenario"),
        ("none.toml", r"^none\.toml: there is no such file"),
    ],
)
def test_a_mission_that_is_not_there(name: str, message: str) -> None:
    with pytest.raises(MissionError, match=message):
        load_mission(name)


# the schema, and recognition of missions


def test_schema_is_plain_json_and_refuses_unknown_keys() -> None:
    document = mission_schema()
    assert json.loads(json.dumps(document)) == document
    assert document["additionalProperties"] is False
    assert all(table["additionalProperties"] is False for table in document["$defs"].values())
    assert document["$defs"]["VariantTable"]["properties"].keys() == VariantTable.model_fields.keys()
    described = document["$defs"]["FlySettings"]["properties"]["sharing"]
    assert "global" in json.dumps(described)
    assert "SharingTable" in json.dumps(described)


def test_missions_are_recognised_by_their_content(tmp_path: Path) -> None:
    texts = [BASE, RANDOM, "[[uavs]]\nname = 'malformed'", "start = [0, 0]\ngoal = [1, 1]\nk = 1", "uavs = [", ""]
    texts.append("speed = 1\n[[uavs]]\nname = 'of a team'")
    for number, text in enumerate(texts):
        (tmp_path / "mine.toml").write_text(text, encoding="utf-8")
        assert is_mission_file(tmp_path / "mine.toml") is (number < 3)
    assert not any(map(is_mission_file, (tmp_path / "none.toml", tmp_path, "mine.geojson", *shipped())))
    assert not ScenarioTable.model_fields.keys() >= MissionTable.model_fields.keys()


# the command line


@pytest.fixture
def cgla(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]) -> Call:
    return caller(tmp_path, monkeypatch, capfd)


def test_the_command_lists_missions(cgla: Call) -> None:
    answer = cgla("missions")
    assert max(map(len, answer.out.splitlines())) <= 80
    assert answer.code == 0
    assert all(name in answer.out for name in shipped_missions())
    lines = cgla("missions", "--json").document()["missions"]
    assert [line["name"] for line in lines] == shipped_missions()
    assert {line["name"]: line["variants"] for line in lines}["fig7"] == ["stepnum = 0", "stepnum = 3", "stepnum = 5"]
    assert {line["name"]: line["uavs"] for line in lines}["swarm"] == 20
    assert cgla("missions", "--schema").document() == mission_schema()
    assert cgla("missions", "--show", "fig8").out == shipped_mission("fig8")
    cgla("missions", "--show", "fgi8").refused("fgi8", "fig8")


def test_a_uav_may_have_a_colour_and_no_other_word_is_one() -> None:
    (uav,) = mission_of(BASE.replace('"a"', '"a", colour = "#Aa1122"')).uavs
    assert uav.colour == "#Aa1122"
    with pytest.raises(MissionError, match=r"colour.*red"):
        mission_of(BASE.replace('"a"', '"a", colour = "red"'))
    with pytest.raises(MissionError, match=r"'#12345'.*six hexadecimal digits"):
        Uav("a", (0, 0), (1, 1), 0.4, colour="#12345")
