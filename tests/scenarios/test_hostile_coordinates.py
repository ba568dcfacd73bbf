"""Property test: coordinates that no map holds are refused in one line, through every door that takes areas."""

import json
from collections.abc import Callable, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
import pytest
import shapely
from hypothesis import given, reject
from hypothesis import strategies as st
from shapely.geometry.base import BaseGeometry
from strategies import examples

import cgla_graph as cg
from cgla_graph.airspace.zones.applying import Zones
from cgla_graph.airspace.zones.geojson import areas_of
from cgla_graph.airspace.zones.zone import Layer, Zone
from cgla_graph.comparisons.live.draft import polygons
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.mission.world import TimedArea
from cgla_graph.model.earth import LocalProjection, project_area
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.scenarios.area_tables import drawn_area
from cgla_graph.scenarios.mission_file import mission_from_toml
from cgla_graph.scenarios.scenario import scenario_from_toml

Ring = list[tuple[float, float]]
MIDDLE = (24.5, 60.5)
HOSTILE = (
    1e12, -1e12, 1e16, 1e120, 1e121, 1e154, 1e300, -1e300, 1e308, -1e308, float("nan"), float("inf"), -float("inf"),
    -0.0, 5e-324, 90.0, 90.0000001, -91.0, 180.0, 180.0000001, -181.0, 360.0, 540.0, 541.0, 720.0,
)  # fmt: skip
DEGREES = 'coordinates = "lonlat"\nbounds = [24, 60, 25, 61]\n'
ENDS = "start = [24.1, 60.1]\ngoal = [24.9, 60.9]\n"


@st.composite
def rings(draw: st.DrawFn) -> Ring:
    """Draw a ring: usual, collapsed, crossing itself or with hostile coordinates, closed or not."""
    numbers = st.one_of(st.floats(-0.4, 0.4), st.sampled_from(HOSTILE))
    corners = draw(st.lists(st.tuples(numbers, numbers), min_size=1, max_size=5))
    ring = [(MIDDLE[0] + x, MIDDLE[1] + y) if abs(x) + abs(y) < 1.0 else (x, y) for x, y in corners]
    ring = ring * (3 if len(ring) < 3 else 1)
    return [*ring, ring[0]] if draw(st.booleans()) else ring


def polygon(ring: Ring) -> shapely.Polygon:
    """Return the polygon of a ring; shapely itself makes none of an open ring with NaN."""
    try:
        return shapely.Polygon(ring)
    except shapely.errors.GEOSException:
        reject()


def text_of(ring: Ring) -> str:
    """Write a ring in TOML."""
    return str([[float(x), float(y)] for x, y in ring])


def as_zone(ring: Ring) -> None:
    zone = Zone("A", "", "PROHIBITED", (Layer(polygon(ring)),))
    NoFlyArea(Zones((zone,)).apply().no_fly(LocalProjection(*MIDDLE)))


def in_plane(ring: Ring) -> None:
    cg.Problem((0, 0), (1, 1), no_fly=polygon(ring), clearance=abs(ring[0][0])).relaxed().evaluate([(0, 0)])


def in_degrees(ring: Ring) -> None:
    cg.Problem.in_degrees((24.1, 60.1), (24.9, 60.9), bounds=(24, 60, 25, 61), no_fly=polygon(ring))


def places(ring: Ring) -> None:
    (x, y), *_, (z, w) = ring
    cg.Problem.in_degrees((x, y), (24.9, 60.9), bounds=(24, 60, z, w))


def mission(ring: Ring) -> None:
    area = f"[[timed_areas]]\npolygon = {text_of(ring)}\n"
    mission_from_toml(
        f'{DEGREES}detection_radius = 1e3\n{area}[[uavs]]\nname = "a"\n{ENDS}', name="m"
    ).missions(cg.solvers.get)  # fmt: skip


def drawn_in_live(ring: Ring) -> None:
    # (a page's JSON holds finite numbers only)
    numbers = np.nan_to_num(np.array(ring), posinf=1e308, neginf=-1e308)
    NoFlyArea(shapely.GeometryCollection(polygons([numbers.tolist()])))


DOORS: dict[str, Callable[[Ring], object]] = {
    "area": lambda ring: NoFlyArea(polygon(ring)),
    "union": lambda ring: NoFlyArea(shapely.GeometryCollection([polygon(ring), shapely.box(0, 0, 30, 70)])),
    "plane": in_plane,
    "degrees": in_degrees,
    "places": places,
    "project": lambda ring: project_area(polygon(ring), LocalProjection(*MIDDLE)),
    "zone": as_zone,
    "timed": lambda ring: TimedArea(polygon(ring), 1),
    "uav": lambda ring: cg.Uav("a", ring[0], ring[-1], ring[0][0], ring[0][1]),
    "geojson": lambda ring: areas_of(json.loads(json.dumps({"type": "Polygon", "coordinates": [ring]})), "a.json"),
    "scenario": lambda ring: scenario_from_toml(f"{DEGREES}{ENDS}k = 1\n[no_fly]\npolygons = [{text_of(ring)}]\n", "m"),
    "plane scenario": lambda ring: scenario_from_toml(
        f"start = [0, 0]\ngoal = [1, 1]\nk = 1\n[no_fly]\npolygons = [{text_of(ring)}]\n", "m"
    ),
    "unbounded": lambda ring: scenario_from_toml(
        f'coordinates = "lonlat"\n{ENDS}k = 1\n[no_fly]\nareas = [{{outline = {text_of(ring)}}}]\n', "m"
    ),
    "mission": mission,
    "live": drawn_in_live,
}


