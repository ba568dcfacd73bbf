"""Curves of planners over their knobs: in worlds where it is known which one lies above, and as they are shown."""

import math
from collections.abc import Callable, Sequence

import numpy as np
import pytest
from figures import assert_tidy
from hypothesis import given
from hypothesis import strategies as st
from matplotlib.figure import Figure
from strategies import usual

from cgla_graph.comparisons.claims.artefact import Comparison, Picture, artefacts
from cgla_graph.comparisons.claims.evidence import Evidence, Samples, Scale
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.figures import sweep_artefacts
from cgla_graph.comparisons.claims.paper import sweeps
from cgla_graph.comparisons.claims.paper.routes import for_weights
from cgla_graph.comparisons.claims.paper.sweeps import (
    CGLA,
    CURVES,
    FEWEST,
    SHOWN,
    TABLE_1_SETUPS,
    Setup,
    Sweep,
    all_setups,
    curve_at,
    is_dominated,
    on_paper_map,
    said,
)
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

MADE = {one.label: one for one in artefacts() if one.is_ours}
BCV = CURVES["bcv-style"][0]


def world(n: int, times: float, *, noise: float = 0.1, arrives: Callable[[int], bool] = lambda _: True) -> Evidence:
    """
    Make flights on `n` maps: CGLA's risk falls by e for 5 % of length, the others have `times` that at their length.

    Which of the others arrive depends on the map; those of bendy-ruler never do.
    """
    rng = np.random.default_rng(7)
    lengths = dict(zip(CGLA.points.values(), np.linspace(1.13, 1.5, len(CGLA.points)), strict=True))
    records: list[Record] = []
    for seed in range(n):
        for one in all_setups():
            factor = 1.0 if one in lengths else times
            length = lengths.get(one, rng.uniform(1.15, 1.45))
            risk = factor * math.exp(-math.log(length) / 0.05 + noise * rng.normal())
            found = one in lengths or (arrives(seed) and one.planner != "bendy-ruler")
            numbers = {"length": length, "risk_sum": risk, "risk": risk / 50.0, "cost": 1.0, "exposure": risk / 9.0}
            flight = {name: value if found else None for name, value in numbers.items()}
            for mode in ("online", "offline"):
                case = {"map": seed, "mode": mode, "setup": one.label, "arrived": found, "seconds": 0.1}
                records.append({**case, **flight})
    return Evidence(Scale(), {"sweeps": Samples(records)})


@pytest.mark.parametrize(("times", "side"), [(2.0, 1), (1.0, 0), (0.5, -1)])
def test_a_curve_lies_where_its_risk_at_the_same_length_says(times: float, side: int) -> None:
    points = Sweep(world(60, times)).points(BCV)
    assert [one.side for one in points] == [side] * len(BCV.points)
    assert is_dominated(points) == (side == 1)
    words = {1: "wholly above CGLA's curve: dominated", 0: "not told apart from it at 0, ", -1: "below at 0, "}
    assert said(points).startswith(words[side])
    for one in points:
        assert one.gap.low < one.gap.median < one.gap.high
        assert one.gap.median == pytest.approx(times, rel=0.15)
        assert (one.maps, one.arrives.rate) == (60, 1.0)


def test_against_itself_a_point_has_ratios_of_one() -> None:
    ten = {one.value: one for one in Sweep(world(30, 2.0)).points(CGLA)}["10"]
    for ratio in (ten.length, ten.risk):
        assert ratio == pytest.approx((1.0, 1.0, 1.0))
    assert ten.exposure == pytest.approx((0.0, 0.0, 0.0))
    assert ten.gap.median == pytest.approx(1.0)


def test_of_few_maps_nothing_is_said() -> None:
    points = Sweep(world(FEWEST - 1, 3.0)).points(BCV)
    assert {one.side for one in points} == {0}
    assert said(points) == "too few maps to say"
    assert all(math.isinf(one.gap.high) for one in points)


def test_a_planner_is_compared_where_it_arrives() -> None:
    sweep = Sweep(world(60, 2.0, arrives=lambda seed: seed < 25))
    points = sweep.points(BCV)
    assert {one.maps for one in points} == {25}
    assert points[0].arrives.rate == pytest.approx(25 / 60)
    assert is_dominated(points)
    never = sweep.points(CURVES["bendy-ruler"][0])
    assert {one.maps for one in never} == {0}
    assert said(never) == "too few maps to say"
    some = [*points[:2], *never[:1]]
    assert said(some) == "wholly above CGLA's curve: dominated (too few arrivals at 0.5)"


lists = st.lists(st.tuples(st.floats(0.1, 3.0), st.floats(-5.0, 5.0)), min_size=1, max_size=6)


@usual
@given(points=lists, at=st.floats(0.0, 4.0))
def test_the_curve_is_a_lower_bound_of_what_is_no_longer(points: Sequence[tuple[float, float]], at: float) -> None:
    x, y = np.array(points).T
    found = float(curve_at(np.array([at]), x[None], y[None])[0])
    shorter = y[x <= at]
    assert found <= min(shorter, default=np.inf) + 1e-9
    assert found >= y.min() - 1e-9
    if at >= x.max():
        assert found == y.min()


