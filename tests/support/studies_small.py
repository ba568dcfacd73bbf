"""Small studies in folders: answers are made up, so that nothing has to be solved."""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from cgla_graph.certificate.certificate import Certificate
from cgla_graph.comparisons.study.entrant import Entrant
from cgla_graph.comparisons.study.runner import Run, run_of
from cgla_graph.comparisons.study.store import PROOF, RUN, Stored, StudyStore, load
from cgla_graph.comparisons.study.study import Study
from cgla_graph.model.solution import Solution, Status
from cgla_graph.scenarios.scenario import Scenario, scenario_from_toml

TEXT = "start = [0.1, 0.1]\ngoal = [0.9, 0.9]\nk = 5.0\n[lattice]\nresolution = 3\n"
BOUND = 1.0
#: Answers a cell: name of the scenario, number of the solver, seed.
Answers = Callable[[str, int, int | None], Solution]


def found(cost: float, seconds: float = 0.5) -> Solution:
    """Return a path of that cost."""
    path = np.array([(0.1, 0.1), (0.9, 0.9)])
    return Solution(Status.FOUND, path=path, cost=cost, length=cost, risk=0.0, seconds=seconds, solver="x")


def by_number(scenario: str, solver: int, seed: int | None) -> Solution:
    """Make the first solver the cheapest everywhere, and so on."""
    del scenario
    return found(1.1 + 0.1 * solver + 0.01 * (seed or 0))


def named(name: str) -> Scenario:
    """Return a scenario of that name."""
    return scenario_from_toml(TEXT, name)


def proof_of(bound: float, upper: float = math.inf) -> Certificate | None:
    """Return a certificate of a lower bound; None for NaN."""
    return None if math.isnan(bound) else Certificate(bound, upper, 0.1, 0.01, 9, "the reason", 0.1)


def small_study(names: Sequence[str], labels: Sequence[str], seeds: Sequence[int] = (1, 2), title: str = "") -> Study:
    """Return a study; each label is that of `prm-star`, which draws random numbers, or else of `straight-line`."""
    entrants = [
        Entrant(
            label,
            "prm-star" if label.startswith("prm") else "straight-line",
            {"milestones": 50} if label.startswith("prm") else {},
        )
        for label in labels
    ]
    return Study([named(name) for name in names], entrants, seeds, 0.1, title=title)


def runs_of(study: Study, answers: Answers = by_number) -> list[Run]:
    """Make up the runs of a study."""
    proof = proof_of(BOUND, 1.05)
    scenarios = {scenario.name: scenario for scenario in study.scenarios}
    entrants = {one.label: (number, one) for number, one in enumerate(study.entrants)}
    runs = []
    for cell in study.cells():
        number, entrant = entrants[cell.solver]
        solution = answers(cell.scenario, number, cell.seed)
        runs.append(run_of(scenarios[cell.scenario], entrant, cell.seed, solution, proof, megabytes=1.5, host="here"))
    return runs


def add_run(store: StudyStore, run: Run) -> Run:
    """Add a run to the store of a study."""
    added: Run = store.add((RUN, run.scenario.name, run.solver, run.seed), run)
    return added


def write_study(folder: Path, study: Study, answers: Answers = by_number, first: int | None = None) -> Stored:
    """Write the first runs of a study (None: all) into a folder."""
    with StudyStore.create(folder, study, command="cgla compare") as store:
        for scenario in study.scenarios:
            store.add((PROOF, scenario.name), runs_of(study)[0].certificate)
        for run in runs_of(study, answers)[:first]:
            add_run(store, run)
    return load(folder)
