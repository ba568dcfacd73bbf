"""Fronts of risk and length, and paths within a budget: against all paths of small lattices, tried one by one."""

import dataclasses
import functools
import itertools
import math
from typing import Any, ClassVar, cast

import numpy as np
import pytest
import shapely
import strategies as own
from hypothesis import assume, given
from hypothesis import strategies as st
from quick_solvers import WALLED_IN

import cgla_graph as cg
from cgla_graph._types import FloatArray, IntArray
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.model.solution import NEGATIVE_WEIGHTS
from cgla_graph.model.solver import Solver, Traits
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers.trade_off.front import Front, lower_hull
from cgla_graph.solvers.trade_off.label_search import constrained_path
from cgla_graph.solvers.trade_off.plan_within import PlanWithin
from cgla_graph.solvers.trade_off.reweighing import Reweighed
from cgla_graph.testing import strategies as drawn

#: Up to rounding of line integrals on maps of unit size.
NEAR = 1e-9


@st.composite
def maps(draw: st.DrawFn, *, walls: bool = True) -> cg.Problem:
    """Draw a map of the unit square, with a thin wall on some, its ends in opposite corners of any lattice."""
    # threats fainter than the error of line integrals would decide between paths by chance
    field = cg.RiskField([threat for threat in draw(drawn.fields(1, 3)).threats if threat.peak > 1e-6])
    no_fly = None
    if walls and draw(st.booleans()):
        low = draw(st.sampled_from([0.0, 0.3]))
        no_fly = shapely.box(0.4, low, 0.42, low + 0.65)
    return cg.Problem((0.0, 0.0), (1.0, 1.0), field, draw(drawn.risk_weights), no_fly=no_fly)


@functools.cache
def simple_paths(n_nodes: int) -> tuple[IntArray, ...]:
    """List all simple paths from the first node to the last, an array for each number of nodes on the way."""
    inner = range(1, n_nodes - 1)
    return tuple(
        np.array([(0, *middle, n_nodes - 1) for middle in itertools.permutations(inner, size)])
        for size in range(len(inner) + 1)
    )


def every_path(problem: cg.Problem, resolution: tuple[int, int]) -> tuple[FloatArray, FloatArray]:
    """Return risk and length of all simple paths over the lattice that may be flown."""
    points = cg.Lattice(resolution, bounds=problem.bounds).points
    starts, ends = np.broadcast_arrays(points[:, None], points[None, :])
    risks = problem.field.line_integral(starts, ends)
    lengths = np.hypot(*np.moveaxis(ends - starts, -1, 0))
    lengths[problem.model.area.crosses(starts, ends)] = np.inf
    pairs = [(rows[:, :-1], rows[:, 1:]) for rows in simple_paths(len(points))]
    risk, length = (np.concatenate([table[a, b].sum(axis=1) for a, b in pairs]) for table in (risks, lengths))
    return risk[np.isfinite(length)], length[np.isfinite(length)]


small = st.sampled_from([(2, 2), (2, 3), (3, 2), (2, 4)])


def weights_of(front: Front) -> list[float]:
    """Choose weights where fronts are wrong first: at both ends of every range, and between."""
    ends = [point.k_low for point in front] + [front.k_max]
    return [*ends, *((a + b) / 2 for a, b in itertools.pairwise(ends))]


def check_shape(front: Front) -> None:
    """Check the shape of a front: risk falls, length rises, and the ranges of weights join."""
    points = front.points
    assert points[0].k_low == 0.0
    assert points[-1].k_high >= front.k_max
    for a, b in itertools.pairwise(points):
        assert a.risk > b.risk
        assert a.length < b.length
        assert a.k_high == b.k_low
    for point in points:
        assert point.k_low <= point.k <= point.k_high
        assert point.k_low < point.k_high
        assert point.cost == pytest.approx(point.length + point.k * point.risk, rel=NEAR)
        # under its own weights no other point is cheaper
        for k in (point.k_low, point.k, min(point.k_high, front.k_max)):
            least = min(other.length + k * other.risk for other in points)
            assert point.length + k * point.risk <= least * (1 + NEAR)


# The hull


@own.fast
@given(st.lists(st.tuples(st.integers(0, 20), st.integers(1, 20)), min_size=1, max_size=30))
def test_the_hull_of_any_points(points: list[tuple[int, int]]) -> None:
    """It costs as little as all points under every weight, and not one of it can be spared."""
    solved = [
        (float(i), cg.Solution(cg.Status.FOUND, length=length, risk=risk)) for i, (risk, length) in enumerate(points)
    ]
    hull = [(found.risk, found.length) for _, found in lower_hull(solved)]
    slopes = sorted({(c - a) / (b - d) for (b, a), (d, c) in itertools.permutations(points, 2) if b != d})
    weights = [k for k in [0.0, *slopes, *((a + b) / 2 for a, b in itertools.pairwise(slopes)), 1e6] if k >= 0.0]
    for k in weights:
        assert min(length + k * risk for risk, length in hull) == min(length + k * risk for risk, length in points)
    for spare in hull:
        rest = [point for point in hull if point != spare]
        assert not rest or any(spare[1] + k * spare[0] < min(y + k * x for x, y in rest) for k in weights)


