"""
A solver's answer: a status, a path and its numbers.

A lower bound is proven by whom, and of which paths:

- by a `cgla_graph.Certificate`: of all paths in the plane, on the Earth where the map is in degrees;
- by a solver of this package whose traits say so (`Traits.proves`), or which ends at the optimum of a graph: of all
  paths of its domain, that is in the plane or on its graph. A bound of a lattice's paths is none of those in the plane.

Every other bound is a claim, kept as `Solution.claimed_bound`; a feasible path that costs less refutes it (`refuted`).
"""

import math
import os
from collections.abc import Sequence, Sized
from dataclasses import dataclass, field, replace
from enum import Enum
from pathlib import Path
from typing import Any, cast

import numpy as np

from cgla_graph._display import Plottable
from cgla_graph._lazy import function_above
from cgla_graph._text import remark
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance
from cgla_graph.errors import ProblemError
from cgla_graph.model.adjacency import Node
from cgla_graph.model.earth import LocalProjection, degrees_of
from cgla_graph.model.path_file import save_path


class Status(Enum):
    """
    How a solver's run ended; the value is the sentence.

    Examples
    --------
    >>> Status.NO_PATH.label, Status.NO_PATH.value
    ('no-path', 'no path exists on the graph')
    """

    OPTIMAL = "the path has least cost on its graph"
    FOUND = "a path was found"
    NO_PATH = "no path exists on the graph"
    NOT_FOUND = "no path was found within the budget"
    STUCK = "the planner got stuck on its way to the goal"
    INFEASIBLE = "the path crosses a no-fly area, comes too near to one, or leaves the bounds"
    UNSUPPORTED = "the solver cannot take this problem"
    FAILED = "the solver failed, or its answer does not stand up to the oracle"
    TIMED_OUT = "the run was stopped at its time limit"
    OUT_OF_MEMORY = "the run was stopped at its memory limit"
    CRASHED = "the solver took its process down"
    UNAVAILABLE = "the solver lacks a package or a file that it needs"

    @property
    def label(self) -> str:
        """Short form for tables and files."""
        return self.name.lower().replace("_", "-")

    @property
    def has_path(self) -> bool:
        """Whether there is a feasible path."""
        return self in {Status.OPTIMAL, Status.FOUND}

    @property
    def is_path(self) -> bool:
        """Alias of `has_path`."""
        return self.has_path


@dataclass(frozen=True)
class TracePoint:
    """
    The best cost of an anytime solver at one moment.

    Attributes
    ----------
    seconds
        Time since the solver started.
    evaluations
        Segments weighed by Eq. 5 so far.
    cost
        Best cost so far, map units; infinite before the first path.
    """

    seconds: float
    evaluations: int
    cost: float


#: Most waypoints of a solver's path, and most points of its trace.
MOST_WAYPOINTS, MOST_TRACE = 100_000, 100_000
#: Default of the greatest gap between a lower bound and the cost of a path, as a ratio.
TOLERANCE = 0.005
#: A path refutes a bound if it costs less by more than this, relative to its cost.
BOUND_TOLERANCE = 1e-9
#: Message where the assumption of Theorem 1 fails.
NEGATIVE_WEIGHTS = "weights below 0, where no search is known to end at the optimum (Theorem 1 needs positive ones)"


