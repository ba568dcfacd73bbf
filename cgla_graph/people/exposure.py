"""Expected fatalities of a flight and of a flight hour, with what a proven bound says about every other path."""

import dataclasses
import math
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from cgla_graph._text import ShortRepr, duration, figure, json_number, rounded_down
from cgla_graph._types import FloatArray
from cgla_graph._validate import instance, non_negative_number, point_array, positive_number
from cgla_graph.errors import ProblemError
from cgla_graph.model.earth import EDGE_METRES
from cgla_graph.model.failure_model import SECONDS_AN_HOUR, FailureModel
from cgla_graph.model.ground_risk import filled_text, people_layers
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.risk import RiskField
from cgla_graph.model.solution import Solution
from cgla_graph.people.below import (
    DensityLimit,
    density_limit,
    greatest_below,
    held_against,
    length_outside,
    overlap,
    people_on,
)
from cgla_graph.people.units import AIRCRAFT, fatality_factor, is_fatalities, risk_unit

#: A proven bound is lowered, and a length raised, by this part, for rounding.
_ROUNDING = 1e-12
#: The line of rasters without a unit.
UNKNOWN = "values in a unit of their own; if they are people, say so: kind count (of cells), or unit people/km2"
#: Significant digits.
_DIGITS = 4


@dataclass(frozen=True)
class Exposure(ShortRepr):
    """
    People on the ground below a path.

    Attributes
    ----------
    unit
        Unit of the risk of the path.
    length
        Length of the path, map units.
    fatalities
        Expected fatalities of the flight; NaN without a model of failures.
    model
        The aircraft that fails; None without one, or if rasters have different ones.
    people
        People on the map; NaN if they are not known.
    corridor
        Whole width of the corridor, map units.
    greatest
        Greatest density of a cell under the corridor, in `density_unit`, or a bound of it where layers on different
        cells add up; NaN without rasters.
    limit
        The limit of that density; None without one.
    density_unit
        Unit of `greatest`.
    filled
        What cells without data count as, in the unit of the density; None if there are none.
    outside
        Length of the path where no people are known, outside the rasters, map units.
    target
        Greatest expected fatalities of a flight hour that are asked for; None without one.
    stretch
        By which factor lengths on the map may exceed those on the Earth.
    least_fatalities
        Proven: no path that is at most as long as this one has fewer expected fatalities. 0 without a proof.
    least_length
        Proven: no path that meets the target is shorter, map units. 0 without a proof.
    """

    unit: str
    length: float
    fatalities: float = math.nan
    model: FailureModel | None = None
    people: float = math.nan
    corridor: float = 0.0
    greatest: float = math.nan
    limit: DensityLimit | None = field(default=None, repr=False)
    density_unit: str = ""
    filled: float | None = None
    outside: float = 0.0
    target: float | None = None
    stretch: float = 1.0
    least_fatalities: float = 0.0
    least_length: float = 0.0

    @property
    def hours(self) -> float:
        """Time of the flight at the speed of the model, hours; NaN without one."""
        return math.nan if self.model is None else self.model.hours(self.length)

    @property
    def per_hour(self) -> float:
        """Expected fatalities of a flight hour; NaN without a model, or if the path has no length."""
        return self.fatalities / self.hours if self.hours > 0.0 else math.nan

    @property
    def meets_target(self) -> bool | None:
        """Whether the target is met, on the Earth too; None without a target, or if it is not known."""
        if self.target is None or not math.isfinite(self.per_hour) or self.outside > 0.0:
            return None
        return self.per_hour * self.stretch <= self.target

    @property
    def meets_limit(self) -> bool | None:
        """Whether no cell under the corridor is above the limit; None without a limit, or if it is not known."""
        if self.limit is None:
            return None
        if self.greatest > self.limit.level:
            return False
        return None if self.outside > 0.0 else True

    @property
    def faults(self) -> list[str]:
        """Limits that are not met, or unknown, one sentence each."""
        found = []
        if self.limit is not None and self.meets_limit is False:
            found.append(
                f"the greatest density under the corridor is {self.greatest:.6g} {self.limit.unit}, above the limit "
                f"of {self.limit.level:g}"
            )
        if self.target is not None and self.meets_target is False:
            rate = f"{figure(self.per_hour, _DIGITS)} expected fatalities per flight hour"
            found.append(f"{rate}, above the target of {self.target:g}")
        asked = self.limit is not None or self.target is not None
        if asked and self.outside > 0.0:
            found.append(
                f"{figure(self.outside, _DIGITS)} m of the path lie outside the raster, where no people are known: "
                "give a raster that covers it"
            )
        return found

    def lines(self, *, windy: bool = False) -> dict[str, str]:
        """Return the lines that commands print, by their keys; if it is `windy`, with a note on the wind."""
        if not self.unit:
            return {}
        width = f"the corridor, {self.corridor:g} m wide" if self.corridor > 0.0 else "the path"
        limit = "" if self.limit is None else f", limit {self.limit.level:g}"
        below = f"up to {self.greatest:.4g} {self.density_unit} under {width}{limit}"
        below += filled_text(self.filled)
        known = math.isfinite(self.people)
        lines = {
            "people": f"{self.people:,.0f} on the map; {below}" if known else "",
            "density": "" if known else below,
            "fatalities": "",
            "model": "" if self.model is None else str(self.model),
            "target": self._target_line(),
            "at least": "",
            "unknown": self._unknown_line(),
            "limit": "" if self.limit is None else "; ".join(self.limit.notes),
            "taken as": UNKNOWN if "own unit" in self.unit else "",
        }
        if windy and self.model is not None:
            lines["model"] += "; the risk is that of this speed over ground, without the wind"
        if math.isfinite(self.fatalities):
            flight = f"{figure(self.fatalities, _DIGITS)} expected per flight"
            hour = f", {figure(self.per_hour, _DIGITS)} per flight hour" if math.isfinite(self.per_hour) else ""
            lines["fatalities"] = f"{flight}{hour}"
            if self.model is not None:
                lines["fatalities"] += f" ({duration(SECONDS_AN_HOUR * self.hours)} at {self.model.speed:g} m/s)"
        if self.least_fatalities > 0.0:
            least = rounded_down(self.least_fatalities, _DIGITS)
            lines["at least"] = (
                f"proven: every allowed path at most as long as this one has at least {least} expected fatalities"
            )
        return lines

    def _target_line(self) -> str:
        if self.target is None:
            return ""
        met = {True: "met", False: "missed", None: "not known"}[self.meets_target]
        words = f"{met}: at most {self.target:g} expected fatalities per flight hour"
        if self.meets_target is False and self.least_length > 0.0:
            shown = rounded_down(self.least_length, 6)
            longer = "longer than this one: " if self.least_length > self.length else ""
            words += f"; proven: every allowed path that meets it is {longer}at least {shown} m"
        return words

    def _unknown_line(self) -> str:
        if not self.outside > 0.0:
            return ""
        return f"{figure(self.outside, _DIGITS)} of the path lie outside the raster, where the risk counts as 0"

    def document(self) -> dict[str, Any]:
        """Return it as JSON; numbers that are not known are None."""
        model = None if self.model is None else {**vars(self.model), "text": str(self.model)}
        return {
            "unit_of_risk": self.unit,
            "fatalities_per_flight": json_number(self.fatalities),
            "fatalities_per_hour": json_number(self.per_hour),
            "hours": json_number(self.hours),
            "model": model,
            "people_on_map": json_number(self.people),
            "corridor": self.corridor,
            "greatest_density": json_number(self.greatest),
            "density_unit": self.density_unit,
            "max_density": None if self.limit is None else self.limit.level,
            "notes": [] if self.limit is None else self.limit.notes,
            "meets_max_density": self.meets_limit,
            "target_per_hour": self.target,
            "meets_target": self.meets_target,
            "least_fatalities_at_this_length": self.least_fatalities or None,
            "least_length_for_target": self.least_length or None,
            "without_data": self.filled,
            "length_outside": self.outside,
        }