def test_a_path_that_is_none_is_not_on_the_hull() -> None:
    found = cg.Solution(cg.Status.FOUND, length=2.0, risk=1.0)
    lost = cg.Solution(cg.Status.INFEASIBLE, length=1.0, risk=0.0)
    assert lower_hull([(0.0, lost), (1.0, found)]) == [(1.0, found)]


# Fronts


@own.usual
@given(maps(), small)
def test_a_front_of_a_lattice_is_complete(problem: cg.Problem, resolution: tuple[int, int]) -> None:
    risk, length = every_path(problem, resolution)
    front = cg.pareto(problem, solver="cgla", resolution=resolution)
    if not len(risk):
        assert (front.status, len(front)) == (cg.Status.NO_PATH, 0)
        return
    assert front.status is cg.Status.OPTIMAL
    check_shape(front)
    assert front.k_max > 0.0 or front.points[0].risk <= 1e-10 * front.points[0].length
    for k in weights_of(front):
        best = (length + k * risk).min()
        # line integrals are exact to 1e-10, which k multiplies
        near = NEAR * best + 1e-10 * k
        assert min(point.length + k * point.risk for point in front) == pytest.approx(best, rel=0, abs=near)
        assert front.at(k).length + k * front.at(k).risk == pytest.approx(best, rel=0, abs=near)
    # of the shortest paths, the one of least risk
    assert front.points[0].risk == pytest.approx(risk[length <= length.min() * (1 + 1e-12)].min(), abs=NEAR)


@own.few
@given(maps(), st.sampled_from(["cgla", "dijkstra"]), st.sampled_from([5, (4, 6)]))
def test_every_point_is_optimal_under_its_weight(
    problem: cg.Problem, solver: str, resolution: int | tuple[int, int]
) -> None:
    front = cg.pareto(problem, solver=solver, resolution=resolution)
    assume(front.points)
    check_shape(front)
    assert front.error <= 1e-12
    for point in front:
        weighted = dataclasses.replace(problem, k=point.k)
        again = cg.solve(weighted, "networkx", resolution=resolution)
        assert point.cost == pytest.approx(again.cost, rel=NEAR)
        assert weighted.judge(point.solution).cost == point.cost


@own.few
@given(maps(), st.sampled_from(["lazy-theta-star", "eight-direction", "straight-line"]))
def test_fronts_of_other_solvers_have_the_same_shape(problem: cg.Problem, solver: str) -> None:
    front = cg.pareto(problem, solver=solver, resolution=7, max_points=12)
    assert front.status in {cg.Status.FOUND, cg.Status.NO_PATH, cg.Status.INFEASIBLE}
    if front.points:
        check_shape(front)
        assert all(problem.evaluate(point.path).feasible for point in front)


@pytest.mark.parametrize("most", [2, 6, 9])
def test_the_error_of_a_front_cut_short_is_a_bound(most: int) -> None:
    scenario = load_scenario("paper")
    whole = cg.pareto(scenario.problem, solver="cgla", resolution=10)
    part = cg.pareto(scenario.problem, solver="cgla", resolution=10, max_points=most)
    # the way to the end of least risk leaves some points
    assert len(part) <= max(most, 7) < len(whole)
    misses = []
    for k in weights_of(whole):
        best, there = whole.at(k), part.at(k)
        cost = there.length + k * there.risk
        misses.append(1.0 - (best.length + k * best.risk) / cost)
    assert 1e-6 < max(misses) <= part.error * (1 + NEAR)


def test_a_tolerance_saves_solves_and_is_kept() -> None:
    problem = load_scenario("paper").problem
    whole = cg.pareto(problem, solver="cgla", resolution=15)
    rough = cg.pareto(problem, solver="cgla", resolution=15, tolerance=0.01)
    assert rough.n_solves < whole.n_solves / 2
    assert 1e-12 < rough.error <= 0.01
    for k in weights_of(whole):
        cost, best = (front.at(k).length + k * front.at(k).risk for front in (rough, whole))
        assert cost <= best / (1.0 - 0.01)


