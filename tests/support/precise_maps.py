"""Random maps of threats and 1 to 100 areas of varied form, for proofs of a ten-thousandth."""

import math

import numpy as np
import shapely
import shapely.affinity

import cgla_graph as cg
from cgla_graph._types import FloatArray

#: Areas of a map, by its number.
AREAS = (1, 3, 10, 30, 100)
#: Part of the map that areas cover, about; part of the maps with a clearance; part of the areas that touch another.
COVERED, WITH_CLEARANCE, TOUCHING = 0.2, 0.3, 0.2


def drawn(seed: int) -> cg.Problem:
    """Draw a map: 0 to 20 threats, triangles, rectangles, concave and round areas, and k from 0.1 to 100."""
    rng = np.random.default_rng([seed, 47])
    n_areas, n_threats = AREAS[seed % len(AREAS)], int(rng.integers(0, 21))
    size = math.sqrt(COVERED / (math.pi * n_areas))
    areas: list[shapely.Polygon] = []
    for _ in range(n_areas):
        form = FORMS[int(rng.integers(len(FORMS)))](rng, size * rng.uniform(0.5, 1.5))
        form = shapely.affinity.rotate(form, float(rng.choice([0.0, rng.uniform(0.0, 360.0)])), origin=(0.0, 0.0))
        if areas and rng.random() < TOUCHING:
            x, y = shapely.get_coordinates(areas[int(rng.integers(len(areas)))])[0] - shapely.get_coordinates(form)[0]
        else:
            x, y = rng.uniform(0.05, 0.95, 2)
        areas.append(shapely.affinity.translate(form, x, y))
    clearance = float(rng.uniform(0.05, 0.3) * size) if rng.random() < WITH_CLEARANCE else 0.0
    threats = [
        cg.Threat(*rng.random(2), math.exp(rng.uniform(math.log(0.02), math.log(0.3))), rng.uniform(0.1, 1.0))
        for _ in range(n_threats)
    ]
    no_fly, k = shapely.union_all(areas), math.exp(rng.uniform(math.log(0.1), math.log(100.0)))
    low, high = np.array([0.02, 0.02]), np.array([0.98, 0.98])
    closed = no_fly.buffer(clearance + 0.005)
    while True:
        start, goal = rng.uniform(low, (0.15, 0.98)), rng.uniform((0.85, 0.02), high)
        if not closed.intersects(shapely.MultiPoint([start, goal])):
            return cg.Problem(
                tuple(start.tolist()),
                tuple(goal.tolist()),
                cg.RiskField(threats),
                k=k,
                no_fly=no_fly,
                clearance=clearance,
            )


def _triangle(rng: np.random.Generator, size: float) -> shapely.Polygon:
    return _star(np.sort(rng.uniform(0.0, 2.0 * math.pi, 3)), np.full(3, size))


def _rectangle(rng: np.random.Generator, size: float) -> shapely.Polygon:
    slim = math.exp(rng.uniform(-1.0, 1.0))
    return shapely.box(-size * slim, -size / slim, size * slim, size / slim)


def _concave(rng: np.random.Generator, size: float) -> shapely.Polygon:
    n = int(rng.integers(3, 6))
    turns = (np.arange(2 * n) + rng.uniform(-0.3, 0.3, 2 * n)) * math.pi / n
    return _star(turns, np.where(np.arange(2 * n) % 2 == 0, 1.3 * size, rng.uniform(0.3, 0.9) * size))


def _round(rng: np.random.Generator, size: float) -> shapely.Polygon:
    return shapely.affinity.scale(shapely.Point(0.0, 0.0).buffer(size), 1.0, rng.uniform(0.5, 1.0))


def _rounded(rng: np.random.Generator, size: float) -> shapely.Polygon:
    return _rectangle(rng, 0.7 * size).buffer(0.3 * size)


FORMS = (_triangle, _rectangle, _concave, _round, _rounded)


def _star(turns: FloatArray, far: FloatArray) -> shapely.Polygon:
    return shapely.Polygon(np.column_stack([far * np.cos(turns), far * np.sin(turns)]))
