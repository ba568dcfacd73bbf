"""No-fly areas: polygons whose interior no segment of a path may meet."""

import itertools
import math
from collections.abc import Iterator
from contextlib import contextmanager
from typing import Final, final

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import GeometryCollection, LineString, MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import cut
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph._validate import broadcast, number_array, point_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly_kernels import AreaArrays, in_line, pair_sectors, segments_cross

# Beyond this, the products of the exact arithmetic overflow.
MAX_COORDINATE: Final = 1e120
# A wall is at least this many times as long as wide, and is searched for at these places along each edge.
LENGTHS_OF_WALL: Final = 4.0
PLACES_ALONG_EDGE: Final = (0.25, 0.5, 0.75)
# Rows of the index for one edge, at most: tall edges would otherwise be listed in every slab.
MAX_ROWS_PER_EDGE: Final = 8


@final
class NoFlyArea:
    """
    A hard area that no segment may cross; touching its boundary is allowed.

    A segment crosses where it meets the topological interior of the union of the polygons. So a path may pass
    through a point where two polygons touch, run along an edge, and end on a corner. The answers are exact
    for the given doubles: there is no tolerance, so that even the thinnest wall counts. An area by itself knows no
    map. On the map of a `Problem` or a `World`, its sides on the border of the map are closed
    (`cgla_graph.model.clearance.closed_area`).

    Parameters
    ----------
    geometry
        A shapely ``Polygon`` or ``MultiPolygon``, or a ``GeometryCollection`` of these, which may overlap;
        map units. Heights (z) are dropped. ``None`` or an empty geometry is an empty area, which nothing
        crosses.

    Raises
    ------
    ProblemError
        Where the geometry is of another kind, a coordinate is not finite or greater than 1e120 in magnitude,
        or it or a part of it is invalid (a ring that crosses itself, a MultiPolygon whose parts overlap).

    Notes
    -----
    Shapely's union rounds the points where boundaries of *overlapping* polygons intersect; the answers are
    exact for that union, ``geometry``. Coordinates below 1e-120 in magnitude, other than 0, are beyond the
    exact arithmetic.

    Examples
    --------
    >>> area = NoFlyArea(shapely.box(0, 0, 1, 1))
    >>> area.crosses([[-1, 0], [-1, 0.5], [-1, 2]], [[2, 0], [2, 0.5], [2, -1]])
    array([False,  True,  True])
    """

    __slots__ = ("_edges", "_geometry", "_kernel_arrays", "_thinnest")

    def __init__(self, geometry: BaseGeometry | None) -> None:
        self._geometry = checked_union(geometry)
        self._edges = edges_of(self._geometry)
        self._edges.setflags(write=False)
        self._kernel_arrays = _index(self._edges)
        self._thinnest: float | None = None

    def __repr__(self) -> str:
        """Return how many polygons and edges there are."""
        return f"NoFlyArea({len(shapely.get_parts(self._geometry))} polygons, {len(self._edges)} edges)"

    def __reduce__(self) -> tuple[type["NoFlyArea"], tuple[BaseGeometry]]:
        """Pickle the geometry alone: unpickled arrays would lose their write protection."""
        return NoFlyArea, (self._geometry,)

    @property
    def geometry(self) -> Polygon | MultiPolygon:
        """
        The union of the polygons, map units: shells counter-clockwise, holes clockwise, no z.

        Examples
        --------
        >>> overlapping = shapely.GeometryCollection([shapely.box(0, 0, 2, 1), shapely.box(1, 0, 3, 1)])
        >>> NoFlyArea(overlapping).geometry.area
        3.0
        """
        return self._geometry

    @property
    def is_empty(self) -> bool:
        """
        Whether there is no polygon.

        Examples
        --------
        >>> NoFlyArea(None).is_empty
        True
        """
        return bool(self._geometry.is_empty)

    @property
    def edges(self) -> FloatArray:
        """
        All edges of shells and holes with the area on their left, read-only, shape ``(n, 6)``, map units.

        The columns are ``ax, ay, bx, by, cx, cy``: the edge leads from ``a`` to ``b``, and the sector of the area that
        it borders at ``a`` ends with the edge to ``c``. An edge ends where another ring touches it.

        Examples
        --------
        >>> NoFlyArea(shapely.box(0, 0, 1, 1)).edges[0].tolist()
        [1.0, 1.0, 0.0, 1.0, 1.0, 0.0]
        """
        return self._edges

    @property
    def thinnest(self) -> float:
        """
        The least width of a wall, map units; infinite without any.

        The width of a polygon is its mean width: twice its area over the length of its outline. The width of a part of
        it is the distance from an edge straight through to the other side, if that is below a quarter of the edge.

        Examples
        --------
        >>> round(NoFlyArea(shapely.box(0, 0, 10, 0.1)).thinnest, 3)
        0.099
        >>> fence = shapely.union(shapely.box(0, 0, 1, 1), shapely.box(1, 0.4, 3, 0.402))
        >>> round(NoFlyArea(fence).thinnest, 6)
        0.002
        """
        if self._thinnest is None:
            self._thinnest = _thinnest(self._geometry, self._edges)
        return self._thinnest

    @property
    def kernel_arrays(self) -> AreaArrays:
        """
        The read-only arrays that the kernels of ``cgla_graph.model.no_fly_kernels`` take as ``area``.

        Examples
        --------
        >>> from cgla_graph.model.no_fly_kernels import segment_crosses
        >>> segment_crosses(-1.0, 0.5, 2.0, 0.5, NoFlyArea(shapely.box(0, 0, 1, 1)).kernel_arrays)
        True
        """
        return self._kernel_arrays

    def crosses(self, starts: ArrayLike, ends: ArrayLike) -> BoolArray:
        """
        Tell whether each straight segment meets the interior of the area.

        Parameters
        ----------
        starts, ends
            ``(..., 2)`` each, map units; they broadcast. A segment of length zero is a point.

        Returns
        -------
        BoolArray
            ``(...)``.

        Raises
        ------
        ProblemError
            Where a shape or a coordinate is not as described.

        Examples
        --------
        Two cells that touch at a corner leave a way through that corner:

        >>> cells = NoFlyArea(shapely.MultiPolygon([shapely.box(0, 0, 1, 1), shapely.box(1, 1, 2, 2)]))
        >>> cells.crosses([0, 2], [[2, 0], [2, 0.5]])
        array([False,  True])
        """
        first, second = broadcast(_points(starts, "starts"), _points(ends, "ends"))
        return self._crossed(first.reshape(-1, 2), second.reshape(-1, 2)).reshape(first.shape[:-1])

    def contains(self, points: ArrayLike) -> BoolArray:
        """
        Tell whether each point is strictly inside: a point on the boundary is not.

        Parameters
        ----------
        points
            ``(..., 2)``, map units.

        Returns
        -------
        BoolArray
            ``(...)``.

        Raises
        ------
        ProblemError
            Where the shape or a coordinate is not as described.

        Examples
        --------
        >>> NoFlyArea(shapely.box(0, 0, 1, 1)).contains([[0.5, 0.5], [1, 0.5]])
        array([ True, False])
        """
        given = _points(points, "points")
        flat = np.array(given, order="C").reshape(-1, 2)
        return self._crossed(flat, flat).reshape(given.shape[:-1])

    def _crossed(self, starts: FloatArray, ends: FloatArray) -> BoolArray:
        """Return whether each of the segments ``(n, 2)`` meets the interior; no kernel is called for an empty area."""
        if self.is_empty:
            return np.zeros(len(starts), dtype=bool)
        return segments_cross(starts, ends, self._kernel_arrays)

    def convex_corners(self, *, straight: float = 0.0) -> FloatArray:
        """
        Return the corners that a shortest path around the area may bend in (Lozano-Perez and Wesley 1979).

        Parameters
        ----------
        straight
            Corners that turn in by less than this, radians, count as turning out.

        Returns
        -------
        corners
            Shape ``(c, 2)``, map units, each once, by x and then y; of a hole, the corners that reach into it.

        Examples
        --------
        >>> ell = shapely.Polygon([(0, 0), (2, 0), (2, 1), (1, 1), (1, 2), (0, 2)])
        >>> NoFlyArea(ell).convex_corners().tolist()
        [[0.0, 0.0], [0.0, 2.0], [1.0, 2.0], [2.0, 0.0], [2.0, 1.0]]
        """
        starts, ends, others = np.hsplit(self._edges, 3)
        ahead, back = ends - starts, starts - others
        # the area is on the left
        turn = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0]
        return np.unique(starts[turn > -straight * np.hypot(*back.T) * np.hypot(*ahead.T)], axis=0)

    def path_clearance(self, path: ArrayLike) -> float:
        """
        Return the least distance between a polyline and the area.

        Parameters
        ----------
        path
            ``(m, 2)`` with ``m >= 1``, map units.

        Returns
        -------
        float
            Map units: 0 where the polyline touches or crosses the area, infinite where the area is empty.

        Raises
        ------
        ProblemError
            Where the shape or a coordinate is not as described.

        Examples
        --------
        >>> NoFlyArea(shapely.box(0, 0, 1, 1)).path_clearance([[2, 0], [2, 5]])
        1.0
        """
        points = _points(path, "path")
        if points.ndim != 2 or not len(points):  # noqa: PLR2004 (rows of points)
            message = f"path has shape {points.shape}; a path has shape (m, 2) with at least one point"
            raise ProblemError(message)
        if self.is_empty:
            return math.inf
        line = Point(points[0]) if len(points) == 1 else LineString(points)
        # (GEOS divides by the square of a segment's length, which may underflow to 0, and goes on)
        with np.errstate(divide="ignore", invalid="ignore", over="ignore", under="ignore"):
            return float(shapely.distance(line, self._geometry))


