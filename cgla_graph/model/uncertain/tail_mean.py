"""The mean of the worst costs: CVaR over scenarios, and the weights of scenarios that give it."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from fractions import Fraction
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import shown
from cgla_graph._types import FloatArray
from cgla_graph._validate import items, number_array, real_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.uncertain.mixed_field import rounded_down

#: Probabilities whose sum differs from 1 by more than this are refused.
OFF = 1e-6


@dataclass(frozen=True)
class TailMean:
    """
    The mean of the costs in the worst ``1 - alpha`` of all cases: CVaR (Rockafellar, Uryasev, J. Risk 2(3), 2000).

    It is the greatest ``sum q_i c_i`` over ``q >= 0``, ``sum q_i = 1``, ``q_i <= p_i / (1 - alpha)``. The scenario in
    which the tail begins counts in part; if the tail is less probable than the worst scenario, this is the worst cost.

    Parameters
    ----------
    probabilities
        Of the scenarios, together 1; their sum is divided out exactly.
    alpha
        From 0, the expectation, to 1, the worst cost of a scenario whose probability is not 0.

    Raises
    ------
    ProblemError
        If a number is out of range.

    Examples
    --------
    >>> tail = TailMean((0.5, 0.25, 0.25), 0.5)
    >>> tail.of([1.0, 2.0, 4.0]), TailMean((0.5, 0.5), 0.25).of([0.0, 3.0])
    (3.0, 2.0)
    """

    probabilities: tuple[float, ...]
    alpha: float

    def __post_init__(self) -> None:
        """Check the numbers."""
        object.__setattr__(self, "probabilities", checked_probabilities(self.probabilities))
        alpha = real_number(self.alpha)
        if not 0.0 <= alpha <= 1.0:
            msg = f"alpha is {shown(self.alpha)}; give a number from 0 (the expectation) to 1 (the worst scenario)"
            raise ProblemError(msg)
        object.__setattr__(self, "alpha", alpha)

    @cached_property
    def caps(self) -> tuple[Fraction, ...]:
        """The most that each scenario may weigh, exactly: together at least 1."""
        exact = [Fraction(chance) for chance in self.probabilities]
        rest = sum(exact) * (1 - Fraction(self.alpha))
        return tuple(min(chance / rest if rest else Fraction(chance > 0), Fraction(1)) for chance in exact)

    def exact_weights(self, costs: ArrayLike) -> list[Fraction]:
        """Return the weights under which costs have their greatest mean, the worst scenarios first."""
        weights, left = [Fraction(0)] * len(self.caps), Fraction(1)
        for number in np.argsort(-self._checked(costs), kind="stable").tolist():
            weights[number] = min(self.caps[number], left)
            left -= weights[number]
            if not left:
                break
        return weights

    def weights(self, costs: ArrayLike) -> FloatArray:
        """
        Return these weights, rounded down, shape ``(n,)``: they never give more than `of`.

        Examples
        --------
        >>> TailMean((0.5, 0.25, 0.25), 0.5).weights([1.0, 2.0, 4.0]).tolist()
        [0.0, 0.5, 0.5]
        """
        return np.array([rounded_down(weight) for weight in self.exact_weights(costs)])

    def of(self, costs: ArrayLike) -> float:
        """Return the mean of the worst costs, shape ``(n,)``, rounded up."""
        checked = self._checked(costs)
        exact = sum(
            (
                weight * Fraction(cost)
                for weight, cost in zip(self.exact_weights(checked), checked, strict=True)
                if weight
            ),
            Fraction(0),
        )
        near = float(exact)
        return near if Fraction(near) >= exact else math.nextafter(near, math.inf)

    def inside(self, weights: ArrayLike) -> FloatArray:
        """
        Move weights into the set over which the mean is greatest, up to a sum below 1, exactly.

        As no risk is below 0, smaller weights give a smaller mean: what they bound is a bound.

        Examples
        --------
        >>> TailMean((0.5, 0.5), 0.0).inside([0.75, 0.25]).tolist()
        [0.5, 0.25]
        """
        given = np.maximum(number_array("weights", weights), 0.0).tolist()
        exact = [min(Fraction(weight), cap) for weight, cap in zip(given, self.caps, strict=True)]
        whole = max(sum(exact), Fraction(1))
        return np.array([rounded_down(weight / whole) for weight in exact])

    def holds(self, weights: Iterable[float]) -> bool:
        """Tell whether weights are in that set, exactly."""
        exact = [Fraction(weight) for weight in weights]
        fits = len(exact) == len(self.caps) and sum(exact) <= 1
        return fits and all(0 <= weight <= cap for weight, cap in zip(exact, self.caps, strict=True))

    def _checked(self, costs: ArrayLike) -> FloatArray:
        found = number_array("costs", costs)
        if found.shape != (len(self.probabilities),):
            msg = f"costs have shape {found.shape}; give one for each of {len(self.probabilities)} scenarios"
            raise ProblemError(msg)
        return found


def checked_probabilities(given: Sequence[float]) -> tuple[float, ...]:
    """
    Check probabilities: numbers from 0 to 1, together 1.

    Examples
    --------
    >>> checked_probabilities([0.5, 0.5])
    (0.5, 0.5)
    """
    wanted = "numbers from 0 to 1 that add up to 1"
    chances = tuple(map(real_number, items("probabilities", given, wanted)))
    total = math.fsum(chances) if all(0.0 <= chance <= 1.0 for chance in chances) else math.nan
    if not abs(total - 1.0) <= OFF:
        add_up = "" if math.isnan(total) else f", which add up to {total:g}"
        msg = f"probabilities are {shown(given)}{add_up}; give {wanted}, one for each scenario"
        raise ProblemError(msg)
    return chances
