"""The default solver: search widely for candidate paths, then refine the best of them."""

import dataclasses
import math
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
import shapely

from cgla_graph._text import counted
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.certificate.certificate import improved
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import TOLERANCE, Solution, Status, TracePoint
from cgla_graph.model.solver import Traits
from cgla_graph.refine.refine import refine_path
from cgla_graph.regions.arrangement import Arrangement, has_cells
from cgla_graph.regions.paths import MOST_WAYPOINTS, NEAR_POINTS, REFINED, cells_of, least_path, near_path
from cgla_graph.solvers.base import Count, Positive, Settings, Whole
from cgla_graph.solvers.continuous import hybrid_roadmap
from cgla_graph.solvers.continuous.fast_marching import marched, sampled
from cgla_graph.solvers.continuous.hybrid_raster import MOST_NODES, raster_grid, ways_down
from cgla_graph.solvers.continuous.hybrid_valley import BANDS, holds_one_way
from cgla_graph.solvers.shortest_paths import path_to

#: Candidates cost at most so much more than the best one before refinement, relative to it.
SLACK = 0.25
#: The same without risk, where the corners are nodes and refinement only straightens.
SLACK_WITHOUT_RISK = 0.02
#: Candidates that are refined to the end cost at most so much more than the best one after a rough refinement.
CLOSE = 0.01
#: Threats and polygons that distinguish candidates, at most.
MOST_POLES = 64
#: The first look uses so many times fewer lattice points, and is skipped if that leaves fewer than so many. On a map
#: without areas and rasters, it marches over so many cells a lattice point for each dozen of threats, up to so many
#: dozens, as valleys between many threats are narrow.
FEWER, FEWEST_POINTS, OPEN_CELLS, DOZENS = 7, 100, 3.125, 16.0
#: Angles that are computed, at most: poles times nodes.
MOST_ANGLES = 1_000_000
#: The most waypoints of a path that is refined over rasters.
RASTER_POINTS = 2000
#: Up to so many cells of constant cost are searched in any case. Other paths over cells are refined if they cost at
#: most so much more than the best one.
FEW_CELLS, SETTLED = 20_000, 1e-3


@dataclass(frozen=True)
class Hybrid(Settings):
    """
    A sparse search that sees every way around the threats, then refinement of the best few.

    First, a graph with many directions is laid over the map, the corners of no-fly areas among its nodes (see
    `hybrid_roadmap`). Least-cost trees from the start and from the goal give, for every node, the
    best path through it. Two paths are different candidates if they pass some threat or polygon on different sides:
    that is, if the angles that they sweep around it differ by a full turn (the H-signature of Bhattacharya, Kumar,
    Likhachev, AAAI 2010). The cheapest candidates are refined (`cgla_graph.refine.refine.refine_path`), and the best
    one wins.

    Where there are rasters, the way down the costs-to-go at their resolution is a candidate as well
    (`fast-marching`). Where all of them are `nearest` and there are no threats, so is the best way over their cells
    (`weighted-regions`), unless there are many cells, and a look at those beside the first path shows that neighbours
    differ too little for that to pay.

    To have a path soon, the way down the costs-to-go on a coarse grid comes before all that, or a quick search over a
    seventh of the lattice points where the map has a few corners. On a map without areas and rasters, that is all if
    the grid sees no other way that costs about as little (`hybrid_valley`).

    Last, and not counted in `Solution.seconds`, a lower bound proves how good it is. Should the way down the
    costs-to-go of a grid of the proof be better, it is the answer, and the proof counts up to there.

    Attributes
    ----------
    points
        Lattice points, about. The default resolves valleys of a fortieth of a square map's side.
    radius
        Longest step over the lattice, in spacings along each side; 3 gives 32 directions.
    candidates
        Paths that are refined, at most.
    tolerance
        Proven distance from the optimum to aim at, relative to the bound; None: no certificate.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> round(Hybrid(tolerance=None).solve(problem).cost, 4)
    1.3516
    """

    points: Annotated[int, Whole(25, 10**6)] = 1600
    radius: Annotated[int, Whole(1, 10)] = 3
    candidates: Count = 12
    tolerance: Positive | None = TOLERANCE

    traits: ClassVar[Traits] = Traits(
        "hybrid",
        "wide search, then refinement of the best few, with a certificate",
        domain="plane",
        anytime=True,
        needs_positive=True,
        proves=True,
    )

    def solve(self, problem: Problem) -> Solution:
        """Search, refine, certify."""
        answer = _Search(problem, self).run()
        if self.tolerance is None or not answer.status.has_path:
            return answer
        certificate, known_after = improved(problem, answer.path, self.tolerance)
        seconds = certificate.seconds - known_after
        answer = dataclasses.replace(
            answer, lower_bound=certificate.lower_bound, certificate_seconds=seconds, certificate=certificate
        )
        if certificate.path is None or not certificate.upper_bound < answer.cost:
            return answer
        moment = TracePoint(answer.trace[-1].seconds + known_after, answer.evaluations, certificate.upper_bound)
        return dataclasses.replace(
            answer,
            path=certificate.path,
            cost=certificate.upper_bound,
            trace=(*answer.trace, moment),
            message=f"{answer.message}; the proof found a better path",
        )


