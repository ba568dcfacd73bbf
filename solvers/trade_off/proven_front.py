"""
The front of length against risk with a proof: under every risk weight, no path is much cheaper than the front.

The cost of the known paths, as a function of the weight, is the least of straight lines; the proven bound is a chord
(`weight_bounds`). Paths come first: a neighbour on the front is refined under the weight where the two cost the same.
Then the weights of the proofs are chosen from the left on, each as far from the last as the chord allows. Few of them
need a grid over the whole map: bounds of all paths through each place, under some weights, leave tubes under those
between (`place_bounds`).
"""

import dataclasses
import math
from dataclasses import dataclass, field
from itertools import pairwise
from typing import Any

import numpy as np
import shapely

from cgla_graph._progress import Tell
from cgla_graph._types import FloatArray
from cgla_graph.certificate.certificate import MOST_TIMES, Certificate, Tube, prove, usual_cells
from cgla_graph.certificate.costs import is_provable
from cgla_graph.certificate.subsolution import finer_grid, first_grid
from cgla_graph.eikonal import cell_runs
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.refine.refine import refine_path
from cgla_graph.regions.arrangement import has_cells
from cgla_graph.solvers.trade_off.front import chord_weight, gaps, lower_hull, worst_weight
from cgla_graph.solvers.trade_off.place_bounds import PlaceBounds
from cgla_graph.solvers.trade_off.reweighing import Reweighed
from cgla_graph.solvers.trade_off.weight_bounds import WeightBounds

#: Parts of the tolerance: for each proof, and for the paths between those that are known.
OF_PROOF, OF_PATHS = 0.5, 0.2
#: Weights at which a solver searches for paths of any class; the other paths are refined neighbours.
SEARCHED = 4
#: Proofs, at most, and weights among which the next one is chosen.
MOST_PROOFS, CHOICES = 60, 400
#: Stages of refined paths end when they gain less than this, relative to the cost (the loss is far less). Paths are of
#: different classes if they are farther apart than this part of the distance from start to goal.
ROUGH, APART = 1e-4, 0.1
#: Waypoints of a refined path, at most.
POINTS = 200
#: Bounds of places are solved for anew where those between others leave more than this part of the map.
WIDE = 0.3
#: The grid of a tube aims at this part of the tolerance of a proof. Gaps fall about by this power of the spacing. It is
#: at most so many times as fine as the first grid, or as a finer one.
AIMED_AT, ORDER, MOST_FINER = 0.85, 1.5, (6.0, 2.0)
#: Weights closer to 0 than this are alike.
TINY = 1e-3
#: Another proof has to gain this part of the tolerance.
WORTH = 0.1


