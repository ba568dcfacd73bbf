"""
Runs of a study as tasks: the proof of each scenario's bound, then its runs, each in a worker within limits.

The first half makes tasks and turns the workers' answers into results; the second half runs in the workers.
"""

import dataclasses
import hashlib
import math
import pickle
import socket
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing, suppress
from functools import lru_cache
from typing import Any, NamedTuple

import numpy as np

from cgla_graph._progress import waiting
from cgla_graph._text import remark
from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study import runner
from cgla_graph.comparisons.study.documents import SOLUTION_NUMBERS
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.metric import Metric, measures
from cgla_graph.comparisons.study.runner import Run
from cgla_graph.comparisons.study.store import PROOF, RUN
from cgla_graph.comparisons.study.study import Cell, Study
from cgla_graph.comparisons.workers.tasks import Results, ResultStore, Task, run_tasks
from cgla_graph.errors import WorkerError
from cgla_graph.isolation.limits import Limits, limited
from cgla_graph.isolation.outcome import Failure, Outcome
from cgla_graph.isolation.worker import use_up
from cgla_graph.model.cost_model import MapKind
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.isolated import lost
from cgla_graph.model.problem import FULL_UP_TO, GraphProblem
from cgla_graph.model.solution import Solution, Status, TracePoint
from cgla_graph.scenarios.graphs.graph_scenario import AnyScenario, GraphScenario

#: The least limits of a proof: it belongs to no solver, and gets time and memory also where runs have little.
PROOF_LIMITS = Limits()
#: Modules that workers load before the first task.
PRELOAD = (__name__,)
#: Kernels that are warm in this process: of entrants by label, for small lattices and for large ones, on a kind of map;
#: and of proofs (None).
_ready: set[tuple[str, bool, MapKind] | tuple[None, MapKind]] = set()
#: The same on graphs: labels of entrants, and whether the graph is sparse and directed.
_ready_on_graphs: set[tuple[object, ...]] = set()
#: Scenarios and graphs that were sent to this process, by their keys, and how many of them are kept.
_unpacked: dict[str, AnyScenario] = {}
_graphs: dict[str, GeometricGraph] = {}
_MOST_KEPT = 4
#: The scenario of the last run in this process, by its key.
_last: dict[str, runner.SharedGraph] = {}


def run_study(
    study: Study, *, store: ResultStore | None = None, workers: int = 1, scheduler: str | None = None
) -> Generator[Run]:
    """
    Make the runs of a study that are not in its store yet.

    The lower bound of a scenario is proven before its runs begin, so that each run has a gap.

    Parameters
    ----------
    study
        The study.
    store
        Keeps runs as they end, and knows finished ones; None keeps nothing.
    workers
        Number of worker processes; 0 makes runs in this process, where a solver that hangs or crashes stops the whole
        study (for debugging).
    scheduler
        Address of a Dask scheduler whose cluster makes the runs instead.

    Yields
    ------
    run
        As soon as it is done: with several workers, in no fixed order; from one that claims a bound on, at the end,
        when all paths that may refute it are known. A solver that hangs, takes too much memory, crashes or raises gives
        a run that says so.

    Raises
    ------
    OutputError
        If the store cannot be written.
    WorkerError
        If workers do not start, or the cluster cannot be reached; at the end, if runs could not be made (see
        `cgla_graph.comparisons.workers.tasks.run_tasks`).

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> study = Study([load_scenario("one-threat")], [Entrant.parse("cgla")], tolerance=None)
    >>> [(run.solver, run.solution.status.label) for run in run_study(study, workers=0)]
    [('cgla', 'optimal')]
    """
    how: dict[str, Any] = {"limits": study.limits, "workers": workers, "scheduler": scheduler, "preload": PRELOAD}
    how["solvers"] = solvers_of(study)
    tasks = study_tasks(study, store)
    with closing(run_tasks(tasks, store, **how)) as results:
        runs = (result for _, result in waiting("study", results, len(tasks)) if isinstance(result, Run))
        yield from runner.with_claims_settled(runs)


