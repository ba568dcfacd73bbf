"""The store of a study: its request and its results, run by run and flight by flight, in one file."""

import dataclasses
import gc
import hashlib
import os
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any, Self

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.store import Line, Log, Reader, understood
from cgla_graph.comparisons.study.documents import (
    Document,
    certificate_document,
    certificate_from,
    decode,
    dumps,
    encode,
    entrant_document,
    entrant_from,
    metric_document,
    metric_from,
    run_document,
    run_from,
    scenario_document,
    scenario_from,
)
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.flight_run import ComparedMission, FlightRun, flight_from, mission_digest
from cgla_graph.comparisons.study.provenance import Session, session
from cgla_graph.comparisons.study.runner import Run, seeds_of, with_refuted_claims
from cgla_graph.comparisons.study.study import Cell, FlightCell, Study, flight_cells
from cgla_graph.comparisons.workers.tasks import Key
from cgla_graph.errors import CglaError, OutputError, StudyError
from cgla_graph.isolation.limits import Limits
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario
from cgla_graph.scenarios.mission_file import load_mission

#: The file's name in the folder of a study, and what its first line says.
FILE, WHAT = "study.jsonl", "study"
#: Name of OMPL's database of the runs beside it, the only file of earlier versions.
OMPL_FILE = "study.db"
#: The kinds of lines, and of tasks.
SESSION, PROOF, RUN, FLIGHT = "session", "proof", "run", "flight"


@dataclass(frozen=True, eq=False)
class Stored:
    """
    A snapshot of a study's folder.

    Attributes
    ----------
    folder
        The folder.
    title
        Its title in the report.
    runs
        Finished runs in the order of the study's cells: by scenario, solver and seed. Runs of one scenario share it.
    scenarios
        All scenarios of the study, also those without runs.
    solvers
        Labels of all entrants.
    n_cells
        Number of runs when complete.
    sessions
        Its start and resumptions.
    limits
        Limits of each run.
    seeds
        Of solvers that draw random numbers.
    entrants
        By label.
    session_of
        Number of the session that made a run, by number of the run.
    missions, flights, n_flights
        Its missions, the finished flights, and their number when complete.
    """

    folder: Path
    title: str
    runs: list[Run]
    scenarios: list[AnyScenario]
    solvers: list[str]
    n_cells: int
    sessions: list[Session]
    limits: Limits
    seeds: tuple[int, ...] = ()
    entrants: Mapping[str, Entrant] = field(default_factory=dict)
    session_of: Mapping[int, int] = field(default_factory=dict)
    missions: list[ComparedMission] = field(default_factory=list)
    flights: list[FlightRun] = field(default_factory=list)
    n_flights: int = 0

    @property
    def is_complete(self) -> bool:
        """Whether no run and no flight is left to be made."""
        return len(self.runs) >= self.n_cells and len(self.flights) >= self.n_flights


def load(folder: Path) -> Stored:
    """
    Read the folder of a study, also while another process writes it. Nothing in the folder is changed.

    Raises
    ------
    StudyError
        If there is no study, or it cannot be read, is damaged, or comes from another program or version.

    Examples
    --------
    >>> try:
    ...     load(Path("no-such-folder"))
    ... except StudyError as error:
    ...     print(str(error).split(";")[0])
    no-such-folder/study.jsonl: there is no such file
    """
    folder = Path(folder)
    with _no_collection(), understood(folder / FILE):
        content = _content(folder)
        study = content.study()
        runs = content.runs_of(study)
        return Stored(
            folder=folder,
            title=study.title,
            runs=runs,
            scenarios=list(study.scenarios),
            solvers=[entrant.label for entrant in study.entrants],
            n_cells=content.n_runs_asked,
            sessions=[_session(line) for line in content.sessions],
            limits=study.limits,
            seeds=tuple(study.seeds),
            entrants={entrant.label: entrant for entrant in study.entrants},
            session_of={made.number: made.session for made in content.runs.values()},
            missions=content.missions(),
            flights=content.all_flights(),
            n_flights=content.n_asked - content.n_runs_asked,
        )


