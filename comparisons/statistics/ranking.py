"""Ranks of several solvers over many instances, Friedman's test, and significant differences."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np

from cgla_graph._text import counted
from cgla_graph._types import FloatArray
from cgla_graph.comparisons.numbers import p_value
from cgla_graph.comparisons.statistics.distributions import average_ranks, chi_square_tail
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE
from cgla_graph.comparisons.statistics.paired import cost_table, holm, log_ratios, same_cost, signed_rank

#: An adjusted p-value below this is a difference beyond chance.
LEVEL = 1.0 - CONFIDENCE


@dataclass(frozen=True)
class Ranking:
    """
    Average ranks of solvers, best first (see `ranking`).

    Attributes
    ----------
    solvers, average_ranks
        Labels, and the mean of each one's rank over the instances: 1 is best.
    n_instances
        Number of instances.
    p
        Of Friedman's test, corrected for ties, that no solver tends to rank before another. None with fewer than two
        solvers or instances.
    groups
        The greatest sets of two or more solvers next to each other, best first, of which no two differ significantly
        (see `significantly_different`). None as above.
    apart_in_rank
        Pairs in no group without a significant difference, since a solver between them differs from one of them.
    """

    solvers: tuple[str, ...]
    average_ranks: tuple[float, ...]
    n_instances: int
    p: float | None
    groups: tuple[tuple[str, ...], ...]
    apart_in_rank: tuple[tuple[str, str], ...]


def ranking(costs: Mapping[str, Sequence[float]]) -> Ranking:
    """
    Rank solvers on every instance, and say which of them differ significantly.

    Equal costs (up to rounding, failures among themselves) share their mean rank. Friedman's test asks whether the
    ranks could be random on every instance; its p-value is that of chi-square with ``k - 1`` degrees of freedom,
    an approximation that is fair from about ten instances on (Demsar, JMLR 7, 2006, section 3.2.2). Paired tests
    find which solvers differ (see `significantly_different`). Both assume independent instances; so give one cost an
    instance, not one a seed. A rank shows which solver is better but not by how much, and it depends on the other
    solvers.

    Parameters
    ----------
    costs
        One cost an instance for each solver, the instances in the same order; infinite without a path.

    Returns
    -------
    ranking
        Solvers of equal average rank stay in the order of `costs`. Without instances, ranks are NaN.

    Raises
    ------
    ValueError
        If the costs are not equally many, or one is NaN.

    Examples
    --------
    >>> found = ranking({"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, math.inf]})
    >>> found.solvers, found.average_ranks, round(found.p, 4), found.groups
    (('a', 'b', 'c'), (1.0, 2.0, 3.0), 0.0498, (('a', 'b', 'c'),))
    """
    table = cost_table(costs)
    k, n = len(table), len(next(iter(table.values()), ()))
    ranks = instance_ranks(np.array(list(table.values())).reshape(k, n))
    averages = ranks.mean(axis=1) if n else np.full(k, math.nan)
    order = np.argsort(averages, kind="stable")
    solvers = tuple(np.array(list(table), dtype=object)[order].tolist())
    ordered = tuple(averages[order].tolist())
    if k < 2 or n < 2:  # noqa: PLR2004 - one alone cannot differ
        return Ranking(solvers, ordered, n, None, (), ())
    apart = significantly_different(costs)
    groups = _groups(solvers, apart)
    joined = {frozenset(pair) for group in groups for pair in combinations(group, 2)}
    return Ranking(
        solvers=solvers,
        average_ranks=ordered,
        n_instances=n,
        p=chi_square_tail(_friedman(ranks), k - 1),
        groups=groups,
        apart_in_rank=tuple(pair for pair in combinations(solvers, 2) if frozenset(pair) not in apart | joined),
    )


def instance_ranks(costs: FloatArray) -> FloatArray:
    """
    Rank `k` solvers on each of `n` instances, shape ``(k, n)``, from 1; equal costs, up to rounding, share their mean.

    Examples
    --------
    >>> instance_ranks(np.array([[1.0, np.inf], [1.0 + 1e-12, 3.0], [2.0, np.inf]]))
    array([[1.5, 2.5],
           [1.5, 1. ],
           [3. , 2.5]])
    """
    order = np.argsort(costs, axis=0, kind="stable")
    ordered = np.take_along_axis(costs, order, axis=0)
    # from each cost to the next greater one: a step, unless they are equal
    places = np.zeros(costs.shape)
    places[1:] = np.cumsum(~same_cost(ordered[1:], ordered[:-1]), axis=0)
    levels = np.empty(costs.shape)
    np.put_along_axis(levels, order, places, axis=0)
    return average_ranks(levels)


def _friedman(ranks: FloatArray) -> float:
    """Return Friedman's chi-square, corrected for ties; 0 if all costs are tied."""
    # scipy needs three solvers, and returns NaN if all costs are tied
    k, n = ranks.shape
    middle = (k + 1) / 2.0
    spread = float(((ranks - middle) ** 2).sum())
    between = n * float(((ranks.mean(axis=1) - middle) ** 2).sum())
    return (k - 1) * n * between / spread if spread > 0.0 else 0.0


def _groups(solvers: Sequence[str], apart: frozenset[frozenset[str]]) -> tuple[tuple[str, ...], ...]:
    """List the greatest runs of solvers, two or more, of which no two differ significantly."""
    groups = []
    reached = 0
    for first in range(len(solvers)):
        end = first + 1
        while end < len(solvers) and not any({one, solvers[end]} in apart for one in solvers[first:end]):
            end += 1
        if end > reached and end - first > 1:
            groups.append(tuple(solvers[first:end]))
        reached = max(reached, end)
    return tuple(groups)


def significantly_different(costs: Mapping[str, Sequence[float]]) -> frozenset[frozenset[str]]:
    """
    List the pairs of solvers whose costs differ beyond chance.

    The test is Wilcoxon's signed ranks, adjusted after Holm to all pairs: the probability that any pair is wrong is at
    most 5 %. Unlike with differences of mean ranks, a pair's verdict does not depend on the other solvers (Benavoli,
    Corani, Mangili, JMLR 17(5), 2016). The tables show the p-values of the same test (see `against`).

    Parameters
    ----------
    costs
        One cost an instance for each solver, the instances in the same order; infinite without a path.

    Returns
    -------
    pairs
        Empty below `fewest_instances`.

    Raises
    ------
    ValueError
        If the costs are not equally many, or one is NaN.

    Examples
    --------
    >>> significantly_different({"a": [1, 2, 3, 4, 5, 6], "b": [2, 4, 6, 8, 10, 12]}) == {frozenset("ab")}
    True
    """
    table = cost_table(costs)
    pairs = list(combinations(table, 2))
    if not pairs or not len(table[pairs[0][0]]):
        return frozenset()
    p_values = holm([signed_rank(log_ratios(table[a], table[b]).tolist()).p for a, b in pairs])
    return frozenset(frozenset(pair) for pair, p in zip(pairs, p_values, strict=True) if p < LEVEL)


def least_p(n_instances: int, n_solvers: int) -> float:
    """
    Return the least possible adjusted p-value: that of a solver cheaper than another on every instance.

    Each difference has either sign with probability 1/2, and Holm multiplies the least p-value by the number of pairs.

    Examples
    --------
    >>> least_p(6, 2), least_p(6, 5), least_p(9, 5)
    (0.03125, 0.3125, 0.0390625)
    """
    return min(1.0, math.comb(n_solvers, 2) * 2.0 ** (1 - n_instances))


def fewest_instances(n_solvers: int) -> int:
    """
    Return the least number of instances on which two of so many solvers can differ significantly.

    Examples
    --------
    >>> [fewest_instances(n_solvers) for n_solvers in (2, 5, 30)]
    [6, 9, 15]
    """
    n_instances = 1
    while least_p(n_instances, n_solvers) >= LEVEL:
        n_instances += 1
    return n_instances


def too_few_note(n_scenarios: int, n_solvers: int) -> str:
    """
    Return a note on how many scenarios it takes to tell solvers apart; empty if there are enough.

    Examples
    --------
    >>> too_few_note(6, 5)
    '6 scenarios cannot tell 5 solvers apart: after Holm for 10 pairs no p is below 0.31; it takes 9 scenarios or more'
    >>> too_few_note(9, 5), too_few_note(1, 1)
    ('', '')
    """
    if n_solvers < 2 or not 0 < n_scenarios < fewest_instances(n_solvers):  # noqa: PLR2004 - one alone cannot differ
        return ""
    pairs = counted(math.comb(n_solvers, 2), "pair")
    least = f"after Holm for {pairs} no p is below {p_value(least_p(n_scenarios, n_solvers))}"
    here = f"{counted(n_scenarios, 'scenario')} cannot tell {n_solvers} solvers apart"
    return f"{here}: {least}; it takes {fewest_instances(n_solvers)} scenarios or more"