def solvers_of(study: Study) -> list[str]:
    """
    List the names of the solvers that runs and flights of a study need: its own that can run here, and their bases.

    Examples
    --------
    >>> solvers_of(Study([], [Entrant.parse("refine:base='dijkstra'")]))
    ['hybrid', 'refine', 'dijkstra']
    """
    entrants = [entrant for entrant in (*study.entrants, *study.mission_entrants) if entrant.is_available]
    named = [name for one in entrants for name in (one.name, one.settings.get("base")) if isinstance(name, str)]
    # (hybrid finds the path that a proof begins with)
    return list(dict.fromkeys(["hybrid", *named]))


def study_tasks(study: Study, store: ResultStore | None = None) -> list[Task]:
    """List the proofs and runs of a study that are not in its store yet, scenario by scenario."""
    scenarios = {scenario.name: scenario for scenario in study.scenarios}
    entrants = {entrant.label: entrant for entrant in study.entrants}
    tasks: dict[tuple[Any, ...], Task] = {}
    # packed on use: memory never holds all scenarios packed
    packed: Callable[[str], Packed] = lru_cache(maxsize=4)(lambda name: pack(scenarios[name]))
    for cell in study.cells():
        if store is not None and (RUN, *cell) in store:
            continue
        proof = [] if study.tolerance is None else [(PROOF, cell.scenario)]
        for key in proof:
            tasks.setdefault(key, _proof_task(cell.scenario, packed, study.tolerance or 0.0))
        tasks[RUN, *cell] = _run_task(
            cell, scenarios[cell.scenario], entrants[cell.solver], packed, proof, study.metrics
        )
    return list(tasks.values())


def _proof_task(name: str, packed: Callable[[str], "Packed"], tolerance: float) -> Task:
    def certificate(outcome: Outcome, limits: Limits, _: Results) -> Certificate:
        """Return a scenario's proof, or a certificate that says why there is none."""
        check_made(outcome)
        if outcome.failure is None:
            proof: Certificate = outcome.value
            return proof
        return runner.no_certificate(tolerance, lost(outcome, limits.at_least(PROOF_LIMITS))[1], 0.0)

    return Task((PROOF, name), prove, lambda _: (packed(name), tolerance, PROOF_LIMITS), certificate)


def _run_task(
    cell: Cell,
    scenario: AnyScenario,
    entrant: Entrant,
    packed: Callable[[str], "Packed"],
    proof: list[tuple[str, str]],
    metrics: Sequence[Metric],
) -> Task:
    def run_of(outcome: Outcome, limits: Limits, done: Results) -> Run:
        """Make a run of a worker's answer."""
        how: dict[str, Any] = {}
        check_made(outcome)
        if outcome.failure is None:
            answer: Answer = outcome.value
            solution = answer.solution
            if solution.status is Status.UNAVAILABLE:
                check_lacking_here(entrant, f"{solution.message} (on {answer.host})")
            if solution.status.has_path and not entrant.is_built_in:
                # a plug-in may have changed the problem that its answer was judged by
                solution = scenario.problem.judge(solution)
            how = {"megabytes": answer.megabytes, "host": answer.host}
        else:
            status, message = lost(outcome, limits)
            # a killed run reports no time: take the limit
            seconds = limits.seconds if outcome.failure is Failure.TIMED_OUT else 0.0
            solution = Solution(status, solver=entrant.name, message=message, seconds=seconds)
        how["measures"], note = measures(metrics, solution, scenario.problem)
        if note:
            solution = dataclasses.replace(solution, message="; ".join(filter(None, [solution.message, note])))
        return runner.run_of(scenario, entrant, cell.seed, solution, next(iter(done.values()), None), **how)

    return Task((RUN, *cell), run, lambda _: (packed(cell.scenario), entrant, cell.seed), run_of, proof)


