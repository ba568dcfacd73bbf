"""What the introduction says of other planners (C50): simple maps, partial maps, sudden changes, speed."""

import math
from collections.abc import Sequence

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Finding, Part, Table, Verdict
from cgla_graph.comparisons.claims.contrasts import ALPHA, Case, RateContrast, finite, rate_contrasts, rate_table
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import Shift, at_least, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.planner_experiments import EVOLUTION, NAMED, THREATS
from cgla_graph.comparisons.statistics.paired import holm

#: A planner is effective while its ways cost no more than this beyond the best, in the median.
EFFECTIVE = 0.1
#: What counts as a short time to plan, seconds, and how often that is to be met.
SHORT, MOSTLY = 5.0, 0.95
#: Those that are said to do for simple maps only.
GEOMETRIC = ("voronoi", "visibility-graph")
FEW, SEVERAL, MANY = THREATS[0], THREATS[2], THREATS[-1]
RULE = (
    "Rules, set before the sample was drawn. Simple maps only: the excess over the best way is shown to be greater "
    f"with {MANY} threats than with {FEW}, and its median with {MANY} to be above {EFFECTIVE:.0%}. Fatal on partial "
    f"maps: arrives less often with limited sight than with all known ({SEVERAL} threats). Sudden changes: milp "
    f"arrives less often than cgla. Complex maps: a2d-style arrives less often with {MANY} than with {FEW} threats. "
    f"Quickly: a way within {SHORT:g} s on more than {MOSTLY:.0%} of maps with {SEVERAL} threats. Holm over all tests; "
    "the claim is supported if all parts are."
)


def check_c50(evidence: Evidence) -> Finding:
    """Check five remarks on other planners."""
    samples = evidence.samples["threat-count"]
    rates = rate_contrasts(_rate_pairs(samples))
    partial, sudden, complex_maps = rates[:2], rates[2], rates[3]
    growth = [(name, *_growth(samples, name)) for name in GEOMETRIC]
    quick = _quick(evidence.samples["planners"])
    p_values = holm([p for _, rises, above in growth for p in (rises.p, above)] + [at_least(quick, MOSTLY)])
    simple_only = all(
        rises.effect > 0.0 and max(p_values[2 * i : 2 * i + 2]) < ALPHA for i, (_, rises, _) in enumerate(growth)
    )
    in_time = proportion(quick)
    said = [
        ("Voronoi and visibility graph do for simple maps only", simple_only, _growth_words(samples)),
        ("They fail fatally on partial maps", all(one.holds for one in partial), _rate_words(partial)),
        ("MILP fails when something changes suddenly", sudden.holds, _rate_words([sudden])),
        ("A2D fails on complex maps", complex_maps.holds, _rate_words([complex_maps])),
        (
            "Evolution finds a feasible way quickly",
            p_values[-1] < ALPHA,
            f"within {SHORT:g} s on {in_time.rate:.1%} of {in_time.n} maps",
        ),
    ]
    held = [words for words, holds, _ in said if holds]
    return Finding(
        _verdict(holds=len(held) == len(said)),
        f"{len(held)} of {len(said)} remarks are supported{': ' + '; '.join(held) if held else ''}.",
        parts=tuple(Part(words, _verdict(holds=holds), result) for words, holds, result in said),
        tables=(
            _by_threats(samples, "excess", "offline", "Median excess over the best way, all known"),
            _by_threats(samples, "arrived", "online", "Share of flights with limited sight that arrive"),
            rate_table("Rates (each planner in the style of the original)", rates, RULE),
        ),
        notes=(
            RULE,
            (
                "Any of them can be asked again whenever something new is seen, as they are here; then partial maps "
                "and sudden threats need not be fatal."
            ),
            "The best way is that of fast marching over the plane. Seconds are those of the machine that ran this.",
        ),
    )


def _rate_pairs(samples: Samples) -> list[tuple[str, Case, FloatArray, FloatArray]]:
    pairs: list[tuple[str, Case, FloatArray, FloatArray]] = []
    for name in GEOMETRIC:
        known, seen = (
            samples.column("arrived", planner=name, mode=mode, threats=SEVERAL) for mode in ("offline", "online")
        )
        pairs.append((f"{name}: all known > limited sight", {"threats": SEVERAL}, known, seen))
    cgla, milp = (samples.column("arrived", planner=name, mode="sudden") for name in ("cgla", "milp"))
    pairs.append(("sudden threat: cgla > milp", {}, cgla, milp))
    few, many = (samples.column("arrived", planner="a2d-style", mode="online", threats=count) for count in (FEW, MANY))
    pairs.append((f"a2d-style: M = {FEW} > {MANY}", {}, few, many))
    return pairs


def _excess(samples: Samples, name: str, count: int) -> FloatArray:
    return samples.column("excess", planner=name, mode="offline", threats=count)


def _growth(samples: Samples, name: str) -> tuple[Shift, float]:
    """Compare the excess with many threats to that with few, and give the p-value that it is not above the limit."""
    few, many = (_excess(samples, name, count) for count in (FEW, MANY))
    above = paired_shift(many, np.full_like(many, EFFECTIVE))
    return paired_shift(many, few), above.p if above.effect > 0.0 else 1.0


def _growth_words(samples: Samples) -> str:
    words = []
    for name in GEOMETRIC:
        few, many = (_median(_excess(samples, name, count)) for count in (FEW, MANY))
        words.append(f"{name}: median excess {few:.2%} with {FEW} threats, {many:.2%} with {MANY}")
    return "; ".join(words)


def _rate_words(rates: Sequence[RateContrast]) -> str:
    return "; ".join(f"{one.what}: {one.first:.1%} against {one.second:.1%}, p = {one.p_holm:.2g}" for one in rates)


def _quick(samples: Samples) -> FloatArray:
    """Tell on which maps evolution found a way in time."""
    case = {"planner": EVOLUTION, "mode": "offline"}
    arrived, seconds = samples.column("arrived", **case), samples.column("seconds", **case)
    return np.where(np.isnan(arrived), math.nan, (arrived == 1.0) & (seconds <= SHORT))


def _by_threats(samples: Samples, measure: str, mode: str, title: str) -> Table:
    """Make a table of one measurement: planners down, numbers of threats across."""
    rows = []
    for name in NAMED:
        columns = [samples.column(measure, planner=name, mode=mode, threats=count) for count in THREATS]
        rates = measure == "arrived"
        rows.append((name, *finite(*(proportion(one).rate if rates else _median(one) for one in columns))))
    return Table(title, ("planner", *(f"M = {count}" for count in THREATS)), rows)


def _median(values: FloatArray) -> float:
    kept = values[np.isfinite(values)]
    return float(np.median(kept)) if len(kept) else math.nan


def _verdict(*, holds: bool) -> Verdict:
    return Verdict.SUPPORTED if holds else Verdict.NOT_SUPPORTED
