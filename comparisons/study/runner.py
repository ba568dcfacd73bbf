"""Every solver on every scenario, a map or a pair of nodes of a graph: the runs of a comparison, one by one."""

import dataclasses
import importlib
import math
import time
from collections.abc import Callable, Generator, Iterable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from typing import Any, cast

import scipy  # (its modules are imported when they are first used)

from cgla_graph._progress import waiting
from cgla_graph._text import ShortRepr
from cgla_graph.certificate.certificate import Certificate, load_kernels, prove
from cgla_graph.comparisons.study.entrant import Entrant, as_entrant, check_domain
from cgla_graph.comparisons.study.graph_bound import certify_on_graph, held
from cgla_graph.comparisons.study.metric import Measure
from cgla_graph.errors import CglaError, ScenarioError
from cgla_graph.isolation.limits import is_expendable
from cgla_graph.isolation.outcome import failure_by, one_line
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.isolated import STATUS_OF
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import TOLERANCE, Solution, Status, refuted
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario, as_any_scenario
from cgla_graph.scenarios.scenario import Scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.continuous.hybrid import Hybrid
from cgla_graph.solvers.solving import bounded, hold_affordable_weights, solve
from cgla_graph.solvers.warm_up import warm_up as warm_up_solver
from cgla_graph.solvers.warm_up import warm_up_restricted


@dataclass(frozen=True, eq=False)
class Run(ShortRepr):
    """
    One solver's run on one scenario.

    Attributes
    ----------
    scenario
        The scenario.
    solver
        The entrant's label.
    seed
        Of a seeded solver; else None.
    exact
        Whether it is a solver of this package that ends at the optimum of the graph that graph solvers share.
    solution
        The result; a failure is a result, too. Its lower bound is the certificate's, or that of a solver of this
        package where it is higher; on a map in longitude and latitude it holds on the Earth. That of a plug-in is a
        claim.
    certificate
        The lower bound for every path of the scenario; None if none was asked for.
    settings
        Settings of the solver, without its seed.
    megabytes
        Peak memory of the run, in units of 2**20 bytes; NaN where unknown.
    host
        Name of the machine; empty where unknown.
    number
        Its number in the file of a study, from 1; None outside of one.
    measures
        Values of the study's metrics.
    """

    scenario: AnyScenario
    solver: str
    seed: int | None
    exact: bool
    solution: Solution
    certificate: Certificate | None = None
    settings: Mapping[str, Any] = field(default_factory=dict)
    megabytes: float = math.nan
    host: str = ""
    number: int | None = None
    measures: Sequence[Measure] = ()

    @property
    def on_map(self) -> Scenario:
        """
        The scenario, where it is a map.

        Raises
        ------
        ScenarioError
            If it is a pair of nodes of a graph.
        """
        if isinstance(self.scenario, GraphScenario):
            msg = f"{self.scenario.name} is on a graph, not on a map; take run.scenario"
            raise ScenarioError(msg)
        return self.scenario

    @property
    def has_answer(self) -> bool:
        """Whether it found a path, or says that there is none where that is proven."""
        status, proof = self.solution.status, self.certificate
        return status.has_path or (status is Status.NO_PATH and proof is not None and proof.lower_bound == math.inf)

    def measure(self, name: str) -> float:
        """Return the value of a metric of the study; NaN where it has none."""
        return next((one.value for one in self.measures if one.name == name), math.nan)


def compare(
    scenarios: Iterable[AnyScenario],
    entrants: Sequence[Entrant],
    n_seeds: int = 3,
    *,
    tolerance: float | None = TOLERANCE,
) -> Iterator[Run]:
    """
    Run every entrant on every scenario; seeded ones with the seeds 1 to `n_seeds`.

    All graph solvers share one graph per scenario, and its build time. The lower bound of the scenario is proven
    before they run, so that each run has a gap; no solver is charged for the proof.

    Parameters
    ----------
    scenarios, entrants
        Scenarios and entrants; problems and texts are accepted (see `cgla_graph.comparisons.study.study.Study`).
    n_seeds
        At least 1.
    tolerance
        Of the lower bound (see `cgla_graph.lower_bound`), above 0; None for no bound.

    Yields
    ------
    run
        As soon as it is done, scenario by scenario; from one that claims a bound on, when its scenario is done, whose
        other paths may refute it. A solver that raises gives a failed run; so does one whose path undercuts the lower
        bound, because one of the two must be wrong, and one whose claim is refuted.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> runs = compare([load_scenario("one-threat")], [Entrant.parse("cgla"), Entrant.parse("straight-line")])
    >>> [(run.solver, run.solution.status.label) for run in runs]
    [('cgla', 'optimal'), ('straight-line', 'found')]
    """
    yield from waiting("comparison", _runs(scenarios, entrants, n_seeds, tolerance))


