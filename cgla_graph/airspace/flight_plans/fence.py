"""Fences of flight plans: areas that the aircraft must stay inside of, and areas that it must stay out of."""

from dataclasses import dataclass

from cgla_graph._types import Point


@dataclass(frozen=True)
class FenceShape:
    """
    A polygon or a circle.

    Parameters
    ----------
    corners
        Longitude and latitude of each corner, degrees, without the first one again at the end; the centre of a circle.
    radius
        Radius of a circle, metres; 0 for a polygon.

    Examples
    --------
    >>> FenceShape(((24.0, 60.0),), 500.0).is_circle
    True
    """

    corners: tuple[Point, ...]
    radius: float = 0.0

    @property
    def is_circle(self) -> bool:
        """Whether it is a circle."""
        return self.radius > 0.0


@dataclass(frozen=True)
class Fence:
    """
    One rule of a fence.

    Parameters
    ----------
    name
        Its name in messages.
    inclusion
        Whether the aircraft must stay inside of the shapes, in any of them; else it must stay out of all of them.
    shapes
        At least one.

    Examples
    --------
    >>> Fence("the plan's fence", True, (FenceShape(((24.0, 60.0),), 500.0),)).inclusion
    True
    """

    name: str
    inclusion: bool
    shapes: tuple[FenceShape, ...]
