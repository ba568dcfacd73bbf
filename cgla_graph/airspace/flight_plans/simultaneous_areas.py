"""Areas that count at the same time on parts of a leg, if the height changes along it."""

import itertools
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any, Final, Protocol, TypeAlias

import numpy as np
import shapely
from shapely.geometry import LineString
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph.airspace.flight_plans.area_outline import ClosedArea, Outline

#: Parts of a leg, as shares of it from 0 to 1, in order: where each begins and ends.
Shares: TypeAlias = Sequence[tuple[float, float]]
WHOLE: Final[Shares] = ((0.0, 1.0),)
#: Limits beyond which all areas count at all heights: corners of all sets of areas that count at the same time, and
#: parts of legs times areas.
MOST_BUILT, MOST_PAIRS = 1_000_000, 3_000_000
#: Areas on a part of a leg up to which these are grouped by whether they meet.
MOST_GROUPED: Final = 100
#: Groups of legs whose clearances are computed at their heights; for further legs, all areas count.
MOST_GROUPS: Final = 50
#: Legs near areas whose clearances are computed with elevations; for further legs, all areas may count.
MOST_REFINED: Final = 10_000
#: Climbs and descents above one place of a plan up to which the distance of each to an area is computed.
MOST_PLACES: Final = 1000


class HeightOverlap(Protocol):
    """Parts of a route where the aircraft may be at the height of an area."""

    def on_leg(self, leg: int, area: int, beside: float = 0.0) -> Shares:
        """Return the parts of a leg, within a distance of an area, where it may be at the height of the area."""

    def at_place(self, place: int, area: int, beside: float = 0.0) -> bool:
        """Return whether it may be at the height of an area, up to a distance from a place, as it climbs or circles."""

    def goes_upright(self, place: int) -> bool:
        """Return whether it climbs or descends vertically at a place."""

    def may_meet_at(self, place: int) -> BoolArray:
        """Return the areas that may be at its heights at a place, without elevations, shape ``(n_areas,)``."""

    def note_all_count(self, leg: int) -> None:
        """Note that all areas count on a leg, because there are too many to compare."""

    def kinds(self) -> tuple[IntArray, BoolArray] | None:
        """
        Return the kind of each leg (legs of equal heights), and the areas that legs of a kind may meet.

        Shapes ``(n_legs,)`` and ``(n_kinds, n_areas)``; None if the table would be too large.
        """


@dataclass(frozen=True, eq=False)
class Part:
    """
    A part of a leg on which the same areas count.

    Attributes
    ----------
    start, end
        Its ends, map units.
    outline
        Outline of the areas that count here.
    areas
        Numbers of these areas; None for all.
    """

    start: FloatArray
    end: FloatArray
    outline: Outline
    areas: frozenset[int] | None


