"""Rasters in any coordinates: lengths, totals and bounds hold on the Earth, as pyproj and rasterio measure it."""

import copy
import dataclasses
import itertools
import math
import warnings
from pathlib import Path

import numpy as np
import pyproj
import pytest
from hypothesis import given
from hypothesis import strategies as st
from raster_files import geotiff, laid_at, smooth, total
from strategies import examples

from cgla_graph.comparisons.study.documents import scenario_document, scenario_from
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.problem import Problem
from cgla_graph.model.rasters.crs import CoordinateSystem, CrsPlane, RasterWarning, Scale, scales
from cgla_graph.model.rasters.reading import read_place
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.people.below import greatest_below, length_outside, people_on
from cgla_graph.scenarios.scenario import as_scenario

#: Systems for the whole Earth, whose metres are metres nowhere or only in places.
WORLD = (
    "EPSG:3395", "ESRI:54004", "ESRI:54009", "EPSG:6933", "EPSG:8857", "EPSG:4087", "EPSG:32662", "ESRI:54008",
    "ESRI:54030", "ESRI:54012", "EPSG:3857", "+proj=sinu +R=6371007.181 +units=m",
)  # fmt: skip
PLACES = ((25.0, 60.0), (26.0, 0.1), (-70.0, -33.0), (179.5, -18.0))
GEOD = pyproj.Geod(ellps="WGS84")


def quietly(path: Path, **how: object) -> RasterRisk:
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", RasterWarning)
        return RasterRisk.from_file(path, **how)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("crs", "place"),
    [
        *((crs, PLACES[(number + turn) % 4]) for number, crs in enumerate(WORLD) for turn in (0, 1)),
        ("EPSG:32635", (25.0, 60.0)),
        ("EPSG:32630", (25.0, 60.0)),
        ("EPSG:32719", (-70.0, -33.0)),
        ("EPSG:2263", (-74.0, 40.7)),
        ("EPSG:3413", (25.0, 60.0)),
    ],
)
def test_people_are_where_they_live(crs: str, place: tuple[float, float], tmp_path: Path) -> None:
    """Any raster on a map in degrees: density at the middles of cells, and the total of counts."""
    file, middles = laid_at(tmp_path / "a.tif", crs, *place)
    around = LocalProjection(*place)
    people = quietly(file, projection=around)
    inner = np.pad(np.zeros((20, 20), dtype=bool), 2, constant_values=True).ravel()
    seen = people.density(around.forward(middles))
    assert np.abs(seen / smooth(24).ravel() - 1.0)[~inner].max() < 0.03
    counted = quietly(file, projection=around, kind="count")
    assert total(counted) == pytest.approx(smooth(24).sum(), rel=1e-9)


def test_scales_are_those_of_proj() -> None:
    """Tissot's axes, of PROJ's own derivatives."""
    for crs in (*WORLD[:-1], "EPSG:32635", "EPSG:3035"):
        system = CoordinateSystem.of_code(pyproj.CRS(crs).to_wkt())
        points = system.points(np.array([(25.0, 60.0), (10.0, 45.0), (-30.0, -20.0)]))
        factors = pyproj.Proj(crs).get_factors(*system.lonlat(points).T)
        expected = np.column_stack([factors.tissot_semiminor, factors.tissot_semimajor])
        # (the formula of one is that of a sphere, and the table of the other bends here)
        if crs not in {"EPSG:3857", "ESRI:54030"}:
            assert scales(system, points) == pytest.approx(expected, rel=1e-2), crs


@given(
    crs=st.sampled_from([*WORLD, "EPSG:32635", "EPSG:32630", "EPSG:3035", "EPSG:3067", "EPSG:2154", "EPSG:27700"]),
    lon=st.floats(-8.0, 35.0),
    lat=st.floats(-60.0, 70.0),
    seed=st.integers(0, 99),
    half=st.floats(500.0, 60e3),
)
@examples(32)
def test_bounds_hold_on_the_earth(crs: str, lon: float, lat: float, seed: int, half: float) -> None:
    """A plane is only accepted where its lengths are right within 1 %, and its bound is below the geodesics."""
    there = pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    x, y = there.transform(lon, lat)
    box = (x - half, y - half, x + half, y + half)
    if not np.isfinite(box).all():
        return
    try:
        plane = CrsPlane.over(CoordinateSystem.of_code(pyproj.CRS(crs).to_wkt(), box), box)
    except ProblemError:
        return
    path = np.array([x, y]) + half * np.random.default_rng(seed).uniform(-1.0, 1.0, (6, 2))
    degrees = plane.inverse(path)
    on_plane = np.hypot(*np.diff(path, axis=0).T).sum()
    on_earth = sum(GEOD.inv(*a, *b)[2] for a, b in itertools.pairwise(degrees))
    assert on_plane == pytest.approx(on_earth, rel=0.01)
    start, goal = ((float(a), float(b)) for a, b in (path[0], path[-1]))
    for bound in (on_plane, math.dist(start, goal)):
        assert plane.bound_on_earth(bound, start, goal, box) <= min(on_earth, on_plane) * (1.0 + 1e-9)
    # a tenth of a metre, or a metre where grids are missing
    expected = np.column_stack(there.transform(*path.T, direction="INVERSE"))
    assert np.abs(degrees - expected).max() < 2e-5


