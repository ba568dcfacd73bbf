"""Areas that are closed for a time, in planning and in missions."""

from collections.abc import Iterable
from dataclasses import dataclass

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import ShortRepr, shown
from cgla_graph._validate import error_context, finite_number
from cgla_graph.errors import MissionError
from cgla_graph.model.no_fly import NoFlyArea


@dataclass(frozen=True, eq=False)
class TimedArea(ShortRepr):
    """
    A no-fly area that appears or vanishes.

    It is closed at times ``appears <= t < vanishes``. As with other areas, only its inside is forbidden: a path may
    touch its border at any time. A path that is inside at the instant when the area closes is not feasible, and one
    that departs inside at the instant when it opens is.

    Attributes
    ----------
    polygon
        A shapely polygon or multipolygon, map units.
    appears, vanishes
        When it closes, and when it opens again (None: never): times of a `TimedProblem`, or whole ticks of a mission.

    Raises
    ------
    MissionError
        If `polygon` is not a polygon, or a time is not a finite number, or it vanishes before it appears.

    Examples
    --------
    >>> TimedArea(shapely.box(0, 0, 1, 1), appears=5).is_there(4)
    False
    """

    polygon: BaseGeometry
    appears: float = 0
    vanishes: float | None = None

    def __post_init__(self) -> None:
        """Check the parts."""
        with error_context("a timed area"):
            empty = NoFlyArea(self.polygon).is_empty
            for name in ("appears", "vanishes"):
                if getattr(self, name) is not None:
                    finite_number(name, getattr(self, name))
        if empty:
            msg = f"a timed area is {shown(self.polygon)}; give a polygon with an inside"
            raise MissionError(msg)
        if self.vanishes is not None and self.vanishes <= self.appears:
            msg = (
                f"a timed area vanishes at {self.vanishes:g}, not after it appears at {self.appears:g}; "
                "let it vanish later"
            )
            raise MissionError(msg)

    def is_there(self, time: float) -> bool:
        """Return whether the area is closed at a time."""
        return self.appears <= time and (self.vanishes is None or time < self.vanishes)

    @property
    def changes(self) -> list[float]:
        """The times at which it appears or vanishes."""
        return [self.appears] if self.vanishes is None else [self.appears, self.vanishes]


def union_of(no_fly: BaseGeometry | None, areas: Iterable[BaseGeometry]) -> BaseGeometry | None:
    """
    Collect areas in one geometry; a single area stays the same object, so that it is indexed once.

    Examples
    --------
    >>> union_of(None, []) is None
    True
    """
    parts = [part for part in (no_fly, *areas) if part is not None]
    if len(parts) <= 1:
        return parts[0] if parts else None
    return shapely.GeometryCollection(parts)
