"""Random problems of every kind, each made from a number: what solvers and proofs are tried on."""

import math
import warnings
from collections.abc import Callable
from contextlib import suppress
from dataclasses import replace
from functools import partial

import numpy as np
import shapely
import shapely.affinity

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.errors import ProblemError

WALL = shapely.box(0.45, 0.1, 0.55, 0.9)
RING = shapely.box(0.6, 0.6, 0.95, 0.95).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
Rng = np.random.Generator


def anywhere(rng: Rng) -> cg.Problem:
    """Draw threats and ends around one area."""
    return cg.Problem(*ends(rng, WALL), field(rng), k=weight(rng), no_fly=WALL)


def free(rng: Rng) -> cg.Problem:
    """Leave out the area, sometimes the threats as well."""
    return cg.Problem(*ends(rng), field(rng, most=2), k=weight(rng))


def close(rng: Rng) -> cg.Problem:
    """Put start and goal very close together."""
    start, far = ends(rng, WALL)
    apart = 10.0 ** rng.uniform(-12.0, -2.0)
    goal = tuple(a + apart * (b - a) for a, b in zip(start, far, strict=True))
    return cg.Problem(start, goal, field(rng), k=weight(rng), no_fly=[None, WALL][outside(goal, WALL)])  # type: ignore[arg-type]


def crowded(rng: Rng) -> cg.Problem:
    """Pile many threats up."""
    at = rng.random((3, 2))
    threats = [
        cg.Threat(*at[rng.integers(3)].tolist(), spread=10.0 ** rng.uniform(-2.0, -0.5), peak=rng.choice([1.0, 0.3]))
        for _ in range(int(rng.integers(10, 40)))
    ]
    return cg.Problem(*ends(rng, WALL), cg.RiskField(threats), k=weight(rng), no_fly=WALL)


def on_the_edge(rng: Rng) -> cg.Problem:
    """Put start and goal on boundaries: of the area, of the map, in corners."""
    places = [(0.45, 0.5), (0.55, 0.5), (0.45, 0.1), (0.55, 0.9), (0.5, 0.1), (0.0, 0.0), (1.0, 1.0), (0.0, 1.0)]
    first, second = rng.choice(len(places), 2, replace=False)
    return cg.Problem(places[first], places[second], field(rng), k=weight(rng), no_fly=WALL)


def walled_in(rng: Rng) -> cg.Problem:
    """Put the goal where no path leads."""
    start = ends(rng, shapely.box(0.6, 0.6, 0.95, 0.95))[0]
    return cg.Problem(start, (0.8, 0.8), field(rng), k=weight(rng), no_fly=RING)


def many_areas(rng: Rng) -> cg.Problem:
    """Draw boxes and triangles that touch and overlap, and gaps in between."""
    corners = rng.integers(0, 11, (int(rng.integers(2, 8)), 3, 2)) / 10.0
    shapes = [shapely.MultiPoint(three).convex_hull for three in corners]
    area = shapely.union_all([shape for shape in shapes if shape.area > 0.0] or [WALL])
    try:
        return cg.Problem(*ends(rng, area), field(rng), k=weight(rng), no_fly=area)
    except LookupError:
        return anywhere(rng)


def far_away(rng: Rng) -> cg.Problem:
    """Scale the unit square and move it far from the origin."""
    size, east, north = 10.0 ** rng.uniform(-3.0, 6.0), *rng.uniform(-1e6, 1e6, 2).tolist()
    at = partial(np.add, (east, north))
    start, goal = (tuple(at(np.multiply(size, end)).tolist()) for end in ends(rng, WALL))
    threats = [
        cg.Threat(east + size * t.x, north + size * t.y, spread=size * t.spread, peak=t.peak)
        for t in field(rng).threats
    ]
    area = shapely.transform(WALL, lambda corners: at(size * corners))
    bounds = (east, north, east + size, north + size)
    return cg.Problem(start, goal, cg.RiskField(threats), k=weight(rng), no_fly=area, bounds=bounds)  # type: ignore[arg-type]


