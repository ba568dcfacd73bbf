"""Making figures and tables: each in a worker, as all that takes long."""

from collections import deque
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass

from cgla_graph.comparisons.claims.artefact import MODULES, Artefact, Comparison, Picture, artefacts
from cgla_graph.comparisons.study.execution import limits_where, made
from cgla_graph.comparisons.workers.limits import Limits, lost
from cgla_graph.comparisons.workers.pool import Call, limited

#: What one artefact may take.
LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class Shown:
    """
    What came of an artefact.

    Attributes
    ----------
    artefact
        The figure or table.
    content
        What was made; None where that failed.
    failed
        Why.
    """

    artefact: Artefact
    content: Picture | Comparison | None
    failed: str = ""


def make_artefacts(wanted: Sequence[Artefact], *, workers: int = 1, scheduler: str | None = None) -> Generator[Shown]:
    """
    Draw figures and fill tables.

    Parameters
    ----------
    wanted
        Which.
    workers, scheduler
        As `cgla_graph.comparisons.study.execution.made` takes them.

    Yields
    ------
    shown
        As soon as it is made; one that fails says why.
    """
    limits = limits_where(LIMITS, workers=workers, scheduler=scheduler)
    calls = deque(Call(artefact.label, _make, (artefact.label, limits)) for artefact in wanted)
    by_label = {artefact.label: artefact for artefact in wanted}
    modules = [f"cgla_graph.comparisons.claims.paper.{name}" for name in MODULES]

    def next_call() -> Call | None:
        return calls.popleft() if calls else None

    if not calls:
        return
    with closing(made(next_call, limits, workers=workers, scheduler=scheduler, preload=modules)) as outcomes:
        for call, outcome in outcomes:
            reason = "" if outcome.failure is None else lost(outcome, limits)[1]
            yield Shown(by_label[str(call.key)], outcome.value, reason)


def _make(label: str, limits: Limits) -> Picture | Comparison:
    """Make one artefact, in a worker."""
    (artefact,) = (one for one in artefacts() if one.label == label)
    with limited(limits.seconds, limits.megabytes):
        return artefact.make()
