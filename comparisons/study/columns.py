"""The columns of a run, said once: files, the terminal and the report all show these."""

import json
import math
from collections.abc import Callable
from typing import Any, Literal, NamedTuple, TypeAlias

import numpy as np

from cgla_graph.comparisons.study.runner import Run

Kind: TypeAlias = Literal["word", "whole", "number", "flag"]
Format: TypeAlias = Literal[
    "name", "status", "message", "plain", "count", "figure", "percent", "time", "time-if-any", "memory"
]


class RunColumn(NamedTuple):
    """
    What there is to say of a run in one column.

    Attributes
    ----------
    key
        Its name in files.
    kind
        What it holds; whole numbers may be None, and numbers NaN or infinite, where there is none.
    value
        Says it of a run; beside that it is given the lattice optimum of its scenario, NaN where that is not known (as
        in the tables of the terminal and the report).
    head
        Its title in tables; files alone have a column without one. Words beside names and the status are shown in the
        report only, as a terminal has no room for them.
    format
        How tables write it.
    digits
        Significant digits there, of a ``figure`` and of ``memory``.
    kept
        Significant digits that the report keeps of a number, so that sorting sees what differs.
    spare
        When a narrow terminal leaves it out, the least first; None: it stays.
    """

    key: str
    kind: Kind
    value: Callable[[Run, float], Any]
    head: str = ""
    format: Format = "plain"
    digits: int = 3
    kept: int = 5
    spare: int | None = 0


def excess_over(cost: float, best: float) -> float:
    """
    Return by how much `cost` is above `best`, relative to it.

    Examples
    --------
    >>> round(excess_over(1.1, 1.0), 3), excess_over(0.0, 0.0)
    (0.1, 0.0)
    """
    if best == 0.0:
        return 0.0 if cost == 0.0 else math.inf
    return cost / best - 1.0


def _excess(run: Run, best_exact: float) -> float:
    # a path that may not be flown is no match for one that may
    return excess_over(run.solution.cost, best_exact) if run.solution.status.has_path else math.nan


def _gap(run: Run, _: float) -> float:
    return run.solution.gap if run.solution.status.has_path else math.nan


def _waypoints(run: Run, _: float) -> int:
    return np.size(run.solution.path, 0) if run.solution.status.has_path else 0


def _settings(run: Run, _: float) -> str:
    return json.dumps({key: _plain(value) for key, value in run.settings.items()}, ensure_ascii=False)


def _plain(value: Any) -> Any:  # noqa: ANN401 - a solver's setting may be anything
    """Return a setting that JSON knows; what it does not know, as text."""
    finite = not isinstance(value, float) or math.isfinite(value)
    return value if isinstance(value, (bool, int, float, str, type(None))) and finite else str(value)


_NUMBER = RunColumn("number", "whole", lambda run, _: run.number, "number", spare=None)
#: What every comparison says of a run, in the order of its files.
COMPARED = (
    RunColumn("scenario", "word", lambda run, _: run.scenario.name, "scenario", "name", spare=10),
    RunColumn("solver", "word", lambda run, _: run.solver, "solver", "name", spare=None),
    RunColumn("seed", "whole", lambda run, _: run.seed, "seed", spare=7),
    RunColumn("status", "word", lambda run, _: run.solution.status.label, "status", "status", spare=None),
    RunColumn("cost", "number", lambda run, _: run.solution.cost, "cost", "figure", 6, kept=8, spare=None),
    RunColumn("excess", "number", _excess),
    RunColumn("length", "number", lambda run, _: run.solution.length, "length", "figure", 6, kept=6, spare=6),
    RunColumn("risk", "number", lambda run, _: run.solution.risk, "risk", "figure", 4, spare=5),
    RunColumn("clearance", "number", lambda run, _: run.solution.clearance, "clearance", "figure", 3, spare=2),
    RunColumn("lower_bound", "number", lambda run, _: run.solution.lower_bound),
    RunColumn("gap", "number", _gap, "gap", "percent", spare=9),
    RunColumn("seconds", "number", lambda run, _: run.solution.seconds, "time", "time", spare=8),
    RunColumn("build_seconds", "number", lambda run, _: run.solution.build_seconds, "build", "time-if-any", spare=4),
    RunColumn("evaluations", "whole", lambda run, _: run.solution.evaluations, "evaluations", "count", spare=3),
    RunColumn("waypoints", "whole", _waypoints),
    RunColumn("message", "word", lambda run, _: run.solution.message, "message", "message"),
)
#: What a study says of a run, in the order of its exports.
COLUMNS = (
    _NUMBER,
    *COMPARED,
    RunColumn("settings", "word", _settings),
    RunColumn("megabytes", "number", lambda run, _: run.megabytes, "memory", "memory", spare=1),
    RunColumn("host", "word", lambda run, _: run.host),
    RunColumn("exact", "flag", lambda run, _: run.exact),
)
#: Tables begin with these; other numbers follow, and then other words, which take the most room.
_FIRST = ("number", "scenario", "solver", "seed", "status", "cost", "gap")
#: What tables show, in order.
SHOWN = tuple(
    sorted(
        (column for column in COLUMNS if column.head),
        key=lambda one: (_FIRST.index(one.key) if one.key in _FIRST else len(_FIRST), one.kind == "word"),
    )
)
