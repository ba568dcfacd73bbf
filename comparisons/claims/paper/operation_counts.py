"""Operations of CGLA on a lattice of N x N points, counted instead of timed: integrals, samples, uses of Eq. 9."""

import math
from dataclasses import dataclass

import numpy as np

from cgla_graph._types import FloatArray, IntArray
from cgla_graph.comparisons.claims.paper.flights import GOAL, START, fly_alone, paper_lattice
from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, linked
from cgla_graph.mission.records import MissionStatus
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.risk import RiskField

#: A step is so many lattice units (E16).
UNITS_A_STEP = 0.4


def pair_count(nodes: int) -> int:
    """
    Return how many pairs so many nodes make.

    Examples
    --------
    >>> pair_count(20**2)
    79800
    """
    return nodes * (nodes - 1) // 2


def displacements(n: int) -> tuple[IntArray, IntArray, IntArray]:
    """
    List by how many columns and rows the points of a pair can differ, and how many pairs do.

    Those that go up and down by as much count together.

    Examples
    --------
    >>> [part.tolist() for part in displacements(2)]
    [[1, 0, 1], [0, 1, 1], [2, 2, 2]]
    """
    up, across = (part.ravel()[1:] for part in np.indices((n, n)))
    pairs: IntArray = (n - across) * (n - up) * np.where((across > 0) & (up > 0), 2, 1)
    return across, up, pairs


def integral_count(n: int) -> int:
    """
    Return how many pairs join no third lattice point; the weights of all others are sums of theirs.

    Examples
    --------
    >>> integral_count(3), pair_count(9)
    (28, 36)
    """
    across, up, pairs = displacements(n)
    return int(pairs[np.gcd(across, up) == 1].sum())


def sample_count(n: int) -> int:
    """
    Return how many samples all weights take with one for each column, or row, that a segment crosses.

    Examples
    --------
    >>> sample_count(2), sample_count(3)
    (6, 52)
    """
    across, up, pairs = displacements(n)
    return int((pairs * np.maximum(across, up)).sum())


def relaxation_count(nodes: int, rounds: int) -> int:
    """
    Return how often so many rounds of label setting use Eq. 9: once for each node that is not settled yet.

    Examples
    --------
    >>> relaxation_count(400, 400) == pair_count(400)
    True
    """
    return rounds * nodes - rounds * (rounds + 1) // 2


@dataclass(frozen=True)
class Counted:
    """
    Label setting, counted as it runs.

    Attributes
    ----------
    value
        G of the source.
    rounds
        Points that served as ``p_r`` before the source came into Delta_k.
    relaxations
        Uses of Eq. 9; each compares a value to the least one so far as well, so that nothing is sorted.
    """

    value: float
    rounds: int
    relaxations: int


def counted_label_setting(weights: FloatArray, target: int, source: int) -> Counted:
    """
    Run Eqs 9 to 12 one comparison after the other, on finite weights ``A``, shape ``(n, n)``.

    Examples
    --------
    >>> counted_label_setting(np.array([[0.0, 1, 9], [1, 0, 1], [9, 1, 0]]), target=2, source=0)
    Counted(value=2.0, rounds=2, relaxations=3)
    """
    values = [math.inf] * len(weights)
    values[target] = 0.0
    unsettled = dict.fromkeys(range(len(weights)))
    rounds = relaxations = 0
    least = target
    while values[least] < values[source]:
        del unsettled[least]
        rounds += 1
        serving, least = least, source
        for node in unsettled:
            values[node] = min(values[node], float(weights[node, serving]) + values[serving])
            relaxations += 1
            if values[node] < values[least]:
                least = node
    return Counted(values[source], rounds, relaxations)


def rounds_until(matrix: CostMatrix, source: int) -> int:
    """Return how many points serve before a source comes into Delta_k: those whose values are below its own."""
    return int((matrix.values < matrix.values[source]).sum())


@dataclass(frozen=True)
class FlightCounts:
    """
    What a flight takes, planned from scratch on each tick, and only when something new is seen.

    Attributes
    ----------
    moves, plans
        Ticks, and those with something new (the first is the plan of take-off).
    rounds
        Mean over the ticks, until ``p_s`` is in Delta_k.
    every_move, on_change
        Pairs weighed and uses of Eq. 9, together.
    """

    moves: int
    plans: int
    rounds: float
    every_move: int
    on_change: int


def count_flight(field: RiskField, *, k: float, n: int) -> FlightCounts | None:
    """
    Fly the paper's flight on a lattice of n x n points, steps of 0.4 of its units, and count what its plans take.

    None if the flight did not arrive.

    Examples
    --------
    >>> counts = count_flight(RiskField([]), k=10.0, n=8)
    >>> counts.moves, counts.plans
    (23, 1)
    """
    flown = fly_alone(field, k=k, n=n, step=UNITS_A_STEP / n)
    if flown.status is not MissionStatus.ARRIVED:
        return None
    lattice, rounds, operations = paper_lattice(n), [], {}
    known: object = None
    for tick in range(flown.departed, flown.ended):
        knowledge = flown.knowledge_at(tick)
        if knowledge is not known:
            known = knowledge
            graph = GeometricGraph.complete(lattice, RiskField(list(knowledge.threats.values())), k, extra=(GOAL,))
            matrix = lazy_cost_matrix(graph, graph.node_at(GOAL))
        position = flown.position_at(tick)
        joined, node = linked(matrix, START if position is None else position)
        nodes = joined.graph.n_nodes
        rounds.append(rounds_until(joined, joined.graph.index_of(node)))
        operations[tick] = pair_count(nodes) + relaxation_count(nodes, rounds[-1])
    return FlightCounts(
        len(operations),
        len(flown.replans),
        float(np.mean(rounds)),
        sum(operations.values()),
        sum(operations.get(tick, 0) for tick in flown.replans),
    )
