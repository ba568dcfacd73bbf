"""The examples run, notebooks among them, and print what they are about."""

import runpy
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
import pytest

FOLDER = Path(__file__).resolve().parents[2] / "examples"
#: Something that each says if it does what it should.
SAYS = {
    "check_a_route.py": "% above the best possible",
    "corridors.py": "k = 10: cost 1.392 by harbour - forest - lake - airfield",
    "first_path.py": "within 0.39% of what is possible",
    "rank_solvers.py": "1. fast-marching",
    "storm.py": "asked for 0.1",
    "notebooks/length_against_risk.py": "",
    "notebooks/proof.py": "",
}


@pytest.fixture(autouse=True)
def _without_windows() -> None:
    mpl.use("agg")


@pytest.mark.parametrize("name", SAYS)
def test_an_example_runs(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    runpy.run_path(str(FOLDER / name), run_name="__main__")
    plt.close("all")

    assert SAYS[name] in capsys.readouterr().out


def test_every_example_is_run() -> None:
    found = [*FOLDER.glob("*.py"), *FOLDER.glob("notebooks/*.py")]
    assert {path.relative_to(FOLDER).as_posix() for path in found} == set(SAYS)
