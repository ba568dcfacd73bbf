"""The answer to a problem with uncertain risk: a path, its costs in all scenarios, and what other samples say of it."""

import math
from dataclasses import dataclass, field
from typing import Any, Literal, TypeAlias

import numpy as np

from cgla_graph._text import json_number
from cgla_graph._types import FloatArray
from cgla_graph._validate import finite_number, whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import GraphProblem
from cgla_graph.model.solution import Solution
from cgla_graph.model.uncertain.field import FieldSampler
from cgla_graph.model.uncertain.tail_mean import TailMean

#: What a path is planned for.
Objective: TypeAlias = Literal["expected", "cvar", "worst"]
#: Samples that a path is judged by, and resamples of them for an interval.
HELD_OUT, RESAMPLES = 1000, 2000
#: Intervals are at 95 %.
TAIL = 0.025
#: Costs that differ by less than this, relatively, count as the same.
SAME = 1e-12


@dataclass(frozen=True, eq=False)
class HeldOut:
    """
    The costs of a path in scenarios that it was not planned on.

    Attributes
    ----------
    costs
        In independent samples, shape ``(n,)``, ascending, map units.
    alpha
        Of the mean of the worst costs.
    seed
        Of the resamples.
    """

    costs: FloatArray
    alpha: float
    seed: int = 0

    @property
    def cvar(self) -> float:
        """The mean of the worst costs of the samples."""
        return float(self._means(np.ones((1, len(self.costs))))[0])

    @property
    def interval(self) -> tuple[float, float]:
        """
        Interval of this mean at about 95 %: percentiles of bootstrap resamples.

        It is approximate, and too short where fewer than ten samples make up the tail. For the worst case, no sample
        bounds what may come: the interval has no end.
        """
        if self.alpha == 1.0:
            return float(self.costs[-1]), math.inf
        rng, n = np.random.default_rng(self.seed), len(self.costs)
        means = self._means(rng.multinomial(n, np.full(n, 1.0 / n), size=RESAMPLES).astype(np.float64))
        low, high = np.quantile(means, [TAIL, 1.0 - TAIL])
        return float(low), float(high)

    def chance_above(self, budget: float) -> tuple[float, float, float]:
        """
        Estimate the probability that the path costs more than a budget, map units.

        Returns
        -------
        chance, low, high
            The share of samples, and the exact interval of Clopper and Pearson at 95 %.
        """
        limit, n = finite_number("budget", budget), len(self.costs)
        from scipy.special import betaincinv  # noqa: PLC0415 - not needed to plan

        above = int((self.costs > limit * (1.0 + SAME)).sum())
        low = float(betaincinv(above, n - above + 1, TAIL)) if above else 0.0
        high = float(betaincinv(above + 1, n - above, 1.0 - TAIL)) if above < n else 1.0
        return above / n, low, high

    def _means(self, counts: FloatArray) -> FloatArray:
        """Return the mean of the worst costs of resamples, with so many of each cost, shape ``(b, n)``."""
        room = (1.0 - self.alpha) * len(self.costs)
        if room == 0.0:
            return np.asarray(np.where(counts > 0.0, self.costs, -np.inf).max(axis=1))
        worst = np.cumsum(counts[:, ::-1], axis=1)
        taken = np.diff(np.minimum(worst, room), axis=1, prepend=0.0)
        return np.asarray(taken @ self.costs[::-1] / room)


