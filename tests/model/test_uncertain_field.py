"""Uncertain risk fields: exact expectations, one rule for every door, and means of the worst costs."""

import dataclasses
import math
import pickle
from fractions import Fraction

import numpy as np
import pytest
import shapely
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import linprog

import cgla_graph as cg
from cgla_graph.errors import CglaError, ProblemError
from cgla_graph.model.uncertain.mixed_field import MixedField
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.refine.refine import refine_path

NEAR, FAR = (cg.RiskField([cg.Threat(0.5, y, 0.1, 0.9)]) for y in (0.45, 0.8))
FIELD = cg.UncertainField([NEAR, FAR], [0.75, 0.25])
PROBLEM = cg.Problem((0.1, 0.5), (0.9, 0.5), FIELD, k=10.0)


def crowds(rng: np.random.Generator, count: int = 5, threats: int = 6) -> list[cg.RiskField]:
    """Draw fields whose threats overlap, with a raster each, two of them on one grid."""
    return [
        cg.RiskField(
            [cg.Threat(*rng.random(2), spread=rng.uniform(0.03, 0.2), peak=rng.random()) for _ in range(threats)],
            rasters=[cg.RasterRisk(rng.random((3, 4 + (i > 2))), (0, 0, 1, 1), origin="upper" if i % 2 else "lower")],
        )
        for i in range(count)
    ]


@pytest.mark.parametrize("seed", range(4))
def test_expectation_is_the_sum_of_the_scenarios(seed: int) -> None:
    """Overlapping threats and rasters: density, gradient and integral are the sums, also after pickling."""
    rng = np.random.default_rng(seed)
    fields, chances = crowds(rng), rng.dirichlet(np.ones(5))
    field = pickle.loads(pickle.dumps(cg.UncertainField(fields, chances)))  # noqa: S301 - our own bytes
    points, ends = rng.random((40, 2)), rng.random((40, 2))
    for asked in (
        lambda one: one.density(points),
        lambda one: one.gradient(points),
        lambda one: one.line_integral(points, ends),
    ):
        expected = sum(chance * asked(one) for chance, one in zip(chances, fields, strict=True))
        np.testing.assert_allclose(asked(field), expected, rtol=1e-11, atol=1e-11)
    assert field == cg.UncertainField(fields, chances)
    assert hash(field) == hash(cg.UncertainField(fields, chances))


def test_refinement_follows_the_gradient_of_the_expectation() -> None:
    """The kernels of refinement sum over scenarios too: no shifted waypoint is better."""
    field = cg.UncertainField(crowds(np.random.default_rng(3)))
    problem = cg.Problem((0.02, 0.03), (0.97, 0.95), field, k=5.0)
    refined = refine_path(problem, [problem.start, problem.goal], tolerance=1e-8)
    assert refined.cost < problem.evaluate([problem.start, problem.goal]).cost
    rng = np.random.default_rng(5)
    for _ in range(30):
        moved = refined.path.copy()
        moved[1:-1] = np.clip(moved[1:-1] + 1e-3 * rng.standard_normal(moved[1:-1].shape), 0.0, 1.0)
        assert problem.evaluate(moved).cost > refined.cost * (1.0 - 1e-7)


@pytest.mark.parametrize("seed", range(3))
def test_no_path_costs_less_than_the_proof_of_an_expectation(seed: int) -> None:
    """A proof bounds random and refined paths under the mean of many scenarios."""
    rng = np.random.default_rng(seed)
    problem = cg.Problem((0.02, 0.03), (0.97, 0.95), cg.UncertainField(crowds(rng)), k=8.0)
    proof = cg.lower_bound(problem, 0.02)
    assert proof.reached
    bends = rng.random((60, 3, 2))
    paths = [[problem.start, *bend, problem.goal] for bend in bends]
    costs = [problem.evaluate(path).cost for path in paths]
    costs += [refine_path(problem, path, tolerance=1e-4).cost for path in paths[:6]]
    assert min(costs) >= proof.lower_bound


def test_one_scenario_is_the_ordinary_problem() -> None:
    """Weights of 1 and equal scenarios give the same answer, path by path."""
    plain = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), NEAR, k=10.0))
    for field in (cg.UncertainField([NEAR]), cg.UncertainField([NEAR, NEAR]), cg.UncertainField([NEAR, FAR], [1, 0])):
        found = cg.solve(cg.Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0))
        assert found.cost == pytest.approx(plain.cost, rel=1e-9)
        assert found.lower_bound == pytest.approx(plain.lower_bound, rel=1e-6)


