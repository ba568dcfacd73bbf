"""The best of several altitudes of a flight: a path and a bound at each, and a bound over all of them."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any, Final

from cgla_graph._progress import waiting
from cgla_graph._text import ShortRepr, json_number, listed
from cgla_graph._validate import kind_of, number_array
from cgla_graph.errors import CglaError, ProblemError, ScenarioError
from cgla_graph.model.problem import Problem
from cgla_graph.model.solution import TOLERANCE, Solution, Status
from cgla_graph.model.solver import Solver
from cgla_graph.scenarios.scenario import Scenario, as_scenario
from cgla_graph.solvers import registry
from cgla_graph.solvers.solving import proven
from cgla_graph.solvers.trade_off.reweighing import solve_or_fail

#: Altitudes, at most.
MOST_ALTITUDES: Final = 100
#: Names of areas that a table has, at most.
_MOST_NAMED: Final = 3


@dataclass(frozen=True, eq=False)
class AtAltitude(ShortRepr):
    """
    The path at one altitude.

    Attributes
    ----------
    altitude
        The altitude, metres.
    solution
        The path and its bound. If the map has none, as start or goal is closed, there is no path, and the bound is
        infinite; the message says why.
    scenario
        The map at this altitude; None if start or goal is closed.
    closed
        Names of the zones that are closed, and of terrain.
    """

    altitude: float
    solution: Solution
    scenario: Scenario | None = field(default=None, repr=False)
    closed: tuple[str, ...] = field(default=(), repr=False)

    def document(self, everywhere: frozenset[str] = frozenset()) -> dict[str, Any]:
        """Return it as JSON; numbers that are not finite are None. Zones closed at all altitudes are not named."""
        found = self.solution
        return {
            "altitude": self.altitude,
            "status": found.status.label,
            **{key: json_number(getattr(found, key)) for key in ("cost", "lower_bound", "gap", "length", "risk")},
            "no_path": math.isinf(found.lower_bound),
            "closed": len(self.closed),
            "closed_here": [name for name in self.closed if name not in everywhere],
            "message": found.message,
        }


@dataclass(frozen=True, eq=False)
class BestAltitude(ShortRepr):
    """
    The paths at several altitudes.

    Attributes
    ----------
    paths
        One per altitude, in the order that was given.
    """

    paths: tuple[AtAltitude, ...]

    @property
    def best(self) -> AtAltitude | None:
        """The cheapest path, the first of equal ones; None if none was found."""
        known = [one for one in self.paths if one.solution.status.has_path]
        return min(known, key=lambda one: one.solution.cost, default=None)

    @property
    def lower_bound(self) -> float:
        """The least bound: no path at one of these altitudes costs less. NaN if one is missing."""
        bounds = [one.solution.lower_bound for one in self.paths]
        return math.nan if any(map(math.isnan, bounds)) else min(bounds)

    @property
    def gap(self) -> float:
        """Excess of the best cost over the bound, as a ratio; infinite without a path or a bound."""
        best, bound = self.best, self.lower_bound
        return max(best.solution.cost / bound - 1.0, 0.0) if best is not None and bound > 0.0 else math.inf

    @property
    def closed_everywhere(self) -> frozenset[str]:
        """Names of the zones that are closed at all altitudes whose map is known."""
        named = [frozenset(one.closed) for one in self.paths if one.scenario is not None]
        return frozenset.intersection(*named) if named else frozenset()

    def rows(self) -> Iterator[dict[str, str]]:
        """Yield a row of a table for each altitude, numbers as text."""
        everywhere = self.closed_everywhere
        for one in self.paths:
            found = one.solution
            numbers = {key: getattr(found, key) for key in ("cost", "lower_bound", "length", "risk")}
            text = {key: f"{value:.7g}" if math.isfinite(value) else "-" for key, value in numbers.items()}
            here = [name for name in one.closed if name not in everywhere]
            yield {
                "altitude": f"{one.altitude:g} m",
                "status": found.status.label,
                "cost": text["cost"],
                "bound": "no path" if math.isinf(found.lower_bound) else text["lower_bound"],
                "gap": f"{found.gap:.2%}" if math.isfinite(found.gap) else "-",
                "length": text["length"],
                "risk": text["risk"],
                "closed": str(len(one.closed)),
                "closed here, not everywhere": listed(here, _MOST_NAMED) if here else "",
            }

    def document(self) -> dict[str, Any]:
        """Return it as JSON; numbers that are not finite are None."""
        best, everywhere = self.best, self.closed_everywhere
        return {
            "best": None if best is None else best.altitude,
            "lower_bound": json_number(self.lower_bound),
            "gap": json_number(self.gap),
            "no_path": math.isinf(self.lower_bound),
            "paths": [one.document(everywhere) for one in self.paths],
        }


def best_altitude(
    open_at: Callable[[float], Scenario | Problem],
    altitudes: Sequence[float],
    *,
    solver: str | Solver = "hybrid",
    tolerance: float | None = TOLERANCE,
    find: Callable[[Scenario], Solution] | None = None,
    **settings: Any,  # noqa: ANN401 - each solver has settings of its own
) -> BestAltitude:
    """
    Plan a flight at each of several altitudes, with a bound of the cost of every path at any of them.

    Zones and terrain are closed at some altitudes only, so each altitude has a map of its own. An area closed at one
    altitude may contain the start or the goal: then there is no path at it.

    Parameters
    ----------
    open_at
        Opens the map at an altitude, metres: `cgla_graph.load_scenario` with ``zones={"altitude": …}``, for example.
        Its error is that of the call if it is raised at all altitudes.
    altitudes
        Metres, at most 100, above what `open_at` says; equal ones count once.
    solver
        As `cgla_graph.solve` takes it.
    tolerance
        Wanted gap of each bound, as a ratio; None for none.
    find
        Finds the path and the bound on a map, instead of `solver`.
    **settings
        As `cgla_graph.solve` takes them.

    Raises
    ------
    ProblemError
        If there is no altitude, there are more than 100, or one is not finite.
    CglaError
        If the map cannot be opened at any of them.

    Examples
    --------
    >>> import shapely
    >>> tower = shapely.box(4, -5, 5, 2)
    >>> def open_at(metres: float) -> Problem:
    ...     return Problem((0, 0), (9, 0), bounds=(0, -5, 9, 5), no_fly=tower if metres < 80 else None)
    >>> found = best_altitude(open_at, [60, 100], tolerance=0.01)
    >>> found.best.altitude, round(found.lower_bound, 2), [round(one.solution.cost, 2) for one in found.paths]
    (100.0, 9.0, [9.94, 9.0])
    """
    for name, one in (("open_at", open_at), ("find", find)):
        if not callable(one) and (name == "open_at" or one is not None):
            msg = f"{name} is {kind_of(one)}; give a function"
            raise ProblemError(msg)
    chosen = list(dict.fromkeys(number_array("altitudes", altitudes).ravel().tolist()))
    if not 0 < len(chosen) <= MOST_ALTITUDES or not all(map(math.isfinite, chosen)):
        msg = f"altitudes has {len(chosen)} values; give 1 to {MOST_ALTITUDES} finite numbers of metres"
        raise ProblemError(msg)
    opened = [_opened(open_at, altitude) for altitude in chosen]
    first = opened[0]
    if isinstance(first, CglaError) and all(isinstance(one, CglaError) for one in opened):
        raise first
    ready = None if find is not None else registry.ready(solver, settings)

    def found_on(scenario: Scenario) -> Solution:
        if find is not None or ready is None:
            return find(scenario) if find is not None else Solution(Status.NOT_FOUND)
        solution = solve_or_fail(scenario.problem, ready, resolution=scenario.lattice)
        return solution if tolerance is None else proven(scenario.problem, solution, tolerance)

    pairs = waiting("altitudes", zip(chosen, opened, strict=True), len(chosen))
    return BestAltitude(tuple(_at(altitude, one, found_on) for altitude, one in pairs))


def _opened(open_at: Callable[[float], Scenario | Problem], altitude: float) -> Scenario | CglaError:
    """Open the map at an altitude, or return the error."""
    try:
        return as_scenario(open_at(altitude), "map")
    except (ProblemError, ScenarioError) as error:
        return error
    except TypeError as error:
        msg = f"open_at({altitude:g}) fails: {error}; give a function that takes metres and returns a map"
        raise ProblemError(msg) from error


def _at(altitude: float, opened: Scenario | CglaError, found_on: Callable[[Scenario], Solution]) -> AtAltitude:
    """Return the path at an altitude."""
    if isinstance(opened, CglaError):
        # (the map is there at another altitude: at this one, start, goal or the flight itself is not allowed)
        return AtAltitude(altitude, Solution(Status.NO_PATH, lower_bound=math.inf, message=str(opened)))
    account, terrain = opened.zones, opened.terrain
    closed = () if account is None else tuple(one.label for one in account.records if one.state == "closed")
    ground = ("terrain",) if terrain is not None and terrain.shape is not None else ()
    return AtAltitude(altitude, found_on(opened), opened, (*closed, *ground))
