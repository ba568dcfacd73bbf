"""Runs as rows of a study's database: the numbers that others plot, and what restores the run to the last bit."""

import json
import math
from collections.abc import Mapping
from typing import Any, NamedTuple

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.statistics.intervals import progress
from cgla_graph.comparisons.study.codec import decode, dumps, encode
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.schema import STATUS
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario

#: The columns of ``runs`` behind OMPL's own three.
RUN_COLUMNS = (
    *("time", "memory", "status", "solved", "correct_solution", "solution_length", "best_cost"),
    *("risk", "clearance", "lower_bound", "gap", "seconds", "build_seconds", "evaluations", "waypoints", "seed"),
)
_NUMBERS = (
    *("cost", "length", "risk", "clearance", "lower_bound"),
    *("seconds", "build_seconds", "certificate_seconds"),
)
_STEP = np.dtype([("seconds", "<f8"), ("evaluations", "<i8"), ("cost", "<f8")])
#: What whole numbers of SQLite hold, and what those that were floats in between do.
_MOST = 2**63 - 1
_MOST_EXACT = 2**53


class Answer(NamedTuple):
    """What restores a run: a document, the waypoints and the trace; see the table ``answers``."""

    document: str
    path: bytes
    trace: bytes


def run_row(run: Run) -> tuple[float | int | None, ...]:
    """
    Return what others plot of a run, a value for each of `RUN_COLUMNS`.

    Times are in seconds (``time`` is that of building the graph and of solving), memory in units of 2**20 bytes, the
    others in map units. NaN, infinity and what is said of a path that may not be flown are None.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> run = Run(load_scenario("paper"), "mine", 7, False, Solution(Status.NOT_FOUND, seconds=1.0, build_seconds=0.5))
    >>> dict(zip(RUN_COLUMNS, run_row(run)))["time"]
    1.5
    """
    solution = run.solution
    is_path = solution.status.has_path
    of_path = (solution.length, solution.cost, solution.risk, solution.clearance)
    length, cost, risk, clearance = (_finite(value) if is_path else None for value in of_path)
    return (
        _finite(solution.total_seconds),
        _finite(run.megabytes),
        STATUS[solution.status],
        # both alike: a path that may not be flown solves nothing
        int(is_path),
        int(is_path),
        length,
        cost,
        risk,
        clearance,
        _finite(solution.lower_bound),
        _finite(solution.gap) if is_path else None,
        _finite(solution.seconds),
        _finite(solution.build_seconds),
        _whole(solution.evaluations),
        len(solution.path) if is_path else 0,
        _whole(run.seed),
    )


def progress_rows(solution: Solution) -> list[tuple[float, float, int]]:
    """
    Return the best cost over time that others plot: seconds, cost and evaluations, one row a moment.

    Examples
    --------
    >>> trace = (TracePoint(0.1, 5, 4.0), TracePoint(0.1, 6, 3.0))
    >>> progress_rows(Solution(Status.FOUND, cost=2.0, seconds=1.0, evaluations=9, trace=trace))
    [(0.1, 3.0, 6), (1.0, 2.0, 9)]
    """
    if not solution.trace:
        return []
    counts = (solution.evaluations, *(point.evaluations for point in solution.trace))
    if not all(abs(count) <= _MOST_EXACT for count in counts):
        return []
    steps = progress(solution)
    # of one moment, the last row counts, which has the least cost
    by_moment = {seconds: (cost, count) for seconds, count, cost in steps.tolist() if math.isfinite(seconds + cost)}
    return [(seconds, cost, int(count)) for seconds, (cost, count) in by_moment.items()]


def answer(run: Run) -> Answer:
    """
    Return what restores a run, but for its scenario, entrant and certificate.

    Its nodes are not kept: the path says the same.

    Raises
    ------
    StudyError
        If a setting has a value that no document holds.
    """
    solution = run.solution
    numbers: dict[str, Any] = {name: float(getattr(solution, name)) for name in _NUMBERS}
    document = {
        **numbers,
        "status": solution.status.name,
        "solver": str(solution.solver),
        "evaluations": solution.evaluations,
        "message": str(solution.message),
        "exact": bool(run.exact),
        "settings": run.settings,
        "megabytes": float(run.megabytes),
        "host": str(run.host),
    }
    steps = [(point.seconds, point.evaluations, point.cost) for point in solution.trace]
    if all(abs(count) <= _MOST for _, count, _ in steps):
        trace = np.array(steps, dtype=_STEP).tobytes()
    else:
        trace, document["trace"] = b"", [list(step) for step in steps]
    path = np.ascontiguousarray(solution.path, dtype="<f8").reshape(-1, 2)
    return Answer(dumps(encode(document)), path.tobytes(), trace)


def restored(
    number: int,
    scenario: Scenario,
    solver: str,
    seed: int | None,
    certificate: Certificate | None,
    kept: Answer,
) -> Run:
    """Build a run of what `answer` kept of it; what is malformed raises whatever it does."""
    document = decode(json.loads(kept.document))
    return Run(
        scenario=scenario,
        solver=solver,
        seed=seed,
        exact=document["exact"],
        solution=_solution(document, kept),
        certificate=certificate,
        settings=document["settings"],
        megabytes=document["megabytes"],
        host=document["host"],
        number=number,
    )


def _solution(document: Mapping[str, Any], kept: Answer) -> Solution:
    steps = document.get("trace")
    if steps is None:
        steps = np.frombuffer(kept.trace, dtype=_STEP).tolist()
    path: FloatArray = np.frombuffer(kept.path, dtype="<f8").reshape(-1, 2)
    numbers: dict[str, Any] = {name: document[name] for name in _NUMBERS}
    return Solution(
        status=Status[document["status"]],
        path=path,
        solver=document["solver"],
        evaluations=document["evaluations"],
        trace=tuple([TracePoint(*step) for step in steps]),
        message=document["message"],
        **numbers,
    )


def _finite(value: float) -> float | None:
    return float(value) if math.isfinite(value) else None


def _whole(value: int | None) -> int | None:
    """Return a whole number that fits; else None."""
    return int(value) if value is not None and abs(value) <= _MOST else None
