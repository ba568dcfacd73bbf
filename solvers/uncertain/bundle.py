"""Paths found under several weights of the scenarios, and the weights that they suggest next."""

import math
from typing import Any

import numpy as np
from scipy.optimize import linprog

from cgla_graph._types import FloatArray
from cgla_graph.model.problem import Problem
from cgla_graph.model.uncertain.field import UncertainField
from cgla_graph.model.uncertain.tail_mean import TailMean


class Bundle:
    """
    Paths with their costs in all scenarios.

    Of ``max over q of min over paths of q . cost``, the paths at hand give an upper bound of the inner minimum, as the
    best path under ``q`` may not be among them: a linear program has its optimum (Kelley, J. SIAM 8(4), 1960). Its dual
    variables are shares of paths that no weights tell apart.

    Parameters
    ----------
    problem
        With an `UncertainField`.
    tail
        The objective.
    """

    def __init__(self, problem: Problem, field: UncertainField, tail: TailMean) -> None:
        self.problem, self.field, self.tail = problem, field, tail
        self.paths: list[FloatArray] = []
        self.costs: list[FloatArray] = []
        self.values: list[float] = []

    def add(self, path: FloatArray) -> int:
        """Add a feasible path, and return its number."""
        costs = self.field.costs(self.problem, path)
        self.paths.append(path)
        self.costs.append(costs)
        self.values.append(self.tail.of(costs))
        return len(self.paths) - 1

    @property
    def best(self) -> int:
        """The number of the path of the least objective."""
        return int(np.argmin(self.values)) if self.values else -1

    @property
    def upper(self) -> float:
        """The least objective of a path; infinite without one."""
        return min(self.values, default=math.inf)

    def cheapest(self, weights: FloatArray) -> int:
        """Return the number of the path of the least weighted cost."""
        return int(np.argmin(np.array(self.costs) @ weights))

    def level(
        self, centre: FloatArray, share: float, known: float, members: list[int] | None = None
    ) -> tuple[float, FloatArray, FloatArray]:
        """
        Return the greatest least weighted cost, weights near the last ones that promise a share of it, and shares.

        Parameters
        ----------
        centre
            The best weights so far, shape ``(n,)``.
        share
            From 0 (stay) to 1 (take the optimum of the linear program): how much of the promised gain to ask for. The
            nearest such weights vary less from step to step than the optimum does (Lemarechal, Nemirovskii, Nesterov,
            Math. Program. 69, 1995; here with the sum of absolute differences).
        known
            The least weighted cost under these, map units.
        members
            The paths that count; None: all.

        Returns
        -------
        promised, weights, shares
            Map units; shape ``(n,)``; shape ``(paths,)``.
        """
        costs = np.array(self.costs if members is None else [self.costs[i] for i in members])
        return level_of(costs, self.tail, centre, share, known)


def level_of(
    costs: FloatArray, tail: TailMean, centre: FloatArray, share: float, known: float
) -> tuple[float, FloatArray, FloatArray]:
    """
    Improve weights against paths with known costs, shape ``(paths, n)``; see `Bundle.level`.

    Examples
    --------
    >>> two = np.array([[10.0, 1.0], [1.0, 10.0]])
    >>> promised, weights, shares = level_of(two, TailMean((0.5, 0.5), 1.0), np.array([1.0, 0.0]), 1.0, 1.0)
    >>> promised, weights.round(9).tolist(), shares.round(9).tolist()
    (5.5, [0.5, 0.5], [0.5, 0.5])
    """
    most = [float(cap) for cap in tail.caps]
    scale = float(np.abs(costs).max()) or 1.0
    rows = costs / scale
    count, n = rows.shape
    # variables: q, t
    answer: Any = linprog(
        np.append(np.zeros(n), -1.0),
        A_ub=np.column_stack([-rows, np.ones(count)]),
        b_ub=np.zeros(count),
        A_eq=np.append(np.ones(n), 0.0)[None],
        b_eq=[1.0],
        bounds=[*((0.0, cap) for cap in most), (None, None)],
    )
    if answer.status != 0:
        return known, centre, np.full(count, 1.0 / count)
    promised, best = -float(answer.fun) * scale, np.asarray(answer.x[:n])
    shares = np.maximum(-np.asarray(answer.ineqlin.marginals), 0.0)
    shares = shares / (shares.sum() or 1.0)
    if share >= 1.0 or promised <= known:
        return promised, tail.inside(best), shares
    wanted = (known + share * (promised - known)) / scale
    # variables: q, and its absolute difference from the centre
    eye = np.eye(n)
    near: Any = linprog(
        np.append(np.zeros(n), np.ones(n)),
        A_ub=np.block([[-rows, np.zeros((count, n))], [eye, -eye], [-eye, -eye]]),
        b_ub=np.concatenate([np.full(count, -wanted), centre, -centre]),
        A_eq=np.append(np.ones(n), np.zeros(n))[None],
        b_eq=[1.0],
        bounds=[*((0.0, cap) for cap in most), *((0.0, None) for _ in range(n))],
    )
    found = np.asarray(near.x[:n]) if near.status == 0 else best
    return promised, tail.inside(found), shares
