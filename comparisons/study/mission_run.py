"""A mission with its name and map, before and after its flight: the input of tables, files and pictures."""

from collections.abc import Mapping
from dataclasses import dataclass, field

from cgla_graph.mission.mission import Mission
from cgla_graph.mission.records import Flight, MissionStatus
from cgla_graph.model.earth import LocalProjection


@dataclass(frozen=True, eq=False)
class MissionSpec:
    """
    A mission to be flown, with its names from the mission file.

    Attributes
    ----------
    name, variant
        Name of the mission, and of its variant; empty for a mission without variants.
    title
        One line that describes the mission.
    solver
        The planner, as the user or the file wrote it.
    mission
        The mission.
    projection
        Projection from longitude and latitude to metres; None for a map in the plane.
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
        """Suffix of lengths: the unit after a space; empty if it has no name."""
        return "" if self.projection is None else " m"


@dataclass(frozen=True, eq=False, kw_only=True)
class MissionRun(MissionSpec):
    """
    A mission with its flight.

    Attributes
    ----------
    flight
        The flight.
    ignorance, sharing
        The price of ignorance and the value of sharing of each UAV by name (see `Flight`); None where not computed, or
        where UAVs share nothing.
    bounds
        The lower bound of the cost of each UAV by name (`Flight.lower_bounds`); None where not computed.
    seconds
        Computing time.
    """

    flight: Flight
    ignorance: Mapping[str, float] | None = None
    sharing: Mapping[str, float] | None = None
    bounds: Mapping[str, float] | None = None
    seconds: float = field(default=0.0)

    @property
    def n_arrived(self) -> int:
        """Number of UAVs that arrived."""
        return sum(uav.status is MissionStatus.ARRIVED for uav in self.flight.uavs.values())
