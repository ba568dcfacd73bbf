"""Plans under uncertain risk: proven bounds of the objective, the cut of the duality gap, and exact graphs."""

import dataclasses
import itertools
import math

import numpy as np
import pytest
import shapely
from strategies import a_part_of

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers.uncertain.outlook import HeldOut, UncertainSolution

#: Two ways around a block, each of them dear in one of two scenarios.
BLOCK = shapely.box(0.3, 0.2, 0.7, 0.8)
BELOW, ABOVE = (
    cg.RiskField([cg.Threat(0.5, 0.1, 0.08, low), cg.Threat(0.5, 0.9, 0.08, 1.0 - low)]) for low in (0.95, 0.05)
)
CORRIDORS = cg.Problem((0.05, 0.5), (0.95, 0.5), cg.UncertainField([BELOW, ABOVE]), k=20.0, no_fly=BLOCK)


def solved(problem: cg.Problem, *args: object, **options: object) -> UncertainSolution:
    """Solve under an objective."""
    found = cg.solve(problem, *args, **options)  # type: ignore[arg-type]
    assert isinstance(found, UncertainSolution)
    return found


def drawn(seed: int, count: int = 6, threats: int = 5) -> cg.Problem:
    """Draw a map with uncertain threats, with an area on some."""
    rng = np.random.default_rng(seed)
    known = [
        cg.Threat(*rng.uniform(0.2, 0.8, 2), rng.uniform(0.05, 0.15), rng.uniform(0.2, 1.0)) for _ in range(threats)
    ]
    no_fly = shapely.box(0.4, 0.3, 0.6, 0.5) if seed % 2 else None
    certain = cg.Problem((0.05, 0.07), (0.95, 0.9), cg.RiskField(known), k=float(rng.uniform(2, 20)), no_fly=no_fly)
    field = cg.sample_field(certain, count, place=0.05, spread=0.2, peak=0.2, seed=seed)
    chances = rng.dirichlet(np.ones(count))
    return dataclasses.replace(certain, field=cg.UncertainField(field.scenarios, chances))


def attack(problem: cg.Problem, found: UncertainSolution, seed: int, count: int) -> float:
    """Return the least objective of random paths, and of paths refined under many weights."""
    tail, field = TailMean(found.probabilities, found.alpha), problem.field
    assert isinstance(field, cg.UncertainField)
    rng, least = np.random.default_rng(seed), math.inf
    for number in range(count):
        path = np.array([problem.start, *rng.random((int(rng.integers(0, 4)), 2)), problem.goal])
        if number % 4 == 0:
            weights = tail.inside(rng.dirichlet(np.ones(len(field.scenarios))))
            path = refine_path(dataclasses.replace(problem, field=field.weighted(weights)), path, tolerance=1e-3).path
        if problem.evaluate(path).feasible:
            least = min(least, tail.of(field.costs(problem, path)))
    weights = found.weights
    near = refine_path(dataclasses.replace(problem, field=field.weighted(weights)), found.path, tolerance=1e-6).path
    return min(least, tail.of(field.costs(problem, near)))


@pytest.mark.slow
def test_the_cut_closes_the_gap_of_two_corridors() -> None:
    """No weighted sum proves more than the mean of the two ways; the places that all paths pass prove the worst."""
    found = solved(CORRIDORS, objective="worst", tolerance=0.02)
    low, high = sorted(found.costs)
    assert high > 1.5 * low
    assert found.weighted_bound == pytest.approx(0.5 * (low + high), rel=0.01)
    assert found.duality_gap > 0.2
    assert found.weighted_bound < found.lower_bound <= found.cost == high
    assert found.gap <= 0.02
    # the mean has no such gap
    assert solved(CORRIDORS, objective="expected").duality_gap == 0.0


def test_rounding_is_no_duality_gap() -> None:
    """Costs that differ by rounding alone leave no gap, and the expected cost is a weighted sum itself."""
    found = solved(CORRIDORS, objective="worst", tolerance=None)
    near = {"cost": 1.0 + 2.0**-52, "least_weighted": 1.0}
    assert dataclasses.replace(found, **near).duality_gap == 0.0
    assert dataclasses.replace(found, **near | {"cost": 1.1}).duality_gap == pytest.approx(0.1)
    assert dataclasses.replace(found, objective="expected", alpha=0.0, **near | {"cost": 1.1}).duality_gap == 0.0