def test_the_greatest_weight_may_be_given() -> None:
    problem = load_scenario("paper").problem
    front = cg.pareto(problem, solver="cgla", resolution=10, k_max=7.0)
    whole = cg.pareto(problem, solver="cgla", resolution=10)
    assert front.k_max == front.points[-1].k_high == 7.0
    expected = [point.length for point in whole if point.k_low < 7.0]
    assert [point.length for point in front] == pytest.approx(expected)


def test_where_a_front_ends_more_weight_sheds_next_to_no_risk() -> None:
    problem = load_scenario("paper").problem
    front = cg.pareto(problem, solver="cgla", resolution=10)
    far = cg.solve(dataclasses.replace(problem, k=100.0 * front.k_max), "cgla", resolution=10)
    assert front.points[-1].risk - far.risk <= 2e-3 * front.points[0].risk


def test_a_lattice_too_large_to_keep_is_weighed_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = load_scenario("one-threat").problem
    kept = cg.pareto(problem, solver="cgla", resolution=6)
    monkeypatch.setattr("cgla_graph.solvers.trade_off.reweighing.MATRICES_UP_TO", 10)
    anew = cg.pareto(problem, solver="cgla", resolution=6)
    assert anew.status is cg.Status.OPTIMAL
    assert [point.length for point in anew] == pytest.approx([point.length for point in kept])
    assert [point.k_high for point in anew] == pytest.approx([point.k_high for point in kept])
    plan = cg.plan_within_risk(problem, kept.points[2].risk, solver="cgla", resolution=6)
    assert (plan.solution.length, plan.gap) == pytest.approx((kept.points[2].length, 0.0), abs=1e-8)


def test_the_knee_lies_deepest_below_the_line_between_the_ends() -> None:
    front = cg.pareto(load_scenario("one-threat").problem, solver="cgla", resolution=12)
    first, last = front.points[0], front.points[-1]
    across = np.array([last.risk - first.risk, last.length - first.length])
    spots = np.array([(point.risk, point.length) for point in front]) - (first.risk, first.length)
    scaled = spots / np.abs(across)
    off_line = scaled.sum(axis=1) / math.sqrt(2.0)
    assert front.knee is front.points[int(np.argmin(off_line))]
    two = dataclasses.replace(front, points=front.points[:2])
    assert two.knee is None


def test_without_risk_there_is_one_path() -> None:
    front = cg.pareto(cg.Problem((0.0, 0.0), (1.0, 1.0)), solver="cgla")
    (point,) = front
    assert (point.k_low, point.k_high, point.risk, front.error) == (0.0, math.inf, 0.0, 0.0)
    assert front.at(1e9) is point


def test_risk_too_faint_to_measure_is_none() -> None:
    problem = cg.Problem((0.0, 0.0), (1.0, 1.0), cg.RiskField([cg.Threat(0.6, 0.6, 0.5, peak=2e-11)]))
    for solver in ("cgla", "lazy-theta-star"):
        (point,) = cg.pareto(problem, solver=solver, resolution=6)
        assert (point.k_high, point.risk > 0.0) == (math.inf, True)
        for budget in (point.length, 2.0):
            plan = cg.plan_within_length(problem, budget, solver=solver, resolution=6)
            assert plan.solution.length == point.length


def test_start_at_goal() -> None:
    problem = cg.Problem((0.5, 0.5), (0.5, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]))
    for solver in ("cgla", "lazy-theta-star"):
        (point,) = cg.pareto(problem, solver=solver)
        assert (point.length, point.risk) == (0.0, 0.0)
        for plan in (
            cg.plan_within_risk(problem, 0.0, solver=solver),
            cg.plan_within_length(problem, 0.0, solver=solver),
        ):
            assert (plan.status.has_path, plan.gap) == (True, 0.0)


def test_the_default_solver() -> None:
    """The best one there is: its front is at least as good as the lattice's."""
    problem = load_scenario("one-threat").problem
    front = cg.pareto(problem, max_points=4)
    check_shape(front)
    lattice = cg.pareto(problem, solver="cgla", max_points=4)
    for point in front:
        assert point.cost <= 1.001 * min(other.length + point.k * other.risk for other in lattice)


def test_same_front_again_and_nothing_is_changed() -> None:
    problem = load_scenario("trap").problem
    before = dataclasses.replace(problem)
    fronts = [cg.pareto(problem, solver="lazy-theta-star") for _ in range(2)]
    assert problem == before
    first, second = ([(point.k_low, point.cost) for point in front] for front in fronts)
    assert first == second


# Budgets


def within(
    problem: cg.Problem,
    limited: str,
    budget: float,
    solver: str | Solver,
    resolution: int | tuple[int, int] = 20,
    tolerance: float | None = 0.01,
) -> PlanWithin:
    plan = cg.plan_within_risk if limited == "risk" else cg.plan_within_length
    return plan(problem, budget, solver=solver, resolution=resolution, tolerance=tolerance)


