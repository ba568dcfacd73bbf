"""
Test whether a coarse grid shows one way only, so that `hybrid` need not look for others.

The costs-to-go to the goal and to the start add up to the cost of the best way through each node. The nodes where that
is little more than the least cost form a band around the best way. Another way around some threat, about as cheap, lies
in the band as well, which then has a hole where the threat is. So a band without holes holds one way, but for bends. A
wide band may fill a hole that a narrow one has: several are tested.

The best way itself shows whether the grid is fine enough for that: by how far its cost is from the grid's.
"""

import numpy as np

from cgla_graph._types import BoolArray
from cgla_graph.eikonal.marching import costs_to_go
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.continuous.fast_marching import NEAR, Marched

#: How much more ways through the bands cost at most, relative to the best one, and how wrong the grid may be about it.
BANDS, MOST_WRONG = (0.01, 0.02, 0.04), 0.004


def holds_one_way(problem: Problem, found: Marched, cost: float) -> bool:
    """
    Tell whether all ways that cost little more than the best one pass all threats on the same sides.

    Parameters
    ----------
    problem
        One without no-fly areas and rasters.
    found
        The costs-to-go of a coarse grid.
    cost
        Of the way down these costs-to-go, refined.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> from cgla_graph.solvers.continuous.fast_marching import marched
    >>> from cgla_graph.refine.refine import refine_path
    >>> def one_way(y):
    ...     problem = Problem((0.1, 0.5), (0.9, 0.5), RiskField([Threat(0.5, y, 0.1)]), k=10.0)
    ...     found = marched(problem, (64, 64))
    ...     return holds_one_way(problem, found, refine_path(problem, found.path).cost)
    >>> one_way(0.5), one_way(0.4)
    (False, True)
    """
    mesh = found.mesh
    to_start = costs_to_go(problem, mesh, problem.start, mesh.ends[0], found.costs, radius=NEAR * max(mesh.spacing))
    through = np.full((mesh.last[1] + 1, mesh.last[0] + 1), np.inf)
    inside = ~mesh.outside
    through[mesh.node_rows[inside], mesh.node_columns[inside]] = (found.times + to_start)[:-1][inside]
    best = float(through.min())
    if not abs(cost - best) <= MOST_WRONG * best:
        return False
    return all(_euler(through <= (1.0 + more) * best) == 1 for more in BANDS)


def _euler(cells: BoolArray) -> int:
    """
    Return the Euler characteristic of a set of square cells: how many parts it has, less its holes.

    Cells that meet at a corner are of one part.

    Examples
    --------
    >>> ring = np.ones((3, 3), dtype=bool)
    >>> ring[1, 1] = False
    >>> _euler(ring), _euler(np.eye(3, dtype=bool)), _euler(np.ones((2, 5), dtype=bool))
    (0, 1, 1)
    """
    around = np.pad(cells, 1)
    beside, above = around[:, 1:] | around[:, :-1], around[1:] | around[:-1]
    corners = beside[1:] | beside[:-1]
    return int(corners.sum()) - int(beside.sum()) - int(above.sum()) + int(cells.sum())
