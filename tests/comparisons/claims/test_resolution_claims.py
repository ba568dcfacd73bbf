"""The check of C46: it tells worlds apart in which the answer is known, and notices optima that are none."""

import itertools
from typing import Any

import numpy as np
import pytest

from cgla_graph.comparisons.claims.claim import Finding, Verdict
from cgla_graph.comparisons.claims.contrasts import CELLS
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.experiment import Record
from cgla_graph.comparisons.claims.paper import resolution_claims as claims
from cgla_graph.comparisons.claims.paper.resolution_claims import farthest_pair
from cgla_graph.model.solution import Solution, Status

#: By how much optima exceed the bound, on 40 maps.
EXCESS = 0.16 / np.array(claims.EXCESS_SIZES) * np.random.default_rng(1).uniform(0.5, 1.5, (40, 1))


def world(seed: int, *, same: float, maps: int = 200, spread: float = 0.01) -> list[dict[str, Any]]:
    """Make up paths that are the same on so large a share of maps, whose costs differ by so much."""
    rng = np.random.default_rng(seed)
    cases: list[dict[str, Any]] = [
        {"mode": "offline", "integral": "exact", "nested_10": 1.3, "nested_20": 1.25, "nested_40": 1.24},
        *({"mode": "online", **cell} for cell in CELLS),
    ]
    return [
        {
            "map": number,
            **case,
            "frechet": 0.03 if rng.random() < same else 0.4,
            "spread": spread * rng.uniform(0.5, 1.5),
        }
        for number in range(maps)
        for case in cases
    ]


def judged(records: list[dict[str, Any]]) -> Finding:
    return claims.judge_c46(Samples(records), EXCESS)


def verdicts(records: list[dict[str, Any]]) -> list[str]:
    """List those of all known, on more than 90 and 95 % of maps, then those of limited sight."""
    return [part.verdict.label for part in judged(records).parts]


def test_paths_that_are_nearly_the_same_are_told_from_others() -> None:
    assert verdicts(world(1, same=1.0)) == ["supported"] * 4
    assert verdicts(world(1, same=0.7)) == ["contradicted"] * 4
    assert verdicts(world(1, same=1.0, maps=9)) == ["undecided"] * 4
    assert verdicts(world(1, same=0.0, maps=9)) == ["contradicted"] * 4


def test_a_share_at_the_border_is_undecided_and_shown_for_the_lower_one() -> None:
    lower, border = zip(*(verdicts(world(seed, same=0.95))[:2] for seed in range(20)), strict=True)
    assert border.count("undecided") >= 17
    assert lower.count("supported") >= 14
    assert "contradicted" not in lower


def test_one_cell_that_shows_the_opposite_is_enough() -> None:
    records = world(1, same=1.0)
    for record in records:
        if record["mode"] == "online" and record["radius"] == CELLS[-1]["radius"]:
            record["frechet"] = 0.4
    assert verdicts(records) == ["supported", "supported", "contradicted", "contradicted"]


def test_other_distances_can_be_read_off() -> None:
    bars, *_ = judged(world(1, same=0.7)).tables
    assert [bars.columns[place] for place in (2, 6)] == ["within 0.05", "within 0.3"]
    assert all(row[2] == row[6] for row in bars.rows)


@pytest.mark.parametrize(("spread", "verdict"), [(0.02, "supported"), (0.05, "undecided"), (0.08, "contradicted")])
def test_costs_on_several_lattices_are_nearly_the_same_or_not(spread: float, verdict: str) -> None:
    part = judged(world(1, same=1.0, spread=spread)).beside[1]
    assert part.verdict.label == verdict


def test_nested_lattices_that_cost_more_are_found_out() -> None:
    records = world(1, same=1.0)
    records[0]["nested_40"] = 1.26
    with pytest.raises(AssertionError, match="costs more"):
        judged(records)


@pytest.mark.slow
def test_excess_over_the_bound_falls_as_lattices_get_finer() -> None:
    excess = claims._excess_over_bound([1, 2])
    assert excess.shape == (2, len(claims.EXCESS_SIZES))
    assert (np.diff(excess, axis=1) < 0.0).all()
    assert ((excess > 0.0) & (excess < 0.2)).all()
    part = claims._excess_part(EXCESS)
    assert part.verdict is Verdict.SUPPORTED
    assert "falls like N to the -1" in part.result
    assert claims._excess_part(10.0 * EXCESS).verdict is Verdict.CONTRADICTED


def test_a_path_below_the_bound_of_all_is_found_out(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(claims, "solve", lambda *_, **__: Solution(Status.OPTIMAL, cost=0.5))
    with pytest.raises(AssertionError, match="less than the bound"):
        claims._excess_over_bound([1])


def test_paths_apart_are_as_far_as_they_are() -> None:
    straight = np.array([[0.0, 0.0], [1.0, 0.0]])
    around = np.array([[0.0, 0.0], [0.5, 0.3], [1.0, 0.0]])
    assert farthest_pair([straight, straight]) == 0.0
    assert farthest_pair([straight, around, straight]) == pytest.approx(0.3, abs=0.01)
    # where the waypoints are does not matter
    assert farthest_pair([straight, np.array([[0.0, 0.0], [0.123, 0.0], [1.0, 0.0]])]) < 0.011


@pytest.mark.slow
def test_samples_have_each_case_once_and_are_judged() -> None:
    records: list[Record] = list(claims.resolution.sample(7))
    cases = [tuple(record.get(entry) for entry in ("mode", "integral", "radius", "replan")) for record in records]
    assert len(set(cases)) == len(cases) == 1 + len(CELLS)
    values = itertools.chain.from_iterable(record.values() for record in records)
    assert all(isinstance(value, str | int | float | bool | None) for value in values)
    finding = claims.judge_c46(Samples([{"map": 7, **record} for record in records]), EXCESS)
    assert finding.beside[0].verdict is Verdict.PROVED
    assert {part.verdict for part in finding.parts} == {Verdict.UNDECIDED}
