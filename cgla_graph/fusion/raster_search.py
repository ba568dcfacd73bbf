"""
Plans with raster weights (E20) that compute only few weights.

`fused_graph` weighs every pair. Here a plan is an A* search for one path. Its lower bound of the cost-to-go is the cost
matrix of a field whose **exact** integrals are nowhere above the raster sums; it is repaired when threats are detected.
"""

import math
from collections.abc import Iterable
from dataclasses import dataclass, field

import numpy as np

from cgla_graph._types import Bounds, FloatArray, IntArray, Point
from cgla_graph._validate import non_negative_number, whole_number
from cgla_graph.cost_to_go.bound_kernels import risk_error
from cgla_graph.cost_to_go.cost_matrix import CostMatrix, cost_matrix
from cgla_graph.cost_to_go.model_change import ModelChange
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, linked, repair
from cgla_graph.errors import ProblemError
from cgla_graph.fusion import raster_kernels
from cgla_graph.fusion.fusion import MOST_SAMPLES, kernel_fields, proper
from cgla_graph.model.adjacency import Node
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.risk import RiskField, Threat

#: Threats of a lower peak are left out of the bound.
FAINT = 1e-6
#: Upper bound of the rounding of one raster sum and its length, relative to the length.
ROUNDING = 1e-14
#: Rounding of the distance to a start, relative to the reach.
SLACK = 1e-9


def understated(risk: RiskField, part: float) -> RiskField:
    r"""
    Return a field whose exact integral over a segment is at most the raster sum of `risk`.

    The raster samples the far ends of parts of a segment, so that no point of a part is farther than the part's
    length ``h`` from its sample. A field that is nowhere above the risk at any distance of up to ``h`` therefore
    integrates, part by part, to at most the sum. For one threat, ``(d + h)^2 <= (1 + e) d^2 + (1 + 1/e) h^2`` for any
    ``e > 0``, and so ``exp(-(d + h)^2 / 2 s^2)`` is at least a Gaussian of spread ``s / sqrt(1 + e)`` and peak
    ``exp(-(1 + 1/e) h^2 / 2 s^2)``. The ``e`` chosen has the greatest integral. As Eq. 2 grows with every threat, the
    bounds of all threats bound the field.

    Parameters
    ----------
    risk
        A proper field.
    part
        The longest part of any segment, map units, at least 0.

    Returns
    -------
    field
        One threat for each; threats whose peak falls below `FAINT` are left out.

    Raises
    ------
    ProblemError
        If the field is improper, or `part` is negative or not finite.

    Examples
    --------
    >>> threat = Threat(0.5, 0.5, spread=0.1)
    >>> less = understated(RiskField([threat]), 0.01).threats[0]
    >>> round(less.spread, 4), round(less.peak, 4)
    (0.0951, 0.9488)
    """
    proper([risk])
    part = non_negative_number("part", part)
    less = []
    for threat in risk.threats:
        u = part / threat.spread
        # where d/de of (1 + 1/e) u^2 + ln(1 + e) is 0
        e = 0.5 * u * (u + math.sqrt(u * u + 4.0))
        peak = threat.peak * math.exp(-0.5 * u * u * (1.0 + 1.0 / e)) if e > 0.0 else threat.peak
        if peak >= FAINT:
            less.append(Threat(threat.x, threat.y, spread=threat.spread / math.sqrt(1.0 + e), peak=peak))
    return RiskField(less)


