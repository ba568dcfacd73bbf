"""The visibility graph: threats become polygons, and the shortest path around them is found."""

import math
from dataclasses import dataclass
from typing import Annotated, ClassVar

import numpy as np
from shapely.geometry import GeometryCollection, Polygon

from cgla_graph._types import BoolArray, FloatArray, Point
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import Threat
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Positive, Settings, Whole
from cgla_graph.solvers.geometry import around_circle
from cgla_graph.solvers.shortest_paths import path_to

#: The shares of `spreads` that are tried one after the other; 0 leaves the no-fly areas alone.
SHARES = (1.0, 0.8, 0.6, 0.4, 0.2, 0.0)
#: A polygon that would cover start or goal becomes smaller until it is this much, relative to it, away from them.
ASIDE = 1e-9
#: Polygons smaller than this, relative to the map, are left out: rounding would make their edges cross.
SMALLEST = 1e-9
#: Corners that turn in by less than this, radians, count as turning out: rounding must not hide one that is nearly
#: straight, and one too many costs nothing.
STRAIGHT = 1e-12


@dataclass(frozen=True)
class VisibilityGraph(Settings):
    """
    The shortest path around polygons that stand for the threats: risk is either avoided or ignored.

    **Public.** Bellingham, Richards and How (ACC 2002) take threats for polygons, and use that a shortest path around
    polygons bends only in corners that see each other (Lozano-Perez and Wesley 1979); the lengths of such paths are
    their cost to go. **Our design.** A threat is a regular polygon about the disc of `spreads` spreads around its
    centre, outside which its own risk is at most ``peak * exp(-spreads^2 / 2)``: the disc's level set. The polygon is
    circumscribed, so that the path keeps out of the disc. One that covers start or goal becomes smaller until that
    end is on its edge. If the polygons seal the way, all of them become smaller by steps, and the answer says so;
    no-fly areas stay as they are, so that a path is found wherever there is one. The search is A* with the straight
    line as its heuristic; whether two corners see each other is tested when one of them is expanded. No code was
    available: this is in the style of the original, not the original.

    **Known failures.** Risk is all or nothing: the path grazes rims, and takes a long way around a threat that is
    cheap to cross, for every `Problem.k`. Where polygons overlap, a passage is closed although its risk is low.

    `Solution.evaluations` counts the segments that were tested for crossing.

    Attributes
    ----------
    spreads
        Radius of the discs in spreads of their threats, above 0. The default leaves a risk of 0.044 times the peak.
    corners
        Of a polygon, 3 to 1000. Twice as many corners leave a fourth of the detour around the disc.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    Around one disc of radius r, seen from both sides at a distance d: two tangents and an arc.

    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> r, d = 0.2, 0.4
    >>> tangents_and_arc = 2 * math.sqrt(d**2 - r**2) + r * (math.pi - 2 * math.acos(r / d))
    >>> round(VisibilityGraph(spreads=2, corners=720).solve(problem).cost / tangents_and_arc, 4)
    1.0
    """

    spreads: Positive = 2.5
    corners: Annotated[int, Whole(3, 1000)] = 16

    traits: ClassVar[Traits] = Traits(
        "visibility-graph",
        "the shortest path around threats as polygons (Bellingham)",
        domain="plane",
        rasters=False,
    )

    def solve(self, problem: Problem) -> Solution:
        """Find the shortest path, around smaller polygons where there is none."""
        tested = 0
        for share in SHARES:
            spreads = share * self.spreads
            search = _Search(problem, NoFlyArea(GeometryCollection(self._polygons(problem, spreads))))
            path = search.shortest()
            tested += search.tested
            if len(path):
                message = "" if share == 1.0 else f"the threats seal the way at {self.spreads:g} spreads, not at "
                message += f"{spreads:g}" if message else ""
                cost = problem.evaluate(path).cost
                return Solution(Status.FOUND, path=path, cost=cost, evaluations=tested, message=message)
        from cgla_graph.certificate.verdict import is_proven_closed  # noqa: PLC0415 - rarely needed

        if is_proven_closed(problem):
            return Solution(Status.NO_PATH, evaluations=tested, message="the no-fly areas seal the way")
        message = "no way over the corners of the no-fly areas that it takes; whether there is another is not known"
        return Solution(Status.NOT_FOUND, evaluations=tested, message=message)

    def _polygons(self, problem: Problem, spreads: float) -> list[Polygon]:
        """Draw the threats on the map as polygons about their discs; those that cover start or goal are smaller."""
        low, high = np.reshape(problem.bounds, (2, 2))
        least = SMALLEST * problem.shorter_side
        sizes = [(threat, self._size(threat, spreads, problem)) for threat in problem.field.threats]
        unit = around_circle(self.corners) / math.cos(math.pi / self.corners)
        drawn = [(threat.x, threat.y) + size * unit for threat, size in sizes if size > least]
        on_map = [around for around in drawn if (around.max(axis=0) > low).all() and (around.min(axis=0) < high).all()]
        return [Polygon(around) for around in on_map]

    def _size(self, threat: Threat, spreads: float, problem: Problem) -> float:
        """Return the radius of the disc in a threat's polygon, small enough to leave start and goal outside."""
        # a polygon's edges face these directions; its size is how far they are out
        facing = around_circle(self.corners, first=0.5)
        ends = np.subtract([problem.start, problem.goal], (threat.x, threat.y))
        room = float((ends @ facing.T).max(axis=1).min())
        return min(spreads * threat.spread, room * (1.0 - ASIDE))


class _Search:
    """A* over start, goal and the corners that a shortest path may bend in."""

    def __init__(self, problem: Problem, threats: NoFlyArea) -> None:
        self.areas = [area for area in (problem.model.area, threats) if not area.is_empty]
        of_areas = [area.convex_corners(straight=STRAIGHT) for area in self.areas]
        corners = np.vstack([np.empty((0, 2)), *of_areas])
        usable = problem.in_bounds(corners)
        for area in self.areas:
            usable &= ~area.contains(corners)
        self.points = np.vstack([problem.start, problem.goal, corners[usable]])
        self.tested = 0

    def shortest(self) -> FloatArray:
        """Return the shortest path, shape ``(m, 2)``; empty if there is none."""
        to_goal = np.hypot(*(self.points - self.points[1]).T)
        length = np.full(len(self.points), math.inf)
        length[0] = 0.0
        previous = np.full(len(self.points), -1)
        unsettled = np.ones(len(self.points), dtype=np.bool_)
        while True:
            guess = np.where(unsettled, length + to_goal, math.inf)
            node = int(guess.argmin())
            if guess[node] == math.inf:
                return np.empty((0, 2))
            if node == 1:
                return self.points[path_to(node, previous)]
            unsettled[node] = False
            through = length[node] + np.hypot(*(self.points - self.points[node]).T)
            better = np.flatnonzero(unsettled & (through < length))
            seen = better[self._sees(tuple(self.points[node]), self.points[better])]
            length[seen] = through[seen]
            previous[seen] = node

    def _sees(self, place: Point, points: FloatArray) -> BoolArray:
        """Tell which points can be flown to straight, shape ``(n,)``."""
        self.tested += len(points)
        open_ = np.ones(len(points), dtype=np.bool_)
        for area in self.areas:
            open_ &= ~area.crosses(place, points)
        return open_
