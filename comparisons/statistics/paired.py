"""
Paired comparisons: two solvers on the same instances, judged by the order of their costs.

A solver without a path has infinite cost, and is not left out. Costs that differ by rounding are equal.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations
from typing import NamedTuple

import numpy as np
import scipy

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph._validate import number_array
from cgla_graph.comparisons.statistics.distributions import average_ranks, heads_test
from cgla_graph.comparisons.statistics.hodges_lehmann import EXACT, hodges_lehmann, subset_sums
from cgla_graph.comparisons.statistics.intervals import Estimate

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
    Check the costs of one solver, one an instance, infinite without a path; messages call it `solver`.

    Raises
    ------
    ValueError
        If one is NaN or minus infinity.

    Examples
    --------
    >>> cost_row("a", [1, np.inf])
    array([ 1., inf])
    """
    values = number_array("costs", costs)
    wrong = np.isnan(values) | (values == -np.inf)
    if wrong.any():
        place = int(np.argmax(wrong))
        msg = f"cost {place} of {solver!r} is {values[place]}; a run without a path costs math.inf"
        raise ValueError(msg)
    return values


def same_cost(costs: FloatArray, others: FloatArray) -> BoolArray:
    """
    Find which costs are equal up to rounding (`TIE`); two infinite costs are equal.

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
    Return the logarithms of the ratios of costs to a reference's; 0 for ties and for two failures.

    A cost of 0 or below (only problems without length or with improper fields have one) has no ratio to another; the
    lesser of the two counts as infinitely better.

    Examples
    --------
    >>> log_ratios(np.array([2.0, np.inf, np.inf, 1.0]), np.array([2.0, np.inf, 1.0, np.inf]))
    array([  0.,   0.,  inf, -inf])
    """
    ratios = np.where(costs < reference, -np.inf, np.inf)
    proper = (costs > 0.0) & (reference > 0.0) & np.isfinite(costs) & np.isfinite(reference)
    # rounded, so that equal ratios tie
    ratios[proper] = np.round(np.log(costs[proper]) - np.log(reference[proper]), _DIGITS)
    ratios[same_cost(costs, reference)] = 0.0
    return ratios


class SignedRank(NamedTuple):
    """
    Wilcoxon's signed-rank test (see `signed_rank`).

    Attributes
    ----------
    p
        Two-sided.
    effect
        Matched-pairs rank-biserial correlation: 1 where all differences are above 0, -1 where all are below.
    """

    p: float
    effect: float


@dataclass(frozen=True)
class Paired:
    """
    A solver against a reference, instance by instance.

    Attributes
    ----------
    solver, reference
        Labels.
    n
        Number of instances.
    wins, losses, ties
        On how many of them the solver is cheaper, more expensive, or equal; a solver that alone finds a path wins.
    ratio
        Cost of the solver over the cost of the reference: exponentials of the estimate of `hodges_lehmann` from the
        logarithms. From 0 to infinity if the instances are too few for an interval.
    effect
        From -1 (the solver is cheaper everywhere) to 1 (it is more expensive everywhere); see `SignedRank`.
    p
        Of the signed-rank test that neither is cheaper.
    p_holm
        The same, adjusted to all comparisons of the table (see `holm`).
    only_solver, only_reference
        On how many instances only one of the two has a path.
    p_success
        Of McNemar's test that neither has a path more often; not adjusted to other comparisons.
    """

    solver: str
    reference: str
    n: int
    wins: int
    losses: int
    ties: int
    ratio: Estimate
    effect: float
    p: float
    p_holm: float
    only_solver: int
    only_reference: int
    p_success: float


def holm(p_values: Sequence[float]) -> list[float]:
    """
    Adjust the p-values of one table: the probability that any false one is below `a` is at most `a`.

    The tests may depend on each other (Holm, Scandinavian Journal of Statistics 6(2), 1979).

    Returns
    -------
    adjusted
        In the same order; none is below the p-value given.

    Raises
    ------
    ValueError
        If one is not from 0 to 1.

    Examples
    --------
    >>> holm([0.01, 0.04, 0.03])
    [0.03, 0.06, 0.06]
    """
    p = number_array("p_values", p_values)
    if not ((p >= 0.0) & (p <= 1.0)).all():
        msg = f"the p-values are {list(p_values)}; give numbers from 0 to 1"
        raise ValueError(msg)
    order = np.argsort(p, kind="stable")
    adjusted = np.empty(len(p))
    adjusted[order] = np.minimum(1.0, np.maximum.accumulate(p[order] * np.arange(len(p), 0, -1)))
    return [float(value) for value in adjusted]