def test_setups_have_different_names_and_each_knob_goes_over_its_default() -> None:
    setups = list(all_setups())
    assert len({one.label for one in setups}) == len(setups)
    assert set(SHOWN) <= set(setups)
    for name, curves in CURVES.items():
        # a second curve may be of another setting
        assert curves[0].default
        for each in curves:
            assert all(one.planner == name for one in each.points.values())
            solvers = [(one.solver, one.k) for one in each.points.values()]
            assert len(set(map(str, solvers))) == len(solvers)
    assert BCV.points[BCV.default].solver == get("bcv-style")


def test_q_learning_that_discounts_has_a_reward_to_arrive_for() -> None:
    for one in all_setups():
        settings = dict(one.settings)
        if settings.get("gamma", 1.0) < 1.0:
            assert settings["target_reward"] > 0.0
    arrived = [
        sweeps.flown(random_scenario(3).problem, one)["arrived"]
        for one in TABLE_1_SETUPS
        if one.planner == "q-learning"
    ]
    assert arrived == [True, True]


def test_the_experiment_flies_and_plans_each_once(monkeypatch: pytest.MonkeyPatch) -> None:
    few = [Setup("cgla", k=50.0), Setup("bcv-style", (("risk_aversion", 0.0),))]
    monkeypatch.setattr(sweeps, "all_setups", lambda: dict.fromkeys(few))
    monkeypatch.setattr(sweeps, "SHOWN", few[:1])
    records = sweeps.sweeps.sample(3)
    assert [(one["mode"], one["setup"]) for one in records] == [
        ("online", "cgla, K = 50"),
        ("online", "bcv-style, risk_aversion 0"),
        ("offline", "cgla, K = 50"),
    ]
    again = sweeps.sweeps.sample(3)
    assert [one["risk_sum"] for one in records] == [one["risk_sum"] for one in again]
    # each flies with its own settings
    assert records[1]["risk_sum"] > records[0]["risk_sum"]


# --- as they are shown ---


@pytest.mark.slow
@pytest.mark.parametrize("n", [3, 40])
def test_the_curves_are_drawn_tidily(n: int, monkeypatch: pytest.MonkeyPatch) -> None:
    figures: list[Figure] = []

    def kept(figure: Figure, caption: str) -> Picture:
        figures.append(figure)
        return Picture(caption, b"", b"")

    monkeypatch.setattr(sweep_artefacts, "picture", kept)
    made = MADE["Fig. A1"].made_from(world(n, 2.0, arrives=lambda seed: seed % 3 > 0))
    assert isinstance(made, Picture)
    assert_tidy(figures[0])
    assert len(figures[0].axes) == len(CURVES)
    assert "arrive" in made.caption
    assert ("bcv-style over risk_aversion" in made.caption) == (n == 40)


def test_the_table_says_of_each_point_where_it_lies() -> None:
    made = MADE["Table A1"].made_from(world(60, 2.0, arrives=lambda seed: seed < 25))
    assert isinstance(made, Comparison)
    assert not made.rows
    assert [table.title for table in made.tables] == [
        one.title for curves in ([CGLA], *CURVES.values()) for one in curves
    ]
    tables = {table.title: table for table in made.tables}
    row = tables[BCV.title].rows[3]
    assert (row[0], row[2], row[-1]) == ("5 (default)", 25, "above")
    assert str(row[1]).startswith("41.7% (")
    assert {str(row[-1]) for row in tables["bendy-ruler over threshold"].rows} == {"too few maps"}
    assert "bcv-style over risk_aversion: wholly above CGLA's curve: dominated" in made.caption
    assert "easier ones" in made.caption


def test_our_numbers_stand_under_heads_that_say_whose_they_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(sweep_artefacts, "on_paper_map", lambda _: on_paper_map(TABLE_1_SETUPS[:1]))
    made = MADE["Table A2"].made_from(world(5, 2.0))
    assert isinstance(made, Comparison)
    assert not made.rows
    assert all("Ours" in table.title for table in made.tables)
    assert all(str(row[0]).startswith("ours: ") for table in made.tables for row in table.rows)
    online = made.tables[1]
    assert [str(row[0]) for row in online.rows] == [f"ours: {one.label}" for one in SHOWN]
    first = dict(zip(online.columns, online.rows[0], strict=True))
    assert first["length x 160"] == pytest.approx(160.0 * float(str(first["length"])))


def test_on_our_map_cgla_flies_as_in_table_1() -> None:
    table = on_paper_map([one for one in TABLE_1_SETUPS if one.planner == "cgla"])
    for row, routes in zip(table.rows, for_weights([10.0, 50.0, 200.0]), strict=True):
        assert routes.offline is not None
        expected = (
            routes.online.length,
            routes.online.risk_sum,
            160.0 * routes.offline.length,
            routes.offline.risk_sum,
        )
        assert (row[1], row[3], row[6], row[7]) == pytest.approx(expected)
        assert "ours: cgla" in str(row[0])
