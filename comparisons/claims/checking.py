"""The study of claims: experiments are made on maps, claims are checked on what they measured, figures are drawn."""

import time
from collections.abc import Generator, Iterator, Mapping, Sequence
from contextlib import closing, contextmanager
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.artefact import MODULES, Artefact, Content, artefacts
from cgla_graph.comparisons.claims.claim import Claim, Finding, missing
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.panel.settings import Panel, PanelMap
from cgla_graph.comparisons.claims.store import FIGURE, FINDING, SAMPLE, Drawn, Found, Measured, Store
from cgla_graph.comparisons.workers.tasks import Key, Results, Task, run_tasks
from cgla_graph.errors import SolverUnavailableError
from cgla_graph.isolation.limits import Limits, limited
from cgla_graph.isolation.outcome import Outcome
from cgla_graph.model.isolated import lost

#: What one map of an experiment, one check or one figure may take.
LIMITS = Limits(seconds=1800.0)


@dataclass(frozen=True)
class Result:
    """
    What came of a claim.

    Attributes
    ----------
    claim, finding, seconds
        The claim, what its check found, and in what time, without the experiments.
    maps, lost
        By experiment, the number of its maps, and how many of them told nothing, with the first reason.
    """

    claim: Claim
    finding: Finding
    seconds: float
    maps: Mapping[str, int] = field(default_factory=dict)
    lost: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, eq=False)
class Shown:
    """What came of a figure or table: what it shows, or None and why that failed."""

    artefact: Artefact
    content: Content | None
    failed: str = ""


@dataclass(frozen=True)
class Step:
    """A step of a study that is done; `result` where it was a check, a figure or a table."""

    what: str
    result: Result | Shown | None = None


def count_steps(claims: Sequence[Claim], store: Store, wanted: Sequence[Artefact] = ()) -> int:
    """Count the steps that are left to do."""
    return sum(task.key not in store for task in claim_tasks(claims, store, wanted))


def check_claims(
    claims: Sequence[Claim],
    store: Store,
    wanted: Sequence[Artefact] = (),
    *,
    workers: int = 1,
    scheduler: str | None = None,
) -> Generator[Step]:
    """
    Check claims: make what their experiments lack, on all cores, run their checks, and draw figures and tables.

    Parameters
    ----------
    claims, wanted
        Different ones; figures and tables.
    store
        Where all goes as it comes, and what is done already; it also says how much is asked for.
    workers, scheduler
        As `run_tasks` takes them.

    Yields
    ------
    step
        All that is done, in no fixed order; those with a result are the claims, figures and tables, each once. A check
        that fails has the answer "missing", with the reason, and a figure that fails says why; a map that tells
        nothing is counted.

    Raises
    ------
    OutputError
        If the store cannot be written.

    Examples
    --------
    >>> from cgla_graph.comparisons.claims.evidence import Scale
    >>> with Store(None, Scale(quick=True)) as store:
    ...     steps = list(check_claims(catalogue.chosen(["C16"]), store, workers=0))
    >>> [step.result.finding.rows[0].answer.label for step in steps]
    ['fails']
    """
    named = _named(claims, wanted)
    yield from (Step(key[1], _result(of, store[key], store)) for key, of in named.items() if key in store)
    modules = [f"{catalogue.PACKAGE}.{name}" for name in catalogue.TOPICS]
    modules += [f"cgla_graph.comparisons.claims.figures.{name}" for name in (MODULES if wanted else ())]
    how: dict[str, Any] = {"limits": LIMITS, "workers": workers, "scheduler": scheduler, "preload": modules}
    with closing(run_tasks(claim_tasks(claims, store, wanted), store, **how)) as results:
        for task, result in results:
            if task.key in named:
                yield Step(task.key[1], _result(named[task.key], result, store))
            else:
                yield Step(f"{task.key[1]}: map {task.key[2]}")


def _named(claims: Sequence[Claim], wanted: Sequence[Artefact]) -> dict[Key, Claim | Artefact]:
    return {(FINDING, one.id): one for one in claims} | {(FIGURE, one.label): one for one in wanted}


