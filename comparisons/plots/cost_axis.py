"""What the upward axis of cost over time shows: gaps over a lower bound, or costs where no bound is known."""

import math
import statistics
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.axes import Axes
from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter
from numpy.typing import ArrayLike

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.plots.text import cost_text
from cgla_graph.comparisons.plots.units import cost_unit, unit_scale
from cgla_graph.scenarios.scenario import Scenario

#: Gaps below this, in percent, are drawn on the lower edge: a logarithmic axis has no 0.
LEAST_GAP = 0.01


@dataclass(frozen=True)
class Measure:
    """
    How high a cost is drawn.

    Attributes
    ----------
    bound
        The lower bound that gaps are relative to, map units; anything but a positive number shows costs instead.
    scale
        What costs are multiplied with to be shown.
    unit
        That of costs, to follow a word.

    Examples
    --------
    >>> Measure(2.0, 1.0, "").heights([2.1, 4.0])
    array([  5., 100.])
    >>> Measure(math.nan, 1e-3, " (km)").heights([2000.0])
    array([2.])
    """

    bound: float
    scale: float
    unit: str

    @classmethod
    def of(cls, scenario: Scenario, bound: float) -> "Measure":
        """Choose it for a scenario."""
        return cls(bound, unit_scale(scenario), cost_unit(scenario))

    @property
    def is_gap(self) -> bool:
        """Whether gaps are shown, in percent."""
        return 0.0 < self.bound < math.inf

    def heights(self, costs: ArrayLike) -> FloatArray:
        """Return how high costs of any shape are drawn, in the unit of the axis; infinite ones stay infinite."""
        values = np.asarray(costs, dtype=np.float64)
        if not self.is_gap:
            return values * self.scale
        return np.maximum(100.0 * (values / self.bound - 1.0), LEAST_GAP)

    def limits(self, curves: Iterable[FloatArray], others: Sequence[float]) -> tuple[float, float]:
        """
        Choose the least and the greatest height to show: from the best to where the anytime solvers begin.

        A first cost far above the next one (or above other solvers') would press everything else flat.

        Parameters
        ----------
        curves
            Finite heights over time of each anytime solver, shape ``(m,)`` with ``m >= 1``.
        others
            Heights of the other results.

        Examples
        --------
        >>> low, high = Measure(math.nan, 1.0, "").limits([np.array([1000.0, 2.0, 1.0])], [1.5, 50.0])
        >>> round(low, 6), round(high, 6)
        (0.94, 2.12)
        """
        curves = list(curves)
        best = min([*others, *(float(curve.min()) for curve in curves)])
        # a logarithmic axis has more room
        wide = 30.0 if self.is_gap else 10.0
        begins = []
        for curve in curves:
            first, second = curve[0] - best, curve[min(1, len(curve) - 1)] - best
            begins.append(second if first > wide * second > 0.0 else first)
        usual = statistics.median_low(begins)
        reach = max(begin for begin in begins if begin <= (wide if self.is_gap else 4.0) * usual)
        near = [height - best for height in others if height - best <= (4.0 if self.is_gap else 1.5) * reach]
        reach = max([reach, *near])
        if self.is_gap:
            return float(best / 1.6), float(max(1.6 * (best + reach), 10.0 * best))
        reach = reach or 0.01 * abs(best) or 1.0
        return float(best - 0.06 * reach), float(best + 1.12 * reach)

    def frame(self, axes: Axes) -> None:
        """Label the upward axis; limits are set before."""
        if not self.is_gap:
            axes.set_ylabel(f"best cost so far{self.unit}")
            return
        axes.set_ylabel(f"best cost so far: gap over {cost_text(self.bound * self.scale)}{self.unit}")
        axes.set_yscale("log")
        low, high = axes.get_ylim()
        axes.yaxis.set_major_locator(LogLocator(subs=(1.0, 2.0, 5.0) if high < 300.0 * low else (1.0,)))
        axes.yaxis.set_major_formatter(FuncFormatter(lambda percent, _: f"{percent:g} %"))
        axes.yaxis.set_minor_formatter(NullFormatter())
