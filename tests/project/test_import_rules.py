"""Rules of imports that import-linter (`make lint`) does not know: by string, under other names, of kernels."""

import ast
import importlib
import inspect
import re
import tomllib
from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path

import networkx as nx
import pytest

ROOT = Path(__file__).resolve().parents[2]
#: What the face imports at once, besides old names: the hook by which objects reach functions that stand above them.
HOOK = "cgla_graph._lazy"
BARE = {"solvers", "comparisons"}
#: Modules that import others of ours, or what they are handed, by string.
BY_STRING = {
    *("_lazy", "_machine_code", "_moved", "cgla_graph", "isolation.worker", "model.isolated", "solvers.registry"),
    *("comparisons.claims.artefact", "comparisons.claims.catalogue", "comparisons.cli.commands"),
    "comparisons.study.runner",
}
#: Functions that import by string.
STRING_IMPORTS = {"import_module", "__import__"}
#: Every module by its full name; what is reached through the links in the package counts where it really is.
MODULES = {
    ".".join((package, *file.relative_to(folder).with_suffix("").parts)).removesuffix(".__init__"): file
    for folder, package in ((ROOT / "cgla_graph", "cgla_graph"), *((ROOT / n, f"cgla_graph.{n}") for n in sorted(BARE)))
    for file in sorted(folder.rglob("*.py"))
    if not any(parent.is_symlink() for parent in file.parents)
}


def statements(node: ast.AST) -> Iterator[ast.AST]:
    """List all statements in a node, without what they are made of, of which there is much more."""
    for field in ("body", "orelse", "finalbody", "handlers", "cases"):
        for one in getattr(node, field, ()):
            yield one
            yield from statements(one)


def by_string(node: ast.AST) -> list[ast.expr]:
    """Return the arguments of an import by string; none of another node."""
    if not isinstance(node, ast.Call):
        return []
    name = node.func.attr if isinstance(node.func, ast.Attribute) else getattr(node.func, "id", "")
    return node.args if name in STRING_IMPORTS else []


def imported(nodes: Iterable[ast.AST]) -> Iterator[str]:
    """List every imported name in full, wherever the import stands; a relative one begins with a dot."""
    for node in nodes:
        if isinstance(node, ast.Import):
            yield from (alias.name for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            start = "." * node.level + (node.module or "")
            yield from (f"{start}.{alias.name}" for alias in node.names)
        yield from (str(part.value) for part in by_string(node) if isinstance(part, ast.Constant))


def module_of(name: str) -> str:
    """Return the module that an imported name is, or is in; nothing if it is not one of ours."""
    while name and name not in MODULES:
        name = name.rpartition(".")[0]
    return name


@cache
def nodes_of(module: str) -> tuple[ast.AST, ...]:
    """Return the nodes of the syntax tree of one of our modules that may import."""
    text = MODULES[module].read_text(encoding="utf-8")
    nodes = ast.walk if any(name in text for name in STRING_IMPORTS) else statements
    return tuple(node for node in nodes(ast.parse(text)) if isinstance(node, ast.Import | ast.ImportFrom | ast.Call))


@cache
def imports_of(module: str) -> tuple[str, ...]:
    """Return all names that one of our modules imports."""
    return tuple(imported(nodes_of(module)))


def test_imports_are_absolute_and_not_of_the_face() -> None:
    """Of the face, only the version and its folder may be known inside."""
    face = {"cgla_graph", "cgla_graph.__version__"}
    for module in MODULES.keys() - {"cgla_graph"}:
        for name in imports_of(module):
            assert not name.startswith("."), (module, name)
            assert name.split(".")[0] not in BARE, (module, name)
            assert module_of(name) != "cgla_graph" or name in face, (module, name)


def test_floors_hold() -> None:
    assert pytest.importorskip("importlinter.cli").lint_imports(no_cache=True) == 0


def test_imports_by_string_are_known() -> None:
    """Import-linter does not see them: lazy names, plug-ins and solvers, commands, claims, modules for a worker."""
    found = set()
    for module in MODULES:
        for name in (words[0] for words in map(by_string, nodes_of(module)) if words):
            if not isinstance(name, ast.Constant) or str(name.value).startswith("cgla_graph"):
                found.add(module.removeprefix("cgla_graph."))
    assert found == BY_STRING


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


def kernel_faults(source: str, module: str) -> list[str]:
    """List what keeps `_kernel` from finding all code that a compiled kernel contains."""
    if not re.search(r"@[\w.]*(kernel|jit)\b", source):
        return []
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
        if file.name == "__init__.py" or module.count(".") == 1:
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
