"""Bounds of uncertain risk, corridors, fronts and many questions hold against paths of solvers on random problems."""

import math
import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from random_problems import Rng, places, problem_of
from strategies import a_part_of
from test_certificate import some_paths
from test_corridor import check_corridor

import cgla_graph as cg
from cgla_graph.certificate import certificate
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.solvers.uncertain.outlook import UncertainSolution

#: How many random problems for each part: CGLA_PROBLEMS=1000 takes hours.
NUMBER = int(os.environ.get("CGLA_PROBLEMS", "13"))
#: Costs are rounded by less than this part; proofs have fewer cells, and coarser gaps.
ROUNDING, CELLS, TOLERANCE = 1e-12, 20_000, 0.1


def moved(field: cg.RiskField, size: float, rng: Rng) -> cg.RiskField:
    """Draw the risk of another day: threats elsewhere, rasters upside down."""
    threats = [
        cg.Threat(*(rng.uniform(-0.2, 0.2, 2) * size + (one.x, one.y)), one.spread, one.peak * rng.uniform(0.1, 1.0))
        for one in field.threats
    ]
    turned = [cg.RasterRisk(one.values[::-1], one.bounds, interpolation=one.interpolation) for one in field.rasters]
    return cg.RiskField(threats, rasters=turned)


def check_uncertain(problem: cg.Problem, seed: int, *, scale: float = 1.0) -> int:
    """Hold the bound of an objective, times `scale`, against paths that are good in a scenario or under weights."""
    rng = np.random.default_rng([1, seed])
    size = max(np.subtract(problem.bounds[2:], problem.bounds[:2]))
    scenarios = [problem.field, *(moved(problem.field, size, rng) for _ in range(int(rng.integers(1, 5))))]
    field = cg.UncertainField(scenarios, rng.dirichlet(np.ones(len(scenarios))))
    objective = ["expected", "cvar", "worst"][seed % 3]
    alpha = float(rng.uniform(0.3, 0.95)) if objective == "cvar" else None
    found = cg.solve(replace(problem, field=field), objective=objective, alpha=alpha, tolerance=TOLERANCE)
    assert isinstance(found, UncertainSolution)
    tail = TailMean(field.probabilities, found.alpha)
    weights = [np.eye(len(scenarios))[n] for n in range(len(scenarios))]
    weights += [found.weights] if len(found.weights) else []
    paths = [path for one in weights for path in some_paths(replace(problem, field=field.weighted(one)), rng)]
    costs = [tail.of(field.costs(problem, path)) for path in paths]
    costs += [found.cost] if found.status.has_path else []
    assert not scale * found.lower_bound > min(costs, default=math.inf) * (1.0 + ROUNDING)
    return len(costs)


def check_front(problem: cg.Problem, seed: int, *, scale: float = 1.0) -> int:
    """Hold bounds under all weights and budgets, times `scale`, against paths under some weights."""
    rng = np.random.default_rng([2, seed])
    weights = np.append(10.0 ** rng.uniform(-2.0, 2.0, 2), 0.0)
    paths = [path for k in weights.tolist() for path in some_paths(replace(problem, k=k), rng)]
    judged = [problem.evaluate(path) for path in paths]
    budgets = [float(rng.choice([one.risk for one in judged]))] if judged else []
    budgets = [budget for budget in budgets if budget > 0.0]
    front = cg.pareto(problem, proven=True, tolerance=TOLERANCE, k_max=100.0, budgets=budgets)
    for one in judged:
        for k in weights.tolist():
            assert scale * front.lower_bound(k) <= (one.length + k * one.risk) * (1.0 + ROUNDING)
        for within in front.budgets:
            assert one.risk > within.budget or scale * within.lower_bound <= one.length * (1.0 + ROUNDING)
    return len(judged) * len(weights)


def check_questions(problem: cg.Problem, seed: int, *, scale: float = 1.0) -> int:
    """Hold bounds of starts with one goal, and of pairs, times `scale`, against paths."""
    rng = np.random.default_rng([3, seed])
    base, count = cg.Map(problem), 0
    for answers in (
        base.solve(places(problem, 5, rng), tolerance=TOLERANCE),
        base.solve(places(problem, 8, rng), places(problem, 8, rng), tolerance=TOLERANCE),
    ):
        for start, goal, one in zip(answers.starts.tolist(), answers.goals.tolist(), answers, strict=True):
            asked = replace(problem, start=tuple(start), goal=tuple(goal))
            paths = some_paths(asked, rng) + ([one.path] if one.status.has_path else [])
            for path in paths:
                judged = asked.evaluate(path)
                assert judged.feasible
                assert not scale * one.lower_bound > judged.cost * (1.0 + ROUNDING)
            count += len(paths)
    return count


#: The parts; a check returns how many comparisons it made.
PARTS: dict[str, Callable[..., int]] = {
    "uncertain risk": check_uncertain,
    "corridor": check_corridor,
    "all weights": check_front,
    "many questions": check_questions,
}


@pytest.fixture(autouse=True)
def _coarse(monkeypatch: pytest.MonkeyPatch) -> None:
    coarse(monkeypatch.setattr)


def coarse(set_to: Callable[[Any, str, Any], None]) -> None:
    """Keep the grids of all proofs coarse."""
    proven = certificate._proven

    def on_few_cells(problem: cg.Problem, tolerance: float, path: Any, cells: int, **more: Any) -> Any:  # noqa: ANN401
        return proven(problem, tolerance, path, min(cells, CELLS), **more)

    set_to(certificate, "_proven", on_few_cells)


@pytest.mark.slow
@pytest.mark.parametrize("number", a_part_of(range(NUMBER)))
@pytest.mark.parametrize("part", PARTS)
def test_no_path_is_below_a_bound(part: str, number: int) -> None:
    PARTS[part](problem_of(number), number)


@pytest.mark.parametrize("part", [name for name in PARTS if name != "corridor"])
def test_bounds_that_are_too_high_are_caught(part: str) -> None:
    with pytest.raises(AssertionError):
        PARTS[part](problem_of(0), 0, scale=1.2)
