"""
Claims about other planners (C33, C34, C44, C52): BCV, A2D, Q-Learning, FBCRI, CPVS.

What flies here are planners in the style of the originals, whose texts or programs are not public: a verdict is one on
these planners, not on the originals.
"""

import math
from collections.abc import Callable, Sequence

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    LEAST,
    RADII,
    RULE,
    Case,
    Contrast,
    adjusted,
    adjusted_together,
    contrast,
    contrast_part,
    contrast_table,
    finite,
    rate_contrasts,
    rate_table,
    span,
    supported_by,
    tally,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import (
    K,
    fly_alone,
    fly_from,
    measures,
    paper_lattice,
    path_measures,
    plan_measures,
)
from cgla_graph.comparisons.claims.paper.introduction_claims import EVOLUTION
from cgla_graph.comparisons.claims.paper.printed_values import STARTS
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.random_map import CLEAR, random_scenario
from cgla_graph.solvers import solve

#: What stands for the integral of planners that weigh no graph's edges: they have no raster reading.
OWN = "own"
#: Those of the paper's comparison and introduction that take well below a second, and reactive ones beside them.
PLANNERS = (
    "bcv-style",
    "a2d-style",
    "q-learning",
    "fbcri-style",
    "cpvs-style",
    "voronoi",
    "visibility-graph",
    "potential-field",
    "bendy-ruler",
)
#: What flies in company (Fig. 10, Tables 4 and 5).
COMPANY = ("cgla", "fbcri-style", "cpvs-style")
STYLE = (
    "Planners called -style are in the style of the originals, which are not public; verdicts are on these planners."
)


@experiment("planners", quick=8)
def planners(seed: int) -> list[Record]:
    """Let every planner plan on a random map with all of it known, and fly it with limited sight."""
    problem = random_scenario(seed, k=K).problem
    offline = [{"planner": name, **plan_measures(problem, name)} for name in ("cgla", *PLANNERS, EVOLUTION)]
    cases = [("cgla", cell) for cell in CELLS] + [(name, {"radius": radius}) for name in PLANNERS for radius in RADII]
    online = [
        {**flown_by(name, cell), **measures(fly_alone(problem.field, k=K, solver=name, **cell))} for name, cell in cases
    ]
    return [{"mode": "offline", **one} for one in offline] + [{"mode": "online", **one} for one in online]


def flown_by(planner: str, cell: Case) -> Case:
    """Return the case of a planner's flights in a cell."""
    return {"planner": planner, **cell, "integral": cell["integral"] if planner == "cgla" else OWN}


def versus_cgla(samples: Samples, planner: str, measure: str, *, ratio: bool = True, uav: str = "") -> list[Contrast]:
    """
    Compare a planner's flights with CGLA's in all cells: the planner's value is claimed to be greater.

    Parameters
    ----------
    samples
        Of the experiment `planners`, or of `three_uavs`.
    planner, measure
        Names.
    ratio
        Compare ratios, else differences.
    uav
        Which one of `three_uavs`.

    Returns
    -------
    contrasts
        One a cell, over the maps on which both arrive, not adjusted yet.
    """
    words = f"{measure.replace('_', ' ')}: {planner} > cgla"
    shared = {"uav": uav} if uav else {"mode": "online"}
    return [
        contrast(
            samples,
            f"UAV {uav}, {words}" if uav else words,
            measure,
            flown_by(planner, cell),
            flown_by("cgla", cell),
            shared,
            ratio=ratio,
            name=cell,
        )
        for cell in CELLS
    ]


@experiment("three-uavs", quick=6)
def three_uavs(seed: int) -> list[Record]:
    """Fly the three UAVs of Fig. 10 on a random map; what one sees, all know."""
    # the paper's UAVs do not start within a threat
    field = RiskField(
        threat
        for threat in random_scenario(seed).problem.field.threats
        if all(math.dist((threat.x, threat.y), start) >= CLEAR for start in STARTS)
    )
    starts = {f"{number + 1}": start for number, start in enumerate(STARTS)}
    records: list[Record] = []
    for name in COMPANY:
        for cell in CELLS if name == "cgla" else CELLS[: len(RADII)]:
            flight = fly_from(starts, field, k=K, solver=name, collisions="record", **cell)
            case = flown_by(name, cell)
            records += [{**case, "uav": uav, **measures(one)} for uav, one in flight.uavs.items()]
    return records


