"""What UAVs see, and what they gain by telling each other (C42, C43, C45, C49, C51)."""

import math
from collections.abc import Sequence
from dataclasses import replace
from itertools import product
from typing import Any, Literal

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require, supported
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    RULE,
    Contrast,
    adjusted,
    all_hold,
    contrast_table,
    in_cells,
    span,
    supported_by,
    tally,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import experiment
from cgla_graph.comparisons.claims.inference import log_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import (
    RADIUS,
    STEP,
    STEPNUM,
    TEAM_K,
    fly_two,
    fly_variants,
    team_measures,
)
from cgla_graph.errors import MissionError
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import LEAST_GAMMA
from cgla_graph.mission.sharing import Sharing
from cgla_graph.mission.virtual_obstacle import VirtualObstacle
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.scenarios.random_map import random_scenario

#: Risk weights of the comparison with and without sharing.
SHARING_KS = (20, 70)
#: A UAV whose detection radius is this sees nothing: what it plans on is as old as its take-off.
BLIND = 1e-6
COUNTEREXAMPLE = "c42-sharing-hurts.toml"
#: What sharing takes off the sum of risk and the length in the paper's Table 3, percent.
PAPER_SAVES = {"risk_sum": 100.0 * (1.0 - 0.5383 / 0.9825), "length": 100.0 * (1.0 - 240.0 / 281.6)}
#: What rounding may do to distances on a map of size 1.
ROUNDING = 1e-12


def sharings(seed: int) -> dict[str, Sharing | Literal["none", "global"]]:
    """
    Return the ways in which two UAVs with a matrix each communicate.

    Examples
    --------
    >>> list(sharings(1))
    ['none', 'global', 'radius', 'loss', 'delay']
    """
    return {
        "none": "none",
        "global": "global",
        "radius": Sharing(radius=RADIUS),
        "loss": Sharing(loss=0.9, seed=seed),
        "delay": Sharing(delay=10),
    }


@experiment("sharing")
def sample_sharing(seed: int) -> list[dict[str, Any]]:
    """Fly with and without sharing; for one K also with a poor radio, and with one matrix that nobody can reach."""
    field = random_scenario(seed).problem.field
    records = []
    for cell, k in product(CELLS, SHARING_KS):
        flights = {
            name: fly_two(field, k=k, sharing=sharing, **cell)
            for name, sharing in sharings(seed).items()
            if k == TEAM_K or name in {"none", "global"}
        }
        if k == TEAM_K:
            # a matrix kept elsewhere, out of reach from take-off on: no sighting gets into it
            flights["unreachable"] = fly_two(field, k=k, **{**cell, "radius": BLIND})
        records += [{**cell, "k": k, "sharing": name, **team_measures(one)} for name, one in flights.items()]
    return records


def effects_of_sharing(samples: Samples, measure: str) -> list[Contrast]:
    """Compare a sum over both UAVs without and with sharing, in every cell and for every K."""
    cells = [{**cell, "k": k} for k in SHARING_KS for cell in CELLS]
    without, shared = {"sharing": "none"}, {"sharing": "global"}
    return adjusted(in_cells(samples, f"{measure}: without > with", measure, without, shared, cells))


def _saves(contrasts: Sequence[Contrast]) -> str:
    saved = [100.0 - 100.0 / one.shift.shift.median for one in contrasts]
    return f"{span(saved, '.2g')} %"


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
    shares = []
    for k in SHARING_KS:
        case = {"integral": "exact", "radius": RADIUS, "k": k}
        without, shared = ({**case, "sharing": name} for name in ("none", "global"))
        is_less = [samples.column(name, **shared) < samples.column(name, **without) for name in ("length", "risk_sum")]
        shares.append(proportion(is_less[0] & is_less[1]).rate)
    return shares