@pytest.mark.parametrize(
    ("seed", "alpha"),
    [
        (2, 0.5),
        *(
            pytest.param(*one, marks=pytest.mark.slow)
            for one in [(3, 0.9), *a_part_of(list(itertools.product(range(12), [0.5, 0.8, 0.95])))]
        ),
    ],
)
def test_no_path_has_a_lower_objective_than_the_proof(seed: int, alpha: float) -> None:
    """Random paths, refined paths and those of solvers, on maps with and without areas."""
    problem = drawn(seed)
    found = solved(problem, objective="cvar", alpha=alpha)
    assert found.status is cg.Status.FOUND
    # (what the cut leaves of a duality gap is said)
    assert found.gap <= max(0.012, 1.1 * found.duality_gap)
    assert found.cost == TailMean(found.probabilities, alpha).of(problem.field.costs(problem, found.path))  # type: ignore[attr-defined]
    assert attack(problem, found, seed, 40) >= found.lower_bound


def test_objectives_are_ordered_and_meet_at_their_ends() -> None:
    """Expected <= CVaR <= worst; alpha 0 is the expectation, alpha 1 the worst case."""
    problem = drawn(4, count=4, threats=3)
    expected, half, worst = (
        solved(problem, objective=objective, alpha=alpha)
        for objective, alpha in (("expected", None), ("cvar", 0.5), ("worst", None))
    )
    assert expected.cost <= half.cost * 1.01
    assert half.cost <= worst.cost * 1.01
    mean, all_of_it = solved(problem, objective="cvar", alpha=0.0), solved(problem, objective="cvar", alpha=1.0)
    assert (mean.cost, all_of_it.cost) == (expected.cost, worst.cost)
    assert cg.solve(problem).cost == pytest.approx(expected.cost, rel=2e-3)
    assert half.cvar(0.5) == half.cost
    assert half.expected_cost <= half.cost <= half.worst_cost


@pytest.mark.parametrize(("objective", "alpha"), [("expected", None), ("cvar", 0.9), ("worst", None)])
def test_one_scenario_is_the_ordinary_problem(objective: str, alpha: float | None) -> None:
    """One, equal ones, others of probability 0, and a certain field: the same answer."""
    one = cg.RiskField([cg.Threat(0.5, 0.55, 0.1)])
    plain = cg.Problem((0.1, 0.5), (0.9, 0.5), one, k=10.0)
    known = cg.solve(plain)
    for field in (
        one,
        cg.UncertainField([one]),
        cg.UncertainField([one, one]),
        cg.UncertainField([one, BELOW], [1, 0]),
    ):
        found = solved(dataclasses.replace(plain, field=field), objective=objective, alpha=alpha)
        assert found.cost == pytest.approx(known.cost, rel=1e-3)
        assert found.lower_bound <= known.cost
        assert found.gap <= 0.01


@pytest.mark.parametrize("seed", range(3))
@pytest.mark.parametrize("alpha", [0.0, 0.4, 0.8, 1.0])
def test_graphs_agree_with_brute_force(seed: int, alpha: float) -> None:
    """On a lattice of 3 x 3, no order of nodes is better; the bound is below, and all exact solvers agree."""
    problem = drawn(seed, count=5)
    on = problem.on_lattice(3)
    found = solved(problem, "dijkstra", objective="cvar", alpha=alpha, on=on)
    assert found.status is cg.Status.OPTIMAL
    places = np.asarray(on.graph.positions)
    source, target = on.graph.index_of(on.source), on.graph.index_of(on.target)
    inner = [i for i in range(len(places)) if i not in {source, target}]
    tail, field = TailMean(found.probabilities, alpha), problem.field
    weights = np.stack(
        [on.graph.under(cg.CostModel(one, problem.k, problem.no_fly)).weight_matrix() for one in field.scenarios]
    )  # type: ignore[attr-defined]
    least = math.inf
    for length in range(5):
        for nodes in itertools.permutations(inner, length):
            path = [source, *nodes, target]
            costs = weights[:, path[:-1], path[1:]].sum(axis=1)
            if np.isfinite(costs).all():
                least = min(least, tail.of(costs))
    assert found.cost <= least * (1.0 + 1e-9)
    assert found.cost == pytest.approx(least, rel=1e-9)
    on_graph = solved(on, "cgla", objective="cvar", alpha=alpha)  # type: ignore[arg-type]
    assert on_graph.cost == pytest.approx(found.cost, rel=1e-9)
    assert on_graph.cost * (1.0 - 1e-9) <= on_graph.lower_bound <= on_graph.cost


@pytest.mark.slow
def test_a_graph_path_is_refined_and_proven_in_the_plane() -> None:
    """A bound of the lattice is none of the plane; with refine, the path is bent, and the plane is proven."""
    on_lattice = solved(CORRIDORS, "dijkstra", objective="worst", resolution=8)
    assert on_lattice.status is cg.Status.OPTIMAL
    assert math.isnan(on_lattice.lower_bound)
    refined = solved(CORRIDORS, "dijkstra", objective="worst", resolution=8, refine=True, tolerance=0.1)
    assert refined.lower_bound <= refined.cost <= on_lattice.cost
    assert not solved(CORRIDORS, "straight-line", objective="worst", tolerance=None).status.has_path


