"""`cgla plan --via`: places that a path visits."""

import itertools
import json
from pathlib import Path

import numpy as np
import pyproj
import pytest
from command_line import Call
from raster_files import laid_at

import cgla_graph as cg
from cgla_graph.model.earth import geodesic_length

AREA = [[[24.8, 60.1], [25.1, 60.1], [25.1, 60.2], [24.8, 60.2], [24.8, 60.1]]]
FILES = {"areas.geojson": json.dumps({"type": "Polygon", "coordinates": AREA})}
ENDS = ("--start", "24.7,60.12", "--goal", "24.7,60.12", "--bounds", "24.5,59.9,25.4,60.4")
QUICK = (*ENDS, "--solver", "visibility-graph", "--no-certificate")
VIA = ("--via", "25.2,60.15", "--via", "24.95,60.05", "--via", "24.75,60.25")


def test_a_round_trip_in_the_best_order(cgla: Call, tmp_path: Path) -> None:
    """JSON equals the answer in Python; the plan, the table and the picture have all waypoints."""
    files = ("--export", "mine.plan", "--altitude", 80, "--profile", "mine.csv", "--out", "out")
    found = cgla("plan", "areas.geojson", *QUICK, *VIA, "--order", "best", *files, "--json")
    assert found.code == 0
    document = found.document()
    assert document["tour"]["order"] in ([2, 0, 1], [1, 0, 2])
    assert document["tour"]["places_lonlat"] == [[25.2, 60.15], [24.95, 60.05], [24.75, 60.25]]
    flown = document["path_lonlat"]
    assert all(place in flown for place in document["tour"]["places_lonlat"])
    assert flown[0] == flown[-1] == [24.7, 60.12]
    plan = cg.read_plan("mine.plan")
    assert plan.lonlat[:-1].tolist() == flown
    assert (plan.waypoints[0].role, plan.waypoints[-1].role) == ("take-off", "landing")
    assert len((tmp_path / "mine.csv").read_text(encoding="utf-8").splitlines()) > len(flown)
    assert (tmp_path / "out" / "areas-visibility-graph-tour.png").exists()
    assert (
        cgla("check", "mine.plan", "--zones", "areas.geojson", "--no-certificate", "--acceptance-radius", 0).code == 0
    )
    in_order = cgla("plan", "areas.geojson", *QUICK, *VIA, "--json").document()
    assert in_order["tour"]["order"] == [0, 1, 2]
    assert in_order["cost"] > document["cost"]
    assert in_order["lower_bound"] == pytest.approx(sum(leg["lower_bound"] for leg in in_order["tour"]["legs"]))


def test_places_widen_a_map_of_areas_as_its_ends_do(cgla: Call) -> None:
    ends = ("--start", "24.7,60.12", "--goal", "24.7,60.12", "--solver", "visibility-graph", "--no-certificate")
    found = cgla("plan", "areas.geojson", *ends, "--via", "25.2,60.15", "--via", "24.95,60.05", "--json").document()
    assert found["status"] == "found"
    assert [25.2, 60.15] in found["path_lonlat"]
    cgla("plan", "areas.geojson", *ends, "--via", "25.2,62.15").refused("place 1 (25.2, 62.15) is outside the bounds")


def test_what_is_printed(cgla: Call) -> None:
    out = cgla("plan", "areas.geojson", *ENDS, *VIA, "--order", "best").out
    assert "(in the cheapest order)" in out
    assert "how far above the least sum of bounds over all orders (" in out
    assert cgla("plan", "paper", "--via", "0.5,0.5").out.count("via        1 place: 1 (as given)") == 1


def test_the_answer_is_that_of_python(cgla: Call) -> None:
    places = [(0.3, 0.8), (0.7, 0.3), (0.2, 0.4)]
    words = [word for x, y in places for word in ("--via", f"{x},{y}")]
    document = cgla("plan", "one-threat", *words, "--order", "best", "--solver", "cgla", "--json").document()
    plain = cg.load_scenario("one-threat")
    found = cg.tour(plain.problem, places, order="best", solver="cgla", resolution=plain.lattice)
    assert (document["cost"], document["lower_bound"], document["gap"]) == (found.cost, found.lower_bound, found.gap)
    assert document["tour"] == found.document()


@pytest.mark.parametrize(
    ("words", "said"),
    [
        (["--via", "25.2"], ("--via is '25.2'", "X,Y")),
        (["--via", "25.2,99"], ("--via", "latitude")),
        (["--via", "24.95,60.15"], ("place 1 (24.95, 60.15) is inside the no-fly area",)),
        (["--via", "25.9,60.15"], ("place 1 (25.9, 60.15) is outside the bounds",)),
        (["--order", "best"], ("--order best needs places",)),
        (["--via", "25.2,60.15", "--order", "cheapest"], ("--order is 'cheapest'", "given, best")),
        (["--via", "25.2,60.15", "--turn-radius", "100"], ("--via with --turn-radius",)),
        (["--via", "25.2,60.15", "--max-length", "100"], ("--via with --max-length",)),
        (
            ["--order", "best", *(word for n in range(13) for word in ("--via", f"{24.6 + 0.01 * n},60.0"))],
            ("there are 13 places", "12 at most"),
        ),
    ],
)
def test_nonsense_is_refused(cgla: Call, words: list[str], said: tuple[str, ...]) -> None:
    cgla("plan", "areas.geojson", *QUICK, *words).refused(*said)


@pytest.mark.filterwarnings("ignore::cgla_graph.model.rasters.crs.RasterWarning")
@pytest.mark.parametrize("crs", ["EPSG:32635", "EPSG:3857"])
def test_places_over_a_raster_are_in_the_coordinates_of_the_ends(cgla: Call, tmp_path: Path, crs: str) -> None:
    """In longitude and latitude, or in those of the raster: the same tour."""
    pytest.importorskip("rasterio")
    laid_at(tmp_path / "a.tif", crs, 25.0, 60.0)
    there = pyproj.Transformer.from_crs("EPSG:4326", crs, always_xy=True)
    places = [(24.95, 59.97), (25.05, 60.03), (25.03, 59.97)]
    flown = []
    for own in (places, [there.transform(*place) for place in places]):
        start, goal, via = (f"{x!r},{y!r}" for x, y in own)
        words = ("--start", start, "--goal", goal, "--via", via, "--solver", "straight-line", "--no-certificate")
        flown.append(cgla("plan", "a.tif", *words, "--k", 0, "--speed", 10, "--json").document())
    assert np.array(flown[0]["path_lonlat"]) == pytest.approx(np.array(flown[1]["path_lonlat"]), abs=1e-7)
    assert flown[0]["path_lonlat"][1] == pytest.approx(list(places[2]), abs=1e-7)
    stops = [places[0], places[2], places[1]]
    length = sum(geodesic_length(one, other) for one, other in itertools.pairwise(stops))
    assert flown[0]["flight"]["least_seconds"] == pytest.approx(length / 10.0, rel=1e-6)
