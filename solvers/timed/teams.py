"""
Plan several flights together: one after the other around those before it, in many orders.

Each flight is the best of its own if it meets none of those before it. In a polite order, a flight also keeps half of
the separation from the best ones of those after it, so that both share the detour.
"""

import dataclasses
import itertools
import math
import time
from collections.abc import Mapping, Sequence

import numpy as np

from cgla_graph._progress import showing
from cgla_graph._text import counted
from cgla_graph._validate import instance, items, positive_number, whole_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.solution import Status
from cgla_graph.motion.trajectory import Trajectory, least_distance
from cgla_graph.solvers.timed.found_flight import FoundFlight
from cgla_graph.solvers.timed.planning import NODES, Search
from cgla_graph.solvers.timed.solving_timed import judged, proven_in_time, solve_timed
from cgla_graph.solvers.timed.tolling import with_tolls
from cgla_graph.timed.space_time_proof import MOST_CELLS, TOLERANCE, check_settings
from cgla_graph.timed.team_plan import TeamPlan
from cgla_graph.timed.timed_plan import TimedPlan
from cgla_graph.timed.timed_problem import TimedProblem

#: Orders that are tried, by default and ever.
ORDERS, MOST_ORDERS = 6, 10_000
#: Flights around others are searched on grids that are coarser by this factor.
COARSER = 5
#: Nothing more is sought where the team loses less than this part of its cost, or a flight of its own.
LEAST_LOSS = 1e-4
#: The part of the separation that polite flights keep from those planned later.
SHARE = 0.5


