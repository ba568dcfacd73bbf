"""Parts of all pictures of maps: units, the risk and its colours, no-fly areas, UAVs, timed threats and areas."""

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Any, TypeAlias

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.artist import Artist
from matplotlib.axes import Axes
from matplotlib.colorbar import Colorbar
from matplotlib.colors import Colormap, ListedColormap, Normalize, PowerNorm
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.patches import Circle, Patch, PathPatch, Rectangle
from matplotlib.path import Path as Outline
from matplotlib.ticker import FixedLocator, FuncFormatter, MaxNLocator
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray, Point
from cgla_graph._validate import number_array
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk_raster import RasterRisk, cell_strips
from cgla_graph.people.units import density_text
from cgla_graph.plots.looks import COLOURS
from cgla_graph.plots.risk_samples import greatest_cells, risk_samples, sample_edges
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.timed.timed_area import TimedArea

_HALO = [patheffects.withStroke(linewidth=2.2, foreground="white", alpha=0.9)]
#: Settings of an artist, as matplotlib names them.
Look: TypeAlias = dict[str, Any]
_GRID = 300  # samples of the risk field along the longer side
_FINE_GRID = 720  # the same where there are rasters: about a pixel each
_FEW_CELLS = 40  # rasters of at most so many cells a side have lines between their cells
#: Look of places without data, on maps and in legends.
NO_DATA_LOOK: Look = {"facecolor": "none", "edgecolor": "0.6", "hatch": "....", "linewidth": 0.0}
#: Colours of close pairs, and of threats and areas that come and go; no UAV has them.
NEAR_COLOUR, TIMED_COLOUR = "#D55E00", "#8A3A00"
#: A threat is outlined at this many spreads from its centre.
OUTLINE_SPREADS = 1.5
#: Look of the inside of areas.
AREA_LOOK: Look = {"facecolor": "0.85", "edgecolor": "0.6", "hatch": "////", "linewidth": 0.0}
#: Look of the outline of threats and areas that come and go, on maps and in legends.
TIMED_LOOK: Look = {"edgecolor": TIMED_COLOUR, "linewidth": 0.9, "linestyle": (0, (4, 2))}
#: The lines and hatches of circles: how far a UAV sees, its safe distance, a virtual obstacle.
SIGHT_DASHES, SAFE_DASHES, OBSTACLE_HATCH = (0, (5, 3)), (0, (1, 1.5)), "xxxxx"
#: An arrowhead of length 1 that points east, around its middle.
_ARROW = Outline([(-0.5, -0.42), (0.5, 0.0), (-0.5, 0.42), (-0.25, 0.0), (-0.5, -0.42)], closed=True)


@dataclass(frozen=True, eq=False)
class TitledProblem:
    """
    A problem with the texts of its picture.

    Attributes
    ----------
    problem
        The map.
    name, title
        A short name, and one line that says what the map shows; may be empty.
    areas
        Names and shapes of no-fly areas, map units.
    y_down
        Whether y grows downwards, as in grid maps.
    """

    problem: Problem
    name: str = ""
    title: str = ""
    areas: Sequence[tuple[str, BaseGeometry]] = ()
    y_down: bool = False

    @classmethod
    def of(cls, scenario: Scenario) -> "TitledProblem":
        """Take the texts of a scenario."""
        return cls(scenario.problem, scenario.name, scenario.title, scenario.areas, scenario.y_down)


def unit_scale(problem: Problem) -> float:
    """
    Return the factor of coordinates, lengths and costs: 0.001 where metres become kilometres, else 1.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> unit_scale(load_scenario("finland").problem), unit_scale(load_scenario("paper").problem)
    (0.001, 1.0)
    """
    return 1.0 if problem.projection is None else 1e-3


def cost_unit(problem: Problem) -> str:
    """
    Return the unit of costs, as a suffix; empty where the map's unit has no name.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> [f"cost{cost_unit(load_scenario(name).problem)}" for name in ("finland", "paper")]
    ['cost (km)', 'cost']
    """
    return "" if problem.projection is None else " (km)"


