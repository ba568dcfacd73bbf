"""
What virtual obstacles are good for (C39, C40, C41, C48).

The paper prints neither the spread of a virtual obstacle nor SD, nor K: claims are held against several of each.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import replace
from itertools import product
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    ALPHA,
    CELLS,
    MAIN,
    MOSTLY,
    Case,
    RateContrast,
    Share,
    cell_name,
    judged_part,
    rate_contrast,
    rate_table,
    share_part,
    share_table,
    shares,
    span,
    together,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import experiment
from cgla_graph.comparisons.claims.inference import Proportion, cochran, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import (
    COLLISION_DISTANCE,
    MEETING,
    OBSTACLE_SPREAD,
    SAFE_DISTANCE,
    STEPNUM,
    TEAM_K,
    fly_two,
    fly_variants,
    team_measures,
)
from cgla_graph.comparisons.statistics.intervals import Interval, success_interval
from cgla_graph.mission.records import Flight
from cgla_graph.model.risk import RiskField
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

#: The look-aheads of the curve, and those of Fig. 7; -1 stands for no virtual obstacle.
NO_OBSTACLE = -1
STEPNUMS = (0, 1, 2, 3, 4, 5, 6, 8)
PAPER_STEPNUMS = (0, 3, 5)
#: What the paper does not print: the spread of a virtual obstacle (of one step first), SD (the greatest first), and K.
SPREADS = (OBSTACLE_SPREAD, 0.03, 0.05)
SAFE_DISTANCES = (SAFE_DISTANCE, 0.06)
KS = (10, TEAM_K, 50)
#: What is held fixed where something else is varied.
USUAL: Case = {"k": TEAM_K, "safe_distance": SAFE_DISTANCE}
#: How many threats there are in the paper's Fig. 12, and in what settings they are flown among.
_NUMBERS = {5: "five", 7: "seven"}
FEW_THREATS = tuple(_NUMBERS)
FEW_SETTINGS: tuple[Case, ...] = (
    *({**cell, **USUAL, "spread": OBSTACLE_SPREAD} for cell in CELLS),
    *({**MAIN, **USUAL, "spread": spread} for spread in SPREADS[1:]),
    *({**MAIN, **USUAL, "spread": OBSTACLE_SPREAD, "safe_distance": distance} for distance in SAFE_DISTANCES[1:]),
    *({**MAIN, **USUAL, "spread": OBSTACLE_SPREAD, "k": k} for k in KS if k != TEAM_K),
)
#: Two UAVs collide with obstacles of each of `SPREADS`, on a map each.
COUNTEREXAMPLES = (
    "c41-obstacles-collide.toml",
    "c41-wider-obstacles-collide.toml",
    "c41-widest-obstacles-collide.toml",
)
#: What counts as near the point where Fig. 8 shows the collision, map units: two cells of the lattice.
NEAR_MEETING = 0.1
#: How many of the conflicts are avoided at least, where they are said to be.
MORE_OFTEN_THAN_NOT = 0.5
#: On maps of ours that were selected to agree with the paper, agreement says little.
SELECTED = "that map was selected to agree with the paper, so that it is no evidence"
RATE_RULE = (
    "Rule, set before the sample was drawn: supported if in every row that belongs to a condition McNemar's exact p is "
    "below 0.05, and the effect goes in the claimed direction; contradicted if in some such row it goes the other way, "
    "with p below 0.05 after Holm; else undecided. Rows of SD 0.06 belong to that condition, others to their spread."
)


def settings(spread: float) -> list[Case]:
    """List in what claims are held against obstacles of a spread: the cells for that of one step, then SD and K."""
    cells = CELLS if spread == OBSTACLE_SPREAD else (MAIN,)
    swept = [{**USUAL, "k": k} for k in KS] + [{**USUAL, "safe_distance": distance} for distance in SAFE_DISTANCES]
    return [
        *({**cell, **USUAL, "spread": spread} for cell in cells),
        *({**MAIN, **one, "spread": spread} for one in swept if one != USUAL),
    ]


@experiment("stepnum", quick=2)
def sample_stepnum(seed: int) -> list[dict[str, Any]]:
    """Fly two UAVs without virtual obstacles, and with them so many steps ahead, in all settings."""
    field = random_scenario(seed).problem.field
    bare = [*({**cell, "k": TEAM_K} for cell in CELLS), *({**MAIN, "k": k} for k in KS if k != TEAM_K)]
    records = [{**case, "stepnum": NO_OBSTACLE, **team_measures(fly_two(field, **case))} for case in bare]
    for spread in SPREADS:
        groups: dict[tuple[Any, ...], list[Case]] = {}
        for case in settings(spread):
            groups.setdefault(tuple(case[name] for name in ("k", *MAIN)), []).append(case)
        for group in groups.values():
            records += _fly_group(field, group)
    return records


def _fly_group(field: RiskField, cases: Iterable[Case]) -> list[dict[str, Any]]:
    """Fly with several safe distances, the greatest first, and stepnums: in the main setting, those of the curve."""
    records = []
    measured: dict[str, Any] = {}
    alike = False
    for case in cases:
        for stepnum in STEPNUMS if case == _main(case["spread"]) else PAPER_STEPNUMS:
            # of two that are never nearer than the greatest SD, neither stepnum nor a lesser SD changes anything
            if not alike:
                flight = fly_two(field, stepnum=stepnum, **case)
                measured = team_measures(flight)
                alike = not any(event.kind == "near" for event in flight.events)
            records.append({**case, "stepnum": stepnum, **measured})
    return records


def _main(spread: float) -> Case:
    """Return the setting of the curve."""
    return {**MAIN, **USUAL, "spread": spread}


@experiment("few-threats", quick=1)
def sample_few_threats(seed: int) -> list[dict[str, Any]]:
    """Fly two UAVs that share and keep apart by virtual obstacles, among five and seven threats, as Fig. 12 does."""
    records = []
    for threats in FEW_THREATS:
        field = random_scenario(seed, threats=threats).problem.field
        for case in FEW_SETTINGS:
            flight = fly_two(field, sharing="global", stepnum=STEPNUM, **case)
            records.append({**case, "threats": threats, **team_measures(flight)})
    return records


def _collide(flight: Flight) -> bool:
    return flight.least_separation < COLLISION_DISTANCE


def setting_name(case: Case) -> str:
    """
    Write a setting in a few words: the usual K and SD are not said.

    Examples
    --------
    >>> setting_name({**MAIN, "k": 50, "safe_distance": 0.1, "spread": 0.03})
    'exact, OR 0.2, K = 50, spread 0.03'
    """
    words = [cell_name({name: case[name] for name in MAIN})]
    if case["k"] != TEAM_K:
        words.append(f"K = {case['k']}")
    if case["safe_distance"] != SAFE_DISTANCE:
        words.append(f"SD {case['safe_distance']:g}")
    return ", ".join([*words, f"spread {case['spread']:g}"])


def levels() -> dict[str, list[Case]]:
    """
    List what decides the verdicts, as conditions, with the settings of each; K and the cells must not decide.

    Examples
    --------
    >>> {condition: len(cases) for condition, cases in levels().items()}
    {'at spread 0.02': 14, 'at spread 0.03': 3, 'at spread 0.05': 3, 'at SD 0.06': 3}
    """
    every = [case for spread in SPREADS for case in settings(spread)]
    found = {
        f"at spread {spread:g}": [
            case for case in every if case["spread"] == spread and case["safe_distance"] == SAFE_DISTANCE
        ]
        for spread in SPREADS
    }
    for distance in SAFE_DISTANCES[1:]:
        found[f"at SD {distance:g}"] = [case for case in every if case["safe_distance"] == distance]
    return found


def _collided(samples: Samples, case: Case, stepnum: int, measure: str = "collided") -> FloatArray:
    """Return on which maps two UAVs collide; without virtual obstacles, their spread and SD count for nothing."""
    known = {name: case[name] for name in ("k", *MAIN)} if stepnum == NO_OBSTACLE else case
    return samples.column(measure, stepnum=stepnum, **known)


def collisions(samples: Samples, stepnum: int, cases: Iterable[Case]) -> list[RateContrast]:
    """Compare how often two UAVs collide with some stepnum, or without virtual obstacles, and with the paper's."""
    what = f"{'none' if stepnum == NO_OBSTACLE else f'stepnum {stepnum}'} > stepnum {STEPNUM}"
    return [
        rate_contrast(
            what,
            {"setting": setting_name(case)},
            _collided(samples, case, stepnum),
            _collided(samples, case, STEPNUM),
        )
        for case in cases
    ]


