"""What is measured of several planners on the same random maps: alone, in company, among more threats, in training."""

from collections.abc import Sequence
from itertools import product
from typing import Any

import numpy as np

from cgla_graph.comparisons.claims.contrasts import CELLS, RADII, Case, Contrast, contrast
from cgla_graph.comparisons.claims.evidence import Samples
from cgla_graph.comparisons.claims.experiment import Experiment, Record
from cgla_graph.comparisons.claims.paper.flights import (
    ARRIVAL_RADIUS,
    BOUNDS,
    GOAL,
    RADIUS,
    STEP,
    fly_alone,
    measures,
    paper_lattice,
    risk_sum,
)
from cgla_graph.comparisons.claims.paper.printed_values import STARTS
from cgla_graph.mission.mission import Mission
from cgla_graph.mission.uav import Uav
from cgla_graph.mission.world import TimedThreat, World
from cgla_graph.model.problem import Problem
from cgla_graph.model.risk import RiskField, Threat
from cgla_graph.model.solution import Solution
from cgla_graph.scenarios.random_map import CLEAR, random_scenario
from cgla_graph.solvers import get, solve
from cgla_graph.solvers.base import Solver

#: The paper's K in its comparison of planners.
K = 10.0
#: What stands for the integral of planners that weigh no graph's edges: they have no raster reading.
OWN = "own"
#: Those of the paper's comparison and introduction that take well below a second, and reactive ones beside them.
PLANNERS = (
    "bcv-style",
    "a2d-style",
    "q-learning",
    "fbcri-style",
    "cpvs-style",
    "voronoi",
    "visibility-graph",
    "potential-field",
    "bendy-ruler",
)
#: Said to be quick where all is known; its flights take too long for every map.
EVOLUTION = "evolutionary"
#: Those of its introduction, slow ones among them, and how many threats they meet.
NAMED = ("cgla", "voronoi", "visibility-graph", "milp", EVOLUTION, "a2d-style")
THREATS = (2, 5, 10, 20)
#: What flies in company (Fig. 10, Tables 4 and 5).
COMPANY = ("cgla", "fbcri-style", "cpvs-style")
#: Shares of the learner's own number of episodes.
TRAINING = (0.01, 0.1, 1.0)
#: A sudden threat on the straight way, a detection radius ahead of the UAV when it has flown so many ticks.
SUDDEN_TICK, SUDDEN_SPREAD = 15, 0.055


def planners(seed: int) -> list[Record]:
    """Let every planner plan on a random map with all of it known, and fly it with limited sight."""
    problem = random_scenario(seed, k=K).problem
    records: list[Record] = [
        {"mode": "offline", "planner": name, **planned(problem, get(name))} for name in ("cgla", *PLANNERS, EVOLUTION)
    ]
    records += [
        {"mode": "online", "planner": "cgla", **cell, **measures(fly_alone(problem.field, k=K, **cell))}
        for cell in CELLS
    ]
    return [
        *records,
        *(
            {
                "mode": "online",
                "planner": name,
                "integral": OWN,
                "radius": radius,
                **measures(fly_alone(problem.field, k=K, solver=get(name), radius=radius)),
            }
            for name, radius in product(PLANNERS, RADII)
        ),
    ]


def versus_cgla(samples: Samples, planner: str, measure: str, what: str = "", *, ratio: bool = True) -> list[Contrast]:
    """
    Compare a planner's flights with CGLA's in all cells: the planner's value is claimed to be greater.

    Parameters
    ----------
    samples
        Of the experiment `planners`.
    planner, measure
        Names.
    what
        In words; the names if empty.
    ratio
        Compare ratios, else differences.

    Returns
    -------
    contrasts
        One a cell, over the maps on which both arrive, not adjusted yet.
    """
    words = what or f"{measure}: {planner} > cgla"
    return [
        contrast(samples, words, measure, *_sides(planner, cell), {"mode": "online"}, ratio=ratio, name=cell)
        for cell in CELLS
    ]


def _sides(planner: str, cell: Case) -> tuple[Case, Case]:
    return {"planner": planner, "integral": OWN, "radius": cell["radius"]}, {"planner": "cgla", **cell}


def planned(problem: Problem, solver: Solver) -> dict[str, Any]:
    """Plan with all of the map known, and return what is measured of the path."""
    solution = solve(problem, solver, resolution=paper_lattice())
    took = {"seconds": solution.total_seconds, "evaluations": solution.evaluations}
    return {**_of_path(problem.field, solution), **took}


def _of_path(field: RiskField, solution: Solution) -> dict[str, Any]:
    found = solution.status.has_path
    names = ("length", "risk", "cost")
    return {
        "status": solution.status.label,
        "arrived": found,
        **{name: float(getattr(solution, name)) if found else None for name in names},
        "risk_sum": risk_sum(field, np.asarray(solution.path)) if found else None,
    }


