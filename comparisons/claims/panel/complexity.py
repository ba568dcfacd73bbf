"""
What plans and flights take, counted and not timed: weights, rounds, edges, turns, and plans past narrow passages.

Operations are weights computed (a line integral each) and uses of Eq. 9.
"""

import math
from collections.abc import Mapping, Sequence
from itertools import product
from typing import Any

import numpy as np
import shapely
from scipy import stats
from shapely.geometry.base import BaseGeometry

from cgla_graph._types import BoolArray, FloatArray
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import MAX_TICKS, STEP, N, fly, paper_lattice
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, START, Kind, Panel, PanelMap, across
from cgla_graph.cost_to_go.cost_matrix import CostMatrix
from cgla_graph.cost_to_go.repair import lazy_cost_matrix, linked, repair
from cgla_graph.mission.records import Knowledge, UavFlight
from cgla_graph.model.cost_model import CostModel
from cgla_graph.model.graph import GeometricGraph
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.restricted.restricted import restricted_optimum
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get, solve

#: A move is so many lattice units (E16).
UNITS_A_MOVE = 0.4
#: Points a side of plans: a factor, as what is far below N may depend on N.
SIZES = (10, 20, 25)
#: Points a side of flights, whose operations are fitted by a power of N.
FLIGHT_SIZES = (8, 12, 18)
#: Halfway between N^4 and N^5.
MIDDLE = 4.5
#: Points a side where a new threat comes up, the main one first.
NEW_THREAT_SIZES = (N, 10)
#: How far a threat counts as crossed, in spreads.
CROSSED = 4.0
#: By how much a weight changes at least to count as changed: any more than rounding, and what is worth a detour.
CHANGES: Mapping[str, float] = {"changed": 1e-12, "changed_much": 1e-3}
#: Corners below this angle, degrees, are straight on.
STRAIGHT = 1e-6
#: Widths of the one passage through a wall, map units, half a lattice unit of N = 20 and up.
PASSAGES = (0.025, 0.05, 0.1)
#: How thick the wall is, map units.
WALL = 0.02
#: Maps without a wall have so many areas, which are at least 0.075 apart.
AREAS = 5


def pair_count(nodes: int) -> int:
    """
    Return how many pairs so many nodes make.

    Examples
    --------
    >>> pair_count(20**2)
    79800
    """
    return nodes * (nodes - 1) // 2


def relaxation_count(nodes: int, rounds: int) -> int:
    """
    Return how often so many rounds of label setting use Eq. 9: once for each node that is not settled yet.

    Examples
    --------
    >>> relaxation_count(400, 400) == pair_count(400)
    True
    """
    return rounds * nodes - rounds * (rounds + 1) // 2


def rounds_until(matrix: CostMatrix, source: int) -> int:
    """Return how many points serve before a source comes into Delta_k: those whose values are below its own."""
    return int((matrix.values < matrix.values[source]).sum())


def turns(path: FloatArray) -> FloatArray:
    """
    Return by how much a path turns at its corners, degrees; where it goes straight on is no corner.

    Examples
    --------
    >>> turns(np.array([[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 1.0]])).round(9).tolist()
    [45.0]
    """
    headings = np.degrees(np.arctan2(*np.diff(path, axis=0).T[::-1]))
    angles: FloatArray = np.abs((np.diff(headings) + 180.0) % 360.0 - 180.0)
    return angles[angles > STRAIGHT]


def exponent(sizes: Sequence[float], counts: Sequence[float]) -> float:
    """
    Fit ``count = a * size ** exponent`` through logarithms.

    Examples
    --------
    >>> round(exponent([1, 2, 4, 8], [3, 12, 48, 192]), 9)
    2.0
    """
    return float(stats.linregress(np.log(sizes), np.log(counts)).slope)


@experiment("plans")
def plans(map_: PanelMap) -> list[Record]:
    """Plan with all known in eight directions and in any: rounds, edges of the path, its turns, and weights."""
    records: list[Record] = []
    for n in SIZES:
        for k in map_.panel.levels("k"):
            problem = map_.problem(k)
            case = {**map_.levels, "n": n, "k": k}
            eight = solve(problem, "eight-direction", resolution=paper_lattice(n))
            records += [
                {**case, "planner": "cgla", **_plan(problem, n)},
                {**case, "planner": "eight-direction", **_bends(eight.path)},
            ]
    return records