#: Doors that take one set of threats, or write it down.
REFUSED = {
    "missions": lambda: cg.World(field=FIELD).field_at(0),
    "proof files": lambda: cg.save_proof(PROBLEM, "one.proof"),
    "maps": lambda: cg.write_scenario(PROBLEM, "map.toml"),
    "curved paths": lambda: cg.flyable(cg.solve(PROBLEM, "straight-line"), turn_radius=0.05),
    "more threats": lambda: FIELD.with_threats([]),
    "other threats": lambda: FIELD.with_only([]),
    "the table": lambda: FIELD.table,
    "centres": lambda: FIELD.centres,
    "kernels": FIELD.kernel_field,
    "models": PROBLEM.model.kernel_model,
    "discs": lambda: cg.solve(PROBLEM, "visibility-graph"),
    "diagrams": lambda: cg.solve(PROBLEM, "voronoi"),
    "milp": lambda: cg.solve(PROBLEM, "milp"),
}


@pytest.mark.parametrize("door", REFUSED)
def test_doors_that_need_one_set_of_threats_refuse(door: str) -> None:
    """None takes all scenarios for one product, and none for no risk; one line names the remedy."""
    with pytest.raises(CglaError, match=r"uncertain: 2 scenarios; give one of them, as problem.field.scenarios\[0\]"):
        REFUSED[door]()


@pytest.mark.parametrize(
    "solver",
    ["hybrid", "cgla", "dijkstra", "lazy-theta-star", "fast-marching", "prm-star", "evolutionary", "straight-line"],
)
def test_doors_without_an_objective_mean_the_expectation(solver: str) -> None:
    """Each solver that takes the problem reports the expected cost of its path."""
    found = cg.solve(PROBLEM, solver)
    expected = 0.75 * FIELD.costs(PROBLEM, found.path)[0] + 0.25 * FIELD.costs(PROBLEM, found.path)[1]
    assert found.cost == pytest.approx(expected, rel=1e-9)


def test_pictures_and_units_take_the_expectation() -> None:
    """Pictures show the expected risk; people of two rasters are averaged, not added up."""
    assert PROBLEM.plot(cg.solve(PROBLEM, "straight-line")) is not None
    day, night = (cg.RasterRisk([[people]], (0, 0, 1, 1), unit="people/km2") for people in (100.0, 300.0))
    field = cg.UncertainField([cg.RiskField(rasters=[day]), cg.RiskField(rasters=[night])])
    (mean,) = field.rasters
    assert (mean.unit, mean.values.item()) == ("people/km2", pytest.approx(200.0))
    other = cg.RasterRisk([[1.0, 300.0]], (0, 0, 1, 1), unit="people/km2", interpolation="nearest")
    mixed = cg.UncertainField([cg.RiskField(rasters=[day]), cg.RiskField(rasters=[other])]).rasters
    assert [one.values.max() for one in mixed] == pytest.approx([50.0, 150.0])


def test_a_limit_of_density_is_none_of_the_mean() -> None:
    """Half of a crowd by day and half of one by night are no density that a limit is about."""
    rasters = [cg.RasterRisk([[dense, 1.0]], (0, 0, 1, 1), interpolation="nearest") for dense in (3.0, 0.5)]
    field = cg.UncertainField([cg.RiskField(rasters=[one]) for one in rasters])
    with pytest.raises(ProblemError, match="the field is uncertain, and a limit of its mean"):
        cg.below_density(cg.Problem((0.6, 0.2), (0.9, 0.8), field), 2.0)


def test_costs_are_those_under_the_weight_of_the_problem() -> None:
    """Under a great weight fainter risk counts, whether the field is asked or that of its problem."""
    field = cg.UncertainField([NEAR, cg.RiskField([cg.Threat(0.5, 0.89, 0.1, 0.9)])])
    problem = cg.Problem((0.1, 0.1), (0.9, 0.1), field, k=1e12)
    line = [problem.start, problem.goal]
    costs = field.costs(problem, line)
    assert costs.tolist() == problem.field.costs(problem, line).tolist()  # type: ignore[attr-defined] # uncertain
    plain = [dataclasses.replace(problem, field=one).evaluate(line).cost for one in field.scenarios]
    assert costs == pytest.approx(plain, rel=1e-9)


def test_a_path_along_a_line_has_the_cheaper_side_in_each_scenario() -> None:
    """Sums of nearest rasters do not take one side for all scenarios, and bounds hold along lines."""
    south, north, faint = (
        cg.RasterRisk(values, (0, 0, 1, 1), interpolation="nearest", origin="lower")
        for values in ([[1.0], [0.0]], [[0.0], [1.0]], [[0.25], [0.0]])
    )
    field = cg.UncertainField([cg.RiskField(rasters=[one]) for one in (south, north, faint)])
    assert len(field.rasters) == 2, "alike ones are summed"
    problem = cg.Problem((0.1, 0.5), (0.9, 0.5), field, k=10.0)
    line = [problem.start, problem.goal]
    assert field.costs(problem, line).tolist() == pytest.approx([0.8] * 3)
    assert problem.evaluate(line).cost == pytest.approx(0.8)
    for objective in ("expected", "worst"):
        found = cg.solve(problem, objective=objective)  # type: ignore[arg-type] # of a list
        assert found.lower_bound <= found.cost == pytest.approx(0.8)


