"""Fronts with a proof for all risk weights: against proofs and paths of other solvers under weights between."""

import dataclasses
import math

import numpy as np
import pytest
import shapely
from hypothesis import example, given
from hypothesis import strategies as st
from strategies import examples

import cgla_graph as cg
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import LocalProjection
from cgla_graph.model.risk import ImproperFieldWarning
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers.trade_off.front import Front, gaps, lower_hull, worst_weight
from cgla_graph.solvers.trade_off.weight_bounds import WeightBounds
from cgla_graph.testing import strategies as drawn

#: Two threats beside the straight line: at some weight, the best path changes sides.
TWO = cg.Problem((0.1, 0.5), (0.9, 0.5), cg.RiskField([cg.Threat(0.4, 0.45, 0.08), cg.Threat(0.6, 0.56, 0.06)]))
WALL = shapely.box(0.45, 0.2, 0.55, 0.6)
RASTER = cg.RiskField(rasters=[cg.RasterRisk(np.arange(30.0).reshape(5, 6) % 7 / 7, bounds=(0, 0, 1, 1))])
#: What the tests ask for: a front that takes tenths of a second.
QUICK = {"proven": True, "tolerance": 0.02, "k_max": 40.0}


def lines_of(slopes: list[float]) -> tuple[np.ndarray, np.ndarray]:
    """Return lengths and risks of paths that no other one dominates: lines whose least is concave and does not fall."""
    risks = np.sort(np.array(slopes))[::-1]
    return 1.0 + np.cumsum(np.concatenate([[0.0], -np.diff(risks) * np.arange(1, len(risks))])), risks


# bounds under all weights


@given(
    st.lists(st.floats(0.0, 5.0), min_size=1, max_size=6),
    st.lists(st.floats(0.0, 100.0), min_size=1, max_size=8),
    st.lists(st.floats(0.0, 1.0), min_size=8, max_size=8),
    st.lists(st.floats(0.0, 1000.0), min_size=1, max_size=8),
)
# weights so close to 0 that the slope of a chord overflows
@example([0.0], [0.0, 2.2250738585e-313], [1.0, *[0.0] * 7], [0.0])
def test_chords_are_below_the_least_cost(
    slopes: list[float], weights: list[float], loose: list[float], asked: list[float]
) -> None:
    lengths, risks = lines_of(slopes)

    def least(k: np.ndarray) -> np.ndarray:
        return np.asarray((lengths + np.outer(k, risks)).min(axis=1))

    proven = np.unique(weights)
    bounds = WeightBounds(proven, least(proven) * (1.0 - 0.5 * np.array(loose[: len(proven)])))
    ks = np.concatenate([asked, proven, np.nextafter(proven, math.inf), 0.5 * (proven[1:] + proven[:-1])])
    assert (bounds.at(ks) <= least(ks) * (1.0 + 1e-15)).all()
    assert (bounds.at(proven) >= bounds.bounds).all()
    rising = bounds.at(np.sort(ks))
    assert (np.diff(rising) >= -1e-12 * rising[:-1]).all()


def test_a_chord_that_is_continued_is_no_bound() -> None:
    lengths, risks = np.array([1.0, 2.0]), np.array([1.0, 0.1])
    weights = np.array([0.0, 1.0])
    bounds = WeightBounds(weights, (lengths + np.outer(weights, risks)).min(axis=1))
    least = (lengths + 10.0 * risks).min()
    beyond = bounds.bounds[1] + (bounds.bounds[1] - bounds.bounds[0]) * 9.0
    assert bounds.at(10.0) == bounds.bounds[1] < least < beyond


def test_bounds_of_nothing_and_of_no_path() -> None:
    assert math.isnan(WeightBounds(np.array([0.0]), np.array([math.nan])).at(1.0))
    assert WeightBounds(np.array([0.0, 2.0]), np.array([1.0, math.inf])).at([0.0, 5.0]).tolist() == [math.inf] * 2
    # a front without a proof at 0: a cost is never negative
    assert WeightBounds(np.array([4.0]), np.array([2.0])).at([0.0, 1.0, 4.0]).round(9).tolist() == [0.0, 0.5, 2.0]


