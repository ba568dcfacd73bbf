"""The 40 problems of the suite, in eight families, from a free field to a goal behind walls."""

from collections.abc import Iterator, Sequence
from functools import partial
from typing import Any, NamedTuple

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph.comparisons.conformance.documents import VERSION, LonLat, ProblemDocument, ThreatEntry, rings_of
from cgla_graph.comparisons.conformance.shapes import (
    blocks,
    boxes,
    crowd,
    hills,
    island,
    maze,
    ring_wall,
    speckled,
    threat,
    turned_box,
    upright,
)
from cgla_graph.model.earth import LocalProjection

#: Map units of lon/lat problems are metres; they are given to a tenth.
METRES = 1


class Draft(NamedTuple):
    """
    A problem of the suite without proven bounds.

    Attributes
    ----------
    family
        The family that it belongs to.
    title
        Its purpose in one line.
    problem
        The problem.
    """

    family: str
    title: str
    problem: ProblemDocument


def drafts() -> Iterator[Draft]:
    """
    List all problems, family by family.

    Examples
    --------
    >>> len(list(drafts()))
    40
    """
    for family in (_open, _walls, _mazes, _narrow, _crowds, _rasters, _lonlat, _infeasible):
        yield from family()


def _draft(family: str, name: str, title: str, walls: Sequence[BaseGeometry] = (), /, **keys: Any) -> Draft:  # noqa: ANN401 - of a document
    """Build a problem on the unit square, by default from left to right."""
    square = {"start": [0.05, 0.5], "goal": [0.95, 0.5], "bounds": [0.0, 0.0, 1.0, 1.0], "k": 10.0}
    # one area, so that planners which test polygons one by one see no edge inside of it
    area = rings_of(shapely.union_all(list(walls))) if walls else []
    document = ProblemDocument.model_validate({"name": f"{family}-{name}", "no_fly": area, **square, **keys})
    return Draft(family, title, document)


_ENDS = ((0.05, 0.5), (0.95, 0.5))


def _open() -> Iterator[Draft]:
    draft = partial(_draft, "open")
    yield draft("straight", "nothing in the way: the straight line is best")
    yield draft("one", "one threat on the straight line", threats=[threat(0.5, 0.5, 0.1, 0.9)])
    pocket = (
        *((0.35, 0.7), (0.45, 0.7), (0.55, 0.68), (0.63, 0.6), (0.65, 0.5)),
        *((0.63, 0.4), (0.55, 0.32), (0.45, 0.3), (0.35, 0.3)),
    )
    threats = [threat(x, y, 0.05) for x, y in pocket]
    yield draft("pocket", "a pocket of threats that opens towards the start", k=50.0, threats=threats)
    rows = (
        *((0.1, 0.62), (0.3, 0.85), (0.5, 0.93), (0.7, 0.85), (0.9, 0.62)),
        *((0.3, 0.28), (0.5, 0.4), (0.7, 0.28), (0.5, 0.15)),
    )
    ends = {"start": [0.05, 0.3], "goal": [0.95, 0.3]}
    threats = [threat(x, y, 0.09, 0.7) for x, y in rows]
    yield draft("valley", "a curved valley between two rows of broad threats", k=20.0, **ends, threats=threats)
    title = "a threat so strong that the best path keeps to the edge of a map that is no unit square"
    map_units = {"start": [-400.0, -100.0], "goal": [400.0, -80.0], "bounds": [-500.0, -250.0, 500.0, 250.0]}
    yield draft("border", title, k=200.0, **map_units, threats=[threat(0.0, 30.0, 140.0, 0.8)])


