"""The filters of `cgla results`, which choose runs of a study."""

import difflib
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import Self

from cgla_graph._text import listed, shown
from cgla_graph.comparisons.study.flight_run import FlightRun
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.errors import CglaError
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.solution import Status

_MOST_NAMED = 12


@dataclass(frozen=True)
class Filters:
    """
    Conditions on runs to keep; None keeps all.

    Attributes
    ----------
    scenarios, solvers
        Names and labels, or patterns as ``random-*``.
    statuses
        Labels of `Status` and `MissionStatus`.
    seed
        Seed of the runs.

    Examples
    --------
    >>> Filters.read(solver="rrt-*,cgla").solvers
    ('rrt-*', 'cgla')
    """

    scenarios: Sequence[str] | None = None
    solvers: Sequence[str] | None = None
    statuses: Sequence[str] | None = None
    seed: int | None = None

    @classmethod
    def read(
        cls, scenario: str | None = None, solver: str | None = None, status: str | None = None, seed: int | None = None
    ) -> Self:
        """
        Read ``--scenario``, ``--solver``, ``--status`` and ``--seed``; commas separate names.

        Raises
        ------
        CglaError
            If an option names nothing, or there is no such status.
        """
        words = _split("--status", status)
        labels = dict.fromkeys(one.label for kind in (Status, MissionStatus) for one in kind)
        statuses = None if words is None else _matches("status", words, labels)
        return cls(_split("--scenario", scenario), _split("--solver", solver), statuses, seed)

    @property
    def is_on(self) -> bool:
        """Whether anything is left out."""
        return self != Filters()

    def note(self) -> str:
        """
        Name the kept runs in one line; empty if all are kept.

        Examples
        --------
        >>> Filters.read(scenario="paper", status="failed").note()
        'only scenario paper; status failed'
        """
        parts = [
            f"{kind} {', '.join(names)}"
            for kind, names in (("scenario", self.scenarios), ("solver", self.solvers))
            if names is not None
        ]
        if self.statuses is not None:
            parts.append(f"status {', '.join(self.statuses)}")
        if self.seed is not None:
            parts.append(f"seed {self.seed}")
        return f"only {'; '.join(parts)}" if parts else ""

    def of(
        self, runs: Sequence[Run], scenarios: Iterable[str], solvers: Iterable[str], seeds: Iterable[int | None]
    ) -> list[Run]:
        """
        Keep some of the runs of a study, in their order.

        Parameters
        ----------
        runs
            All runs that there are.
        scenarios, solvers, seeds
            Names, labels and seeds that may be asked for, those without a run, too.

        Raises
        ------
        CglaError
            If there is no such scenario, solver or seed; the message offers near ones.
        """
        kept = list(runs)
        if self.scenarios is not None:
            names = set(_matches("scenario", self.scenarios, scenarios))
            kept = [run for run in kept if run.scenario.name in names]
        if self.solvers is not None:
            labels = set(_matches("solver", self.solvers, solvers))
            kept = [run for run in kept if run.solver in labels]
        if self.statuses is not None:
            kept = [run for run in kept if run.solution.status.label in self.statuses]
        if self.seed is not None:
            known = sorted({seed for seed in seeds if seed is not None})
            if self.seed not in known:
                there_are = (
                    listed([str(seed) for seed in known], _MOST_NAMED) or "none, as no solver here draws random numbers"
                )
                msg = f"no run has the seed {self.seed}; there are: {there_are}"
                raise CglaError(msg)
            kept = [run for run in kept if run.seed == self.seed]
        return kept

    def of_flights(self, flights: Sequence[FlightRun]) -> list[FlightRun]:
        """Keep some of the flights of a study; names are checked by `of`, and those of missions count as scenarios."""
        return [
            one
            for one in flights
            if _passes(one.mission, self.scenarios)
            and _passes(one.solver, self.solvers)
            and (self.statuses is None or one.status in self.statuses)
            and self.seed in {None, one.seed}
        ]


def _passes(name: str, words: Sequence[str] | None) -> bool:
    """Return whether a name matches one of the names or patterns; no words match all."""
    return words is None or any(word == name or fnmatchcase(name, word) for word in words)


def _split(option: str, text: str | None) -> tuple[str, ...] | None:
    if text is None:
        return None
    # a comma inside brackets belongs to a setting of a solver
    words = tuple(word.strip() for word in re.split(r",(?![^(\[]*[)\]])", text) if word.strip())
    if not words:
        msg = f"{option} names nothing; give names with commas between, or a pattern as random-*"
        raise CglaError(msg)
    return words


def _matches(kind: str, words: Iterable[str], known: Iterable[str]) -> list[str]:
    """List the known names that match words or patterns, in their order."""
    names = list(known)
    found: set[str] = set()
    for word in words:
        # a name itself may look like a pattern
        matched = {word} if word in names else {name for name in names if fnmatchcase(name, word)}
        if not matched:
            near = difflib.get_close_matches(word, names, n=3, cutoff=0.5)
            near += [name for name in names if name.startswith(word) and name not in near][:3]
            remedy = f"did you mean {' or '.join(near)}?" if near else f"there are: {listed(names, _MOST_NAMED)}"
            msg = f"unknown {kind} {shown(word)}; {remedy}"
            raise CglaError(msg)
        found |= matched
    return [name for name in names if name in found]
