"""Problems in the plane and on graphs, and the oracle that evaluates every path."""

import dataclasses
import math
import os
import sys
import warnings
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from types import NoneType
from typing import TYPE_CHECKING, Any

import numpy as np
import scipy  # (its modules are imported when they are first used)
from numpy.typing import ArrayLike
from shapely.geometry.base import BaseGeometry

from cgla_graph._display import Plottable
from cgla_graph._lazy import function_above
from cgla_graph._text import ShortRepr, shown
from cgla_graph._types import BoolArray, Bounds, FloatArray, Point
from cgla_graph._validate import (
    bounds_box,
    clearance_of,
    instance,
    items,
    number_array,
    point,
    point_array,
    real_number,
    unmasked,
)
from cgla_graph.errors import GraphError, NodeNotFoundError, ProblemError
from cgla_graph.model.adjacency import CornerRule, Node
from cgla_graph.model.clearance import (
    ROUNDING,
    closed_area,
    joined_with,
    on_closed_border,
    stretches,
    widened,
    widest_gap,
)
from cgla_graph.model.cost_model import CostModel, indexed_area
from cgla_graph.model.earth import LocalProjection, is_closed_by_border, project_on_map, projected_bounds
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.graph_libraries import graph_wanted
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.rasters.crs import plane_of
from cgla_graph.model.risk import RiskField, SmallSpreadWarning, Threat
from cgla_graph.model.risk_raster import RasterRisk
from cgla_graph.model.solution import Solution, Status, refuted, with_claims
from cgla_graph.model.weights import refuse_sum, reject_overflow

if TYPE_CHECKING:
    from matplotlib.axes import Axes

#: Relative difference between a solver's own cost and the oracle's from which the solver's counts as wrong.
COST_TOLERANCE = 1e-6
#: A spread below this part of the map's longer side counts as a mistake.
SMALLEST_SPREAD = 1e-5
#: Up to this many nodes, all pairs of a complete graph are weighed at once (288 MB).
FULL_UP_TO = 6000


@dataclass(frozen=True)
class Evaluation(ShortRepr):
    """
    The oracle's evaluation of a path.

    Attributes
    ----------
    length, risk, cost
        ``cost = length + k * risk``; the length is measured on the plane, along legs that are straight there, map
        units.
    clearance
        Least distance to the no-fly area, map units; 0 where the path touches or crosses it, infinite without one.
    violations
        Why the path is not feasible, one sentence each; empty if it is.
    """

    length: float
    risk: float
    cost: float
    clearance: float
    violations: tuple[str, ...] = ()

    @property
    def feasible(self) -> bool:
        """Whether the path stays inside the bounds, crosses no no-fly area and keeps the clearance."""
        return not self.violations


