"""The paper's flights, of one UAV and of several, and what is measured of flights and paths."""

import math
from collections.abc import Mapping, Sequence
from typing import Any, Literal

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus, UavFlight
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Solution
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.mission_file import MissionFile
from cgla_graph.solvers import get, solve

#: The paper's map.
BOUNDS = (0.0, 0.0, 1.0, 1.0)
#: Where its flights begin and end (Section 5.1).
START: Point = (0.1, 0.1)
GOAL: Point = (0.9, 0.9)
#: The paper's detection radius is not printed; this is ours (E21), map units.
RADIUS = 0.2
#: Half a unit around the goal counts as arrived (E26), map units.
ARRIVAL_RADIUS = 0.025
#: A flight's step, map units: 0.4 units of N = 20 (E16).
STEP = 0.02
#: Points a side (Section 5).
N = 20
#: The paper's K in its comparison of planners.
K = 10.0
#: Where the second UAV begins (Fig. 8), map units.
SECOND_START: Point = (0.1, 0.25)
#: Where Fig. 8 shows the two collide, map units.
MEETING: Point = (0.5, 0.7)
#: The paper's SD and the distance that counts as a collision are not printed; these are ours (E21, E25), map units.
SAFE_DISTANCE = 0.1
COLLISION_DISTANCE = 0.03
#: Standard deviation of a virtual obstacle (E23), map units: one step.
OBSTACLE_SPREAD = STEP
#: The paper's stepnum: the best of its Fig. 7.
STEPNUM = 3
#: Risk weight of missions with virtual obstacles: the paper does not print one.
TEAM_K = 20
#: Four times the longest flights seen; who is still flying then does not arrive.
MAX_TICKS = 500


def paper_lattice(n: int = N) -> Lattice:
    """
    Return the paper's lattice, ``i / n`` for ``i = 1 … n`` (E19).

    Examples
    --------
    >>> paper_lattice(10).n_points
    100
    """
    return Lattice(n, bounds=BOUNDS, kind="upper")


def fly_from(
    starts: Mapping[str, Point],
    field: RiskField,
    *,
    k: float,
    solver: Solver | str = "cgla",
    radius: float = RADIUS,
    step: float = STEP,
    n: int = N,
    goal: Point = GOAL,
    safe_distance: float | None = None,
    timed: Sequence[TimedThreat] = (),
    **rules: Any,  # noqa: ANN401 - as `Mission` takes them
) -> Flight:
    """
    Fly UAVs that see what is near, and plan again when they see something new, to one goal.

    Parameters
    ----------
    starts
        By name of the UAV, map units.
    field
        The true threats, unknown at first.
    k
        Risk weight.
    solver
        What plans.
    radius
        Detection radius, map units.
    step
        Map units a tick, whatever `n` is.
    n
        Points a side of the lattice.
    goal, safe_distance
        Map units.
    timed
        Threats that come up under way.
    **rules
        Of the mission, as `Mission` takes them.
    """
    uavs = [
        Uav(name, start, goal, radius, step=step, k=k, safe_distance=safe_distance) for name, start in starts.items()
    ]
    mission = Mission(
        World(field, bounds=BOUNDS, timed=timed),
        uavs,
        get(solver) if isinstance(solver, str) else solver,
        resolution=paper_lattice(n),
        arrival_radius=ARRIVAL_RADIUS,
        **rules,
    )
    return mission.fly()


def fly_alone(field: RiskField, *, k: float, start: Point = START, **settings: Any) -> UavFlight:  # noqa: ANN401
    """
    Fly one UAV; settings are those of `fly_from`.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> fly_alone(RiskField([Threat(0.5, 0.5, 0.05)]), k=10.0).status.label
    'arrived'
    """
    return fly_from({"a": start}, field, k=k, **settings).uavs["a"]


def fly_two(
    field: RiskField,
    *,
    k: float = TEAM_K,
    radius: float = RADIUS,
    sharing: Sharing | Literal["none", "global"] = "none",
    stepnum: int | None = None,
    spread: float = OBSTACLE_SPREAD,
    safe_distance: float = SAFE_DISTANCE,
    **rules: Any,  # noqa: ANN401 - as `Mission` takes them
) -> Flight:
    """
    Fly the paper's two UAVs: same speed, same goal, starts of Fig. 8.

    Parameters
    ----------
    field, k, radius, rules
        As of `fly_from`.
    sharing
        Who tells whom.
    stepnum
        How many steps ahead a virtual obstacle is; None: there is none.
    spread
        Standard deviation of a virtual obstacle, map units.
    safe_distance
        Nearer than this it is ahead of the other UAV, map units; at most half the radius.

    Examples
    --------
    >>> fly_two(RiskField([])).all_arrived
    True
    """
    return fly_from(
        {"a": START, "b": SECOND_START},
        field,
        k=k,
        radius=radius,
        sharing=sharing,
        safe_distance=min(safe_distance, radius / 2.0),
        virtual_obstacle=None if stepnum is None else VirtualObstacle(stepnum=stepnum, spread=spread),
        collision_distance=COLLISION_DISTANCE,
        collisions="record",
        max_ticks=MAX_TICKS,
        **rules,
    )