def draw_risk(
    figure: Figure,
    axes: Axes,
    problem: Problem,
    *,
    wide: bool = False,
    with_bar: bool = True,
    part: Bounds | None = None,
) -> Colorbar | None:
    """
    Draw the risk field over the bounds, or a part of the map; return its colour bar, or None where there is no risk.

    The bar still has to be placed.
    """
    x_min, y_min, x_max, y_max = problem.bounds
    scale = unit_scale(problem)
    corner, width, height = (x_min * scale, y_min * scale), (x_max - x_min) * scale, (y_max - y_min) * scale
    axes.add_patch(Rectangle(corner, width, height, facecolor="white", zorder=0))
    axes.add_patch(Rectangle(corner, width, height, facecolor="none", edgecolor="0.2", linewidth=0.8, zorder=2.5))
    _draw_cells(axes, problem, scale)
    shown = problem
    if part is not None and part != shown.bounds:
        shown = Problem(part[:2], part[2:], shown.field, bounds=part)
        x_min, y_min, x_max, y_max = part
        corner, width, height = (x_min * scale, y_min * scale), (x_max - x_min) * scale, (y_max - y_min) * scale
    risk = risk_samples(shown, _FINE_GRID if shown.field.rasters else _GRID)
    if not risk.top > 0.0:
        return None
    heavy = risk.power < 1.0
    image = axes.imshow(
        risk.density,
        cmap=risk_colours(),
        norm=PowerNorm(risk.power, 0.0, risk.top) if heavy else Normalize(0.0, risk.top),
        origin="lower",
        extent=(corner[0], corner[0] + width, corner[1], corner[1] + height),
        # edges of cells are sharp
        interpolation="nearest" if problem.field.rasters else "bilinear",
        aspect="equal",
        zorder=1,
    )
    if not with_bar:
        return None
    bar = figure.colorbar(
        image,
        cax=figure.add_axes((0.0, 0.0, 0.1, 0.1)),
        orientation="horizontal" if wide else "vertical",
        extend="min" if risk.density.min() < -1e-9 else "neither",  # noqa: PLR2004 - more than rounding
        ticks=FixedLocator(_heavy_ticks(risk.top)) if heavy else MaxNLocator(5, steps=[1, 2, 5, 10]),
        format=FuncFormatter(lambda value, _: f"{value:g}") if heavy else None,
    )
    if heavy:
        bar.minorticks_off()
    # (beside a map that is not high, one line would be longer than the bar)
    label = [density_text(problem.field), *(["colours by its cube root"] if heavy else [])]
    bar.set_label((", " if wide else ",\n").join(label), labelpad=2.0 if wide else 8.0)
    return bar


def _heavy_ticks(top: float) -> list[float]:
    """
    Choose round numbers whose cube roots are about evenly spread up to a number.

    Examples
    --------
    >>> _heavy_ticks(20.9)
    [0.0, 0.2, 1.0, 5.0, 10.0, 20.0]
    """
    ticks = [0.0, *(float(f"{top * share**3:.0e}") for share in (0.2, 0.4, 0.6, 0.8))]
    unit = 10.0 ** math.floor(math.log10(top))
    return [*ticks, float(f"{math.floor(top / unit) * unit:.12g}")]


def _draw_cells(axes: Axes, problem: Problem, scale: float) -> None:
    """Hatch where a raster has no data, and draw lines between its cells if they are few."""
    # both are patches, which an animation removes again
    frame = shapely.box(*problem.bounds)
    for raster in problem.field.rasters:
        rows, columns = raster.shape
        if max(rows, columns) <= _FEW_CELLS:
            x, y = _lines(raster)
            sides = [((at, y[0]), (at, y[-1])) for at in x] + [((x[0], at), (x[-1], at)) for at in y]
            clipped = [np.array(line.coords) * scale for line in map(shapely.LineString, sides)]
            lines = Outline.make_compound_path(*map(Outline, clipped))
            grid = axes.add_patch(PathPatch(lines, facecolor="none", edgecolor="0.75", linewidth=0.3, zorder=1.1))
            clip_to_bounds(axes, problem.bounds, [grid], scale)
        if raster.missing.any():
            area = shapely.intersection(_no_data(raster, problem), frame)
            if not area.is_empty:
                axes.add_patch(PathPatch(outline(area, scale), **NO_DATA_LOOK, zorder=1.2))


