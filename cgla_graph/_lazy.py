"""Lazy imports: the names in a package's ``__init__.pyi``, and functions on higher floors than their callers."""

import sys
from collections.abc import Callable
from importlib import import_module
from typing import Any, cast

_importers: list[Callable[[str], Any]] = []


def set_importer(importer: Callable[[str], Any]) -> None:
    """Set the function that imports a name of the package; ``cgla_graph`` does this when it is imported."""
    _importers[:] = [importer]


def function_above(name: str) -> Any:  # noqa: ANN401 - `plot`, `animate`, `flyable` or `html`
    """
    Import a function from a higher floor than the caller, when it is called.

    Examples
    --------
    >>> function_above("flyable").__module__
    'cgla_graph.turning.flyable'
    """
    return _importers[0](name)


def lazy(package: str) -> tuple[Callable[[str], Any], Callable[[], list[str]], list[str]]:
    """
    Return `__getattr__`, `__dir__` and `__all__` of a package (PEP 562).

    Type checkers read the same stub, in which each name is one line: ``from home import name as name``, or
    ``alias = name``. What comes from the package itself (``from package import name as name``) is a sub-package.

    Examples
    --------
    >>> import cgla_graph.solvers
    >>> "solve" in lazy("cgla_graph.solvers")[2]
    True
    """
    module = sys.modules[package]
    stub = cast("Any", module.__loader__).get_data(f"{module.__file__}i").decode()
    homes: dict[str, tuple[str, str]] = {}
    public = []
    for line in stub.splitlines():
        match line.split():
            case ["from", home, "import", attribute, *alias]:
                homes[attribute] = (home, attribute)
                public += alias[1:]
            case [alias, "=", name]:
                homes[alias] = homes[name]
                public.append(alias)

    def get(name: str) -> Any:  # noqa: ANN401 - any of the names in the stub
        if name not in public:
            msg = f"module {package!r} has no attribute {name!r}"
            raise AttributeError(msg)
        home, attribute = homes[name]
        found = import_module(f"{home}.{attribute}") if home == package else getattr(import_module(home), attribute)
        setattr(module, name, found)
        return found

    return get, lambda: sorted({*public, *vars(module)}), sorted(public)
