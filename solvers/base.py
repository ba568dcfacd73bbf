"""Checks of settings, and traits that several solvers share."""

import dataclasses
import math
from collections.abc import Iterator
from contextlib import contextmanager
from types import NoneType
from typing import Annotated, Any, ClassVar, Literal, TypeAlias, get_args, get_origin

from cgla_graph._text import shown
from cgla_graph._validate import finite_number, non_negative_number, positive_number, whole_number
from cgla_graph.errors import ProblemError, SolverSettingError
from cgla_graph.model.lattice import Lattice
from cgla_graph.model.solver import Traits

#: Seeds have 32 bits.
LARGEST_SEED = 2**32 - 1


def library_traits(name: str, summary: str, *needs: str) -> Traits:
    """
    Return the traits of an exact search by a graph library that needs some packages.

    Examples
    --------
    >>> library_traits("igraph", "igraph.Graph.get_shortest_path", "igraph").exact
    True
    """
    return Traits(name, summary, domain="graph", exact=True, needs_positive=True, needs=needs)


def reactive_traits(name: str, summary: str, *, rasters: bool = False) -> Traits:
    """
    Return the traits of a step-by-step planner, which may get stuck; most see threats, but no rasters.

    Examples
    --------
    >>> reactive_traits("milp", "receding horizon").complete
    False
    """
    return Traits(name, summary, domain="plane", complete=False, rasters=rasters)


def ompl_traits(name: str, summary: str, *, anytime: bool = False) -> Traits:
    """
    Return the traits of OMPL's planners: seeded, in need of its package, and run in a process of their own.

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
    Name the solver in the message of a malformed setting.

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


@dataclasses.dataclass(frozen=True)
class Whole:
    """
    Check of a whole number within limits.

    Examples
    --------
    >>> Whole(1)("iterations", 100)
    100
    """

    at_least: int
    at_most: int = 10**9

    def __call__(self, name: str, value: object) -> int:
        """Return the value, or raise `ProblemError`."""
        return whole_number(name, value, at_least=self.at_least, at_most=self.at_most)


@dataclasses.dataclass(frozen=True)
class Between:
    """
    Check of a number within limits; `above` excludes the lower one.

    Examples
    --------
    >>> Between(0.0, 1.0)("epsilon", 1)
    1.0
    """

    low: float
    high: float
    above: bool = False

    def __call__(self, name: str, value: object) -> float:
        """Return the value as a float, or raise `ProblemError`."""
        number = finite_number(name, value)
        if not self.low <= number <= self.high or (self.above and number == self.low):
            least = f"above {self.low:g}" if self.above else f"of at least {self.low:g}"
            most = "" if self.high == math.inf else f" and at most {self.high:g}"
            msg = f"{name} is {number:g}; give a number {least}{most}"
            raise ProblemError(msg)
        return number


def _lattice(name: str, value: Any) -> Any:  # noqa: ANN401, ARG001 - called like other checks
    if not isinstance(value, Lattice):
        Lattice(value, bounds=(0.0, 0.0, 1.0, 1.0))
    return value


Positive: TypeAlias = Annotated[float, positive_number]
NonNegative: TypeAlias = Annotated[float, non_negative_number]
Count: TypeAlias = Annotated[int, Whole(1)]
Evaluations: TypeAlias = Annotated[int, Whole(1, 10**15)]
Seed: TypeAlias = Annotated[int, Whole(0, LARGEST_SEED)]
#: OMPL refuses 0.
OmplSeed: TypeAlias = Annotated[int, Whole(1, LARGEST_SEED)]
Resolution: TypeAlias = Annotated[int | tuple[int, int] | Lattice, _lattice]


class Settings:
    """
    Base of solvers, dataclasses of settings: checks each setting by the annotation of its field.

    ``Annotated[float, check]`` calls ``check(name, value)``, which returns the value or raises `ProblemError`. A `bool`
    is True or False, a `Literal` one of its values. None passes where the annotation allows it.

    Raises
    ------
    SolverSettingError
        If a setting is out of range.

    Examples
    --------
    >>> @dataclasses.dataclass(frozen=True)
    ... class Wander(Settings):
    ...     steps: Count | None = 100
    ...     traits: ClassVar[Traits] = Traits("wander", "goes anywhere", domain="plane")
    >>> Wander(steps=0)
    Traceback (most recent call last):
    cgla_graph.errors.SolverSettingError: wander: steps is 0; give a whole number from 1 to 1000000000 (or None)
    """

    traits: ClassVar[Traits]

    def __post_init__(self) -> None:
        """Check the settings."""
        with settings_of(self.traits.name):
            for setting in dataclasses.fields(self):  # type: ignore[arg-type] # of classes below
                value = _checked(setting.name, setting.type, getattr(self, setting.name))
                object.__setattr__(self, setting.name, value)


def _checked(name: str, hint: Any, value: Any) -> Any:  # noqa: ANN401 - any setting
    """Return a setting as its field holds it, or raise `ProblemError`."""
    if NoneType in get_args(hint):
        if value is None:
            return None
        try:
            return _checked(name, get_args(hint)[0], value)
        except ProblemError as error:
            msg = f"{error} (or None)"
            raise ProblemError(msg) from error
    if get_origin(hint) is Literal and value not in get_args(hint):
        msg = f"unknown {name} {shown(value)}; choose {', '.join(get_args(hint))}"
        raise ProblemError(msg)
    if hint is bool and not isinstance(value, bool):
        msg = f"{name} is {shown(value)}; give True or False"
        raise ProblemError(msg)
    return hint.__metadata__[0](name, value) if get_origin(hint) is Annotated else value
