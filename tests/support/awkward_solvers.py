"""A solver that does whatever it is told, in a process of its own: in a module, so that it can be sent there."""

import ctypes
import dataclasses
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, ClassVar, NoReturn

import numpy as np

from cgla_graph._progress import showing
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import MOST_WAYPOINTS, Solution, Status, TracePoint
from cgla_graph.model.solver import Traits


class UnsendableError(Exception):
    """Stays where it is."""

    def __reduce__(self) -> tuple[object, ...]:
        """Refuse to be pickled."""
        msg = "stays here"
        raise TypeError(msg)


def _tell() -> None:
    with showing("counting") as tell:
        tell("one")


def _raise(error: Exception) -> NoReturn:
    raise error


DEEDS: dict[str, Callable[[], object]] = {
    "": lambda: None,
    "crash": lambda: os.kill(os.getpid(), signal.SIGSEGV),
    "leave": lambda: os._exit(3),
    # with the lock of the interpreter held
    "hang": lambda: ctypes.PyDLL(None).sleep(10**6),
    "sleep": lambda: time.sleep(1000.0),
    "nap": lambda: time.sleep(0.1),
    "progress": _tell,
    "ask": lambda: sys.stdin.read(1),
    "raise": lambda: _raise(ProblemError("not this problem")),
    "raise what cannot be sent": lambda: _raise(UnsendableError("stuck there")),
    "exit": lambda: sys.exit("away"),
}


@dataclass(frozen=True)
class Awkward:
    """Does one thing, and goes straight if it is still alive; its message says in which process."""

    does: str = ""
    seconds: float | None = None
    number: int = 0
    extra: Any = None
    traits: ClassVar[Traits] = Traits("awkward", "does what it is told", domain="plane", isolated=True)

    def solve(self, problem: Problem) -> Solution | None:
        """Do it."""
        if self.does == "say nothing":
            return None
        if self.does == "change":
            object.__setattr__(problem, "k", 0.0)
        elif self.does == "change cells":
            cells = problem.field.rasters[0].cells
            cells.flags.writeable = True
            cells[0, 0] = 9.0
        elif self.does == "interrupt":
            os.kill(self.number, signal.SIGINT)
            time.sleep(1000.0)
        else:
            DEEDS[self.does]()
        path = np.array([problem.start, problem.goal])
        cost = problem.evaluate(path).cost
        return Solution(Status.FOUND, path=path, cost=cost, message=f"{os.getpid()} {self.number}")


@dataclass(frozen=True)
class Own(Awkward):
    """The same, as a user writes it: it asks for no process of its own."""

    traits: ClassVar[Traits] = Traits("own", "does what it is told, here", domain="plane")


@dataclass(frozen=True)
class Endless(Own):
    """Answers more than there is room for."""

    what: str = ""

    def solve(self, problem: Problem) -> Solution:
        rows = 3 * MOST_WAYPOINTS
        path = np.array([problem.start, problem.goal])
        if self.what == "raises":
            raise ValueError("long" * 10**6)
        if self.what == "path":
            path = np.linspace(problem.start, problem.goal, rows)
        if self.what == "list":
            path = [problem.start] * rows  # type: ignore[assignment]
        answer = Solution(Status.FOUND, path=path, cost=1.0)
        if self.what == "wide":
            answer = dataclasses.replace(answer, path=np.zeros((2, rows)))
        if self.what == "no path":
            answer = dataclasses.replace(answer, status=Status.NOT_FOUND, path=np.zeros((rows, 2)))
        if self.what == "nodes":
            answer = dataclasses.replace(answer, nodes=range(rows))
        if self.what == "trace":
            cost = problem.evaluate(path).cost
            answer = dataclasses.replace(answer, cost=cost, trace=(TracePoint(0.0, 0, cost),) * rows)
        if self.what == "message":
            answer = dataclasses.replace(answer, cost=problem.evaluate(path).cost, message="\x1b[2J\n" + "long" * 10**6)
        return answer