def fly_variants(file: MissionFile) -> dict[str, Flight]:
    """Fly all variants of a mission in a file, by name."""
    return {name: mission.fly() for name, mission in file.missions(get).items()}


def fly_alone_variants(file: MissionFile) -> dict[str, UavFlight]:
    """
    Fly all variants of a mission of one UAV, by name.

    Raises
    ------
    AssertionError
        If it does not arrive.
    """
    flights = {name: flight.uavs["a"] for name, flight in fly_variants(file).items()}
    for name, flight in flights.items():
        require(
            flight.status is MissionStatus.ARRIVED, f"{file.name}, {name or 'its one variant'}: {flight.status.value}"
        )
    return flights


def measures(flight: UavFlight) -> dict[str, Any]:
    """
    Return what is measured of a flight; of one that did not arrive only how it ended.

    A flight that was given up is shorter, and may have met less risk, than one that arrives: its numbers say nothing
    of the way to the goal.
    """
    arrived = flight.status is MissionStatus.ARRIVED
    names = ("length", "risk", "risk_sum", "cost", "exposure", "max_risk")
    return {
        "status": flight.status.label,
        "arrived": arrived,
        **{name: float(getattr(flight, name)) if arrived else None for name in names},
        "replans": len(flight.replans),
        "ticks": flight.ended - flight.departed,
    }


def positions_at_steps(path: FloatArray, step: float = STEP) -> FloatArray:
    """
    Return where a UAV is after each step along a path, its two ends among them: shape ``(t, 2)``, map units.

    Examples
    --------
    >>> positions_at_steps(np.array([[0.0, 0.0], [0.03, 0.0], [0.03, 0.02]])).tolist()
    [[0.0, 0.0], [0.02, 0.0], [0.03, 0.01], [0.03, 0.02]]
    """
    lengths = np.hypot(*np.diff(path, axis=0).T)
    along = np.concatenate([[0.0], np.cumsum(lengths)])
    # a last step shorter than this is rounding
    marks = np.append(np.arange(0.0, along[-1] - 1e-9 * step, step), along[-1])
    return np.column_stack([np.interp(marks, along, path[:, axis]) for axis in (0, 1)])


def risk_sum(field: RiskField, path: FloatArray, step: float = STEP) -> float:
    """
    Return the paper's measure of risk for a planned path: the sum of ``F`` over its positions a step apart (E5).

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> risk_sum(RiskField([Threat(0.5, 0.5, 0.05)]), np.array([[0.1, 0.5], [0.9, 0.5]])).__round__(3)
    6.267
    """
    return float(field.density(positions_at_steps(path, step)).sum())


def path_measures(field: RiskField, solution: Solution) -> dict[str, Any]:
    """Return what is measured of a planned path; of none only that there is none."""
    found = solution.status.has_path
    return {
        "status": solution.status.label,
        "arrived": found,
        **{name: float(getattr(solution, name)) if found else None for name in ("length", "risk", "cost")},
        "risk_sum": risk_sum(field, np.asarray(solution.path)) if found else None,
    }


def plan_measures(problem: Problem, solver: Solver | str) -> dict[str, Any]:
    """Plan with all of the map known, and return what is measured of the path, and what it took."""
    solution = solve(problem, solver, resolution=paper_lattice())
    took = {"seconds": solution.total_seconds, "evaluations": solution.evaluations}
    return {**path_measures(problem.field, solution), **took}


def team_measures(flight: Flight) -> dict[str, Any]:
    """
    Return what is measured of a mission: sums over its UAVs, and how near they came to each other.

    The sums are missing unless all arrived (see `measures`). How near they came is measured in any case.
    """
    each = [measures(one) for one in flight.uavs.values()]
    names = ("length", "risk", "risk_sum", "cost", "exposure")
    nearest = min(flight.separations, key=lambda pair: pair.distance)
    return {
        "arrived": flight.all_arrived,
        **{name: math.fsum(one[name] for one in each) if flight.all_arrived else None for name in names},
        "replans": sum(one["replans"] for one in each),
        "ticks": flight.ticks,
        "livelock": flight.livelock is not None,
        "separation": nearest.distance,
        "collided": nearest.distance < COLLISION_DISTANCE,
        "from_meeting": math.dist(nearest.where, MEETING),
    }
