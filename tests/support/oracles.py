"""Independent references: plain Python, NumPy, scipy, networkx and shapely; none of the toolkit's own kernels."""

import heapq
import itertools
import math
from collections.abc import Callable, Iterable, Sequence

import networkx as nx
import numpy as np
import shapely
from numpy.typing import NDArray
from scipy import ndimage, special
from scipy.integrate import quad
from scipy.sparse import csgraph, csr_array
from shapely.geometry import LineString, MultiPolygon
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, Bounds, FloatArray, Point, WholeArray
from cgla_graph.model.lattice import LatticeKind
from cgla_graph.model.risk import Threat
from cgla_graph.model.risk_raster import RasterRisk

# Risk


def density(threats: Sequence[Threat], points: FloatArray) -> FloatArray:
    """Evaluate Eq. 2 as it is written, at points of shape ``(..., 2)``."""
    clear = np.ones(points.shape[:-1])
    for threat in threats:
        squared = ((points - (threat.x, threat.y)) ** 2).sum(axis=-1)
        clear = clear * (1.0 - threat.peak * np.exp(-squared / (2.0 * threat.spread**2)))
    return np.asarray(1.0 - clear)


def _along(threats: Sequence[Threat], start: FloatArray, end: FloatArray) -> tuple[FloatArray, ...]:
    """Return, for each threat, its foot on the line (from the start), the square of its miss distance, spread, peak."""
    table = np.array([(t.x, t.y, t.spread, t.peak) for t in threats]).reshape(-1, 4)
    u = (end - start) / math.dist(start, end)
    relative = table[:, :2] - start
    return relative @ u, (relative @ np.array([-u[1], u[0]])) ** 2, table[:, 2], table[:, 3]


def line_integral(threats: Sequence[Threat], start: FloatArray, end: FloatArray) -> float:
    """
    Integrate Eq. 2 with `scipy.integrate.quad`, piece by piece between the threats' rims.

    Pieces where all threats are beyond 9 spreads are left out: they hold less than 1e-17 for each threat.
    """
    length = math.dist(start, end)
    if length == 0.0 or not threats:
        return 0.0
    foot, miss2, spread, peak = _along(threats, start, end)
    near = miss2 < (9.0 * spread) ** 2
    foot, miss2, spread, peak = foot[near], miss2[near], spread[near], peak[near]
    rims = np.add.outer(np.arange(-9.0, 10.0, 1.5), np.zeros(len(foot))) * spread + foot
    cuts = np.unique(np.round(np.clip(np.concatenate([rims.ravel(), [0.0, length]]), 0.0, length), 15))
    cuts[0], cuts[-1] = 0.0, length
    scale, log_peak = -0.5 / spread**2, np.log(peak) - 0.5 * miss2 / spread**2
    pieces = []
    for low, high in itertools.pairwise(cuts.tolist()):
        active = (foot - 9.0 * spread < high) & (foot + 9.0 * spread > low)
        if active.any():
            piece = _piece(foot[active], scale[active], log_peak[active])
            # full output: no warning where rounding stops it before 1e-14
            pieces.append(quad(piece, low, high, epsabs=1e-14, epsrel=1e-13, limit=200, full_output=1)[0])
    return math.fsum(pieces)


def _piece(foot: FloatArray, scale: FloatArray, log_peak: FloatArray) -> Callable[[float], float]:
    def risk(t: float) -> float:
        return 1.0 - float(np.prod(1.0 - np.exp(log_peak + scale * (t - foot) ** 2)))

    return risk


def raster_density(raster: RasterRisk, points: FloatArray) -> FloatArray:
    """Evaluate a raster by scipy's interpolation, off the lines between cells of a nearest one."""
    values = np.where(np.isnan(raster.values), raster.nodata or 0.0, raster.values) * raster.scale
    x_min, y_min, x_max, y_max = raster.bounds
    rows, columns = values.shape
    column = (points[:, 0] - x_min) / (x_max - x_min) * columns - 0.5
    row = (points[:, 1] - y_min) / (y_max - y_min) * rows - 0.5
    if raster.origin == "upper":
        row = rows - 1 - row
    order = 1 if raster.interpolation == "bilinear" else 0
    found = ndimage.map_coordinates(values, [row, column], order=order, mode="nearest")
    inside = ((points >= (x_min, y_min)) & (points <= (x_max, y_max))).all(axis=1)
    return np.where(inside, found, 0.0)


