"""What UAVs see, and what they gain by telling each other (C42, C43, C45, C49, C51)."""

import math
from dataclasses import replace
from itertools import product
from typing import Any, Literal

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    MAIN,
    RADII,
    Contrast,
    contrast_part,
    contrast_table,
    in_cells,
    span,
    tally,
    together,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import experiment
from cgla_graph.comparisons.claims.inference import proportion
from cgla_graph.comparisons.claims.paper.flights import (
    RADIUS,
    STEP,
    STEPNUM,
    TEAM_K,
    fly_two,
    fly_variants,
    team_measures,
)
from cgla_graph.comparisons.claims.paper.one_matrix_claims import DELAYS, MATRIX_CELLS, fly_on_one_matrix
from cgla_graph.comparisons.claims.paper.printed_values import TABLE_3
from cgla_graph.comparisons.claims.paper.weight_claims import percent_less
from cgla_graph.errors import MissionError
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import LEAST_GAMMA
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.random_map import random_scenario

#: Risk weights of the comparison with and without sharing; the paper prints none with Table 3.
SHARING_KS = (20, 70)
COUNTEREXAMPLE = "c42-sharing-hurts.toml"
#: What rounding may do to distances on a map of size 1.
ROUNDING = 1e-12


@experiment("sharing", quick=8)
def sample_sharing(seed: int) -> list[dict[str, Any]]:
    """Fly with and without sharing; for one K also with delays, and on one matrix with delays or out of reach."""
    field = random_scenario(seed).problem.field
    flights: list[tuple[dict[str, Any], Flight]] = []
    for cell, k in product(CELLS, SHARING_KS):
        none, shared = fly_two(field, k=k, **cell), fly_two(field, k=k, sharing="global", **cell)
        flights += [({**cell, "k": k, "sharing": "none"}, none), ({**cell, "k": k, "sharing": "global"}, shared)]
        if k != TEAM_K or cell not in MATRIX_CELLS:
            continue
        for delay in DELAYS:
            case = {**cell, "k": k, "delay": delay}
            late = fly_two(field, k=k, sharing=Sharing(delay=delay), **cell)
            one = fly_on_one_matrix(none.mission, delay)
            flights += [({**case, "sharing": "each"}, late), ({**case, "sharing": "one"}, one)]
        # nothing gets into the matrix, and nothing out of it: the plan of the start is kept to
        kept = fly_two(field, k=k, **{**cell, "replan": "never"})
        flights.append(({**cell, "k": k, "sharing": "unreachable"}, kept))
    return [{**case, **team_measures(flight)} for case, flight in flights]


def effects_of_sharing(samples: Samples, measure: str) -> dict[int, list[Contrast]]:
    """Compare a sum over both UAVs without and with sharing, in every cell, by K."""
    without, shared = {"sharing": "none"}, {"sharing": "global"}
    what = f"{measure}: without > with"
    return {
        k: in_cells(samples, what, measure, without, shared, [{**cell, "k": k} for cell in CELLS]) for k in SHARING_KS
    }


def _part_of_sharing(statement: str, found: dict[int, list[Contrast]], printed: float) -> Part:
    """Say what sharing saves: the verdict is of all K together, the sizes are of each."""
    part = contrast_part(statement, together(found), printed=f"{printed:.3g} % less, on one map")
    return replace(part, effect="; ".join(f"K = {k}: {percent_less(one)}" for k, one in found.items()))


def _by_radius(found: dict[int, list[Contrast]]) -> str:
    cells = {radius: [one for one in together(found) if one.case["radius"] == radius] for radius in RADII}
    return "; ".join(f"OR = {radius:g}: {percent_less(contrasts)}" for radius, contrasts in cells.items())


def _sharing_hurts() -> dict[str, float]:
    """Fly the stored counterexample again, assert that sharing hurts in every measure, and return by what factor."""
    flights = fly_variants(counterexamples.mission(COUNTEREXAMPLE))
    without, shared = (team_measures(flights[name]) for name in ("without sharing", "with sharing"))
    require(without["arrived"] and shared["arrived"], f"{COUNTEREXAMPLE}: not all arrive")
    factors = {name: shared[name] / without[name] for name in ("length", "risk_sum", "risk", "cost")}
    for name, factor in factors.items():
        require(factor > 1.0, f"sharing no longer hurts in {COUNTEREXAMPLE}: {name} is {factor} times as great")
    return factors


def _both_better(samples: Samples) -> list[float]:
    """Return, for each K, on what share of maps sharing makes both together fly shorter and with less risk."""
    rates = []
    for k in SHARING_KS:
        without, shared = ({**MAIN, "k": k, "sharing": name} for name in ("none", "global"))
        is_less = [samples.column(name, **shared) < samples.column(name, **without) for name in ("length", "risk_sum")]
        rates.append(proportion(is_less[0] & is_less[1]).rate)
    return rates