def solve_team(
    problems: Sequence[TimedProblem] | Mapping[str, TimedProblem],
    separation: float,
    *,
    nodes: int = NODES,
    orders: int = ORDERS,
    seed: int = 0,
    tolerance: float | None = TOLERANCE,
    max_cells: int = MOST_CELLS,
) -> TeamPlan:
    """
    Plan flights of a team that keep apart, with a small sum of costs, and prove how good that is.

    Each UAV is there from its departure to its arrival.

    Parameters
    ----------
    problems
        One for each UAV, in a list, or by its name. Their own `others`, if any, are evaded too, at the same separation.
    separation
        The least distance of any two UAVs, map units, above 0.
    nodes
        As `plan_in_time` takes them; flights around others have a fifth of them.
    orders, seed
        How many orders are tried, from 1 on: first that of the losses, then each time the one that lost most comes
        first, then random ones.
    tolerance, max_cells
        As `timed_lower_bound` takes them, for each UAV: each proof takes seconds to a minute. None: no proof.

    Returns
    -------
    team
        The best team found; its bound is the sum of those of flights alone. Where its gap is above the tolerance,
        another bound counts what it costs to keep apart (`tolling`). Without a team, the status says so.

    Raises
    ------
    ProblemError
        If there is no problem, one is no `TimedProblem` or keeps another separation, or a setting is out of range.

    Examples
    --------
    >>> east = TimedProblem((0.1, 0.5), (0.9, 0.5), speed=1.0)
    >>> north = TimedProblem((0.5, 0.1), (0.5, 0.9), speed=1.0, departure=(0.0, 1.0))
    >>> team = solve_team([east, north], separation=0.1, nodes=2_000, orders=1)
    >>> team.status.label, team.lower_bound, bool(team.least_distance >= 0.1), bool(team.gap < 1e-6)
    ('found', 1.6, True, True)
    """
    began = time.perf_counter()
    team = _checked(problems, positive_number("separation", separation))
    names = tuple(map(str, problems if isinstance(problems, Mapping) else range(len(team))))
    whole_number("orders", orders, at_least=1, at_most=MOST_ORDERS)
    whole_number("seed", seed, at_least=0, at_most=2**63 - 1)
    check_settings(tolerance, max_cells)
    with showing("planning each UAV alone"):
        alone = [solve_timed(problem, nodes=nodes, tolerance=None) for problem in team]
    if tolerance is not None:
        alone = [proven_in_time(one, plan, tolerance, max_cells) for one, plan in zip(team, alone, strict=True)]
    lost = [number for number, plan in enumerate(alone) if not plan.status.has_path]
    if lost:
        status = next((alone[i].status for i in lost if alone[i].status == Status.NO_PATH), alone[lost[0]].status)
        message = f"UAV {names[lost[0]]} has no flight of its own: {alone[lost[0]].message}"
        team_plan = TeamPlan(status, (), tuple(alone), separation, message=message)
        return dataclasses.replace(team_plan, names=names, seconds=time.perf_counter() - began)
    search = _Orders(team, separation, alone, max(nodes // COARSER, 1_000))
    with showing("planning the team"):
        search.run(orders, np.random.default_rng(seed))
    found = search.answer()
    if tolerance is not None:
        with showing("proving what keeping apart costs"):
            found = with_tolls(team, found, tolerance, max_cells)
    return dataclasses.replace(found, names=names, seconds=time.perf_counter() - began)


def _checked(problems: object, separation: float) -> list[TimedProblem]:
    team: list[TimedProblem] = []
    given = problems.values() if isinstance(problems, Mapping) else problems
    for number, problem in enumerate(items("problems", given, "a list of TimedProblem")):
        instance(f"problem {number}", problem, TimedProblem, "TimedProblem(start, goal, …)")
        if problem.others and problem.separation != separation:
            kept = problem.separation
            msg = f"problem {number} keeps {kept:g} from others, and the team {separation:g}; give both the same"
            raise ProblemError(msg)
        team.append(dataclasses.replace(problem, separation=separation))
    if not team:
        msg = "problems is empty; give one for each UAV"
        raise ProblemError(msg)
    return team


class _Orders:
    """The search over orders, and its best team."""

    def __init__(self, team: list[TimedProblem], separation: float, alone: list[TimedPlan], nodes: int) -> None:
        self.team, self.separation, self.alone, self.nodes = team, separation, alone, nodes
        self.motions = [plan.motion for plan in alone]
        self.known: dict[object, tuple[TimedPlan, Trajectory | None]] = {}
        self.best: list[tuple[TimedPlan, Trajectory]] = []
        self.order: tuple[int, ...] = ()
        self.tried = 0

    def run(self, orders: int, rng: np.random.Generator) -> None:
        """Try orders, and improve the best team."""
        everyone = range(len(self.team))
        losses = [self._loss(i, self._around(i, [self.motions[j] for j in everyone if j != i])[0]) for i in everyone]
        order = tuple(sorted(everyone, key=lambda i: -losses[i]))
        seen: set[tuple[int, ...]] = set()
        while len(seen) < min(orders, math.factorial(len(self.team))):
            seen.add(order)
            losses = min((self._try(order, polite=polite) for polite in (False, True)), key=sum)
            if sum(losses) <= LEAST_LOSS * sum(plan.cost for plan in self.alone):
                break
            worst = max(everyone, key=lambda i: losses[i])
            order = (worst, *(i for i in order if i != worst))
            while order in seen and len(seen) < math.factorial(len(self.team)):
                order = tuple(int(i) for i in rng.permutation(len(self.team)))
        self.tried = len(seen)
        if self.best:
            self._improve()

    def answer(self) -> TeamPlan:
        """Return the best team, each flight as the oracle judges it among all others."""
        alone = tuple(self.alone)
        if not self.best:
            message = f"no flights that keep apart were found in {counted(self.tried, 'order')}; some may exist"
            return TeamPlan(Status.NOT_FOUND, (), alone, self.separation, orders=self.tried, message=message)
        motions = [motion for _, motion in self.best]
        plans = []
        for i, (plan, _) in enumerate(self.best):
            others = (*self.team[i].others, *motions[:i], *motions[i + 1 :])
            found = FoundFlight(plan.status, plan.trajectory, plan.departures, plan.evaluations, message=plan.message)
            seen = judged(dataclasses.replace(self.team[i], others=others), found, plan.solver, plan.seconds)
            plans.append(dataclasses.replace(seen, lower_bound=alone[i].lower_bound, certificate=alone[i].certificate))
        status = next((plan.status for plan in plans if not plan.status.has_path), Status.FOUND)
        evading = sum(plan.cost > own.cost for plan, own in zip(plans, alone, strict=True))
        pairs = itertools.combinations(motions, 2)
        return TeamPlan(
            status,
            tuple(plans) if status.has_path else (),
            alone,
            self.separation,
            min((least_distance(a, b)[0] for a, b in pairs), default=math.inf),
            self.order,
            self.tried,
            message=f"{evading} of {counted(len(plans), 'UAV')} cost more than alone, best of "
            f"{counted(self.tried, 'order')}",
        )

    def _loss(self, i: int, plan: TimedPlan) -> float:
        return plan.cost - self.alone[i].cost

    def _apart(self, motion: Trajectory, others: Sequence[Trajectory], distance: float) -> bool:
        return all(least_distance(motion, other)[0] >= distance for other in others)

    def _around(
        self, i: int, before: Sequence[Trajectory], after: Sequence[Trajectory] = ()
    ) -> tuple[TimedPlan, Trajectory | None]:
        """Return the flight of a UAV around others, at half the separation from those planned after it."""
        share = SHARE * self.separation
        if self._apart(self.motions[i], before, self.separation) and self._apart(self.motions[i], after, share):
            return self.alone[i], self.motions[i]
        key = (i, frozenset(map(id, before)), frozenset(map(id, after)))
        if key not in self.known:
            problem = dataclasses.replace(self.team[i], others=(*self.team[i].others, *before))
            began = time.perf_counter()
            found = Search(problem, self.nodes, tuple(after), share).run()
            plan = judged(problem, found, self.alone[i].solver, time.perf_counter() - began)
            self.known[key] = plan, plan.motion if plan.status.has_path else None
        return self.known[key]

    def _try(self, order: tuple[int, ...], *, polite: bool) -> list[float]:
        """Plan in an order, and return what each loses; infinite for the first without a flight."""
        losses = [0.0] * len(order)
        found: dict[int, tuple[TimedPlan, Trajectory]] = {}
        for place, i in enumerate(order):
            before = [motion for _, motion in found.values()]
            after = [self.motions[j] for j in order[place + 1 :]] if polite else []
            plan, motion = self._around(i, before, after)
            if motion is None and after:
                plan, motion = self._around(i, before)
            losses[i] = self._loss(i, plan)
            if motion is None:
                return losses
            found[i] = plan, motion
        team = [found[i] for i in range(len(order))]
        if not self.best or self._cost(team) < self._cost(self.best):
            self.best, self.order = team, order
        return losses

    def _cost(self, team: Sequence[tuple[TimedPlan, Trajectory]]) -> float:
        return sum(plan.cost for plan, _ in team)

    def _improve(self) -> None:
        """Plan each flight again around all others, those that lose most first."""
        for i in sorted(range(len(self.team)), key=lambda i: -self._loss(i, self.best[i][0])):
            plan, _ = self.best[i]
            if self._loss(i, plan) <= LEAST_LOSS * plan.cost:
                continue
            again, motion = self._around(i, [other for j, (_, other) in enumerate(self.best) if j != i])
            if motion is not None and again.cost < plan.cost:
                self.best[i] = again, motion
