"""Find a path of the least objective over scenarios, and prove how good it is, in the plane."""

import dataclasses
import math
from collections.abc import Callable
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import shapely

from cgla_graph._types import FloatArray, Point
from cgla_graph.certificate.certificate import Certificate, prove
from cgla_graph.certificate.subsolution import first_grid
from cgla_graph.certificate.through import Through, bottleneck, grids_through
from cgla_graph.errors import ProblemError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import Solution, Status
from cgla_graph.model.uncertain.field import UncertainField
from cgla_graph.model.uncertain.tail_mean import TailMean
from cgla_graph.refine.refine import refine_path
from cgla_graph.solvers.uncertain.bundle import Bundle, level_of
from cgla_graph.solvers.uncertain.cell_cut import CellCut, WaysThrough

#: Searches of the whole map, and steps of an ascent near one path, at most.
MOST_SEARCHES, MOST_STEPS = 12, 40
#: How much of the promised gain a step asks for, at first and after a step that gains nothing.
EAGER, CAREFUL = 0.7, 0.3
#: Part of the tolerance that the ascent, the waypoints and a proof may each take.
OF_ASCENT, OF_PATH, OF_PROOF = 0.2, 0.02, 0.4
#: Ways that differ by less than this part of the distance from start to goal are one.
ONE_WAY = 0.03
#: Places of a path that is averaged with others.
PLACES = 200
#: Weights whose bounds through places are combined, at most; their grids have so many cells along the longer side.
MOST_WAYS, CUT_GRIDS = 6, (128, 256, 512)
#: Proofs over cells of the cut, at most.
MOST_CUTS = 60
#: Cells of a grid of the cut, at most.
CUT_CELLS = 400_000


@dataclass
class Found:
    """
    What a search found.

    Attributes
    ----------
    path
        The best path; empty without one.
    answer
        The first answer of the solver, for status and message.
    weights
        Of the scenarios in the best proof, shape ``(n,)``.
    certificate
        That proof; None without one.
    bound, weighted_bound, least_weighted
        As `UncertainSolution` has them.
    message
        What was done, in one line.
    """

    path: FloatArray
    answer: Solution
    weights: FloatArray
    certificate: Certificate | None = None
    bound: float = math.nan
    weighted_bound: float = math.nan
    least_weighted: float = math.nan
    message: str = ""
    counts: dict[str, int] = field(default_factory=lambda: {"searches": 0, "steps": 0, "proofs": 0, "cuts": 0})


