"""The study of claims: experiments are made on maps, then claims are checked on what they measured."""

import time
from collections import deque
from collections.abc import Generator, Iterable, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass, field
from typing import Any

from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.claim import Claim, Finding, Verdict, finding_document, finding_from
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.store import Measured, Store
from cgla_graph.comparisons.study.execution import limits_where, made
from cgla_graph.comparisons.workers.limits import Limits, lost
from cgla_graph.comparisons.workers.pool import Call, Outcome, limited

#: What one map of an experiment, or one check, may take.
LIMITS = Limits(seconds=1800.0)


@dataclass(frozen=True)
class Result:
    """
    What came of a claim.

    Attributes
    ----------
    claim
        The claim.
    finding
        What its check found.
    seconds
        Time of the check, without the experiments.
    maps
        Maps of each of its experiments.
    lost
        How many maps of its experiments told nothing, and why (the first reason).
    """

    claim: Claim
    finding: Finding
    seconds: float
    maps: Mapping[str, int] = field(default_factory=dict)
    lost: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True)
class Step:
    """A step of a study that is done; `result` where it was a check."""

    what: str
    result: Result | None = None


def count_steps(claims: Sequence[Claim], store: Store) -> int:
    """Count the steps that are left to do."""
    agenda = _Agenda.of(claims, store, LIMITS)
    return len(agenda.samples) + sum(claim.id not in store.findings for claim in claims)


def check_claims(
    claims: Sequence[Claim],
    store: Store,
    *,
    workers: int = 1,
    scheduler: str | None = None,
) -> Generator[Step]:
    """
    Check claims: make what their experiments lack, on all cores, then run their checks.

    Parameters
    ----------
    claims
        Different ones.
    store
        Where all goes as it comes, and what is done already; it also says how much is asked for.
    workers, scheduler
        As `cgla_graph.comparisons.study.execution.made` takes them.

    Yields
    ------
    step
        Whatever is done, in no fixed order; those with a result are the claims, each once. A check that fails has
        the verdict "missing", with the reason; a map that tells nothing is counted.

    Raises
    ------
    OutputError
        If the store cannot be written.

    Examples
    --------
    >>> from cgla_graph.comparisons.claims.evidence import Scale
    >>> with Store(None, Scale(quick=True)) as store:
    ...     steps = list(check_claims(catalogue.chosen(["C16"]), store, workers=0))
    >>> [step.result.finding.verdict.label for step in steps]
    ['refuted']
    """
    limits = limits_where(LIMITS, workers=workers, scheduler=scheduler)
    agenda = _Agenda.of(claims, store, limits)
    yield from agenda.known()
    modules = [f"cgla_graph.comparisons.claims.paper.{name}" for name in (*catalogue.TOPICS, *catalogue.EXPERIMENTS)]
    with closing(made(agenda.next_call, limits, workers=workers, scheduler=scheduler, preload=modules)) as outcomes:
        for call, outcome in outcomes:
            yield agenda.take(call, outcome)


@dataclass(eq=False)
class _Agenda:
    """What is left to do: checks that need no samples come first, then samples, each check as soon as it can."""

    store: Store
    limits: Limits
    claims: Mapping[str, Claim]
    #: seeds of maps by experiment
    maps: Mapping[str, range]
    samples: deque[tuple[str, int]] = field(default_factory=deque)
    #: claims whose check has not begun
    waiting: list[Claim] = field(default_factory=list)

    @classmethod
    def of(cls, claims: Sequence[Claim], store: Store, limits: Limits) -> "_Agenda":
        known, scale = catalogue.experiments(), store.scale
        needed = dict.fromkeys(name for claim in claims for name in claim.experiments)
        maps = {name: scale.map_seeds(known[name].maps(scale.maps, quick=scale.quick)) for name in needed}
        agenda = cls(store, limits, {claim.id: claim for claim in claims}, maps)
        agenda.samples.extend(
            (name, seed) for name, seeds in maps.items() for seed in seeds if (name, seed) not in store.samples
        )
        agenda.waiting.extend(claim for claim in claims if claim.id not in store.findings)
        return agenda

    def known(self) -> Iterable[Step]:
        """Yield what an earlier session found."""
        for claim in self.claims.values():
            if claim.id in self.store.findings:
                yield Step(claim.id, self._result(claim, self.store.findings[claim.id]))

    def next_call(self) -> Call | None:
        for claim in self.waiting:
            if all((name, seed) in self.store.samples for name in claim.experiments for seed in self.maps[name]):
                self.waiting.remove(claim)
                samples = {name: self._samples(name) for name in claim.experiments}
                return Call(claim.id, _check, (claim.id, Evidence(self.store.scale, samples), self.limits))
        if self.samples:
            name, seed = self.samples.popleft()
            return Call((name, seed), _sample, (name, seed, self.limits))
        return None

    def _samples(self, name: str) -> Samples:
        measured = {seed: self.store.samples[name, seed] for seed in self.maps[name]}
        records: list[Record] = [{**record, "map": seed} for seed, one in measured.items() for record in one.records]
        return Samples(records, {seed: one.failed for seed, one in measured.items() if one.failed})

    def take(self, call: Call, outcome: Outcome) -> Step:
        """Keep what a call brought."""
        reason = "" if outcome.failure is None else ": ".join(filter(None, lost(outcome, self.limits)[1:]))
        if isinstance(call.key, tuple):
            name, seed = call.key
            self.store.add_sample(name, seed, Measured(outcome.value or [], reason))
            return Step(f"{name}: map {seed}")
        claim = self.claims[str(call.key)]
        document = outcome.value
        if reason:
            document = finding_document(Finding(Verdict.MISSING, reason)) | {"seconds": 0.0}
            result = self._result(claim, document)
        else:
            self.store.add_finding(claim.id, document)
            result = self._result(claim, self.store.findings[claim.id])
        return Step(claim.id, result)

    def _result(self, claim: Claim, document: Mapping[str, Any]) -> Result:
        failed = {name: self._samples(name).failed for name in claim.experiments}
        return Result(
            claim,
            finding_from(document),
            float(document["seconds"]),
            {name: len(self.maps[name]) for name in claim.experiments},
            {name: f"{len(of)}: {next(iter(of.values()))}" for name, of in failed.items() if of},
        )


def _sample(name: str, seed: int, limits: Limits) -> list[Record]:
    """Make an experiment on one map, in a worker."""
    with limited(limits.seconds, limits.megabytes):
        return [dict(record) for record in catalogue.experiments()[name].sample(seed)]


def _check(claim: str, evidence: Evidence, limits: Limits) -> dict[str, Any]:
    """Check a claim, in a worker."""
    began = time.perf_counter()
    with limited(limits.seconds, limits.megabytes):
        finding = catalogue.claims()[claim].check(evidence)
    return finding_document(finding) | {"seconds": time.perf_counter() - began}
