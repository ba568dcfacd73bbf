"""
Every planner over its own knob, flown on the same random maps: curves of risk against length, CGLA's over K beside.

One setting of a planner says little: who flies closer to threats flies shorter. So each planner is flown at several
values of what trades its length for its risk, and each of its points is held against CGLA's whole curve: against the
risk of CGLA at the same length. Between two values of K that curve is straight in the logarithms, which who draws one
of the two at random for each map attains on average.
"""

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cgla_graph._types import FloatArray
from cgla_graph.comparisons.claims.claim import Table
from cgla_graph.comparisons.claims.contrasts import LEAST, MAIN
from cgla_graph.comparisons.claims.evidence import Evidence, Samples
from cgla_graph.comparisons.claims.experiment import Record, experiment
from cgla_graph.comparisons.claims.inference import Proportion, proportion
from cgla_graph.comparisons.claims.paper.flights import K, fly_alone, measures, plan_measures
from cgla_graph.comparisons.claims.paper.printed_values import WORKING_SCALE
from cgla_graph.comparisons.statistics.intervals import Estimate
from cgla_graph.model.problem import Problem
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.random_map import random_scenario
from cgla_graph.scenarios.scenario import load_scenario
from cgla_graph.solvers import get

#: Of fewer maps than this the bootstrap knows no interval.
FEWEST = 20
RESAMPLES = 2000
ALPHA = 0.05


@dataclass(frozen=True)
class Setup:
    """
    A planner with settings.

    Attributes
    ----------
    planner
        Its name.
    settings
        Those that are not the defaults, by name.
    k
        The risk weight, which only some planners heed.

    Examples
    --------
    >>> Setup("bcv-style", (("risk_aversion", 0.0),)).label, Setup("cgla", k=50.0).label
    ('bcv-style, risk_aversion 0', 'cgla, K = 50')
    """

    planner: str
    settings: tuple[tuple[str, float | bool], ...] = ()
    k: float = K

    @property
    def solver(self) -> Solver:
        """The planner, ready."""
        return get(self.planner, **dict(self.settings))

    @property
    def label(self) -> str:
        """What it is called, without doubles."""
        words = [f"{name} {_written(value)}" for name, value in self.settings]
        if self.planner == "cgla" or self.k != K:
            words.append(f"K = {self.k:g}")
        return ", ".join([self.planner, *words])


@dataclass(frozen=True)
class Curve:
    """
    A planner over its knob.

    Attributes
    ----------
    title
        What is shown.
    points
        The planner at each value, with the value in words.
    default
        Which of these values is the planner's default, in words.
    """

    title: str
    points: Mapping[str, Setup]
    default: str = ""


def curve(
    planner: str, knob: str, values: Sequence[float], *, fixed: Mapping[str, float | bool] | None = None
) -> Curve:
    """
    Return a planner over a setting, or over the risk weight: ``k``.

    Examples
    --------
    >>> found = curve("a2d-style", "threshold", (0.1, 0.03))
    >>> found.title, list(found.points), found.default
    ('a2d-style over threshold', ['0.1', '0.03'], '0.1')
    """
    same = tuple((fixed or {}).items())
    points = {
        f"{value:g}": Setup(planner, same, value) if knob == "k" else Setup(planner, (*same, (knob, value)))
        for value in values
    }
    usual = Setup(planner)
    default = [word for word, one in points.items() if (one.solver, one.k) == (usual.solver, usual.k)]
    words = "".join(f", {name} {_written(value)}" for name, value in same)
    return Curve(f"{planner}{words} over {'K' if knob == 'k' else knob}", points, *default)


def _written(value: float | bool) -> str:
    return str(value) if isinstance(value, bool) else f"{value:g}"


