"""What pictures of missions have in common: colours of UAVs, no-fly areas, and threats that come and go."""

from collections.abc import Iterable, Iterator, Sequence
from typing import Any, TypeAlias

import numpy as np
import shapely
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch
from matplotlib.path import Path as Outline
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, Point
from cgla_graph.comparisons.plots.looks import COLOURS, DASHES, Dashes
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedArea, TimedThreat, World

#: Settings of something that is drawn, as matplotlib names them.
Look: TypeAlias = dict[str, Any]

#: The colour of what is close, and of what comes and goes: no UAV has either.
NEAR_COLOUR, TIMED_COLOUR = "#D55E00", "#8A3A00"
#: A threat is outlined at this many spreads from its centre.
OUTLINE_SPREADS = 1.5
#: How the inside of areas looks.
AREA_LOOK: Look = {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "////", "linewidth": 0.0}
#: How the outline of threats and areas looks that come and go, and how it is explained.
TIMED_LOOK: Look = {"edgecolor": TIMED_COLOUR, "linewidth": 0.9, "linestyle": (0, (4, 2))}
#: The lines and hatches of circles: how far a UAV sees, its safe distance, a virtual obstacle.
SIGHT_DASHES, SAFE_DASHES, OBSTACLE_HATCH = (0, (5, 3)), (0, (1, 1.5)), "xxxxx"
#: An arrowhead of length 1 that points east, around its middle.
_ARROW = Outline([(-0.5, -0.42), (0.5, 0.0), (-0.5, 0.42), (-0.25, 0.0), (-0.5, -0.42)], closed=True)


def colour_of(number: int) -> str:
    """
    Return the colour of a UAV.

    Examples
    --------
    >>> colour_of(0), colour_of(0) == colour_of(len(COLOURS))
    ('#0072B2', True)
    """
    return COLOURS[number % len(COLOURS)]


def dashes_of(number: int) -> Dashes:
    """Return the dashes of a UAV's trace: solid until the colours are used up."""
    return DASHES[number // len(COLOURS) % len(DASHES)]


def arrowhead(east: float, north: float) -> Outline:
    """
    Return a marker that points into a direction.

    Parameters
    ----------
    east, north
        The direction; if both are 0, it points east.
    """
    # scaled first: the squares of the least numbers that there are vanish, and their quotients have no digits
    largest = max(abs(east), abs(north))
    cos, sin = (east / largest, north / largest) if largest > 0.0 else (1.0, 0.0)
    length = float(np.hypot(cos, sin))
    cos, sin = cos / length, sin / length
    turned = np.asarray(_ARROW.vertices) @ np.array([[cos, sin], [-sin, cos]])
    return Outline(turned, _ARROW.codes)


def outline(area: BaseGeometry, scale: float) -> Outline:
    """
    Return the rings of all polygons in a geometry; holes run the other way round than shells, so that they stay empty.

    Parameters
    ----------
    area
        Polygons, or a collection of them.
    scale
        What coordinates are multiplied with.

    Examples
    --------
    >>> len(outline(shapely.box(0, 0, 1, 1), 1.0).vertices)
    5
    """
    parts = [part for part in shapely.get_parts(shapely.union_all([area])) if part.geom_type == "Polygon"]
    rings = [ring for part in map(shapely.normalize, parts) for ring in (part.exterior, *part.interiors)]
    return Outline.make_compound_path(*(Outline(np.asarray(ring.coords) * scale, closed=True) for ring in rings))


def draw_area(axes: Axes, area: BaseGeometry, scale: float, *, timed: bool = False) -> list[Artist]:
    """Draw a no-fly area: hatched, with a dashed outline if it comes or goes."""
    rings = outline(area, scale)
    edge: Look = {"edgecolor": TIMED_COLOUR, "linestyle": (0, (4, 2))} if timed else {"edgecolor": "0.25"}
    # two patches, as the hatch of one has the colour of its edge
    inside = PathPatch(rings, **AREA_LOOK, zorder=2.0)
    border = PathPatch(rings, facecolor="none", linewidth=0.9 if timed else 0.7, **edge, zorder=2.1)
    return [axes.add_patch(inside), axes.add_patch(border)]


def draw_ring(axes: Axes, place: Point, radius: float, **look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
    """Draw an empty circle, in units of the axes."""
    return axes.add_patch(Circle(place, radius, **({"facecolor": "none"} | look)))


def draw_ends(axes: Axes, uavs: Sequence[Uav], scale: float, *, size: float, zorder: float) -> list[Artist]:
    """Draw starts (circles) and goals (stars) of UAVs; where several share one, that of the first is on top."""
    marks: list[Artist] = []
    for number, uav in enumerate(uavs):
        for end, marker, width in ((uav.start, "o", size), (uav.goal, "*", 1.8 * size)):
            marks += axes.plot(
                end[0] * scale,
                end[1] * scale,
                linestyle="none",
                marker=marker,
                markersize=width,
                markerfacecolor="white",
                markeredgecolor=colour_of(number),
                markeredgewidth=1.3,
                clip_on=False,
                zorder=zorder - 0.01 * number,
            )
    return marks


def clip_to_bounds(axes: Axes, bounds: Bounds, artists: Iterable[Artist], scale: float) -> Artist:
    """Cut artists off at the bounds; return the invisible frame that does it."""
    x_min, y_min, x_max, y_max = np.multiply(bounds, scale).tolist()
    (frame,) = axes.fill([x_min, x_max, x_max, x_min], [y_min, y_min, y_max, y_max], facecolor="none", linewidth=0.0)
    for artist in artists:
        artist.set_clip_path(frame)
    return frame


def line_key(**look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
    """Return a line or a marker for a legend."""
    return Line2D([], [], **look)


def patch_key(**look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
    """Return an area for a legend; empty unless its look says otherwise."""
    usual: Look = {"facecolor": "none", "edgecolor": "0.3", "linewidth": 0.9}
    return Patch(**usual | look)


def life(item: TimedThreat | TimedArea) -> str:
    """
    Say in a few words when something is there.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> life(TimedThreat(Threat(0, 0, 1), appears=5)), life(TimedThreat(Threat(0, 0, 1), appears=5, vanishes=9))
    ('from tick 5', 'ticks 5 to 8')
    """
    if item.vanishes is None:
        return f"from tick {item.appears}" if item.appears else "from the start"
    return f"ticks {item.appears} to {item.vanishes - 1}"


def timed_places(world: World) -> Iterator[tuple[Point, float, str, TimedThreat | TimedArea]]:
    """Yield the middle and the top of each timed threat or area, map units, when it is there, and the thing."""
    for item in world.timed:
        if isinstance(item, TimedArea):
            x_min, _, x_max, y_max = item.polygon.bounds
            yield (0.5 * (x_min + x_max), y_max), y_max, life(item), item
        else:
            threat = item.threat
            yield (threat.x, threat.y), threat.y + OUTLINE_SPREADS * threat.spread, life(item), item
