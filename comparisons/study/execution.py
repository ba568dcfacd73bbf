"""Execution of a study: its cells become runs, wherever they are made, and reach the database as they come."""

from collections import deque
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import runner, worker
from cgla_graph.comparisons.study.database import Database
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.comparisons.workers.cluster import spread
from cgla_graph.comparisons.workers.limits import NO_LIMITS, PREPARATION, Limits, lost
from cgla_graph.comparisons.workers.pool import Call, Failure, NextCall, Outcome, here, isolated
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.scenario import Scenario

#: What a proof may take at least.
PROOF = Limits()


def run_study(
    study: Study, *, database: Database | None = None, workers: int = 1, scheduler: str | None = None
) -> Generator[Run]:
    """
    Make the runs of a study that are not in its database yet.

    The lower bound of a scenario is proven before its runs begin, so that each run says how far from the best
    possible it is.

    Parameters
    ----------
    study
        What to run.
    database
        Where runs go as they come, and what is done already; None keeps nothing.
    workers
        How many processes make runs at the same time; 0 makes them in this process, where a solver that hangs or
        crashes takes all with it (for debugging).
    scheduler
        Address of a Dask scheduler whose cluster makes the runs instead.

    Yields
    ------
    run
        As soon as it is done: with several workers, in no fixed order. A solver that hangs, takes too much memory,
        crashes or raises is a run that says so.

    Raises
    ------
    OutputError
        If the database cannot be written.
    CglaError
        If the cluster cannot be reached.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> study = Study([load_scenario("one-threat")], [Entrant.parse("cgla")], tolerance=None)
    >>> [(run.solver, run.solution.status.label) for run in run_study(study, workers=0)]
    [('cgla', 'optimal')]
    """
    limits = limits_where(study.limits, workers=workers, scheduler=scheduler)
    agenda = _Agenda.of(study, database, limits)
    # whatever ends the iteration ends the workers
    with closing(made(agenda.next_call, limits, workers=workers, scheduler=scheduler)) as outcomes:
        for call, outcome in outcomes:
            if isinstance(call.key, str):
                agenda.prove(call.key, outcome)
            else:
                run = agenda.run(call.key, outcome)  # type: ignore[arg-type]
                yield run if database is None else database.add(run)


def made(
    next_call: NextCall, limits: Limits, *, workers: int, scheduler: str | None = None, preload: Sequence[str] = ()
) -> Generator[tuple[Call, Outcome]]:
    """
    Make calls where they are to be made: on a cluster, in worker processes, or (no workers) in this process.

    Whoever iterates closes it, which ends the workers.

    Parameters
    ----------
    next_call
        As `isolation.isolated` takes it.
    limits
        Those that the functions set themselves.
    workers, scheduler
        As in `run_study`.
    preload
        Modules that workers load beforehand, besides those of runs.
    """
    seconds, modules = limits.seconds + PREPARATION, (*worker.PRELOAD, *preload)
    if scheduler is not None:
        return spread(next_call, scheduler=scheduler, seconds=seconds, preload=modules)
    if workers == 0:
        return here(next_call)
    return isolated(next_call, workers=workers, seconds=seconds, preload=modules)


def limits_where(limits: Limits, *, workers: int, scheduler: str | None = None) -> Limits:
    """Return the limits that hold where calls are made: none in the user's own process, which no limit may kill."""
    return limits if workers or scheduler is not None else NO_LIMITS


@dataclass(eq=False)
class _Agenda:
    """What is left to do: first the proof of each scenario, then its runs."""

    study: Study
    database: Database | None
    limits: Limits
    certificates: dict[str, Certificate]
    scenarios: dict[str, Scenario]
    entrants: dict[str, Entrant]
    #: scenarios with something left to be called for, in order
    open: deque["_Open"] = field(default_factory=deque)

    @classmethod
    def of(cls, study: Study, database: Database | None, limits: Limits) -> "_Agenda":
        agenda = cls(
            study,
            database,
            limits,
            certificates=database.certificates() if database else {},
            scenarios={scenario.name: scenario for scenario in study.scenarios},
            entrants={entrant.label: entrant for entrant in study.entrants},
        )
        done = database.finished() if database else set()
        left = {name: _Open(scenario) for name, scenario in agenda.scenarios.items()}
        for cell in study.cells():
            if cell not in done:
                left[cell.scenario].cells.append(cell)
        agenda.open.extend(one for one in left.values() if one.cells)
        return agenda

    def next_call(self) -> Call | None:
        """Return a run of the first scenario that has its proof, or else the first proof that is not under way."""
        for scenario in self.open:
            name = scenario.scenario.name
            if self.study.tolerance is None or name in self.certificates:
                return self._run_call(scenario)
            if not scenario.proof_called:
                scenario.proof_called = True
                arguments = (scenario.parcel(), self.study.tolerance, self._proof_limits())
                return Call(name, worker.prove, arguments)
        return None

    def _proof_limits(self) -> Limits:
        """Leave a proof time and memory also where runs have little: it is no solver's."""
        return Limits(max(self.limits.seconds, PROOF.seconds), max(self.limits.megabytes, PROOF.megabytes))

    def _run_call(self, scenario: "_Open") -> Call:
        cell = scenario.cells.popleft()
        arguments = (scenario.parcel(), self.entrants[cell.solver], cell.seed, self.limits)
        if not scenario.cells:
            self.open.remove(scenario)
        return Call(cell, worker.run, arguments)

    def prove(self, name: str, outcome: Outcome) -> None:
        """Take a scenario's proof, or the reason why there is none."""
        certificate = outcome.value
        if outcome.failure is not None:
            certificate = runner.no_certificate(
                self.study.tolerance or 0.0, lost(outcome, self._proof_limits())[1], 0.0
            )
        self.certificates[name] = certificate
        if self.database is not None:
            self.database.add_certificate(name, certificate)

    def run(self, cell: Cell, outcome: Outcome) -> Run:
        """Make a run of what a worker answered."""
        entrant = self.entrants[cell.solver]
        how: dict[str, Any] = {}
        if outcome.failure is None:
            answer: worker.Answer = outcome.value
            solution = answer.solution
            if solution.status.has_path and not entrant.is_built_in:
                # it may have changed what it was judged by
                solution = self.scenarios[cell.scenario].problem.judge(solution)
            how = {"megabytes": answer.megabytes, "host": answer.host}
        else:
            status, message = lost(outcome, self.limits)
            # a run that was killed has told nothing, but how long it was waited for
            seconds = self.limits.seconds if outcome.failure is Failure.TIMED_OUT else 0.0
            solution = Solution(status, solver=entrant.name, message=message, seconds=seconds)
        certificate = self.certificates.get(cell.scenario)
        return runner.run_of(self.scenarios[cell.scenario], entrant, cell.seed, solution, certificate, **how)


@dataclass(eq=False)
class _Open:
    """A scenario with runs left to be made."""

    scenario: Scenario
    cells: deque[Cell] = field(default_factory=deque)
    proof_called: bool = False
    _parcel: worker.Parcel | None = None

    def parcel(self) -> worker.Parcel:
        if self._parcel is None:
            self._parcel = worker.parcel(self.scenario)
        return self._parcel
