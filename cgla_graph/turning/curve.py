"""A curve of lines and arcs: its points, headings, cost and clearance."""

import math
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from cgla_graph._text import ShortRepr
from cgla_graph._types import BoolArray, FloatArray, IntArray
from cgla_graph._validate import positive_number
from cgla_graph.model.clearance import ROUNDING
from cgla_graph.model.problem import Evaluation, Problem
from cgla_graph.turning import curve_kernels
from cgla_graph.turning.curve_kernels import CROSSES, CX, CY, LEAVES, N_COLUMNS, RADIUS, TURN, X0, X1, Y0, Y1

#: Points of one polyline, at most.
MOST_POINTS = 200_000


@dataclass(frozen=True, eq=False)
class Curve(ShortRepr):
    """
    Straight lines and circular arcs, one after the other.

    Attributes
    ----------
    pieces
        Shape ``(n, 8)``, map units: the ends ``x0, y0, x1, y1`` of each piece; for an arc also its centre, its radius
        and its turn, radians, positive to the left. A line has radius 0.

    Examples
    --------
    A line of length 2 and a quarter of a circle to the left.

    >>> curve = Curve(np.array([[0, 0, 2, 0, 0, 0, 0, 0], [2, 0, 3, 1, 2, 1, 1, math.pi / 2]]))
    >>> round(curve.length, 9) == round(2 + math.pi / 2, 9), curve.least_radius
    (True, 1.0)
    """

    pieces: FloatArray = field(default_factory=lambda: np.empty((0, N_COLUMNS)))

    @cached_property
    def lengths(self) -> FloatArray:
        """The length of each piece, shape ``(n,)``, map units."""
        rows = self.pieces
        straight = np.hypot(rows[:, X1] - rows[:, X0], rows[:, Y1] - rows[:, Y0])
        return np.where(rows[:, RADIUS] > 0.0, rows[:, RADIUS] * np.abs(rows[:, TURN]), straight)

    @property
    def length(self) -> float:
        """The length of the curve, map units."""
        return float(self.lengths.sum())

    @property
    def arcs(self) -> IntArray:
        """Indices of the pieces that are arcs."""
        return np.nonzero(self.pieces[:, RADIUS] > 0.0)[0]

    @property
    def least_radius(self) -> float:
        """The radius of the tightest arc; infinite if there is none."""
        return float(self.pieces[self.arcs, RADIUS].min(initial=math.inf))

    def headings(self, which: IntArray, shares: FloatArray) -> FloatArray:
        """
        Return the headings at shares (0 to 1) of some pieces, shape ``(n,)``, radians counter-clockwise from x.

        Examples
        --------
        >>> turn = Curve(np.array([[2, 0, 3, 1, 2, 1, 1, math.pi / 2]]))
        >>> (turn.headings(np.array([0, 0]), np.array([0.0, 1.0])) / math.pi).tolist()
        [0.0, 0.5]
        """
        rows = self.pieces[which]
        straight = np.arctan2(rows[:, Y1] - rows[:, Y0], rows[:, X1] - rows[:, X0])
        out = np.arctan2(rows[:, Y0] - rows[:, CY], rows[:, X0] - rows[:, CX])
        bent = out + shares * rows[:, TURN] + 0.5 * math.pi * np.sign(rows[:, TURN])
        return np.where(rows[:, RADIUS] > 0.0, bent, straight)

    def at(self, distances: FloatArray) -> tuple[IntArray, FloatArray, FloatArray]:
        """
        Find points by their distances along the curve.

        Parameters
        ----------
        distances
            Shape ``(n,)``, map units, from 0 to `length`.

        Returns
        -------
        which, shares, points
            The piece of each point, the share of the piece before it, and the point, shape ``(n, 2)``.
        """
        ends = np.cumsum(self.lengths)
        which = np.minimum(np.searchsorted(ends, distances, side="left"), len(ends) - 1)
        lengths = self.lengths[which]
        behind = distances - (ends[which] - lengths)
        shares = np.clip(np.divide(behind, lengths, out=np.zeros_like(behind), where=lengths > 0.0), 0.0, 1.0)
        points = np.empty((len(distances), 2))
        curve_kernels.places(self.pieces, which.astype(np.float64), shares, points)
        return which, shares, points

    def points(self, tolerance: float) -> FloatArray:
        """
        Return waypoints whose straight segments are within `tolerance` of the curve, shape ``(m, 2)``, map units.

        All waypoints are on the curve, and the ends of all pieces are among them.

        Raises
        ------
        ProblemError
            If the tolerance is not above 0.

        Examples
        --------
        >>> turn = Curve(np.array([[2, 0, 3, 1, 2, 1, 1, math.pi / 2]]))
        >>> len(turn.points(0.01)), len(turn.points(0.0001))
        (7, 57)
        """
        tolerance = positive_number("tolerance", tolerance)
        if not len(self.pieces):
            return np.empty((0, 2))
        counts = np.ones(len(self.pieces), dtype=np.int64)
        for i in self.arcs:
            # a chord over an angle a is R (1 - cos(a / 2)) from the arc
            radius, turn = self.pieces[i, RADIUS], abs(self.pieces[i, TURN])
            widest = 2.0 * math.acos(max(1.0 - tolerance / radius, 0.0))
            counts[i] = min(max(1, math.ceil(turn / max(widest, 1e-9) - 1e-9)), MOST_POINTS)
        which = np.repeat(np.arange(len(counts)), counts)
        part = np.arange(len(which)) - np.repeat(np.cumsum(counts) - counts, counts)
        out = np.empty((len(which) + 1, 2))
        curve_kernels.places(self.pieces, which.astype(np.float64), part / counts[which], out[:-1])
        out[-1] = self.pieces[-1, [X1, Y1]]
        return out

    def points_around(self, tolerance: float) -> FloatArray:
        """
        Return waypoints whose segments are within `tolerance` of the curve, on the outer side of its arcs.

        Segments of `points` cut arcs short; segments of these waypoints touch arcs in their middles, so that they keep
        the distance to an area inside a turn. Arguments and errors are those of `points`.

        Examples
        --------
        >>> turn = Curve(np.array([[2, 0, 3, 1, 2, 1, 1, math.pi / 2]]))
        >>> turn.points_around(0.5).round(9).tolist()
        [[2.0, 0.0], [3.0, 0.0], [3.0, 1.0]]
        """
        tolerance = positive_number("tolerance", tolerance)
        out = [self.pieces[:1, [X0, Y0]].reshape(-1, 2)]
        for piece in self.pieces:
            radius, turn = piece[RADIUS], piece[TURN]
            if radius > 0.0:
                # the corner of tangents over an angle a is R (1 / cos(a / 2) - 1) from the arc
                widest = 2.0 * math.acos(radius / (radius + tolerance))
                count = min(max(1, math.ceil(abs(turn) / widest - 1e-9)), MOST_POINTS)
                half = 0.5 * turn / count
                begin = math.atan2(piece[Y0] - piece[CY], piece[X0] - piece[CX])
                angles = begin + half * (2.0 * np.arange(count) + 1.0)
                ring = np.column_stack([np.cos(angles), np.sin(angles)])
                out.append(piece[[CX, CY]] + radius / math.cos(half) * ring)
            else:
                out.append(piece[None, [X1, Y1]])
        out.append(self.pieces[-1:, [X1, Y1]].reshape(-1, 2))
        points = np.concatenate(out)
        apart: BoolArray = np.append(True, (np.diff(points, axis=0) != 0.0).any(axis=1))
        return np.asarray(points[apart])

    def evaluate(self, problem: Problem) -> Evaluation:
        """
        Evaluate the curve as `Problem.evaluate` does polylines; it is not sampled, apart from quadrature of the risk.

        Examples
        --------
        >>> curve = Curve(np.array([[0, 0, 1, 0, 0, 0, 0, 0], [1, 0, 2, 1, 1, 1, 1, math.pi / 2]]))
        >>> curve.evaluate(Problem((0, 0), (2, 0.5), bounds=(0, 0, 2, 0.5))).violations
        ('arc 1 leaves the bounds',)
        """
        risks = np.zeros(len(self.pieces))
        if problem.k > 0.0 or not problem.field.is_empty:
            curve_kernels.piece_risks(self.pieces, problem.field.kernel_field(), risks)
        x_min, y_min, x_max, y_max = problem.bounds
        slack = ROUNDING * max(x_max - x_min, y_max - y_min)
        number, why = curve_kernels.first_fault(self.pieces, problem.area.kernel_arrays, problem.bounds, 0.0)
        violations = []
        clearance = 0.0
        if number >= 0:
            kind = "arc" if self.pieces[number, RADIUS] > 0.0 else "line"
            violations.append(f"{kind} {number} {'leaves the bounds' if why == LEAVES else 'crosses the no-fly area'}")
        if why != CROSSES:
            edges = problem.area_as_given.edges
            clearance = curve_kernels.curve_clearance(self.pieces, np.array(edges)) if len(edges) else math.inf
            if clearance < problem.clearance - slack:
                violations.append(
                    f"it comes within {clearance:.6g} of the no-fly area, and the clearance is {problem.clearance:g}"
                )
        length, risk = self.length, float(risks.sum())
        return Evaluation(length, risk, length + problem.k * risk, clearance, tuple(violations))
