"""Units of risk, and the risk weight that prices give where risk is expected fatalities."""

import dataclasses
import math

from cgla_graph._text import figure
from cgla_graph._validate import instance
from cgla_graph.errors import ProblemError
from cgla_graph.model.failure_model import FailureModel
from cgla_graph.model.ground_risk import risk_weight
from cgla_graph.model.problem import Problem, problem_wanted
from cgla_graph.model.risk import RiskField
from cgla_graph.model.risk_raster import RasterRisk

#: What makes the risk of a raster one in expected fatalities.
AIRCRAFT = (
    "give the aircraft that fails above the people (--failures-per-hour, --speed, --lethal-area or --dimension; "
    "cg.ground_risk)"
)
REMEDY = f"{AIRCRAFT}, or say that the raster is one of fatalities per metre (--unit fatalities/m)"


def is_fatalities(raster: RasterRisk) -> bool:
    """
    Return whether the risk of a raster is one of fatalities, perhaps times a scale.

    Examples
    --------
    >>> is_fatalities(RasterRisk([[2.0]], (0, 0, 1, 1), unit="people/km2"))
    False
    """
    return raster.failures is not None or raster.unit == "fatalities/m"


def fatality_factor(field: RiskField) -> float:
    """
    Return how many units of risk an expected fatality counts: 1 if the risk is in fatalities, NaN if it is not.

    Examples
    --------
    >>> risk = RasterRisk([[2e-9]], (0, 0, 1, 1), unit="fatalities/m")
    >>> fatality_factor(RiskField(rasters=[risk])), fatality_factor(RiskField(rasters=[risk.scaled(2.0)]))
    (1.0, 2.0)
    """
    scales = {raster.scale if is_fatalities(raster) else math.nan for raster in field.rasters}
    return scales.pop() if len(scales) == 1 and not field.every_threat else math.nan


def risk_unit(field: RiskField) -> str:
    """
    Name the unit of the risk of a path.

    Examples
    --------
    >>> risk_unit(RiskField(rasters=[RasterRisk([[2.0]], (0, 0, 1, 1), unit="people/m2")]))
    'people/m2 x m'
    >>> risk_unit(RiskField(rasters=[RasterRisk([[2.0]], (0, 0, 1, 1), scale=3.0)]))
    "3 x the raster's own unit x length"
    >>> risk_unit(RiskField())
    ''
    """
    units = list(dict.fromkeys(map(_unit_of, field.rasters)))
    if units and field.every_threat:
        units.append("risk of threats")
    return units[0] if len(units) == 1 else " + ".join(units)


def risk_text(risk: float, field: RiskField, digits: int) -> str:
    """
    Write a risk with its unit.

    Examples
    --------
    >>> risk_text(2.0, RiskField(rasters=[RasterRisk([[2.0]], (0, 0, 1, 1), unit="people/m2")]), 3)
    '2.00, in people/m2 x m'
    >>> risk_text(2.0, RiskField(), 3)
    '2.00'
    """
    number, unit = figure(risk, digits), risk_unit(field)
    return f"{number} {unit}" if unit.startswith("expected") else f"{number}, in {unit}" if unit else number


def rate_text(field: RiskField, risk: float, length: float) -> str:
    """
    Write the expected fatalities of a flight and of a flight hour; empty if the risk is not one of a model of failures.

    Parameters
    ----------
    field
        The risk field.
    risk, length
        Risk and length of the flight, map units.

    Examples
    --------
    >>> town = RasterRisk([[1000.0]], (0, 0, 9, 9), unit="people/km2")
    >>> field = RiskField(rasters=[town.flown_over_by(FailureModel(1e-3, speed=20, lethal_area=6.5))])
    >>> rate_text(field, 9e-7, 10_000.0)
    '9.000e-07 expected fatalities, 6.480e-06 per flight hour at 20 m/s'
    """
    models = {raster.failures for raster in field.rasters}
    model = models.pop() if len(models) == 1 else None
    if model is None or not fatality_factor(field) > 0.0 or not length > 0.0:
        return ""
    fatalities = risk / fatality_factor(field)
    hour = figure(fatalities / model.hours(length), 4)
    return f"{figure(fatalities, 4)} expected fatalities, {hour} per flight hour at {model.speed:g} m/s"


