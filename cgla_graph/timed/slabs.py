"""Slabs: the times between two events, in which all threats move straight on and no area opens or closes."""

import dataclasses
import math
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from shapely.geometry.base import BaseGeometry

from cgla_graph._text import ShortRepr
from cgla_graph._types import Bounds, FloatArray
from cgla_graph._validate import fixed
from cgla_graph.model.clearance import closed_area, joined_with, stretches
from cgla_graph.model.cost_model import indexed_area
from cgla_graph.model.no_fly import NoFlyArea
from cgla_graph.model.risk import RiskField


@dataclass(frozen=True, eq=False)
class Slab(ShortRepr):
    """
    A time without events, ``begins <= t <= ends``: nothing changes but places, spreads and peaks, each linearly.

    Attributes
    ----------
    begins, ends
        Its first and last time.
    threats
        The moving threats when it begins, in rows ``x, y, vx, vy, spread, spread rate, peak, peak rate``: shape
        ``(m, 8)``, read-only. Rates are per unit of time.
    field
        The risk that stands still.
    no_fly
        The areas that are closed, as they were given; None: none.
    bounds, clearance
        Of the problem.
    tolls
        When it begins (`tolls_from`).
    """

    begins: float
    ends: float
    threats: FloatArray
    field: RiskField
    no_fly: BaseGeometry | None
    bounds: Bounds = dataclasses.field(repr=False)
    clearance: float = dataclasses.field(default=0.0, repr=False)
    tolls: FloatArray = dataclasses.field(default_factory=lambda: np.zeros((0, 9)), repr=False)

    @cached_property
    def area(self) -> NoFlyArea:
        """The area that no path may cross, joined with the outside where it closes the border: `Problem.area`."""
        if self.no_fly is None or self.clearance == 0.0:
            return self.wide_area
        closing = [box for far in (0.0, self.clearance) for box in stretches(self.no_fly, self.bounds, far)]
        return indexed_area(joined_with(self.no_fly, closing))

    @cached_property
    def wide_area(self) -> NoFlyArea:
        """The area widened by the clearance, which solvers keep out of: the area of `Problem.model`."""
        return indexed_area(closed_area(self.no_fly, self.bounds, self.clearance))

    def threats_at(self, time: float) -> FloatArray:
        """
        Return the moving threats at a time of the slab.

        Examples
        --------
        >>> from cgla_graph.timed.moving import MovingThreat, motion_in_slab
        >>> storm = MovingThreat([(0, 0.2, 0.5), (10, 0.8, 0.5)], spread=0.1)
        >>> slab = Slab(0, 10, motion_in_slab([storm], 0), RiskField(), None, (0, 0, 1, 1))
        >>> slab.threats_at(5)[0, :2].round(3).tolist()
        [0.5, 0.5]
        """
        return self._moved(time, self.threats, [0, 1, 4, 6], [2, 3, 5, 7])

    def tolls_at(self, time: float) -> FloatArray:
        """Return the tolls at a time of the slab."""
        return self._moved(time, self.tolls, [0, 1, 7], [2, 3, 8])

    def _moved(self, time: float, motions: FloatArray, what: list[int], rates: list[int]) -> FloatArray:
        moved = motions.copy()
        # (before the first event, nothing moves)
        if math.isfinite(self.begins):
            moved[:, what] += (time - self.begins) * moved[:, rates]
        return fixed(moved)

    def part(self, begins: float, ends: float) -> "Slab":
        """Return the slab of a part of its time."""
        if (begins, ends) == (self.begins, self.ends):
            return self
        threats, tolls = self.threats_at(begins), self.tolls_at(begins)
        return replace(self, begins=begins, ends=ends, threats=threats, tolls=tolls)
