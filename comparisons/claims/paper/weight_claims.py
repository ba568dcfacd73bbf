"""What K does (C28): a theorem where all of the map is known, and flights where it is not."""

from collections.abc import Sequence
from functools import partial
from itertools import pairwise
from typing import Any

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import OVER_K, Answer, Basis, Finding, Row, claim, require
from cgla_graph.comparisons.claims.evidence import Evidence
from cgla_graph.comparisons.claims.panel.flights import paper_lattice
from cgla_graph.comparisons.claims.panel.settings import PANEL, Panel
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


#: Risk of the greater K over that of the smaller, in the paper.
_PRINTED = {(10.0, 50.0): "x 0.261", (50.0, 200.0): "x 0.218", (10.0, 200.0): "x 0.057"}


def statements(panel: Panel = PANEL) -> list[Statement]:
    """List what is said of flights: a K against the next smaller one, and the greatest against the least."""
    of = partial(Statement, factors=_IN_FLIGHT, where={"mode": "flown", "planner": "cgla"})
    ks = panel.levels("k")
    ends = ks[0], ks[-1]

    def said(words: str, measure: str, pair: tuple[float, float], **more: Any) -> Statement:  # noqa: ANN401 - of `Statement`
        low, high = pair
        return of(f"{words} in flight, K = {high:g} against {low:g}", measure, {"k": high}, {"k": low}, **more)

    pairs = dict.fromkeys((*pairwise(ks), ends))
    longer = "12 % more" if ends in _PRINTED else ""
    return [
        *(said("less risk", "risk", pair, printed=_PRINTED.get(pair, "")) for pair in pairs),
        said("lower peaks", "max_risk", ends),
        said("farther", "length", ends, less=False, size="{} % more", printed=longer),
    ]


@claim(
    28,
    "Section 5.1",
    "The greater K is, the less risky is the way, and the longer; K = 10 passes risky regions, which K = 200 avoids.",
    "All kinds of maps and detection radii, CGLA flown on each with K = 10, 50 and 200; varied: integral, replanning "
    "and start. With all known it is a theorem, which is asserted on a map of each kind and more.",
    merged=(29, 30),
    experiments=("single-uav",),
    figures=("Fig. 5", "Table 1"),
    settings=OVER_K,
)
def _check_c28(evidence: Evidence) -> Finding:
    maps, weights = evidence.maps(evidence.instances(10, 1)), sorted({*WEIGHTS, *evidence.panel.levels("k")})
    optima = np.array([optima_over_k(one.problem(weights[0]), weights) for one in maps])
    risk, length, cost = np.moveaxis(optima, 2, 0)
    require_exchange(risk, length, cost, weights)
    found = [judged(evidence.samples["single-uav"], one) for one in statements(evidence.panel)]
    low, high = flown_alone(counterexamples.mission(_RISES))
    require(high > low, f"{_RISES} no longer shows a flight with more risk for K = 200 than for K = 10")
    theorem = f"asserted on {len(maps)} maps x {len(weights)} K without exception"
    why = f"on the stored map K = 200 meets {high / low:.3g} times the risk of K = 10"
    region, unknown = "K = 10 passes (0.5, 0.5) and (0.8, 0.8)", "the paper's map is not printed"
    rows = (
        Row("never more risk, never shorter, with all known", Answer.HOLDS, Basis.PROOF, why=theorem),
        *(one.row for one in found),
        Row("less risk in flight on every map", Answer.FAILS, Basis.COUNTEREXAMPLE, why=why),
        Row(region, Answer.NOT_TESTABLE, Basis.TEXT, why=unknown),
    )
    notes = (EXCHANGE, "A flight's plans are optimal for what is known, not for the map: this does not carry over.")
    table = panel_table("CGLA's flights under two K (ratios, the greater K over the smaller)", found)
    return Finding(rows, notes, (table,), (_RISES,))


def optima_over_k(problem: Problem, weights: Sequence[float] = WEIGHTS) -> FloatArray:
    """Solve a problem exactly under each of some K: risk, length and cost of the optima, shape ``(K, 3)``."""
    reweighed = Reweighed(problem, "cgla", resolution=paper_lattice())
    found = [reweighed.at(k) for k in weights]
    return np.array([(one.risk, one.length, one.cost) for one in found])


def require_exchange(
    risk: FloatArray, length: FloatArray, cost: FloatArray, weights: Sequence[float] = WEIGHTS
) -> None:
    """Assert the theorem of optima, each of shape ``(maps, K)``, as a check of the program."""
    slopes = np.diff(cost, axis=1) / np.diff(weights)
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
    """Fly all variants of a mission of one UAV, assert that they arrive, and return the risk of each."""
    flights = [mission.fly().uavs["a"] for mission in file.missions(get).values()]
    for flight in flights:
        require(flight.status is MissionStatus.ARRIVED, f"{file.name}: {flight.status.value}")
    return [flight.risk for flight in flights]
