"""
Job queue of the live page: the newest request first.

A page numbers its states. A newer state drops jobs of older ones that have not begun. Paths and
proofs, and fast solvers, take turns in one thread of this process, which has its kernels; slow solvers, and those that
may hang, have another thread, which hands them to a worker process within limits.
"""

import itertools
import threading
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from typing import Any

from cgla_graph.comparisons.live.draft import Draft
from cgla_graph.comparisons.live.planning import Planner, nothing, solved, with_seed
from cgla_graph.comparisons.study import execution
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import reason
from cgla_graph.isolation.limits import PREPARATION, Limits
from cgla_graph.isolation.process import WorkerProcess
from cgla_graph.model.isolated import lost
from cgla_graph.model.solution import Solution

#: Limits of slow solvers.
LIMITS = Limits(seconds=10.0, megabytes=2048.0)
#: Ranks of jobs: the path while something moves, fast solvers, the path when nothing moves.
QUICK, OTHERS, FULL = range(3)
#: The answer to a job that a newer state has replaced.
REPLACED: dict[str, Any] = {"replaced": True}
#: Most pages and most jobs to remember.
MOST_PAGES, MOST_JOBS = 32, 256

Work = Callable[[], dict[str, Any]]


class Line:
    """
    A thread that does waiting jobs, the least rank first and then in order, and drops replaced ones.

    Examples
    --------
    >>> line = Line()
    >>> line.put("page", 2, QUICK, lambda: {"cost": 1.0}).result()
    {'cost': 1.0}
    >>> line.put("page", 1, QUICK, lambda: {"cost": 2.0}).result()
    {'replaced': True}
    >>> line.close()
    """

    def __init__(self) -> None:
        """Begin to wait."""
        self._newest: dict[str, int] = {}
        self._jobs: dict[tuple[int, int], tuple[str, int, Work, Future[dict[str, Any]]]] = {}
        self._count = itertools.count()
        self._changed = threading.Condition()
        self._closed = False
        self._thread = threading.Thread(target=self._serve, daemon=True)
        self._thread.start()

    def newest(self, page: str, number: int) -> None:
        """Record a state; waiting jobs of the page's older states are answered as replaced."""
        with self._changed:
            before = self._newest.pop(page, number)
            # the page heard from last is last
            self._newest[page] = max(number, before)
            while len(self._newest) > MOST_PAGES:
                self._newest.pop(next(iter(self._newest)))
            for place in [key for key, (name, at, _, _) in self._jobs.items() if self._is_old(name, at)]:
                self._jobs.pop(place)[3].set_result(REPLACED)

    def put(self, page: str, number: int, rank: int, work: Work) -> "Future[dict[str, Any]]":
        """Add a job; its answer is `REPLACED` if a newer state comes before its turn."""
        self.newest(page, number)
        answer: Future[dict[str, Any]] = Future()
        with self._changed:
            if self._closed or self._is_old(page, number) or len(self._jobs) >= MOST_JOBS:
                answer.set_result(REPLACED)
            else:
                self._jobs[rank, next(self._count)] = (page, number, work, answer)
                self._changed.notify()
        return answer

    def close(self) -> None:
        """Do nothing any more."""
        with self._changed:
            self._closed = True
            for _, _, _, answer in self._jobs.values():
                answer.set_result(REPLACED)
            self._jobs.clear()
            self._changed.notify()

    def join(self) -> None:
        """Wait until the current job has ended."""
        self._thread.join()

    def _is_old(self, page: str, number: int) -> bool:
        return number < self._newest.get(page, number)

    def _serve(self) -> None:
        while True:
            with self._changed:
                self._changed.wait_for(lambda: self._jobs or self._closed)
                if self._closed:
                    return
                _, _, work, answer = self._jobs.pop(min(self._jobs))
            try:
                answer.set_result(work())
            except Exception as error:  # noqa: BLE001 - the page shows the error, and the next job is run
                answer.set_result(nothing(reason(error)))


class Desk:
    """
    The jobs of all pages.

    Parameters
    ----------
    planner
        Plans in this process.
    limits
        Of slow solvers, which run in another.
    """

    def __init__(self, planner: Planner, limits: Limits = LIMITS) -> None:
        """Begin to wait."""
        self.planner = planner
        self._limits = limits
        self._here, self._apart = Line(), Line()
        self._worker = WorkerProcess(execution.PRELOAD)

    def path(
        self, page: str, number: int, draft: Draft, *, full: bool, planner: Planner | None = None
    ) -> "Future[dict[str, Any]]":
        """Request the path and its proof, on the map of another planner if one is given."""
        plans = planner or self.planner
        self._apart.newest(page, number)
        return self._here.put(page, number, FULL if full else QUICK, lambda: plans.path(draft, full=full))

    def solver(
        self, page: str, number: int, draft: Draft, entrant: Entrant, planner: Planner | None = None
    ) -> "Future[dict[str, Any]]":
        """Request another solver's path: in this process if it is fast, else in a worker process."""
        plans = planner or self.planner
        if plans.is_fast(entrant):
            return self._here.put(page, number, OTHERS, lambda: plans.solver(draft, entrant))
        return self._apart.put(page, number, OTHERS, lambda: self._made_apart(plans, draft, entrant))

    def _made_apart(self, plans: Planner, draft: Draft, entrant: Entrant) -> dict[str, Any]:
        scenario = plans.live.drawn(draft)
        seed = with_seed(entrant)
        args = (execution.pack(scenario), entrant, seed, self._limits)
        try:
            outcome = self._worker.make(execution.run, args, self._limits.seconds + PREPARATION)
        except CancelledError:
            return REPLACED
        if outcome.failure is None:
            solution = outcome.value.solution
            return solved(scenario, scenario.problem.judge(solution))
        status, message = lost(outcome, self._limits)
        return solved(scenario, Solution(status, solver=entrant.name, message=message))

    def close(self) -> None:
        """End all jobs and the worker process."""
        self._here.close()
        self._apart.close()
        self._worker.stop()
        self._worker.join()
