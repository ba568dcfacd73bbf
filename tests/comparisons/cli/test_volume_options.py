"""Volumes around a planned path and around anybody's plan, on the command line."""

import json
from pathlib import Path

import numpy as np
import pytest
import rasterio
import shapely
from command_line import Call
from shapely.geometry import shape

import cgla_graph as cg
from cgla_graph.model.ground_risk import people_of
from cgla_graph.plots.check import check_figure

AIRCRAFT = ("--speed", 15, "--dimension", 0.8, "--pitch", 30, "--altitude", 60)
ENDS = ("--start", "24.02,60.02", "--goal", "24.08,60.03")


@pytest.fixture
def people(tmp_path: Path) -> Path:
    """Write a raster of counts of people, which has no data in the north."""
    counts = np.full((50, 60), 2.5, dtype=np.float32)
    counts[:10] = -1.0
    settings = {"driver": "GTiff", "height": 50, "width": 60, "count": 1, "dtype": "float32", "crs": "EPSG:4326"}
    target = tmp_path / "people.tif"
    with rasterio.open(
        target, "w", **settings, nodata=-1.0, transform=rasterio.Affine(0.1 / 60, 0, 24.0, 0, -0.001, 60.05)
    ) as file:
        file.write(counts, 1)
    return target


def test_a_path_gets_volumes_and_a_fence(cgla: Call, people: Path, tmp_path: Path) -> None:
    files = [f"--volumes={tmp_path / name}" for name in ("mine.kml", "mine.geojson")]
    plan = tmp_path / "mine.plan"
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ENDS, *AIRCRAFT, *files, "--export", plan)
    document = cgla(*words, "--geography-width", 40, "--json").document()
    found = document["volumes"]
    flown = cg.read_plan(plan)
    again = cg.volumes(flown, speed=15, dimension=0.8, pitch=30, width=40)
    assert found["dimensions"] == dict(vars(again.dimensions))
    geojson = json.loads((tmp_path / "mine.geojson").read_text())
    areas = [shape(one["geometry"]) for one in geojson["features"]]
    for area, same in zip(areas, again.placed.values(), strict=True):
        # the plan's own map has another middle
        assert area.symmetric_difference(same).area < 0.01 * same.area
    (fence,) = flown.fence
    assert areas[0].contains(shapely.Polygon(fence.shapes[0].corners))
    checked = cg.check(flown)
    assert checked.is_clean
    # all around the fence is closed, and the risk there is to be seen all the same
    legend = [text.get_text() for text in check_figure(checked).legends[0].get_texts()]
    assert legend == ["plan, clean", "start", "goal", "the plan's fence"]
    assert next(iter(cg.read_zones(tmp_path / "mine.kml"))).label == "ground risk buffer"
    below = found["people"]["operational_volume"]["people_per_km2"]
    assert below == pytest.approx(2.5 * 60 * 50 / 5.5797 / 5.5707, rel=0.05)
    assert found["people"]["intrinsic_ground_risk_class"]["value"] == 4
    # not held against anything
    assert not found["clean"]
    assert "not known" in found["verdict"][0]


@pytest.mark.parametrize("which", ["contingency", "none"])
def test_the_fence_is_chosen(cgla: Call, people: Path, tmp_path: Path, which: str) -> None:
    plan = tmp_path / "mine.plan"
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ENDS, *AIRCRAFT, "--export", plan)
    found = cgla(*words, "--fence", which, "--json").document()["volumes"]
    fences = cg.read_plan(plan).fence
    assert len(fences) == (which == "contingency")
    for fence in fences:
        geography = shape(found["areas"]["flight geography"])
        assert shapely.Polygon(fence.shapes[0].corners).contains(geography)


def test_unknown_density_is_no_class_until_it_is_given(cgla: Call, people: Path) -> None:
    ends = ("--start", "24.02,60.03", "--goal", "24.08,60.0395")
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ends, *AIRCRAFT)
    printed = cgla(*words).out
    assert "iGRC       4:" in printed
    assert printed.count("cells without data count as 0") == 3
    assert "iGRC       7:" in cgla(*words, "--people-without-data", 60_000).out
    beyond = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *AIRCRAFT, "--start", "24.0002,60.01")
    printed = cgla(*beyond, "--goal", "24.08,60.03").out
    assert "iGRC       none: the density is not known" in printed
    assert "at least 4" in printed
    assert "iGRC       4:" in cgla(*beyond, "--goal", "24.08,60.03", "--people-without-data", 0).out
    assert "iGRC       1: controlled ground area, as given" in cgla(*words, "--controlled-ground").out


def test_zones_beside_and_above_the_path_are_touched(cgla: Call, people: Path, tmp_path: Path) -> None:
    """The path itself is clean: it keeps away from the one, and is below the other."""
    ring = shapely.box(24.04, 60.0246, 24.05, 60.05).exterior.coords

    def zone(name: str, low: float) -> dict[str, object]:
        volume = {
            "uomDimensions": "M", "lowerLimit": low, "lowerVerticalReference": "AGL", "upperLimit": 900,
            "upperVerticalReference": "AGL", "horizontalProjection": {"type": "Polygon", "coordinates": [list(ring)]},
        }  # fmt: skip
        return {"identifier": name, "restriction": "PROHIBITED", "geometry": [volume]}

    zones = tmp_path / "zones.json"
    zones.write_text(json.dumps({"features": [zone("LOW", 70.0), zone("HIGH", 400.0)]}))
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ENDS, *AIRCRAFT, "--no-fly", zones)
    plan = tmp_path / "mine.plan"
    printed = cgla(*words, "--above", "ground", "--export", plan).out
    assert "airspace   not clean: the contingency volume touches 1 closed area: LOW" in printed
    call = cgla(
        "check", plan, "--zones", zones, "--max-speed", 15, "--dimension", 0.8, "--pitch", 30, "--no-certificate"
    )
    assert call.code == 1
    assert "verdict    clean without its contingency volume; for that, see airspace" in call.out
    assert "touches 1 closed area: LOW" in call.out


