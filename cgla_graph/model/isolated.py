"""
Runs of solvers that may crash or hang, in a process of their own, so that the user's process goes on.

A program has one such worker process. The first run that needs it starts it, which takes about a second; later runs
take a millisecond more than in the user's process. After a crash it is replaced.
"""

import math
import pickle
import threading
import time
import traceback
import zlib
from collections.abc import Iterator
from contextlib import contextmanager, nullcontext
from functools import cache, reduce
from importlib import import_module
from typing import Any, cast

import numpy as np

from cgla_graph import _progress
from cgla_graph._text import shown
from cgla_graph._validate import real_number
from cgla_graph.errors import SolverFaultError, SolverSettingError
from cgla_graph.isolation.limits import MEGABYTE, PREPARATION, Limits, is_expendable, limited_time
from cgla_graph.isolation.outcome import Failure, Outcome, one_line
from cgla_graph.isolation.shared import call_apart
from cgla_graph.model import risk_kernels
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.rasters.values import parts_of
from cgla_graph.model.small_problem import load_oracle, small_problem
from cgla_graph.model.solution import MOST_WAYPOINTS, Solution, Status, contained

#: Longest time of a run without a setting ``seconds``, in seconds.
LONGEST = 600.0
#: By how much a run may exceed its setting ``seconds``: seconds, and a share of the setting, added up.
GRACE, GRACE_SHARE = 2.0, 0.1

#: Statuses of runs that failed.
STATUS_OF = {
    Failure.TIMED_OUT: Status.TIMED_OUT,
    Failure.OUT_OF_MEMORY: Status.OUT_OF_MEMORY,
    Failure.CRASHED: Status.CRASHED,
    Failure.RAISED: Status.FAILED,
    Failure.NOT_MADE: Status.UNAVAILABLE,
    # (of a single run that is lost, nothing else is known)
    Failure.LOST: Status.CRASHED,
}
#: Most bytes of an answer that is sent, and of an exception; of a larger exception, its type and first line are sent.
MOST_OF_ANSWER, MOST_OF_ERROR = 64 * MEGABYTE, MEGABYTE


def run(solver: Any, problem: Problem | GraphProblem, *, apart: bool = False) -> tuple[Solution, float]:  # noqa: ANN401 - of either kind
    """
    Run a solver, in a process of its own if `apart` or its traits say so.

    Parameters
    ----------
    solver
        A solver of either domain; it is sent to the other process together with the problem.
    problem
        The problem.
    apart
        Whether it runs in a process of its own even if its traits do not say so.

    Returns
    -------
    answer, seconds
        The solver's answer, and its time by the clock of its own process. If the run crashed its process, the answer is
        a `Solution` with the status ``CRASHED``; if it did not end in time, ``TIMED_OUT``.

    Raises
    ------
    SolverSettingError
        If the solver or the problem cannot be sent.
    SolverFaultError
        If the answer is no `Solution`, or a solver that is not of this package changes its problem.
    WorkerError
        If the process does not start.

    Examples
    --------
    >>> from cgla_graph.solvers.continuous.straight_line import StraightLine
    >>> answer, seconds = run(StraightLine(), Problem((0, 0), (1, 1)))
    >>> answer.status.label, seconds < 60.0
    ('found', True)
    """
    answer, seconds = made(solver, "solve", (problem,), apart=apart)
    if isinstance(answer, Outcome):
        return Solution(STATUS_OF[cast("Failure", answer.failure)], message=why_lost(solver, answer)), seconds
    if not isinstance(answer, Solution):
        wanted = "a Solution, as Solution(Status.FOUND, path=waypoints), or nodes=… on a graph"
        msg = f"{solver.traits.name} answers with a {type(answer).__name__}; have its solve return {wanted}"
        raise SolverFaultError(msg)
    for name in ("build_seconds", "certificate_seconds", "evaluations"):
        number = getattr(answer, name)
        if not math.isfinite(real_number(number)):
            msg = f"{solver.traits.name} answers with {name} = {shown(number)}; give a number, or leave it out"
            raise SolverFaultError(msg)
    return answer, seconds