def _collision_part(statement: str, contrasts: Sequence[RateContrast], condition: str) -> Part:
    """Say whether the first of two things has more collisions, and how many each has."""
    effect = f"{_often(contrasts, 'first')} against {_often(contrasts, 'second')}"
    return judged_part(statement, contrasts, effect=effect, condition=condition)


def _often(contrasts: Sequence[RateContrast], which: str) -> str:
    """Say how often one of two things happens, and how far its intervals reach in all settings."""
    rates = [getattr(one, which) for one in contrasts]
    counts = [(round(rate * one.n), one.n) for rate, one in zip(rates, contrasts, strict=True) if one.n]
    ends = [success_interval(*one) for one in counts] or [Interval(0.0, 1.0)]
    low, high = min(one.low for one in ends), max(one.high for one in ends)
    return f"{span(rates, '.2g')} (95 % within {low:.2g} to {high:.2g})"


def _pattern_of_fig7(case: Case) -> tuple[bool, ...]:
    """Fly the shipped Fig. 7 in another cell; return which stepnums collide."""
    collided = []
    for mission in load_mission("fig7").missions(get).values():
        uavs = [replace(uav, detection_radius=case["radius"]) for uav in mission.uavs]
        changed: Any = {"uavs": uavs, "integral": case["integral"], "replan": case["replan"]}
        collided.append(_collide(replace(mission, **changed).fly()))
    return tuple(collided)


