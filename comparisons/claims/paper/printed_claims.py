"""What the paper's Table 1 prints (C31, C32, C35): arithmetic on it, and where it compares what it cannot."""

import numpy as np

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    LEAST,
    adjusted_together,
    cell_name,
    contrast_table,
    finite,
    supported_by,
    tally,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import bootstrapped
from cgla_graph.comparisons.claims.paper.flights import fly_alone_variants
from cgla_graph.comparisons.claims.paper.planner_claims import flown_by, versus_cgla
from cgla_graph.comparisons.claims.paper.printed_values import (
    TABLE_1,
    WORKING_SCALE,
    rows_with_length,
    value,
)

#: A map counts for "similar length" if the two lengths differ by at most this, relative to BCV-style's.
SIMILAR = 0.1
_LONGER = "longer-than-q-learning.toml"


@claim(
    31,
    "Table 1",
    "Risk and length of CGLA, BCV, A2D and Q-Learning, side by side.",
    "the columns measure the same thing, in the same unit, on the same map",
    Kind.PROSE,
    figures=("Table 1",),
)
def _check_c31(_: Evidence) -> Finding:
    quoted = [row.method for row in TABLE_1 if not row.own_risk]
    k50, k200 = (value("Table 1", f"CGLA, K = {k}") for k in (50, 200))
    require(k200.is_less(k50), "the rows of K = 50 and K = 200 of Table 1 are not as they are printed")
    printed = rows_with_length()
    tightest = printed[0]
    shorter = {side: sum(row.greatest_scale < side for row in printed) for side in (200.0, 256.0)}
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
                f"if a side of the map is at most {tightest.greatest_scale:.1f} units ({tightest.place}, "
                f"{tightest.method}); "
                f"{shorter[200.0]} of {len(printed)} rows are shorter than the straight line at 200 units a side, "
                f"{shorter[256.0]} at 256.",
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
        (one.place, one.method, one.length, one.straight, one.greatest_scale, one.greatest_scale / WORKING_SCALE)
        for one in rows_with_length()[:8]
    ]
    columns = ("table", "row", "printed length", "straight line", "most units a side", "detour at 160")
    return Table("Units of length that the tables allow (the eight tightest rows)", columns, rows)


@claim(
    32,
    "Section 5.1",
    "CGLA with K = 10 beats BCV in both: similar length, a quarter of the risk.",
    "as printed: 2.4318 < 10.1658 and 243 < 256; against bcv-style: greater length and risk sum for bcv-style",
    Kind.STATISTIC,
    experiments=("planners",),
    figures=("Table 1",),
)
def _check_c32(evidence: Evidence) -> Finding:
    cgla, bcv = value("Table 1", "CGLA, K = 10"), value("Table 1", "BCV")
    require(cgla.is_less(bcv), "the rows of CGLA and BCV of Table 1 are not as they are printed")
    samples = evidence.samples["planners"]
    length, risk = adjusted_together(*(versus_cgla(samples, "bcv-style", name) for name in ("length", "risk_sum")))
    return Finding(
        Verdict.NOT_TESTABLE,
        f"As printed, CGLA (K = 10) has {cgla.risk / bcv.risk:.3g} of BCV's risk at {cgla.length / bcv.length:.3g} of "
        "its length; but BCV's risk is quoted from its own paper, so this compares nothing.",
        parts=(
            Part("The printed numbers of CGLA are less", Verdict.PROVED, "2.4318 < 10.1658 and 243 < 256."),
            Part(
                "Against our BCV-style planner: BCV-style is longer and riskier",
                supported_by([*length, *risk]),
                f"length {tally(length)}; risk {tally(risk)}.",
            ),
        ),
        tables=(
            contrast_table("BCV-style against CGLA, K = 10, limited sight", [*length, *risk]),
            _similar_lengths(samples),
        ),
        notes=("bcv-style is in the style of BCV, not the original, whose text is not public.",),
    )


def _similar_lengths(samples: Samples) -> Table:
    """Compare risks where the lengths are similar: the paper has a quarter."""
    rows = []
    for cell in CELLS:
        cases = [{"mode": "online", **flown_by(planner, cell)} for planner in ("cgla", "bcv-style")]
        length, bcv_length = (samples.column("length", **case) for case in cases)
        risk, bcv_risk = (np.maximum(samples.column("risk_sum", **case), LEAST) for case in cases)
        similar = np.abs(length / bcv_length - 1.0) <= SIMILAR
        ratio = bootstrapped((risk / bcv_risk)[similar], seed=0)
        rows.append((cell_name(cell), int(similar.sum()), *finite(*ratio)))
    return Table(
        "Risk of CGLA over that of BCV-style, where their lengths differ by at most 10 %",
        ("cell", "maps", "median ratio", "95 % from", "to"),
        rows,
        "The printed numbers have 0.239; no verdict hangs on this.",
    )


@claim(
    35,
    "Abstract, Section 5.1",
    "CGLA is superior to Q-Learning, its ways included.",
    "no CGLA flight is longer than Q-Learning's under the same K",
    Kind.SCENARIO,
    figures=("Table 1",),
)
def _check_c35(_: Evidence) -> Finding:
    cgla, learned = value("Table 1", "CGLA, K = 10").length, value("Table 1", "Q-Learning").length
    flights = fly_alone_variants(counterexamples.mission(_LONGER))
    ours, theirs = flights["CGLA"], flights["Q-Learning"]
    require(
        cgla > learned and ours.length > theirs.length,
        f"{_LONGER} no longer shows that CGLA flies farther than Q-Learning: {ours.length:.3f} and {theirs.length:.3f}",
    )
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
