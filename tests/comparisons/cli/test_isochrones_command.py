"""`cgla plan --isochrones`."""

from pathlib import Path

import pytest
from command_line import Call

import cgla_graph as cg

PAPER = cg.load_scenario("paper").problem


@pytest.mark.slow
def test_the_command_writes_what_python_finds(cgla: Call, tmp_path: Path) -> None:
    found = cgla("plan", "paper", "--isochrones", "0.5,1", "--out", "out", "--json").document()
    assert found["isochrones"] == cg.Map(PAPER).isochrones([0.5, 1.0]).document()["isochrones"]
    names = sorted(file.name for file in (tmp_path / "out").iterdir())
    assert names == ["paper-isochrones.geojson", "paper-isochrones.png"]
    cgla("plan", "paper", "--isochrones", "near").refused("--isochrones is 'near'", "give one cost or several")
    cgla("plan", "paper", "--isochrones", "1", "--via", "0.2,0.2").refused("--isochrones with --via", "leave one out")
    cgla("plan", "paper", "--isochrones", "1", "--pairs", "x.csv").refused("--pairs with --isochrones")
