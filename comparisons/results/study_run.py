"""Studies from the command line: reading, running, storing and printing."""

import os
from collections.abc import Mapping, Sequence
from contextlib import closing, nullcontext
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from cgla_graph._text import listed
from cgla_graph._threads import n_cores
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.leaderboard.leaderboard import leaderboard_of
from cgla_graph.comparisons.leaderboard.performance import performances
from cgla_graph.comparisons.missions import compare as mission_compare
from cgla_graph.comparisons.results import study_output
from cgla_graph.comparisons.results.lookup import print_leaderboard
from cgla_graph.comparisons.study import execution, options
from cgla_graph.comparisons.study.flight_run import ComparedMission, FlightRun
from cgla_graph.comparisons.study.metric import read_metrics
from cgla_graph.comparisons.study.proofs import ProofLine, proofs_of_runs, targets_of
from cgla_graph.comparisons.study.rows import by_scenario, certificate_document, rows_of
from cgla_graph.comparisons.study.runner import Run, with_refuted_claims
from cgla_graph.comparisons.study.store import FILE, PROOF, Stored, StudyStore, load, load_study
from cgla_graph.comparisons.study.study import Study
from cgla_graph.comparisons.study.study_file import is_study_file, read_study
from cgla_graph.comparisons.tables.flights import print_flights
from cgla_graph.comparisons.workers.tasks import run_tasks
from cgla_graph.errors import CglaError, WorkerError
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario
from cgla_graph.scenarios.mission_file import MissionFile, is_mission_file, load_mission
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import own

#: Of a study without a file, this many scenarios get pictures of their own, unless told otherwise.
PICTURES = 20
#: More pairs of nodes than these have no tables of their own.
MOST_PAIR_TABLES = 5


@dataclass(frozen=True, eq=False)
class Request:
    """
    A study to run.

    Attributes
    ----------
    study
        Solvers on maps, and on missions.
    pictures
        Number of scenarios with pictures of their own; the report has a map of each.
    highlighted
        Labels of solvers that stand out in pictures in any case.
    is_file
        Whether it is a study from a file.
    """

    study: Study
    pictures: int = PICTURES
    highlighted: frozenset[str] = frozenset()
    is_file: bool = False


@dataclass(frozen=True)
class RunOptions:
    """
    Options of execution and storage.

    Attributes
    ----------
    folder
        Folder of the results, or None.
    resume, overwrite
        Whether to go on with the study that is there, or to replace it; a study that is there is refused otherwise.
    workers
        Processes that make runs; 0 for this one.
    scheduler
        Of a Dask cluster, or None.
    command
        The command line.
    proofs
        Folder of proof files to write, one a map; None for none.
    """

    folder: Path | None = None
    resume: bool = False
    overwrite: bool = False
    workers: int = field(default_factory=n_cores)
    scheduler: str | None = None
    command: str = ""
    proofs: Path | None = None


@dataclass(eq=False)
class Compared:
    """
    The results so far.

    Attributes
    ----------
    runs
        Runs on maps, in the order of the study; those of earlier sessions too.
    missions, flights
        Missions, and their flights; those of earlier sessions too.
    written
        Files.
    interrupted
        Whether Ctrl-C ended it.
    left
        Number of runs and flights that the study in the folder still lacks.
    failure
        Why runs could not be made, which says nothing of their solvers; None if all were made.
    proofs
        What the proof files prove, if any were to be written.
    """

    runs: list[Run] = field(default_factory=list)
    missions: list[ComparedMission] = field(default_factory=list)
    flights: list[FlightRun] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    interrupted: bool = False
    left: int = 0
    failure: WorkerError | None = None
    proofs: list[ProofLine] = field(default_factory=list)

    @property
    def all_found(self) -> bool:
        """Whether every run found a path, and every UAV arrived."""
        return all(run.solution.status.has_path for run in self.runs) and all(
            flight.all_arrived for flight in self.flights
        )