def load_study(folder: Path) -> Study:
    """
    Return the study of a folder with the additions of later sessions.

    Raises
    ------
    StudyError
        As `load`; or if the file of a mission has changed.
    CglaError
        If the file of a mission cannot be loaded.
    """
    with understood(folder / FILE):
        content, missions = _content(folder), []
        for known in content.missions():
            mission = dataclasses.replace(load_mission(known.where), name=known.name)
            _check_same("mission", known.name, [] if mission_digest(mission) == known.digest else [known.where])
            missions.append(mission)
        return dataclasses.replace(content.study(), missions=missions)


def _content(folder: Path) -> "Content":
    content = Content()
    _check_not_old(folder, StudyError)
    content.take(Reader(folder / FILE, WHAT).new_lines())
    return content


def _check_not_old(folder: Path, kind: type[CglaError]) -> None:
    """Refuse a folder of an earlier version."""
    if os.path.exists(folder / OMPL_FILE) and not (folder / FILE).exists():  # noqa: PTH110 - no name is too long for it
        msg = (
            f"{folder}: holds a study of an earlier cgla-graph ({OMPL_FILE} without {FILE}); "
            f"read it with that one, or run the study anew in another folder"
        )
        raise kind(msg)


@dataclass(frozen=True)
class Made:
    """A line of a run, with its number and that of the session that made it."""

    number: int
    session: int
    document: Document


@dataclass(eq=False)
class Content:
    """
    The lines of a study's file, sorted.

    Attributes
    ----------
    whole
        Whether runs are held whole; else only their status.
    sessions, cells
        The session lines, of which the last describes the whole study, and its runs.
    proofs, runs, flights
        By scenario, cell and flight.
    n_runs
        Number of lines of runs.
    """

    whole: bool = True
    sessions: list[Document] = field(default_factory=list)
    cells: set[Cell] = field(default_factory=set)
    proofs: dict[str, Document] = field(default_factory=dict)
    runs: dict[Cell, Made] = field(default_factory=dict)
    flights: dict[FlightCell, Document] = field(default_factory=dict)
    n_runs: int = 0

    def take(self, lines: Iterable[Line]) -> None:
        """Sort lines in; a malformed one raises any error."""
        for line in lines:
            match line["kind"]:
                case "session":
                    self.sessions.append(line)
                    self.cells = set(_cells(line))
                    # the package that a solver lacked may have been installed since
                    self.runs = {key: one for key, one in self.runs.items() if not _is_unavailable(one.document)}
                    self.flights = {key: one for key, one in self.flights.items() if not _is_unavailable(one)}
                case "proof":
                    self.proofs[line["key"]] = line
                case "run":
                    self.n_runs += 1
                    kept = line if self.whole else {"status": line["status"]}
                    self.runs[Cell(*line["key"])] = Made(self.n_runs, len(self.sessions), kept)
                case "flight":
                    self.flights[FlightCell(*line["key"])] = line

    @property
    def asked(self) -> Document:
        """The last session line."""
        return self.sessions[-1]

    def flight_cells(self) -> set[FlightCell]:
        """Return the flights to be made."""
        return {FlightCell(*key) for key in self.asked["flights"]}

    @property
    def n_runs_asked(self) -> int:
        """Number of runs when complete: those of the last session, and those done before."""
        return len(self.cells | self.runs.keys())

    @property
    def n_asked(self) -> int:
        """Number of runs and flights when complete."""
        return self.n_runs_asked + len(self.flight_cells() | self.flights.keys())

    def missions(self) -> list[ComparedMission]:
        """Build the stored missions."""
        return [ComparedMission.from_document(document) for document in self.asked["missions"]]

    def study(self) -> Study:
        """Build the study, without its missions."""
        asked = self.asked
        entrants = [entrant_from(document) for document in asked["entrants"]]
        flying = set(asked["mission_entrants"])
        return Study(
            scenarios=[
                _scenario(document, asked["areas"], asked.get("rasters", {}), asked.get("graphs", {}))
                for document in asked["scenarios"]
            ],
            entrants=entrants,
            seeds=tuple(asked["seeds"]),
            tolerance=decode(asked["tolerance"]),
            limits=Limits(decode(asked["seconds"]), decode(asked["megabytes"])),
            title=str(asked["title"]),
            source=str(asked["source"]),
            mission_entrants=[entrant for entrant in entrants if entrant.label in flying],
            metrics=[metric_from(document) for document in asked.get("metrics", ())],
        )

    def certificates(self) -> dict[str, Certificate]:
        """Build the certificates of scenarios."""
        return {name: certificate_from(document) for name, document in self.proofs.items()}

    def runs_of(self, study: Study) -> list[Run]:
        """Build the runs that are done, in the order of the study; claims that another run refutes fail."""
        scenarios = {scenario.name: scenario for scenario in study.scenarios}
        entrants = {entrant.label: entrant for entrant in study.entrants}
        proofs = self.certificates()
        scenario_place = {name: place for place, name in enumerate(scenarios)}
        entrant_place = {entrant.label: place for place, entrant in enumerate(study.entrants)}
        seed_place = {seed: place for place, seed in enumerate((None, *study.seeds))}

        def place(item: tuple[Cell, Made]) -> tuple[int, int, int, int]:
            (name, label, seed), made = item
            return scenario_place[name], entrant_place[label], seed_place.get(seed, len(seed_place)), made.number

        return with_refuted_claims(
            run_from(made.document, scenarios[name], entrants[label], seed, proofs.get(name), made.number)
            for (name, label, seed), made in sorted(self.runs.items(), key=place)
        )

    def all_flights(self) -> list[FlightRun]:
        """Build the flights that are done, in the order of the study."""
        planned = [FlightCell(*key) for key in self.asked["flights"]]
        order = dict.fromkeys([*(key for key in planned if key in self.flights), *self.flights])
        return [flight_from(key, self.flights[key]) for key in order]


