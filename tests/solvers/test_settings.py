"""Settings out of range are refused by the names of the solver and the setting, for every solver."""

import math
import re
from typing import Any

import pytest

from cgla_graph.errors import SolverSettingError
from cgla_graph.solvers import registry

COUNTS = [0, -1, True, math.nan, math.inf, 1.5, "10", 10**18]
BUDGET = {"evaluations": COUNTS, "seconds": [0, 0.0, -1.0, True, math.nan, math.inf, -math.inf, "10", 1j]}
RRT_STAR = {**BUDGET, "iterations": COUNTS, "rewire_factor": ["nan", "x", None, [1], 1j], "seed": [0, 2**32, 10**30]}
FMT_STAR = {**BUDGET, "samples": [*COUNTS, None], "seed": [0]}
REACTIVE = ("a2d-style", "bcv-style", "bendy-ruler", "cpvs-style", "fbcri-style", "milp", "potential-field")
FUZZY = {"sight": [0.0], "tolerance": [-1.0, math.nan], "stall": [0, 2.5]}
LATTICE = {"resolution": [0, 1, "12", (3, 1)], "corner_rule": ["bogus"]}
#: Values that a solver refuses, by its name and the setting.
WRONG: dict[str, dict[str, list[Any]]] = {
    "a2d-style": {"threshold": [0.0, 1.5], "headings": [3, 16.0]},
    "bcv-style": {"risk_aversion": [-0.1, "5"]},
    "bendy-ruler": {
        "lookahead": [0],
        "margin_max": [-0.01],
        "continue_ratio": [0.9],
        "continue_angle": [0],
        "threshold": [math.nan],
    },
    "bfmt-star": FMT_STAR,
    "bit-star": {**RRT_STAR, "samples_per_batch": [0]},
    "cgla": {"schedule": ["bogus", None], "early_stop": ["false", 5, None], "time_limit": [0.0, "long"]},
    "cpvs-style": FUZZY,
    "eight-direction": LATTICE,
    "evolutionary": {
        **BUDGET,
        "population": [3],
        "control_points": [0],
        "segments": [1],
        "generations": [0],
        "seed": [-1],
        "scale": [0.0],
        "crossover": [0.0, 1.5],
        "turn_radius": [-1.0],
    },
    "fast-marching": {"cells": [7, 5000, 12.0], "order": [0, 3, "2"]},
    "fbcri-style": FUZZY,
    "fmt-star": FMT_STAR,
    "hybrid": {"points": [24, 1600.0], "radius": [0], "candidates": [0], "tolerance": [0.0, "tight"]},
    "informed-rrt-star": RRT_STAR,
    "lazy-theta-star": LATTICE,
    "milp": {"legs": [0], "execute": [0, 4], "places": [0], "nodes": [0], "gap": [0.0], "reach": [-1.0]},
    "ompl-prm-star": {"milestones": [1], "seconds": [0.0], "seed": [0]},
    "potential-field": {"risk_gain": [-1], "area_gain": [math.nan], "area_reach": [0]},
    "prm-star": {
        **BUDGET,
        "milestones": [1, *COUNTS],
        "seed": [-1, 2**32, True],
        "radius_factor": [0.0, math.nan, "wide"],
    },
    "q-learning": {
        "reward": ["risk", "goal_only"],
        "gamma": [1.01, -0.1, "high"],
        "alpha": [0.0, 1.5, math.nan],
        "epsilon": [1.5],
        "last_epsilon": [-1],
        "initial_value": [math.inf],
        "target_reward": [-1.0, math.inf],
        "tolerance": [-1e-9],
        "episodes": [0, 2.5],
        "max_steps": [0],
        "seed": [-1],
        **LATTICE,
    },
    "refine": {"max_points": [1, 2.0], "tolerance": [-1.0], "resolution": [1]},
    "rrt-star": RRT_STAR,
    "skimage-route": {"cells": [1, 5000, 2.5, "x"], "fully_connected": [1], "geometric": [None]},
    "sorrt-star": RRT_STAR,
    "visibility-graph": {"spreads": [0.0, math.nan], "corners": [2, 1e2]},
    "weighted-regions": {"points": [0, 65, 2.5]},
    "voronoi": {"joined": [0], "masses": [-1, 2.5], "spacing": [0.0, math.inf]},
}
STEPS = {"step": [0.0, -1.0, math.inf], "max_steps": [0], "patience": [0, 2.5]}
CASES = [
    (name, setting, value)
    for name in WRONG
    for setting, values in (WRONG[name] | (STEPS if name in REACTIVE else {})).items()
    for value in values
]


@pytest.mark.parametrize(("name", "setting", "value"), CASES, ids=str)
def test_settings_out_of_range_are_refused(name: str, setting: str, value: object) -> None:
    if (missing := registry.missing(name)) is not None:
        pytest.skip(missing)
    with pytest.raises(SolverSettingError) as caught:
        registry.get(name, **{setting: value})
    message = str(caught.value)
    written = {repr(value), f"{value:g}" if isinstance(value, int | float) else str(value)}
    assert re.match(rf"{name}: (unknown )?{setting}.* ({'|'.join(map(re.escape, written))})(?!\w)", message)
    assert re.search(r"; (give|choose|it must) .+", message), message
    assert "\n" not in message