def _plan(problem: Problem, n: int) -> dict[str, Any]:
    """Plan over the complete graph; for N = 20, count the weights that are needed where bounds leave pairs out."""
    on = problem.on_lattice(paper_lattice(n))
    matrix = lazy_cost_matrix(on.graph, on.target)
    path = np.asarray(on.graph.positions)[[on.graph.index_of(node) for node in matrix.path_from(on.source)]]
    bends = _bends(path)
    found = {
        "rounds_over_n": rounds_until(matrix, on.graph.index_of(on.source)) / n,
        "edges_over_n": (bends["corners"] + 1) / n,
        "below": bends["corners"] + 1 < n,
        "below_half": bends["corners"] + 1 < n / 2,
        **bends,
    }
    restricted = restricted_optimum(on) if n == N else None
    if restricted is not None:
        found["weighed_share"] = restricted.counts["integrated"] / pair_count(on.graph.n_nodes)
    return found


def _bends(path: FloatArray) -> dict[str, Any]:
    # rounded, so that turns of 45 degrees are equal
    angles = turns(np.asarray(path)).round(6)
    return {"corners": len(angles), "sharpest": float(angles.max(initial=0.0)), "turning": float(angles.sum())}


def count_flight(flown: UavFlight, n: int) -> dict[str, int]:
    """
    Count the operations of a flight, planned from scratch on each move, and only when something new is seen.

    Returns
    -------
    counts
        The operations of all plans: ``every move`` and ``on change``, the first of which is that of take-off.
    """
    goal, operations = flown.uav.goal, {}
    known = flown.knowledge_at(flown.departed)
    graph = GeometricGraph.complete(paper_lattice(n), _field(known), flown.uav.k, extra=(goal,))
    matrix = lazy_cost_matrix(graph, graph.node_at(goal))
    for tick in range(flown.departed, flown.ended):
        knowledge = flown.knowledge_at(tick)
        if knowledge.threats != known.threats:
            known = knowledge
            matrix = repair(matrix, CostModel(_field(known), flown.uav.k))
        position = flown.position_at(tick)
        joined, node = linked(matrix, START if position is None else position)
        rounds = rounds_until(joined, joined.graph.index_of(node))
        operations[tick] = pair_count(joined.graph.n_nodes) + relaxation_count(joined.graph.n_nodes, rounds)
    return {
        "every move": sum(operations.values()),
        "on change": sum(operations.get(tick, 0) for tick in flown.replans),
    }


def _field(known: Knowledge) -> RiskField:
    return RiskField(list(known.threats.values()))


@experiment("flight-operations")
def flight_operations(map_: PanelMap) -> list[Record]:
    """
    Fly on lattices of several sizes, and fit a power of N to the operations of the flights.

    A map flies in few cells of radius and K, in which each level of each comes up: which ones, its seed says.
    """
    weights = map_.panel.levels("k")
    cells = [(*cell, "") for cell in across(map_.panel.levels("radius"), weights, shift=map_.seed)]
    cells += [(base["radius"], k, "step 0.02") for base in map_.bases for k in weights]
    return [
        {**map_.levels, "radius": radius, "k": k, "varied": varied, "planning": planning, **found}
        for radius, k, varied in cells
        for planning, found in _exponents(map_, radius, k, STEP if varied else None).items()
    ]


def _exponents(map_: PanelMap, radius: float, k: float, step: float | None) -> dict[str, dict[str, float | None]]:
    """Fit the operations of flights, with a step that is a part of the lattice unit if none is given."""
    counts: dict[str, list[int]] = {"every move": [], "on change": []}
    for n in FLIGHT_SIZES:
        move = UNITS_A_MOVE / n if step is None else step
        flight = fly({"a": START}, map_.field, map_.goal, n=n, step=move, max_ticks=MAX_TICKS, k=k, radius=radius)
        if flight.all_arrived:
            for name, count in count_flight(flight.uavs["a"], n).items():
                counts[name].append(count)
    found: dict[str, dict[str, float | None]] = {}
    for planning, of in counts.items():
        # where one of the flights does not arrive there is nothing to fit
        power = exponent(FLIGHT_SIZES, of) if len(of) == len(FLIGHT_SIZES) else None
        found[planning] = {"exponent": power, "off_middle": None if power is None else abs(power - MIDDLE)}
    return found


@experiment("new-threat")
def new_threat(map_: PanelMap) -> list[Record]:
    """Let the last threat of a map come up where the others are known, and count the weights that change."""
    return [record for n in NEW_THREAT_SIZES for record in _changes(map_, n)]