def made(solver: Any, method: str, args: tuple[Any, ...], *, apart: bool = False) -> tuple[Any, float]:  # noqa: ANN401 - of either kind
    """
    Call a method of a solver on a problem and more, as `run` does; if the call is lost, the value is an `Outcome`.

    Examples
    --------
    >>> from cgla_graph.solvers.continuous.straight_line import StraightLine
    >>> made(StraightLine(), "solve", (Problem((0, 0), (1, 1)),))[0].status.label
    'found'
    """
    # a worker runs solvers itself
    if not (apart or getattr(solver.traits, "isolated", False)) or is_expendable():
        return _timed(solver, method, args)
    limit = limit_of(solver)
    outcome = call_apart(_make, (solver, method, args, limit), limit + PREPARATION, _progress.tell_inside)
    if outcome.failure in {Failure.RAISED, Failure.NOT_MADE}:
        # (an exception of the solver itself is returned as a value)
        remedy = "keep only objects that can be pickled in it and in its problem"
        msg = f"{solver.traits.name} runs in a process of its own: {outcome.message}; {remedy}"
        raise SolverSettingError(msg)
    if outcome.failure is not None:
        return outcome, limit if outcome.failure is Failure.TIMED_OUT else 0.0
    timed, raised = pickle.loads(outcome.value)  # noqa: S301 - from the process that was started here
    if raised is not None:
        raise raised
    return timed  # type: ignore[no-any-return]


def limit_of(solver: Any) -> float:  # noqa: ANN401 - of either kind
    """
    Return the time limit of an isolated solver's run, in seconds: its setting and some grace, or `LONGEST`.

    Examples
    --------
    >>> from cgla_graph.solvers import get
    >>> limit_of(get("bit-star", seconds=10)), limit_of(get("bit-star", iterations=100))
    (13.0, 600.0)
    """
    seconds = getattr(solver, "seconds", None)
    return LONGEST if seconds is None else min((1.0 + GRACE_SHARE) * seconds + GRACE, threading.TIMEOUT_MAX)


def lost(outcome: Outcome, limits: Limits) -> tuple[Status, str]:
    """
    Return the status of a run that failed within limits, and why it did.

    Raises
    ------
    ValueError
        If it did not fail.

    Examples
    --------
    >>> lost(Outcome(failure=Failure.TIMED_OUT), Limits(seconds=2.0))[1]
    'stopped after 2 s, the limit of a run'
    """
    if outcome.failure is None:
        msg = "the outcome is no failure; take its value"
        raise ValueError(msg)
    message = outcome.message
    if outcome.failure is Failure.TIMED_OUT:
        message = f"stopped after {limits.seconds:g} s, the limit of a run"
    elif outcome.failure is Failure.OUT_OF_MEMORY:
        message = limits.spent_memory(message)
    return STATUS_OF[outcome.failure], message


def why_lost(solver: Any, outcome: Outcome) -> str:  # noqa: ANN401 - of either kind
    """Return why a call of `made` has no answer, and the remedy."""
    remedy = "try another seed or solver" if solver.traits.seeded else "try another solver"
    if outcome.failure is not Failure.TIMED_OUT:
        return f"{outcome.message}, and this one goes on; {remedy}"
    seconds = getattr(solver, "seconds", None)
    why = "the most without a setting `seconds`" if seconds is None else f"for it did not end after its {seconds:g} s"
    return f"stopped after {limit_of(solver):g} s, {why}; {remedy}"


def _timed(solver: Any, method: str, args: tuple[Any, ...]) -> tuple[Any, float]:  # noqa: ANN401 - of either kind
    """Call a method; check that a solver from outside this package does not change the problem."""
    with nullcontext() if is_ours(solver) else unchanged(args[0], solver.traits.name):
        began = time.perf_counter()
        value = getattr(solver, method)(*args)
        seconds = time.perf_counter() - began
    if isinstance(value, Solution):
        n_nodes = args[0].graph.n_nodes if isinstance(args[0], GraphProblem) else 0
        value = contained(value, max(MOST_WAYPOINTS, n_nodes))
    return value, seconds


def is_ours(solver: object) -> bool:
    """
    Return whether a solver is of this package, which is trusted to leave its problem alone and to prove its bounds.

    Examples
    --------
    >>> is_ours("dijkstra")
    False
    """
    return type(solver).__module__.startswith("cgla_graph.")


# ---- in the worker ----


def _make(solver: Any, method: str, args: tuple[Any, ...], limit: float) -> bytes:  # noqa: ANN401 - of either kind
    """Call a method of a solver; return its answer or its exception, pickled."""
    problem: Problem | GraphProblem = args[0]
    try:
        # imports are not part of the run's time
        for package in solver.traits.needs:
            import_module(package)
        _warm_up(MapKind.of(problem.graph.model if isinstance(problem, GraphProblem) else problem.model))
        with limited_time(limit):
            answer = pickle.dumps((_timed(solver, method, args), None), pickle.HIGHEST_PROTOCOL)
        return _checked(solver, answer)
    except BaseException as error:  # noqa: BLE001 - the worker serves the next run
        error.add_note(f"In the solver's own process:\n{''.join(traceback.format_exception(error))}")
        return _sendable(error)


