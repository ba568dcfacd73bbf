"""Planners that the introduction speaks of (Section 1): graphs on simple, complex and partial maps, MILP, evolution."""

from itertools import product

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.panel.flights import STEP, Flights, Setup, paper_lattice, positions_at_steps, setup
from cgla_graph.comparisons.claims.panel.settings import BOUNDS, SPREADS, START, PanelMap
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.solvers import get, solve

#: So many threats make a simple map.
SIMPLE = 2
#: Planners with a constant of ours: Voronoi graphs with and without the elastic chain that draws their ways straight,
#: and visibility graphs of polygons so many spreads around threats.
GRAPHS: dict[tuple[str, str], Setup] = {
    ("voronoi", "with chain"): setup("voronoi"),
    ("voronoi", "without chain"): setup("voronoi", masses=0),
    **{
        ("visibility-graph", f"{spreads:g} spreads"): setup("visibility-graph", spreads=spreads)
        for spreads in (2.0, 2.5, 3.0)
    },
}
#: When a threat comes up on the way, steps.
SUDDEN = 15
#: A short time to plan, seconds.
SHORT = 5.0


@experiment("introduction", share=0.4)
def introduction(map_: PanelMap) -> list[Record]:
    """Plan with all known and fly with limited sight; with few threats also let one come up on the way."""
    records = [{**one, "simple": False} for one in (*_planned(map_, map_.field), *_flown(map_), *_evolved(map_))]
    if map_.kind.threats == min(map_.panel.levels("threats")):
        few = map_.drawn(threats=SIMPLE)
        simple = [*_planned(map_, few), *_surprised(map_, few)]
        records += [{**record, "threats": SIMPLE, "simple": True} for record in simple]
    return [{**map_.levels, **record} for record in records]


def problem_of(map_: PanelMap, threats: RiskField, k: float, start: FloatArray | None = None) -> Problem:
    """Return the problem of some threats, from the map's start or from elsewhere on the way to its goal."""
    x, y = START if start is None else start.tolist()
    return Problem((x, y), map_.goal, threats, k=k, bounds=BOUNDS)


def _planned(map_: PanelMap, threats: RiskField) -> list[Record]:
    """Plan on graphs with all known; ``ratio`` is the cost over that of fast marching over the plane."""
    records: list[Record] = []
    for k in map_.panel.levels("k"):
        problem = problem_of(map_, threats, k)
        best = solve(problem, "fast-marching").cost
        for (planner, constant), (name, settings) in GRAPHS.items():
            found = solve(problem, get(name, **dict(settings)))
            ratio = found.cost / best if found.status.has_path else None
            records.append({"mode": "known", "planner": planner, "constant": constant, "k": k, "ratio": ratio})
    return records


def _flown(map_: PanelMap) -> list[Record]:
    """Fly on the first plan, and planning again; ``ratio`` is the cost over that of the plan with all known."""
    flights = Flights(map_)
    records: list[Record] = []
    for ((planner, constant), of), k in product(GRAPHS.items(), map_.panel.levels("k")):
        known = flights.planned(of, k)["cost"]
        for radius, replan in product(map_.panel.levels("radius"), ("never", "change")):
            # visibility graphs have the same ways for all K
            heeds_k = planner == "voronoi"
            cost = flights.flown(of, k=k, radius=radius, heeds_k=heeds_k, replan=replan)["cost"]
            ratio = cost / known if cost is not None and known is not None else None
            case = {"planner": planner, "constant": constant, "k": k, "radius": radius, "replan": replan}
            records.append({"mode": "flown", **case, "ratio": ratio})
    return records


def _evolved(map_: PanelMap) -> list[Record]:
    """Tell whether evolution finds a path in a short time, by the clock of the machine."""
    records: list[Record] = []
    for k in map_.panel.levels("k"):
        found = solve(map_.problem(k), "evolutionary")
        quick = found.status.has_path and found.total_seconds <= SHORT
        records.append({"mode": "known", "planner": "evolutionary", "k": k, "quick": quick})
    return records


def _surprised(map_: PanelMap, threats: RiskField) -> list[Record]:
    """
    Let a threat come up a detection radius ahead on the way of MILP, all else known.

    Its spread is the middle one of the map's. ``cost`` is that of the way to where the UAV is then, and from there on:
    on the old plan, or on a new one.
    """
    records: list[Record] = []
    spread = sum(SPREADS[map_.kind.spread]) / 2.0
    for k in map_.panel.levels("k"):
        calm = problem_of(map_, threats, k)
        plans = {name: solve(calm, name, resolution=paper_lattice()) for name in ("milp", "cgla")}
        if not all(plan.status.has_path for plan in plans.values()):
            # MILP gives up on weights of very different sizes: nothing is known
            cases = product(plans, map_.panel.levels("radius"), ("never", "change"))
            names = ("planner", "radius", "replan")
            records += [
                {"mode": "sudden", "k": k, **dict(zip(names, case, strict=True)), "cost": None} for case in cases
            ]
            continue
        ways = {name: positions_at_steps(np.asarray(plan.path)) for name, plan in plans.items()}
        for radius in map_.panel.levels("radius"):
            ahead = ways["milp"][min(SUDDEN + steps_of(radius), len(ways["milp"]) - 1)]
            x, y = ahead.tolist()
            field = RiskField([*threats.threats, Threat(x, y, spread)])
            for name, way in ways.items():
                changed = problem_of(map_, field, k, way[SUDDEN])
                before = calm.evaluate(way[: SUDDEN + 1]).cost
                new = solve(changed, name, resolution=paper_lattice()).cost
                case = {"mode": "sudden", "planner": name, "k": k, "radius": radius}
                records.append({**case, "replan": "never", "cost": before + changed.evaluate(way[SUDDEN:]).cost})
                records.append({**case, "replan": "change", "cost": before + new})
    return records


def steps_of(length: float) -> int:
    """
    Return how many steps a length has.

    Examples
    --------
    >>> steps_of(0.2)
    10
    """
    return round(length / STEP)
