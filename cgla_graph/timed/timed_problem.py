"""Problems in space and time, and the oracle that evaluates every timed path."""

import dataclasses
import math
from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._types import FloatArray
from cgla_graph._validate import finite_number, instance, point_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.timed.timed_evaluation import Timed, TimedEvaluation, timed_rows
from cgla_graph.timed.timed_faults import nearest_area, nearest_other, out_of_time, outside
from cgla_graph.timed.timed_flight import flown, flown_leg
from cgla_graph.timed.timed_map import TimedMap
from cgla_graph.timed.tolls import Toll
from cgla_graph.timed.wind import ground_speeds


class TimedProblem(TimedMap):
    """
    A path to plan in space and time, while threats move, areas open and close, and the wind blows.

    The aircraft flies at constant airspeed. A path is feasible if it departs in time, stays inside the bounds and
    outside the areas that are closed; it may cross itself, and loops are paths too. Its cost is ``air_distance + k *
    risk``: in still air and with nothing that moves, that of the `Problem`.

    Parameters
    ----------
    start, goal, field
        As of a `Problem`, as are `k`, `bounds`, `no_fly`, `clearance` and `projection`: what does not change.
    moving
        Threats that move. At each time, the risk is that of all threats together (Eq. 2), and that of rasters is
        added: `field_at`.
    areas
        Areas that are closed for a time. The clearance counts for them too while they are closed.
    speed
        Airspeed, map units per unit of time, above 0.
    k, bounds
        See above.
    departure
        When the path begins: a time, or the first and last of a window. Time before the departure costs nothing.
    wind
        ``(u, v)``: where the air goes, map units per unit of time; or a `Wind` that changes in space and time; None:
        still air.
    no_fly
        See above.
    fields
        Fields that replace `field` from a time on, as rasters by the hour: pairs ``(t, field)``, in order of time.
    waiting
        The price of a unit of time spent waiting in one place, above 0: `speed` prices it as flight. None: an aircraft
        that cannot wait. The wind must not be stronger than the speed, and risk counts as in flight in still air.
    latest
        The latest arrival; None: any.
    clearance
        See above.
    others, separation
        Trajectories of others, and the least distance from each of them while it lasts, map units.
    risk_per
        ``ground``: risk is gathered over the ground distance, as where people on the ground are at risk. ``time``: per
        unit of time; the field is then in risk per unit of time.
    projection
        See above.

    Raises
    ------
    ProblemError
        If a part is malformed.

    Examples
    --------
    >>> from cgla_graph.timed.moving import MovingThreat
    >>> storm = MovingThreat([(0, 0.5, 0.9), (1, 0.5, 0.1)], spread=0.1)
    >>> problem = TimedProblem((0.1, 0.5), (0.9, 0.5), moving=[storm], k=5.0, speed=0.8)
    >>> straight = problem.evaluate([(0, 0.1, 0.5), (1, 0.9, 0.5)])
    >>> round(straight.cost, 4), straight.feasible
    (1.6862, True)
    """

    @classmethod
    def of(cls, problem: Problem, **settings: Any) -> "TimedProblem":  # noqa: ANN401 - settings of this class
        """
        Return the timed problem of a problem in the plane, with settings of what changes and of how it is flown.

        Examples
        --------
        >>> TimedProblem.of(Problem((0, 0), (1, 1), k=5.0), speed=2.0, wind=(1, 0)).k
        5.0
        """
        instance("problem", problem, Problem, problem_wanted)
        names = ("start", "goal", "field", "k", "bounds", "no_fly", "clearance", "projection")
        return cls(**{name: getattr(problem, name) for name in names}, **settings)

    def fly(self, path: ArrayLike, departure: float | None = None) -> FloatArray:
        """
        Return the timed path along waypoints, without waiting.

        Parameters
        ----------
        path
            Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units. Legs that take no time are left out.
        departure
            When it begins; None: at the first departure.

        Returns
        -------
        trajectory
            Rows ``(t, x, y)``.

        Raises
        ------
        ProblemError
            If the path is malformed, or the wind is too strong for a leg.

        Examples
        --------
        >>> TimedProblem((0, 0), (1, 0), speed=2, wind=(1, 0)).fly([(0, 0), (0.75, 0), (0, 0)]).tolist()
        [[0.0, 0.0, 0.0], [0.25, 0.75, 0.0], [1.0, 0.0, 0.0]]
        """
        waypoints = point_array("path", path)
        if waypoints.ndim != 2 or not len(waypoints):  # noqa: PLR2004 - a list of points
            msg = f"path has shape {waypoints.shape}; give at least one waypoint, shape (m, 2)"
            raise ProblemError(msg)
        begins = self.departures[0] if departure is None else finite_number("departure", departure)
        waypoints = waypoints[np.append(True, (np.diff(waypoints, axis=0) != 0.0).any(axis=1))]
        times = begins + self._durations(begins, waypoints)
        # (of several waypoints that rounding puts at one time, the last one counts, but the first of all stays)
        kept = np.append(np.diff(times) > 0.0, True)
        rows: FloatArray = np.column_stack([times, waypoints])[kept]
        rows[0, 1:] = waypoints[0] if len(rows) > 1 else waypoints[-1]
        return rows

    def evaluate(self, trajectory: Timed) -> TimedEvaluation:
        """
        Evaluate any timed path: the oracle that judges all solvers.

        Between two rows, it moves straight on at constant speed, or waits if the places are equal. Times that differ
        from those of the flight by less than 1e-9 of the time since departure count as equal; the flight's are used.

        Parameters
        ----------
        trajectory
            Rows ``(t, x, y)``, shape ``(m, 3)`` with ``m >= 1``, times increasing; or a `Trajectory`. It need not join
            start and goal.

        Returns
        -------
        evaluation
            Times, distances, risk and cost, and why the path is infeasible. The cost is within 1e-9 of itself.

        Raises
        ------
        ProblemError
            If the rows are malformed.

        Examples
        --------
        >>> import shapely
        >>> from cgla_graph.timed.timed_area import TimedArea
        >>> gate = TimedArea(shapely.box(0.4, -1, 0.6, 2), appears=0, vanishes=2)
        >>> problem = TimedProblem((0.1, 0.5), (0.9, 0.5), areas=[gate], speed=0.1, waiting=0.05)
        >>> problem.evaluate(problem.fly([(0.1, 0.5), (0.9, 0.5)])).feasible
        True
        >>> problem.evaluate([(0, 0.35, 0.5), (5.5, 0.9, 0.5)]).violations
        ('leg 0 crosses a closed area after time 0',)
        """
        given = timed_rows(trajectory)
        flight = flown(self, given)
        rows = flight.rows
        risk = float(flight.risks.sum())
        price = self.speed if self.waiting is None else self.waiting
        clearance, crossed = nearest_area(self, flight)
        separation, met = nearest_other(self, flight)
        return TimedEvaluation(
            departure=float(rows[0, 0]),
            arrival=float(rows[-1, 0]),
            air_distance=flight.air_distance,
            ground_distance=float(np.hypot(*np.diff(rows[:, 1:], axis=0).T).sum()),
            waiting=flight.waited,
            risk=risk,
            cost=flight.air_distance
            + price * flight.waited
            + self.k * risk
            + sum(toll.paid(Trajectory(given[:, 0], given[:, 1:])) for toll in self.tolls),
            clearance=clearance,
            separation=separation,
            violations=(*out_of_time(self, rows), *outside(self, rows), *flight.faults, *crossed, *met),
        )

    def _durations(self, begins: float, waypoints: FloatArray) -> FloatArray:
        """Return how long after the departure each waypoint is reached."""
        steps = np.diff(waypoints, axis=0)
        if self.constant_wind is not None:
            needed = np.hypot(*steps.T) / ground_speeds(steps, self.constant_wind, self.speed)
            since = np.append(0.0, np.cumsum(needed))
        else:
            since = np.zeros(len(waypoints))
            for number in range(len(steps)):
                leg = waypoints[number : number + 2]
                since[number + 1] = flown_leg(self, begins + since[number], leg, with_risk=False)[0][-1, 0] - begins
                if not math.isfinite(since[number + 1]):
                    break
            needed = np.diff(since)
        weak = np.nonzero(~((needed > 0.0) & (needed < math.inf)))[0]
        if len(weak):
            msg = (
                f"leg {weak[0]} cannot be flown: the wind is too strong for airspeed {self.speed:g}; "
                "fly another way, or faster"
            )
            raise ProblemError(msg)
        return since


def tolled(problem: TimedProblem, tolls: Iterable[Toll]) -> TimedProblem:
    """Return a problem whose costs count tolls too; not in changing wind, and no planner looks at them."""
    made = dataclasses.replace(problem)
    object.__setattr__(made, "tolls", tuple(tolls))
    return made
