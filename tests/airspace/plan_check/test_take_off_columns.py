"""Take-off and landing, where zones count from the ground up to the altitude of the flight; vertical clearances."""

import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import shapely
from hypothesis import assume, example, given
from hypothesis import strategies as st
from pyproj import Transformer
from strategies import usual
from zone_files import data_of, ed269, volume

import cgla_graph as cg
from cgla_graph.airspace.flight_plans.plan import FlightPlan, Home, Waypoint
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.ground import Ground
from cgla_graph.airspace.zones.zone import Layer, Limit, Zone
from cgla_graph.errors import CglaError, FileFormatError, ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem

#: The ground is at 300 m everywhere.
FLAT = Ground(np.full((60, 60), 300.0), (5.7, 48.7, 6.5, 49.5))
#: An independent projection of the places here, metres.
METRES = Transformer.from_crs(4326, "+proj=aeqd +lat_0=49.1 +lon_0=6.1", always_xy=True)
INSIDE, OUTSIDE = (6.1, 49.1), (6.3, 49.1)
BOX = shapely.box(6.0, 49.0, 6.2, 49.2)


def of_layers(*layers: tuple[float, str, float, str], area: shapely.Polygon = BOX, kind: str = "PROHIBITED") -> Zones:
    made = (Layer(area, Limit(low, below), Limit(high, above)) for low, below, high, above in layers)  # type: ignore[arg-type]
    return Zones((Zone("A", "", kind, tuple(made)),))


#: Flat ground, on which heights of 0 m are allowed, and no proof.
OVER_FLAT: Any = {"ground": FLAT, "terrain_clearance": 0.0, "tolerance": None}


def flown(*places: tuple[float, float], altitude: float | None = None) -> FlightPlan:
    return FlightPlan(tuple(Waypoint(x, y, altitude, "ground") for x, y in places))


@pytest.mark.parametrize(
    ("layer", "altitude", "clean"),
    [
        ((0, "AGL", 50, "AGL"), 80, False),
        ((0, "AGL", 50, "AGL"), "380 AMSL", False),
        ((60, "AGL", 70, "AGL"), 80, False),
        ((79, "AGL", 79.5, "AGL"), 80, False),
        # above the flight
        ((80.5, "AGL", 120, "AGL"), 80, True),
        ((400, "AMSL", 500, "AMSL"), 80, True),
        ((370, "AMSL", 375, "AMSL"), 80, False),
        # on the ground alone, and below it
        ((0, "AGL", 0, "AGL"), 80, False),
        ((-20, "AGL", 10, "AGL"), 80, False),
        ((-20, "AGL", -1, "AGL"), 80, True),
        ((0, "AMSL", 250, "AMSL"), 80, True),
        ((0, "AMSL", 300, "AMSL"), 80, False),
        # on the ground, nothing is above
        ((1, "AGL", 50, "AGL"), 0, True),
        ((0, "AGL", 50, "AGL"), 0, False),
    ],
)
def test_a_column_is_held_against_every_layer_below_the_flight(
    layer: tuple[float, str, float, str], altitude: str | float, clean: bool
) -> None:
    zones = of_layers(layer)
    for places in ((INSIDE, OUTSIDE), (OUTSIDE, INSIDE)):
        found = cg.check(flown(*places), zones=zones, altitude=altitude, **OVER_FLAT)
        assert found.is_clean is clean
        assert cg.check(places, zones=zones, altitude=altitude, **OVER_FLAT).is_clean is clean
        closed = zones.apply(altitude=altitude, ground=FLAT, ends=places).account().count("closed")
        assert closed == (not clean)
    # from one side to the other, only a layer at the altitude of the flight is met
    over = cg.check([(5.9, 49.1), OUTSIDE], zones=zones, altitude=altitude, **OVER_FLAT)
    assert over.is_clean is (clean or altitude != 0)


def test_heights_that_cannot_be_compared_close_the_column() -> None:
    zones = of_layers((20, "AGL", 250, "AMSL"), (500, "AMSL", 600, "AMSL"))
    found = cg.check([INSIDE, OUTSIDE], zones=zones, altitude="300 AMSL", tolerance=None)
    assert "its take-off at 6.100000,49.100000 goes through A at 20 m AGL to 250 m AMSL" in found.verdict[0]
    assert any("--ground FILE.tif would do" in note for note in found.height_notes)
    columns = zones.apply(altitude="300 AMSL").columns(LocalProjection(*INSIDE))
    assert columns is not None
    assert "cannot be compared without the ground's elevation" in columns.fault("start", (0.0, 0.0))
    assert zones.apply(altitude="300 AMSL", ground=FLAT, ends=[INSIDE]).account().count("closed") == 0