def _points(values: ArrayLike, name: str) -> FloatArray:
    """Return points as `point_array` does, if the exact arithmetic can hold them."""
    points = number_array(name, values)
    if points.ndim and points.shape[-1] == 2 and (np.abs(points) <= MAX_COORDINATE).all():  # noqa: PLR2004 - x and y
        return points
    points = point_array(name, points)
    worst = points[~(np.abs(points) <= MAX_COORDINATE)][0]
    message = f"{name} holds the coordinate {worst}; coordinates are finite and at most {MAX_COORDINATE:g}"
    raise ProblemError(message)


def checked_union(geometry: BaseGeometry | None) -> Polygon | MultiPolygon:
    """Return the checked, flat, oriented union of the polygons of a geometry."""
    polygons = [] if geometry is None else polygons_of(geometry)
    if not polygons:
        return MultiPolygon()
    # The parts of a valid MultiPolygon have disjoint interiors: it is its own union, to the last bit.
    joins = isinstance(geometry, GeometryCollection) and len(polygons) > 1
    with overlay_errors():
        whole = shapely.union_all(polygons) if joins else MultiPolygon(polygons)
    if not whole.is_valid:
        message = (
            f"the parts of the no-fly area overlap or share edges: {shapely.is_valid_reason(whole)}; "
            "join them with shapely.union_all(geometry.geoms)"
        )
        raise ProblemError(message)
    # Counter-clockwise shells, clockwise holes: the interior is on the left of every edge.
    flat = shapely.get_parts(shapely.orient_polygons(whole))
    return flat[0] if len(flat) == 1 else MultiPolygon(list(flat))


