"""Every solver on every scenario: the runs of a comparison, one after the other."""

import dataclasses
import importlib
import math
import time
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from typing import Any

import shapely

from cgla_graph import risk_kernels
from cgla_graph.certificate import Certificate, lower_bound
from cgla_graph.comparisons.contender import Contender
from cgla_graph.errors import CglaError
from cgla_graph.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.problem import BOUND_TOLERANCE, GraphProblem, Problem
from cgla_graph.risk import RiskField, Threat
from cgla_graph.scenario import Scenario
from cgla_graph.solution import Solution, Status
from cgla_graph.solvers import registry
from cgla_graph.solvers.bridge import solve, weighed
from cgla_graph.solvers.hybrid import Hybrid

#: How close to each other the lower bound of a scenario and its best path shall be, as a ratio, unless told otherwise.
TOLERANCE = 0.005


@dataclass(frozen=True, eq=False)
class Run:
    """
    One solver's run on one scenario.

    Attributes
    ----------
    scenario
        The scenario.
    solver
        The contender's label.
    seed
        For seeded solvers; else None.
    exact
        Whether the solver promises the optimum of the graph that graph solvers share.
    solution
        What came out; never missing, as failures are answers too. Its lower bound is the certificate's, or the solver's
        own where that is better.
    certificate
        What is proven of every path of the scenario; None where that was not asked for.
    """

    scenario: Scenario
    solver: str
    seed: int | None
    exact: bool
    solution: Solution
    certificate: Certificate | None = None


def count_runs(scenarios: Sequence[Scenario], contenders: Sequence[Contender], n_seeds: int) -> int:
    """Count the runs of a comparison."""
    return sum(len(_seeds(scenario, contender, n_seeds)) for scenario in scenarios for contender in contenders)


def compare(
    scenarios: Iterable[Scenario],
    contenders: Sequence[Contender],
    n_seeds: int = 3,
    *,
    tolerance: float | None = TOLERANCE,
) -> Iterator[Run]:
    """
    Run every contender on every scenario; seeded ones with the seeds 1 to `n_seeds`.

    All graph solvers share one graph a scenario, and one time to build it. Before them, the cost of every path of the
    scenario is bounded from below, so that each run says how far from the best possible it is; no solver is charged
    for that.

    Parameters
    ----------
    scenarios, contenders
        What to run.
    n_seeds
        At least 1.
    tolerance
        Of the lower bound (see `cgla_graph.certificate.lower_bound`), above 0; None for no bound.

    Yields
    ------
    run
        As soon as it is done, scenario by scenario. A solver that raises is a run that failed; so is one whose path
        undercuts the lower bound, as one of the two must be wrong.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Contender.parse("cgla"), Contender.parse("straight-line")])
    >>> [(run.solver, run.solution.status.label) for run in runs]
    [('cgla', 'optimal'), ('straight-line', 'found')]
    """
    _warm_up(contenders)
    if tolerance is not None:
        _warm_up_proof()
    ground = None
    for scenario in scenarios:
        for contender in contenders:
            if ground is None or ground.scenario is not scenario:
                ground = _Ground.lay(scenario, ground)
                if tolerance is not None:
                    ground.certificate = _certify(scenario.problem, tolerance)
            for seed in _seeds(scenario, contender, n_seeds):
                solution = _bounded(_run(ground, contender, seed), ground.certificate)
                yield Run(scenario, contender.label, seed, contender.is_exact, solution, ground.certificate)


def _seeds(scenario: Scenario, contender: Contender, n_seeds: int) -> Sequence[int | None]:
    """List the seeds of a contender: none, the one that the user or the scenario set, or 1 to `n_seeds`."""
    if not contender.is_available or not registry.traits(contender.name).seeded:
        return [None]
    settings = contender.settings_on(scenario)
    return [settings["seed"]] if "seed" in settings else range(1, n_seeds + 1)


def _certify(problem: Problem, tolerance: float) -> Certificate:
    """Bound the cost of every path, with a good one in hand; what goes wrong leaves no bound, but a reason."""
    began = time.perf_counter()
    try:
        best = Hybrid(tolerance=None).solve(problem)
        path = best.path if best.status.is_path else None
        return dataclasses.replace(lower_bound(problem, tolerance, path=path), seconds=time.perf_counter() - began)
    except Exception as error:  # noqa: BLE001 - a comparison survives any certificate
        message = f"{type(error).__name__}: {error}".splitlines()[0]
    return Certificate(
        lower_bound=math.nan,
        upper_bound=math.inf,
        tolerance=tolerance,
        spacing=math.nan,
        cells=0,
        message=message,
        seconds=time.perf_counter() - began,
    )