def _lines(raster: RasterRisk) -> tuple[FloatArray, FloatArray]:
    """Return the x and the y of the lines between cells, and of the outer edges."""
    x_min, y_min, x_max, y_max = raster.bounds
    rows, columns = raster.shape
    return np.linspace(x_min, x_max, columns + 1), np.linspace(y_min, y_max, rows + 1)


def _no_data(raster: RasterRisk, problem: Problem) -> BaseGeometry:
    """Return the area without data of a raster: its cells, or if they are very many, the samples that have one."""
    gone, (x, y) = raster.missing[:: -1 if raster.origin == "upper" else 1], _lines(raster)
    if max(gone.shape) > _GRID:
        x, y = sample_edges(problem, _GRID)
        gone = greatest_cells(raster, gone.__getitem__, x, y) > 0.0
    return shapely.union_all(cell_strips(gone, x, y))


def data_keys(problem: Problem) -> Iterator[tuple[Artist, str]]:
    """Yield the row of a legend for places without data, if there are any."""
    for raster in [raster for raster in problem.field.rasters if raster.missing.any()][:1]:
        taken = "" if raster.nodata is None else f", taken for {raster.nodata * raster.factor:g}"
        yield patch_key(**NO_DATA_LOOK), f"no data{taken}"


@cache
def risk_colours() -> Colormap:
    """
    Return colours from white to violet in equal steps of CIELAB.

    So equal differences of risk look equal, also in grey and to the colour-blind, and no path has a similar hue.
    Negative risk (of improper fields) is grey-blue.

    Examples
    --------
    >>> from matplotlib.colors import to_hex
    >>> [to_hex(risk_colours()(risk)) for risk in (0.0, 1.0, -1.0)]
    ['#ffffff', '#6445af', '#9db4c0']
    """
    lab = np.linspace((100.0, 0.0, 0.0), (38.0, 38.0, -52.0), 256)
    f_y = (lab[:, 0] + 16.0) / 116.0
    f = np.stack([f_y + lab[:, 1] / 500.0, f_y, f_y - lab[:, 2] / 200.0], axis=1)
    xyz = np.where(f > 6.0 / 29.0, f**3, 3.0 * (6.0 / 29.0) ** 2 * (f - 4.0 / 29.0)) * (0.95047, 1.0, 1.08883)
    to_rgb = [[3.2406, -1.5372, -0.4986], [-0.9689, 1.8758, 0.0415], [0.0557, -0.2040, 1.0570]]
    linear = np.clip(xyz @ np.transpose(to_rgb), 0.0, 1.0)
    rgb = np.where(linear <= 0.0031308, 12.92 * linear, 1.055 * linear ** (1.0 / 2.4) - 0.055)  # noqa: PLR2004 - sRGB
    return ListedColormap(np.clip(rgb, 0.0, 1.0), name="risk").with_extremes(under="#9DB4C0")


def colour_of(number: int) -> str:
    """
    Return the colour of a UAV.

    Examples
    --------
    >>> colour_of(0), colour_of(0) == colour_of(len(COLOURS))
    ('#0072B2', True)
    """
    return COLOURS[number % len(COLOURS)]


def own_colour(uav: Uav, number: int) -> str:
    """
    Return the colour of a UAV: that of its mission file, else that of its number.

    Examples
    --------
    >>> own_colour(Uav("b", (0, 0), (1, 1), 0.2, colour="#aa0000"), 1)
    '#aa0000'
    """
    return uav.colour or colour_of(number)