@dataclass(frozen=True)
class Problem(Plottable):
    """
    A path to plan in the plane: from start to goal, at least cost ``length + k * risk``.

    Parameters
    ----------
    start, goal
        ``(x, y)``, map units, inside the bounds and not inside a no-fly area. They may be the same.
    field
        The risk field; None has no risk.
    k
        Risk weight, at least 0: how much length one unit of risk is worth.
    bounds
        ``(x_min, y_min, x_max, y_max)``, map units; no path may leave them.
    no_fly
        Shapely polygons that no path may cross; touching their boundary is allowed. None: no such area. The border of
        the map is no passage: where an area meets it, in a point too, or is nearer than 1e-9 of the map's longer side,
        the area closes it, and no path may pass between them or end there (`model`): an area's side on the border is
        closed. Wider bounds open it. Between areas that meet in a point inside the map, or are near each other, a path
        may pass.
    clearance
        Least distance of every path from the no-fly area, map units, at least 0. Solvers keep out of the area widened
        by it, with polygons for round corners (`model`), so that they stay up to 0.12 % farther away; the oracle
        measures the distance itself, and a proven bound holds for every path that keeps it.
    projection
        The projection from longitude and latitude to map units, metres; None for a map in the plane, or on that of its
        rasters' coordinate reference system. With one,
        solutions have ``lonlat``, and bounds of all paths hold on the Earth. `evaluate` measures on the plane, along
        legs that are straight there: lengths and risks exceed those on the Earth by at most the factor `stretch`.

    Raises
    ------
    ProblemError
        If a part is malformed, or start or goal are outside the bounds, inside the no-fly area, too near to it, or
        where it closes the border of the map.

    Examples
    --------
    >>> from cgla_graph.model.risk import Threat
    >>> field = RiskField([Threat(x=0.5, y=0.5, spread=0.1, peak=0.9)])
    >>> problem = Problem(start=(0.1, 0.1), goal=(0.9, 0.9), field=field, k=10.0, bounds=(0, 0, 1, 1))
    >>> round(problem.evaluate([(0.1, 0.1), (0.9, 0.9)]).cost, 3)
    3.387
    """

    start: Point
    goal: Point
    field: RiskField = field(default_factory=RiskField)
    k: float = 0.0
    bounds: Bounds = (0.0, 0.0, 1.0, 1.0)
    no_fly: BaseGeometry | None = None
    clearance: float = 0.0
    projection: LocalProjection | None = dataclasses.field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Check all parts once, so that no solver has to."""
        _check_projection(self.projection)
        object.__setattr__(self, "clearance", clearance_of(self.clearance))
        if self.field is None:
            object.__setattr__(self, "field", RiskField())
        object.__setattr__(self, "bounds", bounds_box(self.bounds))
        # (the model checks the field)
        rasters = getattr(self.field, "rasters", ())
        object.__setattr__(self, "projection", plane_of(self.projection, rasters, self.bounds))
        x_min, y_min, x_max, y_max = self.bounds
        for name in ("start", "goal"):
            x, y = point(name, getattr(self, name))
            object.__setattr__(self, name, (x, y))
            if not (x_min <= x <= x_max and y_min <= y <= y_max):
                box = self._shown((x_min, y_min), (x_max, y_min), (x_max, y_max), (x_min, y_max))
                msg = f"{name} {self._shown((x, y))} is outside the bounds {box}; move it, or widen the bounds"
                raise ProblemError(msg)
        object.__setattr__(self, "k", self.model.k)
        object.__setattr__(self, "field", self.model.field)
        for name in ("start", "goal"):
            if self.model.area.contains(getattr(self, name)):
                raise ProblemError(self._too_near(name))
        self._warn_of_small_spreads()

    def _too_near(self, name: str) -> str:
        """Return why start or goal may not be where it is."""
        place: Point = getattr(self, name)
        where = self._shown(place)
        away = self.area_as_given.path_clearance([place])
        unit = "" if self.projection is None else " m"
        if self.area.contains(place) and not self.area_as_given.contains(place):
            wider = f", widened by the clearance {self.clearance:g}{unit}," if 2.0 * away > self.clearance > 0.0 else ""
            return on_closed_border(name, where, f"the no-fly area{wider}")
        if self.area.contains(place):
            return f"{name} {where} is inside the no-fly area; move it to the boundary or outside"
        return (
            f"{name} {where} is {away:.6g}{unit} from the no-fly area, and the clearance is {self.clearance:g}{unit} "
            "(at round corners up to 0.12 % more); move it, or lower the clearance"
        )

    def _shown(self, *corners: Point) -> str:
        """Return a place, or the box of several, for messages: in degrees where the map has a projection."""
        if self.projection is None:
            return f"{corners[0] if len(corners) == 1 else self.bounds}"
        try:
            degrees = self.projection.inverse(corners)
        except ProblemError:
            # (farther away than any place of the Earth)
            return f"{corners[0] if len(corners) == 1 else self.bounds} (metres)"
        degrees[:, 0] += 360.0 * np.round((degrees[0, 0] - degrees[:, 0]) / 360.0)
        ends = degrees[:1] if len(corners) == 1 else np.stack([degrees.min(axis=0), degrees.max(axis=0)])
        return f"({', '.join(f'{number:.8g}' for number in ends.ravel().tolist())})"

    def _warn_of_small_spreads(self) -> None:
        """Warn of a threat that is too small for the map, such as one with a spread in degrees on a map in metres."""
        x_min, y_min, x_max, y_max = self.bounds
        side = max(x_max - x_min, y_max - y_min)
        number, spread = min(
            enumerate(threat.spread for threat in self.field.every_threat), key=lambda pair: pair[1], default=(0, side)
        )
        if spread < SMALLEST_SPREAD * side:
            msg = (
                f"threat {number} has a spread of {spread:g} on a map {side:g} wide, far below what it can show; "
                "give spreads in the map's units (metres on a map in longitude and latitude)"
            )
            warnings.warn(msg, SmallSpreadWarning, stacklevel=4)

    @cached_property
    def model(self) -> CostModel:
        """The cost of segments: infinite where one comes nearer to the no-fly area than the clearance."""
        return CostModel(self.field, self.k, closed_area(self.no_fly, self.bounds, self.clearance))

    @cached_property
    def area(self) -> NoFlyArea:
        """The area that no path may cross: the no-fly area, joined with the outside where it closes the border."""
        if self.clearance == 0.0 or self.no_fly is None:
            return self.model.area
        closing = [box for distance in (0.0, self.clearance) for box in stretches(self.no_fly, self.bounds, distance)]
        return indexed_area(joined_with(self.no_fly, closing))

    @property
    def area_as_given(self) -> NoFlyArea:
        """The no-fly area as it was given, to measure distances from and to draw."""
        return indexed_area(self.no_fly)

    def relaxed(self) -> "Problem":
        """
        Return a problem without clearance in which all feasible paths of this one are feasible, to bound their cost.

        Examples
        --------
        >>> import shapely
        >>> box = shapely.box(0.4, -0.3, 0.6, 0.3)
        >>> problem = Problem((0, 0), (1, 0), bounds=(0, -1, 1, 1), no_fly=box, clearance=0.1)
        >>> bool(problem.relaxed().model.area.geometry.within(problem.model.area.geometry))
        True
        """
        if self.clearance == 0.0 or self.no_fly is None:
            return self
        # (what closes the border at less than `least` is nearer than the clearance)
        least = self.clearance - self._slack - 12.0 * widest_gap(self.bounds)
        closed = widened(self.no_fly, least, inside=True) if least > 0.0 else self.no_fly
        closed = joined_with(closed, stretches(self.no_fly, self.bounds, self.clearance))
        return replace(self, no_fly=closed, clearance=0.0)

    @property
    def _slack(self) -> float:
        """By how much a path may miss the clearance, for rounding."""
        x_min, y_min, x_max, y_max = self.bounds
        return ROUNDING * max(x_max - x_min, y_max - y_min)

    @classmethod
    def in_degrees(
        cls,
        start: Point,
        goal: Point,
        *,
        bounds: Bounds,
        threats: Sequence[Threat] = (),
        rasters: Sequence[RasterRisk] = (),
        k: float = 0.0,
        no_fly: BaseGeometry | None = None,
        clearance: float = 0.0,
        projection: LocalProjection | None = None,
    ) -> "Problem":
        """
        Make a problem of longitudes and latitudes: the same as a scenario file in degrees.

        Parameters
        ----------
        start, goal
            Longitude and latitude, degrees.
        bounds
            West, south, east, north, degrees; across the antimeridian, east goes on beyond 180, or is less than west.
            The problem's are the least box in metres around them.
        threats
            With centres in degrees and spreads in metres.
        rasters
            In metres around the projection's origin (``RasterRisk.from_file(…, projection=projection)``).
        k
            Risk weight, as in `Problem`.
        no_fly
            Polygons in degrees, straight edges there; longitudes go on beyond 180 across the antimeridian.
        clearance
            Metres, as in `Problem`.
        projection
            None: around the middle of the geodesic from start to goal, which distorts that least.

        Returns
        -------
        problem
            In metres. It knows its `projection`.

        Raises
        ------
        ProblemError
            If a coordinate is out of range, or the problem is malformed.

        Examples
        --------
        >>> import shapely
        >>> problem = Problem.in_degrees(
        ...     (24.94, 60.17), (23.76, 61.50), bounds=(22, 60, 26, 62), no_fly=shapely.box(24, 60.5, 25, 61)
        ... )
        >>> round(problem.least_length)
        161490
        """
        _check_projection(projection)
        around = LocalProjection.between(start, goal) if projection is None else projection
        threats = items("threats", threats, "a list of threats")
        for one in threats:
            instance("a threat", one, Threat, "Threat(x=…, y=…, spread=…)")
        ends = around.forward([start, goal]).tolist()
        places = [around.forward((one.x, one.y)).tolist() for one in threats]
        closed = None if no_fly is None else project_on_map(no_fly, bounds, around)
        metres = projected_bounds(bounds, around)
        for name, given, (x, y) in zip(("start", "goal"), (start, goal), ends, strict=True):
            is_on_map = metres[0] <= x <= metres[2] and metres[1] <= y <= metres[3]
            if no_fly is None or closed is None or not is_on_map:
                continue
            if is_closed_by_border(no_fly, closed, given, (x, y)):
                raise ProblemError(on_closed_border(name, given))
        moved = [replace(one, x=place[0], y=place[1]) for one, place in zip(threats, places, strict=True)]
        return cls(
            (ends[0][0], ends[0][1]),
            (ends[1][0], ends[1][1]),
            RiskField(moved, rasters=rasters),
            k,
            metres,
            closed,
            clearance,
            around,
        )

    @property
    def least_length(self) -> float:
        """
        Lower bound of the length of every path: the distance of start and goal, on the Earth for a map in degrees.

        Examples
        --------
        >>> Problem((0, 0), (1, 0)).least_length
        1.0
        """
        if self.projection is None:
            return math.dist(self.start, self.goal)
        return self.projection.least_length(self.start, self.goal)

    def stretch(self, points: FloatArray) -> float:
        """
        Bound the ratio of a path's length on the map to its length on the Earth; 1 for a map in the plane.

        Parameters
        ----------
        points
            Waypoints of the path, shape ``(m, 2)``, map units.

        Returns
        -------
        stretch
            At least 1.

        Examples
        --------
        >>> Problem((0, 0), (1, 1)).stretch(np.array([[0.0, 0.0], [1.0, 1.0]]))
        1.0
        """
        if self.projection is None:
            return 1.0
        places = np.reshape(unmasked("points", points), (-1, 2))
        return self.projection.stretch(float(np.hypot(*places.T).max(initial=0.0)))

    @property
    def shorter_side(self) -> float:
        """The shorter side of the bounds, map units, as a unit for distances that fit any map."""
        x_min, y_min, x_max, y_max = self.bounds
        return min(x_max - x_min, y_max - y_min)

    def in_bounds(self, points: FloatArray) -> BoolArray:
        """
        Tell which points are inside the bounds or on their border.

        Parameters
        ----------
        points
            Shape ``(..., 2)``, map units.

        Returns
        -------
        inside
            Shape ``(...)``.

        Examples
        --------
        >>> Problem((0, 0), (1, 1)).in_bounds(np.array([[0.5, 1.0], [0.5, 1.1]])).tolist()
        [True, False]
        """
        points, corners = number_array("points", points), np.array(self.bounds)
        return np.asarray(((points >= corners[:2]) & (points <= corners[2:])).all(axis=-1))

    def evaluate(self, path: ArrayLike) -> Evaluation:
        """
        Evaluate any polyline: the oracle that judges all solvers.

        Parameters
        ----------
        path
            Waypoints, shape ``(m, 2)`` with ``m >= 1``, map units. It need not join start and goal.

        Returns
        -------
        evaluation
            Length, risk, cost, clearance, and why the path is infeasible.

        Raises
        ------
        ProblemError
            If the path is empty or not made of finite pairs.

        Examples
        --------
        >>> import shapely
        >>> wall = shapely.box(0.4, 0, 0.6, 0.8)
        >>> problem = Problem((0.1, 0.1), (0.9, 0.1), no_fly=wall)
        >>> problem.evaluate([(0.1, 0.1), (0.9, 0.1)]).violations
        ('segment 0 crosses the no-fly area',)
        """
        waypoints = point_array("path", path)
        if waypoints.ndim != 2 or len(waypoints) == 0:  # noqa: PLR2004 - a list of points
            msg = f"path has shape {waypoints.shape}; give at least one waypoint, shape (m, 2)"
            raise ProblemError(msg)
        starts, ends = waypoints[:-1], waypoints[1:]
        if len(waypoints) == 1:
            starts = ends = waypoints
        length = float(np.hypot(*(ends - starts).T).sum())
        risk = float(self.field.line_integral(starts, ends).sum())
        clearance = (self.area if self.clearance == 0.0 else self.area_as_given).path_clearance(waypoints)
        return Evaluation(
            length=length,
            risk=risk,
            cost=length + self.k * risk,
            clearance=clearance,
            violations=tuple(self._violations(waypoints, self.area.crosses(starts, ends), clearance)),
        )

    def _violations(self, waypoints: FloatArray, crossing: BoolArray, clearance: float) -> list[str]:
        outside = ~self.in_bounds(waypoints)
        found = [f"waypoint {i} leaves the bounds" for i in np.nonzero(outside)[0][:1]] + [
            f"segment {i} crosses the no-fly area" for i in np.nonzero(crossing)[0][:1]
        ]
        if clearance < self.clearance - self._slack and not crossing.any():
            found.append(f"it comes within {clearance:.6g} of the no-fly area, and the clearance is {self.clearance:g}")
        return found

    def judge(self, solution: Solution) -> Solution:
        """
        Replace a solver's numbers of its path by the oracle's.

        Parameters
        ----------
        solution
            A solver's answer. Its status becomes ``INFEASIBLE`` if the path is infeasible, and ``FAILED`` if the path
            does not join start and goal, the solver's own cost is wrong, or its bound is above this path's cost or that
            of the straight line. A bound without a certificate of this problem becomes a `claimed_bound`.

        Returns
        -------
        solution
            A new one.
        """
        solution = replace(with_claims(solution, self), projection=self.projection, problem=self)
        if not solution.status.has_path:
            return replace(solution, cost=np.inf, length=np.inf, risk=np.inf)
        try:
            found = self.evaluate(solution.path)
        except ProblemError as error:
            return _refuse(solution, str(error))
        path = point_array("path", solution.path)
        if tuple(path[0]) != self.start or tuple(path[-1]) != self.goal:
            return _refuse(solution, f"the path joins {path[0].tolist()} and {path[-1].tolist()}, not start and goal")
        judged = replace(
            solution, path=path, cost=found.cost, length=found.length, risk=found.risk, clearance=found.clearance
        )
        if found.violations:
            words = "; ".join(found.violations)
            return replace(judged, status=Status.INFEASIBLE, claimed_bound=np.nan, message=words)
        judged = _honest(solution, judged)
        if np.isnan(judged.claimed_bound):
            return judged
        straight = self.evaluate([self.start, self.goal])
        return refuted(judged, straight.cost if straight.feasible else np.inf, "the straight line")

    def plot(self, *solutions: Solution, ax: "Axes | None" = None) -> "Axes":
        """
        Draw the map with its risk, its no-fly area, and the paths of solutions.

        Parameters
        ----------
        *solutions
            Solutions of any solvers; the legend gives the cost of each.
        ax
            Matplotlib axes to draw on; None makes a figure, as ``pyplot`` does, with a legend beside the map.

        Returns
        -------
        axes
            The axes of the map. Coordinates are map units, or kilometres on a map in longitude and latitude.

        Examples
        --------
        >>> from matplotlib.figure import Figure
        >>> axes = Problem((0.1, 0.1), (0.9, 0.9)).plot(ax=Figure().add_subplot())
        >>> axes.get_xlabel(), axes.get_ylabel()
        ('x', 'y')
        """
        axes: Axes = function_above("plot")(self, ax=ax, solutions=solutions)
        return axes

    def on_lattice(
        self, resolution: "int | tuple[int, int] | Lattice" = 20, *, extra: Iterable[Point] = ()
    ) -> "GraphProblem":
        """
        Build the complete graph of a lattice over the bounds, with start and goal as nodes.

        Parameters
        ----------
        resolution
            Points a side of a closed lattice over the bounds, or a `Lattice`. If the lattice goes beyond the bounds,
            the oracle refuses paths through the points outside.
        extra
            More points that become nodes, map units.

        Returns
        -------
        problem
            The same problem on a graph whose weights are computed on request (see `GraphProblem.with_weights_held`).

        Raises
        ------
        ProblemError
            If the resolution is below 2.
        """
        lattice = resolution if isinstance(resolution, Lattice) else Lattice(resolution, bounds=self.bounds)
        nodes = (self.start, self.goal, *items("extra", extra, "a list of points (x, y)"))
        graph = GeometricGraph.complete(lattice, self.field, self.k, no_fly=self.model.no_fly, extra=nodes)
        return GraphProblem(graph, graph.node_at(self.start), graph.node_at(self.goal))

    def on_eight_connected(
        self, resolution: "int | tuple[int, int] | Lattice" = 20, *, corner_rule: CornerRule = "touch"
    ) -> "GraphProblem":
        """Build the 8-connected lattice over the bounds; otherwise like `on_lattice`."""
        lattice = resolution if isinstance(resolution, Lattice) else Lattice(resolution, bounds=self.bounds)
        graph = GeometricGraph.eight_connected(
            lattice,
            self.field,
            self.k,
            no_fly=self.model.no_fly,
            extra=(self.start, self.goal),
            corner_rule=corner_rule,
        )
        return GraphProblem(graph, graph.node_at(self.start), graph.node_at(self.goal))


@dataclass(frozen=True, eq=False)
class GraphProblem(Plottable):
    """
    A path to plan on a graph: from source to target, at least total weight.

    Parameters
    ----------
    graph
        The graph.
    source, target
        Two of its nodes; they may be the same.

    Raises
    ------
    NodeNotFoundError
        If a node is not in the graph.

    Examples
    --------
    >>> chain = GeometricGraph.from_matrix([[0, 1, 9], [1, 0, 1], [9, 1, 0]], labels="abc")
    >>> GraphProblem(chain, "a", "c").evaluate(["a", "b", "c"])
    2.0
    """

    graph: GeometricGraph
    source: Node
    target: Node

    def __post_init__(self) -> None:
        """Check that the graph has both nodes."""
        instance("graph", self.graph, GeometricGraph, graph_wanted, GraphError)
        self.graph.index_of(self.source)
        self.graph.index_of(self.target)

    def evaluate(self, nodes: Sequence[Node]) -> float:
        """
        Add up the weights along some nodes: infinite where an edge is missing.

        Raises
        ------
        NodeNotFoundError
            If a node is not in the graph.
        GraphError
            If the weights add up to more than the largest float.
        """
        indices = [self.graph.index_of(node) for node in items("nodes", nodes, "a list of nodes", GraphError)]
        weights = [self.graph.weight(i, j) for i, j in pairwise(indices)]
        total = float(sum(weights))
        if total == np.inf and np.isfinite(weights).all():
            refuse_sum()
        return total

    def reject_overflow(self) -> None:
        """
        Raise an error if there is a path after all, whose cost is beyond the largest float.

        Raises
        ------
        GraphError
            If the weights of a path add up to more than that.
        """
        if self.graph.n_nodes * self.graph.greatest_weight > sys.float_info.max:
            search: Any = scipy.sparse.csgraph.dijkstra
            values = search(self.graph.to_csgraph(), indices=self.graph.index_of(self.source))
            reject_overflow(values, self.graph.weights_from)

    def with_weights_held(self) -> "GraphProblem":
        """Return the problem on the graph with all its weights held in memory, for several solvers to share."""
        return replace(self, graph=self.graph.with_weights_held())

    def weighed(self) -> "GraphProblem":
        """Call `with_weights_held`; a deprecated alias."""
        warnings.warn("weighed() is now with_weights_held()", DeprecationWarning, stacklevel=2)
        return self.with_weights_held()

    def judge(self, solution: Solution) -> Solution:
        """
        Replace a solver's numbers of its nodes by the graph's (see `Problem.judge`).

        Risk is the integral of the cost model's field along the path, and length needs positions; each is NaN where the
        graph has no model or no positions.
        """
        solution = replace(with_claims(solution, self), problem=self)
        if not solution.status.has_path:
            if solution.status is Status.NO_PATH:
                self.reject_overflow()
            return replace(solution, cost=np.inf, length=np.inf, risk=np.inf)
        try:
            given = items("nodes", solution.nodes, "the nodes of the path", GraphError)
            # (labels that are equal to the graph's, as those of numpy, become the graph's own)
            nodes = tuple(self.graph.labels[self.graph.index_of(node)] for node in given)
            if (nodes[:1], nodes[-1:]) != ((self.source,), (self.target,)):
                ends = f"joins {shown(nodes[0])} and {shown(nodes[-1])}" if nodes else "has no nodes"
                return _refuse(solution, f"the path {ends}; it must join {shown(self.source)} and {shown(self.target)}")
            cost = self.evaluate(nodes)
        except (GraphError, NodeNotFoundError) as error:
            return _refuse(solution, str(error))
        judged = replace(solution, nodes=nodes, cost=cost, length=np.nan, risk=np.nan)
        if self.graph.positions is not None:
            path = self.graph.positions[[self.graph.index_of(node) for node in nodes]]
            length = float(np.hypot(*np.diff(path, axis=0).T).sum())
            judged = replace(judged, path=path, length=length)
            if self.graph.model is not None:
                risk = self.graph.model.field.line_integral(path[:-1], path[1:])
                judged = replace(judged, risk=float(risk.sum()))
        if not np.isfinite(cost):
            words = "the path uses an edge that is not there"
            return replace(judged, status=Status.INFEASIBLE, claimed_bound=np.nan, message=words)
        judged = _honest(solution, judged)
        if np.isnan(judged.claimed_bound):
            return judged
        return refuted(judged, self.evaluate([self.source, self.target]), "the edge from source to target")


def problem_wanted(value: object, *, on_graph: bool = False) -> str:
    """
    Return what to give instead of a value that is no problem, or a problem on a graph instead of one in the plane.

    Examples
    --------
    >>> problem_wanted("paper")
    'a Problem, as load_scenario(name).problem'
    """
    if isinstance(getattr(value, "problem", None), Problem | GraphProblem):
        return f"its problem, as {type(value).__name__.lower()}.problem"
    if isinstance(value, str | os.PathLike):
        return "a Problem, as load_scenario(name).problem"
    made = "graph" if isinstance(value, GeometricGraph) else graph_wanted(value)
    if on_graph and (made == "graph" or "from_" in made):
        return f"a Problem, or a GraphProblem for a graph: GraphProblem({made}, source, target)"
    return "a Problem, which knows length and risk apart"


def _check_projection(projection: object) -> None:
    wanted = "a LocalProjection, as LocalProjection(longitude, latitude), or None for a map in the plane"
    instance("projection", projection, (LocalProjection, NoneType), wanted)


def _honest(claimed: Solution, judged: Solution) -> Solution:
    """Return the judged solution unless the solver's own cost or bound contradicts it."""
    said: object = claimed.cost
    cost = real_number(said)
    left_out = said is None or cost == math.inf
    if not left_out and not abs(cost - judged.cost) <= COST_TOLERANCE * abs(judged.cost) + 1e-12:
        own = shown(said) if math.isnan(cost) else f"{cost:.9g}"
        lie = f"the solver says its path costs {own}, the oracle says {judged.cost:.9g}"
        return replace(judged, status=Status.FAILED, claimed_bound=np.nan, message=lie)
    return refuted(judged, judged.cost, "its own")


def _refuse(solution: Solution, message: str) -> Solution:
    """Return a failure without the solver's own answer."""
    failed = Solution(Status.FAILED, message=message)
    answer = "status", "path", "nodes", "cost", "length", "risk", "lower_bound", "claimed_bound", "message"
    return replace(solution, **{name: getattr(failed, name) for name in answer})
