"""`cgla check` and `cgla_graph.check`: legs of plans against zones, risk and scenarios, and proven brackets."""

import dataclasses
import itertools
import json
import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from command_line import Answer, Call

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.formats import write_plan
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint
from cgla_graph.airspace.plan_check import bracket
from cgla_graph.errors import CglaError
from cgla_graph.model.earth import LocalProjection, geodesic_length
from cgla_graph.scenarios.scenario import load_scenario

BOX = [[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]
#: Its waypoints are outside the area, and its leg crosses it.
STRAIGHT = "longitude,latitude\n24.7,60.12\n25.2,60.15\n"
AROUND = "longitude,latitude\n24.7,60.12\n24.8,60.095\n25.1,60.095\n25.2,60.15\n"
RASTER = "ncols 3\nnrows 2\nxllcorner 0\nyllcorner 0\ncellsize 10\nNODATA_value -9999\n1 2 3\n4 5 6\n"
TOML = """
bounds = [0, 0, 10, 10]
start = [1, 1]
goal = [9, 9]
k = 2
threats = [{ x = 5, y = 5, spread = 1 }]
[no_fly]
polygons = [[[2, 4], [3, 4], [3, 9], [2, 9]], [[6, 1], [8, 1], [8, 2], [6, 2]]]
"""


ZONE = {"type": "Feature", "properties": {"name": "the bay"}, "geometry": {"type": "Polygon", "coordinates": [BOX]}}
FILES = {
    "bay.geojson": json.dumps(ZONE),
    "straight.csv": STRAIGHT,
    "around.csv": AROUND,
    "risk.asc": RASTER,
    "mine.toml": TOML,
}


def lines_of(answer: Answer) -> dict[str, str]:
    return {line[:10].strip(): line[11:] for line in answer.out.splitlines() if not line.startswith(("│", "┃"))}


def write_route(name: str, *places: tuple[float, float]) -> None:
    Path(name).write_text("\n".join(["x,y", *(f"{x},{y}" for x, y in places)]) + "\n", encoding="utf-8")


def test_a_leg_that_crosses_is_reported_with_its_place(cgla: Call, tmp_path: Path) -> None:
    answer = cgla("check", "straight.csv", "--zones", "bay.geojson", "--out", "out")
    assert answer.code == 1
    said = lines_of(answer)
    assert said["verdict"] == "not clean: 1 leg crosses 1 area"
    for words in (
        "leg 1 is 16791.8 m inside the bay",
        "24.800000,60.1261",
        "25.100000,60.1441",
        "5601.40 to 22393.2 m",
    ):
        assert words in said["crossing"]
    assert [path.name for path in (tmp_path / "out").iterdir()] == ["straight-check.png"]
    found = cgla("check", "straight.csv", "bay.geojson", "--json").document()
    (one,) = found["crossings"]
    assert (one["leg"], one["area"], found["clean"]) == (1, "the bay", False)
    places = one["entry_lonlat"], one["exit_lonlat"]
    assert geodesic_length(*map(tuple, places)) == pytest.approx(one["inside"], rel=1e-6)
    assert one["along"][1] - one["along"][0] == pytest.approx(one["inside"])
    assert found["zones"]["straight"]["closed"] == 1


@pytest.mark.slow
def test_a_plan_of_ours_is_clean_and_close_to_the_best(cgla: Call) -> None:
    """A path that touches corners of zones is clean after its degrees are rounded in a file."""
    ends = ("--start", "24.7,60.12", "--goal", "25.2,60.15", "--no-certificate")
    for kind in ("plan", "gpx"):
        more = ("--solver", "visibility-graph", *([] if kind == "plan" else ["--clearance", 30]))
        cgla("plan", "bay.geojson", *ends, *more, "--export", f"mine.{kind}", "--altitude", 80)
        over = ["--acceptance-radius", 0] if kind == "plan" else []
        answer = cgla("check", f"mine.{kind}", "--zones", "bay.geojson", *more[2:], *over, "--json")
        assert answer.code == 0, answer.out
        found = answer.document()
        assert (found["clean"], found["crossings"]) == (True, [])
        assert 0.0 <= found["best"]["gap"] < 0.01
        assert found["best"]["lower_bound"] <= found["cost"] == found["length"]
    said = lines_of(cgla("check", "mine.plan", "bay.geojson", "--acceptance-radius", 0))
    assert "within a rounding" in said["verdict"]
    # autopilots cut corners
    cut = cgla("check", "mine.plan", "bay.geojson")
    assert (cut.code, "10 m, PX4's default" in cut.out) == (1, True)
    assert "where the corner before is cut" in lines_of(cut)["verdict"]
    # the bay has neither floor nor ceiling
    assert "note" not in said
    assert "--altitude" in lines_of(cgla("check", "around.csv", "bay.geojson"))["note"]


def test_the_bound_is_one_for_all_paths(cgla: Call) -> None:
    """The map is made around the plan; paths that leave it are longer than the bound."""
    detour = FlightPlan.along([(24.7, 60.12), (24.6, 60.5), (25.2, 60.15)])
    for plan in (detour, "around.csv"):
        found = cg.check(plan, zones="bay.geojson")
        assert found.is_clean
        assert found.best is not None
        # the shortest way, around the southern corners
        projection = LocalProjection.between((24.7, 60.12), (25.2, 60.15))
        corners = projection.forward([(24.7, 60.12), (24.8, 60.1), (25.1, 60.1), (25.2, 60.15)])
        best = float(np.hypot(*np.diff(corners, axis=0).T).sum())
        assert 0.99 * best < found.best.lower_bound <= best + 1.0
        assert found.cost >= found.best.lower_bound


@pytest.mark.slow
def test_detours_outside_the_map_around_the_plan_are_allowed(cgla: Call, tmp_path: Path) -> None:
    """A wall divides the map around the plan; the detour around its end, far outside, costs at least the bound."""
    wall = shapely.box(24.94, 59.5, 24.96, 60.3)
    (tmp_path / "wall.geojson").write_text(shapely.to_geojson(wall), encoding="utf-8")
    (tmp_path / "short.csv").write_text("lon,lat\n24.9,60.15\n25.0,60.15\n", encoding="utf-8")
    found = cgla("check", "short.csv", "wall.geojson", "--json").document()
    around = [(24.9, 60.15), (24.94, 60.3), (24.96, 60.3), (25.0, 60.15)]
    length = math.fsum(geodesic_length(one, other) for one, other in itertools.pairwise(around))
    best = found["best"]
    assert 0.7 * length < best["lower_bound"] <= length <= best["upper_bound"] + 1.0
    # for a detour too long to prove, the bound is the length to the rim of the map and back
    wall = shapely.box(24.94, 50.0, 24.96, 70.0)
    (tmp_path / "wall.geojson").write_text(shapely.to_geojson(wall), encoding="utf-8")
    found = cgla("check", "short.csv", "wall.geojson", "--json").document()
    assert found["length"] < found["best"]["lower_bound"] < 300_000.0
    assert found["best"]["upper_bound"] is None


def test_areas_of_many_corners_are_bracketed_in_time(cgla: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """Larger and smaller areas with few corners give a bracket that holds for the areas themselves."""
    checked = cg.check("around.csv", zones="bay.geojson")
    exact, on = checked.best, checked.on
    monkeypatch.setattr(bracket, "MOST_CORNERS", 3)
    coarse = cg.check("around.csv", zones="bay.geojson").best
    assert exact is not None
    assert coarse is not None
    assert coarse.lower_bound <= exact.upper_bound
    assert coarse.lower_bound == pytest.approx(exact.lower_bound, rel=0.01)
    assert exact.lower_bound <= coarse.upper_bound == pytest.approx(exact.upper_bound, rel=0.01)
    assert exact.upper_bound < coarse.upper_bound
    assert on.problem.evaluate(coarse.path).feasible
    assert on.problem.evaluate(coarse.path).cost == coarse.upper_bound
    bay = on.areas[0].shape
    inner, outer = (bracket._simple(bay, sign * 20.0, 20.0) for sign in (-1.0, 1.0))
    assert shapely.covers(bay, inner)
    assert shapely.covers(outer, bay)
    assert len(outer.exterior.coords) < 30


def test_lengths_risks_and_costs_are_the_oracle_s(cgla: Call) -> None:
    places = [(1.0, 1.0), (1.0, 9.5), (4.0, 9.5), (5.0, 6.0), (9.0, 9.0)]
    write_route("mine.csv", *places)
    answer = cgla("check", "mine.csv", "mine.toml", "--k", 3, "--json")
    assert answer.code == 0
    found = answer.document()
    problem = load_scenario("mine.toml").problem
    judged = problem.evaluate(places)
    assert found["k"] == 3.0
    assert (found["length"], found["risk"]) == pytest.approx((judged.length, judged.risk))
    assert found["cost"] == pytest.approx(judged.length + 3.0 * judged.risk)
    assert found["clearance"] == judged.clearance
    for leg, (start, end) in zip(found["legs"], itertools.pairwise(places), strict=True):
        one = problem.evaluate([start, end])
        assert (leg["length"], leg["risk"], leg["clearance"]) == pytest.approx((one.length, one.risk, one.clearance))
    bound = cg.lower_bound(problem).lower_bound
    assert found["best"]["lower_bound"] == pytest.approx(bound, rel=0.1)


def test_all_faults_are_reported(cgla: Call) -> None:
    write_route("mine.csv", (1, 1), (1, 5), (7, 5), (7, 1.5), (7, 12), (1, 0.5), (5.9, 1.5), (5.9, 1.2))
    answer = cgla("check", "mine.csv", "mine.toml", "--clearance", 0.5)
    assert answer.code == 1
    found = cgla("check", "mine.csv", "mine.toml", "--clearance", 0.5, "--json").document()
    assert [leg["leg"] for leg in found["legs"] if leg["crosses"]] == [2, 3, 4, 5]
    assert [leg["leg"] for leg in found["legs"] if leg["leaves_map"]] == [4, 5]
    assert [leg["leg"] for leg in found["legs"] if leg["too_near"] and not leg["crosses"]] == [6, 7]
    assert {one["area"] for one in found["crossings"]} == {"no-fly area 0", "no-fly area 1"}
    assert found["best"] is None
    assert "as every plan" in found["no_best"]
    said = "; ".join(found["verdict"])
    for words in ("4 legs cross 2 areas", "2 legs leave the map", "2 legs come nearer"):
        assert words in said


def test_plans_that_begin_inside_return_home_or_circle(cgla: Call, tmp_path: Path) -> None:
    inside = FlightPlan((Waypoint(24.9, 60.15), Waypoint(25.2, 60.15), Waypoint(25.2, 60.3)))
    write_plan(inside, tmp_path / "inside.csv")
    answer = cgla("check", "inside.csv", "bay.geojson", "--out", "out")
    assert answer.code == 1
    assert "begins inside the bay" in lines_of(answer)["best"]
    # home is on the other side: the leg from home to the first waypoint counts
    home = FlightPlan((Waypoint(25.2, 60.15), Waypoint(25.2, 60.3)), Home(24.7, 60.15))
    write_plan(home, tmp_path / "home.csv")
    found = cgla("check", "home.csv", "bay.geojson", "--json", "--no-certificate").document()
    assert [(leg["from"], leg["to"], leg["crosses"]) for leg in found["legs"]] == [
        ("home", "1", True),
        ("1", "2", False),
    ]
    circle = FlightPlan((Waypoint(24.7, 60.15), Waypoint(24.79, 60.15, loiter_radius=900.0), Waypoint(24.7, 60.3)))
    write_plan(circle, tmp_path / "circle.csv")
    found = cgla("check", "circle.csv", "bay.geojson", "--json", "--no-certificate").document()
    # leg 2 leaves the circle along a tangent, which may begin inside of the area
    assert found["verdict"] == [
        "not clean: 1 circle reaches into an area",
        "not clean: 1 leg may reach into an area beside the straight line",
    ]
    assert [(one["waypoint"], one["leg"]) for one in found["crossings"]] == [("2", None), (None, 2)]


def test_curves_and_round_trips_are_reported(cgla: Call) -> None:
    item = {"type": "SimpleItem", "frame": 3, "autoContinue": True}
    params = ([0, 0, 0, None, 60.3, x, 50] for x in (24.7, 24.8))
    items = [{**item, "command": command, "params": one} for command, one in zip((16, 82), params, strict=True)]
    mission = {"version": 2, "items": items, "plannedHomePosition": [60.3, 24.7, 0], "firmwareType": 12}
    text = json.dumps({"fileType": "Plan", "version": 1, "mission": mission})
    Path("spline.plan").write_text(text, encoding="utf-8")
    answer = cgla("check", "spline.plan", "bay.geojson")
    assert answer.code == 1
    assert "spline" in lines_of(answer)["verdict"]
    Path("loop.csv").write_text("lon,lat\n24.7,60.3\n24.8,60.3\n24.8,60.4\n24.7,60.3\n", encoding="utf-8")
    answer = cgla("check", "loop.csv", "bay.geojson")
    assert answer.code == 0
    assert "where it begins" in lines_of(answer)["best"]


def test_risk_on_a_raster_is_shown_and_counts_with_k(cgla: Call) -> None:
    write_route("mine.csv", (5, 5), (25, 15))
    free, weighed = (
        cgla("check", "mine.csv", "--risk", "risk.asc", *more, "--json").document() for more in ((), ("--k", 2))
    )
    assert free["risk"] == weighed["risk"] > 0.0
    assert free["cost"] == free["length"]
    assert weighed["cost"] == pytest.approx(weighed["length"] + 2.0 * weighed["risk"])


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["straight.csv"], ("--zones", "--risk")),
        (["none.plan", "bay.geojson"], ("none.plan",)),
        (["bay.geojson", "bay.geojson"], ("bay.geojson", "waypoint")),
        (["straight.csv", "paper"], ("degrees", "plane")),
        (["straight.csv", "--zones", "straight.csv"], ("straight.csv", "formats")),
        (["straight.csv", "mine.toml", "paper"], ("one map", "paper")),
        (["straight.csv", "--risk", "bay.geojson"], ("--risk", ".tif")),
        (["straight.csv", "bay.geojson", "--tolerance", "-1"], ("tolerance",)),
        (["straight.csv", "bay.geojson", "--clearance", "nan"], ("clearance",)),
        (["straight.csv", "bay.geojson", "--bounds", "1,2,3,4"], ("--bounds",)),
        (["straight.csv", "--at", "2026-08-01T12:00Z", "paper"], ("--at", "zones")),
    ],
)
def test_wrong_input_is_refused_in_one_line(cgla: Call, words: list[str], said: tuple[str, ...]) -> None:
    cgla("check", *words).refused(*said)


