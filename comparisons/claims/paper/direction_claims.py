"""
What makes A2D and Q-Learning risky (C34): eight directions, the objective, training, the discount, or a threshold.

What flies here are planners in the style of the originals, whose texts or programs are not public: a verdict is one on
these planners, not on the originals.
"""

import math
from collections.abc import Mapping, Sequence

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims import counterexamples
from cgla_graph.comparisons.claims.claim import Entry, Finding, Kind, Part, Table, Verdict, claim, require
from cgla_graph.comparisons.claims.contrasts import (
    CELLS,
    LEAST,
    RADII,
    RULE,
    Case,
    Contrast,
    contrast,
    contrast_part,
    contrast_table,
    finite,
    opposes,
    shown,
    together,
)
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import median, paired_shift, proportion
from cgla_graph.comparisons.claims.paper.flights import (
    BOUNDS,
    GOAL,
    START,
    K,
    N,
    fly_alone,
    measures,
    paper_lattice,
    path_measures,
)
from cgla_graph.comparisons.claims.paper.learners import LEARNERS, UNDISCOUNTED, by_level, learner
from cgla_graph.comparisons.claims.paper.printed_values import value
from cgla_graph.comparisons.statistics.hodges_lehmann import hodges_lehmann
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.solvers import get, solve
from cgla_graph.solvers.grid.value_iteration import decision_process, greedy, value_iteration

#: Risks that A2D-style tolerates before it turns aside, the default first.
THRESHOLDS = (0.1, 0.03, 0.01)
#: Planners by name, with what their levels are.
A2D: Mapping[str, float] = {f"A2D-style, threshold {threshold:g}": threshold for threshold in THRESHOLDS}
BCV: Mapping[str, float] = {f"BCV-style, risk aversion {aversion:g}": aversion for aversion in (0.0, 5.0)}
FBCRI, CGLA = "FBCRI-style", "CGLA"
#: The planners that Q-Learning is said to be riskier than.
OTHERS = (*BCV, *A2D, FBCRI, CGLA)
#: A stored map on which the best way in eight directions has more than so many times the risk of that in any.
RISKY, RISKIER = "eight-directions-risky.toml", 10.0
#: The learner to which risk matters least.
BLIND = list(LEARNERS)[-1]
#: A reward for which the fewest moves are best on every map, with a discount of 0.95 or 0.99.
ENORMOUS = 1e6


def _rivals() -> dict[str, Solver]:
    """Return those that fly against CGLA, by name."""
    return {
        **{name: learner(name) for name in LEARNERS},
        **{name: get("bcv-style", risk_aversion=aversion) for name, aversion in BCV.items()},
        **{name: get("a2d-style", threshold=threshold) for name, threshold in A2D.items()},
        FBCRI: get("fbcri-style"),
    }


@experiment("q-learning-gamma", quick=12)
def q_learning_gamma(seed: int) -> list[Record]:
    """Fly Q-Learning with several discounts and rewards, and those it is compared with, with limited sight."""
    field = random_scenario(seed, k=K).problem.field
    records: list[Record] = [
        {"planner": CGLA, **cell, **measures(fly_alone(field, k=K, solver="cgla", **cell))} for cell in CELLS
    ]
    for name, solver in _rivals().items():
        for radius in RADII:
            flight = fly_alone(field, k=K, solver=solver, radius=radius)
            records.append({"planner": name, "radius": radius, **measures(flight)})
    return records


@experiment("directions", quick=40)
def directions(seed: int) -> list[Record]:
    """Plan with all of the map known: eight directions or any, minding risk or not, exactly or by tabular learning."""
    problem = random_scenario(seed, k=K).problem
    arms: list[tuple[str, float, str, Solver]] = [
        ("any", K, "exact", get("cgla")),
        ("eight", K, "exact", get("eight-direction")),
        ("eight", 0.0, "exact", get("eight-direction")),
        *(("eight", K, name, learner(name)) for name in LEARNERS),
    ]
    records: list[Record] = []
    for directed, k, method, solver in arms:
        asked = Problem(problem.start, problem.goal, field=problem.field, k=k, bounds=problem.bounds)
        found = solve(asked, solver, resolution=paper_lattice())
        records.append({"directions": directed, "k": k, "method": method, **path_measures(problem.field, found)})
    return records


