"""Compiled kernels: the cache on disk is never stale."""

import functools
import gc
import importlib
import json
import os
import shutil
import signal
import subprocess
import sys
import threading
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numba
import numpy as np
import pytest
from kept_kernels import kept_but_for

from cgla_graph import _kernel, _machine_code, _progress
from cgla_graph._kernel import kernel

INNER = """
from cgla_graph._kernel import kernel

FACTOR = 2.0

@kernel
def inner(x: float) -> float:
    return 3.0 * x
"""
OUTER = """
from cgla_graph._kernel import kernel
from inner_kernels import FACTOR, inner

@kernel
def outer(x: float) -> float:
    return FACTOR * inner(x)
"""
CALL = "import sys; from outer_kernels import outer; print(outer(1.0), 'numba' in sys.modules)"


def answer(folder: Path) -> tuple[float, bool]:
    """Call the outer kernel in a process of its own; return its value, and whether its code came from the cache."""
    # (cached bytecode is stale if both texts have the same second and length)
    done = subprocess.run([sys.executable, "-B", "-c", CALL], cwd=folder, capture_output=True, text=True, check=True)
    words = done.stdout.split()
    return float(words[0]), words[-1] == "False"


@pytest.mark.slow
@pytest.mark.parametrize("chosen", [True, False])
def test_a_kernel_is_compiled_anew_when_one_that_it_calls_changes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, chosen: bool
) -> None:
    """Likewise for constants, and without a chosen folder for compiled code."""
    if chosen:
        monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    else:
        monkeypatch.delenv("NUMBA_CACHE_DIR", raising=False)
    (tmp_path / "inner_kernels.py").write_text(INNER, encoding="utf-8")
    (tmp_path / "outer_kernels.py").write_text(OUTER, encoding="utf-8")
    assert answer(tmp_path) == (6.0, False)
    assert answer(tmp_path) == (6.0, True)
    for before, after, value in (("3.0 * x", "5.0 * x", 10.0), ("FACTOR = 2.0", "FACTOR = 4.0", 20.0)):
        text = (tmp_path / "inner_kernels.py").read_text(encoding="utf-8")
        (tmp_path / "inner_kernels.py").write_text(text.replace(before, after), encoding="utf-8")
        assert answer(tmp_path) == (value, False)
    kept = tmp_path / ("kept" if chosen else "__pycache__")
    # the outer module was one of three texts with what it imports, the inner one as well
    assert len(list(kept.glob("kernels-*"))) == 6


def test_the_cache_of_other_functions_is_left_alone() -> None:
    before = numba.config.CACHE_DIR

    @kernel
    def twice(x: float) -> float:
        return 2.0 * x

    assert "kernels-" in twice.stats.cache_path  # type: ignore[attr-defined]
    assert before == numba.config.CACHE_DIR


