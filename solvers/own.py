"""
Solvers of people's own that are not installed: classes in files, and instances.

Each is known in this process by a name with a part of its digest, so that a changed one has another name. Classes
travel to worker processes by value, with what their module defines.
"""

import dataclasses
import hashlib
import inspect
import re
import sys
import sysconfig
from contextlib import redirect_stdout
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, cast

from cgla_graph._text import place, shown
from cgla_graph.errors import CglaError, SolverSettingError, SolverUnavailableError
from cgla_graph.model.solver import Solver, Traits
from cgla_graph.untrusted.files import read_bytes

#: A class in a file, as ``./detour.py:Detour``.
_IN_FILE = re.compile(r"(?P<path>.+\.py):(?P<attribute>[^\W\d]\w*)", re.IGNORECASE | re.DOTALL)
#: Separates the name of a class from a part of its digest, and how many digits that has.
MARK, DIGITS = "@", 12


@dataclass(frozen=True)
class OwnSolver:
    """
    A solver class that is not installed.

    Attributes
    ----------
    kind
        The class.
    label
        Its name in tables: ``detour.py:Detour`` of a file, ``Detour`` of an instance.
    digest
        SHA-256 of its source.
    """

    kind: type[Solver]
    label: str
    digest: str

    @property
    def name(self) -> str:
        """Its name as a solver, which differs where its source differs."""
        return f"{self.label}{MARK}{self.digest[:DIGITS]}"


_known: dict[str, OwnSolver] = {}


def adopt(own: OwnSolver) -> OwnSolver:
    """Make a solver known in this process under its name."""
    return _known.setdefault(own.name, own)


def find(name: str) -> OwnSolver | None:
    """
    Return the own solver of a name, from its file if it names one; None for other names.

    Raises
    ------
    SolverUnavailableError
        If the file cannot be read or imported, has no such class, or the class is no solver; or if the name is that of
        an own solver that is not known here.

    Examples
    --------
    >>> find("cgla") is None
    True
    """
    if name in _known:
        return _known[name]
    if is_in_file(name):
        return _in_file(name)
    if is_forgotten(name):
        msg = f"solver {shown(name)} is not installed: give its file again, as ./FILE.py:Class, or an instance of it"
        raise SolverUnavailableError(msg)
    return None


def is_forgotten(name: str) -> bool:
    """
    Return whether a name, such as one in a stored study, is that of an own solver that is not known in this process.

    Examples
    --------
    >>> is_forgotten("detour.py:Detour@0123456789ab"), is_forgotten("cgla")
    (True, False)
    """
    return MARK in name and name not in _known


def is_in_file(name: str) -> bool:
    """
    Return whether a name is that of a class in a file.

    Examples
    --------
    >>> is_in_file("./detour.py:Detour"), is_in_file("cgla")
    (True, False)
    """
    return _IN_FILE.fullmatch(name) is not None


def of_instance(solver: Solver) -> tuple[OwnSolver, dict[str, Any]]:
    """
    Return the class of an instance as an own solver, and the settings that differ from its defaults.

    Raises
    ------
    SolverSettingError
        If the class is no dataclass, so that its settings are not known.
    """
    kind = type(solver)
    if not dataclasses.is_dataclass(kind):
        msg = f"the solver {kind.__name__} is no dataclass, so that its settings are not known; decorate its class"
        raise SolverSettingError(msg)
    given = {field.name: getattr(solver, field.name) for field in dataclasses.fields(kind) if field.init}
    defaults = {field.name: _default(field) for field in dataclasses.fields(kind)}
    settings = {name: value for name, value in given.items() if not _same(value, defaults[name])}
    module = sys.modules.get(kind.__module__)
    if module is not None and not _travels_by_name(module):
        _by_value().register_pickle_by_value(module)
    source = _source(kind, module)
    return adopt(OwnSolver(cast("type[Solver]", kind), kind.__name__, hashlib.sha256(source).hexdigest())), settings


def _in_file(name: str) -> OwnSolver:
    """Load the class of a name such as ``./detour.py:Detour``."""
    kind, path, digest = load(name, f"solver {shown(name)}")
    check_kind(kind, f"{place(path)}: {name.rpartition(':')[2]}")
    return adopt(OwnSolver(kind, f"{path.name}:{name.rpartition(':')[2]}", digest))


