"""Every solver on every scenario: the runs of a comparison, one after the other."""

import ast
import dataclasses
import importlib
import time
from collections.abc import Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any

from cgla_graph import risk_kernels
from cgla_graph.cost_model import CostModel
from cgla_graph.errors import CglaError, ScenarioError, SolverSettingError
from cgla_graph.no_fly_kernels import point_inside, segment_crosses
from cgla_graph.problem import GraphProblem, Problem
from cgla_graph.scenario import Scenario
from cgla_graph.solution import Solution, Status
from cgla_graph.solvers import registry
from cgla_graph.solvers.bridge import solve, weighed
from cgla_graph.solvers.cgla import Cgla
from cgla_graph.solvers.eight_direction import EightDirection


@dataclass(frozen=True)
class Contender:
    """
    A solver as the user asked for it.

    Attributes
    ----------
    label
        What tables call it: the name, with the settings that the user gave.
    name
        Its name in the registry.
    settings
        What the user set.

    Examples
    --------
    >>> Contender.parse("rrt-star:iterations=500").settings
    {'iterations': 500}
    """

    label: str
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def parse(cls, text: str) -> "Contender":
        """
        Read ``name`` or ``name:setting=value:setting=value``.

        Raises
        ------
        UnknownSolverError
            If there is no such solver.
        SolverSettingError
            If a setting is not written as ``setting=value``, unknown, set twice, or its value is not allowed.
        """
        name, *parts = text.strip().split(":")
        settings: dict[str, Any] = {}
        for part in parts:
            key, equals, value = part.partition("=")
            if not equals:
                msg = f"{text}: {part!r} is no setting; write NAME:SETTING=VALUE"
                raise SolverSettingError(msg)
            if key in settings:
                msg = f"{text}: {key!r} is set twice; set it once"
                raise SolverSettingError(msg)
            settings[key] = _literal(value)
        registry.solver_class(name)
        if registry.missing(name) is None:
            registry.get(name, **settings)
        return cls(text.strip(), name, settings)


def _literal(text: str) -> Any:  # noqa: ANN401 - whatever the user wrote
    try:
        return ast.literal_eval(text)
    except (ValueError, SyntaxError):
        return text


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
        What came out; never missing, as failures are answers too.
    """

    scenario: Scenario
    solver: str
    seed: int | None
    exact: bool
    solution: Solution


def every_solver() -> list[Contender]:
    """Enter every solver, those that are not installed too: their rows say why."""
    return [Contender(name, name) for name in registry.names(installed=False)]


def count_runs(scenarios: Sequence[Scenario], contenders: Sequence[Contender], n_seeds: int) -> int:
    """Count the runs of a comparison."""
    return sum(len(_seeds(scenario, contender, n_seeds)) for scenario in scenarios for contender in contenders)


def compare(scenarios: Iterable[Scenario], contenders: Sequence[Contender], n_seeds: int = 3) -> Iterator[Run]:
    """
    Run every contender on every scenario; seeded ones with the seeds 1 to `n_seeds`.

    All graph solvers share one graph a scenario, and one time to build it.

    Parameters
    ----------
    scenarios, contenders
        What to run.
    n_seeds
        At least 1.

    Yields
    ------
    run
        As soon as it is done, scenario by scenario. A solver that raises is a run that failed.

    Examples
    --------
    >>> from cgla_graph.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Contender.parse("cgla"), Contender.parse("straight-line")])
    >>> [(run.solver, run.solution.status.label) for run in runs]
    [('cgla', 'optimal'), ('straight-line', 'found')]
    """
    _warm_up(contenders)
    ground = None
    for scenario in scenarios:
        for contender in contenders:
            if ground is None or ground.scenario is not scenario:
                ground = _Ground.lay(scenario, ground)
            for seed in _seeds(scenario, contender, n_seeds):
                solution = _run(ground, contender, seed)
                yield Run(scenario, contender.label, seed, _is_exact(contender), solution)


def check_settings(scenario: Scenario) -> None:
    """
    Check the settings of solvers that a scenario brings.

    Raises
    ------
    ScenarioError
        If a solver or a setting is unknown, or a value is not allowed.
    """
    for name, settings in scenario.settings.items():
        try:
            registry.solver_class(name)
            if registry.missing(name) is None:
                registry.get(name, **settings)
        except CglaError as error:
            msg = f"{scenario.name}: solvers.{name}: {error}"
            raise ScenarioError(msg) from error


def _seeds(scenario: Scenario, contender: Contender, n_seeds: int) -> Sequence[int | None]:
    """List the seeds of a contender: none, the one that the user or the scenario set, or 1 to `n_seeds`."""
    if registry.missing(contender.name) is not None or not registry.traits(contender.name).seeded:
        return [None]
    settings = _settings(scenario, contender)
    return [settings["seed"]] if "seed" in settings else range(1, n_seeds + 1)


def _settings(scenario: Scenario, contender: Contender) -> dict[str, Any]:
    """Merge the settings that suit a scenario with the user's own, which win."""
    return {**scenario.settings.get(contender.name, {}), **contender.settings}


def _is_exact(contender: Contender) -> bool:
    return registry.missing(contender.name) is None and registry.traits(contender.name).exact


@dataclass(eq=False)
class _Ground:
    """A scenario, and the graph that all graph solvers share on it, laid when the first one asks."""

    scenario: Scenario
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
    settings = _settings(ground.scenario, contender)
    if seed is not None:
        settings["seed"] = seed
    problem, lattice = ground.scenario.problem, ground.scenario.lattice
    try:
        solver = registry.get(contender.name, **settings)
        if solver.traits.domain == "plane":
            return solve(problem, solver, resolution=lattice)
        on = ground.graph()
        solution = solve(problem, solver, on=on)
        return dataclasses.replace(solution, build_seconds=ground.build_seconds + solution.build_seconds)
    except CglaError as error:
        return Solution(Status.FAILED, solver=contender.name, message=str(error))
    except (Exception, SystemExit) as error:  # noqa: BLE001 - a comparison survives any solver
        message = f"{type(error).__name__}: {error}".splitlines()[0]
        return Solution(Status.FAILED, solver=contender.name, message=message)


def _warm_up(contenders: Iterable[Contender]) -> None:
    """Load the compiled kernels and the solvers' packages, so that no solver is charged for that."""
    for contender in contenders:
        if registry.missing(contender.name) is None:
            for package in registry.traits(contender.name).needs:
                importlib.import_module(package)
    problem = Problem((0.0, 0.0), (1.0, 1.0), k=1.0)
    for solver in (Cgla(), EightDirection(corner_rule="both-free")):
        # what is wrong with a solver is told by its own run
        with suppress(Exception):
            solve(problem, solver, resolution=2)
    model = CostModel(problem.field, 1.0)
    risk_kernels.segment_cost(0.0, 0.0, 1.0, 1.0, 1.0, model.field.kernel_field())
    segment_crosses(0.0, 0.0, 1.0, 1.0, model.area.kernel_arrays)
    point_inside(0.0, 0.0, model.area.kernel_arrays)