def budgets(draw: st.DrawFn, use: FloatArray) -> float:
    """Draw a budget: that of a path, between two, a little off, none, or ample."""
    spots = np.unique(use)
    i = draw(st.integers(0, len(spots) - 1))
    return float(
        draw(st.sampled_from([spots[i], spots[i] * 1.01, 0.5 * (spots[i] + spots[0]), 0.9 * spots[0], 2 * spots[-1]]))
    )


@own.usual
@given(maps(), small, st.sampled_from(["risk", "length"]), st.data())
def test_a_plan_within_a_budget_is_the_best_of_all_paths(
    problem: cg.Problem, resolution: tuple[int, int], limited: str, data: st.DataObject
) -> None:
    risk, length = every_path(problem, resolution)
    assume(len(risk))
    use, value = (risk, length) if limited == "risk" else (length, risk)
    budget = budgets(data.draw, use)
    # whether a path is just within or just outside is up to rounding
    assume(not (np.abs(use - budget) <= NEAR * (1 + budget)).any() or budget in use)
    plan = within(problem, limited, budget, solver="cgla", resolution=resolution)
    surely, perhaps = (value[use <= budget + slack].min(initial=math.inf) for slack in (0.0, NEAR))
    if not plan.status.has_path:
        assert plan.status is cg.Status.NO_PATH
        assert math.isinf(value[use <= budget - NEAR].min(initial=math.inf))
        assert plan.dual_bound == math.inf
        assert math.isnan(plan.gap)
        return
    got = plan.solution.length if limited == "risk" else plan.solution.risk
    used = plan.solution.risk if limited == "risk" else plan.solution.length
    assert plan.status is cg.Status.OPTIMAL
    assert used <= budget * (1 + 1e-12)
    assert perhaps - NEAR <= got <= surely + NEAR
    assert plan.dual_bound <= surely + NEAR
    assert plan.gap >= 0.0
    assert problem.judge(plan.solution).cost == plan.solution.cost


@own.few
@given(maps(), st.sampled_from(["risk", "length"]), st.data())
def test_no_duality_gap_at_the_corners_of_the_front(problem: cg.Problem, limited: str, data: st.DataObject) -> None:
    front = cg.pareto(problem, solver="cgla", resolution=6, k_max=100.0)
    assume(front.points)
    point = data.draw(st.sampled_from(front.points))
    budget = point.risk if limited == "risk" else point.length
    assume(limited == "length" or budget == 0.0 or budget > NEAR)
    plan = within(problem, limited, budget, solver="cgla", resolution=6)
    assert plan.status is cg.Status.OPTIMAL
    got, expected = (plan.solution.length, point.length) if limited == "risk" else (plan.solution.risk, point.risk)
    assert got == pytest.approx(expected, rel=1e-8, abs=NEAR)
    assert plan.dual_bound == pytest.approx(expected, rel=1e-8, abs=NEAR)


@pytest.mark.slow
@own.few
@given(maps(), st.floats(0.0, 1.1), st.sampled_from(["risk", "length"]))
def test_the_bound_is_below_every_path_that_keeps_the_budget(problem: cg.Problem, share: float, limited: str) -> None:
    """In the plane, of all paths: those of the lattice, of lattices finer than the solver's, and the plan's own."""
    paths = [
        cg.solve(dataclasses.replace(problem, k=k), solver, resolution=resolution)
        for k in (0.0, 0.3, 3.0, 30.0, 300.0)
        for solver, resolution in (("cgla", 9), ("lazy-theta-star", 25))
    ]
    found = [path for path in paths if path.status.has_path]
    assume(found)
    use = [path.risk if limited == "risk" else path.length for path in found]
    budget = min(use) + share * (max(use) - min(use))
    plan = within(problem, limited, budget, solver="lazy-theta-star", resolution=12, tolerance=0.05)
    if plan.status.has_path:
        found.append(plan.solution)
        assert (plan.solution.risk if limited == "risk" else plan.solution.length) <= budget * (1 + 1e-12)
    else:
        assert plan.status is cg.Status.NOT_FOUND
        assert f"{budget:g}" in plan.message
    assert plan.scope == "plane"
    for path in found:
        used, value = (path.risk, path.length) if limited == "risk" else (path.length, path.risk)
        assert used > budget or value >= plan.dual_bound * (1 - NEAR)


def test_between_two_corners_the_labels_find_what_no_weight_does() -> None:
    problem = load_scenario("paper").problem
    front = cg.pareto(problem, solver="cgla", resolution=12)
    drops = [a.risk - b.risk for a, b in itertools.pairwise(front)]
    short, safe = list(itertools.pairwise(front))[int(np.argmax(drops))]
    plan = cg.plan_within_risk(problem, 0.5 * (short.risk + safe.risk), solver="cgla", resolution=12)
    assert plan.status is cg.Status.OPTIMAL
    assert short.length < plan.dual_bound < plan.solution.length < safe.length
    assert plan.k == pytest.approx(short.k_high)


