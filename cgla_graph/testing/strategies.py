"""
Strategies of hypothesis for threats, rasters, fields, maps, weights and graphs of all kinds.

Maps are on the unit square. Examples shrink towards few threats, few nodes and small numbers.

>>> from hypothesis import given, settings
>>> @settings(max_examples=10)
... @given(problem=problems())
... def test_no_path_is_shorter_than_the_straight_line(problem):
...     straight = problem.evaluate([problem.start, problem.goal]).length
...     assert problem.evaluate([problem.start, (0.5, 0.5), problem.goal]).length >= straight - 1e-12
>>> test_no_path_is_shorter_than_the_straight_line()
"""

import math
from collections.abc import Hashable, Sequence
from typing import get_args

import networkx as nx
import numpy as np
import shapely

from cgla_graph._types import Bounds, FloatArray
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice, LatticeKind
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.risk_raster import Interpolation, RasterRisk

try:
    from hypothesis import strategies as st
except ImportError as error:
    msg = "cgla_graph.testing needs hypothesis, which is not installed: pip install 'cgla-graph[testing]'"
    raise ImportError(msg) from error

seeds = st.integers(0, 2**32 - 1)
coordinates = st.floats(0.0, 1.0)
points = st.tuples(coordinates, coordinates)
spreads = st.one_of(st.floats(0.005, 0.5), st.sampled_from([0.005, 0.05, 0.5]))
peaks = st.one_of(st.floats(0.01, 1.0), st.just(1.0), st.just(1e-12))
risk_weights = st.floats(0.0, 50.0)


@st.composite
def threats(draw: st.DrawFn) -> Threat:
    """Draw threats of all spreads and peaks that a proper field may have."""
    x, y = draw(points) if draw(st.booleans()) else np.random.default_rng(draw(seeds)).random(2).tolist()
    return Threat(x, y, spread=draw(spreads), peak=draw(peaks))


def fields(min_threats: int = 0, max_threats: int = 4) -> st.SearchStrategy[RiskField]:
    """Draw proper fields; up to 4 threats always take the closed form."""
    return st.lists(threats(), min_size=min_threats, max_size=max_threats).map(RiskField)


@st.composite
def crowds(draw: st.DrawFn, max_threats: int = 100) -> RiskField:
    """Draw fields of many threats from a seed: scattered, in clusters, or all in one place with peak 1."""
    rng = np.random.default_rng(draw(seeds))
    n = int(rng.integers(1, max_threats + 1))
    n_places = draw(st.sampled_from([n, 3, 1]))
    at = rng.random((n_places, 2))[np.arange(n) % n_places]
    spread = 10.0 ** rng.uniform(math.log10(0.005), math.log10(0.5), n)
    if draw(st.booleans()):
        spread = np.full(n, spread[0])
    peak = np.ones(n) if draw(st.booleans()) else rng.uniform(0.01, 1.0, n)
    rows = np.column_stack([at, spread, peak]).tolist()
    return RiskField([Threat(x, y, spread=s, peak=p) for x, y, s, p in rows])


@st.composite
def rasters(draw: st.DrawFn, interpolation: Interpolation | None = None) -> RasterRisk:
    """Draw rasters on or across the unit square: flat, steep (1 to 1000 between neighbours), or mostly nothing."""
    rng = np.random.default_rng(draw(seeds))
    shape = draw(st.integers(1, 7)), draw(st.integers(1, 7))
    kind = draw(st.sampled_from(["steep", "flat", "holes", "blocks"]))
    values = rng.uniform(0.0, 2.0, shape)
    if kind == "steep":
        values = 10.0 ** rng.uniform(-2.0, 1.0, shape)
    elif kind == "holes":
        values[rng.random(shape) < 0.6] = 0.0
    elif kind == "blocks":
        values = np.where(rng.random(shape) < 0.5, 0.01, 3.0)
    low, high = rng.uniform(-0.3, 0.3, 2), rng.uniform(0.7, 1.3, 2)
    bounds = (0.0, 0.0, 1.0, 1.0) if draw(st.booleans()) else (*low.tolist(), *high.tolist())
    drawn: Interpolation = draw(st.sampled_from(get_args(Interpolation))) if interpolation is None else interpolation
    return RasterRisk(
        values,
        bounds,
        interpolation=drawn,
        origin=draw(st.sampled_from(["upper", "lower"])),
        scale=draw(st.sampled_from([1.0, 0.1])),
    )


