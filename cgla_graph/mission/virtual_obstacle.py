"""Virtual obstacles (Section 5.2.1): other UAVs as threats, at their positions or ahead of them."""

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Literal, TypeAlias, get_args

from cgla_graph._text import shown
from cgla_graph._types import Point
from cgla_graph._validate import error_context, is_one_of, positive_number, whole_number
from cgla_graph.errors import MissionError
from cgla_graph.model.risk import Threat

#: Length of a step of a UAV, and of the paper's look-ahead, in units.
UNITS_A_STEP = 0.4

#: A longer look-ahead is refused.
MOST_STEPS = 10_000

Placement: TypeAlias = Literal["replace", "add"]
Zones: TypeAlias = Literal["two", "near"]


@dataclass(frozen=True)
class VirtualObstacle:
    """
    The two-zone rule, by which a UAV plans around the others that it sees.

    Another UAV between the safe distance SD and the detection radius is a threat at its position. Nearer than SD, the
    threat is `stepnum` steps ahead of it, along its last displacement. The rule guarantees nothing: UAVs that follow it
    may still collide, or block each other without end (`avoidance="prioritized"` keeps them apart).

    Attributes
    ----------
    stepnum
        How many steps of 0.4 units the obstacle is ahead, at least 0; a unit is the paper's 1/N, a side of the map
        over the lattice points on it.
    spread
        Standard deviation of the obstacle, map units; None: one step of 0.4 units (0.02 at N = 20).
    peak
        Its risk per unit length at the centre, in (0, 1].
    placement
        Nearer than SD: ``replace`` the threat at the position by the one ahead (the default), or ``add`` it.
    zones
        ``two``: as above. ``near``: UAVs farther than SD do not count.

    Raises
    ------
    MissionError
        If a number is out of range or an option unknown.

    Examples
    --------
    >>> rule, sight = VirtualObstacle(stepnum=3), {"detection_radius": 0.2, "safe_distance": 0.1, "unit": 0.05}
    >>> [rule.around((0, 0), [((x, 0), (0, 1))], **sight)[0].y for x in (0.15, 0.05)]
    [0.0, 0.06]
    """

    stepnum: int = 3
    spread: float | None = None
    peak: float = 1.0
    placement: Placement = "replace"
    zones: Zones = "two"

    def __post_init__(self) -> None:
        """Check the settings."""
        with error_context("virtual obstacle"):
            whole_number("stepnum", self.stepnum, at_least=0, at_most=MOST_STEPS)
            if self.spread is not None:
                object.__setattr__(self, "spread", positive_number("spread", self.spread))
            object.__setattr__(self, "peak", positive_number("peak", self.peak))
            if self.peak > 1.0:
                msg = f"peak is {self.peak:g}; it must be at most 1"
                raise MissionError(msg)
            for name, choices in (("placement", get_args(Placement)), ("zones", get_args(Zones))):
                if not is_one_of(getattr(self, name), choices):
                    msg = f"unknown {name} {shown(getattr(self, name))}; choose {' or '.join(choices)}"
                    raise MissionError(msg)

    @classmethod
    def parse(cls, value: object) -> "VirtualObstacle | None":
        """
        Return the rule that a user gives: itself, True for its defaults, None or False for no rule.

        Raises
        ------
        MissionError
            If `value` is none of these.
        """
        if isinstance(value, VirtualObstacle):
            return value
        if value is None or isinstance(value, bool):
            return cls() if value else None
        msg = f"virtual_obstacle is {shown(value)}; give a VirtualObstacle, or True for its defaults"
        raise MissionError(msg)

    def around(
        self,
        position: Point,
        others: Iterable[tuple[Point, Point]],
        *,
        detection_radius: float,
        safe_distance: float,
        unit: float,
    ) -> tuple[Threat, ...]:
        """
        Return the virtual obstacles that a UAV plans around.

        Parameters
        ----------
        position
            Its position, map units.
        others
            Position and heading of each other UAV in the air; a heading has length 1, or is (0, 0) before the first
            move.
        detection_radius, safe_distance
            OR and SD, map units.
        unit
            The paper's 1/N, map units.

        Returns
        -------
        obstacles
            As threats; none for UAVs out of sight.
        """
        spread = UNITS_A_STEP * unit if self.spread is None else self.spread
        ahead = self.stepnum * UNITS_A_STEP * unit
        obstacles = []
        for (x, y), (east, north) in others:
            distance = math.hypot(x - position[0], y - position[1])
            if distance > detection_radius:
                continue
            near = distance < safe_distance
            if not near and self.zones == "near":
                continue
            if not near or self.placement == "add":
                obstacles.append(Threat(x, y, spread=spread, peak=self.peak))
            if near:
                obstacles.append(Threat(x + ahead * east, y + ahead * north, spread=spread, peak=self.peak))
        return tuple(obstacles)