def over_a_raster(rng: Rng) -> cg.Problem:
    """Put threats and an area on a raster of any coarseness, whose cells differ a millionfold."""
    shape = rng.integers(1, [3, 60][int(rng.integers(2))], 2)
    values = 10.0 ** rng.uniform(-4.0, 2.0, shape) * (rng.random(shape) < rng.choice([0.3, 1.0]))
    low, high = rng.uniform(-0.3, 0.3, 2), rng.uniform(0.5, 1.3, 2)
    bounds = (0.0, 0.0, 1.0, 1.0) if rng.random() < 0.5 else (*low.tolist(), *high.tolist())
    raster = cg.RasterRisk(values, bounds, interpolation=["nearest", "bilinear"][int(rng.integers(2))])  # type: ignore[arg-type]
    with_raster = cg.RiskField(field(rng, most=2).threats, rasters=[raster])
    return cg.Problem(*ends(rng, WALL), with_raster, k=weight(rng), no_fly=[None, WALL][int(rng.integers(2))])


def behind_slits(rng: Rng) -> cg.Problem:
    """Draw a wall across the map with slits that few grids see, turned a little, and ends on both sides."""
    places = np.sort(rng.random(int(rng.integers(1, 4))))
    widths = 10.0 ** rng.uniform(-7.0, -1.5, len(places))
    edges = [-2.0, *np.column_stack([places, places + widths]).ravel().tolist(), 3.0]
    left, right = (0.5 - 0.5 * 10.0 ** rng.uniform(-3.0, -0.7), 0.5 + 0.5 * 10.0 ** rng.uniform(-3.0, -0.7))
    parts = [shapely.box(left, low, right, high) for low, high in zip(edges[::2], edges[1::2], strict=True)]
    turned = shapely.affinity.rotate(
        shapely.union_all(parts), rng.choice([0.0, 90.0, rng.uniform(-30.0, 30.0)]), (0.5, 0.5)
    )
    places_left = [place for place in rng.random((200, 2)).tolist() if not shapely.intersects_xy(turned, *place)]
    start = places_left[0]
    goal = max(places_left[:40], key=lambda place: math.dist(place, start))
    return cg.Problem(tuple(start), tuple(goal), field(rng), k=weight(rng), no_fly=turned)


def along_the_border(rng: Rng) -> cg.Problem:
    """Draw walls that end beyond the border, on it, or a little before it."""
    parts = []
    for x in np.sort(rng.uniform(0.15, 0.85, int(rng.integers(1, 4)))).tolist():
        low, high = ([-0.1, 0.0, 10.0 ** rng.uniform(-6.0, -1.0)][int(rng.integers(3))] for _ in range(2))
        parts.append(shapely.box(x, low, x + 10.0 ** rng.uniform(-4.0, -1.3), 1.0 - high))
    area = shapely.union_all(parts)
    area = shapely.transform(area, lambda xy: xy[:, ::-1]) if rng.random() < 0.5 else area
    return cg.Problem(*ends(rng, area), field(rng), k=weight(rng), no_fly=area)


def behind_a_door(rng: Rng) -> cg.Problem:
    """Put the goal into a room with a door of any width."""
    at, width = rng.uniform(0.62, 0.92), 10.0 ** rng.uniform(-6.0, -1.5)
    door = shapely.box(at, 0.5, at + width, 0.75) if rng.random() < 0.5 else shapely.box(0.5, at, 0.75, at + width)
    start = ends(rng, shapely.box(0.6, 0.6, 0.95, 0.95))[0]
    return cg.Problem(start, (0.8, 0.8), field(rng), k=weight(rng), no_fly=RING.difference(door))


