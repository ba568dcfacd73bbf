"""Refinement of a path to the best polyline near it, for example of a lattice's path."""

import math
import time
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
import shapely
from numpy.typing import ArrayLike
from shapely.geometry import Point

from cgla_graph._text import shown
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph._validate import point_array
from cgla_graph.errors import ProblemError
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.no_fly_kernels import segments_cross
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, TracePoint
from cgla_graph.refine import corridor_kernels, refine_kernels

#: Segments of the first stage; every further stage halves their length.
FIRST_SEGMENTS = 8
#: Times that the transversals are laid anew in a stage, at most.
MOST_ROUNDS = 12
#: Stages, at most: the last would have segments a billionth of the first one's.
MOST_STAGES = 30
#: Iterations of one minimisation, at most.
MOST_ITERATIONS = 50
#: Passes through the stages, at most; another pass is made if a shortcut is found in the result.
MOST_PASSES = 4
#: About the most waypoints that shortcuts join; no more than the path may have.
SHORTCUT_POINTS = 120
#: Most corners that shortcuts join: the nearest ones.
MOST_CORNERS = 400
#: Waypoints closer than this, relative to the spacing, collapse into one.
COLLAPSED = 0.05
#: A waypoint that saves less than this, relative to the cost, is idle.
IDLE = 1e-13
#: Two unit steps whose sum is shorter than this turn back on themselves.
U_TURN = 1e-6


@dataclass(frozen=True, eq=False)
class Refinement:
    """
    A refined path.

    Attributes
    ----------
    path
        Waypoints, shape ``(m, 2)``, map units: never more expensive than the given path, and feasible if that was.
    cost
        Cost of the path by `Problem.evaluate`, map units.
    evaluations
        Segments weighed by Eq. 5 on the way, with or without derivative.
    trace
        Best cost before the first stage and after each.
    message
        Why it ended, in one line.
    """

    path: FloatArray
    cost: float
    evaluations: int = 0
    trace: tuple[TracePoint, ...] = field(default=())
    message: str = ""


def refine_path(problem: Problem, path: ArrayLike, *, tolerance: float = 1e-6, max_points: int = 512) -> Refinement:
    """
    Lower the cost of a feasible path until finer waypoints lower it no further.

    Stage by stage, waypoints are laid twice as densely where the path bends, and each is shifted along its transversal
    by a projected Newton method with the exact derivative of the cost. The shifts are limited so that no segment can
    leave the bounds or cross the no-fly area (see `corridor_kernels`). A polyline of spacing ``h`` costs more than the
    best curve by a term of order ``h^2``, so that each stage leaves about a quarter of the error. Before and after the
    stages, waypoints that gain nothing are dropped by dynamic programming over the path's own waypoints and the corners
    near it.

    The answer is a local optimum: the best path that the given one can be bent into without raising the cost. Only a
    shortcut may move the path to another side of an obstacle.

    Parameters
    ----------
    problem
        The problem that gives the cost. The path need not join its start and goal; the path's own ends stay.
    path
        Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units.
    tolerance
        End after a stage that lowers the cost by less than this, relative to it; at least 0.
    max_points
        End before a stage with more waypoints than this; at least 2.

    Returns
    -------
    refinement
        Never worse than the given path. A path that is not feasible, or on a field with peaks above 1 (whose weights
        may be negative), is returned unchanged, with a message that says so.

    Raises
    ------
    ProblemError
        If the path is malformed, `tolerance` is negative or `max_points` below 2.

    Examples
    --------
    >>> import shapely
    >>> problem = Problem((0.0, 0.0), (1.0, 0.0), bounds=(0, -1, 1, 1), no_fly=shapely.box(0.4, -0.3, 0.6, 0.3))
    >>> refined = refine_path(problem, [(0, 0), (0.2, 0.9), (0.9, 0.8), (1, 0)])
    >>> round(refined.cost, 9), refined.path.round(9).tolist()
    (1.2, [[0.0, 0.0], [0.4, 0.3], [0.6, 0.3], [1.0, 0.0]])
    """
    if not tolerance >= 0.0 or not max_points >= 2:  # noqa: PLR2004 - two ends
        msg = f"tolerance is {shown(tolerance)}, max_points {shown(max_points)}; give at least 0 and at least 2"
        raise ProblemError(msg)
    given = point_array("path", path)
    judged = problem.evaluate(given)
    for hindrance in (*judged.violations, *(() if problem.field.is_proper else (NEGATIVE_WEIGHTS,))):
        return Refinement(given, judged.cost, message=f"not refined: {hindrance}")
    return _Refiner(problem, given, judged.cost, max_points).run(tolerance)


