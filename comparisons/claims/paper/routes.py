"""Routes in the paper's situations: planned with the whole map known, and flown with limited sight."""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray, Point
from cgla_graph.comparisons.claims.claim import require
from cgla_graph.comparisons.claims.panel.flights import N, fly, paper_lattice, risk_sum
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, GOALS, START
from cgla_graph.comparisons.missions.fly import open_mission
from cgla_graph.comparisons.study.mission_run import MissionRun, MissionSpec
from cgla_graph.mission.records import MissionStatus, UavFlight
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import solve


@dataclass(frozen=True, eq=False)
class Route:
    """
    A route from a start to the goal.

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
        """Its length, map units."""
        return float(np.hypot(*np.diff(self.path, axis=0).T).sum())

    @property
    def words(self) -> str:
        """Length and risk sum, as legends have them."""
        return f"{self.length:.3f} / {self.risk_sum:.3f}"


@dataclass(frozen=True, eq=False)
class Routes:
    """A method's route planned with the whole map known, None where not asked for, and flown with limited sight."""

    label: str
    offline: Route | None
    online: Route

    @property
    def words(self) -> str:
        """The line of a legend."""
        known = "" if self.offline is None else f"all known {self.offline.words}, "
        return f"{self.label}: {known}flown {self.online.words}"


#: Where the paper's flights end, and the detection radius here, as it prints none (E21), map units.
GOAL, RADIUS = GOALS["diagonal"], 0.2


def planned(field: RiskField, *, k: float, start: Point = START, n: int = N, solver: str = "cgla") -> Route:
    """
    Plan a route to the paper's goal with the whole map known; the start is a node of the lattice of n x n points.

    Raises
    ------
    AssertionError
        If there is none.
    """
    problem = Problem(start, GOAL, field, k=k, bounds=BOUNDS)
    solution = solve(problem, solver, resolution=paper_lattice(n))
    require(solution.status.has_path, f"{solver} finds no path: {solution.message or solution.status.value}")
    return Route(solution.path, risk_sum(field, solution.path))


def arrived(flight: UavFlight) -> Route:
    """
    Return the route of a flight.

    Raises
    ------
    AssertionError
        If it did not arrive: what was flown of it is no route to the goal.
    """
    require(flight.status is MissionStatus.ARRIVED, f"{flight.name} {flight.status.value}")
    return Route(flight.path, flight.risk_sum)


def flown(field: RiskField, *, k: float, n: int = N, solver: str = "cgla") -> Route:
    """Fly from the paper's start to its goal with limited sight."""
    return arrived(fly({"a": START}, field, GOAL, solver, k=k, radius=RADIUS, n=n).uavs["a"])


def both(label: str, field: RiskField, *, k: float, n: int = N) -> Routes:
    """Plan CGLA's route with the whole map known, and fly it with limited sight."""
    return Routes(label, planned(field, k=k, n=n), flown(field, k=k, n=n))


def for_weights() -> list[Routes]:
    """Return CGLA's routes on the reconstructed map of Fig. 5, for K = 10, 50 and 200."""
    return [both(f"K = {k:g}", paper_field(), k=k) for k in (10.0, 50.0, 200.0)]


def paper_field() -> RiskField:
    """Return the threats of the reconstructed map of Fig. 5, which was selected to agree with the paper."""
    return load_scenario("paper").problem.field


def of_flight(label: str, run: MissionRun, uav: str, *, solver: str = "cgla") -> Routes:
    """Plan a route with the whole map known beside what one UAV of a mission has flown."""
    flight = run.flight.uavs[uav]
    # the map when all has come up that does
    field = run.mission.world.field_at(max([0, *(int(one.appears) for one in run.mission.world.timed)]))
    best = planned(field, k=flight.uav.k, start=flight.uav.start, solver=solver)
    return Routes(label, best, arrived(flight))


@dataclass(frozen=True, eq=False)
class Escape:
    """The situation of Fig. 6: all threats, the sudden one, where the UAV is then, routes for K = 10 and 100."""

    field: RiskField
    sudden: TimedThreat
    start: Point
    routes: Sequence[Routes]


def escape() -> Escape:
    """Plan and fly the escape from the sudden threat of Fig. 6."""
    runs = runs_of("fig6")
    world, (uav,) = runs[0].mission.world, runs[0].mission.uavs
    (sudden,) = (one for one in world.timed if isinstance(one, TimedThreat))
    routes = [of_flight(run.variant, run, uav.name) for run in runs]
    return Escape(world.field_at(sudden.appears), sudden, uav.start, routes)


def runs_of(mission: str, *, solver: str | None = None) -> list[MissionRun]:
    """
    Fly all variants of a shipped mission, with another solver than its own if one is given.

    Examples
    --------
    >>> [run.variant for run in runs_of("fig6")]
    ['K = 10', 'K = 100']
    """
    _, specs = open_mission(mission, solver=solver)
    names = [one.name for one in dataclasses.fields(MissionSpec)]
    return [MissionRun(**{name: getattr(spec, name) for name in names}, flight=spec.mission.fly()) for spec in specs]