def _checked(solver: Any, answer: bytes) -> bytes:  # noqa: ANN401 - of either kind
    """Return an answer that is not too large to be sent; fields of a class of the solver's own may hold anything."""
    if len(answer) > MOST_OF_ANSWER:
        sizes = f"{len(answer) / MEGABYTE:,.0f} MB; at most {MOST_OF_ANSWER // MEGABYTE} MB are taken"
        msg = f"the answer of {solver.traits.name} takes {sizes}: have it return the path, and no data besides"
        raise SolverFaultError(msg)
    return answer


@cache
def _warm_up(kind: MapKind) -> None:
    """Load the compiled kernels, which is not part of a run's time."""
    problem = small_problem(kind)
    risk_kernels.segment_cost(0.0, 0.0, 1.0, 1.0, 1.0, problem.field.kernel_field())
    segment_crosses(0.0, 0.0, 1.0, 1.0, problem.model.area.kernel_arrays)
    point_inside(0.0, 0.0, problem.model.area.kernel_arrays)
    load_oracle(kind)


def _sendable(error: BaseException) -> bytes:
    """Pickle an exception; one that cannot be sent, or that would end the program, becomes a `RuntimeError`."""
    words = pickle.dumps((None, RuntimeError(one_line(error))))
    if not isinstance(error, Exception):
        return words
    try:
        reply = pickle.dumps((None, error))
        if len(reply) > MOST_OF_ERROR:
            return words
        pickle.loads(reply)  # noqa: S301 - written one line above
    except Exception:  # noqa: BLE001 - pickling may raise anything
        return words
    return reply


@contextmanager
def unchanged(problem: object, solver: str) -> Iterator[None]:
    """
    Check that the body does not change a problem.

    Parameters
    ----------
    problem
        A `Problem` or a `GraphProblem`.
    solver
        The name of the solver that runs in the body.

    Raises
    ------
    SolverFaultError
        If a part of the problem was replaced; cached values do not count as a change.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem((0, 0), (1, 1))
    >>> with unchanged(problem, "mine"):
    ...     object.__setattr__(problem, "k", 2.0)
    Traceback (most recent call last):
    cgla_graph.errors.SolverFaultError: mine changed its problem (k); have it work on a copy
    """
    before = dict(_parts(problem, (), set()))
    yield
    after = dict(_parts(problem, (), set()))
    for place, part in before.items():
        # (lazy attributes are private, and None at first)
        if not _same(part, after.get(place)) and not (part is None and place[-1].startswith("_")):
            msg = f"{solver} changed its problem ({'.'.join(place)}); have it work on a copy"
            raise SolverFaultError(msg)


def _parts(thing: object, place: tuple[str, ...], seen: set[int]) -> Iterator[tuple[tuple[str, ...], object]]:
    """Yield the parts of an object by the attributes that lead to them, each once; arrays as shapes and checksums."""
    if isinstance(thing, np.ndarray):
        parts = [thing] if thing.ndim != 2 else [thing[part] for part in parts_of(thing.shape)]  # noqa: PLR2004 - a raster
        yield (
            place,
            (thing.shape, reduce(lambda sum_, part: zlib.crc32(np.ascontiguousarray(part).data, sum_), parts, 0)),
        )
    elif isinstance(thing, tuple) and any(map(_is_made_of_parts, thing[:1])):
        yield place, len(thing)
        for number, part in enumerate(thing):
            yield from _parts(part, (*place, str(number)), seen)
    elif not _is_made_of_parts(thing):
        yield place, thing
    elif id(thing) not in seen:
        seen.add(id(thing))
        for name in [*getattr(thing, "__slots__", ()), *getattr(thing, "__dict__", ())]:
            yield from _parts(getattr(thing, name), (*place, name), seen)


def _is_made_of_parts(thing: object) -> bool:
    return isinstance(thing, np.ndarray) or type(thing).__module__.startswith(("cgla_graph.", "scipy.sparse"))


def _same(one: object, other: object) -> bool:
    return one is other or (type(one) is type(other) and bool(one == other))
