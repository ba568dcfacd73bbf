"""A check that a solver does not change its problem."""

import zlib
from collections.abc import Iterator
from contextlib import contextmanager

import numpy as np

from cgla_graph.errors import SolverFaultError


@contextmanager
def unchanged(problem: object, solver: str) -> Iterator[None]:
    """
    Check that the body does not change a problem.

    Parameters
    ----------
    problem
        A `Problem` or a `GraphProblem`.
    solver
        The name of the solver that runs in the body.

    Raises
    ------
    SolverFaultError
        If a part of the problem was replaced; cached values do not count as a change.

    Examples
    --------
    >>> from cgla_graph.model.problem import Problem
    >>> problem = Problem((0, 0), (1, 1))
    >>> with unchanged(problem, "mine"):
    ...     object.__setattr__(problem, "k", 2.0)
    Traceback (most recent call last):
    cgla_graph.errors.SolverFaultError: mine changed its problem (k); have it work on a copy
    """
    before = dict(_parts(problem, (), set()))
    yield
    after = dict(_parts(problem, (), set()))
    for place, part in before.items():
        # (lazy attributes are private, and None at first)
        if not _same(part, after.get(place)) and not (part is None and place[-1].startswith("_")):
            msg = f"{solver} changed its problem ({'.'.join(place)}); have it work on a copy"
            raise SolverFaultError(msg)


def _parts(thing: object, place: tuple[str, ...], seen: set[int]) -> Iterator[tuple[tuple[str, ...], object]]:
    """Yield the parts of an object by the attributes that lead to them, each once; arrays as shapes and checksums."""
    if isinstance(thing, np.ndarray):
        yield place, (thing.shape, zlib.crc32(np.ascontiguousarray(thing).data))
    elif isinstance(thing, tuple) and any(map(_is_made_of_parts, thing[:1])):
        yield place, len(thing)
        for number, part in enumerate(thing):
            yield from _parts(part, (*place, str(number)), seen)
    elif not _is_made_of_parts(thing):
        yield place, thing
    elif id(thing) not in seen:
        seen.add(id(thing))
        for name in [*getattr(thing, "__slots__", ()), *getattr(thing, "__dict__", ())]:
            yield from _parts(getattr(thing, name), (*place, name), seen)


def _is_made_of_parts(thing: object) -> bool:
    return isinstance(thing, np.ndarray) or type(thing).__module__.startswith(("cgla_graph.", "scipy.sparse"))


def _same(one: object, other: object) -> bool:
    return one is other or (type(one) is type(other) and bool(one == other))
