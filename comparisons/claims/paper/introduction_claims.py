"""What the introduction says of other planners (C50): simple maps, partial maps, sudden changes, speed."""

import math
from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, claim
from cgla_graph.comparisons.claims.contrasts import (
    ALPHA,
    MOSTLY,
    Case,
    Contrast,
    contrast_part,
    contrast_table,
    finite,
    judged_part,
    share_part,
    share_table,
    shares,
    span,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import log_shift, median, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import RADIUS, STEP, K, fly_alone, measures, plan_measures
from cgla_graph.comparisons.claims.paper.learners import by_level
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.mission.world import TimedThreat
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get, solve

#: Said to be quick where all is known; its flights take too long for every map.
EVOLUTION = "evolutionary"
#: How many threats there are.
THREATS = (2, 5, 10, 20)
FEW, SEVERAL, MANY = THREATS[0], THREATS[2], THREATS[-1]
#: Those that are said to do for simple maps only, and to fail on partial ones: Voronoi graphs with and without what
#: makes their ways straight, and visibility graphs of polygons so many spreads around threats.
GEOMETRIC: dict[str, Solver] = {
    "voronoi": get("voronoi"),
    "voronoi without chain": get("voronoi", masses=0),
    **{f"visibility-graph {spreads:g}": get("visibility-graph", spreads=spreads) for spreads in (2.0, 2.5, 3.0)},
}
#: Those that plan with all known.
PLANNED: dict[str, Solver] = {"cgla": get("cgla"), **GEOMETRIC, EVOLUTION: get(EVOLUTION)}
#: By the risk that A2D-style tolerates before it turns aside, the default first.
A2D: dict[str, Solver] = {
    f"a2d-style, threshold {threshold:g}": get("a2d-style", threshold=threshold) for threshold in (0.1, 0.03, 0.01)
}
#: Those that fly both planning again and on their first plan.
FLOWN = ("cgla", *GEOMETRIC)
#: Whether a flight plans again when it sees something new, or flies the plan that it began with.
AGAIN, OLD = "change", "never"
#: When something changes suddenly: a threat comes up on the way, a little less than a detection radius ahead.
SUDDEN_TICK, SUDDEN_SPREAD = 15, 0.055
AHEAD = round(0.7 * RADIUS / STEP)
#: A radius in which all of the map is seen.
ALL_OF_IT = 2.0
#: A planner does well while what it costs is no more than this beyond the best, or beyond another one; it fails else.
MARGIN = 0.1
#: What counts as a short time to plan, seconds.
SHORT = 5.0
RULE = (
    f"Rules, set before the sample was drawn; all by Wilcoxon's test, with a margin of {MARGIN:.0%} of the cost. "
    f"Simple maps only: the way costs less than that beyond the best with {FEW} threats, and more with {MANY}. "
    f"Fatal on partial maps: flights cost more than that beyond the same planner's way with all known ({SEVERAL} "
    "threats). Sudden changes: with a threat that comes up on its way, milp's old plan costs more than that beyond a "
    "new one; planning again, milp costs more than that beyond cgla. Complex maps: a2d-style costs more than that "
    f"beyond cgla with {MANY} threats, and more so than with {FEW}. Quickly: a way within {SHORT:g} s on more than "
    f"{MOSTLY:.0%} of maps (binomial test), for every number of threats. Each is supported if all its rows show it (p "
    f"below {ALPHA:g}), contradicted if some shows the opposite (Holm over its rows), else undecided."
)


@experiment("threat-count", quick=4, share=0.5)
def threat_count(seed: int) -> list[Record]:
    """Plan and fly with 2 to 20 threats, and with one that comes up on the way; more threats hold those of fewer."""
    records: list[Record] = []
    for count in THREATS:
        problem = random_scenario(seed, threats=count, k=K).problem
        best = solve(problem, "fast-marching").cost
        for name, solver in PLANNED.items():
            offline = plan_measures(problem, solver)
            excess = offline["cost"] / best - 1.0 if offline["arrived"] else None
            records.append({"threats": count, "planner": name, "mode": "offline", **offline, "excess": excess})
        flown = [(name, PLANNED[name], replan) for name in FLOWN for replan in (AGAIN, OLD)]
        for name, solver, replan in [*flown, *((name, solver, AGAIN) for name, solver in A2D.items())]:
            flight = fly_alone(problem.field, k=K, solver=solver, replan=replan)
            case = {"threats": count, "planner": name, "mode": "online", "replan": replan}
            records.append({**case, **measures(flight)})
    field = random_scenario(seed, threats=THREATS[1], k=K).problem.field
    return [*records, *_surprised(field)]


def _surprised(field: RiskField) -> list[Record]:
    """Fly with all known, and a threat that comes up ahead on the way of milp."""
    calm = fly_alone(field, k=K, solver="milp", radius=ALL_OF_IT, replan=OLD)
    ahead = calm.position_at(min(SUDDEN_TICK + AHEAD, calm.ended))
    if ahead is None:
        return []
    sudden = TimedThreat(Threat(*ahead, spread=SUDDEN_SPREAD), appears=SUDDEN_TICK)
    records: list[Record] = []
    for name in ("milp", "cgla"):
        for replan in (AGAIN, OLD):
            flight = fly_alone(field, k=K, solver=name, radius=ALL_OF_IT, replan=replan, timed=[sudden])
            records.append({"planner": name, "mode": "sudden", "replan": replan, **measures(flight)})
    return records


@claim(
    50,
    "Section 1",
    "Voronoi and visibility graphs do for simple maps only and fail fatally on partial ones; MILP fails when "
    "something changes suddenly; A2D fails on complex maps; evolution finds feasible ways quickly.",
    "five parts, each with a rule of its own, by cost, with 2 to 20 threats, on the first plan and planning again",
    Kind.STATISTIC,
    experiments=("threat-count",),
)
def _check_c50(evidence: Evidence) -> Finding:
    samples = evidence.samples["threat-count"]
    does = {count: {name: [_does(samples, name, count)] for name in GEOMETRIC} for count in (FEW, MANY)}
    partial = {replan: {name: [_partial(samples, name, replan)] for name in GEOMETRIC} for replan in (OLD, AGAIN)}
    sudden = {replan: [_sudden(samples, replan)] for replan in (OLD, AGAIN)}
    crowded = {name: _crowded(samples, name) for name in A2D}
    quick = shares({f"M = {count}": _quick(samples, count) for count in THREATS})
    near = shares({f"M = {count}": _near(samples, count) for count in THREATS})
    parts = (
        *by_level("Voronoi, visibility graph do on simple maps", does[FEW], _excess_part(samples), condition=_for),
        *by_level("they do not on complex maps", does[MANY], _excess_part(samples), condition=_for),
        *(
            part
            for replan, levels in partial.items()
            for part in by_level("they fail on partial maps", levels, contrast_part, condition=_flown_by(replan))
        ),
        *by_level("MILP fails when something changes", sudden, contrast_part, condition=_flown),
        *by_level("A2D fails on complex maps", crowded, contrast_part, condition=_for),
        share_part("evolution is quick", quick, condition=f"within {SHORT:g} s"),
    )
    tests = [
        *does[FEW].values(),
        *does[MANY].values(),
        *partial[OLD].values(),
        *partial[AGAIN].values(),
        *sudden.values(),
        *crowded.values(),
    ]
    return Finding(
        parts,
        "; ".join(f"{part.ruling} ({part.effect})" for part in parts) + ".",
        beside=(share_part(f"evolution finds ways within {MARGIN:.0%} of the best", near),),
        tables=(
            contrast_table("Each remark, by cost", [one for group in tests for one in group], RULE),
            share_table(f"Evolution: a way within {SHORT:g} s", quick, RULE),
            _excess_table(samples),
            _online_table(samples, "cost", "Median cost of flights over that of the planner's way with all known"),
            _online_table(samples, "arrived", "Share of flights that arrive"),
            _sudden_table(samples),
        ),
        notes=(
            RULE,
            (
                "Risk is soft: even the straight line arrives, so flights are judged by what they cost, not by whether "
                "they arrive. A planner that does not plan again flies the plan that it made at the start; any can be "
                "asked again whenever something new is seen. Who flies an old plan fails, whatever planner made it."
            ),
            (
                "The Voronoi graph is flown with the elastic chain that Bortoff's has, and without; visibility graphs "
                "go around polygons 2, 2.5 or 3 spreads from a threat's centre."
            ),
            "The best way is that of fast marching over the plane. Seconds are those of the machine that ran this.",
            "Planners are in the style of the originals; verdicts are on these. Cost is length + 10 risk.",
        ),
    )


def _for(names: Sequence[str]) -> str:
    if len(names) == len(GEOMETRIC):
        return "for all of them"
    return f"for {'; '.join(name.removeprefix('a2d-style, ') for name in names)}"


def _flown(replans: Sequence[str]) -> str:
    """Say which flights a verdict is for: those on an old plan, or those that plan again."""
    words = {OLD: "on the first plan", AGAIN: "planning again"}
    return " and ".join(words[replan] for replan in replans)


def _flown_by(replan: str) -> Callable[[Sequence[str]], str]:
    """Return what says which planners' flights a verdict is for."""
    return lambda names: _flown([replan]) + f", {_for(names)}"


def _excess(samples: Samples, name: str, count: int) -> FloatArray:
    return samples.column("excess", planner=name, mode="offline", threats=count)


def _does(samples: Samples, name: str, count: int) -> Contrast:
    """Hold the excess over the best way against the margin: claimed to be below with few threats, above with many."""
    excess = _excess(samples, name, count)
    bound, case = np.full_like(excess, MARGIN), {"planner": name, "threats": count}
    if count == FEW:
        return Contrast(f"{MARGIN:.0%} > excess", case, paired_shift(bound, excess))
    return Contrast(f"excess > {MARGIN:.0%}", case, paired_shift(excess, bound))


def _excess_part(samples: Samples) -> Callable[..., Part]:
    """Return what makes a part of several planners' tests: its size is the median excess."""

    def part(statement: str, tests: Sequence[Contrast], *, printed: str = "") -> Part:
        medians = [median(_excess(samples, one.case["planner"], one.case["threats"])) for one in tests]
        return judged_part(statement, tests, effect=f"excess {span(medians, '.2%')}", printed=printed)

    return part


def _beyond(what: str, case: Case, first: FloatArray, second: FloatArray) -> Contrast:
    """Hold one cost against another, and the margin beyond; the size is without the margin."""
    margin = 1.0 + MARGIN
    found = log_shift(first, margin * second)
    size = Estimate(*(margin * end for end in found.shift))
    return Contrast(f"{what} by {MARGIN:.0%}", case, replace(found, shift=size))


def _online(samples: Samples, name: str, count: int, replan: str = AGAIN, measure: str = "cost") -> FloatArray:
    return samples.column(measure, planner=name, mode="online", threats=count, replan=replan)


def _partial(samples: Samples, name: str, replan: str) -> Contrast:
    known = samples.column("cost", planner=name, mode="offline", threats=SEVERAL)
    flown = _online(samples, name, SEVERAL, replan)
    return _beyond(f"{name}: flown {_flown([replan])} > all known", {"threats": SEVERAL}, flown, known)


def _sudden(samples: Samples, replan: str) -> Contrast:
    """Hold the old plan against a new one, or milp's new ones against cgla's."""
    milp = {one: samples.column("cost", planner="milp", mode="sudden", replan=one) for one in (AGAIN, OLD)}
    if replan == OLD:
        return _beyond("sudden threat: old plan of milp > new one", {}, milp[OLD], milp[AGAIN])
    cgla = samples.column("cost", planner="cgla", mode="sudden", replan=AGAIN)
    return _beyond("sudden threat, planning again: milp > cgla", {}, milp[AGAIN], cgla)


def _crowded(samples: Samples, name: str) -> list[Contrast]:
    """Hold A2D's cost against CGLA's with many threats, and what it costs beyond CGLA against that with few."""
    few, many = (_online(samples, name, count) / _online(samples, "cgla", count) for count in (FEW, MANY))
    return [
        _beyond(f"{name} > cgla", {"threats": MANY}, many, np.ones_like(many)),
        Contrast(f"{name} over cgla: M = {MANY} > {FEW}", {}, log_shift(many, few)),
    ]


def _quick(samples: Samples, count: int) -> FloatArray:
    """Tell on which maps evolution found a way in time."""
    case = {"planner": EVOLUTION, "mode": "offline", "threats": count}
    arrived, seconds = samples.column("arrived", **case), samples.column("seconds", **case)
    return np.where(np.isnan(arrived), math.nan, (arrived == 1.0) & (seconds <= SHORT))


def _near(samples: Samples, count: int) -> FloatArray:
    """Tell on which maps evolution found a way that is nearly the best."""
    arrived = samples.column("arrived", planner=EVOLUTION, mode="offline", threats=count)
    return np.where(np.isnan(arrived), math.nan, _excess(samples, EVOLUTION, count) <= MARGIN)


def _excess_table(samples: Samples) -> Table:
    rows = [(name, *finite(*(median(_excess(samples, name, count)) for count in THREATS))) for name in PLANNED]
    return Table(
        "Median excess over the best way, all known", ("planner", *(f"M = {count}" for count in THREATS)), rows
    )


def _online_table(samples: Samples, measure: str, title: str) -> Table:
    """Tell of flights on the first plan and planning again: costs over all known (A2D's over CGLA's), or arrivals."""
    rows: list[list[Entry]] = []
    for name in (*FLOWN, *A2D):
        for replan in (AGAIN,) if name in A2D else (AGAIN, OLD):
            numbers = []
            for count in THREATS:
                flown = _online(samples, name, count, replan, measure)
                if measure == "arrived":
                    numbers.append(proportion(flown).rate)
                    continue
                known = samples.column("cost", planner="cgla" if name in A2D else name, mode="offline", threats=count)
                numbers.append(median(flown / known))
            rows.append([f"{name}, {_flown([replan])}", *finite(*numbers)])
    note = "A2D's cost is over that of CGLA's way with all known." if measure == "cost" else ""
    return Table(title, ("planner", *(f"M = {count}" for count in THREATS)), rows, note)


def _sudden_table(samples: Samples) -> Table:
    rows: list[list[Entry]] = []
    for name in ("milp", "cgla"):
        for replan in (AGAIN, OLD):
            case = {"planner": name, "mode": "sudden", "replan": replan}
            measured = [median(samples.column(measure, **case)) for measure in ("risk_sum", "length", "cost")]
            rows.append(
                [f"{name}, {_flown([replan])}", *finite(proportion(samples.column("arrived", **case)).rate, *measured)]
            )
    columns = ("planner", "arrives", "median risk sum", "median length", "median cost")
    return Table(f"A threat that comes up on milp's way, all else known ({THREATS[1]} threats)", columns, rows)