CGLA = curve("cgla", "k", (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0, 100.0, 200.0))
#: With gamma below 1 and no reward at the target, Q-Learning would rather circle where it is safe than arrive (C25).
REWARD = 2.0
_TOLERANCES = (0.1, 0.02, 0.005, 0.001)
#: By planner. Those whose texts or programs are not public are in the style of the originals.
CURVES: Mapping[str, Sequence[Curve]] = {
    "bcv-style": [curve("bcv-style", "risk_aversion", (0.0, 1.0, 2.0, 5.0, 10.0, 20.0, 50.0))],
    "a2d-style": [curve("a2d-style", "threshold", (0.3, 0.1, 0.03, 0.01))],
    "q-learning": [
        curve("q-learning", "k", (1.0, 10.0, 50.0, 200.0), fixed={"gamma": 1.0}),
        curve("q-learning", "gamma", (1.0, 0.99, 0.95, 0.9), fixed={"target_reward": REWARD}),
    ],
    "fbcri-style": [curve("fbcri-style", "tolerance", _TOLERANCES)],
    "cpvs-style": [
        curve("cpvs-style", "tolerance", _TOLERANCES),
        curve("cpvs-style", "tolerance", _TOLERANCES, fixed={"onward": False}),
    ],
    "bendy-ruler": [curve("bendy-ruler", "threshold", (0.5, 0.2, 0.1, 0.05, 0.03, 0.01))],
    "potential-field": [curve("potential-field", "risk_gain", (0.05, 0.1, 0.2, 0.4, 0.8))],
    "visibility-graph": [curve("visibility-graph", "spreads", (1.5, 2.0, 2.5, 3.0, 3.5))],
    "voronoi": [curve("voronoi", "k", (1.0, 10.0, 50.0, 200.0))],
}
#: What stands in tables of lengths and risks as they are, by whose it is: those of the paper's Table 1 first.
SHOWN: Sequence[Setup] = (
    *(Setup("cgla", k=k) for k in (10.0, 50.0, 200.0)),
    Setup("bcv-style", (("risk_aversion", 0.0),)),
    Setup("bcv-style", (("risk_aversion", 5.0),)),
    Setup("a2d-style", (("threshold", 0.1),)),
    Setup("q-learning", (("gamma", 1.0),)),
    Setup("q-learning", (("target_reward", REWARD), ("gamma", 0.95))),
    Setup("fbcri-style", (("tolerance", 0.02),)),
    Setup("cpvs-style", (("tolerance", 0.02),)),
    Setup("voronoi"),
    Setup("visibility-graph", (("spreads", 2.5),)),
    Setup("milp"),
    Setup("evolutionary"),
    Setup("potential-field", (("risk_gain", 0.2),)),
    Setup("bendy-ruler", (("threshold", 0.2),)),
    *(Setup(name) for name in ("eight-direction", "lazy-theta-star", "fast-marching", "refine")),
)


#: Those that Table 1 speaks of.
TABLE_1_SETUPS = SHOWN[:8]


def all_setups() -> dict[Setup, None]:
    """Return every setup of curves and tables once, as the keys of a dictionary."""
    of_curves = [one for curves in ([CGLA], *CURVES.values()) for each in curves for one in each.points.values()]
    return dict.fromkeys([*of_curves, *SHOWN])


@experiment("sweeps", quick=2, share=0.4)
def sweeps(seed: int) -> list[Record]:
    """Fly every planner at every value of its knob on a random map; plan what tables show with all of it known."""
    problem = random_scenario(seed, k=K).problem
    return [{"mode": "online", **flown(problem, one)} for one in all_setups()] + [
        {"mode": "offline", **planned(problem, one)} for one in SHOWN
    ]


def flown(problem: Problem, setup: Setup) -> Record:
    """Fly a planner with limited sight, in the main cell, and measure."""
    began = time.perf_counter()
    flight = fly_alone(problem.field, k=setup.k, solver=setup.solver, **MAIN)
    return {"setup": setup.label, **measures(flight), "seconds": time.perf_counter() - began}