def quadratic_contrast(levels: tuple[int, ...]) -> FloatArray:
    """
    Return weights that measure how much values curve upwards over levels, whatever their mean and slope.

    Returns
    -------
    weights
        Shape ``(n,)``, of length 1, orthogonal to all straight lines; above 0 at both ends.

    Examples
    --------
    >>> (quadratic_contrast((0, 1, 2)) * 6**0.5).round(9).tolist()
    [1.0, -2.0, 1.0]
    """
    x = np.array(levels, dtype=np.float64)
    basis, _ = np.linalg.qr(np.column_stack([np.ones_like(x), x, x**2]))
    weights = basis[:, 2]
    return np.asarray(weights if weights[0] > 0.0 else -weights)


def curve(samples: Samples, spread: float | None) -> list[Proportion]:
    """Return how often two UAVs collide in the main setting, by `STEPNUMS`; without virtual obstacles if None."""
    case = _main(OBSTACLE_SPREAD if spread is None else spread)
    stepnums = (NO_OBSTACLE,) if spread is None else STEPNUMS
    return [proportion(_collided(samples, case, stepnum)) for stepnum in stepnums]


def _curve_part(samples: Samples, spread: float) -> Part:
    """Test whether collisions depend on stepnum, and are rarest somewhere between its ends."""
    collided = np.column_stack([_collided(samples, _main(spread), stepnum) for stepnum in STEPNUMS])
    curved = paired_shift(collided @ quadratic_contrast(STEPNUMS), np.zeros(len(collided)))
    differ = cochran(collided)
    complete = collided[np.isfinite(collided).all(axis=1)]
    rates = complete.mean(axis=0) if len(complete) else np.full(len(STEPNUMS), math.nan)
    best = STEPNUMS[int(np.argmin(rates))]
    inside = best not in {STEPNUMS[0], STEPNUMS[-1]}
    bent = max(differ, curved.p) < ALPHA
    verdict = Verdict.UNDECIDED
    if bent and (curved.effect < 0.0 or inside):
        verdict = Verdict.SUPPORTED if curved.effect > 0.0 else Verdict.CONTRADICTED
    return Part(
        "fewest collisions at some stepnum between the ends",
        verdict,
        f"Cochran's Q: p = {differ:.2g}; quadratic contrast: effect {curved.effect:.3g}, p = {curved.p:.2g}; the "
        f"rarest collisions are at stepnum {best}, {rates[STEPNUMS.index(best)]:.3g} of flights",
        f"at spread {spread:g}",
    )


def _curve_table(samples: Samples) -> Table:
    curves: list[tuple[float | None, Sequence[str | int], list[Proportion]]] = [
        (None, ("none",), curve(samples, None)),
        *((one, STEPNUMS, curve(samples, one)) for one in SPREADS),
    ]
    rows: list[Sequence[Entry]] = [
        (spread, str(name), found.n, found.rate, *found.interval)
        for spread, names, rates in curves
        for name, found in zip(names, rates, strict=True)
    ]
    return Table(
        "Collisions of two UAVs by stepnum and spread",
        ("spread", "stepnum", "maps", "collide", "95 % from", "to"),
        rows,
        "All random maps count, whether the two would meet or not. Exact integrals, OR = 0.2, SD = 0.1, K = 20, no "
        "sharing.",
    )