@experiment("directions", quick=40)
def directions(seed: int) -> list[Record]:
    """Plan with all of the map known: eight directions or any, minding risk or not, exactly or by tabular learning."""
    problem = random_scenario(seed, k=K).problem
    records: list[Record] = []
    for k in (K, 0.0):
        asked = Problem(problem.start, problem.goal, field=problem.field, k=k, bounds=problem.bounds)
        for directed, method, name in (
            ("any", "exact", "cgla"),
            ("eight", "exact", "eight-direction"),
            ("eight", "learned", "q-learning"),
        ):
            found = solve(asked, name, resolution=paper_lattice())
            records.append({"directions": directed, "k": k, "method": method, **path_measures(problem.field, found)})
    return records


@claim(
    33,
    "Section 5.1",
    "BCV suffers from local minima, and flies a long way close to risk.",
    "bcv-style arrives less often than cgla (McNemar), and flies longer where F > 0.1 (Wilcoxon), in six cells",
    Kind.STATISTIC,
    experiments=("planners",),
    figures=("Fig. 5", "Table 1"),
)
def _check_c33(evidence: Evidence) -> Finding:
    samples = evidence.samples["planners"]
    rates = rate_contrasts(
        [
            (
                "cgla arrives > bcv-style arrives",
                cell,
                samples.column("arrived", mode="online", **flown_by("cgla", cell)),
                samples.column("arrived", mode="online", **flown_by("bcv-style", cell)),
            )
            for cell in CELLS
        ]
    )
    exposed = adjusted(versus_cgla(samples, "bcv-style", "exposure", ratio=False))
    cgla, bcv = (span([getattr(one, which) for one in rates], ".1%") for which in ("first", "second"))
    return Finding(
        supported_by([*rates, *exposed]),
        f"CGLA arrives on {cgla} of the maps, BCV-style on {bcv}. Where "
        f"both arrive, BCV-style flies longer where F > 0.1 {tally(exposed)}.",
        parts=(
            Part(
                "BCV-style suffers from local minima: it arrives less often",
                supported_by(rates),
                f"in {sum(one.holds for one in rates)} of {len(rates)} cells",
            ),
            contrast_part("BCV-style flies longer where F > 0.1", exposed),
        ),
        tables=(
            rate_table("Arrivals, K = 10, limited sight", rates),
            contrast_table("Length flown where F > 0.1, map units (difference)", exposed),
        ),
        notes=(STYLE,),
    )