@claim(
    42,
    "Section 5.2.2",
    "With sharing, UAVs fly shorter and with less risk.",
    "Over both UAVs, the sum of risk and the length are less with sharing, in every cell and for K = 20 and 70.",
    Kind.STATISTIC,
    experiments=("sharing",),
    figures=("Fig. 9", "Table 3"),
)
def _check_c42(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    risk, length = (effects_of_sharing(samples, measure) for measure in ("risk_sum", "length"))
    without, shared = TABLE_3
    parts = (
        _part_of_sharing("less risk on average", risk, 100.0 * (1.0 - shared.risk / without.risk)),
        _part_of_sharing("shorter on average", length, 100.0 * (1.0 - shared.length / without.length)),
    )
    factors = _sharing_hurts()
    return Finding(
        (
            *parts,
            Part(
                "shorter and less risk on every map",
                Verdict.REFUTED,
                f"in {COUNTEREXAMPLE} both together fly {factors['length']:.3g} times as far, with "
                f"{factors['risk_sum']:.3g} times the sum of risk",
                "as printed",
            ),
        ),
        f"Over both UAVs, the sum of risk with sharing is, with {parts[0].effect} (shown {tally(together(risk))}); "
        f"the length is, with {parts[1].effect} (shown {tally(together(length))}).",
        tables=(
            contrast_table("Sum of risk, without over with sharing", together(risk)),
            contrast_table("Length, without over with sharing", together(length)),
        ),
        notes=(
            (
                "The paper's Table 3 is of one UAV, on one map on which it is what the other one sees that matters; "
                "here it is the sum over both, on maps at random."
            ),
            f"By detection radius, the sum of risk is: {_by_radius(risk)}.",
            (
                "Who knows all plans at least as well as by any other plan; who knows more, but not all, may turn away "
                "from a known threat into one that nobody has seen."
            ),
        ),
        counterexample=COUNTEREXAMPLE,
    )


def require_union(flight: Flight) -> int:
    """Assert that each UAV knows on every tick what all have seen until then; return how many threats it was told."""
    seen: list[tuple[int, int]] = [
        (event.tick, event.detail["threat"]) for event in flight.events if event.kind == "detected"
    ]
    for one in flight.uavs.values():
        for tick in range(one.departed, one.ended):
            union = {threat for when, threat in seen if when <= tick}
            known = set(one.knowledge_at(tick).threats)
            require(known == union, f"at tick {tick}, {one.name} knows {sorted(known)}; all have seen {sorted(union)}")
    return sum(event.kind == "learned" for event in flight.events)


@claim(
    43,
    "Section 4.1",
    "What one UAV detects the other ones know, even one that is still at its start.",
    "With sharing, on every tick each UAV knows the union of all detections until then.",
    Kind.PROOF,
    figures=("Fig. 4",),
)
def _check_c43(evidence: Evidence) -> Finding:
    seeds = evidence.scale.map_seeds(evidence.instances(100, 10))
    told = sum(require_union(fly_two(random_scenario(seed).problem.field, sharing="global")) for seed in seeds)
    require(told > 0, "on no map was anybody told anything")
    flights = fly_variants(load_mission("fig4"))
    shared, alone = (flights[name].uavs["left"] for name in ("with sharing", "without sharing"))
    at_start = set(shared.knowledge_at(0).threats) - set(alone.knowledge_at(0).threats)
    require(at_start, "in mission fig4, the left UAV knows no more at its start with sharing")
    return Finding.single(
        Verdict.PROVED,
        "By construction, with sharing, what a UAV knows on any tick is the union of what all have seen until then, so "
        f"never less than what it has seen itself: asserted on every tick of {len(seeds)} missions, in which {told} "
        "threats were told.",
        condition="if every message arrives at once",
        beside=(
            Part(
                "at its start a UAV knows what only the other one sees",
                Verdict.PROVED,
                f"mission fig4: at tick 0 the left UAV knows {len(at_start)} threat more; its flight costs "
                f"{shared.cost:.4g} with sharing, {alone.cost:.4g} without",
                "as in Fig. 4",
            ),
        ),
        notes=("That more knowledge is a better flight is another claim, and does not hold always (C42).",),
    )


@claim(
    51,
    "Section 6",
    "A shorter path with smaller risk can be achieved, in polynomial time.",
    "There is a mission in which sharing makes both length and sum of risk less; the number of operations is bounded "
    "by a polynomial in N and M (C17, C22).",
    Kind.PROOF,
    experiments=("sharing",),
)
def _check_c51(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    risk, length = (together(effects_of_sharing(samples, measure)) for measure in ("risk_sum", "length"))
    flights = fly_variants(load_mission("fig9"))
    without, shared = (team_measures(flights[name]) for name in ("without sharing", "with sharing"))
    can = shared["length"] < without["length"] and shared["risk_sum"] < without["risk_sum"]
    require(can, "in mission fig9, sharing no longer makes both length and risk less")
    shorter = (
        f"mission fig9: length {without['length']:.3g} to {shared['length']:.3g}, sum of risk "
        f"{without['risk_sum']:.3g} to {shared['risk_sum']:.3g}"
    )
    rates = _both_better(samples)
    return Finding(
        (
            Part("can be shorter with less risk", Verdict.PROVED, shorter, "on some maps"),
            Part(
                "polynomial time",
                Verdict.PROVED,
                "at most (M + 1)(N^2 - 1) moves (C17) of O(N^4) line integrals and operations each (C22): O(M N^6) for "
                "a UAV in the worst case",
                "if threats stay, without virtual obstacles",
            ),
        ),
        f"Sharing does both at once in a shipped mission ({shorter}) and on {span(rates, '.0%')} of random "
        "maps. The time is polynomial in N and M where a flight ends (C17).",
        beside=(
            contrast_part("less risk on average", risk),
            contrast_part("shorter on average", length),
        ),
        notes=(
            "A sentence that something can be is shown by one map, also by one that was made for it, as that of fig9.",
            "Read as with sharing against without; against other planners it is what C32, C34, C35 and C44 say.",
            "With virtual obstacles there is no such bound: a flight may never end (C19).",
        ),
    )


def require_seen_within_radius(flight: Flight) -> int:
    """Assert that threats are known if and only if somebody has had them within OR; return how many were detected."""
    threats = {number: (one.x, one.y) for number, one in enumerate(flight.mission.world.field.threats)}
    seen: dict[str, set[int]] = {name: set() for name in flight.uavs}
    for event in flight.events:
        if event.kind == "detected":
            one, number = flight.uavs[event.uav], event.detail["threat"]
            away = math.dist(one.position_at(event.tick) or (math.nan, math.nan), threats[number])
            require(
                away <= one.uav.detection_radius + ROUNDING,
                f"at tick {event.tick}, {one.name} detects a threat {away} away with a radius of "
                f"{one.uav.detection_radius}",
            )
            seen[event.uav].add(number)
    everybody = set().union(*seen.values())
    for one in flight.uavs.values():
        ever = set().union(*(set(knowledge.threats) for knowledge in one.knowledge))
        reach = everybody if flight.mission.sharing.is_on else seen[one.name]
        require(ever <= reach, f"{one.name} knows of {sorted(ever - reach)}, which nobody saw who could have told it")
        for tick in range(one.departed, one.ended):
            near = {
                number
                for number, place in threats.items()
                if math.dist(one.trace[tick - one.departed], place) < one.uav.detection_radius - ROUNDING
            }
            missed = near - set(one.knowledge_at(tick).threats)
            require(not missed, f"at tick {tick}, {one.name} does not know of {sorted(missed)} within its radius")
    return sum(len(numbers) for numbers in seen.values())


@claim(
    49,
    "Section 4.1",
    "A threat is known once it is within the detection radius OR, and the safe distance SD is above 0.1 OR.",
    "On every tick, a threat is known to a UAV if and only if it, or one that told it, has had it within OR.",
    Kind.PROPERTY,
)
def _check_c49(evidence: Evidence) -> Finding:
    rng, count, detected = evidence.rng("C49"), evidence.instances(100, 12), 0
    ways: tuple[Literal["none", "global"], ...] = ("none", "global")
    for seed in evidence.scale.map_seeds(count):
        field = random_scenario(seed).problem.field
        radius, stepnum = float(rng.uniform(0.1, 0.3)), STEPNUM if rng.random() < 0.5 else None  # noqa: PLR2004 - a coin
        flight = fly_two(field, radius=radius, sharing=ways[int(rng.integers(2))], stepnum=stepnum)
        detected += require_seen_within_radius(flight)
    mission = flight.mission
    too_near = [replace(uav, safe_distance=LEAST_GAMMA * uav.detection_radius) for uav in mission.uavs]
    refused = False
    try:
        replace(mission, uavs=too_near, virtual_obstacle=VirtualObstacle(stepnum=STEPNUM))
    except MissionError:
        refused = True
    require(refused, f"a mission with SD/OR = {LEAST_GAMMA} and virtual obstacles is not refused")
    return Finding(
        (
            Part(
                "known within OR",
                Verdict.PROVED,
                f"asserted on the logs of {count} missions with {detected} detections",
                "by definition of the method",
            ),
            Part(
                "SD above 0.1 OR",
                Verdict.PROVED,
                f"missions with SD/OR of at most {LEAST_GAMMA:g} are refused",
                "as a condition on what is given",
            ),
        ),
        f"Asserted on the logs of {count} missions: all {detected} detections happened within OR, nobody knew of a "
        "threat that was not seen so before, and nothing within OR was missed. Missions with SD/OR of at most 0.1 are "
        "refused.",
        notes=(
            "It is how the method is defined: the assertion is one about this program.",
            (
                f"With OR = {RADIUS:g}, SD/OR > {LEAST_GAMMA:g} says that the safe distance is more than {STEP:g}, one "
                "step of flight. Section 4.1 gives the ratio once one way and once the other (E21): OR/SD > 0.1 would "
                "only say that SD is below 10 OR."
            ),
        ),
    )