@pytest.mark.parametrize("door", DOORS)
@examples(25)
@given(rings())
def test_hostile_rings_are_read_or_refused_in_one_line(door: str, ring: Ring) -> None:
    said = "refused"
    with np.errstate(all="ignore"):
        try:
            DOORS[door](ring)
        except CglaError as error:
            said = str(error)

    assert said
    assert "\n" not in said


@pytest.mark.parametrize("value", [1e12, -1e12, 90.5, 541.0, 1e300])
@pytest.mark.parametrize("door", ["degrees", "project", "zone", "scenario", "unbounded", "mission"])
def test_a_corner_off_the_earth_is_named(door: str, value: float) -> None:
    ring = [(24.2, 60.2), (24.8, value), (24.8, 60.8)]
    if value == 541.0:
        ring = [(x, y) if y != value else (value, 60.2) for x, y in ring]
    with pytest.raises(CglaError, match=r"longitude|at most 1e\+120") as caught:
        DOORS[door](ring)
    assert repr(value) in str(caught.value)


@pytest.mark.parametrize("ring", [[[0, 0], [1, 1], [1, 0], [0, 1]], [[0, 0]] * 4, [[0, 0], [1, 1], [2, 2]]])
@pytest.mark.parametrize("lonlat", [False, True])
def test_rings_without_an_inside_are_named_by_their_key(ring: Sequence[Sequence[float]], *, lonlat: bool) -> None:
    with pytest.raises(ProblemError, match=r"no_fly\.polygons\.3 is invalid: .*make_valid"):
        drawn_area("no_fly.polygons.3", ring, lonlat=lonlat)


def test_rings_and_bounds_cross_the_antimeridian_by_the_shorter_way() -> None:
    ring = text_of([(179.9, 0.2), (-179.9, 0.2), (-179.9, 0.8), (179.9, 0.8)])
    text = 'coordinates = "lonlat"\nbounds = [179, 0, -179, 1]\nstart = [179.5, 0.5]\ngoal = [-179.5, 0.5]\nk = 0\n'
    with TemporaryDirectory() as folder:
        written = scenario_from_toml(f"{text}[no_fly]\npolygons = [{ring}]", "m", folder=Path(folder)).problem
    made = cg.Problem.in_degrees(
        (179.5, 0.5), (-179.5, 0.5), bounds=(179, 0, -179, 1), no_fly=shapely.box(179.9, 0.2, 180.1, 0.8)
    )

    assert made.bounds == pytest.approx(written.bounds)
    for problem in (written, made):
        assert 20_000 < problem.area.geometry.bounds[2] - problem.area.geometry.bounds[0] < 25_000


@pytest.mark.parametrize("bounds", [(24, 61, 25, 60), (24, 60, 24, 61), (24, 60, 1e12, 61), (24, 60, 25), "24"])
def test_bounds_in_degrees_that_are_no_box_are_refused(bounds: tuple[float, ...]) -> None:
    with pytest.raises(ProblemError, match="bounds"):
        cg.Problem.in_degrees((24.1, 60.1), (24.9, 60.9), bounds=bounds)  # type: ignore[arg-type]


def test_a_clearance_wider_than_any_map_is_refused() -> None:
    with pytest.raises(ProblemError, match=r"clearance is 1e\+300; it must be at most"):
        cg.Problem((0, 0), (1, 1), no_fly=shapely.box(0.4, 0.4, 0.6, 0.6), clearance=1e300)


@pytest.mark.parametrize("shape", [shapely.Point(0.5, 0.0), shapely.LineString([(0.2, 0.5), (1.0, 0.5)])])
@pytest.mark.parametrize("gather", [lambda shape: shape, lambda shape: shapely.GeometryCollection([shape])])
def test_an_area_without_width_on_the_border_is_refused(
    shape: BaseGeometry, gather: Callable[[BaseGeometry], BaseGeometry]
) -> None:
    with pytest.raises(ProblemError, match="only polygons have an interior"):
        cg.Problem((0.1, 0.1), (0.9, 0.9), no_fly=gather(shape))


def test_an_invalid_part_beside_one_on_the_border_is_named() -> None:
    bow = shapely.Polygon([(0.3, 0.6), (0.6, 0.9), (0.6, 0.6), (0.3, 0.9)])
    with pytest.raises(ProblemError, match=r"part \[0\] of the no-fly area is invalid: .*make_valid"):
        cg.Problem((0.1, 0.1), (0.9, 0.1), no_fly=shapely.MultiPolygon([bow, shapely.box(0.4, 0.5, 0.6, 1.0)]))
