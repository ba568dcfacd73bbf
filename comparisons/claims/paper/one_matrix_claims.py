"""One matrix for all UAVs, or a matrix each (C45)."""

from dataclasses import replace
from typing import Any

import numpy as np

from cgla_graph.comparisons.claims.claim import Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    MAIN,
    Contrast,
    cell_name,
    contrast,
    contrast_part,
    contrast_table,
    sizes,
    together,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.inference import log_shift
from cgla_graph.comparisons.claims.paper.flights import TEAM_K, fly_two
from cgla_graph.mission.agent import Agent
from cgla_graph.mission.belief import Belief, Report, sightings
from cgla_graph.mission.records import Flight
from cgla_graph.mission.rules import Rules
from cgla_graph.mission.simulation import Simulation
from cgla_graph.scenarios.random_map import random_scenario

#: Ticks from what a UAV sees to the plans of the others, or of all on one matrix: in 10, a UAV flies its sight.
DELAYS = (2, 5, 10)
#: Where one matrix is compared with a matrix each.
MATRIX_CELLS = tuple(cell for cell in CELLS if cell["replan"] == "change")


class OneMatrix(Simulation):
    """
    A mission in which all UAVs plan on one matrix, which hears late of what they see.

    A UAV has sensors, but no matrix of its own: what it has seen itself it plans on only when the matrix has it.

    Parameters
    ----------
    mission
        Who shares what does not matter: all know the same.
    delay
        Ticks from a sighting to the plans.
    """

    def __init__(self, mission: Rules, delay: int) -> None:
        super().__init__(mission)
        self._delay = delay
        self._seen = Belief()
        self._under_way: list[tuple[int, list[Report]]] = []

    def _sense(self, agent: Agent) -> None:
        radius, position = agent.uav.detection_radius, np.array([agent.position])
        seen = sightings(self.mission.world, self.tick, self._seen, position, radius, agent.number)
        self._under_way.append((self.tick + self._delay, self._seen.hear(seen)))

    def _share(self) -> None:
        for due, reports in self._under_way:
            if due == self.tick:
                for agent in self._agents:
                    agent.belief.hear(reports)
        super()._share()


def fly_on_one_matrix(mission: Rules, delay: int) -> Flight:
    """Fly a mission on one matrix for all UAVs, which they reach with a delay."""
    simulation = OneMatrix(mission, delay)
    while not simulation.is_over:
        simulation.advance()
    return simulation.flight()


def _require_same_with_communication(evidence: Evidence) -> str:
    """Assert that UAVs fly the same on one matrix, reached at once, and on a matrix each, with all told at once."""
    seeds = evidence.scale.map_seeds(evidence.instances(25, 5))
    for seed in seeds:
        each = fly_two(random_scenario(seed).problem.field, sharing="global")
        one = fly_on_one_matrix(each.mission, 0)
        for name, flight in each.uavs.items():
            same = np.array_equal(flight.trace, one.uavs[name].trace)
            require(same, f"map {seed}: {name} flies another way on one matrix that is reached at once")
    return f"asserted on {len(seeds)} missions: the same flights"


def one_against_each(samples: Samples, measure: str, delay: int) -> list[Contrast]:
    """Compare one matrix with a matrix each, where reports take so many ticks, in every cell."""
    what, late = f"{measure}: one matrix > each, {delay} ticks late", {"k": TEAM_K, "delay": delay}
    return [
        contrast(samples, what, measure, {"sharing": "one"}, {"sharing": "each"}, {**cell, **late}, name=cell)
        for cell in MATRIX_CELLS
    ]


def one_against_silence(samples: Samples, delay: int) -> list[Contrast]:
    """Compare the cost on one matrix that hears so many ticks late with that on a matrix each, without a word."""
    what, one = f"cost: one matrix, {delay} ticks late > each, nothing told", {"sharing": "one", "delay": delay}
    return [
        contrast(samples, what, "cost", one, {"sharing": "none"}, {**cell, "k": TEAM_K}, name=cell)
        for cell in MATRIX_CELLS
    ]