@dataclass(frozen=True, eq=False)
class UncertainSolution(Solution):
    """
    A path that was planned for an objective over scenarios, and the proven bound of that objective.

    It is a `Solution` whose `cost` is the objective: the expected cost, the mean of the worst costs (CVaR), or the
    worst cost; `risk` is the mean risk under the weights of scenarios that give it, and `lower_bound` bounds the
    objective of every path.

    Attributes
    ----------
    objective, alpha
        ``expected`` is CVaR with alpha 0, ``worst`` with alpha 1.
    probabilities
        Of the scenarios.
    costs
        Of the path in each scenario, shape ``(n,)``, map units.
    weights
        Of the scenarios in the best proof of a weighted sum, shape ``(n,)``: no path has a lower sum of weighted costs
        than that proof says, and so no lower objective.
    weighted_bound
        That proof, map units.
    least_weighted
        The greatest, over all weights, of the least weighted cost of a path that was found: no weighted sum can prove
        more. What the objective of the best path is above that is the duality gap.
    sampler
        How the scenarios were drawn; None for given ones.
    """

    objective: Objective = field(default="expected", kw_only=True)
    alpha: float = field(default=0.0, kw_only=True)
    probabilities: tuple[float, ...] = field(default=(), kw_only=True)
    costs: FloatArray = field(default_factory=lambda: np.empty(0), kw_only=True)
    weights: FloatArray = field(default_factory=lambda: np.empty(0), kw_only=True)
    weighted_bound: float = field(default=math.nan, kw_only=True)
    least_weighted: float = field(default=math.nan, kw_only=True)
    sampler: FieldSampler | None = field(default=None, kw_only=True, repr=False)

    @property
    def expected_cost(self) -> float:
        """The mean of the costs by their probabilities, map units."""
        return self.cvar(0.0)

    @property
    def worst_cost(self) -> float:
        """The greatest cost in a scenario whose probability is not 0, map units."""
        return self.cvar(1.0)

    def cvar(self, alpha: float) -> float:
        """Return the mean of the costs in the worst ``1 - alpha`` of all cases, map units; infinite without a path."""
        if not len(self.costs):
            return math.inf
        return TailMean(self.probabilities, alpha).of(self.costs)

    def chance_above(self, budget: float) -> float:
        """Return the probability of the scenarios in which the path costs more than a budget, map units."""
        limit = finite_number("budget", budget)
        if not len(self.costs):
            return 1.0
        chances = np.array(self.probabilities)
        return float(chances[self.costs > limit * (1.0 + SAME)].sum() / chances.sum())

    @property
    def duality_gap(self) -> float:
        """
        The part of the objective that no proof by weighted sums can close, ``cost / least_weighted - 1``.

        It is an estimate from the paths found. What the cut through places closes of it, `lower_bound` has.
        """
        if not self.status.has_path or not self.least_weighted > 0.0:
            return math.nan if self.cost != 0.0 else 0.0
        gap = self.cost / self.least_weighted - 1.0
        # (costs of scenarios are rounded, each in its own way; the expected cost is a weighted sum itself)
        return gap if gap > SAME and self.alpha > 0.0 else 0.0

    def held_out(self, count: int = HELD_OUT) -> HeldOut:
        """
        Judge the path by samples that it was not planned on: the same samples each time.

        Parameters
        ----------
        count
            Samples, at least 1.

        Raises
        ------
        ProblemError
            If the scenarios were given, not drawn, or there is no path or no problem at hand.
        """
        whole_number("count", count, at_least=1, at_most=1_000_000)
        if self.sampler is None or not len(self.costs):
            msg = "there are no other samples of given scenarios; draw them by sample_field, and find a path"
            raise ProblemError(msg)
        if self.problem is None:
            msg = "the answer was stored, and its problem is not at hand; solve the problem again"
            raise ProblemError(msg)
        # (that of a graph is on the graph)
        model: Any = (self.problem.graph if isinstance(self.problem, GraphProblem) else self.problem).model
        starts, ends = self.path[:-1], self.path[1:]
        drawn = (one.for_weight(model.k) for one in self.sampler.draw(int(count)))
        costs = self.length + model.k * np.array([float(one.line_integral(starts, ends).sum()) for one in drawn])
        return HeldOut(np.sort(costs), self.alpha, self.sampler.seed)

    def outlook(self, budget: float | None = None) -> dict[str, Any]:
        """
        Return the numbers of the path over all scenarios as JSON.

        Parameters
        ----------
        budget
            Cost, map units, to tell the chance of exceeding it; None: not told.
        """
        told: dict[str, Any] = {
            "objective": self.objective,
            "alpha": self.alpha,
            "cost": json_number(self.cost),
            "expected_cost": json_number(self.expected_cost),
            "worst_cost": json_number(self.worst_cost),
            "scenario_costs": self.costs.tolist(),
            "probabilities": list(self.probabilities),
            "lower_bound": json_number(self.lower_bound),
            "weighted_bound": json_number(self.weighted_bound),
            "duality_gap": json_number(self.duality_gap),
        }
        if budget is not None:
            told |= {"budget": budget, "chance_above": self.chance_above(budget)}
        if self.sampler is not None and len(self.costs):
            held = self.held_out()
            low, high = held.interval
            told["held_out"] = {
                "samples": len(held.costs), "cost": held.cvar, "interval": [low, json_number(high)],
            }  # fmt: skip
            if budget is not None:
                told["held_out"]["chance_above"] = list(held.chance_above(budget))
        return told