@given(st.lists(st.floats(0.0, 5.0), min_size=2, max_size=6), st.integers(0, 2**32 - 1))
def test_the_greatest_gap_is_at_a_corner(slopes: list[float], seed: int) -> None:
    draws = np.random.default_rng(seed)
    lengths, risks = lines_of(slopes)
    weights = np.unique(np.concatenate([[0.0], draws.uniform(0.0, 9.0, 4)]))
    bounds = WeightBounds(
        weights, (lengths + np.outer(weights, risks)).min(axis=1) * draws.uniform(0.8, 1.0, len(weights))
    )
    found = [
        (0.0, cg.Solution(cg.Status.FOUND, path=np.zeros((2, 2)), length=length, risk=risk))
        for length, risk in zip(lengths.tolist(), risks.tolist(), strict=True)
    ]
    hull = [path for _, path in lower_hull(found)]
    k, gap = worst_weight(hull, bounds, 9.0)
    everywhere = gaps(hull, bounds, np.linspace(0.0, 9.0, 300))
    assert 0.0 <= k <= 9.0
    assert everywhere.max() <= gap + 1e-12


# fronts


def check(problem: cg.Problem, front: Front, weights: list[float], tolerance: float) -> None:
    """Compare a front with proofs and solvers of the plane under some weights."""
    assert front.bounds is not None
    assert front.gap <= tolerance
    assert front.error == pytest.approx(front.gap / (1.0 + front.gap))
    for k in weights:
        weighted = dataclasses.replace(problem, k=k)
        cost = front.at(k).length + k * front.at(k).risk
        bound = front.lower_bound(k)
        assert front.gap_at(k) <= front.gap + 1e-12
        assert bound <= cost * (1.0 + 1e-12)
        proof = cg.lower_bound(weighted, 0.02)
        assert proof.lower_bound <= cost * (1.0 + 1e-12)
        assert bound <= proof.upper_bound * (1.0 + 1e-12)
        for solver in ("cgla", "straight-line", "fast-marching"):
            found = cg.solve(weighted, solver, resolution=9)
            if found.status.has_path:
                refined = refine_path(weighted, found.path)
                assert bound <= min(found.cost, refined.cost) * (1.0 + 1e-9)


@given(drawn.fields(1, 3), st.booleans(), st.lists(st.floats(0.0, 40.0), min_size=2, max_size=2))
@examples(8)
def test_a_front_is_proven_under_weights_between(field: cg.RiskField, wall: bool, weights: list[float]) -> None:
    problem = cg.Problem((0.05, 0.4), (0.95, 0.55), field, no_fly=WALL if wall else None)
    check(problem, cg.pareto(problem, **QUICK), weights, 0.02)


@pytest.mark.slow
def test_a_front_by_default_is_proven_to_half_a_percent() -> None:
    front = cg.pareto(TWO, proven=True)
    check(TWO, front, [0.3, 7.0, 600.0], 0.005)
    assert front.k_max == 1000.0
    assert front.message == ""
    assert (np.diff([point.risk for point in front]) < 0.0).all()
    assert front.gap_at(front.worst_k) == pytest.approx(front.gap)
    # beyond the last weight, the last bound still counts
    assert front.lower_bound(1e6) == front.lower_bound(1000.0)


def test_a_front_is_the_same_on_every_run() -> None:
    first, again = (cg.pareto(TWO, **QUICK).document() for _ in range(2))
    assert again == first


@pytest.mark.parametrize("interpolation", [pytest.param("bilinear", marks=pytest.mark.slow), "nearest"])
def test_a_front_over_a_raster(interpolation: str) -> None:
    raster = dataclasses.replace(RASTER.rasters[0], interpolation=interpolation)
    problem = cg.Problem((0.05, 0.5), (0.95, 0.5), cg.RiskField(rasters=[raster]))
    check(problem, cg.pareto(problem, **QUICK), [0.5, 9.0], 0.02)


def test_one_path_for_all_weights_takes_few_proofs() -> None:
    free = cg.pareto(cg.Problem((0.1, 0.1), (0.9, 0.7)), proven=True)
    assert (len(free), round(free.gap, 12), len(free.bounds.weights)) == (1, 0.0, 1)
    assert free.points[0].k_high == math.inf
    even = cg.Problem((0.1, 0.1), (0.9, 0.7), cg.RiskField(rasters=[cg.RasterRisk(np.full((2, 2), 0.5), (0, 0, 1, 1))]))
    same = cg.pareto(even, proven=True)
    assert (len(same), len(same.bounds.weights)) == (1, 2)
    assert same.gap <= 0.005
    round_trip = cg.pareto(dataclasses.replace(TWO, goal=TWO.start), proven=True)
    assert (len(round_trip), round_trip.gap) == (1, 0.0)


