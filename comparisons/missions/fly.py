"""The command `fly`: flights of each variant of a mission, with log, traces, pictures and animation."""

import dataclasses
import signal
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field
from pathlib import Path
from types import FrameType
from typing import Any

from cgla_graph._text import shown
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.missions.files import (
    flight_document,
    flight_geojson,
    header_document,
    log_lines,
    trace_csv,
    whole_log,
)
from cgla_graph.comparisons.missions.tables import COLUMN_NOTES, flight_notes, flight_table, heading, variants_table
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
from cgla_graph.errors import MissionError, OutputError
from cgla_graph.mission.simulation import Simulation
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.mission_file import MissionFile, load_mission
from cgla_graph.solvers import registry

#: The log is written at most every so many seconds, and in at most this share of the time.
LOG_SECONDS, LOG_SHARE = 1.0, 0.1


def build_solver(text: str) -> Solver:
    """
    Build a solver from ``NAME`` or ``NAME:A=1:B=2``.

    It does not certify its own paths unless the text asks for it, because a mission plans dozens of times.

    Raises
    ------
    CglaError
        If there is no such solver or setting, or it cannot run here.

    Examples
    --------
    >>> build_solver("hybrid").tolerance is None
    True
    """
    entrant = Entrant.parse(text)
    return registry.get(entrant.name, **entrant.settings_on(None))


def open_mission(
    spec: str,
    *,
    solver: str | None = None,
    variant: str | None = None,
    max_ticks: int | None = None,
    clearance: float | None = None,
    terrain: Mapping[str, object] | None = None,
) -> tuple[MissionFile, list[MissionSpec]]:
    """
    Open a mission, ready to be flown.

    Parameters
    ----------
    spec
        A shipped name, or a TOML file.
    solver
        As in `build_solver`, instead of the file's.
    variant
        The only variant to open.
    max_ticks, clearance, terrain
        Instead of the file's (see `load_mission`).

    Returns
    -------
    file, specs
        One spec a variant.

    Raises
    ------
    CglaError
        If a mission, variant or solver is invalid; the message lists the choices.
    """
    opened = load_mission(spec, clearance=clearance, terrain=terrain)
    missions = opened.missions(build_solver, solver=solver)
    if variant is not None and variant not in missions:
        known = ", ".join(repr(name) for name in missions if name)
        msg = f"{opened.name} has no variant {shown(variant)}; {f'choose {known}' if known else 'it has none at all'}"
        raise MissionError(msg)
    specs = []
    for name, mission in missions.items():
        if variant is None or name == variant:
            limited = mission if max_ticks is None else dataclasses.replace(mission, max_ticks=max_ticks)
            label = solver or opened.variants[name].solver
            specs.append(MissionSpec(opened.name, name, opened.title, label, limited, opened.projection))
    return opened, specs


class StopRequest:
    """
    Ctrl-C in two steps: the first lets the current tick finish, so that the flight is whole; the second stops at once.

    Attributes
    ----------
    is_made
        Whether Ctrl-C was pressed.
    waits
        Whether `is_made` is polled, as during a flight; otherwise the first Ctrl-C stops at once, too.
    """

    def __init__(self) -> None:
        self.is_made = False
        self.waits = False
        self._before: Any = signal.default_int_handler

    def _ask(self, number: int, frame: FrameType | None) -> None:
        if self.is_made or not self.waits:
            # (of the command line it raises KeyboardInterrupt, though not amid an import)
            (self._before if callable(self._before) else signal.default_int_handler)(number, frame)
            return
        self.is_made = True
        console.say("cgla: finishing this tick; Ctrl-C again stops at once")

    @contextmanager
    def listen(self) -> Iterator["StopRequest"]:
        """Handle Ctrl-C while the body runs; other threads than the main one receive none."""
        if threading.current_thread() is not threading.main_thread():
            yield self
            return
        self._before = signal.signal(signal.SIGINT, self._ask)
        try:
            yield self
        finally:
            signal.signal(signal.SIGINT, self._before)


@dataclass
class Flights:
    """
    The flights so far.

    Attributes
    ----------
    flown
        The flights, the interrupted one too.
    written
        The files.
    interrupted
        Whether Ctrl-C ended it.
    failure
        The error of a file that could not be written, which ended it; None without one.
    """

    flown: list[MissionRun] = field(default_factory=list)
    written: list[Path] = field(default_factory=list)
    interrupted: bool = False
    failure: OutputError | None = None