@pytest.mark.slow
def test_in_the_plane_a_path_is_bent_until_the_budget_is_used_up() -> None:
    problem = load_scenario("one-threat").problem
    whole = cg.pareto(problem, solver="lazy-theta-star")
    budget = 0.5 * (whole.points[3].risk + whole.points[4].risk)
    plan = cg.plan_within_risk(problem, budget, solver="lazy-theta-star")
    assert 0.999 * budget <= plan.solution.risk <= budget
    length = cg.plan_within_length(problem, plan.solution.length, solver="lazy-theta-star")
    assert length.solution.length <= plan.solution.length * (1 + 1e-12)
    assert length.solution.risk <= 1.1 * budget


@pytest.mark.slow
def test_in_the_plane_the_gap_between_two_corners_is_searched_too() -> None:
    """No risk weight asks for such a path, yet it is no longer than the lattice's."""
    problem = load_scenario("paper").problem
    lattice = cg.plan_within_risk(problem, 0.03, solver="cgla")
    plane = cg.plan_within_risk(problem, 0.03, solver="lazy-theta-star")
    front = cg.pareto(problem, solver="lazy-theta-star")
    assert plane.status is cg.Status.FOUND
    assert plane.solution.risk <= 0.03 * (1 + 1e-12)
    assert plane.solution.length < lattice.solution.length
    assert plane.solution.length < 0.98 * min(point.length for point in front if point.risk <= 0.03)


def test_the_least_risk_of_the_lattice_is_enough() -> None:
    """However large, a weight finds the path of least risk only nearly."""
    problem = load_scenario("paper").problem
    reweighed = Reweighed(problem, "cgla", resolution=10)
    least = reweighed.least_risk()
    assert least is not None
    assert least.risk < reweighed.at(1e6).risk
    plan = cg.plan_within_risk(problem, least.risk, solver="cgla", resolution=10)
    assert plan.status is cg.Status.OPTIMAL
    assert cg.plan_within_risk(problem, 0.9999 * least.risk, solver="cgla", resolution=10).dual_bound == math.inf


def test_too_small_a_budget_says_what_is_possible() -> None:
    problem = load_scenario("paper").problem
    plan = cg.plan_within_risk(problem, 1e-5, solver="cgla", resolution=10)
    least = cg.solve(dataclasses.replace(problem, k=1e9), "cgla", resolution=10).risk
    assert plan.status is cg.Status.NO_PATH
    assert "no path on the lattice has a risk of at most 1e-05: the least is" in plan.message
    assert float(plan.message.split("the least is ")[1].split(",")[0]) == pytest.approx(least, rel=1e-6)
    assert len(plan.solution.path) == 0
    free = cg.plan_within_risk(problem, 1e-5, solver="lazy-theta-star", resolution=10)
    assert free.status is cg.Status.NOT_FOUND
    assert "the least found is" in free.message
    assert "(proven)" in free.message
    short = cg.plan_within_length(problem, 1.0, solver="cgla")
    assert (short.status, short.dual_bound) == (cg.Status.NO_PATH, math.inf)
    assert "the shortest is" in short.message
    short = cg.plan_within_length(problem, 1.0, solver="lazy-theta-star")
    assert (short.status, short.dual_bound) == (cg.Status.NOT_FOUND, math.inf)
    assert "exists" in short.message


def test_an_ample_budget_gives_the_shortest_path() -> None:
    problem = load_scenario("paper").problem
    for solver in ("cgla", "lazy-theta-star"):
        plan = cg.plan_within_risk(problem, 100.0, solver=solver)
        shortest = cg.solve(dataclasses.replace(problem, k=0.0), solver)
        assert (plan.solution.length, plan.k, plan.n_solves) == (shortest.length, 0.0, 1)
        assert plan.solution.cost == pytest.approx(plan.solution.length + problem.k * plan.solution.risk)
    ample = cg.plan_within_length(problem, 100.0, solver="cgla", resolution=10)
    assert (ample.status, ample.gap) == (cg.Status.OPTIMAL, 0.0)


# What a solver does not find


def behind_slits(*places: float, width: float = 1e-4) -> cg.Problem:
    """Build a map with a wall from border to border, and slits in it that no lattice of 20 points sees."""
    ends = [-1.0, *itertools.chain.from_iterable((at, at + width) for at in places), 2.0]
    wall = shapely.union_all(
        [shapely.box(0.4, low, 0.6, high) for low, high in zip(ends[::2], ends[1::2], strict=True)]
    )
    field = cg.RiskField([cg.Threat(0.5, 0.6, spread=0.1, peak=0.9)])
    return cg.Problem((0.1, 0.3), (0.9, 0.6), field, k=5.0, no_fly=wall)


