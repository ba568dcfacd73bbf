"""The decorator of compiled kernels."""

import gc
import hashlib
import importlib
import os
import re
import signal
import sys
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager, suppress
from functools import cache, cached_property, update_wrapper, wraps
from pathlib import Path
from types import FunctionType
from typing import IO, Any, NoReturn, ParamSpec, TypeVar, cast

import numpy as np

from cgla_graph import _machine_code, _progress

if sys.platform != "win32":
    import fcntl

P = ParamSpec("P")
R = TypeVar("R")


@cache
def _numba() -> Any:  # noqa: ANN401 - numba has no hints
    """
    Import numba and its NumPy functions, which it needs before its first kernel, without `scipy.linalg`.

    Numba imports that module only to check that it exists, which takes a tenth of a second; it is imported when a
    kernel multiplies matrices. Another thread might need it meanwhile, so with several threads numba imports it as
    usual.
    """
    threads = len(sys._current_frames())  # noqa: SLF001 - documented, and knows threads that Python did not start
    if sys.modules.keys() & {"numba.np.arraymath", "scipy.linalg"} or threads > 1:
        return importlib.import_module("numba")
    modules = cast("dict[str, object]", sys.modules)
    modules["scipy.linalg"] = None
    try:
        functions = importlib.import_module("numba.np.arraymath")
    finally:
        del modules["scipy.linalg"]
    functions._HAVE_BLAS = True  # type: ignore[attr-defined] # noqa: SLF001 - scipy is always installed with us
    return importlib.import_module("numba")


#: Longest wait for another process that compiles the same kernel before it is compiled here too, and the interval of
#: looking for it, in seconds.
PATIENCE, GLANCE = 60.0, 0.02
#: A lock that is held for longer than this, in seconds, is that of a process that compiles, not of one that loads.
LOADING = 0.5

#: Held while numba's cache folder is set.
_settings_lock = threading.Lock()

#: Finds the modules of kernels that a module of kernels imports names from.
_IMPORTS = re.compile(r"^from ([\w.]+_kernels) import", flags=re.MULTILINE)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """
    Compile a numeric function with numba and keep the machine code on disk.

    The function keeps its own type hints, which numba would lose. Floats are IEEE, without fast-math even if the caller
    has it, because kernels promise exact predicates and error bounds.

    Numba checks only a kernel's **own** file to decide whether stored code is stale, while that code contains the
    kernels that it calls and the constants that it takes from other files. So the code of each module is stored in a
    folder that is named after the text of the module and of all modules of kernels (``…_kernels``) that it imports,
    below ``NUMBA_CACHE_DIR``, or else beside the source. (Where neither is writable, numba stores it elsewhere, without
    that promise.) If several processes need a kernel, one compiles it and the others wait. Kernels may call each other,
    but not themselves, directly or in a cycle.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5)
    0.5204998778
    """
    return cast("Callable[P, R]", _Kernel(function))


def inlined(function: Callable[P, R]) -> Callable[P, R]:
    """
    Compile a `kernel` whose text is put into that of each kernel that calls it.

    A call with arrays takes some 20 ns, which counts where the kernel itself takes 50.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import _risk_of_one
    >>> type(_risk_of_one) is type(kernel(_risk_of_one._function))
    True
    """
    return cast("Callable[P, R]", _Kernel(function, inline="always"))


def _no_fingerprint(_: object) -> NoReturn:
    raise NotImplementedError


_parts = _machine_code.parts()
#: Return what tells types of arguments apart, as numba does it, or raise NotImplementedError.
_fingerprint: Callable[[tuple[Any, ...]], bytes] = _parts.dispatcher.compute_fingerprint if _parts else _no_fingerprint