class _Refiner:
    """The state of one refinement: the best path so far, and the numbers of the work done."""

    def __init__(self, problem: Problem, path: FloatArray, cost: float, max_points: int) -> None:
        self.began = time.perf_counter()
        self.problem, self.max_points = problem, max_points
        self.area = problem.model.area
        self.risk = problem.field.kernel_field(mixed=True)
        self.best, self.cost, self.given_cost = path.copy(), cost, cost
        self.evaluations = 0
        self.trace = [TracePoint(0.0, 0, cost)]

    def run(self, tolerance: float) -> Refinement:
        apart = np.append((np.diff(self.best, axis=0) != 0.0).any(axis=1), True)
        points = self._without_detours(self.best[apart], np.empty((0, 2)))
        self._offer(points)
        message = "a point has nothing to refine"
        for _ in range(MOST_PASSES):
            length = float(_lengths(points).sum())
            spacing = length / max(FIRST_SEGMENTS, min(len(points), self.max_points // 2) // 2)
            # (the spacing of a tiny path underflows to 0)
            if spacing == 0.0:
                break
            spacing, message = self._refined(points, spacing, tolerance)
            # a shortcut out of sight of the first guess may be in sight now: a corner, a way through a threat
            before = self.cost
            points = self._without_detours(self.best, self._near_corners(self.best, spacing))
            self._offer(points)
            if before - self.cost <= tolerance * self.cost:
                break
        self._simplify()
        return Refinement(self.best, self.cost, self.evaluations, tuple(self.trace), message)

    def _refined(self, points: FloatArray, spacing: float, tolerance: float) -> tuple[float, str]:
        """Go through the stages; return the spacing after the last one, and why they ended."""
        after = self.problem.evaluate(points).cost
        laid = self._laid(points, _lengths(points) / spacing, spacing)
        for stage in range(MOST_STAGES):
            if len(laid) > self.max_points:
                return spacing, f"{len(points)} waypoints: max_points allows no finer ones"
            before = after
            points = self._settled(laid, spacing, tolerance, first=stage == 0)
            after = self._offer(points)
            spacing *= 0.5
            # twice as many where the path bends, until the gain left is below the tolerance
            coarse = _excess(points) >= 0.5 * tolerance * self.cost / len(points)
            if (stage > 0 and before - after <= tolerance * after) or not coarse.any():
                return spacing, f"{len(points)} waypoints: finer ones gain less than {tolerance:g}"
            laid = self._laid(points, np.where(coarse, 2.0, 1.0), spacing)
        return spacing, f"ended after {MOST_STAGES} stages"

    def _offer(self, points: FloatArray) -> float:
        """Keep a path if the oracle finds it the best so far, note the stage, and return the path's cost."""
        found = self.problem.evaluate(points)
        self.evaluations += len(points) - 1
        if found.feasible and found.cost <= self.cost:
            self.best, self.cost = points, found.cost
        self.trace.append(TracePoint(time.perf_counter() - self.began, self.evaluations, self.cost))
        return found.cost

    def _without_detours(self, points: FloatArray, corners: FloatArray) -> FloatArray:
        """Take every shortcut that pays between the path's own waypoints and the corners near it."""
        segment, fraction, foot = _nearest_on_path(points, corners)
        nearest = np.argsort(np.hypot(*(corners - foot).T), kind="stable")[:MOST_CORNERS]
        order = nearest[np.lexsort((fraction[nearest], segment[nearest]))]
        given = np.insert(np.ones(len(points), dtype=np.bool_), segment[order] + 1, values=False)
        every = np.insert(points, segment[order] + 1, corners[order], axis=0)
        stride = 1 + len(points) // min(SHORTCUT_POINTS, self.max_points)
        self.evaluations += refine_kernels.shortcut(every, self.problem.model.kernel_model(mixed=True), stride, given)
        return every[given]

    def _simplify(self) -> None:
        """Drop the waypoints that save nothing but rounding."""
        kept = np.ones(len(self.best), dtype=np.bool_)
        self.evaluations += refine_kernels.without_idle(
            self.best, self.problem.model.kernel_model(mixed=True), IDLE * self.cost, kept
        )
        found = self.problem.evaluate(self.best[kept])
        if found.feasible and found.cost <= min(self.given_cost, self.cost * (1.0 + len(kept) * IDLE)):
            self.best, self.cost = self.best[kept], found.cost

    def _is_free(self, points: FloatArray) -> BoolArray:
        """Return which segments of a polyline do not cross the area."""
        if self.area.is_empty:
            return np.ones(len(points) - 1, dtype=np.bool_)
        return np.asarray(~segments_cross(points[:-1], points[1:], self.area.kernel_arrays))

    def _laid(self, points: FloatArray, pieces: FloatArray, spacing: float) -> FloatArray:
        """Divide every segment into so many `pieces`, shape ``(m - 1,)``; leave out waypoints that crowd."""
        shares = np.maximum(np.ceil(pieces - 1e-9), 1.0).astype(np.int64)
        segment = np.repeat(np.arange(len(shares)), shares)
        part = np.arange(len(segment)) - np.repeat(np.cumsum(shares) - shares, shares)
        start, step = points[:-1][segment], np.diff(points, axis=0)[segment]
        laid = np.vstack([start + (part / shares[segment])[:, None] * step, points[-1:]])
        for aside in (1e-9 * spacing, -1e-9 * spacing):
            # rounding may put the parts of a segment into the area; a tiny shift aside takes them out
            crossing = np.isin(segment, segment[~self._is_free(laid)])
            if not crossing.any():
                break
            # (a segment without length has no parts)
            moved = np.nonzero(crossing & (part > 0))[0]
            along = step[moved]
            across = np.column_stack([-along[:, 1], along[:, 0]]) / np.hypot(*along.T)[:, None]
            exact = start[moved] + (part[moved] / shares[segment[moved]])[:, None] * along
            laid[moved] = self._inside(exact + aside * across)
        crossing = np.append(np.isin(segment, segment[~self._is_free(laid)]) & (part > 0), False)
        return self._thinned(laid[~crossing], 0.25 * spacing)

    def _thinned(self, points: FloatArray, least: float) -> FloatArray:
        """Drop waypoints that are closer than `least` to the one before, where the way stays free."""
        if not (_lengths(points) < least).any():
            return points
        kept = [0]
        for i in range(1, len(points) - 1):
            crowds = math.dist(points[kept[-1]], points[i]) < least
            if not (crowds and self._is_free(points[[kept[-1], i + 1]]).all()):
                kept.append(i)
        return points[[*kept, len(points) - 1]]

    def _inside(self, points: FloatArray) -> FloatArray:
        x_min, y_min, x_max, y_max = self.problem.bounds
        inside: FloatArray = np.clip(points, (x_min, y_min), (x_max, y_max))
        return inside

    def _settled(self, points: FloatArray, spacing: float, tolerance: float, *, first: bool) -> FloatArray:
        """Shift waypoints along their transversals, which are laid anew until that gains little."""
        reach = 2.0 * spacing
        cost = math.inf
        for number in range(MOST_ROUNDS):
            # two waypoints at one place make a kink that no shift of either can straighten
            points = self._thinned(points, COLLAPSED * spacing)
            near = self._near_corners(points, spacing)
            points = self._with_feet(points, near, spacing)
            directions = _normals(points)
            room = self._room(points, directions, reach)
            if not self.area.is_empty:
                area = self.area.kernel_arrays
                corridor_kernels.free_reach(points, directions, area, room)
                in_reach = self._near_corners(points, float(room.max()) + 1e-9 * spacing)
                corridor_kernels.free_hulls(points, directions, area, in_reach, room)
            # a straight line through the middle of a threat is a saddle point: a nudge moves it off
            nudge = 1e-3 * spacing * np.sin(np.linspace(0.0, math.pi, len(points))) if first and number == 0 else None
            points = self._snapped(self._minimised(points, directions, room, spacing, nudge), 1e-7 * spacing)
            last, cost = cost, self.problem.evaluate(points).cost
            if last - cost <= 0.1 * tolerance * cost:
                break
        return points

    def _room(self, points: FloatArray, directions: FloatArray, reach: float) -> FloatArray:
        """Return how far each waypoint may go to either side inside the bounds, up to `reach`; the ends nowhere."""
        low, high = np.reshape(self.problem.bounds, (2, 2))
        with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
            to_low, to_high = (low - points) / directions, (high - points) / directions
        still = directions == 0.0
        ahead = np.where(still, np.inf, np.maximum(to_low, to_high)).min(axis=1)
        back = np.where(still, np.inf, -np.minimum(to_low, to_high)).min(axis=1)
        room: FloatArray = np.clip(np.column_stack([back, ahead]), 0.0, reach)
        room[[0, -1]] = 0.0
        return room

    def _minimised(
        self, points: FloatArray, directions: FloatArray, room: FloatArray, unit: float, nudge: FloatArray | None
    ) -> FloatArray:
        """Shift all waypoints so that the path costs least; lengths are measured in units of `unit`."""
        shifts = np.zeros(len(points)) if nudge is None else np.clip(nudge, -room[:, 0], room[:, 1]) / unit
        self.evaluations += refine_kernels.minimise(
            points, directions, room, unit, self.problem.k, self.risk, MOST_ITERATIONS, shifts
        )
        # the limits of the shifts keep the path out of the area, up to rounding
        for share in (1.0, 1.0 - 1e-9, 0.5, 0.0):
            answer = self._inside(points + share * unit * shifts[:, None] * directions)
            if self._is_free(answer).all():
                return answer
        return points

    def _near_corners(self, points: FloatArray, reach: float) -> FloatArray:
        """Return the convex corners within `reach` of a path and inside the bounds, sorted by x, shape ``(c, 2)``."""
        if self.area.is_empty:
            return np.empty((0, 2))
        corners, tree = _convex_corners(self.area)
        line = shapely.LineString(points)
        near = corners[np.sort(tree.query(line, predicate="dwithin", distance=reach))]
        return np.ascontiguousarray(near[(near == self._inside(near)).all(axis=1)])

    def _with_feet(self, points: FloatArray, corners: FloatArray, spacing: float) -> FloatArray:
        """
        Add a waypoint abreast of every corner close by, so that the path can touch it.

        Add at most one on each side of a segment, for the nearest corner.
        """
        if not len(corners):
            return points
        segment, fraction, feet = _nearest_on_path(points, corners)
        step, offset = points[segment + 1] - points[segment], corners - feet
        distance = np.hypot(*offset.T)
        length = np.hypot(*step.T)
        ends_away = np.minimum(fraction, 1.0 - fraction) * length
        wanted = np.nonzero((distance < spacing) & (ends_away > COLLAPSED * spacing))[0]
        left = step[:, 0] * offset[:, 1] - step[:, 1] * offset[:, 0] > 0.0
        chosen: dict[tuple[int, bool], int] = {}
        for c in wanted[np.argsort(distance[wanted], kind="stable")].tolist():
            chosen.setdefault((int(segment[c]), bool(left[c])), c)
        result = points
        for c in sorted(chosen.values(), key=lambda c: (-segment[c], -fraction[c])):
            # from the far end, so that the numbers of the segments before stay
            i = int(segment[c])
            foot = corners[c] if distance[c] < 1e-9 * spacing else feet[c]
            candidate = np.insert(result, i + 1, self._inside(foot), axis=0)
            if self._is_free(candidate[i : i + 3]).all():
                result = candidate
        return result

    def _snapped(self, points: FloatArray, reach: float) -> FloatArray:
        """Move waypoints within `reach` of a corner onto it."""
        corners = self._near_corners(points, reach)
        away = np.hypot(*(points[1:-1, None] - corners).transpose(2, 0, 1))
        for i, c in np.argwhere((away > 0.0) & (away < reach)):
            candidate = points.copy()
            candidate[i + 1] = corners[c]
            if self._is_free(candidate[i : i + 3]).all():
                points = candidate
        return points


@lru_cache(maxsize=4)
def _convex_corners(area: NoFlyArea) -> tuple[FloatArray, shapely.STRtree]:
    """Return the corners of an area that a path can go around, sorted by x, shape ``(c, 2)``, and an index of them."""
    corners = area.convex_corners()
    return corners, shapely.STRtree([Point(corner) for corner in corners])


def _nearest_on_path(points: FloatArray, corners: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
    """Find the point of a path nearest to each corner: number and fraction of its segment, ``(c,)``, and place."""
    segment, fraction = np.zeros(len(corners), dtype=np.int64), np.zeros(len(corners))
    corridor_kernels.nearest_on_path(points, corners, segment, fraction)
    start, end = points[segment], points[np.minimum(segment + 1, len(points) - 1)]
    return segment, fraction, start + fraction[:, None] * (end - start)


def _lengths(points: FloatArray) -> FloatArray:
    """Return the length of each segment, shape ``(m - 1,)``."""
    return np.asarray(np.hypot(*np.diff(points, axis=0).T), dtype=np.float64)


def _normals(points: FloatArray) -> FloatArray:
    """Return a unit vector across the path at each waypoint, shape ``(m, 2)``, to the left of it."""
    steps = np.diff(points, axis=0)
    steps /= np.maximum(np.hypot(*steps.T), 1e-300)[:, None]
    along = np.vstack([steps[:1], steps[:-1] + steps[1:], steps[-1:]])
    size = np.hypot(*along.T)
    back = size < U_TURN
    along[back] = np.vstack([steps, steps[-1:]])[back]
    # waypoints that coincide have no direction of their own
    along[(along == 0.0).all(axis=1)] = 1.0, 0.0
    along /= np.hypot(*along.T)[:, None]
    return np.ascontiguousarray(np.column_stack([-along[:, 1], along[:, 0]]))


def _excess(points: FloatArray) -> FloatArray:
    """
    Estimate how much longer each segment's share of the path is than the smooth curve's, shape ``(m - 1,)``.

    An arc that turns by ``theta`` and is ``h`` long saves ``h theta^2 / 24`` over the polyline of tangents.
    """
    steps = np.diff(points, axis=0)
    heading = np.arctan2(steps[:, 1], steps[:, 0])
    turn = np.abs(np.remainder(np.diff(heading) + math.pi, 2.0 * math.pi) - math.pi)
    turns = np.concatenate([[0.0], turn, [0.0]])
    return np.asarray(np.hypot(*steps.T) * np.maximum(turns[:-1], turns[1:]) ** 2 / 24.0)
