"""Imports run down the floors, from comparisons to solvers to the model's, and only under the package's own name."""

import ast
import importlib
import inspect
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parents[2]
#: What stands on which floor, the lowest first: modules import only from their own floor and from those below it.
FLOORS = (
    ("errors", "_lazy", "_types", "_kernel", "_text", "_validate", "_display", "_progress", "_files"),
    ("untrusted",),
    ("isolation",),
    ("model",),
    ("airspace.flight_plans",),
    ("cost_to_go",),
    ("refine",),
    ("fusion",),
    ("eikonal",),
    ("certificate",),
    ("restricted",),
    ("networkx_backend",),
    ("motion",),
    ("turning",),
    ("mission",),
    ("airspace.zones", "airspace"),
    ("airspace.plan_check",),
    ("scenarios",),
    ("plots",),
    ("solvers.base", "solvers.budget", "solvers.geometry", "solvers.listing"),
    ("solvers.exact",),
    ("solvers.grid",),
    ("solvers.sampling",),
    ("solvers.geometric",),
    ("solvers.continuous",),
    ("solvers.reactive",),
    ("solvers.registry", "solvers.warm_up"),
    ("solvers.solving", "solvers.refine"),
    ("solvers", "solvers.checks", "solvers.write_listing"),
    ("solvers.trade_off",),
    ("comparisons.files", "comparisons.console", "comparisons.numbers", "comparisons.store"),
    ("comparisons.workers",),
    ("comparisons.statistics",),
    ("comparisons.study",),
    ("comparisons.leaderboard",),
    ("comparisons.tables",),
    ("comparisons.plots",),
    ("comparisons.report",),
    ("comparisons.live",),
    ("comparisons.missions",),
    ("comparisons.results",),
    ("comparisons.conformance",),
    ("comparisons.claims",),
    ("comparisons.claims.paper",),
    ("comparisons.claims.figures",),
    ("comparisons.cli",),
    ("comparisons",),
    # old names of modules: nothing inside uses them
    ("_moved",),
)
FLOOR_OF = {f"cgla_graph.{name}": floor for floor, names in enumerate(FLOORS) for name in names}
#: What the face imports at once, besides old names: the hook by which objects reach functions that stand above them.
HOOK = "cgla_graph._lazy"
BARE = {"solvers", "comparisons"}
#: Every module by its full name; what is reached through the links in the package counts where it really is.
MODULES = {
    ".".join((package, *file.relative_to(folder).with_suffix("").parts)).removesuffix(".__init__"): file
    for folder, package in ((ROOT / "cgla_graph", "cgla_graph"), *((ROOT / n, f"cgla_graph.{n}") for n in sorted(BARE)))
    for file in sorted(folder.rglob("*.py"))
    if not any(parent.is_symlink() for parent in file.parents)
}


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


def module_of(name: str) -> str:
    """Return the module that an imported name is, or is in; nothing if it is not one of ours."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name


def floor_of(module: str) -> int:
    """Return the floor of a module: its own, or that of the package that it is in."""
    while module and module not in FLOOR_OF:
        module = module.rpartition(".")[0]
    return FLOOR_OF[module]


@cache
def imports_of(module: str) -> tuple[str, ...]:
    """Return all names that one of our modules imports."""
    return tuple(imported(ast.parse(MODULES[module].read_text(encoding="utf-8"))))


def faults(names: Iterable[str], module: str) -> list[str]:
    """List the imports of a module that lead up, or that are not under the package's own name."""
    floor = floor_of(module)
    found = []
    for name in names:
        home = module_of(name)
        up = floor_of(home) > floor if home.count(".") else False
        # of the face, everybody may know the version and where it is
        face = home == "cgla_graph" and name not in {"cgla_graph", "cgla_graph.__version__"}
        if name.startswith(".") or name.split(".")[0] in BARE or up or face:
            found.append(name)
    return found


def test_imports_run_down_the_floors() -> None:
    found = {module: faults(imports_of(module), module) for module in MODULES if module != "cgla_graph"}
    assert {module: wrong for module, wrong in found.items() if wrong} == {}


def test_the_face_imports_when_it_is_asked() -> None:
    """It hands on names of all floors, to type checkers and when they are first used."""
    assert {module_of(name) for name in imports_of("cgla_graph")} == {"", HOOK, "cgla_graph._moved"}


def test_no_file_is_in_a_circle() -> None:
    graph = nx.DiGraph()
    for module in MODULES:
        names = {module_of(name) for name in imports_of(module)}
        graph.add_edges_from((module, name) for name in names - {"", "cgla_graph", module})
    circles = [sorted(circle) for circle in nx.strongly_connected_components(graph) if len(circle) > 1]
    assert circles == []


