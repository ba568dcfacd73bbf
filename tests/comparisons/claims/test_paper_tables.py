"""The paper's tables, remade: every printed number once, and none of ours beside what it cannot be compared with."""

import math
from collections import Counter
from collections.abc import Sequence

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from strategies import usual

from cgla_graph.comparisons.claims.artefact import Comparison, TableRow, artefacts
from cgla_graph.comparisons.claims.figures import paper_tables
from cgla_graph.comparisons.claims.figures.paper_tables import Reason, reason, rows
from cgla_graph.comparisons.claims.paper.flights import START
from cgla_graph.comparisons.claims.paper.printed_values import TABLES, PaperValue
from cgla_graph.comparisons.claims.paper.routes import Route, Routes, fly

#: Units a side of the map, of which the paper's lengths are a multiple in the working reading.
SCALE = 160.0
#: Methods whose numbers the paper quotes from other papers.
QUOTED = ("BCV", "A2D", "Q-Learning")


@pytest.fixture(scope="module")
def tables() -> dict[str, Comparison]:
    made = {one.label: one.make() for one in artefacts() if one.label.startswith("Table") and not one.is_ours}
    return {label: table for label, table in made.items() if isinstance(table, Comparison)}


def assert_honest(found: Sequence[TableRow]) -> None:
    """Check that no number of ours stands beside one that measures something else, and that each row says why."""
    for row in found:
        why = Reason(row.why)
        assert not row.comparable
        if any(row.label.startswith(name) for name in QUOTED):
            assert not why.same_measure
        if why.same_measure:
            assert row.online is not None
            assert math.isfinite(row.online)
        else:
            assert row.offline is None
            assert row.online is None


@pytest.mark.slow
def test_every_printed_number_is_there_once(tables: dict[str, Comparison]) -> None:
    printed = Counter(
        (row.place, row.method, quantity, value)
        for row in TABLES
        for quantity, value in (("risk sum", row.risk), ("length", row.length))
        if value > 0.0
    )
    shown = Counter(
        (place, row.label, row.quantity, row.paper) for place, table in tables.items() for row in table.rows
    )
    assert shown == printed
    assert set(printed.values()) == {1}


@pytest.mark.slow
def test_no_number_of_ours_stands_beside_another_measure(tables: dict[str, Comparison]) -> None:
    found = [row for table in tables.values() for row in table.rows]
    assert_honest(found)
    assert sum(row.online is None for row in found) == 2 * len(QUOTED)


def test_the_rule_is_not_kept_by_a_program_that_takes_all_measures_for_one(monkeypatch: pytest.MonkeyPatch) -> None:
    ours = {row.method: Routes("", None, Route(np.array([START, (0.9, 0.9)]), 1.0)) for row in TABLES}
    assert_honest(rows(TABLES, ours))
    monkeypatch.setattr(Reason, "same_measure", property(lambda _: True))
    made = rows(TABLES, ours)
    monkeypatch.undo()
    with pytest.raises(AssertionError):
        assert_honest(made)


@pytest.mark.slow
def test_the_reconstructed_map_is_called_selected(tables: dict[str, Comparison]) -> None:
    assert "selected to agree" in tables["Table 1"].caption
    assert all("ours" in table.caption for table in tables.values())


numbers = st.floats(0.01, 500.0)
printed_rows = st.builds(
    PaperValue,
    place=st.just("Table 0"),
    method=st.sampled_from(["CGLA, K = 10", "CGLA, UAV 2", "FBCRI, UAV 1", "CPVS", "BCV"]),
    risk=st.just(math.nan) | numbers,
    length=st.just(math.nan) | numbers,
    start=st.just(START),
    own_risk=st.booleans(),
)


