"""Commands on maps in longitude and latitude."""

import warnings
from pathlib import Path

import pytest
import shapely
from command_line import Call
from hypothesis import given
from hypothesis import strategies as st

from cgla_graph._text import at_most_percent
from cgla_graph.model.earth import distortion_note


def test_a_map_in_the_plane_has_no_distortion() -> None:
    assert distortion_note(None, []) == ""


@given(ratio=st.floats(1e-12, 1.0))
def test_a_percentage_is_never_below_its_ratio(ratio: float) -> None:
    number, sign = at_most_percent(ratio).split()
    assert sign == "%"
    assert ratio * (1.0 - 1e-12) <= float(number) / 100.0 <= ratio * 1.11


@pytest.fixture
def areas(cgla: Call) -> Path:
    """Write two areas, 1,200 km apart, into the working folder of the command."""
    file = Path("areas.geojson")
    shapes = shapely.MultiPolygon([shapely.box(20.0, 59.5, 20.5, 60.0), shapely.box(31.0, 69.0, 31.5, 69.5)])
    file.write_text(shapely.to_geojson(shapes), encoding="utf-8")
    return file


def test_a_plan_shows_the_bound_on_the_earth_and_the_distortion(cgla: Call, areas: Path) -> None:
    words = ("plan", str(areas), "--start", "24.94,60.17", "--goal", "23.76,61.50", "--solver", "straight-line")
    lines = cgla(*words).out.splitlines()
    assert "bound      161490.119 m" in lines
    assert "flat map   lengths exceed those on the Earth by at most 0.0027 %; lower bounds allow for that" in lines
    document = cgla(*words, "--json").document()
    assert document["lower_bound"] <= 161_490.1205
    assert document["certificate"]["lower_bound"] <= 161_490.1205
    assert document["stretch"] == pytest.approx(1.0 + 2.7e-5, rel=1e-6)


@pytest.mark.parametrize("command", ["plan", "certify", "pareto", "compare"])
@pytest.mark.parametrize(
    ("ends", "said"),
    [
        (("--start", "60.17,24.94", "--goal", "61.50,23.76"), "start (60.17, 24.94) is 4,3"),
        (("--start=-24.94,60.17",), "start (-24.94, 60.17) is 2,4"),
    ],
)
def test_ends_off_the_map_are_one_line_and_exit_2(
    cgla: Call, areas: Path, command: str, ends: tuple[str, ...], said: str
) -> None:
    answer = cgla(command, str(areas), *ends)
    answer.refused(said)
    assert ("longitude first? (24.94, 60.17) is on the map" in answer.err) == ("60.17,24.94" in ends)


def test_a_wider_map_is_asked_for_with_bounds(cgla: Call, areas: Path) -> None:
    words = ("plan", str(areas), "--start=-24.94,60.17", "--goal", "24.94,60.17", "--solver", "straight-line")
    assert cgla(*words, "--bounds=-26,50,33,75", "--no-certificate").code == 0
    wrong = cgla(*words, "--bounds", "1,2,3")
    assert (wrong.code, "--bounds is '1,2,3'; give four numbers" in wrong.err) == (2, True)
    mission = cgla("compare", "fig4", "--bounds", "0,0,1,1")
    assert (mission.code, "--bounds is for maps" in mission.err) == (2, True)


def test_a_table_says_what_the_flat_map_does(cgla: Call) -> None:
    words = ("compare", "finland", "--solvers", "straight-line", "--no-certificate")
    assert "lengths exceed those on the Earth by at most 0.0056 %" in cgla(*words).out
    pareto = cgla("pareto", "finland", "--solver", "cgla", "--resolution", "5").out
    assert "lengths exceed those on the Earth by at most" in " ".join(pareto.split())


def test_a_warning_is_one_line(cgla: Call) -> None:
    Path("small.toml").write_text(
        "start = [24.1, 60.1]\ngoal = [24.9, 60.9]\nk = 1\ncoordinates = 'lonlat'\nbounds = [24, 60, 25, 61]\n"
        "threats = [{ x = 24.5, y = 60.5, spread = 0.05 }]",
        encoding="utf-8",
    )
    with warnings.catch_warnings():
        warnings.simplefilter("default")
        answer = cgla("plan", "small.toml", "--solver", "straight-line", "--no-certificate")
    assert answer.code == 0
    assert "cgla: threat 0 has a spread of 0.05 on a map" in answer.err
    assert "warnings.warn" not in answer.err