@dataclass(eq=False)
class RasterGuide:
    """
    Lower bounds that guide searches with raster weights to one goal, on a fixed set of nodes.

    Each search improves the bounds for the next ones (adaptive A*, Koenig & Likhachev 2006), and its path is their
    first guess.

    Attributes
    ----------
    model
        The known map: field, k and no-fly area.
    matrix
        The cost matrix of the understated field, a lower bound of G under raster weights.
    samples
        Parts of a segment.
    reach
        Upper bound of the length of a segment, map units.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> known = CostModel(RiskField([Threat(0.5, 0.5, spread=0.05)]), k=10.0)
    >>> guide = RasterGuide.lay(Lattice(20, bounds=(0, 0, 1, 1)), known, goal=(0.9, 0.9))
    >>> matrix, node = guide.plan((0.1, 0.1))
    >>> 0.8 * 2**0.5 < matrix.value(node) < 1.2
    True
    """

    model: CostModel
    matrix: CostMatrix
    samples: int
    reach: float
    _bounds: FloatArray = field(repr=False)
    _last: IntArray = field(repr=False)

    @classmethod
    def lay(
        cls, lattice: Lattice, model: CostModel, goal: Point, *, bounds: Bounds | None = None, samples: int = 50
    ) -> "RasterGuide":
        """
        Compute the guide from scratch.

        Parameters
        ----------
        lattice, goal
            The nodes; the goal becomes a further node unless it is on the lattice.
        model
            The known map.
        bounds
            Box of later starts, map units; None: that of the nodes.
        samples
            Parts of a segment, at least 1.

        Raises
        ------
        ProblemError
            If the field is improper, or a part is malformed.
        """
        samples = whole_number("samples", samples, at_least=1, at_most=MOST_SAMPLES)
        corners = np.empty((0, 2)) if bounds is None else np.reshape(bounds, (2, 2))
        reach = float(np.hypot(*np.ptp(np.vstack([lattice.points, [goal], corners]), axis=0)))
        less = understated(model.field, reach / samples)
        graph = GeometricGraph.complete(lattice, less, model.k, no_fly=model.no_fly, extra=(goal,))
        at = int(np.flatnonzero((_positions(graph) == goal).all(axis=1))[0])
        matrix = lazy_cost_matrix(graph, graph.labels[at])
        return cls(model, matrix, samples, reach, _lowered(matrix, reach), np.array([at]))

    def knowing(self, model: CostModel) -> "RasterGuide":
        """
        Return the guide for another known map, repaired from this one, which does not change.

        Raises
        ------
        ProblemError
            If the field is improper.
        """
        if model == self.model:
            return self
        less = CostModel(understated(model.field, self.reach / self.samples), model.k, model.no_fly)
        matrix = repair(self.matrix, less)
        bounds = _lowered(matrix, self.reach)
        if ModelChange.between(self.model, model).weights_only_grow:
            np.maximum(bounds, self._bounds, out=bounds)
        return RasterGuide(model, matrix, self.samples, self.reach, bounds, self._last)

    def plan(self, start: Point, obstacles: Iterable[Threat] = ()) -> tuple[CostMatrix, Node]:
        """
        Find the least-cost path from a point to the goal.

        Parameters
        ----------
        start
            The start of the path, map units; a node for this plan.
        obstacles
            Threats in addition to the known map.

        Returns
        -------
        matrix
            G of the nodes of the path, on the graph of the path alone; no path over other nodes and edges costs less.
            Its labels are those of the guide's graph.
        node
            The node at `start`.

        Raises
        ------
        ProblemError
            If the start is farther from a node than `reach`, or an obstacle's peak is above 1.

        Notes
        -----
        The weights are those of `fused_graph` with ``union`` and ``raster``, and the cost equals that of Dijkstra's
        algorithm on them up to rounding: this is A* with a lower bound. The error of the bound is that of exact
        integrals, at most 2e-11 of the widest spread; the cost may be above the least by this error times k and the
        number of segments. Each plan adds 1e-14 of the cost, too little to search anything twice.
        """
        known = self.model.field
        (everything,) = proper([known.with_threats(obstacles)])
        bound, node = linked(self.matrix, start)
        at = bound.graph.index_of(node)
        farthest = float(np.hypot(*(_positions(bound.graph) - start).T).max())
        if farthest > self.reach * (1.0 + SLACK):
            msg = f"{start} is {farthest:g} from a node, but the guide reaches {self.reach:g}; lay it in wider bounds"
            raise ProblemError(msg)
        way = np.array([bound.graph.index_of(one) for one in bound.path_from(node)], dtype=np.int64)
        if len(way) == 0:
            return _path_matrix(bound.graph, np.array([at, bound.target]), np.array([np.inf])), node
        # known threats alone come first: the bounds of that search hold for the next plans, and under any obstacles
        way, weights, costs = self._search(bound, known, [way, *self._detours(at)])
        n_nodes = len(self._bounds)
        learned = weights.sum() - costs[:n_nodes]
        np.maximum(self._bounds, learned, out=self._bounds)
        self._last = way[way < n_nodes]
        if len(everything) > len(known):
            way, weights, _ = self._search(bound, everything, [way])
        return _path_matrix(bound.graph, way, weights), node

    def _kernel_arguments(
        self, graph: GeometricGraph, risk: RiskField
    ) -> tuple[raster_kernels.Nodes, raster_kernels.Raster]:
        lengths = CostModel(no_fly=self.model.no_fly).kernel_model()
        return (_positions(graph), *graph.lattice_shape), (lengths, self.model.k, kernel_fields((risk,)), self.samples)

    def _detours(self, at: int) -> list[IntArray]:
        """Return the paths from a node straight to each node of the last path, and on along that path."""
        return [self._last[i:] if node == at else np.append(at, self._last[i:]) for i, node in enumerate(self._last)]

    def _search(
        self, bound: CostMatrix, risk: RiskField, guesses: list[IntArray]
    ) -> tuple[IntArray, FloatArray, FloatArray]:
        """Return the least-cost path, the weights of its segments and the costs to the nodes, from first guesses."""
        graph = bound.graph
        arguments = self._kernel_arguments(graph, risk)

        def weights_of(way: IntArray) -> FloatArray:
            weights = np.empty(len(way) - 1)
            raster_kernels.weigh(*arguments, way[:-1], way[1:], weights)
            return weights

        weights, path = min(((weights_of(way), way) for way in guesses), key=lambda guess: guess[0].sum())
        costs, parents = np.full(graph.n_nodes, np.inf), np.full(graph.n_nodes, -1, dtype=np.int64)
        costs[path] = np.concatenate([[0.0], np.cumsum(weights)])
        parents[path[1:]] = path[:-1]
        bounds = np.append(self._bounds, -np.inf)[: graph.n_nodes]
        less = bound.graph.model.field if bound.graph.model else RiskField()
        raster_kernels.find_path(*arguments, risk.table, less.table, bounds, bound.target, costs, parents)
        back = [bound.target]
        while back[-1] != path[0]:
            back.append(int(parents[back[-1]]))
        path = np.array(back[::-1], dtype=np.int64)
        return path, weights_of(path), costs


def _positions(graph: GeometricGraph) -> FloatArray:
    return np.empty((0, 2)) if graph.positions is None else graph.positions


def _lowered(matrix: CostMatrix, reach: float) -> FloatArray:
    """Return the values of a matrix less a bound of the error of exact integrals and of the rounding of sums."""
    model = matrix.graph.model or CostModel()
    segment = model.k * float(risk_error(model.field.table)) + ROUNDING * (1.0 + model.k) * reach
    return matrix.values - matrix.graph.n_nodes * segment


def _path_matrix(graph: GeometricGraph, path: IntArray, weights: FloatArray) -> CostMatrix:
    """Return the cost matrix on the graph of one path."""
    matrix = np.full((len(path), len(path)), np.inf)
    matrix[np.arange(len(path) - 1), np.arange(1, len(path))] = weights
    labels = [graph.labels[i] for i in path.tolist()]
    return cost_matrix(GeometricGraph.from_matrix(matrix, labels=labels, positions=_positions(graph)[path]), labels[-1])