@pytest.mark.parametrize(
    ("scenarios", "probabilities", "words"),
    [
        ([], None, "there are 0 scenarios"),
        ([NEAR, "night"], None, r"scenarios\[1\] is 'night'"),
        ([NEAR, FIELD], None, r"scenarios\[1\] is UncertainField"),
        ([NEAR, FAR], [0.5], "which add up to 0.5"),
        ([NEAR, FAR], [1.0], "1 probabilities for 2 scenarios"),
        ([NEAR, FAR], [0.7, 0.7], "add up to 1.4"),
        ([NEAR, FAR], [1.5, -0.5], "numbers from 0 to 1"),
        ([NEAR, FAR], [math.nan, 1.0], "numbers from 0 to 1"),
        ([NEAR, FAR], "half", "probabilities"),
    ],
)
def test_wrong_scenarios_are_refused(scenarios: list[object], probabilities: object, words: str) -> None:
    """Each fault is named."""
    with pytest.raises(ProblemError, match=words):
        cg.UncertainField(scenarios, probabilities)  # type: ignore[arg-type]


def test_peaks_above_1_are_refused() -> None:
    """There is no proof where weights may be negative."""
    with pytest.warns(UserWarning, match="peak above 1"):
        wild = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=2.0)], improper=True)
    with pytest.raises(ProblemError, match="peak above 1"):
        cg.UncertainField([wild])


CHANCES = st.lists(st.integers(0, 9), min_size=1, max_size=7).filter(any).map(lambda n: [i / sum(n) for i in n])


@given(CHANCES, st.data(), st.floats(0.0, 1.0))
def test_tail_mean_is_the_greatest_of_a_linear_program(chances: list[float], data: st.DataObject, alpha: float) -> None:
    """It equals the optimum over Q; its weights are in Q exactly, and so is whatever is moved into it."""
    costs = data.draw(st.lists(st.floats(0.0, 100.0), min_size=len(chances), max_size=len(chances)))
    tail = TailMean(tuple(chances), alpha)
    most = [min(p / (1.0 - alpha) if alpha < 1.0 else float(p > 0.0), 1.0) if p else 0.0 for p in chances]
    program = linprog([-c for c in costs], A_eq=[[1.0] * len(costs)], b_eq=[1.0], bounds=[(0.0, m) for m in most])
    if program.status == 0:
        assert tail.of(costs) == pytest.approx(-program.fun, rel=1e-6, abs=1e-9)
    weights = tail.weights(costs)
    assert tail.holds(weights)
    assert sum(Fraction(q) * Fraction(c) for q, c in zip(weights.tolist(), costs, strict=True)) <= Fraction(
        tail.of(costs)
    )
    wild = data.draw(st.lists(st.floats(-1.0, 3.0), min_size=len(chances), max_size=len(chances)))
    assert tail.holds(tail.inside(wild))
    assert tail.holds(tail.inside(weights))
    assert np.allclose(tail.inside(weights), weights)


def test_tail_mean_at_its_ends() -> None:
    """Expectation, worst case, the fractional scenario, and one of probability 0."""
    costs = [3.0, 1.0, 8.0, 100.0]
    chances = (0.5, 0.25, 0.25, 0.0)
    assert TailMean(chances, 0.0).of(costs) == pytest.approx(3.75)
    assert (
        TailMean(chances, 1.0).of(costs) == TailMean(chances, 0.75).of(costs) == TailMean(chances, 0.9).of(costs) == 8.0
    )
    assert TailMean(chances, 0.5).of(costs) == pytest.approx(5.5)
    assert TailMean(chances, 0.6).of(costs) == pytest.approx((0.25 * 8 + 0.15 * 3) / 0.4)
    for alpha in (-0.1, 1.1, math.nan, "most"):
        with pytest.raises(ProblemError, match="alpha is"):
            TailMean(chances, alpha)  # type: ignore[arg-type]


