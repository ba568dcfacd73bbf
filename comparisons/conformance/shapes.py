"""Parts of the suite's maps: walls, mazes, threats, rasters; equal on every machine."""

import math
from collections.abc import Iterator, Sequence

import shapely
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import Point
from cgla_graph.scenarios.drawing import Stream

#: Decimals of all drawn or computed numbers, few enough that every machine rounds them alike.
DECIMALS = 4


def threat(x: float, y: float, spread: float, peak: float = 1.0) -> dict[str, float]:
    """Write a threat."""
    return {"x": x, "y": y, "spread": spread, "peak": peak}


def crowd(
    seed: int,
    count: int,
    spread: tuple[float, float],
    *,
    peak: tuple[float, float] = (0.3, 1.0),
    ends: Sequence[Point] = (),
    clear: float = 0.1,
) -> list[dict[str, float]]:
    """Draw threats evenly over the unit square, their centres clear of the ends."""
    stream, found = Stream(seed), list[dict[str, float]]()
    while len(found) < count:
        x, y, width, height = (
            round(stream.between(low, high), DECIMALS) for low, high in ((0.0, 1.0), (0.0, 1.0), spread, peak)
        )
        if all(math.dist((x, y), end) >= clear for end in ends):
            found.append(threat(x, y, width, height))
    return found


def upright(x: float, thickness: float, gaps: Sequence[tuple[float, float]] = ()) -> list[BaseGeometry]:
    """
    Build a wall across the unit square at one x, open between some heights; it reaches beyond the bounds.

    Examples
    --------
    >>> [part.bounds for part in upright(0.5, 0.25, [(0.25, 0.5)])]
    [(0.375, -0.125, 0.625, 0.25), (0.375, 0.5, 0.625, 1.125)]
    """
    half, beyond = 0.5 * thickness, 0.125
    edges = [-beyond, *(height for gap in gaps for height in gap), 1.0 + beyond]
    left, right = round(x - half, 6), round(x + half, 6)
    return [shapely.box(left, low, right, high) for low, high in zip(edges[::2], edges[1::2], strict=True)]


def ring_wall(
    x: float, y: float, radius: float, thickness: float, *, corners: int, gap: float = 0.0, turned: float = 0.0
) -> BaseGeometry:
    """Build a wall around a point, closed or with a gap of some angle at some angle, with a number of outer corners."""
    outer, inner = radius + 0.5 * thickness, radius - 0.5 * thickness
    if gap == 0.0:
        angles = [turned + 2.0 * math.pi * n / corners for n in range(corners)]
        return shapely.Polygon(_around(x, y, outer, angles), [_around(x, y, inner, angles)])
    first, reach = turned + 0.5 * gap, 2.0 * math.pi - gap
    angles = [first + reach * n / (corners - 1) for n in range(corners)]
    return shapely.Polygon([*_around(x, y, outer, angles), *_around(x, y, inner, angles[::-1])])


def _around(x: float, y: float, radius: float, angles: Sequence[float]) -> list[Point]:
    return [
        (round(x + radius * math.cos(angle), DECIMALS), round(y + radius * math.sin(angle), DECIMALS))
        for angle in angles
    ]


def turned_box(x: float, y: float, length: float, width: float, degrees: float) -> BaseGeometry:
    """Build a rectangle around a point, turned counter-clockwise."""
    angle = math.radians(degrees)
    along, across = (math.cos(angle), math.sin(angle)), (-math.sin(angle), math.cos(angle))
    return shapely.Polygon(
        [
            (
                round(x + 0.5 * (a * length * along[0] + b * width * across[0]), DECIMALS),
                round(y + 0.5 * (a * length * along[1] + b * width * across[1]), DECIMALS),
            )
            for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))
        ]
    )


def boxes(seed: int, count: int, size: tuple[float, float], ends: Sequence[Point], clear: float) -> list[BaseGeometry]:
    """Draw boxes over the unit square that overlap or stand apart, clear of the ends."""
    stream, found = Stream(seed), list[BaseGeometry]()
    while len(found) < count:
        x, y = (round(stream.between(0.0, 1.0), 2) for _ in range(2))
        half_x, half_y = (round(0.5 * stream.between(*size), 2) for _ in range(2))
        box = shapely.box(round(x - half_x, 2), round(y - half_y, 2), round(x + half_x, 2), round(y + half_y, 2))
        if all(box.distance(shapely.Point(end)) >= clear for end in ends):
            found.append(box)
    return found


