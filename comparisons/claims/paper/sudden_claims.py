"""Sudden threats (C37, C38): how K changes the way past one, and how much is met of one that comes up near by."""

import math
from dataclasses import replace
from functools import partial

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import FLOWN, OVER_K, Answer, Basis, Finding, Row, Table, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.flights import STEP
from cgla_graph.comparisons.claims.panel.sudden import HIGH_KS, LOW_K, POPUP, POPUP_START, SPREADS_AHEAD, weights_of
from cgla_graph.comparisons.claims.paper.arrival_claims import AS_C17, ROUNDING, stored_livelocks
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement
from cgla_graph.mission.world import TimedThreat
from cgla_graph.scenarios.mission_file import load_mission
from cgla_graph.solvers import get
from cgla_graph.timed.timed_problem import TimedProblem

_ON_TOP = "threat-on-top.toml"
#: Of Fig. 6 by K: the cost of the best flight found that knows of the threat from the start, and what none costs less
#: than, proven in space and time (by `tests/comparisons/claims/test_sudden_claims.py` again: it takes a minute).
KNOWING = {10.0: (0.8407, 0.8211), 100.0: (1.0857, 1.0661)}
_LOW, _HIGH = (value("Table 2", f"CGLA, K = {k}") for k in (10, 100))


_greater = partial(
    Statement,
    first={"side": "greater K"},
    second={"side": "least K"},
    factors=("threats", "spread", "radius", "high"),
)
COMPARED = (
    _greater("the greater K meets less risk", "risk", printed=f"x {_HIGH.risk / _LOW.risk:.3g}"),
    _greater("the greater K flies farther", "length", less=False, printed=f"x {_HIGH.length / _LOW.length:.3g}"),
)
EVADED = Statement(
    "less of a threat ahead than flying on",
    "met",
    {"evades": True},
    {"evades": False},
    factors=("threats", "spread", "radius", "k", "ahead"),
    where={"event": "ahead"},
)


@claim(
    37,
    "Section 5.1",
    "After a sudden threat, K = 100 flies on with less risk and a little farther than K = 10.",
    f"A threat at {POPUP} comes up a step after {POPUP_START}, as broad as the map's are; goal on the diagonal, as in "
    "Fig. 6; K = 50, 100 and 200 against K = 10 on the same maps; varied: integral, replanning, start.",
    experiments=("sudden-threats",),
    figures=("Fig. 6", "Table 2"),
    settings={**OVER_K, "k": OVER_K["k"]._replace(usual=(LOW_K, *HIGH_KS))},
)
def _check_c37(evidence: Evidence) -> Finding:
    low, _ = weights_of(evidence.panel)
    samples = sides(evidence.samples["sudden-threats"], low)
    found = [judged(samples, replace(one, size=f"x {{}} of K = {low:g}'s")) for one in COMPARED]
    return Finding(
        tuple(one.row for one in found),
        notes=(
            "Where the UAV is when the threat appears, and how broad it is, the paper does not say.",
            "If all is known from then on, less risk and a greater length are a theorem (C28).",
        ),
        tables=(
            panel_table(f"After a sudden threat: a greater K over K = {low:g} (ratios)", found),
            against_full_knowledge(),
        ),
    )


def fig_6_in_time() -> list[tuple[TimedProblem, FloatArray]]:
    """Return the problem of one that knows of the threat of Fig. 6 from the start, for each K, and what CGLA flies."""
    found = []
    for mission in load_mission("fig6").missions(get).values():
        world, (flight,) = mission.world, mission.fly().uavs.values()
        ((tick, threat),) = ((one.appears, one.threat) for one in world.timed if isinstance(one, TimedThreat))
        start, goal = flight.path[[0, -1]].tolist()
        after = (tick, world.field.with_threats([threat]))
        problem = TimedProblem(start, goal, world.field, k=flight.uav.k, speed=STEP, fields=[after])
        found.append((problem, np.column_stack([flight.times, flight.path])))
    return found


