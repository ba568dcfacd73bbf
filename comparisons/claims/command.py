"""The command `claims`: which ones are asked for, how they are checked, and what is written."""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path

from cgla_graph._threads import n_cores
from cgla_graph.comparisons import console
from cgla_graph.comparisons.claims import catalogue
from cgla_graph.comparisons.claims.artefact import Artefact, artefacts
from cgla_graph.comparisons.claims.checking import Result, Shown, check_claims, count_steps
from cgla_graph.comparisons.claims.claim import Answer, Claim
from cgla_graph.comparisons.claims.evidence import Scale
from cgla_graph.comparisons.claims.report import write_report
from cgla_graph.comparisons.claims.store import Store
from cgla_graph.errors import WorkerError


@dataclass(frozen=True)
class Request:
    """
    What is to be checked, and how.

    Attributes
    ----------
    claims, scale
        The claims, and how much is asked for.
    folder, resume, overwrite
        Where everything goes, or None; whether to go on with the study that is there, or to replace it; one that is
        there is refused otherwise.
    workers, scheduler
        Processes that measure and check, 0 for this one; the scheduler of a Dask cluster, or None.
    remarks
        What is said beside the claims in the report, on a user's own settings.
    """

    claims: Sequence[Claim] = field(default_factory=lambda: catalogue.chosen([]))
    scale: Scale = field(default_factory=Scale)
    folder: Path | None = None
    resume: bool = False
    overwrite: bool = False
    workers: int = field(default_factory=n_cores)
    scheduler: str | None = None
    remarks: Sequence[str] = ()

    @property
    def artefacts(self) -> list[Artefact]:
        """The figures and tables to be drawn: with a folder, those that the claims name; of all claims, all."""
        # figures show the paper's settings
        if self.folder is None or self.scale.panel.own:
            return []
        if len(self.claims) == len(catalogue.claims()):
            return list(artefacts())
        named = {label for claim in self.claims for label in claim.figures}
        return [artefact for artefact in artefacts() if artefact.label in named]


@dataclass(eq=False)
class Checked:
    """
    What is done.

    Attributes
    ----------
    results, shown, written
        Of the claims, in the order of their numbers; of figures and tables; the files.
    interrupted
        Whether Ctrl-C ended it.
    failure
        Why a part could not be made, which says nothing of the claims; None if all was made.
    """

    results: list[Result] = field(default_factory=list)
    shown: list[Shown] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    interrupted: bool = False
    failure: WorkerError | None = None

    @property
    def is_whole(self) -> bool:
        """Whether every check came to an end, and every figure and table was made."""
        missing = any(Answer.MISSING in result.finding.answers for result in self.results)
        return not (self.interrupted or self.failure or missing or any(one.failed for one in self.shown))

    @property
    def all_hold(self) -> bool:
        """Whether all statements hold."""
        return all({*result.finding.answers} <= {Answer.HOLDS} for result in self.results)


def check_all(request: Request) -> Checked:
    """
    Check claims, showing progress; with a folder, keep everything as it comes and write the report.

    Raises
    ------
    OutputError
        If a file cannot be written, or the folder holds a study and the request does not say what to do with it.
    """
    done = Checked()
    workers, scheduler = request.workers, request.scheduler
    with Store(request.folder, request.scale, resume=request.resume, overwrite=request.overwrite) as store:
        try:
            total = count_steps(request.claims, store, request.artefacts)
            steps = check_claims(request.claims, store, request.artefacts, workers=workers, scheduler=scheduler)
            with console.running_solvers(), console.progress(total) as tick, closing(steps):
                for step in steps:
                    if isinstance(step.result, Result):
                        done.results.append(step.result)
                    elif step.result:
                        done.shown.append(step.result)
                    tick(step.what)
        except KeyboardInterrupt:
            done.interrupted = True
        except WorkerError as error:
            done.failure = error
        done.results.sort(key=lambda result: result.claim.number)
        done.shown.sort(key=lambda shown: request.artefacts.index(shown.artefact))
        if request.folder is not None:
            done.written = write_report(request.folder, done.results, done.shown, request.scale, request.remarks)
    return done