def _runs(
    scenarios: Iterable[AnyScenario], given_entrants: Sequence[Entrant], n_seeds: int, tolerance: float | None
) -> Iterator[Run]:
    entrants = [as_entrant(entrant) for entrant in given_entrants]
    ground = None
    for number, given in enumerate(scenarios, start=1):
        scenario = as_any_scenario(given, f"problem-{number}")
        check_domain([scenario], entrants)
        kind = kind_of(scenario)
        warm_up(entrants, kind)
        if isinstance(scenario, GraphScenario):
            warm_up_on_graph(entrants, scenario.problem.graph)
        if tolerance is not None and not isinstance(scenario, GraphScenario):
            warm_up_proof(kind)
        ground = SharedGraph.lay(scenario, ground)
        alone = len(entrants) == 1 and tolerance is not None and _is_own(entrants[0], scenario)
        known = run(ground, entrants[0], None) if alone else None
        certificate = None if tolerance is None else certify(scenario, tolerance, known)
        made = (
            run_of(scenario, entrant, seed, known or run(ground, entrant, seed), certificate)
            for entrant in entrants
            for seed in seeds_of(scenario, entrant, range(1, n_seeds + 1))
        )
        yield from with_claims_settled(made)


def with_claims_settled(runs: Iterable[Run]) -> Generator[Run]:
    """Hand runs on; from the first that claims a bound on, at the end, when the paths that may refute it are known."""
    held: list[Run] = []
    best: dict[int, Run] = {}
    for one in runs:
        _keep_best(best, one)
        if held or math.isfinite(one.solution.claimed_bound):
            held.append(one)
        else:
            yield one
    yield from (_held_against(best, one) for one in held)


def with_refuted_claims(runs: Iterable[Run]) -> list[Run]:
    """
    Fail the runs that claim a lower bound above the cost of another run's path on the same scenario.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> answers = [Solution(Status.FOUND, cost=3.0, claimed_bound=3.0), Solution(Status.FOUND, cost=2.0)]
    >>> scenario = load_scenario("paper")
    >>> runs = [Run(scenario, name, None, False, one) for name, one in zip(("liar", "good"), answers)]
    >>> with_refuted_claims(runs)[0].solution.message
    'the solver says that no path costs less than 3, that of good costs 2'
    """
    given = list(runs)
    best: dict[int, Run] = {}
    for one in given:
        _keep_best(best, one)
    return [_held_against(best, one) for one in given]


def _keep_best(best: dict[int, Run], one: Run) -> None:
    """Keep the run with the cheapest path of each scenario."""
    known = best.get(id(one.scenario))
    if one.solution.status.has_path and (known is None or one.solution.cost < known.solution.cost):
        best[id(one.scenario)] = one


def _held_against(best: Mapping[int, Run], one: Run) -> Run:
    known = best.get(id(one.scenario))
    if known is None or math.isnan(one.solution.claimed_bound):
        return one
    return dataclasses.replace(one, solution=refuted(one.solution, known.solution.cost, f"that of {known.solver}"))


def _is_own(entrant: Entrant, scenario: AnyScenario) -> bool:
    """Return whether an entrant is the solver whose path the certificate uses; then it runs once."""
    return entrant.name == "hybrid" and not entrant.refine and entrant.settings_on(scenario) == {"tolerance": None}


