"""The paper's model of a single flight, and what is measured of it: what all experiments with one UAV share."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField
from cgla_graph.solvers import get
from cgla_graph.solvers.base import Solver

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


def paper_lattice(n: int = N) -> Lattice:
    """
    Return the paper's lattice, ``i / n`` for ``i = 1 … n`` (E19).

    Examples
    --------
    >>> paper_lattice(10).n_points
    100
    """
    return Lattice(n, bounds=BOUNDS, kind="upper")


def fly_alone(
    field: RiskField,
    *,
    k: float,
    solver: Solver | None = None,
    integral: Literal["exact", "raster"] = "exact",
    radius: float = RADIUS,
    n: int = N,
    start: Point = START,
    goal: Point = GOAL,
    timed: Sequence[TimedThreat] = (),
) -> UavFlight:
    """
    Fly one UAV that sees what is near and plans again when it sees something new.

    Parameters
    ----------
    field
        The true threats, unknown at first.
    k
        Risk weight.
    solver
        What plans; None: ``cgla``.
    integral
        Of the planner's weights.
    radius
        Detection radius, map units.
    n
        Points a side of the lattice; a step is 0.02 of the map's side, whatever `n` is.
    start, goal
        Map units.
    timed
        Threats that come up under way.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> fly_alone(RiskField([Threat(0.5, 0.5, 0.05)]), k=10.0).status.label
    'arrived'
    """
    uav = Uav("a", start=start, goal=goal, detection_radius=radius, step=STEP, k=k)
    mission = Mission(
        World(field, bounds=BOUNDS, timed=timed),
        [uav],
        get("cgla") if solver is None else solver,
        resolution=paper_lattice(n),
        integral=integral,
        arrival_radius=ARRIVAL_RADIUS,
    )
    return mission.fly().uavs["a"]


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
    Return where a UAV is after each step along a path, its two ends among them.

    Parameters
    ----------
    path
        Waypoints, shape ``(m, 2)``, map units.
    step
        Map units.

    Returns
    -------
    positions
        Shape ``(t, 2)``.

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
