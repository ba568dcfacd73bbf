"""The shortest path within a risk budget, the least risk within a length, and a bound of all such paths."""

import dataclasses
import math
import time
from typing import Any, Literal

from cgla_graph._progress import showing
from cgla_graph._text import rounded_down
from cgla_graph._types import FloatArray
from cgla_graph._validate import non_negative_number, positive_number
from cgla_graph.certificate.certificate import prove
from cgla_graph.certificate.within import cut_within
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import NEGATIVE_WEIGHTS, Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.solvers.trade_off.budget_use import Budget, bent, refined
from cgla_graph.solvers.trade_off.front import ROUNDING, chord_weight, growing_weights, is_risk_free
from cgla_graph.solvers.trade_off.label_search import constrained_path
from cgla_graph.solvers.trade_off.plan_within import PlanWithin, Scope
from cgla_graph.solvers.trade_off.reweighing import Reweighed

#: Solver runs between the two weights that enclose the budget, at most.
MOST_SOLVES = 60
#: With a solver of the plane: end when the path is this close to the bound by its own costs.
CLOSE = 1e-5
#: With a solver of the plane: search beyond risk weights where these leave a greater gap than this.
SMALL_GAP = 1e-3
#: A lattice's best path is refined as well, up to this many nodes.
SEEDS_UP_TO = 1000
#: Statuses by which a solver says that it finds no path.
NONE_FOUND = {Status.NO_PATH, Status.NOT_FOUND, Status.STUCK, Status.INFEASIBLE}
#: Statuses of a solver that has not looked for a path.
NOT_TRIED = {Status.UNSUPPORTED, Status.UNAVAILABLE}


