"""Claims about the paper's own Table 1: arithmetic on what it prints, and where it compares what it cannot."""

import numpy as np

from cgla_graph.comparisons.claims.claim import Finding, Part, Table, Verdict
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    LEAST,
    Contrast,
    adjusted,
    all_hold,
    cell_name,
    contrast_table,
    finite,
    tally,
)
from cgla_graph.comparisons.claims.counterexamples import mission
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.paper import printed_values
from cgla_graph.comparisons.claims.paper.planner_experiments import OWN, versus_cgla
from cgla_graph.comparisons.claims.paper.printed_values import TABLE_1, PaperValue, value
from cgla_graph.mission.records import MissionStatus
from cgla_graph.solvers import get

#: A map counts for "similar length" if the two lengths differ by at most this, relative to BCV-style's.
SIMILAR = 0.1
#: The unit that fits most lengths: 160 a side, 3.2 a step of 0.02.
WORKING_SCALE = 160.0
_LONGER = "longer-than-q-learning.toml"


def check_c31(_: Evidence) -> Finding:
    """Check what Table 1 puts side by side."""
    quoted = [row.method for row in TABLE_1 if not row.own_risk]
    k50, k200 = (value("Table 1", f"CGLA, K = {k}") for k in (50, 200))
    dominates = _less(k200, k50)
    if not dominates:
        msg = "the rows of K = 50 and K = 200 of Table 1 are not as they are printed"
        raise AssertionError(msg)
    tightest = printed_values.rows_with_length()[0]
    return Finding(
        Verdict.NOT_TESTABLE,
        f"The risks of {', '.join(quoted)} are quoted from their original papers: other maps, other measures. They "
        "are never put beside numbers of ours.",
        parts=(
            Part(
                "CGLA's rows are optima with full information",
                Verdict.REFUTED,
                f"K = 200 has less risk ({k200.risk} < {k50.risk}) and less length ({k200.length} < {k50.length}) than "
                "K = 50, so it costs less under every K, and K = 50 is optimal for none: flights with limited sight.",
            ),
            Part(
                "One unit of length fits all tables",
                Verdict.PROVED,
                f"if a side of the map is at most {_scale(tightest):.1f} units ({tightest.place}, {tightest.method}); "
                f"{_violations(200.0)} of {len(printed_values.rows_with_length())} rows are shorter than the straight "
                f"line at 200 units a side, {_violations(256.0)} at 256.",
            ),
        ),
        tables=(length_units(),),
        notes=(
            (
                "No path is shorter than the straight line from start to goal, so each printed length bounds the units "
                "a side from above. Where Table 2's way begins is not said; it is taken to be where the threat is."
            ),
            f"{WORKING_SCALE:g} units a side, 3.2 a step of 0.02, is the working reading, used for words only.",
        ),
    )


def length_units() -> Table:
    """
    Reckon what each printed length allows as unit, those that allow least first.

    Examples
    --------
    >>> table = length_units()
    >>> table.rows[0][:2], len(table.rows)
    (('Table 5', 'CGLA, UAV 1'), 8)
    """
    rows = [
        (
            row.place,
            row.method,
            row.length,
            row.straight,
            _scale(row),
            (row.length or 0.0) / WORKING_SCALE / row.straight,
        )
        for row in printed_values.rows_with_length()[:8]
    ]
    columns = ("table", "row", "printed length", "straight line", "most units a side", "detour at 160")
    return Table("Units of length that the tables allow (the eight tightest rows)", columns, rows)


def _scale(row: PaperValue) -> float:
    scale = row.greatest_scale
    if scale is None:
        msg = f"{row.place}, {row.method} prints no length"
        raise ValueError(msg)
    return scale


def _violations(scale: float) -> int:
    """Count the rows that would be shorter than the straight line."""
    return sum(_scale(row) < scale for row in printed_values.rows_with_length())


def _less(first: PaperValue, second: PaperValue) -> bool:
    """Whether a row has less risk and less length than another."""
    pairs = ((first.risk, second.risk), (first.length, second.length))
    return all(a is not None and b is not None and a < b for a, b in pairs)


