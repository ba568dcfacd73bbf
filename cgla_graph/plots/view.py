"""The visible part of a map, and the labels of its frame: map units, or degrees with a scale in km."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import shapely
from matplotlib import patheffects
from matplotlib.axes import Axes
from matplotlib.ticker import MaxNLocator
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.earth import LocalProjection
from cgla_graph.plots.degrees import degree_text
from cgla_graph.plots.page import plain

#: Margin around a flight that covers little of its map, in parts of the flight's longer side.
_AROUND = 0.2
#: A flight that covers at least this part of its map is shown with the whole map.
_MOST_OF_MAP = 0.75
#: Least ratio of the sides of a shown part.
_LEAST_SHAPE = 0.5
#: Paths nearer to the edge than the first, in parts of the longer side, would be on the frame: the second is added
#: then.
_ON_EDGE, _EDGE_ROOM = 0.004, 0.02
_SCALE_SHARE = 0.25  # longest scale, as a part of the shown width
_MOST_NAMES = 12  # areas that are named, the largest first
_HALO = [patheffects.withStroke(linewidth=2.0, foreground="white", alpha=0.9)]


@dataclass(frozen=True)
class View:
    """
    The visible part of a map.

    Attributes
    ----------
    frame
        The limits of the axes, map units, which may be outside the map.
    part
        The part of the map inside them, map units.
    """

    frame: Bounds
    part: Bounds


def view_of(
    bounds: Bounds, ends: FloatArray, paths: Sequence[FloatArray], leaving: Sequence[FloatArray], *, crop: bool
) -> View:
    """
    Choose the visible part: the whole map, or the part around the flight on a large map.

    Parameters
    ----------
    bounds
        Bounds of the map, map units.
    ends
        Starts and goals, shape ``(n, 2)``.
    paths
        Paths that are shown in full, shape ``(m, 2)`` each.
    leaving
        Infeasible paths, which may leave the bounds and are shown up to a tenth of the longer side outside.
    crop
        Whether the view may be a part of the map.

    Examples
    --------
    >>> ends = np.array([(1.0, 1.0), (2.0, 3.0)])
    >>> view_of((0, 0, 100, 100), ends, [ends], [], crop=True).frame
    (0.6, 0.6, 2.4, 3.4)
    >>> view_of((0.5, 0.5, 2.8, 3.1), ends, [ends], [], crop=True).frame
    (0.5, 0.5, 2.8, 3.1)
    >>> view_of((0, 0, 4, 3), ends, [ends], [], crop=False).frame
    (-0.08, -0.08, 4.08, 3.08)
    """
    low, high = np.reshape(np.asarray(bounds, dtype=np.float64), (2, 2))
    part_low, part_high = low, high
    if crop:
        part_low, part_high = _part(low, high, np.vstack([ends, *paths, *leaving]))
    size = float((part_high - part_low).max())
    frame_low, frame_high = part_low.copy(), part_high.copy()
    for path in leaving:
        if len(path):
            frame_low = np.minimum(frame_low, np.maximum(path.min(axis=0), part_low - 0.1 * size))
            frame_high = np.maximum(frame_high, np.minimum(path.max(axis=0), part_high + 0.1 * size))
    seen = np.vstack([ends, *paths])
    near = _ON_EDGE * size
    if ((seen <= part_low + near) & (part_low <= low)).any() or (
        (seen >= part_high - near) & (part_high >= high)
    ).any():
        frame_low = np.minimum(frame_low, part_low - _EDGE_ROOM * size)
        frame_high = np.maximum(frame_high, part_high + _EDGE_ROOM * size)
    return View(_box(frame_low, frame_high), _box(part_low, part_high))


def _part(low: FloatArray, high: FloatArray, places: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the part of a map around places, or the whole map."""
    inner_low, inner_high = places.min(axis=0).clip(low, high), places.max(axis=0).clip(low, high)
    size = float((inner_high - inner_low).max())
    if size <= 0.0 or size >= _MOST_OF_MAP * float((high - low).max()):
        return low, high
    wanted = np.maximum(inner_high - inner_low, _LEAST_SHAPE * size) + 2.0 * _AROUND * size
    middle = 0.5 * (inner_low + inner_high)
    return np.maximum(middle - 0.5 * wanted, low), np.minimum(middle + 0.5 * wanted, high)


def _box(low: FloatArray, high: FloatArray) -> Bounds:
    west, south, east, north = (round(float(value), 12) for value in (*low, *high))
    return west, south, east, north


