"""Costs of several solvers on the same instances: checked, equal up to rounding, and in ratios that keep failures."""

from collections.abc import Mapping, Sequence

import numpy as np

from cgla_graph._types import BoolArray, FloatArray

#: Costs that differ by no more than this, relative to the greater, are equal.
TIE = 1e-9
#: Logarithms of ratios are rounded to so many digits behind the point.
_DIGITS = 12


def cost_table(costs: Mapping[str, Sequence[float]]) -> dict[str, FloatArray]:
    """
    Check the costs of several solvers on the same instances.

    Parameters
    ----------
    costs
        One cost an instance for each solver; infinite without a path.

    Returns
    -------
    table
        The same as arrays, shape ``(n,)`` each.

    Raises
    ------
    ValueError
        If the costs are not equally many, or one is NaN or minus infinity.

    Examples
    --------
    >>> cost_table({"a": [1, 2]})
    {'a': array([1., 2.])}
    """
    table = {solver: cost_row(solver, values) for solver, values in costs.items()}
    sizes = {solver: len(values) for solver, values in table.items()}
    if len(set(sizes.values())) > 1:
        msg = f"the solvers have different numbers of costs, {sizes}; give one for each instance"
        raise ValueError(msg)
    return table


def cost_row(solver: str, costs: Sequence[float]) -> FloatArray:
    """
    Check the costs of one solver, one an instance, infinite without a path; `solver` is what messages call it.

    Raises
    ------
    ValueError
        If one is NaN or minus infinity.

    Examples
    --------
    >>> cost_row("a", [1, np.inf])
    array([ 1., inf])
    """
    values = np.asarray(costs, dtype=np.float64)
    wrong = np.isnan(values) | (values == -np.inf)
    if wrong.any():
        place = int(np.argmax(wrong))
        msg = f"cost {place} of {solver!r} is {values[place]}; a run without a path costs math.inf"
        raise ValueError(msg)
    return values


def same_cost(costs: FloatArray, others: FloatArray) -> BoolArray:
    """
    Say which costs are equal, up to rounding (`TIE`); two infinite ones are.

    Examples
    --------
    >>> same_cost(np.array([1.0, 1.0, np.inf]), np.array([1.0 + 1e-12, 1.1, np.inf]))
    array([ True, False,  True])
    """
    equal: BoolArray = np.equal(costs, others)
    finite = np.isfinite(costs) & np.isfinite(others) & ~equal
    a, b = costs[finite], others[finite]
    equal[finite] = np.abs(a - b) <= TIE * np.maximum(np.abs(a), np.abs(b))
    return equal


def log_ratios(costs: FloatArray, reference: FloatArray) -> FloatArray:
    """
    Return the logarithms of costs over a reference's: 0 for ties, two failures among them.

    A cost of 0 or below, which only problems without length or with improper fields have, is in no ratio to another;
    the lesser one counts as infinitely better.

    Examples
    --------
    >>> log_ratios(np.array([2.0, np.inf, np.inf, 1.0]), np.array([2.0, np.inf, 1.0, np.inf]))
    array([  0.,   0.,  inf, -inf])
    """
    ratios = np.where(costs < reference, -np.inf, np.inf)
    proper = (costs > 0.0) & (reference > 0.0) & np.isfinite(costs) & np.isfinite(reference)
    # rounded, so that ratios that are equal tie
    ratios[proper] = np.round(np.log(costs[proper]) - np.log(reference[proper]), _DIGITS)
    ratios[same_cost(costs, reference)] = 0.0
    return ratios