def _walls() -> Iterator[Draft]:
    draft = partial(_draft, "walls")
    yield draft("corner", "around one wall: two bends at its corners", [shapely.box(0.45, 0.2, 0.55, 0.75)])
    gaps = ((0.25, (0.75, 0.9)), (0.5, (0.1, 0.25)), (0.75, (0.7, 0.8)))
    staggered = [part for x, gap in gaps for part in upright(x, 0.04, [gap])]
    yield draft("staggered", "three walls with gaps up and down", staggered)
    guarded = upright(0.5, 0.05, [(0.1, 0.2), (0.45, 0.55)])
    title = "a wall with two gaps: the near one is guarded by a threat"
    yield draft("guarded", title, guarded, k=15.0, threats=[threat(0.5, 0.5, 0.08, 0.9)])
    title = "a wall too thin for checks of sampled points, and a threat at its short end"
    thin = [shapely.box(0.499, 0.1, 0.501, 0.62)]
    yield draft("thin", title, thin, k=15.0, threats=[threat(0.5, 0.68, 0.06, 0.9)])
    title = "start and goal on the corners of a wall: the best path runs along its edge"
    wall, ends = [shapely.box(0.2, 0.3, 0.8, 0.5)], {"start": [0.2, 0.5], "goal": [0.8, 0.5]}
    yield draft("along", title, wall, **ends, threats=[threat(0.5, 0.62, 0.05, 0.5)])
    sizes = ((0.3, 0.45, 0.5, 0.04, 70), (0.65, 0.6, 0.5, 0.04, -60), (0.8, 0.2, 0.3, 0.05, 20))
    slanted, threats = [turned_box(*size) for size in sizes], crowd(5, 16, (0.05, 0.12), ends=_ENDS)
    yield draft("slanted", "slanted walls among threats", slanted, k=20.0, threats=threats)


def _mazes() -> Iterator[Draft]:
    for name, title, seed, size, thickness, opened, risk in (
        ("small", "a maze of 4 x 4 rooms with one way", 1, 4, 0.04, 0, 0),
        ("large", "a maze of 10 x 10 rooms with one way", 2, 10, 0.02, 0, 0),
        ("open", "a maze of 8 x 8 rooms with many ways", 3, 8, 0.02, 16, 0),
        ("risky", "a maze of 7 x 7 rooms with several ways, and threats in it", 4, 7, 0.02, 12, 12),
    ):
        middle = round(0.5 / size, 4)
        start, goal = (middle, middle), (round(1 - middle, 4), round(1 - middle, 4))
        threats = crowd(seed, risk, (0.03, 0.06), ends=(start, goal))
        walls = maze(seed, size, thickness, opened=opened)
        yield _draft("maze", name, title, walls, start=list(start), goal=list(goal), threats=threats)


def _narrow() -> Iterator[Draft]:
    draft = partial(_draft, "narrow")
    yield draft("slit", "a slit of 1/50 in a thick wall", upright(0.5, 0.2, [(0.3, 0.32)]))
    yield draft("crack", "a slit of 1/1000 in a thin wall", upright(0.5, 0.02, [(0.7, 0.701)]))
    gaps, threats = upright(0.5, 0.1, [(0.2, 0.205), (0.6, 0.9)]), [(0.5, 0.7, 0.12, 0.9), (0.7, 0.8, 0.1, 0.8)]
    title = "a slit of 1/200, or a wide gap behind threats"
    yield draft("choice", title, gaps, k=20.0, threats=[threat(*one) for one in threats])
    corridor = (
        *((0.02, 0.4, 0.12, 0.6), (0.88, 0.4, 0.98, 0.6), (0.1, 0.49, 0.26, 0.51), (0.24, 0.49, 0.26, 0.8)),
        *((0.24, 0.78, 0.51, 0.8), (0.49, 0.2, 0.51, 0.8), (0.49, 0.2, 0.75, 0.22), (0.73, 0.2, 0.75, 0.51)),
        (0.73, 0.49, 0.9, 0.51),
    )
    free = shapely.union_all([shapely.box(*bounds) for bounds in corridor])
    rest = shapely.box(-0.125, -0.125, 1.125, 1.125).difference(free)
    yield draft("zigzag", "a corridor of 1/50 that bends six times", [rest])
    title = "the goal in a round wall with a small door on the far side"
    ring, ends = ring_wall(0.7, 0.5, 0.2, 0.03, corners=7, gap=0.25, turned=0.9), {"start": [0.1, 0.5]}
    yield draft("door", title, [ring], **ends, goal=[0.7, 0.5], threats=[threat(0.6, 0.2, 0.1, 0.9)])