@pytest.mark.parametrize(
    ("crs", "place", "is_plane"),
    [
        ("EPSG:32635", (25.0, 60.0), True),
        ("EPSG:32635", (35.0, 60.0), True),
        ("EPSG:32635", (35.0, 10.0), False),
        ("EPSG:32630", (25.0, 60.0), False),
        ("EPSG:3395", (26.0, 0.1), True),
        ("EPSG:3395", (26.0, 9.0), False),
        ("ESRI:54009", (0.0, 60.0), False),
        ("EPSG:2263", (-74.0, 40.7), False),
        ("EPSG:32118", (-74.0, 40.7), True),
        ("EPSG:5555", (9.0, 52.0), True),
        ("EPSG:3413", (-45.0, 70.0), True),
    ],
)
def test_a_plane_is_one_within_a_percent(crs: str, place: tuple[float, float], is_plane: bool, tmp_path: Path) -> None:
    file, _ = laid_at(tmp_path / "a.tif", crs, *place)
    assert (read_place(file).coordinates == "plane") is is_plane
    if is_plane:
        people = RasterRisk.from_file(file)
        assert people.bounds == read_place(file).bounds
        # counts are those of the ground: an area of a hundred cells by geodesics
        density = RasterRisk.from_file(file, kind="count").cells[::-1] / smooth(24)
        there = pyproj.Transformer.from_crs(crs, "EPSG:4326", always_xy=True)
        x_min, y_min, x_max, y_max = people.bounds
        corners = [(x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max)]
        area = GEOD.polygon_area_perimeter(*zip(*(there.transform(*one) for one in corners), strict=True))[0]
        assert (1.0 / density).sum() == pytest.approx(area, rel=1e-4)
    else:
        with pytest.warns(RasterWarning, match="times the metres on the ground; it is laid on a plane"):
            RasterRisk.from_file(file)
        with pytest.raises(ProblemError, match=r'no metres .* times .*coordinates = "lonlat".*gdalwarp'):
            RasterRisk.from_file(file, coordinates="plane")


def test_problems_are_on_the_plane_of_their_rasters(tmp_path: Path) -> None:
    """In Python as in files: a bound is below the geodesic, however the map is widened."""
    file, _ = laid_at(tmp_path / "a.tif", "EPSG:32635", 25.0, 60.0)
    people = RasterRisk.from_file(file)
    x_min, y_min, x_max, y_max = people.bounds
    problem = Problem((x_min, y_min), (x_max, y_max), RiskField(rasters=[people.scaled(2.0)]), 1.0, people.bounds)
    assert isinstance(problem.projection, CrsPlane)
    ends = problem.projection.inverse([problem.start, problem.goal])
    assert problem.least_length <= min(GEOD.inv(*ends[0], *ends[1])[2], math.dist(problem.start, problem.goal))
    wider = dataclasses.replace(problem, bounds=(x_min - 2e5, y_min, x_max, y_max))
    assert wider.projection.greatest > problem.projection.greatest  # type: ignore[union-attr]
    assert wider.projection.stretch(0.0) >= 1.0  # type: ignore[union-attr]
    with pytest.raises(ProblemError, match=r"its lengths are .* those on the Earth, and 1% is allowed"):
        dataclasses.replace(problem, bounds=(x_min, y_min, x_max + 2e6, y_max))
    with pytest.raises(ProblemError, match="lay all rasters on one"):
        dataclasses.replace(problem, projection=LocalProjection(25.0, 60.0))
    other = RasterRisk.from_file(laid_at(tmp_path / "b.tif", "EPSG:32636", 27.5, 60.0)[0])
    with pytest.raises(ProblemError, match=r"35N, and another one on that of .*36N"):
        Problem(problem.start, problem.goal, RiskField(rasters=[people, other]), bounds=people.bounds)