def threat_count(seed: int) -> list[Record]:
    """Plan and fly with 2 to 20 threats, and with one that appears on the way; maps with more hold those with fewer."""
    records: list[Record] = []
    for count in THREATS:
        problem = random_scenario(seed, threats=count, k=K).problem
        best = solve(problem, "fast-marching").cost
        for name in NAMED:
            offline = planned(problem, get(name))
            excess = offline["cost"] / best - 1.0 if offline["arrived"] else None
            case = {"threats": count, "planner": name}
            records.append({**case, "mode": "offline", **offline, "excess": excess})
            flight = fly_alone(problem.field, k=K, solver=get(name))
            records.append({**case, "mode": "online", **measures(flight)})
    field = random_scenario(seed, threats=THREATS[1], k=K).problem.field
    return [*records, *({"planner": name, "mode": "sudden", **_surprised(field, name)} for name in ("cgla", "milp"))]


def _surprised(field: RiskField, name: str) -> dict[str, Any]:
    """Fly with a threat that appears ahead of the straight way, in sight."""
    ahead = 0.1 + (SUDDEN_TICK * STEP + 0.7 * RADIUS) / 2.0**0.5
    sudden = TimedThreat(Threat(ahead, ahead, spread=SUDDEN_SPREAD), appears=SUDDEN_TICK)
    return measures(fly_alone(field, k=K, solver=get(name), timed=[sudden]))


def three_uavs(seed: int) -> list[Record]:
    """Fly the three UAVs of Fig. 10 on a random map; what one sees, all know."""
    drawn = random_scenario(seed).problem.field
    # the paper's UAVs do not start within a threat
    clear = [threat for threat in drawn.threats if all(_apart(threat, start) for start in STARTS)]
    world = World(RiskField(clear), bounds=BOUNDS)
    records: list[Record] = []
    for name in COMPANY:
        cells: Sequence[Case] = CELLS if name == "cgla" else CELLS[: len(RADII)]
        for cell in cells:
            flight = Mission(world, _three(cell["radius"]), get(name), **_company(cell)).fly()
            shown = {**cell, "integral": cell["integral"] if name == "cgla" else OWN}
            records += [{"planner": name, **shown, "uav": uav, **measures(one)} for uav, one in flight.uavs.items()]
    return records


def _company(cell: Case) -> dict[str, Any]:
    return {
        "resolution": paper_lattice(),
        "integral": cell["integral"],
        "arrival_radius": ARRIVAL_RADIUS,
        "collisions": "record",
    }


def _three(radius: float) -> list[Uav]:
    return [
        Uav(f"{number + 1}", start=start, goal=GOAL, detection_radius=radius, step=STEP, k=K)
        for number, start in enumerate(STARTS)
    ]


def _apart(threat: Threat, start: Sequence[float]) -> bool:
    return float(np.hypot(threat.x - start[0], threat.y - start[1])) >= CLEAR


def directions(seed: int) -> list[Record]:
    """Plan with all of the map known: eight directions or any, minding risk or not, exactly or by tabular learning."""
    problem = random_scenario(seed, k=K).problem
    records: list[Record] = []
    for k in (K, 0.0):
        asked = Problem(problem.start, problem.goal, field=problem.field, k=k, bounds=problem.bounds)
        for directed, method, name in (
            ("any", "exact", "cgla"),
            ("eight", "exact", "eight-direction"),
            ("eight", "learned", "q-learning"),
        ):
            found = solve(asked, name, resolution=paper_lattice())
            records.append({"directions": directed, "k": k, "method": method, **_of_path(problem.field, found)})
    return records


def training(seed: int) -> list[Record]:
    """Train Q-Learning for longer and longer with all of the map known, and hold it against the exact optimum."""
    problem = random_scenario(seed, k=K).problem
    best = solve(problem, "eight-direction", resolution=paper_lattice()).cost
    whole = 20 * paper_lattice().n_points
    records: list[Record] = []
    for share in TRAINING:
        learned = planned(problem, get("q-learning", episodes=max(1, round(share * whole))))
        excess = learned["cost"] / best - 1.0 if learned["arrived"] else None
        records.append({"share": share, **learned, "excess": excess})
    return records


EXPERIMENTS = (
    Experiment("planners", "ten planners, all known and in six cells of limited sight", planners, quick=8),
    Experiment(
        "threat-count", "six planners with 2, 5, 10, 20 threats, and a sudden one", threat_count, quick=1, share=0.2
    ),
    Experiment("three-uavs", "three UAVs that tell each other what they see", three_uavs, quick=6),
    Experiment("directions", "directions x objective x training, all known", directions, quick=40),
    Experiment("training", "Q-Learning after more and more episodes, all known", training, quick=120),
)
