"""First curves of lines and arcs, and their bending until they cost least."""

import math
from collections.abc import Iterator, Sequence

import numpy as np
import shapely

from cgla_graph._types import FloatArray, Point
from cgla_graph.model.problem import Problem
from cgla_graph.turning import curve_kernels, descent_kernels, fillet_kernels, search_kernels
from cgla_graph.turning.curve import Curve
from cgla_graph.turning.curve_kernels import LEAVES, N_COLUMNS, RADIUS, TURN, X0, X1, Y0, Y1
from cgla_graph.turning.dubins_kernels import N_WORDS, word_pieces

#: Cells along the longer side of the map that is searched, at least and at most, and poses that are kept, at most.
LEAST_CELLS, MOST_CELLS, MOST_POSES = 96, 192, 600_000
#: Relative sizes of the grids that are tried in turn: a gap that one grid closes may be open on another.
GRIDS = (1.0, 1.37, 0.73)
#: The search turns by so much wider than it has to, which leaves room to bend.
ROOM = 1.02
#: Arcs are divided into parts of at most so much when they become waypoints, radians: the first value that works.
PARTS = (1.4, 0.7, 0.35, 0.12)
#: Weights of the barrier, relative to the cost: of the first stage, and of those after it.
FIRST_WEIGHTS, WEIGHTS = (1e-3, 1e-4, 1e-5, 1e-7), (1e-5, 1e-7)
#: Reach of the barriers of areas and bounds, in parts of the map's shorter side.
REACH = 0.02
#: Steps of one descent, at most; waypoints of a curve that is bent, at most; about how many segments it is divided
#: into.
ITERATIONS, MOST_WAYPOINTS, SEGMENTS = 300, 160, 24
#: Bending ends when twice as many waypoints gain less than this, relative to the cost.
TOLERANCE = 1e-5
#: Waypoints of a rounded polyline move out by `OUTWARDS` times the distance of its arcs from the corners, and by up to
#: `FARTHEST` times; at most `MENDINGS` repairs are made.
OUTWARDS, FARTHEST, MENDINGS = 1.05, 30.0, 100
#: Gaps are sought where a path is closer than `GAP` to the area, in parts of the map's shorter side; at most
#: `MOST_GAPS` are tried; lines through them are at most `LONGEST` radii longer at each end.
GAP, MOST_GAPS, LONGEST = 1e-4, 4, 3.0
#: Waypoints of a rounded polyline stay away from the bounds by this part of the map's shorter side.
INSIDE = 1e-6
#: Least length of a line at an end whose heading is given, in parts of the radius.
LEAD = 1e-4
#: Waypoints of a straight line.
LINE = 2
#: A waypoint that saves less than this, relative to the cost, is removed at the end.
IDLE = 5e-6
#: Most stages of dividing.
STAGES = 4


def candidates(
    problem: Problem, path: FloatArray, radius: float, first: Point | None, last: Point | None
) -> Iterator[tuple[FloatArray | None, str]]:
    """
    Yield waypoints, shape ``(n, 2)``, of rounded polylines to begin with, or None and the reason.

    The first is the given path, if no heading is given; the other one is found by a search.
    """
    if len(path) >= LINE and first is None and last is None:
        yield _rounded(problem, path, radius)
    yield _searched(problem, path, radius, first, last)


def _angle(direction: Point) -> float:
    return math.atan2(direction[1], direction[0])


def dubins(problem: Problem, radius: float, first: Point, last: Point) -> tuple[Curve | None, bool]:
    """Return the cheapest feasible one of Dubins' six curves, and whether no other curve is cheaper."""
    start, goal = (*problem.start, _angle(first)), (*problem.goal, _angle(last))
    best, cost, shortest = None, math.inf, math.inf
    for word in range(N_WORDS):
        out = np.zeros((3, N_COLUMNS))
        n = word_pieces(start, goal, radius, word, out)
        if n >= 1:
            curve = Curve(out[:n])
            shortest = min(shortest, curve.length)
            judged = curve.evaluate(problem)
            if judged.feasible and judged.cost < cost:
                best, cost = curve, judged.cost
    return best, cost <= shortest


