"""
Machine code of kernels on disk, loaded without numba.

To import numba and to make it ready takes longer than most plans. Machine code that numba has compiled is linked by
LLVM alone, as numba does it: the same code gives the same floats. Where anything is unusual (settings of numba's, types
of arguments that are not plain, code that needs what is not there), there is no such code, and numba is asked.
"""

import builtins
import ctypes
import hashlib
import importlib
import importlib.machinery
import importlib.util
import json
import os
import pickle
import sys
import threading
from collections.abc import Callable, Mapping
from contextlib import suppress
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple, cast

import numpy as np

#: Settings of numba's, as environment variables, that leave machine code as it is; with any other, numba is asked.
HARMLESS = {"NUMBA_CACHE_DIR", "NUMBA_NUM_THREADS", "NUMBA_THREADING_LAYER", "NUMBA_COLOR_SCHEME"}
#: Functions of the C library that numba has its own addresses of; they have the same names.
_MATH = (
    *("acos", "acosh", "asin", "asinh", "atan", "atan2", "atanh", "ceil", "cos", "cosh", "exp", "expm1", "fabs"),
    *("floor", "fmod", "log", "log10", "log1p", "pow", "round", "sin", "sinh", "sqrt", "tan", "tanh", "trunc"),
)

#: Names of types that numba's dispatcher wants to be told of.
_NUMBERS = (
    *("int8", "int16", "int32", "int64", "uint8", "uint16", "uint32", "uint64"),
    *("float16", "float32", "float64", "complex64", "complex128"),
)

#: Held while code is linked: LLVM is not made for several threads.
_lock = threading.Lock()
#: What loaded code needs for as long as the process lives.
_alive: list[object] = []


class _NoType:
    """Stands for a type of numba's that no argument has."""


class Parts(NamedTuple):
    """
    Compiled modules of numba's, which do not need the rest of it.

    Attributes
    ----------
    folder
        Numba's own folder.
    dispatcher, functions, helpers, memory
        Its modules: types of arguments, functions that Python calls, and what machine code calls.
    """

    folder: Path
    dispatcher: ModuleType
    functions: ModuleType
    helpers: ModuleType
    memory: ModuleType


@cache
def parts() -> Parts | None:
    """Return numba's compiled modules, None where code is not loaded without numba."""
    changed = {name for name in os.environ if name.startswith("NUMBA_")} - HARMLESS
    if changed or Path(".numba_config.yaml").exists():
        return None
    # (another version of numba may have them otherwise)
    with suppress(ImportError, AttributeError, TypeError, SystemError):
        return _parts()
    return None


def _parts() -> Parts | None:
    """Import numba's compiled modules, from numba if that is there already (errors if it is of another kind)."""
    spec = importlib.util.find_spec("numba")
    folders = (spec and spec.submodule_search_locations) or []
    if not folders:
        return None
    names = "_dispatcher", "_dynfunc", "_helperlib", "core.runtime._nrt_python"
    if "numba" in sys.modules:
        return Parts(Path(folders[0]), *(importlib.import_module(f"numba.{name}") for name in names))
    if len(sys._current_frames()) > 1:  # noqa: SLF001 - documented, and knows threads that Python did not start
        # (another one might import numba meanwhile)
        return None
    # its dispatcher imports this module by its full name
    modules, stand_in = cast("dict[str, Any]", sys.modules), cast("Any", ModuleType("numba"))
    array = stand_in._devicearray = _extension("_devicearray", folders[0])  # noqa: SLF001 - numba's own name
    modules |= {"numba": stand_in, array.__name__: array}
    try:
        found = Parts(Path(folders[0]), *(_extension(name, folders[0]) for name in names))
    finally:
        del modules["numba"], modules[array.__name__]
    # (numba gives it the numbers of types later; by now it needs NumPy)
    found.dispatcher.typeof_init(_NoType, dict.fromkeys(_NUMBERS, 0))
    return found


def _extension(name: str, folder: str) -> ModuleType:
    """Import a compiled module of numba's without numba; numba finds it unimported later."""
    full = f"numba.{name}"
    spec = importlib.machinery.PathFinder.find_spec(full, [str(Path(folder, *name.split(".")[:-1]))])
    if spec is None or spec.loader is None:
        raise ImportError(full)
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    sys.modules.pop(full, None)
    return module