def test_samples_are_seeded_and_spread_as_asked() -> None:
    """Places are normal with the given deviation; spreads and peaks have the given median; peaks stay below 1."""
    base = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, 0.5), cg.Threat(0.2, 0.8, 0.05, 0.9)])
    problem = cg.Problem((0, 0), (1, 1), base)
    field = cg.sample_field(problem, 2000, place=[0.1, 0.0], spread=0.2, peak=0.3, seed=4)
    drawn = np.array([[(t.x, t.y, t.spread, t.peak) for t in one.threats] for one in field.scenarios])
    assert drawn[:, 0, :2].std() == pytest.approx(0.1, rel=0.05)
    assert (drawn[:, 1, :2] == (0.2, 0.8)).all()
    assert np.log(drawn[:, 0, 2] / 0.1).std() == pytest.approx(0.2, rel=0.1)
    assert np.median(drawn[:, 0, 3]) == pytest.approx(0.5, rel=0.05)
    assert drawn[..., 3].max() == 1.0
    assert field == cg.sample_field(base, 2000, place=[0.1, 0.0], spread=0.2, peak=0.3, seed=4)
    assert field != cg.sample_field(base, 2000, place=[0.1, 0.0], spread=0.2, peak=0.3, seed=5)
    assert field.sampler is not None
    assert set(field.sampler.draw(50)).isdisjoint(field.scenarios)


def test_the_mean_of_samples_nears_the_blurred_threat() -> None:
    """With places uncertain alone, the expectation converges to the exact one of `Threat.blurred`."""
    threats = [cg.Threat(0.45, 0.5, 0.1, 0.8), cg.Threat(0.6, 0.55, 0.1, 0.8)]
    field = cg.sample_field(cg.RiskField(threats), 3000, place=0.05)
    exact = cg.RiskField([one.blurred(0.05) for one in threats])
    ends = (0.0, 0.5), (1.0, 0.52)
    assert field.line_integral(*ends) == pytest.approx(exact.line_integral(*ends), rel=0.01)


def test_alternative_rasters_are_scenarios_themselves() -> None:
    """Day and night, without uncertain threats, are given and not drawn; with them, one is drawn for each scenario."""
    day, night = (cg.RasterRisk([[risk]], (0, 0, 1, 1)) for risk in (1.0, 5.0))
    base = cg.RiskField([cg.Threat(0.5, 0.5, 0.1)])
    given = cg.sample_field(base, rasters=[day, [night]], probabilities=[0.75, 0.25])
    assert ([one.rasters for one in given.scenarios], given.probabilities) == ([(day,), (night,)], (0.75, 0.25))
    assert given.sampler is None
    drawn = cg.sample_field(base, 400, rasters=[day, night], probabilities=[0.75, 0.25], place=0.1)
    assert sum(one.rasters == (day,) for one in drawn.scenarios) == pytest.approx(300, abs=35)
    for wrong, words in (
        ({}, "nothing is uncertain"),
        ({"place": -1.0}, "place is -1"),
        ({"place": [0.1, 0.2]}, "one for each of 1 threat"),
        ({"peak": 1000.0}, "give at most 10"),
        ({"spread": [1e300]}, "give at most 10"),
        ({"count": 0, "place": 0.1}, "count"),
        ({"rasters": []}, "rasters are empty"),
        ({"rasters": [day, night], "probabilities": [1.0]}, "1 probabilities for 2 alternatives"),
    ):
        with pytest.raises(ProblemError, match=words):
            cg.sample_field(base, **wrong)  # type: ignore[arg-type]


def test_mixtures_work_beside_areas_on_the_earth_and_in_relaxed_problems() -> None:
    """A clearance, an area and a map in degrees change nothing of the rule."""
    threats = [[cg.Threat(24.5, 60.2 + shift, 4000.0)] for shift in (-0.02, 0.03)]
    plain = [
        cg.Problem.in_degrees(
            (24.0, 60.2), (25.0, 60.2), bounds=(23.8, 60.0, 25.2, 60.4), threats=one, k=3.0,
            no_fly=shapely.box(24.3, 60.15, 24.4, 60.25), clearance=100.0,
        )
        for one in threats
    ]  # fmt: skip
    field = cg.UncertainField([one.field for one in plain], [0.5, 0.5])
    problem = cg.Problem(
        plain[0].start, plain[0].goal, field, 3.0, plain[0].bounds, plain[0].no_fly, 100.0, plain[0].projection
    )
    found = cg.solve(problem)
    assert (
        found.lower_bound
        <= found.cost
        == pytest.approx(float(np.mean([one.evaluate(found.path).cost for one in plain])))
    )


def test_weights_of_a_mixture_are_checked() -> None:
    """Weights are numbers of at least 0, one for each field."""
    for weights in ([1.0], [-1.0, 1.0], [math.inf, 0.0]):
        with pytest.raises(ProblemError, match="weights are"):
            MixedField([NEAR, FAR], weights)
