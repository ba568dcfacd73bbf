"""UAVs of a mission."""

import re
from dataclasses import dataclass
from typing import cast

from cgla_graph._text import shown
from cgla_graph._types import Point
from cgla_graph._validate import error_context, non_negative_number, point, positive_number, whole_tick
from cgla_graph.errors import MissionError

#: Pattern of a colour.
COLOUR = r"#[0-9a-fA-F]{6}"


@dataclass(frozen=True, init=False)
class Uav:
    """
    A UAV: its start and goal, its sensor and its risk weight.

    Attributes
    ----------
    name
        Its name, unique in a mission.
    start, goal
        ``(x, y)``, map units.
    detection_radius
        The paper's OR, map units: it sees a threat when the centre is within it, a no-fly area when any part is.
    step
        The length it flies in a tick, map units; None: the paper's 0.4 units (0.4/N on a unit map).
    k
        Its risk weight, at least 0.
    safe_distance
        The paper's SD, map units, below the detection radius; given as None: half the detection radius.
    departs
        The tick of take-off. It waits while an area is closed over its start, or another UAV is within the safe
        distance of it. On the ground it hears others but does not see, and no UAV can collide with it.
    colour
        Its colour in pictures, as ``"#0072B2"``; None: the next colour of a palette.

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
    step: float | None
    k: float
    safe_distance: float
    departs: int
    colour: str | None

    def __init__(
        self,
        name: str,
        start: Point,
        goal: Point,
        detection_radius: float,
        step: float | None = None,
        k: float = 10.0,
        safe_distance: float | None = None,
        departs: int = 0,
        colour: str | None = None,
    ) -> None:
        """Check everything once."""
        if not isinstance(cast("object", name), str) or not name.strip():
            msg = f"a UAV's name is {shown(name)}; give a text"
            raise MissionError(msg)
        with error_context(f"UAV {name}"):
            if colour is not None and not re.fullmatch(COLOUR, str(colour)):
                msg = f"colour is {shown(colour)}; give six hexadecimal digits behind a #, as '#0072B2'"
                raise MissionError(msg)
            radius = positive_number("detection_radius", detection_radius)
            safe = 0.5 * radius if safe_distance is None else safe_distance
            # (a frozen dataclass refuses assignments)
            self.__dict__.update(
                name=name,
                start=point("start", start),
                goal=point("goal", goal),
                detection_radius=radius,
                step=None if step is None else positive_number("step", step),
                k=non_negative_number("k", k),
                safe_distance=positive_number("safe_distance", safe),
                departs=whole_tick("departs", departs),
                colour=colour,
            )
            if self.safe_distance >= radius:
                msg = (
                    f"safe_distance is {self.safe_distance:g}, not below its detection_radius {radius:g}; "
                    "it would sense others too late to keep its distance"
                )
                raise MissionError(msg)