def test_the_verdict_names_the_place_the_zone_and_the_layer() -> None:
    zones = of_layers((0, "AGL", 50, "AGL"))
    (said,) = cg.check([OUTSIDE, INSIDE], zones=zones, altitude=80).verdict
    assert said == "not clean: its landing at 6.100000,49.100000 goes through A at 0 m AGL to 50 m AGL"
    far = cg.check([(6.201, 49.1), OUTSIDE], zones=zones, altitude=80, clearance=200, tolerance=None)
    assert far.verdict[0].startswith("not clean: its take-off at 6.201000,49.100000 is 73.")
    assert far.verdict[0].endswith("m from A at 0 m AGL to 50 m AGL, nearer than asked for")
    assert cg.check([(6.201, 49.1), OUTSIDE], zones=zones, altitude=80, clearance=70, tolerance=None).is_clean
    # a permission
    assert cg.check([OUTSIDE, INSIDE], zones=zones, altitude=80, treat={"PROHIBITED": "open"}, tolerance=None).is_clean
    no_fly = zones.apply(altitude=80, ends=[INSIDE]).no_fly(LocalProjection(*INSIDE))
    with pytest.raises(ProblemError, match="inside"):
        Problem((0, 0), (1, 1), bounds=(-9e3, -9e3, 9e3, 9e3), no_fly=no_fly)


def test_the_columns_of_a_plan_are_at_home_at_its_ends_and_on_the_ground() -> None:
    """With an altitude and with the plan's own, the aircraft goes down at each of these places."""
    zones = of_layers((0, "AGL", 50, "AGL"))
    home, middle = Home(*INSIDE), Waypoint(*INSIDE, 80.0, "ground")
    first, last = Waypoint(5.9, 49.1, 80.0, "ground"), Waypoint(6.3, 49.1, 80.0, "ground")
    plans = {
        (first, middle, last): True,
        (first, replace(middle, role="touch-down"), last): False,
        (first, replace(middle, role="landing")): False,
        (replace(middle, role="take-off"), last): False,
        (middle, last): False,
        (first, middle): False,
    }
    for waypoints, clean in plans.items():
        for altitude in (80, None):
            plan = FlightPlan(waypoints)
            assert cg.check(plan, zones=zones, altitude=altitude, tolerance=None).is_clean is clean
            from_home = cg.check(replace(plan, home=home), zones=zones, altitude=altitude, tolerance=None)
            assert not from_home.is_clean
    # above a waypoint on the ground at an end, it may climb to the height of the next one anywhere
    high = of_layers((60, "AGL", 70, "AGL"))
    ground = replace(middle, altitude=0.0)
    for plan in (FlightPlan((ground, last)), FlightPlan((first, ground))):
        for altitude in (80, None):
            assert not cg.check(plan, zones=high, altitude=altitude, tolerance=None).is_clean
    # at one altitude, it takes off and lands through all heights up to that
    slow = FlightPlan((Waypoint(6.19, 49.1, 30.0, "ground", role="take-off"), Waypoint(6.6, 49.1, 80.0, "ground")))
    assert cg.check(slow, zones=high, tolerance=None).is_clean
    assert not cg.check(slow, zones=high, altitude=80, tolerance=None).is_clean
    # a waypoint that is known to be lower keeps its height
    assert not cg.check([(5.9, 49.1), (6.3, 49.1)], zones=zones, altitude=50, tolerance=None).is_clean
    lower = FlightPlan((first, replace(middle, altitude=40.0), last))
    assert not cg.check(lower, zones=zones, altitude=80, tolerance=None).is_clean


@pytest.mark.parametrize("x", [6.0, 6.2])
def test_on_the_border_of_a_layer_a_flight_takes_off(x: float) -> None:
    zones = of_layers((0, "AGL", 50, "AGL"))
    away = (5.9, 49.1) if x == 6.0 else OUTSIDE
    assert cg.check([(x, 49.1), away], zones=zones, altitude=80, tolerance=None).is_clean
    assert zones.apply(altitude=80, ends=[(x, 49.1)]).account().count("closed") == 0
    # not where another zone begins
    beside = shapely.box(x, 49.0, x + 0.2 * math.copysign(1.0, x - 6.1), 49.2)
    both = Zones((*zones, *of_layers((0, "AGL", 30, "AGL"), area=beside)))
    assert both.apply(altitude=80, ends=[(x, 49.1)]).account().count("closed") == 2
    assert not cg.check([(x, 49.1), (x, 49.4)], zones=both, altitude=80, tolerance=None).is_clean