def _communication_table(samples: Samples) -> Table:
    case = {**MAIN, "k": TEAM_K}
    best = samples.column("cost", sharing="global", **case)
    late = [(kind, delay) for kind in ("each", "one") for delay in DELAYS]
    names: dict[str, dict[str, Any]] = {
        "either, all is known at once": {"sharing": "global"},
        **{
            f"{'a matrix each' if kind == 'each' else 'one matrix'}, {delay} ticks late": {
                "sharing": kind,
                "delay": delay,
            }
            for kind, delay in late
        },
        "a matrix each, nothing is told": {"sharing": "none"},
        "one matrix out of reach: the first plan is flown": {"sharing": "unreachable"},
    }
    rows = []
    for words, which in names.items():
        costs, risks = (samples.column(measure, **which, **case) for measure in ("cost", "risk_sum"))
        found = log_shift(costs, best)
        more = log_shift(risks, samples.column("risk_sum", sharing="global", **case))
        rows.append((words, found.n, *found.shift, more.shift.median))
    return Table(
        "Both UAVs against those that know at once what all have seen",
        ("matrices", "maps", "cost ratio", "95 % from", "to", "risk sum ratio"),
        rows,
        f"{cell_name(MAIN)}, K = {TEAM_K}. Hodges-Lehmann ratios.",
    )


@claim(
    45,
    "Section 1",
    "One matrix for all UAVs is bad when they cannot communicate; a matrix for each is better.",
    "Where reports take 2, 5 or 10 ticks, both UAVs together cost more on one matrix, into which also what they see "
    "themselves gets so late, than on a matrix each, in every cell.",
    Kind.STATISTIC,
    experiments=("sharing",),
)
def _check_c45(evidence: Evidence) -> Finding:
    samples = evidence.samples["sharing"]
    cost = {delay: one_against_each(samples, "cost", delay) for delay in DELAYS}
    risk = {delay: one_against_each(samples, "risk_sum", delay) for delay in DELAYS}
    alone = {delay: one_against_silence(samples, delay) for delay in DELAYS}
    blind = log_shift(*(samples.column("cost", sharing=name, k=TEAM_K, **MAIN) for name in ("unreachable", "none")))
    same = _require_same_with_communication(evidence)
    better = "a matrix each is better"
    parts = [
        replace(
            contrast_part(better, one, condition=f"if reports take {delay} ticks"),
            effect=f"{sizes(one)} times the cost at {delay} ticks",
        )
        for delay, one in cost.items()
    ]
    return Finding(
        (
            Part(
                better,
                Verdict.NOT_TESTABLE,
                f"who neither writes nor reads flies the first plan, whatever comes up: {blind.shift.median:.3g} times "
                "the cost, by construction, which is no evidence",
                "if the one matrix is out of reach for good",
            ),
            *parts,
            Part("both are the same", Verdict.PROVED, same, "if reports take no time, or each UAV keeps a copy"),
        ),
        "Over a link that is slow for both, one matrix for all costs "
        + ", ".join(f"{sizes(one)} times as much with {delay} ticks" for delay, one in cost.items())
        + ". Out of reach for good it is worse by construction, at once it is the same.",
        beside=tuple(
            contrast_part(
                "a matrix each is better than one even if nothing is told",
                one,
                condition=f"if the one hears {delay} ticks late",
            )
            for delay, one in alone.items()
        ),
        tables=(
            contrast_table("One matrix against a matrix each: cost and risk sum", [*together(cost), *together(risk)]),
            contrast_table("One matrix with delay against a matrix each without any communication", together(alone)),
            _communication_table(samples),
        ),
        notes=(
            (
                "The paper does not say what UAVs do that cannot reach the shared matrix. Readings: (a) it is kept "
                "elsewhere and out of reach, so the plan of the start is flown; (b) it is reached late, so that a UAV "
                "plans on what it sees itself only when the matrix has it; (c) each UAV keeps a copy, in which it "
                "notes what it sees: that is a matrix each. Only (b) is for a test to decide."
            ),
            "A UAV flies 0.02 a tick, so 10 ticks are its sight.",
        ),
    )
