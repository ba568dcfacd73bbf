"""Whom paired tests tell apart, all pairs of solvers at once, and how many instances it takes before they can."""

import math
from collections.abc import Mapping, Sequence
from itertools import combinations

from cgla_graph.comparisons.numbers import counted, p_value
from cgla_graph.comparisons.statistics.cost_table import cost_table, log_ratios
from cgla_graph.comparisons.statistics.intervals import CONFIDENCE
from cgla_graph.comparisons.statistics.paired import holm, signed_rank

#: An adjusted p-value below this is a difference beyond chance.
LEVEL = 1.0 - CONFIDENCE


def told_apart(costs: Mapping[str, Sequence[float]]) -> frozenset[frozenset[str]]:
    """
    List the pairs of solvers whose costs differ beyond chance.

    By Wilcoxon's signed ranks, adjusted after Holm to all pairs: that any of them is wrong has a probability of 5 % at
    most. Unlike differences of mean ranks, a pair's verdict does not hang on how the other solvers do (Benavoli,
    Corani, Mangili, JMLR 17(5), 2016); and it is the very test whose p-values the tables show (see `against`).

    Parameters
    ----------
    costs
        One cost an instance for each solver, the instances in the same order; infinite without a path.

    Returns
    -------
    pairs
        None below `fewest_instances`.

    Raises
    ------
    ValueError
        If the costs are not equally many, or one is NaN.

    Examples
    --------
    >>> told_apart({"a": [1, 2, 3, 4, 5, 6], "b": [2, 4, 6, 8, 10, 12]}) == {frozenset("ab")}
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
    Return the least adjusted p-value that there can be, of a solver that is cheaper than another on every instance.

    Each of the differences has the sign of the others by chance with probability 1/2, and Holm multiplies the least
    p-value by the number of pairs.

    Parameters
    ----------
    n_instances, n_solvers
        At least 1, and at least 2.

    Examples
    --------
    >>> least_p(6, 2), least_p(6, 5), least_p(9, 5)
    (0.03125, 0.3125, 0.0390625)
    """
    return min(1.0, math.comb(n_solvers, 2) * 2.0 ** (1 - n_instances))


def fewest_instances(n_solvers: int) -> int:
    """
    Return the number of instances below which no two of so many solvers can be told apart, whatever happens on them.

    Parameters
    ----------
    n_solvers
        At least 2.

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
    Say how many scenarios it takes to tell solvers apart; empty where there are as many.

    Parameters
    ----------
    n_scenarios, n_solvers
        How many there are.

    Examples
    --------
    >>> too_few_note(6, 5)
    '6 scenarios cannot tell 5 solvers apart: after Holm for 10 pairs no p is below 0.31; it takes 9 scenarios or more'
    >>> too_few_note(9, 5), too_few_note(1, 1)
    ('', '')
    """
    if n_solvers < 2 or not 0 < n_scenarios < fewest_instances(n_solvers):  # noqa: PLR2004 - one differs from none
        return ""
    pairs = counted(math.comb(n_solvers, 2), "pair")
    least = f"after Holm for {pairs} no p is below {p_value(least_p(n_scenarios, n_solvers))}"
    here = f"{counted(n_scenarios, 'scenario')} cannot tell {n_solvers} solvers apart"
    return f"{here}: {least}; it takes {fewest_instances(n_solvers)} scenarios or more"
