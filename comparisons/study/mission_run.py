"""A mission with its name and its map, before and after it is flown: what tables, files and pictures are made of."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field

from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus
from cgla_graph.model.earth import LocalProjection


@dataclass(frozen=True, eq=False)
class MissionSpec:
    """
    A mission to be flown, and what its file says beside it.

    Attributes
    ----------
    name, variant
        Of the mission, and of its variant; empty for a mission that has none.
    title
        One line that says what the mission shows.
    solver
        What plans, as the user or the file wrote it.
    mission
        The mission.
    projection
        How longitude and latitude became metres; None for a map in the plane.
    """

    name: str
    variant: str
    title: str
    solver: str
    mission: Mission
    projection: LocalProjection | None = None

    @property
    def label(self) -> str:
        """Name and variant in one line."""
        return f"{self.name}, {self.variant}" if self.variant else self.name

    @property
    def unit(self) -> str:
        """The unit of lengths, to follow a number; empty where it has no name."""
        return "" if self.projection is None else " m"


@dataclass(frozen=True, eq=False, kw_only=True)
class MissionRun(MissionSpec):
    """
    A mission that was flown.

    Attributes
    ----------
    flight
        What it came to.
    ignorance, sharing
        The price of ignorance and the value of sharing of each UAV by name (see `Flight`); None where that was not
        asked for, or nothing is shared.
    seconds
        How long flying took.
    """

    flight: Flight
    ignorance: Mapping[str, float] | None = None
    sharing: Mapping[str, float] | None = None
    seconds: float = field(default=0.0)

    @property
    def n_arrived(self) -> int:
        """How many UAVs arrived."""
        return sum(uav.status is MissionStatus.ARRIVED for uav in self.flight.uavs.values())


def team_totals(flight: Flight) -> dict[str, float]:
    """Return what all UAVs of a flight flew together; the cost is infinite unless all arrived."""
    uavs = flight.uavs.values()
    sums = {name: math.fsum(getattr(uav, name) for uav in uavs) for name in ("length", "risk", "risk_sum")}
    return {"cost": flight.cost, **sums}