def claim_tasks(claims: Sequence[Claim], store: Store, wanted: Sequence[Artefact] = ()) -> list[Task]:
    """List checks, which begin as soon as they can, the samples that are needed, and figures and tables."""
    how = {FINDING: (_check, _found), FIGURE: (_make, _drawn)}
    tasks = []
    for key, of in _named(claims, wanted).items():
        needs = [(SAMPLE, name, seed) for name in of.experiments for seed in _seeds(name, store)]
        call, result = how[key[0]]
        tasks.append(Task(key, call, partial(_arguments, key[1], of.experiments, store.scale), result, needs))
    samples = dict.fromkeys(key for task in tasks for key in task.needs)
    measured = [Task(key, _sample, (*key[1:], store.scale.panel), _measured) for key in samples]
    return [*tasks[: len(claims)], *measured, *tasks[len(claims) :]]


def _seeds(experiment: str, store: Store) -> list[int]:
    """Return the seeds of the maps of an experiment."""
    scale = store.scale
    return catalogue.experiments()[experiment].seeds(scale.seed, scale.maps, quick=scale.quick, panel=scale.panel)


def _arguments(of: str, experiments: Sequence[str], scale: Scale, done: Results) -> tuple[str, Evidence]:
    samples = {}
    for name in experiments:
        measured: dict[int, Measured] = {key[2]: one for key, one in done.items() if key[1] == name}
        records: list[Record] = [{**one, "map": seed} for seed, made in measured.items() for one in made.records]
        samples[name] = Samples(records, {seed: made.failed for seed, made in measured.items() if made.failed})
    return of, Evidence(scale, samples)


def _reason(outcome: Outcome, limits: Limits) -> str:
    return "" if outcome.failure is None else ": ".join(filter(None, lost(outcome, limits)[1:]))


def _measured(outcome: Outcome, limits: Limits, _: Results) -> Measured:
    return Measured(outcome.value or [], _reason(outcome, limits))


def _found(outcome: Outcome, limits: Limits, _: Results) -> Found:
    return Found(*outcome.value) if outcome.failure is None else Found(missing(_reason(outcome, limits)))


def _drawn(outcome: Outcome, limits: Limits, _: Results) -> Drawn:
    return Drawn(outcome.value, "" if outcome.failure is None else lost(outcome, limits)[1])


def _result(of: Claim | Artefact, made: Any, store: Store) -> Result | Shown:  # noqa: ANN401 - what the store holds
    if isinstance(of, Artefact):
        return Shown(of, *made)
    maps, lost_maps = {}, {}
    for name in of.experiments:
        samples: list[Measured] = [store[SAMPLE, name, seed] for seed in _seeds(name, store)]
        maps[name] = len(samples)
        if reasons := [one.failed for one in samples if one.failed]:
            lost_maps[name] = f"{len(reasons)}: {reasons[0]}"
    return Result(of, made.finding, made.seconds, maps, lost_maps)


# ---- in a worker ----


@contextmanager
def _held(limits: Limits) -> Iterator[None]:
    """Limit a call; that a solver is not installed is a reason not to check a claim, and no broken environment."""
    with limited(limits.seconds, limits.megabytes):
        try:
            yield
        except SolverUnavailableError as error:
            raise RuntimeError(str(error)) from error


def _sample(name: str, seed: int, panel: Panel, limits: Limits) -> list[Record]:
    """Make an experiment on one map."""
    with _held(limits):
        return [dict(record) for record in catalogue.experiments()[name].sample(PanelMap(seed, panel))]


def _check(claim: str, evidence: Evidence, limits: Limits) -> tuple[Finding, float]:
    """Check a claim."""
    began = time.perf_counter()
    with _held(limits):
        finding = catalogue.claims()[claim].check(evidence)
    return finding, time.perf_counter() - began


def _make(label: str, evidence: Evidence, limits: Limits) -> Content:
    """Make one figure or table."""
    (artefact,) = (one for one in artefacts() if one.label == label)
    with _held(limits):
        return artefact.make(*[evidence] if artefact.experiments else [])