def test_zones_across_the_antimeridian() -> None:
    zones = of_layers((0, "AGL", 50, "AGL"), area=shapely.box(179.9, -1.0, 180.1, 1.0))
    for x in (179.95, 180.0, -180.0, -179.95):
        assert zones.apply(altitude=80, ends=[(x, 0.5)]).account().count("closed") == 1
        assert not cg.check([(x, 0.5), (178.0, 0.5)], zones=zones, altitude=80, tolerance=None).is_clean
    assert zones.apply(altitude=80, ends=[(179.8, 0.5)]).account().count("closed") == 0
    assert zones.apply(altitude=80, ends=[(179.89, 0.5)], clearance=1200.0).account().count("closed") == 1


def test_a_vertical_clearance_widens_floors_and_ceilings() -> None:
    zones = of_layers((0, "AGL", 120, "AGL"))
    across = [(5.9, 49.1), (6.3, 49.1)]
    near = cg.check(across, zones=zones, altitude=121, clearance=200, tolerance=None)
    assert near.is_clean
    assert near.on.rule.endswith("at take-off and landing; vertical clearance 0 m")
    for above in (30, 1, 0.9):
        found = cg.check(across, zones=zones, altitude=121, vertical_clearance=above, tolerance=None)
        own = cg.check(flown(*across, altitude=121.0), zones=zones, vertical_clearance=above, tolerance=None)
        assert found.is_clean is own.is_clean is (above < 1)
        assert found.document()["vertical_clearance"] == own.document()["vertical_clearance"] == above
        assert f"vertical clearance {above:g} m" in found.on.rule
        assert f"vertical clearance {above:g} m" in own.on.rule
    high = of_layers((150, "AGL", 200, "AGL"))
    assert cg.check([INSIDE, OUTSIDE], zones=high, altitude=121, vertical_clearance=28.9, tolerance=None).is_clean
    assert not cg.check([INSIDE, OUTSIDE], zones=high, altitude=121, vertical_clearance=29, tolerance=None).is_clean
    for wrong in (-1.0, math.nan, "high"):
        with pytest.raises(FileFormatError, match="vertical_clearance"):
            zones.apply(vertical_clearance=wrong)  # type: ignore[arg-type]
    with pytest.raises(CglaError, match="vertical_clearance needs zones"):
        cg.check(across, Problem((0, 0), (1, 1)), vertical_clearance=3.0)


def test_plans_are_checked_against_the_low_layers_of_a_scenario(tmp_path: Path) -> None:
    """The altitude of a scenario's zones is that of the check; a plan that flies higher is not known to be clean."""
    (tmp_path / "zones.json").write_bytes(data_of(ed269(volume(upperLimit=50))))
    text = 'coordinates = "lonlat"\nstart = [5.9, 49.1]\ngoal = [6.3, 49.1]\nk = 1\nbounds = [5.8, 48.9, 6.5, 49.3]\n'
    more = '[no_fly]\nzones = ["zones.json"]\naltitude = 80\n'
    (tmp_path / "mine.toml").write_text(text + more, encoding="utf-8")
    scenario = cg.load_scenario(tmp_path / "mine.toml")
    start = 6.02, 49.1
    assert cg.check([(5.9, 49.1), (6.3, 49.1)], scenario, tolerance=None).is_clean
    assert "goes through A-1 (Castle)" in cg.check([start, (6.3, 49.1)], scenario, tolerance=None).verdict[0]
    high = cg.check(flown((5.9, 49.1), (6.3, 49.1), altitude=90.0), scenario, tolerance=None)
    assert "zones were held against 80 m AGL alone: check it against the files of zones" in high.verdict[0]
    # ends that are moved are checked again
    x, y = scenario.projection.forward(start).tolist()  # type: ignore[union-attr]
    with pytest.raises(CglaError, match=r"start \(6.02, 49.1\): take-off between the ground and 80 m AGL goes through"):
        replace(scenario, problem=replace(scenario.problem, start=(x, y)))


heights = st.integers(-2, 14).map(lambda number: 10.0 * number)
references = st.sampled_from(["AGL", "AMSL"])