def test_a_front_without_a_path() -> None:
    shut = dataclasses.replace(TWO, no_fly=shapely.box(0.45, -1, 0.55, 2))
    front = cg.pareto(shut, proven=True)
    assert (len(front), front.status) == (0, cg.Status.NO_PATH)
    assert front.lower_bound(3.0) == math.inf
    assert front.document()["proven"]["no_path"] is True


@pytest.mark.filterwarnings(f"ignore::{ImproperFieldWarning.__module__}.{ImproperFieldWarning.__qualname__}")
def test_peaks_above_1_have_no_bound() -> None:
    field = cg.RiskField([cg.Threat(0.5, 0.5, 0.1, peak=2.0)], improper=True)
    front = cg.pareto(dataclasses.replace(TWO, field=field), proven=True)
    assert (len(front), front.status) == (0, cg.Status.UNSUPPORTED)
    assert math.isnan(front.lower_bound(1.0))
    assert math.isnan(front.gap)
    assert "below 0" in front.message


def test_a_front_on_the_earth_holds_on_the_earth() -> None:
    wide = cg.Problem(
        (-3e5, 0.0), (3e5, 1e4), cg.RiskField([cg.Threat(0.0, 0.0, 8e4)]), bounds=(-4e5, -2e5, 4e5, 2e5),
        projection=LocalProjection(25.0, 60.0),
    )  # fmt: skip
    front = cg.pareto(wide, **QUICK)
    weighted = dataclasses.replace(wide, k=7.0)
    proof = cg.lower_bound(weighted, 0.005)
    assert front.gap <= 0.02
    assert front.lower_bound(7.0) <= proof.upper_bound
    assert front.lower_bound(0.0) == cg.lower_bound(dataclasses.replace(wide, k=0.0), 0.005).lower_bound


def test_another_solver_keeps_its_own_paths() -> None:
    own = cg.pareto(TWO, solver="cgla", resolution=7, k_max=40.0)
    proven = cg.pareto(TWO, solver="cgla", resolution=7, **QUICK)
    assert [point.document() for point in proven] == [point.document() for point in own]
    assert proven.status is cg.Status.OPTIMAL
    assert proven.error == own.error
    assert proven.gap > 0.02
    assert "of this solver" in proven.message
    assert proven.lower_bound(9.0) <= cg.solve(dataclasses.replace(TWO, k=9.0)).cost


def test_a_front_without_proofs_has_no_gap() -> None:
    front = cg.pareto(TWO, solver="cgla", resolution=5)
    assert front.bounds is None
    assert math.isnan(front.gap)
    assert math.isnan(front.lower_bound(1.0))
    assert "proven" not in front.document()


@pytest.mark.parametrize("k_max", [0.0, -1.0, math.nan, math.inf, "9"])
def test_a_wrong_greatest_weight(k_max: object) -> None:
    with pytest.raises(ProblemError, match="k_max"):
        cg.pareto(TWO, proven=True, k_max=k_max)  # type: ignore[arg-type]
    with pytest.raises(ProblemError, match="proven"):
        cg.pareto(TWO, proven="yes")  # type: ignore[arg-type]


def test_budgets_of_a_front() -> None:
    front = cg.pareto(TWO, budgets=[0.02, 9.0], **QUICK)
    within, free = front.budgets
    assert within.dual_bound >= front.least_length([0.02])[0]
    assert within.lower_bound <= within.solution.length
    assert within.solution.risk <= 0.02 * (1.0 + 1e-12)
    assert free.solution.length == pytest.approx(0.8)
    assert [one["budget"] for one in front.document()["budgets"]] == [0.02, 9.0]
    # between the corners of the hull, no found path is below the chords
    risks = np.array([point.risk for point in front])
    assert (front.least_length(risks) <= [point.length for point in front]).all()
    with pytest.raises(ProblemError, match="proven=True"):
        cg.pareto(TWO, budgets=[0.1])
    with pytest.raises(ProblemError, match="budgets is -1"):
        cg.pareto(TWO, proven=True, budgets=[-1.0])
