"""A proof on one grid: `cgla_graph.lower_bound` before it refines, with the tube that its first grid leaves."""

import math
from typing import NamedTuple

from cgla_graph._types import WholeArray
from cgla_graph.certificate.certificate import LEAST_SHRINK, rounding
from cgla_graph.certificate.subsolution import Level, first_grid
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.problem import Problem

#: Gains below this part of the bound are not worth another round.
AIM = 4e-3


class OneGrid(NamedTuple):
    """
    What one grid proves.

    Attributes
    ----------
    lower_bound
        No path costs less, map units; infinite where there is no path, NaN where there is no bound.
    last, runs
        Column and row of the grid's last node, and the cells that a better path may pass, as `cgla_graph.Certificate`
        has them; None where that is not known.
    """

    lower_bound: float
    last: tuple[int, int] | None = None
    runs: WholeArray | None = None


def prove(problem: Problem, cost: float) -> OneGrid:
    """
    Bound the cost of every path on the first grid of a proof.

    Parameters
    ----------
    problem
        The problem.
    cost
        Of a feasible path; infinite if none is known.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0.1, 0.1), (0.9, 0.9), RiskField([Threat(0.5, 0.5, 0.1)]), k=10.0)
    >>> 1.34 < prove(problem, 1.3516).lower_bound <= 1.3516
    True
    """
    if not problem.field.is_proper:
        return OneGrid(math.nan)
    straight = math.dist(problem.start, problem.goal) * (1.0 - 2.0**-50)
    shrink = 1.0 - rounding(problem)
    if straight >= cost or shrink < LEAST_SHRINK:
        return OneGrid(min(straight, cost))
    last = first_grid(problem)
    # a path that keeps its clearance to the last digit counts, too
    level = Level.lay(problem.relaxed(), last, cell_runs.rectangle(last))
    bounds = level.both(AIM, charge=True)
    if bounds is None:
        # no way leads through: there is none, or none better than the known one
        return OneGrid(cost)
    here = max(one.bound for one in bounds)
    runs = level.kept(bounds[0], bounds[1], cost / shrink) if math.isfinite(cost) else None
    # that of a path that is known to exist is never beaten
    return OneGrid(max(straight, min(here * shrink, cost)), last, runs)