def riskier(samples: Samples, first: str, second: str) -> list[Contrast]:
    """
    Compare the risk sums of two planners' flights: the first one's is claimed to be greater.

    Returns
    -------
    contrasts
        One a cell, over the maps on which both arrive: all cells if the second is CGLA, else the detection radii.
    """
    cells: list[Case] = list(CELLS) if second == CGLA else [{"radius": radius} for radius in RADII]
    return [
        contrast(
            samples,
            f"{first} > {second}",
            "risk_sum",
            {"planner": first, "radius": cell["radius"]},
            {"planner": second, **cell},
            {},
            name=cell,
        )
        for cell in cells
    ]


@claim(
    34,
    "Section 5.1",
    "A2D and Q-Learning pass regions of high risk; Q-Learning is much riskier than the others, as it has eight "
    "directions only.",
    "with limited sight, the risk sums of a2d-style and q-learning exceed CGLA's in twelve cells, and those of "
    "q-learning all others'; with all known, the effect of eight directions exceeds those of objective, training, "
    "discount and target reward",
    Kind.STATISTIC,
    experiments=("q-learning-gamma", "directions"),
    figures=("Fig. 5", "Table 1"),
)
def _check_c34(evidence: Evidence) -> Finding:
    samples, effects = evidence.samples["q-learning-gamma"], factorial(evidence.samples["directions"])
    against = {name: {other: riskier(samples, name, other) for other in OTHERS} for name in LEARNERS}
    a2d = {f"{threshold:g}": riskier(samples, name, CGLA) for name, threshold in A2D.items()}
    to_cgla = {name: tests[CGLA] for name, tests in against.items()}
    to_all = {name: together(against[name]) for name in LEARNERS}
    causes = {name: cause_contrasts(effects, name) for name in LEARNERS}
    printed = {name: value("Table 1", name).risk for name in ("BCV", "A2D", "Q-Learning", "CGLA, K = 10")}
    of_cgla, of_bcv, of_a2d = (printed["Q-Learning"] / printed[name] for name in ("CGLA, K = 10", "BCV", "A2D"))
    ratios = {
        name: ", ".join(f"{_ratio(tests[other]):.2g} of {other}'s" for other in OTHERS)
        for name, tests in against.items()
    }
    shares = {name: math.exp(hodges_lehmann(found.tolist()).median) for name, found in effects.items() if len(found)}
    words = ", ".join(f"{name} x {ratio:.3g}" for name, ratio in shares.items())
    return Finding(
        (
            *by_level(
                "A2D's risk > CGLA's",
                a2d,
                contrast_part,
                condition=lambda names: f"for a threshold of {' or '.join(names)}",
                printed=f"{printed['A2D'] / printed['CGLA, K = 10']:.3g}, quoted",
            ),
            *by_level("Q-Learning's risk > CGLA's", to_cgla, contrast_part, printed=f"{of_cgla:.3g}, quoted"),
            *by_level(
                "Q-Learning's risk > all others'",
                to_all,
                contrast_part,
                printed=f"{of_bcv:.3g} of BCV's, {of_a2d:.3g} of A2D's, quoted",
            ),
            *by_level("because of eight directions", causes, cause_part),
        ),
        f"With limited sight, OR = {RADII[1]:g}, Q-Learning's risk sum with gamma = 1 is {ratios[UNDISCOUNTED]}; with "
        f"{BLIND} it is {ratios[BLIND]}. What multiplies it with all known: {words}.",
        beside=(risky_in_eight_directions(), fewest_moves()),
        tables=(
            _flights_table(samples),
            contrast_table("A2D-style's risk sum over CGLA's, K = 10", together(a2d)),
            contrast_table(
                "Q-Learning's risk sum over others', K = 10",
                [one for tests in against.values() for one in together(tests)],
            ),
            _effects_table(effects),
            contrast_table(
                "The effect of eight directions against others (differences of logarithms)",
                together(causes),
            ),
        ),
        notes=(
            "Planners called -style are in the style of the originals, which are not public; verdicts are on these.",
            (
                "A2D-style's threshold, BCV-style's risk aversion (0 is the objective that the paper complains of), "
                "Q-Learning's discount and its reward at the target are not printed: they are levels. Q-Learning is "
                "riskier than all others if it is for all of their levels."
            ),
            (
                "gamma = 1 is the default of the toolkit, and just outside of the paper's 0 <= gamma < 1; it needs no "
                "reward at the target. With a discount and no reward, flights get stuck between lattice points (C25)."
            ),
            (
                "Planners other than CGLA weigh no segments by a raster, and fly the same way, or nearly, whether they "
                "plan on every tick or when something new is seen: they are flown in one of these cases."
            ),
            (
                "Directions: eight against any, both exact at K = 10. Objective: K = 0 against 10, both exact in eight "
                "directions. Training: learned with gamma = 1 against exact, both in eight directions at K = 10. "
                "Discount and reward: learned with them against learned with gamma = 1."
            ),
            (
                "The paper's risks of A2D and Q-Learning are quoted from other papers, with other maps and measures. A "
                "discount, and the very large weight of the target that Section 3.1 asks for, make Q-Learning fly "
                "nearly straight and mind no risk: that may be why its row of Table 1 is short and risky."
            ),
            (
                "That no way in eight directions need be longer than 1.0824 times the straight one (C26) does not "
                "bound its risk where there are threats: see the stored map."
            ),
        ),
        counterexample=RISKY,
    )