class SimultaneousAreas:
    """
    Sets of areas that count at the same time on a part of a leg.

    Parameters
    ----------
    areas
        All areas.
    outline
        Outline of their union.
    heights
        Where the route is at the height of each area; None if all areas count everywhere.
    """

    def __init__(self, areas: Sequence[ClosedArea], outline: Outline, heights: HeightOverlap | None) -> None:
        self.areas, self.outline, self.heights = areas, outline, heights
        self.shapes = np.array([one.shape for one in areas], dtype=object)
        self.tree = shapely.STRtree(self.shapes)
        self.sets: dict[frozenset[int], Outline] = {}
        self.met: dict[tuple[int, int], bool] = {}
        self.built = self.pairs = 0
        #: For each leg that `parts` divided: the areas that it meets, and the distance of those that count.
        self.beside: dict[int, tuple[frozenset[int], float]] = {}

    def _near(self, shape: shapely.Geometry) -> list[int]:
        return sorted(self.tree.query(shape, predicate="intersects").tolist())

    def _outline_of(self, numbers: frozenset[int]) -> Outline | None:
        """Return the outline of the union of some areas; None beyond `MOST_BUILT` corners in all."""
        if numbers not in self.sets:
            shapes = [self.areas[number].shape for number in sorted(numbers)]
            corners = int(shapely.get_num_coordinates(shapes).sum())
            if self.built + corners > MOST_BUILT:
                return None
            self.built += corners
            self.sets[numbers] = Outline(shapely.GeometryCollection(shapes))
        return self.sets[numbers]

    def may_cross(self, crosses: BoolArray) -> BoolArray:
        """Return the legs that may cross an area at their heights, of those that cross one if all areas count."""
        kinds = None if self.heights is None else self.heights.kinds()
        return crosses if kinds is None else crosses & np.asarray(kinds[1].any(axis=1))[kinds[0]]

    def parts(self, leg: int, start: FloatArray, end: FloatArray) -> list[Part]:
        """Return the parts of a leg on which areas count, in order, including parts of length 0."""
        everything = [Part(start, end, self.outline, None)]
        if self.heights is None:
            return everything
        near = self._near(LineString([start, end]))
        spans = {number: self.heights.on_leg(leg, number) for number in near}
        if all(tuple(span) == WHOLE for span in spans.values()):
            return everything
        shares = {share for span in spans.values() for one in span for share in one}
        self.pairs += len(near) * (len(shares) + 1)
        if self.pairs > MOST_PAIRS:
            self.heights.note_all_count(leg)
            return everything
        cuts = sorted({0.0, 1.0, *shares})
        points = {one[0] for span in spans.values() for one in span if one[0] == one[1]}
        found, nearest = [], np.inf
        for first, last in sorted([*itertools.pairwise(cuts), *((point, point) for point in points)]):
            counts = [n for n, span in spans.items() if any(a <= first and last <= b for a, b in span)]
            if not counts:
                continue
            here = _along(start, end, first), _along(start, end, last)
            away = shapely.distance(LineString(here), self.shapes[counts])
            nearest = min(nearest, float(away.min()))
            for numbers in self._side_by_side([n for n, far in zip(counts, away.tolist(), strict=True) if far == 0.0]):
                outline = self._outline_of(numbers)
                if outline is None:
                    self.heights.note_all_count(leg)
                    return everything
                found.append(Part(*here, outline, numbers))
        self.beside[leg] = frozenset(near), nearest
        return found

    def _side_by_side(self, numbers: Sequence[int]) -> list[frozenset[int]]:
        """Return areas in groups that are connected; groups that do not meet can be tested one by one."""
        if len(numbers) > MOST_GROUPED:
            return [frozenset(numbers)]
        groups: list[frozenset[int]] = []
        for number in numbers:
            met = [group for group in groups if any(self._meet(number, other) for other in group)]
            groups = [group for group in groups if group not in met] + [frozenset([number]).union(*met)]
        return groups

    def _meet(self, one: int, other: int) -> bool:
        key = min(one, other), max(one, other)
        if key not in self.met:
            self.met[key] = bool(shapely.intersects(self.shapes[one], self.shapes[other]))
        return self.met[key]

    def uprights(self, route: FloatArray, rounding: float) -> Iterator[tuple[int, list[int]]]:
        """Yield places where the aircraft climbs or descends inside areas by more than a rounding, and the areas."""
        heights = self.heights
        if heights is None:
            return
        for index in filter(heights.goes_upright, range(len(route))):
            place = route[index]
            # (areas that share a border there are joined)
            near = self.tree.query(shapely.Point(place), predicate="dwithin", distance=rounding).tolist()
            numbers = frozenset(n for n in near if heights.at_place(index, n))
            if not numbers:
                continue
            outline = self._outline_of(numbers) or self.outline
            if outline.area.contains(place) and outline.distances(place[None], place[None])[0] > rounding:
                yield index, sorted(numbers)

    def nearest_at_places(self, route: FloatArray, required: float) -> Iterator[tuple[int, int, float]]:
        """
        Yield the places where the aircraft climbs or descends, with the nearest area there and its distance.

        Parameters
        ----------
        route
            The route, shape ``(m, 2)``, map units.
        required
            Distances below this are exact. Others are at least this; of plans with many such places, they are left out.
        """
        heights = self.heights
        places = [] if heights is None else [index for index in range(len(route)) if heights.goes_upright(index)]
        if heights is None or not places:
            return
        near: dict[int, list[int]] = {}
        if required > 0.0:
            found = self.tree.query(shapely.points(route[places]), predicate="dwithin", distance=required)
            for place, area in found.T.tolist():
                near.setdefault(places[place], []).append(area)
        trees: dict[bytes, shapely.STRtree] = {}
        for index in places:
            here = shapely.Point(route[index])
            numbers = [number for number in near.get(index, []) if heights.at_place(index, number, required)]
            if numbers:
                away = shapely.distance(self.shapes[numbers], here)
                yield index, numbers[int(np.argmin(away))], float(away.min())
            elif len(places) <= MOST_PLACES and (counts := heights.may_meet_at(index)).any():
                tree = trees.setdefault(counts.tobytes(), shapely.STRtree(self.shapes[counts]))
                nearest, distances = tree.query_nearest(here, return_distance=True, all_matches=False)
                yield index, int(np.nonzero(counts)[0][nearest[0]]), max(float(distances[0]), required)

    def widen_clearances(
        self,
        starts: FloatArray,
        ends: FloatArray,
        clean: IntArray,
        crosses: BoolArray,
        clearances: FloatArray,
        required: float = 0.0,
    ) -> None:
        """
        Change clearances of legs that cross no area to the distance from areas at their heights.

        Without elevations first: areas count that may be at the heights of a leg. Then areas within the required
        distance are compared with the parts of the leg there, with elevations.

        Parameters
        ----------
        starts, ends
            Ends of all legs, shape ``(n, 2)``, map units.
        clean
            Numbers of the legs that cross no area.
        crosses
            Whether each leg crosses an area if all areas count, shape ``(n,)``.
        clearances
            Distance from all areas, shape ``(n,)``, map units; changed in place.
        required
            Distance to be kept, map units.
        """
        kinds = None if self.heights is None else self.heights.kinds()
        if kinds is None:
            return
        kind, meets = kinds
        groups: dict[tuple[int, frozenset[int]], list[int]] = {}
        for leg in clean.tolist():
            beside = self.beside.get(leg, (frozenset[int](), np.inf))[0]
            if leg in self.beside or (not crosses[leg] and not meets[kind[leg]].all()):
                groups.setdefault((int(kind[leg]), beside), []).append(leg)
        for (which, beside), legs in list(groups.items())[:MOST_GROUPS]:
            counts = meets[which].copy()
            counts[list(beside)] = False
            numbers = frozenset(np.nonzero(counts)[0].tolist())
            away = np.full(len(legs), np.inf)
            if numbers:
                outline = self._outline_of(numbers)
                if outline is None:
                    continue
                away = outline.distances(starts[legs], ends[legs])
            own = np.array([self.beside[leg][1] if leg in self.beside else np.inf for leg in legs])
            clearances[legs] = np.minimum(away, own)
        if self.heights is None or required <= 0.0:
            return
        near, divided = NearAreas(self.shapes, self.tree, self.heights), self.beside.keys()
        close = [
            leg for leg in clean.tolist() if leg not in divided and not crosses[leg] and clearances[leg] < required
        ]
        for leg in [*sorted(divided & set(clean.tolist())), *close[:MOST_REFINED]]:
            line = LineString([starts[leg], ends[leg]])
            clearances[leg] = near.distance(leg, line, meets[kind[leg]], required)