@dataclass
class ProvenSearch:
    """
    The search for paths and proofs under all weights from 0 to `k_max`.

    Attributes
    ----------
    reweighed
        The solver that searches for paths.
    k_max
        The greatest weight.
    tolerance
        Wanted gap between paths and bound, as a ratio.
    most
        Paths on the hull, at most.
    known
        The paths, each with the weight it was found under.
    proofs
        Certificates by weight.
    places
        Bounds of all paths through each place; None before they are needed.
    """

    reweighed: Reweighed
    k_max: float
    tolerance: float
    most: int
    known: list[tuple[float, Solution]] = field(default_factory=list)
    proofs: dict[float, Certificate] = field(default_factory=dict)
    places: PlaceBounds | None = None

    def run(self, tell: Tell) -> None:
        """Search until the gap is within the tolerance, or further proofs gain too little."""
        self.search(0.0)
        self.prove(0.0)
        if not self.known:
            return
        self.search(self.k_max)
        self._find_paths(tell)
        while len(self.proofs) < MOST_PROOFS and (planned := self._plan()):
            for k in planned:
                self.bend(k)
                self.prove(k)
                gap = worst_weight(self.hull, self.bounds, self.k_max)[1]
                tell(f"gap {gap:.2%} after {len(self.proofs)} proofs, {self.tolerance:.2%} asked")

    def _plan(self) -> list[float]:
        """Choose weights whose proofs probably close all gaps, in the order of proofs: each leaves tubes to others."""
        weights, planned = {k: proof.lower_bound for k, proof in self.proofs.items()}, list[float]()
        while len(weights) < MOST_PROOFS:
            known = sorted(weights)
            k = self._next(WeightBounds(np.array(known), np.array([weights[one] for one in known])))
            if math.isnan(k):
                break
            planned.append(k)
            weights[k] = float(self.costs(np.array([k]))[0]) / (1.0 + OF_PROOF * self.tolerance)
        planned.sort()
        return _halving(planned[:-1], planned[-1:])

    def remark(self, gap: float) -> str:
        """Return why the gap of a front is above the tolerance; empty if it is not."""
        if not gap > self.tolerance:
            return ""
        k, known = worst_weight(self.hull, self.bounds, self.k_max)
        if known <= self.tolerance:
            return f"the paths of this solver cost more than others that are known, up to {gap:.2g} of the bound"
        nearest = min(self.proofs, key=lambda weight: abs(weight - k))
        return f"not proven as closely as asked for: at k = {nearest:g}, {self.proofs[nearest].message}"

    @property
    def hull(self) -> list[Solution]:
        """The paths that are cheapest under some weight, from the shortest on."""
        return [path for _, path in lower_hull(self.known)]

    @property
    def bounds(self) -> WeightBounds:
        """The bounds proven so far."""
        weights = sorted(self.proofs)
        return WeightBounds(np.array(weights), np.array([self.proofs[k].lower_bound for k in weights]))

    def costs(self, weights: FloatArray) -> FloatArray:
        """Return the cost of the cheapest known path under each weight, shape ``(n,)``."""
        lines = np.array([(path.length, path.risk) for _, path in self.known])
        return np.asarray((lines[:, 0] + np.outer(weights, lines[:, 1])).min(axis=1))

    def search(self, k: float) -> None:
        """Have the solver search under a weight."""
        found = self.reweighed.at(k)
        if found.status.has_path:
            self.known.append((k, found))

    def bend(self, k: float) -> None:
        """Refine the path that is cheapest under a weight, and the next one if it is of another class."""
        problem = dataclasses.replace(self.reweighed.problem, k=k)
        order = sorted(self.known, key=lambda pair: (pair[1].length + k * pair[1].risk, abs(pair[0] - k)))
        first, *others = (path for _, path in order[:2])
        self.offer(k, refine_path(problem, first.path, tolerance=ROUGH, max_points=POINTS).path)
        near = APART * math.dist(problem.start, problem.goal)
        line = shapely.LineString(first.path)
        for other in others:
            if shapely.LineString(other.path).hausdorff_distance(line) > near:
                self.offer(k, refine_path(problem, other.path, tolerance=ROUGH, max_points=POINTS).path)

    def offer(self, k: float, path: FloatArray) -> None:
        """Take a path if it is cheaper under a weight than the known ones."""
        problem = dataclasses.replace(self.reweighed.problem, k=k)
        judged = problem.evaluate(path)
        if judged.feasible and (not self.known or judged.cost < self.costs(np.array([k]))[0]):
            answer = Solution(Status.FOUND, path=path, cost=judged.cost, solver=self.reweighed.solver.traits.name)
            self.known.append((k, problem.judge(answer)))

    def prove(self, k: float) -> None:
        """Prove a bound under a weight, and keep a better path that the proof finds."""
        problem = dataclasses.replace(self.reweighed.problem, k=k)
        best = min(self.known, key=lambda pair: pair[1].length + k * pair[1].risk, default=None)
        path = None if best is None else best[1].path
        wanted, most = OF_PROOF * self.tolerance, usual_cells(problem)
        floor, tube = (0.0, None) if path is None else self._tube(problem, path, wanted, most)
        settings: dict[str, Any] = {"tolerance": wanted, "max_cells": most, "keeps_path": False, "in_turns": True}
        proof = prove(problem, path, tube=tube, **settings)
        self.proofs[k] = dataclasses.replace(proof, lower_bound=max(proof.lower_bound, floor))
        if proof.path is not None and proof.path is not path:
            self.offer(k, proof.path)

    def _tube(self, problem: Problem, path: FloatArray, wanted: float, most: int) -> tuple[float, Tube | None]:
        """Return a bound of all paths, and a grid outside of which none is cheaper than a known one; None: unknown."""
        cost = problem.evaluate(path).cost
        if has_cells(problem) or not is_provable(problem) or cost <= problem.least_length * (1.0 + wanted):
            return 0.0, None
        if self.places is None:
            self.places = PlaceBounds(problem)
        last, cells = self.places.last, self.places.cells(problem.k, cost)
        floor, gap = 0.0, math.nan
        is_wide = cell_runs.count(cells) > WIDE * self.places.known[0.0].size
        if is_wide and (through := self.places.lay(problem.k, path, cost, most)):
            last, cells, floor = through.last, cell_runs.runs_of(through.columns, through.rows), through.lower_bound
            gap = cost / floor - 1.0
        if not len(cells):
            return floor, None
        return floor, finer_grid(problem, last, cells, self._times(problem.k, last, gap, wanted), most)

    def _times(self, k: float, last: tuple[int, int], gap: float, wanted: float) -> float:
        """Choose how many times as fine a grid a proof needs: by the gap on this one, or proofs under other weights."""
        done = sorted(
            (math.log(weight + TINY), one.gap * max(one.grids[-1].last) ** ORDER)
            for weight, one in self.proofs.items()
            if one.grids and one.gap > 0.0
        )
        if math.isnan(gap) and done:
            at, known = zip(*done, strict=True)
            gap = math.exp(np.interp(math.log(k + TINY), at, np.log(known))) / max(last) ** ORDER
        times = MOST_TIMES if math.isnan(gap) else max(gap / (AIMED_AT * wanted), 1.0) ** (1.0 / ORDER)
        return min(times, MOST_FINER[max(last) > max(first_grid(self.reweighed.problem))])

    def _find_paths(self, tell: Tell) -> None:
        """Find paths until others, if these are the best, are cheaper by no more than a part of the tolerance."""
        weights = {0.0, self.k_max}
        while len(hull := lower_hull(self.known)) < self.most:
            between = np.array([chord_weight(a, b) for (_, a), (_, b) in pairwise(hull)])
            between = between[between < self.k_max]
            tried = np.array(sorted(weights))
            # concave in k: above its chords between the weights tried, below the line of every path
            errors = self.costs(between) / np.interp(between, tried, self.costs(tried)) - 1.0
            errors[np.isin(between, tried)] = 0.0
            if not len(errors) or errors.max() <= OF_PATHS * self.tolerance:
                return
            k = float(between[np.argmax(errors)])
            tell(f"{len(hull)} paths, others at most {errors.max():.2%} cheaper")
            weights.add(k)
            if len(self.reweighed.solved) < SEARCHED:
                self.search(k)
            else:
                self.bend(k)

    def _next(self, bounds: WeightBounds) -> float:
        """
        Choose the weight of the next proof; NaN if the gap is within the tolerance, or no proof gains enough.

        It is the first gap from the left that is closed, by the longest chord that probably closes it.
        """
        hull = self.hull
        turns = [chord_weight(short, safe) for short, safe in pairwise(hull)]
        least = min([self.k_max, *(turn for turn in turns if turn > 0.0)]) / 4.0
        ks = np.unique(np.concatenate([[0.0], np.geomspace(least, self.k_max, CHOICES), turns, bounds.weights]))
        ks = ks[ks <= self.k_max]
        costs, here = self.costs(ks), gaps(hull, bounds, ks)
        ends = [*bounds.weights.tolist(), math.inf]
        at_ends = [*gaps(hull, bounds, bounds.weights).tolist(), 0.0]
        for (left, right), at in zip(pairwise(ends), pairwise(at_ends), strict=True):
            inside = (ks > left) & (ks < right)
            if not inside.any():
                continue
            # (where a proof did not come as close as asked for, the next one may not either)
            expected = max(OF_PROOF * self.tolerance, *at)
            allowed = max(self.tolerance, expected + WORTH * self.tolerance)
            if here[inside].max() <= allowed:
                continue
            between, cost = ks[inside], costs[inside]
            bound, known = float(bounds.at(left)), cost / (1.0 + expected)
            # (whether the chord from here to each place closes all gaps up to there)
            slopes = (known - bound) / (between - left)
            chords = bound + np.outer(slopes, between - left)
            fits = ((cost <= (1.0 + allowed) * chords) | np.triu(np.ones(chords.shape, dtype=np.bool_), 1)).all(axis=1)
            last = int(np.flatnonzero(fits)[-1]) if fits.any() else int(np.argmax(here[inside]))
            return float(between[last])
        return math.nan


def _halving(ordered: list[float], before: list[float]) -> list[float]:
    """
    List numbers after others, the middle one first, then those of both halves in the same way.

    Examples
    --------
    >>> _halving([1.0, 2.0, 3.0, 4.0], [5.0])
    [5.0, 3.0, 2.0, 4.0, 1.0]
    """
    found, parts = list(before), [ordered]
    while parts:
        part = parts.pop(0)
        middle = len(part) // 2
        found += part[middle : middle + 1]
        parts += [half for half in (part[:middle], part[middle + 1 :]) if half]
    return found