@pytest.mark.parametrize(
    ("source", "module"),
    [
        ("import cgla_graph.solvers", "cgla_graph.model.risk"),
        ("from cgla_graph import solvers", "cgla_graph.scenarios.scenario"),
        ("from cgla_graph.solvers.solving import solve", "cgla_graph.mission.mission"),
        ("from cgla_graph.cost_to_go.repair import repair", "cgla_graph.model.graph"),
        ("from cgla_graph.mission import uav", "cgla_graph.motion.trajectory"),
        ("def late():\n    import cgla_graph.comparisons.cli.app", "cgla_graph.certificate.certificate"),
        ("def late():\n    from cgla_graph import comparisons", "cgla_graph.solvers.solving"),
        (
            "import importlib\nimportlib.import_module('cgla_graph.comparisons.files')",
            "cgla_graph.solvers.registry",
        ),
        ("from . import base", "cgla_graph.solvers.exact.cgla"),
        ("from .base import Traits", "cgla_graph.comparisons.study.rows"),
        ("import solvers", "cgla_graph.comparisons.study.rows"),
        ("from comparisons.rows import row", "cgla_graph.comparisons.cli.app"),
        ("from cgla_graph import Problem", "cgla_graph.comparisons.study.rows"),
    ],
)
def test_a_breach_is_seen(source: str, module: str) -> None:
    assert faults(imported(ast.parse(source)), module)


@pytest.mark.parametrize("source", ["import numpy as np", "import cgla_graph", "import ompl"])
def test_other_imports_are_fine(source: str) -> None:
    assert faults(imported(ast.parse(source)), "cgla_graph.model.risk") == []


def kernel_faults(source: str, module: str) -> list[str]:
    """List what keeps `_kernel` from finding all code that a compiled kernel contains."""
    tree = ast.parse(source)
    decorators = {
        ast.unparse(one).partition("(")[0].rpartition(".")[2]
        for node in ast.walk(tree)
        if isinstance(node, ast.FunctionDef)
        for one in node.decorator_list
    }
    if not decorators & {"kernel", "njit", "jit"}:
        return []
    wrong = [] if module.endswith("_kernels") and "kernel" in decorators else ["name of the module"]
    for node in ast.walk(tree):
        if isinstance(node, ast.Import | ast.ImportFrom) and "cgla_graph" in ast.unparse(node):
            home = node.module if isinstance(node, ast.ImportFrom) and node in tree.body else ""
            if home not in {"cgla_graph._kernel", "cgla_graph._types"} and not str(home).endswith("_kernels"):
                wrong.append(ast.unparse(node))
    return wrong


def test_compiled_code_never_gets_stale() -> None:
    """`_kernel` tells by the names and the form of imports which texts a kernel is compiled from."""
    found = {name: kernel_faults(file.read_text(encoding="utf-8"), name) for name, file in MODULES.items()}
    assert {name: wrong for name, wrong in found.items() if wrong} == {}


@pytest.mark.parametrize(
    ("lines", "name"),
    [
        ("", "cgla_graph.model.risk_kernel"),
        ("import cgla_graph.model.risk_kernels", "cgla_graph.model.a_kernels"),
        ("from cgla_graph.model import risk_kernels", "cgla_graph.model.a_kernels"),
        ("from cgla_graph.model.risk import LIMIT", "cgla_graph.model.a_kernels"),
        ("if True:\n    from cgla_graph.model.risk_kernels import erf", "cgla_graph.model.a_kernels"),
    ],
)
def test_stale_code_is_seen(lines: str, name: str) -> None:
    source = "from cgla_graph._kernel import kernel\n%s\n@kernel\ndef f(x): return x"
    good = "from cgla_graph.model.risk_kernels import erf"
    assert kernel_faults(source % lines, name)
    assert not kernel_faults(source % good, "cgla_graph.model.a_kernels")


def test_every_folder_with_modules_is_installed() -> None:
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["setuptools"]
    packages = {name if file.name == "__init__.py" else name.rpartition(".")[0] for name, file in MODULES.items()}
    assert set(settings["packages"]) == packages


def test_every_package_says_what_is_inside() -> None:
    for module, file in MODULES.items():
        if (file.name == "__init__.py" and module.count(".") > 1) or module.removeprefix("cgla_graph.") in FLOOR_OF:
            tree = ast.parse(file.read_text(encoding="utf-8"))
            assert ast.get_docstring(tree), module


def test_no_folder_is_a_hall() -> None:
    """Who opens one knows where to look."""
    counts = Counter(file.parent for file in MODULES.values())
    assert {folder.name: count for folder, count in counts.items() if count > 26} == {}


@pytest.mark.parametrize("layer", ["solvers", "comparisons"])
def test_the_links_lead_to_the_folders(layer: str) -> None:
    link = ROOT / "cgla_graph" / layer
    if not link.is_symlink():
        pytest.skip("this checkout has no symbolic links")
    assert link.resolve() == ROOT / layer
    assert not link.readlink().is_absolute()


def test_no_name_of_a_package_is_that_of_a_module_in_it() -> None:
    """Importing the module would put it in the name's place."""
    for name, file in MODULES.items():
        if file.name == "__init__.py":
            package = importlib.import_module(name)
            inside = {path.stem for path in file.parent.iterdir() if path.suffix == ".py" or any(path.glob("*.py"))}
            names = {one for one, value in vars(package).items() if not inspect.ismodule(value)}
            # the face hands on whole packages, too
            assert inside & {*names, *getattr(package, "__all__", ())} <= {"solvers", "comparisons"}, name