class _Search:
    """The state of one run: the best path so far, and its evaluations and trace."""

    def __init__(self, problem: Problem, settings: Hybrid) -> None:
        self.began = time.perf_counter()
        self.problem, self.settings = problem, settings
        self.best: FloatArray = np.empty((0, 2))
        self.cost = np.inf
        self.evaluations = 0
        self.trace: list[TracePoint] = []
        #: Cells of constant cost, where a search over all of them pays.
        self.cells: Arrangement | None = None
        #: What the message has to say of the rasters.
        self.remark = ""

    def run(self) -> Solution:
        first, is_only_way = self._first_look()
        if is_only_way:
            self._refined(self.best, tolerance=1e-5, max_points=1000)
            within = f"{100.0 * max(BANDS):g} %"
            return self._answer(f"1 candidate, refined to the end: a coarse grid sees no other way within {within}")
        roadmap = hybrid_roadmap.lay(self.problem, self.settings.points, self.settings.radius)
        self.evaluations += roadmap.evaluations
        guesses = self._candidates(roadmap)
        if not guesses and has_cells(self.problem):
            self._over_cells(few=True)
        if not guesses and len(self.best):
            return self._answer("its roadmap does not join start and goal, an earlier search does")
        if not guesses:
            return Solution(
                Status.NOT_FOUND, evaluations=self.evaluations, message="its roadmap does not join start and goal"
            )
        self._offer(guesses[0])
        first += self._over_cells() if has_cells(self.problem) else self._down_the_raster()
        rough = first + [self._refined(path, tolerance=1e-3, max_points=64) for path in guesses]
        least = min(cost for _, cost in rough)
        apart = roadmap.spacing
        chosen: list[shapely.LineString] = []
        for path, cost in sorted(rough, key=lambda pair: pair[1]):
            line = shapely.LineString(path)
            # candidates on different sides of a weak threat end up as the same path
            if cost <= least * (1.0 + CLOSE) and all(line.hausdorff_distance(other) > apart for other in chosen):
                chosen.append(line)
                self._polished(path)
        return self._answer(f"{counted(len(guesses), 'candidate')}, {len(chosen)} refined to the end")

    def _answer(self, message: str) -> Solution:
        return Solution(
            Status.FOUND,
            path=self.best,
            cost=self.cost,
            evaluations=self.evaluations,
            trace=tuple(self.trace),
            message=f"{message}; {self.remark}" if self.remark else message,
        )

    def _first_look(self) -> tuple[list[tuple[FloatArray, float]], bool]:
        """
        Find a path on a coarse grid, to have one soon, unless many corners would make that slow.

        Also return whether that grid sees no other way.
        """
        points = self.settings.points // FEWER
        corners = shapely.get_num_coordinates(self.problem.model.area.geometry)
        if points < FEWEST_POINTS or corners > MOST_POLES:
            return [], False
        if corners == 0 and not self.problem.field.rasters:
            dozens = min(max(len(self.problem.field.every_threat) / 12.0, 1.0), DOZENS)
            most, paths = round(64 * math.sqrt(dozens)), []
            # (a coarse grid takes a quarter of the time, and among many threats may be on the better side of one)
            for times in (1.0, dozens) if dozens > 1.0 else (1.0,):
                cells = min(OPEN_CELLS * self.settings.points * times, MOST_NODES)
                found = marched(self.problem, _open_grid(self.problem, cells))
                self.evaluations += found.mesh.n_nodes
                if len(found.path):
                    self._offer(found.path)
                    paths.append(self._refined(found.path, tolerance=1e-3, max_points=most))
            if paths:
                self.evaluations += found.mesh.n_nodes
                return paths, holds_one_way(self.problem, found, self.cost)
        roadmap = hybrid_roadmap.lay(self.problem, points, self.settings.radius)
        self.evaluations += roadmap.evaluations
        values, before = roadmap.tree(0)
        if not np.isfinite(values[1]):
            return [], False
        path = roadmap.positions[path_to(1, before)]
        self._offer(path)
        return [self._refined(path, tolerance=1e-3, max_points=40)], False

    def _down_the_raster(self) -> list[tuple[FloatArray, float]]:
        """Find ways down the costs-to-go at the resolution of rasters, whose corridors the roadmap may miss."""
        if not self.problem.field.rasters or self.problem.k == 0.0:
            return []
        ways, n_nodes, self.remark = ways_down(self.problem)
        self.evaluations += n_nodes
        refined = []
        for path in ways:
            if len(path) and self.problem.evaluate(path).feasible:
                self._offer(path)
                refined.append(self._refined(path, tolerance=1e-4, max_points=RASTER_POINTS))
        return refined

    def _over_cells(self, *, few: bool = False) -> list[tuple[FloatArray, float]]:
        """
        Find the best way over cells of constant cost.

        Where there are many, they are all searched only if that may pay: if the best way over the cells beside the way
        down the costs-to-go is better than the latter, refined. Where neighbours cost nearly the same, it is not.
        """
        cells = cells_of(self.problem)
        refined = []
        if not few and cells.costs.size > FEW_CELLS:
            found = marched(self.problem, last := raster_grid(self.problem))
            self.remark = sampled(self.problem, last)
            self.evaluations += found.mesh.n_nodes
            path = found.path
            if len(path) and self.problem.evaluate(path).feasible:
                self._offer(path)
                refined.append(self._refined(path, tolerance=1e-3, max_points=64))
            else:
                path = self.best
            near = near_path(self.problem, path, cells, NEAR_POINTS[-1])
            self.evaluations += near.nodes + near.evaluations
            if self.problem.evaluate(near.path).cost >= self.cost:
                return [self._refined(path, tolerance=1e-4, max_points=RASTER_POINTS)]
            self._offer(near.path)
            self.remark = ""
        self.cells = cells
        best = least_path(self.problem, cells=cells)
        self.evaluations += best.nodes + best.evaluations
        if len(best.path):
            self._offer(best.path)
        return refined

    def _polished(self, path: FloatArray) -> None:
        """Refine a path to the end: over cells, if that pays."""
        if self.cells is None:
            self._refined(path, tolerance=1e-5, max_points=RASTER_POINTS if self.problem.field.rasters else 1000)
            return
        near = near_path(self.problem, path, self.cells, NEAR_POINTS[-1])
        self.evaluations += near.nodes + near.evaluations
        cell, best = min(self.cells.widths.max(), self.cells.heights.max()), shapely.LineString(self.best)
        if self.problem.evaluate(near.path).cost > (1.0 + SETTLED) * self.cost:
            return
        if shapely.hausdorff_distance(shapely.LineString(near.path), best) >= cell:
            self._refined(near.path, tolerance=REFINED, max_points=MOST_WAYPOINTS)

    def _offer(self, path: FloatArray) -> None:
        found = self.problem.evaluate(path)
        self.evaluations += len(path) - 1
        if found.feasible and found.cost < self.cost:
            self.best, self.cost = path, found.cost
        self.trace.append(TracePoint(time.perf_counter() - self.began, self.evaluations, self.cost))

    def _refined(self, path: FloatArray, *, tolerance: float, max_points: int) -> tuple[FloatArray, float]:
        refined = refine_path(self.problem, path, tolerance=tolerance, max_points=max_points)
        self.evaluations += refined.evaluations
        self._offer(refined.path)
        return refined.path, refined.cost

    def _candidates(self, roadmap: hybrid_roadmap.Roadmap) -> list[FloatArray]:
        """Find the cheapest path of each kind, cheapest first."""
        trees = [roadmap.tree(root) for root in (0, 1)]
        through = trees[0][0] + trees[1][0]
        if not np.isfinite(through[0]):
            return []
        order = np.argsort(through, kind="stable")
        slack = SLACK if not self.problem.field.is_empty and self.problem.k > 0.0 else SLACK_WITHOUT_RISK
        order = order[through[order] <= (1.0 + slack) * through[0]]
        poles = _poles(self.problem, through[0])[: MOST_ANGLES // len(through)]
        # the second half is walked from the node to the goal, against the goal's tree
        there, back = (_swept(roadmap.positions, poles, *tree)[order] for tree in trees)
        swept = there - back
        turns = np.round((swept - swept[0]) / (2.0 * np.pi)).astype(np.int64)
        first = np.unique(turns, axis=0, return_index=True)[1] if len(poles) else np.zeros(1, dtype=np.int64)
        vias = order[np.sort(first)][: self.settings.candidates]
        before = [tree[1] for tree in trees]
        return [_through(int(via), before, roadmap.positions) for via in vias]


def _open_grid(problem: Problem, cells: float) -> tuple[int, int]:
    """Return a grid of so many square cells, about."""
    x_min, y_min, x_max, y_max = problem.bounds
    sides = x_max - x_min, y_max - y_min
    spacing = math.sqrt(sides[0] * sides[1] / cells)
    return max(16, round(sides[0] / spacing)), max(16, round(sides[1] / spacing))


def _poles(problem: Problem, cost: float) -> FloatArray:
    """Return a point in each threat that matters and in each polygon, the greatest first, shape ``(p, 2)``."""
    # through the middle of a threat, a path gathers at most about 2.5 peak * spread
    rows = [(problem.k * t.peak * t.spread, t.x, t.y) for t in problem.field.every_threat]
    rows = [row for row in rows if row[0] > 1e-3 * cost]
    for polygon in getattr(problem.model.area.geometry, "geoms", [problem.model.area.geometry]):
        if not polygon.is_empty:
            inner = polygon.representative_point()
            rows.append((polygon.length, inner.x, inner.y))
    return np.array(sorted(rows, reverse=True)[:MOST_POLES]).reshape(-1, 3)[:, 1:]


def _swept(positions: FloatArray, poles: FloatArray, values: FloatArray, before: IntArray) -> FloatArray:
    """Return the angle that the tree's path to each node sweeps around each pole, shape ``(n, p)``."""
    swept = np.zeros((len(positions), len(poles)))
    order = np.argsort(values, kind="stable")
    order = order[before[order] >= 0]
    first, second = positions[before[order], None] - poles, positions[order, None] - poles
    cross = first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0]
    turns = np.arctan2(cross, (first * second).sum(axis=-1))
    for node, parent, turn in zip(order.tolist(), before[order].tolist(), turns, strict=True):
        swept[node] = swept[parent] + turn
    return swept


def _through(via: int, before: Sequence[IntArray], positions: FloatArray) -> FloatArray:
    """Read the best path through a node off the two trees."""
    there, back = (path_to(via, tree) for tree in before)
    return positions[there + back[-2::-1]]