def test_what_a_raster_askew_does_not_cover_is_not_known(tmp_path: Path) -> None:
    """Its corners on the plane are without data, and a path there is outside of it."""
    file, middles = laid_at(tmp_path / "a.tif", "ESRI:54009", -70.0, -33.0)
    around = LocalProjection(-70.0, -33.0)
    people = quietly(file, projection=around)
    x_min, y_min, x_max, y_max = people.bounds
    covered = people.covers.area / ((x_max - x_min) * (y_max - y_min))  # type: ignore[union-attr]
    assert 0.5 < covered < 0.95
    assert people.missing.mean() == pytest.approx(1.0 - covered, abs=0.03)
    assert copy.deepcopy(people).covers == people.covers
    inner = around.forward(middles[[0, 23, -1, -24]])
    assert length_outside([people], inner) == 0.0
    along = np.array([(x_min, y_min), (x_max, y_min)])
    assert length_outside([people.scaled(2.0)], along) > 0.2 * (x_max - x_min)
    flat = RasterRisk.from_file(laid_at(tmp_path / "b.tif", "EPSG:4326", -70.0, -33.0)[0])
    # (in degrees, it is a little narrower towards the pole)
    x_min, y_min, x_max, y_max = flat.bounds
    assert 0.98 < flat.covers.area / ((x_max - x_min) * (y_max - y_min)) < 1.1  # type: ignore[union-attr]
    assert not flat.missing.any()


def test_datums(tmp_path: Path) -> None:
    """Degrees and planes on another datum are shifted as pyproj shifts them; one that is not known is refused."""
    for crs, place in (("EPSG:4301", (139.7, 35.7)), ("EPSG:23035", (25.0, 60.0)), ("EPSG:27700", (-1.0, 52.0))):
        file, middles = laid_at(tmp_path / "a.tif", crs, *place)
        around = LocalProjection(*place)
        people = quietly(file, projection=around)
        off = np.abs(people.density(around.forward(middles)) / smooth(24).ravel() - 1.0).reshape(24, 24)
        assert off[2:-2, 2:-2].max() < 0.05
    with pytest.warns(RasterWarning, match="the datum of Tokyo is shifted to WGS84, right to 9 m"):
        read_place(laid_at(tmp_path / "a.tif", "EPSG:4301", 139.7, 35.7)[0])
    geotiff(tmp_path / "a.tif", smooth(24), 4e5, 6.65e6, 500.0, "+proj=utm +zone=35 +ellps=intl")
    with pytest.raises(ProblemError, match=r"from WGS84 is not known.*gdal_edit.py -a_srs"):
        RasterRisk.from_file(tmp_path / "a.tif")
    # a datum of another continent
    with pytest.raises(ProblemError, match="is not known here"):
        read_place(laid_at(tmp_path / "a.tif", "EPSG:4267", 25.0, 60.0)[0])
    with pytest.raises(ProblemError, match="names no coordinate reference system"):
        CoordinateSystem.of_code("EPSG:1")
    for code, wrong in (("EPSG:4978", "no system of places"), ("EPSG:5703", "no system of places")):
        with pytest.raises(ProblemError, match=wrong):
            CoordinateSystem.of_code(code)
    broken = pyproj.CRS("EPSG:32635").to_wkt("WKT1_GDAL").replace('"scale_factor",0.9996', '"scale_factor",0')
    with pytest.raises(ProblemError, match="no transformation to WGS84 is known"):
        CoordinateSystem.of_code(broken)


def test_places_beyond_the_earth_are_refused(tmp_path: Path) -> None:
    """No cell is dropped in silence, and the command that mends it is named."""
    for crs, x, y, size in (
        ("+proj=geos +h=35785831 +lon_0=0 +ellps=GRS80", -5.4e6, 5.4e6, 4.5e5),
        ("ESRI:54009", 17.5e6, 1e6, 1e5),
        ("EPSG:3857", 19.9e6, 1e6, 3e4),
    ):
        file = geotiff(tmp_path / "a.tif", smooth(24), x, y, size, crs)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", RasterWarning)
            with pytest.raises(ProblemError, match=r"gdalwarp -t_srs EPSG:4326 .*a\.tif a-lonlat\.tif"):
                RasterRisk.from_file(file)


