"""Run a planner on each instance, one process each, and judge its answers."""

import os
import shutil
import signal
import sys
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from typing import cast

from cgla_graph._text import shown
from cgla_graph._validate import positive_number, whole_number
from cgla_graph.comparisons import console
from cgla_graph.comparisons.conformance.documents import read_answer
from cgla_graph.comparisons.conformance.suite import Instance, chosen
from cgla_graph.comparisons.conformance.verdict import Result, Verdict, judged
from cgla_graph.comparisons.workers.pool import Call, isolated
from cgla_graph.errors import CglaError, WorkerError
from cgla_graph.isolation.command import GRACE, MOST_OUTPUT, CommandResult, End, run_command
from cgla_graph.isolation.limits import Limits
from cgla_graph.isolation.outcome import Failure, Outcome

#: Time of a worker beyond the planner's limit.
_PREPARATION = 60.0
#: Most workers at a time.
MOST_WORKERS = 1000
_FAILED = {
    Failure.TIMED_OUT: Verdict.TIMED_OUT,
    Failure.OUT_OF_MEMORY: Verdict.OUT_OF_MEMORY,
    Failure.CRASHED: Verdict.CRASHED,
    Failure.RAISED: Verdict.CRASHED,
}


def conform(
    command: Sequence[str | Path] | str | Path,
    instances: Sequence[str | Instance] | str = (),
    *,
    timeout: float = 60.0,
    memory: float = 4096.0,
    workers: int = 1,
) -> list[Result]:
    """
    Check a planner against proven optima: run it on instances of the suite, and judge its answers.

    It starts processes: on Windows, a script calls this inside of ``if __name__ == "__main__":``.

    Parameters
    ----------
    command
        Program and arguments, as ``["python3", "planner.py"]``; it reads a problem and writes an answer, as JSON.
    instances
        Names of instances or families, or instances of your own; by default the whole suite.
    timeout, memory
        Seconds that an instance may take, and megabytes that each process of the planner may take; above 0.
    workers
        Number of instances at a time; they share the cores.

    Returns
    -------
    results
        One an instance, in the order of the suite, or that in which they are given.

    Raises
    ------
    CglaError
        If there is no such program or instance, or a setting is wrong; the message names allowed values.

    Examples
    --------
    >>> from cgla_graph import comparisons
    >>> (one,) = comparisons.conform(["echo", '{"path": [[0.05, 0.5], [0.95, 0.5]]}'], ["open-straight"])
    >>> one.verdict.label, one.instance.lower_bound <= one.cost, one.gap < 0.005
    ('feasible', True, True)
    """
    limits = Limits(positive_number("timeout", timeout), positive_number("memory", memory))
    whole_number("workers", workers, at_least=1, at_most=MOST_WORKERS)
    asked = _asked(instances)
    results: dict[int, Result] = {}
    places = {id(one): place for place, one in enumerate(asked)}
    answers = results_of(checked(command), asked, limits, workers=workers)
    with console.progress(len(asked)) as step, closing(answers):
        for result in answers:
            results[places[id(result.instance)]] = result
            step(result.instance.name)
    return [results[place] for place in range(len(asked))]


def _asked(instances: Sequence[str | Instance] | str) -> list[Instance]:
    """Return instances of the suite by name; instances are returned unchanged."""
    given = [instances] if isinstance(instances, str | Instance) else list(instances)
    if not given:
        return chosen()
    found = [one for each in given for one in ([each] if isinstance(each, Instance) else chosen([each]))]
    return list({id(one): one for one in found}.values())


def checked(command: Sequence[str | Path] | str | Path) -> list[str]:
    """
    Check that a command exists before it is run; a text is the name of a program.

    Raises
    ------
    CglaError
        If it is not.

    Examples
    --------
    >>> checked(["no-such-planner"])
    Traceback (most recent call last):
    cgla_graph.errors.CglaError: 'no-such-planner': there is no such program; give one that is on the PATH, or its path
    """
    if isinstance(command, str | Path):
        command = [str(command)]
    given = cast("object", command)
    if not isinstance(given, Sequence) or not all(isinstance(word, str | Path) for word in given):
        msg = f"a planner is {shown(command)}; give a program and its arguments, as in ['python3', 'planner.py']"
        raise CglaError(msg)
    if not command:
        msg = "there is no planner; write cgla conform -- COMMAND, as in cgla conform -- python3 planner.py"
        raise CglaError(msg)
    words = [str(word) for word in command]
    # also beside the running Python, since its virtual environment may not be activated
    found = shutil.which(words[0]) or shutil.which(words[0], path=str(Path(sys.executable).parent))
    if found is None:
        hint = "; its arguments are texts of their own" if len(words) == 1 and " " in words[0].strip() else ""
        msg = f"{shown(words[0])}: there is no such program; give one that is on the PATH, or its path{hint}"
        raise CglaError(msg)
    return [str(Path(found).absolute()), *words[1:]]


def results_of(
    command: Sequence[str], instances: Sequence[Instance], limits: Limits, *, workers: int = 1
) -> Generator[Result]:
    """
    Run a planner on instances, and yield each result as it ends.

    Parameters
    ----------
    command
        Program and arguments; it reads a problem and writes an answer (see `documents`).
    instances
        The problems.
    limits
        Time and memory for each.
    workers
        Number at a time; they share the cores.

    Yields
    ------
    result
        In the order in which they end.

    Raises
    ------
    WorkerError
        If worker processes do not start.
    CglaError
        If the command cannot be started.

    Examples
    --------
    >>> one = next(results_of(["echo", '{"path": null}'], chosen(["infeasible-wall"]), Limits(seconds=20.0)))
    >>> one.verdict.value
    'it found no path, and there is none'
    """
    where = (str(Path.cwd()), dict(os.environ), limits)
    calls = iter(
        [
            Call(number, run_command, (tuple(command), one.problem.model_dump_json(), *where))
            for number, one in enumerate(instances)
        ]
    )
    seconds = limits.seconds + GRACE + _PREPARATION
    outcomes = isolated(lambda: next(calls, None), workers=workers, seconds=seconds, preload=[run_command.__module__])
    with closing(outcomes):
        for call, outcome in outcomes:
            yield _result(instances[int(str(call.key))], outcome, limits, command)


def _result(instance: Instance, outcome: Outcome, limits: Limits, command: Sequence[str]) -> Result:
    """Turn the outcome of a call into a result."""
    if outcome.failure is not None and outcome.failure.is_environment:
        msg = f"{instance.name}: the command could not be run: {outcome.message}; mend that, and begin again"
        raise WorkerError(msg)
    if outcome.failure is not None:
        return Result(instance, _FAILED[outcome.failure], outcome.message)
    spoken: CommandResult = outcome.value
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
    """Describe an exit code."""
    if code > 0:
        return f"it left with the exit code {code}"
    try:
        return f"it died of {signal.Signals(-code).name}"
    except ValueError:
        return f"it died of signal {-code}"


def _short(line: str, most: int = 120) -> str:
    return line if len(line) <= most else f"{line[: most - 1]}…"
