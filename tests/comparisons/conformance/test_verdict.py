"""Verdicts: a wrong path gets one clear sentence, and what contradicts a proof is called so."""

import dataclasses
import json
import math
from typing import Any

import pytest

from cgla_graph.comparisons.conformance.documents import read_answer
from cgla_graph.comparisons.conformance.suite import Instance, chosen, suite
from cgla_graph.comparisons.conformance.verdict import Result, Verdict, judged
from cgla_graph.errors import CglaError

WALL = "walls-corner"
BEST = [[0.05, 0.5], [0.45, 0.75], [0.55, 0.75], [0.95, 0.5]]


def judge(path: Any, name: str = WALL, **more: Any) -> Result:  # noqa: ANN401 - any JSON
    return judged(chosen([name])[0], read_answer(json.dumps({"path": path, **more})))


@pytest.mark.parametrize("one", [one for one in suite() if one.path], ids=lambda one: one.name)
def test_the_stored_path_is_feasible_and_within_the_bracket(one: Instance) -> None:
    found = judged(one, read_answer(json.dumps({"path": one.path})))
    assert (found.verdict, found.message) == (Verdict.FEASIBLE, "")
    assert found.excess == pytest.approx(0.0, abs=1e-14)
    assert 0.0 <= found.gap <= 0.005


@pytest.mark.parametrize(
    ("path", "message"),
    [
        ([[0.05, 0.5], [0.95, 0.5]], "crosses a no-fly area between waypoints 0 (0.05, 0.5) and 1 (0.95, 0.5)"),
        ([[0.05, 0.5], [0.5, -0.1], [0.95, 0.5]], "leaves the bounds at waypoint 1 (0.5, -0.1)"),
        ([[0.06, 0.5], *BEST[1:]], "starts at (0.06, 0.5) instead of (0.05, 0.5)"),
        (BEST[::-1], "starts at (0.95, 0.5) instead of"),
        ([*BEST[:-1], [0.95, 0.51]], "ends at (0.95, 0.51) instead of (0.95, 0.5)"),
        ([[0.05, 0.5]], "ends at (0.05, 0.5) instead of"),
    ],
)
def test_a_wrong_path_gets_one_sentence(path: list[list[float]], message: str) -> None:
    found = judge(path)
    assert found.verdict is Verdict.WRONG
    assert message in found.message
    assert math.isnan(found.cost)


def test_boundaries_may_be_touched_and_short_numbers_are_taken() -> None:
    """The best path leads along the wall; ends that were printed short are put where they belong."""
    assert judge(BEST).verdict is Verdict.FEASIBLE
    nearly = [[0.05 + 4e-7, 0.5], *BEST[1:]]
    assert judge(nearly) == judge(BEST)
    assert judge([BEST[0], [0.45, 0.7499999], *BEST[2:]]).verdict is Verdict.WRONG


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("", "it wrote nothing"),
        ("cost: 5", "no JSON"),
        ('{"path": null} done', "trailing characters"),
        ("[[0, 0], [1, 1]]", "give a table of keys and values (it is [[0, 0], [1, 1]])"),
        ("{}", "path: this key is needed"),
        ('{"path": []}', "path: give at least 1, not 0"),
        ('{"path": [[0, NaN]]}', "path.0.1: give a finite number (it is nan)"),
        ('{"path": [[0, 1e999]]}', "path.0.1: give a finite number (it is inf)"),
        ('{"path": [[0, 0, 0]]}', "path.0: give at most 2, not 3"),
        ('{"path": [[0, "1"]]}', "path.0.1: give a number (it is '1')"),
        ('{"path": "' + "x" * 10**6 + '"}', "path: give a list (it is 'xxx"),
        ("[" * 10**5, "no JSON"),
    ],
)
def test_what_is_no_answer_is_told_in_one_line(text: str, message: str) -> None:
    with pytest.raises(CglaError) as caught:
        read_answer(text)
    assert message in str(caught.value)
    assert len(str(caught.value)) < 200
    assert "\n" not in str(caught.value)


def test_no_path_is_right_only_where_there_is_none() -> None:
    assert judge(None).verdict is Verdict.MISSED
    assert judge(None, "infeasible-ring").verdict is Verdict.NO_PATH
    assert judge([[0.05, 0.5], [0.7, 0.5]], "infeasible-ring").verdict is Verdict.WRONG


def test_lies_are_told() -> None:
    honest = judge(BEST)
    found = judge(BEST, cost=1.0)
    assert (found.verdict, found.cost) == (Verdict.FEASIBLE, honest.cost)
    assert found.message == f"it says that its path costs 1; it costs {honest.cost:.9g}"
    assert judge(BEST, cost=honest.cost, lower_bound=honest.cost * (1 - 1e-6)) == honest
    assert judge(BEST, lower_bound=honest.cost * 1.001).verdict is Verdict.WRONG


def test_what_contradicts_a_proof_is_no_fault_of_the_planner() -> None:
    """Held against proofs that are false on purpose."""
    (one,) = chosen([WALL])
    answer = read_answer(json.dumps({"path": BEST}))
    too_high = one.model_copy(update={"lower_bound": 1.1, "upper_bound": 1.1})
    no_path = one.model_copy(update={"lower_bound": None, "upper_bound": None, "path": None})
    for false in (too_high, no_path):
        found = judged(false, answer)
        assert found.verdict is Verdict.CONTRADICTION
        assert "proven" in found.message
        assert not found.verdict.is_right
    assert dataclasses.replace(judged(one, answer), instance=too_high).gap == 0.0