def types_in_words(value: object) -> str:
    """
    Name the types in a value: numbers, arrays of them, None and tuples of these; with others, code is not kept here.

    Raises
    ------
    TypeError
        If there is another type.

    Examples
    --------
    >>> types_in_words((1.0, np.zeros(3), (True,)))
    'tuple(float, ndarray(<f8), tuple(bool))'
    >>> types_in_words(np.zeros(3, ">f8"))
    Traceback (most recent call last):
    TypeError: no machine code is kept for ndarray
    """
    kind = type(value)
    if isinstance(value, tuple) and (kind is tuple or hasattr(kind, "_fields")):
        # (named tuples are plain ones in machine code)
        name = "tuple" if kind is tuple else f"{kind.__module__}.{kind.__qualname__}{getattr(kind, '_fields', ())}"
        return f"{name}({', '.join(map(types_in_words, value))})"
    is_array = kind is np.ndarray or isinstance(value, np.generic)
    array = cast("np.generic", value)
    if is_array and array.flags.aligned and array.dtype.isnative and array.dtype.kind in "biufc":
        return f"{kind.__name__}({array.dtype.str})"
    if kind in {float, int, bool, complex, type(None)}:
        return kind.__name__
    msg = f"no machine code is kept for {kind.__name__}"
    raise TypeError(msg)


@cache
def _environment() -> str:
    """Return a digest of what machine code depends on besides the kernel: versions and the processor."""
    found = parts()
    version = found.folder.joinpath("_version.py").read_text(encoding="utf-8") if found else ""
    words = sys.version, version, importlib.import_module("llvmlite").__version__, *_processor()
    return hashlib.sha256("\0".join(words).encode()).hexdigest()[:16]


@cache
def _processor() -> tuple[str, str, str]:
    """Return the kind of machine, the name of its processor and what that can do."""
    llvm = _llvm()
    features = ""
    with suppress(RuntimeError):
        features = llvm.get_host_cpu_features().flatten()
    return llvm.get_process_triple(), llvm.get_host_cpu_name(), features


def file_name(kernel: Callable[..., object], fingerprint: bytes, types: str) -> str:
    """Return the name of the file with a kernel's code for types of arguments."""
    return f"{file_begin(kernel)}{hashlib.sha256(fingerprint + types.encode()).hexdigest()[:16]}.code"


def file_begin(kernel: Callable[..., object]) -> str:
    """Return what names of files with a kernel's code begin with."""
    name = f"{kernel.__module__.rpartition('.')[2]}.{kernel.__qualname__}-{kernel.__code__.co_firstlineno}"
    return "".join(each if each.isalnum() or each in "._-" else "_" for each in f"{name}-{_environment()}-")


def load(file: Path, kernel: Callable[..., object]) -> Callable[..., Any] | None:
    """Return the function whose machine code a file holds, None if it holds none that works here."""
    found = parts()
    try:
        data = file.read_bytes()
        head, _, code = data.partition(b"\n")
        stored = json.loads(head)
    except (OSError, ValueError):
        return None
    if found is None or not isinstance(stored, dict) or stored.get("digest") != _digest(stored, code):
        return None
    with _lock:
        llvm = _ready()
        if not all(map(llvm.address_of_symbol, stored["outside"])):
            return None
        engine = _engine()
        # (it stays, as does what Python may still call)
        _alive.append(engine)
        engine.add_object_file(llvm.ObjectFileRef.from_data(code))
        engine.finalize_object()
        address = engine.get_function_address(stored["entry"])
        places = {name: engine.get_global_value_address(name) for name in stored["environments"]}
        if not address or not all(places.values()):
            return None
        environments = {name: found.functions.Environment({}) for name in places}
        for name, types in stored["environments"].items():
            environments[name].consts.extend(map(np.dtype, types))
            ctypes.c_void_p.from_address(places[name]).value = id(environments[name])
        _alive.append(environments)
        module, own = sys.modules[kernel.__module__], environments[stored["environment"]]
        run = found.functions.make_function(module, kernel.__name__, kernel.__doc__ or "", address, own, (engine,))
        return cast("Callable[..., Any]", run)