@claim(
    34,
    "Section 5.1",
    "A2D and Q-Learning pass regions of high risk; Q-Learning all the more as it has eight directions only.",
    "a2d-style and q-learning have greater risk sums than cgla in six cells; with all known, the effect of eight "
    "directions on the risk sum exceeds those of the objective and of training",
    Kind.STATISTIC,
    experiments=("planners", "directions"),
    figures=("Fig. 5", "Table 1"),
)
def _check_c34(evidence: Evidence) -> Finding:
    samples = evidence.samples["planners"]
    a2d, learned = adjusted_together(*(versus_cgla(samples, name, "risk_sum") for name in ("a2d-style", "q-learning")))
    effects = factorial(evidence.samples["directions"])
    causes = adjusted(cause_contrasts(effects))
    shares = {name: math.exp(hodges_lehmann(values.tolist()).median) for name, values in effects.items() if len(values)}
    words = ", ".join(f"{name} x {ratio:.3g}" for name, ratio in shares.items())
    return Finding(
        supported_by([*a2d, *learned, *causes]),
        f"Riskier than CGLA with limited sight: A2D-style {tally(a2d)}, Q-Learning {tally(learned)}. What multiplies "
        f"the risk sum with all known: {words}.",
        parts=(
            contrast_part("A2D-style is riskier than CGLA", a2d),
            contrast_part("Q-Learning is riskier than CGLA", learned),
            Part(
                "The reason is that it has eight directions only",
                supported_by(causes),
                f"effects on the risk sum: {words}; the claim needs that of directions to be the greatest",
            ),
        ),
        tables=(
            contrast_table("Risk sums, K = 10, limited sight (ratios)", [*a2d, *learned]),
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
    """Return three effects on the logarithm of the risk sum, on each map on which all four paths were found."""
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


@claim(
    44,
    "Section 5.2, Tables 4 and 5",
    "With three UAVs CGLA is shorter than FBCRI and CPVS, and far less risky than FBCRI.",
    "for each UAV, in six cells: greater lengths of fbcri-style and cpvs-style, greater risk sums of fbcri-style",
    Kind.STATISTIC,
    experiments=("three-uavs",),
    figures=("Fig. 10", "Table 4", "Table 5"),
)
def _check_c44(evidence: Evidence) -> Finding:
    samples = evidence.samples["three-uavs"]
    contrasts = adjusted(company_contrasts(samples))
    rows = []
    for what, group in _grouped(contrasts, lambda one: one.what).items():
        medians = [one.shift.shift.median for one in group]
        effects = [one.shift.effect for one in group]
        held = sum(one.holds for one in group)
        rows.append(
            (what, group[0].shift.n, *finite(min(medians), max(medians)), min(effects), f"{held} of {len(group)}")
        )
    columns = ("first > second", "pairs", "ratio from", "to", "least effect", "cells")
    return Finding(
        supported_by(contrasts),
        f"CGLA is shorter than both and less risky than FBCRI-style in {sum(one.holds for one in contrasts)} of "
        f"{len(contrasts)} comparisons (three UAVs x three comparisons x six cells).",
        parts=tuple(
            contrast_part(what, group)
            for what, group in _grouped(contrasts, lambda one: one.what.partition(", ")[2]).items()
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
    pairs = (("fbcri-style", "length"), ("fbcri-style", "risk_sum"), ("cpvs-style", "length"))
    return [
        one for planner, measure in pairs for uav in "123" for one in versus_cgla(samples, planner, measure, uav=uav)
    ]


def _grouped(contrasts: Sequence[Contrast], words: Callable[[Contrast], str]) -> dict[str, list[Contrast]]:
    groups: dict[str, list[Contrast]] = {}
    for one in contrasts:
        groups.setdefault(words(one), []).append(one)
    return groups


def arrivals(samples: Samples) -> Table:
    """Tell how often each planner's UAVs arrive, over all cells."""
    rows = []
    for case in samples.cases("planner"):
        rate = proportion([float(record["arrived"]) for record in samples.where(**case)])
        rows.append((case["planner"], rate.n, rate.rate))
    return Table("Arrivals", ("planner", "flights", "arrived"), rows)


@claim(
    52,
    "Section 5.2, after Table 3",
    "Compared with Q-Learning, the result with sharing is much better.",
    "none: the table has no row of Q-Learning",
    Kind.PROSE,
    experiments=("planners",),
    figures=("Table 3",),
)
def _check_c52(evidence: Evidence) -> Finding:
    samples = evidence.samples["planners"]
    cost, risk = adjusted_together(*(versus_cgla(samples, "q-learning", name) for name in ("cost", "risk_sum")))
    return Finding(
        Verdict.NOT_TESTABLE,
        "Table 3 compares CGLA with and without sharing and has no row of Q-Learning. Our own single flights: "
        f"Q-Learning costs more {tally(cost)}, and is riskier {tally(risk)}.",
        tables=(contrast_table("Q-Learning against CGLA, K = 10, limited sight (ratios)", [*cost, *risk]),),
        notes=(
            "Our Q-Learning pays for risk as CGLA does (reward -(length + K * risk)) and is trained anew at each plan.",
        ),
    )