def _rounded(problem: Problem, path: FloatArray, radius: float) -> tuple[FloatArray | None, str]:
    """
    Round a polyline: waypoints are moved outwards, so that the arcs reach as far as the corners did.

    Where an arc still crosses the area, its waypoint is moved farther out; where a line that touched a corner crosses
    it, the corner becomes a waypoint. Waypoints whose arcs have no room are removed.
    """
    points = path[np.append(True, (np.diff(path, axis=0) != 0.0).any(axis=1))]
    shares = np.full(len(points), OUTWARDS)
    corners = problem.model.area.convex_corners()
    low, high = np.reshape(problem.bounds, (2, 2)) + INSIDE * problem.shorter_side * np.array([[1.0], [-1.0]])
    why = "the straight line is not free"
    for _ in range(len(points) + MENDINGS):
        if len(points) <= LINE:
            return (points, "") if _is_free(problem, points, radius) else (None, why)
        shifted = _shifted(points, radius, shares)
        shifted[1:-1] = np.clip(shifted[1:-1], low, high)
        taken = np.zeros(len(shifted))
        taken[1:-1] = radius * np.tan(0.5 * np.abs(_turns(shifted)))
        left = np.hypot(*np.diff(shifted, axis=0).T) - taken[:-1] - taken[1:]
        worst = int(np.argmin(left))
        if left[worst] <= 0.0:
            # of the two ends of a stretch that is too short, remove the one that stands out less
            ends = [i for i in (worst, worst + 1) if 0 < i < len(points) - 1]
            gone = min(ends, key=lambda i: _height(points, i))
            points, shares = np.delete(points, gone, axis=0), np.delete(shares, gone)
            continue
        pieces = all_pieces(shifted, radius)
        number, _ = curve_kernels.first_fault(pieces, problem.model.area.kernel_arrays, problem.bounds, 0.0)
        if number < 0:
            return shifted, ""
        at, is_arc = (number + 1) // 2, number % 2 == 1
        where = ", ".join(f"{x:.6g}" for x in shifted[at])
        why = f"the curve crosses the area at ({where})"
        if is_arc and shares[at] < FARTHEST:
            shares[at] *= 2.0
            continue
        if is_arc or not len(corners):
            break
        corner = corners[np.argmin(_distances(corners, pieces[number, :2], pieces[number, 2:4]))]
        is_corner = (corner == points[at : at + 2]).all(axis=1)
        if not is_corner.any():
            points, shares = np.insert(points, at + 1, corner, axis=0), np.insert(shares, at + 1, OUTWARDS)
            continue
        # the other end is so near to the corner that the arc around the corner has no room
        gone = at + 1 if is_corner[0] else at
        if not 0 < gone < len(points) - 1:
            break
        points, shares = np.delete(points, gone, axis=0), np.delete(shares, gone)
    return None, why


def _distances(points: FloatArray, start: FloatArray, end: FloatArray) -> FloatArray:
    """Return the distances of points, shape ``(n, 2)``, from a segment."""
    step = end - start
    squared = float(step @ step)
    shares = np.clip((points - start) @ step / squared, 0.0, 1.0) if squared > 0.0 else np.zeros(len(points))
    away: FloatArray = np.hypot(*(points - start - shares[:, None] * step).T)
    return away


def _height(points: FloatArray, i: int) -> float:
    """Return the distance of a waypoint from the line between its neighbours."""
    a, b, c = points[i - 1], points[i], points[i + 1]
    long = math.dist(a, c)
    if long == 0.0:
        return math.dist(a, b)
    return float(abs((c[0] - a[0]) * (b[1] - a[1]) - (c[1] - a[1]) * (b[0] - a[0])) / long)


def _turns(points: FloatArray) -> FloatArray:
    """Return the turns of a polyline at its inner waypoints, shape ``(n - 2,)``, radians."""
    steps = np.diff(points, axis=0)
    a, b = steps[:-1], steps[1:]
    turns: FloatArray = np.arctan2(a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0], (a * b).sum(axis=1))
    return turns


def _shifted(points: FloatArray, radius: float, shares: FloatArray) -> FloatArray:
    """Move inner waypoints outwards by `shares` of the distance of an arc from its corner."""
    steps = np.diff(points, axis=0)
    units = steps / np.hypot(*steps.T)[:, None]
    inwards = units[1:] - units[:-1]
    size = np.hypot(*inwards.T)[:, None]
    inwards = np.divide(inwards, size, out=np.zeros_like(inwards), where=size > 0.0)
    cosines = np.maximum(np.cos(0.5 * _turns(points)), 1e-3)
    shifted = points.copy()
    shifted[1:-1] -= (shares[1:-1] * radius * (1.0 / cosines - 1.0))[:, None] * inwards
    return shifted


