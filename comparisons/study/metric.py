"""Metrics of people's own: a number of each path, in tables, ranking, report and exports."""

import hashlib
import inspect
import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeAlias, TypeVar, get_args

from cgla_graph._text import ShortRepr, shown
from cgla_graph._validate import choice
from cgla_graph.errors import StudyError
from cgla_graph.isolation.shared import call_apart
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution
from cgla_graph.solvers import own

Better: TypeAlias = Literal["less", "more"]
FunctionT = TypeVar("FunctionT", bound=Callable[..., Any])

#: Where `metric` marks a function.
_MARK = "__cgla_metric__"
#: Longest time of a metric on one path, seconds.
LONGEST = 60.0
#: Letters of a name and of a unit, at most.
LONGEST_NAME = 40


class Measure(NamedTuple):
    """
    A metric's value on one path.

    Attributes
    ----------
    name, unit, better
        As of the `Metric`.
    value
        NaN without a path, or where the metric failed.
    """

    name: str
    unit: str
    better: Better
    value: float

    @property
    def head(self) -> str:
        """Name and unit, for tables."""
        return f"{self.name}, {self.unit}" if self.unit else self.name


@dataclass(frozen=True)
class Metric(ShortRepr):
    """
    A number of a path.

    Attributes
    ----------
    name
        Its name in tables and files.
    function
        Computes it from the path and the problem: of a `Problem`, waypoints of shape ``(m, 2)`` in map units; of a
        `GraphProblem`, the tuple of the labels of its nodes.
    unit
        Unit of its values; may be empty.
    better
        ``less`` or ``more``.
    digest
        SHA-256 of its source.
    """

    name: str
    function: Callable[[Any, Any], float]
    unit: str = ""
    better: Better = "less"
    digest: str = ""

    def measured(self, value: float) -> Measure:
        """Return a value with its name, unit and direction."""
        return Measure(self.name, self.unit, self.better, value)


def metric(*, unit: str = "", better: Better = "less", name: str = "") -> Callable[[FunctionT], FunctionT]:
    """
    Mark a function of a path (on a graph the labels of its nodes) and a problem as a metric.

    Parameters
    ----------
    unit
        Unit of its values.
    better
        Whether ``less`` or ``more`` is better.
    name
        Its name in tables; that of the function if left out.

    Raises
    ------
    ProblemError
        If `better` is neither.

    Examples
    --------
    >>> @metric(better="less")
    ... def waypoints(path, problem):
    ...     return len(path)
    >>> as_metric(waypoints).name
    'waypoints'
    """
    choice("better", better, get_args(Better))

    def mark(function: FunctionT) -> FunctionT:
        setattr(function, _MARK, (name, unit, better))
        return function

    return mark


def as_metric(given: object) -> Metric:
    """
    Return a metric as it is, or make one of a function.

    Raises
    ------
    StudyError
        If it is neither.
    """
    if isinstance(given, Metric):
        return given
    if not callable(given) or isinstance(given, type):
        msg = f"a metric is {shown(given)}; give a function of a path and a problem, or the name of a file of them"
        raise StudyError(msg)
    marked: tuple[str, str, Better] = getattr(given, _MARK, ("", "", "less"))
    name, unit, better = marked
    name = name or getattr(given, "__name__", "metric")
    if not (name.isprintable() and unit.isprintable() and 0 < len(name) <= LONGEST_NAME and len(unit) <= LONGEST_NAME):
        msg = f"the metric {shown(name)} has no name for a table; give printable text of at most {LONGEST_NAME} letters"
        raise StudyError(msg)
    return Metric(name, given, unit, better, _digest(given))


def read_metrics(names: Iterable[str], folder: Path | None = None) -> list[Metric]:
    """
    Read metrics from files: all marked functions of ``./mine.py``, or one, ``./mine.py:turning``.

    Raises
    ------
    SolverUnavailableError
        If a file cannot be read or run, or has no such function.
    StudyError
        If a file has no metric, or the name is no function.
    """
    found: list[Metric] = []
    for name in names:
        place = name if folder is None else str(folder / name)
        if own.is_in_file(place):
            found.append(as_metric(own.load(place, f"metric {shown(name)}")[0]))
            continue
        module = own.load_module(place, f"metric {shown(name)}")
        marked = [one for one in vars(module).values() if hasattr(one, _MARK)]
        if not marked:
            msg = f"{name} has no metric; mark a function by @metric, or name one, as {name}:FUNCTION"
            raise StudyError(msg)
        found += map(as_metric, marked)
    return found


def measures(
    metrics: Sequence[Metric], solution: Solution, problem: Problem | GraphProblem
) -> tuple[tuple[Measure, ...], str]:
    """
    Compute metrics of a path, in a process of their own.

    Returns
    -------
    measures, note
        Values, NaN without a path or where a metric failed, and why metrics failed, in one line.
    """
    found, notes = [], []
    path = solution.nodes if isinstance(problem, GraphProblem) else solution.path
    for one in metrics:
        value = math.nan
        if solution.status.has_path:
            outcome = call_apart(_value, (one.function, path, problem), LONGEST)
            if outcome.failure is None:
                value = outcome.value
            else:
                notes.append(f"metric {one.name}: {outcome.message or outcome.failure.value}")
        found.append(one.measured(value))
    return tuple(found), "; ".join(notes)


def forgotten(*_: object) -> float:
    """Stand for the function of a metric that a stored study had; raise `StudyError`."""
    msg = "a study does not keep the functions of its metrics; give its maps, --solvers and --metrics again"
    raise StudyError(msg)


def _value(function: Callable[[Any, Any], float], path: object, problem: Problem | GraphProblem) -> float:
    return float(function(path, problem))


def _digest(function: Callable[..., Any]) -> str:
    try:
        source = inspect.getsource(function).encode()
    except (OSError, TypeError):
        source = repr(getattr(function, "__code__", function)).encode()
    return hashlib.sha256(source).hexdigest()
