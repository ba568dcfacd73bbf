"""Making figures and tables: each in a worker, as all that takes long."""

from collections.abc import Generator, Sequence
from contextlib import closing
from dataclasses import dataclass
from typing import Any

from cgla_graph.comparisons.claims.artefact import MODULES, Artefact, Comparison, Picture, artefacts
from cgla_graph.comparisons.claims.store import FIGURE, Drawn, Store
from cgla_graph.comparisons.workers.limits import Limits, Outcome, limited, lost
from cgla_graph.comparisons.workers.tasks import Results, Task, run_tasks

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


def make_artefacts(
    wanted: Sequence[Artefact], store: Store, *, workers: int = 1, scheduler: str | None = None
) -> Generator[Shown]:
    """
    Draw figures and fill tables.

    Parameters
    ----------
    wanted
        Which.
    store
        Where they go as they come, and what is drawn already.
    workers, scheduler
        As `run_tasks` takes them.

    Yields
    ------
    shown
        As soon as it is made, those of the store first; one that fails says why.
    """
    by_label = {artefact.label: artefact for artefact in wanted}
    for artefact in wanted:
        if (FIGURE, artefact.label) in store:
            yield Shown(artefact, *store[FIGURE, artefact.label])
    tasks = [Task((FIGURE, artefact.label), _make, (artefact.label,), _drawn) for artefact in wanted]
    modules = [f"cgla_graph.comparisons.claims.paper.{name}" for name in MODULES]
    how: dict[str, Any] = {"limits": LIMITS, "workers": workers, "scheduler": scheduler, "preload": modules}
    with closing(run_tasks(tasks, store, **how)) as results:
        for task, drawn in results:
            yield Shown(by_label[task.key[1]], *drawn)


def _drawn(outcome: Outcome, limits: Limits, _: Results) -> Drawn:
    return Drawn(outcome.value, "" if outcome.failure is None else lost(outcome, limits)[1])


def _make(label: str, limits: Limits) -> Picture | Comparison:
    """Make one artefact, in a worker."""
    (artefact,) = (one for one in artefacts() if one.label == label)
    with limited(limits.seconds, limits.megabytes):
        return artefact.make()