def density_text(field: RiskField) -> str:
    """
    Return the label of the risk at a point.

    Examples
    --------
    >>> density_text(RiskField()), density_text(RiskField(rasters=[RasterRisk([[1]], (0, 0, 1, 1), unit="people/m2")]))
    ('risk per unit length', 'risk per unit length (people/m2)')
    """
    unit = risk_unit(field)
    if unit.endswith("expected fatalities"):
        return f"{unit} per metre"
    known = unit.endswith(" x m") and "own unit" not in unit
    return f"risk per unit length ({unit.removesuffix(' x m')})" if known else "risk per unit length"


def _unit_of(raster: RasterRisk) -> str:
    scaled = "" if raster.scale == 1.0 else f"{raster.scale:g} x "
    if is_fatalities(raster):
        return f"{scaled}expected fatalities"
    return f"{scaled}{raster.unit} x m" if raster.unit else f"{scaled}the raster's own unit x length"


def at_prices(problem: Problem, *, prevented_fatality: float, metre: float) -> Problem:
    """
    Return a problem with the risk weight of two prices (`risk_weight`), if its risk is in expected fatalities.

    Parameters
    ----------
    problem
        With rasters of risk from `ground_risk`, or in fatalities per metre.
    prevented_fatality, metre
        As in `risk_weight`.

    Raises
    ------
    ProblemError
        If the risk is not in expected fatalities alone, or a price is not above 0.

    Examples
    --------
    >>> risk = RasterRisk([[2e-9]], (0, 0, 9, 9), unit="fatalities/m")
    >>> problem = Problem((1, 1), (2, 2), RiskField(rasters=[risk]), bounds=(0, 0, 9, 9))
    >>> at_prices(problem, prevented_fatality=2e6, metre=0.01).k
    200000000.0
    """
    instance("problem", problem, Problem, problem_wanted)
    weight = risk_weight(prevented_fatality=prevented_fatality, metre=metre)
    if fatality_factor(problem.field) != 1.0:
        unit = risk_unit(problem.field) or (
            "units of threats" if problem.field.every_threat else "no unit: there is none"
        )
        what = f"the risk of this map is in {unit}, not in expected fatalities"
        msg = f"a price of a prevented fatality needs expected fatalities, and {what}; {REMEDY}"
        raise ProblemError(msg)
    return dataclasses.replace(problem, k=weight)


def flown_over(problem: Problem, **aircraft: float | None) -> Problem:
    """
    Return a problem whose people are flown over by an aircraft that fails: its rasters of people become fatalities.

    Parameters
    ----------
    problem
        With rasters of people.
    **aircraft
        As `cgla_graph.FailureModel.of_aircraft` takes them.

    Raises
    ------
    ProblemError
        If a number is out of range, no raster is one of people, or a raster has a scale, no unit, or another model.

    Examples
    --------
    >>> town = RasterRisk([[1000.0]], (0, 0, 9, 9), unit="people/km2")
    >>> problem = Problem((1, 1), (2, 2), RiskField(rasters=[town]), bounds=(0, 0, 9, 9))
    >>> risk_unit(flown_over(problem, failures_per_hour=1e-3, speed=20, dimension=1).field)
    'expected fatalities'
    """
    instance("problem", problem, Problem, problem_wanted)
    given: dict[str, float] = {name: value for name, value in aircraft.items() if value is not None}
    for name in ("failures_per_hour", "speed"):
        if name not in given:
            option = f"--{name.replace('_', '-')}"
            msg = f"{name} of the aircraft is missing, and there is no default; give it ({option})"
            raise ProblemError(msg)
    model = FailureModel.of_aircraft(**given)
    if not problem.field.rasters:
        msg = "the map has no raster of people that an aircraft could fail above; give one"
        raise ProblemError(msg)
    rasters = [raster.flown_over_by(model) for raster in problem.field.rasters]
    field = RiskField(problem.field.threats, rasters=rasters, improper=problem.field.improper)
    return dataclasses.replace(problem, field=field)
