"""Functions that worker processes are asked for: a module of its own on the path, as users' plug-ins are."""

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

MODULE = '''
import ctypes
import multiprocessing
import os
import pickle
import resource
import signal
import subprocess
import sys
import threading
import time
from pathlib import Path

from cgla_graph.isolation.limits import limited


class Unpicklable(Exception):
    def __reduce__(self):
        raise RuntimeError("stays here")


class Unspeakable(Exception):
    def __str__(self):
        raise RuntimeError("no words")


class Unreadable:
    """Can be sent, but not read."""

    def __reduce__(self):
        return explode, ()


def explode():
    raise RuntimeError("not readable")


def square(x):
    return x * x


def where():
    return os.getpid()


def nap(seconds):
    time.sleep(seconds)
    return seconds


def nap_noted(note, seconds):
    with Path(note).open("a") as file:
        file.write("begun\\n")
    return nap(seconds)


def wait_for(note):
    while not Path(note).exists():
        time.sleep(0.01)


def raises(error, *words):
    raise {"pickle": Unpicklable, "speak": Unspeakable}.get(error, error)(*words)


def raises_base():
    raise BaseException("bare")


def leave(code):
    os._exit(code)


def segfault():
    ctypes.string_at(0)


def die_of(number):
    os.kill(os.getpid(), number)


def hang(note=None):
    """Hold the lock of the interpreter for ever."""
    if note:
        Path(note).write_text(str(os.getpid()))
    ctypes.PyDLL(None).sleep(10**6)


def hang_limited(seconds, note=None):
    with limited(seconds, 1000.0):
        hang(note)


def hang_deaf(seconds):
    """As `hang_limited`, but with the alarm's signal ignored before."""
    signal.signal(signal.SIGALRM, signal.SIG_IGN)
    hang_limited(seconds)


def eat(megabytes):
    import numpy as np

    held = []
    with limited(60.0, megabytes):
        while True:
            held.append(np.ones(2**17))


def eat_in_c(megabytes):
    """What C++ does: an allocation fails, nobody catches, the process is aborted."""
    c = ctypes.CDLL(None)
    c.malloc.restype = ctypes.c_void_p
    with limited(60.0, megabytes):
        while held := c.malloc(2**20):
            ctypes.memset(held, 1, 2**20)
        c.abort()


def use(megabytes):
    """Use memory for a moment, within a limit; then more than the limit, without."""
    import numpy as np

    with limited(60.0, 2.0 * megabytes) as usage:
        block = np.ones(int(megabytes * 2**17))
    del block
    free = np.ones(int(4.0 * megabytes * 2**17))
    return usage.megabytes, len(free)


def aftermath(seconds):
    """What is left of a limit: the alarm, its handler and the limit of memory before and after."""
    found = []
    def look():
        found.append((signal.getitimer(signal.ITIMER_REAL)[0], signal.getsignal(signal.SIGALRM),
                      resource.getrlimit(resource.RLIMIT_DATA)))
    look()
    try:
        with limited(seconds, 10.0):
            look()
            raise KeyError
    except KeyError:
        look()
    return [(timer > 0.0, str(handler), limit) for timer, handler, limit in found]


def nested():
    with limited(10.0, 100.0), limited(5.0, 100.0):
        pass


def arm():
    signal.setitimer(signal.ITIMER_REAL, 0.3)


def talk():
    print("printed by a call")
    os.write(1, b"written by a call\\\\n")
    ctypes.CDLL(None).puts(b"put by a call")
    return "said"


def no_pickle():
    return lambda: 3


def no_reading():
    return Unreadable()


def close_all():
    os.closerange(3, 256)


def leave_thread():
    threading.Thread(target=time.sleep, args=(1000.0,), daemon=True).start()
    return os.getpid()


def leave_child(end=None):
    """Start a process, of a session of its own, that outlives the call; or the call does not end well."""
    code = "import time; time.sleep(1000)"
    child = subprocess.Popen([sys.executable, "-c", code], start_new_session=end is None)
    if end is None:
        return child.pid
    Path(end).write_text(str(child.pid))
    segfault()


def fork_back():
    process = os.getpid()
    if os.fork():
        time.sleep(0.3)
    return os.getpid() == process


def cores():
    from cgla_graph._threads import n_cores

    return sorted(os.sched_getaffinity(0)), n_cores()


def note(folder):
    Path(folder, str(os.getpid())).touch()
    time.sleep(1000.0)


def kill_parent():
    server = Path(f"/proc/{os.getppid()}/stat").read_text().rsplit(")", 1)[1]
    os.kill(int(server.split()[1]), signal.SIGKILL)
    time.sleep(1000.0)
'''


def install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Write the module into a folder, and put that on the path of this process and its workers."""
    site = folder / "site"
    site.mkdir()
    (site / "awkward.py").write_text(MODULE, encoding="utf-8")
    monkeypatch.syspath_prepend(site)
    monkeypatch.setenv("PYTHONPATH", str(site), prepend=os.pathsep)
    monkeypatch.delitem(sys.modules, "awkward", raising=False)
    return site


def alive(pid: int) -> bool:
    """Tell whether a process runs (one that has ended, but was not waited for, does not)."""
    try:
        return Path(f"/proc/{pid}/stat").read_text(encoding="ascii").rsplit(")", 1)[1].split()[0] not in "ZX"
    except (FileNotFoundError, ProcessLookupError):
        return False


def until(condition: Callable[[], bool], seconds: float = 10.0) -> bool:
    """Wait for something to become true."""
    began = time.monotonic()
    while not condition():
        if time.monotonic() - began > seconds:
            return False
        time.sleep(0.01)
    return True