def polygons_of(geometry: BaseGeometry) -> list[Polygon]:
    """
    Return the polygons of a geometry, without heights.

    Raises
    ------
    ProblemError
        If it is of another kind, or one of its polygons is invalid.

    Examples
    --------
    >>> [polygon.area for polygon in polygons_of(shapely.GeometryCollection([shapely.box(0, 0, 1, 2)]))]
    [2.0]
    """
    if not isinstance(geometry, BaseGeometry):
        message = (
            f"a no-fly area is a shapely geometry, not {type(geometry).__name__}; "
            "put several polygons into a shapely.GeometryCollection"
        )
        raise ProblemError(message)
    return _polygons(shapely.force_2d(geometry), "")


def _polygons(geometry: BaseGeometry, part: str) -> list[Polygon]:
    """Return the valid polygons of a geometry; ``part`` says in messages where it is in the whole."""
    if geometry.is_empty:
        return []
    if isinstance(geometry, MultiPolygon | GeometryCollection):
        numbered = enumerate(geometry.geoms)
        return [polygon for i, piece in numbered for polygon in _polygons(piece, f"{part}[{i}]")]
    where = f"part {part} of the no-fly area" if part else "the no-fly area"
    if not isinstance(geometry, Polygon):
        message = (
            f"{where} is a {geometry.geom_type}; only polygons have an interior to keep out of: "
            "give it a width with geometry.buffer(distance)"
        )
        raise ProblemError(message)
    require_valid(where, geometry)
    return [geometry]


@contextmanager
def overlay_errors() -> Iterator[None]:
    """
    Turn failures of GEOS, which come with coordinates of very different magnitudes, into a `ProblemError`.

    Examples
    --------
    >>> with overlay_errors():
    ...     shapely.union_all([shapely.box(0, 0, 1, 1)]).area
    1.0
    """
    try:
        yield
    except shapely.errors.GEOSException as error:
        message = f"the no-fly area is beyond shapely's arithmetic ({cut(error, 120)}); give it in the map's units"
        raise ProblemError(message) from error


