"""The answer for a team: flights that keep apart, what they cost together, and how good that is."""

import math
import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from cgla_graph._display import Plottable
from cgla_graph._text import json_number
from cgla_graph.model.solution import Status, gap_between
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.timed.timed_plan import TimedPlan, write_flights


@dataclass(frozen=True, eq=False)
class TeamPlan(Plottable):
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
    names
        Of the UAVs, for pictures and files; empty: their numbers, from 0 on.
    apart
        A proven bound that counts what it costs to keep apart where flights meet (`tolls`); NaN where there is none.

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
    names: tuple[str, ...] = ()
    apart: float = math.nan

    def __post_init__(self) -> None:
        """Name the UAVs."""
        object.__setattr__(self, "names", self.names or tuple(map(str, range(len(self.alone)))))

    @property
    def cost(self) -> float:
        """The sum of the costs; infinite without flights."""
        return sum(plan.cost for plan in self.plans) if self.plans else math.inf

    @property
    def lower_bound(self) -> float:
        """Proven: `alone_bound`, or `apart` if that is higher."""
        # (the one that is not a number comes last)
        return max(self.alone_bound, self.apart)

    @property
    def alone_bound(self) -> float:
        """The sum of the bounds that are proven for each flight without the team; NaN where one is missing."""
        return sum(plan.lower_bound for plan in self.alone) if self.alone else math.nan

    @property
    def gap(self) -> float:
        """The greatest possible excess over the best team, ``cost / lower_bound - 1``; NaN without a bound."""
        return gap_between(self.cost, self.lower_bound)

    @property
    def loss(self) -> float:
        """What the flights lose to meetings: the cost over that of the flights alone, minus 1; NaN without flights."""
        return gap_between(self.cost, sum(plan.cost for plan in self.alone)) if self.plans else math.nan

    @property
    def trajectories(self) -> tuple[Trajectory, ...]:
        """The flights as trajectories, from departure to arrival."""
        return tuple(plan.motion for plan in self.plans)

    def save(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the flights with their times, as `TimedPlan.save`: with a column ``uav``, or a feature for each UAV.

        Raises
        ------
        OutputError
            As `TimedPlan.save`.
        """
        return write_flights(file, dict(zip(self.names, self.plans, strict=False)), self.document())

    def document(self) -> dict[str, Any]:
        """Return all of it as JSON: numbers of the team, and of each UAV its flight and that without the team."""
        names = ("cost", "lower_bound", "alone_bound", "gap", "loss", "separation", "least_distance")
        numbers = {name: json_number(getattr(self, name)) for name in names}
        uavs = [
            {"name": name, **(self.plans[i].document() if self.plans else {}), "alone": self.alone[i].numbers()}
            for i, name in enumerate(self.names)
        ]
        return {"status": self.status.label, **numbers, "order": [self.names[i] for i in self.order], "uavs": uavs}
