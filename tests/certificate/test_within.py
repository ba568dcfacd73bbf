"""Bounds of all paths within a budget: against paths of lattices, refined and mixed ones, and with a part left out."""

import dataclasses
import math
from collections.abc import Iterator

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph._types import FloatArray
from cgla_graph.certificate import within
from cgla_graph.certificate.within import cut_within
from cgla_graph.refine.refine import refine_path
from cgla_graph.testing import strategies as drawn

#: Two ways around a threat: the upper one is shorter and has a threat of its own.
TWO_WAYS = cg.Problem(
    (0.1, 0.5), (0.9, 0.5),
    cg.RiskField([cg.Threat(0.5, 0.72, 0.05, 0.5)]), no_fly=shapely.box(0.4, 0.25, 0.6, 0.68),
)  # fmt: skip


@pytest.fixture(autouse=True)
def _few_weights(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(within, "TIMES", (1.0,))
    monkeypatch.setattr(within, "MOST_WEIGHTS", (3,))


def some_paths(problem: cg.Problem, seed: int) -> Iterator[FloatArray]:
    """Yield feasible paths: of several weights, refined random ones, and mixes of two."""
    draws = np.random.default_rng(seed)
    found = [
        cg.solve(dataclasses.replace(problem, k=k), "hybrid", tolerance=None).path for k in (0.0, 1.0, 5.0, 20.0, 100.0)
    ]
    for _ in range(5):
        middle = draws.uniform(0.0, 1.0, (2, 2))
        path = np.vstack([problem.start, middle[np.argsort(middle[:, 0])], problem.goal])
        found += [
            path,
            refine_path(dataclasses.replace(problem, k=draws.uniform(0.0, 50.0)), path, tolerance=1e-4).path,
        ]
    shares = np.linspace(0.0, 1.0, 40)
    for _ in range(40):
        one, other = (found[i] for i in draws.integers(0, len(found), 2))
        share = draws.uniform()
        found.append(share * along(one, shares) + (1.0 - share) * along(other, shares))
    for path in found:
        path[0], path[-1] = problem.start, problem.goal
        if problem.evaluate(path).feasible:
            yield path


def along(path: FloatArray, shares: FloatArray) -> FloatArray:
    """Return points at shares of the length of a path."""
    at = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    return np.column_stack([np.interp(shares * at[-1], at, axis) for axis in path.T])


@given(drawn.fields(1, 3), st.booleans(), st.sampled_from(["risk", "length"]), st.floats(0.1, 0.9), st.integers(0, 99))
@examples(8)
def test_no_path_within_a_budget_is_below_the_cut(
    field: cg.RiskField, wall: bool, limited: str, share: float, seed: int
) -> None:
    area = shapely.box(0.45, 0.2, 0.55, 0.6) if wall else None
    problem = cg.Problem((0.05, 0.4), (0.95, 0.55), field, no_fly=area)
    judged = [problem.evaluate(path) for path in some_paths(problem, seed)]
    uses = [one.risk if limited == "risk" else one.length for one in judged]
    budget = min(uses) + share * (max(uses) - min(uses))
    if limited == "risk":
        # brute force over a lattice
        plan = cg.plan_within_risk(problem, budget, solver="cgla", resolution=7, tolerance=None)
    else:
        plan = cg.plan_within_length(problem, budget, solver="cgla", resolution=7, tolerance=None)
    values = [
        one.length if limited == "risk" else one.risk for one, use in zip(judged, uses, strict=True) if use <= budget
    ]
    if plan.status.has_path:
        values.append(plan.solution.length if limited == "risk" else plan.solution.risk)
    best = min(values)
    if best > 0.0:
        found = cut_within(problem, limited, budget, 1.5 * best, 2.0, [], tolerance=0.01)  # type: ignore[arg-type]
        assert found.lower_bound <= best * (1.0 + 1e-9)


@pytest.mark.slow
def test_the_cut_closes_the_gap_between_two_ways() -> None:
    upper, lower = (cg.solve(dataclasses.replace(TWO_WAYS, k=k), tolerance=None) for k in (0.0, 1e3))
    assert upper.path[:, 1].max() > 0.6
    assert lower.path[:, 1].min() < 0.4
    budget = 0.5 * (upper.risk + lower.risk)
    plan = cg.plan_within_risk(TWO_WAYS, budget, resolution=6, tolerance=0.02)
    assert plan.dual_bound < plan.lower_bound == plan.cut_bound <= plan.solution.length
    assert plan.gap < 0.5 * plan.duality_gap
    assert plan.document()["lower_bound"] == plan.cut_bound
    # the upper way keeps its own risk, and a bound that leaves out what this risk is worth is above its length
    tight, broken = (
        cut_within(TWO_WAYS, "risk", risk, 2.0, plan.k, [], tolerance=0.02).lower_bound for risk in (upper.risk, 0.0)
    )
    assert tight <= upper.length < broken


@pytest.mark.slow
def test_a_cut_within_a_length() -> None:
    plan = cg.plan_within_length(TWO_WAYS, 0.92, resolution=6, tolerance=0.05)
    assert plan.lower_bound <= plan.solution.risk
    assert plan.gap <= plan.duality_gap
    found = cut_within(TWO_WAYS, "length", 0.92, 2.0 * plan.solution.risk, max(plan.k, 1.0), [], tolerance=0.05)
    assert found.lower_bound <= plan.solution.risk


def test_no_cut_without_a_tolerance_or_on_a_lattice() -> None:
    for how in ({"tolerance": None}, {"solver": "cgla", "resolution": 6}):
        plan = cg.plan_within_risk(TWO_WAYS, 0.02, **how)
        assert math.isnan(plan.cut_bound)
        assert plan.lower_bound == plan.dual_bound