def arrowhead(east: float, north: float) -> Outline:
    """Return a marker that points in a direction; east if both components are 0."""
    # scaled first: the squares of the smallest floats underflow
    largest = max(abs(east), abs(north))
    cos, sin = (east / largest, north / largest) if largest > 0.0 else (1.0, 0.0)
    length = float(np.hypot(cos, sin))
    cos, sin = cos / length, sin / length
    turned = np.asarray(_ARROW.vertices) @ np.array([[cos, sin], [-sin, cos]])
    return Outline(turned, _ARROW.codes)


def outline(area: BaseGeometry, scale: float) -> Outline:
    """
    Return the rings of all polygons in a geometry, times `scale`.

    Holes have the opposite orientation of shells, so that they stay empty.

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


def draw_mark(axes: Axes, place: ArrayLike, marker: object, size: float, face: object = "white", **look: Any) -> Artist:  # noqa: ANN401 - the same
    """Draw a marker, in units of the axes."""
    (mark,) = axes.plot(
        *number_array("place", place), linestyle="none", marker=marker, markersize=size, markerfacecolor=face, **look
    )
    return mark


def write_beside(axes: Axes, words: str, place: Point, shift: Point, **look: Any) -> None:  # noqa: ANN401 - the same
    """Write a few words near a place, in units of the axes, shifted by points to the right and upwards."""
    axes.annotate(words, place, xytext=shift, textcoords="offset points", zorder=6.0, path_effects=_HALO, **look)


def draw_ends(axes: Axes, uavs: Sequence[Uav], scale: float, *, size: float, zorder: float) -> list[Artist]:
    """Draw starts (circles) and goals (stars) of UAVs; at a shared place, that of the first UAV is on top."""
    marks: list[Artist] = []
    for number, uav in enumerate(uavs):
        for end, marker, width in ((uav.start, "o", size), (uav.goal, "*", 1.8 * size)):
            look: Look = {"markeredgecolor": own_colour(uav, number), "markeredgewidth": 1.3, "clip_on": False}
            depth = zorder - 0.01 * number
            marks.append(draw_mark(axes, np.multiply(end, scale), marker, width, zorder=depth, **look))
    return marks


def clip_to_bounds(axes: Axes, bounds: Bounds, artists: Iterable[Artist], scale: float) -> Artist:
    """Clip artists to the bounds; return the invisible frame that clips them."""
    x_min, y_min, x_max, y_max = np.multiply(bounds, scale).tolist()
    (frame,) = axes.fill([x_min, x_max, x_max, x_min], [y_min, y_min, y_max, y_max], facecolor="none", linewidth=0.0)
    for artist in artists:
        artist.set_clip_path(frame)
    return frame


def line_key(**look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
    """Return a line or a marker for a legend."""
    return Line2D([], [], **look)


def patch_key(**look: Any) -> Artist:  # noqa: ANN401 - matplotlib's settings
    """Return an area for a legend; empty unless `look` fills it."""
    usual: Look = {"facecolor": "none", "edgecolor": "0.3", "linewidth": 0.9}
    return Patch(**usual | look)


def area_key() -> Artist:
    """Return a no-fly area for a legend."""
    return patch_key(**AREA_LOOK | {"edgecolor": "0.25", "linewidth": 0.7})


def life(item: TimedThreat | TimedArea) -> str:
    """
    Return in a few words when a threat or area is there.

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
    """Yield the middle and the top of each timed threat or area, map units, its times as text, and the item."""
    for item in world.timed:
        if isinstance(item, TimedArea):
            x_min, _, x_max, y_max = item.polygon.bounds
            yield (0.5 * (x_min + x_max), y_max), y_max, life(item), item
        else:
            threat = item.threat
            yield (threat.x, threat.y), threat.y + OUTLINE_SPREADS * threat.spread, life(item), item
