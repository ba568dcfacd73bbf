"""Every solver on every mission: the same flight, planned by each of them in turn."""

import dataclasses
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, nullcontext, suppress
from pathlib import Path

import shapely

from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.missions.runs import COLUMNS, FlightRun, FlightRuns
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import limits_where, made
from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
from cgla_graph.comparisons.study.options import number_names
from cgla_graph.comparisons.study.runner import reason
from cgla_graph.comparisons.workers.limits import Limits, lost
from cgla_graph.comparisons.workers.pool import Call, limited, use_up
from cgla_graph.errors import CglaError
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.mission_file import MissionFile, is_mission_file, load_mission
from cgla_graph.solvers import registry
from cgla_graph.solvers.warm_up import shortened

#: What `cgla compare` leaves out on missions unless it is asked for: a flight plans dozens of times, and these hand
#: over a complete graph edge by edge each time, or solve a mixed-integer program.
TOO_SLOW = ("networkx", "networkx-astar", "milp")
#: Labels of entrants that have been made ready in this process.
_ready: set[str] = set()


def split(specs: Sequence[str], **for_maps: object) -> tuple[list[str], list[MissionFile]]:
    """
    Part missions from maps.

    Parameters
    ----------
    specs
        What the user named.
    for_maps
        Options that missions do not have, by their names on the command line, as the user set them.

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
    >>> maps, missions = split(["paper", "fig8"])
    >>> maps, [mission.name for mission in missions]
    (['paper'], ['fig8'])
    """
    missions = [load_mission(spec) for spec in specs if is_mission_file(spec)]
    unfit = [f"--{name}" for name, value in for_maps.items() if value]
    if missions and unfit:
        remedy = "name refine:base=NAME as a solver" if unfit[0] == "--refine" else "compare maps and missions apart"
        msg = f"{unfit[0]} is for maps, and {missions[0].name} is a mission; {remedy}"
        raise CglaError(msg)
    return [spec for spec in specs if not is_mission_file(spec)], number_names(missions)


def mission_entrants(entrants: Sequence[Entrant], *, chosen: bool) -> list[Entrant]:
    """
    Choose the solvers that fly missions.

    Parameters
    ----------
    entrants
        Those of the comparison.
    chosen
        Whether the user named them; otherwise those that need another package, or take too long, are left out.

    Examples
    --------
    >>> named = [Entrant.parse(name) for name in ("networkx", "cgla")]
    >>> [one.name for one in mission_entrants(named, chosen=False)], len(mission_entrants(named, chosen=True))
    (['cgla'], 2)
    """
    if chosen:
        return list(entrants)
    fast = [one for one in entrants if one.is_available and one.name not in TOO_SLOW]
    return [one for one in fast if not registry.traits(one.name).needs]


def count(missions: Sequence[MissionFile], entrants: Sequence[Entrant], n_seeds: int) -> int:
    """Count the flights of a comparison."""
    flights = sum(len(_seeds(entrant, n_seeds)) for entrant in entrants)
    return flights * sum(len(mission.variants) for mission in missions)


def compare(
    missions: Sequence[MissionFile],
    entrants: Sequence[Entrant],
    n_seeds: int = 3,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    limits: Limits | None = None,
) -> Iterator[FlightRun]:
    """
    Fly every variant of every mission with every solver; seeded ones with the seeds 1 to `n_seeds`.

    Parameters
    ----------
    missions, entrants
        What to fly, and what plans.
    n_seeds
        At least 1.
    workers
        How many processes fly at the same time; 0 flies in this process, without limits.
    scheduler
        Of a Dask cluster that flies instead, or None.
    limits
        Of each flight; None for the usual ones.

    Yields
    ------
    run
        As soon as it is done: with several workers, in no fixed order. A solver that cannot fly the mission, or that
        raises, hangs or crashes, is a run that says why.

    Examples
    --------
    >>> from cgla_graph.scenarios.mission_file import load_mission
    >>> runs = compare([load_mission("fig4")], [Entrant.parse("cgla")])
    >>> {run.status for run in runs}
    {'arrived'}
    """
    held = limits_where(limits or Limits(), workers=workers, scheduler=scheduler)
    calls = deque(
        Call((mission.name, variant, entrant.label, seed), _fly, (mission, variant, entrant, seed, held))
        for mission in missions
        for variant in mission.variants
        for entrant in entrants
        for seed in _seeds(entrant, n_seeds)
    )

    def next_call() -> Call | None:
        return calls.popleft() if calls else None

    if not calls:
        return
    workers = min(workers, len(calls))
    # whatever ends the iteration ends the workers
    with closing(made(next_call, held, workers=workers, scheduler=scheduler, preload=(__name__,))) as outcomes:
        for call, outcome in outcomes:
            yield outcome.value if outcome.failure is None else _lost(call, *lost(outcome, held))


def _fly(mission: MissionFile, variant: str, entrant: Entrant, seed: int | None, limits: Limits) -> FlightRun:
    """Make one flight in a worker."""
    if not entrant.is_built_in:
        # it may leave anything behind
        use_up()
    elif entrant.label not in _ready:
        _warm_up(entrant)
        _ready.add(entrant.label)
    with limited(limits.seconds, limits.megabytes):
        return _run(mission, variant, entrant, seed)


