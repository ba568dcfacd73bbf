"""Ranks of several solvers over many instances, Friedman's test, and the picture of ranks and who is told apart."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

import numpy as np
from scipy import stats

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.statistics.cost_table import cost_table, same_cost
from cgla_graph.comparisons.statistics.told_apart import fewest_instances, told_apart


@dataclass(frozen=True)
class Ranking:
    """
    Average ranks of solvers, best first (see `ranking`).

    Attributes
    ----------
    solvers, average_ranks
        Labels, and the mean of each one's rank over the instances: 1 is best.
    n_instances
        How many instances there were.
    statistic, p
        Friedman's chi-square, corrected for ties, and the p-value that no solver tends to rank before another.
        None with fewer than two solvers or instances.
    fewest_instances
        Below this many instances no two of so many solvers can ever be told apart; None with fewer than two solvers.
    groups
        The greatest sets of two or more solvers next to each other, best first, within which no two are told apart
        (see `told_apart`). None as above.
    apart_in_rank
        The other pairs that are not told apart, as a solver between them differs from one of them.
    """

    solvers: tuple[str, ...]
    average_ranks: tuple[float, ...]
    n_instances: int
    statistic: float | None
    p: float | None
    fewest_instances: int | None
    groups: tuple[tuple[str, ...], ...]
    apart_in_rank: tuple[tuple[str, str], ...]


def ranking(costs: Mapping[str, Sequence[float]]) -> Ranking:
    """
    Rank solvers on every instance, and say which of them are told apart.

    Equal costs (up to rounding, failures among themselves) share their mean rank. Friedman's test asks whether the
    ranks could be drawn by lot on every instance; its p-value is that of chi-square with ``k - 1`` degrees of freedom,
    an approximation that is fair from about ten instances on (Demsar, JMLR 7, 2006, section 3.2.2). Which solvers
    differ is said by paired tests (see `told_apart`). Both assume that instances are independent of each other; so give
    one cost an instance, not one a seed. A rank tells who is better but not by how much, and it depends on who else
    takes part.

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
    >>> found.fewest_instances
    7
    """
    table = cost_table(costs)
    k, n = len(table), len(next(iter(table.values()), ()))
    ranks = instance_ranks(np.array(list(table.values())).reshape(k, n))
    averages = ranks.mean(axis=1) if n else np.full(k, math.nan)
    order = np.argsort(averages, kind="stable")
    solvers = tuple(np.array(list(table), dtype=object)[order].tolist())
    ordered = tuple(averages[order].tolist())
    fewest = fewest_instances(k) if k > 1 else None
    if k < 2 or n < 2:  # noqa: PLR2004 - one has nothing to differ from
        return Ranking(solvers, ordered, n, None, None, fewest, (), ())
    statistic = _friedman(ranks)
    apart = told_apart(costs)
    groups = _groups(solvers, apart)
    joined = {frozenset(pair) for group in groups for pair in combinations(group, 2)}
    return Ranking(
        solvers=solvers,
        average_ranks=ordered,
        n_instances=n,
        statistic=statistic,
        p=float(stats.chi2.sf(statistic, k - 1)),
        fewest_instances=fewest,
        groups=groups,
        apart_in_rank=tuple(pair for pair in combinations(solvers, 2) if frozenset(pair) not in apart | joined),
    )


def instance_ranks(costs: FloatArray) -> FloatArray:
    """
    Rank the solvers on every instance.

    Parameters
    ----------
    costs
        Shape ``(k, n)``: of `k` solvers on `n` instances.

    Returns
    -------
    ranks
        Of the same shape, from 1; equal costs, up to rounding, share their mean rank.

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
    return np.asarray(stats.rankdata(levels, axis=0), dtype=np.float64) if costs.size else levels


def _friedman(ranks: FloatArray) -> float:
    """Return Friedman's chi-square, corrected for ties; 0 where all is tied."""
    # scipy has it for three solvers or more only, and NaN where all is tied
    k, n = ranks.shape
    middle = (k + 1) / 2.0
    spread = float(((ranks - middle) ** 2).sum())
    between = n * float(((ranks.mean(axis=1) - middle) ** 2).sum())
    return (k - 1) * n * between / spread if spread > 0.0 else 0.0


def _groups(solvers: Sequence[str], apart: frozenset[frozenset[str]]) -> tuple[tuple[str, ...], ...]:
    """List the greatest runs of solvers, two or more, of which no two are told apart."""
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


@dataclass(frozen=True)
class Label:
    """
    Where the picture of ranks names a solver.

    Attributes
    ----------
    solver, rank
        What it says, and the place on the axis that it belongs to.
    left
        Whether it stands on the left side: the better half does, the best on top.
    row
        Its line below the axis, from 0.
    """

    solver: str
    rank: float
    left: bool
    row: int


@dataclass(frozen=True)
class Bar:
    """
    A bar that joins solvers that are not told apart.

    Attributes
    ----------
    low, high
        Average ranks of its best and worst solver.
    row
        Its line, from 0 next to the axis; bars of one line do not touch.
    """

    low: float
    high: float
    row: int


@dataclass(frozen=True)
class RankDiagram:
    """
    The picture of ranks in plain numbers, in units of ranks across and of lines down.

    Attributes
    ----------
    ticks
        Whole ranks of the axis, 1 to the number of solvers.
    labels, bars
        What is drawn below the axis.
    """

    ticks: tuple[int, ...]
    labels: tuple[Label, ...]
    bars: tuple[Bar, ...]


def rank_diagram(found: Ranking) -> RankDiagram:
    """
    Lay out the picture of ranks, the best on the left; bars join those not told apart (Demsar, JMLR 7, 2006, fig. 1).

    Parameters
    ----------
    found
        The ranking, of at least one instance.

    Returns
    -------
    diagram
        Labels in the order of ranks.

    Raises
    ------
    ValueError
        If there are no instances, so that ranks are unknown.

    Examples
    --------
    >>> diagram = rank_diagram(ranking({"a": [1, 1, 1], "b": [2, 2, 2], "c": [3, 3, 3]}))
    >>> [(label.solver, label.left, label.row) for label in diagram.labels]
    [('a', True, 0), ('b', True, 1), ('c', False, 0)]
    >>> diagram.bars
    (Bar(low=1.0, high=3.0, row=0),)
    """
    if not found.n_instances:
        msg = "there are no instances, so no ranks to draw; rank at least one"
        raise ValueError(msg)
    k = len(found.solvers)
    half = (k + 1) // 2
    places = zip(found.solvers, found.average_ranks, strict=True)
    labels = [
        Label(solver, rank, left=place < half, row=place if place < half else k - 1 - place)
        for place, (solver, rank) in enumerate(places)
    ]
    rank_of = dict(zip(found.solvers, found.average_ranks, strict=True))
    bars: list[Bar] = []
    ends: list[float] = []
    for group in found.groups:
        low, high = rank_of[group[0]], rank_of[group[-1]]
        row = next((row for row, end in enumerate(ends) if end < low), len(ends))
        ends[row : row + 1] = [high]
        bars.append(Bar(low, high, row))
    return RankDiagram(tuple(range(1, k + 1)), tuple(labels), tuple(bars))