def _sweep_table(samples: Samples) -> Table:
    rows: list[Sequence[Entry]] = []
    for case in (case for spread in SPREADS for case in settings(spread)):
        found = [proportion(_collided(samples, case, stepnum)) for stepnum in (NO_OBSTACLE, *PAPER_STEPNUMS)]
        lost = [proportion(1.0 - _collided(samples, case, stepnum, "arrived")).count for stepnum in PAPER_STEPNUMS]
        rows.append((setting_name(case), found[0].n, *(one.rate for one in found), sum(lost)))
    return Table(
        "Share of flights that collide, by spread, SD, K and cell",
        ("setting", "maps", "no obstacle", *(f"stepnum {one}" for one in PAPER_STEPNUMS), "not arrived"),
        rows,
        "K = 20 and SD = 0.1, or half of OR, if not said. Not arrived: flights of the three stepnums together.",
    )


def _in_words(samples: Samples) -> str:
    """Say how often two UAVs collide in the main settings: without obstacles, and with the paper's stepnums."""
    bare = curve(samples, None)[0]
    words = []
    for spread in SPREADS:
        rates = [found.rate for found in curve(samples, spread)]
        words.append(f"{', '.join(f'{rates[STEPNUMS.index(one)]:.2g}' for one in PAPER_STEPNUMS)} at spread {spread:g}")
    return (
        f"Share of flights on random maps that collide: {bare.rate:.2g} without virtual obstacles; with 0, 3 and 5 "
        f"steps ahead {'; '.join(words)} ({bare.n} maps, K = {TEAM_K}, SD = {SAFE_DISTANCE:g})."
    )


@claim(
    39,
    "Section 5.2.1, Fig. 7",
    "With a virtual obstacle 0 or 5 steps ahead two UAVs collide, with 3 steps they do not.",
    "On random maps, collisions are more frequent with stepnum 5 than with 3, and with 0 than with 3.",
    Kind.STATISTIC,
    experiments=("stepnum",),
    figures=("Fig. 7", "Fig. A3"),
)
def _check_c39(evidence: Evidence) -> Finding:
    samples = evidence.samples["stepnum"]
    paper = tuple(stepnum != STEPNUM for stepnum in PAPER_STEPNUMS)
    cells = (MAIN,) if evidence.scale.quick else CELLS
    alike = sum(_pattern_of_fig7(cell) == paper for cell in cells)
    others = [stepnum for stepnum in reversed(PAPER_STEPNUMS) if stepnum != STEPNUM]
    found = {
        (other, condition): collisions(samples, other, cases)
        for other in others
        for condition, cases in levels().items()
    }
    return Finding(
        tuple(
            _collision_part(f"{other} more than {STEPNUM}", contrasts, condition)
            for (other, condition), contrasts in found.items()
        ),
        _in_words(samples),
        beside=(
            Part(
                "0 and 5 collide, 3 does not",
                Verdict.NOT_TESTABLE,
                f"the paper's map is not printed; so it is in {alike} of {len(cells)} cells on mission fig7, but "
                f"{SELECTED}",
                "on the map of Fig. 7",
            ),
            *(_curve_part(samples, spread) for spread in SPREADS),
        ),
        tables=(
            _sweep_table(samples),
            _curve_table(samples),
            rate_table(
                "Collisions with stepnum 5 and 0 against 3",
                together(found),
                RATE_RULE,
            ),
        ),
        notes=(
            (
                "The unit of stepnum is taken as a cell of the lattice, so that 0.4 units are one step (E22); the "
                "distance that counts as a collision, 1.5 steps, is ours, as are spread, SD and K."
            ),
            (
                "Nearer than SD the obstacle is moved ahead of the other UAV, whose own place is left free: with "
                "stepnum 0 it stays there. The wider the obstacle, the fewer come nearer than SD at all; those that do "
                "not fly the same way whatever stepnum is."
            ),
        ),
    )


def _avoided(samples: Samples, cases: Iterable[Case]) -> list[Share]:
    """Test how many of those who collide without virtual obstacles no longer do with them."""
    happened = {}
    for case in cases:
        before, after = (_collided(samples, case, stepnum) for stepnum in (NO_OBSTACLE, STEPNUM))
        happened[setting_name(case)] = 1.0 - after[before > 0.0]
    return shares(happened, MORE_OFTEN_THAN_NOT)


def _avoid_part(conflicts: Sequence[Share], condition: str) -> Part:
    found = share_part("they avoid each other", conflicts, condition=condition)
    # there may be no conflict, and no size
    return found if all(one.found.n for one in conflicts) else replace(found, effect="")


