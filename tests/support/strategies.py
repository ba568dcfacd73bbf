"""Profiles of hypothesis, and strategies besides those of `cgla_graph.testing`: segments, models and their changes."""

import math
import os
from collections.abc import Sequence
from dataclasses import replace
from typing import TypeAlias, TypeVar

import numpy as np
import shapely
from hypothesis import HealthCheck, reject, settings
from hypothesis import strategies as st

from cgla_graph._types import FloatArray, Point
from cgla_graph.errors import ProblemError
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.testing.strategies import (
    coordinates,
    crowds,
    fields,
    points,
    polygons,
    rasters,
    risk_weights,
    seeds,
    threats,
)

Case = TypeVar("Case")
Segment: TypeAlias = tuple[FloatArray, FloatArray]

#: Whether examples are drawn at random, as `make fuzz` does.
FUZZING = bool(os.environ.get("CGLA_FUZZ"))
#: How many times as many examples are drawn then; `make test` and CI draw a part of those that `make check` does.
TIMES = 20.0 if FUZZING else float(os.environ.get("CGLA_EXAMPLES", "1"))


def _times(number: int) -> int:
    return math.ceil(TIMES * number)


# The same examples on every run: a red run means that the code has changed for the worse. `make fuzz` draws new ones; a
# loaded machine is no reason to fail.
settings.register_profile(
    "same",
    deadline=None,
    max_examples=_times(100),
    derandomize=True,
    database=None,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.register_profile(
    "fuzz",
    deadline=None,
    max_examples=_times(100),
    print_blob=True,
    suppress_health_check=[HealthCheck.too_slow],
)
settings.load_profile("fuzz" if FUZZING else "same")


def examples(number: int) -> settings:
    """Draw so many examples, fewer in `make test`, many more in `make fuzz`."""
    return settings(max_examples=_times(number))


def a_part_of(cases: Sequence[Case]) -> Sequence[Case]:
    """
    Return every so many of the cases of a slow test, where fewer examples are drawn; else all of them.

    The steps are odd, as kinds of cases often take turns by two or four.
    """
    return cases[:: 2 * round(0.5 / TIMES) + 1]


few, usual, fast = examples(20), examples(50), examples(150)


def damaged(text: str, characters: str, most: int = 3) -> st.SearchStrategy[str]:
    """Draw a text with up to `most` changes of one character each: put in, replaced or left out."""
    change = st.tuples(st.integers(0, len(text) - 1), st.sampled_from(characters), st.integers(0, 2))

    def changed(changes: list[tuple[int, str, int]]) -> str:
        found = list(text)
        for place, character, how in changes:
            found[place : place + (how > 0)] = character * (how < 2)
        return "".join(found)

    return st.lists(change, max_size=most).map(changed)


def with_raster(problem: Problem, seed: int) -> Problem:
    """Lay a random raster over a problem's bounds, or across them, beside its threats."""
    rng = np.random.default_rng(seed)
    values = 10.0 ** rng.uniform(-rng.choice([0.1, 1.0, 3.0]), 0.0, tuple(rng.integers(1, 25, 2).tolist()))
    x_min, y_min, x_max, y_max = problem.bounds
    bounds = problem.bounds if rng.random() < 0.6 else (x_min, 0.5 * (y_min + y_max), x_max + 1.0, y_max)
    raster = RasterRisk(values, bounds, interpolation=rng.choice(["bilinear", "nearest"]))
    return replace(problem, field=RiskField(problem.field.threats, rasters=[raster]))


@st.composite
def segments(draw: st.DrawFn, field: RiskField) -> Segment:
    """Draw a segment: anywhere on the map, past a threat at a given miss distance, tiny, or far longer than the map."""
    kind = draw(st.sampled_from(["anywhere", "past", "long", "tiny", "axis", "simple"]))
    rng = np.random.default_rng(draw(seeds))
    start, end = rng.random((2, 2))
    if kind == "simple":
        return np.array(draw(points)), np.array(draw(points))
    if kind == "axis":
        end[draw(st.integers(0, 1))] = start[0]
    if kind in {"anywhere", "axis"} or not field.threats:
        return start, end
    threat = draw(st.sampled_from(field.threats))
    angle = rng.uniform(0.0, 2.0 * math.pi)
    along = np.array([math.cos(angle), math.sin(angle)])
    # 7.7 spreads is where a peak of 1 falls below the cutoff
    miss = threat.spread * draw(st.sampled_from([0.0, 1e-9, 1.0, 5.4, 5.6, 7.0, 7.7, 7.8]))
    foot = np.array([threat.x, threat.y]) + miss * np.array([-along[1], along[0]])
    if kind == "tiny":
        return foot, foot + draw(st.sampled_from([1e-300, 1e-12, 1e-6])) * along
    reach = 1000.0 if kind == "long" else 3.0 * threat.spread
    return foot - rng.random() * reach * along, foot + rng.random() * reach * along


@st.composite
def fields_and_segments(draw: st.DrawFn, source: st.SearchStrategy[RiskField]) -> tuple[RiskField, Segment]:
    field = draw(source)
    return field, draw(segments(field))


@st.composite
def pivots(draw: st.DrawFn, n_nodes: int, max_size: int = 40) -> list[int]:
    """Draw an order of p_r."""
    return draw(st.lists(st.integers(0, n_nodes - 1), max_size=max_size))


def off_lattice_points(max_size: int = 3) -> st.SearchStrategy[list[Point]]:
    """Draw points of the unit box, some of them on lattice points."""
    fraction = st.one_of(coordinates, st.integers(0, 4).map(lambda i: i / 4))
    return st.lists(st.tuples(fraction, fraction), max_size=max_size)


#: Costs of runs: often equal, else apart by more than rounding, and infinite where there is no path.
costs = st.integers(1, 5).map(float) | st.floats(1e-3, 1e3).map(lambda cost: float(f"{cost:.6g}")) | st.just(math.inf)


def scaled(problem: Problem, scale: float) -> Problem:
    """Make a map of the unit square larger or smaller, without rounding by powers of two."""
    threats = [Threat(scale * t.x, scale * t.y, scale * t.spread, t.peak) for t in problem.field.threats]
    return Problem(
        (scale * problem.start[0], scale * problem.start[1]),
        (scale * problem.goal[0], scale * problem.goal[1]),
        RiskField(threats),
        k=problem.k,
        bounds=(0, 0, scale, scale),
        no_fly=shapely.transform(problem.model.area.geometry, lambda corners: scale * corners),
    )


@st.composite
def lattice_problems(draw: st.DrawFn) -> Problem:
    """Draw a map of 4 x 4 units with threats and no-fly areas, its ends on lattice points or anywhere."""
    no_fly = draw(polygons())
    field = RiskField([Threat(4 * t.x, 4 * t.y, 4 * t.spread, t.peak) for t in draw(fields(max_threats=3)).threats])
    halves = st.integers(0, 8).map(lambda i: i / 2)
    end = st.tuples(halves, halves) | st.tuples(*[st.floats(0.0, 4.0)] * 2)
    start, goal = draw(end), draw(end)
    k = draw(risk_weights)
    try:
        return Problem(start, goal, field, k, (0.0, 0.0, 4.0, 4.0), no_fly)
    except ProblemError:
        # (an end is inside an area, or between one and the border of the map)
        reject()


# Models of cost, and other ones that they change into


@st.composite
def areas(draw: st.DrawFn) -> shapely.MultiPolygon:
    """Draw up to three boxes or triangles with corners on eighths (where lattice nodes are, too) or anywhere."""
    eighth = st.integers(0, 8).map(lambda i: i / 8)
    corner = draw(st.sampled_from([st.tuples(eighth, eighth), points]))
    shapes = []
    for _ in range(draw(st.integers(0, 3))):
        a, b, c = draw(st.lists(corner, min_size=3, max_size=3))
        shape = draw(st.sampled_from([shapely.box(*a, *b), shapely.Polygon([a, b, c])]))
        if shape.is_valid and shape.area > 1e-6 and all(shape.disjoint(other) for other in shapes):
            shapes.append(shape)
    return shapely.MultiPolygon(shapes)


@st.composite
def plain_threats(draw: st.DrawFn) -> Threat:
    """Draw threats that paths turn aside for."""
    return Threat(*draw(points), spread=draw(st.floats(0.02, 0.15)))


@st.composite
def models(draw: st.DrawFn, *, rastered: bool = False) -> CostModel:
    """Draw cost models, some of them with a raster if `rastered`."""
    k = draw(st.sampled_from([10.0, 100.0, 1.0, 0.0]))
    # 17 threats have a greater reach than 16
    plain = st.lists(plain_threats(), max_size=5).map(RiskField)
    field = draw(st.one_of(plain, fields(max_threats=6), crowds(max_threats=18)))
    if rastered and draw(st.integers(0, 3)) == 0:
        field = RiskField(field.threats, rasters=[draw(rasters())])
    return CostModel(field, k, draw(areas()) if draw(st.booleans()) else None)


@st.composite
def changed(draw: st.DrawFn, model: CostModel, *, rastered: bool = False) -> CostModel:
    """Draw another model: threats come, go, move and change places; areas pop up and vanish; k (and rasters) change."""
    members = list(model.field.threats)
    events = st.sampled_from(["come", "go", "move", "double", "shuffle"])
    for event in draw(st.lists(events, min_size=draw(st.integers(0, 1)), max_size=3)):
        at = draw(st.integers(0, max(len(members) - 1, 0)))
        if event == "come" or not members:
            members.append(draw(st.one_of(threats(), plain_threats())))
        elif event == "go":
            del members[at]
        elif event == "move":
            t = members[at]
            x, y = draw(points)
            members[at] = Threat(x, y, spread=t.spread, peak=t.peak)
        elif event == "double":
            members.insert(0, members[at])
        else:
            members.reverse()
    k, no_fly = model.k, model.no_fly
    if draw(st.integers(0, 4)) == 0:
        k = draw(st.sampled_from([0.0, 1.0, 10.0, 50.0, 100.0]))
    if draw(st.integers(0, 2)) == 0:
        no_fly = draw(st.one_of(st.none(), areas()))
        if isinstance(model.no_fly, shapely.MultiPolygon) and isinstance(no_fly, shapely.MultiPolygon):
            # some parts stay
            kept = [part for part in model.no_fly.geoms if draw(st.booleans())]
            new = [part for part in no_fly.geoms if all(part.disjoint(other) for other in kept)]
            no_fly = shapely.MultiPolygon(kept + new)
    grids = model.field.rasters
    if rastered and draw(st.integers(0, 5)) == 0:
        grids = () if grids else (draw(rasters()),)
    return CostModel(RiskField(members, rasters=grids), k, no_fly)


@st.composite
def arcs(draw: st.DrawFn) -> FloatArray:
    """Draw arcs of all radii and turns, as a row of `cgla_graph.turning.curve_kernels`: large ones pass the map."""
    rng = np.random.default_rng(draw(seeds))
    radius = draw(st.sampled_from([0.01, 0.1, 0.5, 3.0]))
    turn = draw(st.sampled_from([-6.2, -1.5, 0.4, math.pi, 6.28])) * rng.uniform(0.2, 1.0)
    begin = rng.uniform(-math.pi, math.pi)
    # some point of the arc is on the map
    x, y = draw(points)
    angle = begin + rng.random() * turn
    cx, cy = x - radius * math.cos(angle), y - radius * math.sin(angle)
    ends = [f(a) for a in (begin, begin + turn) for f in (math.cos, math.sin)]
    middle = np.array([cx, cy, cx, cy])
    return np.array([*(middle + radius * np.array(ends)), cx, cy, radius, turn])