@pytest.mark.parametrize(
    ("words", "on", "more"),
    [
        ("straight.csv --zones bay.geojson", None, {"zones": "bay.geojson"}),
        ("around.csv bay.geojson --altitude 80 --clearance 30", None, {"altitude": 80, "clearance": 30}),
        (
            "mine.csv mine.toml --k 3 --tolerance 0.05 --through 1",
            "mine.toml",
            {"k": 3, "tolerance": 0.05, "through": 1},
        ),
        ("mine.csv mine.toml --no-certificate", "mine.toml", {"tolerance": None}),
    ],
)
def test_the_command_prints_what_python_answers(cgla: Call, words: str, on: str | None, more: dict[str, Any]) -> None:
    write_route("mine.csv", (1, 1), (1, 9.5), (9, 9))
    found = cgla("check", *words.split(), "--json").document()
    zones = {} if on else {"zones": ["bay.geojson"]}
    answer = cg.check(
        words.split(maxsplit=1)[0], None if on is None else load_scenario(on), **{**zones, **more}
    ).document()
    for one in (found, answer):
        (one["best"] or {}).pop("seconds", None)
    assert found == {**json.loads(json.dumps(answer)), "files": []}


def test_what_a_plan_leaves_open_is_given_on_the_command_line(cgla: Call) -> None:
    item = {"type": "SimpleItem", "frame": 3, "autoContinue": True}
    commands = (16, [0, 0, 0, None, 60.3, 24.8, 50]), (19, [9, 0, 0, None, 60.3, 24.7, 50]), (20, [0] * 7)
    items = [{**item, "command": command, "params": params} for command, params in commands]
    mission = {"version": 2, "items": items, "plannedHomePosition": [0, 0, 0], "firmwareType": 12}
    Path("open.plan").write_text(json.dumps({"fileType": "Plan", "version": 1, "mission": mission}), encoding="utf-8")
    words = ["check", "open.plan", "bay.geojson", "--no-certificate"]
    answer = cgla(*words)
    assert answer.code == 1
    verdict = " ".join(lines_of(answer)["verdict"].split())
    for said in ("home is not set", "--home LON,LAT", "--loiter-radius M"):
        assert said in verdict
    given = ["--home", "24.7,60.4", "--loiter-radius", 0, "--return-altitude", 70]
    known = cgla(*words, *given)
    assert known.code == 0
    assert "70 m above home, as given" in known.out
    same = cg.check(
        "open.plan", zones="bay.geojson", tolerance=None, home=(24.7, 60.4), loiter_radius=0.0, return_altitude=70.0
    )
    assert cgla(*words, *given, "--json").document()["legs"] == json.loads(json.dumps(same.document()))["legs"]
    cgla(*words, "--home", "24.7").refused("home", "longitude and latitude")


