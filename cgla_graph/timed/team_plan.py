"""The answer for a team: flights that keep apart, what they cost together, and how good that is."""

import math
from dataclasses import dataclass

from cgla_graph._text import ShortRepr
from cgla_graph.model.solution import Status, gap_between
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.timed.timed_plan import TimedPlan


@dataclass(frozen=True, eq=False)
class TeamPlan(ShortRepr):
    """
    Flights of a team in one airspace, in the order of its problems.

    Attributes
    ----------
    status
        How the search ended.
    plans
        One flight each; its problem has the trajectories of all others. Empty without flights that keep apart.
    alone
        The best flight found for each without the team, and its proven bound.
    separation
        The least distance that was asked for, map units.
    least_distance
        Of any two, while both fly, map units; infinite if none fly together, NaN without flights.
    order
        The order in which the flights were planned, each around those before it.
    orders
        How many orders were tried.
    seconds
        Time to plan and to prove.
    message
        What was done, in one line.

    Examples
    --------
    >>> import numpy as np
    >>> east = TimedPlan(Status.FOUND, np.array([[0.0, 0, 0], [1.0, 1, 0]]), cost=1.0, lower_bound=0.9)
    >>> north = TimedPlan(Status.FOUND, np.array([[2.0, 0, 0], [3.0, 0, 1]]), cost=1.1, lower_bound=1.1)
    >>> team = TeamPlan(Status.FOUND, (east, north), (east, north), separation=0.1)
    >>> team.cost, team.lower_bound, round(team.gap, 3)
    (2.1, 2.0, 0.05)
    """

    status: Status
    plans: tuple[TimedPlan, ...] = ()
    alone: tuple[TimedPlan, ...] = ()
    separation: float = 0.0
    least_distance: float = math.nan
    order: tuple[int, ...] = ()
    orders: int = 0
    seconds: float = 0.0
    message: str = ""

    @property
    def cost(self) -> float:
        """The sum of the costs; infinite without flights."""
        return sum(plan.cost for plan in self.plans) if self.plans else math.inf

    @property
    def lower_bound(self) -> float:
        """The sum of the bounds that are proven for each flight without the team; NaN where one is missing."""
        return sum(plan.lower_bound for plan in self.alone) if self.alone else math.nan

    @property
    def gap(self) -> float:
        """The greatest possible excess over the best team, ``cost / lower_bound - 1``; NaN without a bound."""
        return gap_between(self.cost, self.lower_bound)

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The flights as trajectories, from departure to arrival."""
        return tuple(plan.motion for plan in self.plans)
