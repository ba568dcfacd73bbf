"""What the options of the command line mean: entrants, scenarios, points and the tolerance."""

import dataclasses
import math
import re
from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, TypeVar

from cgla_graph._types import Bounds, Point
from cgla_graph.comparisons.study.entrant import Entrant, check_settings, every_solver, parse_budget
from cgla_graph.comparisons.study.runner import TOLERANCE
from cgla_graph.comparisons.workers.limits import Limits
from cgla_graph.errors import CglaError
from cgla_graph.model.lattice import Lattice
from cgla_graph.scenarios.loading import open_scenarios
from cgla_graph.scenarios.scenario import Scenario

if TYPE_CHECKING:
    from cgla_graph.scenarios.mission_file import MissionFile

NamedT = TypeVar("NamedT", Scenario, "MissionFile")


def read_entrants(text: str | None, *, budget: str | None = None, refine: bool = False) -> list[Entrant]:
    """
    Read ``--solvers``, with the budget and the refinement of all.

    Parameters
    ----------
    text
        Solvers as in `Entrant.parse`, separated by commas; None for all. Those named twice enter once.
    budget
        As in `parse_budget`, or None.
    refine
        Whether paths are refined.

    Raises
    ------
    CglaError
        If it names no solver, or something is wrong with one, its settings or the budget.

    Examples
    --------
    >>> [entrant.label for entrant in read_entrants("cgla,dijkstra,cgla", refine=True)]
    ['cgla+refine', 'dijkstra+refine']
    """
    chosen = every_solver() if text is None else [Entrant.parse(part) for part in _parts(text)]
    if not chosen:
        msg = "--solvers names no solver; cgla solvers lists them"
        raise CglaError(msg)
    if budget is not None:
        limits = parse_budget(budget)
        chosen = [entrant.with_budget(limits) for entrant in chosen]
    if refine:
        chosen = [entrant.refined() for entrant in chosen]
    return list({entrant.label: entrant for entrant in chosen}.values())


def _parts(text: str) -> list[str]:
    """Split at commas; one inside brackets belongs to a setting."""
    parts = (part.strip() for part in re.split(r",(?![^(\[]*[)\]])", text))
    return [part for part in parts if part]


def read_highlighted(text: str | None, entrants: Sequence[Entrant]) -> frozenset[str]:
    """
    Read ``--highlight``: which entrants stand out in pictures.

    Parameters
    ----------
    text
        Their labels, or names for all of that name, separated by commas; None for none.
    entrants
        Those that are compared.

    Returns
    -------
    labels
        Their labels.

    Raises
    ------
    CglaError
        If one of them is not compared.

    Examples
    --------
    >>> sorted(read_highlighted("cgla", [Entrant.parse("cgla:schedule=sweeps"), Entrant.parse("dijkstra")]))
    ['cgla:schedule=sweeps']
    """
    found: set[str] = set()
    for part in _parts(text or ""):
        labels = {one.label for one in entrants if part in {one.label, one.name}}
        if not labels:
            known = ", ".join(one.label for one in entrants)
            msg = f"--highlight has {part!r}, which is not compared; give some of {known}"
            raise CglaError(msg)
        found |= labels
    return frozenset(found)


def read_entrant(text: str, *, refine: bool = False) -> Entrant:
    """Read ``--solver`` (see `Entrant.parse` for the errors)."""
    entrant = Entrant.parse(text)
    return entrant.refined() if refine else entrant


def read_tolerance(tolerance: float | None, *, certify: bool = True) -> float | None:
    """
    Read ``--tolerance`` and ``--no-certificate``.

    Raises
    ------
    CglaError
        If the tolerance is negative or no number.

    Examples
    --------
    >>> read_tolerance(None), read_tolerance(0.0), read_tolerance(0.1, certify=False)
    (0.005, None, None)
    """
    if tolerance is None:
        tolerance = TOLERANCE
    if not 0.0 <= tolerance < math.inf:
        msg = f"--tolerance is {tolerance:g}; give a ratio above 0, as 0.005, or 0 for no lower bound"
        raise CglaError(msg)
    return tolerance if certify and tolerance > 0.0 else None


