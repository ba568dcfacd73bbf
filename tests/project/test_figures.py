"""Pictures of the manual show what their scripts draw now."""

import sys
from pathlib import Path

import matplotlib as mpl
import numpy as np
import pytest
from pages import ROOT
from PIL import Image

sys.path.insert(0, str(ROOT / "docs" / "_extensions"))
import manual_figures

mpl.use("agg")
SCRIPTS = sorted((ROOT / "docs" / "figures").glob("*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("script", SCRIPTS, ids=lambda script: script.stem)
def test_a_figure_shows_what_its_script_draws_now(script: Path, tmp_path: Path) -> None:
    """The library may have changed; other versions of matplotlib move lines by a pixel."""
    manual_figures.draw(script, tmp_path / "now.png")
    with Image.open(tmp_path / "now.png") as now, Image.open(script.with_suffix(".png")) as kept:
        small = [np.asarray(one.convert("RGB").resize((48, 32)), dtype=float) for one in (now, kept)]
    assert np.abs(small[0] - small[1]).mean() < 2.0, f"make figures FIGURES={script.stem}"