def seeds_of(scenario: AnyScenario | None, entrant: Entrant, seeds: Sequence[int]) -> Sequence[int | None]:
    """
    List the seeds of an entrant: `None`, the one that the user or the scenario set, or those of the comparison.

    For a mission, which has no settings of solvers, the scenario is None.
    """
    if not entrant.is_available or not registry.traits(entrant.name).seeded:
        return [None]
    settings = entrant.settings_on(scenario)
    return [settings["seed"]] if "seed" in settings else seeds


def run_of(
    scenario: AnyScenario,
    entrant: Entrant,
    seed: int | None,
    solution: Solution,
    certificate: Certificate | None,
    **how: Any,  # noqa: ANN401 - more fields of a run
) -> Run:
    """Make a run of an answer and the certificate of its scenario."""
    settings = entrant.settings_on(scenario) if entrant.is_available else {}
    settings.pop("seed", None)
    answer = bounded(solution, certificate)
    known = math.inf if certificate is None else certificate.upper_bound
    if isinstance(scenario, GraphScenario) and answer.status is Status.NO_PATH and known < math.inf:
        message = f"the solver says that there is no path, and there is one that costs {known:.9g}"
        answer = dataclasses.replace(answer, status=Status.FAILED, message=message)
    names = (scenario, entrant.label, seed, entrant.is_exact)
    return Run(*names, solution=answer, certificate=certificate, settings=settings, **how)


def certify(scenario: AnyScenario, tolerance: float, known: Solution | None = None) -> Certificate:
    """
    Bound the cost of every path from below; an error gives a certificate without a bound that states the reason.

    The proof uses the path `known` of the hybrid solver, or finds one; the time of either counts. On a graph, the bound
    is the least cost (see `certify_on_graph`).
    """
    began = time.perf_counter()
    try:
        if isinstance(scenario, GraphScenario):
            return certify_on_graph(scenario.problem, tolerance)
        if known is not None and known.status.has_path:
            best = known
            began -= known.seconds
        else:
            best = solve(scenario.problem, Hybrid(tolerance=None))
        path = best.path if best.status.has_path else None
        proof = prove(scenario.problem, path, tolerance=tolerance)
        return dataclasses.replace(proof, seconds=time.perf_counter() - began)
    except Exception as error:
        if failure_by(error).is_environment:
            raise
        return no_certificate(tolerance, reason(error), time.perf_counter() - began)


def no_certificate(tolerance: float, why: str, seconds: float) -> Certificate:
    """Return a certificate without a bound that states the reason."""
    return Certificate(
        lower_bound=math.nan,
        upper_bound=math.inf,
        tolerance=tolerance,
        spacing=math.nan,
        cells=0,
        message=why,
        seconds=seconds,
    )


def reason(error: BaseException) -> str:
    """Return the first line of an exception's message, after its type's name unless it is one of our errors."""
    text = one_line(error)
    return text.partition(": ")[2] or text if isinstance(error, CglaError) else text


@dataclass(eq=False)
class SharedGraph:
    """A scenario and the graph that its graph solvers share, built on first use."""

    scenario: AnyScenario
    graph_problem: GraphProblem | None = None
    build_seconds: float = 0.0

    @classmethod
    def lay(cls, scenario: AnyScenario, before: "SharedGraph | None") -> "SharedGraph":
        """Start a scenario; rows of one grid map reuse the graph of the row before, and pairs share their graph."""
        if isinstance(scenario, GraphScenario):
            graph, seconds = held(scenario.problem.graph)
            return cls(scenario, dataclasses.replace(scenario.problem, graph=graph), seconds)
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
        """Return the shared graph with its weights."""
        if self.graph_problem is None:
            began = time.perf_counter()
            scenario = cast("Scenario", self.scenario)
            self.graph_problem = hold_affordable_weights(scenario.problem.on_lattice(scenario.lattice))
            self.build_seconds = time.perf_counter() - began
        return self.graph_problem


