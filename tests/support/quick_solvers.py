"""Solvers with small budgets, and a problem that none of them solves."""

from typing import Any

import shapely

from cgla_graph.model.problem import Problem
from cgla_graph.solvers import registry

#: A room without a door, and a problem whose goal is inside.
RING = shapely.box(0.6, 0.6, 1.0, 1.0).difference(shapely.box(0.7, 0.7, 0.9, 0.9))
WALLED_IN = Problem((0.1, 0.1), (0.8, 0.8), no_fly=RING)
#: Settings by the names of solvers; others are quick as they are.
QUICK: dict[str, dict[str, Any]] = {
    "rrt-star": {"iterations": 200},
    "informed-rrt-star": {"iterations": 200},
    "sorrt-star": {"iterations": 200},
    "bit-star": {"iterations": 1000},
    "fmt-star": {"samples": 200},
    "bfmt-star": {"samples": 200},
    "ompl-prm-star": {"milestones": 200},
    "prm-star": {"milestones": 200},
    "evolutionary": {"generations": 10},
    "hybrid": {"tolerance": None},
    "q-learning": {"episodes": 2000},
}


def quick(name: str, *, times: int = 1, **settings: Any) -> Any:  # noqa: ANN401 - any solver
    """Build a solver with its small budget, or some times that."""
    budget = {key: value and times * value for key, value in QUICK.get(name, {}).items()}
    return registry.get(name, **{**budget, **settings})