def fly_all(
    specs: Sequence[MissionSpec],
    folder: Path | None = None,
    *,
    value: bool = True,
    animation: bool = True,
    step: Callable[[str], None] | None = None,
) -> Flights:
    """
    Fly missions one after the other, and write their files.

    Parameters
    ----------
    specs
        The variants of one mission.
    folder
        Folder of the files; None writes nothing.
    value
        Whether to compute the price of ignorance and the value of sharing, by flying again with full knowledge, and
        without sharing, and lower bounds of the costs.
    animation
        Whether to draw animations; pictures are always drawn.
    step
        Called with a message at each tick and before other long steps.

    Returns
    -------
    flights
        After Ctrl-C the flights so far, with logs and traces, and no pictures. Where a file cannot be written, the
        flights so far: a full disk loses no results.
    """
    step = step or _no_progress
    done = Flights()
    taken: set[str] = set()
    stems = [folder and folder / files.file_stem(f"{one.name} {one.variant}", taken) for one in specs]
    with StopRequest().listen() as stop:
        try:
            for spec, stem in zip(specs, stems, strict=True):
                flown = fly_one(spec, stem and stem.with_name(f"{stem.name}.jsonl"), stop, step)
                done.flown.append(flown)
                if value and not stop.is_made:
                    step(f"{spec.label}: the value of knowledge and of sharing")
                    try:
                        done.flown[-1] = flown = with_worth(flown)
                    except KeyboardInterrupt:
                        # the flight itself is whole
                        stop.is_made = True
                if stem is not None:
                    done.written += _write_data(stem, flown)
                if stop.is_made:
                    done.interrupted = True
                    return done
            if folder is not None:
                for flown, stem in zip(done.flown, filter(None, stems), strict=True):
                    step(f"{flown.label}: pictures")
                    done.written += _write_pictures(stem, flown, animation=animation)
                done.written += _write_variants(folder, done.flown, taken)
        except KeyboardInterrupt:
            done.interrupted = True
        except OutputError as error:
            done.failure = error
    return done


def _no_progress(_: str) -> None:
    """Show no progress."""


def fly_one(
    spec: MissionSpec, log: Path | None, stop: StopRequest, step: Callable[[str], None] | None = None
) -> MissionRun:
    """
    Fly one mission to its end, or to where Ctrl-C ends it.

    Parameters
    ----------
    spec
        The mission.
    log
        The log file. During the flight, finished ticks are written about every second to the same name with ``.part``;
        None writes nothing.
    stop
        The request to stop, polled after each tick.
    step
        Called with a message at each tick.
    """
    simulation = spec.mission.simulate()
    writer = None if log is None else _LogWriter(spec, log)
    began = time.perf_counter()
    stop.waits = True
    try:
        while not (simulation.is_over or stop.is_made):
            simulation.advance()
            if step is not None:
                step(f"{spec.label}: tick {simulation.tick}")
            if writer is not None:
                writer.write(simulation)
    except KeyboardInterrupt:
        stop.is_made = True
    finally:
        stop.waits = False
    flight = simulation.flight(interrupted=not simulation.is_over)
    given = {f.name: getattr(spec, f.name) for f in dataclasses.fields(MissionSpec)}
    return MissionRun(**given, flight=flight, seconds=time.perf_counter() - began)


class _LogWriter:
    """Writes finished ticks now and then, because assembling the flight so far takes time."""

    def __init__(self, spec: MissionSpec, log: Path) -> None:
        self.spec, self.part = spec, _part(log)
        self.next_tick = 0
        self.cost = 0.0
        self.before = time.perf_counter()
        files.write_text(self.part, files.json_lines([header_document(spec)]))

    def write(self, simulation: Simulation) -> None:
        began = time.perf_counter()
        if began - self.before < max(LOG_SECONDS, self.cost / LOG_SHARE):
            return
        # more may happen on the tick that begins now
        lines = log_lines(self.spec, simulation.flight(), self.next_tick, simulation.tick)
        files.append_text(self.part, files.json_lines(lines))
        self.next_tick, self.before = simulation.tick, time.perf_counter()
        self.cost = self.before - began