class _Kernel:
    """
    A kernel: machine code from disk for each combination of types, and numba's dispatcher where there is none.

    Numba is imported only for the latter.
    """

    def __init__(self, function: Callable[..., object], **options: str) -> None:
        update_wrapper(self, function)
        self._function, self._options = function, options
        self._folder = _folder(Path(function.__code__.co_filename))
        # (by the types of arguments; the numbers are those of arrays)
        self._runs: dict[bytes, tuple[Callable[..., Any], tuple[int, ...]]] = {}

    def __call__(self, *arguments: Any, **named: Any) -> Any:  # noqa: ANN401 - any kernel's
        if named:
            return self.compiled(*arguments, **named)
        try:
            run, arrays = self._runs[_fingerprint(arguments)]
        except (KeyError, NotImplementedError, ValueError):
            return self._first_call(arguments)
        for place in arrays:
            # (fingerprints do not show the order of bytes)
            if not arguments[place].dtype.isnative:
                return self.compiled(*arguments)
        return run(*arguments)

    def __reduce__(self) -> str | tuple[Any, ...]:
        # (numba asks it of kernels that are made inside of functions)
        name = self._function.__qualname__
        return (_dispatcher_itself, (self.compiled,)) if "<locals>" in name else name

    def __getattr__(self, name: str) -> Any:  # noqa: ANN401 - numba's
        if name.startswith("__"):
            raise AttributeError(name)
        return getattr(self.compiled, name)

    @property
    def _numba_type_(self) -> Any:  # noqa: ANN401 - numba has no hints
        """What numba takes this for in the code of other kernels."""
        return self.compiled._numba_type_

    @cached_property
    def compiled(self) -> Any:  # noqa: ANN401 - numba has no hints
        """Numba's dispatcher."""
        return _compiled(self._function, self._folder, **self._options)

    def _first_call(self, arguments: tuple[Any, ...]) -> Any:  # noqa: ANN401 - any kernel's
        """Call the kernel with types of arguments that are new here."""
        file = self.file(arguments)
        if file is None:
            with suppress(NotImplementedError, ValueError):
                self._runs[_fingerprint(arguments)] = self.compiled, ()
            return self.compiled(*arguments)
        run = _machine_code.load(file, self._function)
        if run is not None:
            self._keep(run, arguments)
            return run(*arguments)
        answer = self.compiled(*arguments)
        types = tuple(map(_numba().typeof, arguments))
        if types in self.compiled.overloads:
            self._keep(self.compiled.overloads[types].entry_point, arguments)
            with suppress(Exception):
                # (numba has no public way to its code; another version may keep it otherwise)
                _machine_code.store(file, self.compiled, types)
        return answer

    def _keep(self, run: Callable[..., Any], arguments: tuple[Any, ...]) -> None:
        arrays = (place for place, each in enumerate(arguments) if isinstance(each, np.ndarray))
        self._runs[_fingerprint(arguments)] = run, tuple(arrays)

    def file(self, arguments: tuple[Any, ...]) -> Path | None:
        """Return the file of the machine code for types of arguments, None if it is not kept apart from numba's."""
        function = self._function
        if _parts is None or function.__closure__ or len(arguments) != function.__code__.co_argcount:
            return None
        with suppress(TypeError, NotImplementedError):
            types = _machine_code.types_in_words(arguments)
            return self._folder / _machine_code.file_name(function, _fingerprint(arguments), types)
        return None

    def is_kept(self, arguments: tuple[Any, ...]) -> bool:
        """Return whether there is such a file, or without arguments, any."""
        if arguments:
            file = self.file(arguments)
            return file is not None and file.exists()
        return _parts is not None and any(self._folder.glob(f"{_machine_code.file_begin(self._function)}*.code"))


def _dispatcher_itself(compiled: Any) -> Any:  # noqa: ANN401 - numba has no hints
    return compiled


def _folder(source: Path) -> Path:
    """Return the folder of the code of a module of kernels."""
    # (numba takes its settings from the environment when it is imported)
    numba = sys.modules.get("numba")
    kept = numba.config.CACHE_DIR if numba else os.environ.get("NUMBA_CACHE_DIR")
    return Path(kept or source.parent / "__pycache__", f"kernels-{_digest(source)[:16]}")


def _compiled(function: Callable[..., object], folder: Path, **options: str) -> Any:  # noqa: ANN401 - numba's
    """Return numba's dispatcher of a kernel."""
    compiled = _dispatcher(function, folder, **options)

    @cache
    def called() -> Any:  # noqa: ANN401 - numba has no hints
        # (the name keeps its code on disk apart from that of the other dispatcher)
        same = FunctionType(
            function.__code__, function.__globals__, function.__name__, function.__defaults__, function.__closure__
        )
        same.__qualname__ = f"{function.__qualname__}.called"
        return _dispatcher(same, folder, no_cpython_wrapper=True)

    # Most kernels are only called by kernels. The code for calls from Python, such as to unpack arrays, is compiled
    # only for kernels that Python calls.
    compiled.get_call_template = lambda types, names: called().get_call_template(types, names)
    compiled.get_overload = lambda signature: called().get_overload(signature)
    return compiled


def _dispatcher(function: Callable[..., object], folder: Path, **options: bool | str) -> Any:  # noqa: ANN401 - the same
    """Return numba's dispatcher of a function, which stores its code in a folder."""
    with _uninterrupted(), _settings_lock:
        numba = _numba()
        kept = numba.config.CACHE_DIR
        numba.config.CACHE_DIR = str(folder)
        try:
            # (kernels are not passed as values and need no entry as C functions; numba takes other options from the
            # caller)
            compiled = numba.njit(
                cache=True, nogil=True, fastmath=False, error_model="python", no_cfunc_wrapper=True, **options
            )(function)
        finally:
            numba.config.CACHE_DIR = kept
    compiled.compile = _in_one_process(compiled)
    # (numba calls it only for code that is not on disk)
    compiled._compiler.compile = _announced(compiled._compiler)  # noqa: SLF001 - numba has no public way
    return compiled