def test_the_entry_for_python_is_compiled_only_when_python_calls(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @kernel
    def inner(x: float) -> float:
        return 3.0 * x

    @kernel
    def outer(x: float) -> float:
        return 2.0 * inner(x)

    compiled: Any = inner
    assert outer(1.0) == 6.0
    assert not compiled.signatures
    assert not _kernel.is_kept(inner)
    assert inner(1.0) == 3.0
    assert _kernel.is_kept(inner, 1.0)


BOTH = "import outer_kernels as kernels; print(kernels.outer(1.0), kernels.inner(1.0))"


@pytest.mark.slow
def test_without_a_writable_cache_code_for_kernels_and_for_python_stays_apart(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba then keeps code beside the source, by the names of functions; kernels' code does not serve Python."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", "/dev/null/nowhere")
    (tmp_path / "inner_kernels.py").write_text(INNER, encoding="utf-8")
    (tmp_path / "outer_kernels.py").write_text(OUTER, encoding="utf-8")
    for _ in range(2):
        done = subprocess.run([sys.executable, "-c", BOTH], cwd=tmp_path, capture_output=True, text=True, check=True)
        assert done.stdout == "6.0 3.0\n"
    assert {file.name.split("-")[0] for file in tmp_path.rglob("*.nbi")} == {
        "outer_kernels.outer",
        "inner_kernels.inner",
        "inner_kernels.inner.called",
    }


def test_floats_are_ieee_even_for_callers_with_fastmath(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(tmp_path))

    @kernel
    def is_number(x: float) -> bool:
        return x == x  # noqa: PLR0124 - fast-math takes it for true

    @numba.njit(fastmath=True, error_model="numpy")  # type: ignore[misc] # numba has no hints
    def fast(x: float) -> bool:
        return is_number(x)

    assert [fast(1.0), fast(float("nan"))] == [True, False]


LINEAR_ALGEBRA = """
import sys, threading

if sys.argv[1] == "threads":
    threading.Thread(target=threading.Event().wait, daemon=True).start()

import numba, numpy as np
from cgla_graph.model.risk_kernels import erf

@numba.njit
def product(a, b):
    return np.dot(a, b)

erf.compiled(0.5)
print("scipy.linalg" in sys.modules, product(np.eye(2), np.eye(2)).tolist(), "scipy.linalg" in sys.modules)
"""


@pytest.mark.parametrize("threads", [False, pytest.param(True, marks=pytest.mark.slow)])
def test_kernels_need_no_linear_algebra_and_leave_it_to_those_who_do(*, threads: bool) -> None:
    """With other threads, numba imports it before the first kernel, as usual, in case they need it."""
    words = [sys.executable, "-c", LINEAR_ALGEBRA, "threads" if threads else ""]
    done = subprocess.run(words, capture_output=True, text=True, check=True)
    assert done.stdout.strip() == f"{threads} [[1.0, 0.0], [0.0, 1.0]] True"


def new_kernel(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Any:  # noqa: ANN401 - numba has no hints
    """Return a kernel that is not compiled yet."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(folder))

    @kernel
    def thrice(x: float) -> float:
        return 3.0 * x

    return thrice


def other_process(thrice: Any, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Callable[[], None]]:  # noqa: ANN401 - the same
    """Lock a kernel as if another process compiled it; return a thread that waits for it, and the release."""
    fcntl = pytest.importorskip("fcntl")
    file = Path(thrice.stats.cache_path, "thrice.lock")
    lock = file.open("ab")
    fcntl.flock(lock, fcntl.LOCK_EX)
    waits = threading.Event()
    sleep = _kernel.time.sleep
    monkeypatch.setattr(_kernel.time, "sleep", lambda seconds: (waits.set(), sleep(seconds)))
    caller = threading.Thread(target=thrice, args=(1.0,))
    caller.start()
    assert waits.wait(60.0)
    return caller, lock.close


def test_one_process_compiles_and_the_others_wait(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Waiting processes load the code from the cache."""
    thrice, other = (new_kernel(tmp_path / "kept", monkeypatch) for _ in range(2))
    other(1.0)
    aside = shutil.copytree(tmp_path / "kept", tmp_path / "aside")
    shutil.rmtree(tmp_path / "kept")
    Path(thrice.stats.cache_path).mkdir(parents=True, exist_ok=True)
    caller, let_go = other_process(thrice, monkeypatch)
    assert not thrice.overloads
    shutil.copytree(aside, tmp_path / "kept", dirs_exist_ok=True)
    let_go()
    caller.join(120.0)
    assert not caller.is_alive()
    assert sum(thrice.stats.cache_hits.values()) == 1
    assert not thrice.stats.cache_misses


def test_waiting_ends(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A process that was stopped while compiling holds its lock."""
    monkeypatch.setattr(_kernel, "PATIENCE", 0.1)
    thrice = new_kernel(tmp_path, monkeypatch)
    caller, let_go = other_process(thrice, monkeypatch)
    caller.join(120.0)
    assert not caller.is_alive()
    let_go()
    assert len(thrice.overloads) == 1


def test_a_short_wait_is_for_a_process_that_loads(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Two workers that load one kernel at once say nothing of compiling."""
    fcntl, said = pytest.importorskip("fcntl"), list[str]()
    monkeypatch.setattr(_progress._State, "when_compiling", lambda: said.append("compiling"))
    with (tmp_path / "lock").open("ab") as mine, (tmp_path / "lock").open("ab") as other:
        fcntl.flock(other, fcntl.LOCK_EX)
        ends = threading.Timer(0.1, fcntl.flock, (other, fcntl.LOCK_UN))
        ends.start()
        _kernel._lock(mine)
        ends.join(10.0)
    assert not said


def test_without_locks_kernels_are_compiled(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    thrice = new_kernel(tmp_path, monkeypatch)
    monkeypatch.setattr(Path, "open", lambda *_, **__: (_ for _ in ()).throw(PermissionError))
    assert thrice(2.0) == 6.0


@pytest.mark.parametrize("collects", [True, False])
def test_garbage_collection_pauses_while_a_kernel_is_compiled(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *, collects: bool
) -> None:
    """Afterwards it is as before, even if compiling fails."""
    seen = []

    @kernel
    def wrong(x: float) -> str:
        return x.no_such_thing  # type: ignore[attr-defined, no-any-return]

    find = type(wrong._compiler).compile  # type: ignore[attr-defined]
    monkeypatch.setattr(
        type(wrong._compiler),  # type: ignore[attr-defined]
        "compile",
        lambda *arguments: (seen.append(gc.isenabled()), find(*arguments))[1],
    )
    was = gc.isenabled()
    (gc.enable if collects else gc.disable)()
    try:
        assert new_kernel(tmp_path, monkeypatch)(2.0) == 6.0
        with pytest.raises(numba.TypingError):
            wrong(1.0)
        assert gc.isenabled() is collects
    finally:
        (gc.enable if was else gc.disable)()
    assert seen == [False, False]


@pytest.mark.slow
def test_an_interrupt_leaves_numbas_lock_free(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """It arrives as the lock was taken, before anything can give it back."""
    lock = importlib.import_module("numba.core.compiler_lock").global_compiler_lock
    take, taken = type(lock).acquire, []

    def interrupted(of: Any) -> None:  # noqa: ANN401 - numba has no hints
        take(of)
        if not taken:
            taken.append(of)
            signal.raise_signal(signal.SIGINT)

    compiled = new_kernel(tmp_path, monkeypatch)
    with monkeypatch.context() as patch:
        patch.setattr(type(lock), "acquire", interrupted)
        with pytest.raises(KeyboardInterrupt):
            compiled(2.0)
    assert taken
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    is_free = not lock.is_locked()
    while lock.is_locked():
        lock.release()
    assert is_free
    assert compiled(2.0) == 6.0


@pytest.mark.slow
def test_compiling_is_announced_once(tmp_path: Path) -> None:
    """Later runs find the code on disk."""
    environment = kept_but_for("certificate_kernels.steepness", at=tmp_path / "kernels")
    command = [sys.executable, "-m", "cgla_graph.comparisons", "plan", "one-threat", "--solver", "straight-line"]
    runs = [subprocess.run(command, capture_output=True, text=True, check=True, env=environment) for _ in range(2)]
    assert [run.stderr.count("compiling kernels") for run in runs] == [1, 0]
    assert all("compiling" not in run.stdout for run in runs)


WITHOUT_NUMBA = """
import sys
import numpy as np
from outer_kernels import grown, outer

def message(x):
    outer(1.0)
    try:
        outer(x)
    except ValueError as error:
        return str(error)

print(grown(np.zeros(2)).tolist(), message(-1.0), "numba" in sys.modules)
if len(sys.argv) > 1:
    import numba

    @numba.njit
    def twice(x):
        return 2.0 * outer(x)

    print(twice(1.0), grown(np.zeros(3)).tolist(), message(-1.0))
"""
GROWN = """
import numpy as np
from cgla_graph._kernel import kernel

@kernel
def outer(x: float) -> float:
    if x < 0.0:
        raise ValueError("less than zero")
    return 2.0 * x

@kernel
def grown(values):
    longer = np.ones(len(values) + 1)
    longer[:-1] = values
    return longer
"""


@pytest.mark.slow
def test_kept_code_makes_arrays_and_raises_errors_without_numba(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Numba may be imported afterwards."""
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "kept"))
    (tmp_path / "outer_kernels.py").write_text(GROWN, encoding="utf-8")
    answers = []
    for words in ([], [], ["numba"]):
        command = [sys.executable, "-c", WITHOUT_NUMBA, *words]
        done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=True)
        answers.append(done.stdout.splitlines())
    assert answers[0] == ["[0.0, 0.0, 1.0] less than zero True"]
    assert answers[1] == ["[0.0, 0.0, 1.0] less than zero False"]
    assert answers[2] == [*answers[1], "4.0 [0.0, 0.0, 0.0, 1.0] less than zero"]


def twice_kept(folder: Path, monkeypatch: pytest.MonkeyPatch) -> tuple[Any, Path]:
    """Return a kernel of an array that has run once, and the file with its code."""
    monkeypatch.setattr(numba.config, "CACHE_DIR", str(folder))
    # (a process in which several threads ran before numba was there keeps no code)
    monkeypatch.setattr(_machine_code, "parts", functools.cache(_machine_code.parts.__wrapped__))
    parts = _machine_code.parts()
    assert parts
    monkeypatch.setattr(_kernel, "_parts", parts)
    monkeypatch.setattr(_kernel, "_fingerprint", parts.dispatcher.compute_fingerprint)

    @kernel
    def first_twice(values: Any) -> float:  # noqa: ANN401 - any array
        return 2.0 * float(values[0])

    compiled: Any = first_twice
    compiled(np.ones(1))
    return compiled, next(folder.rglob("*.code"))


def again(compiled: Any) -> Any:  # noqa: ANN401 - numba has no hints
    """Return the same kernel as in another process."""
    other: Any = _kernel._Kernel(compiled._function)
    other._folder = compiled._folder
    return other


def test_code_that_is_broken_is_compiled_anew(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """LLVM would end the process."""
    compiled, file = twice_kept(tmp_path, monkeypatch)
    whole, values = file.read_bytes(), np.full(1, 3.0)
    assert _machine_code.load(file, compiled._function)(values) == 6.0  # type: ignore[misc]
    head, _, code = whole.partition(b"\n")
    strange = json.loads(head) | {"outside": ["no_such_symbol"]}
    strange["digest"] = _machine_code._digest(strange, code)
    for broken in (
        b"",
        b"{}\n",
        b"[]\n",
        whole[:-1],
        whole[:-9] + b"\0" * 9,
        json.dumps(strange).encode() + b"\n" + code,
    ):
        file.write_bytes(broken)
        assert _machine_code.load(file, compiled._function) is None
    other = again(compiled)
    assert other(values) == 6.0
    assert file.read_bytes() == whole
    assert len(other.compiled.overloads) == 1


def test_kept_code_is_for_the_types_that_it_was_compiled_for(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Numba refuses arrays of another order of bytes, also once the kernel has run on others."""
    compiled, _ = twice_kept(tmp_path, monkeypatch)
    other = again(compiled)
    assert other(np.full(1, 3.0)) == 6.0
    assert "compiled" not in vars(other)
    with pytest.raises(numba.TypingError):
        other(np.ones(1).astype(">f8"))
    read_only = np.full(1, 4.0)
    read_only.setflags(write=False)
    for values in (np.array([2.5, 0.0, 0.0])[::2], np.array([5], dtype=np.int32), read_only):
        assert again(compiled)(values) == 2.0 * values[0]
    assert len(list(tmp_path.rglob("*.code"))) == 4


def test_kept_code_is_of_one_version_and_setting(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled, file = twice_kept(tmp_path, monkeypatch)
    assert again(compiled).file((np.ones(1),)) == file
    assert _kernel.is_kept(again(compiled))
    monkeypatch.setattr(_machine_code, "_environment", lambda: "another")
    assert again(compiled).file((np.ones(1),)) != file
    assert not again(compiled).is_kept(())
    parts = _machine_code.parts.__wrapped__
    assert parts() is not None
    monkeypatch.setenv("NUMBA_BOUNDSCHECK", "1")
    assert parts() is None


def test_where_nothing_can_be_written_numba_is_asked(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled, file = twice_kept(tmp_path, monkeypatch)
    file.unlink()
    monkeypatch.setattr(os, "access", lambda *_: False)
    other = again(compiled)
    assert [other(np.full(1, 3.0)), other(np.full(1, 4.0))] == [6.0, 8.0]
    assert not file.exists()
    assert not list(tmp_path.rglob("*.part"))


def test_threads_may_call_a_kernel_for_the_first_time_at_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    compiled, _ = twice_kept(tmp_path, monkeypatch)
    other, answers = again(compiled), list[float]()
    threads = [threading.Thread(target=lambda: answers.append(other(np.full(1, 3.0)))) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(60.0)
    assert answers == [6.0] * 8