def _crowds() -> Iterator[Draft]:
    for name, title, seed, count, spread, k in (
        ("10", "10 broad threats", 11, 10, (0.06, 0.15), 10.0),
        ("30", "30 threats of medium size", 12, 30, (0.03, 0.08), 20.0),
        ("60", "60 small threats, strongly weighted", 13, 60, (0.02, 0.05), 60.0),
        ("120", "120 small threats", 14, 120, (0.015, 0.04), 25.0),
        ("flat", "25 threats, weakly weighted: close to the straight line", 15, 25, (0.05, 0.1), 0.5),
    ):
        yield _draft("crowd", name, title, threats=crowd(seed, count, spread, ends=_ENDS), k=k)
    walls, threats = boxes(16, 18, (0.06, 0.2), _ENDS, 0.05), crowd(16, 20, (0.03, 0.08), ends=_ENDS)
    yield _draft("crowd", "boxes", "20 threats between 18 boxes", walls, k=15.0, threats=threats)


def _raster(values: list[list[float]], how: str, bounds: Sequence[float] = (0.0, 0.0, 1.0, 1.0)) -> dict[str, Any]:
    return {"bounds": list(bounds), "interpolation": how, "values": values}


def _rasters() -> Iterator[Draft]:
    draft = partial(_draft, "raster")
    smooth = _raster(hills(21, 24, 14, 1.0), "bilinear")
    yield draft("hills", "smooth hills, 24 x 24 cells, bilinear", rasters=[smooth])
    town, ends = _raster(blocks(22, 9, 4, (0.3, 0.5, 0.8)), "nearest"), {"start": [0.1, 0.16], "goal": [0.9, 0.7]}
    yield draft("town", "quarters and streets, 9 x 9 cells, nearest: risk jumps", k=4.0, **ends, rasters=[town])
    streets, ends = _raster(blocks(23, 16, 5, (0.3, 0.6, 1.0)), "bilinear"), {"start": [0.1, 0.1], "goal": [0.9, 0.8]}
    yield draft("streets", "quarters and streets, 16 x 16 cells, bilinear", k=6.0, **ends, rasters=[streets])
    cells = _raster(speckled(24, 10, (0.2, 0.5, 1.0)), "nearest")
    yield draft("speckled", "10 x 10 cells of three values, nearest", k=3.0, rasters=[cells])
    patch = _raster(island(hills(25, 20, 8, 1.2)), "bilinear", (0.25, 0.2, 0.75, 0.8))
    title, threats = (
        "a raster that covers a part of the map, and threats beside it",
        crowd(25, 8, (0.04, 0.09), ends=_ENDS),
    )
    yield draft("patch", title, k=12.0, rasters=[patch], threats=threats)
    rasters = [_raster(hills(26, 20, 10, 0.8), "bilinear"), _raster(speckled(27, 8, (0.0, 0.2, 0.4)), "bilinear")]
    walls = [*upright(0.35, 0.03, [(0.62, 0.72)]), *upright(0.65, 0.03, [(0.25, 0.4)])]
    title, threats = "two rasters on top of each other, walls and threats", crowd(27, 6, (0.05, 0.1), ends=_ENDS)
    yield draft("walls", title, walls, k=8.0, rasters=rasters, threats=threats)


class _Place(NamedTuple):
    """A problem in degrees: threats are longitude, latitude, spread (metres) and peak, zones are rings of corners."""

    name: str
    title: str
    start: tuple[float, float]
    goal: tuple[float, float]
    k: float
    threats: Sequence[tuple[float, float, float, float]]
    zones: Sequence[Sequence[tuple[float, float]]] = ()