def _vanish_anyway(samples: Samples) -> str:
    """Say how many conflicts vanish where no obstacle, but something else is changed."""
    before = _collided(samples, _main(OBSTACLE_SPREAD), NO_OBSTACLE) > 0.0
    changed = [
        _collided(samples, {**_main(OBSTACLE_SPREAD), **cell}, NO_OBSTACLE)[before] for cell in CELLS if cell != MAIN
    ]
    gone = [proportion(1.0 - one).count for one in changed]
    return f"{span(gone, 'd')} of {before.sum()} conflicts"


@claim(
    40,
    "Section 5.2.1, Fig. 8",
    "Two UAVs of one speed collide near (0.5, 0.7); with virtual obstacles they avoid each other.",
    "Where they collide is a matter of the paper's map. On random maps, of the UAVs that collide without virtual "
    "obstacles, more than half do not with them.",
    Kind.SCENARIO,
    experiments=("stepnum",),
    figures=("Fig. 8",),
)
def _check_c40(evidence: Evidence) -> Finding:
    flights = fly_variants(load_mission("fig8"))
    without, with_them = flights["without virtual obstacles"], flights["with virtual obstacles"]
    (pair,) = without.separations
    samples = evidence.samples["stepnum"]
    found = {condition: _avoided(samples, cases) for condition, cases in levels().items()}
    main = _main(OBSTACLE_SPREAD)
    collided = _collided(samples, main, NO_OBSTACLE) > 0.0
    near = proportion(_collided(samples, main, NO_OBSTACLE, "from_meeting")[collided] <= NEAR_MEETING)
    a, b = (math.dist(uav.start, MEETING) for uav in without.mission.uavs)
    detour = a - b
    words = "; ".join(
        f"{span([one.found.rate for one in conflicts if one.found.n] or [math.nan], '.2g')} {condition}"
        for condition, conflicts in found.items()
    )
    return Finding(
        (
            Part(
                "they collide near (0.5, 0.7)",
                Verdict.NOT_TESTABLE,
                f"it takes the paper's map: of {near.n} collisions on random maps, {near.count} are within "
                f"{NEAR_MEETING:g} of that point",
                "without the paper's map",
            ),
            *(_avoid_part(conflicts, condition) for condition, conflicts in found.items()),
        ),
        f"UAV b is {detour:.3g} nearer to (0.5, 0.7) than a: at one speed they meet there only if b flies a detour of "
        f"{math.ceil(detour / 0.02)} steps, which the map decides. Share of the conflicts on random maps that virtual "
        f"obstacles avoid: {words}.",
        tables=(
            share_table(
                "Conflicts that virtual obstacles avoid",
                together(found),
                "A conflict: the two come closer than 1.5 steps without virtual obstacles. Rule, set before the sample "
                "was drawn: supported if in every row that belongs to a condition the share is shown to be above "
                f"{MORE_OFTEN_THAN_NOT:g} (exact binomial test, p below 0.05); contradicted if in some it is shown to "
                "be below (Holm); else undecided.",
            ),
        ),
        notes=(
            (
                f"On mission fig8 the two come within {without.least_separation:.3g} at ({pair.where[0]:.3g}, "
                f"{pair.where[1]:.3g}), {math.dist(pair.where, MEETING):.2g} from the paper's point, and within "
                f"{with_them.least_separation:.3g} with virtual obstacles; {SELECTED}."
            ),
            (
                "That a conflict vanishes is not yet the obstacles' doing: without any, "
                f"{_vanish_anyway(samples)} vanish if only OR, the integral or the rule of planning again is "
                "changed. What the obstacles do on balance is C41's."
            ),
            "Both fly to one target; a pair within its disc of 0.06 does not count as near.",
        ),
    )


def _conflicts(samples: Samples, case: Case) -> tuple[int, int, int, int, int]:
    """Count maps, conflicts without virtual obstacles, those avoided and caused, and livelocks."""
    before, after = (_collided(samples, case, stepnum) for stepnum in (NO_OBSTACLE, STEPNUM))
    both = np.isfinite(before) & np.isfinite(after)
    conflict, still = before[both] > 0.0, after[both] > 0.0
    locked = _collided(samples, case, STEPNUM, "livelock")[both] > 0.0
    avoids, causes = int((conflict & ~still).sum()), int((~conflict & still).sum())
    return len(conflict), int(conflict.sum()), avoids, causes, int(locked.sum())


