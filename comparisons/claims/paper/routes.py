"""Ways in the paper's situations: planned with the whole map known, and flown with limited sight."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.paper.flights import BOUNDS, GOAL, START, N, fly_alone, paper_lattice, risk_sum
from cgla_graph.comparisons.missions.fly import open_mission
from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get, solve


@dataclass(frozen=True, eq=False)
class Way:
    """
    A way from a start to the goal.

    Attributes
    ----------
    path
        Waypoints, shape ``(m, 2)``, map units.
    risk_sum
        The paper's measure of risk: the sum of ``F`` over positions 0.02 apart (E5).
    """

    path: FloatArray
    risk_sum: float

    @property
    def length(self) -> float:
        """
        Its length, map units.

        Examples
        --------
        >>> Way(np.array([[0.0, 0.0], [0.3, 0.4]]), 0.0).length
        0.5
        """
        return float(np.hypot(*np.diff(self.path, axis=0).T).sum())

    @property
    def words(self) -> str:
        """Length and risk sum, as legends have them."""
        return f"{self.length:.3f} / {self.risk_sum:.3f}"


@dataclass(frozen=True, eq=False)
class Ways:
    """
    What there is of one method in one situation.

    Attributes
    ----------
    label
        What it is called.
    offline
        Planned with the whole map known; None where that is not asked for.
    online
        Flown with limited sight.
    """

    label: str
    offline: Way | None
    online: Way

    @property
    def words(self) -> str:
        """The line of a legend."""
        known = "" if self.offline is None else f"all known {self.offline.words}, "
        return f"{self.label}: {known}flown {self.online.words}"


def planned(field: RiskField, *, k: float, start: Point = START, n: int = N, solver: str = "cgla") -> Way:
    """
    Plan a way to the paper's goal with the whole map known.

    Parameters
    ----------
    field
        All threats.
    k
        Risk weight.
    start
        Map units; a node of its own on the lattice.
    n
        Points a side of the lattice.
    solver
        What plans.

    Raises
    ------
    AssertionError
        If it finds no path.

    Examples
    --------
    >>> round(planned(RiskField(), k=10.0).length, 4)
    1.1314
    """
    problem = Problem(start, GOAL, field, k=k, bounds=BOUNDS)
    solution = solve(problem, get(solver), resolution=paper_lattice(n))
    require(solution.status.has_path, f"{solver} finds no way: {solution.message or solution.status.value}")
    return Way(solution.path, risk_sum(field, solution.path))


def flown(
    field: RiskField,
    *,
    k: float,
    start: Point = START,
    n: int = N,
    solver: str = "cgla",
    timed: Sequence[TimedThreat] = (),
) -> Way:
    """
    Fly to the paper's goal with limited sight; parameters as of `planned`, and threats that come up under way.

    Raises
    ------
    AssertionError
        If the flight does not arrive.
    """
    return arrived(fly_alone(field, k=k, start=start, n=n, solver=get(solver), timed=timed))


def arrived(flight: UavFlight) -> Way:
    """
    Return the way of a flight.

    Raises
    ------
    AssertionError
        If it did not arrive: what was flown of it is no way to the goal.
    """
    require(flight.status is MissionStatus.ARRIVED, f"{flight.name} {flight.status.value}")
    return Way(flight.path, flight.risk_sum)


def of_weights(weights: Sequence[float]) -> list[Ways]:
    """
    Return CGLA's ways on the reconstructed map of Fig. 5, one for each K.

    Examples
    --------
    >>> (way,) = of_weights([200.0])
    >>> way.label, way.online.risk_sum < 0.3
    ('K = 200', True)
    """
    field = paper_field()
    return [Ways(f"K = {k:g}", planned(field, k=k), flown(field, k=k)) for k in weights]


def paper_field() -> RiskField:
    """Return the threats of the reconstructed map of Fig. 5, which was selected to agree with the paper."""
    return load_scenario("paper").problem.field


@dataclass(frozen=True, eq=False)
class Escape:
    """
    The situation of Fig. 6: a sudden threat.

    Attributes
    ----------
    field
        All threats, the sudden one too.
    sudden
        The sudden one.
    start
        Where the UAV is when it appears, map units.
    ways
        For K = 10 and 100.
    """

    field: RiskField
    sudden: TimedThreat
    start: Point
    ways: Sequence[Ways]


def escape() -> Escape:
    """
    Plan and fly the escape from the sudden threat of Fig. 6.

    Examples
    --------
    >>> [way.label for way in escape().ways]
    ['K = 10', 'K = 100']
    """
    views = fly("fig6")
    world, start = views[0].mission.world, views[0].mission.uavs[0].start
    (sudden,) = (one for one in world.timed if isinstance(one, TimedThreat))
    field = world.field_at(sudden.appears)
    found = []
    for view in views:
        (flight,) = view.flight.uavs.values()
        found.append(Ways(view.variant, planned(field, k=flight.uav.k, start=start), arrived(flight)))
    return Escape(field, sudden, start, found)


def fly(mission: str, *, solver: str | None = None) -> list[MissionRun]:
    """
    Fly all variants of a shipped mission.

    Parameters
    ----------
    mission
        Its name.
    solver
        What plans, instead of what the file says.

    Examples
    --------
    >>> [view.variant for view in fly("fig6")]
    ['K = 10', 'K = 100']
    """
    _, specs = open_mission(mission, solver=solver)
    names = [one.name for one in dataclasses.fields(MissionSpec)]
    return [MissionRun(**{name: getattr(spec, name) for name in names}, flight=spec.mission.fly()) for spec in specs]