@dataclass(frozen=True, kw_only=True)
class Settings:
    """
    The options of the command line; None where an option was left out.

    Attributes
    ----------
    specs
        Scenarios, missions, or one study file; none for the study that is resumed, else for the paper's map.
    solvers, seeds, budget, limits, refine, tolerance, certify, pictures, highlight
        The options of the same names; `certify` is the reverse of ``--no-certificate``.
    maps
        Changes to the maps.
    metrics
        Files of metrics, or functions in files.
    graphs
        Pairs of nodes, where `specs` are files of graphs; None for maps and missions.
    """

    specs: Sequence[str] = ()
    solvers: str | None = None
    seeds: int | None = None
    budget: str | None = None
    limits: str | None = None
    maps: options.MapOptions = field(default_factory=options.MapOptions)
    refine: bool = False
    tolerance: float | None = None
    certify: bool = True
    pictures: int | None = None
    highlight: str | None = None
    metrics: Sequence[str] = ()
    graphs: options.PairOptions | None = None

    @property
    def given(self) -> list[str]:
        """The options that say what a study file says itself."""
        names = ("solvers", "seeds", "budget", "limits", "tolerance")
        named = [f"--{name}" for name in names if getattr(self, name) is not None]
        named += ["--refine"] if self.refine else []
        named += ["--metrics"] if self.metrics else []
        named += [] if self.graphs in {None, options.PairOptions()} else ["a choice of nodes"]
        return [*named, *self.maps.given, *([] if self.certify else ["--no-certificate"])]


def read_request(asked: Settings, how: RunOptions | None = None) -> Request:
    """
    Make a study of settings, or read the one of a file.

    Raises
    ------
    CglaError
        If the settings or a file are invalid.
    """
    how = how or RunOptions()
    if how.folder is None and (how.resume or how.overwrite):
        msg = f"{'--resume' if how.resume else '--overwrite'} needs the folder of the study: --out DIR"
        raise CglaError(msg)
    if how.resume and how.overwrite:
        msg = "--resume goes on with a study, --overwrite starts anew; give one of them"
        raise CglaError(msg)
    study_files = [spec for spec in asked.specs if spec.lower().endswith(".toml") and is_study_file(spec)]
    if study_files:
        study = read_study(Path(_alone(study_files[0], asked)))
    elif how.resume and how.folder is not None and not asked.specs:
        _alone(how.folder / FILE, asked)
        study = load_study(how.folder)
        forgotten = [one.label for one in study.entrants if own.is_forgotten(one.name)]
        forgotten += [f"metric {one.name}" for one in study.metrics]
        if forgotten:
            remedy = "give its maps, --solvers and --metrics again"
            msg = f"{listed(forgotten)}: a study does not keep code of your own; {remedy}"
            raise CglaError(msg)
    else:
        study = _study(asked, how.command)
        pictures = PICTURES if asked.pictures is None else asked.pictures
        return Request(study, pictures, options.read_highlighted(asked.highlight, study.entrants))
    highlighted = options.read_highlighted(asked.highlight, study.entrants)
    return Request(study, asked.pictures or 0, highlighted, is_file=True)


def _study(asked: Settings, command: str) -> Study:
    """Make a study of settings."""
    bound = options.read_tolerance(asked.tolerance, certify=asked.certify)
    named, missions, scenarios = list(asked.specs), list[MissionFile](), list[AnyScenario]()
    if asked.graphs is not None:
        scenarios += asked.graphs.open(asked.specs)
    else:
        for_maps = [*asked.maps.given, *(["--refine"] if asked.refine else [])]
        named, missions = split_specs(asked.specs or ["paper"], for_maps)
        scenarios += options.open_all(named, asked.maps)
    entrants = options.read_entrants(asked.solvers, budget=asked.budget, refine=asked.refine, scenarios=scenarios)
    flown = mission_compare.mission_entrants(entrants, chosen=asked.solvers is not None) if missions else ()
    return Study(
        scenarios=options.number_names(scenarios),
        entrants=entrants,
        seeds=range(1, (3 if asked.seeds is None else asked.seeds) + 1),
        tolerance=bound,
        limits=options.read_limits(asked.limits),
        title=" ".join([*named, *(mission.name for mission in missions)]),
        source=command,
        missions=missions,
        mission_entrants=flown,
        metrics=read_metrics(asked.metrics),
    )


def _alone(study: str | Path, asked: Settings) -> str | Path:
    """Return the file of a study, beside which nothing may be given that it says itself."""
    others = [spec for spec in asked.specs if spec != str(study)]
    if others:
        msg = f"{study} is a study, which is compared alone; name {others[0]} among its scenarios"
        raise CglaError(msg)
    if asked.given:
        msg = f"{asked.given[0]} beside a study: {study} says that itself; change it there"
        raise CglaError(msg)
    return study


