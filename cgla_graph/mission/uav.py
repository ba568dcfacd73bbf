"""One UAV of a mission: from where to where, how far it sees, how it weighs risk."""

from dataclasses import dataclass
from typing import cast

from cgla_graph._types import Point
from cgla_graph._validate import non_negative_number, point, positive_number
from cgla_graph.errors import MissionError, ProblemError
from cgla_graph.mission.world import whole_tick


@dataclass(frozen=True)
class Uav:
    """
    One UAV: from where to where, how far it sees, how it weighs risk.

    Attributes
    ----------
    name
        Its name; names in a mission differ.
    start, goal
        ``(x, y)``, map units.
    detection_radius
        The paper's OR, map units: a threat is seen when its centre is so near, a no-fly area when any part of it is.
    step
        What it flies in a tick, map units; None: the paper's 0.4 units (0.4/N on a unit map).
    k
        Its risk weight, at least 0.
    safe_distance
        The paper's SD, map units, below the detection radius; None: half the detection radius.
    departs
        The tick of take-off. On the ground it hears others but does not see, and nobody can meet it.

    Raises
    ------
    MissionError
        If a part is malformed.

    Examples
    --------
    >>> Uav("a", start=(0.1, 0.1), goal=(0.9, 0.9), detection_radius=0.2).safe_distance
    0.1
    """

    name: str
    start: Point
    goal: Point
    detection_radius: float
    step: float | None = None
    k: float = 10.0
    safe_distance: float | None = None
    departs: int = 0

    def __post_init__(self) -> None:
        """Check everything once."""
        if not isinstance(cast("object", self.name), str) or not self.name.strip():
            msg = f"a UAV's name is {self.name!r}; give a text"
            raise MissionError(msg)
        try:
            for name in ("start", "goal"):
                object.__setattr__(self, name, point(name, getattr(self, name)))
            radius = positive_number("detection_radius", self.detection_radius)
            object.__setattr__(self, "detection_radius", radius)
            if self.step is not None:
                object.__setattr__(self, "step", positive_number("step", self.step))
            object.__setattr__(self, "k", non_negative_number("k", self.k))
            safe = 0.5 * radius if self.safe_distance is None else self.safe_distance
            object.__setattr__(self, "safe_distance", positive_number("safe_distance", safe))
        except ProblemError as error:
            msg = f"UAV {self.name}: {error}"
            raise MissionError(msg) from error
        if self.safe >= radius:
            msg = (
                f"UAV {self.name}: safe_distance is {self.safe:g}, not below its detection_radius {radius:g}; "
                "it could not see in time what it must stay away from"
            )
            raise MissionError(msg)
        whole_tick(f"UAV {self.name}: departs", self.departs)

    @property
    def safe(self) -> float:
        """The safe distance, map units, given or by default."""
        return cast("float", self.safe_distance)
