"""Lazy Theta*: any-angle paths over a lattice; segments to far parents are weighed only when a node is expanded."""

import time
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cgla_graph._types import IntArray
from cgla_graph.model.adjacency import CornerRule, cell_corners
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.solver import Traits
from cgla_graph.solvers.base import Resolution, Settings
from cgla_graph.solvers.grid import theta_kernels


@dataclass(frozen=True)
class LazyThetaStar(Settings):
    """
    Lazy Theta* (Nash, Koenig, Tovey, AAAI 2010; Daniel, Nash, Koenig, Felner, JAIR 39, 2010) over the exact cost.

    A search over the moves to the eight neighbours in which a node's parent may be its neighbour's parent, so that the
    path turns at lattice points by any angle. The original takes the parent's parent wherever it is in sight, as
    lengths obey the triangle inequality. Eq. 5 does not: the straight segment may cost more than the way round. So the
    search assumes the straight distance, a lower bound, and only when a node is next to be expanded weighs it by
    Eq. 5: from each expanded neighbour's parent, and from each expanded neighbour itself, as far as their
    bounds can win. If that is more expensive than assumed, the node waits until it is next again.

    Never more expensive than `eight-direction` on the same lattice (see `theta_kernels`), and never cheaper than the
    optimum of the complete graph over it; not optimal among any-angle paths.

    Attributes
    ----------
    resolution
        Points a side of a closed lattice, or a `Lattice`; None: that of `solve`, else 20.
    corner_rule
        ``touch``: a segment may touch a corner of a no-fly area. ``both-free``, the rule of grid benchmarks: where a
        segment between lattice points passes a corner that four cells share, both cells beside it must be free.

    Raises
    ------
    SolverSettingError
        If the resolution is below 2 or the rule is unknown.

    Examples
    --------
    >>> problem = Problem(start=(0, 0), goal=(1, 0.5))
    >>> round(LazyThetaStar(resolution=3).solve(problem).cost, 4)
    1.118
    """

    resolution: Resolution | None = None
    corner_rule: CornerRule = "touch"

    traits: ClassVar[Traits] = Traits(
        "lazy-theta-star", "any-angle search over the lattice", domain="plane", needs_positive=True
    )

    def solve(self, problem: Problem) -> Solution:
        """Lay the lattice, which is reported as time to build, and search it."""
        began = time.perf_counter()
        resolution = self.resolution or 20
        lattice = resolution if isinstance(resolution, Lattice) else Lattice(resolution, bounds=problem.bounds)
        # the complete graph is not weighed: only its nodes are used, start and goal among them
        on = problem.on_lattice(lattice)
        positions = np.asarray(on.graph.positions)
        x_min, y_min, x_max, y_max = problem.bounds
        inside = np.all((positions >= (x_min, y_min)) & (positions <= (x_max, y_max)), axis=1)
        free = np.empty(0, dtype=np.bool_)
        if self.corner_rule == "both-free":
            free = ~problem.model.area.contains(lattice.points)
        build_seconds = time.perf_counter() - began
        ground = positions, *lattice.shape, free, problem.model.kernel_model(mixed=True)
        links = np.stack(cell_corners(lattice, positions), axis=1)
        ends = on.graph.index_of(on.source), on.graph.index_of(on.target)
        values, parents = np.full(len(positions), np.inf), np.full(len(positions), -1)
        n_weighed, n_expanded = theta_kernels.search(ground, links, inside, *ends, values, parents)
        if not np.isfinite(values[ends[1]]):
            return Solution(Status.NO_PATH, evaluations=n_weighed, build_seconds=build_seconds)
        nodes = _trace(parents, *ends)
        values, parents = np.empty(len(nodes)), np.empty(len(nodes), dtype=np.int64)
        n_weighed += theta_kernels.straighten(nodes, ground, values, parents)
        nodes = nodes[_trace(parents, 0, len(nodes) - 1)]
        return Solution(
            Status.FOUND,
            path=positions[nodes],
            nodes=tuple(nodes.tolist()),
            cost=float(values[-1]),
            build_seconds=build_seconds,
            evaluations=n_weighed,
            message=f"{n_expanded} nodes expanded",
        )


def _trace(parents: IntArray, source: int, target: int) -> IntArray:
    """Follow the parents from target back to source; return the way there."""
    nodes = [target]
    while nodes[-1] != source:
        nodes.append(int(parents[nodes[-1]]))
    return np.array(nodes[::-1])