class Search:
    """
    Searches for a path under an objective, and proves it.

    **Bound.** For weights ``q`` of `TailMean`, no path has a lower objective than its ``q``-weighted cost, which a
    proof over the weighted field bounds for all paths. The weights are improved by an ascent (`Bundle.level`).

    **Path.** The best of all paths found, by the objective itself: those of the solver under several weights, these
    refined under the weights of the ascent, and means of paths that the linear program mixes.

    **Cut.** Where several ways are best under different weights, no weighted sum is as great as the objective (two ways
    with costs (10, 1) and (1, 10): worst case 10, best sum 5.5). Yet for each place and each ``q``, no path through the
    place has a lower objective than ``S_q + T_q`` there (`through`). Each path passes a place where the greatest of
    these over several ``q`` is at least the `bottleneck`. On cells of `nearest` rasters, weights are sought for the
    place that leaves least (`cell_cut`).

    Parameters
    ----------
    problem
        With an `UncertainField`.
    tail
        The objective.
    solve
        Finds a path of a problem with a weighted field.
    tolerance
        The gap to aim at; None: no proof.
    """

    def __init__(
        self, problem: Problem, tail: TailMean, solve: Callable[[Problem], Solution], tolerance: float | None
    ) -> None:
        if not isinstance(problem.field, UncertainField):
            msg = "the field of the problem is certain; give an UncertainField"
            raise ProblemError(msg)
        self.problem, self.uncertain, self.tail = problem, problem.field, tail
        self.solve, self.tolerance = solve, tolerance
        self.aim = 0.01 if tolerance is None else tolerance
        self.bundle = Bundle(problem, problem.field, tail)
        self.found = Found(np.empty((0, 2)), Solution(Status.NOT_FOUND), tail.inside([1.0] * len(tail.caps)))

    def run(self) -> Found:
        """Search, prove, and cut."""
        centre = self.tail.inside([float(chance) for chance in self.uncertain.weights])
        self.found.answer = self._searched(centre)
        if not self.found.answer.status.has_path:
            self._prove_none(centre)
        if not self.bundle.paths:
            return self.found
        ways = self._ascend(centre)
        if self.tolerance is not None:
            self._prove(ways)
        best = self.bundle.paths[self.bundle.best]
        self.found.path = best
        counts = self.found.counts
        self.found.message = (
            f"{len(self.bundle.paths)} paths of {counts['searches']} searches and {counts['steps']} steps; "
            f"{counts['proofs']} proofs, {counts['cuts']} grids through places"
        )
        return self.found

    def weighted(self, weights: FloatArray) -> Problem:
        """Return the problem whose field is the weighted sum of the scenarios."""
        return dataclasses.replace(self.problem, field=self.uncertain.weighted(weights))

    def _searched(self, weights: FloatArray) -> Solution:
        """Search the whole map under weights, and keep the path."""
        self.found.counts["searches"] += 1
        answer = self.solve(self.weighted(weights))
        if answer.status.has_path:
            self._refined(answer.path, weights)
        return answer

    def _refined(self, path: FloatArray, weights: FloatArray) -> int:
        """Refine a path under weights, and keep it."""
        self.found.counts["steps"] += 1
        refined = refine_path(self.weighted(weights), path, tolerance=OF_PATH * self.aim, max_points=256).path
        return self.bundle.add(refined if self.problem.evaluate(refined).feasible else path)

    def _ascend(self, centre: FloatArray) -> list[FloatArray]:
        """
        Improve weights until no search finds a cheaper path than the linear program knows.

        Returns
        -------
        ways
            The best weights, then the best weights for each way alone, shape ``(n,)`` each.
        """
        ways: list[tuple[FloatArray, FloatArray]] = []
        best, known = centre, -math.inf
        for _ in range(MOST_SEARCHES):
            at = self.bundle.cheapest(centre)
            if not any(self._is_one(self.bundle.paths[at], path) for path, _ in ways):
                ways.append((self.bundle.paths[at], self._ascend_near(at, centre)))
            value = float(self.bundle.costs[self.bundle.cheapest(centre)] @ centre)
            best, known = (centre, value) if value > known else (best, known)
            promised, weights, _ = self.bundle.level(best, 1.0, known)
            if promised <= known * (1.0 + OF_ASCENT * self.aim):
                break
            before = float(self.bundle.costs[self.bundle.cheapest(weights)] @ weights)
            centre = weights
            self._searched(weights)
            after = float(self.bundle.costs[self.bundle.cheapest(weights)] @ weights)
            if after >= before * (1.0 - OF_ASCENT * self.aim):
                best, known = weights, after
                break
        self.found.least_weighted = self.bundle.level(best, 1.0, known)[0]
        others = [weights for _, weights in sorted(ways, key=lambda way: self.tail.of(self._costs(way[0])))]
        return [best, *others]

    def _costs(self, path: FloatArray) -> FloatArray:
        return self.uncertain.costs(self.problem, path)

    def _ascend_near(self, first: int, centre: FloatArray) -> FloatArray:
        """Improve weights against the paths that one path can be bent into; return the best ones."""
        members, share = [first], EAGER
        members.append(self._refined(self.bundle.paths[first], self.tail.weights(self.bundle.costs[first])))
        best, known = centre, float(self.bundle.costs[first] @ centre)
        for _ in range(MOST_STEPS):
            promised, weights, shares = self.bundle.level(best, share, known, members)
            upper = min(self.bundle.values[i] for i in members)
            if upper <= known * (1.0 + OF_ASCENT * self.aim) or promised <= known * (1.0 + 0.25 * OF_ASCENT * self.aim):
                break
            members += self._mixed(members, shares)
            nearest = min(members, key=lambda i: float(self.bundle.costs[i] @ weights))
            members.append(self._refined(self.bundle.paths[nearest], weights))
            value = min(float(self.bundle.costs[i] @ weights) for i in members)
            share = EAGER if value > known else CAREFUL * share
            if value > known:
                best, known = weights, value
        return best

    def _mixed(self, members: list[int], shares: FloatArray) -> list[int]:
        """Add the mean of the paths that the linear program mixes, where it is feasible."""
        chosen = [i for i, share in zip(members, shares, strict=False) if share > 0.01]  # noqa: PLR2004 - a few
        if len(chosen) < 2:  # noqa: PLR2004 - two paths
            return []
        at = np.linspace(0.0, 1.0, PLACES)
        mean = np.zeros((PLACES, 2))
        parts = np.array([share for share in shares if share > 0.01])  # noqa: PLR2004 - the same
        for i, part in zip(chosen, parts / parts.sum(), strict=True):
            line = shapely.LineString(self.bundle.paths[i])
            mean += part * shapely.get_coordinates(shapely.line_interpolate_point(line, at, normalized=True))
        mean[0], mean[-1] = self.problem.start, self.problem.goal
        return [self.bundle.add(mean)] if self.problem.evaluate(mean).feasible else []

    def _is_one(self, path: FloatArray, other: FloatArray) -> bool:
        """Whether two paths are the same way, about."""
        apart = ONE_WAY * math.dist(self.problem.start, self.problem.goal)
        return bool(shapely.hausdorff_distance(shapely.LineString(path), shapely.LineString(other)) <= apart)

    def _prove(self, ways: list[FloatArray]) -> None:
        """Prove a bound under the best weights, and cut what no weights prove."""
        best = ways[0]
        for _ in range(3):
            number = self.bundle.cheapest(best)
            self.found.counts["proofs"] += 1
            proof = prove(
                self.weighted(best), self.bundle.paths[number], tolerance=OF_PROOF * self.aim, keeps_path=False
            )
            self._bounded(proof.lower_bound, best, proof)
            cheaper = proof.path is not None and proof.upper_bound < float(self.bundle.costs[number] @ best) * (
                1.0 - OF_ASCENT * self.aim
            )
            if self._is_close() or not cheaper or proof.path is None:
                break
            self.bundle.add(proof.path)
            best = self._ascend(best)[0]
        self.found.weighted_bound = self.found.bound
        if not self._is_close() and self.bundle.upper < math.inf:
            self._cut([best, *ways[1:]])

    def _is_close(self) -> bool:
        return self.bundle.upper <= self.found.bound * (1.0 + self.aim)

    def _bounded(self, bound: float, weights: FloatArray, proof: Certificate | None) -> None:
        """Keep a bound if it is the best; none exceeds the objective of a path but by rounding."""
        if not self.found.bound >= bound:
            self.found.bound, self.found.weights, self.found.certificate = bound, weights, proof

    def _cut(self, ways: list[FloatArray]) -> None:
        """Bound all paths by the places that they have to pass, under the weights of several ways at once."""
        tight = [self.tail.weights(self.bundle.costs[self.bundle.best])]
        chosen: list[FloatArray] = []
        for weights in (*ways, *tight):
            if not any(np.abs(weights - other).sum() < self.aim for other in chosen):
                chosen.append(weights)
        if (cut := CellCut.begin(self.problem, CUT_CELLS, self.bundle.paths[self.bundle.best])) is not None:
            self._cut_over_cells(cut, chosen[:MOST_WAYS])
            if self._is_close() or not cut.proof.loose:
                return
        for along in CUT_GRIDS:
            last = first_grid(self.problem, along)
            places: FloatArray | None = None
            for weights in chosen[:MOST_WAYS]:
                through = self._through(weights, last)
                if through is None:
                    return
                full = through.last == last
                on_cells = through.on_cells() if full else np.full((last[1] + 1, last[0] + 1), through.limit)
                places = on_cells if places is None else np.maximum(places, on_cells)
                self._bounded(through.lower_bound, weights, None)
            if places is None:
                return
            bound = bottleneck(places, self.problem.bounds, self.problem.start, self.problem.goal)
            self._bounded(bound, self.found.weights, None)
            if self._is_close():
                return

    def _cut_over_cells(self, cut: CellCut, tried: list[FloatArray]) -> None:
        """Bound all paths by the sides of cells that they have to cross, under weights that are best for these."""
        ways = WaysThrough(self.problem, cut.proof.cells)
        for weights in tried:
            ways.add(self.weighted(weights))
        finer: CellCut | None = cut
        while finer is not None and self.found.counts["cuts"] < MOST_CUTS:
            cut = finer
            for weights in tried:
                self._bounded(cut.add(self.weighted(weights), self.bundle.upper), weights, None)
            self.found.counts["cuts"] += len(tried)
            while True:
                least, place = cut.narrowest()
                self._bounded(min(least, self.bundle.upper), self.found.weights, None)
                if self._is_close() or least == -math.inf or self.found.counts["cuts"] >= MOST_CUTS:
                    return
                weights, known, promised = self._best_through(ways, place, tried)
                if promised <= max(known, least) * (1.0 + 0.25 * OF_ASCENT * self.aim):
                    break
                tried.append(weights)
                ways.add(self.weighted(weights))
                self.found.counts["cuts"] += 1
                cut.add(self.weighted(weights), self.bundle.upper)
            finer = cut.finer(self.bundle.upper)

    def _best_through(
        self, ways: WaysThrough, place: Point, tried: list[FloatArray]
    ) -> tuple[FloatArray, float, float]:
        """Return weights under which paths through a place cost most, what is known there, and what is promised."""
        halves = ways.halves(place)
        if not all(halves):
            return tried[0], math.inf, math.inf
        first, second = (np.array([self._costs(half) for half in some]) for some in halves)
        costs = (first[:, None] + second).reshape(-1, first.shape[1])
        by_weights = np.array(tried) @ costs.T
        known = by_weights.min(axis=1)
        promised, weights, _ = level_of(costs, self.tail, tried[int(known.argmax())], 1.0, float(known.max()))
        one, other = divmod(int(by_weights.max(axis=0).argmin()), len(second))
        path = np.vstack([halves[0][one], halves[1][other][1:]])
        if self.tail.of(costs[one * len(second) + other]) < self.bundle.upper and self.problem.evaluate(path).feasible:
            self._refined(path, self.tail.weights(self._costs(self.bundle.paths[self.bundle.add(path)])))
        return weights, float(known.max()), promised

    def _through(self, weights: FloatArray, last: tuple[int, int]) -> Through | None:
        """Bound all paths through each place under weights; None where the grid has too many cells."""
        path, tolerance = self.bundle.paths[self.bundle.cheapest(weights)], 0.1 * self.aim
        limits: dict[str, Any] = {"limit": self.bundle.upper, "last": last, "max_cells": CUT_CELLS}
        laid = [one.through for one in grids_through(self.weighted(weights), path=path, tolerance=tolerance, **limits)]
        self.found.counts["cuts"] += len(laid)
        through = laid[-1] if laid else None
        # (where no place is left, the grids end before the last)
        whole = through is not None and (through.last == last or not len(through.least))
        return through if whole else None

    def _prove_none(self, weights: FloatArray) -> None:
        """Look for a proof that there is no path at all."""
        if self.tolerance is None:
            return
        proof = prove(self.weighted(weights), None, tolerance=self.aim)
        self.found.counts["proofs"] += 1
        self._bounded(proof.lower_bound, weights, proof)
        if proof.path is not None:
            self.bundle.add(proof.path)
