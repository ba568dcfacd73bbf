"""The answer to a budget of risk or length: a path, and a proven bound for all that keep the budget."""

import math
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import numpy as np

from cgla_graph._text import ShortRepr, json_number
from cgla_graph.model.solution import Solution, Status

Scope: TypeAlias = Literal["lattice", "plane"]


@dataclass(frozen=True, eq=False)
class PlanWithin(ShortRepr):
    """
    A path that keeps a budget, and the proven bound of all paths that do.

    Attributes
    ----------
    solution
        The path, judged under the problem's own weight. ``OPTIMAL``: no path on the lattice that keeps the budget is
        better.
    limited
        What the budget limits: ``risk``, so that length is made small, or ``length`` or ``energy``, so that risk is.
    budget
        The most that a path may use: risk without a unit, length in map units, or energy in watt-hours.
    k
        The risk weight that prices the budget: the one that proves `dual_bound`. Infinite where risk alone counts.
    dual_bound
        Proven by Lagrangian duality: no path that keeps the budget has less length (or risk) than this, on the Earth
        where the map is in degrees and `scope` is the plane. Infinite if it is proven that no path keeps it; NaN where
        nothing is proven.
    cut_bound
        The same, proven by the best weight at each place (`cgla_graph.certificate.within`), in the plane where the dual
        bound leaves more than the tolerance; NaN where it was not looked for.
    scope
        Of which paths that is proven: all on the ``lattice``, by an exact solver of this package, or all in the
        ``plane`` inside the bounds, by a certificate. A solver that finds no path proves nothing about the plane.
    n_solves
        Solver runs it took.
    """

    solution: Solution
    limited: Literal["risk", "length", "energy"]
    budget: float
    k: float
    dual_bound: float
    scope: Scope
    n_solves: int
    cut_bound: float = math.nan

    @property
    def status(self) -> Status:
        """How it ended."""
        return self.solution.status

    @property
    def message(self) -> str:
        """The solver's message; for a budget that is too small, the least possible."""
        return self.solution.message

    @property
    def no_path(self) -> bool:
        """Whether it is proven that no path of the `scope` keeps the budget."""
        return math.isinf(self.dual_bound)

    @property
    def lower_bound(self) -> float:
        """The better of the two bounds; NaN where nothing is proven."""
        return float(np.fmax(self.dual_bound, self.cut_bound))

    @property
    def gap(self) -> float:
        """
        Length (or risk) over `lower_bound`, minus 1; NaN without a path.

        At least as large as the distance from the best path within the budget.
        """
        return self._above(self.lower_bound)

    @property
    def duality_gap(self) -> float:
        """
        Length (or risk) over `dual_bound`, minus 1; NaN without a path.

        It stays above 0 where the best path within the budget is cheapest under no risk weight.
        """
        return self._above(self.dual_bound)

    def _above(self, bound: float) -> float:
        """Return by which ratio the path is above a bound."""
        if not self.status.has_path:
            return math.nan
        value = self.solution.length if self.limited == "risk" else self.solution.risk
        if value <= bound:
            return 0.0
        return value / bound - 1.0 if bound > 0.0 else math.inf

    def document(self) -> dict[str, Any]:
        """Return the proof as JSON, without the path; numbers that are not finite are None."""
        return {
            "limited": self.limited,
            "budget": self.budget,
            "k": json_number(self.k),
            "dual_bound": json_number(self.dual_bound),
            "duality_gap": json_number(self.duality_gap),
            "cut_bound": json_number(self.cut_bound),
            "lower_bound": json_number(self.lower_bound),
            "gap": json_number(self.gap),
            "scope": self.scope,
            "no_path": self.no_path,
            "solves": self.n_solves,
        }
