"""Plan a flight through moving risk: a march over space and time, its traces, and the best of them bent."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cgla_graph._text import counted
from cgla_graph._types import FloatArray
from cgla_graph._validate import whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.solution import Status
from cgla_graph.motion.trajectory import Trajectory
from cgla_graph.solvers.timed.bending import Bender, Flying, along, of_trace
from cgla_graph.solvers.timed.charting import always_closed, chart_of, discs_of, grid_for
from cgla_graph.solvers.timed.found_flight import FoundFlight, arrived
from cgla_graph.solvers.timed.march_kernels import FAR, Ends, Grid, cubic, linear, march, trace
from cgla_graph.solvers.timed.space_time_lattice import plan_on_lattice
from cgla_graph.solvers.timed.timed_kernels import Chart, leg_time
from cgla_graph.timed.timed_problem import TimedProblem

#: Nodes of a grid in space and time, and of a second one after a failure.
NODES = 500_000
#: Classes of ways that are bent with few waypoints, and of those that are bent to the end.
MOST_CLASSES, FINAL = 9, 2
#: Flights that cost so many times the best one known are on the grid.
ROOM = 1.1
#: Costs closer than this part are those of one class; ways that cost more than so many times the best are left,
#: and those that are bent to the end cost less.
SAME, WORTH, CLOSE = 1e-4, 1.25, 1.01


def plan_in_time(problem: TimedProblem, nodes: int = NODES) -> FoundFlight:
    """
    Find the best flight of a timed problem that the march and the bending lead to.

    Parameters
    ----------
    problem
        A timed problem.
    nodes
        Nodes of the grid in space and time, about; from 1 000 to 20 million.
    """
    whole_number("nodes", nodes, at_least=1_000, at_most=20_000_000)
    return arrived(problem) if problem.start == problem.goal else Search(problem, nodes).run()


class Search:
    """
    A search for the best flight.

    Parameters
    ----------
    problem, nodes
        As of `plan_in_time`.
    also, radius
        More trajectories to keep away from, at another distance; the oracle does not know of them.
    """

    def __init__(self, problem: TimedProblem, nodes: int, also: Sequence[Trajectory] = (), radius: float = 0.0) -> None:
        self.problem, self.nodes = problem, nodes
        last = problem.departures[1]
        span = leg_time(chart_of(problem, last + 1.0), *np.subtract(problem.goal, problem.start))
        events = problem.events[np.isfinite(problem.events)]
        late = max([last + 20.0 * (span if math.isfinite(span) else 1.0), *(events + 1.0).tolist()])
        chart = chart_of(problem, late)
        self.chart: Chart = chart._replace(discs=discs_of(problem, also, radius)) if also else chart
        self.bender = Bender(problem, self.chart, also, radius)
        self.found: list[Flying] = []
        self.departures = np.empty((0, 2))

    def run(self) -> FoundFlight:
        """Search."""
        self._try_known()
        for share in (1, 4):
            grid, goal_values, goal = self._march_back(self.nodes * share)
            self._follow(grid, goal_values, goal)
            if self._best() < math.inf:
                self._follow_classes(grid, goal_values, goal)
                break
        ranked = self._ranked()
        if not ranked:
            message = "no feasible flight was found; one may exist"
            return FoundFlight(Status.NOT_FOUND, evaluations=self.bender.evaluations, message=message)
        final = [self.bender.fine(one) for one in ranked[:FINAL] if one.cost <= CLOSE * ranked[0].cost]
        best = min(final, key=lambda one: one.cost)
        message = f"{counted(len(ranked), 'way')} compared on a grid of {grid.nx} x {grid.ny} x {len(grid.times)}"
        return FoundFlight(
            Status.FOUND, self.bender.rows(best), self.departures, self.bender.evaluations, len(ranked), message
        )

    def _best(self) -> float:
        return min((one.cost for one in self.found), default=math.inf)

    def _ranked(self) -> list[Flying]:
        """Return one flight of each class that is worth a look, the best first."""
        ranked: list[Flying] = []
        for one in sorted(self.found, key=lambda one: one.cost):
            if not math.isfinite(one.cost) or (ranked and one.cost > WORTH * ranked[0].cost):
                break
            if all(one.cost - other.cost > SAME * other.cost for other in ranked):
                ranked.append(one)
        return ranked

    def _try_known(self) -> None:
        """Bend straight flights, and with areas the best path while all of them are closed."""
        problem = self.problem
        if problem.areas:
            # (the march may miss how to pass the time until an area opens)
            rows = plan_on_lattice(replace(problem, others=())).rows
            if len(rows) > 1:
                self.found.append(self.bender.coarse(of_trace(self.chart, rows, self.bender.scale)))
        for departure in {*problem.departures}:
            self.found.append(self.bender.coarse(along([problem.start, problem.goal], departure)))
        if not len(self.chart.boxes):
            return
        from cgla_graph.solvers.continuous.hybrid import Hybrid  # noqa: PLC0415 - only where there are areas

        try:
            closed = always_closed(problem)
        except ProblemError:
            # (an end is inside of an area that is closed for a time)
            return
        answer = Hybrid(tolerance=None).solve(closed)
        if answer.status.has_path:
            path = answer.path
            for departure in {*problem.departures}:
                as_is = self.bender.judged(along(path, departure))
                self.found += [as_is, self.bender.coarse(as_is)]

    def _march_back(self, nodes: int) -> tuple[Grid, FloatArray, Ends]:
        problem, chart = self.problem, self.chart
        first = problem.departures[0]
        most = self._best()
        if not math.isfinite(most):
            span = leg_time(chart, *np.subtract(problem.goal, problem.start))
            most = chart.speed * max(6.0 * (span if math.isfinite(span) else 1.0), chart.edges[-2] - first)
        grid = grid_for(problem, chart, ROOM * most, nodes)
        goal = Ends(*problem.goal, -math.inf, chart.latest, *problem.start, first, ROOM * most)
        return grid, march(chart, grid, goal, 1.0), goal

    def _follow(self, grid: Grid, values: FloatArray, goal: Ends) -> None:
        """Follow the march from the start at the best departures."""
        problem = self.problem
        layers = np.nonzero(grid.times <= problem.departures[1])[0]
        u, v = ((at - low) / grid.h for at, low in zip(problem.start, (grid.x, grid.y), strict=True))
        curve = np.array([min(cubic(values[a], u, v), linear(values[a], u, v)) for a in layers])
        known = curve < FAR
        self.departures = np.column_stack([grid.times[layers], np.where(known, curve, math.inf)])
        padded = np.concatenate([[math.inf], curve, [math.inf]])
        low = np.nonzero((padded[1:-1] <= padded[:-2]) & (padded[1:-1] <= padded[2:]) & known)[0]
        for a in low[np.argsort(curve[low])][:3]:
            rows = trace(self.chart, grid, goal, 1.0, values, int(layers[a]), *problem.start)
            self._add(rows, grid)

    def _add(self, rows: FloatArray, grid: Grid) -> None:
        if len(rows) > 1 and np.isfinite(rows).all():
            self.found.append(self.bender.coarse(of_trace(self.chart, rows, 2.0 * grid.h)))

    def _follow_classes(self, grid: Grid, values: FloatArray, goal: Ends) -> None:
        """Follow the marches from both ends through places between which it costs more to fly."""
        problem, best = self.problem, self._best()
        first, last = problem.departures
        start = Ends(*problem.start, first, last, *problem.goal, first, ROOM * best)
        forward = march(self.chart, grid, start, -1.0)
        arrival = min(self.found, key=lambda one: one.cost).rows(self.chart)
        seen = 0
        for share in (0.3, 0.5, 0.7):
            when = arrival[0, 0] + share * (arrival[-1, 0] - arrival[0, 0])
            layer = int(np.abs(grid.times - when).argmin())
            for x, y in _valleys(forward[layer] + values[layer], best, grid)[: MOST_CLASSES // 3]:
                back = trace(self.chart, grid, start, -1.0, forward, layer, x, y)
                on = trace(self.chart, grid, goal, 1.0, values, layer, x, y)
                if len(back) > 1 and len(on) > 1:
                    rows = np.vstack([back[::-1], on[1:]])
                    rows[0, 0] = min(max(rows[0, 0], first), last)
                    self._add(rows, grid)
                    seen += 1


def _valleys(total: FloatArray, best: float, grid: Grid) -> list[tuple[float, float]]:
    """Return the places at which the cost of flights through a layer is least among their neighbours, best first."""
    inner = total[1:-1, 1:-1]
    lowest = inner < min(WORTH * best, FAR)
    for j in range(3):
        for i in range(3):
            if (i, j) != (1, 1):
                lowest &= inner <= total[j : j + inner.shape[0], i : i + inner.shape[1]]
    places = np.argwhere(lowest) + 1
    order = np.argsort(total[places[:, 0], places[:, 1]], kind="stable")
    return [(grid.x + i * grid.h, grid.y + j * grid.h) for j, i in places[order].tolist()]
