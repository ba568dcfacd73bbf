"""The paper's replanning in a map that changes: CGLA on the map as it is now, one step, and again (Section 4.2.2)."""

import math

import numpy as np

from cgla_graph._validate import positive_number, whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Status
from cgla_graph.model.solver import run
from cgla_graph.solvers.registry import get
from cgla_graph.solvers.timed.found_flight import FoundFlight
from cgla_graph.timed.timed_problem import TimedProblem

#: A flight of so many steps more than the map is wide is stuck.
MOST_WIDTHS = 10


def replan(problem: TimedProblem, resolution: int = 20, step: float = 0.4) -> FoundFlight:
    """
    Plan on the map as it is now, fly a step, and plan again, until the goal is reached.

    Parameters
    ----------
    problem
        A timed problem; the flight begins at the first departure.
    resolution
        Points a side of the lattice; from 2 to 100.
    step
        How far it flies on a plan, in steps of the lattice, or to the plan's next waypoint if that is nearer: the
        paper's 0.4.
    """
    whole_number("resolution", resolution, at_least=2, at_most=100)
    x_min, y_min, x_max, y_max = problem.bounds
    far = positive_number("step", step) * max(x_max - x_min, y_max - y_min) / (resolution - 1)
    cgla, still = get("cgla"), problem.still
    rows = [np.array([problem.departures[0], *problem.start])]
    most = math.ceil(MOST_WIDTHS * resolution / step)
    for plans in range(most):
        now, place = float(rows[-1][0]), (float(rows[-1][1]), float(rows[-1][2]))
        if place == problem.goal:
            message = f"CGLA on a lattice of {resolution} x {resolution} places, planned {plans} times"
            return FoundFlight(Status.FOUND, np.array(rows), evaluations=plans, message=message)
        try:
            seen = Problem(
                place, problem.goal, problem.field_at(now), problem.k, problem.bounds, problem.slab_at(now).no_fly,
                problem.clearance, still.projection,
            ).on_lattice(resolution)  # fmt: skip
            path = run(cgla, seen.with_weights_held()).path
            if len(path):
                leg = path[1] - place
                part = min(1.0, far / float(np.hypot(*leg)))
                goes_to = path[1] if part == 1.0 else place + part * leg
                rows.append(problem.fly([place, goes_to], now)[-1])
            elif problem.waiting is not None:
                rows.append(np.array([now + far / problem.speed, *place]))
            else:
                return FoundFlight(Status.STUCK, message=f"at time {now:.6g}, no way is open on the map as it is then")
        except ProblemError as error:
            return FoundFlight(Status.STUCK, message=f"at time {now:.6g}: {error}")
    return FoundFlight(Status.STUCK, message=f"it did not arrive in {most} steps")