def test_no_path_is_proven_for_every_objective() -> None:
    """A wall across the map: no path, and the bound is infinite."""
    walled = dataclasses.replace(CORRIDORS, no_fly=shapely.box(0.4, 0.0, 0.6, 1.0))
    found = solved(walled, objective="worst")
    assert (found.status, found.lower_bound) == (cg.Status.NO_PATH, math.inf)
    assert solved(walled, "dijkstra", objective="worst", resolution=5).status is cg.Status.NO_PATH
    stay = dataclasses.replace(CORRIDORS, goal=CORRIDORS.start)
    assert (solved(stay, objective="cvar").cost, solved(stay, "cgla", objective="worst").cost) == (0.0, 0.0)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"objective": "best"}, "objective"),
        ({"objective": "worst", "alpha": 0.9}, "takes none"),
        ({"alpha": 0.9}, "there is no objective"),
        ({"objective": "cvar", "alpha": 1.5}, "alpha is 1.5"),
        ({"objective": "cvar", "alpha": math.nan}, "alpha is nan"),
        ({"objective": "cvar", "tolerance": 0.0}, "tolerance"),
    ],
)
def test_wrong_objectives_are_refused(options: dict[str, object], words: str) -> None:
    """Each fault is named."""
    with pytest.raises((ProblemError, cg.CglaError), match=words):
        cg.solve(CORRIDORS, **options)  # type: ignore[arg-type]


def test_graphs_of_their_own_and_large_ones_are_refused() -> None:
    """A graph without a model has no scenarios; a large one in many scenarios is not held."""
    plain = cg.GraphProblem(cg.GeometricGraph.from_matrix([[0.0, 1.0], [1.0, 0.0]]), 0, 1)
    with pytest.raises(ProblemError, match="no scenarios"):
        cg.solve(plain, objective="worst")
    with pytest.raises(ProblemError, match="at most 50,000,000 are held"):
        cg.solve(CORRIDORS, "cgla", objective="worst", resolution=90)


def test_held_out_samples_tell_of_a_path() -> None:
    """Other samples than it was planned on; the same ones each time; the intervals hold what they say."""
    base = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.5, 0.52, 0.08)]), k=10.0)
    problem = dataclasses.replace(base, field=cg.sample_field(base, 12, place=0.06, seed=7))
    found = solved(problem, objective="cvar", alpha=0.8, tolerance=None)
    assert math.isnan(found.lower_bound)
    held = found.held_out(400)
    low, high = held.interval
    assert low < held.cvar < high
    assert (held.costs == found.held_out(400).costs).all()
    chance, least, most = held.chance_above(float(np.median(held.costs)))
    assert chance == pytest.approx(0.5, abs=0.01)
    assert least < chance < most
    told = found.outlook(budget=1.0)
    assert told["held_out"]["samples"] == 1000
    assert told["chance_above"] == found.chance_above(1.0)
    with pytest.raises(ProblemError, match="no other samples"):
        solved(CORRIDORS, "dijkstra", objective="worst", resolution=4).held_out()
    on_graph = solved(problem.on_lattice(5), objective="cvar", alpha=0.8)
    as_planned = solved(problem, "cgla", objective="cvar", alpha=0.8, resolution=5)
    assert on_graph.outlook()["held_out"] == as_planned.outlook()["held_out"]
    with pytest.raises(ProblemError, match="its problem is not at hand"):
        dataclasses.replace(found, problem=None).held_out()


@pytest.mark.slow
def test_intervals_of_held_out_costs_cover_the_mean_of_the_tail() -> None:
    """Of normal costs, whose CVaR is known, the interval of 300 samples holds it in about 95 % of 60 trials."""
    rng = np.random.default_rng(0)
    exact = math.exp(-0.5 * 1.2815515655446004**2) / math.sqrt(2.0 * math.pi) / 0.1
    held = [HeldOut(np.sort(rng.standard_normal(300) + 10.0), 0.9, seed) for seed in range(60)]
    intervals = np.array([one.interval for one in held])
    inside = (intervals[:, 0] <= 10.0 + exact) & (10.0 + exact <= intervals[:, 1])
    assert inside.mean() >= 0.85
    assert HeldOut(np.array([1.0, 2.0]), 1.0).interval == (2.0, math.inf)
    assert HeldOut(np.array([1.0, 3.0]), 0.25).cvar == pytest.approx((3.0 * 1.0 + 1.0 * 0.5) / 1.5)
