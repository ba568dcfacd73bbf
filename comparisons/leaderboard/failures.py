"""Failures: the runs without a path that may be flown, grouped by who failed, how and why."""

import re
from collections.abc import Iterable
from dataclasses import dataclass

from cgla_graph.comparisons.study.runner import Run
from cgla_graph.model.solution import Status

#: A number in a message, with what stands for each in a pattern.
_NUMBER, _ANY = re.compile(r"\d[\d.e+-]*"), "#"


@dataclass(frozen=True, eq=False)
class FailureGroup:
    """
    Runs of one solver that failed in the same way, with messages that differ by numbers only.

    Attributes
    ----------
    solver
        Label.
    status
        How they ended.
    runs
        At least one, in order.
    """

    solver: str
    status: Status
    runs: tuple[Run, ...]

    @property
    def message(self) -> str:
        """What the first one says, in one line."""
        return " ".join(str(self.runs[0].solution.message).split())

    @property
    def scenarios(self) -> list[str]:
        """Names, each once, in order."""
        return list(dict.fromkeys(run.scenario.name for run in self.runs))


def failed(runs: Iterable[Run]) -> list[Run]:
    """
    List the runs without a path that may be flown.

    Examples
    --------
    >>> failed([])
    []
    """
    return [run for run in runs if not run.solution.status.has_path]


def failure_groups(runs: Iterable[Run]) -> list[FailureGroup]:
    """
    Group the runs without a path by solver, status and message; in the order of the first of each.

    Examples
    --------
    >>> failure_groups([])
    []
    """
    groups: dict[tuple[str, Status, str], list[Run]] = {}
    for run in failed(runs):
        pattern = _NUMBER.sub(_ANY, str(run.solution.message))
        groups.setdefault((run.solver, run.solution.status, pattern), []).append(run)
    return [FailureGroup(solver, status, tuple(group)) for (solver, status, _), group in groups.items()]