def check_made(outcome: Outcome) -> None:
    """
    Refuse an outcome that is not a solver's: what solvers raise is an answer, so all other exceptions are not theirs.

    Raises
    ------
    WorkerError
        With the exception that the call raised.

    Examples
    --------
    >>> check_made(Outcome(failure=Failure.CRASHED))
    """
    if outcome.failure in {Failure.RAISED, Failure.OUT_OF_MEMORY}:
        raise WorkerError(outcome.message)


def check_lacking_here(entrant: Entrant, message: str) -> None:
    """
    Refuse a worker's answer that a solver cannot run there, unless it cannot run here either.

    Raises
    ------
    WorkerError
        With the worker's reason.
    """
    if entrant.is_available:
        raise WorkerError(message)


class Packed(NamedTuple):
    """
    A pickled scenario, and its digest; pairs of one graph share the pickled graph.

    Attributes
    ----------
    key, data
        Of the scenario, of a pair of nodes without its graph.
    graph_key, graph
        Of the graph of a pair; empty for a map.
    """

    key: str
    data: bytes
    graph_key: str = ""
    graph: bytes = b""


def pack(scenario: AnyScenario) -> Packed:
    """
    Pickle a scenario for workers.

    Examples
    --------
    >>> from cgla_graph.scenarios.scenario import load_scenario
    >>> unpacked(pack(load_scenario("paper"))).name
    'paper'
    """
    if isinstance(scenario, GraphScenario):
        key, graph = _packed_graph(scenario.problem.graph)
        ends = scenario.problem.source, scenario.problem.target
        data = pickle.dumps((scenario.name, scenario.title, dict(scenario.settings), scenario.graph_name, ends))
        return Packed(hashlib.sha256(key.encode() + data).hexdigest(), data, key, graph)
    data = pickle.dumps(scenario)
    return Packed(hashlib.sha256(data).hexdigest(), data)


@lru_cache(maxsize=2)
def _packed_graph(graph: GeometricGraph) -> tuple[str, bytes]:
    """Pickle a graph once for all its pairs."""
    data = pickle.dumps(graph)
    return hashlib.sha256(data).hexdigest(), data


# ---- in a worker ----


class Answer(NamedTuple):
    """A run's answer as plain numbers, its peak memory and its machine."""

    solution: Solution
    megabytes: float
    host: str


def unpacked(packed: Packed) -> AnyScenario:
    """Return the scenario; the same object for the same data, so that its cached results are reused."""
    if packed.key not in _unpacked:
        scenario: AnyScenario
        if packed.graph_key:
            name, title, settings, graph_name, ends = _loaded(packed.data)
            problem = GraphProblem(_graph(packed), *ends)
            scenario = GraphScenario(name, problem, title, settings, graph_name=graph_name)
        else:
            scenario = _loaded(packed.data)
        _keep(_unpacked, packed.key, scenario)
    return _unpacked[packed.key]


def _graph(packed: Packed) -> GeometricGraph:
    if packed.graph_key not in _graphs:
        _keep(_graphs, packed.graph_key, _loaded(packed.graph))
    return _graphs[packed.graph_key]


def _loaded(data: bytes) -> Any:  # noqa: ANN401 - a scenario, or a graph
    return pickle.loads(data)  # noqa: S301 - from the process that started this one


def _keep(kept: dict[str, Any], key: str, value: object) -> None:
    """Keep a few values, the newest ones."""
    while len(kept) >= _MOST_KEPT:
        del kept[next(iter(kept))]
    kept[key] = value


def prove(packed: Packed, tolerance: float, least: Limits, limits: Limits) -> Certificate:
    """Bound the cost of a scenario's paths; a proof that reaches a limit gives no bound, but the reason."""
    scenario, limits = unpacked(packed), limits.at_least(least)
    kind = runner.kind_of(scenario)
    if isinstance(scenario, GraphScenario):
        _warm_up_on_graph([], scenario)
    elif (None, kind) not in _ready:
        runner.warm_up_proof(kind)
        _ready.add((None, kind))
    with limited(limits.seconds, limits.megabytes):
        proof = runner.certify(scenario, tolerance)
    # its grids are for pictures of one proof
    return dataclasses.replace(proof, grids=())


