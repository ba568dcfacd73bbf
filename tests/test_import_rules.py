"""Imports run one way: comparisons -> solvers -> the model, and only under the package's own name."""

import ast
import importlib
import tomllib
from collections.abc import Iterator
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[1]
FOLDERS = {"cgla_graph": ROOT / "cgla_graph", "solvers": ROOT / "solvers", "comparisons": ROOT / "comparisons"}
#: What the modules of a folder may not import, by the start of the full name.
BANNED = {
    "cgla_graph": ("cgla_graph.solvers", "cgla_graph.comparisons"),
    "solvers": ("cgla_graph.comparisons",),
    "comparisons": (),
}
BARE = {"solvers", "comparisons"}
#: Folders inside of those, which are packages too.
INSIDE = [ROOT / "comparisons" / name for name in ("study", "report", "results", "claims")]
FILES = [(layer, file) for layer, folder in FOLDERS.items() for file in sorted(folder.glob("*.py"))]
FILES += [("comparisons", file) for folder in INSIDE for file in sorted(folder.glob("*.py"))]


def imported(tree: ast.AST) -> Iterator[str]:
    """List every imported name in full, wherever the import stands; a relative one begins with a dot."""
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = "." * node.level + (node.module or "")
            yield from (f"{start}.{alias.name}" for alias in node.names)
        elif isinstance(node, ast.Call) and ast.unparse(node.func).split(".")[-1] in {"import_module", "__import__"}:
            yield from (str(part.value) for part in node.args if isinstance(part, ast.Constant))


def faults(source: str, layer: str) -> list[str]:
    """List the imports of a module that its layer may not have."""
    return [
        name
        for name in imported(ast.parse(source))
        if name.startswith((".", *(f"{banned}." for banned in BANNED[layer])))
        or name in BANNED[layer]
        or name.split(".")[0] in BARE
    ]


@pytest.mark.parametrize(("layer", "file"), FILES, ids=lambda part: part.name if isinstance(part, Path) else part)
def test_imports_run_one_way(layer: str, file: Path) -> None:
    source = file.read_text(encoding="utf-8")
    if (layer, file.name) == ("cgla_graph", "__init__.py"):
        # the face hands on names of the upper layers, to type checkers and when first used
        assert all(isinstance(node, ast.If) or not faults(ast.unparse(node), layer) for node in ast.parse(source).body)
    else:
        assert faults(source, layer) == []


@pytest.mark.parametrize(
    ("source", "layer"),
    [
        ("import cgla_graph.solvers", "cgla_graph"),
        ("from cgla_graph import solvers", "cgla_graph"),
        ("from cgla_graph.solvers.bridge import solve", "cgla_graph"),
        ("def late():\n    import cgla_graph.comparisons.cli", "cgla_graph"),
        ("def late():\n    from cgla_graph import comparisons", "solvers"),
        ("import importlib\nimportlib.import_module('cgla_graph.comparisons.rows')", "solvers"),
        ("from . import base", "solvers"),
        ("from .base import Traits", "comparisons"),
        ("import solvers", "comparisons"),
        ("from comparisons.rows import row", "comparisons"),
    ],
)
def test_a_breach_is_seen(source: str, layer: str) -> None:
    assert faults(source, layer)


@pytest.mark.parametrize("source", ["import numpy as np", "from cgla_graph.solvers_guide import x", "import ompl"])
def test_other_imports_are_fine(source: str) -> None:
    assert faults(source, "cgla_graph") == []


def test_every_folder_with_modules_is_installed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    homes = {ROOT / settings["package-dir"][name] for name in settings["packages"]}
    assert homes == {*FOLDERS.values(), *INSIDE}
    folders = {file.parent for folder in FOLDERS.values() for file in folder.glob("**/*.py")}
    # what is reached through the two links counts where it really is
    assert {folder.resolve() for folder in folders} == homes


@pytest.mark.parametrize("layer", ["solvers", "comparisons"])
def test_the_links_lead_to_the_folders(layer: str) -> None:
    link = ROOT / "cgla_graph" / layer
    if not link.is_symlink():
        pytest.skip("this checkout has no symbolic links")
    assert link.resolve() == FOLDERS[layer]
    assert not link.readlink().is_absolute()


@pytest.mark.parametrize("name", ["cgla_graph", "cgla_graph.solvers", "cgla_graph.comparisons"])
def test_no_name_of_a_package_is_that_of_a_module_in_it(name: str) -> None:
    # importing the module would put it in the name's place
    package = importlib.import_module(name)
    folder = Path(str(package.__file__)).parent
    modules = {path.stem for path in folder.iterdir() if path.suffix == ".py" or path.is_dir()}
    # the face hands on whole packages, too
    assert modules & set(package.__all__) <= {"solvers", "comparisons"}