def split_specs(specs: Sequence[str], for_maps: Sequence[str] = ()) -> tuple[list[str], list[MissionFile]]:
    """
    Part missions from maps.

    Parameters
    ----------
    specs
        The user's arguments.
    for_maps
        The options that the user set and missions do not have.

    Returns
    -------
    maps, missions
        The names of maps, and the missions, opened; those of the same name get numbers, so that their rows can be told
        apart.

    Raises
    ------
    CglaError
        If a mission cannot be opened, or is to be flown with an option that it does not have.

    Examples
    --------
    >>> maps, missions = split_specs(["paper", "fig8"])
    >>> maps, [mission.name for mission in missions]
    (['paper'], ['fig8'])
    """
    missions = [load_mission(spec) for spec in specs if is_mission_file(spec)]
    if missions and for_maps:
        remedy = "name refine:base=NAME as a solver" if for_maps[0] == "--refine" else "compare maps and missions apart"
        msg = f"{for_maps[0]} is for maps, and {missions[0].name} is a mission; {remedy}"
        raise CglaError(msg)
    return [spec for spec in specs if not is_mission_file(spec)], options.number_names(missions)


def compare_all(request: Request, how: RunOptions) -> Compared:
    """
    Make all runs and flights that are not done yet; after Ctrl-C, those that are done are kept and shown.

    Raises
    ------
    OutputError
        If something cannot be written, or another process writes the same study.
    CglaError
        If the study that is there is another one, or nothing could be made, as without a cluster that can be reached.
    """
    done, study = Compared(), request.study
    targets = {} if how.proofs is None else targets_of(study, how.proofs)
    cells, flights = list(study.cells()), list(study.flights())
    workers = min(how.workers, len(cells) + len(flights))
    with _store(study, how, workers) or nullcontext() as store:
        tasks = [*execution.study_tasks(study, store), *(mission_compare.flight_tasks(study) if flights else ())]
        total = sum(bool(task.key[0] != PROOF and (store is None or task.key not in store)) for task in tasks)
        made = run_tasks(
            tasks,
            store,
            limits=study.limits,
            workers=workers,
            scheduler=how.scheduler,
            preload=(*execution.PRELOAD, *(mission_compare.PRELOAD if flights else ())),
            solvers=execution.solvers_of(study),
        )
        try:
            proven = [] if study.tolerance is None else [one.problem.model for one in maps_of(study)]
            with console.running_solvers(proven), console.progress(total) as tick, closing(made):
                for task, result in made:
                    if isinstance(result, Run):
                        done.runs.append(result)
                    elif isinstance(result, FlightRun):
                        done.flights.append(result)
                    if task.key[0] != PROOF:
                        tick(": ".join((task.key[1], task.key[-2])))
        except KeyboardInterrupt:
            done.interrupted = True
        except WorkerError as error:
            # (finished runs are shown first)
            done.failure = error
    if done.failure is not None and not (done.runs or done.flights):
        raise done.failure
    if how.folder is not None:
        stored = load(how.folder)
        done.runs, done.missions, done.flights = stored.runs, stored.missions, stored.flights
        done.left = stored.n_cells + stored.n_flights - len(stored.runs) - len(stored.flights)
        done.proofs = _proofs(stored.runs, targets, study, how.folder, done)
        done.written += [how.folder / FILE, *study_output.write_study(stored)]
        if not done.interrupted:
            done.written += study_output.write_all_pictures(
                how.folder, done.runs, request.pictures, request.highlighted
            )
    else:
        done.missions = [ComparedMission.of(mission) for mission in study.missions]
        order = {cell: number for number, cell in enumerate([*cells, *flights])}
        done.runs = with_refuted_claims(
            sorted(done.runs, key=lambda run: order[run.scenario.name, run.solver, run.seed])
        )
        done.flights.sort(key=lambda one: order[one.mission, one.variant, one.solver, one.seed])
        done.proofs = _proofs(done.runs, targets, study, None, done)
    return done


def _proofs(
    runs: Sequence[Run], targets: Mapping[str, Path], study: Study, home: Path | None, done: Compared
) -> list[ProofLine]:
    """Write the proof files of a comparison; none if it was interrupted."""
    if not targets or study.tolerance is None or done.interrupted:
        return []
    return proofs_of_runs(by_scenario(runs), targets, study.tolerance, home)