def run(packed: Packed, entrant: Entrant, seed: int | None, limits: Limits) -> Answer:
    """
    Make one run.

    A process that ran a plug-in makes no further run: the plug-in may have changed the process and its problem.
    """
    ground = _shared_graph(packed)
    if not entrant.is_built_in:
        use_up()
        for kept in (_last, _unpacked, _graphs):
            kept.clear()
    n_nodes, kind = runner.most_nodes(ground.scenario), runner.kind_of(ground.scenario)
    if (entrant.label, n_nodes > FULL_UP_TO, kind) not in _ready:
        runner.warm_up([entrant], kind, n_nodes)
        _ready.add((entrant.label, n_nodes > FULL_UP_TO, kind))
    on_graph = isinstance(ground.scenario, GraphScenario)
    if isinstance(ground.scenario, GraphScenario):
        _warm_up_on_graph([entrant], ground.scenario)
    with limited(limits.seconds, limits.megabytes) as usage:
        solution = runner.answer_of(entrant, lambda: plain(runner.run(ground, entrant, seed), on_graph=on_graph))
    if solution.status is Status.OUT_OF_MEMORY:
        solution = dataclasses.replace(solution, message=limits.spent_memory(solution.message))
    return Answer(solution, usage.megabytes, socket.gethostname())


def _warm_up_on_graph(entrants: Sequence[Entrant], scenario: GraphScenario) -> None:
    """Warm up on a graph of this kind, once in a process."""
    graph = scenario.problem.graph
    key = (*(one.label for one in entrants), graph.is_sparse, graph.directed)
    if key not in _ready_on_graphs:
        runner.warm_up_on_graph(entrants, graph)
        _ready_on_graphs.add(key)


def _shared_graph(packed: Packed) -> runner.SharedGraph:
    """Return a scenario with its graph, which runs on the same scenario in a row share."""
    ground = _last.get(packed.key)
    if ground is None:
        ground = runner.SharedGraph.lay(unpacked(packed), next(iter(_last.values()), None))
        _last.clear()
        _last[packed.key] = ground
    return ground


def plain(solution: Solution, *, on_graph: bool = False) -> Solution:
    r"""
    Copy an answer as plain numbers and text, with its nodes only `on_graph`, where the judge has checked them.

    Values that are no numbers become NaN (counts: 0), because a solver may answer anything.

    Raises
    ------
    ValueError, TypeError
        If its status is none, or its path has no coordinates.

    Examples
    --------
    >>> plain(Solution(Status.FOUND, cost="dear", message="a\nb")).message
    'a b'
    """
    numbers: dict[str, Any] = {name: _number(getattr(solution, name)) for name in SOLUTION_NUMBERS}
    return Solution(
        status=Status(solution.status),
        path=np.array(solution.path, dtype=np.float64).reshape(-1, 2),
        nodes=tuple(solution.nodes) if on_graph else (),
        solver=str(solution.solver),
        evaluations=_count(solution.evaluations),
        trace=tuple(_trace(solution.trace)),
        message=remark(solution.message),
        **numbers,
    )


def _trace(points: Iterable[TracePoint]) -> Iterable[TracePoint]:
    return (TracePoint(_number(one.seconds), _count(one.evaluations), _number(one.cost)) for one in points)


def _number(value: Any) -> float:  # noqa: ANN401 - any answer of a solver
    with suppress(TypeError, ValueError, OverflowError):
        return float(value)
    return math.nan


def _count(value: Any) -> int:  # noqa: ANN401 - any answer of a solver
    with suppress(TypeError, ValueError, OverflowError):
        # the range of whole numbers in databases
        return min(max(int(value), 0), 2**63 - 1)
    return 0