def exposure(
    problem: Problem,
    path: Solution | ArrayLike,
    *,
    corridor: float = 0.0,
    max_density: float | None = None,
    target: float | None = None,
    lower_bound: float | None = None,
) -> Exposure:
    """
    Compute the density of people and the expected fatalities below a path.

    Parameters
    ----------
    problem
        With rasters; those of `ground_risk` give fatalities.
    path
        A solution with a path, or waypoints, shape ``(m, 2)``, map units.
    corridor
        Whole width of the corridor under which the greatest density is sought, map units.
    max_density
        Limit of that density: people per km2 where people are known, else in the raster's own unit.
    target
        Limit of the expected fatalities of a flight hour, as 1e-6.
    lower_bound
        A proven bound of the cost of all paths, for what holds for every other path; None for that of the solution.

    Returns
    -------
    exposure
        Its numbers with their units.

    Raises
    ------
    ProblemError
        If a number is out of range, or there is a target without a model of failures, or a limit without a raster.

    Notes
    -----
    Every path costs ``length + k * risk >= bound``. So one with ``length <= L`` has ``risk >= (bound - L) / k``. One
    that meets the target, ``risk <= c * length`` with ``c = target / (3600 * speed)``, has ``length >= bound /
    (1 + c * k)``. On the Earth, bounds hold for lengths and risks measured there, which are at most those on the map;
    so both hold for either.

    Examples
    --------
    >>> from cgla_graph.model.ground_risk import ground_risk
    >>> from cgla_graph.model.risk_raster import RasterRisk
    >>> town = RasterRisk([[200.0, 5000.0]], bounds=(0, 0, 2000, 1000))
    >>> risk = ground_risk(town, unit="people/km2", failures_per_hour=1e-3, speed=20, lethal_area=6.5)
    >>> problem = Problem((100, 500), (900, 500), RiskField(rasters=[risk]), bounds=town.bounds)
    >>> found = exposure(problem, [(100, 500), (900, 500)], max_density=500, target=1e-5)
    >>> found.people, found.greatest, found.meets_limit, found.meets_target
    (5200.0, 200.0, True, True)
    """
    instance("problem", problem, Problem, problem_wanted)
    solution = path if isinstance(path, Solution) else None
    places = point_array("path", path.path if isinstance(path, Solution) else path).reshape(-1, 2)
    width = non_negative_number("corridor", corridor)
    held, unit = problem.field, risk_unit(problem.field)
    rate = None if target is None else positive_number("target", target)
    models = {raster.failures for raster in held.rasters if is_fatalities(raster)}
    model = models.pop() if len(models) == 1 else None
    if rate is not None and model is None:
        msg = f"a target of expected fatalities per flight hour needs the aircraft that fails and its speed; {AIRCRAFT}"
        raise ProblemError(msg)
    limit = None if max_density is None else density_limit(problem, non_negative_number("max_density", max_density))
    length, fatalities = float(np.hypot(*np.diff(places, axis=0).T).sum()), _fatalities(held, places)
    if solution is not None:
        # (those of arcs, where there are any)
        length, factor = solution.length, fatality_factor(held)
        fatalities = solution.risk / factor if factor > 0.0 else fatalities
    found = Exposure(unit, length, fatalities, model, corridor=width, limit=limit, target=rate)
    bound = lower_bound if lower_bound is not None else math.nan if solution is None else solution.lower_bound
    if not held.rasters or not len(places):
        return found
    people = people_layers(problem)
    layers, density_unit = held_against(problem)
    every = [raster.people or raster for raster in held.rasters if raster.people or not people]
    filled = [(one.nodata or 0.0) * one.factor for one in every if one.filled.any()]
    densities = [greatest_below(layer, places, corridor=width) for layer in layers]
    return dataclasses.replace(
        _proven(found, problem, bound),
        people=sum((people_on(layer, problem.bounds) for layer in people), 0.0) if people else math.nan,
        greatest=float(sum(densities) if overlap(layers) else max(densities)),
        density_unit=density_unit,
        filled=max(filled, default=None),
        # (the bounds of a map in degrees are that much wider than its raster)
        outside=length_outside(layers, places, rim=0.0 if problem.projection is None else 1.5 * EDGE_METRES),
        stretch=problem.stretch(places),
    )


