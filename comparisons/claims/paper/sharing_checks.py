"""Checks of what UAVs gain by telling each other what they see (C42, C43, C45, C51)."""

from collections.abc import Sequence

from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Finding, Part, Table, Verdict, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    RULE,
    Contrast,
    adjusted,
    all_hold,
    contrast,
    contrast_table,
    span,
    tally,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import log_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import RADIUS
from cgla_graph.comparisons.claims.paper.obstacle_checks import shipped, supported
from cgla_graph.comparisons.claims.paper.team_experiments import SHARING_KS, K, fly_two, sharings, team_measures
from cgla_graph.mission.records import Flight
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get

COUNTEREXAMPLE = "c42-sharing-hurts.toml"
#: What sharing takes off the sum of risk and the length in the paper's Table 3, percent.
PAPER_SAVES = {"risk_sum": 100.0 * (1.0 - 0.5383 / 0.9825), "length": 100.0 * (1.0 - 240.0 / 281.6)}


def effects_of_sharing(samples: Samples, measure: str) -> list[Contrast]:
    """Compare a sum over both UAVs without and with sharing, in every cell and for every K."""
    return adjusted(
        [
            contrast(
                samples,
                f"{measure}: without > with",
                measure,
                {"sharing": "none"},
                {"sharing": "global"},
                {**cell, "k": k},
            )
            for k in SHARING_KS
            for cell in CELLS
        ]
    )


def _saves(contrasts: Sequence[Contrast]) -> str:
    saved = [100.0 - 100.0 / one.shift.shift.median for one in contrasts]
    return f"{span(saved, '.2g')} %"


def _sharing_hurts() -> dict[str, float]:
    """Fly the stored counterexample again, assert that sharing hurts in every measure, and return by what factor."""
    missions = counterexamples.mission(COUNTEREXAMPLE).missions(get)
    without, shared = (team_measures(missions[name].fly()) for name in ("without sharing", "with sharing"))
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


def check_c42(evidence: Evidence) -> Finding:
    """C42: sharing makes flights shorter and safer."""
    samples = evidence.samples["sharing"]
    risk, length = (effects_of_sharing(samples, measure) for measure in ("risk_sum", "length"))
    factors = _sharing_hurts()
    holds = all_hold(risk) and all_hold(length)
    return Finding(
        supported(holds),
        f"Over both UAVs, sharing takes {_saves(risk)} off the sum of risk (shown {tally(risk)}) and {_saves(length)} "
        f"off the length (shown {tally(length)}).",
        parts=(
            Part("Sharing lowers the risk.", supported(all_hold(risk)), f"by {_saves(risk)}, {tally(risk)}"),
            Part("Sharing shortens the flight.", supported(all_hold(length)), f"by {_saves(length)}, {tally(length)}"),
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


def check_c43(evidence: Evidence) -> Finding:
    """C43: a UAV knows at once what another one detects."""
    seeds = evidence.scale.map_seeds(evidence.instances(100, 10))
    told = sum(require_union(fly_two(random_scenario(seed).problem.field, sharing="global")) for seed in seeds)
    require(told > 0, "on no map was anybody told anything")
    missions = shipped("fig4")
    shared, alone = (missions[name].fly().uavs["left"] for name in ("with sharing", "without sharing"))
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
    case = {"integral": "exact", "radius": RADIUS, "k": K}
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


def check_c45(evidence: Evidence) -> Finding:
    """C45: a matrix for each UAV is better than a shared one."""
    samples = evidence.samples["sharing"]
    ways = list(sharings(0))
    cells = [{**cell, "k": K} for cell in CELLS]
    cost, risk = (
        adjusted(
            [
                contrast(
                    samples,
                    f"{measure}: out of reach > own",
                    measure,
                    {"sharing": "unreachable"},
                    {"sharing": "none"},
                    cell,
                )
                for cell in cells
            ]
        )
        for measure in ("cost", "risk_sum")
    )
    return Finding(
        supported(all_hold(cost) and all_hold(risk)),
        "Without communication, one matrix that nobody can reach costs more than a matrix each: cost shown "
        f"{tally(cost)}, sum of risk shown {tally(risk)}.",
        parts=(
            Part(
                "Without communication, a matrix each is better than one for all.",
                supported(all_hold(cost) and all_hold(risk)),
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
            f"The other {len(ways) - 1} ways of telling are no part of the verdict.",
        ),
    )


def check_c51(evidence: Evidence) -> Finding:
    """C51: shorter paths with smaller risk, in polynomial time."""
    samples = evidence.samples["sharing"]
    risk, length = (effects_of_sharing(samples, measure) for measure in ("risk_sum", "length"))
    shown = all_hold(risk) and all_hold(length)
    missions = shipped("fig9")
    without, shared = (team_measures(missions[name].fly()) for name in ("without sharing", "with sharing"))
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
