"""What the introduction says of other planners (C50): simple maps, partial maps, sudden changes, speed."""

import math
from collections.abc import Sequence
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, claim, supported
from cgla_graph.comparisons.claims.contrasts import (
    ALPHA,
    MOSTLY,
    Case,
    RateContrast,
    all_hold,
    finite,
    rate_contrasts,
    rate_table,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import Shift, at_least, median, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import RADIUS, STEP, K, fly_alone, measures, plan_measures
from cgla_graph.comparisons.statistics.paired import holm
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import solve

#: Said to be quick where all is known; its flights take too long for every map.
EVOLUTION = "evolutionary"
#: Those of its introduction, slow ones among them, and how many threats they meet.
NAMED = ("cgla", "voronoi", "visibility-graph", "milp", EVOLUTION, "a2d-style")
THREATS = (2, 5, 10, 20)
#: A sudden threat on the straight way, a detection radius ahead of the UAV when it has flown so many ticks.
SUDDEN_TICK, SUDDEN_SPREAD = 15, 0.055
#: A planner is effective while its ways cost no more than this beyond the best, in the median.
EFFECTIVE = 0.1
#: What counts as a short time to plan, seconds.
SHORT = 5.0
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


@experiment("threat-count", quick=1, share=0.2)
def threat_count(seed: int) -> list[Record]:
    """Plan and fly with 2 to 20 threats, and with one that appears on the way; maps with more hold those with fewer."""
    records: list[Record] = []
    for count in THREATS:
        problem = random_scenario(seed, threats=count, k=K).problem
        best = solve(problem, "fast-marching").cost
        for name in NAMED:
            offline = plan_measures(problem, name)
            excess = offline["cost"] / best - 1.0 if offline["arrived"] else None
            case = {"threats": count, "planner": name}
            records.append({**case, "mode": "offline", **offline, "excess": excess})
            flight = fly_alone(problem.field, k=K, solver=name)
            records.append({**case, "mode": "online", **measures(flight)})
    field = random_scenario(seed, threats=THREATS[1], k=K).problem.field
    return [*records, *({"planner": name, "mode": "sudden", **_surprised(field, name)} for name in ("cgla", "milp"))]


def _surprised(field: RiskField, name: str) -> dict[str, Any]:
    """Fly with a threat that appears ahead of the straight way, in sight."""
    ahead = 0.1 + (SUDDEN_TICK * STEP + 0.7 * RADIUS) / 2.0**0.5
    sudden = TimedThreat(Threat(ahead, ahead, spread=SUDDEN_SPREAD), appears=SUDDEN_TICK)
    return measures(fly_alone(field, k=K, solver=name, timed=[sudden]))


@claim(
    50,
    "Section 1",
    "Voronoi and visibility graphs do for simple maps only and fail fatally on partial ones; MILP fails when "
    "something changes suddenly; A2D fails on complex maps; evolution finds feasible ways quickly.",
    "five parts, each with a rule of its own, with 2 to 20 threats",
    Kind.STATISTIC,
    experiments=("threat-count", "planners"),
)
def _check_c50(evidence: Evidence) -> Finding:
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
        ("They fail fatally on partial maps", all_hold(partial), _rate_words(partial)),
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
        supported(len(held) == len(said)),
        f"{len(held)} of {len(said)} remarks are supported{': ' + '; '.join(held) if held else ''}.",
        parts=tuple(Part(words, supported(holds), result) for words, holds, result in said),
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
        few, many = (median(_excess(samples, name, count)) for count in (FEW, MANY))
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
        rows.append((name, *finite(*(proportion(one).rate if rates else median(one) for one in columns))))
    return Table(title, ("planner", *(f"M = {count}" for count in THREATS)), rows)