@dataclass(frozen=True, eq=False)
class Solution(Plottable):
    """
    The answer of a solver; the oracle computes all numbers that measure the path.

    Attributes
    ----------
    status
        How the run ended.
    path
        Waypoints, shape ``(m, 2)``, map units; empty without a path, or on a graph without positions.
    nodes
        The nodes of the path, where it was found on a graph.
    cost, length, risk
        Numbers of the path; ``cost = length + k * risk``, length in map units, measured on the plane along legs that
        are straight there (`Problem.stretch` bounds how much longer that is than on the Earth). Infinite without a
        path; length and risk are NaN where a graph does not give them.
    clearance
        Least distance to the no-fly area, map units; infinite without one.
    lower_bound
        A proven lower bound of the cost of every path, on the Earth where the map is in degrees; NaN where none is
        proven. On a `GraphProblem`, of every path on the graph.
    claimed_bound
        A lower bound that the solver claims and this package has not proven, map units; NaN without one. `gap` does not
        use it. A feasible path that costs less makes the answer ``FAILED``.
    solver
        Name of the solver.
    seconds
        Time to solve; `build_seconds` is the time before that, to weigh the graph.
    certificate_seconds
        Time to prove `lower_bound`, not counted in `seconds`.
    evaluations
        Pairs of points whose cost was computed: segments weighed while solving, and the pairs of the graph
        (`GeometricGraph.n_pairs`).
    trace
        Best cost over time, for anytime solvers.
    message
        A remark on the answer, in one line.
    problem
        The `Problem` or `GraphProblem` that it solves, for pictures; None in a copy from another process or a file.
    certificate
        The `cgla_graph.Certificate` of `lower_bound`; None where there is none, and in such a copy.
    projection
        The projection from longitude and latitude to map units; None on a map in the plane.
    """

    status: Status
    path: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    nodes: Sequence[Node] = ()
    cost: float = np.inf
    length: float = np.inf
    risk: float = np.inf
    clearance: float = np.nan
    lower_bound: float = np.nan
    claimed_bound: float = field(default=np.nan, kw_only=True)
    solver: str = ""
    seconds: float = 0.0
    build_seconds: float = 0.0
    certificate_seconds: float = 0.0
    evaluations: int = 0
    trace: tuple[TracePoint, ...] = ()
    message: str = ""
    problem: Any = field(default=None, repr=False, kw_only=True)
    certificate: Any = field(default=None, repr=False, kw_only=True)
    projection: LocalProjection | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        """Check the status, on which all else depends."""
        if not isinstance(self.status, Status):
            named = isinstance(self.status, str) and self.status.upper().replace("-", "_") in Status.__members__
            wanted = f"Status.{self.status.upper().replace('-', '_')}" if named else "a Status, as Status.FOUND"
            instance("a solution's status", self.status, Status, wanted)

    @property
    def lonlat(self) -> FloatArray:
        """
        Waypoints as longitude and latitude, degrees, shape ``(m, 2)``.

        Raises
        ------
        ProblemError
            If the map is in the plane: the path has only x and y.

        Examples
        --------
        >>> Solution(Status.FOUND, path=np.zeros((1, 2)), projection=LocalProjection(24.0, 60.0)).lonlat.tolist()
        [[24.0, 60.0]]
        """
        if self.projection is None:
            msg = "the map is in the plane, so that its paths have no longitudes and latitudes; take solution.path"
            raise ProblemError(msg)
        return degrees_of(self.path, self.projection)

    def flyable(
        self, turn_radius: float, *, start_heading: float | None = None, goal_heading: float | None = None
    ) -> Any:  # noqa: ANN401 - a `Flyable`, which is a solution: its module stands above this one
        """
        Plan a path of lines and arcs with a least turn radius, as `cgla_graph.flyable` does.

        Examples
        --------
        >>> import cgla_graph as cg
        >>> cg.solve(cg.Problem((0.1, 0.1), (0.9, 0.9))).flyable(turn_radius=0.1).status.label
        'found'
        """
        make = function_above("flyable")
        return make(self, turn_radius, start_heading=start_heading, goal_heading=goal_heading)

    def save(self, file: str | os.PathLike[str]) -> Path:
        """
        Write the path to a file: ``.csv``, ``.json`` (with its numbers), or ``.geojson`` on a map in lon/lat.

        On a map in degrees, longitudes and latitudes are written too.

        Parameters
        ----------
        file
            The file; its ending gives the format.

        Returns
        -------
        file
            The path of the file.

        Raises
        ------
        OutputError
            If there is no path, the ending is unknown, the map of a GeoJSON file is in the plane, or the file cannot be
            written.

        Examples
        --------
        >>> import tempfile
        >>> with tempfile.TemporaryDirectory() as folder:
        ...     file = Solution(Status.FOUND, path=np.array([[0.0, 0.5], [1.0, 1.0]])).save(f"{folder}/path.csv")
        ...     file.read_text().split()
        ['x,y', '0.0,0.5', '1.0,1.0']
        """
        names = ("cost", "length", "risk", "clearance", "lower_bound", "claimed_bound", "gap")
        numbers: dict[str, object] = {"solver": self.solver, "status": self.status.label}
        return save_path(
            file, self.path, self.projection, numbers | {name: float(getattr(self, name)) for name in names}
        )

    def __getstate__(self) -> dict[str, Any]:
        """Leave problem and certificate out of copies for other processes, as they may be large."""
        return {name: value for name, value in self.__dict__.items() if name not in {"problem", "certificate"}}

    @property
    def gap(self) -> float:
        """
        The greatest possible excess over the optimum, ``cost / lower_bound - 1``; NaN without a proven bound.

        Examples
        --------
        >>> round(Solution(Status.FOUND, cost=1.1, lower_bound=1.0).gap, 3)
        0.1
        """
        return gap_between(self.cost, self.lower_bound)

    @property
    def total_seconds(self) -> float:
        """
        The time to weigh the graph and to solve, without the time to prove `lower_bound`.

        Examples
        --------
        >>> Solution(Status.FOUND, seconds=1.5, build_seconds=0.5, certificate_seconds=9.0).total_seconds
        2.0
        """
        return self.build_seconds + self.seconds