def store(file: Path, compiled: Any, types: tuple[Any, ...]) -> None:  # noqa: ANN401 - numba has no hints
    """
    Write what numba keeps of its dispatcher's code for types of arguments, if it is simple and the folder lets us.

    What it refers to besides code are the types of arrays that it makes.
    """
    with suppress(OSError):
        file.parent.mkdir(parents=True, exist_ok=True)
    if not os.access(file.parent, os.W_OK):
        # (to read what numba keeps would take time in vain, each time)
        return
    cache = compiled._cache  # noqa: SLF001 - numba has no public way
    key = cache._index_key(types, compiled.targetctx.codegen())  # noqa: SLF001 - the same
    kept = cache._cache_file.load(key)  # noqa: SLF001 - the same
    if kept is None:
        return
    (_, kind, library), about, own, _, is_of_objects, lifted, _, first, others = kept
    referred = {one.env_name: one.consts for one in (own, *others)}
    constants = [one for several in referred.values() for one in several]
    simple = all(isinstance(one, np.dtype) and one.isnative and one.kind in "biufc" for one in constants)
    if kind != "object" or not simple or is_of_objects or lifted or first:
        return
    code, text = library
    whole = _llvm().parse_bitcode(text)
    stored = {
        "entry": about.llvm_cpython_wrapper_name,
        "environment": own.env_name,
        "environments": {name: [one.str for one in several] for name, several in referred.items()},
        "outside": sorted(
            one.name
            for one in (*whole.functions, *whole.global_variables)
            if one.is_declaration and not one.name.startswith("llvm.")
        ),
    }
    stored["digest"] = _digest(stored, code)
    part = file.with_name(f"{file.name}.{os.getpid()}.part")
    with suppress(OSError):
        try:
            part.write_bytes(json.dumps(stored).encode() + b"\n" + code)
            part.replace(file)
        finally:
            part.unlink(missing_ok=True)


def _digest(stored: Mapping[str, Any], code: bytes) -> str:
    """Return a digest of what a file holds: LLVM ends the process on code that is broken."""
    rest = {name: value for name, value in stored.items() if name != "digest"}
    return hashlib.sha256(json.dumps(rest).encode() + code).hexdigest()


@cache
def _llvm() -> Any:  # noqa: ANN401 - it has no hints
    """Import the part of llvmlite that links (4 hundredths of a second)."""
    return importlib.import_module("llvmlite.binding")


@cache
def _ready() -> Any:  # noqa: ANN401 - the same
    """Return LLVM with the addresses that machine code needs, as numba sets them."""
    llvm, found = _llvm(), cast("Parts", parts())
    llvm.initialize_native_target()
    llvm.initialize_native_asmprinter()
    addresses = {"_Py_NoneStruct": id(None)}
    for helpers in (found.helpers.c_helpers, found.functions.c_helpers):
        addresses |= {f"numba_{name}": address for name, address in helpers.items()}
    known = found.helpers.c_helpers
    addresses |= {name: known[name] for each in _MATH for name in (each, f"{each}f") if name in known}
    for name, address in found.memory.c_helpers.items():
        addresses[name if name.startswith("_") else f"NRT_{name}"] = address
    if "numba" not in sys.modules:
        # (its own function for this imports it)
        addresses["numba_unpickle"] = cast("int", ctypes.cast(_UNPICKLE, ctypes.c_void_p).value)
    errors = [one for one in vars(builtins).values() if isinstance(one, type) and issubclass(one, BaseException)]
    addresses |= {f"PyExc_{one.__name__}": id(one) for one in errors}
    for name, address in addresses.items():
        llvm.add_symbol(name, address)
    # (with the first engine, it also knows the symbols of libraries of this process)
    _alive.append(_engine())
    return llvm


#: Reads what machine code holds in Python's own format, as the type of arrays and what an error says.
_read = cache(pickle.loads)


def _unpickle(place: int, length: int, _: int) -> object:
    """Return such an object, for machine code."""
    return _read(ctypes.string_at(place, length))


_UNPICKLE = ctypes.PYFUNCTYPE(ctypes.py_object, ctypes.c_void_p, ctypes.c_int, ctypes.c_void_p)(_unpickle)


def _engine() -> Any:  # noqa: ANN401 - the same
    """Return an engine that links code, with numba's settings; the machine is its own and goes with it."""
    llvm = _llvm()
    triple, name, features = _processor()
    models = {"x86": "static", "i386": "static", "i686": "static", "powerpc": "pic", "ppc": "pic"}
    model = next((model for begin, model in models.items() if triple.startswith(begin)), "default")
    target = llvm.Target.from_triple(triple)
    machine = target.create_target_machine(opt=3, cpu=name, features=features, reloc=model, codemodel="jitdefault")
    return llvm.create_mcjit_compiler(llvm.parse_assembly(""), machine)
