"""What a solver is: settings, traits and one method."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from typing import ClassVar, Literal, Protocol, TypeAlias, get_args, runtime_checkable

from cgla_graph._validate import non_negative_number, positive_number, whole_number
from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.problem import GraphProblem, Problem
from cgla_graph.model.solution import Solution


@dataclass(frozen=True)
class Traits:
    """
    What a solver is and promises; the contract checks hold it to that.

    Attributes
    ----------
    name
        Its name in the registry, kebab-case.
    summary
        One line for `cgla solvers`.
    domain
        ``graph``: takes a `GraphProblem`; ``plane``: takes a `Problem`.
    exact
        Whether its path always has least cost on the graph it is given (graph solvers).
    anytime
        Whether it records its best cost over time in `Solution.trace`.
    seeded
        Whether it draws random numbers; then it has a setting ``seed`` and the same seed gives the same path.
    no_fly
        Whether it plans around no-fly areas; if not, its path may turn out infeasible.
    complete
        Whether it can be expected to find a path where there is one, given time; if not, it may get stuck, and says
        how.
    needs
        Packages beyond those that the toolkit always has.
    isolated
        Whether it runs compiled code of others that may crash or hang. Then `cgla_graph.solve` and missions run it in a
        process of its own (see `cgla_graph.model.isolated`), to which it and its problem are sent: their classes have
        to be in modules. A run that exceeds its setting ``seconds`` by more than a tenth and 2 s is stopped; one
        without such a setting, after 600 s.

    Examples
    --------
    >>> Traits("mine", "a solver of mine", domain="plane").seeded
    False
    """

    name: str
    summary: str
    domain: Literal["graph", "plane"]
    exact: bool = False
    anytime: bool = False
    seeded: bool = False
    no_fly: bool = True
    complete: bool = True
    needs: tuple[str, ...] = ()
    isolated: bool = False


@runtime_checkable
class GraphSolver(Protocol):
    """A frozen dataclass of settings that plans on a graph, of which it knows nothing but nodes and weights."""

    traits: ClassVar[Traits]

    def solve(self, problem: GraphProblem) -> Solution:
        """Return status, nodes and its own idea of the cost; the oracle does the rest."""
        ...


@runtime_checkable
class PlaneSolver(Protocol):
    """A frozen dataclass of settings that plans in the plane."""

    traits: ClassVar[Traits]

    def solve(self, problem: Problem) -> Solution:
        """Return status, waypoints and its own idea of the cost; the oracle does the rest."""
        ...


Solver: TypeAlias = GraphSolver | PlaneSolver


#: OMPL's random numbers start from 32 bits, and refuse 0.
LARGEST_SEED = 2**32 - 1


@contextmanager
def settings_of(solver: str) -> Iterator[None]:
    """
    Say of what is malformed inside that it is a setting of a solver.

    Raises
    ------
    SolverSettingError
        For every `ProblemError` inside.

    Examples
    --------
    >>> with settings_of("rrt-star"):
    ...     _ = positive_number("rewire_factor", 1)
    """
    try:
        yield
    except ProblemError as error:
        msg = f"{solver}: {error}"
        raise SolverSettingError(msg) from error


def whole_setting(solver: str, name: str, value: object, *, at_least: int, at_most: int = 10**9) -> int:
    """
    Return a setting that must be a whole number.

    Raises
    ------
    SolverSettingError
        If it is not, or is out of range.

    Examples
    --------
    >>> whole_setting("rrt-star", "iterations", 100, at_least=1)
    100
    """
    with settings_of(solver):
        return whole_number(name, value, at_least=at_least, at_most=at_most)


def positive_setting(solver: str, name: str, value: float) -> float:
    """
    Return a setting that must be a number above 0.

    Raises
    ------
    SolverSettingError
        If it is not.

    Examples
    --------
    >>> positive_setting("rrt-star", "rewire_factor", 1)
    1.0
    """
    with settings_of(solver):
        return positive_number(name, value)


def non_negative_setting(solver: str, name: str, value: float) -> float:
    """
    Return a setting that must be a number of at least 0: a gain, which 0 turns off.

    Raises
    ------
    SolverSettingError
        If it is not.

    Examples
    --------
    >>> non_negative_setting("bcv-style", "risk_aversion", 0)
    0.0
    """
    with settings_of(solver):
        return non_negative_number(name, value)


def check_lattice(solver: str, resolution: int | tuple[int, int] | Lattice | None, corner_rule: CornerRule) -> None:
    """
    Check the settings of a solver that lays a lattice of its own.

    Raises
    ------
    SolverSettingError
        If the resolution is below 2, or the rule is unknown.

    Examples
    --------
    >>> check_lattice("eight-direction", 20, "touch")
    """
    if corner_rule not in get_args(CornerRule):
        msg = f"{solver}: unknown corner_rule {corner_rule!r}; choose touch or both-free"
        raise SolverSettingError(msg)
    if resolution is None or isinstance(resolution, Lattice):
        return
    with settings_of(solver):
        Lattice(resolution, bounds=(0.0, 0.0, 1.0, 1.0))