def _cells(session: Document) -> Iterator[Cell]:
    """Yield the runs that a session asks for."""
    names = [scenario["name"] for scenario in session["scenarios"]]
    labels = [entrant["label"] for entrant in session["entrants"]]
    for name, of_scenario in zip(names, session["cells"], strict=True):
        for label, seeds in zip(labels, of_scenario, strict=True):
            yield from (Cell(name, label, seed) for seed in seeds)


def _is_unavailable(document: Document) -> bool:
    return str(document["status"]).lower() == Status.UNAVAILABLE.label


def _session(line: Line) -> Session:
    return Session(**{one.name: line[one.name] for one in dataclasses.fields(Session)})


@contextmanager
def _no_collection() -> Iterator[None]:
    """Switch the garbage collector off while many objects are built: it would take most of the time."""
    was_on = gc.isenabled()
    gc.disable()
    try:
        yield
    finally:
        if was_on:
            gc.enable()


# Writing


class StudyStore:
    """
    The one writer of a study's file (``study.jsonl``); a context manager.

    While it is open, it holds ``study.jsonl.lock``, so that no second process writes; readers (`load`) may read.
    Once `add` returns, its result is on disk, even if the process is killed.

    Attributes
    ----------
    path
        The file.
    study
        The study with all requests in this folder, this session's first.

    Examples
    --------
    >>> import tempfile
    >>> from cgla_graph.comparisons.study.execution import run_study
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> study = Study([load_scenario("one-threat")], [Entrant.parse("cgla"), Entrant.parse("dijkstra")], tolerance=None)
    >>> with tempfile.TemporaryDirectory() as folder:
    ...     with StudyStore.create(Path(folder), study) as store:
    ...         first = next(run_study(study, store=store, workers=0))
    ...     stored = load(Path(folder))
    >>> [(run.number, run.solver, run.solution.status.label) for run in stored.runs], stored.is_complete
    ([(1, 'cgla', 'optimal')], False)
    """

    def __init__(self, log: Log, study: Study, content: Content) -> None:
        """Take over an open file and what it holds; `create` and `resume` do that."""
        self.path = log.path
        self.study = study
        self._log = log
        self._open: set[Key] = {(RUN, *cell) for cell in content.cells}
        self._open |= {(FLIGHT, *cell) for cell in content.flight_cells()}
        self._open |= {(PROOF, scenario.name) for scenario in study.scenarios}
        self._done: set[Key] = {(RUN, *cell) for cell in content.runs}
        self._done |= {(FLIGHT, *cell) for cell in content.flights}
        self._done |= {(PROOF, name) for name in content.proofs}
        self._certificates = content.certificates()
        self._n_runs = content.n_runs

    @classmethod
    def create(
        cls, folder: Path, study: Study, *, overwrite: bool = False, workers: int | str = 1, command: str = ""
    ) -> Self:
        """
        Start the file of a study.

        Parameters
        ----------
        folder
            Its folder, made if missing.
        study
            The study.
        overwrite
            Replace an existing study, but no file of another program.
        workers, command
            For the record: number of worker processes (or the cluster), and the command line.

        Raises
        ------
        OutputError
            If the folder cannot be written, another process writes the study, or there is one already.
        StudyError
            If the study has a name twice, or settings that cannot be stored.
        """
        if not overwrite:
            _check_not_old(folder, OutputError)
        content = Content(whole=False)
        content.take([_session_line(study, [ComparedMission.of(one) for one in study.missions], 1, workers, command)])
        log = Log.create(folder / FILE, WHAT, content.sessions, overwrite=overwrite)
        return cls(log, study, content)

    @classmethod
    def resume(cls, folder: Path, study: Study, *, workers: int | str = 1, command: str = "") -> Self:
        """
        Resume a study, with more scenarios, entrants, seeds and missions if asked for.

        Parameters
        ----------
        folder
            Its folder.
        study
            The request of this session. A part with the name of a stored one must be equal to it.
        workers, command
            As in `create`.

        Raises
        ------
        OutputError
            If the folder cannot be written, or another process writes the study.
        StudyError
            If there is no study, it cannot be read (see `load`), or this one contradicts it.
        """
        _check_not_old(folder, StudyError)
        content, merged = Content(whole=False), []

        def take(lines: Iterator[Line]) -> list[Line]:
            with understood(folder / FILE):
                content.take(lines)
                merged.append(_merged(study, content.study()))
                missions = _merged_missions(study, content.missions())
                # malformed certificates are refused before anything is written
                content.certificates()
            line = _session_line(merged[0], missions, len(content.sessions) + 1, workers, command)
            content.take([line])
            return [line]

        return cls(Log.resume(folder / FILE, WHAT, take), merged[0], content)

    def __enter__(self) -> Self:
        """Return the store itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Release the file, also after an error."""
        self.close()

    def close(self) -> None:
        """Release the file for other writers."""
        self._log.close()

    def __contains__(self, key: Key) -> bool:
        """Tell whether a proof, a run or a flight is done."""
        return key in self._done

    def __getitem__(self, key: Key) -> Certificate:
        """Return the certificate of a scenario, the only result that other tasks need."""
        return self._certificates[key[1]]

    def finished(self) -> set[Cell]:
        """Return the cells whose runs are done."""
        return {Cell(*names) for kind, *names in self._done if kind == RUN}

    def add(self, key: Key, result: Any) -> Any:  # noqa: ANN401 - a certificate, a run or a flight
        """
        Write a certificate, a run or a flight.

        Returns
        -------
        result
            The stored form: a certificate without grids; a run with its number and the certificate of its scenario.

        Raises
        ------
        StudyError
            If it is not part of the study, is stored already, or has settings that cannot be stored.
        OutputError
            If it cannot be written; earlier lines stay, and the call may be repeated.
        """
        kind, *names = key
        if key not in self._open or (key in self._done and kind != PROOF):
            why = "is there already" if key in self._done else "is not part of the study"
            msg = f"{self.path}: the {kind} of {', '.join(map(repr, names))} {why}; nothing was written"
            raise StudyError(msg)
        if kind == PROOF:
            document, result = certificate_document(result), dataclasses.replace(result, grids=())
        elif kind == RUN:
            document, proof = run_document(result), self._certificates.get(names[0])
            solution = dataclasses.replace(result.solution, certificate=proof)
            result = dataclasses.replace(result, solution=solution, number=self._n_runs + 1, certificate=proof)
        else:
            document = result.document()
        self._log.append([{"kind": kind, "key": names[0] if kind == PROOF else names, **document}])
        self._done.add(key)
        self._n_runs += kind == RUN
        if kind == PROOF:
            self._certificates[names[0]] = result
        return result


