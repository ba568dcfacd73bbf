"""
The cost matrix restricted to nodes that may be on the optimum: exact on complete lattice graphs of any size.

A complete graph of ``N x N`` lattice points has about ``N^4 / 2`` edges, each an integral. Bounds from both ends prove
that nearly all of them are not on the optimum; only the rest is weighed.

**Exactness.** The cost of the path found is the least over all paths of the graph, by the weights of Eq. 5 as the
full matrix has them. The argument:

1. ``U`` is the exact cost of a path of the graph, and a little more for rounding. Any path is correct; a bad one only
   costs time. It is found on a band of lattice points beside the steepest descent of the bounds (or beside the best
   path of the 8-connected lattice, if the descent fails), by sums of a raster, and weighed afterwards.
2. ``S(x)`` and ``T(x)`` bound the cost between ``x`` and the two ends from below (`subsolution`), for every path that
   stays in the tube, the cells that a path of cost ``U`` or less may pass. A path that leaves the tube costs more than
   ``U``. So a node with ``S + T > U`` is on no path of cost ``U`` or less, and is left out. The optimum's nodes are
   kept, and so are the lattice points between them: a segment through further lattice points is the sum of its parts,
   so that only steps ``(a, b)`` without a common divisor count.
3. Label setting from the target, ``G`` of Eq. 9, over the kept nodes. When ``r`` is settled, the edge to ``i`` matters
   only if ``G(r) + A(i, r)`` is below ``L = min(upper bound of G(i), U - S(i))``. It does not if one
   of these, all at most ``G(r) + A(i, r)``, is ``L`` or more:

   - ``G(r)`` and the length of the segment;
   - ``G(r) + T(i) - T(r)``: ``T`` falls by no more than a segment costs, if the segment is in the tube and misses the
     block around the target, in which ``T`` is no spline. Where an area cuts a cell, ``T(i)`` is the least value that
     its pieces have, and ``T(r)`` the greatest;
   - through the middle ``m`` of the segment: ``T(m)`` or, likewise, ``G(r) + T(m) - T(r)``, and half the length; and
     each of the two and ``S(m)`` against ``U``;
   - ``G(r)`` and a sum of a raster of costs less a margin (below), over all of its nodes; and before that, for a long
     segment, Simpson's rule over few of them, less the greatest error that the fourth derivatives of the cost allow.

   All edges from ``r`` to a tile of nodes are left out together where the tile is too far, or where they all pass
   through a box without a node of the tube: so the pairs that are looked at grow like the edges that are left.

   An edge that passes all of them is a candidate. Candidates of a node are integrated, the least bound first, when the
   node is about to be settled, until none can undercut its label. The order is Dijkstra's; bounds only leave edges out,
   and need not be consistent.
4. The raster holds ``c = 1 + k F`` at the points of the lattice of half the spacing. Along a segment, ``c`` where it
   crosses a column of the raster is within ``H h^2 / 8`` of the linear interpolation of the nodes beside, and between
   columns within ``H d^2 / 8`` of that of the crossings, ``h`` and ``d`` being the spacings and ``H`` a bound of the
   Hessian of ``c`` nearby: with ``q_i`` for ``1 / spread_i^2``, ``|Hess F| <= sum f_i q_i max(1, r_i^2 q_i - 1) + (sum
   |grad f_i|)^2 - sum |grad f_i|^2``. So trapezoid sums of ``c`` minus and plus the margin bound the weight. Nodes far
   from the tube hold infinity: a segment that needs one is not on the optimum.

The method needs bounds, and so a field without peaks above 1 and a weight `k` that leaves the arithmetic digits.
"""

import math
import threading
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cache
from itertools import pairwise
from typing import Any

import numpy as np
from scipy.sparse import csgraph

from cgla_graph._types import BoolArray, FloatArray, IntArray, Point, WholeArray
from cgla_graph.certificate.costs import is_provable
from cgla_graph.certificate.subsolution import with_halo
from cgla_graph.cost_to_go.cost_matrix import RESTRICTED, CostMatrix
from cgla_graph.errors import GraphError
from cgla_graph.model.clearance import closed_area
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.small_problem import small_problem
from cgla_graph.refine.refine import refine_path
from cgla_graph.restricted import restricted_kernels
from cgla_graph.restricted.restricted_kernels import INTEGRATED, NEAR_ENOUGH, PAIRS, PAST_MIDDLE, PAST_RASTER, PRIMITIVE
from cgla_graph.restricted.tube import MOST_CELLS, Tube

