"""Areas that are drawn on the page: their corners as the scenario file has them, and the areas that they close."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import NamedTuple

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import number_array
from cgla_graph.airspace.zones.rings import directed_rings, enclosed_parts
from cgla_graph.errors import CglaError, FileFormatError, ProblemError
from cgla_graph.model.earth import FARTHEST, LocalProjection, project_area, project_on_map, require_degrees, wrapped
from cgla_graph.model.no_fly import overlay_errors

#: Digits behind the point of degrees that the page has moved: a centimetre.
DIGITS = 7
#: Digits to which a turn of 360 degrees keeps a longitude.
EXACT = 12
#: Most outlines that are kept for the next draft.
MOST_KEPT = 1000
#: Tolerance of an outline that is sent, as a share of the area's longer side.
SLACK = 1.0 / 4000.0

Corners = Sequence[Sequence[float]]


class Closed(NamedTuple):
    """
    The area that a ring on the page closes.

    Attributes
    ----------
    rings
        The rings of the scenario file: the corners of the area, or the outlines of what it encloses.
    shape
        The closed area, map units.
    outline
        The rings that the page draws, map units; None where the polygon of its corners looks the same.
    note
        A remark for the user; may be empty.
    """

    rings: list[list[list[float]]]
    shape: BaseGeometry
    outline: list[FloatArray] | None
    note: str


@dataclass(frozen=True, eq=False)
class WrittenPlaces:
    """
    The numbers that a scenario file has for places on the page.

    A place that the page has not moved keeps the file's own numbers, to the last bit.

    Attributes
    ----------
    projection
        Of a file in degrees; None for one in map units.
    box
        The bounds of a map in degrees.

    Examples
    --------
    >>> places = WrittenPlaces(LocalProjection(24.0, 60.0), (23.0, 59.0, 25.0, 61.0))
    >>> laid = places.lay([[24.12345678901, 60.0]])
    >>> places.written(laid), places.written(laid + 0.25)
    ([[24.12345678901, 60.0]], [[24.1234613, 60.0000022]])
    """

    projection: LocalProjection | None = None
    box: Bounds | None = None
    _known: dict[tuple[float, ...], list[float]] = field(default_factory=dict, repr=False)
    _rings: dict[tuple[tuple[float, ...], ...], list[list[float]]] = field(default_factory=dict, repr=False)
    _closed: dict[tuple[str, tuple[tuple[float, ...], ...]], Closed] = field(default_factory=dict, repr=False)

    def lay(self, written: Corners) -> FloatArray:
        """Return places of the file in map units, shape ``(n, 2)``, and remember their numbers."""
        points = np.array(written, dtype=np.float64).reshape(-1, 2)
        if self.projection is None:
            return points
        laid = self.projection.forward(np.column_stack([wrapped(points[:, 0]), points[:, 1]]))
        # (only areas may go on beyond 180 degrees)
        points[:, 0] = np.where(np.abs(points[:, 0]) <= 180.0, points[:, 0], wrapped(points[:, 0]).round(EXACT))  # noqa: PLR2004
        self._known.update(zip(map(tuple, laid.tolist()), points.tolist(), strict=True))
        return laid

    def lay_ring(self, written: Corners) -> list[list[float]]:
        """Return the corners of a ring of the file, closed or not, in map units, each once."""
        ring = [
            list(corner) for corner in (written[:-1] if len(written) > 1 and written[0] == written[-1] else written)
        ]
        laid: list[list[float]] = self.lay(ring).tolist()
        self._rings[tuple(map(tuple, laid))] = ring
        return laid

    def written(self, places: Corners | FloatArray) -> list[list[float]]:
        """Return places on the page in the numbers of the file."""
        points = np.array(places, dtype=np.float64).reshape(-1, 2)
        if self.projection is None:
            kept: list[list[float]] = points.tolist()
            return kept
        beyond = np.hypot(*points.T) > FARTHEST
        if beyond.any():
            msg = f"{points[beyond][0].tolist()} is no place on the Earth: drag it nearer to the middle of the map"
            raise ProblemError(msg)
        degrees = self.projection.inverse(points).round(DIGITS).tolist()
        return [self._known.get(tuple(place), found) for place, found in zip(points.tolist(), degrees, strict=True)]

    def moved(self, places: Corners | FloatArray) -> FloatArray:
        """Return places on the page where the file that Save writes has them, map units, shape ``(n, 2)``."""
        points = np.array(places, dtype=np.float64).reshape(-1, 2)
        return points if self.projection is None else self._forward(self.written(points))

    def closed(self, area: Corners, name: str) -> Closed:
        """
        Return the area that a ring closes: all that it encloses.

        Raises
        ------
        CglaError
            If it encloses nothing, or no file can have such an area; the message begins with `name`.

        Examples
        --------
        >>> bow = [[0.0, 0.0], [1.0, 1.0], [1.0, 0.0], [0.0, 1.0]]
        >>> found = WrittenPlaces().closed(bow, "no-fly area 1")
        >>> found.shape.area, len(found.rings), found.note
        (0.5, 2, 'no-fly area 1 crosses itself: all that it encloses is closed, and Save writes the outline of that')
        """
        key = name, tuple(map(tuple, area))
        found = self._closed.get(key)
        if found is None:
            with overlay_errors():
                found = self._close(area, name)
            while len(self._closed) >= MOST_KEPT:
                self._closed.pop(next(iter(self._closed)), None)
            self._closed[key] = found
        return found

    def _close(self, area: Corners, name: str) -> Closed:
        ring = self._ring(area)
        # (a ring whose last corner lies on its first one has both)
        corners = np.array([*ring, ring[0]], dtype=np.float64)
        if self.projection is not None:
            require_degrees(name, corners)
            corners = _directed(corners, name)
        parts = enclosed_parts(corners, name)
        if not parts:
            msg = f"{name} encloses nothing: drag its corners apart, or delete it"
            raise ProblemError(msg)
        shape: BaseGeometry = shapely.Polygon(corners)
        rings, note = [[*ring, ring[0]] if ring[0] == ring[-1] else ring], ""
        if not shape.is_valid:
            filled = (shapely.Polygon(one.exterior) for one in shapely.get_parts(shapely.union_all(parts)))
            shape = shapely.union_all(list(filled))
            rings = [shapely.get_coordinates(one.exterior)[:-1].tolist() for one in shapely.get_parts(shape)]
            note = f"{name} crosses itself: all that it encloses is closed, and Save writes the outline of that"
        outline = [shapely.get_coordinates(one.exterior)[:-1] for one in shapely.get_parts(shape)] if note else None
        if self.projection is not None and self.box is not None:
            seen = project_area(shape, self.projection)
            shape = project_on_map(shape, self.box, self.projection)
            outline = _outline(seen, 0 if note else len(area))
        return Closed(rings, shape, outline, note)

    def _ring(self, area: Corners) -> list[list[float]]:
        """Return the ring of the file: an unmoved one as it is, another one with each edge the shorter way."""
        known = self._rings.get(tuple(map(tuple, area)))
        ring = known or self.written(area)
        if known is not None or self.projection is None:
            return ring
        around = np.array(ring)
        around[:, 0] += 360.0 * np.round((self.projection.longitude - around[:, 0]) / 360.0)
        turned = np.column_stack([wrapped(around[:, 0]).round(EXACT), around[:, 1]])
        if _same(turned, around):
            return [[x if abs(x) <= 180.0 else u, y] for (x, y), (u, _) in zip(ring, turned.tolist(), strict=True)]  # noqa: PLR2004
        beyond: list[list[float]] = np.column_stack([around[:, 0].round(EXACT), around[:, 1]]).tolist()
        return beyond

    def _forward(self, written: Corners) -> FloatArray:
        points = np.array(written, dtype=np.float64)
        assert self.projection is not None  # noqa: S101 - a map in degrees
        return self.projection.forward(np.column_stack([wrapped(points[:, 0]), points[:, 1]]))


def _directed(ring: FloatArray, name: str) -> FloatArray:
    """Return a ring in degrees with each edge the shorter way; errors begin with the name of the area."""
    try:
        return directed_rings([ring], name)[0]
    except FileFormatError as error:
        raise FileFormatError(str(error).replace(f"{name}[0]", name)) from error


def _same(turned: FloatArray, around: FloatArray) -> bool:
    """Return whether a ring between -180 and 180 degrees is read as the ring around the origin of the map."""
    ring = np.concatenate([turned, turned[:1]])
    try:
        read = directed_rings([ring], "a ring")[0][:-1]
    except CglaError:
        return False
    away = read[:, 0] - around[:, 0]
    return bool(np.ptp(away) < 1.0)


def _outline(shape: BaseGeometry, corners: int) -> list[FloatArray] | None:
    """Return rings in metres as a picture needs them; None where the polygon of so many corners looks the same."""
    bounds = np.array(shapely.bounds(shape))
    simple = shapely.simplify(shape, SLACK * float(np.max(bounds[2:] - bounds[:2])))
    rings = [shapely.get_coordinates(one.exterior)[:-1] for one in shapely.get_parts(simple)]
    return None if len(rings) == 1 and len(rings[0]) == corners else rings


def as_flat(points: ArrayLike) -> list[float]:
    """
    Return points as x, y, x, y, ….

    Examples
    --------
    >>> as_flat([[0, 1], [2, 3]])
    [0.0, 1.0, 2.0, 3.0]
    """
    found: list[float] = number_array("points", points).ravel().tolist()
    return found
