"""Proofs that areas separate start and goal, for walls that are too thin for the cells of a grid."""

from typing import Final

import numpy as np
import shapely

from cgla_graph.model.clearance import GAP
from cgla_graph.model.problem import Problem

#: Areas are made narrower by this part of the width of gaps that are closed, so that rounding closes no passage.
NARROWER: Final = 1e-3


def is_separated(problem: Problem) -> bool:
    """
    Return whether no path joins start and goal: they are in different parts of the map outside the areas.

    Areas are made narrower by more than rounding, and parts that touch count as one. If the answer is no, there may be
    a path or none.

    Examples
    --------
    >>> tips = shapely.Polygon([(0.5, 0.0), (0.6, 0.5), (0.5, 1.0), (0.4, 0.5)])
    >>> is_separated(Problem((0.1, 0.5), (0.9, 0.5), no_fly=tips))
    True
    >>> is_separated(Problem((0.1, 0.5), (0.9, 0.5), no_fly=shapely.affinity.scale(tips, 0.9, 0.9)))
    False
    """
    from scipy.sparse import coo_array  # noqa: PLC0415 - slow to import, and rarely needed
    from scipy.sparse.csgraph import connected_components  # noqa: PLC0415 - the same

    area = problem.model.area
    if area.is_empty:
        return False
    x_min, y_min, x_max, y_max = problem.bounds
    farthest = float(np.spacing(np.abs(problem.bounds).max()))
    less = max(NARROWER * GAP * max(x_max - x_min, y_max - y_min), 4.0 * farthest)
    narrow = shapely.buffer(area.geometry, -less, join_style="mitre")
    parts = shapely.get_parts(shapely.difference(shapely.box(*problem.bounds), narrow))
    ends = [shapely.STRtree(parts).query(shapely.Point(end), "dwithin", less) for end in (problem.start, problem.goal)]
    if len(parts) < 2 or not all(map(len, ends)):  # noqa: PLR2004 - two parts
        return False
    one, other = shapely.STRtree(parts).query(parts, "dwithin", less)
    near = coo_array((np.ones(len(one)), (one, other)), shape=(len(parts), len(parts)))
    _, label = connected_components(near, directed=False)
    return not set(label[ends[0]]) & set(label[ends[1]])