def planned(problem: Problem, setup: Setup) -> Record:
    """Plan with all of the map known, and measure."""
    return {"setup": setup.label, **plan_measures(replace(problem, k=setup.k), setup.solver)}


def on_paper_map(setups: Sequence[Setup]) -> Table:
    """Fly and plan on the reconstructed map of Fig. 5, and tabulate lengths and risks as they are."""
    problem = load_scenario("paper").problem
    rows = []
    for one in setups:
        online, offline = flown(problem, one), planned(problem, one)
        found = [_size(online, "length"), _size(online, "length", WORKING_SCALE), online["risk_sum"]]
        found += [online["exposure"], online["status"]]
        rows.append(
            [
                f"ours: {one.label}, on our map paper",
                *found,
                _size(offline, "length", WORKING_SCALE),
                offline["risk_sum"],
            ]
        )
    heads = ("whose", "length", f"length x {WORKING_SCALE:g}", "risk sum", "exposure", "ends as")
    return Table(
        "Ours, on our map paper, flown with limited sight, and planned with the whole map known",
        (*heads, f"offline: length x {WORKING_SCALE:g}", "offline: risk sum"),
        rows,
    )


def _size(record: Record, name: str, scale: float = 1.0) -> float | None:
    return None if record[name] is None else float(record[name]) * scale


@dataclass(frozen=True)
class Point:
    """
    A planner at one value of its knob, held against CGLA.

    Attributes
    ----------
    value
        Of the knob, in words.
    arrives
        How often it arrives.
    maps
        On how many maps both it and CGLA with K = 10 arrive: what follows is of these.
    length, risk
        Over those of CGLA with K = 10: ratios of geometric means, with intervals.
    exposure
        The length with F above 0.1, less CGLA's with K = 10: mean, map units.
    gap
        Its risk over that of CGLA's curve at the same length, on the same maps.
    side
        1 where that is shown to be above 1, -1 below, 0 neither (with Bonferroni's adjustment below).
    """

    value: str
    arrives: Proportion
    maps: int
    length: Estimate
    risk: Estimate
    exposure: Estimate
    gap: Estimate
    side: int


@dataclass(frozen=True)
class Sweep:
    """
    What the experiment `sweeps` says of curves.

    Attributes
    ----------
    evidence
        With its samples.
    """

    evidence: Evidence

    @cached_property
    def samples(self) -> Samples:
        """The samples of the experiment."""
        return self.evidence.samples["sweeps"]

    @cached_property
    def _weights(self) -> FloatArray:
        """How often each map is drawn in each resample, shape ``(resamples + 1, maps)``; in the first, once."""
        n = len(self.samples.maps)
        drawn = self.evidence.rng("sweeps").multinomial(n, np.full(n, 1.0 / n), RESAMPLES) if n else np.empty((0, 0))
        return np.vstack([np.ones((1, n)), drawn])

    def column(self, name: str, setup: Setup, *, mode: str = "online") -> FloatArray:
        """Return one measurement of flights, or of plans."""
        return self.samples.column(name, mode=mode, setup=setup.label)

    def _logs(self, name: str, setup: Setup) -> FloatArray:
        return np.log(np.maximum(self.column(name, setup), LEAST))

    @cached_property
    def _cgla(self) -> FloatArray:
        """The logarithms of CGLA's length and risk, by K, shape ``(2, K, maps)``; NaN where it does not arrive."""
        points = CGLA.points.values()
        return np.array([[self._logs(name, one) for one in points] for name in ("length", "risk_sum")])

    def points(self, each: Curve) -> list[Point]:
        """Hold every point of a curve against CGLA."""
        return [self._point(value, setup, len(each.points)) for value, setup in each.points.items()]

    def _point(self, value: str, setup: Setup, among: int) -> Point:
        own = np.array([self._logs(name, setup) for name in ("length", "risk_sum")])
        more = self.column("exposure", setup) - self.column("exposure", CGLA.points["10"])
        kept = np.isfinite(own).all(axis=0) & np.isfinite(self._cgla).all(axis=(0, 1))
        weights = self._weights[:, kept]
        arrives = proportion(self.column("arrived", setup))
        if not kept.any():
            nothing = Estimate(np.nan, -np.inf, np.inf)
            return Point(value, arrives, 0, nothing, nothing, nothing, nothing, 0)
        # a resample may draw none of these maps
        weights = weights[weights.sum(axis=1) > 0.0]
        weights = weights / weights.sum(axis=1, keepdims=True)
        length, risk = weights @ own[0, kept], weights @ own[1, kept]
        lengths, risks = (weights @ of[:, kept].T for of in self._cgla)
        ten = list(CGLA.points).index("10")
        gap = risk - curve_at(length, lengths, risks)
        n = int(kept.sum())
        ratios = [_estimate(one, n, ratio=True) for one in (length - lengths[:, ten], risk - risks[:, ten], gap)]
        above, below = np.quantile(gap[1:], [ALPHA / 2.0, 1.0 - ALPHA / (2.0 * among)]) if n >= FEWEST else (0.0, 0.0)
        side = 1 if above > 0.0 else -1 if below < 0.0 else 0
        return Point(value, arrives, n, ratios[0], ratios[1], _estimate(weights @ more[kept], n), ratios[2], side)