def check_c32(evidence: Evidence) -> Finding:
    """Check the comparison with BCV: the printed numbers, and our BCV-style planner."""
    cgla, bcv = value("Table 1", "CGLA, K = 10"), value("Table 1", "BCV")
    if not _less(cgla, bcv) or cgla.risk is None or bcv.risk is None or cgla.length is None or bcv.length is None:
        msg = "the rows of CGLA and BCV of Table 1 are not as they are printed"
        raise AssertionError(msg)
    samples = evidence.samples["planners"]
    contrasts = bcv_contrasts(samples)
    holds = all_hold(contrasts)
    return Finding(
        Verdict.NOT_TESTABLE,
        f"As printed, CGLA (K = 10) has {cgla.risk / bcv.risk:.3g} of BCV's risk at {cgla.length / bcv.length:.3g} of "
        "its length; but BCV's risk is quoted from its own paper, so this compares nothing.",
        parts=(
            Part("The printed numbers of CGLA are less", Verdict.PROVED, "2.4318 < 10.1658 and 243 < 256."),
            Part(
                "Against our BCV-style planner: BCV-style is longer and riskier",
                Verdict.SUPPORTED if holds else Verdict.NOT_SUPPORTED,
                f"length {tally(contrasts[: len(contrasts) // 2])}; risk {tally(contrasts[len(contrasts) // 2 :])}.",
            ),
        ),
        tables=(
            contrast_table("BCV-style against CGLA, K = 10, limited sight", contrasts),
            _similar_lengths(samples),
        ),
        notes=("bcv-style is in the style of BCV, not the original, whose text is not public.",),
    )


def bcv_contrasts(samples: Samples) -> list[Contrast]:
    """Compare length and risk of BCV-style's flights with CGLA's; the first half are lengths."""
    return adjusted([*versus_cgla(samples, "bcv-style", "length"), *versus_cgla(samples, "bcv-style", "risk_sum")])


def _similar_lengths(samples: Samples) -> Table:
    """Compare risks where the lengths are similar: the paper has a quarter."""
    rows = []
    for cell in CELLS:
        case = {"mode": "online", "planner": "cgla", **cell}
        other = {"mode": "online", "planner": "bcv-style", "integral": OWN, "radius": cell["radius"]}
        length, bcv_length = (samples.column("length", **one) for one in (case, other))
        risk, bcv_risk = (np.maximum(samples.column("risk_sum", **one), LEAST) for one in (case, other))
        similar = np.abs(length / bcv_length - 1.0) <= SIMILAR
        ratio = bootstrapped((risk / bcv_risk)[similar], seed=0)
        rows.append((cell_name(cell), int(similar.sum()), *finite(*ratio)))
    return Table(
        "Risk of CGLA over that of BCV-style, where their lengths differ by at most 10 %",
        ("cell", "maps", "median ratio", "95 % from", "to"),
        rows,
        "The printed numbers have 0.239; no verdict hangs on this.",
    )


def check_c35(_: Evidence) -> Finding:
    """Check whether CGLA's ways are shorter than Q-Learning's, too."""
    cgla, learned = value("Table 1", "CGLA, K = 10").length, value("Table 1", "Q-Learning").length
    flights = {name: one.fly().uavs["a"] for name, one in mission(_LONGER).missions(get).items()}
    ours, theirs = flights["CGLA"], flights["Q-Learning"]
    arrived = all(flight.status is MissionStatus.ARRIVED for flight in flights.values())
    if cgla is None or learned is None or not (cgla > learned and arrived and ours.length > theirs.length):
        lengths = f"{ours.length:.3f} and {theirs.length:.3f}"
        msg = f"{_LONGER} no longer shows that CGLA flies farther than Q-Learning: {lengths}"
        raise AssertionError(msg)
    return Finding(
        Verdict.REFUTED,
        f"Table 1 itself prints {cgla:g} for CGLA (K = 10) and {learned:g} for Q-Learning. On the stored map CGLA's "
        f"flight is {ours.length:.3g} long, that of our Q-Learning {theirs.length:.3g}.",
        tables=(
            Table(
                "The stored map, K = 10, limited sight",
                ("planner", "length", "risk sum", "cost"),
                [(name, flight.length, flight.risk_sum, flight.cost) for name, flight in flights.items()],
            ),
        ),
        notes=(
            (
                "With all of the map known, CGLA's cost, length + K * risk, is never above that of a path in eight "
                "directions (C26); its length alone may be."
            ),
            "The printed lengths are in the same table; whether of one map is not said.",
        ),
        counterexample=_LONGER,
    )
