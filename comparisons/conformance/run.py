"""Every instance put to a planner, one process each, and what comes of it."""

import os
import signal
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path

from cgla_graph.comparisons.conformance.command import GRACE, MOST_OUTPUT, End, Spoken, ask
from cgla_graph.comparisons.conformance.documents import read_answer
from cgla_graph.comparisons.conformance.suite import Instance
from cgla_graph.comparisons.conformance.verdict import Result, Verdict, judged
from cgla_graph.comparisons.workers.limits import Failure, Limits, Outcome
from cgla_graph.comparisons.workers.pool import Call, isolated
from cgla_graph.errors import CglaError

#: How long a worker may take on top of a planner's time.
_PREPARATION = 60.0
_FAILED = {
    Failure.TIMED_OUT: Verdict.TIMED_OUT,
    Failure.OUT_OF_MEMORY: Verdict.OUT_OF_MEMORY,
    Failure.CRASHED: Verdict.CRASHED,
    Failure.RAISED: Verdict.CRASHED,
}


def conform(
    command: Sequence[str], instances: Sequence[Instance], limits: Limits, *, workers: int = 1
) -> Generator[Result]:
    """
    Put instances to a planner, and judge what it answers.

    Parameters
    ----------
    command
        Program and arguments; it reads a problem and writes an answer (see `documents`).
    instances
        What is asked.
    limits
        Time and memory for each.
    workers
        How many at a time; they share out the cores.

    Yields
    ------
    result
        As they end, with several workers in no fixed order.

    Raises
    ------
    WorkerError
        If worker processes do not start.
    CglaError
        If the command cannot be started.

    Examples
    --------
    >>> from cgla_graph.comparisons.conformance.suite import chosen
    >>> one = next(conform(["echo", '{"path": null}'], chosen(["infeasible-wall"]), Limits(seconds=20.0)))
    >>> one.verdict.value
    'it found no path, and there is none'
    """
    where = (str(Path.cwd()), dict(os.environ), limits)
    calls = iter(
        [
            Call(number, ask, (tuple(command), one.problem.model_dump_json(), *where))
            for number, one in enumerate(instances)
        ]
    )
    seconds = limits.seconds + GRACE + _PREPARATION
    outcomes = isolated(lambda: next(calls, None), workers=workers, seconds=seconds, preload=[ask.__module__])
    with closing(outcomes):
        for call, outcome in outcomes:
            yield _result(instances[int(str(call.key))], outcome, limits, command)


def _result(instance: Instance, outcome: Outcome, limits: Limits, command: Sequence[str]) -> Result:
    """Turn what came of a call into a result."""
    if outcome.failure is not None:
        return Result(instance, _FAILED[outcome.failure], outcome.message)
    spoken: Spoken = outcome.value
    if spoken.end is End.NOT_STARTED:
        msg = f"{command[0]}: cannot be started: {spoken.complaint}; give a program, and its arguments behind it"
        raise CglaError(msg)
    if spoken.end is End.TIMED_OUT:
        return Result(instance, Verdict.TIMED_OUT, f"stopped after {limits.seconds:g} s", spoken.seconds)
    if spoken.end is End.TOO_MUCH:
        said = f"it wrote more than {MOST_OUTPUT // 2**20} MB to standard output"
        return Result(instance, Verdict.MALFORMED, said, spoken.seconds)
    if spoken.code != 0:
        complaint = f": {_short(spoken.complaint)}" if spoken.complaint else ""
        return Result(instance, Verdict.CRASHED, f"{_exit(spoken.code)}{complaint}", spoken.seconds)
    try:
        answer = read_answer(spoken.output.decode("utf-8", "replace"))
    except CglaError as error:
        return Result(instance, Verdict.MALFORMED, str(error), spoken.seconds)
    return judged(instance, answer, spoken.seconds)


def _exit(code: int) -> str:
    """Say what an exit code means."""
    if code > 0:
        return f"it left with the exit code {code}"
    try:
        return f"it died of {signal.Signals(-code).name}"
    except ValueError:
        return f"it died of signal {-code}"


def _short(line: str, most: int = 120) -> str:
    return line if len(line) <= most else f"{line[: most - 1]}…"