def _thinned(points: FloatArray) -> FloatArray:
    """Remove the waypoints that stand out least until `MOST_WAYPOINTS` are left."""
    while len(points) > MOST_WAYPOINTS:
        heights = np.array([_height(points, i) for i in range(1, len(points) - 1)])
        # of the flattest, no two neighbours
        order = np.argsort(heights, kind="stable")[: max(1, (len(points) - MOST_WAYPOINTS + 1) // 2)]
        gone: set[int] = set()
        for i in sorted(order.tolist()):
            if i - 1 not in gone:
                gone.add(i)
        points = np.delete(points, [i + 1 for i in gone], axis=0)
    return points


def _cost(problem: Problem, points: FloatArray, radius: float) -> float:
    """Return the cost of a rounded polyline, as bending computes it; infinite if it is infeasible."""
    gradient, anywhere = np.empty_like(points), np.zeros((2, 2))
    reaches = (1.0, 1.0, 2.0 * problem.field.finest, 0.0)
    model = problem.model.kernel_model()
    return fillet_kernels.barrier(points, radius, model, problem.bounds, reaches, 0.0, anywhere, gradient)


def _is_free(problem: Problem, points: FloatArray, radius: float) -> bool:
    """Return whether a rounded polyline is feasible."""
    if len(points) <= LINE:
        return not problem.model.area.crosses(points[0], points[-1])
    return _cost(problem, points, radius) < math.inf


def _searched(
    problem: Problem, path: FloatArray, radius: float, first: Point | None, last: Point | None
) -> tuple[FloatArray | None, str]:
    """Search for a curve on grids of several sizes, then through gaps of the path; turn its arcs into waypoints."""
    ends = (problem.start, first), (problem.goal, last)
    kept = 0
    why = ""
    for finer in GRIDS:
        pieces, reason, n_poses = _searched_on(problem, radius, *ends, finer)
        points = _waypoints_that_fit(problem, pieces, radius)
        if points is not None:
            return points, ""
        why = why or reason
        kept += n_poses
        if kept >= MOST_POSES:
            break
    for before, after, along in _gaps(problem, path, radius):
        to, _, _ = _searched_on(problem, radius, ends[0], (before, along), 1.0)
        onward, _, _ = _searched_on(problem, radius, (after, along), ends[1], 1.0) if len(to) else (to, "", 0)
        if len(onward):
            across = np.array([[*before, *after, 0.0, 0.0, 0.0, 0.0]])
            points = _waypoints_that_fit(problem, np.concatenate([to, across, onward]), radius)
            if points is not None:
                return points, ""
    return None, why


def _gaps(problem: Problem, path: FloatArray, radius: float) -> Iterator[tuple[Point, Point, Point]]:
    """
    Yield lines through places that are too narrow for a grid: their ends and their direction.

    They are the segments of a path whose ends both touch the area, extended as far as there is room, up to a few radii.
    """
    area = problem.model.area
    touching = np.zeros(len(path), dtype=np.bool_)
    if len(path):
        away = shapely.distance(shapely.points(path), area.geometry) if not area.is_empty else np.ones(len(path))
        touching = np.asarray(away) < GAP * problem.shorter_side
    pairs = [i for i in range(1, len(path) - 2) if touching[i] and touching[i + 1]]
    for i in sorted(pairs, key=lambda i: math.dist(path[i], path[i + 1]))[:MOST_GAPS]:
        step = path[i + 1] - path[i]
        along = step / np.hypot(*step)
        ends = []
        for end, sign in ((path[i], -1.0), (path[i + 1], 1.0)):
            for share in (1.0, 0.7, 0.5, 0.35, 0.25, 0.1, 0.0):
                far = end + sign * share * LONGEST * radius * along
                # (the line may touch corners: bending moves it off them)
                if problem.in_bounds(far) and not area.crosses(end, far):
                    ends.append((float(far[0]), float(far[1])))
                    break
        if len(ends) == LINE:
            yield ends[0], ends[1], (float(along[0]), float(along[1]))


def _waypoints_that_fit(problem: Problem, pieces: FloatArray, radius: float) -> FloatArray | None:
    """Return the waypoints of a curve whose rounded polyline is feasible, None if there are none."""
    for most in PARTS if len(pieces) else ():
        points = waypoints_of(pieces, most)
        if len(points) > LINE and _is_free(problem, points, radius):
            return points
    return None


def _searched_on(
    problem: Problem,
    radius: float,
    start: tuple[Point, Point | None],
    goal: tuple[Point, Point | None],
    finer: float,
) -> tuple[FloatArray, str, int]:
    """Search for a curve between two places, each with a direction or free, on one grid."""
    x_min, y_min, x_max, y_max = problem.bounds
    wide, high = x_max - x_min, y_max - y_min
    cells = int(finer * min(max(LEAST_CELLS, 2.0 * max(wide, high) / radius), MOST_CELLS))
    # (the radius of the search is at least a cell: curves that turn wider than they have to are feasible too)
    size = max(wide, high) / cells
    columns, rows = max(8, round(wide / size)), max(8, round(high / size))
    across, up = (np.arange(columns) + 0.5) / columns, (np.arange(rows) + 0.5) / rows
    middles = np.stack(np.meshgrid(x_min + across * wide, y_min + up * high), axis=-1)
    prices = 1.0 + problem.k * problem.field.density(middles)
    on = columns, rows, problem.bounds, prices, problem.model.area.kernel_arrays
    poses = [(*place, 0.0 if along is None else _angle(along)) for place, along in (start, goal)]
    free = start[1] is None, goal[1] is None
    wider = max(ROOM * radius, size)
    pieces, nearest, _, n_poses = search_kernels.search(poses[0], poses[1], free, wider, on, MOST_POSES)
    x, y, heading, left = nearest.tolist()
    rest = f", with {left:.6g} of cost left to the goal" if left < math.inf else ""
    why = f"no curve of turn radius {radius:g} was found: the search came as far as ({x:.6g}, {y:.6g}){rest}"
    return pieces, why + ("" if free[0] else _hindrance(problem, radius, (x, y, heading))), n_poses


def _hindrance(problem: Problem, radius: float, pose: tuple[float, float, float]) -> str:
    """Name the obstacles to a quarter turn to the left and to the right, if both are blocked."""
    blocked = []
    for side, name in ((1.0, "left"), (-1.0, "right")):
        x, y, heading = pose
        cx, cy = x - side * radius * math.sin(heading), y + side * radius * math.cos(heading)
        end = heading + side * 0.5 * math.pi
        x1, y1 = cx + side * radius * math.sin(end), cy - side * radius * math.cos(end)
        arc = np.array([[x, y, x1, y1, cx, cy, radius, side * 0.5 * math.pi]])
        number, why = curve_kernels.first_fault(arc, problem.model.area.kernel_arrays, problem.bounds, 0.0)
        if number >= 0:
            blocked.append(
                f"a turn to the {name} {'leaves the bounds' if why == LEAVES else 'crosses the no-fly area'}"
            )
    return f"; from there, {' and '.join(blocked)}" if len(blocked) > 1 else ""


def waypoints_of(pieces: FloatArray, most: float) -> FloatArray:
    """
    Return the polyline around a curve: its ends, and where the tangents of arcs meet; parts of arcs turn by `most`.

    Examples
    --------
    >>> quarter = np.array([[2, 0, 3, 1, 2, 1, 1, math.pi / 2]])
    >>> waypoints_of(quarter, 2.0).round(9).tolist()
    [[2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]
    """
    # adjacent steps of a search with the same radius and side are one arc
    merged: list[FloatArray] = []
    for piece in pieces:
        if merged and merged[-1][RADIUS] == piece[RADIUS] and merged[-1][TURN] * piece[TURN] >= 0.0:
            merged[-1][[X1, Y1]] = piece[[X1, Y1]]
            merged[-1][TURN] += piece[TURN]
        else:
            merged.append(piece.copy())
    points = [merged[0][[X0, Y0]]]
    for piece in merged:
        if piece[RADIUS] == 0.0:
            continue
        limit = most if piece[RADIUS] < 1.5 * pieces[:, RADIUS][pieces[:, RADIUS] > 0.0].min() else 0.3 * most
        parts = max(1, math.ceil(abs(piece[TURN]) / limit))
        half = 0.5 * piece[TURN] / parts
        begin = math.atan2(piece[Y0] - piece[5], piece[X0] - piece[4])
        away = piece[RADIUS] / math.cos(half)
        for part in range(parts):
            angle = begin + (2 * part + 1) * half
            points.append(np.array([piece[4] + away * math.cos(angle), piece[5] + away * math.sin(angle)]))
    points.append(merged[-1][[X1, Y1]])
    return np.array(points)


def all_pieces(points: FloatArray, radius: float) -> FloatArray:
    """Return the pieces of a rounded polyline, also those without length: line, arc, line, …, line."""
    pieces = np.zeros((2 * len(points) - 3, N_COLUMNS))
    fillet_kernels.rounded(np.ascontiguousarray(points), radius, np.zeros((len(points), 7)), pieces)
    return pieces


def curve_of(points: FloatArray, radius: float) -> Curve:
    """Return the curve of a rounded polyline, without pieces of no length."""
    pieces = all_pieces(points, radius)
    return Curve(pieces[(pieces[:, :2] != pieces[:, 2:4]).any(axis=1)])


def bent(
    problem: Problem, start: FloatArray, radius: float, first: Point | None, last: Point | None, *, stages: int
) -> tuple[FloatArray, Curve, float]:
    """
    Bend a curve until it costs least: the barrier is lowered step by step, and waypoints are added in between.

    Returns the waypoints after the last stage, the best curve found, and its cost.
    """
    best = curve_of(start, radius)
    cost = best.evaluate(problem).cost
    spacing = float(np.hypot(*np.diff(start, axis=0).T).sum()) / SEGMENTS
    points = start
    if stages == 1:
        few = _thinned(start)
        points = few if _is_free(problem, few, radius) else start
        points = _divided(_sparse(problem, points, radius, first, last, spacing), radius, spacing)
    for _ in range(stages):
        if stages > 1:
            points = _divided(points, radius, 0.5 * best.length / len(points))
        before = cost
        weights = FIRST_WEIGHTS if stages == 1 else WEIGHTS
        points = _descended(problem, points, radius, first, last, [weight * cost for weight in weights])
        curve = curve_of(points, radius)
        judged = curve.evaluate(problem)
        if judged.feasible and judged.cost < cost:
            best, cost = curve, judged.cost
        if before - cost < TOLERANCE * cost or 2 * len(points) > MOST_WAYPOINTS:
            break
    if stages > 1:
        fewer = curve_of(simpler(problem, points, radius, first, last), radius)
        judged = fewer.evaluate(problem)
        if judged.feasible and judged.cost <= (1.0 + 2.0 * IDLE) * cost:
            best, cost = fewer, judged.cost
    return points, best, cost


def simpler(problem: Problem, points: FloatArray, radius: float, first: Point | None, last: Point | None) -> FloatArray:
    """Remove waypoints that save almost nothing, first those that stand out least."""
    most = (1.0 + IDLE) * _cost(problem, points, radius)
    low, high = 1 + (first is not None), 1 + (last is not None)
    tried: set[bytes] = set()
    while len(points) > low + high:
        inner = [i for i in range(low, len(points) - high) if points[i].tobytes() not in tried]
        if not inner:
            break
        idle = min(inner, key=lambda i: _height(points, i))
        fewer = np.delete(points, idle, axis=0)
        if _cost(problem, fewer, radius) <= most:
            points = fewer
        else:
            tried.add(points[idle].tobytes())
    return points


def _sparse(
    problem: Problem, points: FloatArray, radius: float, first: Point | None, last: Point | None, spacing: float
) -> FloatArray:
    """Remove waypoints that are nearer to the one before than `spacing`, as long as the curve stays feasible."""
    i = 1 if first is None else 2
    while i < len(points) - (1 if last is None else 2):
        if math.dist(points[i - 1], points[i]) < spacing:
            fewer = np.delete(points, i, axis=0)
            if _is_free(problem, fewer, radius):
                points = fewer
                continue
        i += 1
    return points


def _descended(
    problem: Problem,
    points: FloatArray,
    radius: float,
    first: Point | None,
    last: Point | None,
    weights: Sequence[float],
) -> FloatArray:
    reach = REACH * problem.shorter_side
    reaches = reach, radius, 2.0 * problem.field.finest, LEAD * radius
    model, bounds = problem.model.kernel_model(), problem.bounds
    held = np.array([first or (0.0, 0.0), last or (0.0, 0.0)])
    points = points.copy()
    for weight in weights:
        descent_kernels.descend(points, radius, model, bounds, reaches, weight, held, ITERATIONS, 1e-7)
    for end, at, heading in ((0, 1, first), (-1, -2, last)):
        if heading is not None:
            along = np.array(heading)
            points[at] = points[end] + ((points[at] - points[end]) @ along) * along
    return points


def _divided(points: FloatArray, radius: float, spacing: float) -> FloatArray:
    """Add waypoints to straight stretches, about `spacing` apart: the curve stays the same."""
    taken = np.zeros(len(points))
    taken[1:-1] = radius * np.tan(0.5 * np.abs(_turns(points)))
    out = [points[0]]
    for i in range(len(points) - 1):
        a, b = points[i], points[i + 1]
        long = math.dist(a, b)
        left = long - taken[i] - taken[i + 1]
        parts = max(1, round(left / spacing))
        unit = (b - a) / long if long > 0.0 else b - a
        out.extend(a + (taken[i] + left * part / parts) * unit for part in range(1, parts))
        out.append(b)
    return np.array(out)
