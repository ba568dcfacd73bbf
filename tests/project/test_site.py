"""What the site is made of names everything that there is; `make docs` builds it, and takes warnings for errors."""

import re
import tomllib
from pathlib import Path

import cgla_graph as cg
from cgla_graph import comparisons
from cgla_graph.solvers import registry

DOCS = Path(__file__).resolve().parents[2] / "docs"
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


def test_every_figure_is_shown() -> None:
    pages = " ".join(page.read_text(encoding="utf-8") for page in DOCS.rglob("*.md"))
    for figure in (DOCS / "figures").glob("*.py"):
        assert f".. plot:: figures/{figure.name}\n" in pages
