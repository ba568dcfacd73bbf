"""What solvers share: the checks of their settings, and the traits of OMPL's planners."""

from collections.abc import Iterator
from contextlib import contextmanager
from typing import get_args

from cgla_graph._text import shown
from cgla_graph._validate import non_negative_number, positive_number, whole_number
from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.model.adjacency import CornerRule
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solver import Traits

#: OMPL's random numbers start from 32 bits, and refuse 0.
LARGEST_SEED = 2**32 - 1


def ompl_traits(name: str, summary: str, *, anytime: bool = False) -> Traits:
    """
    Return what all planners of OMPL are: seeded, in need of its package, and in a process of their own.

    Examples
    --------
    >>> ompl_traits("rrt-star", "OMPL's RRT*").isolated
    True
    """
    return Traits(
        name,
        summary,
        domain="plane",
        anytime=anytime,
        seeded=True,
        needs=("ompl",),
        isolated=True,
        needs_positive=True,
    )


@contextmanager
def settings_of(solver: str) -> Iterator[None]:
    """
    Turn errors raised inside into a `SolverSettingError`.

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


def limit_setting(solver: str, name: str, value: float | None) -> None:
    """
    Check a limit of time: a number above 0, or None for no limit.

    Raises
    ------
    SolverSettingError
        If it is neither.

    Examples
    --------
    >>> limit_setting("rrt-star", "seconds", None)
    """
    if value is None:
        return
    try:
        positive_number(name, value)
    except ProblemError as error:
        msg = f"{solver}: {error} (or None, for no limit)"
        raise SolverSettingError(msg) from error


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
        msg = f"{solver}: unknown corner_rule {shown(corner_rule)}; choose touch or both-free"
        raise SolverSettingError(msg)
    if resolution is None or isinstance(resolution, Lattice):
        return
    with settings_of(solver):
        Lattice(resolution, bounds=(0.0, 0.0, 1.0, 1.0))