def below_a_density(rng: Rng) -> cg.Problem:
    """Close the cells of a raster above a level, with a corridor or none."""
    values = rng.random(rng.integers(3, 12, 2))
    there = cg.Problem(*ends(rng), cg.RiskField(rasters=[cg.RasterRisk(values, (0.0, 0.0, 1.0, 1.0))]), k=weight(rng))
    for level in rng.uniform(0.5, 1.0, 9).tolist():
        with suppress(ProblemError), warnings.catch_warnings():
            # (a level that limits nothing is said)
            warnings.simplefilter("ignore")
            return cg.below_density(there, level, corridor=rng.choice([0.0, 1e-3, 0.05]))
    return there


KINDS: list[Callable[[Rng], cg.Problem]] = [
    *(anywhere, free, close, crowded, on_the_edge, walled_in, many_areas, far_away, over_a_raster),
    *(behind_slits, along_the_border, behind_a_door, below_a_density),
]


def outside(point: tuple[float, ...], area: shapely.Geometry) -> bool:
    return not shapely.contains_xy(area, *point)


def ends(rng: Rng, area: shapely.Geometry | None = None) -> tuple[tuple[float, float], tuple[float, float]]:
    """Draw two places outside of an area."""
    places = [
        tuple(place)
        for place in rng.random((200, 2)).tolist()
        if area is None or not shapely.intersects_xy(area, *place)
    ]
    if len(places) < 2:
        msg = "hardly a free place"
        raise LookupError(msg)
    return places[0], places[1]


def field(rng: Rng, most: int = 4) -> cg.RiskField:
    """Draw none to a few threats."""
    rows = rng.random((int(rng.integers(0, most + 1)), 4)).tolist()
    return cg.RiskField([cg.Threat(x, y, spread=10.0 ** (-2.2 + 1.9 * s), peak=max(0.01, p)) for x, y, s, p in rows])


def weight(rng: Rng) -> float:
    """Draw a risk weight: none, usual, enormous."""
    return float(rng.choice([0.0, 1.0, rng.uniform(0.0, 50.0), 10.0 ** rng.uniform(-3.0, 4.0), 1e4]))


def problem_of(number: int) -> cg.Problem:
    """Make the problem of a number."""
    return KINDS[number % len(KINDS)](np.random.default_rng(number))


def places(problem: cg.Problem, count: int, random: Rng) -> FloatArray:
    """Draw points where a path may be."""
    x_min, y_min, x_max, y_max = problem.bounds
    found = np.empty((0, 2))
    while len(found) < count:
        more = random.random((4 * count, 2)) * (x_max - x_min, y_max - y_min) + (x_min, y_min)
        found = np.vstack([found, more[~problem.area.contains(more)]])
    return found[:count]


def random_map(random: Rng) -> cg.Problem:
    """Draw threats or a raster among areas of all shapes."""
    kind = int(random.integers(4))
    threats = [
        cg.Threat(*random.random(2).tolist(), spread=10.0 ** random.uniform(-1.7, -0.7), peak=random.uniform(0.2, 1.0))
        for _ in range(int(random.integers(0, 15)) if kind else 0)
    ]
    cells = tuple(random.integers(2, 30, 2).tolist())
    rasters = [cg.RasterRisk(random.random(cells) ** 3, (0, 0, 1, 1), interpolation=["nearest", "bilinear"][kind % 2])]
    corners = random.random((int(random.integers(0, 6)), 3, 2))
    area = shapely.union_all([shapely.MultiPoint(three).convex_hull for three in corners])
    area = None if kind == 0 else area.buffer(0.02) if kind == 3 else area
    field = cg.RiskField(threats, rasters=rasters if kind < 2 else [])
    free = cg.Problem((0.0, 0.0), (1.0, 1.0), field, k=10.0 ** random.uniform(-1.0, 2.0))
    within = cg.NoFlyArea(area) if area is not None and not area.is_empty else None
    start, goal = [point for point in random.random((1000, 2)) if not (within and within.contains(point))][:2]
    return replace(
        free, start=tuple(start.tolist()), goal=tuple(goal.tolist()), no_fly=None if within is None else area
    )
