"""
Figures of the manual: each script in `docs/figures` draws the picture of its name beside it (`make figures`).

The pictures are kept with the pages, so that a page shows them wherever it is read. Each holds the digest of the script
that drew it: a test tells where the two have parted.
"""

import hashlib
import io
import runpy
import sys
from pathlib import Path

import matplotlib as mpl
import matplotlib.pyplot as plt
from PIL import Image
from PIL.PngImagePlugin import PngInfo

FOLDER = Path(__file__).resolve().parents[1] / "figures"
LOOK = {"figure.constrained_layout.use": True, "font.size": 10}


def digest(script: Path) -> str:
    """Return the digest of a script and of what all of them share."""
    shared = Path(__file__).with_name("drawing.py")
    return hashlib.sha256(script.read_bytes() + shared.read_bytes()).hexdigest()


def draw(script: Path, picture: Path) -> None:
    """Run a script and keep its picture, in 256 colours."""
    drawn, notes = io.BytesIO(), PngInfo()
    notes.add_text("Source", digest(script))
    with mpl.rc_context(LOOK):
        runpy.run_path(str(script))
        plt.gcf().savefig(drawn, dpi=144)
        plt.close("all")
    Image.open(drawn).convert("RGB").quantize(256, dither=Image.Dither.NONE).save(picture, optimize=True, pnginfo=notes)


if __name__ == "__main__":
    mpl.use("agg")
    for script in sorted(FOLDER / f"{name}.py" for name in sys.argv[1:]) or sorted(FOLDER.glob("*.py")):
        print(f"draws {script.stem}.png", flush=True)  # noqa: T201 - a script
        draw(script, script.with_suffix(".png"))