@dataclasses.dataclass(frozen=True)
class Says:
    """A plane solver of somebody else: answers with a status and an infinite bound, whatever it is asked."""

    status: cg.Status
    traits: ClassVar[Traits] = Traits("says", "answers with a status", domain="plane")

    def solve(self, problem: object) -> cg.Solution:
        """Answer."""
        del problem
        return cg.Solution(self.status, lower_bound=math.inf)


@dataclasses.dataclass(frozen=True)
class SaysOnGraph(Says):
    """The same on graphs, and it calls itself exact."""

    traits: ClassVar[Traits] = Traits("says", "answers with a status", domain="graph", exact=True)


@functools.cache
def shortest_behind_slits() -> cg.Solution:
    return cg.solve(dataclasses.replace(behind_slits(0.5), k=0.0), tolerance=None)


OTHERS: list[str | Solver] = [
    *("eight-direction", "lazy-theta-star", "q-learning", "straight-line"),
    *(made(status) for made in (Says, SaysOnGraph) for status in (cg.Status.NO_PATH, cg.Status.INFEASIBLE)),
    *(Says(status) for status in (cg.Status.FAILED, cg.Status.TIMED_OUT)),
]


@pytest.mark.parametrize(
    ("limited", "budget", "solver"),
    [*(("risk", 1.0, solver) for solver in OTHERS), *(("length", 2.0, solver) for solver in OTHERS[2:6:2])],
)
def test_that_a_solver_finds_no_path_proves_nothing_about_the_plane(
    limited: str, budget: float, solver: str | Solver
) -> None:
    problem = behind_slits(0.5)
    best = shortest_behind_slits()
    assert best.risk < budget
    assert best.length < budget or limited == "risk"
    plan = within(problem, limited, budget, solver=solver, tolerance=0.5)
    assert not plan.status.has_path
    assert plan.status is not cg.Status.NO_PATH
    assert (plan.scope, plan.no_path, plan.document()["no_path"]) == ("plane", False, False)
    assert plan.dual_bound <= (best.length if limited == "risk" else best.risk) * (1 + NEAR)
    assert plan.dual_bound >= (0.85 if limited == "risk" else 0.0)
    assert math.isnan(plan.solution.lower_bound)
    assert "finds no path" in plan.message
    assert "there is one within the budget" in plan.message
    too_small = within(problem, limited, 0.01, solver=solver, tolerance=0.5)
    assert too_small.no_path == (limited == "length")
    assert ("is not known" in too_small.message) == (limited == "risk")
    assert "(proven)" in too_small.message


@pytest.mark.parametrize("solver", OTHERS)
def test_that_there_is_no_path_is_proven_by_a_certificate(solver: str | Solver) -> None:
    for limited in ("risk", "length"):
        plan = within(behind_slits(), limited, 2.0, solver=solver)
        assert (plan.scope, plan.no_path, plan.dual_bound) == ("plane", True, math.inf)
        faulty = {cg.Status.FAILED, cg.Status.TIMED_OUT}
        assert plan.status is (solver.status if getattr(solver, "status", None) in faulty else cg.Status.NO_PATH)
        assert "it is proven that no path joins start and goal" in plan.message
        straight = within(behind_slits(), limited, 2.0, solver=solver, tolerance=None)
        assert not straight.no_path


def test_an_exact_solver_speaks_for_its_lattice_alone() -> None:
    for limited in ("risk", "length"):
        plan = within(behind_slits(0.3, 0.5, 0.7), limited, 2.0, solver="dijkstra")
        assert (plan.status, plan.scope, plan.no_path) == (cg.Status.NO_PATH, "lattice", True)
        assert plan.message == "no path on the lattice joins start and goal"


@dataclasses.dataclass(frozen=True)
class Roundabout:
    """A graph solver that is not exact: by way of one node, whichever is best."""

    traits: ClassVar[Traits] = Traits("roundabout", "one node between", domain="graph")

    def solve(self, problem: cg.GraphProblem) -> cg.Solution:
        """Say that it is optimal."""
        weights = problem.graph.weight_matrix()
        source, target = (problem.graph.index_of(node) for node in (problem.source, problem.target))
        over = weights[source] + weights[:, target]
        over[[source, target]] = math.inf
        nodes = problem.source, problem.graph.labels[int(over.argmin())], problem.target
        return cg.Solution(cg.Status.OPTIMAL, nodes=nodes, cost=float(over.min()))