@st.composite
def raster_fields(draw: st.DrawFn, max_threats: int = 2) -> RiskField:
    """Draw fields with a raster or two, and perhaps threats."""
    threat_list = draw(st.lists(threats(), max_size=max_threats))
    return RiskField(threat_list, rasters=draw(st.lists(rasters(), min_size=1, max_size=2)))


@st.composite
def boxes(draw: st.DrawFn) -> Bounds:
    """Draw bounds of many sizes, places and shapes."""
    scale = 10.0 ** draw(st.integers(-3, 4))
    x, y = (scale * draw(st.floats(-10.0, 10.0)) for _ in range(2))
    width, height = (scale * draw(st.floats(0.1, 10.0)) for _ in range(2))
    return x, y, x + width, y + height


@st.composite
def lattices(draw: st.DrawFn, *, max_side: int = 6, unit: bool = False) -> Lattice:
    """Draw lattices of all kinds, up to `max_side` points a side, on the unit square or anywhere."""
    side = st.integers(2, max_side)
    bounds = (0.0, 0.0, 1.0, 1.0) if unit else draw(boxes())
    kind = draw(st.sampled_from(get_args(LatticeKind)))
    return Lattice((draw(side), draw(side)), bounds=bounds, kind=kind)


@st.composite
def polygons(draw: st.DrawFn, side: int = 4) -> shapely.MultiPolygon:
    """Draw a union of boxes and triangles with corners at whole and half numbers: shapely judges them exactly."""
    halves = st.integers(0, 2 * side).map(lambda i: i / 2)
    shapes = []
    for _ in range(draw(st.integers(1, 3))):
        corners = draw(st.lists(st.tuples(halves, halves), min_size=3, max_size=3))
        shape = draw(st.sampled_from([shapely.Polygon(corners), shapely.box(*corners[0], *corners[1])]))
        if shape.is_valid and shape.area > 0.0:
            shapes.append(shape)
    # overlapping triangles would make new corners, which are rounded
    apart = shapes[:1] + [shape for shape in shapes[1:] if shape.disjoint(shapes[0])]
    parts = [part for i, part in enumerate(apart) if all(part.disjoint(other) for other in apart[:i])]
    return shapely.MultiPolygon(parts)


@st.composite
def weight_matrices(
    draw: st.DrawFn,
    *,
    max_nodes: int = 9,
    elements: st.SearchStrategy[float] | None = None,
    edge: float | None = None,
) -> FloatArray:
    """
    Draw weights of any graph, not only geometric ones: directed or not, with missing edges or complete.

    `edge` fixes the chance of an edge; `elements` draws one weight, by default a positive one.
    """
    n = draw(st.integers(1, max_nodes))
    rng = np.random.default_rng(draw(seeds))
    one = st.floats(1e-3, 1e3) if elements is None else elements
    pool = np.array(draw(st.lists(one, min_size=1, max_size=4)))
    weights = rng.uniform(0.1, 10.0, (n, n)) if elements is None else rng.choice(pool, (n, n))
    # some weights of the pool as well: ties, and very light and heavy edges
    weights = np.where(rng.random((n, n)) < 0.3, rng.choice(pool, (n, n)), weights)
    chance = draw(st.sampled_from([0.2, 0.5, 1.0])) if edge is None else edge
    weights[rng.random((n, n)) >= chance] = np.inf
    if draw(st.booleans()):
        weights = np.minimum(weights, weights.T)
    np.fill_diagonal(weights, 0.0)
    return weights


def whole_weights(low: int = 1) -> st.SearchStrategy[FloatArray]:
    """Draw small whole weights, whose sums are exact: ties are ties."""
    return weight_matrices(elements=st.integers(low, 4).map(float))


labels: st.SearchStrategy[Hashable] = st.one_of(
    st.integers(-5, 5),
    st.text("abc", max_size=2),
    st.tuples(st.integers(0, 3), st.text("xy", max_size=1)),
    st.frozensets(st.integers(0, 3), max_size=2),
)