def _merged(study: Study, before: Study) -> Study:
    """Merge a study with the stored one, which it must agree with."""
    for word in ("tolerance", "limits"):
        old, new = getattr(before, word), getattr(study, word)
        if old != new:
            asked = f"the study in the folder has {_setting_text(old)}, this one {_setting_text(new)}"
            msg = f"{asked}; keep that, or choose another folder"
            raise StudyError(msg)
    for old, new in ((before.metrics, study.metrics), (study.metrics, before.metrics)):
        kept = {one.name: metric_document(one) for one in new}
        for one in old:
            _check_same("metric", one.name, _differing(metric_document(one), kept.get(one.name, {})))
    known = {scenario.name: scenario_document(scenario) for scenario in before.scenarios}
    for scenario in study.scenarios:
        if scenario.name in known:
            new_document = scenario_document(scenario)
            _check_same("scenario", scenario.name, _differing(known[scenario.name], new_document))
    known = {entrant.label: entrant_document(entrant) for entrant in before.entrants}
    for entrant in study.entrants:
        if entrant.label in known:
            _check_same("entrant", entrant.label, _differing(known[entrant.label], entrant_document(entrant)))
    # this session's order; of equal ones the first stays
    return dataclasses.replace(
        study,
        scenarios=list({one.name: one for one in (*study.scenarios, *before.scenarios)}.values()),
        entrants=_by_label(study.entrants, before.entrants),
        mission_entrants=_by_label(study.mission_entrants, before.mission_entrants),
        seeds=tuple(dict.fromkeys((*study.seeds, *before.seeds))),
        title=study.title or before.title,
    )