def open_all(
    specs: Sequence[str],
    start: str | None = None,
    goal: str | None = None,
    resolution: int | None = None,
    bounds: str | None = None,
) -> Iterator[Scenario]:
    """
    Open scenarios, with other ends, another lattice or other bounds where asked for.

    Parameters
    ----------
    specs
        Names and files, as in `cgla_graph.scenarios.loading.open_scenarios`.
    start, goal
        ``X,Y`` instead of the scenario's, or None.
    resolution
        Points a side of a closed lattice instead of the scenario's, or None.
    bounds
        ``X_MIN,Y_MIN,X_MAX,Y_MAX`` (of degrees ``WEST,SOUTH,EAST,NORTH``) instead of the scenario's, or None.

    Raises
    ------
    CglaError
        If anything is wrong with any of them.
    """
    ends, box = (_point("--start", start), _point("--goal", goal)), _box("--bounds", bounds)
    for spec in specs:
        for scenario in open_scenarios(spec, start=ends[0], goal=ends[1], bounds=box):
            check_settings(scenario)
            if resolution is None:
                yield scenario
            else:
                yield dataclasses.replace(scenario, lattice=Lattice(resolution, bounds=scenario.problem.bounds))


def open_one(
    command: str,
    spec: str,
    start: str | None = None,
    goal: str | None = None,
    resolution: int | None = None,
    bounds: str | None = None,
) -> Scenario:
    """
    Open the one scenario that a command takes.

    Raises
    ------
    CglaError
        If anything is wrong with it, or there is more than one (arguments as `open_all`).
    """
    opened = list(open_all([spec], start, goal, resolution, bounds))
    if len(opened) != 1:
        msg = f"{spec} has {len(opened)} rows; {command} takes one, as FILE.scen:ROW"
        raise CglaError(msg)
    return opened[0]


def read_limits(text: str | None) -> Limits:
    """
    Read ``--limits``: ``seconds=60,memory=2048``, one of them or both; None for the usual ones.

    Raises
    ------
    CglaError
        If it is anything else; memory is in units of 2**20 bytes.

    Examples
    --------
    >>> read_limits("seconds=60").seconds, read_limits("memory=512").megabytes
    (60.0, 512.0)
    """
    fields = {"seconds": "seconds", "memory": "megabytes"}
    given: dict[str, float] = {}
    for part in [] if text is None else text.split(","):
        key, equals, value = (word.strip() for word in part.partition("="))
        try:
            number = float(value)
        except ValueError:
            number = math.nan
        if not equals or key not in fields or fields[key] in given or not 0.0 < number < math.inf:
            msg = f"--limits has {part.strip()!r}; give seconds=S, memory=MEGABYTES or both, once and above 0"
            raise CglaError(msg)
        given[fields[key]] = number
    return Limits(**given)


def number_names(scenarios: Iterable[NamedT]) -> list[NamedT]:
    """
    Give scenarios, or missions, numbers where their name is taken, so that their rows can be told apart.

    All of them are opened before any work, so that a fault in the last one is found first.
    """
    last: dict[str, int] = {}
    found = []
    for scenario in scenarios:
        name, number = scenario.name, last.get(scenario.name, 0)
        while name in last:
            number += 1
            name = f"{scenario.name}-{number}"
        last[scenario.name] = max(number, 1)
        last.setdefault(name, 1)
        found.append(scenario if name == scenario.name else dataclasses.replace(scenario, name=name))
    return found


def _point(option: str, text: str | None) -> Point | None:
    if text is None:
        return None
    try:
        x, y = (float(part) for part in text.split(","))
    except ValueError as error:
        msg = f"{option} is {text!r}; give two numbers, X,Y"
        raise CglaError(msg) from error
    return x, y


def _box(option: str, text: str | None) -> Bounds | None:
    if text is None:
        return None
    try:
        x_min, y_min, x_max, y_max = (float(part) for part in text.split(","))
    except ValueError as error:
        msg = f"{option} is {text!r}; give four numbers, X_MIN,Y_MIN,X_MAX,Y_MAX (degrees: WEST,SOUTH,EAST,NORTH)"
        raise CglaError(msg) from error
    return x_min, y_min, x_max, y_max