def write_study(
    study: Study,
    folder: str | os.PathLike[str],
    *,
    resume: bool = False,
    overwrite: bool = False,
    workers: int | None = None,
    scheduler: str | None = None,
    pictures: int = PICTURES,
    proofs: str | os.PathLike[str] | None = None,
) -> Stored:
    """
    Make the runs of a study, and write the files of ``cgla compare --out``: runs, report, rows, tables and pictures.

    Parameters
    ----------
    study
        The study.
    folder
        Folder of the results; it is made if it is not there.
    resume, overwrite
        Whether to go on with the study that is there, or to replace it; one that is there is refused otherwise.
    workers
        Processes that make runs; None for one a core, 0 for this one.
    scheduler
        Address of a Dask scheduler whose cluster makes the runs instead.
    pictures
        Scenarios with pictures of their own, at most.
    proofs
        Folder of proof files to write, one a map, which the report links; None for none.

    Returns
    -------
    stored
        The study with its runs, as `cgla_graph.comparisons.load` returns it.

    Raises
    ------
    OutputError
        If something cannot be written, or another process writes the same study.
    StudyError
        If the study that is there is another one.
    WorkerError
        If runs could not be made; those that are done are kept.
    KeyboardInterrupt
        After Ctrl-C; the runs that are done are kept and written.

    Examples
    --------
    >>> import tempfile
    >>> with tempfile.TemporaryDirectory() as home:
    ...     stored = write_study(Study(["one-threat"], ["cgla"], tolerance=None), home, workers=0, pictures=0)
    ...     [run.solver for run in stored.runs], (stored.folder / "report.html").exists()
    (['cgla'], True)
    """
    home = files.make_folder(Path(folder))
    options_of_run: dict[str, Any] = {} if workers is None else {"workers": workers}
    options_of_run |= {"proofs": None if proofs is None else Path(proofs)}
    how = RunOptions(home, resume=resume, overwrite=overwrite, scheduler=scheduler, **options_of_run)
    done = compare_all(Request(study, pictures), how)
    if done.failure is not None:
        raise done.failure
    if done.interrupted:
        raise KeyboardInterrupt
    return load(home)


def maps_of(study: Study) -> list[Scenario]:
    """List the scenarios of a study that are maps."""
    return [one for one in study.scenarios if isinstance(one, Scenario)]


def _store(study: Study, how: RunOptions, workers: int) -> StudyStore | None:
    if how.folder is None:
        return None
    where: int | str = how.scheduler or workers
    if how.resume:
        return StudyStore.resume(how.folder, study, workers=where, command=how.command)
    return StudyStore.create(how.folder, study, overwrite=how.overwrite, workers=where, command=how.command)


def comparison_document(done: Compared) -> dict[str, Any]:
    """Return all results as one JSON document."""
    groups = by_scenario(done.runs)
    return {
        "rows": rows_of(done.runs),
        "summary": [one.document() for group in groups for one in performances(group)],
        "certificates": [certificate_document(group[0]) for group in groups],
        "flights": [flight.row() for flight in done.flights],
        "files": [str(path) for path in done.written],
        "interrupted": done.interrupted,
    }


def print_compared(request: Request, done: Compared) -> None:
    """Print the tables of each scenario, unless a file names them; what they amount to; and those of missions."""
    single = len(request.study.scenarios) == 1
    if not request.is_file or single:
        study_output.print_comparison(_in_tables(request.study, done.runs), request.study.entrants)
    if done.runs and not single:
        print_leaderboard(done.runs, leaderboard_of(done.runs))
    if done.missions:
        print_flights(done.missions, done.flights)


def _in_tables(study: Study, runs: Sequence[Run]) -> list[Run]:
    """Leave out the runs on pairs of nodes, if these are more than a few: the leaderboard sums them up."""
    many = sum(isinstance(one, GraphScenario) for one in study.scenarios) > MOST_PAIR_TABLES
    return [run for run in runs if not (many and isinstance(run.scenario, GraphScenario))]


def kept_note(request: Request, how: RunOptions, done: Compared) -> str:
    """Say what an interrupted comparison has done, and how to go on."""
    n_done = len(done.runs) + len(done.flights)
    kept = ""
    if how.folder is not None:
        kept = f" and kept in {how.folder}"
        if done.left:
            kept += f" ({_remedy(how, request.study)} goes on)"
    total = max(sum(1 for _ in (*request.study.cells(), *request.study.flights())), n_done + done.left)
    return f"{n_done} of {total} run{'s' * (total != 1)} {'is' if n_done == 1 else 'are'} done{kept}"


def left_note(how: RunOptions, done: Compared) -> str:
    """Say how to make the runs that the study in the folder has besides; empty where there are none."""
    runs = "run is" if done.left == 1 else "runs are"
    return f"{done.left} {runs} left of the study in {how.folder}: {_remedy(how, None)} goes on" if done.left else ""


def _remedy(how: RunOptions, study: Study | None) -> str:
    """Name the command that goes on: one that gives code of the user's own again, which no study keeps."""
    has_own = study is not None and (study.metrics or any(one.own is not None for one in study.entrants))
    return "the same command with --resume" if has_own else f"cgla compare --resume --out {how.folder}"
