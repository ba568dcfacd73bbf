"""What a worker does: prove a scenario's bound, or make one run, within limits."""

import dataclasses
import hashlib
import math
import pickle
import socket
from collections.abc import Iterable
from contextlib import suppress
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.comparisons.workers.pool import limited, use_up
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.scenario import Scenario

#: What a worker needs, whatever it is asked for: loaded once, before workers part from each other.
PRELOAD = (__name__, "cgla_graph.comparisons.commands.app")
#: What has been made ready in this process: labels of entrants, and the proof (None).
_ready: set[str | None] = set()
#: The scenario of the last run in this process, by its key.
_last: dict[str, runner.Ground] = {}


class Parcel(NamedTuple):
    """A scenario on its way to a worker, and a key to know it by when it comes again."""

    key: str
    data: bytes


class Answer(NamedTuple):
    """What came out of a run: plain numbers, whatever the solver handed over; and what it took."""

    solution: Solution
    megabytes: float
    host: str


def parcel(scenario: Scenario) -> Parcel:
    """
    Wrap a scenario up.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> unwrapped(parcel(load_scenario("paper"))).name
    'paper'
    """
    data = pickle.dumps(scenario)
    return Parcel(hashlib.sha256(data).hexdigest(), data)


@lru_cache(maxsize=4)
def unwrapped(parcel: Parcel) -> Scenario:
    """Unwrap a scenario; the same one for the same parcel, so that what is known of it is not found anew."""
    scenario: Scenario = pickle.loads(parcel.data)  # noqa: S301 - from the process that started this one
    return scenario


def prove(parcel: Parcel, tolerance: float, limits: Limits) -> Certificate:
    """Bound the cost of a scenario's paths; what stops at a limit leaves no bound, but a reason."""
    scenario = unwrapped(parcel)
    if None not in _ready:
        runner.warm_up_proof()
        _ready.add(None)
    with limited(limits.seconds, limits.megabytes):
        proof = runner.certify(scenario, tolerance)
    # its grids are for pictures of one proof
    return dataclasses.replace(proof, grids=())


def run(parcel: Parcel, entrant: Entrant, seed: int | None, limits: Limits) -> Answer:
    """
    Make one run.

    After a solver that is no part of the toolkit, nothing of this process serves another run: the solver may have left
    anything behind, in the process and in the problem that it was given.
    """
    ground = _ground(parcel)
    if not entrant.is_built_in:
        use_up()
        forget()
    if entrant.label not in _ready:
        runner.warm_up([entrant])
        _ready.add(entrant.label)
    with limited(limits.seconds, limits.megabytes) as usage:
        solution = runner.run(ground, entrant, seed)
    if solution.status is Status.OUT_OF_MEMORY:
        solution = dataclasses.replace(solution, message=limits.spent_memory(solution.message))
    return Answer(plain(solution), usage.megabytes, socket.gethostname())


def forget() -> None:
    """Forget all scenarios: the next run gets a fresh copy of its own."""
    _last.clear()
    unwrapped.cache_clear()


def _ground(parcel: Parcel) -> runner.Ground:
    """Return a scenario with its graph, as it was left by the run before, if that was on the same one."""
    ground = _last.get(parcel.key)
    if ground is None:
        ground = runner.Ground.lay(unwrapped(parcel), next(iter(_last.values()), None))
        _last.clear()
        _last[parcel.key] = ground
    return ground


def plain(solution: Solution) -> Solution:
    r"""
    Copy an answer, so that it holds nothing but numbers and words, and no nodes.

    Whatever in it is no number becomes NaN (of a count: 0): a solver may answer anything.

    Examples
    --------
    >>> plain(Solution(Status.FOUND, cost="dear", message="a\nb")).message
    'a b'
    """
    numbers: dict[str, Any] = {name: _number(getattr(solution, name)) for name in _NUMBERS}
    return Solution(
        status=solution.status,
        path=np.array(solution.path, dtype=np.float64).reshape(-1, 2),
        solver=str(solution.solver),
        evaluations=_count(solution.evaluations),
        trace=tuple(_trace(solution.trace)),
        message=_visible(" ".join(str(solution.message).split())),
        **numbers,
    )


_NUMBERS = (
    *("cost", "length", "risk", "clearance", "lower_bound"),
    *("seconds", "build_seconds", "certificate_seconds"),
)


def _trace(points: Iterable[TracePoint]) -> Iterable[TracePoint]:
    return (TracePoint(_number(one.seconds), _count(one.evaluations), _number(one.cost)) for one in points)


def _visible(text: str) -> str:
    """Write what would steer a terminal as an escape."""
    return "".join(one if one.isprintable() else repr(one)[1:-1] for one in text)


def _number(value: Any) -> float:  # noqa: ANN401 - that is the point
    with suppress(TypeError, ValueError, OverflowError):
        return float(value)
    return math.nan


def _count(value: Any) -> int:  # noqa: ANN401 - that is the point
    with suppress(TypeError, ValueError, OverflowError):
        # as databases and tables count
        return min(max(int(value), 0), 2**63 - 1)
    return 0