def maze(seed: int, size: int, thickness: float, *, opened: int = 0) -> list[BaseGeometry]:
    """
    Build the walls of a maze on the unit square: one way between any two rooms, and more where walls are opened.

    Parameters
    ----------
    seed
        Seed of the random walls.
    size
        Rooms a side.
    thickness
        Of the walls.
    opened
        Number of further walls to leave out.
    """
    stream = Stream(seed)
    doors = set(_doors(stream, size))
    closed = [wall for wall in _walls(size) if wall not in doors]
    for _ in range(opened):
        closed.pop(int(stream.between(0, len(closed))))
    return [_wall_box(one, other, size, thickness) for one, other in closed]


Room = tuple[int, int]


def _walls(size: int) -> Iterator[tuple[Room, Room]]:
    """List all pairs of rooms beside each other."""
    for row in range(size):
        for column in range(size):
            if column + 1 < size:
                yield (column, row), (column + 1, row)
            if row + 1 < size:
                yield (column, row), (column, row + 1)


def _doors(stream: Stream, size: int) -> Iterator[tuple[Room, Room]]:
    """Walk through all rooms, and list the doors that this takes."""
    way, seen = [(0, 0)], {(0, 0)}
    while way:
        column, row = way[-1]
        near = [
            (x, y)
            for x, y in ((column + 1, row), (column, row + 1), (column - 1, row), (column, row - 1))
            if 0 <= x < size and 0 <= y < size and (x, y) not in seen
        ]
        if not near:
            way.pop()
            continue
        room = near[int(stream.between(0, len(near)))]
        yield min(way[-1], room), max(way[-1], room)
        seen.add(room)
        way.append(room)


def _wall_box(one: Room, other: Room, size: int, thickness: float) -> BaseGeometry:
    """Build the wall between two rooms, its ends included; at the border it reaches beyond the bounds."""
    half = 0.5 * thickness
    low, high = ([round(n / size + sign * half, 6) for n in range(size + 1)] for sign in (-1, 1))
    (column, row), upright_wall = other, one[1] == other[1]
    if upright_wall:
        return shapely.box(low[column], low[row], high[column], high[row + 1])
    return shapely.box(low[column], low[row], high[column + 1], high[row])


def hills(seed: int, size: int, count: int, greatest: float) -> list[list[float]]:
    """Draw a smooth raster over a square: hills of several widths, cut off below, with valleys of no risk."""
    stream = Stream(seed)
    bumps = [tuple(stream.between(low, high) for low, high in ((0, 1), (0, 1), (0.06, 0.18))) for _ in range(count)]

    def height(x: float, y: float) -> float:
        return max(math.exp(-((x - a) ** 2 + (y - b) ** 2) / (2.0 * w * w)) for a, b, w in bumps)

    return [
        [round(greatest * max(0.0, height((i + 0.5) / size, (j + 0.5) / size) - 0.1), 2) for i in range(size)]
        for j in range(size)
    ]


def island(values: list[list[float]]) -> list[list[float]]:
    """
    Set the outer cells of a raster to 0, so that risk does not jump at its edge.

    Examples
    --------
    >>> island([[1.0, 1.0, 1.0], [1.0, 2.0, 1.0], [1.0, 1.0, 1.0]])
    [[0.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.0, 0.0, 0.0]]
    """
    last, right = len(values) - 1, len(values[0]) - 1
    return [
        [0.0 if j in {0, last} or i in {0, right} else one for i, one in enumerate(row)] for j, row in enumerate(values)
    ]


def blocks(seed: int, size: int, streets: int, levels: Sequence[float]) -> list[list[float]]:
    """Draw a raster of quarters with one value each, and streets of no risk between them, a cell wide."""
    stream, drawn = Stream(seed), dict[Room, float]()

    def value(i: int, j: int) -> float:
        if i % streets == 0 or j % streets == 0:
            return 0.0
        quarter = i // streets, j // streets
        if quarter not in drawn:
            drawn[quarter] = levels[int(stream.between(0, len(levels)))]
        return drawn[quarter]

    return [[value(i, j) for i in range(size)] for j in range(size)]


def speckled(seed: int, size: int, levels: Sequence[float]) -> list[list[float]]:
    """Draw a raster whose cells have one of some values each."""
    stream = Stream(seed)
    return [[levels[int(stream.between(0, len(levels)))] for _ in range(size)] for _ in range(size)]