def test_anybodys_plan_gets_volumes(cgla: Call, people: Path, tmp_path: Path) -> None:
    plan = cg.write_plan(cg.FlightPlan.along([(24.02, 60.02), (24.08, 60.03)], altitude=60), tmp_path / "theirs.plan")
    target = tmp_path / "theirs.kml"
    words = ("check", plan, "--risk", people, "--kind", "count", "--nodata", 0, "--no-certificate", "--volumes", target)
    call = cgla(*words, "--max-speed", 15, "--dimension", 0.8, "--pitch", 30, "--json")
    found = call.document()["volumes"]
    assert found["people"]["intrinsic_ground_risk_class"]["value"] == 4
    assert str(target) in call.document()["files"]
    # exit code 1 has a reason, and a remedy
    call = cgla(*words, "--max-speed", 15, "--dimension", 0.8, "--pitch", 30, "--out", tmp_path)
    assert call.code == 1
    assert "clean without its contingency volume" in call.out
    assert "give zones (--no-fly FILE)" in call.out
    assert call.out.count("written to") == 1
    assert len(cg.read_zones(target).zones) == 3


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (("--volumes", "mine.shp", *AIRCRAFT), "ends in .kml or .geojson"),
        (("--volumes", "mine.kml", "--altitude", 60, "--pitch", 30, "--speed", 15), "give --dimension"),
        (("--volumes", "mine.kml", "--altitude", 60, "--pitch", 30, "--dimension", 1), "give --max-speed"),
        (("--volumes", "mine.kml", "--speed", 15, "--pitch", 30, "--dimension", 1), "give --altitude"),
        (("--volumes", "mine.kml", *AIRCRAFT, "--roll", 30), "pitch, roll"),
        (("--volumes", "mine.kml", *AIRCRAFT, "--buffer", "glide"), "needs glide_ratio"),
        (("--volumes", "mine.kml", *AIRCRAFT, "--fence", "all"), "geography, contingency, none"),
        ((*AIRCRAFT, "--above", "sea"), "ground is not known"),
    ],
)
def test_wrong_options_are_one_line(cgla: Call, people: Path, words: tuple[object, ...], message: str) -> None:
    call = cgla("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ENDS, *words, "--no-certificate")
    assert call.code == 2
    assert message in call.err
    assert call.err.count("\n") == 1


@pytest.mark.slow
def test_a_corridor_as_wide_as_the_volumes_keeps_the_density_below(cgla: Call, people: Path) -> None:
    """Without it, the volumes reach over the town beside the path."""
    with rasterio.open(people, "r+") as file:
        counts = file.read(1)
        counts[25:33, 20:32] = 40.0
        file.write(counts, 1)
    ends = ("--start", "24.01,60.0215", "--goal", "24.09,60.0215")
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ends, *AIRCRAFT, "--max-density", 500)

    def greatest(*more: str) -> float:
        below = cgla(*words, *more, "--json").document()["volumes"]["people"]
        found: float = max(below[name]["at_least"] for name in ("operational_volume", "ground_risk_buffer"))
        return found

    assert greatest("--no-certificate") > 3_000.0
    assert greatest("--no-certificate", "--corridor-of-volumes") < 500.0
    assert "no --corridor" in cgla(*words, "--corridor-of-volumes", "--corridor", 9).err


def test_maps_in_the_plane_have_volumes_but_no_files(cgla: Call, tmp_path: Path) -> None:
    words = ("plan", "paper", "--no-certificate", "--max-speed", 1e-3, "--dimension", 1e-3, "--flight-height", 0.01)
    sizes = ("--contingency-width", 0.01, "--contingency-height", 0.01, "--geography-width", 0.01)
    assert "airspace" in cgla(*words, *sizes).out
    assert "map in the plane" in cgla(*words, *sizes, "--volumes", tmp_path / "mine.kml").err


def test_python_says_the_same(cgla: Call, people: Path) -> None:
    words = ("plan", people, "--kind", "count", "--nodata", 0, "--k", 0, *ENDS, *AIRCRAFT)
    found = cgla(*words, "--json").document()
    path = np.array(found["path_lonlat"])
    raster = cg.RasterRisk.from_file(people, kind="count", nodata=0.0)
    problem = cg.Problem((0, 0), (1, 1), cg.RiskField(rasters=[raster]), bounds=raster.bounds)
    layer = people_of(problem)
    assert layer is not None
    laid = cg.volumes(path, height=60, speed=15, dimension=0.8, pitch=30)
    assert laid.dimensions == cg.VolumeSettings(speed=15, dimension=0.8, pitch=30).dimensions(60.0)
    assert found["volumes"]["dimensions"] == dict(vars(laid.dimensions))
