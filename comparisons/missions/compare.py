"""Every solver on every mission: the same flight, planned by each of them in turn."""

import dataclasses
import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from contextvars import copy_context
from typing import Any

import shapely

from cgla_graph._text import plain_json
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.execution import check_lacking_here, check_made
from cgla_graph.comparisons.study.flight_run import FlightRun, Track
from cgla_graph.comparisons.study.runner import reason, status_by
from cgla_graph.comparisons.study.store import FLIGHT
from cgla_graph.comparisons.study.study import FlightCell, Study
from cgla_graph.comparisons.workers.tasks import Results, Task
from cgla_graph.isolation.limits import Limits, is_expendable, limited
from cgla_graph.isolation.outcome import Outcome
from cgla_graph.isolation.worker import use_up
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight
from cgla_graph.mission.replanner import ends_by_environment
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.isolated import lost
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Status
from cgla_graph.scenarios.mission_file import MissionFile
from cgla_graph.solvers import registry
from cgla_graph.solvers.warm_up import shortened

#: Modules that workers load before the first task.
PRELOAD = (__name__,)
#: Solvers that `cgla compare` leaves out on missions unless they are named: a flight plans dozens of times, and these
#: take a complete graph edge by edge each time, or solve a mixed-integer program.
TOO_SLOW = ("networkx", "networkx-astar", "milp")
#: Labels of entrants that have been made ready in this process.
_ready: set[str] = set()


def mission_entrants(entrants: Sequence[Entrant], *, chosen: bool) -> list[Entrant]:
    """
    Choose the solvers that fly missions.

    Parameters
    ----------
    entrants
        The entrants of the comparison.
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


def flight_tasks(study: Study) -> list[Task]:
    """
    List the flights of a study, mission by mission; none needs another.

    A solver that cannot fly a mission, or that raises, hangs or crashes, is a flight that says why.

    Examples
    --------
    >>> from cgla_graph.comparisons.workers.tasks import run_tasks
    >>> from cgla_graph.scenarios.mission_file import load_mission
    >>> fig4 = load_mission("fig4")
    >>> study = Study([], [], missions=[fig4], mission_entrants=[Entrant.parse("cgla")])
    >>> {flight.status for _, flight in run_tasks(flight_tasks(study), limits=study.limits, workers=0)}
    {'arrived'}
    """
    missions = {mission.name: mission for mission in study.missions}
    entrants = {entrant.label: entrant for entrant in study.mission_entrants}
    return [_flight_task(cell, missions[cell.mission], entrants[cell.solver]) for cell in study.flights()]


def _flight_task(cell: FlightCell, mission: MissionFile, entrant: Entrant) -> Task:
    n_uavs = len(mission.variants[cell.variant].uavs)

    def flight_of(outcome: Outcome, limits: Limits, _: Results) -> FlightRun:
        """Return a flight, or the reason why there is none."""
        check_made(outcome)
        if outcome.failure is not None:
            status, message = lost(outcome, limits)
            return FlightRun(*cell, n_uavs, status.label, message)
        if outcome.value["status"] == Status.UNAVAILABLE.label:
            check_lacking_here(entrant, outcome.value["message"])
        return FlightRun(*cell, n_uavs, **outcome.value)

    return Task((FLIGHT, *cell), _fly, (mission, cell.variant, entrant, cell.seed), flight_of)


# ---- in a worker ----


def _fly(mission: MissionFile, variant: str, entrant: Entrant, seed: int | None, limits: Limits) -> Mapping[str, Any]:
    """Make one flight in a worker."""
    if not entrant.is_built_in:
        # a plug-in may change the process
        use_up()
    elif entrant.label not in _ready:
        _warm_up(entrant)
        _ready.add(entrant.label)
    with limited(limits.seconds, limits.megabytes):
        return _run(mission, variant, entrant, seed)


def _warm_up(entrant: Entrant) -> None:
    """Load the compiled kernels with a short flight, so that a solver's first plan is not charged for that."""
    world = World(RiskField([Threat(0.5, 0.5, 0.1)]), no_fly=shapely.box(0.45, 0.7, 0.55, 0.8))
    uavs = [Uav("a", (0.1, 0.4), (0.9, 0.4), 0.3), Uav("b", (0.9, 0.6), (0.1, 0.6), 0.3)]
    # a solver's own flight reports its errors
    with suppress(Exception):
        solver = shortened(registry.get(entrant.name, **entrant.settings_on(None)))
        Mission(world, uavs, solver, resolution=4, virtual_obstacle=True, max_ticks=8).fly()


def _run(mission: MissionFile, variant: str, entrant: Entrant, seed: int | None) -> Mapping[str, Any]:
    """Fly one variant with one solver; an exception becomes its answer."""
    try:
        missing = registry.missing(entrant.name)
        if missing is not None:
            return {"status": Status.UNAVAILABLE.label, "message": missing}
        settings = entrant.settings_on(None) | ({} if seed is None else {"seed": seed})
        solver = registry.get(entrant.name, **settings)
        alone = dataclasses.replace(mission, variants={variant: mission.variants[variant]})
        (built,) = alone.missions(lambda _: solver, solver=entrant.label).values()
        # (a flight to its end would say nothing of a solver that lacks a package)
        context = copy_context()
        context.run(ends_by_environment.set, True)  # noqa: FBT003 - as context variables are set
        return _answer(context.run(built.fly))
    except BaseException as error:
        # (as of runs on maps)
        if not (isinstance(error, Exception | SystemExit) or is_expendable()):
            raise
        return {"status": status_by(error).label, "message": reason(error)}


def _answer(flight: Flight) -> Mapping[str, Any]:
    """Return the results of a flight as numbers and words."""
    uavs = list(flight.uavs.values())
    late = [uav for uav in uavs if uav.status.label != "arrived"]
    numbers = {
        "arrived": len(uavs) - len(late),
        **flight.totals,
        "least_separation": flight.least_separation,
        "ticks": flight.ticks,
        "replans": sum(len(uav.replans) for uav in uavs),
        "planning_seconds": math.fsum(uav.planning_seconds for uav in uavs),
    }
    return {
        "status": late[0].status.label if late else "arrived",
        "message": f"{late[0].name}: {late[0].message or late[0].status.value}" if late else "",
        "numbers": plain_json(numbers),
        "tracks": [Track(uav.name, uav.status.label, uav.message, plain_json(uav.path)) for uav in uavs],
    }