#: Relative slack of the upper bound, so that rounding never hides the optimum.
SLACK = 1e-12
#: Accuracy of the bounds of the first grid; that of later ones is a tenth of the gap before, within these limits.
FIRST_AIM, LEAST_AIM, MOST_AIM = 1e-3, 1e-6, 2e-4
#: Estimated seconds for a kept pair and for a cell of a mesh: another grid is laid where it pays.
PAIR, CELL = 1.2e-8, 1e-6
#: Points along a side from which the raster is fine enough to search for a first path.
FINE = 64
#: Grids on which a path in the plane is sought: the first and the second.
LOOKS = 2
#: Steps along the side of a tile of nodes.
TILE = 8
#: Rasters of up to so many nodes are held as a whole.
WHOLE = 1 << 20
#: Half steps around a band of lattice points that the raster covers.
BESIDE = 6
#: The tube is refined at least once where so many nodes are kept.
MANY = 500


@dataclass(frozen=True, eq=False)
class Restricted:
    """
    The optimum of a complete lattice graph, and the work that found it.

    Attributes
    ----------
    nodes
        Indices along the optimum, from the source to the target; empty where there is no path.
    cost
        Its cost, map units; infinite where there is no path.
    kept
        The nodes that were kept, ascending indices, shape ``(m,)``.
    values, successors
        G of the kept nodes and the next node towards the target, shape ``(m,)`` each: exact along every path of at most
        `upper`, else an upper bound or infinity, with an index of the graph or -1.
    order
        The nodes settled, in the order of settling: indices of the graph.
    upper
        Cost of the path that bounds were compared with.
    bound
        Proven lower bound of the cost of the optimum; `cost` itself unless a time limit ended the search.
    counts
        Numbers of pairs of kept nodes: ``pairs`` examined; ``near`` enough by length and by the difference of bounds;
        ``primitive`` steps among these; left after the bounds through the middle (``middle``) and the raster
        (``raster``); and ``integrated``.
    cells
        Cells of each grid.
    """

    nodes: IntArray
    cost: float
    kept: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    values: FloatArray = field(default_factory=lambda: np.empty(0))
    successors: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    order: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    upper: float = math.inf
    bound: float = math.nan
    counts: Mapping[str, int] = field(default_factory=dict)
    cells: tuple[int, ...] = ()

    @property
    def is_optimum(self) -> bool:
        """Whether the search came to its end, so that the path is the best one."""
        return not self.bound < self.cost

    def matrix(self, on: GraphProblem) -> CostMatrix:
        """
        Return it as a cost matrix of the whole graph, with values and successors of the nodes that were kept.

        Parameters
        ----------
        on
            The problem that this is the optimum of.

        Examples
        --------
        >>> from cgla_graph.model.risk import RiskField, Threat
        >>> on = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0).on_lattice(30)
        >>> found = restricted_optimum(on)
        >>> matrix = found.matrix(on)
        >>> matrix.path_from(on.source) == [on.graph.labels[index] for index in found.nodes]
        True
        >>> matrix.rounds, [len(delta) for delta in matrix.delta_sets[:2]]
        (106, [1, 1])
        """
        n, target = on.graph.n_nodes, on.graph.index_of(on.target)
        values, successors = np.full(n, np.inf), np.full(n, -1)
        values[self.kept], successors[self.kept] = self.values, self.successors
        values[target] = 0.0
        # the values along the path of cost `upper`, where nothing cheaper was found
        for node, following in reversed(list(pairwise(self.nodes.tolist()))):
            cost = values[following] + on.graph.weight(node, following)
            if cost < values[node]:
                values[node], successors[node] = cost, following
        order = self.order[np.isfinite(values[self.order])]
        return CostMatrix(on.graph, target, RESTRICTED, values, successors, order, len(order), converged=False)


