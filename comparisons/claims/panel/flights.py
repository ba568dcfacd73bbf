"""Flights and plans on the maps of the panel, and what is measured of them."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from itertools import product
from types import MappingProxyType
from typing import Any, NamedTuple, TypeAlias

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, RULES, START, PanelMap
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus, UavFlight
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import World
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solver import Solver
from cgla_graph.solvers import get, solve

#: Half a unit around the goal counts as arrived (E26), map units.
ARRIVAL_RADIUS = 0.025
#: A flight's step, map units: 0.4 units of N = 20 (E16).
STEP = 0.02
#: Points a side (Section 5).
N = 20
#: Two UAVs nearer than this collide; the paper prints no distance (E25), map units.
COLLISION_DISTANCE = 0.03
#: Four times the longest flights of CGLA seen: who is still flying then does not arrive.
MAX_TICKS = 500
#: A planner with settings, as records name it: ``cgla``, ``bcv-style, risk_aversion 0``.
Setup: TypeAlias = tuple[str, tuple[tuple[str, Any], ...]]
CGLA: Setup = ("cgla", ())
#: What flights and plans are measured by; risk is the exact line integral.
MEASURES = ("length", "risk", "max_risk", "exposure")
#: Where ``F`` is above this, a way is at the rim of a threat: 2.8 spreads from its centre if it stands alone.
RIM = 0.02


def paper_lattice(n: int = N) -> Lattice:
    """
    Return the paper's lattice, ``i / n`` for ``i = 1 … n`` (E19).

    Examples
    --------
    >>> paper_lattice(10).n_points
    100
    """
    return Lattice(n, bounds=BOUNDS, kind="upper")


def setup(planner: str, **settings: Any) -> Setup:  # noqa: ANN401 - settings of a solver
    """
    Name a planner with settings.

    Examples
    --------
    >>> setup_name(setup("bcv-style", risk_aversion=0.0))
    'bcv-style, risk_aversion 0'
    """
    return planner, tuple(settings.items())


def setup_name(of: Setup) -> str:
    """Return how records name a planner with settings."""
    words = [f"{name} {value:g}" if isinstance(value, float) else f"{name} {value}" for name, value in of[1]]
    return ", ".join([of[0], *words])


class Flown(NamedTuple):
    """
    A planner in a cell, or in varied settings.

    Attributes
    ----------
    of, flown
        The planner by which records are named, and the one that flies: another one where a constant of it is varied.
    radius, k
        Of the cell.
    varied
        Name of the varied setting; empty in the cells of the panel.
    rules
        Of the mission, where these are varied.
    """

    of: Setup
    flown: Setup
    radius: float
    k: float
    varied: str = ""
    rules: Mapping[str, Any] = MappingProxyType({})


def settings_of(map_: PanelMap, planners: Sequence[Setup], constants: Sequence[tuple[Setup, Setup]]) -> list[Flown]:
    """
    List what flies over a map: planners in all of its cells, and with rules and constants varied from its base cells.

    Parameters
    ----------
    map_
        The map.
    planners
        CGLA and others.
    constants
        Planners, each with one of its constants varied: it flies beside CGLA.

    Examples
    --------
    >>> [len(settings_of(PanelMap(seed), [CGLA], [])) for seed in (1_000_000, 1_010_000)]
    [18, 9]
    """
    levels = map_.panel.levels
    found = [Flown(of, of, radius, k) for radius, k in product(levels("radius"), levels("k")) for of in planners]
    for base, k in product(map_.bases, levels("k")):
        radius = base["radius"]
        for name, value in RULES.items():
            # only a graph solver weighs segments, and has nearest points to begin from
            rules = {name: value}
            found += [Flown(of, of, radius, k, f"{name} {value}", rules if of == CGLA else {}) for of in planners]
        for of, changed in constants:
            pair = ((CGLA, CGLA), (of, changed))
            found += [Flown(one, flown, radius, k, setup_name(changed)) for one, flown in pair]
    return found


def fly(
    starts: Mapping[str, Point],
    threats: RiskField,
    goal: Point | Mapping[str, Point],
    solver: Solver | str = "cgla",
    *,
    k: float,
    radius: float,
    n: int = N,
    step: float = STEP,
    safe_distance: float | None = None,
    timed: Any = (),  # noqa: ANN401 - as `World` takes them
    **rules: Any,  # noqa: ANN401 - as `Mission` takes them
) -> Flight:
    """
    Fly UAVs that see what is near, and plan again when they see something new.

    Parameters
    ----------
    starts
        By name of the UAV, map units.
    threats
        The true threats, unknown at first.
    goal
        Of all UAVs, or by name, map units.
    solver
        The planner.
    k
        Risk weight.
    radius
        Detection radius, map units.
    n
        Points a side of the lattice.
    step
        Of the UAVs, map units.
    safe_distance
        Of virtual obstacles, map units.
    timed
        Threats that come up under way.
    **rules
        Of the mission, as `Mission` takes them.

    Examples
    --------
    >>> fly({"a": START}, RiskField(), (0.9, 0.9), k=10.0, radius=0.2).all_arrived
    True
    """
    goals = goal if isinstance(goal, Mapping) else dict.fromkeys(starts, goal)
    uavs = [
        Uav(name, at, goals[name], radius, step=step, k=k, safe_distance=safe_distance) for name, at in starts.items()
    ]
    mission = Mission(
        World(threats, bounds=BOUNDS, timed=timed),
        uavs,
        get(solver) if isinstance(solver, str) else solver,
        resolution=paper_lattice(n),
        arrival_radius=ARRIVAL_RADIUS,
        **rules,
    )
    return mission.fly()


def flight_measures(flight: UavFlight, k: float) -> dict[str, Any]:
    """
    Return what is measured of a flight, with its cost for a risk weight; of one that did not arrive only how it ended.

    A flight that was given up is shorter, and may have met less risk, than one that arrives: its numbers say nothing
    of the way to the goal.
    """
    arrived = flight.status is MissionStatus.ARRIVED
    found = {name: float(getattr(flight, name)) if arrived else None for name in MEASURES}
    cost = flight.length + k * flight.risk if arrived else None
    return {"status": flight.status.label, "arrived": arrived, **found, "cost": cost}


def length_at_rim(threats: RiskField, path: FloatArray) -> float:
    """
    Return the length of a path where ``F`` is above `RIM`, map units, to a twentieth of a step.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> length_at_rim(RiskField([Threat(0.5, 0.5, 0.05)]), np.array([[0.1, 0.5], [0.9, 0.5]])).__round__(2)
    0.28
    """
    spots = positions_at_steps(path, STEP / 20.0)
    lengths = np.hypot(*np.diff(spots, axis=0).T)
    return float(lengths[threats.density(0.5 * (spots[:-1] + spots[1:])) > RIM].sum())


def team_measures(flight: Flight) -> dict[str, Any]:
    """
    Return what is measured of a mission: sums over its UAVs, and how near they came to each other.

    The sums are missing unless all arrived (see `flight_measures`). How near they came is measured in any case.
    """
    each = [flight_measures(one, one.uav.k) for one in flight.uavs.values()]
    names = ("length", "risk", "cost", "exposure")
    nearest = min(flight.separations, key=lambda pair: pair.distance)
    return {
        "arrived": flight.all_arrived,
        **{name: math.fsum(one[name] for one in each) if flight.all_arrived else None for name in names},
        "ticks": flight.ticks,
        "livelock": flight.livelock is not None,
        "separation": nearest.distance,
        "collided": nearest.distance < COLLISION_DISTANCE,
    }


@dataclass(eq=False)
class Flights:
    """
    Plans and flights of one UAV on a map of the panel; each is made once.

    Attributes
    ----------
    map
        The map.
    """

    map: PanelMap
    _made: dict[Any, Any] = field(default_factory=dict)

    def flown(self, of: Setup, *, k: float, radius: float, heeds_k: bool = True, **rules: Any) -> dict[str, Any]:  # noqa: ANN401
        """
        Return what is measured of a flight with limited sight.

        Parameters
        ----------
        of
            The planner.
        k
            Risk weight.
        radius
            Detection radius, map units.
        heeds_k
            Whether the planner weighs risk by `k`; else one flight serves all.
        **rules
            Of the mission.
        """
        key = (of, k if heeds_k else None, radius, tuple(rules.items()))
        if key not in self._made:
            solver = get(of[0], **dict(of[1]))
            limits = {"max_ticks": MAX_TICKS, **rules}
            flight = fly({"a": START}, self.map.field, self.map.goal, solver, k=k, radius=radius, **limits)
            one = flight.uavs["a"]
            self._made[key] = one, length_at_rim(self.map.field, np.asarray(one.path))
        one, rim = self._made[key]
        found = flight_measures(one, k)
        return {**found, "rim": rim if found["arrived"] else None}

    def planned(self, of: Setup, k: float) -> dict[str, Any]:
        """Return what is measured of a plan with all of the map known, and what planning took."""
        key = (of, k)
        if key not in self._made:
            problem = self.map.problem(k)
            self._made[key] = solve(problem, get(of[0], **dict(of[1])), resolution=paper_lattice())
        found = self._made[key]
        has_path = found.status.has_path
        return {
            "status": found.status.label,
            "arrived": has_path,
            **{name: float(getattr(found, name)) if has_path else None for name in ("length", "risk", "cost")},
            "seconds": found.total_seconds,
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


def risk_sum(threats: RiskField, path: FloatArray, step: float = STEP) -> float:
    """
    Return the paper's measure of risk for a planned path: the sum of ``F`` over its positions a step apart (E5).

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> risk_sum(RiskField([Threat(0.5, 0.5, 0.05)]), np.array([[0.1, 0.5], [0.9, 0.5]])).__round__(3)
    6.267
    """
    return float(threats.density(positions_at_steps(path, step)).sum())