@usual
@given(row=printed_rows, ahead=st.floats(0.0, 0.7), risks=st.tuples(numbers, numbers), whole=st.booleans())
def test_ours_are_left_out_of_quoted_rows_and_converted_in_all_others(
    row: PaperValue, ahead: float, risks: tuple[float, float], whole: bool
) -> None:
    paths = [np.array([START, (0.1 + ahead, 0.1 + ahead), end]) for end in ((0.9, 0.9), (0.9, 0.1))]
    offline, online = (Route(path, risk) for path, risk in zip(paths, risks, strict=True))
    found = {made.quantity: made for made in rows([row], {row.method: Routes("", offline if whole else None, online)})}
    assert found.keys() == {name for name, value in (("risk sum", row.risk), ("length", row.length)) if value > 0.0}
    for quantity, made in found.items():
        assert made.paper == (row.risk if quantity == "risk sum" else row.length)
        if not row.own_risk:
            assert (made.offline, made.online) == (None, None)
            continue
        straight = [math.dist(a, b) for a, b in zip(paths[1].tolist(), paths[1].tolist()[1:], strict=False)]
        expected = risks[1] if quantity == "risk sum" else SCALE * sum(straight)
        assert made.online == pytest.approx(expected)
        assert (made.offline is not None) == whole
        assert ("working reading" in made.why) == (quantity == "length")
        assert ("in its style" in made.why) == (not row.method.startswith("CGLA"))


def test_what_was_measured_by_the_authors_needs_a_number_of_ours() -> None:
    with pytest.raises(KeyError):
        rows([PaperValue("Table 0", "CGLA", 1.0, math.nan, START)], {})
    quoted = PaperValue("Table 0", "BCV", 1.0, math.nan, START, own_risk=False)
    assert rows([quoted], {})[0].why == reason(quoted, "risk sum").value


# --- where the numbers come from ---


def columns(table: Comparison, quantity: str) -> dict[str, float | None]:
    return {row.label: row.online for row in table.rows if row.quantity == quantity}


def test_tables_3_to_5_are_those_of_the_shipped_missions(tables: dict[str, Comparison]) -> None:
    for view in fly("fig9"):
        flight = view.flight.uavs["a"]
        assert columns(tables["Table 3"], "length")[f"CGLA, {view.variant}"] == pytest.approx(SCALE * flight.length)
    for method, solver in (("CGLA", None), ("FBCRI", "fbcri-style")):
        (view,) = fly("fig10", solver=solver)
        for name, flight in view.flight.uavs.items():
            label = f"{method}, UAV {name}"
            assert columns(tables["Table 4"], "risk sum")[label] == pytest.approx(flight.risk_sum)
            assert columns(tables["Table 5"], "length")[label] == pytest.approx(SCALE * flight.length)


def test_no_length_is_below_the_straight_line(tables: dict[str, Comparison]) -> None:
    straight = {(row.place, row.method): row.straight for row in TABLES}
    # where Table 2 begins is not printed; ours begins elsewhere
    for place in ("Table 1", "Table 3", "Table 5"):
        for row in tables[place].rows:
            if row.quantity == "length" and row.offline is not None:
                assert row.offline >= SCALE * straight[place, row.label] * (1.0 - 1e-9)


def test_offline_is_the_same_with_and_without_sharing(tables: dict[str, Comparison]) -> None:
    first, second = (
        [row.offline for row in tables["Table 3"].rows if row.label.endswith(name)]
        for name in ("without sharing", "with sharing")
    )
    assert first == second


@pytest.mark.parametrize("label", ["Table 1", "Table 2"])
def test_a_caption_that_is_no_longer_true_is_refused(label: str, monkeypatch: pytest.MonkeyPatch) -> None:
    way = Route(np.array([START, (0.9, 0.9)]), 1.0)
    same = [Routes(label, None, way) for label in ("K = 10", "K = 50", "K = 200")]
    monkeypatch.setattr(paper_tables, "for_weights", lambda _: same)
    monkeypatch.setattr(paper_tables, "escape", lambda: type("Same", (), {"routes": same[:2]}))
    with pytest.raises(AssertionError, match="Table"):
        {one.label: one for one in artefacts()}[label].make()
