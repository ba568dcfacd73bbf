"""The one decorator of compiled kernels."""

import hashlib
import re
import sys
from collections.abc import Callable
from functools import cache
from pathlib import Path
from typing import Any, ParamSpec, TypeVar, cast

import numba

P = ParamSpec("P")
R = TypeVar("R")

#: Modules of kernels whose names a module of kernels takes over.
_IMPORTS = re.compile(r"^from ([\w.]+_kernels) import", flags=re.MULTILINE)


def kernel(function: Callable[P, R]) -> Callable[P, R]:
    """
    Compile a numeric function with numba and keep the machine code on disk.

    Numba ships no type hints, so this keeps the hints of the function it is given. Floats are IEEE: no
    fast-math, because kernels promise exact predicates and error bounds.

    Numba looks only at a kernel's **own** file to tell whether kept code is stale, while that code contains the kernels
    that it calls and the constants that it takes from other files. So the code of each module is kept in a folder that
    is named after the text of the module and of all modules of kernels (``…_kernels``) that it imports, below
    ``NUMBA_CACHE_DIR``, or else beside the source.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5)
    0.5204998778
    """
    file = Path(function.__code__.co_filename)
    # (it takes its settings from the environment when it is imported, which no type checker sees)
    settings = cast("Any", numba.config)
    kept = settings.CACHE_DIR
    settings.CACHE_DIR = str(Path(kept or file.parent / "__pycache__", f"kernels-{_digest(file)[:16]}"))
    try:
        return cast("Callable[P, R]", numba.njit(cache=True, nogil=True)(function))
    finally:
        settings.CACHE_DIR = kept


def is_kept(compiled: Callable[..., object]) -> bool:
    """
    Tell whether machine code of a kernel is on disk, so that it need not be compiled.

    Examples
    --------
    >>> from cgla_graph.model.risk_kernels import erf
    >>> erf(0.5), is_kept(erf)
    (0.5204998778, True)
    """
    code = cast("Any", compiled).py_func.__code__
    names = f"{Path(code.co_filename).stem}.{code.co_name}-*.nbi"
    return any(Path(cast("Any", compiled).stats.cache_path).glob(names))


@cache
def _digest(file: Path) -> str:
    """Return a digest of the text of a module and of the modules of kernels that it imports."""
    text = file.read_text(encoding="utf-8")
    imported = [sys.modules[name].__file__ for name in sorted(set(_IMPORTS.findall(text))) if name in sys.modules]
    parts = [text, *(_digest(Path(source)) for source in imported if source is not None)]
    return hashlib.sha256("\0".join(parts).encode()).hexdigest()
