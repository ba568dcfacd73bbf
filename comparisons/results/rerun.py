"""One row of a study once more: the same scenario, settings and seed, within the same limits."""

import dataclasses
import math
from collections.abc import Callable, Mapping
from contextlib import closing
from dataclasses import dataclass
from typing import Any

import numpy as np

from cgla_graph._text import duration, figure, percent
from cgla_graph.comparisons import console
from cgla_graph.comparisons.study.execution import run_study
from cgla_graph.comparisons.study.rows import COMPARED, graph_columns, row
from cgla_graph.comparisons.study.runner import Run, with_refuted_claims
from cgla_graph.comparisons.study.store import Stored
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.tables.fitted_table import FittedTable
from cgla_graph.errors import CglaError
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.graphs.graph_scenario import GraphScenario
from cgla_graph.solvers.solving import bounded

#: Runs that something stopped from outside.
_KILLED = {Status.TIMED_OUT, Status.OUT_OF_MEMORY, Status.CRASHED}


@dataclass(frozen=True, eq=False)
class Rerun:
    """
    A run of a study, and the same run once more.

    Attributes
    ----------
    stored, now
        The one in the study and the new one.
    """

    stored: Run
    now: Run

    @property
    def same(self) -> dict[str, bool]:
        """Whether status, path and cost are the same, these two to the last bit; no path costs as much as no path."""
        stored, now = self.stored.solution, self.now.solution
        # (on a map, nodes are not kept)
        on_graph = isinstance(self.stored.scenario, GraphScenario)
        return {
            "status": stored.status is now.status,
            "path": np.array_equal(stored.path, now.path) and (not on_graph or stored.nodes == now.nodes),
            "cost": np.array_equal([stored.cost], [now.cost], equal_nan=True),
        }

    @property
    def is_identical(self) -> bool:
        """Whether status, path and cost are the same."""
        return all(self.same.values())

    def verdict(self) -> str:
        """Say in one line whether both are identical, and why they may not be."""
        if self.is_identical:
            return "identical: status, path and cost are the same, to the last bit"
        differs = ", ".join(name for name, is_same in self.same.items() if not is_same)
        seconds = self.stored.settings.get("seconds")
        if _KILLED & {self.stored.solution.status, self.now.solution.status}:
            why = "; where a limit stops a run depends on how fast the machine is"
        elif seconds is not None:
            why = f"; it may end after seconds={seconds}, so its path depends on the speed of the machine"
        else:
            why = "; another version of the toolkit, of a package or of the machine may be the reason"
        return f"not identical: {differs} differ{'' if ',' in differs else 's'}{why}"

    def document(self) -> dict[str, Any]:
        """Return both as JSON."""
        columns = [*COMPARED, *graph_columns([self.stored])]
        return {
            "number": self.stored.number,
            "settings": {key: str(value) for key, value in self.stored.settings.items()},
            "stored": {**row(self.stored, columns=columns), "path": self.stored.solution.path.tolist()},
            "now": {**row(self.now, columns=columns), "path": self.now.solution.path.tolist()},
            "same": self.same,
            "identical": self.is_identical,
        }


def rerun(stored: Stored, number: int) -> Rerun:
    """
    Run one row of a study again, by its number in tables and the report.

    Raises
    ------
    CglaError
        If there is no such run.
    """
    before = find(stored, number)
    seeds = () if before.seed is None else (before.seed,)
    alone = Study([before.scenario], [stored.entrants[before.solver]], seeds, tolerance=None, limits=stored.limits)
    with console.running_solvers(), closing(run_study(alone, workers=1)) as runs:
        now = next(runs)
    solution = bounded(now.solution, before.certificate)
    now = dataclasses.replace(now, scenario=before.scenario, solution=solution, certificate=before.certificate)
    # a claim is held against the other paths of the study, too
    return Rerun(before, with_refuted_claims([now, *stored.runs])[0])


def find(stored: Stored, number: int) -> Run:
    """Find a run by its number; a `CglaError` says which numbers there are."""
    by_number = {run.number: run for run in stored.runs if run.number is not None}
    if number not in by_number:
        known = f"they go from {min(by_number)} to {max(by_number)}" if by_number else "it has no runs yet"
        msg = f"{stored.folder} has no run {number}; {known} (--runs lists them)"
        raise CglaError(msg)
    return by_number[number]


_NUMBERS: Mapping[str, Callable[[Solution], str]] = {
    "status": lambda found: found.status.label,
    "cost": lambda found: figure(found.cost, 12),
    "gap": lambda found: percent(found.gap) if found.status.has_path else "-",
    "length": lambda found: figure(found.length, 12),
    "risk": lambda found: figure(found.risk, 12),
    "clearance": lambda found: figure(found.clearance, 6),
    "waypoints": lambda found: str(len(found.nodes or found.path)),
    "time": lambda found: duration(found.seconds),
    "build": lambda found: duration(found.build_seconds),
    "evaluations": lambda found: f"{found.evaluations:,.0f}" if math.isfinite(found.evaluations) else "-",
}


def rerun_table(both: Rerun) -> FittedTable:
    """Show the numbers of both runs beside each other."""
    stored, now = both.stored, both.now
    seed = "" if stored.seed is None else f", seed {stored.seed}"
    title = f"run {stored.number}: {stored.solver} on {stored.scenario.name}{seed}"
    rows = [[name, write(stored.solution), write(now.solution)] for name, write in _NUMBERS.items()]
    settings = ", ".join(f"{key}={value}" for key, value in stored.settings.items())
    messages = [f"{name}: {run.solution.message}" for name, run in (("stored", stored), ("now", now))]
    notes = [
        both.verdict(),
        *([f"settings: {settings}"] if settings else []),
        *(note for note, run in zip(messages, (stored, now), strict=True) if run.solution.message),
    ]
    return FittedTable(title, ("",), ("stored", "now"), rows=list(rows), notes=notes)