def run(ground: SharedGraph, entrant: Entrant, seed: int | None) -> Solution:
    """Run one solver (errors as in `answer_of`)."""
    scenario = ground.scenario

    def answer() -> Solution:
        settings = entrant.settings_on(scenario) | ({} if seed is None else {"seed": seed})
        if isinstance(scenario, GraphScenario):
            solution = _solve(ground.graph(), entrant, settings)
        elif registry.traits(entrant.name).domain == "plane":
            return _solve(scenario.problem, entrant, settings, resolution=scenario.lattice)
        else:
            solution = _solve(scenario.problem, entrant, settings, on=ground.graph())
        return dataclasses.replace(solution, build_seconds=ground.build_seconds + solution.build_seconds)

    return answer_of(entrant, answer)


def answer_of(entrant: Entrant, answer: Callable[[], Solution]) -> Solution:
    """Return what a call of a solver returns; a missing package or an exception becomes an answer, too."""
    try:
        missing = registry.missing(entrant.name)
        return Solution(Status.UNAVAILABLE, solver=entrant.name, message=missing) if missing else answer()
    except BaseException as error:
        # (in a worker, Ctrl-C is the solver's own)
        if not (isinstance(error, Exception | SystemExit) or is_expendable()):
            raise
        return Solution(status_by(error), solver=entrant.name, message=reason(error))


def status_by(error: BaseException) -> Status:
    """
    Return the status of a run that an exception ended.

    Examples
    --------
    >>> status_by(MemoryError()).label, status_by(ModuleNotFoundError()).label, status_by(ValueError()).label
    ('out-of-memory', 'unavailable', 'failed')
    """
    return STATUS_OF[failure_by(error)]


def _solve(problem: Problem | GraphProblem, entrant: Entrant, settings: dict[str, Any], **how: Any) -> Solution:  # noqa: ANN401 - as `solve`
    solver, isolated = registry.get(entrant.name, **settings), not registry.is_built_in(entrant.name)
    return solve(problem, solver, refine=entrant.refine, isolated=isolated, **how)


def kind_of(scenario: AnyScenario) -> MapKind:
    """Return the kind of map of a scenario, for the kernels that its runs need."""
    problem = scenario.problem
    return MapKind.of(problem.graph.model if isinstance(problem, GraphProblem) else problem.model)


def most_nodes(scenario: AnyScenario) -> int:
    """Return how many nodes the graph of a scenario has at most."""
    if isinstance(scenario, GraphScenario):
        return scenario.problem.graph.n_nodes
    # start and goal may be two more nodes
    return scenario.lattice.n_points + 2


def warm_up(entrants: Iterable[Entrant], kind: MapKind, n_nodes: int = 0) -> None:
    """
    Load compiled kernels and the solvers' packages, so that no run is charged for loading.

    `kind` is the kind of map, `n_nodes` the size of the largest lattice to plan on.
    """
    for entrant in entrants:
        # the solver's own run reports its faults
        with suppress(Exception):
            for package in registry.traits(entrant.name).needs:
                importlib.import_module(package)
            solver = registry.get(entrant.name, **entrant.settings_on(None))
            warm_up_solver(solver, kind, refine=entrant.refine)
            warm_up_restricted(solver, n_nodes, kind)


def warm_up_on_graph(entrants: Iterable[Entrant], graph: GeometricGraph) -> None:
    """Run the solvers of this package, and the search of proofs, on two nodes joined by an edge of the same kind."""
    weights = scipy.sparse.csr_array([[0.0, 1.0], [1.0, 0.0]])
    small = GeometricGraph.from_sparse(weights, directed=graph.directed)
    if not graph.is_sparse:
        small = GeometricGraph.from_matrix(weights.toarray())
    problem = GraphProblem(small, 0, 1)
    certify_on_graph(problem, 1.0)
    for entrant in entrants:
        # the solver's own run reports its faults
        with suppress(Exception):
            if entrant.is_built_in and entrant.is_available:
                registry.get(entrant.name, **entrant.settings_on(None)).solve(problem)  # type: ignore[arg-type]


def warm_up_proof(kind: MapKind) -> None:
    """Load the kernels of proofs, so that the first certificate's time is that of its own proof."""
    # the certificate of the first scenario reports faults
    with suppress(Exception):
        warm_up_solver(Hybrid(tolerance=None), kind)
        load_kernels(kind)