class Intrinsic:
    """
    A function of kernels that writes instructions itself; numba, which it is made of, is imported when one is compiled.

    Parameters
    ----------
    function
        As `numba.extending.intrinsic` takes it.
    """

    def __init__(self, function: Callable[..., Any]) -> None:
        self._function = function

    @cached_property
    def _numba_type_(self) -> Any:  # noqa: ANN401 - numba has no hints
        """What numba takes this for."""
        own = importlib.import_module("numba.extending").intrinsic(self._function)
        types = importlib.import_module("numba.core.registry").cpu_target.typing_context
        types.refresh()
        return types.resolve_value_type(own)


def _announced(compiler: Any) -> Callable[..., Any]:  # noqa: ANN401 - numba has no hints
    """Return the method of numba that compiles a kernel, which says first that it does."""

    def compile_(*given: Any) -> Any:  # noqa: ANN401 - the same
        with _progress.while_compiling():
            return type(compiler).compile(compiler, *given)

    return compile_


def _in_one_process(compiled: Any) -> Callable[[Any], Any]:  # noqa: ANN401 - numba has no hints
    """Return the function that compiles a kernel or loads it from disk, in one process at a time."""
    compile_, lock = compiled.compile, importlib.import_module("numba.core.compiler_lock").global_compiler_lock

    @wraps(compile_)
    def compile_once(signature: Any) -> Any:  # noqa: ANN401 - the same
        # Every thread takes numba's own lock first, and calls of kernels form no cycle: so processes cannot deadlock.
        with _uninterrupted(), lock, _locked(Path(compiled.stats.cache_path, f"{compiled.__name__}.lock")):
            collects = gc.isenabled()
            # compiling makes hundreds of thousands of objects and little garbage
            gc.disable()
            try:
                return compile_(signature)
            finally:
                if collects:
                    gc.enable()

    return compile_once


@contextmanager
def _uninterrupted() -> Iterator[None]:
    """
    Raise `KeyboardInterrupt` at the end only, when the outermost kernel is compiled, if Ctrl-C is Python's own.

    Raised as numba takes its lock, it would leave that taken, and other threads would wait for ever; objects of LLVM
    that are half made may free memory twice.
    """
    ours = signal.getsignal(signal.SIGINT) is signal.default_int_handler
    if not ours or threading.current_thread() is not threading.main_thread():
        yield
        return
    came: list[int] = []
    signal.signal(signal.SIGINT, lambda number, _: came.append(number))
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, signal.default_int_handler)
    if came:
        raise KeyboardInterrupt


@contextmanager
def _locked(file: Path) -> Iterator[None]:
    """Hold a lock on a file, if the file system has locks; it ends with the process at the latest."""
    try:
        file.parent.mkdir(parents=True, exist_ok=True)
        lock = file.open("ab")
    except OSError:
        yield
        return
    with lock:
        if sys.platform != "win32":
            # (a file system may have no locks)
            with suppress(OSError):
                _lock(lock)
        yield


def _lock(file: IO[bytes]) -> None:
    """Lock a file as soon as other processes let go of it, or else when the wait has been long enough."""
    began = time.monotonic()
    with ExitStack() as stack:
        is_said = False
        while (waited := time.monotonic() - began) < PATIENCE:
            with suppress(BlockingIOError):
                fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                return
            if waited > LOADING and not is_said:
                stack.enter_context(_progress.while_compiling())
                is_said = True
            time.sleep(GLANCE)


def is_kept(compiled: Callable[..., object], *arguments: object) -> bool:
    """
    Return whether machine code of a kernel is on disk, so that it need not be compiled for calls from Python.

    The code has to fit the types of the given arguments; without arguments, any code counts.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5), is_kept(erf), is_kept(erf, 0.25), is_kept(erf, None)
    (0.5204998778, True, True, False)
    """
    found = cast("_Kernel", compiled)
    if found.is_kept(arguments):
        return True
    kept: list[Any] = []
    with suppress(Exception):
        # (numba has no public way to ask; an unreadable index counts as none)
        kept = [signature for signature, *_ in found.compiled._cache._cache_file._load_index()]  # noqa: SLF001
    return tuple(map(_numba().typeof, arguments)) in kept if arguments else bool(kept)


@cache
def _digest(file: Path) -> str:
    """Return a digest of the text of a module and of the modules of kernels that it imports."""
    text = file.read_text(encoding="utf-8")
    imported = [sys.modules[name].__file__ for name in sorted(set(_IMPORTS.findall(text))) if name in sys.modules]
    parts = [text, *(_digest(Path(source)) for source in imported if source is not None)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
