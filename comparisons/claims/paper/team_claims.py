"""Several UAVs: sharing, virtual obstacles, and how they fare together (C39 to C43, C45, C48, C49, C51)."""

import math
from dataclasses import replace
from typing import Literal

from cgla_graph.comparisons.claims.claim import Claim, Finding, Kind, Part, Table, Verdict, require
from cgla_graph.comparisons.claims.contrasts import ALPHA, CELLS, cell_name
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.inference import at_least, proportion
from cgla_graph.comparisons.claims.paper.flights import RADIUS, STEP
from cgla_graph.comparisons.claims.paper.obstacle_checks import check_c39, check_c40, check_c41, shipped, supported
from cgla_graph.comparisons.claims.paper.sharing_checks import check_c42, check_c43, check_c45, check_c51
from cgla_graph.comparisons.claims.paper.team_experiments import COLLISION_DISTANCE, FEW_THREATS, STEPNUM, fly_two
from cgla_graph.comparisons.statistics.paired import holm
from cgla_graph.errors import MissionError
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import LEAST_GAMMA
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.scenarios.random_map import random_scenario

#: The share of missions that has to succeed for "it works".
MOSTLY = 0.95
#: What rounding may do to distances on a map of size 1.
ROUNDING = 1e-12


def check_c48(evidence: Evidence) -> Finding:
    """C48: it works with two UAVs among five and seven threats."""
    samples = evidence.samples["few-threats"]
    cases = [{**cell, "threats": threats} for threats in FEW_THREATS for cell in CELLS]
    succeeded = [samples.column("arrived", **case) * (1.0 - samples.column("collided", **case)) for case in cases]
    p_values = holm([at_least(column, MOSTLY) for column in succeeded])
    rates = [proportion(column) for column in succeeded]
    rows = [
        (cell_name(case), found.n, found.count, found.rate, *found.interval, p)
        for case, found, p in zip(cases, rates, p_values, strict=True)
    ]
    flights = {name: next(iter(shipped(name).values())).fly() for name in ("fig12-five", "fig12-seven")}
    works = all(flight.all_arrived and flight.least_separation >= COLLISION_DISTANCE for flight in flights.values())
    shown = sum(p < ALPHA for p in p_values)
    apart = ", ".join(f"{flight.least_separation:.2g}" for flight in flights.values())
    return Finding(
        supported(works and shown == len(cases)),
        f"Both arrive without a collision on {min(one.rate for one in rates):.3g} to "
        f"{max(one.rate for one in rates):.3g} of random maps; that it is more than {MOSTLY:g} is shown in {shown} of "
        f"{len(cases)} cells.",
        parts=(
            Part(
                "On maps like those of Fig. 12, both arrive and keep apart.",
                supported(works),
                f"missions fig12-five and fig12-seven: least separations {apart}; the maps are ours",
            ),
        ),
        tables=(
            Table(
                "Two UAVs that share and keep apart by virtual obstacles: both arrive, and never collide",
                ("cell", "maps", "succeed", "share", "95 % from", "to", f"p of at most {MOSTLY:g} (Holm)"),
                rows,
            ),
        ),
        notes=(
            (
                "Rule, set before the sample was drawn: supported if in every row the share is shown to be above "
                f"{MOSTLY:g} (binomial test, Holm over the table), and both shipped missions succeed. Fewer than 59 "
                "maps cannot show it, even if all succeed; after Holm's adjustment it takes 108."
            ),
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
        reach = everybody if flight.mission.shares.is_on else seen[one.name]
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


def check_c49(evidence: Evidence) -> Finding:
    """C49: threats enter only inside OR; SD/OR is above 0.1."""
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
        Verdict.PROVED,
        f"Asserted on the logs of {count} missions: all {detected} detections happened within OR, nobody knew of a "
        "threat that was not seen so before, and nothing within OR was missed. Missions with SD/OR of at most 0.1 are "
        "refused.",
        notes=(
            "It is how the method is defined: the assertion is one about this program.",
            (
                f"With OR = {RADIUS:g}, SD/OR > {LEAST_GAMMA:g} says that the safe distance is more than {STEP:g}, one "
                "step of flight. Section 4.1 gives the ratio once one way and once the other (E21)."
            ),
        ),
    )


CLAIMS = (
    Claim(
        "C39",
        "Section 5.2.1, Fig. 7",
        "With a virtual obstacle 0 or 5 steps ahead two UAVs collide, with 3 steps they do not.",
        "On random maps, collisions are rarer with stepnum 3 than with 0, and than with 5, in every cell.",
        Kind.STATISTIC,
        check_c39,
        experiments=("stepnum",),
        figures=("Fig. 7",),
    ),
    Claim(
        "C40",
        "Section 5.2.1, Fig. 8",
        "Two UAVs of one speed collide near (0.5, 0.7); with virtual obstacles they avoid each other.",
        "It is so on a map like that of Fig. 8, and on random maps collisions are rarer with virtual obstacles.",
        Kind.SCENARIO,
        check_c40,
        experiments=("stepnum",),
        figures=("Fig. 8",),
    ),
    Claim(
        "C41",
        "Section 5.2.1",
        "Virtual obstacles keep UAVs from colliding.",
        "No mission with virtual obstacles (stepnum = 3) has two UAVs closer than the collision distance.",
        Kind.STATISTIC,
        check_c41,
        experiments=("stepnum",),
        figures=("Fig. 8",),
    ),
    Claim(
        "C42",
        "Section 5.2.2, Fig. 9, Table 3",
        "With sharing, UAVs fly shorter and with less risk.",
        "Over both UAVs, the sum of risk and the length are less with sharing, in every cell and for K = 20 and 70.",
        Kind.STATISTIC,
        check_c42,
        experiments=("sharing",),
        figures=("Fig. 9", "Table 3"),
    ),
    Claim(
        "C43",
        "Section 4.2.2, Fig. 4",
        "What one UAV detects the other ones know, even one that is still at its start.",
        "With sharing, on every tick each UAV knows the union of all detections until then.",
        Kind.PROOF,
        check_c43,
        figures=("Fig. 4",),
    ),
    Claim(
        "C45",
        "Section 1",
        "One matrix for all UAVs is bad when they cannot communicate; a matrix for each is better.",
        "Without communication, cost and sum of risk of both UAVs are greater on one matrix that is out of reach than "
        "on a matrix each, in every cell.",
        Kind.STATISTIC,
        check_c45,
        experiments=("sharing",),
    ),
    Claim(
        "C48",
        "Section 5.2.2, Fig. 12",
        "The method works for two UAVs among five and among seven threats.",
        "On random maps with five and seven threats, both arrive and never collide with a probability above "
        f"{MOSTLY:g}.",
        Kind.STATISTIC,
        check_c48,
        experiments=("few-threats",),
        figures=("Fig. 12",),
    ),
    Claim(
        "C49",
        "Section 4.1",
        "A threat is known once it is within the detection radius OR, and the safe distance SD is above 0.1 OR.",
        "On every tick, a threat is known to a UAV if and only if it, or one that told it, has had it within OR.",
        Kind.PROPERTY,
        check_c49,
    ),
    Claim(
        "C51",
        "Section 6",
        "A shorter path with smaller risk can be achieved, in polynomial time.",
        "Over both UAVs, length and sum of risk are less with sharing (C42); the number of operations is bounded by a "
        "polynomial in N and M (C17, C22).",
        Kind.STATISTIC,
        check_c51,
        experiments=("sharing",),
    ),
)