def require_valid(name: str, polygon: BaseGeometry) -> None:
    """
    Check that the rings of a polygon enclose it without crossing, and that its coordinates are usable numbers.

    Raises
    ------
    ProblemError
        If it is not valid; the message begins with `name`.

    Examples
    --------
    >>> require_valid("the area", shapely.Polygon([(0, 0), (1, 1), (1, 0), (0, 1)]))
    Traceback (most recent call last):
    cgla_graph.errors.ProblemError: the area is invalid: Self-intersection[0.5 0.5]; draw it anew, or repair it with
    shapely.make_valid
    """
    coordinates = shapely.get_coordinates(polygon)
    bad = ~(np.abs(coordinates) <= MAX_COORDINATE)
    if bad.any():
        message = f"{name} has the coordinate {coordinates[bad][0]}; all are finite and at most {MAX_COORDINATE:g}"
        raise ProblemError(message)
    if not polygon.is_valid:
        reason = shapely.is_valid_reason(polygon)
        message = f"{name} is invalid: {reason}; draw it anew, or repair it with shapely.make_valid"
        raise ProblemError(message)


def _thinnest(geometry: Polygon | MultiPolygon, edges: FloatArray) -> float:
    """Measure the thinnest wall of an area (`NoFlyArea.thinnest`), by rays from its edges through its inside."""
    polygons = shapely.get_parts(geometry)
    outlines = shapely.length(polygons)
    mean_width = (2.0 * shapely.area(polygons)[outlines > 0.0] / outlines[outlines > 0.0]).min(initial=math.inf)
    begin, step = edges[:, :2], edges[:, 2:4] - edges[:, :2]
    lengths = np.hypot(*step.T)
    from_edge = np.tile(np.arange(len(edges)), len(PLACES_ALONG_EDGE))
    foot = np.concatenate([begin + share * step for share in PLACES_ALONG_EDGE])
    with np.errstate(all="ignore"):
        # (the shortest edges underflow and have no direction: all comparisons are false then)
        inward = (np.column_stack([-step[:, 1], step[:, 0]]) / lengths[:, None])[from_edge]
        ahead = lengths[from_edge] / LENGTHS_OF_WALL
        rays = shapely.linestrings(np.stack([foot, foot + ahead[:, None] * inward], axis=1))
        tree = shapely.STRtree(np.asarray(shapely.linestrings(edges[:, :4].reshape(-1, 2, 2))))
        ray, edge = tree.query(rays)
        ray, edge = ray[from_edge[ray] != edge], edge[from_edge[ray] != edge]
        to_edge, across = begin[edge] - foot[ray], step[edge]
        turn = _cross(inward[ray], across)
        width, place = _cross(to_edge, across) / turn, _cross(to_edge, inward[ray]) / turn
        is_through = (width > 0.0) & (width <= ahead[ray]) & (place >= 0.0) & (place <= 1.0)
    return float(min(mean_width, width[is_through].min(initial=math.inf)))


def _cross(first: FloatArray, second: FloatArray) -> FloatArray:
    product: FloatArray = first[:, 0] * second[:, 1] - first[:, 1] * second[:, 0]
    return product


def edges_of(geometry: BaseGeometry) -> FloatArray:
    """
    Return the edges of a union of polygons as `NoFlyArea.edges` has them, sorted by least x, shape ``(n, 6)``.

    Examples
    --------
    >>> edges_of(checked_union(shapely.box(0, 0, 1, 1)))[0].tolist()
    [1.0, 1.0, 0.0, 1.0, 1.0, 0.0]
    """
    rings = shapely.get_rings(shapely.get_parts(geometry))
    if not len(rings):
        # (without loading a kernel)
        return np.empty((0, 6))
    coordinates, ring = shapely.get_coordinates(rings, return_index=True)
    coordinates += 0.0  # turns -0.0 into 0.0, so that equal vertices sort together
    starts, ends = coordinates[:-1], coordinates[1:]
    # Shapely allows a vertex to be repeated; between two rings there is no edge.
    kept = (ring[:-1] == ring[1:]) & (starts != ends).any(axis=1)
    starts, ends, ring = _split(starts[kept], ends[kept], ring[:-1][kept])
    if not len(ring):
        return np.empty((0, 6))
    opens = np.flatnonzero(np.diff(ring, prepend=-1))
    previous = np.arange(-1, len(ring) - 1)
    previous[opens] = np.append(opens[1:], len(ring)) - 1
    edges = np.hstack([starts, ends, starts[previous]])
    pair_sectors(edges, np.lexsort((edges[:, 1], edges[:, 0])))
    return edges[np.argsort(np.minimum(edges[:, 0], edges[:, 2]), kind="stable")]


