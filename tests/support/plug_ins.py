"""Solvers as users bring them: a distribution with an entry point each, on the path of this process and its workers."""

from pathlib import Path

import pytest

MODULE = '''
import ctypes, math, os, signal, sys, time, warnings
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import ClassVar

import numpy as np

from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits


def straight(problem):
    path = np.array([problem.start, problem.goal])
    return Solution(Status.FOUND, path=path, cost=problem.evaluate(path).cost)


def plug_in(solve):
    """Make a solver of a function."""
    about = Traits(solve.__name__, solve.__doc__, domain="plane")

    @dataclass(frozen=True)
    class Own:
        traits: ClassVar[Traits] = about
        note: str = ""

        def solve(self, problem):
            return solve(problem, self.note)

    Own.__name__ = Own.__qualname__ = solve.__name__.title()
    globals()[Own.__name__] = Own


@plug_in
def honest(problem, note):
    """Goes straight."""
    return straight(problem)


@plug_in
def sleeps(problem, note):
    """Never comes back."""
    while True:
        time.sleep(1000.0)


@plug_in
def hangs(problem, note):
    """Never comes back, from C, with the lock of the interpreter held."""
    ctypes.PyDLL(None).sleep(10**6)


@plug_in
def allocates(problem, note):
    """Takes all memory that there is."""
    held = []
    while True:
        # asked for, not used: how long it takes does not depend on the machine
        held.append(np.empty(2**22))


@plug_in
def leaves(problem, note):
    """Ends the process, well."""
    os._exit(0)


@plug_in
def segfaults(problem, note):
    """Reads from nowhere."""
    ctypes.string_at(0)


@plug_in
def raises(problem, note):
    """Raises."""
    raise ValueError("not today\\nnor tomorrow")


@plug_in
def exits(problem, note):
    """Leaves by an exception that few catch."""
    raise KeyboardInterrupt


@plug_in
def odd(problem, note):
    """Raises what no other process can understand."""

    class Local(Exception):
        def __reduce__(self):
            raise RuntimeError("stays here")

    raise Local("from " + note)


@plug_in
def nan(problem, note):
    """Says that its path costs NaN."""
    return replace(straight(problem), cost=math.nan)


@plug_in
def lies(problem, note):
    """Says that its path costs less than it does."""
    return replace(straight(problem), cost=1e-3)


@plug_in
def claims(problem, note):
    """Says that no path costs less than its note."""
    return replace(straight(problem), lower_bound=float(note.removeprefix("x")))


@plug_in
def talks(problem, note):
    """Prints to standard output, and past Python too."""
    print("printed by a solver")
    os.write(1, b"written by a solver\\n")
    return straight(problem)


@plug_in
def gossips(problem, note):
    """Answers with things that no other process can understand."""
    return replace(straight(problem), message=lambda: 3, nodes=(lambda: 4,))


@plug_in
def steers(problem, note):
    """Says what would clear a terminal."""
    return replace(straight(problem), status=Status.NOT_FOUND, message="\\x1b[2Jgone")


@dataclass(frozen=True)
class Needs:
    """Needs a package."""

    traits: ClassVar[Traits] = Traits(
        "needs", "needs a package", domain="plane", seeded=True, needs=("a_package_that_is_missing",)
    )
    seed: int = 0

    def solve(self, problem):
        return straight(problem)


@plug_in
def dirties(problem, note):
    """Leaves behind whatever it can."""
    os.chdir("/")
    os.environ["HOME"] = "nowhere"
    sys.setrecursionlimit(150)
    np.seterr(all="raise")
    np.median = None
    warnings.simplefilter("error")
    signal.signal(signal.SIGALRM, signal.SIG_IGN)
    signal.pthread_sigmask(signal.SIG_BLOCK, {signal.SIGALRM})
    object.__setattr__(problem, "k", 0.0)
    answer = straight(problem)
    for descriptor in (0, 1, 2):
        os.close(descriptor)
    return answer


@plug_in
def disarms(problem, note):
    """Takes the alarm for itself, and never comes back."""
    signal.signal(signal.SIGALRM, signal.SIG_IGN)
    signal.alarm(0)
    while True:
        time.sleep(1000.0)


@plug_in
def stops(problem, note):
    """Stops its process, as a debugger would."""
    os.kill(os.getpid(), signal.SIGSTOP)
    return straight(problem)


@plug_in
def counts(problem, note):
    """Leaves a line in a file each time, and takes a moment."""
    with Path(note).open("a") as file:
        file.write(f"{os.getpid()}\\n")
    time.sleep(0.05)
    return straight(problem)


@plug_in
def lacks(problem, note):
    """Raises the error that its note names, until the file is there that it names besides."""
    error, _, file = note.partition("@")
    if not Path(file or "missing").exists():
        raise eval(error)
    return straight(problem)


@plug_in
def meets(problem, note):
    """Comes back only if another one is on its way at the same time."""
    folder = Path(note)
    (folder / str(os.getpid())).touch()
    for _ in range(2000):
        if len(list(folder.iterdir())) > 1:
            return straight(problem)
        time.sleep(0.01)
    return Solution(Status.NOT_FOUND)
'''

NAMES = (
    *("honest", "sleeps", "hangs", "allocates", "leaves", "segfaults", "raises", "exits", "odd", "nan", "lies"),
    *("talks", "gossips", "counts", "meets", "dirties", "disarms", "stops", "steers", "needs", "claims", "lacks"),
)


def install(folder: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Install the distribution into a folder, and put that on the path."""
    site = folder / "site"
    about = site / "odd_solvers-1.0.dist-info"
    about.mkdir(parents=True)
    (site / "odd_solvers.py").write_text(MODULE, encoding="utf-8")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: odd-solvers\nVersion: 1.0\n", encoding="utf-8")
    lines = [f"{name} = odd_solvers:{name.title()}" for name in NAMES]
    (about / "entry_points.txt").write_text("\n".join(["[cgla_graph.solvers]", *lines, ""]), encoding="utf-8")
    monkeypatch.syspath_prepend(site)
    monkeypatch.setenv("PYTHONPATH", str(site))
    return site