def signed_rank(differences: Sequence[float]) -> SignedRank:
    """
    Test by Wilcoxon's signed ranks whether paired differences are symmetric about 0.

    Differences of 0 share their ranks evenly between both sides ("zsplit"); equal sizes share their mean rank. The
    p-value is the probability that random signs put the rank sums at least as far apart, given the ties and zeros. It
    is exact up to 50 differences other than 0, normal beyond. It equals that of `scipy.stats.wilcoxon` without ties,
    and with ties where scipy permutes (up to 13 differences) or approximates (above 50, no zeros). With zeros, scipy's
    approximation counts signs that zeros do not have.

    Parameters
    ----------
    differences
        At least one. Infinite ones rank highest, all alike.

    Returns
    -------
    test
        With zeros only, `p` is 1 and the effect 0.

    Raises
    ------
    ValueError
        If there is no difference, or one is NaN.

    Examples
    --------
    >>> signed_rank([-1.0, -2.0, -3.0, -4.0, -5.0, -math.inf])
    SignedRank(p=0.03125, effect=-1.0)
    """
    values = number_array("differences", differences)
    if values.ndim != 1 or not values.size or np.isnan(values).any():
        msg = f"the differences are {list(differences)[:5]} ...; give a flat list of at least one number and no NaN"
        raise ValueError(msg)
    n = len(values)
    # twice the ranks: whole numbers, also of ties
    doubled = np.rint(2.0 * average_ranks(np.abs(values))).astype(np.int64)
    doubled, signs = doubled[values != 0.0], np.sign(values[values != 0.0])
    excess = int(signs @ doubled)
    effect = excess / (n * (n + 1))
    if len(doubled) <= EXACT:
        less = (int(doubled.sum()) - abs(excess)) // 2
        return SignedRank(min(1.0, 2.0 * float(subset_sums(doubled)[: less + 1].sum())), effect)
    z = abs(excess) / math.sqrt(float(doubled @ doubled))
    return SignedRank(2.0 * float(scipy.special.ndtr(-z)), effect)


def mcnemar(only_first: int, only_second: int) -> float:
    """
    Test whether two solvers find a path equally often, on the same instances (McNemar, Psychometrika 12(2), 1947).

    Instances on which both or neither succeed do not count.

    Parameters
    ----------
    only_first, only_second
        Number of instances on which only one of them found a path.

    Returns
    -------
    p
        Two-sided, exact (binomial); 1 if both counts are 0.

    Raises
    ------
    ValueError
        If a count is negative.

    Examples
    --------
    >>> mcnemar(0, 6)
    0.03125
    """
    if min(only_first, only_second) < 0:
        msg = f"the counts are {only_first} and {only_second}; give counts from 0"
        raise ValueError(msg)
    n = only_first + only_second
    return heads_test(only_first, n) if n else 1.0


def against(costs: Mapping[str, Sequence[float]], reference: str) -> list[Paired]:
    """
    Compare every other solver with one that was chosen by the same costs, as a winner is.

    The p-values are adjusted to the comparisons of all pairs, since the choice could have picked any solver.

    Parameters
    ----------
    costs
        One cost an instance for each solver, the instances in the same order; infinite without a path.
    reference
        The solver to compare with.

    Returns
    -------
    comparisons
        In the order of the solvers; empty without instances.

    Raises
    ------
    ValueError
        If the reference is not among the solvers, their costs are not equally many, or one is NaN.

    Examples
    --------
    >>> (one,) = against({"a": [1, 2, 3, 4, 5, 6], "b": [2, 4, 6, 8, 10, 12]}, "b")
    >>> one.wins, round(one.ratio.median, 6), one.p_holm
    (6, 0.5, 0.03125)
    """
    table = cost_table(costs)
    if reference not in table:
        msg = f"the reference {reference!r} is not among the solvers {list(table)}"
        raise ValueError(msg)
    if not table[reference].size:
        return []
    others = [solver for solver in table if solver != reference]
    found = [compare_costs(solver, costs[solver], reference, costs[reference]) for solver in others]
    rest = [signed_rank(log_ratios(table[a], table[b]).tolist()).p for a, b in combinations(others, 2)]
    p_holm = holm([*(one.p for one in found), *rest])
    return [replace(one, p_holm=p) for one, p in zip(found, p_holm, strict=False)]


def compare_costs(solver: str, costs: Sequence[float], reference: str, others: Sequence[float]) -> Paired:
    """
    Compare one solver with another.

    Parameters
    ----------
    solver, costs
        Label, and one cost (or time) an instance; infinite without a path.
    reference, others
        Those of the solver to compare with, on the same instances.

    Returns
    -------
    comparison
        Its p-value is not adjusted.

    Raises
    ------
    ValueError
        If there is no cost, they are not equally many, or one is NaN or minus infinity.

    Examples
    --------
    >>> one = compare_costs("new", [1.0, 2.0, 3.0, 2.0, 3.0], "old", [1.0, 4.0, 6.0, 4.0, math.inf])
    >>> one.wins, one.ties, one.only_solver, one.ratio
    (4, 1, 1, Estimate(median=0.5, low=0.0, high=inf))
    """
    first, second = cost_row(solver, costs), cost_row(reference, others)
    if len(first) != len(second) or not len(first):
        msg = f"{solver!r} has {len(first)} costs and {reference!r} has {len(second)}; give each one for each instance"
        raise ValueError(msg)
    logs = log_ratios(first, second)
    with np.errstate(over="ignore"):
        ratio = Estimate(*(float(np.exp(end)) for end in hodges_lehmann(logs.tolist())))
    test = signed_rank(logs.tolist())
    paths, other_paths = np.isfinite(first), np.isfinite(second)
    only_solver, only_reference = int((paths & ~other_paths).sum()), int((~paths & other_paths).sum())
    return Paired(
        solver=solver,
        reference=reference,
        n=len(logs),
        wins=int((logs < 0.0).sum()),
        losses=int((logs > 0.0).sum()),
        ties=int((logs == 0.0).sum()),
        ratio=ratio,
        effect=test.effect,
        p=test.p,
        p_holm=test.p,
        only_solver=only_solver,
        only_reference=only_reference,
        p_success=mcnemar(only_solver, only_reference),
    )