@claim(
    41,
    "Section 5.2.1",
    "Virtual obstacles keep UAVs from colliding.",
    "No mission with virtual obstacles (stepnum = 3) has two UAVs closer than the collision distance; on random maps, "
    "fewer collide than without.",
    Kind.STATISTIC,
    experiments=("stepnum",),
    figures=("Fig. 8", "Fig. A3"),
)
def _check_c41(evidence: Evidence) -> Finding:
    pairs = []
    for name in COUNTEREXAMPLES:
        flights = fly_variants(counterexamples.mission(name))
        without, with_them = flights["without virtual obstacles"], flights["with virtual obstacles"]
        require(not _collide(without), f"the UAVs of {name} collide without virtual obstacles, too")
        require(_collide(with_them), f"the UAVs of {name} no longer collide with virtual obstacles")
        pairs.append(f"{without.least_separation:.2g} apart without and {with_them.least_separation:.2g} with them")
    samples = evidence.samples["stepnum"]
    found = {condition: collisions(samples, NO_OBSTACLE, cases) for condition, cases in levels().items()}
    rows = [(setting_name(case), *_conflicts(samples, case)) for spread in SPREADS for case in settings(spread)]
    return Finding(
        (
            Part(
                "always",
                Verdict.REFUTED,
                f"a stored counterexample each, in which two UAVs pass each other {'; '.join(pairs)}",
                f"at spreads {', '.join(f'{one:g}' for one in SPREADS)}",
            ),
            *(
                _collision_part("more without than with", contrasts, condition)
                for condition, contrasts in found.items()
            ),
        ),
        f"Not always: two UAVs pass each other {'; '.join(pairs)} ({', '.join(COUNTEREXAMPLES)}). {_in_words(samples)}",
        tables=(
            Table(
                "What virtual obstacles do to conflicts",
                ("setting", "maps", "conflicts without", "avoided", "caused", "livelocks"),
                rows,
                "A conflict: the two come closer than 1.5 steps without virtual obstacles; stepnum = 3, no sharing; "
                "K = 20 and SD = 0.1, or half of OR, if not said.",
            ),
            rate_table(
                "Collisions without virtual obstacles, and with them",
                together(found),
                RATE_RULE,
            ),
        ),
        notes=("Planning in space and time around the others' plans does keep the distance: avoidance='prioritized'.",),
        counterexample=COUNTEREXAMPLES[0],
    )


@claim(
    48,
    "Section 5.2.3, Fig. 12",
    "The method works for two UAVs among five and among seven threats.",
    f"On random maps with five and seven threats, both arrive and never collide with a probability above {MOSTLY:g}.",
    Kind.STATISTIC,
    experiments=("few-threats",),
    figures=("Fig. 12",),
)
def _check_c48(evidence: Evidence) -> Finding:
    samples = evidence.samples["few-threats"]
    found: dict[tuple[int, float], list[Share]] = {}
    for threats, distance in product(FEW_THREATS, SAFE_DISTANCES):
        happened = {}
        for case in (one for one in FEW_SETTINGS if one["safe_distance"] == distance):
            arrived, collided = (samples.column(name, threats=threats, **case) for name in ("arrived", "collided"))
            happened[f"{setting_name(case)}, M = {threats}"] = arrived * (1.0 - collided)
        found[threats, distance] = shares(happened)
    every = together(found)
    flights = [flight for name in _NUMBERS.values() for flight in fly_variants(load_mission(f"fig12-{name}")).values()]
    works = all(flight.all_arrived and not _collide(flight) for flight in flights)
    words = "arrive and keep apart" if works else "do not both arrive and keep apart"
    apart = ", ".join(f"{flight.least_separation:.2g}" for flight in flights)
    return Finding(
        tuple(
            share_part(f"{_NUMBERS[threats]} threats", rows, condition=f"at SD {distance:g}")
            for (threats, distance), rows in found.items()
        ),
        f"Both arrive without a collision on {span([one.found.rate for one in every])} of random maps, by setting.",
        tables=(share_table("Two UAVs that share and keep apart: both arrive, and never collide", every),),
        notes=(
            (
                f"On missions fig12-five and fig12-seven, whose maps are ours, the two {words}: least separations "
                f"{apart}."
            ),
            (
                "Settings: the cells, and in the main one other spreads of the obstacle, K, and SD. Fewer than 59 maps "
                "cannot show the share, even if all succeed."
            ),
        ),
    )