def can_restrict(graph: GeometricGraph) -> bool:
    """Return whether a graph is a complete lattice graph, implicit, under a cost that can be bounded."""
    model = graph.model
    bounded = model is not None and model.field.is_proper and not model.field.is_mixture
    return bool(graph.is_implicit and graph.lattice and bounded)


def restricted_optimum(on: GraphProblem, *, seconds: float | None = None) -> Restricted | None:
    """
    Find the optimum of a complete lattice graph without weighing all of its edges.

    Parameters
    ----------
    on
        A problem on such a graph (see `can_restrict`).
    seconds
        Time limit; None: no limit. When it ends the search, the best path so far is returned with a proven `bound`. A
        grid is solved to its end, so the limit may be exceeded by a second or two; no grid is begun that would not fit.

    Returns
    -------
    found
        None where `k` is too great for the arithmetic of bounds, or no path of the graph was found to compare them
        with: then all edges have to be weighed.

    Raises
    ------
    GraphError
        If the graph is another one.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> on = problem.on_lattice(40)
    >>> found, full = restricted_optimum(on), on.with_weights_held()
    >>> from cgla_graph.cost_to_go.cost_matrix import cost_matrix
    >>> abs(found.cost / cost_matrix(full.graph, on.target).value(on.source) - 1.0) < 1e-12
    True
    >>> found.counts["integrated"] < on.graph.n_pairs // 100
    True
    """
    if not can_restrict(on.graph):
        msg = "only a complete lattice graph that is not weighed can be restricted; give problem.on_lattice(N)"
        raise GraphError(msg)
    return _Search(on).timed(seconds)


@cache
def load_kernels(kind: MapKind) -> None:
    """Compile or load the kernels, once in a process."""
    problem = small_problem(kind)
    for side in (8, FINE):
        restricted_optimum(problem.on_lattice(side))


