"""
Tasks with dependencies: run in this process, in worker processes or on a cluster, and stored as they end.

This module knows nothing of studies. Results that the store holds are not computed again, so that work resumes after
an interruption, and each result is stored before it is yielded.
"""

import heapq
from collections.abc import Callable, Generator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter
from typing import Any, Protocol, TypeAlias, cast

from cgla_graph._text import counted
from cgla_graph.comparisons.workers.cluster import spread
from cgla_graph.comparisons.workers.pool import Call, NextCall, here, isolated
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.limits import NO_LIMITS, PREPARATION, Limits
from cgla_graph.isolation.outcome import Outcome

#: Identifies a task and its result: a kind, and names or numbers.
Key: TypeAlias = tuple[Any, ...]
#: Results by key.
Results: TypeAlias = Mapping[Key, Any]


class ResultStore(Protocol):
    """A store of results."""

    def __contains__(self, key: Key) -> bool:
        """Return whether the store holds a result."""
        ...

    def __getitem__(self, key: Key) -> Any:  # noqa: ANN401 - any result
        """Return a result that another task needs."""
        ...

    def add(self, key: Key, result: Any) -> Any:  # noqa: ANN401 - the same
        """Store a result, and return its stored form."""
        ...


def value_of(outcome: Outcome, _: Limits, __: Results) -> Any:  # noqa: ANN401 - any result
    """Return the value of an outcome, None after a failure."""
    return outcome.value


@dataclass(frozen=True, eq=False)
class Task:
    """
    A call to be made once, and the result to store.

    Attributes
    ----------
    key
        Its name in the store and in `needs`.
    function
        From a module that the other process can import; called with the arguments and with the limits that it sets
        around the part that is measured (see `limited`).
    arguments
        Picklable arguments, or a function that makes them of the results of `needs`, called in this process right
        before the task starts.
    result
        Makes the result to store of the outcome (failures included, except those of the environment), the limits and
        the results of `needs`; called in this process. It raises a `WorkerError` if the outcome is none of the call.
    needs
        Keys of tasks that end before this one starts.
    """

    key: Key
    function: Callable[..., Any]
    arguments: Sequence[Any] | Callable[[Results], Sequence[Any]] = ()
    result: Callable[[Outcome, Limits, Results], Any] = value_of
    needs: Sequence[Key] = ()


def run_tasks(
    tasks: Sequence[Task],
    store: ResultStore | None = None,
    *,
    limits: Limits,
    workers: int = 1,
    scheduler: str | None = None,
    preload: Sequence[str] = (),
    solvers: Sequence[str] = (),
) -> Generator[tuple[Task, Any]]:
    """
    Run the tasks that are not in the store yet; of those that are ready, the first in order starts first.

    Closing the iteration early ends the workers.

    Parameters
    ----------
    tasks
        With distinct keys. The tasks that they need are among them, or in the store.
    store
        Takes each result before it is yielded; None stores nothing.
    limits
        Limits that the functions set. In this process there are none, because they would kill the program.
    workers
        Number of processes; 0 runs all in this one, where a task that hangs or crashes stops everything.
    scheduler
        Address of a Dask scheduler whose cluster runs the tasks instead.
    preload
        Modules that workers load before the first task.
    solvers
        Names of the solvers that tasks run; the machines of a cluster need the same ones.

    Yields
    ------
    task, result
        As soon as it is done: with several workers, in no fixed order.

    Raises
    ------
    ValueError
        If a needed task is neither given nor in the store, or tasks need each other in a circle.
    OutputError
        If the store cannot be written.
    WorkerError
        If workers do not start, or the cluster cannot be reached. At the end, if tasks could not be made because of
        their environment: these have no results, are not stored, and are made when they are asked for again.

    Examples
    --------
    >>> def doubled(number, limits):
    ...     return 2 * number
    >>> first = Task(("number", 1), doubled, (21,))
    >>> second = Task(("number", 2), doubled, lambda done: (done["number", 1],), needs=[("number", 1)])
    >>> [result for _, result in run_tasks([second, first], limits=Limits(), workers=0)]
    [42, 84]
    """
    agenda = _Agenda(tasks, store)
    if not agenda.left:
        return
    held = limits if workers or scheduler is not None else NO_LIMITS

    def next_call() -> Call | None:
        task = agenda.next_task()
        if task is None:
            return None
        given = task.arguments(agenda.needed(task)) if callable(task.arguments) else task.arguments
        return Call(task.key, task.function, (*given, held))

    # the end of the iteration ends the workers
    how: dict[str, Any] = {"scheduler": scheduler, "preload": preload, "solvers": solvers}
    with closing(_made(next_call, held, min(workers, len(agenda.left)), **how)) as outcomes:
        for call, outcome in outcomes:
            task = agenda.left[cast("Key", call.key)]
            if outcome.failure is not None and outcome.failure.is_environment:
                agenda.give_up(task, outcome.message)
                continue
            try:
                result = task.result(outcome, held, agenda.needed(task))
            except WorkerError as error:
                agenda.give_up(task, str(error))
                continue
            if store is not None:
                result = store.add(task.key, result)
            agenda.end(task, result)
            yield task, result
    agenda.check_all_made()