def _changes(map_: PanelMap, n: int) -> list[Record]:
    *known, seen = map_.field.threats
    lattice = paper_lattice(n)
    points = np.asarray(lattice.points)
    first, second = np.triu_indices(len(points), 1)
    before, after = (CostModel(of, 1.0).weights(points[first], points[second]) for of in (RiskField(known), map_.field))
    crossed = float(segments_within(lattice, seen, CROSSED * seen.spread).mean())
    case = {**map_.levels, "varied": "" if n == N else f"N {n}", "crossed": crossed}
    records: list[Record] = []
    for k in map_.panel.levels("k"):
        off = k * np.abs(after - before)
        records.append({**case, "k": k, **{name: float((off > least).mean()) for name, least in CHANGES.items()}})
    return records


def segments_within(lattice: Lattice, threat: Threat, radius: float) -> BoolArray:
    """
    Tell for each pair of lattice points, as ``numpy.triu_indices`` lists them, whether its segment is so near a threat.

    Examples
    --------
    >>> segments_within(Lattice(2, bounds=(0, 0, 1, 1)), Threat(0.5, 0.0, spread=0.1), 0.1).tolist()
    [True, False, False, False, False, False]
    """
    points = np.asarray(lattice.points) - (threat.x, threat.y)
    first, second = np.triu_indices(len(points), 1)
    start, along = points[first], points[second] - points[first]
    nearest = np.clip(-(start * along).sum(axis=1) / (along**2).sum(axis=1), 0.0, 1.0)
    within: BoolArray = np.hypot(*(start + nearest[:, None] * along).T) <= radius
    return within


def _each_goal(panel: Panel) -> Sequence[Kind]:
    """Return a kind of map for each goal: threats do not matter."""
    threats, spread, _ = panel.kinds[0]
    return [kind for kind in panel.kinds if kind[:2] == (threats, spread)]


@experiment("passages", kinds=_each_goal)
def passages(map_: PanelMap) -> list[Record]:
    """Plan around no-fly areas, and through the one passage of a wall, in eight directions and in any."""
    areas = random_scenario(map_.seed, threats=0, areas=AREAS, start=START, goal=map_.goal).problem.no_fly
    between = {"areas 0.075 apart": areas, **{f"passage {width:g}": wall(map_, width) for width in PASSAGES}}
    records: list[Record] = []
    for (name, no_fly), n in product(between.items(), SIZES):
        problem = Problem(START, map_.goal, bounds=BOUNDS, no_fly=no_fly)
        for varied, lattice, rule in (
            ("", paper_lattice(n), "touch"),
            ("corners both-free", paper_lattice(n), "both-free"),
            ("lattice closed", Lattice(n, bounds=BOUNDS), "touch"),
        ):
            case = {**map_.levels, "passage": name, "n": n, "varied": varied}
            for planner in (get("cgla"), get("eight-direction", corner_rule=rule)):
                found = solve(problem, planner, resolution=lattice).status.has_path
                records.append({**case, "planner": planner.traits.name, "found": found})
    return records


def wall(map_: PanelMap, width: float) -> BaseGeometry:
    """
    Draw a wall between start and goal, from border to border, with one passage.

    It crosses the straight line at 0.3 to 0.7 of its length, at 45 to 135 degrees, and the passage is in the middle 0.8
    of it.

    Parameters
    ----------
    map_
        Its seed and goal decide where.
    width
        Of the passage, map units.

    Examples
    --------
    >>> len(wall(PanelMap(1), 0.05).geoms)
    2
    """
    rng = np.random.default_rng([map_.seed, 1])
    start, way = np.array(START), np.subtract(map_.goal, START)
    middle = start + rng.uniform(0.3, 0.7) * way
    angle = math.atan2(way[1], way[0]) + math.radians(rng.uniform(45.0, 135.0))
    along = np.array([math.cos(angle), math.sin(angle)])
    inside = shapely.LineString([middle - 2.0 * along, middle + 2.0 * along]).intersection(shapely.box(*BOUNDS))
    opening = np.asarray(inside.interpolate(rng.uniform(0.1, 0.9), normalized=True).coords[0])
    halves = [
        shapely.LineString([opening + 0.5 * side * width * along, opening + 2.0 * side * along]) for side in (-1.0, 1.0)
    ]
    return shapely.MultiLineString(halves).buffer(0.5 * WALL, cap_style="flat").intersection(shapely.box(*BOUNDS))