class _Search:
    """One search for the optimum."""

    def __init__(self, on: GraphProblem) -> None:
        graph = on.graph
        self.graph, self.positions = graph, np.ascontiguousarray(graph.positions)
        self.lattice: Lattice = graph.lattice  # type: ignore[assignment] # checked by `can_restrict`
        self.source, self.target = graph.index_of(on.source), graph.index_of(on.target)
        self.model: Any = graph.model
        self.shape = graph.lattice_shape
        self.step = self.lattice.spacing
        self.origin = _point(self.lattice.points[0])
        low, high = self.positions.min(axis=0), self.positions.max(axis=0)
        no_fly = None if graph.model is None else graph.model.no_fly
        if closed_area(no_fly, (*_point(low), *_point(high))) is not no_fly:
            # (the nodes' box is not the border of a map: areas that end on it leave a passage)
            low, high = low - max(self.step), high + max(self.step)
        self.bounds = (*_point(low), *_point(high))
        width, height = self.shape
        self.primitive = restricted_kernels.coprime_steps(width, height)
        self.upper, self.best = math.inf, np.empty(0, dtype=np.int64)
        self.cells: list[int] = []
        self.ends_at, self.stop = math.inf, np.zeros(1, dtype=np.bool_)

    def timed(self, seconds: float | None) -> Restricted | None:
        """Run, within a time limit."""
        if seconds is None:
            return self.run()
        self.ends_at = time.monotonic() + seconds
        # kernels let other threads run
        timer = threading.Timer(seconds, self.stop.fill, (True,))
        timer.daemon = True
        timer.start()
        try:
            return self.run()
        finally:
            timer.cancel()

    def run(self) -> Restricted | None:
        """Refine the tube, then search the nodes kept."""
        ends = [self.positions[node] for node in (self.source, self.target)]
        if (ends[0] == ends[1]).all():
            return Restricted(np.array(list(dict.fromkeys((self.source, self.target)))), 0.0)
        if self.model.area.contains(np.array(ends)).any():
            return Restricted(np.empty(0, dtype=np.int64), math.inf)
        model = self.model
        problem = Problem(_point(ends[0]), _point(ends[1]), model.field, model.k, self.bounds, model.no_fly)
        tube = Tube.first(problem, FIRST_AIM)
        if tube is None:
            return Restricted(np.empty(0, dtype=np.int64), math.inf)
        if not is_provable(problem):
            return None
        plane = math.inf
        kept: Kept | None = None
        while True:
            self.cells.append(len(tube.level.mesh.columns))
            if len(self.cells) <= LOOKS:
                plane = self._look_for_a_path(tube, plane)
                if math.isinf(self.upper):
                    return self._stopped(tube) if self._is_late() else None
            kept = self._narrowed(tube, kept)
            last, runs = tube.finer(self.upper)
            needed, n_kept = with_halo(problem, runs, last), len(kept.index)
            pays = PAIR * float(n_kept) ** 2 > CELL * needed or (len(self.cells) == 1 and n_kept >= MANY)
            if needed > MOST_CELLS or not pays or self._is_late(CELL * needed):
                break
            gap = self.upper / tube.bound - 1.0
            following = Tube.lay(problem, last, runs, min(MOST_AIM, max(0.1 * gap, LEAST_AIM)))
            if following is None:
                break
            tube = following
        return self._restricted(tube, kept)

    def _narrowed(self, tube: Tube, before: "Kept | None") -> "Kept":
        """Leave the nodes that a path of cost `upper` may pass, by the bounds of a further grid."""
        width, height = self.shape
        # (a point on the border of two cells belongs to both)
        cells = tube.cells(self.upper, 1)
        if before is None:
            columns, rows = self._cells_of(tube, cells.shape, 1)
            index = np.flatnonzero(cells[np.ix_(columns, rows)].T)
            index = np.append(index, np.arange(width * height, len(self.positions)))
            far = np.zeros(len(index))
        else:
            index, far = before.index, before.far
        positions = self.positions[index]
        to_goal, most = tube.bounds_at(positions, to_goal=True)
        far = np.maximum(far, tube.bounds_at(positions, to_goal=False)[0])
        ends = (index == self.source) | (index == self.target)
        near = to_goal if before is None else np.maximum(before.near, to_goal)
        keep = (far + near <= self.upper) | ends
        return Kept(index[keep], far[keep], near[keep], to_goal[keep], most[keep])

    def _cells_of(self, tube: Tube, shape: tuple[int, ...], times: int) -> list[IntArray]:
        """Return columns and rows, in the grid of a tube, of the lattice with `times` as many steps."""
        ratio = [step / spacing for step, spacing in zip(self.step, tube.level.mesh.spacing, strict=True)]
        return [
            np.clip(
                np.rint(np.arange(times * (n - 1) + 1) * (one / times) + self._offset(tube, axis)).astype(np.int64),
                0,
                most - 1,
            )
            for axis, (n, one, most) in enumerate(zip(self.shape, ratio, shape, strict=True))
        ]

    def _look_for_a_path(self, tube: Tube, known: float) -> float:
        """Take a path of the graph beside the steepest descent, if that is better than the path known in the plane."""
        problem = tube.problem
        path = tube.path()
        if len(path) and problem.evaluate(path).feasible:
            path = refine_path(problem, path, tolerance=1e-4, max_points=256).path
            cost = problem.evaluate(path).cost
            if cost >= known * (1.0 - 1e-5):
                return known
            known = cost
            self._take_from_band(self._beside(path), tube)
        if math.isinf(self.upper):
            nodes = self._eight_connected(problem)
            if len(nodes):
                self._offer(nodes)
                self._take_from_band(self._beside(self.positions[nodes]), tube)
        return known

    def _take_from_band(self, keep: BoolArray, tube: Tube) -> None:
        """Find the best path over a band of lattice points; on fine lattices by sums of the raster."""
        width, height = self.shape
        rough = min(self.shape) >= FINE
        keep[[self.source, self.target]] = True
        index = np.flatnonzero(keep)
        on_lattice = index[index < width * height]
        near = np.zeros((2 * width - 1, 2 * height - 1), dtype=np.bool_)
        reach = BESIDE if rough else 2 * max(width, height)
        restricted_kernels.widen(2 * (on_lattice % width), 2 * (on_lattice // width), reach, near)
        squares = Squares.of(near)
        # this search is for a path: no bound leaves anything out
        finite = [np.isfinite(tube.bounds_at(self.positions[index], to_goal=to_goal)[0]) for to_goal in (True, False)]
        index = index[finite[0] & finite[1]]
        nothing = np.zeros(len(index))
        free = Kept(index, nothing, nothing, nothing, np.full_like(nothing, np.inf))
        # (the rule of proofs knows how far it is off; here, narrow threats forbid it)
        least = min((threat.spread for threat in self.model.field.threats), default=math.inf)
        resolved = restricted_kernels.STRIDE * max(self.step) <= least
        smooth = rough and resolved and not self.model.field.rasters
        rasters = [*self._cost_rasters(squares), np.zeros(squares.size if smooth else 0)]
        middles = [np.zeros(1 if rough else squares.size) for _ in range(2)]
        found = self._searched(tube, free, 1e300, squares, (*rasters, *middles), rough=rough)
        if len(found.nodes):
            self._offer(found.nodes)

    def _offer(self, nodes: IntArray) -> None:
        """Weigh a path, and keep it if it is the best so far."""
        cost = sum(self.graph.weight(i, j) for i, j in pairwise(nodes.tolist())) * (1.0 + SLACK)
        if cost < self.upper:
            self.upper, self.best = cost, nodes

    def _eight_connected(self, problem: Problem) -> IntArray:
        """Return the best path over moves to the eight neighbours; empty if there is none."""
        on = problem.on_eight_connected(self.lattice)
        source, target = on.graph.index_of(on.source), on.graph.index_of(on.target)
        search: Any = csgraph.dijkstra
        costs, before = search(on.graph.to_csgraph(), indices=source, return_predecessors=True)
        if not np.isfinite(costs[target]):
            return np.empty(0, dtype=np.int64)
        path = [target]
        while path[-1] != source:
            path.append(int(before[path[-1]]))
        path.reverse()
        # its lattice points are those of the complete graph; the ends may have other numbers there
        path[0], path[-1] = self.source, self.target
        return np.array(path)

    def _beside(self, path: FloatArray) -> BoolArray:
        """Mark the corners of the lattice's cells that a path passes."""
        width = self.shape[0]
        keep = np.zeros(len(self.positions), dtype=np.bool_)
        sums = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
        places = np.linspace(0.0, sums[-1], max(2, int(4.0 * sums[-1] / min(self.step))))
        steps = [(np.interp(places, sums, path[:, i]) - self.origin[i]) / self.step[i] for i in range(2)]
        columns, rows = (np.clip(at.astype(np.int64), 0, n - 2) for at, n in zip(steps, self.shape, strict=True))
        for right, up in ((0, 0), (1, 0), (0, 1), (1, 1)):
            keep[(rows + up) * width + columns + right] = True
        return keep

    def _cost_rasters(self, squares: "Squares") -> list[FloatArray]:
        """Return the rasters of costs, at some nodes of the half lattice; infinity elsewhere."""
        plain, low, high = (np.full(squares.size, np.inf) for _ in range(3))
        half = 0.5 * self.step[0], 0.5 * self.step[1]
        model = self.model
        restricted_kernels.cost_rasters(
            squares.columns, squares.rows, self.origin, half, self.bounds, model.k, np.array(model.field.table),
            model.field.raster_array, squares.places, plain, low, high,
        )  # fmt: skip
        return [plain, low, high]

    def _fourth_derivatives(self, squares: "Squares") -> FloatArray:
        """Bound the fourth derivatives of the cost near nodes of the half lattice; none where rasters have kinks."""
        model, half = self.model, (0.5 * self.step[0], 0.5 * self.step[1])
        if model.field.rasters:
            return np.empty(0)
        fourth = np.zeros(squares.size)
        nodes, table = (squares.columns, squares.rows), np.array(model.field.table)
        restricted_kernels.fourth_derivatives(*nodes, self.origin, half, model.k, table, squares.places, fourth)
        return fourth

    def _restricted(self, tube: Tube, kept: "Kept") -> Restricted:
        """Search the nodes kept, with all bounds."""
        # the half lattice within a step of a cell that a path of this cost may pass
        ratio = max(step / spacing for step, spacing in zip(self.step, tube.level.mesh.spacing, strict=True))
        cells = tube.cells(self.upper, 1 + math.ceil(0.5 * ratio))
        near = cells[np.ix_(*self._cells_of(tube, cells.shape, 2))]
        squares = Squares.of(near)
        spots = np.column_stack([squares.columns, squares.rows]) * (0.5 * np.array(self.step)) + self.origin
        middles, through = [], np.zeros(len(spots))
        for to_goal in (True, False):
            bounds, _ = tube.bounds_at(spots, to_goal=to_goal)
            middle = np.full(squares.size, np.inf)
            middle[squares.places] = bounds = np.where(np.isfinite(bounds), bounds, 0.0)
            through += bounds
            middles.append(middle)
        passable = through < self.upper
        rasters = *self._cost_rasters(squares), self._fourth_derivatives(squares), *middles
        found = self._searched(tube, kept, self.upper, squares, rasters, passable, rough=False)
        if not len(found.nodes):
            if self._is_late():
                return self._stopped(tube, found)
            # no path is cheaper than the known one
            found = replace(found, nodes=self.best, cost=self.upper / (1.0 + SLACK))
        return replace(found, bound=found.cost)

    def _is_late(self, needed: float = 0.0) -> bool:
        """Return whether the time is up, or will be in `needed` seconds; kernels stop when it is up."""
        if time.monotonic() > self.ends_at:
            self.stop[:] = True
        return bool(self.stop[0]) or time.monotonic() + needed > self.ends_at

    def _stopped(self, tube: Tube, found: Restricted | None = None) -> Restricted:
        """Return the best path at the time limit, with the bound proven until then."""
        found = found or Restricted(self.best, math.inf, cells=tuple(self.cells))
        return replace(found, nodes=self.best, cost=self.upper / (1.0 + SLACK), bound=tube.bound)

    def _offset(self, tube: Tube, axis: int) -> float:
        """Return where the lattice begins on the tube's grid, in cells; an end may be outside the lattice."""
        mesh = tube.level.mesh
        return (self.origin[axis] - mesh.origin[axis]) / mesh.spacing[axis]

    def _searched(
        self,
        tube: Tube,
        kept: "Kept",
        upper: float,
        squares: "Squares",
        rasters: Sequence[FloatArray],
        passable: BoolArray | None = None,
        *,
        rough: bool,
    ) -> Restricted:
        """Run label setting from the target over some nodes."""
        width, height = self.shape
        on_lattice = kept.index < width * height
        column, row = (np.where(on_lattice, at, -1) for at in (kept.index % width, kept.index // width))
        order, tiles = _tiles(column, row, self.positions[kept.index])
        kept, column, row = kept.sorted(order), column[order], row[order]
        index = kept.index
        x, y = np.ascontiguousarray(self.positions[index].T)
        root = _point(self.positions[self.target])
        apart = np.hypot(x - root[0], y - root[1]) > tube.rim
        counts = np.zeros(8, dtype=np.int64)
        values, successors = np.full(len(index), np.inf), np.full(len(index), -1)
        settled = np.empty(len(index), dtype=np.int64)
        nodes = x, y, column, row, kept.most, kept.to_goal, kept.far, apart
        near = squares.sums()
        sums = near if passable is None else squares.sums(passable), near
        flat: Any = *rasters, squares.blocks, squares.width, *sums
        ends = [np.flatnonzero(index == end) for end in (self.target, self.source)]
        self._is_late()
        if not all(map(len, ends)):
            return Restricted(np.empty(0, dtype=np.int64), math.inf)
        root_at, end_at = (int(end[0]) for end in ends)
        rounds = restricted_kernels.search(
            nodes, tiles, root, tube.rim, root_at, end_at, upper, self.primitive, flat, rough,
            self.model.kernel_model(), counts, values, successors, settled, self.stop,
        )  # fmt: skip
        path = []
        if np.isfinite(values[end_at]):
            path = [end_at]
            while path[-1] != root_at:
                path.append(int(successors[path[-1]]))
        ascending = np.argsort(index)
        names = {
            "pairs": PAIRS,
            "near": NEAR_ENOUGH,
            "primitive": PRIMITIVE,
            "middle": PAST_MIDDLE,
            "raster": PAST_RASTER,
            "integrated": INTEGRATED,
        }
        return Restricted(
            nodes=index[np.array(path, dtype=np.int64)],
            cost=float(values[end_at]),
            kept=index[ascending],
            values=values[ascending],
            successors=np.where(successors >= 0, index[successors], -1)[ascending],
            order=index[settled[:rounds]],
            upper=upper,
            counts={name: int(counts[at]) for name, at in names.items()},
            cells=tuple(self.cells),
        )


@dataclass(frozen=True, eq=False)
class Kept:
    """Nodes that may be on the optimum, ascending indices, shape ``(n,)``, and bounds of the cost to both ends."""

    index: IntArray
    #: To the source, and to the target: the best of all grids.
    far: FloatArray
    near: FloatArray
    #: To the target, by the last grid; and what may be subtracted from the bound at another node.
    to_goal: FloatArray
    most: FloatArray

    def sorted(self, order: IntArray) -> "Kept":
        """Return them in another order."""
        bounds = (one[order] for one in (self.far, self.near, self.to_goal, self.most))
        return Kept(self.index[order], *bounds)


@dataclass(frozen=True, eq=False)
class Squares:
    """
    Nodes of the half lattice, and where rasters hold them (see `restricted_kernels`).

    Attributes
    ----------
    columns, rows
        The nodes, half steps, shape ``(n,)``.
    shape
        Of the half lattice.
    blocks
        The first entry of each square.
    places
        The entry of each node, shape ``(n,)``.
    size
        Number of entries.
    width
        Entries of a column where the raster is held as a whole; else 0.
    """

    columns: IntArray
    rows: IntArray
    shape: tuple[int, ...]
    blocks: WholeArray
    places: IntArray
    size: int
    width: int

    @classmethod
    def of(cls, chosen: BoolArray) -> "Squares":
        """Lay out the nodes of a half lattice that are chosen."""
        (columns, rows), shape = np.nonzero(chosen), chosen.shape
        bits, side = restricted_kernels.BITS, restricted_kernels.SIDE
        if chosen.size <= WHOLE:
            width = shape[1] + 1
            nothing = np.empty((0, 0), dtype=np.int64)
            return cls(columns, rows, shape, nothing, columns * width + rows, (shape[0] + 1) * width, width)
        # (what lies beside the last column or row is looked up as well)
        blocks = np.zeros([n // side + 1 for n in shape], dtype=np.int64)
        blocks[columns >> bits, rows >> bits] = 1
        used = np.flatnonzero(blocks)
        blocks.flat[used] = side**2 * np.arange(1, len(used) + 1)
        places = blocks[columns >> bits, rows >> bits] + ((columns % side) << bits) + rows % side
        return cls(columns, rows, shape, blocks, places, side**2 * (len(used) + 1), 0)

    def sums(self, chosen: BoolArray | None = None) -> WholeArray:
        """Count the nodes, or some of them, south and west of each corner of coarse squares."""
        coarse = restricted_kernels.COARSE
        sums = np.zeros([(n >> coarse) + 2 for n in self.shape], dtype=np.int32)
        columns, rows = (at if chosen is None else at[chosen] for at in (self.columns, self.rows))
        sums[1:, 1:][columns >> coarse, rows >> coarse] = 1
        return sums.cumsum(axis=0, dtype=np.int32).cumsum(axis=1, dtype=np.int32)


def _tiles(column: IntArray, row: IntArray, positions: FloatArray) -> tuple[IntArray, restricted_kernels.Tiles]:
    """Sort nodes by tiles of the lattice; those off it come first. Return the order, and the tiles."""
    tile = np.where(column >= 0, (column // TILE) * (row.max(initial=0) // TILE + 1) + row // TILE, -1)
    order = np.argsort(tile, kind="stable")
    first = np.flatnonzero(np.diff(tile[order], prepend=-2))
    nodes = np.column_stack([column, row])[order]
    extents = [
        np.hstack([np.minimum.reduceat(one, first), np.maximum.reduceat(one, first)])
        for one in (positions[order], nodes)
    ]
    return order, (np.append(first, len(order)), extents[0], extents[1])


def _point(position: FloatArray) -> Point:
    """Return a position as a pair of floats."""
    x, y = position.tolist()
    return x, y