def with_worth(flown: MissionRun) -> MissionRun:
    """
    Compute the price of ignorance and the value of sharing, by flying up to twice more, and bounds of the costs.

    Returns
    -------
    with_worth
        The same with all three; without the value of sharing where nothing is shared.
    """
    flight = flown.flight
    shares = flight.mission.sharing.is_on and len(flight.uavs) > 1
    sharing = flight.fly_unshared().costs_over(flight) if shares else None
    ignorance = flight.costs_over(flight.fly_informed())
    return dataclasses.replace(flown, ignorance=ignorance, sharing=sharing, bounds=flight.lower_bounds)


def _part(log: Path) -> Path:
    return log.with_name(f"{log.name}.part")


def _write_data(stem: Path, flown: MissionRun) -> list[Path]:
    """Write log, traces and paths of one flight."""
    log = files.write_text(stem.with_name(f"{stem.name}.jsonl"), files.json_lines(whole_log(flown)))
    _part(log).unlink(missing_ok=True)
    written = [
        log,
        files.write_text(stem.with_name(f"{stem.name}.csv"), trace_csv(flown)),
    ]
    if flown.projection is not None:
        written.append(files.write_text(stem.with_name(f"{stem.name}.geojson"), flight_geojson(flown)))
    return written


def _write_pictures(stem: Path, flown: MissionRun, *, animation: bool) -> list[Path]:
    """Write the picture and the animation of one flight."""
    from cgla_graph.comparisons.plots.runs import labelled_flight  # noqa: PLC0415 - matplotlib only where it draws
    from cgla_graph.plots import animation_file, pictures  # noqa: PLC0415 - the same
    from cgla_graph.plots.flight import flight_figure  # noqa: PLC0415 - the same

    view = labelled_flight(flown)
    drawn = flight_figure([view])
    written = [pictures.save(drawn, stem.with_name(f"{stem.name}{suffix}")) for suffix in (".png", ".svg")]
    if animation:
        written += animation_file.animate(
            view, [stem.with_name(f"{stem.name}{suffix}") for suffix in animation_file.suffixes()]
        )
    return written


def _write_variants(folder: Path, flights: Sequence[MissionRun], taken: set[str]) -> list[Path]:
    """Write the picture of the first variants side by side, where there are several."""
    if len(flights) < 2:  # noqa: PLR2004 - one is no comparison
        return []
    from cgla_graph.comparisons.plots.runs import labelled_flight  # noqa: PLC0415 - matplotlib only where it draws
    from cgla_graph.plots import pictures  # noqa: PLC0415 - the same
    from cgla_graph.plots.flight import MOST_PANELS, flight_figure  # noqa: PLC0415 - the same

    stem = files.file_stem(f"{flights[0].name} variants", taken)
    return [pictures.save(flight_figure(list(map(labelled_flight, flights[:MOST_PANELS]))), folder / f"{stem}.png")]


def print_flights(flights: Sequence[MissionRun]) -> None:
    """Print a table and notes for each variant, and one table of all variants."""
    if not flights:
        return
    console.out(f"{heading(flights[0])}\n\n")
    for flown in flights:
        console.out_table(flight_table(flown))
        console.out("".join(f"{line}\n" for line in flight_notes(flown)) + "\n")
    if len(flights) > 1:
        console.out_table(variants_table(flights))
    console.out("".join(f"{line}\n" for line in COLUMN_NOTES))


def flights_document(opened: MissionFile, flights: Flights) -> dict[str, Any]:
    """Return everything that was flown as one JSON document."""
    return {
        "mission": opened.name,
        "title": opened.title,
        "notes": opened.notes,
        **({} if opened.terrain is None else {"terrain": opened.terrain.document()}),
        "flights": [flight_document(flown) for flown in flights.flown],
        "files": [str(path) for path in flights.written],
        "interrupted": flights.interrupted,
    }


def kept_note(flights: Flights, total: int, folder: Path | None) -> str:
    """Return one line on the flights that Ctrl-C left."""
    whole = sum(not flown.flight.interrupted for flown in flights.flown)
    cut = next((flown for flown in flights.flown if flown.flight.interrupted), None)
    part = f" and {cut.label} until tick {cut.flight.ticks}" if cut is not None else ""
    kept = f", kept in {folder}" if folder is not None else ""
    n_logs = sum(path.suffix == ".jsonl" for path in flights.written)
    if folder is not None and n_logs < len(flights.flown):
        kept += " (the last log has an end missing, and is called .part)"
    return f"{whole} of {total} flights are done{part}{kept}"
