"""What K does (C28): a theorem where all of the map is known, and flights where it is not."""

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.panel.flights import paper_lattice
from cgla_graph.comparisons.claims.panel.settings import KINDS, PanelMap, seeds_of
from cgla_graph.comparisons.claims.rule import judged, panel_table
from cgla_graph.comparisons.claims.statement import Statement
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.problem import Problem
from cgla_graph.scenarios.mission_file import MissionFile
from cgla_graph.solvers import get
from cgla_graph.solvers.trade_off.reweighing import Reweighed

#: Risk weights under which the theorem is asserted.
WEIGHTS = (1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0)
#: What optima of the same cost may differ by, relative to them: rounding, where a tie is decided.
TIE = 1e-9
EXCHANGE = (
    "Proof (exchange): let paths P and Q be optimal for K < K'. Adding L(P) + K R(P) <= L(Q) + K R(Q) and "
    "L(Q) + K' R(Q) <= L(P) + K' R(P) gives (K' - K)(R(Q) - R(P)) <= 0, so R falls or stays; then the first gives "
    "L(P) <= L(Q). The least cost is a minimum of lines in K: concave and rising."
)
_RISES = "risk-rises-with-k.toml"
_IN_FLIGHT = ("threats", "spread", "goal", "radius")


def _step(text: str, measure: str, low: float, high: float, size: str, printed: str, *, less: bool = True) -> Statement:
    """Compare flights of CGLA under two risk weights."""
    return Statement(
        text,
        measure,
        {"k": high},
        {"k": low},
        less=less,
        factors=_IN_FLIGHT,
        where={"mode": "flown", "planner": "cgla"},
        size=size,
        printed=printed,
    )


STATEMENTS = (
    _step("less risk in flight, K = 50 against 10", "risk", 10.0, 50.0, "x {}", "x 0.261"),
    _step("less risk in flight, K = 200 against 50", "risk", 50.0, 200.0, "x {}", "x 0.218"),
    _step("less risk in flight, K = 200 against 10", "risk", 10.0, 200.0, "x {}", "x 0.057"),
    _step("lower peaks of risk in flight, K = 200 against 10", "max_risk", 10.0, 200.0, "x {}", ""),
    _step("farther in flight, K = 200 against 10", "length", 10.0, 200.0, "{} % more", "12 % more", less=False),
)


@claim(
    28,
    "Section 5.1",
    "The greater K is, the less risky is the way, and the longer; K = 10 passes risky regions, which K = 200 avoids.",
    "All kinds of maps and detection radii, CGLA flown on each with K = 10, 50 and 200; varied: integral, replanning "
    "and start. With all known it is a theorem, which is asserted on a map of each kind and more.",
    merged=(29, 30),
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
)
def _check_c28(evidence: Evidence) -> Finding:
    seeds = [seed for kind in KINDS for seed in seeds_of(kind, evidence.scale.seed, evidence.instances(10, 1))]
    optima = np.array([optima_over_k(PanelMap(seed).problem(WEIGHTS[0])) for seed in seeds])
    require_exchange(*np.moveaxis(optima, 2, 0))
    found = [judged(evidence.samples["single-uav"], one) for one in STATEMENTS]
    low, high = flown_alone(counterexamples.mission(_RISES))
    require(high > low, f"{_RISES} no longer shows a flight with more risk for K = 200 than for K = 10")
    rows = (
        Row(
            "never more risk, never shorter, with all known",
            Answer.HOLDS,
            Basis.PROOF,
            why=f"asserted on {len(seeds)} maps x {len(WEIGHTS)} K without exception",
        ),
        *(one.row for one in found),
        Row(
            "less risk in flight on every map",
            Answer.FAILS,
            Basis.COUNTEREXAMPLE,
            size=_rising(evidence.samples["single-uav"]),
            why=f"on the stored map K = 200 meets {high / low:.3g} times the risk of K = 10",
        ),
        Row(
            "K = 10 passes the regions near (0.5, 0.5) and (0.8, 0.8)",
            Answer.NOT_TESTABLE,
            Basis.TEXT,
            why="the paper's map is not printed",
        ),
    )
    return Finding(
        rows,
        notes=(
            EXCHANGE,
            "A flight's plans are optimal for what is known, not for the map: the theorem does not carry over.",
        ),
        tables=(panel_table("CGLA's flights under two K (ratios, the greater K over the smaller)", found),),
        counterexamples=(_RISES,),
    )


def optima_over_k(problem: Problem) -> FloatArray:
    """
    Solve a problem exactly under each of `WEIGHTS`: risk, length and cost of the optima, shape ``(K, 3)``.

    Examples
    --------
    >>> optima_over_k(PanelMap(0).problem(1.0)).shape
    (8, 3)
    """
    reweighed = Reweighed(problem, "cgla", resolution=paper_lattice())
    found = [reweighed.at(k) for k in WEIGHTS]
    return np.array([(one.risk, one.length, one.cost) for one in found])


def require_exchange(risk: FloatArray, length: FloatArray, cost: FloatArray) -> None:
    """
    Assert the theorem of optima, each of shape ``(maps, K)``, as a check of the program.

    Raises
    ------
    AssertionError
        If risk rises, length falls, or the least cost is not concave and rising in K.
    """
    slopes = np.diff(cost, axis=1) / np.diff(WEIGHTS)
    broken = {
        "risk rises with K": _any_above(risk[:, 1:], risk[:, :-1]),
        "length falls with K": _any_above(length[:, :-1], length[:, 1:]),
        "the least cost falls with K": _any_above(cost[:, :-1], cost[:, 1:]),
        "the least cost is not concave in K": _any_above(slopes[:, 1:], slopes[:, :-1]),
    }
    for words, happens in broken.items():
        require(not happens, f"{words} with full information, against the exchange argument: an optimum is none")


def _any_above(first: FloatArray, second: FloatArray) -> bool:
    # what is not finite is no optimum
    return not bool((first <= second + TIE * (1.0 + np.abs(second))).all())


def flown_alone(file: MissionFile) -> list[float]:
    """
    Fly all variants of a mission of one UAV, and return the risk of each.

    Raises
    ------
    AssertionError
        If one does not arrive.
    """
    flights = [mission.fly().uavs["a"] for mission in file.missions(get).values()]
    for flight in flights:
        require(flight.status is MissionStatus.ARRIVED, f"{file.name}: {flight.status.value}")
    return [flight.risk for flight in flights]


def _rising(samples: Samples) -> str:
    """Say on what share of flights risk rises from the least K to the greatest."""
    flown = {"mode": "flown", "planner": "cgla", "varied": ""}
    risks = {
        k: {(one["map"], one["radius"]): one["risk"] for one in samples.where(**flown, k=k) if one["arrived"]}
        for k in (10.0, 200.0)
    }
    both = risks[10.0].keys() & risks[200.0].keys()
    rises = sum(risks[200.0][one] > risks[10.0][one] * (1.0 + TIE) for one in both)
    return f"rises on {100.0 * rises / len(both):.0f} % of flights" if both else ""