def with_claims(solution: Solution, problem: object) -> Solution:
    """
    Take the bounds of an answer for claims, unless its certificate is of this problem.

    Parameters
    ----------
    solution
        An answer to be judged. If it is the judged answer to another problem, its bounds are of other paths.
    problem
        The problem that it is judged on.

    Returns
    -------
    solution
        Without claims that are not finite, and without any where there is no path.

    Examples
    --------
    >>> with_claims(Solution(Status.FOUND, cost=2.0, lower_bound=1.5), None)
    Solution(status=found, cost=2, claimed_bound=1.5)
    """
    instance("solution", solution, Solution, "a Solution, as Solution(Status.FOUND, path=waypoints)")
    proof = solution.certificate
    if proof is not None and proof.problem is problem and not solution.lower_bound > proof.lower_bound:
        return solution
    is_other = solution.problem is not None and solution.problem is not problem
    given = () if is_other or not solution.status.has_path else (solution.lower_bound, solution.claimed_bound)
    claims = [claim for claim in map(_number, given) if math.isfinite(claim)]
    return replace(solution, lower_bound=np.nan, claimed_bound=max(claims, default=np.nan), certificate=None)


def is_refuted(cost: float, bound: float) -> bool:
    """
    Return whether a path of a cost refutes a lower bound, by more than rounding.

    Examples
    --------
    >>> is_refuted(1.0, 1.1), is_refuted(1.0, 1.0)
    (True, False)
    """
    return bound > cost + BOUND_TOLERANCE * abs(cost)


def refuted(solution: Solution, cost: float, whose: str) -> Solution:
    """
    Fail an answer whose claimed bound is above the cost of a feasible path.

    Parameters
    ----------
    solution
        The answer.
    cost
        The cost of a feasible path of the same problem; infinite without one.
    whose
        The path, for the message.

    Examples
    --------
    >>> refuted(Solution(Status.FOUND, cost=3.0, claimed_bound=3.0), 2.0, "that of hybrid").message
    'the solver says that no path costs less than 3, that of hybrid costs 2'
    """
    claim = solution.claimed_bound
    if not is_refuted(cost, claim):
        return solution
    message = f"the solver says that no path costs less than {claim:.9g}, {whose} costs {cost:.9g}"
    return replace(solution, status=Status.FAILED, claimed_bound=np.nan, message=message)


def _number(value: Any) -> float:  # noqa: ANN401 - any answer of a solver
    try:
        return float(value)
    except (TypeError, ValueError, OverflowError):
        return math.nan


def contained(solution: Solution, most_nodes: int = MOST_WAYPOINTS) -> Solution:
    """
    Return an answer of limited size, so that no process has to send, hold or store an endless one.

    A path above the limit makes the answer a failure; of a longer trace the first points and the last one are kept, and
    a message becomes one line (`cgla_graph._text.remark`).

    Parameters
    ----------
    solution
        A solver's answer.
    most_nodes
        Most nodes of its path on a graph.

    Examples
    --------
    >>> contained(Solution(Status.FOUND, path=np.zeros((3_000_000, 2)))).message
    'its path has 3,000,000 waypoints; at most 100,000 are taken: leave out those between which it is straight'
    """
    message = "" if cast("object", solution.message) is None else remark(solution.message)
    trace = solution.trace
    if _count(trace) > MOST_TRACE:
        trace = (*trace[: MOST_TRACE - 1], trace[-1])
    n_points, n_nodes = _count(solution.path), _count(solution.nodes)
    if n_points <= MOST_WAYPOINTS and n_nodes <= most_nodes:
        return replace(solution, trace=trace, message=message)
    long, most = (n_points, MOST_WAYPOINTS) if n_points > MOST_WAYPOINTS else (n_nodes, most_nodes)
    if solution.status.has_path:
        remedy = "leave out those between which it is straight" if long == n_points else "visit no node twice"
        message = f"its path has {long:,} waypoints; at most {most:,} are taken: {remedy}"
    status = Status.FAILED if solution.status.has_path else solution.status
    return replace(solution, status=status, path=np.empty((0, 2)), nodes=(), trace=trace, message=message)


def _count(points: Any) -> int:  # noqa: ANN401 - what a solver answers
    """Count points, of an array by its size: its shape may be wrong."""
    size = getattr(points, "size", None)
    return size // 2 if isinstance(size, int) else len(points) if isinstance(points, Sized) else 0


def gap_between(cost: float, lower_bound: float) -> float:
    """
    Return ``cost / lower_bound - 1``; NaN without a bound, infinite where it is 0 and the cost is not.

    Examples
    --------
    >>> gap_between(0.0, 0.0), gap_between(1.0, 0.0), gap_between(3.0, 2.0)
    (0.0, inf, 0.5)
    """
    if math.isnan(lower_bound):
        return math.nan
    if lower_bound <= 0.0:
        return 0.0 if cost == 0.0 else math.inf
    return cost / lower_bound - 1.0