def _by_label(*entrants: Iterable[Entrant]) -> list[Entrant]:
    return list({one.label: one for some in entrants for one in some}.values())


def _merged_missions(study: Study, before: Iterable[ComparedMission]) -> list[ComparedMission]:
    """Merge missions, this session's first; each must equal the stored one of its name."""
    found = {mission.name: ComparedMission.of(mission) for mission in study.missions}
    for old in before:
        new = found.setdefault(old.name, old)
        _check_same("mission", old.name, [] if new.digest == old.digest else [old.where])
    return list(found.values())


def _setting_text(setting: Limits | float | None) -> str:
    """Write limits or a tolerance in words."""
    if isinstance(setting, Limits):
        return f"limits of {setting.seconds:g} seconds and {setting.megabytes:g} megabytes"
    return "no lower bounds" if setting is None else f"a tolerance of {setting:g}"


def _differing(old: Document, new: Document) -> list[str]:
    """Name the keys that differ between two documents, except title and notes."""
    # one of them may lack a key, such as that of rasters
    keys = [key for key in {**new, **old} if key not in {"title", "notes"}]
    differing = [key for key in keys if old.get(key) != new.get(key) and dumps(old.get(key)) != dumps(new.get(key))]
    if "problem" in differing:
        differing.remove("problem")
        differing += [f"problem.{key}" for key in _differing(old["problem"], new["problem"])]
    return differing


