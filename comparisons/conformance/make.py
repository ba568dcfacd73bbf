"""
Make the file of instances: plan each problem, and prove how good the path is.

Run ``make conformance``, or ``python -m cgla_graph.comparisons.conformance.make FILE [NAME …]`` for some of them. It
takes minutes. The same problems come out on every machine; paths and bounds are those of the planners here.
"""

import json
import math
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import shapely

from cgla_graph._text import floored
from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import prove
from cgla_graph.comparisons import console, files
from cgla_graph.comparisons.conformance.documents import VERSION
from cgla_graph.comparisons.conformance.families import Draft, drafts
from cgla_graph.comparisons.conformance.suite import WIDEST, Instance
from cgla_graph.errors import CglaError
from cgla_graph.model.problem import Problem
from cgla_graph.solvers.solving import solve

#: Width of a bracket, and most cells of a grid of its proof.
TOLERANCE, MAX_CELLS = 0.0005, 3_000_000
#: Solvers that look for a path, with points a side of their lattices.
PLANNERS = (("hybrid", 20), ("hybrid", 45), ("visibility-graph", 20), ("fast-marching", 20), ("lazy-theta-star", 53))
#: Tolerances of simplified paths: distance as a share of the map's longer side, and additional cost.
SIMPLER, SPENT = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5), 2e-5
#: Significant digits of waypoints, of those of the map's longer side, and of lower bounds.
DIGITS, BOUND_DIGITS = 9, 9


def instance_of(draft: Draft) -> Instance:
    """
    Prove a lower bound of a problem's least cost.

    Raises
    ------
    CglaError
        If the bracket is wider than the suite promises.

    Examples
    --------
    >>> made = instance_of(next(drafts()))
    >>> made.name, made.upper_bound, made.path
    ('open-straight', 0.9, [[0.05, 0.5], [0.95, 0.5]])
    """
    problem = draft.problem.build()
    path = best_path(problem)
    proof = prove(problem, path, tolerance=TOLERANCE, max_cells=MAX_CELLS)
    if path is None or not math.isfinite(proof.lower_bound):
        if path is None and proof.lower_bound == math.inf:
            return Instance(**draft._asdict(), lower_bound=None, upper_bound=None, path=None)
        msg = f"{draft.problem.name}: {'no path' if path is None else 'a path'}, but the bound says {proof.message}"
        raise CglaError(msg)
    cost = problem.evaluate(path).cost
    proven = floored(proof.lower_bound, BOUND_DIGITS)
    if cost > proven * (1.0 + WIDEST):
        msg = f"{draft.problem.name}: the path costs {cost:.9g}, the bound is {proven:.9g}: {proof.message}"
        raise CglaError(msg)
    return Instance(**draft._asdict(), lower_bound=proven, upper_bound=cost, path=path.tolist())


def best_path(problem: Problem) -> FloatArray | None:
    """Return the best path that the planners find, with short waypoints; None without a path."""
    answers = [solve(problem, name, resolution=resolution, refine=True) for name, resolution in PLANNERS]
    found = [answer for answer in answers if answer.status.has_path]
    return shortened(problem, min(found, key=lambda one: one.cost).path) if found else None


def shortened(problem: Problem, path: FloatArray) -> FloatArray:
    """Simplify a path and round its waypoints, unless that would lead into an area."""
    x_min, y_min, x_max, y_max = problem.bounds
    side = max(x_max - x_min, y_max - y_min)
    best = path
    for part in SIMPLER:
        thin = shapely.get_coordinates(shapely.simplify(shapely.LineString(path), part * side))
        found = problem.evaluate(thin)
        if found.feasible and found.cost <= problem.evaluate(path).cost * (1.0 + SPENT):
            best = thin
            break
    rounded = np.round(best, DIGITS - math.ceil(math.log10(side)))
    rounded[[0, -1]] = best[[0, -1]]
    found = problem.evaluate(rounded)
    # a path along the edge of two cells must not leave it
    return rounded if found.feasible and found.cost <= problem.evaluate(path).cost * (1.0 + 2.0 * SPENT) else best


def text_of(instances: list[Instance]) -> str:
    """Write the file: a line an instance, so that changes can be seen."""
    lines = ",\n".join(
        json.dumps(one.model_dump(mode="json"), ensure_ascii=False, allow_nan=False, separators=(",", ":"))
        for one in instances
    )
    return f'{{"version":{VERSION},"instances":[\n{lines}\n]}}\n'


def made(names: set[str]) -> Iterator[Instance]:
    """Make the instances with these names, or all, and print the result of each."""
    for draft in drafts():
        if names and draft.problem.name not in names:
            continue
        began = time.perf_counter()
        one = instance_of(draft)
        gap = "no path" if one.lower_bound is None else f"{one.lower_bound:.6g} to {one.upper_bound:.6g}"
        console.say(f"{one.name}: {gap} ({time.perf_counter() - began:.1f} s)")
        yield one


def main() -> None:
    """Write the file that the first argument names; all others are names of instances."""
    target, *names = sys.argv[1:]
    files.write_text(Path(target), text_of(list(made(set(names)))))


if __name__ == "__main__":
    main()
