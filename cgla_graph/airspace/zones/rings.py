"""Areas of rings in degrees: the way that long edges go around the Earth, holes, and rings that cross themselves."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple, TypeAlias

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.airspace.zones.shapes import AreaShape, ring_of, unwrapped
from cgla_graph.errors import FileFormatError
from cgla_graph.untrusted.files import fault

ObjectArray: TypeAlias = NDArray[Any]

#: Degrees of longitude at which both ways around the Earth are equally long.
HALF = 180.0
#: A ring with edges across the antimeridian is at most so wide and high, degrees, unless its holes say where it is.
COMPACT = 45.0
#: Overlaps of the boxes of edges of an outline that crosses itself, per edge on average, at most.
OVERLAPS = 50
#: Holes that touch the outline, at most, that are examined one by one.
MOST_TOUCHING = 100

CROSSES = "its outline crosses itself: all that it encloses is closed"
OUTSIDE = "a hole is not inside its outline: the insides of both are closed"
TOUCHES = "a hole crosses or runs along its outline, another hole or itself: it is closed"
EMPTY = "a hole encloses nothing: it is left out"
BOTH_WAYS = "an edge of its outline spans more than 180 degrees of longitude: it is closed both ways around the Earth"
UNCLEAR = "an edge of a hole spans more than 180 degrees of longitude: the hole is closed"
SHORT_WAY = "an edge of its outline goes the short way around the Earth, as the place of its holes says"
LONG_WAY = "an edge of its outline goes the long way around the Earth, as the place of its holes says"


def polygon_of(rings: list[FloatArray], where: str) -> tuple[AreaShape, str]:
    """
    Return the area inside the first ring and outside the others, and a remark, which may be empty.

    Where rings are ambiguous, the area may grow, but never shrinks, and the remark says so. A ring that crosses itself
    counts with all that it encloses, including its holes. A ring is a hole only if it is inside of the first one,
    and neither crosses nor runs along another ring; else its inside is closed.

    Parameters
    ----------
    rings
        Rings as `ring_of` returns them.
    where
        Name of the area in errors.

    Raises
    ------
    FileFormatError
        If the area is empty, a ring crosses itself too often, or the direction of an edge is unknown.

    Examples
    --------
    >>> bow = np.array([[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0], [0.0, 0.0]])
    >>> area, remark = polygon_of([bow], "a zone")
    >>> area.area, remark
    (0.5, 'its outline crosses itself: all that it encloses is closed')
    >>> small, large = (shapely.get_coordinates(shapely.box(-side, -side, side, side)) for side in (1, 2))
    >>> polygon_of([small, large], "a zone with swapped rings")[0].area
    16.0
    """
    borders, holes, unclear, remarks = _directed(rings, where)
    area = Polygon(borders[0], holes)
    if len(borders) == 1 and not unclear and area.is_valid and area.area > 0.0:
        return area, "; ".join(remarks)
    outline = Polygon(borders[0])
    if len(borders) == 1 and outline.is_valid and outline.area > 0.0:
        kept, shut, found = _sorted_holes(outline, holes, where)
        parts, remarks = [Polygon(borders[0], kept)], [*remarks, *found]
    else:
        parts, shut = [part for border in borders for part in enclosed_parts(border, where)], holes
        remarks = remarks if len(borders) > 1 else [*remarks, CROSSES]
    if not parts:
        fault(where, "its outline encloses nothing", "give a ring with an inside")
    whole = shapely.union_all([*parts, *(part for hole in (*shut, *unclear) for part in enclosed_parts(hole, where))])
    assert isinstance(whole, Polygon | MultiPolygon)  # noqa: S101 - a union of polygons with an inside
    return whole, "; ".join(remarks)


def area_of(rings: Sequence[object], where: str) -> tuple[AreaShape, str]:
    """
    Read the area of lists of positions, the border first, then holes, as `ring_of` and `polygon_of` do.

    Examples
    --------
    >>> area_of([[[6, 49], [7, 49], [7, 50], [6, 49]]], "a zone")[0].area
    0.5
    """
    return polygon_of([ring_of(ring, f"{where}[{index}]") for index, ring in enumerate(rings)], where)


def directed_rings(rings: Sequence[FloatArray], where: str) -> list[FloatArray]:
    """
    Return rings with longitudes that continue beyond 180 degrees where an edge crosses the antimeridian.

    Parameters
    ----------
    rings
        The border, then its holes, degrees; the last corner of each equals the first.
    where
        Name of the area in errors.

    Raises
    ------
    FileFormatError
        If the rings do not say which way an edge goes around the Earth.

    Examples
    --------
    >>> ring = np.array([[179.0, 0.0], [-179.0, 0.0], [-179.0, 1.0], [179.0, 0.0]])
    >>> directed_rings([ring], "a zone")[0][:, 0].tolist()
    [179.0, 181.0, 181.0, 179.0]
    """
    borders, holes, unclear, _ = _directed(list(rings), where)
    if len(borders) > 1 or unclear:
        most = max(float(np.abs(np.diff(ring[:, 0])).max()) for ring in (unclear or rings[:1]))
        wrong = f"an edge spans {most:g} degrees of longitude, and which way around the Earth is unclear"
        fault(where, wrong, "add corners to that edge, each less than 180 degrees from the next")
    return [borders[0], *holes]


@dataclass(frozen=True)
class _Ring:
    """
    A ring, and its readings where an edge spans 180 degrees of longitude or more.

    Attributes
    ----------
    drawn
        Each edge as on a map from -180 to 180 degrees.
    shorter
        Each edge the shorter way around the Earth; None if no edge is long, or if this is ambiguous.
    fault
        Error of the ambiguity; None without it.
    """

    drawn: FloatArray
    shorter: FloatArray | None = None
    fault: FileFormatError | None = None

    @classmethod
    def of(cls, ring: FloatArray, where: str) -> "_Ring":
        """Read a ring."""
        if bool((np.abs(np.diff(ring[:, 0])) < HALF).all()):
            return cls(ring)
        try:
            shorter = unwrapped(ring, where)
        except FileFormatError as error:
            return cls(ring, None, error)
        # (a map of the whole Earth: the shorter way between two places of the antimeridian is none)
        return cls(ring, shorter if Polygon(shorter).area > 0.0 else None)

    @property
    def sure(self) -> FloatArray | None:
        """Its reading if that is clear without holes."""
        if self.shorter is None:
            return self.drawn if self.fault is None or self._is_along_a_pole else None
        return self.shorter if bool((np.ptp(self.shorter, axis=0) <= COMPACT).all()) else None

    @property
    def _is_along_a_pole(self) -> bool:
        """Return whether all long edges are at a pole, where they have no length in any direction."""
        long = np.abs(np.diff(self.drawn[:, 0])) >= HALF
        return bool((np.abs(self.drawn[:, 1]) == 90.0)[np.flatnonzero(long)[:, None] + [0, 1]].all())  # noqa: PLR2004


class _Directed(NamedTuple):
    """Readings of a border, one or both; its holes; holes whose direction is unclear, as drawn; and remarks."""

    borders: list[FloatArray]
    holes: list[FloatArray]
    unclear: list[FloatArray]
    remarks: list[str]


def _directed(rings: list[FloatArray], where: str) -> _Directed:
    """Return which way long edges go: as the holes say, else the shorter way in a compact ring, else both ways."""
    border, *others = (_Ring.of(ring, f"{where}[{index}]") for index, ring in enumerate(rings))
    holes = [hole.sure for hole in others]
    clear = [hole for hole in holes if hole is not None]
    unclear = [other.drawn for hole, other in zip(holes, others, strict=True) if hole is None]
    remarks = [UNCLEAR] if unclear else []
    readings = [one for one in (border.shorter, border.drawn) if one is not None]
    is_long = len(readings) > 1 or border.fault is not None
    told = [one for one in readings if is_long and clear and not unclear and _holds(one, clear)]
    if len(readings) > 1 and len(told) == 1:
        remarks += [LONG_WAY] if told[0] is border.drawn else [SHORT_WAY] if border.sure is None else []
        readings = told
    elif border.fault is not None and told:
        remarks.append(LONG_WAY)
    elif border.sure is not None and not (border.shorter is not None and _misses(border.shorter, clear)):
        readings = [border.sure]
    elif border.fault is not None:
        raise border.fault
    else:
        remarks.append(BOTH_WAYS)
    return _Directed(readings, [shift_hole(readings[0], hole) for hole in clear], unclear, remarks)


def _holds(border: FloatArray, holes: Sequence[FloatArray]) -> bool:
    """Return whether a reading of a border has all holes inside."""
    return bool(Polygon(border, [shift_hole(border, hole) for hole in holes]).is_valid)


def _misses(border: FloatArray, holes: Sequence[FloatArray]) -> bool:
    """Return whether the boxes of a reading of a border and of one of its holes are apart."""
    box = shapely.box(*border.min(axis=0), *border.max(axis=0))
    shifted = [shift_hole(border, hole) for hole in holes]
    return any(bool(shapely.disjoint(box, shapely.box(*one.min(axis=0), *one.max(axis=0)))) for one in shifted)


def _sorted_holes(
    outline: Polygon, holes: list[FloatArray], where: str
) -> tuple[list[FloatArray], list[FloatArray], list[str]]:
    """Return the holes of a valid outline that are open, those whose inside is closed, and remarks."""
    shapes = np.empty(len(holes), dtype=object)
    shapes[:] = [Polygon(hole) for hole in holes]
    shapely.prepare(outline)
    # (a ring that crosses itself may have the area 0)
    full = np.array(
        [one.area > 0.0 or bool(enclosed_parts(hole, where)) for one, hole in zip(shapes, holes, strict=True)],
        dtype=bool,
    )
    inside = np.asarray(shapely.covers(outline, shapes)) & full
    kept = inside & shapely.is_valid(shapes)
    touching = np.flatnonzero(kept & ~shapely.contains_properly(outline, shapes))
    kept[touching] = False
    for index in touching[:MOST_TOUCHING]:
        kept[index] = Polygon(outline.exterior, [holes[index]]).is_valid
    kept &= ~_overlapping(shapes, kept)
    if not Polygon(outline.exterior, [holes[index] for index in np.flatnonzero(kept)]).is_valid:
        # (holes that touch each other in points may cut the area into parts)
        kept[:] = False
    seen = {OUTSIDE: full & ~inside, TOUCHES: inside & ~kept, EMPTY: ~full}
    remarks = [remark for remark, which in seen.items() if which.any()]
    shut = full & ~kept
    return [holes[index] for index in np.flatnonzero(kept)], [holes[index] for index in np.flatnonzero(shut)], remarks


def _overlapping(shapes: ObjectArray, among: BoolArray) -> BoolArray:
    """Return which of some holes share more than points with another."""
    numbers = np.flatnonzero(among)
    found = np.zeros(len(shapes), dtype=bool)
    tree = shapely.STRtree(shapes[numbers])
    pairs = [np.empty((2, 0), dtype=np.int64)]
    for first in range(0, len(numbers), 64):
        here = tree.query(shapes[numbers[first : first + 64]], predicate="intersects")
        pairs.append(here + np.array([[first], [0]]))
        if sum(pair.shape[1] for pair in pairs) > OVERLAPS * (first + 64):
            return among
    one, other = np.concatenate(pairs, axis=1)
    one, other = numbers[one[one < other]], numbers[other[one < other]]
    bad = ~np.asarray(shapely.relate_pattern(shapes[one], shapes[other], "FF*F0****"))
    found[one[bad]] = found[other[bad]] = True
    return found


def enclosed_parts(ring: FloatArray, where: str) -> list[Polygon]:
    """
    Return all that a ring encloses, in parts; none if it encloses nothing.

    Parameters
    ----------
    ring
        Its corners, the last one equal to the first, shape ``(n, 2)``, in any units.
    where
        Name of the ring in errors.

    Raises
    ------
    FileFormatError
        If it crosses itself too often.

    Examples
    --------
    >>> star = np.array([[0, 3], [2, -3], [-3, 1], [3, 1], [-2, -3], [0, 3]])
    >>> [round(sum(part.area for part in enclosed_parts(star, "a star")), 2), len(enclosed_parts(star, "a star"))]
    [12.24, 6]
    """
    polygon = Polygon(ring)
    if polygon.is_valid:
        return [polygon] if polygon.area > 0.0 else []
    if not _crosses_seldom(ring):
        reason = shapely.is_valid_reason(polygon).replace("[", " at [")
        fault(where, f"its outline crosses itself too often ({reason})", "redraw it, or repair it (shapely.make_valid)")
    return list(shapely.get_parts(shapely.polygonize([shapely.node(shapely.LineString(ring))])))


def _crosses_seldom(border: FloatArray) -> bool:
    """Return whether few boxes of edges overlap, so that finding all crossings is fast."""
    edges = np.asarray(shapely.linestrings(np.stack([border[:-1], border[1:]], axis=1)))
    tree, found = shapely.STRtree(edges), 0
    for first in range(0, len(edges), 64):
        found += tree.query(edges[first : first + 64]).shape[1]
        if found > OVERLAPS * (first + 64):
            return False
    return True


def shift_hole(border: FloatArray, hole: FloatArray) -> FloatArray:
    """
    Shift the longitudes of a hole by a multiple of 360 degrees to those of its border.

    Examples
    --------
    >>> shift_hole(np.array([[178.0, 0.0], [184.0, 2.0]]), np.array([[-179.0, 1.0], [-178.0, 1.5]]))[:, 0].tolist()
    [181.0, 182.0]
    """
    middle = 0.5 * (float(border[:, 0].min()) + float(border[:, 0].max()))
    turn = 360.0 * round((middle - 0.5 * (float(hole[:, 0].min()) + float(hole[:, 0].max()))) / 360.0)
    return np.column_stack([hole[:, 0] + turn, hole[:, 1]]) if turn else hole