@st.composite
def networks(draw: st.DrawFn, *, positioned: bool = False) -> "nx.Graph[Hashable]":
    """Draw a networkx graph of any kind, with odd labels, self-loops, parallel edges, zero and infinite weights."""
    kind = draw(st.sampled_from([nx.Graph, nx.DiGraph, nx.MultiGraph, nx.MultiDiGraph]))
    graph: nx.Graph[Hashable] = kind()
    nodes = draw(st.lists(labels, min_size=1, max_size=7, unique=True))
    graph.add_nodes_from(nodes)
    node = st.sampled_from(nodes)
    weight = st.one_of(st.floats(0.0, 100.0), st.integers(0, 3), st.just(math.inf))
    for u, v, w in draw(st.lists(st.tuples(node, node, weight), max_size=20)):
        graph.add_edge(u, v, weight=w)
    if positioned:
        nx.set_node_attributes(graph, {label: draw(points) for label in nodes}, "pos")
    return graph


@st.composite
def problems(draw: st.DrawFn, *, max_threats: int = 4, areas: bool = True) -> Problem:
    """
    Draw maps on the unit square: threats, and up to two boxes of no-fly area that leave start and goal free.

    Parameters
    ----------
    draw
        Given by hypothesis.
    max_threats
        Threats, at most.
    areas
        Whether there may be no-fly areas; without, every problem has a path.
    """
    start, goal = draw(points), draw(points)
    halves = st.tuples(st.floats(0.01, 0.2), st.floats(0.01, 0.2))
    boxes_drawn = draw(st.lists(st.tuples(points, halves), max_size=2 if areas else 0))
    around = [shapely.box(x - a, y - b, x + a, y + b) for (x, y), (a, b) in boxes_drawn]
    free = [box for box in around if not any(box.covers(shapely.Point(end)) for end in (start, goal))]
    no_fly = shapely.union_all(free) if free else None
    return Problem(start, goal, draw(fields(max_threats=max_threats)), k=draw(risk_weights), no_fly=no_fly)


@st.composite
def graphs(
    draw: st.DrawFn, *, max_nodes: int = 9, weights: st.SearchStrategy[FloatArray] | None = None
) -> GeometricGraph:
    """
    Draw graphs of all kinds, held densely or sparsely: of weights, of networkx, complete or eight-connected lattices.

    Labels are numbers, texts, or, of networkx, any hashable objects. Edges may be missing, of weight zero, one-way.

    Parameters
    ----------
    draw
        Given by hypothesis.
    max_nodes
        Nodes, at most, of a graph of weights; the others have at most 7 or 16.
    weights
        Strategy of matrices, such as `whole_weights`, to draw graphs of these alone.
    """
    kinds = ["weights", "sparse"] if weights is not None else ["weights", "sparse", "networkx", "complete", "eight"]
    kind = draw(st.sampled_from(kinds))
    if kind == "networkx":
        return GeometricGraph.from_networkx(draw(networks()))
    if kind in {"complete", "eight"}:
        make = GeometricGraph.complete if kind == "complete" else GeometricGraph.eight_connected
        return make(draw(lattices(max_side=4, unit=True)), draw(fields()), draw(risk_weights))
    matrix = draw(weight_matrices(max_nodes=max_nodes) if weights is None else weights)
    names: Sequence[Hashable] | None = [f"n{i}" for i in range(len(matrix))] if draw(st.booleans()) else None
    graph = GeometricGraph.from_matrix(matrix, labels=names)
    if kind == "weights":
        return graph
    return GeometricGraph.from_sparse(graph.to_csgraph(), labels=names, directed=graph.directed)


@st.composite
def graph_problems(draw: st.DrawFn, source: st.SearchStrategy[GeometricGraph] | None = None) -> GraphProblem:
    """
    Draw two nodes of a graph, which may be the same, and may have no path between them.

    Parameters
    ----------
    draw
        Given by hypothesis.
    source
        Strategy of the graphs; `graphs` by default.
    """
    graph = draw(graphs() if source is None else source)
    node = st.sampled_from(graph.labels)
    return GraphProblem(graph, draw(node), draw(node))