@dataclasses.dataclass(frozen=True)
class RoundaboutCalledExact(Roundabout):
    """The same, which claims to be exact."""

    traits: ClassVar[Traits] = Traits("roundabout", "one node between", domain="graph", exact=True)


@pytest.mark.parametrize("solver", [Roundabout, RoundaboutCalledExact])
def test_paths_of_a_graph_solver_of_somebody_else_bound_nothing(solver: type[Roundabout]) -> None:
    threats = [cg.Threat(0.5, 0.5, 0.1, 0.9), cg.Threat(0.3, 0.7, 0.15, 0.9), cg.Threat(0.75, 0.2, 0.2, 0.8)]
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), cg.RiskField(threats))
    best = cg.plan_within_length(problem, 5.0, solver="cgla", resolution=9).solution
    plan = cg.plan_within_length(problem, 5.0, solver=solver(), resolution=9, tolerance=0.1)
    assert (plan.status, plan.scope) == (cg.Status.FOUND, "plane")
    assert plan.dual_bound <= best.risk < 0.8 * plan.solution.risk
    assert cg.plan_within_risk(problem, 0.9 * best.risk, solver=solver(), resolution=9).no_path is False
    assert cg.pareto(problem, solver=solver(), resolution=5, max_points=3).status is cg.Status.FOUND


@dataclasses.dataclass(frozen=True)
class Contrary:
    """Takes the way around where risk is cheap, the straight one where it is dear, and claims that this is optimal."""

    traits: ClassVar[Traits] = Traits("contrary", "the wrong way", domain="plane")

    def solve(self, problem: cg.Problem) -> cg.Solution:
        """Claim it."""
        way = [(0.5, 1.0)] if problem.k < 1.0 else []
        path = np.array([problem.start, *way, problem.goal])
        cost = problem.evaluate(path).cost
        return cg.Solution(cg.Status.FOUND, path=path, cost=cost, lower_bound=math.nan if way else cost)


def test_what_a_solver_claims_under_one_weight_is_not_held_against_it_under_another() -> None:
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]), k=1.0)
    front = cg.pareto(problem, solver=Contrary(), k_max=1000.0, max_points=2)
    assert [point.solution.status.label for point in front] == ["found", "found"]
    for budget in (0.1, 1.0):
        plan = cg.plan_within_risk(problem, budget, solver=Contrary(), tolerance=None)
        assert (plan.status, math.isnan(plan.solution.claimed_bound)) == (cg.Status.FOUND, True)


# Two weights


@pytest.mark.slow
@own.fast
@given(drawn.weight_matrices(max_nodes=7), st.data())
def test_constrained_paths_against_all_paths(matrix: FloatArray, data: st.DataObject) -> None:
    weights = np.minimum(matrix, matrix.T)
    n = len(weights)
    assume(n > 1)
    rng = np.random.default_rng(data.draw(drawn.seeds))
    uses = rng.integers(0, 4, (n, n)).astype(float)
    uses += uses.T
    sums = [
        (
            float(weights[rows[:, :-1], rows[:, 1:]].sum(axis=1)[i]),
            float(uses[rows[:, :-1], rows[:, 1:]].sum(axis=1)[i]),
        )
        for rows in simple_paths(n)
        for i in range(len(rows))
    ]
    budget = float(data.draw(st.integers(0, 20)))
    price = data.draw(st.sampled_from([0.0, 0.1, 1.0, 10.0]))
    best = min((weight for weight, use in sums if use <= budget), default=math.inf)
    found = constrained_path(weights, uses, (0, n - 1), budget, price=price)
    assert found.finished
    assert bool(found.nodes) == math.isfinite(best)
    assert found.bound == pytest.approx(best)
    if found.nodes:
        pairs = list(itertools.pairwise(found.nodes))
        assert sum(float(weights[pair]) for pair in pairs) == pytest.approx(best)
        assert sum(float(uses[pair]) for pair in pairs) <= budget
        nothing = constrained_path(weights, uses, (0, n - 1), budget, price=price, known=best * (1 - 1e-12))
        assert (nothing.nodes, nothing.finished) == ((), True)
    few = constrained_path(weights, uses, (0, n - 1), budget, price=price, max_labels=3)
    assert few.bound <= best * (1 + 1e-12)
    assert few.finished or not few.nodes


def test_a_heavier_way_to_a_node_may_leave_room_for_a_lighter_one_from_it() -> None:
    edges = {(0, 1): (1, 3), (0, 3): (1, 0.5), (1, 3): (1, 0.5), (1, 2): (1, 3), (1, 4): (2.5, 0), (2, 4): (2.5, 0)}
    weights, uses = np.full((5, 5), np.inf), np.zeros((5, 5))
    np.fill_diagonal(weights, 0.0)
    for (i, j), (weight, use) in edges.items():
        weights[i, j] = weights[j, i] = weight
        uses[i, j] = uses[j, i] = use
    for price in (0.0, 0.01):
        assert constrained_path(weights, uses, (0, 2), 4.0, price=price).nodes == (0, 3, 1, 2)