def _fatalities(field: RiskField, path: FloatArray) -> float:
    """Return the expected fatalities along a path, for any scale of the risk; NaN if they are unknown."""
    rasters = [raster for raster in field.rasters if is_fatalities(raster)]
    if not rasters:
        return math.nan
    legs = (path[:-1], path[1:]) if len(path) > 1 else (path, path)
    return math.fsum(float(RiskField(rasters=[one]).line_integral(*legs).sum()) / one.scale for one in rasters)


def _proven(found: Exposure, problem: Problem, bound: float) -> Exposure:
    """Return what a lower bound of the cost proves about other paths."""
    factor = fatality_factor(problem.field)
    if not 0.0 < bound < math.inf or not factor > 0.0 or problem.k == 0.0:
        return found
    bound *= 1.0 - _ROUNDING
    left = bound - found.length * (1.0 + _ROUNDING)
    if left > 0.0:
        found = dataclasses.replace(found, least_fatalities=left / problem.k / factor * (1.0 - _ROUNDING))
    if found.target is not None and found.model is not None:
        slope = found.target / SECONDS_AN_HOUR / found.model.speed * factor
        length = bound / (1.0 + slope * problem.k) * (1.0 - _ROUNDING)
        if length > problem.least_length:
            found = dataclasses.replace(found, least_length=length)
    return found