def _bounded(solution: Solution, certificate: Certificate | None) -> Solution:
    """Attach the scenario's lower bound to an answer, which must not undercut it."""
    if certificate is None or math.isnan(certificate.lower_bound):
        return solution
    if not solution.lower_bound >= certificate.lower_bound:
        solution = dataclasses.replace(solution, lower_bound=certificate.lower_bound)
    cost = solution.cost
    if solution.status.is_path and certificate.lower_bound > cost + BOUND_TOLERANCE * abs(cost):
        message = (
            f"its path costs {cost:.9g}, but the certificate says that none costs less than "
            f"{certificate.lower_bound:.9g}; one of the two is wrong"
        )
        return dataclasses.replace(solution, status=Status.FAILED, message=message)
    return solution


@dataclass(eq=False)
class _Ground:
    """A scenario, what is proven of it, and the graph of all graph solvers, laid when the first one asks."""

    scenario: Scenario
    certificate: Certificate | None = None
    graph_problem: GraphProblem | None = None
    build_seconds: float = 0.0

    @classmethod
    def lay(cls, scenario: Scenario, before: "_Ground | None") -> "_Ground":
        """Start a scenario; the rows of one grid map share their graph, too."""
        ground = cls(scenario)
        if before is None or before.graph_problem is None:
            return ground
        graph, lattice, problem = before.graph_problem.graph, scenario.lattice, scenario.problem
        nodes = [lattice.nearest(end) for end in (problem.start, problem.goal)]
        on_nodes = [tuple(lattice.points[node]) for node in nodes] == [problem.start, problem.goal]
        if on_nodes and graph.n_nodes == lattice.n_points and graph.lattice == lattice and graph.model == problem.model:
            ground.graph_problem = GraphProblem(graph, *nodes)
            ground.build_seconds = before.build_seconds
        return ground

    def graph(self) -> GraphProblem:
        """Return the shared graph, weighed."""
        if self.graph_problem is None:
            began = time.perf_counter()
            self.graph_problem = weighed(self.scenario.problem.on_lattice(self.scenario.lattice))
            self.build_seconds = time.perf_counter() - began
        return self.graph_problem


def _run(ground: _Ground, contender: Contender, seed: int | None) -> Solution:
    """Run one solver; whatever it raises becomes its answer."""
    missing = registry.missing(contender.name)
    if missing is not None:
        return Solution(Status.UNAVAILABLE, solver=contender.name, message=missing)
    settings = contender.settings_on(ground.scenario)
    if seed is not None:
        settings["seed"] = seed
    problem, lattice = ground.scenario.problem, ground.scenario.lattice
    try:
        if registry.traits(contender.name).domain == "plane":
            return _solve(problem, contender, settings, resolution=lattice)
        solution = _solve(problem, contender, settings, on=ground.graph())
        # what a solver proves of the paths on a graph does not hold for those in the plane
        bound = 0.0 if problem.start == problem.goal else math.nan
        build_seconds = ground.build_seconds + solution.build_seconds
        return dataclasses.replace(solution, build_seconds=build_seconds, lower_bound=bound)
    except CglaError as error:
        return Solution(Status.FAILED, solver=contender.name, message=str(error))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a comparison survives any solver
        message = f"{type(error).__name__}: {error}".splitlines()[0]
        return Solution(Status.FAILED, solver=contender.name, message=message)


def _solve(problem: Problem, contender: Contender, settings: dict[str, Any], **how: Any) -> Solution:  # noqa: ANN401 - as `solve`
    return solve(problem, registry.get(contender.name, **settings), refine=contender.refine, **how)


def _warm_up(contenders: Iterable[Contender]) -> None:
    """Load the compiled kernels and the solvers' packages, so that no solver's first run is charged for that."""
    problem = _small_problem()
    for contender in contenders:
        if not contender.is_available:
            continue
        needs = registry.traits(contender.name).needs
        for package in needs:
            importlib.import_module(package)
        if not needs and registry.solver_class(contender.name).__module__.startswith("cgla_graph."):
            # what is wrong with a solver is told by its own run
            with suppress(Exception):
                _solve(problem, contender, contender.small_settings(), resolution=2)
    model = problem.model
    risk_kernels.segment_cost(0.0, 0.0, 1.0, 1.0, 1.0, model.field.kernel_field())
    segment_crosses(0.0, 0.0, 1.0, 1.0, model.area.kernel_arrays)
    point_inside(0.0, 0.0, model.area.kernel_arrays)


def _warm_up_proof() -> None:
    """Load what proves lower bounds, so that the first certificate says how long its own proof took."""
    # what is wrong with it is told by the certificate of the first scenario
    with suppress(Exception):
        lower_bound(_small_problem(), 0.5)


def _small_problem() -> Problem:
    """Return a problem with a threat and a wall, so that every kernel has something to do."""
    field = RiskField([Threat(0.5, 0.5, 0.1)])
    return Problem((0.0, 0.0), (1.0, 1.0), field, k=1.0, no_fly=shapely.box(0.45, 0.2, 0.55, 0.8))
