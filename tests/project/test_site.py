"""What the site is made of names everything that there is; `make docs` builds it, and takes warnings for errors."""

import re
import sys
import tomllib
from pathlib import Path

import matplotlib as mpl
from PIL import Image

import cgla_graph as cg
from cgla_graph import comparisons
from cgla_graph.solvers import registry

DOCS = Path(__file__).resolve().parents[2] / "docs"
sys.path.insert(0, str(DOCS / "_extensions"))
import manual_figures  # noqa: E402 - a script of the site
import section_pages  # noqa: E402 - the same

mpl.use("agg")
SCRIPTS = sorted((DOCS / "figures").glob("*.py"))
#: Packages, which have tables of their own; a name left for old programs; a union of two that are there.
ELSEWHERE = {"solvers", "comparisons", "Contender", "Solver"}


def test_every_solver_has_a_word_on_when_to_use_it() -> None:
    words = tomllib.loads((DOCS / "reference" / "when-to-use.toml").read_text(encoding="utf-8"))
    assert set(words) == set(registry.names(installed=False))


def test_every_public_name_is_in_the_reference() -> None:
    listed = set(
        re.findall(r"^   ([\w.]+)$", (DOCS / "reference" / "api.rst").read_text(encoding="utf-8"), re.MULTILINE)
    )
    for name in {*cg.__all__} - ELSEWHERE:
        assert name in listed
    for name in {*comparisons.__all__} - ELSEWHERE:
        assert f"comparisons.{name}" in listed
    for name in {*cg.solvers.__all__} - ELSEWHERE:
        assert name in listed or f"solvers.{name}" in listed


def test_every_figure_is_drawn_and_shown() -> None:
    """Each picture is of its script as it is: `make figures` draws them again."""
    pages = " ".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    for script in SCRIPTS:
        with Image.open(script.with_suffix(".png")) as picture:
            assert picture.text["Source"] == manual_figures.digest(script), f"make figures FIGURES={script.stem}"  # type: ignore[attr-defined]
        assert f"figures/{script.stem}.png)" in pages
    assert {path.with_suffix(".py") for path in (DOCS / "figures").glob("*.png")} == {*SCRIPTS}


def test_sections_of_the_index_have_all_pages_once() -> None:
    """The site's tree of contents is made of the tables of `docs/README.md`."""
    found = section_pages.sections((DOCS / "README.md").read_text(encoding="utf-8"))
    pages = [name for section in found for name, _, _ in section.pages if not name.startswith("generated/")]
    assert len(pages) == len({*pages})
    files = {path.relative_to(DOCS).with_suffix("").as_posix() for path in DOCS.rglob("*.md")}
    missed = {name for name in files - {*pages} if not name.startswith("generated/")}
    assert missed == {"README", "index"}
    tree = (DOCS / "index.md").read_text(encoding="utf-8")
    for section in found:
        assert f"\n{section.name}\n" in tree
        assert section.text
        assert all(gives for _, _, gives in section.pages)