def _ratio(contrasts: Sequence[Contrast]) -> float:
    """Pick the ratio at the radius in the middle."""
    return next(one.shift.shift.median for one in contrasts if one.case["radius"] == RADII[1])


def factorial(samples: Samples) -> dict[str, FloatArray]:
    """Return the effects on the logarithm of the risk sum, on each map on which all paths were found."""
    arms: dict[str, Case] = {
        "any": {"directions": "any", "k": K, "method": "exact"},
        "eight": {"directions": "eight", "k": K, "method": "exact"},
        "blind": {"directions": "eight", "k": 0.0, "method": "exact"},
        **{name: {"directions": "eight", "k": K, "method": name} for name in LEARNERS},
    }
    logs = {name: np.log(np.maximum(samples.column("risk_sum", **case), LEAST)) for name, case in arms.items()}
    found = np.isfinite(np.column_stack(list(logs.values()))).all(axis=1)
    kept = {name: one[found] for name, one in logs.items()}
    return {
        "directions": kept["eight"] - kept["any"],
        "objective": kept["blind"] - kept["eight"],
        "training": kept[UNDISCOUNTED] - kept["eight"],
        **{name: kept[name] - kept[UNDISCOUNTED] for name in LEARNERS if name != UNDISCOUNTED},
    }


def cause_contrasts(effects: Mapping[str, FloatArray], name: str) -> list[Contrast]:
    """Compare the effect of directions with nothing, and with those of all else that a learner does otherwise."""
    directed = effects["directions"]
    others = {"none": np.zeros_like(directed), "objective": effects["objective"], "training": effects["training"]}
    if name != UNDISCOUNTED:
        others[name] = effects[name]
    return [
        Contrast(f"directions > {other}", {"learner": name}, paired_shift(directed, found))
        for other, found in others.items()
    ]