def test_labels_given_up_leave_a_path_that_is_only_found(monkeypatch: pytest.MonkeyPatch) -> None:
    problem = load_scenario("paper").problem
    whole = cg.plan_within_risk(problem, 0.03, solver="cgla", resolution=12)
    defaults = constrained_path.__kwdefaults__
    monkeypatch.setattr(constrained_path, "__kwdefaults__", {**defaults, "max_labels": 5})
    part = cg.plan_within_risk(problem, 0.03, solver="cgla", resolution=12)
    assert (whole.status, part.status) == (cg.Status.OPTIMAL, cg.Status.FOUND)
    assert part.dual_bound == whole.dual_bound
    assert whole.solution.length < part.solution.length
    assert part.solution.risk <= 0.03


# Refusals


def test_a_walled_in_goal() -> None:
    problem = dataclasses.replace(WALLED_IN, field=cg.RiskField([cg.Threat(0.5, 0.5, 0.1)]))
    for solver in ("cgla", "lazy-theta-star"):
        front = cg.pareto(problem, solver=solver)
        assert (front.status, front.points, front.n_solves, front.knee) == (cg.Status.NO_PATH, (), 1, None)
        with pytest.raises(cg.CglaError, match="front is empty"):
            front.at(1.0)
        for limited in ("risk", "length"):
            assert within(problem, limited, 5.0, solver=solver).status is cg.Status.NO_PATH


def test_improper_fields_are_not_taken() -> None:
    with pytest.warns(ImproperFieldWarning):
        field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=3.0)], improper=True)
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9), field)
    front = cg.pareto(problem, solver="cgla")
    assert (front.status, front.message) == (cg.Status.UNSUPPORTED, NEGATIVE_WEIGHTS)
    plan = cg.plan_within_risk(problem, 1.0, solver="cgla")
    assert (plan.status, plan.message) == (cg.Status.UNSUPPORTED, NEGATIVE_WEIGHTS)


@pytest.mark.parametrize("bad", [-1.0, math.nan, math.inf, "1", None, True])
def test_budgets_are_numbers_of_at_least_0(bad: object) -> None:
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9))
    with pytest.raises(cg.CglaError, match="max_risk is"):
        cg.plan_within_risk(problem, cast("float", bad), solver="cgla")
    with pytest.raises(cg.CglaError, match="max_length is"):
        cg.plan_within_length(problem, cast("float", bad), solver="cgla")


def test_without_a_certificate_the_straight_line_proves_what_it_can() -> None:
    problem = load_scenario("paper").problem
    bounds = [
        cg.plan_within_risk(problem, 0.01, solver="lazy-theta-star", tolerance=tolerance).dual_bound
        for tolerance in (None, 0.05)
    ]
    assert bounds[0] == pytest.approx(math.dist(problem.start, problem.goal))
    assert bounds[1] > 1.15 * bounds[0]
    with pytest.raises(cg.CglaError, match="tolerance is 0"):
        cg.plan_within_risk(problem, 0.01, solver="lazy-theta-star", tolerance=0.0)


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"tolerance": -0.1}, "tolerance is -0.1"),
        ({"tolerance": math.nan}, "tolerance is nan"),
        ({"max_points": 1}, "max_points is 1"),
        ({"max_points": True}, "max_points is True"),
        ({"k_max": 0.0}, "k_max is 0"),
        ({"resolution": 1}, "resolution is 1"),
        ({"solver": "unheard-of"}, "unknown solver 'unheard-of'"),
        ({"speed": 3}, "has no setting 'speed'"),
    ],
)
def test_wrong_settings(settings: dict[str, Any], words: str) -> None:
    problem = cg.Problem((0.1, 0.1), (0.9, 0.9))
    with pytest.raises(cg.CglaError, match=words):
        cg.pareto(problem, **{"solver": "cgla", **settings})


def test_a_graph_does_not_know_length_and_risk_apart() -> None:
    on: Any = cg.Problem((0.1, 0.1), (0.9, 0.9)).on_lattice(3)
    with pytest.raises(cg.CglaError, match="GraphProblem; give a Problem"):
        cg.pareto(on)


def test_settings_beside_a_ready_solver() -> None:
    ready = cg.solvers.get("eight-direction")
    with pytest.raises(cg.CglaError, match="beside a ready solver"):
        Reweighed(cg.Problem((0.1, 0.1), (0.9, 0.9)), ready, corner_rule="touch")