def _made(
    next_call: NextCall,
    limits: Limits,
    workers: int,
    *,
    scheduler: str | None,
    preload: Sequence[str],
    solvers: Sequence[str],
) -> Generator[tuple[Call, Outcome]]:
    """Make calls on a cluster, in worker processes, or (0 workers) in this process."""
    seconds = limits.seconds + PREPARATION
    if scheduler is not None:
        return spread(next_call, scheduler=scheduler, seconds=seconds, preload=preload, solvers=solvers)
    if workers == 0:
        return here(next_call)
    return isolated(next_call, workers=workers, seconds=seconds, preload=preload)


class _Agenda:
    """The tasks that are left, in order, and the ready ones among them."""

    def __init__(self, tasks: Sequence[Task], store: ResultStore | None) -> None:
        self.left = {task.key: task for task in tasks if store is None or task.key not in store}
        self._store = store
        self._places = {key: place for place, key in enumerate(self.left)}
        self._needed = {need for task in self.left.values() for need in task.needs}
        self._results: dict[Key, Any] = {}
        for key, task in self.left.items():
            for need in task.needs:
                if need not in self.left and (store is None or need not in store):
                    msg = f"{key} needs {need}, which is no task and not in the store; add it"
                    raise ValueError(msg)
        self._order = TopologicalSorter({key: self.left.keys() & task.needs for key, task in self.left.items()})
        try:
            self._order.prepare()
        except CycleError as error:
            msg = f"{error.args[1][0]} needs what needs it in turn; let one of them begin"
            raise ValueError(msg) from error
        #: a heap of places and keys
        self._ready: list[tuple[int, Key]] = []
        #: why tasks could not be made, by key; without a reason, they need one of the others
        self._given_up: dict[Key, str] = {}

    def next_task(self) -> Task | None:
        while self._order.is_active():
            for key in self._order.get_ready():
                heapq.heappush(self._ready, (self._places[key], key))
            if not self._ready:
                return None
            task = self.left[heapq.heappop(self._ready)[1]]
            if self._given_up.keys().isdisjoint(task.needs):
                return task
            self.give_up(task)
        return None

    def give_up(self, task: Task, why: str = "") -> None:
        """Mark a task as one that could not be made."""
        self._given_up[task.key] = why
        del self.left[task.key]
        self._order.done(task.key)

    def check_all_made(self) -> None:
        """Raise a `WorkerError` if a task was given up."""
        if self._given_up:
            (_, *names), why = next(iter(self._given_up.items()))
            task = ", ".join(str(name) for name in names if name is not None)
            n_tasks = counted(len(self._given_up), "task")
            msg = f"{n_tasks} could not be made, {task} because: {why}; mend that, and make them again (--resume)"
            raise WorkerError(msg)

    def needed(self, task: Task) -> Results:
        return {key: self._results[key] if key in self._results else self._kept(key) for key in task.needs}

    def _kept(self, key: Key) -> Any:  # noqa: ANN401 - any result
        return None if self._store is None else self._store[key]

    def end(self, task: Task, result: Any) -> None:  # noqa: ANN401 - any result
        """Mark a task as done, so that tasks that need it become ready."""
        del self.left[task.key]
        if task.key in self._needed:
            self._results[task.key] = result
        self._order.done(task.key)