@claim(
    42,
    "Section 5.2.2, Fig. 9, Table 3",
    "With sharing, UAVs fly shorter and with less risk.",
    "Over both UAVs, the sum of risk and the length are less with sharing, in every cell and for K = 20 and 70.",
    Kind.STATISTIC,
    experiments=("sharing",),
    figures=("Fig. 9", "Table 3"),
)
def _check_c42(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    risk, length = (effects_of_sharing(samples, measure) for measure in ("risk_sum", "length"))
    factors = _sharing_hurts()
    return Finding(
        supported_by([*risk, *length]),
        f"Over both UAVs, sharing takes {_saves(risk)} off the sum of risk (shown {tally(risk)}) and {_saves(length)} "
        f"off the length (shown {tally(length)}).",
        parts=(
            Part("Sharing lowers the risk.", supported_by(risk), f"by {_saves(risk)}, {tally(risk)}"),
            Part("Sharing shortens the flight.", supported_by(length), f"by {_saves(length)}, {tally(length)}"),
            Part(
                "Sharing never hurts.",
                Verdict.REFUTED,
                f"in {COUNTEREXAMPLE} both together fly {factors['length']:.3g} times as far, with "
                f"{factors['risk_sum']:.3g} times the sum of risk",
            ),
        ),
        tables=(
            contrast_table("Sum of risk, without over with sharing", risk),
            contrast_table("Length, without over with sharing", length),
        ),
        notes=(
            "Supported only if both risk and length are, in every cell and for K = 20 and 70.",
            (
                f"The paper's Table 3 has {PAPER_SAVES['risk_sum']:.3g} % less risk and {PAPER_SAVES['length']:.3g} % "
                "less length, of one UAV on one map on which it is what the other one sees that matters."
            ),
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
    "Section 4.2.2, Fig. 4",
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
    return Finding(
        Verdict.PROVED,
        "With sharing, what a UAV knows on any tick is the union of what all have seen until then, so never less than "
        f"what it has seen itself: asserted on every tick of {len(seeds)} missions, in which {told} threats were told.",
        parts=(
            Part(
                "What is shared contains what is known without, on the same tick of the same flights.",
                Verdict.PROVED,
                "by construction: reports are only added, and each is sent to all",
            ),
            Part(
                "As in Fig. 4, a UAV at its start knows a threat that is only in the other one's detection radius.",
                Verdict.PROVED,
                f"mission fig4: at tick 0 the left UAV knows {len(at_start)} threat more; its flight costs "
                f"{shared.cost:.4g} with sharing, {alone.cost:.4g} without",
            ),
        ),
        notes=("That more knowledge is a better flight is another claim, and does not hold always (C42).",),
    )


def _communication_table(samples: Samples) -> Table:
    case = {"integral": "exact", "radius": RADIUS, "k": TEAM_K}
    best = samples.column("cost", sharing="global", **case)
    names = {
        "global": "a matrix each, all is told (or one matrix in reach)",
        "radius": "a matrix each, radio range 0.2",
        "delay": "a matrix each, told 10 ticks late",
        "loss": "a matrix each, 9 of 10 messages lost",
        "none": "a matrix each, nothing is told",
        "unreachable": "one matrix out of reach",
    }
    rows = []
    for name, words in names.items():
        found = log_shift(samples.column("cost", sharing=name, **case), best)
        rows.append((words, found.n, *found.shift, found.effect))
    return Table(
        "Cost of both UAVs over that with all told at once",
        ("matrices", "maps", "ratio", "95 % from", "to", "effect"),
        rows,
        "Exact integrals, OR = 0.2, K = 20. Hodges-Lehmann ratios.",
    )


@claim(
    45,
    "Section 1",
    "One matrix for all UAVs is bad when they cannot communicate; a matrix for each is better.",
    "Without communication, cost and sum of risk of both UAVs are greater on one matrix that is out of reach than "
    "on a matrix each, in every cell.",
    Kind.STATISTIC,
    experiments=("sharing",),
)
def _check_c45(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    cells = [{**cell, "k": TEAM_K} for cell in CELLS]
    unreachable, own = {"sharing": "unreachable"}, {"sharing": "none"}
    cost, risk = (
        adjusted(in_cells(samples, f"{measure}: out of reach > own", measure, unreachable, own, cells))
        for measure in ("cost", "risk_sum")
    )
    return Finding(
        supported_by([*cost, *risk]),
        "Without communication, one matrix that nobody can reach costs more than a matrix each: cost shown "
        f"{tally(cost)}, sum of risk shown {tally(risk)}.",
        parts=(
            Part(
                "Without communication, a matrix each is better than one for all.",
                supported_by([*cost, *risk]),
                f"cost {tally(cost)}; sum of risk {tally(risk)}",
            ),
            Part(
                "With communication, a matrix each is as good as one for all.",
                Verdict.PROVED,
                "both hold the union of what all have seen (C43), so the plans are the same",
            ),
        ),
        tables=(
            contrast_table("One matrix out of reach against a matrix each", [*cost, *risk]),
            _communication_table(samples),
        ),
        notes=(
            RULE,
            (
                "The paper does not say what UAVs do that cannot reach the shared matrix. Here they fly on what it "
                "said at take-off, when nothing was detected: the straight line."
            ),
            f"The other {len(sharings(0)) - 1} ways of telling are no part of the verdict.",
        ),
    )


@claim(
    51,
    "Section 6",
    "A shorter path with smaller risk can be achieved, in polynomial time.",
    "Over both UAVs, length and sum of risk are less with sharing (C42); the number of operations is bounded by a "
    "polynomial in N and M (C17, C22).",
    Kind.STATISTIC,
    experiments=("sharing",),
)
def _check_c51(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    risk, length = (effects_of_sharing(samples, measure) for measure in ("risk_sum", "length"))
    shown = all_hold([*risk, *length])
    flights = fly_variants(load_mission("fig9"))
    without, shared = (team_measures(flights[name]) for name in ("without sharing", "with sharing"))
    can = shared["length"] < without["length"] and shared["risk_sum"] < without["risk_sum"]
    rates = _both_better(samples)
    return Finding(
        supported(shown),
        f"Shorter with less risk at once on {span(rates)} of random maps (which sharing does on "
        f"average: {'shown' if shown else 'not shown'} in every cell, C42); the time is polynomial, which is proved.",
        parts=(
            Part(
                "Cooperation can make flights shorter and less risky at once.",
                supported(can),
                f"mission fig9: length {without['length']:.3g} to {shared['length']:.3g}, sum of risk "
                f"{without['risk_sum']:.3g} to {shared['risk_sum']:.3g}",
            ),
            Part("On average it does.", supported(shown), f"risk {tally(risk)}; length {tally(length)}"),
            Part(
                "The time is polynomial.",
                Verdict.PROVED,
                "at most (M + 1)(N^2 - 1) moves (C17) of O(N^4) line integrals and operations each (C22): O(M N^6) for "
                "a UAV in the worst case, under the condition of C17",
            ),
        ),
        notes=("With virtual obstacles there is no such bound: a flight may never end (C19).",),
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