def test_waypoints_and_zones_as_objects_are_checked(cgla: Call) -> None:
    """The result is the same as from files; waypoints are in the plane if the map is."""
    zones = cg.read_zones("bay.geojson")
    found = cg.check([(24.7, 60.12), (25.2, 60.15)], zones=zones, tolerance=None)
    of_file = cg.check("straight.csv", zones="bay.geojson", tolerance=None)
    assert {**found.document(), "plan": "", "map": ""}.keys() == of_file.document().keys()
    assert found.crossings.found == of_file.crossings.found
    (leg,) = found.legs
    assert (leg.number, leg.start, leg.end, leg.crosses, leg.is_clean) == (1, "1", "2", True, False)
    scenario = load_scenario("mine.toml")
    for on in (scenario, scenario.problem):
        assert cg.check([(1, 1), (9, 9)], on, tolerance=None).plan.coordinates == "plane"
    for wrong, said in (([], "shape"), ([(1, 2, 3)], "plan"), ([(1, math.nan)], "plan")):
        with pytest.raises(CglaError, match=said):
            cg.check(wrong, scenario)
    with pytest.raises(CglaError, match="zones"):
        cg.check([(1, 1), (9, 9)], scenario, altitude=80)
    with pytest.raises(CglaError, match="nothing to check"):
        cg.check("straight.csv")


