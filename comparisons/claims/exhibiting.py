"""Making figures and tables: each in a worker, as all that takes long."""

from collections import deque
from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass

from cgla_graph.comparisons.claims.exhibit import MODULES, Comparison, Exhibit, Picture, exhibits
from cgla_graph.comparisons.study.execution import limits_where, made
from cgla_graph.comparisons.workers.limits import Limits, lost
from cgla_graph.comparisons.workers.pool import Call, limited

#: What one exhibit may take.
LIMITS = Limits()


@dataclass(frozen=True, eq=False)
class Shown:
    """
    What came of an exhibit.

    Attributes
    ----------
    exhibit
        The figure or table.
    content
        What was made; None where that failed.
    failed
        Why.
    """

    exhibit: Exhibit
    content: Picture | Comparison | None
    failed: str = ""


def make_exhibits(wanted: Sequence[Exhibit], *, workers: int = 1, scheduler: str | None = None) -> Generator[Shown]:
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
    calls = deque(Call(exhibit.label, _make, (exhibit.label, limits)) for exhibit in wanted)
    by_label = {exhibit.label: exhibit for exhibit in wanted}
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
    """Make one exhibit, in a worker."""
    (exhibit,) = (one for one in exhibits() if one.label == label)
    with limited(limits.seconds, limits.megabytes):
        return exhibit.make()