def cause_part(statement: str, contrasts: list[Contrast], *, printed: str = "") -> Part:
    """Say whether the effect of directions is the greatest; its size is that against none."""
    alone = next(one.shift.shift for one in contrasts if one.what.endswith("> none"))
    effect = f"x {math.exp(alone.median):.3g}, 95 % {math.exp(alone.low):.3g} to {math.exp(min(alone.high, 700.0)):.3g}"
    less = [one.what.partition(" > ")[2] for one in contrasts if opposes(one)]
    words = f"; less than the effect of {', '.join(dict.fromkeys(less))}" if less else ""
    # `by_level` says of which verdict the tests are
    return Part(statement, Verdict.UNDECIDED, f"shown {shown(contrasts)}{words}", effect=effect, printed=printed)


def risky_in_eight_directions() -> Part:
    """Plan again on the stored map, on the paper's lattice and on one from border to border."""
    scenario = counterexamples.scenario(RISKY)
    ratios, costs = [], []
    for lattice in (scenario.lattice, Lattice(N, bounds=BOUNDS)):
        eight, free = (solve(scenario.problem, name, resolution=lattice) for name in ("eight-direction", "cgla"))
        ratios.append(eight.risk / free.risk)
        costs.append(eight.cost / free.cost)
    require(min(ratios) > RISKIER, f"on {RISKY} eight directions have no longer more than ten times the risk: {ratios}")
    return Part(
        "the best way in eight directions cannot be much riskier",
        Verdict.REFUTED,
        f"{RISKY}: {min(ratios):.3g} to {max(ratios):.3g} times the risk of the complete graph (by lattice) at "
        f"{max(costs):.3g} times its cost; a bound on length, or cost, bounds no risk",
        effect=f"risk x {min(ratios):.3g}",
    )


def fewest_moves() -> Part:
    """Say, and see by exact value iteration on a map, what a reward large enough does with a discount."""
    scenario = counterexamples.scenario(RISKY)
    for gamma in (0.95, 0.99):
        on = scenario.problem.on_eight_connected(scenario.lattice)
        process = decision_process(on, target_reward=ENORMOUS)
        moves = len(greedy(process, value_iteration(process, gamma=gamma).moves).states) - 1
        fewest = round(max(abs(GOAL[axis] - START[axis]) for axis in (0, 1)) * N)
        require(moves == fewest, f"gamma = {gamma:g}: {moves} moves where {fewest} are the fewest")
    return Part(
        "a target reward that is large enough makes Q-Learning blind to risk",
        Verdict.PROVED,
        "a way of n moves is worth gamma^(n - 1) R - D_n: with R above D_n / (gamma^(n - 1) (1 - gamma)) no way of "
        "more moves is worth as much, and the fewest are best; from corner to corner they are the straight line",
        condition="if gamma < 1",
    )


def _flights_table(samples: Samples) -> Table:
    """Tell how each planner's flights went, at the radius in the middle, with plans on change."""
    rows: list[list[Entry]] = []
    for name in (*LEARNERS, *OTHERS):
        case = {"planner": name, "radius": RADII[1]}
        if name == CGLA:
            case |= {"integral": "exact", "replan": "change"}
        measured = [median(samples.column(measure, **case)) for measure in ("risk_sum", "length", "max_risk")]
        rows.append([name, *finite(proportion(samples.column("arrived", **case)).rate, *measured)])
    columns = ("planner", "arrives", "median risk sum", "median length", "median greatest F")
    return Table(f"Flights with limited sight, K = 10, OR = {RADII[1]:g}", columns, rows)


def _effects_table(effects: Mapping[str, FloatArray]) -> Table:
    rows = []
    for name, found in effects.items():
        shift = paired_shift(found, np.zeros_like(found))
        ratios = finite(*(float(np.exp(end)) if end < math.log(1e300) else math.inf for end in shift.shift))
        rows.append((name, shift.n, *ratios, shift.effect))
    columns = ("factor", "maps", "multiplies the risk sum by", "95 % from", "to", "effect")
    return Table("What makes a way in eight directions risky, all known", columns, rows, RULE)