def against_full_knowledge() -> Table:
    """Hold the flights of the mission of Fig. 6 against all that know from the start which threat comes up."""
    rows = []
    for problem, flown in fig_6_in_time():
        seen, (best, least) = problem.evaluate(flown), KNOWING[problem.k]
        require(seen.feasible and seen.cost >= least, f"the flight of Fig. 6 at K = {problem.k:g} undercuts a proof")
        rows.append((f"{problem.k:g}", seen.cost, best, least, seen.cost / best, seen.cost / least))
    return Table(
        "Fig. 6: flown without knowing of the threat, against flights that know of it (mission fig6)",
        (
            "K",
            "cost flown",
            "best found that knows",
            "none costs less than",
            "flown over found",
            "at most over the best",
        ),
        rows,
        "All begin and end where the flight does, at its speed. What none costs less than is proven in space and time.",
    )


def sides(samples: Samples, low: float = LOW_K) -> Samples:
    """Say of flights past the threat of Fig. 6 which side of their pair they are on."""
    flown = samples.where(event="Fig. 6")
    return Samples([{**one, "side": "least K" if one["k"] == low else "greater K"} for one in flown], samples.failed)


@claim(
    38,
    "Section 5.1",
    "The method is robust against whatever threat appears.",
    f"A threat comes up {', '.join(f'{one:g}' for one in SPREADS_AHEAD)} spreads straight ahead, and its risk that the "
    "flight meets is compared with that of flying on, so that no bar is needed; all K and OR, goal on the diagonal. A "
    "stored flight meets a threat on top of the UAV.",
    experiments=("sudden-threats",),
    figures=("Fig. 6",),
    settings=FLOWN,
)
def _check_c38(evidence: Evidence) -> Finding:
    risk, least, k = require_on_top()
    stored_livelocks()
    samples = evidence.samples["sudden-threats"]
    flown = samples.records
    require(all(one["arrived"] for one in flown), "a UAV among threats that stay where they come up did not arrive")
    found = judged(samples, EVADED)
    low = f"of a threat on top of the UAV every way meets {least:.3g} or more; CGLA, K = {k:g}: {risk:.3g}"
    size = f"risk sum at least {50.0 * least:.3g}"
    arrives = f"by C17's proofs, which count a sudden threat that stays as one more; all {len(flown)} flights arrive"
    return Finding(
        (
            Row("the risk stays low, whatever appears", Answer.FAILS, Basis.COUNTEREXAMPLE, size=size, why=low),
            found.row,
            Row("the UAV arrives", Answer.DEPENDS, Basis.COUNTEREXAMPLE, AS_C17, why=arrives),
        ),
        notes=(
            "Bound: a way from the centre has at least dr between distances r and r + dr, so its risk is at least that",
            "of half a straight flight through the centre, the integral of exp(-r^2 / (2 spread^2)) over r.",
        ),
        tables=(panel_table("Risk met of a sudden threat straight ahead, over that of flying on (ratios)", [found]),),
        counterexamples=(_ON_TOP,),
    )


def require_on_top() -> tuple[float, float, float]:
    """Fly the stored flight under a threat that comes up: its risk, the least of any way from there, and its K."""
    stored = counterexamples.mission(_ON_TOP)
    (mission,) = stored.missions(get).values()
    (flight,) = mission.fly().uavs.values()
    ((tick, threat),) = ((one.appears, one.threat) for one in stored.world.timed if isinstance(one, TimedThreat))
    at = flight.position_at(tick)
    least = half_crossing(threat.spread, math.dist((threat.x, threat.y), flight.uav.goal))
    on_top = at is not None and math.dist(at, (threat.x, threat.y)) <= ROUNDING
    shown = on_top and flight.risk >= least - ROUNDING
    require(shown, f"{_ON_TOP} no longer shows a threat on top of the UAV with at least {least:.4f} of risk")
    return flight.risk, least, flight.uav.k


def half_crossing(spread: float, distance: float) -> float:
    """
    Return the least risk of any way from the centre of a threat of peak 1 to a distance from it.

    Examples
    --------
    >>> round(half_crossing(0.055, 0.4), 6)
    0.068932
    """
    return spread * math.sqrt(math.pi / 2.0) * math.erf(distance / (math.sqrt(2.0) * spread))