def _split(starts: FloatArray, ends: FloatArray, ring: IntArray) -> tuple[FloatArray, FloatArray, IntArray]:
    """
    Cut every edge at the vertices of other rings that lie on it: a hole's corner may touch the shell's edge.

    So ``pair_sectors`` gets all sectors around a point. Starts and ends are ``(n, 2)``, map units; ring is ``(n,)``.
    """
    tree = shapely.STRtree(np.array(shapely.linestrings(np.stack([starts, ends], axis=1)), ndmin=1))
    vertex, edge = tree.query(shapely.points(starts))  # every vertex in the box of an edge
    a, b, v = starts[edge], ends[edge], starts[vertex]
    cut = in_line(a, b, v) & (v != a).any(axis=1) & (v != b).any(axis=1)
    a, b, v, edge = a[cut], b[cut], v[cut], edge[cut]
    # One coordinate orders the points of an edge exactly; a distance would be rounded.
    along = np.where(a[:, 0] != b[:, 0], np.where(a < b, v, -v)[:, 0], np.where(a < b, v, -v)[:, 1])
    _, first = np.unique(np.column_stack([edge, along]), axis=0, return_index=True)
    edge, v = edge[first], v[first]
    return np.insert(starts, edge + 1, v, axis=0), np.insert(ends, edge, v, axis=0), np.insert(ring, edge, ring[edge])


def _index(edges: FloatArray) -> AreaArrays:
    """Return the arrays of the kernels for the edges of `edges_of`."""
    if not len(edges):
        frame = np.array([math.inf, math.inf, -math.inf, -math.inf, 0.0, 0.0, 0.0])
        return _read_only(frame, np.zeros(1, dtype=np.int64), np.empty((0, 8)))
    low, high = edges[:, :2].min(axis=0), edges[:, :2].max(axis=0)
    height = high[1] - low[1]
    # As many slabs as a square grid of one cell an edge has rows.
    slabs = max(1, math.isqrt(len(edges)))
    while True:
        # The same arithmetic as the kernel slab_of: an edge and a segment that meet must agree on a slab.
        levels = np.clip((edges[:, 1:4:2] - low[1]) * (slabs / height), 0.0, slabs - 1.0).astype(np.int64)
        first, last = levels.min(axis=1), levels.max(axis=1)
        spans = last - first + 1
        if slabs == 1 or spans.sum() <= MAX_ROWS_PER_EDGE * len(edges):
            break
        slabs //= 2
    slack = 1e-9 * height / slabs + 1e-14 * (abs(low[1]) + abs(high[1]))
    frame = np.array([*low, *high, slabs / height, height / slabs, slack])
    return _read_only(frame, *_rows(edges, first, spans, slabs))


def _rows(edges: FloatArray, first: IntArray, spans: IntArray, slabs: int) -> tuple[IntArray, FloatArray]:
    """Return where each slab's rows start, and the rows: every edge once in each of its slabs."""
    edge = np.repeat(np.arange(len(edges)), spans)
    slab = np.arange(len(edge)) + np.repeat(first - (np.cumsum(spans) - spans), spans)
    order = np.argsort(slab, kind="stable")  # stable: by least x in each slab
    slab_starts = np.zeros(slabs + 1, dtype=np.int64)
    np.cumsum(np.bincount(slab, minlength=slabs), out=slab_starts[1:])
    rows = np.empty((len(edge), 8))
    rows[:, :6] = edges[edge[order]]
    rows[:, 6] = np.minimum(rows[:, 0], rows[:, 2])
    reach = np.maximum(rows[:, 0], rows[:, 2])
    for start, stop in itertools.pairwise(slab_starts):
        rows[start:stop, 7] = np.maximum.accumulate(reach[start:stop])
    return slab_starts, rows


def _read_only(frame: FloatArray, slab_starts: IntArray, rows: FloatArray) -> AreaArrays:
    """Return the arrays, protected against writing."""
    for array in (frame, slab_starts, rows):
        array.setflags(write=False)
    return frame, slab_starts, rows