def label_degrees(axes: Axes, projection: LocalProjection, counts: tuple[int, int]) -> None:
    """
    Draw meridians and parallels over axes in kilometres, label them along the frame, and add a scale.

    Parameters
    ----------
    axes
        The axes, with their limits set.
    projection
        The projection of the map.
    counts
        About how many labels fit along x and along y.
    """
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    edge = np.linspace(0.0, 1.0, 33)
    around = np.vstack(
        [
            *(np.stack([left + (right - left) * edge, np.full(33, y)], axis=1) for y in (low, high)),
            *(np.stack([np.full(33, x), low + (high - low) * edge], axis=1) for x in (left, right)),
        ]
    )
    degrees = projection.inverse(around * 1e3)
    # across the antimeridian, longitudes go on beyond 180
    degrees[:, 0] = projection.longitude + (degrees[:, 0] - projection.longitude + 180.0) % 360.0 - 180.0
    for side, letters, most in ((0, "EW", counts[0]), (1, "NS", counts[1])):
        first, last = float(degrees[:, side].min()), float(degrees[:, side].max())
        other = np.linspace(degrees[:, 1 - side].min(), degrees[:, 1 - side].max(), 65)
        ticks = np.asarray(MaxNLocator(most, steps=[1, 2, 2.5, 5, 10], min_n_ticks=2).tick_values(first, last))
        step = float(ticks[1] - ticks[0]) if len(ticks) > 1 else 1.0
        places, words = [], []
        for value in ticks.tolist():
            if side == 1 and abs(value) > 90.0:  # noqa: PLR2004 - the poles
                continue
            line = np.empty((65, 2))
            line[:, side], line[:, 1 - side] = value, np.clip(other, -90.0, 90.0) if side == 0 else other
            line[:, 0] = (line[:, 0] + 180.0) % 360.0 - 180.0
            points = projection.forward(line) * 1e-3
            axes.plot(
                *points.T,
                color="0.55",
                linewidth=0.4,
                alpha=0.55,
                zorder=1.3,
                gid="graticule",
                scalex=False,
                scaley=False,
            )
            # where it meets the lower edge, or the left one
            order = np.argsort(points[:, 1 - side])
            at = float(np.interp(low if side == 0 else left, points[order, 1 - side], points[order, side]))
            if (left, low)[side] <= at <= (right, high)[side]:
                places.append(at)
                words.append(degree_text(value, letters, step))
        axis = (axes.xaxis, axes.yaxis)[side]
        axis.set_ticks(places, words)
    axes.set_xlabel("longitude")
    axes.set_ylabel("latitude")
    _draw_scale(axes)


def _draw_scale(axes: Axes) -> None:
    """Draw a scale bar of a round number of kilometres in the lower left corner, which is usually empty."""
    (left, right), (low, high) = axes.get_xlim(), axes.get_ylim()
    most = _SCALE_SHARE * (right - left)
    unit = 10.0 ** math.floor(math.log10(most))
    length = unit * max(part for part in (1, 2, 5) if part * unit <= most)
    x, y = left + 0.03 * (right - left), low + 0.04 * (high - low)
    axes.plot(
        [x, x + length],
        [y, y],
        color="0.15",
        linewidth=1.6,
        solid_capstyle="butt",
        zorder=6.0,
        gid="scale",
        path_effects=_HALO,
    )
    said = f"{length:g} km" if length >= 1.0 else f"{1000 * length:g} m"
    axes.annotate(
        said, (x + 0.5 * length, y), xytext=(0.0, 2.5), textcoords="offset points", ha="center", va="bottom",
        fontsize=7.0, zorder=6.0, path_effects=_HALO,
    )  # fmt: skip


def name_areas(
    axes: Axes, named: Sequence[tuple[str, BaseGeometry]], scale: float, taken: Sequence[FloatArray]
) -> None:
    """
    Write the names of areas into them, the largest first, and none over another name or over a path.

    Parameters
    ----------
    axes
        The axes at their final size.
    named
        Names and areas, map units.
    scale
        Factor of map units.
    taken
        Paths and ends that names do not cover, map units, shape ``(n, 2)`` each.
    """
    (left, right), (low, high) = axes.get_xlim(), sorted(axes.get_ylim())
    frame = shapely.box(left, low, right, high)
    paths = [shapely.LineString(np.vstack([path, path[-1:]]) * scale) for path in taken if len(path)]
    shown = []
    for name, area in named:
        inside = shapely.intersection(shapely.transform(shapely.make_valid(area), lambda xy: xy * scale), frame)
        if name and not inside.is_empty and inside.area > 0.0:
            shown.append((float(inside.area), name, inside))
    boxes: list[BaseGeometry] = []
    written: set[str] = set()  # an area of several parts is named once
    points = axes.transData.inverted().transform([(0.0, 0.0), (1.0, 1.0)])
    across, up = np.abs(points[1] - points[0]) * axes.figure.dpi / 72.0  # units of the axes a point
    for _, name, area in sorted(shown, key=lambda one: (-one[0], one[1])):
        if len(boxes) == _MOST_NAMES:
            break
        word = plain(name, 24)
        if word in written:
            continue
        spot = shapely.point_on_surface(area)
        for lift in (0.0, 9.0, -9.0, 16.0, -16.0):
            x, y = spot.x, spot.y + lift * up
            half_width, half_height = 0.5 * (0.6 * 6.5 * len(word) + 4.0) * across, 5.0 * up
            box = shapely.box(x - half_width, y - half_height, x + half_width, y + half_height)
            if frame.contains(box) and not any(box.intersects(other) for other in (*boxes, *paths)):
                boxes.append(box)
                written.add(word)
                axes.text(
                    x, y, word, fontsize=6.5, color="0.25", ha="center", va="center", zorder=2.7, path_effects=_HALO,
                    clip_on=True, gid="area",
                )  # fmt: skip
                break