def raster_cuts(raster: RasterRisk, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return where a segment crosses lines at which a raster is not smooth, as parts of it, ends included."""
    cuts = [0.0, 1.0]
    for axis in range(2):
        low, high = raster.bounds[axis], raster.bounds[axis + 2]
        count = raster.values.shape[1 - axis]
        # lines through the centres, and those between cells: the ones that do not matter do no harm
        lines = np.linspace(low, high, 2 * count + 1)
        if start[axis] != end[axis]:
            cuts.extend((lines - start[axis]) / (end[axis] - start[axis]))
    return np.unique(np.clip(cuts, 0.0, 1.0))


def raster_integral(raster: RasterRisk, start: FloatArray, end: FloatArray) -> float:
    """Integrate a raster along a segment with scipy, piece by piece."""
    cuts = raster_cuts(raster, start, end)
    total = 0.0
    for first, last in itertools.pairwise(cuts.tolist()):
        if last - first > 1e-13:

            def along(t: float) -> float:
                return float(raster_density(raster, (start + t * (end - start))[None])[0])

            total += quad(along, first, last, epsabs=0.0, epsrel=1e-12)[0]
    return total * math.dist(start, end)


def inclusion_exclusion(threats: Sequence[Threat], start: FloatArray, end: FloatArray, *, largest: int = 99) -> float:
    """
    Add up all ``2^m - 1`` products of threats; `largest` 1 drops the pairs and what follows, and so is wrong.

    A product of Gaussians of precision ``q_i`` at ``t_i`` is a Gaussian of precision ``sum q_i`` at the mean.
    """
    length = math.dist(start, end)
    if length == 0.0:
        return 0.0
    foot, miss2, spread, peak = _along(threats, start, end)
    terms = []
    for size in range(1, min(len(threats), largest) + 1):
        for subset in itertools.combinations(range(len(threats)), size):
            some = list(subset)
            q = spread[some] ** -2.0
            mean = float((q * foot[some]).sum() / q.sum())
            exponent = -0.5 * float((q * ((foot[some] - mean) ** 2 + miss2[some])).sum())
            height = float(np.prod(peak[some])) * math.exp(exponent)
            root = math.sqrt(0.5 * q.sum())
            mass = height * math.sqrt(math.pi) / (2.0 * root)
            both = special.erf(root * (length - mean)) + special.erf(root * mean)
            terms.append((-1.0) ** (size + 1) * mass * float(both))
    return math.fsum(terms)


def path_risk(threats: Sequence[Threat], path: FloatArray) -> float:
    """Add up the integrals along a polyline."""
    return math.fsum(line_integral(threats, a, b) for a, b in itertools.pairwise(path))


def largest_integral(fields: Sequence[Sequence[Threat]], start: FloatArray, end: FloatArray) -> float:
    """
    Integrate the largest of several fields: cell by cell of a fine grid where two of them are close, else as Eq. 2.

    Where the lead of the largest is least, `quad` halves the cell until it has found what is hidden in it.
    """
    length = math.dist(start, end)
    every = [threat for threats in fields for threat in threats]
    if length == 0.0 or not every:
        return 0.0
    foot, _, spread, _ = _along(every, start, end)
    places = np.add.outer(np.linspace(-9.0, 9.0, 91), np.zeros(len(foot))) * spread + foot
    t = np.unique(np.clip(np.concatenate([places.ravel(), np.linspace(0.0, length, 101)]), 0.0, length))

    def at(distance: FloatArray) -> FloatArray:
        return start + distance[..., None] * (end - start) / length

    values = np.array([density(threats, at(t)) for threats in fields])
    winner = np.argmax(values, axis=0)
    values = np.sort(values, axis=0)
    lead = values[-1] - values[-2] if len(fields) > 1 else values[-1]
    least = np.concatenate([[False], (lead[1:-1] <= lead[:-2]) & (lead[1:-1] <= lead[2:]), [False]])
    same = np.maximum(lead[1:], lead[:-1]) <= 1e-14
    tight = ~same & (least[1:] | least[:-1] | (winner[1:] != winner[:-1]))
    curves = []
    for threats in fields:
        foot, miss2, spread, peak = _along(threats, start, end)
        curves.append(_piece(foot, -0.5 / spread**2, np.log(peak) - 0.5 * miss2 / spread**2))

    def kinked(distance: float) -> float:
        return max(curve(distance) for curve in curves)

    pieces = []
    run = 0.0
    for cell in range(len(tight)):
        last = cell + 1 == len(tight)
        if tight[cell]:
            pieces.append(quad(kinked, t[cell], t[cell + 1], epsabs=1e-13, epsrel=1e-12, limit=60, full_output=1)[0])
            run = float(t[cell + 1])
        elif last or tight[cell + 1] or winner[cell + 1] != winner[cell]:
            ends = at(np.array([run, t[cell + 1]]))
            pieces.append(line_integral(fields[winner[cell]], *ends))
            run = float(t[cell + 1])
    return math.fsum(pieces)


def raster(fields: Sequence[Sequence[Threat]], start: FloatArray, end: FloatArray, samples: int) -> float:
    """Add up the largest of several fields at the far ends of equal parts of a segment, times their length."""
    points = start + np.arange(1, samples + 1)[:, None] / samples * (end - start)
    values = [density(threats, points) for threats in fields]
    return float(np.max(values, axis=0).sum()) * math.dist(start, end) / samples


# Lattices and polygons


def lattice_points(shape: tuple[int, int], bounds: Bounds, kind: LatticeKind) -> list[Point]:
    """List the points of a lattice, row by row from below."""
    first, gaps = {
        "closed": (0.0, lambda n: n - 1),
        "upper": (1.0, lambda n: n),
        "lower": (0.0, lambda n: n),
        "centre": (0.5, lambda n: n),
    }[kind]
    (x0, y0, x1, y1), (nx_, ny) = bounds, shape
    return [
        (x0 + (x1 - x0) * (first + i) / gaps(nx_), y0 + (y1 - y0) * (first + j) / gaps(ny))
        for j in range(ny)
        for i in range(nx_)
    ]


def crosses(area: BaseGeometry, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """Tell by shapely which segments meet the interior of the area; exact where all coordinates are small halves."""
    lines = shapely.linestrings(np.stack([starts, ends], axis=-2))
    by_line = shapely.relate_pattern(lines, area, "T********")
    return np.where((starts == ends).all(axis=-1), shapely.contains(area, shapely.points(starts)), by_line)


def lines_between(starts: FloatArray, ends: FloatArray) -> NDArray[np.object_]:
    """Return segments of shape ``(n, 2)`` each; those without length are points."""
    lines = shapely.linestrings(np.stack([starts, ends], axis=-2))
    return np.where((starts == ends).all(axis=-1), shapely.points(starts), lines)


def sides_of(bounds: Bounds) -> list[LineString]:
    """Return the four sides of a map."""
    corners = shapely.get_coordinates(shapely.box(*bounds))
    return [LineString(ends) for ends in itertools.pairwise(corners.tolist())]


def meets_closed_border(area: MultiPolygon, bounds: Bounds, starts: FloatArray, ends: FloatArray) -> BoolArray:
    """
    Tell which segments meet the border of a map where convex polygons close it that do not touch each other.

    A polygon closes a point of a side, or a stretch without its ends; ends at corners of the map are closed.
    """
    lines = lines_between(starts, ends)
    found = np.zeros(len(lines), dtype=bool)
    for side, part in itertools.product(sides_of(bounds), area.geoms):
        met = part & side
        corners = shapely.get_coordinates(side)
        free = [end for end in shapely.get_coordinates(met) if met.length > 0.0 and (end != corners).any(axis=1).all()]
        found |= ~shapely.is_empty(shapely.difference(lines & met, shapely.MultiPoint(free)))
    return found


def shortest_around(
    start: Point, goal: Point, corners: FloatArray, crosses: Callable[[FloatArray, FloatArray], BoolArray]
) -> float:
    """Return the length of a shortest path that bends in corners, shape ``(n, 2)``, only; infinite if there is none."""
    nodes = np.vstack([start, goal, np.unique(corners, axis=0)])
    pairs = np.array(list(itertools.combinations(range(len(nodes)), 2)))
    starts, ends = nodes[pairs[:, 0]], nodes[pairs[:, 1]]
    free = ~crosses(starts, ends)
    graph: nx.Graph[int] = nx.Graph()
    graph.add_nodes_from(range(2))
    lengths = np.hypot(*(ends - starts).T)
    graph.add_weighted_edges_from((*pair, length) for pair, length in zip(pairs[free], lengths[free], strict=True))
    return float(nx.dijkstra_path_length(graph, 0, 1)) if nx.has_path(graph, 0, 1) else math.inf


def octile(step: tuple[int, int]) -> float:
    """Return the length of a shortest path of eight-direction steps."""
    a, b = sorted(abs(d) for d in step)
    return b - a + math.sqrt(2.0) * a


# Graphs: `weights[i, j]` weighs the edge from i to j, infinity is no edge.


def stored(weights: FloatArray) -> csr_array:
    """Return the finite weights with zeros stored, for scipy."""
    kept = np.isfinite(weights) & ~np.eye(len(weights), dtype=bool)
    tails, heads = np.nonzero(kept)
    counts = np.concatenate([[0], np.cumsum(kept.sum(axis=1))])
    return csr_array((weights[tails, heads], heads, counts), shape=weights.shape)


def least_costs(weights: FloatArray, target: int) -> FloatArray:
    """Return the least cost from each node to the target, by scipy's Dijkstra on the reversed graph."""
    return np.asarray(csgraph.dijkstra(stored(np.ascontiguousarray(weights.T)), indices=target))


def least_costs_networkx(weights: FloatArray, target: int) -> FloatArray:
    """Return the least cost from each node to the target, by networkx."""
    graph: nx.DiGraph[int] = nx.DiGraph()
    graph.add_nodes_from(range(len(weights)))
    tails, heads = np.nonzero(np.isfinite(weights))
    graph.add_weighted_edges_from(
        (int(j), int(i), float(weights[i, j])) for i, j in zip(tails, heads, strict=True) if i != j
    )
    found = nx.single_source_dijkstra_path_length(graph, target)
    return np.array([found.get(i, math.inf) for i in range(len(weights))])


def path_cost(weights: FloatArray, nodes: Sequence[int]) -> float:
    """Add up the weights along some nodes."""
    return float(sum(float(weights[i, j]) for i, j in itertools.pairwise(nodes)))


def apply_eq9(weights: FloatArray, target: int, order: Iterable[int]) -> FloatArray:
    """Apply Eq. 9 with one p_r after the other, to every node."""
    values = np.full(len(weights), np.inf)
    values[target] = 0.0
    for r in order:
        for i in range(len(values)):
            values[i] = min(values[i], weights[i, r] + values[r])
    return values


def delta_rounds(
    weights: FloatArray, target: int, choose: Callable[[Iterable[float]], float] = min
) -> tuple[list[set[int]], dict[int, float]]:
    """
    Run Eqs 9-12: list Delta_k of each round, and the values that were frozen when their nodes were settled.

    The paper takes the unsettled nodes of least value; `choose` = max is wrong on purpose.
    """
    values = dict.fromkeys(range(len(weights)), math.inf)
    values[target] = 0.0
    frozen: dict[int, float] = {}
    sets = []
    while unsettled := {i: v for i, v in values.items() if i not in frozen and v < math.inf}:
        chosen = choose(unsettled.values())
        delta = {i for i, v in unsettled.items() if v == chosen}
        sets.append(delta)
        r = min(delta)
        frozen[r] = values[r]
        for i, value in values.items():
            if i not in frozen:
                values[i] = min(value, float(weights[i, r]) + frozen[r])
    return sets, frozen


def least_hops(weights: FloatArray, target: int) -> dict[int, int]:
    """Return, for each node that reaches the target, the edges of the shortest of its optimal paths."""
    values = least_costs(weights, target)
    optimal: nx.DiGraph[int] = nx.DiGraph()
    optimal.add_node(target)
    for i, j in itertools.permutations(range(len(weights)), 2):
        if math.isfinite(values[i]) and values[i] == weights[i, j] + values[j]:
            optimal.add_edge(j, i)
    return dict(nx.single_source_shortest_path_length(optimal, target))


def optimal_paths(weights: FloatArray, source: int, target: int) -> list[tuple[int, ...]]:
    """List all simple paths of least cost by trying them all."""
    others = [i for i in range(len(weights)) if i not in {source, target}]
    tried = [
        (source, *middle, target) for size in range(len(others) + 1) for middle in itertools.permutations(others, size)
    ]
    best = min(path_cost(weights, path) for path in tried)
    return [path for path in tried if path_cost(weights, path) == best]


def eight_connected_edges(free: BoolArray, *, both_free: bool) -> set[frozenset[int]]:
    """List the steps of a grid map, cell by cell; `free` has shape ``(ny, nx)``."""
    ny, nx_ = free.shape
    edges = set()
    for y, x, dy, dx in itertools.product(range(ny), range(nx_), (-1, 0, 1), (-1, 0, 1)):
        if (dx or dy) and 0 <= x + dx < nx_ and 0 <= y + dy < ny and free[y, x] and free[y + dy, x + dx]:
            beside = free[y, x + dx] and free[y + dy, x]
            if not (dx and dy and both_free) or beside:
                edges.add(frozenset({x + y * nx_, x + dx + (y + dy) * nx_}))
    return edges


# The eikonal equation


def fast_marching(
    times: FloatArray, cost: FloatArray, spacing: tuple[float, float], *, second: bool, shifted: bool = True
) -> FloatArray:
    """
    March over a full grid, given what is finite in `times`; both arrays have shape ``(ny, nx)``.

    Differences of first order take the cost half a step upwind; without `shifted` they do not.
    """
    times = times.copy()
    done = np.zeros(times.shape, dtype=bool)
    heap = [(float(times[at]), at) for at in zip(*np.nonzero(np.isfinite(times)), strict=True)]
    heapq.heapify(heap)
    while heap:
        _, (j, i) = heapq.heappop(heap)
        if done[j, i]:
            continue
        done[j, i] = True
        for b, a in ((j, i - 1), (j, i + 1), (j - 1, i), (j + 1, i)):
            if 0 <= b < times.shape[0] and 0 <= a < times.shape[1] and not done[b, a]:
                rows = [_upwind(times, done, (b, a), axis, second=second) for axis in (0, 1)]
                time = _arrival(rows, cost, (b, a), spacing, shifted=shifted)
                if time < times[b, a]:
                    times[b, a] = time
                    heapq.heappush(heap, (time, (b, a)))
    return times


def _upwind(
    times: FloatArray, done: BoolArray, at: tuple[int, int], axis: int, *, second: bool
) -> tuple[float, float, float, tuple[int, int]] | None:
    """Return weight, offset and upwind value of the difference along x (0) or y (1), and where to take the cost."""
    b, a = at

    def beside(step: int) -> tuple[float, tuple[int, int]]:
        j, i = (b, a + step) if axis == 0 else (b + step, a)
        inside = 0 <= j < times.shape[0] and 0 <= i < times.shape[1]
        return (float(times[j, i]) if inside and done[j, i] else math.inf), (j, i)

    sign = min((-1, 1), key=lambda step: beside(step)[0])
    value, near = beside(sign)
    if value == math.inf:
        return None
    beyond, _ = beside(2 * sign)
    if second and beyond <= value:
        return 1.5, (4.0 * value - beyond) / 3.0, value, at
    return 1.0, value, value, near


def _arrival(
    differences: Sequence[tuple[float, float, float, tuple[int, int]] | None],
    cost: FloatArray,
    at: tuple[int, int],
    spacing: tuple[float, float],
    *,
    shifted: bool,
) -> float:
    """Solve ``sum (w (T - t) / h)^2 = c^2`` for the later ``T``; along one axis alone if that is not upwind."""
    here = float(cost[at])
    rows = [(row[0] / h, *row[1:]) for row, h in zip(differences, spacing, strict=True) if row is not None]
    shift = [0.5 * (float(cost[row[3]]) - here) if shifted else 0.0 for row in rows]
    if len(rows) == 2:
        c = max(here + sum(shift), min(here, *(float(cost[row[3]]) for row in rows)) if shifted else 0.0)
        roots = np.roots(
            [
                sum(row[0] ** 2 for row in rows),
                -2.0 * sum(row[0] ** 2 * row[1] for row in rows),
                sum((row[0] * row[1]) ** 2 for row in rows) - c * c,
            ]
        )
        if np.isreal(roots).all() and roots.max() >= max(row[2] for row in rows):
            return float(roots.real.max())
    return min(max(row[1] + (here + extra) / row[0], row[2]) for row, extra in zip(rows, shift, strict=True))


# Cells of grids


def cells(runs: WholeArray) -> set[tuple[int, int]]:
    """List the cells of runs (`cell_runs`), (column, row) each."""
    return {(column, row) for row, first, end in runs.tolist() for column in range(first, end)}


def are_in(columns: WholeArray, rows: WholeArray, runs: WholeArray) -> list[bool]:
    """Say of each cell whether it is in some runs."""
    inside = cells(runs)
    return [cell in inside for cell in zip(columns.tolist(), rows.tolist(), strict=True)]


# Splines


def spline(
    pieces: tuple[WholeArray, WholeArray, WholeArray],
    origin: tuple[float, float],
    spacing: tuple[float, float],
    points: FloatArray,
    values: FloatArray,
) -> FloatArray:
    """
    Evaluate a biquadratic B-spline at points, shape ``(n, 2)``, each on a piece that is known.

    `pieces` are the nine control values' numbers of each, shape ``(n, 9)``, row by row, and the cell's column and row.
    """
    controls, *cells = pieces
    product = np.ones(controls.shape)
    for axis, side in enumerate((np.tile([-1, 0, 1], 3), np.repeat([-1, 0, 1], 3))):
        place = (points[:, axis] - origin[axis]) / spacing[axis]
        away = np.abs(place[:, None] - cells[axis][:, None] - side)
        product *= np.where(away < 0.5, 0.75 - away**2, 0.5 * np.maximum(1.5 - away, 0.0) ** 2)
    # what has no weight may be infinite
    return np.asarray(np.where(product > 0.0, product * values[controls], 0.0).sum(axis=1))


# Motion in space and time


def least_gap(a: tuple[FloatArray, FloatArray], b: tuple[FloatArray, FloatArray]) -> float:
    """Return the least distance of two motions (times, points) while both are there; infinite if they never are."""
    low, high = max(a[0][0], b[0][0]), min(a[0][-1], b[0][-1])
    if low > high:
        return math.inf
    cuts = np.unique([low, high, *(t for t in (*a[0], *b[0]) if low < t < high)])
    gap = np.stack([np.interp(cuts, a[0], a[1][:, i]) - np.interp(cuts, b[0], b[1][:, i]) for i in range(2)], axis=1)
    begin, move = gap[:-1], np.diff(gap, axis=0)
    speed2 = (move**2).sum(axis=1)
    part = np.clip(-(begin * move).sum(axis=1) / np.where(speed2 > 0.0, speed2, 1.0), 0.0, 1.0)
    nearest = np.concatenate([gap, begin + part[:, None] * move])
    return float(np.hypot(*nearest.T).min())


# Convergence


def rate(errors: Sequence[float] | FloatArray) -> float:
    """Fit ``error ~ h^rate`` where h halves from one to the next."""
    return -float(np.polyfit(np.arange(len(errors)), np.log2(errors), 1)[0])