def test_long_plans_are_checked_in_time(cgla: Call) -> None:
    """The plan has a thousand legs, most of which cross."""
    angles = np.linspace(0.0, 2.0 * math.pi, 1001)
    places = np.column_stack([24.95 + 0.3 * np.cos(301.0 * angles), 60.15 + 0.1 * np.sin(301.0 * angles)])
    plan = FlightPlan(tuple(Waypoint(x, y) for x, y in places.tolist()))
    found = cg.check(plan, zones="bay.geojson", tolerance=None)
    assert len(found.crossings.legs) > 500


@pytest.mark.slow
def test_plans_through_the_same_waypoints_are_bounded(cgla: Call) -> None:
    """The bound is a sum over legs: all of a zigzag without risk; with risk, as much as is proven."""
    zigzag = [(0.5, 0.5), (1.5, 9.5), (1.8, 0.5), (4.5, 0.5), (4.5, 9.5), (9.5, 0.2)]
    write_route("mine.csv", *zigzag)
    found = cgla("check", "mine.csv", "mine.toml", "--k", 0, "--json").document()
    assert found["clean"]
    bound = found["through"]
    assert bound["lower_bound"] == pytest.approx(found["length"], rel=1e-12)
    assert (bound["legs"], bound["proven"], bound["wanting"]) == (5, 0, 0)
    assert bound["lower_bound"] > 2.0 * found["best"]["lower_bound"]
    # with the risk in the middle, some legs are proven, and more so with more of them
    problem = load_scenario("mine.toml").problem
    bounds = {}
    for most in (1, 16):
        found = cgla("check", "mine.csv", "mine.toml", "--through", most, "--json").document()
        bounds[most] = found["through"]["lower_bound"]
        assert found["through"]["proven"] <= most
        assert (found["through"]["wanting"] > 0) is (most == 1)
    assert found["length"] < bounds[1] < bounds[16] <= found["cost"]
    legs = [cg.lower_bound(dataclasses.replace(problem, start=a, goal=b), 0.3) for a, b in itertools.pairwise(zigzag)]
    assert 0.9 * sum(one.lower_bound for one in legs) < bounds[16] <= sum(one.upper_bound for one in legs)
    # the bound of a leg that crosses an area is the way around it; a waypoint inside has no bound
    write_route("mine.csv", (1, 5), (4, 5), (4, 1))
    found = cgla("check", "mine.csv", "mine.toml", "--k", 0, "--json").document()
    around = 2.0 * math.sqrt(2.0) + 1.0 + 4.0
    assert 0.99 * around < found["through"]["lower_bound"] <= around
    write_route("mine.csv", (1, 5), (2.5, 5), (4, 1))
    found = cgla("check", "mine.csv", "mine.toml", "--json").document()
    assert found["through"]["message"] == "waypoint 2 is inside an area"
    cgla("check", "mine.csv", "mine.toml", "--through", -1).refused("through", "0 or more")
