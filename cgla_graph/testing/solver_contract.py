"""The contract of solvers as tests of pytest, one test for each check."""

from collections.abc import Callable, Iterable
from typing import Any, TypeVar

from cgla_graph.model.solver import Solver
from cgla_graph.solvers.checks import solver_checks
from cgla_graph.solvers.registry import ready

TestT = TypeVar("TestT", bound=Callable[..., Any])


def parametrize_with_checks(solvers: Iterable[Solver | str]) -> Callable[[TestT], TestT]:
    """
    Decorate a test of pytest so that it runs once for each check of each solver.

    The test takes `solver` and `check`, and calls ``check(solver)``.

    Parameters
    ----------
    solvers
        Instances of your solvers, or names of registered ones.

    Raises
    ------
    ProblemError
        If one of them is no solver, or no solver has the name.

    Examples
    --------
    >>> @parametrize_with_checks(["straight-line"])
    ... def test_contract(solver, check):
    ...     check(solver)
    >>> [mark.name for mark in test_contract.pytestmark]
    ['parametrize']
    """
    import pytest  # noqa: PLC0415 - the other functions of this package do without it

    cases = [
        pytest.param(solver, check, id=f"{solver.traits.name}-{check}")
        for solver in (ready(one, {}) for one in solvers)
        for check in solver_checks(solver)
    ]
    decorate: Callable[[TestT], TestT] = pytest.mark.parametrize(("solver", "check"), cases)
    return decorate