def load(name: str, where: str) -> tuple[Any, Path, str]:
    """
    Run a file of the user's, once in a process, and return its names.

    Parameters
    ----------
    name
        As ``./detour.py:Detour``.
    where
        What needs it, for errors.

    Returns
    -------
    value, path, digest
        What the name stands for, the file, and SHA-256 of its bytes.

    Raises
    ------
    SolverUnavailableError
        If the file cannot be read or run, or has no such name.
    """
    match = _IN_FILE.fullmatch(name)
    if match is None:
        msg = f"{where} is no name in a file; write it as ./FILE.py:NAME"
        raise SolverUnavailableError(msg)
    path, attribute = Path(match["path"]), match["attribute"]
    module = load_module(path, where)
    if not hasattr(module, attribute):
        own = [key for key, one in vars(module).items() if getattr(one, "__module__", None) == module.__name__]
        known = f"it has {', '.join(own)}" if own else "it has no class and no function of its own"
        msg = f"{where}: {place(path)} has no {attribute}; {known}"
        raise SolverUnavailableError(msg)
    return getattr(module, attribute), path, module.__name__.rpartition("_")[2]


def load_module(path: str | Path, where: str) -> ModuleType:
    """
    Run a file of the user's, once in a process, as a module that travels by value.

    Raises
    ------
    SolverUnavailableError
        If the file cannot be read or run; `where` says what needs it.
    """
    try:
        data = read_bytes(path)
    except CglaError as error:
        msg = f"{where}: {error}"
        raise SolverUnavailableError(msg) from error
    return _module(Path(path).resolve(), hashlib.sha256(data).hexdigest(), data)


def check_kind(kind: object, where: str) -> None:
    """
    Refuse an object that is no class of solvers.

    Raises
    ------
    SolverUnavailableError
        If it is no dataclass, or has no traits.
    """
    if not (
        isinstance(kind, type) and dataclasses.is_dataclass(kind) and isinstance(getattr(kind, "traits", None), Traits)
    ):
        msg = f"{where} is no solver: it has to be a dataclass with traits"
        raise SolverUnavailableError(msg)


@cache
def _module(path: Path, digest: str, data: bytes) -> ModuleType:
    """Run a file as a module that travels by value; what it prints goes to standard error."""
    name = f"cgla_own_{path.stem}_{digest}"
    module = ModuleType(name)
    module.__file__ = str(path)
    sys.modules[name] = module
    if str(path.parent) not in sys.path:
        # what it imports from its own folder is found, and hides nothing
        sys.path.append(str(path.parent))
    try:
        with redirect_stdout(sys.stderr):
            exec(compile(data, str(path), "exec"), module.__dict__)  # noqa: S102 - the user's own file
    except (Exception, SystemExit) as error:
        del sys.modules[name]
        msg = f"{place(path)} cannot be imported: {type(error).__name__}: {error}"
        raise SolverUnavailableError(" ".join(msg.split())) from error
    _by_value().register_pickle_by_value(module)
    return module


def _by_value() -> ModuleType:
    """Return the module that pickles classes by value."""
    import cloudpickle  # noqa: PLC0415 - slow to import, and rarely needed

    return cast("ModuleType", cloudpickle)


def _default(field: "dataclasses.Field[Any]") -> object:
    if field.default_factory is not dataclasses.MISSING:
        return field.default_factory()
    return field.default


def _same(value: object, other: object) -> bool:
    try:
        return type(value) is type(other) and bool(value == other)
    except Exception:  # noqa: BLE001 - arrays, and anything else
        return False


def _travels_by_name(module: ModuleType) -> bool:
    """Return whether a module is installed or part of Python, so that workers can import it."""
    file = getattr(module, "__file__", None)
    if module.__name__ == "__main__" or file is None:
        # (cloudpickle sends what it cannot import by value)
        return True
    homes = [Path(sysconfig.get_path(key)).resolve() for key in ("purelib", "platlib", "stdlib")]
    return module.__name__.startswith("cgla_graph.") or any(Path(file).resolve().is_relative_to(home) for home in homes)


def _source(kind: type, module: ModuleType | None) -> bytes:
    """Return the text of a class's module; of a program or a notebook, that of the class."""
    try:
        of_program = module is None or module.__name__ == "__main__"
        return inspect.getsource(kind if of_program else cast("ModuleType", module)).encode()
    except (OSError, TypeError):
        return bytes(_by_value().dumps(kind))
