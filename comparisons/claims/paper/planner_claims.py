"""
Claims about other planners: BCV, A2D, Q-Learning, FBCRI, CPVS, and those of the introduction.

What flies here are planners in the style of the originals, whose texts or programs are not public: a verdict is one on
these planners, not on the originals.
"""

import math
from collections.abc import Sequence

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Claim, Finding, Kind, Part, Table, Verdict
from cgla_graph.comparisons.claims.contrasts import (
    ALPHA,
    CELLS,
    LEAST,
    RULE,
    Contrast,
    RateContrast,
    adjusted,
    all_hold,
    contrast,
    contrast_table,
    finite,
    rate_contrasts,
    rate_table,
    span,
    tally,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import at_least, paired_shift, proportion
from cgla_graph.comparisons.claims.paper import printed_values
from cgla_graph.comparisons.claims.paper.introduction_claims import check_c50
from cgla_graph.comparisons.claims.paper.planner_experiments import OWN, TRAINING, K, versus_cgla
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.comparisons.statistics.paired import holm

STYLE = (
    "Planners called -style are in the style of the originals, which are not public; verdicts are on these planners."
)
#: A learned way costs as good as the best if it costs no more than this beyond it, and how often that has to be so.
AS_GOOD_AS, MOSTLY = 0.01, 0.95
#: Of one table: what is compared in Tables 4 and 5.
_COMPANY = (("fbcri-style", "length"), ("fbcri-style", "risk_sum"), ("cpvs-style", "length"))


def check_c33(evidence: Evidence) -> Finding:
    """Check that BCV-style gets stuck, and flies long near risk."""
    samples = evidence.samples["planners"]
    pairs = []
    for cell in CELLS:
        cgla = samples.column("arrived", mode="online", planner="cgla", **cell)
        bcv = samples.column("arrived", mode="online", planner="bcv-style", integral=OWN, radius=cell["radius"])
        pairs.append(("cgla arrives > bcv-style arrives", cell, cgla, bcv))
    rates = rate_contrasts(pairs)
    exposed = adjusted(versus_cgla(samples, "bcv-style", "exposure", ratio=False))
    stuck = bool(rates) and all(one.holds for one in rates)
    near = all_hold(exposed)
    return Finding(
        _verdict(holds=stuck and near),
        f"CGLA arrives on {_rates(rates, first=True)} of the maps, BCV-style on {_rates(rates, first=False)}. Where "
        f"both arrive, BCV-style flies longer where F > 0.1 {tally(exposed)}.",
        parts=(
            Part(
                "BCV-style suffers from local minima: it arrives less often",
                _verdict(holds=stuck),
                f"in {sum(one.holds for one in rates)} of {len(rates)} cells",
            ),
            Part("BCV-style flies longer where F > 0.1", _verdict(holds=near), tally(exposed)),
        ),
        tables=(
            rate_table("Arrivals, K = 10, limited sight", rates),
            contrast_table("Length flown where F > 0.1, map units (difference)", exposed),
        ),
        notes=(STYLE,),
    )


def _rates(rates: Sequence[RateContrast], *, first: bool) -> str:
    values = [one.first if first else one.second for one in rates]
    return span(values, ".1%")


def check_c34(evidence: Evidence) -> Finding:
    """Check that A2D and Q-Learning pass high risk, and whether eight directions are the reason."""
    samples = evidence.samples["planners"]
    risks = adjusted(
        [
            *versus_cgla(samples, "a2d-style", "risk_sum", "risk sum: a2d-style > cgla"),
            *versus_cgla(samples, "q-learning", "risk_sum", "risk sum: q-learning > cgla"),
        ]
    )
    a2d, learned = risks[: len(CELLS)], risks[len(CELLS) :]
    effects = factorial(evidence.samples["directions"])
    causes = adjusted(cause_contrasts(effects))
    because = all_hold(causes)
    shares = {name: math.exp(hodges_lehmann(values.tolist()).median) for name, values in effects.items() if len(values)}
    words = ", ".join(f"{name} x {ratio:.3g}" for name, ratio in shares.items())
    return Finding(
        _verdict(holds=all_hold(risks) and because),
        f"Riskier than CGLA with limited sight: A2D-style {tally(a2d)}, Q-Learning {tally(learned)}. What multiplies "
        f"the risk sum with all known: {words}.",
        parts=(
            Part("A2D-style is riskier than CGLA", _verdict(holds=all_hold(a2d)), tally(a2d)),
            Part("Q-Learning is riskier than CGLA", _verdict(holds=all_hold(learned)), tally(learned)),
            Part(
                "The reason is that it has eight directions only",
                _verdict(holds=because),
                f"effects on the risk sum: {words}; the claim needs that of directions to be the greatest",
            ),
        ),
        tables=(
            contrast_table("Risk sums, K = 10, limited sight (ratios)", risks),
            _effects_table(effects),
            contrast_table("Effects against each other (differences of logarithms)", causes),
        ),
        notes=(
            STYLE,
            (
                "Directions: eight against any, both exact at K = 10. Objective: K = 0 against 10, both exact in eight "
                "directions. Training: learned against exact, both in eight directions at K = 10."
            ),
            (
                "No path in eight directions is longer than 1.0824 times the straight one (C26): too little for Table "
                "1's Q-Learning to have 11 times CGLA's risk by that alone; its risk is quoted from another paper."
            ),
        ),
    )


def factorial(samples: Samples) -> dict[str, FloatArray]:
    """
    Return three effects on the logarithm of the risk sum, over the maps on which all four ways were found.

    Parameters
    ----------
    samples
        Of the experiment `directions`.

    Returns
    -------
    effects
        Of directions, objective and training, shape ``(m,)`` each.
    """
    arms = {
        "any": {"directions": "any", "k": K, "method": "exact"},
        "eight": {"directions": "eight", "k": K, "method": "exact"},
        "blind": {"directions": "eight", "k": 0.0, "method": "exact"},
        "learned": {"directions": "eight", "k": K, "method": "learned"},
    }
    logs = {name: np.log(np.maximum(samples.column("risk_sum", **case), LEAST)) for name, case in arms.items()}
    found = np.isfinite(np.column_stack(list(logs.values()))).all(axis=1)
    base = logs["eight"][found]
    return {
        "directions": base - logs["any"][found],
        "objective": logs["blind"][found] - base,
        "training": logs["learned"][found] - base,
    }


def cause_contrasts(effects: dict[str, FloatArray]) -> list[Contrast]:
    """Compare the effect of directions with nothing, and with the two others; not adjusted yet."""
    directions = effects["directions"]
    others = {"none": np.zeros_like(directions), "objective": effects["objective"], "training": effects["training"]}
    shifts = {name: paired_shift(directions, other) for name, other in others.items()}
    return [Contrast(f"directions > {name}", {}, shift, shift.p) for name, shift in shifts.items()]


def _effects_table(effects: dict[str, FloatArray]) -> Table:
    rows = []
    for name, values in effects.items():
        shift = paired_shift(values, np.zeros_like(values))
        ratios = finite(*(float(np.exp(end)) if end < math.log(1e300) else math.inf for end in shift.shift))
        rows.append((name, shift.n, *ratios, shift.effect))
    columns = ("factor", "maps", "multiplies the risk sum by", "95 % from", "to", "effect")
    return Table("What makes a way in eight directions risky, all known", columns, rows)


def check_c44(evidence: Evidence) -> Finding:
    """Check CGLA against FBCRI-style and CPVS-style with three UAVs."""
    samples = evidence.samples["three-uavs"]
    contrasts = adjusted(company_contrasts(samples))
    groups: dict[str, list[Contrast]] = {}
    for one in contrasts:
        groups.setdefault(one.what, []).append(one)
    rows = []
    for what, group in groups.items():
        medians = [one.shift.shift.median for one in group]
        effects = [one.shift.effect for one in group]
        held = sum(one.holds for one in group)
        rows.append(
            (what, group[0].shift.n, *finite(min(medians), max(medians)), min(effects), f"{held} of {len(group)}")
        )
    columns = ("first > second", "pairs", "ratio from", "to", "least effect", "cells")
    return Finding(
        _verdict(holds=all_hold(contrasts)),
        f"CGLA is shorter than both and less risky than FBCRI-style in {sum(one.holds for one in contrasts)} of "
        f"{len(contrasts)} comparisons (three UAVs x three comparisons x six cells).",
        parts=tuple(
            Part(what, _verdict(holds=all_hold(group)), tally(group)) for what, group in _by_measure(contrasts).items()
        ),
        tables=(
            Table("Three UAVs that tell each other what they see, K = 10 (ratios over six cells)", columns, rows, RULE),
            arrivals(samples),
        ),
        notes=(
            STYLE,
            "Compared where both planners arrive; threats within 0.12 of a start are left out of the random maps.",
            "CPVS's risks are not printed. In the paper, lengths are similar for UAV 1 only (186 against 195).",
        ),
    )


def company_contrasts(samples: Samples) -> list[Contrast]:
    """Compare each UAV's flights, planner by planner and cell by cell; not adjusted yet."""
    return [
        contrast(
            samples,
            f"UAV {uav}, {measure}: {planner} > cgla",
            measure,
            {"planner": planner, "integral": OWN, "radius": cell["radius"]},
            {"planner": "cgla", **cell},
            {"uav": uav},
            name=cell,
        )
        for planner, measure in _COMPANY
        for uav in ("1", "2", "3")
        for cell in CELLS
    ]


def _by_measure(contrasts: Sequence[Contrast]) -> dict[str, list[Contrast]]:
    groups: dict[str, list[Contrast]] = {}
    for one in contrasts:
        groups.setdefault(one.what.partition(", ")[2], []).append(one)
    return groups


def arrivals(samples: Samples) -> Table:
    """Tell how often each planner's UAVs arrive, over all cells."""
    rows = []
    for case in samples.cases("planner"):
        rate = proportion([float(record["arrived"]) for record in samples.where(**case)])
        rows.append((case["planner"], rate.n, rate.rate))
    return Table("Arrivals", ("planner", "flights", "arrived"), rows)


def check_c52(evidence: Evidence) -> Finding:
    """Say why the comparison with Q-Learning after Table 3 cannot be checked, and make our own."""
    samples = evidence.samples["planners"]
    contrasts = adjusted(
        [
            *versus_cgla(samples, "q-learning", "cost", "cost: q-learning > cgla"),
            *versus_cgla(samples, "q-learning", "risk_sum", "risk sum: q-learning > cgla"),
        ]
    )
    cost, risk = contrasts[: len(CELLS)], contrasts[len(CELLS) :]
    return Finding(
        Verdict.NOT_TESTABLE,
        "Table 3 compares CGLA with and without sharing and has no row of Q-Learning. Our own single flights: "
        f"Q-Learning costs more {tally(cost)}, and is riskier {tally(risk)}.",
        tables=(contrast_table("Q-Learning against CGLA, K = 10, limited sight (ratios)", contrasts),),
        notes=(
            "Our Q-Learning pays for risk as CGLA does (reward -(length + K * risk)) and is trained anew at each plan.",
        ),
    )


def check_c53(evidence: Evidence) -> Finding:
    """Check that Q-Learning does well where all of the map is known."""
    samples = evidence.samples["training"]
    excess = {share: samples.column("excess", share=share) for share in TRAINING}
    # who finds no way is not as good as the best
    good = {
        share: np.where(np.isnan(samples.column("arrived", share=share)), math.nan, values <= AS_GOOD_AS)
        for share, values in excess.items()
    }
    p_values = holm([at_least(one, MOSTLY) for one in good.values()])
    rows = []
    for share, p in zip(TRAINING, p_values, strict=True):
        rate, found = proportion(good[share]), excess[share][np.isfinite(excess[share])]
        median = float(np.median(found)) if len(found) else None
        arrived = proportion(samples.column("arrived", share=share))
        rows.append((share, rate.n, *finite(arrived.rate, rate.rate), *rate.interval, median, p, p < ALPHA))
    whole = rows[-1]
    columns = ("share of training", "maps", "finds a way", "as good", "95 % from", "to", "median excess", "p", "holds")
    table_1 = {name: printed_values.value("Table 1", name).risk for name in ("Q-Learning", "CGLA, K = 10")}
    printed = (table_1["Q-Learning"] or math.nan) / (table_1["CGLA, K = 10"] or math.nan)
    return Finding(
        _verdict(holds=bool(whole[-1])),
        f"Trained to the end, Q-Learning is within {AS_GOOD_AS:.0%} of the best way in eight directions on "
        f"{whole[3] or 0.0:.1%} of {whole[1]} maps ({whole[4]:.3g} to {whole[5]:.3g}); with a hundredth of the "
        f"episodes on {rows[0][3] or 0.0:.1%}.",
        tables=(
            Table(
                "Q-Learning against the exact optimum in eight directions, all known, K = 10",
                columns,
                rows,
                f"Rule, set before the sample was drawn: supported if, at full training, the share that is within "
                f"{AS_GOOD_AS:.0%} is shown to be above {MOSTLY:.0%} (exact binomial test, Holm over this table).",
            ),
        ),
        notes=(
            (
                "Its best way in eight directions costs at most 1.0824 times CGLA's in free space. So a Q-Learner that "
                f"minds risk, knows the map and is trained to the end cannot have the {printed:.3g} times greater risk "
                "that Table 1 prints for it, were it of the same map and measure."
            ),
        ),
    )


def _verdict(*, holds: bool) -> Verdict:
    return Verdict.SUPPORTED if holds else Verdict.NOT_SUPPORTED


CLAIMS = (
    Claim(
        "C33",
        "Section 5.1",
        "BCV suffers from local minima, and flies a long way close to risk.",
        "bcv-style arrives less often than cgla (McNemar), and flies longer where F > 0.1 (Wilcoxon), in six cells",
        Kind.STATISTIC,
        check_c33,
        ("planners",),
        ("Fig. 5", "Table 1"),
    ),
    Claim(
        "C34",
        "Section 5.1",
        "A2D and Q-Learning pass regions of high risk; Q-Learning all the more as it has eight directions only.",
        "a2d-style and q-learning have greater risk sums than cgla in six cells; with all known, the effect of eight "
        "directions on the risk sum exceeds those of the objective and of training",
        Kind.STATISTIC,
        check_c34,
        ("planners", "directions"),
        ("Fig. 5", "Table 1"),
    ),
    Claim(
        "C44",
        "Section 5.2, Tables 4 and 5",
        "With three UAVs CGLA is shorter than FBCRI and CPVS, and far less risky than FBCRI.",
        "for each UAV, in six cells: greater lengths of fbcri-style and cpvs-style, greater risk sums of fbcri-style",
        Kind.STATISTIC,
        check_c44,
        ("three-uavs",),
        ("Fig. 10", "Table 4", "Table 5"),
    ),
    Claim(
        "C50",
        "Section 1",
        "Voronoi and visibility graphs do for simple maps only and fail fatally on partial ones; MILP fails when "
        "something changes suddenly; A2D fails on complex maps; evolution finds feasible ways quickly.",
        "five parts, each with a rule of its own, with 2 to 20 threats",
        Kind.STATISTIC,
        check_c50,
        ("threat-count", "planners"),
    ),
    Claim(
        "C52",
        "Section 5.2, after Table 3",
        "Compared with Q-Learning, the result with sharing is much better.",
        "none: the table has no row of Q-Learning",
        Kind.PROSE,
        check_c52,
        ("planners",),
        ("Table 3",),
    ),
    Claim(
        "C53",
        "Section 1",
        "Q-Learning performs well when all of the map is known.",
        "P(cost of the learned way <= 1.01 times the best in eight directions) > 0.95 after all episodes",
        Kind.STATISTIC,
        check_c53,
        ("training",),
    ),
)