def _lost(call: Call, status: Status, message: str) -> FlightRun:
    """Say why a flight has told nothing."""
    mission, variant, entrant, seed, _ = call.args
    names = (mission.name, variant, entrant.label, seed, len(mission.variants[variant].uavs))
    return FlightRun(*names, status=status.label, message=message)


def run_all(
    missions: Sequence[MissionFile],
    entrants: Sequence[Entrant],
    n_seeds: int,
    folder: Path | None = None,
    *,
    workers: int = 0,
    scheduler: str | None = None,
    limits: Limits | None = None,
) -> FlightRuns:
    """
    Compare (see `compare`), showing progress, and write ``flights.jsonl`` and ``flights.csv``.

    After Ctrl-C they hold what is done.

    Raises
    ------
    OutputError
        If a file cannot be written.
    """
    done = FlightRuns()
    if not missions:
        return done
    with nullcontext() if folder is None else files.RowLog(folder, "flights.jsonl") as log:
        try:
            total = count(missions, entrants, n_seeds)
            with console.running_solvers(), console.progress(total) as tick:
                for run in compare(missions, entrants, n_seeds, workers=workers, scheduler=scheduler, limits=limits):
                    done.runs.append(run)
                    if log is not None:
                        log.add(run.row())
                    tick(f"{run.mission}: {run.solver}")
        except KeyboardInterrupt:
            done.interrupted = True
        done.runs.sort(key=_order(missions, entrants))
        if folder is not None and log is not None:
            table = [run.row() for run in done.runs]
            text = files.csv_text(table, COLUMNS)
            done.written += [log.finish(table), files.write_text(folder / "flights.csv", text)]
    return done


def _order(missions: Sequence[MissionFile], entrants: Sequence[Entrant]) -> Callable[[FlightRun], tuple[int, int, int]]:
    """Return what sorts flights as they were asked for; those of one entrant keep their order, by seeds."""
    variants = [(mission.name, variant) for mission in missions for variant in mission.variants]
    places = {place: number for number, place in enumerate(variants)}
    labels = {entrant.label: number for number, entrant in enumerate(entrants)}
    return lambda run: (places[run.mission, run.variant], labels[run.solver], run.seed or 0)


def _seeds(entrant: Entrant, n_seeds: int) -> Sequence[int | None]:
    """List the seeds of an entrant: none, the one that the user set, or 1 to `n_seeds`."""
    if not entrant.is_available or not registry.traits(entrant.name).seeded:
        return [None]
    return [entrant.settings["seed"]] if "seed" in entrant.settings else range(1, n_seeds + 1)


def _warm_up(entrant: Entrant) -> None:
    """Load the compiled kernels with a short flight, so that a solver's first plan is not charged for that."""
    world = World(RiskField([Threat(0.5, 0.5, 0.1)]), no_fly=shapely.box(0.45, 0.7, 0.55, 0.8))
    uavs = [Uav("a", (0.1, 0.4), (0.9, 0.4), 0.3), Uav("b", (0.9, 0.6), (0.1, 0.6), 0.3)]
    # what is wrong with a solver is told by its own flight
    with suppress(Exception):
        solver = shortened(registry.get(entrant.name, **entrant.settings_on(None)))
        Mission(world, uavs, solver, resolution=4, virtual_obstacle=True, max_ticks=8).fly()


def _run(mission: MissionFile, variant: str, entrant: Entrant, seed: int | None) -> FlightRun:
    """Fly one variant with one solver; whatever that raises becomes its answer."""
    names = (mission.name, variant, entrant.label, seed, len(mission.variants[variant].uavs))
    missing = registry.missing(entrant.name)
    if missing is not None:
        return FlightRun(*names, status="unavailable", message=missing)
    settings = entrant.settings_on(None) | ({} if seed is None else {"seed": seed})
    try:
        solver = registry.get(entrant.name, **settings)
        alone = dataclasses.replace(mission, variants={variant: mission.variants[variant]})
        (built,) = alone.missions(lambda _: solver, solver=entrant.label).values()
        flight = built.fly()
    except CglaError as error:
        return FlightRun(*names, status="failed", message=" ".join(str(error).split()))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a comparison survives any solver
        return FlightRun(*names, status="failed", message=reason(error))
    spec = MissionSpec(mission.name, variant, mission.title, entrant.label, built, mission.projection)
    given = {f.name: getattr(spec, f.name) for f in dataclasses.fields(MissionSpec)}
    flown = MissionRun(**given, flight=flight)
    lost = [uav for uav in flight.uavs.values() if flown.n_arrived < len(flight.uavs) and uav.status.label != "arrived"]
    status = lost[0].status.label if lost else "arrived"
    message = f"{lost[0].name}: {lost[0].message or lost[0].status.value}" if lost else ""
    return FlightRun(*names, status=status, flown=flown, message=message)
