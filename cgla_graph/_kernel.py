"""The one decorator of compiled kernels, and the kind of array that they are compiled for."""

import gc
import hashlib
import importlib
import re
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import cache, wraps
from pathlib import Path
from types import FunctionType
from typing import Any, ParamSpec, TypeVar, cast

import numba
import numpy as np
from numba.core.compiler_lock import global_compiler_lock

if sys.platform != "win32":
    import fcntl

P = ParamSpec("P")
R = TypeVar("R")
ArrayT = TypeVar("ArrayT", bound=np.ndarray[Any, Any])


def _import_numpy_functions() -> None:
    """
    Import numba's NumPy functions, which it does before its first kernel, but not `scipy.linalg` along with them.

    Numba only looks whether that is there, and that takes a tenth of a second; who multiplies matrices gets it then.
    Another thread might miss it meanwhile, so where there are some, numba is left to itself.
    """
    threads = len(sys._current_frames())  # noqa: SLF001 - documented, and knows threads that Python did not start
    if sys.modules.keys() & {"numba.np.arraymath", "scipy.linalg"} or threads > 1:
        return
    modules = cast("dict[str, object]", sys.modules)
    modules["scipy.linalg"] = None
    try:
        functions = importlib.import_module("numba.np.arraymath")
    finally:
        del modules["scipy.linalg"]
    functions._HAVE_BLAS = True  # type: ignore[attr-defined] # noqa: SLF001 - scipy is always installed with us


_import_numpy_functions()

#: How long to wait for another process that compiles the same kernel before it is compiled here too, and how often to
#: look, in seconds.
PATIENCE, GLANCE = 60.0, 0.02

#: Kernels that are being compiled, or loaded from disk, and for which types.
_under_way: list[tuple[Any, Any]] = []

#: Held while numba is told where to keep code.
_settings_lock = threading.Lock()

#: Modules of kernels whose names a module of kernels takes over.
_IMPORTS = re.compile(r"^from ([\w.]+_kernels) import", flags=re.MULTILINE)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """
    Compile a numeric function with numba and keep the machine code on disk.

    The function keeps its own type hints, which numba would lose. Floats are IEEE: no
    fast-math, also where its caller has it, because kernels promise exact predicates and error bounds.

    Numba looks only at a kernel's **own** file to tell whether kept code is stale, while that code contains the kernels
    that it calls and the constants that it takes from other files. So the code of each module is kept in a folder that
    is named after the text of the module and of all modules of kernels (``…_kernels``) that it imports, below
    ``NUMBA_CACHE_DIR``, or else beside the source. (Where neither can be written to, numba keeps it elsewhere, without
    that promise.) Of several processes that need a kernel, one compiles it and the others wait for it. Kernels may call
    each other, but in no circle, and not themselves.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5)
    0.5204998778
    """
    compiled = _dispatcher(function)

    @cache
    def called() -> Any:  # noqa: ANN401 - numba has no hints
        # (by its name, numba tells its code on disk from that of the other one)
        same = FunctionType(
            function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
        )
        same.__qualname__ = f"{function.__qualname__}.called"
        return _dispatcher(same, no_cpython_wrapper=True)

    # Most kernels are called by kernels alone. What a call from Python needs besides, as to unpack arrays, is compiled
    # only where there is one.
    compiled.get_call_template = lambda types, names: called().get_call_template(types, names)
    compiled.get_overload = lambda signature: called().get_overload(signature)
    return cast("Callable[P, R]", compiled)


def _dispatcher(function: Callable[..., object], **options: bool) -> Any:  # noqa: ANN401 - the same
    """Return what numba compiles a function with, and keeps the code of in a folder of the kernel's own."""
    file = Path(function.__code__.co_filename)
    # (it takes its settings from the environment when it is imported, which no type checker sees)
    settings = cast("Any", numba.config)
    with _settings_lock:
        kept = settings.CACHE_DIR
        settings.CACHE_DIR = str(Path(kept or file.parent / "__pycache__", f"kernels-{_digest(file)[:16]}"))
        try:
            # (kernels are not passed as values: they need no second entry, as C functions. What is not said here, numba
            # takes from the caller. Options that have no hints)
            compiled = cast("Any", numba.njit)(
                cache=True, nogil=True, fastmath=False, error_model="python", no_cfunc_wrapper=True, **options
            )(function)
        finally:
            settings.CACHE_DIR = kept
    compiled.compile = _in_one_process(compiled)
    return compiled


def _in_one_process(compiled: Any) -> Callable[[Any], Any]:  # noqa: ANN401 - numba has no hints
    """Return how a kernel is compiled, or loaded from disk: by one process at a time."""
    compile_ = compiled.compile

    @wraps(compile_)
    def compile_once(signature: Any) -> Any:  # noqa: ANN401 - the same
        # Numba's own lock comes first in every thread, and kernels call one another in no circle: so there is never a
        # circle of processes that wait for each other.
        with global_compiler_lock, _locked(Path(compiled.stats.cache_path, f"{compiled.__name__}.lock")):
            collects = gc.isenabled()
            # compiling makes objects by the hundred thousand and little garbage
            gc.disable()
            _under_way.append((compiled, signature))
            try:
                return compile_(signature)
            finally:
                _under_way.pop()
                if collects:
                    gc.enable()

    return compile_once


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    """Hold a file locked, which ends with the process at the latest; without, where that cannot be had."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        lock = file.open("ab")
    except OSError:
        yield
        return
    with lock:
        if sys.platform != "win32":
            latest = time.monotonic() + PATIENCE
            while time.monotonic() < latest:
                try:
                    fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
                    break
                except BlockingIOError:
                    time.sleep(GLANCE)
                except OSError:
                    # a file system that knows no locks
                    break
        yield


def fixed(array: ArrayT) -> ArrayT:
    """
    Return a view of an array, or a copy in C order if it is in another, that cannot be written to.

    Kernels tell arrays that can be written to from others, and are compiled for each: all that they only read is fixed.

    Examples
    --------
    >>> fixed(np.zeros((2, 2)).T).flags.writeable
    False
    """
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return cast("ArrayT", view)


def is_kept(compiled: Callable[..., object], *arguments: object) -> bool:
    """
    Tell whether machine code of a kernel is on disk, so that it need not be compiled for calls from Python.

    Code serves the types of some arguments; if none are given, any code counts.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5), is_kept(erf), is_kept(erf, 0.25), is_kept(erf, None)
    (0.5204998778, True, True, False)
    """
    kept = _kept_signatures(compiled)
    return tuple(map(cast("Any", numba).typeof, arguments)) in kept if arguments else bool(kept)


def _kept_signatures(compiled: Any) -> list[Any]:  # noqa: ANN401 - numba has no hints
    """List the types of arguments that machine code is on disk for."""
    try:
        # (numba has no public way to ask)
        index = compiled._cache._cache_file._load_index()  # noqa: SLF001 - see above
    except Exception:  # noqa: BLE001 - an index that cannot be read is as good as none
        return []
    return [signature for signature, *_ in index]


def is_compiling() -> bool:
    """
    Tell whether kernels are being compiled whose machine code is not on disk.

    Examples
    --------
    >>> is_compiling()
    False
    """
    return any(signature not in _kept_signatures(compiled) for compiled, signature in tuple(_under_way))


@cache
def _digest(file: Path) -> str:
    """Return a digest of the text of a module and of the modules of kernels that it imports."""
    text = file.read_text(encoding="utf-8")
    imported = [sys.modules[name].__file__ for name in sorted(set(_IMPORTS.findall(text))) if name in sys.modules]
    parts = [text, *(_digest(Path(source)) for source in imported if source is not None)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