@st.composite
def zones_and_places(draw: st.DrawFn) -> tuple[Zones, list[tuple[float, float]]]:
    """Draw zones of boxes with corners on a grid, and places between the lines of the grid."""
    places = draw(st.lists(st.tuples(st.integers(0, 9), st.integers(0, 9)), min_size=2, max_size=4, unique=True))
    zones = []
    for number in range(draw(st.integers(1, 3))):
        layers = []
        for _ in range(draw(st.integers(1, 2))):
            x, y = draw(st.integers(0, 8)), draw(st.integers(0, 8))
            box = shapely.box(
                6.0 + 0.02 * x,
                49.0 + 0.02 * y,
                6.0 + 0.02 * draw(st.integers(x + 1, 10)),
                49.0 + 0.02 * draw(st.integers(y + 1, 10)),
            )
            low, high = sorted((draw(heights), draw(heights)))
            above = draw(references), draw(references)
            limits = (
                Limit(value + 300.0 * (kind == "AMSL"), kind) for value, kind in zip((low, high), above, strict=True)
            )
            layers.append(Layer(box, *limits))
        zones.append(Zone(str(number), "", "PROHIBITED", tuple(layers)))
    return Zones(tuple(zones)), [(6.01 + 0.02 * x, 49.01 + 0.02 * y) for x, y in places]


def metres(shape: shapely.Geometry) -> shapely.Geometry:
    dense = shapely.segmentize(shape, 0.005)
    return shapely.transform(dense, lambda points: np.column_stack(METRES.transform(*points.T)))


#: A zone on the ground alone, within 2 km of a flight at cruise but not of its ends; and one that it would fly over.
ON_GROUND = of_layers((0, "AGL", 0, "AGL"), area=shapely.box(6.04, 49.04, 6.14, 49.14))
BESIDE, ACROSS = [(6.19, 49.13), (6.05, 49.19)], [(6.01, 49.01), (6.19, 49.17)]


@usual
@given(
    zones_and_places(),
    st.integers(1, 12).map(lambda number: 10.0 * number),
    st.sampled_from([0.0, 10.0, 15.0]),
    st.sampled_from([0.0, 300.0, 2000.0]),
    st.booleans(),
)
@example(drawn=(ON_GROUND, BESIDE), altitude=10.0, vertical=0.0, clearance=2000.0, own=True)
@example(drawn=(ON_GROUND, BESIDE), altitude=10.0, vertical=0.0, clearance=2000.0, own=False)
@example(drawn=(ON_GROUND, BESIDE), altitude=10.0, vertical=10.0, clearance=2000.0, own=True)
@example(drawn=(ON_GROUND, ACROSS), altitude=10.0, vertical=0.0, clearance=2000.0, own=True)
def test_clean_is_what_an_independent_reader_calls_clean(
    drawn: tuple[Zones, list[tuple[float, float]]], altitude: float, vertical: float, clearance: float, own: bool
) -> None:
    zones, places = drawn
    ends = [metres(shapely.Point(places[index])) for index in (0, -1)]
    projected = [metres(shapely.Point(place)) for place in places]
    legs = shapely.LineString([(one.x, one.y) for one in projected])
    faults, columns = [], []
    for layer in (layer for zone in zones for layer in zone.layers):
        low, high = (limit.metres - 300.0 * (limit.reference == "AMSL") for limit in (layer.lower, layer.upper))
        shape = metres(layer.area)
        at_cruise = low - vertical <= altitude <= high + vertical
        on_the_way = low - vertical <= altitude and high + vertical >= 0.0
        inside, away = legs.intersection(shape).length, legs.distance(shape)
        # (what touches, or is at the clearance to a metre, is left to other tests)
        assume(not at_cruise or away > 0.0 or inside > 5.0)
        for distance in [away] * at_cruise + [end.distance(shape) for end in ends] * on_the_way:
            assume(distance == 0.0 or abs(distance - clearance) > 0.01 * clearance + 5.0)
        column = any(end.distance(shape) == 0.0 or end.distance(shape) < clearance for end in ends)
        faults.append((at_cruise and (away == 0.0 or away < clearance)) or (on_the_way and column))
        columns.append(on_the_way and column)
    plan = flown(*places, altitude=altitude if own else None)
    settings = {"ground": FLAT, "vertical_clearance": vertical}
    found = cg.check(
        plan,
        zones=zones,
        altitude=None if own else altitude,
        clearance=clearance,
        terrain_clearance=0.0,
        tolerance=None,
        **settings,
    )
    assert found.is_clean is not any(faults), found.verdict
    # the zones that a problem gets are closed around its ends for the same columns
    applied = zones.apply(altitude=altitude, ends=(places[0], places[-1]), clearance=clearance, **settings)
    projection = LocalProjection(6.1, 49.1)
    first, last = (tuple(projection.forward(places[index]).tolist()) for index in (0, -1))
    bounds = (-2e4, -2e4, 2e4, 2e4)
    try:
        Problem(first, last, bounds=bounds, no_fly=applied.no_fly(projection), clearance=clearance)
        refused = False
    except ProblemError:
        refused = True
    assert refused is any(columns)