def plan_within_risk(
    problem: Problem,
    max_risk: float,
    *,
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = 0.01,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> PlanWithin:
    """
    Find the shortest path whose risk is at most `max_risk`: the budget instead of a weight.

    The Lagrangian dual, ``max over k of (least cost under k) - k * max_risk``, bounds the length from below; its
    best weight is found between a path that breaks the budget and one that keeps it (Handler, Zang, Networks 10(4),
    1980). The gap between the two is searched as well: on a lattice by labels, up to the optimum
    (`constrained_path`); in the plane by bending the path that keeps the budget towards the one that does not, and by
    refining it and a lattice's best path until they use the budget up. If the gap is above the tolerance in the plane,
    a cut with the best weight at each place raises the bound (`PlanWithin.cut_bound`).

    Parameters
    ----------
    problem
        The map; its own `k` only enters the reported cost.
    max_risk
        The budget, at least 0: the most that the line integral of the risk field may be.
    solver
        A name or a solver; None: `hybrid`.
    resolution
        For solvers that need a lattice, as in `solve`.
    tolerance
        Ratio above 0 that the lower bound of the cost (`cgla_graph.lower_bound`) aims at, with
        a solver that is not exact on a lattice. None: prove only the bound of the straight line.
    **settings
        Settings of a solver given by name.

    Returns
    -------
    plan
        Judged by the oracle. If no path within the budget is found, the status says so, and the message says how much
        of the budget's use is needed, and the proven bound. `PlanWithin.no_path` tells whether none exists.

    Raises
    ------
    UnknownSolverError, SolverUnavailableError, SolverSettingError
        If there is no such solver, it cannot run here, or a setting is wrong.
    ProblemError
        If the problem, the resolution or the budget is malformed.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> plan = plan_within_risk(problem, 0.1, solver="cgla", resolution=9)
    >>> plan.status.label, bool(plan.solution.risk <= 0.1), round(plan.solution.length, 3), round(plan.gap, 3)
    ('optimal', True, 1.118, 0.055)
    """
    budget = non_negative_number("max_risk", max_risk)
    return plan_with(Reweighed(problem, solver, resolution=resolution, **settings), "risk", budget, tolerance)


def plan_within_length(
    problem: Problem,
    max_length: float,
    *,
    solver: str | Solver | None = None,
    resolution: int | tuple[int, int] | Lattice = 20,
    tolerance: float | None = 0.01,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> PlanWithin:
    """
    Find the path of least risk whose length is at most `max_length`, map units; else like `plan_within_risk`.

    Examples
    --------
    >>> from cgla_graph.model.risk import RiskField, Threat
    >>> problem = Problem((0, 0.5), (1, 0.5), RiskField([Threat(0.5, 0.5, spread=0.1)]))
    >>> plan = plan_within_length(problem, 1.1, solver="cgla", resolution=9)
    >>> plan.status.label, bool(plan.solution.length <= 1.1), round(plan.solution.risk, 4)
    ('optimal', True, 0.115)
    """
    budget = non_negative_number("max_length", max_length)
    return plan_with(Reweighed(problem, solver, resolution=resolution, **settings), "length", budget, tolerance)


def plan_with(
    reweighed: Reweighed, limited: Literal["risk", "length"], budget: float, tolerance: float | None
) -> PlanWithin:
    """
    Plan within a budget as `plan_within_risk` or `plan_within_length`, with the answers that a solver gave before.

    Examples
    --------
    >>> reweighed = Reweighed(Problem((0, 0.5), (1, 0.5)), "cgla", resolution=3)
    >>> plan_with(reweighed, "risk", 0.5, None).solution.length
    1.0
    """
    return _Search(reweighed, limited, budget, tolerance).run()


class _Search:
    """State of one search: its paths are the solver's under the weights tried so far."""

    def __init__(
        self, reweighed: Reweighed, limited: Literal["risk", "length"], budget: float, tolerance: float | None
    ) -> None:
        self.began = time.perf_counter()
        self.reweighed, self.problem = reweighed, reweighed.problem
        self.budget = Budget(limited, budget)
        self.tolerance = None if tolerance is None else positive_number("tolerance", tolerance)
        #: The path of least risk on the lattice, once it was asked for.
        self.least: Solution | None = None
        #: The path of the last certificate.
        self.of_proof: FloatArray | None = None

    def run(self) -> PlanWithin:
        """Search, unless the shortest path decides the answer."""
        with showing(f"planning within {self.budget.amount:g} of {self.budget.limited}"):
            return self._run()

    def _run(self) -> PlanWithin:
        if not self.problem.field.is_proper:
            return self._plan(Solution(Status.UNSUPPORTED, message=NEGATIVE_WEIGHTS), 0.0, math.nan)
        shortest = self.reweighed.at(0.0)
        if not shortest.status.has_path:
            return self._without_path(shortest)
        if self.budget.keeps(shortest) == self.budget.on_risk:
            return self._plan(shortest, *self._dual(0.0)) if self.budget.on_risk else self._too_short(shortest)
        return self._search(shortest)

    def _search(self, shortest: Solution) -> PlanWithin:
        """Enclose the budget between two paths, and search between them."""
        if not self.budget.on_risk and is_risk_free(shortest):
            return self._plan(shortest, math.inf, 0.0)
        short, safe = self._enclose(shortest)
        if self.budget.keeps(safe) == self.budget.on_risk:
            return self._between(short, safe)
        if self.budget.on_risk:
            return self._too_safe(safe)
        if self._is_safest_of_lattice(safe):
            return self._plan(safe, math.inf, safe.risk)
        return self._plan(safe, *self._dual(max(self.reweighed.solved)))

    def _enclose(self, shortest: Solution) -> tuple[Solution, Solution]:
        """Grow the weight until the budget lies between two paths, or no risk is left to shed."""
        short = safe = shortest
        for k in growing_weights(shortest):
            found = self.reweighed.at(k)
            if found.status.has_path and found.risk < safe.risk:
                short, safe = safe, found
            if self.budget.keeps(safe) == self.budget.on_risk or safe.risk == 0.0:
                return short, safe
        least = self.least = self.reweighed.least_risk()
        return (short, safe) if least is None or least.risk >= safe.risk else (safe, least)

    def _is_safest_of_lattice(self, safe: Solution) -> bool:
        """Whether no path on the lattice has less risk, at any length, by an exact solve for risk alone."""
        least = self.least if self.reweighed.exact else None
        return least is not None and least.status is Status.OPTIMAL and safe.risk <= least.risk

    def _between(self, short: Solution, safe: Solution) -> PlanWithin:
        """Solve where the two cost the same, until nothing costs less there: that weight prices the budget best."""
        k = 0.0
        for _ in range(MOST_SOLVES):
            if not (short.risk > safe.risk and short.length < safe.length):
                break
            k = chord_weight(short, safe)
            now = self.reweighed.at(k)
            cost = short.length + k * short.risk
            if not now.status.has_path or now.cost >= cost * (1.0 - ROUNDING):
                break
            short, safe = (short, now) if self.budget.keeps(now) == self.budget.on_risk else (now, safe)
            if not self.reweighed.exact and self._is_close(safe if self.budget.on_risk else short, now, k):
                break
        broken = short if self.budget.on_risk else safe
        found = [path for path in (short, safe, *self.reweighed.solved.values()) if path.status.has_path]
        kept = min(filter(self.budget.keeps, found), key=self.budget.value)
        if self.reweighed.exact:
            return self._on_lattice(kept)
        return self._with_cut(self._plan(self._in_plane(kept, broken, k), *self._dual(k)))

    def _with_cut(self, plan: PlanWithin) -> PlanWithin:
        """Close the duality gap by the best weight at each place, where the gap is above the tolerance."""
        value = self.budget.value(plan.solution)
        if self.tolerance is None or not plan.gap > self.tolerance or not 0.0 < plan.k < math.inf or not value > 0.0:
            return plan
        found = [path.path for path in self.reweighed.solved.values() if path.status.has_path]
        cut = cut_within(
            self.problem, self.budget.limited, self.budget.room, value, plan.k, found, tolerance=self.tolerance
        )
        return dataclasses.replace(plan, cut_bound=cut.lower_bound)

    def _is_close(self, kept: Solution, now: Solution, k: float) -> bool:
        """Whether a path is as good as any within the budget can be, by the solver's own costs."""
        return self.budget.value(kept) <= self.budget.bound(now.cost, k) * (1.0 + CLOSE)

    def _dual(self, k: float) -> tuple[float, float]:
        """Return the weight of the best bound, and the bound: of all solved on a lattice, else the proof for `k`."""
        if self.reweighed.exact:
            solved = [(weight, found) for weight, found in self.reweighed.solved.items() if found.status.has_path]
            # length alone says nothing of risk
            solved = solved if self.budget.on_risk else [pair for pair in solved if pair[0] > 0.0]
            bounds = [(self.budget.bound(found.cost * (1.0 - ROUNDING), weight), weight) for weight, found in solved]
            bound, k = max(bounds, key=lambda pair: pair[0], default=(0.0, k))
            return k, max(0.0, bound)
        straight = self.problem.least_length if self.budget.on_risk else 0.0
        return k, max(straight * (1.0 - ROUNDING), self.budget.bound(self._certified(k), k))

    def _certified(self, k: float) -> float:
        """Bound the cost of every path inside the bounds under a weight; without a tolerance, by the straight line."""
        straight = self.problem.least_length * (1.0 - ROUNDING)
        if self.tolerance is None or straight == 0.0:
            return straight
        weighted = dataclasses.replace(self.problem, k=k)
        paths = [found.path for found in self.reweighed.solved.values() if found.status.has_path]
        path = min(paths, key=lambda path: weighted.evaluate(path).cost, default=self.of_proof)
        proof = prove(weighted, path, tolerance=self.tolerance)
        self.of_proof = proof.path
        return max(straight, proof.lower_bound)

    def _on_lattice(self, kept: Solution) -> PlanWithin:
        """Search by labels for paths that no risk weight finds."""
        k, bound = self._dual(0.0)
        matrices, on = self.reweighed.matrices, self.reweighed.on_lattice
        if matrices is None or on is None:
            return self._plan(dataclasses.replace(kept, status=Status.FOUND), k, bound)
        lengths, risks = matrices
        ends = on.graph.index_of(on.source), on.graph.index_of(on.target)
        known = self.budget.value(kept) * (1.0 - ROUNDING)
        # matrices and the oracle round sums differently: what keeps half of the room here keeps all of it there
        room = self.budget.amount * (1.0 + 0.5 * ROUNDING)
        if self.budget.on_risk:
            found = constrained_path(lengths, risks, ends, room, price=k, known=known)
        else:
            found = constrained_path(risks, lengths, ends, room, price=1.0 / k if k > 0.0 else 0.0, known=known)
        if found.nodes and on.graph.positions is not None:
            path = on.graph.positions[list(found.nodes)]
            # the search adds up matrices; the oracle decides
            if self.budget.keeps(self.problem.evaluate(path)):
                return self._plan(Solution(Status.OPTIMAL, path=path), k, bound)
        proven = found.finished and not found.nodes
        return self._plan(kept if proven else dataclasses.replace(kept, status=Status.FOUND), k, bound)

    def _in_plane(self, kept: Solution, broken: Solution, k: float) -> Solution:
        """Search for paths that no risk weight finds: near the one that keeps the budget, and the lattice's best."""
        best = bent(self.problem, self.budget, kept, broken)
        known = max(
            self.budget.bound(path.cost, k) for k, path in self.reweighed.solved.items() if path.status.has_path
        )
        if self.budget.value(best) <= known * (1.0 + SMALL_GAP):
            return best
        seeds = [kept]
        if self.problem.on_lattice(self.reweighed.resolution).graph.n_nodes <= SEEDS_UP_TO:
            lattice = Reweighed(self.problem, "cgla", resolution=self.reweighed.resolution)
            seed = _Search(lattice, self.budget.limited, self.budget.amount, self.tolerance).run().solution
            seeds.append(dataclasses.replace(seed, status=Status.FOUND) if seed.status.has_path else seed)
        found = [refined(self.problem, self.budget, seed, k) for seed in seeds if seed.status.has_path]
        return min([best, *found], key=self.budget.value)

    def _without_path(self, answer: Solution) -> PlanWithin:
        """Report that the solver finds no path: a proof on the lattice by an exact one, else by a certificate."""
        if self.reweighed.exact and answer.status is Status.NO_PATH:
            msg = "no path on the lattice joins start and goal"
            return self._plan(dataclasses.replace(answer, message=msg), 0.0, math.inf)
        if answer.status in NOT_TRIED:
            return self._plan(answer, 0.0, math.nan)
        k, shortest, status = 0.0, self._certified(0.0), answer.status
        if math.isinf(shortest):
            bound, known = math.inf, "it is proven that no path joins start and goal inside the bounds"
            status = Status.NO_PATH if status in NONE_FOUND else status
        else:
            status = Status.NOT_FOUND if status is Status.NO_PATH else status
            if not self.budget.on_risk and shortest > self.budget.room:
                bound = math.inf
                known = (
                    f"no path of length at most {self.budget.amount:g} exists: none is shorter than {_proven(shortest)}"
                )
            else:
                k, bound, known = self._by_proof_alone(shortest)
        msg = f"{self.reweighed.solver.traits.name} finds no path ({answer.message or answer.status.value}); {known}"
        return self._plan(dataclasses.replace(answer, status=status, message=msg), k, bound, "plane")

    def _by_proof_alone(self, shortest: float) -> tuple[float, float, str]:
        """Return weight and bound of paths within the budget if the solver finds none, and a sentence on them."""
        path = None if self.of_proof is None else self.problem.evaluate(self.of_proof)
        k, bound, least = 0.0, shortest, "is shorter"
        if not self.budget.on_risk:
            k = 0.0 if path is None else max(growing_weights(path), default=0.0)
            bound, least = max(0.0, self.budget.bound(self._certified(k), k)), "has less risk"
        known = "whether another path keeps the budget is not known"
        if path is not None and self.budget.keeps(path):
            known = f"there is one within the budget, of length {path.length:.9g} and risk {path.risk:.9g}"
        return k, bound, f"{known}; none within the budget {least} than {_proven(bound)}"

    def _too_short(self, shortest: Solution) -> PlanWithin:
        """Report that even the shortest path is too long."""
        if self.reweighed.exact:
            msg = (
                f"no path on the lattice is at most {self.budget.amount:g} long: the shortest is {shortest.length:.9g}"
            )
            return self._plan(Solution(Status.NO_PATH, message=msg), 0.0, math.inf)
        proven = self._certified(0.0)
        impossible = proven > self.budget.room
        msg = (
            f"no path of length at most {self.budget.amount:g} {'exists' if impossible else 'was found'}: "
            f"the shortest found is {shortest.length:.9g} long, and none is shorter than {_proven(proven)}"
        )
        return self._plan(Solution(Status.NOT_FOUND, message=msg), 0.0, math.inf if impossible else 0.0)

    def _too_safe(self, safest: Solution) -> PlanWithin:
        """Report that even the path of least risk exceeds the budget."""
        least = f"{safest.risk:.9g}, at length {safest.length:.9g}"
        if self._is_safest_of_lattice(safest):
            msg = f"no path on the lattice has a risk of at most {self.budget.amount:g}: the least is {least}"
            return self._plan(Solution(Status.NO_PATH, message=msg), math.inf, math.inf)
        k, bound = self._dual(max(self.reweighed.solved))
        msg = (
            f"no path of risk at most {self.budget.amount:g} was found: the least found is {least}; "
            f"none within the budget is shorter than {_proven(bound)}"
        )
        return self._plan(Solution(Status.NOT_FOUND, message=msg), k, bound)

    def _plan(self, solution: Solution, k: float, bound: float, scope: Scope | None = None) -> PlanWithin:
        """Judge the path under the problem's own weight; leave out what the solver says under others."""
        scope = scope or ("lattice" if self.reweighed.exact else "plane")
        status, message = solution.status, solution.message
        if status.has_path:
            status, message = status if scope == "lattice" else Status.FOUND, ""
            solution = dataclasses.replace(solution, cost=self.problem.evaluate(solution.path).cost)
        solution = Solution(
            status,
            path=solution.path,
            nodes=solution.nodes,
            cost=solution.cost,
            solver=self.reweighed.solver.traits.name,
            seconds=time.perf_counter() - self.began,
            evaluations=solution.evaluations,
            message=message,
        )
        return PlanWithin(
            self.problem.judge(solution),
            self.budget.limited,
            self.budget.amount,
            k,
            bound,
            scope,
            len(self.reweighed.solved),
        )


def _proven(bound: float) -> str:
    """Return a bound as text, rounded down."""
    return f"{rounded_down(bound, 9)} (proven)"