class NearAreas:
    """
    Distances of areas from legs, at the heights of both.

    Parameters
    ----------
    shapes, tree
        Shapes of the areas, shape ``(n_areas,)``, map units, and the tree of them.
    heights
        Where the route is at the height of each area.
    """

    def __init__(self, shapes: "np.ndarray[Any, Any]", tree: shapely.STRtree, heights: HeightOverlap) -> None:
        self.shapes, self.tree, self.heights = shapes, tree, heights
        self.pairs = 0

    def distance(self, leg: int, shape: BaseGeometry, counts: BoolArray, required: float, reach: float = 0.0) -> float:
        """
        Return the least distance of a leg from an area that counts at its heights; infinite without any.

        Parameters
        ----------
        leg
            Number of the leg.
        shape
            Its line, or all that may be flown through, map units.
        counts
            Which areas may count on the leg, without using elevations, shape ``(n_areas,)``.
        required
            Areas within this distance are compared with the parts of the leg there, with elevations, map units.
        reach
            Distance from the line that may be flown through, map units; 0 if `shape` is the line.
        """
        near = [n for n in self.tree.query(shape, predicate="dwithin", distance=required).tolist() if counts[n]]
        others = counts.copy()
        others[near] = False
        found = math.inf
        for number in near:
            self.pairs += 1
            # (beyond the limit, each counts)
            spans = WHOLE if self.pairs > MOST_PAIRS else self.heights.on_leg(leg, number, required + reach)
            parts = [shape] * bool(spans) if reach > 0.0 else [_part(shape, *span) for span in spans]
            found = min([found, *shapely.distance(parts, self.shapes[number]).tolist()])
        if found >= required and others.any():
            found = min(found, float(shapely.distance(shape, self.shapes[others]).min()))
        return found


def _part(line: BaseGeometry, first: float, last: float) -> LineString:
    """Return the part of a line of two ends between two shares of it."""
    start, end = shapely.get_coordinates(line)
    return LineString([_along(start, end, first), _along(start, end, last)])


def _along(start: FloatArray, end: FloatArray, share: float) -> FloatArray:
    """Return a point of a leg; its ends are exact."""
    return start if share == 0.0 else end if share == 1.0 else start + share * (end - start)