def test_the_note_says_how_far_lengths_are_off() -> None:
    box = (480e3, 6.6e6, 520e3, 6.64e6)
    plane = CrsPlane.over(CoordinateSystem.of_code("EPSG:32635"), box)
    assert plane.note([]) == (
        "lengths on the plane of WGS 84 / UTM zone 35N fall short of those on the Earth by at most 0.041 %; "
        "lower bounds allow for that"
    )
    assert plane.stretch(0.0) == 1.0
    assert Scale.over(plane.system, box).greatest == pytest.approx(0.999605, abs=1e-6)


@pytest.mark.parametrize(
    ("crs", "half"),
    [("EPSG:4326", 50e3), ("EPSG:3857", 100e3), ("EPSG:3395", 100e3), ("ESRI:54009", 50e3), ("EPSG:32635", 50e3)],
)
def test_no_crowd_is_averaged_away(crs: str, half: float, tmp_path: Path) -> None:
    """A limit of density holds for every cell of the file below a path, whatever grid it is laid on."""
    rng = np.random.default_rng(5)
    file, _ = laid_at(tmp_path / "a.tif", crs, 27.0, 60.0, half=half, n=100)
    crowds = np.where(rng.random((100, 100)) < 0.03, rng.uniform(1e3, 9e3, (100, 100)), 1.0)
    with pytest.importorskip("rasterio").open(file, "r+") as opened:
        opened.write(crowds, 1)
        west, south, east, north = opened.bounds
    around = LocalProjection(27.0, 60.0)
    layer = quietly(file, projection=around, unit="people/km2").people
    assert layer is not None
    there = pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    for _ in range(20):
        path = rng.uniform(-22e3, 22e3, (2, 2))
        degrees = around.inverse(path[0] + np.linspace(0.0, 1.0, 4001)[:, None] * (path[1] - path[0]))
        x, y = there.transform(degrees[:, 0], degrees[:, 1])
        columns, rows = 100.0 * (x - west) / (east - west), 100.0 * (north - y) / (north - south)
        # (a cell that is crossed by less than about a 20th of its side is not told from one that is touched)
        deep = np.minimum(np.abs(columns - np.round(columns)), np.abs(rows - np.round(rows))) > 0.1
        met = crowds[np.floor(rows).astype(int), np.floor(columns).astype(int)][deep].max()
        assert greatest_below(layer, path) >= met * (1.0 - 1e-9)
    assert layer.highest.max() == pytest.approx(crowds.max(), rel=2e-3)


@pytest.mark.parametrize("crs", ["EPSG:2154", "EPSG:5041", "EPSG:32718", "EPSG:5880", "EPSG:5070"])
def test_people_on_a_plane_are_those_of_the_file(crs: str, tmp_path: Path) -> None:
    """A plane may stretch areas by almost 1 %, and counts are divided by those on the ground."""
    place = {"EPSG:2154": (3.0, 42.0), "EPSG:5041": (30.0, 85.0), "EPSG:5070": (-96.0, 40.0)}.get(crs, (-72.0, -33.0))
    file, _ = laid_at(tmp_path / "a.tif", crs, *(place if crs != "EPSG:5880" else (-47.0, -15.0)))
    layer = quietly(file, kind="count").people
    assert layer is not None
    assert people_on(layer, layer.bounds) == pytest.approx(smooth(24).sum(), rel=1e-6)


def test_the_command_that_warps_keeps_the_total_of_counts(tmp_path: Path) -> None:
    """Whether a file holds counts is not known where its place is read, and an average loses their total."""
    file, _ = laid_at(tmp_path / "a.tif", "EPSG:3395", 25.0, 60.0)
    with pytest.raises(ProblemError, match=r"-r average .* \(of counts: -r sum, which keeps their total\)"):
        RasterRisk.from_file(file, kind="count", coordinates="plane")


def test_a_study_keeps_what_is_known_of_a_raster(tmp_path: Path) -> None:
    """Its documents had all within the bounds as known, and only averages."""
    raster = quietly(laid_at(tmp_path / "a.tif", "ESRI:54009", 25.0, 60.0)[0], kind="count")
    problem = Problem((0, 0), (1000, 1000), RiskField(rasters=[raster]), bounds=raster.bounds)
    (again,) = scenario_from(scenario_document(as_scenario(problem, "mollweide"))).problem.field.rasters
    assert again == raster
    assert raster.covers is not None
    assert raster.covers.equals(again.covers)
    assert np.array_equal(again.highest, raster.highest)
