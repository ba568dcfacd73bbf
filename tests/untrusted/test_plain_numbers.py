"""Numbers in files of others: decimal, and no infinity that nobody wrote."""

import json
import math
import re
import tomllib
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import fast

from cgla_graph.airspace.flight_plans.formats import read_plan
from cgla_graph.airspace.zones.geojson import read_areas
from cgla_graph.errors import CglaError
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.movingai import read_scenario_rows
from cgla_graph.scenarios.path_reading import read_path
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.untrusted.numbers import decimal, parse_float

BIG = ["1e400", "-1e309", "1" + "0" * 320 + ".5", "0.1E+999"]
NUMBER = re.compile(r"[+-]?([0-9]+(\.[0-9]*)?|\.[0-9]+)([eE][+-]?[0-9]+)?")


@fast
@given(st.text("0159.eE+-_xInfa \t,\N{ARABIC-INDIC DIGIT THREE}", max_size=7))
def test_what_is_read_is_decimal(text: str) -> None:
    try:
        found = decimal(text)
    except ValueError:
        assert not NUMBER.fullmatch(text) or math.isinf(float(text))
    else:
        assert NUMBER.fullmatch(text)
        assert found == float(text)


@pytest.mark.parametrize("text", BIG)
def test_numbers_that_are_too_large_are_named(text: str) -> None:
    for load in (lambda: json.loads(f"[{text}]", parse_float=parse_float), lambda: decimal(text)):
        with pytest.raises(ValueError, match="is too large for a number"):
            load()
    assert tomllib.loads("k = inf", parse_float=parse_float) == {"k": math.inf}
    assert decimal("-INF", or_infinite=True) == -math.inf


def refused(call: object, *words: str) -> None:
    with pytest.raises(CglaError) as error:
        call()  # type: ignore[operator]
    assert all(word in str(error.value) for word in words), str(error.value)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("text", BIG)
def test_every_file_names_them(text: str, tmp_path: Path) -> None:
    """As they stand, and not as infinity."""
    said = (text[:40], "is too large for a number")
    (tmp_path / "a.toml").write_text(f"start = [0, 0]\ngoal = [1, 1]\nk = {text}\n", encoding="utf-8")
    refused(lambda: load_scenario(tmp_path / "a.toml"), *said)
    (tmp_path / "b.toml").write_text(f"k = {text}\n[[uavs]]\nstart = [0, 0]\ngoal = [1, 1]\n", encoding="utf-8")
    refused(lambda: load_mission(tmp_path / "b.toml"), *said)
    (tmp_path / "a.geojson").write_text(f'{{"type": "Point", "coordinates": [{text}, 1]}}', encoding="utf-8")
    refused(lambda: read_areas(tmp_path / "a.geojson"), *said)
    for name, rows in (("a.csv", f"1,{text}\n2,3\n"), ("a.asc", f"ncols 2\nnrows 1\ncellsize 1\n1 {text}\n")):
        (tmp_path / name).write_text(rows.replace("1\n1", "1\nxllcorner 0\nyllcorner 0\n1"), encoding="utf-8")
        where = {"bounds": (0, 0, 1, 1)} if name == "a.csv" else {}
        with pytest.raises(CglaError, match="which is too large for a number"):
            RasterRisk.from_file(tmp_path / name, **where)  # type: ignore[arg-type]


@pytest.mark.parametrize("text", ["1_000", "0x10", "\N{ARABIC-INDIC DIGIT THREE}", "1e", "--1", "1.0D+00"])
def test_rasters_hold_decimal_numbers(text: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_text(f"1,2\n3,{text}\n", encoding="utf-8")
    refused(lambda: RasterRisk.from_file(tmp_path / "a.csv", bounds=(0, 0, 1, 1)), "which is no number")


@pytest.mark.parametrize("text", ["1_0", "\N{ARABIC-INDIC DIGIT ONE}", "1e400", "0x1"])
def test_places_are_decimal_numbers(text: str, tmp_path: Path) -> None:
    """In paths, plans, zones and rows of grid maps."""
    (tmp_path / "path.csv").write_text(f"x,y\n0.1,0.1\n{text},0.5\n0.9,0.9\n", encoding="utf-8")
    problem = load_scenario("paper").problem
    refused(lambda: read_path(tmp_path / "path.csv", problem), text)
    (tmp_path / "plan.csv").write_text(f"longitude,latitude\n24,60\n{text},61\n", encoding="utf-8")
    refused(lambda: read_plan(tmp_path / "plan.csv"), text)
    ring = f"24,60 {text},60 24,61 24,60"
    area = f"<outerBoundaryIs><LinearRing><coordinates>{ring}</coordinates></LinearRing></outerBoundaryIs>"
    kml = f"<kml><Placemark><Polygon>{area}</Polygon></Placemark></kml>"
    (tmp_path / "zones.kml").write_text(kml, encoding="utf-8")
    refused(lambda: list(open_scenarios(str(tmp_path / "zones.kml"))), text)
    (tmp_path / "a.scen").write_text(f"version 1\n0\ta.map\t4\t3\t0\t0\t1\t1\t{text}\n", encoding="utf-8")
    refused(lambda: read_scenario_rows(tmp_path / "a.scen"), "optimal length")