def curve_at(length: FloatArray, lengths: FloatArray, risks: FloatArray) -> FloatArray:
    """
    Return the least risk that CGLA has at no more than some lengths.

    Parameters
    ----------
    length
        The lengths, shape ``(m,)``.
    lengths, risks
        CGLA's points, shape ``(m, K)``; left of the shortest one, which no planner can be, its risk counts.

    Examples
    --------
    >>> points = np.array([[1.0, 2.0, 3.0]]), np.array([[9.0, 5.0, 6.0]])
    >>> [float(curve_at(np.array([at]), *points)[0]) for at in (0.5, 1.5, 2.5)]
    [9.0, 7.0, 5.0]
    """
    order = np.argsort(lengths, axis=1, kind="stable")
    x = np.take_along_axis(lengths, order, axis=1)
    y = np.minimum.accumulate(np.take_along_axis(risks, order, axis=1), axis=1)
    return np.array([np.interp(at, *one) for at, one in zip(length, zip(x, y, strict=True), strict=True)])


def _estimate(drawn: FloatArray, n: int, *, ratio: bool = False) -> Estimate:
    """Return the first value, with the 95 % interval of the others (percentiles); of few maps there is none."""
    ends = np.quantile(drawn[1:], [ALPHA / 2.0, 1.0 - ALPHA / 2.0]) if n >= FEWEST else np.array([-np.inf, np.inf])
    found = np.array([drawn[0], *ends])
    return Estimate(*(np.exp(found) if ratio else found).tolist())


def is_dominated(points: Sequence[Point]) -> bool:
    """Tell whether all of a curve, as far as there are maps enough to see it, is shown to lie above CGLA's."""
    known = [one for one in points if one.maps >= FEWEST]
    return bool(known) and all(one.side == 1 for one in known)


def said(points: Sequence[Point]) -> str:
    """
    Say where a curve lies.

    Examples
    --------
    >>> said([])
    'too few maps to say'
    """
    known = [one for one in points if one.maps >= FEWEST]
    if not known:
        return "too few maps to say"
    above, below = ([one.value for one in known if one.side == side] for side in (1, -1))
    rest = [one.value for one in known if one.side == 0]
    unseen = [one.value for one in points if one.maps < FEWEST]
    if is_dominated(points):
        words = "wholly above CGLA's curve: dominated"
    else:
        parts = {"above": above, "not told apart from it": rest, "below": below}
        words = "; ".join(f"{name} at {', '.join(values)}" for name, values in parts.items() if values)
    return f"{words} (too few arrivals at {', '.join(unseen)})" if unseen else words