_PLACES = (
    _Place(
        "gulf", "Helsinki to Tallinn, over two shipping lanes", (24.95, 60.16), (24.75, 59.45), 4.0,
        [(24.6, 59.85, 9e3, 0.7), (25.0, 59.83, 8e3, 0.9), (25.4, 59.86, 9e3, 0.7), (24.8, 59.62, 5e3, 0.5)],
    ),
    _Place(
        "finland", "Helsinki to Tampere, around two zones", (24.94, 60.17), (23.76, 61.5), 6.0,
        [(24.2, 60.7, 15e3, 0.8), (24.5, 61.1, 12e3, 0.8), (23.7, 60.95, 10e3, 0.6), (24.9, 60.9, 9e3, 0.7)],
        [
            [(24.78, 60.28), (25.15, 60.28), (25.15, 60.4), (24.78, 60.4)],
            [(23.5, 61.36), (23.72, 61.33), (23.8, 61.42), (23.56, 61.45)],
        ],
    ),
    _Place(
        "alps", "Innsbruck to Bolzano, through valleys between peaks", (11.4, 47.27), (11.35, 46.5), 8.0,
        [
            (11.2, 47.0, 9e3, 1.0), (11.65, 47.05, 8e3, 1.0), (11.45, 46.82, 7e3, 0.9), (11.1, 46.72, 8e3, 0.9),
            (11.75, 46.75, 9e3, 1.0), (11.6, 46.55, 5e3, 0.7),
        ],
        [[(11.3, 46.9), (11.42, 46.88), (11.4, 46.97)]],
    ),
    _Place(
        "svalbard", "Longyearbyen to Ny-Alesund, 79 degrees north", (15.5, 78.25), (11.95, 78.92), 5.0,
        [(13.8, 78.6, 12e3, 0.9), (14.6, 78.75, 8e3, 0.8), (12.9, 78.45, 9e3, 0.7)],
        [[(12.6, 78.78), (13.4, 78.74), (13.3, 78.86)]],
    ),
)  # fmt: skip


def _lonlat() -> Iterator[Draft]:
    for place in _PLACES:
        yield Draft("lonlat", place.title, _projected(place))


def _projected(place: _Place) -> ProblemDocument:
    """Lay a problem in degrees on a plane in metres; corners are projected, the edges between them are straight."""
    projection = LocalProjection.between(place.start, place.goal)

    def metres(points: Sequence[tuple[float, float]]) -> list[list[float]]:
        return [[round(x, METRES), round(y, METRES)] for x, y in projection.forward(points).tolist()]

    centres = metres([(longitude, latitude) for longitude, latitude, *_ in place.threats])
    zones = [[metres(ring)] for ring in place.zones]
    start, goal = metres([place.start, place.goal])
    everything = [start, goal, *centres, *(corner for (ring,) in zones for corner in ring)]
    margin = 20e3
    low_x, low_y = (round(min(at[axis] for at in everything) - margin, -3) for axis in (0, 1))
    high_x, high_y = (round(max(at[axis] for at in everything) + margin, -3) for axis in (0, 1))
    return ProblemDocument(
        version=VERSION,
        name=f"lonlat-{place.name}",
        start=start,
        goal=goal,
        bounds=[low_x, low_y, high_x, high_y],
        k=place.k,
        threats=[
            ThreatEntry(x=x, y=y, spread=spread, peak=peak)
            for (x, y), (_, _, spread, peak) in zip(centres, place.threats, strict=True)
        ],
        no_fly=zones,
        lonlat=LonLat(
            origin=[round(projection.longitude, 9), round(projection.latitude, 9)],
            start=list(place.start),
            goal=list(place.goal),
            threats=[[longitude, latitude] for longitude, latitude, *_ in place.threats],
            no_fly=[[[list(corner) for corner in ring]] for ring in place.zones],
        ),
    )


def _infeasible() -> Iterator[Draft]:
    draft = partial(_draft, "infeasible")
    yield draft("wall", "a wall from border to border", upright(0.6, 0.02))
    title, ring = "the goal inside a ring without a door, the start outside", ring_wall(0.7, 0.5, 0.2, 0.01, corners=24)
    yield draft("ring", title, [ring], goal=[0.7, 0.5], threats=[threat(0.4, 0.4, 0.1, 0.8)])
    # a closed square of walls around the goal's room
    cell = [shapely.box(0.8, 0.8, 1.1, 0.85), shapely.box(0.8, 0.8, 0.85, 1.1)]
    ends = {"start": [0.0833, 0.0833], "goal": [0.93, 0.93]}
    yield draft("maze", "a maze whose last room has no door", [*maze(31, 6, 0.03), *cell], **ends)
    sizes = ((0.4, 0.2, 0.8, 0.02, 70), (0.6, 0.8, 0.8, 0.02, 60), (0.5, 0.5, 0.4, 0.02, 100))
    title, threats = (
        "slanted walls that overlap, from border to border, and threats",
        crowd(34, 12, (0.04, 0.1), ends=_ENDS),
    )
    yield draft("slanted", title, [turned_box(*size) for size in sizes], threats=threats)