def _check_same(what: str, name: str, differing: list[str]) -> None:
    """Refuse a part that differs from the stored one of its name."""
    if differing:
        msg = (
            f"{what} {name!r} is not the one in the study so far: {', '.join(differing)} differ; "
            f"give it another name, or choose another folder"
        )
        raise StudyError(msg)


def _session_line(
    study: Study, missions: Iterable[ComparedMission], number: int, workers: int | str, command: str
) -> Line:
    """Return the line of a session: the whole request and its origin."""
    missions = list(missions)
    for what, names in (
        ("scenario", [scenario.name for scenario in study.scenarios]),
        ("entrant", [entrant.label for entrant in study.entrants]),
        ("mission", [mission.name for mission in missions]),
        ("metric", [metric.name for metric in study.metrics]),
    ):
        twice = [name for name, count in Counter(names).items() if count > 1]
        if twice:
            msg = f"the study has more than one {what} of the name {twice[0]!r}; give each its own"
            raise StudyError(msg)
    areas: dict[str, str] = {}
    rasters: dict[str, str] = {}
    graphs: dict[str, str] = {}
    scenarios = [_with_maps_apart(scenario_document(scenario), areas, rasters, graphs) for scenario in study.scenarios]
    return {
        "kind": SESSION,
        "key": number,
        **dataclasses.asdict(session(number, workers=str(workers), command=command, source=study.source)),
        "title": study.title,
        "seeds": list(study.seeds),
        "tolerance": encode(study.tolerance),
        "seconds": encode(study.limits.seconds),
        "megabytes": encode(study.limits.megabytes),
        "areas": areas,
        **({"rasters": rasters} if rasters else {}),
        **({"graphs": graphs} if graphs else {}),
        "scenarios": scenarios,
        "entrants": [entrant_document(entrant) for entrant in study.entrants],
        **({"metrics": [metric_document(metric) for metric in study.metrics]} if study.metrics else {}),
        "cells": [
            [list(seeds_of(scenario, entrant, study.seeds)) for entrant in study.entrants]
            for scenario in study.scenarios
        ],
        "missions": [mission.document() for mission in missions],
        "mission_entrants": [entrant.label for entrant in study.mission_entrants],
        "flights": [list(cell) for cell in flight_cells(missions, study.mission_entrants, study.seeds)],
    }


def _with_maps_apart(
    document: Document, areas: dict[str, str], rasters: dict[str, str], graphs: dict[str, str]
) -> Document:
    """Move no-fly area, raster values and graph out of a scenario's document, because scenarios share them."""
    if "graph" in document:
        return {**document, "graph": _put_apart(document["graph"], graphs)}
    problem = dict(document["problem"])
    if problem["no_fly"] is not None:
        problem["no_fly"] = _put_apart(problem["no_fly"], areas)
    if "rasters" in problem:
        problem["rasters"] = [{**one, "values": _put_apart(one["values"], rasters)} for one in problem["rasters"]]
    return {**document, "problem": problem}


def _put_apart(text: str, apart: dict[str, str]) -> str:
    digest = _digest(text)
    apart[digest] = text
    return digest


@lru_cache(maxsize=16)
def _digest(text: str) -> str:
    return hashlib.sha256(text.encode()).hexdigest()


def _scenario(
    document: Document, areas: Mapping[str, str], rasters: Mapping[str, str], graphs: Mapping[str, str]
) -> AnyScenario:
    if "graph" in document:
        return scenario_from({**document, "graph": graphs[document["graph"]]})
    problem = dict(document["problem"])
    if problem["no_fly"] is not None:
        problem["no_fly"] = areas[problem["no_fly"]]
    if "rasters" in problem:
        problem["rasters"] = [{**one, "values": rasters[one["values"]]} for one in problem["rasters"]]
    return scenario_from({**document, "problem": problem})
